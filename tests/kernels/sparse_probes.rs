// SPDX-License-Identifier: MIT OR Apache-2.0
//! Kernels of sparse probes, against f64.

use crate::harness::{Random, Tolerance, assert_near, gpu, map, read, storage, submit};
use crate::probes::{lambert, room, upload, world};
use crate::sh::all_y;
use glam::{DVec3, Vec2, Vec3};
use half::f16;
use lucerna::gpu::{ComputeKernel, Dispatch, Shaders};
use lucerna::gpu_scene::GpuScene;
use lucerna::scene::{Light, Mesh, Scene, Sky};
use lucerna::seam::SceneSeam;
use std::f64::consts::PI;

const SEEN_SKY: u32 = u32::MAX;
const SEEN_UNKNOWN: u32 = u32::MAX - 1;

/// w(0) = 1, w(½) = ½, w(1) = 0 and 0 beyond, and 2t³ − 3t² + 1 in between. Tolerance: some roundings of numbers below 3.
#[test]
fn support_falls_off_smoothly() {
    let mut random = Random(3);
    let mut inputs = vec![[0.0f32, 2.0], [1.0, 2.0], [2.0, 2.0], [5.0, 2.0], [0.0, 1e-3]];
    inputs.extend((0..500).map(|_| [4.0 * random.unit(), 0.1 + 3.0 * random.unit()]));
    let found: Vec<f32> = map(
        "#import lucerna::components::sparse_probes::support::support_weight
         alias Input = vec2<f32>;
         alias Output = f32;
         fn map(x: Input) -> Output { return support_weight(x.x, x.y); }",
        &inputs,
    );
    let expected = |[distance, radius]: [f32; 2]| {
        let t = (f64::from(distance) / f64::from(radius)).min(1.0);
        2.0 * t.powi(3) - 3.0 * t.powi(2) + 1.0
    };
    assert_near("support", &inputs, &found, Tolerance::absolute(1e-6), |x| expected(*x));
}

/// 1/(t² + 0.01): 100 where the probe is, 1/1.01 at the radius. Tolerance: some roundings.
#[test]
fn near_points_are_resolved_better() {
    let mut random = Random(5);
    let mut inputs = vec![[0.0f32, 2.0], [2.0, 2.0], [1e4, 1.0]];
    inputs.extend((0..500).map(|_| [4.0 * random.unit(), 0.1 + 3.0 * random.unit()]));
    let found: Vec<f32> = map(
        "#import lucerna::components::sparse_probes::support::resolution_weight
         alias Input = vec2<f32>;
         alias Output = f32;
         fn map(x: Input) -> Output { return resolution_weight(x.x, x.y); }",
        &inputs,
    );
    let expected = |[distance, radius]: [f32; 2]| {
        1.0 / ((f64::from(distance) / f64::from(radius)).powi(2) + 0.01)
    };
    assert_near("resolution", &inputs, &found, Tolerance::relative(1e-5), |x| expected(*x));
}

/// Bands up to one are those of all bands, and the others are 0.
#[test]
fn few_bands_are_those_of_all() {
    let mut random = Random(4);
    let inputs: Vec<[f32; 4]> = (0..400)
        .map(|ix| {
            let d = random.direction();
            [d.x, d.y, d.z, (ix % 8) as f32]
        })
        .collect();
    let found: Vec<[f32; 64]> = map(
        "#import lucerna::sh::basis::sh_basis_to
         alias Input = vec4<f32>;
         alias Output = array<f32, 64>;
         fn map(x: Input) -> Output { return sh_basis_to(x.xyz, u32(x.w)); }",
        &inputs,
    );
    for (input, found) in inputs.iter().zip(found) {
        let d = Vec3::from_slice(input).as_dvec3();
        let n = (input[3] as usize + 1).pow(2);
        for (k, expected) in all_y(64, d).into_iter().enumerate() {
            let expected = if k < n { expected } else { 0.0 };
            let apart = (f64::from(found[k]) - expected).abs();
            // (As for `sh_basis`: 1e-6 of the band's greatest value, which is 1.1 in band 7.)
            assert!(apart < 2e-6, "function {k} of {n} at {d}: {}, expected {expected}", found[k]);
        }
    }
}

/// Texels of the sky's mask and directions in them belong together, and every direction is within a texel's width of its texel's centre.
#[test]
fn masks_of_the_sky_cover_all_directions() {
    let mut random = Random(5);
    let mut inputs: Vec<Vec3> = (0..4000).map(|_| random.direction()).collect();
    inputs.extend(Vec3::AXES);
    inputs.extend(Vec3::AXES.map(|axis| -axis));
    let inputs: Vec<[f32; 4]> = inputs.iter().map(|d| d.extend(0.0).to_array()).collect();
    let found: Vec<[f32; 4]> = map(
        "#import lucerna::components::sparse_probes::sky_mask::{sky_mask_direction, sky_mask_texel}
         alias Input = vec4<f32>;
         alias Output = vec4<f32>;
         fn map(x: Input) -> Output {
             let texel = sky_mask_texel(x.xyz);
             return vec4<f32>(sky_mask_direction(texel), f32(texel));
         }",
        &inputs,
    );
    for (input, found) in inputs.iter().zip(found) {
        assert!((0.0..16384.0).contains(&found[3]), "{input:?}: texel {}", found[3]);
        let cosine = Vec3::from_slice(input).dot(Vec3::from_slice(&found));
        // (Half a texel along both axes is (1, 1, 2)/128 on the octahedron, whose faces are 1/√3 away: √6·√3/128.)
        assert!(cosine > 0.0332f32.cos(), "{input:?} is {} off its texel's centre", cosine.acos());
    }
}

/// The field's look-up: places by weights, texels by places, receivers by sides; triangles without a place have none.
#[test]
fn receivers_are_found_in_their_texels() {
    let size = [4u32, 3];
    let corners = [[[0.25f32, 0.25], [3.75, 0.5], [0.5, 2.75]], [[0.0; 2]; 3]];
    let mut words: Vec<u32> =
        corners.as_flattened().as_flattened().iter().map(|x| x.to_bits()).collect();
    // Receiver numbers that tell their texel and side; one texel without.
    let receiver = |side: u32, texel: u32| if texel == 5 { u32::MAX } else { 100 * side + texel };
    words.extend((0..2).flat_map(|side| (0..12).map(move |texel| receiver(side, texel))));
    // Through texel 1 of the front goes a wall: of its places, only the left half is on its side, and of its neighbours only the left one. (The byte of
    // neighbours begins with the upper left one, and leaves out the texel itself.)
    let reach =
        |side: u32, texel: u32| if (side, texel) == (0, 1) { 0x3333 | 1 << 19 } else { 0xff_ffff };
    words.extend((0..2).flat_map(|side| (0..12).map(move |texel| reach(side, texel))));
    let buffer = storage(bytemuck::cast_slice(&words));
    let info = crate::harness::uniform(bytemuck::cast_slice(&[size[0], size[1], 2, 24]));
    let mut random = Random(6);
    let inputs: Vec<[f32; 4]> = (0..600)
        .map(|ix| {
            let (u, v) = (random.unit(), random.unit());
            let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
            [(ix % 3) as f32, u, v, (ix / 3 % 2) as f32]
        })
        .collect();
    let text = "#import lucerna::fields::lightmap::{lightmap_place, receiver_at}
         alias Input = vec4<f32>;
         alias Output = vec4<f32>;
         fn map(x: Input) -> Output {
             let place = lightmap_place(u32(x.x), x.yz);
             let found = receiver_at(u32(x.x), x.yz, u32(x.w));
             return vec4<f32>(place, select(f32(found), -1.0, found == 0xffffffffu), 1.0);
         }";
    let found: Vec<[f32; 4]> = map_field(text, &inputs, &info, &buffer);
    let mut n_beyond = 0;
    for (input, found) in inputs.iter().zip(found) {
        let (triangle, side) = (input[0] as usize, input[3] as u32);
        if triangle > 0 {
            // (One that has no place, and one that is not there.)
            assert!(found[0] < 0.0 && found[2] == -1.0, "{input:?}: {found:?}, expected nothing");
            continue;
        }
        let [a, b, c] = corners[0].map(Vec2::from);
        let place = a + input[1] * (b - a) + input[2] * (c - a);
        let texel = place.floor();
        let mut expected = receiver(side, (texel.y * 4.0 + texel.x) as u32);
        if (side, texel) == (0, Vec2::X) && place.x >= 1.5 {
            // The nearest of the texels beyond the wall: the right one, the one below and to the right, or the one below, which has none.
            n_beyond += 1;
            let below = [receiver(0, 4), receiver(0, 6)];
            let near =
                [(2u32, Vec2::new(2.5, 0.5)), (4, Vec2::new(0.5, 1.5)), (6, Vec2::new(2.5, 1.5))];
            let distance = |at: Vec2| at.distance(place);
            let found = near.iter().min_by(|a, b| distance(a.1).total_cmp(&distance(b.1))).unwrap();
            expected = if found.0 == 2 { receiver(0, 2) } else { below[usize::from(found.0 == 6)] };
        }
        let expected = if expected == u32::MAX { -1.0 } else { expected as f32 };
        assert!(
            (Vec2::new(found[0], found[1]) - place).length() < 1e-5,
            "{input:?}: place {found:?}, expected {place}"
        );
        // (On a border, rounding decides.)
        let is_inside = (place - place.round()).abs().min_element() > 1e-5;
        assert!(
            !is_inside || found[2] == expected,
            "{input:?}: receiver {}, expected {expected}",
            found[2]
        );
    }
    assert!(n_beyond > 5, "{n_beyond} points beyond the wall");
}

