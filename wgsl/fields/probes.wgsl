// SPDX-License-Identifier: MIT OR Apache-2.0
//! Field: light of probes at the corners of the cells that surfaces meet, looked up at surface points.
//!
//! Interface: `probes`, `probe_of_corner`, `position_of_probe`, `probe_irradiance`. The layout of `probe_structure`:
//! `lucerna::components::voxels::bricks`, over the lattice of corners instead of cells.
#define_import_path lucerna::fields::probes

#import lucerna::components::probes::air::{MIDDLE_STRIDE, WIDE_STRIDE, air_below}
#import lucerna::components::probes::basis::{WORDS, unpack_light}
#import lucerna::components::probes::octahedral_map::{MAP_SIDE, map_taps}
#import lucerna::components::probes::place::{place_is_inside, place_moved}
#import lucerna::components::probes::probe_light::{ProbeLight, light_irradiance}
#import lucerna::components::probes::visibility::{seen_share, without_bleeding, wrapped_weight}
#import lucerna::components::voxels::bricks::{NO_SLOT, brick_of_cell, slot_in_brick}
#import lucerna::components::voxels::grid::{VoxelGrid, grid_from_world, is_inside, unpack_cell, world_from_grid}

/// Where the look-up finds its cell: a surface on the border between two cells belongs to the one in front of it [cells].
const CELL_OFFSET: f32 = 1e-3;
/// Weight of a probe that does not see a point: it counts where none does.
const HIDDEN_WEIGHT: f32 = 1e-5;
/// Weight of a probe that is inside something: it counts where there are no others.
const INSIDE_WEIGHT: f32 = 1e-3;

struct Probes {
    /// The lattice: "cells" are the corners of the grid's cells, at whole numbers.
    lattice: VoxelGrid,
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
    reserved_a: u32,
    reserved_b: u32,
    reserved_c: u32,
}

@group(3) @binding(32) var<uniform> probes: Probes;
@group(3) @binding(33) var<storage, read> probe_structure: array<vec2<u32>>;
/// WORDS for each probe (`lucerna::components::probes::basis`): the radiance that arrives and was reflected at least once.
@group(3) @binding(34) var<storage, read> probe_light: array<u32>;
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

/// The two words of a probe: its packed corner, and its place (`lucerna::components::probes::place`).
fn record_of_probe(probe: u32) -> vec2<u32> {
    let bricks = probes.lattice.bricks;
    return probe_structure[bricks.x * bricks.y * bricks.z + probe];
}

/// Where a probe is [m].
fn position_of_probe(probe: u32) -> vec3<f32> {
    let record = record_of_probe(probe);
    return world_from_grid(probes.lattice, vec3<f32>(unpack_cell(record.x)) + place_moved(record.y));
}

