// SPDX-License-Identifier: MIT OR Apache-2.0
//! Walls at any angle, thin solids and curved shells, double-sided as most files are, for each technique with voxels: light that
//! leaks, and light by what the path tracer finds.

use crate::harness::gpu;
use crate::session::{SIDE, Session, camera, upload};
use glam::{Quat, UVec2, Vec3};
use lucerna::blocking::render_reference;
use lucerna::gpu_scene::GpuScene;
use lucerna::scene::{Camera, Projection, Scene};
use lucerna::settings;
use lucerna::techniques::Technique;
use lucerna::techniques::reference::{Channel, ReferenceSettings, resolve};
use lucerna::testing::{House, around, room_with_table, vault};
use std::collections::BTreeMap;
use std::sync::Mutex;

/// Makes a session of a technique, of a scene on the GPU and on the CPU.
pub type Make<'a, T> = &'a dyn Fn(&GpuScene, &Camera, &Scene) -> Session<T>;

/// The path tracer's picture, up to 12 reflections.
pub fn reference(
    world: &GpuScene,
    camera: &Camera,
    size: u32,
    channel: Channel,
    n: u32,
) -> Vec<Vec3> {
    let settings = settings!(ReferenceSettings {
        size: UVec2::splat(size),
        n_bounces: 12,
        ..ReferenceSettings::default()
    });
    let (sums, _) = render_reference(gpu(), world, camera, &settings, n, |_| true).unwrap();
    resolve(&sums, settings.size, channel).rgb
}

pub fn sum(picture: &[Vec3]) -> f64 {
    picture.iter().map(|pixel| f64::from(pixel.element_sum())).sum()
}

/// The share of a house's light that is in its dark part, for each of twelve (`lucerna bench leaks` has a hundred).
pub fn leaks<T: Technique>(make: Make<T>, cells: u32) -> Vec<f64> {
    let of_house = |seed| {
        let house = House::draw(seed, 8.0 / cells as f32);
        let world = upload(&house.scene);
        let eye = around(house.eyes[0])[0].clone();
        let mut session = make(&world, &eye, &house.scene);
        session.run(&world, 24);
        let [lit, dark] = house.eyes.map(|eye| -> f64 {
            around(eye)
                .into_iter()
                .map(|camera| {
                    session.camera = camera;
                    sum(&session.picture(&world, 2, Channel::Indirect))
                })
                .sum()
        });
        println!("house {seed}: {:.3} %", 100.0 * dark / lit);
        dark / lit
    };
    (0..12).map(of_house).collect()
}

/// Fails if more light leaks in the worst house, or in the median one.
pub fn assert_leaks(mut leaks: Vec<f64>, worst: f64, median: f64) {
    leaks.sort_by(f64::total_cmp);
    assert!(
        leaks[11] < worst && leaks[6] < median,
        "shares of light in the dark parts of twelve houses: {leaks:.5?}, expected below {worst} in the worst and {median} in the median one"
    );
}

/// What the path tracer finds on tables.
static EXPECTED: Mutex<BTreeMap<[usize; 3], f64>> = Mutex::new(BTreeMap::new());

