//! `ovtigre completions`: the command line for a shell that completes it.

use super::terminal;
use clap::{Args, Command};
use clap_complete::{Shell, generate};

/// Print a script that lets a shell complete commands and flags.
#[derive(Args, Debug)]
pub(crate) struct Completions {
    /// The shell: bash, zsh, fish, elvish or powershell.
    #[arg(value_name = "SHELL", value_enum)]
    shell: Shell,
}

impl Completions {
    /// Prints it.
    pub(crate) fn run(self, mut line: Command) {
        let mut script = Vec::new();
        generate(self.shell, &mut line, "ovtigre", &mut script);
        terminal::result(String::from_utf8_lossy(&script).trim_end());
    }
}
