// SPDX-License-Identifier: MIT OR Apache-2.0
//! The kernels that go over the faces of one level's voxels: gather, deposit, bounce, fill, peak.
//!
//! Each runs on the second of two levels. Nothing else of their buffers may change: neither the first level's records, nor
//! those behind the last.

use crate::harness::{Largest, Random, gpu, read, storage, submit};
use crate::picture::color;
use crate::statistics::{over_hemisphere, way_out_of_cube};
use bytemuck::Zeroable;
use glam::{DVec3, DVec4, UVec3, UVec4, Vec3, Vec4};
use lucerna::components::voxel_light::{
    CacheBuffers, FaceLight, GatherInfo, VoxelLevel, VoxelLevels, sparse_grid,
};
use lucerna::components::voxel_pyramid::{PrefilterPass, Pyramid, PyramidLayout, PyramidStorage};
use lucerna::components::voxels::VoxelGrid;
use lucerna::gpu::{Bindings, ComputeKernel, Dispatch, Shaders};
use lucerna::gpu_scene::{GpuScene, GpuSceneOptions};
use lucerna::scene::{Instance, Light, Material, Mesh, Scene, Sky};
use lucerna::seam::SceneSeam;
use lucerna::settings;
use lucerna::shader::Variant;
use std::f64::consts::PI;

const LEVEL: u32 = 1;
/// Records behind the last.
const N_GUARDS: usize = 7;

/// +X −X +Y −Y +Z −Z.
fn axis_of(face: usize) -> DVec3 {
    let sign = if face.is_multiple_of(2) { 1.0 } else { -1.0 };
    DVec3::AXES[face / 2] * sign
}

/// Two levels, of which the second one is looked at.
struct Faces {
    buffers: CacheBuffers,
    grid: VoxelGrid,
    /// By slot.
    cells: Vec<UVec3>,
    first_record: usize,
    /// Of both levels, and the guards.
    n_records: usize,
    n_faces: usize,
}

impl Faces {
    fn new(origin: Vec3, cell: f32, size: UVec3, n_faces: u32, cells: &[UVec3]) -> Self {
        let others = [UVec3::ZERO, UVec3::ONE, UVec3::new(3, 1, 2)];
        let (other, other_words) =
            sparse_grid(Vec3::splat(90.0), 1.0, UVec3::splat(4), n_faces, &others);
        let (grid, words) = sparse_grid(origin, cell, size, n_faces, cells);
        let first_record = others.len() * n_faces as usize;
        let mut layout = VoxelLevels::zeroed();
        layout.n_levels = 2;
        layout.levels[0] = settings!(VoxelLevel { grid: other, ..Zeroable::zeroed() });
        layout.levels[1] = settings!(VoxelLevel {
            grid,
            first_brick: other_words.len() as u32,
            first_record: first_record as u32,
            first_side: (other_words.len() + words.len()) as u32,
            ..Zeroable::zeroed()
        });
        let slots = &words[grid.bricks.element_product() as usize..];
        let cells: Vec<_> =
            slots.iter().map(|&[c, _]| UVec3::new(c & 1023, c >> 10 & 1023, c >> 20)).collect();
        let n_records = first_record + cells.len() * n_faces as usize + N_GUARDS;
        // Nothing is known of the records' sides.
        let sides = vec![[0; 2]; 2 * cells.len() * n_faces as usize];
        let all = [other_words, words, sides].concat();
        let buffers =
            CacheBuffers::new(gpu(), &layout, all.len() as u32, n_records as u32).unwrap();
        let n_voxels = [cells.len() as u32, 0, cells.len() as u32 * n_faces, 0];
        gpu().queue.write_buffer(&buffers.structure, 0, bytemuck::cast_slice(&all));
        gpu().queue.write_buffer(&buffers.counts[1], 0, bytemuck::cast_slice(&n_voxels));
        Self { buffers, grid, cells, first_record, n_records, n_faces: n_faces as usize }
    }

    /// Records of the level.
    fn n(&self) -> usize {
        self.cells.len() * self.n_faces
    }

    /// Random records for everything, and `of` each slot and face of the level.
    fn set_lights(
        &self,
        random: &mut Random,
        mut of: impl FnMut(usize, usize, &mut Random) -> FaceLight,
    ) -> Vec<FaceLight> {
        let mut lights: Vec<_> = (0..self.n_records).map(|_| random_light(random)).collect();
        for ix in 0..self.n() {
            lights[self.first_record + ix] = of(ix / self.n_faces, ix % self.n_faces, random);
        }
        gpu().queue.write_buffer(&self.buffers.lights, 0, bytemuck::cast_slice(&lights));
        lights
    }

    fn lights(&self) -> Vec<FaceLight> {
        bytemuck::pod_collect_to_vec(&read(&self.buffers.lights))
    }

    /// Dispatches a workgroup more than there are records.
    fn run<T: bytemuck::NoUninit>(&self, kernel: &ComputeKernel, info: &T, bindings: Bindings) {
        submit(|recorder| {
            kernel
                .call(&mut recorder.compute("test"))
                .uniform("info", info)
                .with(self.buffers.of_level(LEVEL))
                .with(bindings)
                .dispatch(Dispatch::Items(self.n() as u32 + 64));
        });
    }

