// SPDX-License-Identifier: MIT OR Apache-2.0
//! The kernels `probe_volume/shade` and `spheres`: light of the picture's surfaces, looked up in probes, and the probes.

use super::DebugView;
use crate::bindings::kernels::probe_volume::shade as wgsl;
use crate::components::probes::Probes;
use crate::frame::Pixels;
use crate::gpu::{ComputeKernel, Dispatch, Gpu, Recorder, SceneGroup, Shaders};

/// What a picture of the probes shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Shown {
    Light,
    Irradiance,
    Weight,
    Spheres,
}

pub(super) const DEBUG_VIEWS: &[DebugView] = &[
    DebugView::new("irradiance", "indirect irradiance [W/m²], before the surface reflects it"),
    DebugView::new(
        "weight",
        "sum of the weights of the probes that a surface finds: 0 where none sees it",
    ),
    DebugView::new(
        "probes",
        "the probes as white spheres in their own light; those inside something have red stripes",
    ),
];

impl Shown {
    pub fn of_name(name: &str) -> Option<Self> {
        Some(match name {
            "irradiance" => Self::Irradiance,
            "weight" => Self::Weight,
            "probes" => Self::Spheres,
            _ => return None,
        })
    }
}

/// The compiled kernels.
#[derive(Debug)]
pub(super) struct ShadePass {
    shade: ComputeKernel,
    spheres: ComputeKernel,
}

impl ShadePass {
    /// `shaders`: with the module that finds the pixels' surfaces; `scene`: needed if that module uses the scene.
    pub fn new(gpu: &Gpu, shaders: &Shaders, scene: Option<&SceneGroup>, probes: &Probes) -> Self {
        let shaders = shaders.with_variant(probes.variant(shaders.variant()));
        Self {
            shade: ComputeKernel::new(gpu, &shaders, scene, "probe_volume/shade"),
            spheres: ComputeKernel::new(gpu, &shaders, scene, "probe_volume/spheres"),
        }
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
        let shown = match shown {
            Shown::Light => Some(wgsl::SHOWN_LIGHT),
            Shown::Irradiance => Some(wgsl::SHOWN_IRRADIANCE),
            Shown::Weight => Some(wgsl::SHOWN_WEIGHT),
            Shown::Spheres => None,
        };
        let kernel = if shown.is_some() { &self.shade } else { &self.spheres };
        let info = wgsl::ShadeInfo {
            shown: shown.unwrap_or(wgsl::SHOWN_LIGHT),
            reserved_a: 0,
            reserved_b: 0,
            reserved_c: 0,
        };
        let pass = &mut recorder.compute(kernel.name());
        let mut call = kernel.call(pass);
        if shown.is_some() {
            call = call.uniform("info", &info);
        }
        call.bind("indirect", target)
            .with(probes.field())
            .with(pixels.bindings())
            .scene(pixels.scene())
            .dispatch(Dispatch::Area(pixels.size()));
    }
}
