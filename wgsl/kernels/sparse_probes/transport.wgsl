// SPDX-License-Identifier: MIT OR Apache-2.0
//! Adds samples to the transport coefficients α of a batch of receivers:
//!
//!     α_ij = ∫ K_ij(x, ω) cosθ dω,  K_ij = w_i V_i Y_j(φ_i) / Σ_k w_k V_k  (0 if the sum is 0)
//!
//! A. Silvennoinen, J. Lehtinen, "Real-time Global Illumination by Precomputed Local Reconstruction from Sparse Radiance Probes", ACM TOG
//! 36(6), 2017. Directions are cosine-distributed, points are drawn within the receiver's texel; the sums that are kept here become the mean of
//! the valid samples, times π, when they are divided by their number.
//!
//! Dispatch: one workgroup for each receiver, in rows as `lucerna::math::dispatch` lays them out. Workgroup memory: 2560 bytes. A workgroup owns
//! its receiver, and adds in a fixed order: the same input gives the same bytes.

#import lucerna::components::sparse_probes::sky_mask::{SKY_MASK_WORDS, sky_mask_texel}
#import lucerna::fields::lightmap::{NO_RECEIVER, receiver_at}
#import lucerna::geometry::ray_offset::offset_ray_origin
#import lucerna::integrators::probe_sight::{probe_sees_sky, probe_sees_surface, sided_surface}
#import lucerna::math::constants::FLOAT_MAX
#import lucerna::math::dispatch::group_of_dispatch
#import lucerna::math::frame::frame_from_normal
#import lucerna::math::loops::loops_run
#import lucerna::math::vector::safe_normalize
#import lucerna::sampling::hemisphere::sample_cosine_hemisphere
#import lucerna::sampling::low_discrepancy::sobol_owen
#import lucerna::sampling::pcg::pcg3d
#import lucerna::scene::rays::nearest_hit
#import lucerna::scene::types::{Ray, hit_is_miss}
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
    /// The greatest band of the coefficients.
    last_band: u32,
    /// Numbers that each receiver has in `sums`; the last two count its valid samples and all.
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
}

@group(1) @binding(0) var<uniform> info: TransportInfo;
/// The batch, in four words each. For each receiver: its first point, how many it has, its side, its number in the scene; its first near probe,
/// how many it has, 0, 0. Then points: triangle, weights, 0, 0. Then probes that are near: place [m, f32], weight [f32]; number in the scene,
/// where its coefficients begin among the receiver's, 0, 0.
@group(1) @binding(1) var<storage, read> job: array<vec4<u32>>;
/// Which probes see each receiver of the scene, and which parts of the sky (`sparse_probes/sight`, `sky_mask`).
@group(1) @binding(2) var<storage, read> sight: array<u32>;
@group(1) @binding(3) var<storage, read_write> sums: array<f32>;

/// What a sample has found.
const FOUND_NOTHING: u32 = 0u;
const FOUND_SURFACE: u32 = 1u;
const FOUND_SKY: u32 = 2u;
/// Its direction leads into the surface itself: no light comes from there.
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

/// One sample: where it leads, and which of the near probes see that.
fn take_sample(record: vec4<u32>, near: vec2<u32>, sample_ix: u32, local: u32) {
    let seeds = pcg3d(vec3<u32>(record.w, info.seed, 0x5bd1e995u));
    let choice = min(u32(sobol_owen(sample_ix, seeds.x).x * f32(record.y)), record.y - 1u);
    let point = job[info.first_point + record.x + choice];
    let surface = sided_surface(point.x, unpack2x16unorm(point.y), record.z);
    let local_direction = sample_cosine_hemisphere(sobol_owen(sample_ix, seeds.y));
    let direction = frame_from_normal(surface.shading_normal) * local_direction;
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
            sum += probe.w;
        }
    }
    if !loops_run(info.zero) {
        found[local] = FOUND_CUT;
        return;
    }
    if !(sum > 0.0) {
        found[local] = FOUND_NOTHING;
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
    let near = job[2u * ix + 1u].xy;
    let row = ix * info.stride;
    let n_coefficients = (info.last_band + 1u) * (info.last_band + 1u);
    for (var round = 0u; round < info.n_rounds; round++) {
        take_sample(record, near, info.first_sample + round * WORKGROUP + local, local);
        workgroupBarrier();
        // From here on, an invocation is a probe.
        for (var k = local; k < near.y; k += WORKGROUP) {
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
                let share = probe.w * targets[s].w;
                for (var j = 0u; j < n_coefficients; j++) {
                    own[j] += share * y[j];
                }
            }
            let first = row + job[at + 1u].y;
            for (var j = 0u; j < n_coefficients; j++) {
                sums[first + j] += own[j];
            }
        }
        is_cut[local] = u32(!loops_run(info.zero));
        workgroupBarrier();
        if local == 0u {
            var n_valid = 0.0;
            var n_whole = 0.0;
            for (var s = 0u; s < WORKGROUP; s++) {
                n_valid += f32(u32(found[s] != FOUND_NOTHING && found[s] != FOUND_CUT));
                n_whole += f32(u32(found[s] != FOUND_CUT && is_cut[s] == 0u));
            }
            sums[row + info.stride - 2u] += n_valid;
            sums[row + info.stride - 1u] += n_whole;
        }
        workgroupBarrier();
    }
}
