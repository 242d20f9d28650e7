// SPDX-License-Identifier: MIT OR Apache-2.0
//! Wrap modes of textures, in integers, so that filtering is exact at every border (glTF 2.0 §3.8.4.5; OpenGL 4.6 §8.14.2).
#define_import_path lucerna::texture::wrap

/// The texel index, in [0, size), of a coordinate anywhere: clamped to the edge, mirrored at each border, or (neither) repeated. `size` ≥ 1,
/// below 2³⁰.
fn wrap_texel(texel: i32, size: i32, mirror: bool, clamp_to_edge: bool) -> i32 {
    if clamp_to_edge {
        return clamp(texel, 0, size - 1);
    }
    let period = select(size, 2 * size, mirror);
    // % keeps the sign of the dividend.
    let inside = ((texel % period) + period) % period;
    return select(inside, period - 1 - inside, inside >= size);
}
