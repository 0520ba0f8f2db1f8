//! Automata against the plain matcher: every word, every place to join two subpaths.

use super::matcher::{Token, matches};
use crate::bsdf::event::{Letter, Letters};
use crate::path::expression::language::{Language, LightTag, Rules};
use crate::path::expression::parse::parse;
use crate::path::expression::presets::PRESETS;
use crate::path::expression::syntax::Node;

/// Longest words of natural letters that are tried.
const LONGEST: usize = 7;
/// Longest words of all letters that are tried.
const LONGEST_OF_ALL: usize = 5;

/// Names that lights go by in the tests: none, one, two.
const LIGHTS: [&[&str]; 4] = [&[], &["sun"], &["lamp", "brass"], &["sun", "lamp"]];

/// Words of letters up to a length, from the eye to the light.
fn words(letters: Letters, longest: usize) -> Vec<Vec<Letter>> {
    let mut all = vec![Vec::new()];
    let mut longer = 0..1;
    for _ in 0..longest {
        let words = all[longer.clone()].to_vec();
        let next = words.iter().flat_map(|word| letters.iter().map(|letter| [&word[..], &[letter]].concat()));
        longer = all.len()..all.len();
        all.extend(next);
        longer.end = all.len();
    }
    all
}

/// All words of natural letters, and the shorter ones of all.
fn words_up_to(longest: usize) -> Vec<Vec<Letter>> {
    let of_all = words(Letters::ALL, longest.min(LONGEST_OF_ALL));
    let twins = of_all.into_iter().filter(|word| word.contains(&Letter::Mirrored));
    words(Letters::NATURAL, longest).into_iter().chain(twins).collect()
}

fn judged(trees: &[Node], light: &[&str], word: &[Letter]) -> Vec<usize> {
    let mut tokens = vec![Token::Eye];
    tokens.extend(word.iter().map(|letter| Token::Scattering(*letter)));
    tokens.push(Token::Light(light));
    (0..trees.len()).filter(|rule| matches(&trees[*rule], &tokens)).collect()
}

/// What joining the first `eye` letters from the eye with the others from the light says.
fn joined(language: &Language, tag: LightTag, word: &[Letter], eye: usize) -> Rules {
    let from_eye =
        word[..eye].iter().try_fold(language.eye_start(), |state, letter| language.eye_next(state, *letter));
    let mut from_light = language.light_start(tag);
    for letter in word[eye..].iter().rev() {
        from_light = from_light.and_then(|state| language.light_next(state, *letter));
    }
    match (from_eye, from_light) {
        (Some(eye), Some(light)) => language.accepts(eye, light),
        _ => Rules::NONE,
    }
}

/// Compares all words and splits; the number of words that some rule takes.
fn compare(rules: &[&str], lights: &[&[&str]], longest: usize) -> usize {
    let language = Language::compile(rules).unwrap_or_else(|e| panic!("{e}"));
    let trees: Vec<Node> = rules.iter().map(|text| parse(text).unwrap()).collect();
    let mut taken = 0;
    for light in lights {
        let tag = language.tag_of(light);
        for word in words_up_to(longest) {
            let judged = judged(&trees, light, &word);
            taken += usize::from(!judged.is_empty());
            for eye in 0..=word.len() {
                let found: Vec<usize> = joined(&language, tag, &word, eye).iter().collect();
                assert_eq!(found, judged, "{rules:?}: {word:?} from {light:?}, joined after {eye}");
            }
            assert_eq!(language.accepts_word(tag, &word).iter().collect::<Vec<_>>(), judged);
        }
    }
    taken
}

