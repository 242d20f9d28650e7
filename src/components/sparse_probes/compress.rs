// SPDX-License-Identifier: MIT OR Apache-2.0
//! Transport of a cluster as U_c (Σ_c Vᵀ): principal components of its receivers' coefficients.

use super::settings::Factorisation;
use faer::linalg::solvers::Svd;
use faer::{Mat, MatRef};

/// The factors of a matrix.
#[derive(Clone, Debug)]
pub(crate) struct Factors {
    /// U_c, column by column, as many numbers each as the matrix has rows.
    pub reconstruction: Vec<f32>,
    /// Σ_c Vᵀ, row by row, as many numbers each as the matrix has columns.
    pub projection: Vec<f32>,
    pub n_vectors: usize,
    /// Share of the sum of squares that is kept.
    pub energy: f64,
}

impl Default for Factors {
    /// Those of nothing.
    fn default() -> Self {
        Self { reconstruction: vec![], projection: vec![], n_vectors: 0, energy: 1.0 }
    }
}

/// Factorises a matrix of `n_rows` rows, row by row in `numbers`, and keeps at most `most` vectors.
///
/// # Errors
/// The decomposition does not converge.
pub(crate) fn factorise(
    numbers: &[f32],
    n_rows: usize,
    most: usize,
    how: Factorisation,
) -> Result<Factors, String> {
    let n_columns = numbers.len().checked_div(n_rows).unwrap_or(0);
    let whole: f64 = numbers.iter().map(|x| f64::from(*x) * f64::from(*x)).sum();
    if n_columns == 0 || whole == 0.0 {
        return Ok(Factors::default());
    }
    // (Probes that no sample of the cluster sees have columns of zeros, often half of them.)
    let whole_matrix = MatRef::from_row_major_slice(numbers, n_rows, n_columns);
    let is_there = |column: &usize| (0..n_rows).any(|row| whole_matrix[(row, *column)] != 0.0);
    let columns: Vec<usize> = (0..n_columns).filter(is_there).collect();
    let matrix =
        Mat::from_fn(n_rows, columns.len(), |row, column| whole_matrix[(row, columns[column])]);
    let matrix = matrix.as_ref();
    let rank = n_rows.min(columns.len());
    let (left, values, right) = match how {
        // (No gain where most vectors are kept anyway.)
        Factorisation::Randomised if most + OVERSAMPLING < rank / 2 => randomised(matrix, most)?,
        _ => exact(matrix)?,
    };
    let n_vectors = values.len().min(most);
    let mut out = Factors {
        reconstruction: Vec::with_capacity(n_vectors * n_rows),
        projection: Vec::with_capacity(n_vectors * n_columns),
        n_vectors,
        energy: values[..n_vectors].iter().map(|s| f64::from(*s) * f64::from(*s)).sum::<f64>()
            / whole,
    };
    for (k, &value) in values[..n_vectors].iter().enumerate() {
        // Which of two opposite vectors it is, is a matter of the algorithm: the one with the larger positive number.
        let column: Vec<f32> = (0..n_rows).map(|row| left[(row, k)]).collect();
        let largest =
            column.iter().copied().fold(0.0, |a: f32, b| if b.abs() > a.abs() { b } else { a });
        let sign = if largest < 0.0 { -1.0 } else { 1.0 };
        out.reconstruction.extend(column.iter().map(|x| sign * x));
        let first = out.projection.len();
        out.projection.resize(first + n_columns, 0.0);
        for (ix, &column) in columns.iter().enumerate() {
            out.projection[first + column] = sign * value * right[(ix, k)];
        }
    }
    Ok(out)
}

type Decomposed = (Mat<f32>, Vec<f32>, Mat<f32>);

fn exact(matrix: MatRef<f32>) -> Result<Decomposed, String> {
    let svd = Svd::new_thin(matrix).map_err(|error| format!("{error:?}"))?;
    let values: Vec<f32> = svd.S().column_vector().iter().copied().collect();
    // (faer 0.24 leaves them unsorted where some are next to 0.)
    let mut order: Vec<usize> = (0..values.len()).collect();
    order.sort_by(|a, b| values[*b].total_cmp(&values[*a]));
    let sorted =
        |of: MatRef<f32>| Mat::from_fn(of.nrows(), order.len(), |row, k| of[(row, order[k])]);
    Ok((sorted(svd.U()), order.iter().map(|k| values[*k]).collect(), sorted(svd.V())))
}

/// Vectors beyond those that are kept.
const OVERSAMPLING: usize = 8;
const POWER_ITERATIONS: usize = 2;

