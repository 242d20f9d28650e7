// SPDX-License-Identifier: MIT OR Apache-2.0
//! Field: probes of a lattice as spheres, to look at.
//!
//! Interface: `first_sphere`. The variant `probes=net` has those of nets.
#define_import_path lucerna::fields::probe_spheres

#import lucerna::components::probes::sphere::{SphereHit, sphere_hit}
#import lucerna::components::voxels::bricks::NO_SLOT
#import lucerna::components::voxels::grid::{grid_from_world, is_inside}
#import lucerna::components::voxels::walk::{grid_point, grid_ray, step_out_of}
#import lucerna::fields::probe_store::probes
#import lucerna::fields::probes::{place_of_probe, probe_of_corner}

/// The first probe's sphere along a ray, from cell to cell of the lattice; `probe` is NO_SLOT if there is none before `end` [m]. `origin` [m];
/// `direction`: unit length.
fn first_sphere(origin: vec3<f32>, direction: vec3<f32>, end: f32) -> SphereHit {
    // The part of a corner is the cell around it.
    let ray = grid_ray(grid_from_world(probes.lattice, origin) + 0.5, direction);
    let low = -ray.origin * ray.inverse;
    let high = (vec3<f32>(probes.lattice.size) - ray.origin) * ray.inverse;
    let entries = min(low, high);
    var t = max(max(entries.x, max(entries.y, entries.z)), 0.0);
    let last = vec3<i32>(probes.lattice.size) - 1;
    var cell = clamp(vec3<i32>(floor(grid_point(ray, t))), vec3<i32>(0), last);
    let most = 3u * (probes.lattice.size.x + probes.lattice.size.y + probes.lattice.size.z);
    let end_t = end / probes.lattice.cell;
    for (var step = 0u; step < most && t < end_t && is_inside(probes.lattice, cell); step++) {
        let probe = probe_of_corner(cell);
        if probe != NO_SLOT {
            let hit = sphere_hit(ray.origin, ray.direction, place_of_probe(probe).place + 0.5, end_t);
            if hit.t < end_t {
                return SphereHit(probe, hit.t, hit.normal);
            }
        }
        let next = step_out_of(ray, cell, cell + 1, t);
        cell = next.cell;
        t = next.t;
    }
    return SphereHit(NO_SLOT, end_t, vec3<f32>(0.0));
}
