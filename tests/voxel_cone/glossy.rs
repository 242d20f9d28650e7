// SPDX-License-Identifier: MIT OR Apache-2.0
//! What glossy surfaces mirror, against the path tracer.

use crate::harness::gpu;
use crate::session::{SIDE, Session};
use glam::{UVec2, Vec3};
use lucerna::gpu_scene::GpuScene;
use lucerna::scene::{LoadLimits, Scene};
use lucerna::settings;
use lucerna::techniques::reference::{Channel, ReferenceSettings, resolve};
use lucerna::techniques::voxel_cone::{Specular, VoxelCone, VoxelConeSettings};
use std::path::Path;

struct Fixture {
    on_gpu: GpuScene,
    camera: lucerna::scene::Camera,
}

fn fixture() -> Fixture {
    let file = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("fixtures/scenes/glossy_floor/glossy_floor.gltf");
    let scene = Scene::load(&file, &LoadLimits::default()).unwrap().scene;
    let camera = scene.cameras[0].clone();
    Fixture { on_gpu: GpuScene::new(gpu(), &scene, Default::default()).unwrap(), camera }
}

fn indirect(of: &Fixture, settings: VoxelConeSettings) -> Vec<Vec3> {
    let technique = VoxelCone::new(gpu(), &of.on_gpu, settings, of.camera.position).unwrap();
    let mut session = Session::of(&of.on_gpu, &of.camera, technique);
    session.run(&of.on_gpu, 32);
    session.picture(&of.on_gpu, 16, Channel::Indirect)
}

/// Energy of what the floor mirrors (the red channel less the blue one: only the panel is red), and where its middle is [pixels].
fn highlight(picture: &[Vec3]) -> (f32, f32, f32) {
    // The lower half is floor.
    let (mut sum, mut x_sum, mut y_sum) = (0.0, 0.0, 0.0);
    for y in SIDE / 2..SIDE {
        for x in 0..SIDE {
            let pixel = picture[(y * SIDE + x) as usize];
            let red = (pixel.x - pixel.z).max(0.0);
            sum += red;
            x_sum += red * x as f32;
            y_sum += red * y as f32;
        }
    }
    (sum, x_sum / sum, y_sum / sum)
}

/// A lit red panel over a rough metal floor: its mirror image stands where the path tracer's does, within a pixel of 24, and has
/// its energy within 20 %; with the source's single cone within 25 %. Without specular light it is missing.
#[test]
fn a_panel_is_mirrored_in_a_glossy_floor() {
    let fixture = fixture();
    let settings =
        settings!(ReferenceSettings { n_bounces: 8, ..crate::support::settings(SIDE, SIDE, 0) });
    let sums = crate::support::render(&fixture.on_gpu, &fixture.camera, &settings, 512);
    let expected = highlight(&resolve(&sums, UVec2::splat(SIDE), Channel::Indirect).rgb);
    let base = crate::prefiltered(64);
    let found = highlight(&indirect(&fixture, base));
    let without = highlight(&indirect(
        &fixture,
        settings!(VoxelConeSettings { specular: Specular::Off, ..base }),
    ));
    let fixed = highlight(&indirect(
        &fixture,
        settings!(VoxelConeSettings { specular: Specular::Fixed(10.0), ..base }),
    ));
    eprintln!("path tracer {expected:?}, cones {found:?}, without {without:?}, 10° {fixed:?}");
    assert!(
        (found.0 / expected.0 - 1.0).abs() < 0.2,
        "energy of the mirrored panel by cones is {}, expected the path tracer's {} within 20 %",
        found.0,
        expected.0
    );
    assert!(
        (found.1 - expected.1).abs() < 1.0 && (found.2 - expected.2).abs() < 1.0,
        "middle of the mirrored panel by cones is at pixel ({}, {}), expected the path tracer's ({}, {}) within 1",
        found.1,
        found.2,
        expected.1,
        expected.2
    );
    assert!(
        without.0 < 0.3 * expected.0,
        "energy of the mirrored panel without specular light is {}, expected below 0.3 of the path tracer's {}",
        without.0,
        expected.0
    );
    assert!(
        fixed.0 != found.0 && (fixed.0 / expected.0 - 1.0).abs() < 0.25,
        "energy of the mirrored panel by cones of 10° is {}, expected the path tracer's {} within 25 %, and another than the usual cones' {}",
        fixed.0,
        expected.0,
        found.0
    );
}

/// The block stands closer than where cones begin, so that it is missing from what they mirror: screen-space specular
/// occlusion darkens the floor before it, and leaves the rest of the mirror image alone.
#[test]
fn what_stands_close_by_hides_what_is_mirrored() {
    let mut fixture = fixture();
    // Close to the block's foot.
    fixture.camera = crate::session::camera([0.25, 0.5, 0.6], [0.25, 0.0, -0.7]);
    let settings =
        settings!(ReferenceSettings { n_bounces: 8, ..crate::support::settings(SIDE, SIDE, 0) });
    let sums = crate::support::render(&fixture.on_gpu, &fixture.camera, &settings, 512);
    let expected = resolve(&sums, UVec2::splat(SIDE), Channel::Indirect).rgb;
    let base = crate::prefiltered(64);
    let with = indirect(&fixture, base);
    let without =
        indirect(&fixture, settings!(VoxelConeSettings { occludes_specular: false, ..base }));
    let red = |picture: &[Vec3], x: [u32; 2], y: [u32; 2]| -> f32 {
        let row = |y: u32| (x[0]..=x[1]).map(move |x| picture[(y * SIDE + x) as usize].x);
        (y[0]..=y[1]).flat_map(row).sum()
    };
    // The two rows of pixels before the block's foot, and the mirror image well before them.
    let [near, off, on] =
        [&expected, &without, &with].map(|picture| red(picture, [10, 13], [11, 12]));
    let [far_off, far_on] = [&without, &with].map(|picture| red(picture, [6, 14], [14, 20]));
    eprintln!("before the block: path tracer {near}, with {on}, without {off}");
    assert!(
        off > 1.5 * near,
        "red light before the block without occlusion is {off}, expected above 1.5 of the path tracer's {near} for a test"
    );
    assert!(
        on > 0.8 * near && on - near < 0.75 * (off - near),
        "red light before the block with occlusion is {on}, expected above 0.8 of the path tracer's {near} and closer to it than 0.75 of the way from {off} without"
    );
    assert!(
        (far_on / far_off - 1.0).abs() < 0.05,
        "red light of the mirror image away from the block with occlusion is {far_on}, expected {far_off} as without, within 5 %"
    );
}
