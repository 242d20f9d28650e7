// SPDX-License-Identifier: MIT OR Apache-2.0
//! Lights' colours from a picture.
//!
//! A picture is linear in its lights: it is the sum of what each light gives with intensity 1, times the light's colour. So the colours follow from the
//! picture, channel by channel, by least squares that are not negative (C. Lawson, R. Hanson, "Solving Least Squares Problems", 1974), for any technique that
//! rendered the pictures of the lights.

use faer::{Mat, Side};
use glam::{DVec3, Vec3};
use ndarray::{Array1, Array2};

/// Lights whose pictures differ by less than this share of themselves (squared) cannot be told apart.
const AMBIGUOUS: f64 = 1e-7;
/// A light's part in such a difference, from which on it is named.
const IS_PART: f64 = 0.2;
/// A light that gives less than this share of what the brightest gives (root mean square) is not seen.
const UNSEEN: f64 = 1e-9;

/// Colours of lights.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct LightFit {
    /// By what each light's picture is multiplied, at least 0.
    pub colours: Vec<DVec3>,
    /// Standard errors of these, as the residual has them; infinite for lights that the picture does not tell.
    pub errors: Vec<DVec3>,
    /// Root of the mean squared weighted difference that is left, by that of the picture: 0 if it is explained completely.
    pub residual: DVec3,
    /// Lights that the picture does not show.
    pub unseen: Vec<usize>,
    /// Groups of lights that the picture cannot tell apart: of each, only the sum is known.
    pub ambiguous: Vec<Vec<usize>>,
    /// Pixels that are not finite, and were left out.
    pub n_left_out: usize,
}

/// Colours cannot be fitted.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FitError {
    /// Nothing to fit.
    #[error("there are no lights to fit")]
    NoLights,
    /// Sizes differ.
    #[error("the picture has {expected} pixels, and that of light {light} has {found}")]
    Size {
        /// Of the picture.
        expected: usize,
        /// Of the light's.
        found: usize,
        /// Its number.
        light: usize,
    },
    /// Too few pixels.
    #[error("{found} pixels are too few for {lights} lights")]
    TooFew {
        /// Pixels that are finite.
        found: usize,
        /// Lights.
        lights: usize,
    },
    /// The decomposition failed.
    #[error("the lights' pictures cannot be decomposed: {0}")]
    Failed(String),
}

/// Fits colours. `picture`: linear radiance; `known`: the part of it that comes from elsewhere, as emissive surfaces, as many pixels, or empty; `of_lights`: what each
/// light gives with a colour of (1, 1, 1). A pixel weighs 1/(its light + the mean light) (squared): as if its error were in proportion to its light, with a
/// part that is the same everywhere. Its light is that of a first fit without weights: the picture's own, which has the error, would make dark pixels count
/// more, and colours too dark. Then pixels that are far from what the lights explain, as fireflies of a path tracer or things that the scene does not have, count
/// less (P. Huber, "Robust Estimation of a Location Parameter", 1964, by weights).
///
/// # Errors
/// [`FitError`]
pub fn fit_lights(
    picture: &[Vec3],
    known: &[Vec3],
    of_lights: &[Vec<Vec3>],
) -> Result<LightFit, FitError> {
    let n = of_lights.len();
    if n == 0 {
        return Err(FitError::NoLights);
    }
    let others = of_lights.iter().enumerate().map(|(light, of)| (light, of.len()));
    let known_size = (!known.is_empty()).then_some((usize::MAX, known.len()));
    for (light, found) in others.chain(known_size) {
        if found != picture.len() {
            return Err(FitError::Size { expected: picture.len(), found, light });
        }
    }
    let is_finite = |pixel: &usize| {
        picture[*pixel].is_finite()
            && known.get(*pixel).is_none_or(|of| of.is_finite())
            && of_lights.iter().all(|of| of[*pixel].is_finite())
    };
    let pixels: Vec<usize> = (0..picture.len()).filter(is_finite).collect();
    if pixels.len() <= n {
        return Err(FitError::TooFew { found: pixels.len(), lights: n });
    }
    let problem = Problem { picture, known, of_lights, pixels: &pixels };
    let first = problem.fit(&vec![1.0; pixels.len()])?;
    let explained: Vec<f64> = pixels.iter().map(|pixel| problem.light_of(*pixel, &first)).collect();
    let mean = explained.iter().sum::<f64>() / pixels.len() as f64;
    let mean = if mean > 0.0 { mean } else { 1.0 };
    let plain: Vec<f64> = explained.iter().map(|light| 1.0 / (light + mean)).collect();
    let mut fit = problem.fit(&plain)?;
    for _ in 0..ROBUST_STEPS {
        let off: Vec<f64> = pixels
            .iter()
            .zip(&plain)
            .map(|(pixel, weight)| weight * problem.difference(*pixel, &fit).abs().max_element())
            .collect();
        let mut sorted = off.clone();
        sorted.sort_by(f64::total_cmp);
        // (1.4826 times the median is a normal distribution's standard deviation.)
        let most = HUBER * 1.4826 * sorted[sorted.len() / 2];
        // (Pictures without noise: nothing is far away.)
        if most <= 1e-9 {
            break;
        }
        let weights: Vec<f64> =
            plain.iter().zip(&off).map(|(w, off)| w * (most / off).min(1.0).sqrt()).collect();
        fit = problem.fit(&weights)?;
    }
    Ok(fit)
}

