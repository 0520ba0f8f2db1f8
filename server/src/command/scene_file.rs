//! A scene on the user's disk, as one blob.

use super::exit::{CommandError, Outcome};
use ovtigre_core::gltf::bundle::{Bundle, references};
use ovtigre_proto::client::file::Upload;
use std::{
    fs::{self, File},
    io::{self, Read as _},
    path::{Path, PathBuf},
};

/// Longest JSON chunk of a `.glb` that is searched for files beside it.
const JSON_MAX: u64 = 1 << 30;

/// A scene ready to be uploaded: a file as it is, or packed with the files that it refers to.
pub(crate) async fn read(path: &Path) -> Outcome<Upload> {
    match blob(path)? {
        Blob::File => Ok(Upload::file(path.to_owned()).await?),
        Blob::Packed(bytes) => Ok(Upload::bytes(bytes)),
    }
}

/// A scene's bytes, as they would be uploaded.
pub(crate) fn bytes(path: &Path) -> Outcome<Vec<u8>> {
    match blob(path)? {
        Blob::File => fs::read(path).map_err(|e| unreadable(path, &e)),
        Blob::Packed(bytes) => Ok(bytes),
    }
}

/// What a fault of a scene is called: the file, and what the reader says.
pub(crate) fn fault(path: &Path, fault: &impl ToString) -> CommandError {
    let fault = fault.to_string();
    match fault.strip_prefix("scene:") {
        Some(rest) => CommandError::wrong(format!("{}:{rest}", path.display())),
        None => CommandError::wrong(format!("{}: {fault}", path.display())),
    }
}

#[derive(Debug)]
enum Blob {
    File,
    Packed(Vec<u8>),
}

fn blob(path: &Path) -> Outcome<Blob> {
    let cannot = |e: io::Error| unreadable(path, &e);
    if path.is_dir() {
        return Err(fault(path, &"it is a folder; name the .glb or .gltf in it"));
    }
    let mut file = File::open(path).map_err(cannot)?;
    let length = file.metadata().map_err(cannot)?.len();
    let mut head = Vec::new();
    file.by_ref().take(20).read_to_end(&mut head).map_err(cannot)?;
    if head.is_empty() {
        return Err(fault(path, &"the file is empty"));
    }
    if head.starts_with(b"PK") {
        return Ok(Blob::File);
    }
    let files = if head.starts_with(b"glTF") {
        // A broken one is the farm's to name, with the place.
        match json_chunk(&mut file, &head, length).map(|json| references(&json)) {
            Some(Ok(files)) if !files.is_empty() => files,
            _ => return Ok(Blob::File),
        }
    } else {
        references(&fs::read(path).map_err(cannot)?).map_err(|e| fault(path, &e))?
    };
    pack(path, &files).map(Blob::Packed)
}

/// The document of a binary glTF: glTF 2.0, §4.4.
fn json_chunk(file: &mut File, head: &[u8], length: u64) -> Option<Vec<u8>> {
    let size = u64::from(u32::from_le_bytes(head.get(12..16)?.try_into().ok()?));
    if head.get(16..20)? != b"JSON" || size > length.min(JSON_MAX) {
        return None;
    }
    let mut json = Vec::new();
    file.take(size).read_to_end(&mut json).ok()?;
    Some(json)
}

/// The scene and those of `files` that are there, all in the scene's folder: what is missing is named
/// by the reader, if it is needed at all.
fn pack(path: &Path, files: &[String]) -> Outcome<Vec<u8>> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let folder = folder.canonicalize().map_err(|e| unreadable(path, &e))?;
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let mut found = Vec::new();
    for file in files {
        let real = match folder.join(file).canonicalize() {
            Ok(real) => real,
            Err(e) if e.kind() == io::ErrorKind::NotFound => continue,
            Err(e) => return Err(unreadable(&folder.join(file), &e)),
        };
        if !real.starts_with(&folder) {
            let refused = format!("it refers to {file}, which is outside the scene's folder; copy it there");
            return Err(fault(path, &refused));
        }
        found.push((file.clone(), read_plain(&real)?));
    }
    let main = fs::read(path).map_err(|e| unreadable(path, &e))?;
    Ok(Bundle::pack((&name, &main), &found))
}

