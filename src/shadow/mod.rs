//! Shadow maps of point, spot and directional lights, for direct light of pixels and of voxels.
//!
//! [`ShadowMaps`] draws what the lights see; [`ShadowBinding`] brings it to kernels that ask
//! `host::visibility`. Emissive surfaces and the sky, and lights that found no room, have rays.
//!
//! | texture | bytes |
//! |---|---|
//! | maps, `depth32float` | 4 · resolution² a view: one of a spot or directional light, six of a point light |

mod views;

use crate::bindings::baseline::kernels::shadow::depth as kernel;
use crate::bindings::shadow_map::kernels::frame::direct as reader;
use crate::bindings::shadow_map::lucerna::fields::shadow_maps::ShadowMaps as Uniform;
use crate::bindings::shadow_map::lucerna::shadow::shadow_map::{ShadowFilter, ShadowView};
use crate::frame::Frame;
use crate::gpu::Gpu;
use crate::gpu_scene::{GpuScene, RaySource};
use crate::modules::shader_module;
use crate::pass::buffer;

/// How maps are filtered.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ShadowFiltering {
    /// Percentage-closer filtering over a disc of this radius \[texels\], 0.5 to 64.
    Pcf(f32),
    /// Percentage-closer soft shadows.
    Pcss {
        /// Radius of point and spot lights \[m\], at least 0.
        light_radius: f32,
        /// Angular radius of directional lights \[degrees\], 0 to 45; the sun's is 0.27.
        angular_radius: f32,
    },
}

/// Settings of [`ShadowMaps`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShadowSettings {
    /// Texels along a map's side, 16 to what the device's textures have.
    pub resolution: u32,
    /// How they are filtered.
    pub filtering: ShadowFiltering,
}

impl Default for ShadowSettings {
    /// 1024 texels, PCF over 1.5 of them.
    fn default() -> Self {
        Self { resolution: 1024, filtering: ShadowFiltering::Pcf(1.5) }
    }
}

/// Shadow maps that cannot be.
#[derive(Debug, thiserror::Error)]
pub enum ShadowError {
    /// A setting is out of range.
    #[error("{name} of shadow maps is {value}; possible is {possible}")]
    Setting {
        /// Which.
        name: &'static str,
        /// What was given.
        value: f32,
        /// What may be given.
        possible: &'static str,
    },
    /// The scene's rays are ray queries, with which no kernel reads shadow maps or voxels for shadows.
    #[error(
        "shadows of this kind need a scene whose rays are traced in software (RaySource::Software)"
    )]
    RayQuery,
    /// Prefiltered voxels in buffers, with which no kernel follows cones for shadows.
    #[error("shadows by cones need prefiltered voxels in textures")]
    Buffers,
    /// Maps that would fill a GPU.
    #[error(
        "{n} shadow maps of {resolution} x {resolution} texels take more than 2 GiB; use a smaller resolution or fewer lights"
    )]
    TooLarge {
        /// Views of all lights together.
        n: u32,
        /// Texels along a map's side.
        resolution: u32,
    },
}

/// Bytes that all maps may take together.
const MAX_BYTES: u64 = 2 << 30;

/// The largest disc \[texels\]: its 32 points stand 11 texels apart then.
const MAX_TEXELS: f32 = 64.0;
/// How far points move along their normal \[texels\].
const NORMAL_OFFSET: f32 = 1.5;
/// Bias when depths are written, by slope (negative: away from the light) and in units of the last place.
const SLOPE_BIAS: f32 = -2.0;
const CONSTANT_BIAS: i32 = -8;

/// What kernels bind to know how much of a light is seen.
#[derive(Clone, Debug)]
pub struct ShadowBinding {
    pub(crate) variant: &'static str,
    pub(crate) layout: wgpu::BindGroupLayout,
    pub(crate) group: wgpu::BindGroup,
}

/// Maps of the first lights without extent: as many as have room in 48 views, at most 16.
#[derive(Debug)]
pub struct ShadowMaps {
    settings: ShadowSettings,
    pipeline: wgpu::RenderPipeline,
    variant: &'static str,
    uniform: wgpu::Buffer,
    views: Vec<View>,
    all_views: wgpu::TextureView,
    sampler: wgpu::Sampler,
}

