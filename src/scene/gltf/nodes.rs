// SPDX-License-Identifier: MIT OR Apache-2.0
//! The node tree: checked to be a tree, then walked without recursion.

use glam::{DAffine3, DMat4, DQuat, DVec3};
use gltf::json::{Node, Root};

use super::{index, named};
use crate::scene::MAX_COORDINATE;
use crate::scene::error::{ErrorKind, Warning, Warnings};
use crate::scene::limits::LoadLimits;

/// A node of the scene that is loaded.
pub(super) struct Placed {
    /// Index in the file.
    pub node: usize,
    pub world_from_object: DAffine3,
    /// Whether its and its parents' scales mirror, where 0 counts as positive.
    pub mirrored: bool,
}

/// World matrices of nodes of any scene, computed when needed.
pub(super) struct Worlds {
    parents: Vec<Option<usize>>,
    known: Vec<Option<Result<DAffine3, &'static str>>>,
}

impl Worlds {
    pub fn of(&mut self, root: &Root, node: usize) -> Result<DAffine3, &'static str> {
        let mut unknown = Vec::new();
        let mut world = Ok(DAffine3::IDENTITY);
        let mut next = Some(node);
        while let Some(node) = next {
            if let Some(known) = self.known[node] {
                world = known;
                break;
            }
            unknown.push(node);
            next = self.parents[node];
        }
        for node in unknown.into_iter().rev() {
            world = world
                .and_then(|parent| Ok(parent * local(&root.nodes[node])?.0))
                .and_then(|world| usable(&world).map(|()| world));
            self.known[node] = Some(world);
        }
        world
    }
}

/// The nodes of the default scene in the file's order, parents first. If there is no default, these are the nodes of
/// the first scene; if there are no scenes, those of the whole file. A node whose transform is unusable is left out
/// with all nodes below it.
pub(super) fn place(
    root: &Root,
    limits: &LoadLimits,
    warnings: &mut Warnings,
) -> Result<(Vec<Placed>, Worlds), ErrorKind> {
    let parents = parents(root)?;
    refuse_cycles(&parents)?;

    let scene_ix = match root.scene {
        Some(scene) => Some(scene.value()),
        None if root.scenes.is_empty() => None,
        None => Some(0),
    };
    let roots: Vec<usize> = match scene_ix {
        Some(scene_ix) => {
            let scene = index(&root.scenes, scene_ix, "scenes", || "scene".to_owned())?;
            if root.scene.is_none() && root.scenes.len() > 1 {
                warnings.push(Warning::Value {
                    at: "scene".to_owned(),
                    problem: format!(
                        "none of the {} scenes is the default; {} is read",
                        root.scenes.len(),
                        named("scenes", scene_ix, scene.name.as_deref())
                    ),
                });
            }
            scene_roots(root, scene_ix, &scene.nodes, &parents)?
        }
        None => (0..root.nodes.len()).filter(|&node| parents[node].is_none()).collect(),
    };

    let mut placed = Vec::new();
    let mut stack: Vec<(usize, usize, DAffine3, bool)> =
        roots.into_iter().rev().map(|node| (node, 0, DAffine3::IDENTITY, false)).collect();
    while let Some((node_ix, depth, world_from_parent, parent_mirrored)) = stack.pop() {
        if depth > limits.max_node_depth {
            return Err(ErrorKind::TooMuch {
                what: format!("nodes[{node_ix}]: depth"),
                needed: depth as u64,
                limit: limits.max_node_depth as u64,
                setting: "max_node_depth",
            });
        }
        let node = &root.nodes[node_ix];
        let world = local(node).map(|(parent_from_node, mirrors)| {
            (world_from_parent * parent_from_node, parent_mirrored != mirrors)
        });
        let world = world.and_then(|(world, mirrored)| usable(&world).map(|()| (world, mirrored)));
        let (world, mirrored) = match world {
            Ok(world) => world,
            Err(problem) => {
                warnings.push(Warning::Transform {
                    node: named("nodes", node_ix, node.name.as_deref()),
                    problem,
                });
                continue;
            }
        };
        placed.push(Placed { node: node_ix, world_from_object: world, mirrored });
        for child in node.children.iter().flatten().rev() {
            stack.push((child.value(), depth + 1, world, mirrored));
        }
    }
    let known = vec![None; parents.len()];
    Ok((placed, Worlds { parents, known }))
}

