//! Rays aimed at edges and vertices of closed meshes.

use super::{
    case::{Case, Trial},
    finding::Finding,
    geometry::strips,
    random::Random,
};
use crate::scenes::{cuboid, sphere};
use glam::{Affine3A, EulerRot, Quat, Vec3};
use ovtigre_core::trace::{aggregate::Aggregate, instance::Placement, mesh::MeshTree, ray::Ray};

/// A closed mesh that the origin sees all of.
type Body = (Vec<Vec3>, Vec<[u32; 3]>);

/// Rays of each trial at the full budget: ten million of all together.
const RAYS: u64 = 850_000;

/// A name and what makes it.
type Shape = (&'static str, fn() -> Body);

/// The only one.
pub fn cases() -> Vec<Case> {
    let bodies: [Shape; 3] = [
        ("cube", || cuboid(Vec3::splat(-1.0), Vec3::ONE)),
        ("sphere of 4,512 triangles", || sphere(Vec3::ZERO, 1.0, 48)),
        ("box of slivers", strips),
    ];
    let mut trials = Vec::new();
    for (name, body) in bodies {
        for (place, of) in [
            ("", Vec3::ZERO),
            (", turned", Vec3::ZERO),
            (", turned, at (3, −20, 0.7)", Vec3::new(3.0, -20.0, 0.7)),
            (", turned, at (1000, −900, 800)", Vec3::new(1e3, -9e2, 8e2)),
        ] {
            let turn = if place.is_empty() {
                Quat::IDENTITY
            } else {
                Quat::from_euler(EulerRot::XYZ, 0.3, 1.1, -0.7)
            };
            trials.push(Trial::new(format!("{name}{place}"), move |budget| {
                let rays = budget.of(RAYS, 10_000);
                Finding::bound(0.0, leaks(body(), turn, of, rays) as f64, rays)
            }));
        }
    }
    vec![Case {
        group: "Edges and vertices",
        name: "rays from within, aimed at edges and vertices".to_owned(),
        stresses: "the watertight triangle test, the boxes of the tree, and rays whose every sign is zero",
        known: "a closed mesh lets no ray out: 0 that meet nothing".to_owned(),
        note: "",
        trials,
    }]
}

/// Rays that get out. Half of them are aimed at a place on an edge, the others at a vertex.
fn leaks((positions, triangles): Body, turn: Quat, shift: Vec3, rays: u64) -> u64 {
    let positions: Vec<Vec3> = positions.iter().map(|p| turn * *p + shift).collect();
    let tree = MeshTree::build(&positions, &triangles).expect("a mesh");
    let placed = Aggregate::build(vec![tree], &[Placement { mesh: 0, to_world: Affine3A::IDENTITY }]);
    let placed = placed.expect("one mesh at one place");
    let mut random = Random(1);
    let mut out = 0;
    for i in 0..rays {
        let [a, b, _] = triangles[random.below(triangles.len())].map(|v| positions[v as usize]);
        let target = if i % 2 == 0 { a + (b - a) * random.uniform() } else { a };
        let origin = if i % 4 < 2 { shift } else { shift + random.in_cube() * 0.5 };
        out += u64::from(!placed.occluded(&Ray::new(origin, target - origin), |_| true));
    }
    out
}
