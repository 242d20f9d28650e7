// SPDX-License-Identifier: MIT OR Apache-2.0
//! The renderer's own data: parallelograms in a storage buffer, one lamp, and no sky.
#define_import_path own::quads

struct Quad {
    corner: vec3<f32>,
    reserved_a: u32,
    /// From the corner along both sides. cross(u, v) is the front.
    u: vec3<f32>,
    reserved_b: u32,
    v: vec3<f32>,
    reserved_c: u32,
    color: vec3<f32>,
    reserved_d: u32,
}

struct Lamp {
    position: vec3<f32>,
    reserved: u32,
    /// [W·sr⁻¹]
    intensity: vec3<f32>,
}

@group(0) @binding(0) var<storage, read> quads: array<Quad>;
@group(0) @binding(1) var<uniform> lamp: Lamp;
