// SPDX-License-Identifier: MIT OR Apache-2.0
//! Field: light of probes at the corners of the cells that surfaces meet, looked up at surface points.
//!
//! Interface: `probes`, `probe_of_corner`, `position_of_probe`, `probe_irradiance`. The layout of `probe_structure`:
//! `lucerna::components::voxels::bricks`, over the lattice of corners instead of cells.
#define_import_path lucerna::fields::probes

#import lucerna::components::probes::octahedral_map::{MAP_SIDE, map_taps}
#import lucerna::components::probes::visibility::{seen_share, without_bleeding, wrapped_weight}
#import lucerna::components::voxels::bricks::{NO_SLOT, brick_of_cell, slot_in_brick}
#import lucerna::components::voxels::grid::{VoxelGrid, grid_from_world, is_inside, unpack_cell, world_from_grid}
#import lucerna::sh::convolve::sh2_irradiance
#import lucerna::sh::window::sh2_window

/// Coefficients of a probe: 9 for order 2.
const COEFFICIENTS: u32 = 9u;
/// Where the look-up finds its cell: a surface on the border between two cells belongs to the one in front of it [cells].
const CELL_OFFSET: f32 = 1e-3;

/// Weight of a probe that does not see a point: it counts where none does.
const HIDDEN_WEIGHT: f32 = 1e-5;

struct Probes {
    /// The lattice: "cells" are the corners of the grid's cells, at whole numbers.
    lattice: VoxelGrid,
    /// Factors of the bands 0 to 2 (`lucerna::sh::window`).
    window: vec3<f32>,
    /// 1: probes that do not see the point, by their maps of distances, count less.
    uses_distances: u32,
    /// How far a point is moved along its normal before distances are compared [cells].
    normal_bias: f32,
    /// 1: probes behind the surface count less (`wrapped_weight`).
    wraps: u32,
    /// Variance that a map's texel has at least [cells²].
    least_variance: f32,
    /// See `without_bleeding`.
    bleeding: f32,
}

@group(3) @binding(32) var<uniform> probes: Probes;
@group(3) @binding(33) var<storage, read> probe_structure: array<vec2<u32>>;
/// Nine for each probe: rgb: coefficient of the radiance that arrives [W·sr⁻¹·m⁻²], reflected at least once; a of the first: the
/// probe's weight, 1, or little if it is inside something.
@group(3) @binding(34) var<storage, read> probe_light: array<vec4<f32>>;
/// MAP_SIDE² for each probe: mean distance to surfaces [cells] and mean of its square, two halfs (`pack2x16float`).
@group(3) @binding(35) var<storage, read> probe_distances: array<u32>;

/// The probe at a corner, or NO_SLOT.
fn probe_of_corner(corner: vec3<i32>) -> u32 {
    if !is_inside(probes.lattice, corner) {
        return NO_SLOT;
    }
    let brick = probe_structure[brick_of_cell(probes.lattice, vec3<u32>(corner))];
    return slot_in_brick(brick, vec3<u32>(corner));
}

/// Where a probe is [m].
fn position_of_probe(probe: u32) -> vec3<f32> {
    let bricks = probes.lattice.bricks;
    let packed = probe_structure[bricks.x * bricks.y * bricks.z + probe].x;
    return world_from_grid(probes.lattice, vec3<f32>(unpack_cell(packed)));
}

/// Mean distance to surfaces in a direction from a probe [cells], and mean of its square.
fn probe_moments(probe: u32, direction: vec3<f32>) -> vec2<f32> {
    let taps = map_taps(direction);
    var moments = vec2<f32>(0.0);
    for (var ix = 0u; ix < 4u; ix++) {
        let texel = probe_distances[probe * MAP_SIDE * MAP_SIDE + taps.texels[ix]];
        moments += taps.weights[ix] * unpack2x16float(texel);
    }
    return moments;
}

/// How much a probe at `corner` counts for a point besides its distance, in [0, 1.2]. `point`, `biased`, `corner`: in units of the
/// grid; `normal`: unit length.
fn probe_weight(probe: u32, corner: vec3<f32>, point: vec3<f32>, biased: vec3<f32>, normal: vec3<f32>) -> f32 {
    var weight = 1.0;
    if probes.wraps != 0u {
        let to_probe = corner - point;
        weight = wrapped_weight(normal, to_probe / max(length(to_probe), 1e-6));
    }
    if probes.uses_distances != 0u {
        let from_probe = biased - corner;
        let distance = length(from_probe);
        if distance > 0.0 {
            let seen = seen_share(distance, probe_moments(probe, from_probe), probes.least_variance);
            weight *= without_bleeding(seen * seen * seen, probes.bleeding) + HIDDEN_WEIGHT;
        }
    }
    return weight;
}

/// rgb: the irradiance by reflected light at a surface point [W·m⁻²], at least 0; a: the weight of the probes that were found, 0 if
/// there are none.
///
/// Coefficients are blended first (trilinear, times `probe_weight`), and evaluated once. `position` [m]; `normal`: unit length, on the
/// side that is lit.
fn probe_irradiance(position: vec3<f32>, normal: vec3<f32>) -> vec4<f32> {
    let point = grid_from_world(probes.lattice, position);
    let cell = floor(point + normal * CELL_OFFSET);
    let upper = clamp(point - cell, vec3<f32>(0.0), vec3<f32>(1.0));
    let biased = point + normal * probes.normal_bias;
    var light: array<vec3<f32>, COEFFICIENTS>;
    var total = 0.0;
    for (var ix = 0u; ix < 8u; ix++) {
        let is_upper = ((vec3<u32>(ix) >> vec3<u32>(0u, 1u, 2u)) & vec3<u32>(1u)) != vec3<u32>(0u);
        let corner = cell + select(vec3<f32>(0.0), vec3<f32>(1.0), is_upper);
        let probe = probe_of_corner(vec3<i32>(corner));
        if probe == NO_SLOT {
            continue;
        }
        let first = probe * COEFFICIENTS;
        let along = select(1.0 - upper, upper, is_upper);
        let weight = along.x * along.y * along.z * probe_light[first].a
            * probe_weight(probe, corner, point, biased, normal);
        if weight == 0.0 {
            continue;
        }
        for (var k = 0u; k < COEFFICIENTS; k++) {
            light[k] += weight * probe_light[first + k].rgb;
        }
        total += weight;
    }
    if !(total > 0.0) {
        return vec4<f32>(0.0);
    }
    for (var k = 0u; k < COEFFICIENTS; k++) {
        light[k] /= total;
    }
    return vec4<f32>(max(sh2_irradiance(sh2_window(light, probes.window), normal), vec3<f32>(0.0)), total);
}
