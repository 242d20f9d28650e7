// SPDX-License-Identifier: MIT OR Apache-2.0
//! glTF 2.0, text and binary.
//!
//! The `gltf` crate parses the JSON. All that the JSON refers to is checked and read here, because the crate's own
//! accessors trust the file.

mod accessor;
mod container;
mod flat;
mod light;
mod material;
mod mesh;
mod nodes;
mod skin;

use std::borrow::Cow;
use std::path::Path;

use glam::{Affine3A, DAffine3, DVec3, Vec3};
use gltf::json::Root;

use self::accessor::Data;
use self::material::ImageSlot;
use self::nodes::{Placed, Worlds};
use self::skin::Pose;
use super::error::{ErrorKind, ResourceError, Warning, Warnings, short};
use super::limits::{Budget, LoadLimits};
use super::rebase::{Part, origin_of};
use super::resource::Files;
use super::{Instance, Light, Loaded, MAX_COORDINATE, Scene};

/// The state while a file is read.
struct Loader<'a> {
    data: Data<'a>,
    files: Files<'a>,
    limits: &'a LoadLimits,
    budget: Budget,
    /// Instanced triangles so far.
    n_triangles: u64,
    /// Instances so far, including those left out.
    n_placed: u64,
    warnings: Warnings,
    scene: Scene,
    // Transforms of the scene's instances, cameras and lights, in 64 bits and in the file's world.
    instance_worlds: Vec<DAffine3>,
    camera_places: Vec<DVec3>,
    light_places: Vec<DVec3>,
    worlds: Worlds,
    /// Least and greatest corner of each of the scene's meshes.
    boxes: Vec<[Vec3; 2]>,
    // What each element of the file has become; `None` until something uses it.
    meshes: Vec<Option<Vec<usize>>>,
    materials: Vec<Option<usize>>,
    default_material: Option<usize>,
    /// The problem's text if a skin cannot be used.
    poses: Vec<Option<Result<Pose, String>>>,
    textures: Vec<Option<(usize, ImageSlot)>>,
    images: Vec<Option<ImageSlot>>,
}

/// Reads `.gltf` or `.glb` bytes; files that they name are in `folder`.
pub(super) fn load(
    bytes: &[u8],
    folder: Option<&Path>,
    limits: &LoadLimits,
    mut budget: Budget,
) -> Result<Loaded, ErrorKind> {
    let (root, bin) = container::parse(bytes, &mut budget)?;
    let mut files = Files::new(folder);
    let mut warnings = Warnings::default();
    let buffers = read_buffers(&root, bin, &mut files, &mut budget, &mut warnings)?;
    warn_ignored(&root, &mut warnings);
    let (placed, worlds) = nodes::place(&root, limits, &mut warnings)?;
    let mut loader = Loader {
        meshes: vec![None; root.meshes.len()],
        materials: vec![None; root.materials.len()],
        default_material: None,
        textures: vec![None; root.textures.len()],
        images: vec![None; root.images.len()],
        data: Data { root: &root, buffers },
        files,
        limits,
        budget,
        n_triangles: 0,
        n_placed: 0,
        worlds,
        boxes: Vec::new(),
        poses: vec![None; root.skins.len()],
        warnings,
        scene: Scene::default(),
        instance_worlds: Vec::new(),
        camera_places: Vec::new(),
        light_places: Vec::new(),
    };
    for placed in &placed {
        loader.node(placed)?;
    }
    loader.rebase();
    if loader.scene.instances.is_empty() {
        loader.warnings.push(Warning::NoTriangles);
    }
    Ok(Loaded { scene: loader.scene, warnings: loader.warnings.into_vec() })
}

fn read_buffers<'a>(
    root: &Root,
    bin: Option<&'a [u8]>,
    files: &mut Files,
    budget: &mut Budget,
    warnings: &mut Warnings,
) -> Result<Vec<Cow<'a, [u8]>>, ErrorKind> {
    let mut buffers = Vec::with_capacity(root.buffers.len());
    for (ix, buffer) in root.buffers.iter().enumerate() {
        let failed = |source| ErrorKind::Buffer { buffer: ix, source };
        let mut bytes = match (&buffer.uri, bin) {
            (Some(uri), _) => {
                let at = format!("buffers[{ix}]");
                Cow::Owned(files.read_uri(uri, &at, budget, warnings).map_err(failed)?)
            }
            (None, Some(bin)) if ix == 0 => Cow::Borrowed(bin),
            (None, _) => return Err(failed(ResourceError::Missing)),
        };
        let expected = buffer.byte_length.0;
        let found = bytes.len() as u64;
        match usize::try_from(expected).ok().filter(|&n| n <= bytes.len()) {
            Some(n) => match &mut bytes {
                Cow::Owned(bytes) => bytes.truncate(n),
                Cow::Borrowed(bytes) => *bytes = &bytes[..n],
            },
            None => return Err(failed(ResourceError::TooShort { found, expected })),
        }
        buffers.push(bytes);
    }
    Ok(buffers)
}

