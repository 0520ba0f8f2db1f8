//! A job's picture so far, as files.

use super::{
    Farm,
    append::{Merge, blocking},
    error::{FarmError, Result},
    live::{Live, Made, held},
    open::read_spec,
};
use crate::{
    blobs::{BlobError, BlobName},
    store::row::JobRow,
};
use bytes::Bytes;
use futures::stream::BoxStream;
use ovtigre_core::film::{
    develop::{Develop, png},
    estimate::picture,
    exr::{Layers, Part, PictureAttributes, prefix_of, read_layers, write_picture},
    size::Region,
    sum::Plane,
};
use ovtigre_core::{path::expression::presets::shown, settings::Settings};
use ovtigre_proto::id::JobId;
use std::{
    fmt,
    ops::Range,
    sync::{Arc, Mutex},
    time::Duration,
};

/// What a picture's files say made them.
const SOFTWARE: &str = concat!("ovtigre ", env!("CARGO_PKG_VERSION"));

/// Values of a picture that is remembered, at most: 256 MiB of them.
const SHOWN_MAX: usize = 1 << 26;

/// The channels of the picture of a job that is over that were read last, by its set of batches.
#[derive(Debug, Default)]
pub(super) struct Shown(Mutex<Option<(String, Arc<Layers>)>>);

/// A picture's EXR, in memory or kept.
#[derive(Debug)]
pub enum ExrFile {
    /// Made from the sums.
    Memory(Bytes),
    /// Of a job that is over.
    Kept {
        /// Its name.
        name: BlobName,
        /// Its size in bytes.
        size: u64,
    },
}

/// A layer of a picture.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum LayerName {
    /// The picture itself.
    Picture,
    /// Its standard error.
    Error,
    /// One of its layers.
    Named(String),
    /// The standard error of one of its layers.
    ErrorOf(String),
}

impl LayerName {
    /// As a user writes it; nothing is the picture.
    pub fn parse(text: Option<&str>) -> Self {
        match text {
            None | Some("" | "picture") => Self::Picture,
            Some("error") => Self::Error,
            Some(name) => match name.strip_suffix(".error") {
                Some(layer) => Self::ErrorOf(layer.to_owned()),
                None => Self::Named(name.to_owned()),
            },
        }
    }

    /// The number of its plane among the means or the errors of a job's picture.
    fn plane(&self, settings: &Settings) -> Option<(usize, Part)> {
        let layer = |name: &String| settings.layers.iter().position(|l| l.name == *name).map(|i| i + 1);
        let (plane, part) = match self {
            Self::Picture => (0, Part::Mean),
            Self::Error => (0, Part::Error),
            Self::Named(name) => (layer(name)?, Part::Mean),
            Self::ErrorOf(name) => (layer(name)?, Part::Error),
        };
        (part == Part::Mean || settings.replicates > 1).then_some((plane, part))
    }
}

impl fmt::Display for LayerName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Picture => f.write_str("picture"),
            Self::Error => f.write_str("error"),
            Self::Named(name) => f.write_str(name),
            Self::ErrorOf(name) => write!(f, "{name}.error"),
        }
    }
}

impl ExrFile {
    /// Its size in bytes.
    pub fn size(&self) -> u64 {
        match self {
            Self::Memory(bytes) => bytes.len() as u64,
            Self::Kept { size, .. } => *size,
        }
    }
}

impl Farm {
    /// The set of batches in the picture so far; `None` where there is no picture yet.
    pub async fn manifest(&self, id: &JobId) -> Result<Option<String>> {
        let row = self.job_row(id).await?;
        match self.live(id).filter(|_| !row.settled) {
            None => Ok(row.manifest),
            Some(live) => {
                let known = live.view().manifest;
                // After a restart the sums are not in memory yet; what another server appends to never is.
                let elsewhere = self.is_shared() && live.mandate().is_none();
                if (known.is_none() || elsewhere) && live.view().progress.batches > 0 {
                    drop(self.sums(&live).await?);
                    return Ok(live.view().manifest);
                }
                Ok(known)
            }
        }
    }

