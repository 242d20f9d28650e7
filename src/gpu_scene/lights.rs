// SPDX-License-Identifier: MIT OR Apache-2.0
//! The list from which kernels sample lights: punctual lights, emissive triangles, the sky.

use crate::bindings::lucerna::scene::data as wgsl;
use crate::bindings::lucerna::scene::types::NONE;
use crate::scene::{Light, Material, Scene, Texture};
use crate::seam::LightPeak;
use glam::Vec3;
use std::f32::consts::PI;

/// Lights with their alias table.
#[derive(Debug)]
pub struct LightTable {
    entries: Vec<wgsl::Light>,
    /// The light of each emissive triangle, sorted by triangle.
    by_triangle: Vec<(usize, u32)>,
    /// Index of the sky's entry, or NONE.
    pub sky: u32,
    /// Point, spot and directional lights, the first entries.
    pub n_punctual: u32,
    peaks: Vec<LightPeak>,
}

/// What a material emits, for the light table.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MaterialEmission {
    /// Luminance, averaged over its texture.
    pub mean: f32,
    /// Mean of the texture, by which the factor is multiplied.
    pub texture: f32,
    /// Largest component of the factor.
    pub largest: f32,
    pub double_sided: bool,
}

impl MaterialEmission {
    pub fn of(scene: &Scene, material_ix: usize) -> Self {
        let material = &scene.materials[material_ix];
        let texture = texture_emission(scene, material);
        Self::with_texture(material, texture)
    }

    /// For a material with another factor on the same texture.
    pub fn with_texture(material: &Material, texture: f32) -> Self {
        Self {
            mean: luminance(material.emission) * texture,
            texture,
            largest: material.emission.max_element(),
            double_sided: material.double_sided,
        }
    }
}

/// The sky, for the light table.
#[derive(Clone, Copy, Debug)]
pub struct SkyLight {
    /// Mean over the sphere.
    pub mean_luminance: f32,
}

impl LightTable {
    /// `triangles`: their corners and material; `emission`: that of the materials; `radius`: half the diagonal of the
    /// scene's box [m], for lights that are infinitely far away.
    pub fn build(
        lights: &[Light],
        triangles: &[wgsl::Triangle],
        emission: &[MaterialEmission],
        radius: f32,
        sky: SkyLight,
    ) -> Self {
        let mut entries = Vec::new();
        let mut powers = Vec::new();
        let mut peaks = Vec::new();
        for light in lights {
            entries.push(punctual(light));
            powers.push(power(light, radius));
            peaks.push(match light {
                Light::Point { intensity, .. } | Light::Spot { intensity, .. } => {
                    LightPeak::new(intensity.max_element(), 0.0)
                }
                Light::Directional { irradiance, .. } => {
                    LightPeak::new(0.0, irradiance.max_element())
                }
            });
        }
        let mut by_triangle = Vec::new();
        for (ix, triangle) in triangles.iter().enumerate() {
            let material = emission[triangle.material as usize];
            if material.mean > 0.0 {
                let (a, b, c) = (triangle.corner_a, triangle.corner_b, triangle.corner_c);
                let area = 0.5 * (b - a).cross(c - a).length();
                let sides = if material.double_sided { 2.0 } else { 1.0 };
                by_triangle.push((ix, entries.len() as u32));
                entries.push(wgsl::Light {
                    kind: wgsl::LIGHT_TRIANGLE,
                    triangle: ix as u32,
                    ..NO_LIGHT
                });
                powers.push(PI * area * material.mean * sides);
                peaks.push(LightPeak::new(area * material.largest, 0.0));
            }
        }
        let mut sky_ix = NONE;
        if sky.mean_luminance > 0.0 {
            sky_ix = entries.len() as u32;
            entries.push(wgsl::Light { kind: wgsl::LIGHT_SKY, ..NO_LIGHT });
            // Power through the sphere around the scene: area × πL. A scene without extent still has a sky.
            powers.push(4.0 * PI * radius * radius * PI * sky.mean_luminance);
            // It is sampled by luminance, and a channel is at most 1/0.0722 of that.
            let irradiance = 4.0 * PI * sky.mean_luminance / LUMINANCE.z;
            peaks.push(LightPeak::new(0.0, irradiance));
        }
        let n_punctual = lights.len();
        for (entry, drawn) in entries.iter_mut().zip(alias_table(&powers)) {
            entry.probability = drawn.probability;
            entry.alias_threshold = drawn.threshold;
            entry.alias_ix = drawn.alias_ix;
        }
        for (entry, drawn) in
            entries[n_punctual..].iter_mut().zip(alias_table(&powers[n_punctual..]))
        {
            entry.hittable_probability = drawn.probability;
            entry.hittable_threshold = drawn.threshold;
            entry.hittable_alias_ix = n_punctual as u32 + drawn.alias_ix;
        }
        Self { entries, by_triangle, sky: sky_ix, n_punctual: n_punctual as u32, peaks }
    }

