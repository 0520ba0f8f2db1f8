//! The program `ovtigre`.

mod command;

use clap::Parser as _;
use command::{exit::Exit, line::Line, terminal};
use std::process::ExitCode;

fn main() -> ExitCode {
    if let Err(lack) = ovtigre_worker::processor::check() {
        terminal::error(&lack);
        return Exit::Wrong.into();
    }
    Line::parse().run()
}
