// SPDX-License-Identifier: MIT OR Apache-2.0
//! Write strategies and the injection of irradiance into voxels.

use crate::harness::{Random, assert_each, gpu, map, normal_limit, read, storage, submit};
use bytemuck::{AnyBitPattern, NoUninit};
use glam::{Affine3A, DVec3, UVec2, UVec3, Vec3};
use lucerna::bindings::kernels::voxel_light::inject as kernel;
use lucerna::bindings::lucerna::components::voxel_light::accumulator as layout;
use lucerna::components::voxel_light::{
    InjectError, Injection, InjectionSource, RejectedSamples, VoxelInjector, VoxelIrradiance,
    VoxelSample, WriteStrategy, sparse_grid,
};
use lucerna::components::voxels::VoxelGrid;
use lucerna::frame::{View, ViewSettings};
use lucerna::gpu::GpuError;
use lucerna::gpu_scene::{GpuScene, GpuSceneOptions, RaySource};
use lucerna::scene::{Camera, Instance, Light, Material, Mesh, Projection, Scene, Sky};
use lucerna::settings;
use lucerna::shader::Variant;
use std::f64::consts::PI;
use wgpu::util::DeviceExt;

/// 2³² − 256.
const QUANTA_MAX: u64 = (1 << 32) - 256;

#[derive(Clone, Copy, Debug, NoUninit, AnyBitPattern)]
#[repr(C)]
struct Value {
    value: [f32; 3],
    scale: f32,
}

#[derive(Clone, Copy, Debug, NoUninit, AnyBitPattern)]
#[repr(C)]
struct Quanta {
    quanta: [u32; 3],
    verdict: u32,
}

#[test]
fn samples_are_checked_and_quantised() {
    let mut random = Random(1);
    let mut inputs = Vec::new();
    let edge = [
        0.0,
        -0.0,
        f32::MIN_POSITIVE,
        1e-45,
        0.49999997,
        0.5,
        1.5,
        2.5,
        8388607.5,
        8388609.0,
        16777217.0,
        4294967040.0,
        4294967296.0,
        f32::MAX,
        f32::INFINITY,
        f32::NEG_INFINITY,
        f32::NAN,
        -f32::NAN,
        -1.0,
        -1e-30,
    ];
    for a in edge {
        for b in edge {
            inputs.push(Value { value: [a, b, 1.0], scale: 1.0 });
            inputs.push(Value { value: [2.0, a, b], scale: 0.25 });
        }
    }
    for _ in 0..20_000 {
        let scale = 2f32.powi((random.bits() % 80) as i32 - 40);
        let value = std::array::from_fn(|_| 2f32.powf(random.range(-10.0, 34.0)) / scale);
        inputs.push(Value { value, scale });
    }
    let outputs: Vec<Quanta> = map(
        "#import lucerna::components::voxel_light::average::{check_sample, quantise, SAMPLE_REJECTED}
        struct Input { value: vec3<f32>, scale: f32 }
        struct Output { quanta: vec3<u32>, verdict: u32 }
        fn map(input: Input) -> Output {
            let verdict = check_sample(input.value, input.scale);
            if verdict == SAMPLE_REJECTED { return Output(vec3<u32>(0u), verdict); }
            return Output(quantise(input.value, input.scale), verdict);
        }",
        &inputs,
    );
    for (input, output) in inputs.iter().zip(&outputs) {
        let scaled = input.value.map(|v| f64::from(v) * f64::from(input.scale));
        let bad = input.value.iter().any(|v| !v.is_finite() || *v < 0.0);
        let above = scaled.iter().any(|&v| v > QUANTA_MAX as f64);
        // Numbers below the normal range may be flushed to 0 on either side: -1e-45 would be 0.
        let expected = if bad { 2 } else { u32::from(above) };
        assert_eq!(output.verdict, expected, "{input:?}: verdict (0 good, 1 clamped, 2 rejected)");
        for (scaled, quanta) in scaled.iter().zip(output.quanta).filter(|_| !bad) {
            // Exact: the scale is a power of two, and `round` takes ties to even.
            let expected = scaled.min(QUANTA_MAX as f64).round_ties_even() as u32;
            assert_eq!(quanta, expected, "{input:?}: quanta of {scaled}, of {:?}", output.quanta);
        }
    }
}

#[derive(Clone, Copy, Debug, NoUninit, AnyBitPattern)]
#[repr(C)]
struct Sum {
    low: [u32; 3],
    count: u32,
    high: [u32; 3],
    quantum: f32,
    added: [u32; 3],
    reserved: u32,
}

#[derive(Clone, Copy, Debug, NoUninit, AnyBitPattern)]
#[repr(C)]
struct Added {
    low: [u32; 3],
    a: u32,
    high: [u32; 3],
    b: u32,
    mean: [f32; 3],
    c: u32,
}

#[test]
fn sums_are_64_bit_integers() {
    let mut random = Random(2);
    let words = [0, 1, 2, 0x7fff_ffff, 0x8000_0000, 0xffff_fffe, 0xffff_ffff];
    let mut inputs = Vec::new();
    for low in words {
        for high in words {
            for added in words {
                // No sum that the average can reach is above this: (2³² − 1)(2³² − 256).
                let high = high.min(0xffff_fffe);
                let count = if high == 0 { 1 + low % 3 } else { 0xffff_ffff };
                inputs.push(Sum {
                    low: [low; 3],
                    count,
                    high: [high; 3],
                    quantum: 1.0,
                    added: [added; 3],
                    reserved: 0,
                });
            }
        }
    }
    for _ in 0..20_000 {
        let mut word = || (random.bits() >> (random.bits() % 32)) as u32;
        inputs.push(Sum {
            low: std::array::from_fn(|_| word()),
            count: word(),
            high: std::array::from_fn(|_| word() >> 1),
            quantum: 2f32.powi((word() % 60) as i32 - 50),
            added: std::array::from_fn(|_| word()),
            reserved: 0,
        });
    }
    let outputs: Vec<Added> = map(
        "#import lucerna::components::voxel_light::average::{WideSum, add_to_sum, mean_of_sum}
        struct Input { low: vec3<u32>, count: u32, high: vec3<u32>, quantum: f32, added: vec3<u32>, reserved: u32 }
        struct Output { low: vec3<u32>, a: u32, high: vec3<u32>, b: u32, mean: vec3<f32>, c: u32 }
        fn map(input: Input) -> Output {
            let sum = add_to_sum(WideSum(input.low, input.high), input.added);
            return Output(sum.low, 0u, sum.high, 0u, mean_of_sum(sum, input.count, input.quantum), 0u);
        }",
        &inputs,
    );
    for (input, output) in inputs.iter().zip(&outputs) {
        for k in 0..3 {
            let wide = |high: u32, low: u32| u128::from(high) << 32 | u128::from(low);
            let sum = wide(input.high[k], input.low[k]) + u128::from(input.added[k]);
            assert_eq!(wide(output.high[k], output.low[k]), sum, "{input:?}: sum {k} in 64 bits");
            let mean = match input.count {
                0 => 0.0,
                n => sum as f64 / f64::from(n) * f64::from(input.quantum),
            };
            assert!(
                (f64::from(output.mean[k]) - mean).abs() <= 6e-7 * mean,
                "{input:?}: mean {k} is {}, expected {mean} within 6e-7 of it",
                output.mean[k]
            );
        }
    }
}

