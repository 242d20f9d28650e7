// SPDX-License-Identifier: MIT OR Apache-2.0
//! Nodes that flatten their meshes.

use std::f32::consts::FRAC_PI_6;

use glam::Vec3;
use lucerna::scene::{Loaded, Scene};

use crate::builder::{Builder, TRIANGLE};
use crate::{load_clean, load_gltf};

/// In z = 1: a triangle of area 1/2 that faces +Z, with normals that lean by 45° to +X.
fn leaning(nodes: &str) -> Vec<u8> {
    let mut b = Builder::default();
    b.floats(&TRIANGLE.map(|[x, y, _]| [x, y, 1.0]));
    b.floats(&[[0.5f32.sqrt(), 0., 0.5f32.sqrt()]; 3]);
    b.floats(&[[0., 1., 0., -1.]; 3]);
    b.gltf(&format!(
        r#""scene":0,"scenes":[{{"nodes":[0]}}],"nodes":[{nodes}],"meshes":[{{"primitives":[
            {{"attributes":{{"POSITION":0,"NORMAL":1,"TANGENT":2}}}}]}}]"#
    ))
}

/// Area vector of the only triangle in the world.
fn area(scene: &Scene) -> Vec3 {
    let instance = &scene.instances[0];
    let mesh = &scene.meshes[instance.mesh];
    let [a, b, c] = mesh.triangles[0]
        .map(|i| instance.world_from_object.transform_point3(mesh.positions[i as usize]));
    (b - a).cross(c - a) / 2.0
}

#[track_caller]
fn near(a: Vec3, b: Vec3) {
    assert!((a - b).abs().max_element() <= 1e-6, "{a} is not {b}");
}

#[test]
fn a_sheet_keeps_its_front() {
    // Scales of 0 count as positive, so that [−1, 1, 0] mirrors as [−1, 1, 1] does.
    for scale in ["1,1,0", "1,1,-0.0", "-1,1,0", "-1,-1,0"] {
        let file = leaning(&format!(r#"{{"mesh":0,"scale":[{scale}],"translation":[0,0,5]}}"#));
        let scene = load_clean(&file);
        near(area(&scene), Vec3::new(0., 0., 0.5));
        // What leaned to x would lie in the sheet: only the triangle's own normal is left.
        assert!(scene.meshes[scene.instances[0].mesh].normals.is_empty());
        assert_eq!(scene.bounds().unwrap().0.z, 5.0, "{scale}");
    }
}

#[test]
fn a_sheet_under_turned_nodes() {
    // Turned by 60° about Y, flattened along Z, turned by 60° about X: no column is 0.
    let (sin, cos) = FRAC_PI_6.sin_cos();
    let file = leaning(&format!(
        r#"{{"rotation":[{sin},0,0,{cos}],"children":[1]}},{{"scale":[1,1,0],"children":[2]}},
        {{"rotation":[0,{sin},0,{cos}],"mesh":0}}"#
    ));
    let scene = load_clean(&file);
    // x shrinks to cos 60°; the sheet's +Z becomes (0, −sin 60°, cos 60°).
    let front = Vec3::new(0., -(2. * FRAC_PI_6).sin(), (2. * FRAC_PI_6).cos());
    near(area(&scene), 0.25 * front);
}

/// A cube of 8 vertices with smooth normals.
fn ball(node: &str) -> Loaded {
    let corners: Vec<[f32; 3]> =
        (0..8).map(|i| [0, 1, 2].map(|axis| if i >> axis & 1 == 0 { -1. } else { 1. })).collect();
    let mut b = Builder::default();
    b.floats(&corners);
    b.floats(&corners);
    let quads =
        [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let indices: Vec<u16> = quads.iter().flat_map(|&[a, b, c, d]| [a, b, c, a, c, d]).collect();
    b.indices(&indices);
    load_gltf(&b.gltf(&format!(
        r#""nodes":[{{"mesh":0{node}}},{{"mesh":0}}],"meshes":[{{"primitives":[
            {{"attributes":{{"POSITION":0,"NORMAL":1}},"indices":2}}]}}]"#
    )))
}

#[test]
fn only_what_loses_its_area_is_dropped() {
    let loaded = ball(r#","scale":[1,1,0]"#);
    let counts: Vec<_> = loaded
        .scene
        .instances
        .iter()
        .map(|instance| loaded.scene.meshes[instance.mesh].triangles.len())
        .collect();
    // The other node's mesh stays whole.
    assert_eq!(counts, [4, 12]);
    let shown: Vec<_> = loaded.warnings.iter().map(|w| w.to_string()).collect();
    assert_eq!(shown, ["meshes[0].primitives[0] at nodes[0]: 8 triangle(s) dropped: zero area"]);
}

#[test]
fn lines_and_points_are_left_out() {
    for scale in ["1,0,0", "0,0,0", "1e-20,0,0", "0,-0.0,3"] {
        let loaded = ball(&format!(r#","scale":[{scale}]"#));
        assert_eq!(loaded.scene.instances.len(), 1, "{scale}");
        let shown: Vec<_> = loaded.warnings.iter().map(|w| w.to_string()).collect();
        assert_eq!(
            shown,
            ["nodes[0]: its transform flattens the mesh (singular matrix); mesh left out"]
        );
    }
}