    /// The peak of each light without extent.
    pub fn punctual_peaks(&self) -> &[LightPeak] {
        &self.peaks[..self.n_punctual as usize]
    }

    /// The peak of a light that is sampled among all, divided by its probability.
    pub fn drawn_peak(&self) -> LightPeak {
        drawn_peak(self.entries.iter().map(|light| light.probability), &self.peaks)
    }

    /// As [`Self::drawn_peak`], for a light that is sampled among emissive triangles and the sky.
    pub fn drawn_extended_peak(&self) -> LightPeak {
        let first = self.n_punctual as usize;
        let extended = &self.entries[first..];
        drawn_peak(extended.iter().map(|light| light.hittable_probability), &self.peaks[first..])
    }

    pub fn entries(&self) -> &[wgsl::Light] {
        &self.entries
    }

    pub fn len(&self) -> usize {
        self.entries.len()
    }

    /// Number of lights that a ray can hit: emissive triangles and the sky.
    pub fn n_hittable(&self) -> u32 {
        self.by_triangle.len() as u32 + u32::from(self.sky != NONE)
    }

    /// Index of the triangle's light, or NONE.
    pub fn of_triangle(&self, triangle: usize) -> u32 {
        self.by_triangle
            .binary_search_by_key(&triangle, |&(ix, _)| ix)
            .map_or(NONE, |at| self.by_triangle[at].1)
    }
}

fn drawn_peak(probabilities: impl Iterator<Item = f32>, peaks: &[LightPeak]) -> LightPeak {
    let drawn = probabilities.zip(peaks).filter(|&(probability, _)| probability > 0.0);
    drawn
        .map(|(probability, peak)| peak.scaled(1.0 / probability))
        .fold(LightPeak::default(), LightPeak::max)
}

const NO_LIGHT: wgsl::Light = wgsl::Light {
    position: Vec3::ZERO,
    kind: 0,
    direction: Vec3::Y,
    triangle: NONE,
    intensity: Vec3::ZERO,
    range: 0.0,
    spot_scale: 0.0,
    spot_offset: 0.0,
    probability: 0.0,
    alias_threshold: 1.0,
    alias_ix: 0,
    hittable_probability: 0.0,
    hittable_threshold: 1.0,
    hittable_alias_ix: 0,
};

fn punctual(light: &Light) -> wgsl::Light {
    match *light {
        Light::Point { position, intensity, range } => wgsl::Light {
            kind: wgsl::LIGHT_POINT,
            position,
            intensity,
            range: range.unwrap_or(0.0),
            ..NO_LIGHT
        },
        Light::Spot { position, direction, intensity, inner, outer, range } => {
            // As KHR_lights_punctual suggests to implementations.
            let spot_scale = 1.0 / (inner.cos() - outer.cos()).max(0.001);
            wgsl::Light {
                kind: wgsl::LIGHT_SPOT,
                position,
                direction,
                intensity,
                range: range.unwrap_or(0.0),
                spot_scale,
                spot_offset: -outer.cos() * spot_scale,
                ..NO_LIGHT
            }
        }
        Light::Directional { direction, irradiance } => wgsl::Light {
            kind: wgsl::LIGHT_DIRECTIONAL,
            direction,
            intensity: irradiance,
            ..NO_LIGHT
        },
    }
}

