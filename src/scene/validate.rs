// SPDX-License-Identifier: MIT OR Apache-2.0
//! The properties that a scene must have before it is rendered.

use std::f32::consts::{FRAC_PI_2, PI};

use glam::Vec3;
use thiserror::Error;

use super::{
    AlphaMode, Camera, Light, MAX_COORDINATE, Material, Mesh, Projection, Scene, Sky, TextureRef,
};

/// How far a unit vector's squared length may be from 1.
const UNIT_TOLERANCE: f32 = 1e-4;

/// The part of a unit square's area that a transform must keep, relative to the square of its
/// largest element; less is a rounding error.
const LEAST_AREA: f64 = 1e-14;

/// A part of a scene that does not pass [`Scene::validate`].
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("{at}: {problem}")]
#[non_exhaustive]
pub struct InvalidScene {
    /// Which part, by its path: `meshes[3] (table)`.
    pub at: String,
    /// What is wrong with it.
    pub problem: &'static str,
}

impl Scene {
    /// Checks what [`Scene::load`] guarantees, for scenes that you build yourself.
    ///
    /// # Errors
    ///
    /// The first part that violates a guarantee.
    pub fn validate(&self) -> Result<(), InvalidScene> {
        for (i, mesh) in self.meshes.iter().enumerate() {
            let material = self.materials.get(mesh.material);
            check(mesh_problem(mesh, material), "meshes", i, &mesh.name)?;
        }
        for (i, instance) in self.instances.iter().enumerate() {
            let problem = match self.meshes.get(instance.mesh) {
                None => Some("mesh out of range"),
                Some(mesh) => instance_problem(mesh, &instance.world_from_object),
            };
            check(problem, "instances", i, "")?;
        }
        for (i, material) in self.materials.iter().enumerate() {
            let problem = material_problem(material, self.textures.len());
            check(problem, "materials", i, &material.name)?;
        }
        self.check_textures()?;
        for (i, light) in self.lights.iter().enumerate() {
            check(light_problem(light), "lights", i, "")?;
        }
        for (i, camera) in self.cameras.iter().enumerate() {
            check(camera_problem(camera), "cameras", i, &camera.name)?;
        }
        check(sky_problem(&self.sky), "sky", 0, "")
    }

    /// The part of [`Self::validate`] without which the scene's parts cannot be read: indices and lengths.
    #[cfg(feature = "gpu")]
    pub(crate) fn check_indices(&self) -> Result<(), InvalidScene> {
        for (i, mesh) in self.meshes.iter().enumerate() {
            let n = mesh.positions.len();
            let reaches_out = |t: &[u32; 3]| t.iter().any(|&ix| ix as usize >= n);
            let problem = mesh_lengths_problem(mesh).or(first([
                (mesh.material >= self.materials.len(), "material out of range"),
                (mesh.triangles.iter().any(reaches_out), "vertex index out of range"),
            ]));
            check(problem, "meshes", i, &mesh.name)?;
        }
        for (i, instance) in self.instances.iter().enumerate() {
            let problem = (instance.mesh >= self.meshes.len()).then_some("mesh out of range");
            check(problem, "instances", i, "")?;
        }
        for (i, material) in self.materials.iter().enumerate() {
            let problem = texture_ref_problem(material, self.textures.len());
            check(problem, "materials", i, &material.name)?;
        }
        self.check_textures()?;
        check_sky(&self.sky)
    }

    fn check_textures(&self) -> Result<(), InvalidScene> {
        for (i, texture) in self.textures.iter().enumerate() {
            let problem = (texture.image >= self.images.len()).then_some("image out of range");
            check(problem, "textures", i, "")?;
        }
        for (i, image) in self.images.iter().enumerate() {
            let problem = texels_problem(image.width, image.height, image.rgba.len());
            check(problem, "images", i, &image.name)?;
        }
        Ok(())
    }
}

/// Fails if a sky's image has another length than its size says.
#[cfg(feature = "gpu")]
pub(crate) fn check_sky(sky: &Sky) -> Result<(), InvalidScene> {
    let problem = match sky {
        Sky::Constant(_) => None,
        Sky::Image { width, height, rgb } => texels_problem(*width, *height, rgb.len()),
    };
    check(problem, "sky", 0, "")
}

