//! Million rays a second on one thread: primary, diffuse-bounce and shadow rays on three generated scenes.
//!
//! Times are those of the processor, not of the clock on the wall, so that other work on the machine counts less.

use criterion::measurement::{Measurement, ValueFormatter, WallTime};
use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use glam::{Affine3A, EulerRot, Quat, Vec3};
use ovtigre_core::math::frame::Frame;
use ovtigre_core::trace::aggregate::Aggregate;
use ovtigre_core::trace::instance::Placement;
use ovtigre_core::trace::mesh::MeshTree;
use ovtigre_core::trace::ray::Ray;
use ovtigre_core::trace::surface_point::SurfacePoint;
use std::f32::consts::{PI, TAU};
use std::hint::black_box;
use std::time::Duration;

/// Pixels on each side of the frame.
const FRAME: usize = 512;

/// Time that this thread spent on a processor; Linux alone tells it without further crates.
struct ThreadTime(WallTime);

impl ThreadTime {
    fn nanoseconds() -> u64 {
        let statistics =
            std::fs::read_to_string("/proc/thread-self/schedstat").expect("Linux, with /proc mounted");
        statistics.split(' ').next().and_then(|first| first.parse().ok()).expect("a number comes first")
    }
}

impl Measurement for ThreadTime {
    type Intermediate = u64;
    type Value = Duration;

    fn start(&self) -> u64 {
        Self::nanoseconds()
    }
    fn end(&self, start: u64) -> Duration {
        Duration::from_nanos(Self::nanoseconds() - start)
    }
    fn add(&self, a: &Duration, b: &Duration) -> Duration {
        *a + *b
    }
    fn zero(&self) -> Duration {
        Duration::ZERO
    }
    fn to_f64(&self, value: &Duration) -> f64 {
        value.as_nanos() as f64
    }
    fn formatter(&self) -> &dyn ValueFormatter {
        self.0.formatter()
    }
}

/// Numbers that look random (`SplitMix64`).
struct Random(u64);

impl Random {
    fn uniform(&mut self) -> f32 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 40) as f32 / (1 << 24) as f32
    }

    fn cosine(&mut self, normal: Vec3) -> Vec3 {
        let (u, angle) = (self.uniform(), self.uniform() * TAU);
        let radius = u.sqrt();
        let frame = Frame::around(normal);
        let (sin, cos) = libm::sincosf(angle);
        frame.x * (radius * cos) + frame.y * (radius * sin) + normal * (1.0 - u).sqrt()
    }
}

/// Vertices and triangles.
#[derive(Default)]
struct Mesh {
    positions: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
}

impl Mesh {
    /// A sheet of `n` × `m` quads through `at`, which maps the unit square.
    fn sheet(n: u32, m: u32, at: impl Fn(f32, f32) -> Vec3) -> Self {
        let mut mesh = Self::default();
        for j in 0..=m {
            mesh.positions.extend((0..=n).map(|i| at(i as f32 / n as f32, j as f32 / m as f32)));
        }
        for j in 0..m {
            for i in 0..n {
                let k = j * (n + 1) + i;
                mesh.triangles.extend([[k, k + 1, k + n + 2], [k, k + n + 2, k + n + 1]]);
            }
        }
        mesh
    }

    fn sphere(n: u32) -> Self {
        Self::sheet(2 * n, n, |u, v| {
            let ((sin, cos), (up, height)) = (libm::sincosf(u * TAU), libm::sincosf(v * PI));
            Vec3::new(cos * up, height, sin * up)
        })
    }

    fn torus(n: u32) -> Self {
        Self::sheet(2 * n, n, |u, v| {
            let ((sin, cos), (y, x)) = (libm::sincosf(u * TAU), libm::sincosf(v * TAU));
            Vec3::new(cos * (1.0 + 0.35 * x), 0.35 * y, sin * (1.0 + 0.35 * x))
        })
    }

    fn cuboid() -> Self {
        let positions =
            (0..8).map(|i| Vec3::new((i & 1) as f32, (i >> 1 & 1) as f32, (i >> 2) as f32)).collect();
        let faces = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]];
        let triangles = faces.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]).collect();
        Self { positions, triangles }
    }

    fn add(&mut self, other: &Mesh, to_world: Affine3A) {
        let base = self.positions.len() as u32;
        self.positions.extend(other.positions.iter().map(|p| to_world.transform_point3(*p)));
        self.triangles.extend(other.triangles.iter().map(|t| t.map(|v| v + base)));
    }
}

/// A scene, its camera and where its light is.
struct Scene {
    name: &'static str,
    meshes: Vec<Mesh>,
    placements: Vec<Placement>,
    placed: Aggregate,
    eye: Vec3,
    target: Vec3,
    /// Corner and edges of the light.
    light: [Vec3; 3],
}

