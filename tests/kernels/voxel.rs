// SPDX-License-Identifier: MIT OR Apache-2.0
//! `wgsl/voxel/{grid,bricks,lookup}.wgsl` and `wgsl/components/voxel_light/cache.wgsl`.

use crate::harness::{Largest, Random, map};
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

/// Exact, for every cell in and around grids whose sizes are and are not multiples of the brick's.
#[test]
fn only_cells_of_the_grid_are_inside() {
    let mut inputs = Vec::new();
    for size in [[8, 8, 4], [4, 4, 2], [7, 3, 5], [1, 1, 1]] {
        for z in -2..=size[2] + 1 {
            for y in -2..=size[1] + 1 {
                inputs.extend(
                    (-2..=size[0] + 1).map(|x| [[x, y, z, 0], [size[0], size[1], size[2], 0]]),
                );
            }
        }
    }
    inputs.extend([[[i32::MIN, 0, 0, 0], [8; 4]], [[0, i32::MAX, 0, 0], [8; 4]]]);
    let found: Vec<[u32; 1]> = map(
        &format!(
            "#import lucerna::components::voxels::bricks::BRICK
             #import lucerna::components::voxels::grid::{{VoxelGrid, is_inside}}
             {GRID}
             struct Input {{ cell: vec4<i32>, size: vec4<i32> }}
             struct Output {{ inside: u32 }}
             fn map(x: Input) -> Output {{
                 return Output(u32(is_inside(grid_of(vec3<u32>(x.size.xyz), 6u), x.cell.xyz)));
             }}"
        ),
        &inputs,
    );
    for ([cell, size], [found]) in inputs.iter().zip(found) {
        let expected = (0..3).all(|axis| (0..size[axis]).contains(&cell[axis]));
        assert_eq!(found == 1, expected, "whether cell {cell:?} is inside a grid of {size:?}");
    }
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
            "#import lucerna::components::voxels::grid::{{VoxelGrid, pack_cell, unpack_cell}}
            #import lucerna::components::voxels::bricks::{{BRICK, bit_of_cell, brick_of_cell, cell_of_bit}}
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
            assert_eq!([x, y, z], input.cell, "grid of {size}: cell of brick {brick}, bit {bit}");
            assert_eq!([ux, uy, uz], input.cell, "grid of {size}: cell, packed and unpacked");
            assert!(
                brick < n_bricks && bit < 32,
                "grid of {size}: cell {:?} has brick {brick} and bit {bit}, expected below {n_bricks} and 32",
                input.cell
            );
            assert_eq!(
                seen.insert((brick, bit), input.cell),
                None,
                "grid of {size}: brick {brick}, bit {bit} is of cell {:?}, and of another one",
                input.cell
            );
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
    let wgsl = "#import lucerna::components::voxels::bricks::slot_of_bit
        struct Input { a: vec4<u32> }
        struct Output { slot: u32 }
        fn map(in: Input) -> Output { return Output(slot_of_bit(in.a.x, in.a.y, in.a.z)); }";
    for (&[word, first, bit, _], slot) in inputs.iter().zip(map::<_, u32>(wgsl, &inputs)) {
        let expected = if word >> bit & 1 == 0 {
            u32::MAX
        } else {
            first + (0..bit).filter(|&b| word >> b & 1 == 1).count() as u32
        };
        assert_eq!(slot, expected, "slot of word {word:#x}, first {first}, bit {bit}");
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
    let wgsl = "#import lucerna::components::voxels::lookup::{taps_at, tap_cell, tap_weight}
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
            assert!(
                (0.0..=1.0).contains(&weight),
                "{point:?}: the weight of tap {k} is {weight}, expected 0 to 1"
            );
            sum += weight;
            mean += weight * (cell.as_dvec3() + 0.5);
        }
        let at = Vec3::from_slice(&point[..3]).as_dvec3();
        assert!(
            (sum - 1.0).abs() < 1e-6,
            "{point:?}: the taps' weights sum to {sum}, expected 1 within 1e-6"
        );
        assert!(
            (mean - at).largest() < 1e-4,
            "{point:?}: the taps' weighted mean is {mean}, expected {at} within 1e-4"
        );
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
        "#import lucerna::components::voxels::grid::{{VoxelGrid, face_axis, face_normal, faces_of_direction}}
        #import lucerna::components::voxels::bricks::BRICK
        #import lucerna::components::voxels::lookup::face_weights
        {GRID}
        struct Input {{ n: vec4<f32> }}
        struct Output {{ normals: array<vec4<f32>, 3>, weights: vec3<f32>, one: f32 }}
        fn map(in: Input) -> Output {{
            let faces = faces_of_direction(in.n.xyz);
            var out: Output;
            for (var axis = 0u; axis < 3u; axis++) {{
                out.normals[axis] = vec4<f32>(face_normal(faces[axis]), f32(face_axis(faces[axis])));
            }}
            out.weights = face_weights(6u, in.n.xyz);
            out.one = face_weights(1u, in.n.xyz).x;
            return out;
        }}"
    );
    for (normal, out) in normals.iter().zip(map::<_, [f32; 16]>(&wgsl, &normals)) {
        for axis in 0..3 {
            let mut expected = [0.0, 0.0, 0.0, axis as f32];
            expected[axis] = if normal[axis] < 0.0 { -1.0 } else { 1.0 };
            assert_eq!(
                out[4 * axis..4 * axis + 4],
                expected,
                "direction {normal:?}: normal of the face of axis {axis}, and the axis"
            );
            assert_eq!(
                out[12 + axis],
                normal[axis] * normal[axis],
                "direction {normal:?}: weight of the face of axis {axis}"
            );
        }
        assert_eq!(out[15], 1.0, "direction {normal:?}: weight of the only face");
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
    feedback: [f32; 3],
    depth: f32,
    new_depth: f32,
    light_rays: f32,
    max_rays: f32,
    n_rejected: f32,
}

