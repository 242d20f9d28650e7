// SPDX-License-Identifier: MIT OR Apache-2.0
//! Unidirectional path tracing: the ground truth that techniques are measured against.
//!
//! J. Kajiya, "The Rendering Equation", 1986; direct light by next-event estimation combined with
//! the surface's own sampling by multiple importance sampling (Veach, Guibas 1995, power heuristic).
//!
//! Light is classified by how it reached the camera: *emitted* directly from an emitter or the sky, *direct* after one
//! reflection, *indirect* after more.
#define_import_path lucerna::integrators::path

#import lucerna::bsdf::metallic_roughness::metallic_roughness
#import lucerna::bsdf::scattering::{Scattering, scatter}
#import lucerna::camera::primary_ray::{Camera, primary_ray}
#import lucerna::frame::pixel_sums::PixelSums
#import lucerna::geometry::ray_offset::offset_ray_origin
#import lucerna::integrators::next_event::reflected_of_drawn_light
#import lucerna::scene::lights::{pdf_of_emitter, pdf_of_sky, lights_can_be_hit}
#import lucerna::scene::rays::{nearest_hit, any_hit}
#import lucerna::scene::sky::sky_radiance
#import lucerna::scene::surface::surface_at
#import lucerna::scene::types::{Ray, hit_is_miss, Surface, seen_from}
#import lucerna::math::constants::FLOAT_MAX
#import lucerna::math::float::all_finite
#import lucerna::math::frame::frame_from_normal
#import lucerna::math::loops::loops_run
#import lucerna::math::vector::max_component
#import lucerna::sampling::hemisphere::sample_cosine_hemisphere
#import lucerna::sampling::mis::power_heuristic
#import lucerna::sampling::pcg::random_vec4

/// What the integrator should compute.
struct PathSettings {
    /// Size of the whole picture [pixels].
    size: vec2<u32>,
    /// Index of the first sample of each pixel, and the number of samples.
    first_sample: u32,
    n_samples: u32,
    /// Number of invocations that share a pixel's samples: of n, each takes every n-th one.
    n_lanes: u32,
    /// Reflections after the first: 0 gives direct light only.
    n_bounces: u32,
    /// Seed of the random numbers.
    seed: u32,
    /// 1: the first surface is a white Lambertian, so that π·(direct + indirect) is its irradiance.
    irradiance: u32,
    /// Radius of ambient occlusion at the first surface [m]; 0: it is not computed.
    occlusion_distance: f32,
    reserved_a: u32,
    reserved_b: u32,
    reserved_c: u32,
}

/// Dimension of the random numbers for ambient occlusion; no path is this long.
const OCCLUSION_DIMENSION: u32 = 0xffffffffu;
/// Reflections before Russian roulette may end a path.
const ROULETTE_AFTER: u32 = 4u;
/// Upper bound of the probability of survival, so that even a path between white walls ends.
const ROULETTE_MAX: f32 = 0.95;

/// The state of one path.
struct Path {
    origin: vec3<f32>,
    /// Density with which `direction` was sampled [sr⁻¹].
    pdf: f32,
    direction: vec3<f32>,
    /// Number of surfaces so far.
    depth: u32,
    /// Product of the reflections so far, divided by their densities.
    throughput: vec3<f32>,
    /// Index of its sample.
    sample_ix: u32,
    emitted: vec3<f32>,
    reserved_a: u32,
    direct: vec3<f32>,
    reserved_b: u32,
    indirect: vec3<f32>,
    reserved_c: u32,
}

/// Results of a step.
const PATH_GOES_ON: u32 = 0u;
const PATH_ENDED: u32 = 1u;
/// The driver ended loops early (`math::loops`): nothing has been added, and the step must be repeated in another
/// invocation.
const PATH_INTERRUPTED: u32 = 2u;

/// A pixel's sums, and its unfinished path.
struct PixelProgress {
    sums: PixelSums,
    /// If all samples of the request are done, `sample_ix` has reached its end.
    path: Path,
    /// Samples abandoned because a single step took more loop iterations than the driver runs. They count as rejected.
    n_cut: u32,
}

