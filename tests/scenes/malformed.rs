// SPDX-License-Identifier: MIT OR Apache-2.0
//! `fixtures/malformed`: for each file, what it must give.

use std::collections::BTreeSet;

use lucerna::scene::{LoadLimits, Scene};

use crate::fixture;

/// What loading must give: an error, or a scene of so many triangles with a warning; each with
/// this text in it.
enum Outcome {
    Error(&'static str),
    Warning(u64, &'static str),
}
use Outcome::{Error, Warning};

#[rustfmt::skip]
const TABLE: &[(&str, Outcome)] = &[
    // Containers.
    ("glb_cut_in_header.glb", Error("broken GLB container at byte 8: the file ends within a header")),
    ("glb_cut_in_chunk.glb", Error("broken GLB container at byte 8: length is")),
    ("glb_bad_magic.glb", Error("neither binary glTF")),
    ("glb_version_1.glb", Error("glTF 1.0 (binary container of version 1) is not supported")),
    ("glb_length_past_end.glb", Error("at byte 8: length is 1048576, but the file has")),
    ("glb_length_below_header.glb", Error("at byte 8: length is 4, but the file has")),
    ("glb_chunk_past_end.glb", Error("at byte 12: the chunk has 4294967295 bytes, but")),
    ("glb_first_chunk_not_json.glb", Error("at byte 16: the first chunk is not JSON")),
    ("glb_no_bin.glb", Error("buffers[0]: has no uri, and the file has no binary chunk")),
    ("glb_bin_too_short.glb", Error("buffers[0]: has 24 bytes, but byteLength is 36")),
    ("empty.gltf", Error("neither binary glTF")),
    ("empty.glb", Error("neither binary glTF")),
    ("scene.fbx", Error("unknown scene format `fbx`; give a file that ends in .gltf, .glb or .obj")),
    // JSON.
    ("json_cut.gltf", Error("invalid glTF JSON: EOF while parsing")),
    ("json_not_utf8.gltf", Error("the JSON is not UTF-8 at byte 43")),
    ("json_deep.gltf", Error("invalid glTF JSON: recursion limit exceeded")),
    ("json_nodes_not_array.gltf", Error("invalid glTF JSON: invalid type: integer `3`, expected a sequence")),
    ("json_version_1.gltf", Error("glTF 1.0 is not supported")),
    ("json_min_version.gltf", Error("glTF 2.9 is not supported")),
    ("draco.gltf", Error("requires the extension KHR_draco_mesh_compression")),
    // Nodes.
    ("node_cycle.gltf", Error("is its own ancestor")),
    ("node_own_child.gltf", Error("nodes[0] is its own ancestor")),
    ("node_two_parents.gltf", Error("nodes[2] is reached twice (child of nodes[0] and child of nodes[1])")),
    ("node_listed_twice.gltf", Error("nodes[0] is reached twice (root of scenes[0] and root of scenes[0])")),
    ("node_root_is_child.gltf", Error("nodes[1] is reached twice (child of nodes[0] and root of scenes[0])")),
    ("node_child_out_of_range.gltf", Error("a child of nodes[0] is 7, but the file has 1 nodes")),
    ("node_deep.gltf", Error("nodes[1025]: depth: 1025 is more than the limit 1024; raise LoadLimits::max_node_depth")),
    ("node_matrix_infinite.gltf", Warning(0, "nodes[0]: its matrix is not finite")),
    ("node_matrix_projective.gltf", Warning(0, "nodes[0]: its matrix is not affine")),
    ("node_matrix_singular.gltf", Warning(0, "nodes[0]: its transform flattens the mesh")),
    ("node_rotation_zero.gltf", Warning(0, "nodes[0]: its rotation is zero or not finite")),
    ("node_scale_zero.gltf", Warning(0, "nodes[0]: its transform flattens the mesh")),
    ("node_scale_infinite.gltf", Warning(0, "nodes[0]: its transform is not finite")),
    ("node_far.gltf", Warning(0, "nodes[0]: it is beyond 1e9 m")),
    ("node_mesh_reaches_far.gltf", Warning(0, "nodes[0]: its mesh reaches beyond 1e9 m")),
    ("scene_out_of_range.gltf", Error("scene is 5, but the file has 1 scenes")),
    ("scene_root_out_of_range.gltf", Error("root of scenes[0] is 4, but the file has 1 nodes")),
    ("scene_empty.gltf", Warning(0, "the scene has no triangles")),
    // Indices of things.
    ("mesh_out_of_range.gltf", Error("nodes[0].mesh is 3, but the file has 1 meshes")),
    ("accessor_out_of_range.gltf", Error("meshes[0].primitives[0].POSITION is 9, but the file has 1 accessors")),
    ("view_out_of_range.gltf", Error("bufferView is 4, but the file has 1 bufferViews")),
    ("buffer_out_of_range.gltf", Error("bufferViews[0].buffer is 2, but the file has 1 buffers")),
    ("material_out_of_range.gltf", Error("primitives[0].material is 1, but the file has 0 materials")),
    ("camera_out_of_range.gltf", Error("nodes[0].camera is 0, but the file has 0 cameras")),
    ("light_out_of_range.gltf", Error("KHR_lights_punctual.light is 3, but the file has 0 lights")),
    ("texture_out_of_range.gltf", Error("baseColorTexture.index is 0, but the file has 0 textures")),
    ("image_out_of_range.gltf", Error("textures[0].source is 0, but the file has 0 images")),
    ("sampler_out_of_range.gltf", Error("textures[0].sampler is 1, but the file has 0 samplers")),
    ("index_out_of_range.gltf", Warning(1, "1 triangle(s) dropped: vertex index out of range")),
    // Accessors, views, buffers.
    ("view_past_buffer.gltf", Error("bufferViews[0]: bytes 0..37 are outside of buffers[0] (36 bytes)")),
    ("view_overflow.gltf", Error("bufferViews[0]: bytes 18446744073709551612..18446744073709551615 are outside")),
    ("accessor_past_view.gltf", Error("POSITION: accessors[0]: bytes 4..40 are outside of bufferViews[0] (36 bytes)")),
    ("accessor_offset_overflow.gltf", Error("accessors[0]: bytes 18446744073709551608..18446744073709551615 are outside")),
    ("accessor_count_huge.gltf", Error("POSITION: 18446744073709551615 is more than the limit 4294967296; raise LoadLimits::max_bytes")),
    ("accessor_count_past_view.gltf", Error("bytes 0..48 are outside of bufferViews[0]")),
    ("accessor_count_negative.gltf", Error("invalid glTF JSON: invalid value: integer `-3`")),
    ("accessor_count_zero.gltf", Warning(0, "the scene has no triangles")),
    ("accessor_no_bytes.gltf", Warning(0, "1 triangle(s) dropped: zero area")),
    ("accessor_type_wrong.gltf", Error("POSITION: accessors[0]: is Vec2 of F32, expected a vector of FLOAT")),
    ("accessor_type_unknown.gltf", Error("accessors[0]: type has a value that glTF does not know")),
    ("accessor_component_unknown.gltf", Error("accessors[0]: componentType has a value that glTF does not know")),
    ("accessor_component_wrong.gltf", Error("accessors[0]: is Vec3 of U16, expected a vector of FLOAT")),
    ("accessor_misaligned.gltf", Warning(1, "data is misaligned")),
    ("stride_below_element.gltf", Error("byteStride 4 is smaller than an element (12 bytes)")),
    ("stride_zero.gltf", Error("byteStride 0 is smaller than an element (12 bytes)")),
    ("stride_past_view.gltf", Error("bytes 0..516 are outside of bufferViews[0]")),
    ("indices_are_floats.gltf", Error("indices: accessors[1]: is Scalar of F32, expected a SCALAR of an unsigned type")),
    ("indices_two.gltf", Warning(0, "2 corner(s) that do not form a triangle ignored")),
    ("normals_too_few.gltf", Error("NORMAL: accessors[1]: has 2 elements, but POSITION has 3")),
    ("texcoords_not_normalized.gltf", Error("TEXCOORD_0: accessors[1]: is not normalized U8")),
    ("colors_of_one.gltf", Error("COLOR_0: accessors[1]: is Scalar of F32")),
    ("sparse_index_out_of_range.gltf", Error("sparse index 3 (number 1) is not below the count 3")),
    ("sparse_not_rising.gltf", Error("sparse index 1 (number 1) is not below the count 3, or not above the one before it")),
    ("sparse_count_huge.gltf", Error("are outside of bufferViews[1] (2 bytes)")),
    ("sparse_past_view.gltf", Error("bytes 0..4 are outside of bufferViews[1] (2 bytes)")),
    ("buffer_file_missing.gltf", Error("buffers[0]: cannot read nowhere.bin")),
    ("buffer_too_short.gltf", Error("buffers[0]: has 36 bytes, but byteLength is 40")),
    ("buffer_length_huge.gltf", Error("buffers[0]: has 36 bytes, but byteLength is 9223372036854775808")),
    ("buffer_no_uri.gltf", Error("buffers[0]: has no uri")),
    ("base64_garbage.gltf", Error("buffers[0]: invalid base64 at character 4")),
    ("base64_cut.gltf", Error("buffers[0]: invalid base64 at character 5")),
    ("data_uri_plain.gltf", Error("buffers[0]: data URI without `;base64,`")),
    // Paths.
    ("path_climbs.gltf", Error("../scenes/README.md leads out of the scene's folder")),
    ("path_climbs_inside.gltf", Error("a/../../scenes/README.md leads out of the scene's folder")),
    ("path_climbs_percent.gltf", Error("../scenes/README.md leads out of the scene's folder")),
    ("path_climbs_backslash.gltf", Error("../scenes/README.md leads out of the scene's folder")),
    ("path_absolute.gltf", Error("/etc/passwd leads out of the scene's folder")),
    ("path_absolute_percent.gltf", Error("/etc/passwd leads out of the scene's folder")),
    ("path_drive.gltf", Error("the scheme `C:` is not supported")),
    ("path_http.gltf", Error("the scheme `http:` is not supported")),
    ("path_file.gltf", Error("the scheme `file:` is not supported")),
    ("path_percent_cut.gltf", Error("broken percent-encoding at byte 1")),
    ("path_nul.gltf", Error("leads out of the scene's folder")),
    ("path_folder.gltf", Error("is not a regular file")),
    // Values.
    ("position_nan.gltf", Warning(1, "1 triangle(s) dropped: NaN or infinite corner")),
    ("position_infinite.gltf", Warning(1, "1 triangle(s) dropped: NaN or infinite corner")),
    ("position_huge.gltf", Warning(1, "1 triangle(s) dropped: corner beyond 1e9 m")),
    ("position_denormal.gltf", Warning(1, "1 triangle(s) dropped: zero area")),
    ("triangle_zero_area.gltf", Warning(1, "1 triangle(s) dropped: zero area")),
    ("triangles_all_bad.gltf", Warning(0, "the scene has no triangles")),
    ("normal_nan.gltf", Warning(1, "2 normal(s), zero or not finite, replaced")),
    ("tangent_nan.gltf", Warning(1, "3 tangent(s), zero or not finite, replaced")),
    ("texcoord_nan.gltf", Warning(1, "2 texture coordinate(s), not finite, replaced by 0")),
    ("color_nan.gltf", Warning(1, "2 vertex colour(s), negative or not finite, replaced")),
    ("primitive_points.gltf", Warning(0, "a primitive of points or lines is ignored")),
    ("primitive_lines.gltf", Warning(0, "a primitive of points or lines is ignored")),
    ("primitive_mode_unknown.gltf", Error("mode has a value that glTF does not know")),
    ("primitive_no_position.gltf", Warning(0, "a primitive without POSITION is ignored")),
    ("material_metallic_3.gltf", Warning(1, "materials[0]: metallicFactor is 3, read as 1")),
    ("material_color_infinite.gltf", Warning(1, "materials[0]: baseColorFactor is inf, read as 1")),
    ("material_emission_infinite.gltf", Warning(1, "materials[0]: emission is inf, read as 0")),
    ("material_emission_negative.gltf", Warning(1, "materials[0]: emission is -1, read as 0")),
    ("material_blend.gltf", Warning(1, "alphaMode BLEND is not supported, read as MASK with cutoff 0.5")),
    ("material_alpha_mode_unknown.gltf", Error("materials[0]: alphaMode has a value that glTF does not know")),
    ("material_texcoord_7.gltf", Warning(1, "a texture that reads TEXCOORD_7")),
    ("material_texcoord_missing.gltf", Warning(1, "the material reads TEXCOORD_1, which the mesh does not have")),
    ("texture_transform_infinite.gltf", Warning(1, "baseColorTexture: KHR_texture_transform is not finite, read as none")),
    ("sampler_unknown.gltf", Error("textures[0].sampler: wrapS or wrapT has a value that glTF does not know")),
    // Images.
    ("image_bomb.gltf", Warning(1, "images[0]: 60000×60000 pixels are more than LoadLimits::max_image_pixels (268435456)")),
    ("image_lies.gltf", Warning(1, "images[0]: the header says 4096×4096 pixels, more than its")),
    ("image_zero_width.gltf", Warning(1, "images[0]: ")),
    ("image_png_cut.gltf", Warning(1, "images[0]: cannot be decoded")),
    ("image_png_no_pixels.gltf", Warning(1, "images[0]: cannot be decoded")),
    ("image_png_bad_crc.gltf", Warning(1, "images[0]: cannot be decoded")),
    ("image_jpeg_cut.gltf", Warning(1, "images[0]: cannot be decoded")),
    ("image_jpeg_lies.gltf", Warning(1, "images[0]: the header says 8192×8192 pixels, more than its 28 bytes can hold")),
    ("image_text.gltf", Warning(1, "images[0]: neither PNG nor JPEG")),
    ("image_missing.gltf", Warning(1, "images[0] (nowhere.png): cannot read nowhere.png")),
    ("image_climbs.gltf", Warning(1, "../../Cargo.toml leads out of the scene's folder")),
    ("image_http.gltf", Warning(1, "the scheme `https:` is not supported")),
    ("image_nothing.gltf", Warning(1, "images[0]: has neither bufferView nor uri")),
    ("image_view_out_of_range.gltf", Warning(1, "images[0]: bufferView is 9, but the file has 1 bufferViews")),
    ("texture_no_source.gltf", Warning(1, "textures[0]: neither PNG nor JPEG")),
    // Cameras and lights.
    ("camera_fov_zero.gltf", Warning(1, "cameras[0] at nodes[0]: yfov is missing or not between 0 and π; camera left out")),
    ("camera_fov_infinite.gltf", Warning(1, "yfov is missing or not between 0 and π")),
    ("camera_fov_4.gltf", Warning(1, "yfov is missing or not between 0 and π")),
    ("camera_height_zero.gltf", Warning(1, "ymag is missing, 0 or not finite")),
    ("camera_type_unknown.gltf", Warning(1, "type is neither perspective nor orthographic")),
    ("camera_node_singular.gltf", Warning(0, "its node's matrix is singular; camera left out")),
    ("light_cone_inside_out.gltf", Warning(1, "lights[0] at nodes[0]: innerConeAngle is 1, read as 0.5")),
    ("light_cone_wide.gltf", Warning(1, "outerConeAngle is 3, read as 1.57")),
    ("light_negative.gltf", Warning(1, "intensity · color is [-1, -1, -1]; light left out")),
    ("light_infinite.gltf", Warning(1, "intensity · color is [inf, inf, inf]; light left out")),
    ("light_range_negative.gltf", Warning(1, "range is -2, read as none")),
    ("light_type_unknown.gltf", Error("lights[0] at nodes[0]: type has a value that glTF does not know")),
    // OBJ and MTL.
    ("index_out_of_range.obj", Warning(1, "line 6: face with a vertex index out of range, skipped (1 in total)")),
    ("index_zero.obj", Warning(1, "line 6: face with a vertex index out of range, skipped (1 in total)")),
    ("index_huge.obj", Warning(1, "line 6: face with a vertex index out of range, skipped (1 in total)")),
    ("index_negative_out_of_range.obj", Warning(1, "line 6: face with a vertex index out of range")),
    ("texcoord_index_out_of_range.obj", Warning(2, "line 7: face with a texture coordinate or normal index out of range, read without it")),
    ("corner_unreadable.obj", Warning(1, "line 6: face with an unreadable corner, skipped")),
    ("vertex_nan.obj", Warning(1, "1 triangle(s) dropped: NaN or infinite corner")),
    ("vertex_short.obj", Warning(1, "line 5: too few or unreadable numbers")),
    ("vertex_w_zero.obj", Warning(1, "1 triangle(s) dropped: NaN or infinite corner")),
    ("face_two_corners.obj", Warning(1, "line 6: face with fewer than 3 corners, skipped")),
    ("face_flat.obj", Warning(1, "line 8: polygon without area, skipped")),
    ("face_self_intersecting.obj", Warning(2, "line 5: polygon that intersects itself, read as a fan")),
    ("lines_and_points.obj", Warning(1, "line 6: points, lines, curves or surfaces, skipped (2 in total)")),
    ("material_unknown.obj", Warning(1, "line 5: usemtl of an unknown material")),
    ("mtl_missing.obj", Warning(1, "mtllib nowhere.mtl: cannot read nowhere.mtl")),
    ("mtl_climbs.obj", Warning(1, "../../Cargo.toml leads out of the scene's folder")),
    ("mtl_absolute.obj", Warning(1, "/etc/passwd leads out of the scene's folder")),
    ("mtl_bad.obj", Warning(1, "mtllib bad.mtl, line 2: `Kd` without usable values, skipped")),
    ("line_giant.obj", Error("line 5: bytes: 4097 is more than the limit 4096; raise LoadLimits::max_line_bytes")),
    ("not_utf8.obj", Warning(1, "line 5: not UTF-8")),
    ("no_faces.obj", Warning(0, "the scene has no triangles")),
    ("binary.obj", Warning(0, "the scene has no triangles")),
];

/// What is no scene.
const BESIDE: &[&str] = &[".gitattributes", "bad.mtl", "make.py"];

fn judge(name: &str, expected: &Outcome) -> Result<(), String> {
    let limits = lucerna::settings!(LoadLimits { max_line_bytes: 4096, ..LoadLimits::default() });
    let loaded = Scene::load(&fixture("malformed").join(name), &limits);
    match (loaded, expected) {
        (Err(error), Error(text)) => {
            let shown = error.to_string();
            let named = shown.contains(name);
            (named && shown.contains(text))
                .then_some(())
                .ok_or(format!("error without {text:?} or the file's name: {shown}"))
        }
        (Ok(loaded), Warning(n, text)) => {
            loaded.scene.validate().map_err(|e| e.to_string())?;
            let found = loaded.scene.n_triangles();
            if found != *n {
                return Err(format!("{found} triangles, expected {n}"));
            }
            let shown: Vec<String> = loaded.warnings.iter().map(|w| w.to_string()).collect();
            shown
                .iter()
                .any(|w| w.contains(text))
                .then_some(())
                .ok_or(format!("no warning with {text:?} in {shown:#?}"))
        }
        (Err(error), Warning(_, text)) => {
            Err(format!("expected warning {text:?}, got error {error}"))
        }
        (Ok(loaded), Error(text)) => {
            Err(format!("expected error {text:?}, got {:?}", loaded.warnings))
        }
    }
}

#[test]
fn each_gives_what_the_table_says() {
    let mut failures = Vec::new();
    for (name, expected) in TABLE {
        if let Err(problem) = judge(name, expected) {
            failures.push(format!("{name}: {problem}"));
        }
    }
    assert!(failures.is_empty(), "\n{}", failures.join("\n"));
}

#[test]
fn each_is_in_the_table() {
    let in_folder: BTreeSet<String> = std::fs::read_dir(fixture("malformed"))
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    let listed: BTreeSet<String> = TABLE
        .iter()
        .map(|(name, _)| name.to_string())
        .chain(BESIDE.iter().map(|name| name.to_string()))
        .collect();
    assert_eq!(listed.len(), TABLE.len() + BESIDE.len(), "listed twice");
    assert_eq!(in_folder, listed);
}
