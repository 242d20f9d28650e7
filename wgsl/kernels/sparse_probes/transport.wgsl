// SPDX-License-Identifier: MIT OR Apache-2.0
//! Adds samples to the transport coefficients α of a batch of receivers:
//!
//!     α_ij = ∫ K_ij(x, ω) cosθ dω,  K_ij = w_i V_i Y_j(φ_i) / Σ_k w_k V_k  (0 if the sum is 0)
//!
//! where w_i is how much probe i counts for x, times how well it resolves what x sees (`components::sparse_probes::support`). After
//!
//! A. Silvennoinen, J. Lehtinen, "Real-time Global Illumination by Precomputed Local Reconstruction from Sparse Radiance Probes", ACM TOG
//! 36(6), 2017. Directions are cosine-distributed, points are drawn within the receiver's texel; the sums that are kept here become the mean of
//! the valid samples, times π, when they are divided by the sum of these samples' weights.
//!
//! With `n_radiance` > 0, also the transport to the spherical harmonics of the radiance that arrives from above the surface,
//!
//!     α_ijk = ∫ K_ij(x, ω) Y_k(ω) dω  over the hemisphere of the geometric normal,
//!
//! for normal maps and glossy surfaces. Then every other direction is uniform over that hemisphere, and both kinds weigh by the balance heuristic.
//!
//! Dispatch: one workgroup for each receiver, in rows as `lucerna::math::dispatch` lays them out. Workgroup memory: 10496 bytes. A workgroup owns
//! its receiver, and adds in a fixed order: the same input gives the same bytes.

#import lucerna::components::sparse_probes::sky_mask::{SKY_MASK_WORDS, sky_mask_texel}
#import lucerna::components::sparse_probes::support::resolution_weight
#import lucerna::fields::lightmap::{NO_RECEIVER, receiver_at}
#import lucerna::geometry::ray_offset::offset_ray_origin
#import lucerna::integrators::probe_sight::{probe_sees_sky, probe_sees_surface, sided_surface}
#import lucerna::math::constants::{FLOAT_MAX, INV_PI}
#import lucerna::math::dispatch::group_of_dispatch
#import lucerna::math::frame::frame_from_normal
#import lucerna::math::loops::loops_run
#import lucerna::math::vector::safe_normalize
#import lucerna::sampling::hemisphere::{pdf_cosine_hemisphere, pdf_uniform_hemisphere, sample_cosine_hemisphere, sample_uniform_hemisphere}
#import lucerna::sampling::low_discrepancy::sobol_owen
#import lucerna::sampling::pcg::pcg3d
#import lucerna::scene::rays::nearest_hit
#import lucerna::scene::types::{Ray, Surface, hit_is_miss}
#import lucerna::sh::basis::sh_basis_to

/// Samples of a receiver in each round: one an invocation.
const WORKGROUP: u32 = 64u;
/// The most probes that count for a receiver.
const MAX_NEAR: u32 = 128u;
const NEAR_WORDS: u32 = 4u;
const_assert NEAR_WORDS * 32u == MAX_NEAR;

/// How mutual visibility is found: looked up in the bits of the receiver that was hit and in the masks of the sky, or by rays.
const SIGHT_BY_BITS: u32 = 0u;
const SIGHT_BY_RAYS: u32 = 1u;

struct TransportInfo {
    /// Receivers of the batch.
    n_receivers: u32,
    /// Samples that each has taken before, a multiple of WORKGROUP.
    first_sample: u32,
    /// Rounds of WORKGROUP samples.
    n_rounds: u32,
    seed: u32,
    /// The greatest band of the probes' coefficients.
    last_band: u32,
    /// Numbers that each receiver has in `sums`: `n_columns` for irradiance and as many for each coefficient of radiance; then TAIL numbers: the valid
    /// samples' weights, how many are valid, and all; then for each coefficient of radiance the sum of that function at the samples' normals.
    stride: u32,
    /// A SIGHT_BY_ constant.
    sight: u32,
    /// Words of bits of each receiver, in `sight`.
    n_words_each: u32,
    /// Where the masks of the sky begin, in `sight`.
    first_mask: u32,
    /// Where points begin in `job`, and the probes that are near.
    first_point: u32,
    first_near: u32,
    /// 0 (see `math::loops`).
    zero: u32,
    /// Spherical harmonics of the radiance that arrives at a receiver, at most MAX_RADIANCE; 0: irradiance alone.
    n_radiance: u32,
    /// Outputs that this dispatch adds to: 0 is irradiance, k + 1 coefficient k of radiance.
    first_output: u32,
    n_outputs: u32,
    reserved_a: u32,
}

