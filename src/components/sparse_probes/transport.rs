// SPDX-License-Identifier: MIT OR Apache-2.0
//! The passes of a bake: what probes see, which probes see which receivers, and transport, cluster by cluster.

use super::bake::{BLOCK, BakedCluster};
use super::compress::{Factors, factorise};
use super::plan::{Receiver, SparsePlan, SparseSurfaces};
use super::settings::{Numbers, Sight, SparseSettings};
use crate::bindings::kernels::sparse_probes::distances;
use crate::bindings::kernels::sparse_probes::look::{self, LookInfo};
use crate::bindings::kernels::sparse_probes::sight::{self, SightInfo};
use crate::bindings::kernels::sparse_probes::sky_mask::{self, SkyMaskInfo};
use crate::bindings::kernels::sparse_probes::transport::{self, TransportInfo};
use crate::bindings::lucerna::components::sparse_probes::sky_mask::SKY_MASK_WORDS;
use crate::bindings::lucerna::fields::lightmap::{Lightmap, NO_RECEIVER};
use crate::bindings::lucerna::fields::sparse_probes::SparseInfo;
use crate::gpu::{Bindings, ComputeKernel, Dispatch, Gpu, GpuError, Recorder, storage_buffer};
use crate::seam::{NO_MESH, SceneSeam};
use glam::{UVec2, Vec2, Vec3};
use half::f16;

pub(super) const ADVICE: &str = "use fewer texels or probes";

/// The field `lightmap`: places of triangles, and receivers of texels.
#[derive(Debug)]
pub struct LightmapField {
    uniform: wgpu::Buffer,
    words: wgpu::Buffer,
}

impl LightmapField {
    /// `corners`: of each triangle of the meshes; `order`: for each triangle of the seam, which one of these it is.
    ///
    /// # Errors
    /// It is larger than the device can bind.
    pub fn new(
        gpu: &Gpu,
        size: UVec2,
        corners: &[[Vec2; 3]],
        order: &[u32],
        (receivers, reach): (&[Receiver], &[u32]),
    ) -> Result<Self, GpuError> {
        let mut words: Vec<u32> = Vec::with_capacity(6 * order.len());
        for of in order {
            let places = corners.get(*of as usize).copied().unwrap_or_default();
            words.extend(places.iter().flat_map(|at| at.to_array().map(f32::to_bits)));
        }
        let texels = (size.x * size.y) as usize;
        let first = words.len();
        words.resize(first + 2 * texels, NO_RECEIVER);
        for (ix, receiver) in receivers.iter().enumerate() {
            let (x, y) = (receiver.texel & 0xffff, receiver.texel >> 16);
            let at = receiver.side as usize * texels + (y * size.x + x) as usize;
            words[first + at] = ix as u32;
        }
        // (Of texels without a receiver, nothing is asked.)
        let first_reach = words.len();
        words.resize(first_reach + 2 * texels, 0);
        for (receiver, reach) in receivers.iter().zip(reach) {
            let (x, y) = (receiver.texel & 0xffff, receiver.texel >> 16);
            let at = receiver.side as usize * texels + (y * size.x + x) as usize;
            words[first_reach + at] = *reach;
        }
        let copied = wgpu::BufferUsages::COPY_DST;
        let bytes = 4 * words.len() as u64;
        let buffer = storage_buffer(gpu, "places in the lightmap", bytes, copied, ADVICE)?;
        gpu.queue.write_buffer(&buffer, 0, bytemuck::cast_slice(&words));
        let uniform = gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("lightmap"),
            size: size_of::<Lightmap>() as u64,
            usage: wgpu::BufferUsages::UNIFORM | copied,
            mapped_at_creation: false,
        });
        let info =
            Lightmap { size, n_triangles: order.len() as u32, n_receivers: receivers.len() as u32 };
        gpu.queue.write_buffer(&uniform, 0, bytemuck::bytes_of(&info));
        Ok(Self { uniform, words: buffer })
    }

    /// The field's bindings.
    pub fn bindings(&self) -> Bindings<'_> {
        vec![("lightmap", (&self.uniform).into()), ("lightmap_words", (&self.words).into())]
    }

    /// Bytes on the GPU.
    pub fn bytes(&self) -> u64 {
        self.words.size()
    }
}

/// For each triangle of the meshes, which one of the seam it is. Those of the seam that no mesh has, because they move, are not asked for.
pub(crate) fn inverse(order: &[u32], n_triangles: usize) -> Vec<u32> {
    let mut out = vec![0; n_triangles];
    for (ix, of) in (0u32..).zip(order) {
        if let Some(place) = out.get_mut(*of as usize) {
            *place = ix;
        }
    }
    out
}