#[derive(Clone, Copy, Debug, NoUninit, AnyBitPattern)]
#[repr(C)]
struct Step {
    value: [f32; 3],
    word: u32,
}

#[test]
fn the_packed_average_moves_as_described() {
    let mut random = Random(3);
    let inputs: Vec<Step> = (0..20_000)
        .map(|k| Step {
            value: std::array::from_fn(|_| random.range(-0.2, 1.2)),
            word: random.bits() as u32 | if k % 4 == 0 { 0xff00_0000 } else { 0 },
        })
        .collect();
    let outputs: Vec<[u32; 2]> = map(
        "#import lucerna::components::voxel_light::average::{moving_average_step, pack_average}
        struct Input { value: vec3<f32>, word: u32 }
        alias Output = vec2<u32>;
        fn map(input: Input) -> Output {
            return vec2<u32>(moving_average_step(input.word, input.value), pack_average(input.value, 7u));
        }",
        &inputs,
    );
    for (input, output) in inputs.iter().zip(&outputs) {
        let count = (input.word >> 24).saturating_add(1).min(255);
        assert_eq!(
            [output[0] >> 24, output[1] >> 24],
            [count, 7],
            "{input:?}: counts after a step, and as packed"
        );
        for k in 0..3 {
            let byte = |word: u32| f64::from(word >> (8 * k) & 0xff);
            let value = 255.0 * f64::from(input.value[k]).clamp(0.0, 1.0);
            // Half a step of rounding, and 1e-4 of a step for f32 (255 · 2⁻²⁴ · a few).
            assert!(
                (byte(output[1]) - value).abs() <= 0.5001,
                "{input:?}: byte {k} as packed is {}, expected {value} within 0.5001",
                byte(output[1])
            );
            let mean = byte(input.word) + (value - byte(input.word)) / f64::from(count);
            assert!(
                (byte(output[0]) - mean).abs() <= 0.5001,
                "{input:?}: byte {k} after a step is {}, expected {mean} within 0.5001",
                byte(output[0])
            );
        }
    }
}

#[test]
fn faces_are_chosen_by_the_squares_of_the_normal() {
    let mut random = Random(4);
    let axes: Vec<Vec3> = Vec3::AXES.into_iter().flat_map(|axis| [axis, -axis]).collect();
    let normals: Vec<Vec3> = axes.into_iter().chain((0..20).map(|_| random.direction())).collect();
    const DRAWS: usize = 20_000;
    let inputs: Vec<Value> = normals
        .iter()
        .flat_map(|n| {
            (0..DRAWS).map(|k| Value {
                value: n.to_array(),
                scale: ((k as f64 + 0.5) / DRAWS as f64) as f32,
            })
        })
        .collect();
    let faces: Vec<u32> = map(
        "#import lucerna::components::voxels::face_choice::choose_face
        struct Input { normal: vec3<f32>, u: f32 }
        alias Output = u32;
        fn map(input: Input) -> Output { return choose_face(input.normal, input.u); }",
        &inputs,
    );
    for (normal, faces) in normals.iter().zip(faces.chunks(DRAWS)) {
        for face in 0..6u32 {
            let n = f64::from(normal[face as usize / 2]);
            let looks = (face % 2 == 1) == (n < 0.0);
            let expected = if looks { n * n } else { 0.0 };
            let share = faces.iter().filter(|&&f| f == face).count() as f64 / DRAWS as f64;
            // u is equidistant: two ends of an interval, one draw each.
            assert!(
                (share - expected).abs() <= 2.1 / DRAWS as f64,
                "normal {normal}: face {face} is chosen in {share} of the draws, expected {expected} within {:.1e}",
                2.1 / DRAWS as f64
            );
        }
    }
}

/// Accumulators after `inject_samples` alone, from the words that stood there before.
fn raw(
    strategy: WriteStrategy,
    before: &[u32],
    n_records: u32,
    samples: &[VoxelSample],
    scale: f32,
) -> Vec<u32> {
    let gpu = gpu();
    let text = lucerna::kernel("voxel_light/inject", Variant::BASELINE).unwrap().composed.unwrap();
    let module = gpu.device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: None,
        source: wgpu::ShaderSource::Wgsl(text.into()),
    });
    let number = match strategy {
        WriteStrategy::Store => layout::STRATEGY_STORE,
        WriteStrategy::MovingAverage => layout::STRATEGY_MOVING_AVERAGE,
        WriteStrategy::Max => layout::STRATEGY_MAX,
        WriteStrategy::Exact => layout::STRATEGY_EXACT,
    };
    let pipeline = gpu.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: None,
        layout: None,
        module: &module,
        entry_point: Some(kernel::ENTRY_INJECT_SAMPLES),
        compilation_options: wgpu::PipelineCompilationOptions {
            constants: &[("STRATEGY", f64::from(number))],
            ..Default::default()
        },
        cache: None,
    });
    let (mut grid, _) = sparse_grid(Vec3::ZERO, 1.0, UVec3::ONE, 1, &[]);
    grid.capacity = n_records;
    let uniform = |bytes: &[u8]| {
        gpu.device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
            label: None,
            contents: bytes,
            usage: wgpu::BufferUsages::UNIFORM,
        })
    };
    let mut injection: kernel::Injection = bytemuck::Zeroable::zeroed();
    injection.n_samples = samples.len() as u32;
    injection.quanta_per_unit = scale;
    injection.unorm_per_unit = 1.0;
    let (grid, injection) =
        (uniform(bytemuck::bytes_of(&grid)), uniform(bytemuck::bytes_of(&injection)));
    let (accumulators, samples_buffer) =
        (storage(bytemuck::cast_slice(before)), storage(bytemuck::cast_slice(samples)));
    let group = |ix, entries: &[(u32, &wgpu::Buffer)]| {
        let entries: Vec<_> = entries
            .iter()
            .map(|(binding, buffer)| wgpu::BindGroupEntry {
                binding: *binding,
                resource: buffer.as_entire_binding(),
            })
            .collect();
        gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout: &pipeline.get_bind_group_layout(ix),
            entries: &entries,
        })
    };
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    {
        let mut pass = encoder.begin_compute_pass(&Default::default());
        pass.set_pipeline(&pipeline);
        pass.set_bind_group(1, &group(1, &[(0, &grid), (1, &injection)]), &[]);
        pass.set_bind_group(2, &group(2, &[(0, &samples_buffer)]), &[]);
        pass.set_bind_group(3, &group(3, &[(5, &accumulators)]), &[]);
        pass.dispatch_workgroups((samples.len() as u32).div_ceil(64 * kernel::RUN), 1, 1);
    }
    gpu.queue.submit([encoder.finish()]);
    bytemuck::pod_collect_to_vec(&read(&accumulators)[..4 * before.len()])
}