/// Tail of a receiver's numbers in `sums`, before what is seen of its normal.
const TAIL: u32 = 3u;
/// The most coefficients of radiance: order 4.
const MAX_RADIANCE: u32 = 25u;
const MAX_RADIANCE_BAND: u32 = 4u;

@group(1) @binding(0) var<uniform> info: TransportInfo;
/// The batch, in four words each. For each receiver: its first point, how many it has, its side, its number in the scene; its first near probe,
/// how many it has, the radius within which they count [m, f32], 0. Then points: triangle, weights, 0, 0. Then probes that are near: place [m, f32],
/// weight [f32]; number in the scene, where its coefficients begin among the receiver's, 0, 0.
@group(1) @binding(1) var<storage, read> job: array<vec4<u32>>;
/// Which probes see each receiver of the scene, and which parts of the sky (`sparse_probes/sight`, `sky_mask`).
@group(1) @binding(2) var<storage, read> sight: array<u32>;
@group(1) @binding(3) var<storage, read_write> sums: array<f32>;

/// What a sample has found.
const FOUND_NOTHING: u32 = 0u;
const FOUND_SURFACE: u32 = 1u;
const FOUND_SKY: u32 = 2u;
/// Its direction leads into the surface itself, or to the sky where no probe sees it: no light comes from there.
const FOUND_DARK: u32 = 3u;
/// The driver has ended loops early.
const FOUND_CUT: u32 = 4u;

/// xyz: the point that was hit, or the direction to the sky; w: 1/Σ w V.
var<workgroup> targets: array<vec4<f32>, WORKGROUP>;
var<workgroup> found: array<u32, WORKGROUP>;
/// Bits of the near probes that see it.
var<workgroup> seen_by: array<vec4<u32>, WORKGROUP>;
/// 1: the driver has ended an invocation's loops early.
var<workgroup> is_cut: array<u32, WORKGROUP>;
/// How much it counts: x for irradiance, y for radiance [sr⁻¹ of the functions' unit]: cosine and 1, over π times the density.
var<workgroup> shares: array<vec2<f32>, WORKGROUP>;
/// The functions of the radiance at each sample's direction; afterwards, at its normal.
var<workgroup> functions: array<f32, 1600>;
const_assert 1600u == WORKGROUP * MAX_RADIANCE;
var<workgroup> normals: array<vec3<f32>, WORKGROUP>;

/// A direction to look in.
struct Look {
    direction: vec3<f32>,
    /// As in `shares`.
    share: vec2<f32>,
}

/// The direction of a sample: cosine-distributed about the shading normal; for radiance, half of them uniform over the geometric normal's hemisphere.
fn look_of_sample(surface: Surface, sample_ix: u32, seeds: vec2<u32>) -> Look {
    if info.n_radiance == 0u {
        let local = sample_cosine_hemisphere(sobol_owen(sample_ix, seeds.x));
        return Look(frame_from_normal(surface.shading_normal) * local, vec2<f32>(1.0, 0.0));
    }
    // (Points of a Sobol sequence with odd numbers fill half of the square, so each kind counts its own.)
    let ix = sample_ix >> 1u;
    var direction: vec3<f32>;
    if (sample_ix & 1u) == 0u {
        direction = frame_from_normal(surface.shading_normal) * sample_cosine_hemisphere(sobol_owen(ix, seeds.x));
    } else {
        direction = frame_from_normal(surface.geometric_normal) * sample_uniform_hemisphere(sobol_owen(ix, seeds.y));
    }
    let cosine = max(dot(direction, surface.shading_normal), 0.0);
    let is_above = dot(direction, surface.geometric_normal) > 0.0;
    let density = 0.5 * (pdf_cosine_hemisphere(cosine) + select(0.0, pdf_uniform_hemisphere(), is_above));
    // (A direction that was drawn has a density above 0, but for rounding.)
    return Look(direction, vec2<f32>(cosine, 1.0) * (INV_PI / max(density, 1e-6)));
}

