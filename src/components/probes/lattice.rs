// SPDX-License-Identifier: MIT OR Apache-2.0
//! Probes at the corners of the cells that surfaces meet, and of wider cells of the air.

use super::masks::Masks;
use super::{ADVICE, MAP_SIDE, ProbeSettings, ProbeVisibility};
use crate::bindings::kernels::probes::mark::{MARK_BY_LIGHT, MARK_NONE, MarkInfo};
use crate::bindings::kernels::probes::place::PlaceInfo;
use crate::bindings::lucerna::components::probes::air::{MIDDLE_STRIDE, WIDE_STRIDE};
use crate::components::voxels::{
    BRICK, MAX_BINDING, Occupancy, RECORD_GROUPS_OFFSET, Resolution, Triangles,
    VOXEL_GROUPS_OFFSET, VoxelError, VoxelGrid, Voxelizer, grid_for_bounds, n_bricks,
};
use crate::gpu::{
    Bindings, ComputeKernel, Dispatch, Gpu, Recorder, Shaders, buffer, storage_buffer,
};
use crate::seam::SceneSeam;
use glam::UVec3;

/// There is room for this many probes, or for all corners.
const LEAST_ROOM: u32 = 4096;
/// The most that there is room for: more would need bindings above 128 MiB.
const MAX_ROOM: u32 = (MAX_BINDING / (4 * (MAP_SIDE * MAP_SIDE) as u64)) as u32;

/// Corners of cells of this stride in a lattice of this many corners along each axis.
fn n_air(size: UVec3, stride: u32) -> u32 {
    ((size - 1 + (stride - 1)) / stride + 1).element_product()
}

/// Which cells that surfaces meet have corners of their own; the others have those of middle cells.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Marked {
    All,
    None,
    /// Those where light is off by this share between the probes that are there.
    ByLight(f32),
}

impl Marked {
    fn info(self) -> MarkInfo {
        let (which, most) = match self {
            Self::All => (0, 0.0),
            Self::None => (MARK_NONE, 0.0),
            Self::ByLight(most) => (MARK_BY_LIGHT, most),
        };
        MarkInfo { which, most, reserved_a: 0, reserved_b: 0 }
    }
}

/// The lattice, and the kernels that place probes on it.
#[derive(Debug)]
pub(super) struct Lattice {
    /// None: probes are where a bake had them.
    voxelizer: Option<Voxelizer>,
    masks: Option<Masks>,
    moves: bool,
    grid: VoxelGrid,
    mark: ComputeKernel,
    mark_air: ComputeKernel,
    place: ComputeKernel,
    bits: wgpu::Buffer,
    occupancy: Occupancy,
    uniform: wgpu::Buffer,
    /// How many were moved, and are inside something.
    placed: wgpu::Buffer,
}

impl Lattice {
    /// The lattice of a scene.
    pub fn new(
        gpu: &Gpu,
        scene: &dyn SceneSeam,
        settings: &ProbeSettings,
    ) -> Result<Self, VoxelError> {
        let facts = scene.facts();
        let cells = Resolution::Longest(settings.cells);
        let grid = grid_for_bounds(facts.bounds_min, facts.bounds_max, cells, 1, None)?;
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
        let mut made = Self::on(gpu, scene, settings, lattice)?;
        let voxelizer = Voxelizer::new(gpu, scene, grid)?;
        if settings.visibility == ProbeVisibility::Masks {
            made.masks = Some(Masks::new(gpu, scene, &voxelizer)?);
        }
        made.voxelizer = Some(voxelizer);
        Ok(made)
    }

    /// A lattice on which no probe is placed.
    pub fn on(
        gpu: &Gpu,
        scene: &dyn SceneSeam,
        settings: &ProbeSettings,
        grid: VoxelGrid,
    ) -> Result<Self, VoxelError> {
        let copied = wgpu::BufferUsages::COPY_DST;
        let storage = |what, bytes| storage_buffer(gpu, what, bytes, copied, ADVICE);
        let plain = |name| ComputeKernel::new(gpu, &Shaders::default(), None, name);
        let usage = wgpu::BufferUsages::UNIFORM | copied;
        let uniform = buffer(gpu, "lattice of probes", size_of::<VoxelGrid>() as u64, usage);
        gpu.queue.write_buffer(&uniform, 0, bytemuck::bytes_of(&grid));
        Ok(Self {
            voxelizer: None,
            masks: None,
            moves: settings.moves,
            grid,
            mark: plain("probes/mark"),
            mark_air: plain("probes/mark_air"),
            place: ComputeKernel::new(gpu, scene.shaders(), Some(scene.group()), "probes/place"),
            bits: storage("corners of cells", 4 * u64::from(n_bricks(&grid)))?,
            occupancy: Occupancy::new(gpu, &grid)?,
            uniform,
            placed: storage("moved probes", 8)?,
        })
    }

