// SPDX-License-Identifier: MIT OR Apache-2.0
//! Frames as a whole: rendering helpers, repeatability, empty scenes, what is not finite, sums.

use crate::harness::{assert_each, differing_bytes, gpu, read, submit};
use crate::support::{diffuse, emitter, floor, lambert, look_down, scene};
use glam::{UVec2, Vec3};
use lucerna::components::voxel_light::Eye;
use lucerna::frame::{DirectSettings, FramePasses, Pixels, View, ViewSettings};
use lucerna::gpu::{PassTimers, Recorder};
use lucerna::gpu_scene::GpuScene;
use lucerna::scene::{Camera, Light, Scene, Sky};
use lucerna::seam::SceneSeam;
use lucerna::settings;
use lucerna::techniques::reference::{Channel, PixelSums, resolve};
use lucerna::techniques::{NoIndirect, Setting, SettingValue, Technique, TechniqueError};

/// Frames of a still camera.
pub struct Rendered {
    pub size: UVec2,
    pub passes: FramePasses,
    pub view: View,
    pub sums: Vec<PixelSums>,
    pub n_rejected: u32,
}

impl Rendered {
    pub fn channel(&self, channel: Channel) -> Vec<Vec3> {
        resolve(&self.sums, self.size, channel).rgb
    }
}

pub fn render(
    world: &GpuScene,
    camera: &Camera,
    size: UVec2,
    settings: ViewSettings,
    n_samples: u32,
) -> Rendered {
    render_with(world, camera, size, settings, n_samples, &mut NoIndirect)
}

fn render_with(
    world: &GpuScene,
    camera: &Camera,
    size: UVec2,
    settings: ViewSettings,
    n_samples: u32,
    technique: &mut impl Technique,
) -> Rendered {
    let mut rendered = Rendered::new(world, size, n_samples);
    rendered.run(world, camera, settings, technique);
    rendered
}

impl Rendered {
    /// Nothing yet; compiled once for any number of [`Self::run`]s.
    pub fn new(world: &GpuScene, size: UVec2, n_samples: u32) -> Self {
        Self::with(world, size, settings!(DirectSettings { n_samples, ..Default::default() }))
    }

    pub fn with(world: &GpuScene, size: UVec2, direct: DirectSettings) -> Self {
        let passes = FramePasses::new(gpu(), world, size, direct).unwrap();
        Self { size, passes, view: View::new(size), sums: Vec::new(), n_rejected: 0 }
    }

    /// Renders anew.
    pub fn run(
        &mut self,
        world: &GpuScene,
        camera: &Camera,
        settings: ViewSettings,
        technique: &mut impl Technique,
    ) {
        self.passes.accumulator.reset();
        self.view.restart();
        for _ in 0..settings.n_accumulated {
            self.view.advance(world, camera, &settings);
            submit(|recorder| self.passes.record(recorder, world, &self.view, technique)).unwrap();
        }
        let stripes = self.passes.accumulator.film().stripes();
        self.sums = stripes
            .iter()
            .flat_map(|stripe| bytemuck::pod_collect_to_vec::<u8, PixelSums>(&read(&stripe.sums)))
            .collect();
        self.n_rejected = bytemuck::pod_read_unaligned(&read(self.passes.direct.faults())[..4]);
    }
}

pub fn accumulated(n_accumulated: u32, seed: u32) -> ViewSettings {
    settings!(ViewSettings { n_accumulated, seed, ..Default::default() })
}

/// The texels of a texture, row by row, rows unpadded.
pub fn read_texture(view: &wgpu::TextureView, bytes_per_texel: u32) -> Vec<u8> {
    let texture = view.texture();
    let row = texture.width() * bytes_per_texel;
    let padded = row.next_multiple_of(256);
    let buffer = gpu().device.create_buffer(&wgpu::BufferDescriptor {
        label: None,
        size: u64::from(padded * texture.height()),
        usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::COPY_SRC,
        mapped_at_creation: false,
    });
    let mut encoder = gpu().device.create_command_encoder(&Default::default());
    encoder.copy_texture_to_buffer(
        texture.as_image_copy(),
        wgpu::TexelCopyBufferInfo {
            buffer: &buffer,
            layout: wgpu::TexelCopyBufferLayout {
                offset: 0,
                bytes_per_row: Some(padded),
                rows_per_image: None,
            },
        },
        texture.size(),
    );
    gpu().queue.submit([encoder.finish()]);
    let bytes = read(&buffer);
    bytes.chunks(padded as usize).flat_map(|padded| padded[..row as usize].to_vec()).collect()
}

fn lit_room() -> Scene {
    let mut world = scene(
        vec![floor(2.0, 0.0, 0), floor(0.5, 0.5, 1)],
        vec![lambert([0.5; 3]), emitter([3.0, 2.0, 1.0])],
    );
    world.lights.push(Light::Point {
        position: Vec3::new(0.5, 2.0, 0.5),
        intensity: Vec3::splat(5.0),
        range: None,
    });
    world.sky = Sky::Constant(Vec3::splat(0.2));
    world
}

