//! One pixel of a job's picture so far.

use super::{
    Farm,
    error::{FarmError, Result},
    open::read_spec,
    picture::misfit,
};
use ovtigre_core::{
    film::{
        append::Prefix,
        estimate::variance_of_mean,
        exr::{Layers, Part, prefix_of},
        size::Region,
    },
    settings::Settings,
};
use ovtigre_proto::{
    id::JobId,
    pixel::{Pixel, PixelValue},
};

impl Farm {
    /// The pixel in column `x` and row `y` of the frame: all planes, each with its error where there is one.
    pub async fn pixel(&self, id: &JobId, x: u32, y: u32) -> Result<Pixel> {
        let row = self.job_row(id).await?;
        let spec = read_spec(&row)?;
        let region = spec.region;
        let (column, line) = (x.wrapping_sub(region.x), y.wrapping_sub(region.y));
        if column >= region.width || line >= region.height {
            return Err(FarmError::NoPixel { x, y, region });
        }
        if let (true, Some(manifest)) = (row.settled, &row.manifest) {
            let layers = self.kept_layers(id, manifest).await?;
            let i = line as usize * region.width as usize + column as usize;
            let planes = of_kept(&layers, &spec.settings, i).ok_or_else(misfit)?;
            return Ok(Pixel { manifest: manifest.clone(), x, y, planes });
        }
        let live = self.live(id).filter(|_| !row.settled).ok_or_else(|| FarmError::no_picture(&row))?;
        let held = self.sums(&live).await?;
        let merge = held.as_ref().expect("just read");
        let manifest = merge.manifest(&live.identity).ok_or_else(|| FarmError::NoPicture(id.clone()))?;
        let planes = of_sums(&merge.prefixes, &spec.settings, x, y).ok_or_else(misfit)?;
        Ok(Pixel { manifest, x, y, planes })
    }
}

/// Names of the planes; the picture's is `None`.
fn names(settings: &Settings) -> impl Iterator<Item = Option<&str>> {
    std::iter::once(None).chain(settings.layers.iter().map(|layer| Some(layer.name.as_str())))
}

fn named(name: Option<&str>, value: [f32; 3], error: Option<[f32; 3]>) -> PixelValue {
    PixelValue { name: name.unwrap_or("picture").to_owned(), value, error }
}

/// From the channels of a file.
fn of_kept(layers: &Layers, settings: &Settings, i: usize) -> Option<Vec<PixelValue>> {
    let triple = |name, part| {
        let prefix = prefix_of(name, part);
        let dot = if prefix.is_empty() { "" } else { "." };
        let channel = |c| layers.channels.get(&format!("{prefix}{dot}{c}"))?.get(i).copied();
        Some([channel("R")?, channel("G")?, channel("B")?])
    };
    names(settings)
        .map(|name| Some(named(name, triple(name, Part::Mean)?, triple(name, Part::Error))))
        .collect()
}

/// From the sums of each region and replicate, as [`ovtigre_core::film::estimate::picture`] has it.
fn of_sums(prefixes: &[Vec<Prefix>], settings: &Settings, x: u32, y: u32) -> Option<Vec<PixelValue>> {
    let is_in = |r: Region| (r.x..r.x + r.width).contains(&x) && (r.y..r.y + r.height).contains(&y);
    let replicates = prefixes.iter().find(|r| r.first().is_some_and(|prefix| is_in(prefix.region())))?;
    let region = replicates.first()?.region();
    let i = (y - region.y) as usize * region.width as usize + (x - region.x) as usize;
    let counts: Vec<f64> = replicates.iter().map(|prefix| f64::from(prefix.samples())).collect();
    let count: f64 = counts.iter().sum();
    let plane = |(layer, name): (usize, Option<&str>)| {
        let sums: Vec<&[f64]> = replicates.iter().map(|prefix| prefix.layer(layer)).collect();
        let mean = |c: usize| sums.iter().map(|sum| sum[i * 3 + c]).sum::<f64>() / count.max(1.0);
        let error = |c: usize| variance_of_mean(&sums, &counts, i * 3 + c).sqrt() as f32;
        let error = (replicates.len() > 1).then(|| [error(0), error(1), error(2)]);
        named(name, [mean(0) as f32, mean(1) as f32, mean(2) as f32], error)
    };
    Some(names(settings).enumerate().map(plane).collect())
}
