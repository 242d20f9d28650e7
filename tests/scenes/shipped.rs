// SPDX-License-Identifier: MIT OR Apache-2.0
//! The scenes in `fixtures/scenes`.

use glam::{Vec3, Vec4};
use lucerna::scene::{LoadLimits, Projection, Scene};

use crate::fixture;

fn load(name: &str) -> Scene {
    let loaded = Scene::load(&fixture("scenes").join(name), &LoadLimits::default()).unwrap();
    assert!(loaded.warnings.is_empty(), "{:?}", loaded.warnings);
    loaded.scene.validate().unwrap();
    loaded.scene
}

#[track_caller]
fn near(a: Vec3, b: Vec3, tolerance: f32) {
    assert!((a - b).abs().max_element() <= tolerance, "{a} is not {b}");
}

#[test]
fn cornell_as_gltf() {
    let scene = load("cornell_original/cornell_original.gltf");
    assert_eq!(scene.n_triangles(), 32);
    let (min, max) = scene.bounds().unwrap();
    near(min, Vec3::ZERO, 0.0);
    near(max, Vec3::new(5.56, 5.488, 5.592), 1e-5);
    let light = scene.materials.iter().find(|m| m.name == "light").unwrap();
    near(light.emission, Vec3::new(18.387, 13.9873, 6.75357), 1e-4);
    let camera = &scene.cameras[0];
    assert_eq!(camera.name, "cam");
    near(camera.position, Vec3::new(2.78, 2.73, -8.0), 1e-6);
    near(camera.forward, Vec3::Z, 1e-6);
    near(camera.up, Vec3::Y, 1e-6);
    assert_eq!(camera.projection, Projection::Perspective { vertical_fov: 0.686_048_8 });
}

#[test]
fn cornell_as_obj() {
    let scene = load("cornell_original/cornell_original.obj");
    assert_eq!(scene.n_triangles(), 32);
    let (min, max) = scene.bounds().unwrap();
    near(min, Vec3::ZERO, 0.0);
    near(max, Vec3::new(556.0, 548.8, 559.2), 1e-3);
    let material = |name: &str| scene.materials.iter().find(|m| m.name == name).unwrap();
    assert_eq!(material("light").emission, Vec3::new(18.387, 13.9873, 6.75357));
    assert_eq!(material("red").base_color, Vec4::new(0.570068, 0.0430135, 0.0443706, 1.0));
    // Ceiling light: 130 mm × 105 mm, faces down.
    let mesh = scene.meshes.iter().find(|m| m.name == "light").unwrap();
    let normals: Vec3 = mesh
        .triangles
        .iter()
        .map(|t| {
            let [a, b, c] = t.map(|i| mesh.positions[i as usize]);
            (b - a).cross(c - a) / 2.0
        })
        .sum();
    near(normals, Vec3::new(0.0, -130.0 * 105.0, 0.0), 0.1);
}

#[test]
fn khronos_samples() {
    let scene = load("khronos/SimpleMeshes.gltf");
    assert_eq!((scene.meshes.len(), scene.instances.len()), (1, 2));
    near(scene.bounds().unwrap().1, Vec3::new(2.0, 1.0, 0.0), 0.0);

    // A strip of 7 × 2 vertices of which three are moved up by sparse values.
    let scene = load("khronos/SimpleSparseAccessor/SimpleSparseAccessor.gltf");
    assert_eq!(scene.n_triangles(), 12);
    near(scene.bounds().unwrap().1, Vec3::new(6.0, 4.0, 0.0), 0.0);

    let scene = load("khronos/TriangleWithoutIndices.gltf");
    assert_eq!(scene.n_triangles(), 1);

    let scene = load("khronos/Cameras.gltf");
    let projections: Vec<_> = scene.cameras.iter().map(|c| c.projection).collect();
    assert_eq!(
        projections,
        [
            Projection::Perspective { vertical_fov: 0.7 },
            Projection::Orthographic { half_height: 1.0 }
        ]
    );
    near(scene.cameras[0].position, Vec3::new(0.5, 0.5, 3.0), 0.0);
    near(scene.cameras[0].forward, Vec3::NEG_Z, 0.0);
}
