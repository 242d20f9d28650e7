// SPDX-License-Identifier: MIT OR Apache-2.0
//! Skins at rest: where each vertex must stand, by hand.

use std::f32::consts::FRAC_PI_4;

use glam::{Mat4, Vec3, Vec4};
use lucerna::scene::{LoadLimits, Loaded, Scene};

use crate::builder::{Builder, TRIANGLE, le_bytes};
use crate::load_gltf;

/// Two joints: node 1 at (0, 0, 2), node 2 below it, another 3 up and turned +X to +Y.
fn joints() -> String {
    let half = FRAC_PI_4.sin();
    format!(
        r#"{{"name":"a","translation":[0,0,2],"children":[2]}},
        {{"name":"b","translation":[0,3,0],"rotation":[0,0,{half},{half}]}}"#
    )
}

/// A triangle with normals +Z and tangents +X, `joints` and `weights` a vertex; accessors 0 to 4,
/// the skin's matrices 5.
struct Skinned {
    joints: [[u8; 4]; 3],
    weights: [[f32; 4]; 3],
    binds: Vec<Mat4>,
    /// JSON behind the skin's joints.
    skin: &'static str,
    /// JSON of the mesh's node.
    node: &'static str,
    /// More attributes.
    attributes: &'static str,
}

impl Default for Skinned {
    fn default() -> Self {
        Self {
            joints: [[0, 1, 0, 0]; 3],
            weights: [[1., 0., 0., 0.]; 3],
            binds: vec![Mat4::IDENTITY; 2],
            skin: r#","inverseBindMatrices":5"#,
            node: "",
            attributes: "",
        }
    }
}

impl Skinned {
    fn file(&self) -> Vec<u8> {
        let mut b = Builder::default();
        b.floats(&TRIANGLE);
        b.floats(&[[0., 0., 1.]; 3]);
        b.floats(&[[1., 0., 0., 1.]; 3]);
        b.raw(&self.joints.concat(), 5121, "VEC4", 3, "");
        b.floats(&self.weights);
        let binds: Vec<[f32; 16]> = self.binds.iter().map(Mat4::to_cols_array).collect();
        b.floats(&binds);
        // For a second set: joint 1, with half of all weight.
        b.raw(&[1, 0, 0, 0].repeat(3), 5121, "VEC4", 3, "");
        b.floats(&[[0.5, 0., 0., 0.]; 3]);
        // What cannot be weights or joints.
        b.floats(&[[1., 0., 0., 0.]; 2]);
        b.raw(&le_bytes(&[[0f32; 4]; 3]), 5126, "VEC4", 3, "");
        b.gltf(&format!(
            r#""scene":0,"scenes":[{{"nodes":[0,1]}}],
            "nodes":[{{"mesh":0,"skin":0{}}},{}],"skins":[{{"joints":[1,2]{}}}],
            "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0,"NORMAL":1,"TANGENT":2,
                "JOINTS_0":3,"WEIGHTS_0":4{}}}}}]}}]"#,
            self.node,
            joints(),
            self.skin,
            self.attributes
        ))
    }

    fn load(&self) -> Loaded {
        load_gltf(&self.file())
    }

    fn clean(&self) -> Scene {
        let loaded = self.load();
        assert!(loaded.warnings.is_empty(), "{:#?}", loaded.warnings);
        loaded.scene
    }

    /// The one warning, and the scene.
    #[track_caller]
    fn warned(&self, text: &str) -> Scene {
        let loaded = self.load();
        let shown: Vec<_> = loaded.warnings.iter().map(|w| w.to_string()).collect();
        assert!(shown.len() == 1 && shown[0].contains(text), "{shown:#?}, expected {text}");
        loaded.scene
    }
}

fn corners(scene: &Scene) -> Vec<Vec3> {
    let instance = &scene.instances[0];
    let place = |&p| instance.world_from_object.transform_point3(p);
    scene.meshes[instance.mesh].positions.iter().map(place).collect()
}

