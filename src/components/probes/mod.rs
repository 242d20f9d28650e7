// SPDX-License-Identifier: MIT OR Apache-2.0
//! Light probes at the corners of the cells that surfaces meet: spherical harmonics of the light that arrives, and how far each
//! probe sees.
//!
//! ```text
//! Voxelizer ──cells──▶ probes/mark, mark_air ──▶ Occupancy ──lattice──▶ probes/place, probes/distances
//!  when something moved                           a slot for each corner   out of walls; how far each sees
//!                                                                             │
//!                      fields::probes ◀──light── probes/pack ◀──gathered── probes/gather
//!                       pixels                    in a basis               paths, until there are enough
//! ```
//!
//! Light-probe volumes (2016) place probes so (`docs/techniques/probe-volume.md`). Probes are found by the rank of their bit,
//! so no table from cells to probes is kept.

#[cfg(feature = "bake")]
mod bake;
mod settings;

use crate::bindings::kernels::probes::blend::BlendInfo;
use crate::bindings::kernels::probes::gather::GatherInfo;
use crate::bindings::kernels::probes::pack::PackInfo;
use crate::bindings::kernels::probes::place::PlaceInfo;
use crate::bindings::lucerna::components::probes::air::{MIDDLE_STRIDE, WIDE_STRIDE};
use crate::bindings::lucerna::fields::probes::Probes as ProbesUniform;
use crate::components::voxels::{
    BRICK, MAX_BINDING, Occupancy, RECORD_GROUPS_OFFSET, Resolution, Triangles,
    VOXEL_GROUPS_OFFSET, VoxelError, VoxelGrid, Voxelizer, grid_for_bounds, n_bricks,
};
use crate::gpu::{
    Bindings, ComputeKernel, Dispatch, Gpu, Recorder, Shaders, buffer, storage_buffer,
};
use crate::report::{Notice, Stat};
use crate::seam::{Revisions, SceneSeam, check_shaders};
use crate::shader::Variant;
use glam::UVec3;

pub use crate::bindings::kernels::probes::gather::WORKGROUP as PATHS_PER_UPDATE;
pub use crate::bindings::lucerna::components::probes::gathered::COEFFICIENTS;
pub use crate::bindings::lucerna::components::probes::octahedral_map::MAP_SIDE;
#[cfg(feature = "bake")]
pub use bake::{BakeError, BakedProbe, ProbeBake};
pub use settings::{ProbeBasis, ProbeSettings, ProbeVisibility};

/// Bytes of a probe besides its light: 64 pairs of halfs, its corner and its place.
const PLACE_BYTES: u64 = 4 * (MAP_SIDE * MAP_SIDE) as u64 + 8;
/// Bytes of a probe that are needed while it gathers: nine of four f32.
const GATHERED_BYTES: u64 = 16 * COEFFICIENTS as u64;
const ADVICE: &str = "use fewer cells";
/// Of the count of probes that followed paths in the last update, in the buffer of faults.
const N_ACTIVE_OFFSET: u64 = 8;
/// There is room for this many probes, or for all corners.
const LEAST_ROOM: u32 = 4096;
/// The most that there is room for: more would need bindings above 128 MiB.
const MAX_ROOM: u32 = (MAX_BINDING / (4 * (MAP_SIDE * MAP_SIDE) as u64)) as u32;

/// Corners of cells of this stride in a lattice of this many corners along each axis.
fn n_air(size: UVec3, stride: u32) -> u32 {
    ((size - 1 + (stride - 1)) / stride + 1).element_product()
}

