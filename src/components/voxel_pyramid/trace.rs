// SPDX-License-Identifier: MIT OR Apache-2.0
//! The kernel `voxel_pyramid/trace`: a list of cones.

use super::pyramid::Pyramid;
use super::settings::ConeStepping;
use crate::bindings::kernels::voxel_pyramid::trace::TraceInfo;
use crate::gpu::{ComputeKernel, Dispatch, Gpu, Recorder};

pub use crate::bindings::lucerna::cone::march::Cone;
pub use crate::bindings::lucerna::fields::cone_trace::ConeResult;

/// The compiled kernel.
#[derive(Debug)]
pub struct TracePass(ComputeKernel);

impl TracePass {
    /// Compiles the kernel.
    pub fn new(gpu: &Gpu, pyramid: &Pyramid) -> Self {
        Self(ComputeKernel::new(gpu, &pyramid.shaders(), None, "voxel_pyramid/trace"))
    }

    /// Records `n` cones: `cones` is `array<Cone>`, `results` `array<ConeResult>`, both at least so long.
    ///
    /// `near` \[m\]: how far [`ConeResult`]'s `near_transmittance` counts.
    #[expect(clippy::too_many_arguments, reason = "a pass names everything that it reads")]
    pub fn record(
        &self,
        recorder: &mut Recorder,
        pyramid: &Pyramid,
        cones: &wgpu::Buffer,
        results: &wgpu::Buffer,
        n: u32,
        stepping: ConeStepping,
        near: f32,
    ) {
        let cones_of = stepping.into();
        let info = TraceInfo { cones: cones_of, near, n_cones: n, reserved_a: 0, reserved_b: 0 };
        self.0
            .call(&mut recorder.compute(self.0.name()))
            .uniform("info", &info)
            .bind("cones", cones)
            .bind("results", results)
            .with(pyramid.field())
            .dispatch(Dispatch::Items(n));
    }
}
