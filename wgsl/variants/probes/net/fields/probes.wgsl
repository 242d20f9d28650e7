// SPDX-License-Identifier: MIT OR Apache-2.0
//! Field: light of probes, looked up at surface points: of those of a net.
//!
//! Interface: `probe_irradiance`, as that of the module that this replaces.
#define_import_path lucerna::fields::probes

#import lucerna::components::probes::probe_light::light_irradiance
#import lucerna::components::voxels::grid::grid_from_world
#import lucerna::fields::probe_net::{net_position, net_weights}
#import lucerna::fields::probe_places::place_reach
#import lucerna::fields::probe_store::{ProbePlace, ProbeQuery, blended_light, light_of_blend, light_of_probe}
#import lucerna::fields::probe_store::{probe_weight, probes}

/// Where a probe is [units].
fn place_of_probe(probe: u32) -> ProbePlace {
    return ProbePlace(grid_from_world(probes.lattice, net_position(probe)), false, place_reach(probe));
}

/// rgb: the irradiance by reflected light at a surface point [W·m⁻²], at least 0; a: the weight of the probes that were found, 0 if
/// there are none.
///
/// Barycentric between the four probes of the cell around the point, times `probe_weight`; a point outside the hull gets the light of
/// the hull's nearest point. `position` [m]; `normal`: unit length, on the side that is lit.
fn probe_irradiance(position: vec3<f32>, normal: vec3<f32>) -> vec4<f32> {
    let point = grid_from_world(probes.lattice, position);
    let query = ProbeQuery(point, point + normal * probes.normal_bias, normal);
    let found = net_weights(position);
    var sum = vec4<f32>(0.0);
    for (var ix = 0u; ix < 4u; ix++) {
        if found.weights[ix] > 0.0 {
            let probe = found.probes[ix];
            let weight = found.weights[ix] * probe_weight(probe, place_of_probe(probe), query);
            sum += weight * vec4<f32>(blended_light(light_irradiance(light_of_probe(probe), normal)), 1.0);
        }
    }
    if !(sum.a > 0.0) {
        return vec4<f32>(0.0);
    }
    return vec4<f32>(light_of_blend(sum.rgb / sum.a), sum.a);
}