    /// Waits until the picture is not that of `manifest`, or has its last form, for `time` at most.
    pub async fn await_change(&self, id: &JobId, manifest: Option<&str>, time: Duration) -> Result<()> {
        let Some(live) = self.live(id) else { return Ok(()) };
        let mut changes = live.changes.subscribe();
        let change = async {
            while self.live(id).is_some() && self.manifest(id).await?.as_deref() == manifest {
                if changes.changed().await.is_err() {
                    break;
                }
            }
            Ok(())
        };
        tokio::select! {
            () = self.stopping.cancelled() => Ok(()),
            done = tokio::time::timeout(time, change) => done.unwrap_or(Ok(())),
        }
    }

    /// The picture so far, and the set of batches in it.
    pub async fn exr(&self, id: &JobId) -> Result<(String, ExrFile)> {
        let row = self.job_row(id).await?;
        if let (true, Some(manifest)) = (row.settled, row.manifest.clone()) {
            let (name, size) = self.kept(id, &manifest).await?;
            return Ok((manifest, ExrFile::Kept { name, size }));
        }
        let live = self.live(id).filter(|_| !row.settled).ok_or_else(|| FarmError::no_picture(&row))?;
        let made = self.make_exr(&live).await?;
        Ok((made.manifest, ExrFile::Memory(made.bytes)))
    }

    /// The name and size of the file of a job that is over.
    async fn kept(&self, id: &JobId, manifest: &str) -> Result<(BlobName, u64)> {
        let name = BlobName::Result(id.clone(), manifest.to_owned());
        match self.blobs.size(&name).await {
            Ok(size) => Ok((name, size)),
            Err(BlobError::Missing(_)) => {
                let name = BlobName::OldResult(id.clone());
                let size = self.blobs.size(&name).await?;
                Ok((name, size))
            }
            Err(error) => Err(error.into()),
        }
    }

    /// The channels of a job that is over; those shown last are remembered, as they are looked at in many ways.
    pub(super) async fn kept_layers(&self, id: &JobId, manifest: &str) -> Result<Arc<Layers>> {
        if let Some((_, layers)) = held(&self.shown.0).as_ref().filter(|(of, _)| of == manifest) {
            return Ok(Arc::clone(layers));
        }
        let exr = self.blobs.get(&self.kept(id, manifest).await?.0).await?;
        let layers = blocking(move || read_layers(&exr)).await?;
        let layers = Arc::new(layers.map_err(|e| FarmError::Damaged(e.to_string()))?);
        if layers.channels.values().map(Vec::len).sum::<usize>() <= SHOWN_MAX {
            *held(&self.shown.0) = Some((manifest.to_owned(), Arc::clone(&layers)));
        }
        Ok(layers)
    }

    /// Some bytes of a picture's file.
    pub async fn exr_range(&self, file: &ExrFile, range: Range<u64>) -> Result<Bytes> {
        match file {
            ExrFile::Memory(bytes) => Ok(bytes.slice(range.start as usize..range.end as usize)),
            ExrFile::Kept { name, .. } => Ok(self.blobs.get_range(name, range).await?),
        }
    }

