//! Scenes, partials, sums and results over an object store.
