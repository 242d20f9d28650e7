// SPDX-License-Identifier: MIT OR Apache-2.0
//! glTF, feature by feature.

use std::f32::consts::{FRAC_PI_2, FRAC_PI_4};

use glam::{Affine2, Vec2, Vec3, Vec4};
use lucerna::scene::{
    AlphaMode, Filter, Light, LoadLimits, Projection, Scene, TextureRef, Warning, Wrap,
};

use crate::builder::{Builder, TRIANGLE, base64, le_bytes, textured, triangle};
use crate::{load_clean, load_gltf};

/// Values here are small whole numbers and sines: single precision with a few roundings.
const TOLERANCE: f32 = 1e-5;

#[track_caller]
fn near(a: Vec3, b: Vec3) {
    assert!((a - b).abs().max_element() <= TOLERANCE, "{a} is not {b}");
}

/// The mesh's corners in the world, triangle by triangle.
fn corners(scene: &Scene) -> Vec<[Vec3; 3]> {
    scene
        .instances
        .iter()
        .flat_map(|instance| {
            let mesh = &scene.meshes[instance.mesh];
            mesh.triangles.iter().map(|t| {
                t.map(|i| instance.world_from_object.transform_point3(mesh.positions[i as usize]))
            })
        })
        .collect()
}

const MESH: &str = r#""meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}]"#;

