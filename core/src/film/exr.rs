//! Partial sums and pictures as `OpenEXR` files, and back.

use super::{
    batch::{Batch, Block},
    estimate::Picture,
    grid::TILES_MAX,
    invalid::InvalidSamples,
    size::{Region, Size},
    sum::{Plane, Sum},
};
use exr::prelude::{
    AnyChannel, AnyChannels, AttributeValue, Encoding, FlatSamples, Image, IntegerBounds, Layer,
    LayerAttributes, ReadChannels as _, ReadLayers as _, Text, Vec2, WritableImage as _, read,
};
use std::{collections::BTreeMap, io::Cursor};

/// Why bytes are not the EXR that was expected.
#[derive(Debug, thiserror::Error)]
pub enum ExrError {
    /// Not an EXR, or a damaged one.
    #[error("not a readable EXR: {0}")]
    Unreadable(String),
    /// More pixels or channels than allowed.
    #[error("the EXR has {got} values, more than the {limit} that are expected here")]
    TooLarge {
        /// Values in the file.
        got: u64,
        /// Values at most.
        limit: u64,
    },
    /// An attribute is missing or wrong.
    #[error("the attribute '{0}' is missing or is not what a partial sum says")]
    Attribute(&'static str),
    /// A channel is missing, or has another type or size.
    #[error("channel '{0}' is missing, or is not 32-bit float of the region's size")]
    Channel(String),
    /// A value that no sum can have.
    #[error("{value} in channel '{channel}': sums are finite and not negative")]
    NoSum {
        /// Which channel.
        channel: String,
        /// Which value.
        value: f32,
    },
}

/// Whose sum it is; the rest of a partial EXR's attributes is in the [`Sum`].
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PartialAttributes {
    /// The job's id.
    pub job: String,
    /// The scene's hash.
    pub scene: String,
    /// The method's name.
    pub method: String,
    /// How the method solved the scene before the first sample, as JSON, where it did.
    pub solution: Option<String>,
    /// Hash of the allocation that says how many samples each pixel has, where there is one.
    pub allocation: Option<String>,
}

/// What a picture's attributes say.
#[derive(Clone, Debug, PartialEq)]
pub struct PictureAttributes {
    /// The job's id.
    pub job: String,
    /// The scene's hash.
    pub scene: String,
    /// Samples a pixel.
    pub samples: f64,
    /// The seed.
    pub seed: u64,
    /// The method's name.
    pub method: String,
    /// The path expression.
    pub paths: String,
    /// Number of the scene's camera, or `framed`.
    pub camera: String,
    /// Samples that were dropped.
    pub invalid: InvalidSamples,
    /// Of each layer its name, and what it shows: a path expression, or a technique.
    pub layers: Vec<(String, String)>,
    /// Hash of the set of batches in the picture.
    pub manifest: String,
    /// Time workers spent, summed.
    pub render_seconds: f64,
    /// Program and version.
    pub software: String,
    /// `YYYY:MM:DD hh:mm:ss`.
    pub capture_date: String,
}

/// Any EXR's channels: name to values, row by row.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Layers {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Values by full channel name.
    pub channels: BTreeMap<String, Vec<f32>>,
    /// Attributes that are texts or numbers.
    pub attributes: BTreeMap<String, String>,
}

/// Most bytes of a partial's `ovtigre.solution`.
const SOLUTION_MAX: usize = 1 << 18;

const CHANNELS: [&str; 3] = ["R", "G", "B"];

/// `R`, `G`, `B` for the picture, `NAME.R` … for a layer.
fn channel_name(prefix: &str, channel: usize) -> String {
    if prefix.is_empty() { CHANNELS[channel].to_owned() } else { format!("{prefix}.{}", CHANNELS[channel]) }
}

fn plane_prefix(plane: usize) -> String {
    if plane == 0 { String::new() } else { format!("layer{plane}") }
}

