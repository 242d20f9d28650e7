// SPDX-License-Identifier: MIT OR Apache-2.0
//! `wgsl/light`.

use crate::harness::{KeepNan, Random, map};
use crate::math::directions;
use crate::sampling::{unit_corners, unit_inputs};
use crate::statistics::{Chart, assert_chi_square};
use glam::{DVec3, Vec3, Vec4};
use std::f64::consts::{PI, TAU};

#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
struct Spot {
    position: Vec3,
    range: f32,
    direction: Vec3,
    cos_inner: f32,
    intensity: Vec3,
    cos_outer: f32,
    at: Vec3,
    pad: f32,
}

#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
struct PunctualOutput {
    /// to_light, distance.
    point: Vec4,
    point_irradiance: Vec4,
    spot: Vec4,
    spot_irradiance: Vec4,
    sun: Vec4,
    sun_irradiance: Vec4,
}

fn punctual(inputs: &[Spot]) -> Vec<PunctualOutput> {
    map(
        "#import lucerna::light::punctual::{sample_point_light, sample_spot_light, sample_directional_light, spot_cone}
        struct Input { position: vec3<f32>, range: f32, direction: vec3<f32>, cos_inner: f32, intensity: vec3<f32>, cos_outer: f32, at: vec3<f32>, pad: f32 }
        struct Output { point: vec4<f32>, point_irradiance: vec4<f32>, spot: vec4<f32>, spot_irradiance: vec4<f32>, sun: vec4<f32>, sun_irradiance: vec4<f32> }
        fn map(i: Input) -> Output {
            let point = sample_point_light(i.position, i.intensity, i.range, i.at);
            let cone = spot_cone(i.cos_inner, i.cos_outer);
            let spot = sample_spot_light(i.position, i.direction, i.intensity, i.range, cone.x, cone.y, i.at);
            let sun = sample_directional_light(i.direction, i.intensity);
            return Output(
                vec4<f32>(point.to_light, point.distance), vec4<f32>(point.normal_irradiance, 0.0),
                vec4<f32>(spot.to_light, spot.distance), vec4<f32>(spot.normal_irradiance, 0.0),
                vec4<f32>(sun.to_light, sun.distance), vec4<f32>(sun.normal_irradiance, 0.0),
            );
        }",
        inputs,
    )
}

fn spots() -> Vec<Spot> {
    let mut random = Random(41);
    let mut out = Vec::new();
    for i in 0..20_000 {
        let scale = 10f32.powf(random.range(-2.0, 3.0));
        let position = random.direction() * random.range(0.0, scale);
        let at = random.direction() * scale;
        let outer = f64::from(random.range(0.02, 1.57));
        let inner = outer * f64::from(random.range(0.0, 0.99));
        // A third each: aimed at the point within the cone's rim, anywhere, at the point.
        let aim = (at - position).as_dvec3().normalize();
        let spread = [outer * 2.0, 10.0, 0.0][i % 3] * f64::from(random.unit());
        let direction = (aim + random.direction().as_dvec3() * spread).normalize().as_vec3();
        out.push(Spot {
            position,
            range: [0.0, scale * random.range(0.5, 3.0), -1.0][i % 3],
            direction,
            cos_inner: inner.cos() as f32,
            intensity: Vec3::new(random.unit(), 100.0 * random.unit(), 0.0),
            cos_outer: outer.cos() as f32,
            at,
            pad: 0.0,
        });
    }
    out
}

