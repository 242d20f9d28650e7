// SPDX-License-Identifier: MIT OR Apache-2.0
//! What voxels look like, against clipping in f64.

use crate::harness::{KeepNan, Largest, Random, gpu, map, read, submit};
use crate::rays::random_triangles;
use glam::{Affine2, Affine3A, DVec3, UVec2, UVec3, UVec4, Vec2, Vec3, Vec4};
use lucerna::components::voxels::{
    Resolution, Triangles, VoxelAttributes, VoxelCounts, VoxelGrid, Voxelizer, grid_for_bounds,
    n_bricks,
};
use lucerna::gpu_scene::{GpuScene, GpuSceneOptions};
use lucerna::scene::{
    AlphaMode, Filter, Image, Instance, Material, Mesh, Scene, Texture, TextureRef, Wrap,
};
use lucerna::testing::{assert_guards, guard_buffers};
use std::collections::BTreeMap;

/// What is tested is how colours are averaged: they are reflected as they are.
fn lambert_options() -> GpuSceneOptions {
    GpuSceneOptions::default().diffuse_only(true)
}

/// The triangle's part in a box, as a polygon: cut by half-spaces in f64.
fn clipped(corners: [DVec3; 3], low: DVec3, high: DVec3) -> Vec<DVec3> {
    let mut polygon = corners.to_vec();
    for axis in 0..3 {
        for (sign, level) in [(1.0, high[axis]), (-1.0, -low[axis])] {
            let inside = |p: &DVec3| sign * p[axis] <= level;
            let mut out = Vec::new();
            for (p, q) in polygon.iter().zip(polygon.iter().cycle().skip(1)) {
                if inside(p) != inside(q) {
                    let t = (level - sign * p[axis]) / (sign * q[axis] - sign * p[axis]);
                    if inside(p) {
                        out.push(*p);
                    }
                    out.push(p.lerp(*q, t));
                } else if inside(p) {
                    out.push(*p);
                }
            }
            polygon = out;
        }
    }
    polygon
}

fn area_of(polygon: &[DVec3]) -> DVec3 {
    (1..polygon.len().max(2) - 1)
        .map(|k| (polygon[k] - polygon[0]).cross(polygon[k + 1] - polygon[0]) * 0.5)
        .sum()
}

#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
struct ClipInput {
    corners: [Vec4; 3],
    center: Vec3,
    half: f32,
}

/// 40 000 triangles of 0.02 to 30 cells around a unit cube, and larger and smaller cubes. A corner
/// that is cut has 4 roundings of the coordinates S it is cut from, relative to the cube's centre;
/// the area is a sum over up to 9 corners that stand up to √3·edge apart: 9·2·√3·4·6e-8·S·edge.
#[test]
fn clip_area_matches_f64() {
    let mut random = Random(61);
    let mut inputs: Vec<ClipInput> = (0..40_000)
        .map(|k| {
            let half = [0.5, 0.5, 7.0, 0.003][k % 4];
            let size = half * 10f32.powf(random.range(-1.5, 1.8));
            let center = random.direction() * [0.0, 3.0 * half][k % 2];
            let near = center + random.direction() * (1.5 * half * random.unit());
            let corners =
                [(); 3].map(|()| (near + random.direction() * size * random.unit()).extend(0.0));
            ClipInput { corners, center, half }
        })
        .collect();
    // The most corners, nine: across a diagonal the cube's section is a hexagon, and the triangle cuts off every second of
    // its corners, which are √½ edges from the middle.
    inputs.extend((0..200).map(|k| {
        let half = [0.5, 7.0, 0.003][k % 3];
        let away = half * random.range(1.27, 1.39);
        let axes = [Vec3::new(1.0, -1.0, 0.0), Vec3::new(1.0, 1.0, -2.0)].map(|v| v.normalize());
        let first = k as f32 % 6.0;
        let corners = [1.0, 3.0, 5.0].map(|sixth: f32| {
            let (sin, cos) = ((first + sixth) * std::f32::consts::FRAC_PI_3).sin_cos();
            ((axes[0] * cos + axes[1] * sin) * 2.0 * away).extend(0.0)
        });
        ClipInput { corners, center: Vec3::ZERO, half }
    }));
    let mut most_corners = 0;
    let outputs: Vec<[Vec4; 2]> = map(
        "#import lucerna::geometry::clip::clip_triangle_to_cube
        struct Input { a: vec4<f32>, b: vec4<f32>, c: vec4<f32>, center: vec3<f32>, half_size: f32 }
        struct Output { area: vec4<f32>, middle: vec4<f32> }
        fn map(i: Input) -> Output {
            let part = clip_triangle_to_cube(i.a.xyz, i.b.xyz, i.c.xyz, i.center, i.half_size);
            return Output(vec4<f32>(part.area, 0.0), vec4<f32>(part.middle, 0.0));
        }",
        &inputs,
    );
    let (mut n_parts, mut worst) = (0, 0.0f64);
    for (input, [area, middle]) in inputs.iter().zip(&outputs) {
        let center = input.center.as_dvec3();
        let corners = input.corners.map(|p| p.truncate().as_dvec3() - center);
        let half = f64::from(input.half);
        let polygon = clipped(corners, DVec3::splat(-half), DVec3::splat(half));
        let expected = area_of(&polygon);
        most_corners = most_corners.max(polygon.len());
        n_parts += usize::from(expected.length() > 0.01 * half * half);
        let size = corners.iter().map(|p| p.length()).fold(half, f64::max);
        let bound = 9.0 * 2.0 * 3f64.sqrt() * 4.0 * 6e-8 * size * 2.0 * half;
        let error = (area.truncate().as_dvec3() - expected).largest();
        worst = worst.max_nan(error / bound);
        assert!(
            error <= bound,
            "{input:?}: the part's area is {area}, expected {expected} within {bound:.1e}"
        );
        let inside = (middle.truncate() - input.center).largest();
        assert!(
            inside <= input.half * 1.001,
            "{input:?}: the part's middle is {middle}, {inside} from the cube's, expected at most 1.001 of half its side"
        );
    }
    println!("clip: {n_parts} parts, at most {worst:.3} of the bound");
    assert!(
        n_parts > 10_000 && most_corners == 9,
        "{n_parts} triangles have a part in their cube, expected above 10 000; the most corners of a part are {most_corners}, expected 9"
    );
}