    /// Fails if anything but the level's records differs.
    fn check_others(&self, what: &str, before: &[FaceLight], after: &[FaceLight]) {
        for (ix, (before, after)) in before.iter().zip(after).enumerate() {
            let is_other = ix < self.first_record || ix >= self.first_record + self.n();
            assert!(
                !is_other || bytemuck::bytes_of(before) == bytemuck::bytes_of(after),
                "{what}: record {ix} is not the level's ({}..{}), and changed from {before:?} to {after:?}",
                self.first_record,
                self.first_record + self.n()
            );
        }
    }
}

fn random_light(random: &mut Random) -> FaceLight {
    let n_rays = random.range(1.0, 400.0).floor();
    FaceLight {
        direct: color(random),
        n_hits: (random.unit() * n_rays).ceil(),
        indirect: color(random),
        n_rays,
        feedback: color(random),
        state: random.bits() as u32 & 0xffff,
    }
}

fn every_cell(size: UVec3) -> Vec<UVec3> {
    let n = size.element_product();
    (0..n).map(|ix| UVec3::new(ix % size.x, ix / size.x % size.y, ix / (size.x * size.y))).collect()
}

fn some_cells(random: &mut Random, size: UVec3, share: f32) -> Vec<UVec3> {
    every_cell(size).into_iter().filter(|_| random.unit() < share).collect()
}

/// The largest finite component of a level's irradiances, 0 if all are below; records of other levels and behind the last
/// do not count. Exact.
#[test]
fn peak_is_the_largest_of_the_levels_irradiances() {
    let kernel = ComputeKernel::new(gpu(), &Shaders::default(), None, "voxel_pyramid/peak");
    let mut random = Random(81);
    let size = UVec3::new(9, 6, 5);
    for (case, cells) in [
        vec![],
        vec![UVec3::new(8, 5, 4)],
        some_cells(&mut random, size, 0.04),
        some_cells(&mut random, size, 0.6),
        every_cell(size),
    ]
    .iter()
    .enumerate()
    {
        for n_faces in [1, 6] {
            let faces = Faces::new(Vec3::ZERO, 1.0, size, n_faces, cells);
            let own = faces.first_record..faces.first_record + faces.n();
            let mut expected = 0.0f32;
            let irradiance: Vec<Vec4> = (0..faces.n_records)
                .map(|ix| {
                    let mut light =
                        (color(&mut random) * 2f32.powf(random.range(-9.0, 9.0))).extend(1e30);
                    if case == 2 {
                        light *= -1.0;
                    }
                    match random.bits() % 12 {
                        0 => light.y = f32::NAN,
                        1 => light.z = f32::INFINITY,
                        2 => light.x = -light.x,
                        _ if !own.contains(&ix) => light *= 1e6,
                        _ => {}
                    }
                    let rgb = light.truncate();
                    if own.contains(&ix) && rgb.is_finite() {
                        expected = expected.max(rgb.max_element());
                    }
                    light
                })
                .collect();
            let irradiance = storage(bytemuck::cast_slice(&irradiance));
            let peak = storage(bytemuck::cast_slice(&[0u32, 0xabcd, 0xabcd, 0xabcd]));
            let bound = vec![("irradiance", (&irradiance).into()), ("peak", (&peak).into())];
            faces.run(&kernel, &UVec4::new(LEVEL, 0, 0, 0), bound);
            let found: [u32; 4] = bytemuck::pod_read_unaligned(&read(&peak));
            let (value, guards) = (f32::from_bits(found[0]), &found[1..]);
            let what = format!("{} voxels of {n_faces} faces", cells.len());
            assert_eq!(value, expected, "{what}: largest finite component");
            assert_eq!(guards, [0xabcd; 3], "{what}: words behind the result");
        }
    }
}

/// A record of attributes, packed by hand.
fn packed_face(albedo: UVec3, is_back: bool, normal: Vec3, coverage: u32) -> UVec4 {
    // For an axis, the octahedron's point is the axis itself, or (at −Z) its outer corner.
    let sum = normal.abs().element_sum();
    let mut at = normal.truncate() / sum;
    if normal.z < 0.0 {
        let fold = |a: f32, b: f32| (1.0 - b.abs()) * if a >= 0.0 { 1.0 } else { -1.0 };
        at = glam::Vec2::new(fold(at.x, at.y), fold(at.y, at.x));
    }
    let word = |v: f32| (v * 32767.0).round() as i32 as u32 & 0xffff;
    let bits = albedo.x | albedo.y << 10 | albedo.z << 20 | 1 << 30 | u32::from(is_back) << 31;
    UVec4::new(bits, word(at.x) | word(at.y) << 16, 0, coverage | 0xffff << 16)
}

