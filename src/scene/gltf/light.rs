// SPDX-License-Identifier: MIT OR Apache-2.0
//! Cameras and punctual lights in world space.

use std::f32::consts::{FRAC_PI_2, PI};

use glam::Vec3;
use gltf::json::camera::Type as CameraType;
use gltf::json::extensions::scene::khr_lights_punctual::{Spot, Type as LightType};
use gltf::json::validation::Checked;

use super::nodes::Placed;
use super::{Loader, direction, index, named};
use crate::scene::error::{DataProblem, ErrorKind, Warning, short};
use crate::scene::{Camera, Light, Projection};

/// If a file leaves no angle between full and no light (`inner ≥ outer`), the falloff takes this
/// part of the outer angle.
const LEAST_FALLOFF: f32 = 1e-3;

impl Loader<'_> {
    /// A camera looks along its node's −Z with +Y up; the node's scale is ignored.
    pub(super) fn camera(&mut self, ix: usize, placed: &Placed, at: &str) -> Result<(), ErrorKind> {
        let root = self.data.root;
        let camera = index(&root.cameras, ix, "cameras", || format!("{at}.camera"))?;
        let camera_at = named("cameras", ix, camera.name.as_deref());
        let skip = |problem: &str| Warning::Value {
            at: format!("{camera_at} at {at}"),
            problem: format!("{problem}; camera left out"),
        };
        let projection = match camera.type_ {
            Checked::Valid(CameraType::Perspective) => camera
                .perspective
                .as_ref()
                .map(|p| p.yfov)
                .filter(|&fov| fov > 0.0 && fov < PI)
                .map(|vertical_fov| Projection::Perspective { vertical_fov })
                .ok_or("yfov is missing or not between 0 and π"),
            Checked::Valid(CameraType::Orthographic) => camera
                .orthographic
                .as_ref()
                .map(|o| o.ymag.abs())
                .filter(|&height| height > 0.0 && height.is_finite())
                .map(|half_height| Projection::Orthographic { half_height })
                .ok_or("ymag is missing, 0 or not finite"),
            Checked::Invalid => Err("type is neither perspective nor orthographic"),
        };
        let projection = match projection {
            Ok(projection) => projection,
            Err(problem) => {
                self.warnings.push(skip(problem));
                return Ok(());
            }
        };
        // A node may shear: only the part of `up` that is perpendicular to `forward` counts.
        let axes = direction(placed, Vec3::NEG_Z).zip(direction(placed, Vec3::Y)).and_then(
            |(forward, up)| Some((forward, up.reject_from_normalized(forward).try_normalize()?)),
        );
        let Some((forward, up)) = axes else {
            self.warnings.push(skip("its node's matrix is singular"));
            return Ok(());
        };
        let node = &root.nodes[placed.node];
        let name = node.name.as_deref().or(camera.name.as_deref());
        self.camera_places.push(placed.world_from_object.translation);
        self.scene.cameras.push(Camera {
            name: name.map_or_else(|| format!("cameras[{ix}]"), short),
            position: placed.world_from_object.translation.as_vec3(),
            forward,
            up,
            projection,
        });
        Ok(())
    }

    /// Light travels along the node's −Z; the node's scale is ignored. Candela and lux are read as
    /// W·sr⁻¹ and W·m⁻².
    pub(super) fn light(&mut self, ix: usize, placed: &Placed, at: &str) -> Result<(), ErrorKind> {
        let root = self.data.root;
        let lights = root
            .extensions
            .as_ref()
            .and_then(|e| e.khr_lights_punctual.as_ref())
            .map_or(&[][..], |e| &e.lights);
        let light =
            index(lights, ix, "lights", || format!("{at}.extensions.KHR_lights_punctual.light"))?;
        let at = format!("{} at {at}", named("lights", ix, light.name.as_deref()));
        let Checked::Valid(kind) = light.type_ else {
            return Err(ErrorKind::Data { at, problem: DataProblem::Unknown("type") });
        };
        let strength = Vec3::from_array(light.color) * light.intensity;
        if !strength.is_finite() || strength.min_element() < 0.0 {
            self.warnings.push(Warning::Value {
                at,
                problem: format!("intensity · color is {strength}; light left out"),
            });
            return Ok(());
        }
        let range = match light.range {
            Some(range) if !(range > 0.0 && range.is_finite()) => {
                self.warnings.push(Warning::Value {
                    at: at.clone(),
                    problem: format!("range is {range}, read as none"),
                });
                None
            }
            range => range,
        };
        let position = placed.world_from_object.translation.as_vec3();
        let direction = direction(placed, Vec3::NEG_Z);
        if direction.is_none() && kind != LightType::Point {
            self.warnings.push(Warning::Value {
                at,
                problem: "its node's matrix is singular; light left out".to_owned(),
            });
            return Ok(());
        }
        let direction = direction.unwrap_or(Vec3::NEG_Z);
        let made = match kind {
            LightType::Point => Light::Point { position, intensity: strength, range },
            LightType::Spot => {
                let (inner, outer) = self.cone(light.spot.as_ref(), &at);
                Light::Spot { position, direction, intensity: strength, inner, outer, range }
            }
            LightType::Directional => Light::Directional { direction, irradiance: strength },
        };
        self.light_places.push(placed.world_from_object.translation);
        self.scene.lights.push(made);
        Ok(())
    }

    fn cone(&mut self, spot: Option<&Spot>, at: &str) -> (f32, f32) {
        let (inner, outer) = spot.map_or((0.0, std::f32::consts::FRAC_PI_4), |spot| {
            (spot.inner_cone_angle, spot.outer_cone_angle)
        });
        // Far below a degree, f32 cannot tell a cone from a line, nor the falloff from a step.
        let outer =
            self.ranged(outer, 1e-4..=FRAC_PI_2, std::f32::consts::FRAC_PI_4, at, "outerConeAngle");
        let inner = self.ranged(inner, 0.0..=outer, 0.0, at, "innerConeAngle");
        (inner.min(outer * (1.0 - LEAST_FALLOFF)), outer)
    }
}
