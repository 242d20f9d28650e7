// SPDX-License-Identifier: MIT OR Apache-2.0
//! A [`Scene`] on the GPU, behind the scene seam: bind group 0 of every kernel.

mod atlas;
mod bvh;
mod bvh_height;
mod flatten;
mod lights;
pub mod sky;
mod surroundings;

use crate::bindings::lucerna::scene::data::{
    self as wgsl, MATERIAL_TEXELS, MATERIALS_PER_ROW, SceneInfo,
};
use crate::bindings::lucerna::scene::types::NONE;
use crate::gpu::{Bindings, Gpu, GpuError, Recorder, SceneGroup, Shaders, check_binding};
use crate::scene::{InvalidScene, Light, Material, Scene, Sky, check_sky};
use crate::seam::{Change, PunctualLight, Revisions, SceneFacts, SceneSeam, Surroundings};
use crate::shader::{NO_TEXTURES, RAY_QUERY, Variant};
use bytemuck::NoUninit;
use glam::Vec3;
use lights::{LightTable, MaterialEmission, SkyLight};
use wgpu::util::DeviceExt;

pub use crate::bindings::lucerna::scene::rays::BvhNode;
#[doc(hidden)]
pub use bvh::build_obvhs;
pub use bvh::{Bvh, STACK_SIZE};
pub use flatten::WorldTriangles;

/// Options for uploading a scene to the GPU.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct GpuSceneOptions {
    /// Replaces every surface with a Lambertian one whose albedo is the base colour: metallic is ignored and normal
    /// maps are not applied.
    pub diffuse_only: bool,
    /// What traces rays.
    pub rays: RaySource,
}

impl GpuSceneOptions {
    /// The same options, with every surface Lambertian or not.
    pub fn diffuse_only(mut self, diffuse_only: bool) -> Self {
        self.diffuse_only = diffuse_only;
        self
    }

    /// The same options, with another source of rays.
    pub fn rays(mut self, rays: RaySource) -> Self {
        self.rays = rays;
        self
    }
}

/// The implementation of `lucerna::scene::rays`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum RaySource {
    /// A BVH in storage buffers; runs everywhere.
    #[default]
    Software,
    /// The adapter's acceleration structure; needs `EXPERIMENTAL_RAY_QUERY`.
    RayQuery,
}

/// A scene could not be uploaded to the GPU.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum GpuSceneError {
    /// Indices or lengths of the scene's parts do not fit together.
    #[error("the scene is not valid: {0}")]
    Invalid(#[from] InvalidScene),
    /// A buffer is larger than the device can bind, or another limit of the device is exceeded.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// A texture or the sky is larger than the device allows.
    #[error("{what} does not fit: {detail}; {advice}")]
    TextureLimit {
        /// What was too large.
        what: &'static str,
        /// Sizes.
        detail: String,
        /// What to do.
        advice: &'static str,
    },
    /// There is no material with this index.
    #[error("there is no material {material_ix}: the scene has {n}")]
    NoMaterial {
        /// The index.
        material_ix: usize,
        /// How many materials the scene has.
        n: usize,
    },
    /// Ray queries were requested, but the device has none, or the feature `compose` is off.
    #[error(
        "this device has no ray queries, or lucerna's feature `compose` is off; use the software BVH instead"
    )]
    NoRayQuery,
}

/// Buffers and textures of a scene with their bind group. Lights, sky and the factors of materials can be changed; the
/// techniques' data then follow automatically ([`Revisions`]).
#[derive(Debug)]
pub struct GpuScene {
    facts: SceneFacts,
    revisions: Revisions,
    shaders: Shaders,
    info: SceneInfo,
    rays: RaySource,
    resources: Resources,
    group: SceneGroup,
    raster_group: SceneGroup,
    memory: SceneMemory,
    skipped_triangles: usize,
    order: Vec<u32>,
    /// As `order`, of what does not move; None: nothing moves.
    static_order: Option<Vec<u32>>,
    lights: Vec<Light>,
    sky_luminance: f32,
    /// As kernels see them.
    triangles: Vec<wgsl::Triangle>,
    materials: Vec<wgsl::Material>,
    emission: Vec<MaterialEmission>,
    cpu_rays: surroundings::CpuRays,
}

/// The resources of bind group 0, by the names of the shaders' variables.
#[derive(Debug)]
struct Resources {
    info: wgpu::Buffer,
    triangles: wgpu::Buffer,
    shading: wgpu::Buffer,
    materials: wgpu::TextureView,
    lights: wgpu::Buffer,
    atlas: wgpu::TextureView,
    sky_image: wgpu::TextureView,
    sky_distribution: wgpu::TextureView,
    rays: RayStructure,
}

