//! Waiting for a job.

use super::{
    exit::{CommandError, Outcome},
    interrupt::Interrupt,
    local_workers::LocalWorkers,
    progress::Progress,
    truth::Truth,
};
use ovtigre_proto::{
    client::{error::ClientError, farm::Client},
    id::JobId,
    status::{JobEvent, JobStatus},
};

/// Who renders a job.
#[derive(Debug)]
pub(crate) enum Workers<'a> {
    /// Processes of ours, without which it would never end.
    Ours(&'a LocalWorkers),
    /// The farm's.
    Theirs,
}

impl Workers<'_> {
    /// There is nothing more to do for them: ours leave.
    pub(crate) fn dismiss(&self) {
        if let Self::Ours(workers) = self {
            workers.dismiss();
        }
    }

    /// Returns, with the reason, if none of ours is left.
    async fn lost(&self) -> String {
        match self {
            Self::Ours(workers) => workers.lost().await,
            Self::Theirs => std::future::pending().await,
        }
    }
}

/// Shows a job until it is over. A first interrupt cancels it and goes on waiting, for the picture so
/// far; a second one ends the waiting. At each checkpoint the picture so far is compared with the reference, where there is one.
pub(crate) async fn until_over(
    client: &Client,
    job: &JobId,
    progress: &mut Progress,
    interrupt: &Interrupt,
    workers: &Workers<'_>,
    mut truth: Option<&mut Truth>,
) -> Outcome<JobStatus> {
    let mut events = client.events(job);
    let mut last = None;
    let mut cancelled = false;
    loop {
        tokio::select! {
            event = events.next() => match event? {
                Some(JobEvent::Status(status)) => {
                    progress.show(&status);
                    last = Some(*status);
                }
                Some(JobEvent::Checkpoint(row)) => {
                    if let Some(truth) = &mut truth {
                        truth.look(client, job, &row).await?;
                    }
                }
                None => return last.ok_or_else(|| CommandError::failed("the farm said nothing of the job")),
            },
            () = interrupt.once(), if !cancelled => {
                cancelled = true;
                progress.remark("stopping; the picture so far is kept (interrupt again to leave now)");
                cancel(client, job).await?;
            }
            () = interrupt.twice() => return Err(CommandError::stopped("left before the job was over")),
            reason = workers.lost() => return Err(CommandError::failed(reason)),
        }
    }
}

/// Shows a job until it is over or the user has seen enough: the job goes on.
pub(crate) async fn until_interrupted(
    client: &Client,
    job: &JobId,
    interrupt: &Interrupt,
    mut show: impl FnMut(&JobEvent),
) -> Outcome<JobStatus> {
    let mut events = client.events(job);
    let mut last = None;
    loop {
        tokio::select! {
            event = events.next() => match event? {
                Some(event) => {
                    show(&event);
                    if let JobEvent::Status(status) = event {
                        last = Some(*status);
                    }
                }
                None => return last.ok_or_else(|| CommandError::failed("the farm said nothing of the job")),
            },
            () = interrupt.once() => return Err(CommandError::stopped("stopped watching; the job goes on")),
        }
    }
}

/// Cancels a job; one that is over by now is over.
async fn cancel(client: &Client, job: &JobId) -> Result<(), ClientError> {
    match client.cancel(job).await {
        Err(error) if error.status() == Some(409) => Ok(()),
        other => other.map(drop),
    }
}
