//! Where motion is cut into straight pieces.

use crate::gltf::accessor::Source;
use crate::gltf::animation::Animation;
use crate::gltf::curve::{Interpolation, Side};
use crate::gltf::error::{LoadError, Problems};
use crate::gltf::nodes::{Instant, Pose, Tree};
use crate::gltf::probes::Probes;
use crate::gltf::shapes::{Morphs, Shape, Skins};
use crate::gltf::stage::Stage;
use crate::scene::knots::Knots;
use glam::DVec3;

/// Pieces are cut until the motion strays from them by at most this share of the scene's radius: an eighth of a pixel
/// where the scene fills a picture of 1000.
const TOLERANCE: f64 = 1.0 / 4096.0;

/// Most pieces.
const PIECES: usize = 64;

/// Nodes and joints that move, times pieces; and triangles that change their shape, times pieces. Each of the first
/// takes 100 to 200 bytes, each of the second about 400.
const MOVERS: usize = 1 << 22;
const DEFORMING: usize = 1 << 24;

/// Times of key frames looked at in one piece: a choice of those that there are.
const LOOKED_AT: usize = 8;

/// Shortest piece, as a share of the shutter's time.
const SHORTEST: f64 = 1e-5;

/// A time at which a piece may end.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Break {
    time: f64,
    /// Whether something may jump there.
    jump: bool,
}

/// A pose and where the probes are in it.
struct Sample {
    pose: Pose,
    points: Vec<DVec3>,
}

/// A stretch of time between two samples.
struct Piece {
    ends: [usize; 2],
    /// How far the probes stray from straight lines.
    strays: f64,
    /// Where they stray farthest.
    at: Break,
}

struct Cutter<'a, 'b> {
    tree: &'a Tree<'b>,
    animation: &'a Animation<'b>,
    probes: Probes<'a>,
    breaks: Vec<Break>,
    shortest: f64,
    samples: Vec<Sample>,
}

/// The stage for a shutter that is open from the first to the second of `times`: pieces of motion, cut first where
/// straight lines stray most from it.
pub(crate) fn stage<'a>(
    source: Source<'_>,
    tree: &'a Tree<'a>,
    animation: &Animation<'_>,
    shapes: &[Shape],
    skins: &Skins,
    times: [f64; 2],
    problems: &mut Problems,
) -> Result<Stage<'a>, LoadError> {
    let opening = tree.pose(animation, Instant { time: times[0], side: Side::After })?;
    let morphs = shapes.iter().any(|shape| shape.morphs == Morphs::Yes);
    if tree.movers.is_empty() && !morphs {
        return Ok(Stage::new(tree, skins, Knots::STILL, vec![opening]));
    }
    let closing = tree.pose(animation, Instant { time: times[1], side: Side::Before })?;
    let probes = Probes::new(tree, animation, shapes, skins, [&opening, &closing]);
    let tolerance = TOLERANCE * probes.radius;
    let shortest = SHORTEST * (times[1] - times[0]);
    let breaks = breaks(animation, tree, times);
    let mut cutter = Cutter { tree, animation, probes, breaks, shortest, samples: Vec::new() };
    let ends = [
        cutter.sample(Instant { time: times[0], side: Side::After })?,
        cutter.sample(Instant { time: times[1], side: Side::Before })?,
    ];
    let mut pieces = vec![cutter.piece(ends)?];
    let most = most_pieces(source, tree, shapes, skins)?;
    loop {
        let worst = (0..pieces.len()).fold(0, |w, i| if pieces[i].strays > pieces[w].strays { i } else { w });
        let strays = pieces[worst].strays;
        if strays <= tolerance {
            break;
        }
        if pieces.len() >= most {
            let detail = format!(
                "motion is followed in {} straight pieces and strays from them by up to {strays:.2e} m",
                pieces.len()
            );
            problems.add("/animations", detail);
            break;
        }
        let [first, second] = cutter.cut(&pieces[worst])?;
        pieces.splice(worst..=worst, [first, second]);
    }
    let (knots, poses) = join(&pieces, cutter.samples, times);
    Ok(Stage::new(tree, skins, knots, poses))
}

/// Pieces that memory and time allow for.
fn most_pieces(
    source: Source<'_>,
    tree: &Tree<'_>,
    shapes: &[Shape],
    skins: &Skins,
) -> Result<usize, LoadError> {
    let mut morphed = 0_u64;
    for shape in shapes.iter().filter(|shape| shape.morphs == Morphs::Yes) {
        for primitive in source.document.item("meshes", shape.mesh)?.items("primitives")? {
            morphed = morphed.saturating_add(shape.morphed_vertices(&primitive, source)?);
        }
    }
    let joints: usize =
        skins.values().filter(|skin| skin.moves(tree)).map(crate::gltf::skin::Skin::len).sum();
    let deforms = |shape: &&Shape| {
        shape.morphs == Morphs::Yes || shape.skin.is_some_and(|skin| skins[&skin].moves(tree))
    };
    let triangles: usize =
        shapes.iter().filter(deforms).flat_map(|s| &s.geometries).map(|g| g.triangles.len()).sum();
    let allowed = (MOVERS / (tree.movers.len() + joints).max(1)).min(DEFORMING / triangles.max(1));
    let in_time = source.limits.morphed_vertices / morphed.max(1);
    Ok(allowed.min(in_time as usize).clamp(1, PIECES))
}

