// SPDX-License-Identifier: MIT OR Apache-2.0
//! A receiver: one side of a surface, as far as a texel of the lightmap reaches.
#define_import_path lucerna::components::sparse_probes::receiver

/// 16 bytes.
struct Receiver {
    /// The triangle of the point that stands for it.
    triangle: u32,
    /// Weights of the triangle's second and third corner (`pack2x16unorm`).
    weights: u32,
    /// Column and row, 16 bits each, the column low.
    texel: u32,
    /// 0: the front, where the triangle's corners run counter-clockwise; 1: the back.
    side: u32,
}

/// The texel: column, row.
fn receiver_texel(receiver: Receiver) -> vec2<u32> {
    return vec2<u32>(receiver.texel & 0xffffu, receiver.texel >> 16u);
}
