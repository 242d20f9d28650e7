// SPDX-License-Identifier: MIT OR Apache-2.0
//! The reference path tracer over a stripe of the picture.
//!
//! Dispatch: ceil(width/8) × ceil(rows/8) × 1. Workgroup memory: none. Each invocation owns one
//! pixel of `sums`, so results do not depend on the order of work: the same input gives the same
//! bytes however the picture and the samples are cut into dispatches.

#import lucerna::camera::primary_ray::Camera
#import lucerna::reference::path::{PathSettings, PixelSums, trace_pixel}

const WORKGROUP: u32 = 8u;

/// Which rows this dispatch renders.
struct StripeInfo {
    /// First row of the picture whose sums stand in `sums`.
    first_stripe_row: u32,
    /// First row to render.
    first_row: u32,
    n_rows: u32,
    reserved: u32,
}

@group(1) @binding(0) var<uniform> camera: Camera;
@group(1) @binding(1) var<uniform> settings: PathSettings;
@group(1) @binding(2) var<uniform> stripe: StripeInfo;
@group(1) @binding(3) var<storage, read_write> sums: array<PixelSums>;

@compute @workgroup_size(WORKGROUP, WORKGROUP)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= settings.size.x || id.y >= stripe.n_rows {
        return;
    }
    let pixel = vec2<u32>(id.x, stripe.first_row + id.y);
    let ix = (pixel.y - stripe.first_stripe_row) * settings.size.x + pixel.x;
    sums[ix] = trace_pixel(camera, settings, pixel, sums[ix]);
}