const RENEW: &str = "#import lucerna::components::voxel_light::cache::{FaceLight, FaceSamples, renew, coverage, has_rejected, hit_depth}
    struct Input {
        direct: vec3<f32>, n_hits: f32, indirect: vec3<f32>, n_rays: f32,
        new_direct: vec3<f32>, new_hits: f32, new_indirect: vec3<f32>, new_rays: f32,
        feedback: vec3<f32>, depth: f32,
        new_depth: f32, light_rays: f32, max_rays: f32, n_rejected: f32,
    }
    struct Output {
        direct: vec3<f32>, n_hits: f32, indirect: vec3<f32>, n_rays: f32,
        feedback: vec3<f32>, depth: f32, coverage: f32, rejected: f32, a: f32, b: f32,
    }
    fn map(in: Input) -> Output {
        let before = FaceLight(in.direct, in.n_hits, in.indirect, in.n_rays, in.feedback,
            pack4x8unorm(vec4<f32>(in.depth, 0.0, 0.0, 0.0)));
        let samples = FaceSamples(in.new_direct, in.new_hits, in.new_indirect, in.new_rays, in.new_depth,
            u32(in.n_rejected));
        let after = renew(before, samples, in.light_rays, in.max_rays);
        return Output(after.direct, after.n_hits, after.indirect, after.n_rays, after.feedback, hit_depth(after),
            coverage(after), select(0.0, 1.0, has_rejected(after)), 0.0, 0.0);
    }";

