//! The binary container of glTF 2.0: a header, a JSON chunk, perhaps a binary chunk.

use std::ops::Range;

/// Where the chunks of a container lie.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Chunks {
    pub(crate) json: Range<usize>,
    pub(crate) binary: Option<Range<usize>>,
    /// Further chunks, or bytes after the container: skipped.
    pub(crate) ignored: usize,
}

pub(crate) const MAGIC: &[u8] = b"glTF";
const JSON: u32 = 0x4E4F_534A;
const BIN: u32 = 0x004E_4942;

fn word(bytes: &[u8], at: usize) -> Option<u32> {
    Some(u32::from_le_bytes(bytes.get(at..at.checked_add(4)?)?.try_into().ok()?))
}

/// Finds the chunks; the error says what is wrong.
pub(crate) fn chunks(bytes: &[u8]) -> Result<Chunks, String> {
    let (Some(version), Some(length)) = (word(bytes, 4), word(bytes, 8)) else {
        return Err("the .glb is truncated: its header takes 12 bytes".to_owned());
    };
    if version != 2 {
        return Err(format!("glTF {version}.0 is not supported; convert the scene to glTF 2.0"));
    }
    let length = length as usize;
    if length > bytes.len() {
        let have = bytes.len();
        return Err(format!(
            "the .glb is truncated: its header says {length} bytes, it has {have}; copy or export it again"
        ));
    }
    let mut found: Option<Range<usize>> = None;
    let mut chunks = Chunks { json: 0..0, binary: None, ignored: bytes.len() - length };
    let mut at = 12;
    while at < length {
        let (range, kind) = chunk(bytes, at, length)?;
        at = range.end;
        match (kind, &found) {
            (JSON, None) => found = Some(range),
            (_, None) => return Err(format!("the first chunk of the .glb is 0x{kind:08x}, not JSON")),
            (JSON, Some(_)) => return Err("the .glb has two JSON chunks".to_owned()),
            (BIN, Some(json)) if range.start == json.end + 8 => chunks.binary = Some(range),
            (BIN, Some(_)) => {
                return Err("the .glb has a binary chunk that is not its second chunk".to_owned());
            }
            _ => chunks.ignored += range.len(),
        }
    }
    chunks.json = found.ok_or_else(|| "the .glb has no JSON chunk".to_owned())?;
    Ok(chunks)
}

fn chunk(bytes: &[u8], at: usize, length: usize) -> Result<(Range<usize>, u32), String> {
    let (Some(size), Some(kind)) = (word(&bytes[..length], at), word(&bytes[..length], at + 4)) else {
        return Err(format!("the .glb is truncated: the chunk at byte {at} has no header"));
    };
    let (start, size) = (at + 8, size as usize);
    if size % 4 != 0 {
        return Err(format!("the chunk at byte {at} of the .glb is {size} bytes long, not a multiple of 4"));
    }
    if size > length - start {
        let left = length - start;
        return Err(format!(
            "the chunk at byte {at} of the .glb says {size} bytes, but only {left} are left"
        ));
    }
    Ok((start..start + size, kind))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn glb(version: u32, chunks: &[(u32, &[u8])]) -> Vec<u8> {
        let length: usize = 12 + chunks.iter().map(|(_, data)| 8 + data.len()).sum::<usize>();
        let mut bytes = b"glTF".to_vec();
        bytes.extend(version.to_le_bytes());
        bytes.extend((length as u32).to_le_bytes());
        for (kind, data) in chunks {
            bytes.extend((data.len() as u32).to_le_bytes());
            bytes.extend(kind.to_le_bytes());
            bytes.extend(*data);
        }
        bytes
    }

    #[test]
    fn chunks_are_found() {
        let found = chunks(&glb(2, &[(JSON, b"{}  "), (BIN, b"12345678"), (7, b"more")])).unwrap();
        assert_eq!(found, Chunks { json: 20..24, binary: Some(32..40), ignored: 4 });
    }

    #[test]
    fn broken_containers_say_what_is_wrong() {
        let whole = glb(2, &[(JSON, b"{}  "), (BIN, b"1234")]);
        for cut in 4..whole.len() {
            assert!(chunks(&whole[..cut]).unwrap_err().contains("truncated"), "{cut}");
        }
        for (bytes, says) in [
            (glb(1, &[]), "glTF 1.0 is not supported"),
            (glb(2, &[]), "no JSON chunk"),
            (glb(2, &[(BIN, b"1234")]), "not JSON"),
            (glb(2, &[(JSON, b"{}  "), (JSON, b"{}  ")]), "two JSON"),
            (glb(2, &[(JSON, b"{}  "), (9, b""), (BIN, b"1234")]), "not its second"),
            (glb(2, &[(JSON, b"{}")]), "multiple of 4"),
        ] {
            let error = chunks(&bytes).unwrap_err();
            assert!(error.contains(says), "{error}");
        }
    }
}
