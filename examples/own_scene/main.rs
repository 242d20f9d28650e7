// SPDX-License-Identifier: MIT OR Apache-2.0
//! `voxel-rt` on a renderer's own scene: its buffers, its intersection code, no `GpuScene` and no G-buffer.
//!
//! The scene is a few parallelograms and a lamp. Seven short modules in this folder implement what kernels need from a
//! scene; bind group 0 is the renderer's. Everything else is lucerna, unchanged.
//!
//! `cargo run --example own_scene [OUT.png]`; the file is `own_scene.png` in the system's folder of temporary files by
//! default.

use glam::{UVec2, Vec3, Vec4};
use lucerna::blocking::{open, read_film};
use lucerna::components::LightVisibility;
use lucerna::components::voxel_light::Eye;
use lucerna::frame::{
    Accumulator, CompositePass, DirectPass, DirectSettings, PixelSurfaces, Pixels, View,
    ViewSettings,
};
use lucerna::gpu::{AdapterChoice, Bindings, Gpu, Recorder, SceneGroup, Shaders, radiance_target};
use lucerna::picture::{Picture, PngOptions};
use lucerna::scene::{Camera, Projection};
use lucerna::seam::{LightPeak, PunctualLight, Revisions, SceneFacts, SceneSeam};
use lucerna::settings;
use lucerna::shader::Source;
use lucerna::techniques::Technique;
use lucerna::techniques::reference::{Channel, resolve};
use lucerna::techniques::voxel_rt::{VoxelRt, VoxelRtSettings};
use std::path::PathBuf;
use wgpu::util::DeviceExt;

/// The modules that implement this scene.
const MODULES: [(&str, &str); 7] = [
    ("own_scene/quads.wgsl", include_str!("quads.wgsl")),
    ("own_scene/triangles.wgsl", include_str!("triangles.wgsl")),
    ("own_scene/rays.wgsl", include_str!("rays.wgsl")),
    ("own_scene/surface.wgsl", include_str!("surface.wgsl")),
    ("own_scene/lights.wgsl", include_str!("lights.wgsl")),
    ("own_scene/sky.wgsl", include_str!("sky.wgsl")),
    ("own_scene/pixel.wgsl", include_str!("pixel.wgsl")),
];

/// A parallelogram as `quads.wgsl` has it: corner, two sides, colour.
type Quad = [Vec4; 4];

fn quad(corner: [f32; 3], u: [f32; 3], v: [f32; 3], color: [f32; 3]) -> Quad {
    [corner, u, v, color].map(|xyz| Vec3::from(xyz).extend(0.0))
}

/// Position \[m\] and intensity \[W·sr⁻¹\].
pub const LAMP: (Vec3, Vec3) = (Vec3::new(0.0, 3.4, 0.4), Vec3::splat(12.0));

/// A room 4 m wide, open towards the camera, with a shelf that keeps direct light from what is under it.
pub fn room() -> Vec<Quad> {
    let (white, red, green) = ([0.7, 0.7, 0.7], [0.6, 0.1, 0.1], [0.1, 0.5, 0.1]);
    vec![
        quad([-2.0, 0.0, -2.0], [0.0, 0.0, 4.0], [4.0, 0.0, 0.0], white),
        quad([-2.0, 4.0, -2.0], [4.0, 0.0, 0.0], [0.0, 0.0, 4.0], white),
        quad([-2.0, 0.0, -2.0], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0], white),
        quad([-2.0, 0.0, -2.0], [0.0, 4.0, 0.0], [0.0, 0.0, 4.0], red),
        quad([2.0, 0.0, -2.0], [0.0, 0.0, 4.0], [0.0, 4.0, 0.0], green),
        quad([-1.2, 1.2, -1.4], [0.0, 0.0, 2.0], [2.4, 0.0, 0.0], white),
    ]
}

/// The scene behind the seam.
pub struct OwnScene {
    shaders: Shaders,
    group: SceneGroup,
    facts: SceneFacts,
    revisions: Revisions,
}

