//! Other services are told of jobs' changes: in order for each job, again and again until they answer.

use super::{Farm, error::Result};
use crate::{store::notice::NoticeRow, webhook::Outcome};
use futures::future::join_all;
use jiff::Timestamp;
use std::{sync::Arc, time::Duration};

/// Notices on their way at a time.
const AT_A_TIME: u32 = 32;
/// A notice that is being sent is no other server's for so long: longer than it is waited for an answer.
const HELD: Duration = Duration::from_secs(30);
/// Longest time between two tries.
const REST_MAX: Duration = Duration::from_hours(6);
/// Tries of one notice: over about a day.
const TRIES_MAX: u32 = 10;

impl Farm {
    /// Sends what is due until the farm stops.
    pub(super) async fn tell(self: Arc<Self>) {
        let mut beat = tokio::time::interval(self.rules.tick);
        beat.set_missed_tick_behavior(tokio::time::MissedTickBehavior::Delay);
        loop {
            tokio::select! {
                () = self.stopping.cancelled() => return,
                _ = beat.tick() => {}
            }
            let told = tokio::select! {
                () = self.stopping.cancelled() => return,
                told = self.tell_due() => told,
            };
            if let Err(error) = told {
                tracing::error!(%error, "telling others of jobs failed");
            }
        }
    }

    async fn tell_due(&self) -> Result<()> {
        let due = self.store.due_notices(AT_A_TIME, HELD).await?;
        for done in join_all(due.into_iter().map(|notice| self.tell_one(notice))).await {
            done?;
        }
        Ok(())
    }

    async fn tell_one(&self, notice: NoticeRow) -> Result<()> {
        let NoticeRow { sequence, tries, .. } = notice;
        let (job, state) = (notice.job.clone(), notice.state.name());
        match self.messenger.send(notice, Timestamp::now().as_second()).await {
            Outcome::Taken => {
                tracing::debug!(%job, state, "others were told");
                self.counters.told();
            }
            Outcome::Gone => tracing::warn!(%job, state, "nobody wants to be told any more"),
            Outcome::Failed(reason) if tries >= TRIES_MAX => {
                tracing::error!(%job, state, tries, reason, "others were not told, and will not be");
                self.counters.not_told();
            }
            Outcome::Failed(reason) => {
                let rest =
                    self.rules.notice_rest.saturating_mul(4_u32.pow(tries.saturating_sub(1))).min(REST_MAX);
                tracing::warn!(%job, state, tries, ?rest, reason, "others were not told: again later");
                return Ok(self.store.put_off_notice(sequence, rest).await?);
            }
        }
        Ok(self.store.end_notice(sequence).await?)
    }
}
