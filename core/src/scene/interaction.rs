//! A point on a surface, ready to be shaded.

use crate::bsdf::surface::{Layers, SurfaceParameters};
use crate::math::colour::Rgb;
use crate::math::frame::Frame;
use crate::scene::data::SceneData;
use crate::scene::instance::{Handedness, Motion, Placement};
use crate::scene::lit::{Lit, LitFrom};
use crate::scene::material::{LayerMaterial, Material, MaterialId, Sides, SurfaceCoordinates};
use crate::scene::mesh::Mesh;
use crate::scene::texture::Texture;
use crate::trace::moment::Moment;
use crate::trace::surface_point::SurfacePoint;
use glam::{Vec2, Vec3, Vec4};

/// A side of a surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// Where its corners run counter-clockwise.
    Front,
    /// The other.
    Back,
}

/// A point on a surface, ready to be shaded.
#[derive(Clone, Copy, Debug)]
pub struct Interaction<'a> {
    /// Where, in the scene's space.
    pub position: Vec3,
    /// Unit geometric normal, on the front side.
    pub ng: Vec3,
    /// Shading frame; its `z` is the interpolated and mapped normal, on the front side too.
    pub shading: Frame,
    /// Unit normal of its coat, on the front side; that of `shading` where there is none.
    pub coat: Vec3,
    /// Sign of the bitangent over the shading frame's y: 0 without tangents, and where nothing asks.
    pub bitangent: f32,
    /// Where on its textures.
    pub at: SurfaceCoordinates,
    /// When.
    pub moment: Moment,
    /// The material.
    pub material: &'a Material,
    /// Its number.
    pub material_id: MaterialId,
    textures: &'a [Texture],
    point: SurfacePoint,
}

impl SceneData {
    /// Corners of a triangle of an instance at a moment, in the scene's space, counter-clockwise seen from the front.
    pub fn corners(&self, instance: u32, triangle: u32, moment: Moment) -> [Vec3; 3] {
        let instance = &self.instances[instance as usize];
        let corners = self.meshes[instance.mesh.index()].corners(triangle, moment);
        let [a, b, c] = match &instance.placement {
            Placement::Moving(motion) => {
                let there = Placement::Moved(motion.at(moment));
                corners.map(|p| there.point(p))
            }
            there => corners.map(|p| there.point(p)),
        };
        match instance.placement.handedness() {
            Handedness::Kept => [a, b, c],
            Handedness::Mirrored => [a, c, b],
        }
    }

    /// Share of what is behind that a triangle covers at a point; `barycentric` holds the weights of the
    /// second and the third corner (in the mesh's order).
    pub fn alpha(&self, instance: u32, triangle: u32, barycentric: Vec2) -> f32 {
        let at = self.coordinates(instance, triangle, barycentric);
        self.material(instance, triangle).alpha(&self.textures, &at)
    }

    /// Where on its textures such a point lies.
    pub(super) fn coordinates(&self, instance: u32, triangle: u32, barycentric: Vec2) -> SurfaceCoordinates {
        let mesh = &self.meshes[self.instances[instance as usize].mesh.index()];
        coordinates(mesh, triangle, weights(barycentric))
    }