fn sample(value: f32, record: u32) -> VoxelSample {
    VoxelSample { value: Vec3::splat(value), record }
}

/// Words of one exact record with these sums and count.
fn exact_words(sum: u64, count: u32) -> Vec<u32> {
    let (low, high) = (sum as u32, (sum >> 32) as u32);
    let mut words = vec![0; layout::HEAD_WORDS as usize];
    words.extend([low, low, low, count, high, high, high, 0]);
    words
}

/// Sums near 2³² and 2⁶⁴: not a carry is lost, whichever sample makes it, and the largest sum that
/// the count allows still fits.
#[test]
fn carries_reach_the_high_words() {
    let largest = QUANTA_MAX as f32;
    let end = u64::from(u32::MAX) * QUANTA_MAX;
    for (before, n_before, values) in [
        ((1u64 << 32) - 5, 1u32, vec![4.0, 1.0, 0.0, 3.0]),
        ((1 << 32) - 1, 1, vec![1.0]),
        ((1 << 32) - 1, 1, vec![largest; 1000]),
        ((7 << 32) - 100, 9, vec![1.0; 300]),
        // The last samples that a count of 2³² − 1 admits.
        (end - 2000 * QUANTA_MAX, u32::MAX - 2000, vec![largest; 2000]),
    ] {
        let samples: Vec<_> = values.iter().map(|&v| sample(v, 0)).collect();
        let after = raw(WriteStrategy::Exact, &exact_words(before, n_before), 1, &samples, 1.0);
        let sum = u128::from(before) + values.iter().map(|&v| v as u128).sum::<u128>();
        let count = n_before + values.len() as u32;
        assert_eq!(
            after,
            exact_words(u64::try_from(sum).unwrap(), count),
            "words of sum {before} and count {n_before} after {} samples: expected sum {sum}, count {count}",
            values.len()
        );
    }
}

/// What the source's average does wrong, and where the exact one does not: after 255 samples a step
/// of (x − m)/255 below half an 8-bit unit is lost.
#[test]
fn the_moving_average_stalls_at_255_samples() {
    let mut packed = vec![0; layout::HEAD_WORDS as usize];
    packed.push(0xff80_8080);
    let samples = vec![sample(228.0 / 255.0, 0); 10_000];
    let after = raw(WriteStrategy::MovingAverage, &packed, 1, &samples, 1.0);
    assert_eq!(
        after[8], 0xff80_8080,
        "word {:#x} of the moving average, expected to stall (the true mean has long become 226)",
        after[8]
    );
    // Few samples, one value: right to half an 8-bit unit for each sample.
    packed[8] = 0;
    let after = raw(WriteStrategy::MovingAverage, &packed, 1, &samples[..100], 1.0);
    assert_eq!(
        after[8],
        100 << 24 | 0xe4_e4e4,
        "word {:#x} of the moving average after 100 samples of 228",
        after[8]
    );
    let before = exact_words((255 * 128) << 16, 255);
    let after = raw(WriteStrategy::Exact, &before, 1, &vec![sample(228.0, 0); 10_000], 65536.0);
    assert_eq!(
        after,
        exact_words((255 * 128 + 10_000 * 228) << 16, 10_255),
        "words of the exact average after 10 000 more samples of 228"
    );
}

#[test]
fn maximum_and_store_keep_one_of_the_samples() {
    let mut random = Random(5);
    let samples: Vec<_> = (0..5000)
        .map(|_| VoxelSample {
            value: Vec3::from_array(std::array::from_fn(|_| (random.bits() % 256) as f32 / 255.0)),
            record: (random.bits() % 16) as u32,
        })
        .collect();
    let word = |s: &VoxelSample| {
        let [r, g, b] = s.value.to_array().map(|v| (v * 255.0).round() as u32);
        r | g << 8 | b << 16 | 255 << 24
    };
    let before = vec![0; layout::HEAD_WORDS as usize + 16];
    let stored = raw(WriteStrategy::Store, &before, 16, &samples, 1e6);
    let largest = raw(WriteStrategy::Max, &before, 16, &samples, 1e6);
    for record in 0..16u32 {
        let words: Vec<u32> = samples.iter().filter(|s| s.record == record).map(word).collect();
        let found = stored[8 + record as usize];
        assert!(
            words.contains(&found),
            "record {record}: {found:#x} is stored, expected one of its {} samples",
            words.len()
        );
        assert_eq!(
            largest[8 + record as usize],
            *words.iter().max().unwrap(),
            "record {record}: the largest of its samples"
        );
    }
    assert_each(
        "head words after Store and Max",
        stored[..8].iter().chain(&largest[..8]),
        "0",
        |&w| w == 0,
    );
}

/// A volume with its injector on a scene.
struct Rig {
    scene: GpuScene,
    volume: VoxelIrradiance,
    injector: VoxelInjector,
    cells: Vec<UVec3>,
}

impl Rig {
    fn new(
        scene: &Scene,
        grid: VoxelGrid,
        structure: &[[u32; 2]],
        strategy: WriteStrategy,
    ) -> Self {
        Self::with_rays(scene, grid, structure, strategy, RaySource::Software)
    }

    fn with_rays(
        scene: &Scene,
        grid: VoxelGrid,
        structure: &[[u32; 2]],
        strategy: WriteStrategy,
        rays: RaySource,
    ) -> Self {
        let options = settings!(GpuSceneOptions { rays, ..Default::default() });
        let scene = GpuScene::new(gpu(), scene, options).unwrap();
        let volume =
            VoxelIrradiance::new(gpu(), grid, &storage(bytemuck::cast_slice(structure)), strategy)
                .unwrap();
        let injector = VoxelInjector::new(gpu(), &scene, strategy);
        let cells = structure[grid.bricks.element_product() as usize..]
            .iter()
            .map(|&[cell, _]| UVec3::new(cell & 1023, cell >> 10 & 1023, cell >> 20))
            .collect();
        Self { scene, volume, injector, cells }
    }