/// A partial EXR: sums, uncompressed, that say which samples they are.
pub fn write_partial(sum: &Sum, frame: Size, attributes: &PartialAttributes) -> Vec<u8> {
    let Batch { region, replicate, block } = sum.batch;
    assert!(region.is_in(frame), "the batch's region {region} is not in the frame {frame}");
    for plane in &sum.planes {
        assert_eq!(plane.len(), region.pixels(), "a plane of another size than its region");
    }
    let samples = block.samples();
    let named = [
        ("ovtigre.semantics", "sum".to_owned()),
        ("ovtigre.job", attributes.job.clone()),
        ("ovtigre.scene", attributes.scene.clone()),
        ("ovtigre.method", attributes.method.clone()),
        ("ovtigre.region", region.to_string()),
        ("ovtigre.replicate", replicate.to_string()),
        ("ovtigre.block", block.index.to_string()),
        ("ovtigre.samples", format!("{}..{}", samples.start, samples.end)),
        ("ovtigre.rays", sum.rays.to_string()),
        ("ovtigre.invalid", invalid_text(sum.invalid)),
    ];
    let planes: Vec<(String, &Plane)> =
        sum.planes.iter().enumerate().map(|(i, plane)| (plane_prefix(i), plane)).collect();
    let solution = attributes.solution.iter().map(|json| ("ovtigre.solution", json.clone()));
    let allocation = attributes.allocation.iter().map(|hash| ("ovtigre.allocation", hash.clone()));
    let counted = (!sum.tile_rays.is_empty()).then(|| ("ovtigre.tile_rays", numbers_text(&sum.tile_rays)));
    let texts = named.into_iter().chain(solution).chain(allocation).chain(counted);
    let texts = texts.map(|(name, value)| (name, AttributeValue::Text(text(&value)))).collect();
    encode(&planes, frame, region, texts, Encoding::UNCOMPRESSED, LayerAttributes::default())
}

/// What [`write_partial`] wrote; refuses more than `pixels_max` pixels, values that are not
/// finite, and a header that contradicts itself.
pub fn read_partial(bytes: &[u8], pixels_max: usize) -> Result<(Sum, PartialAttributes), ExrError> {
    let layers = decode(bytes, pixels_max as u64 * 3 * 64)?;
    let find = |name: &'static str| layers.attributes.get(name).ok_or(ExrError::Attribute(name));
    if find("ovtigre.semantics")? != "sum" {
        return Err(ExrError::Attribute("ovtigre.semantics"));
    }
    let region: Region = number(find("ovtigre.region")?, "ovtigre.region")?;
    if (region.width as usize, region.height as usize) != (layers.width, layers.height) {
        return Err(ExrError::Attribute("ovtigre.region"));
    }
    let (start, end) =
        find("ovtigre.samples")?.split_once("..").ok_or(ExrError::Attribute("ovtigre.samples"))?;
    let (start, end): (u32, u32) = (number(start, "ovtigre.samples")?, number(end, "ovtigre.samples")?);
    let count = end.checked_sub(start).filter(|n| *n > 0).ok_or(ExrError::Attribute("ovtigre.samples"))?;
    let index = number(find("ovtigre.block")?, "ovtigre.block")?;
    let replicate = number(find("ovtigre.replicate")?, "ovtigre.replicate")?;
    let batch = Batch { region, replicate, block: Block { index, start, count } };
    let planes = (0..layers.channels.len() / 3)
        .map(|plane| sum_plane(&layers, &plane_prefix(plane)))
        .collect::<Result<Vec<Plane>, ExrError>>()?;
    if planes.is_empty() || layers.channels.len() % 3 != 0 {
        return Err(ExrError::Channel("R".to_owned()));
    }
    let sum = Sum {
        batch,
        planes,
        invalid: invalid_from(find("ovtigre.invalid")?).ok_or(ExrError::Attribute("ovtigre.invalid"))?,
        rays: number(find("ovtigre.rays")?, "ovtigre.rays")?,
        tile_rays: match layers.attributes.get("ovtigre.tile_rays") {
            Some(text) => numbers_from(text).ok_or(ExrError::Attribute("ovtigre.tile_rays"))?,
            None => Vec::new(),
        },
    };
    let attributes = PartialAttributes {
        job: find("ovtigre.job")?.clone(),
        scene: find("ovtigre.scene")?.clone(),
        method: find("ovtigre.method")?.clone(),
        solution: layers.attributes.get("ovtigre.solution").cloned(),
        allocation: layers.attributes.get("ovtigre.allocation").cloned(),
    };
    if attributes.solution.as_ref().is_some_and(|json| json.len() > SOLUTION_MAX) {
        return Err(ExrError::Attribute("ovtigre.solution"));
    }
    Ok((sum, attributes))
}

