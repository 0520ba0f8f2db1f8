//! glTF bytes to a scene, with limits and named errors.