/// KHR_lights_punctual in f64 at 20 000 places.
///
/// Tolerances: direction and distance 4 roundings of the offset, whose own subtraction is exact to
/// one; irradiance 8 roundings, plus the window's and the cone's slopes times the rounding of their
/// arguments (4·(d/r)⁴ and scale).
#[test]
fn punctual_lights_match_the_specification() {
    let inputs = spots();
    for (i, o) in inputs.iter().zip(punctual(&inputs)) {
        let offset = i.position.as_dvec3() - i.at.as_dvec3();
        let distance = offset.length();
        let to_light = offset / distance;
        let window = match f64::from(i.range) {
            range if range > 0.0 => (1.0 - (distance / range).powi(4)).clamp(0.0, 1.0),
            _ => 1.0,
        };
        let scale = 1.0 / (f64::from(i.cos_inner) - f64::from(i.cos_outer)).max(0.001);
        let cone_at = (i.direction.as_dvec3().dot(-to_light) - f64::from(i.cos_outer)) * scale;
        let cone = cone_at.clamp(0.0, 1.0).powi(2);
        for sample in [o.point, o.spot] {
            assert!(
                (sample.truncate().as_dvec3() - to_light).length() < 5e-7,
                "{i:?}: direction to the light is {}, expected {to_light} within 5e-7",
                sample.truncate()
            );
            assert!(
                (f64::from(sample.w) / distance - 1.0).abs() < 5e-7,
                "{i:?}: distance is {}, expected {distance} within 5e-7 of it",
                sample.w
            );
        }
        let ratio = if i.range > 0.0 { (distance / f64::from(i.range)).min(1.0) } else { 0.0 };
        for lane in 0..3 {
            let full = f64::from(i.intensity[lane]) / (distance * distance);
            let bound = 1e-6 * full * (window + 5.0 * ratio.powi(4));
            let error = (f64::from(o.point_irradiance[lane]) - full * window).abs();
            assert!(
                error <= bound,
                "{i:?}: irradiance of the point light is {}, expected {} within {bound:.1e} in lane {lane}",
                o.point_irradiance[lane],
                full * window
            );
            let bound = bound + full * window * 2.0 * 6e-7 * scale;
            let error = (f64::from(o.spot_irradiance[lane]) - full * window * cone).abs();
            assert!(
                error <= bound,
                "{i:?}: irradiance of the spot is {}, expected {} within {bound:.1e} in lane {lane}",
                o.spot_irradiance[lane],
                full * window * cone
            );
            assert_eq!(
                o.sun_irradiance[lane], i.intensity[lane],
                "{i:?}: irradiance of the directional light in lane {lane}"
            );
        }
        assert_eq!(o.sun.truncate(), -i.direction, "{i:?}: direction to the directional light");
        assert!(
            o.sun.w > 3e38,
            "{i:?}: distance of the directional light is {}, expected above 3e38",
            o.sun.w
        );
    }
}

/// E = I/d² at whole distances; the window's ends; the cone's axis, middle and rim; a point on the
/// light itself.
#[test]
fn punctual_lights_have_their_closed_forms() {
    let at = |position: Vec3, range: f32, direction: Vec3| Spot {
        position,
        range,
        direction,
        cos_inner: 0.9,
        intensity: Vec3::new(8.0, 16.0, 0.5),
        cos_outer: 0.5,
        at: Vec3::new(1.0, 2.0, 3.0),
        pad: 0.0,
    };
    let here = Vec3::new(1.0, 2.0, 3.0);
    let up = |d: f32| here + Vec3::Y * d;
    // Axes whose cosine to −Y is the cone's middle and just within and beyond its rim.
    let tilted = |cos: f64| DVec3::new((1.0 - cos * cos).sqrt(), -cos, 0.0).as_vec3();
    let cases = [
        (at(up(2.0), 0.0, Vec3::NEG_Y), 2.0, 2.0),
        (at(up(4.0), 0.0, Vec3::NEG_Y), 0.5, 0.5),
        (at(up(4.0), 8.0, Vec3::NEG_Y), 0.5 * 0.9375, 0.5 * 0.9375),
        (at(up(4.0), 4.0, Vec3::NEG_Y), 0.0, 0.0),
        (at(up(4.0), 3.0, Vec3::NEG_Y), 0.0, 0.0),
        (at(up(1.0), 0.0, tilted(0.7)), 8.0, 8.0 * 0.25),
        (at(up(1.0), 0.0, tilted(0.95)), 8.0, 8.0),
        (at(up(1.0), 0.0, tilted(0.499)), 8.0, 0.0),
        (at(up(1.0), 0.0, Vec3::Y), 8.0, 0.0),
        (at(here, 0.0, Vec3::NEG_Y), 0.0, 0.0),
        (at(here, 5.0, Vec3::NEG_Y), 0.0, 0.0),
        (at(here + Vec3::X * 1e20, 0.0, Vec3::NEG_X), 0.0, 0.0),
    ];
    let outputs = punctual(&cases.map(|case| case.0));
    for ((input, point, spot), o) in cases.iter().zip(&outputs) {
        assert!(
            (o.point_irradiance.x - point).abs() < 2e-6 * (1.0 + point),
            "{input:?}: irradiance of the point light is {}, expected {point} within {:.1e}",
            o.point_irradiance.x,
            2e-6 * (1.0 + point)
        );
        assert!(
            (o.spot_irradiance.x - spot).abs() < 1e-5,
            "{input:?}: irradiance of the spot is {}, expected {spot} within 1e-5",
            o.spot_irradiance.x
        );
        assert!(
            (o.point_irradiance.y - 2.0 * o.point_irradiance.x).abs() < 1e-6,
            "{input:?}: green of the point light's irradiance is {}, expected twice the red {} within 1e-6",
            o.point_irradiance.y,
            o.point_irradiance.x
        );
        assert!(
            o.point.is_finite() && o.spot.is_finite(),
            "{input:?}: directions and distances are {} and {}, expected finite",
            o.point,
            o.spot
        );
    }
    // An edge sharper than the extension's least difference: 0.001 wide.
    let mut sharp = at(up(1.0), 0.0, tilted(0.5005));
    sharp.cos_inner = sharp.cos_outer;
    let o = punctual(&[sharp])[0];
    assert!(
        (o.spot_irradiance.x / 8.0 - 0.25).abs() < 1e-3,
        "irradiance in the middle of a sharp edge is {} of 8, expected 0.25 of it within 1e-3",
        o.spot_irradiance.x
    );
}

