//! By which method a job is rendered that leaves it open: by logic first, then by a pilot.

use super::{
    Farm,
    append::blocking,
    error::{FarmError, Result},
    reach::{letters, lost},
    rules::Rules,
    spec::JobSpec,
    submit::resolve,
};
use ovtigre_core::{
    bsdf::event::Letters,
    film::sketch::Sketch,
    path::expression::language::Language,
    render::{
        inspect::{IMAGE_BASED, casts},
        pilot::{
            plan::{Chance, NoPilot, Plan},
            report::Pilot,
            trying::pilot,
        },
    },
    settings::{Method, Settings, Shows},
};
use ovtigre_proto::{
    job::{JobRequest, MethodRequest},
    pair::EnvironmentRequest,
    problem::Fault,
    scene::SceneContents,
};
use std::iter;

/// What is chosen from beside `path`; of methods that are as good the first is taken.
const OTHERS: [MethodRequest; 3] =
    [MethodRequest::Bidirectional, MethodRequest::Caustics, MethodRequest::Light];

/// What a request would become by each method that comes into question: at least one. Where it leaves the method open, these are
/// the unbiased methods that can do all that is asked for, and of them those that leave out the fewest paths.
pub(super) fn candidates(
    request: &JobRequest,
    scene: &SceneContents,
    rules: &Rules,
) -> std::result::Result<Vec<JobSpec>, Vec<Fault>> {
    let mut all = vec![resolve(request.clone(), scene, rules)?];
    if !matches!(request.method, None | Some(MethodRequest::Auto)) {
        return Ok(all);
    }
    if request.bounces.is_some_and(|most| most <= 1) {
        "next events from what is seen make all paths of one scattering"
            .clone_into(&mut all[0].method_reason);
        return Ok(all);
    }
    for method in OTHERS {
        if method == MethodRequest::Caustics && !casts(asked(&all[0].settings).intersection(letters(scene))) {
            continue;
        }
        let by = JobRequest { method: Some(method), ..request.clone() };
        if let Ok(spec) = resolve(by, scene, rules) {
            all.push(JobSpec { request: request.clone(), ..spec });
        }
    }
    if all.len() == 1 {
        "no other method does what is asked for".clone_into(&mut all[0].method_reason);
        return Ok(all);
    }
    let fewest = all.iter().map(|spec| lost(&spec.unreachable)).min();
    all.retain(|spec| Some(lost(&spec.unreachable)) == fewest);
    if let [one] = &mut all[..] {
        "it makes paths that are asked for and that no other method makes".clone_into(&mut one.method_reason);
    }
    Ok(all)
}

impl Farm {
    /// The job by one of `candidates`, with the reason why, and the picture of the pilot where there was one.
    pub(super) async fn chosen_of(
        &self,
        mut candidates: Vec<JobSpec>,
        scene: &SceneContents,
    ) -> Result<(JobSpec, Option<Sketch>)> {
        if candidates.len() == 1 {
            return Ok((candidates.remove(0), None));
        }
        let plan = plan(&candidates, scene);
        let tried = self.pilot(&candidates[0], &plan).await?;
        let method = tried.as_ref().map_or_else(|_| plan.untried(), |(pilot, _)| pilot.method);
        let mut spec = candidates.swap_remove(
            candidates.iter().position(|spec| spec.settings.method == method).expect("it was tried"),
        );
        spec.method_reason = match &tried {
            Ok((pilot, _)) => reason(pilot),
            Err(why) if method == Method::Caustics => {
                format!("it looks for light where others meet it by chance, and {why}")
            }
            Err(why) => format!("nothing speaks against it, and {why}"),
        };
        let (pilot, sketch) = tried.ok().unzip();
        spec.pilot = pilot;
        Ok((spec, sketch))
    }

