// SPDX-License-Identifier: MIT OR Apache-2.0
//! The white furnace: a closed box whose walls reflect ρ and emit L_e; every point has the radiance
//! L_e/(1 − ρ) in every direction.

use crate::harness::{KeepNan, Largest};
use crate::session::{camera, upload};
use crate::support::{lambert, room, scene};
use crate::{cells, prefiltered, session};
use glam::{DVec3, UVec3, Vec3};
use lucerna::components::voxel_light::{Bounces, Levels};
use lucerna::components::voxel_pyramid::{ConeStepping, PyramidStorage};
use lucerna::components::voxels::Resolution;
use lucerna::scene::{Material, Scene};
use lucerna::settings;
use lucerna::techniques::reference::Channel;
use lucerna::techniques::voxel_cone::VoxelConeSettings;

const EMISSION: [f32; 3] = [0.7, 1.0, 0.25];

fn furnace(albedo: f32) -> Scene {
    let material = Material { emission: EMISSION.into(), ..lambert([albedo; 3]) };
    scene(room([2.0, 1.0, 3.0], 0), vec![material])
}

/// Indirect light relative to L_e·Σ ρᵏ, k from 2 on (to `n` if bounces are counted): the mean, and the
/// least and the most of a pixel.
fn found(albedo: f32, n_frames: u32, settings: VoxelConeSettings) -> [f64; 3] {
    let world = upload(&furnace(albedo));
    let mut session = session(&world, &camera([0.7, 0.6, 0.4], [1.0, 0.4, 1.4]), settings);
    session.run(&world, n_frames);
    let rho = f64::from(albedo);
    let sum = match settings.bounces {
        Bounces::UpTo(n) => (2..=n as i32 + 1).map(|k| rho.powi(k)).sum(),
        Bounces::Unlimited => rho * rho / (1.0 - rho),
    };
    let expected = Vec3::from(EMISSION).as_dvec3() * sum;
    let picture = session.picture(&world, 16, Channel::Indirect);
    let shares: Vec<DVec3> = picture.iter().map(|pixel| pixel.as_dvec3() / expected).collect();
    let mean = shares.iter().sum::<DVec3>() / shares.len() as f64;
    let least = shares.iter().flat_map(|share| share.to_array()).fold(f64::MAX, f64::min_nan);
    let most = shares.iter().map(|share| share.largest()).fold(0.0, f64::max_nan);
    eprintln!("albedo {albedo}, {settings:?}: {mean}, pixels {least} to {most}");
    [mean.y, least, most]
}

/// What one bounce keeps of the light: cones that are as wide as the box is high read cells in which its edges, a voxel thin,
/// leave a quarter open, and what slips through them is lost.
const KEPT: std::ops::Range<f64> = 0.88..0.98;

/// Narrow cells and short steps: what is lost is the method's prefiltering, not its sums.
fn fine() -> ConeStepping {
    ConeStepping { step_scale: 0.1, mip_bias: -4.0, ..ConeStepping::default() }
}

/// Reflected without end, of the share g that a bounce keeps becomes g(1 − ρ)/(1 − gρ).
fn of_all_bounces(kept: f64, albedo: f64) -> f64 {
    kept * (1.0 - albedo) / (1.0 - kept * albedo)
}

/// From surfel to surfel nothing is lost: every sum is that of the closed form within 1.5 %, but for the noise of single pixels and
/// what looks into a corner. (After 80 rounds at albedo 0.95, 0.95⁸⁰ = 1.7 % are missing; after 160, 0.03 %.)
#[test]
fn surfels_keep_all_light() {
    let levels = settings!(VoxelConeSettings { levels: Levels::Nested(3), ..cells(24) });
    let odd = Resolution::Size(UVec3::new(27, 19, 37));
    let odd = settings!(VoxelConeSettings { resolution: odd, ..cells(1) });
    let fast = settings!(VoxelConeSettings { bounce_period: 1, ..cells(24) });
    let counted = |n| settings!(VoxelConeSettings { bounces: Bounces::UpTo(n), ..cells(24) });
    for (albedo, n_frames, settings) in [
        (0.5, 32, cells(32)),
        (0.5, 24, cells(16)),
        (0.5, 32, levels),
        (0.5, 32, odd),
        (0.8, 24, counted(1)),
        (0.8, 24, counted(3)),
        (0.95, 160, fast),
    ] {
        let [mean, least, most] = found(albedo, n_frames, settings);
        assert!(
            (mean - 1.0).abs() < 0.015 && least > 0.9 && most < 1.04,
            "{settings:?}: the mean of pixels is {mean} of the closed form's light, expected 1 within 0.015; pixels are {least} to {most} of it, expected within 0.9 to 1.04"
        );
    }
}

