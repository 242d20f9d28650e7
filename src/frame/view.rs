// SPDX-License-Identifier: MIT OR Apache-2.0
//! The camera of a frame: matrices, jitter, and the uniform that all kernels share.

use super::camera_for_size;
use crate::bindings::lucerna::frame::view::FrameView;
use crate::scene::{Camera, Projection};
use crate::seam::{SceneFacts, SceneSeam};
use glam::{DMat4, DVec3, DVec4, Mat4, UVec2, Vec2};

/// Settings of a view, besides the camera and the scene.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct ViewSettings {
    /// Number of frames that will be averaged. 1: no jitter. More: each frame samples another position within the
    /// pixel, so that the mean converges to the pixel's box filter, and textures are read correspondingly sharper.
    pub n_accumulated: u32,
    /// Seed of the random numbers.
    pub seed: u32,
    /// Distance of the near plane \[m\], above 0; nothing in front of it is seen. None: 10 µm, or 10⁻⁴ of the scene's
    /// diagonal if that is less. (It does not affect the precision of depths: they are reversed, and found from the
    /// pixel's ray.)
    pub near: Option<f32>,
    /// Replaces the first surface with a white Lambertian one: π·(direct + indirect) is its irradiance.
    pub irradiance: bool,
    /// Radius of ambient occlusion \[m\], at least 0.
    pub occlusion_distance: f32,
}

impl Default for ViewSettings {
    /// One frame, seed 0, a near plane that follows from the scene's size, and ambient occlusion within 1 m.
    fn default() -> Self {
        Self { n_accumulated: 1, seed: 0, near: None, irradiance: false, occlusion_distance: 1.0 }
    }
}

/// The camera of the current frame.
#[derive(Clone, Debug)]
pub struct View {
    data: FrameView,
    n_frames: u32,
}

impl View {
    /// `size`: at least 1×1 \[pixels\]. The view is empty before the first [`Self::advance`].
    pub fn new(size: UVec2) -> Self {
        Self { data: FrameView { size, ..bytemuck::Zeroable::zeroed() }, n_frames: 0 }
    }

    /// Starts the next frame.
    pub fn advance(&mut self, scene: &dyn SceneSeam, camera: &Camera, settings: &ViewSettings) {
        let scene = scene.facts();
        let size = self.data.size;
        let near = settings.near.unwrap_or_else(|| near_of(scene));
        let range = orthographic_range(camera, scene, near);
        let clip_from_world = clip_from_world(camera, size, near, range);
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
            near,
            footprint: 1.0 / (settings.n_accumulated.max(1) as f32).sqrt(),
            lambert: u32::from(scene.diffuse_only),
            irradiance: u32::from(settings.irradiance),
            inverse_range: 1.0 / range,
            occlusion_distance: settings.occlusion_distance,
            emission_scale: emission_scale(scene.brightest_emission),
            reserved_a: 0,
            reserved_b: 0,
            reserved_c: 0,
        };
        self.n_frames += 1;
    }

    /// Forgets the frames so far: frame and jitter count from 0, and nothing has moved.
    pub fn restart(&mut self) {
        self.n_frames = 0;
    }

    /// The uniform that kernels bind as `view`.
    pub fn data(&self) -> &FrameView {
        &self.data
    }

    /// Width and height \[pixels\].
    pub fn size(&self) -> UVec2 {
        self.data.size
    }

    /// Number of frames before the current one.
    pub fn frame_ix(&self) -> u32 {
        self.data.frame
    }
}

/// Where frame `ix` samples its pixels, relative to their centre \[pixels\]: the first two dimensions of Sobol's
/// sequence (I. Sobol', 1967), shifted so that it starts at the centre. Any 2ᵏ consecutive frames that start at a
/// multiple of 2ᵏ, and so the first ones, have one sample in each of 2ᵏ equal rows and columns of the pixel. (None of
/// the first 32 points of R2 lies in the lowest 8 % of the pixel, so that what covers only this part would be missed.)
fn jitter(ix: u32) -> Vec2 {
    let x = ix.reverse_bits();
    let mut y = 0;
    let (mut rest, mut direction) = (ix, 1u32 << 31);
    while rest != 0 {
        y ^= if rest & 1 == 1 { direction } else { 0 };
        direction ^= direction >> 1;
        rest >>= 1;
    }
    let component = |bits: u32| ((bits ^ 1 << 31) >> 8) as f32 / (1 << 24) as f32 - 0.5;
    Vec2::new(component(x), component(y))
}

/// The default distance of the near plane \[m\].
fn near_of(scene: &SceneFacts) -> f32 {
    const NEAR: f32 = 1e-5;
    const SHARE: f32 = 1e-4;
    let share = SHARE * scene.diagonal();
    // A scene of one point has no size.
    if share > 0.0 { share.min(NEAR) } else { NEAR }
}

/// The power of two that scales the brightest emission \[W·sr⁻¹·m⁻²\] to 2¹⁴ to 2¹⁵, below 65 504, the largest 16-bit
/// float.
fn emission_scale(brightest: f32) -> f32 {
    if !(brightest.is_normal() && brightest > 0.0) {
        return 1.0;
    }
    // Within the range in which both it and its inverse are normal f32.
    2f32.powi((14 - brightest.log2().floor() as i32).clamp(-120, 120))
}

/// The depth range in which an orthographic camera sees the whole scene \[m\].
fn orthographic_range(camera: &Camera, scene: &SceneFacts, near: f32) -> f32 {
    let (min, max) = (scene.bounds_min, scene.bounds_max);
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Every block of 2ᵏ frames has a sample in each elementary rectangle of area 2⁻ᵏ.
    #[test]
    fn jitter_is_a_net() {
        assert_eq!(jitter(0), Vec2::ZERO);
        for k in 1..=8u32 {
            let n = 1u32 << k;
            for first in [0, n, 6 * n] {
                for log_columns in 0..=k {
                    let (columns, rows) = (1u32 << log_columns, n >> log_columns);
                    let mut seen = vec![false; n as usize];
                    for ix in first..first + n {
                        let at = jitter(ix) + 0.5;
                        assert!(at.min_element() >= 0.0 && at.max_element() < 1.0);
                        let (x, y) = ((at.x * columns as f32) as u32, (at.y * rows as f32) as u32);
                        assert!(!std::mem::replace(&mut seen[(y * columns + x) as usize], true));
                    }
                }
            }
        }
    }
}
