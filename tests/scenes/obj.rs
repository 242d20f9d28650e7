// SPDX-License-Identifier: MIT OR Apache-2.0
//! OBJ and MTL, feature by feature.

use glam::{Vec2, Vec3, Vec4};
use image::{ImageFormat, RgbaImage};
use lucerna::scene::{AlphaMode, LoadLimits, Loaded, Scene, Wrap};

use crate::{TempDir, load_obj};

const QUAD: &str = "v 0 0 0\nv 2 0 0\nv 2 1 0\nv 0 1 0\n";

/// Areas along +Z of all triangles, summed.
fn area(scene: &Scene) -> f32 {
    scene
        .meshes
        .iter()
        .flat_map(|mesh| {
            mesh.triangles.iter().map(|t| {
                let [a, b, c] = t.map(|i| mesh.positions[i as usize]);
                (b - a).cross(c - a).z / 2.0
            })
        })
        .sum()
}

fn clean(text: &str) -> Scene {
    let loaded = load_obj(text);
    assert!(loaded.warnings.is_empty(), "{:?}", loaded.warnings);
    loaded.scene
}

#[test]
fn a_quad() {
    let scene = clean(&format!("{QUAD}f 1 2 3 4\n"));
    assert_eq!(scene.n_triangles(), 2);
    assert_eq!(area(&scene), 2.0);
    assert_eq!(scene.bounds(), Some((Vec3::ZERO, Vec3::new(2., 1., 0.))));
    let mesh = &scene.meshes[0];
    assert!(mesh.normals.is_empty() && mesh.uv0.is_empty() && mesh.colors.is_empty());
    let material = &scene.materials[mesh.material];
    assert_eq!((material.metallic, material.roughness), (0.0, 1.0));
}

#[test]
fn negative_indices_count_back() {
    let scene = clean(&format!("{QUAD}f -4 -3 -2 -1\nv 9 9 9\n"));
    assert_eq!(area(&scene), 2.0);
}

#[test]
fn faces_may_stand_before_their_vertices() {
    assert_eq!(area(&clean(&format!("f 1 2 3 4\n{QUAD}"))), 2.0);
}

#[test]
fn concave_polygons() {
    // An L of area 3.
    let l = "v 0 0 0\nv 2 0 0\nv 2 1 0\nv 1 1 0\nv 1 2 0\nv 0 2 0\nf 1 2 3 4 5 6\n";
    let scene = clean(l);
    assert_eq!((scene.n_triangles(), area(&scene)), (4, 3.0));
    // A quad whose diagonal 1–3 lies outside: area 3; a fan would give triangles of 4 and −1.
    let dart = "v 0 0 0\nv 1 1 0\nv 2 0 0\nv 1 4 0\nf 1 2 3 4\n";
    let scene = clean(dart);
    assert_eq!((scene.n_triangles(), area(&scene)), (2, 3.0));
    for t in &scene.meshes[0].triangles {
        let [a, b, c] = t.map(|i| scene.meshes[0].positions[i as usize]);
        assert!((b - a).cross(c - a).z > 0.0);
    }
}

#[test]
fn attributes_per_corner() {
    let scene = clean(&format!(
        "{QUAD}vt 0 0\nvt 1 0.25\nvn 0 0 3\nf 1/1/1 2/2/1 3/2/1\nf 1/2/1 3/2/1 4/1/1\n"
    ));
    let mesh = &scene.meshes[0];
    assert_eq!(mesh.triangles.len(), 2);
    // Corner 1 has two texture coordinates, so it is two vertices.
    assert_eq!(mesh.positions.len(), 5);
    assert!(mesh.normals.iter().all(|&n| n == Vec3::Z));
    let uv = |t: usize, c: usize| mesh.uv0[mesh.triangles[t][c] as usize];
    // v is turned over.
    assert_eq!(uv(0, 0), Vec2::new(0., 1.));
    assert_eq!(uv(0, 1), Vec2::new(1., 0.75));
    assert_eq!(uv(1, 0), Vec2::new(1., 0.75));
}

#[test]
fn faces_with_and_without_normals() {
    let loaded = load_obj(&format!("{QUAD}vn 0 1 0\nf 1//1 2//1 3//1\nf 1 3 4\n"));
    let mesh = &loaded.scene.meshes[0];
    let normal = |t: usize, c: usize| mesh.normals[mesh.triangles[t][c] as usize];
    assert_eq!(normal(0, 0), Vec3::Y);
    assert_eq!(normal(1, 0), Vec3::Z);
    // In objects of their own, the one without stays flat.
    let scene = clean(&format!("{QUAD}vn 0 1 0\no a\nf 1//1 2//1 3//1\no b\nf 1 3 4\n"));
    assert_eq!(scene.meshes[0].normals.len(), 3);
    assert!(scene.meshes[1].normals.is_empty());
}

#[test]
fn vertex_colors_and_weights() {
    let scene = clean("v 0 0 0 1 0 0\nv 1 0 0 0 1 0\nv 0 1 0 0 0 0.5\nf 1 2 3\n");
    assert_eq!(scene.meshes[0].colors[2], Vec4::new(0., 0., 0.5, 1.));
    let scene = clean("v 0 0 0 2\nv 2 0 0 2\nv 0 2 0 2\nf 1 2 3\n");
    assert_eq!(scene.bounds().unwrap().1, Vec3::new(1., 1., 0.));
}

#[test]
fn comments_continuations_and_carriage_returns() {
    let scene = clean("# x\r\nv 0 0 0 # first\r\nv 1 0 \\\r\n0\r\nv 0 1 0\r\n\r\nf 1 2 \\\n3\r\n");
    assert_eq!(scene.n_triangles(), 1);
}