/// `voxel_pyramid/fill` against f64: a texel is (τ·ρE/π·scale, τ) with the depth τ = −ln(1 − coverage), at most 3.25; a
/// cell without a surface takes the mean of the opposite neighbours along each other axis that both have one; backs are
/// open or not; light is scaled to the peak; where a floor of half a cell ends at a wall of half a cell, both are opaque.
/// A 16-bit float is good to 2⁻¹⁰, ln(1 − a) loses up to 26 · 1e-6.
#[test]
fn fill_writes_light_and_depth_of_every_face() {
    let mut random = Random(82);
    for (case, size) in [UVec3::new(8, 4, 2), UVec3::new(7, 5, 3), UVec3::ONE, UVec3::new(13, 1, 4)]
        .into_iter()
        .enumerate()
    {
        for n_faces in [1u32, 6] {
            let storage_kind = [PyramidStorage::Buffers, PyramidStorage::Textures][case % 2];
            let (fills_gaps, backs_hide) =
                (u32::from(case < 2), u32::from((n_faces == 6) != (case % 2 == 1)));
            let cells = some_cells(&mut random, size, if case == 2 { 2.0 } else { 0.6 });
            let faces = Faces::new(Vec3::ZERO, 1.0, size, n_faces, &cells);
            let records: Vec<UVec4> = (0..faces.n() + N_GUARDS)
                .map(|_| {
                    let albedo = UVec3::splat(random.bits() as u32) >> UVec3::new(0, 10, 20) & 1023;
                    let coverage =
                        [0, 65535, random.bits() as u32 & 0xffff][random.bits() as usize % 3];
                    let is_back = random.unit() < 0.3;
                    let face = packed_face(albedo, is_back, random.direction(), coverage);
                    if random.unit() < 0.2 { UVec4::ZERO } else { face }
                })
                .collect();
            let light: Vec<Vec4> = (0..faces.n_records)
                .map(|ix| {
                    let found = (color(&mut random) * 40.0).extend(1.0);
                    if ix % 11 == 5 { found.with_x(f32::NAN) } else { found }
                })
                .collect();
            // No ray hit anything, so no corner is closed.
            faces.set_lights(&mut random, |_, _, random| FaceLight {
                n_hits: 0.0,
                ..random_light(random)
            });
            let peak = [0.0f32, 40.0, 3e-3, 7e5][case];
            let scale = if peak == 0.0 { 1.0 } else { 2f64.powi(13 - peak.log2().floor() as i32) };
            let found =
                filled(&faces, &records, &light, fills_gaps, backs_hide, peak, storage_kind);

            let slot = |cell: glam::IVec3| faces.cells.iter().position(|of| of.as_ivec3() == cell);
            let texel_of = |slot: usize, face: usize| -> DVec4 {
                let record = records[slot * n_faces as usize + face];
                let (is_valid, is_back) = (record.x >> 30 & 1 == 1, record.x >> 31 == 1);
                if !is_valid || is_back && backs_hide == 0 {
                    return DVec4::ZERO;
                }
                let albedo =
                    (UVec3::splat(record.x) >> UVec3::new(0, 10, 20) & 1023).as_dvec3() / 1023.0;
                let received = light[faces.first_record + slot * n_faces as usize + face];
                let mut radiance = albedo / PI * received.truncate().as_dvec3() * scale;
                if !radiance.is_finite() {
                    radiance = DVec3::ZERO;
                }
                let coverage = f64::from(record.w & 0xffff) / 65535.0;
                let depth = (-(1.0 - coverage).ln()).min(3.25);
                (radiance * depth).min(DVec3::splat(65504.0)).extend(depth)
            };
            for (cell, face) in every_cell(size)
                .into_iter()
                .flat_map(|cell| (0..n_faces as usize).map(move |f| (cell, f)))
            {
                let mut expected =
                    slot(cell.as_ivec3()).map_or(DVec4::ZERO, |slot| texel_of(slot, face));
                if expected.w == 0.0 && fills_gaps != 0 {
                    let (mut sum, mut n) = (DVec4::ZERO, 0.0);
                    for axis in (0..3).filter(|&axis| axis != face / 2) {
                        let step = glam::IVec3::AXES[axis];
                        let pair = [cell.as_ivec3() - step, cell.as_ivec3() + step]
                            .map(|at| slot(at).map_or(DVec4::ZERO, |slot| texel_of(slot, face)));
                        if pair[0].w > 0.0 && pair[1].w > 0.0 {
                            sum += 0.5 * (pair[0] + pair[1]);
                            n += 1.0;
                        }
                    }
                    expected = if n > 0.0 { sum / n } else { DVec4::ZERO };
                }
                let found = found(cell, face as u32);
                // Half floats below 6e-5 have fixed steps of 6e-8; textures may round down.
                let bound =
                    expected.abs() * 1.1e-3 + 1e-4 * expected.w.min(1.0) * expected.abs() + 1e-7;
                assert!(
                    (found - expected).abs().cmple(bound).all(),
                    "{size}, {n_faces} faces, gaps {fills_gaps}, backs {backs_hide}, {storage_kind:?}: face {face} of cell {cell} is {found}, expected {expected} to {bound}"
                );
            }
        }
    }

    // A floor under the lower half of a cell, and a wall behind its half: each covers all that the other leaves open.
    let faces = Faces::new(Vec3::ZERO, 1.0, UVec3::splat(3), 6, &[UVec3::ONE]);
    let records: Vec<UVec4> = (0..6 + N_GUARDS)
        .map(|face| {
            let coverage = if face == 0 || face == 2 { 0x8000 } else { 0 };
            let face = packed_face(UVec3::splat(512), face == 1 || face == 3, Vec3::X, coverage);
            if coverage == 0 { UVec4::ZERO } else { face }
        })
        .collect();
    let light = vec![Vec4::ONE; faces.n_records];
    for (depths, expected) in [([128, 128], 3.25), ([0, 128], 2f64.ln()), ([255, 255], 2f64.ln())] {
        faces.set_lights(&mut random, |_, face, _| FaceLight {
            n_hits: 4.0,
            n_rays: 8.0,
            state: if face < 4 { depths[face / 2] } else { 0 },
            ..FaceLight::zeroed()
        });
        let found = filled(&faces, &records, &light, 0, 0, 1.0, PyramidStorage::Buffers);
        for face in [0, 2] {
            let depth = found(UVec3::ONE, face).w;
            let what = format!("a corner with depths {depths:?} of 255");
            assert!(
                (depth - expected).abs() < 3e-3,
                "{what}: face {face} is {depth} deep, expected {expected:.4}"
            );
        }
    }
}

