// SPDX-License-Identifier: MIT OR Apache-2.0
//! The light of a probe, unpacked: the irradiance along six axes (J. Mitchell, G. McTaggart, C. Green,
//! "Shading in Valve's Source Engine", SIGGRAPH 2006).
//!
//! Interface: `ProbeLight`, `light_irradiance`. Which form it has is chosen by the variant `basis`.
#define_import_path lucerna::components::probes::probe_light

#import lucerna::components::voxels::grid::faces_of_direction

/// The light of a probe.
struct ProbeLight {
    /// Irradiance on surfaces whose normals are +X −X +Y −Y +Z −Z [W·m⁻²].
    faces: array<vec3<f32>, 6>,
}

/// Irradiance on a surface with unit normal [W·m⁻²]: that of the faces towards which it points, each times the square of its
/// component.
fn light_irradiance(light: ProbeLight, normal: vec3<f32>) -> vec3<f32> {
    var faces = light.faces;
    let towards = faces_of_direction(normal);
    let share = normal * normal;
    return share.x * faces[towards.x] + share.y * faces[towards.y] + share.z * faces[towards.z];
}
