// SPDX-License-Identifier: MIT OR Apache-2.0
//! Probes that stay in a file: parts of them come and go with a place, in a stated amount of memory.

use crate::bake::bake;
use crate::harness::gpu;
use crate::session::{Session, camera, lit_room, upload};
use crate::support::{lambert, room, scene};
use crate::{cells, stat};
use glam::{Affine3A, Vec3};
use lucerna::components::probes::{BakeError, ProbeBake, ProbeFile, ProbeSettings, Probes};
use lucerna::gpu_scene::GpuScene;
use lucerna::scene::{Instance, Light, Material, Scene};
use lucerna::settings;
use lucerna::techniques::Technique;
use lucerna::techniques::probe_volume::{ProbeVolume, ProbeVolumeSettings};
use lucerna::techniques::reference::Channel;
use std::path::PathBuf;

/// Rooms along each side.
const TILES: usize = 10;

/// 10 × 10 rooms of 1 m, each with a lamp of a colour of its own, and doors in a row along x.
fn tiled_world() -> Scene {
    let colours = [[0.8; 3], [0.7, 0.2, 0.2], [0.2, 0.6, 0.2], [0.3, 0.3, 0.8]];
    let materials: Vec<Material> = colours.iter().map(|rgb| lambert(*rgb)).collect();
    let mut world = scene(Vec::new(), materials);
    for tile in 0..TILES * TILES {
        let at = Vec3::new((tile % TILES) as f32, 0.0, (tile / TILES) as f32);
        for mut wall in room([1.0, 1.0, 1.0], (tile + tile / TILES) % 4) {
            // (The two walls across x.)
            let is_open = wall.positions.iter().all(|p| p.x == wall.positions[0].x);
            if is_open {
                wall.positions.iter_mut().for_each(|p| p.y = p.y.max(0.6));
            }
            world.meshes.push(wall);
            world.instances.push(Instance {
                mesh: world.meshes.len() - 1,
                world_from_object: Affine3A::from_translation(at),
            });
        }
        world.lights.push(Light::Point {
            position: at + Vec3::new(0.5, 0.85, 0.5),
            intensity: Vec3::new(1.0, 0.5 + 0.05 * at.x, 0.5 + 0.05 * at.z) * 0.3,
            range: None,
        });
    }
    world
}

/// A file that is deleted at the end.
struct Kept(PathBuf);

impl Kept {
    fn new(name: &str, bake: &ProbeBake) -> Self {
        let path = std::env::temp_dir().join(format!("lucerna-{}-{name}", std::process::id()));
        bake.write(&path).unwrap();
        Self(path)
    }
}

impl Drop for Kept {
    fn drop(&mut self) {
        let _ = std::fs::remove_file(&self.0);
    }
}

fn few() -> ProbeSettings {
    settings!(ProbeSettings { n_paths: 64, n_bounces: 4, ..cells(80) })
}

/// Bytes of all buffers that hold probes.
fn bytes(probes: &Probes) -> u64 {
    let structure = probes.occupancy().unwrap().structure();
    [probes.light(), probes.gathered(), probes.distances(), structure]
        .map(wgpu::Buffer::size)
        .iter()
        .sum()
}

fn streamed(world: &GpuScene, file: &ProbeFile, most: u64) -> Session<ProbeVolume> {
    let settings = ProbeVolumeSettings::default();
    let technique = ProbeVolume::from_file(gpu(), world, settings, file, most).unwrap();
    Session::of(world, &camera([0.5, 0.5, 0.5], [1.5, 0.4, 0.5]), technique)
}

/// A walk through 10 × 10 rooms and back with a quarter of the memory that all probes take: wherever it is, the picture of the room that it is in, and through its
/// door into the next, is to the bit that with all probes in memory, so nothing is missing and no seam shows where one part ends. The
/// buffers never grow.
#[test]
fn a_walk_through_a_large_world() {
    let world = tiled_world();
    let baked = bake(&world, few());
    let kept = Kept::new("walk.probes", &baked);
    let mut file = ProbeFile::open(&kept.0).unwrap();
    assert_eq!(file.n_probes() as usize, baked.probes.len());
    let world = upload(&world);
    let all =
        ProbeVolume::from_bakes(gpu(), &world, ProbeVolumeSettings::default(), &[&baked]).unwrap();
    let most = bytes(all.probes()) / 4;
    let mut whole = Session::of(&world, &camera([0.5, 0.5, 0.5], [1.5, 0.4, 0.5]), all);
    let mut parts = streamed(&world, &file, most);
    assert!(bytes(parts.technique.probes()) <= most, "bytes of a quarter");
    assert_eq!(stat(&parts, "probes"), 0, "probes before the first call");
    let there = (0..TILES).map(|ix| (ix as f32, (ix * 7 % TILES) as f32));
    let back = (0..TILES - 1).rev().map(|ix| (ix as f32, 3.0));
    let (mut n_loaded, mut n_dropped, mut last) = (0, 0, Vec3::ZERO);
    for (x, z) in there.chain(back) {
        for (eye, target) in [
            ([x + 0.5, 0.5, z + 0.5], [x + 1.5, 0.4, z + 0.5]),
            ([x + 0.02, 0.3, z + 0.3], [x - 1.0, 0.3, z + 0.6]),
            ([x + 0.5, 0.7, z + 0.2], [x + 0.5, 0.2, z + 0.9]),
        ] {
            let place = Vec3::from(eye);
            let found =
                parts.technique.probes_mut().stream(gpu(), &mut file, place, u32::MAX).unwrap();
            n_loaded += found.n_loaded;
            n_dropped += found.n_dropped;
            assert_eq!(found.n_to_load, 0);
            // (A room, and half of the next.)
            assert!(found.radius > 1.5, "at {place}, probes are there within {} m", found.radius);
            let pictures = [&mut whole, &mut parts].map(|session| {
                session.camera = camera(eye, target);
                // What is farther away than the radius may differ.
                let size = 24 * 24;
                let lit = session.picture(&world, 1, Channel::Indirect);
                let depth = session.picture(&world, 1, Channel::Depth);
                (0..size)
                    .map(|ix| if depth[ix].x < 0.8 * found.radius { lit[ix] } else { Vec3::ZERO })
                    .collect::<Vec<_>>()
            });
            assert!(pictures[0] == pictures[1], "at {place}, the picture of a part differs");
            let n_lit = pictures[1].iter().filter(|rgb| rgb.min_element() > 0.0).count();
            // (From the first room and the last one, one looks out of the world.)
            let is_inner = (1.0..9.0).contains(&x);
            assert!(n_lit > 300 || !is_inner, "at {place}, {n_lit} of 576 pixels are lit");
            assert!(bytes(parts.technique.probes()) <= most, "bytes have grown");
            last = place;
        }
    }
    assert!(n_dropped > 1000 && n_loaded > n_dropped, "{n_loaded} loaded, {n_dropped} dropped");
    // Nothing to do where it is already.
    let again = parts.technique.probes_mut().stream(gpu(), &mut file, last, u32::MAX).unwrap();
    assert_eq!((again.n_loaded, again.n_dropped), (0, 0));
}

