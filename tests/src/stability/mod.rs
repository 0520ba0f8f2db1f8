//! Stiff and extreme cases, each beside an answer that is known without rendering.

pub mod budget;
pub mod case;
pub mod degenerate;
pub mod edges;
pub mod finding;
pub mod geometry;
pub mod gloss;
pub mod invalid;
pub mod lights;
pub mod long_paths;
pub mod media;
pub mod picture_trial;
pub mod random;
pub mod refraction;
pub mod report;
pub mod rooms;
pub mod scale;
pub mod sums;

use case::Case;

/// All cases, in the order of the page.
pub fn cases() -> Vec<Case> {
    let mut all = rooms::cases();
    all.extend(scale::cases());
    all.extend(geometry::cases());
    all.extend(edges::cases());
    all.extend(lights::cases());
    all.extend(gloss::cases());
    all.extend(refraction::cases());
    all.extend(long_paths::cases());
    all.extend(sums::cases());
    all.extend(degenerate::cases());
    all.extend(media::cases());
    all.extend(invalid::cases());
    all
}
