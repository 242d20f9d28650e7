// SPDX-License-Identifier: MIT OR Apache-2.0
//! Loading of scenes: every feature by numbers, every malformed file by what it gives.

mod builder;
mod cases;
mod far;
mod flat;
mod gltf;
mod images;
mod limits;
mod malformed;
mod names;
mod obj;
mod shipped;
mod skins;
mod validate;

use std::path::PathBuf;

use lucerna::scene::{LoadLimits, Loaded, Scene};

/// A file of the repository's `fixtures`.
fn fixture(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("fixtures").join(name)
}

/// Loads, and checks that the scene keeps its promises.
fn load_gltf(bytes: &[u8]) -> Loaded {
    let loaded = Scene::from_gltf_slice(bytes, None, &LoadLimits::default()).unwrap();
    loaded.scene.validate().unwrap();
    loaded
}

fn load_obj(text: &str) -> Loaded {
    let loaded = Scene::from_obj_slice(text.as_bytes(), None, &LoadLimits::default()).unwrap();
    loaded.scene.validate().unwrap();
    loaded
}

/// Loads a glTF that gives no warning.
fn load_clean(bytes: &[u8]) -> Scene {
    let loaded = load_gltf(bytes);
    assert!(loaded.warnings.is_empty(), "{:?}", loaded.warnings);
    loaded.scene
}

/// An empty folder that is deleted at the end of the test.
struct TempDir(PathBuf);

impl TempDir {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("lucerna-{}-{name}", std::process::id()));
        let _ = std::fs::remove_dir_all(&path);
        std::fs::create_dir_all(&path).unwrap();
        Self(path)
    }
}

impl Drop for TempDir {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}