/// Times between the shutter's opening and its close at which a key frame of something that moves lies.
fn breaks(animation: &Animation<'_>, tree: &Tree<'_>, [open, close]: [f64; 2]) -> Vec<Break> {
    let mut breaks = Vec::new();
    for channels in tree.nodes.iter().filter_map(|node| animation.channels(node.index)) {
        for curve in channels.transforms().chain(&channels.weights) {
            if curve.is_still(open, close) {
                continue;
            }
            let jump = curve.interpolation == Interpolation::Step;
            let keys = curve.between(open, close);
            breaks.extend(keys.map(|time| Break { time, jump }));
        }
        // Many channels share their times: what is double goes before it fills memory.
        if breaks.len() > 1 << 16 {
            tidy(&mut breaks);
        }
    }
    tidy(&mut breaks);
    breaks
}

/// Sorts, and makes one of those at the same time.
fn tidy(breaks: &mut Vec<Break>) {
    breaks.sort_unstable_by(|a, b| a.time.total_cmp(&b.time));
    breaks.dedup_by(|later, first| {
        let same = later.time.total_cmp(&first.time).is_eq();
        first.jump |= same && later.jump;
        same
    });
}

impl Cutter<'_, '_> {
    fn sample(&mut self, instant: Instant) -> Result<usize, LoadError> {
        let pose = self.tree.pose(self.animation, instant)?;
        let points = self.probes.points(self.tree, self.animation, &pose);
        self.samples.push(Sample { pose, points });
        Ok(self.samples.len() - 1)
    }

    /// Looks at a piece: at its quarters, and at key frames in it.
    fn piece(&self, ends: [usize; 2]) -> Result<Piece, LoadError> {
        let [start, end] = ends.map(|i| self.samples[i].pose.instant.time);
        let smooth = |share: f64| Break { time: start + share * (end - start), jump: false };
        let mut piece = Piece { ends, strays: 0.0, at: smooth(0.5) };
        let inside = self.breaks.partition_point(|b| b.time <= start + self.shortest)
            ..self.breaks.partition_point(|b| b.time < end - self.shortest);
        let keys = self.breaks.get(inside).unwrap_or_default();
        let step = keys.len().div_ceil(LOOKED_AT).max(1);
        let quarters = if end - start > 4.0 * self.shortest { &[0.5, 0.25, 0.75][..] } else { &[] };
        let looked_at = keys.iter().copied().skip(step / 2).step_by(step);
        for at in looked_at.chain(quarters.iter().map(|&share| smooth(share))) {
            let sides: &[Side] = if at.jump { &[Side::Before, Side::After] } else { &[Side::After] };
            for &side in sides {
                let strays = self.strays(&piece, Instant { time: at.time, side })?;
                if strays > piece.strays {
                    (piece.strays, piece.at) = (strays, at);
                }
            }
        }
        Ok(piece)
    }

    /// How far the probes are from the straight lines of a piece.
    fn strays(&self, piece: &Piece, instant: Instant) -> Result<f64, LoadError> {
        let [start, end] = piece.ends.map(|i| &self.samples[i]);
        let (from, to) = (start.pose.instant.time, end.pose.instant.time);
        let share = (instant.time - from) / (to - from);
        let pose = self.tree.pose(self.animation, instant)?;
        let points = self.probes.points(self.tree, self.animation, &pose);
        let lines = start.points.iter().zip(&end.points).map(|(a, b)| *a * (1.0 - share) + *b * share);
        Ok(lines.zip(points).map(|(line, point)| (line - point).length()).fold(0.0, f64::max))
    }

    /// The two pieces on either side of where a piece strays most.
    fn cut(&mut self, piece: &Piece) -> Result<[Piece; 2], LoadError> {
        let ([start, end], Break { time, jump }) = (piece.ends, piece.at);
        let before = self.sample(Instant { time, side: if jump { Side::Before } else { Side::After } })?;
        let after = if jump { self.sample(Instant { time, side: Side::After })? } else { before };
        Ok([self.piece([start, before])?, self.piece([after, end])?])
    }
}

/// The knots between pieces in the order of time, and their poses. A jump has two.
fn join(pieces: &[Piece], samples: Vec<Sample>, [open, close]: [f64; 2]) -> (Knots, Vec<Pose>) {
    let mut order: Vec<usize> = pieces.iter().flat_map(|piece| piece.ends).collect();
    order.dedup();
    let mut samples: Vec<Option<Sample>> = samples.into_iter().map(Some).collect();
    let poses: Vec<Pose> =
        order.iter().filter_map(|&i| samples[i].take()).map(|sample| sample.pose).collect();
    let mut shares: Vec<f32> =
        poses.iter().map(|pose| ((pose.instant.time - open) / (close - open)) as f32).collect();
    let last = shares.len() - 1;
    (shares[0], shares[last]) = (0.0, 1.0);
    (Knots::new(shares), poses)
}
