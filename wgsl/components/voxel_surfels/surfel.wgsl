// SPDX-License-Identifier: MIT OR Apache-2.0
//! A surfel: the plane piece that stands for the surface which a voxel's face sees.
//!
//! A voxel alone says that there is a surface somewhere in its cell. With a plane for each of its faces, a ray meets the
//! surface where it is, from the side on which it is: a sheet or a thin slab has one surfel in front and another one behind,
//! and a wall at any angle is closed. A surfel is 16 bytes:
//!
//! | word | bits | what |
//! |---|---|---|
//! | x | 0–15, 16–31 | unit normal, `octahedral::pack_direction` |
//! | y | 0–15 | offset of the plane from the cell's centre along the normal, −OFFSET_RANGE to OFFSET_RANGE [cells] |
//! | y | 16–31 | opacity, unorm; 0: there is no surface |
//! | z | 0–9, 10–19, 20–29 | albedo red, green, blue, unorm (linear) |
//! | w | 0–31 | a border beyond which the surfel does not reach, or NO_BORDER (`lucerna::components::voxel_light::sides`) |
//!
//! Surface elements as such: H. Pfister et al., "Surfels: Surface Elements as Rendering Primitives", SIGGRAPH 2000.
//!
//! A ray *meets* a surfel where it goes from the front of its plane to the back. Planes of neighbouring cells do not fit
//! together where a surface bends, so on which side of a surface the ray is gets carried from cell to cell, as long as each
//! has a surfel that faces the ray: no ray gets through between two of them.
#define_import_path lucerna::components::voxel_surfels::surfel

#import lucerna::math::octahedral::{pack_direction, unpack_direction}

/// Offsets are within this [cells]; the corner of a cell is 0.87 from its centre.
const OFFSET_RANGE: f32 = 1.0;
const OFFSET_STEPS: f32 = 65535.0;

/// Nothing is known of the side.
const SIDE_UNKNOWN: u32 = 0u;
/// In front of the surface.
const SIDE_FRONT: u32 = 1u;
/// Behind it.
const SIDE_BACK: u32 = 2u;

/// Who comes from where there is no surface is in front of a surfel, unless farther behind its plane than this [cells].
const FRONT_SLACK: f32 = 0.05;
/// As FRONT_SLACK, near the start of a ray.
const START_SLACK: f32 = 0.005;
/// So far from the start of a ray a surfel is seen as from the start [cells].
const START_REACH: f32 = 2.0;
/// Who is behind a surface comes to the front of another one only this far before its plane [cells].
const BACK_SLACK: f32 = 0.3;
/// A surfel whose normal has this cosine or more to that of the surface where a ray starts (or of its back) may be the same
/// surface,
const SAME_SURFACE: f32 = 0.5;
/// if the start is this near to its plane [cells].
const SAME_FRONT: f32 = 0.25;
/// As SAME_FRONT, for the other side of a sheet or slab.
const SAME_BACK: f32 = 0.75;

/// A surfel.
struct Surfel {
    /// Unit length.
    normal: vec3<f32>,
    /// Of the plane from the cell's centre along the normal [cells].
    offset: f32,
    /// Linear, in [0, 1].
    albedo: vec3<f32>,
    /// Which share of the plane in the cell is surface, in [0, 1].
    opacity: f32,
    /// `lucerna::components::voxel_light::sides`.
    border: u32,
}

/// A surfel as words; see the table above.
fn pack_surfel(surfel: Surfel) -> vec4<u32> {
    let share = clamp(surfel.offset / OFFSET_RANGE * 0.5 + 0.5, 0.0, 1.0);
    let albedo = vec3<u32>(clamp(surfel.albedo, vec3<f32>(0.0), vec3<f32>(1.0)) * 1023.0 + 0.5);
    return vec4<u32>(
        pack_direction(surfel.normal),
        u32(round(share * OFFSET_STEPS)) | (u32(round(clamp(surfel.opacity, 0.0, 1.0) * 65535.0)) << 16u),
        albedo.x | (albedo.y << 10u) | (albedo.z << 20u),
        surfel.border,
    );
}

/// Inverse of [`pack_surfel`]: normals within 0.01°, offsets within 2e-5 cells, albedo within 1/2046.
fn unpack_surfel(words: vec4<u32>) -> Surfel {
    let albedo = (vec3<u32>(words.z) >> vec3<u32>(0u, 10u, 20u)) & vec3<u32>(0x3ffu);
    return Surfel(
        unpack_direction(words.x),
        (f32(words.y & 0xffffu) / OFFSET_STEPS * 2.0 - 1.0) * OFFSET_RANGE,
        vec3<f32>(albedo) / 1023.0,
        f32(words.y >> 16u) / 65535.0,
        words.w,
    );
}

/// Whether there is a surface.
fn surfel_is_seen(words: vec4<u32>) -> bool {
    return (words.y >> 16u) != 0u;
}

/// How high a point is in front of a surfel's plane [cells]. `point`: from the corner of the surfel's cell [cells].
fn height_over_surfel(surfel: Surfel, point: vec3<f32>) -> f32 {
    return dot(surfel.normal, point - 0.5) - surfel.offset;
}

/// On which side of a surfel within START_REACH that faces a ray the ray starts. `height`: that of its start over the plane
/// [cells]; `cosine`: between the surfel's normal and that of the surface where the ray starts; 0 if there is none.
fn side_at_start(height: f32, cosine: f32) -> u32 {
    let is_same_front = cosine >= SAME_SURFACE && abs(height) < SAME_FRONT;
    let is_same_back = cosine <= -SAME_SURFACE && abs(height) < SAME_BACK;
    let is_front = height >= -START_SLACK && !is_same_front && !is_same_back;
    return select(SIDE_BACK, SIDE_FRONT, is_front);
}

/// What happens to a ray in a surfel's cell.
struct Meeting {
    /// On which side of the surface it is afterwards: SIDE_FRONT or SIDE_BACK.
    side: u32,
    /// Where it meets the surface, from 0 (where it enters the cell) to 1 (where it leaves); −1: it does not.
    share: f32,
}

/// A ray through a cell with a surfel that faces it. `side`: a SIDE_ constant, from the cell before; `high`, `low`: its heights over the plane where it enters
/// and leaves the cell [cells], `low` ≤ `high`.
fn meet_surfel(side: u32, high: f32, low: f32) -> Meeting {
    let least = select(-FRONT_SLACK, BACK_SLACK, side == SIDE_BACK);
    if side != SIDE_FRONT && high < least {
        return Meeting(SIDE_BACK, -1.0);
    }
    if low >= 0.0 {
        return Meeting(SIDE_FRONT, -1.0);
    }
    return Meeting(SIDE_BACK, clamp(high / (high - low), 0.0, 1.0));
}
