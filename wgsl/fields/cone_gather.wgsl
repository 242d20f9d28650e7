// SPDX-License-Identifier: MIT OR Apache-2.0
//! Field: the light that a set of cones around a normal gathers.
//!
//! Interface: `gather_cones`. No bindings of its own: it traces with `fields::cone_trace`.
#define_import_path lucerna::fields::cone_gather

#import lucerna::cone::march::{Cone, ConeSettings}
#import lucerna::cone::cone_set::{drawn_cone_of_set, set_spread}
#import lucerna::fields::cone_trace::{start_height, trace_cone}
#import lucerna::math::constants::PI
#import lucerna::math::frame::frame_from_normal
#import lucerna::sampling::low_discrepancy::sobol_owen
#import lucerna::sampling::pcg::pcg

/// Light from the hemisphere.
struct Gathered {
    /// [W·m⁻²]
    irradiance: vec3<f32>,
    /// Cosine-weighted share of the hemisphere in which there is nothing within the distance `near`, in [0, 1].
    near_openness: f32,
}

/// Gathers with `n_cones` (`cone::cone_set`) around `normal` (unit length), from a point on a surface [m].
///
/// `plane`: the surface's own unit normal, along which cones leave it. `stream`, `sample_ix`: those of the random
/// numbers that turn each cone within its part of the hemisphere. `max_distance`, `near`: as in `trace_cone`, from
/// where the cones start [m]. (So what they miss before that is compensated, on average, by what they find beyond.)
fn gather_cones(
    position: vec3<f32>,
    plane: vec3<f32>,
    normal: vec3<f32>,
    n_cones: u32,
    stream: u32,
    sample_ix: u32,
    settings: ConeSettings,
    max_distance: f32,
    near: f32,
) -> Gathered {
    let basis = frame_from_normal(normal);
    let offset = start_height(position, plane, settings);
    let spread = set_spread(n_cones);
    var out: Gathered;
    for (var ix = 0u; ix < n_cones; ix++) {
        let member = drawn_cone_of_set(n_cones, ix, sobol_owen(sample_ix, pcg(stream + ix)));
        let direction = basis * member.direction;
        if dot(direction, plane) <= 0.0 {
            // Below the surface, where a bent normal may lead, it is dark.
            continue;
        }
        let cone = Cone(position, spread, direction, max_distance, plane, offset);
        let found = trace_cone(cone, settings, near);
        out.irradiance += PI * member.weight * found.radiance;
        out.near_openness += member.weight * found.near_transmittance;
    }
    return out;
}