/// Keeps the functions of the radiance in a direction.
fn keep_functions(direction: vec3<f32>, local: u32) {
    var y = sh_basis_to(direction, MAX_RADIANCE_BAND);
    for (var k = 0u; k < info.n_radiance; k++) {
        functions[local * MAX_RADIANCE + k] = y[k];
    }
}

/// How much a probe that sees it counts for what a sample has found: `place` if that is a surface. The sky is as sharp for one probe as for another.
fn weight_of_probe(probe: vec4<f32>, place: vec3<f32>, is_sky: bool, radius: f32) -> f32 {
    return probe.w * select(resolution_weight(distance(place, probe.xyz), radius), 1.0, is_sky);
}

/// One sample: where it leads, and which of the near probes see that.
fn take_sample(record: vec4<u32>, near: vec3<u32>, sample_ix: u32, local: u32) {
    let seeds = pcg3d(vec3<u32>(record.w, info.seed, 0x5bd1e995u));
    let choice = min(u32(sobol_owen(sample_ix, seeds.x).x * f32(record.y)), record.y - 1u);
    let point = job[info.first_point + record.x + choice];
    let surface = sided_surface(point.x, unpack2x16unorm(point.y), record.z);
    let look = look_of_sample(surface, sample_ix, seeds.yz);
    let direction = look.direction;
    shares[local] = look.share;
    if info.n_radiance != 0u {
        keep_functions(direction, local);
        normals[local] = surface.shading_normal;
    }
    seen_by[local] = vec4<u32>(0u);
    if dot(direction, surface.geometric_normal) <= 0.0 {
        found[local] = FOUND_DARK;
        return;
    }
    let origin = offset_ray_origin(surface.position, surface.position_error, surface.geometric_normal, direction);
    let hit = nearest_hit(Ray(origin, 0.0, direction, FLOAT_MAX));
    let is_sky = hit_is_miss(hit);
    var place = direction;
    var word = 0u;
    var is_known = true;
    var side = 0u;
    var there = surface;
    if !is_sky {
        there = sided_surface(hit.triangle, hit.barycentrics, 0u);
        side = u32(dot(there.geometric_normal, direction) > 0.0);
        if side != 0u {
            there.geometric_normal = -there.geometric_normal;
        }
        place = there.position;
        let receiver = receiver_at(hit.triangle, hit.barycentrics, side);
        is_known = receiver != NO_RECEIVER;
        word = receiver * info.n_words_each;
    }
    var bits = vec4<u32>(0u);
    var sum = 0.0;
    for (var k = 0u; k < near.y; k++) {
        let at = info.first_near + 2u * (near.x + k);
        let probe = bitcast<vec4<f32>>(job[at]);
        let probe_ix = job[at + 1u].x;
        var sees = false;
        if info.sight == SIGHT_BY_RAYS {
            if is_sky {
                sees = probe_sees_sky(probe.xyz, direction);
            } else {
                sees = probe_sees_surface(probe.xyz, there);
            }
        } else if is_sky {
            let texel = sky_mask_texel(direction);
            let mask = sight[info.first_mask + probe_ix * SKY_MASK_WORDS + texel / 32u];
            sees = (mask >> (texel % 32u) & 1u) != 0u;
        } else if is_known {
            sees = (sight[word + probe_ix / 32u] >> (probe_ix % 32u) & 1u) != 0u;
        }
        if sees {
            bits[k / 32u] |= 1u << (k % 32u);
            sum += weight_of_probe(probe, place, is_sky, bitcast<f32>(near.z));
        }
    }
    if !loops_run(info.zero) {
        found[local] = FOUND_CUT;
        return;
    }
    if !(sum > 0.0) {
        // (Surfaces that no probe sees are unknown. The sky's light is not that of probes: receivers and pixels find it themselves.)
        found[local] = select(FOUND_NOTHING, FOUND_DARK, is_sky);
        return;
    }
    targets[local] = vec4<f32>(place, 1.0 / sum);
    seen_by[local] = bits;
    found[local] = select(FOUND_SURFACE, FOUND_SKY, is_sky);
}