fn with_nodes(nodes: &str, roots: &str) -> Vec<u8> {
    let mut b = Builder::default();
    b.floats(&TRIANGLE);
    b.gltf(&format!(r#""scene":0,"scenes":[{{"nodes":{roots}}}],"nodes":{nodes},{MESH}"#))
}

#[test]
fn transforms_multiply_down_the_tree() {
    // Parent: turn +X to +Y about Z, twice as large, then to (10, 0, 0).
    let half = FRAC_PI_4.sin();
    let nodes = format!(
        r#"[{{"rotation":[0,0,{half},{half}],"scale":[2,2,2],"translation":[10,0,0],"children":[1]}},
            {{"translation":[1,0,0],"mesh":0}}]"#
    );
    let scene = load_clean(&with_nodes(&nodes, "[0]"));
    let [a, b, c] = corners(&scene)[0];
    near(a, Vec3::new(10., 2., 0.));
    near(b, Vec3::new(10., 4., 0.));
    near(c, Vec3::new(8., 2., 0.));
}

#[test]
fn matrices_are_column_major_and_may_mirror() {
    // x' = −x + 5, y' = y + z, z' = z.
    let nodes = r#"[{"mesh":0,"matrix":[-1,0,0,0, 0,1,0,0, 0,1,1,0, 5,0,0,1]}]"#;
    let scene = load_clean(&with_nodes(nodes, "[0]"));
    let m = scene.instances[0].world_from_object;
    near(m.transform_point3(Vec3::new(1., 2., 3.)), Vec3::new(4., 5., 3.));
    assert_eq!(m.matrix3.determinant(), -1.0);
    let nodes = r#"[{"mesh":0,"scale":[-2,3,1]}]"#;
    let scene = load_clean(&with_nodes(nodes, "[0]"));
    assert_eq!(scene.instances[0].world_from_object.matrix3.determinant(), -6.0);
}

#[test]
fn rotations_are_normalised() {
    let nodes = r#"[{"mesh":0,"rotation":[0,0,2,2]}]"#;
    let scene = load_clean(&with_nodes(nodes, "[0]"));
    near(corners(&scene)[0][1], Vec3::Y);
}

#[test]
fn one_mesh_in_two_nodes_is_two_instances() {
    let nodes = r#"[{"mesh":0},{"mesh":0,"translation":[0,0,4]},{"mesh":0}]"#;
    let scene = load_clean(&with_nodes(nodes, "[0,1]"));
    assert_eq!((scene.meshes.len(), scene.instances.len()), (1, 2));
    assert_eq!(scene.n_triangles(), 2);
    let bounds = scene.bounds().unwrap();
    near(bounds.0, Vec3::ZERO);
    near(bounds.1, Vec3::new(1., 1., 4.));
}

#[test]
fn without_a_default_scene_all_roots_are_read() {
    let mut b = Builder::default();
    b.floats(&TRIANGLE);
    let nodes = r#""nodes":[{"mesh":0},{"children":[2]},{"mesh":0}]"#;
    let scene = load_clean(&b.gltf(&format!("{nodes},{MESH}")));
    assert_eq!(scene.instances.len(), 2);
    // Nor does the only scene need to be named.
    let scenes = r#""scenes":[{"nodes":[1]}]"#;
    let scene = load_clean(&b.gltf(&format!("{scenes},{nodes},{MESH}")));
    assert_eq!(scene.instances.len(), 1);
    let scenes = r#""scene":1,"scenes":[{"nodes":[0]},{"nodes":[1]}]"#;
    let scene = load_clean(&b.gltf(&format!("{scenes},{nodes},{MESH}")));
    assert_eq!(scene.instances.len(), 1);
}

#[test]
fn glb_holds_the_same() {
    let mut b = Builder::default();
    b.floats(&TRIANGLE);
    let rest = format!(r#""nodes":[{{"mesh":0}}],{MESH}"#);
    assert_eq!(corners(&load_clean(&b.glb(&rest))), corners(&load_clean(&b.gltf(&rest))));
}

#[test]
fn no_material_is_gltfs_default() {
    let scene = load_clean(&triangle("", ""));
    let material = &scene.materials[scene.meshes[0].material];
    assert_eq!((material.metallic, material.roughness), (1.0, 1.0));
    assert_eq!(material.base_color, Vec4::ONE);
    assert_eq!(material.emission, Vec3::ZERO);
    assert_eq!(material.alpha, AlphaMode::Opaque);
    assert!(!material.double_sided);
}

#[test]
fn material_factors() {
    let scene = load_clean(&textured(
        r#""materials":[{"name":"m","doubleSided":true,"alphaMode":"MASK","alphaCutoff":0.25,
            "emissiveFactor":[1,0.5,0.25],
            "extensions":{"KHR_materials_emissive_strength":{"emissiveStrength":8}},
            "pbrMetallicRoughness":{"baseColorFactor":[0.5,0.25,0.125,0.75],
                "metallicFactor":0.5,"roughnessFactor":0.25}}]"#,
    ));
    let m = &scene.materials[0];
    assert_eq!(m.name, "m");
    assert_eq!(m.base_color, Vec4::new(0.5, 0.25, 0.125, 0.75));
    assert_eq!((m.metallic, m.roughness), (0.5, 0.25));
    assert_eq!(m.emission, Vec3::new(8., 4., 2.));
    assert_eq!(m.alpha, AlphaMode::Mask { cutoff: 0.25 });
    assert!(m.double_sided);

    let cutoff = |mode: &str| {
        let file = textured(&format!(r#""materials":[{{"alphaMode":"{mode}"}}]"#));
        load_gltf(&file).scene.materials[0].alpha
    };
    assert_eq!(cutoff("MASK"), AlphaMode::Mask { cutoff: 0.5 });
    assert_eq!(cutoff("BLEND"), AlphaMode::Mask { cutoff: 0.5 });
}

/// 2×1: red with alpha 128, then green.
fn png() -> String {
    let mut bytes = Vec::new();
    image::RgbaImage::from_raw(2, 1, vec![255, 0, 0, 128, 0, 255, 0, 255])
        .unwrap()
        .write_to(&mut std::io::Cursor::new(&mut bytes), image::ImageFormat::Png)
        .unwrap();
    format!("data:image/png;base64,{}", base64(&bytes))
}

#[test]
fn textures_samplers_and_transforms() {
    let scene = load_clean(&textured(&format!(
        r#""images":[{{"name":"two","uri":"{}"}}],
        "samplers":[{{"wrapS":33071,"wrapT":33648,"magFilter":9728}},{{"wrapS":10497}}],
        "textures":[{{"source":0,"sampler":0}},{{"source":0,"sampler":1}},{{"source":0}}],
        "materials":[{{
            "pbrMetallicRoughness":{{
                "baseColorTexture":{{"index":0,"texCoord":1}},
                "metallicRoughnessTexture":{{"index":1,"extensions":{{"KHR_texture_transform":
                    {{"offset":[0.5,0.25],"rotation":{FRAC_PI_2},"scale":[2,4],"texCoord":1}}}}}}}},
            "normalTexture":{{"index":2,"scale":0.5,"extensions":{{"KHR_texture_transform":
                    {{"scale":[3,3]}}}}}},
            "emissiveTexture":{{"index":0}}}}]"#,
        png()
    )));
    let m = &scene.materials[0];
    // One image, read once; three ways to read it.
    assert_eq!((scene.images.len(), scene.textures.len()), (1, 3));
    assert_eq!(scene.images[0].rgba, [[255, 0, 0, 128], [0, 255, 0, 255]]);

    let base = m.base_color_texture.as_ref().unwrap();
    assert_eq!(
        base,
        &TextureRef { texture: base.texture, uv_set: 1, uv_from_mesh: Affine2::IDENTITY }
    );
    let texture = &scene.textures[base.texture];
    assert_eq!((texture.wrap_u, texture.wrap_v), (Wrap::Clamp, Wrap::Mirror));
    assert_eq!(texture.filter, Filter::Nearest);
    assert_eq!(m.emission_texture.as_ref().unwrap().texture, base.texture);
    assert_eq!(m.emission_texture.as_ref().unwrap().uv_set, 0);

    // Scaled to (2, 0), turned counter-clockwise (v points down, so towards −v), moved.
    let mr = m.metallic_roughness_texture.as_ref().unwrap();
    assert_eq!(mr.uv_set, 1);
    let map = |u, v| mr.uv_from_mesh.transform_point2(Vec2::new(u, v)).extend(0.);
    near(map(0., 0.), Vec3::new(0.5, 0.25, 0.));
    near(map(1., 0.), Vec3::new(0.5, 0.25 - 2., 0.));
    near(map(0., 1.), Vec3::new(0.5 + 4., 0.25, 0.));
    let texture = &scene.textures[mr.texture];
    assert_eq!((texture.wrap_u, texture.wrap_v), (Wrap::Repeat, Wrap::Repeat));
    assert_eq!(texture.filter, Filter::Linear);

    assert_eq!(m.normal_scale, 0.5);
    let normal = m.normal_texture.as_ref().unwrap();
    assert_eq!(normal.uv_set, 0);
    assert_eq!(normal.uv_from_mesh.transform_point2(Vec2::ONE), Vec2::splat(3.));
}

#[test]
fn a_normal_map_that_cannot_be_read_is_left_out() {
    let loaded = load_gltf(&textured(
        r#""images":[{"uri":"data:image/png;base64,AAAA"}],"textures":[{"source":0}],
        "materials":[{"normalTexture":{"index":0},"emissiveTexture":{"index":0}}]"#,
    ));
    let m = &loaded.scene.materials[0];
    assert_eq!(m.normal_texture, None);
    assert_eq!(m.emission_texture, None);
    assert_eq!(loaded.scene.images[0].rgba, [[255; 4]]);
    assert!(matches!(loaded.warnings[..], [Warning::Image { .. }]));
}

#[test]
fn attributes_of_all_types() {
    let mut b = Builder::default();
    b.floats(&TRIANGLE);
    b.floats(&[[0., 0., 2.]; 3]);
    b.floats(&[[3., 0., 0., -1.]; 3]);
    b.raw(&[0, 255, 51, 0, 102, 204], 5121, "VEC2", 3, r#","normalized":true"#);
    let shorts: Vec<u8> =
        [0u16, 65535, 13107, 0, 26214, 52428].iter().flat_map(|v| v.to_le_bytes()).collect();
    b.raw(&shorts, 5123, "VEC2", 3, r#","normalized":true"#);
    b.raw(&[255, 0, 51, 255, 0, 51, 255, 0, 51], 5121, "VEC3", 3, r#","normalized":true"#);
    let scene = load_clean(&b.gltf(
        r#""nodes":[{"mesh":0}],"meshes":[{"primitives":[{"attributes":{"POSITION":0,
        "NORMAL":1,"TANGENT":2,"TEXCOORD_0":3,"TEXCOORD_1":4,"COLOR_0":5}}]}]"#,
    ));
    let mesh = &scene.meshes[0];
    assert_eq!(mesh.normals, [Vec3::Z; 3]);
    assert_eq!(mesh.tangents, [Vec4::new(1., 0., 0., -1.); 3]);
    let uv = [Vec2::new(0., 1.), Vec2::new(0.2, 0.), Vec2::new(0.4, 0.8)];
    for set in [&mesh.uv0, &mesh.uv1] {
        for (found, expected) in set.iter().zip(uv) {
            near(found.extend(0.), expected.extend(0.));
        }
    }
    for color in &mesh.colors {
        near(color.truncate(), Vec3::new(1., 0., 0.2));
        assert_eq!(color.w, 1.0);
    }
}