#[test]
fn single_expressions_take_the_words_that_a_plain_matcher_takes() {
    let expressions = [
        ("LE", 1),
        ("LS+DE", 126),
        ("E.*L", 3280),
        ("L.{3}E", 27),
        ("LS_M+DS_M*E", 21),
        ("L(DS)*E", 15),
        ("LDE | E S_M D L", 2),
        ("(LD | L)E", 2),
        ("L(D{2,}|S{1,2})?[S_M]E", 0),
        ("L[D[S[D]]]E", 0),
        ("(L.?E|EDDL)", 0),
        ("L(S_M|D(D|S_T)*)+E", 0),
        ("L((D*S)*D)*E", 0),
        ("L D{0} S{0,3} E", 15),
    ];
    for (text, count) in expressions {
        let taken = compare(&[text], &[&[]], LONGEST);
        assert!(taken > 0, "{text}");
        if count > 0 {
            assert_eq!(taken, count, "{text}");
        }
    }
}

#[test]
fn presets_take_the_words_that_a_plain_matcher_takes() {
    for preset in PRESETS {
        assert!(compare(&[preset.paths], &[&[]], LONGEST) > 0, "{}", preset.name);
        assert!(compare(&[preset.shown], &[&[]], 4) > 0, "{}", preset.name);
    }
}

#[test]
fn without_gloss_the_whitted_preset_is_the_lecture_s_expression() {
    let preset = PRESETS.iter().find(|p| p.name == "whitted").unwrap();
    let [shown, paths] = [preset.shown, preset.paths].map(|text| Language::compile(&[text]).unwrap());
    for word in words(Letters::NATURAL, LONGEST) {
        let [a, b] = [&shown, &paths].map(|language| language.accepts_word(LightTag::UNNAMED, &word));
        assert_eq!(a, b, "{word:?}");
    }
}

#[test]
fn a_picture_and_its_layers_are_followed_at_once() {
    let rules = ["L(D|S)*E", "LE", "LDE", "L.{2}E", "LS+DE", "LDS_ME", "ED.*L"];
    assert!(compare(&rules, &[&[]], 6) > 0);
    let disjoint = ["LDE", "L.{2}E", "LS_M*E"];
    assert!(compare(&disjoint, &[&[]], 6) > 0);
}

#[test]
fn lights_are_told_apart_by_their_names() {
    let rules = ["L.*E", "L'sun'D*E", "L'lamp'.{2}E", "E(S*L|.L'brass')", "L'lamp'DE|L'sun'SE"];
    assert!(compare(&rules, &LIGHTS, 5) > 0);
    assert!(compare(&["L'sun'D*E"], &LIGHTS, 6) > 0);
    let language = Language::compile(&["L'sun'D*E"]).unwrap();
    assert_eq!(language.light_start(LightTag::UNNAMED), None, "no path from another light");
    assert_eq!(language.light_names(), ["sun"]);
}

#[test]
fn a_name_may_hold_quotes_and_spaces() {
    let language = Language::compile(&["L'Bob''s  lamp'E"]).unwrap();
    assert_eq!(language.light_names(), ["Bob's  lamp"]);
    assert_ne!(language.tag_of(&["x", "Bob's  lamp"]), LightTag::UNNAMED);
}

#[test]
fn a_dead_state_is_one_from_which_no_word_is_completed() {
    let rules = ["LS+DE", "L'sun'D{1,3}E"];
    let language = Language::compile(&rules).unwrap();
    let takes = |tag, word: &[Letter]| !language.accepts_word(tag, word).is_empty();
    let tags = [&[][..], &["sun"]].map(|names| language.tag_of(names));
    for word in words(Letters::NATURAL, 4) {
        let state = word.iter().try_fold(language.eye_start(), |s, letter| language.eye_next(s, *letter));
        let completed = words(Letters::NATURAL, 3)
            .iter()
            .any(|rest| tags.iter().any(|tag| takes(*tag, &[&word[..], rest].concat())));
        assert_eq!(state.is_some(), completed, "{word:?}");
    }
    for tag in tags {
        for word in words(Letters::NATURAL, 4) {
            let state = word.iter().rev().fold(language.light_start(tag), |state, letter| {
                state.and_then(|state| language.light_next(state, *letter))
            });
            let completed =
                words(Letters::NATURAL, 3).iter().any(|rest| takes(tag, &[&rest[..], &word].concat()));
            assert_eq!(state.is_some(), completed, "{word:?} from the light");
        }
    }
}
