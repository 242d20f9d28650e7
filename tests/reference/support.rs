// SPDX-License-Identifier: MIT OR Apache-2.0
//! Small scenes, pictures of them with their statistical error, and the comparison.

use crate::harness::{Estimate, Tolerance, assert_estimates, gpu, read, submit};
use glam::{Affine3A, DVec2, DVec3, UVec2, Vec2, Vec3};
use lucerna::blocking::read_path_counts;
use lucerna::gpu_scene::{GpuScene, GpuSceneOptions, RaySource};
use lucerna::scene::{
    Camera, Filter, Image, Instance, Material, Mesh, Projection, Scene, Texture, TextureRef, Wrap,
};
use lucerna::seam::SceneSeam;
use lucerna::settings;
use lucerna::shader::Variant;
use lucerna::techniques::reference::{
    Channel, Film, PathTracer, PixelSums, ReferenceSettings, UnfinishedPaths, Work, resolve,
};
use std::sync::Mutex;

/// A quad, counter-clockwise seen from its front, with texture coordinates (0,0) (0,1) (1,1) (1,0).
pub fn quad(corners: [[f32; 3]; 4], material: usize) -> Mesh {
    Mesh {
        positions: corners.map(Vec3::from).to_vec(),
        uv0: vec![Vec2::ZERO, Vec2::Y, Vec2::ONE, Vec2::X],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        material,
        ..Mesh::default()
    }
}

/// A square of this half side around (0, y, 0) that faces up; u grows with x, v with z.
pub fn floor(half: f32, y: f32, material: usize) -> Mesh {
    quad([[-half, y, -half], [-half, y, half], [half, y, half], [half, y, -half]], material)
}

/// As [`floor`], facing down; u grows with x, v against z.
pub fn ceiling(half: f32, y: f32, material: usize) -> Mesh {
    quad([[-half, y, half], [-half, y, -half], [half, y, -half], [half, y, half]], material)
}

/// Walls of a box that face inwards: x, y, z from 0 to these.
pub fn room([a, b, c]: [f32; 3], material: usize) -> Vec<Mesh> {
    [
        [[0.0, 0.0, 0.0], [0.0, 0.0, c], [a, 0.0, c], [a, 0.0, 0.0]],
        [[0.0, b, 0.0], [a, b, 0.0], [a, b, c], [0.0, b, c]],
        [[0.0, 0.0, 0.0], [a, 0.0, 0.0], [a, b, 0.0], [0.0, b, 0.0]],
        [[0.0, 0.0, c], [0.0, b, c], [a, b, c], [a, 0.0, c]],
        [[0.0, 0.0, 0.0], [0.0, b, 0.0], [0.0, b, c], [0.0, 0.0, c]],
        [[a, 0.0, 0.0], [a, 0.0, c], [a, b, c], [a, b, 0.0]],
    ]
    .map(|corners| quad(corners, material))
    .to_vec()
}

pub fn scene(meshes: Vec<Mesh>, materials: Vec<Material>) -> Scene {
    let instances = (0..meshes.len())
        .map(|mesh| Instance { mesh, world_from_object: Affine3A::IDENTITY })
        .collect();
    Scene { meshes, instances, materials, ..Scene::default() }
}

pub fn lambert(color: [f32; 3]) -> Material {
    Material { base_color: Vec3::from(color).extend(1.0), ..Material::default() }
}

/// Black but for what it emits.
pub fn emitter(radiance: [f32; 3]) -> Material {
    Material { emission: radiance.into(), ..lambert([0.0; 3]) }
}

/// Adds an image of these texels and says how to use it; nearest texel, repeated.
pub fn add_texture(scene: &mut Scene, width: u32, rgba: Vec<[u8; 4]>) -> TextureRef {
    let height = rgba.len() as u32 / width;
    scene.images.push(Image { name: String::from("test"), width, height, rgba });
    scene.textures.push(Texture {
        image: scene.images.len() - 1,
        wrap_u: Wrap::Repeat,
        wrap_v: Wrap::Repeat,
        filter: Filter::Nearest,
    });
    TextureRef {
        texture: scene.textures.len() - 1,
        uv_set: 0,
        uv_from_mesh: glam::Affine2::IDENTITY,
    }
}

