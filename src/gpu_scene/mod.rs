//! A [`Scene`] on the GPU, behind the host seam: bind group 0 of every kernel.

mod atlas;
mod bvh;
mod bvh_height;
mod flatten;
mod lights;
mod sky;
mod surroundings;

use crate::bindings::baseline::kernels::frame::gbuffer as raster_seam;
use crate::bindings::baseline::kernels::reference::path_trace as seam;
use crate::bindings::host::scene::{Light, SceneInfo};
use crate::bindings::ray_query::kernels::reference::path_trace as ray_query_seam;
use crate::gpu::{Gpu, GpuError};
use crate::scene::{Scene, Sky};
use bytemuck::NoUninit;
use glam::Vec3;
use wgpu::util::DeviceExt;

pub use bvh::{Bvh, STACK_SIZE, build_obvhs};
pub use flatten::WorldTriangles;
pub use lights::LightPeak;
pub use surroundings::Surroundings;

/// How a scene is put on the GPU.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct GpuSceneOptions {
    /// Every surface is Lambert with its base colour as albedo: metallic is ignored and normal maps
    /// are not applied.
    pub diffuse_only: bool,
    /// Which structure answers rays.
    pub rays: RaySource,
}

/// What stands behind `lucerna::host::rays`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum RaySource {
    /// A BVH in storage buffers; runs everywhere.
    #[default]
    Software,
    /// The adapter's acceleration structure; needs `EXPERIMENTAL_RAY_QUERY`.
    RayQuery,
}

/// A scene that could not be put on the GPU.
#[derive(Debug, thiserror::Error)]
pub enum GpuSceneError {
    /// A buffer is larger than the device binds, or another limit of the device.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// A texture or the sky is larger than the device holds.
    #[error("{what} does not fit: {detail}; {advice}")]
    TextureLimit {
        /// What was too large.
        what: &'static str,
        /// Sizes.
        detail: String,
        /// What to do.
        advice: &'static str,
    },
    /// Ray queries were asked for and the device has none.
    #[error("this device has no ray queries; leave the choice to the software BVH")]
    NoRayQuery,
}

/// Buffers and textures of a scene with their bind group.
#[derive(Debug)]
pub struct GpuScene {
    info: SceneInfo,
    rays: RaySource,
    layout: wgpu::BindGroupLayout,
    bind_group: wgpu::BindGroup,
    raster_layout: wgpu::BindGroupLayout,
    raster_bind_group: wgpu::BindGroup,
    memory: SceneMemory,
    skipped_triangles: usize,
    textured: bool,
    brightest: f32,
    punctual_peaks: Vec<LightPeak>,
    punctual_lights: Vec<Light>,
    drawn_peak: LightPeak,
    drawn_extended_peak: LightPeak,
    cpu_rays: surroundings::CpuRays,
    // An acceleration structure must outlive its use; the bind group holds the buffers.
    _acceleration: Option<(wgpu::Blas, wgpu::Tlas)>,
}