    /// All bytes of a kept picture, piece by piece.
    pub async fn exr_stream(
        &self,
        name: &BlobName,
    ) -> Result<BoxStream<'static, std::result::Result<Bytes, BlobError>>> {
        Ok(self.blobs.stream(name).await?.1)
    }

    /// The EXR of what is appended; made once for each set of batches.
    pub(super) async fn make_exr(&self, live: &Live) -> Result<Made> {
        let row = self.job_row(&live.id).await?;
        let held = self.sums(live).await?;
        let merge = held.as_ref().expect("just read");
        let manifest = merge.manifest(&live.identity).ok_or_else(|| FarmError::NoPicture(live.id.clone()))?;
        if let Some(made) = live.made().filter(|made| made.manifest == manifest) {
            return Ok(made);
        }
        let attributes = attributes(&row, live, merge, manifest.clone());
        let (size, region) = (live.spec.settings.size, live.spec.region);
        let bytes = blocking(move || {
            let picture = picture(size, region, &held.as_ref().expect("just read").prefixes);
            drop(held);
            write_picture(&picture, &attributes)
        })
        .await?;
        let made = Made { manifest, bytes: bytes.into() };
        live.set_made(made.clone());
        Ok(made)
    }

    /// The picture so far as PNG, and the set of batches in it.
    pub async fn png(&self, id: &JobId, layer: LayerName, develop: Develop) -> Result<(String, Bytes)> {
        let row = self.job_row(id).await?;
        let spec = read_spec(&row)?;
        let plane = layer.plane(&spec.settings);
        let (plane, part) = plane.ok_or_else(|| FarmError::NoLayer(layer.to_string()))?;
        let region = spec.region;
        if let (true, Some(manifest)) = (row.settled, &row.manifest) {
            let layers = self.kept_layers(id, manifest).await?;
            let name = plane.checked_sub(1).map(|i| spec.settings.layers[i].name.as_str());
            let prefix = prefix_of(name, part);
            let png = blocking(move || develop_kept(&layers, region, &prefix, &develop)).await??;
            return Ok((manifest.clone(), png));
        }
        let live = self.live(id).filter(|_| !row.settled).ok_or_else(|| FarmError::no_picture(&row))?;
        let held = self.sums(&live).await?;
        let manifest = held.as_ref().and_then(|merge| merge.manifest(&live.identity));
        let manifest = manifest.ok_or_else(|| FarmError::NoPicture(id.clone()))?;
        let size = spec.settings.size;
        let bytes = blocking(move || {
            let picture = picture(size, region, &held.as_ref().expect("just read").prefixes);
            drop(held);
            let planes = if part == Part::Mean { &picture.planes } else { &picture.errors };
            png(region, &planes[plane], &develop)
        })
        .await?;
        Ok((manifest, bytes.into()))
    }
}

/// A picture that has other channels or another size than its job.
pub(super) fn misfit() -> FarmError {
    FarmError::Damaged("the kept picture has other channels or another size".to_owned())
}

fn develop_kept(layers: &Layers, region: Region, prefix: &str, develop: &Develop) -> Result<Bytes> {
    let plane = plane(layers, region, prefix).ok_or_else(misfit)?;
    Ok(png(region, &plane, develop).into())
}

fn plane(layers: &Layers, region: Region, prefix: &str) -> Option<Plane> {
    let dot = if prefix.is_empty() { "" } else { "." };
    let channel =
        |c| layers.channels.get(&format!("{prefix}{dot}{c}")).filter(|v| v.len() == region.pixels());
    let (r, g, b) = (channel("R")?, channel("G")?, channel("B")?);
    Some((0..region.pixels()).map(|i| [r[i], g[i], b[i]]).collect())
}

/// What a picture says of itself. All of it follows from job and set of batches, so that a file made
/// twice says the same.
fn attributes(row: &JobRow, live: &Live, merge: &Merge, manifest: String) -> PictureAttributes {
    let progress = merge.progress();
    let begun = row.started_at.unwrap_or(row.created_at);
    PictureAttributes {
        job: live.id.to_string(),
        scene: live.scene.to_string(),
        samples: progress.samples,
        seed: live.spec.settings.seed,
        method: live.spec.settings.method.name().to_owned(),
        paths: shown(&live.spec.settings.paths).to_owned(),
        camera: live.spec.settings.camera.to_string(),
        invalid: merge.invalid(),
        layers: (live.spec.settings.layers.iter())
            .map(|layer| (layer.name.clone(), layer.shows.to_string()))
            .collect(),
        manifest,
        render_seconds: progress.worker_micros as f64 * 1e-6,
        software: SOFTWARE.to_owned(),
        capture_date: begun.to_zoned(jiff::tz::TimeZone::UTC).strftime("%Y:%m:%d %H:%M:%S").to_string(),
    }
}
