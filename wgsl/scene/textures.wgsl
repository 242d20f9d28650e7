// SPDX-License-Identifier: MIT OR Apache-2.0
//! Scene seam: reading material textures from the atlas.
//!
//! Texels are fetched one by one and wrapped in integers, so filtering is exact at every border and
//! in every wrap mode; sRGB is decoded before filtering. `level` counts mips; level 0 is the image.
#define_import_path lucerna::scene::textures

#import lucerna::color::srgb::linear_from_srgb
#import lucerna::texture::footprint::mips_between
#import lucerna::texture::wrap::wrap_texel
#import lucerna::scene::data::{atlas, TextureSlot}
#import lucerna::scene::data::{SLOT_MIRROR_U, SLOT_CLAMP_U, SLOT_MIRROR_V, SLOT_CLAMP_V, SLOT_NEAREST}

/// First texel and size of a mip.
fn mip_rect(slot: TextureSlot, level: u32) -> vec4<i32> {
    var origin = slot.origin;
    var size = slot.size;
    for (var mip = 0u; mip < level; mip++) {
        if all(size == vec2<u32>(1u)) {
            break;
        }
        origin += select(vec2<u32>(0u, size.y), vec2<u32>(size.x, 0u), mip == 0u);
        size = max(size / 2u, vec2<u32>(1u));
    }
    return vec4<i32>(vec4<u32>(origin, size));
}

/// Four texels around a point and the weights between them.
struct Footprint {
    /// (x, y) of the upper left, (x, y) of the lower right.
    texels: vec4<i32>,
    weights: vec2<f32>,
}

/// `uv`: image coordinates, after the texture transform.
fn footprint(slot: TextureSlot, uv: vec2<f32>, level: u32) -> Footprint {
    let rect = mip_rect(slot, level);
    let size = vec2<f32>(rect.zw);
    // Beyond 2²⁴ texels f32 has no fractions left; it also keeps the conversion to integers defined.
    let position = clamp(uv * size, vec2<f32>(-1.6e7), vec2<f32>(1.6e7));
    let shifted = select(position - 0.5, position, (slot.flags & SLOT_NEAREST) != 0u);
    let base = floor(shifted);
    let corner = vec2<i32>(base);
    let mirror_u = (slot.flags & SLOT_MIRROR_U) != 0u;
    let clamp_u = (slot.flags & SLOT_CLAMP_U) != 0u;
    let mirror_v = (slot.flags & SLOT_MIRROR_V) != 0u;
    let clamp_v = (slot.flags & SLOT_CLAMP_V) != 0u;
    let x = wrap_texel(corner.x, rect.z, mirror_u, clamp_u);
    let y = wrap_texel(corner.y, rect.w, mirror_v, clamp_v);
    let next_x = wrap_texel(corner.x + 1, rect.z, mirror_u, clamp_u);
    let next_y = wrap_texel(corner.y + 1, rect.w, mirror_v, clamp_v);
    let weights = select(shifted - base, vec2<f32>(0.0), (slot.flags & SLOT_NEAREST) != 0u);
    return Footprint(rect.xyxy + vec4<i32>(x, y, next_x, next_y), weights);
}

/// The image's coordinates of the mesh's.
fn transform_uv(slot: TextureSlot, uv: vec2<f32>) -> vec2<f32> {
    let point = vec3<f32>(uv, 1.0);
    return vec2<f32>(dot(slot.row_u, point), dot(slot.row_v, point));
}

/// A texel's colour, decoded from sRGB; alpha is unchanged. (Adapters that decode themselves are off by up to 0.3 %:
/// NVIDIA's of 2026.)
fn decoded(texel: vec4<f32>) -> vec4<f32> {
    return vec4<f32>(linear_from_srgb(texel.rgb), texel.a);
}

/// Colour decoded from sRGB, with linear alpha; white if there is no texture.
fn sample_srgb(slot: TextureSlot, uv: vec2<f32>, level: u32) -> vec4<f32> {
    if slot.size.x == 0u {
        return vec4<f32>(1.0);
    }
    let at = footprint(slot, transform_uv(slot, uv), level);
    let upper = mix(
        decoded(textureLoad(atlas, at.texels.xy, slot.layer, 0)),
        decoded(textureLoad(atlas, at.texels.zy, slot.layer, 0)),
        at.weights.x,
    );
    let lower = mix(
        decoded(textureLoad(atlas, at.texels.xw, slot.layer, 0)),
        decoded(textureLoad(atlas, at.texels.zw, slot.layer, 0)),
        at.weights.x,
    );
    return mix(upper, lower, at.weights.y);
}

/// Numbers in [0, 1] as stored; white if there is no texture.
fn sample_linear(slot: TextureSlot, uv: vec2<f32>, level: u32) -> vec4<f32> {
    if slot.size.x == 0u {
        return vec4<f32>(1.0);
    }
    let at = footprint(slot, transform_uv(slot, uv), level);
    let upper = mix(
        textureLoad(atlas, at.texels.xy, slot.layer, 0),
        textureLoad(atlas, at.texels.zy, slot.layer, 0),
        at.weights.x,
    );
    let lower = mix(
        textureLoad(atlas, at.texels.xw, slot.layer, 0),
        textureLoad(atlas, at.texels.zw, slot.layer, 0),
        at.weights.x,
    );
    return mix(upper, lower, at.weights.y);
}

/// As [`sample_srgb`] at a fractional level: between the two nearest mips (trilinear). `level` ≥ 0.
fn sample_srgb_between(slot: TextureSlot, uv: vec2<f32>, level: f32) -> vec4<f32> {
    let mips = mips_between(level);
    var sum = vec4<f32>(0.0);
    for (var ix = 0u; ix < 2u; ix++) {
        if mips.weights[ix] > 0.0 {
            sum += mips.weights[ix] * sample_srgb(slot, uv, mips.first + ix);
        }
    }
    return sum;
}

/// As [`sample_linear`] at a fractional level: between the two nearest mips. `level` ≥ 0.
fn sample_linear_between(slot: TextureSlot, uv: vec2<f32>, level: f32) -> vec4<f32> {
    let mips = mips_between(level);
    var sum = vec4<f32>(0.0);
    for (var ix = 0u; ix < 2u; ix++) {
        if mips.weights[ix] > 0.0 {
            sum += mips.weights[ix] * sample_linear(slot, uv, mips.first + ix);
        }
    }
    return sum;
}