/// A face as `wgsl/components/voxels/attributes.wgsl` documents its record, decoded here by hand.
#[derive(Clone, Copy, Debug)]
struct Face {
    valid: bool,
    is_back: bool,
    albedo: DVec3,
    normal: DVec3,
    emission: DVec3,
    coverage: f64,
    agreement: f64,
}

fn decode(record: UVec4) -> Face {
    let bits = |word: u32, at: u32, n: u32| f64::from(word >> at & ((1 << n) - 1));
    let snorm = |at: u32| f64::from((record.y >> at) as u16 as i16) / 32767.0;
    let (x, y) = (snorm(0), snorm(16));
    let z = 1.0 - x.abs() - y.abs();
    let fold = |a: f64| a - (-z).max(0.0) * if a >= 0.0 { 1.0 } else { -1.0 };
    let scale = 2f64.powi((record.z >> 27) as i32 - 24);
    Face {
        valid: record.x >> 30 & 1 == 1,
        is_back: record.x >> 31 == 1,
        albedo: DVec3::new(bits(record.x, 0, 10), bits(record.x, 10, 10), bits(record.x, 20, 10))
            / 1023.0,
        normal: DVec3::new(fold(x), fold(y), z).normalize(),
        emission: DVec3::new(bits(record.z, 0, 9), bits(record.z, 9, 9), bits(record.z, 18, 9))
            * scale,
        coverage: bits(record.w, 0, 16) / 65535.0,
        agreement: bits(record.w, 16, 16) / 65535.0,
    }
}

/// Cells in the order of slots, and the records. Nothing is written behind a buffer.
fn attributes(scene: &GpuScene, grid: VoxelGrid, scratch: u64) -> (Vec<UVec3>, Vec<UVec4>) {
    guard_buffers();
    let voxelizer = Voxelizer::new(gpu(), scene, grid).unwrap();
    let attributes = VoxelAttributes::with_scratch(gpu(), scene, &voxelizer, scratch).unwrap();
    // Twice: sums must be zero again.
    for _ in 0..2 {
        submit(|recorder| {
            voxelizer.record(recorder, scene, Triangles::All).unwrap();
            attributes.record(recorder, scene, &voxelizer).unwrap();
        });
    }
    let counts: VoxelCounts =
        bytemuck::pod_read_unaligned(&read(voxelizer.counts())[..size_of::<VoxelCounts>()]);
    let words: Vec<UVec2> = bytemuck::pod_collect_to_vec(&read(voxelizer.structure()));
    let cells = words[n_bricks(&grid) as usize..][..counts.n_voxels as usize]
        .iter()
        .map(|word| UVec3::new(word.x & 1023, word.x >> 10 & 1023, word.x >> 20))
        .collect();
    let mut records: Vec<UVec4> = bytemuck::pod_collect_to_vec(&read(attributes.records()));
    records.truncate(counts.n_records as usize);
    assert_guards(gpu());
    (cells, records)
}

