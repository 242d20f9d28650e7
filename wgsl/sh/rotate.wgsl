// SPDX-License-Identifier: MIT OR Apache-2.0
//! Rotation of functions given by SH coefficients.
//!
//! Band 1 is a vector: f(d) = √(3/4π) v·d with v = (c₃, c₁, c₂), and rotates as v ↦ R v. Band 2 is a symmetric
//! traceless matrix: f(d) = dᵀ M d, and rotates as M ↦ R M Rᵀ. Both are exact, for any R. Functions with an axis
//! (zonal) are rotated to any axis by the addition theorem: P.-P. Sloan, "Stupid Spherical Harmonics (SH) Tricks", GDC
//! 2008, "Rotating zonal harmonics".
#define_import_path lucerna::sh::rotate
#import lucerna::sh::basis::{SH_BAND_TWO, SH_BAND_TWO_ZONAL, sh1_basis, sh2_basis}

/// √(4π/(2l + 1)) of bands 0, 1, 2: 1/Y(l, 0) at the pole.
const SH_ZONAL_SCALE: vec3<f32> = vec3<f32>(3.54490770181103, 2.04665341589298, 1.58533091904240);

/// The function g(R d) = f(d) of order 1.
///
/// `dst_from_src`: R, orthogonal (a rotation, or one with a reflection).
fn sh1_rotate(
    coefficients: array<vec3<f32>, 4>,
    dst_from_src: mat3x3<f32>,
) -> array<vec3<f32>, 4> {
    var c = coefficients;
    // Columns x, y, z; each row is the vector of one colour, so that R goes to the right, transposed.
    let rotated = mat3x3<f32>(c[3], c[1], c[2]) * transpose(dst_from_src);
    return array<vec3<f32>, 4>(c[0], rotated[1], rotated[2], rotated[0]);
}

/// The function g(R d) = f(d) of order 2.
///
/// `dst_from_src`: R, orthogonal (a rotation, or one with a reflection).
fn sh2_rotate(
    coefficients: array<vec3<f32>, 9>,
    dst_from_src: mat3x3<f32>,
) -> array<vec3<f32>, 9> {
    var c = coefficients;
    let linear = sh1_rotate(array<vec3<f32>, 4>(c[0], c[1], c[2], c[3]), dst_from_src);
    var out: array<vec3<f32>, 9>;
    out[0] = linear[0];
    out[1] = linear[1];
    out[2] = linear[2];
    out[3] = linear[3];
    let src_from_dst = transpose(dst_from_src);
    for (var channel = 0u; channel < 3u; channel++) {
        let xy = 0.5 * SH_BAND_TWO * c[4][channel];
        let yz = 0.5 * SH_BAND_TWO * c[5][channel];
        let xz = 0.5 * SH_BAND_TWO * c[7][channel];
        let zonal = SH_BAND_TWO_ZONAL * c[6][channel];
        let difference = 0.5 * SH_BAND_TWO * c[8][channel];
        let quadric = mat3x3<f32>(
            vec3<f32>(difference - zonal, xy, xz),
            vec3<f32>(xy, -difference - zonal, yz),
            vec3<f32>(xz, yz, 2.0 * zonal),
        );
        let q = dst_from_src * quadric * src_from_dst;
        out[4][channel] = q[1].x * (2.0 / SH_BAND_TWO);
        out[5][channel] = q[2].y * (2.0 / SH_BAND_TWO);
        out[6][channel] = q[2].z * (0.5 / SH_BAND_TWO_ZONAL);
        out[7][channel] = q[2].x * (2.0 / SH_BAND_TWO);
        out[8][channel] = (q[0].x - q[1].y) * (1.0 / SH_BAND_TWO);
    }
    return out;
}

/// The 4 coefficients of a function of order 1 that is symmetric about a unit `axis`, from its two
/// coefficients (m = 0) when the axis is +z.
fn sh1_from_zonal(zonal: vec2<f32>, axis: vec3<f32>) -> array<f32, 4> {
    var y = sh1_basis(axis);
    let scaled = zonal * SH_ZONAL_SCALE.xy;
    y[0] *= scaled.x;
    for (var ix = 1u; ix < 4u; ix++) {
        y[ix] *= scaled.y;
    }
    return y;
}

/// The 9 coefficients of a function of order 2 that is symmetric about a unit `axis`, from its three
/// coefficients (m = 0) when the axis is +z.
fn sh2_from_zonal(zonal: vec3<f32>, axis: vec3<f32>) -> array<f32, 9> {
    var y = sh2_basis(axis);
    let scaled = zonal * SH_ZONAL_SCALE;
    y[0] *= scaled.x;
    for (var ix = 1u; ix < 4u; ix++) {
        y[ix] *= scaled.y;
    }
    for (var ix = 4u; ix < 9u; ix++) {
        y[ix] *= scaled.z;
    }
    return y;
}