/// What one layer is drawn with.
#[derive(Debug)]
struct View {
    uniform: wgpu::Buffer,
    group: wgpu::BindGroup,
    layer: wgpu::TextureView,
}

impl ShadowMaps {
    /// Compiles the kernel and makes the maps, for scenes of the same variant with as many lights of each kind.
    ///
    /// # Errors
    /// [`ShadowError`]: a setting is out of range, or the scene's rays are ray queries.
    pub fn new(gpu: &Gpu, scene: &GpuScene, settings: ShadowSettings) -> Result<Self, ShadowError> {
        check(gpu, scene, &settings)?;
        let device = &gpu.device;
        let n_layers = views::views_of(scene).views.len().max(1) as u32;
        let resolution = settings.resolution;
        if 4 * u64::from(n_layers) * u64::from(resolution).pow(2) > MAX_BYTES {
            return Err(ShadowError::TooLarge { n: n_layers, resolution });
        }
        let texture = device.create_texture(&wgpu::TextureDescriptor {
            label: Some("shadow maps"),
            size: wgpu::Extent3d {
                width: settings.resolution,
                height: settings.resolution,
                depth_or_array_layers: n_layers,
            },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: wgpu::TextureFormat::Depth32Float,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::TEXTURE_BINDING,
            view_formats: &[],
        });
        let layout = kernel::WgpuBindGroup1::get_bind_group_layout(device);
        let usage = wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST;
        let views = (0..n_layers)
            .map(|layer| {
                let uniform = buffer(gpu, "shadow view", size_of::<ShadowView>() as u64, usage);
                let entries =
                    kernel::WgpuBindGroup1Entries::new(kernel::WgpuBindGroup1EntriesParams {
                        view: uniform.as_entire_buffer_binding(),
                    });
                let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
                    label: Some("shadow view"),
                    layout: &layout,
                    entries: &entries.into_array(),
                });
                let layer = texture.create_view(&wgpu::TextureViewDescriptor {
                    label: Some("shadow map"),
                    dimension: Some(wgpu::TextureViewDimension::D2),
                    base_array_layer: layer,
                    array_layer_count: Some(1),
                    ..Default::default()
                });
                View { uniform, group, layer }
            })
            .collect();
        let all_views = texture.create_view(&wgpu::TextureViewDescriptor {
            label: Some("shadow maps"),
            dimension: Some(wgpu::TextureViewDimension::D2Array),
            ..Default::default()
        });
        let sampler = device.create_sampler(&wgpu::SamplerDescriptor {
            label: Some("shadow maps"),
            mag_filter: wgpu::FilterMode::Linear,
            min_filter: wgpu::FilterMode::Linear,
            compare: Some(wgpu::CompareFunction::GreaterEqual),
            ..Default::default()
        });
        Ok(Self {
            settings,
            pipeline: pipeline(gpu, scene, &layout),
            variant: scene.raster_variant(),
            uniform: buffer(gpu, "shadow maps", size_of::<Uniform>() as u64, usage),
            views,
            all_views,
            sampler,
        })
    }

    /// For kernels that find direct light of pixels.
    pub fn binding(&self, gpu: &Gpu) -> ShadowBinding {
        let layout = reader::WgpuBindGroup2::get_bind_group_layout(&gpu.device);
        let entries = reader::WgpuBindGroup2Entries::new(reader::WgpuBindGroup2EntriesParams {
            shadows: self.uniform.as_entire_buffer_binding(),
            shadow_textures: &self.all_views,
            shadow_compare: &self.sampler,
        });
        let group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("shadow maps"),
            layout: &layout,
            entries: &entries.into_array(),
        });
        ShadowBinding { variant: "shadow_map", layout, group }
    }

    /// The uniform, the maps as one texture, and how they are compared: what `fields::shadow_maps` binds.
    pub(crate) fn parts(&self) -> (wgpu::BufferBinding<'_>, &wgpu::TextureView, &wgpu::Sampler) {
        (self.uniform.as_entire_buffer_binding(), &self.all_views, &self.sampler)
    }

    /// Draws the maps: in the first frame, and when lights or triangles have changed. At most once a submission.
    ///
    /// # Panics
    /// If the scene's variant is another, or its lights need more views than those of the one that this was made for: there are more, or a
    /// spot has become wider than 74° from its axis, which takes six.
    pub fn record(&self, frame: &mut Frame) {
        let (gpu, scene) = (frame.gpu, frame.scene);
        assert_eq!(self.variant, scene.raster_variant(), "compiled for another variant");
        let found = views::views_of(scene);
        assert!(found.views.len() <= self.views.len(), "made for fewer lights");
        let uniform = found.uniform(self.filter(), self.settings.filtering);
        gpu.queue.write_buffer(&self.uniform, 0, bytemuck::bytes_of(&uniform));
        for (of_view, made) in found.views.iter().zip(&self.views) {
            gpu.queue.write_buffer(&made.uniform, 0, bytemuck::bytes_of(of_view));
            let mut pass = frame.encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
                label: Some("shadow/depth"),
                color_attachments: &[],
                depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                    view: &made.layer,
                    depth_ops: Some(wgpu::Operations {
                        load: wgpu::LoadOp::Clear(0.0),
                        store: wgpu::StoreOp::Store,
                    }),
                    stencil_ops: None,
                }),
                timestamp_writes: frame
                    .timers
                    .as_deref_mut()
                    .and_then(|t| t.render("shadow/depth")),
                occlusion_query_set: None,
                multiview_mask: None,
            });
            pass.set_pipeline(&self.pipeline);
            pass.set_bind_group(0, scene.raster_bind_group(), &[]);
            pass.set_bind_group(1, &made.group, &[]);
            pass.draw(0..3 * scene.n_triangles(), 0..1);
        }
    }

    fn filter(&self) -> ShadowFilter {
        ShadowFilter {
            light_size: 0.0,
            min_texels: match self.settings.filtering {
                ShadowFiltering::Pcf(texels) => texels,
                ShadowFiltering::Pcss { .. } => 0.5,
            },
            max_texels: MAX_TEXELS,
            normal_offset: NORMAL_OFFSET,
        }
    }
}

