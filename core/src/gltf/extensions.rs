//! Which extensions are understood.

use crate::gltf::document::Document;
use crate::gltf::error::{LoadError, Problems};

/// What becomes of an extension.
enum Support {
    /// Honoured.
    Full,
    /// Honoured in part: what is left out.
    Partly(&'static str),
}

fn support(name: &str) -> Option<Support> {
    match name {
        "KHR_draco_mesh_compression"
        | "KHR_lights_punctual"
        | "KHR_materials_anisotropy"
        | "KHR_materials_clearcoat"
        | "KHR_materials_diffuse_transmission"
        | "KHR_materials_dispersion"
        | "KHR_materials_emissive_strength"
        | "KHR_materials_ior"
        | "KHR_materials_iridescence"
        | "KHR_materials_pbrSpecularGlossiness"
        | "KHR_materials_sheen"
        | "KHR_materials_specular"
        | "KHR_materials_transmission"
        | "KHR_materials_unlit"
        | "KHR_materials_variants"
        | "KHR_materials_volume"
        | "KHR_mesh_quantization"
        | "KHR_meshopt_compression"
        | "KHR_texture_transform"
        | "EXT_lights_image_based"
        | "EXT_mesh_gpu_instancing"
        | "EXT_meshopt_compression"
        | "EXT_texture_webp" => Some(Support::Full),
        "KHR_animation_pointer" => Some(Support::Partly("only transforms and weights of nodes are animated")),
        _ => None,
    }
}

/// Refuses a document that requires what is not supported; warns of what it only uses.
pub(crate) fn check(document: &Document, problems: &mut Problems) -> Result<(), LoadError> {
    let root = document.root();
    for at in root.elements("extensionsRequired")? {
        let Some(name) = at.value.as_str() else {
            return Err(at.error("should be the name of an extension"));
        };
        if support(name).is_none() {
            let (file, pointer) = (document.file().to_owned(), at.pointer.clone());
            return Err(LoadError::RequiredExtension { file, pointer, name: name.to_owned() });
        }
        if !root.elements("extensionsUsed")?.iter().any(|used| used.value.as_str() == Some(name)) {
            problems.add(&at.pointer, format!("{name} is required, but not listed in extensionsUsed"));
        }
    }
    for at in root.elements("extensionsUsed")? {
        let Some(name) = at.value.as_str() else {
            return Err(at.error("should be the name of an extension"));
        };
        match support(name) {
            Some(Support::Full) => {}
            Some(Support::Partly(left_out)) => problems.add(&at.pointer, format!("{name}: {left_out}")),
            None => {
                problems.add(&at.pointer, format!("the extension {name} is not supported and is left out"));
            }
        }
    }
    Ok(())
}
