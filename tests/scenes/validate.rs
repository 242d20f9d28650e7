// SPDX-License-Identifier: MIT OR Apache-2.0
//! `Scene::validate` finds each broken promise.

use glam::{Affine2, Affine3A, Vec2, Vec3, Vec4};
use lucerna::scene::{
    AlphaMode, Camera, Filter, Image, Instance, Light, Material, Mesh, Projection, Scene, Sky,
    Texture, TextureRef, Wrap,
};

/// A triangle with one of everything.
fn valid() -> Scene {
    Scene {
        origin: glam::DVec3::ZERO,
        meshes: vec![Mesh {
            name: "mesh".to_owned(),
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
            normals: vec![Vec3::Z; 3],
            tangents: vec![Vec4::new(1., 0., 0., -1.); 3],
            uv0: vec![Vec2::ZERO; 3],
            uv1: Vec::new(),
            colors: vec![Vec4::splat(2.0); 3],
            triangles: vec![[0, 1, 2]],
            material: 0,
        }],
        instances: vec![Instance {
            mesh: 0,
            world_from_object: Affine3A::from_scale(Vec3::new(-1., 2., 3.)),
        }],
        materials: vec![Material {
            base_color_texture: Some(TextureRef {
                texture: 0,
                uv_set: 0,
                uv_from_mesh: Affine2::IDENTITY,
            }),
            emission: Vec3::splat(1e6),
            ..Material::default()
        }],
        textures: vec![Texture {
            image: 0,
            wrap_u: Wrap::Repeat,
            wrap_v: Wrap::Repeat,
            filter: Filter::Linear,
        }],
        images: vec![Image { name: String::new(), width: 2, height: 1, rgba: vec![[0; 4]; 2] }],
        lights: vec![Light::Spot {
            position: Vec3::ZERO,
            direction: Vec3::NEG_Y,
            intensity: Vec3::ONE,
            inner: 0.0,
            outer: 0.5,
            range: Some(1.0),
        }],
        cameras: vec![Camera {
            name: "eye".to_owned(),
            position: Vec3::ZERO,
            forward: Vec3::NEG_Z,
            up: Vec3::Y,
            projection: Projection::Perspective { vertical_fov: 1.0 },
        }],
        sky: Sky::Image { width: 1, height: 2, rgb: vec![Vec3::ONE; 2] },
    }
}

