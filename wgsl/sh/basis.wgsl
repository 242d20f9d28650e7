// SPDX-License-Identifier: MIT OR Apache-2.0
//! Real orthonormal spherical harmonics (SH), bands l = 0 … 7.
//!
//! P.-P. Sloan, "Stupid Spherical Harmonics (SH) Tricks", GDC 2008, appendices, without the
//! signs there: there is no Condon–Shortley phase here. "Order l" has (l + 1)² functions, index
//! l(l + 1) + m, and ∫ Yᵢ Yⱼ dω = δᵢⱼ over the sphere. The axes are the world's; with
//! (x, y, z) = (sin θ cos φ, sin θ sin φ, cos θ),
//!
//!     Y(l, m) = K(l, |m|) · P(l, |m|)(cos θ) · { √2 cos mφ   m > 0
//!                                             { 1           m = 0
//!                                             { √2 sin |m|φ m < 0
//!     K(l, m) = √((2l + 1)/(4π) · (l − m)!/(l + m)!)
//!     P(l, m)(z) = (1 − z²)^(m/2) dᵐ/dzᵐ P(l)(z)          (Legendre, no factor (−1)ᵐ)
//!
//! The first bands, of the unit vector (x, y, z):
//!
//!     ix  l  m   Y
//!      0  0  0   √(1/4π)                0.2820948
//!      1  1 −1   √(3/4π) y              0.4886025 y
//!      2  1  0   √(3/4π) z              0.4886025 z
//!      3  1  1   √(3/4π) x              0.4886025 x
//!      4  2 −2   √(15/4π) xy            1.0925484 xy
//!      5  2 −1   √(15/4π) yz            1.0925484 yz
//!      6  2  0   √(5/16π) (3z² − 1)     0.3153916 (3z² − 1)
//!      7  2  1   √(15/4π) xz            1.0925484 xz
//!      8  2  2   √(15/16π) (x² − y²)    0.5462742 (x² − y²)
//!      9  3 −3   √(35/32π) y(3x² − y²)  0.5900436 y(3x² − y²)
//!     10  3 −2   √(105/4π) xyz          2.8906114 xyz
//!     11  3 −1   √(21/32π) y(5z² − 1)   0.4570458 y(5z² − 1)
//!     12  3  0   √(7/16π) z(5z² − 3)    0.3731763 z(5z² − 3)
//!     13  3  1   √(21/32π) x(5z² − 1)   0.4570458 x(5z² − 1)
//!     14  3  2   √(105/16π) z(x² − y²)  1.4453057 z(x² − y²)
//!     15  3  3   √(35/32π) x(x² − 3y²)  0.5900436 x(x² − 3y²)
//!
//! Names in this folder: `sh1_` works on order 1 (4 functions), `sh2_` on order 2 (9), `sh_` on
//! order 7 (64) or any band. Coefficients of RGB are arrays of vec3.
#define_import_path lucerna::sh::basis

/// The greatest band.
const SH_LAST_BAND: u32 = 7u;

/// √(1/4π), the constant function.
const SH_CONSTANT: f32 = 0.282094791773878;
/// √(3/4π), band 1.
const SH_BAND_ONE: f32 = 0.488602511902920;
/// √(15/4π): xy, yz, xz; the half of it: x² − y².
const SH_BAND_TWO: f32 = 1.09254843059208;
/// √(5/16π): 3z² − 1.
const SH_BAND_TWO_ZONAL: f32 = 0.315391565252520;

/// The band l of an index below 64.
fn sh_band(ix: u32) -> u32 {
    // Between the squares, so that rounding of the root does not matter.
    return u32(sqrt(f32(ix) + 0.5));
}

/// The 4 functions of order 1 at a unit direction.
fn sh1_basis(direction: vec3<f32>) -> array<f32, 4> {
    let linear = SH_BAND_ONE * direction;
    return array<f32, 4>(SH_CONSTANT, linear.y, linear.z, linear.x);
}

/// The 9 functions of order 2 at a unit direction.
fn sh2_basis(direction: vec3<f32>) -> array<f32, 9> {
    let d = direction;
    let linear = SH_BAND_ONE * d;
    let products = SH_BAND_TWO * (d.xyz * d.yzx);
    return array<f32, 9>(
        SH_CONSTANT,
        linear.y,
        linear.z,
        linear.x,
        products.x,
        products.y,
        SH_BAND_TWO_ZONAL * (3.0 * d.z * d.z - 1.0),
        products.z,
        // Factored, which is accurate where the squares cancel.
        0.5 * SH_BAND_TWO * (d.x - d.y) * (d.x + d.y),
    );
}

