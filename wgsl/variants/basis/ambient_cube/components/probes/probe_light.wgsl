// SPDX-License-Identifier: MIT OR Apache-2.0
//! The light that is blended from several probes: the irradiance along six axes (J. Mitchell, G. McTaggart, C. Green,
//! "Shading in Valve's Source Engine", SIGGRAPH 2006).
//!
//! Interface: `ProbeLight`, `add_probe_light`, `light_irradiance`. Which form it has is chosen by the variant `basis`.
#define_import_path lucerna::components::probes::probe_light

#import lucerna::components::voxels::grid::faces_of_direction

/// The light of a probe, or a weighted sum of several: it is linear.
struct ProbeLight {
    /// Irradiance on surfaces whose normals are +X −X +Y −Y +Z −Z [W·m⁻²].
    faces: array<vec3<f32>, 6>,
}

/// Adds `weight` times a light.
fn add_probe_light(sum: ptr<function, ProbeLight>, light: ProbeLight, weight: f32) {
    var added = light.faces;
    for (var k = 0u; k < 6u; k++) {
        (*sum).faces[k] += weight * added[k];
    }
}

/// Irradiance on a surface with unit normal [W·m⁻²]: that of the faces towards which it points, each times the square of its
/// component.
fn light_irradiance(light: ProbeLight, normal: vec3<f32>) -> vec3<f32> {
    var faces = light.faces;
    let towards = faces_of_direction(normal);
    let share = normal * normal;
    return share.x * faces[towards.x] + share.y * faces[towards.y] + share.z * faces[towards.z];
}
