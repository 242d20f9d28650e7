// SPDX-License-Identifier: MIT OR Apache-2.0
//! What the voxels' kernels are made of: slots, faces' points, neighbours, gaps, opacities, and what a triangle adds.

use crate::harness::{Largest, Random, gpu, map};
use glam::{UVec4, Vec3, Vec4};
use lucerna::shader::Source;
use lucerna::testing::Harness;
use std::collections::BTreeSet;

/// Each occupied cell of a brick has the slot of its rank, others none: by counting, for random bricks, an empty and a full one.
#[test]
fn cells_have_the_slot_of_their_rank() {
    let mut random = Random(51);
    let mut bricks = vec![[0, 7], [u32::MAX, 0], [1, 5], [1 << 31, 5]];
    bricks.extend((0..200).map(|_| [random.bits() as u32, random.bits() as u32 >> 8]));
    let mut inputs = Vec::new();
    for &[bits, first] in &bricks {
        for bit in 0..32 {
            // Cells run x fastest in bricks of 4 × 4 × 2; the brick itself may stand anywhere.
            let brick = [8u32, 12, 6];
            let cell = [brick[0] + bit % 4, brick[1] + bit / 4 % 4, brick[2] + bit / 16];
            inputs.push([bits, first, 0, 0, cell[0], cell[1], cell[2], bit]);
        }
    }
    let found: Vec<[u32; 1]> = map(
        "#import lucerna::components::voxels::bricks::slot_in_brick
         struct Input { brick: vec4<u32>, cell: vec4<u32> }
         struct Output { slot: u32 }
         fn map(x: Input) -> Output { return Output(slot_in_brick(x.brick.xy, x.cell.xyz)); }",
        &inputs,
    );
    for (input, [found]) in inputs.iter().zip(found) {
        let [bits, first, .., bit] = *input;
        let rank = (0..bit).filter(|lower| bits >> lower & 1 == 1).count() as u32;
        let expected = if bits >> bit & 1 == 1 { first + rank } else { u32::MAX };
        assert_eq!(
            found, expected,
            "slot of bit {bit} of a brick of bits {bits:#x} and first slot {first}"
        );
    }
}

/// The point lies 1e-3 cells before its face, anywhere over it, and a ray against the normal comes out behind the opposite face after
/// 1.002 cells. Tolerance: 4 roundings of the coordinates.
#[test]
fn points_of_faces_lie_before_them() {
    let mut random = Random(52);
    let inputs: Vec<[f32; 8]> = (0..3000)
        .map(|ix| {
            let cell = std::array::from_fn::<f32, 3, _>(|_| (random.bits() % 1023) as f32);
            let u = if ix < 6 { [0.0, 0.0] } else { [random.unit(), random.unit()] };
            [cell[0], cell[1], cell[2], (ix % 6) as f32, u[0], u[1], random.unit(), 0.0]
        })
        .collect();
    let found: Vec<[f32; 4]> = map(
        "#import lucerna::components::voxel_light::face_point::{FACE_RAY_LENGTH, depth_below_face, face_point}
         struct Input { cell: vec4<f32>, u: vec4<f32> }
         alias Output = vec4<f32>;
         fn map(x: Input) -> Output {
             return vec4<f32>(face_point(x.cell.xyz, u32(x.cell.w), x.u.xy), depth_below_face(FACE_RAY_LENGTH * x.u.z));
         }",
        &inputs,
    );
    for (input, found) in inputs.iter().zip(found) {
        let face = input[3] as usize;
        let (axis, is_minus) = (face / 2, face % 2 == 1);
        let cell = &input[..3];
        let mut expected = [0.0f64; 3];
        expected[axis] = f64::from(cell[axis]) + if is_minus { -1e-3 } else { 1.001 };
        expected[(axis + 1) % 3] = f64::from(cell[(axis + 1) % 3]) + f64::from(input[4]);
        expected[(axis + 2) % 3] = f64::from(cell[(axis + 2) % 3]) + f64::from(input[5]);
        for k in 0..3 {
            assert!(
                (f64::from(found[k]) - expected[k]).abs() < 4.0 * 6e-8 * 1024.0,
                "cell {cell:?}, face {face}: the point is {:?}, expected {expected:?} within {:.1e} along axis {k}",
                &found[..3],
                4.0 * 6e-8 * 1024.0
            );
        }
        let depth = 1.002 * f64::from(input[6]) - 1e-3;
        assert!(
            (f64::from(found[3]) - depth).abs() < 4e-7,
            "depth below the face after {} of the ray is {}, expected {depth} within 4e-7",
            input[6],
            found[3]
        );
    }
}

