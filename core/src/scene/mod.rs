//! What a render may ask of a scene: camera, meshes, materials, textures, lights, environment.
