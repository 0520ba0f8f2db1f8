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
                return Err(ClientError::Unexpected { call, status: None, reason: e.to_string() });
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

#[cfg(test)]
mod tests {
    use super::{super::mock::serve, *};
    use axum::{Router, http::HeaderMap, routing::get};
    use std::sync::{
        Arc,
        atomic::{AtomicU32, Ordering},
    };

    fn status(state: &str) -> String {
        let settings = r#"{"size":{"width":1,"height":1},"camera":"framed","method":"path","paths":"L(D|S)*E",
            "layers":[],"gloss":"as_it_is","strategies":[],"weights":"balance","bounces":null,"lens":null,
            "shutter":{"open":0,"close":0},"environment":null,"shadows":"on","seed":0,"replicates":4}"#;
        let text = format!(
            r#"{{"id":"j","name":"n","scene":"{}","state":"{state}","version":1,"priority":0,
            "created_at":"2026-01-01T00:00:00Z","samples_done":0,"samples_asked":1,"batches_done":0,
            "batches_asked":1,"wall_seconds":0,"worker_seconds":0,"rays":0,"invalid_samples":0,"workers":0,
            "certified":false,"method":"path","method_reason":"","paths":"","settings":{settings},
            "region":{{"x":0,"y":0,"width":1,"height":1}},"request":{{}},"warnings":[]}}"#,
            "0".repeat(64)
        );
        text.replace('\n', "")
    }

    fn event(id: u32, state: &str) -> String {
        format!(
            "id: {id}\nevent: status\ndata: {}\n\n",
            status(state).replacen('{', r#"{"event":"status","#, 1)
        )
    }

    async fn states(events: &mut Events) -> Vec<&'static str> {
        let mut states = Vec::new();
        while let Some(JobEvent::Status(status)) = events.next().await.unwrap() {
            states.push(status.state.name());
        }
        states
    }

    #[tokio::test]
    async fn a_stream_that_breaks_is_taken_up_where_it_ended() {
        let connections = Arc::new(AtomicU32::new(0));
        let stream = get(move |headers: HeaderMap| async move {
            let last = headers.get("last-event-id").map(|v| v.to_str().unwrap().to_owned());
            match connections.fetch_add(1, Ordering::SeqCst) {
                0 => {
                    assert_eq!(last, None);
                    format!(
                        "{}id: 8\ndata: {{\"event\":\"of a newer farm\"}}\n\nid: 9\ndata: cut",
                        event(7, "queued")
                    )
                }
                n => {
                    assert_eq!((n, last.as_deref()), (1, Some("8")));
                    event(9, "running") + &event(10, "done")
                }
            }
        });
        let job = get(|| async { status("running") });
        let client = serve(Router::new().route("/v1/jobs/j/events", stream).route("/v1/jobs/j", job)).await;
        let mut events = client.events(&"j".parse().unwrap());
        assert_eq!(states(&mut events).await, ["queued", "running", "running", "done"]);
    }

    #[tokio::test]
    async fn a_farm_that_has_nothing_more_to_say_is_asked_how_the_job_stands() {
        let job = get(|| async { status("failed") });
        let silent = get(|| async { "" });
        let client = serve(Router::new().route("/v1/jobs/j/events", silent).route("/v1/jobs/j", job)).await;
        assert_eq!(states(&mut client.events(&"j".parse().unwrap())).await, ["failed"]);
    }
}