/// Probes of a scene. They gather light until each has followed enough paths, and anew when the scene changes.
#[derive(Debug)]
pub struct Probes {
    settings: ProbeSettings,
    shaders: Shaders,
    /// None: probes are where a bake had them.
    voxelizer: Option<Voxelizer>,
    /// Gathered light that is blended, with its weights; empty: probes gather their own.
    baked: Vec<(wgpu::Buffer, f32)>,
    /// Whether the scene has changed since baked probes, or probes at a bake's places, were first used.
    is_outdated: bool,
    /// Whether what was gathered was not packed since: the weights of bakes have changed, or it is a bake's.
    is_to_pack: bool,
    lattice: VoxelGrid,
    mark: ComputeKernel,
    mark_air: ComputeKernel,
    place_kernel: ComputeKernel,
    bits: wgpu::Buffer,
    occupancy: Occupancy,
    distances_kernel: ComputeKernel,
    gather: ComputeKernel,
    blend: ComputeKernel,
    pack: ComputeKernel,
    /// `Probes` of `fields::probes`.
    uniform: wgpu::Buffer,
    /// The lattice alone.
    lattice_uniform: wgpu::Buffer,
    gathered: wgpu::Buffer,
    light: wgpu::Buffer,
    distances: wgpu::Buffer,
    placed: wgpu::Buffer,
    faults: wgpu::Buffer,
    /// Revisions of the scene at the last update; None before the first one.
    seen: Option<Revisions>,
    n_paths: u32,
}

impl Probes {
    /// Creates the buffers and compiles the kernels, for scenes of the same variant and bounds.
    ///
    /// # Errors
    /// The grid is not possible, or a buffer is larger than the device can bind ([`VoxelError`]).
    pub fn new(
        gpu: &Gpu,
        scene: &dyn SceneSeam,
        settings: ProbeSettings,
    ) -> Result<Self, VoxelError> {
        let of = scene.facts();
        let cells = Resolution::Longest(settings.cells);
        let grid = grid_for_bounds(of.bounds_min, of.bounds_max, cells, 1, None)?;
        let size = grid.size + 1;
        let lattice = VoxelGrid {
            size,
            bricks: (size + BRICK - 1) / BRICK,
            // A cell has eight corners, but surfaces' cells share most of them: there are about two for each. And those of the air.
            capacity: size
                .element_product()
                .min((2 * grid.capacity + n_air(size, MIDDLE_STRIDE)).max(LEAST_ROOM))
                .min(MAX_ROOM),
            // Invocations for each probe.
            n_faces: MAP_SIDE * MAP_SIDE,
            ..grid
        };
        let mut made = Self::on_lattice(gpu, scene, settings, lattice)?;
        made.voxelizer = Some(Voxelizer::new(gpu, scene, grid)?);
        Ok(made)
    }

    /// Probes of one bake, or several: their light is blended ([`Self::set_weights`]), at first all of the first one. Of `settings`, those of
    /// the look-up count: basis, visibility, wrap, bias, bleeding, window.
    ///
    /// The scene may differ from that of the bake: ask [`ProbeBake::check`].
    ///
    /// # Errors
    /// There is no bake, the bakes' probes are not at the same places, or a buffer is larger than the device can bind ([`VoxelError`]).
    #[cfg(feature = "bake")]
    pub fn from_bakes(
        gpu: &Gpu,
        scene: &dyn SceneSeam,
        settings: ProbeSettings,
        bakes: &[&ProbeBake],
    ) -> Result<Self, VoxelError> {
        let Some((first, others)) = bakes.split_first() else {
            return Err(VoxelError::OtherProbes);
        };
        let place = |of: &BakedProbe| (of.corner, of.place);
        let are_same = |other: &&ProbeBake| {
            let same_lattice =
                (first.origin, first.cell, first.size) == (other.origin, other.cell, other.size);
            same_lattice && first.probes.iter().map(place).eq(other.probes.iter().map(place))
        };
        if !others.iter().all(are_same) {
            return Err(VoxelError::OtherProbes);
        }
        let lattice = first.lattice();
        let mut made =
            Self::on_lattice(gpu, scene, first.settings.with_look_up(&settings), lattice)?;
        made.upload(gpu, first);
        for (ix, bake) in bakes.iter().enumerate() {
            let bytes = GATHERED_BYTES * u64::from(lattice.capacity);
            let copied = wgpu::BufferUsages::COPY_DST;
            let light = storage_buffer(gpu, "baked light of probes", bytes, copied, ADVICE)?;
            let gathered: Vec<_> = bake.probes.iter().map(|probe| probe.gathered).collect();
            gpu.queue.write_buffer(&light, 0, bytemuck::cast_slice(&gathered));
            made.baked.push((light, if ix == 0 { 1.0 } else { 0.0 }));
        }
        made.n_paths = bakes.iter().map(|bake| bake.n_paths).min().unwrap_or(0);
        made.settings.n_paths = made.n_paths;
        made.is_to_pack = true;
        Ok(made)
    }