/// Beside a face lie the 9 cells of its plane, around a voxel all 27, each once; weights are ½ for each axis along which a neighbour lies
/// off; a face with up to 64 hits takes all of its neighbours' light, one of n takes 64/n.
#[test]
fn neighbours_are_each_met_once() {
    let mut inputs = Vec::new();
    for axis in 0..3u32 {
        inputs.extend((0..9).map(|ix| UVec4::new(ix, axis, 0, 0)));
        inputs.extend((0..27).map(|ix| UVec4::new(ix, axis, 1, 0)));
    }
    let found: Vec<[f32; 8]> = map(
        "#import lucerna::components::voxel_light::neighbours::{n_neighbours, neighbour_offset, sharing_of_hits, tent}
         alias Input = vec4<u32>;
         struct Output { offset: vec3<f32>, weight: f32, n: f32, sharing: f32, pad: vec2<f32> }
         fn map(x: Input) -> Output {
             let offset = neighbour_offset(x.x, x.y, x.z == 1u);
             let sharing = sharing_of_hits(16.0 * f32(x.x));
             return Output(vec3<f32>(offset), tent(offset), f32(n_neighbours(x.z == 1u)), sharing, vec2<f32>(0.0));
         }",
        &inputs,
    );
    let mut met = BTreeSet::new();
    for (input, found) in inputs.iter().zip(found) {
        let offset = Vec3::from_slice(&found[..3]).as_ivec3();
        let what =
            format!("neighbour {} of axis {}, around a voxel: {}", input.x, input.y, input.z == 1);
        assert!(
            offset.abs().max_element() <= 1,
            "{what}: the offset is {offset}, expected −1 to 1"
        );
        assert!(
            input.z == 1 || offset[input.y as usize] == 0,
            "{what}: the offset is {offset}, expected 0 along the axis"
        );
        assert!(
            met.insert((input.y, input.z, offset.to_array())),
            "{what}: the offset {offset} comes twice"
        );
        let n_off = offset.to_array().iter().filter(|&&of| of != 0).count() as i32;
        assert_eq!(found[3], 0.5f32.powi(n_off), "{what}: weight of the offset {offset}");
        assert_eq!(found[4], if input.z == 1 { 27.0 } else { 9.0 }, "{what}: number of neighbours");
        let hits = 16.0 * input.x as f32;
        assert_eq!(
            found[5],
            if hits <= 64.0 { 1.0 } else { 64.0 / hits },
            "what a face of {hits} hits takes of its neighbours' light"
        );
    }
}