fn exact_direction(u: f64, v: f64) -> DVec3 {
    let (phi, theta) = (TAU * u, PI * v);
    DVec3::new(theta.sin() * phi.sin(), theta.cos(), -theta.sin() * phi.cos())
}

fn sky_round_trip(inputs: &[Vec4]) -> Vec<[Vec4; 2]> {
    map(
        "#import lucerna::sky::equirectangular::{uv_from_direction, direction_from_uv}
        alias Input = vec4<f32>;
        struct Output { there: vec4<f32>, back: vec4<f32> }
        fn map(input: vec4<f32>) -> Output {
            let uv = uv_from_direction(input.xyz);
            return Output(vec4<f32>(uv, 0.0, 0.0), vec4<f32>(direction_from_uv(uv), 0.0));
        }",
        inputs,
    )
}

/// The axes and diagonals stand where the convention says.
#[test]
fn equirect_map_has_its_corners() {
    let half = 0.5f32.sqrt();
    let cases = [
        (Vec3::NEG_Z, [0.0, 0.5]),
        (Vec3::X, [0.25, 0.5]),
        (Vec3::Z, [0.5, 0.5]),
        (Vec3::NEG_X, [0.75, 0.5]),
        (Vec3::new(half, 0.0, -half), [0.125, 0.5]),
        (Vec3::new(-half, 0.0, -half), [0.875, 0.5]),
        (Vec3::new(half, half, 0.0), [0.25, 0.25]),
        (Vec3::new(0.0, -half, half), [0.5, 0.75]),
        (Vec3::new(0.0, 3.0, -4.0), [0.0, 0.295_167_24]),
    ];
    let inputs: Vec<Vec4> = cases.iter().map(|case| case.0.extend(0.0)).collect();
    for ((direction, uv), [there, back]) in cases.iter().zip(sky_round_trip(&inputs)) {
        for lane in 0..2 {
            assert!(
                (there[lane] - uv[lane]).abs() < 2e-5,
                "uv of {direction} is {}, expected {uv:?} within 2e-5",
                there.truncate().truncate()
            );
        }
        assert!(
            (back.truncate() - direction.normalize()).length() < 1e-4,
            "{direction} comes back as {}, expected its unit vector within 1e-4",
            back.truncate()
        );
    }
    // Poles: v is exact, u anything in range. Just left of −Z, u does not reach 1.
    let inputs =
        [Vec4::Y, Vec4::NEG_Y, Vec4::new(-1e-30, 0.0, -1.0, 0.0), Vec4::new(-0.0, 0.0, -1.0, 0.0)];
    let outputs = sky_round_trip(&inputs);
    assert_eq!((outputs[0][0].y, outputs[1][0].y), (0.0, 1.0), "v of the poles +Y and −Y");
    for (input, [there, back]) in inputs.iter().zip(outputs) {
        assert!(
            (0.0..1.0).contains(&there.x) && back.is_finite(),
            "uv of {input} is {there} and comes back as {back}, expected u in 0 to 1 (less than 1) and a finite direction"
        );
    }
}

