//! The command line.

use super::{
    bake, bench, cancel, check, compare, completions, exit::Outcome, fetch, manual, pause, render, resume,
    serve, status, submit, terminal, token, watch, work, workers,
};
use clap::{CommandFactory as _, Parser, Subcommand};
use std::process::ExitCode;

/// A render farm whose pictures come with error bars.
#[derive(Debug, Parser)]
#[command(name = "ovtigre", version, max_term_width = 110)]
pub(crate) struct Line {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Render a scene: start a farm on this machine, submit, wait, fetch the picture, stop the farm.
    Render(Box<render::Render>),
    /// Run a farm.
    Serve(serve::Serve),
    /// Work for a farm.
    Work(work::Work),
    /// Submit a scene to a farm.
    Submit(Box<submit::Submit>),
    /// Show how jobs stand.
    Status(status::Status),
    /// Follow a job until it is over.
    Watch(watch::Watch),
    /// Fetch a job's picture so far.
    Fetch(fetch::Fetch),
    /// Hand out no more batches of a job until it is resumed.
    Pause(pause::Pause),
    /// Go on with a paused job.
    Resume(resume::Resume),
    /// Stop a job; its picture so far is kept.
    Cancel(cancel::Cancel),
    /// Show who works.
    Workers(workers::Workers),
    /// Make, list and revoke the tokens of a farm.
    Token(token::Token),
    /// Say what is in a scene, what a render of it needs and leaves out, and every problem.
    Check(check::Check),
    /// Solve the diffuse light of a scene and write it as a glTF scene that other viewers show.
    Bake(bake::Bake),
    /// Measure error against run time of methods over scenes.
    Bench(bench::Bench),
    /// Compare two pictures.
    Compare(compare::Compare),
    /// Print a script that lets a shell complete commands and flags.
    Completions(completions::Completions),
    /// Write pages for `man`, one a command.
    Manual(manual::Manual),
}

impl Line {
    /// Runs the command and says how it ended.
    pub(crate) fn run(self) -> ExitCode {
        let runtime = match tokio::runtime::Builder::new_multi_thread().enable_all().build() {
            Ok(runtime) => runtime,
            Err(error) => {
                terminal::error(&format!("cannot start threads: {error}"));
                return ExitCode::FAILURE;
            }
        };
        let outcome = runtime.block_on(self.command.run());
        // A worker that leaves at once may still be preparing a scene.
        runtime.shutdown_background();
        match outcome {
            Ok(code) => code,
            Err(error) => {
                terminal::error(&error.line);
                error.exit.into()
            }
        }
    }
}

impl Command {
    async fn run(self) -> Outcome<ExitCode> {
        match self {
            Self::Render(command) => command.run().await?,
            Self::Serve(command) => command.run().await?,
            Self::Work(command) => command.run().await?,
            Self::Submit(command) => command.run().await?,
            Self::Status(command) => command.run().await?,
            Self::Watch(command) => command.run().await?,
            Self::Fetch(command) => command.run().await?,
            Self::Pause(command) => command.run().await?,
            Self::Resume(command) => command.run().await?,
            Self::Cancel(command) => command.run().await?,
            Self::Workers(command) => command.run().await?,
            Self::Token(command) => command.run().await?,
            Self::Check(command) => command.run()?,
            Self::Bake(command) => command.run().await?,
            Self::Bench(command) => command.run().await?,
            Self::Compare(command) => return command.run(),
            Self::Completions(command) => command.run(Line::command()),
            Self::Manual(command) => command.run(Line::command())?,
        }
        Ok(ExitCode::SUCCESS)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn flags_do_not_contradict_each_other() {
        Line::command().debug_assert();
    }

    #[test]
    fn every_flag_is_explained() {
        for command in Line::command().get_subcommands() {
            for argument in command.get_arguments().filter(|argument| argument.get_id() != "help") {
                assert!(argument.get_help().is_some(), "{} {}", command.get_name(), argument.get_id());
            }
        }
    }
}
