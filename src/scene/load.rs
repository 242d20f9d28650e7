// SPDX-License-Identifier: MIT OR Apache-2.0
//! Loading by file name, and queries about a whole scene.

use std::path::Path;

use glam::Vec3;

use super::Scene;
use super::error::{ErrorKind, SceneError, Warning, short};
#[cfg(any(feature = "gltf", feature = "obj"))]
use super::limits::Budget;
use super::limits::LoadLimits;

/// A loaded scene, and which parts of its file were skipped or replaced.
#[derive(Debug)]
pub struct Loaded {
    /// The scene.
    pub scene: Scene,
    /// What differs from the file; empty if everything was understood. [`Display`] names the place.
    ///
    /// [`Display`]: std::fmt::Display
    pub warnings: Vec<Warning>,
}

impl Scene {
    /// Reads a `.gltf`, `.glb` or `.obj` file (by its extension, in upper or lower case) and the files that it names,
    /// which must be in its folder or below. The file is not trusted. The formats need the features `gltf` and `obj`,
    /// and those of their images `png` and `jpeg`.
    ///
    /// The returned scene has these properties, which [`Scene::validate`] checks:
    ///
    /// * every index is in range; attribute arrays are empty or as long as `positions`;
    /// * every number is finite; no coordinate is beyond [`super::MAX_COORDINATE`], in object or world space; normals,
    ///   tangents and directions have unit length;
    /// * every mesh has triangles, and each has an area: its normal can be computed in 32-bit
    ///   floats; `world_from_object` can be inverted;
    /// * a mesh has each set of texture coordinates that its material reads;
    /// * an image has `width · height ≥ 1` texels;
    /// * factors of materials and lights are within the ranges documented at their fields.
    ///
    /// Triangles with NaN, infinite, huge or out-of-range corners, or without area, are dropped; normals, tangents,
    /// texture coordinates and colours that are not finite are replaced; images that cannot be read become white (a
    /// normal map: none; an emissive texture: no emission). Each gives a [`Warning`]. From a glTF file, only what its
    /// default scene uses is read. If there is no default, this is the first scene, with a warning if there are more;
    /// if there are no scenes, all nodes are read.
    ///
    /// A file is also found, with a warning, if its name differs in case or in the encoding of accents. A name in a URI
    /// that is not percent-encoded is used as it is.
    ///
    /// **glTF 2.0**: `KHR_lights_punctual`, `KHR_materials_emissive_strength` and `KHR_texture_transform` are read; a
    /// file that requires another extension is rejected. Candela and lux are read as W·sr⁻¹ and W·m⁻². Lights and
    /// cameras ignore their node's scale. A camera has the name of its node, or else its own. A spot light whose inner
    /// angle is not below its outer angle gets a falloff over 1/1000 of the outer angle. `alphaMode` BLEND is read as
    /// MASK with cutoff 0.5. An accessor without a buffer view holds zeros. A mesh with a skin is in its rest pose,
    /// which is computed here: it becomes a separate mesh in world space, and its node's transform has no effect. A
    /// mesh whose node flattens it (a scale of 0 along one axis) becomes a separate flat-shaded mesh, without the
    /// triangles that lose their area. Morph targets, animations, points and lines are ignored, with a warning.
    ///
    /// **OBJ**: one mesh per object (or group) and material, in the file's own unit. Polygons of more than 4 corners
    /// are triangulated by constrained Delaunay on their Newell plane, quads along the diagonal that is inside; a
    /// polygon that intersects itself becomes a fan, with a warning. From MTL: base colour `Kd`, `map_Kd`; alpha `d`
    /// (or 1 − `Tr`) and `map_d`, as masks with cutoff 0.5; emitted radiance `Ke` (1 if only `map_Ke` is given),
    /// `map_Ke`; roughness `Pr`, or else `(2 / (Ns + 2))^¼` (1 without `Ns`, or if `Ks` is black); metallic `Pm`;
    /// normals `norm`. Without a material: [`Material::default`](super::Material::default). A `mtllib` may name several
    /// libraries; names may be quoted. Textures are looked up in the folder of their library, or else in that of the
    /// OBJ file. Lines end in LF, CR LF or CR; UTF-16, Latin-1 and decimal commas are read, with a warning. A keyword
    /// that is unknown, or that has an unsupported effect, gives one warning per file; `s`, `illum`, `Ka`, `Ni` and
    /// others without effect here give none.
    ///
    /// # Errors
    ///
    /// The file's format was not built in; or the file, or a buffer that it needs, cannot be read, is not valid in its
    /// format, requires an unsupported extension, or exceeds `limits`.
    pub fn load(path: &Path, limits: &LoadLimits) -> Result<Loaded, SceneError> {
        load(path, limits).map_err(|kind| SceneError { file: Some(path.to_owned()), kind })
    }

