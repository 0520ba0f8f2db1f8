//! The error of a job's pictures against a reference, while it runs.

use super::exit::{CommandError, Outcome};
use ovtigre_core::film::{
    exr::{Layers, read_layers},
    reference::{Reference, plane},
};
use ovtigre_proto::{client::farm::Client, curve::CurveRow, id::JobId};
use serde::Serialize;
use std::path::Path;

/// Longest picture that is fetched to be compared.
const PICTURE_MAX: usize = 4 << 30;

/// A reference, and how far from it the pictures so far were.
#[derive(Debug)]
pub(crate) struct Truth {
    reference: Reference,
    rows: Vec<TrueError>,
}

/// How far a picture is from the reference.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[expect(clippy::struct_field_names, reason = "as in reports")]
pub(crate) struct TrueError {
    /// Samples a pixel in the picture.
    pub(crate) samples: f64,
    /// Run time; of a picture that has more samples than the checkpoint had, in proportion.
    pub(crate) wall_seconds: f64,
    /// Relative error against the reference, whose own is taken off.
    pub(crate) true_error: f64,
}

/// Reads an EXR.
pub(crate) fn read(path: &Path) -> Outcome<Layers> {
    let wrong = |reason: String| CommandError::wrong(format!("{}: {reason}", path.display()));
    let bytes = std::fs::read(path).map_err(|e| wrong(e.to_string()))?;
    read_layers(&bytes).map_err(|e| wrong(e.to_string()))
}

impl Truth {
    /// Reads the reference.
    pub(crate) fn read(path: &Path) -> Outcome<Self> {
        let reference = Reference::of_layers(&read(path)?)
            .map_err(|reason| CommandError::wrong(format!("{}: {reason}", path.display())))?;
        Ok(Self { reference, rows: Vec::new() })
    }

    /// Compares a job's picture so far; `row` is its latest checkpoint. A picture that cannot be had now is left out.
    pub(crate) async fn look(&mut self, client: &Client, job: &JobId, row: &CurveRow) -> Outcome {
        let Ok(answer) = client.image(job, None, None).await else { return Ok(()) };
        let Ok(bytes) = answer.bytes(PICTURE_MAX).await else { return Ok(()) };
        let Ok(layers) = read_layers(&bytes) else { return Ok(()) };
        let size = self.reference.size();
        if (layers.width, layers.height) != (size.width as usize, size.height as usize) {
            let (width, height) = (layers.width, layers.height);
            return Err(CommandError::wrong(format!(
                "the reference has {size} pixels and the picture {width}x{height}: give a reference of the same size"
            )));
        }
        let samples = layers.attributes.get("ovtigre.samples").and_then(|text| text.parse().ok());
        let samples: f64 = samples.unwrap_or_else(|| f64::from(row.samples));
        if self.rows.last().is_some_and(|last| last.samples >= samples) {
            return Ok(());
        }
        if let Some(picture) = plane(&layers, "") {
            let wall_seconds = row.wall_seconds * samples / f64::from(row.samples.max(1));
            let true_error = self.reference.relative_error(&picture);
            self.rows.push(TrueError { samples, wall_seconds, true_error });
        }
        Ok(())
    }

    /// All that was compared.
    pub(crate) fn rows(&self) -> &[TrueError] {
        &self.rows
    }

    /// Relative error of the reference itself.
    pub(crate) fn own_error(&self) -> f64 {
        self.reference.own_error()
    }
}