/// Adds light that arrived after `n_reflections`.
fn add_light(path: ptr<function, Path>, n_reflections: u32, light: vec3<f32>) {
    if n_reflections == 0u {
        (*path).emitted += light;
    } else if n_reflections == 1u {
        (*path).direct += light;
    } else {
        (*path).indirect += light;
    }
}

/// A path's start in its pixel (box filter, one pixel wide).
fn start_path(camera: Camera, settings: PathSettings, pixel: vec2<u32>, sample_ix: u32) -> Path {
    let jitter = random_vec4(stream_of(settings, pixel), sample_ix, 0u).xy;
    let point = (vec2<f32>(pixel) + jitter) / vec2<f32>(settings.size);
    let ray = primary_ray(camera, point);
    var path: Path;
    path.origin = ray.origin;
    path.direction = ray.direction;
    path.throughput = vec3<f32>(1.0);
    path.sample_ix = sample_ix;
    return path;
}

/// The stream of random numbers of a pixel: its index in rows, and the seed.
fn stream_of(settings: PathSettings, pixel: vec2<u32>) -> vec2<u32> {
    return vec2<u32>(pixel.y * settings.size.x + pixel.x, settings.seed);
}

/// The first path of a request, `lane` < `n_lanes`.
fn first_path(camera: Camera, settings: PathSettings, pixel: vec2<u32>, lane: u32) -> Path {
    let n = settings.n_lanes;
    let first = settings.first_sample + (lane + n - settings.first_sample % n) % n;
    return start_path(camera, settings, pixel, first);
}

/// Follows a lane's paths through one pixel and adds them to its sums, starting with `begun`: [`first_path`], or what
/// the previous call returned if its `sample_ix` had not reached the end (`first_sample + n_samples`).
///
/// A finished path is followed by the pixel's next one within the same loop, so that neighbours in
/// a subgroup do not wait for each other's longest path.
fn trace_pixel(
    camera: Camera,
    settings: PathSettings,
    pixel: vec2<u32>,
    before: PixelSums,
    begun: Path,
) -> PixelProgress {
    var sums = before;
    var path = begun;
    let end = settings.first_sample + settings.n_samples;
    var n_cut = 0u;
    var is_first = true;
    while path.sample_ix < end {
        let outcome = advance(&path, &sums, camera, settings, pixel);
        // A step that no invocation can finish is abandoned, so that every call makes progress.
        let is_cut = outcome == PATH_INTERRUPTED && is_first;
        if outcome == PATH_INTERRUPTED && !is_first {
            break;
        }
        is_first = false;
        if outcome == PATH_ENDED || is_cut {
            let is_finite = all_finite(path.emitted) && all_finite(path.direct) && all_finite(path.indirect);
            if is_finite && !is_cut {
                sums.emitted += path.emitted;
                sums.direct += path.direct;
                sums.indirect += path.indirect;
            } else {
                sums.n_rejected += 1u;
            }
            n_cut += u32(is_cut);
            sums.n_samples += 1u;
            path = start_path(camera, settings, pixel, path.sample_ix + settings.n_lanes);
        }
    }
    return PixelProgress(sums, path, n_cut);
}

/// 1 if there is nothing within `distance` [m] along a direction of the hemisphere around the surface's normal (local,
/// +Z), otherwise 0.
fn open_along(surface: Surface, local: vec3<f32>, distance: f32) -> f32 {
    let direction = frame_from_normal(surface.shading_normal) * local;
    if dot(direction, surface.geometric_normal) <= 0.0 {
        return 0.0;
    }
    let origin = offset_ray_origin(
        surface.position,
        surface.position_error,
        surface.geometric_normal,
        direction,
    );
    return select(1.0, 0.0, any_hit(Ray(origin, 0.0, direction, distance)));
}

/// 0 in a way that no compiler can know: pictures are narrower than 2³¹ pixels.
fn unknown_zero(settings: PathSettings) -> u32 {
    return settings.size.x >> 31u;
}

