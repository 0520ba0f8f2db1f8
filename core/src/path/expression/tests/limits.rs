//! Expressions from anyone: large, deep, or noise.

use crate::path::expression::error::Fault;
use crate::path::expression::language::{Language, RULES_MAX};

fn refused(rules: &[&str]) -> Fault {
    Language::compile(rules).expect_err("over a limit").fault
}

#[test]
fn long_and_deep_expressions_are_refused() {
    let deep = |n: usize| format!("L{}D{}E", "(".repeat(n), ")".repeat(n));
    assert!(Language::compile(&[&deep(64)]).is_ok());
    assert_eq!(refused(&[&deep(65)]), Fault::TooDeep(64));
    assert_eq!(refused(&[&format!("L{}", "[".repeat(4000))]), Fault::TooDeep(64));
    let long = |n: usize| format!("L{}E", " ".repeat(n - 2));
    assert!(Language::compile(&[&long(4096)]).is_ok());
    assert_eq!(refused(&[&long(4097)]), Fault::TooLong(4096));
}

#[test]
fn expressions_that_need_many_states_are_refused_soon() {
    assert!(Language::compile(&["L.{63}E"]).is_ok());
    assert_eq!(refused(&["L.{64}E"]), Fault::TooManyStates(64));
    // 2^11 sets of states: which of the last letters from the eye were D.
    assert_eq!(refused(&["L.{10}D.*E"]), Fault::TooManyStates(1024));
    assert_eq!(refused(&["E.*D.{10}L"]), Fault::TooManyStates(1024));
    let nested = |inner: &str| format!("L{}{inner}{}E", "(".repeat(20), "){64}".repeat(20));
    for inner in ["D", "D{0}", "D*", "[D]"] {
        assert_eq!(refused(&[&nested(inner)]), Fault::TooManyStates(4096), "{inner}");
    }
    let error = Language::compile(&["LDE", "L.{10}D.*E", "LE"]).unwrap_err();
    assert_eq!(error.rule, 1, "the one that needs most is named");
}

#[test]
fn there_are_at_most_as_many_rules_and_names_as_a_set_holds() {
    let all = [""; RULES_MAX].map(|_| "LDE");
    assert_eq!(Language::compile(&all).unwrap().rules(), RULES_MAX);
    let more: Vec<&str> = all.iter().copied().chain(["LE"]).collect();
    assert_eq!(refused(&more), Fault::TooManyRules(RULES_MAX));
    let lights: Vec<String> = (1..RULES_MAX).map(|n| format!("L'lamp {n}'.*E")).collect();
    let rules: Vec<&str> = ["L.*E"].into_iter().chain(lights.iter().map(String::as_str)).collect();
    let language = Language::compile(&rules).unwrap();
    assert_eq!((language.eye_states(), language.light_names().len()), (1, RULES_MAX - 1));
    let names = |n: usize| (0..n).map(|i| format!("L'{i}'E")).collect::<Vec<_>>().join("|");
    assert!(Language::compile(&[&names(32)]).is_ok());
    assert_eq!(refused(&[&names(33)]), Fault::TooManyNames(32));
    assert_eq!(refused(&[]), Fault::Empty);
}

#[test]
fn a_series_of_bounces_and_lights_fits() {
    let bounces: Vec<String> = (0..31).map(|k| format!("L.{{{k}}}E")).collect();
    let rules: Vec<&str> = ["L.*E"].into_iter().chain(bounces.iter().map(String::as_str)).collect();
    assert_eq!(Language::compile(&rules).unwrap().eye_states(), 32);
}

/// Noise of the characters that expressions are made of is taken or refused, at a place that exists.
#[test]
fn noise_is_refused_without_harm() {
    let alphabet: Vec<char> = "LLEEDDS_MT.()[]|*+?{}0123,' é\u{0}x".chars().collect();
    let mut state = 7_u64;
    let mut random = |below: usize| {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (state >> 33) as usize % below
    };
    let mut taken = 0;
    for _ in 0..20_000 {
        let length = random(16);
        let inside: String = (0..length).map(|_| alphabet[random(alphabet.len())]).collect();
        for text in [inside.clone(), format!("L{inside}E")] {
            match Language::compile(&[&text]) {
                Ok(language) => {
                    taken += 1;
                    assert!(language.eye_states() >= 1);
                    assert!(language.longest().is_none_or(|longest| longest >= language.shortest()));
                }
                Err(error) => {
                    assert!(error.at <= text.chars().count(), "{text:?}: {error:?}");
                    assert!(error.marked().lines().count() == 2, "{text:?}: {error:?}");
                }
            }
        }
    }
    assert!(taken > 100, "{taken}");
}