type Case = (&'static str, fn(&mut Scene));

const CASES: &[Case] = &[
    ("meshes[0] (mesh): material out of range", |s| s.meshes[0].material = 1),
    ("no triangles", |s| s.meshes[0].triangles.clear()),
    ("vertex index out of range", |s| s.meshes[0].triangles[0][1] = 3),
    ("triangle without area", |s| s.meshes[0].positions[2] = Vec3::X),
    ("position not finite", |s| s.meshes[0].positions[1].y = f32::NAN),
    ("position not finite or beyond 1e9 m", |s| s.meshes[0].positions[1].x = 2e9),
    ("as many normals as positions", |s| s.meshes[0].normals.truncate(2)),
    ("normal not of unit length", |s| s.meshes[0].normals[0].z = 1.1),
    ("as many tangents as positions", |s| s.meshes[0].tangents.truncate(2)),
    ("tangent not of unit length, or its sign not ±1", |s| s.meshes[0].tangents[0].w = 0.0),
    ("as many texture coordinates as positions", |s| s.meshes[0].uv1 = vec![Vec2::ZERO]),
    ("texture coordinate not finite", |s| s.meshes[0].uv0[2].x = f32::INFINITY),
    ("does not have the texture coordinates that its material reads", |s| s.meshes[0].uv0.clear()),
    ("as many colours as positions", |s| s.meshes[0].colors.truncate(1)),
    ("colour negative or not finite", |s| s.meshes[0].colors[0].x = -0.5),
    ("instances[0]: mesh out of range", |s| s.instances[0].mesh = 1),
    ("transform not finite", |s| s.instances[0].world_from_object.translation.x = f32::NAN),
    ("transform keeps no areas", |s| {
        s.instances[0].world_from_object = Affine3A::from_scale(Vec3::new(1., 0., 0.));
    }),
    ("transform keeps no areas", |s| {
        s.instances[0].world_from_object = Affine3A::from_scale(Vec3::ZERO);
    }),
    ("instances[0]: reaches beyond 1e9 m", |s| {
        s.instances[0].world_from_object = Affine3A::from_scale(Vec3::splat(2e9));
    }),
    ("materials[0] (default): base colour not in 0..=1", |s| s.materials[0].base_color.w = 1.5),
    ("metallic not in 0..=1", |s| s.materials[0].metallic = f32::NAN),
    ("roughness not in 0..=1", |s| s.materials[0].roughness = -0.1),
    ("emission negative or not finite", |s| s.materials[0].emission.y = f32::INFINITY),
    ("normal scale not finite", |s| s.materials[0].normal_scale = f32::NAN),
    ("alpha cutoff negative or not finite", |s| {
        s.materials[0].alpha = AlphaMode::Mask { cutoff: f32::NAN };
    }),
    ("texture out of range", |s| s.textures.clear()),
    ("texture coordinate set not 0 or 1", |s| {
        s.materials[0].base_color_texture.as_mut().unwrap().uv_set = 2;
    }),
    ("texture transform not finite", |s| {
        let texture = s.materials[0].base_color_texture.as_mut().unwrap();
        texture.uv_from_mesh.translation.x = f32::NAN;
    }),
    ("textures[0]: image out of range", |s| s.images.clear()),
    ("images[0]: width · height", |s| s.images[0].width = 3),
    ("cone angles not 0 ≤ inner < outer ≤ π/2", |s| {
        if let Light::Spot { inner, .. } = &mut s.lights[0] {
            *inner = 0.5;
        }
    }),
    ("lights[0]: direction not of unit length", |s| {
        s.lights[0] = Light::Directional { direction: Vec3::splat(1.0), irradiance: Vec3::ONE };
    }),
    ("strength negative or not finite", |s| {
        s.lights[0] =
            Light::Point { position: Vec3::ZERO, intensity: Vec3::new(0., -1., 0.), range: None };
    }),
    ("range not positive", |s| {
        s.lights[0] = Light::Point { position: Vec3::ZERO, intensity: Vec3::ONE, range: Some(0.0) };
    }),
    ("cameras[0] (eye): position not finite", |s| s.cameras[0].position.x = f32::NAN),
    ("forward or up not of unit length", |s| s.cameras[0].up = Vec3::ZERO),
    ("up not orthogonal to forward", |s| s.cameras[0].up = Vec3::Z),
    ("field of view not in 0..π", |s| {
        s.cameras[0].projection = Projection::Perspective { vertical_fov: 0.0 };
    }),
    ("or height not positive", |s| {
        s.cameras[0].projection = Projection::Orthographic { half_height: -1.0 };
    }),
    ("sky[0]: width · height", |s| {
        s.sky = Sky::Image { width: 0, height: 0, rgb: Vec::new() };
    }),
    ("radiance negative or not finite", |s| s.sky = Sky::Constant(Vec3::splat(f32::NAN))),
];

#[test]
fn a_valid_scene_passes() {
    valid().validate().unwrap();
    // A sheet: the loader makes none, but a host may.
    let mut flat = valid();
    flat.instances[0].world_from_object = Affine3A::from_scale(Vec3::new(1., 1., 0.));
    flat.validate().unwrap();
    Scene::default().validate().unwrap();
}

#[test]
fn each_broken_promise_is_found() {
    let mut failures = Vec::new();
    for (expected, break_it) in CASES {
        let mut scene = valid();
        break_it(&mut scene);
        match scene.validate() {
            Err(error) if error.to_string().contains(expected) => {}
            found => failures.push(format!("{expected}: {found:?}")),
        }
    }
    assert!(failures.is_empty(), "\n{}", failures.join("\n"));
}
