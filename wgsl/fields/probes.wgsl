// SPDX-License-Identifier: MIT OR Apache-2.0
//! Field: light of probes, looked up at surface points: of those at the corners of the cells that surfaces meet.
//!
//! Interface: `probe_irradiance`; for a lattice, also `probe_of_corner` and `record_of_probe`. The layout of `probe_structure`:
//! `lucerna::components::voxels::bricks`, over the lattice of corners instead of cells. The variant `probes=net` looks up nets instead.
#define_import_path lucerna::fields::probes

#import lucerna::components::probes::air::{MIDDLE_STRIDE, WIDE_STRIDE, air_below}
#import lucerna::components::probes::masks::{MASK_SIDE, MASK_WORDS, mask_bit}
#import lucerna::components::probes::place::{place_is_inside, place_moved}
#import lucerna::components::probes::probe_light::light_irradiance
#import lucerna::components::voxels::bricks::{BRICK, NO_SLOT, brick_of_cell, slot_in_brick}
#import lucerna::components::voxels::grid::{grid_from_world, is_inside, unpack_cell}
#import lucerna::fields::probe_store::{HIDDEN_WEIGHT, ProbePlace, ProbeQuery, SIGHT_MASKS, blended_light, light_of_blend}
#import lucerna::fields::probe_store::{light_of_probe, probe_distances, probe_weight, probes}

/// Where the look-up finds its cell: a surface on the border between two cells belongs to the one in front of it [cells].
const CELL_OFFSET: f32 = 1e-3;
/// A lattice's maps hold all distances that are asked for.
const NO_REACH: f32 = 1e30;

@group(3) @binding(33) var<storage, read> probe_structure: array<vec2<u32>>;

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

/// Where a probe is [cells of the lattice].
fn place_of_probe(probe: u32) -> ProbePlace {
    let record = record_of_probe(probe);
    let place = vec3<f32>(unpack_cell(record.x)) + place_moved(record.y);
    return ProbePlace(place, place_is_inside(record.y), NO_REACH);
}

/// The corners' masks of a cell, and a point's bit in them.
struct CellMasks {
    /// Where they begin in `probe_distances`; NO_SLOT: all corners see the cell.
    first: u32,
    bit: u32,
}

/// The masks for a point in a cell, `upper` [cells] from its least corner.
fn masks_of_cell(cell: vec3<u32>, upper: vec3<f32>) -> CellMasks {
    if probes.sight != SIGHT_MASKS {
        return CellMasks(NO_SLOT, 0u);
    }
    // The grid of cells has one less along each axis than the lattice.
    let bricks = (probes.lattice.size - 1u + BRICK - 1u) / BRICK;
    let at = cell / BRICK;
    let brick = (at.z * bricks.y + at.y) * bricks.x + at.x;
    let words = vec2<u32>(probe_distances[2u * brick], probe_distances[2u * brick + 1u]);
    let slot = slot_in_brick(words, cell);
    if slot == NO_SLOT {
        return CellMasks(NO_SLOT, 0u);
    }
    let subvolume = min(vec3<u32>(upper * f32(MASK_SIDE)), vec3<u32>(MASK_SIDE - 1u));
    return CellMasks(2u * bricks.x * bricks.y * bricks.z + MASK_WORDS * slot, mask_bit(subvolume));
}

/// How much the probe at a corner (0 to 7) of a cell counts by its mask.
fn mask_weight(masks: CellMasks, corner: u32) -> f32 {
    if masks.first == NO_SLOT {
        return 1.0;
    }
    let word = probe_distances[masks.first + 2u * corner + masks.bit / 32u];
    return select(HIDDEN_WEIGHT, 1.0, ((word >> (masks.bit & 31u)) & 1u) != 0u);
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
    let masks = masks_of_cell(vec3<u32>(cell), clamp(point + normal * CELL_OFFSET - cell, vec3<f32>(0.0), vec3<f32>(1.0)));
    var sum = vec4<f32>(0.0);
    for (var ix = 0u; ix < 8u; ix++) {
        let is_upper = ((vec3<u32>(ix) >> vec3<u32>(0u, 1u, 2u)) & vec3<u32>(1u)) != vec3<u32>(0u);
        let along = select(1.0 - upper, upper, is_upper);
        let fine = AirCorner(
            vec3<u32>(cell) + select(vec3<u32>(0u), vec3<u32>(1u), is_upper),
            along.x * along.y * along.z * mask_weight(masks, ix),
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
                    let weight = share * probe_weight(probe, place_of_probe(probe), query);
                    sum += weight * vec4<f32>(blended_light(light_irradiance(light_of_probe(probe), normal)), 1.0);
                }
            }
        }
    }
    if !(sum.a > 0.0) {
        return vec4<f32>(0.0);
    }
    return vec4<f32>(light_of_blend(sum.rgb / sum.a), sum.a);
}