/// Whether `order` has each triangle of the meshes once; what it has besides moves.
pub(super) fn is_order_of(order: &[u32], n_triangles: usize) -> bool {
    let mut known = vec![false; n_triangles];
    let mut n = 0;
    for of in order.iter().filter(|of| **of != NO_MESH) {
        match known.get_mut(*of as usize) {
            Some(known) if !*known => *known = true,
            _ => return false,
        }
        n += 1;
    }
    n == n_triangles
}

/// The field `sparse_probes`: probes that are read directly.
#[derive(Debug)]
pub(super) struct ProbeField {
    uniform: wgpu::Buffer,
    /// Places, and maps of distances, which are made on the GPU.
    pub places: wgpu::Buffer,
}

impl ProbeField {
    pub fn new(gpu: &Gpu, plan: &SparsePlan) -> Result<Self, GpuError> {
        let n_probes = plan.probes.len();
        let radius = if plan.radius > 0.0 { plan.radius } else { 1.0 };
        let places = places_of(&plan.probes);
        let bytes = 16 * (n_probes.max(1) as u64) * (1 + u64::from(distances::WORKGROUP) / 2);
        let copied = wgpu::BufferUsages::COPY_DST;
        let buffer = storage_buffer(gpu, "distances of probes", bytes, copied, ADVICE)?;
        gpu.queue.write_buffer(&buffer, 0, bytemuck::cast_slice(&places));
        let uniform = gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("sparse probes"),
            size: size_of::<SparseInfo>() as u64,
            usage: wgpu::BufferUsages::UNIFORM | copied,
            mapped_at_creation: false,
        });
        let info = SparseInfo {
            n_probes: n_probes as u32,
            last_band: plan.settings.order,
            radius,
            reserved_a: 0,
        };
        gpu.queue.write_buffer(&uniform, 0, bytemuck::bytes_of(&info));
        Ok(Self { uniform, places: buffer })
    }

    /// The field's bindings.
    pub fn bindings<'a>(&'a self, lambda: &'a wgpu::Buffer) -> Bindings<'a> {
        vec![
            ("sparse_info", (&self.uniform).into()),
            ("sparse_lambda", lambda.into()),
            ("sparse_places", (&self.places).into()),
        ]
    }
}

/// Receivers as kernels see them: with the seam's triangles.
pub(crate) fn seam_receivers(receivers: &[Receiver], inverse: &[u32]) -> Vec<Receiver> {
    let of = |receiver: &Receiver| Receiver {
        triangle: inverse[receiver.triangle as usize],
        ..*receiver
    };
    receivers.iter().map(of).collect()
}

/// A buffer of these bytes.
pub(super) fn uploaded<T: bytemuck::NoUninit>(
    gpu: &Gpu,
    what: &'static str,
    contents: &[T],
) -> Result<wgpu::Buffer, GpuError> {
    let bytes: &[u8] = bytemuck::cast_slice(contents);
    let copied = wgpu::BufferUsages::COPY_DST;
    let buffer = storage_buffer(gpu, what, (bytes.len() as u64).max(16), copied, ADVICE)?;
    gpu.queue.write_buffer(&buffer, 0, bytes);
    Ok(buffer)
}

pub(crate) fn places_of(probes: &[Vec3]) -> Vec<[f32; 4]> {
    probes.iter().map(|at| [at.x, at.y, at.z, 0.0]).collect()
}

/// The kernel `sparse_probes/look`.
#[derive(Debug)]
pub(crate) struct LookPass(ComputeKernel);

impl LookPass {
    pub fn new(gpu: &Gpu, scene: &dyn SceneSeam) -> Self {
        let name = "sparse_probes/look";
        Self(ComputeKernel::new(gpu, scene.shaders(), Some(scene.group()), name))
    }

    /// Records what `n_probes` see in `n_directions`. `buffers`: where the probes are; of each direction, what is seen; and the points that stand for
    /// receivers, so far off their surfaces \[m\].
    pub fn record(
        &self,
        recorder: &mut Recorder,
        scene: &dyn SceneSeam,
        field: &LightmapField,
        [places, seen, anchors]: [&wgpu::Buffer; 3],
        [n_probes, n_directions]: [u32; 2],
        lift: f32,
    ) {
        let info = LookInfo { n_probes, n_directions, lift, reserved_a: 0 };
        self.0
            .call(&mut recorder.compute(self.0.name()))
            .scene(scene.group())
            .uniform("info", &info)
            .bind("places", places)
            .bind("seen", seen)
            .bind("anchors", anchors)
            .with(field.bindings())
            .dispatch(Dispatch::Items((n_probes * n_directions).next_multiple_of(look::WORKGROUP)));
    }
}