/// Runs a map whose function asks a field (group 3). `resources`: the field's bindings, by their numbers there.
fn map_of_field(
    field: &str,
    text: &str,
    inputs: &[[f32; 4]],
    resources: &[(u32, &lucerna::wgpu::Buffer)],
) -> Vec<[f32; 4]> {
    // The harness binds group 0 alone: the field's variables are put there.
    let mut library = lucerna::library();
    let mut module = library.get(field).unwrap().clone();
    let mut entries = Vec::new();
    for (place, (binding, buffer)) in (2u32..).zip(resources) {
        let [from, to] =
            [format!("@group(3) @binding({binding})"), format!("@group(0) @binding({place})")];
        assert!(module.text.contains(&from), "{field} has no binding {binding}");
        module.text = module.text.replace(&from, &to).into();
        let resource = buffer.as_entire_binding();
        entries.push(lucerna::wgpu::BindGroupEntry { binding: place, resource });
    }
    library.insert(module);
    lucerna::testing::Harness::new(gpu().clone())
        .with_library(library)
        .map_with(text, inputs, &entries)
}

/// Runs a map whose function asks the field `lightmap`.
fn map_field(
    text: &str,
    inputs: &[[f32; 4]],
    info: &lucerna::wgpu::Buffer,
    words: &lucerna::wgpu::Buffer,
) -> Vec<[f32; 4]> {
    map_of_field("lucerna::fields::lightmap", text, inputs, &[(40, info), (41, words)])
}

/// A scene of one large square far below, with a lamp, for kernels that take a scene's group.
fn open_floor(height: f32, sky: Vec3) -> (Scene, GpuScene) {
    let s = 400.0;
    let floor = Mesh {
        positions: vec![
            Vec3::new(-s, height, -s),
            Vec3::new(-s, height, s),
            Vec3::new(s, height, s),
            Vec3::new(s, height, -s),
        ],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        ..Mesh::default()
    };
    let mut scene = world(vec![floor], vec![lambert(0.5)]);
    scene.sky = Sky::Constant(sky);
    let on_gpu = upload(&scene);
    (scene, on_gpu)
}

fn bytes<T: bytemuck::NoUninit>(of: &[T]) -> lucerna::wgpu::Buffer {
    storage(bytemuck::cast_slice(of))
}

fn floats(buffer: &lucerna::wgpu::Buffer) -> Vec<[f32; 4]> {
    bytemuck::pod_collect_to_vec(&read(buffer))
}

/// What `sparse_probes/directions` finds for a number of directions and an order.
fn basis_of(n_directions: u32, order: u32) -> Vec<f32> {
    let n = n_directions * (order + 1) * (order + 1);
    let basis = bytes(&vec![f32::NAN; n as usize]);
    let kernel = ComputeKernel::new(gpu(), &Shaders::default(), None, "sparse_probes/directions");
    submit(|recorder| {
        kernel
            .call(&mut recorder.compute("directions"))
            .uniform("info", &[n_directions, order, 0, 0])
            .bind("basis", &basis)
            .dispatch(Dispatch::Items(n_directions));
    });
    bytemuck::pod_collect_to_vec(&read(&basis))
}

/// Basis functions are as good as orthonormal over the directions in which probes look: the sum of products is 1 or 0. (1024 points of
/// Hammersley's set: a product of functions of order 2 is off by less than 0.2 %, one of order 7, which waves seven times as fast, by less than 2 %.) 4π/N is their weight.
#[test]
fn probes_look_everywhere() {
    for (order, limit) in [(2u32, 2e-3), (7, 2e-2)] {
        let n = ((order + 1) * (order + 1)) as usize;
        let basis = basis_of(1024, order);
        let weight = 4.0 * PI / 1024.0;
        for i in 0..n {
            for j in 0..n {
                let sum: f64 = basis
                    .chunks_exact(n)
                    .map(|row| f64::from(row[i]) * f64::from(row[j]) / weight)
                    .sum();
                let expected = if i == j { 1.0 } else { 0.0 };
                assert!(
                    (sum - expected).abs() < limit,
                    "order {order}: functions {i} and {j} give {sum}, expected {expected}"
                );
            }
        }
    }
}

/// λ is the sum of what probes see times the basis, for any number of coefficients; the sky counts only if asked for, what is not known never; and only
/// those probes change whose turn it is. Tolerance: 2⁻²⁴ for each of N terms' sum of magnitudes.
#[test]
fn probes_project_what_they_see() {
    let sky = Vec3::new(0.3, 0.2, 0.1);
    let (_, scene) = open_floor(-1.0, sky);
    let kernel =
        ComputeKernel::new(gpu(), scene.shaders(), Some(scene.group()), "sparse_probes/project");
    let mut random = Random(8);
    let (n_probes, n_directions, n_receivers) = (5u32, 192u32, 40u32);
    let seen: Vec<u32> = (0..n_probes * n_directions)
        .map(|_| match random.bits() % 9 {
            0 => SEEN_SKY,
            1 => SEEN_UNKNOWN,
            other => (other as u32 * 7 + random.bits() as u32 % 5) % n_receivers,
        })
        .collect();
    let radiance: Vec<[f32; 4]> = (0..n_receivers)
        .map(|_| [random.unit(), 3.0 * random.unit(), random.unit(), f32::NAN])
        .collect();
    for (order, has_sky, first, step) in [
        (0u32, 0u32, 0u32, 1u32),
        (1, 1, 0, 1),
        (2, 0, 1, 2),
        (4, 1, 0, 1),
        (5, 0, 0, 3),
        (7, 1, 0, 1),
    ] {
        let n = (order + 1) * (order + 1);
        let basis = basis_of(n_directions, order);
        let lambda = bytes(&vec![[-1.0f32; 4]; (n_probes * n) as usize]);
        submit(|recorder| {
            kernel
                .call(&mut recorder.compute("project"))
                .scene(scene.group())
                .uniform("info", &[n_probes, n_directions, n, has_sky, first, step, 0, 0])
                .bind("seen", &bytes(&seen))
                .bind("basis", &bytes(&basis))
                .bind("radiance", &bytes(&radiance))
                .bind("lambda", &lambda)
                .dispatch(Dispatch::Rows(n_probes.div_ceil(step)));
        });
        for (ix, found) in floats(&lambda).into_iter().enumerate() {
            let (probe, j) = (ix as u32 / n, ix % n as usize);
            if probe < first || (probe - first) % step != 0 {
                assert_eq!(found, [-1.0; 4], "probe {probe} was not to change");
                continue;
            }
            let (mut sum, mut size) = (DVec3::ZERO, DVec3::ZERO);
            for k in 0..n_directions {
                let light = match seen[(probe * n_directions + k) as usize] {
                    SEEN_SKY if has_sky == 1 => sky,
                    SEEN_SKY | SEEN_UNKNOWN => Vec3::ZERO,
                    receiver => Vec3::from_slice(&radiance[receiver as usize]),
                };
                let term = light.as_dvec3() * f64::from(basis[k as usize * n as usize + j]);
                sum += term;
                size += term.abs();
            }
            let apart = (Vec3::from_slice(&found).as_dvec3() - sum).abs();
            let limit = size * f64::from(n_directions) * 2f64.powi(-24) + 1e-12;
            assert!(
                apart.cmple(limit).all(),
                "order {order}, probe {probe}, coefficient {j}: {found:?}, expected {sum}"
            );
        }
    }
}

/// Two halfs as a word, and the numbers that they are.
fn halfs(two: [f32; 2]) -> u32 {
    let [low, high] = two.map(|x| u32::from(f16::from_f32(x).to_bits()));
    low | high << 16
}

fn half(x: f32) -> f64 {
    f16::from_f32(x).to_f64()
}

