// SPDX-License-Identifier: MIT OR Apache-2.0
//! Field: probes of a net as spheres, to look at.
//!
//! Interface: `first_sphere`.
#define_import_path lucerna::fields::probe_spheres

#import lucerna::components::probes::sphere::{SphereHit, sphere_hit}
#import lucerna::components::voxels::bricks::NO_SLOT
#import lucerna::components::voxels::grid::grid_from_world
#import lucerna::fields::probe_net::net
#import lucerna::fields::probe_store::probes
#import lucerna::fields::probes::place_of_probe

/// The first probe's sphere along a ray, of all probes; `probe` is NO_SLOT if there is none before `end` [m]. `origin` [m]; `direction`:
/// unit length.
fn first_sphere(origin: vec3<f32>, direction: vec3<f32>, end: f32) -> SphereHit {
    let at = grid_from_world(probes.lattice, origin);
    var first = SphereHit(NO_SLOT, end / probes.lattice.cell, vec3<f32>(0.0));
    for (var probe = 0u; probe < net.n_points; probe++) {
        let hit = sphere_hit(at, direction, place_of_probe(probe).place, first.t);
        if hit.t < first.t {
            first = SphereHit(probe, hit.t, hit.normal);
        }
    }
    return first;
}
