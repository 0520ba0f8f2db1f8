//! Small textures for quads.

/// Coordinates of a quad's corners, from the lower left, counter-clockwise.
pub const UVS: [f32; 8] = [0.0, 1.0, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0];

/// A PNG of texels, red, green, blue and alpha, row by row from the top.
pub fn png(width: u32, texels: &[[u8; 4]]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width, texels.len() as u32 / width);
    encoder.set_color(png::ColorType::Rgba);
    encoder.set_depth(png::BitDepth::Eight);
    let mut writer = encoder.write_header().expect("written to memory");
    writer.write_image_data(texels.as_flattened()).expect("as many bytes as the header says");
    writer.finish().expect("written to memory");
    bytes
}
