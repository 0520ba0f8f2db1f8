//! Which samples of a job are allocated to its tiles: decided once, at an early checkpoint, from what is there then.

use super::{Farm, append::Merge, error::Result, live::Live, spec::JobSpec};
use ovtigre_core::film::{
    allocate::{REPLICATES_MIN, SAMPLES_ENOUGH, allocate, decided_after, samples_min},
    allocation::{Allocation, Allocations},
    append::Prefix,
    batch::Batch,
    grid::Grid,
    schedule::Schedule,
    size::Region,
};
use ovtigre_core::settings::{Distribution, Method};
use ovtigre_proto::job::JobRequest;
use std::sync::Arc;

/// How a request wishes samples to be distributed, or what speaks against it.
pub(super) fn wished(
    request: &JobRequest,
    method: Method,
    replicates: u32,
    note: &mut impl FnMut(&str, String),
) -> Distribution {
    let sampling = request.sampling.unwrap_or_default();
    if sampling == Distribution::Adaptive && method.splats() {
        let name = method.name();
        let why = format!(
            "a sample of '{name}' can bring light to any pixel, so that pixels cannot have different numbers of them: leave 'sampling' out, or take the method 'path'"
        );
        note("/sampling", why);
    }
    if sampling == Distribution::Adaptive && replicates < REPLICATES_MIN {
        let why = format!(
            "adaptive sampling needs {REPLICATES_MIN} replicates or more: each half of them decides for the other"
        );
        note("/replicates", why);
    }
    sampling
}

/// When samples are allocated, or that there are too few for it.
pub(super) fn resolve(spec: &mut JobSpec) {
    if spec.settings.sampling == Distribution::Uniform {
        return;
    }
    spec.decided_after = decided_after(&spec.schedule(), spec.samples);
    if spec.decided_after.is_none() {
        spec.settings.sampling = Distribution::Uniform;
        let least = samples_min(&JobSpec { samples: SAMPLES_ENOUGH, ..spec.clone() }.schedule());
        spec.warnings.push(format!(
            "{} samples are too few for adaptive sampling, which needs {least}: all pixels get the same number, also of samples that are asked for later",
            spec.samples_asked()
        ));
    }
}

/// What is known of a job's allocations.
#[derive(Clone, Debug)]
pub struct Decision {
    /// Number of blocks after which it is taken.
    pub after: u32,
    /// How it was taken.
    pub allocations: Option<Arc<Allocations>>,
}

impl Decision {
    /// How many of a batch's samples each pixel has; `None` where all have all of them. A batch that follows the decision is
    /// known only where that is.
    pub fn of(&self, batch: Batch) -> Option<&Allocation> {
        let allocations = self.allocations.as_ref().filter(|_| batch.block.index >= self.after)?;
        Some(allocations.of(batch.replicate))
    }

    /// Whether it has to be taken before a batch is rendered.
    pub fn is_awaited_by(&self, batch: Batch) -> bool {
        batch.block.index >= self.after && self.allocations.is_none()
    }
}

/// Checkpoints of a schedule that are taken before samples are allocated, which is `after` so many blocks.
pub(super) fn looks_before(schedule: &Schedule, after: u32) -> u32 {
    schedule.checkpoints().into_iter().filter(|blocks| (*blocks as u32) < after).count() as u32
}

impl Farm {
    /// Learns how a job's samples are allocated, where that was decided, also by another server.
    pub(super) async fn learn_allocations(&self, live: &Live) -> Result<()> {
        if live.decision().is_some_and(|decision| decision.allocations.is_none())
            && let Some(allocations) = self.store.allocations(&live.id).await?
        {
            live.set_allocations(Arc::new(allocations));
        }
        Ok(())
    }
}

impl Merge {
    /// The allocations, where the job's next checkpoint is that of the decision and it was not taken before.
    pub(super) fn decide(&self, live: &Live) -> Option<Arc<Allocations>> {
        let decision = live.decision().filter(|decision| decision.allocations.is_none())?;
        let at = self.points.get(self.checkpoints as usize)?;
        let (size, region) = (live.spec.settings.size, live.spec.region);
        (*at == decision.after).then(|| allocate(size, region, &self.prefixes)).flatten().map(Arc::new)
    }
}

impl Merge {
    /// Samples that a pixel has in the mean, over those of the pixel with the fewest.
    pub(super) fn scarcity(&self, region: Region) -> f64 {
        let Some(both) = self.decision.as_ref().and_then(|decision| decision.allocations.as_ref()) else {
            return 1.0;
        };
        let of = |prefix: &Prefix| {
            let has = both.of(prefix.replicate()).fewest(region, prefix.samples());
            if has == 0 { 1.0 } else { f64::from(prefix.samples()) / f64::from(has) }
        };
        self.prefixes.iter().flatten().map(of).fold(1.0, f64::max)
    }
}

/// Numbers of rays that a batch's sum has to bring of tiles.
pub(super) fn counted(live: &Live, batch: Batch) -> usize {
    let counts = live.decision().is_some_and(|decision| batch.block.index < decision.after);
    if counts { Grid::of(live.spec.settings.size).met(batch.region).count() } else { 0 }
}
