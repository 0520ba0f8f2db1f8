//! Sizes, regions and colours as users write them: as text, as a list, or as an object.

use ovtigre_core::film::size::{Region, Size};
use schemars::JsonSchema;
use serde::{Deserialize, Deserializer, Serializer, de::Error as _};

#[derive(Deserialize)]
#[serde(
    untagged,
    expecting = "expected a text as on the command line, a list of whole numbers, or an object"
)]
enum Written<T> {
    Text(String),
    List(Vec<u32>),
    Object(T),
}

/// A size as `"640x480"`, `[640, 480]` or `{"width": 640, "height": 480}`; written as text.
pub mod size {
    use super::{Deserialize, Deserializer, Serializer, Size, Written, join};
    use serde::de::Error as _;

    /// Reads any of the forms.
    pub fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<Option<Size>, D::Error> {
        let text = match Option::<Written<Size>>::deserialize(from)? {
            None => return Ok(None),
            Some(Written::Text(text)) => text,
            Some(Written::List(list)) => join(&list, "x"),
            Some(Written::Object(size)) => size.to_string(),
        };
        text.parse().map(Some).map_err(D::Error::custom)
    }

    /// Writes text.
    pub fn serialize<S: Serializer>(size: &Option<Size>, to: S) -> Result<S::Ok, S::Error> {
        match size {
            Some(size) => to.collect_str(size),
            None => to.serialize_none(),
        }
    }
}

/// A region as `"x,y,w,h"`, `[x, y, w, h]` or an object; written as text.
pub mod region {
    use super::{Deserialize, Deserializer, Region, Serializer, Written, join};
    use serde::de::Error as _;

    /// Reads any of the forms.
    pub fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<Option<Region>, D::Error> {
        let text = match Option::<Written<Region>>::deserialize(from)? {
            None => return Ok(None),
            Some(Written::Text(text)) => text,
            Some(Written::List(list)) => join(&list, ","),
            Some(Written::Object(region)) => region.to_string(),
        };
        text.parse().map(Some).map_err(D::Error::custom)
    }

    /// Writes text.
    pub fn serialize<S: Serializer>(region: &Option<Region>, to: S) -> Result<S::Ok, S::Error> {
        match region {
            Some(region) => to.collect_str(region),
            None => to.serialize_none(),
        }
    }
}

fn join(numbers: &[u32], between: &str) -> String {
    numbers.iter().map(ToString::to_string).collect::<Vec<_>>().join(between)
}

/// A size as it may be written.
#[derive(Debug, JsonSchema)]
#[schemars(untagged)]
pub enum WrittenSize {
    /// `1280x720`
    Text(String),
    /// Width and height.
    List([u32; 2]),
    /// By name.
    Object(Size),
}

/// A region as it may be written.
#[derive(Debug, JsonSchema)]
#[schemars(untagged)]
pub enum WrittenRegion {
    /// `x,y,width,height`
    Text(String),
    /// The same four numbers.
    List([u32; 4]),
    /// By name.
    Object(Region),
}

/// A name, or a number from 0.
#[derive(Debug, JsonSchema)]
#[schemars(untagged)]
pub enum NameOrNumber {
    /// From 0.
    Number(u32),
    /// As the scene has it.
    Name(String),
}

/// A camera's name or number, from text or a number.
pub fn name_or_number<'de, D: Deserializer<'de>>(from: D) -> Result<Option<String>, D::Error> {
    #[derive(Deserialize)]
    #[serde(untagged, expecting = "expected a camera's name, or its number from 0")]
    enum Given {
        Number(u32),
        Name(String),
    }
    Ok(Option::<Given>::deserialize(from)?.map(|given| match given {
        Given::Number(n) => n.to_string(),
        Given::Name(name) => name,
    }))
}

/// A radiance `"r,g,b"` or `[r, g, b]`, or the hash of an uploaded image; written as given.
#[derive(Clone, Debug, PartialEq, serde::Serialize, JsonSchema)]
#[serde(untagged)]
pub enum EnvironmentRequest {
    /// The same radiance from everywhere, linear Rec.709.
    Uniform([f32; 3]),
    /// An uploaded EXR or HDR image.
    Image(crate::id::BlobId),
}

impl<'de> Deserialize<'de> for EnvironmentRequest {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        #[derive(Deserialize)]
        #[serde(
            untagged,
            expecting = "expected a radiance R,G,B (a text or three numbers) or the hash of an uploaded image"
        )]
        enum Given {
            List([f32; 3]),
            Text(String),
        }
        match Given::deserialize(from)? {
            Given::List(rgb) => Ok(Self::Uniform(rgb)),
            Given::Text(text) => match radiance(&text) {
                Some(rgb) => Ok(Self::Uniform(rgb)),
                None => text.parse().map(Self::Image).map_err(|_| {
                    D::Error::custom(format!(
                        "'{text}' is neither a radiance R,G,B nor the hash of an uploaded image"
                    ))
                }),
            },
        }
    }
}

/// `"r,g,b"` as three finite numbers that are not negative.
pub fn radiance(text: &str) -> Option<[f32; 3]> {
    let numbers: Option<Vec<f32>> = text.split(',').map(|n| n.trim().parse().ok()).collect();
    let rgb: [f32; 3] = numbers?.try_into().ok()?;
    rgb.iter().all(|c| c.is_finite() && *c >= 0.0).then_some(rgb)
}