    /// Means of all records, and what was left out.
    fn run(&self, injections: &[Injection]) -> (Vec<[f32; 4]>, RejectedSamples) {
        submit(|recorder| {
            self.volume.clear_counters(recorder.encoder());
            self.injector.record(recorder, &self.scene, &self.volume, injections).unwrap();
        });
        let accumulators = read(self.volume.accumulators());
        assert_each("bytes of the accumulators after resolving", &accumulators[32..], "0", |&b| {
            b == 0
        });
        (
            bytemuck::pod_collect_to_vec(&read(self.volume.means())),
            RejectedSamples::from_bytes(&accumulators),
        )
    }
}

fn line_of_records(n: u32) -> (VoxelGrid, Vec<[u32; 2]>) {
    let cells: Vec<_> = (0..n).map(|k| UVec3::new(k % 40, k / 40, 0)).collect();
    sparse_grid(Vec3::ZERO, 1.0, UVec3::new(40, n.div_ceil(40), 1), 1, &cells)
}

fn samples_injection(buffer: &wgpu::Buffer, n: usize, largest: f32) -> Injection<'_> {
    Injection {
        source: InjectionSource::Samples(buffer, n as u32),
        n_rays: 0,
        seed: 0,
        largest_irradiance: largest,
    }
}

/// 1000 records with 1 to 100 000 samples over a range of 1 : 800 000, against f64, and the same
/// bits for other orders. Tolerance: half a quantum (1.2e-10 of the largest value), which over
/// the stated range is 1e-4, and 6e-7 for f32.
#[test]
fn the_exact_average_is_exact_in_any_order() {
    const RECORDS: u32 = 1000;
    const LARGEST: f32 = 1000.0;
    let mut random = Random(6);
    let mut samples = Vec::new();
    for record in 0..RECORDS {
        let n = match record {
            0 => 100_000,
            k if k % 3 == 0 => 1,
            k => 1 + k / 4,
        };
        let base = random.range(-2.9, 2.9);
        for _ in 0..n {
            let value = std::array::from_fn(|_| 10f32.powf(base + random.range(0.0, 0.1)));
            samples.push(VoxelSample { value: Vec3::from_array(value), record });
        }
    }
    let mut expected = vec![(DVec3::ZERO, 0u32); RECORDS as usize];
    for s in &samples {
        expected[s.record as usize].0 += s.value.as_dvec3();
        expected[s.record as usize].1 += 1;
    }
    // What must not get in, and what is clamped.
    let bad = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -1e-3, -1.0];
    for k in 0..500 {
        let mut value = [1.0, 2.0, 3.0];
        value[k % 3] = bad[k % bad.len()];
        samples.push(VoxelSample { value: Vec3::from_array(value), record: k as u32 });
    }
    for k in 0..300 {
        let record = [RECORDS, RECORDS + 7, u32::MAX][k % 3];
        samples.push(sample(1.0, record));
    }
    // 1000 lies 2.4 % below the power of two up to which this goes.
    for k in 0..40 {
        samples.push(sample(1e9, k));
        expected[k as usize].0 += DVec3::splat(1024.0 * (1.0 - 2f64.powi(-24)));
        expected[k as usize].1 += 1;
    }
    let (grid, structure) = line_of_records(RECORDS);
    let rig = Rig::new(&plane_scene(), grid, &structure, WriteStrategy::Exact);
    let mut first = None;
    for round in 0..5 {
        if round > 1 {
            for k in (1..samples.len()).rev() {
                samples.swap(k, (random.bits() % (k as u64 + 1)) as usize);
            }
        }
        let buffer = storage(bytemuck::cast_slice(&samples));
        let (means, rejected) = rig.run(&[samples_injection(&buffer, samples.len(), LARGEST)]);
        assert_eq!(
            rejected,
            RejectedSamples { not_finite: 500, clamped: 40, outside: 300, cut: 0 },
            "round {round}: samples left out"
        );
        for (ix, (sum, count)) in expected.iter().enumerate() {
            let mean = means[ix];
            assert_eq!(mean[3], *count as f32, "round {round}, record {ix}: number of samples");
            for k in 0..3 {
                let expected = sum[k] / f64::from(*count);
                let error = (f64::from(mean[k]) - expected).abs();
                let quantum = 1024.0 / 2f64.powi(32);
                assert!(
                    error <= 0.5 * quantum + 6e-7 * expected,
                    "round {round}, record {ix}: mean {k} is {}, expected {expected} within {:.1e}",
                    mean[k],
                    0.5 * quantum + 6e-7 * expected
                );
                assert!(
                    error <= 1.01e-4 * expected,
                    "round {round}, record {ix}: mean {k} is {}, expected {expected} within 1.01e-4 of it",
                    mean[k]
                );
            }
        }
        let bits: Vec<u32> = means.iter().flatten().map(|v| v.to_bits()).collect();
        let first = first.get_or_insert_with(|| bits.clone());
        let n_differ = first.iter().zip(&bits).filter(|(a, b)| a != b).count();
        assert!(
            first == &bits,
            "round {round}: {n_differ} of {} numbers of the means are not those of round 0",
            bits.len()
        );
    }
}

/// A horizontal square of side 8 around the origin, at y = 0.1, wound upwards.
fn plane_scene() -> Scene {
    Scene {
        meshes: vec![quad(Vec3::new(-4.0, 0.1, -4.0), Vec3::Z * 8.0, Vec3::X * 8.0, 0)],
        instances: vec![Instance { mesh: 0, world_from_object: Affine3A::IDENTITY }],
        materials: vec![Material::default()],
        ..Scene::default()
    }
}

/// Its front looks along cross(u, v).
fn quad(corner: Vec3, u: Vec3, v: Vec3, material: usize) -> Mesh {
    Mesh {
        positions: vec![corner, corner + u, corner + u + v, corner + v],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        material,
        ..Mesh::default()
    }
}

/// Cells of 0.25 m under the plane of `plane_scene`.
fn plane_grid(n_faces: u32) -> (VoxelGrid, Vec<[u32; 2]>) {
    let cells: Vec<_> = (0..32 * 32).map(|k| UVec3::new(k % 32, 4, k / 32)).collect();
    sparse_grid(Vec3::new(-4.0, -1.0, -4.0), 0.25, UVec3::new(32, 8, 32), n_faces, &cells)
}

fn light_rays(light: u32, largest: f32) -> Injection<'static> {
    Injection {
        source: InjectionSource::Light(light),
        n_rays: 512,
        seed: 7,
        largest_irradiance: largest,
    }
}