fn materials() -> Vec<Material> {
    let of = |color: [f32; 3], emission: [f32; 3], double_sided| Material {
        base_color: Vec3::from_array(color).extend(1.0),
        emission: Vec3::from_array(emission),
        double_sided,
        ..Material::default()
    };
    vec![
        of([0.9, 0.1, 0.3], [0.0; 3], false),
        of([0.2, 0.7, 1.0], [3.0, 0.5, 0.0], false),
        of([0.0, 0.0, 0.5], [8.0, 8.0, 8.0], true),
        of([1.0, 1.0, 1.0], [0.0; 3], true),
    ]
}

/// Triangle `k` is made of material `k % 4`.
fn scene_of(triangles: &[[Vec3; 3]]) -> Scene {
    let meshes: Vec<Mesh> = (0..4)
        .map(|material| {
            let positions: Vec<Vec3> =
                triangles.iter().skip(material).step_by(4).flatten().copied().collect();
            let n = positions.len() as u32 / 3;
            let triangles = (0..n).map(|k| [3 * k, 3 * k + 1, 3 * k + 2]).collect();
            Mesh { positions, triangles, material, ..Mesh::default() }
        })
        .collect();
    let instances =
        (0..4).map(|mesh| Instance { mesh, world_from_object: Affine3A::IDENTITY }).collect();
    Scene { meshes, instances, materials: materials(), ..Scene::default() }
}

#[derive(Clone, Copy, Default)]
struct Sums {
    weight: f64,
    albedo: DVec3,
    normal: DVec3,
    emission: DVec3,
    coverage: f64,
    n: usize,
    /// Of these, how many show the face itself.
    n_shown: usize,
}

fn sums_in_f64(grid: &VoxelGrid, triangles: &[[Vec3; 3]]) -> BTreeMap<(usize, usize), Sums> {
    let materials = materials();
    let mut out: BTreeMap<(usize, usize), Sums> = BTreeMap::new();
    for (k, triangle) in triangles.iter().enumerate() {
        let material = &materials[k % 4];
        let (albedo, emission) =
            (material.base_color.truncate().as_dvec3(), material.emission.as_dvec3());
        let corners = triangle.map(|p| ((p - grid.origin) / grid.cell).as_dvec3());
        let [a, b, c] = corners;
        let normal = (b - a).cross(c - a).normalize();
        let last = grid.size.as_dvec3() - 1.0;
        let from = a.min(b).min(c).floor().clamp(DVec3::ZERO, last).as_uvec3();
        let to = a.max(b).max(c).floor().clamp(DVec3::ZERO, last).as_uvec3();
        for z in from.z..=to.z {
            for y in from.y..=to.y {
                for x in from.x..=to.x {
                    let low = UVec3::new(x, y, z).as_dvec3();
                    let polygon = clipped(corners, low, low + 1.0);
                    if polygon.is_empty() {
                        continue;
                    }
                    let area = area_of(&polygon);
                    let ix = ((z * grid.size.y + y) * grid.size.x + x) as usize;
                    let add = |out: &mut BTreeMap<(usize, usize), Sums>, face, weight, normal| {
                        let sums: &mut Sums = out.entry((ix, face)).or_default();
                        let (weight, normal): (f64, DVec3) = (weight, normal);
                        sums.weight += weight;
                        sums.albedo += weight * albedo;
                        sums.normal += weight * normal;
                        sums.emission += weight * emission;
                        sums.n_shown += 1;
                    };
                    if grid.n_faces == 1 {
                        add(&mut out, 0, area.length(), normal);
                        let sums = out.entry((ix, 0)).or_default();
                        sums.coverage += area.length();
                        sums.n += 1;
                        continue;
                    }
                    for axis in 0..3 {
                        let front = 2 * axis + usize::from(normal[axis] < 0.0);
                        let weight = area[axis].abs();
                        add(&mut out, front, weight, normal);
                        if material.double_sided {
                            add(&mut out, front ^ 1, weight, -normal);
                        }
                        for face in [front, front ^ 1] {
                            let sums = out.entry((ix, face)).or_default();
                            sums.coverage += weight;
                            sums.n += 1;
                        }
                    }
                }
            }
        }
    }
    out
}

