// SPDX-License-Identifier: MIT OR Apache-2.0
//! Makes a mesh satisfy what [`super::Scene::load`] guarantees: indices in range, finite values, triangles with area.

use glam::{Vec2, Vec3, Vec4};

use super::error::{Attribute, DropReason, ErrorKind, Warning, Warnings};
use super::limits::Budget;
use super::{MAX_COORDINATE, Material, Mesh};

/// Drops unusable triangles and replaces unusable attribute values; `None` if nothing is left. Attribute arrays must be
/// empty or as long as `positions`.
pub(super) fn clean(mut mesh: Mesh, warnings: &mut Warnings) -> Option<Mesh> {
    drop_triangles(&mut mesh, warnings);
    if mesh.triangles.is_empty() {
        return None;
    }
    // An unusable position no longer belongs to a triangle, and must not stay behind.
    if mesh.positions.iter().any(|p| unusable(*p).is_some()) {
        compact(&mut mesh);
    }
    repair_normals(&mut mesh, warnings);
    repair_tangents(&mut mesh, warnings);
    repair_texcoords(&mut mesh, warnings);
    repair_colors(&mut mesh, warnings);
    Some(mesh)
}

fn unusable(position: Vec3) -> Option<DropReason> {
    if !position.is_finite() {
        Some(DropReason::NotFinite)
    } else if position.abs().max_element() > MAX_COORDINATE {
        Some(DropReason::Huge)
    } else {
        None
    }
}

fn drop_triangles(mesh: &mut Mesh, warnings: &mut Warnings) {
    const REASONS: [DropReason; 4] =
        [DropReason::NotFinite, DropReason::Huge, DropReason::ZeroArea, DropReason::Index];
    let mut counts = [0usize; REASONS.len()];
    let positions = &mesh.positions;
    mesh.triangles.retain(|triangle| {
        let reason = judge(positions, triangle);
        for (count, candidate) in counts.iter_mut().zip(REASONS) {
            *count += usize::from(reason == Some(candidate));
        }
        reason.is_none()
    });
    for (n, reason) in counts.into_iter().zip(REASONS) {
        if n > 0 {
            warnings.push(Warning::Dropped { mesh: mesh.name.clone(), n, reason });
        }
    }
}

fn judge(positions: &[Vec3], triangle: &[u32; 3]) -> Option<DropReason> {
    let corner = |i: usize| positions.get(triangle[i] as usize).copied();
    let (Some(a), Some(b), Some(c)) = (corner(0), corner(1), corner(2)) else {
        return Some(DropReason::Index);
    };
    [a, b, c].into_iter().find_map(unusable).or_else(|| {
        // In f32, as kernels compute it; for smaller areas, the geometric normal is NaN.
        let area = (b - a).cross(c - a).length_squared();
        (area < f32::MIN_POSITIVE).then_some(DropReason::ZeroArea)
    })
}

/// Keeps only the vertices that triangles use.
pub(super) fn compact(mesh: &mut Mesh) {
    const UNUSED: u32 = u32::MAX;
    let mut new_ix = vec![UNUSED; mesh.positions.len()];
    let mut kept = Vec::new();
    for corner in mesh.triangles.iter_mut().flatten() {
        let slot = &mut new_ix[*corner as usize];
        if *slot == UNUSED {
            *slot = kept.len() as u32;
            kept.push(*corner as usize);
        }
        *corner = *slot;
    }
    fn pick<T: Copy>(values: &mut Vec<T>, kept: &[usize]) {
        if !values.is_empty() {
            *values = kept.iter().map(|&i| values[i]).collect();
        }
    }
    pick(&mut mesh.positions, &kept);
    pick(&mut mesh.normals, &kept);
    pick(&mut mesh.tangents, &kept);
    pick(&mut mesh.uv0, &kept);
    pick(&mut mesh.uv1, &kept);
    pick(&mut mesh.colors, &kept);
}

fn replaced(mesh: &Mesh, n: usize, attribute: Attribute, warnings: &mut Warnings) {
    if n > 0 {
        warnings.push(Warning::Replaced { mesh: mesh.name.clone(), n, attribute });
    }
}

