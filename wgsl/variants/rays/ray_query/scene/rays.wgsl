// SPDX-License-Identifier: MIT OR Apache-2.0
//! Scene seam: which triangle a ray hits. Implementation: the adapter's acceleration structure,
//! through ray queries.
//!
//! Interface and meaning as in `wgsl/scene/rays.wgsl`.
enable wgpu_ray_query;
#define_import_path lucerna::scene::rays

#import lucerna::scene::data::{triangles, TRIANGLE_ALPHA_TESTED}
#import lucerna::scene::surface::is_cut_away
#import lucerna::scene::types::{NONE, Hit, Ray}

/// One instance of one geometry, its triangles in the order of `triangles`.
@group(0) @binding(9) var acceleration: acceleration_structure;

/// Whether the hit of a triangle counts, by its material's alpha mask.
fn is_solid(triangle_ix: u32, barycentrics: vec2<f32>) -> bool {
    return (triangles[triangle_ix].flags & TRIANGLE_ALPHA_TESTED) == 0u
        || !is_cut_away(triangle_ix, barycentrics);
}

/// Traverses the acceleration structure; `flags` are RayDesc's. Candidates that an alpha mask
/// removes do not count.
fn trace(ray: Ray, flags: u32) -> Hit {
    var query: ray_query;
    rayQueryInitialize(
        &query,
        acceleration,
        RayDesc(flags, 0xffu, ray.t_min, ray.t_max, ray.origin, ray.direction),
    );
    while rayQueryProceed(&query) {
        let candidate = rayQueryGetCandidateIntersection(&query);
        if is_solid(candidate.primitive_index, candidate.barycentrics) {
            rayQueryConfirmIntersection(&query);
        }
    }
    let found = rayQueryGetCommittedIntersection(&query);
    if found.kind == RAY_QUERY_INTERSECTION_NONE {
        return Hit(ray.t_max, NONE, vec2<f32>(0.0));
    }
    return Hit(found.t, found.primitive_index, found.barycentrics);
}

/// Geometry is built without the opaque flag; this flag reports every candidate.
const FLAG_NO_OPAQUE: u32 = 0x02u;
const FLAG_TERMINATE_ON_FIRST_HIT: u32 = 0x04u;

/// The nearest triangle on the ray; `triangle` is NONE if there is none.
fn nearest_hit(ray: Ray) -> Hit {
    return trace(ray, FLAG_NO_OPAQUE);
}

/// Whether the ray hits anything.
fn any_hit(ray: Ray) -> bool {
    return trace(ray, FLAG_NO_OPAQUE | FLAG_TERMINATE_ON_FIRST_HIT).triangle != NONE;
}
