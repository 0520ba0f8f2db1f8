//! Calls about jobs.

use super::{
    answer::Answer,
    call::{Call, Repeat},
    error::ClientError,
    farm::Client,
    pages::Pages,
};
use crate::{
    curve::Curve,
    id::JobId,
    job::{JobPatch, JobRequest},
    route,
    status::{JobState, JobStatus},
};
use reqwest::{
    Method,
    header::{HeaderName, IF_NONE_MATCH},
};
use std::time::Duration;

const IDEMPOTENCY_KEY: HeaderName = HeaderName::from_static("idempotency-key");
const PREFER: HeaderName = HeaderName::from_static("prefer");
/// Time that a farm may take to try methods on a scene before it takes a job: seconds of a processor that may be busy.
const TRIAL_MAX: Duration = Duration::from_mins(1);

/// Which picture of a job.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Development {
    /// A layer by name; the picture itself where `None`.
    pub layer: Option<String>,
    /// Stops brighter than the picture.
    pub exposure: Option<f32>,
    /// Columns, where it should be smaller.
    pub width: Option<u32>,
}

impl Client {
    /// Submits a job. `key` makes a repeated call the same job.
    pub async fn submit(&self, request: &JobRequest, key: &str) -> Result<JobStatus, ClientError> {
        let call = Call::new(Method::POST, route::JOBS).json(request).wait(TRIAL_MAX);
        self.send(&call.header(IDEMPOTENCY_KEY, key).repeat(Repeat::Harmless)).await?.json().await
    }

    /// How a job stands.
    pub async fn job(&self, id: &JobId) -> Result<JobStatus, ClientError> {
        self.send(&Call::new(Method::GET, route::job(id))).await?.json().await
    }

    /// All jobs, those in `state` where it is given.
    pub fn jobs(&self, state: Option<JobState>) -> Pages<JobStatus> {
        let mut call = Call::new(Method::GET, route::JOBS);
        if let Some(state) = state {
            call = call.query("state", &state.name());
        }
        Pages::new(self.clone(), call)
    }

    /// Changes a job. Setting the same twice is the same as once.
    pub async fn change(&self, id: &JobId, patch: &JobPatch) -> Result<JobStatus, ClientError> {
        let call = Call::new(Method::PATCH, route::job(id)).json(patch).repeat(Repeat::Harmless);
        self.send(&call).await?.json().await
    }

    /// Stops a job; its picture so far is kept. Answers how it stands then.
    pub async fn cancel(&self, id: &JobId) -> Result<JobStatus, ClientError> {
        self.send(&Call::new(Method::DELETE, route::job(id))).await?;
        self.job(id).await
    }

    /// Error against run time.
    pub async fn curve(&self, id: &JobId) -> Result<Curve, ClientError> {
        self.send(&Call::new(Method::GET, route::job_part(id, "error.json"))).await?.json().await
    }

    /// The picture so far as EXR, if it is another than version `known`, waiting for one up to `wait`.
    pub async fn image(
        &self,
        id: &JobId,
        known: Option<&str>,
        wait: Option<Duration>,
    ) -> Result<Answer, ClientError> {
        let mut call = Call::new(Method::GET, route::job_part(id, "image.exr")).wait(Duration::from_mins(1));
        if let Some(etag) = known {
            call = call.header(IF_NONE_MATCH, etag);
        }
        if let Some(wait) = wait {
            call =
                call.header(PREFER, &format!("wait={}", wait.as_secs())).wait(wait + Duration::from_mins(1));
        }
        self.send(&call).await
    }

    /// The picture so far as PNG.
    pub async fn developed(&self, id: &JobId, how: &Development) -> Result<Answer, ClientError> {
        let mut call = Call::new(Method::GET, route::job_part(id, "image.png")).wait(Duration::from_mins(1));
        if let Some(layer) = &how.layer {
            call = call.query("layer", layer);
        }
        if let Some(exposure) = how.exposure {
            call = call.query("exposure", &exposure);
        }
        if let Some(width) = how.width {
            call = call.query("width", &width);
        }
        self.send(&call).await
    }
}