/// The 9 functions of band 4 at a unit direction.
fn sh_band_four(direction: vec3<f32>) -> array<f32, 9> {
    let x = direction.x;
    let y = direction.y;
    let z = direction.z;
    let flat = x * x - y * y;
    let near = 7.0 * z * z - 1.0;
    let far = 7.0 * z * z - 3.0;
    return array<f32, 9>(
        2.50334294179670 * x * y * flat,
        1.77013076977993 * y * z * (3.0 * x * x - y * y),
        0.946174695757560 * x * y * near,
        0.669046543557289 * y * z * far,
        0.105785546915204 * (z * z * (35.0 * z * z - 30.0) + 3.0),
        0.669046543557289 * x * z * far,
        0.473087347878780 * flat * near,
        1.77013076977993 * x * z * (x * x - 3.0 * y * y),
        0.625835735449176 * (flat * flat - 4.0 * x * x * y * y),
    );
}

/// All 64 functions of bands 0 to 7 at a unit direction.
///
/// By the recurrence of fully normalised Legendre functions, whose factor sinᵐθ is combined with
/// cos mφ and sin mφ, so that there is no angle and no pole. Error below 1e-6 of the band's
/// greatest value, √((2l + 1)/4π).
fn sh_basis(direction: vec3<f32>) -> array<f32, 64> {
    return sh_basis_to(direction, SH_LAST_BAND);
}

/// As [`sh_basis`], but only bands 0 to `last` ≤ 7; the others' values are 0.
fn sh_basis_to(direction: vec3<f32>, last: u32) -> array<f32, 64> {
    var values: array<f32, 64>;
    var sectoral = SH_CONSTANT;
    // (x + iy)ᵐ.
    var power = vec2<f32>(1.0, 0.0);
    for (var m = 0u; m <= last; m++) {
        var below = 0.0;
        var current = sectoral;
        var factor_before = 1.0;
        for (var l = m; l <= last; l++) {
            let center = l * (l + 1u);
            values[center - m] = current * power.y;
            values[center + m] = current * power.x;
            let factor = legendre_factor(l + 1u, m);
            let next = factor * (direction.z * current - below / factor_before);
            below = current;
            current = next;
            factor_before = factor;
        }
        sectoral *= sectoral_factor(m);
        power = complex_product(power, direction.xy);
    }
    return values;
}

/// One function at a unit direction: l ≤ 7, |m| ≤ l. As exact as [`sh_basis`]; for kernels whose
/// invocations divide the coefficients among them.
fn sh_basis_function(l: u32, m: i32, direction: vec3<f32>) -> f32 {
    let degree = u32(abs(m));
    var current = SH_CONSTANT;
    var power = vec2<f32>(1.0, 0.0);
    for (var i = 0u; i < degree; i++) {
        current *= sectoral_factor(i);
        power = complex_product(power, direction.xy);
    }
    var below = 0.0;
    var factor_before = 1.0;
    for (var i = degree + 1u; i <= l; i++) {
        let factor = legendre_factor(i, degree);
        let next = factor * (direction.z * current - below / factor_before);
        below = current;
        current = next;
        factor_before = factor;
    }
    return current * select(power.x, power.y, m < 0);
}

/// a(l, m) = √((4l² − 1)/(l² − m²)) of the recurrence
/// Q(l) = a(l) · (z · Q(l − 1) − Q(l − 2)/a(l − 1)), l > m.
fn legendre_factor(l: u32, m: u32) -> f32 {
    return sqrt(f32(4u * l * l - 1u) / f32(l * l - m * m));
}

/// Q(m + 1, m + 1)/Q(m, m), with the √2 that appears from m = 1 on.
fn sectoral_factor(m: u32) -> f32 {
    return sqrt(f32(2u * m + 3u) / select(f32(2u * m + 2u), 1.0, m == 0u));
}

/// (a.x + i·a.y)·(b.x + i·b.y).
fn complex_product(a: vec2<f32>, b: vec2<f32>) -> vec2<f32> {
    return vec2<f32>(a.x * b.x - a.y * b.y, a.x * b.y + a.y * b.x);
}