#[track_caller]
fn near(found: &[Vec3], expected: [[f32; 3]; 3]) {
    for (found, expected) in found.iter().zip(expected) {
        assert!((*found - Vec3::from(expected)).length() < 1e-6, "{found} is not {expected:?}");
    }
}

/// The triangle as the file has it, without any transform.
const AT_REST: [[f32; 3]; 3] = TRIANGLE;

#[test]
fn joints_place_vertices_and_the_node_does_not() {
    let mut skinned =
        Skinned { node: r#","translation":[100,0,0],"scale":[9,9,9]"#, ..Skinned::default() };
    near(&corners(&skinned.clean()), [[0., 0., 2.], [1., 0., 2.], [0., 1., 2.]]);

    // All by joint 1: turned, then to (0, 3, 2).
    skinned.weights = [[0., 1., 0., 0.]; 3];
    let scene = skinned.clean();
    near(&corners(&scene), [[0., 3., 2.], [0., 4., 2.], [-1., 3., 2.]]);
    assert_eq!(scene.meshes[0].normals, [Vec3::Z; 3]);
    assert!((scene.meshes[0].tangents[0] - Vec4::new(0., 1., 0., 1.)).length() < 1e-6);

    // Corner 1 by both: the mean of (1, 0, 2) and (0, 4, 2).
    skinned.weights = [[1., 0., 0., 0.], [0.5, 0.5, 0., 0.], [0., 1., 0., 0.]];
    near(&corners(&skinned.clean()), [[0., 0., 2.], [0.5, 2., 2.], [-1., 3., 2.]]);

    // The matrices take the mesh to its joint first: here by (0, 0, −2).
    skinned.weights = [[1., 0., 0., 0.]; 3];
    skinned.binds[0] = Mat4::from_translation(Vec3::new(0., 0., -2.));
    near(&corners(&skinned.clean()), AT_REST);

    // Without matrices they are identities.
    skinned.skin = "";
    near(&corners(&skinned.clean()), [[0., 0., 2.], [1., 0., 2.], [0., 1., 2.]]);
}

#[test]
fn a_second_set_counts() {
    let skinned = Skinned {
        weights: [[0.5, 0., 0., 0.]; 3],
        attributes: r#","JOINTS_1":6,"WEIGHTS_1":7"#,
        ..Skinned::default()
    };
    near(&corners(&skinned.clean()), [[0., 1.5, 2.], [0.5, 2., 2.], [-0.5, 2., 2.]]);
    let half = Skinned { attributes: r#","JOINTS_1":6"#, ..skinned };
    near(&corners(&half.warned("its skin cannot be used (lacks JOINTS_1 or WEIGHTS_1)")), AT_REST);
}

#[test]
fn joints_that_mirror_keep_the_front() {
    let mut skinned = Skinned::default();
    skinned.binds[0] = Mat4::from_scale(Vec3::new(-1., 1., 1.));
    let scene = skinned.clean();
    let mesh = &scene.meshes[0];
    let [a, b, c] = mesh.triangles[0].map(|i| mesh.positions[i as usize]);
    assert_eq!((b - a).cross(c - a), Vec3::Z);
    assert_eq!(mesh.normals, [Vec3::Z; 3]);
    assert_eq!(mesh.tangents[0], Vec4::new(-1., 0., 0., -1.));
}

#[test]
fn weights_that_are_off_are_mended() {
    const ONE: [f32; 4] = [1., 0., 0., 0.];
    let expected = [[0., 0., 2.], [1., 0., 2.], [0., 1., 2.]];
    for (weights, joints, text) in [
        (
            [0., 0., 0., 0.],
            [0, 0, 0, 0],
            "1 vertices without a weight, placed by their first joint",
        ),
        ([0.5, 0., 0., 0.], [0, 0, 0, 0], "1 vertices whose weights do not sum to 1, scaled"),
        ([1., f32::NAN, -1., 0.], [0, 1, 1, 0], "2 weight(s) negative or not finite, left out"),
        ([1., 0.005, 0., 0.], [0, 200, 0, 0], "1 joint(s) beyond the skin's 2, left out"),
    ] {
        let mut skinned = Skinned { weights: [weights, ONE, ONE], ..Skinned::default() };
        skinned.joints[0] = joints;
        near(&corners(&skinned.warned(text)), expected);
    }
    // An index without weight means nothing.
    let mut skinned = Skinned::default();
    skinned.joints[1][3] = 255;
    near(&corners(&skinned.clean()), expected);
}

#[test]
fn skins_that_cannot_be_used_are_named() {
    let cases: [(&'static str, &'static str, &'static str); 6] = [
        (r#","inverseBindMatrices":4"#, "", "expected MAT4 of FLOAT"),
        (r#","inverseBindMatrices":44"#, "", "is 44, but the file has"),
        ("", r#","JOINTS_1":6,"WEIGHTS_1":8"#, "has 2 elements, but POSITION has 3"),
        ("", r#","JOINTS_1":9,"WEIGHTS_1":7"#, "expected a VEC4 of UNSIGNED_BYTE"),
        ("", r#","JOINTS_1":6,"WEIGHTS_1":3"#, "WEIGHTS_1: accessors[3]: is not normalized U8"),
        ("", r#","WEIGHTS_1":7"#, "lacks JOINTS_1 or WEIGHTS_1"),
    ];
    for (skin, attributes, text) in cases {
        let node = r#","translation":[7,7,7]"#;
        let skinned = Skinned { skin, attributes, node, ..Skinned::default() };
        near(&corners(&skinned.warned(text)), AT_REST);
    }
    let mut few = Skinned::default();
    few.binds.pop();
    near(&corners(&few.warned("has 1 inverseBindMatrices for 2 joints")), AT_REST);
    let mut infinite = Skinned::default();
    infinite.binds[1].w_axis.x = f32::INFINITY;
    near(&corners(&infinite.warned("inverseBindMatrices[1] is not affine")), AT_REST);

    let text = String::from_utf8(Skinned::default().file()).unwrap();
    let far = r#""translation":[0,0,3e9]"#;
    for (from, to, expected) in [
        (r#""translation":[0,0,2]"#, far, "the transform of joint nodes[1] is unusable"),
        (r#""joints":[1,2]"#, r#""joints":[]"#, "has no joints"),
        (r#""joints":[1,2]"#, r#""joints":[1,77]"#, "joints[1] is 77, but the file has 3 nodes"),
        (r#""skin":0"#, r#""skin":5"#, "skin is 5, but the file has 1 skins"),
    ] {
        let changed = text.replace(from, to);
        assert_ne!(changed, text);
        let loaded = load_gltf(changed.as_bytes());
        let shown: Vec<_> = loaded.warnings.iter().map(|w| w.to_string()).collect();
        assert!(shown.iter().any(|w| w.contains(expected)), "{shown:#?}, expected {expected}");
        near(&corners(&loaded.scene), AT_REST);
    }
}

#[test]
fn each_node_has_a_skinned_mesh_of_its_own() {
    let text = String::from_utf8(Skinned::default().file()).unwrap();
    let two = text
        .replace(r#""nodes":[0,1]}"#, r#""nodes":[0,1,3]}"#)
        .replace(r#"],"skins":[{"#, r#",{"mesh":0,"skin":1}],"skins":[{"joints":[2]},{"#);
    let loaded = load_gltf(two.as_bytes());
    assert_eq!((loaded.scene.meshes.len(), loaded.scene.instances.len()), (2, 2));
    let limits = lucerna::settings!(LoadLimits { max_instances: 3, ..LoadLimits::default() });
    assert!(Scene::from_gltf_slice(two.as_bytes(), None, &limits).is_err());
}
