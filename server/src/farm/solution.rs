//! How a job's scene was solved before its first sample, as its workers say.

use super::{
    Farm,
    error::{FarmError, Result},
};
use crate::blobs::{BlobError, BlobName};
use bytes::Bytes;
use ovtigre_core::{radiosity::report::RadiosityReport, settings::Method};
use ovtigre_proto::id::JobId;

impl Farm {
    /// Keeps what a worker says of a job, whose method is radiosity. All workers solve a scene alike: what came first stays.
    pub(super) async fn keep_solution(&self, job: &JobId, json: &str) -> Result<()> {
        let name = BlobName::Solution(job.clone());
        match self.blobs.size(&name).await {
            Ok(_) => return Ok(()),
            Err(BlobError::Missing(_)) => {}
            Err(other) => return Err(other.into()),
        }
        let report: RadiosityReport = serde_json::from_str(json)
            .map_err(|e| FarmError::Sum(format!("its 'ovtigre.solution' is no report of radiosity: {e}")))?;
        let json = serde_json::to_vec(&report).expect("a report is plain data");
        self.blobs.put(&name, Bytes::from(json)).await?;
        Ok(())
    }

    /// What is kept of a job.
    pub(super) async fn solution_of(&self, job: &JobId, method: Method) -> Result<Option<RadiosityReport>> {
        if method != Method::Radiosity {
            return Ok(None);
        }
        match self.blobs.get(&BlobName::Solution(job.clone())).await {
            Ok(json) => Ok(serde_json::from_slice(&json).ok()),
            Err(BlobError::Missing(_)) => Ok(None),
            Err(other) => Err(other.into()),
        }
    }
}