/// Numbers of a row in whole words, as they are stored, and as f64 reads them: two halfs a word, or four bytes.
fn stored(row: &[f32], is_bytes: bool) -> (Vec<u32>, Vec<f64>) {
    if !is_bytes {
        let words = row.chunks(2).map(|two| halfs([two[0], *two.get(1).unwrap_or(&0.0)]));
        return (words.collect(), row.iter().map(|x| half(*x)).collect());
    }
    let bytes: Vec<i8> = row.iter().map(|x| (x * 127.0) as i8).collect();
    let word = |four: &[i8]| {
        four.iter().enumerate().map(|(k, x)| u32::from(*x as u8) << (8 * k)).sum::<u32>()
    };
    (bytes.chunks(4).map(word).collect(), bytes.iter().map(|x| f64::from(*x) / 127.0).collect())
}

/// l = (Σ_c Vᵀ) λ and I = U_c l, for clusters of any size, with few or many vectors and probes, an odd number of columns, and none; with halfs and bytes; for
/// one output and for several. Irradiance below 0 is 0, other outputs are what they are. The texels of the lightmap have them times the scale. Tolerance: a
/// rounding for each term.
#[test]
fn clusters_give_receivers_their_light() {
    let mut random = Random(9);
    let mut number = move || random.unit() * 2.0 - 1.0;
    for (n_coefficients, n_basis, is_bytes, n_outputs) in [
        (1u32, 3u32, false, 1u32),
        (9, 32, false, 1),
        (25, 64, false, 3),
        (64, 128, false, 1),
        (9, 33, false, 2),
        (1, 3, true, 1),
        (9, 33, true, 1),
        (64, 128, true, 2),
        (25, 62, true, 1),
    ] {
        let n_probes = 12u32;
        let lambda: Vec<[f32; 4]> = (0..n_probes * n_coefficients)
            .map(|_| [number(), number(), number(), f32::NAN])
            .collect();
        // Receivers, probes, vectors of each cluster.
        let shapes: [(u32, Vec<u32>, u32); 4] = [
            (1, vec![3], n_basis.min(1)),
            (64, vec![], 0),
            (130, vec![0, 5, 11], n_basis),
            (63, (0..n_probes).collect(), n_basis.min(31)),
        ];
        let (mut clusters, mut probes, mut projection, mut reconstruction): (
            Vec<[u32; 8]>,
            Vec<u32>,
            Vec<u32>,
            Vec<u32>,
        ) = Default::default();
        let (mut blocks, mut receivers): (Vec<[u32; 2]>, Vec<[u32; 4]>) = Default::default();
        let n_all: u32 = shapes.iter().map(|(n, ..)| n).sum();
        let mut expected = vec![(DVec3::ZERO, 0.0); (n_all * n_outputs) as usize];
        for (ix, (n_receivers, own, n_vectors)) in (0u32..).zip(&shapes) {
            let n_columns = own.len() * n_coefficients as usize;
            clusters.push([
                receivers.len() as u32,
                *n_receivers,
                probes.len() as u32,
                own.len() as u32,
                projection.len() as u32,
                *n_vectors,
                reconstruction.len() as u32,
                0,
            ]);
            probes.extend(own);
            let mut rows: Vec<Vec<f64>> = Vec::new();
            for _ in 0..*n_vectors {
                let row: Vec<f32> = (0..n_columns).map(|_| number()).collect();
                let (words, mut numbers) = stored(&row, is_bytes);
                if is_bytes {
                    let scale = 2.0 + number();
                    projection.push(scale.to_bits());
                    numbers.iter_mut().for_each(|x| *x *= f64::from(scale));
                }
                projection.extend(words);
                rows.push(numbers);
            }
            let light: Vec<(DVec3, f64)> = rows
                .iter()
                .map(|row| {
                    row.iter().enumerate().fold((DVec3::ZERO, 0.0), |(sum, size), (k, x)| {
                        let probe = own[k / n_coefficients as usize];
                        let at = (probe * n_coefficients) as usize + k % n_coefficients as usize;
                        let term = *x * Vec3::from_slice(&lambda[at]).as_dvec3();
                        (sum + term, size + term.abs().max_element())
                    })
                })
                .collect();
            let n_blocks = n_receivers.div_ceil(64);
            blocks.extend((0..n_blocks * n_outputs).map(|block| [ix, block]));
            let first = receivers.len();
            for output in 0..n_outputs as usize {
                // (Of each receiver, its vectors' numbers in words.)
                let known: Vec<(Vec<u32>, Vec<f64>)> = (0..*n_receivers)
                    .map(|_| {
                        let row: Vec<f32> = (0..*n_vectors).map(|_| number()).collect();
                        stored(&row, is_bytes)
                    })
                    .collect();
                let n_words = n_vectors.div_ceil(if is_bytes { 4 } else { 2 }) as usize;
                for block in 0..n_blocks as usize {
                    for word in 0..n_words {
                        reconstruction.extend((0..64).map(|lane| {
                            known.get(block * 64 + lane).map_or(0, |(words, _)| words[word])
                        }));
                    }
                }
                for (own, (_, numbers)) in known.iter().enumerate() {
                    expected[output * n_all as usize + first + own] = numbers
                        .iter()
                        .zip(&light)
                        .fold((DVec3::ZERO, 0.0), |(sum, size), (u, l)| {
                            (sum + *u * l.0, size + u.abs() * l.1)
                        });
                }
            }
            for n in first as u32..first as u32 + n_receivers {
                receivers.push([0, 0, (n % 32) | ((n / 32) << 16), ix % 2]);
            }
        }
        let n_clusters = clusters.len() as u32;
        let cluster_light = bytes(&vec![[f32::NAN; 4]; (n_clusters * n_basis) as usize]);
        let irradiance = bytes(&vec![[-7.0f32; 4]; expected.len()]);
        let of = |name| ComputeKernel::new(gpu(), &Shaders::default(), None, name);
        let (gather, receive) = (of("sparse_probes/gather"), of("sparse_probes/receive"));
        let clusters = bytes(&clusters);
        // (Bindings are never empty.)
        let probes = bytes(&[probes, vec![0]].concat());
        let target = lightmap_texture([32, 16], 2 * n_outputs);
        let numbers = u32::from(is_bytes);
        let info: [u32; 8] =
            [blocks.len() as u32, n_basis, 8.0f32.to_bits(), numbers, n_all, 0, 0, 0];
        submit(|recorder| {
            gather
                .call(&mut recorder.compute("gather"))
                .uniform("info", &[n_clusters, n_coefficients, n_basis, numbers])
                .bind("clusters", &clusters)
                .bind("cluster_probes", &probes)
                .bind("projection", &bytes(&[projection, vec![0]].concat()))
                .bind("lambda", &bytes(&lambda))
                .bind("cluster_light", &cluster_light)
                .dispatch(Dispatch::Rows(n_clusters));
            receive
                .call(&mut recorder.compute("receive"))
                .uniform("info", &info)
                .bind("clusters", &clusters)
                .bind("blocks", &bytes(&blocks))
                .bind("reconstruction", &bytes(&[reconstruction, vec![0]].concat()))
                .bind("cluster_light", &cluster_light)
                .bind("receivers", &bytes(&receivers))
                .bind("irradiance", &irradiance)
                .bind("lightmap_out", &target)
                .dispatch(Dispatch::Rows(blocks.len() as u32));
        });
        let texels = texels_of(&target, [32, 16], 2 * n_outputs);
        for (ix, (found, (sum, size))) in floats(&irradiance).into_iter().zip(&expected).enumerate()
        {
            let (output, ix) = (ix / n_all as usize, ix % n_all as usize);
            let sum = if output == 0 { sum.max(DVec3::ZERO) } else { *sum };
            let limit = 1e-6 * (n_coefficients * n_probes).max(8) as f64 * size + 1e-12;
            let apart = (Vec3::from_slice(&found).as_dvec3() - sum).abs().max_element();
            assert!(
                apart <= limit,
                "{n_coefficients} coefficients, {n_basis} numbers, bytes: {is_bytes}, output {output} of receiver {ix}: {found:?}, expected {sum}"
            );
            assert_eq!(found[3], 1.0, "receiver {ix} is known");
            let layer = 2 * output + receivers[ix][3] as usize;
            let texel = texels[layer][ix];
            let expected = Vec3::from_slice(&found) * 8.0;
            // (Halfs: 2⁻¹⁰ of the number, whichever way the device rounds.)
            let apart = (Vec3::from_slice(&texel) - expected).abs();
            assert!(
                apart.cmple(expected.abs() * 1e-3 + 1e-6).all(),
                "texel {ix} of layer {layer}: {texel:?}, expected {expected}"
            );
        }
    }
}

