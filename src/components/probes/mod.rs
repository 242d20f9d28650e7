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

mod settings;

use crate::bindings::kernels::probes::gather::GatherInfo;
use crate::bindings::kernels::probes::pack::PackInfo;
use crate::bindings::kernels::probes::place::PlaceInfo;
use crate::bindings::lucerna::components::probes::air::AIR_STRIDE;
use crate::bindings::lucerna::fields::probes::Probes as ProbesUniform;
use crate::components::voxels::{
    BRICK, Occupancy, RECORD_GROUPS_OFFSET, Resolution, Triangles, VOXEL_GROUPS_OFFSET, VoxelError,
    VoxelGrid, Voxelizer, grid_for_bounds, n_bricks,
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
pub use settings::{ProbeBasis, ProbeSettings, ProbeVisibility};

/// Bytes of a probe besides its light: 64 pairs of halfs, its corner and its place.
const PLACE_BYTES: u64 = 4 * (MAP_SIDE * MAP_SIDE) as u64 + 8;
/// Bytes of a probe that are needed while it gathers: nine of four f32.
const GATHERED_BYTES: u64 = 16 * COEFFICIENTS as u64;
const ADVICE: &str = "use fewer cells";
/// There is room for this many probes, or for all corners.
const LEAST_ROOM: u32 = 4096;

/// Probes of the air in a lattice of this many corners along each axis.
fn n_air(size: UVec3) -> u32 {
    ((size - 1 + (AIR_STRIDE - 1)) / AIR_STRIDE + 1).element_product()
}

/// Probes of a scene. They gather light until each has followed enough paths, and anew when the scene changes.
#[derive(Debug)]
pub struct Probes {
    settings: ProbeSettings,
    shaders: Shaders,
    voxelizer: Voxelizer,
    lattice: VoxelGrid,
    mark: ComputeKernel,
    mark_air: ComputeKernel,
    place_kernel: ComputeKernel,
    bits: wgpu::Buffer,
    occupancy: Occupancy,
    distances_kernel: ComputeKernel,
    gather: ComputeKernel,
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
            capacity: size.element_product().min((2 * grid.capacity + n_air(size)).max(LEAST_ROOM)),
            // Invocations for each probe.
            n_faces: MAP_SIDE * MAP_SIDE,
            ..grid
        };
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
        let field = settings.field(lattice);
        Ok(Self {
            settings,
            shaders: shaders.clone(),
            voxelizer: Voxelizer::new(gpu, scene, grid)?,
            lattice,
            mark: ComputeKernel::new(gpu, &Shaders::default(), None, "probes/mark"),
            mark_air: ComputeKernel::new(gpu, &Shaders::default(), None, "probes/mark_air"),
            place_kernel: ComputeKernel::new(gpu, shaders, group, "probes/place"),
            bits: storage("corners of cells", 4 * u64::from(n_bricks(&lattice)))?,
            occupancy: Occupancy::new(gpu, &lattice)?,
            distances_kernel: ComputeKernel::new(gpu, shaders, group, "probes/distances"),
            gather: ComputeKernel::new(gpu, shaders, group, "probes/gather"),
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
            faults: storage("faults of probes", 8)?,
            seen: None,
            n_paths: 0,
        })
    }

    /// Records the next paths of each probe, unless they have enough. If surfaces have moved since the last update, probes are placed
    /// anew; if anything has changed, their light begins anew.
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
        if before != Some(now) {
            let is_same = |of: fn(&Revisions) -> u64| before.as_ref().map(of) == Some(of(&now));
            if !(is_same(|r| r.geometry) && is_same(|r| r.moving)) {
                self.place(recorder, scene)?;
            }
            self.n_paths = 0;
            self.seen = Some(now);
        }
        if self.n_paths >= self.settings.n_paths {
            return Ok(());
        }
        let info = GatherInfo {
            first_path: self.n_paths,
            n_bounces: self.settings.n_bounces - 1,
            seed: self.settings.seed,
            reserved: 0,
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
        self.voxelizer.record(recorder, scene, Triangles::All)?;
        recorder.encoder().clear_buffer(&self.bits, 0, None);
        recorder.encoder().clear_buffer(&self.placed, 0, None);
        let pass = &mut recorder.compute("probes/place");
        self.mark
            .call(pass)
            .uniform("grid", self.voxelizer.grid())
            .uniform("lattice", &self.lattice)
            .bind("counts", self.voxelizer.counts())
            .bind("structure", self.voxelizer.structure())
            .bind("bits", &self.bits)
            .dispatch(Dispatch::Indirect(self.voxelizer.counts(), VOXEL_GROUPS_OFFSET));
        self.mark_air
            .call(pass)
            .uniform("lattice", &self.lattice)
            .bind("bits", &self.bits)
            .dispatch(Dispatch::Items(n_air(self.lattice.size)));
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
        let (cells, probes) = (self.voxelizer.counts(), self.occupancy.counts());
        let missing = u64::from(self.settings.n_paths.saturating_sub(self.n_paths));
        vec![
            Stat::known("of a probe", "bytes", self.probe_bytes()),
            Stat::known(
                "room for probes",
                "bytes",
                (self.probe_bytes() + GATHERED_BYTES) * u64::from(self.lattice.capacity),
            ),
            Stat::counted("cells with surfaces", "cells", cells, 0),
            Stat::counted("cells without room", "cells", cells, 4).fault(ADVICE),
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
        ]
    }

    /// How the probes were laid out.
    pub fn notices(&self) -> Vec<Notice> {
        let VoxelGrid { cell, size, .. } = *self.voxelizer.grid();
        let [x, y, z] = size.to_array();
        vec![Notice::note(format!("probes at the corners of {x} x {y} x {z} cells of {cell:.3} m"))]
    }
}
