// SPDX-License-Identifier: MIT OR Apache-2.0
//! Screen-space occlusion by what is close: the kernels `voxel_cone/occlusion` and `voxel_cone/occlusion_resolve`.

use super::settings::VoxelConeSettings;
use super::shade::specular_spread;
use crate::bindings::kernels::voxel_cone::occlusion as kernel;
use crate::bindings::kernels::voxel_cone::occlusion_resolve::ResolveInfo;
use crate::components::voxel_pyramid::Pyramid;
use crate::frame::Pixels;
use crate::gpu::{ComputeKernel, Dispatch, Gpu, Recorder, SceneGroup, Shaders, target};
use glam::UVec2;

/// The compiled kernels with their targets.
#[derive(Debug)]
pub(super) struct OcclusionPass {
    /// Openness of the hemisphere, at a quarter of the pixels.
    diffuse: Option<ComputeKernel>,
    /// Openness of the specular cone.
    specular: Option<ComputeKernel>,
    resolve: ComputeKernel,
    targets: Vec<Targets>,
}

/// The targets for pictures of one size.
#[derive(Clone, Debug)]
struct Targets {
    size: UVec2,
    quarter: wgpu::TextureView,
    full: wgpu::TextureView,
    resolved: wgpu::TextureView,
}

/// Number of picture sizes whose targets are kept, because several views may take turns.
const KEPT: usize = 4;

impl OcclusionPass {
    /// None if neither occlusion is enabled. `shaders`, `scene`: as for [`super::shade::ShadePass::new`].
    pub fn new(
        gpu: &Gpu,
        shaders: &Shaders,
        scene: Option<&SceneGroup>,
        settings: &VoxelConeSettings,
    ) -> Option<Self> {
        if !settings.occludes_diffuse && !settings.occludes_specular {
            return None;
        }
        let of_entry = |entry| {
            let name = "voxel_cone/occlusion";
            ComputeKernel::with_entry(gpu, shaders, scene, name, Some(entry), &[])
        };
        Some(Self {
            diffuse: settings.occludes_diffuse.then(|| of_entry(kernel::ENTRY_DIFFUSE)),
            specular: settings.occludes_specular.then(|| of_entry(kernel::ENTRY_SPECULAR)),
            resolve: ComputeKernel::new(gpu, shaders, scene, "voxel_cone/occlusion_resolve"),
            targets: Vec::new(),
        })
    }

    /// Records all passes and returns the texture of openness: r for the hemisphere, g for the specular cone.
    pub fn record(
        &mut self,
        recorder: &mut Recorder,
        pyramid: &Pyramid,
        settings: &VoxelConeSettings,
        pixels: &Pixels,
    ) -> wgpu::TextureView {
        let size = pixels.size();
        let targets = self.targets(recorder.gpu(), size);
        let info = kernel::OcclusionInfo {
            start_cells: settings.stepping.start_cells,
            specular_spread: specular_spread(settings.specular),
            reserved_a: 0,
            reserved_b: 0,
        };
        let passes = [
            (&self.diffuse, &targets.quarter, "voxel_cone/occlusion_diffuse", (size + 1) / 2),
            (&self.specular, &targets.full, "voxel_cone/occlusion_specular", size),
        ];
        for (kernel, open, label, size) in passes {
            let Some(kernel) = kernel else { continue };
            kernel
                .call(&mut recorder.compute(label))
                .uniform("info", &info)
                .bind("open", open)
                .bind("pyramid", pyramid.uniform())
                .with(pixels.bindings())
                .scene(pixels.scene())
                .dispatch(Dispatch::Area(size));
        }
        let info = ResolveInfo {
            has_diffuse: u32::from(settings.occludes_diffuse),
            has_specular: u32::from(settings.occludes_specular),
            reserved_a: 0,
            reserved_b: 0,
        };
        self.resolve
            .call(&mut recorder.compute(self.resolve.name()))
            .uniform("info", &info)
            .bind("diffuse_open", &targets.quarter)
            .bind("specular_open", &targets.full)
            .bind("occlusion", &targets.resolved)
            .with(pixels.bindings())
            .scene(pixels.scene())
            .dispatch(Dispatch::Area(size));
        targets.resolved
    }

    fn targets(&mut self, gpu: &Gpu, size: UVec2) -> Targets {
        if let Some(known) = self.targets.iter().find(|targets| targets.size == size) {
            return known.clone();
        }
        let make = |size| target(gpu, "occlusion", size, wgpu::TextureFormat::Rgba8Unorm);
        // A pass that does not run has a target of one texel.
        let of = |kernel: &Option<_>, size| if kernel.is_some() { size } else { UVec2::ONE };
        let made = Targets {
            size,
            quarter: make(of(&self.diffuse, (size + 1) / 2)),
            full: make(of(&self.specular, size)),
            resolved: make(size),
        };
        if self.targets.len() == KEPT {
            self.targets.remove(0);
        }
        self.targets.push(made.clone());
        made
    }
}