fn texels_problem(width: u32, height: u32, n_texels: usize) -> Option<&'static str> {
    let n = u64::from(width) * u64::from(height);
    let is_wrong = n == 0 || n != n_texels as u64;
    is_wrong.then_some("width · height is 0 or not the number of texels")
}

fn mesh_lengths_problem(mesh: &Mesh) -> Option<&'static str> {
    let n = mesh.positions.len();
    let wrong_length = |len: usize| len != 0 && len != n;
    let sets = [&mesh.uv0, &mesh.uv1];
    first([
        (wrong_length(mesh.normals.len()), "as many normals as positions, or none"),
        (wrong_length(mesh.tangents.len()), "as many tangents as positions, or none"),
        (
            sets.iter().any(|s| wrong_length(s.len())),
            "as many texture coordinates as positions, or none",
        ),
        (wrong_length(mesh.colors.len()), "as many colours as positions, or none"),
    ])
}

fn texture_ref_problem(material: &Material, n_textures: usize) -> Option<&'static str> {
    first([
        (texture_refs(material).any(|t| t.texture >= n_textures), "texture out of range"),
        (texture_refs(material).any(|t| t.uv_set > 1), "texture coordinate set not 0 or 1"),
    ])
}

fn check(
    problem: Option<&'static str>,
    of: &str,
    ix: usize,
    name: &str,
) -> Result<(), InvalidScene> {
    match problem {
        None => Ok(()),
        Some(problem) => Err(InvalidScene {
            at: match name {
                "" => format!("{of}[{ix}]"),
                name => format!("{of}[{ix}] ({name})"),
            },
            problem,
        }),
    }
}

/// The first problem whose condition holds.
fn first<const N: usize>(problems: [(bool, &'static str); N]) -> Option<&'static str> {
    problems.into_iter().find_map(|(holds, problem)| holds.then_some(problem))
}

fn is_unit(v: Vec3) -> bool {
    (v.length_squared() - 1.0).abs() <= UNIT_TOLERANCE
}

fn in_reach(v: Vec3) -> bool {
    // False for NaN.
    v.abs().cmple(Vec3::splat(MAX_COORDINATE)).all()
}

fn is_strength(v: Vec3) -> bool {
    v.is_finite() && v.min_element() >= 0.0
}

fn mesh_problem(mesh: &Mesh, material: Option<&Material>) -> Option<&'static str> {
    let sets = [&mesh.uv0, &mesh.uv1];
    let reads = |set: u32| material.iter().flat_map(|m| texture_refs(m)).any(|t| t.uv_set == set);
    let problem = first([
        (material.is_none(), "material out of range"),
        (mesh.triangles.is_empty(), "no triangles"),
    ]);
    let problem = problem.or_else(|| mesh_lengths_problem(mesh)).or(first([
        (!mesh.positions.iter().all(|&p| in_reach(p)), "position not finite or beyond 1e9 m"),
        (!mesh.normals.iter().all(|&v| is_unit(v)), "normal not of unit length"),
        (
            !mesh.tangents.iter().all(|t| is_unit(t.truncate()) && t.w.abs() == 1.0),
            "tangent not of unit length, or its sign not ±1",
        ),
        (!sets.iter().all(|s| s.iter().all(|uv| uv.is_finite())), "texture coordinate not finite"),
        (
            !mesh.colors.iter().all(|c| c.is_finite() && c.min_element() >= 0.0),
            "colour negative or not finite",
        ),
        (
            (0..).zip(sets).any(|(set, uvs)| uvs.is_empty() && reads(set)),
            "does not have the texture coordinates that its material reads",
        ),
    ]));
    problem.or_else(|| mesh.triangles.iter().find_map(|t| triangle_problem(mesh, t)))
}

fn triangle_problem(mesh: &Mesh, triangle: &[u32; 3]) -> Option<&'static str> {
    if triangle.iter().any(|&i| i as usize >= mesh.positions.len()) {
        return Some("vertex index out of range");
    }
    let [a, b, c] = triangle.map(|i| mesh.positions[i as usize]);
    let area = (b - a).cross(c - a).length_squared();
    (!area.is_finite() || area < f32::MIN_POSITIVE).then_some("triangle without area")
}

fn instance_problem(mesh: &Mesh, world_from_object: &glam::Affine3A) -> Option<&'static str> {
    let linear = glam::Mat3::from(world_from_object.matrix3).as_dmat3();
    let areas = [
        linear.y_axis.cross(linear.z_axis),
        linear.z_axis.cross(linear.x_axis),
        linear.x_axis.cross(linear.y_axis),
    ];
    let largest =
        |v: [glam::DVec3; 3]| v.map(|v| v.abs().max_element()).into_iter().fold(0.0, f64::max);
    let side = largest([linear.x_axis, linear.y_axis, linear.z_axis]);
    let keeps_areas = largest(areas) > LEAST_AREA * side * side;
    let reaches = |&p: &Vec3| in_reach(world_from_object.transform_point3(p));
    first([
        (!world_from_object.is_finite(), "transform not finite"),
        (!keeps_areas, "transform keeps no areas (rank below 2)"),
        (!mesh.positions.iter().all(reaches), "reaches beyond 1e9 m"),
    ])
}

