// SPDX-License-Identifier: MIT OR Apache-2.0
//! Images and the files that hold them.

use std::io::Cursor;

use image::{DynamicImage, ImageBuffer, ImageFormat, Luma, Rgb, Rgba};
use lucerna::scene::{ErrorKind, LoadLimits, ResourceError, Scene};

use crate::builder::{Builder, TRIANGLE, base64, le_bytes, textured};
use crate::{TempDir, load_clean};

fn encode(image: impl Into<DynamicImage>, format: ImageFormat) -> Vec<u8> {
    let mut bytes = Vec::new();
    image.into().write_to(&mut Cursor::new(&mut bytes), format).unwrap();
    bytes
}

/// The file's texels once through the loader.
fn through(bytes: &[u8]) -> (u32, u32, Vec<[u8; 4]>) {
    let scene = load_clean(&textured(&format!(
        r#""images":[{{"uri":"data:;base64,{}"}}],"textures":[{{"source":0}}],
        "materials":[{{"emissiveTexture":{{"index":0}}}}]"#,
        base64(bytes)
    )));
    let image = &scene.images[0];
    (image.width, image.height, image.rgba.clone())
}

#[test]
fn png_of_all_kinds() {
    let grey = ImageBuffer::<Luma<u8>, _>::from_raw(2, 1, vec![7, 200]).unwrap();
    assert_eq!(
        through(&encode(grey, ImageFormat::Png)),
        (2, 1, vec![[7, 7, 7, 255], [200, 200, 200, 255]])
    );
    // 16 bits are rounded: v · 255 / 65535.
    let deep = ImageBuffer::<Rgba<u16>, _>::from_raw(
        1,
        2,
        vec![0, 65535, 257 * 9, 257 * 9 + 200, 128, 129, 32767, 1],
    )
    .unwrap();
    assert_eq!(
        through(&encode(deep, ImageFormat::Png)),
        (1, 2, vec![[0, 255, 9, 10], [0, 1, 127, 0]])
    );
}

#[test]
fn jpeg() {
    let flat = ImageBuffer::from_pixel(16, 8, Rgb([200u8, 100, 50]));
    let (width, height, texels) = through(&encode(flat, ImageFormat::Jpeg));
    assert_eq!((width, height), (16, 8));
    for texel in texels {
        for (found, expected) in texel.iter().zip([200u8, 100, 50, 255]) {
            assert!(found.abs_diff(expected) <= 3, "{texel:?}");
        }
    }
}

#[test]
fn an_image_in_the_binary_chunk() {
    let grey = ImageBuffer::<Luma<u8>, _>::from_raw(1, 1, vec![77]).unwrap();
    let mut b = Builder::default();
    b.floats(&TRIANGLE);
    b.floats(&[[0., 0.], [1., 0.], [0., 1.]]);
    let view = b.view(&encode(grey, ImageFormat::Png), "");
    let scene = load_clean(&b.glb(&format!(
        r#""images":[{{"bufferView":{view},"mimeType":"image/png"}}],"textures":[{{"source":0}}],
        "materials":[{{"emissiveTexture":{{"index":0}}}}],"nodes":[{{"mesh":0}}],
        "meshes":[{{"primitives":[{{"material":0,"attributes":{{"POSITION":0,"TEXCOORD_0":1}}}}]}}]"#
    )));
    assert_eq!(scene.images[0].rgba, [[77, 77, 77, 255]]);
}

/// A triangle whose buffer is the file that `uri` names.
fn with_buffer(uri: &str) -> String {
    format!(
        r#"{{"asset":{{"version":"2.0"}},"buffers":[{{"byteLength":36,"uri":"{uri}"}}],
        "bufferViews":[{{"buffer":0,"byteLength":36}}],
        "accessors":[{{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}}],
        "nodes":[{{"mesh":0}}],"meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}}}}]}}]}}"#
    )
}

#[test]
fn files_beside_and_below_the_scene() {
    let folder = TempDir::new("beside");
    let bytes = le_bytes(&TRIANGLE);
    std::fs::create_dir(folder.0.join("sub")).unwrap();
    std::fs::write(folder.0.join("my data.bin"), &bytes).unwrap();
    std::fs::write(folder.0.join("sub/ä.bin"), &bytes).unwrap();
    for uri in [
        "my data.bin",
        "my%20data.bin",
        "./my%20data.bin",
        "sub/../my%20data.bin",
        "sub/%C3%A4.bin",
        "sub\\\\ä.bin",
    ] {
        let path = folder.0.join("scene.GLTF");
        std::fs::write(&path, with_buffer(uri)).unwrap();
        let loaded = Scene::load(&path, &LoadLimits::default()).unwrap();
        assert_eq!(loaded.scene.n_triangles(), 1, "{uri}");
    }
}

#[cfg(unix)]
#[test]
fn links_must_stay_inside() {
    let outer = TempDir::new("links");
    let inner = outer.0.join("scene");
    std::fs::create_dir(&inner).unwrap();
    let bytes = le_bytes(&TRIANGLE);
    std::fs::write(outer.0.join("secret.bin"), &bytes).unwrap();
    std::fs::write(inner.join("data.bin"), &bytes).unwrap();
    std::os::unix::fs::symlink("../secret.bin", inner.join("out.bin")).unwrap();
    std::os::unix::fs::symlink("data.bin", inner.join("in.bin")).unwrap();
    let load = |uri: &str| {
        let path = inner.join("scene.gltf");
        std::fs::write(&path, with_buffer(uri)).unwrap();
        Scene::load(&path, &LoadLimits::default())
    };
    assert_eq!(load("in.bin").unwrap().scene.n_triangles(), 1);
    let error = load("out.bin").unwrap_err();
    assert!(
        matches!(
            error.kind,
            ErrorKind::Buffer { buffer: 0, source: ResourceError::Outside { .. } }
        ),
        "{error}"
    );
}

#[test]
fn bytes_without_a_folder_name_no_files() {
    let file = with_buffer("data.bin");
    let error = Scene::from_gltf_slice(file.as_bytes(), None, &LoadLimits::default()).unwrap_err();
    assert!(error.to_string().contains("without a folder"), "{error}");
}
