//! What a job needs of what the program can do, and what it leaves out, why.

use super::reach::{is_sky, letters};
use ovtigre_core::{
    bsdf::event::{Letter, Letters},
    render::inspect::{DEFAULT_SKY, LIGHT_TREE},
    settings::{Method, Settings},
};
use ovtigre_proto::{
    needs::{LeftOut, Needs},
    scene::SceneContents,
};

/// What moves, as a scene's report names it.
const MOVING: [&str; 3] = ["animation", "skins", "morph targets"];

/// Of a scene that is rendered as the settings say; `words` are the letters that are on a word of the paths asked for.
pub fn needs(scene: &SceneContents, settings: &Settings, words: Letters) -> Needs {
    let mut list = Needs::default();
    for what in &scene.needs {
        match &settings.environment {
            Some(_) if is_sky(what) => leave(&mut list, what, "an environment is given"),
            _ if what == LIGHT_TREE && !settings.method.has_next_events() => {
                leave(&mut list, what, &format!("method {} has no next events", settings.method.name()));
            }
            _ => need(&mut list, what),
        }
    }
    for what in &scene.leaves_out {
        let why = match what.as_str() {
            DEFAULT_SKY => "the scene has light",
            LIGHT_TREE => "its lights are few, or close together",
            _ => "the scene has none",
        };
        leave(&mut list, what, why);
    }
    let open = settings.shutter.close > settings.shutter.open;
    let moves = scene.needs.iter().any(|what| MOVING.contains(&what.as_str()));
    either(
        &mut list,
        "motion blur",
        open && moves,
        if moves { "the shutter is open for no time" } else { "nothing moves" },
    );
    either(&mut list, "environment", settings.environment.is_some(), "none is given");
    either(&mut list, "lens", settings.lens.is_some(), "the camera is a pinhole");
    either(&mut list, "layers", !settings.layers.is_empty(), "none are asked for");
    let there = letters(scene);
    for letter in [Letter::Diffuse, Letter::Glossy, Letter::Specular] {
        let what = format!("scattering {}", letter.symbol());
        let on_words = words.contains(Letters::of(letter));
        let why = if on_words { "no surface has it" } else { "it is on no word of the paths asked for" };
        either(&mut list, &what, on_words && there.contains(Letters::of(letter)), why);
    }
    let method = settings.method;
    let unused = format!("method {} has none", method.name());
    either(&mut list, "light subpaths", method.splats(), &unused);
    either(&mut list, "joining of subpaths", method == Method::Bidirectional, &unused);
    either(&mut list, "photon maps", method == Method::Photon, &unused);
    either(&mut list, "finite elements", method == Method::Radiosity, &unused);
    list
}

fn need(list: &mut Needs, what: &str) {
    list.needed.push(what.to_owned());
}

fn leave(list: &mut Needs, what: &str, why: &str) {
    list.left_out.push(LeftOut { what: what.to_owned(), why: why.to_owned() });
}

fn either(list: &mut Needs, what: &str, needed: bool, why: &str) {
    if needed { need(list, what) } else { leave(list, what, why) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::farm::{rules::Rules, submit::resolve};
    use ovtigre_proto::{
        id::BlobId,
        job::{JobRequest, MethodRequest},
        pair::EnvironmentRequest,
    };

    fn scene() -> SceneContents {
        SceneContents {
            letters: vec!["D".to_owned(), "S".to_owned()],
            needs: ["triangles", "animation", LIGHT_TREE, DEFAULT_SKY].map(str::to_owned).into(),
            leaves_out: vec!["textures".to_owned()],
            ..SceneContents::default()
        }
    }

    fn of(change: impl FnOnce(&mut JobRequest)) -> Needs {
        let mut request = JobRequest { scene: Some(BlobId::of([0; 32])), ..JobRequest::default() };
        change(&mut request);
        resolve(request, &scene(), &Rules::default()).unwrap().needs
    }

    #[test]
    fn everything_is_needed_or_left_out_with_a_reason() {
        let plain = of(|_| ());
        let needed = ["triangles", "animation", LIGHT_TREE, DEFAULT_SKY, "scattering D", "scattering S"];
        assert_eq!(plain.needed, needed);
        for (what, why) in [
            ("textures", "the scene has none"),
            ("motion blur", "the shutter is open for no time"),
            ("scattering S_M", "no surface has it"),
            ("light subpaths", "method path has none"),
        ] {
            assert!(plain.left_out.iter().any(|l| l.what == what && l.why == why), "{what}: {plain:?}");
        }
    }

    #[test]
    fn it_follows_from_what_is_asked_for() {
        let other = of(|r| {
            r.paths = Some("LD*E".to_owned());
            r.method = Some(MethodRequest::Bidirectional);
            r.shutter = Some([0.0, 0.5]);
            r.environment = Some(EnvironmentRequest::Uniform([1.0; 3]));
        });
        for what in ["motion blur", "environment", "light subpaths", "joining of subpaths", "scattering D"] {
            assert!(other.needed.iter().any(|need| need == what), "{what}: {other:?}");
        }
        for what in ["scattering S", DEFAULT_SKY, "photon maps"] {
            assert!(other.left_out.iter().any(|left| left.what == what), "{what}: {other:?}");
        }
        let light = of(|r| r.method = Some(MethodRequest::Light));
        let why = "method light has no next events";
        assert!(light.left_out.iter().any(|left| left.what == LIGHT_TREE && left.why == why), "{light:?}");
    }
}
