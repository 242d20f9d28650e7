// SPDX-License-Identifier: MIT OR Apache-2.0
//! Scene seam: which triangle a ray hits. Implementation: a compressed wide BVH in a storage buffer.
//!
//! Interface: `nearest_hit`, `any_hit`.
//!
//! H. Ylitie, T. Karras, S. Laine, "Efficient Incoherent Ray Traversal on GPUs Through Compressed Wide BVHs", HPG 2017:
//! 8 children per node in 80 bytes, boxes quantised to 8 bits, children visited by octant order without a sort. The
//! nodes are those that the crate obvhs builds.
//!
//! Both functions honour the alpha masks of materials.
#define_import_path lucerna::scene::rays

#import lucerna::geometry::ray_box::safe_inverse_direction
#import lucerna::geometry::ray_triangle::{ShearedRay, shear_ray, intersect_triangle}
#import lucerna::scene::data::{triangles, scene, TRIANGLE_ALPHA_TESTED}
#import lucerna::scene::surface::is_cut_away
#import lucerna::scene::types::{NONE, Hit, Ray}
#import lucerna::math::constants::{FLOAT_MAX, UNIT_ROUNDOFF}

/// Eight child boxes.
struct BvhNode {
    /// Corner of the quantisation grid.
    origin: vec3<f32>,
    /// Three biased exponents of the grid's cell, then the mask of inner children.
    exponents_and_mask: u32,
    /// First child node, first triangle, and a byte per child: what it is and where it is.
    base_and_meta: vec4<u32>,
    /// One byte per child: min 0–3, min 4–7, max 0–3, max 4–7.
    bounds_x: vec4<u32>,
    bounds_y: vec4<u32>,
    bounds_z: vec4<u32>,
}

@group(0) @binding(9) var<storage, read> bvh_nodes: array<BvhNode>;

/// The most groups that wait; the host never builds a deeper tree.
const STACK_SIZE: u32 = 32u;

/// A ray, prepared for boxes.
struct BoxRay {
    origin: vec3<f32>,
    t_min: f32,
    inverse_direction: vec3<f32>,
    /// The octant's order of children, in all four bytes.
    octant: u32,
    negative: vec3<bool>,
}

/// Prepares a ray for boxes. The direction may have zeros, and −0 counts as positive.
fn box_ray(ray: Ray) -> BoxRay {
    let negative = ray.direction < vec3<f32>(0.0);
    let bits = select(vec3<u32>(4u, 2u, 1u), vec3<u32>(0u), negative);
    let octant = (bits.x | bits.y | bits.z) * 0x01010101u;
    return BoxRay(ray.origin, ray.t_min, safe_inverse_direction(ray.direction), octant, negative);
}

/// The four bytes as numbers 0 to 255, the lowest byte first.
fn unpack_bytes(bytes: u32) -> vec4<f32> {
    return vec4<f32>((vec4<u32>(bytes) >> vec4<u32>(0u, 8u, 16u, 24u)) & vec4<u32>(0xffu));
}

/// Which of the node's children the ray hits: inner children in the high byte, by octant order; triangles in the low 24
/// bits.
fn intersect_node(node: BvhNode, ray: BoxRay, t_max: f32) -> u32 {
    let exponents = (vec3<u32>(node.exponents_and_mask) >> vec3<u32>(0u, 8u, 16u)) & vec3<u32>(0xffu);
    let slope = bitcast<vec3<f32>>(exponents << vec3<u32>(23u)) * ray.inverse_direction;
    let offset = (node.origin - ray.origin) * ray.inverse_direction;
    // Three roundings, each at most of the largest magnitude that a plane's distance takes on: near
    // planes move that much nearer and far planes farther, so no box that is touched is missed.
    let slack = (255.0 * abs(slope) + abs(offset)) * (4.0 * UNIT_ROUNDOFF);
    let near_offset = offset - slack;
    let far_offset = offset + slack;

    var hits = 0u;
    for (var half = 0u; half < 2u; half++) {
        let meta_bytes = node.base_and_meta[2u + half];
        let near_x = unpack_bytes(select(node.bounds_x[half], node.bounds_x[2u + half], ray.negative.x));
        let far_x = unpack_bytes(select(node.bounds_x[2u + half], node.bounds_x[half], ray.negative.x));
        let near_y = unpack_bytes(select(node.bounds_y[half], node.bounds_y[2u + half], ray.negative.y));
        let far_y = unpack_bytes(select(node.bounds_y[2u + half], node.bounds_y[half], ray.negative.y));
        let near_z = unpack_bytes(select(node.bounds_z[half], node.bounds_z[2u + half], ray.negative.z));
        let far_z = unpack_bytes(select(node.bounds_z[2u + half], node.bounds_z[half], ray.negative.z));
        let entry = max(
            max(near_x * slope.x + near_offset.x, near_y * slope.y + near_offset.y),
            max(near_z * slope.z + near_offset.z, vec4<f32>(ray.t_min)),
        );
        let exit = min(
            min(far_x * slope.x + far_offset.x, far_y * slope.y + far_offset.y),
            min(far_z * slope.z + far_offset.z, vec4<f32>(t_max)),
        );
        // An inner child's meta byte is 001 and 24 + slot; a leaf's is its triangles in unary and
        // the first one's offset.
        let is_inner = (meta_bytes & (meta_bytes << 1u)) & 0x10101010u;
        let inner_mask = (is_inner >> 4u) * 0xffu;
        let bit_index = (meta_bytes ^ (ray.octant & inner_mask)) & 0x1f1f1f1fu;
        let child_bits = (meta_bytes >> 5u) & 0x07070707u;
        let shifts = (vec4<u32>(bit_index) >> vec4<u32>(0u, 8u, 16u, 24u)) & vec4<u32>(0xffu);
        let bits = (vec4<u32>(child_bits) >> vec4<u32>(0u, 8u, 16u, 24u)) & vec4<u32>(0xffu);
        let met = select(vec4<u32>(0u), bits << shifts, entry <= exit);
        hits |= met.x | met.y | met.z | met.w;
    }
    return hits;
}