/// The light of a probe.
fn light_of_probe(probe: u32) -> ProbeLight {
    var words: array<u32, WORDS>;
    for (var k = 0u; k < WORDS; k++) {
        words[k] = probe_light[probe * WORDS + k];
    }
    return unpack_light(words);
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

/// A point that is asked for its light.
struct ProbeQuery {
    /// In units of the lattice.
    point: vec3<f32>,
    /// The point, moved along its normal, from which distances are compared.
    biased: vec3<f32>,
    /// Unit length.
    normal: vec3<f32>,
}

/// How much a probe counts for a point besides its distance, in [0, 1.2].
fn probe_weight(probe: u32, query: ProbeQuery) -> f32 {
    let record = record_of_probe(probe);
    let place = vec3<f32>(unpack_cell(record.x)) + place_moved(record.y);
    var weight = select(1.0, INSIDE_WEIGHT, place_is_inside(record.y));
    if probes.wraps != 0u {
        let to_probe = place - query.point;
        weight *= wrapped_weight(query.normal, to_probe / max(length(to_probe), 1e-6));
    }
    if probes.uses_distances != 0u {
        let from_probe = query.biased - place;
        let distance = length(from_probe);
        if distance > 0.0 {
            let seen = seen_share(distance, probe_moments(probe, from_probe), probes.least_variance);
            weight *= without_bleeding(seen * seen * seen, probes.bleeding) + HIDDEN_WEIGHT;
        }
    }
    return weight;
}

/// A corner of a cell of the air, and its share of the interpolation.
struct AirCorner {
    corner: vec3<u32>,
    share: f32,
}

/// The corner `ix` (0 to 7) of the cell of a stride around a corner of the lattice, and its share there.
fn corner_around(corner: vec3<u32>, stride: u32, ix: u32) -> AirCorner {
    let low = air_below(corner, stride);
    let high = min(low + stride, probes.lattice.size - 1u);
    let upper = vec3<f32>(corner - low) / vec3<f32>(max(high - low, vec3<u32>(1u)));
    let is_upper = ((vec3<u32>(ix) >> vec3<u32>(0u, 1u, 2u)) & vec3<u32>(1u)) != vec3<u32>(0u);
    let along = select(1.0 - upper, upper, is_upper);
    return AirCorner(select(low, high, is_upper), along.x * along.y * along.z);
}

/// rgb: the irradiance by reflected light at a surface point [W·m⁻²], at least 0; a: the weight of the probes that were found, 0 if
/// there are none.
///
/// Trilinear in the cell of the lattice around the point, times `probe_weight`; a corner without a probe (in the air) stands for those
/// of its middle cell, and one of those that has none for those of its wide cell. A point outside the lattice gets the light of its
/// border. Each probe's light is evaluated, and irradiances are blended: a sum of coefficients needs so many registers that it took
/// 1.8 times as long on an H100. `position` [m]; `normal`: unit length, on the side that is lit.
fn probe_irradiance(position: vec3<f32>, normal: vec3<f32>) -> vec4<f32> {
    let point = grid_from_world(probes.lattice, position);
    let last = vec3<f32>(probes.lattice.size) - 2.0;
    let cell = clamp(floor(point + normal * CELL_OFFSET), vec3<f32>(0.0), last);
    let upper = clamp(point - cell, vec3<f32>(0.0), vec3<f32>(1.0));
    let query = ProbeQuery(point, point + normal * probes.normal_bias, normal);
    var sum = vec4<f32>(0.0);
    for (var ix = 0u; ix < 8u; ix++) {
        let is_upper = ((vec3<u32>(ix) >> vec3<u32>(0u, 1u, 2u)) & vec3<u32>(1u)) != vec3<u32>(0u);
        let along = select(1.0 - upper, upper, is_upper);
        let fine = AirCorner(
            vec3<u32>(cell) + select(vec3<u32>(0u), vec3<u32>(1u), is_upper),
            along.x * along.y * along.z,
        );
        let fine_probe = probe_of_corner(vec3<i32>(fine.corner));
        let n_middle = select(8u, 1u, fine_probe != NO_SLOT);
        for (var middle_ix = 0u; middle_ix < n_middle && fine.share > 0.0; middle_ix++) {
            var middle = AirCorner(fine.corner, 1.0);
            var middle_probe = fine_probe;
            if fine_probe == NO_SLOT {
                middle = corner_around(fine.corner, MIDDLE_STRIDE, middle_ix);
                middle_probe = probe_of_corner(vec3<i32>(middle.corner));
            }
            let n_wide = select(8u, 1u, middle_probe != NO_SLOT);
            for (var wide_ix = 0u; wide_ix < n_wide && middle.share > 0.0; wide_ix++) {
                var share = fine.share * middle.share;
                var probe = middle_probe;
                if middle_probe == NO_SLOT {
                    let wide = corner_around(middle.corner, WIDE_STRIDE, wide_ix);
                    share *= wide.share;
                    probe = probe_of_corner(vec3<i32>(wide.corner));
                }
                if share > 0.0 && probe != NO_SLOT {
                    let weight = share * probe_weight(probe, query);
                    sum += weight * vec4<f32>(light_irradiance(light_of_probe(probe), normal), 1.0);
                }
            }
        }
    }
    if !(sum.a > 0.0) {
        return vec4<f32>(0.0);
    }
    return vec4<f32>(max(sum.rgb / sum.a, vec3<f32>(0.0)), sum.a);
}