/// Writes files into a folder of their own and loads `scene.obj`.
fn load_folder(name: &str, files: &[(&str, &[u8])]) -> Loaded {
    let folder = TempDir::new(name);
    for (name, bytes) in files {
        std::fs::write(folder.0.join(name), bytes).unwrap();
    }
    let loaded = Scene::load(&folder.0.join("scene.obj"), &LoadLimits::default()).unwrap();
    loaded.scene.validate().unwrap();
    loaded
}

fn png(width: u32, height: u32, texels: &[[u8; 4]]) -> Vec<u8> {
    let mut bytes = Vec::new();
    RgbaImage::from_raw(width, height, texels.concat())
        .unwrap()
        .write_to(&mut std::io::Cursor::new(&mut bytes), ImageFormat::Png)
        .unwrap();
    bytes
}

fn with_mtl(name: &str, mtl: &str) -> Loaded {
    let obj = format!("mtllib a b.mtl\n{QUAD}vt 0 0\nusemtl m x\nf 1/1 2/1 3/1 4/1\n");
    let red = png(2, 1, &[[255, 0, 0, 255], [0, 255, 0, 255]]);
    let mask = png(1, 2, &[[255, 255, 255, 255], [10, 10, 10, 255]]);
    load_folder(
        name,
        &[
            ("scene.obj", obj.as_bytes()),
            ("a b.mtl", mtl.as_bytes()),
            ("red.png", &red),
            ("mask.png", &mask),
        ],
    )
}

#[test]
fn material_values() {
    let loaded = with_mtl("values", "newmtl m x\nKd 0.5 0.25 0.125\nKe 3 2 1\nKs 1 1 1\nNs 30\n");
    assert!(loaded.warnings.is_empty(), "{:?}", loaded.warnings);
    let m = &loaded.scene.materials[loaded.scene.meshes[0].material];
    assert_eq!(m.name, "m x");
    assert_eq!(m.base_color, Vec4::new(0.5, 0.25, 0.125, 1.));
    assert_eq!(m.emission, Vec3::new(3., 2., 1.));
    assert_eq!(m.alpha, AlphaMode::Opaque);
    // (2 / 32)^¼ = 1/2.
    assert_eq!((m.metallic, m.roughness), (0.0, 0.5));

    let roughness = |name, mtl: &str| with_mtl(name, mtl).scene.materials[0].roughness;
    assert_eq!(roughness("black", "newmtl m x\nKs 0 0 0\nNs 30\n"), 1.0);
    assert_eq!(roughness("pbr", "newmtl m x\nNs 30\nPr 0.75\nPm 1\n"), 0.75);
    assert_eq!(roughness("none", "newmtl m x\n"), 1.0);
}

#[test]
fn opacity_is_a_mask() {
    for (name, mtl) in [("d", "newmtl m x\nd 0.25\n"), ("tr", "newmtl m x\nTr 0.75\n")] {
        let loaded = with_mtl(name, mtl);
        let m = &loaded.scene.materials[0];
        assert_eq!(m.base_color.w, 0.25, "{name}");
        assert_eq!(m.alpha, AlphaMode::Mask { cutoff: 0.5 }, "{name}");
        assert_eq!(loaded.warnings.len(), 1, "{name}");
    }
}

#[test]
fn map_kd_with_map_d() {
    let loaded = with_mtl("maps", "newmtl m x\nmap_Kd -clamp on red.png\nmap_d mask.png\n");
    assert!(loaded.warnings.is_empty(), "{:?}", loaded.warnings);
    let m = &loaded.scene.materials[0];
    assert_eq!(m.alpha, AlphaMode::Mask { cutoff: 0.5 });
    let texture = &loaded.scene.textures[m.base_color_texture.as_ref().unwrap().texture];
    assert_eq!(texture.wrap_u, Wrap::Clamp);
    // The colour's grid; the mask is grey, so its brightness counts; of its two rows the first.
    assert_eq!(loaded.scene.images[texture.image].rgba, [[255, 0, 0, 255], [0, 255, 0, 255]]);

    let loaded = with_mtl("mask", "newmtl m x\nmap_d mask.png\n");
    let m = &loaded.scene.materials[0];
    let texture = &loaded.scene.textures[m.base_color_texture.as_ref().unwrap().texture];
    assert_eq!(loaded.scene.images[texture.image].rgba, [[255; 4], [255, 255, 255, 10]]);
}

#[test]
fn a_map_that_is_missing_is_white() {
    let loaded = with_mtl("missing", "newmtl m x\nmap_Kd nowhere.tga\n");
    let shown = loaded.warnings[0].to_string();
    assert!(shown.contains("nowhere.tga"), "{shown}");
    assert_eq!(loaded.scene.images[0].rgba, [[255; 4]]);
}

#[test]
fn one_mesh_per_object_and_material() {
    let scene = load_folder(
        "merge",
        &[
            (
                "scene.obj",
                format!(
                    "mtllib m.mtl\n{QUAD}usemtl a\nf 1 2 3\nusemtl b\nf 1 3 4\nusemtl a\nf 2 3 4\n"
                )
                .as_bytes(),
            ),
            ("m.mtl", b"newmtl a\nKd 1 0 0\nnewmtl b\nKd 0 1 0\n"),
        ],
    )
    .scene;
    let sizes: Vec<_> = scene.meshes.iter().map(|m| m.triangles.len()).collect();
    assert_eq!(sizes, [2, 1]);
    let color = |i: usize| scene.materials[scene.meshes[i].material].base_color;
    assert_eq!(color(0), Vec4::new(1., 0., 0., 1.));
    assert_eq!(color(1), Vec4::new(0., 1., 0., 1.));
}