    /// Like [`Scene::load`], from the bytes of a `.gltf` or `.glb` file. Files that it names are in `folder`; without a
    /// folder, it may not name any.
    ///
    /// # Errors
    ///
    /// As [`Scene::load`]; a missing folder counts as an unreadable file.
    #[cfg(feature = "gltf")]
    pub fn from_gltf_slice(
        bytes: &[u8],
        folder: Option<&Path>,
        limits: &LoadLimits,
    ) -> Result<Loaded, SceneError> {
        Ok(super::gltf::load(bytes, folder, limits, Budget::new(limits))?)
    }

    /// Like [`Scene::load`], from the bytes of an `.obj` file. Material libraries and images are in `folder`; without a
    /// folder, they are left out with a warning.
    ///
    /// # Errors
    ///
    /// As [`Scene::load`].
    #[cfg(feature = "obj")]
    pub fn from_obj_slice(
        bytes: &[u8],
        folder: Option<&Path>,
        limits: &LoadLimits,
    ) -> Result<Loaded, SceneError> {
        Ok(super::obj::load(bytes, folder, limits, Budget::new(limits))?)
    }

    /// Least and greatest corner of the box around all triangles in world space \[m\]; `None` without triangles.
    pub fn bounds(&self) -> Option<(Vec3, Vec3)> {
        let mut bounds: Option<(Vec3, Vec3)> = None;
        for instance in &self.instances {
            let mesh = &self.meshes[instance.mesh];
            for &corner in mesh.triangles.iter().flatten() {
                let p =
                    instance.world_from_object.transform_point3(mesh.positions[corner as usize]);
                let (min, max) = bounds.unwrap_or((p, p));
                bounds = Some((min.min(p), max.max(p)));
            }
        }
        bounds
    }

    /// Number of triangles in the world: those of each mesh, times the number of its instances.
    pub fn n_triangles(&self) -> u64 {
        self.instances
            .iter()
            .map(|instance| self.meshes[instance.mesh].triangles.len() as u64)
            .sum()
    }
}

#[cfg_attr(not(any(feature = "gltf", feature = "obj")), allow(unused_variables))]
fn load(path: &Path, limits: &LoadLimits) -> Result<Loaded, ErrorKind> {
    let extension =
        path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase()).unwrap_or_default();
    match extension.as_str() {
        #[cfg(feature = "gltf")]
        "gltf" | "glb" => read(path, limits, super::gltf::load),
        #[cfg(not(feature = "gltf"))]
        "gltf" | "glb" => Err(ErrorKind::NotBuiltIn { format: "glTF", feature: "gltf" }),
        #[cfg(feature = "obj")]
        "obj" => read(path, limits, super::obj::load),
        #[cfg(not(feature = "obj"))]
        "obj" => Err(ErrorKind::NotBuiltIn { format: "OBJ", feature: "obj" }),
        _ => Err(ErrorKind::UnknownFormat { extension: short(&extension) }),
    }
}

/// A format's loader, from bytes and a folder.
#[cfg(any(feature = "gltf", feature = "obj"))]
type Loader = fn(&[u8], Option<&Path>, &LoadLimits, Budget) -> Result<Loaded, ErrorKind>;

/// Reads the file for one of the formats.
#[cfg(any(feature = "gltf", feature = "obj"))]
fn read(path: &Path, limits: &LoadLimits, load: Loader) -> Result<Loaded, ErrorKind> {
    let mut budget = Budget::new(limits);
    let bytes = super::resource::read_file(path, &mut budget)?;
    let folder = match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    load(&bytes, Some(folder), limits, budget)
}
