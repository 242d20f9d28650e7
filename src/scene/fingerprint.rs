// SPDX-License-Identifier: MIT OR Apache-2.0
//! Numbers that tell whether two scenes are the same.

use super::{AlphaMode, Filter, Light, Scene, Sky, TextureRef, Wrap};
use glam::Vec3;
use xxhash_rust::xxh3::Xxh3Default;

/// Three hashes (XXH3, 64 bits) of a scene. The same on every machine; a change of names or cameras changes none.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SceneFingerprint {
    /// Meshes, and which of them are placed: the same for as long as things only move.
    pub shape: u64,
    /// Where things are that do not move.
    pub pose: u64,
    /// Lights, sky, materials and textures.
    pub light: u64,
}

impl SceneFingerprint {
    /// Of a scene. `diffuse_only`: as in [`GpuSceneOptions`](crate::gpu_scene::GpuSceneOptions); `moving`: which instances are left out,
    /// because they move.
    pub fn of(scene: &Scene, diffuse_only: bool, moving: &dyn Fn(usize) -> bool) -> Self {
        Self {
            shape: shape(scene, moving),
            pose: pose(scene, moving),
            light: light(scene, diffuse_only),
        }
    }
}

/// Hashes numbers by their little-endian bytes, and lists with their lengths.
struct Hash(Xxh3Default);

impl Hash {
    fn new() -> Self {
        Self(Xxh3Default::new())
    }

    fn number(&mut self, number: u64) {
        self.0.update(&number.to_le_bytes());
    }

    fn floats(&mut self, floats: &[f32]) {
        for float in floats {
            // (Both zeros are the same number.)
            self.0.update(&(float + 0.0).to_le_bytes());
        }
    }

    fn list<T>(&mut self, list: &[T], mut each: impl FnMut(&mut Self, &T)) {
        self.number(list.len() as u64);
        for item in list {
            each(self, item);
        }
    }

    fn done(self) -> u64 {
        self.0.digest()
    }
}

fn still(scene: &Scene, moving: &dyn Fn(usize) -> bool) -> Vec<usize> {
    (0..scene.instances.len()).filter(|ix| !moving(*ix)).collect()
}

fn shape(scene: &Scene, moving: &dyn Fn(usize) -> bool) -> u64 {
    let mut hash = Hash::new();
    hash.list(&still(scene, moving), |hash, ix| {
        let mesh = scene.meshes.get(scene.instances[*ix].mesh);
        hash.number(mesh.is_some().into());
        let Some(mesh) = mesh else { return };
        hash.list(&mesh.positions, |hash, at| hash.floats(&at.to_array()));
        hash.list(&mesh.normals, |hash, normal| hash.floats(&normal.to_array()));
        hash.list(&mesh.triangles, |hash, triangle| {
            triangle.iter().for_each(|corner| hash.number((*corner).into()));
        });
    });
    hash.done()
}

fn pose(scene: &Scene, moving: &dyn Fn(usize) -> bool) -> u64 {
    let mut hash = Hash::new();
    hash.list(&still(scene, moving), |hash, ix| {
        hash.floats(&scene.instances[*ix].world_from_object.to_cols_array());
    });
    hash.done()
}

fn light(scene: &Scene, diffuse_only: bool) -> u64 {
    let mut hash = Hash::new();
    hash.number(diffuse_only.into());
    hash.list(&scene.lights, |hash, light| {
        let mut of = |kind: u64, vectors: &[Vec3], numbers: &[f32]| {
            hash.number(kind);
            vectors.iter().for_each(|vector| hash.floats(&vector.to_array()));
            hash.floats(numbers);
        };
        match *light {
            Light::Point { position, intensity, range } => {
                of(0, &[position, intensity], &[range.unwrap_or(-1.0)]);
            }
            Light::Spot { position, direction, intensity, inner, outer, range } => {
                of(1, &[position, direction, intensity], &[inner, outer, range.unwrap_or(-1.0)])
            }
            Light::Directional { direction, irradiance } => of(2, &[direction, irradiance], &[]),
        }
    });
    match &scene.sky {
        Sky::Constant(radiance) => hash.floats(&radiance.to_array()),
        Sky::Image { width, height, rgb } => {
            hash.number((*width).into());
            hash.number((*height).into());
            hash.list(rgb, |hash, pixel| hash.floats(&pixel.to_array()));
        }
    }
    for instance in &scene.instances {
        hash.number(scene.meshes.get(instance.mesh).map_or(0, |mesh| mesh.material as u64));
    }
    for mesh in &scene.meshes {
        hash.list(&mesh.uv0, |hash, uv| hash.floats(&uv.to_array()));
        hash.list(&mesh.uv1, |hash, uv| hash.floats(&uv.to_array()));
        hash.list(&mesh.colors, |hash, color| hash.floats(&color.to_array()));
    }
    hash.list(&scene.materials, |hash, of| {
        hash.floats(&of.base_color.to_array());
        hash.floats(&[of.metallic, of.roughness, of.normal_scale]);
        hash.floats(&of.emission.to_array());
        hash.number(of.double_sided.into());
        match of.alpha {
            AlphaMode::Opaque => hash.number(0),
            AlphaMode::Mask { cutoff } => {
                hash.number(1);
                hash.floats(&[cutoff]);
            }
        }
        for texture in [
            &of.base_color_texture,
            &of.metallic_roughness_texture,
            &of.normal_texture,
            &of.emission_texture,
        ] {
            texture_ref(hash, texture.as_ref());
        }
    });
    hash.list(&scene.textures, |hash, texture| {
        hash.number(texture.image as u64);
        for wrap in [texture.wrap_u, texture.wrap_v] {
            hash.number(match wrap {
                Wrap::Repeat => 0,
                Wrap::Mirror => 1,
                Wrap::Clamp => 2,
            });
        }
        hash.number((texture.filter == Filter::Nearest).into());
    });
    hash.list(&scene.images, |hash, image| {
        hash.number(image.width.into());
        hash.number(image.rgba.len() as u64);
        hash.0.update(bytemuck::cast_slice(&image.rgba));
    });
    hash.done()
}

fn texture_ref(hash: &mut Hash, of: Option<&TextureRef>) {
    hash.number(of.is_some().into());
    if let Some(of) = of {
        hash.number(of.texture as u64);
        hash.number(of.uv_set.into());
        hash.floats(&of.uv_from_mesh.to_cols_array());
    }
}