#[derive(Debug)]
enum RayStructure {
    Nodes(wgpu::Buffer),
    // An acceleration structure must outlive its use.
    Acceleration(
        wgpu::Tlas,
        #[expect(dead_code, reason = "owned by the structure above")] wgpu::Blas,
    ),
}

impl Resources {
    fn bindings(&self) -> Bindings<'_> {
        let mut bindings: Bindings = vec![
            ("scene", (&self.info).into()),
            ("triangles", (&self.triangles).into()),
            ("triangle_shading", (&self.shading).into()),
            ("material_words", (&self.materials).into()),
            ("lights", (&self.lights).into()),
            ("atlas", (&self.atlas).into()),
            ("sky_image", (&self.sky_image).into()),
            ("sky_distribution", (&self.sky_distribution).into()),
        ];
        bindings.push(match &self.rays {
            RayStructure::Nodes(nodes) => ("bvh_nodes", nodes.into()),
            RayStructure::Acceleration(tlas, _) => ("acceleration", tlas.into()),
        });
        bindings
    }
}

/// A kernel that uses all bindings of the seam, and one that uses those of the rasteriser.
const ASKS_ALL: &str = "reference/path_trace";
const ASKS_RASTER: &str = "frame/gbuffer";

/// Memory on the GPU, in bytes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct SceneMemory {
    /// Nodes of the software BVH.
    pub bvh_nodes: u64,
    /// Corners and indices of triangles, for rays.
    pub triangles: u64,
    /// Normals, tangents, texture coordinates, colours.
    pub shading: u64,
    /// Material textures with their mips.
    pub textures: u64,
}

impl GpuScene {
    /// Flattens, builds the BVH, packs textures and uploads everything.
    ///
    /// # Errors
    /// [`GpuSceneError`]: indices or lengths of the scene do not fit together, a limit of the device is exceeded, or there
    /// are no ray queries.
    pub fn new(gpu: &Gpu, scene: &Scene, options: GpuSceneOptions) -> Result<Self, GpuSceneError> {
        Self::with_moving(gpu, scene, options, &|_| false)
    }

