//! Bounding volume hierarchies over triangles and instances; closest hit, any hit, transmittance.
