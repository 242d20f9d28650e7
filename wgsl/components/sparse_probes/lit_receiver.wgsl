// SPDX-License-Identifier: MIT OR Apache-2.0
//! What is known of the light on a receiver.
#define_import_path lucerna::components::sparse_probes::lit_receiver

/// Points of a receiver that are lit, one in each frame.
const LIT_POINTS: u32 = 4u;

/// 64 bytes.
struct LitReceiver {
    /// Light of lights that it reflects [W·m⁻²]: a mean over points.
    reflected: vec3<f32>,
    /// 0 front, 1 back.
    side: u32,
    /// Share of uniform light that it reflects: a mean over points.
    albedo: vec3<f32>,
    reserved: u32,
    /// Two points each: triangle, weights of its second and third corner (`pack2x16unorm`). Where a receiver has fewer, they repeat.
    points: array<vec4<u32>, 2>,
}
