//! Which of the asked paths no technique of a method can make: found by logic, before anything is rendered.
//!
//! Whether a technique makes a path depends on few things: which scatterings are ideally specular, and whether light and
//! lens can be hit or joined to. So a path is followed by the language's automaton and by what of it matters to
//! techniques (`Course`), together a graph of few nodes in which the paths that are not made are looked for.

use crate::bsdf::event::{Letter, Letters};
use crate::path::expression::language::{EyeState, Language, LightTag};
use crate::settings::Method;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet, VecDeque};

/// Most examples of paths that are not made.
const EXAMPLES_MAX: usize = 8;
/// Longest words that are counted, in scatterings.
const COUNTED_MAX: u32 = 8;
/// Most beginnings of paths that are tried for examples.
const TRIED_MAX: usize = 1 << 14;

/// A kind of light.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum LightKind {
    /// Emissive surfaces.
    Surface,
    /// Light from infinitely far, from many directions.
    Environment,
    /// Points, spots and suns: without extent, so that nothing hits them.
    Punctual,
}

/// What the eye is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EyeKind {
    /// A lens of finite aperture.
    Lens,
    /// A pinhole.
    Pinhole,
    /// Parallel rays.
    Parallel,
}

/// What of a scene matters.
#[derive(Clone, Debug, PartialEq)]
pub struct Surroundings {
    /// Letters of its surfaces.
    pub letters: Letters,
    /// Its lights and their tags in the language.
    pub lights: Vec<(LightKind, LightTag)>,
    /// Its eye.
    pub eye: EyeKind,
}

/// Paths that are asked for and not made.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct Unreachable {
    /// From which lights.
    pub light: LightKind,
    /// The shortest of them, at most eight.
    pub paths: Vec<String>,
    /// Why no technique makes them.
    pub why: String,
    /// Methods that make all of them.
    pub reached_by: Vec<Method>,
    /// How many of the words that are asked for they are, by length: from no scattering to eight, or to the most that a path
    /// may have. All words count alike here, however much light takes them.
    #[serde(default)]
    pub shares: Vec<Share>,
}

/// Words of one length from one kind of light.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct Share {
    /// Letters between L and E.
    pub scatterings: u32,
    /// Words that the expression accepts, that the scene's surfaces can make, and that show more than the image of a point.
    pub asked: u64,
    /// Those of them that no technique of the method makes.
    pub unreachable: u64,
}

impl Unreachable {
    /// Words that are not made, of those asked for, over all lengths that are counted.
    pub fn counts(&self) -> [u64; 2] {
        self.shares
            .iter()
            .fold([0; 2], |[missing, asked], share| [missing + share.unreachable, asked + share.asked])
    }
}

/// What of a path matters to techniques; its scatterings are met from the eye on.
#[expect(clippy::struct_excessive_bools, reason = "what an automaton of few states knows of a word")]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
struct Course {
    /// Any scattering.
    any: bool,
    /// The first can be joined to.
    first: bool,
    /// The last can be joined to.
    last: bool,
    /// Some can be joined to.
    some: bool,
    /// Two in a row can be joined.
    pair: bool,
    /// Some are not diffuse.
    not_diffuse: bool,
}

impl Course {
    fn then(self, letter: Letter) -> Self {
        let smooth = !letter.is_delta();
        Self {
            any: true,
            first: if self.any { self.first } else { smooth },
            last: smooth,
            some: self.some || smooth,
            pair: self.pair || self.last && smooth,
            not_diffuse: self.not_diffuse || letter != Letter::Diffuse,
        }
    }

