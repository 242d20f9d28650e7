// SPDX-License-Identifier: MIT OR Apache-2.0
//! Field: sparse radiance probes, read directly: for surfaces that have no place in the lightmap, because they move.
//!
//! Interface: `sparse_irradiance`. A probe counts by its distance, by how likely it sees the point (a map of distances,
//! `components::probes::visibility`), and less if it is behind the surface. Its light is read as lightmaps read it: in the direction in which the probe sees
//! what the point sees, found by the same map. (By the irradiance on the surface's normal alone, as if light came from far away, a ball of 12 cm before a
//! small bright spot got 0.4 to 1.2 of its light.)
#define_import_path lucerna::fields::sparse_probes

#import lucerna::components::probes::octahedral_map::{MAP_SIDE, map_taps}
#import lucerna::components::probes::visibility::{seen_share, without_bleeding, wrapped_weight}
#import lucerna::components::sparse_probes::seen::MAP_FAR
#import lucerna::math::constants::PI
#import lucerna::math::frame::frame_from_normal
#import lucerna::math::vector::safe_normalize
#import lucerna::sampling::hemisphere::sample_cosine_hemisphere
#import lucerna::sampling::low_discrepancy::hammersley
#import lucerna::sh::basis::sh_basis_to

/// Weight of a probe that does not see a point: it counts where none does.
const UNSEEN_WEIGHT: f32 = 1e-4;
/// Probes count as 1/(this + distance²)², with distances in radii.
const NEAREST: f32 = 0.05;
/// How far a point is moved along its normal before distances are compared, and the least standard deviation of a map's distances, of the radius.
const NORMAL_BIAS: f32 = 0.02;
const LEAST_DEVIATION: f32 = 0.02;
/// See `without_bleeding`.
const BLEEDING: f32 = 0.1;
/// Probes whose light is read.
const N_BEST: u32 = 4u;
/// Share of the next probe's weight that is taken from theirs; below 1, so that something is left where all are equal.
const EQUAL: f32 = 0.999;
/// Directions from which light is read of each, cosine-distributed.
const N_DIRECTIONS: u32 = 32u;
/// Steps by which it is found where light comes from.
const PARALLAX_STEPS: u32 = 6u;

struct SparseInfo {
    n_probes: u32,
    /// The greatest band of a probe's (last_band + 1)² coefficients in `sparse_lambda`.
    last_band: u32,
    /// Within which probes count [m], above 0.
    radius: f32,
    reserved_a: u32,
}

@group(3) @binding(42) var<uniform> sparse_info: SparseInfo;
/// rgb: coefficients of the radiance that arrives at each probe [W·sr⁻¹·m⁻²].
@group(3) @binding(43) var<storage, read> sparse_lambda: array<vec4<f32>>;
/// xyz: places of the probes [m]. Then for each probe its map of distances: mean distance to surfaces [radii] and mean of its square, two texels each.
@group(3) @binding(44) var<storage, read> sparse_places: array<vec4<f32>>;

/// Mean distance to surfaces in a direction from a probe [radii], and mean of its square. `direction`: not zero.
fn sparse_moments(probe: u32, direction: vec3<f32>) -> vec2<f32> {
    let taps = map_taps(direction);
    var moments = vec2<f32>(0.0);
    for (var ix = 0u; ix < 4u; ix++) {
        let texel = taps.texels[ix];
        let two = sparse_places[sparse_info.n_probes + (probe * MAP_SIDE * MAP_SIDE + texel) / 2u];
        moments += taps.weights[ix] * select(two.xy, two.zw, (texel & 1u) != 0u);
    }
    return moments;
}

/// Where light from a direction, as it arrives at a point, comes from as a probe sees it, unit length: where the ray leaves what the probe sees, by its map of
/// distances. `offset`: of the point from the probe [radii].
fn direction_from_probe(probe: u32, offset: vec3<f32>, direction: vec3<f32>) -> vec3<f32> {
    // Halving: what is nearer than the map says is inside.
    var inside = 0.0;
    var outside = length(offset) + MAP_FAR;
    for (var step = 0u; step < PARALLAX_STEPS; step++) {
        let middle = 0.5 * (inside + outside);
        let at = offset + middle * direction;
        if length(at) < sparse_moments(probe, at + 1e-6 * direction).x {
            inside = middle;
        } else {
            outside = middle;
        }
    }
    return safe_normalize(offset + 0.5 * (inside + outside) * direction, direction);
}

