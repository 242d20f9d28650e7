// SPDX-License-Identifier: MIT OR Apache-2.0
//! Draws probes as white spheres in their own light, in front of the surfaces that they light.
//!
//! A ray through each pixel walks the lattice, from the part of one corner to that of the next, up to the pixel's surface. Probes that are
//! inside something have red stripes.
//!
//! Dispatch: ceil(width/8) × ceil(height/8) × 1. Workgroup memory: none. Cost: up to three times the lattice's size in steps.

#import lucerna::camera::primary_ray::primary_ray
#import lucerna::color::luminance::luminance
#import lucerna::components::probes::place::{place_is_inside, place_moved}
#import lucerna::components::probes::probe_light::light_irradiance
#import lucerna::components::voxels::bricks::NO_SLOT
#import lucerna::components::voxels::grid::{grid_from_world, is_inside}
#import lucerna::components::voxels::walk::{grid_point, grid_ray, step_out_of}
#import lucerna::fields::probes::{light_of_probe, probe_irradiance, probe_of_corner, probes, record_of_probe}
#import lucerna::frame::reflect::reflected_irradiance
#import lucerna::frame::view::sampled_point
#import lucerna::math::constants::INV_PI
#import lucerna::scene::pixel::{pixel_distance, pixel_surface, view}

const WORKGROUP: u32 = 8u;
/// Radius of a sphere [cells].
const RADIUS: f32 = 0.12;
/// Stripes over the height of a sphere.
const STRIPES: f32 = 6.0;

/// rgb: radiance [W·sr⁻¹·m⁻²].
@group(1) @binding(0) var indirect: texture_storage_2d<rgba32float, write>;

/// The radiance of a probe's sphere where its normal is `normal` (unit length).
fn sphere_radiance(probe: u32, normal: vec3<f32>) -> vec3<f32> {
    let light = max(light_irradiance(light_of_probe(probe), normal), vec3<f32>(0.0)) * INV_PI;
    let is_striped = (i32(floor(normal.y * STRIPES)) & 1) != 0;
    if place_is_inside(record_of_probe(probe).y) && is_striped {
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
        end = depth / max(dot(through.direction, view.camera.forward), 1e-6) / probes.lattice.cell;
    }
    // The part of a corner is the cell around it.
    let ray = grid_ray(grid_from_world(probes.lattice, through.origin) + 0.5, through.direction);
    let low = -ray.origin * ray.inverse;
    let high = (vec3<f32>(probes.lattice.size) - ray.origin) * ray.inverse;
    let entries = min(low, high);
    var t = max(max(entries.x, max(entries.y, entries.z)), 0.0);
    let last = vec3<i32>(probes.lattice.size) - 1;
    var cell = clamp(vec3<i32>(floor(grid_point(ray, t))), vec3<i32>(0), last);
    let most = 3u * (probes.lattice.size.x + probes.lattice.size.y + probes.lattice.size.z);
    for (var step = 0u; step < most && t < end && is_inside(probes.lattice, cell); step++) {
        let probe = probe_of_corner(cell);
        if probe != NO_SLOT {
            let center = vec3<f32>(cell) + 0.5 + place_moved(record_of_probe(probe).y);
            let to_center = center - ray.origin;
            let middle = dot(to_center, ray.direction);
            let apart = RADIUS * RADIUS - (dot(to_center, to_center) - middle * middle);
            let near = middle - sqrt(max(apart, 0.0));
            if apart > 0.0 && near > 0.0 && near < end {
                shown = sphere_radiance(probe, (grid_point(ray, near) - center) / RADIUS);
                break;
            }
        }
        let next = step_out_of(ray, cell, cell + 1, t);
        cell = next.cell;
        t = next.t;
    }
    textureStore(indirect, id.xy, vec4<f32>(shown, 1.0));
}
