// SPDX-License-Identifier: MIT OR Apache-2.0
//! A lit and a dark room with something between them: how much light leaks through.

use crate::session::camera;
use crate::support::{lambert, quad, room, scene};
use glam::Vec3;
use lucerna::scene::{Camera, Light, Material, Scene};

/// What stands between the lit and the dark room.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Between {
    Wall,
    /// A wall that leaves 0.6 m free.
    Door,
    /// Two walls that cross: the dark room meets the lit one only at the edge between them.
    Corner,
}

/// Two rooms, of which the first is lit.
///
/// `wall`: from where to where it reaches along x (and z) [m]; the same number twice: a double-sided sheet.
pub fn divided_room(wall: [f32; 2], between: Between) -> Scene {
    // Rooms of 2 m × 2 m × 2 m; the light stands in the first.
    let is_corner = between == Between::Corner;
    let length = if is_corner { 4.0 } else { 2.0 };
    let mut meshes = room([4.0, 2.0, length], 0);
    let depth = if between == Between::Door { 1.4 } else { length };
    let [a, b] = wall;
    let sheet = a == b;
    let material = usize::from(sheet);
    let across_x = |x: f32| [[x, 0.0, 0.0], [x, 0.0, depth], [x, 2.0, depth], [x, 2.0, 0.0]];
    let across_z = |z: f32| across_x(z).map(|[x, y, z]| [z, y, x]);
    let mut wall_of = |at: &dyn Fn(f32) -> [[f32; 3]; 4], turned: f32, other: f32| {
        meshes.push(quad(at(turned), material));
        meshes.last_mut().unwrap().triangles.iter_mut().for_each(|t| t.swap(1, 2));
        if !sheet {
            meshes.push(quad(at(other), material));
        }
    };
    wall_of(&across_x, b, a);
    if is_corner {
        // (Seen from z the corners run the other way round.)
        wall_of(&across_z, a, b);
    }
    if between == Between::Door {
        meshes.push(quad([[a, 0.0, depth], [b, 0.0, depth], [b, 2.0, depth], [a, 2.0, depth]], 0));
    }
    let both_sides = Material { double_sided: true, ..lambert([0.6; 3]) };
    let mut world = scene(meshes, vec![lambert([0.6; 3]), both_sides]);
    world.lights.push(Light::Point {
        position: Vec3::new(0.8, 1.6, 0.8),
        intensity: Vec3::splat(3.0),
        range: None,
    });
    world
}

/// Mean indirect light that `look` finds in the dark room, relative to the lit one.
pub fn dark_over_lit(between: Between, mut look: impl FnMut(&Camera) -> f64) -> f64 {
    let lit = look(&camera([0.2, 1.0, 1.8], [1.8, 0.5, 0.4]));
    let dark = if between == Between::Corner {
        look(&camera([3.8, 1.0, 3.8], [2.2, 0.5, 2.2]))
    } else {
        look(&camera([3.8, 1.0, 1.8], [2.2, 0.5, 0.4]))
    };
    dark / lit
}