/// Runs `voxel_pyramid/fill`; returns its texels by cell and face.
fn filled(
    faces: &Faces,
    records: &[UVec4],
    light: &[Vec4],
    fills_gaps: u32,
    backs_hide: u32,
    peak: f32,
    storage_kind: PyramidStorage,
) -> impl Fn(UVec3, u32) -> DVec4 + use<> {
    let small = VoxelGrid { size: UVec3::splat(4), bricks: UVec3::new(1, 1, 2), ..faces.grid };
    let pyramid = Pyramid::new(gpu(), &[small, faces.grid], storage_kind, false).unwrap();
    let at = std::mem::offset_of!(PyramidLayout, peak) as u64;
    gpu().queue.write_buffer(pyramid.uniform(), at, &peak.to_bits().to_le_bytes());
    for level in 0..2 {
        pyramid.write_base(gpu(), level, |_, _| [-7.25; 4]);
    }
    let shaders = Shaders::new(pyramid.variant(Variant::BASELINE));
    let kernel = ComputeKernel::new(gpu(), &shaders, None, "voxel_pyramid/fill");
    let (records, light) =
        (storage(bytemuck::cast_slice(records)), storage(bytemuck::cast_slice(light)));
    let view = pyramid.texture(0).map(|texture| texture.create_view(&Default::default()));
    let mut volume: Bindings = vec![("filled", pyramid.uniform().into())];
    if let Some(buffer) = pyramid.buffer() {
        volume.push(("filled_texels", buffer.into()));
    }
    if let Some(view) = &view {
        volume.push(("target_volume", view.into()));
    }
    submit(|recorder| {
        kernel
            .call(&mut recorder.compute("test"))
            .uniform("info", &UVec4::new(LEVEL, fills_gaps, backs_hide, 0))
            .with(faces.buffers.of_level(LEVEL))
            .bind("records", &records)
            .bind("irradiance", &light)
            .with(volume)
            .dispatch(Dispatch::Box(faces.grid.size + 1));
    });
    let layout = *pyramid.layout();
    let texels = crate::cone::texels_of(&pyramid, 0);
    let (size, mips) = (layout.volume_base, layout.mips);
    // The first level's texels stay.
    let first = mips[0].first;
    let other = ((first.z * size.y + first.y) * size.x + first.x) as usize;
    assert_eq!(texels[other], [-7.25; 4], "a texel of the other level");
    move |cell, face| {
        let entry = mips[9];
        let place = entry.first + cell + UVec3::new(0, 0, face * entry.stride);
        texels[((place.z * size.y + place.y) * size.x + place.x) as usize].into()
    }
}

#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
struct BounceInfo {
    step_scale: f32,
    mip_bias: f32,
    opacity_threshold: f32,
    start_cells: f32,
    n_cones: u32,
    level: u32,
    frame: u32,
    period: u32,
    settled_period: u32,
    reserved: [u32; 3],
}

