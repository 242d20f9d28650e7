// SPDX-License-Identifier: MIT OR Apache-2.0
//! The kernel `voxel_rt/shade`: light of the picture's surfaces, looked up in the voxels.

use super::{DebugView, Lookup};
use crate::bindings::kernels::voxel_rt::shade as kernel;
use crate::bindings::lucerna::fields::voxel_light;
use crate::components::voxel_light::CacheBuffers;
use crate::frame::Pixels;
use crate::gpu::{ComputeKernel, Dispatch, Gpu, Recorder, SceneGroup, Shaders};

/// What a picture of the voxels shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shown {
    /// Reflected radiance \[W·sr⁻¹·m⁻²\].
    Light,
    /// Irradiance \[W·m⁻²\] before the surface reflects it.
    Irradiance,
    /// The cell of a surface point, as a colour.
    Cells,
    /// The level in which it is looked up, as a colour.
    Levels,
}

pub(super) const DEBUG_VIEWS: &[DebugView] = &[
    DebugView::new("irradiance", "indirect irradiance [W/m²], before the surface reflects it"),
    DebugView::new("cells", "voxels, each in its own colour"),
    DebugView::new(
        "levels",
        "nested grids, from the finest on: red, green, blue, yellow, magenta, cyan",
    ),
];

impl Shown {
    pub(super) fn of_name(name: &str) -> Option<Self> {
        Some(match name {
            "irradiance" => Self::Irradiance,
            "cells" => Self::Cells,
            "levels" => Self::Levels,
            _ => return None,
        })
    }
}

/// The compiled kernel.
#[derive(Debug)]
pub struct ShadePass(ComputeKernel);

impl ShadePass {
    /// Compiles the kernel. `shaders`: with the module that finds the pixels' surfaces; `scene`: needed if that module
    /// uses the scene.
    pub fn new(gpu: &Gpu, shaders: &Shaders, scene: Option<&SceneGroup>) -> Self {
        Self(ComputeKernel::new(gpu, shaders, scene, "voxel_rt/shade"))
    }

    /// Records the look-ups of a picture into `target`, `rgba32float`.
    pub fn record(
        &self,
        recorder: &mut Recorder,
        buffers: &CacheBuffers,
        pixels: &Pixels,
        lookup: Lookup,
        shown: Shown,
        target: &wgpu::TextureView,
    ) {
        let info = kernel::ShadeInfo {
            lookup: match lookup {
                Lookup::Valid => voxel_light::LOOKUP_VALID,
                Lookup::Trilinear => voxel_light::LOOKUP_TRILINEAR,
                Lookup::SevenTap => voxel_light::LOOKUP_SEVEN_TAP,
            },
            shown: match shown {
                Shown::Light => kernel::SHOWN_LIGHT,
                Shown::Irradiance => kernel::SHOWN_IRRADIANCE,
                Shown::Cells => kernel::SHOWN_CELLS,
                Shown::Levels => kernel::SHOWN_LEVELS,
            },
            reserved_a: 0,
            reserved_b: 0,
        };
        self.0
            .call(&mut recorder.compute(self.0.name()))
            .uniform("info", &info)
            .bind("indirect", target)
            .with(buffers.field(&buffers.shown))
            .with(pixels.bindings())
            .scene(pixels.scene())
            .dispatch(Dispatch::Area(pixels.size()));
    }
}
