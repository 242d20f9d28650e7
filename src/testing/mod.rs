// SPDX-License-Identifier: MIT OR Apache-2.0
//! Numerical tests of WGSL, with which lucerna tests its own modules (feature `testing`).
//!
//! A test calls a WGSL function for many inputs on the GPU ([`map`]) and compares each output with an oracle that is
//! written independently, in f64 ([`assert_near`]). Outputs are filled with a poison value first, so that an output
//! that is not written cannot pass by chance. Samplers are tested by chi-square ([`assert_chi_square`]), random estimates by
//! their standard errors ([`assert_estimates`]), both at one level for the whole suite ([`SUITE_LEVEL`]). What the library's
//! kernels write behind the end of a buffer shows with [`guard_buffers`]. Techniques that store light in cells are tried in
//! rooms with walls at any angle and with thin solids ([`House`], [`room_with_table`], [`vault`]).
//!
//! ```
//! use lucerna::testing::{Random, Tolerance, assert_near, map};
//!
//! let mut random = Random(1);
//! let inputs: Vec<f32> = (0..10_000).map(|_| random.range(-1.0, 4.0)).collect();
//! let outputs: Vec<f32> = map(
//!     "alias Input = f32;
//!     alias Output = f32;
//!     fn map(x: f32) -> f32 { return smoothstep(0.0, 2.0, x); }",
//!     &inputs,
//! );
//! // Three rounded factors: the result is off by a few units in the last place, or by as little near 0.
//! let tolerance = Tolerance { ulps: 8.0, absolute: 1e-7, ..Tolerance::EXACT };
//! assert_near("smoothstep", &inputs, &outputs, tolerance, |&x| {
//!     let t = (f64::from(x) / 2.0).clamp(0.0, 1.0);
//!     t * t * (3.0 - 2.0 * t)
//! });
//! ```
//!
//! Pass the text of your own module to [`map`], together with the function `map` that calls it; import lucerna's
//! modules by their paths (`#import lucerna::sh::basis::sh2`). Put your own modules that import each other into a
//! [`Library`], for [`Harness::with_library`].
//!
//! The device is the best adapter of the machine; without one, tests fail. Software drivers such as Mesa's lavapipe
//! work as well. At least one backend of wgpu must be enabled.
//!
//! # Golden vectors
//!
//! If the environment variable `LUCERNA_GOLDEN` names a folder, each call of [`map`] writes a JSON file there. It has
//! the WGSL, its inputs and outputs as words and as numbers (if there are many, only every n-th), and, if
//! [`assert_near`] follows, the expected numbers and the tolerance. With these files, ports to another language can be
//! tested against lucerna's own tests.

mod estimate;
mod golden;
mod guards;
mod near;
mod random;
mod rooms;
mod statistics;

use crate::gpu::{AdapterChoice, Gpu, Recorder};
use crate::modules::watch;
use crate::shader::{Composed, Library, Source, Target};
use bytemuck::{AnyBitPattern, NoUninit};
use std::sync::OnceLock;
use wgpu::util::DeviceExt;

pub use estimate::{
    Estimate, N_STATISTICAL_TESTS, SUITE_LEVEL, assert_estimate, assert_estimates,
    level_of_comparison, normal_limit,
};
pub use guards::{assert_guards, guard_buffers};
pub use near::{Scalars, Tolerance, assert_each, assert_near};
pub use random::Random;
pub use rooms::{House, around, room_with_table, vault};
pub use statistics::{Chart, assert_chi_square, chi_square_limit, square_bins};

/// What outputs hold before a run: a value that no kernel writes by chance.
const POISON: u32 = 0xdead_beef;

/// The test process's device. A test that gets none fails; it is not skipped.
///
/// # Panics
/// If there is no adapter.
pub fn gpu() -> &'static Gpu {
    static GPU: OnceLock<Gpu> = OnceLock::new();
    GPU.get_or_init(|| match crate::blocking::open(&AdapterChoice::Auto) {
        Ok((gpu, info)) => {
            eprintln!("adapter: {} ({:?}, {})", info.name, info.backend, info.driver_info);
            gpu
        }
        Err(error) => {
            eprintln!("\n!!! NO ADAPTER: THE KERNELS WERE NOT TESTED\n");
            let required =
                if is_set("LUCERNA_REQUIRE_ADAPTER") { " (and is required)" } else { "" };
            panic!("a test needs an adapter{required}: {error}");
        }
    })
}

