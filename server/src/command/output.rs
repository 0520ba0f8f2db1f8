//! Pictures and reports on the user's disk: whole, or not there.

use super::exit::{CommandError, Outcome};
use ovtigre_proto::{
    client::{answer::Answer, farm::Client, jobs::Development},
    id::JobId,
};
use std::{
    io::Write as _,
    path::{Path, PathBuf},
};
use tempfile::NamedTempFile;

/// What a picture's file name asks for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Output {
    /// Where the picture goes.
    pub(crate) exr: PathBuf,
    /// Where a developed one goes, too.
    pub(crate) png: Option<PathBuf>,
}

impl Output {
    /// As `-o` says, or the scene's name with `.exr` in the current folder.
    pub(crate) fn new(given: Option<&Path>, scene: &Path) -> Outcome<Self> {
        let Some(path) = given else {
            let stem = scene.file_stem().unwrap_or(scene.as_os_str());
            let mut name = stem.to_owned();
            name.push(".exr");
            check_writable(Path::new(&name))?;
            return Ok(Self { exr: name.into(), png: None });
        };
        let output = match kind(path)? {
            Kind::Exr => Self { exr: path.to_owned(), png: None },
            Kind::Png => Self { exr: path.with_extension("exr"), png: Some(path.to_owned()) },
        };
        check_writable(path)?;
        Ok(output)
    }

    /// Writes a job's picture, whose EXR is under way, and fetches a developed one where that is asked for.
    pub(crate) async fn write(&self, exr: Answer, client: &Client, job: &JobId) -> Outcome {
        save(exr, &self.exr).await?;
        if let Some(png) = &self.png {
            save(client.developed(job, &Development::default()).await?, png).await?;
        }
        Ok(())
    }
}

/// Kinds of pictures, by the ends of their names.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    Exr,
    Png,
}

/// The kind of picture that a file's name asks for.
pub(crate) fn kind(path: &Path) -> Outcome<Kind> {
    match path.extension().and_then(|end| end.to_str()).map(str::to_ascii_lowercase).as_deref() {
        Some("exr") => Ok(Kind::Exr),
        Some("png") => Ok(Kind::Png),
        _ => Err(CommandError::wrong(format!("{}: a picture's name ends in .exr or .png", path.display()))),
    }
}

/// Says before hours are spent that a file cannot be written.
pub(crate) fn check_writable(path: &Path) -> Outcome {
    part_of(path).map(drop)
}

/// The folder that a file goes to.
fn folder_of(path: &Path) -> Outcome<&Path> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let reason = match (folder.is_dir(), path.is_dir()) {
        (true, false) => return Ok(folder),
        (true, true) => "it is a folder",
        (false, _) => "there is no such folder",
    };
    Err(CommandError::wrong(format!("cannot write {}: {reason}", path.display())))
}

/// Writes an answer's body to `path`, over what is there, at its end.
pub(crate) async fn save(answer: Answer, path: &Path) -> Outcome {
    let part = part_of(path)?;
    answer.save(part.path()).await?;
    put(part, path)
}

/// Writes text to `path`, over what is there, at its end.
pub(crate) fn save_text(text: &str, path: &Path) -> Outcome {
    save_bytes(text.as_bytes(), path)
}

/// Writes bytes to `path`, over what is there, at its end.
pub(crate) fn save_bytes(bytes: &[u8], path: &Path) -> Outcome {
    let mut part = part_of(path)?;
    part.write_all(bytes).map_err(|e| unwritable(path, &e))?;
    put(part, path)
}

fn part_of(path: &Path) -> Outcome<NamedTempFile> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(".ovtigre-").suffix(".part");
    // A picture is like any file that the user makes, not secret like other temporary files.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    builder.tempfile_in(folder_of(path)?).map_err(|e| unwritable(path, &e))
}

fn put(part: NamedTempFile, path: &Path) -> Outcome {
    part.persist(path).map(drop).map_err(|e| unwritable(path, &e.error))
}

fn unwritable(path: &Path, error: &std::io::Error) -> CommandError {
    CommandError::wrong(format!("cannot write {}: {error}", path.display()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_png_comes_with_its_exr_and_other_names_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        let output = |name: &str| Output::new(Some(&at(name)), Path::new("scenes/room.glb"));
        assert_eq!(output("a.png").unwrap(), Output { exr: at("a.exr"), png: Some(at("a.png")) });
        assert_eq!(output("a.EXR").unwrap(), Output { exr: at("a.EXR"), png: None });
        for name in ["a", "a.jpg", "no/folder/a.exr"] {
            assert!(output(name).is_err(), "{name}");
        }
        let default = Output::new(None, Path::new("scenes/room.v2.glb")).unwrap();
        assert_eq!(default.exr, Path::new("room.v2.exr"));
    }

    #[test]
    fn a_file_is_replaced_whole() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("report.json");
        for text in ["one", "two"] {
            save_text(text, &path).unwrap();
            assert_eq!(std::fs::read_to_string(&path).unwrap(), text);
        }
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    }
}
