// SPDX-License-Identifier: MIT OR Apache-2.0
//! The kernel `voxel_light/gather`: updates the irradiance of one level's faces.

use super::cache::CacheBuffers;
use crate::components::LightVisibility;
use crate::gpu::{ComputeKernel, ComputeRecorder, Dispatch, Gpu};
use crate::seam::SceneSeam;

pub use crate::bindings::kernels::voxel_light::gather::GatherInfo;

/// The compiled kernel.
#[derive(Debug)]
pub struct GatherPass {
    kernel: ComputeKernel,
    visibility: LightVisibility,
}

impl GatherPass {
    /// Compiles the kernel for the scene's variant. `visibility`: how points find out which lights they see.
    pub fn new(gpu: &Gpu, scene: &dyn SceneSeam, visibility: &LightVisibility) -> Self {
        let variant = visibility.variant(scene.shaders().variant());
        let shaders = scene.shaders().with_variant(variant);
        Self {
            kernel: ComputeKernel::new(gpu, &shaders, Some(scene.group()), "voxel_light/gather"),
            visibility: visibility.clone(),
        }
    }

    /// Updates level `info.level`. `records`: one invocation per record. `scene`: must have the variant that the kernel
    /// was compiled for.
    pub fn record(
        &self,
        pass: &mut ComputeRecorder,
        scene: &dyn SceneSeam,
        buffers: &CacheBuffers,
        info: &GatherInfo,
        records: Dispatch,
    ) {
        self.kernel
            .call(pass)
            .scene(scene.group())
            .uniform("info", info)
            .with(buffers.of_level(info.level))
            .with(buffers.field(&buffers.reflected))
            .with(self.visibility.bindings())
            .dispatch(records);
    }
}
