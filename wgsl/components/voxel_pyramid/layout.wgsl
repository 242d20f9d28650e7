// SPDX-License-Identifier: MIT OR Apache-2.0
//! The layout of the voxels of all levels, mips and faces in three volumes of texels.
//!
//! A level is a grid of cubic cells around the eye (`lucerna::components::voxels::levels`); mip m of it has cells of
//! 2^m of the level's, ⌈size/2^m⌉ along each axis, the last one of 1 × 1 × 1. Outside the grid it is empty. Volume 0
//! holds all mips 0, volume 1 the odd mips, volume 2 the other even ones, so that no kernel writes the volume that it
//! reads.
//!
//! Within its volume a mip has `n_faces` blocks behind each other along z, each with a border of one
//! empty texel: trilinear filtering fades to nothing at the grid's border, and never mixes two blocks.
//!
//! A texel (`cone::medium`) of a face (+X −X +Y −Y +Z −Z) is what a viewer sees who looks at that face from outside;
//! with one face it is the same from all sides.
#define_import_path lucerna::components::voxel_pyramid::layout

/// The most levels.
const MAX_PYRAMID_LEVELS: u32 = 6u;
/// The most mips of a level, for 256 cells.
const MAX_MIPS: u32 = 9u;
const MAX_ENTRIES: u32 = 54u;
/// Number of a mip's cells over which a level fades into the next one at its border.
const FADE: f32 = 2.0;

/// A level's cells.
struct PyramidLevel {
    /// Minimum corner [m].
    origin: vec3<f32>,
    /// Edge of a cell [m].
    cell: f32,
    /// Cells along each axis.
    size: vec3<u32>,
    n_mips: u32,
}

/// A mip of a level, at level · MAX_MIPS + mip.
struct PyramidMip {
    /// Texel of cell (0, 0, 0) for face 0.
    first: vec3<u32>,
    /// Texels along z from one face to the next.
    stride: u32,
    /// Cells along each axis.
    size: vec3<u32>,
    reserved: u32,
}

struct PyramidLayout {
    levels: array<PyramidLevel, MAX_PYRAMID_LEVELS>,
    mips: array<PyramidMip, MAX_ENTRIES>,
    /// Texels of the three volumes.
    volume_base: vec3<u32>,
    n_levels: u32,
    volume_odd: vec3<u32>,
    /// 6, or 1: the same from all sides.
    n_faces: u32,
    volume_even: vec3<u32>,
    /// 1: faces are weighted by the squares of the direction's components, as in the source. 0: by their absolute
    /// values.
    squared_weights: u32,
    /// Bits of the largest irradiance in the pyramid [W·m⁻²]: texels hold light times its [`radiance_scale`]. 0: light
    /// is not scaled.
    peak: u32,
    reserved_a: u32,
    reserved_b: u32,
    reserved_c: u32,
}

/// The power of two by which light is scaled in 16-bit floats: the largest irradiance becomes 2¹³ to 2¹⁴ (so τ·L is
/// below 17 000), and light that is 2²⁷ times weaker keeps all digits. `peak`: the bits of a float ≥ 0.
fn radiance_scale(peak: u32) -> f32 {
    // 2^(13 − (e − 127)), e being the exponent's bits.
    let exponent = clamp(267 - i32(peak >> 23u), 1, 253);
    return select(bitcast<f32>(u32(exponent) << 23u), 1.0, peak == 0u);
}

/// Which volume holds a mip: 0, 1 or 2.
fn volume_of_mip(mip: u32) -> u32 {
    return select(2u - (mip & 1u), 0u, mip == 0u);
}

/// Texels of the three volumes along each axis.
struct VolumeSizes {
    base: vec3<u32>,
    odd: vec3<u32>,
    even: vec3<u32>,
}

/// The size of one of the volumes, 0, 1 or 2.
fn size_of_volume(sizes: VolumeSizes, volume: u32) -> vec3<u32> {
    if volume == 0u {
        return sizes.base;
    }
    return select(sizes.even, sizes.odd, volume == 1u);
}

/// Index of a texel in a buffer that holds volume 0, then 1, then 2, each with x fastest, then y, then z.
fn index_of_texel(sizes: VolumeSizes, volume: u32, place: vec3<u32>) -> u32 {
    let size = size_of_volume(sizes, volume);
    var first = 0u;
    if volume > 0u {
        first += sizes.base.x * sizes.base.y * sizes.base.z;
    }
    if volume > 1u {
        first += sizes.odd.x * sizes.odd.y * sizes.odd.z;
    }
    return first + (place.z * size.y + place.y) * size.x + place.x;
}

/// The texel of a cell's face. The cell may be outside the grid by one: there is the empty border.
fn texel_of_cell(entry: PyramidMip, face: u32, cell: vec3<i32>) -> vec3<u32> {
    return vec3<u32>(vec3<i32>(entry.first) + cell) + vec3<u32>(0u, 0u, face * entry.stride);
}

/// Position of a point in the texels of a face, for a filtered look-up. `point`: in cells of the mip. Beyond the
/// border's middle there is only the border.
fn texels_of_point(entry: PyramidMip, face: u32, point: vec3<f32>) -> vec3<f32> {
    let inside = clamp(point, vec3<f32>(-0.5), vec3<f32>(entry.size) + 0.5);
    return vec3<f32>(entry.first) + vec3<f32>(0.0, 0.0, f32(face * entry.stride)) + inside;
}

/// Weight of each axis's face for a direction of unit length. By projected area, |ω|, a plane across an axis hides as
/// much at any angle as head-on. (With squares, as in the source, it hides less at a slant, but an isotropic medium
/// stays isotropic.)
fn direction_weights(layout_squared: u32, direction: vec3<f32>) -> vec3<f32> {
    return select(abs(direction), direction * direction, layout_squared != 0u);
}

/// Weight of a level for cells of mip `mip` at a point in units of its cells: 1 inside, 0 from half a cell within its
/// border on.
fn pyramid_weight(level: PyramidLevel, mip: f32, point: vec3<f32>) -> f32 {
    let inside = min(point, vec3<f32>(level.size) - point);
    let least = min(inside.x, min(inside.y, inside.z)) * exp2(-mip);
    return clamp((least - 0.5) / FADE, 0.0, 1.0);
}
