// SPDX-License-Identifier: MIT OR Apache-2.0
//! Surfels: rays through grids, what a ray meets, the kernel `voxel_surfels/find` and cones from surfel to surfel, against
//! planes and boxes in f64.

use crate::harness::{Random, gpu, map, read, storage, submit};
use glam::{Affine3A, DVec3, UVec3, UVec4, Vec3};
use lucerna::components::LightVisibility;
use lucerna::components::voxel_light::{Eye, VoxelLight, VoxelLightSettings};
use lucerna::components::voxel_pyramid::{Cone, ConeResult, ConeStepping, TracePass};
use lucerna::components::voxel_surfels::Surfels;
use lucerna::components::voxels::{Resolution, VoxelCounts, n_bricks};
use lucerna::gpu_scene::{GpuScene, GpuSceneOptions};
use lucerna::scene::{Instance, Material, Mesh, Scene};
use lucerna::settings;
use lucerna::testing::House;

/// A ray steps into the cell in which it is just beyond the block that it leaves, at the distance of the border that it
/// crosses, by f64. Rays that leave within 1e-4 cells of an edge may go either way; some run along an axis. Tolerance: roundings of
/// a distance of up to 2⁵ cells over a component of a direction.
#[test]
fn rays_leave_blocks_where_their_borders_are() {
    let mut random = Random(71);
    let inputs: Vec<[f32; 16]> = (0..4000)
        .map(|ix| {
            let low: [f32; 3] = std::array::from_fn(|_| (random.bits() % 16) as f32);
            let size: [f32; 3] =
                std::array::from_fn(|_| [1.0, 2.0, 4.0][random.bits() as usize % 3]);
            let inside: [f32; 3] = std::array::from_fn(|k| low[k] + size[k] * random.unit());
            let direction = match ix % 8 {
                0 => Vec3::AXES[ix / 8 % 3] * if ix % 16 == 0 { 1.0 } else { -1.0 },
                _ => random.direction(),
            };
            let d = direction.to_array();
            // It started a while ago.
            let before = 5.0 * random.unit();
            let o: [f32; 3] = std::array::from_fn(|k| inside[k] - before * d[k]);
            [
                o[0], o[1], o[2], before, d[0], d[1], d[2], 0.0, low[0], low[1], low[2], 0.0,
                size[0], size[1], size[2], 0.0,
            ]
        })
        .collect();
    let found: Vec<[f32; 4]> = map(
        "#import lucerna::components::voxels::walk::{grid_point, grid_ray, step_out_of}
         struct Input { origin: vec4<f32>, direction: vec4<f32>, low: vec4<f32>, size: vec4<f32> }
         alias Output = vec4<f32>;
         fn map(x: Input) -> Output {
             let ray = grid_ray(x.origin.xyz, x.direction.xyz);
             let low = vec3<i32>(x.low.xyz);
             let next = step_out_of(ray, low, low + vec3<i32>(x.size.xyz), x.origin.w);
             return vec4<f32>(vec3<f32>(next.cell), next.t);
         }",
        &inputs,
    );
    let mut n_judged = 0;
    for (input, found) in inputs.iter().zip(found) {
        let at = |k: usize| DVec3::new(input[k].into(), input[k + 1].into(), input[k + 2].into());
        let (o, d, low, size) = (at(0), at(4), at(8), at(12));
        let ahead = |k: usize| d[k] > 0.0;
        let exit = |k: usize| (if ahead(k) { low[k] + size[k] } else { low[k] } - o[k]) / d[k];
        let exits = [0, 1, 2].map(|k| if d[k] == 0.0 { f64::MAX } else { exit(k) });
        let axis = (0..3).min_by(|&a, &b| exits[a].total_cmp(&exits[b])).unwrap();
        let t = exits[axis].max(input[3].into());
        let point = o + d * t;
        let is_clear = t == exits[axis]
            && (0..3)
                .all(|k| k == axis || d[k] == 0.0 || (point[k] - point[k].round()).abs() > 1e-4);
        let steep = d.abs().max_element().recip();
        assert!(
            (f64::from(found[3]) - t).abs() < 1e-4 * steep.max(1.0),
            "ray from {o} along {d} leaves {size} cells at {low} at {}, expected {t} within 1e-4",
            found[3]
        );
        if is_clear {
            n_judged += 1;
            let mut cell = point.floor();
            cell[axis] = if ahead(axis) { low[axis] + size[axis] } else { low[axis] - 1.0 };
            assert_eq!(
                DVec3::new(found[0].into(), found[1].into(), found[2].into()),
                cell,
                "next cell of a ray from {o} along {d} that leaves {size} cells at {low}"
            );
        }
    }
    assert!(n_judged > 3500, "{n_judged} of {} rays are judged", inputs.len());
}

