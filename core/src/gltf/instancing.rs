//! Nodes whose mesh stands at many places: `EXT_mesh_gpu_instancing`.

use crate::gltf::accessor::{Accessor, Source};
use crate::gltf::document::At;
use crate::gltf::error::LoadError;
use crate::gltf::nodes::Tree;
use glam::{DAffine3, DQuat, DVec3};

const NAME: &str = "EXT_mesh_gpu_instancing";

/// Gives each such node a child without a name of its own for every place; the mesh stands there and not at the node.
pub(crate) fn expand(source: Source<'_>, tree: &mut Tree<'_>) -> Result<(), LoadError> {
    let mut all = 0_u64;
    for place in 0..tree.nodes.len() {
        let at = tree.nodes[place].at.clone();
        let Some(extension) = at.extension(NAME)? else { continue };
        let Some(attributes) = extension.object("attributes")? else { continue };
        let transforms = Transforms::read(source, &attributes)?;
        all += transforms.count as u64;
        if all > source.limits.instances {
            return Err(LoadError::Limit {
                file: source.document.file().to_owned(),
                pointer: attributes.pointer,
                what: "instances",
                found: all,
                limit: source.limits.instances,
            });
        }
        for i in 0..transforms.count {
            let local = transforms.get(i);
            if !local.is_finite() {
                let detail = format!("the transform of instance {i} is not finite");
                return Err(attributes.error(detail));
            }
            tree.place_mesh(place, local)?;
        }
        tree.take_mesh(place);
    }
    Ok(())
}

struct Transforms<'a> {
    count: usize,
    translation: Option<Accessor<'a>>,
    rotation: Option<Accessor<'a>>,
    scale: Option<Accessor<'a>>,
}

impl<'a> Transforms<'a> {
    fn read(source: Source<'a>, attributes: &At<'_>) -> Result<Self, LoadError> {
        let mut count = None;
        let mut one = |name: &str, components: usize| -> Result<Option<Accessor<'a>>, LoadError> {
            let accessors = source.document.count("accessors");
            let Some(index) = attributes.index(name, "accessors", accessors)? else {
                return Ok(None);
            };
            let accessor = source.accessor(index)?;
            let at = attributes.need(name)?;
            if accessor.components != components {
                let have = accessor.components;
                return Err(at.error(format!("has {have} numbers an instance instead of {components}")));
            }
            if *count.get_or_insert(accessor.count) != accessor.count {
                return Err(at.error("the attributes do not all have as many instances"));
            }
            Ok(Some(accessor))
        };
        let (translation, rotation, scale) = (one("TRANSLATION", 3)?, one("ROTATION", 4)?, one("SCALE", 3)?);
        let count = count.ok_or_else(|| {
            attributes
                .error("has none of TRANSLATION, ROTATION and SCALE: it does not say how many instances")
        })?;
        Ok(Self { count, translation, rotation, scale })
    }

    fn get(&self, i: usize) -> DAffine3 {
        let vector = |accessor: &Option<Accessor<'_>>, rest: DVec3| {
            accessor.as_ref().map_or(rest, |a| DVec3::from(a.get::<3>(i).map(f64::from)))
        };
        let rotation = self.rotation.as_ref().map_or(DQuat::IDENTITY, |a| {
            let given = DQuat::from_array(a.get::<4>(i).map(f64::from));
            let length = given.length();
            if length > 0.0 { given / length } else { DQuat::IDENTITY }
        });
        let (scale, translation) = (vector(&self.scale, DVec3::ONE), vector(&self.translation, DVec3::ZERO));
        DAffine3::from_scale_rotation_translation(scale, rotation, translation)
    }
}
