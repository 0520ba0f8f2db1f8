//! Whether what the store names is among the blobs.

use super::{
    error::{FarmError, Result},
    open::read_spec,
    status::PAGE_MAX,
};
use crate::{
    blobs::{BlobError, BlobName, Blobs},
    store::{
        Store,
        list::{JobFilter, Key, Order, Place, Way},
        row::JobRow,
    },
};
use futures::TryStreamExt as _;
use ovtigre_core::film::exr::read_layers;
use ovtigre_proto::id::BlobId;
use std::collections::BTreeMap;

/// What was found.
#[derive(Debug, Default)]
pub struct Checked {
    /// Jobs that were looked at.
    pub jobs: u64,
    /// Scenes that were looked at.
    pub scenes: u64,
    /// What cannot be had any more, a line each.
    pub lost: Vec<String>,
    /// Sums that are to be rendered again, a line each.
    pub again: Vec<String>,
}

/// Looks at each job, its scene and its files.
pub async fn check(store: &dyn Store, blobs: &Blobs) -> Result<Checked> {
    let mut checked = Checked::default();
    let mut scenes = BTreeMap::new();
    let order = Order { by: Key::Created, way: Way::Up };
    let mut filter = JobFilter { order, limit: PAGE_MAX, ..JobFilter::default() };
    loop {
        let rows = store.jobs(filter.clone()).await?;
        for row in &rows {
            checked.jobs += 1;
            let mut files = vec![row.scene.clone()];
            match read_spec(row) {
                Ok(spec) => files = spec.files(&row.scene),
                Err(error) => {
                    checked.lost.push(format!("job {}: its document cannot be read: {error}", row.id));
                }
            }
            for file in files {
                if !scenes.contains_key(&file) {
                    let fault = scene(store, blobs, &file).await?;
                    scenes.insert(file.clone(), fault);
                }
                if let Some(Some(fault)) = scenes.get(&file) {
                    checked.lost.push(format!("job {}: its scene {file} {fault}", row.id));
                }
            }
            if row.settled {
                checked.lost.extend(picture(blobs, row).await?);
            } else {
                checked.again.extend(sums(store, blobs, row).await?);
            }
        }
        let Some(last) = rows.last() else { break };
        filter.after = Some(Place::of(last, Key::Created));
    }
    checked.scenes = scenes.len() as u64;
    Ok(checked)
}

/// What is wrong with a scene.
async fn scene(store: &dyn Store, blobs: &Blobs, id: &BlobId) -> Result<Option<&'static str>> {
    if store.scene(id).await?.is_none() {
        return Ok(Some("is not in the database"));
    }
    let (_, mut pieces) = match blobs.stream(&BlobName::Scene(id.clone())).await {
        Err(BlobError::Missing(_)) => return Ok(Some("is missing")),
        other => other?,
    };
    let mut hasher = blake3::Hasher::new();
    while let Some(piece) = pieces.try_next().await? {
        hasher.update(&piece);
    }
    Ok((BlobId::of(hasher.finalize().into()) != *id).then_some("has other bytes than its name says"))
}

/// What is wrong with the picture of a job that is over.
async fn picture(blobs: &Blobs, row: &JobRow) -> Result<Option<String>> {
    let Some(manifest) = &row.manifest else { return Ok(None) };
    let name = BlobName::Result(row.id.clone(), manifest.clone());
    let bytes = match blobs.get(&name).await {
        Err(BlobError::Missing(_)) => blobs.get(&BlobName::OldResult(row.id.clone())).await,
        other => other,
    };
    let bytes = match bytes {
        Err(BlobError::Missing(_)) => return Ok(Some(format!("job {}: its picture is missing", row.id))),
        other => other?,
    };
    let read = tokio::task::spawn_blocking(move || read_layers(&bytes)).await;
    let read = read.map_err(|_| FarmError::Stopping)?;
    let of = read.as_ref().ok().and_then(|layers| layers.attributes.get("ovtigre.manifest"));
    Ok((of != Some(manifest)).then(|| format!("job {}: its picture is damaged or another", row.id)))
}

/// Sums of a job that is not over which are not there.
async fn sums(store: &dyn Store, blobs: &Blobs, row: &JobRow) -> Result<Vec<String>> {
    let ledger = store.ledger(&row.id).await?;
    let mut names = Vec::new();
    for (lane, blocks) in &ledger.snapshots {
        let what =
            format!("the first {blocks} blocks of region {} replicate {}", lane.region, lane.replicate);
        names.push((what, BlobName::Prefix(row.id.clone(), *lane, *blocks)));
    }
    let kept: BTreeMap<_, _> = ledger.snapshots.iter().copied().collect();
    for commit in &ledger.commits {
        if kept.get(&commit.batch.lane()).is_none_or(|blocks| commit.batch.block >= *blocks) {
            let name = BlobName::Partial(row.id.clone(), commit.batch, commit.hash.clone());
            names.push((commit.batch.to_string(), name));
        }
    }
    let mut again = Vec::new();
    for (what, name) in names {
        match blobs.size(&name).await {
            Err(BlobError::Missing(_)) => again.push(format!("job {}: {what}", row.id)),
            other => drop(other?),
        }
    }
    Ok(again)
}
