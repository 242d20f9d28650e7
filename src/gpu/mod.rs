// SPDX-License-Identifier: MIT OR Apache-2.0
//! A device to run kernels on, the caller's or one that lucerna opens, and recording on it.
//!
//! | to … | use |
//! |---|---|
//! | wrap an existing device, or open one | [`Gpu`] |
//! | record into an encoder | [`Recorder`] |
//! | compile a kernel and call it | [`ComputeKernel`], [`RenderKernel`] |
//! | say where kernels come from | [`Shaders`] |
//! | time passes | [`PassTimers`] |

mod buffers;
#[cfg(feature = "testing")]
pub(crate) mod guards;
mod kernel;
mod recorder;
mod shaders;
mod timers;
mod uniforms;

use uniforms::UniformPool;

use wgpu::{
    Adapter, AdapterInfo, Backends, Device, DeviceDescriptor, DeviceType, ExperimentalFeatures,
    Features, Instance, InstanceDescriptor, Limits, Queue,
};

pub use buffers::radiance_target;
pub(crate) use buffers::{
    buffer, check_binding, check_not_empty, check_picture, extent, picture_texture, storage_buffer,
    target,
};
pub use kernel::{
    Bindings, ComputeCall, ComputeKernel, Dispatch, OwnedResource, RenderKernel, RenderState,
    Resource, SceneGroup,
};
pub use recorder::{ComputeRecorder, Recorder, RenderRecorder};
pub use shaders::Shaders;
pub use timers::PassTimers;

/// A wgpu device with its queue and what it can do. Cheap to clone.
#[derive(Clone, Debug)]
pub struct Gpu {
    /// The caller's device, or the one that [`Gpu::open`] made.
    pub device: Device,
    /// Its queue.
    pub queue: Queue,
    uniforms: UniformPool,
}

/// Which adapter to take.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum AdapterChoice {
    /// The best hardware GPU, or a software adapter if there is none.
    #[default]
    Auto,
    /// A software adapter.
    Software,
    /// The first adapter whose name contains this text, in upper or lower case.
    Named(String),
}

impl std::str::FromStr for AdapterChoice {
    type Err = std::convert::Infallible;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        Ok(match text {
            "auto" => Self::Auto,
            "software" => Self::Software,
            name => Self::Named(name.to_owned()),
        })
    }
}

/// There is no device, or one of its limits is exceeded.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum GpuError {
    /// wgpu was built without a backend for this system.
    #[error(
        "no backend of wgpu was built in; enable one of lucerna's features `vulkan`, `metal`, `dx12` and `webgpu` that this system supports, or a backend of wgpu itself"
    )]
    NoBackend,
    /// The system has no adapter at all.
    #[error(
        "no GPU adapter found, not even a software one; install a Vulkan driver (on Debian: mesa-vulkan-drivers) and try again"
    )]
    NoAdapter,
    /// None of the adapters matches.
    #[error("no adapter matches `{wanted}`; there are {}", .found.join(", "))]
    NoMatch {
        /// The requested name.
        wanted: String,
        /// Names of the adapters.
        found: Vec<String>,
    },
    /// The adapter gave no device.
    #[error("adapter `{adapter}` gives no device: {source}")]
    Device {
        /// The adapter's name.
        adapter: String,
        /// wgpu's error.
        source: wgpu::RequestDeviceError,
    },
    /// The picture is larger than the device's textures can be.
    #[error(
        "a picture of {width}×{height} pixels is too large: this device's textures have at most {limit} per side; render a smaller picture"
    )]
    PictureTooLarge {
        /// Pixels per row.
        width: u32,
        /// Rows.
        height: u32,
        /// `max_texture_dimension_2d` of the device.
        limit: u32,
    },
    /// The picture has no pixels.
    #[error("a picture of {width}×{height} pixels is empty: it needs at least 1×1")]
    EmptyPicture {
        /// Pixels per row.
        width: u32,
        /// Rows.
        height: u32,
    },
    /// A texture of the caller has another size than the others.
    #[error("the texture `{what}` has {found} pixels, but the others have {expected}")]
    OtherSize {
        /// What the texture holds.
        what: &'static str,
        /// Size of the others \[pixels\].
        expected: glam::UVec2,
        /// Its own.
        found: glam::UVec2,
    },
    /// A 3-D texture has an edge that is too long.
    #[error(
        "{what} need {edge} texels along an edge, but this device's 3-D textures have at most {limit}; {advice}"
    )]
    VolumeTooLarge {
        /// What the texture holds.
        what: &'static str,
        /// The longest edge \[texels\].
        edge: u32,
        /// `max_texture_dimension_3d` of the device.
        limit: u32,
        /// What to do.
        advice: &'static str,
    },
    /// A texture of the caller has the wrong format.
    #[error("the texture `{what}` must be {expected:?}; it is {found:?}")]
    OtherFormat {
        /// What the texture holds.
        what: &'static str,
        /// The format that kernels read.
        expected: wgpu::TextureFormat,
        /// The texture's format.
        found: wgpu::TextureFormat,
    },
    /// Data is too large for one binding.
    #[error("{what} needs {bytes} bytes in one binding, but this device allows {limit}; {advice}")]
    TooLarge {
        /// What the buffer holds.
        what: &'static str,
        /// Bytes needed.
        bytes: u64,
        /// `max_storage_buffer_binding_size` of the device.
        limit: u64,
        /// What to do.
        advice: &'static str,
    },
}

