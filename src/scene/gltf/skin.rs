// SPDX-License-Identifier: MIT OR Apache-2.0
//! Skins at rest: vertices placed by the joints' matrices (glTF 2.0 §3.7.3.3).
//!
//! vertex = Σ weight · world_from_joint · joint_from_mesh · position, in 64 bits. The node of the
//! mesh has no effect.

use std::rc::Rc;

use glam::{DAffine3, DMat3, DMat4, DVec3, DVec4};
use gltf::json::mesh::{Primitive, Semantic};
use gltf::json::validation::Checked;

use super::flat::cofactor;
use super::{Loader, index, named};
use crate::scene::Mesh;
use crate::scene::error::{DataProblem, ErrorKind, Warning, short};

/// Tolerance for the last row of an inverse bind matrix, (0, 0, 0, 1), and for the sum of a
/// vertex's weights, 1.
const TOLERANCE: f64 = 1e-2;

/// For each joint, the matrix from the mesh to the world.
pub(super) type Pose = Rc<[DAffine3]>;

/// One set of up to four joints per vertex.
struct Influences {
    joints: Vec<[u32; 4]>,
    weights: Vec<[f32; 4]>,
}

/// Counts of what was wrong with a primitive's influences.
#[derive(Default)]
struct Mended {
    n_out_of_range: usize,
    n_unusable: usize,
    n_without: usize,
    n_scaled: usize,
}

impl Loader<'_> {
    /// The pose of a skin; `None`, with a warning, if it cannot be used.
    pub(super) fn pose(&mut self, skin: usize, at: &str) -> Result<Option<Pose>, ErrorKind> {
        let known = match self.poses.get(skin) {
            Some(Some(known)) => known.clone(),
            _ => {
                let made = match self.make_pose(skin) {
                    Err(e @ ErrorKind::TooMuch { .. }) => return Err(e),
                    Err(problem) => Err(problem.to_string()),
                    Ok(pose) => Ok(pose),
                };
                if let Some(slot) = self.poses.get_mut(skin) {
                    *slot = Some(made.clone());
                }
                made
            }
        };
        Ok(known.map_err(|problem| self.warn_skin(at, &problem)).ok())
    }

    fn warn_skin(&mut self, at: &str, problem: &str) {
        self.warnings.push(Warning::Value {
            at: at.to_owned(),
            problem: format!(
                "its skin cannot be used ({problem}); the mesh is read without it, and without the \
                 node's transform"
            ),
        });
    }

    fn make_pose(&mut self, skin_ix: usize) -> Result<Pose, ErrorKind> {
        let root = self.data.root;
        let skin = index(&root.skins, skin_ix, "skins", || "skin".to_owned())?;
        let at = named("skins", skin_ix, skin.name.as_deref());
        let wrong = |problem: String| ErrorKind::Skin { at: at.clone(), problem };
        let n = skin.joints.len();
        if n == 0 {
            return Err(wrong("has no joints".to_owned()));
        }
        self.budget.take(n as u64, size_of::<DAffine3>() as u64, &at)?;
        let matrices: Option<Vec<[f32; 16]>> = match skin.inverse_bind_matrices {
            None => None,
            Some(ix) => {
                let at = format!("{at}.inverseBindMatrices");
                Some(self.data.floats(ix, &at, &mut self.budget, &mut self.warnings)?)
            }
        };
        if let Some(matrices) = matrices.as_ref().filter(|matrices| matrices.len() < n) {
            let found = matrices.len();
            return Err(wrong(format!("has {found} inverseBindMatrices for {n} joints")));
        }
        let mut pose = Vec::with_capacity(n);
        for (i, joint) in skin.joints.iter().enumerate() {
            let joint = joint.value();
            index(&root.nodes, joint, "nodes", || format!("{at}.joints[{i}]"))?;
            let world = self
                .worlds
                .of(root, joint)
                .map_err(|_| wrong(format!("the transform of joint nodes[{joint}] is unusable")))?;
            let bind = match &matrices {
                None => DAffine3::IDENTITY,
                Some(matrices) => affine(&matrices[i])
                    .ok_or_else(|| wrong(format!("inverseBindMatrices[{i}] is not affine")))?,
            };
            pose.push(world * bind);
        }
        if !pose.iter().all(|m| m.is_finite()) {
            return Err(wrong("a joint's matrix is not finite".to_owned()));
        }
        Ok(pose.into())
    }

    /// Places a primitive's vertices. One without usable influences stays as it is, with a warning.
    pub(super) fn apply_pose(
        &mut self,
        pose: &[DAffine3],
        primitive: &Primitive,
        mesh: &mut Mesh,
        at: &str,
    ) -> Result<(), ErrorKind> {
        let sets = match self.influences(primitive, mesh.positions.len(), at) {
            Ok(sets) => sets,
            Err(e @ ErrorKind::TooMuch { .. }) => return Err(e),
            Err(ErrorKind::Skin { problem, .. }) => {
                self.warn_skin(at, &problem);
                return Ok(());
            }
            Err(problem) => {
                self.warn_skin(at, &problem.to_string());
                return Ok(());
            }
        };
        let n = mesh.positions.len();
        self.budget.take(n as u64, 1, at)?;
        let mut mirrored = vec![false; n];
        let mut mended = Mended::default();
        for (v, mirrored) in mirrored.iter_mut().enumerate() {
            let world = blend(pose, &sets, v, &mut mended);
            mesh.positions[v] = world.transform_point3(mesh.positions[v].as_dvec3()).as_vec3();
            *mirrored = world.matrix3.determinant() < 0.0;
            let sign = if *mirrored { -1.0 } else { 1.0 };
            let unit = |v: DVec3| v.normalize_or_zero().as_vec3();
            if let Some(normal) = mesh.normals.get_mut(v) {
                *normal = unit(cofactor(&world.matrix3) * normal.as_dvec3() * sign);
            }
            if let Some(tangent) = mesh.tangents.get_mut(v) {
                let along = unit(world.matrix3 * tangent.truncate().as_dvec3());
                *tangent = along.extend(tangent.w * sign as f32);
            }
        }
        // The front remains the front if joints mirror.
        for triangle in &mut mesh.triangles {
            let turned = |&i: &u32| mirrored.get(i as usize).copied().unwrap_or(false);
            if triangle.iter().filter(|i| turned(i)).count() >= 2 {
                triangle.swap(1, 2);
            }
        }
        self.warn_mended(&mended, pose.len(), at);
        let bytes = (n * sets.len() * size_of::<[u32; 8]>() + n) as u64;
        self.budget.give_back(bytes);
        Ok(())
    }

    fn influences(
        &mut self,
        primitive: &Primitive,
        n: usize,
        at: &str,
    ) -> Result<Vec<Influences>, ErrorKind> {
        let attribute = |semantic| primitive.attributes.get(&Checked::Valid(semantic)).copied();
        let mut sets = Vec::new();
        for set in 0..=u32::MAX {
            let joints = attribute(Semantic::Joints(set));
            let weights = attribute(Semantic::Weights(set));
            let (Some(joints), Some(weights)) = (joints, weights) else {
                if set == 0 || joints.is_some() || weights.is_some() {
                    return Err(ErrorKind::Skin {
                        at: at.to_owned(),
                        problem: format!("lacks JOINTS_{set} or WEIGHTS_{set}"),
                    });
                }
                break;
            };
            let (budget, warnings) = (&mut self.budget, &mut self.warnings);
            let joints_at = format!("{at}.JOINTS_{set}");
            let weights_at = format!("{at}.WEIGHTS_{set}");
            let read = Influences {
                joints: self.data.joints(joints, &joints_at, budget, warnings)?,
                weights: self.data.unorms(weights, &weights_at, budget, warnings)?,
            };
            for (at, found) in [(joints_at, read.joints.len()), (weights_at, read.weights.len())] {
                if found != n {
                    let problem = DataProblem::Count { found, expected: n };
                    return Err(ErrorKind::Data { at, problem });
                }
            }
            sets.push(read);
        }
        Ok(sets)
    }

    fn warn_mended(&mut self, mended: &Mended, n_joints: usize, at: &str) {
        let Mended { n_out_of_range, n_unusable, n_without, n_scaled } = *mended;
        let problems = [
            (n_out_of_range, format!("joint(s) beyond the skin's {n_joints}, left out")),
            (n_unusable, "weight(s) negative or not finite, left out".to_owned()),
            (n_without, "vertices without a weight, placed by their first joint".to_owned()),
            (n_scaled, "vertices whose weights do not sum to 1, scaled".to_owned()),
        ];
        for (n, problem) in problems {
            if n > 0 {
                self.warnings
                    .push(Warning::Value { at: short(at), problem: format!("{n} {problem}") });
            }
        }
    }
}