    /// The point of a triangle with the given weights of its second and third corner (in the mesh's order), at a moment.
    pub fn interaction(
        &self,
        instance: u32,
        triangle: u32,
        barycentric: Vec2,
        moment: Moment,
    ) -> Interaction<'_> {
        let instance = &self.instances[instance as usize];
        let mesh = &self.meshes[instance.mesh.index()];
        let point = Place { mesh, triangle, weights: weights(barycentric), moment };
        match &instance.placement {
            Placement::Moving(motion) => self.interaction_of_moving(point, motion),
            there => self.interaction_at(point, there, Normals::Interpolated),
        }
    }

    /// The same of a point that emits and is not asked to scatter: it is shaded by its geometric normal.
    pub fn emitter(
        &self,
        instance: u32,
        triangle: u32,
        barycentric: Vec2,
        moment: Moment,
    ) -> Interaction<'_> {
        let of = &self.instances[instance as usize];
        if let Placement::Moving(_) = of.placement {
            return self.interaction(instance, triangle, barycentric, moment);
        }
        let mesh = &self.meshes[of.mesh.index()];
        let point = Place { mesh, triangle, weights: weights(barycentric), moment };
        self.interaction_at(point, &of.placement, Normals::Geometric)
    }

    #[inline(never)]
    fn interaction_of_moving(&self, point: Place<'_>, motion: &Motion) -> Interaction<'_> {
        self.interaction_at(point, &Placement::Moved(motion.at(point.moment)), Normals::Interpolated)
    }

    #[inline]
    fn interaction_at(&self, point: Place<'_>, placement: &Placement, normals: Normals) -> Interaction<'_> {
        let Place { mesh, triangle, weights, moment } = point;
        let material_id = mesh.materials[triangle as usize];
        let material = &self.materials[material_id.index()];
        let moved = match placement {
            Placement::Moved(moved) => Some(&moved.traced),
            Placement::World | Placement::Moving(_) => None,
        };
        let (vertices, barycentric) = (mesh.corners(triangle, moment), Vec2::new(weights.y, weights.z));
        let on = match (mesh.face(triangle), moved) {
            (Some(face), None) => SurfacePoint::on(face, vertices, barycentric, None),
            _ => SurfacePoint::new(vertices, barycentric, moved),
        };
        let (position, ng) = (on.position, on.normal);
        let at = coordinates(mesh, triangle, weights);
        let shading = match normals {
            Normals::Interpolated => {
                shading_frame(point, placement, ng, || material.mapped_normal(&self.textures, &at))
            }
            Normals::Geometric => Frame::around(ng),
        };
        let coat = match (&material.layers, normals) {
            (Some(_), Normals::Interpolated) => {
                shading_frame(point, placement, ng, || material.mapped_coat_normal(&self.textures, &at)).z
            }
            _ => shading.z,
        };
        let bitangent = match (&material.layers, normals) {
            (Some(layers), Normals::Interpolated) if layers.finish.brush.factor > 0.0 => {
                bitangent(point, placement)
            }
            _ => 0.0,
        };
        let textures = &self.textures;
        Interaction {
            position,
            ng,
            shading,
            coat,
            bitangent,
            at,
            moment,
            material,
            material_id,
            textures,
            point: on,
        }
    }
}

#[inline]
fn weights(barycentric: Vec2) -> Vec3 {
    Vec3::new(1.0 - barycentric.x - barycentric.y, barycentric.x, barycentric.y)
}

#[inline]
fn mix<T: Copy + std::ops::Mul<f32, Output = T> + std::ops::Add<Output = T>>(v: [T; 3], w: Vec3) -> T {
    v[0] * w.x + v[1] * w.y + v[2] * w.z
}

fn coordinates(mesh: &Mesh, triangle: u32, weights: Vec3) -> SurfaceCoordinates {
    let corners = mesh.triangles[triangle as usize].map(|v| v as usize);
    let uv =
        |list: &Vec<Vec2>| if list.is_empty() { Vec2::ZERO } else { mix(corners.map(|v| list[v]), weights) };
    let colour =
        if mesh.colours.is_empty() { Vec4::ONE } else { mix(corners.map(|v| mesh.colours[v]), weights) };
    SurfaceCoordinates { uvs: [uv(&mesh.uvs[0]), uv(&mesh.uvs[1])], colour }
}

/// By which normals a point is shaded.
#[derive(Clone, Copy)]
enum Normals {
    Interpolated,
    Geometric,
}

/// A point of a mesh at a moment.
#[derive(Clone, Copy)]
struct Place<'a> {
    mesh: &'a Mesh,
    triangle: u32,
    weights: Vec3,
    moment: Moment,
}

