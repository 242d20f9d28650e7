// SPDX-License-Identifier: MIT OR Apache-2.0
//! Scene seam: material textures of a scene that has none.
//!
//! Interface as in `wgsl/scene/textures.wgsl`; every texture is white. Without this variant, a
//! kernel for an untextured scene has the code of some 24 texel fetches per surface, and drivers
//! without real branches (lavapipe before Mesa 25) run through all of it.
#define_import_path lucerna::scene::textures

#import lucerna::scene::data::TextureSlot

/// White.
fn sample_srgb(slot: TextureSlot, uv: vec2<f32>, level: u32) -> vec4<f32> {
    return vec4<f32>(1.0);
}

/// White.
fn sample_linear(slot: TextureSlot, uv: vec2<f32>, level: u32) -> vec4<f32> {
    return vec4<f32>(1.0);
}

/// White.
fn sample_srgb_between(slot: TextureSlot, uv: vec2<f32>, level: f32) -> vec4<f32> {
    return vec4<f32>(1.0);
}

/// White.
fn sample_linear_between(slot: TextureSlot, uv: vec2<f32>, level: f32) -> vec4<f32> {
    return vec4<f32>(1.0);
}
