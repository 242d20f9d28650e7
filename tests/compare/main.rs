// SPDX-License-Identifier: MIT OR Apache-2.0
//! Pictures to and from files, and the numbers that compare them.

mod files;
mod metrics;
mod support;