/// Packed and unpacked, a surfel is itself: normals within 0.01°, offsets and opacities within a step of 16 bits, albedo within one of
/// 10; and the height of a point over it is that over its plane.
#[test]
fn packed_surfels_keep_their_planes() {
    let mut random = Random(72);
    let inputs: Vec<[f32; 16]> = (0..2000)
        .map(|ix| {
            let n = random.direction().to_array();
            let offset = if ix < 2 { [-1.0, 1.0][ix] } else { random.range(-0.9, 0.9) };
            let unit = |random: &mut Random| if ix < 4 { (ix % 2) as f32 } else { random.unit() };
            let albedo = [unit(&mut random), unit(&mut random), unit(&mut random)];
            let opacity = unit(&mut random);
            let p: [f32; 3] = std::array::from_fn(|_| random.range(-1.0, 2.0));
            let border = f32::from_bits((ix as u32) << 8 | 0x80);
            [
                n[0], n[1], n[2], offset, albedo[0], albedo[1], albedo[2], opacity, p[0], p[1],
                p[2], border, 0.0, 0.0, 0.0, 0.0,
            ]
        })
        .collect();
    let found: Vec<[f32; 12]> = map(
        "#import lucerna::components::voxel_surfels::surfel::{Surfel, height_over_surfel, pack_surfel, surfel_is_seen, unpack_surfel}
         struct Input { plane: vec4<f32>, albedo: vec4<f32>, point: vec4<f32>, rest: vec4<f32> }
         struct Output { plane: vec4<f32>, albedo: vec4<f32>, rest: vec4<f32> }
         fn map(x: Input) -> Output {
             let border = bitcast<u32>(x.point.w);
             let words = pack_surfel(Surfel(x.plane.xyz, x.plane.w, x.albedo.rgb, x.albedo.a, border));
             let s = unpack_surfel(words);
             let rest = vec4<f32>(
                 height_over_surfel(s, x.point.xyz), f32(surfel_is_seen(words)), f32(s.border == border), 0.0);
             return Output(vec4<f32>(s.normal, s.offset), vec4<f32>(s.albedo, s.opacity), rest);
         }",
        &inputs,
    );
    for (input, found) in inputs.iter().zip(found) {
        let vec =
            |of: &[f32], k: usize| DVec3::new(of[k].into(), of[k + 1].into(), of[k + 2].into());
        let normal = vec(input, 0);
        let off = normal.normalize().cross(vec(&found, 0)).length();
        assert!(off < 0.01f64.to_radians(), "normal {normal} becomes {}", vec(&found, 0));
        assert!(
            (input[3] - found[3]).abs() < 2e-5 && (input[7] - found[7]).abs() < 1e-5,
            "offset {} and opacity {} become {} and {}",
            input[3],
            input[7],
            found[3],
            found[7]
        );
        let color = (vec(input, 4) - vec(&found, 4)).abs().max_element();
        assert!(color < 0.5001 / 1023.0, "albedo {} becomes {}", vec(input, 4), vec(&found, 4));
        let height = normal.dot(vec(input, 8) - 0.5) - f64::from(input[3]);
        assert!(
            (f64::from(found[8]) - height).abs() < 1e-3,
            "height of {} over {normal}, {} is {}, expected {height} within 1e-3",
            vec(input, 8),
            input[3],
            found[8]
        );
        assert_eq!(found[9] == 1.0, input[7] >= 0.5 / 65535.0, "seen with opacity {}", input[7]);
        assert_eq!(found[10], 1.0, "the border is kept");
    }
}

