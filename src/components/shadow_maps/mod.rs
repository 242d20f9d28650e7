// SPDX-License-Identifier: MIT OR Apache-2.0
//! Shadow maps of point, spot and directional lights, for direct light of pixels and of voxels.
//!
//! [`ShadowMaps`] draws what the lights see; [`ShadowMaps::visibility`] binds it for kernels that import
//! `scene::visibility`. Emissive surfaces, the sky, and lights for which there is no map use rays.
//!
//! | texture | bytes |
//! |---|---|
//! | maps, `depth32float` | 4 · resolution² a view: one of a spot or directional light, six of a point light |

mod views;

use crate::bindings::lucerna::components::shadow_maps::shadow_map::ShadowFilter;
use crate::bindings::lucerna::fields::shadow_maps::ShadowMaps as Uniform;
use crate::components::LightVisibility;
use crate::gpu::{
    Gpu, OwnedResource, Recorder, RenderKernel, RenderState, Resource, Shaders, buffer,
};
use crate::seam::{Mismatch, Revisions, SceneSeam, check_shaders};
use crate::shader::SHADOW_MAPS;

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
#[non_exhaustive]
pub struct ShadowSettings {
    /// Texels along each side of a map, from 16 to the device's limit for textures.
    pub resolution: u32,
    /// How maps are filtered.
    pub filtering: ShadowFiltering,
}

impl Default for ShadowSettings {
    /// 1024 texels, PCF over 1.5 of them.
    fn default() -> Self {
        Self { resolution: 1024, filtering: ShadowFiltering::Pcf(1.5) }
    }
}

impl ShadowSettings {
    /// Maps with this many texels along each side, and this filter.
    pub fn new(resolution: u32, filtering: ShadowFiltering) -> Self {
        Self { resolution, filtering }
    }
}

/// Shadow maps could not be created or drawn.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ShadowError {
    /// A setting is out of range.
    #[error("{name} of shadow maps is {value}; possible values: {possible}")]
    Setting {
        /// Which.
        name: &'static str,
        /// What was given.
        value: f32,
        /// What may be given.
        possible: &'static str,
    },
    /// The scene differs from the one that the maps were made for, or cannot be rasterised.
    #[error(transparent)]
    Mismatch(#[from] Mismatch),
    /// The maps would take too much memory.
    #[error(
        "{n} shadow maps of {resolution} x {resolution} texels take more than 2 GiB; use a smaller resolution or fewer lights"
    )]
    TooLarge {
        /// Views of all lights together.
        n: u32,
        /// Texels along each side of a map.
        resolution: u32,
    },
}

/// Bytes that all maps may take together.
const MAX_BYTES: u64 = 2 << 30;

/// The largest disc \[texels\], whose 32 points are 11 texels apart.
const MAX_TEXELS: f32 = 64.0;
/// How far points move along their normal \[texels\].
const NORMAL_OFFSET: f32 = 1.5;
/// Depth bias in proportion to the slope (negative: away from the light), and in units of the last place.
const SLOPE_BIAS: f32 = -2.0;
const CONSTANT_BIAS: i32 = -8;

/// Maps of the first lights without extent: as many lights as fit into 48 views, at most 16.
#[derive(Debug)]
pub struct ShadowMaps {
    settings: ShadowSettings,
    shaders: Shaders,
    depth: RenderKernel,
    uniform: wgpu::Buffer,
    /// One per view.
    layers: Vec<wgpu::TextureView>,
    all_layers: wgpu::TextureView,
    sampler: wgpu::Sampler,
    /// Revisions of the scene that was drawn last.
    seen: Option<Revisions>,
}