    /// Tries the candidates for one job, or says why not. Reads the scene whole, as an inspection does.
    async fn pilot(
        &self,
        spec: &JobSpec,
        plan: &Plan,
    ) -> Result<std::result::Result<(Pilot, Sketch), NoPilot>> {
        if let Err(why) = plan.check() {
            return Ok(Err(why));
        }
        let _turn = self.inspectors.acquire().await.map_err(|_| FarmError::Stopping)?;
        let id = spec.request.scene.clone().expect("checked: a scene is there");
        let bytes = self.upload_bytes("/scene", &id).await?;
        let environment = match &spec.request.environment {
            Some(EnvironmentRequest::Image(id)) => Some(self.upload_bytes("/environment", id).await?),
            Some(EnvironmentRequest::Uniform(_)) | None => None,
        };
        let plan = plan.clone();
        blocking(move || pilot(&bytes[..], environment.as_deref(), &plan)).await
    }
}

/// Letters on the words of a picture and its layers.
fn asked(settings: &Settings) -> Letters {
    let layers = settings.layers.iter().filter_map(|layer| match &layer.shows {
        Shows::Paths(paths) => Some(paths.as_str()),
        Shows::Strategy(_) | Shows::Narrow | Shows::Scattered | Shows::Squares(_) => None,
    });
    let paths: Vec<&str> = iter::once(settings.paths.as_str()).chain(layers).collect();
    Language::compile(&paths).map_or(Letters::NONE, |language| language.letters())
}

/// Whether the only light that has extent is a sky that is alike everywhere: rays meet it all the time.
fn is_even(spec: &JobSpec, scene: &SceneContents) -> bool {
    let sky = match &spec.request.environment {
        Some(EnvironmentRequest::Uniform(_)) => true,
        Some(EnvironmentRequest::Image(_)) => false,
        None => !scene.needs.iter().any(|need| need == IMAGE_BASED),
    };
    sky && scene.lights.emissive_triangles == 0
}

/// What a pilot has to know of the candidates.
fn plan(candidates: &[JobSpec], scene: &SceneContents) -> Plan {
    let spec = &candidates[0];
    Plan {
        settings: spec.settings.clone(),
        region: spec.region,
        samples: spec.samples_asked(),
        error_target: spec.error_target,
        seconds: spec.seconds,
        triangles: scene.triangles_stored,
        pixels: scene.pixels,
        chance: match (spec.settings.method, spec.by_chance) {
            (Method::Path, Some(_)) if !is_even(spec, scene) => Chance::Sometimes,
            _ => Chance::Never,
        },
        methods: candidates.iter().map(|spec| spec.settings.method).collect(),
    }
}

/// What a pilot found, in words.
fn reason(pilot: &Pilot) -> String {
    let others = pilot.trials.iter().filter(|trial| trial.method != pilot.method);
    let others: Vec<String> = others
        .map(|trial| match trial.time_ratio {
            ratio if ratio < 100.0 => format!("{} {ratio:.2} times", trial.method.name()),
            _ => format!("{} more than 100 times", trial.method.name()),
        })
        .collect();
    let others = others.join(", ");
    if pilot.trials.iter().any(|trial| trial.time_ratio < 1.0) {
        return format!(
            "it needs about the least time for an error in a pilot, with the cheapest samples: {others} of its"
        );
    }
    format!("it needs the least time for an error in a pilot: {others} of its")
}

#[cfg(test)]
mod tests {
    use super::*;
    use ovtigre_core::settings::Shadows;
    use ovtigre_proto::{id::BlobId, scene::LightCounts};

    /// A scene of these letters, lit by a surface or by a point.
    fn scene(letters: &[&str], lights: [u32; 2]) -> SceneContents {
        let [emissive_triangles, point] = lights;
        SceneContents {
            letters: letters.iter().map(|letter| (*letter).to_owned()).collect(),
            lights: LightCounts {
                emissive_triangles: emissive_triangles.into(),
                point,
                ..LightCounts::default()
            },
            ..SceneContents::default()
        }
    }

