// SPDX-License-Identifier: MIT OR Apache-2.0
//! The Cornell box against pictures from another path tracer.

use crate::harness::{Largest, ray_query_gpu};
use crate::support::{on_gpu, render, settings};
use glam::DVec3;
use lucerna::gpu_scene::RaySource;
use lucerna::picture::Picture;
use lucerna::scene::{LoadLimits, Scene};
use lucerna::settings;
use lucerna::techniques::reference::{Channel, ReferenceSettings, resolve};
use std::path::Path;

/// Noise of the references (relative RMSE of 64² pixels): what was measured at 256² pixels,
/// 4096 samples each, over √16 for the mean of 4 × 4 of them.
const REFERENCE_NOISE: [(&str, f64); 3] =
    [("full", 0.00308 / 4.0), ("direct", 0.00282 / 4.0), ("indirect", 0.0229 / 4.0)];
const SAMPLES: u32 = 128;

fn rmse(a: &[DVec3], b: &[DVec3], counts: &[bool]) -> f64 {
    let pairs = || a.iter().zip(b).zip(counts).filter(|(_, counts)| **counts);
    let sum: f64 = pairs().map(|((a, b), _)| (*a - *b).length_squared()).sum();
    (sum / (3.0 * pairs().count() as f64)).sqrt()
}

fn mean(picture: &[DVec3]) -> DVec3 {
    picture.iter().sum::<DVec3>() / picture.len() as f64
}

/// Two renderings of different seeds: their mean is compared, their difference gives its noise,
/// rmse(a, b)/2 (each has rmse/√2, their mean 1/√2 of that).
///
/// * Mean of each colour within 1 %. Its statistical error is the pixels' over √(64²): below 0.1 %.
/// * RMSE (without the pixels that see the lamp: at its edge a sample is 18 or 0.3, as the jitter falls)
///   at most 1.5 × √(our noise² + the reference's²). Were both without bias the quotient would
///   be 1, known to about 1/√(2·64²) and the heavier tails of fireflies.
fn cornell(rays: RaySource) {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures");
    let file = root.join("scenes/cornell_original/cornell_original.gltf");
    let scene = Scene::load(&file, &LoadLimits::default()).unwrap().scene;
    let world = on_gpu(&scene, true, rays);
    // 8 segments: 7 reflections, 6 after the first.
    let renders = [1, 2].map(|seed| {
        let settings = settings!(ReferenceSettings { seed, ..settings(64, 64, 6) });
        render(&world, &scene.cameras[0], &settings, SAMPLES)
    });
    let read = |name: &str| -> Vec<DVec3> {
        let picture = Picture::read(root.join(format!("reference/cornell_64_{name}.exr"))).unwrap();
        picture.rgb.iter().map(|c| c.as_dvec3()).collect()
    };
    // The lamp is at 18.4, what it lights nearby below 1.
    let counts: Vec<_> = read("direct").iter().map(|c| c.x < 1.0).collect();
    let mut failures = Vec::new();
    for (name, reference_noise) in REFERENCE_NOISE {
        let reference = read(name);
        let channels: &[Channel] = match name {
            "full" => &[Channel::Beauty],
            "direct" => &[Channel::Emitted, Channel::Direct],
            _ => &[Channel::Indirect],
        };
        let [a, b] = [0, 1].map(|ix| {
            let mut sum = vec![DVec3::ZERO; 64 * 64];
            for &channel in channels {
                let picture = resolve(&renders[ix], settings(64, 64, 6).size, channel);
                sum.iter_mut().zip(&picture.rgb).for_each(|(sum, c)| *sum += c.as_dvec3());
            }
            sum
        });
        let ours: Vec<_> = a.iter().zip(&b).map(|(a, b)| 0.5 * (*a + *b)).collect();
        let (found, truth) = (mean(&ours), mean(&reference));
        let bias = (found / truth - 1.0).largest();
        let scale = truth.element_sum() / 3.0;
        let our_noise = 0.5 * rmse(&a, &b, &counts) / scale;
        let difference = rmse(&ours, &reference, &counts) / scale;
        let expected = our_noise.hypot(reference_noise);
        println!(
            "{name}: means {found:.5} against {truth:.5}: {:.3} % off; relative RMSE {difference:.5}, noise {expected:.5} (ours {our_noise:.5}): quotient {:.3}",
            100.0 * bias,
            difference / expected
        );
        if bias > 0.01 || difference > 1.5 * expected {
            failures.push(format!("{name}: means {found:.5}, expected {truth:.5}: off by {:.3} %, at most 1 %; relative RMSE {difference:.5}, expected at most {:.5}", 100.0 * bias, 1.5 * expected));
        }
    }
    assert!(failures.is_empty(), "pictures against another path tracer's: {failures:#?}");
}

#[test]
fn cornell_box_agrees_with_another_path_tracer() {
    cornell(RaySource::Software);
}

#[test]
fn ray_query_cornell_box_agrees_with_another_path_tracer() {
    if ray_query_gpu().is_some() {
        cornell(RaySource::RayQuery);
    }
}
