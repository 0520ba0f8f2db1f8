//! `ovtigre bake`: a scene with its diffuse light in it.

use super::{
    exit::{CommandError, Outcome},
    interrupt::Interrupt,
    output, scene_file, terminal, words,
};
use clap::{Args, ValueEnum};
use ovtigre_core::{
    bake::baked::{Baked, Form, bake},
    film::size::Size,
    radiosity::{fineness::Fineness, solution::Solution},
    render::prepare::open,
    settings::{
        CameraChoice, Distribution, Environment, EnvironmentSource, FULL, Gloss, Method, Settings, Shadows,
        Shutter, Weights,
    },
};
use ovtigre_proto::pair::radiance;
use std::{
    fs,
    path::{Path, PathBuf},
    time::Instant,
};

/// Solve the diffuse light of a scene (LD*E) and write it as a glTF scene that other viewers show.
#[derive(Args, Debug)]
pub(crate) struct Bake {
    /// Scene to light: .glb, or .gltf with its files beside it.
    #[arg(value_name = "SCENE")]
    scene: PathBuf,
    /// Scene to write; a light map is written beside it, too, as .exr.
    #[arg(short, long, value_name = "OUT.glb")]
    output: PathBuf,
    /// How light is found: by finite elements, or by particles from the lights.
    #[arg(long, value_name = "METHOD", default_value = "radiosity")]
    method: MethodName,
    /// Particles that method light sends.
    #[arg(long, value_name = "N", default_value_t = 16_777_216, value_parser = clap::value_parser!(u64).range(1..=1 << 40))]
    particles: u64,
    /// Write light as colours of vertices or as a texture with a second set of coordinates.
    #[arg(long = "as", value_name = "FORM", default_value = "vertex-colors")]
    form: FormName,
    /// Side of a light map in texels, a power of two.
    #[arg(long, value_name = "TEXELS", default_value_t = 1024)]
    size: u32,
    /// Radiance that white stands for, in W/(sr·m²) [default: what 99.9 % of all that does not emit stay below].
    #[arg(long, value_name = "RADIANCE", value_parser = positive)]
    white: Option<f32>,
    /// Patches at most, where the scene has fewer triangles.
    #[arg(long, value_name = "N", default_value_t = 32_768, value_parser = clap::value_parser!(u32).range(1..=2_097_152))]
    patches: u32,
    /// Most scatterings [default: any number].
    #[arg(long, value_name = "N")]
    bounces: Option<u32>,
    /// Light from infinitely far: an image, or the same radiance from everywhere in W/(sr·m²) [default: the scene's].
    #[arg(long, value_name = "FILE.exr|R,G,B")]
    environment: Option<String>,
    /// Turn of the environment around the vertical axis in degrees.
    #[arg(
        long,
        value_name = "DEG",
        requires = "environment",
        default_value_t = 0.0,
        allow_hyphen_values = true
    )]
    environment_rotation: f64,
    /// Write how the light was found, with the residual of every iteration, to this file.
    #[arg(long, value_name = "FILE.json")]
    report: Option<PathBuf>,
}

/// How light is found.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum MethodName {
    /// Finite elements.
    Radiosity,
    /// Particles from the lights.
    Light,
}

/// What light is written as.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum FormName {
    /// Colours of vertices.
    VertexColors,
    /// A texture.
    LightMap,
}

impl Bake {
    /// Bakes, on all processors of this machine.
    pub(crate) async fn run(self) -> Outcome {
        let ends_right = self.output.extension().is_some_and(|end| end.eq_ignore_ascii_case("glb"));
        if !ends_right {
            let name = self.output.display();
            return Err(CommandError::wrong(format!("{name}: the name of a baked scene ends in .glb")));
        }
        output::check_writable(&self.output)?;
        if let Some(report) = &self.report {
            output::check_writable(report)?;
        }
        let interrupt = Interrupt::listen();
        let work = tokio::task::spawn_blocking(move || self.bake());
        tokio::select! {
            done = work => done.map_err(|e| CommandError::failed(format!("baking failed: {e}")))?,
            () = interrupt.once() => Err(CommandError::stopped("stopped before done; nothing is written")),
        }
    }