    fn of(scene: &SceneContents, change: impl FnOnce(&mut JobRequest)) -> Vec<JobSpec> {
        let mut request = JobRequest { scene: Some(BlobId::of([0; 32])), ..JobRequest::default() };
        change(&mut request);
        candidates(&request, scene, &Rules::default()).unwrap()
    }

    fn methods(all: &[JobSpec]) -> Vec<Method> {
        all.iter().map(|spec| spec.settings.method).collect()
    }

    #[test]
    fn logic_keeps_what_makes_the_most_paths() {
        let diffuse = scene(&["D"], [2, 0]);
        assert_eq!(methods(&of(&diffuse, |_| ())), [Method::Path, Method::Bidirectional, Method::Light]);
        // A mirror that is seen is on no light subpath that is joined to a pinhole.
        let mirror = scene(&["D", "S_M"], [2, 0]);
        assert_eq!(methods(&of(&mirror, |_| ())), [Method::Path, Method::Bidirectional, Method::Caustics]);
        // Light comes to a glossy surface by next events, and what it makes of it to the lens.
        let gloss = scene(&["D", "S"], [2, 0]);
        let all = [Method::Path, Method::Bidirectional, Method::Caustics, Method::Light];
        assert_eq!(methods(&of(&gloss, |_| ())), all);
        // What a mirror makes of a point's light is not met by any eye subpath.
        let point = scene(&["D", "S_M"], [0, 1]);
        let found = of(&point, |_| ());
        assert_eq!(methods(&found), [Method::Bidirectional]);
        assert!(found[0].method_reason.contains("no other method makes"), "{}", found[0].method_reason);
        assert_eq!(methods(&of(&point, |r| r.paths = Some("LDE".to_owned()))).len(), 3);
    }

    #[test]
    fn what_only_path_does_or_is_asked_for_is_not_tried() {
        let diffuse = scene(&["D"], [2, 0]);
        assert_eq!(methods(&of(&diffuse, |r| r.shadows = Some(Shadows::Off))), [Method::Path]);
        assert_eq!(methods(&of(&diffuse, |r| r.preset = Some("whitted".to_owned()))), [Method::Path]);
        assert_eq!(methods(&of(&diffuse, |r| r.bounces = Some(1))), [Method::Path]);
        let asked = of(&diffuse, |r| r.method = Some(MethodRequest::Light));
        assert_eq!((methods(&asked), &*asked[0].method_reason), (vec![Method::Light], "asked for"));
    }

    #[test]
    fn a_candidate_is_the_job_that_asking_for_its_method_gives() {
        let diffuse = scene(&["D"], [2, 0]);
        for one in of(&diffuse, |_| ()) {
            let method = match one.settings.method {
                Method::Light => MethodRequest::Light,
                Method::Bidirectional => MethodRequest::Bidirectional,
                Method::Caustics => MethodRequest::Caustics,
                _ => MethodRequest::Path,
            };
            let asked = of(&diffuse, |r| r.method = Some(method)).remove(0);
            let id = BlobId::of([0; 32]);
            assert_eq!(one.identity(&id), asked.identity(&id));
            assert_eq!((one.request.method, one.by_chance), (None, asked.by_chance));
        }
    }

    #[test]
    fn an_even_sky_is_not_met_by_chance() {
        let chance = |lamps: u32, change: fn(&mut JobRequest)| {
            let scene = SceneContents { brightest: 1.0, ..scene(&["D", "S"], [lamps, 0]) };
            plan(&of(&scene, change), &scene).chance
        };
        let sky = |r: &mut JobRequest| r.environment = Some(EnvironmentRequest::Uniform([1.0; 3]));
        let image = |r: &mut JobRequest| r.environment = Some(EnvironmentRequest::Image(BlobId::of([1; 32])));
        assert_eq!([chance(0, |_| ()), chance(0, sky)], [Chance::Never; 2]);
        assert_eq!([chance(2, |_| ()), chance(2, sky), chance(0, image)], [Chance::Sometimes; 3]);
    }
}