/// The nearest triangle on the ray; `triangle` is NONE if there is none.
fn nearest_hit(ray: Ray) -> Hit {
    return nearest_solid_hit(ray, false);
}

/// Whether the ray hits anything.
fn any_hit(ray: Ray) -> bool {
    return nearest_solid_hit(ray, true).triangle != NONE;
}

/// Continues behind each point that an alpha mask has removed.
///
/// The mask is read after the traversal, not during it: few triangles have one, and reading it takes more instructions
/// than the test of a triangle. (A triangle exactly in the plane of the removed one is skipped as well.)
fn nearest_solid_hit(ray: Ray, first_will_do: bool) -> Hit {
    var rest = ray;
    var hit: Hit;
    loop {
        hit = traverse(rest, first_will_do);
        if hit.triangle == NONE || !is_cut_away_at(hit) {
            break;
        }
        rest.t_min = hit.t;
    }
    return hit;
}

/// Whether the material's alpha mask removes the point of a hit.
fn is_cut_away_at(hit: Hit) -> bool {
    return (triangles[hit.triangle].flags & TRIANGLE_ALPHA_TESTED) != 0u
        && is_cut_away(hit.triangle, hit.barycentrics);
}

/// Finds the nearest triangle, ignoring masks. With `first_will_do` the first triangle without a mask ends the
/// traversal.
fn traverse(ray: Ray, first_will_do: bool) -> Hit {
    let boxes = box_ray(ray);
    let sheared = shear_ray(ray.origin, ray.direction);
    // A missed triangle returns FLOAT_MAX, which must not be nearer than the ray's end.
    var hit = Hit(min(ray.t_max, FLOAT_MAX), NONE, vec2<f32>(0.0));
    if scene.n_triangles == 0u {
        return hit;
    }
    var stack: array<vec2<u32>, STACK_SIZE>;
    var n_stack = 0u;
    // A group: the first child's index, and a mask whose high byte holds children to visit (nodes)
    // or whose low 24 bits hold triangles to test.
    var nodes = vec2<u32>(0u, 0x80000000u);
    loop {
        var leaves = vec2<u32>(0u);
        if nodes.y > 0x00ffffffu {
            let bit = firstLeadingBit(nodes.y);
            let inner_mask = nodes.y & 0xffu;
            let base = nodes.x;
            nodes.y &= ~(1u << bit);
            if nodes.y > 0x00ffffffu && n_stack < STACK_SIZE {
                stack[n_stack] = nodes;
                n_stack += 1u;
            }
            let slot = (bit - 24u) ^ (boxes.octant & 0xffu);
            let node = bvh_nodes[base + countOneBits(inner_mask & ((1u << slot) - 1u))];
            let hits = intersect_node(node, boxes, hit.t);
            nodes = vec2<u32>(node.base_and_meta.x, (hits & 0xff000000u) | (node.exponents_and_mask >> 24u));
            leaves = vec2<u32>(node.base_and_meta.y, hits & 0x00ffffffu);
        }
        while leaves.y != 0u {
            let triangle_ix = leaves.x + firstTrailingBit(leaves.y);
            leaves.y &= leaves.y - 1u;
            let triangle = triangles[triangle_ix];
            let found = intersect_triangle(
                sheared,
                triangle.corner_a,
                triangle.corner_b,
                triangle.corner_c,
                ray.t_min,
                hit.t,
            );
            if found.t < hit.t {
                hit = Hit(found.t, triangle_ix, found.barycentrics);
                if first_will_do && (triangle.flags & TRIANGLE_ALPHA_TESTED) == 0u {
                    return hit;
                }
            }
        }
        if nodes.y <= 0x00ffffffu {
            if n_stack == 0u {
                break;
            }
            n_stack -= 1u;
            nodes = stack[n_stack];
        }
    }
    return hit;
}
