// SPDX-License-Identifier: MIT OR Apache-2.0
//! Rooms in which techniques that store light in cells go wrong: walls at any angle, thin solids, curved shells. Every
//! surface is double-sided, as most exporters write it, and some are wound inside out.

use super::Random;
use crate::scene::{Camera, Instance, Light, Material, Mesh, Projection, Scene};
use glam::{Affine3A, Mat3, Quat, Vec3, Vec4};

/// A closed box of 8 × 3 × 4 m that a wall divides, lamps on one side of it alone.
#[derive(Clone, Debug)]
pub struct House {
    pub scene: Scene,
    /// In the middle of the lit part, and of the dark one \[m\].
    pub eyes: [Vec3; 2],
    /// How thick the wall is \[m\]; 0: a single sheet.
    pub thickness: f32,
    /// The wall's normal, towards the lit part.
    pub normal: Vec3,
    /// A point in the middle of the wall's thickness \[m\].
    pub through: Vec3,
}

/// Size of a [`House`] and of a [`room_with_table`] \[m\].
const ROOM: Vec3 = Vec3::new(8.0, 3.0, 4.0);

impl House {
    /// Draws a house by a seed. The wall stands at any angle, tilted by up to 25°, and is up to 1.5 times `cell` thick
    /// \[m\] (one of four: a sheet); one to three lamps.
    pub fn draw(seed: u64, cell: f32) -> Self {
        let mut random = Random(seed.wrapping_mul(0x9e37_79b9).wrapping_add(77));
        let thickness = if seed.is_multiple_of(4) { 0.0 } else { random.range(0.05, 1.5) * cell };
        loop {
            let (around, tilt) =
                (random.range(0.0, std::f32::consts::TAU), random.range(-0.44, 0.44));
            let normal =
                Vec3::new(around.cos() * tilt.cos(), tilt.sin(), around.sin() * tilt.cos());
            let through = ROOM * Vec3::new(random.range(0.2, 0.8), 0.5, random.range(0.2, 0.8));
            // Places on either side that are not too close to anything.
            let mut free = |side: f32| {
                (0..200).map(|_| random_in_room(&mut random)).find(|&at| {
                    let off = side * normal.dot(at - through);
                    off > 0.5 && off < 2.5
                })
            };
            let (Some(lit), Some(dark)) = (free(1.0), free(-1.0)) else { continue };
            let n_lamps = 1 + random.bits() % 3;
            let lamps: Vec<Vec3> = (0..1000)
                .map(|_| random_in_room(&mut random))
                .filter(|&at| normal.dot(at - through) > 0.4)
                .take(n_lamps as usize)
                .collect();
            let mut meshes = walls_of_box(Vec3::ZERO, ROOM);
            let half = 0.5 * thickness * normal;
            meshes.push(section(through + half, normal));
            if thickness > 0.0 {
                meshes.push(section(through - half, -normal));
            }
            for mesh in &mut meshes {
                if random.bits().is_multiple_of(2) {
                    mesh.triangles.iter_mut().for_each(|t| t.swap(1, 2));
                }
            }
            let mut scene = scene_of(meshes);
            scene.lights = lamps
                .into_iter()
                .map(|position| Light::Point {
                    position,
                    intensity: Vec3::splat(random.range(2.0, 10.0)),
                    range: None,
                })
                .collect();
            return Self { scene, eyes: [lit, dark], thickness, normal, through };
        }
    }
}

/// Six cameras that see all directions from a place \[m\], 90° wide each; for square pictures.
pub fn around(position: Vec3) -> [Camera; 6] {
    let projection = Projection::Perspective { vertical_fov: std::f32::consts::FRAC_PI_2 };
    std::array::from_fn(|k| {
        let axis = Vec3::AXES[k / 2];
        let forward = if k % 2 == 0 { axis } else { -axis };
        let up = if forward.y == 0.0 { Vec3::Y } else { Vec3::X };
        Camera { name: String::new(), position, forward, up, projection }
    })
}

/// Farther than 0.4 m from the walls.
fn random_in_room(random: &mut Random) -> Vec3 {
    Vec3::from_array(ROOM.to_array().map(|side| random.range(0.4, side - 0.4)))
}

/// A closed room of 8 × 3 × 4 m with a box of 3 × 1.6 m as a table in it, `thickness` thick, its top at the height `top` \[m\].
/// The lamp hangs in the middle, 0.4 m below the ceiling.
///
/// `up`: the axis (0, 1, 2) that becomes the vertical. The scene is turned, not stretched.
pub fn room_with_table(top: f32, thickness: f32, double_sided: bool, up: usize) -> Scene {
    let mut meshes = walls_of_box(Vec3::ZERO, ROOM);
    meshes.iter_mut().flat_map(|mesh| &mut mesh.triangles).for_each(|t| t.swap(1, 2));
    meshes.extend(walls_of_box(Vec3::new(2.5, top - thickness, 1.2), Vec3::new(5.5, top, 2.8)));
    let mut scene = scene_of(meshes);
    scene.materials[0].double_sided = double_sided;
    scene.lights.push(Light::Point {
        position: Vec3::new(4.0, 2.6, 2.0),
        intensity: Vec3::splat(20.0),
        range: None,
    });
    // Even permutations of the axes are rotations.
    let turned = match up {
        0 => Mat3::from_cols(Vec3::Z, Vec3::X, Vec3::Y),
        1 => Mat3::IDENTITY,
        _ => Mat3::from_cols(Vec3::Y, Vec3::Z, Vec3::X),
    };
    placed(scene, Affine3A::from_mat3(turned))
}