/// There against f64 and back again for directions over the sphere. The angles are known to the
/// driver's atan2: 2e-5 relative on lavapipe, so 2e-5·π of a radian either way.
#[test]
fn equirect_map_round_trips() {
    let inputs: Vec<Vec4> = directions(50_000, 42).iter().map(|d| d.extend(0.0)).collect();
    let mut worst = 0.0f64;
    for (input, [there, back]) in inputs.iter().zip(sky_round_trip(&inputs)) {
        let d = input.truncate().as_dvec3();
        assert!(
            (0.0..1.0).contains(&there.x) && (0.0..=1.0).contains(&there.y),
            "uv of {d} is {there}, expected u in 0 to 1 (less than 1) and v in 0 to 1"
        );
        let mapped = exact_direction(f64::from(there.x), f64::from(there.y));
        assert!(
            (mapped - d).length() < 1.2e-4,
            "uv of {d} is {there}, the direction {mapped}, expected within 1.2e-4"
        );
        let back = back.truncate().as_dvec3();
        assert!(
            (back - mapped).length() < 2e-6,
            "direction of uv {there} is {back}, expected {mapped} within 2e-6"
        );
        worst = worst.max_nan((back - d).length());
    }
    eprintln!("equirectangular round trip: {worst:e} rad at most");
    // From texels' centres: the place comes back within 1/100 of a texel of an 8192 × 4096 map.
    let mut random = Random(43);
    let places: Vec<Vec4> = (0..10_000)
        .map(|_| Vec4::new(random.unit(), 1e-3 + 0.998 * random.unit(), 0.0, 0.0))
        .collect();
    let outputs: Vec<Vec4> = map(
        "#import lucerna::sky::equirectangular::{uv_from_direction, direction_from_uv}
        alias Input = vec4<f32>;
        alias Output = vec4<f32>;
        fn map(input: vec4<f32>) -> vec4<f32> {
            let d = direction_from_uv(input.xy);
            return vec4<f32>(d, length(uv_from_direction(d) - input.xy));
        }",
        &places,
    );
    for (place, output) in places.iter().zip(&outputs) {
        let expected = exact_direction(f64::from(place.x), f64::from(place.y));
        assert!(
            (output.truncate().as_dvec3() - expected).length() < 2e-6,
            "direction of uv {place} is {}, expected {expected} within 2e-6",
            output.truncate()
        );
        assert!(
            output.w < 3e-5 || output.w > 0.99,
            "uv {place} comes back off by {}, expected below 3e-5 or, around, above 0.99",
            output.w
        );
    }
}

#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
struct TriangleInput {
    a: Vec4,
    b: Vec4,
    c: Vec4,
    at: Vec3,
    pad: f32,
    u: Vec4,
}

#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
struct TriangleOutput {
    to_light: Vec3,
    distance: f32,
    barycentrics: [f32; 2],
    pdf: f32,
    cosine: f32,
    area: f32,
    again: f32,
    pad: [f32; 2],
}

fn sample_triangle(inputs: &[TriangleInput]) -> Vec<TriangleOutput> {
    map(
        "#import lucerna::light::triangle::{sample_triangle_light, pdf_triangle_light, triangle_area}
        struct Input { a: vec4<f32>, b: vec4<f32>, c: vec4<f32>, at: vec3<f32>, pad: f32, u: vec4<f32> }
        struct Output { to_light: vec3<f32>, distance: f32, barycentrics: vec2<f32>, pdf: f32, cosine: f32, area: f32, again: f32, pad: vec2<f32> }
        fn map(i: Input) -> Output {
            let s = sample_triangle_light(i.a.xyz, i.b.xyz, i.c.xyz, i.at, i.u.xy);
            let again = pdf_triangle_light(i.a.xyz, i.b.xyz, i.c.xyz, s.to_light, s.distance);
            return Output(s.to_light, s.distance, s.barycentrics, s.pdf, s.cosine, triangle_area(i.a.xyz, i.b.xyz, i.c.xyz), again, vec2<f32>(0.0));
        }",
        inputs,
    )
}

