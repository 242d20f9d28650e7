// SPDX-License-Identifier: MIT OR Apache-2.0
//! Walls at any angle, thin solids and curved shells, double-sided as most files are: no light through them, and as much on them as
//! the path tracer finds.

use crate::harness::{assert_each, read};
use crate::session::{Session, upload};
use crate::walls::{assert_leaks, assert_vaults, leaks, lights_on_tables, lights_under_vaults};
use crate::{cells, session};
use glam::UVec4;
use lucerna::components::voxel_light::Levels;
use lucerna::components::voxels::VoxelCounts;
use lucerna::scene::Camera;
use lucerna::settings;
use lucerna::techniques::voxel_cone::{VoxelCone, VoxelConeSettings};
use lucerna::testing::{House, around};

/// Of the lit part's light, the median house's dark part has at most 0.5 %, and the worst one's 2.5 %.
#[test]
fn little_light_leaks_through_walls_at_any_angle() {
    assert_leaks(leaks(&|world, camera, _| session(world, camera, cells(32)), 32), 0.025, 0.005);
}

/// Within 5 % of the path tracer. (Noise: see `voxel-rt`'s test of this.)
#[test]
fn thin_tables_are_lit_at_every_height() {
    let make = |world: &_, camera: &_, _: &_| session(world, camera, cells(32));
    let ratios = lights_on_tables(&make, 32, 8);
    assert_each("light on tables by the path tracer's", &ratios, "1 within 0.05", |ratio| {
        (ratio - 1.0).abs() < 0.05
    });
}

/// The light under a vault is within 10 % of the path tracer's, and its blocks differ by no more than 8 %, of which half is noise.
#[test]
fn thin_vaults_do_not_mix_their_sides() {
    let settings = settings!(VoxelConeSettings { n_cones: 16, n_bounce_cones: 16, ..cells(64) });
    let make = |world: &_, camera: &_, _: &_| session(world, camera, settings);
    assert_vaults(&lights_under_vaults(&make, 64), 0.1, 0.08);
}

/// A level that follows the camera has the surfels where it goes that one has which was made there, and those of before when it comes
/// back; the whole house's level keeps its own. (Of first records, whose order is that of the cells.)
#[test]
fn levels_that_scroll_keep_their_surfels() {
    let house = House::draw(6, 8.0 / 32.0);
    let world = upload(&house.scene);
    let [lit, dark] = house.eyes.map(|eye| around(eye)[0].clone());
    let settings = settings!(VoxelConeSettings { levels: Levels::Nested(2), ..cells(32) });
    let surfels_from = |session: &mut Session<VoxelCone>, camera: &Camera| -> [Vec<UVec4>; 2] {
        session.camera = camera.clone();
        session.run(&world, 1);
        let technique = &session.technique;
        let words: Vec<UVec4> =
            bytemuck::pod_collect_to_vec(&read(technique.surfels().unwrap().buffer()));
        [0, 1].map(|level| {
            let counts = read(&technique.buffers().counts[level]);
            let counts: VoxelCounts = bytemuck::pod_read_unaligned(&counts);
            let first = if level == 0 { 0 } else { 6 * technique.grid(0).capacity as usize };
            words[first..][..6 * counts.n_voxels as usize].to_vec()
        })
    };
    let mut one = session(&world, &dark, settings);
    let [before, there, again] = [&dark, &lit, &dark].map(|at| surfels_from(&mut one, at));
    let fresh = surfels_from(&mut session(&world, &lit, settings), &lit);
    assert!(before[0] != there[0], "the finer level's surfels around both cameras are the same");
    for (level, name) in ["finer", "coarser"].into_iter().enumerate() {
        assert!(!before[level].is_empty(), "the {name} level has no surfels");
        assert!(
            there[level] == fresh[level],
            "the {name} level's surfels, moved there and made there"
        );
        assert!(before[level] == again[level], "the {name} level's surfels, there and back");
    }
}
