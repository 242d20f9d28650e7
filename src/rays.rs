// SPDX-License-Identifier: MIT OR Apache-2.0
//! Traces many rays at once through a scene: the kernels `rays/nearest_hit` and `rays/any_hit`.

use crate::bindings::kernels::rays::{any_hit, nearest_hit};
use crate::gpu::{ComputeKernel, Dispatch, Gpu, Recorder, Shaders};
use crate::seam::{Mismatch, SceneSeam, check_shaders};
use glam::UVec3;

pub use crate::bindings::lucerna::scene::types::NONE;
pub use crate::bindings::lucerna::scene::types::{Hit, Ray};
pub use any_hit::ANY_HIT_UNKNOWN;
pub use nearest_hit::NEAREST_HIT_UNKNOWN;

/// What to find out about each ray.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RayQuestion {
    /// The nearest hit. Answers are [`Hit`]s; `triangle` is [`NONE`] for a miss, and [`NEAREST_HIT_UNKNOWN`] if the
    /// driver ended the ray's loops early.
    Nearest,
    /// Whether the ray hits anything. Answers are u32: 1, 0, or [`ANY_HIT_UNKNOWN`].
    Any,
}

/// A compiled ray kernel.
#[derive(Debug)]
pub struct RayKernel {
    kernel: ComputeKernel,
    question: RayQuestion,
    shaders: Shaders,
}

impl RayKernel {
    /// Compiles the kernel for the scene's variant; it works for every scene of the same variant.
    pub fn new(gpu: &Gpu, scene: &dyn SceneSeam, question: RayQuestion) -> Self {
        let name = match question {
            RayQuestion::Nearest => "rays/nearest_hit",
            RayQuestion::Any => "rays/any_hit",
        };
        let kernel = ComputeKernel::new(gpu, scene.shaders(), Some(scene.group()), name);
        Self { kernel, question, shaders: scene.shaders().clone() }
    }

    /// Records the rays, in as many dispatches as WebGPU's limit on workgroups requires.
    ///
    /// `rays`: `n_rays` [`Ray`]s; `answers`: the same number of [`Hit`]s or u32. Both are storage buffers.
    ///
    /// # Errors
    /// The scene differs from the one that the kernel was compiled for.
    pub fn record(
        &self,
        recorder: &mut Recorder,
        scene: &dyn SceneSeam,
        rays: &wgpu::Buffer,
        answers: &wgpu::Buffer,
        n_rays: u32,
    ) -> Result<(), Mismatch> {
        check_shaders(&self.shaders, scene)?;
        let (group, hits) = match self.question {
            RayQuestion::Nearest => (nearest_hit::WORKGROUP, "hits"),
            RayQuestion::Any => (any_hit::WORKGROUP, "blocked"),
        };
        let limit = recorder.gpu().device.limits().max_compute_workgroups_per_dimension;
        let per_dispatch = group * limit;
        let pass = &mut recorder.compute(self.kernel.name());
        for first in (0..n_rays).step_by(per_dispatch as usize) {
            let n_groups = (n_rays - first).min(per_dispatch).div_ceil(group);
            self.kernel
                .call(pass)
                .scene(scene.group())
                // Both kernels have the same batches.
                .uniform("batch", &nearest_hit::BatchInfo { n_rays, first })
                .bind("rays", rays)
                .bind(hits, answers)
                .dispatch(Dispatch::Groups(UVec3::new(n_groups, 1, 1)));
        }
        Ok(())
    }
}