#[test]
fn colors_with_alpha_as_shorts_and_floats() {
    let mut b = Builder::default();
    b.floats(&TRIANGLE);
    let shorts: Vec<u8> =
        [65535u16, 0, 13107, 32768].iter().cycle().take(12).flat_map(|v| v.to_le_bytes()).collect();
    b.raw(&shorts, 5123, "VEC4", 3, r#","normalized":true"#);
    b.floats(&[[0.5, 2., 0., 0.25]; 3]);
    let scene = load_clean(&b.gltf(
        r#""nodes":[{"mesh":0}],"meshes":[{"primitives":[
        {"attributes":{"POSITION":0,"COLOR_0":1}},{"attributes":{"POSITION":0,"COLOR_0":2}}]}]"#,
    ));
    let expected = Vec4::new(1., 0., 0.2, 32768. / 65535.);
    assert!((scene.meshes[0].colors[2] - expected).abs().max_element() < TOLERANCE);
    // Above 1 is allowed.
    assert_eq!(scene.meshes[1].colors[0], Vec4::new(0.5, 2., 0., 0.25));
    assert_eq!(scene.instances.len(), 2);
}

#[test]
fn tangents_without_normals_are_dropped() {
    let mut b = Builder::default();
    b.floats(&TRIANGLE);
    b.floats(&[[1., 0., 0., 1.]; 3]);
    let scene = load_clean(&b.gltf(
        r#""nodes":[{"mesh":0}],"meshes":[{"primitives":[
            {"attributes":{"POSITION":0,"TANGENT":1}}]}]"#,
    ));
    assert!(scene.meshes[0].tangents.is_empty());
}

