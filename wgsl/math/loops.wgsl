// SPDX-License-Identifier: MIT OR Apache-2.0
//! Whether the driver still runs loops correctly.
//!
//! Mesa's llvmpipe, the software driver, ends every loop of an invocation once all its loops together have taken 65 535
//! iterations (gallivm's loop limiter): from then on a loop's body runs once, regardless of its condition. There is no
//! other sign of it. Invocations that run as one vector share the limit. Other drivers have no limit, and the result is
//! always true there.
#define_import_path lucerna::math::loops

/// False: the driver has begun to end loops early, and what the last ones computed may be wrong.
///
/// `zero`: 0, but in a way that no compiler can know (a uniform's top bit, for example); otherwise the loop is unrolled
/// and shows nothing. Costs two iterations.
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
