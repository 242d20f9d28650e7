// SPDX-License-Identifier: MIT OR Apache-2.0
//! Uniform light from all sides, with occlusion by what is near: rays over the hemisphere, some of which are blocked.
//!
//! Dispatch: ceil(width/8) × ceil(height/8) × 1.

#import lucerna::geometry::ray_offset::offset_ray_origin
#import lucerna::math::frame::frame_from_normal
#import lucerna::sampling::hemisphere::sample_cosine_hemisphere
#import lucerna::sampling::low_discrepancy::sobol_owen
#import lucerna::sampling::pcg::pcg3d
#import lucerna::scene::pixel::{pixel_surface, view}
#import lucerna::scene::rays::any_hit
#import lucerna::scene::types::Ray

struct Ambient {
    /// Radiance from all sides [W·sr⁻¹·m⁻²].
    radiance: f32,
    /// Greatest distance of what blocks light [m].
    distance: f32,
    /// Rays per pixel and frame.
    n_rays: u32,
    /// 1: the share of open rays is shown.
    shows_openness: u32,
}

@group(1) @binding(0) var<uniform> ambient: Ambient;
@group(1) @binding(1) var indirect: texture_storage_2d<rgba32float, write>;

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if any(id.xy >= view.size) {
        return;
    }
    let surface = pixel_surface(id.xy);
    if !surface.is_surface {
        textureStore(indirect, id.xy, vec4<f32>(0.0, 0.0, 0.0, 1.0));
        return;
    }
    let basis = frame_from_normal(surface.shading_normal);
    let hash = pcg3d(vec3<u32>(id.xy, view.seed)).x;
    var n_open = 0u;
    for (var ix = 0u; ix < ambient.n_rays; ix++) {
        let direction = basis * sample_cosine_hemisphere(sobol_owen(view.frame * ambient.n_rays + ix, hash));
        if dot(direction, surface.geometric_normal) <= 0.0 {
            continue;
        }
        let origin = offset_ray_origin(
            surface.position,
            surface.position_error,
            surface.geometric_normal,
            direction,
        );
        n_open += u32(!any_hit(Ray(origin, 0.0, direction, ambient.distance)));
    }
    let open = f32(n_open) / f32(ambient.n_rays);
    // A Lambertian surface under uniform light L reflects albedo · L.
    let light = surface.albedo * ambient.radiance * open;
    let shown = select(light, vec3<f32>(open), ambient.shows_openness != 0u);
    textureStore(indirect, id.xy, vec4<f32>(shown, open));
}
