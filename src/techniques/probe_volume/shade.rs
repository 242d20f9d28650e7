// SPDX-License-Identifier: MIT OR Apache-2.0
//! The kernel `probe_volume/shade`: light of the picture's surfaces, looked up in probes.

use super::DebugView;
use crate::bindings::kernels::probe_volume::shade as kernel;
use crate::components::probes::{ProbeBasis, Probes};
use crate::frame::Pixels;
use crate::gpu::{ComputeKernel, Dispatch, Gpu, Recorder, SceneGroup, Shaders};

/// What a picture of the probes shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Shown {
    Light,
    Irradiance,
    Weight,
}

pub(super) const DEBUG_VIEWS: &[DebugView] = &[
    DebugView::new("irradiance", "indirect irradiance [W/m²], before the surface reflects it"),
    DebugView::new(
        "weight",
        "sum of the weights of the probes that a surface finds: 0 where none sees it",
    ),
];

impl Shown {
    pub fn of_name(name: &str) -> Option<Self> {
        Some(match name {
            "irradiance" => Self::Irradiance,
            "weight" => Self::Weight,
            _ => return None,
        })
    }
}

/// The compiled kernel.
#[derive(Debug)]
pub(super) struct ShadePass(ComputeKernel);

impl ShadePass {
    /// `shaders`: with the module that finds the pixels' surfaces; `scene`: needed if that module uses the scene.
    pub fn new(
        gpu: &Gpu,
        shaders: &Shaders,
        scene: Option<&SceneGroup>,
        basis: ProbeBasis,
    ) -> Self {
        let shaders = shaders.with_variant(basis.of(shaders.variant()));
        Self(ComputeKernel::new(gpu, &shaders, scene, "probe_volume/shade"))
    }

    /// Records the look-ups of a picture into `target`, `rgba32float`.
    pub fn record(
        &self,
        recorder: &mut Recorder,
        probes: &Probes,
        pixels: &Pixels,
        shown: Shown,
        target: &wgpu::TextureView,
    ) {
        let info = kernel::ShadeInfo {
            shown: match shown {
                Shown::Light => kernel::SHOWN_LIGHT,
                Shown::Irradiance => kernel::SHOWN_IRRADIANCE,
                Shown::Weight => kernel::SHOWN_WEIGHT,
            },
            reserved_a: 0,
            reserved_b: 0,
            reserved_c: 0,
        };
        self.0
            .call(&mut recorder.compute(self.0.name()))
            .uniform("info", &info)
            .bind("indirect", target)
            .with(probes.field())
            .with(pixels.bindings())
            .scene(pixels.scene())
            .dispatch(Dispatch::Area(pixels.size()));
    }
}
