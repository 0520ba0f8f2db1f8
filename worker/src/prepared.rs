//! Scenes ready to be rendered, in memory.

use ovtigre_core::settings::Settings;
use ovtigre_proto::id::BlobId;
use std::sync::Arc;

/// Scenes kept: that of the current batch, and that of the one before.
const KEPT: usize = 2;

/// What a prepared scene depends on.
#[derive(Clone, Debug, PartialEq)]
pub struct Key {
    scene: BlobId,
    settings: Settings,
}

impl Key {
    /// Of `scene` under `settings`: the choice of random sequences is left out.
    pub fn new(scene: BlobId, settings: &Settings) -> Self {
        Self { scene, settings: Settings { seed: 0, replicates: 1, ..settings.clone() } }
    }
}

/// The last used scenes.
#[derive(Debug)]
pub struct Prepared<S>(Vec<(Key, Arc<S>)>);

impl<S> Default for Prepared<S> {
    fn default() -> Self {
        Self(Vec::new())
    }
}

impl<S> Prepared<S> {
    /// A scene that is kept; it counts as used now.
    pub fn find(&mut self, key: &Key) -> Option<Arc<S>> {
        let place = self.0.iter().position(|(other, _)| other == key)?;
        let found = self.0.remove(place);
        self.0.insert(0, found);
        Some(self.0[0].1.clone())
    }

    /// Drops the longest unused scene where one more would be too many.
    pub fn make_room(&mut self) {
        self.0.truncate(KEPT - 1);
    }

    /// Keeps a scene.
    pub fn keep(&mut self, key: Key, scene: Arc<S>) {
        self.make_room();
        self.0.insert(0, (key, scene));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mock;

    #[test]
    fn the_longest_unused_scene_goes() {
        let key = |n: u8| Key::new(BlobId::of([n; 32]), &mock::settings());
        let mut prepared = Prepared::default();
        prepared.keep(key(1), Arc::new(1));
        prepared.keep(key(2), Arc::new(2));
        assert!(prepared.find(&key(1)).is_some());
        prepared.keep(key(3), Arc::new(3));
        assert_eq!((prepared.find(&key(1)).as_deref(), prepared.find(&key(2))), (Some(&1), None));
    }

    #[test]
    fn sequences_do_not_make_another_scene_but_cameras_do() {
        let (id, settings) = (BlobId::of([0; 32]), mock::settings());
        let key = Key::new(id.clone(), &settings);
        assert_eq!(key, Key::new(id.clone(), &Settings { seed: 7, replicates: 2, ..settings.clone() }));
        let camera = ovtigre_core::settings::CameraChoice::Index(3);
        assert_ne!(key, Key::new(id, &Settings { camera, ..settings }));
    }
}