/// Words of one dispatch of `sparse_probes/sight`: each is up to 32 rays.
const SIGHT_STEP: u32 = 1 << 15;
/// How much receivers beside another cluster count in the decomposition: where errors show as an edge, they are no larger than elsewhere.
const BORDER_WEIGHT: f32 = 2.5;
/// How much those count at least of whose samples less than half are seen by a probe: they are told by few samples, and most are inside of something.
const LEAST_WEIGHT: f32 = 0.05;
/// Rounds of 64 samples in one dispatch, and iterations of an invocation's loops, at most.
const MOST_ROUNDS: u32 = 4;
const MOST_LOOPS: u32 = 40_000;
/// If fewer than one of so many samples are seen by a probe, they say nothing about the rest.
const FEW: u32 = 64;
/// The most bytes of the coefficients of a batch.
const BATCH_BYTES: u64 = 64 << 20;

/// The passes of a bake, with what they need of a plan on the GPU.
#[derive(Debug)]
pub(crate) struct TransportPasses {
    settings: SparseSettings,
    sight_kernel: ComputeKernel,
    mask_kernel: ComputeKernel,
    transport_kernel: ComputeKernel,
    field: LightmapField,
    receivers: wgpu::Buffer,
    places: wgpu::Buffer,
    sight: wgpu::Buffer,
    inverse: Vec<u32>,
    borders: Vec<bool>,
    n_probes: u32,
    n_words: u32,
    n_words_each: u32,
}

/// A cluster whose transport is being computed.
#[derive(Debug)]
pub(crate) struct Batch {
    pub cluster: usize,
    n_receivers: u32,
    stride: u32,
    /// The most probes that count for one of its receivers.
    most_near: u32,
    /// How much each receiver counts in the decomposition.
    weights: Vec<f32>,
    probes: Vec<u32>,
    first_point: u32,
    first_near: u32,
    job: wgpu::Buffer,
    pub sums: wgpu::Buffer,
}

impl TransportPasses {
    pub fn new(
        gpu: &Gpu,
        scene: &dyn SceneSeam,
        plan: &SparsePlan,
        order: &[u32],
    ) -> Result<Self, GpuError> {
        let kernel = |name| ComputeKernel::new(gpu, scene.shaders(), Some(scene.group()), name);
        let n_probes = plan.probes.len() as u32;
        let n_words_each = n_probes.div_ceil(32).max(1);
        let n_words = n_words_each * plan.receivers.len() as u32;
        let bytes = 4 * u64::from(n_words + n_probes * SKY_MASK_WORDS);
        let none = wgpu::BufferUsages::empty();
        let inverse = inverse(order, plan.corners.len());
        Ok(Self {
            settings: plan.settings,
            sight_kernel: kernel("sparse_probes/sight"),
            mask_kernel: kernel("sparse_probes/sky_mask"),
            transport_kernel: kernel("sparse_probes/transport"),
            field: LightmapField::new(
                gpu,
                plan.size,
                &plan.corners,
                order,
                (&plan.receivers, &plan.reach),
            )?,
            receivers: uploaded(gpu, "receivers", &seam_receivers(&plan.receivers, &inverse))?,
            places: uploaded(gpu, "places of probes", &places_of(&plan.probes))?,
            sight: storage_buffer(gpu, "which probes see receivers", bytes.max(16), none, ADVICE)?,
            inverse,
            borders: plan.borders(),
            n_probes,
            n_words,
            n_words_each,
        })
    }

    /// Steps of [`Self::record_sight`].
    pub fn n_sight_steps(&self) -> u32 {
        match self.settings.sight {
            Sight::Bits => self.n_words.div_ceil(SIGHT_STEP) + 1,
            Sight::Rays => 0,
        }
    }