/// Weighted mean and standard deviation over a cell of the plane, by midpoints.
fn over_cell(cell: UVec3, at: impl Fn(DVec3) -> (f64, f64)) -> (f64, f64) {
    const N: u32 = 24;
    let (mut weights, mut sum, mut squares) = (0.0, 0.0, 0.0);
    for k in 0..N * N {
        let place =
            |c: u32, k: u32| -4.0 + 0.25 * (f64::from(c) + (f64::from(k) + 0.5) / f64::from(N));
        let (value, weight) = at(DVec3::new(place(cell.x, k % N), 0.1, place(cell.z, k / N)));
        weights += weight;
        sum += weight * value;
        squares += weight * value * value;
    }
    if weights == 0.0 {
        return (0.0, 0.0);
    }
    let mean = sum / weights;
    (mean, (squares / weights - mean * mean).max(0.0).sqrt())
}

/// Compares the +Y records with the cell means. `at`: value and density of samples at a place.
/// Tolerance: standard errors at the suite's level, where stratified samples have less than random ones, and 1e-4 for
/// the integral over the cell by 24² midpoints. Cells with less than 20 samples say too little.
fn check_plane(
    rig: &Rig,
    means: &[[f32; 4]],
    noise: f64,
    at: impl Fn(DVec3) -> (f64, f64),
) -> usize {
    let n_faces = rig.volume.grid().n_faces as usize;
    let mut n_checked = 0;
    let mut failures = Vec::new();
    for (slot, &cell) in rig.cells.iter().enumerate() {
        let face = if n_faces == 6 { 2 } else { 0 };
        let mean = means[slot * n_faces + face];
        for other in (0..n_faces).filter(|&f| f != face) {
            assert_eq!(
                means[slot * n_faces + other],
                [0.0; 4],
                "mean of face {other} of cell {cell}, which looks away"
            );
        }
        let (expected, deviation) = over_cell(cell, &at);
        if mean[3] < 20.0 {
            continue;
        }
        n_checked += 1;
        let error = normal_limit(3 * rig.cells.len()) * (deviation + noise * expected)
            / f64::from(mean[3]).sqrt()
            + 1e-4 * expected;
        for channel in 0..3 {
            let scale = [1.0, 0.5, 0.25][channel];
            let off = f64::from(mean[channel]) - scale * expected;
            if off.abs() > scale * error + 1e-6 {
                failures.push(format!("cell {cell}: the mean irradiance in channel {channel} is {} of {} samples, expected {} ± {}", mean[channel], mean[3], scale * expected, scale * error));
            }
        }
    }
    assert!(
        failures.is_empty(),
        "{} channels of {n_checked} cells are off; {}",
        failures.len(),
        failures[0]
    );
    n_checked
}

const COLOR: Vec3 = Vec3::new(1.0, 0.5, 0.25);
const LIGHT: DVec3 = DVec3::new(0.3, 2.1, -0.2);

/// E = I·cosθ/d² on the plane, in red.
fn point_irradiance(at: DVec3) -> f64 {
    let offset = LIGHT - at;
    12.0 * offset.y / offset.length().powi(3)
}

fn point_scene() -> Scene {
    let light = Light::Point { position: LIGHT.as_vec3(), intensity: 12.0 * COLOR, range: None };
    Scene { lights: vec![light], ..plane_scene() }
}

#[test]
fn a_point_lights_rays_give_its_irradiance() {
    for n_faces in [1, 6] {
        let (grid, structure) = plane_grid(n_faces);
        let rig = Rig::new(&point_scene(), grid, &structure, WriteStrategy::Exact);
        let (means, rejected) = rig.run(&[light_rays(0, 100.0)]);
        assert_eq!(
            rejected,
            RejectedSamples::default(),
            "{n_faces} faces: samples left out of a point light"
        );
        // Uniform over the sphere: the density on the plane is cosθ/d², as E.
        let n = check_plane(&rig, &means, 0.0, |at| (point_irradiance(at), point_irradiance(at)));
        assert!(n > 900, "{n_faces} faces: {n} cells have 20 samples, expected above 900"); // the corners get fewer than 20 samples
        // As many hits as the plane's share of the sphere asks for: stratified, so all but the
        // plane's border (4·512 strata at most) is exact, and the integral over cells to 1e-3.
        let total: f64 = means.iter().map(|m| f64::from(m[3])).sum();
        let share: f64 = (0..32 * 32)
            .map(|k| over_cell(UVec3::new(k % 32, 4, k / 32), |at| (point_irradiance(at), 1.0)).0)
            .sum::<f64>()
            / 12.0
            / (64.0 * PI);
        assert!(
            (total - 512.0 * 512.0 * share).abs() < 300.0,
            "{n_faces} faces: {total} samples arrive, expected {} within 300",
            512.0 * 512.0 * share
        );
        // The same bits again; and twice the light is the sum of two injections.
        let again = rig.run(&[light_rays(0, 100.0)]).0;
        assert_eq!(means, again, "{n_faces} faces: means of the same injection again");
        let twice = rig.run(&[light_rays(0, 100.0), light_rays(0, 100.0)]).0;
        for (ix, (a, b)) in means.iter().zip(&twice).enumerate() {
            assert!(
                (0..4).all(|k| 2.0 * a[k] == b[k]),
                "{n_faces} faces, record {ix}: two injections give {b:?}, expected twice {a:?}"
            );
        }
    }
}

#[test]
fn ray_query_injects_as_software_rays_do() {
    if crate::harness::ray_query_gpu().is_none() {
        return;
    }
    let (grid, structure) = plane_grid(1);
    let rig =
        Rig::with_rays(&point_scene(), grid, &structure, WriteStrategy::Exact, RaySource::RayQuery);
    let (means, _) = rig.run(&[light_rays(0, 100.0)]);
    let n = check_plane(&rig, &means, 0.0, |at| (point_irradiance(at), point_irradiance(at)));
    assert!(n > 900, "by ray query {n} cells have 20 samples, expected above 900"); // the corners get fewer than 20 samples
}

#[test]
fn a_spots_rays_stay_within_its_cone() {
    let (inner, outer) = (0.3f32, 0.6f32);
    let axis = Vec3::new(0.2, -1.0, 0.1).normalize();
    let light = Light::Spot {
        position: LIGHT.as_vec3(),
        direction: axis,
        intensity: 12.0 * COLOR,
        inner,
        outer,
        range: None,
    };
    let (grid, structure) = plane_grid(6);
    let scene = Scene { lights: vec![light], ..plane_scene() };
    let rig = Rig::new(&scene, grid, &structure, WriteStrategy::Exact);
    let (means, rejected) = rig.run(&[light_rays(0, 100.0)]);
    assert_eq!(rejected, RejectedSamples::default(), "samples left out of a spot");
    let n = check_plane(&rig, &means, 0.0, |at| {
        let cosine = (at - LIGHT).normalize().dot(axis.as_dvec3());
        let (from, to) = (f64::from(outer).cos(), f64::from(inner).cos());
        let falloff = ((cosine - from) / (to - from)).clamp(0.0, 1.0).powi(2);
        let inside = if cosine > from { point_irradiance(at) } else { 0.0 };
        (falloff * point_irradiance(at), inside)
    });
    assert!(n > 100, "{n} cells of a spot have 20 samples, expected above 100");
    // All rays meet the plane.
    assert_eq!(
        means.iter().map(|m| f64::from(m[3])).sum::<f64>(),
        512.0 * 512.0,
        "samples of a spot that arrive, expected all"
    );
}