/// Density, cosine, area and place in f64 for 20 000 triangles and receivers. Tolerances scale with
/// how flat the triangle is (the rounding of its cross product) and how edge-on it is seen.
#[test]
fn triangle_light_matches_f64() {
    let mut random = Random(44);
    let mut inputs = Vec::new();
    for _ in 0..20_000 {
        let mut next = || random.direction() * random.range(0.1, 2.0);
        let (a, b, c, at) = (next(), next(), next(), next());
        let u = Vec4::new(random.unit(), random.unit(), 0.0, 0.0);
        inputs.push(TriangleInput {
            a: a.extend(0.0),
            b: b.extend(0.0),
            c: c.extend(0.0),
            at,
            pad: 0.0,
            u,
        });
    }
    let mut n_compared = 0;
    for (i, o) in inputs.iter().zip(sample_triangle(&inputs)) {
        let [a, b, c] = [i.a, i.b, i.c].map(|p| p.truncate().as_dvec3());
        let cross = (b - a).cross(c - a);
        let area = cross.length() / 2.0;
        let flatness = (b - a).length() * (c - a).length() / cross.length();
        assert!(
            (f64::from(o.area) / area - 1.0).abs() < 4e-7 * flatness,
            "{i:?}: area is {}, expected {area} within {:.1e} of it",
            o.area,
            4e-7 * flatness
        );
        let [s, t] = o.barycentrics.map(f64::from);
        let offset = a * (1.0 - s - t) + b * s + c * t - i.at.as_dvec3();
        let distance = offset.length();
        // Sums of numbers up to 4 and their cancellation.
        let spread = 1e-6 / distance;
        assert!(
            (f64::from(o.distance) - distance).abs() < 1e-6,
            "{i:?}: distance is {}, expected {distance} within 1e-6",
            o.distance
        );
        assert!(
            (o.to_light.as_dvec3() - offset / distance).length() < 2.0 * spread + 3e-7,
            "{i:?}: direction to the light is {}, expected {} within {:.1e}",
            o.to_light,
            offset / distance,
            2.0 * spread + 3e-7
        );
        let cosine = -cross.normalize().dot(offset) / distance;
        let cosine_error = 2.0 * spread + 1e-6 * flatness;
        assert!(
            (f64::from(o.cosine) - cosine).abs() < cosine_error,
            "{i:?}: cosine is {}, expected {cosine} within {cosine_error:.1e}",
            o.cosine
        );
        if cosine.abs() > 10.0 * cosine_error {
            let pdf = distance * distance / (cosine.abs() * area);
            let bound = 2.0 * cosine_error / cosine.abs() + 4.0 * spread + 1e-6 * flatness;
            assert!(
                (f64::from(o.pdf) / pdf - 1.0).abs() < bound,
                "{i:?}: pdf is {}, expected {pdf} within {bound:.1e} of it",
                o.pdf
            );
            assert!(
                (o.again / o.pdf - 1.0).abs() < bound as f32,
                "{i:?}: pdf of the direction drawn is {}, expected the draw's {} within {bound:.1e} of it",
                o.again,
                o.pdf
            );
            n_compared += 1;
        }
    }
    assert!(
        n_compared > 19_000,
        "{n_compared} of {} triangles are compared, expected above 19 000",
        inputs.len()
    );
}

