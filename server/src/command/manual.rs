//! `ovtigre manual`: pages for `man`, one a command.

use super::{
    exit::{CommandError, Outcome},
    output,
};
use clap::{Args, Command};
use clap_mangen::Man;
use std::path::{Path, PathBuf};

/// Write pages for `man` into a folder: ovtigre.1, and one for each command.
#[derive(Args, Debug)]
pub(crate) struct Manual {
    /// The folder, such as ~/.local/share/man/man1; made where it is not there.
    #[arg(value_name = "DIR")]
    folder: PathBuf,
}

impl Manual {
    /// Writes them.
    pub(crate) fn run(self, line: Command) -> Outcome {
        std::fs::create_dir_all(&self.folder).map_err(|error| {
            CommandError::wrong(format!("the folder '{}' cannot be made: {error}", self.folder.display()))
        })?;
        let mut line = line.disable_help_subcommand(true);
        line.build();
        page(&line, "ovtigre", &self.folder)?;
        for command in line.get_subcommands() {
            page(command, &format!("ovtigre-{}", command.get_name()), &self.folder)?;
        }
        Ok(())
    }
}

fn page(command: &Command, name: &str, folder: &Path) -> Outcome {
    let mut text = Vec::new();
    let made = Man::new(command.clone()).render(&mut text);
    made.map_err(|error| CommandError::failed(format!("the page of {name} cannot be made: {error}")))?;
    output::save_bytes(&text, &folder.join(format!("{name}.1")))
}