/// A closed room of 8 × 3.4 × 6 m (x and z around 0) with a free barrel vault of 2 m radius along x in it, springing at y
/// = 1, `thickness` thick inwards \[m\] (0: one sheet), with a lamp of 20 W/sr under it and one of 60 W/sr over it.
///
/// `turned`: how the whole is placed in the world.
pub fn vault(thickness: f32, turned: Quat) -> Scene {
    const SEGMENTS: u32 = 48;
    let mut meshes = walls_of_box(Vec3::new(-4.0, 0.0, -3.0), Vec3::new(4.0, 3.4, 3.0));
    meshes.iter_mut().flat_map(|mesh| &mut mesh.triangles).for_each(|t| t.swap(1, 2));
    // The profile's points, outside and inside.
    let arc = |radius: f32| -> Vec<Vec3> {
        (0..=SEGMENTS)
            .map(|k| {
                let angle = std::f32::consts::PI * k as f32 / SEGMENTS as f32;
                Vec3::new(0.0, 1.0 + radius * angle.sin(), radius * angle.cos())
            })
            .collect()
    };
    let strip = |a: Vec3, b: Vec3| {
        let (l, r) = (Vec3::X * -3.5, Vec3::X * 3.5);
        polygon(&[a + l, b + l, b + r, a + r])
    };
    let (outer, inner) = (arc(2.0), arc(2.0 - thickness));
    for k in 0..SEGMENTS as usize {
        meshes.push(strip(outer[k], outer[k + 1]));
        if thickness > 0.0 {
            meshes.push(strip(inner[k + 1], inner[k]));
            for x in [-3.5, 3.5] {
                let at = [outer[k], inner[k], inner[k + 1], outer[k + 1]];
                meshes.push(polygon(&at.map(|p| p + Vec3::X * x)));
            }
        }
    }
    if thickness > 0.0 {
        meshes.push(strip(inner[0], outer[0]));
        meshes.push(strip(outer[SEGMENTS as usize], inner[SEGMENTS as usize]));
    }
    let mut scene = scene_of(vec![joined(meshes)]);
    for (position, intensity) in [([0.0, 0.8, 0.4], 20.0), ([0.0, 3.25, 0.0], 60.0)] {
        scene.lights.push(Light::Point {
            position: position.into(),
            intensity: Vec3::splat(intensity),
            range: None,
        });
    }
    placed(scene, Affine3A::from_quat(turned))
}

/// The scene moved in the world, with its lights without extent.
fn placed(mut scene: Scene, world: Affine3A) -> Scene {
    for instance in &mut scene.instances {
        instance.world_from_object = world * instance.world_from_object;
    }
    for light in &mut scene.lights {
        if let Light::Point { position, .. } = light {
            *position = world.transform_point3(*position);
        }
    }
    scene
}

fn scene_of(meshes: Vec<Mesh>) -> Scene {
    let instances = (0..meshes.len())
        .map(|mesh| Instance { mesh, world_from_object: Affine3A::IDENTITY })
        .collect();
    let material = Material {
        base_color: Vec4::new(0.7, 0.6, 0.5, 1.0),
        double_sided: true,
        ..Material::default()
    };
    Scene { meshes, instances, materials: vec![material], ..Scene::default() }
}

/// The meshes as one.
fn joined(meshes: Vec<Mesh>) -> Mesh {
    let mut out = Mesh::default();
    for mesh in meshes {
        let first = out.positions.len() as u32;
        out.positions.extend(mesh.positions);
        out.triangles.extend(mesh.triangles.into_iter().map(|t| t.map(|ix| ix + first)));
    }
    out
}

/// A convex polygon.
fn polygon(corners: &[Vec3]) -> Mesh {
    Mesh {
        positions: corners.to_vec(),
        triangles: (2..corners.len() as u32).map(|k| [0, k - 1, k]).collect(),
        ..Mesh::default()
    }
}

/// The six sides of a box, facing outwards.
fn walls_of_box(low: Vec3, high: Vec3) -> Vec<Mesh> {
    let corner = |k: usize| {
        Vec3::new([low.x, high.x][k & 1], [low.y, high.y][k >> 1 & 1], [low.z, high.z][k >> 2])
    };
    [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]]
        .map(|side| polygon(&side.map(corner)))
        .to_vec()
}

/// Where a plane cuts the room: the polygon through the points on the box's edges, in order around the normal.
fn section(through: Vec3, normal: Vec3) -> Mesh {
    let mut corners: Vec<Vec3> = Vec::new();
    for axis in 0..3 {
        let (b, c) = ((axis + 1) % 3, (axis + 2) % 3);
        for (at_b, at_c) in [(0.0, 0.0), (ROOM[b], 0.0), (0.0, ROOM[c]), (ROOM[b], ROOM[c])] {
            let mut point = Vec3::ZERO;
            (point[b], point[c]) = (at_b, at_c);
            let along = normal.dot(through - point) / normal[axis];
            if along.is_finite() && (0.0..=ROOM[axis]).contains(&along) {
                point[axis] = along;
                corners.push(point);
            }
        }
    }
    let middle = corners.iter().sum::<Vec3>() / corners.len() as f32;
    let (u, v) = normal.any_orthonormal_pair();
    let angle = |p: &Vec3| (*p - middle).dot(v).atan2((*p - middle).dot(u));
    corners.sort_by(|p, q| angle(p).total_cmp(&angle(q)));
    polygon(&corners)
}