#[test]
fn directional_light_falls_by_the_cosine() {
    let direction = Vec3::new(0.5, -1.0, 0.25).normalize();
    let light = Light::Directional { direction, irradiance: 3.0 * COLOR };
    let (grid, structure) = plane_grid(6);
    let scene = Scene { lights: vec![light], ..plane_scene() };
    let rig = Rig::new(&scene, grid, &structure, WriteStrategy::Exact);
    let (means, rejected) = rig.run(&[light_rays(0, 3.0)]);
    assert_eq!(rejected, RejectedSamples::default(), "samples left out of a directional light");
    let expected = 3.0 * f64::from(-direction.y);
    assert_eq!(
        check_plane(&rig, &means, 0.0, |_| (expected, 1.0)),
        32 * 32,
        "cells of a directional light with 20 samples"
    );
    assert_each(
        "means of a directional light",
        &means,
        &format!("empty or {expected} within 1e-6"),
        |m| m[3] == 0.0 || (f64::from(m[0]) - expected).abs() < 1e-6,
    );
}

fn camera_rays(view: &View, largest: f32) -> Injection<'_> {
    Injection {
        source: InjectionSource::Camera(&view.data().camera),
        n_rays: 512,
        seed: 3,
        largest_irradiance: largest,
    }
}

/// Looks down on the plane's 8 × 8 m from `height` above it [m].
fn view_from(scene: &GpuScene, height: f32) -> View {
    let camera = Camera {
        name: String::new(),
        position: Vec3::Y * height,
        forward: Vec3::NEG_Y,
        up: Vec3::Z,
        projection: Projection::Orthographic { half_height: 4.0 },
    };
    let settings = ViewSettings::default();
    let mut view = View::new(UVec2::splat(512));
    view.advance(scene, &camera, &settings);
    view
}

/// Rays of an orthographic camera are uniform over the plane, 256 a cell, and a shadow ray decides.
#[test]
fn camera_rays_give_the_mean_irradiance() {
    let (grid, structure) = plane_grid(6);
    let rig = Rig::new(&point_scene(), grid, &structure, WriteStrategy::Exact);
    let view = view_from(&rig.scene, 5.0);
    let (means, rejected) = rig.run(&[camera_rays(&view, 100.0)]);
    assert_eq!(rejected, RejectedSamples::default(), "samples left out of camera rays");
    assert_eq!(
        check_plane(&rig, &means, 0.0, |at| (point_irradiance(at), 1.0)),
        32 * 32,
        "cells with 20 samples of camera rays"
    );
    // Camera and light agree but for the weight, and a roof's shadow is black, not empty.
    let mut shadowed = point_scene();
    shadowed.meshes.push(quad(Vec3::new(-4.0, 1.0, -4.0), Vec3::Z * 8.0, Vec3::X * 4.0, 0));
    shadowed.instances.push(Instance { mesh: 1, world_from_object: Affine3A::IDENTITY });
    let rig = Rig::new(&shadowed, grid, &structure, WriteStrategy::Exact);
    let below_roof = view_from(&rig.scene, 0.9);
    let means = rig.run(&[camera_rays(&below_roof, 100.0)]).0;
    // The roof ends at x = 0; its edge's shadow falls to x = −0.3·0.45/0.55 = −0.2455.
    for (slot, cell) in rig.cells.iter().enumerate() {
        let mean = means[slot * 6 + 2];
        let right = -4.0 + 0.25 * f64::from(cell.x + 1);
        assert_eq!(mean[3], 256.0, "cell {cell} below the roof: samples of camera rays");
        assert_eq!(
            mean[0] == 0.0,
            right <= -0.2455,
            "cell {cell}, which ends at x = {right}: whether its mean {mean:?} is in the roof's shadow"
        );
    }
}

/// The sky over an open plane: E = πL, from light rays and from the camera. One direction a sample,
/// uniform over the sphere: E is 4πL·cosθ or 0; its deviation is √(16/6 − 1) = 1.29 of its mean.
#[test]
fn a_uniform_sky_gives_pi_l() {
    let scene = Scene { sky: Sky::Constant(2.0 * COLOR), ..plane_scene() };
    let (grid, structure) = plane_grid(6);
    let rig = Rig::new(&scene, grid, &structure, WriteStrategy::Exact);
    let view = view_from(&rig.scene, 5.0);
    let extended = Injection { source: InjectionSource::Extended, ..light_rays(0, 40.0) };
    for (injection, below) in [(extended, true), (camera_rays(&view, 40.0), false)] {
        let (means, rejected) = rig.run(&[injection]);
        assert_eq!(
            rejected,
            RejectedSamples::default(),
            "below: {below}: samples left out of a sky"
        );
        let mut sums = [0.0; 2];
        for (slot, cell) in rig.cells.iter().enumerate() {
            for (side, face) in [2, 3].into_iter().enumerate() {
                let mean = means[6 * slot + face].map(f64::from);
                if mean[3] == 0.0 {
                    assert!(
                        side == 1 && !below,
                        "cell {cell}, face {face}, below: {below}: no samples, expected some"
                    );
                    continue;
                }
                let error = normal_limit(2 * rig.cells.len()) * 1.3 / mean[3].sqrt();
                assert!(
                    (mean[0] / (2.0 * PI) - 1.0).abs() < error,
                    "cell {cell}, face {face}, below: {below}: the sky's mean irradiance is {}, expected 2π within {error:.3} of it",
                    mean[0]
                );
                sums[side] += mean[0] / (2.0 * PI) / 1024.0;
            }
        }
        // 2¹⁷ samples at least.
        assert!(
            (sums[0] - 1.0).abs() < normal_limit(2) * 1.3 / 362.0,
            "below: {below}: irradiance from above is {} of 2π, expected 1 within {:.4}",
            sums[0],
            normal_limit(2) * 1.3 / 362.0
        );
        assert!(
            !below || (sums[1] - 1.0).abs() < normal_limit(2) * 1.3 / 300.0,
            "irradiance from below is {} of 2π, expected 1 within {:.4}",
            sums[1],
            normal_limit(2) * 1.3 / 300.0
        );
    }
}

