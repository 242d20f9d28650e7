// SPDX-License-Identifier: MIT OR Apache-2.0
//! What is known of the light on a receiver.
#define_import_path lucerna::components::sparse_probes::lit_receiver

/// 32 bytes.
struct LitReceiver {
    /// Mean irradiance from lights [W·m⁻²].
    irradiance: vec3<f32>,
    /// The triangle of the point that stands for it; the top bit is set for the back.
    triangle_and_side: u32,
    /// Share of uniform light that it reflects.
    albedo: vec3<f32>,
    /// Weights of the triangle's second and third corner (`pack2x16unorm`).
    weights: u32,
}

/// The triangle, and the side: 0 front, 1 back.
fn triangle_and_side_of(receiver: LitReceiver) -> vec2<u32> {
    return vec2<u32>(receiver.triangle_and_side & 0x7fffffffu, receiver.triangle_and_side >> 31u);
}
