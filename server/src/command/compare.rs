//! `ovtigre compare`: how two pictures differ.

use super::{
    exit::{CommandError, Exit, Outcome},
    table, terminal,
    truth::read,
};
use clap::Args;
use ovtigre_core::film::compare::{Comparison, compare};
use std::{path::PathBuf, process::ExitCode};

/// Compare two pictures.
#[derive(Args, Debug)]
pub(crate) struct Compare {
    /// Picture to judge.
    #[arg(value_name = "A.exr")]
    a: PathBuf,
    /// Picture to judge it by.
    #[arg(value_name = "B.exr")]
    b: PathBuf,
    /// Exit with 1 where the relative error of a layer is above this [default: any error will do].
    #[arg(long, value_name = "E")]
    tolerance: Option<f64>,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

impl Compare {
    /// Compares.
    pub(crate) fn run(self) -> Outcome<ExitCode> {
        let (a, b) = (read(&self.a)?, read(&self.b)?);
        let comparison = compare(&a, &b).map_err(CommandError::wrong)?;
        if self.json {
            terminal::json(&comparison);
        } else {
            show(&comparison);
        }
        let within =
            |tolerance: f64| comparison.layers.values().all(|layer| layer.relative_error <= tolerance);
        Ok(if self.tolerance.is_none_or(within) { ExitCode::SUCCESS } else { Exit::Different.into() })
    }
}

fn show(comparison: &Comparison) {
    let row = |(name, layer): (&String, &ovtigre_core::film::compare::Difference)| {
        let name = if name.is_empty() { "(picture)".to_owned() } else { name.clone() };
        let number = |n: f64| format!("{n:.6}");
        [name, number(layer.rms_error), number(layer.relative_error), number(layer.mean_ratio)]
    };
    let rows: Vec<_> = comparison.layers.iter().map(row).collect();
    table::print(["LAYER", "RMS ERROR", "RELATIVE ERROR", "MEAN RATIO"], &rows);
}