/// A record is a convex mixture of old and new, against the formula in f64: the plain mean for direct
/// light, twice its share for the newest of indirect light, the newest alone for what bounces read.
/// Tolerances: 8 roundings of f32; half a step of 1/255 for depth.
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
                feedback: light.map(|x| 5.0 * x),
                // Fifths are exact in steps of 1/255.
                depth: 0.2 * (random.bits() % 6) as f32,
                new_depth: random.unit() * new_hits,
                light_rays: new_rays + [0.0, 16.0, 1e4][random.bits() as usize % 3],
                max_rays: [16.0, 256.0, 2048.0][random.bits() as usize % 3],
                n_rejected: (random.bits() % 2) as f32,
            }
        })
        .collect();
    inputs.push(Renewal { new_rays: 2.0, max_rays: 64.0, light_rays: 4.0, ..Zeroable::zeroed() });
    for (input, out) in inputs.iter().zip(map::<_, [f32; 16]>(RENEW, &inputs)) {
        let f = f64::from;
        let room = (f(input.max_rays) - f(input.new_rays)).max(0.0);
        let fade = if f(input.n_rays) > room { room / f(input.n_rays) } else { 1.0 };
        let rays = fade * f(input.n_rays) + f(input.new_rays);
        let hits = fade * f(input.n_hits) + f(input.new_hits);
        let within =
            |got: f32, want: f64, tolerance: f64| (f(got) - want).abs() <= tolerance * want.abs();
        assert!(
            within(out[3], hits, 5e-7) && within(out[7], rays, 5e-7),
            "{input:?}: hits and rays are {} and {}, expected {hits} and {rays} within 5e-7 of them",
            out[3],
            out[7]
        );
        assert!(
            f(out[7]) <= f(input.max_rays).max(f(input.new_rays)) * (1.0 + 5e-7),
            "{input:?}: rays are {}, expected at most the larger of {} and {}",
            out[7],
            input.max_rays,
            input.new_rays
        );
        let mean = |old: f32, new: f32| {
            if hits > 0.0 { (f(old) * fade * f(input.n_hits) + f(new)) / hits } else { 0.0 }
        };
        // The share of all rays that saw today's light, but never less than this frame's.
        let light_hits = (hits * (f(input.light_rays) / rays).min(1.0)).max(f(input.new_hits));
        let weight = f(input.new_hits) / light_hits;
        for (at, old, new, weight) in (0..3).flat_map(|k| {
            [
                (k, input.direct[k], input.new_direct[k], weight),
                (4 + k, input.indirect[k], input.new_indirect[k], (2.0 * weight).min(1.0)),
                (8 + k, input.feedback[k], input.new_indirect[k], 1.0),
            ]
        }) {
            let expected = if hits == 0.0 {
                0.0
            } else if input.new_hits == 0.0 {
                f(old)
            } else if input.n_hits == 0.0 || room == 0.0 {
                f(new) / f(input.new_hits)
            } else {
                (1.0 - weight) * f(old) + weight * f(new) / f(input.new_hits)
            };
            // Where little is left of the old light, its weight is a difference of like numbers.
            let slack = 5e-7 * (f(old).abs() + expected.abs());
            assert!(
                (f(out[at]) - expected).abs() <= slack,
                "{input:?}: number {at} (direct 0 to 2, indirect 4 to 6, feedback 8 to 10) is {}, expected {expected} within {slack:.1e}",
                out[at]
            );
        }
        let half_step = 0.5001 / 255.0;
        let depth = mean(input.depth, input.new_depth);
        assert!(
            (f(out[11]) - depth).abs() <= half_step,
            "{input:?}: depth is {}, expected {depth} within {half_step:.1e}",
            out[11]
        );
        assert!(
            within(out[12], hits / rays, 1e-6),
            "{input:?}: coverage is {}, expected {} within 1e-6 of it",
            out[12],
            hits / rays
        );
        assert_eq!(
            out[13],
            if hits > 0.0 { input.n_rejected } else { 0.0 },
            "{input:?}: whether samples are rejected"
        );
    }
}

const DEPOSIT: &str = "#import lucerna::components::voxel_light::cache::{FaceLight, add_deposit, hit_depth, has_rejected, keep_deposits, n_deposits}
    struct Input { means: array<vec4<f32>, 8>, frames: array<u32, 8> }
    struct Output { direct: vec3<f32>, n: u32, depth: f32, rejected: u32, kept: f32, n_kept: u32 }
    fn map(in: Input) -> Output {
        var light: FaceLight;
        light.direct = vec3<f32>(1e6);
        light.state = pack4x8unorm(vec4<f32>(0.2, 0.6, 0.0, 0.0)) | 0x80000000u | (5u << 16u);
        for (var k = 0u; k < 8u; k++) {
            light = add_deposit(light, in.means[k], in.frames[k]);
        }
        var other: FaceLight;
        other.direct = vec3<f32>(-1.0);
        let kept = keep_deposits(other, light);
        return Output(light.direct, n_deposits(light), hit_depth(light), select(0u, 1u, has_rejected(light)),
            kept.direct.x, n_deposits(kept));
    }";