/// Fails where settings are out of range or the scene cannot be read with maps.
fn check(gpu: &Gpu, scene: &GpuScene, settings: &ShadowSettings) -> Result<(), ShadowError> {
    if scene.rays() == RaySource::RayQuery {
        return Err(ShadowError::RayQuery);
    }
    let within = |name, value: f32, range: std::ops::RangeInclusive<f32>, possible| {
        if range.contains(&value) {
            return Ok(());
        }
        Err(ShadowError::Setting { name, value, possible })
    };
    let limit = gpu.device.limits().max_texture_dimension_2d as f32;
    let possible = "16 to the device's largest texture";
    within("resolution", settings.resolution as f32, 16.0..=limit, possible)?;
    match settings.filtering {
        ShadowFiltering::Pcf(texels) => within("filter", texels, 0.5..=64.0, "0.5 to 64 texels"),
        ShadowFiltering::Pcss { light_radius, angular_radius } => {
            within("light_radius", light_radius, 0.0..=1e6, "0 m or more")?;
            within("angular_radius", angular_radius, 0.0..=45.0, "0 to 45 degrees")
        }
    }
}

fn pipeline(gpu: &Gpu, scene: &GpuScene, layout: &wgpu::BindGroupLayout) -> wgpu::RenderPipeline {
    let name = "shadow/depth";
    let device = &gpu.device;
    let module = shader_module(gpu, name, scene.raster_variant());
    let pipeline_layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some(name),
        bind_group_layouts: &[Some(scene.raster_layout()), Some(layout)],
        immediate_size: 0,
    });
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some(name),
        layout: Some(&pipeline_layout),
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: Some(kernel::ENTRY_CORNER),
            compilation_options: Default::default(),
            buffers: &[],
        },
        primitive: wgpu::PrimitiveState { cull_mode: None, ..Default::default() },
        depth_stencil: Some(wgpu::DepthStencilState {
            format: wgpu::TextureFormat::Depth32Float,
            depth_write_enabled: Some(true),
            depth_compare: Some(wgpu::CompareFunction::Greater),
            stencil: Default::default(),
            bias: wgpu::DepthBiasState {
                constant: CONSTANT_BIAS,
                slope_scale: SLOPE_BIAS,
                clamp: 0.0,
            },
        }),
        multisample: Default::default(),
        fragment: Some(wgpu::FragmentState {
            module: &module,
            entry_point: Some(kernel::ENTRY_MASK),
            compilation_options: Default::default(),
            targets: &[],
        }),
        multiview_mask: None,
        cache: None,
    })
}