    /// As [`GpuScene::new`], but marks the triangles of the instances (by index) for which `moving` returns true with
    /// `TRIANGLE_MOVING`. Techniques update these more often than the others.
    ///
    /// # Errors
    /// As [`GpuScene::new`].
    pub fn with_moving(
        gpu: &Gpu,
        scene: &Scene,
        options: GpuSceneOptions,
        moving: &dyn Fn(usize) -> bool,
    ) -> Result<Self, GpuSceneError> {
        if options.rays == RaySource::RayQuery && !gpu.has_ray_query() {
            return Err(GpuSceneError::NoRayQuery);
        }
        scene.check_indices()?;
        let mut world = WorldTriangles::of(scene);
        let bvh = Bvh::build(&world.positions);
        let order = bvh.triangle_order().to_vec();
        let static_order = world.static_order(scene, moving, &order);
        world.reorder(&order);
        let (bounds_min, bounds_max) = world.bounds();

        let sky = sky::SkyTextures::upload(gpu, &scene.sky)?;
        let atlas = atlas::Atlas::build(gpu, scene)?;
        let mut triangles = world.ray_triangles(scene, moving);
        let shading = world.shading_triangles(scene);
        let materials = flatten::materials(scene, &atlas);
        let emission: Vec<_> =
            (0..scene.materials.len()).map(|ix| MaterialEmission::of(scene, ix)).collect();
        let radius = 0.5 * (bounds_max - bounds_min).length();
        let of_sky = SkyLight { mean_luminance: sky.mean_luminance };
        let lights = LightTable::build(&scene.lights, &triangles, &emission, radius, of_sky);
        set_lights_of_triangles(&mut triangles, &lights);

        let smaller = "split the scene or use a device with larger bindings";
        let rays = match options.rays {
            RaySource::Software => {
                RayStructure::Nodes(storage(gpu, "BVH nodes", bvh.nodes(), smaller)?)
            }
            RaySource::RayQuery => {
                let (blas, tlas) = bvh::build_acceleration_structure(gpu, &world.positions)?;
                RayStructure::Acceleration(tlas, blas)
            }
        };
        let resources = Resources {
            info: gpu.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("scene info"),
                size: size_of::<SceneInfo>() as u64,
                usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            }),
            triangles: storage(gpu, "triangles", &triangles, smaller)?,
            shading: storage(gpu, "triangle shading", &shading, smaller)?,
            materials: material_texture(gpu, &materials)?,
            lights: storage(gpu, "lights", lights.entries(), smaller)?,
            atlas: atlas.texels.clone(),
            sky_image: sky.image.clone(),
            sky_distribution: sky.distribution.clone(),
            rays,
        };
        let memory = SceneMemory {
            bvh_nodes: size_of_val(bvh.nodes()) as u64,
            triangles: size_of_val(triangles.as_slice()) as u64,
            shading: size_of_val(shading.as_slice()) as u64,
            textures: atlas.bytes,
        };
        let variant = Variant::BASELINE
            .with_if(options.rays == RaySource::RayQuery, RAY_QUERY)
            .with_if(atlas.n_images() == 0, NO_TEXTURES);
        let shaders = Shaders::new(variant);
        let group = SceneGroup::new(gpu, &shaders, &[ASKS_ALL], &resources.bindings());
        // The raster stages trace no rays and sample no lights.
        let raster_group = SceneGroup::new(gpu, &shaders, &[ASKS_RASTER], &resources.bindings());
        let mut made = Self {
            facts: SceneFacts {
                bounds_min,
                bounds_max,
                n_triangles: triangles.len() as u32,
                diffuse_only: options.diffuse_only,
                ..SceneFacts::default()
            },
            revisions: Revisions::fresh(),
            shaders,
            info: SceneInfo {
                bounds_min,
                n_triangles: triangles.len() as u32,
                bounds_max,
                n_lights: 0,
                sky_radiance: Vec3::ZERO,
                sky_has_image: 0,
                sky_size: sky.size,
                sky_light: NONE,
                diffuse_only: u32::from(options.diffuse_only),
                n_hittable_lights: 0,
                n_punctual_lights: 0,
                reserved_a: 0,
                reserved_b: 0,
            },
            rays: options.rays,
            resources,
            group,
            raster_group,
            memory,
            skipped_triangles: world.skipped,
            order,
            static_order,
            lights: scene.lights.clone(),
            sky_luminance: sky.mean_luminance,
            triangles,
            materials,
            emission,
            cpu_rays: surroundings::CpuRays::new(bvh.into_tree(), &world.positions),
        };
        made.describe_sky(&scene.sky, &sky);
        made.describe_lights(&lights);
        gpu.queue.write_buffer(&made.resources.info, 0, bytemuck::bytes_of(&made.info));
        Ok(made)
    }

    /// The same scene with your own module, such as `lucerna::scene::pixel` for your own G-buffer. Techniques that are
    /// made for it from here on use the module. (Feature `compose`.)
    #[cfg(feature = "compose")]
    pub fn with_module(mut self, module: crate::shader::Source) -> Self {
        self.shaders = self.shaders.with_module(module);
        self
    }

    /// Replaces the lights without extent.
    ///
    /// # Errors
    /// There are more lights than the device can bind.
    pub fn set_lights(
        &mut self,
        recorder: &mut Recorder,
        lights: &[Light],
    ) -> Result<(), GpuSceneError> {
        let table = self.light_table(recorder.gpu(), lights, &self.emission, self.sky_luminance)?;
        self.lights = lights.to_vec();
        self.take_lights(recorder, &table)?;
        self.revisions = self.revisions.changed(Change::Lights);
        Ok(())
    }

    /// Replaces the sky.
    ///
    /// # Errors
    /// The image is larger than the device's textures, or its length is not its width times its height.
    pub fn set_sky(&mut self, recorder: &mut Recorder, sky: &Sky) -> Result<(), GpuSceneError> {
        check_sky(sky)?;
        let textures = sky::SkyTextures::upload(recorder.gpu(), sky)?;
        let luminance = textures.mean_luminance;
        let table = self.light_table(recorder.gpu(), &self.lights, &self.emission, luminance)?;
        self.resources.sky_image = textures.image.clone();
        self.resources.sky_distribution = textures.distribution.clone();
        self.sky_luminance = luminance;
        self.describe_sky(sky, &textures);
        self.bind(recorder.gpu());
        self.take_lights(recorder, &table)?;
        self.revisions = self.revisions.changed(Change::Sky);
        Ok(())
    }

    /// Replaces a material's factors; its textures stay.
    ///
    /// # Errors
    /// The scene has no such material, or more triangles emit light than the device can bind lights.
    pub fn set_material(
        &mut self,
        recorder: &mut Recorder,
        material_ix: usize,
        material: &Material,
    ) -> Result<(), GpuSceneError> {
        let n = self.materials.len();
        let no_material = GpuSceneError::NoMaterial { material_ix, n };
        let known = self.materials.get(material_ix).ok_or(no_material)?;
        let mut materials = self.materials.clone();
        materials[material_ix] = wgsl::Material {
            base_color_texture: known.base_color_texture,
            metallic_roughness_texture: known.metallic_roughness_texture,
            normal_texture: known.normal_texture,
            emission_texture: known.emission_texture,
            ..flatten::factors(material)
        };
        let texture = material_texture(recorder.gpu(), &materials)?;
        let mut emission = self.emission.clone();
        emission[material_ix] =
            MaterialEmission::with_texture(material, self.emission[material_ix].texture);
        let shines = emission[material_ix] != self.emission[material_ix];
        let table = shines
            .then(|| self.light_table(recorder.gpu(), &self.lights, &emission, self.sky_luminance))
            .transpose()?;
        self.materials = materials;
        self.resources.materials = texture;
        self.bind(recorder.gpu());
        self.revisions = self.revisions.changed(Change::Materials);
        if let Some(table) = table {
            self.emission = emission;
            self.take_lights(recorder, &table)?;
            self.revisions = self.revisions.changed(Change::Lights);
        }
        Ok(())
    }

    /// The light table of these contents, if the device can bind it. (So that nothing has changed if it cannot.)
    fn light_table(
        &self,
        gpu: &Gpu,
        lights: &[Light],
        emission: &[MaterialEmission],
        sky_luminance: f32,
    ) -> Result<LightTable, GpuSceneError> {
        let radius = 0.5 * self.facts.diagonal();
        let sky = SkyLight { mean_luminance: sky_luminance };
        let table = LightTable::build(lights, &self.triangles, emission, radius, sky);
        check_binding(gpu, "lights", size_of_val(table.entries()) as u64, "use fewer lights")?;
        Ok(table)
    }

    /// Makes a table the scene's.
    fn take_lights(
        &mut self,
        recorder: &mut Recorder,
        lights: &LightTable,
    ) -> Result<(), GpuSceneError> {
        let gpu = recorder.gpu();
        if set_lights_of_triangles(&mut self.triangles, lights) {
            let bytes = bytemuck::cast_slice(&self.triangles);
            recorder.upload(&self.resources.triangles, 0, bytes);
        }
        let bytes: &[u8] = bytemuck::cast_slice(lights.entries());
        if bytes.len() as u64 <= self.resources.lights.size() {
            recorder.upload(&self.resources.lights, 0, bytes);
        } else {
            let advice = "use fewer lights";
            self.resources.lights = storage(gpu, "lights", lights.entries(), advice)?;
            self.bind(gpu);
        }
        self.describe_lights(lights);
        recorder.upload(&self.resources.info, 0, bytemuck::bytes_of(&self.info));
        Ok(())
    }

    /// Makes the bind groups of the current resources.
    fn bind(&mut self, gpu: &Gpu) {
        self.group.rebind(gpu, &self.resources.bindings());
        self.raster_group.rebind(gpu, &self.resources.bindings());
    }

    fn describe_sky(&mut self, sky: &Sky, textures: &sky::SkyTextures) {
        self.info.sky_radiance = match sky {
            Sky::Constant(radiance) => *radiance,
            Sky::Image { .. } => Vec3::ONE,
        };
        self.info.sky_has_image = u32::from(matches!(sky, Sky::Image { .. }));
        self.info.sky_size = textures.size;
    }

    fn describe_lights(&mut self, lights: &LightTable) {
        let n_punctual = lights.n_punctual as usize;
        self.info.n_lights = lights.len() as u32;
        self.info.sky_light = lights.sky;
        self.info.n_hittable_lights = lights.n_hittable();
        self.info.n_punctual_lights = lights.n_punctual;
        self.facts.n_extended_lights = lights.n_hittable();
        self.facts.punctual_lights =
            lights.entries()[..n_punctual].iter().map(PunctualLight::of_record).collect();
        self.facts.punctual_peaks = lights.punctual_peaks().to_vec();
        self.facts.drawn_peak = lights.drawn_peak();
        self.facts.drawn_extended_peak = lights.drawn_extended_peak();
        self.facts.brightest_emission =
            self.materials.iter().fold(0.0, |m, v| v.emission.max_element().max(m));
    }

    /// What traces rays.
    pub fn rays(&self) -> RaySource {
        self.rays
    }

    /// World-space box of all triangles \[m\]; zeros if there are none.
    pub fn bounds(&self) -> (Vec3, Vec3) {
        (self.facts.bounds_min, self.facts.bounds_max)
    }

    /// Number of triangles that rays can hit.
    pub fn n_triangles(&self) -> u32 {
        self.facts.n_triangles
    }

    /// Number of lights that can be sampled: punctual lights, emissive triangles, the sky.
    pub fn n_lights(&self) -> u32 {
        self.facts.n_lights()
    }

    /// Number of triangles left out because they have no area or are too far from the origin for f32.
    pub fn skipped_triangles(&self) -> usize {
        self.skipped_triangles
    }

    /// For each triangle, as kernels count them, its place in [`WorldTriangles::of`] the scene.
    pub fn triangle_order(&self) -> &[u32] {
        &self.order
    }

    /// For each triangle, as kernels count them, its place in [`WorldTriangles::of`] the scene without the instances that move (see
    /// [`GpuScene::with_moving`]); [`NO_MESH`](crate::seam::NO_MESH) for theirs.
    pub fn static_order(&self) -> &[u32] {
        self.static_order.as_ref().unwrap_or(&self.order)
    }

    /// How much memory the scene takes on the GPU.
    pub fn memory(&self) -> SceneMemory {
        self.memory
    }
}