/// A file's bytes; pipes and devices might never end.
fn read_plain(path: &PathBuf) -> Outcome<Vec<u8>> {
    if !path.is_file() {
        return Err(fault(path, &"it is not a plain file"));
    }
    fs::read(path).map_err(|e| unreadable(path, &e))
}

fn unreadable(path: &Path, error: &io::Error) -> CommandError {
    match error.kind() {
        io::ErrorKind::NotFound => fault(path, &"there is no such file"),
        _ => fault(path, &format!("cannot be read: {error}")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SCENE: &str = r#"{"asset":{"version":"2.0"},"buffers":[{"uri":"a%20b/data.bin","byteLength":3}]}"#;

    fn folder(scene: &str) -> tempfile::TempDir {
        let folder = tempfile::tempdir().unwrap();
        fs::create_dir(folder.path().join("a b")).unwrap();
        fs::write(folder.path().join("a b/data.bin"), b"abc").unwrap();
        fs::write(folder.path().join("scene.gltf"), scene).unwrap();
        folder
    }

    fn refusal(folder: &tempfile::TempDir, name: &str) -> String {
        bytes(&folder.path().join(name)).unwrap_err().line
    }

    #[test]
    fn a_scene_and_its_files_give_the_same_bytes_wherever_they_are() {
        let (a, b) = (folder(SCENE), folder(SCENE));
        let packed = bytes(&a.path().join("scene.gltf")).unwrap();
        assert_eq!(packed, bytes(&b.path().join("scene.gltf")).unwrap());
        fs::write(b.path().join("a b/data.bin"), b"abd").unwrap();
        assert_ne!(packed, bytes(&b.path().join("scene.gltf")).unwrap());
    }

    #[test]
    fn what_is_no_scene_is_refused_by_name() {
        let folder = folder("{");
        assert!(refusal(&folder, "scene.gltf").contains("scene.gltf"));
        assert!(refusal(&folder, "nothing.glb").contains("there is no such file"));
        fs::write(folder.path().join("empty.glb"), b"").unwrap();
        assert!(refusal(&folder, "empty.glb").contains("empty"));
        fs::write(folder.path().join("text.glb"), b"hello").unwrap();
        assert!(refusal(&folder, "text.glb").contains("text.glb"));
        assert!(refusal(&folder, "a b").contains("folder"));
    }

    #[test]
    fn nothing_outside_the_scenes_folder_is_read() {
        let secret = tempfile::NamedTempFile::new().unwrap();
        for uri in [secret.path().to_str().unwrap(), "../scene.gltf", "file:///etc/passwd"] {
            let folder = folder(&SCENE.replace("a%20b/data.bin", uri));
            assert!(refusal(&folder, "scene.gltf").contains("scene.gltf"));
        }
    }

    #[cfg(unix)]
    #[test]
    fn links_do_not_lead_out_of_the_folder() {
        let secret = tempfile::NamedTempFile::new().unwrap();
        let folder = folder(&SCENE.replace("a%20b/", ""));
        std::os::unix::fs::symlink(secret.path(), folder.path().join("data.bin")).unwrap();
        assert!(refusal(&folder, "scene.gltf").contains("outside"));
    }

    #[test]
    fn a_binary_scene_with_files_beside_it_is_packed_and_one_without_is_sent_as_it_is() {
        let folder = folder(SCENE);
        for (json, packed) in [(SCENE, true), (r#"{"asset":{"version":"2.0"}}"#, false)] {
            let length = json.len().next_multiple_of(4);
            let padded = format!("{json:length$}");
            let mut glb = b"glTF\x02\0\0\0".to_vec();
            glb.extend((padded.len() as u32 + 20).to_le_bytes());
            glb.extend((padded.len() as u32).to_le_bytes());
            glb.extend(b"JSON");
            glb.extend(padded.bytes());
            fs::write(folder.path().join("scene.glb"), &glb).unwrap();
            assert_eq!(bytes(&folder.path().join("scene.glb")).unwrap().starts_with(b"PK"), packed);
        }
    }
}
