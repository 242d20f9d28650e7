// SPDX-License-Identifier: MIT OR Apache-2.0
//! Meshes and instances as one list of world-space triangles.

use super::atlas::{Atlas, Encoding};
use crate::bindings::lucerna::scene::data as wgsl;
use crate::bindings::lucerna::scene::types::NONE;
use crate::scene::{AlphaMode, Material, Scene, TextureRef};
use crate::seam::{NO_MESH, StaticMesh};
use glam::{Mat3, UVec2, UVec3, Vec2, Vec3, Vec4};

/// Beyond this, products in ray tests exceed f32's range.
const MAX_COORDINATE: f32 = 1e12;

/// All triangles of a scene in world space, in one order.
#[derive(Clone, Debug, Default)]
pub struct WorldTriangles {
    /// Corners \[m\], counter-clockwise seen from the front.
    pub positions: Vec<[Vec3; 3]>,
    /// Instance, triangle of its mesh, and whether the transform mirrors.
    origins: Vec<Origin>,
    /// Number of triangles left out because they have no area or are too far away.
    pub skipped: usize,
}

#[derive(Clone, Copy, Debug)]
struct Origin {
    instance: u32,
    triangle: u32,
    mirrored: bool,
}

impl Origin {
    /// The mesh's vertices of the three corners, in the order of `positions`.
    fn vertices(self, scene: &Scene) -> [usize; 3] {
        let mesh = &scene.meshes[scene.instances[self.instance as usize].mesh];
        let [a, b, c] = mesh.triangles[self.triangle as usize].map(|ix| ix as usize);
        if self.mirrored { [a, c, b] } else { [a, b, c] }
    }
}

impl WorldTriangles {
    /// Transforms every instance. For a mirroring transform two corners are swapped, so that the
    /// front remains the front (glTF 2.0 §3.7.4).
    pub fn of(scene: &Scene) -> Self {
        let mut out = Self::default();
        for (instance_ix, instance) in scene.instances.iter().enumerate() {
            let mesh = &scene.meshes[instance.mesh];
            let mirrored = instance.world_from_object.matrix3.determinant() < 0.0;
            for triangle_ix in 0..mesh.triangles.len() {
                let origin =
                    Origin { instance: instance_ix as u32, triangle: triangle_ix as u32, mirrored };
                let corners = origin
                    .vertices(scene)
                    .map(|v| instance.world_from_object.transform_point3(mesh.positions[v]));
                let [a, b, c] = corners.map(|corner| corner.as_dvec3());
                let has_area = (b - a).cross(c - a).length_squared() > 0.0;
                // Not `>`: NaN is out of range too.
                let in_range = corners.iter().all(|v| v.abs().max_element() <= MAX_COORDINATE);
                if has_area && in_range {
                    out.positions.push(corners);
                    out.origins.push(origin);
                } else {
                    out.skipped += 1;
                }
            }
        }
        out
    }

    /// The same triangles as meshes, one for each instance, in the same order.
    pub fn static_meshes(&self, scene: &Scene) -> Vec<StaticMesh> {
        let mut out: Vec<StaticMesh> = Vec::new();
        let mut last = None;
        for origin in &self.origins {
            let instance = &scene.instances[origin.instance as usize];
            let mesh = &scene.meshes[instance.mesh];
            if last != Some(origin.instance) {
                last = Some(origin.instance);
                let world = |p: &Vec3| instance.world_from_object.transform_point3(*p);
                out.push(StaticMesh {
                    name: mesh.name.clone(),
                    positions: mesh.positions.iter().map(world).collect(),
                    second_uv: mesh.uv1.clone(),
                    triangles: Vec::new(),
                });
            }
            let vertices = origin.vertices(scene).map(|v| v as u32);
            out.last_mut().into_iter().for_each(|mesh| mesh.triangles.push(vertices));
        }
        out
    }

    /// For each triangle of `order`, its place among those of instances that do not move, or NO_MESH; None if nothing moves.
    pub(super) fn static_order(
        &self,
        scene: &Scene,
        moving: &dyn Fn(usize) -> bool,
        order: &[u32],
    ) -> Option<Vec<u32>> {
        let moving: Vec<bool> = (0..scene.instances.len()).map(moving).collect();
        if !moving.contains(&true) {
            return None;
        }
        let mut n_still = 0;
        let places: Vec<u32> = self
            .origins
            .iter()
            .map(|origin| match moving[origin.instance as usize] {
                true => NO_MESH,
                false => {
                    n_still += 1;
                    n_still - 1
                }
            })
            .collect();
        Some(order.iter().map(|ix| places[*ix as usize]).collect())
    }

    /// Moves triangle `order[i]` to place `i`.
    pub(super) fn reorder(&mut self, order: &[u32]) {
        self.positions = order.iter().map(|&ix| self.positions[ix as usize]).collect();
        self.origins = order.iter().map(|&ix| self.origins[ix as usize]).collect();
    }

