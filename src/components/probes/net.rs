// SPDX-License-Identifier: MIT OR Apache-2.0
//! Probes at the points of a net.

use super::{ADVICE, MAP_SIDE};
use crate::components::probe_net::{NetBuffers, NetKind, ProbeNet};
use crate::components::voxels::{VoxelCounts, VoxelGrid};
use crate::gpu::{Bindings, Gpu, GpuError, storage_buffer};
use bytemuck::Zeroable;
use glam::{UVec3, Vec3};

/// A net on the host and on the GPU.
#[derive(Debug)]
pub(super) struct Net {
    net: ProbeNet,
    buffers: NetBuffers,
    counts: wgpu::Buffer,
}

impl Net {
    pub fn new(gpu: &Gpu, net: ProbeNet) -> Result<Self, GpuError> {
        let counted = wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::INDIRECT;
        let bytes = size_of::<VoxelCounts>() as u64;
        let counts = storage_buffer(gpu, "probes of a net", bytes, counted, ADVICE)?;
        let n = net.points().len() as u32;
        let known = VoxelCounts::known(n, MAP_SIDE * MAP_SIDE);
        gpu.queue.write_buffer(&counts, 0, bytemuck::bytes_of(&known));
        Ok(Self { buffers: net.upload(gpu)?, net, counts })
    }

    /// Room for its points (a buffer is not empty).
    pub fn capacity(&self) -> u32 {
        self.net.points().len().max(1) as u32
    }

    /// Where its distances are counted from, and their unit.
    pub fn grid(&self) -> VoxelGrid {
        let origin = self.net.points().iter().copied().reduce(Vec3::min).unwrap_or(Vec3::ZERO);
        VoxelGrid { origin, cell: self.net.unit(), size: UVec3::ONE, ..Zeroable::zeroed() }
    }

    pub fn counts(&self) -> &wgpu::Buffer {
        &self.counts
    }

    pub fn places(&self) -> Bindings<'_> {
        self.buffers.field()
    }

    pub fn look_up(&self) -> Bindings<'_> {
        self.buffers.field()
    }

    /// How the probes were laid out.
    pub fn notice(&self) -> String {
        let (n, unit) = (self.net.points().len(), self.net.unit());
        let between = match self.net.kind() {
            NetKind::Empty | NetKind::Point => return format!("{n} probe(s)"),
            NetKind::Line => "on a line".into(),
            NetKind::Plane => format!("in a plane, {} triangles", self.net.faces().len() / 2),
            NetKind::Space => format!("{} tetrahedra", self.net.cells().len()),
        };
        format!("{n} probes in a net, {between}, {unit:.3} m from each other")
    }

    pub fn net(&self) -> &ProbeNet {
        &self.net
    }
}
