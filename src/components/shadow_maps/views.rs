// SPDX-License-Identifier: MIT OR Apache-2.0
//! The views from which lights see the scene.

use super::ShadowFiltering;
use crate::bindings::lucerna::components::shadow_maps::shadow_map::{ShadowFilter, ShadowView};
use crate::bindings::lucerna::fields::shadow_maps::ShadowMaps as Uniform;
use crate::seam::{PunctualLight, SceneFacts};
use bytemuck::Zeroable;
use glam::{UVec4, Vec3};

/// The number of views and lights that the uniform has room for.
const MAX_VIEWS: usize = 48;
const MAX_LIGHTS: usize = 16;

/// A spot light that is wider than this angle from its axis is treated as a point light.
const WIDEST_SPOT: f32 = 1.3;
/// Half the width of a point light's views, at distance 1: they overlap for filters at their
/// borders.
const CUBE_HALF_WIDTH: f32 = 1.1;
/// The near plane, in units of the scene's diagonal.
const NEAR: f32 = 1e-3;

/// Views of all lights that have maps.
pub(super) struct Views {
    pub views: Vec<ShadowView>,
    /// For each light its first view, the number of its views, and whether it is directional.
    lights: Vec<(u32, u32, bool)>,
}

impl Views {
    pub fn uniform(&self, filtering: ShadowFilter, kind: ShadowFiltering) -> Uniform {
        let mut uniform = Uniform::zeroed();
        uniform.views[..self.views.len()].copy_from_slice(&self.views);
        for (entry, &(first, n, directional)) in uniform.lights.iter_mut().zip(&self.lights) {
            let size = match kind {
                ShadowFiltering::Pcf(_) => 0.0,
                ShadowFiltering::Pcss { angular_radius, .. } if directional => {
                    angular_radius.to_radians().tan()
                }
                ShadowFiltering::Pcss { light_radius, .. } => light_radius,
            };
            *entry = UVec4::new(first, n, size.to_bits(), 0);
        }
        uniform.filtering = filtering;
        uniform.n_lights = self.lights.len() as u32;
        uniform
    }
}

/// The views of the scene's first lights without extent.
pub(super) fn views_of(scene: &SceneFacts) -> Views {
    let middle = 0.5 * (scene.bounds_min + scene.bounds_max);
    let diagonal = scene.diagonal().max(1e-6);
    let near = NEAR * diagonal;
    let mut found = Views { views: Vec::new(), lights: Vec::new() };
    for &light in scene.punctual_lights.iter().take(MAX_LIGHTS) {
        let first = found.views.len() as u32;
        let view = |position, forward: Vec3, half_width, range| {
            let right = forward.any_orthonormal_vector();
            let up = right.cross(forward);
            ShadowView { position, layer: 0, right, half_width, up, near, forward, range }
        };
        let of_light: Vec<ShadowView> = match light {
            PunctualLight::Directional { direction } => {
                // As wide and deep as the scene's bounding sphere.
                let half = 0.5 * diagonal;
                let place = middle - direction * (half + 2.0 * near);
                vec![view(place, direction, half, 2.0 * half + 2.0 * near)]
            }
            PunctualLight::Spot { position, direction, cos_outer }
                if cos_outer.acos() < WIDEST_SPOT =>
            {
                vec![view(position, direction, cos_outer.acos().tan(), 0.0)]
            }
            PunctualLight::Point { position } | PunctualLight::Spot { position, .. } => {
                let axes = [Vec3::X, Vec3::Y, Vec3::Z];
                let sides = axes.into_iter().flat_map(|axis| [axis, -axis]);
                sides.map(|side| view(position, side, CUBE_HALF_WIDTH, 0.0)).collect()
            }
        };
        if found.views.len() + of_light.len() > MAX_VIEWS {
            break;
        }
        let is_directional = matches!(light, PunctualLight::Directional { .. });
        found.lights.push((first, of_light.len() as u32, is_directional));
        found
            .views
            .extend((first..).zip(of_light).map(|(layer, view)| ShadowView { layer, ..view }));
    }
    found
}