#[test]
fn same_input_gives_the_same_bytes() {
    let world = diffuse(&lit_room());
    let size = UVec2::new(37, 19);
    let bytes = |seed| {
        let found = render(&world, &look_down(3.0, 2.5), size, accumulated(3, seed), 4);
        bytemuck::cast_slice::<_, u8>(&found.sums).to_vec()
    };
    let (first, second) = (bytes(1), bytes(1));
    assert!(
        first == second,
        "sums of two renderings with seed 1: {}",
        differing_bytes(&second, &first)
    );
    assert!(bytes(1) != bytes(2), "sums with seeds 1 and 2 are the same, expected others");
}

/// The mean that is shown is that of the sums: (emitted + direct + indirect)/n. One frame more or
/// less than a texture holds: rounding of three sums and a quotient.
#[test]
fn beauty_is_the_mean_of_the_sums_and_reset_begins_anew() {
    let world = diffuse(&lit_room());
    let size = UVec2::new(21, 9);
    let camera = look_down(3.0, 2.5);
    let mut found = render(&world, &camera, size, accumulated(5, 0), 2);
    let check = |found: &Rendered, sums: &[PixelSums]| {
        let shown: Vec<[f32; 4]> =
            bytemuck::pod_collect_to_vec(&read_texture(found.passes.accumulator.beauty(), 16));
        let beauty = resolve(sums, size, Channel::Beauty).rgb;
        for (ix, (shown, beauty)) in shown.iter().zip(&beauty).enumerate() {
            let off = (Vec3::from_slice(shown) - *beauty).abs();
            assert!(
                (off / beauty.max(Vec3::splat(1e-3))).max_element() < 1e-6,
                "pixel {ix}: {shown:?} is shown, expected {beauty} within 1e-6 of it"
            );
        }
        beauty
    };
    let first = check(&found, &found.sums);
    assert_each("beauty of pixels", &first, "above 0", |pixel| pixel.min_element() > 0.0);
    assert_eq!(found.passes.accumulator.n_frames(), 5, "frames that the accumulator counts");
    assert_each("sums of pixels", &found.sums, "of 5 samples", |pixel| pixel.n_samples == 5);

    found.passes.accumulator.reset();
    let Rendered { passes, view, .. } = &mut found;
    submit(|recorder| passes.record(recorder, &world, view, &mut NoIndirect)).unwrap();
    let stripe = &found.passes.accumulator.film().stripes()[0];
    let sums: Vec<PixelSums> = bytemuck::pod_collect_to_vec(&read(&stripe.sums));
    assert_each("sums of pixels after a reset", &sums, "of 1 sample", |pixel| pixel.n_samples == 1);
    check(&found, &sums);
}

/// Nothing at all; triangles without light; a sky without triangles.
#[test]
fn empty_and_dark_scenes() {
    let size = UVec2::new(8, 5);
    let camera = look_down(3.0, 1.0);
    let empty = render(&diffuse(&scene(vec![], vec![])), &camera, size, accumulated(2, 0), 4);
    for channel in [Channel::Beauty, Channel::Albedo, Channel::Normal, Channel::Depth] {
        assert_each(
            &format!("{channel:?} of pixels of an empty scene"),
            &empty.channel(channel),
            "0",
            |&pixel| pixel == Vec3::ZERO,
        );
    }
    let dark = scene(vec![floor(9.0, 0.0, 0)], vec![lambert([1.0; 3])]);
    let dark = render(&diffuse(&dark), &camera, size, accumulated(2, 0), 4);
    assert_each(
        "beauty of pixels without light",
        &dark.channel(Channel::Beauty),
        "black",
        |&pixel| pixel == Vec3::ZERO,
    );
    assert_each("albedo of pixels without light", &dark.channel(Channel::Albedo), "1", |&pixel| {
        pixel == Vec3::ONE
    });
    assert_eq!(
        empty.n_rejected + dark.n_rejected,
        0,
        "rejected pixels of an empty and a dark scene"
    );
    let sky = Vec3::new(70000.0, 2.0, 0.5);
    let sky_only = Scene { sky: Sky::Constant(sky), ..scene(vec![], vec![]) };
    let sky_only = render(&diffuse(&sky_only), &camera, size, accumulated(2, 0), 4);
    assert_each(
        "emitted light of pixels of a sky alone",
        &sky_only.channel(Channel::Emitted),
        &format!("the sky's {sky}"),
        |&pixel| pixel == sky,
    );
    assert_each(
        "direct light of pixels of a sky alone",
        &sky_only.channel(Channel::Direct),
        "black",
        |&pixel| pixel == Vec3::ZERO,
    );
}

