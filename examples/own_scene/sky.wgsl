// SPDX-License-Identifier: MIT OR Apache-2.0
//! A black sky.
#define_import_path lucerna::scene::sky

fn sky_radiance(direction: vec3<f32>) -> vec3<f32> {
    return vec3<f32>(0.0);
}
