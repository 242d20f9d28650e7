// SPDX-License-Identifier: MIT OR Apache-2.0
//! A cone, and how it is marched: C. Crassin et al., "Interactive Indirect Illumination Using Voxel Cone Tracing",
//! 2011.
//!
//! At distance t a cone of half aperture β is 2·t·tan β wide, and cells of that width are read: mip = log₂(width/cell).
//! Two things are new here. A cell is never larger than the height above the plane that the cone leaves, because a
//! coarser cell would include the surface's own voxels, which would hide the cone from the light that the surface faces
//! (from behind they are dark). And a step may be longer than a cell only by the caller's step scale.
#define_import_path lucerna::cone::march

#import lucerna::math::constants::FLOAT_MAX

/// A sphere that grows as it moves.
struct Cone {
    /// On the surface [m].
    origin: vec3<f32>,
    /// tan of half the aperture, ≥ 0.
    spread: f32,
    /// Unit length.
    direction: vec3<f32>,
    /// Where marching ends [m].
    max_distance: f32,
    /// Unit normal of the surface that the cone leaves; zeros: there is no surface.
    normal: vec3<f32>,
    /// How far along the normal the cone starts, to be clear of the surface's own voxels [m].
    offset: f32,
}

/// How cones are marched.
struct ConeSettings {
    /// Length of a step in widths of the cone.
    step_scale: f32,
    /// Added to the mip.
    mip_bias: f32,
    /// Opacity at which a cone ends, in (0, 1].
    opacity_threshold: f32,
    /// Start offset along the normal in cells of the finest level there.
    start_cells: f32,
}

/// The voxels of a plane across an axis extend this many cells in front of it: the plane may be half a cell deep in its
/// cell, and filtering adds one.
const PLANE_REACH: f32 = 1.5;
/// Shortest step, as a share of the cell that is read: shorter ones would read the same again.
const MIN_STEP: f32 = 0.5;
/// Filtering spreads a wall one cell to both sides. This many cells before its middle, half of what it hides is hidden:
/// of its depth of 3.25 (`cone::medium`), (1 − 0.35)²/2 is in front, and e^(−3.25 · 0.21) = 0.5.
const HALF_OF_WALL: f32 = 0.35;
/// The most steps of a cone: with half a cell each, the diagonal of 256³ cells takes 887, that of 6 levels 5322. (A
/// bound for cones that are not finite; finite ones never reach it.)
const MAX_STEPS: u32 = 5400u;

/// The point on the axis at distance `t` [m].
fn cone_point(cone: Cone, t: f32) -> vec3<f32> {
    return cone.origin + cone.normal * cone.offset + cone.direction * t;
}

/// Width of a cell along a unit normal [cells]: 1 along an axis, √3 along the diagonal.
fn cells_across(normal: vec3<f32>) -> f32 {
    return abs(normal.x) + abs(normal.y) + abs(normal.z);
}

/// Width at distance `t` [m].
fn cone_width(cone: Cone, t: f32) -> f32 {
    return 2.0 * t * cone.spread;
}

/// Which cells to read.
struct ConeCells {
    /// Edge of the cells that match the cone, between two mips [m].
    matching: f32,
    /// No cell may be larger than this [m].
    largest: f32,
}

/// The cells to read at distance `t` [m]; `finest`: the smallest ones there are [m].
fn cone_cells(cone: Cone, settings: ConeSettings, t: f32, finest: f32) -> ConeCells {
    let matching = max(cone_width(cone, t) * exp2(settings.mip_bias), finest);
    if all(cone.normal == vec3<f32>(0.0)) {
        return ConeCells(matching, FLOAT_MAX);
    }
    let height = cone.offset + t * dot(cone.normal, cone.direction);
    let clear = max(height / (PLANE_REACH * cells_across(cone.normal)), finest);
    return ConeCells(min(matching, clear), clear);
}

/// Length of the step at distance `t` if cells of this size are read [m].
fn cone_step(cone: Cone, settings: ConeSettings, t: f32, cell: f32) -> f32 {
    return max(settings.step_scale * cone_width(cone, t), MIN_STEP * cell);
}

/// Solid angle of a cone [sr].
fn cone_solid_angle(spread: f32) -> f32 {
    // 2π(1 − cos β), cos β = 1/√(1 + tan²β), without cancellation.
    let root = sqrt(1.0 + spread * spread);
    return 6.2831853 * spread * spread / (root * (root + 1.0));
}

/// tan of half the aperture of a cone that has this solid angle, 0 to 2π (excluded) [sr].
fn spread_of_solid_angle(solid_angle: f32) -> f32 {
    let versine = clamp(solid_angle / 6.2831853, 0.0, 0.999);
    return sqrt(versine * (2.0 - versine)) / (1.0 - versine);
}
