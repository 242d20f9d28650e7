// SPDX-License-Identifier: MIT OR Apache-2.0
//! Sums that saturate at the largest number instead of wrapping.
#define_import_path lucerna::math::saturating

/// min(a + b, 2³² − 1). Associative and commutative, so it can be scanned.
fn add_saturating(a: u32, b: u32) -> u32 {
    return a + min(b, ~a);
}
