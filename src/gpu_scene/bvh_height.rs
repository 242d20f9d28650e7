// SPDX-License-Identifier: MIT OR Apache-2.0
//! Limits the height of binary trees.
//!
//! Builders based on surface areas make chains of nested boxes: n triangles with the same centre, or each a multiple of
//! the last in size, become a tree of height n, which takes n² steps to build. So boxes with the same centre are given
//! to the builder as one ([`groups_of_one_center`]), and split by number afterwards; parts of its tree that are too
//! high are split by number as well ([`limit_height`]).

use glam::Vec3A;
use obvhs::aabb::Aabb;
use obvhs::bvh2::{Bvh2, node::Bvh2Node};

/// Centres that agree in this many bits of the scene's extent count as the same.
const CENTER_BITS: u32 = 20;
/// Up to this many boxes with the same centre are left to the builder.
const SMALL_GROUP: usize = 16;

/// If boxes are large compared with the scene, each contains many others, and builders that search for near neighbours
/// take a step for each pair. More than `NESTED_BOXES` boxes whose areas add up to more than `NESTED_AREA` times the
/// scene's are split only by number. (The triangles of surfaces add up to a few times the scene's area. Any tree over
/// nested boxes is bad.)
const NESTED_AREA: f32 = 64.0;
const NESTED_BOXES: usize = 4096;

/// Indices of the boxes: those with the same centre in one group if there are many, all others in groups of one. In a
/// fixed order.
pub(super) fn groups_of_one_center(boxes: &[Aabb]) -> Vec<Vec<u32>> {
    let all = || (0..boxes.len() as u32).collect::<Vec<_>>();
    let area = boxes.iter().map(Aabb::half_area).sum::<f32>();
    let whole = around(&all(), boxes).half_area();
    if boxes.len() > NESTED_BOXES && area > NESTED_AREA * whole {
        return vec![all()];
    }
    let centers = || boxes.iter().map(Aabb::center);
    let min = centers().reduce(Vec3A::min).unwrap_or_default();
    let max = centers().reduce(Vec3A::max).unwrap_or_default();
    let scale = (1 << CENTER_BITS) as f32 / (max - min).max(Vec3A::splat(f32::MIN_POSITIVE));
    let mut keyed: Vec<([u32; 3], u32)> = (0..)
        .zip(centers())
        .map(|(ix, center)| (((center - min) * scale).to_array().map(|x| x as u32), ix))
        .collect();
    keyed.sort_unstable();
    let mut groups = Vec::new();
    let mut alone = Vec::new();
    for run in keyed.chunk_by(|a, b| a.0 == b.0) {
        let members = run.iter().map(|&(_, ix)| ix);
        if run.len() > SMALL_GROUP {
            groups.push(members.collect());
        } else {
            alone.extend(members);
        }
    }
    // In the original order, because the builder's result depends on it.
    alone.sort_unstable();
    alone.into_iter().map(|ix| vec![ix]).chain(groups).collect()
}

/// The box around a subset of the boxes.
pub(super) fn around(set: &[u32], boxes: &[Aabb]) -> Aabb {
    set.iter().map(|&ix| boxes[ix as usize]).reduce(|a, b| a.union(&b)).unwrap_or_default()
}