/// Pairs lie along the two other axes; a gap takes the mean of those pairs of which both have a surface.
#[test]
fn gaps_take_the_mean_of_whole_pairs() {
    let mut random = Random(53);
    let inputs: Vec<[Vec4; 5]> = (0..600)
        .map(|ix| {
            let mut texel = |bit: u32| {
                let a = if ix >> bit & 1 == 1 { random.range(0.1, 3.0) } else { 0.0 };
                Vec4::new(random.unit(), random.unit(), random.unit(), a)
            };
            let texels = [texel(0), texel(1), texel(2), texel(3)];
            [texels[0], texels[1], texels[2], texels[3], Vec4::splat((ix % 6) as f32)]
        })
        .collect();
    let found: Vec<[Vec4; 2]> = map(
        "#import lucerna::components::voxel_pyramid::gaps::{GapPairs, add_gap_pair, gap_step, texel_of_gap}
         struct Input { texels: array<vec4<f32>, 4>, face: vec4<f32> }
         struct Output { texel: vec4<f32>, axes: vec4<f32> }
         fn map(x: Input) -> Output {
             var pairs: GapPairs;
             pairs = add_gap_pair(pairs, x.texels[0], x.texels[1]);
             pairs = add_gap_pair(pairs, x.texels[2], x.texels[3]);
             let axis = vec3<f32>(0.0, 1.0, 2.0);
             let one = vec3<f32>(gap_step(u32(x.face.x), 0u));
             let other = vec3<f32>(gap_step(u32(x.face.x), 1u));
             return Output(texel_of_gap(pairs), vec4<f32>(dot(axis, one), dot(axis, other), length(one), length(other)));
         }",
        &inputs,
    );
    for (input, [texel, axes]) in inputs.iter().zip(found) {
        let whole: Vec<_> =
            input[..4].chunks(2).filter(|pair| pair.iter().all(|t| t.w > 0.0)).collect();
        let sum: Vec4 = whole.iter().flat_map(|pair| pair.iter()).sum();
        let expected = sum / (2 * whole.len().max(1)) as f32;
        assert!(
            (texel - expected).largest() < 1e-6,
            "pairs {:?}, {:?}: the gap's texel is {texel}, expected {expected} within 1e-6",
            &input[..2],
            &input[2..4]
        );
        let own = (input[4].x / 2.0).floor();
        let others = BTreeSet::from([axes.x as u32, axes.y as u32, own as u32]);
        assert_eq!(
            (others.len(), axes.z, axes.w),
            (3, 1.0, 1.0),
            "face {}: different axes of the face and its pairs, and lengths of the pairs' steps: {axes}",
            input[4].x
        );
    }
}

/// Of six faces: an axis that shows one takes part in a corner, one that shows two or none keeps its coverage. Closed is a corner in which every
/// face covers, to 80 %, what the others leave open of it.
#[test]
fn faces_are_closed_in_corners_alone() {
    let mut random = Random(54);
    let mut inputs: Vec<[f32; 12]> = (0..20_000)
        .map(|_| {
            let mut depth = [-1.0f32; 6];
            let mut coverage = [0.0f32; 6];
            for face in 0..6 {
                coverage[face] = random.unit();
                if random.unit() < 0.4 {
                    depth[face] = random.unit();
                }
            }
            if random.unit() < 0.5 {
                // Made to fit: each covers just what is open of it.
                let open = |axis: usize| {
                    let shown = depth[2 * axis].max(depth[2 * axis + 1]);
                    if shown < 0.0 { 1.0 } else { shown.max(0.05) }
                };
                let open = [open(0), open(1), open(2)];
                for (face, coverage) in coverage.iter_mut().enumerate() {
                    let axis = face / 2;
                    *coverage =
                        random.range(0.85, 1.2) * open[(axis + 1) % 3] * open[(axis + 2) % 3];
                }
            }
            std::array::from_fn(|k| if k < 6 { coverage[k] } else { depth[k - 6] })
        })
        .collect();
    inputs.push([0.0; 12]);
    let found: Vec<[f32; 6]> = map(
        "#import lucerna::components::voxel_pyramid::opacity::opacity_of_faces
         struct Input { coverage: array<f32, 6>, depth: array<f32, 6> }
         struct Output { opacity: array<f32, 6> }
         fn map(x: Input) -> Output { return Output(opacity_of_faces(x.coverage, x.depth)); }",
        &inputs,
    );
    let mut n_closed = 0;
    'cases: for (input, found) in inputs.iter().zip(found) {
        let (coverage, depth) = input.split_at(6);
        // Which face an axis shows, alone.
        let shown: [Option<usize>; 3] = std::array::from_fn(|axis| {
            let faces: Vec<_> =
                (2 * axis..2 * axis + 2).filter(|&face| depth[face] >= 0.0).collect();
            if faces.len() == 1 { Some(faces[0]) } else { None }
        });
        let open = shown.map(|face| face.map_or(1.0, |face| f64::from(depth[face]).max(0.05)));
        let mut fits = shown.iter().flatten().count() >= 2;
        for axis in 0..3 {
            let Some(face) = shown[axis] else { continue };
            let ratio =
                f64::from(coverage[face].max(1e-6)) / (open[(axis + 1) % 3] * open[(axis + 2) % 3]);
            // At the borders of what fits, either answer is right.
            if (ratio - 0.8).abs() < 1e-5 || (ratio - 1.25).abs() < 1e-5 {
                continue 'cases;
            }
            fits &= (0.8..=1.25).contains(&ratio);
        }
        n_closed += usize::from(fits);
        for face in 0..6 {
            let axis = face / 2;
            let mut expected = f64::from(coverage[face]);
            if shown[axis] == Some(face) {
                expected = expected.max(1e-6);
                if fits {
                    expected = (expected / (open[(axis + 1) % 3] * open[(axis + 2) % 3])).min(1.0);
                }
            }
            assert!(
                (f64::from(found[face]) - expected).abs() < 1e-5,
                "coverage {coverage:?}, depth {depth:?}: opacity of face {face} is {}, expected {expected} within 1e-5",
                found[face]
            );
        }
    }
    assert!(n_closed > 1000, "{n_closed} corners are closed, expected above 1000");
}

