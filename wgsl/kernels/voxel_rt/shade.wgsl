// SPDX-License-Identifier: MIT OR Apache-2.0
//! Indirect light of a picture's surfaces, looked up in the voxels.
//!
//! Dispatch: ceil(width/8) × ceil(height/8) × 1. Workgroup memory: none. Cost: a look-up a pixel,
//! whatever was traced into the voxels.

#import lucerna::bsdf::directional_albedo::directional_albedo
#import lucerna::bsdf::metallic_roughness::metallic_roughness
#import lucerna::frame::gbuffer::{GBufferSurface, GBufferTexels, decode_gbuffer}
#import lucerna::frame::view::FrameView
#import lucerna::math::constants::INV_PI
#import lucerna::math::float::all_finite
#import lucerna::voxel::bricks::{NO_SLOT, bit_of_cell, brick_of_cell, slot_of_bit}
#import lucerna::voxel::grid::{faces_of_direction, grid_from_world, is_inside}
#import lucerna::voxel::levels::{VoxelLevel, VoxelLevels, level_weight, slot_word}
#import lucerna::voxel::lookup::{face_weights, tap_cell, tap_weight, taps_at}
#import lucerna::voxel_rt::cache::{FaceLight, LightSum, add_share, add_weighted, coverage}
#import lucerna::voxel_rt::walls::{keep_before_walls, undivided}

const WORKGROUP: u32 = 8u;
/// How far the point looked up is moved along its normal [cells], so that no cell behind the surface
/// is among the taps.
const NORMAL_OFFSET: f32 = 0.5;
/// How far a point is moved along its normal to tell the cell that its surface stands in [cells]: a
/// surface on a border belongs to the cell before it.
const SIDE_OFFSET: f32 = 1e-2;
/// Values of `lookup`.
const LOOKUP_VALID: u32 = 0u;
const LOOKUP_TRILINEAR: u32 = 1u;
const LOOKUP_SEVEN_TAP: u32 = 2u;

struct ShadeInfo {
    /// LOOKUP_ constant.
    lookup: u32,
    reserved_a: u32,
    reserved_b: u32,
    reserved_c: u32,
}

@group(1) @binding(0) var<uniform> view: FrameView;
@group(1) @binding(1) var albedo_texture: texture_2d<f32>;
@group(1) @binding(2) var normal_texture: texture_2d<u32>;
@group(1) @binding(3) var emission_texture: texture_2d<f32>;
@group(1) @binding(4) var depth_texture: texture_depth_2d;
@group(2) @binding(0) var<uniform> levels: VoxelLevels;
@group(2) @binding(1) var<uniform> info: ShadeInfo;
@group(2) @binding(2) var<storage, read> structure: array<vec2<u32>>;
@group(2) @binding(3) var<storage, read> lights: array<FaceLight>;
/// rgb: radiance [W·sr⁻¹·m⁻²].
@group(2) @binding(4) var indirect: texture_storage_2d<rgba32float, write>;

/// The slot of a cell, or NO_SLOT.
fn slot_of_cell(level: VoxelLevel, cell: vec3<i32>) -> u32 {
    if !is_inside(level.grid, cell) {
        return NO_SLOT;
    }
    let brick = structure[level.first_brick + brick_of_cell(level.grid, vec3<u32>(cell))];
    return slot_of_bit(brick.x, brick.y, bit_of_cell(vec3<u32>(cell)));
}

/// The walls of a voxel (`lucerna::voxel_rt::walls`); none where there is no voxel, or one value a voxel.
fn walls_of_slot(level: VoxelLevel, slot: u32) -> u32 {
    if slot == NO_SLOT || level.grid.n_faces == 1u {
        return 0u;
    }
    return structure[slot_word(level, slot)].y;
}