fn randomised(matrix: MatRef<f32>, most: usize) -> Result<Decomposed, String> {
    let n = most + OVERSAMPLING;
    // Numbers ±1 by a hash.
    let sign = |ix: u32| {
        let word = ix.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
        let word = ((word >> ((word >> 28) + 4)) ^ word).wrapping_mul(277_803_737);
        if (word >> 22 ^ word) & 1 == 0 { 1.0f32 } else { -1.0 }
    };
    let test = Mat::from_fn(matrix.ncols(), n, |row, column| sign((row * n + column) as u32));
    let mut range = matrix * test;
    for _ in 0..POWER_ITERATIONS {
        let basis = range.qr().compute_thin_Q();
        let other = (matrix.transpose() * basis).qr().compute_thin_Q();
        range = matrix * other;
    }
    let basis = range.qr().compute_thin_Q();
    let small = basis.transpose() * matrix;
    let (left, values, right) = exact(small.as_ref())?;
    Ok((basis * left, values, right))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn reconstructed(factors: &Factors, n_rows: usize, n_columns: usize) -> Vec<f64> {
        let mut out = vec![0.0; n_rows * n_columns];
        for k in 0..factors.n_vectors {
            for row in 0..n_rows {
                for column in 0..n_columns {
                    out[row * n_columns + column] +=
                        f64::from(factors.reconstruction[k * n_rows + row])
                            * f64::from(factors.projection[k * n_columns + column]);
                }
            }
        }
        out
    }

    /// A matrix whose singular values fall off as 2⁻ᵏ.
    fn falling(n_rows: usize, n_columns: usize) -> Vec<f32> {
        let at = |row: usize, column: usize| {
            let (x, y) = (row as f64 / n_rows as f64, column as f64 / n_columns as f64);
            (0..12)
                .map(|k| {
                    (-0.7 * f64::from(k)).exp()
                        * (f64::from(k) * 3.1 * x).cos()
                        * (f64::from(k) * 2.9 * y + 0.3).cos()
                })
                .sum::<f64>() as f32
        };
        (0..n_rows * n_columns).map(|ix| at(ix / n_columns, ix % n_columns)).collect()
    }

    #[test]
    fn all_vectors_give_the_matrix_back() {
        for (n_rows, n_columns) in [(1, 1), (1, 9), (9, 1), (40, 17), (17, 40)] {
            let numbers = falling(n_rows, n_columns);
            let largest = f64::from(numbers.iter().fold(0.0f32, |a, b| a.max(b.abs())));
            let factors = factorise(&numbers, n_rows, 128, Factorisation::Exact).unwrap();
            for (found, number) in reconstructed(&factors, n_rows, n_columns).iter().zip(&numbers) {
                // (Of the largest number; the decomposition is in f32.)
                assert!(
                    (found - f64::from(*number)).abs() < 1e-4 * largest,
                    "{n_rows} x {n_columns}: {found} instead of {number}"
                );
            }
            assert!((factors.energy - 1.0).abs() < 1e-5, "energy {}", factors.energy);
        }
    }

    #[test]
    fn few_vectors_lose_what_the_energy_says() {
        let (n_rows, n_columns) = (150, 120);
        let numbers = falling(n_rows, n_columns);
        let whole: f64 = numbers.iter().map(|x| f64::from(*x).powi(2)).sum();
        let mut losses = Vec::new();
        for how in [Factorisation::Exact, Factorisation::Randomised] {
            let factors = factorise(&numbers, n_rows, 5, how).unwrap();
            let found = reconstructed(&factors, n_rows, n_columns);
            let lost: f64 =
                found.iter().zip(&numbers).map(|(a, b)| (a - f64::from(*b)).powi(2)).sum();
            let said = 1.0 - factors.energy;
            assert!(
                (lost / whole - said).abs() < 1e-5,
                "{how:?}: lost {} of the energy, but {said} is said",
                lost / whole
            );
            losses.push(lost / whole);
        }
        // (Eckart and Young: none is better than the exact one; randomised with two power iterations is near it.)
        assert!(losses[1] < losses[0] * 1.1 + 1e-9, "exact {} randomised {}", losses[0], losses[1]);
    }

    /// The first vectors are the largest ones, also of a matrix with many columns of zeros, or rows. (faer 0.24 does not sort singular
    /// values below 1e-36.)
    #[test]
    fn the_largest_vectors_are_kept() {
        for (n_rows, n_columns, every, of_rows) in [
            (300, 400, 2, false),
            (940, 1075, 2, false),
            (900, 1000, 5, false),
            (60, 500, 20, false),
            (1000, 900, 2, true),
            (1000, 900, 5, true),
        ] {
            let mut numbers = falling(n_rows, n_columns);
            for (ix, number) in numbers.iter_mut().enumerate() {
                let (row, column) = (ix / n_columns, ix % n_columns);
                let hash = (row * 7919 + column * 104_729) % 1009;
                let is_there = if of_rows { row } else { column } % every == 0;
                *number = if is_there { *number + 1e-4 * hash as f32 } else { 0.0 };
            }
            for how in [Factorisation::Exact, Factorisation::Randomised] {
                let factors = factorise(&numbers, n_rows, 16, how).unwrap();
                let found = reconstructed(&factors, n_rows, n_columns);
                let whole: f64 = numbers.iter().map(|x| f64::from(*x).powi(2)).sum();
                let lost: f64 =
                    found.iter().zip(&numbers).map(|(a, b)| (a - f64::from(*b)).powi(2)).sum();
                assert!(
                    lost < 0.02 * whole,
                    "{n_rows} x {n_columns}, {how:?}: 16 vectors lose {} of the energy",
                    lost / whole
                );
            }
        }
    }

    #[test]
    fn nothing_has_no_vectors() {
        for n_rows in [0, 3] {
            let factors =
                factorise(&vec![0.0; 4 * n_rows], n_rows, 32, Factorisation::Exact).unwrap();
            assert_eq!((factors.n_vectors, factors.energy), (0, 1.0));
        }
    }
}