/// The device, if it has ray queries. Without them a test prints a conspicuous message and returns, or fails if
/// `LUCERNA_REQUIRE_RAY_QUERY=1`. Names of such tests contain `ray_query`.
///
/// # Panics
/// If there is no adapter, or ray queries are required but missing.
pub fn ray_query_gpu() -> Option<&'static Gpu> {
    let gpu = gpu();
    if gpu.has_ray_query() {
        return Some(gpu);
    }
    assert!(
        !is_set("LUCERNA_REQUIRE_RAY_QUERY"),
        "LUCERNA_REQUIRE_RAY_QUERY is set, and this adapter has no ray queries"
    );
    eprintln!("\n!!! RAY QUERY TESTS DID NOT RUN: this adapter has no ray queries\n");
    None
}

fn is_set(variable: &str) -> bool {
    std::env::var(variable).is_ok_and(|value| !value.is_empty() && value != "0")
}

/// Calls the WGSL function `map` once for each input, on [`gpu`], with lucerna's modules to import.
///
/// `wgsl` holds imports, the structs `Input` and `Output` (or aliases of them), and `fn map(input: Input) -> Output`;
/// `I` and `O` must have the same layouts as these in storage buffers (note that vec3 is aligned to 16 bytes). The
/// outputs are filled with a poison value first, and every output must be written.
///
/// # Panics
/// If the WGSL does not compose, there is no adapter, or an output is not written.
pub fn map<I: NoUninit, O: AnyBitPattern + NoUninit>(wgsl: &str, inputs: &[I]) -> Vec<O> {
    map_with(wgsl, inputs, &[])
}

/// As [`map`], for WGSL that declares its own resources in group 0, from binding 2 on.
///
/// # Panics
/// As [`map`].
pub fn map_with<I: NoUninit, O: AnyBitPattern + NoUninit>(
    wgsl: &str,
    inputs: &[I],
    resources: &[wgpu::BindGroupEntry],
) -> Vec<O> {
    Harness::new(gpu().clone()).map_with(wgsl, inputs, resources)
}

/// A device and the modules that can be imported.
#[derive(Clone, Debug)]
pub struct Harness {
    gpu: Gpu,
    library: Library,
}

impl Harness {
    /// On your own device, with lucerna's modules.
    pub fn new(gpu: Gpu) -> Self {
        Self { gpu, library: crate::library() }
    }

    /// With other modules: [`crate::library`] and your own, or only your own.
    pub fn with_library(mut self, library: Library) -> Self {
        self.library = library;
        self
    }

    /// See [`map`](fn@map).
    ///
    /// # Panics
    /// If the WGSL does not compose, or an output is not written.
    pub fn map<I: NoUninit, O: AnyBitPattern + NoUninit>(
        &self,
        wgsl: &str,
        inputs: &[I],
    ) -> Vec<O> {
        self.map_with(wgsl, inputs, &[])
    }

    /// See [`map_with`].
    ///
    /// # Panics
    /// As [`Self::map`].
    pub fn map_with<I: NoUninit, O: AnyBitPattern + NoUninit>(
        &self,
        wgsl: &str,
        inputs: &[I],
        resources: &[wgpu::BindGroupEntry],
    ) -> Vec<O> {
        let text = format!(
            "{wgsl}
@group(0) @binding(0) var<storage, read> harness_inputs: array<Input>;
@group(0) @binding(1) var<storage, read_write> harness_outputs: array<Output>;
@compute @workgroup_size(64)
fn harness_main(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) n: vec3<u32>) {{
    let ix = id.y * n.x * 64u + id.x;
    if ix < arrayLength(&harness_inputs) {{
        harness_outputs[ix] = map(harness_inputs[ix]);
    }}
}}
"
        );
        let composed = composed(&self.library, &text);
        let shader = compiled(&self.gpu, &composed);
        let device = &self.gpu.device;
        let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some("test"),
            layout: None,
            module: &shader,
            entry_point: Some("harness_main"),
            compilation_options: Default::default(),
            cache: None,
        });
        let input_buffer = storage_of(&self.gpu, bytemuck::cast_slice(inputs));
        let output_bytes = inputs.len() * size_of::<O>();
        let poison = vec![POISON; output_bytes.div_ceil(4)];
        let output_buffer = storage_of(&self.gpu, bytemuck::cast_slice(&poison));
        let mut entries = vec![
            wgpu::BindGroupEntry { binding: 0, resource: input_buffer.as_entire_binding() },
            wgpu::BindGroupEntry { binding: 1, resource: output_buffer.as_entire_binding() },
        ];
        entries.extend_from_slice(resources);
        let bind_group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout: &pipeline.get_bind_group_layout(0),
            entries: &entries,
        });
        let mut encoder = device.create_command_encoder(&Default::default());
        {
            let mut pass = encoder.begin_compute_pass(&Default::default());
            pass.set_pipeline(&pipeline);
            pass.set_bind_group(0, &bind_group, &[]);
            let groups = inputs.len().div_ceil(64) as u32;
            pass.dispatch_workgroups(groups.min(32768), groups.div_ceil(32768), 1);
        }
        self.gpu.queue.submit([encoder.finish()]);
        let bytes = read_of(&self.gpu, &output_buffer);
        let outputs: Vec<O> = bytes[..output_bytes]
            .chunks_exact(size_of::<O>())
            .map(bytemuck::pod_read_unaligned)
            .collect();
        for (ix, output) in outputs.iter().enumerate() {
            let words: Vec<u32> = bytemuck::bytes_of(output)
                .chunks_exact(4)
                .map(bytemuck::pod_read_unaligned)
                .collect();
            assert!(words.iter().any(|&word| word != POISON), "output {ix} was not written");
        }
        golden::write_map(wgsl, &composed, inputs, &outputs, resources.len());
        outputs
    }
}