/// Bilinear weights of four texels sum to 1 and weigh their places to the point.
#[test]
fn bilinear_weights_find_the_point() {
    let mut random = Random(55);
    let mut inputs: Vec<Vec4> =
        (0..2000).map(|_| Vec4::new(random.unit(), random.unit(), 0.0, 0.0)).collect();
    inputs.extend([Vec4::ZERO, Vec4::new(1.0, 0.0, 0.0, 0.0), Vec4::new(0.5, 0.5, 0.0, 0.0)]);
    let found: Vec<Vec4> = map(
        "#import lucerna::frame::upscale::bilinear_weight
         alias Input = vec4<f32>;
         alias Output = vec4<f32>;
         fn map(x: Input) -> Output {
             var out: vec4<f32>;
             for (var ix = 0u; ix < 4u; ix++) {
                 out[ix] = bilinear_weight(vec2<u32>(ix & 1u, ix >> 1u), x.xy);
             }
             return out;
         }",
        &inputs,
    );
    for (input, w) in inputs.iter().zip(found) {
        let sums = [w.element_sum() - 1.0, w.y + w.w - input.x, w.z + w.w - input.y];
        assert!(
            w.min_element() >= 0.0 && sums.iter().all(|of| of.abs() < 3e-7),
            "point {input}: the weights {w} are off a sum of 1 and the point by {sums:?}, expected at least 0 and below 3e-7"
        );
    }
}

/// Projected areas in units of 2⁻¹⁸, at least one unit along the axes where the normal is longest, and the area itself without axes: in f64, to the
/// nearest unit or, at a half, either.
#[test]
fn parts_weigh_by_their_area() {
    let mut random = Random(56);
    let mut inputs: Vec<[Vec4; 2]> = (0..5000)
        .map(|_| {
            let normal = random.direction();
            let area = 10f32.powf(random.range(-8.0, 0.0));
            [(normal * area).extend(0.0), normal.extend(0.0)]
        })
        .collect();
    inputs.extend([[Vec4::ZERO, Vec4::X], [Vec4::new(0.0, -1.0, 0.0, 0.0), -Vec4::Y]]);
    let diagonal = Vec3::ONE.normalize().extend(0.0);
    inputs.push([Vec4::ZERO, Vec4::new(diagonal.x, diagonal.x, diagonal.x, 0.0)]);
    let found: Vec<UVec4> = map(
        "#import lucerna::components::voxels::attributes::{weight_of_part, weights_of_part}
         struct Input { area: vec4<f32>, normal: vec4<f32> }
         alias Output = vec4<u32>;
         fn map(x: Input) -> Output {
             return vec4<u32>(weights_of_part(x.area.xyz, x.normal.xyz), weight_of_part(x.area.xyz));
         }",
        &inputs,
    );
    for ([area, normal], found) in inputs.iter().zip(&found) {
        let near = |found: u32, area: f64, least: f64| {
            let expected = (area * 262144.0).min(524287.0);
            (f64::from(found) - expected.max(least)).abs()
                <= 0.5 + expected * 4e-7 + f64::from(least > 0.0) * 0.5
        };
        let longest = normal.largest();
        for axis in 0..3 {
            let is_longest = normal[axis].abs() == longest;
            assert!(
                near(found[axis], f64::from(area[axis].abs()), f64::from(is_longest)),
                "area {area}, normal {normal}: weights are {found}, expected {} units along axis {axis}, at least 1 where the normal is longest, {is_longest}",
                area[axis].abs() * 262_144.0
            );
            assert!(
                !is_longest || found[axis] >= 1,
                "area {area}, normal {normal}: weights are {found}, expected at least 1 along the longest axis {axis}"
            );
        }
        let length = area.truncate().as_dvec3().length();
        assert!(
            near(found.w, length, 1.0) && found.w >= 1,
            "area {area}: the weight without axes is {}, expected {} units, at least 1",
            found.w,
            length * 262_144.0
        );
    }
    assert_eq!(
        found[5000..],
        [UVec4::new(1, 0, 0, 1), UVec4::new(0, 262144, 0, 262144), UVec4::ONE],
        "weights of no area, of one square along −Y, and of no area across the diagonal"
    );
}

