// SPDX-License-Identifier: MIT OR Apache-2.0
//! Writes the light of the voxels' faces into mip 0, for every cell of a level, including empty ones.
//!
//! The opacity of a face is the share that its surfaces cover (`components::voxels::attributes`,
//! `components::voxel_pyramid::opacity`), and its radiance is L = ρ/π·E, where E is the irradiance from
//! `voxel_light/publish`; if that is not known, the face is dark. Emission is not included: emissive surfaces are
//! sampled as lights, for voxels and for pixels, and would count twice.
//!
//! Backs of single-sided surfaces are open by default. They are not meant to be seen, but a cone that widens next to a
//! wall would read the wall's voxels, and with them its dark back, although it never comes from behind.
//!
//! Dispatch: ceil(size/4) groups of 4 × 4 × 4. Workgroup memory: none. Each invocation owns its cell's texels.

#import lucerna::cone::medium::texel_of_surface
#import lucerna::components::voxel_pyramid::opacity::opacity_of_faces
#import lucerna::components::voxel_pyramid::gaps::{GapPairs, add_gap_pair, gap_step, texel_of_gap}
#import lucerna::components::voxel_pyramid::layout::{MAX_MIPS, radiance_scale, texel_of_cell}
#import lucerna::fields::pyramid_texels::{filled, store_texel}
#import lucerna::fields::voxel_structure::slot_of_cell
#import lucerna::math::constants::INV_PI
#import lucerna::math::float::all_finite
#import lucerna::components::voxels::attributes::{decode_face, record_is_back, record_is_valid}
#import lucerna::components::voxels::bricks::NO_SLOT
#import lucerna::components::voxels::levels::VoxelLevels
#import lucerna::components::voxel_light::cache::{FaceLight, hit_depth}

const SIDE: u32 = 4u;

struct FillInfo {
    /// Index of the level.
    level: u32,
    /// 1: if a cell has no surface that faces a face's way, but two opposite neighbours next to that face have one, it
    /// takes their mean. (The voxelizer misses no surface; gaps are slits narrower than a cell, and the steps of
    /// slanted surfaces.)
    fills_gaps: u32,
    /// 1: a face at which only backs of single-sided surfaces are visible is as opaque as they are. 0: it is open.
    backs_hide: u32,
    reserved: u32,
}

@group(1) @binding(0) var<uniform> levels: VoxelLevels;
@group(1) @binding(1) var<uniform> info: FillInfo;
/// Only this level's, indexed by slot · n_faces + face: `components::voxels::attributes`.
@group(1) @binding(2) var<storage, read> records: array<vec4<u32>>;
/// rgb: irradiance [W·m⁻²].
@group(1) @binding(3) var<storage, read> irradiance: array<vec4<f32>>;
@group(1) @binding(4) var<storage, read> lights: array<FaceLight>;

/// The texel of a voxel's face of this opacity; zeros if it has no surface.
fn texel_of_face(slot: u32, face: u32, opacity: f32) -> vec4<f32> {
    let level = levels.levels[info.level];
    let record = slot * level.grid.n_faces + face;
    let packed = record_of(slot, face);
    if !is_seen(packed) {
        return vec4<f32>(0.0);
    }
    let surface = decode_face(packed);
    let received = irradiance[level.first_record + record].rgb;
    var radiance = surface.albedo * INV_PI * received;
    if !all_finite(radiance) {
        radiance = vec3<f32>(0.0);
    }
    return texel_of_surface(max(radiance, vec3<f32>(0.0)) * radiance_scale(filled.peak), opacity);
}

/// The attributes of a voxel's face.
fn record_of(slot: u32, face: u32) -> vec4<u32> {
    return records[slot * levels.levels[info.level].grid.n_faces + face];
}

/// Whether a face is visible to cones.
fn is_seen(packed: vec4<u32>) -> bool {
    return record_is_valid(packed) && (info.backs_hide != 0u || !record_is_back(packed));
}

/// The opacity of a voxel's six faces: their coverage, closed where walls meet.
fn opacities_of(slot: u32) -> array<f32, 6> {
    let level = levels.levels[info.level];
    var out = array<f32, 6>();
    if level.grid.n_faces == 1u {
        out[0] = decode_face(records[slot]).coverage;
        return out;
    }
    var depth = array<f32, 6>();
    for (var face = 0u; face < 6u; face++) {
        let record = slot * 6u + face;
        let packed = records[record];
        out[face] = decode_face(packed).coverage;
        let known = lights[level.first_record + record];
        let is_front = record_is_valid(packed) && !record_is_back(packed) && known.n_hits > 0.0;
        depth[face] = select(-1.0, hit_depth(known), is_front);
    }
    return opacity_of_faces(out, depth);
}

@compute @workgroup_size(SIDE, SIDE, SIDE)
fn main(@builtin(global_invocation_id) cell: vec3<u32>) {
    let level = levels.levels[info.level];
    if any(cell >= level.grid.size) {
        return;
    }
    let entry = filled.mips[info.level * MAX_MIPS];
    let slot = slot_of_cell(level, vec3<i32>(cell));
    var opacities: array<f32, 6>;
    if slot != NO_SLOT {
        opacities = opacities_of(slot);
    }
    for (var face = 0u; face < level.grid.n_faces; face++) {
        var texel = vec4<f32>(0.0);
        if slot != NO_SLOT {
            texel = texel_of_face(slot, face, opacities[face]);
        }
        if info.fills_gaps != 0u && texel.a == 0.0 {
            texel = between_neighbours(vec3<i32>(cell), face);
        }
        store_texel(0u, texel_of_cell(entry, face, vec3<i32>(cell)), texel);
    }
}

/// The mean of the pairs of opposite neighbours next to a face that both have a surface there; zeros if there is no
/// such pair.
fn between_neighbours(cell: vec3<i32>, face: u32) -> vec4<f32> {
    let level = levels.levels[info.level];
    var pairs: GapPairs;
    for (var pair = 0u; pair < 2u; pair++) {
        let step = gap_step(face, pair);
        let slots = vec2<u32>(slot_of_cell(level, cell - step), slot_of_cell(level, cell + step));
        if slots.x != NO_SLOT && slots.y != NO_SLOT {
            let one = texel_of_face(slots.x, face, decode_face(record_of(slots.x, face)).coverage);
            let other = texel_of_face(slots.y, face, decode_face(record_of(slots.y, face)).coverage);
            pairs = add_gap_pair(pairs, one, other);
        }
    }
    return texel_of_gap(pairs);
}