/// A few bricks at each call: what is still to come is told, and in the end it is the same; with room for all, all are there.
#[test]
fn loading_can_be_spread_over_frames() {
    let baked = bake(&lit_room(), cells(24));
    let kept = Kept::new("spread.probes", &baked);
    let mut file = ProbeFile::open(&kept.0).unwrap();
    let world = upload(&lit_room());
    let mut parts = streamed(&world, &file, 1 << 30);
    let mut calls = 0;
    loop {
        calls += 1;
        let found = parts.technique.probes_mut().stream(gpu(), &mut file, Vec3::ONE, 16).unwrap();
        assert!(found.n_loaded <= 16 && found.radius == f32::INFINITY, "{found:?}");
        assert_eq!(stat(&parts, "still in the file"), u64::from(found.n_to_load));
        if found.n_to_load == 0 {
            break;
        }
    }
    assert!(calls > 5, "calls: {calls}");
    assert_eq!(stat(&parts, "probes"), baked.probes.len() as u64);
    let inside = baked.probes.iter().filter(|probe| probe.is_inside()).count() as u64;
    assert_eq!(stat(&parts, "inside something"), inside);
    let all = ProbeVolume::from_bakes(gpu(), &world, ProbeVolumeSettings::default(), &[&baked]);
    let mut whole = Session::of(&world, &parts.camera, all.unwrap());
    let [a, b] = [&mut whole, &mut parts].map(|of| of.picture(&world, 1, Channel::Indirect));
    assert!(a == b, "all parts are not the whole");
}

/// Files that cannot be read in parts say why when they are opened; a brick that was damaged since says so when it is read, and the others stay usable;
/// too little memory is refused with what is needed.
#[test]
fn wrong_files_and_too_little_memory_are_refused() {
    let baked = bake(&lit_room(), settings!(ProbeSettings { n_paths: 64, ..cells(12) }));
    let kept = Kept::new("wrong.probes", &baked);
    let good = std::fs::read(&kept.0).unwrap();
    let opened = |bytes: &[u8]| {
        std::fs::write(&kept.0, bytes).unwrap();
        ProbeFile::open(&kept.0).map(|_| ()).unwrap_err().to_string()
    };
    for n in [0, 4, 8, 20, 60, 95, 120, good.len() / 2, good.len() - 1] {
        let error = opened(&good[..n]);
        assert!(error.contains("truncated") || n < 8, "{n} bytes: {error}");
    }
    let mut damaged = good.clone();
    damaged[95] ^= 1;
    assert!(opened(&damaged).contains("damaged"));
    assert!(opened(b"glTF, a long file that is something else").contains("not a file of baked"));
    let mut brick = good.clone();
    let first = good.len() - 8 - 408 * baked.probes.len();
    brick[first + 300] ^= 4;
    std::fs::write(&kept.0, &brick).unwrap();
    let mut file = ProbeFile::open(&kept.0).unwrap();
    let world = upload(&lit_room());
    let settings = ProbeVolumeSettings::default();
    let error = ProbeVolume::from_file(gpu(), &world, settings, &file, 10_000).unwrap_err();
    assert!(error.to_string().contains("no room for probes: at least"), "{error}");
    let mut parts = streamed(&world, &file, 1 << 30);
    // (The damaged brick is that of the least corner, far from here.)
    let place = Vec3::new(2.0, 1.0, 3.0);
    let error = parts.technique.probes_mut().stream(gpu(), &mut file, place, u32::MAX);
    assert!(matches!(error, Err(BakeError::Damaged)), "{error:?}");
    let n = stat(&parts, "probes");
    assert!((100..baked.probes.len() as u64).contains(&n), "probes that are there: {n}");
    parts.camera = camera([1.5, 0.6, 2.4], [1.6, 0.5, 3.0]);
    let lit = parts.mean(&world, 1, Channel::Indirect);
    assert!(lit.min_element() > 0.0, "light of the bricks that are there: {lit}");
    assert!(
        parts
            .technique
            .stats()
            .iter()
            .all(|stat| stat.name != "still to follow" || stat.fault.is_some())
    );
}