/// `voxel_cone/bounce` in a cube of 8 m that a thin medium of radiance 1 fills: a face finds π·(1 − e^(−τ)) over the way to the
/// cube's border (`cones_find_the_depth_of_their_way`), by quadrature in f64, from where its surface is: as deep below
/// the face as its rays found. The mean over 8 times 9 cones and all voxels of a layer, within 2 %; of one voxel within
/// 10 %. One of `period` frames updates a face; it keeps its other numbers; faces without surfaces or hits stay.
#[test]
fn bounces_find_the_depth_from_their_surface_on() {
    let mut random = Random(83);
    let depth = 0.03f32;
    let density = f64::from(depth) / 0.25;
    let volume = VoxelGrid {
        origin: Vec3::splat(-4.0),
        cell: 0.25,
        size: UVec3::splat(32),
        n_faces: 1,
        bricks: UVec3::new(8, 8, 16),
        capacity: 1,
    };
    // The medium is the same for every direction; the faces are six, or one.
    let pyramid = Pyramid::new(gpu(), &[volume], PyramidStorage::Textures, false).unwrap();
    pyramid.write_base(gpu(), 0, |_, _| [depth; 4]);
    let pass = PrefilterPass::new(gpu(), &pyramid);
    submit(|recorder| pass.record(recorder, &pyramid));
    let shaders = Shaders::new(pyramid.variant(Variant::BASELINE));
    let kernel = ComputeKernel::new(gpu(), &shaders, None, "voxel_cone/bounce");
    const PERIOD: u32 = 3;
    const N_ROUNDS: u32 = 8;
    for n_faces in [1, 6usize] {
        let size = UVec3::new(6, 5, 6);
        let (origin, cell) = (Vec3::new(-3.0, -2.5, -3.0), 1.0);
        let cells: Vec<_> = every_cell(size).into_iter().filter(|c| c.x == 1 || c.x == 4).collect();
        let faces = Faces::new(origin, cell, size, n_faces as u32, &cells);
        let normal_of = |face: usize| if n_faces == 6 { axis_of(face) } else { DVec3::X };
        let is_invalid: Vec<bool> = (0..faces.n()).map(|_| random.unit() < 0.1).collect();
        let records: Vec<UVec4> = (0..faces.n() + N_GUARDS)
            .map(|ix| {
                let normal = normal_of(ix % n_faces).as_vec3();
                let face = packed_face(UVec3::splat(512), false, normal, 0xffff);
                if is_invalid.get(ix).is_some_and(|&is| is) { UVec4::ZERO } else { face }
            })
            .collect();
        // Near the face in even layers, far below it in odd ones.
        let below = |slot: usize| if faces.cells[slot].x == 1 { 0.0 } else { 1.0 };
        let before = faces.set_lights(&mut random, |slot, _, random| FaceLight {
            n_hits: if random.unit() < 0.1 { 0.0 } else { 5.0 },
            state: 0xff00 | (255.0 * below(slot)) as u32,
            ..random_light(random)
        });
        let records = storage(bytemuck::cast_slice(&records));
        let mut n_updates = vec![0; faces.n()];
        let mut known = before.clone();
        let mut sums = vec![0.0; faces.n()];
        for frame in 10..10 + N_ROUNDS * PERIOD {
            let info = BounceInfo {
                step_scale: 0.5,
                mip_bias: 0.0,
                opacity_threshold: 0.95,
                start_cells: 1.0,
                n_cones: 9,
                level: LEVEL,
                frame,
                period: PERIOD,
                // (The light has not settled: `levels` says so.)
                settled_period: 1000,
                reserved: [0; 3],
            };
            let mut bound = pyramid.field();
            bound.push(("records", (&records).into()));
            faces.run(&kernel, &info, bound);
            let after = faces.lights();
            faces.check_others("bounce", &before, &after);
            for ix in 0..faces.n() {
                let (old, new) = (&known[faces.first_record + ix], &after[faces.first_record + ix]);
                if old.indirect != new.indirect {
                    n_updates[ix] += 1;
                    sums[ix] += f64::from(new.indirect.y);
                }
            }
            known = after;
        }
        assert_eq!(read(&faces.buffers.faults)[..8], [0; 8], "faults");
        let mut groups = std::collections::BTreeMap::<(usize, u32), (f64, f64, f64)>::new();
        for (ix, &n) in n_updates.iter().enumerate() {
            let (slot, face) = (ix / n_faces, ix % n_faces);
            let (old, new) = (&before[faces.first_record + ix], &known[faces.first_record + ix]);
            let what = format!("face {face} of {n_faces}, cell {}", faces.cells[slot]);
            let rest = |of: &FaceLight| (of.direct, of.n_hits, of.n_rays, of.state);
            assert_eq!(rest(old), rest(new), "{what}: direct light, hits, rays, state");
            if is_invalid[ix] || old.n_hits == 0.0 {
                let light = |of: &FaceLight| (of.indirect, of.feedback);
                assert_eq!(light(old), light(new), "{what} has no surface");
                continue;
            }
            assert_eq!(n, N_ROUNDS, "{what}: updates in {N_ROUNDS} times {PERIOD} frames");
            assert_eq!(new.indirect, new.feedback, "{what}: what bounces read");
            let normal = normal_of(face);
            let mut place = origin.as_dvec3() + faces.cells[slot].as_dvec3() + 0.5;
            if n_faces == 6 {
                place += normal * (0.5 - below(slot));
            }
            let start = place + 0.25 * normal;
            let seen = |d: DVec3| 1.0 - (-density * way_out_of_cube(start, d)).exp();
            let expected = PI * over_hemisphere(normal, 40, seen);
            let found = sums[ix] / f64::from(N_ROUNDS);
            assert!(
                (found / expected - 1.0).abs() < 0.1,
                "{what}: {found}, expected {expected} to 10 %"
            );
            let group = groups.entry((face, faces.cells[slot].x)).or_default();
            group.0 += found;
            group.1 += expected;
            group.2 += 1.0;
        }
        for ((face, layer), (found, expected, n)) in groups {
            let off = found / expected - 1.0;
            println!("{n_faces} faces, face {face}, layer {layer}: {off:+.4} of {n} voxels");
            assert!(
                off.abs() < 0.02,
                "face {face} of {n_faces}, layer {layer}: {:.4}, expected {:.4} to 2 %",
                found / n,
                expected / n
            );
        }
    }
}

