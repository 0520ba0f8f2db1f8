//! What the URIs of a document name: files of the scene's folder, or data in the URI itself.

use base64::Engine;
use base64::alphabet;
use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};
use percent_encoding::percent_decode_str;

/// What a URI names.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum Target {
    /// A file, relative to the folder of the document, slashes between folders.
    File(String),
    /// Bytes in the URI itself.
    Data(Vec<u8>),
}

const BASE64: GeneralPurpose = GeneralPurpose::new(
    &alphabet::STANDARD,
    GeneralPurposeConfig::new().with_decode_padding_mode(DecodePaddingMode::Indifferent),
);

/// Reads a URI; the error says why it is refused.
pub(crate) fn resolve(uri: &str) -> Result<Target, String> {
    match uri.strip_prefix("data:") {
        Some(data) => decode_data(data).map(Target::Data),
        None => resolve_file(uri).map(Target::File),
    }
}

fn decode_data(data: &str) -> Result<Vec<u8>, String> {
    let Some((head, body)) = data.split_once(',') else {
        return Err("a data URI needs a comma before its data".to_owned());
    };
    let Some(media_type) = head.strip_suffix(";base64") else {
        return Err("a data URI must be base64".to_owned());
    };
    if media_type.ends_with(';') {
        return Err("the media type of the data URI is malformed".to_owned());
    }
    let decoded = if body.contains('%') {
        BASE64.decode(percent_decode_str(body).collect::<Vec<u8>>())
    } else {
        BASE64.decode(body)
    };
    decoded.map_err(|e| format!("its base64 is broken: {e}"))
}

/// The file that a relative reference names, percent-decoded, without `.` and `..`.
pub(crate) fn resolve_file(uri: &str) -> Result<String, String> {
    let decoded = percent_decode_str(uri)
        .decode_utf8()
        .map_err(|_| "its percent-encoding is not UTF-8".to_owned())?
        .into_owned();
    normalise(&decoded)
}

/// A path without `.` and `..` and with slashes only; the error says why it is refused.
pub(crate) fn normalise(path: &str) -> Result<String, String> {
    if let Some((scheme, _)) = path.split_once(':')
        && !scheme.contains(['/', '\\'])
    {
        return Err("only files of the scene's folder are read, no other scheme or drive".to_owned());
    }
    if path.contains('\0') {
        return Err("it holds a zero byte".to_owned());
    }
    let path = path.replace('\\', "/");
    if path.starts_with('/') {
        return Err("absolute paths are not read; refer to files of the scene's folder".to_owned());
    }
    let mut parts: Vec<&str> = Vec::new();
    for part in path.split('/') {
        match part {
            "" | "." => {}
            ".." => {
                if parts.pop().is_none() {
                    return Err("it leads out of the scene's folder".to_owned());
                }
            }
            name => parts.push(name),
        }
    }
    if parts.is_empty() {
        return Err("it names no file".to_owned());
    }
    Ok(parts.join("/"))
}

/// A URI short enough for a message.
pub(crate) fn shorten(uri: &str) -> String {
    const SHOWN: usize = 80;
    let mut short: String = uri.chars().filter(|c| !c.is_control()).take(SHOWN).collect();
    if uri.chars().nth(SHOWN).is_some() {
        short.push('…');
    }
    short
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn relative_files_are_decoded_and_cleaned() {
        for (uri, file) in [
            ("a.bin", "a.bin"),
            ("./textures/a%20b.png", "textures/a b.png"),
            ("textures/../a b.bin", "a b.bin"),
            ("textures\\a.png", "textures/a.png"),
            ("%C3%A4.bin", "ä.bin"),
            ("x//y", "x/y"),
        ] {
            assert_eq!(resolve(uri), Ok(Target::File(file.to_owned())), "{uri}");
        }
    }

    #[test]
    fn what_leaves_the_folder_is_refused() {
        for uri in [
            "../a.bin",
            "a/../../b",
            "/etc/passwd",
            "\\\\server\\share",
            "file:///etc/passwd",
            "http://x/y",
            "C:\\x",
            "%2e%2e/x",
            "..%2fx",
            "%2Fetc/passwd",
            "a%00b",
            "%ff.bin",
            "",
            ".",
            ":",
        ] {
            assert!(resolve(uri).is_err(), "{uri}");
        }
    }

    #[test]
    fn data_uris_are_decoded() {
        assert_eq!(
            resolve("data:application/octet-stream;base64,AAEC/w=="),
            Ok(Target::Data(vec![0, 1, 2, 255]))
        );
        assert_eq!(resolve("data:;base64,AAEC%2Fw"), Ok(Target::Data(vec![0, 1, 2, 255])));
        for broken in ["data:image/png", "data:image/png,hello", "data:;base64,@@@@", "data:x;;base64,AAEC"] {
            assert!(resolve(broken).is_err(), "{broken}");
        }
    }
}
