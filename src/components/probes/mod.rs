// SPDX-License-Identifier: MIT OR Apache-2.0
//! Light probes: spherical harmonics of the light that arrives, and how far each probe sees. They are at the corners of the cells that
//! surfaces meet, or at the points of a net.
//!
//! ```text
//! Voxelizer ──cells──▶ probes/mark, mark_air ──▶ Occupancy ──lattice──▶ probes/place ──▶ probes/distances
//!  when something moved                           a slot for each corner   out of walls    how far each sees
//!                                    (or) ProbeNet ──points───────────────────────────────────▶ │
//!                                                                                              ▼
//!                      fields::probes ◀──light── probes/pack ◀──gathered────────────── probes/gather
//!                       pixels                    in a basis                           paths, until there are enough
//! ```
//!
//! Light-probe volumes (2016) place probes so (`docs/techniques/probe-volume.md`). Probes are found by the rank of their bit,
//! so no table from cells to probes is kept.

#[cfg(feature = "bake")]
mod bake;
mod lattice;
mod layout;
mod masks;
#[cfg(feature = "nets")]
mod net;
mod settings;
#[cfg(feature = "bake")]
mod stream;

use crate::bindings::kernels::probes::blend::BlendInfo;
use crate::bindings::kernels::probes::gather::GatherInfo;
use crate::bindings::kernels::probes::pack::PackInfo;
use crate::bindings::lucerna::fields::probe_store::Probes as ProbesUniform;
use crate::components::voxels::{
    Occupancy, RECORD_GROUPS_OFFSET, VOXEL_GROUPS_OFFSET, VoxelError, VoxelGrid,
};
use crate::gpu::{
    Bindings, ComputeKernel, Dispatch, Gpu, Recorder, Shaders, buffer, storage_buffer,
};
use crate::report::{Notice, Stat};
use crate::seam::{Revisions, SceneSeam, check_shaders};
use crate::shader::Variant;
use glam::Vec3;
use lattice::{Lattice, Marked};
use layout::Layout;

pub use crate::bindings::kernels::probes::gather::WORKGROUP as PATHS_PER_UPDATE;
pub use crate::bindings::lucerna::components::probes::gathered::COEFFICIENTS;
pub use crate::bindings::lucerna::components::probes::octahedral_map::MAP_SIDE;
#[cfg(feature = "bake")]
pub use bake::{BakeError, BakedLayout, BakedProbe, ProbeBake};
pub use settings::{ProbeBasis, ProbeSettings, ProbeVisibility};
#[cfg(feature = "bake")]
pub use stream::{ProbeFile, Streamed};

/// Bytes of a probe besides its light: 64 pairs of halfs, its corner and its place.
const PLACE_BYTES: u64 = 4 * (MAP_SIDE * MAP_SIDE) as u64 + 8;
/// Bytes of a probe that are needed while it gathers: nine of four f32.
const GATHERED_BYTES: u64 = 16 * COEFFICIENTS as u64;
/// Paths that tell which cells are to be divided: eight batches know how noisy they are.
const FIRST_PATHS: u32 = 512;
const ADVICE: &str = "use fewer cells";
/// Of the count of probes that followed paths in the last update, in the buffer of faults.
const N_ACTIVE_OFFSET: u64 = 8;
/// Bytes of one probe, as look-ups need it.
fn bytes_of_probe(basis: ProbeBasis) -> u64 {
    4 * u64::from(basis.words()) + PLACE_BYTES
}