/// The 64-bit numbers that a surface adds are its weight times its values in steps; in u128, to the half step that rounding may take.
#[test]
fn surfaces_add_their_weighted_steps() {
    let mut random = Random(57);
    let mut inputs: Vec<[f32; 12]> = (0..5000)
        .map(|_| {
            let weight = (random.bits() % 524_288) as f32;
            let normal = random.direction();
            let brightest = 10f32.powf(random.range(-3.0, 5.0));
            let mut unit = || random.unit();
            let emission = [unit() * brightest, unit() * brightest, unit() * brightest];
            let albedo = [unit(), unit(), unit()];
            [
                albedo[0],
                albedo[1],
                albedo[2],
                weight,
                normal.x,
                normal.y,
                normal.z,
                brightest,
                emission[0],
                emission[1],
                emission[2],
                0.0,
            ]
        })
        .collect();
    inputs.push([1.0, 1.0, 1.0, 524_287.0, 1.0, -1.0, 0.0, 7.0, 7.0, 7.0, 7.0, 0.0]);
    inputs.push([0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 0.0, 0.0, 5.0, 0.0, 0.0, 0.0]);
    let found: Vec<[[u32; 2]; 10]> = map(
        "#import lucerna::components::voxels::attributes::{N_SURFACE_SUMS, sums_of_surface}
         struct Input { albedo: vec3<f32>, weight: f32, normal: vec3<f32>, brightest: f32, emission: vec3<f32>, pad: f32 }
         struct Output { sums: array<vec2<u32>, N_SURFACE_SUMS> }
         fn map(x: Input) -> Output {
             return Output(sums_of_surface(u32(x.weight), x.albedo, x.normal, x.emission, x.brightest));
         }",
        &inputs,
    );
    for (input, found) in inputs.iter().zip(found) {
        let sum = |k: usize| f64::from(found[k][1]) * 4294967296.0 + f64::from(found[k][0]);
        let weight = f64::from(input[3]);
        assert_eq!(sum(0), weight, "{input:?}: sum of weights");
        for k in 0..3 {
            let shine =
                if input[7] > 0.0 { f64::from(input[8 + k]) / f64::from(input[7]) } else { 0.0 };
            let exact = [
                ("albedo", sum(1 + k), f64::from(input[k]) * 4095.0),
                ("normal", sum(4 + k), (f64::from(input[4 + k]) + 1.0) * 2047.0),
                ("emission", sum(7 + k), shine * 262143.0),
            ];
            for (what, found, steps) in exact {
                let bound = weight * (0.5 + steps * 3e-7);
                assert!(
                    (found - weight * steps).abs() <= bound,
                    "{input:?}: the sum of {what} {k} is {found}, expected {weight} × {steps} within {bound:.1e}"
                );
                // Whole steps of the weight.
                assert_eq!(
                    found % weight.max(1.0),
                    0.0,
                    "{input:?}: what the sum of {what} {k}, {found}, is beside whole steps of the weight {weight}"
                );
            }
        }
    }
}

