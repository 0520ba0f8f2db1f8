//! `/v1/jobs/{id}/events`

use super::{
    error::{ApiError, Result},
    params::{Named, id},
};
use crate::farm::{Farm, error::FarmError};
use axum::{
    extract::State,
    http::{HeaderMap, StatusCode},
    response::{
        IntoResponse as _, Response,
        sse::{Event, KeepAlive, Sse},
    },
};
use futures::stream::{self, Stream};
use ovtigre_proto::{
    id::JobId,
    status::{JobEvent, JobStatus},
};
use std::{
    collections::VecDeque,
    convert::Infallible,
    fmt,
    str::FromStr,
    sync::Arc,
    time::{Duration, Instant},
};
use tokio::sync::watch;

/// Shortest time between two events of a job's status.
const PACE: Duration = Duration::from_millis(100);

/// What a client has seen: an event's id says all that is needed to go on after it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Seen {
    version: u64,
    checkpoints: u64,
    batches: u64,
}

impl fmt::Display for Seen {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}.{}.{}", self.version, self.checkpoints, self.batches)
    }
}

impl FromStr for Seen {
    type Err = ();

    fn from_str(text: &str) -> std::result::Result<Self, ()> {
        let numbers: Option<Vec<u64>> = text.split('.').map(|n| n.parse().ok()).collect();
        match *numbers.ok_or(())?.as_slice() {
            [version, checkpoints, batches] => Ok(Self { version, checkpoints, batches }),
            _ => Err(()),
        }
    }
}

/// A job's status whenever it changes, and each checkpoint once, from where the client was.
pub async fn stream(
    State(farm): State<Arc<Farm>>,
    Named(name): Named,
    headers: HeaderMap,
) -> Result<Response> {
    let id: JobId = id("job", &name)?;
    let last = last_seen(&headers)?;
    let settled = farm.meet(&id).await?.is_none();
    let mut watching = Watching::new(farm, id, last);
    watching.look().await?;
    if settled && last.is_some() && watching.events.is_empty() {
        // Tells an EventSource that there is nothing to reconnect for.
        return Ok(StatusCode::NO_CONTENT.into_response());
    }
    let keep_alive = KeepAlive::new().interval(Duration::from_secs(15));
    Ok(Sse::new(events(watching)).keep_alive(keep_alive).into_response())
}

/// The last event that the client has seen. One that no event of a job has ever had is an error: to begin
/// anew would tell everything twice, and to go on from now would miss something.
fn last_seen(headers: &HeaderMap) -> Result<Option<Seen>> {
    let Some(value) = headers.get("last-event-id").filter(|value| !value.is_empty()) else { return Ok(None) };
    let seen = value.to_str().ok().and_then(|text| text.parse().ok());
    seen.map(Some).ok_or_else(|| ApiError::header("Last-Event-ID is not the id of an event of a job"))
}

struct Watching {
    farm: Arc<Farm>,
    id: JobId,
    changes: Option<watch::Receiver<u64>>,
    seen: Seen,
    /// Whether the client knows the status that `seen` names.
    knows: Option<Seen>,
    events: VecDeque<Event>,
    /// When it was looked at last.
    looked: Instant,
}

impl Watching {
    fn new(farm: Arc<Farm>, id: JobId, last: Option<Seen>) -> Self {
        let changes = farm.live(&id).map(|live| live.changes.subscribe());
        let seen = last.unwrap_or_default();
        Self { farm, id, changes, seen, knows: last, events: VecDeque::new(), looked: Instant::now() }
    }

    /// Takes up what is new.
    async fn look(&mut self) -> std::result::Result<(), FarmError> {
        self.looked = Instant::now();
        if let Some(changes) = &mut self.changes {
            changes.mark_unchanged();
        }
        let rows = self.farm.curve_rows(&self.id).await?;
        let status = self.farm.status(&self.id).await?;
        let known = (self.seen.checkpoints as usize).min(rows.len());
        self.seen.checkpoints = known as u64;
        for row in &rows[known..] {
            self.seen.checkpoints += 1;
            // Named after the status that came before it, so that the next one is not missed.
            self.push("checkpoint", &JobEvent::Checkpoint(row.clone()), self.seen);
        }
        self.tell(status);
        Ok(())
    }

    /// Lets changes gather for a while; the end of a job is not kept from whoever waits for it.
    async fn pace(&mut self) {
        while let Some(changes) = &mut self.changes
            && self.farm.live(&self.id).is_some()
            && let Some(rest) = PACE.checked_sub(self.looked.elapsed())
        {
            tokio::time::timeout(rest, changes.changed()).await.ok();
        }
    }

    fn tell(&mut self, status: JobStatus) {
        let now = Seen { version: status.version, batches: status.batches_done, ..self.seen };
        if self.knows.take() == Some(now) {
            return;
        }
        self.seen = now;
        self.push("status", &JobEvent::Status(Box::new(status)), now);
    }

    fn push(&mut self, name: &str, event: &JobEvent, id: Seen) {
        let event = Event::default().id(id.to_string()).event(name).json_data(event);
        self.events.extend(event.ok());
    }
}

fn events(watching: Watching) -> impl Stream<Item = std::result::Result<Event, Infallible>> {
    stream::unfold(watching, |mut watching| async move {
        loop {
            if let Some(event) = watching.events.pop_front() {
                return Some((Ok(event), watching));
            }
            let stopping = watching.farm.stopping.clone();
            let changes = watching.changes.as_mut()?;
            tokio::select! {
                () = stopping.cancelled() => return None,
                changed = changes.changed() => {
                    // Whoever would change it is gone: the job is settled, this is its last status.
                    if changed.is_err() {
                        watching.changes = None;
                    }
                }
            }
            watching.pace().await;
            if watching.farm.live(&watching.id).is_none() {
                watching.changes = None;
            }
            watching.look().await.ok()?;
        }
    })
}
