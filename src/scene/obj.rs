// SPDX-License-Identifier: MIT OR Apache-2.0
//! Wavefront OBJ with MTL.
//!
//! tobj parses a text that has been checked and rewritten first ([`front`]); polygons are
//! triangulated here ([`polygon`]).

mod front;
mod mtl;
mod names;
mod polygon;

use std::collections::hash_map::Entry;
use std::collections::{HashMap, HashSet};
use std::io::Read;
use std::path::Path;

use glam::{Affine3A, Vec2, Vec3};

use self::front::Problems;
use super::clean::{clean, fill_texcoords};
use super::error::{ErrorKind, Warning, Warnings};
use super::limits::{Budget, LoadLimits};
use super::resource::Files;
use super::{Instance, Loaded, Material, Mesh, Scene};

/// The name that tobj gives to what comes before the first `o` or `g`.
const UNNAMED: &str = "unnamed_object";

/// Reads `.obj` bytes; libraries and images are in `folder`.
pub(super) fn load(
    bytes: &[u8],
    folder: Option<&Path>,
    limits: &LoadLimits,
    mut budget: Budget,
) -> Result<Loaded, ErrorKind> {
    let mut warnings = Warnings::default();
    let bytes = &*front::as_utf8(bytes, "OBJ", &mut budget, &mut warnings)?;
    let declared = front::declared(bytes, limits)?;
    let mut files = Files::new(folder);
    let mut library = mtl::Library::default();
    let mut known = HashSet::new();
    for line in &declared.libraries {
        let exists = &mut |name: &str| files.find(name, Path::new("")).is_ok();
        for name in names::libraries(line, exists) {
            if known.insert(name) {
                mtl::read(&mut library, name, &mut files, limits, &mut budget, &mut warnings);
            }
        }
    }
    let checked = front::check(bytes, &declared, |name| library.find(name), limits, &mut budget)?;
    let mut problems = checked.problems;
    let mut lines = checked.face_lines.into_iter();

    let n_materials = library.materials.len();
    let (models, _) = tobj::load_obj_buf(
        &mut checked.vertices.as_bytes().chain(checked.faces.as_bytes()),
        &tobj::LoadOptions { single_index: true, ..Default::default() },
        |_| {
            let names = (0..n_materials).map(|i| (format!("m{i}"), i)).collect();
            Ok((vec![tobj::Material::default(); n_materials], names))
        },
    )
    .map_err(ErrorKind::Obj)?;
    drop((checked.vertices, checked.faces));

    let mut scene = Scene { origin: declared.origin, ..Scene::default() };
    let mut maker = mtl::Maker::new(files, limits);
    let mut materials = vec![None; n_materials + 1];
    for (mesh, material) in merged(models, &mut lines, limits, &mut problems) {
        let Some(mut mesh) = clean(mesh, &mut warnings) else {
            continue;
        };
        // The last slot is for faces without a material.
        let slot = material.unwrap_or(n_materials);
        mesh.material = match materials[slot] {
            Some(known) => known,
            None => {
                let made = match library.materials.get(slot) {
                    Some(source) => maker.material(source, &mut scene, &mut budget, &mut warnings),
                    None => Material::default(),
                };
                scene.materials.push(made);
                materials[slot] = Some(scene.materials.len() - 1);
                scene.materials.len() - 1
            }
        };
        fill_texcoords(&mut mesh, &scene.materials, &mut budget, &mut warnings)?;
        if scene.instances.len() >= limits.max_instances {
            return Err(ErrorKind::TooMuch {
                what: format!("object {}: instances", mesh.name),
                needed: limits.max_instances as u64 + 1,
                limit: limits.max_instances as u64,
                setting: "max_instances",
            });
        }
        scene
            .instances
            .push(Instance { mesh: scene.meshes.len(), world_from_object: Affine3A::IDENTITY });
        scene.meshes.push(mesh);
    }
    problems.report(&mut warnings);
    checked.passed.report("", &mut warnings);
    if scene.instances.is_empty() {
        warnings.push(Warning::NoTriangles);
    }
    Ok(Loaded { scene, warnings: warnings.into_vec() })
}

