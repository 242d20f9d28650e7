// SPDX-License-Identifier: MIT OR Apache-2.0
//! Which bands of spherical harmonics probes keep: 0 to 2, and 4. (Band 3 adds nothing to irradiance.)
//!
//! Interface: `KEPT_COEFFICIENTS`, `place_of_coefficient`, `band_factor`.
#define_import_path lucerna::components::probes::bands

#import lucerna::components::probes::gathered::COEFFICIENTS
#import lucerna::sh::basis::sh_band

/// Coefficients that are packed.
const KEPT_COEFFICIENTS: u32 = 18u;

/// Where a probe's coefficient is among all that were gathered: those of band 4 after all others. `capacity`: room for probes.
fn place_of_coefficient(probe: u32, k: u32, capacity: u32) -> u32 {
    if k < COEFFICIENTS {
        return probe * COEFFICIENTS + k;
    }
    return (capacity + probe) * COEFFICIENTS + k - COEFFICIENTS;
}

/// The factor of a coefficient's band. `window`: of the bands 0, 1, 2 and 4.
fn band_factor(k: u32, window: vec4<f32>) -> f32 {
    if k < COEFFICIENTS {
        return window[sh_band(k)];
    }
    return window.w;
}