/// Radiance that arrives at a probe from a direction of unit length [W·sr⁻¹·m⁻²]; may be below 0 where its harmonics ring.
fn radiance_of_probe(probe: u32, direction: vec3<f32>) -> vec3<f32> {
    var y = sh_basis_to(direction, sparse_info.last_band);
    let n = (sparse_info.last_band + 1u) * (sparse_info.last_band + 1u);
    var sum = vec3<f32>(0.0);
    for (var k = 0u; k < n; k++) {
        sum += y[k] * sparse_lambda[probe * n + k].rgb;
    }
    return sum;
}

/// Irradiance by a probe on a surface point with unit normal [W·m⁻²].
fn irradiance_of_probe(probe: u32, position: vec3<f32>, normal: vec3<f32>) -> vec3<f32> {
    let offset = (position - sparse_places[probe].xyz) / sparse_info.radius;
    let frame = frame_from_normal(normal);
    var sum = vec3<f32>(0.0);
    for (var ix = 0u; ix < N_DIRECTIONS; ix++) {
        let direction = frame * sample_cosine_hemisphere(hammersley(ix, N_DIRECTIONS) + vec2<f32>(0.5 / f32(N_DIRECTIONS), 0.0));
        sum += radiance_of_probe(probe, direction_from_probe(probe, offset, direction));
    }
    return max(sum, vec3<f32>(0.0)) * (PI / f32(N_DIRECTIONS));
}

/// How much a probe counts for a point with a normal of unit length.
fn sparse_weight(probe: u32, position: vec3<f32>, normal: vec3<f32>) -> f32 {
    let to_probe = sparse_places[probe].xyz - position;
    let distance = length(to_probe);
    let from_probe = normal * (NORMAL_BIAS * sparse_info.radius) - to_probe;
    let away = length(from_probe) / sparse_info.radius;
    let apart = distance / sparse_info.radius;
    let near = NEAREST + apart * apart;
    var weight = 1.0 / (near * near);
    weight *= wrapped_weight(normal, to_probe / max(distance, 1e-9 * sparse_info.radius));
    if away > 0.0 {
        let seen = seen_share(away, sparse_moments(probe, from_probe), LEAST_DEVIATION * LEAST_DEVIATION);
        weight *= without_bleeding(seen * seen * seen, BLEEDING) + UNSEEN_WEIGHT;
    }
    return weight;
}

/// rgb: irradiance by reflected light at a surface point [W·m⁻²], at least 0; a: 1, or 0 if there are no probes. `position` [m]; `normal`: unit length,
/// on the side that is lit. Asks all probes how much they count, and those that count most for their light.
fn sparse_irradiance(position: vec3<f32>, normal: vec3<f32>) -> vec4<f32> {
    // (The greatest weights so far, in falling order.)
    var weights = vec4<f32>(0.0);
    var best = vec4<u32>(0u);
    var next = 0.0;
    for (var probe = 0u; probe < sparse_info.n_probes; probe++) {
        var weight = sparse_weight(probe, position, normal);
        var ix = probe;
        for (var k = 0u; k < N_BEST; k++) {
            if weight > weights[k] {
                let lesser = weights[k];
                let lesser_ix = best[k];
                weights[k] = weight;
                best[k] = ix;
                weight = lesser;
                ix = lesser_ix;
            }
        }
        next = max(next, weight);
    }
    var sum = vec4<f32>(0.0);
    for (var k = 0u; k < N_BEST; k++) {
        // (By how much they exceed the next one, so that none comes or goes at once; of equal ones, each counts.)
        let weight = weights[k] - EQUAL * next;
        if weight > 0.0 {
            sum += weight * vec4<f32>(irradiance_of_probe(best[k], position, normal), 1.0);
        }
    }
    if !(sum.a > 0.0) {
        return vec4<f32>(0.0);
    }
    return vec4<f32>(sum.rgb / sum.a, 1.0);
}