/// `voxel_light/deposit`: direct light is the mean over the frames that deposited something, of those that saw the light as
/// it is; all other numbers stay. f64; 4 roundings.
#[test]
fn deposits_are_averaged_face_by_face() {
    let kernel = ComputeKernel::new(gpu(), &Shaders::default(), None, "voxel_light/deposit");
    let mut random = Random(84);
    let size = UVec3::new(9, 6, 5);
    for (case, cells) in
        [vec![], vec![UVec3::new(8, 5, 4)], some_cells(&mut random, size, 0.5), every_cell(size)]
            .iter()
            .enumerate()
    {
        for n_faces in [1, 6] {
            let faces = Faces::new(Vec3::ZERO, 1.0, size, n_faces, cells);
            let before = faces.set_lights(&mut random, |_, _, random| {
                let n_deposits = [0, 1, 7, 0x3fff][random.bits() as usize % 4];
                FaceLight {
                    state: random.bits() as u32 & 0xffff | n_deposits << 16,
                    ..random_light(random)
                }
            });
            let light_frames = [1, 4, 9, 100_000][case];
            let means: Vec<Vec4> =
                (0..faces.n() + N_GUARDS)
                    .map(|_| {
                        if random.unit() < 0.4 {
                            Vec4::ZERO
                        } else {
                            color(&mut random).extend(3.0)
                        }
                    })
                    .collect();
            let buffer = storage(bytemuck::cast_slice(&means));
            let info = UVec4::new(LEVEL, light_frames, 0, 0);
            faces.run(&kernel, &info, vec![("means", (&buffer).into())]);
            let after = faces.lights();
            faces.check_others("deposit", &before, &after);
            for ix in 0..faces.n() {
                let (old, new) =
                    (&before[faces.first_record + ix], &after[faces.first_record + ix]);
                let n_known = (old.state >> 16 & 0x3fff).min(light_frames - 1).min(0x3ffe);
                let n_new = u32::from(means[ix].w > 0.0);
                let known = old.direct.as_dvec3() * f64::from(n_known);
                let sum = known + means[ix].truncate().as_dvec3() * f64::from(n_new);
                let expected = sum / f64::from((n_known + n_new).max(1));
                let what =
                    format!("{} voxels, record {ix}, {light_frames} frames, {old:?}", cells.len());
                let off = (new.direct.as_dvec3() - expected).largest();
                assert!(off < 5e-7, "{what}: direct {}, expected {expected} to 5e-7", new.direct);
                let state = old.state & 0xffff | (n_known + n_new) << 16;
                assert_eq!(new.state, state, "{what}: state");
                let rest = |of: &FaceLight| (of.n_hits, of.indirect, of.n_rays, of.feedback);
                assert_eq!(rest(new), rest(old), "{what}: what is not direct");
            }
        }
    }
}

/// A square of this half side at a height, up or down.
fn plane(half: f32, y: f32, up: bool, material: usize) -> Mesh {
    let corners = [[-half, -half], [-half, half], [half, half], [half, -half]];
    let mut positions: Vec<_> = corners.iter().map(|&[x, z]| Vec3::new(x, y, z)).collect();
    if !up {
        positions.reverse();
    }
    Mesh { positions, triangles: vec![[0, 1, 2], [0, 2, 3]], material, ..Mesh::default() }
}

fn world_of(meshes: Vec<Mesh>, materials: Vec<Material>) -> Scene {
    let instance = |mesh| Instance { mesh, world_from_object: glam::Affine3A::IDENTITY };
    let instances = (0..meshes.len()).map(instance).collect();
    Scene { meshes, instances, materials, ..Scene::default() }
}

fn lambert(albedo: f32) -> Material {
    Material { base_color: Vec3::splat(albedo).extend(1.0), roughness: 1.0, ..Material::default() }
}

