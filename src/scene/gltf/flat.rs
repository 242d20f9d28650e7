// SPDX-License-Identifier: MIT OR Apache-2.0
//! Meshes that their node flattens: a scale of 0 along one axis makes a mesh flat.

use glam::{DAffine3, DMat3, DVec3};

use super::Loader;
use crate::scene::Mesh;
use crate::scene::clean::{clean, compact};
use crate::scene::error::{DropReason, ErrorKind, Warning};

/// Ratios below this are rounding errors of 64-bit matrices.
const ROUNDING: f64 = 1e-12;
/// A triangle counts as edge-on along the lost axis if it keeps less than this part of the area
/// that it could keep, because its corners have 32-bit rounding errors.
const EDGE_ON: f64 = 1e-6;
/// Bytes of a vertex with all its attributes, and of a triangle.
const VERTEX_BYTES: u64 = 72;
const TRIANGLE_BYTES: u64 = 12;

/// The inverse transpose times the determinant, which maps cross products, and so normals, even if
/// there is no inverse.
pub(super) fn cofactor(linear: &DMat3) -> DMat3 {
    DMat3::from_cols(
        linear.y_axis.cross(linear.z_axis),
        linear.z_axis.cross(linear.x_axis),
        linear.x_axis.cross(linear.y_axis),
    )
}

/// The root of the sum of squares, without intermediate overflow.
fn norm(m: &DMat3) -> f64 {
    DVec3::new(m.x_axis.length(), m.y_axis.length(), m.z_axis.length()).length()
}

/// Whether a transform loses an axis, or cannot be inverted in 32 bits.
pub(super) fn is_flat(world_from_object: &DAffine3) -> bool {
    let linear = &world_from_object.matrix3;
    let single = world_from_object.as_affine3a();
    !single.matrix3.determinant().is_normal()
        || !single.inverse().is_finite()
        || linear.determinant().abs() <= ROUNDING * norm(&cofactor(linear)) * norm(linear)
}

impl Loader<'_> {
    /// A copy of a mesh, flattened by the transform's linear part, without the triangles that lose
    /// their area; `None` if none are left. `mirrored`: whether the scales' signs mirror it.
    pub(super) fn flattened(
        &mut self,
        mesh: usize,
        linear: &DMat3,
        mirrored: bool,
        at: &str,
    ) -> Result<Option<usize>, ErrorKind> {
        let source = &self.scene.meshes[mesh];
        let cofactor = cofactor(linear);
        let strength = norm(&cofactor);
        let keeps_areas = strength > ROUNDING * norm(linear).powi(2);
        if !keeps_areas {
            return Ok(None);
        }
        self.budget.take(source.positions.len() as u64, VERTEX_BYTES, at)?;
        self.budget.take(source.triangles.len() as u64, TRIANGLE_BYTES, at)?;
        let mut made = Mesh { name: format!("{} at {at}", source.name), ..source.clone() };
        made.triangles.retain(|triangle| {
            let [a, b, c] = triangle.map(|i| source.positions[i as usize].as_dvec3());
            let normal = (b - a).cross(c - a);
            (cofactor * normal).length() > EDGE_ON * strength * normal.length()
        });
        let n = source.triangles.len() - made.triangles.len();
        if made.triangles.is_empty() {
            return Ok(None);
        }
        if n > 0 {
            let reason = DropReason::ZeroArea;
            self.warnings.push(Warning::Dropped { mesh: made.name.clone(), n, reason });
        }
        compact(&mut made);
        if mirrored {
            made.triangles.iter_mut().for_each(|t| t.swap(1, 2));
        }
        for position in &mut made.positions {
            *position = (*linear * position.as_dvec3()).as_vec3();
        }
        // A flat mesh has only one normal direction: that of its triangles.
        made.normals.clear();
        made.tangents.clear();
        let Some(made) = clean(made, &mut self.warnings) else {
            return Ok(None);
        };
        Ok(Some(self.add_mesh(made)))
    }
}
