//! A job's events, through lost connections and restarts of the farm.

use super::{answer::Answer, backoff::Backoff, call::Call, error::ClientError, farm::Client, sse::Parser};
use crate::{
    id::JobId,
    route,
    status::{JobEvent, JobStatus},
};
use reqwest::{
    Method,
    header::{ACCEPT, HeaderName},
};

const LAST_EVENT_ID: HeaderName = HeaderName::from_static("last-event-id");
/// Tries to come back: about half a minute, a farm's restart.
const ATTEMPTS: u32 = 12;

/// A job's events; ends after the one that says that it is over.
#[derive(Debug)]
pub struct Events {
    client: Client,
    job: JobId,
    stream: Option<Answer>,
    parser: Parser,
    last: Option<String>,
    over: bool,
    backoff: Backoff,
}

impl Client {
    /// A job's events, from how it stands now.
    pub fn events(&self, job: &JobId) -> Events {
        Events {
            client: self.clone(),
            job: job.clone(),
            stream: None,
            parser: Parser::default(),
            last: None,
            over: false,
            backoff: self.backoff(),
        }
    }
}

impl Events {
    /// The next event; `None` after the job is over. After an error it may be called again.
    pub async fn next(&mut self) -> Result<Option<JobEvent>, ClientError> {
        while !self.over {
            while let Some(message) = self.parser.pop() {
                self.last = message.id;
                // Words of a newer farm are passed over.
                if let Ok(event) = serde_json::from_str::<JobEvent>(&message.data) {
                    self.backoff.reset();
                    return Ok(Some(self.seen(event)));
                }
            }
            if let Some(status) = self.read_on().await? {
                return Ok(Some(self.seen(JobEvent::Status(Box::new(status)))));
            }
        }
        Ok(None)
    }

    fn seen(&mut self, event: JobEvent) -> JobEvent {
        if let JobEvent::Status(status) = &event {
            self.over = status.state.is_over();
        }
        event
    }

    /// Reads some bytes. Where the stream has ended, says how the job stands: the farm may have
    /// nothing more to say of it.
    async fn read_on(&mut self) -> Result<Option<JobStatus>, ClientError> {
        let Some(stream) = &mut self.stream else {
            self.stream = Some(self.open().await?);
            return Ok(None);
        };
        if let Ok(Some(bytes)) = stream.piece().await {
            if let Err(e) = self.parser.push(&bytes) {
                let call = format!("the events of job {}", self.job);
                return Err(ClientError::Unexpected { call, reason: e.to_string() });
            }
            return Ok(None);
        }
        self.stream = None;
        self.parser = Parser::default();
        tokio::time::sleep(self.backoff.delay()).await;
        self.client.job(&self.job).await.map(Some)
    }

    async fn open(&self) -> Result<Answer, ClientError> {
        let mut call = Call::new(Method::GET, route::job_part(&self.job, "events"));
        call = call.header(ACCEPT, "text/event-stream").attempts(ATTEMPTS);
        if let Some(last) = &self.last {
            call = call.header(LAST_EVENT_ID, last);
        }
        self.client.send(&call).await
    }
}