    /// Records a step of finding which probes see which receivers.
    pub fn record_sight(&self, recorder: &mut Recorder, scene: &dyn SceneSeam, step: u32) {
        if step == self.n_sight_steps() - 1 {
            let info = SkyMaskInfo {
                n_probes: self.n_probes,
                first: self.n_words,
                reserved_a: 0,
                reserved_b: 0,
            };
            let items = (self.n_probes * SKY_MASK_WORDS).next_multiple_of(sky_mask::WORKGROUP);
            self.mask_kernel
                .call(&mut recorder.compute(self.mask_kernel.name()))
                .scene(scene.group())
                .uniform("info", &info)
                .bind("places", &self.places)
                .bind("sight", &self.sight)
                .dispatch(Dispatch::Items(items));
            return;
        }
        let first = step * SIGHT_STEP;
        let info = SightInfo {
            first,
            n_words: self.n_words,
            n_probes: self.n_probes,
            n_words_each: self.n_words_each,
        };
        let items = SIGHT_STEP.min(self.n_words - first).next_multiple_of(sight::WORKGROUP);
        self.sight_kernel
            .call(&mut recorder.compute(self.sight_kernel.name()))
            .scene(scene.group())
            .uniform("info", &info)
            .bind("receivers", &self.receivers)
            .bind("places", &self.places)
            .bind("sight", &self.sight)
            .dispatch(Dispatch::Items(items));
    }

    /// Prepares a cluster.
    pub fn batch(
        &self,
        gpu: &Gpu,
        plan: &SparsePlan,
        surfaces: &SparseSurfaces,
        cluster: usize,
    ) -> Result<Batch, GpuError> {
        let n_coefficients = self.settings.n_coefficients();
        let range = plan.receivers_of(cluster);
        let near: Vec<Vec<(u32, f32)>> = range
            .clone()
            .map(|ix| plan.near(surfaces.position(&plan.receivers[ix]), plan.radii[ix]))
            .collect();
        let mut probes: Vec<u32> = near.iter().flatten().map(|(probe, _)| *probe).collect();
        probes.sort_unstable();
        probes.dedup();
        let slot = |probe: u32| probes.binary_search(&probe).unwrap_or(0) as u32;
        let n_radiance = self.settings.n_radiance();
        let n_columns = probes.len() as u32 * n_coefficients;
        let stride = n_columns * (1 + n_radiance) + transport::TAIL + n_radiance;
        let (mut points, mut nears): (Vec<[u32; 4]>, Vec<[u32; 4]>) = Default::default();
        let mut records: Vec<[u32; 4]> = Vec::new();
        for (ix, near) in range.clone().zip(&near) {
            let receiver = &plan.receivers[ix];
            let own = surfaces.points_within(receiver, plan.reach[ix]);
            records.push([points.len() as u32, own.len() as u32, receiver.side, ix as u32]);
            let radius = plan.radii[ix].to_bits();
            records.push([nears.len() as u32 / 2, near.len() as u32, radius, 0]);
            points.extend(
                own.iter().map(|of| [self.inverse[of.triangle as usize], of.weights, 0, 0]),
            );
            for (probe, weight) in near {
                let at = plan.probes[*probe as usize].to_array().map(f32::to_bits);
                nears.push([at[0], at[1], at[2], weight.to_bits()]);
                nears.push([*probe, slot(*probe) * n_coefficients, 0, 0]);
            }
        }
        let first_point = records.len() as u32;
        let first_near = first_point + points.len() as u32;
        let job = uploaded(gpu, "receivers of a cluster", &[records, points, nears].concat())?;
        let bytes = 4 * u64::from(stride) * range.len() as u64;
        let copied = wgpu::BufferUsages::COPY_DST;
        let sums = storage_buffer(gpu, "transport of a cluster", bytes, copied, ADVICE)?;
        Ok(Batch {
            cluster,
            n_receivers: range.len() as u32,
            stride,
            weights: self.borders[range.clone()]
                .iter()
                .map(|is_border| if *is_border { BORDER_WEIGHT } else { 1.0 })
                .collect(),
            most_near: near.iter().map(Vec::len).max().unwrap_or(0) as u32,
            probes,
            first_point,
            first_near,
            job,
            sums,
        })
    }

    /// Rounds of 64 samples in one dispatch, and outputs: so many that an invocation's loops run less than 65 535 times, where llvmpipe (Mesa 22)
    /// ends them. The loops are those over the samples, coefficients and outputs of a probe, and those of the samples' rays.
    pub fn rounds_and_outputs(&self, batch: &Batch) -> (u32, u32) {
        let all = 1 + self.settings.n_radiance();
        let n_outputs = (1..=all).rev().find(|n| self.loops_of(batch, *n) < MOST_LOOPS);
        let n_outputs = n_outputs.unwrap_or(1);
        // (With rays to each probe, nobody knows how many loops these take.)
        let most = if self.settings.sight == Sight::Rays { 1 } else { MOST_ROUNDS };
        ((MOST_LOOPS / self.loops_of(batch, n_outputs)).clamp(1, most), n_outputs)
    }

