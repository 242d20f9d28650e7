// SPDX-License-Identifier: MIT OR Apache-2.0
//! Things of one scene, placed in another.

use super::{Scene, TextureRef};
use glam::Affine3A;

impl Scene {
    /// Adds all instances of another scene, with their meshes, materials and textures. `world_from_other`: where they are placed. Lights, cameras and the sky of
    /// the other scene are left out; surfaces that emit light are not. The new instances are the last ones.
    pub fn place(&mut self, other: Self, world_from_other: Affine3A) {
        let (meshes, materials) = (self.meshes.len(), self.materials.len());
        let (textures, images) = (self.textures.len(), self.images.len());
        self.images.extend(other.images);
        self.textures.extend(other.textures.into_iter().map(|mut texture| {
            texture.image += images;
            texture
        }));
        self.materials.extend(other.materials.into_iter().map(|mut material| {
            let moved = |slot: &mut Option<TextureRef>| {
                slot.iter_mut().for_each(|of| of.texture += textures);
            };
            moved(&mut material.base_color_texture);
            moved(&mut material.metallic_roughness_texture);
            moved(&mut material.normal_texture);
            moved(&mut material.emission_texture);
            material
        }));
        self.meshes.extend(other.meshes.into_iter().map(|mut mesh| {
            mesh.material += materials;
            mesh
        }));
        self.instances.extend(other.instances.into_iter().map(|mut instance| {
            instance.mesh += meshes;
            instance.world_from_object = world_from_other * instance.world_from_object;
            instance
        }));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Filter, Image, Instance, Material, Mesh, Texture, Wrap};
    use glam::{Affine2, Vec2, Vec3};

    /// One of everything, all at index 0.
    fn whole(name: &str) -> Scene {
        let slot = TextureRef { texture: 0, uv_set: 0, uv_from_mesh: Affine2::IDENTITY };
        let material = Material {
            name: name.into(),
            base_color_texture: Some(slot.clone()),
            normal_texture: Some(slot),
            ..Material::default()
        };
        let mesh = Mesh {
            name: name.into(),
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
            uv0: vec![Vec2::ZERO, Vec2::X, Vec2::Y],
            triangles: vec![[0, 1, 2]],
            ..Mesh::default()
        };
        let wrap = Wrap::Repeat;
        let texture = Texture { image: 0, wrap_u: wrap, wrap_v: wrap, filter: Filter::Linear };
        Scene {
            meshes: vec![mesh],
            instances: vec![Instance {
                mesh: 0,
                world_from_object: Affine3A::from_translation(Vec3::Z),
            }],
            materials: vec![material],
            textures: vec![texture],
            images: vec![Image { name: name.into(), width: 1, height: 1, rgba: vec![[255; 4]] }],
            ..Scene::default()
        }
    }

    #[test]
    fn what_is_placed_keeps_its_parts() {
        let mut scene = whole("room");
        scene.place(whole("ball"), Affine3A::from_scale(Vec3::splat(2.0)));
        scene.place(whole("box"), Affine3A::from_translation(Vec3::X));
        let expected =
            [("room", Vec3::Z), ("ball", 2.0 * Vec3::Z), ("box", Vec3::new(1.0, 0.0, 1.0))];
        for (ix, (instance, (name, at))) in scene.instances.iter().zip(expected).enumerate() {
            let mesh = &scene.meshes[instance.mesh];
            let material = &scene.materials[mesh.material];
            assert_eq!([&mesh.name, &material.name], [name; 2], "instance {ix}");
            let slots = [&material.base_color_texture, &material.normal_texture];
            for slot in slots {
                let texture = slot.as_ref().unwrap().texture;
                assert_eq!((texture, scene.textures[texture].image), (ix, ix), "{name}");
            }
            let place = instance.world_from_object.translation;
            assert!((Vec3::from(place) - at).length() < 1e-6, "{name} is at {place}");
        }
    }
}