fn number<T: std::str::FromStr>(text: &str, name: &'static str) -> Result<T, ExrError> {
    text.parse().map_err(|_| ExrError::Attribute(name))
}

fn sum_plane(layers: &Layers, prefix: &str) -> Result<Plane, ExrError> {
    let pixels = layers.width * layers.height;
    let mut plane = vec![[0.0; 3]; pixels];
    for c in 0..3 {
        let name = channel_name(prefix, c);
        let values = layers.channels.get(&name).filter(|v| v.len() == pixels);
        let values = values.ok_or_else(|| ExrError::Channel(name.clone()))?;
        for (pixel, &value) in plane.iter_mut().zip(values) {
            if !(value >= 0.0 && value.is_finite()) {
                return Err(ExrError::NoSum { channel: name, value });
            }
            pixel[c] = value;
        }
    }
    Ok(plane)
}

/// Prefix of a plane's channels in a picture, by the name of its layer; `None` is the picture itself.
pub fn prefix_of(layer: Option<&str>, part: Part) -> String {
    match (layer, part) {
        (None, Part::Mean) => String::new(),
        (None, Part::Error) => "error".to_owned(),
        (Some(name), Part::Mean) => name.to_owned(),
        (Some(name), Part::Error) => format!("{name}.error"),
    }
}

/// What a plane of a picture holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// Means.
    Mean,
    /// Their standard errors.
    Error,
}

/// A picture: means, ZIP, linear Rec.709, with its error and layers as named channels.
pub fn write_picture(picture: &Picture, attributes: &PictureAttributes) -> Vec<u8> {
    assert_eq!(picture.planes.len(), 1 + attributes.layers.len(), "a layer without a name");
    let names = || std::iter::once(None).chain(attributes.layers.iter().map(|(name, _)| Some(name.as_str())));
    let means = names().map(|name| prefix_of(name, Part::Mean)).zip(&picture.planes);
    let errors = names().map(|name| prefix_of(name, Part::Error)).zip(&picture.errors);
    let planes: Vec<(String, &Plane)> = means.chain(errors).collect();
    let texts = [
        ("ovtigre.job", &attributes.job),
        ("ovtigre.scene", &attributes.scene),
        ("ovtigre.seed", &attributes.seed.to_string()),
        ("ovtigre.method", &attributes.method),
        ("ovtigre.paths", &attributes.paths),
        ("ovtigre.camera", &attributes.camera),
        ("ovtigre.invalid", &invalid_text(attributes.invalid)),
        ("ovtigre.manifest", &attributes.manifest),
    ];
    let mut values: Vec<(&str, AttributeValue)> =
        texts.map(|(name, value)| (name, AttributeValue::Text(text(value)))).to_vec();
    let shown: Vec<(String, &String)> =
        attributes.layers.iter().map(|(name, shows)| (format!("ovtigre.layer.{name}"), shows)).collect();
    values.extend(shown.iter().map(|(name, shows)| (name.as_str(), AttributeValue::Text(text(shows)))));
    values.push(("ovtigre.samples", AttributeValue::F32(attributes.samples as f32)));
    values.push(("samplesPerPixel", AttributeValue::I32(attributes.samples.round() as i32)));
    values.push(("renderTimeSeconds", AttributeValue::F32(attributes.render_seconds as f32)));
    let layer = LayerAttributes {
        capture_date: Some(text(&attributes.capture_date)),
        software_name: Some(text(&attributes.software)),
        ..LayerAttributes::default()
    };
    encode(&planes, picture.size, picture.region, values, Encoding::SMALL_LOSSLESS, layer)
}

fn encode(
    planes: &[(String, &Plane)],
    frame: Size,
    region: Region,
    attributes: Vec<(&str, AttributeValue)>,
    encoding: Encoding,
    mut layer_attributes: LayerAttributes,
) -> Vec<u8> {
    let channels = planes.iter().flat_map(|(prefix, plane)| {
        (0..3).map(move |c| {
            let samples = FlatSamples::F32(plane.iter().map(|pixel| pixel[c]).collect());
            AnyChannel::new(text(&channel_name(prefix, c)), samples)
        })
    });
    layer_attributes.layer_position = Vec2(region.x as i32, region.y as i32);
    let size = Vec2(region.width as usize, region.height as usize);
    let layer = Layer::new(size, layer_attributes, encoding, AnyChannels::sort(channels.collect()));
    let mut image = Image::from_layer(layer);
    let frame = Vec2(frame.width as usize, frame.height as usize);
    image.attributes.display_window = IntegerBounds::from_dimensions(frame);
    image.attributes.chromaticities = Some(REC_709);
    for (name, value) in attributes {
        image.attributes.other.insert(text(name), value);
    }
    let mut bytes = Cursor::new(Vec::new());
    image.write().non_parallel().to_buffered(&mut bytes).expect("writing an EXR to memory cannot fail");
    bytes.into_inner()
}

