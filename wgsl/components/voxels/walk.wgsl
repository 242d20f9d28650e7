// SPDX-License-Identifier: MIT OR Apache-2.0
//! A ray's way through the cells of a grid, from one to the next: J. Amanatides, A. Woo, "A Fast Voxel Traversal Algorithm
//! for Ray Tracing", Eurographics 1987. Blocks of cells that are known to be empty are crossed in one step.
//!
//! Units: cells, from the grid's corner.
#define_import_path lucerna::components::voxels::walk

/// A ray in a grid.
struct GridRay {
    /// [cells]
    origin: vec3<f32>,
    /// Unit length.
    direction: vec3<f32>,
    /// 1/direction, finite.
    inverse: vec3<f32>,
}

/// Where a ray is.
struct GridStep {
    /// It may be outside the grid.
    cell: vec3<i32>,
    /// How far it has come [cells].
    t: f32,
}

/// A ray from `origin` [cells] along `direction` (unit length).
fn grid_ray(origin: vec3<f32>, direction: vec3<f32>) -> GridRay {
    let away = select(max(direction, vec3<f32>(1e-12)), min(direction, vec3<f32>(-1e-12)), direction < vec3<f32>(0.0));
    return GridRay(origin, direction, 1.0 / away);
}

/// The point of a ray at distance `t` [cells].
fn grid_point(ray: GridRay, t: f32) -> vec3<f32> {
    return ray.origin + t * ray.direction;
}

/// The first cell behind a block of cells in which the ray is: those from `low` to `high` (excluded). `t`: how far the ray has come, at
/// least [cells].
fn step_out_of(ray: GridRay, low: vec3<i32>, high: vec3<i32>, t: f32) -> GridStep {
    let ahead = ray.inverse > vec3<f32>(0.0);
    let exits = (select(vec3<f32>(low), vec3<f32>(high), ahead) - ray.origin) * ray.inverse;
    let first = min(exits.x, min(exits.y, exits.z));
    let out = max(first, t);
    // (Rounding could lead beside the block.)
    var cell = clamp(vec3<i32>(floor(grid_point(ray, out))), low, high - 1);
    let beyond = select(low - 1, high, ahead);
    if exits.x == first {
        cell.x = beyond.x;
    } else if exits.y == first {
        cell.y = beyond.y;
    } else {
        cell.z = beyond.z;
    }
    return GridStep(cell, out);
}