impl Gpu {
    /// Uses the caller's device. The handles are shared; the device remains the caller's.
    pub fn new(device: Device, queue: Queue) -> Self {
        Self { device, queue, uniforms: UniformPool::default() }
    }

    /// Opens a device with WebGPU's default limits (but storage bindings as large as the adapter allows), and with
    /// timestamps and ray queries if the adapter has them.
    ///
    /// # Errors
    /// [`GpuError::NoBackend`], [`GpuError::NoAdapter`], [`GpuError::NoMatch`] or [`GpuError::Device`].
    pub async fn open(choice: &AdapterChoice) -> Result<(Self, AdapterInfo), GpuError> {
        if Instance::enabled_backend_features().is_empty() {
            return Err(GpuError::NoBackend);
        }
        let mut adapters = adapters().await;
        if adapters.is_empty() {
            return Err(GpuError::NoAdapter);
        }
        let found: Vec<_> = adapters.iter().map(|adapter| adapter.get_info().name).collect();
        let position = match choice {
            AdapterChoice::Auto => Some(0),
            AdapterChoice::Software => {
                adapters.iter().position(|a| a.get_info().device_type == DeviceType::Cpu)
            }
            AdapterChoice::Named(name) => {
                let name = name.to_lowercase();
                found.iter().position(|found| found.to_lowercase().contains(&name))
            }
        };
        let Some(position) = position else {
            let wanted = match choice {
                AdapterChoice::Named(name) => name.clone(),
                other => format!("{other:?}").to_lowercase(),
            };
            return Err(GpuError::NoMatch { wanted, found });
        };
        let adapter = adapters.swap_remove(position);
        let info = adapter.get_info();
        let gpu = Self::from_adapter(&adapter)
            .await
            .map_err(|source| GpuError::Device { adapter: info.name.clone(), source })?;
        Ok((gpu, info))
    }

    async fn from_adapter(adapter: &Adapter) -> Result<Self, wgpu::RequestDeviceError> {
        let offered = adapter.limits();
        let mut limits = Limits {
            max_storage_buffer_binding_size: offered.max_storage_buffer_binding_size,
            max_buffer_size: offered.max_buffer_size,
            ..Limits::default()
        };
        let mut features = adapter.features()
            & (Features::TIMESTAMP_QUERY
                | Features::TIMESTAMP_QUERY_INSIDE_ENCODERS
                | Features::EXPERIMENTAL_RAY_QUERY);
        let mut experimental = ExperimentalFeatures::disabled();
        if features.contains(Features::EXPERIMENTAL_RAY_QUERY) {
            limits = limits.using_minimum_supported_acceleration_structure_values();
            limits.max_blas_primitive_count = offered.max_blas_primitive_count;
            // SAFETY: wgpu requires this acknowledgement because its ray queries are not finished yet; the kernels only
            // index acceleration structures that GpuScene built and keeps.
            experimental = unsafe { ExperimentalFeatures::enabled() };
        } else {
            features.remove(Features::EXPERIMENTAL_RAY_QUERY);
        }
        let (device, queue) = adapter
            .request_device(&DeviceDescriptor {
                label: Some("lucerna"),
                required_features: features,
                required_limits: limits,
                experimental_features: experimental,
                ..Default::default()
            })
            .await?;
        Ok(Self::new(device, queue))
    }

    /// Whether the ray-query variants of kernels run here: the device has ray queries, and the feature `compose` is on.
    pub fn has_ray_query(&self) -> bool {
        cfg!(feature = "compose")
            && self.device.features().contains(Features::EXPERIMENTAL_RAY_QUERY)
    }
}

/// All adapters, the best first: discrete, integrated, virtual, other, software. Empty without a backend of wgpu.
pub async fn adapters() -> Vec<Adapter> {
    if Instance::enabled_backend_features().is_empty() {
        return Vec::new();
    }
    let instance = Instance::new(InstanceDescriptor {
        backends: Backends::PRIMARY,
        ..InstanceDescriptor::new_without_display_handle()
    });
    let mut adapters = instance.enumerate_adapters(Backends::PRIMARY).await;
    adapters.sort_by_key(|adapter| match adapter.get_info().device_type {
        DeviceType::DiscreteGpu => 0,
        DeviceType::IntegratedGpu => 1,
        DeviceType::VirtualGpu => 2,
        DeviceType::Other => 3,
        DeviceType::Cpu => 4,
    });
    adapters
}