/// A right triangle above the receiver: area, density and cosine by hand; edge-on, no area, and the
/// receiver on the light give density 0.
#[test]
fn triangle_light_edge_cases() {
    let case = |a: Vec3, b: Vec3, c: Vec3, at: Vec3, u: [f32; 2]| TriangleInput {
        a: a.extend(0.0),
        b: b.extend(0.0),
        c: c.extend(0.0),
        at,
        pad: 0.0,
        u: Vec4::new(u[0], u[1], 0.0, 0.0),
    };
    let (z, x, y) = (Vec3::ZERO, Vec3::X * 2.0, Vec3::Y * 2.0);
    let outputs = sample_triangle(&[
        // u = 0 is the first corner; its front looks along +Z.
        case(z, x, y, Vec3::Z * 2.0, [0.0, 0.0]),
        case(z, x, y, Vec3::Z * -2.0, [0.0, 0.0]),
        case(z, x, y, Vec3::new(5.0, 1.0, 0.0), [0.3, 0.6]),
        case(z, x, x, Vec3::Z, [0.3, 0.6]),
        case(z, x, y, z, [0.0, 0.0]),
    ]);
    assert_eq!(
        (outputs[0].area, outputs[0].distance, outputs[0].cosine),
        (2.0, 2.0, 1.0),
        "area, distance and cosine of a right triangle seen from its front"
    );
    assert_eq!(
        (outputs[0].pdf, outputs[0].to_light),
        (2.0, Vec3::NEG_Z),
        "pdf and direction of a right triangle seen from its front"
    );
    assert_eq!(
        (outputs[1].pdf, outputs[1].cosine),
        (2.0, -1.0),
        "pdf and cosine of a right triangle seen from its back"
    );
    let degenerate = ["edge-on", "without area", "receiver on the light"];
    for (what, o) in degenerate.iter().zip(&outputs[2..]) {
        assert_eq!(o.pdf, 0.0, "{what}: pdf");
        assert!(
            o.to_light.is_finite() && o.distance.is_finite(),
            "{what}: direction {} and distance {}, expected finite",
            o.to_light,
            o.distance
        );
    }
}

/// Directions to a triangle by chi-square against d²/(cos·area) of the triangle that a ray meets in
/// f64, and the kernel's pdf integrating to 1.
#[test]
fn triangle_light_directions_follow_their_pdf() {
    const N: usize = 150_000;
    let [a, b, c] =
        [Vec3::new(-1.0, -0.5, 1.0), Vec3::new(1.5, -0.7, 1.5), Vec3::new(0.2, 1.2, 0.6)];
    let at = Vec3::new(0.1, 0.05, 0.0);
    let input =
        |u| TriangleInput { a: a.extend(0.0), b: b.extend(0.0), c: c.extend(0.0), at, pad: 0.0, u };
    let inputs: Vec<_> = unit_corners().into_iter().chain(unit_inputs(N, 45)).map(input).collect();
    let outputs = sample_triangle(&inputs);
    // Where the ray of a direction meets the triangle.
    let [p, q, r] = [a, b, c].map(|corner| (corner - at).as_dvec3());
    let cross = (q - p).cross(r - p);
    let area = cross.length() / 2.0;
    let distance_along = |d: DVec3| {
        let inside = [(p, q), (q, r), (r, p)].map(|(s, t)| s.cross(t).dot(d) > 0.0);
        let all = inside[0] == inside[1] && inside[1] == inside[2];
        let t = cross.dot(p) / cross.dot(d);
        (all && t > 0.0).then_some(t)
    };
    let density = |d: DVec3| {
        distance_along(d).map_or(0.0, |t| t * t / (cross.normalize().dot(d).abs() * area))
    };
    let centre = (p + q + r) / 3.0;
    let chart = Chart::about(centre, 2.0, [30, 24]);
    // Bins that an edge cuts are known to 1/96; those that it only grazes are pooled.
    let expected: Vec<f64> =
        chart.integrate(96, density).iter().map(|p| (p * N as f64).max(1e-9)).collect();
    let directions = outputs[64..].iter().map(|o| o.to_light.as_dvec3());
    assert_chi_square("triangle light", &chart.count(directions), &expected);

    let nodes = chart.nodes(512, 512);
    let lit: Vec<_> =
        nodes.iter().filter_map(|&(d, w)| distance_along(d).map(|t| (d, w, t))).collect();
    let inputs: Vec<Vec4> = lit.iter().map(|(d, _, t)| d.as_vec3().extend(*t as f32)).collect();
    let corners =
        [a, b, c].map(|p| format!("vec3<f32>({:?}, {:?}, {:?})", p.x, p.y, p.z)).join(", ");
    let pdfs: Vec<f32> = map(
        &format!(
            "#import lucerna::light::triangle::pdf_triangle_light
            alias Input = vec4<f32>;
            alias Output = f32;
            fn map(input: vec4<f32>) -> f32 {{ return pdf_triangle_light({corners}, input.xyz, input.w); }}"
        ),
        &inputs,
    );
    let sum: f64 = lit.iter().zip(&pdfs).map(|((_, w, _), &pdf)| w * f64::from(pdf)).sum();
    assert!(
        (sum - 1.0).abs() < 2e-3,
        "the integral of the triangle light's pdf is {sum}, expected 1 within 2e-3"
    );
}