/// What the comments of `surfel.wgsl` say, case by case: who is in front and goes behind meets the surface, where the plane is, or
/// at once if the plane of this cell is in front already; who comes from nowhere is in front with a slack of 0.05 cells, who was
/// behind with one of 0.3; at the start, the surface itself and its other side are not met.
#[test]
fn surfels_are_met_from_their_front() {
    const UNKNOWN: f32 = 0.0;
    const FRONT: f32 = 1.0;
    const BACK: f32 = 2.0;
    let cases: &[([f32; 3], [f32; 2])] = &[
        ([UNKNOWN, 0.5, -0.5], [BACK, 0.5]),
        ([UNKNOWN, 0.3, -0.1], [BACK, 0.75]),
        ([UNKNOWN, 0.5, 0.1], [FRONT, -1.0]),
        ([UNKNOWN, -0.04, -0.5], [BACK, 0.0]),
        ([UNKNOWN, -0.06, -0.5], [BACK, -1.0]),
        ([FRONT, 0.5, -0.5], [BACK, 0.5]),
        ([FRONT, -0.4, -0.5], [BACK, 0.0]),
        ([FRONT, 0.2, 0.0], [FRONT, -1.0]),
        ([BACK, 0.2, -0.5], [BACK, -1.0]),
        ([BACK, 0.4, -0.4], [BACK, 0.5]),
        ([BACK, 0.4, 0.35], [FRONT, -1.0]),
        ([BACK, -0.4, -0.5], [BACK, -1.0]),
    ];
    let inputs: Vec<[f32; 4]> = cases.iter().map(|(c, _)| [c[0], c[1], c[2], 0.0]).collect();
    let found: Vec<[f32; 4]> = map(
        "#import lucerna::components::voxel_surfels::surfel::meet_surfel
         alias Input = vec4<f32>;
         alias Output = vec4<f32>;
         fn map(x: Input) -> Output {
             let met = meet_surfel(u32(x.x), x.y, x.z);
             return vec4<f32>(f32(met.side), met.share, 0.0, 0.0);
         }",
        &inputs,
    );
    for ((input, [side, share]), found) in cases.iter().zip(found) {
        assert!(
            found[0] == *side && (found[1] - share).abs() < 1e-6,
            "side {}, heights {} and {}: side {} and share {}, expected {side} and {share}",
            input[0],
            input[1],
            input[2],
            found[0],
            found[1]
        );
    }
    // Height of the start, cosine to the surface there.
    let starts: &[([f32; 2], f32)] = &[
        ([0.3, 0.0], FRONT),
        ([-0.004, 0.0], FRONT),
        ([-0.006, 0.0], BACK),
        ([0.2, 0.6], BACK),
        ([0.3, 0.6], FRONT),
        ([0.2, 0.4], FRONT),
        ([0.7, -0.6], BACK),
        ([0.8, -0.6], FRONT),
        ([0.7, -0.4], FRONT),
        ([-0.7, -1.0], BACK),
    ];
    let inputs: Vec<[f32; 4]> = starts.iter().map(|(s, _)| [s[0], s[1], 0.0, 0.0]).collect();
    let found: Vec<[f32; 4]> = map(
        "#import lucerna::components::voxel_surfels::surfel::side_at_start
         alias Input = vec4<f32>;
         alias Output = vec4<f32>;
         fn map(x: Input) -> Output { return vec4<f32>(f32(side_at_start(x.x, x.y))); }",
        &inputs,
    );
    for (([height, cosine], side), found) in starts.iter().zip(found) {
        assert_eq!(found[0], *side, "side of a start at {height}, with a cosine of {cosine}");
    }
}

