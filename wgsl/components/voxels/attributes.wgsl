// SPDX-License-Identifier: MIT OR Apache-2.0
//! What a voxel's face looks like: its record, and the sums from which the record is made.
//!
//! A record is 16 bytes:
//!
//! | word | bits | what |
//! |---|---|---|
//! | x | 0–9, 10–19, 20–29 | albedo red, green, blue, unorm (linear); error 1/2046 |
//! | x | 30 | 1: there is something to see (the coverage may still round to 0) |
//! | x | 31 | 1: no surface looks this way; what is seen are backs |
//! | y | 0–15, 16–31 | unit normal, `octahedral::pack_direction` |
//! | z | 0–31 | emission, `shared_exponent` [W·sr⁻¹·m⁻²] |
//! | w | 0–15 | coverage, unorm: how much of the cell's face the surfaces hide, seen along its axis |
//! | w | 16–31 | agreement, unorm: length of the mean normal; 1: all surfaces look the same way |
//!
//! All zeros: no surface faces either side of that axis.
//!
//! Each triangle adds integers to 64-bit sums (pairs of u32, low word first), so the order of additions does not
//! matter. A triangle adds to a record at most once: the weight is its area in the cell, projected on the face, in
//! units of 2⁻¹⁸ of the face; no plane cuts more than √2 out of a unit cube, so a weight is below 2¹⁹. It is multiplied
//! by at most 2¹⁸ (the others are below 2¹²), and fewer than 2²⁷ triangles of 48 bytes fit a buffer, because its size
//! is below 2³² bytes: 2¹⁹ · 2¹⁸ · 2²⁷ = 2⁶⁴, so no sum overflows.
#define_import_path lucerna::components::voxels::attributes

#import lucerna::math::octahedral::{pack_direction, unpack_direction}
#import lucerna::math::shared_exponent::{pack_shared_exponent, unpack_shared_exponent}
#import lucerna::math::vector::safe_normalize

/// Units of weight in a cell's face.
const WEIGHT_SCALE: f32 = 262144.0;
/// Steps of albedo.
const ALBEDO_SCALE: f32 = 4095.0;
/// Steps of a normal's component from 0 to 1; 0 and ±1 are exact.
const NORMAL_SCALE: f32 = 2047.0;
/// Steps of emission from 0 to the scene's brightest.
const EMISSION_SCALE: f32 = 262143.0;

/// Bit of a record: there is something to see.
const RECORD_VALID: u32 = 0x40000000u;

/// Bit of a record: only backs are visible.
const RECORD_BACK: u32 = 0x80000000u;

/// Index of the sum of weights.
const SUM_WEIGHT: u32 = 0u;
/// Three: albedo × weight.
const SUM_ALBEDO: u32 = 1u;
/// Three: (normal + 1) × weight.
const SUM_NORMAL: u32 = 4u;
/// Three: emission × weight.
const SUM_EMISSION: u32 = 7u;
/// Weights of all surfaces, on either side.
const SUM_COVERAGE: u32 = 10u;
/// Number of sums that a surface adds to the face on which it is visible: all but the coverage, which counts on both
/// sides.
const N_SURFACE_SUMS: u32 = 10u;
/// Sums of a record, of two words each.
const N_SUMS: u32 = 11u;

/// The slots whose sums are in memory, and the scale of emission in them.
struct SlotRange {
    first: u32,
    n: u32,
    /// The largest emission of a material [W·sr⁻¹·m⁻²].
    brightest: f32,
    reserved: u32,
}

/// What a face looks like.
struct VoxelFace {
    /// Linear, 0 to 1.
    albedo: vec3<f32>,
    /// 0 to 1.
    coverage: f32,
    /// Unit length.
    normal: vec3<f32>,
    /// Length of the mean normal, 0 to 1.
    agreement: f32,
    /// [W·sr⁻¹·m⁻²]
    emission: vec3<f32>,
}

/// A face as a record; see the table above. The normal is not zero.
fn encode_face(face: VoxelFace) -> vec4<u32> {
    let albedo = vec3<u32>(clamp(face.albedo, vec3<f32>(0.0), vec3<f32>(1.0)) * 1023.0 + 0.5);
    return vec4<u32>(
        albedo.x | (albedo.y << 10u) | (albedo.z << 20u) | RECORD_VALID,
        pack_direction(face.normal),
        pack_shared_exponent(face.emission),
        pack2x16unorm(vec2<f32>(face.coverage, face.agreement)),
    );
}

/// Whether a surface faces either side of the record's axis.
fn record_is_valid(record: vec4<u32>) -> bool {
    return (record.x & RECORD_VALID) != 0u;
}

/// Whether no surface faces the record's side, so that only backs of single-sided ones are visible.
fn record_is_back(record: vec4<u32>) -> bool {
    return (record.x & RECORD_BACK) != 0u;
}

/// The face of a record; if it is not valid, coverage and albedo are 0.
fn decode_face(record: vec4<u32>) -> VoxelFace {
    let albedo = (vec3<u32>(record.x) >> vec3<u32>(0u, 10u, 20u)) & vec3<u32>(0x3ffu);
    let shares = unpack2x16unorm(record.w);
    return VoxelFace(
        vec3<f32>(albedo) / 1023.0,
        shares.x,
        unpack_direction(record.y),
        shares.y,
        unpack_shared_exponent(record.z),
    );
}

/// An area of a cell of edge 1 (at most √2) in units of weight, rounded to nearest.
fn weight_of_area(area: f32) -> u32 {
    return u32(min(area * WEIGHT_SCALE + 0.5, 524287.0));
}

