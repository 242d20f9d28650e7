// SPDX-License-Identifier: MIT OR Apache-2.0
//! Texture coordinates and the texels of charts.

use crate::harness::Random;
use glam::{DVec2, Vec2, Vec3};
use lucerna::components::lightmap::{
    LightmapError, LightmapSettings, LightmapUvs, NO_CHART, Receivers, unwrap,
};
use lucerna::seam::StaticMesh;
use lucerna::settings;
use std::collections::HashMap;

fn unwrapped(meshes: &[StaticMesh], n_texels: u32) -> Result<LightmapUvs, LightmapError> {
    unwrap(meshes, &settings!(LightmapSettings { n_texels, ..Default::default() }), &|| true)
}

/// Triangles that are anywhere, some of them without area, some slivers.
fn soup(n: usize) -> StaticMesh {
    let mut random = Random(21);
    let mut mesh = StaticMesh { name: "soup".into(), ..Default::default() };
    for ix in 0..n {
        let size = 10f32.powf(random.range(-3.0, 0.5));
        let at = 3.0 * random.direction();
        let first = mesh.positions.len() as u32;
        let corner = |random: &mut Random| at + size * random.direction();
        let [a, b] = [corner(&mut random), corner(&mut random)];
        let c = match ix % 7 {
            0 => a.lerp(b, 0.5),
            1 => a.lerp(b, 0.4) + 1e-5 * size * random.direction(),
            2 => a,
            _ => corner(&mut random),
        };
        mesh.positions.extend([a, b, c]);
        mesh.triangles.push([first, first + 1, first + 2]);
    }
    mesh
}

/// Every triangle has its own place, right side up, as large as its area asks for; no two charts share a texel, with two texels between them; and what
/// has no area has no place.
#[test]
fn charts_do_not_meet() {
    let mesh = soup(400);
    let uvs = unwrapped(std::slice::from_ref(&mesh), 4000).unwrap();
    let mut owner: HashMap<[i32; 2], u32> = HashMap::new();
    let receivers = Receivers::of(&uvs);
    for (ix, texel) in receivers.texels.iter().enumerate() {
        let charts: Vec<u32> =
            receivers.points_of(ix).iter().map(|p| uvs.charts[p.triangle as usize]).collect();
        assert!(
            charts.iter().all(|c| *c == charts[0] && *c != NO_CHART),
            "texel {texel:?} of charts {charts:?}"
        );
        owner.insert(texel.map(i32::from), charts[0]);
    }
    for ([x, y], chart) in &owner {
        for (dx, dy) in [(1, 0), (0, 1), (1, 1), (-1, 1), (2, 0), (0, 2)] {
            let other = owner.get(&[x + dx, y + dy]);
            assert!(
                other.is_none_or(|of| of == chart),
                "charts {chart} and {other:?} are beside each other at {x}, {y}"
            );
        }
    }
    let mut n_flat = 0;
    for (ix, corners) in uvs.corners.iter().enumerate() {
        let world: [Vec3; 3] = mesh.triangles[ix].map(|v| mesh.positions[v as usize]);
        let area = 0.5 * (world[1] - world[0]).cross(world[2] - world[0]).length();
        if uvs.charts[ix] == NO_CHART {
            n_flat += 1;
            assert!(area < 1e-3, "triangle {ix} of {area} m² has no texels");
            continue;
        }
        let [a, b, c] = corners.map(Vec2::as_dvec2);
        let flat = 0.5 * (b - a).perp_dot(c - a);
        let expected = f64::from(area * uvs.texels_per_metre.powi(2));
        assert!(
            flat > 0.0 && (flat - expected).abs() < 0.02 * expected + 1e-3,
            "triangle {ix}: {flat} texels², expected {expected}"
        );
    }
    assert!(n_flat >= 2 * 400 / 7, "{n_flat} triangles without texels");
}

/// Each texel that a chart touches is a receiver, by the area of the intersection of square and triangle (clipped in f64); its points lie in it and on
/// the triangle.
#[test]
fn receivers_are_the_texels_that_charts_touch() {
    let mesh = soup(60);
    let uvs = unwrapped(std::slice::from_ref(&mesh), 900).unwrap();
    let receivers = Receivers::of(&uvs);
    let mut areas: HashMap<[u16; 2], f64> = HashMap::new();
    for (ix, corners) in uvs.corners.iter().enumerate() {
        if uvs.charts[ix] == NO_CHART {
            continue;
        }
        let polygon: Vec<DVec2> = corners.map(Vec2::as_dvec2).to_vec();
        let (low, high) = polygon
            .iter()
            .fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(l, h), p| (l.min(*p), h.max(*p)));
        for y in low.y as u16..=high.y as u16 {
            for x in low.x as u16..=high.x as u16 {
                *areas.entry([x, y]).or_default() += clipped_area(&polygon, x.into(), y.into());
            }
        }
    }
    let known: Vec<[u16; 2]> = receivers.texels.clone();
    for (texel, area) in &areas {
        let is_there = known.contains(texel);
        assert!(
            is_there || *area < 1e-9,
            "texel {texel:?} is covered by {area}, and is no receiver"
        );
    }
    for (ix, texel) in known.iter().enumerate() {
        assert!(areas.contains_key(texel), "texel {texel:?} is touched by nothing");
        let points = receivers.points_of(ix);
        assert!(!points.is_empty() && points.len() <= 16, "{} points", points.len());
        for point in points {
            let weights = point.weights_of_corners();
            assert!(weights.iter().all(|w| (0.0..=1.0).contains(w)), "weights {weights:?}");
            let corners = uvs.corners[point.triangle as usize];
            let at: DVec2 = (0..3).map(|k| corners[k].as_dvec2() * weights[k]).sum();
            let apart =
                (at - DVec2::new(f64::from(texel[0]) + 0.5, f64::from(texel[1]) + 0.5)).abs();
            // (The nearest point to the centre of a texel that is touched at a corner may be beside it.)
            assert!(apart.length() < 0.71, "texel {texel:?} has a point at {at}");
        }
    }
}

