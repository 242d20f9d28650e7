// SPDX-License-Identifier: MIT OR Apache-2.0
//! Host bindings generated from the WGSL by wgsl_bindgen: struct layouts, constants, workgroup sizes.
//!
//! Structs and constants of modules are under [`lucerna`], those of kernels under [`kernels`].

#[allow(clippy::all, dead_code, missing_docs, unused_imports, rustdoc::all, non_snake_case)]
mod generated {
    include!(concat!(env!("OUT_DIR"), "/bindings.rs"));
}

pub use generated::{kernels, lucerna};