@compute @workgroup_size(WORKGROUP)
fn main(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    let ix = group_of_dispatch(group);
    // (Uniform over the workgroup.)
    if ix >= info.n_receivers {
        return;
    }
    let record = job[2u * ix];
    let near = job[2u * ix + 1u].xyz;
    let row = ix * info.stride;
    let n_coefficients = (info.last_band + 1u) * (info.last_band + 1u);
    let tail = row + info.stride - TAIL - info.n_radiance;
    let n_columns = (info.stride - TAIL - info.n_radiance) / (1u + info.n_radiance);
    for (var round = 0u; round < info.n_rounds; round++) {
        take_sample(record, near, info.first_sample + round * WORKGROUP + local, local);
        workgroupBarrier();
        // From here on, an invocation is an output of a probe.
        for (var item = local; item < near.y * info.n_outputs; item += WORKGROUP) {
            let k = item / info.n_outputs;
            let output = info.first_output + item % info.n_outputs;
            let at = info.first_near + 2u * (near.x + k);
            let probe = bitcast<vec4<f32>>(job[at]);
            var own: array<f32, 64>;
            for (var s = 0u; s < WORKGROUP; s++) {
                if (seen_by[s][k / 32u] >> (k % 32u) & 1u) == 0u {
                    continue;
                }
                var direction = targets[s].xyz;
                if found[s] == FOUND_SURFACE {
                    direction = safe_normalize(direction - probe.xyz, vec3<f32>(0.0, 1.0, 0.0));
                }
                var y = sh_basis_to(direction, info.last_band);
                var share = weight_of_probe(probe, targets[s].xyz, found[s] == FOUND_SKY, bitcast<f32>(near.z)) * targets[s].w;
                if output == 0u {
                    share *= shares[s].x;
                } else {
                    share *= shares[s].y * functions[s * MAX_RADIANCE + output - 1u];
                }
                for (var j = 0u; j < n_coefficients; j++) {
                    own[j] += share * y[j];
                }
            }
            let first = row + output * n_columns + job[at + 1u].y;
            for (var j = 0u; j < n_coefficients; j++) {
                sums[first + j] += own[j];
            }
        }
        is_cut[local] = u32(!loops_run(info.zero));
        workgroupBarrier();
        if local == 0u && info.first_output == 0u {
            var valid = vec2<f32>(0.0);
            var n_whole = 0.0;
            for (var s = 0u; s < WORKGROUP; s++) {
                let is_valid = found[s] != FOUND_NOTHING && found[s] != FOUND_CUT;
                valid += select(vec2<f32>(0.0), vec2<f32>(shares[s].x, 1.0), is_valid);
                n_whole += f32(u32(found[s] != FOUND_CUT && is_cut[s] == 0u));
            }
            sums[tail] += valid.x;
            sums[tail + 1u] += valid.y;
            sums[tail + 2u] += n_whole;
        }
        if info.n_radiance != 0u {
            keep_functions(normals[local], local);
            workgroupBarrier();
            if local < info.n_radiance && info.first_output == 0u {
                var sum = 0.0;
                for (var s = 0u; s < WORKGROUP; s++) {
                    sum += functions[s * MAX_RADIANCE + local];
                }
                sums[tail + TAIL + local] += sum;
            }
        }
        workgroupBarrier();
    }
}
