//! The compressed wide BVH, and the adapter's own acceleration structure.

use crate::bindings::host::rays::BvhNode;
use crate::gpu::Gpu;
use glam::{UVec4, Vec3};
use obvhs::BvhBuildParams;
use obvhs::cwbvh::{CwBvh, builder::build_cwbvh_from_tris};
use obvhs::triangle::Triangle;
use std::time::Duration;
use wgpu::util::DeviceExt;

pub use crate::bindings::host::rays::STACK_SIZE;

/// A BVH of eight children a node over triangles (Ylitie, Karras, Laine 2017), built by obvhs.
#[derive(Clone, Debug, Default)]
pub struct Bvh {
    nodes: Vec<BvhNode>,
    order: Vec<u32>,
}

/// The tree cannot be walked.
#[derive(Debug, thiserror::Error, PartialEq, Eq)]
pub enum BvhError {
    /// More levels than the kernel's stack.
    #[error(
        "the scene's BVH is {depth} levels deep and the kernels walk {STACK_SIZE}; sizes of triangles differ by too many orders of magnitude: scale or split the scene"
    )]
    TooDeep {
        /// Levels of the tree.
        depth: u32,
    },
}

impl Bvh {
    /// Builds the tree.
    ///
    /// # Errors
    /// [`BvhError::TooDeep`].
    pub fn build(triangles: &[[Vec3; 3]]) -> Result<Self, BvhError> {
        if triangles.is_empty() {
            return Ok(Self::default());
        }
        let tree = build_obvhs(triangles);
        let depth = depth(&tree);
        if depth > STACK_SIZE {
            return Err(BvhError::TooDeep { depth });
        }
        Ok(Self {
            nodes: tree.nodes.iter().map(|node| pack(bytemuck::cast_ref(node))).collect(),
            order: tree.primitive_indices,
        })
    }

    /// The nodes as the kernels read them; empty if there are no triangles.
    pub fn nodes(&self) -> &[BvhNode] {
        &self.nodes
    }

    /// Which input triangle stands at each place of the leaves.
    pub fn triangle_order(&self) -> &[u32] {
        &self.order
    }
}

/// obvhs's own tree, also for measuring against its traversal.
pub fn build_obvhs(triangles: &[[Vec3; 3]]) -> CwBvh {
    let triangles: Vec<_> = triangles
        .iter()
        .map(|&[a, b, c]| Triangle { v0: a.into(), v1: b.into(), v2: c.into() })
        .collect();
    // Without pre-splitting each triangle stands in one leaf, so leaves and triangles share an order.
    let parameters = BvhBuildParams { pre_split: false, ..BvhBuildParams::medium_build() };
    build_cwbvh_from_tris(&triangles, parameters, &mut Duration::default())
}

/// obvhs's 80 bytes as 20 words. It interleaves min and max of each axis, as the kernel does.
fn pack(words: &[u32; 20]) -> BvhNode {
    let four = |at: usize| UVec4::new(words[at], words[at + 1], words[at + 2], words[at + 3]);
    BvhNode {
        origin: Vec3::new(
            f32::from_bits(words[0]),
            f32::from_bits(words[1]),
            f32::from_bits(words[2]),
        ),
        exponents_and_mask: words[3],
        base_and_meta: four(4),
        bounds_x: four(8),
        bounds_y: four(12),
        bounds_z: four(16),
    }
}

fn depth(tree: &CwBvh) -> u32 {
    let mut deepest = 0;
    let mut open = vec![(0u32, 1u32)];
    while let Some((ix, level)) = open.pop() {
        deepest = deepest.max(level);
        let node = &tree.nodes[ix as usize];
        open.extend((0..node.imask.count_ones()).map(|k| (node.child_base_idx + k, level + 1)));
    }
    deepest
}

/// One BLAS with one instance, built at once. Geometry is not opaque: alpha masks are asked for.
pub(super) fn build_acceleration_structure(
    gpu: &Gpu,
    triangles: &[[Vec3; 3]],
) -> Result<(wgpu::Blas, wgpu::Tlas), crate::gpu::GpuError> {
    // A structure needs a triangle; this one lies where no ray looks and has no area.
    const NOWHERE: [[Vec3; 3]; 1] = [[Vec3::ZERO; 3]];
    let triangles = if triangles.is_empty() { &NOWHERE } else { triangles };
    let vertices = gpu.device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
        label: Some("ray query vertices"),
        contents: bytemuck::cast_slice(triangles),
        usage: wgpu::BufferUsages::BLAS_INPUT,
    });
    let size = wgpu::BlasTriangleGeometrySizeDescriptor {
        vertex_format: wgpu::VertexFormat::Float32x3,
        vertex_count: triangles.len() as u32 * 3,
        index_format: None,
        index_count: None,
        flags: wgpu::AccelerationStructureGeometryFlags::NO_DUPLICATE_ANY_HIT_INVOCATION,
    };
    let limit = u64::from(gpu.device.limits().max_blas_primitive_count);
    if triangles.len() as u64 > limit {
        return Err(crate::gpu::GpuError::TooLarge {
            what: "the acceleration structure (in triangles)",
            bytes: triangles.len() as u64,
            limit,
            advice: "use the software BVH",
        });
    }
    let blas = gpu.device.create_blas(
        &wgpu::CreateBlasDescriptor {
            label: Some("scene"),
            flags: wgpu::AccelerationStructureFlags::PREFER_FAST_TRACE,
            update_mode: wgpu::AccelerationStructureUpdateMode::Build,
        },
        wgpu::BlasGeometrySizeDescriptors::Triangles { descriptors: vec![size.clone()] },
    );
    let mut tlas = gpu.device.create_tlas(&wgpu::CreateTlasDescriptor {
        label: Some("scene"),
        max_instances: 1,
        flags: wgpu::AccelerationStructureFlags::PREFER_FAST_TRACE,
        update_mode: wgpu::AccelerationStructureUpdateMode::Build,
    });
    let identity = [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0];
    tlas[0] = Some(wgpu::TlasInstance::new(&blas, identity, 0, 0xff));
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    encoder.build_acceleration_structures(
        [&wgpu::BlasBuildEntry {
            blas: &blas,
            geometry: wgpu::BlasGeometries::TriangleGeometries(vec![wgpu::BlasTriangleGeometry {
                size: &size,
                vertex_buffer: &vertices,
                first_vertex: 0,
                vertex_stride: size_of::<Vec3>() as u64,
                index_buffer: None,
                first_index: None,
                transform_buffer: None,
                transform_buffer_offset: None,
            }]),
        }],
        [&tlas],
    );
    gpu.queue.submit([encoder.finish()]);
    Ok((blas, tlas))
}
