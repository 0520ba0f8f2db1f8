//! Small pictures of jobs that have none of their own yet: what a pilot made while it chose the method.

use super::{Farm, append::blocking, error::Result, live::held, picture::LayerName};
use bytes::Bytes;
use ovtigre_core::film::{
    develop::{Develop, png},
    size::Size,
    sketch::Sketch,
};
use ovtigre_proto::id::JobId;
use std::{
    collections::VecDeque,
    sync::{Arc, Mutex},
};

/// Sketches in memory, at most: some 25 MB of them. They are of no use once a job has its first samples.
const SKETCHES_MAX: usize = 256;

/// The sketches that were made last, by this server.
#[derive(Debug, Default)]
pub(super) struct Sketches(Mutex<VecDeque<(JobId, Arc<Sketch>)>>);

impl Sketches {
    /// Keeps a job's until many others came.
    pub(super) fn keep(&self, id: JobId, sketch: Sketch) {
        let mut all = held(&self.0);
        all.truncate(SKETCHES_MAX - 1);
        all.push_front((id, Arc::new(sketch)));
    }

    fn of(&self, id: &JobId) -> Option<Arc<Sketch>> {
        held(&self.0).iter().find(|(job, _)| job == id).map(|(_, sketch)| Arc::clone(sketch))
    }
}

impl Farm {
    /// A job's picture by its pilot as PNG, as large as the job's own will be when it is developed so, and the size in which it was
    /// made. There is none of its errors and of its layers, and where no pilot ran, where another server took the job, or long ago.
    pub async fn sketch(
        &self,
        id: &JobId,
        layer: &LayerName,
        develop: Develop,
    ) -> Result<Option<(Size, Bytes)>> {
        let (Some(sketch), Some(live), LayerName::Picture) = (self.sketches.of(id), self.live(id), layer)
        else {
            return Ok(None);
        };
        let region = live.spec.region;
        // At once to the size that is asked for: a small picture of a large one costs no more than that.
        let to = develop.size(Size { width: region.width, height: region.height });
        let (size, frame) = (sketch.size(), to.frame());
        let bytes = blocking(move || png(frame, &sketch.resized(to), &develop)).await?;
        Ok(Some((size, bytes.into())))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_ones_are_kept() {
        let sketches = Sketches::default();
        let id = |n: usize| -> JobId { format!("{n:012x}").parse().unwrap() };
        for n in 0..SKETCHES_MAX + 3 {
            sketches.keep(id(n), Sketch::new(Size { width: 1, height: 1 }, vec![[n as f32; 3]]));
        }
        assert_eq!(held(&sketches.0).len(), SKETCHES_MAX);
        assert!(sketches.of(&id(2)).is_none());
        assert_eq!(sketches.of(&id(3)).unwrap().resized(Size { width: 1, height: 1 }), [[3.0; 3]]);
    }
}
