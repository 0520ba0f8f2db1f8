//! Variants of materials: `KHR_materials_variants`.

use crate::gltf::accessor::Source;
use crate::gltf::document::{At, Document};
use crate::gltf::error::LoadError;

const NAME: &str = "KHR_materials_variants";

/// Names of the variants, in the document's order.
pub(crate) fn names(document: &Document) -> Result<Vec<String>, LoadError> {
    let Some(extension) = document.root().extension(NAME)? else {
        return Ok(Vec::new());
    };
    Ok(extension.items("variants")?.iter().map(At::name).collect())
}

/// The number of the variant with a name.
pub(crate) fn find(document: &Document, name: &str) -> Result<usize, LoadError> {
    let names = names(document)?;
    names.iter().position(|one| one == name).ok_or_else(|| {
        let pointer = if names.is_empty() { String::new() } else { format!("/extensions/{NAME}") };
        let list: Vec<String> = names.iter().map(|name| format!("\"{name}\"")).collect();
        let has = if list.is_empty() { "none".to_owned() } else { list.join(", ") };
        document.error(pointer, format!("there is no variant \"{name}\"; the scene has {has}"))
    })
}

/// The material of a primitive in the variant that is shown.
pub(crate) fn material(source: Source<'_>, primitive: &At<'_>) -> Result<Option<usize>, LoadError> {
    let materials = source.document.count("materials");
    if let (Some(variant), Some(extension)) = (source.variant, primitive.extension(NAME)?) {
        for mapping in extension.items("mappings")? {
            for at in mapping.elements("variants")? {
                if at.as_index("variants", usize::MAX)? == variant {
                    return mapping.index("material", "materials", materials);
                }
            }
        }
    }
    primitive.index("material", "materials", materials)
}
