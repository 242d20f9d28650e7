// SPDX-License-Identifier: MIT OR Apache-2.0
//! A technique from another crate: uniform ambient light, with occlusion by rays. It has a kernel, settings and a debug
//! view, and takes part in lucerna's frames like any other technique.
//!
//! `cargo run --example own_technique [OUT.png [NAME=VALUE …]]`; the file is `own_technique.png` in the system's folder
//! of temporary files by default. Settings: `radiance`, `distance`, `rays`.

use glam::UVec2;
use lucerna::blocking::{FramesToRender, open, read_film, render_frames};
use lucerna::components::voxel_light::Eye;
use lucerna::frame::Pixels;
use lucerna::gpu::{AdapterChoice, ComputeKernel, Dispatch, Gpu, Recorder, SceneGroup, Shaders};
use lucerna::gpu_scene::{GpuScene, GpuSceneOptions};
use lucerna::picture::PngOptions;
use lucerna::scene::{LoadLimits, Scene};
use lucerna::seam::{SceneSeam, check_shaders};
use lucerna::shader::Source;
use lucerna::techniques::reference::{Channel, resolve};
use lucerna::techniques::{
    DebugView, Setting, SettingKind, SettingValue, Settings, Technique, TechniqueError,
};
use std::path::{Path, PathBuf};

/// The settings of the technique.
#[derive(Clone, Copy, Debug)]
pub struct AmbientSettings {
    pub radiance: f32,
    pub distance: f32,
    pub n_rays: u32,
}

impl Default for AmbientSettings {
    fn default() -> Self {
        Self { radiance: 0.2, distance: 1.0, n_rays: 2 }
    }
}

impl Settings for AmbientSettings {
    const LIST: &'static [Setting] = &[
        Setting::new(
            "radiance",
            "W·sr⁻¹·m⁻²",
            SettingKind::number(0.0, 1e6),
            "Light from all sides",
        ),
        Setting::new(
            "distance",
            "m",
            SettingKind::number(1e-3, 1e6),
            "Greatest distance of what blocks light",
        ),
        Setting::new("rays", "rays", SettingKind::integer(1, 64), "Rays per pixel and frame"),
    ];

    fn get(&self, ix: usize) -> SettingValue {
        match ix {
            0 => SettingValue::Number(self.radiance),
            1 => SettingValue::Number(self.distance),
            _ => SettingValue::Integer(self.n_rays),
        }
    }

    fn set(&mut self, ix: usize, value: SettingValue) {
        match (ix, value) {
            (0, SettingValue::Number(x)) => self.radiance = x,
            (1, SettingValue::Number(x)) => self.distance = x,
            (2, SettingValue::Integer(n)) => self.n_rays = n,
            _ => {}
        }
    }
}

/// The uniform of the kernel.
#[derive(Clone, Copy, bytemuck::NoUninit)]
#[repr(C)]
struct Uniform {
    radiance: f32,
    distance: f32,
    n_rays: u32,
    shows_openness: u32,
}

const DEBUG_VIEWS: &[DebugView] =
    &[DebugView::new("openness", "the share of rays that nothing blocks")];

/// The technique.
pub struct Ambient {
    settings: AmbientSettings,
    shaders: Shaders,
    kernel: ComputeKernel,
    /// The scene of this frame; only its handles are held.
    scene: SceneGroup,
}

impl Ambient {
    pub fn new(
        gpu: &Gpu,
        scene: &dyn SceneSeam,
        settings: AmbientSettings,
    ) -> Result<Self, TechniqueError> {
        settings.check()?;
        // An import path with this prefix makes it a kernel, whose name is the rest.
        let shaders = scene.shaders().with_module(Source {
            import_path: "lucerna::kernels::own::ambient".into(),
            file: "own_technique/ambient.wgsl".into(),
            text: include_str!("ambient.wgsl").into(),
        });
        let kernel = ComputeKernel::new(gpu, &shaders, Some(scene.group()), "own/ambient");
        let (shaders, scene) = (scene.shaders().clone(), scene.group().clone());
        Ok(Self { settings, shaders, kernel, scene })
    }

    fn record(
        &self,
        recorder: &mut Recorder,
        pixels: &Pixels,
        target: &wgpu::TextureView,
        shows_openness: bool,
    ) -> Result<(), TechniqueError> {
        pixels.check_target("target", target)?;
        let AmbientSettings { radiance, distance, n_rays } = self.settings;
        let shows_openness = u32::from(shows_openness);
        self.kernel
            .call(&mut recorder.compute(self.kernel.name()))
            .scene(&self.scene)
            .uniform("ambient", &Uniform { radiance, distance, n_rays, shows_openness })
            .bind("indirect", target)
            .with(pixels.bindings())
            .dispatch(Dispatch::Area(pixels.size()));
        Ok(())
    }
}

impl Technique for Ambient {
    fn name(&self) -> &'static str {
        "ambient"
    }

    fn update(
        &mut self,
        _recorder: &mut Recorder,
        scene: &dyn SceneSeam,
        _eye: &Eye,
    ) -> Result<(), TechniqueError> {
        check_shaders(&self.shaders, scene)?;
        self.scene = scene.group().clone();
        Ok(())
    }

    fn shade(
        &mut self,
        recorder: &mut Recorder,
        pixels: &Pixels,
        target: &wgpu::TextureView,
    ) -> Result<(), TechniqueError> {
        self.record(recorder, pixels, target, false)
    }

    fn debug_views(&self) -> &'static [DebugView] {
        DEBUG_VIEWS
    }

    fn shade_debug_view(
        &mut self,
        recorder: &mut Recorder,
        pixels: &Pixels,
        target: &wgpu::TextureView,
        name: &str,
    ) -> Result<(), TechniqueError> {
        if name != "openness" {
            return Err(TechniqueError::NoDebugView(name.into()));
        }
        self.record(recorder, pixels, target, true)
    }

    fn settings(&self) -> Vec<(Setting, SettingValue)> {
        self.settings.described()
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let output = arguments
        .next()
        .map_or_else(|| std::env::temp_dir().join("own_technique.png"), PathBuf::from);
    let mut ambient = AmbientSettings::default();
    for argument in arguments {
        let (name, value) = argument.split_once('=').ok_or("settings are given as NAME=VALUE")?;
        ambient.set_by_name(name, value)?;
    }

    let file = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("fixtures/scenes/cornell_original/cornell_original.gltf");
    let loaded = Scene::load(&file, &LoadLimits::default())?.scene;
    let camera = loaded.cameras.first().ok_or("the file has no camera")?;
    let (gpu, info) = open(&AdapterChoice::Auto)?;
    eprintln!("adapter: {}", info.name);
    let scene = GpuScene::new(&gpu, &loaded, GpuSceneOptions::default())?;
    let mut technique = Ambient::new(&gpu, &scene, ambient)?;
    for (setting, value) in technique.settings() {
        println!("{} = {value} {}", setting.name, setting.unit);
    }

    let size = UVec2::new(128, 128);
    let what = FramesToRender::new(size, 32);
    let (passes, _) = render_frames(&gpu, &scene, camera, &what, &mut technique, |_| true)?;
    let picture = resolve(&read_film(&gpu, passes.accumulator.film())?, size, Channel::Beauty);
    picture.write(&output, &PngOptions::default())?;
    println!("{}", output.display());
    Ok(())
}