/// Looks straight down from this height at a square of this half side; columns grow with x, rows
/// with z.
pub fn look_down(height: f32, half: f32) -> Camera {
    Camera {
        name: String::new(),
        position: Vec3::new(0.0, height, 0.0),
        forward: Vec3::NEG_Y,
        up: Vec3::NEG_Z,
        projection: Projection::Orthographic { half_height: half },
    }
}

pub fn settings(width: u32, height: u32, n_bounces: u32) -> ReferenceSettings {
    settings!(ReferenceSettings {
        size: UVec2::new(width, height),
        n_bounces,
        seed: 0,
        irradiance: false,
        occlusion_distance: 0.0,
    })
}

/// Lambertian reading of every material.
pub fn diffuse(scene: &Scene) -> GpuScene {
    on_gpu(scene, true, RaySource::Software)
}

pub fn on_gpu(scene: &Scene, diffuse_only: bool, rays: RaySource) -> GpuScene {
    GpuScene::new(gpu(), scene, settings!(GpuSceneOptions { diffuse_only, rays })).unwrap()
}

/// One kernel a variant serves all tests.
fn tracer(scene: &GpuScene) -> &'static PathTracer {
    static TRACERS: Mutex<Vec<(Variant, &PathTracer)>> = Mutex::new(Vec::new());
    let variant = scene.shaders().variant();
    let mut tracers = TRACERS.lock().unwrap();
    if let Some((_, tracer)) = tracers.iter().find(|(known, _)| *known == variant) {
        return tracer;
    }
    let tracer = Box::leak(Box::new(PathTracer::new(gpu(), scene)));
    tracers.push((variant, tracer));
    tracer
}

/// Renders the given cuts of the work, one submission each, or more where the driver bounds loops.
pub fn render_cut(
    scene: &GpuScene,
    camera: &Camera,
    settings: &ReferenceSettings,
    cuts: &[Work],
) -> Vec<PixelSums> {
    let gpu = gpu();
    let film = Film::new(gpu, settings.size);
    assert_eq!(film.stripes().len(), 1);
    let rest = UnfinishedPaths::new(gpu, &film);
    for &work in cuts {
        let mut work = work;
        loop {
            let tracer = tracer(scene);
            submit(|recorder| tracer.record(recorder, scene, &film, &rest, camera, settings, work))
                .unwrap();
            let counts = read_path_counts(gpu, &rest).unwrap();
            assert_eq!(counts.n_cut, 0, "a ray was too long for this driver");
            if counts.n_unfinished == 0 {
                break;
            }
            work.continues = true;
        }
    }
    bytemuck::pod_collect_to_vec(&read(&film.stripes()[0].sums))
}

/// All rows, at most 256 samples a dispatch.
pub fn render(
    scene: &GpuScene,
    camera: &Camera,
    settings: &ReferenceSettings,
    n_samples: u32,
) -> Vec<PixelSums> {
    let cuts: Vec<_> = (0..n_samples)
        .step_by(256)
        .map(|first_sample| Work {
            stripe: 0,
            first_row: 0,
            n_rows: settings.size.y,
            first_sample,
            n_samples: 256.min(n_samples - first_sample),
            continues: false,
        })
        .collect();
    render_cut(scene, camera, settings, &cuts)
}

/// How many independent renderings an estimate rests on.
const N_BATCHES: u32 = 32;

/// Independent renderings of one picture.
pub struct Batches {
    size: UVec2,
    sums: Vec<Vec<PixelSums>>,
}

/// Renders [`N_BATCHES`] times with as many seeds; `n_samples` in all.
pub fn batches(
    scene: &GpuScene,
    camera: &Camera,
    settings: &ReferenceSettings,
    n_samples: u32,
) -> Batches {
    let sums = (0..N_BATCHES)
        .map(|seed| {
            render(
                scene,
                camera,
                &settings!(ReferenceSettings { seed, ..*settings }),
                n_samples / N_BATCHES,
            )
        })
        .collect();
    Batches { size: settings.size, sums }
}

/// Means over independent renderings with their standard errors, red, green and blue of each pixel in turn.
pub struct Estimates {
    pixels: Vec<Estimate>,
    means: Vec<Estimate>,
    width: usize,
}

