// SPDX-License-Identifier: MIT OR Apache-2.0
//! `fixtures/cases`: files as programs write them, odd but readable, each by what it must give.

use glam::{Vec3, Vec4};
use lucerna::scene::{LoadLimits, Loaded, Scene};

use crate::fixture;

fn load(name: &str) -> Loaded {
    let loaded = Scene::load(&fixture("cases").join(name), &LoadLimits::default()).unwrap();
    loaded.scene.validate().unwrap();
    loaded
}

fn shown(loaded: &Loaded) -> Vec<String> {
    loaded.warnings.iter().map(|w| w.to_string()).collect()
}

/// Loads a file that gives no warning.
#[track_caller]
fn clean(name: &str) -> Scene {
    let loaded = load(name);
    assert!(loaded.warnings.is_empty(), "{name}: {:#?}", shown(&loaded));
    loaded.scene
}

/// Loads a file that gives exactly these warnings (parts of their texts, in order).
#[track_caller]
fn warned(name: &str, expected: &[&str]) -> Scene {
    let loaded = load(name);
    let found = shown(&loaded);
    let fits = found.len() == expected.len()
        && found.iter().zip(expected).all(|(found, expected)| found.contains(expected));
    assert!(fits, "{name}: {found:#?}, expected {expected:#?}");
    loaded.scene
}

/// The material of the first mesh.
fn base_color(scene: &Scene) -> Vec4 {
    scene.materials[scene.meshes[0].material].base_color
}

/// The quad that most of the files hold: 2 × 2 m, 3 m in front of the origin.
#[track_caller]
fn is_quad(scene: &Scene) {
    assert_eq!(scene.n_triangles(), 2);
    assert_eq!(scene.bounds(), Some((Vec3::new(-1., -1., -3.), Vec3::new(1., 1., -3.))));
}

const BLUE: Vec4 = Vec4::new(0.1, 0.1, 0.8, 1.0);
const RED: Vec4 = Vec4::new(0.8, 0.1, 0.1, 1.0);

#[test]
fn a_byte_order_mark_costs_no_line() {
    is_quad(&clean("obj_odd/nobom_shift.obj"));
    is_quad(&clean("obj_odd/bom_shift.obj"));
    let scene = clean("obj_odd/bom_crlf.obj");
    is_quad(&scene);
    assert_eq!(base_color(&scene), BLUE);
}

#[test]
fn lines_may_end_in_a_carriage_return_alone() {
    is_quad(&clean("obj_odd/cr_only.obj"));
}

#[test]
fn decimal_commas_are_read_and_named() {
    is_quad(&warned("obj_odd/comma.obj", &["line 1: decimal comma, read as a point (4 in total)"]));
}

#[test]
fn a_comment_after_a_materials_name() {
    let scene = clean("obj_odd/com.obj");
    assert_eq!(base_color(&scene), RED);
    assert_eq!(scene.materials[0].name, "red");
}

#[test]
fn file_names_that_differ_in_case() {
    let expected = "mtllib M.MTL: named `M.MTL`, but the file is called `m.mtl`; it is read";
    let warnings: &[&str] = if fixture("cases/obj_odd/M.MTL").exists() { &[] } else { &[expected] };
    assert_eq!(base_color(&warned("obj_odd/upper.obj", warnings)), BLUE);
}

#[test]
fn a_library_may_be_named_last() {
    assert_eq!(base_color(&clean("obj_odd/late_mtllib.obj")), BLUE);
}

#[test]
fn two_libraries_on_one_line() {
    for name in ["mtllib_two/one_each.obj", "mtllib_two/two.obj"] {
        let scene = clean(name);
        assert_eq!(base_color(&scene), RED, "{name}");
        let lamp = scene.meshes[1].material;
        assert_eq!(scene.materials[lamp].emission, Vec3::splat(2.0), "{name}");
    }
}

#[test]
fn textures_lie_beside_their_library() {
    let scene = clean("mtl_subfolder/a.obj");
    assert_eq!(scene.images.len(), 1);
    assert!(scene.images[0].width > 1, "white stands in");
}

#[test]
fn map_ke_without_ke() {
    let emission = |scene: &Scene| scene.materials[scene.meshes[0].material].emission;
    let scene = clean("map_ke_alone/one.obj");
    assert_eq!(emission(&scene), Vec3::ONE);
    let scene = clean("map_ke_alone/none.obj");
    assert_eq!(emission(&scene), Vec3::ONE);
    assert!(scene.materials[0].emission_texture.is_some());
    let scene =
        warned("map_ke_alone/zero.obj", &["material t: Ke is black, so map_Ke has no effect"]);
    assert_eq!(emission(&scene), Vec3::ZERO);
}

