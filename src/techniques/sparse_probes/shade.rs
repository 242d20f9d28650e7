// SPDX-License-Identifier: MIT OR Apache-2.0
//! The kernel `sparse_probes/shade`: light of the picture's surfaces, from the lightmap.

use super::DebugView;
use crate::bindings::kernels::sparse_probes::shade as wgsl;
use crate::components::sparse_probes::SparseProbes;
use crate::frame::Pixels;
use crate::gpu::{ComputeKernel, Dispatch, Gpu, Recorder, SceneGroup, Shaders};

/// What a picture shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Shown {
    Light,
    Irradiance,
    Texels,
}

pub(super) const DEBUG_VIEWS: &[DebugView] = &[
    DebugView::new("irradiance", "indirect irradiance [W/m²], before the surface reflects it"),
    DebugView::new(
        "texels",
        "the place in the lightmap as red and green, and its texels as squares of blue; white where probes are read instead; all red where nothing is known",
    ),
];

impl Shown {
    pub fn of_name(name: &str) -> Option<Self> {
        Some(match name {
            "irradiance" => Self::Irradiance,
            "texels" => Self::Texels,
            _ => return None,
        })
    }
}

/// The compiled kernel.
#[derive(Debug)]
pub(super) struct ShadePass(ComputeKernel);

impl ShadePass {
    /// `shaders`: with the module that finds the pixels' surfaces.
    pub fn new(gpu: &Gpu, shaders: &Shaders, scene: &SceneGroup) -> Self {
        Self(ComputeKernel::new(gpu, shaders, Some(scene), "sparse_probes/shade"))
    }

    /// Records the look-ups of a picture into `target`, `rgba32float`.
    pub fn record(
        &self,
        recorder: &mut Recorder,
        (probes, scene): (&SparseProbes, &SceneGroup),
        pixels: &Pixels,
        shown: Shown,
        target: &wgpu::TextureView,
    ) {
        let info = wgsl::ShadeInfo {
            shown: match shown {
                Shown::Light => wgsl::SHOWN_LIGHT,
                Shown::Irradiance => wgsl::SHOWN_IRRADIANCE,
                Shown::Texels => wgsl::SHOWN_TEXELS,
            },
            scale: probes.scale(),
            radiance: probes.radiance(),
            reserved_a: 0,
        };
        self.0
            .call(&mut recorder.compute(self.0.name()))
            .scene(scene)
            .uniform("info", &info)
            .bind("indirect", target)
            .with(probes.bindings())
            .with(pixels.bindings())
            .dispatch(Dispatch::Area(pixels.size()));
    }
}