/// `voxel_light/gather` over a floor in the first layer of voxels, under a ceiling that reflects what the cache holds, the
/// same everywhere in 16 m × 16 m, and with a sun: each face finds the surface as deep as it is; direct light of the
/// sun, E·cosθ; indirect light ρ·C times the share of the hemisphere that the ceiling's lit part fills, by quadrature,
/// and with a second bounce what it reflects in turn. 1024 points of a scrambled net a face: 2 %; with one value a voxel a
/// sixth of them, and no net: 5 standard errors are 12 %. Means over the floor 1 %. Sides find nothing, the floor's back is dark. What deposits find stays; without bounces, what others found stays.
#[test]
fn faces_gather_what_their_surfaces_see() {
    let (floor_at, ceiling_at) = (0.3f32, 2.7f32);
    let (floor_albedo, ceiling_albedo) = (0.5f32, 0.8f32);
    // Floor and ceiling are far wider than the voxels: their light is that of the cache, and so black outside.
    let mut world = world_of(
        vec![plane(100.0, floor_at, true, 0), plane(8.0, ceiling_at, false, 1)],
        vec![lambert(floor_albedo), lambert(ceiling_albedo)],
    );
    // Slanted, so that the ceiling does not shade the floor's middle.
    let direction = Vec3::new(-12.0, -1.0, 0.0).normalize();
    world.lights.push(Light::Directional { direction, irradiance: Vec3::new(6.0, 3.0, 1.5) });
    let scene = GpuScene::new(
        gpu(),
        &world,
        settings!(GpuSceneOptions { diffuse_only: true, ..Default::default() }),
    )
    .unwrap();
    let kernel =
        ComputeKernel::new(gpu(), scene.shaders(), Some(scene.group()), "voxel_light/gather");
    let mut random = Random(85);
    let size = UVec3::new(16, 3, 16);
    let origin = Vec3::new(-8.0, 0.0, -8.0);
    let cached = 2.0;
    for n_faces in [1usize, 6] {
        // The floor's layer, and the ceiling's.
        let cells: Vec<_> = every_cell(size).into_iter().filter(|cell| cell.y != 1).collect();
        let faces = Faces::new(origin, 1.0, size, n_faces as u32, &cells);
        let light = vec![Vec4::new(cached, 0.5 * cached, 0.25 * cached, 1.0); faces.n_records];
        gpu().queue.write_buffer(&faces.buffers.reflected, 0, bytemuck::cast_slice(&light));
        for (n_bounces, finds_direct) in [(1, 1), (2, 1), (1, 0), (0, 1)] {
            let before = faces.set_lights(&mut random, |_, _, random| FaceLight {
                n_rays: 0.0,
                n_hits: 0.0,
                state: random.bits() as u32 & 0x3fff_0000,
                ..random_light(random)
            });
            // In four frames: some drivers bound loops.
            const N_POINTS: u32 = 1024;
            for frame in 0..4 {
                let info = GatherInfo {
                    frame,
                    seed: 5,
                    n_points: N_POINTS / 4,
                    n_bounces,
                    light_rays: N_POINTS as f32,
                    max_rays: N_POINTS as f32,
                    level: LEVEL,
                    finds_direct,
                };
                gather(&kernel, &scene, &faces, &info);
            }
            let after = faces.lights();
            faces.check_others("gather", &before, &after);
            let (mut found_sum, mut expected_sum) = (0.0, 0.0);
            for ix in 0..faces.n() {
                let (cell, face) = (faces.cells[ix / n_faces], ix % n_faces);
                let middle = origin.as_dvec3() + cell.as_dvec3() + 0.5;
                // Away from the border, where look-ups mix with cells that are not there.
                if cell.y != 0 || middle.x.abs().max(middle.z.abs()) > 3.0 {
                    continue;
                }
                let (old, new) =
                    (&before[faces.first_record + ix], &after[faces.first_record + ix]);
                let what = format!(
                    "{n_bounces} bounces, direct {finds_direct}, face {face} of {n_faces}, cell {cell}: {new:?}"
                );
                let n_rays = f64::from(N_POINTS);
                let near = |found: f32, expected: f64, bound: f64, quantity: &str| {
                    let off = (f64::from(found) - expected).abs();
                    assert!(
                        off <= bound,
                        "{what}: {quantity} {found}, expected {expected:.5} to {bound:.5}"
                    );
                };
                let sees_floor = n_faces == 1 || face == 2;
                let (hits, share) = if n_faces == 1 { (n_rays / 6.0, 2.0) } else { (n_rays, 1e-3) };
                if !sees_floor {
                    // From below, the floor's back: a surface as well, but nothing shines on it, so it is sampled in turn.
                    let expected = if face == 3 { new.n_rays } else { 0.0 };
                    assert_eq!(new.n_hits, expected, "{what}: hits");
                    assert!(new.n_rays >= n_rays as f32 / 4.0, "{what}: rays");
                    continue;
                }
                near(new.n_rays, n_rays, 1e-3, "rays");
                near(new.n_hits, hits, share, "hits");
                near((new.state & 255) as f32, 255.0 * 0.7, 0.51, "depth in 255ths");
                let sun = -f64::from(direction.y);
                for (k, scale) in [(0, 1.0), (1, 0.5), (2, 0.25)] {
                    if finds_direct != 0 {
                        near(new.direct[k], 6.0 * sun * scale, 1e-3, "direct light");
                        assert_eq!(new.state >> 16, 0, "{what}: deposits");
                    } else {
                        near(new.direct[k], old.direct[k].into(), 0.0, "deposited light");
                        assert_eq!(new.state >> 16, old.state >> 16, "{what}: deposits");
                    }
                    if n_bounces == 0 {
                        near(
                            new.indirect[k],
                            old.indirect[k].into(),
                            0.0,
                            "indirect light of others",
                        );
                        near(new.feedback[k], old.feedback[k].into(), 0.0, "feedback of others");
                        continue;
                    }
                    let first = ceiling_share(middle, f64::from(ceiling_at - floor_at), 8.0);
                    let (down, up) = (f64::from(ceiling_albedo), f64::from(floor_albedo));
                    let mut expected = down * first;
                    if n_bounces == 2 {
                        // The ceiling sees the lit part of the floor; near its middle as the floor sees it.
                        expected += down * up * first * second_share();
                    }
                    let expected = expected * f64::from(cached) * scale;
                    let bound = if n_faces == 1 { 0.12 } else { 0.02 } * expected;
                    near(new.indirect[k], expected, bound, "indirect light");
                    // Of the last quarter of the rays.
                    near(new.feedback[k], expected, 2.0 * bound, "feedback");
                    found_sum += f64::from(new.indirect[k]);
                    expected_sum += expected;
                }
            }
            let off = found_sum / expected_sum - 1.0;
            let what = format!("{n_bounces} bounces, direct {finds_direct}, {n_faces} faces");
            println!("{what}: mean of indirect light {off:+.4}");
            assert!(
                n_bounces == 0 || off.abs() < 0.01,
                "{what}: mean of indirect light over the floor is off by {off:+.4}, expected 0 to 0.01"
            );
        }
    }
}

