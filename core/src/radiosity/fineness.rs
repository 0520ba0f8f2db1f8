//! How finely a scene is cut and looked at.

/// How finely a scene is cut and looked at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Fineness {
    /// Patches to begin with, where the scene has fewer triangles.
    pub even: usize,
    /// Patches at most after cutting those over which light varies; no fewer than triangles.
    pub most: usize,
    /// How often patches are cut where light varies.
    pub refinements: u32,
    /// Rays from each element, a power of two; fewer where there are very many elements.
    pub rays: u32,
}

/// Rays of all elements together at most, as long as each has [`RAYS_MIN`].
const RAYS_ALL: usize = 1 << 23;
/// Rays from an element at least.
const RAYS_MIN: u32 = 16;

impl Default for Fineness {
    /// For pictures.
    fn default() -> Self {
        Self { even: 2048, most: 8192, refinements: 2, rays: 256 }
    }
}

impl Fineness {
    /// Patches of about one size, not refined.
    pub fn even(patches: usize, rays: u32) -> Self {
        Self { even: patches, most: patches, refinements: 0, rays }
    }

    /// Rays from each of `elements`: a power of two.
    pub fn rays_for(&self, elements: usize) -> u32 {
        let affordable = (RAYS_ALL / elements.max(1)).max(RAYS_MIN as usize) as u32;
        self.rays.min(1 << affordable.ilog2()).max(RAYS_MIN)
    }
}
