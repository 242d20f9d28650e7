// SPDX-License-Identifier: MIT OR Apache-2.0
//! The basis functions in the directions in which probes look, times 4π/N: what radiance from there adds to a probe's coefficients.
//!
//! Dispatch: `math/dispatch` of ceil(n/64). Workgroup memory: none.

#import lucerna::components::sparse_probes::directions::look_direction
#import lucerna::math::dispatch::group_of_dispatch
#import lucerna::sh::basis::sh_basis_to
#import lucerna::sh::project::sh_uniform_weight

const WORKGROUP: u32 = 64u;

struct DirectionsInfo {
    n_directions: u32,
    /// The greatest band.
    last_band: u32,
    reserved_a: u32,
    reserved_b: u32,
}

@group(1) @binding(0) var<uniform> info: DirectionsInfo;
/// (last_band + 1)² numbers for each direction [sr].
@group(1) @binding(1) var<storage, read_write> basis: array<f32>;

@compute @workgroup_size(WORKGROUP)
fn main(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    let ix = group_of_dispatch(group) * WORKGROUP + local;
    if ix >= info.n_directions {
        return;
    }
    let n = (info.last_band + 1u) * (info.last_band + 1u);
    let weight = sh_uniform_weight(info.n_directions);
    var y = sh_basis_to(look_direction(ix, info.n_directions), info.last_band);
    for (var j = 0u; j < n; j++) {
        basis[ix * n + j] = weight * y[j];
    }
}
