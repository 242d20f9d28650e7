// SPDX-License-Identifier: MIT OR Apache-2.0
//! The compressed wide BVH, and the adapter's own acceleration structure.

use super::bvh_height::{around, groups_of_one_center, limit_height};
use crate::bindings::lucerna::scene::rays::BvhNode;
use crate::gpu::Gpu;
use glam::{UVec4, Vec3, Vec3A};
use obvhs::BvhBuildParams;
use obvhs::aabb::Aabb;
use obvhs::bvh2::reinsertion::ReinsertionOptimizer;
use obvhs::cwbvh::{CwBvh, bvh2_to_cwbvh::bvh2_to_cwbvh};
use obvhs::ploc::PlocBuilder;
use wgpu::util::DeviceExt;

pub use crate::bindings::lucerna::scene::rays::STACK_SIZE;

/// A BVH over triangles with eight children per node (Ylitie, Karras, Laine 2017), built by obvhs.
#[derive(Clone, Default)]
pub struct Bvh {
    nodes: Vec<BvhNode>,
    tree: CwBvh,
}

impl Bvh {
    /// Builds a tree of at most [`STACK_SIZE`] levels from any triangles without NaN.
    pub fn build(triangles: &[[Vec3; 3]]) -> Self {
        if triangles.is_empty() {
            return Self::default();
        }
        let tree = build_obvhs(triangles);
        debug_assert!(depth(&tree) <= STACK_SIZE);
        Self { nodes: tree.nodes.iter().map(|node| pack(bytemuck::cast_ref(node))).collect(), tree }
    }

    /// The nodes as the kernels read them; empty if there are no triangles.
    pub fn nodes(&self) -> &[BvhNode] {
        &self.nodes
    }

    /// The input triangle at each place of the leaves.
    pub fn triangle_order(&self) -> &[u32] {
        &self.tree.primitive_indices
    }

    /// obvhs's own form, for rays on the CPU.
    pub(super) fn into_tree(self) -> CwBvh {
        self.tree
    }
}

/// Maximum heights of binary trees that are tried, from the one that costs the least quality on. A tree with eight
/// children per node is at most as high as the binary one that it is made from, and usually a third of that, so the
/// last one always fits the kernels' stack.
const MAX_HEIGHTS: [u32; 3] = [3 * STACK_SIZE, 2 * STACK_SIZE, STACK_SIZE];

/// Builds obvhs's tree, also for comparisons with its traversal. Like its `build_cwbvh_from_tris`, but no chain of
/// nodes becomes deeper than [`STACK_SIZE`], as triangles with the same centre, or nested ones, would cause.
pub fn build_obvhs(triangles: &[[Vec3; 3]]) -> CwBvh {
    let boxes: Vec<Aabb> = triangles
        .iter()
        .map(|corners| {
            let [a, b, c] = corners.map(Vec3A::from);
            Aabb::new(a.min(b).min(c), a.max(b).max(c))
        })
        .collect();
    let groups = groups_of_one_center(&boxes);
    let group_boxes: Vec<Aabb> = groups.iter().map(|group| around(group, &boxes)).collect();
    // Without pre-splitting each triangle is in one leaf, so leaves and triangles share an order.
    let parameters = BvhBuildParams::medium_build();
    let mut binary = PlocBuilder::with_capacity(groups.len()).build(
        parameters.ploc_search_distance,
        &group_boxes,
        (0..groups.len() as u32).collect(),
        parameters.sort_precision,
        parameters.search_depth_threshold,
    );
    ReinsertionOptimizer::default().run(&mut binary, parameters.reinsertion_batch_ratio, None);
    let mut tree = CwBvh::default();
    for max_height in MAX_HEIGHTS {
        let limited = limit_height(&binary, &groups, &boxes, max_height);
        let binary = limited.as_ref().unwrap_or(&binary);
        tree = bvh2_to_cwbvh(binary, parameters.max_prims_per_leaf.clamp(1, 3), true, false);
        if depth(&tree) <= STACK_SIZE {
            break;
        }
    }
    tree
}

/// Packs obvhs's 80 bytes into 20 words. obvhs interleaves min and max of each axis, as the kernel does.
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

/// One BLAS with one instance, built immediately. Geometry is not opaque, so that kernels can test alpha masks.
pub(super) fn build_acceleration_structure(
    gpu: &Gpu,
    triangles: &[[Vec3; 3]],
) -> Result<(wgpu::Blas, wgpu::Tlas), crate::gpu::GpuError> {
    // A structure needs at least one triangle; this one has no area, so no ray hits it.
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Every triangle is in exactly one leaf, and no path is longer than the kernels' stack.
    fn check(what: &str, triangles: &[[Vec3; 3]]) {
        let tree = build_obvhs(triangles);
        let mut order = tree.primitive_indices.clone();
        order.sort_unstable();
        assert!(order.into_iter().eq(0..triangles.len() as u32), "{what}");
        let depth = depth(&tree);
        println!("{what}: {} triangles, {depth} levels", triangles.len());
        assert!(depth <= STACK_SIZE, "{what}: {depth} levels");
        // A tree of n leaves with 8 children a node needs log₈ n levels; chains of one child more a level would need n/7.
        let bound = 3 * (triangles.len() as f32).log2().ceil() as u32;
        assert!(depth <= bound.max(STACK_SIZE / 2), "{what}: {depth} levels");
    }

    /// Its box is a cube around the centre.
    fn triangle(center: Vec3, size: f32) -> [Vec3; 3] {
        [Vec3::new(-1.0, -1.0, -1.0), Vec3::new(1.0, -1.0, 0.3), Vec3::new(0.2, 1.0, 1.0)]
            .map(|corner| center + size * corner)
    }

    #[test]
    fn trees_of_nested_triangles_are_not_deep() {
        for n in [1usize, 2, 227, 1000, 20_000] {
            check("coincident", &vec![triangle(Vec3::ONE, 1.0); n]);
            let concentric = |ix: usize| triangle(Vec3::ONE, (ix + 1) as f32 / n as f32);
            check("concentric", &(0..n).map(concentric).collect::<Vec<_>>());
            // Nearly one centre: off by a few roundings.
            let shifted = |ix: usize| {
                triangle(Vec3::ONE + Vec3::X * (ix % 7) as f32 * f32::EPSILON, 1.0 + ix as f32)
            };
            check("nearly concentric", &(0..n).map(shifted).collect::<Vec<_>>());
            let nested = |ix: usize| triangle(Vec3::splat(0.3 * ix as f32), 1.0 + ix as f32);
            check("nested", &(0..n).map(nested).collect::<Vec<_>>());
        }
        // Each half as large as the last, sharing a corner: a chain by any measure of area.
        let shrinking: Vec<_> =
            (0..240).map(|ix| triangle(Vec3::ZERO, 1e18 * 0.7f32.powi(ix))).collect();
        check("one centre, of all sizes", &shrinking);
        let corner: Vec<_> = (0..240)
            .map(|ix| 1e18 * 0.7f32.powi(ix))
            .map(|size| triangle(Vec3::splat(2.0 * size), size))
            .collect();
        check("one corner, of all sizes", &corner);
    }
}
