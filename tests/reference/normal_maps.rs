// SPDX-License-Identifier: MIT OR Apache-2.0
//! Normal maps, by the irradiance of a directional light: E·max(0, n·l).

use crate::harness::assert_each;
use crate::support::{add_texture, floor, look_down, on_gpu, render, scene, settings};
use glam::{DVec3, UVec2, Vec2, Vec3, Vec4};
use lucerna::gpu_scene::RaySource;
use lucerna::scene::{Light, Material};
use lucerna::settings;
use lucerna::techniques::reference::{Channel, ReferenceSettings, resolve};

/// To the light; all cosines below stay positive.
const TO_LIGHT: DVec3 = DVec3::new(0.36, 0.8, -0.48);

struct Case {
    what: &'static str,
    texel: [u8; 3],
    scale: f32,
    /// Of the mesh's coordinates, before the floor's u along +X and v along +Z.
    uv: fn(Vec2) -> Vec2,
    tangent: Option<Vec4>,
    /// Where the map's x and y point on the floor.
    axes: [DVec3; 2],
}

const SAME: fn(Vec2) -> Vec2 = |uv| uv;

fn irradiance(case: &Case, with_map: bool) -> f64 {
    let mut world = scene(vec![floor(10.0, 0.0, 0)], vec![Material::default()]);
    for uv in &mut world.meshes[0].uv0 {
        *uv = (case.uv)(*uv);
    }
    if let Some(tangent) = case.tangent {
        world.meshes[0].normals = vec![Vec3::Y; 4];
        world.meshes[0].tangents = vec![tangent; 4];
    }
    let [x, y, z] = case.texel;
    let texture = add_texture(&mut world, 1, vec![[x, y, z, 255]]);
    if with_map {
        world.materials[0].normal_texture = Some(texture);
        world.materials[0].normal_scale = case.scale;
    }
    world.lights =
        vec![Light::Directional { direction: -TO_LIGHT.as_vec3(), irradiance: Vec3::ONE }];
    let world = on_gpu(&world, false, RaySource::Software);
    let settings = settings!(ReferenceSettings { irradiance: true, ..settings(4, 4, 0) });
    let sums = render(&world, &look_down(1.0, 1.0), &settings, 4);
    let picture = resolve(&sums, UVec2::splat(4), Channel::Irradiance);
    let first = picture.rgb[0].x;
    // Rounding of interpolated tangents.
    assert_each(
        &format!("{}: irradiance of pixels", case.what),
        &picture.rgb,
        &format!("{first} within 1e-5"),
        |pixel| (pixel.x - first).abs() < 1e-5,
    );
    f64::from(first)
}

/// Tolerance 1e-4: tangents and normals are packed to 16 bits an axis (2e-5 each).
#[test]
fn normal_maps_tilt_as_gltf_says() {
    // The image's y points up, against v.
    let axes = [DVec3::X, DVec3::NEG_Z];
    let case =
        Case { what: "flat", texel: [128, 128, 255], scale: 1.0, uv: SAME, tangent: None, axes };
    let tilted = 218; // 2·218/255 − 1 = 0.7098: 45° to within 0.3°.
    let cases = [
        Case { what: "45° along u", texel: [tilted, 128, tilted], ..case },
        Case { what: "45° against v", texel: [128, tilted, tilted], ..case },
        Case { what: "scaled by a half", texel: [tilted, 60, tilted], scale: 0.5, ..case },
        Case {
            what: "u mirrored",
            texel: [tilted, 200, tilted],
            uv: |uv| Vec2::new(-uv.x, uv.y),
            axes: [DVec3::NEG_X, DVec3::NEG_Z],
            ..case
        },
        Case {
            what: "v mirrored",
            texel: [tilted, 60, tilted],
            uv: |uv| Vec2::new(uv.x, 1.0 - uv.y),
            axes: [DVec3::X, DVec3::Z],
            ..case
        },
        Case {
            what: "a quarter turn",
            texel: [tilted, 60, tilted],
            uv: |uv| Vec2::new(uv.y, -uv.x),
            axes: [DVec3::Z, DVec3::X],
            ..case
        },
        Case {
            what: "tangents given",
            texel: [tilted, 60, tilted],
            tangent: Some(Vec4::new(0.6, 0.0, -0.8, 1.0)),
            // cross(n, t).
            axes: [DVec3::new(0.6, 0.0, -0.8), DVec3::new(-0.8, 0.0, -0.6)],
            ..case
        },
        Case {
            what: "tangents given, mirrored",
            texel: [tilted, 60, tilted],
            tangent: Some(Vec4::new(0.6, 0.0, -0.8, -1.0)),
            axes: [DVec3::new(0.6, 0.0, -0.8), DVec3::new(0.8, 0.0, 0.6)],
            ..case
        },
        case,
    ];
    let mut failures = Vec::new();
    for case in &cases {
        let [x, y, z] = case.texel.map(|byte| 2.0 * f64::from(byte) / 255.0 - 1.0);
        let scale = f64::from(case.scale);
        let n = case.axes[0] * x * scale + case.axes[1] * y * scale + DVec3::Y * z;
        let expected = n.normalize().dot(TO_LIGHT).max(0.0);
        let found = irradiance(case, true);
        println!("{}: {found:.6}, expected {expected:.6}", case.what);
        if (found - expected).abs() > 1e-4 {
            failures.push(format!("{}: {found}, expected {expected} within 1e-4", case.what));
        }
    }
    assert!(failures.is_empty(), "irradiance with a normal map: {failures:#?}");
}

/// 128 stands for 0.0039, so a flat map turns the normal by 0.32°; the cosine with a light at 37°
/// changes by at most sin 37° · 0.0055.
#[test]
fn a_flat_normal_map_changes_nothing_more_than_its_bytes_say() {
    let axes = [DVec3::X, DVec3::NEG_Z];
    let case =
        Case { what: "flat", texel: [128, 128, 255], scale: 1.0, uv: SAME, tangent: None, axes };
    let (with, without) = (irradiance(&case, true), irradiance(&case, false));
    assert!(
        (without - TO_LIGHT.y).abs() < 2e-5,
        "irradiance without a map is {without}, expected {} within 2e-5",
        TO_LIGHT.y
    );
    assert!(
        (with - without).abs() < 0.6 * 0.0056,
        "irradiance with a flat map is {with}, expected {without} as without within {:.2e}",
        0.6 * 0.0056
    );
}
