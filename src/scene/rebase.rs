// SPDX-License-Identifier: MIT OR Apache-2.0
//! Scenes far from their origin, as in files of maps and buildings: the choice of a new origin.
//!
//! A 32-bit float at 1e6 m has steps of 6 cm. Coordinates that are made relative to the scene's middle in 64 bits,
//! before they are rounded, keep their precision.

use glam::DVec3;

/// A scene that is this many times as far from the origin as it is large loses 2⁸ of the 2²⁴ steps of a 32-bit float.
const FAR: f64 = 256.0;

/// A part of a scene: an instance of a mesh, or a vertex.
#[derive(Clone, Copy)]
pub(super) struct Part {
    /// Its middle \[m\].
    pub center: DVec3,
    /// Half of its longest side \[m\].
    pub half_extent: f64,
    /// Its weight.
    pub weight: u64,
}

/// The best origin of a scene, in whole metres: zero, unless most of the scene is far away along an axis. It follows
/// from medians, so that a stray part does not matter.
pub(super) fn origin_of(parts: &[Part]) -> DVec3 {
    let by = |value: &dyn Fn(&Part) -> f64| {
        weighted_median(parts.iter().map(|part| (value(part), part.weight)).collect())
    };
    let middle = DVec3::from_array([0, 1, 2].map(|axis| by(&|part| part.center[axis])));
    let apart = by(&|part| (part.center - middle).abs().max_element());
    let extent = by(&|part| part.half_extent);
    let size = apart.max(extent);
    let along = |x: f64| if x.is_finite() && x.abs() > FAR * size { x.round() } else { 0.0 };
    DVec3::new(along(middle.x), along(middle.y), along(middle.z))
}

/// The value below which half of the weight lies; 0 if there is none.
fn weighted_median(mut values: Vec<(f64, u64)>) -> f64 {
    values.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
    let half = values.iter().map(|&(_, weight)| weight).sum::<u64>() / 2;
    let mut below = 0;
    for (value, weight) in values {
        below += weight;
        if below > half {
            return value;
        }
    }
    0.0
}

/// Keeps evenly spaced points of a sequence of unknown length.
pub(super) struct Sample {
    kept: Vec<DVec3>,
    step: u64,
    n: u64,
}

impl Default for Sample {
    fn default() -> Self {
        Self { kept: Vec::new(), step: 1, n: 0 }
    }
}

/// The most points that are kept.
const MAX_KEPT: usize = 8192;

impl Sample {
    pub fn add(&mut self, point: DVec3) {
        if self.n.is_multiple_of(self.step) && point.is_finite() {
            self.kept.push(point);
        }
        self.n += 1;
        if self.kept.len() == MAX_KEPT {
            let mut ix = 0;
            self.kept.retain(|_| {
                ix += 1;
                ix % 2 == 1
            });
            self.step *= 2;
        }
    }

    /// As [`origin_of`].
    pub fn origin(&self) -> DVec3 {
        let part = |&center| Part { center, half_extent: 0.0, weight: 1 };
        origin_of(&self.kept.iter().map(part).collect::<Vec<_>>())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cloud(middle: DVec3, size: f64) -> Vec<Part> {
        (0..27)
            .map(|ix| DVec3::new(f64::from(ix % 3), f64::from(ix / 3 % 3), f64::from(ix / 9)) - 1.0)
            .map(|offset| Part { center: middle + size * offset, half_extent: 0.0, weight: 1 })
            .collect()
    }

    #[test]
    fn only_what_is_far_is_moved() {
        let far = DVec3::new(1_048_576.0, -3.0, 5e6);
        assert_eq!(origin_of(&cloud(far, 2.0)), far.with_y(0.0));
        assert_eq!(origin_of(&cloud(DVec3::new(400.0, 0.0, 0.0), 2.0)), DVec3::ZERO);
        assert_eq!(origin_of(&cloud(far, 1e5)), DVec3::ZERO);
        assert_eq!(origin_of(&[]), DVec3::ZERO);
        // A few stray ones change nothing, neither beside a scene at the origin nor beside a far one.
        let stray = |at: DVec3| Part { center: at, half_extent: 0.0, weight: 1 };
        let mut parts = cloud(DVec3::ZERO, 2.0);
        parts.extend([stray(far), stray(2.0 * far)]);
        assert_eq!(origin_of(&parts), DVec3::ZERO);
        let mut parts = cloud(far, 2.0);
        parts.extend([stray(DVec3::ZERO), stray(-far)]);
        assert_eq!(origin_of(&parts), far.with_y(0.0));
    }

    #[test]
    fn samples_are_spread() {
        let mut sample = Sample::default();
        for ix in 0..100_000u32 {
            sample.add(DVec3::new(1e7 + f64::from(ix % 10), 0.0, 0.0));
        }
        assert!((MAX_KEPT / 2..MAX_KEPT).contains(&sample.kept.len()));
        assert!((sample.origin().x - 1e7).abs() <= 10.0);
    }
}