/// Bytes on the GPU.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SceneMemory {
    /// Nodes of the software BVH.
    pub bvh_nodes: u64,
    /// Corners and indices of triangles, what rays need.
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
    /// [`GpuSceneError`]: a limit of the device is passed, or ray queries are not there.
    pub fn new(gpu: &Gpu, scene: &Scene, options: GpuSceneOptions) -> Result<Self, GpuSceneError> {
        Self::with_moving(gpu, scene, options, &|_| false)
    }

    /// As [`GpuScene::new`]; triangles of the instances (by index) for which `moving` says so carry
    /// `TRIANGLE_MOVING`, and techniques bring them up to date more often than the others.
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
        let mut world = WorldTriangles::of(scene);
        let bvh = Bvh::build(&world.positions);
        world.reorder(bvh.triangle_order());
        let (bounds_min, bounds_max) = world.bounds();
        let radius = 0.5 * (bounds_max - bounds_min).length();

        let sky = sky::SkyTextures::upload(gpu, &scene.sky)?;
        let lights = lights::LightTable::build(scene, &world, radius, &sky);
        let atlas = atlas::Atlas::build(gpu, scene)?;
        let triangles = world.ray_triangles(scene, &lights, moving);
        let shading = world.shading_triangles(scene);
        let materials = flatten::materials(scene, &atlas);

        let info = SceneInfo {
            bounds_min,
            n_triangles: triangles.len() as u32,
            bounds_max,
            n_lights: lights.len() as u32,
            sky_radiance: match &scene.sky {
                Sky::Constant(radiance) => *radiance,
                Sky::Image { .. } => Vec3::ONE,
            },
            sky_has_image: u32::from(matches!(scene.sky, Sky::Image { .. })),
            sky_size: sky.size,
            sky_light: lights.sky,
            diffuse_only: u32::from(options.diffuse_only),
            n_hittable_lights: lights.n_hittable(),
            n_punctual_lights: lights.n_punctual,
            reserved_a: 0,
            reserved_b: 0,
        };
        let info_buffer = gpu.device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
            label: Some("scene info"),
            contents: bytemuck::bytes_of(&info),
            usage: wgpu::BufferUsages::UNIFORM,
        });
        let smaller = "split the scene or use a device with larger bindings";
        let triangle_buffer = storage(gpu, "triangles", &triangles, smaller)?;
        let shading_buffer = storage(gpu, "triangle shading", &shading, smaller)?;
        let material_buffer = storage(gpu, "materials", &materials, smaller)?;
        let light_buffer = storage(gpu, "lights", lights.entries(), smaller)?;
        let memory = SceneMemory {
            bvh_nodes: size_of_val(bvh.nodes()) as u64,
            triangles: size_of_val(triangles.as_slice()) as u64,
            shading: size_of_val(shading.as_slice()) as u64,
            textures: atlas.bytes,
        };

        // The raster stages ask no rays and draw no lights.
        let raster_layout = raster_seam::WgpuBindGroup0::get_bind_group_layout(&gpu.device);
        let raster_bind_group = raster_seam::WgpuBindGroup0::from_bindings(
            &gpu.device,
            raster_seam::WgpuBindGroup0Entries::new(raster_seam::WgpuBindGroup0EntriesParams {
                scene: info_buffer.as_entire_buffer_binding(),
                triangles: triangle_buffer.as_entire_buffer_binding(),
                triangle_shading: shading_buffer.as_entire_buffer_binding(),
                materials: material_buffer.as_entire_buffer_binding(),
                atlas: &atlas.texels,
            }),
        );
        let raster_bind_group = raster_bind_group.inner().clone();
        let (layout, bind_group, acceleration) = match options.rays {
            RaySource::Software => {
                let node_buffer = storage(gpu, "BVH nodes", bvh.nodes(), smaller)?;
                let layout = seam::WgpuBindGroup0::get_bind_group_layout(&gpu.device);
                let entries = seam::WgpuBindGroup0Entries::new(seam::WgpuBindGroup0EntriesParams {
                    scene: info_buffer.as_entire_buffer_binding(),
                    triangles: triangle_buffer.as_entire_buffer_binding(),
                    triangle_shading: shading_buffer.as_entire_buffer_binding(),
                    materials: material_buffer.as_entire_buffer_binding(),
                    lights: light_buffer.as_entire_buffer_binding(),
                    atlas: &atlas.texels,
                    sky_image: &sky.image,
                    sky_distribution: &sky.distribution,
                    bvh_nodes: node_buffer.as_entire_buffer_binding(),
                });
                let group = seam::WgpuBindGroup0::from_bindings(&gpu.device, entries);
                (layout, group.inner().clone(), None)
            }
            RaySource::RayQuery => {
                let (blas, tlas) = bvh::build_acceleration_structure(gpu, &world.positions)?;
                let layout = ray_query_seam::WgpuBindGroup0::get_bind_group_layout(&gpu.device);
                let entries = ray_query_seam::WgpuBindGroup0Entries::new(
                    ray_query_seam::WgpuBindGroup0EntriesParams {
                        scene: info_buffer.as_entire_buffer_binding(),
                        triangles: triangle_buffer.as_entire_buffer_binding(),
                        triangle_shading: shading_buffer.as_entire_buffer_binding(),
                        materials: material_buffer.as_entire_buffer_binding(),
                        lights: light_buffer.as_entire_buffer_binding(),
                        atlas: &atlas.texels,
                        sky_image: &sky.image,
                        sky_distribution: &sky.distribution,
                        acceleration: &tlas,
                    },
                );
                let group = ray_query_seam::WgpuBindGroup0::from_bindings(&gpu.device, entries);
                (layout, group.inner().clone(), Some((blas, tlas)))
            }
        };
        Ok(Self {
            info,
            rays: options.rays,
            layout,
            bind_group,
            raster_layout,
            raster_bind_group,
            memory,
            skipped_triangles: world.skipped,
            textured: atlas.n_images() > 0,
            brightest: scene.materials.iter().fold(0.0, |m, v| v.emission.max_element().max(m)),
            punctual_peaks: lights.punctual_peaks().to_vec(),
            punctual_lights: lights.entries()[..lights.n_punctual as usize].to_vec(),
            drawn_peak: lights.drawn_peak(),
            drawn_extended_peak: lights.drawn_extended_peak(),
            cpu_rays: surroundings::CpuRays::new(bvh.into_tree(), &world.positions),
            _acceleration: acceleration,
        })
    }

    /// Layout of bind group 0, the same for every kernel on this [`RaySource`].
    pub fn layout(&self) -> &wgpu::BindGroupLayout {
        &self.layout
    }

    /// Bind group 0.
    pub fn bind_group(&self) -> &wgpu::BindGroup {
        &self.bind_group
    }

    /// Layout of [`Self::raster_bind_group`].
    pub fn raster_layout(&self) -> &wgpu::BindGroupLayout {
        &self.raster_layout
    }

    /// Bind group 0 of vertex and fragment kernels: triangles, materials and textures.
    pub fn raster_bind_group(&self) -> &wgpu::BindGroup {
        &self.raster_bind_group
    }

    /// The row of [`VARIANTS`](crate::shader::VARIANTS) in which vertex and fragment kernels run on
    /// this scene: they ask no rays.
    pub fn raster_variant(&self) -> &'static str {
        if self.textured { "" } else { "untextured" }
    }

    /// Whether every surface is Lambert ([`GpuSceneOptions::diffuse_only`]).
    pub fn is_diffuse_only(&self) -> bool {
        self.info.diffuse_only != 0
    }

    /// What answers rays.
    pub fn rays(&self) -> RaySource {
        self.rays
    }

    /// The row of [`VARIANTS`](crate::shader::VARIANTS) in which kernels run on this scene.
    pub fn variant(&self) -> &'static str {
        match self.rays {
            RaySource::RayQuery => "ray_query",
            RaySource::Software if self.textured => "",
            RaySource::Software => "untextured",
        }
    }

    /// World-space box of all triangles \[m\]; zeros if there are none.
    pub fn bounds(&self) -> (Vec3, Vec3) {
        (self.info.bounds_min, self.info.bounds_max)
    }

    /// How far away what stands around a point is; None where nothing can be seen from there. (About 2 ms on a CPU.)
    pub fn surroundings(&self, point: Vec3) -> Option<Surroundings> {
        self.cpu_rays.around(point)
    }

    /// The box \[m\] around what lies within a box (least and greatest corner); triangles that reach out of it count as far as it
    /// goes. None where nothing does.
    pub fn bounds_within(&self, min: Vec3, max: Vec3) -> Option<(Vec3, Vec3)> {
        self.cpu_rays.bounds_within((min, max))
    }

    /// Triangles that rays can meet.
    pub fn n_triangles(&self) -> u32 {
        self.info.n_triangles
    }

    /// Lights that can be drawn: punctual, emissive triangles, sky.
    pub fn n_lights(&self) -> u32 {
        self.info.n_lights
    }

    /// The largest component of a material's emission \[W·sr⁻¹·m⁻²\], before textures; 0 where nothing
    /// shines.
    pub fn brightest_emission(&self) -> f32 {
        self.brightest
    }

    /// Of these, emissive triangles and the sky; the others are the scene's lights without extent, in
    /// their order.
    pub fn n_extended_lights(&self) -> u32 {
        self.info.n_hittable_lights
    }

    /// The lights without extent as kernels have them, in the scene's order.
    pub(crate) fn punctual_lights(&self) -> &[Light] {
        &self.punctual_lights
    }

    /// The most that each light without extent sends anywhere, in the scene's order.
    pub fn punctual_peaks(&self) -> &[LightPeak] {
        &self.punctual_peaks
    }

    /// The most that a light drawn among all gives, divided by the probability of drawing it: what
    /// kernels get from `host::lights::sample_light`.
    pub fn drawn_peak(&self) -> LightPeak {
        self.drawn_peak
    }

    /// As [`Self::drawn_peak`], for a light drawn among emissive triangles and the sky.
    pub fn drawn_extended_peak(&self) -> LightPeak {
        self.drawn_extended_peak
    }

    /// Triangles left out because they have no area or lie too far from the origin for f32.
    pub fn skipped_triangles(&self) -> usize {
        self.skipped_triangles
    }

    /// How much memory the scene takes on the GPU.
    pub fn memory(&self) -> SceneMemory {
        self.memory
    }
}

/// A storage buffer with these elements; one zeroed element where there is none, for bindings are
/// never empty.
fn storage<T: NoUninit>(
    gpu: &Gpu,
    what: &'static str,
    data: &[T],
    advice: &'static str,
) -> Result<wgpu::Buffer, GpuError> {
    let bytes = size_of_val(data) as u64;
    let limit = gpu.device.limits().max_storage_buffer_binding_size;
    if bytes > limit {
        return Err(GpuError::TooLarge { what, bytes, limit, advice });
    }
    let empty = vec![0; size_of::<T>()];
    let contents = if data.is_empty() { &empty } else { bytemuck::cast_slice(data) };
    Ok(gpu.device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
        label: Some(what),
        contents,
        usage: wgpu::BufferUsages::STORAGE,
    }))
}