fn lightmap_texture([width, height]: [u32; 2], n_layers: u32) -> lucerna::wgpu::TextureView {
    use lucerna::wgpu;
    let texture = gpu().device.create_texture(&wgpu::TextureDescriptor {
        label: None,
        size: wgpu::Extent3d { width, height, depth_or_array_layers: n_layers },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: wgpu::TextureFormat::Rgba16Float,
        usage: wgpu::TextureUsages::STORAGE_BINDING | wgpu::TextureUsages::COPY_SRC,
        view_formats: &[],
    });
    texture.create_view(&wgpu::TextureViewDescriptor {
        dimension: Some(wgpu::TextureViewDimension::D2Array),
        ..Default::default()
    })
}

/// The texels of each layer, row by row. Rows have 32 texels at least, as copies need.
fn texels_of(
    view: &lucerna::wgpu::TextureView,
    [width, height]: [u32; 2],
    n_layers: u32,
) -> Vec<Vec<[f32; 4]>> {
    use lucerna::wgpu;
    assert_eq!(width % 32, 0, "rows of 256 bytes");
    let layer_bytes = u64::from(8 * width * height);
    let buffer = gpu().device.create_buffer(&wgpu::BufferDescriptor {
        label: None,
        size: u64::from(n_layers) * layer_bytes,
        usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::COPY_SRC,
        mapped_at_creation: false,
    });
    let mut encoder = gpu().device.create_command_encoder(&Default::default());
    encoder.copy_texture_to_buffer(
        view.texture().as_image_copy(),
        wgpu::TexelCopyBufferInfo {
            buffer: &buffer,
            layout: wgpu::TexelCopyBufferLayout {
                offset: 0,
                bytes_per_row: Some(8 * width),
                rows_per_image: Some(height),
            },
        },
        wgpu::Extent3d { width, height, depth_or_array_layers: n_layers },
    );
    gpu().queue.submit([encoder.finish()]);
    let all: Vec<[u16; 4]> = bytemuck::pod_collect_to_vec(&read(&buffer));
    all.chunks((width * height) as usize)
        .map(|layer| {
            layer.iter().map(|texel| texel.map(|bits| f16::from_bits(bits).to_f32())).collect()
        })
        .collect()
}

/// A texel without a receiver gets the mean of those of its eight neighbours that have one, on its own side; one without such neighbours stays, and so do
/// those with receivers. Borders of the lightmap have fewer neighbours.
#[test]
fn empty_texels_get_the_mean_of_their_neighbours() {
    let size = [32u32, 5];
    let mut random = Random(10);
    let n = (size[0] * size[1]) as usize;
    let mut light: Vec<[f32; 4]> = Vec::new();
    let mut words: Vec<u32> = Vec::new();
    for _ in 0..2 * n {
        let is_there = random.bits().is_multiple_of(5);
        words.push(if is_there { light.len() as u32 } else { u32::MAX });
        if is_there {
            light.push([random.unit(), random.unit(), 9.0 * random.unit(), 1.0]);
        }
    }
    // (A second output, of any sign.)
    let n_receivers = light.len();
    for ix in 0..n_receivers {
        let [x, y, z, known] = light[ix];
        light.push([1.0 - 2.0 * x, -y, z * y, known]);
    }
    let target = lightmap_texture(size, 4);
    let kernel = ComputeKernel::new(gpu(), &Shaders::default(), None, "sparse_probes/dilate");
    let info =
        crate::harness::uniform(bytemuck::cast_slice(&[size[0], size[1], 0, n_receivers as u32]));
    submit(|recorder| {
        kernel
            .call(&mut recorder.compute("dilate"))
            .uniform("info", &[4.0f32, 0.0, 0.0, 0.0])
            .bind("irradiance", &bytes(&light))
            .bind("lightmap_out", &target)
            .bind("lightmap", &info)
            .bind("lightmap_words", &bytes(&words))
            .dispatch(Dispatch::Box(glam::UVec3::new(size[0], size[1], 4)));
    });
    for (layer, texels) in texels_of(&target, size, 4).iter().enumerate() {
        let (output, side) = (layer / 2, layer % 2);
        let at = |x: i32, y: i32| {
            let inside = x >= 0 && y >= 0 && x < size[0] as i32 && y < size[1] as i32;
            let word = inside.then(|| words[side * n + (y * size[0] as i32 + x) as usize]);
            word.filter(|ix| *ix != u32::MAX)
        };
        for (ix, found) in texels.iter().enumerate() {
            let (x, y) = ((ix as u32 % size[0]) as i32, (ix as u32 / size[0]) as i32);
            let near: Vec<DVec3> = (0..9)
                .filter(|k| *k != 4)
                .filter_map(|k| at(x + k % 3 - 1, y + k / 3 - 1))
                .map(|of| Vec3::from_slice(&light[output * n_receivers + of as usize]).as_dvec3())
                .collect();
            let expected = if at(x, y).is_some() || near.is_empty() {
                [0.0; 4]
            } else {
                let mean = near.iter().sum::<DVec3>() / near.len() as f64 * 4.0;
                [mean.x, mean.y, mean.z, 1.0]
            };
            for k in 0..4 {
                let apart = (f64::from(found[k]) - expected[k]).abs();
                assert!(
                    apart <= 1e-3 * expected[k].abs() + 1e-6,
                    "output {output}, side {side}, texel {x}, {y}: {found:?}, expected {expected:?}"
                );
            }
        }
    }
}

/// Words of a receiver on a triangle, as `lit` has them; weights of its points' second and third corners, in 1/8.
fn lit(triangle: u32, side: u32, points: [[u32; 2]; 4]) -> [u32; 16] {
    let points = points.map(|of| {
        let [b, c] = of.map(|eighths| eighths * 65535 / 8);
        [triangle, b | c << 16]
    });
    let mut out = [0; 16];
    out[3] = side;
    out[8..].copy_from_slice(points.as_flattened());
    out
}

/// A point light over a floor: albedo·I·cosθ/d², nothing on its other side; at the first point in the first frame, as a mean of all four after four, and after
/// eight. Then the sky: the mean over frames of E = πL. The indirect light of the frame before is reflected as well, if asked for.
#[test]
fn receivers_are_lit_and_reflect() {
    let (mut scene, _) = open_floor(0.0, Vec3::ZERO);
    let lamp = Vec3::new(3.0, 7.0, -2.0);
    let intensity = Vec3::new(50.0, 20.0, 10.0);
    scene.lights.push(Light::Point { position: lamp, intensity, range: None });
    let with_lamp = upload(&scene);
    let (_, with_sky) = open_floor(0.0, Vec3::new(0.5, 0.25, 2.0));
    let points = [[2, 3], [5, 2], [1, 6], [0, 0]];
    let receivers = [lit(0, 0, points), lit(1, 0, points), lit(0, 1, points)];
    let run = |scene: &GpuScene, n_frames: u32| -> Vec<[f32; 16]> {
        let kernel =
            ComputeKernel::new(gpu(), scene.shaders(), Some(scene.group()), "sparse_probes/light");
        let buffer = bytes(&receivers);
        for frame in 0..n_frames {
            let info = [3, frame, frame, 77, 0.1f32.to_bits(), 0, 0, 0];
            submit(|recorder| {
                kernel
                    .call(&mut recorder.compute("light"))
                    .scene(scene.group())
                    .uniform("info", &info)
                    .bind("lit", &buffer)
                    .dispatch(Dispatch::Items(3));
            });
        }
        bytemuck::pod_collect_to_vec(&read(&buffer))
    };
    for n_frames in [1, 4, 8] {
        let found = run(&with_lamp, n_frames);
        for ix in 0..3 {
            let [a, b, c] = with_lamp_corners(&with_lamp, &scene, receivers[ix][8]);
            let at_point = |of: &[u32; 2]| {
                let [u, v] = of.map(|eighths| f64::from(eighths) / 8.0);
                let to_lamp = lamp.as_dvec3() - (a + u * (b - a) + v * (c - a));
                let cosine = to_lamp.normalize().y;
                0.5 * intensity.as_dvec3() * cosine / to_lamp.length_squared()
            };
            let lit = &points[..if n_frames == 1 { 1 } else { 4 }];
            let mean = lit.iter().map(at_point).sum::<DVec3>() / lit.len() as f64;
            let expected = if ix == 2 { DVec3::ZERO } else { mean };
            let light = Vec3::from_slice(&found[ix]).as_dvec3();
            // (Points are rounded to 1/65535 of a triangle of 800 m: 1 cm of distances of 100 m and more.)
            assert!(
                (light - expected).abs().max_element() <= 1e-3 * expected.max_element() + 1e-12,
                "receiver {ix}, {n_frames} frames: {light}, expected {expected}"
            );
            assert!((found[ix][4] - 0.5).abs() < 1e-6, "albedo {}", found[ix][4]);
        }
    }
    // 64 frames of four samples each by the sky's density: a uniform sky is sampled with a density 1/4π, and the cosine's relative deviation is 0.6 there;
    // five standard deviations of 256 are 0.3 or so; half of the samples are below the floor.
    let found = run(&with_sky, 256);
    for (ix, of) in found[..2].iter().enumerate() {
        let expected = 0.5 * PI * DVec3::new(0.5, 0.25, 2.0);
        let light = Vec3::from_slice(of).as_dvec3();
        // (σ of 1024 samples: E·√(4π·2π/3/π² − 1)/√1024 = 0.04 E.)
        assert!(
            ((light - expected) / expected).abs().max_element() < 0.2,
            "receiver {ix}: {light}, expected {expected}"
        );
    }
    let reflect = ComputeKernel::new(gpu(), &Shaders::default(), None, "sparse_probes/reflect");
    let of = |bounces: u32| {
        let radiance = bytes(&[[f32::NAN; 4]; 3]);
        submit(|recorder| {
            reflect
                .call(&mut recorder.compute("reflect"))
                .uniform("info", &[3, bounces, 0, 0])
                .bind("lit", &bytes(&found))
                .bind("irradiance", &bytes(&[[1.0f32, 2.0, 3.0, 1.0]; 3]))
                .bind("radiance", &radiance)
                .dispatch(Dispatch::Items(3));
        });
        floats(&radiance)
    };
    for bounces in 0..2 {
        for (ix, reflected) in of(bounces).iter().enumerate() {
            let indirect = DVec3::new(1.0, 2.0, 3.0) * f64::from(bounces);
            let lights = Vec3::from_slice(&found[ix]).as_dvec3();
            let expected = (lights + indirect * f64::from(found[ix][4])) / PI;
            let apart = (Vec3::from_slice(reflected).as_dvec3() - expected).abs().max_element();
            assert!(
                apart < 1e-6 * expected.max_element() + 1e-9,
                "receiver {ix}: {reflected:?}, expected {expected}"
            );
        }
    }
}