/// An infinite light: each pixel of each frame is replaced by 0, counted, and nothing else is lost.
#[test]
fn light_that_is_not_finite_is_replaced_and_counted() {
    let mut world = scene(vec![floor(9.0, 0.0, 0)], vec![lambert([1.0; 3])]);
    world.lights.push(Light::Point {
        position: Vec3::new(0.0, 2.0, 0.0),
        intensity: Vec3::new(f32::INFINITY, 1.0, 1.0),
        range: None,
    });
    let size = UVec2::new(8, 5);
    let found = render(&diffuse(&world), &look_down(3.0, 1.0), size, accumulated(3, 0), 4);
    assert_eq!(found.n_rejected, 3 * 8 * 5, "rejected pixels of 3 frames of 8 × 5, expected all");
    assert_each("beauty of rejected pixels", &found.channel(Channel::Beauty), "black", |&pixel| {
        pixel == Vec3::ZERO
    });
    assert_each(
        "sums of pixels",
        &found.sums,
        "without rejected samples and of 3 surfaces",
        |pixel| pixel.n_rejected == 0 && pixel.n_surfaces == 3,
    );
}

/// Constant radiance, NaN in the pixel (1, 0), that alternates between two textures.
struct Glow {
    textures: [wgpu::TextureView; 2],
    n_updates: usize,
}

impl Technique for Glow {
    fn name(&self) -> &'static str {
        "glow"
    }

    fn update(
        &mut self,
        _: &mut Recorder,
        _: &dyn SceneSeam,
        _: &Eye,
    ) -> Result<(), TechniqueError> {
        self.n_updates += 1;
        Ok(())
    }

    fn shade(
        &mut self,
        recorder: &mut Recorder,
        pixels: &Pixels,
        target: &wgpu::TextureView,
    ) -> Result<(), TechniqueError> {
        assert_eq!(
            pixels.view.frame_ix() as usize,
            self.n_updates - 1,
            "index of the frame that is shaded after {} updates",
            self.n_updates
        );
        let (from, to) = (self.textures[self.n_updates % 2].texture(), target.texture());
        let (from, to) = (from.as_image_copy(), to.as_image_copy());
        recorder.encoder().copy_texture_to_texture(from, to, target.texture().size());
        Ok(())
    }

    fn settings(&self) -> Vec<(Setting, SettingValue)> {
        Vec::new()
    }
}

#[test]
fn a_techniques_light_is_indirect_and_its_nan_is_left_out() {
    use wgpu::util::DeviceExt;
    let size = UVec2::new(4, 3);
    let texture = |value: f32| {
        let mut texels = vec![[value, 2.0 * value, 3.0 * value, 1.0]; 12];
        texels[1][2] = f32::NAN;
        gpu()
            .device
            .create_texture_with_data(
                &gpu().queue,
                &wgpu::TextureDescriptor {
                    label: None,
                    size: wgpu::Extent3d { width: 4, height: 3, depth_or_array_layers: 1 },
                    mip_level_count: 1,
                    sample_count: 1,
                    dimension: wgpu::TextureDimension::D2,
                    format: wgpu::TextureFormat::Rgba32Float,
                    usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_SRC,
                    view_formats: &[],
                },
                Default::default(),
                bytemuck::cast_slice(&texels),
            )
            .create_view(&Default::default())
    };
    let mut glow = Glow { textures: [texture(1.0), texture(3.0)], n_updates: 0 };
    let world = diffuse(&scene(vec![floor(9.0, 0.0, 0)], vec![lambert([1.0; 3])]));
    let settings = accumulated(4, 0);
    let found = render_with(&world, &look_down(3.0, 1.0), size, settings, 4, &mut glow);
    for (ix, pixel) in found.channel(Channel::Indirect).into_iter().enumerate() {
        let expected = if ix == 1 { Vec3::ZERO } else { Vec3::new(2.0, 4.0, 6.0) };
        assert_eq!(pixel, expected, "indirect light of pixel {ix} (1: NaN)");
        assert_eq!(
            found.sums[ix].n_rejected,
            if ix == 1 { 4 } else { 0 },
            "rejected samples of pixel {ix} (1: NaN) in 4 frames"
        );
    }
}

#[test]
fn timers_name_every_pass() {
    let Some(mut timers) = PassTimers::new(gpu()) else {
        eprintln!("\n!!! TIMERS WERE NOT TESTED: this adapter has no timestamps\n");
        return;
    };
    let world = diffuse(&lit_room());
    let size = UVec2::splat(16);
    let mut passes = FramePasses::new(gpu(), &world, size, DirectSettings::default()).unwrap();
    let mut view = View::new(size);
    for _ in 0..2 {
        view.advance(&world, &look_down(3.0, 2.0), &accumulated(2, 0));
        timers.begin_frame();
        let mut encoder = gpu().device.create_command_encoder(&Default::default());
        {
            let recorder = &mut Recorder::timed(gpu(), &mut encoder, Some(&mut timers));
            passes.record(recorder, &world, &view, &mut NoIndirect).unwrap();
        }
        timers.resolve(&mut encoder);
        gpu().queue.submit([encoder.finish()]);
    }
    let times = timers.milliseconds(&read(timers.resolved()));
    let names: Vec<_> = times.iter().map(|&(name, _)| name).collect();
    assert_eq!(
        names,
        ["frame/gbuffer", "frame/direct", "frame/composite"],
        "names of the timed passes"
    );
    assert_each("milliseconds of passes", &times, "within 0 to 60 000", |&(_, ms)| {
        (0.0..60_000.0).contains(&ms)
    });
}
