// SPDX-License-Identifier: MIT OR Apache-2.0
//! Adds to what probes know of the light around them: paths from each, in directions of an Owen-scrambled Sobol sequence.
//!
//! The radiance that arrives at the probe and was reflected at least once is projected onto SH of order 2; emission is not part of it,
//! because surfaces find lights themselves. The coefficients are the mean over all paths so far.
//!
//! Dispatch: indirect, one workgroup a probe, in rows as `lucerna::math::dispatch` lays them out. Workgroup memory: 9216 bytes. A
//! workgroup owns its probe, and adds in a fixed order: the same input gives the same bytes.

#import lucerna::camera::primary_ray::Camera
#import lucerna::components::probes::gathered::COEFFICIENTS
#import lucerna::fields::probe_lattice::{lattice, lattice_corner, lattice_position}
#import lucerna::frame::pixel_sums::PixelSums
#import lucerna::integrators::path::{Path, PathSettings, PATH_GOES_ON, PATH_INTERRUPTED, advance}
#import lucerna::math::constants::INV_FOUR_PI
#import lucerna::math::dispatch::group_of_dispatch
#import lucerna::math::float::all_finite
#import lucerna::sampling::low_discrepancy::sobol_owen
#import lucerna::sampling::pcg::pcg
#import lucerna::sampling::sphere::sample_uniform_sphere
#import lucerna::sh::basis::sh2_basis
#import lucerna::sh::project::sh_uniform_weight

/// Paths of a probe in one dispatch: one an invocation.
const WORKGROUP: u32 = 64u;

struct GatherInfo {
    /// Paths that each probe has followed before, a multiple of WORKGROUP.
    first_path: u32,
    /// Reflections after the first.
    n_bounces: u32,
    seed: u32,
    reserved: u32,
}

struct ProbeFaults {
    /// Paths whose light was not finite.
    n_rejected: atomic<u32>,
    /// Paths that the driver cut short (`math::loops`).
    n_cut: atomic<u32>,
}

@group(1) @binding(0) var<uniform> info: GatherInfo;
/// x: probes.
@group(1) @binding(1) var<storage, read> counts: vec4<u32>;
/// See `lucerna::components::probes::gathered`.
@group(1) @binding(2) var<storage, read_write> gathered: array<vec4<f32>>;
@group(1) @binding(3) var<storage, read_write> faults: ProbeFaults;

var<workgroup> sums: array<array<vec3<f32>, COEFFICIENTS>, WORKGROUP>;

/// Light along one path from a probe that was reflected at least once [W·sr⁻¹·m⁻²].
fn light_along(probe: u32, direction: vec3<f32>, path_ix: u32) -> vec3<f32> {
    var settings: PathSettings;
    settings.size = vec2<u32>(lattice.capacity, 1u);
    settings.n_bounces = info.n_bounces;
    settings.seed = info.seed;
    var path: Path;
    path.origin = lattice_position(probe);
    path.direction = direction;
    path.pdf = INV_FOUR_PI;
    path.throughput = vec3<f32>(1.0);
    path.sample_ix = path_ix;
    var unused: PixelSums;
    var camera: Camera;
    var state = PATH_GOES_ON;
    while state == PATH_GOES_ON {
        state = advance(&path, &unused, camera, settings, vec2<u32>(probe, 0u));
    }
    if state == PATH_INTERRUPTED {
        atomicAdd(&faults.n_cut, 1u);
    }
    let found = path.direct + path.indirect;
    if !all_finite(found) {
        atomicAdd(&faults.n_rejected, 1u);
        return vec3<f32>(0.0);
    }
    return found;
}

@compute @workgroup_size(WORKGROUP)
fn main(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    let probe = group_of_dispatch(group);
    // (Uniform over the workgroup.)
    if probe >= counts.x {
        return;
    }
    let path_ix = info.first_path + local;
    let direction = sample_uniform_sphere(sobol_owen(path_ix, pcg(lattice_corner(probe) ^ pcg(info.seed))));
    var own = light_along(probe, direction, path_ix) * sh_uniform_weight(WORKGROUP);
    var y = sh2_basis(direction);
    for (var k = 0u; k < COEFFICIENTS; k++) {
        sums[local][k] = own * y[k];
    }
    workgroupBarrier();
    for (var reach = WORKGROUP / 2u; reach > 0u; reach /= 2u) {
        if local < reach {
            for (var k = 0u; k < COEFFICIENTS; k++) {
                sums[local][k] += sums[local + reach][k];
            }
        }
        workgroupBarrier();
    }
    if local < COEFFICIENTS {
        let at = probe * COEFFICIENTS + local;
        let share = f32(WORKGROUP) / f32(info.first_path + WORKGROUP);
        let known = gathered[at].rgb;
        // (What was known before the first path does not count, whatever it is.)
        let before = select(known * (1.0 - share), vec3<f32>(0.0), info.first_path == 0u);
        gathered[at] = vec4<f32>(before + sums[0][local] * share, 0.0);
    }
}