/// Composes test WGSL with lucerna's modules, for [`gpu`].
///
/// # Panics
/// If it does not compose. The message has the first problem.
pub fn compose(text: &str) -> wgpu::ShaderModule {
    compiled(gpu(), &composed(&crate::library(), text))
}

fn composed(library: &Library, text: &str) -> Composed {
    let source = Source {
        import_path: "test".into(),
        file: "test.wgsl".into(),
        text: text.to_owned().into(),
    };
    if let Ok(dependencies) = library.dependencies(&source) {
        watch::trace(dependencies.iter().map(|of| of.file.display().to_string()));
    }
    let composed = library.compose(&source, Target::default());
    composed.unwrap_or_else(|problems| panic!("the test's WGSL does not compose:\n{}", problems[0]))
}

/// As text, so that the driver gets what a host without naga's IR would pass.
fn wgsl_of(composed: &Composed) -> String {
    let flags = naga::back::wgsl::WriterFlags::empty();
    naga::back::wgsl::write_string(&composed.module, &composed.info, flags)
        .unwrap_or_else(|error| panic!("naga does not write it: {error}"))
}

fn compiled(gpu: &Gpu, composed: &Composed) -> wgpu::ShaderModule {
    gpu.device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some("test"),
        source: wgpu::ShaderSource::Wgsl(wgsl_of(composed).into()),
    })
}

/// A storage buffer of [`gpu`] with these bytes (padded to at least 16, because bindings must not be empty).
pub fn storage(bytes: &[u8]) -> wgpu::Buffer {
    storage_of(gpu(), bytes)
}

fn storage_of(gpu: &Gpu, bytes: &[u8]) -> wgpu::Buffer {
    let mut padded = bytes.to_vec();
    padded.resize(bytes.len().max(16).next_multiple_of(4), 0);
    gpu.device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
        label: Some("test"),
        contents: &padded,
        usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC,
    })
}

/// A uniform buffer of [`gpu`] with these bytes.
pub fn uniform(bytes: &[u8]) -> wgpu::Buffer {
    gpu().device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
        label: Some("test"),
        contents: bytes,
        usage: wgpu::BufferUsages::UNIFORM,
    })
}

/// The bytes of a buffer of [`gpu`] that has `COPY_SRC`, after all submitted work.
///
/// # Panics
/// If the device is lost.
pub fn read(buffer: &wgpu::Buffer) -> Vec<u8> {
    read_of(gpu(), buffer)
}

fn read_of(gpu: &Gpu, buffer: &wgpu::Buffer) -> Vec<u8> {
    crate::blocking::read_buffer(gpu, buffer).unwrap_or_else(|error| panic!("{error}"))
}

/// Records something for [`gpu`] and submits it.
pub fn submit<T>(record: impl FnOnce(&mut Recorder) -> T) -> T {
    let gpu = gpu();
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    let mut recorder = Recorder::new(gpu, &mut encoder);
    let out = record(&mut recorder);
    drop(recorder);
    gpu.queue.submit([encoder.finish()]);
    out
}
