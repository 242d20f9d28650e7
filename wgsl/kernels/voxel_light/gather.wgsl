// SPDX-License-Identifier: MIT OR Apache-2.0
//! Updates the irradiance of every face of every occupied voxel by a few rays.
//!
//! `lucerna::integrators::face_gather` describes how. Faces that were found empty or dark are sampled less often; so are all
//! if only direct light is sampled and the light has settled.
//!
//! Dispatch: indirect, one invocation a record (slot · n_faces + face), in rows as `lucerna::math::dispatch` lays them
//! out. Workgroup memory: none. Each invocation owns one record of `lights`; for others it reads what the kernel
//! voxel_light/publish computed from them: the same input gives the same bytes.

#import lucerna::components::voxel_light::cache::{FaceLight, FaceSamples, SETTLED_PERIOD, is_lit, keep_deposits, renew, with_cut}
#import lucerna::components::voxel_light::sides::NO_BORDER
#import lucerna::fields::voxel_light_texels::levels
#import lucerna::fields::voxel_structure::{border_of_record, first_record_of_face, packed_cell_of_slot}
#import lucerna::integrators::face_gather::{FaceGatherSettings, add_face_sample}
#import lucerna::math::dispatch::group_of_dispatch
#import lucerna::math::loops::loops_run
#import lucerna::sampling::pcg::pcg3d

const WORKGROUP: u32 = 64u;
/// Faces that this many rays found empty or dark are sampled only in one of `IDLE_PERIOD` frames: most face into walls
/// or out of the building.
const IDLE_AFTER: f32 = 16.0;
const IDLE_PERIOD: u32 = 16u;
/// Once the light has settled, faces with this many rays are sampled less often if only direct light is sampled.
const KEPT_AFTER: f32 = 64.0;

struct GatherInfo {
    frame: u32,
    seed: u32,
    /// Points sampled on each face.
    n_points: u32,
    /// Reflections that a path follows. If `face_light` holds only direct light, these are all bounces; otherwise 1 is
    /// enough. 0: reflected light stays as it is, because something else updates it.
    n_bounces: u32,
    /// See `cache::renew`.
    light_rays: f32,
    max_rays: f32,
    /// Index of the level whose faces are updated.
    level: u32,
    /// 1: direct light is sampled here. 0: it stays as it is, because something else deposits it.
    finds_direct: u32,
}

@group(1) @binding(0) var<uniform> info: GatherInfo;
/// x: occupied voxels of the level; z: its records.
@group(1) @binding(1) var<uniform> counts: vec4<u32>;
@group(1) @binding(2) var<storage, read_write> lights: array<FaceLight>;

@compute @workgroup_size(WORKGROUP)
fn main(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    let record = group_of_dispatch(group) * WORKGROUP + local;
    let level = levels.levels[info.level];
    let n_faces = level.grid.n_faces;
    if record >= counts.z {
        return;
    }
    let first = first_record_of_face(level, counts.x, record);
    let face = first % n_faces;
    let packed_cell = packed_cell_of_slot(level, first / n_faces);
    let known = lights[level.first_record + record];
    let hash = pcg3d(vec3<u32>(packed_cell, face + 8u * info.level, info.seed));
    let is_known = min(known.n_rays, info.light_rays) >= IDLE_AFTER;
    // (Reflected light has more noise: it takes all samples that it can get.)
    let is_kept = levels.is_settled != 0u && info.n_bounces == 0u && known.n_rays >= KEPT_AFTER;
    let period_lit = select(1u, SETTLED_PERIOD, is_kept);
    let period = select(period_lit, IDLE_PERIOD, !is_lit(known));
    if is_known && (info.frame + hash.x) % period != 0u {
        return;
    }
    // Every fourth point of a Sobol sequence fills a quarter of the square: such faces follow another one without gaps.
    let sequence = select(hash, pcg3d(hash), is_kept);
    var settings = FaceGatherSettings(info.n_bounces, info.finds_direct != 0u, NO_BORDER);
    if n_faces == 6u {
        settings.border = border_of_record(level, record).x;
    }
    var samples: FaceSamples;
    var is_cut = false;
    for (var point = 0u; point < info.n_points; point++) {
        let sample_ix = info.frame / period_lit * info.n_points + point;
        let more =
            add_face_sample(samples, settings, level.grid, packed_cell, face, sample_ix, sequence);
        // (No index of a level has the top bit.)
        if !loops_run(info.level >> 31u) {
            is_cut = true;
            break;
        }
        samples = more;
    }
    var renewed = renew(known, samples, info.light_rays, info.max_rays);
    if info.finds_direct == 0u {
        renewed = keep_deposits(renewed, known);
    }
    if info.n_bounces == 0u {
        renewed.indirect = known.indirect;
        renewed.feedback = known.feedback;
    }
    if is_cut {
        renewed = with_cut(renewed);
    }
    lights[level.first_record + record] = renewed;
}
