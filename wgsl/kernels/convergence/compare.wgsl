// SPDX-License-Identifier: MIT OR Apache-2.0
//! How much light is still on its way, from sums of it (`convergence/sum`) after n, n/2 and n/4 frames.
//!
//! A block's two sums have changed by Δa and Δb. Their noise is independent, so S = Σ Δa·Δb over the blocks estimates the square of
//! the change without it, and σ² = Σ (Δa·Δb)² is at least the variance of that. The change is taken to be √(S + 2σ): light may be on
//! its way behind noise. c₁ is that from n/4 to n/2, c₂ that from n/2 to n, as shares of √(Σ a·b). If each doubling of the
//! frames brings the same part r = c₂/c₁ of the change before it, what is still to come is c₂·(r + r² + …) = c₂·r/(1 − r) (A.
//! Aitken, "On Bernoulli's numerical solution of algebraic equations", Proc. Royal Society of Edinburgh 46, 1926). Errors that fall
//! like a power of n do that; those that fall faster leave less.
//!
//! Dispatch: one workgroup. Workgroup memory: 9216 bytes. It adds in a fixed order: the same input gives the same bytes.

const WORKGROUP: u32 = 256u;
const MILLION: f32 = 1e6;
/// More than this is called this [ppm].
const MOST: f32 = 4e9;
/// Changes that shrink less from one doubling to the next are taken to shrink by this: they are noise, or have just begun.
const SLOWEST: f32 = 0.75;

struct CompareInfo {
    n_sums: u32,
    /// Index of the first sum after n frames.
    now: u32,
    /// After n/2.
    half: u32,
    /// After n/4.
    quarter: u32,
    /// Below this share of the light, it has settled.
    settled_below: f32,
    reserved_a: u32,
    reserved_b: u32,
    reserved_c: u32,
}

struct Change {
    /// What is still to come, and what has changed since n/2 [ppm of the light]; 0 if there is no light at any time.
    to_come: u32,
    since_half: u32,
    /// 1 if the light has settled.
    is_settled: u32,
}

@group(1) @binding(0) var<uniform> info: CompareInfo;
@group(1) @binding(1) var<storage, read> sums: array<vec2<f32>>;
@group(1) @binding(2) var<storage, read_write> change: Change;

/// Standard deviations that are added to an estimate.
const DEVIATIONS: f32 = 2.0;

/// Of both changes, the newer one first, and of the light, in units of the largest sum.
struct Sums {
    /// S.
    products: vec2<f32>,
    /// σ².
    variances: vec2<f32>,
    /// Σ a·b.
    light: f32,
}

var<workgroup> largest: array<f32, WORKGROUP>;
var<workgroup> partial: array<Sums, WORKGROUP>;

fn add(a: Sums, b: Sums) -> Sums {
    return Sums(a.products + b.products, a.variances + b.variances, a.light + b.light);
}

fn ppm(share: f32) -> u32 {
    return u32(round(min(share * MILLION, MOST)));
}

@compute @workgroup_size(WORKGROUP)
fn main(@builtin(local_invocation_index) local: u32) {
    var own_largest = 0.0;
    for (var ix = local; ix < info.n_sums; ix += WORKGROUP) {
        let both = max(sums[info.now + ix], sums[info.half + ix]);
        own_largest = max(own_largest, max(both.x, both.y));
    }
    largest[local] = own_largest;
    workgroupBarrier();
    for (var reach = WORKGROUP / 2u; reach > 0u; reach /= 2u) {
        if local < reach {
            largest[local] = max(largest[local], largest[local + reach]);
        }
        workgroupBarrier();
    }
    let unit = largest[0];
    var own: Sums;
    if unit > 0.0 {
        for (var ix = local; ix < info.n_sums; ix += WORKGROUP) {
            let now = sums[info.now + ix] / unit;
            let half = sums[info.half + ix] / unit;
            let newer = now - half;
            let older = half - sums[info.quarter + ix] / unit;
            let products = vec2<f32>(newer.x * newer.y, older.x * older.y);
            own = add(own, Sums(products, products * products, now.x * now.y));
        }
    }
    partial[local] = own;
    workgroupBarrier();
    for (var reach = WORKGROUP / 2u; reach > 0u; reach /= 2u) {
        if local < reach {
            partial[local] = add(partial[local], partial[local + reach]);
        }
        workgroupBarrier();
    }
    if local == 0u {
        let all = partial[0];
        let squares = max(all.products + DEVIATIONS * sqrt(all.variances), vec2<f32>(0.0));
        var share = 0.0;
        var to_come = 0.0;
        if unit > 0.0 && all.light == 0.0 {
            // All light is gone, or there are too few values for two halves.
            share = MOST;
            to_come = MOST;
        } else if squares.x > 0.0 {
            share = sqrt(squares.x / all.light);
            let shrinks = sqrt(squares.x / max(squares.y, squares.x));
            let ratio = min(shrinks, SLOWEST);
            to_come = share * ratio / (1.0 - ratio);
        }
        change = Change(ppm(to_come), ppm(share), u32(to_come < info.settled_below));
    }
}
