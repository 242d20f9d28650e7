// SPDX-License-Identifier: MIT OR Apache-2.0
//! Gives texels of the lightmap without a receiver the mean of their neighbours', so that interpolation at the border of a chart reads light.
//!
//! Dispatch: ceil(width/8) × ceil(height/8) × 2 sides of each output. Workgroup memory: none.

#import lucerna::fields::lightmap::{NO_RECEIVER, lightmap, receiver_in_texel}

const WORKGROUP: u32 = 8u;
const MAX_TEXEL: f32 = 65504.0;

struct DilateInfo {
    /// As in `sparse_probes/receive`.
    scale: f32,
    reserved_a: u32,
    reserved_b: u32,
    reserved_c: u32,
}

@group(1) @binding(0) var<uniform> info: DilateInfo;
/// rgb: what arrives at each receiver, output after output; a: 1 if it is known.
@group(1) @binding(1) var<storage, read> irradiance: array<vec4<f32>>;
@group(1) @binding(2) var lightmap_out: texture_storage_2d_array<rgba16float, write>;

@compute @workgroup_size(WORKGROUP, WORKGROUP)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if any(id.xy >= lightmap.size) {
        return;
    }
    let side = id.z & 1u;
    let first = (id.z >> 1u) * lightmap.n_receivers;
    let own = receiver_in_texel(id.xy, side);
    if own != NO_RECEIVER {
        return;
    }
    var sum = vec4<f32>(0.0);
    for (var k = 0u; k < 9u; k++) {
        // (Texels beyond the left and upper border are beyond the right and lower one, too.)
        let at = id.xy + vec2<u32>(k % 3u, k / 3u) - 1u;
        if all(at < lightmap.size) {
            let other = receiver_in_texel(at, side);
            if other != NO_RECEIVER {
                sum += irradiance[first + other];
            }
        }
    }
    if sum.a > 0.0 {
        let texel = clamp(sum.rgb / sum.a * info.scale, vec3<f32>(-MAX_TEXEL), vec3<f32>(MAX_TEXEL));
        textureStore(lightmap_out, id.xy, id.z, vec4<f32>(texel, 1.0));
    }
}
