// SPDX-License-Identifier: MIT OR Apache-2.0
//! Turns primitives into meshes.

use glam::{Vec2, Vec3, Vec4};
use gltf::json::mesh::{Mode, Primitive, Semantic};
use gltf::json::validation::Checked;
use gltf::json::{Accessor, Index};

use super::skin::Pose;
use super::{Loader, index};
use crate::scene::Mesh;
use crate::scene::clean::{clean, fill_texcoords};
use crate::scene::error::{DataProblem, ErrorKind, Warning, short};

impl Loader<'_> {
    /// The scene's meshes for a glTF mesh: one per primitive that has triangles. Read once.
    pub(super) fn mesh(&mut self, mesh_ix: usize, at: &str) -> Result<Vec<usize>, ErrorKind> {
        let mesh = index(&self.data.root.meshes, mesh_ix, "meshes", || format!("{at}.mesh"))?;
        if let Some(known) = &self.meshes[mesh_ix] {
            return Ok(known.clone());
        }
        let name = mesh_name(mesh, mesh_ix);
        let mut made = Vec::new();
        for (i, primitive) in mesh.primitives.iter().enumerate() {
            let at = format!("{name}.primitives[{i}]");
            if let Some(mesh) = self.primitive(primitive, at, None)? {
                made.push(self.add_mesh(mesh));
            }
        }
        self.meshes[mesh_ix] = Some(made.clone());
        Ok(made)
    }

    /// As [`Self::mesh`], for a mesh with a skin, at rest in world space: each node has its own
    /// copy.
    pub(super) fn skinned_mesh(
        &mut self,
        mesh_ix: usize,
        pose: &Pose,
        at: &str,
    ) -> Result<Vec<usize>, ErrorKind> {
        let mesh = index(&self.data.root.meshes, mesh_ix, "meshes", || format!("{at}.mesh"))?;
        let name = mesh_name(mesh, mesh_ix);
        // Counted before they are read, because each costs time even if nothing is left of it.
        self.count_placed(mesh.primitives.len(), at)?;
        let mut made = Vec::new();
        for (i, primitive) in mesh.primitives.iter().enumerate() {
            let at = format!("{name}.primitives[{i}] at {at}");
            if let Some(mesh) = self.primitive(primitive, at, Some(pose))? {
                made.push(self.add_mesh(mesh));
            }
        }
        Ok(made)
    }

    pub(super) fn add_mesh(&mut self, mesh: Mesh) -> usize {
        let start = [mesh.positions[0]; 2];
        let bounds = mesh.positions.iter().fold(start, |[min, max], &p| [min.min(p), max.max(p)]);
        self.boxes.push(bounds);
        self.scene.meshes.push(mesh);
        self.scene.meshes.len() - 1
    }

    fn primitive(
        &mut self,
        primitive: &Primitive,
        at: String,
        pose: Option<&Pose>,
    ) -> Result<Option<Mesh>, ErrorKind> {
        let skip = |what: &str| Warning::Ignored { at: at.clone(), what: what.to_owned() };
        let Checked::Valid(mode) = primitive.mode else {
            return Err(ErrorKind::Data { at, problem: DataProblem::Unknown("mode") });
        };
        if matches!(mode, Mode::Points | Mode::Lines | Mode::LineLoop | Mode::LineStrip) {
            self.warnings.push(skip("a primitive of points or lines is"));
            return Ok(None);
        }
        if primitive.targets.is_some() {
            self.warnings.push(skip("morph targets are"));
        }
        let attribute = |semantic| primitive.attributes.get(&Checked::Valid(semantic)).copied();
        let Some(position) = attribute(Semantic::Positions) else {
            self.warnings.push(skip("a primitive without POSITION is"));
            return Ok(None);
        };

        let positions: Vec<[f32; 3]> = self.floats(position, &at, "POSITION")?;
        let n = positions.len();
        let triangles = self.triangles(primitive.indices, mode, n, &at)?;
        let material = self.material(primitive.material.map(|m| m.value()), &at)?;
        let mut mesh = Mesh {
            positions: positions.into_iter().map(Vec3::from_array).collect(),
            triangles,
            material,
            ..Mesh::default()
        };
        if let Some(ix) = attribute(Semantic::Normals) {
            let normals = self.floats(ix, &at, "NORMAL")?;
            mesh.normals = convert(normals, Vec3::from_array, n, ix, &at, "NORMAL")?;
        }
        if let Some(ix) = attribute(Semantic::Tangents) {
            let tangents = self.floats(ix, &at, "TANGENT")?;
            mesh.tangents = convert(tangents, Vec4::from_array, n, ix, &at, "TANGENT")?;
        }
        if let Some(ix) = attribute(Semantic::TexCoords(0)) {
            let uvs = self.unorms(ix, &at, "TEXCOORD_0")?;
            mesh.uv0 = convert(uvs, Vec2::from_array, n, ix, &at, "TEXCOORD_0")?;
        }
        if let Some(ix) = attribute(Semantic::TexCoords(1)) {
            let uvs = self.unorms(ix, &at, "TEXCOORD_1")?;
            mesh.uv1 = convert(uvs, Vec2::from_array, n, ix, &at, "TEXCOORD_1")?;
        }
        if let Some(ix) = attribute(Semantic::Colors(0)) {
            mesh.colors = if self.data.n_components(ix, &at)? == 3 {
                let colors = self.unorms(ix, &at, "COLOR_0")?;
                let opaque = |c| Vec3::from_array(c).extend(1.0);
                convert(colors, opaque, n, ix, &at, "COLOR_0")?
            } else {
                let colors = self.unorms(ix, &at, "COLOR_0")?;
                convert(colors, Vec4::from_array, n, ix, &at, "COLOR_0")?
            };
        }
        if let Some(pose) = pose {
            self.apply_pose(pose, primitive, &mut mesh, &at)?;
        }
        mesh.name = at;
        let Some(mut mesh) = clean(mesh, &mut self.warnings) else {
            return Ok(None);
        };
        fill_texcoords(&mut mesh, &self.scene.materials, &mut self.budget, &mut self.warnings)?;
        Ok(Some(mesh))
    }

    fn floats<const N: usize>(
        &mut self,
        ix: Index<Accessor>,
        at: &str,
        attribute: &str,
    ) -> Result<Vec<[f32; N]>, ErrorKind> {
        let at = format!("{at}.{attribute}");
        self.data.floats(ix, &at, &mut self.budget, &mut self.warnings)
    }

    fn unorms<const N: usize>(
        &mut self,
        ix: Index<Accessor>,
        at: &str,
        attribute: &str,
    ) -> Result<Vec<[f32; N]>, ErrorKind> {
        let at = format!("{at}.{attribute}");
        self.data.unorms(ix, &at, &mut self.budget, &mut self.warnings)
    }

    fn triangles(
        &mut self,
        indices: Option<Index<Accessor>>,
        mode: Mode,
        n_vertices: usize,
        at: &str,
    ) -> Result<Vec<[u32; 3]>, ErrorKind> {
        let at = format!("{at}.indices");
        let indices = match indices {
            Some(ix) => self.data.indices(ix, &at, &mut self.budget, &mut self.warnings)?,
            None => {
                self.budget.take(n_vertices as u64, 4, &at)?;
                (0..n_vertices as u32).collect()
            }
        };
        let n_triangles = match mode {
            Mode::Triangles => indices.len() / 3,
            _ => indices.len().saturating_sub(2),
        };
        self.check_triangles(n_triangles as u64, &at)?;
        self.budget.take(n_triangles as u64, 12, &at)?;
        let n_left_over = match mode {
            Mode::Triangles => indices.len() % 3,
            _ if n_triangles == 0 => indices.len(),
            _ => 0,
        };
        if n_left_over > 0 {
            self.warnings.push(Warning::Ignored {
                at: at.clone(),
                what: format!("{n_left_over} corner(s) that do not form a triangle"),
            });
        }
        Ok(match mode {
            Mode::TriangleStrip => indices
                .windows(3)
                .enumerate()
                // Every other triangle of a strip has the opposite winding.
                .map(|(i, w)| if i % 2 == 0 { [w[0], w[1], w[2]] } else { [w[0], w[2], w[1]] })
                .collect(),
            Mode::TriangleFan => {
                indices.windows(2).skip(1).map(|w| [w[0], w[1], indices[0]]).collect()
            }
            _ => indices.chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect(),
        })
    }
}

fn mesh_name(mesh: &gltf::json::Mesh, mesh_ix: usize) -> String {
    match &mesh.name {
        Some(name) => short(name),
        None => format!("meshes[{mesh_ix}]"),
    }
}

fn convert<T, U>(
    values: Vec<T>,
    to: impl Fn(T) -> U,
    n: usize,
    ix: Index<Accessor>,
    at: &str,
    attribute: &str,
) -> Result<Vec<U>, ErrorKind> {
    if values.len() != n {
        return Err(ErrorKind::Data {
            at: format!("{at}.{attribute}: accessors[{}]", ix.value()),
            problem: DataProblem::Count { found: values.len(), expected: n },
        });
    }
    Ok(values.into_iter().map(to).collect())
}