fn box_of(low: DVec3, high: DVec3, inwards: bool) -> Mesh {
    let corner = |ix: u32| {
        DVec3::new(
            if ix & 1 == 0 { low.x } else { high.x },
            if ix & 2 == 0 { low.y } else { high.y },
            if ix & 4 == 0 { low.z } else { high.z },
        )
        .as_vec3()
    };
    let sides =
        [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    let mut triangles = Vec::new();
    for [a, b, c, d] in sides {
        let both = [[a, b, c], [a, c, d]];
        triangles.extend(both.map(|[p, q, r]| if inwards { [p, r, q] } else { [p, q, r] }));
    }
    Mesh { positions: (0..8).map(corner).collect(), triangles, ..Mesh::default() }
}

/// A room with a box in it, neither on borders of cells.
const ROOM: [DVec3; 2] = [DVec3::ZERO, DVec3::new(4.0, 2.0, 3.0)];
const BLOCK: [DVec3; 2] = [DVec3::new(1.13, 0.0, 0.91), DVec3::new(2.31, 0.87, 1.77)];

fn room_with_block() -> Scene {
    let meshes = vec![box_of(ROOM[0], ROOM[1], true), box_of(BLOCK[0], BLOCK[1], false)];
    let instances =
        (0..2).map(|mesh| Instance { mesh, world_from_object: Affine3A::IDENTITY }).collect();
    let material = Material { double_sided: true, ..Material::default() };
    Scene { meshes, instances, materials: vec![material], ..Scene::default() }
}

/// The light of voxels of a scene after a frame, and its surfels.
fn surfels_of(scene: &Scene, cells: u32) -> (GpuScene, VoxelLight, Surfels) {
    let options = settings!(GpuSceneOptions { diffuse_only: true, ..Default::default() });
    let scene = GpuScene::new(gpu(), scene, options).unwrap();
    let settings = settings!(VoxelLightSettings {
        resolution: Resolution::Longest(cells),
        ..Default::default()
    });
    let visibility = LightVisibility::default();
    let mut light = VoxelLight::new(gpu(), &scene, settings, &visibility, Vec3::ONE).unwrap();
    let surfels = Surfels::new(gpu(), &scene, &light).unwrap();
    submit(|recorder| {
        light.update(recorder, &scene, &Eye::at(Vec3::ONE)).unwrap();
        surfels.record(recorder, &scene, &light);
    });
    (scene, light, surfels)
}

/// The normal, offset and opacity of packed words, after the table in `surfel.wgsl`.
fn unpacked(words: UVec4) -> (DVec3, f64, f64) {
    let snorm = |bits: u32| f64::from(bits as i16).max(-32767.0) / 32767.0;
    let (x, y) = (snorm(words.x & 0xffff), snorm(words.x >> 16));
    let z = 1.0 - x.abs() - y.abs();
    let fold = |a: f64, b: f64| if z < 0.0 { (1.0 - b.abs()) * a.signum() } else { a };
    let normal = DVec3::new(fold(x, y), fold(y, x), z).normalize();
    let offset = f64::from(words.y & 0xffff) / 65535.0 * 2.0 - 1.0;
    (normal, offset, f64::from(words.y >> 16) / 65535.0)
}

/// In a house with a slanted wall, each surfel's plane is one of the house: the floor's, the ceiling's, an outer wall's, or one of
/// the dividing wall's (within 1e-3 cells and 0.1°), whatever the angle; where nothing else is near, it is opaque. A record
/// behind the last one is left alone.
#[test]
fn surfels_of_a_house_lie_in_its_planes() {
    for seed in [1, 4] {
        let house = House::draw(seed, 8.0 / 20.0);
        let (_scene, light, surfels) = surfels_of(&house.scene, 20);
        let grid = *light.grid(0);
        let counts: VoxelCounts = bytemuck::pod_read_unaligned(&read(&light.buffers().counts[0]));
        let structure: Vec<[u32; 2]> =
            bytemuck::pod_collect_to_vec(&read(&light.buffers().structure));
        let words: Vec<UVec4> = bytemuck::pod_collect_to_vec(&read(surfels.buffer()));
        let half = 0.5 * f64::from(house.thickness);
        let n = house.normal.as_dvec3();
        let through = n.dot(house.through.as_dvec3());
        let (x, y, z) = (DVec3::X, DVec3::Y, DVec3::Z);
        let planes = [
            (x, 0.0),
            (-x, -8.0),
            (y, 0.0),
            (-y, -3.0),
            (z, 0.0),
            (-z, -4.0),
            (n, through + half),
            (-n, half - through),
        ];
        let first_slot = n_bricks(&grid) as usize;
        let (mut n_seen, mut n_single, mut n_opaque, mut n_second) = (0, 0, 0, 0);
        for (record, &packed) in words.iter().enumerate().take(counts.n_records as usize) {
            let (normal, offset, opacity) = unpacked(packed);
            if opacity == 0.0 {
                continue;
            }
            // Of a second record, that of its face.
            let is_second = record >= 6 * counts.n_voxels as usize;
            let side = first_slot + grid.capacity as usize + 2 * record;
            let first = if is_second { structure[side + 1][1] as usize } else { record };
            n_second += usize::from(is_second);
            let packed = structure[first_slot + first / 6][0];
            let cell = UVec3::new(packed & 1023, packed >> 10 & 1023, packed >> 20).as_dvec3();
            let middle = grid.origin.as_dvec3() + f64::from(grid.cell) * (cell + 0.5);
            // (Double-sided: a plane from either side.)
            let near: Vec<_> = planes
                .iter()
                .flat_map(|&(n, d)| [(n, d), (-n, -d)])
                .filter(|(n, d)| (n.dot(middle) - d).abs() < 0.9 * f64::from(grid.cell))
                .collect();
            n_seen += 1;
            let looks_out = normal[first % 6 / 2] * if first % 2 == 0 { 1.0 } else { -1.0 };
            assert!(
                looks_out > 0.0,
                "house {seed}, cell {cell}: the surfel of face {} has the normal {normal}",
                first % 6
            );
            if is_second || near.len() != 2 {
                continue;
            }
            n_single += 1;
            let fits = near.iter().any(|(n, d)| {
                let expected = (d - n.dot(middle)) / f64::from(grid.cell);
                n.cross(normal).length() < 2e-3
                    && n.dot(normal) > 0.0
                    && (offset - expected).abs() < 1e-3
            });
            assert!(
                fits,
                "house {seed}, cell {cell}, face {}: plane {normal}, {offset}, none of {near:?}",
                record % 6
            );
            n_opaque += usize::from(opacity == 1.0);
        }
        println!(
            "house {seed}: {n_seen} surfels, {n_single} of a single plane, {n_opaque} of those opaque"
        );
        assert!(
            n_single > 500 && n_opaque == n_single && n_second > 10,
            "house {seed}: of {n_single} surfels of a single plane, {n_opaque} are opaque, expected all of above 500; {n_second} are of second records, expected above 10"
        );
        let last = counts.n_records as usize;
        assert!(words[last..last + 64].iter().all(|&w| w == UVec4::ZERO), "behind the last record");
    }
}

/// Where a ray leaves the room, or meets the block; along the ray.
fn distance_in_room(o: DVec3, d: DVec3) -> f64 {
    let slabs = |[low, high]: [DVec3; 2]| {
        let (a, b) = ((low - o) / d, (high - o) / d);
        (a.min(b).max_element(), a.max(b).min_element())
    };
    let (_, wall) = slabs(ROOM);
    let (enters, leaves) = slabs(BLOCK);
    if enters < leaves && enters > 0.0 { enters.min(wall) } else { wall }
}

/// Rays in a room with a block, from any point in the air in any direction: up to 0.1 cells before the surface that f64 finds they
/// meet nothing, and 0.1 cells behind it everything, but for one in a hundred of them, which pass an edge or a corner by
/// less than a cell. All end in the room.
#[test]
fn rays_end_at_the_surface_that_they_meet() {
    let (_scene, light, surfels) = surfels_of(&room_with_block(), 31);
    let cell = f64::from(light.grid(0).cell);
    let mut random = Random(73);
    let mut rays = Vec::new();
    while rays.len() < 2000 {
        let u = DVec3::new(random.unit().into(), random.unit().into(), random.unit().into());
        let o = ROOM[0] + (ROOM[1] - ROOM[0]) * (0.05 + 0.9 * u);
        if (o.cmpge(BLOCK[0] - cell) & o.cmple(BLOCK[1] + cell)).all() {
            continue;
        }
        rays.push((o, random.direction().normalize().as_dvec3()));
    }
    let pass = TracePass::of_surfels(gpu());
    let results = |share: &dyn Fn(f64) -> f64| -> Vec<ConeResult> {
        let cones: Vec<Cone> = rays
            .iter()
            .map(|&(o, d)| Cone {
                origin: o.as_vec3(),
                spread: 0.0,
                direction: d.as_vec3().normalize(),
                max_distance: share(distance_in_room(o, d)) as f32,
                normal: Vec3::ZERO,
                offset: 0.0,
            })
            .collect();
        let inputs = storage(bytemuck::cast_slice(&cones));
        let outputs = storage(&vec![0u8; cones.len() * size_of::<ConeResult>()]);
        let field = surfels.field(light.buffers());
        submit(|recorder| {
            let n = cones.len() as u32;
            pass.record(recorder, field, &inputs, &outputs, n, ConeStepping::default(), 0.0);
        });
        bytemuck::pod_collect_to_vec(&read(&outputs))
    };
    let wrong = |of: &[ConeResult], is_wrong: &dyn Fn(f32) -> bool| {
        of.iter().filter(|result| is_wrong(result.transmittance)).count()
    };
    let before = wrong(&results(&|t| t - 0.1 * cell), &|left| left != 1.0);
    let behind = wrong(&results(&|t| t + 0.1 * cell), &|left| left > 0.05);
    let ends = wrong(&results(&|_| f64::from(f32::MAX)), &|left| left > 0.05);
    println!(
        "of 2000 rays {before} meet something too early, {behind} nothing, {ends} leave the room"
    );
    assert!(
        before <= 20 && behind <= 20 && ends == 0,
        "of 2000 rays {before} meet something before the surface, {behind} pass it, and {ends} leave the room; expected at most 20, 20 and 0"
    );
}