/// Radiant power [W], by luminance; only used to sample bright lights more often.
fn power(light: &Light, radius: f32) -> f32 {
    match *light {
        Light::Point { intensity, .. } => 4.0 * PI * luminance(intensity),
        Light::Spot { intensity, outer, .. } => {
            2.0 * PI * (1.0 - outer.cos()) * luminance(intensity)
        }
        Light::Directional { irradiance, .. } => PI * radius * radius * luminance(irradiance),
    }
}

/// The mean of a material's emission texture; 1 if it has none.
fn texture_emission(scene: &Scene, material: &Material) -> f32 {
    match &material.emission_texture {
        Some(texture) if luminance(material.emission) > 0.0 => {
            let Texture { image, .. } = scene.textures[texture.texture];
            let texels = &scene.images[image].rgba;
            let sum: f64 = texels.iter().map(|t| f64::from(t[0].max(t[1]).max(t[2]))).sum();
            (sum / (255.0 * texels.len().max(1) as f64)) as f32
        }
        _ => 1.0,
    }
}

/// Weights of the channels, Rec. 709.
const LUMINANCE: Vec3 = Vec3::new(0.2126, 0.7152, 0.0722);

pub(super) fn luminance(color: Vec3) -> f32 {
    color.dot(LUMINANCE)
}

/// An entry of an alias table.
#[derive(Clone, Copy, Debug)]
struct Drawn {
    probability: f32,
    /// This entry is sampled if the random number is below this, otherwise `alias_ix` is.
    threshold: f32,
    alias_ix: u32,
}

/// Vose's alias method. Half of the samples are drawn by power, half uniformly; otherwise a strong light far away would
/// leave a weak light close by with too few samples. Lights without power are never sampled.
fn alias_table(powers: &[f32]) -> Vec<Drawn> {
    let total: f64 = powers.iter().map(|&p| f64::from(p)).sum();
    let shining = powers.iter().filter(|&&p| p > 0.0).count();
    let n = powers.len();
    if shining == 0 {
        let never = |ix| Drawn { probability: 0.0, threshold: 1.0, alias_ix: ix as u32 };
        return (0..n).map(never).collect();
    }
    let probabilities: Vec<f64> = powers
        .iter()
        .map(|&p| if p > 0.0 { 0.5 * f64::from(p) / total + 0.5 / shining as f64 } else { 0.0 })
        .collect();
    let mut scaled: Vec<f64> = probabilities.iter().map(|p| p * n as f64).collect();
    let (mut small, mut large): (Vec<usize>, Vec<usize>) = (0..n).partition(|&ix| scaled[ix] < 1.0);
    let mut table: Vec<_> = probabilities
        .iter()
        .enumerate()
        .map(|(ix, &p)| Drawn { probability: p as f32, threshold: 1.0, alias_ix: ix as u32 })
        .collect();
    while let (Some(&giver), Some(taker)) = (large.last(), small.pop()) {
        table[taker].threshold = scaled[taker] as f32;
        table[taker].alias_ix = giver as u32;
        scaled[giver] -= 1.0 - scaled[taker];
        if scaled[giver] < 1.0 {
            large.pop();
            small.push(giver);
        }
    }
    table
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Drawing by the table gives the stated probabilities exactly: each entry receives its own
    /// threshold and what the others leave over. Tolerance: f32 rounding of n thresholds.
    #[test]
    fn alias_table_gives_the_stated_probabilities() {
        let powers: Vec<f32> =
            (0..1000).map(|k| if k % 7 == 0 { 0.0 } else { (k * k) as f32 }).collect();
        let entries = alias_table(&powers);
        let n = entries.len() as f64;
        let mut drawn = vec![0.0; entries.len()];
        for (ix, entry) in entries.iter().enumerate() {
            drawn[ix] += f64::from(entry.threshold) / n;
            drawn[entry.alias_ix as usize] += (1.0 - f64::from(entry.threshold)) / n;
        }
        for (ix, (drawn, entry)) in drawn.iter().zip(&entries).enumerate() {
            assert!((drawn - f64::from(entry.probability)).abs() < 1e-7, "{ix}: {drawn} {entry:?}");
            assert_eq!(entry.probability == 0.0, powers[ix] == 0.0);
        }
        assert!((drawn.iter().sum::<f64>() - 1.0).abs() < 1e-9);
    }
}
