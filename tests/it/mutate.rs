//! Scenes changed by chance are rendered or refused: a short run of the `mutate` program.

use ovtigre_core::gltf::{bundle::Bundle, limits::Limits, load::load};
use ovtigre_tests::mutate::{Mutator, Outcome, outcome};

#[test]
fn changed_scenes_are_rendered_or_refused() {
    let mutator = Mutator::new(7);
    let (mut rendered, mut refused) = (0, 0);
    for number in 0..600 {
        match outcome(mutator.file(number)) {
            Outcome::Rendered => rendered += 1,
            Outcome::Refused => refused += 1,
            other => panic!("file {number} of seed 7: {other:?}"),
        }
    }
    // Neither does every change go unnoticed nor does each spoil the scene.
    assert!(rendered > 100 && refused > 100, "{rendered} {refused}");
}

/// What is changed are scenes that can be read.
#[test]
fn the_corpus_renders() {
    for piece in ovtigre_tests::corpus::scenes() {
        let file = ovtigre_tests::glb::glb(piece.json.to_string().as_bytes(), &piece.binary);
        let warned = Bundle::open(&file[..])
            .and_then(|bundle| load(&bundle, &Limits::default()))
            .map(|loaded| loaded.warnings);
        assert!(matches!(&warned, Ok(list) if list.is_empty()), "{warned:?}");
        assert_eq!(outcome(file), Outcome::Rendered, "{}", piece.json);
    }
}
