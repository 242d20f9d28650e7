// SPDX-License-Identifier: MIT OR Apache-2.0
//! Reading a voxel grid between cell centres.
//!
//! Trilinear interpolation over the eight nearest centres, and the weights of a cell's faces for a
//! surface: the squares of the normal's components, which sum to 1 (J. McTaggart, "Half-Life 2 /
//! Valve Source Shading", GDC 2004: the ambient cube).
#define_import_path lucerna::components::voxels::lookup

/// The eight cells around a point: `base` + 0 or 1 along each axis.
struct Taps {
    base: vec3<i32>,
    /// Position of the point between the two centres of each axis, in [0, 1).
    fraction: vec3<f32>,
}

/// The cells whose centres surround a point in grid units. Points farther than 2²³ cells away have
/// no fractions left.
fn taps_at(point: vec3<f32>) -> Taps {
    let shifted = point - 0.5;
    let base = floor(shifted);
    return Taps(vec3<i32>(base), shifted - base);
}

/// Cell number `ix` (0 to 7; bit 0 is x, bit 1 y, bit 2 z).
fn tap_cell(taps: Taps, ix: u32) -> vec3<i32> {
    return taps.base + vec3<i32>((vec3<u32>(ix) >> vec3<u32>(0u, 1u, 2u)) & vec3<u32>(1u));
}

/// Trilinear weight of cell number `ix`; the eight sum to 1.
fn tap_weight(taps: Taps, ix: u32) -> f32 {
    let upper = ((vec3<u32>(ix) >> vec3<u32>(0u, 1u, 2u)) & vec3<u32>(1u)) != vec3<u32>(0u);
    let weight = select(1.0 - taps.fraction, taps.fraction, upper);
    return weight.x * weight.y * weight.z;
}

/// Weight of each axis's face for a surface with this unit normal; they sum to 1. In a grid with one value per cell
/// (`n_faces` 1), only that value counts.
fn face_weights(n_faces: u32, normal: vec3<f32>) -> vec3<f32> {
    return select(normal * normal, vec3<f32>(1.0, 0.0, 0.0), n_faces == 1u);
}

/// A weighted sum of records' values.
struct LightSum {
    /// Sum of irradiances [W·m⁻²].
    irradiance: vec3<f32>,
    weight: f32,
}

/// Adds an irradiance with a weight ≥ 0.
fn add_weighted(sum: LightSum, irradiance: vec3<f32>, weight: f32) -> LightSum {
    return LightSum(sum.irradiance + weight * irradiance, sum.weight + weight);
}

/// Adds another sum's mean with a weight; `found.weight` > 0.
fn add_share(sum: LightSum, found: LightSum, weight: f32) -> LightSum {
    return add_weighted(sum, found.irradiance / found.weight, weight);
}
