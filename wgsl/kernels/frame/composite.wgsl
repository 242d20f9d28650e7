// SPDX-License-Identifier: MIT OR Apache-2.0
//! Adds up a frame's light and adds it to the sums over frames.
//!
//! beauty = emitted + direct + indirect.
//!
//! Dispatch: ceil(width/8) × ceil(rows/8) × 1 for each stripe of rows. Workgroup memory: none. Each invocation owns one pixel of `sums` and of `beauty`, so the
//! same input gives the same bytes.

#import lucerna::scene::pixel::{pixel_surface, view}
#import lucerna::scene::sky::sky_radiance
#import lucerna::math::float::all_finite
#import lucerna::frame::pixel_sums::PixelSums

const WORKGROUP: u32 = 8u;

/// Which rows this dispatch adds, and whether the sums start again.
struct CompositeInfo {
    /// First row of the picture whose sums are in `sums`.
    first_row: u32,
    n_rows: u32,
    /// 1: the sums start again from zero.
    is_first: u32,
    /// 1: `indirect` is read; 0: there is none.
    has_indirect: u32,
}

@group(1) @binding(0) var<uniform> info: CompositeInfo;
/// rgb: radiance [W·sr⁻¹·m⁻²], as in all bindings below.
@group(1) @binding(1) var direct: texture_2d<f32>;
/// a: ambient occlusion, as openness.
@group(1) @binding(2) var indirect: texture_2d<f32>;
@group(1) @binding(3) var<storage, read_write> sums: array<PixelSums>;
/// Mean over the frames so far.
@group(1) @binding(4) var beauty: texture_storage_2d<rgba32float, write>;

@compute @workgroup_size(WORKGROUP, WORKGROUP)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= view.size.x || id.y >= info.n_rows {
        return;
    }
    let pixel = vec2<u32>(id.x, info.first_row + id.y);
    let surface = pixel_surface(pixel);
    let direct_light = textureLoad(direct, pixel, 0).rgb;
    let indirect_texel = textureLoad(indirect, pixel, 0);
    let indirect_light = indirect_texel.rgb * f32(info.has_indirect);

    let ix = id.y * view.size.x + id.x;
    var total: PixelSums;
    if info.is_first == 0u {
        total = sums[ix];
    }
    total.n_samples += 1u;
    var emitted = surface.emission;
    if surface.is_surface {
        total.albedo += surface.base_color;
        total.normal += surface.shading_normal;
        total.depth += surface.depth;
        total.n_surfaces += 1u;
        total.openness += select(1.0, indirect_texel.a, info.has_indirect != 0u);
    } else {
        total.openness += 1.0;
        emitted = sky_radiance(-surface.to_viewer);
    }
    if all_finite(emitted) && all_finite(direct_light) && all_finite(indirect_light) {
        total.emitted += emitted;
        total.direct += direct_light;
        total.indirect += indirect_light;
    } else {
        total.n_rejected += 1u;
    }
    sums[ix] = total;
    let n = f32(max(total.n_samples - total.n_rejected, 1u));
    textureStore(beauty, pixel, vec4<f32>((total.emitted + total.direct + total.indirect) / n, 1.0));
}