/// Turns a tree over groups into a tree over their members, and rebuilds parts so that no leaf is more than
/// `max_height` below the root. None if the tree already satisfies this.
///
/// `boxes`: those of the groups' members. `max_height` must be at least ⌈log₂ of their number⌉.
pub(super) fn limit_height(
    tree: &Bvh2,
    groups: &[Vec<u32>],
    boxes: &[Aabb],
    max_height: u32,
) -> Option<Bvh2> {
    let sizes = Sizes::of(tree, groups);
    if sizes.height[0] <= max_height && groups.len() == boxes.len() {
        return None;
    }
    let mut out = Bvh2 {
        nodes: vec![Bvh2Node::new(*tree.nodes[0].aabb(), 0, 0)],
        primitive_indices: Vec::with_capacity(tree.primitive_indices.len()),
        children_are_ordered_after_parents: true,
        ..Bvh2::default()
    };
    let mut open = vec![(0, Part::Kept(0), max_height)];
    while let Some((at, part, room)) = open.pop() {
        let halves = match part {
            Part::Kept(ix) if tree.nodes[ix].is_leaf() => {
                let set = members(tree, groups, ix);
                if set.len() == 1 { Err(set) } else { Ok(halves(set, boxes)) }
            }
            Part::Kept(ix) => {
                let first = tree.nodes[ix].first_index as usize;
                let fits = |child: usize| log2_ceil(sizes.count[child]) < room;
                if sizes.height[ix] <= room || (fits(first) && fits(first + 1)) {
                    Ok([Part::Kept(first), Part::Kept(first + 1)])
                } else {
                    Ok(halves(members(tree, groups, ix), boxes))
                }
            }
            Part::New(set) if set.len() == 1 => Err(set),
            Part::New(set) => Ok(halves(set, boxes)),
        };
        match halves {
            Ok(halves) => {
                let first = out.nodes.len();
                let aabb = *out.nodes[at].aabb();
                out.nodes[at] = Bvh2Node::new(aabb, 0, first as u32);
                for (child, part) in halves.into_iter().enumerate() {
                    let aabb = match &part {
                        Part::Kept(ix) => *tree.nodes[*ix].aabb(),
                        Part::New(set) => around(set, boxes),
                    };
                    out.nodes.push(Bvh2Node::new(aabb, 0, 0));
                    open.push((first + child, part, room - 1));
                }
            }
            Err(leaf) => {
                let first = out.primitive_indices.len() as u32;
                let aabb = *out.nodes[at].aabb();
                out.nodes[at] = Bvh2Node::new(aabb, leaf.len() as u32, first);
                out.primitive_indices.extend(leaf);
            }
        }
    }
    Some(out)
}

/// What a new node is made from.
enum Part {
    /// A node of the original tree.
    Kept(usize),
    /// A set of boxes that is split by number.
    New(Vec<u32>),
}

/// For each node: the levels below it, and the number of boxes.
struct Sizes {
    height: Vec<u32>,
    count: Vec<u32>,
}

impl Sizes {
    fn of(tree: &Bvh2, groups: &[Vec<u32>]) -> Self {
        let n = tree.nodes.len();
        let (mut height, mut count) = (vec![0; n], vec![0; n]);
        let mut order = vec![0];
        let mut next = 0;
        // Parents first; then backwards, children first.
        while next < order.len() {
            let node = &tree.nodes[order[next]];
            if !node.is_leaf() {
                let first = node.first_index as usize;
                order.extend([first, first + 1]);
            }
            next += 1;
        }
        for ix in order.into_iter().rev() {
            let node = &tree.nodes[ix];
            let first = node.first_index as usize;
            (height[ix], count[ix]) = if node.is_leaf() {
                let n = members(tree, groups, ix).len() as u32;
                (log2_ceil(n), n)
            } else {
                let [a, b] = [first, first + 1];
                (1 + u32::max(height[a], height[b]), count[a] + count[b])
            };
        }
        Self { height, count }
    }
}

fn log2_ceil(n: u32) -> u32 {
    n.max(1).next_power_of_two().trailing_zeros()
}

/// The members of the groups below a node.
fn members(tree: &Bvh2, groups: &[Vec<u32>], ix: usize) -> Vec<u32> {
    let mut out = Vec::new();
    let mut open = vec![ix];
    while let Some(ix) = open.pop() {
        let node = &tree.nodes[ix];
        let first = node.first_index as usize;
        if node.is_leaf() {
            let found = &tree.primitive_indices[first..first + node.prim_count as usize];
            out.extend(found.iter().flat_map(|&group| &groups[group as usize]));
        } else {
            open.extend([first, first + 1]);
        }
    }
    out
}

/// Splits a set into halves by number, along the axis on which the centres are farthest apart; if all centres are the
/// same, by size and index.
fn halves(mut set: Vec<u32>, boxes: &[Aabb]) -> [Part; 2] {
    let center = |ix: u32| boxes[ix as usize].center();
    let (mut min, mut max) = (Vec3A::MAX, Vec3A::MIN);
    for &ix in &set {
        (min, max) = (min.min(center(ix)), max.max(center(ix)));
    }
    let extent = (max - min).to_array();
    let axis = (0..3).fold(0, |best, axis| if extent[axis] > extent[best] { axis } else { best });
    let middle = set.len().div_ceil(2);
    set.select_nth_unstable_by(middle, |&a, &b| {
        let by_center = center(a)[axis].total_cmp(&center(b)[axis]);
        let size = |ix: u32| boxes[ix as usize].half_area();
        by_center.then(size(a).total_cmp(&size(b))).then(a.cmp(&b))
    });
    let other = set.split_off(middle);
    [Part::New(set), Part::New(other)]
}
