// SPDX-License-Identifier: MIT OR Apache-2.0
//! Field: where probes are, for kernels that compute what they hold: at the points of a net.
//!
//! The interface is that of the module that this replaces. Probes inside something are no part of a net, so none is blocked.
#define_import_path lucerna::fields::probe_places

#import lucerna::fields::probe_net::{net, net_position, net_reach}
#import lucerna::sampling::pcg::pcg

/// Probes that may be beside one.
const PLACES_BESIDE: u32 = 0u;
/// As in the module that this replaces.
const PLACES_NEAR: u32 = 1u;
/// How much farther away than its longest edge anybody is who asks for a probe's light [units]: points are moved along their normal.
const REACH_BEYOND: f32 = 1.0;

/// Half floats end at 65 504, and maps hold squares of distances [units].
const REACH_MOST: f32 = 250.0;

/// Where a probe that exists is [m].
fn place_position(probe: u32) -> vec3<f32> {
    return net_position(probe);
}

/// Whether a probe that exists is inside something, or behind a wall.
fn place_is_blocked(probe: u32) -> bool {
    return false;
}

/// A number of its own for each probe, which does not depend on the others.
fn place_seed(probe: u32) -> u32 {
    let bits = bitcast<vec3<u32>>(net_position(probe));
    return pcg(bits.x ^ pcg(bits.y ^ pcg(bits.z)));
}

/// The unit of a probe's distances [m].
fn place_unit() -> f32 {
    return net.unit;
}

/// How far anybody is from a probe who asks for its light [units].
fn place_reach(probe: u32) -> f32 {
    return min(net_reach(probe) / net.unit + REACH_BEYOND, REACH_MOST);
}

/// The most probes that there is room for.
fn place_capacity() -> u32 {
    return net.n_points;
}

/// A probe beside another, and how much it stands for it; weight 0: there is none.
struct PlaceBeside {
    probe: u32,
    weight: f32,
}

/// There are none beside a net's probe.
fn place_beside(probe: u32, ix: u32) -> PlaceBeside {
    return PlaceBeside(0u, 0.0);
}
