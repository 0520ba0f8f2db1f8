//! The lecture's expressions by name.

use crate::settings::{FULL, Gloss};

/// A named expression.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Preset {
    /// Its name.
    pub name: &'static str,
    /// As the lecture writes it.
    pub shown: &'static str,
    /// As it is compiled.
    pub paths: &'static str,
    /// How it takes gloss.
    pub gloss: Gloss,
}

/// All of them.
pub const PRESETS: [Preset; 5] = [
    as_it_is("phong", "L(D|S)E"),
    Preset {
        name: "whitted",
        shown: "L[D|S]S_M*E",
        // Read from the eye: mirrors, and gloss as if it were one, up to the scattering next to the light.
        paths: "L[(D|S)(S_M|S_T)*]E",
        gloss: Gloss::Mirror,
    },
    as_it_is("cook", "L[D]S*E"),
    as_it_is("radiosity", "LD*E"),
    as_it_is("full", FULL),
];

const fn as_it_is(name: &'static str, paths: &'static str) -> Preset {
    Preset { name, shown: paths, paths, gloss: Gloss::AsItIs }
}

/// The preset of a name.
pub fn preset(name: &str) -> Option<&'static Preset> {
    PRESETS.iter().find(|preset| preset.name == name)
}

/// An expression as it is shown to people: a preset's as the lecture writes it.
pub fn shown(paths: &str) -> &str {
    PRESETS.iter().find(|preset| preset.paths == paths).map_or(paths, |preset| preset.shown)
}
