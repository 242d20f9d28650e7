//! `wgsl/voxel/{grid,bricks,lookup}.wgsl` and `wgsl/voxel_rt/cache.wgsl`.

use crate::harness::{Random, map};
use bytemuck::{Pod, Zeroable};
use glam::{DVec3, IVec3, UVec3, Vec3};
use std::collections::BTreeMap;

/// A grid in test WGSL, given by its size.
const GRID: &str = "
fn grid_of(size: vec3<u32>, n_faces: u32) -> VoxelGrid {
    let bricks = (size + BRICK - 1u) / BRICK;
    return VoxelGrid(vec3<f32>(0.0), 1.0, size, n_faces, bricks, 0u);
}
";

#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
struct Cell {
    cell: [u32; 3],
    reserved: u32,
}

/// Every cell of a grid whose size is no multiple of the brick's has a (brick, bit) of its own, both
/// within range, that leads back to it.
#[test]
fn bricks_number_every_cell_once() {
    for size in [UVec3::new(9, 5, 7), UVec3::ONE, UVec3::new(4, 4, 2), UVec3::new(3, 17, 1)] {
        let cells: Vec<Cell> = (0..size.z)
            .flat_map(|z| (0..size.y).flat_map(move |y| (0..size.x).map(move |x| [x, y, z])))
            .map(|cell| Cell { cell, reserved: 0 })
            .collect();
        let wgsl = format!(
            "#import lucerna::voxel::grid::{{VoxelGrid, pack_cell, unpack_cell}}
            #import lucerna::voxel::bricks::{{BRICK, bit_of_cell, brick_of_cell, cell_of_bit}}
            {GRID}
            struct Input {{ cell: vec3<u32> }}
            struct Output {{ cell: vec3<u32>, brick: u32, unpacked: vec3<u32>, bit: u32 }}
            fn map(in: Input) -> Output {{
                let grid = grid_of(vec3<u32>({}u, {}u, {}u), 6u);
                let brick = brick_of_cell(grid, in.cell);
                let bit = bit_of_cell(in.cell);
                return Output(cell_of_bit(grid, brick, bit), brick, unpack_cell(pack_cell(in.cell)), bit);
            }}",
            size.x, size.y, size.z
        );
        let n_bricks = size.x.div_ceil(4) * size.y.div_ceil(4) * size.z.div_ceil(2);
        let mut seen = BTreeMap::new();
        for (input, output) in cells.iter().zip(map::<Cell, [u32; 8]>(&wgsl, &cells)) {
            let [x, y, z, brick, ux, uy, uz, bit] = output;
            assert_eq!([x, y, z], input.cell);
            assert_eq!([ux, uy, uz], input.cell);
            assert!(brick < n_bricks && bit < 32, "{input:?}: brick {brick}, bit {bit}");
            assert_eq!(seen.insert((brick, bit), input.cell), None);
        }
    }
}

/// Slots count the set bits before, for random words and for the words' ends.
#[test]
fn slots_are_ranks() {
    let mut random = Random(1);
    let mut inputs: Vec<[u32; 4]> = Vec::new();
    for word in [0, 1, 0x8000_0000, u32::MAX, 0x5555_5555] {
        inputs.extend((0..32).map(|bit| [word, 7, bit, 0]));
    }
    inputs.extend(
        (0..5000).map(|_| {
            [random.bits() as u32, random.bits() as u32 >> 6, random.bits() as u32 % 32, 0]
        }),
    );
    let wgsl = "#import lucerna::voxel::bricks::slot_of_bit
        struct Input { a: vec4<u32> }
        struct Output { slot: u32 }
        fn map(in: Input) -> Output { return Output(slot_of_bit(in.a.x, in.a.y, in.a.z)); }";
    for (&[word, first, bit, _], slot) in inputs.iter().zip(map::<_, u32>(wgsl, &inputs)) {
        let expected = if word >> bit & 1 == 0 {
            u32::MAX
        } else {
            first + (0..bit).filter(|&b| word >> b & 1 == 1).count() as u32
        };
        assert_eq!(slot, expected, "word {word:#x}, first {first}, bit {bit}");
    }
}

