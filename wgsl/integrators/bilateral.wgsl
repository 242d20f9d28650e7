// SPDX-License-Identifier: MIT OR Apache-2.0
//! Edge-preserving filters over a picture: they use values of neighbouring pixels that see nearly the same surface
//! (`frame::upscale`).
//!
//! J. Kopf, M. Cohen, D. Lischinski, M. Uyttendaele, "Joint Bilateral Upsampling", SIGGRAPH 2007; E. Eisemann, F. Durand, "Flash
//! Photography Enhancement via Intrinsic Relighting", SIGGRAPH 2004 (cross-bilateral filter).
//!
//! Bindings: none of its own; it uses the scene seam to find the pixels' surfaces.
#define_import_path lucerna::integrators::bilateral

#import lucerna::frame::gbuffer::GBufferSurface
#import lucerna::frame::upscale::{bilinear_weight, gaussian_weight, surface_weight}
#import lucerna::scene::pixel::{pixel_surface, view}

/// Additional weight of the nearest texels, for when no surface is similar.
const LEAST_ALIKE: f32 = 1e-3;
/// Pixels to either side of the filter, and its standard deviation.
const BILATERAL_RADIUS: i32 = 3;
const BILATERAL_SIGMA: f32 = 1.5;

/// How alike two pixels' surfaces are, 0 to 1 (`frame::upscale`).
fn likeness(surface: GBufferSurface, other: GBufferSurface) -> f32 {
    return surface_weight(
        other.position - surface.position,
        surface.depth,
        surface.geometric_normal,
        other.geometric_normal,
    );
}

/// The red channel of `quarter` (one texel for every second pixel of every second row) at a pixel with a surface, from
/// the four nearest texels; 1 if none of them has a surface.
fn joint_upsampled(quarter: texture_2d<f32>, pixel: vec2<u32>, surface: GBufferSurface) -> f32 {
    let size = (view.size + 1u) / 2u;
    let base = pixel / 2u;
    let share = 0.5 * vec2<f32>(pixel % 2u);
    var sum = 0.0;
    var total = 0.0;
    for (var ix = 0u; ix < 4u; ix++) {
        let corner = vec2<u32>(ix & 1u, ix >> 1u);
        let texel = min(base + corner, size - 1u);
        let other = pixel_surface(min(2u * texel, view.size - 1u));
        if other.is_surface {
            let weight = bilinear_weight(corner, share) * (likeness(surface, other) + LEAST_ALIKE);
            sum += weight * textureLoad(quarter, texel, 0).r;
            total += weight;
        }
    }
    return select(1.0, sum / total, total > 0.0);
}

/// The mean of the red channel of `full` (one texel per pixel) over a pixel's neighbours, weighted by a Gaussian and by
/// similarity; 1 if none has a surface. `surface`: that of the pixel.
fn cross_bilateral(full: texture_2d<f32>, pixel: vec2<u32>, surface: GBufferSurface) -> f32 {
    var sum = 0.0;
    var total = 0.0;
    for (var y = -BILATERAL_RADIUS; y <= BILATERAL_RADIUS; y++) {
        for (var x = -BILATERAL_RADIUS; x <= BILATERAL_RADIUS; x++) {
            let at = vec2<i32>(pixel) + vec2<i32>(x, y);
            if any(at < vec2<i32>(0)) || any(at >= vec2<i32>(view.size)) {
                continue;
            }
            let other = pixel_surface(vec2<u32>(at));
            if other.is_surface {
                let near = gaussian_weight(vec2<f32>(f32(x), f32(y)), BILATERAL_SIGMA);
                let weight = near * likeness(surface, other);
                sum += weight * textureLoad(full, at, 0).r;
                total += weight;
            }
        }
    }
    return select(1.0, sum / total, total > 0.0);
}