/// Corners of a triangle as kernels count them.
fn with_lamp_corners(on_gpu: &GpuScene, scene: &Scene, triangle: u32) -> [DVec3; 3] {
    let all = lucerna::gpu_scene::WorldTriangles::of(scene);
    all.positions[on_gpu.triangle_order()[triangle as usize] as usize]
        .map(|corner| corner.as_dvec3())
}

/// A room from 0 to `size` that is open above.
fn without_ceiling(size: Vec3) -> Mesh {
    let mut walls = room(Vec3::ZERO, size);
    walls.triangles.retain(|t| !t.iter().all(|ix| walls.positions[*ix as usize].y == size.y));
    walls
}

/// A triangle of a room's floor, which side of it is up, and the point at a third of both of its edges.
fn place_on_floor(on_gpu: &GpuScene, scene: &Scene) -> (u32, u32, DVec3) {
    let triangle = (0..on_gpu.n_triangles())
        .find(|ix| with_lamp_corners(on_gpu, scene, *ix).iter().all(|c| c.y == 0.0))
        .unwrap();
    let [a, b, c] = with_lamp_corners(on_gpu, scene, triangle);
    let share = f64::from(65535u32 / 3) / 65535.0;
    let side = u32::from((b - a).cross(c - a).y < 0.0);
    (triangle, side, a + share * (b - a) + share * (c - a))
}

/// Which probes see a place, by bits and by masks of the sky: in a room with an open ceiling, walls hide what is behind them, and the side decides.
#[test]
fn probes_see_what_nothing_hides() {
    let scene = world(vec![without_ceiling(Vec3::new(4.0, 2.0, 3.0))], vec![lambert(0.5)]);
    let on_gpu = upload(&scene);
    let mut random = Random(11);
    let places: Vec<Vec3> = (0..70)
        .map(|_| {
            Vec3::new(random.range(-3.0, 7.0), random.range(-1.0, 5.0), random.range(-3.0, 6.0))
        })
        .collect();
    let corners = |ix: u32| with_lamp_corners(&on_gpu, &scene, ix);
    let n = on_gpu.n_triangles();
    let receivers: Vec<[u32; 4]> =
        (0..2 * n).map(|ix| [ix / 2, (65535 / 3) | (65535 / 3) << 16, 0, ix % 2]).collect();
    let n_each = (places.len() as u32).div_ceil(32);
    let n_words = n_each * receivers.len() as u32;
    let n_masks = 512 * places.len() as u32;
    let sight = bytes(&vec![0xdead_beefu32; (n_words + n_masks) as usize]);
    let of = |name| ComputeKernel::new(gpu(), on_gpu.shaders(), Some(on_gpu.group()), name);
    let (bits, mask) = (of("sparse_probes/sight"), of("sparse_probes/sky_mask"));
    let at: Vec<[f32; 4]> = places.iter().map(|p| p.extend(0.0).to_array()).collect();
    submit(|recorder| {
        bits.call(&mut recorder.compute("sight"))
            .scene(on_gpu.group())
            .uniform("info", &[0, n_words, places.len() as u32, n_each])
            .bind("receivers", &bytes(&receivers))
            .bind("places", &bytes(&at))
            .bind("sight", &sight)
            .dispatch(Dispatch::Items(n_words));
        mask.call(&mut recorder.compute("mask"))
            .scene(on_gpu.group())
            .uniform("info", &[places.len() as u32, n_words, 0, 0])
            .bind("places", &bytes(&at))
            .bind("sight", &sight)
            .dispatch(Dispatch::Items(n_masks));
    });
    let words: Vec<u32> = bytemuck::pod_collect_to_vec(&read(&sight));
    let triangles: Vec<[DVec3; 3]> = (0..n).map(corners).collect();
    // Möller and Trumbore's test in f64; None: too near to an edge to tell.
    let hits = |origin: DVec3, direction: DVec3, most: f64, own: Option<usize>| -> Option<bool> {
        let mut is_hit = false;
        for (ix, [a, b, c]) in triangles.iter().enumerate() {
            if own == Some(ix) {
                continue;
            }
            let (e, f) = (*b - *a, *c - *a);
            let p = direction.cross(f);
            let det = e.dot(p);
            if det.abs() < 1e-12 {
                continue;
            }
            let s = origin - *a;
            let u = s.dot(p) / det;
            let v = direction.dot(s.cross(e)) / det;
            let t = f.dot(s.cross(e)) / det;
            let inside = u.min(v).min(1.0 - u - v);
            if inside.abs() < 1e-4 && t > -1e-4 && t < most + 1e-4 {
                return None;
            }
            is_hit |= inside > 0.0 && t > 0.0 && t < most;
        }
        Some(is_hit)
    };
    let (mut n_told, mut n_seen) = (0, 0);
    for (ix, receiver) in receivers.iter().enumerate() {
        let [a, b, c] = triangles[receiver[0] as usize];
        let third = f64::from(65535u32 / 3) / 65535.0;
        let point = a + third * (b - a) + third * (c - a);
        let normal = (b - a).cross(c - a).normalize() * if receiver[3] == 0 { 1.0 } else { -1.0 };
        for (probe, place) in places.iter().enumerate() {
            let to_probe = place.as_dvec3() - point;
            let hidden = hits(point, to_probe, 1.0, Some(receiver[0] as usize));
            let Some(hidden) = hidden.filter(|_| to_probe.dot(normal).abs() > 1e-4) else {
                continue;
            };
            let expected = to_probe.dot(normal) > 0.0 && !hidden;
            let found = words[ix * n_each as usize + probe / 32] >> (probe % 32) & 1 == 1;
            assert_eq!(found, expected, "receiver {receiver:?} at {point}, probe at {place}");
            n_told += 1;
            n_seen += u32::from(found);
        }
    }
    assert!(n_told > 1000 && n_seen > 200, "{n_told} pairs, {n_seen} of which see each other");
    // The masks: in the directions of their texels' centres, by the unfolded octahedron.
    let direction_of = |texel: u32| {
        let at = |k: u32| (f64::from(k) + 0.5) / 64.0 - 1.0;
        let (x, y) = (at(texel % 128), at(texel / 128));
        let z = 1.0 - x.abs() - y.abs();
        let fold = (-z).max(0.0);
        DVec3::new(x - fold * x.signum(), y - fold * y.signum(), z).normalize()
    };
    let mut n_sky = 0;
    for (probe, place) in places.iter().enumerate().step_by(9) {
        for texel in (0..128 * 128).step_by(37) {
            let Some(hit) = hits(place.as_dvec3(), direction_of(texel), f64::MAX, None) else {
                continue;
            };
            let word = words[(n_words + 512 * probe as u32 + texel / 32) as usize];
            assert_eq!(word >> (texel % 32) & 1 == 0, hit, "probe at {place}, texel {texel}");
            n_sky += u32::from(!hit);
        }
    }
    assert!(n_sky > 300, "{n_sky} directions to the sky");
}

