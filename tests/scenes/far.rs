// SPDX-License-Identifier: MIT OR Apache-2.0
//! Scenes far from their origin: the same as near it, but for `Scene::origin`.

use crate::builder::Builder;
use glam::{DVec3, Vec3};
use lucerna::scene::{LoadLimits, Scene};
use std::path::Path;

fn load(file: &str) -> Scene {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/cases").join(file);
    Scene::load(&path, &LoadLimits::default()).unwrap().scene
}

/// All corners in the order of the file [m].
fn corners(scene: &Scene) -> Vec<Vec3> {
    scene
        .instances
        .iter()
        .flat_map(|instance| {
            let mesh = &scene.meshes[instance.mesh];
            mesh.triangles
                .iter()
                .flatten()
                .map(|&ix| instance.world_from_object.transform_point3(mesh.positions[ix as usize]))
        })
        .collect()
}

#[test]
fn a_gltf_room_far_away_is_the_room_at_the_origin() {
    let near = load("invariance/base.gltf");
    let far = load("invariance/far_1048576.gltf");
    assert_eq!(near.origin, DVec3::ZERO);
    assert_eq!(far.origin, DVec3::new(1_048_576.0, 0.0, 0.0));
    assert_eq!(corners(&far), corners(&near));
    assert_eq!(far.cameras[0].position, near.cameras[0].position);
    far.validate().unwrap();
    // What lies beside or around a room, however far, does not move it.
    for file in ["stray/ground_1e3.gltf", "stray/stray_1e6.gltf"] {
        assert_eq!(load(file).origin, DVec3::ZERO, "{file}");
    }
}

/// Vertices with more digits than 32-bit floats have, as maps give them, keep them: to 2⁻²⁴ of the house's size, and the
/// double rounding.
#[test]
fn an_obj_house_on_a_map_keeps_its_digits() {
    let place = DVec3::new(500_123.0, 4_649_776.0, 102.0);
    let offsets =
        [[0.001, 0.0, 0.0], [10.003, 0.002, 0.0], [10.003, 7.998, 3.001], [0.001, 7.998, 3.0]];
    let mut text = String::new();
    for [x, y, z] in offsets {
        let v = place + DVec3::new(x, y, z);
        text += &format!("v {:.4} {:.4} {:.4}\n", v.x, v.y, v.z);
    }
    text += "f 1 2 3\nf 1 3 4\n";
    let scene = Scene::from_obj_slice(text.as_bytes(), None, &LoadLimits::default()).unwrap().scene;
    assert!((scene.origin - place).truncate().abs().max_element() < 20.0, "{}", scene.origin);
    assert_eq!(scene.origin.z, 0.0, "102 m is not far");
    for (found, ix) in corners(&scene).into_iter().zip([0, 1, 2, 0, 2, 3]) {
        let expected = place + DVec3::from_array(offsets[ix]) - scene.origin;
        assert!((found.as_dvec3() - expected).length() < 2e-5, "{found} for {expected}");
    }
}

/// A mesh that stands far from its own origin and is turned back: its node's matrix and its vertices are both far.
#[test]
fn a_mesh_far_from_its_own_origin_keeps_its_shape() {
    let (far, one) = (1_000_000.0f32, 1.0f32);
    let mut builder = Builder::default();
    builder.floats(&[[far, 0.0, 0.0], [far + one, 0.0, 0.0], [far, one, 0.0]]);
    // A turn by 30° about z, and the place where that brings the first corner back to (0, 0, 0).
    let (sin, cos) = 15f64.to_radians().sin_cos();
    let (x, y) = (-1e6 * 30f64.to_radians().cos(), -1e6 * 30f64.to_radians().sin());
    let bytes = builder.gltf(&format!(
        r#""scene":0,"scenes":[{{"nodes":[0]}}],
        "nodes":[{{"mesh":0,"rotation":[0,0,{sin},{cos}],"translation":[{x},{y},0]}}],
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}}}}]}}]"#
    ));
    let scene = Scene::from_gltf_slice(&bytes, None, &LoadLimits::default()).unwrap().scene;
    let [a, b, c] = corners(&scene)[..] else { panic!("one triangle") };
    // The file's translation is itself rounded to 6 cm; the shape is not.
    assert!(a.length() < 0.1, "{a}");
    assert!(((b - a).length() - 1.0).abs() < 1e-5 && ((c - a).length() - 1.0).abs() < 1e-5);
    assert!((b - a).dot(c - a).abs() < 1e-5);
}
