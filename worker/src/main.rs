//! The program `ovtigre-worker`.

use clap::Parser;
use ovtigre_proto::telemetry::traces::Traces;
use ovtigre_worker::{
    flags::{WorkFlags, usage},
    leave::Bell,
    log::LogFlags,
    processor,
    run::run,
};
use std::{
    io::{Write as _, stderr},
    process::{ExitCode, id},
};

/// Works for an ovtigre farm: leases batches, renders them and sends back their sums.
#[derive(Parser)]
#[command(version)]
struct Line {
    #[command(flatten)]
    work: WorkFlags,
    #[command(flatten)]
    log: LogFlags,
}

fn main() -> ExitCode {
    let line = match Line::try_parse() {
        Ok(line) => line,
        Err(error) if error.use_stderr() => {
            writeln!(stderr(), "error: {}", usage(&error)).ok();
            return ExitCode::from(2);
        }
        Err(help) => help.exit(),
    };
    match processor::check().map_err(anyhow::Error::msg).and_then(|()| work(&line)) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            writeln!(stderr(), "error: {error:#}").ok();
            ExitCode::from(2)
        }
    }
}

fn work(line: &Line) -> anyhow::Result<()> {
    line.log.start();
    let runtime = tokio::runtime::Builder::new_multi_thread().worker_threads(2).enable_all().build()?;
    let result = runtime.block_on(async {
        let bell = Bell::default();
        tokio::spawn(bell.clone().ring_on_signals(line.work.first_signal()));
        if line.work.until_stdin_closes {
            tokio::spawn(bell.clone().ring_when_stdin_closes());
        }
        let traces = Traces::from_environment("ovtigre-worker")?;
        anyhow::Ok(run(line.work.config(u64::from(id()), traces), bell).await?)
    });
    // A scene that is being prepared, or standard input, may keep a thread busy.
    runtime.shutdown_background();
    result
}