    /// Probes at the places of a bake, which gather light anew, or go on (`goes_on`) where the bake ended. They stay there, also if surfaces
    /// move; [`Self::stats`] says so.
    ///
    /// # Errors
    /// A buffer is larger than the device can bind ([`VoxelError`]).
    #[cfg(feature = "bake")]
    pub fn placed_as(
        gpu: &Gpu,
        scene: &dyn SceneSeam,
        settings: ProbeSettings,
        bake: &ProbeBake,
        goes_on: bool,
    ) -> Result<Self, VoxelError> {
        let mut made = Self::on_lattice(gpu, scene, settings, bake.lattice())?;
        made.upload(gpu, bake);
        if goes_on {
            let gathered: Vec<_> = bake.probes.iter().map(|probe| probe.gathered).collect();
            gpu.queue.write_buffer(&made.gathered, 0, bytemuck::cast_slice(&gathered));
            made.n_paths = bake.n_paths;
            made.is_to_pack = true;
        }
        made.seen = Some(scene.revisions());
        Ok(made)
    }

    /// Places, distances and marks of a bake.
    #[cfg(feature = "bake")]
    fn upload(&self, gpu: &Gpu, bake: &ProbeBake) {
        let n = bake.probes.len() as u32;
        self.occupancy.upload(gpu, &self.lattice, &bake::structure_of(bake), n);
        let distances: Vec<_> = bake.probes.iter().map(|probe| probe.distances).collect();
        gpu.queue.write_buffer(&self.distances, 0, bytemuck::cast_slice(&distances));
        let count = |is: fn(&BakedProbe) -> bool| bake.probes.iter().filter(|of| is(of)).count();
        let moved = count(|probe| probe.moved() != glam::Vec3::ZERO) as u32;
        let inside = count(BakedProbe::is_inside) as u32;
        gpu.queue.write_buffer(&self.placed, 0, bytemuck::cast_slice(&[moved, inside]));
    }

    /// How much each bake counts from the next update on: light is linear, so the weights are those of the lights that were on, and any
    /// number ≥ 0 is possible.
    ///
    /// # Panics
    /// If there are not as many weights as bakes.
    #[cfg(feature = "bake")]
    pub fn set_weights(&mut self, weights: &[f32]) {
        assert_eq!(weights.len(), self.baked.len(), "weights of bakes");
        for ((_, weight), new) in self.baked.iter_mut().zip(weights) {
            *weight = *new;
        }
        self.is_to_pack = true;
    }

