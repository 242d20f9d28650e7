// SPDX-License-Identifier: MIT OR Apache-2.0
//! Structural similarity (Wang et al. 2004, equations 13 to 17), row by row.

use std::collections::VecDeque;

use glam::DVec3;

/// Side of the window, as in Wang et al.
const WINDOW: usize = 11;
/// Standard deviation of the Gaussian window in pixels, as in Wang et al.
const SIGMA: f64 = 1.5;
/// `(K₁·L)²` with K₁ = 0.01 and dynamic range L = 1: keeps the luminance term finite.
const C1: f64 = 0.01 * 0.01;
/// `(K₂·L)²` with K₂ = 0.03: keeps the contrast term finite.
const C2: f64 = 0.03 * 0.03;

/// Weighted sums over a part of a window, by channel: x, y, x², y², xy.
#[derive(Clone, Copy, Default)]
struct Moments([DVec3; 5]);

impl Moments {
    fn add(&mut self, weight: f64, other: &[DVec3; 5]) {
        for (sum, value) in self.0.iter_mut().zip(other) {
            *sum += weight * *value;
        }
    }

    /// Equation 13, by channel.
    fn similarity(&self) -> DVec3 {
        let [x, y, xx, yy, xy] = self.0;
        let (variance_x, variance_y, covariance) = (xx - x * x, yy - y * y, xy - x * y);
        (2.0 * x * y + C1) * (2.0 * covariance + C2)
            / ((x * x + y * y + C1) * (variance_x + variance_y + C2))
    }
}

/// Takes rows from the top and keeps the last [`WINDOW`] of them.
pub(super) struct Ssim {
    weights: [f64; WINDOW],
    /// Each row, filtered horizontally: one entry for each position at which the window fits.
    rows: VecDeque<Vec<Moments>>,
    n_windows_in_row: usize,
    sum: DVec3,
    n_windows: usize,
}

impl Ssim {
    pub(super) fn new(width: usize) -> Self {
        let half = (WINDOW / 2) as f64;
        let weights: [f64; WINDOW] =
            std::array::from_fn(|i| (-0.5 * ((i as f64 - half) / SIGMA).powi(2)).exp());
        let sum: f64 = weights.iter().sum();
        Self {
            weights: weights.map(|w| w / sum),
            rows: VecDeque::new(),
            n_windows_in_row: (width + 1).saturating_sub(WINDOW),
            sum: DVec3::ZERO,
            n_windows: 0,
        }
    }

    /// Display values in 0..1, `width` of each.
    pub(super) fn add_row(&mut self, x: &[DVec3], y: &[DVec3]) {
        if self.n_windows_in_row == 0 {
            return;
        }
        let products: Vec<[DVec3; 5]> =
            x.iter().zip(y).map(|(&x, &y)| [x, y, x * x, y * y, x * y]).collect();
        self.rows
            .push_back(products.windows(WINDOW).map(|window| self.weigh(window.iter())).collect());
        if self.rows.len() < WINDOW {
            return;
        }
        for column in 0..self.n_windows_in_row {
            self.sum += self.weigh(self.rows.iter().map(|row| &row[column].0)).similarity();
        }
        self.n_windows += self.n_windows_in_row;
        self.rows.pop_front();
    }

    fn weigh<'a>(&self, values: impl Iterator<Item = &'a [DVec3; 5]>) -> Moments {
        let mut moments = Moments::default();
        for (&weight, value) in self.weights.iter().zip(values) {
            moments.add(weight, value);
        }
        moments
    }

    /// The mean over windows and channels; None if no window fitted.
    pub(super) fn mean(&self) -> Option<f64> {
        (self.n_windows > 0).then(|| self.sum.element_sum() / (3 * self.n_windows) as f64)
    }
}
