//! `ovtigre submit`: a scene to a farm.

use super::{
    exit::Outcome,
    farm_flags::FarmFlags,
    follow::{Workers, until_over},
    interrupt::Interrupt,
    job_flags::JobFlags,
    progress::{Others, Progress},
    submission::Submission,
    terminal,
};
use clap::Args;
use std::path::PathBuf;

/// Submit a scene; with `-o` or `--report` also wait for it.
#[derive(Args, Debug)]
pub(crate) struct Submit {
    /// Scene to render: .glb, or .gltf with its files beside it.
    #[arg(value_name = "SCENE")]
    scene: PathBuf,
    #[command(flatten)]
    job: JobFlags,
    #[command(flatten)]
    farm: FarmFlags,
}

impl Submit {
    /// Submits.
    pub(crate) async fn run(self) -> Outcome {
        let client = self.farm.client()?;
        let mut submission = Submission::read(&self.scene, self.job).await?;
        let job = submission.submit(&client).await?;
        if self.farm.json {
            terminal::json(&job);
        } else {
            terminal::result(job.id.as_str());
        }
        if !submission.wants_files() {
            for warning in &job.warnings {
                terminal::remark(&format!("warning: {warning}"));
            }
            return Ok(());
        }
        let interrupt = Interrupt::listen();
        let mut truth = submission.truth.take();
        let mut progress = Progress::new(Others::None);
        progress.show(&job);
        let workers = Workers::Theirs;
        let status =
            until_over(&client, &job.id, &mut progress, &interrupt, &workers, truth.as_mut()).await?;
        drop(progress);
        submission.collect(&client, &status, truth.as_ref()).await
    }
}