impl Batches {
    pub fn estimate(&self, channel: Channel) -> Estimates {
        let pictures: Vec<Vec<DVec3>> = self
            .sums
            .iter()
            .map(|sums| {
                resolve(sums, self.size, channel).rgb.iter().map(|c| c.as_dvec3()).collect()
            })
            .collect();
        let n_pixels = pictures[0].len();
        let of = |value: &dyn Fn(&Vec<DVec3>) -> f64| Estimate::of(pictures.iter().map(value));
        let numbers = (0..n_pixels).flat_map(|ix| (0..3).map(move |c| (ix, c)));
        let pixels = numbers.map(|(ix, c)| of(&|picture| picture[ix][c])).collect();
        let mean = |picture: &Vec<DVec3>, c: usize| {
            picture.iter().map(|pixel| pixel[c]).sum::<f64>() / n_pixels as f64
        };
        let means = (0..3).map(|c| of(&|picture| mean(picture, c))).collect();
        Estimates { pixels, means, width: self.size.x as usize }
    }
}

impl Estimates {
    /// The picture's mean.
    pub fn mean(&self) -> DVec3 {
        DVec3::from_array(std::array::from_fn(|c| self.means[c].mean))
    }

    /// The mean of each pixel.
    pub fn pixels(&self) -> Vec<DVec3> {
        let of = |of: &[Estimate]| DVec3::new(of[0].mean, of[1].mean, of[2].mean);
        self.pixels.chunks_exact(3).map(of).collect()
    }

    /// The mean of each pixel's red, green and blue with its standard error.
    pub fn numbers(&self) -> &[Estimate] {
        &self.pixels
    }

    /// Compares with the truth of each pixel: the picture's mean and each pixel, by their standard errors, at the suite's
    /// level (`lucerna::testing::assert_estimates`). Apart from chance, sums of up to 10⁴ f32 round by 3e-5 of the
    /// brightest value.
    ///
    /// `resolves`: the relative error of the picture's mean that must show.
    pub fn check(&self, what: &str, expected: &[DVec3], resolves: f64) {
        let truth = expected.iter().sum::<DVec3>() / expected.len() as f64;
        let brightest = expected.iter().map(|v| v.max_element()).fold(0.0, f64::max);
        let rounding = Tolerance::absolute(3e-5 * brightest);
        let resolves = Tolerance { relative: resolves, ..rounding };
        let mean = assert_estimates(
            &format!("{what}, mean"),
            &self.means,
            &truth.to_array(),
            rounding,
            resolves,
        );
        let rows = format!("{what}, red, green, blue of {} pixels a row", self.width);
        let flat: Vec<f64> = expected.iter().flat_map(|v| v.to_array()).collect();
        let any = Tolerance::absolute(f64::INFINITY);
        let pixel = assert_estimates(&rows, &self.pixels, &flat, rounding, any);
        println!("{what}: mean {:.2}, worst pixel {pixel:.2} of what chance explains", mean);
    }

    /// Compares with a truth that is the same everywhere.
    pub fn check_all(&self, what: &str, expected: DVec3, resolves: f64) {
        self.check(what, &vec![expected; self.pixels.len() / 3], resolves);
    }
}

/// Means over pixels of a function of the picture's plane, by Gauss' two points in 8×8 cells a
/// pixel. Coordinates run from −1 to 1, to the right and *down*.
pub fn over_pixels(size: UVec2, f: impl Fn(DVec2) -> DVec3) -> Vec<DVec3> {
    const CELLS: u32 = 8;
    let gauss = 0.5 / 3f64.sqrt();
    let offsets: Vec<f64> = (0..CELLS)
        .flat_map(|cell| {
            [0.5 - gauss, 0.5 + gauss].map(|x| (f64::from(cell) + x) / f64::from(CELLS))
        })
        .collect();
    let n = (offsets.len() * offsets.len()) as f64;
    (0..size.y)
        .flat_map(|y| (0..size.x).map(move |x| DVec2::new(f64::from(x), f64::from(y))))
        .map(|pixel| {
            let mut sum = DVec3::ZERO;
            for &dy in &offsets {
                for &dx in &offsets {
                    sum += f(2.0 * (pixel + DVec2::new(dx, dy)) / size.as_dvec2() - 1.0);
                }
            }
            sum / n
        })
        .collect()
}
