// SPDX-License-Identifier: MIT OR Apache-2.0
//! Limits on the cost of loading a scene file.

#[cfg(any(feature = "gltf", feature = "obj"))]
use super::error::ErrorKind;

/// Limits on the cost of loading. A file that needs more is rejected before the memory is allocated.
///
/// ```
/// use lucerna::scene::LoadLimits;
/// let limits = lucerna::settings!(LoadLimits { max_triangles: 1_000_000 });
/// # assert!(limits.max_bytes > 0);
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct LoadLimits {
    /// Bytes of everything that is read and decoded: files, buffers, vertex arrays, pixels, and, for text, the most
    /// that parsing can need. Default 4 GiB. (Scratch memory of decoders is not included; it is at most about the size
    /// of the largest image.)
    pub max_bytes: u64,
    /// Triangles, counted once per instance. Default 2²⁷ ≈ 134 million.
    pub max_triangles: u64,
    /// Pixels of one image. Default 16384².
    pub max_image_pixels: u64,
    /// Parents above a node. Default 1024.
    pub max_node_depth: usize,
    /// Instances in the scene. Default 2²⁰ ≈ 1 million.
    pub max_instances: usize,
    /// Bytes of one line of a text format (OBJ, MTL). Default 1 MiB.
    pub max_line_bytes: usize,
    /// Corners of an OBJ polygon that is triangulated exactly; a polygon with more becomes a fan, with a warning.
    /// Default 4096, because the time can grow with the square of the number of corners.
    pub max_polygon_corners: usize,
}

impl Default for LoadLimits {
    fn default() -> Self {
        Self {
            max_bytes: 4 << 30,
            max_triangles: 1 << 27,
            max_image_pixels: 16384 * 16384,
            max_node_depth: 1024,
            max_instances: 1 << 20,
            max_line_bytes: 1 << 20,
            max_polygon_corners: 4096,
        }
    }
}

#[cfg(any(feature = "gltf", feature = "obj"))]
/// Counts bytes against [`LoadLimits::max_bytes`].
#[derive(Debug)]
pub(super) struct Budget {
    limit: u64,
    used: u64,
}

#[cfg(any(feature = "gltf", feature = "obj"))]
impl Budget {
    pub fn new(limits: &LoadLimits) -> Self {
        Self { limit: limits.max_bytes, used: 0 }
    }

    /// Takes `n` elements of `size` bytes from the budget, or fails if there are too many. Call it before allocating.
    pub fn take(&mut self, n: u64, size: u64, what: &str) -> Result<(), ErrorKind> {
        let used = n.checked_mul(size).and_then(|bytes| bytes.checked_add(self.used));
        match used {
            Some(used) if used <= self.limit => {
                self.used = used;
                Ok(())
            }
            _ => Err(ErrorKind::TooMuch {
                what: what.to_owned(),
                needed: used.unwrap_or(u64::MAX),
                limit: self.limit,
                setting: "max_bytes",
            }),
        }
    }

    /// Returns bytes to the budget when memory has been freed.
    pub fn give_back(&mut self, bytes: u64) {
        self.used = self.used.saturating_sub(bytes);
    }

    pub fn left(&self) -> u64 {
        self.limit - self.used
    }
}