    fn loops_of(&self, batch: &Batch, n_outputs: u32) -> u32 {
        let items = (batch.most_near * n_outputs).div_ceil(transport::WORKGROUP).max(1);
        items * transport::WORKGROUP * (1 + self.settings.n_coefficients()) + 2000
    }

    /// Records the next samples of a batch for some of its outputs: `n_rounds` of 64, after `first_sample`.
    pub fn record(
        &self,
        recorder: &mut Recorder,
        scene: &dyn SceneSeam,
        batch: &Batch,
        (first_sample, n_rounds): (u32, u32),
        (first_output, n_outputs): (u32, u32),
    ) {
        let info = TransportInfo {
            n_receivers: batch.n_receivers,
            first_sample,
            n_rounds,
            seed: self.settings.seed,
            last_band: self.settings.order,
            stride: batch.stride,
            sight: match self.settings.sight {
                Sight::Bits => transport::SIGHT_BY_BITS,
                Sight::Rays => transport::SIGHT_BY_RAYS,
            },
            n_words_each: self.n_words_each,
            first_mask: self.n_words,
            first_point: batch.first_point,
            first_near: batch.first_near,
            zero: 0,
            n_radiance: self.settings.n_radiance(),
            first_output,
            n_outputs,
            reserved_a: 0,
        };
        self.transport_kernel
            .call(&mut recorder.compute(self.transport_kernel.name()))
            .scene(scene.group())
            .uniform("info", &info)
            .bind("job", &batch.job)
            .bind("sight", &self.sight)
            .bind("sums", &batch.sums)
            .with(self.field.bindings())
            .dispatch(Dispatch::Rows(batch.n_receivers));
    }
}

/// The most receivers of a cluster, so that their coefficients fit into a batch's memory.
pub(crate) fn most_of_cluster(settings: &SparseSettings, n_probes: usize) -> usize {
    let columns = u64::from(settings.n_coefficients()) * n_probes as u64;
    let row = 4 * u64::from(1 + settings.n_radiance()) * (columns + 4);
    (BATCH_BYTES / row).clamp(1, settings.cluster_size.into()) as usize
}

impl Batch {
    /// The transport matrix, row by row, of sums that were read back; and samples: taken, and seen by a probe; and receivers of which none is.
    ///
    /// # Errors
    /// The driver has cut samples.
    pub fn matrix(
        &self,
        plan: &SparsePlan,
        sums: &[f32],
        n_expected: u32,
    ) -> Result<Transport, String> {
        let stride = self.stride as usize;
        let n_radiance = plan.settings.n_radiance() as usize;
        let tail = stride - transport::TAIL as usize - n_radiance;
        let n_columns = tail / (1 + n_radiance);
        let n_outputs = plan.settings.n_outputs() as usize;
        let n_receivers = self.n_receivers as usize;
        let mut out = Transport {
            cluster: self.cluster,
            probes: self.probes.clone(),
            n_receivers: self.n_receivers,
            n_outputs: n_outputs as u32,
            weights: self.weights.clone(),
            numbers: vec![0.0; n_columns * n_receivers * n_outputs],
            n_samples: 0,
            n_valid: 0,
            n_hidden: 0,
            blind: Vec::new(),
        };
        for (ix, row) in sums.chunks_exact(stride).take(n_receivers).enumerate() {
            let (numbers, counts) = row.split_at(tail);
            let [n_valid, n_whole] = [counts[1] as u32, counts[2] as u32];
            if n_whole != n_expected {
                return Err(format!(
                    "the driver has cut {} of {n_expected} samples of a receiver short: its loops do not run as they should",
                    n_expected - n_whole
                ));
            }
            // (Places that are inside of something see next to nothing that a probe sees, and what they see is not told for all.)
            if 2 * n_valid >= n_whole {
                out.n_samples += u64::from(n_whole);
                out.n_valid += u64::from(n_valid);
            } else {
                out.n_hidden += 1;
            }
            if n_valid < n_whole.div_ceil(FEW) || counts[0] <= 0.0 {
                out.blind.push(ix as u32);
                continue;
            }
            out.weights[ix] *= (2.0 * n_valid as f32 / n_whole as f32).clamp(LEAST_WEIGHT, 1.0);
            let scale = std::f32::consts::PI / counts[0];
            let mut put = |output: usize, numbers: &[f32], factor: f32| {
                let first = (output * n_receivers + ix) * n_columns;
                let to = &mut out.numbers[first..first + n_columns];
                to.iter_mut().zip(numbers).for_each(|(to, number)| *to += factor * number);
            };
            let (irradiance, radiance) = numbers.split_at(n_columns);
            put(0, irradiance, scale);
            if n_radiance == 0 {
                continue;
            }
            // What the coefficients lack of the irradiance: D = I − Σ A_l Y_k(N) R_k, with the mean of Y_k over the texel's normals.
            put(1, irradiance, scale);
            for (k, numbers) in radiance.chunks_exact(n_columns.max(1)).enumerate() {
                let y = counts[transport::TAIL as usize + k] / n_whole as f32;
                put(1, numbers, -scale * cosine_factor(k) * y);
                put(2 + k, numbers, scale);
            }
        }
        out.fill_blind(plan);
        out.drop_unseen(plan.settings.n_coefficients() as usize);
        Ok(out)
    }
}

