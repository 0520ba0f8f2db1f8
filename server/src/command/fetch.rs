//! `ovtigre fetch`: a job's picture so far.

use super::{
    exit::{CommandError, Outcome},
    farm_flags::FarmFlags,
    output::{self, Kind, check_writable, kind},
    terminal,
};
use clap::Args;
use ovtigre_proto::{client::jobs::Development, id::JobId};
use serde::Serialize;
use std::path::PathBuf;

/// Fetch a job's picture so far.
#[derive(Args, Debug)]
pub(crate) struct Fetch {
    /// Job whose picture it is.
    #[arg(value_name = "JOB")]
    job: JobId,
    /// File to write: .exr, or .png for a developed picture [default: JOB.exr].
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Layer to develop, for .png [default: the picture].
    #[arg(long, value_name = "NAME")]
    layer: Option<String>,
    /// Stops brighter, for .png [default: 0].
    #[arg(long, value_name = "STOPS", allow_hyphen_values = true)]
    exposure: Option<f32>,
    /// Columns of a smaller picture, for .png [default: all].
    #[arg(long, value_name = "PIXELS", value_parser = clap::value_parser!(u32).range(1..))]
    width: Option<u32>,
    #[command(flatten)]
    farm: FarmFlags,
}

#[derive(Serialize)]
struct Fetched {
    file: PathBuf,
    etag: Option<String>,
}

impl Fetch {
    /// Fetches.
    pub(crate) async fn run(self) -> Outcome {
        let client = self.farm.client()?;
        let file = self.output.unwrap_or_else(|| format!("{}.exr", self.job).into());
        check_writable(&file)?;
        let development = Development { layer: self.layer, exposure: self.exposure, width: self.width };
        let answer = match kind(&file)? {
            Kind::Png => client.developed(&self.job, &development).await?,
            Kind::Exr if development == Development::default() => client.image(&self.job, None, None).await?,
            Kind::Exr => {
                return Err(CommandError::wrong(
                    "an .exr is not developed: --layer, --exposure and --width need .png",
                ));
            }
        };
        let etag = answer.etag();
        output::save(answer, &file).await?;
        if self.farm.json {
            terminal::json(&Fetched { file, etag });
        } else {
            terminal::result(&file.display().to_string());
        }
        Ok(())
    }
}