/// Indirect light on the top of a table by the path tracer's, wherever it stands among the cells: so many heights, four
/// thicknesses from 0.2 to 2 cells, single- and double-sided, along each of the axes, each in turn.
pub fn lights_on_tables<T: Technique>(make: Make<T>, cells: u32, n_heights: usize) -> Vec<f64> {
    let cell = 8.0 / cells as f32;
    let down_on = |at: Vec3, up: usize| Camera {
        name: String::new(),
        position: at + 0.5 * Vec3::AXES[up],
        forward: -Vec3::AXES[up],
        up: Vec3::AXES[(up + 1) % 3],
        projection: Projection::Orthographic { half_height: 0.7 },
    };
    let of_step = |step: usize| {
        let top = 0.9 + cell * (step as f32 + 0.25) / n_heights as f32;
        // The room turned, and the middle of its table.
        let up = step % 3;
        let at = [Vec3::new(top, 2.0, 4.0), Vec3::new(4.0, top, 2.0), Vec3::new(2.0, 4.0, top)][up];
        let view = down_on(at, up);
        let (thickness, double_sided) =
            ([0.2, 0.7, 1.3, 2.0][step % 4], (step / 4).is_multiple_of(2));
        let scene = room_with_table(top, thickness * cell, double_sided, up);
        let world = upload(&scene);
        // (Some tests look at the same tables with more than one setting.)
        let mut known = EXPECTED.lock().unwrap();
        let expected = *known.entry([step, n_heights, cells as usize]).or_insert_with(|| {
            let picture = reference(&world, &view, 16, Channel::Indirect, 384);
            sum(&picture) / picture.len() as f64
        });
        drop(known);
        let mut session = make(&world, &view, &scene);
        session.run(&world, 44);
        let ratio = session.mean(&world, 4, Channel::Indirect).element_sum() / expected;
        println!(
            "top at {top}, {thickness} cells thick, double-sided {double_sided}, axis {up}: {ratio:.3}"
        );
        ratio
    };
    (0..n_heights).map(of_step).collect()
}

/// What a camera sees by what the path tracer finds: the mean, and the root mean square of how far blocks of 4 × 4 pixels are off
/// it, with the noise of both.
pub fn compared<T: Technique>(
    make: Make<T>,
    scene: &Scene,
    camera: &Camera,
    n_samples: u32,
) -> [f64; 2] {
    let world = upload(scene);
    let mut session = make(&world, camera, scene);
    session.run(&world, 40);
    let found = session.picture(&world, 8, Channel::Indirect);
    let expected = reference(&world, camera, SIDE, Channel::Indirect, n_samples);
    let (side, n_blocks) = (SIDE as usize, SIDE as usize / 4);
    let block = |picture: &[Vec3], ix: usize| {
        let (x, y) = (ix % n_blocks * 4, ix / n_blocks * 4);
        let rows = (y..y + 4).map(|row| sum(&picture[row * side + x..][..4]));
        rows.sum::<f64>()
    };
    let ratios: Vec<f64> =
        (0..n_blocks * n_blocks).map(|ix| block(&found, ix) / block(&expected, ix)).collect();
    let mean = ratios.iter().sum::<f64>() / ratios.len() as f64;
    let square = ratios.iter().map(|ratio| (ratio / mean - 1.0).powi(2)).sum::<f64>();
    [mean, (square / ratios.len() as f64).sqrt()]
}

/// What [`compared`] says of a vault between a dim lamp and a bright one, seen from below, for thicknesses from a sheet to 3 cells,
/// and turned one way or another.
pub fn lights_under_vaults<T: Technique>(make: Make<T>, cells: u32) -> Vec<[f64; 2]> {
    let turned = Quat::from_rotation_y(0.6) * Quat::from_rotation_x(0.3);
    let thicknesses = [(0.0, turned), (0.5, Quat::IDENTITY), (1.2, turned), (3.0, Quat::IDENTITY)];
    let of_vault = |(thickness, turned): (f32, Quat)| {
        let at = |p: [f32; 3]| (turned * Vec3::from(p)).to_array();
        let camera = Camera {
            projection: Projection::Perspective { vertical_fov: 1.0 },
            ..camera(at([1.5, 0.6, 0.0]), at([-0.5, 2.4, 0.2]))
        };
        let scene = vault(thickness * 8.0 / cells as f32, turned);
        let [mean, bands] = compared(make, &scene, &camera, 1024);
        println!("{thickness} cells, turned {turned}: mean {mean:.3}, bands {bands:.3}");
        [mean, bands]
    };
    thicknesses.map(of_vault).to_vec()
}

/// Fails if a mean is off 1, or bands are wider, by more than this.
pub fn assert_vaults(found: &[[f64; 2]], mean: f64, bands: f64) {
    assert!(
        found.iter().all(|of| (of[0] - 1.0).abs() < mean && of[1] < bands),
        "light under vaults by the path tracer's, and by how much its blocks differ: {found:.3?}; expected 1 within {mean}, and below {bands}"
    );
}
