// SPDX-License-Identifier: MIT OR Apache-2.0
//! A technique's indirect light by that of the path tracer, against the intervals in its page under `docs/techniques`:
//! a change for the worse shows, and so does one for the better, which the page then states.

use crate::harness::{Estimate, normal_limit};
use crate::session::{SIDE, Session, camera, upload};
use crate::support::{lambert, render, room, scene, settings};
use glam::{UVec2, Vec3};
use lucerna::gpu_scene::GpuScene;
use lucerna::scene::{Camera, Instance, Light, LoadLimits, Mesh, Scene};
use lucerna::settings;
use lucerna::techniques::Technique;
use lucerna::techniques::reference::{Channel, ReferenceSettings, resolve};
use std::path::Path;

/// Seeds that an estimate rests on.
const N_SEEDS: u32 = 8;
/// Paths of a pixel for each of as many seeds.
const N_PATHS: u32 = 128;
fn cornell() -> (Scene, Camera) {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/scenes");
    let file = root.join("cornell_original/cornell_original.gltf");
    let scene = Scene::load(&file, &LoadLimits::default()).unwrap().scene;
    let camera = scene.cameras[0].clone();
    (scene, camera)
}

/// A room of 8 m × 3 m × 4 m, with a double-sided table of 3 m × 1.6 m, 3 cm thick, and a lamp; or without the table.
fn hall(has_table: bool) -> (Scene, Camera) {
    let mut world = scene(room([8.0, 3.0, 4.0], 0), vec![lambert([0.7, 0.6, 0.5])]);
    world.lights.push(Light::Point {
        position: Vec3::new(3.1, 2.6, 1.7),
        intensity: Vec3::splat(5.0),
        range: None,
    });
    if has_table {
        world
            .materials
            .push(lucerna::scene::Material { double_sided: true, ..lambert([0.7, 0.6, 0.5]) });
        for side in room([3.0, 0.03, 1.6], 1) {
            // From outside.
            let triangles = side.triangles.iter().map(|&[a, b, c]| [a, c, b]).collect();
            world.meshes.push(Mesh { triangles, ..side });
            let world_from_object = glam::Affine3A::from_translation(Vec3::new(2.5, 0.7356, 1.2));
            world.instances.push(Instance { mesh: world.meshes.len() - 1, world_from_object });
        }
    }
    (world, camera([7.2, 1.9, 3.5], [2.5, 0.6, 1.2]))
}

/// The interval of a row `| name | low to high | … |` in a page, below the heading `## Bias`.
fn interval(page: &str, name: &str) -> [f64; 2] {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/techniques").join(page);
    let text = std::fs::read_to_string(&file).unwrap();
    let (_, section) =
        text.split_once("\n## Bias\n").unwrap_or_else(|| panic!("{page}: no heading Bias"));
    let row = section.lines().find(|line| line.starts_with(&format!("| {name} |")));
    let row = row.unwrap_or_else(|| panic!("{page}: no row `{name}`"));
    let numbers: Vec<f64> = row.split([' ', '|']).filter_map(|word| word.parse().ok()).collect();
    [numbers[0], numbers[1]]
}

/// Compares the scenes' ratios with the page's intervals. `n_frames`: before those that are shown, and those; `make`: the
/// technique for a scene, camera and seed.
pub fn check<T: Technique>(
    page: &str,
    n_frames: [u32; 2],
    make: &dyn Fn(&GpuScene, &Camera, u32) -> Session<T>,
) {
    let mut failures = Vec::new();
    for (name, (world, eye)) in
        [("Cornell box", cornell()), ("plain room", hall(false)), ("table in it", hall(true))]
    {
        let world = upload(&world);
        let truth = Estimate::of((0..N_SEEDS).map(|seed| {
            let settings = settings!(ReferenceSettings { seed, ..settings(SIDE, SIDE, 64) });
            let sums = render(&world, &eye, &settings, N_PATHS);
            mean(&resolve(&sums, UVec2::splat(SIDE), Channel::Indirect).rgb)
        }));
        let found = Estimate::of((0..N_SEEDS).map(|seed| {
            let mut session = make(&world, &eye, seed);
            session.run(&world, n_frames[0]);
            mean(&session.picture(&world, n_frames[1], Channel::Indirect))
        }));
        let ratio = found.mean / truth.mean;
        let error = ratio * (found.error / found.mean).hypot(truth.error / truth.mean);
        let [low, high] = interval(page, name);
        let shares = [found.error / found.mean, truth.error / truth.mean];
        println!("{name}: {ratio:.4} ± {error:.4} ({shares:.4?}), {low} to {high}");
        // The interval is of what is not chance.
        let chance = normal_limit(3) * error;
        if !(error < 0.005 && ratio > low - chance && ratio < high + chance) {
            failures.push(format!(
                "{name}: indirect light is {ratio:.4} ± {error:.4} of the path tracer's, docs/techniques/{page} says {low} to {high}"
            ));
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

/// Mean over pixels and colours.
fn mean(picture: &[Vec3]) -> f64 {
    picture.iter().map(|pixel| pixel.as_dvec3().element_sum()).sum::<f64>()
        / (3 * picture.len()) as f64
}
