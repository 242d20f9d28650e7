// SPDX-License-Identifier: MIT OR Apache-2.0
//! `.obj` bytes and, behind the first byte 0, those of the library `fuzz.mtl`.
#![no_main]

use std::path::PathBuf;
use std::sync::LazyLock;

use libfuzzer_sys::fuzz_target;
use lucerna_fuzz::scene::Scene;
use lucerna_fuzz::{check, limits};

static FOLDER: LazyLock<PathBuf> = LazyLock::new(|| {
    let folder = std::env::temp_dir().join(format!("lucerna-fuzz-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a folder for the library");
    folder
});

fuzz_target!(|bytes: &[u8]| {
    let Some(end) = bytes.iter().position(|&b| b == 0) else {
        check(Scene::from_obj_slice(bytes, None, &limits()));
        return;
    };
    std::fs::write(FOLDER.join("fuzz.mtl"), &bytes[end + 1..]).expect("a library");
    let mut obj = b"mtllib fuzz.mtl\n".to_vec();
    obj.extend_from_slice(&bytes[..end]);
    check(Scene::from_obj_slice(&obj, Some(&FOLDER), &limits()));
});