/// What a level holds around a point of its grid, on the side of the normal: a sum weighted by
/// distance, by how much each face looks that way, and by how much of it a surface covers.
/// `only_valid` false: every cell counts, empty ones as dark.
fn light_in_level(level: VoxelLevel, at: vec3<f32>, normal: vec3<f32>, only_valid: bool) -> LightSum {
    let weights = face_weights(level.grid, normal);
    let faces = select(faces_of_direction(normal), vec3<u32>(0u), level.grid.n_faces == 1u);
    var taps = taps_at(at);
    if only_valid {
        let own_cell = floor(at + normal * SIDE_OFFSET);
        let walls = walls_of_slot(level, slot_of_cell(level, vec3<i32>(own_cell)));
        taps = taps_at(keep_before_walls(walls, at, own_cell, at + normal * NORMAL_OFFSET));
    }
    var sum: LightSum;
    for (var ix = 0u; ix < 8u; ix++) {
        let weight = tap_weight(taps, ix);
        sum.weight += select(weight, 0.0, only_valid);
        let slot = slot_of_cell(level, tap_cell(taps, ix));
        if slot == NO_SLOT {
            continue;
        }
        var shares = weight * weights;
        if only_valid {
            shares *= undivided(walls_of_slot(level, slot));
        }
        for (var axis = 0u; axis < 3u; axis++) {
            if weights[axis] > 0.0 {
                let light = lights[level.first_record + slot * level.grid.n_faces + faces[axis]];
                if only_valid {
                    sum = add_weighted(sum, light.indirect, shares[axis] * coverage(light));
                } else {
                    sum.irradiance += shares[axis] * light.indirect;
                }
            }
        }
    }
    return sum;
}

/// Indirect irradiance at a surface point [W·m⁻²], by the chosen look-up.
fn indirect_irradiance(position: vec3<f32>, normal: vec3<f32>) -> vec3<f32> {
    var out: LightSum;
    for (var ix = 0u; ix < levels.n_levels && out.weight < 1.0; ix++) {
        let level = levels.levels[ix];
        let point = grid_from_world(level.grid, position);
        let is_last = ix + 1u == levels.n_levels;
        let share = (1.0 - out.weight) * select(level_weight(level.grid, point), 1.0, is_last);
        if share <= 0.0 {
            continue;
        }
        // The centre, then a cell to either side along each axis.
        let n_lookups = select(1u, 7u, info.lookup == LOOKUP_SEVEN_TAP);
        var found: LightSum;
        for (var tap = 0u; tap < n_lookups; tap++) {
            var offset = vec3<f32>(0.0);
            if tap > 0u {
                offset[(tap - 1u) >> 1u] += select(-1.0, 1.0, (tap & 1u) != 0u);
            }
            let one = light_in_level(level, point + offset, normal, info.lookup == LOOKUP_VALID);
            found.irradiance += one.irradiance;
            found.weight += one.weight;
        }
        if found.weight > 0.0 {
            out = add_share(out, found, share);
        }
    }
    return out.irradiance;
}

@compute @workgroup_size(WORKGROUP, WORKGROUP)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if any(id.xy >= view.size) {
        return;
    }
    let texels = GBufferTexels(
        textureLoad(albedo_texture, id.xy, 0),
        textureLoad(normal_texture, id.xy, 0).xy,
        textureLoad(emission_texture, id.xy, 0),
        textureLoad(depth_texture, id.xy, 0),
    );
    let surface = decode_gbuffer(view, id.xy, texels);
    var radiance = vec3<f32>(0.0);
    if surface.is_surface {
        var albedo = surface.albedo;
        if !surface.lambert {
            let material = metallic_roughness(surface.albedo, surface.metallic, surface.roughness);
            albedo = directional_albedo(material, dot(surface.to_viewer, surface.shading_normal));
        }
        radiance = albedo * INV_PI * indirect_irradiance(surface.position, surface.shading_normal);
    }
    textureStore(indirect, id.xy, vec4<f32>(select(vec3<f32>(0.0), radiance, all_finite(radiance)), 1.0));
}