/// Rays that meet nothing light nothing, wherever they come from: a camera that looks up from the plane, and a light of
/// which the plane is behind.
#[test]
fn rays_into_the_open_arrive_nowhere() {
    for n_faces in [1, 6] {
        // Cells around the origin too, which is where a point is that nobody has set.
        let cells: Vec<_> =
            (0..16 * 16 * 16).map(|k| UVec3::new(k % 16, k / 16 % 16, k / 256)).collect();
        let (grid, structure) =
            sparse_grid(Vec3::splat(-2.0), 0.25, UVec3::splat(16), n_faces, &cells);
        let rig = Rig::new(&point_scene(), grid, &structure, WriteStrategy::Exact);
        let mut view = View::new(UVec2::splat(64));
        let camera = Camera {
            name: String::new(),
            position: Vec3::Y,
            forward: Vec3::Y,
            up: Vec3::Z,
            projection: Projection::Orthographic { half_height: 1.0 },
        };
        view.advance(&rig.scene, &camera, &ViewSettings::default());
        let (means, rejected) = rig.run(&[camera_rays(&view, 100.0)]);
        assert_eq!(rejected, RejectedSamples::default(), "{n_faces} faces: samples left out");
        assert_each(
            &format!("{n_faces} faces: means of a camera that sees nothing"),
            &means,
            "empty",
            |&mean| mean == [0.0; 4],
        );
    }
}

/// Which face a point counts for is drawn independently of where it is: a slope of 45° with its left half in shade, all in one
/// voxel, has half of the light on both of its faces, although one ray a frame is spread over all of it. Seeds of 400 frames.
#[test]
fn the_face_is_drawn_independently_of_the_place() {
    let mut scene = Scene {
        meshes: vec![
            quad(Vec3::new(-0.4, 0.4, -0.4), Vec3::Z * 0.8, Vec3::new(0.8, -0.8, 0.0), 0),
            // A roof over the left half, above the camera.
            quad(Vec3::new(-4.0, 2.0, -4.0), Vec3::Z * 8.0, Vec3::X * 4.0, 0),
        ],
        instances: Vec::new(),
        materials: vec![Material::default()],
        lights: vec![Light::Directional { direction: Vec3::NEG_Y, irradiance: Vec3::ONE }],
        ..Scene::default()
    };
    scene.instances =
        [0, 1].map(|mesh| Instance { mesh, world_from_object: Affine3A::IDENTITY }).into();
    let (grid, structure) = sparse_grid(Vec3::splat(-0.5), 1.0, UVec3::splat(1), 6, &[UVec3::ZERO]);
    let rig = Rig::new(&scene, grid, &structure, WriteStrategy::Exact);
    for (source, side) in [("along x", Vec3::Z), ("along y", Vec3::X)] {
        let camera = Camera {
            name: String::new(),
            position: Vec3::Y,
            forward: Vec3::NEG_Y,
            up: side,
            projection: Projection::Orthographic { half_height: 0.4 },
        };
        let mut view = View::new(UVec2::splat(64));
        view.advance(&rig.scene, &camera, &ViewSettings::default());
        let frames: Vec<Injection<'_>> = (0..400)
            .map(|seed| Injection { n_rays: 1, seed, ..camera_rays(&view, 10.0) })
            .collect();
        let (means, _) = rig.run(&frames);
        // Faces towards +x and +y.
        for face in [0, 2] {
            let [sum, _, _, n] = means[face].map(f64::from);
            // Each frame is an injection of its own, and injections add up.
            let light = sum / n;
            assert!(
                (100.0..300.0).contains(&n),
                "{source}, face {face}: {n} of 400 samples, expected about 200"
            );
            // Lit or not with chance ½: the deviation is ½ of the irradiance, √½.
            let (expected, error) = (0.5 * 0.5f64.sqrt(), 0.5 * 0.5f64.sqrt() / n.sqrt());
            assert!(
                (light - expected).abs() < normal_limit(4) * error,
                "the picture's x {source}, face {face}: mean irradiance {light} of {n} samples, expected {expected} ± {error}"
            );
        }
    }
}

/// A closed box of 3 × 3 × 3 m with an emissive quad of 1 m² below its ceiling: what arrives on all
/// surfaces is what left, πLA. The quad's own back and the ceiling above it get light as well.
/// Tolerance 1.5 %: the light's weight within voxels (noise: 0.5 %). The quad lies on a border of
/// cells, for walls above it are dark, and a voxel half of which is dark would count as bright.
#[test]
fn an_emissive_quads_energy_arrives() {
    let (low, high) = (0.15f32, 3.15f32);
    let edge = high - low;
    let (l, h) = (Vec3::splat(low), Vec3::splat(high));
    let emissive = Material { emission: 5.0 * COLOR, ..Material::default() };
    let meshes = vec![
        quad(l, Vec3::Z * edge, Vec3::X * edge, 0),
        quad(l, Vec3::X * edge, Vec3::Y * edge, 0),
        quad(l, Vec3::Y * edge, Vec3::Z * edge, 0),
        quad(h, Vec3::NEG_Z * edge, Vec3::NEG_X * edge, 0),
        quad(h, Vec3::NEG_X * edge, Vec3::NEG_Y * edge, 0),
        quad(h, Vec3::NEG_Y * edge, Vec3::NEG_Z * edge, 0),
        quad(Vec3::new(1.15, 2.625, 1.15), Vec3::X, Vec3::Z, 1),
    ];
    let scene = Scene {
        instances: (0..meshes.len())
            .map(|mesh| Instance { mesh, world_from_object: Affine3A::IDENTITY })
            .collect(),
        meshes,
        materials: vec![Material::default(), emissive],
        ..Scene::default()
    };
    // Cells of 0.15 m: the walls run through their middles.
    let cells: Vec<_> = (0..21 * 21 * 21)
        .map(|k| UVec3::new(k % 21, k / 21 % 21, k / 441))
        .filter(|c| c.min_element() == 0 || c.max_element() == 20)
        .collect();
    let (grid, structure) = sparse_grid(Vec3::splat(0.075), 0.15, UVec3::splat(21), 6, &cells);
    let rig = Rig::new(&scene, grid, &structure, WriteStrategy::Exact);
    let injection = Injection { source: InjectionSource::Extended, ..light_rays(0, 4000.0) };
    let (means, rejected) = rig.run(&[injection]);
    assert_eq!(
        (rejected.not_finite, rejected.clamped),
        (0, 0),
        "samples of an emissive quad that are not finite or clamped: {rejected:?}"
    );
    let along = |c: u32| if c == 0 || c == 20 { 0.075 } else { 0.15 };
    let mut flux = 0.0;
    for (slot, cell) in rig.cells.iter().enumerate() {
        for face in 0..6usize {
            let axis = face / 2;
            let area: f64 = (0..3).filter(|&a| a != axis).map(|a| along(cell[a])).product();
            flux += f64::from(means[6 * slot + face][0]) * area;
        }
    }
    let expected = PI * 5.0;
    println!("flux {flux}, expected {expected}");
    assert!(
        (flux / expected - 1.0).abs() < 0.015,
        "flux of an emissive quad that arrives is {flux}, expected {expected} within 1.5 %"
    );
    // In the middle of the floor: E = L ∫∫ cos² /d² over the quad.
    let at = |x: f64, z: f64| {
        let mut sum = 0.0;
        for k in 0..400 {
            let y = DVec3::new(
                1.15 + (k % 20) as f64 / 20.0 + 0.025,
                2.625,
                1.15 + (k / 20) as f64 / 20.0 + 0.025,
            );
            let d = y - DVec3::new(x, 0.15, z);
            sum += d.y * d.y / d.length_squared().powi(2) / 400.0;
        }
        5.0 * sum
    };
    let middle = rig.cells.iter().position(|&c| c == UVec3::new(10, 0, 10)).unwrap();
    let mean = means[6 * middle + 2];
    let expected = at(1.65, 1.65);
    // Its deviation is below 0.2 of it, and E varies by less than 1 % within the cell.
    let error = normal_limit(1) * 0.2 / f64::from(mean[3]).sqrt() + 0.01;
    assert!(
        (f64::from(mean[0]) / expected - 1.0).abs() < error,
        "mean irradiance in the middle of the floor is {}, expected {expected} within {error:.4} of it",
        mean[0]
    );
}

