// SPDX-License-Identifier: MIT OR Apache-2.0
//! Field: what probes know, wherever they are: their light, how far they see, and how much each counts for a point.
//!
//! Interface: `probes`, `light_of_probe`, `probe_weight`, `blended_light`, `light_of_blend`. Distances are in units: the edge of a cell, or how far a net's points are from
//! their nearest ones.
#define_import_path lucerna::fields::probe_store

#import lucerna::components::probes::basis::{WORDS, unpack_light}
#import lucerna::components::probes::octahedral_map::{MAP_SIDE, map_taps}
#import lucerna::components::probes::probe_light::ProbeLight
#import lucerna::components::probes::visibility::{seen_share, without_bleeding, wrapped_weight}
#import lucerna::components::voxels::grid::VoxelGrid

/// Weight of a probe that does not see a point: it counts where none does.
const HIDDEN_WEIGHT: f32 = 1e-5;
/// Weight of a probe that is inside something: it counts where there are no others.
const INSIDE_WEIGHT: f32 = 1e-3;

/// Probes that do not see the point by their maps of distances count less, or by their masks (only on a lattice). Any other number: all
/// count.
const SIGHT_DISTANCES: u32 = 1u;
const SIGHT_MASKS: u32 = 2u;

struct Probes {
    /// The lattice: "cells" are the corners of the grid's cells, at whole numbers. Of a net, only the place of 0 and the unit.
    lattice: VoxelGrid,
    /// How a point finds out which probes see it: a SIGHT_ constant.
    sight: u32,
    /// How far a point is moved along its normal before distances are compared [units].
    normal_bias: f32,
    /// 1: probes behind the surface count less (`wrapped_weight`).
    wraps: u32,
    /// Variance that a map's texel has at least [units²].
    least_variance: f32,
    /// See `without_bleeding`.
    bleeding: f32,
    /// 1: the roots of irradiances are blended, not irradiances.
    roots: u32,
    reserved_b: u32,
    reserved_c: u32,
}

@group(3) @binding(32) var<uniform> probes: Probes;
/// WORDS for each probe (`lucerna::components::probes::basis`): the radiance that arrives and was reflected at least once.
@group(3) @binding(34) var<storage, read> probe_light: array<u32>;
/// MAP_SIDE² for each probe: mean distance to surfaces [units] and mean of its square, two halfs (`pack2x16float`). With SIGHT_MASKS instead: two
/// words for each brick of the cells (`lucerna::components::voxels::bricks`), then MASK_WORDS for each cell that surfaces meet
/// (`lucerna::components::probes::masks`).
@group(3) @binding(35) var<storage, read> probe_distances: array<u32>;

/// The light of a probe.
fn light_of_probe(probe: u32) -> ProbeLight {
    var words: array<u32, WORDS>;
    for (var k = 0u; k < WORDS; k++) {
        words[k] = probe_light[probe * WORDS + k];
    }
    return unpack_light(words);
}

/// Mean distance to surfaces in a direction from a probe [units], and mean of its square.
fn probe_moments(probe: u32, direction: vec3<f32>) -> vec2<f32> {
    let taps = map_taps(direction);
    var moments = vec2<f32>(0.0);
    for (var ix = 0u; ix < 4u; ix++) {
        let texel = probe_distances[probe * MAP_SIDE * MAP_SIDE + taps.texels[ix]];
        moments += taps.weights[ix] * unpack2x16float(texel);
    }
    return moments;
}

/// What is blended of a probe's irradiance [W·m⁻²].
///
/// Light falls off convexly with the distance from what it comes from, and a straight line between two probes is above such a curve: with
/// the squares of interpolated roots there is half as much too much (RTXGI blends so; in Sponza 6 instead of 12 %).
fn blended_light(irradiance: vec3<f32>) -> vec3<f32> {
    let light = max(irradiance, vec3<f32>(0.0));
    return select(irradiance, sqrt(light), vec3<bool>(probes.roots != 0u));
}

/// Irradiance, of what was blended; inverse of [`blended_light`], at least 0.
fn light_of_blend(blend: vec3<f32>) -> vec3<f32> {
    let light = max(blend, vec3<f32>(0.0));
    return select(light, light * light, vec3<bool>(probes.roots != 0u));
}

/// A point that is asked for its light.
struct ProbeQuery {
    /// [units]
    point: vec3<f32>,
    /// The point, moved along its normal, from which distances are compared.
    biased: vec3<f32>,
    /// Unit length.
    normal: vec3<f32>,
}

/// Where a probe is, and what is known of the place.
struct ProbePlace {
    /// [units]
    place: vec3<f32>,
    is_inside: bool,
    /// What is farther away is not in its map [units].
    reach: f32,
}

/// How much a probe counts for a point besides its share of the interpolation, in [0, 1.2].
fn probe_weight(probe: u32, stands: ProbePlace, query: ProbeQuery) -> f32 {
    var weight = select(1.0, INSIDE_WEIGHT, stands.is_inside);
    if probes.wraps != 0u {
        let to_probe = stands.place - query.point;
        weight *= wrapped_weight(query.normal, to_probe / max(length(to_probe), 1e-6));
    }
    if probes.sight == SIGHT_DISTANCES {
        let from_probe = query.biased - stands.place;
        let distance = min(length(from_probe), stands.reach);
        if distance > 0.0 {
            let seen = seen_share(distance, probe_moments(probe, from_probe), probes.least_variance);
            weight *= without_bleeding(seen * seen * seen, probes.bleeding) + HIDDEN_WEIGHT;
        }
    }
    return weight;
}
