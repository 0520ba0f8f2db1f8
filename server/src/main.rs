//! The program `ovtigre`.

mod command;

use clap::Parser as _;
use command::{exit::Exit, line::Line, terminal};
use ovtigre::fail_point;
use ovtigre_worker::flags::usage;
use std::process::ExitCode;

fn main() -> ExitCode {
    if let Err(lack) = ovtigre_worker::processor::check() {
        terminal::error(&lack);
        return Exit::Wrong.into();
    }
    if cfg!(debug_assertions)
        && let Ok(place) = std::env::var("OVTIGRE_FAIL_POINT")
        && let Err(wrong) = fail_point::choose(&place)
    {
        terminal::error(&wrong);
        return Exit::Wrong.into();
    }
    match Line::try_parse() {
        Ok(line) => line.run(),
        Err(error) if error.use_stderr() && !usage(&error).is_empty() => {
            terminal::error(&usage(&error));
            Exit::Wrong.into()
        }
        Err(help) => help.exit(),
    }
}
