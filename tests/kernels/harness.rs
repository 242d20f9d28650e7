//! Runs WGSL functions over arrays of inputs on the GPU.

use bytemuck::{AnyBitPattern, NoUninit};
use lucerna::gpu::{AdapterChoice, Gpu, Recorder};
use lucerna::shader::{Source, Target};
use std::sync::OnceLock;
use wgpu::util::DeviceExt;

/// What outputs hold before a run: no kernel writes it by chance.
const POISON: u32 = 0xdead_beef;

/// The test process's device. A test that gets none fails: there is no skipping.
pub fn gpu() -> &'static Gpu {
    static GPU: OnceLock<Gpu> = OnceLock::new();
    GPU.get_or_init(|| match pollster::block_on(Gpu::open(&AdapterChoice::Auto)) {
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

/// The device if it has ray queries. Without them a test says so loudly and returns, unless
/// `LUCERNA_REQUIRE_RAY_QUERY=1`: then it fails. Names of such tests contain `ray_query`.
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

/// Calls the WGSL function `map` once for each input.
///
/// `wgsl` holds imports, the structs `Input` and `Output` (or aliases of them), and
/// `fn map(input: Input) -> Output`; `I` and `O` have the same layouts in storage buffers (mind
/// that vec3 is aligned to 16 bytes). The outputs are poisoned first, and no output may stay so.
pub fn map<I: NoUninit, O: AnyBitPattern + NoUninit>(wgsl: &str, inputs: &[I]) -> Vec<O> {
    map_with(wgsl, inputs, &[])
}

/// As [`map`], for WGSL that declares resources of its own in group 0, from binding 2 on.
pub fn map_with<I: NoUninit, O: AnyBitPattern + NoUninit>(
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
    let shader = compose(&text);
    let gpu = gpu();
    let pipeline = gpu.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: Some("test"),
        layout: None,
        module: &shader,
        entry_point: Some("harness_main"),
        compilation_options: Default::default(),
        cache: None,
    });
    let input_buffer = storage(bytemuck::cast_slice(inputs));
    let output_bytes = inputs.len() * size_of::<O>();
    let output_buffer = storage(bytemuck::cast_slice(&vec![POISON; output_bytes.div_ceil(4)]));
    let mut entries = vec![
        wgpu::BindGroupEntry { binding: 0, resource: input_buffer.as_entire_binding() },
        wgpu::BindGroupEntry { binding: 1, resource: output_buffer.as_entire_binding() },
    ];
    entries.extend_from_slice(resources);
    let bind_group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: None,
        layout: &pipeline.get_bind_group_layout(0),
        entries: &entries,
    });
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    {
        let mut pass = encoder.begin_compute_pass(&Default::default());
        pass.set_pipeline(&pipeline);
        pass.set_bind_group(0, &bind_group, &[]);
        let groups = inputs.len().div_ceil(64) as u32;
        pass.dispatch_workgroups(groups.min(32768), groups.div_ceil(32768), 1);
    }
    gpu.queue.submit([encoder.finish()]);
    let bytes = read(&output_buffer);
    let outputs: Vec<O> = bytes[..output_bytes]
        .chunks_exact(size_of::<O>())
        .map(bytemuck::pod_read_unaligned)
        .collect();
    for (ix, output) in outputs.iter().enumerate() {
        let words: Vec<u32> =
            bytemuck::bytes_of(output).chunks_exact(4).map(bytemuck::pod_read_unaligned).collect();
        assert!(words.iter().any(|&word| word != POISON), "output {ix} was not written");
    }
    outputs
}

/// Composes test WGSL with lucerna's modules.
pub fn compose(text: &str) -> wgpu::ShaderModule {
    let source = Source {
        import_path: "test".into(),
        file: "test.wgsl".into(),
        text: text.to_owned().into(),
    };
    let composed = lucerna::library()
        .compose(&source, Target::default())
        .unwrap_or_else(|problems| panic!("{}", problems[0]));
    let flags = naga::back::wgsl::WriterFlags::empty();
    let wgsl = naga::back::wgsl::write_string(&composed.module, &composed.info, flags)
        .expect("valid modules can be written");
    gpu().device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some("test"),
        source: wgpu::ShaderSource::Wgsl(wgsl.into()),
    })
}

/// A storage buffer with these bytes (at least 16, for bindings are never empty).
pub fn storage(bytes: &[u8]) -> wgpu::Buffer {
    let mut padded = bytes.to_vec();
    padded.resize(bytes.len().max(16).next_multiple_of(4), 0);
    gpu().device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
        label: Some("test"),
        contents: &padded,
        usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC,
    })
}

/// A uniform buffer with these bytes.
#[allow(dead_code)]
pub fn uniform(bytes: &[u8]) -> wgpu::Buffer {
    gpu().device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
        label: Some("test"),
        contents: bytes,
        usage: wgpu::BufferUsages::UNIFORM,
    })
}

/// A buffer's bytes, after all submitted work.
pub fn read(buffer: &wgpu::Buffer) -> Vec<u8> {
    let gpu = gpu();
    let staging = gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("readback"),
        size: buffer.size(),
        usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    });
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    encoder.copy_buffer_to_buffer(buffer, 0, &staging, 0, buffer.size());
    gpu.queue.submit([encoder.finish()]);
    staging
        .slice(..)
        .map_async(wgpu::MapMode::Read, |result| result.expect("mapping a test buffer"));
    gpu.device.poll(wgpu::PollType::wait_indefinitely()).expect("the device answers");
    staging.slice(..).get_mapped_range().expect("mapped above").to_vec()
}

/// Records something and submits it.
pub fn submit<T>(record: impl FnOnce(&mut Recorder) -> T) -> T {
    let gpu = gpu();
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    let out = record(&mut Recorder::new(gpu, &mut encoder));
    gpu.queue.submit([encoder.finish()]);
    out
}

/// Seeded random numbers for inputs: SplitMix64 (S. Vigna).
pub struct Random(pub u64);

impl Random {
    /// 64 random bits.
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Uniform in [0, 1), a multiple of 2⁻²⁴ (exact in f32).
    pub fn unit(&mut self) -> f32 {
        (self.bits() >> 40) as f32 / (1 << 24) as f32
    }

    /// Uniform in [low, high).
    pub fn range(&mut self, low: f32, high: f32) -> f32 {
        low + (high - low) * self.unit()
    }

    /// Uniformly distributed over the sphere, normalised in f64.
    pub fn direction(&mut self) -> glam::Vec3 {
        let z = 2.0 * f64::from(self.unit()) - 1.0;
        let phi = std::f64::consts::TAU * f64::from(self.unit());
        let r = (1.0 - z * z).max(0.0).sqrt();
        glam::DVec3::new(r * phi.cos(), r * phi.sin(), z).as_vec3()
    }
}
