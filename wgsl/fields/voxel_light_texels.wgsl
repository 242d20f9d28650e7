// SPDX-License-Identifier: MIT OR Apache-2.0
//! Field: light that voxels hold, face by face. This one keeps it for occupied voxels alone, in a buffer.
//!
//! Interface, which is all that `fields::voxel_light` asks: `levels`, `NO_VOXEL`, `voxel_of_cell`, `walls_of_voxel`, `light_of_face`. What
//! light it is, the host decides by the buffer that it binds as `face_light`.
#define_import_path lucerna::fields::voxel_light_texels

#import lucerna::components::voxels::bricks::NO_SLOT
#import lucerna::components::voxels::levels::{VoxelLevel, VoxelLevels}
#import lucerna::fields::voxel_structure::{slot_of_cell, wall_word_of_slot}

/// What [`voxel_of_cell`] says of a cell that holds no surface.
const NO_VOXEL: u32 = NO_SLOT;

@group(3) @binding(0) var<uniform> levels: VoxelLevels;
/// Of each level a record a face (slot · n_faces + face): rgb irradiance [W·m⁻²], a: how much of the
/// face a surface covers.
@group(3) @binding(2) var<storage, read> face_light: array<vec4<f32>>;

/// What a cell of a level is looked up by, or NO_VOXEL: here its slot. The cell may lie outside the level's grid.
fn voxel_of_cell(level: VoxelLevel, cell: vec3<i32>) -> u32 {
    return slot_of_cell(level, cell);
}

/// The walls of a voxel (`lucerna::components::voxel_light::wall_words`); none, 0, where there is no voxel, or one value a voxel.
fn walls_of_voxel(level: VoxelLevel, voxel: u32) -> u32 {
    if voxel == NO_VOXEL || level.grid.n_faces == 1u {
        return 0u;
    }
    return wall_word_of_slot(level, voxel);
}

/// What a voxel holds for a face, `face` < n_faces: rgb irradiance [W·m⁻²], a: how much of the face a surface covers, in [0, 1].
fn light_of_face(level: VoxelLevel, voxel: u32, face: u32) -> vec4<f32> {
    return face_light[level.first_record + voxel * level.grid.n_faces + face];
}