/// Cones mix what they pass with weights that sum to 1 or less, so nothing can come out too bright but what the direct light's
/// noise makes so.
fn converges(albedo: f32, n_frames: u32, settings: VoxelConeSettings) {
    let [mean, least, most] = found(albedo, n_frames, settings);
    let expected = |kept| of_all_bounces(kept, f64::from(albedo));
    assert!((expected(KEPT.start)..expected(KEPT.end)).contains(&mean), "{mean}");
    assert!(least > expected(0.75) && most < 1.03, "{least} to {most}");
}

#[test]
fn furnace_converges() {
    converges(0.5, 32, prefiltered(32));
}

#[test]
fn furnace_with_fine_steps_is_exact_to_4_percent() {
    let settings = settings!(VoxelConeSettings { stepping: fine(), ..prefiltered(24) });
    let [mean, least, most] = found(0.5, 24, settings);
    assert!((mean - 1.0).abs() < 0.04, "{mean}");
    // The darkest pixel looks into a corner, where cones begin as high as a cell and a half is.
    assert!(least > 0.88 && most < 1.04, "{least} to {most}");
}

#[test]
fn furnace_in_buffers_converges() {
    converges(
        0.5,
        24,
        settings!(VoxelConeSettings {
            storage: PyramidStorage::Buffers,
            n_bounce_cones: 5,
            ..prefiltered(16)
        }),
    );
}

#[test]
fn furnace_of_three_levels_converges() {
    converges(
        0.5,
        32,
        settings!(VoxelConeSettings { levels: Levels::Nested(3), ..prefiltered(24) }),
    );
}

/// A box of cells that is no power of two along any axis.
#[test]
fn furnace_in_a_grid_of_odd_sizes_converges() {
    let resolution = Resolution::Size(UVec3::new(27, 19, 37));
    converges(0.5, 32, settings!(VoxelConeSettings { resolution, ..prefiltered(1) }));
}

/// At albedo 0.95 light is reflected some twenty times; each share that a bounce loses counts as often. It stays bounded: what
/// it converges to is not above the truth, and nothing moves any more.
#[test]
fn furnace_of_albedo_95_is_stable() {
    let settings = settings!(VoxelConeSettings { bounce_period: 1, ..prefiltered(24) });
    let [half, _, _] = found(0.95, 80, settings);
    let [whole, _, most] = found(0.95, 160, settings);
    let expected = |kept| of_all_bounces(kept, 0.95);
    assert!(
        (expected(KEPT.start)..expected(KEPT.end)).contains(&whole) && most < 1.03,
        "{whole}, {most}"
    );
    assert!((whole / half - 1.0).abs() < 0.03, "{half} and later {whole}");
}

/// Of n bounces exactly the light of n: each adds what is kept of its share of the geometric sum.
#[test]
fn bounces_are_counted() {
    let rho = 0.8;
    let share = |n| {
        let settings =
            settings!(VoxelConeSettings { bounces: Bounces::UpTo(n), ..prefiltered(24) });
        let [mean, least, most] = found(rho as f32, 24, settings);
        assert!(least > 0.7 && most < 1.03, "{n}: {least} to {most}");
        mean
    };
    let kept = share(1);
    assert!(KEPT.contains(&kept), "{kept}");
    for n in [2, 3] {
        let light = |kept: f64| (1..=n as i32).map(|k| (kept * rho).powi(k)).sum::<f64>();
        let expected = light(kept) / light(1.0);
        let found = share(n);
        assert!((found / expected - 1.0).abs() < 0.02, "{n}: {found} for {expected}");
    }
}

/// Of 64 frames, each face has its turn once: after 4 of them the light that was reflected among voxels is there by a sixteenth,
/// where it is whole with a turn in each frame. (The first reflection is there from the first frame on.)
#[test]
fn bounces_are_spread_over_the_period() {
    let after_4 = |bounces, bounce_period| {
        let settings = settings!(VoxelConeSettings { bounces, bounce_period, ..prefiltered(24) });
        let world = upload(&furnace(0.8));
        let mut session = session(&world, &camera([0.7, 0.6, 0.4], [1.0, 0.4, 1.4]), settings);
        session.run(&world, 4);
        session.mean(&world, 1, Channel::Indirect).y
    };
    let first = after_4(Bounces::UpTo(1), 1);
    let further = [1, 64].map(|period| after_4(Bounces::Unlimited, period) - first);
    assert!(further[0] > 0.5 * first, "{further:?} beyond {first}");
    assert!(further[1] > 0.0 && further[1] < 0.2 * further[0], "{further:?} beyond {first}");
}
