// SPDX-License-Identifier: MIT OR Apache-2.0
//! `.gltf` and `.glb` bytes, without a folder.
#![no_main]

use libfuzzer_sys::fuzz_target;
use lucerna_fuzz::scene::Scene;
use lucerna_fuzz::{check, limits};

fuzz_target!(|bytes: &[u8]| check(Scene::from_gltf_slice(bytes, None, &limits())));
