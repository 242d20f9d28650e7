// SPDX-License-Identifier: MIT OR Apache-2.0
//! Mathematical constants in f32.
#define_import_path lucerna::math::constants

const PI: f32 = 3.14159265358979;
const TWO_PI: f32 = 6.28318530717959;
const HALF_PI: f32 = 1.57079632679490;
const INV_PI: f32 = 0.318309886183791;
const INV_TWO_PI: f32 = 0.159154943091895;
const INV_FOUR_PI: f32 = 0.0795774715459477;
/// Half the distance from 1 to the next f32: the relative error of one rounded operation.
const UNIT_ROUNDOFF: f32 = 5.9604645e-8;
/// Farther than anything: just below the largest f32, because naga prints that one as a decimal above it.
const FLOAT_MAX: f32 = 3.402823e38;
/// The largest f32 below 1.
const ONE_BELOW: f32 = 0.99999994;