/// Area of a convex polygon within the unit square at x, y (Sutherland and Hodgman).
fn clipped_area(polygon: &[DVec2], x: f64, y: f64) -> f64 {
    let mut points = polygon.to_vec();
    let planes = [(DVec2::X, x), (-DVec2::X, -x - 1.0), (DVec2::Y, y), (-DVec2::Y, -y - 1.0)];
    for (normal, offset) in planes {
        let of = |p: DVec2| normal.dot(p) - offset;
        let mut next = Vec::new();
        for k in 0..points.len() {
            let (a, b) = (points[k], points[(k + 1) % points.len()]);
            if of(a) >= 0.0 {
                next.push(a);
            }
            if (of(a) >= 0.0) != (of(b) >= 0.0) {
                next.push(a.lerp(b, of(a) / (of(a) - of(b))));
            }
        }
        points = next;
    }
    0.5 * (0..points.len()).map(|k| points[k].perp_dot(points[(k + 1) % points.len()])).sum::<f64>()
}

fn quad(second_uv: Vec<Vec2>) -> StaticMesh {
    StaticMesh {
        name: "quad".into(),
        positions: vec![Vec3::ZERO, Vec3::X, Vec3::X + Vec3::Y, Vec3::Y],
        second_uv,
        triangles: vec![[0, 1, 2], [0, 2, 3]],
    }
}

/// Second texture coordinates are used where they are those of a lightmap: two islands stay two. Otherwise the notes say what is wrong with them.
#[test]
fn second_texture_coordinates() {
    let whole = vec![Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y];
    // Six vertices, two islands.
    let islands = StaticMesh {
        positions: vec![
            Vec3::ZERO,
            Vec3::X,
            Vec3::X + Vec3::Y,
            Vec3::ZERO,
            Vec3::X + Vec3::Y,
            Vec3::Y,
        ],
        second_uv: [[0.0, 0.0], [0.4, 0.0], [0.4, 0.4], [0.5, 0.5], [0.9, 0.9], [0.5, 0.9]]
            .map(Vec2::from)
            .to_vec(),
        triangles: vec![[0, 1, 2], [3, 4, 5]],
        ..quad(vec![])
    };
    for (mesh, n_charts, note) in [
        (quad(vec![]), 1, ""),
        (quad(whole.clone()), 1, ""),
        (islands, 2, ""),
        (quad(whole.iter().map(|uv| 3.0 * *uv).collect()), 1, "not between 0 and 1"),
        (quad(vec![Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::X]), 1, "lie over each other"),
        (quad(vec![Vec2::ZERO; 4]), 1, "no triangle has an area"),
        (quad(vec![Vec2::NAN; 4]), 1, "not finite"),
        (quad(vec![Vec2::ZERO; 3]), 1, "not as many as vertices"),
    ] {
        let uvs = unwrapped(std::slice::from_ref(&mesh), 100).unwrap();
        assert_eq!(uvs.n_charts, n_charts, "charts of {mesh:?}");
        let is_right =
            if note.is_empty() { uvs.notes.is_empty() } else { uvs.notes[0].contains(note) };
        assert!(is_right, "notes {:?}, expected {note:?}", uvs.notes);
        let off = settings!(LightmapSettings {
            uses_second_uv: false,
            n_texels: 100,
            ..Default::default()
        });
        let without = unwrap(std::slice::from_ref(&mesh), &off, &|| true).unwrap();
        assert!(without.n_charts == 1 || n_charts == 2, "{} charts", without.n_charts);
        assert!(without.notes.is_empty(), "{:?}", without.notes);
    }
}

/// What is not possible is refused.
#[test]
fn impossible_lightmaps() {
    let none = unwrapped(&[], 100).unwrap_err();
    assert!(matches!(none, LightmapError::NoSurfaces), "{none}");
    let flat = StaticMesh { positions: vec![Vec3::ZERO; 4], ..quad(vec![]) };
    let flat = unwrapped(&[flat], 100).unwrap_err();
    assert!(matches!(flat, LightmapError::NoSurfaces), "{flat}");
    for n in [0, 15, (1 << 24) + 1] {
        let error = unwrapped(&[quad(vec![])], n).unwrap_err();
        assert!(matches!(error, LightmapError::Texels(_)), "{n} texels: {error}");
    }
    let not_finite = StaticMesh { positions: vec![Vec3::NAN; 4], ..quad(vec![]) };
    assert!(unwrapped(&[not_finite], 100).is_err(), "positions that are not finite");
    let stopped = unwrap(&[quad(vec![])], &LightmapSettings::default(), &|| false).unwrap_err();
    assert!(matches!(stopped, LightmapError::Stopped), "{stopped}");
}