/// Every record against f64.
///
/// A weight is wrong by ½ from rounding, by 1 where a triangle only touches, and by clipping: at
/// most 9·2·√3·4·6e-8·S cells² for triangles that reach S cells far (S ≤ 8 here: 1.6 units of 2⁻¹⁸;
/// in total 3.1 units, less than 4). Of n weights with sum W, a mean of values that lie in a range of
/// R is wrong by at most 4·n·R/W. To that come half a step of the values and of the record.
fn check(n_faces: u32) {
    let triangles: Vec<_> = random_triangles(800, 6.0, 41);
    let (min, max) = (Vec3::splat(-9.0), Vec3::splat(9.0));
    let grid = grid_for_bounds(min, max, Resolution::Longest(22), n_faces, Some(10_648)).unwrap();
    let scene = GpuScene::new(gpu(), &scene_of(&triangles), lambert_options()).unwrap();
    let expected = sums_in_f64(&grid, &triangles);
    let (cells, records) = attributes(&scene, grid, 128 << 20);
    let unit = 2f64.powi(-18);
    let (mut n_tight, mut n_backs) = (0, 0);
    for (slot, cell) in cells.iter().enumerate() {
        let ix = ((cell.z * grid.size.y + cell.y) * grid.size.x + cell.x) as usize;
        for face in 0..n_faces as usize {
            let found = decode(records[slot * n_faces as usize + face]);
            let what = format!("{n_faces} faces, cell {cell}, face {face}");
            let own = expected.get(&(ix, face)).copied().unwrap_or_default();
            let other = expected.get(&(ix, face ^ 1)).copied().unwrap_or_default();
            let error = 4.0 * own.n as f64 * unit;
            let coverage = own.coverage.min(1.0);
            assert!(
                (found.coverage - coverage).abs() < error + 1e-5,
                "{what}: coverage is {}, expected {coverage} within {:.1e}",
                found.coverage,
                error + 1e-5
            );
            // Whether anything weighs at all may be a question of rounding.
            let back = own.n_shown == 0 && n_faces == 6;
            let sums = if back { other } else { own };
            if sums.weight < 50.0 * 4.0 * sums.n as f64 * unit {
                continue;
            }
            n_tight += 1;
            n_backs += usize::from(back);
            assert!(
                found.valid,
                "{what}: the record is not valid, of weight {}: {found:?}",
                sums.weight
            );
            let error = 4.0 * sums.n as f64 * unit / sums.weight;
            let albedo = sums.albedo / sums.weight;
            let bound = 0.5 / 1023.0 + 0.5 / 4095.0 + error + 1e-5;
            assert!(
                (found.albedo - albedo).largest() < bound,
                "{what}: albedo is {}, expected {albedo} within {bound:.1e}",
                found.albedo
            );
            let mean = sums.normal / sums.weight * if back { -1.0 } else { 1.0 };
            let bound = 0.5 / 2047.0 + 2.0 * error + 1e-5;
            assert!(
                (found.agreement - mean.length()).abs() < 2.0 * bound,
                "{what}: agreement of normals is {}, expected {} within {:.1e}",
                found.agreement,
                mean.length(),
                2.0 * bound
            );
            let off = (found.normal - mean.normalize()).length();
            // √3 components; the record itself is good to 6.5e-5.
            assert!(
                off < 1.8 * bound / (mean.length() - 2.0 * bound).max(1e-9) + 1e-4,
                "{what}: normal is {}, expected {} within {:.1e}",
                found.normal,
                mean.normalize(),
                1.8 * bound / (mean.length() - 2.0 * bound).max(1e-9) + 1e-4
            );
            let emission = if back { DVec3::ZERO } else { sums.emission / sums.weight };
            let bound = emission.max_element() / 511.0 + 8.0 * error + 8.0 / 262_143.0 + 1e-5;
            assert!(
                (found.emission - emission).largest() < bound,
                "{what}: emission is {}, expected {emission} within {bound:.1e}",
                found.emission
            );
        }
    }
    println!("{n_faces} faces: {} records, {n_tight} checked, {n_backs} backs", records.len());
    assert!(
        n_tight > records.len() / 3,
        "{n_faces} faces: {n_tight} of {} records are checked, expected above a third",
        records.len()
    );
    assert!(
        n_faces == 1 || n_backs > 1000,
        "{n_faces} faces: {n_backs} backs are checked, expected above 1000"
    );
}

#[test]
fn voxel_faces_match_f64() {
    check(6);
}