/// lucerna's modules with some replaced, as a renderer does that keeps its light otherwise.
fn with_modules(modules: &[(&str, &str)]) -> Harness {
    let mut library = lucerna::library();
    for &(path, text) in modules {
        assert!(library.get(path).is_some(), "{path} replaces nothing");
        library.insert(Source {
            import_path: path.to_owned(),
            file: "stranger.wgsl".into(),
            text: format!("#define_import_path {path}\n{text}").into(),
        });
    }
    // No other storage is asked for anything.
    let asks = |path: &str| {
        let source = library.get(path).unwrap();
        library.dependencies(source).unwrap().iter().map(|of| of.import_path.to_string()).collect()
    };
    for path in ["lucerna::fields::voxel_light", "lucerna::fields::cone_trace"] {
        let all: Vec<String> = asks(path);
        let replaced = |of: &str| modules.iter().any(|(path, _)| *path == of);
        if modules.iter().any(|(path, _)| all.iter().any(|of| of == path)) {
            let left = all.iter().filter(|of| of.contains("::fields::") && !replaced(of));
            assert_eq!(
                left.count(),
                0,
                "{path}: modules of a storage that it still asks, of {all:?}"
            );
        }
    }
    Harness::new(gpu().clone()).with_library(library)
}

/// `fields::voxel_light` over light that a stranger keeps, here a formula: one replaced module, no bindings. A linear function comes back as it is, half
/// a cell along the normal or, trilinear, at the point. Tolerance: 50 roundings of values up to 60.
#[test]
fn light_is_looked_up_in_a_strangers_storage() {
    let stranger = "#import lucerna::components::voxels::levels::{VoxelLevel, VoxelLevels}
        const NO_VOXEL: u32 = 0xffffffffu;
        var<private> levels: VoxelLevels;
        fn voxel_of_cell(level: VoxelLevel, cell: vec3<i32>) -> u32 {
            if any(cell < vec3<i32>(0)) || any(cell >= vec3<i32>(level.grid.size)) {
                return NO_VOXEL;
            }
            return u32(cell.x) | (u32(cell.y) << 8u) | (u32(cell.z) << 16u);
        }
        fn reach_of_face(level: VoxelLevel, voxel: u32, face: u32, point: vec3<f32>) -> u32 {
            return 0u;
        }
        fn light_of_face(level: VoxelLevel, voxel: u32, face: u32, point: vec3<f32>) -> vec4<f32> {
            let center = vec3<f32>((vec3<u32>(voxel) >> vec3<u32>(0u, 8u, 16u)) & vec3<u32>(255u)) + 0.5;
            return vec4<f32>(dot(center, vec3<f32>(1.0, 2.0, 3.0)), center.x, 1.0, 1.0);
        }";
    let harness = with_modules(&[("lucerna::fields::voxel_light_texels", stranger)]);
    let mut random = Random(58);
    let inputs: Vec<[Vec4; 2]> = (0..4000)
        .map(|ix| {
            let at = Vec3::from_array(std::array::from_fn(|_| random.range(2.0, 8.0)));
            [(at * 0.5 - 1.0).extend((ix % 2) as f32), random.direction().extend(0.0)]
        })
        .collect();
    let found: Vec<Vec4> = harness.map(
        "#import lucerna::fields::voxel_light::{LOOKUP_TRILINEAR, LOOKUP_VALID, irradiance_at}
         #import lucerna::fields::voxel_light_texels::levels
         #import lucerna::components::voxels::grid::VoxelGrid
         struct Input { position: vec4<f32>, normal: vec4<f32> }
         alias Output = vec4<f32>;
         fn map(x: Input) -> Output {
             levels.n_levels = 1u;
             levels.levels[0].grid = VoxelGrid(vec3<f32>(-1.0), 0.5, vec3<u32>(10u), 6u, vec3<u32>(3u, 3u, 5u), 0u);
             let lookup = select(LOOKUP_VALID, LOOKUP_TRILINEAR, x.position.w == 1.0);
             return vec4<f32>(irradiance_at(x.position.xyz, x.normal.xyz, lookup), 0.0);
         }",
        &inputs,
    );
    for ([position, normal], found) in inputs.iter().zip(found) {
        let mut at = (position.truncate().as_dvec3() + 1.0) / 0.5;
        if position.w == 0.0 {
            at += 0.5 * normal.truncate().as_dvec3();
        }
        let expected = [at.x + 2.0 * at.y + 3.0 * at.z, at.x, 1.0];
        for k in 0..3 {
            let error = (f64::from(found[k]) - expected[k]).abs();
            assert!(
                error < 50.0 * 6e-8 * 60.0,
                "position {position} (w 1: trilinear), normal {normal}: light is {found}, expected {expected:?} within {:.1e}",
                50.0 * 6e-8 * 60.0
            );
        }
    }
}

