//! The one writer: whatever waits while a transaction is made durable goes into the next, together.

use super::{column::millis, connection::Db, gathered, open::Source, query::query};
use crate::{
    fail_point::FailPoint,
    store::{
        error::{Result, StoreError},
        row::{Claim, CommitOutcome, NewCommit},
    },
};
use futures::future::BoxFuture;
use std::{
    sync::{Mutex, PoisonError},
    time::Duration,
};
use tokio::{
    sync::{mpsc, oneshot},
    task::JoinHandle,
};

/// Changes in one transaction, at most.
const GROUP_MAX: usize = 256;
/// A database that does not answer for so long is given up: the connection is made anew.
const PATIENCE: Duration = Duration::from_secs(30);
/// Wait between two attempts to reach the database again.
const REST: Duration = Duration::from_millis(200);

/// Tells the caller what became of its change, once it is durable or the group failed.
type Tell = Box<dyn FnOnce(Result<()>) + Send>;
/// A change: whether it is to be kept, and who is told.
type Change = Box<dyn for<'c> FnOnce(&'c mut Db) -> BoxFuture<'c, (Keep, Tell)> + Send>;

#[derive(Clone, Copy, PartialEq, Eq)]
enum Keep {
    Yes,
    No,
}

/// Whom to tell.
type Asker<T> = oneshot::Sender<Result<T>>;

/// What waits to be written.
enum Waiting {
    /// A change of its own.
    Change(Change),
    /// Batches to hand out for a while: all of a group are, together.
    Claims(Vec<Claim>, Duration, Asker<Vec<bool>>),
    /// A sum that is brought: all of a group are taken together.
    Commit(NewCommit, Asker<CommitOutcome>),
}

/// Where changes are handed in.
#[derive(Debug)]
pub(super) struct Writer {
    changes: Mutex<Option<mpsc::Sender<Waiting>>>,
    task: Mutex<Option<JoinHandle<()>>>,
}

impl Writer {
    /// Writes over `connection`, or another of the same `source` where that breaks, until it is closed.
    pub(super) fn start(connection: Db, source: Source) -> Self {
        let (changes, waiting) = mpsc::channel(4 * GROUP_MAX);
        let task = tokio::spawn(write_all(connection, source, waiting));
        Self { changes: Mutex::new(Some(changes)), task: Mutex::new(Some(task)) }
    }

    /// Applies `change` whole or not at all; returns when it is durable.
    pub(super) async fn write<T, F>(&self, change: F) -> Result<T>
    where
        T: Send + 'static,
        F: for<'c> FnOnce(&'c mut Db) -> BoxFuture<'c, Result<T>> + Send + 'static,
    {
        let (tell, told) = oneshot::channel();
        let change: Change = Box::new(move |connection| {
            Box::pin(async move {
                let result = change(connection).await;
                let keep = if result.is_ok() { Keep::Yes } else { Keep::No };
                let tell: Tell = Box::new(move |durable| {
                    // A caller that went away does not hear it; the change stands all the same.
                    let _ = tell.send(result.and_then(|value| durable.map(|()| value)));
                });
                (keep, tell)
            })
        });
        self.ask(Waiting::Change(change), told).await
    }

    /// Hands out each batch that may be, for `time`.
    pub(super) async fn claim(&self, claims: Vec<Claim>, time: Duration) -> Result<Vec<bool>> {
        let (tell, told) = oneshot::channel();
        self.ask(Waiting::Claims(claims, time, tell), told).await
    }

    /// Records a batch's sum if there is none, otherwise compares.
    pub(super) async fn commit(&self, new: NewCommit) -> Result<CommitOutcome> {
        let (tell, told) = oneshot::channel();
        self.ask(Waiting::Commit(new, tell), told).await
    }

    async fn ask<T>(&self, waiting: Waiting, told: oneshot::Receiver<Result<T>>) -> Result<T> {
        let changes = self.changes.lock().unwrap_or_else(PoisonError::into_inner).clone();
        changes.ok_or(StoreError::Closed)?.send(waiting).await.map_err(|_| StoreError::Closed)?;
        told.await.map_err(|_| StoreError::Commit("the group it was in was given up".to_owned()))?
    }

    /// Takes no more changes, waits for those under way, and closes the connection.
    pub(super) async fn close(&self) {
        drop(self.changes.lock().unwrap_or_else(PoisonError::into_inner).take());
        let task = self.task.lock().unwrap_or_else(PoisonError::into_inner).take();
        if let Some(task) = task
            && let Err(error) = task.await
        {
            tracing::error!(%error, "the database's writer ended early");
        }
    }
}

