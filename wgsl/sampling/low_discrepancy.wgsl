// SPDX-License-Identifier: MIT OR Apache-2.0
//! Points that fill the unit interval and the unit square more evenly than random ones.
//!
//! * Radical inverse in base 2 (van der Corput 1935) and Hammersley's set (1960).
//! * R2: M. Roberts, "The Unreasonable Effectiveness of Quasirandom Sequences", 2018.
//! * Sobol' (1967), the first two dimensions, a (0,2)-sequence; with Owen scrambling by hashing:
//!   B. Burley, "Practical Hash-based Owen Scrambling", JCGT 9(4), 2020; its permutation is that of
//!   S. Laine, T. Karras, "Stratified Sampling for Stochastic Transparency", EGSR 2011, with the
//!   constants of N. Vegdahl, 2021, which mix better.
//!
//! Bits are fractions of 2³²; `sampling::pcg::unit_float` converts them to numbers in [0, 1).
#define_import_path lucerna::sampling::low_discrepancy

#import lucerna::sampling::pcg::{pcg, unit_float}

/// 2³²/g and 2³²/g², rounded, with g = 1.324717957… the real root of g³ = g + 1.
const INVERSE_PLASTIC: u32 = 3242174889u;
const INVERSE_PLASTIC_SQUARE: u32 = 2447445414u;

/// The radical inverse of `ix` in base 2, as bits: its binary digits mirrored at the point.
fn radical_inverse_bits(ix: u32) -> u32 {
    return reverseBits(ix);
}

/// The radical inverse of `ix` in base 2, in [0, 1); exact for `ix` < 2²⁴, otherwise cut to 24
/// digits.
fn radical_inverse(ix: u32) -> f32 {
    return unit_float(reverseBits(ix));
}

/// Point `ix` of Hammersley's set of `n`: (ix/n, radical inverse). `ix` < `n` ≤ 2²⁴.
fn hammersley(ix: u32, n: u32) -> vec2<f32> {
    return vec2<f32>(f32(ix) / f32(n), radical_inverse(ix));
}

/// Point `ix` of the R2 sequence: ½ + ix·(1/g, 1/g²) modulo 1, in fixed point, so that it does not
/// become coarser as `ix` grows: error ix·2⁻³³ + 2⁻²⁴.
fn r_two(ix: u32) -> vec2<f32> {
    return vec2<f32>(
        unit_float(0x80000000u + ix * INVERSE_PLASTIC),
        unit_float(0x80000000u + ix * INVERSE_PLASTIC_SQUARE),
    );
}

/// Point `ix` of Sobol's sequence in two dimensions, as bits.
fn sobol_bits(ix: u32) -> vec2<u32> {
    // The second dimension's direction numbers are the rows of Pascal's triangle modulo 2.
    var second = 0u;
    var direction = 0x80000000u;
    for (var rest = ix; rest != 0u; rest >>= 1u) {
        second ^= select(0u, direction, (rest & 1u) != 0u);
        direction ^= direction >> 1u;
    }
    return vec2<u32>(reverseBits(ix), second);
}

/// A permutation of the 2³² integers by `seed` in which only lower bits affect each bit.
fn laine_karras_permutation(x: u32, seed: u32) -> u32 {
    var y = x ^ (x * 0x3d20adeau);
    y += seed;
    y *= (seed >> 16u) | 1u;
    y ^= y * 0x05526c56u;
    y ^= y * 0x53a22864u;
    return y;
}

/// Owen's nested uniform scrambling of `bits`: each digit is flipped by a hash of those before it.
///
/// A permutation that maps elementary intervals to elementary intervals, so that nets stay nets.
fn owen_scramble(bits: u32, seed: u32) -> u32 {
    return reverseBits(laine_karras_permutation(reverseBits(bits), seed));
}

/// Point `ix` of Sobol's sequence, shuffled and scrambled by `seed`, in [0, 1)².
///
/// Every aligned power of two of points is a (0,2)-net; different seeds give independent nets, so
/// use another seed for each pair of higher dimensions.
fn sobol_owen(ix: u32, seed: u32) -> vec2<f32> {
    let mixed = pcg(seed);
    let bits = sobol_bits(owen_scramble(ix, mixed));
    return vec2<f32>(
        unit_float(owen_scramble(bits.x, pcg(mixed ^ 0x9e3779b9u))),
        unit_float(owen_scramble(bits.y, pcg(mixed ^ 0x7f4a7c15u))),
    );
}