#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
struct Deposits {
    means: [[f32; 4]; 8],
    frames: [u32; 8],
}

#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
struct Deposited {
    direct: [f32; 3],
    n: u32,
    depth: f32,
    rejected: u32,
    kept: f32,
    n_kept: u32,
}

/// Eight frames of deposits, the light changing before some of them: what is kept is the mean over the
/// frames since then in which something came, and darkness where nothing has. Depth and rejection, which
/// share a word with the count, stay. Tolerance: 8 steps of a running mean, 3 roundings each.
#[test]
fn deposits_are_averaged_since_the_light_changed() {
    let mut random = Random(9);
    let inputs: Vec<Deposits> =
        (0..2000)
            .map(|_| {
                let mut frames = 1;
                Deposits {
                    means: std::array::from_fn(|_| {
                        let n = (random.bits() % 3) as f32;
                        std::array::from_fn(|k| {
                            if k == 3 { n } else { 100.0 * random.unit() * n.min(1.0) }
                        })
                    }),
                    frames: std::array::from_fn(|_| {
                        frames = if random.bits().is_multiple_of(4) { 1 } else { frames + 1 };
                        frames
                    }),
                }
            })
            .collect();
    for (input, out) in inputs.iter().zip(map::<_, Deposited>(DEPOSIT, &inputs)) {
        let since = (0..8).rev().find(|&k| input.frames[k] == 1).unwrap_or(0);
        // The first frame may already be the second since a change: then what was there counts, five times.
        let came: Vec<_> = input.means[since..].iter().filter(|mean| mean[3] > 0.0).collect();
        let before = if input.frames[since] == 1 { 0 } else { 5.min(input.frames[since] - 1) };
        let n = came.len() as u32 + before;
        assert_eq!([out.n, out.n_kept], [n; 2], "{input:?}: number of deposits, and of kept ones");
        for k in 0..3 {
            let sum =
                came.iter().map(|mean| f64::from(mean[k])).sum::<f64>() + 1e6 * f64::from(before);
            let mean = sum / f64::from(n.max(1));
            assert!(
                (f64::from(out.direct[k]) - mean).abs() <= 24.0 * 6e-8 * mean.max(100.0),
                "{input:?}: direct light {k} is {}, expected {mean} within {:.1e}",
                out.direct[k],
                24.0 * 6e-8 * mean.max(100.0)
            );
        }
        // The depth is kept in steps of 1/255, and unpacked by a division: to 2.5 ulp on GPUs.
        assert!(
            (out.depth - 0.2).abs() <= 3.0 * f32::EPSILON * 0.2,
            "{input:?}: depth is {}, expected 0.2 within 3 units in the last place",
            out.depth
        );
        assert_eq!(
            (out.rejected, out.kept),
            (1, out.direct[0]),
            "{input:?}: whether samples are rejected, and the kept light"
        );
    }
}

#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
struct SideCase {
    /// In or near the cell.
    place: [f32; 3],
    bit: u32,
    normal: [f32; 3],
    reach: u32,
    /// On the border.
    through: [f32; 3],
    pad: u32,
    /// Which side is it on?
    at: [f32; 3],
    pad2: u32,
}

const SIDES: &str = "#import lucerna::components::voxel_light::sides::{NO_BORDER, NO_PLACE, border_normal, is_before_border, is_reached, pack_border, pack_place, reach_bit, reach_offset, unpack_place}
    struct Input { place: vec3<f32>, bit: u32, normal: vec3<f32>, reach: u32, through: vec3<f32>, pad: u32, at: vec3<f32>, pad2: u32 }
    struct Output { place: vec3<f32>, is_place: u32, normal: vec3<f32>, is_border: u32, offset: vec3<i32>, bit: u32, is_before: u32, without: u32, reached: u32, beyond: u32 }
    fn map(in: Input) -> Output {
        let place = pack_place(in.place);
        let border = pack_border(in.normal, in.through);
        let offset = reach_offset(in.bit);
        return Output(
            unpack_place(place), u32(place != NO_PLACE), border_normal(border), u32(border != NO_BORDER),
            offset, reach_bit(offset),
            u32(is_before_border(border, in.at)), u32(is_before_border(NO_BORDER, in.at)),
            u32(is_reached(in.reach, offset)), u32(is_reached(in.reach, 2 * offset)),
        );
    }";