/// Transport in a closed box, against a quadrature in f64 that meets the box's planes itself: α_ij = ∫ w_i Y_j(φ_i)/Σ w cosθ dω, seen in the corrected
/// direction φ_i from each probe, where nearer probes count more; with all of order 7, and few bands; and α_ijk, with Y_k instead of the cosine. Then what must hold exactly: a receiver whose samples are all seen gets E = πL of
/// constant radiance. Tolerance: five standard deviations of the samples, as if they were independent (they are better).
#[test]
fn transport_equals_a_quadrature() {
    let size = DVec3::new(4.0, 2.0, 3.0);
    let scene = world(vec![room(Vec3::ZERO, size.as_vec3())], vec![lambert(0.5)]);
    let on_gpu = upload(&scene);
    let probes = [
        (Vec3::new(1.0, 1.4, 0.7), 0.75f32),
        (Vec3::new(3.1, 0.5, 2.2), 0.2),
        (Vec3::new(2.0, 1.0, 1.5), 0.4),
    ];
    let (triangle, side, from) = place_on_floor(&on_gpu, &scene);
    let kernel = ComputeKernel::new(
        gpu(),
        on_gpu.shaders(),
        Some(on_gpu.group()),
        "sparse_probes/transport",
    );
    let n_triangles = on_gpu.n_triangles();
    let field = crate::harness::uniform(bytemuck::cast_slice(&[1u32, 1, n_triangles, 0]));
    let no_places = bytes(&vec![0u32; 6 * n_triangles as usize + 2]);
    const SAMPLES: u32 = 4096;
    const RADIUS: f32 = 1.5;
    for (order, radiance) in [(0u32, None), (2, None), (7, None), (2, Some(1u32)), (4, Some(4))] {
        let n = (order + 1) * (order + 1);
        let n_radiance = radiance.map_or(0, |of| (of + 1) * (of + 1));
        let n_columns = 3 * n;
        let stride = n_columns * (1 + n_radiance) + 3 + n_radiance;
        let third = 65535 / 3;
        let mut job: Vec<[u32; 4]> = vec![
            [0, 1, side, 5],
            [0, 3, RADIUS.to_bits(), 0],
            [triangle, third | third << 16, 0, 0],
        ];
        for (ix, (at, weight)) in (0u32..).zip(&probes) {
            let [x, y, z] = at.to_array().map(f32::to_bits);
            job.extend([[x, y, z, weight.to_bits()], [ix, ix * n, 0, 0]]);
        }
        let sums = bytes(&vec![0.0f32; stride as usize]);
        for first in (0..SAMPLES).step_by(64) {
            // (In two steps where there is more than one output.)
            for [output, outputs] in [[0, 1], [1, n_radiance]] {
                // By rays; no bits are asked for.
                let info = [1, first, 1, 3, order, stride, 1, 1, 0, 2, 3, 0];
                let info = [info.as_slice(), &[n_radiance, output, outputs, 0]].concat();
                let info: [u32; 16] = info.try_into().unwrap();
                submit(|recorder| {
                    kernel
                        .call(&mut recorder.compute("transport"))
                        .scene(on_gpu.group())
                        .uniform("info", &info)
                        .bind("job", &bytes(&job))
                        .bind("sight", &bytes(&[0u32; 4]))
                        .bind("sums", &sums)
                        .bind("lightmap", &field)
                        .bind("lightmap_words", &no_places)
                        .dispatch(Dispatch::Rows(u32::from(outputs > 0)));
                });
            }
        }
        let sums: Vec<f32> = bytemuck::pod_collect_to_vec(&read(&sums));
        let tail = (stride - 3 - n_radiance) as usize;
        assert_eq!(sums[tail + 1..tail + 3], [SAMPLES as f32; 2], "samples that are seen, and all");
        let weights = f64::from(sums[tail]);
        // The functions of the radiance at the normal, straight up.
        for (k, y) in all_y(n_radiance as usize, DVec3::Y).into_iter().enumerate() {
            let mean = f64::from(sums[tail + 3 + k]) / f64::from(SAMPLES);
            assert!((mean - y).abs() < 1e-5, "function {k} at the normal: {mean}, expected {y}");
        }
        // Mean and mean square of the integrand over the samples' directions: cosine-distributed; with radiance, half of them uniform.
        let mut expected = vec![[0.0f64; 2]; tail];
        const SIDE: usize = 160;
        let kinds = if radiance.is_some() { 2 } else { 1 };
        for k in 0..kinds * SIDE * SIDE {
            let u = (k % SIDE) as f64 + 0.5;
            let v = (k / SIDE % SIDE) as f64 + 0.5;
            let is_uniform = k >= SIDE * SIDE;
            let height = if is_uniform { u / SIDE as f64 } else { (1.0 - u / SIDE as f64).sqrt() };
            let (radius, angle) = ((1.0 - height * height).sqrt(), 2.0 * PI * v / SIDE as f64);
            let d = DVec3::new(radius * angle.cos(), height, radius * angle.sin());
            let share = match radiance {
                None => 1.0 / height,
                Some(_) => 1.0 / (PI * 0.5 * (height / PI + 0.5 / PI)),
            };
            let hit = from + out_of_box(size, from, d) * d;
            let mut factors = vec![height * share];
            factors.extend(all_y(n_radiance as usize, d).iter().map(|y| y * share));
            let counts = probes.map(|(at, weight)| {
                let t = hit.distance(at.as_dvec3()) / f64::from(RADIUS);
                f64::from(weight) / (t * t + 0.01)
            });
            for (ix, (at, _)) in probes.iter().enumerate() {
                let y = all_y(n as usize, (hit - at.as_dvec3()).normalize());
                for (j, y) in y.into_iter().enumerate() {
                    for (output, factor) in factors.iter().enumerate() {
                        let value = counts[ix] / counts.iter().sum::<f64>() * y * factor;
                        let at = output * n_columns as usize + ix * n as usize + j;
                        let [mean, square] = &mut expected[at];
                        *mean += value / (kinds * SIDE * SIDE) as f64;
                        *square += value * value / (kinds * SIDE * SIDE) as f64;
                    }
                }
            }
        }
        for (k, [mean, square]) in expected.into_iter().enumerate() {
            let found = f64::from(sums[k]) / weights;
            let limit = 5.0 * ((square - mean * mean).max(0.0) / f64::from(SAMPLES)).sqrt() + 1e-5;
            assert!(
                (found - mean).abs() < limit,
                "order {order}, radiance {radiance:?}, number {k}: {found}, expected {mean} within {limit}"
            );
        }
        // λ of constant radiance 1 is √4π and zeros.
        let constant: f64 = (0..3).map(|ix| f64::from(sums[(ix * n) as usize])).sum();
        let irradiance = PI / weights * constant * (4.0 * PI).sqrt();
        assert!((irradiance - PI).abs() < 1e-4, "irradiance of radiance 1: {irradiance}");
        if order == 7 {
            walls_light_by_their_form_factors(
                &sums[..n_columns as usize],
                weights,
                &probes,
                size,
                from,
            );
        }
    }
}

