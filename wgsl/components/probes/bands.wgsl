// SPDX-License-Identifier: MIT OR Apache-2.0
//! Which bands of spherical harmonics probes keep: 0 to 2.
//!
//! Interface: `KEPT_COEFFICIENTS`, `place_of_coefficient`, `band_factor`. The variant `basis=sh4` also has band 4.
#define_import_path lucerna::components::probes::bands

#import lucerna::components::probes::gathered::COEFFICIENTS
#import lucerna::sh::basis::sh_band

/// Coefficients that are packed.
const KEPT_COEFFICIENTS: u32 = 9u;

/// Where a probe's coefficient is among all that were gathered. `capacity`: room for probes.
fn place_of_coefficient(probe: u32, k: u32, capacity: u32) -> u32 {
    return probe * COEFFICIENTS + k;
}

/// The factor of a coefficient's band. `window`: of the bands 0, 1, 2 and 4.
fn band_factor(k: u32, window: vec4<f32>) -> f32 {
    return window[sh_band(k)];
}