#[test]
fn isotropic_voxels_match_f64() {
    check(1);
}

/// The same bytes again, with the triangles in another order, and in ranges of few slots.
#[test]
fn voxel_records_do_not_depend_on_order() {
    let triangles = random_triangles(600, 4.0, 19);
    let (min, max) = (Vec3::splat(-9.0), Vec3::splat(9.0));
    let grid = grid_for_bounds(min, max, Resolution::Longest(30), 6, None).unwrap();
    let run = |triangles: &[[Vec3; 3]], scratch| {
        let scene = scene_of(triangles);
        attributes(&GpuScene::new(gpu(), &scene, lambert_options()).unwrap(), grid, scratch)
    };
    let first = run(&triangles, 128 << 20);
    assert!(first.0.len() > 1000, "{} voxels, expected above 1000", first.0.len());
    let is_same = |(cells, records): (Vec<UVec3>, Vec<UVec4>), how: &str| {
        let n_records =
            records.iter().zip(&first.1).filter(|(found, expected)| found != expected).count();
        assert!(
            (&cells, &records) == (&first.0, &first.1),
            "{how}: {} cells (the same: {}) and {} records, of which {n_records} differ; expected {} and {} as in the first run",
            cells.len(),
            cells == first.0,
            records.len(),
            first.0.len(),
            first.1.len()
        );
    };
    is_same(run(&triangles, 128 << 20), "again");
    is_same(run(&triangles, 88 * 6 * 300), "in ranges of few slots");
    // Whole groups of four turn, so every triangle keeps its material.
    let turned: Vec<_> = triangles.rchunks(4).flatten().copied().collect();
    is_same(run(&turned, 128 << 20), "triangles in another order");
}

fn quad(corners: [Vec3; 4], material: Material) -> Scene {
    let [a, b, c, d] = corners;
    Scene {
        meshes: vec![Mesh {
            positions: vec![a, b, c, d],
            uv0: vec![Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y],
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            ..Mesh::default()
        }],
        instances: vec![Instance { mesh: 0, world_from_object: Affine3A::IDENTITY }],
        materials: vec![material],
        ..Scene::default()
    }
}

/// Eight units wide at height y, seen from above.
fn sheet(y: f32) -> [Vec3; 4] {
    [(0.0, 0.0), (0.0, 8.0), (8.0, 8.0), (8.0, 0.0)].map(|(x, z)| Vec3::new(x, y, z))
}

fn cells_of_a_metre(n_faces: u32) -> VoxelGrid {
    let size = UVec3::splat(10);
    VoxelGrid {
        origin: Vec3::splat(-1.0),
        cell: 1.0,
        size,
        n_faces,
        bricks: UVec3::new(3, 3, 5),
        capacity: 1000,
    }
}

/// A face reflects what its material does of even light: a white dielectric as rough as can be 0.85 of it, not 1.
#[test]
fn faces_reflect_as_their_material_does() {
    for (metallic, roughness) in [(0.0, 1.0), (0.0, 0.4), (1.0, 0.5)] {
        let base = Vec3::new(1.0, 0.6, 0.1);
        let material =
            Material { base_color: base.extend(1.0), metallic, roughness, ..Material::default() };
        let scene = quad(sheet(3.5), material);
        let scene = GpuScene::new(gpu(), &scene, GpuSceneOptions::default()).unwrap();
        let (cells, records) = attributes(&scene, cells_of_a_metre(6), 128 << 20);
        assert!(cells.len() >= 64, "{} voxels of the sheet, expected at least 64", cells.len());
        let expected = crate::bsdf::hemispherical_albedo(base, metallic, roughness);
        for (slot, record) in records.chunks_exact(6).enumerate() {
            let found = decode(record[2]).albedo;
            assert!(
                (found - expected).largest() <= 0.03,
                "metallic {metallic}, roughness {roughness}, slot {slot}: albedo is {found}, expected {expected} within 0.03"
            );
        }
    }
}

