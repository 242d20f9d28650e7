// SPDX-License-Identifier: MIT OR Apache-2.0
//! The scene loader, and what every fuzz target checks of it.

pub use lucerna::scene;

use scene::{LoadLimits, Loaded, SceneError};

/// Caps low enough that an input that passes them all still takes well under a second.
pub fn limits() -> LoadLimits {
    lucerna::settings!(LoadLimits {
        max_bytes: 64 << 20,
        max_triangles: 1 << 16,
        max_image_pixels: 1 << 20,
        max_node_depth: 64,
        max_instances: 1 << 10,
        max_line_bytes: 1 << 14,
        max_polygon_corners: 1 << 10,
    })
}

/// A loaded scene keeps its promises; an error and every warning can be shown.
pub fn check(result: Result<Loaded, SceneError>) {
    match result {
        Ok(loaded) => {
            if let Err(problem) = loaded.scene.validate() {
                panic!("loaded, but not valid: {problem}");
            }
            let _ = (loaded.scene.bounds(), loaded.scene.n_triangles());
            for warning in loaded.warnings {
                assert!(warning.to_string().len() < 2000, "{warning}");
            }
        }
        Err(error) => assert!(error.to_string().len() < 2000, "{error}"),
    }
}
