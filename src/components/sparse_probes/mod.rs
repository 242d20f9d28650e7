// SPDX-License-Identifier: MIT OR Apache-2.0
//! Sparse radiance probes with precomputed transport: a lightmap of indirect light that follows the lights, for surfaces that stand still.
//!
//! ```text
//! once (blocking::bake_sparse_probes):
//!   meshes ─▶ lightmap::unwrap ─▶ receivers ─▶ clusters ────────────────▶ sparse_probes/transport ─▶ SVD ─▶ SparseBake
//!   surfaces ─▶ candidates ─▶ probes ─▶ sparse_probes/look, sight, sky_mask ──────▲
//!
//! every frame (SparseProbes::update):
//!   sparse_probes/light ─▶ reflect ─▶ project ─▶ gather ─▶ receive ─▶ dilate ─▶ lightmap
//!    light on receivers    L          λ          l = ΣVᵀλ  I = U l        │
//!                          ▲ indirect light of the frame before ◀─────────┘
//! ```
//!
//! A. Silvennoinen, J. Lehtinen, "Real-time Global Illumination by Precomputed Local Reconstruction from Sparse Radiance Probes", ACM TOG 36(6),
//! 2017. What differs is in `docs/techniques/sparse-probes.md`.

mod bake;
mod compress;
mod plan;
mod settings;
mod transport;

use crate::bindings::kernels::sparse_probes::dilate::DilateInfo;
use crate::bindings::kernels::sparse_probes::directions::{self, DirectionsInfo};
use crate::bindings::kernels::sparse_probes::distances::DistancesInfo;
use crate::bindings::kernels::sparse_probes::gather::{self, ClustersInfo};
use crate::bindings::kernels::sparse_probes::light::{self, LightInfo};
use crate::bindings::kernels::sparse_probes::project::ProjectInfo;
use crate::bindings::kernels::sparse_probes::receive::ReceiveInfo;
use crate::bindings::kernels::sparse_probes::reflect::ReflectInfo;
use crate::bindings::lucerna::components::sparse_probes::cluster::Cluster;
use crate::bindings::lucerna::components::sparse_probes::lit_receiver::{LIT_POINTS, LitReceiver};
use crate::components::LightVisibility;
use crate::components::convergence::Convergence;
use crate::gpu::{
    Bindings, ComputeKernel, Dispatch, Gpu, GpuError, Recorder, Resource, Shaders, storage_buffer,
};
use crate::report::{Notice, Stat};
use crate::seam::{Mismatch, Revisions, SceneSeam, check_shaders};
use glam::{UVec3, Vec3};
use transport::{ADVICE, ProbeField, inverse, is_order_of, seam_receivers, uploaded};

pub use bake::{BLOCK, BakedCluster, SparseBake, SparseError, is_in_shard};
pub use plan::{Receiver, SparsePlan, SparseSurfaces, hash_of_places};
pub use settings::{
    EVEN_NEAR, Factorisation, LEAST_NEAR, LEAST_SEEING, Numbers, Sight, SparseSettings, Support,
};
pub use transport::{LightmapField, Transport};

pub(crate) use plan::{clustered, least_seeing, radius_at};
pub(crate) use transport::{LookPass, TransportPasses, most_of_cluster, places_of};

/// How a bake is used; can be chosen anew for each run.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct SparseLook {
    /// In each frame, one of so many probes is updated.
    pub update_every: u32,
    /// Whether reflected light is reflected again.
    pub bounces: bool,
    /// Whether the sky is part of what probes see. Then the indirect light holds the sky's own, and pixels should not ask for it themselves.
    pub sky: bool,
    /// Frames over which light with an extent is averaged, until lights change.
    pub n_light_frames: u32,
    /// Seed of the random numbers.
    pub seed: u32,
}

impl Default for SparseLook {
    fn default() -> Self {
        Self { update_every: 1, bounces: true, sky: false, n_light_frames: 64, seed: 0 }
    }
}