    /// Creates the buffers and compiles the kernels.
    fn on_lattice(
        gpu: &Gpu,
        scene: &dyn SceneSeam,
        settings: ProbeSettings,
        lattice: VoxelGrid,
    ) -> Result<Self, VoxelError> {
        let copied = wgpu::BufferUsages::COPY_DST;
        let storage = |what, bytes| storage_buffer(gpu, what, bytes, copied, ADVICE);
        let capacity = u64::from(lattice.capacity);
        let uniform = |what, contents: &[u8]| {
            let usage = wgpu::BufferUsages::UNIFORM | copied;
            let of = buffer(gpu, what, contents.len() as u64, usage);
            gpu.queue.write_buffer(&of, 0, contents);
            of
        };
        let (shaders, group) = (scene.shaders(), Some(scene.group()));
        let plain = |name| ComputeKernel::new(gpu, &Shaders::default(), None, name);
        let field = settings.field(lattice);
        Ok(Self {
            settings,
            shaders: shaders.clone(),
            voxelizer: None,
            baked: Vec::new(),
            is_outdated: false,
            is_to_pack: false,
            lattice,
            mark: plain("probes/mark"),
            mark_air: plain("probes/mark_air"),
            place_kernel: ComputeKernel::new(gpu, shaders, group, "probes/place"),
            bits: storage("corners of cells", 4 * u64::from(n_bricks(&lattice)))?,
            occupancy: Occupancy::new(gpu, &lattice)?,
            distances_kernel: ComputeKernel::new(gpu, shaders, group, "probes/distances"),
            gather: ComputeKernel::new(gpu, shaders, group, "probes/gather"),
            blend: plain("probes/blend"),
            pack: ComputeKernel::new(
                gpu,
                &Shaders::new(settings.basis.of(Variant::BASELINE)),
                None,
                "probes/pack",
            ),
            uniform: uniform("probes", bytemuck::bytes_of::<ProbesUniform>(&field)),
            lattice_uniform: uniform("lattice of probes", bytemuck::bytes_of(&lattice)),
            gathered: storage("gathered light of probes", GATHERED_BYTES * capacity)?,
            light: storage("light of probes", 4 * u64::from(settings.basis.words()) * capacity)?,
            distances: storage(
                "distances of probes",
                4 * u64::from(MAP_SIDE * MAP_SIDE) * capacity,
            )?,
            placed: storage("moved probes", 8)?,
            faults: storage("faults of probes", 12)?,
            seen: None,
            n_paths: 0,
        })
    }

    /// Records the next paths of each probe, unless they have enough. If surfaces have moved since the last update, probes are placed
    /// anew; if anything has changed, their light begins anew. Baked probes stay as they are; [`Self::stats`] says if the
    /// scene has changed since.
    ///
    /// # Errors
    /// The scene differs from the one that this was made for. Nothing is recorded then.
    pub fn update(
        &mut self,
        recorder: &mut Recorder,
        scene: &dyn SceneSeam,
    ) -> Result<(), VoxelError> {
        check_shaders(&self.shaders, scene).map_err(VoxelError::Mismatch)?;
        let now = scene.revisions();
        let before = self.seen;
        if !self.baked.is_empty() {
            // (What moves was not baked.)
            let still = Revisions { moving: 0, ..now };
            self.is_outdated |= *self.seen.get_or_insert(still) != still;
            if std::mem::take(&mut self.is_to_pack) {
                self.blend(recorder);
                self.pack(recorder);
            }
            return Ok(());
        }
        if before != Some(now) {
            let is_same = |of: fn(&Revisions) -> u64| before.as_ref().map(of) == Some(of(&now));
            if !(is_same(|r| r.geometry) && is_same(|r| r.moving)) {
                self.place(recorder, scene)?;
                self.is_outdated |= self.voxelizer.is_none();
            }
            self.n_paths = 0;
            self.seen = Some(now);
        }
        if self.n_paths >= self.settings.n_paths {
            if std::mem::take(&mut self.is_to_pack) {
                self.pack(recorder);
            }
            return Ok(());
        }
        recorder.encoder().clear_buffer(&self.faults, N_ACTIVE_OFFSET, Some(4));
        let info = GatherInfo {
            first_path: self.n_paths,
            n_bounces: self.settings.n_bounces - 1,
            seed: self.settings.seed,
            noise: self.settings.noise,
        };
        self.gather
            .call(&mut recorder.compute(self.gather.name()))
            .scene(scene.group())
            .uniform("info", &info)
            .bind("counts", self.occupancy.counts())
            .bind("gathered", &self.gathered)
            .bind("faults", &self.faults)
            .with(self.lattice_field())
            .dispatch(Dispatch::Indirect(self.occupancy.counts(), RECORD_GROUPS_OFFSET));
        self.n_paths += PATHS_PER_UPDATE;
        self.pack(recorder);
        Ok(())
    }