impl SceneSeam for GpuScene {
    fn shaders(&self) -> &Shaders {
        &self.shaders
    }

    fn group(&self) -> &SceneGroup {
        &self.group
    }

    fn raster_group(&self) -> Option<&SceneGroup> {
        Some(&self.raster_group)
    }

    fn facts(&self) -> &SceneFacts {
        &self.facts
    }

    fn revisions(&self) -> Revisions {
        self.revisions
    }

    /// Found by 2048 rays (about 2 ms on a CPU); alpha masks are ignored.
    fn surroundings(&self, point: Vec3) -> Option<Surroundings> {
        self.cpu_rays.around(point)
    }

    /// Triangles that extend beyond the box count only as far as the box.
    fn bounds_within(&self, min: Vec3, max: Vec3) -> Option<(Vec3, Vec3)> {
        self.cpu_rays.bounds_within((min, max))
    }
}

/// Stores in each triangle which light it is; returns whether any has changed.
fn set_lights_of_triangles(triangles: &mut [wgsl::Triangle], lights: &LightTable) -> bool {
    let mut is_changed = false;
    for (ix, triangle) in triangles.iter_mut().enumerate() {
        let light = lights.of_triangle(ix);
        is_changed |= triangle.light != light;
        triangle.light = light;
    }
    is_changed
}