impl ShadowMaps {
    /// Compiles the kernel and creates the maps, for scenes of the same variant with the same number of lights of each
    /// kind.
    ///
    /// # Errors
    /// [`ShadowError`]: a setting is out of range, or the scene cannot be rasterised.
    pub fn new(
        gpu: &Gpu,
        scene: &dyn SceneSeam,
        settings: ShadowSettings,
    ) -> Result<Self, ShadowError> {
        check(gpu, &settings)?;
        let raster = scene.raster_group().ok_or(Mismatch::NoRaster)?;
        let device = &gpu.device;
        let n_layers = views::views_of(scene.facts()).views.len().max(1) as u32;
        let resolution = settings.resolution;
        if 4 * u64::from(n_layers) * u64::from(resolution).pow(2) > MAX_BYTES {
            return Err(ShadowError::TooLarge { n: n_layers, resolution });
        }
        let texture = device.create_texture(&wgpu::TextureDescriptor {
            label: Some("shadow maps"),
            size: wgpu::Extent3d {
                width: resolution,
                height: resolution,
                depth_or_array_layers: n_layers,
            },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: wgpu::TextureFormat::Depth32Float,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::TEXTURE_BINDING,
            view_formats: &[],
        });
        let layer = |layer| {
            texture.create_view(&wgpu::TextureViewDescriptor {
                label: Some("shadow map"),
                dimension: Some(wgpu::TextureViewDimension::D2),
                base_array_layer: layer,
                array_layer_count: Some(1),
                ..Default::default()
            })
        };
        let state = RenderState {
            targets: &[],
            depth: Some(wgpu::DepthStencilState {
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
            ..Default::default()
        };
        let name = "shadow_maps/depth";
        let usage = wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST;
        Ok(Self {
            settings,
            shaders: scene.shaders().clone(),
            depth: RenderKernel::new(gpu, scene.shaders(), Some(raster), name, name, state),
            uniform: buffer(gpu, "shadow maps", size_of::<Uniform>() as u64, usage),
            layers: (0..n_layers).map(layer).collect(),
            all_layers: texture.create_view(&wgpu::TextureViewDescriptor {
                label: Some("shadow maps"),
                dimension: Some(wgpu::TextureViewDimension::D2Array),
                ..Default::default()
            }),
            sampler: device.create_sampler(&wgpu::SamplerDescriptor {
                label: Some("shadow maps"),
                mag_filter: wgpu::FilterMode::Linear,
                min_filter: wgpu::FilterMode::Linear,
                compare: Some(wgpu::CompareFunction::GreaterEqual),
                ..Default::default()
            }),
            seen: None,
        })
    }

    /// Visibility of lights by these maps, for kernels that use it.
    pub fn visibility(&self) -> LightVisibility {
        let bindings = vec![
            ("shadows", OwnedResource::Buffer(self.uniform.clone())),
            ("shadow_textures", OwnedResource::Texture(self.all_layers.clone())),
            ("shadow_compare", OwnedResource::Sampler(self.sampler.clone())),
        ];
        LightVisibility::new(&[SHADOW_MAPS], bindings)
    }

    /// Records drawing the maps, if the scene has changed since they were last drawn.
    ///
    /// # Errors
    /// [`ShadowError::Mismatch`]: the scene has another variant, or its lights need more views than those of the scene
    /// that this was made for (there are more lights, or a spot light has become wider than 74° from its axis, which
    /// takes six views). In that case nothing is recorded.
    pub fn record(
        &mut self,
        recorder: &mut Recorder,
        scene: &dyn SceneSeam,
    ) -> Result<(), ShadowError> {
        let now = scene.revisions();
        if self.seen == Some(now) {
            return Ok(());
        }
        check_shaders(&self.shaders, scene)?;
        let raster = scene.raster_group().ok_or(Mismatch::NoRaster)?;
        let found = views::views_of(scene.facts());
        let (expected, n) = (self.layers.len() as u32, found.views.len() as u32);
        if n > expected {
            return Err(Mismatch::Lights { expected, found: n }.into());
        }
        let uniform = found.uniform(self.filter(), self.settings.filtering);
        recorder.upload(&self.uniform, 0, bytemuck::bytes_of(&uniform));
        for (view, layer) in found.views.iter().zip(&self.layers) {
            let pass = &mut recorder.render("shadow_maps/depth", &[], Some(layer));
            let bound = [("view", Resource::Uniform(bytemuck::bytes_of(view)))];
            self.depth.draw(pass, Some(raster), &bound, 3 * scene.facts().n_triangles);
        }
        self.seen = Some(now);
        Ok(())
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

/// Fails if a setting is out of range.
fn check(gpu: &Gpu, settings: &ShadowSettings) -> Result<(), ShadowError> {
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