fn texture_refs(material: &Material) -> impl Iterator<Item = &TextureRef> {
    [
        &material.base_color_texture,
        &material.metallic_roughness_texture,
        &material.normal_texture,
        &material.emission_texture,
    ]
    .into_iter()
    .flatten()
}

fn material_problem(material: &Material, n_textures: usize) -> Option<&'static str> {
    let unit = 0.0..=1.0;
    let cutoff_ok = match material.alpha {
        AlphaMode::Opaque => true,
        AlphaMode::Mask { cutoff } => cutoff >= 0.0 && cutoff.is_finite(),
    };
    let problem = first([
        (
            !material.base_color.to_array().iter().all(|c| unit.contains(c)),
            "base colour not in 0..=1",
        ),
        (!unit.contains(&material.metallic), "metallic not in 0..=1"),
        (!unit.contains(&material.roughness), "roughness not in 0..=1"),
        (!is_strength(material.emission), "emission negative or not finite"),
        (!material.normal_scale.is_finite(), "normal scale not finite"),
        (!cutoff_ok, "alpha cutoff negative or not finite"),
    ]);
    problem.or_else(|| texture_ref_problem(material, n_textures)).or_else(|| {
        let is_finite = |t: &TextureRef| t.uv_from_mesh.is_finite();
        (!texture_refs(material).all(is_finite)).then_some("texture transform not finite")
    })
}

fn light_problem(light: &Light) -> Option<&'static str> {
    let (position, direction, strength, range) = match *light {
        Light::Point { position, intensity, range } => (position, Vec3::Y, intensity, range),
        Light::Spot { position, direction, intensity, inner, outer, range } => {
            if !(inner >= 0.0 && inner < outer && outer <= FRAC_PI_2) {
                return Some("cone angles not 0 ≤ inner < outer ≤ π/2");
            }
            (position, direction, intensity, range)
        }
        Light::Directional { direction, irradiance } => (Vec3::ZERO, direction, irradiance, None),
    };
    first([
        (!in_reach(position), "position not finite or beyond 1e9 m"),
        (!is_unit(direction), "direction not of unit length"),
        (!is_strength(strength), "strength negative or not finite"),
        (range.is_some_and(|r| !(r > 0.0 && r.is_finite())), "range not positive"),
    ])
}

fn camera_problem(camera: &Camera) -> Option<&'static str> {
    let projection_ok = match camera.projection {
        Projection::Perspective { vertical_fov } => vertical_fov > 0.0 && vertical_fov < PI,
        Projection::Orthographic { half_height } => half_height > 0.0 && half_height.is_finite(),
    };
    first([
        (!in_reach(camera.position), "position not finite or beyond 1e9 m"),
        (!is_unit(camera.forward) || !is_unit(camera.up), "forward or up not of unit length"),
        (camera.forward.dot(camera.up).abs() > UNIT_TOLERANCE, "up not orthogonal to forward"),
        (!projection_ok, "field of view not in 0..π, or height not positive"),
    ])
}

fn sky_problem(sky: &Sky) -> Option<&'static str> {
    match sky {
        Sky::Constant(radiance) => {
            (!is_strength(*radiance)).then_some("radiance negative or not finite")
        }
        Sky::Image { width, height, rgb } => {
            texels_problem(*width, *height, rgb.len()).or_else(|| {
                let is_wrong = !rgb.iter().all(|&c| is_strength(c));
                is_wrong.then_some("radiance negative or not finite")
            })
        }
    }
}
