//! What other servers over the same store do: jobs come, change and end, batches are brought and come back.

use super::{
    Farm,
    error::Result,
    live::{Arrival, Ending, Live, Waits},
    open::read_spec,
};
use crate::store::{
    Sharing,
    row::{BatchKey, JobHead, JobRow},
};
use ovtigre_proto::id::JobId;
use std::{
    collections::{BTreeMap, BTreeSet},
    sync::Arc,
};

impl Farm {
    /// Whether other servers may use the same store.
    pub(super) fn is_shared(&self) -> bool {
        self.store.sharing() == Sharing::WithOthers
    }

    /// A job that is not settled, also one that another server took just now.
    pub async fn meet(self: &Arc<Self>, id: &JobId) -> Result<Option<Arc<Live>>> {
        if self.live(id).is_none()
            && self.is_shared()
            && let Some(row) = self.store.job(id).await?
            && !row.settled
        {
            self.take_up(&row).await?;
        }
        Ok(self.live(id))
    }

    /// Takes up what other servers have done since the last call.
    pub(super) async fn follow_others(self: &Arc<Self>) -> Result<()> {
        if !self.is_shared() {
            return Ok(());
        }
        let known = self.lives();
        let heads = self.store.heads().await?;
        let names: BTreeSet<&JobId> = heads.iter().map(|head| &head.id).collect();
        for live in known.iter().filter(|live| !names.contains(&live.id)) {
            self.follow_end(live).await?;
        }
        for head in &heads {
            match self.live(&head.id) {
                Some(live) => self.follow_head(&live, head).await?,
                None => {
                    self.meet(&head.id).await?;
                }
            }
        }
        let mut returned: BTreeMap<JobId, Vec<BatchKey>> = BTreeMap::new();
        for (job, batch) in self.store.returned().await? {
            returned.entry(job).or_default().push(batch);
        }
        let mut book = self.book();
        for (job, batches) in returned {
            for batch in batches {
                book.put_back(&job, batch);
            }
        }
        Ok(())
    }

    /// A job is not in the list any more.
    async fn follow_end(&self, live: &Live) -> Result<()> {
        if self.store.job(&live.id).await?.is_none_or(|row| row.settled) {
            self.book().remove(&live.id);
            self.forget_live(&live.id);
        }
        Ok(())
    }

    async fn follow_head(self: &Arc<Self>, live: &Arc<Live>, head: &JobHead) -> Result<()> {
        if live.note_version(head.version) {
            let row = self.job_row(&head.id).await?;
            if read_spec(&row)? != live.spec {
                return self.follow_spec(live, &row).await;
            }
            self.follow(&row);
        }
        if head.state.is_over() && live.ending().is_none() {
            self.book().remove(&live.id);
            live.end(Ending { state: head.state, reason: None, certified: false, waits: Waits::Not });
        }
        if live.mandate().is_some() {
            return self.follow_commits(live, head.brought).await;
        }
        live.set_elsewhere(!head.free);
        if head.free && (head.brought > 0 || live.ending().is_some()) {
            live.kick.notify_one();
        }
        let view = live.view();
        if view.curve.len() < head.looks as usize || view.progress.batches < head.progress.batches {
            self.learn_allocations(live).await?;
            self.book().reach(&live.id, head.looks);
            let curve = self.store.curve(&live.id).await?;
            let layers = self.store.layers(&live.id).await?;
            live.set_view(|view| {
                (view.curve, view.layers, view.progress) = (curve, layers, head.progress);
            });
        }
        Ok(())
    }

    /// Another server changed what is asked of a job.
    async fn follow_spec(self: &Arc<Self>, live: &Live, row: &JobRow) -> Result<()> {
        let _held = live.merge.lock().await;
        self.book().remove(&live.id);
        self.forget_live(&live.id);
        live.kick.notify_one();
        self.take_up(row).await
    }

    /// Batches that were brought to other servers.
    async fn follow_commits(&self, live: &Live, brought: u64) -> Result<()> {
        if brought > live.brought() {
            let since = self.store.commits_after(&live.id, live.brought()).await?;
            live.set_brought(since.count);
            since.rows.into_iter().for_each(|row| live.arrive(Arrival { row, sum: None }));
        }
        Ok(())
    }

    /// Lets other servers see how far the pictures are that this one appends to.
    pub(super) async fn tell_others(&self) -> Result<()> {
        if !self.is_shared() {
            return Ok(());
        }
        for live in self.lives() {
            let progress = live.view().progress;
            if let Some(mandate) = live.mandate().filter(|_| live.note_told(progress)) {
                self.store.publish(&live.id, mandate, progress).await?;
            }
        }
        Ok(())
    }

    /// Brings what can be handed out of a job up to what the store says.
    pub(super) async fn refresh_plan(&self, id: &JobId) -> Result<()> {
        if self.is_shared() && self.live(id).is_some() {
            let left = self.store.unclaimed(id).await?;
            if let Some(entry) = self.book().job(id) {
                entry.plan.refresh(left.cursors, left.returned);
            }
        }
        Ok(())
    }
}
