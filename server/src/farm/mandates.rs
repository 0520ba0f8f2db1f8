//! Which server appends to a job's sums: the one that has the store's mandate.

use super::{
    Farm,
    append::Held,
    error::{FarmError, Result},
    live::Live,
};
use crate::{
    blobs::BlobFolder,
    fail_point::FailPoint,
    store::{error::StoreError, row::Mandate},
};
use std::{collections::BTreeMap, sync::Arc};

impl Farm {
    /// Whether this server appends to the job's sums; it begins to where nobody else does.
    pub(super) async fn holds(&self, live: &Live) -> Result<bool> {
        if live.mandate().is_some() {
            return Ok(true);
        }
        if live.is_elsewhere() {
            return Ok(false);
        }
        let taken = self.store.take_merge(&live.id, &self.name, self.rules.mandate).await?;
        let Some(mandate) = taken else {
            live.set_elsewhere(true);
            return Ok(false);
        };
        FailPoint::MandateAfterRow.pass();
        // What is in memory was read beside somebody else's work.
        *live.merge.lock().await = None;
        live.set_mandate(Some(mandate));
        tracing::debug!(job = %live.id, epoch = mandate.0, "this server appends to the job's sums");
        Ok(true)
    }

    /// The mandate under which something is written down.
    pub(super) fn mandate(live: &Live) -> Result<Mandate> {
        live.mandate().ok_or(FarmError::Store(StoreError::Superseded))
    }

    /// Lengthens this server's mandates; those that it lost end.
    pub(super) async fn keep_mandates(&self) -> Result<()> {
        if !self.is_shared() {
            return Ok(());
        }
        let mine: Vec<Arc<Live>> = self.lives().into_iter().filter(|live| live.mandate().is_some()).collect();
        if mine.is_empty() {
            return Ok(());
        }
        let kept = self.store.keep_merges(&self.name, self.rules.mandate).await?;
        let kept: BTreeMap<_, _> = kept.into_iter().collect();
        for live in mine {
            if live.mandate().is_some_and(|mandate| kept.get(&live.id) != Some(&mandate)) {
                self.lose(&live).await;
            }
        }
        Ok(())
    }

    /// Another server appends to the job's sums, or it is gone: what is in memory does not count.
    pub(super) async fn lose(&self, live: &Live) {
        tracing::warn!(job = %live.id, "another server has taken over the job's sums, or it was purged");
        live.set_mandate(None);
        live.set_elsewhere(true);
        *live.merge.lock().await = None;
        if self.store.job(&live.id).await.is_ok_and(|row| row.is_none()) {
            self.book().remove(&live.id);
            self.forget_live(&live.id);
            if let Err(error) = self.blobs.delete_all(&BlobFolder::Job(live.id.clone())).await {
                tracing::warn!(job = %live.id, %error, "files of a purged job were not removed");
            }
        }
    }

    /// Brings a copy of sums that another server appends to up to what was brought: nothing is written.
    pub(super) async fn catch_up(&self, live: &Live, mut held: Held) -> Result<Held> {
        /// What is read may be replaced meanwhile: times that it is read again.
        const AGAIN: u32 = 4;
        for _ in 0..AGAIN {
            match self.catch_up_once(live, held).await {
                Err(FarmError::Damaged(reason)) => tracing::debug!(job = %live.id, reason, "read again"),
                Err(FarmError::Blob(error)) => tracing::debug!(job = %live.id, %error, "read again"),
                done => return done,
            }
            held = Arc::clone(&live.merge).lock_owned().await;
            *held = None;
        }
        self.catch_up_once(live, held).await
    }

    async fn catch_up_once(&self, live: &Live, mut held: Held) -> Result<Held> {
        match held.as_mut() {
            None => *held = Some(self.load(live).await?),
            Some(merge) => {
                let ledger = self.store.ledger(&live.id).await?;
                self.learn_allocations(live).await?;
                merge.decision = live.decision();
                merge.follow(ledger.commits, ledger.checkpoints);
            }
        }
        self.append_all(live, held).await
    }
}
