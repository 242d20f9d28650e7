//! Pictures to and from files, and the numbers that compare them.

mod files;
#[cfg(feature = "cli")]
mod metrics;
mod support;