    /// The box around all corners; zeros if there are none.
    pub fn bounds(&self) -> (Vec3, Vec3) {
        let corners = || self.positions.iter().flatten().copied();
        match (corners().reduce(Vec3::min), corners().reduce(Vec3::max)) {
            (Some(min), Some(max)) => (min, max),
            _ => (Vec3::ZERO, Vec3::ZERO),
        }
    }

    /// Material of a triangle.
    pub(super) fn material(&self, scene: &Scene, triangle: usize) -> usize {
        scene.meshes[scene.instances[self.origins[triangle].instance as usize].mesh].material
    }

    pub(super) fn ray_triangles(
        &self,
        scene: &Scene,
        moving: &dyn Fn(usize) -> bool,
    ) -> Vec<wgsl::Triangle> {
        let moving: Vec<bool> = (0..scene.instances.len()).map(moving).collect();
        let alpha_tested: Vec<bool> =
            scene.materials.iter().map(|material| material.alpha != AlphaMode::Opaque).collect();
        self.positions
            .iter()
            .enumerate()
            .map(|(ix, &[corner_a, corner_b, corner_c])| {
                let material = self.material(scene, ix);
                let moves = moving[self.origins[ix].instance as usize];
                wgsl::Triangle {
                    corner_a,
                    flags: if alpha_tested[material] { wgsl::TRIANGLE_ALPHA_TESTED } else { 0 }
                        | if moves { wgsl::TRIANGLE_MOVING } else { 0 },
                    corner_b,
                    material: material as u32,
                    corner_c,
                    // Set once the light table is made.
                    light: NONE,
                }
            })
            .collect()
    }

    pub(super) fn shading_triangles(&self, scene: &Scene) -> Vec<wgsl::TriangleShading> {
        self.positions
            .iter()
            .zip(&self.origins)
            .map(|(corners, &origin)| shading_triangle(scene, corners, origin))
            .collect()
    }
}

fn shading_triangle(scene: &Scene, corners: &[Vec3; 3], origin: Origin) -> wgsl::TriangleShading {
    let instance = &scene.instances[origin.instance as usize];
    let mesh = &scene.meshes[instance.mesh];
    let vertices = origin.vertices(scene);
    let linear = Mat3::from(instance.world_from_object.matrix3);
    // The inverse transpose up to a factor, whose sign must not flip normals.
    let cofactor = Mat3::from_cols(
        linear.y_axis.cross(linear.z_axis),
        linear.z_axis.cross(linear.x_axis),
        linear.x_axis.cross(linear.y_axis),
    ) * if origin.mirrored { -1.0 } else { 1.0 };
    let [a, b, c] = *corners;
    let flat = (b - a).as_dvec3().cross((c - a).as_dvec3()).normalize_or(glam::DVec3::Y).as_vec3();

    // A flattened mesh has only one normal direction; a tilted normal may end up on the wrong side.
    let is_sheet = linear.determinant() == 0.0;
    let normals = vertices.map(|v| {
        let given = mesh.normals.get(v).filter(|_| !is_sheet);
        let normal = given.map_or(flat, |&n| cofactor * n);
        normal.try_normalize().unwrap_or(flat)
    });
    let uv = |set: &[Vec2]| vertices.map(|v| set.get(v).copied().unwrap_or_default());
    let (uv_first, uv_second) = (uv(&mesh.uv0), uv(&mesh.uv1));
    let material = &scene.materials[mesh.material];
    let (tangents, mirrored_uv) = if mesh.tangents.is_empty() {
        let coordinates = match &material.normal_texture {
            Some(slot) if slot.uv_set == 1 => uv_second,
            _ => uv_first,
        };
        tangent_of_uv(corners, &coordinates, flat)
    } else {
        let signs = vertices.map(|v| mesh.tangents[v].w);
        let negative = signs.iter().sum::<f32>() < 0.0;
        (vertices.map(|v| linear * mesh.tangents[v].truncate()), negative != origin.mirrored)
    };
    let colors = vertices.map(|v| mesh.colors.get(v).copied().unwrap_or(Vec4::ONE));
    let flag = |set, bit| if set { bit } else { 0 };
    wgsl::TriangleShading {
        normals: UVec3::from(normals.map(pack_direction)),
        flags: flag(mirrored_uv, wgsl::SHADING_MIRRORED)
            | flag(normals.iter().any(|&n| n != flat), wgsl::SHADING_HAS_NORMALS)
            | flag(colors.iter().any(|&c| c != Vec4::ONE), wgsl::SHADING_HAS_COLORS),
        tangents: UVec3::from(
            tangents.map(|t| {
                pack_direction(t.try_normalize().unwrap_or(flat.any_orthonormal_vector()))
            }),
        ),
        reserved: 0,
        uv_first,
        uv_second,
        colors: colors.map(pack_color),
        reserved_pair: UVec2::ZERO,
    }
}

