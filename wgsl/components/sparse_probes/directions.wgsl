// SPDX-License-Identifier: MIT OR Apache-2.0
//! In which directions probes look: the same for all.
#define_import_path lucerna::components::sparse_probes::directions

#import lucerna::sampling::low_discrepancy::hammersley
#import lucerna::sampling::sphere::sample_uniform_sphere

/// Direction `ix` of `n`, unit length: stratified over the sphere, in the middle of `n` slices of the same area. `ix` < `n` ≤ 2²³.
fn look_direction(ix: u32, n: u32) -> vec3<f32> {
    return sample_uniform_sphere(hammersley(ix, n) + vec2<f32>(0.5 / f32(n), 0.0));
}
