// SPDX-License-Identifier: MIT OR Apache-2.0
//! How far a probe sees in each direction, and whether it is inside something.
//!
//! Each texel of a probe's map is the mean over 4 × 4 rays, spread evenly over the texel. Distances end at MOST: farther than that, a
//! probe is asked about no point. A probe that sees backs of single-sided surfaces is inside a solid or behind a wall, and hardly counts.
//!
//! Dispatch: indirect, one workgroup a probe, in rows as `lucerna::math::dispatch` lays them out. Workgroup memory: 512 bytes.

#import lucerna::components::probes::octahedral_map::{MAP_SIDE, direction_of_texel}
#import lucerna::fields::probe_lattice::{lattice, lattice_position}
#import lucerna::math::dispatch::group_of_dispatch
#import lucerna::scene::rays::nearest_hit
#import lucerna::scene::surface::surface_at
#import lucerna::scene::types::{Ray, hit_is_miss}

/// One invocation a texel.
const WORKGROUP: u32 = 64u;
const_assert WORKGROUP == MAP_SIDE * MAP_SIDE;
/// Rays along each side of a texel.
const RAYS: u32 = 4u;
/// The longest distance [cells]: beyond the diagonal of a cell and what points are moved along their normal.
const MOST: f32 = 2.5;
/// Probes of whose rays this share ends at the back of a single-sided surface are inside or behind something.
const INSIDE_SHARE: f32 = 0.05;
/// Weight of such probes: they count where there are no others.
const INSIDE_WEIGHT: f32 = 1e-3;

/// x: probes.
@group(1) @binding(0) var<storage, read> counts: vec4<u32>;
/// See `fields::probes`.
@group(1) @binding(1) var<storage, read_write> distances: array<u32>;
@group(1) @binding(2) var<storage, read_write> light: array<vec4<f32>>;

var<workgroup> n_backs: array<u32, WORKGROUP>;

@compute @workgroup_size(WORKGROUP)
fn main(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    let probe = group_of_dispatch(group);
    let is_probe = probe < counts.x;
    var moments = vec2<f32>(0.0);
    var n_own_backs = 0u;
    if is_probe {
        let position = lattice_position(probe);
        for (var ix = 0u; ix < RAYS * RAYS; ix++) {
            let inside = (vec2<f32>(vec2<u32>(ix % RAYS, ix / RAYS)) + 0.5) / f32(RAYS);
            let direction = direction_of_texel(local, inside);
            let hit = nearest_hit(Ray(position, 0.0, direction, MOST * lattice.cell));
            var distance = MOST;
            if !hit_is_miss(hit) {
                distance = min(hit.t / lattice.cell, MOST);
                let surface = surface_at(hit.triangle, hit.barycentrics);
                let is_back = dot(surface.geometric_normal, direction) > 0.0;
                n_own_backs += select(0u, 1u, is_back && !surface.double_sided);
            }
            moments += vec2<f32>(distance, distance * distance);
        }
        moments /= f32(RAYS * RAYS);
        distances[probe * WORKGROUP + local] = pack2x16float(moments);
    }
    n_backs[local] = n_own_backs;
    workgroupBarrier();
    for (var reach = WORKGROUP / 2u; reach > 0u; reach /= 2u) {
        if local < reach {
            n_backs[local] += n_backs[local + reach];
        }
        workgroupBarrier();
    }
    if local == 0u && is_probe {
        let share = f32(n_backs[0]) / f32(WORKGROUP * RAYS * RAYS);
        light[probe * 9u] = vec4<f32>(vec3<f32>(0.0), select(1.0, INSIDE_WEIGHT, share > INSIDE_SHARE));
    }
}