#[test]
fn accessors_without_bytes_are_zeros() {
    let (stored, zeros) =
        (clean("accessor_zeros/uv_stored.gltf"), clean("accessor_zeros/uv_zeros.gltf"));
    is_quad(&zeros);
    assert_eq!(zeros.meshes[0].uv0, stored.meshes[0].uv0);
    assert_eq!(zeros.meshes[0].uv0, [glam::Vec2::ZERO; 4]);
}

#[test]
fn names_of_files_in_every_spelling() {
    for name in [
        "backslash",
        "data_gltfbuffer",
        "data_urlsafe_mime",
        "dot",
        "enc",
        "raw_percent",
        "umlaut_enc",
        "umlaut_raw",
        "up",
    ] {
        let scene = clean(&format!("uri/{name}.gltf"));
        assert_eq!(scene.n_triangles(), 2, "{name}");
        assert!(!scene.images[0].rgba.is_empty() && scene.images[0].rgba[0] != [255; 4], "{name}");
    }
    let scene = warned("uri/file.gltf", &["the scheme `file:` is not supported"]);
    assert_eq!(scene.images[0].rgba, [[255; 4]]);
    for name in ["encoded", "raw"] {
        is_quad(&clean(&format!("uri_buffer/{name}.gltf")));
    }
}

#[test]
fn an_emissive_texture_that_cannot_be_read_is_dark() {
    let glow = |scene: &Scene| scene.materials.iter().map(|m| m.emission).sum::<Vec3>();
    assert_eq!(glow(&clean("emissive_missing/ok.gltf")), Vec3::ONE);
    const DARK: &str = "materials[3]: emissiveTexture cannot be read, so that it emits nothing";
    let scene = warned("emissive_missing/missing.gltf", &["cannot read gone.png", DARK]);
    assert_eq!(glow(&scene), Vec3::ZERO);
    assert!(scene.materials.iter().all(|m| m.emission_texture.is_none()));
    let basisu = "extensionsUsed: KHR_texture_basisu ignored";
    let scene = warned(
        "emissive_missing/basisu.gltf",
        &[basisu, "textures[0]: has a source only in KHR_texture_basisu", DARK],
    );
    assert_eq!(glow(&scene), Vec3::ZERO);
    let scene = warned("emissive_missing/basisu_fallback.gltf", &[basisu]);
    assert_eq!(glow(&scene), Vec3::ONE);
    assert!(scene.materials.iter().any(|m| m.emission_texture.is_some()));
}

#[test]
fn gltf_1_is_named() {
    let error = |name: &str| {
        let path = fixture("cases").join(name);
        Scene::load(&path, &LoadLimits::default()).unwrap_err().to_string()
    };
    let shown = error("gltf1/one.gltf");
    assert!(shown.contains("glTF 1.0 is not supported") && shown.contains("glTF 2.0"), "{shown}");
    let shown = error("gltf1/noasset.gltf");
    assert!(shown.contains("asset.version is missing"), "{shown}");
}

#[test]
fn without_a_default_the_first_scene_is_read() {
    let scene = warned(
        "two_scenes/no_default.gltf",
        &["scene: none of the 2 scenes is the default; scenes[0] (lod0) is read"],
    );
    assert_eq!(scene.instances.len(), 1);
    assert_eq!(base_color(&scene), RED);
}

#[test]
fn a_node_may_flatten_its_mesh() {
    let scene = warned(
        "flat_scale/flat.gltf",
        &["meshes[5].primitives[0] at nodes[5]: 8 triangle(s) dropped: zero area"],
    );
    let flat = scene.instances.last().unwrap();
    let mesh = &scene.meshes[flat.mesh];
    let mut area = 0.0;
    for triangle in &mesh.triangles {
        let [a, b, c] =
            triangle.map(|i| flat.world_from_object.transform_point3(mesh.positions[i as usize]));
        assert!([a, b, c].iter().all(|p| p.z == -0.5));
        area += (b - a).cross(c - a).length() / 2.0;
    }
    // Front and back of a box of 0.6 m.
    assert_eq!(mesh.triangles.len(), 4);
    assert!((area - 2.0 * 0.36).abs() < 1e-6, "{area}");
    assert_eq!(clean("flat_scale/thin.gltf").n_triangles(), scene.n_triangles() + 8);
}

#[test]
fn joints_place_a_skinned_mesh() {
    is_quad(&clean("skin/armature_001.gltf"));
}