fn unit(v: Vec3) -> Option<Vec3> {
    // In f64, so that very long or short vectors do not over- or underflow.
    let v = v.as_dvec3();
    let unit = (v / v.length()).as_vec3();
    unit.is_finite().then_some(unit)
}

fn repair_normals(mesh: &mut Mesh, warnings: &mut Warnings) {
    let mut bad = Vec::new();
    for (i, normal) in mesh.normals.iter_mut().enumerate() {
        match unit(*normal) {
            Some(unit) => *normal = unit,
            None => {
                bad.push(i);
                *normal = Vec3::ZERO;
            }
        }
    }
    if bad.is_empty() {
        return;
    }
    let mut is_bad = vec![false; mesh.normals.len()];
    for &i in &bad {
        is_bad[i] = true;
    }
    // The length of the cross product is twice the area, so this is a mean weighted by area.
    for triangle in &mesh.triangles {
        let [a, b, c] = triangle.map(|i| mesh.positions[i as usize]);
        let normal = (b - a).cross(c - a);
        for &i in triangle {
            if is_bad[i as usize] {
                mesh.normals[i as usize] += normal;
            }
        }
    }
    for &i in &bad {
        mesh.normals[i] = unit(mesh.normals[i]).unwrap_or(Vec3::Y);
    }
    replaced(mesh, bad.len(), Attribute::Normals, warnings);
}

fn repair_tangents(mesh: &mut Mesh, warnings: &mut Warnings) {
    // glTF says to ignore tangents without normals.
    if mesh.normals.is_empty() {
        mesh.tangents.clear();
    }
    let mut n = 0;
    for (tangent, normal) in mesh.tangents.iter_mut().zip(&mesh.normals) {
        let sign = if tangent.w < 0.0 { -1.0 } else { 1.0 };
        let direction = unit(tangent.truncate()).unwrap_or_else(|| {
            n += 1;
            normal.any_orthonormal_vector()
        });
        *tangent = direction.extend(sign);
    }
    replaced(mesh, n, Attribute::Tangents, warnings);
}

fn repair_texcoords(mesh: &mut Mesh, warnings: &mut Warnings) {
    let mut n = 0;
    for uv in mesh.uv0.iter_mut().chain(&mut mesh.uv1) {
        if !uv.is_finite() || uv.abs().max_element() > MAX_COORDINATE {
            *uv = Vec2::ZERO;
            n += 1;
        }
    }
    replaced(mesh, n, Attribute::Texcoords, warnings);
}

fn repair_colors(mesh: &mut Mesh, warnings: &mut Warnings) {
    let mut n = 0;
    for color in &mut mesh.colors {
        if !color.is_finite() {
            *color = Vec4::ONE;
            n += 1;
        } else if color.min_element() < 0.0 {
            *color = color.max(Vec4::ZERO);
            n += 1;
        }
    }
    replaced(mesh, n, Attribute::Colors, warnings);
}

/// For a material whose emissive texture cannot be read: with white instead, the whole surface would glow.
pub(super) fn dark(material: &mut Material, at: &str, texture: &str, warnings: &mut Warnings) {
    material.emission_texture = None;
    if material.emission != Vec3::ZERO {
        material.emission = Vec3::ZERO;
        warnings.push(Warning::Value {
            at: at.to_owned(),
            problem: format!("{texture} cannot be read, so that it emits nothing"),
        });
    }
}

/// Gives a mesh each set of texture coordinates that its material reads: a missing set becomes (0, 0).
pub(super) fn fill_texcoords(
    mesh: &mut Mesh,
    materials: &[Material],
    budget: &mut Budget,
    warnings: &mut Warnings,
) -> Result<(), ErrorKind> {
    let n = mesh.positions.len();
    let material = &materials[mesh.material];
    let read = [
        &material.base_color_texture,
        &material.metallic_roughness_texture,
        &material.normal_texture,
        &material.emission_texture,
    ];
    for (set, uvs) in [(0, &mut mesh.uv0), (1, &mut mesh.uv1)] {
        let is_read = read.into_iter().flatten().any(|t| t.uv_set == set);
        if is_read && uvs.is_empty() {
            budget.take(n as u64, 8, &mesh.name)?;
            *uvs = vec![Vec2::ZERO; n];
            warnings.push(Warning::MissingTexcoords { mesh: mesh.name.clone(), set });
        }
    }
    Ok(())
}