/// Places, borders and neighbours in words: a place is within half of 1.25/1022 of a cell of what was packed (clamped to an
/// eighth beyond the cell); a point is in front of a border as it is of the plane, unless it is nearer than the rounding of the
/// normal (512 steps an axis: 0.5° over its distance) and of the offset (1/16 382 of 2.5 cells); the bits are those of the 27
/// cells around, x first.
#[test]
fn sides_fit_their_words() {
    let mut random = Random(5);
    let mut n_before = 0;
    let inputs: Vec<SideCase> = (0..20_000)
        .map(|ix| {
            let through: [f32; 3] = std::array::from_fn(|_| random.unit());
            SideCase {
                place: std::array::from_fn(|_| random.range(-0.2, 1.2)),
                bit: ix % 27,
                // Some along axes and diagonals, as walls are.
                normal: match ix % 5 {
                    0 => [[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, -1.0]][ix as usize / 5 % 3],
                    _ => random.direction().to_array(),
                },
                reach: random.bits() as u32 & 0x7ff_ffff,
                through,
                pad: 0,
                at: through.map(|x| x + random.range(-2.0, 2.0)),
                pad2: 0,
            }
        })
        .collect();
    #[derive(Clone, Copy, Debug, Pod, Zeroable)]
    #[repr(C)]
    struct Found {
        place: [f32; 3],
        is_place: u32,
        normal: [f32; 3],
        is_border: u32,
        offset: [i32; 3],
        bit: u32,
        is_before: u32,
        without: u32,
        reached: u32,
        beyond: u32,
    }
    for (input, out) in inputs.iter().zip(map::<_, Found>(SIDES, &inputs)) {
        let wanted = input.place.map(|x| x.clamp(-0.125, 1.125));
        let off = (Vec3::from(out.place) - Vec3::from(wanted)).abs().max_element();
        assert!(off < 0.63e-3, "{input:?}: the place is {:?}, expected {wanted:?}", out.place);
        assert_eq!((out.is_place, out.is_border), (1, 1), "{input:?}: words that are not empty");
        let (normal, through) = (Vec3::from(input.normal).as_dvec3(), Vec3::from(input.through));
        let turned = Vec3::from(out.normal).as_dvec3().angle_between(normal).to_degrees();
        assert!(turned < 0.5, "{input:?}: the border's normal is turned by {turned}°");
        let away = (Vec3::from(input.at) - through).as_dvec3();
        let distance = away.dot(normal);
        // Through the rounded normal, the plane turns around the cell's middle.
        let reach = 0.5f64.to_radians() * (away.length() + 1.0) + 1.6e-4;
        if distance.abs() > reach {
            n_before += out.is_before;
            assert_eq!(
                out.is_before == 1,
                distance > 0.0,
                "{input:?}: whether a point {distance} before the border is before it"
            );
        }
        assert_eq!(out.without, 1, "{input:?}: without a border all points are before it");
        let offset = [0, 1, 2].map(|axis| (input.bit / 3u32.pow(axis) % 3) as i32 - 1);
        assert_eq!((out.offset, out.bit), (offset, input.bit), "{input:?}: offset and bit");
        assert_eq!(out.reached, input.reach >> input.bit & 1, "{input:?}: whether it is reached");
        let is_middle = input.bit == 13;
        assert!(
            is_middle || out.beyond == 0,
            "{input:?}: a cell that is two away counts as reached"
        );
    }
    assert!(n_before > 5000, "{n_before} points are before their borders, expected above 5000");
}