fn warn_ignored(root: &Root, warnings: &mut Warnings) {
    let unknown = |name: &&String| !container::EXTENSIONS.contains(&name.as_str());
    for name in root.extensions_used.iter().filter(unknown) {
        warnings.push(Warning::Ignored { at: "extensionsUsed".to_owned(), what: short(name) });
    }
    if !root.animations.is_empty() {
        warnings.push(Warning::Ignored {
            at: "animations".to_owned(),
            what: format!("{} animation(s) (everything is at rest)", root.animations.len()),
        });
    }
}

impl Loader<'_> {
    fn node(&mut self, placed: &Placed) -> Result<(), ErrorKind> {
        let node = &self.data.root.nodes[placed.node];
        let at = named("nodes", placed.node, node.name.as_deref());
        if let Some(camera) = node.camera {
            self.camera(camera.value(), placed, &at)?;
        }
        let light = node.extensions.as_ref().and_then(|e| e.khr_lights_punctual.as_ref());
        if let Some(light) = light {
            self.light(light.light.value(), placed, &at)?;
        }
        let Some(mesh) = node.mesh else {
            return Ok(());
        };
        let Some(skin) = &node.skin else {
            let meshes = self.mesh(mesh.value(), &at)?;
            return self.instances(&meshes, &placed.world_from_object, placed.mirrored, &at);
        };
        // The node's own transform has no effect.
        let meshes = match self.pose(skin.value(), &at)? {
            Some(pose) => self.skinned_mesh(mesh.value(), &pose, &at)?,
            None => self.mesh(mesh.value(), &at)?,
        };
        self.instances(&meshes, &DAffine3::IDENTITY, false, &at)
    }

    fn count_placed(&mut self, n: usize, at: &str) -> Result<(), ErrorKind> {
        self.n_placed += n as u64;
        if self.n_placed > self.limits.max_instances as u64 {
            return Err(ErrorKind::TooMuch {
                what: format!("{at}: instances"),
                needed: self.n_placed,
                limit: self.limits.max_instances as u64,
                setting: "max_instances",
            });
        }
        Ok(())
    }

    fn instances(
        &mut self,
        meshes: &[usize],
        world: &DAffine3,
        mirrored: bool,
        at: &str,
    ) -> Result<(), ErrorKind> {
        // Counted before any is left out, because each costs time.
        self.count_placed(meshes.len(), at)?;
        let is_flat = flat::is_flat(world);
        for &mesh in meshes {
            let mut placed = Some((mesh, world.as_affine3a()));
            if is_flat {
                let translation = Affine3A::from_translation(world.translation.as_vec3());
                placed = self
                    .flattened(mesh, &world.matrix3, mirrored, at)?
                    .map(|mesh| (mesh, translation));
            }
            let problem = match &placed {
                None => Some("its transform flattens the mesh (singular matrix); mesh left out"),
                Some((mesh, world)) if !stays_in_reach(&self.boxes[*mesh], world) => {
                    Some("its mesh reaches beyond 1e9 m; mesh left out")
                }
                Some(_) => None,
            };
            if let Some(problem) = problem {
                self.warnings.push(Warning::Transform { node: at.to_owned(), problem });
            }
            let Some((mesh, world_from_object)) = placed.filter(|_| problem.is_none()) else {
                continue;
            };
            let n = self.scene.meshes[mesh].triangles.len() as u64;
            self.n_triangles = self.n_triangles.saturating_add(n);
            self.check_triangles(self.n_triangles, at)?;
            self.scene.instances.push(Instance { mesh, world_from_object });
            let whole =
                if is_flat { DAffine3::from_translation(world.translation) } else { *world };
            self.instance_worlds.push(whole);
        }
        Ok(())
    }

    /// Moves a scene that is far from its origin close to it, in 64 bits; and does the same to meshes that are far from
    /// their own origin.
    fn rebase(&mut self) {
        let middles: Vec<DVec3> =
            self.boxes.iter().map(|&[min, max]| 0.5 * (min.as_dvec3() + max.as_dvec3())).collect();
        let half_extent = |mesh: usize| {
            let [min, max] = self.boxes[mesh];
            0.5 * f64::from((max - min).max_element())
        };
        let parts: Vec<Part> = self
            .scene
            .instances
            .iter()
            .zip(&self.instance_worlds)
            .map(|(instance, world)| Part {
                center: world.transform_point3(middles[instance.mesh]),
                half_extent: half_extent(instance.mesh) * largest_scale(world),
                weight: self.scene.meshes[instance.mesh].triangles.len() as u64,
            })
            .collect();
        let origin = origin_of(&parts);
        // A mesh's own middle is a float, and so are the differences from it if it is far away.
        let alone =
            |mesh: usize| Part { center: middles[mesh], half_extent: half_extent(mesh), weight: 1 };
        let shifts: Vec<DVec3> = (0..middles.len()).map(|mesh| origin_of(&[alone(mesh)])).collect();
        if origin == DVec3::ZERO && shifts.iter().all(|&shift| shift == DVec3::ZERO) {
            return;
        }
        self.scene.origin = origin;
        for (mesh, &shift) in self.scene.meshes.iter_mut().zip(&shifts) {
            for position in &mut mesh.positions {
                *position = (position.as_dvec3() - shift).as_vec3();
            }
        }
        for (instance, world) in self.scene.instances.iter_mut().zip(&self.instance_worlds) {
            let world = DAffine3::from_translation(-origin)
                * *world
                * DAffine3::from_translation(shifts[instance.mesh]);
            instance.world_from_object = world.as_affine3a();
        }
        for (camera, place) in self.scene.cameras.iter_mut().zip(&self.camera_places) {
            camera.position = (*place - origin).as_vec3();
        }
        for (light, place) in self.scene.lights.iter_mut().zip(&self.light_places) {
            if let Light::Point { position, .. } | Light::Spot { position, .. } = light {
                *position = (*place - origin).as_vec3();
            }
        }
    }

    fn check_triangles(&self, n: u64, at: &str) -> Result<(), ErrorKind> {
        if n <= self.limits.max_triangles {
            return Ok(());
        }
        Err(ErrorKind::TooMuch {
            what: format!("{at}: triangles"),
            needed: n,
            limit: self.limits.max_triangles,
            setting: "max_triangles",
        })
    }
}