/// Materials as texels, `rgba32uint`.
fn material_texture(
    gpu: &Gpu,
    materials: &[wgsl::Material],
) -> Result<wgpu::TextureView, GpuSceneError> {
    const { assert!(size_of::<wgsl::Material>() == 16 * MATERIAL_TEXELS as usize) };
    let n = materials.len().max(1) as u32;
    let (columns, rows) = (n.min(MATERIALS_PER_ROW), n.div_ceil(MATERIALS_PER_ROW));
    let limit = gpu.device.limits().max_texture_dimension_2d;
    if rows > limit || columns * MATERIAL_TEXELS > limit {
        return Err(GpuSceneError::TextureLimit {
            what: "the table of materials",
            detail: format!("{n} materials, but the device allows {}", limit * MATERIALS_PER_ROW),
            advice: "merge equal materials",
        });
    }
    let mut words = vec![0u8; 16 * (columns * MATERIAL_TEXELS * rows) as usize];
    let bytes: &[u8] = bytemuck::cast_slice(materials);
    words[..bytes.len()].copy_from_slice(bytes);
    let size =
        wgpu::Extent3d { width: columns * MATERIAL_TEXELS, height: rows, depth_or_array_layers: 1 };
    let texture = gpu.device.create_texture_with_data(
        &gpu.queue,
        &wgpu::TextureDescriptor {
            label: Some("materials"),
            size,
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: wgpu::TextureFormat::Rgba32Uint,
            usage: wgpu::TextureUsages::TEXTURE_BINDING,
            view_formats: &[],
        },
        wgpu::util::TextureDataOrder::LayerMajor,
        &words,
    );
    Ok(texture.create_view(&Default::default()))
}

/// A storage buffer with these elements; one zeroed element if there are none, because bindings must not be empty.
fn storage<T: NoUninit>(
    gpu: &Gpu,
    what: &'static str,
    data: &[T],
    advice: &'static str,
) -> Result<wgpu::Buffer, GpuError> {
    check_binding(gpu, what, size_of_val(data) as u64, advice)?;
    let empty = vec![0; size_of::<T>()];
    let contents = if data.is_empty() { &empty } else { bytemuck::cast_slice(data) };
    Ok(gpu.device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
        label: Some(what),
        contents,
        usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST,
    }))
}
