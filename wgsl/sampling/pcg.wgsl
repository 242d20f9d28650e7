// SPDX-License-Identifier: MIT OR Apache-2.0
//! Random numbers as hashes of integers.
//!
//! M. Jarzynski, M. Olano, "Hash Functions for GPU Rendering", JCGT 9(3), 2020: `pcg`, `pcg3d`,
//! `pcg4d`. The same input gives the same bits on every machine.
#define_import_path lucerna::sampling::pcg

/// Hashes one 32-bit number to one well-mixed number.
fn pcg(v: u32) -> u32 {
    let state = v * 747796405u + 2891336453u;
    let word = ((state >> ((state >> 28u) + 4u)) ^ state) * 277803737u;
    return (word >> 22u) ^ word;
}

/// Hashes three 32-bit numbers to three well-mixed numbers.
fn pcg3d(v: vec3<u32>) -> vec3<u32> {
    var w = v * 1664525u + 1013904223u;
    w.x += w.y * w.z;
    w.y += w.z * w.x;
    w.z += w.x * w.y;
    w ^= w >> vec3<u32>(16u);
    w.x += w.y * w.z;
    w.y += w.z * w.x;
    w.z += w.x * w.y;
    return w;
}

/// Hashes four 32-bit numbers to four well-mixed numbers.
fn pcg4d(v: vec4<u32>) -> vec4<u32> {
    var w = v * 1664525u + 1013904223u;
    w.x += w.y * w.w;
    w.y += w.z * w.x;
    w.z += w.x * w.y;
    w.w += w.y * w.z;
    w ^= w >> vec4<u32>(16u);
    w.x += w.y * w.w;
    w.y += w.z * w.x;
    w.z += w.x * w.y;
    w.w += w.y * w.z;
    return w;
}

/// A number in [0, 1) from the 24 high bits; every result is a multiple of 2⁻²⁴.
fn unit_float(bits: u32) -> f32 {
    return f32(bits >> 8u) * 5.9604644775390625e-8;
}

/// Four numbers in [0, 1).
fn unit_float_vec4(bits: vec4<u32>) -> vec4<f32> {
    return vec4<f32>(bits >> vec4<u32>(8u)) * 5.9604644775390625e-8;
}

/// Four independent uniform numbers in [0, 1) for a stream (pixel or probe, seed), a frame or
/// sample, and a dimension.
fn random_vec4(stream: vec2<u32>, frame: u32, dimension: u32) -> vec4<f32> {
    return unit_float_vec4(pcg4d(vec4<u32>(stream, frame, dimension)));
}