    /// Whether a technique of `method` makes such a path.
    fn is_made(self, method: Method, light: LightKind, eye: EyeKind) -> bool {
        let is_hit = light != LightKind::Punctual;
        let next_event = self.last;
        let to_lens = if self.any {
            self.first
        } else {
            is_hit && !(light == LightKind::Environment && eye == EyeKind::Parallel)
        };
        match method {
            Method::Path => is_hit || next_event,
            Method::Light => to_lens,
            Method::Bidirectional => is_hit || next_event || to_lens || self.pair,
            // What no next event makes comes from a surface that is more than diffuse.
            Method::Caustics => is_hit || next_event || to_lens,
            // Direct light is looked for at the first rough surface; all other light comes there as photons.
            Method::Photon => is_hit || self.some,
            Method::Radiosity => !self.not_diffuse && (is_hit || self.any),
        }
    }

    /// Whether such a path shows more than the image of a point: that has no extent and is never seen.
    fn is_seen(self, light: LightKind) -> bool {
        light != LightKind::Punctual || self.some
    }
}

/// The paths of a language, with at most `bounces` scatterings, that `method` does not make.
pub fn unreachable(
    language: &Language,
    method: Method,
    around: &Surroundings,
    bounces: Option<u32>,
) -> Vec<Unreachable> {
    let kinds: BTreeSet<LightKind> = around.lights.iter().map(|(kind, _)| *kind).collect();
    kinds.into_iter().filter_map(|kind| Search::new(language, around, kind).report(method, bounces)).collect()
}

type Node = (usize, Course);

/// The nodes that the paths from a kind of light go through.
struct Search<'l> {
    language: &'l Language,
    light: LightKind,
    eye: EyeKind,
    tags: Vec<LightTag>,
    letters: Letters,
    /// Where each node leads, by each letter.
    graph: BTreeMap<Node, Vec<(Letter, Node)>>,
    states: Vec<EyeState>,
}

impl<'l> Search<'l> {
    fn new(language: &'l Language, around: &Surroundings, light: LightKind) -> Self {
        let tags = around.lights.iter().filter(|(kind, _)| *kind == light).map(|(_, tag)| *tag).collect();
        // The ideal twin of gloss is there where it is asked for.
        let twin =
            if around.letters.has(Letter::Glossy) { Letters::of(Letter::Mirrored) } else { Letters::NONE };
        let letters = around.letters.union(twin).intersection(language.letters());
        let start = language.eye_start();
        let mut search = Self {
            language,
            light,
            eye: around.eye,
            tags,
            letters,
            graph: BTreeMap::new(),
            states: vec![start; language.eye_states()],
        };
        let mut open = vec![(start, Course::default())];
        while let Some((state, course)) = open.pop() {
            search.states[state.index()] = state;
            if search.graph.contains_key(&(state.index(), course)) {
                continue;
            }
            let next = |letter| Some((letter, language.eye_next(state, letter)?, course.then(letter)));
            let next: Vec<_> = search.letters.iter().filter_map(next).collect();
            open.extend(next.iter().map(|(_, to, course)| (*to, *course)));
            let edges = next.into_iter().map(|(letter, to, course)| (letter, (to.index(), course)));
            search.graph.insert((state.index(), course), edges.collect());
        }
        search
    }

    /// Whether paths that end in `node` are asked for and seen, but not made.
    fn is_missing(&self, node: Node, method: Method) -> bool {
        self.is_asked(node) && !node.1.is_made(method, self.light, self.eye)
    }

    /// Whether paths that end in `node` are asked for and seen.
    fn is_asked(&self, (state, course): Node) -> bool {
        let asked = |tag: &LightTag| {
            let light = self.language.light_start(*tag);
            light.is_some_and(|light| !self.language.accepts(self.states[state], light).is_empty())
        };
        course.is_seen(self.light) && self.tags.iter().any(asked)
    }

    fn report(&self, method: Method, bounces: Option<u32>) -> Option<Unreachable> {
        let paths = self.examples(method, bounces);
        let first = paths.first()?;
        let why = why(method, self.light, first.is_empty());
        let makes_all = |other: &Method| {
            let missing = |node: &&Node| self.is_missing(**node, method);
            self.graph.keys().filter(missing).all(|node| node.1.is_made(*other, self.light, self.eye))
        };
        let others = [Method::Path, Method::Light, Method::Bidirectional, Method::Caustics, Method::Photon];
        let reached_by = others.into_iter().filter(makes_all).collect();
        let paths = paths.iter().map(|word| text(word)).collect();
        let shares = self.shares(method, bounces);
        Some(Unreachable { light: self.light, paths, why: why.to_owned(), reached_by, shares })
    }

