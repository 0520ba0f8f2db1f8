//! What of a document moves: channels and what they drive.

use crate::gltf::accessor::{Accessor, Component, Source};
use crate::gltf::curve::{Curve, Interpolation, Side};
use crate::gltf::document::At;
use crate::gltf::error::{LoadError, Problems};
use crate::gltf::uri::shorten;
use std::collections::{BTreeMap, BTreeSet};

/// All animations of a document, which play together.
#[derive(Default)]
pub(crate) struct Animation<'a> {
    /// By the node's index in the document.
    nodes: BTreeMap<usize, Channels<'a>>,
}

/// The curves that drive one node.
#[derive(Default)]
pub(crate) struct Channels<'a> {
    pub(crate) translation: Option<Curve<'a>>,
    pub(crate) rotation: Option<Curve<'a>>,
    pub(crate) scale: Option<Curve<'a>>,
    pub(crate) weights: Option<Curve<'a>>,
}

/// What of a node a channel drives.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Path {
    Translation,
    Rotation,
    Scale,
    Weights,
}

/// Reads animations, and remembers which accessors were looked through: many channels share one.
struct Reader<'a> {
    source: Source<'a>,
    times: BTreeSet<usize>,
    values: BTreeSet<(usize, Path)>,
}

/// The animations of a document. Where two channels drive the same, the later one counts.
pub(crate) fn read<'a>(source: Source<'a>, problems: &mut Problems) -> Result<Animation<'a>, LoadError> {
    let mut reader = Reader { source, times: BTreeSet::new(), values: BTreeSet::new() };
    let mut animation = Animation::default();
    for item in source.document.list("animations")? {
        let samplers = item.items("samplers")?;
        for channel in item.items("channels")? {
            let Some((node, path, width)) = reader.target(&channel, problems)? else {
                continue;
            };
            let sampler = channel.need("sampler")?.as_index("samplers", samplers.len())?;
            let curve = reader.curve(&samplers[sampler], path, width)?;
            let channels = animation.nodes.entry(node).or_default();
            let driven = match path {
                Path::Translation => &mut channels.translation,
                Path::Rotation => &mut channels.rotation,
                Path::Scale => &mut channels.scale,
                Path::Weights => &mut channels.weights,
            };
            if driven.replace(curve).is_some() {
                let detail =
                    format!("drives what an earlier channel drives, of /nodes/{node}: this one counts");
                problems.add(&channel.pointer, detail);
            }
        }
    }
    Ok(animation)
}

impl<'a> Reader<'a> {
    /// What a channel drives, and how many morph weights that is; `None` where it drives nothing known.
    fn target(
        &self,
        channel: &At<'a>,
        problems: &mut Problems,
    ) -> Result<Option<(usize, Path, usize)>, LoadError> {
        let document = self.source.document;
        let target = channel.object("target")?.ok_or_else(|| channel.error("\"target\" is missing"))?;
        let path = match target.text("path")? {
            Some("translation") => Path::Translation,
            Some("rotation") => Path::Rotation,
            Some("scale") => Path::Scale,
            Some("weights") => Path::Weights,
            Some(other) => {
                let detail = format!("\"{}\" is not animated: the channel is left out", shorten(other));
                problems.add(target.pointer_to("path"), detail);
                return Ok(None);
            }
            None => return Err(target.error("\"path\" is missing")),
        };
        let Some(node) = target.index("node", "nodes", document.count("nodes"))? else {
            problems.add(&target.pointer, "drives no node: the channel is left out");
            return Ok(None);
        };
        let item = document.item("nodes", node)?;
        if path != Path::Weights {
            if item.get("matrix").is_some() {
                let detail = "drives a node that has a matrix: it is taken apart, and shear is lost";
                problems.add(&target.pointer, detail);
            }
            return Ok(Some((node, path, 1)));
        }
        let targets = match item.index("mesh", "meshes", document.count("meshes"))? {
            Some(mesh) => match document.item("meshes", mesh)?.items("primitives")?.first() {
                Some(primitive) => primitive.elements("targets")?.len(),
                None => 0,
            },
            None => 0,
        };
        if targets == 0 {
            problems.add(&target.pointer, "drives weights of a node without morph targets: it is left out");
        }
        Ok((targets > 0).then_some((node, path, targets)))
    }