/// From so many standard deviations on, pixels count less; and how often it is found out which these are.
const HUBER: f64 = 1.345;
const ROBUST_STEPS: usize = 8;

/// What is fitted.
struct Problem<'a> {
    picture: &'a [Vec3],
    known: &'a [Vec3],
    of_lights: &'a [Vec<Vec3>],
    /// Those that count.
    pixels: &'a [usize],
}

impl Problem<'_> {
    /// The mean of the channels that a fit explains.
    fn light_of(&self, pixel: usize, fit: &LightFit) -> f64 {
        let light = self.picture[pixel].as_dvec3() - self.difference(pixel, fit);
        light.max(DVec3::ZERO).element_sum() / 3.0
    }

    /// What a fit does not explain of a pixel.
    fn difference(&self, pixel: usize, fit: &LightFit) -> DVec3 {
        let known = self.known.get(pixel).map_or(DVec3::ZERO, |of| of.as_dvec3());
        let lights = self.of_lights.iter().zip(&fit.colours);
        let light = lights.map(|(of, colour)| of[pixel].as_dvec3() * *colour).sum::<DVec3>();
        self.picture[pixel].as_dvec3() - known - light
    }

    /// `weights`: of each pixel that counts.
    fn fit(&self, weights: &[f64]) -> Result<LightFit, FitError> {
        let n = self.of_lights.len();
        let mut out = LightFit {
            colours: vec![DVec3::ZERO; n],
            errors: vec![DVec3::INFINITY; n],
            residual: DVec3::ZERO,
            unseen: Vec::new(),
            ambiguous: Vec::new(),
            n_left_out: self.picture.len() - self.pixels.len(),
        };
        for channel in 0..3 {
            let column = |of: &[Vec3]| -> Vec<f64> {
                let pixels = self.pixels.iter().zip(weights);
                pixels.map(|(ix, w)| w * f64::from(of[*ix][channel])).collect()
            };
            let columns: Vec<Vec<f64>> = self.of_lights.iter().map(|of| column(of)).collect();
            let mut target = column(self.picture);
            if !self.known.is_empty() {
                target.iter_mut().zip(column(self.known)).for_each(|(x, y)| *x -= y);
            }
            fit_channel(&mut out, channel, &columns, &target)?;
        }
        out.unseen.sort_unstable();
        out.unseen.dedup();
        Ok(out)
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

/// One channel: columns are scaled to length 1; AᵀA = V Λ Vᵀ reduces the problem to as many equations as there are lights.
fn fit_channel(
    out: &mut LightFit,
    channel: usize,
    columns: &[Vec<f64>],
    target: &[f64],
) -> Result<(), FitError> {
    let lengths: Vec<f64> = columns.iter().map(|of| dot(of, of).sqrt()).collect();
    let brightest = lengths.iter().copied().fold(0.0, f64::max);
    let is_seen = |ix: &usize| lengths[*ix] > UNSEEN * brightest;
    let seen: Vec<usize> = (0..columns.len()).filter(is_seen).collect();
    out.unseen.extend((0..columns.len()).filter(|ix| !is_seen(ix)));
    let n = seen.len();
    if n == 0 {
        return Ok(());
    }
    let product = |i: usize, j: usize| {
        dot(&columns[seen[i]], &columns[seen[j]]) / (lengths[seen[i]] * lengths[seen[j]])
    };
    let gram = Mat::from_fn(n, n, product);
    let eigen = gram
        .self_adjoint_eigen(Side::Lower)
        .map_err(|error| FitError::Failed(format!("{error:?}")))?;
    let values: Vec<f64> = eigen.S().column_vector().iter().copied().collect();
    let vectors = eigen.U();
    let most = values.iter().copied().fold(0.0, f64::max);
    let right: Vec<f64> = seen.iter().map(|ix| dot(&columns[*ix], target) / lengths[*ix]).collect();
    let kept: Vec<usize> = (0..n).filter(|k| values[*k] > AMBIGUOUS * most).collect();
    for k in (0..n).filter(|k| !kept.contains(k)) {
        let group: Vec<usize> =
            (0..n).filter(|i| vectors[(*i, k)].abs() > IS_PART).map(|i| seen[i]).collect();
        if !out.ambiguous.contains(&group) {
            out.ambiguous.push(group);
        }
    }
    // Λ^½ Vᵀ x = Λ^−½ Vᵀ Aᵀ b.
    let left = Array2::from_shape_fn((kept.len(), n), |(row, i)| {
        values[kept[row]].sqrt() * vectors[(i, kept[row])]
    });
    let along = |k: usize| (0..n).map(|i| vectors[(i, k)] * right[i]).sum::<f64>();
    let reduced: Array1<f64> = kept.iter().map(|k| along(*k) / values[*k].sqrt()).collect();
    let (found, _) = nnls::nnls(left.view(), reduced.view());
    let colour = |i: usize| found[i] / lengths[seen[i]];
    let mut rest = target.to_vec();
    for (i, ix) in seen.iter().enumerate() {
        rest.iter_mut().zip(&columns[*ix]).for_each(|(x, y)| *x -= colour(i) * y);
        out.colours[*ix][channel] = colour(i);
    }
    let squares = dot(&rest, &rest);
    let whole = dot(target, target);
    out.residual[channel] = if whole > 0.0 { (squares / whole).sqrt() } else { 0.0 };
    let variance = squares / (target.len() - n).max(1) as f64;
    for (i, ix) in seen.iter().enumerate() {
        let is_told = !out.ambiguous.iter().any(|group| group.contains(ix));
        let inverse: f64 = kept.iter().map(|k| vectors[(i, *k)].powi(2) / values[*k]).sum();
        let error = (variance * inverse).sqrt() / lengths[*ix];
        out.errors[*ix][channel] = if is_told { error } else { f64::INFINITY };
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers in 0..1, of a hash.
    fn number(seed: u64) -> f32 {
        let x = (seed + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        let x = (x ^ (x >> 31)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        ((x ^ (x >> 29)) >> 40) as f32 / (1u64 << 24) as f32
    }

    fn picture(seed: u64, n: usize) -> Vec<Vec3> {
        let at = |ix: usize, k: u64| number(1000 * seed + 3 * ix as u64 + k).powi(4);
        (0..n).map(|ix| Vec3::new(at(ix, 0), at(ix, 1), at(ix, 2))).collect()
    }

    fn sum(parts: &[(&[Vec3], DVec3)]) -> Vec<Vec3> {
        (0..parts[0].0.len())
            .map(|ix| parts.iter().map(|(of, c)| of[ix].as_dvec3() * *c).sum::<DVec3>().as_vec3())
            .collect()
    }

    fn colours(n: usize) -> Vec<DVec3> {
        let colour = |ix: usize| {
            [0u64, 1, 2].map(|k| 10f64.powf(4.0 * f64::from(number(77 + 5 * ix as u64 + k)) - 2.0))
        };
        (0..n).map(|ix| DVec3::from_array(colour(ix))).collect()
    }

    #[test]
    fn ten_lights_are_found() {
        let of: Vec<_> = (0..10).map(|ix| picture(ix, 400)).collect();
        let colours = colours(10);
        let known = picture(50, 400);
        let mut parts: Vec<(&[Vec3], DVec3)> =
            of.iter().map(Vec::as_slice).zip(colours.iter().copied()).collect();
        parts.push((&known, DVec3::ONE));
        let mut target = sum(&parts);
        // (A pixel that is not finite is left out.)
        target[7].y = f32::NAN;
        let fit = fit_lights(&target, &known, &of).unwrap();
        for (found, expected) in fit.colours.iter().zip(&colours) {
            // Halves of a last digit of the brightest pixel's sum, by the least light's part in it.
            let apart = ((*found - *expected) / *expected).abs().max_element();
            assert!(apart < 1e-3, "{found}, expected {expected}");
        }
        assert!(fit.residual.max_element() < 1e-6, "residual {}", fit.residual);
        assert_eq!((fit.n_left_out, fit.unseen.len(), fit.ambiguous.len()), (1, 0, 0));
    }

    /// Pictures of ten lights, their colours, and the sum of these with noise, different for each seed, of up to this share of the light.
    fn with_noise(seed: u64, share: f32) -> (Vec<Vec<Vec3>>, Vec<DVec3>, Vec<Vec3>) {
        let of: Vec<_> = (0..10).map(|ix| picture(ix, 4000)).collect();
        let colours = vec![DVec3::new(1.0, 0.5, 2.0); 10];
        let parts: Vec<(&[Vec3], DVec3)> =
            of.iter().map(Vec::as_slice).zip(colours.iter().copied()).collect();
        let mut target = sum(&parts);
        for (ix, pixel) in target.iter_mut().enumerate() {
            let noise =
                [0u64, 1, 2].map(|k| 2.0 * share * (number(seed + 3 * ix as u64 + k) - 0.5));
            *pixel *= 1.0 + Vec3::from(noise);
        }
        (of, colours, target)
    }

    /// With noise of 10 %, errors are as large as they are said to be: of 30 colours, none is off by more than four of them, and half by less than one.
    #[test]
    fn errors_are_what_they_are_said_to_be() {
        // (Uniform up to 0.175: a standard deviation of 0.1.)
        let (of, colours, target) = with_noise(1_000_000, 0.175);
        let fit = fit_lights(&target, &[], &of).unwrap();
        let off: Vec<f64> = (0..10)
            .flat_map(|ix| ((fit.colours[ix] - colours[ix]) / fit.errors[ix]).to_array())
            .map(f64::abs)
            .collect();
        let n_near = off.iter().filter(|off| **off < 1.0).count();
        let worst = off.iter().copied().fold(0.0, f64::max);
        assert!(worst < 4.0 && n_near > 12, "worst {worst}, {n_near} of 30 within an error");
    }

    /// One pixel in fifty is a hundred times as bright as it should be: colours stay within 2 %. (Least squares alone are off by more than 50 %.)
    #[test]
    fn fireflies_do_not_count() {
        let (of, colours, mut target) = with_noise(2_000_000, 0.05);
        target.iter_mut().skip(7).step_by(50).for_each(|pixel| *pixel *= 100.0);
        let fit = fit_lights(&target, &[], &of).unwrap();
        for (found, expected) in fit.colours.iter().zip(&colours) {
            let apart = ((*found - *expected) / *expected).abs().max_element();
            assert!(apart < 0.02, "{found}, expected {expected}");
        }
    }

    #[test]
    fn what_cannot_be_known_is_said() {
        let (a, b) = (picture(1, 200), picture(2, 200));
        let dark = vec![Vec3::ZERO; 200];
        let twin: Vec<Vec3> = a.iter().map(|x| *x * 3.0).collect();
        let target = sum(&[(&a, DVec3::splat(2.0)), (&b, DVec3::splat(5.0))]);
        let of = [a.clone(), dark, b, twin];
        let fit = fit_lights(&target, &[], &of).unwrap();
        assert_eq!((fit.unseen, fit.ambiguous), (vec![1], vec![vec![0, 3]]), "unseen, ambiguous");
        let both = fit.colours[0] + 3.0 * fit.colours[3];
        assert!((both - 2.0).abs().max_element() < 1e-4, "sum of twins: {both}");
        assert!((fit.colours[2] - 5.0).abs().max_element() < 1e-4, "{}", fit.colours[2]);
        assert!(
            !fit.errors[0].is_finite() && !fit.errors[1].is_finite() && fit.errors[2].is_finite()
        );
        // Light that is not there is not negative.
        let less = sum(&[(&a, DVec3::splat(-2.0))]);
        assert_eq!(
            fit_lights(&less, &[], std::slice::from_ref(&a)).unwrap().colours,
            [DVec3::ZERO]
        );
        assert!(matches!(fit_lights(&a, &[], &[]), Err(FitError::NoLights)));
        let short = vec![a[..9].to_vec()];
        assert!(matches!(fit_lights(&a, &[], &short), Err(FitError::Size { found: 9, .. })));
        let few = fit_lights(&a[..1], &[], &[a[..1].to_vec()]);
        assert!(matches!(few, Err(FitError::TooFew { found: 1, lights: 1 })));
    }
}