/// Probes of a scene. They gather light until each has followed enough paths, and anew when the scene changes.
#[derive(Debug)]
pub struct Probes {
    settings: ProbeSettings,
    shaders: Shaders,
    layout: Layout,
    /// Gathered light that is blended, with its weights; empty: probes gather their own.
    baked: Vec<(wgpu::Buffer, Vec3)>,
    /// Baked probes of which only a part is there.
    #[cfg(feature = "bake")]
    pool: Option<stream::Pool>,
    /// Whether places and distances are those of a bake.
    places_are_baked: bool,
    /// Whether weights of bakes were set: they say which lights are on.
    has_weights: bool,
    /// False while probes are only at corners of middle cells, to find out which cells are to be divided.
    is_refined: bool,
    /// Whether the scene has changed since baked probes, or probes at a bake's places, were first used.
    is_outdated: bool,
    /// Whether what was gathered was not packed since: the weights of bakes have changed, or it is a bake's.
    is_to_pack: bool,
    distances_kernel: ComputeKernel,
    gather: ComputeKernel,
    blend: ComputeKernel,
    pack: ComputeKernel,
    /// `Probes` of `fields::probe_store`.
    uniform: wgpu::Buffer,
    gathered: wgpu::Buffer,
    light: wgpu::Buffer,
    distances: wgpu::Buffer,
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
        let lattice = Lattice::new(gpu, scene, &settings)?;
        Self::with_layout(gpu, scene, settings, Layout::Lattice(Box::new(lattice)))
    }

    /// Probes at the points of a net, for scenes of the same variant. Of `settings`, `cells` and `moves` do not count: points stay where
    /// they are, and none should be inside something ([`place_net`](crate::blocking::place_net) leaves those out).
    ///
    /// # Errors
    /// A buffer is larger than the device can bind ([`VoxelError`]).
    #[cfg(feature = "nets")]
    pub fn on_net(
        gpu: &Gpu,
        scene: &dyn SceneSeam,
        settings: ProbeSettings,
        net: crate::components::probe_net::ProbeNet,
    ) -> Result<Self, VoxelError> {
        let net = Box::new(net::Net::new(gpu, net)?);
        Self::with_layout(gpu, scene, settings, Layout::Net(net))
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
            let same_layout = first.layout == other.layout;
            same_layout && first.probes.iter().map(place).eq(other.probes.iter().map(place))
        };
        if !others.iter().all(are_same) {
            return Err(VoxelError::OtherProbes);
        }
        let mut made = Self::at_places(gpu, scene, first.settings.with_look_up(&settings), first)?;
        for (ix, bake) in bakes.iter().enumerate() {
            let bytes = GATHERED_BYTES * u64::from(made.layout.capacity());
            let copied = wgpu::BufferUsages::COPY_DST;
            let light = storage_buffer(gpu, "baked light of probes", bytes, copied, ADVICE)?;
            let gathered: Vec<_> = bake.probes.iter().map(|probe| probe.gathered).collect();
            gpu.queue.write_buffer(&light, 0, bytemuck::cast_slice(&gathered));
            made.baked.push((light, if ix == 0 { Vec3::ONE } else { Vec3::ZERO }));
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
        let mut made = Self::at_places(gpu, scene, settings, bake)?;
        if goes_on {
            let gathered: Vec<_> = bake.probes.iter().map(|probe| probe.gathered).collect();
            gpu.queue.write_buffer(&made.gathered, 0, bytemuck::cast_slice(&gathered));
            made.n_paths = bake.n_paths;
            made.is_to_pack = true;
        }
        made.seen = Some(scene.revisions());
        Ok(made)
    }

    /// With the places, distances and marks of a bake.
    #[cfg(feature = "bake")]
    fn at_places(
        gpu: &Gpu,
        scene: &dyn SceneSeam,
        settings: ProbeSettings,
        bake: &ProbeBake,
    ) -> Result<Self, VoxelError> {
        let layout = match &bake.layout {
            BakedLayout::Lattice { .. } => {
                let grid = bake::lattice_of(bake);
                let lattice = Box::new(Lattice::on(gpu, scene, &settings, grid)?);
                let count = |is: fn(&BakedProbe) -> bool| {
                    bake.probes.iter().filter(|of| is(of)).count() as u32
                };
                let placed =
                    [count(|probe| probe.moved() != Vec3::ZERO), count(BakedProbe::is_inside)];
                let structure = bake::structure_of(bake);
                lattice.upload(gpu, &structure, bake.probes.len() as u32, placed);
                Layout::Lattice(lattice)
            }
            #[cfg(feature = "nets")]
            BakedLayout::Net { points } => {
                let net = crate::components::probe_net::ProbeNet::new(points);
                let net = net.ok().filter(|net| net.points() == points.as_slice());
                Layout::Net(Box::new(net::Net::new(gpu, net.ok_or(VoxelError::NoNet)?)?))
            }
            #[cfg(not(feature = "nets"))]
            BakedLayout::Net { .. } => return Err(VoxelError::NoNet),
        };
        if settings.basis == ProbeBasis::Sh4 {
            return Err(VoxelError::NoBand);
        }
        let mut made = Self::with_layout(gpu, scene, settings, layout)?;
        made.places_are_baked = true;
        let distances: Vec<_> = bake.probes.iter().map(|probe| probe.distances).collect();
        gpu.queue.write_buffer(&made.distances, 0, bytemuck::cast_slice(&distances));
        Ok(made)
    }

    /// Baked probes that stay in a file; those around a place are loaded by [`Self::stream`]. `most_bytes`: what all buffers may take on the GPU.
    /// Of `settings`, those of the look-up count, as in [`Self::from_bakes`].
    ///
    /// # Errors
    /// There is no room for a brick ([`VoxelError::NoRoom`]), or a buffer is larger than the device can bind.
    #[cfg(feature = "bake")]
    pub fn from_file(
        gpu: &Gpu,
        scene: &dyn SceneSeam,
        settings: ProbeSettings,
        file: &ProbeFile,
        most_bytes: u64,
    ) -> Result<Self, VoxelError> {
        let settings = file.head().settings.with_look_up(&settings);
        if settings.basis == ProbeBasis::Sh4 {
            return Err(VoxelError::NoBand);
        }
        let fixed = Lattice::fixed_bytes(&file.lattice(1));
        let of_probe = bytes_of_probe(settings.basis) + GATHERED_BYTES;
        let room = (most_bytes.saturating_sub(fixed) / of_probe).min(file.n_probes().max(1).into());
        if room < 32.min(file.n_probes().into()) {
            return Err(VoxelError::NoRoom { bytes: most_bytes, least: fixed + 32 * of_probe });
        }
        let grid = file.lattice(room as u32);
        let lattice = Box::new(Lattice::on(gpu, scene, &settings, grid)?);
        let empty = vec![[0; 2]; crate::components::voxels::n_bricks(&grid) as usize];
        lattice.upload(gpu, &empty, room as u32, [0, 0]);
        let mut made = Self::with_layout(gpu, scene, settings, Layout::Lattice(lattice))?;
        made.places_are_baked = true;
        made.pool = Some(stream::Pool::new(file, room as u32));
        made.n_paths = file.head().n_paths;
        made.settings.n_paths = made.n_paths;
        Ok(made)
    }

    /// Loads those bricks of a file that are nearest to a place \[m\] and for which there is room, at most `most` of them that are not there yet, and drops
    /// those that are farther away. The next update shows them.
    ///
    /// # Errors
    /// A brick cannot be read ([`BakeError`]); those before it are there all the same.
    ///
    /// # Panics
    /// If these probes were not made by [`Self::from_file`].
    #[cfg(feature = "bake")]
    pub fn stream(
        &mut self,
        gpu: &Gpu,
        file: &mut ProbeFile,
        place: Vec3,
        most: u32,
    ) -> Result<Streamed, BakeError> {
        let Some(pool) = &mut self.pool else { panic!("these probes are not those of a file") };
        pool.check(file)?;
        let Some(lattice) = self.layout.lattice() else {
            panic!("a file's probes are on a lattice")
        };
        let (changes, result) = pool.follow(file, place, most);
        for change in &changes {
            match change {
                stream::Change::Dropped { brick } => lattice.set_brick(gpu, *brick, [0, 0], &[]),
                stream::Change::Loaded { brick, bits, first, probes } => {
                    let records: Vec<_> = probes.iter().map(|of| [of.corner, of.place]).collect();
                    lattice.set_brick(gpu, *brick, [*bits, *first], &records);
                    let at = u64::from(*first);
                    let gathered: Vec<_> = probes.iter().map(|of| of.gathered).collect();
                    let distances: Vec<_> = probes.iter().map(|of| of.distances).collect();
                    let write = |buffer, at, bytes| gpu.queue.write_buffer(buffer, at, bytes);
                    write(&self.gathered, GATHERED_BYTES * at, bytemuck::cast_slice(&gathered));
                    let map = 4 * u64::from(MAP_SIDE * MAP_SIDE);
                    write(&self.distances, map * at, bytemuck::cast_slice(&distances));
                }
            }
        }
        lattice.set_placed(gpu, pool.placed);
        self.is_to_pack |= !changes.is_empty();
        result
    }

    /// How much each bake counts from the next update on: light is linear, so the weights are those of the lights that were on, and any
    /// number ≥ 0 is possible.
    ///
    /// # Panics
    /// If there are not as many weights as bakes.
    #[cfg(feature = "bake")]
    pub fn set_weights(&mut self, weights: &[f32]) {
        self.set_colours(&weights.iter().copied().map(Vec3::splat).collect::<Vec<_>>());
    }

    /// As [`Self::set_weights`], for each colour: those of the lights, or of the parts of a sky
    /// ([`sky_part_weights`](crate::scene::sky_part_weights)), which may be below 0.
    ///
    /// # Panics
    /// If there are not as many colours as bakes.
    #[cfg(feature = "bake")]
    pub fn set_colours(&mut self, colours: &[Vec3]) {
        assert_eq!(colours.len(), self.baked.len(), "weights of bakes");
        for ((_, weight), new) in self.baked.iter_mut().zip(colours) {
            *weight = *new;
        }
        self.is_to_pack = true;
        self.has_weights = true;
    }

    /// Creates the buffers and compiles the kernels.
    fn with_layout(
        gpu: &Gpu,
        scene: &dyn SceneSeam,
        settings: ProbeSettings,
        layout: Layout,
    ) -> Result<Self, VoxelError> {
        if settings.visibility == ProbeVisibility::Masks
            && layout.lattice().and_then(Lattice::masks).is_none()
        {
            return Err(VoxelError::NoMasks);
        }
        let copied = wgpu::BufferUsages::COPY_DST;
        let storage = |what, bytes| storage_buffer(gpu, what, bytes, copied, ADVICE);
        let capacity = u64::from(layout.capacity());
        let gathered_bytes = GATHERED_BYTES * u64::from(settings.basis.n_parts());
        let field = settings.field(layout.grid());
        let usage = wgpu::BufferUsages::UNIFORM | copied;
        let uniform = buffer(gpu, "probes", size_of::<ProbesUniform>() as u64, usage);
        gpu.queue.write_buffer(&uniform, 0, bytemuck::bytes_of::<ProbesUniform>(&field));
        let (shaders, group) = (scene.shaders(), Some(scene.group()));
        let at_places = shaders.with_variant(layout.of(shaders.variant()));
        let of_light = Shaders::new(layout.of(settings.basis.of(Variant::BASELINE)));
        Ok(Self {
            settings,
            shaders: shaders.clone(),
            layout,
            baked: Vec::new(),
            #[cfg(feature = "bake")]
            pool: None,
            places_are_baked: false,
            is_refined: true,
            has_weights: false,
            is_outdated: false,
            is_to_pack: false,
            distances_kernel: ComputeKernel::new(gpu, &at_places, group, "probes/distances"),
            gather: ComputeKernel::new(gpu, &at_places, group, "probes/gather"),
            blend: ComputeKernel::new(gpu, &Shaders::default(), None, "probes/blend"),
            pack: ComputeKernel::new(gpu, &of_light, None, "probes/pack"),
            uniform,
            gathered: storage("gathered light of probes", gathered_bytes * capacity)?,
            light: storage("light of probes", 4 * u64::from(settings.basis.words()) * capacity)?,
            distances: storage(
                "distances of probes",
                4 * u64::from(MAP_SIDE * MAP_SIDE) * capacity,
            )?,
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
        if !self.baked.is_empty() || self.is_streamed() {
            // (What moves was not baked.)
            let before = *self.seen.get_or_insert(now);
            // (Nor which lights are on, and the sky, once that is what weights say.)
            let of_weights =
                Revisions { lights: before.lights, sky: before.sky, moving: before.moving, ..now };
            let others = Revisions { moving: before.moving, ..now };
            self.is_outdated |= before != if self.has_weights { of_weights } else { others };
            if std::mem::take(&mut self.is_to_pack) {
                // (Of several; nothing, if they are a file's.)
                self.blend(recorder);
                self.pack(recorder);
            }
            return Ok(());
        }
        if before != Some(now) {
            let have_moved = before.is_none_or(|before| {
                (before.geometry, before.moving) != (now.geometry, now.moving)
            });
            let only_moving =
                before.is_some_and(|before| Revisions { moving: now.moving, ..before } == now);
            // (While things move there is no time to find out which cells are to be divided: all are.)
            let refines = self.refines() && !only_moving;
            if have_moved || refines {
                self.place(recorder, scene, if refines { Marked::None } else { Marked::All })?;
                self.is_refined = !refines;
            }
            self.is_outdated |= have_moved && self.layout.stays() && before.is_some();
            self.n_paths = 0;
            self.seen = Some(now);
        }
        if !self.is_refined && self.n_paths >= FIRST_PATHS {
            self.place(recorder, scene, Marked::ByLight(self.settings.refine))?;
            self.is_refined = true;
            self.n_paths = 0;
        }
        if self.is_refined && self.n_paths >= self.settings.n_paths {
            if std::mem::take(&mut self.is_to_pack) {
                self.pack(recorder);
            }
            return Ok(());
        }
        recorder.encoder().clear_buffer(&self.faults, N_ACTIVE_OFFSET, Some(4));
        for part in 0..self.settings.basis.n_parts() {
            let info = GatherInfo {
                first_path: self.n_paths,
                n_bounces: self.settings.n_bounces - 1,
                seed: self.settings.seed,
                // (Only the first one knows when to stop, and only where probes stay.)
                noise: if part == 0 && self.is_refined { self.settings.noise } else { 0.0 },
                part,
                first: part * COEFFICIENTS * self.layout.capacity(),
                reserved_a: 0,
                reserved_b: 0,
            };
            self.gather
                .call(&mut recorder.compute(self.gather.name()))
                .scene(scene.group())
                .uniform("info", &info)
                .bind("counts", self.layout.counts())
                .bind("gathered", &self.gathered)
                .bind("faults", &self.faults)
                .with(self.layout.places())
                .dispatch(Dispatch::Indirect(self.layout.counts(), RECORD_GROUPS_OFFSET));
        }
        self.n_paths += PATHS_PER_UPDATE;
        self.pack(recorder);
        Ok(())
    }

    #[cfg(feature = "bake")]
    pub(crate) fn is_streamed(&self) -> bool {
        self.pool.is_some()
    }

    #[cfg(not(feature = "bake"))]
    fn is_streamed(&self) -> bool {
        false
    }

    /// Blends the light of bakes.
    fn blend(&self, recorder: &mut Recorder) {
        let n = self.layout.capacity() * COEFFICIENTS;
        for (ix, (light, weight)) in self.baked.iter().enumerate() {
            let info = BlendInfo {
                n,
                keep: if ix == 0 { 0.0 } else { 1.0 },
                reserved_a: 0,
                reserved_b: 0,
                weight: *weight,
                reserved_c: 0,
            };
            self.blend
                .call(&mut recorder.compute(self.blend.name()))
                .uniform("info", &info)
                .bind("added", light)
                .bind("gathered", &self.gathered)
                .dispatch(Dispatch::Items(n));
        }
    }

    /// Packs what was gathered, for look-ups.
    fn pack(&self, recorder: &mut Recorder) {
        let info = PackInfo { window: self.settings.window_factors() };
        self.pack
            .call(&mut recorder.compute(self.pack.name()))
            .uniform("info", &info)
            .bind("counts", self.layout.counts())
            .bind("gathered", &self.gathered)
            .bind("light", &self.light)
            .with(self.layout.places())
            .dispatch(Dispatch::Indirect(self.layout.counts(), VOXEL_GROUPS_OFFSET));
    }

    /// Finds where probes are, and how far one sees from there.
    fn place(
        &self,
        recorder: &mut Recorder,
        scene: &dyn SceneSeam,
        marked: Marked,
    ) -> Result<(), VoxelError> {
        if self.places_are_baked {
            return Ok(());
        }
        // (A net's points stay.)
        if let Some(lattice) = self.layout.lattice() {
            lattice.record(recorder, scene, marked, &self.gathered)?;
        }
        self.distances_kernel
            .call(&mut recorder.compute(self.distances_kernel.name()))
            .scene(scene.group())
            .bind("counts", self.layout.counts())
            .bind("distances", &self.distances)
            .with(self.layout.places())
            .dispatch(Dispatch::Indirect(self.layout.counts(), RECORD_GROUPS_OFFSET));
        Ok(())
    }

    /// The bindings of kernels that look up light (`fields::probes`, in the variant of [`Self::variant`]).
    pub fn field(&self) -> Bindings<'_> {
        let mut all: Bindings = vec![
            ("probes", (&self.uniform).into()),
            ("probe_light", (&self.light).into()),
            ("probe_distances", self.sight().into()),
        ];
        all.extend(self.layout.look_up());
        all
    }

    /// What tells which probes see a point: masks, or maps of distances.
    fn sight(&self) -> &wgpu::Buffer {
        self.masks().unwrap_or(&self.distances)
    }

    /// Masks of what probes see of the cells that surfaces meet (`wgsl/components/probes/masks.wgsl`), if that is asked for: two words
    /// for each brick of cells, and 16 for each cell with surfaces.
    pub fn masks(&self) -> Option<&wgpu::Buffer> {
        self.layout.lattice().and_then(Lattice::masks)
    }

    /// A variant with the modules that look up these probes: their layout's and their basis's.
    pub fn variant(&self, variant: Variant) -> Variant {
        self.layout.of(self.settings.basis.of(variant))
    }

    /// The lattice of corners: its "cells" are those of probes, at whole numbers. None: they are at the points of a net.
    pub fn lattice(&self) -> Option<&VoxelGrid> {
        self.layout.lattice().map(Lattice::grid)
    }

    /// Which corners of the lattice have a probe, and in which slot.
    pub fn occupancy(&self) -> Option<&Occupancy> {
        self.layout.lattice().map(Lattice::occupancy)
    }

    /// The net, if probes are at its points.
    #[cfg(feature = "nets")]
    pub fn net(&self) -> Option<&crate::components::probe_net::ProbeNet> {
        match &self.layout {
            Layout::Net(net) => Some(net.net()),
            Layout::Lattice(_) => None,
        }
    }

    /// One [`VoxelCounts`](crate::components::voxels::VoxelCounts): how many probes there are.
    pub fn counts(&self) -> &wgpu::Buffer {
        self.layout.counts()
    }

    /// [`ProbeBasis::words`] for each probe: its light, as look-ups read it.
    pub fn light(&self) -> &wgpu::Buffer {
        &self.light
    }

    /// [`COEFFICIENTS`] `vec4<f32>` for each probe: rgb: coefficient of the radiance \[W·sr⁻¹·m⁻²\], reflected at least once. After all of them, with
    /// [`ProbeBasis::Sh4`], those of band 4.
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
        bytes_of_probe(self.settings.basis)
    }

    /// Paths that each probe has followed; those that only tell which cells are to be divided do not count.
    pub fn n_paths(&self) -> u32 {
        if self.is_refined { self.n_paths } else { 0 }
    }

    /// Whether cells are divided where light is not straight.
    fn refines(&self) -> bool {
        self.settings.refine > 0.0 && !self.layout.stays()
    }

    /// Statistics: probes, bytes, and what is wrong.
    pub fn stats(&self) -> Vec<Stat> {
        let probes = self.layout.counts();
        let first = if self.is_refined { 0 } else { FIRST_PATHS };
        let missing = u64::from((first + self.settings.n_paths).saturating_sub(self.n_paths));
        let mut stats = vec![
            Stat::known("of a probe", "bytes", self.probe_bytes()),
            Stat::known(
                "room for probes",
                "bytes",
                self.probe_bytes() * u64::from(self.layout.capacity()) + self.gathered.size(),
            ),
            self.count_of_probes(),
            Stat::counted("probes without room", "probes", probes, 4).fault(ADVICE),
            Stat::known("still to follow", "paths per probe", missing)
                .fault("the light is noisy: update it in more frames (render: --warm-up), or ask for fewer paths"),
            Stat::counted("light was not finite and counts as dark", "paths", &self.faults, 0)
                .fault("please report it"),
            Stat::counted("cut short by this driver's limit of loops", "paths", &self.faults, 4)
                .fault("use a newer driver"),
            Stat::counted("still changing in the last update", "probes", &self.faults, N_ACTIVE_OFFSET),
        ];
        if let Some(lattice) = self.layout.lattice() {
            let placed = lattice.placed();
            stats.push(Stat::counted("moved from their corners", "probes", placed, 0));
            stats.push(Stat::counted("inside something", "probes", placed, 4));
            if let Some(voxelizer) = lattice.voxelizer() {
                let cells = voxelizer.counts();
                stats.push(Stat::counted("cells with surfaces", "cells", cells, 0));
                stats.push(Stat::counted("cells without room", "cells", cells, 4).fault(ADVICE));
            }
        }
        if self.layout.stays() {
            let (name, advice) = if self.places_are_baked {
                (
                    "scene has changed since the bake",
                    "bake again: probes keep the light and the distances of before",
                )
            } else {
                ("surfaces have moved since the net was made", "make it anew: probes stay")
            };
            stats.push(Stat::known(name, "times", self.is_outdated.into()).fault(advice));
        }
        #[cfg(feature = "bake")]
        if let Some(pool) = &self.pool {
            let to_load = Stat::known("still in the file", "bricks", pool.n_to_load.into());
            stats.push(to_load.fault("call Probes::stream again"));
        }
        stats
    }

    /// Of the probes of a file, how many are in memory; 0 if these are not a file's.
    #[cfg(feature = "bake")]
    pub fn n_in_memory(&self) -> u32 {
        self.pool.as_ref().map_or(0, stream::Pool::n_probes)
    }

    /// How many probes there are.
    fn count_of_probes(&self) -> Stat {
        #[cfg(feature = "bake")]
        if let Some(pool) = &self.pool {
            return Stat::known("probes", "probes", pool.n_probes().into());
        }
        Stat::counted("probes", "probes", self.layout.counts(), 0)
    }

    /// How the probes were laid out.
    pub fn notices(&self) -> Vec<Notice> {
        let VoxelGrid { cell, size, .. } = self.layout.grid();
        let text = match self.layout {
            Layout::Lattice(_) => {
                let [x, y, z] = (size - 1).to_array();
                format!("probes at the corners of {x} x {y} x {z} cells of {cell:.3} m")
            }
            #[cfg(feature = "nets")]
            Layout::Net(ref net) => net.notice(),
        };
        vec![Notice::note(text)]
    }
}