impl Scene {
    fn new(
        name: &'static str,
        meshes: Vec<Mesh>,
        placements: Vec<Placement>,
        [eye, target]: [Vec3; 2],
        light: [Vec3; 3],
    ) -> Self {
        let trees = meshes.iter().map(|m| MeshTree::build(&m.positions, &m.triangles).expect("a good mesh"));
        let placed = Aggregate::build(trees.collect(), &placements).expect("good placements");
        Self { name, meshes, placements, placed, eye, target, light }
    }

    fn primary(&self) -> Vec<Ray> {
        let frame =
            Frame::with_tangent((self.eye - self.target).normalize(), Vec3::Y.cross(self.eye - self.target));
        let mut random = Random(1);
        let mut at = |i: usize| (i as f32 + random.uniform()) / FRAME as f32 * 2.0 - 1.0;
        (0..FRAME * FRAME)
            .map(|i| {
                let (x, y) = (at(i % FRAME), at(i / FRAME));
                Ray::new(self.eye, (frame.x * x * 0.6 - frame.y * y * 0.6 - frame.z).normalize())
            })
            .collect()
    }

    /// Where rays hit, facing their origins.
    fn points(&self, rays: &[Ray]) -> Vec<SurfacePoint> {
        let hits = rays.iter().filter_map(|ray| Some((ray, self.placed.closest(ray, |_| true)?)));
        hits.map(|(ray, hit)| {
            let mesh = &self.meshes[self.placements[hit.instance as usize].mesh as usize];
            let vertices = mesh.triangles[hit.triangle as usize].map(|v| mesh.positions[v as usize]);
            let moved = self.placed.instances()[hit.instance as usize].moved.as_ref();
            let mut point = SurfacePoint::new(vertices, hit.barycentric, moved);
            if point.normal.dot(ray.direction) > 0.0 {
                point.normal = -point.normal;
            }
            point
        })
        .collect()
    }
}

/// A furnished room: large walls beside small triangles; under 100,000 triangles.
fn interior() -> Scene {
    let mut mesh = Mesh::default();
    let put = |scale: Vec3, turn: f32, at: Vec3| {
        Affine3A::from_scale_rotation_translation(scale, Quat::from_rotation_y(turn), at)
    };
    let (cuboid, sphere, torus) = (Mesh::cuboid(), Mesh::sphere(28), Mesh::torus(24));
    mesh.add(&cuboid, put(Vec3::new(8.0, 3.0, 6.0), 0.0, Vec3::ZERO));
    let mut random = Random(2);
    for _ in 0..14 {
        let (turn, at) =
            (random.uniform() * TAU, Vec3::new(0.5 + random.uniform() * 6.5, 0.0, random.uniform() * 5.0));
        mesh.add(&cuboid, put(Vec3::new(0.9, 0.04, 0.6), turn, at + Vec3::Y * 0.7));
        for leg in 0..4 {
            let corner = Quat::from_rotation_y(turn)
                * Vec3::new((leg & 1) as f32 * 0.85, 0.0, (leg >> 1) as f32 * 0.55);
            mesh.add(&cuboid, put(Vec3::new(0.05, 0.7, 0.05), turn, at + corner));
        }
        let top = at + Quat::from_rotation_y(turn) * Vec3::new(0.45, 0.74, 0.3);
        let size = 0.06 + random.uniform() * 0.1;
        mesh.add(&sphere, put(Vec3::splat(size), turn, top + Vec3::new(0.1, size, 0.0)));
        mesh.add(&torus, put(Vec3::splat(0.12), turn, top + Vec3::new(-0.15, 0.05, 0.1)));
    }
    let curtain =
        Mesh::sheet(120, 40, |u, v| Vec3::new(0.1 + 0.05 * libm::sinf(u * 60.0), v * 2.6, 0.5 + u * 5.0));
    mesh.add(&curtain, Affine3A::IDENTITY);
    let light = [Vec3::new(3.0, 2.9, 2.0), Vec3::X * 2.0, Vec3::Z * 2.0];
    let view = [Vec3::new(7.7, 1.7, 5.7), Vec3::new(2.0, 0.7, 1.5)];
    Scene::new("interior", vec![mesh], vec![Placement { mesh: 0, to_world: Affine3A::IDENTITY }], view, light)
}