/// `fields::cone_trace` over voxels that a stranger keeps, here a uniform medium without bindings: light and transmittance are those of its depth.
/// Tolerance: some hundred roundings, one for each step.
#[test]
fn cones_are_followed_through_a_strangers_storage() {
    let layout = "#import lucerna::components::voxel_pyramid::layout::PyramidLayout
        var<private> pyramid: PyramidLayout;
        fn finest_cell(position: vec3<f32>) -> f32 {
            return pyramid.levels[0].cell;
        }";
    // A texel is a cell's depth and light, so both grow with the mip's cells: 0.3 a metre, of radiance (2, 1, 0.5).
    let texels =
        "fn filtered_texel(entry: u32, mip: u32, face: u32, point: vec3<f32>) -> vec4<f32> {
            let depth = 0.3 * 0.25 * f32(1u << mip);
            return depth * vec4<f32>(2.0, 1.0, 0.5, 1.0);
        }";
    let harness = with_modules(&[
        ("lucerna::fields::pyramid_layout", layout),
        ("lucerna::fields::voxel_pyramid", texels),
    ]);
    let mut random = Random(59);
    let inputs: Vec<[Vec4; 2]> = (0..500)
        .map(|_| {
            [random.direction().extend(random.range(0.5, 6.0)), Vec4::splat(random.range(0.0, 0.5))]
        })
        .collect();
    let found: Vec<[Vec4; 2]> = harness.map(
        "#import lucerna::fields::cone_trace::trace_cone
         #import lucerna::fields::pyramid_layout::pyramid
         #import lucerna::components::voxel_pyramid::layout::PyramidLevel
         #import lucerna::cone::march::{Cone, ConeSettings}
         struct Input { ray: vec4<f32>, spread: vec4<f32> }
         struct Output { light: vec4<f32>, near: vec4<f32> }
         fn map(x: Input) -> Output {
             pyramid.n_levels = 1u;
             pyramid.n_faces = 1u;
             pyramid.levels[0] = PyramidLevel(vec3<f32>(-8.0), 0.25, vec3<u32>(64u), 7u);
             let cone = Cone(vec3<f32>(0.0), x.spread.x, x.ray.xyz, x.ray.w, vec3<f32>(0.0), 0.0);
             let found = trace_cone(cone, ConeSettings(0.5, 0.0, 1.0, 0.0), 0.0);
             return Output(vec4<f32>(found.radiance, found.transmittance), vec4<f32>(f32(found.n_steps)));
         }",
        &inputs,
    );
    for ([ray, spread], [light, steps]) in inputs.iter().zip(found) {
        let transmittance = (-0.3 * f64::from(ray.w)).exp();
        let expected = [2.0, 1.0, 0.5].map(|of| of * (1.0 - transmittance));
        assert!(
            (f64::from(light.w) - transmittance).abs() < 2e-5,
            "cone along {ray} of spread {}: transmittance is {}, expected {transmittance} within 2e-5",
            spread.x,
            light.w
        );
        for k in 0..3 {
            assert!(
                (f64::from(light[k]) - expected[k]).abs() < 4e-5,
                "cone along {ray} of spread {}: light is {}, expected {expected:?} within 4e-5",
                spread.x,
                light.truncate()
            );
        }
        assert!(
            steps.x >= 2.0,
            "cone along {ray} of spread {}: {} steps, expected at least 2",
            spread.x,
            steps.x
        );
    }
}