/// The largest factor by which a transform stretches an axis.
fn largest_scale(world: &DAffine3) -> f64 {
    let m = &world.matrix3;
    m.x_axis.length().max(m.y_axis.length()).max(m.z_axis.length())
}

/// Whether a box (least and greatest corner) stays within [`MAX_COORDINATE`].
fn stays_in_reach(&[min, max]: &[Vec3; 2], world_from_object: &Affine3A) -> bool {
    (0..8).all(|i| {
        let pick = |axis: usize| if i >> axis & 1 == 0 { min } else { max };
        let corner = Vec3::new(pick(0).x, pick(1).y, pick(2).z);
        let corner = world_from_object.transform_point3(corner);
        // Comparisons with NaN are false.
        corner.abs().cmple(Vec3::splat(MAX_COORDINATE)).all()
    })
}

/// The element, or an error that says which index points past the end.
fn index<'a, T>(
    array: &'a [T],
    index: usize,
    of: &'static str,
    at: impl FnOnce() -> String,
) -> Result<&'a T, ErrorKind> {
    array.get(index).ok_or_else(|| ErrorKind::Index { at: at(), index, of, len: array.len() })
}

/// `nodes[3] (table)`.
fn named(of: &str, ix: usize, name: Option<&str>) -> String {
    match name {
        Some(name) if !name.is_empty() => format!("{of}[{ix}] ({})", short(name)),
        _ => format!("{of}[{ix}]"),
    }
}

/// A world-space unit vector from a node's axis; scale is ignored.
fn direction(placed: &Placed, axis: Vec3) -> Option<Vec3> {
    let v = placed.world_from_object.transform_vector3(axis.as_dvec3()).normalize().as_vec3();
    v.is_finite().then_some(v)
}