/// ITU-R BT.709 primaries and D65.
const REC_709: exr::meta::attribute::Chromaticities = exr::meta::attribute::Chromaticities {
    red: Vec2(0.64, 0.33),
    green: Vec2(0.3, 0.6),
    blue: Vec2(0.15, 0.06),
    white: Vec2(0.3127, 0.3290),
};

/// EXR attribute texts are Latin-1; others lose what they cannot say.
fn text(value: &str) -> Text {
    Text::new_or_none(value).unwrap_or_else(|| {
        Text::from(value.chars().map(|c| if c.is_ascii() { c } else { '?' }).collect::<String>().as_str())
    })
}

fn numbers_text(numbers: &[u32]) -> String {
    numbers.iter().map(u32::to_string).collect::<Vec<_>>().join(",")
}

fn numbers_from(text: &str) -> Option<Vec<u32>> {
    let numbers: Option<Vec<u32>> = text.split(',').map(|n| n.parse().ok()).take(TILES_MAX + 1).collect();
    numbers.filter(|numbers| numbers.len() <= TILES_MAX)
}

fn invalid_text(invalid: InvalidSamples) -> String {
    format!("{},{},{}", invalid.nan, invalid.infinite, invalid.negative)
}

fn invalid_from(text: &str) -> Option<InvalidSamples> {
    let numbers: Option<Vec<u64>> = text.split(',').map(|n| n.parse().ok()).collect();
    match *numbers?.as_slice() {
        [nan, infinite, negative] => Some(InvalidSamples { nan, infinite, negative }),
        _ => None,
    }
}

/// Bytes of pixels that one byte of a file stands for, at most: DEFLATE makes one of 1032, the others more.
const BYTES_OF_ONE: u64 = 4096;

/// All channels of the first part of any flat EXR as f32.
pub fn read_layers(bytes: &[u8]) -> Result<Layers, ExrError> {
    decode(bytes, 1 << 31)
}