/// Hits beside the grid and in cells that nobody marked are counted and change nothing.
#[test]
fn hits_without_a_voxel_are_counted() {
    let cells: Vec<_> =
        (0..16 * 32).map(|k| UVec3::new(k % 16, 4, k / 16)).filter(|c| c.z % 2 == 0).collect();
    // x from −4 to 0 only, and of the rows every other one.
    let (grid, structure) =
        sparse_grid(Vec3::new(-4.0, -1.0, -4.0), 0.25, UVec3::new(16, 8, 32), 6, &cells);
    let down = Light::Directional { direction: Vec3::NEG_Y, irradiance: COLOR };
    let scene = Scene { lights: vec![down], ..plane_scene() };
    let all = plane_grid(6);
    let everywhere = Rig::new(&scene, all.0, &all.1, WriteStrategy::Exact);
    let total: f32 = everywhere.run(&[light_rays(0, 100.0)]).0.iter().map(|m| m[3]).sum();
    let mut first = None;
    for strategy in WriteStrategy::ALL {
        let rig = Rig::new(&scene, grid, &structure, strategy);
        let (means, rejected) = rig.run(&[light_rays(0, 100.0)]);
        assert_eq!(
            (rejected.not_finite, rejected.clamped),
            (0, 0),
            "{strategy:?}: samples that are not finite or clamped: {rejected:?}"
        );
        assert_eq!(
            *first.get_or_insert(rejected.outside),
            rejected.outside,
            "{strategy:?}: samples without a voxel (right), expected those of the first strategy (left)"
        );
        let lit: Vec<_> = means.iter().filter(|m| m[3] > 0.0).collect();
        assert_eq!(
            lit.len(),
            cells.len(),
            "{strategy:?}: records with samples, expected one a cell"
        );
        if strategy == WriteStrategy::Exact {
            let inside: f32 = lit.iter().map(|m| m[3]).sum();
            assert_eq!(
                inside + rejected.outside as f32,
                total,
                "{strategy:?}: samples with and without a voxel, expected those of the whole plane"
            );
            // A quarter of the plane.
            assert!(
                (inside / total - 0.25).abs() < 0.01,
                "{strategy:?}: {inside} of {total} samples have a voxel, expected 0.25 of them within 0.01"
            );
        }
    }
}

#[test]
fn what_cannot_be_is_refused() {
    let (grid, structure) = plane_grid(1);
    let rig = Rig::new(&point_scene(), grid, &structure, WriteStrategy::Exact);
    let gpu = gpu();
    let record = |injections: &[Injection]| {
        submit(|recorder| rig.injector.record(recorder, &rig.scene, &rig.volume, injections))
    };
    let good = light_rays(0, 1.0);
    let recorded = record(&[light_rays(1, 1.0)]);
    assert!(
        matches!(recorded, Err(InjectError::NoSuchLight { .. })),
        "rays of light 1 of 1 give {recorded:?}, expected NoSuchLight"
    );
    let recorded = record(&[light_rays(0, f32::NAN)]);
    assert!(
        matches!(recorded, Err(InjectError::LargestValue(_))),
        "a largest irradiance of NaN gives {recorded:?}, expected LargestValue"
    );
    let many = Injection { n_rays: 65_536, ..good };
    let recorded = record(&[many]);
    assert!(
        matches!(recorded, Err(InjectError::TooManySamples { .. })),
        "65 536² rays give {recorded:?}, expected TooManySamples"
    );
    let huge = VoxelGrid { capacity: 1 << 26, n_faces: 6, ..grid };
    let buffer = storage(bytemuck::cast_slice(&structure));
    let error = VoxelIrradiance::new(gpu, huge, &buffer, WriteStrategy::Exact).unwrap_err();
    assert!(
        matches!(error, InjectError::Gpu(GpuError::TooLarge { .. })),
        "a grid of 2²⁶ records: the error is `{error}`, expected TooLarge"
    );
    let wrong = VoxelGrid { bricks: grid.size, ..grid };
    let error = VoxelIrradiance::new(gpu, wrong, &buffer, WriteStrategy::Exact).unwrap_err();
    assert!(
        matches!(error, InjectError::Grid(_)),
        "a grid of wrong bricks: the error is `{error}`, expected Grid"
    );
}

/// The brick's size stands on both sides, for vectors are not generated.
#[test]
fn the_hosts_bricks_are_the_kernels() {
    let inputs: Vec<u32> = (0..64).collect();
    let cells: Vec<u32> = map(
        "#import lucerna::components::voxels::bricks::BRICK
        alias Input = u32;
        alias Output = u32;
        fn map(input: Input) -> Output { return BRICK.x | (BRICK.y << 8u) | (BRICK.z << 16u); }",
        &inputs,
    );
    let (grid, _) = sparse_grid(Vec3::ZERO, 1.0, UVec3::new(255, 255, 255), 1, &[]);
    let brick = UVec3::new(cells[0] & 255, cells[0] >> 8 & 255, cells[0] >> 16);
    assert_eq!(
        grid.bricks,
        (grid.size + brick - 1) / brick,
        "bricks of a grid of 255³ cells, expected by the shader's brick {brick}"
    );
    assert_eq!(brick.element_product(), 32, "cells of the brick {brick}");
}
