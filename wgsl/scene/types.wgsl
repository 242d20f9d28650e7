// SPDX-License-Identifier: MIT OR Apache-2.0
//! Scene seam: the types of its functions, and functions that need only these.
//!
//! No bindings: a renderer with its own scene keeps this module, and returns its structs.
#define_import_path lucerna::scene::types

#import lucerna::math::constants::FLOAT_MAX

/// No light, no triangle.
const NONE: u32 = 0xffffffffu;

/// Points `origin + t·direction` with t in the open interval (t_min, t_max).
struct Ray {
    /// [m]
    origin: vec3<f32>,
    t_min: f32,
    /// Not zero; t is in units of its length.
    direction: vec3<f32>,
    t_max: f32,
}

/// The nearest surface point on a ray.
struct Hit {
    t: f32,
    /// NONE: the ray hits nothing.
    triangle: u32,
    /// Weights of the triangle's second and third corner.
    barycentrics: vec2<f32>,
}

/// Whether the ray hit nothing.
fn hit_is_miss(hit: Hit) -> bool {
    return hit.triangle == NONE;
}

/// A triangle in world space [m]; its front is where a, b, c run counter-clockwise.
struct TriangleCorners {
    a: vec3<f32>,
    b: vec3<f32>,
    c: vec3<f32>,
}

/// The corner at this place, 0 to 2: a, b, c [m].
fn corner_at(triangle: TriangleCorners, ix: u32) -> vec3<f32> {
    return select(select(triangle.c, triangle.b, ix == 1u), triangle.a, ix == 0u);
}

/// A point of a surface, in world space.
struct Surface {
    /// [m]
    position: vec3<f32>,
    /// Bound of the position's rounding error per axis [m].
    position_error: vec3<f32>,
    /// Unit length, by the triangle's winding: out of the front face.
    geometric_normal: vec3<f32>,
    /// Unit length, interpolated and normal-mapped, on the geometric normal's side.
    shading_normal: vec3<f32>,
    /// Linear, in [0, 1].
    base_color: vec3<f32>,
    metallic: f32,
    /// Perceptual.
    roughness: f32,
    /// Radiance out of the front face [W·sr⁻¹·m⁻²].
    emission: vec3<f32>,
    /// Whether the back emits light as well.
    double_sided: bool,
    /// Lambertian with `base_color` as albedo; metallic and roughness have no effect.
    lambert: bool,
}

/// The surface as a ray along `direction` (unit length, towards it) sees it: both normals on the
/// viewer's side, and only the emission that leaves to that side.
fn seen_from(surface: Surface, direction: vec3<f32>) -> Surface {
    var seen = surface;
    let front = dot(surface.geometric_normal, direction) <= 0.0;
    if !front {
        seen.geometric_normal = -surface.geometric_normal;
        seen.emission = select(vec3<f32>(0.0), surface.emission, surface.double_sided);
    }
    // A shading normal that the viewer sees from behind is reversed, as in Mitsuba's two-sided materials. Its
    // reflections are then mostly below the surface and are rejected later. (Using the geometric normal here instead
    // adds 3 % of indirect light to Crytek's Sponza.)
    if dot(seen.shading_normal, direction) >= 0.0 {
        seen.shading_normal = -seen.shading_normal;
    }
    return seen;
}

/// The appearance of a patch of a triangle from far away.
struct SurfaceOver {
    /// Share of uniform light that it reflects into the whole hemisphere, linear, in [0, 1]; for Lambertian surfaces
    /// the base colour.
    albedo: vec3<f32>,
    /// Whether the alpha mask removes the patch.
    is_cut_away: bool,
    /// Radiance out of the front face [W·sr⁻¹·m⁻²].
    emission: vec3<f32>,
    /// Whether the back emits light as well.
    double_sided: bool,
}

/// Light that may arrive at a point.
struct LightSample {
    /// Unit length, towards the light.
    direction: vec3<f32>,
    /// To `place` [m]; FLOAT_MAX: infinitely far.
    distance: f32,
    /// Position of the light (unless it is infinitely far away), already moved off its own surface.
    place: vec3<f32>,
    /// [sr⁻¹]; 0: a light without extent, which no other strategy finds.
    pdf: f32,
    /// The arriving light, divided by the density: `f · cosine · weight` estimates reflected radiance.
    weight: vec3<f32>,
    /// Index of the punctual light, or NONE for others.
    ix: u32,
}

/// The shadow ray to a light, which is hidden if the ray hits anything. `origin`: the lit point, moved off its surface.
fn ray_to_light(light: LightSample, origin: vec3<f32>) -> Ray {
    if light.distance < FLOAT_MAX {
        return Ray(origin, 0.0, light.place - origin, 1.0);
    }
    return Ray(origin, 0.0, light.direction, FLOAT_MAX);
}

/// A ray of light.
struct LightRay {
    /// [m]
    origin: vec3<f32>,
    /// Direction in which light travels, unit length.
    direction: vec3<f32>,
}

/// A direction towards the sky.
struct SkySample {
    /// Unit length, away from the surface.
    direction: vec3<f32>,
    /// [sr⁻¹]; 0: there is no light.
    pdf: f32,
    /// [W·sr⁻¹·m⁻²]
    radiance: vec3<f32>,
}
