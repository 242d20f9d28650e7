//! The camera of a frame: matrices, jitter, the uniform that all kernels share.

use crate::bindings::baseline::lucerna::frame::view::FrameView;
use crate::gpu::Gpu;
use crate::gpu_scene::GpuScene;
use crate::reference::camera_for_size;
use crate::scene::{Camera, Projection};
use glam::{DMat4, DVec3, DVec4, Mat4, UVec2, Vec2};

/// What does not follow from camera and scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ViewSettings {
    /// Frames that will be averaged. 1: no jitter. More: each frame samples the pixel elsewhere, so
    /// that the mean converges to the pixel's box filter, and textures are read that much sharper.
    pub n_accumulated: u32,
    /// Stream of random numbers.
    pub seed: u32,
    /// Distance of the near plane \[m\], above 0; nothing in front of it is seen.
    pub near: f32,
    /// The first surface is a white Lambertian: π·(direct + indirect) is its irradiance.
    pub irradiance: bool,
    /// How far ambient occlusion looks \[m\], at least 0.
    pub occlusion_distance: f32,
}

impl Default for ViewSettings {
    /// One frame, seed 0, 1 cm; ambient occlusion as far as 1 m.
    fn default() -> Self {
        Self { n_accumulated: 1, seed: 0, near: 0.01, irradiance: false, occlusion_distance: 1.0 }
    }
}

/// The camera of the present frame, on the CPU and the GPU.
#[derive(Debug)]
pub struct View {
    uniform: wgpu::Buffer,
    data: FrameView,
    n_frames: u32,
}

impl View {
    /// `size`: at least 1×1 \[pixels\]. Nothing is seen before [`Self::advance`].
    pub fn new(gpu: &Gpu, size: UVec2) -> Self {
        let data = FrameView { size, ..bytemuck::Zeroable::zeroed() };
        let uniform = gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("frame view"),
            size: size_of::<FrameView>() as u64,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        Self { uniform, data, n_frames: 0 }
    }

    /// Begins the next frame. Takes effect with the next submission: the frame before must have been
    /// submitted.
    pub fn advance(
        &mut self,
        gpu: &Gpu,
        scene: &GpuScene,
        camera: &Camera,
        settings: &ViewSettings,
    ) {
        let size = self.data.size;
        let range = orthographic_range(camera, scene, settings.near);
        let clip_from_world = clip_from_world(camera, size, settings.near, range);
        let world_from_clip = clip_from_world.inverse().as_mat4();
        let clip_from_world = clip_from_world.as_mat4();
        let previous: Mat4 =
            if self.n_frames == 0 { clip_from_world } else { self.data.clip_from_world };
        let frame = self.n_frames;
        self.data = FrameView {
            camera: camera_for_size(camera, size),
            clip_from_world,
            world_from_clip,
            previous_clip_from_world: previous,
            size,
            jitter: if settings.n_accumulated > 1 { jitter(frame) } else { Vec2::ZERO },
            frame,
            seed: settings.seed,
            near: settings.near,
            footprint: 1.0 / (settings.n_accumulated.max(1) as f32).sqrt(),
            lambert: u32::from(scene.is_diffuse_only()),
            irradiance: u32::from(settings.irradiance),
            inverse_range: 1.0 / range,
            occlusion_distance: settings.occlusion_distance,
        };
        gpu.queue.write_buffer(&self.uniform, 0, bytemuck::bytes_of(&self.data));
        self.n_frames += 1;
    }

    /// Forgets the frames so far: frame and jitter count from 0, and nothing has moved.
    pub fn restart(&mut self) {
        self.n_frames = 0;
    }

    /// [`FrameView`] for `var<uniform>`.
    pub fn uniform(&self) -> &wgpu::Buffer {
        &self.uniform
    }

    /// The same on the CPU.
    pub fn data(&self) -> &FrameView {
        &self.data
    }

    /// Width and height \[pixels\].
    pub fn size(&self) -> UVec2 {
        self.data.size
    }

    /// Frames before the present one.
    pub fn frame_ix(&self) -> u32 {
        self.data.frame
    }
}

/// The plastic number, the real root of g³ = g + 1.
const PLASTIC: f64 = 1.324_717_957_244_746;

/// Where frame `ix` samples its pixels, from their centre \[pixels\]: M. Roberts' R2 sequence, 2018,
/// in fixed point, so that it does not coarsen; it begins at the centre.
fn jitter(ix: u32) -> Vec2 {
    let component = |step: f64| {
        let step = (step * f64::from(u32::MAX)) as u32;
        let bits = 0x8000_0000u32.wrapping_add(ix.wrapping_mul(step));
        (bits >> 8) as f32 / (1 << 24) as f32 - 0.5
    };
    Vec2::new(component(1.0 / PLASTIC), component(1.0 / (PLASTIC * PLASTIC)))
}

/// How deep an orthographic camera must see to see all of the scene \[m\].
fn orthographic_range(camera: &Camera, scene: &GpuScene, near: f32) -> f32 {
    let (min, max) = scene.bounds();
    let corner = glam::Vec3::select(camera.forward.cmpge(glam::Vec3::ZERO), max, min);
    let deepest = (corner - camera.position).dot(camera.forward) - near;
    // A scene behind the camera still needs a matrix.
    (1.01 * deepest).max(1.0)
}

/// Reversed depth; see `wgsl/frame/view.wgsl`.
fn clip_from_world(camera: &Camera, size: UVec2, near: f32, range: f32) -> DMat4 {
    let forward = camera.forward.as_dvec3();
    let right = forward.cross(camera.up.as_dvec3()).normalize_or_zero();
    let up = right.cross(forward);
    let aspect = f64::from(size.x) / f64::from(size.y);
    let position = camera.position.as_dvec3();
    let row = |axis: DVec3| axis.extend(-axis.dot(position));
    let near = f64::from(near);
    let rows = match camera.projection {
        Projection::Perspective { vertical_fov } => {
            let half = (0.5 * f64::from(vertical_fov)).tan();
            [row(right) / (half * aspect), row(up) / half, DVec4::W * near, row(forward)]
        }
        Projection::Orthographic { half_height } => {
            let half = f64::from(half_height);
            let range = f64::from(range);
            let depth = DVec4::W * (1.0 + near / range) - row(forward) / range;
            [row(right) / (half * aspect), row(up) / half, depth, DVec4::W]
        }
    };
    DMat4::from_cols(rows[0], rows[1], rows[2], rows[3]).transpose()
}
