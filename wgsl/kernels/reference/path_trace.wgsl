// SPDX-License-Identifier: MIT OR Apache-2.0
//! The reference path tracer over a stripe of the picture.
//!
//! Dispatch: ceil(width · n_lanes/8) × ceil(rows/8) × 1. Workgroup memory: none. Each invocation owns one lane of one
//! pixel in `sums`, so results do not depend on the order of work: the same input gives the same bytes for any division
//! of the picture and the samples into dispatches.
//!
//! If the driver ends loops early (`math::loops`), a pixel stops before that, keeps its path in `paths`, and is counted
//! in `progress`: dispatch again with `continues` until `n_unfinished` stays 0.

#import lucerna::camera::primary_ray::Camera
#import lucerna::frame::pixel_sums::PixelSums
#import lucerna::integrators::path::{Path, PathSettings, first_path, trace_pixel}

const WORKGROUP: u32 = 8u;

/// Which rows this dispatch renders.
struct StripeInfo {
    /// First row of the picture whose sums are in `sums`.
    first_stripe_row: u32,
    /// First row to render.
    first_row: u32,
    n_rows: u32,
    /// 1: continues what the previous dispatch left in `paths`; 0: starts.
    continues: u32,
}

/// The report of dispatches.
struct PathProgress {
    /// Pixels of all dispatches that stopped before the end of their samples; the host clears it.
    n_unfinished: atomic<u32>,
    /// Samples that were abandoned because a single step takes more loop iterations than the driver runs.
    n_cut: atomic<u32>,
}

@group(1) @binding(0) var<uniform> camera: Camera;
@group(1) @binding(1) var<uniform> settings: PathSettings;
@group(1) @binding(2) var<uniform> stripe: StripeInfo;
/// Row by row, the lanes of a pixel next to each other, as in `paths`.
@group(1) @binding(3) var<storage, read_write> sums: array<PixelSums>;
/// The state of the pixels of this dispatch.
@group(1) @binding(4) var<storage, read_write> paths: array<Path>;
@group(1) @binding(5) var<storage, read_write> progress: PathProgress;

@compute @workgroup_size(WORKGROUP, WORKGROUP)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let width = settings.size.x * settings.n_lanes;
    if id.x >= width || id.y >= stripe.n_rows {
        return;
    }
    let pixel = vec2<u32>(id.x / settings.n_lanes, stripe.first_row + id.y);
    let ix = (pixel.y - stripe.first_stripe_row) * width + id.x;
    let path_ix = id.y * width + id.x;
    let end = settings.first_sample + settings.n_samples;
    var path: Path;
    if stripe.continues != 0u {
        path = paths[path_ix];
        if path.sample_ix >= end {
            return;
        }
    } else {
        path = first_path(camera, settings, pixel, id.x % settings.n_lanes);
    }
    let traced = trace_pixel(camera, settings, pixel, sums[ix], path);
    sums[ix] = traced.sums;
    if traced.path.sample_ix < end {
        paths[path_ix] = traced.path;
        atomicAdd(&progress.n_unfinished, 1u);
    } else {
        paths[path_ix].sample_ix = end;
    }
    if traced.n_cut > 0u {
        atomicAdd(&progress.n_cut, traced.n_cut);
    }
}