/// Samples of surfaces that no probe sees do not count; those of the sky do, and are dark: else what is beside the sky would be too bright. In a room
/// without a ceiling, of which no probe sees anything, as many count as the opening's form factor says. Tolerance: five standard deviations, as if samples were
/// independent.
#[test]
fn unseen_sky_is_dark() {
    let size = DVec3::new(4.0, 2.0, 3.0);
    let scene = world(vec![without_ceiling(size.as_vec3())], vec![lambert(0.5)]);
    let on_gpu = upload(&scene);
    let (triangle, side, from) = place_on_floor(&on_gpu, &scene);
    let kernel = ComputeKernel::new(
        gpu(),
        on_gpu.shaders(),
        Some(on_gpu.group()),
        "sparse_probes/transport",
    );
    let n_triangles = on_gpu.n_triangles();
    let third = 65535u32 / 3;
    let [x, y, z] = [2.0f32, 1.0, 1.5].map(f32::to_bits);
    let job: Vec<[u32; 4]> = vec![
        [0, 1, side, 5],
        [0, 1, 1.0f32.to_bits(), 0],
        [triangle, third | third << 16, 0, 0],
        [x, y, z, 1.0f32.to_bits()],
        [0; 4],
    ];
    let (n, stride) = (9u32, 9 + 3);
    let sums = bytes(&vec![0.0f32; stride as usize]);
    const SAMPLES: u32 = 4096;
    for first in (0..SAMPLES).step_by(64) {
        // By bits and masks: all 0.
        let info: [u32; 16] = [1, first, 1, 3, 2, stride, 0, 1, 1, 2, 3, 0, 0, 0, 1, 0];
        submit(|recorder| {
            kernel
                .call(&mut recorder.compute("transport"))
                .scene(on_gpu.group())
                .uniform("info", &info)
                .bind("job", &bytes(&job))
                .bind("sight", &bytes(&[0u32; 1 + 512]))
                .bind("sums", &sums)
                .bind(
                    "lightmap",
                    &crate::harness::uniform(bytemuck::cast_slice(&[1u32, 1, n_triangles, 0])),
                )
                .bind("lightmap_words", &bytes(&vec![0u32; 6 * n_triangles as usize + 2]))
                .dispatch(Dispatch::Rows(1));
        });
    }
    let sums: Vec<f32> = bytemuck::pod_collect_to_vec(&read(&sums));
    assert!(sums[..n as usize].iter().all(|sum| *sum == 0.0), "nothing arrives: {sums:?}");
    assert_eq!(sums[n as usize + 2], SAMPLES as f32, "samples in all");
    let factor =
        form_factor(&[0.0, 1.0, 3.0, 2.0].map(|k: f64| {
            DVec3::new(size.x * (k % 2.0), size.y, size.z * (k / 2.0).floor()) - from
        }));
    let found = f64::from(sums[n as usize]) / f64::from(SAMPLES);
    let limit = 5.0 * (factor * (1.0 - factor) / f64::from(SAMPLES)).sqrt();
    assert!(
        (found - factor).abs() < limit,
        "{found} of the samples count, expected {factor} within {limit}"
    );
}

/// Lambert's formula: the form factor of a polygon above a place at 0, whose normal is y.
fn form_factor(corners: &[DVec3; 4]) -> f64 {
    let of_edge = |k: usize| {
        let (a, b) = (corners[k].normalize(), corners[(k + 1) % 4].normalize());
        a.dot(b).clamp(-1.0, 1.0).acos() * a.cross(b).normalize_or_zero().y
    };
    (0..4).map(of_edge).sum::<f64>().abs() / (2.0 * PI)
}

/// How far it is from a place in a box from 0 to `size` to its surface: the nearest of the planes ahead.
fn out_of_box(size: DVec3, from: DVec3, d: DVec3) -> f64 {
    (0..3)
        .filter(|axis| d[*axis] != 0.0)
        .map(|axis| ((if d[axis] > 0.0 { size[axis] } else { 0.0 }) - from[axis]) / d[axis])
        .filter(|t| *t > 1e-9)
        .fold(f64::INFINITY, f64::min)
}

/// Of a closed convex box, one wall after the other shines with radiance 1: irradiance on the floor is π times the wall's form factor (J. Lambert's formula for
/// polygons, 1760), as far as harmonics of order 7 can tell a wall from its neighbours: a probe 0.9 m from a wall spreads it by 0.04. Over all walls, they add up
/// to 1.
fn walls_light_by_their_form_factors(
    sums: &[f32],
    weights: f64,
    probes: &[(Vec3, f32)],
    size: DVec3,
    from: DVec3,
) {
    const N: usize = 64;
    let (mut all, mut all_found) = (0.0, 0.0);
    for axis in 0..3 {
        for end in [0.0, size[axis]] {
            // λ of each probe: over directions, those that leave the box through the wall.
            let mut irradiance = 0.0;
            for (ix, (at, _)) in probes.iter().enumerate() {
                let mut lambda = vec![0.0; N];
                const SIDE: usize = 300;
                for k in 0..2 * SIDE * SIDE {
                    let z = 1.0 - 2.0 * ((k % SIDE) as f64 + 0.5) / SIDE as f64;
                    let angle = PI * ((k / SIDE) as f64 + 0.5) / SIDE as f64;
                    let r = (1.0 - z * z).sqrt();
                    let d = DVec3::new(r * angle.cos(), r * angle.sin(), z);
                    let hit = at.as_dvec3() + out_of_box(size, at.as_dvec3(), d) * d;
                    if (hit[axis] - end).abs() < 1e-9 {
                        let share = 4.0 * PI / (2 * SIDE * SIDE) as f64;
                        let y = all_y(N, d);
                        lambda.iter_mut().zip(y).for_each(|(sum, y)| *sum += share * y);
                    }
                }
                let own = &sums[ix * N..(ix + 1) * N];
                irradiance += own.iter().zip(&lambda).map(|(a, l)| f64::from(*a) * l).sum::<f64>();
            }
            irradiance *= PI / weights;
            let [u, v] = [(axis + 1) % 3, (axis + 2) % 3];
            let corner = |x: f64, y: f64| {
                let mut at = DVec3::ZERO;
                (at[axis], at[u], at[v]) = (end, x, y);
                at - from
            };
            let corners = [
                corner(0.0, 0.0),
                corner(size[u], 0.0),
                corner(size[u], size[v]),
                corner(0.0, size[v]),
            ];
            // (The floor itself is in the horizon: its form factor is 0.)
            let is_floor = axis == 1 && end == 0.0;
            let factor = if is_floor { 0.0 } else { form_factor(&corners) };
            all += factor;
            let found = irradiance / PI;
            all_found += found;
            assert!(
                (found - factor).abs() < 0.06,
                "wall at {end} of axis {axis}: {found}, its form factor is {factor}"
            );
        }
    }
    assert!((all - 1.0).abs() < 1e-9, "form factors add up to {all}");
    assert!((all_found - 1.0).abs() < 1e-3, "irradiances by π add up to {all_found}");
}

/// Directions of an octahedral map of 8 × 8, in f64 (C. Cigolle et al., 2014): the middles of its texels.
fn octahedral_middle(texel: usize) -> DVec3 {
    let [x, y] = [texel % 8, texel / 8].map(|at| (at as f64 + 0.5) / 4.0 - 1.0);
    let z = 1.0 - x.abs() - y.abs();
    let fold = (-z).max(0.0);
    DVec3::new(x - x.signum() * fold, y - y.signum() * fold, z).normalize()
}

/// Maps of distances are the weighted means over the directions in which probes look, of the distance to the receivers that are seen there, and of its square;
/// the sky is far, what is not known does not count, and beyond 4096 directions some are left out. Tolerance: f32's sums.
#[test]
fn probes_know_how_far_they_see() {
    let scene = world(vec![room(Vec3::ZERO, Vec3::new(4.0, 2.0, 3.0))], vec![lambert(0.5)]);
    let on_gpu = upload(&scene);
    let mut random = Random(21);
    let receivers: Vec<[u32; 4]> = (0..40)
        .map(|_| {
            let triangle = random.bits() as u32 % on_gpu.n_triangles();
            let (u, v) = (random.bits() as u32 % 30000, random.bits() as u32 % 30000);
            [triangle, u | v << 16, 0, 0]
        })
        .collect();
    let place_of = |receiver: &[u32; 4]| {
        let [a, b, c] = with_lamp_corners(&on_gpu, &scene, receiver[0]);
        let [u, v] = [receiver[1] & 0xffff, receiver[1] >> 16].map(|x| f64::from(x) / 65535.0);
        a + u * (b - a) + v * (c - a)
    };
    let probes = [Vec3::new(1.0, 1.4, 0.7), Vec3::new(3.1, 0.5, 2.2), Vec3::new(2.0, 1.0, 1.5)];
    let radius = 1.5f32;
    let name = "sparse_probes/distances";
    let kernel = ComputeKernel::new(gpu(), on_gpu.shaders(), Some(on_gpu.group()), name);
    for n_directions in [64u32, 192, 8192] {
        let seen: Vec<u32> = (0..3 * n_directions)
            .map(|_| match random.bits() % 9 {
                0 => SEEN_SKY,
                1 => SEEN_UNKNOWN,
                other => (other as u32 * 5 + random.bits() as u32 % 4) % receivers.len() as u32,
            })
            .collect();
        let mut places: Vec<[f32; 4]> = probes.map(|p| p.extend(0.0).to_array()).to_vec();
        places.resize(3 + 3 * 32, [f32::NAN; 4]);
        let places = bytes(&places);
        submit(|recorder| {
            kernel
                .call(&mut recorder.compute("distances"))
                .scene(on_gpu.group())
                .uniform("info", &[3, n_directions, radius.to_bits(), 0])
                .bind("seen", &bytes(&seen))
                .bind("receivers", &bytes(&receivers))
                .bind("places", &places)
                .dispatch(Dispatch::Rows(3));
        });
        let found = floats(&places);
        let looks: Vec<[f32; 4]> = map(
            &format!(
                "#import lucerna::components::sparse_probes::directions::look_direction
                 alias Input = vec4<f32>;
                 alias Output = vec4<f32>;
                 fn map(x: Input) -> Output {{ return vec4<f32>(look_direction(u32(x.x), {n_directions}u), 0.0); }}"
            ),
            &(0..n_directions).map(|ix| [ix as f32, 0.0, 0.0, 0.0]).collect::<Vec<_>>(),
        );
        let step = (n_directions.div_ceil(4096) | 1) as usize;
        for (probe, at) in probes.iter().enumerate() {
            for texel in 0..64usize {
                let own = octahedral_middle(texel);
                let mut sum = [0.0f64; 3];
                for ix in (0..n_directions as usize).step_by(step) {
                    let distance = match seen[probe * n_directions as usize + ix] {
                        SEEN_UNKNOWN => continue,
                        SEEN_SKY => 4.0,
                        receiver => {
                            let to = place_of(&receivers[receiver as usize]);
                            (to.distance(at.as_dvec3()) / f64::from(radius)).min(4.0)
                        }
                    };
                    let look = Vec3::from_slice(&looks[ix]).as_dvec3();
                    let weight = look.dot(own).max(0.0).powi(32);
                    sum[0] += weight;
                    sum[1] += weight * distance;
                    sum[2] += weight * distance * distance;
                }
                let two = found[3 + probe * 32 + texel / 2];
                let [mean, square] = [two[2 * (texel % 2)], two[2 * (texel % 2) + 1]];
                for (found, expected) in [(mean, sum[1] / sum[0]), (square, sum[2] / sum[0])] {
                    assert!(
                        (f64::from(found) - expected).abs() < 2e-4 * expected,
                        "{n_directions} directions, probe {probe}, texel {texel}: {found}, expected {expected}"
                    );
                }
            }
        }
    }
}

