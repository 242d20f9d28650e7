// SPDX-License-Identifier: MIT OR Apache-2.0
//! How many voxels a grid has, and the dispatches that cover them.
#define_import_path lucerna::components::voxels::counts

/// Kept on the GPU; 48 bytes. The two dispatches are for workgroups of 64, laid out as
/// `lucerna::math::dispatch` says.
struct VoxelCounts {
    /// Voxels that have a slot.
    n_voxels: u32,
    /// Occupied cells for which there was no room; they are not in the structure.
    n_overflow: u32,
    /// n_voxels · n_faces; where records are divided (`lucerna::components::voxel_light::sides`), the second ones as well.
    n_records: u32,
    /// Faces that should have a second record, for which there was no room.
    n_undivided: u32,
    /// Dispatch of one invocation per voxel. At byte 16.
    voxel_groups: vec3<u32>,
    reserved_b: u32,
    /// Dispatch of one invocation per record (voxel and face). At byte 32.
    record_groups: vec3<u32>,
    reserved_c: u32,
}

/// Invocations per workgroup of the two dispatches.
const COUNTED_WORKGROUP: u32 = 64u;