impl OwnScene {
    pub fn new(gpu: &Gpu, quads: &[Quad]) -> Result<Self, Box<dyn std::error::Error>> {
        let (lamp, intensity) = LAMP;
        let buffer = |contents: &[u8], usage| {
            let label = Some("own scene");
            let descriptor = wgpu::util::BufferInitDescriptor { label, contents, usage };
            gpu.device.create_buffer_init(&descriptor)
        };
        let quads_buffer = buffer(bytemuck::cast_slice(quads), wgpu::BufferUsages::STORAGE);
        let lamp_words = [lamp.extend(0.0), intensity.extend(0.0)];
        let lamp_buffer = buffer(bytemuck::cast_slice(&lamp_words), wgpu::BufferUsages::UNIFORM);

        let mut shaders = Shaders::default();
        for (file, text) in MODULES {
            shaders = shaders.with_module(Source::module(file, text)?);
        }
        // Kernels that use both bindings.
        let asks_all = ["voxel_light/gather", "frame/direct"];
        let bound = vec![("quads", (&quads_buffer).into()), ("lamp", (&lamp_buffer).into())];
        let group = SceneGroup::new(gpu, &shaders, &asks_all, &bound);

        let corners = quads.iter().flat_map(|[corner, u, v, _]| {
            [*corner, corner + u, corner + v, corner + u + v].map(Vec4::truncate)
        });
        let peak = LightPeak::new(intensity.max_element(), 0.0);
        let facts = settings!(SceneFacts {
            bounds_min: corners.clone().fold(Vec3::INFINITY, Vec3::min),
            bounds_max: corners.fold(Vec3::NEG_INFINITY, Vec3::max),
            n_triangles: 2 * quads.len() as u32,
            diffuse_only: true,
            punctual_lights: vec![PunctualLight::Point { position: lamp }],
            punctual_peaks: vec![peak],
            drawn_peak: peak,
        });
        Ok(Self { shaders, group, facts, revisions: Revisions::fresh() })
    }
}

impl SceneSeam for OwnScene {
    fn shaders(&self) -> &Shaders {
        &self.shaders
    }

    fn group(&self) -> &SceneGroup {
        &self.group
    }

    fn facts(&self) -> &SceneFacts {
        &self.facts
    }

    fn revisions(&self) -> Revisions {
        self.revisions
    }
}

/// Rays find the pixels' surfaces, so only the scene is bound.
struct ByRays<'a> {
    size: UVec2,
    scene: &'a SceneGroup,
}

impl PixelSurfaces for ByRays<'_> {
    fn size(&self) -> UVec2 {
        self.size
    }

    fn bindings(&self) -> Bindings<'_> {
        vec![]
    }

    fn scene(&self) -> Option<&SceneGroup> {
        Some(self.scene)
    }
}

/// Renders frames with direct and indirect light, and returns the mean of the second half.
pub fn render(
    gpu: &Gpu,
    scene: &OwnScene,
    camera: &Camera,
    size: UVec2,
    n_frames: u32,
) -> Result<Picture, Box<dyn std::error::Error>> {
    let settings = settings!(VoxelRtSettings { resolution: 32 });
    let mut technique = VoxelRt::new(gpu, scene, settings, camera.position)?;
    let visibility = LightVisibility::rays();
    let direct = DirectPass::new(gpu, scene, size, DirectSettings::default(), &visibility);
    let composite = CompositePass::new(gpu, scene);
    let indirect = radiance_target(gpu, "indirect", size);
    let mut sums = Accumulator::new(gpu, size);
    let mut view = View::new(size);
    let view_settings = settings!(ViewSettings { n_accumulated: n_frames / 2 });
    let surfaces = ByRays { size, scene: scene.group() };

    for frame_ix in 0..n_frames {
        if frame_ix == n_frames / 2 {
            // The voxels' light has settled: from here on the picture is kept.
            sums.reset();
        }
        view.advance(scene, camera, &view_settings);
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        let mut recorder = Recorder::new(gpu, &mut encoder);
        let pixels = Pixels::new(&view, &surfaces)?;
        technique.update(&mut recorder, scene, &Eye::at(camera.position))?;
        technique.shade(&mut recorder, &pixels, &indirect)?;
        direct.record(&mut recorder, scene, &pixels)?;
        let light = (direct.radiance(), Some(&indirect));
        composite.record(&mut recorder, scene, &pixels, light.0, light.1, &mut sums)?;
        drop(recorder);
        gpu.queue.submit([encoder.finish()]);
    }
    Ok(resolve(&read_film(gpu, sums.film())?, size, Channel::Beauty))
}

pub fn camera() -> Camera {
    Camera {
        name: "front".into(),
        position: Vec3::new(0.0, 2.0, 7.0),
        forward: Vec3::NEG_Z,
        up: Vec3::Y,
        projection: Projection::Perspective { vertical_fov: 45f32.to_radians() },
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let (gpu, info) = open(&AdapterChoice::Auto)?;
    eprintln!("adapter: {}", info.name);
    let scene = OwnScene::new(&gpu, &room())?;
    let picture = render(&gpu, &scene, &camera(), UVec2::new(160, 120), 48)?;
    let output = std::env::args_os()
        .nth(1)
        .map_or_else(|| std::env::temp_dir().join("own_scene.png"), PathBuf::from);
    picture.write(&output, &PngOptions::default())?;
    println!("{}", output.display());
    Ok(())
}
