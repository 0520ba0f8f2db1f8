//! Pictures of a document: PNG, JPEG and WebP, sizes checked before a pixel is decoded.

use crate::gltf::accessor::Source;
use crate::gltf::buffers::read_uri;
use crate::gltf::bundle::Bundle;
use crate::gltf::document::At;
use crate::gltf::error::{LoadError, Problems};
use crate::gltf::uri;
use crate::scene::texture::{Picture, Texels};
use image::{DynamicImage, ImageFormat, ImageReader, Limits as DecoderLimits};
use rayon::prelude::*;
use std::borrow::Cow;
use std::io::Cursor;
use std::sync::Arc;

struct Encoded<'a> {
    bytes: Cow<'a, [u8]>,
    file: String,
    pointer: String,
    format: ImageFormat,
    width: u32,
    height: u32,
}

/// Decodes the pictures with these indices, in their order. What decodes first does not depend on threads:
/// an error is that of the first picture that has one.
pub(crate) fn read(
    bundle: &Bundle,
    source: Source<'_>,
    images: &[usize],
    problems: &mut Problems,
) -> Result<Vec<Arc<Picture>>, LoadError> {
    let mut pixels = 0_u64;
    let mut encoded = Vec::with_capacity(images.len());
    for &index in images {
        let item = source.document.item("images", index)?;
        let picture = inspect(bundle, source, &item, problems)?;
        pixels += u64::from(picture.width) * u64::from(picture.height);
        if pixels > source.limits.picture_pixels {
            return Err(LoadError::Limit {
                file: bundle.name().to_owned(),
                pointer: item.pointer,
                what: "pixels of pictures",
                found: pixels,
                limit: source.limits.picture_pixels,
            });
        }
        encoded.push(picture);
    }
    let decoded: Vec<_> = encoded.par_iter().map(decode).collect();
    decoded.into_iter().map(|picture| picture.map(Arc::new)).collect()
}

/// Decodes a picture only to see whether it can be, while `left` pixels last.
pub(crate) fn try_decode(
    bundle: &Bundle,
    source: Source<'_>,
    index: usize,
    left: &mut u64,
    problems: &mut Problems,
) -> Result<(), LoadError> {
    let item = source.document.item("images", index)?;
    let encoded = inspect(bundle, source, &item, problems)?;
    let pixels = u64::from(encoded.width) * u64::from(encoded.height);
    if pixels <= *left {
        *left -= pixels;
        decode(&encoded)?;
    }
    Ok(())
}

/// The bytes of a picture, its format and its size from the header.
fn inspect<'a>(
    bundle: &'a Bundle,
    source: Source<'a>,
    item: &At<'_>,
    problems: &mut Problems,
) -> Result<Encoded<'a>, LoadError> {
    let mut declared = item.text("mimeType")?;
    let mut file = bundle.name().to_owned();
    let bytes = if let Some(text) = item.text("uri")? {
        match text.strip_prefix("data:") {
            Some(data) => declared = declared.or(data.split([';', ',']).next()),
            None => file = uri::shorten(text),
        }
        read_uri(bundle, item, text)?
    } else {
        let views = source.document.count("bufferViews");
        let view = item.index("bufferView", "bufferViews", views)?;
        let view = view.ok_or_else(|| item.error("has neither a \"uri\" nor a \"bufferView\""))?;
        Cow::Borrowed(source.buffers.view(source.document, view)?.bytes)
    };
    let pointer = item.pointer.clone();
    let refuse = |detail: String| LoadError::Picture { file: file.clone(), pointer: pointer.clone(), detail };
    let format = image::guess_format(&bytes).ok();
    let Some(format @ (ImageFormat::Png | ImageFormat::Jpeg | ImageFormat::WebP)) = format else {
        let hint =
            if bytes.starts_with(b"version https://git-lfs") { "; it is a git-LFS pointer" } else { "" };
        return Err(refuse(format!("the picture is neither PNG nor JPEG nor WebP{hint}; convert it")));
    };
    if let Some(declared) = declared.filter(|declared| *declared != format.to_mime_type()) {
        let detail = format!("the picture is {}, not {}", format.to_mime_type(), uri::shorten(declared));
        problems.add(&pointer, detail);
    }
    let size = ImageReader::with_format(Cursor::new(&*bytes), format).into_dimensions();
    let (width, height) = size.map_err(|e| refuse(format!("the picture's header is broken: {e}")))?;
    let side = source.limits.picture_side;
    if width == 0 || height == 0 || width > side || height > side {
        return Err(refuse(format!(
            "the picture says it has {width}×{height} pixels; allowed are 1 to {side} a side"
        )));
    }
    Ok(Encoded { bytes, file, pointer, format, width, height })
}

fn decode(encoded: &Encoded<'_>) -> Result<Picture, LoadError> {
    let Encoded { bytes, file, pointer, format, width, height } = encoded;
    let refuse = |detail: String| LoadError::Picture { file: file.clone(), pointer: pointer.clone(), detail };
    let mut reader = ImageReader::with_format(Cursor::new(&**bytes), *format);
    let mut limits = DecoderLimits::default();
    limits.max_image_width = Some(*width);
    limits.max_image_height = Some(*height);
    // Eight bytes a pixel for 16-bit colour and alpha, and again for what a decoder keeps beside its result.
    limits.max_alloc = Some(u64::from(*width) * u64::from(*height) * 16 + (16 << 20));
    reader.limits(limits);
    let picture = reader.decode().map_err(|e| refuse(format!("the picture cannot be decoded: {e}")))?;
    let (width, height) = (picture.width(), picture.height());
    let texels = match picture {
        DynamicImage::ImageLuma16(_)
        | DynamicImage::ImageLumaA16(_)
        | DynamicImage::ImageRgb16(_)
        | DynamicImage::ImageRgba16(_) => {
            Texels::Words(picture.into_rgba16().pixels().map(|p| p.0).collect())
        }
        _ => Texels::Bytes(picture.into_rgba8().pixels().map(|p| p.0).collect()),
    };
    Ok(Picture { width, height, texels })
}
