//! From bytes to a scene that is ready to be rendered.

use crate::gltf::bundle::Bundle;
use crate::gltf::error::LoadError;
use crate::gltf::limits::Limits;
use crate::gltf::load::{Choice, load_as};
use crate::method::radiosity::Reconstruction;
use crate::radiosity::fineness::Fineness;
use crate::radiosity::solution::{Solution, TooManyTriangles};
use crate::scene::Scene;
use crate::scene::camera::Camera;
use crate::scene::data::SceneData;
use crate::scene::environment::{Environment, EnvironmentError};
use crate::scene::nearby::is_worth_a_tree;
use crate::scene::view::{LensInScene, Views};
use crate::settings::{CameraChoice, EnvironmentSource, Method, Settings};
use crate::trace::build_error::BuildError;
use std::sync::Arc;

/// Why a scene cannot be rendered as the settings say.
#[derive(Debug, thiserror::Error)]
pub enum PrepareError {
    /// The scene cannot be read.
    #[error(transparent)]
    Load(#[from] LoadError),
    /// The environment cannot be read.
    #[error(transparent)]
    Environment(#[from] EnvironmentError),
    /// The settings name an image that did not come along.
    #[error("the environment image {0} is not here")]
    NoEnvironment(String),
    /// The settings name a camera that the scene does not have.
    #[error("there is no camera {index}: the scene has {count}, numbered from 0")]
    NoCamera {
        /// The number asked for.
        index: u32,
        /// Cameras of the scene.
        count: usize,
    },
    /// The trees cannot be built.
    #[error(transparent)]
    Build(#[from] BuildError),
    /// The scene has no finite elements.
    #[error(transparent)]
    Radiosity(#[from] TooManyTriangles),
}

/// All that batches of a scene are rendered from.
#[derive(Clone, Debug)]
pub struct Prepared {
    /// The scene.
    pub scene: Scene,
    /// Its diffuse light, where the method is [`Method::Radiosity`]. It does not depend on the choice of random sequences.
    pub radiosity: Option<Arc<Solution>>,
}

impl Prepared {
    /// How the scene was solved before the first sample, as JSON, where it was.
    pub fn solution(&self) -> Option<String> {
        let solution = self.radiosity.as_ref()?;
        Some(serde_json::to_string(solution.report()).expect("a report is plain data"))
    }
}

/// Makes a scene ready to be rendered: [`open`], and what the method needs beside.
pub fn prepare(
    bytes: impl Into<Arc<[u8]>>,
    environment: Option<&[u8]>,
    settings: &Settings,
) -> Result<Prepared, PrepareError> {
    let scene = open(bytes, environment, settings)?;
    let radiosity = match settings.method {
        Method::Radiosity => {
            let scatterings = Reconstruction::Gather.scatterings(settings.bounces);
            Some(Arc::new(Solution::new(&scene, settings.shadows, scatterings, Fineness::default())?))
        }
        Method::Path | Method::Light | Method::Bidirectional | Method::Caustics | Method::Photon => None,
    };
    Ok(Prepared { scene, radiosity })
}

/// Reads a scene, builds its trees and gathers its lights, in a tree where next events to many of them are made. `environment` holds the bytes of the image that the
/// settings name, if they do; the scene's own counts where they name none. A scene that nothing lights gets a default sky.
pub fn open(
    bytes: impl Into<Arc<[u8]>>,
    environment: Option<&[u8]>,
    settings: &Settings,
) -> Result<Scene, PrepareError> {
    let times = [settings.shutter.open, settings.shutter.close];
    let choice = Choice { times, variant: settings.variant.as_deref() };
    let loaded = load_as(&Bundle::open(bytes)?, &Limits::default(), &choice)?;
    let mut data = loaded.scene;
    let views = views(&data, settings)?;
    let given = match &settings.environment {
        None => None,
        Some(given) => Some(match &given.source {
            EnvironmentSource::Uniform(radiance) => Environment::uniform((*radiance).into()),
            EnvironmentSource::Image(hash) => {
                let bytes = environment.ok_or_else(|| PrepareError::NoEnvironment(hash.clone()))?;
                Environment::decode(bytes, given.rotation_degrees)?
            }
        }),
    };
    let is_lit = data.is_lit();
    let own = data.environment.take().map(Arc::unwrap_or_clone);
    let environment = given.or(own).or_else(|| (!is_lit).then(Environment::default_sky));
    let mut scene = Scene::new(data, environment, views)?;
    if settings.method.has_next_events() && is_worth_a_tree(&scene.data) {
        scene.lights = scene.lights.by_tree(&scene.data);
    }
    Ok(scene)
}

fn views(data: &SceneData, settings: &Settings) -> Result<Views, PrepareError> {
    let framed;
    let camera = match settings.camera {
        CameraChoice::Framed => {
            framed = Camera::framed(&data.bounds);
            &framed
        }
        CameraChoice::Index(index) => (data.cameras.get(index as usize))
            .ok_or(PrepareError::NoCamera { index, count: data.cameras.len() })?,
    };
    let distance = |metres: f64| data.normalisation.distance(metres) as f32;
    let lens = settings.lens.map(|lens| LensInScene {
        radius: distance(lens.radius),
        focus_distance: distance(lens.focus_distance),
    });
    Ok(Views::new(camera, settings.size, lens))
}
