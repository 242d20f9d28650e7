// SPDX-License-Identifier: MIT OR Apache-2.0
//! The opacity of a voxel's faces if walls meet in it.
//!
//! In a cell in which a floor ends at a wall, the floor covers only the part in front of the wall, and the wall only
//! the part above the floor; nothing can be seen behind both. As shares of the whole cell, both would let light through
//! the corner.
#define_import_path lucerna::components::voxel_pyramid::opacity

/// If at least this share of its open part is covered, a face is assumed to end at walls.
const CORNER_SHARE: f32 = 0.8;
/// Lower bound of depths.
const MIN_DEPTH: f32 = 0.05;

/// The opacity of the visible face of each axis, in [0, 1].
///
/// `coverage`: that of each axis's face, in [0, 1]; `depth`: how deep below the face its surface is, in [0, 1] cells;
/// negative: the axis shows no face, or two. Only concave corners are closed: there every face covers what the others
/// leave open of it. On a convex edge it covers the rest; a face that covers more than CORNER_SHARE⁻¹ of its open part,
/// or less than CORNER_SHARE, keeps its coverage. (An edge through the middle of its cell, or a plane that slants
/// through it in this way, cannot be distinguished from a corner.)
fn corner_opacity(coverage: vec3<f32>, depth: vec3<f32>) -> vec3<f32> {
    let shown = depth >= vec3<f32>(0.0);
    let open = select(vec3<f32>(1.0), max(depth, vec3<f32>(MIN_DEPTH)), shown);
    // The part of each face that the walls of the other two axes leave open.
    let before_walls = open.yzx * open.zxy;
    let covers = (coverage >= CORNER_SHARE * before_walls) & (CORNER_SHARE * coverage <= before_walls);
    let n_shown = countOneBits(u32(shown.x) | (u32(shown.y) << 1u) | (u32(shown.z) << 2u));
    if n_shown < 2u || !all(covers | !shown) {
        return coverage;
    }
    return select(coverage, min(coverage / before_walls, vec3<f32>(1.0)), shown);
}

/// The opacity of a voxel's six faces (+X −X +Y −Y +Z −Z): their coverage, closed where walls meet.
///
/// `coverage`: that of each face, in [0, 1]; `depth`: how deep below it its surface is, in [0, 1] cells; negative: no
/// front is visible there. An axis that shows both its faces has a sheet or a slab, and closes nothing.
fn opacity_of_faces(coverage: array<f32, 6>, depth: array<f32, 6>) -> array<f32, 6> {
    var out = coverage;
    var depths = depth;
    var shown_coverage = vec3<f32>(0.0);
    var shown_depth = vec3<f32>(-1.0);
    var shown = vec3<u32>(0u);
    for (var face = 0u; face < 6u; face++) {
        let axis = face >> 1u;
        if depths[face] >= 0.0 {
            shown_depth[axis] = select(-1.0, depths[face], shown_coverage[axis] == 0.0);
            shown_coverage[axis] = max(out[face], 1e-6);
            shown[axis] = face;
        }
    }
    let closed = corner_opacity(shown_coverage, shown_depth);
    for (var axis = 0u; axis < 3u; axis++) {
        if shown_depth[axis] >= 0.0 {
            out[shown[axis]] = closed[axis];
        }
    }
    return out;
}
