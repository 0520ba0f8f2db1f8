//! How many states, letters and scatterings a language has.

use crate::bsdf::event::{Letter, Letters};
use crate::path::expression::language::Language;
use crate::path::expression::presets::{PRESETS, preset, shown};
use crate::settings::Gloss;

fn language(rules: &[&str]) -> Language {
    Language::compile(rules).unwrap_or_else(|e| panic!("{e}"))
}

#[test]
fn automata_are_as_small_as_they_can_be() {
    // The state from which no word is completed is not counted.
    for (text, eye, light) in [
        ("L(D|S)*E", 1, 1),
        ("LD*E", 1, 1),
        ("L(D|S)E", 2, 2),
        ("L[D|S]S_M*E", 2, 2),
        ("L[D]S*E", 2, 2),
        ("LS+DE", 3, 3),
        ("L.{3}E", 4, 4),
        ("LS_M+DS_M+E", 4, 4),
        ("L((D*S)*D*)*E", 1, 1),
        ("L((D*S)*D)*S?E", 3, 3),
        ("LDDE|LDSE|LSDE|LSSE", 3, 3),
    ] {
        let language = language(&[text]);
        assert_eq!((language.eye_states(), language.light_states()), (eye, light), "{text}");
    }
}

#[test]
fn the_whole_equation_needs_no_following() {
    assert!(language(&["L(D|S)*E"]).is_everything());
    assert!(language(&["L.*E", "E(S|D)*L"]).is_everything());
    for rules in [&["LD*E"][..], &["L.*E", "LD*E"], &["L'a'.*E"], &["L.*E", "L'a'.*E"], &["L.+E"]] {
        assert!(!language(rules).is_everything(), "{rules:?}");
    }
}

#[test]
fn letters_on_no_word_are_not_needed() {
    let set = |letters: &[Letter]| letters.iter().fold(Letters::NONE, |s, l| s.union(Letters::of(*l)));
    for (text, letters) in [
        ("LE", &[][..]),
        ("LD*E", &[Letter::Diffuse]),
        ("L S{0} DE", &[Letter::Diffuse]),
        ("LS_ME", &[Letter::Specular]),
        ("LSE", &[Letter::Glossy, Letter::Specular]),
        ("L.E", &[Letter::Diffuse, Letter::Glossy, Letter::Specular]),
    ] {
        assert_eq!(language(&[text]).letters(), set(letters), "{text}");
    }
    assert_eq!(language(&["LDE", "LS_M?E"]).letters(), set(&[Letter::Diffuse, Letter::Specular]));
}

#[test]
fn shortest_and_longest_words_are_known() {
    for (text, shortest, longest) in [
        ("LE", 0, Some(0)),
        ("L(D|S)E", 1, Some(1)),
        ("L(D|S)*E", 0, None),
        ("LS+DE", 2, None),
        ("L.{3,9}E", 3, Some(9)),
        ("LDDE|L(DS){4}E", 2, Some(8)),
        ("L.{63}E", 63, Some(63)),
    ] {
        let language = language(&[text]);
        assert_eq!((language.shortest(), language.longest()), (shortest, longest), "{text}");
    }
}

#[test]
fn presets_are_found_by_name_and_shown_as_the_lecture_writes_them() {
    let names = PRESETS.map(|p| p.name);
    assert_eq!(names, ["phong", "whitted", "cook", "radiosity", "full"]);
    assert!(PRESETS.iter().all(|p| preset(p.name) == Some(p)));
    assert_eq!(preset("Phong"), None);
    let whitted = preset("whitted").unwrap();
    assert_eq!((whitted.gloss, shown(whitted.paths)), (Gloss::Mirror, "L[D|S]S_M*E"));
    assert_eq!(shown("LDDE"), "LDDE");
}