/// Interpolating a linear function of the cells' centres gives that function, weights sum to 1, and
/// are not negative. Tolerance: the fraction is exact to half an ulp of a coordinate of up to 256
/// (1.5e-5), a weight is the product of three.
#[test]
fn taps_interpolate_linear_functions() {
    let mut random = Random(2);
    let mut points: Vec<[f32; 4]> = [[0.5; 4], [0.0; 4], [1.0; 4], [-0.5; 4], [255.5; 4]].to_vec();
    points.extend((0..10_000).map(|_| std::array::from_fn(|_| random.range(-2.0, 258.0))));
    let wgsl = "#import lucerna::voxel::lookup::{taps_at, tap_cell, tap_weight}
        struct Input { at: vec4<f32> }
        struct Output { cells: array<vec4<i32>, 8>, weights: array<f32, 8> }
        fn map(in: Input) -> Output {
            let taps = taps_at(in.at.xyz);
            var out: Output;
            for (var i = 0u; i < 8u; i++) {
                out.cells[i] = vec4<i32>(tap_cell(taps, i), 0);
                out.weights[i] = tap_weight(taps, i);
            }
            return out;
        }";
    for (point, words) in points.iter().zip(map::<_, [u32; 40]>(wgsl, &points)) {
        let mut sum = 0.0;
        let mut mean = DVec3::ZERO;
        for k in 0..8 {
            let cell =
                IVec3::new(words[4 * k] as i32, words[4 * k + 1] as i32, words[4 * k + 2] as i32);
            let weight = f64::from(f32::from_bits(words[32 + k]));
            assert!((0.0..=1.0).contains(&weight));
            sum += weight;
            mean += weight * (cell.as_dvec3() + 0.5);
        }
        let at = Vec3::from_slice(&point[..3]).as_dvec3();
        assert!((sum - 1.0).abs() < 1e-6, "{point:?}: {sum}");
        assert!((mean - at).abs().max_element() < 1e-4, "{point:?}: {mean}");
    }
}

/// The faces of a direction, their weights, and the faces' normals: n = Σ weightᵢ·normalᵢ/|nᵢ|.
#[test]
fn faces_and_their_weights() {
    let mut random = Random(3);
    let mut normals: Vec<[f32; 4]> = Vec3::AXES
        .into_iter()
        .flat_map(|axis| [axis, -axis])
        .map(|axis| axis.extend(0.0).to_array())
        .collect();
    normals.extend((0..5000).map(|_| random.direction().extend(0.0).to_array()));
    let wgsl = format!(
        "#import lucerna::voxel::grid::{{VoxelGrid, face_axis, face_normal, faces_of_direction}}
        #import lucerna::voxel::bricks::BRICK
        #import lucerna::voxel::lookup::face_weights
        {GRID}
        struct Input {{ n: vec4<f32> }}
        struct Output {{ normals: array<vec4<f32>, 3>, weights: vec3<f32>, one: f32 }}
        fn map(in: Input) -> Output {{
            let faces = faces_of_direction(in.n.xyz);
            var out: Output;
            for (var axis = 0u; axis < 3u; axis++) {{
                out.normals[axis] = vec4<f32>(face_normal(faces[axis]), f32(face_axis(faces[axis])));
            }}
            out.weights = face_weights(grid_of(vec3<u32>(1u), 6u), in.n.xyz);
            out.one = face_weights(grid_of(vec3<u32>(1u), 1u), in.n.xyz).x;
            return out;
        }}"
    );
    for (normal, out) in normals.iter().zip(map::<_, [f32; 16]>(&wgsl, &normals)) {
        for axis in 0..3 {
            let mut expected = [0.0, 0.0, 0.0, axis as f32];
            expected[axis] = if normal[axis] < 0.0 { -1.0 } else { 1.0 };
            assert_eq!(out[4 * axis..4 * axis + 4], expected, "{normal:?}");
            assert_eq!(out[12 + axis], normal[axis] * normal[axis]);
        }
        assert_eq!(out[15], 1.0);
    }
}