fn decode(bytes: &[u8], values_max: u64) -> Result<Layers, ExrError> {
    let unreadable = |e: exr::error::Error| ExrError::Unreadable(e.to_string());
    let meta = exr::meta::MetaData::read_from_buffered(Cursor::new(bytes), false).map_err(unreadable)?;
    for header in &meta.headers {
        let got = header.layer_size.area() as u64 * header.channels.list.len() as u64;
        if got > values_max {
            return Err(ExrError::TooLarge { got, limit: values_max });
        }
        // Memory is taken before the pixels are read, and none of the compressions makes that little of so many.
        if got.saturating_mul(2) > BYTES_OF_ONE * bytes.len() as u64 {
            let reason = format!("{} bytes cannot hold the {got} values that it announces", bytes.len());
            return Err(ExrError::Unreadable(reason));
        }
    }
    let image = read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .first_valid_layer()
        .all_attributes()
        .non_parallel()
        .from_buffered(Cursor::new(bytes))
        .map_err(unreadable)?;
    let layer = image.layer_data;
    let channels = (layer.channel_data.list.into_iter())
        .map(|channel| (channel.name.to_string(), channel.sample_data.values_as_f32().collect()))
        .collect();
    let texts = image.attributes.other.iter().chain(&layer.attributes.other);
    let attributes = texts
        .filter_map(|(name, value)| match value {
            AttributeValue::Text(text) => Some((name.to_string(), text.to_string())),
            AttributeValue::F32(number) => Some((name.to_string(), number.to_string())),
            AttributeValue::I32(number) => Some((name.to_string(), number.to_string())),
            _ => None,
        })
        .collect();
    Ok(Layers { width: layer.size.0, height: layer.size.1, channels, attributes })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sum() -> Sum {
        let region = Region { x: 2, y: 1, width: 3, height: 2 };
        let batch = Batch { region, replicate: 3, block: Block { index: 2, start: 8, count: 8 } };
        let plane: Plane = (0..6).map(|i| [i as f32, 1e-30, f32::MAX / (1.0 + i as f32)]).collect();
        let invalid = InvalidSamples { nan: 1, infinite: 2, negative: 3 };
        Sum {
            batch,
            planes: vec![plane.clone(), plane],
            invalid,
            rays: 12345,
            tile_rays: vec![3, 0, 1 << 31],
        }
    }

    fn attributes() -> PartialAttributes {
        PartialAttributes {
            job: "j".to_owned(),
            scene: "s".to_owned(),
            method: "path".to_owned(),
            solution: Some("{}".to_owned()),
            allocation: Some("abc".to_owned()),
        }
    }

    #[test]
    fn a_partial_is_read_as_it_was_written() {
        let bytes = write_partial(&sum(), Size { width: 8, height: 4 }, &attributes());
        let (read, says) = read_partial(&bytes, 6).unwrap();
        assert_eq!((read, says), (sum(), attributes()));
    }

    #[test]
    fn a_picture_has_its_channels_and_says_what_it_is() {
        let region = Region { x: 2, y: 1, width: 3, height: 2 };
        let plane = |v: f32| -> Plane { (0..6).map(|i| [v + i as f32, 0.5, 1e-30]).collect() };
        let (size, samples) = (Size { width: 8, height: 4 }, 12.0);
        let planes = vec![plane(1.0), plane(2.0)];
        let picture = Picture { size, region, planes, errors: vec![plane(0.1), plane(0.2)], samples };
        let long = "a".repeat(64);
        let says = PictureAttributes {
            job: "j".to_owned(),
            scene: "s".to_owned(),
            samples,
            seed: 1,
            method: "path".to_owned(),
            paths: "L(D|S)*E".to_owned(),
            camera: "framed".to_owned(),
            invalid: InvalidSamples { nan: 1, infinite: 0, negative: 2 },
            layers: vec![(long.clone(), "LDE".to_owned())],
            manifest: "m".to_owned(),
            render_seconds: 1.5,
            software: "ovtigre".to_owned(),
            capture_date: "2026:01:02 03:04:05".to_owned(),
        };
        let layers = read_layers(&write_picture(&picture, &says)).unwrap();
        let names: Vec<&str> = layers.channels.keys().map(String::as_str).collect();
        let of_layer = ["B", "G", "R", "error.B", "error.G", "error.R"].map(|c| format!("{long}.{c}"));
        let own = ["B", "G", "R"].into_iter().chain(of_layer.iter().map(String::as_str));
        assert_eq!(names, own.chain(["error.B", "error.G", "error.R"]).collect::<Vec<_>>());
        assert_eq!(layers.channels["R"], [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
        assert_eq!(layers.channels[&format!("{long}.error.R")][0], 0.2);
        assert_eq!(layers.attributes[&format!("ovtigre.layer.{long}")], "LDE");
        let said = ["paths", "camera", "invalid"].map(|what| &*layers.attributes[&format!("ovtigre.{what}")]);
        assert_eq!(said, ["L(D|S)*E", "framed", "1,0,2"]);
    }

    #[test]
    fn damaged_partials_are_refused() {
        let bytes = write_partial(&sum(), Size { width: 8, height: 4 }, &attributes());
        for end in 0..bytes.len() - 1 {
            assert!(read_partial(&bytes[..end], 6).is_err(), "cut at {end} of {}", bytes.len());
        }
        assert!(matches!(read_partial(&bytes, 0), Err(ExrError::TooLarge { .. })));
        // A window of many pixels in a file of few bytes takes no memory.
        let window = bytes.windows(11).position(|at| at == b"dataWindow\0").unwrap() + 11 + 6 + 4;
        let mut vast = bytes.clone();
        vast[window + 8..window + 16].copy_from_slice(&[0xff, 0x0f, 0, 0, 0xff, 0x0f, 0, 0]);
        let refused = read_layers(&vast).unwrap_err().to_string();
        assert!(refused.contains("cannot hold"), "{refused}");
        let mut nan = sum();
        nan.planes[1][4][2] = f32::NAN;
        let bytes = write_partial(&nan, Size { width: 8, height: 4 }, &attributes());
        assert!(matches!(read_partial(&bytes, 6), Err(ExrError::NoSum { .. })));
    }
}