/// The mean of a vertex's joints, by weight.
fn blend(pose: &[DAffine3], sets: &[Influences], vertex: usize, mended: &mut Mended) -> DAffine3 {
    let mut linear = DMat3::ZERO;
    let mut translation = DVec3::ZERO;
    let mut sum = 0.0;
    for set in sets {
        for (&joint, &weight) in set.joints[vertex].iter().zip(&set.weights[vertex]) {
            if weight == 0.0 {
                continue;
            }
            if !(weight > 0.0 && weight.is_finite()) {
                mended.n_unusable += 1;
                continue;
            }
            let Some(world) = pose.get(joint as usize) else {
                mended.n_out_of_range += 1;
                continue;
            };
            let weight = f64::from(weight);
            linear += world.matrix3 * weight;
            translation += world.translation * weight;
            sum += weight;
        }
    }
    if sum == 0.0 {
        mended.n_without += 1;
        let first = sets[0].joints[vertex][0] as usize;
        return pose.get(first).copied().unwrap_or(pose[0]);
    }
    mended.n_scaled += usize::from((sum - 1.0).abs() > TOLERANCE);
    DAffine3 { matrix3: linear * (1.0 / sum), translation: translation / sum }
}

fn affine(columns: &[f32; 16]) -> Option<DAffine3> {
    let matrix = DMat4::from_cols_array(&columns.map(f64::from));
    let off = (matrix.row(3) - DVec4::W).abs().max_element();
    (matrix.is_finite() && off <= TOLERANCE).then(|| DAffine3::from_mat4(matrix))
}