/// Transport of the receivers of a cluster.
#[derive(Clone, Debug, PartialEq)]
pub struct Transport {
    /// Its number in the plan.
    pub cluster: usize,
    /// The probes that count in it.
    pub probes: Vec<u32>,
    /// Receivers.
    pub n_receivers: u32,
    /// Numbers that each receiver gets: the matrix has as many rows for each, output after output.
    pub n_outputs: u32,
    /// How much each receiver counts in the decomposition.
    pub weights: Vec<f32>,
    /// α of each output of each receiver, row by row: coefficient by coefficient of each probe \[sr\].
    pub numbers: Vec<f32>,
    /// Samples of receivers at least half of whose samples a probe sees.
    pub n_samples: u64,
    /// Those of them that a probe sees.
    pub n_valid: u64,
    /// The other receivers.
    pub n_hidden: u32,
    /// Those of which next to no sample is seen, and which get the mean of their neighbours.
    pub blind: Vec<u32>,
}

impl Transport {
    /// Columns of the matrix.
    pub fn n_columns(&self) -> usize {
        let n_rows = self.n_receivers as usize * self.n_outputs as usize;
        self.numbers.len().checked_div(n_rows).unwrap_or(0)
    }

    /// Leaves out the probes of which no receiver sees what they see: they are near, but behind a wall.
    fn drop_unseen(&mut self, n_coefficients: usize) {
        let n_columns = self.n_columns().max(1);
        let mut is_seen = vec![false; self.probes.len()];
        for row in self.numbers.chunks_exact(n_columns) {
            for (is_seen, own) in is_seen.iter_mut().zip(row.chunks_exact(n_coefficients)) {
                *is_seen |= own.iter().any(|number| *number != 0.0);
            }
        }
        let kept: Vec<usize> = (0..is_seen.len()).filter(|ix| is_seen[*ix]).collect();
        if kept.len() == self.probes.len() {
            return;
        }
        let of_row = |row: &[f32]| -> Vec<f32> {
            kept.iter()
                .flat_map(|ix| &row[ix * n_coefficients..][..n_coefficients])
                .copied()
                .collect()
        };
        self.numbers = self.numbers.chunks_exact(n_columns).flat_map(of_row).collect();
        self.probes = kept.iter().map(|ix| self.probes[*ix]).collect();
    }

    /// Receivers that see nothing that a probe sees get the mean of those beside them in the lightmap.
    fn fill_blind(&mut self, plan: &SparsePlan) {
        let n = self.n_columns();
        let receivers = &plan.receivers[plan.receivers_of(self.cluster)];
        let place =
            |of: &Receiver| (of.side, [of.texel & 0xffff, of.texel >> 16].map(|x| x as i32));
        let before = self.numbers.clone();
        for blind in &self.blind {
            let (side, at) = place(&receivers[*blind as usize]);
            let is_beside = |ix: &usize| {
                let (other, [x, y]) = place(&receivers[*ix]);
                other == side
                    && (x - at[0]).abs() <= 1
                    && (y - at[1]).abs() <= 1
                    && !self.blind.contains(&(*ix as u32))
            };
            let beside: Vec<usize> = (0..receivers.len()).filter(is_beside).collect();
            let share = 1.0 / beside.len() as f32;
            for output in 0..self.n_outputs as usize {
                let first = output * self.n_receivers as usize;
                let row = &mut self.numbers[(first + *blind as usize) * n..][..n];
                for ix in &beside {
                    let other = &before[(first + ix) * n..];
                    row.iter_mut().zip(other).for_each(|(x, y)| *x += share * y);
                }
            }
        }
    }