    /// Counts words by their length: the automaton is deterministic, so that each word is one way through the graph.
    fn shares(&self, method: Method, bounces: Option<u32>) -> Vec<Share> {
        let start = (self.language.eye_start().index(), Course::default());
        let mut words = BTreeMap::from([(start, 1_u64)]);
        let longest = bounces.map_or(COUNTED_MAX, |most| most.min(COUNTED_MAX));
        let mut shares = Vec::new();
        for scatterings in 0..=longest {
            let count = |of: &dyn Fn(Node) -> bool| {
                words.iter().filter(|(node, _)| of(**node)).map(|(_, n)| n).sum::<u64>()
            };
            let (asked, unreachable) =
                (count(&|node| self.is_asked(node)), count(&|node| self.is_missing(node, method)));
            shares.push(Share { scatterings, asked, unreachable });
            let mut longer = BTreeMap::new();
            for (node, n) in &words {
                for (_, to) in &self.graph[node] {
                    *longer.entry(*to).or_insert(0) += n;
                }
            }
            words = longer;
        }
        shares
    }

    /// The shortest words that are missing, from the eye.
    fn examples(&self, method: Method, bounces: Option<u32>) -> Vec<Vec<Letter>> {
        let leading = self.leading_to_missing(method);
        let start = (self.language.eye_start().index(), Course::default());
        let mut found = Vec::new();
        let mut open = VecDeque::from([(start, Vec::new())]);
        let mut tried = 0;
        while let Some((node, word)) = open.pop_front()
            && found.len() < EXAMPLES_MAX
            && tried < TRIED_MAX
        {
            tried += 1;
            if bounces.is_none_or(|most| word.len() < most as usize) {
                for (letter, to) in self.graph[&node].iter().filter(|(_, to)| leading.contains(to)) {
                    open.push_back((*to, [&word[..], &[*letter]].concat()));
                }
            }
            if self.is_missing(node, method) {
                found.push(word);
            }
        }
        found
    }

    /// Nodes from which a missing path can be completed.
    fn leading_to_missing(&self, method: Method) -> BTreeSet<Node> {
        let mut leading: BTreeSet<Node> =
            self.graph.keys().copied().filter(|node| self.is_missing(*node, method)).collect();
        loop {
            let before = leading.len();
            for (node, edges) in &self.graph {
                if edges.iter().any(|(_, to)| leading.contains(to)) {
                    leading.insert(*node);
                }
            }
            if leading.len() == before {
                return leading;
            }
        }
    }
}

/// A word from the light to the eye.
fn text(word: &[Letter]) -> String {
    let letters = word.iter().rev().map(|letter| letter.symbol());
    format!("L{}E", letters.collect::<String>())
}