#[test]
fn interleaved_with_stride_and_offset() {
    // position, normal, uv: 32 bytes a vertex, behind 8 bytes of something else.
    let mut bytes = vec![0xff; 8];
    for (i, p) in TRIANGLE.iter().enumerate() {
        let vertex = [p[0], p[1], p[2], 0., 0., 1., i as f32, 7.];
        bytes.extend(le_bytes(&[vertex]));
    }
    let mut b = Builder::default();
    let view = b.view(&bytes, r#","byteStride":32"#);
    b.accessor(5126, "VEC3", 3, &format!(r#","bufferView":{view},"byteOffset":8"#));
    b.accessor(5126, "VEC3", 3, &format!(r#","bufferView":{view},"byteOffset":20"#));
    b.accessor(5126, "VEC2", 3, &format!(r#","bufferView":{view},"byteOffset":32"#));
    let scene = load_clean(&b.gltf(
        r#""nodes":[{"mesh":0}],"meshes":[{"primitives":[
            {"attributes":{"POSITION":0,"NORMAL":1,"TEXCOORD_0":2}}]}]"#,
    ));
    let mesh = &scene.meshes[0];
    assert_eq!(mesh.positions, TRIANGLE.map(Vec3::from_array));
    assert_eq!(mesh.normals, [Vec3::Z; 3]);
    assert_eq!(mesh.uv0, [Vec2::new(0., 7.), Vec2::new(1., 7.), Vec2::new(2., 7.)]);
}

#[test]
fn sparse_without_a_base_starts_at_zero() {
    let mut b = Builder::default();
    let indices = b.view(&[1, 2], "");
    let values = b.view(&le_bytes(&[[4f32, 0., 0.], [0., 5., 0.]]), "");
    b.accessor(
        5126,
        "VEC3",
        3,
        &format!(
            r#","sparse":{{"count":2,"indices":{{"bufferView":{indices},"componentType":5121}},
                "values":{{"bufferView":{values}}}}}"#
        ),
    );
    let scene = load_clean(&b.gltf(&format!(r#""nodes":[{{"mesh":0}}],{MESH}"#)));
    assert_eq!(corners(&scene), [[Vec3::ZERO, Vec3::new(4., 0., 0.), Vec3::new(0., 5., 0.)]]);
}

#[test]
fn every_accessor_without_bytes_is_zeros() {
    let mut b = Builder::default();
    b.floats(&TRIANGLE);
    b.accessor(5126, "VEC3", 3, "");
    b.accessor(5126, "VEC4", 3, "");
    b.accessor(5123, "VEC2", 3, r#","normalized":true"#);
    b.accessor(5125, "SCALAR", 6, "");
    b.accessor(5126, "VEC3", 4_000_000_000, "");
    let file = |attributes: &str, more: &str| {
        b.gltf(&format!(
            r#""nodes":[{{"mesh":0}},{{"mesh":1}}],"meshes":[
                {{"primitives":[{{"attributes":{{{attributes}}}{more}}}]}},
                {{"primitives":[{{"attributes":{{"POSITION":0}}}}]}}]"#
        ))
    };
    let all = r#""POSITION":0,"NORMAL":1,"TANGENT":2,"TEXCOORD_0":3,"COLOR_0":2"#;
    let loaded = load_gltf(&file(all, ""));
    let mesh = &loaded.scene.meshes[0];
    // Normals and tangents of length 0 are mended, with a warning each.
    assert_eq!(mesh.normals, [Vec3::Z; 3]);
    assert_eq!((&mesh.uv0[..], &mesh.colors[..]), (&[Vec2::ZERO; 3][..], &[Vec4::ZERO; 3][..]));
    assert_eq!(loaded.warnings.len(), 2);
    // Positions and indices of 0 cost their triangles, not the file.
    for (attributes, more) in [(r#""POSITION":1"#, ""), (r#""POSITION":0"#, r#","indices":4"#)] {
        let loaded = load_gltf(&file(attributes, more));
        assert_eq!(loaded.scene.n_triangles(), 1);
        assert!(matches!(loaded.warnings[..], [Warning::Dropped { .. }]), "{:?}", loaded.warnings);
    }
    // A few bytes of JSON may not ask for any memory.
    let huge = file(r#""POSITION":5"#, "");
    let error = Scene::from_gltf_slice(&huge, None, &LoadLimits::default()).unwrap_err();
    assert!(error.to_string().contains("raise LoadLimits::max_bytes"), "{error}");
}

#[test]
fn an_emissive_texture_of_an_unknown_set_is_dark() {
    let loaded = load_gltf(&textured(
        r#""images":[{"uri":"data:image/png;base64,AAAA"}],"textures":[{"source":0}],
        "materials":[{"emissiveFactor":[1,1,1],"emissiveTexture":{"index":0,"texCoord":7}}]"#,
    ));
    assert_eq!(loaded.scene.materials[0].emission, Vec3::ZERO);
    let shown: Vec<String> = loaded.warnings.iter().map(|w| w.to_string()).collect();
    assert!(shown[0].contains("TEXCOORD_7") && shown[1].contains("emits nothing"), "{shown:?}");
}

#[test]
fn lists_strips_and_fans() {
    let mut b = Builder::default();
    b.floats(&[[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [1., 1., 0.], [0., 2., 0.]]);
    b.indices(&[0, 1, 2, 1, 3, 2]);
    b.raw(&[0, 1, 2, 3, 4], 5121, "SCALAR", 5, "");
    let wide: Vec<u8> = [0u32, 1, 3, 2].iter().flat_map(|i| i.to_le_bytes()).collect();
    b.raw(&wide, 5125, "SCALAR", 4, "");
    let triangles = |more: &str| {
        let file = b.gltf(&format!(
            r#""nodes":[{{"mesh":0}}],"meshes":[{{"primitives":[
                {{"attributes":{{"POSITION":0}}{more}}}]}}]"#
        ));
        load_gltf(&file).scene.meshes[0].triangles.clone()
    };
    assert_eq!(triangles(r#","indices":1"#), [[0, 1, 2], [1, 3, 2]]);
    // Without indices: five vertices make one triangle, and two are left over.
    assert_eq!(triangles(""), [[0, 1, 2]]);
    assert_eq!(triangles(r#","indices":2,"mode":5"#), [[0, 1, 2], [1, 3, 2], [2, 3, 4]]);
    assert_eq!(triangles(r#","indices":3,"mode":6"#), [[1, 3, 0], [3, 2, 0]]);
}

#[test]
fn vertices_of_dropped_triangles_go_too() {
    let mut b = Builder::default();
    b.floats(&[[f32::NAN, 0., 0.], [0., 0., 0.], [1., 0., 0.], [0., 1., 0.]]);
    b.indices(&[0, 1, 2, 3, 1, 2]);
    let loaded = load_gltf(&b.gltf(
        r#""nodes":[{"mesh":0}],"meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1}]}]"#,
    ));
    let mesh = &loaded.scene.meshes[0];
    assert_eq!(mesh.triangles, [[0, 1, 2]]);
    assert_eq!(mesh.positions, [Vec3::Y, Vec3::ZERO, Vec3::X]);
}

#[test]
fn bad_normals_become_the_mean_of_the_faces_around() {
    let mut b = Builder::default();
    b.floats(&TRIANGLE);
    b.floats(&[[f32::NAN, 0., 0.], [0., 3., 4.], [0., 0., 0.]]);
    let loaded = load_gltf(&b.gltf(
        r#""nodes":[{"mesh":0}],"meshes":[{"primitives":[{"attributes":{"POSITION":0,"NORMAL":1}}]}]"#,
    ));
    assert_eq!(loaded.scene.meshes[0].normals, [Vec3::Z, Vec3::new(0., 0.6, 0.8), Vec3::Z]);
}

#[test]
fn cameras_stand_in_the_world() {
    // Turned by 90° about Y: −Z becomes −X; scale is ignored.
    let half = FRAC_PI_4.sin();
    let scene = load_clean(&triangle(
        &format!(
            r#","name":"eye","camera":0,"rotation":[0,{half},0,{half}],"scale":[2,2,2],"translation":[1,2,3],"children":[1,2]}},
            {{"camera":1}},{{"camera":1"#
        ),
        r#","cameras":[
            {"name":"lens","type":"perspective","perspective":{"yfov":0.7,"znear":0.1}},
            {"name":"plan","type":"orthographic","orthographic":{"xmag":3,"ymag":2,"znear":0,"zfar":9}}]"#,
    ));
    let [eye, plan, _] = &scene.cameras[..] else { panic!("{:?}", scene.cameras) };
    assert_eq!((eye.name.as_str(), plan.name.as_str()), ("eye", "plan"));
    near(eye.position, Vec3::new(1., 2., 3.));
    near(eye.forward, Vec3::NEG_X);
    near(eye.up, Vec3::Y);
    assert_eq!(eye.projection, Projection::Perspective { vertical_fov: 0.7 });
    assert_eq!(plan.projection, Projection::Orthographic { half_height: 2. });
    near(plan.forward, Vec3::NEG_X);
}

fn lit(light: &str) -> Light {
    // −Z of the node points to −Y in the world.
    let half = FRAC_PI_4.sin();
    let scene = load_clean(&triangle(
        &format!(
            r#","translation":[0,5,0],"rotation":[-{half},0,0,{half}],
            "extensions":{{"KHR_lights_punctual":{{"light":0}}}}"#
        ),
        &format!(r#","extensions":{{"KHR_lights_punctual":{{"lights":[{light}]}}}}"#),
    ));
    scene.lights[0].clone()
}

#[test]
fn lights_stand_in_the_world() {
    let point = lit(r#"{"type":"point","color":[1,0.5,0.25],"intensity":8,"range":20}"#);
    let Light::Point { position, intensity, range } = point else { panic!("{point:?}") };
    near(position, Vec3::new(0., 5., 0.));
    assert_eq!(intensity, Vec3::new(8., 4., 2.));
    assert_eq!(range, Some(20.));

    let sun = lit(r#"{"type":"directional","intensity":3}"#);
    let Light::Directional { direction, irradiance } = sun else { panic!("{sun:?}") };
    near(direction, Vec3::NEG_Y);
    assert_eq!(irradiance, Vec3::splat(3.));

    let spot = lit(r#"{"type":"spot","spot":{"innerConeAngle":0.25,"outerConeAngle":0.5}}"#);
    let Light::Spot { direction, intensity, inner, outer, range, .. } = spot else {
        panic!("{spot:?}")
    };
    near(direction, Vec3::NEG_Y);
    assert_eq!((inner, outer, range), (0.25, 0.5, None));
    assert_eq!(intensity, Vec3::ONE);
}

#[test]
fn spot_defaults_and_hard_edges() {
    let cone = |spot: &str| match lit(&format!(r#"{{"type":"spot","spot":{spot}}}"#)) {
        Light::Spot { inner, outer, .. } => (inner, outer),
        other => panic!("{other:?}"),
    };
    assert_eq!(cone("{}"), (0.0, FRAC_PI_4));
    // As exporters write a spot without falloff.
    let (inner, outer) = cone(r#"{"innerConeAngle":0.5,"outerConeAngle":0.5}"#);
    assert_eq!(outer, 0.5);
    assert!(inner < outer && inner > 0.499, "{inner}");
}

#[test]
fn what_is_not_understood_is_named() {
    let file = triangle(
        r#","skin":0"#,
        r#","skins":[{"joints":[0]}],"extensionsUsed":["KHR_materials_clearcoat","KHR_lights_punctual"]"#,
    );
    let shown: Vec<String> = load_gltf(&file).warnings.iter().map(|w| w.to_string()).collect();
    assert_eq!(
        shown,
        [
            "extensionsUsed: KHR_materials_clearcoat ignored",
            "meshes[0].primitives[0] at nodes[0]: its skin cannot be used \
             (lacks JOINTS_0 or WEIGHTS_0); the mesh is read without it, and without the node's \
             transform"
        ]
    );
}

#[test]
fn supported_extensions_may_be_required() {
    let file = triangle(
        "",
        r#","extensionsRequired":["KHR_lights_punctual","KHR_texture_transform","KHR_materials_emissive_strength"]"#,
    );
    load_clean(&file);
    let refused = |name: &str| {
        let file = triangle("", &format!(r#","extensionsRequired":["{name}"]"#));
        let error = Scene::from_gltf_slice(&file, None, &LoadLimits::default()).unwrap_err();
        error.to_string().contains(name)
    };
    assert!(refused("KHR_draco_mesh_compression"));
    assert!(refused("KHR_mesh_quantization"));
    assert!(refused("EXT_meshopt_compression"));
}