    /// Factorises it, and stores the factors.
    ///
    /// # Errors
    /// The decomposition does not converge.
    pub fn compressed(&self, settings: &SparseSettings) -> Result<BakedCluster, String> {
        let n_rows = self.n_receivers as usize * self.n_outputs as usize;
        let most = settings.n_vectors as usize;
        let n_columns = self.n_columns();
        let n_coefficients = settings.n_coefficients() as usize;
        let weight = |column: usize| expected(column % n_coefficients);
        let count = |row: usize| self.weights[row % self.n_receivers as usize];
        let mut weighted: Vec<f32> = self
            .numbers
            .iter()
            .enumerate()
            .map(|(ix, number)| number * weight(ix % n_columns) * count(ix / n_columns))
            .collect();
        // What constant radiance gives is kept as it is: the first vector. The others are those of the rest.
        let whole = sum_of_squares(&weighted);
        let share = 1.0 / (self.probes.len().max(1) as f64).sqrt();
        let constant: Vec<f64> = weighted
            .chunks_exact_mut(n_columns.max(1))
            .map(|row| {
                let constants = || (0..self.probes.len()).map(|probe| probe * n_coefficients);
                let along = share * constants().map(|at| f64::from(row[at])).sum::<f64>();
                constants().for_each(|at| row[at] -= (along * share) as f32);
                along
            })
            .collect();
        let length = constant.iter().map(|x| x * x).sum::<f64>().sqrt();
        let mut factors = Factors::default();
        if length > 0.0 {
            let rest = factorise(&weighted, n_rows, most - 1, settings.factorisation)?;
            let of_rest = sum_of_squares(&weighted);
            factors.n_vectors = 1 + rest.n_vectors;
            factors.energy = (length * length + rest.energy * of_rest) / whole;
            factors.reconstruction = constant.iter().map(|x| (x / length) as f32).collect();
            factors.reconstruction.extend(rest.reconstruction);
            let is_constant = |column: usize| column.is_multiple_of(n_coefficients);
            factors.projection = (0..n_columns)
                .map(|column| if is_constant(column) { (length * share) as f32 } else { 0.0 })
                .collect();
            factors.projection.extend(rest.projection);
        }
        for (ix, number) in factors.projection.iter_mut().enumerate() {
            *number /= weight(ix % n_columns);
        }
        for (ix, number) in factors.reconstruction.iter_mut().enumerate() {
            *number /= count(ix % n_rows);
        }
        let (projection, reconstruction) = match settings.numbers {
            Numbers::Halfs => {
                let pack = |two: &[f32]| two_halfs(two[0], two.get(1).copied().unwrap_or(0.0));
                let rows = factors.projection.chunks_exact(n_columns.max(1));
                let projection = rows.flat_map(|row| row.chunks(2).map(pack)).collect();
                (projection, self.packed_blocks(&factors, 2, &|of| two_halfs(of[0], of[1])))
            }
            Numbers::Bytes => {
                normalise(&mut factors, n_rows, n_columns);
                let rows = factors.projection.chunks_exact(n_columns.max(1));
                (
                    rows.flat_map(bytes_of_row).collect(),
                    self.packed_blocks(&factors, 4, &four_bytes),
                )
            }
        };
        Ok(BakedCluster {
            ix: self.cluster as u32,
            n_receivers: self.n_receivers,
            n_vectors: factors.n_vectors as u32,
            energy: factors.energy as f32,
            n_samples: self.n_samples,
            n_valid: self.n_valid,
            n_hidden: self.n_hidden,
            probes: self.probes.clone(),
            projection,
            reconstruction,
        })
    }

    /// U_c as the kernel reads it: for each output, block and `in_word` columns, a word for each of 64 receivers.
    fn packed_blocks(
        &self,
        factors: &Factors,
        in_word: usize,
        pack: &dyn Fn(&[f32]) -> u32,
    ) -> Vec<u32> {
        let n = self.n_receivers as usize;
        let n_rows = n * self.n_outputs as usize;
        let at = |output: usize, receiver: usize, k: usize| {
            let is_there = receiver < n && k < factors.n_vectors;
            let row = output * n + receiver;
            if is_there { factors.reconstruction[k * n_rows + row] } else { 0.0 }
        };
        let mut out = Vec::new();
        for (output, block) in blocks_of(n, self.n_outputs as usize) {
            for word in 0..factors.n_vectors.div_ceil(in_word) {
                out.extend((0..BLOCK).map(|lane| {
                    let of = |k| at(output, block * BLOCK + lane, in_word * word + k);
                    pack(&(0..in_word).map(of).collect::<Vec<_>>())
                }));
            }
        }
        out
    }
}