    fn bake(&self) -> Outcome {
        let start = Instant::now();
        let bytes = scene_file::bytes(&self.scene)?;
        let (source, image) = self.environment()?;
        let settings = settings(source, self.environment_rotation);
        let scene =
            open(bytes, image.as_deref(), &settings).map_err(|e| scene_file::fault(&self.scene, &e))?;
        let most = self.patches as usize;
        let fineness = Fineness { even: (most / 4).max(1), most, ..Fineness::default() };
        let solution = match self.method {
            MethodName::Radiosity => Solution::new(&scene, Shadows::On, self.bounces, fineness),
            MethodName::Light => Solution::by_particles(&scene, self.particles, self.bounces, most),
        };
        let solution = solution.map_err(|e| scene_file::fault(&self.scene, &e))?;
        let report = solution.report();
        let found = match self.method {
            MethodName::Radiosity => format!(
                "{} iterations, residual {:.1e}",
                report.iterations,
                report.residuals.last().copied().unwrap_or(0.0)
            ),
            MethodName::Light => format!("{} particles", self.particles),
        };
        let seconds = words::duration(start.elapsed().as_secs_f64());
        terminal::remark(&format!("solved: {} patches, {found}, {seconds}", report.patches));
        let form = match self.form {
            FormName::VertexColors => Form::VertexColours,
            FormName::LightMap => Form::LightMap(self.size),
        };
        let baked =
            bake(&scene.data, &solution, form, self.white).map_err(|e| CommandError::wrong(e.to_string()))?;
        if let Some(path) = &self.report {
            let text = serde_json::to_string_pretty(report).expect("a report is plain data");
            output::save_bytes(text.as_bytes(), path)?;
        }
        self.write(&baked)
    }

    fn write(&self, baked: &Baked) -> Outcome {
        let mut written = vec![self.output.display().to_string()];
        if let Some(map) = &baked.light_map {
            let path = self.output.with_extension("exr");
            output::save_bytes(&map.exr(), &path)?;
            written.push(path.display().to_string());
        }
        output::save_bytes(&baked.glb, &self.output)?;
        written.push(format!("white is {:.4} W/(sr·m²)", baked.white));
        terminal::result(&words::list(&written));
        Ok(())
    }

    /// Where light from infinitely far comes from, and the bytes of its image.
    fn environment(&self) -> Outcome<(Option<EnvironmentSource>, Option<Vec<u8>>)> {
        let Some(text) = &self.environment else { return Ok((None, None)) };
        if let Some(radiance) = radiance(text) {
            return Ok((Some(EnvironmentSource::Uniform(radiance)), None));
        }
        let bytes = fs::read(Path::new(text)).map_err(|e| {
            CommandError::wrong(format!(
                "environment '{text}' is neither three numbers R,G,B nor a readable file: {e}"
            ))
        })?;
        Ok((Some(EnvironmentSource::Image(text.clone())), Some(bytes)))
    }
}

/// Of a scene that is not looked at from anywhere.
fn settings(environment: Option<EnvironmentSource>, rotation_degrees: f64) -> Settings {
    Settings {
        size: Size { width: 1, height: 1 },
        camera: CameraChoice::Framed,
        variant: None,
        method: Method::Radiosity,
        paths: FULL.to_owned(),
        layers: Vec::new(),
        gloss: Gloss::AsItIs,
        strategies: Vec::new(),
        weights: Weights::Balance,
        bounces: None,
        lens: None,
        shutter: Shutter::default(),
        environment: environment.map(|source| Environment { source, rotation_degrees }),
        shadows: Shadows::On,
        seed: 0,
        replicates: 1,
        sampling: Distribution::Uniform,
    }
}

fn positive(text: &str) -> Result<f32, String> {
    let number: f32 = text.parse().map_err(|_| "it is not a number".to_owned())?;
    if number > 0.0 && number.is_finite() {
        Ok(number)
    } else {
        Err("it is not positive and finite".to_owned())
    }
}
