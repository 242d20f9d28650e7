// SPDX-License-Identifier: MIT OR Apache-2.0
//! The kernel `voxel_pyramid/trace`: traces a list of cones.

use super::pyramid::Pyramid;
use super::settings::ConeStepping;
use crate::bindings::kernels::voxel_pyramid::trace::TraceInfo;
use crate::gpu::{Bindings, ComputeKernel, Dispatch, Gpu, Recorder, Shaders};
use crate::shader::{SURFEL_CONES, Variant};

pub use crate::bindings::lucerna::cone::march::Cone;
pub use crate::bindings::lucerna::fields::cone_trace::ConeResult;

/// The compiled kernel.
#[derive(Debug)]
pub struct TracePass(ComputeKernel);

impl TracePass {
    /// Compiles the kernel, for cones from surfel to surfel
    /// ([`Surfels::field`](crate::components::voxel_surfels::Surfels::field)).
    pub fn of_surfels(gpu: &Gpu) -> Self {
        let shaders = Shaders::new(Variant::BASELINE.with(SURFEL_CONES));
        Self(ComputeKernel::new(gpu, &shaders, None, "voxel_pyramid/trace"))
    }

    /// Compiles the kernel, for cones through prefiltered voxels ([`Pyramid::field`]).
    pub fn new(gpu: &Gpu, pyramid: &Pyramid) -> Self {
        Self(ComputeKernel::new(gpu, &pyramid.shaders(), None, "voxel_pyramid/trace"))
    }

    /// Records tracing `n` cones through what `field` binds: `cones` is an `array<Cone>`, `results` an `array<ConeResult>`, both of at least `n`
    /// elements.
    ///
    /// `near` \[m\]: the distance up to which `near_transmittance` of [`ConeResult`] counts.
    #[expect(clippy::too_many_arguments, reason = "a pass names everything that it reads")]
    pub fn record(
        &self,
        recorder: &mut Recorder,
        field: Bindings,
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
            .with(field)
            .dispatch(Dispatch::Items(n));
    }
}