/// The blocks of a cluster: output, and the block's place among the receivers.
fn blocks_of(n_receivers: usize, n_outputs: usize) -> impl Iterator<Item = (usize, usize)> {
    let blocks = n_receivers.div_ceil(BLOCK);
    (0..n_outputs * blocks).map(move |ix| (ix / blocks, ix % blocks))
}

/// A(l) of the clamped cosine for coefficient `k` (`wgsl/sh/convolve.wgsl`).
fn cosine_factor(k: usize) -> f32 {
    use std::f32::consts::PI;
    const EXPECTED: [f32; 5] = [PI, 2.0 * PI / 3.0, PI / 4.0, 0.0, -PI / 24.0];
    EXPECTED[(k as f32 + 0.5).sqrt() as usize]
}

/// How large a probe's coefficient is expected to be, relative to the constant one: those of band l as 1/(l + 1). Radiance has less and less in
/// higher bands, so that what transport does with these may be kept less well.
fn expected(ix: usize) -> f32 {
    1.0 / ((ix as f32 + 0.5).sqrt().floor() + 1.0)
}

fn sum_of_squares(numbers: &[f32]) -> f64 {
    numbers.iter().map(|x| f64::from(*x) * f64::from(*x)).sum()
}

fn two_halfs(low: f32, high: f32) -> u32 {
    let bits = |x: f32| u32::from(f16::from_f32(x.clamp(-65504.0, 65504.0)).to_bits());
    bits(low) | bits(high) << 16
}

/// Vectors whose largest number is 1 or −1; what is taken from them is given to their rows of Σ_c Vᵀ.
fn normalise(factors: &mut Factors, n_rows: usize, n_columns: usize) {
    for k in 0..factors.n_vectors {
        let column = &mut factors.reconstruction[k * n_rows..][..n_rows];
        let largest = column.iter().fold(0.0f32, |a, b| a.max(b.abs()));
        if largest > 0.0 {
            column.iter_mut().for_each(|x| *x /= largest);
            factors.projection[k * n_columns..][..n_columns].iter_mut().for_each(|x| *x *= largest);
        }
    }
}

/// Four numbers in −1 to 1 (`pack4x8snorm`); missing ones are 0.
fn four_bytes(of: &[f32]) -> u32 {
    let byte = |x: &f32| u32::from((x.clamp(-1.0, 1.0) * 127.0).round() as i8 as u8);
    of.iter().enumerate().map(|(k, x)| byte(x) << (8 * k)).sum()
}

/// What a row is multiplied by, and its bytes.
fn bytes_of_row(row: &[f32]) -> Vec<u32> {
    let largest = row.iter().fold(0.0f32, |a, b| a.max(b.abs()));
    let share = if largest > 0.0 { 1.0 / largest } else { 0.0 };
    let words =
        row.chunks(4).map(|of| four_bytes(&of.iter().map(|x| x * share).collect::<Vec<_>>()));
    std::iter::once(largest.to_bits()).chain(words).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of three probes with four coefficients, that in the middle is seen by no receiver; then none is.
    #[test]
    fn probes_that_no_receiver_sees_are_left_out() {
        let row = |x: f32| [x, 0.0, -x, x, 0.0, 0.0, -0.0, 0.0, 0.0, 0.0, 0.0, 2.0 * x];
        let mut of = Transport {
            cluster: 0,
            probes: vec![7, 9, 11],
            n_receivers: 2,
            n_outputs: 1,
            weights: vec![1.0; 2],
            numbers: [row(1.0), row(3.0)].concat(),
            n_samples: 0,
            n_valid: 0,
            n_hidden: 0,
            blind: Vec::new(),
        };
        of.drop_unseen(4);
        assert_eq!(of.probes, [7, 11]);
        let kept = |x: f32| [x, 0.0, -x, x, 0.0, 0.0, 0.0, 2.0 * x];
        assert_eq!(of.numbers, [kept(1.0), kept(3.0)].concat());
        of.numbers.fill(0.0);
        of.drop_unseen(4);
        assert_eq!((of.probes.len(), of.numbers.len(), of.n_columns()), (0, 0, 0));
    }
}
