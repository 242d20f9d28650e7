// SPDX-License-Identifier: MIT OR Apache-2.0
//! Whether loops still run as they are written.
//!
//! Mesa's llvmpipe, the software driver, ends every loop of an invocation once all its loops together have taken 65 535
//! iterations (gallivm's loop limiter): from then on a loop's body runs once, whatever its condition says. Nothing else tells.
//! Invocations that run as one vector share the limit. Other drivers have none, and this is always true there.
#define_import_path lucerna::math::loops

/// False: the driver has begun to end loops early, and what the last ones computed may be wrong.
///
/// `zero`: 0, but so that no compiler can know it (a uniform's top bit, say), else the loop is unrolled and tells nothing.
/// Costs two iterations.
fn loops_run(zero: u32) -> bool {
    var n = 0u;
    loop {
        n += 1u;
        if n >= 2u + zero {
            break;
        }
    }
    return n == 2u + zero;
}