/// One mesh for all faces of an object with the same material, because files may switch between
/// materials thousands of times. Parts without normals are kept separate from parts with normals,
/// because they are flat.
fn merged(
    models: Vec<tobj::Model>,
    lines: &mut impl Iterator<Item = usize>,
    limits: &LoadLimits,
    problems: &mut Problems,
) -> Vec<(Mesh, Option<usize>)> {
    let mut meshes: Vec<(Mesh, Option<usize>)> = Vec::new();
    let mut known: HashMap<(String, Option<usize>, [bool; 3]), usize> = HashMap::new();
    for model in models {
        let material = model.mesh.material_id;
        let part = mesh(model, lines, limits, problems);
        let has = [!part.normals.is_empty(), !part.uv0.is_empty(), !part.colors.is_empty()];
        match known.entry((part.name.clone(), material, has)) {
            Entry::Occupied(mut entry) => {
                let whole = &mut meshes[*entry.get()].0;
                let n_vertices = whole.positions.len() + part.positions.len();
                match u32::try_from(n_vertices) {
                    Ok(_) => append(whole, part),
                    Err(_) => {
                        entry.insert(meshes.len());
                        meshes.push((part, material));
                    }
                }
            }
            Entry::Vacant(entry) => {
                entry.insert(meshes.len());
                meshes.push((part, material));
            }
        }
    }
    meshes
}

/// Both must have the same attributes, and together fewer than 2³² vertices.
fn append(whole: &mut Mesh, part: Mesh) {
    let first = whole.positions.len() as u32;
    let shifted = part.triangles.iter().map(|t| t.map(|i| i + first));
    whole.triangles.extend(shifted);
    whole.positions.extend(part.positions);
    whole.normals.extend(part.normals);
    whole.uv0.extend(part.uv0);
    whole.colors.extend(part.colors);
}

fn mesh(
    model: tobj::Model,
    lines: &mut impl Iterator<Item = usize>,
    limits: &LoadLimits,
    problems: &mut Problems,
) -> Mesh {
    let source = model.mesh;
    let vec3 = |c: &[f32]| Vec3::new(c[0], c[1], c[2]);
    let positions: Vec<Vec3> = source.positions.chunks_exact(3).map(vec3).collect();

    let n_triangular_faces =
        if source.face_arities.is_empty() { source.indices.len() / 3 } else { 0 };
    let arities =
        source.face_arities.iter().copied().chain(std::iter::repeat_n(3, n_triangular_faces));
    let mut triangles = Vec::with_capacity(source.indices.len() / 3);
    let mut rest = source.indices.as_slice();
    let mut corners = Vec::new();
    for arity in arities {
        let Some((face, after)) = rest.split_at_checked(arity as usize) else {
            break;
        };
        rest = after;
        let line = lines.next().unwrap_or(0);
        corners.clear();
        corners.extend(face.iter().map(|&i| positions[i as usize]));
        let (local, problem) = polygon::triangulate(&corners, limits.max_polygon_corners);
        if let Some(problem) = problem {
            problems.add(line, problem);
        }
        triangles.extend(local.iter().map(|t| t.map(|i| face[i as usize])));
    }

    // What the file does not give is NaN (colours: white).
    let given = |values: &[f32]| values.iter().any(|v| !v.is_nan());
    let normals = given(&source.normals).then_some(source.normals);
    let texcoords = given(&source.texcoords).then_some(source.texcoords);
    let is_colored = source.vertex_color.iter().any(|&v| v != 1.0);
    Mesh {
        name: if model.name == UNNAMED { "unnamed object".to_owned() } else { model.name },
        normals: normals.iter().flat_map(|n| n.chunks_exact(3)).map(vec3).collect(),
        // OBJ's v points up, glTF's down.
        uv0: texcoords
            .iter()
            .flat_map(|t| t.chunks_exact(2))
            .map(|c| Vec2::new(c[0], 1.0 - c[1]))
            .collect(),
        colors: if is_colored {
            source.vertex_color.chunks_exact(3).map(|c| vec3(c).extend(1.0)).collect()
        } else {
            Vec::new()
        },
        positions,
        triangles,
        ..Mesh::default()
    }
}