fn gather(kernel: &ComputeKernel, scene: &GpuScene, faces: &Faces, info: &GatherInfo) {
    submit(|recorder| {
        kernel
            .call(&mut recorder.compute("test"))
            .scene(scene.group())
            .uniform("info", info)
            .with(faces.buffers.of_level(LEVEL))
            .with(faces.buffers.field(&faces.buffers.reflected))
            .dispatch(Dispatch::Items(faces.n() as u32 + 64));
    });
}

/// The cosine-weighted share of the hemisphere over a point that a square of half side `half` around the axis fills at a
/// height: four corners' form factors (J. Howell, "A Catalog of Radiation Heat Transfer Configuration Factors", B-3).
fn ceiling_share(at: DVec3, height: f64, half: f64) -> f64 {
    let corner = |a: f64, b: f64| {
        let (a, b) = (a / height, b / height);
        let one = |a: f64, b: f64| a / (1.0 + a * a).sqrt() * (b / (1.0 + a * a).sqrt()).atan();
        (one(a, b) + one(b, a)) / (2.0 * PI)
    };
    [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)]
        .into_iter()
        .map(|(sx, sz)| corner(half - sx * at.x, half - sz * at.z))
        .sum()
}

/// Of what the ceiling sends down, the share that comes from the floor's lit 16 m × 16 m: nearly all that the floor's
/// middle sees of the ceiling is within 5 m.
fn second_share() -> f64 {
    ceiling_share(DVec3::new(2.0, 0.0, 2.0), 2.4, 8.0)
}

/// Faces that are known and dark take turns: each is sampled in one of 16 frames; lit or new ones in all, but in one of 4 if the light
/// has settled, there are 64 rays, and only direct light is sampled.
#[test]
fn dark_faces_are_sampled_in_turn() {
    let scene = GpuScene::new(
        gpu(),
        &Scene {
            sky: Sky::Constant(Vec3::ZERO),
            ..world_of(vec![plane(9.0, 0.3, true, 0)], vec![lambert(0.5)])
        },
        GpuSceneOptions::default(),
    )
    .unwrap();
    let kernel =
        ComputeKernel::new(gpu(), scene.shaders(), Some(scene.group()), "voxel_light/gather");
    let mut random = Random(86);
    let size = UVec3::new(7, 2, 9);
    let faces = Faces::new(Vec3::new(-3.0, 0.0, -4.0), 1.0, size, 6, &every_cell(size));
    let at = std::mem::offset_of!(VoxelLevels, is_settled) as u64;
    for (light_rays, is_lit, n_known, is_settled, n_bounces, expected) in [
        (100.0, false, 16.0, 0u32, 1, 1),
        (100.0, true, 16.0, 0, 1, 16),
        (100.0, false, 15.0, 0, 1, 16),
        (15.0, false, 400.0, 0, 1, 16),
        (100.0, true, 64.0, 0, 0, 16),
        (100.0, true, 64.0, 1, 0, 4),
        (100.0, true, 63.0, 1, 0, 16),
        (100.0, true, 64.0, 1, 1, 16),
        (100.0, false, 64.0, 1, 0, 1),
    ] {
        gpu().queue.write_buffer(&faces.buffers.levels, at, bytemuck::bytes_of(&is_settled));
        let mut n_updates = vec![0u32; faces.n()];
        for frame in 0..16 {
            faces.set_lights(&mut random, |_, _, _| FaceLight {
                n_rays: n_known,
                direct: Vec3::new(0.0, 0.0, if is_lit { 1e-3 } else { 0.0 }),
                ..FaceLight::zeroed()
            });
            let info = GatherInfo {
                frame,
                seed: 1,
                n_points: 1,
                n_bounces,
                light_rays,
                max_rays: 1e4,
                level: LEVEL,
                finds_direct: 1,
            };
            gather(&kernel, &scene, &faces, &info);
            let after = faces.lights();
            for (n, light) in n_updates.iter_mut().zip(&after[faces.first_record..]) {
                *n += u32::from(light.n_rays != n_known);
            }
        }
        let what = format!(
            "lit: {is_lit}, {n_known} rays, {light_rays} of today's light, settled: {is_settled}, {n_bounces} bounces"
        );
        assert!(
            n_updates.iter().all(|&n| n == expected),
            "{what}: updates in 16 frames are {n_updates:?}, expected {expected} each"
        );
    }
}
