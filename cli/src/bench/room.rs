// SPDX-License-Identifier: MIT OR Apache-2.0
//! A scene to measure on that needs no file: a closed room with finely divided spheres.

use glam::{Affine3A, Vec3, Vec4};
use lucerna::scene::{Camera, Instance, Light, Material, Mesh, Projection, Scene};
use std::collections::BTreeMap;

/// 33 spheres of 8192 triangles in a box of 12: 270 348 triangles.
pub fn room() -> (Scene, Camera) {
    let half = Vec3::new(6.0, 3.0, 6.0);
    let grey = Material { base_color: Vec4::new(0.7, 0.7, 0.7, 1.0), ..Material::default() };
    let mut instances = vec![Instance { mesh: 0, world_from_object: Affine3A::from_scale(half) }];
    for k in 0..33 {
        let angle = k as f32 * 2.4;
        let distance = 1.0 + 0.14 * k as f32;
        let radius = 0.4 + 0.015 * k as f32;
        let center = Vec3::new(
            distance * angle.cos(),
            radius - 3.0 + 0.1 * k as f32,
            distance * angle.sin(),
        );
        let placed = Affine3A::from_scale_rotation_translation(
            Vec3::splat(radius),
            glam::Quat::from_rotation_y(angle),
            center,
        );
        instances.push(Instance { mesh: 1, world_from_object: placed });
    }
    let scene = Scene {
        meshes: vec![cube(), sphere(5)],
        instances,
        materials: vec![grey],
        lights: vec![Light::Point {
            position: Vec3::new(0.0, 2.5, 0.0),
            intensity: Vec3::splat(20.0),
            range: None,
        }],
        ..Scene::default()
    };
    let forward = Vec3::new(-0.7, -0.25, -0.7).normalize();
    let right = forward.cross(Vec3::Y).normalize();
    let camera = Camera {
        name: "room".into(),
        position: Vec3::new(5.5, 1.0, 5.5),
        forward,
        up: right.cross(forward),
        projection: Projection::Perspective { vertical_fov: 1.1 },
    };
    (scene, camera)
}

fn cube() -> Mesh {
    let positions: Vec<Vec3> = (0..8)
        .map(|k| Vec3::new([-1.0, 1.0][k & 1], [-1.0, 1.0][k >> 1 & 1], [-1.0, 1.0][k >> 2]))
        .collect();
    let quads =
        [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]];
    let triangles = quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    Mesh { name: "box".into(), positions, triangles, ..Mesh::default() }
}

/// An octahedron, each face divided in four `levels` times (8·4^levels triangles), on the unit sphere.
fn sphere(levels: u32) -> Mesh {
    let mut positions: Vec<Vec3> = Vec3::AXES.into_iter().flat_map(|axis| [axis, -axis]).collect();
    let mut triangles: Vec<[u32; 3]> = Vec::new();
    for x in [0, 1] {
        for y in [2, 3] {
            for z in [4, 5] {
                let odd = (x + y + z) % 2 == 1;
                triangles.push(if odd { [x, z, y] } else { [x, y, z] });
            }
        }
    }
    for _ in 0..levels {
        let mut middles = BTreeMap::new();
        let mut next = Vec::with_capacity(triangles.len() * 4);
        for &[a, b, c] in &triangles {
            let mut middle = |a: u32, b: u32| {
                *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                    positions.push((positions[a as usize] + positions[b as usize]).normalize());
                    positions.len() as u32 - 1
                })
            };
            let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
            next.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
        }
        triangles = next;
    }
    Mesh {
        name: "sphere".into(),
        normals: positions.clone(),
        positions,
        triangles,
        ..Mesh::default()
    }
}
