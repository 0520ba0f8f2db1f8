//! One light, and next events towards it.

use crate::math::colour::Rgb;
use crate::math::cosine::squared_distance;
use crate::scene::data::SceneData;
use crate::scene::emitter::Emitter;
use crate::scene::environment::Environment;
use crate::scene::punctual::PunctualKind;
use crate::trace::moment::Moment;
use glam::{Vec2, Vec3};
use std::borrow::Cow;

/// A light.
#[derive(Clone, Copy, Debug)]
pub enum Light {
    /// An emissive triangle of an instance.
    Triangle {
        /// The instance.
        instance: u32,
        /// The triangle of its mesh.
        triangle: u32,
    },
    /// A light without extent, by its place in the scene's list.
    Punctual(u32),
    /// All of the environment.
    Environment,
}

/// A next event: where light comes from, how much of it, and how likely the choice was.
#[derive(Clone, Copy, Debug)]
pub struct NextEvent {
    /// Unit direction to the light.
    pub direction: Vec3,
    /// Radiance towards the point; for a light without extent, irradiance at right angles (with `pdf` one).
    pub radiance: Rgb,
    /// Density over solid angle at the point; one for a light without extent.
    pub pdf: f32,
    /// |cos θ| at the light's surface; one for other lights.
    pub cos: f64,
    /// Squared distance; one for light from infinitely far.
    pub squared: f64,
    /// Whether directions sampled from a BSDF can find this light, too.
    pub found_by: FoundBy,
    /// Where the shadow ray ends.
    pub end: ShadowEnd,
}

/// How a light can be found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FoundBy {
    /// Next events only: it has no extent.
    NextEvent,
    /// Next events and sampled directions.
    Both,
}

/// Where a shadow ray ends.
#[derive(Clone, Copy, Debug)]
pub enum ShadowEnd {
    /// At a point that is just off the light's own surface.
    Point(Vec3),
    /// At infinity.
    Infinity,
}

impl Light {
    /// A next event from `point` at a moment with the numbers `u`; `None` where this light sends nothing there. `emitter` tells
    /// the triangle at that moment, where it is one.
    #[inline]
    pub fn sample<'e>(
        &self,
        data: &SceneData,
        environment: Option<&Environment>,
        emitter: impl FnOnce() -> Cow<'e, Emitter>,
        (moment, point): (Moment, Vec3),
        u: Vec2,
    ) -> Option<NextEvent> {
        match *self {
            Self::Triangle { .. } => emitter().sample(data, moment, point, u),
            Self::Punctual(index) => sample_punctual(&data.punctual[index as usize].at(moment), point),
            Self::Environment => {
                let environment = environment?;
                let (direction, pdf) = environment.sample(u);
                let radiance = environment.radiance(direction);
                let found_by = FoundBy::Both;
                (pdf > 0.0 && radiance != Vec3::ZERO).then_some(NextEvent {
                    direction,
                    radiance,
                    pdf,
                    cos: 1.0,
                    squared: 1.0,
                    found_by,
                    end: ShadowEnd::Infinity,
                })
            }
        }
    }
}

fn sample_punctual(kind: &PunctualKind, point: Vec3) -> Option<NextEvent> {
    let towards = |position: Vec3, intensity: Rgb| {
        let to = position - point;
        let direction = to.try_normalize()?;
        let radiance = intensity / to.length_squared();
        Some((direction, radiance, ShadowEnd::Point(position)))
    };
    let squared = |end| match end {
        ShadowEnd::Point(position) => squared_distance(position, point),
        ShadowEnd::Infinity => 1.0,
    };
    let (direction, radiance, end) = match *kind {
        PunctualKind::Point { position, intensity } => towards(position, intensity)?,
        PunctualKind::Spot { position, direction: axis, intensity, inner_cos, outer_cos } => {
            let (direction, radiance, end) = towards(position, intensity)?;
            let share = PunctualKind::cone(inner_cos, outer_cos, -axis.dot(direction));
            (direction, radiance * share, end)
        }
        PunctualKind::Directional { direction, irradiance } => (-direction, irradiance, ShadowEnd::Infinity),
    };
    (radiance != Vec3::ZERO).then_some(NextEvent {
        direction,
        radiance,
        pdf: 1.0,
        cos: 1.0,
        squared: squared(end),
        found_by: FoundBy::NextEvent,
        end,
    })
}