/// Albedo of 0 to 1 in steps.
fn quantize_albedo(albedo: vec3<f32>) -> vec3<u32> {
    return vec3<u32>(clamp(albedo, vec3<f32>(0.0), vec3<f32>(1.0)) * ALBEDO_SCALE + 0.5);
}

/// A unit normal in steps from −1.
fn quantize_normal(normal: vec3<f32>) -> vec3<u32> {
    let bounded = clamp(normal, vec3<f32>(-1.0), vec3<f32>(1.0));
    return vec3<u32>((bounded + 1.0) * NORMAL_SCALE + 0.5);
}

/// Emission in steps; `brightest`: the largest of the scene's materials, 0 if none emits light.
fn quantize_emission(emission: vec3<f32>, brightest: f32) -> vec3<u32> {
    let share = select(vec3<f32>(0.0), emission / brightest, brightest > 0.0);
    return vec3<u32>(clamp(share, vec3<f32>(0.0), vec3<f32>(1.0)) * EMISSION_SCALE + 0.5);
}

/// Weight of a part of a triangle in a voxel with one value. `area`: the part's area vector [cells²]. A part that only
/// touches has the smallest weight, 1.
fn weight_of_part(area: vec3<f32>) -> u32 {
    return max(weight_of_area(length(area)), 1u);
}

/// Weights of a part of a triangle in the face of each axis that it faces (or, for its other side, faces away from):
/// its area, projected onto them. `area`: the part's area vector [cells²]; `normal`: the triangle's, unit length. A
/// part that only touches has the smallest weight, 1, along the axes where the normal is longest; otherwise 0 means
/// that there is nothing to add.
fn weights_of_part(area: vec3<f32>, normal: vec3<f32>) -> vec3<u32> {
    let projected = abs(area);
    let looks = abs(normal);
    let longest = max(looks.x, max(looks.y, looks.z));
    return vec3<u32>(
        max(weight_of_area(projected.x), u32(looks.x >= longest)),
        max(weight_of_area(projected.y), u32(looks.y >= longest)),
        max(weight_of_area(projected.z), u32(looks.z >= longest)),
    );
}

/// weight × steps of emission as a 64-bit number (low, high). `weight` below 2¹⁹, `steps` below 2¹⁸.
fn weigh_emission(weight: u32, steps: u32) -> vec2<u32> {
    // Halves of 9 bits: the products are below 2²⁸.
    let upper = weight * (steps >> 9u);
    let lower = weight * (steps & 511u);
    let low = (upper << 9u) + lower;
    return vec2<u32>(low, (upper >> 23u) + select(0u, 1u, low < lower));
}

/// The numbers that a surface adds to the first N_SURFACE_SUMS sums of a face, by SUM_ constants, as 64-bit numbers
/// (low, high).
///
/// `albedo`: in [0, 1]; `normal`: unit length, of the surface's visible side; `emission` [W·sr⁻¹·m⁻²], at most
/// `brightest`; `weight`: from [`weight_of_part`] or [`weights_of_part`].
fn sums_of_surface(
    weight: u32,
    albedo: vec3<f32>,
    normal: vec3<f32>,
    emission: vec3<f32>,
    brightest: f32,
) -> array<vec2<u32>, N_SURFACE_SUMS> {
    var out = array<vec2<u32>, N_SURFACE_SUMS>();
    let colors = quantize_albedo(albedo);
    let steps = quantize_normal(normal);
    let light = quantize_emission(emission, brightest);
    out[SUM_WEIGHT] = vec2<u32>(weight, 0u);
    for (var k = 0u; k < 3u; k++) {
        out[SUM_ALBEDO + k] = vec2<u32>(weight * colors[k], 0u);
        out[SUM_NORMAL + k] = vec2<u32>(weight * steps[k], 0u);
        out[SUM_EMISSION + k] = weigh_emission(weight, light[k]);
    }
    return out;
}

/// A 64-bit number (low, high) as f32, with a relative error of at most 1e-7.
fn float_of_sum(sum: vec2<u32>) -> f32 {
    return f32(sum.y) * 4294967296.0 + f32(sum.x);
}

/// The face that follows from its sums, as f32 and by SUM_ constants.
///
/// A face without any weight shows the back of what is visible from the other side: `other` are the opposite face's
/// sums, from which it takes the albedo and the reversed normal, without emission. (One sheet of cloth reflects on both
/// sides.) The coverage is its own. If neither has a weight, everything is 0, including the normal: such a face must
/// not be encoded.
fn face_of_sums(
    sums: array<f32, N_SUMS>,
    other: array<f32, N_SUMS>,
    brightest: f32,
) -> VoxelFace {
    var face = VoxelFace();
    let back = sums[SUM_WEIGHT] == 0.0;
    var seen = sums;
    if back {
        seen = other;
    }
    let weight = seen[SUM_WEIGHT];
    if weight == 0.0 {
        return face;
    }
    face.albedo = vec3<f32>(seen[SUM_ALBEDO], seen[SUM_ALBEDO + 1u], seen[SUM_ALBEDO + 2u])
        / (weight * ALBEDO_SCALE);
    let mean = vec3<f32>(seen[SUM_NORMAL], seen[SUM_NORMAL + 1u], seen[SUM_NORMAL + 2u])
        / (weight * NORMAL_SCALE) - 1.0;
    face.agreement = min(length(mean), 1.0);
    face.normal = safe_normalize(select(mean, -mean, back), vec3<f32>(0.0, 1.0, 0.0));
    if !back {
        face.emission = vec3<f32>(
            seen[SUM_EMISSION],
            seen[SUM_EMISSION + 1u],
            seen[SUM_EMISSION + 2u],
        ) / (weight * EMISSION_SCALE) * brightest;
    }
    face.coverage = min(sums[SUM_COVERAGE] / WEIGHT_SCALE, 1.0);
    return face;
}