/// Interpolated normal, then the normal map in the frame of tangent and bitangent. What vanishes on the
/// way falls back to the step before; a normal on the back side is turned to the front.
fn shading_frame(
    Place { mesh, triangle, weights, moment }: Place<'_>,
    placement: &Placement,
    ng: Vec3,
    map: impl FnOnce() -> Option<Vec3>,
) -> Frame {
    let corners = mesh.triangles[triangle as usize].map(|v| v as usize);
    let mut normal = ng;
    if !mesh.normals.is_empty() {
        let smooth = placement.normal(mix(mesh.normals(corners, moment), weights));
        normal = front(smooth.try_normalize().unwrap_or(ng), ng);
    }
    if mesh.tangents.is_empty() {
        return Frame::around(normal);
    }
    let mixed = mix(mesh.tangents(corners, moment), weights);
    if mixed.truncate() == Vec3::ZERO {
        return Frame::around(normal);
    }
    let frame = Frame::with_tangent(normal, placement.direction(mixed.truncate()));
    let Some(mapped) = map() else {
        return frame;
    };
    let sign = 1.0_f32.copysign(mixed.w) * placement.handedness().sign();
    let bent = frame.x * mapped.x + frame.y * (mapped.y * sign) + frame.z * mapped.z;
    match bent.try_normalize() {
        Some(bent) if bent.dot(ng) > 0.0 => Frame::with_tangent(bent, frame.x),
        _ => frame,
    }
}

/// The sign of the bitangent over the frame of normal and tangent; 0 where there is no tangent.
fn bitangent(Place { mesh, triangle, weights, moment }: Place<'_>, placement: &Placement) -> f32 {
    if mesh.tangents.is_empty() {
        return 0.0;
    }
    let corners = mesh.triangles[triangle as usize].map(|v| v as usize);
    let mixed = mix(mesh.tangents(corners, moment), weights);
    if mixed.truncate() == Vec3::ZERO {
        return 0.0;
    }
    1.0_f32.copysign(mixed.w) * placement.handedness().sign()
}

/// `normal` turned to the side of `ng`; `ng` itself where it lies in the surface.
#[inline]
fn front(normal: Vec3, ng: Vec3) -> Vec3 {
    let cos = normal.dot(ng);
    if cos > 0.0 {
        normal
    } else if cos < 0.0 {
        -normal
    } else {
        ng
    }
}

impl Interaction<'_> {
    /// Bound on the error of `position`, on every axis.
    #[inline]
    pub fn error(&self) -> f32 {
        self.point.error
    }

    /// Where a ray that leaves in `direction` must start so that it does not meet this surface again and stays on this
    /// side of the neighbouring ones.
    #[inline]
    pub fn leave(&self, direction: Vec3) -> Vec3 {
        self.point.leave(direction)
    }

    /// Where a ray from `origin` must end so that it does not meet this surface.
    #[inline]
    pub fn arrive(&self, origin: Vec3) -> Vec3 {
        self.point.arrive(origin)
    }

    /// The side that a direction away from the surface leaves on.
    #[inline]
    pub fn side(&self, direction: Vec3) -> Side {
        if direction.dot(self.ng) < 0.0 { Side::Back } else { Side::Front }
    }

    /// Where light is looked for to scatter, on a side.
    pub fn lit(&self, side: Side) -> Lit {
        let normal = if side == Side::Back { -self.ng } else { self.ng };
        let from = if self.material.transmits() { LitFrom::BothSides } else { LitFrom::Above };
        Lit { point: self.position, normal, from }
    }

    /// Radiance emitted on a side, W/(sr·m²).
    pub fn emission(&self, side: Side) -> Rgb {
        match (side, self.material.sides) {
            (Side::Back, Sides::Front) => Vec3::ZERO,
            _ => self.material.radiance(self.textures, &self.at),
        }
    }

    /// What the eye sees where the surface is unlit.
    pub fn shown(&self) -> Option<Rgb> {
        self.material.shown(self.textures, &self.at)
    }

    /// Share of what is behind that the surface covers.
    pub fn alpha(&self) -> f32 {
        self.material.alpha(self.textures, &self.at)
    }

    /// A coat whose normal the shading normal turns away from goes by that one.
    #[inline(never)]
    fn layers(&self, layers: &LayerMaterial) -> Layers {
        let normal = self.shading.to_local(self.coat);
        let normal = if normal.z > 0.0 { normal.normalize() } else { Vec3::Z };
        layers.at(self.textures, &self.at, normal, self.bitangent)
    }

    /// What the surface is made of here.
    pub fn surface(&self) -> SurfaceParameters {
        let layers = self.material.layers.as_ref().map(|layers| self.layers(layers));
        SurfaceParameters { layers, ..self.material.surface(self.textures, &self.at) }
    }
}
