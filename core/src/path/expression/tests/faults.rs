//! What is said about expressions that are none, and where.

use crate::path::expression::error::Fault;
use crate::path::expression::language::Language;

fn refused(text: &str) -> (usize, Fault) {
    match Language::compile(&[text]) {
        Err(error) => (error.at, error.fault),
        Ok(_) => panic!("'{text}' was taken"),
    }
}

#[test]
fn faults_point_at_their_character() {
    for (text, at, fault) in [
        ("", 0, Fault::Empty),
        (" \t ", 0, Fault::Empty),
        ("L(D|S*E", 1, Fault::Unclosed('(')),
        ("L(", 1, Fault::Unclosed('(')),
        ("L(D|", 4, Fault::Missing),
        ("L[D|SE", 1, Fault::Unclosed('[')),
        ("LD)E", 2, Fault::Unopened(')')),
        ("L(D]E", 3, Fault::Unopened(']')),
        ("L}E", 1, Fault::Unopened('}')),
        ("L()E", 2, Fault::Missing),
        ("L(D||S)E", 4, Fault::Missing),
        ("|LE", 0, Fault::Missing),
        ("LE|", 3, Fault::Missing),
        ("LxE", 1, Fault::UnknownLetter('x')),
        ("LédE", 1, Fault::UnknownLetter('é')),
        ("LédE", 1, Fault::UnknownLetter('é')),
        ("LS_GE", 1, Fault::UnknownSubscript),
        ("LS_", 1, Fault::UnknownSubscript),
        ("*LE", 0, Fault::NothingToRepeat('*')),
        ("L(+D)E", 2, Fault::NothingToRepeat('+')),
        ("LD{}E", 3, Fault::BadCounts),
        ("LD{,3}E", 3, Fault::BadCounts),
        ("LD{2;3}E", 4, Fault::BadCounts),
        ("LD{-1}E", 3, Fault::BadCounts),
        ("LD{2", 2, Fault::Unclosed('{')),
        ("LD{2,", 2, Fault::Unclosed('{')),
        ("LD{5,2}E", 2, Fault::CountsReversed),
        ("LD{65}E", 3, Fault::CountTooLarge(64)),
        ("LD{1,99999999999999999999}E", 5, Fault::CountTooLarge(64)),
        ("L'sunE", 1, Fault::Unclosed('\'')),
        ("L''E", 1, Fault::NoName),
    ] {
        assert_eq!(refused(text), (at, fault), "{text}");
    }
}

#[test]
fn every_word_goes_from_light_to_eye_or_back() {
    for (text, at, fault) in [
        ("D*", 0, Fault::NoBegin),
        ("DLE", 0, Fault::NoBegin),
        ("LD*", 3, Fault::NoEnd('E')),
        ("EDD", 3, Fault::NoEnd('L')),
        ("LDL", 2, Fault::Twice('L')),
        ("EDE", 2, Fault::Twice('E')),
        ("LEE", 2, Fault::AfterEnd),
        ("LED", 2, Fault::AfterEnd),
        ("LDEL", 3, Fault::AfterEnd),
        ("L*E", 0, Fault::Twice('L')),
        ("L?DE", 2, Fault::NoBegin),
        ("(LDE)?", 6, Fault::NoPath),
        ("(LDE)+", 1, Fault::AfterEnd),
        ("LDE|LD", 6, Fault::NoEnd('E')),
        ("LDE|SDE", 4, Fault::NoBegin),
        ("(L|E)D(L|E)", 7, Fault::Twice('L')),
        ("L{2}E", 0, Fault::Twice('L')),
        ("LDE?", 4, Fault::NoEnd('E')),
    ] {
        assert_eq!(refused(text), (at, fault), "{text}");
    }
}

#[test]
fn an_error_is_one_line_and_a_marked_one_shows_the_place() {
    let error = Language::compile(&["L(D|S)*E", "L (D|S"]).unwrap_err();
    assert_eq!(error.rule, 1);
    assert_eq!(error.to_string(), "character 3: this '(' is never closed");
    assert_eq!(error.marked(), "L (D|S\n  ^");
    let long = format!("L{}xE", "D".repeat(2000));
    let marked = Language::compile(&[&long]).unwrap_err().marked();
    let (shown, below) = marked.split_once('\n').unwrap();
    assert!(shown.chars().count() < 100, "{marked}");
    assert_eq!(shown.chars().nth(below.find('^').unwrap()), Some('x'), "{marked}");
}
