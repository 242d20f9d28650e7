// SPDX-License-Identifier: MIT OR Apache-2.0
//! The G-buffer: what a frame's kernels know about the surface in each pixel. 32 bytes per pixel.
//!
//! | texture | format | holds |
//! |---|---|---|
//! | albedo | rgba8unorm-srgb | rgb: base colour; a (linear): metallic |
//! | normals | rg32uint | shading and geometric normal, `octahedral::pack_direction`, towards the viewer |
//! | emission | rgba16float | rgb: radiance emitted towards the camera · `view.emission_scale`; a: roughness |
//! | motion | rg16float | where the point was in the frame before, less where it is (`frame::view`) |
//! | triangles | r32uint | the triangle's index (`scene::triangles`) |
//! | depth | depth32float | near/z, 0 where there is no surface |
//!
//! A kernel declares the textures that it reads in its own group, loads the texels of its pixel and calls
//! [`decode_gbuffer`].
#define_import_path lucerna::frame::gbuffer

#import lucerna::camera::primary_ray::point_at_depth
#import lucerna::frame::view::{FrameView, sampled_point, view_direction}
#import lucerna::math::constants::UNIT_ROUNDOFF
#import lucerna::math::octahedral::{pack_direction, unpack_direction}

/// The texels of one pixel, as they are loaded and stored (without motion).
struct GBufferTexels {
    albedo: vec4<f32>,
    normals: vec2<u32>,
    emission: vec4<f32>,
    depth: f32,
}

/// The surface in a pixel. World space.
struct GBufferSurface {
    /// False: the pixel sees the sky, and only `to_viewer` is valid.
    is_surface: bool,
    /// Lambertian with `albedo`; metallic and roughness have no effect.
    lambert: bool,
    /// [m]
    position: vec3<f32>,
    /// Distance along the view axis [m].
    depth: f32,
    /// Bound of the position's distance from the surface, per axis [m]; for
    /// `geometry::ray_offset::offset_ray_origin`.
    position_error: vec3<f32>,
    /// In [0, 1].
    metallic: f32,
    /// Unit length, on the viewer's side, to 6.5e-5 rad.
    geometric_normal: vec3<f32>,
    /// Perceptual, in [0, 1].
    roughness: f32,
    /// Unit length, turned towards the viewer, to 6.5e-5 rad; with normal map.
    shading_normal: vec3<f32>,
    /// Linear base colour, in [0, 1]; white if irradiance is requested.
    albedo: vec3<f32>,
    /// The base colour, even if irradiance is requested.
    base_color: vec3<f32>,
    /// Radiance that leaves towards the camera [W·sr⁻¹·m⁻²].
    emission: vec3<f32>,
    /// Unit length, from the surface towards the camera.
    to_viewer: vec3<f32>,
}

/// Largest number of a 16-bit float.
const MAX_EMISSION: f32 = 65504.0;
/// How far the rasteriser's grid may move a triangle's border [pixels]: corners are snapped to
/// 1/256 of a pixel, as desktop GPUs, Direct3D and lavapipe do.
const SNAPPING: f32 = 1.0 / 256.0;
/// Roundings in a position found along the pixel's ray: those of the corners' differences, two products and a quotient
/// when it was found, and those of the depth and the ray here.
const RAY_ROUNDINGS: f32 = 16.0;

/// The texels of a surface. Normals: unit length, towards the viewer; `depth`: along the view axis [m].
fn encode_gbuffer(
    view: FrameView,
    base_color: vec3<f32>,
    metallic: f32,
    roughness: f32,
    shading_normal: vec3<f32>,
    geometric_normal: vec3<f32>,
    emission: vec3<f32>,
    depth: f32,
) -> GBufferTexels {
    return GBufferTexels(
        vec4<f32>(base_color, metallic),
        vec2<u32>(pack_direction(shading_normal), pack_direction(geometric_normal)),
        vec4<f32>(min(emission * view.emission_scale, vec3<f32>(MAX_EMISSION)), roughness),
        view.near / depth,
    );
}

/// The surface of a pixel's texels.
fn decode_gbuffer(view: FrameView, pixel: vec2<u32>, texels: GBufferTexels) -> GBufferSurface {
    var surface: GBufferSurface;
    surface.to_viewer = -view_direction(view, pixel);
    if !(texels.depth > 0.0) {
        return surface;
    }
    let camera = view.camera;
    let white = view.irradiance != 0u;
    surface.is_surface = true;
    surface.lambert = white || view.lambert != 0u;
    surface.depth = view.near / texels.depth;
    surface.position = point_at_depth(camera, sampled_point(view, pixel), surface.depth);
    surface.position_error = vec3<f32>(position_error(view, surface.position, surface.depth));
    surface.shading_normal = unpack_direction(texels.normals.x);
    surface.geometric_normal = unpack_direction(texels.normals.y);
    surface.albedo = select(texels.albedo.rgb, vec3<f32>(1.0), white);
    surface.base_color = texels.albedo.rgb;
    surface.metallic = texels.albedo.a;
    surface.roughness = texels.emission.a;
    surface.emission = texels.emission.rgb / view.emission_scale;
    return surface;
}

/// How far the point of a pixel may be from its triangle [m]: because of the rasteriser's snapping, which may put the
/// pixels of a border next to it, and of rounding.
fn position_error(view: FrameView, position: vec3<f32>, depth: f32) -> f32 {
    let camera = view.camera;
    let scale = select(depth, 1.0, camera.orthographic != 0u);
    let pixel = 2.0 * scale * max(
        length(camera.right) / f32(view.size.x),
        length(camera.up) / f32(view.size.y),
    );
    let size = length(position - camera.position) + length(camera.position) + scale * length(camera.right);
    return SNAPPING * pixel + RAY_ROUNDINGS * UNIT_ROUNDOFF * size;
}
