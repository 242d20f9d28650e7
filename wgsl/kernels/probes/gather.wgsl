// SPDX-License-Identifier: MIT OR Apache-2.0
//! Adds to what probes know of the light around them: paths from each, in directions of an Owen-scrambled Sobol sequence.
//!
//! The radiance that arrives at the probe and was reflected at least once is projected onto SH of order 2; emission is not part of it,
//! because surfaces find lights themselves. The coefficients are the mean over all paths so far. For order 4, the same paths are followed once
//! more, for band 4 (band 3 adds nothing to irradiance).
//! A probe that is known well enough stops.
//!
//! Dispatch: indirect, one workgroup a probe, in rows as `lucerna::math::dispatch` lays them out. Workgroup memory: 9364 bytes. A
//! workgroup owns its probe, and adds in a fixed order: the same input gives the same bytes.

#import lucerna::camera::primary_ray::Camera
#import lucerna::color::luminance::luminance
#import lucerna::components::probes::gathered::{Batches, COEFFICIENTS, is_known, with_batch}
#import lucerna::fields::probe_places::{place_capacity, place_position, place_seed}
#import lucerna::frame::pixel_sums::PixelSums
#import lucerna::integrators::path::{Path, PathSettings, PATH_GOES_ON, PATH_INTERRUPTED, advance}
#import lucerna::math::constants::INV_FOUR_PI
#import lucerna::math::dispatch::group_of_dispatch
#import lucerna::math::float::all_finite
#import lucerna::sampling::low_discrepancy::sobol_owen
#import lucerna::sampling::pcg::pcg
#import lucerna::sampling::sphere::sample_uniform_sphere
#import lucerna::sh::basis::{sh2_basis, sh_band_four}
#import lucerna::sh::project::sh_uniform_weight

/// Paths of a probe in one dispatch: one an invocation.
const WORKGROUP: u32 = 64u;

struct GatherInfo {
    /// Paths that each probe has followed before, a multiple of WORKGROUP.
    first_path: u32,
    /// Reflections after the first.
    n_bounces: u32,
    seed: u32,
    /// A probe stops once its light is known to this share (`gathered::is_known`); 0: never.
    noise: f32,
    /// 0: bands 0 to 2; 1: band 4.
    part: u32,
    /// Where the first probe's coefficients are, in `gathered`.
    first: u32,
    reserved_a: u32,
    reserved_b: u32,
}

struct ProbeFaults {
    /// Paths whose light was not finite.
    n_rejected: atomic<u32>,
    /// Paths that the driver cut short (`math::loops`).
    n_cut: atomic<u32>,
    /// Probes that followed paths in this dispatch.
    n_active: atomic<u32>,
}

@group(1) @binding(0) var<uniform> info: GatherInfo;
/// x: probes.
@group(1) @binding(1) var<storage, read> counts: vec4<u32>;
/// See `lucerna::components::probes::gathered`.
@group(1) @binding(2) var<storage, read_write> gathered: array<vec4<f32>>;
@group(1) @binding(3) var<storage, read_write> faults: ProbeFaults;

var<workgroup> sums: array<array<vec3<f32>, COEFFICIENTS>, WORKGROUP>;
var<workgroup> next: array<vec4<f32>, COEFFICIENTS>;
var<workgroup> has_stopped: u32;

/// Light along one path from a probe that was reflected at least once [W·sr⁻¹·m⁻²].
fn light_along(probe: u32, direction: vec3<f32>, path_ix: u32) -> vec3<f32> {
    var settings: PathSettings;
    settings.size = vec2<u32>(place_capacity(), 1u);
    settings.n_bounces = info.n_bounces;
    settings.seed = info.seed;
    var path: Path;
    path.origin = place_position(probe);
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
    let base = info.first + probe * COEFFICIENTS;
    let is_first = info.first_path == 0u;
    if local == 0u {
        has_stopped = u32(!is_first && gathered[probe * COEFFICIENTS + 3u].a != 0.0);
    }
    // (The same for all, which the compiler must see.)
    if workgroupUniformLoad(&has_stopped) != 0u {
        return;
    }
    let path_ix = info.first_path + local;
    let direction = sample_uniform_sphere(sobol_owen(path_ix, pcg(place_seed(probe) ^ pcg(info.seed))));
    var own = light_along(probe, direction, path_ix) * sh_uniform_weight(WORKGROUP);
    var y = sh2_basis(direction);
    if info.part != 0u {
        y = sh_band_four(direction);
    }
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
        let share = f32(WORKGROUP) / f32(info.first_path + WORKGROUP);
        // (What was known before the first path does not count, whatever it is.)
        let before = select(gathered[base + local].rgb * (1.0 - share), vec3<f32>(0.0), is_first);
        var state = 0.0;
        if local < 4u {
            var batches = Batches(0.0, 0.0, 0.0);
            if !is_first {
                batches = Batches(gathered[base].a / f32(WORKGROUP), gathered[base + 1u].a, gathered[base + 2u].a);
            }
            batches = with_batch(batches, luminance(sums[0][0]));
            let stops = info.noise > 0.0 && is_known(batches, info.noise);
            let states = vec4<f32>(f32(WORKGROUP) * batches.n, batches.mean, batches.squares, select(0.0, 1.0, stops));
            state = states[local];
        }
        // (All four have read before one writes.)
        next[local] = vec4<f32>(before + sums[0][local] * share, state);
    }
    workgroupBarrier();
    if local < COEFFICIENTS {
        gathered[base + local] = next[local];
    }
    if local == 0u && info.part == 0u {
        atomicAdd(&faults.n_active, 1u);
    }
}
