// SPDX-License-Identifier: MIT OR Apache-2.0
//! The passes of a bake: what probes see, which probes see which receivers, and transport, cluster by cluster.

use super::bake::{BLOCK, BakedCluster};
use super::compress::{Factors, factorise};
use super::plan::{Receiver, SparsePlan, SparseSurfaces};
use super::settings::{Sight, SparseSettings};
use crate::bindings::kernels::sparse_probes::look::{self, LookInfo};
use crate::bindings::kernels::sparse_probes::sight::{self, SightInfo};
use crate::bindings::kernels::sparse_probes::sky_mask::{self, SkyMaskInfo};
use crate::bindings::kernels::sparse_probes::transport::{self, TransportInfo};
use crate::bindings::lucerna::components::sparse_probes::sky_mask::SKY_MASK_WORDS;
use crate::bindings::lucerna::fields::lightmap::{Lightmap, NO_RECEIVER};
use crate::gpu::{Bindings, ComputeKernel, Dispatch, Gpu, GpuError, Recorder, storage_buffer};
use crate::seam::SceneSeam;
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

/// For each triangle of the meshes, which one of the seam it is.
pub(crate) fn inverse(order: &[u32], n_triangles: usize) -> Vec<u32> {
    let mut out = vec![0; n_triangles];
    (0u32..).zip(order).for_each(|(ix, of)| out[*of as usize] = ix);
    out
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

    /// Records what `n_probes` see in `n_directions`; `seen`: one word each.
    pub fn record(
        &self,
        recorder: &mut Recorder,
        scene: &dyn SceneSeam,
        field: &LightmapField,
        (places, seen): (&wgpu::Buffer, &wgpu::Buffer),
        [n_probes, n_directions]: [u32; 2],
    ) {
        let info = LookInfo { n_probes, n_directions, reserved_a: 0, reserved_b: 0 };
        self.0
            .call(&mut recorder.compute(self.0.name()))
            .scene(scene.group())
            .uniform("info", &info)
            .bind("places", places)
            .bind("seen", seen)
            .with(field.bindings())
            .dispatch(Dispatch::Items((n_probes * n_directions).next_multiple_of(look::WORKGROUP)));
    }
}

/// Words of one dispatch of `sparse_probes/sight`: each is up to 32 rays.
const SIGHT_STEP: u32 = 1 << 15;
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
        let stride = probes.len() as u32 * n_coefficients + 2;
        let (mut points, mut nears): (Vec<[u32; 4]>, Vec<[u32; 4]>) = Default::default();
        let mut records: Vec<[u32; 4]> = Vec::new();
        for (ix, near) in range.clone().zip(&near) {
            let receiver = &plan.receivers[ix];
            let own = surfaces.points_within(receiver, plan.reach[ix]);
            records.push([points.len() as u32, own.len() as u32, receiver.side, ix as u32]);
            records.push([nears.len() as u32 / 2, near.len() as u32, 0, 0]);
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
            probes,
            first_point,
            first_near,
            job,
            sums,
        })
    }

    /// Records the next samples of a batch: `n_rounds` of 64, after `first_sample`.
    pub fn record(
        &self,
        recorder: &mut Recorder,
        scene: &dyn SceneSeam,
        batch: &Batch,
        first_sample: u32,
        n_rounds: u32,
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
    let row = 4 * (u64::from(settings.n_coefficients()) * n_probes as u64 + 2);
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
        let n_columns = stride - 2;
        let mut out = Transport {
            cluster: self.cluster,
            probes: self.probes.clone(),
            n_receivers: self.n_receivers,
            numbers: Vec::with_capacity(n_columns * self.n_receivers as usize),
            n_samples: 0,
            n_valid: 0,
            n_hidden: 0,
            blind: Vec::new(),
        };
        for (ix, row) in sums.chunks_exact(stride).take(self.n_receivers as usize).enumerate() {
            let (numbers, counts) = row.split_at(n_columns);
            let [n_valid, n_whole] = [counts[0] as u32, counts[1] as u32];
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
            if n_valid < n_whole.div_ceil(FEW) {
                out.blind.push(ix as u32);
            }
            let scale = if n_valid < n_whole.div_ceil(FEW) {
                0.0
            } else {
                std::f32::consts::PI / n_valid as f32
            };
            out.numbers.extend(numbers.iter().map(|number| number * scale));
        }
        out.fill_blind(plan);
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
    /// Rows.
    pub n_receivers: u32,
    /// α of each receiver, row by row: coefficient by coefficient of each probe \[sr\].
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
        self.numbers.len().checked_div(self.n_receivers as usize).unwrap_or(0)
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
            let row = &mut self.numbers[*blind as usize * n..][..n];
            for ix in &beside {
                let share = 1.0 / beside.len() as f32;
                row.iter_mut().zip(&before[ix * n..]).for_each(|(x, y)| *x += share * y);
            }
        }
    }

    /// Factorises it, and stores the factors as halfs.
    ///
    /// # Errors
    /// The decomposition does not converge.
    pub fn compressed(&self, settings: &SparseSettings) -> Result<BakedCluster, String> {
        let n_rows = self.n_receivers as usize;
        let most = settings.n_vectors as usize;
        let n_columns = self.n_columns();
        let n_coefficients = settings.n_coefficients() as usize;
        let weight = |column: usize| expected(column % n_coefficients);
        let mut weighted: Vec<f32> = self
            .numbers
            .iter()
            .enumerate()
            .map(|(ix, number)| number * weight(ix % n_columns))
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
        Ok(BakedCluster {
            ix: self.cluster as u32,
            n_receivers: self.n_receivers,
            n_vectors: factors.n_vectors as u32,
            energy: factors.energy as f32,
            n_samples: self.n_samples,
            n_valid: self.n_valid,
            n_hidden: self.n_hidden,
            probes: self.probes.clone(),
            projection: packed_rows(&factors, n_columns),
            reconstruction: packed_blocks(&factors, n_rows),
        })
    }
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

fn packed_rows(factors: &Factors, n_columns: usize) -> Vec<u32> {
    let pack = |two: &[f32]| two_halfs(two[0], two.get(1).copied().unwrap_or(0.0));
    let rows = factors.projection.chunks_exact(n_columns.max(1));
    rows.flat_map(|row| row.chunks(2).map(pack)).collect()
}

fn packed_blocks(factors: &Factors, n_rows: usize) -> Vec<u32> {
    let at = |row: usize, k: usize| {
        let is_there = row < n_rows && k < factors.n_vectors;
        if is_there { factors.reconstruction[k * n_rows + row] } else { 0.0 }
    };
    let mut out = Vec::new();
    for block in 0..n_rows.div_ceil(BLOCK) {
        for two in 0..factors.n_vectors.div_ceil(2) {
            let row = |lane: usize| block * BLOCK + lane;
            out.extend(
                (0..BLOCK)
                    .map(|lane| two_halfs(at(row(lane), 2 * two), at(row(lane), 2 * two + 1))),
            );
        }
    }
    out
}
