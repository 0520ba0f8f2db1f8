//! Primitive modes, and the triangles that corners make in them.

/// What the corners of a primitive make.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Mode {
    /// Points or lines: nothing that light meets.
    NoSurface,
    Triangles,
    Strip,
    Fan,
}

impl Mode {
    /// glTF's number.
    pub(crate) fn from_code(code: u64) -> Option<Self> {
        match code {
            0..=3 => Some(Self::NoSurface),
            4 => Some(Self::Triangles),
            5 => Some(Self::Strip),
            6 => Some(Self::Fan),
            _ => None,
        }
    }

    /// Triangles that `corners` corners make.
    pub(crate) fn count(self, corners: usize) -> usize {
        match self {
            Self::NoSurface => 0,
            Self::Triangles => corners / 3,
            Self::Strip | Self::Fan => corners.saturating_sub(2),
        }
    }

    /// Which corners triangle `i` has, in the order that keeps the winding (glTF 2.0 §3.7.2.1).
    pub(crate) fn triangle(self, i: usize) -> [usize; 3] {
        match self {
            Self::NoSurface | Self::Triangles => [3 * i, 3 * i + 1, 3 * i + 2],
            Self::Strip => [i, i + 1 + i % 2, i + 2 - i % 2],
            Self::Fan => [i + 1, i + 2, 0],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strips_keep_the_winding() {
        let triangles: Vec<_> = (0..Mode::Strip.count(5)).map(|i| Mode::Strip.triangle(i)).collect();
        assert_eq!(triangles, [[0, 1, 2], [1, 3, 2], [2, 3, 4]]);
    }

    #[test]
    fn fans_share_the_first_corner() {
        let triangles: Vec<_> = (0..Mode::Fan.count(4)).map(|i| Mode::Fan.triangle(i)).collect();
        assert_eq!(triangles, [[1, 2, 0], [2, 3, 0]]);
    }

    #[test]
    fn too_few_corners_make_nothing() {
        for mode in [Mode::NoSurface, Mode::Triangles, Mode::Strip, Mode::Fan] {
            assert_eq!(mode.count(2), 0);
        }
    }
}