fn why(method: Method, light: LightKind, direct: bool) -> &'static str {
    match (method, light) {
        (Method::Path, _) => {
            "nothing hits a light without extent, and no next event joins it to an ideally specular surface"
        }
        (Method::Light, LightKind::Environment) if direct => {
            "light from infinitely far does not meet a camera of parallel rays by itself"
        }
        (Method::Light, _) => {
            "no light is joined to the lens from an ideally specular surface, or from a point"
        }
        (Method::Caustics, _) => {
            "ideally specular surfaces next to both eye and light leave nothing to join to the lens or to a light without extent"
        }
        (Method::Bidirectional, _) => {
            "ideally specular surfaces everywhere between eye and light leave no two vertices that can be joined"
        }
        (Method::Photon, _) => {
            "no surface on the way can hold photons, and nothing hits a light without extent"
        }
        (Method::Radiosity, _) => "only diffuse surfaces hold radiosity",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const METHODS: [Method; 5] =
        [Method::Path, Method::Light, Method::Bidirectional, Method::Caustics, Method::Photon];
    const KINDS: [LightKind; 3] = [LightKind::Surface, LightKind::Environment, LightKind::Punctual];
    const EYES: [EyeKind; 3] = [EyeKind::Lens, EyeKind::Pinhole, EyeKind::Parallel];
    const LONGEST: usize = 7;

    fn language(rules: &[&str]) -> Language {
        Language::compile(rules).unwrap()
    }

    fn around(light: LightKind, eye: EyeKind, letters: Letters) -> Surroundings {
        Surroundings { letters, lights: vec![(light, LightTag::UNNAMED)], eye }
    }

    /// Whether `t` vertices from the eye and `s` from the light make a path of these scatterings, by looking at its edge
    /// between them.
    fn makes((s, t): (usize, usize), word: &[Letter], light: LightKind, eye: EyeKind) -> bool {
        let rough = |vertex: usize| matches!(word[vertex - 1], Letter::Diffuse | Letter::Glossy);
        match (s, t) {
            (0, _) => light != LightKind::Punctual,
            (1, 1) => match light {
                LightKind::Surface => true,
                LightKind::Environment => eye != EyeKind::Parallel,
                LightKind::Punctual => false,
            },
            (1, t) => rough(t - 1),
            (_, 1) => rough(1),
            (_, t) => rough(t - 1) && rough(t),
        }
    }

    /// Every technique of every method, one by one.
    fn is_made(method: Method, word: &[Letter], light: LightKind, eye: EyeKind) -> bool {
        let vertices = word.len() + 2;
        let mut techniques = (1..=vertices).map(|t| (vertices - t, t));
        match method {
            Method::Path => techniques.any(|(s, t)| s <= 1 && t >= 2 && makes((s, t), word, light, eye)),
            Method::Light => techniques.any(|(s, t)| t == 1 && makes((s, t), word, light, eye)),
            Method::Bidirectional => techniques.any(|technique| makes(technique, word, light, eye)),
            Method::Caustics => {
                let casts = word.last().is_some_and(|letter| *letter != Letter::Diffuse);
                let used = |(s, t)| s <= 1 && t >= 2 || s >= 2 && t == 1 && casts;
                techniques.any(|technique| used(technique) && makes(technique, word, light, eye))
            }
            _ => {
                let gathers = word.iter().position(|letter| !letter.is_delta());
                let hits = makes((0, vertices), word, light, eye);
                // A next event or photons at the first rough surface.
                hits || gathers.is_some()
            }
        }
    }

    fn words(letters: Letters) -> Vec<Vec<Letter>> {
        let mut all = vec![Vec::new()];
        let mut from = 0;
        for _ in 0..LONGEST {
            let last = all.len();
            for i in from..last {
                let longer = letters.iter().map(|letter| [&all[i][..], &[letter]].concat());
                let longer: Vec<_> = longer.collect();
                all.extend(longer);
            }
            from = last;
        }
        all
    }

    #[test]
    fn what_is_reported_is_what_no_technique_makes() {
        let sets = [Letters::NATURAL, Letters::of(Letter::Diffuse).union(Letters::of(Letter::Specular))];
        let mut reports = 0;
        for expression in ["L(D|S)*E", "LS+DE", "L[D]S*E", "LDS_M+E", "LS_M+DS_M+E", "L.{1,3}E", "L(DS_M)*E"]
        {
            let language = language(&[expression]);
            for (light, eye, letters) in
                KINDS.iter().flat_map(|l| EYES.iter().flat_map(move |e| sets.map(|s| (*l, *e, s))))
            {
                let asked: Vec<Vec<Letter>> = (words(letters).into_iter())
                    .filter(|word| !language.accepts_word(LightTag::UNNAMED, word).is_empty())
                    .filter(|word| {
                        !(light == LightKind::Punctual && word.iter().all(|letter| letter.is_delta()))
                    })
                    .collect();
                for method in METHODS {
                    let missing: Vec<&Vec<Letter>> =
                        asked.iter().filter(|word| !is_made(method, word, light, eye)).collect();
                    let around = around(light, eye, letters);
                    let found = unreachable(&language, method, &around, Some(LONGEST as u32));
                    let what = format!("{expression} by {method:?} from {light:?} to {eye:?}");
                    let Some(report) = found.first() else {
                        assert!(missing.is_empty(), "{what}: {missing:?}");
                        continue;
                    };
                    reports += 1;
                    let shortest: Vec<String> = missing.iter().take(8).map(|word| text(word)).collect();
                    assert_eq!(report.paths, shortest, "{what}");
                    for Share { scatterings, asked: words, unreachable } in &report.shares {
                        let count = |all: &mut dyn Iterator<Item = &Vec<Letter>>| {
                            all.filter(|word| word.len() == *scatterings as usize).count() as u64
                        };
                        let counted = [count(&mut asked.iter()), count(&mut missing.iter().copied())];
                        assert_eq!([*words, *unreachable], counted, "{what}, {scatterings} scatterings");
                    }
                    assert_eq!(report.counts(), [missing.len() as u64, asked.len() as u64], "{what}");
                    for other in METHODS {
                        let makes_all = missing.iter().all(|word| is_made(other, word, light, eye));
                        assert_eq!(report.reached_by.contains(&other), makes_all, "{what} or {other:?}");
                    }
                }
            }
        }
        assert!(reports > 50, "{reports}");
    }

    #[test]
    fn a_mirrored_caustic_of_a_point_is_left_to_photons() {
        let around = around(LightKind::Punctual, EyeKind::Pinhole, Letters::NATURAL);
        let language = language(&["L(D|S)*E"]);
        let of = |method| unreachable(&language, method, &around, None);
        let [report] = &of(Method::Bidirectional)[..] else { panic!("{:?}", of(Method::Bidirectional)) };
        assert_eq!(report.paths[..2], ["LS_MDS_ME", "LS_MSS_ME"]);
        assert_eq!(report.reached_by, [Method::Photon]);
        let [report] = &of(Method::Path)[..] else { panic!("{:?}", of(Method::Path)) };
        assert_eq!(report.paths[..2], ["LS_MDE", "LS_MSE"]);
        assert!(of(Method::Photon).is_empty());
    }

    #[test]
    fn what_is_not_there_or_not_asked_for_is_not_missing() {
        let point = |letters| around(LightKind::Punctual, EyeKind::Pinhole, letters);
        let diffuse = Letters::of(Letter::Diffuse);
        let full = language(&["L(D|S)*E"]);
        assert!(unreachable(&full, Method::Path, &point(diffuse), None).is_empty());
        assert!(unreachable(&language(&["LD*E"]), Method::Path, &point(Letters::NATURAL), None).is_empty());
        assert!(unreachable(&full, Method::Path, &point(Letters::NATURAL), Some(1)).is_empty());
        assert!(!unreachable(&full, Method::Path, &point(Letters::NATURAL), Some(2)).is_empty());
        let named = language(&["L'sun'.*E", "LD*E"]);
        assert!(unreachable(&named, Method::Path, &point(Letters::NATURAL), None).is_empty());
    }

    #[test]
    fn gloss_taken_as_a_mirror_s_is_missing_where_it_was_joined() {
        let whitted = language(&["L[(D|S)(S_M|S_T)*]E"]);
        let gloss = Letters::of(Letter::Glossy).union(Letters::of(Letter::Diffuse));
        let around = around(LightKind::Punctual, EyeKind::Pinhole, gloss);
        assert!(unreachable(&whitted, Method::Path, &around, None).is_empty(), "next events do all of it");
        let report = unreachable(&whitted, Method::Light, &around, None);
        assert_eq!(report[0].paths[..2], ["LDS_TE", "LSS_TE"]);
    }
}
