//! How long jobs that are over are kept.

use super::{Farm, error::Result, status::PAGE_MAX};
use crate::{
    blobs::BlobFolder,
    store::list::{JobFilter, Key, Order, Place, Way},
};
use jiff::Timestamp;
use ovtigre_proto::status::JobState;

impl Farm {
    /// Removes jobs, with their files, that were over longer ago than the rules keep them.
    pub(super) async fn let_go(&self) -> Result<()> {
        let Some(until) = self.rules.kept.and_then(|time| Timestamp::now().checked_sub(time).ok()) else {
            return Ok(());
        };
        for state in [JobState::Done, JobState::Failed, JobState::Cancelled] {
            let order = Order { by: Key::Created, way: Way::Up };
            let mut filter = JobFilter { state: Some(state), order, limit: PAGE_MAX, ..JobFilter::default() };
            loop {
                let rows = self.store.jobs(filter.clone()).await?;
                for row in rows.iter().filter(|row| row.settled && row.ended_at.is_some_and(|at| at < until))
                {
                    // Not one that goes on since.
                    if self.store.remove_settled(&row.id, row.version).await? {
                        self.blobs.delete_all(&BlobFolder::Job(row.id.clone())).await?;
                        tracing::info!(job = %row.id, "job removed: it was kept as long as jobs are");
                    }
                }
                // Later ones were over later than they came.
                let Some(last) = rows.last().filter(|row| row.created_at < until) else { break };
                filter.after = Some(Place::of(last, Key::Created));
            }
        }
        Ok(())
    }
}