    /// Blends the light of bakes.
    fn blend(&self, recorder: &mut Recorder) {
        let n = self.lattice.capacity * COEFFICIENTS;
        for (ix, (light, weight)) in self.baked.iter().enumerate() {
            let keep = if ix == 0 { 0.0 } else { 1.0 };
            self.blend
                .call(&mut recorder.compute(self.blend.name()))
                .uniform("info", &BlendInfo { n, keep, weight: *weight, reserved: 0 })
                .bind("added", light)
                .bind("gathered", &self.gathered)
                .dispatch(Dispatch::Items(n));
        }
    }

    /// Packs what was gathered, for look-ups.
    fn pack(&self, recorder: &mut Recorder) {
        let info = PackInfo { window: self.settings.window_factors(), reserved: 0 };
        self.pack
            .call(&mut recorder.compute(self.pack.name()))
            .uniform("info", &info)
            .bind("counts", self.occupancy.counts())
            .bind("gathered", &self.gathered)
            .bind("light", &self.light)
            .with(self.lattice_field())
            .dispatch(Dispatch::Indirect(self.occupancy.counts(), VOXEL_GROUPS_OFFSET));
    }

    /// Finds the cells that surfaces meet, their corners, where probes are best, and how far one sees from there.
    fn place(&self, recorder: &mut Recorder, scene: &dyn SceneSeam) -> Result<(), VoxelError> {
        // Without, the places are a bake's.
        let Some(voxelizer) = &self.voxelizer else { return Ok(()) };
        voxelizer.record(recorder, scene, Triangles::All)?;
        recorder.encoder().clear_buffer(&self.bits, 0, None);
        recorder.encoder().clear_buffer(&self.placed, 0, None);
        let pass = &mut recorder.compute("probes/place");
        self.mark
            .call(pass)
            .uniform("grid", voxelizer.grid())
            .uniform("lattice", &self.lattice)
            .bind("counts", voxelizer.counts())
            .bind("structure", voxelizer.structure())
            .bind("bits", &self.bits)
            .dispatch(Dispatch::Indirect(voxelizer.counts(), VOXEL_GROUPS_OFFSET));
        self.mark_air
            .call(pass)
            .uniform("lattice", &self.lattice)
            .bind("bits", &self.bits)
            .dispatch(Dispatch::Items(n_air(self.lattice.size, WIDE_STRIDE)));
        self.occupancy.record(pass, &self.lattice, &self.bits, &self.bits);
        let info = PlaceInfo {
            moves: u32::from(self.settings.moves),
            reserved_a: 0,
            reserved_b: 0,
            reserved_c: 0,
        };
        self.place_kernel
            .call(pass)
            .scene(scene.group())
            .uniform("info", &info)
            .uniform("lattice", &self.lattice)
            .bind("counts", self.occupancy.counts())
            .bind("structure", self.occupancy.structure())
            .bind("placed", &self.placed)
            .dispatch(Dispatch::Indirect(self.occupancy.counts(), RECORD_GROUPS_OFFSET));
        self.distances_kernel
            .call(pass)
            .scene(scene.group())
            .bind("counts", self.occupancy.counts())
            .bind("distances", &self.distances)
            .with(self.lattice_field())
            .dispatch(Dispatch::Indirect(self.occupancy.counts(), RECORD_GROUPS_OFFSET));
        Ok(())
    }

