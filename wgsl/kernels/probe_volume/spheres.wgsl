// SPDX-License-Identifier: MIT OR Apache-2.0
//! Draws probes as white spheres in their own light, in front of the surfaces that they light.
//!
//! Probes that are inside something have red stripes.
//!
//! Dispatch: ceil(width/8) × ceil(height/8) × 1. Workgroup memory: none. Cost: that of `first_sphere`, up to three times the lattice's size in
//! steps, or all probes of a net.

#import lucerna::camera::primary_ray::primary_ray
#import lucerna::color::luminance::luminance
#import lucerna::components::probes::probe_light::light_irradiance
#import lucerna::components::voxels::bricks::NO_SLOT
#import lucerna::fields::probe_spheres::first_sphere
#import lucerna::fields::probe_store::light_of_probe
#import lucerna::fields::probes::{place_of_probe, probe_irradiance}
#import lucerna::frame::reflect::reflected_irradiance
#import lucerna::frame::view::sampled_point
#import lucerna::math::constants::INV_PI
#import lucerna::scene::pixel::{pixel_distance, pixel_surface, view}

const WORKGROUP: u32 = 8u;
/// Stripes over the height of a sphere.
const STRIPES: f32 = 6.0;

/// rgb: radiance [W·sr⁻¹·m⁻²].
@group(1) @binding(0) var indirect: texture_storage_2d<rgba32float, write>;

/// The radiance of a probe's sphere where its normal is `normal` (unit length).
fn sphere_radiance(probe: u32, normal: vec3<f32>) -> vec3<f32> {
    let light = max(light_irradiance(light_of_probe(probe), normal), vec3<f32>(0.0)) * INV_PI;
    let is_striped = (i32(floor(normal.y * STRIPES)) & 1) != 0;
    if place_of_probe(probe).is_inside && is_striped {
        return vec3<f32>(luminance(light), 0.0, 0.0);
    }
    return light;
}

@compute @workgroup_size(WORKGROUP, WORKGROUP)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if any(id.xy >= view.size) {
        return;
    }
    let surface = pixel_surface(id.xy);
    var shown = vec3<f32>(0.0);
    if surface.is_surface {
        let found = probe_irradiance(surface.position, surface.shading_normal);
        shown = reflected_irradiance(surface, found.rgb);
    }
    let through = primary_ray(view.camera, sampled_point(view, id.xy));
    let depth = pixel_distance(id.xy);
    var end = 1e30;
    if depth > 0.0 {
        end = depth / max(dot(through.direction, view.camera.forward), 1e-6);
    }
    let sphere = first_sphere(through.origin, through.direction, end);
    if sphere.probe != NO_SLOT {
        shown = sphere_radiance(sphere.probe, sphere.normal);
    }
    textureStore(indirect, id.xy, vec4<f32>(shown, 1.0));
}