    fn curve(&mut self, sampler: &At<'a>, path: Path, width: usize) -> Result<Curve<'a>, LoadError> {
        let accessors = self.source.document.count("accessors");
        let interpolation = match sampler.text("interpolation")? {
            None | Some("LINEAR") => Interpolation::Linear,
            Some("STEP") => Interpolation::Step,
            Some("CUBICSPLINE") => Interpolation::CubicSpline,
            Some(_) => {
                return Err(sampler.error("\"interpolation\" must be STEP, LINEAR or CUBICSPLINE"));
            }
        };
        let input = sampler.need("input")?;
        let index = input.as_index("accessors", accessors)?;
        let times = self.source.accessor(index)?;
        if self.times.insert(index) {
            check_times(&input, &times)?;
        }
        let output = sampler.need("output")?;
        let index = output.as_index("accessors", accessors)?;
        let values = self.source.accessor(index)?;
        let components = match path {
            Path::Translation | Path::Scale => 3,
            Path::Rotation => 4,
            Path::Weights => 1,
        };
        let float = values.component == Component::F32;
        let normalised = matches!(path, Path::Rotation | Path::Weights) && values.is_normalised();
        if values.components != components || !(float || normalised) {
            let kinds = if components == 3 { "" } else { " or normalised integers" };
            let detail = format!("must hold {components} floats{kinds} an element for what it drives");
            return Err(output.error(detail));
        }
        let needed = (times.count as u64) * (interpolation.parts() * width) as u64;
        if values.count as u64 != needed {
            let (have, keys) = (values.count, times.count);
            let detail = format!("holds {have} elements, but its {keys} key frames need {needed}");
            return Err(output.error(detail));
        }
        let curve = Curve { times, values, interpolation, width };
        if self.values.insert((index, path)) {
            check_values(&output, &curve, path)?;
        }
        Ok(curve)
    }
}

fn check_times(input: &At<'_>, times: &Accessor<'_>) -> Result<(), LoadError> {
    if times.components != 1 || times.component != Component::F32 {
        return Err(input.error("must be scalar floats: the times of key frames"));
    }
    if times.count == 0 {
        return Err(input.error("has no key frames"));
    }
    let mut before = f32::NEG_INFINITY;
    for key in 0..times.count {
        let [time] = times.get::<1>(key);
        if !time.is_finite() {
            return Err(input.error(format!("the time of key frame {key} is not a finite number")));
        }
        if time <= before {
            return Err(input.error(format!("key frame {key} is not later than the one before: {time} s")));
        }
        before = time;
    }
    Ok(())
}

fn check_values(output: &At<'_>, curve: &Curve<'_>, path: Path) -> Result<(), LoadError> {
    let parts = curve.interpolation.parts();
    for element in 0..curve.values.count {
        let value = curve.values.get::<4>(element);
        if !value.iter().all(|number| number.is_finite()) {
            return Err(output.error(format!("element {element} is not a finite number")));
        }
        // Of a spline's three parts the middle one is the value.
        if path == Path::Rotation && value == [0.0; 4] && (parts == 1 || element % 3 == 1) {
            return Err(output.error(format!("element {element} is a quaternion without length")));
        }
    }
    Ok(())
}

impl<'a> Animation<'a> {
    /// The curves that drive a node of the document.
    pub(crate) fn channels(&self, node: usize) -> Option<&Channels<'a>> {
        self.nodes.get(&node)
    }

    /// The morph weights of a node of the document at a time, where they are driven.
    pub(crate) fn weights(&self, node: usize, time: f64, side: Side) -> Option<Vec<f64>> {
        Some(self.channels(node)?.weights.as_ref()?.weights(time, side))
    }
}

impl<'a> Channels<'a> {
    /// The curves that move the node itself.
    pub(crate) fn transforms(&self) -> impl Iterator<Item = &Curve<'a>> {
        [&self.translation, &self.rotation, &self.scale].into_iter().flatten()
    }
}