/// A hilly landscape of a million triangles.
fn terrain() -> Scene {
    let height = |x: f32, z: f32| {
        let octave = |k: f32| libm::sinf(x * 3.1 * k + k) * libm::sinf(z * 2.7 * k + 2.0 * k + x * k) / k;
        [1.0, 2.3, 4.9, 11.0, 23.0, 47.0, 101.0].into_iter().map(octave).sum::<f32>() * 0.5
    };
    let mesh = Mesh::sheet(708, 708, |u, v| Vec3::new(u * 10.0, height(u * 3.0, v * 3.0), v * 10.0));
    let light = [Vec3::new(2.0, 8.0, 2.0), Vec3::X * 3.0, Vec3::Z * 3.0];
    let view = [Vec3::new(5.0, 3.5, 10.5), Vec3::new(5.0, 0.0, 4.0)];
    Scene::new("terrain", vec![mesh], vec![Placement { mesh: 0, to_world: Affine3A::IDENTITY }], view, light)
}

/// Two thousand turned and scaled copies of three meshes over a floor.
fn instanced() -> Scene {
    let floor = Mesh::sheet(8, 8, |u, v| Vec3::new(u * 60.0 - 30.0, 0.0, v * 60.0 - 30.0));
    let meshes = vec![floor, Mesh::sphere(40), Mesh::torus(48), Mesh::cuboid()];
    let mut placements = vec![Placement { mesh: 0, to_world: Affine3A::IDENTITY }];
    let mut random = Random(3);
    for i in 0..2000 {
        let turn =
            Quat::from_euler(EulerRot::XYZ, random.uniform() * 6.0, random.uniform() * 6.0, random.uniform());
        let at =
            Vec3::new(random.uniform() * 50.0 - 25.0, random.uniform() * 3.0, random.uniform() * 50.0 - 25.0);
        let scale = Vec3::splat(0.2 + random.uniform() * 0.6);
        let to_world = Affine3A::from_scale_rotation_translation(scale, turn, at);
        placements.push(Placement { mesh: 1 + i % 3, to_world });
    }
    let light = [Vec3::new(-5.0, 20.0, -5.0), Vec3::X * 10.0, Vec3::Z * 10.0];
    let view = [Vec3::new(0.0, 9.0, 27.0), Vec3::new(0.0, 0.0, 5.0)];
    Scene::new("instanced", meshes, placements, view, light)
}

fn rays(criterion: &mut Criterion<ThreadTime>) {
    for scene in [interior(), terrain(), instanced()] {
        let mut group = criterion.benchmark_group(scene.name);
        group
            .sample_size(10)
            .warm_up_time(Duration::from_millis(300))
            .measurement_time(Duration::from_secs(2));
        let primary = scene.primary();
        let points = scene.points(&primary);
        let mut random = Random(4);
        let bounce: Vec<_> = points
            .iter()
            .map(|p| random.cosine(p.normal))
            .zip(&points)
            .map(|(d, p)| Ray::new(p.leave(d), d))
            .collect();
        let shadow: Vec<_> = points
            .iter()
            .map(|p| {
                let on_light =
                    scene.light[0] + scene.light[1] * random.uniform() + scene.light[2] * random.uniform();
                let origin = p.leave(on_light - p.position);
                Ray { t_max: 1.0, ..Ray::new(origin, on_light - origin) }
            })
            .collect();
        for (name, rays) in [("primary", &primary), ("bounce", &bounce)] {
            group.throughput(Throughput::Elements(rays.len() as u64));
            group.bench_function(name, |b| {
                b.iter(|| {
                    rays.iter().filter(|r| scene.placed.closest(black_box(r), |_| true).is_some()).count()
                });
            });
        }
        for (name, rays) in [("shadow", &shadow), ("any-hit bounce", &bounce)] {
            group.throughput(Throughput::Elements(rays.len() as u64));
            group.bench_function(name, |b| {
                b.iter(|| rays.iter().filter(|r| scene.placed.occluded(black_box(r), |_| true)).count());
            });
        }
        group.finish();
    }
}

fn build(criterion: &mut Criterion<ThreadTime>) {
    let mesh =
        Mesh::sheet(708, 708, |u, v| Vec3::new(u, libm::sinf(u * 40.0) * libm::cosf(v * 30.0) * 0.1, v));
    let mut group = criterion.benchmark_group("build");
    group.sample_size(10).warm_up_time(Duration::from_millis(1)).measurement_time(Duration::from_secs(1));
    group.throughput(Throughput::Elements(mesh.triangles.len() as u64));
    group.bench_function("terrain", |b| {
        b.iter(|| MeshTree::build(&mesh.positions, black_box(&mesh.triangles)).expect("a good mesh").bytes());
    });
    group.finish();
}

criterion_group! {
    name = benches;
    config = Criterion::default().with_measurement(ThreadTime(WallTime)).without_plots();
    targets = rays, build
}
criterion_main!(benches);
