// SPDX-License-Identifier: MIT OR Apache-2.0
//! What is around a place: how near surfaces are, and of how many one sees the back.
#define_import_path lucerna::integrators::surroundings

#import lucerna::components::probes::octahedral_map::direction_of_texel
#import lucerna::scene::rays::nearest_hit
#import lucerna::scene::surface::surface_at
#import lucerna::scene::types::{Ray, hit_is_miss}

/// What some rays from a place meet.
struct Surroundings {
    /// Towards the nearest surface that they meet, unit length; 0 if they meet none.
    direction: vec3<f32>,
    /// Its distance; that of the longest ray if they meet none [m].
    distance: f32,
    /// Rays that end at the back of a single-sided surface.
    n_backs: u32,
    /// Rays that meet anything.
    n_met: u32,
}

/// What `rays`² rays from a place meet, spread evenly over a texel of an octahedral map, none longer than `most` [m].
fn surroundings_in_texel(position: vec3<f32>, texel: u32, rays: u32, most: f32) -> Surroundings {
    var found = Surroundings(vec3<f32>(0.0), most, 0u, 0u);
    for (var ix = 0u; ix < rays * rays; ix++) {
        let inside = (vec2<f32>(vec2<u32>(ix % rays, ix / rays)) + 0.5) / f32(rays);
        let direction = direction_of_texel(texel, inside);
        let hit = nearest_hit(Ray(position, 0.0, direction, most));
        if hit_is_miss(hit) {
            continue;
        }
        found.n_met += 1u;
        if hit.t < found.distance {
            found.direction = direction;
            found.distance = hit.t;
        }
        let surface = surface_at(hit.triangle, hit.barycentrics);
        if dot(surface.geometric_normal, direction) > 0.0 && !surface.double_sided {
            found.n_backs += 1u;
        }
    }
    return found;
}

/// Rays of which this share ends at the back of a single-sided surface begin inside or behind something; and those of which, of all that
/// meet anything, a half does (behind an edge, most meet nothing).
const INSIDE_SHARE: f32 = 0.05;

/// Whether a place is inside or behind something: of `n` rays, what they met.
fn is_inside_something(n_backs: u32, n_met: u32, n: u32) -> bool {
    return f32(n_backs) > INSIDE_SHARE * f32(n) || 2u * n_backs > n_met;
}
