// SPDX-License-Identifier: MIT OR Apache-2.0
//! Field: light that voxels hold, face by face. This one stores it only for occupied voxels, in a buffer.
//!
//! Interface, which is all that `fields::voxel_light` asks: `levels`, `NO_VOXEL`, `voxel_of_cell`, `walls_of_voxel`,
//! `light_of_face`. The buffer that the host binds as `face_light` decides which light it is.
#define_import_path lucerna::fields::voxel_light_texels

#import lucerna::components::voxels::bricks::NO_SLOT
#import lucerna::components::voxels::levels::{VoxelLevel, VoxelLevels}
#import lucerna::fields::voxel_structure::{slot_of_cell, wall_word_of_slot}

/// What [`voxel_of_cell`] returns for a cell without a surface.
const NO_VOXEL: u32 = NO_SLOT;

@group(3) @binding(0) var<uniform> levels: VoxelLevels;
/// For each level one record per face (slot · n_faces + face): rgb irradiance [W·m⁻²], a: how much of the face a
/// surface covers.
@group(3) @binding(2) var<storage, read> face_light: array<vec4<f32>>;

/// The key by which a cell of a level is looked up, here its slot, or NO_VOXEL. The cell may be outside the level's
/// grid.
fn voxel_of_cell(level: VoxelLevel, cell: vec3<i32>) -> u32 {
    return slot_of_cell(level, cell);
}

/// The walls of a voxel (`lucerna::components::voxel_light::wall_words`); none, 0, if there is no voxel, or one value
/// per voxel.
fn walls_of_voxel(level: VoxelLevel, voxel: u32) -> u32 {
    if voxel == NO_VOXEL || level.grid.n_faces == 1u {
        return 0u;
    }
    return wall_word_of_slot(level, voxel);
}

/// The value of a voxel's face, `face` < n_faces: rgb irradiance [W·m⁻²], a: how much of the face a surface covers, in
/// [0, 1].
fn light_of_face(level: VoxelLevel, voxel: u32, face: u32) -> vec4<f32> {
    return face_light[level.first_record + voxel * level.grid.n_faces + face];
}