/// Traces the path's next ray, adds the light that it finds, and reflects it. Returns a PATH_ constant.
///
/// All rays are traced before anything is added, so that an interrupted step has no effect.
fn advance(
    path: ptr<function, Path>,
    sums: ptr<function, PixelSums>,
    camera: Camera,
    settings: PathSettings,
    pixel: vec2<u32>,
) -> u32 {
    let depth = (*path).depth;
    let direction = (*path).direction;
    let sample_ix = (*path).sample_ix;
    let hit = nearest_hit(Ray((*path).origin, 0.0, direction, FLOAT_MAX));
    if hit_is_miss(hit) {
        if !loops_run(unknown_zero(settings)) {
            return PATH_INTERRUPTED;
        }
        (*sums).openness += select(0.0, 1.0, depth == 0u);
        let weight = select(power_heuristic((*path).pdf, pdf_of_sky(direction)), 1.0, depth == 0u);
        add_light(path, depth, (*path).throughput * sky_radiance(direction) * weight);
        return PATH_ENDED;
    }
    let surface = seen_from(surface_at(hit.triangle, hit.barycentrics), direction);
    let geometric_normal = surface.geometric_normal;
    let normal = surface.shading_normal;
    let is_last = depth > settings.n_bounces;
    let stream = stream_of(settings, pixel);

    var openness = 0.0;
    if depth == 0u && settings.occlusion_distance > 0.0 {
        let u = random_vec4(stream, sample_ix, OCCLUSION_DIMENSION);
        openness = open_along(surface, sample_cosine_hemisphere(u.xy), settings.occlusion_distance);
    }
    let frame = frame_from_normal(normal);
    let white = depth == 0u && settings.irradiance != 0u;
    let scattering = Scattering(
        metallic_roughness(
            select(surface.base_color, vec3<f32>(1.0), white),
            surface.metallic,
            surface.roughness,
        ),
        white || surface.lambert,
        -direction * frame,
    );
    var reflected = vec4<f32>(0.0);
    if !is_last {
        let u = random_vec4(stream, sample_ix, 2u * depth + 1u);
        reflected = reflected_of_drawn_light(surface, scattering, frame, u);
    }
    if !loops_run(unknown_zero(settings)) {
        return PATH_INTERRUPTED;
    }

    if any(surface.emission > vec3<f32>(0.0)) {
        let light_pdf = pdf_of_emitter(hit.triangle, direction, hit.t);
        let weight = select(power_heuristic((*path).pdf, light_pdf), 1.0, depth == 0u);
        add_light(path, depth, (*path).throughput * surface.emission * weight);
    }
    if depth == 0u {
        (*sums).albedo += surface.base_color;
        (*sums).normal += normal;
        (*sums).depth += dot(surface.position - camera.position, camera.forward);
        (*sums).n_surfaces += 1u;
        (*sums).openness += openness;
    }
    if is_last {
        return PATH_ENDED;
    }
    add_light(path, depth + 1u, (*path).throughput * reflected.rgb * reflected.a);

    // The last reflection is followed only to hit lights by chance.
    if depth == settings.n_bounces && !lights_can_be_hit() {
        return PATH_ENDED;
    }
    let u = random_vec4(stream, sample_ix, 2u * depth + 2u);
    let drawn = scatter(scattering, u.xyz);
    let next_direction = frame * drawn.direction;
    if !(drawn.pdf > 0.0) || dot(next_direction, geometric_normal) <= 0.0 {
        return PATH_ENDED;
    }
    var throughput = (*path).throughput * drawn.weight;
    if depth >= ROULETTE_AFTER {
        let survival = min(max_component(throughput), ROULETTE_MAX);
        if u.w >= survival {
            return PATH_ENDED;
        }
        throughput /= survival;
    }
    (*path).origin = offset_ray_origin(
        surface.position,
        surface.position_error,
        geometric_normal,
        next_direction,
    );
    (*path).direction = next_direction;
    (*path).throughput = throughput;
    (*path).pdf = drawn.pdf;
    (*path).depth = depth + 1u;
    return PATH_GOES_ON;
}
