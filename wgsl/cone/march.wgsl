// SPDX-License-Identifier: MIT OR Apache-2.0
//! A cone, and how it is stepped through: C. Crassin et al., "Interactive Indirect Illumination Using
//! Voxel Cone Tracing", 2011.
//!
//! At distance t a cone of half aperture β is 2·t·tan β wide, and cells of that width are read: mip =
//! log₂(width/cell). Two things are ours. A cell is never larger than the height over the plane that
//! the cone leaves: the surface's own voxels, which a coarser cell would take in, would hide it from
//! the light that it faces (from behind: dark). And a step may be longer than a cell only by as much as the caller's step scale says.
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
    /// Where stepping ends [m].
    max_distance: f32,
    /// Unit normal of the surface that the cone leaves; zeros: it leaves none.
    normal: vec3<f32>,
    /// How far along the normal the cone begins, to be clear of the surface's own voxels [m].
    offset: f32,
}

/// How cones are stepped through.
struct ConeSettings {
    /// Step in widths of the cone.
    step_scale: f32,
    /// Added to the mip.
    mip_bias: f32,
    /// At this opacity a cone is given up, in (0, 1].
    opacity_threshold: f32,
    /// Start offset along the normal in cells of the finest level there.
    start_cells: f32,
}

/// A plane's voxels reach so many cells into the free, if it stands across an axis: it may stand half a cell high in
/// its cell, and filtering adds one.
const PLANE_REACH: f32 = 1.5;
/// A step is not below this share of the cell that is read: shorter ones find the same again.
const MIN_STEP: f32 = 0.5;
/// Filtering spreads a wall one cell to both sides; so many cells before its middle, half of what it hides is hidden: of its
/// depth of 3.25 (`cone::medium`), (1 − 0.35)²/2 lies in front, and e^(−3.25 · 0.21) = 0.5.
const HALF_OF_WALL: f32 = 0.35;
/// No cone takes more steps: half a cell each along the diagonal of 256³ cells is 887, of 6 levels 5322. (A bound for what is not
/// finite; none that is meets it.)
const MAX_STEPS: u32 = 5400u;

/// The point on the axis at distance `t` [m].
fn cone_point(cone: Cone, t: f32) -> vec3<f32> {
    return cone.origin + cone.normal * cone.offset + cone.direction * t;
}

/// How wide a cell is along a unit normal [cells]: 1 along an axis, √3 along the diagonal.
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

/// Length of the step at distance `t` where cells of this size are read [m].
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
