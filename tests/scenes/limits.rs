// SPDX-License-Identifier: MIT OR Apache-2.0
//! Caps: each is met exactly, and refused one beyond.

use lucerna::scene::{
    ErrorKind, ImageError, LoadLimits, ResourceError, Scene, SceneError, Warning,
};

use crate::builder::{Builder, TRIANGLE, base64, textured};

fn setting(error: &SceneError) -> &'static str {
    match &error.kind {
        ErrorKind::TooMuch { setting, .. } => setting,
        _ => panic!("{error}"),
    }
}

fn instanced(n: usize) -> Vec<u8> {
    let mut b = Builder::default();
    b.floats(&TRIANGLE);
    let nodes = vec![r#"{"mesh":0}"#; n].join(",");
    b.gltf(&format!(
        r#""nodes":[{nodes}],"meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}}}}]}}]"#
    ))
}

#[test]
fn instances_and_triangles() {
    let file = instanced(5);
    for (max_instances, max_triangles, expected) in
        [(5, 5, None), (4, 5, Some("max_instances")), (5, 4, Some("max_triangles"))]
    {
        let limits = lucerna::settings!(LoadLimits {
            max_instances,
            max_triangles,
            ..LoadLimits::default()
        });
        let refused = Scene::from_gltf_slice(&file, None, &limits).err();
        assert_eq!(refused.as_ref().map(setting), expected);
    }
    let obj = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n";
    for (max_triangles, ok) in [(2, true), (1, false)] {
        let limits = lucerna::settings!(LoadLimits { max_triangles, ..LoadLimits::default() });
        assert_eq!(Scene::from_obj_slice(obj.as_bytes(), None, &limits).is_ok(), ok);
    }
}

/// The least `max_bytes` that loads.
fn needed(file: &[u8]) -> u64 {
    let loads = |max_bytes| {
        let limits = lucerna::settings!(LoadLimits { max_bytes, ..LoadLimits::default() });
        match Scene::from_gltf_slice(file, None, &limits) {
            Ok(_) => true,
            Err(error) => match error.kind {
                ErrorKind::Buffer { source: ResourceError::TooLong { .. }, .. } => false,
                _ => {
                    assert_eq!(setting(&error), "max_bytes");
                    false
                }
            },
        }
    };
    let (mut low, mut high) = (0, 1 << 20);
    while low + 1 < high {
        let middle = (low + high) / 2;
        if loads(middle) {
            high = middle;
        } else {
            low = middle;
        }
    }
    high
}

#[test]
fn bytes() {
    let with_vertices = |n: usize| {
        let mut b = Builder::default();
        b.floats(&[TRIANGLE[0], TRIANGLE[1], TRIANGLE[2]].repeat(n / 3));
        b.gltf(r#""nodes":[{"mesh":0}],"meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}]"#)
    };
    let (small, large) = (with_vertices(300), with_vertices(600));
    let text = (large.len() - small.len()) as u64;
    // The peak is where positions are converted. For each vertex: its text, 12 bytes in the buffer,
    // 12 taken from there, 12 in the mesh.
    assert_eq!(needed(&large) - needed(&small), text + 300 * 36);
}

#[test]
fn parsed_json_counts_before_it_is_parsed() {
    let nodes = vec!["{}"; 1000].join(",");
    let file = format!(r#"{{"asset":{{"version":"2.0"}},"nodes":[{nodes}]}}"#);
    for (max_bytes, ok) in [(1_000_000, false), (2_000_000, true)] {
        let limits = lucerna::settings!(LoadLimits { max_bytes, ..LoadLimits::default() });
        match Scene::from_gltf_slice(file.as_bytes(), None, &limits) {
            Ok(_) => assert!(ok),
            Err(error) => assert!(!ok && error.to_string().starts_with("JSON objects: ")),
        }
    }
}

#[test]
fn image_pixels() {
    let mut png = Vec::new();
    image::RgbaImage::new(4, 3)
        .write_to(&mut std::io::Cursor::new(&mut png), image::ImageFormat::Png)
        .unwrap();
    let file = textured(&format!(
        r#""images":[{{"uri":"data:;base64,{}"}}],"textures":[{{"source":0}}],
        "materials":[{{"emissiveTexture":{{"index":0}}}}]"#,
        base64(&png)
    ));
    for (max_image_pixels, n_warnings) in [(12, 0), (11, 1)] {
        let limits = lucerna::settings!(LoadLimits { max_image_pixels, ..LoadLimits::default() });
        let loaded = Scene::from_gltf_slice(&file, None, &limits).unwrap();
        assert_eq!(loaded.warnings.len(), n_warnings);
        if n_warnings == 1 {
            assert!(matches!(
                loaded.warnings[0],
                Warning::Image {
                    source: ImageError::TooLarge { width: 4, height: 3, limit: 11 },
                    ..
                }
            ));
        }
    }
}

#[test]
fn polygon_corners() {
    let mut obj = String::new();
    for i in 0..6 {
        let (sin, cos) = (i as f32).sin_cos();
        obj += &format!("v {cos} {sin} 0\n");
    }
    obj += "f 1 2 3 4 5 6\n";
    for (max_polygon_corners, n_warnings) in [(6, 0), (5, 1)] {
        let limits =
            lucerna::settings!(LoadLimits { max_polygon_corners, ..LoadLimits::default() });
        let loaded = Scene::from_obj_slice(obj.as_bytes(), None, &limits).unwrap();
        assert_eq!(loaded.scene.n_triangles(), 4);
        assert_eq!(loaded.warnings.len(), n_warnings);
    }
}

#[test]
fn warnings_are_capped() {
    let mut b = Builder::default();
    b.floats(&TRIANGLE);
    let node = r#"{"mesh":0,"scale":[0,0,0]}"#;
    let file = b.gltf(&format!(
        r#""nodes":[{}],"meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}}}}]}}]"#,
        vec![node; 3000].join(",")
    ));
    let loaded = Scene::from_gltf_slice(&file, None, &LoadLimits::default()).unwrap();
    assert_eq!(loaded.warnings.len(), 1001);
    // 3000 nodes and the scene without triangles.
    assert!(matches!(loaded.warnings[1000], Warning::More { n: 2001 }));
}
