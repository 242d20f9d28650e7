// SPDX-License-Identifier: MIT OR Apache-2.0
//! `voxel-rt` in a renderer that has its own device, camera matrices and G-buffer of three targets.
//!
//! `renderer.rs` is the renderer, which does not use lucerna. This file and `pixel.wgsl` add indirect light.
//!
//! `cargo run --example own_gbuffer [OUT.png]`; the file is `own_gbuffer.png` in the system's folder of temporary files
//! by default.

pub mod renderer;

use glam::{UVec2, Vec3};
use lucerna::blocking::read_film;
use lucerna::components::LightVisibility;
use lucerna::components::voxel_light::Eye;
use lucerna::frame::{Accumulator, CompositePass, DirectPass, DirectSettings};
use lucerna::frame::{PixelSurfaces, Pixels, View, ViewSettings};
use lucerna::gpu::{Bindings, Gpu, Recorder, radiance_target};
use lucerna::gpu_scene::{GpuScene, GpuSceneOptions};
use lucerna::picture::{Picture, PngOptions};
use lucerna::scene::{Camera, Instance, Light, Material, Mesh, Projection, Scene};
use lucerna::settings;
use lucerna::shader::Source;
use lucerna::techniques::Technique;
use lucerna::techniques::reference::{Channel, resolve};
use lucerna::techniques::voxel_rt::{VoxelRt, VoxelRtSettings};
use renderer::{Renderer, Targets};
use std::path::PathBuf;

/// The renderer's triangles and its lamp as a scene of lucerna.
pub fn scene_of(renderer: &Renderer) -> Scene {
    let vertices = &renderer.vertices;
    let mesh = Mesh {
        positions: vertices.iter().map(|vertex| Vec3::from(vertex.position)).collect(),
        colors: vertices.iter().map(|vertex| Vec3::from(vertex.color).extend(1.0)).collect(),
        triangles: renderer.triangles.clone(),
        ..Mesh::default()
    };
    let (position, intensity) = renderer.lamp;
    Scene {
        meshes: vec![mesh],
        instances: vec![Instance { mesh: 0, world_from_object: Default::default() }],
        materials: vec![Material::default()],
        lights: vec![Light::Point { position, intensity, range: None }],
        ..Scene::default()
    }
}

/// The parts of the renderer's G-buffer that lucerna's kernels read: the variables of `pixel.wgsl`.
struct OwnPixels<'a>(&'a Targets);

impl PixelSurfaces for OwnPixels<'_> {
    fn size(&self) -> UVec2 {
        self.0.size
    }

    fn bindings(&self) -> Bindings<'_> {
        let Targets { albedo, normal, distance, .. } = self.0;
        vec![
            ("own_albedo", albedo.into()),
            ("own_normal", normal.into()),
            ("own_distance", distance.into()),
        ]
    }
}

/// Renders frames with direct and indirect light, and returns the mean of the second half.
pub fn render(renderer: &Renderer, n_frames: u32) -> Result<Picture, Box<dyn std::error::Error>> {
    let gpu = Gpu::new(renderer.device.clone(), renderer.queue.clone());
    let pixel = Source::module("own_gbuffer/pixel.wgsl", include_str!("pixel.wgsl"))?;
    let options = GpuSceneOptions::default().diffuse_only(true);
    let scene = GpuScene::new(&gpu, &scene_of(renderer), options)?.with_module(pixel);
    let projection = Projection::Perspective { vertical_fov: renderer.vertical_fov };
    let camera = Camera::from_matrix(renderer.world_from_view, projection);

    let settings = settings!(VoxelRtSettings { resolution: 32 });
    let mut technique = VoxelRt::new(&gpu, &scene, settings, camera.position)?;
    let size = renderer.targets.size;
    let visibility = LightVisibility::rays();
    let direct = DirectPass::new(&gpu, &scene, size, DirectSettings::default(), &visibility);
    let indirect = radiance_target(&gpu, "indirect", size);
    let composite = CompositePass::new(&gpu, &scene);
    let mut sums = Accumulator::new(&gpu, size);
    let mut view = View::new(size);
    let surfaces = OwnPixels(&renderer.targets);

    for frame_ix in 0..n_frames {
        if frame_ix == n_frames / 2 {
            sums.reset();
        }
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        renderer.draw(&mut encoder);
        view.advance(&scene, &camera, &ViewSettings::default());
        let mut recorder = Recorder::new(&gpu, &mut encoder);
        let pixels = Pixels::new(&view, &surfaces)?;
        technique.update(&mut recorder, &scene, &Eye::at(camera.position))?;
        technique.shade(&mut recorder, &pixels, &indirect)?;
        direct.record(&mut recorder, &scene, &pixels)?;
        let light = (direct.radiance(), Some(&indirect));
        composite.record(&mut recorder, &scene, &pixels, light.0, light.1, &mut sums)?;
        drop(recorder);
        gpu.queue.submit([encoder.finish()]);
    }
    Ok(resolve(&read_film(&gpu, sums.film())?, size, Channel::Beauty))
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let renderer = Renderer::new(UVec2::new(160, 120))?;
    let picture = render(&renderer, 48)?;
    let output = std::env::args_os()
        .nth(1)
        .map_or_else(|| std::env::temp_dir().join("own_gbuffer.png"), PathBuf::from);
    picture.write(&output, &PngOptions::default())?;
    println!("{}", output.display());
    Ok(())
}