    /// The bindings of kernels that compute what probes hold (`fields::probe_lattice`).
    fn lattice_field(&self) -> Bindings<'_> {
        vec![
            ("lattice", (&self.lattice_uniform).into()),
            ("lattice_structure", self.occupancy.structure().into()),
        ]
    }

    /// The bindings of kernels that look up light (`fields::probes`).
    pub fn field(&self) -> Bindings<'_> {
        vec![
            ("probes", (&self.uniform).into()),
            ("probe_structure", self.occupancy.structure().into()),
            ("probe_light", (&self.light).into()),
            ("probe_distances", (&self.distances).into()),
        ]
    }

    /// The lattice of corners: its "cells" are those of probes, at whole numbers.
    pub fn lattice(&self) -> &VoxelGrid {
        &self.lattice
    }

    /// Which corners have a probe, and in which slot.
    pub fn occupancy(&self) -> &Occupancy {
        &self.occupancy
    }

    /// [`ProbeBasis::words`] for each probe: its light, as look-ups read it.
    pub fn light(&self) -> &wgpu::Buffer {
        &self.light
    }

    /// [`COEFFICIENTS`] `vec4<f32>` for each probe: rgb: coefficient of the radiance \[W·sr⁻¹·m⁻²\], reflected at least once.
    pub fn gathered(&self) -> &wgpu::Buffer {
        &self.gathered
    }

    /// What look-ups need: the settings that it was made with.
    pub fn settings(&self) -> &ProbeSettings {
        &self.settings
    }

    /// [`MAP_SIDE`]² pairs of halfs for each probe: mean distance \[cells\] and mean of its square.
    pub fn distances(&self) -> &wgpu::Buffer {
        &self.distances
    }

    /// Bytes of one probe, as look-ups need it.
    pub fn probe_bytes(&self) -> u64 {
        4 * u64::from(self.settings.basis.words()) + PLACE_BYTES
    }

    /// Paths that each probe has followed.
    pub fn n_paths(&self) -> u32 {
        self.n_paths
    }

    /// Statistics: probes, bytes, and what is wrong.
    pub fn stats(&self) -> Vec<Stat> {
        let probes = self.occupancy.counts();
        let missing = u64::from(self.settings.n_paths.saturating_sub(self.n_paths));
        let mut stats = vec![
            Stat::known("of a probe", "bytes", self.probe_bytes()),
            Stat::known(
                "room for probes",
                "bytes",
                (self.probe_bytes() + GATHERED_BYTES) * u64::from(self.lattice.capacity),
            ),
            Stat::counted("probes", "probes", probes, 0),
            Stat::counted("probes without room", "probes", probes, 4).fault(ADVICE),
            Stat::counted("moved from their corners", "probes", &self.placed, 0),
            Stat::counted("inside something", "probes", &self.placed, 4),
            Stat::known("still to follow", "paths per probe", missing)
                .fault("the light is noisy: update it in more frames (render: --warm-up), or ask for fewer paths"),
            Stat::counted("light was not finite and counts as dark", "paths", &self.faults, 0)
                .fault("please report it"),
            Stat::counted("cut short by this driver's limit of loops", "paths", &self.faults, 4)
                .fault("use a newer driver"),
            Stat::counted("still changing in the last update", "probes", &self.faults, N_ACTIVE_OFFSET),
        ];
        if let Some(voxelizer) = &self.voxelizer {
            let cells = voxelizer.counts();
            stats.push(Stat::counted("cells with surfaces", "cells", cells, 0));
            stats.push(Stat::counted("cells without room", "cells", cells, 4).fault(ADVICE));
        }
        if self.voxelizer.is_none() {
            let changed =
                Stat::known("scene has changed since the bake", "times", self.is_outdated.into());
            stats.push(
                changed.fault("bake again: probes keep the light and the distances of before"),
            );
        }
        stats
    }

    /// How the probes were laid out.
    pub fn notices(&self) -> Vec<Notice> {
        let VoxelGrid { cell, size, .. } = self.lattice;
        let [x, y, z] = (size - 1).to_array();
        vec![Notice::note(format!("probes at the corners of {x} x {y} x {z} cells of {cell:.3} m"))]
    }
}
