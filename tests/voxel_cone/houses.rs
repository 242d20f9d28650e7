// SPDX-License-Identifier: MIT OR Apache-2.0
//! Walls at any angle, thin solids and curved shells, double-sided as most files are: no light through them, and as much on them as
//! the path tracer finds.

use crate::harness::assert_each;
use crate::walls::{assert_leaks, assert_vaults, leaks, lights_on_tables, lights_under_vaults};
use crate::{cells, session};
use lucerna::settings;
use lucerna::techniques::voxel_cone::VoxelConeSettings;

/// Of the lit part's light, the median house's dark part has at most 0.5 %, and the worst one's 2.5 %.
#[test]
fn little_light_leaks_through_walls_at_any_angle() {
    assert_leaks(leaks(&|world, camera| session(world, camera, cells(32)), 32), 0.025, 0.005);
}

/// Within 5 % of the path tracer. (Noise: see `voxel-rt`'s test of this.)
#[test]
fn thin_tables_are_lit_at_every_height() {
    let make = |world: &_, camera: &_| session(world, camera, cells(32));
    let ratios = lights_on_tables(&make, 32, 8);
    assert_each("light on tables by the path tracer's", &ratios, "1 within 0.05", |ratio| {
        (ratio - 1.0).abs() < 0.05
    });
}

/// The light under a vault is within 10 % of the path tracer's, and its blocks differ by no more than 8 %, of which half is noise.
#[test]
fn thin_vaults_do_not_mix_their_sides() {
    let settings = settings!(VoxelConeSettings { n_cones: 16, n_bounce_cones: 16, ..cells(64) });
    let make = |world: &_, camera: &_| session(world, camera, settings);
    assert_vaults(&lights_under_vaults(&make, 64), 0.1, 0.08);
}