/// Sparse probes cannot be used.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SparseProbesError {
    /// The scene differs from the one that they were made for.
    #[error(transparent)]
    Mismatch(#[from] Mismatch),
    /// A limit of the device.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// The bake.
    #[error(transparent)]
    Bake(#[from] SparseError),
}

/// The greatest share of the scene's diagonal at which light can be expected to be brightest.
const PEAK_DISTANCE: f32 = 0.02;

/// Words that `sparse_probes/gather` and `sparse_probes/receive` may read behind their matrices.
const READ_BEYOND: usize = 3 * BLOCK;

/// If lights become so many times darker, what they reflected before is forgotten: it would outshine them for many frames.
const FORGET: f32 = 64.0;

/// Probes, receivers and a lightmap on the GPU.
#[derive(Debug)]
pub struct SparseProbes {
    look: SparseLook,
    shaders: Shaders,
    visibility: LightVisibility,
    light: ComputeKernel,
    reflect: ComputeKernel,
    project: ComputeKernel,
    gather: ComputeKernel,
    receive: ComputeKernel,
    dilate: ComputeKernel,
    /// What is computed once, until it is.
    once: Option<[ComputeKernel; 2]>,
    field: LightmapField,
    probe_field: ProbeField,
    numbers: Numbers,
    radiance: u32,
    radius: f32,
    buffers: Buffers,
    texels: wgpu::TextureView,
    counts: Counts,
    scale: f32,
    texel_width: f32,
    frame: u32,
    /// Frames of light that are part of the mean.
    n_light: u32,
    /// Revisions of the scene at the last update; None before the first one.
    seen: Option<Revisions>,
    is_outdated: bool,
    quality: Quality,
    convergence: Convergence,
    /// As [`Convergence::record`] asks for.
    n_values: [wgpu::Buffer; 1],
}

#[derive(Debug)]
struct Buffers {
    receivers: wgpu::Buffer,
    lit: wgpu::Buffer,
    irradiance: wgpu::Buffer,
    radiance: wgpu::Buffer,
    seen: wgpu::Buffer,
    basis: wgpu::Buffer,
    lambda: wgpu::Buffer,
    clusters: wgpu::Buffer,
    cluster_probes: wgpu::Buffer,
    projection: wgpu::Buffer,
    blocks: wgpu::Buffer,
    reconstruction: wgpu::Buffer,
    cluster_light: wgpu::Buffer,
}

#[derive(Clone, Copy, Debug)]
struct Counts {
    triangles: u32,
    receivers: u32,
    probes: u32,
    directions: u32,
    coefficients: u32,
    order: u32,
    clusters: u32,
    basis: u32,
    blocks: u32,
    /// What each receiver gets: see [`SparseSettings::n_outputs`].
    outputs: u32,
    size: glam::UVec2,
}

/// What the bake says of itself.
#[derive(Clone, Copy, Debug)]
struct Quality {
    n_samples: u64,
    n_valid: u64,
    n_hidden: u64,
    least_energy: f32,
    mean_energy: f64,
}

impl SparseProbes {
    /// Makes them of a bake. `order`: for each triangle of the scene, as its seam counts them, which one of the meshes of the bake it is
    /// ([`GpuScene::static_order`](crate::gpu_scene::GpuScene::static_order)); what moves was not baked, and has [`NO_MESH`](crate::seam::NO_MESH).
    /// `visibility`: how receivers find out which lights they see.
    ///
    /// # Errors
    /// The bake is not complete or does not fit the scene, or a buffer is larger than the device can bind.
    pub fn new(
        gpu: &Gpu,
        scene: &dyn SceneSeam,
        bake: &SparseBake,
        order: &[u32],
        visibility: &LightVisibility,
        look: SparseLook,
    ) -> Result<Self, SparseProbesError> {
        bake.check_complete()?;
        let plan = &bake.plan;
        let n_triangles = scene.facts().n_triangles;
        if !is_order_of(order, plan.corners.len()) || order.len() != n_triangles as usize {
            let (expected, found) = (plan.corners.len() as u32, n_triangles);
            return Err(Mismatch::Triangles { expected, found }.into());
        }
        let counts = Counts {
            triangles: n_triangles,
            receivers: plan.receivers.len() as u32,
            probes: plan.probes.len() as u32,
            directions: plan.settings.n_directions,
            coefficients: plan.settings.n_coefficients(),
            order: plan.settings.order,
            clusters: plan.n_clusters() as u32,
            basis: plan.settings.n_vectors,
            blocks: bake
                .clusters
                .iter()
                .map(|of| of.n_receivers.div_ceil(BLOCK as u32) * plan.settings.n_outputs())
                .sum(),
            outputs: plan.settings.n_outputs(),
            size: plan.size,
        };
        let inverse = inverse(order, plan.corners.len());
        let n_values = gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("number of receivers"),
            size: 16,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        gpu.queue.write_buffer(&n_values, 0, bytemuck::bytes_of(&[0, 0, counts.receivers, 0]));
        let own = scene.shaders();
        let group = Some(scene.group());
        let lit = own.with_variant(visibility.variant(own.variant()));
        let kernel = |name| ComputeKernel::new(gpu, own, group, name);
        let depth_or_array_layers = 2 * counts.outputs;
        let size =
            wgpu::Extent3d { width: plan.size.x, height: plan.size.y, depth_or_array_layers };
        let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
            label: Some("lightmap"),
            size,
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: wgpu::TextureFormat::Rgba16Float,
            usage: wgpu::TextureUsages::STORAGE_BINDING
                | wgpu::TextureUsages::TEXTURE_BINDING
                | wgpu::TextureUsages::COPY_SRC,
            view_formats: &[],
        });
        Ok(Self {
            look,
            shaders: own.clone(),
            visibility: visibility.clone(),
            light: ComputeKernel::new(gpu, &lit, group, "sparse_probes/light"),
            reflect: kernel("sparse_probes/reflect"),
            project: kernel("sparse_probes/project"),
            gather: kernel("sparse_probes/gather"),
            receive: kernel("sparse_probes/receive"),
            dilate: kernel("sparse_probes/dilate"),
            once: Some([kernel("sparse_probes/directions"), kernel("sparse_probes/distances")]),
            probe_field: ProbeField::new(gpu, plan)?,
            numbers: plan.settings.numbers,
            radiance: plan.settings.radiance,
            radius: if plan.radius > 0.0 { plan.radius } else { 1.0 },
            field: LightmapField::new(
                gpu,
                plan.size,
                &plan.corners,
                order,
                (&plan.receivers, &plan.reach),
            )?,
            buffers: Buffers::new(gpu, bake, &counts, &inverse)?,
            texels: texture.create_view(&wgpu::TextureViewDescriptor {
                dimension: Some(wgpu::TextureViewDimension::D2Array),
                ..Default::default()
            }),
            counts,
            scale: 1.0,
            texel_width: 1.0 / plan.texels_per_metre,
            frame: 0,
            n_light: 0,
            seen: None,
            is_outdated: false,
            quality: Quality::of(bake),
            convergence: Convergence::new(gpu, [counts.receivers.max(1)])?,
            n_values: [n_values],
        })
    }

    /// Records a frame: light on receivers, probes, indirect light, lightmap.
    ///
    /// # Errors
    /// The scene no longer fits.
    pub fn update(
        &mut self,
        recorder: &mut Recorder,
        scene: &dyn SceneSeam,
    ) -> Result<(), SparseProbesError> {
        check_shaders(&self.shaders, scene)?;
        let found = scene.facts().n_triangles;
        if found != self.counts.triangles {
            return Err(Mismatch::Triangles { expected: self.counts.triangles, found }.into());
        }
        let now = scene.revisions();
        if let Some(seen) = self.seen {
            self.is_outdated |= seen.geometry != now.geometry;
        }
        if self.seen != Some(now) {
            self.n_light = 0;
            self.convergence.restart(recorder);
            // (All texels are written in each frame, so that a new scale is that of all of them.)
            let facts = scene.facts();
            let scale = scale_of(facts.drawn_peak.at(PEAK_DISTANCE * facts.diagonal()));
            if self.seen.is_some() && scale > FORGET * self.scale {
                self.forget(recorder);
            }
            self.scale = scale;
        }
        self.seen = Some(now);
        self.record_once(recorder, scene);
        self.record_light(recorder, scene);
        self.record_reflected(recorder);
        self.record_projection(recorder, scene);
        self.record_transport(recorder);
        self.convergence.record(recorder, &self.buffers.irradiance, &self.n_values);
        self.frame = self.frame.wrapping_add(1);
        Ok(())
    }

    /// Forgets all reflected light.
    fn forget(&self, recorder: &mut Recorder) {
        for buffer in [&self.buffers.irradiance, &self.buffers.lambda] {
            recorder.encoder().clear_buffer(buffer, 0, None);
        }
    }

    /// The basis functions in the directions of probes, and how far these see: once.
    fn record_once(&mut self, recorder: &mut Recorder, scene: &dyn SceneSeam) {
        let Some([directions, distances]) = self.once.take() else { return };
        let info = DirectionsInfo {
            n_directions: self.counts.directions,
            last_band: self.counts.order,
            reserved_a: 0,
            reserved_b: 0,
        };
        let items = self.counts.directions.next_multiple_of(directions::WORKGROUP);
        directions
            .call(&mut recorder.compute(directions.name()))
            .uniform("info", &info)
            .bind("basis", &self.buffers.basis)
            .dispatch(Dispatch::Items(items));
        let info = DistancesInfo {
            n_probes: self.counts.probes,
            n_directions: self.counts.directions,
            radius: self.radius,
            reserved_a: 0,
        };
        distances
            .call(&mut recorder.compute(distances.name()))
            .scene(scene.group())
            .uniform("info", &info)
            .bind("seen", &self.buffers.seen)
            .bind("receivers", &self.buffers.receivers)
            .bind("places", &self.probe_field.places)
            .dispatch(Dispatch::Rows(self.counts.probes));
    }

    fn record_light(&mut self, recorder: &mut Recorder, scene: &dyn SceneSeam) {
        // Lights without extent are known at each point at once, unless they are too many to ask each.
        let facts = scene.facts();
        let is_drawn = facts.n_extended_lights > 0 || facts.punctual_lights.len() > MAX_EXACT;
        let most = if is_drawn { self.look.n_light_frames.max(1) } else { LIT_POINTS };
        if self.n_light >= most {
            return;
        }
        let info = LightInfo {
            n_receivers: self.counts.receivers,
            n_before: self.n_light,
            frame: self.frame,
            seed: self.look.seed,
            texel: self.texel_width,
            reserved_a: 0,
            reserved_b: 0,
            reserved_c: 0,
        };
        self.light
            .call(&mut recorder.compute(self.light.name()))
            .scene(scene.group())
            .uniform("info", &info)
            .bind("lit", &self.buffers.lit)
            .with(self.visibility.bindings())
            .dispatch(Dispatch::Items(self.counts.receivers.next_multiple_of(light::WORKGROUP)));
        self.n_light += 1;
    }

    fn record_reflected(&self, recorder: &mut Recorder) {
        let info = ReflectInfo {
            n_receivers: self.counts.receivers,
            bounces: u32::from(self.look.bounces),
            reserved_a: 0,
            reserved_b: 0,
        };
        self.reflect
            .call(&mut recorder.compute(self.reflect.name()))
            .uniform("info", &info)
            .bind("lit", &self.buffers.lit)
            .bind("irradiance", &self.buffers.irradiance)
            .bind("radiance", &self.buffers.radiance)
            .dispatch(Dispatch::Items(self.counts.receivers.next_multiple_of(light::WORKGROUP)));
    }

    fn record_projection(&self, recorder: &mut Recorder, scene: &dyn SceneSeam) {
        let step = self.look.update_every.max(1);
        let info = ProjectInfo {
            n_probes: self.counts.probes,
            n_directions: self.counts.directions,
            n_coefficients: self.counts.coefficients,
            has_sky: u32::from(self.look.sky),
            first: self.frame % step,
            step,
            reserved_a: 0,
            reserved_b: 0,
        };
        self.project
            .call(&mut recorder.compute(self.project.name()))
            .scene(scene.group())
            .uniform("info", &info)
            .bind("seen", &self.buffers.seen)
            .bind("basis", &self.buffers.basis)
            .bind("radiance", &self.buffers.radiance)
            .bind("lambda", &self.buffers.lambda)
            .dispatch(Dispatch::Rows(self.counts.probes.div_ceil(step)));
    }

    fn record_transport(&self, recorder: &mut Recorder) {
        let of = &self.buffers;
        let info = ClustersInfo {
            n_clusters: self.counts.clusters,
            n_coefficients: self.counts.coefficients,
            n_basis: self.counts.basis,
            numbers: match self.numbers {
                Numbers::Halfs => gather::NUMBERS_HALFS,
                Numbers::Bytes => gather::NUMBERS_BYTES,
            },
        };
        let numbers = info.numbers;
        self.gather
            .call(&mut recorder.compute(self.gather.name()))
            .uniform("info", &info)
            .bind("clusters", &of.clusters)
            .bind("cluster_probes", &of.cluster_probes)
            .bind("projection", &of.projection)
            .bind("lambda", &of.lambda)
            .bind("cluster_light", &of.cluster_light)
            .dispatch(Dispatch::Rows(self.counts.clusters));
        let info = ReceiveInfo {
            n_blocks: self.counts.blocks,
            n_basis: self.counts.basis,
            scale: self.scale,
            numbers,
            n_receivers: self.counts.receivers,
            reserved_a: 0,
            reserved_b: 0,
            reserved_c: 0,
        };
        self.receive
            .call(&mut recorder.compute(self.receive.name()))
            .uniform("info", &info)
            .bind("clusters", &of.clusters)
            .bind("blocks", &of.blocks)
            .bind("reconstruction", &of.reconstruction)
            .bind("cluster_light", &of.cluster_light)
            .bind("receivers", &of.receivers)
            .bind("irradiance", &of.irradiance)
            .bind("lightmap_out", &self.texels)
            .dispatch(Dispatch::Rows(self.counts.blocks));
        let info = DilateInfo { scale: self.scale, reserved_a: 0, reserved_b: 0, reserved_c: 0 };
        let size = self.counts.size;
        self.dilate
            .call(&mut recorder.compute(self.dilate.name()))
            .uniform("info", &info)
            .bind("irradiance", &of.irradiance)
            .bind("lightmap_out", &self.texels)
            .with(self.field.bindings())
            .dispatch(Dispatch::Box(UVec3::new(size.x, size.y, 2 * self.counts.outputs)));
    }

    /// What kernels need to look up light: the fields `lightmap` and `sparse_probes`, and the lightmap's texels.
    pub fn bindings(&self) -> Bindings<'_> {
        let mut out = self.field.bindings();
        out.extend(self.probe_field.bindings(&self.buffers.lambda));
        out.push(("lightmap_texels", Resource::from(&self.texels)));
        out
    }

    /// By what irradiance \[W·m⁻²\] is multiplied in the lightmap's texels, since the last update: it follows the brightest light.
    pub fn scale(&self) -> f32 {
        self.scale
    }

    /// Greatest band of the radiance that arrives at receivers; 0: irradiance alone is known.
    pub fn radiance(&self) -> u32 {
        self.radiance
    }

    /// The lightmap: `rgba16float`, indirect irradiance times [`Self::scale`]; layer 0 front, 1 back. Bakes of radiance have more layers (`wgsl/kernels/sparse_probes/receive.wgsl`).
    pub fn lightmap(&self) -> &wgpu::TextureView {
        &self.texels
    }

    /// Indirect irradiance of each receiver \[W·m⁻²\], four f32 each; in bakes of radiance, then the other outputs.
    pub fn irradiance(&self) -> &wgpu::Buffer {
        &self.buffers.irradiance
    }

    /// Coefficients of the radiance that arrives at each probe, four f32 each.
    pub fn lambda(&self) -> &wgpu::Buffer {
        &self.buffers.lambda
    }

    /// How much of that light is still on its way ([`Convergence::to_come`]).
    pub fn to_come(&self) -> Stat {
        self.convergence.to_come()
    }

    /// Bytes on the GPU.
    pub fn bytes(&self) -> u64 {
        let of = &self.buffers;
        let buffers = [
            &of.receivers,
            &of.lit,
            &of.irradiance,
            &of.radiance,
            &of.seen,
            &of.basis,
            &of.lambda,
            &of.clusters,
            &of.cluster_probes,
            &of.projection,
            &of.blocks,
            &of.reconstruction,
            &of.cluster_light,
            &self.probe_field.places,
        ];
        let texels = u64::from(self.counts.size.x) * u64::from(self.counts.size.y);
        buffers.iter().map(|of| of.size()).sum::<u64>()
            + self.field.bytes()
            + 16 * u64::from(self.counts.outputs) * texels
    }

    /// Counts and bytes.
    pub fn stats(&self) -> Vec<Stat> {
        let known = Stat::known;
        vec![
            known("probes", "", self.counts.probes.into()),
            known("coefficients of a probe", "", self.counts.coefficients.into()),
            known("receivers", "", self.counts.receivers.into()),
            known("clusters", "", self.counts.clusters.into()),
            known(
                "matrices",
                "bytes",
                self.buffers.projection.size() + self.buffers.reconstruction.size(),
            ),
            known("in all", "bytes", self.bytes()),
            known("surfaces that have moved since the bake", "", u64::from(self.is_outdated))
                .fault("bake again"),
        ]
    }

    /// How well the bake knows the scene.
    pub fn notices(&self) -> Vec<Notice> {
        let of = &self.quality;
        let share = |n: u64| 100.0 * n as f64 / of.n_samples.max(1) as f64;
        let mut out = vec![Notice::note(format!(
            "{} probes, {} receivers in {} clusters, {:.1} MB; {:.2} % of the transport's energy is kept ({:.1} % in the worst cluster)",
            self.counts.probes,
            self.counts.receivers,
            self.counts.clusters,
            self.bytes() as f64 * 1e-6,
            100.0 * of.mean_energy,
            100.0 * of.least_energy
        ))];
        let unseen = share(of.n_samples - of.n_valid);
        if unseen > 1.0 {
            out.push(Notice::warning(format!(
                "no probe sees {unseen:.1} % of what receivers see: light from there is missing; bake with more --probes or a larger --radius"
            )));
        }
        if of.n_hidden > 0 {
            out.push(Notice::note(format!(
                "{} of {} receivers are inside of something, or in corners: of most of what they see, no probe sees anything",
                of.n_hidden, self.counts.receivers
            )));
        }
        out
    }
}