async fn write_all(connection: Db, source: Source, mut waiting: mpsc::Receiver<Waiting>) {
    let mut connection = Some(connection);
    while let Some(first) = waiting.recv().await {
        let mut group = vec![first];
        while group.len() < GROUP_MAX
            && let Ok(next) = waiting.try_recv()
        {
            group.push(next);
        }
        if connection.is_none() {
            connection = match tokio::time::timeout(PATIENCE, source.connect()).await {
                Ok(Ok(again)) => Some(again),
                Ok(Err(error)) => {
                    tracing::error!(%error, changes = group.len(), "the database cannot be reached");
                    // Dropping the group tells its callers.
                    drop(group);
                    tokio::time::sleep(REST).await;
                    continue;
                }
                Err(_) => continue,
            };
        }
        let Some(db) = connection.as_mut() else { continue };
        let written = tokio::time::timeout(PATIENCE, write_group(db, gather(group))).await;
        if !matches!(written, Ok(Health::Good)) {
            connection = connection.take().filter(|_| source.is_file() && written.is_ok());
        }
    }
    if let Some(connection) = connection
        && let Err(error) = connection.close().await
    {
        tracing::warn!(%error, "the database did not close cleanly");
    }
}

/// The changes of a group, with all claims as one and all sums as one: each costs some statements, not
/// each of what is in it.
fn gather(group: Vec<Waiting>) -> Vec<Change> {
    let mut changes = Vec::new();
    let (mut claims, mut claimers) = (Vec::new(), Vec::new());
    let (mut commits, mut bringers) = (Vec::new(), Vec::new());
    for waiting in group {
        match waiting {
            Waiting::Change(change) => changes.push(change),
            Waiting::Claims(asked, time, asker) => {
                claimers.push((asked.len(), asker));
                claims.extend(asked.into_iter().map(|claim| (claim, time)));
            }
            Waiting::Commit(new, asker) => {
                commits.push(new);
                bringers.push((1, asker));
            }
        }
    }
    if !commits.is_empty() {
        changes.push(Box::new(move |db| {
            Box::pin(async move {
                let one = |outcomes: Vec<_>| outcomes.into_iter().next();
                told(gathered::commit(db, &commits).await, bringers, one)
            })
        }));
    }
    if !claims.is_empty() {
        changes
            .push(Box::new(move |db| Box::pin(async move { told(claim(db, claims).await, claimers, Some) })));
    }
    changes
}

async fn claim(db: &mut Db, claims: Vec<(Claim, Duration)>) -> Result<Vec<bool>> {
    let now = db.now().await?;
    let claims: Vec<_> = claims.into_iter().map(|(claim, time)| (claim, now + millis(time))).collect();
    gathered::claim(db, &claims).await
}

/// Whether what was done together is kept, and how each of those who asked for some of it is told of its part.
fn told<R, T>(
    done: Result<Vec<R>>,
    askers: Vec<(usize, Asker<T>)>,
    part: impl Fn(Vec<R>) -> Option<T> + Send + 'static,
) -> (Keep, Tell)
where
    R: Send + 'static,
    T: Send + 'static,
{
    let keep = if done.is_ok() { Keep::Yes } else { Keep::No };
    let tell: Tell = Box::new(move |durable| {
        let mut done = done.and_then(|all| durable.map(|()| all.into_iter()));
        for (count, asker) in askers {
            let its = match &mut done {
                Ok(all) => part(all.by_ref().take(count).collect()),
                Err(error) => {
                    let _ = asker.send(Err(StoreError::Commit(error.to_string())));
                    continue;
                }
            };
            // Without a part its asker hears that the group was given up.
            if let Some(its) = its {
                let _ = asker.send(Ok(its));
            }
        }
    });
    (keep, tell)
}

/// Whether a connection can still be used.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Health {
    Good,
    Doubtful,
}

/// Whether a change before this one can still be taken back alone.
#[derive(Clone, Copy)]
enum Savepoint {
    None,
    Open,
}

/// One transaction; a change that fails is taken back alone, by its savepoint.
async fn write_group(connection: &mut Db, group: Vec<Change>) -> Health {
    let mut tells: Vec<Tell> = Vec::with_capacity(group.len());
    let mut written = connection.begin_group().await;
    if let Err(error) = &written {
        // Outside a transaction a change would stand whatever its caller is told: none is tried.
        tracing::error!(%error, "the database is locked by another program, or broken");
        let _ = connection.execute(query("ROLLBACK")).await;
        return Health::Doubtful;
    }
    let mut before = Savepoint::None;
    for change in group {
        if written.is_err() {
            continue;
        }
        // One way to the database and back is what such a statement costs.
        written = match std::mem::replace(&mut before, Savepoint::Open) {
            Savepoint::None => connection.run("SAVEPOINT change").await,
            Savepoint::Open => connection.run("RELEASE SAVEPOINT change; SAVEPOINT change").await,
        };
        if written.is_err() {
            continue;
        }
        let (keep, tell) = change(connection).await;
        tells.push(tell);
        if keep == Keep::No {
            written = connection.run("ROLLBACK TO SAVEPOINT change").await;
        }
    }
    if written.is_ok() {
        FailPoint::GroupBeforeCommit.pass();
        written = connection.run("COMMIT").await;
        FailPoint::GroupAfterCommit.pass();
    }
    if let Err(error) = &written {
        tracing::error!(%error, changes = tells.len(), "a group of changes was not written");
        // Fails where no transaction was begun or it is rolled back already.
        let _ = connection.execute(query("ROLLBACK")).await;
    }
    for tell in tells {
        tell(written.as_ref().map_or_else(|error| Err(StoreError::Commit(error.to_string())), |()| Ok(())));
    }
    if written.is_ok() { Health::Good } else { Health::Doubtful }
}