/// A sheet of cloth shows both its sides, and shines out of the front alone or out of both.
#[test]
fn one_sheet_has_two_faces() {
    for double_sided in [false, true] {
        let material = Material {
            base_color: Vec4::new(0.5, 0.25, 1.0, 1.0),
            emission: Vec3::new(2.0, 4.0, 1.0),
            double_sided,
            ..Material::default()
        };
        let scene = quad(sheet(3.5), material);
        let scene = GpuScene::new(gpu(), &scene, lambert_options()).unwrap();
        let (cells, records) = attributes(&scene, cells_of_a_metre(6), 128 << 20);
        for (slot, cell) in cells.iter().enumerate() {
            assert_eq!(cell.y, 4, "height of the sheet's cell {cell}");
            let inside = (1..9).contains(&cell.x) && (1..9).contains(&cell.z);
            for face in 0..6 {
                let found = decode(records[slot * 6 + face]);
                let what = format!("double-sided: {double_sided}, cell {cell}, face {face}");
                if face / 2 != 1 {
                    assert!(
                        !found.valid && found.coverage == 0.0,
                        "{what}: the record beside the sheet is {found:?}, expected not valid, of coverage 0"
                    );
                    continue;
                }
                let up = face == 2;
                assert!(found.valid, "{what}: the record is not valid: {found:?}");
                assert_eq!(found.normal, if up { DVec3::Y } else { -DVec3::Y }, "{what}: normal");
                assert!(
                    (found.albedo - DVec3::new(0.5, 0.25, 1.0)).length() < 1e-3,
                    "{what}: albedo is {}, expected the material's (0.5, 0.25, 1) within 1e-3",
                    found.albedo
                );
                assert_eq!(found.is_back, !up && !double_sided, "{what}: whether it is a back");
                let shines = up || double_sided;
                let emission = if shines { DVec3::new(2.0, 4.0, 1.0) } else { DVec3::ZERO };
                assert!(
                    (found.emission - emission).length() < 0.01,
                    "{what}: emission is {}, expected {emission} within 0.01",
                    found.emission
                );
                // Cells beside the sheet only touch its edge.
                let coverage = if inside { 1.0 } else { 0.0 };
                assert!(
                    (found.coverage - coverage).abs() < 1e-4,
                    "{what}: coverage is {}, expected {coverage} within 1e-4",
                    found.coverage
                );
            }
        }
        assert_eq!(cells.len(), 100, "double-sided: {double_sided}: cells of the sheet");
    }
}

/// A chequered texture of 64 × 64 texels on 8 × 8 cells: each voxel has the mean of its texels, not
/// one of them. Where alpha cuts a half away, that half does not count.
#[test]
fn textures_are_averaged_over_a_voxel() {
    let texel = |x: u32, y: u32| {
        if (x + y).is_multiple_of(2) { [255, 255, 255, 255] } else { [0, 0, 0, 255] }
    };
    let chequered: Vec<_> = (0..64 * 64).map(|k| texel(k % 64, k / 64)).collect();
    let half: Vec<_> =
        (0..64 * 64).map(|k| [255, 255, 255, if k % 64 < 32 { 255 } else { 0 }]).collect();
    for (rgba, masked) in [(chequered, false), (half, true)] {
        let texture = TextureRef { texture: 0, uv_set: 0, uv_from_mesh: Affine2::IDENTITY };
        let material = Material {
            base_color_texture: Some(texture),
            alpha: if masked { AlphaMode::Mask { cutoff: 0.5 } } else { AlphaMode::Opaque },
            ..Material::default()
        };
        let mut scene = quad(sheet(3.5), material);
        scene.images = vec![Image { name: String::new(), width: 64, height: 64, rgba }];
        scene.textures = vec![Texture {
            image: 0,
            wrap_u: Wrap::Clamp,
            wrap_v: Wrap::Clamp,
            filter: Filter::Linear,
        }];
        let scene = GpuScene::new(gpu(), &scene, lambert_options()).unwrap();
        let (cells, records) = attributes(&scene, cells_of_a_metre(6), 128 << 20);
        assert!(cells.len() >= 64, "{} voxels of the sheet, expected at least 64", cells.len());
        for (slot, cell) in cells.iter().enumerate() {
            let inside = (1..9).contains(&cell.x) && (1..9).contains(&cell.z);
            let found = decode(records[slot * 6 + 2]);
            if !inside {
                continue;
            }
            if masked {
                // u runs along z.
                let kept = cell.z < 5;
                assert!(
                    found.valid || !kept,
                    "cell {cell} of the masked sheet: the record is not valid where the mask keeps it: {found:?}"
                );
                assert!(
                    (found.coverage - f64::from(u8::from(kept))).abs() < 1e-4,
                    "cell {cell} of the masked sheet: coverage is {}, expected {} within 1e-4",
                    found.coverage,
                    u8::from(kept)
                );
            } else {
                assert!(
                    (found.albedo - 0.5).largest() < 0.02,
                    "cell {cell} of the chequered sheet: albedo is {}, expected 0.5 within 0.02",
                    found.albedo
                );
            }
        }
    }
}