/// As in `integrators::direct_light`.
const MAX_EXACT: usize =
    crate::bindings::lucerna::integrators::direct_light::MAX_EXACT_LIGHTS as usize;

/// A power of two: an irradiance of this peak becomes about 256, so that 256 times as much fits into 16 bits, and 2⁻²² of it.
fn scale_of(peak: f32) -> f32 {
    if peak.is_finite() && peak > 0.0 {
        (8.0 - peak.log2().floor()).clamp(-60.0, 60.0).exp2()
    } else {
        1.0
    }
}

impl Quality {
    fn of(bake: &SparseBake) -> Self {
        let sum = |of: fn(&BakedCluster) -> u64| bake.clusters.iter().map(of).sum::<u64>();
        let n = bake.clusters.len().max(1) as f64;
        Self {
            n_samples: sum(|of| of.n_samples),
            n_valid: sum(|of| of.n_valid),
            n_hidden: sum(|of| of.n_hidden.into()),
            least_energy: bake.seen_clusters().map(|of| of.energy).fold(1.0, f32::min),
            mean_energy: bake.clusters.iter().map(|of| f64::from(of.energy)).sum::<f64>() / n,
        }
    }
}

impl Buffers {
    fn new(
        gpu: &Gpu,
        bake: &SparseBake,
        counts: &Counts,
        inverse: &[u32],
    ) -> Result<Self, GpuError> {
        let plan = &bake.plan;
        let receivers = seam_receivers(&plan.receivers, inverse);
        let surfaces = SparseSurfaces::new(&[], plan.size, &plan.corners);
        let lit: Vec<LitReceiver> = (0..plan.receivers.len())
            .map(|ix| {
                let points = surfaces.lit_points(&plan.receivers[ix], plan.reach[ix]);
                let words = points.map(|of| [inverse[of.triangle as usize], of.weights]);
                LitReceiver {
                    reflected: Vec3::ZERO,
                    side: receivers[ix].side,
                    albedo: Vec3::ZERO,
                    reserved: 0,
                    points: bytemuck::cast(words),
                }
            })
            .collect();
        let mut clusters = Vec::new();
        let (mut probes, mut projection, mut reconstruction): (Vec<u32>, Vec<u32>, Vec<u32>) =
            Default::default();
        let mut blocks: Vec<[u32; 2]> = Vec::new();
        for (ix, of) in (0u32..).zip(&bake.clusters) {
            clusters.push(Cluster {
                first_receiver: plan.clusters[ix as usize],
                n_receivers: of.n_receivers,
                first_probe: probes.len() as u32,
                n_probes: of.probes.len() as u32,
                first_projection: projection.len() as u32,
                n_vectors: of.n_vectors,
                first_reconstruction: reconstruction.len() as u32,
                reserved: 0,
            });
            probes.extend(&of.probes);
            projection.extend(&of.projection);
            reconstruction.extend(&of.reconstruction);
            let n_blocks = of.n_receivers.div_ceil(BLOCK as u32) * counts.outputs;
            blocks.extend((0..n_blocks).map(|block| [ix, block]));
        }
        // (Products read some words beyond the end, and multiply them by 0.)
        projection.extend([0; READ_BEYOND]);
        reconstruction.extend([0; READ_BEYOND]);
        let none = wgpu::BufferUsages::empty();
        let cleared = wgpu::BufferUsages::COPY_DST;
        let four_floats =
            |what, n: u32| storage_buffer(gpu, what, 16 * u64::from(n.max(1)), cleared, ADVICE);
        let n_basis = 4 * u64::from(counts.directions * counts.coefficients);
        Ok(Self {
            receivers: uploaded(gpu, "receivers", &receivers)?,
            lit: uploaded(gpu, "light on receivers", &lit)?,
            irradiance: four_floats(
                "what arrives at receivers",
                counts.receivers.saturating_mul(counts.outputs),
            )?,
            radiance: four_floats("radiance of receivers", counts.receivers)?,
            seen: uploaded(gpu, "what probes see", &plan.seen)?,
            basis: storage_buffer(gpu, "basis functions", n_basis, none, ADVICE)?,
            lambda: four_floats("coefficients of probes", counts.probes * counts.coefficients)?,
            clusters: uploaded(gpu, "clusters", &clusters)?,
            cluster_probes: uploaded(gpu, "probes of clusters", &probes)?,
            projection: uploaded(gpu, "projection of clusters", &projection)?,
            blocks: uploaded(gpu, "blocks of receivers", &blocks)?,
            reconstruction: uploaded(gpu, "reconstruction of receivers", &reconstruction)?,
            cluster_light: four_floats("light of clusters", counts.clusters * counts.basis)?,
        })
    }
}