#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
struct Renewal {
    direct: [f32; 3],
    n_hits: f32,
    indirect: [f32; 3],
    n_rays: f32,
    new_direct: [f32; 3],
    new_hits: f32,
    new_indirect: [f32; 3],
    new_rays: f32,
    keep: f32,
    max_rays: f32,
    reserved: [f32; 2],
}

const RENEW: &str = "#import lucerna::voxel_rt::cache::{FaceLight, FaceSamples, renew, coverage}
    struct Input { before: FaceLight, samples: FaceSamples, keep: f32, max_rays: f32, reserved: vec2<f32> }
    struct Output { after: FaceLight, coverage: f32 }
    fn map(in: Input) -> Output {
        let after = renew(in.before, in.samples, in.keep, in.max_rays);
        return Output(after, coverage(after));
    }";

/// A record is a convex mixture of old and new: against the formula in f64, and energy-preserving:
/// equal old and new means stay. Tolerance: 8 roundings of the result.
#[test]
fn renewal_is_a_weighted_mean() {
    let mut random = Random(4);
    let mut inputs: Vec<Renewal> = (0..10_000)
        .map(|_| {
            let (n_rays, new_rays) =
                (random.range(0.0, 300.0).floor(), random.range(1.0, 9.0).floor());
            let n_hits = (random.unit() * n_rays).floor();
            let new_hits = (random.unit() * (new_rays + 1.0)).floor();
            let scale = 10f32.powf(random.range(-4.0, 4.0));
            let light = [scale, 0.5 * scale, 0.0];
            Renewal {
                direct: light,
                n_hits,
                indirect: light.map(|x| 3.0 * x),
                n_rays,
                new_direct: std::array::from_fn(|_| random.unit() * scale * new_hits),
                new_hits,
                new_indirect: std::array::from_fn(|_| random.unit() * scale * new_hits),
                new_rays,
                keep: [0.0, 0.5, 1.0][random.bits() as usize % 3],
                max_rays: [16.0, 256.0, 1e9][random.bits() as usize % 3],
                reserved: [0.0; 2],
            }
        })
        .collect();
    inputs.push(Renewal { new_rays: 2.0, max_rays: 64.0, keep: 1.0, ..Zeroable::zeroed() });
    for (input, out) in inputs.iter().zip(map::<_, [f32; 12]>(RENEW, &inputs)) {
        let f = f64::from;
        let room = (f(input.max_rays) - f(input.new_rays)).max(0.0);
        let fade =
            f(input.keep) * if f(input.n_rays) > room { room / f(input.n_rays) } else { 1.0 };
        let rays = fade * f(input.n_rays) + f(input.new_rays);
        let hits = fade * f(input.n_hits) + f(input.new_hits);
        let close = |got: f32, want: f64| (f(got) - want).abs() <= 5e-7 * want.abs();
        assert!(close(out[7], rays) && close(out[3], hits), "{input:?}\n{out:?}");
        assert!(f(out[7]) <= f(input.max_rays).max(f(input.new_rays)) * 1.000001);
        for k in 0..3 {
            let mean = |old: f32, new: f32| {
                if hits > 0.0 { (f(old) * fade * f(input.n_hits) + f(new)) / hits } else { 0.0 }
            };
            assert!(
                close(out[k], mean(input.direct[k], input.new_direct[k])),
                "{input:?}\n{out:?}"
            );
            assert!(close(out[4 + k], mean(input.indirect[k], input.new_indirect[k])));
        }
        assert!(close(out[8], if rays > 0.0 { hits / rays } else { 0.0 }));
    }
}