/// Light of probes at a point: of given places, coefficients (one list for each probe) and distances of all texels of each map.
fn read_probes(
    probes: &[(Vec3, Vec<[f32; 3]>, f32)],
    radius: f32,
    inputs: &[(Vec3, Vec3)],
) -> Vec<[f32; 4]> {
    let n = probes.first().map_or(1, |probe| probe.1.len());
    let order = (n as f32).sqrt() as u32 - 1;
    let info = [probes.len() as u32, order, radius.to_bits(), 0];
    let lambda: Vec<[f32; 4]> =
        probes.iter().flat_map(|of| of.1.iter().map(|[x, y, z]| [*x, *y, *z, f32::NAN])).collect();
    let places = probes.iter().map(|(at, ..)| at.extend(f32::NAN).to_array());
    let maps = probes.iter().flat_map(|(.., d)| [[*d, d * d, *d, d * d]; 32]);
    let places: Vec<[f32; 4]> = places.chain(maps).chain([[0.0; 4]]).collect();
    // (Two numbers an input.)
    let given: Vec<[f32; 4]> = inputs
        .iter()
        .flat_map(|(at, normal)| [at.extend(0.0).to_array(), normal.extend(0.0).to_array()])
        .collect();
    let list: String = given
        .iter()
        .map(|x| format!("vec4<f32>({:?}, {:?}, {:?}, 0.0),", x[0], x[1], x[2]))
        .collect();
    let text = format!(
        "#import lucerna::fields::sparse_probes::sparse_irradiance
         alias Input = vec4<f32>;
         alias Output = vec4<f32>;
         fn map(x: Input) -> Output {{
             var given = array<vec4<f32>, {}>({list});
             let ix = 2u * u32(x.x);
             return sparse_irradiance(given[ix].xyz, given[ix + 1u].xyz);
         }}",
        given.len()
    );
    let ixs: Vec<[f32; 4]> = (0..inputs.len()).map(|ix| [ix as f32, 0.0, 0.0, 0.0]).collect();
    map_of_field(
        "lucerna::fields::sparse_probes",
        &text,
        &ixs,
        &[
            (42, &crate::harness::uniform(bytemuck::cast_slice(&info))),
            (43, &bytes(&[lambda, vec![[0.0; 4]]].concat())),
            (44, &bytes(&places)),
        ],
    )
}

/// What moves is lit by the probes: constant radiance 1 gives π, whichever probes are there; a probe in the middle of a ball, whose inside shines as a + b·φ,
/// gives at any point inside what a quadrature over the ball gives (light from the near side comes from a wider angle); a probe that does not see the point
/// hardly counts; and without probes nothing is known.
#[test]
fn objects_read_probes() {
    let mut random = Random(22);
    let mut point = |size: f32| {
        let at = Vec3::new(random.unit(), random.unit(), random.unit()) * 2.0 - 1.0;
        (size * at, random.direction())
    };
    let inputs: Vec<(Vec3, Vec3)> = (0..24).map(|_| point(0.55)).collect();
    let root = (4.0 * PI).sqrt() as f32;
    let constant = |light: f32, order: usize| {
        let mut out = vec![[0.0f32; 3]; (order + 1) * (order + 1)];
        out[0] = [light * root, 2.0 * light * root, 0.0];
        out
    };
    for order in [0, 2, 7] {
        let probes: Vec<_> =
            (0..7).map(|_| (point(1.0).0, constant(1.0, order), 0.3 + 1.5)).collect();
        for found in read_probes(&probes, 0.7, &inputs) {
            let expected = [PI as f32, 2.0 * PI as f32, 0.0, 1.0];
            let apart = (0..4).map(|k| (found[k] - expected[k]).abs()).fold(0.0, f32::max);
            assert!(apart < 1e-4, "constant light, order {order}: {found:?}");
        }
    }
    // L = 1 + 0.8 φ·s: λ₀₀ = √4π, and 0.8 √(4π/3) s in band 1 (y, z, x).
    let s = Vec3::new(0.6, 0.0, 0.8);
    let one = 0.8 * (4.0 * PI / 3.0).sqrt() as f32;
    let lambda: Vec<[f32; 3]> = [root, one * s.y, one * s.z, one * s.x].map(|x| [x; 3]).to_vec();
    // A ball of radius 1 m; distances are in radii of 0.8 m.
    let center = Vec3::new(0.1, -0.2, 0.3);
    let probes = [(center, lambda, 1.0 / 0.8)];
    let moved: Vec<(Vec3, Vec3)> = inputs.iter().map(|(at, n)| (*at + center, *n)).collect();
    for ((at, normal), found) in inputs.iter().zip(read_probes(&probes, 0.8, &moved)) {
        let (at, normal) = (at.as_dvec3(), normal.as_dvec3());
        let (x, y) = normal.any_orthonormal_pair();
        let mut sum = 0.0;
        const SIDE: usize = 120;
        for k in 0..SIDE * SIDE {
            let [u, v] = [k % SIDE, k / SIDE].map(|x| (x as f64 + 0.5) / SIDE as f64);
            let (r, angle) = (u.sqrt(), 2.0 * PI * v);
            let d = r * (angle.cos() * x + angle.sin() * y) + (1.0 - u).sqrt() * normal;
            let b = at.dot(d);
            let t = -b + (b * b + 1.0 - at.length_squared()).sqrt();
            sum += 1.0 + 0.8 * (at + t * d).normalize().dot(s.as_dvec3());
        }
        let expected = PI * sum / (SIDE * SIDE) as f64;
        // (32 directions, and six halvings of up to 4.7 radii: 3 %.)
        let apart = (f64::from(found[0]) / expected - 1.0).abs();
        assert!(apart < 0.03, "at {at} towards {normal}: {found:?}, expected {expected}");
    }
    // More probes than are read, and all count the same.
    let same = vec![(Vec3::X, constant(1.0, 1), 3.0); 7];
    let found = read_probes(&same, 1.0, &[(Vec3::ZERO, Vec3::Y)]);
    assert!((found[0][0] / PI as f32 - 1.0).abs() < 1e-4, "amid equal probes: {found:?}");
    // Two probes as near as each other; the second one sees 0.2 m far alone.
    let probes = [(Vec3::X, constant(1.0, 1), 3.0), (-Vec3::X, constant(100.0, 1), 0.2)];
    let found = read_probes(&probes, 1.0, &[(Vec3::ZERO, Vec3::Y)]);
    assert!((found[0][0] / PI as f32 - 1.0).abs() < 0.01, "with a hidden probe: {found:?}");
    assert_eq!(read_probes(&[], 1.0, &[(Vec3::ZERO, Vec3::Y)]), [[0.0; 4]], "without probes");
}