/// Each node's parent. Rejects children that do not exist or have two parents.
fn parents(root: &Root) -> Result<Vec<Option<usize>>, ErrorKind> {
    let mut parents: Vec<Option<usize>> = vec![None; root.nodes.len()];
    for (parent, node) in root.nodes.iter().enumerate() {
        for child in node.children.iter().flatten().map(|c| c.value()) {
            index(&root.nodes, child, "nodes", || format!("a child of nodes[{parent}]"))?;
            if let Some(first) = parents[child].replace(parent) {
                return Err(ErrorKind::NodeShared {
                    node: child,
                    first: format!("child of nodes[{first}]"),
                    second: format!("child of nodes[{parent}]"),
                });
            }
        }
    }
    Ok(parents)
}

/// Walks up from each node; nodes known to end at a root are not walked again, so this is linear.
fn refuse_cycles(parents: &[Option<usize>]) -> Result<(), ErrorKind> {
    const NEW: usize = usize::MAX;
    let mut walked_from = vec![NEW; parents.len()];
    for start in 0..parents.len() {
        let mut node = start;
        while walked_from[node] == NEW {
            walked_from[node] = start;
            match parents[node] {
                Some(parent) if walked_from[parent] == start => {
                    return Err(ErrorKind::NodeCycle { node: parent });
                }
                Some(parent) => node = parent,
                None => break,
            }
        }
    }
    Ok(())
}

fn scene_roots(
    root: &Root,
    scene_ix: usize,
    nodes: &[gltf::json::Index<Node>],
    parents: &[Option<usize>],
) -> Result<Vec<usize>, ErrorKind> {
    let at = || format!("root of scenes[{scene_ix}]");
    let mut listed = vec![false; root.nodes.len()];
    let mut roots = Vec::with_capacity(nodes.len());
    for node in nodes.iter().map(|n| n.value()) {
        index(&root.nodes, node, "nodes", at)?;
        let first = match parents[node] {
            Some(parent) => Some(format!("child of nodes[{parent}]")),
            None => listed[node].then(at),
        };
        if let Some(first) = first {
            return Err(ErrorKind::NodeShared { node, first, second: at() });
        }
        listed[node] = true;
        roots.push(node);
    }
    Ok(roots)
}

/// A node's own matrix, and whether it mirrors.
fn local(node: &Node) -> Result<(DAffine3, bool), &'static str> {
    if let Some(matrix) = node.matrix {
        let matrix = DMat4::from_cols_array(&matrix.map(f64::from));
        if !matrix.is_finite() {
            return Err("its matrix is not finite; left out with all nodes below it");
        }
        if matrix.row(3) != glam::DVec4::W {
            return Err("its matrix is not affine; left out with all nodes below it");
        }
        let matrix = DAffine3::from_mat4(matrix);
        return Ok((matrix, matrix.matrix3.determinant() < 0.0));
    }
    let vector = |v: [f32; 3]| DVec3::from_array(v.map(f64::from));
    let translation = node.translation.map_or(DVec3::ZERO, vector);
    let scale = node.scale.map_or(DVec3::ONE, vector);
    let rotation = match node.rotation {
        Some(q) => {
            let q = DQuat::from_array(q.0.map(f64::from));
            if !(q.length_squared() > 0.0 && q.is_finite()) {
                return Err("its rotation is zero or not finite; left out with all nodes below it");
            }
            q.normalize()
        }
        None => DQuat::IDENTITY,
    };
    let mirrors = scale.to_array().iter().filter(|&&s| s < 0.0).count() % 2 == 1;
    Ok((DAffine3::from_scale_rotation_translation(scale, rotation, translation), mirrors))
}

fn usable(world: &DAffine3) -> Result<(), &'static str> {
    if !world.is_finite() {
        return Err("its transform is not finite; left out with all nodes below it");
    }
    let largest = world.translation.abs().max_element();
    if largest > f64::from(MAX_COORDINATE) {
        return Err("it is beyond 1e9 m; left out with all nodes below it");
    }
    Ok(())
}