    /// Puts probes where a bake had them: the words of its structure, how many probes there are, how many were moved, and are inside something.
    #[cfg(feature = "bake")]
    pub fn upload(&self, gpu: &Gpu, structure: &[[u32; 2]], n: u32, placed: [u32; 2]) {
        self.occupancy.upload(gpu, &self.grid, structure, n);
        self.set_placed(gpu, placed);
    }

    /// Sets the words of a brick: which of its corners have probes, and the first of those. And, for each, its corner and its place.
    #[cfg(feature = "bake")]
    pub fn set_brick(&self, gpu: &Gpu, brick: u32, [bits, first]: [u32; 2], records: &[[u32; 2]]) {
        let structure = self.occupancy.structure();
        gpu.queue.write_buffer(
            structure,
            8 * u64::from(brick),
            bytemuck::cast_slice(&[bits, first]),
        );
        let at = 8 * u64::from(n_bricks(&self.grid) + first);
        gpu.queue.write_buffer(structure, at, bytemuck::cast_slice(records));
    }

    /// Bytes of its buffers that do not depend on the number of probes.
    #[cfg(feature = "bake")]
    pub fn fixed_bytes(grid: &VoxelGrid) -> u64 {
        // The structure, slots before each brick, bits.
        (8 + 4 + 4) * u64::from(n_bricks(grid))
    }

    /// Sets how many were moved, and are inside something.
    #[cfg(feature = "bake")]
    pub fn set_placed(&self, gpu: &Gpu, placed: [u32; 2]) {
        gpu.queue.write_buffer(&self.placed, 0, bytemuck::cast_slice(&placed));
    }

    /// Finds the cells that surfaces meet, their corners, and where probes are best. `gathered`: what probes know, for [`Marked::ByLight`].
    pub fn record(
        &self,
        recorder: &mut Recorder,
        scene: &dyn SceneSeam,
        marked: Marked,
        gathered: &wgpu::Buffer,
    ) -> Result<(), VoxelError> {
        // Without, the places are a bake's.
        let Some(voxelizer) = &self.voxelizer else { return Ok(()) };
        voxelizer.record(recorder, scene, Triangles::All)?;
        // (Where cells are divided changes nothing about what is in them.)
        if let Some(masks) = &self.masks
            && !matches!(marked, Marked::ByLight(_))
        {
            masks.record(recorder, scene, voxelizer);
        }
        recorder.encoder().clear_buffer(&self.bits, 0, None);
        recorder.encoder().clear_buffer(&self.placed, 0, None);
        let pass = &mut recorder.compute("probes/place");
        self.mark
            .call(pass)
            .uniform("grid", voxelizer.grid())
            .uniform("lattice", &self.grid)
            .bind("counts", voxelizer.counts())
            .bind("structure", voxelizer.structure())
            .bind("bits", &self.bits)
            .uniform("info", &marked.info())
            .bind("known", self.occupancy.structure())
            .bind("gathered", gathered)
            .dispatch(Dispatch::Indirect(voxelizer.counts(), VOXEL_GROUPS_OFFSET));
        self.mark_air
            .call(pass)
            .uniform("lattice", &self.grid)
            .bind("bits", &self.bits)
            .dispatch(Dispatch::Items(n_air(self.grid.size, WIDE_STRIDE)));
        self.occupancy.record(pass, &self.grid, &self.bits, &self.bits);
        let info =
            PlaceInfo { moves: u32::from(self.moves), reserved_a: 0, reserved_b: 0, reserved_c: 0 };
        self.place
            .call(pass)
            .scene(scene.group())
            .uniform("info", &info)
            .uniform("lattice", &self.grid)
            .bind("counts", self.occupancy.counts())
            .bind("structure", self.occupancy.structure())
            .bind("placed", &self.placed)
            .dispatch(Dispatch::Indirect(self.occupancy.counts(), RECORD_GROUPS_OFFSET));
        Ok(())
    }

    /// The bindings of kernels that compute what probes hold (`fields::probe_places`).
    pub fn places(&self) -> Bindings<'_> {
        vec![
            ("lattice", (&self.uniform).into()),
            ("lattice_structure", self.occupancy.structure().into()),
        ]
    }

    /// Its part of the bindings of kernels that look up light (`fields::probes`).
    pub fn look_up(&self) -> Bindings<'_> {
        vec![("probe_structure", self.occupancy.structure().into())]
    }

    /// The masks, if they decide which probes a point sees.
    pub fn masks(&self) -> Option<&wgpu::Buffer> {
        self.masks.as_ref().map(Masks::buffer)
    }

    /// The lattice of corners.
    pub fn grid(&self) -> &VoxelGrid {
        &self.grid
    }

    /// Which corners have a probe, and in which slot.
    pub fn occupancy(&self) -> &Occupancy {
        &self.occupancy
    }

    /// How many were moved, and are inside something: two u32.
    pub fn placed(&self) -> &wgpu::Buffer {
        &self.placed
    }

    /// What finds the cells; none if probes are where a bake had them.
    pub fn voxelizer(&self) -> Option<&Voxelizer> {
        self.voxelizer.as_ref()
    }
}
