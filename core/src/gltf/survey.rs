//! A look at the parts of a document that the scene does not use.

use crate::gltf::accessor::Source;
use crate::gltf::bundle::Bundle;
use crate::gltf::document::At;
use crate::gltf::error::{LoadError, Problems};
use crate::gltf::{pictures, schema};

/// Elements of accessors that are looked at for numbers that are none.
const ELEMENTS: usize = 1 << 22;
/// Pixels of pictures that are decoded only to see whether they can be.
const PIXELS: u64 = 1 << 22;

/// Reports what is wrong anywhere in a document. What the scene uses has been read: `used` lists its pictures,
/// in rising order.
pub(crate) fn survey(bundle: &Bundle, source: Source<'_>, used: &[usize], problems: &mut Problems) {
    schema::check(source.document.root().value, problems);
    for index in 0..source.document.count("bufferViews") {
        if let Err(error) = source.buffers.view(source.document, index) {
            problems.add_error(&error);
        }
    }
    let mut left = ELEMENTS;
    for index in 0..source.document.count("accessors") {
        if let Err(error) = accessor(source, index, &mut left) {
            problems.add_error(&error);
        }
    }
    for mesh in source.document.list("meshes").unwrap_or_default() {
        for primitive in mesh.items("primitives").unwrap_or_default() {
            if let Err(error) = counts(source, &primitive) {
                problems.add_error(&error);
            }
        }
    }
    let mut pixels = PIXELS;
    for index in (0..source.document.count("images")).filter(|index| used.binary_search(index).is_err()) {
        if let Err(error) = pictures::try_decode(bundle, source, index, &mut pixels, problems) {
            problems.add_error(&error);
        }
    }
}

/// Looks at an accessor, and at its elements while `left` lasts.
fn accessor(source: Source<'_>, index: usize, left: &mut usize) -> Result<(), LoadError> {
    let accessor = source.accessor(index)?;
    let item = source.document.item("accessors", index)?;
    let look_at = accessor.count.min(*left);
    *left -= look_at;
    let broken = |i: &usize| accessor.get::<16>(*i).iter().any(|number| !number.is_finite());
    if let Some(element) = (0..look_at).find(broken) {
        return Err(item.error(format!("element {element} is not a finite number")));
    }
    let sparse = accessor.sparse_len().min(*left);
    *left -= sparse;
    if (1..sparse).any(|i| accessor.sparse_index(i - 1) >= accessor.sparse_index(i)) {
        return Err(item.need("sparse")?.error("its indices do not rise strictly"));
    }
    Ok(())
}

/// All attributes of a primitive have as many elements.
fn counts(source: Source<'_>, primitive: &At<'_>) -> Result<(), LoadError> {
    let accessors = source.document.count("accessors");
    let Some(attributes) = primitive.object("attributes")? else {
        return Ok(());
    };
    let mut first = None;
    for name in attributes.members().into_iter().flat_map(|members| members.keys()) {
        let Some(index) = attributes.index(name, "accessors", accessors)? else {
            continue;
        };
        let count = source.document.item("accessors", index)?.whole("count")?;
        if *first.get_or_insert(count) != count {
            return Err(attributes.error("the attributes do not all have as many elements"));
        }
    }
    Ok(())
}
