// SPDX-License-Identifier: MIT OR Apache-2.0
//! The kernels `voxel_light/sides` and `voxel_light/reach`: which records are on the same side of the surfaces around them.

use super::cache::CacheBuffers;
use crate::bindings::kernels::voxel_light::{reach, sides};
use crate::gpu::{ComputeKernel, ComputeRecorder, Dispatch, Gpu};
use crate::seam::SceneSeam;
use glam::UVec3;

/// The compiled kernels.
#[derive(Debug)]
pub struct SidesPass {
    places: ComputeKernel,
    count: ComputeKernel,
    reach: ComputeKernel,
    divides: bool,
}

impl SidesPass {
    /// Compiles the kernels for the scene's variant. `divides`: whether faces get second records where a wall stands across
    /// what they see.
    pub fn new(gpu: &Gpu, scene: &dyn SceneSeam, divides: bool) -> Self {
        let kernel = |name, entry| {
            let (shaders, group) = (scene.shaders(), Some(scene.group()));
            ComputeKernel::with_entry(gpu, shaders, group, name, Some(entry), &[])
        };
        Self {
            places: kernel("voxel_light/sides", sides::ENTRY_FIND_PLACES),
            count: kernel("voxel_light/sides", sides::ENTRY_COUNT_RECORDS),
            reach: kernel("voxel_light/reach", reach::ENTRY_MAIN),
            divides,
        }
    }

    /// Finds the sides of a level's records, after its structure was made, and adds second records. `first`: one invocation
    /// per face's first record. `scene`: must have the variant that the kernels were compiled for.
    pub fn record(
        &self,
        pass: &mut ComputeRecorder,
        scene: &dyn SceneSeam,
        buffers: &CacheBuffers,
        level: u32,
        first: Dispatch,
    ) {
        let bindings = || buffers.of_level(level);
        let divides = u32::from(self.divides);
        let info = sides::SidesInfo { level, divides, reserved_a: 0, reserved_b: 0 };
        for (kernel, items) in [(&self.places, first), (&self.count, Dispatch::Groups(UVec3::ONE))]
        {
            let call = kernel.call(pass).scene(scene.group());
            call.uniform("info", &info).with(bindings()).dispatch(items);
        }
        let info = reach::ReachInfo { level, reserved_a: 0, reserved_b: 0, reserved_c: 0 };
        let call = self.reach.call(pass).scene(scene.group());
        call.uniform("info", &info).with(bindings()).dispatch(buffers.records(level));
    }
}