/// The direction in which u increases on the triangle, and whether v increases to the opposite
/// side.
fn tangent_of_uv(corners: &[Vec3; 3], uv: &[Vec2; 3], flat: Vec3) -> ([Vec3; 3], bool) {
    let [a, b, c] = *corners;
    let (first, second) = (uv[1] - uv[0], uv[2] - uv[0]);
    let determinant = first.perp_dot(second);
    let tangent = ((b - a) * second.y - (c - a) * first.y) * determinant.signum();
    // glTF's v runs down the image, but its bitangent runs up, against v.
    let down = ((c - a) * first.x - (b - a) * second.x) * determinant.signum();
    let bitangent = -down;
    ([tangent; 3], flat.cross(tangent).dot(bitangent) < 0.0)
}

/// The packing of `wgsl/math/octahedral.wgsl`, on the host.
fn pack_direction(direction: Vec3) -> u32 {
    let p = direction / direction.abs().element_sum();
    let folded = (Vec2::ONE - Vec2::new(p.y, p.x).abs())
        * Vec2::new(if p.x >= 0.0 { 1.0 } else { -1.0 }, if p.y >= 0.0 { 1.0 } else { -1.0 });
    let point = if p.z < 0.0 { folded } else { Vec2::new(p.x, p.y) };
    let snorm = |x: f32| ((x.clamp(-1.0, 1.0) * 32767.0).round() as i16) as u16 as u32;
    snorm(point.x) | snorm(point.y) << 16
}

/// WGSL's `pack2x16unorm` twice.
fn pack_color(color: Vec4) -> UVec2 {
    let unorm = |x: f32| (x.clamp(0.0, 1.0) * 65535.0).round() as u32;
    UVec2::new(unorm(color.x) | unorm(color.y) << 16, unorm(color.z) | unorm(color.w) << 16)
}

/// The materials, with the places of their textures in the atlas.
pub(super) fn materials(scene: &Scene, atlas: &Atlas) -> Vec<wgsl::Material> {
    let slot = |texture: &Option<TextureRef>, encoding| {
        texture.as_ref().map_or(EMPTY_SLOT, |texture| atlas.slot(scene, texture, encoding))
    };
    scene
        .materials
        .iter()
        .map(|material| wgsl::Material {
            base_color_texture: slot(&material.base_color_texture, Encoding::Srgb),
            metallic_roughness_texture: slot(
                &material.metallic_roughness_texture,
                Encoding::Linear,
            ),
            normal_texture: slot(&material.normal_texture, Encoding::Linear),
            emission_texture: slot(&material.emission_texture, Encoding::Srgb),
            ..factors(material)
        })
        .collect()
}

/// A material without its textures.
pub(super) fn factors(material: &Material) -> wgsl::Material {
    wgsl::Material {
        base_color: material.base_color,
        emission: material.emission,
        metallic: material.metallic,
        roughness: material.roughness,
        normal_scale: material.normal_scale,
        alpha_cutoff: match material.alpha {
            AlphaMode::Opaque => -1.0,
            AlphaMode::Mask { cutoff } => cutoff.max(0.0),
        },
        flags: if material.double_sided { wgsl::MATERIAL_DOUBLE_SIDED } else { 0 },
        base_color_texture: EMPTY_SLOT,
        metallic_roughness_texture: EMPTY_SLOT,
        normal_texture: EMPTY_SLOT,
        emission_texture: EMPTY_SLOT,
    }
}

const EMPTY_SLOT: wgsl::TextureSlot = wgsl::TextureSlot {
    row_u: Vec3::ZERO,
    flags: 0,
    row_v: Vec3::ZERO,
    layer: 0,
    origin: UVec2::ZERO,
    size: UVec2::ZERO,
};

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Instance, Mesh};
    use glam::Affine3A;

    #[test]
    fn a_transform_of_rank_2_makes_a_sheet() {
        // Faces +Z; the normals lean so far that the sheet's other side is nearer to them.
        let mesh = Mesh {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z],
            normals: vec![Vec3::new(0.8, 0.0, -0.6); 4],
            triangles: vec![[0, 1, 2], [0, 1, 3]],
            ..Mesh::default()
        };
        let world_from_object = Affine3A::from_scale(Vec3::new(1.0, 2.0, 0.0));
        let scene = Scene {
            meshes: vec![mesh],
            instances: vec![Instance { mesh: 0, world_from_object }],
            materials: vec![Material::default()],
            ..Scene::default()
        };
        scene.validate().unwrap();
        let world = WorldTriangles::of(&scene);
        // The second triangle is seen edge-on.
        assert_eq!((world.positions.len(), world.skipped), (1, 1));
        let shading = shading_triangle(&scene, &world.positions[0], world.origins[0]);
        assert_eq!(shading.normals, UVec3::splat(pack_direction(Vec3::Z)));
    }
}
