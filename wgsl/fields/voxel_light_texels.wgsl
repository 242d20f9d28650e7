// SPDX-License-Identifier: MIT OR Apache-2.0
//! Field: light that voxels hold, face by face. This one stores it only for occupied voxels, in a buffer.
//!
//! Interface, which is all that `fields::voxel_light` asks: `levels`, `NO_VOXEL`, `voxel_of_cell`, `reach_of_face`,
//! `light_of_face`. The buffer that the host binds as `face_light` decides which light it is.
#define_import_path lucerna::fields::voxel_light_texels

#import lucerna::components::voxels::bricks::NO_SLOT
#import lucerna::components::voxels::levels::{VoxelLevel, VoxelLevels}
#import lucerna::fields::voxel_structure::{record_for_point, side_of_record, slot_of_cell}

/// What [`voxel_of_cell`] returns for a cell without a surface.
const NO_VOXEL: u32 = NO_SLOT;

@group(3) @binding(0) var<uniform> levels: VoxelLevels;
/// For each level one record per face (slot · n_faces + face): rgb irradiance [W·m⁻²], a: how much of the face a
/// surface covers; below 0 if the face has a second record.
@group(3) @binding(2) var<storage, read> face_light: array<vec4<f32>>;

/// The key by which a cell of a level is looked up, here its slot, or NO_VOXEL. The cell may be outside the level's
/// grid.
fn voxel_of_cell(level: VoxelLevel, cell: vec3<i32>) -> u32 {
    return slot_of_cell(level, cell);
}

/// Which records of the same face around a voxel are on a point's side (`lucerna::components::voxel_light::sides`); 0 if
/// nothing is known, which is so for grids with one value per voxel. `point`: from the corner of the voxel's cell
/// [cells].
fn reach_of_face(level: VoxelLevel, voxel: u32, face: u32, point: vec3<f32>) -> u32 {
    if voxel == NO_VOXEL || level.grid.n_faces == 1u {
        return 0u;
    }
    return side_of_record(level, record_for_point(level, voxel * level.grid.n_faces + face, point)).reach;
}

/// The value of a voxel's face, `face` < n_faces, for a point (from the corner of the voxel's cell [cells]; it may be
/// outside): rgb irradiance [W·m⁻²], a: how much of the face a surface covers, in [0, 1].
fn light_of_face(level: VoxelLevel, voxel: u32, face: u32, point: vec3<f32>) -> vec4<f32> {
    let record = voxel * level.grid.n_faces + face;
    var light = face_light[level.first_record + record];
    if light.a < 0.0 {
        light = face_light[level.first_record + record_for_point(level, record, point)];
    }
    return vec4<f32>(light.rgb, abs(light.a));
}
