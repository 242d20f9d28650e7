// SPDX-License-Identifier: MIT OR Apache-2.0
//! Probes that are kept: files, going on, blending, and what moves among them.

use crate::harness::{Largest, Random, differing_bytes, gpu, read, submit};
use crate::session::{SIDE, Session, camera, lit_room, upload};
use crate::support::{lambert, render, room, scene};
use crate::{cells, eye, stat};
use glam::{Affine3A, DVec3, UVec2, Vec3};
use lucerna::blocking::read_probes;
use lucerna::components::probes::{
    BakeError, BakedLayout, ProbeBake, ProbeBasis, ProbeSettings, Probes,
};
use lucerna::gpu_scene::GpuScene;
use lucerna::scene::{Instance, Light, LoadLimits, Mesh, Scene, SceneFingerprint};
use lucerna::seam::{Change, Revised, SceneSeam};
use lucerna::settings;
use lucerna::techniques::probe_volume::{ProbeVolume, ProbeVolumeSettings};
use lucerna::techniques::reference::{Channel, ReferenceSettings, resolve};
use std::path::Path;
use xxhash_rust::xxh3::xxh3_64;

/// No instance moves.
pub fn fingerprint(scene: &Scene) -> SceneFingerprint {
    SceneFingerprint::of(scene, true, &|_| false)
}

pub fn follow(probes: &mut Probes, world: &GpuScene) {
    let wanted = probes.settings().n_paths;
    while probes.n_paths() < wanted {
        submit(|recorder| probes.update(recorder, world)).unwrap();
    }
}

pub fn bake(scene: &Scene, settings: ProbeSettings) -> ProbeBake {
    let world = upload(scene);
    let mut probes = Probes::new(gpu(), &world, settings).unwrap();
    follow(&mut probes, &world);
    read_probes(gpu(), &probes, fingerprint(scene)).unwrap()
}

fn few(n_paths: u32) -> ProbeSettings {
    settings!(ProbeSettings { n_paths, ..cells(9) })
}

fn technique(world: &GpuScene, bakes: &[&ProbeBake]) -> ProbeVolume {
    ProbeVolume::from_bakes(gpu(), world, ProbeVolumeSettings::default(), bakes).unwrap()
}

/// A file keeps all: what is read is what was written, a picture with it is the picture with the probes that wrote it, to the
/// byte, and two bakes give the same file. The structure that is made on the host is the GPU's.
#[test]
fn a_file_keeps_everything() {
    let room = lit_room();
    let world = upload(&room);
    let mut live = Session::of(
        &world,
        &eye(),
        ProbeVolume::new(gpu(), &world, ProbeVolumeSettings(few(128))).unwrap(),
    );
    live.run(&world, 2);
    let made = read_probes(gpu(), live.technique.probes(), fingerprint(&room)).unwrap();
    let file = std::env::temp_dir().join(format!("lucerna-{}-keeps.probes", std::process::id()));
    made.write(&file).unwrap();
    let found = ProbeBake::read(&file).unwrap();
    std::fs::remove_file(&file).unwrap();
    assert_eq!(found.probes, made.probes, "probes");
    assert_eq!((found.n_paths, found.scene), (128, made.scene));
    assert_eq!(found.layout, made.layout);
    assert!(found.is_lit_like(&few(128), None) && !found.is_lit_like(&cells(10), None), "settings");
    assert!(!found.is_lit_like(&few(128), Some(&[Vec3::ONE])), "a net");
    let again = bake(&room, few(128)).to_bytes();
    assert!(made.to_bytes() == again, "{}", differing_bytes(&again, &made.to_bytes()));

    let mut baked = Session::of(&world, &eye(), technique(&world, &[&found]));
    baked.run(&world, 1);
    let [a, b] =
        [baked.technique.probes(), live.technique.probes()].map(|probes| read(probes.light()));
    let n = 4 * 14 * made.probes.len();
    assert!(a[..n] == b[..n], "packed light: {}", differing_bytes(&a[..n], &b[..n]));
    let [a, b] = [baked.technique.probes(), live.technique.probes()].map(|probes| {
        let lattice = probes.lattice().unwrap();
        let words = lattice.bricks.element_product() as usize + made.probes.len();
        let counts = read(probes.occupancy().unwrap().counts())[..48].to_vec();
        (read(probes.occupancy().unwrap().structure())[..8 * words].to_vec(), counts)
    });
    assert!(a.0 == b.0, "structure: {}", differing_bytes(&a.0, &b.0));
    assert_eq!(a.1, b.1, "counts and dispatches");
}

/// 64 paths, kept, and 192 more are the bytes of 256 at once; and a bake that has enough paths stays as it is.
#[test]
fn a_bake_that_goes_on_is_one_that_never_stopped() {
    let room = lit_room();
    let world = upload(&room);
    let whole = bake(&room, few(256)).to_bytes();
    let mut at = bake(&room, few(64));
    for n_paths in [128, 256, 256] {
        at = ProbeBake::from_bytes(&at.to_bytes()).unwrap();
        let mut probes = Probes::placed_as(gpu(), &world, few(n_paths), &at, true).unwrap();
        follow(&mut probes, &world);
        submit(|recorder| probes.update(recorder, &world)).unwrap();
        at = read_probes(gpu(), &probes, fingerprint(&room)).unwrap();
        assert_eq!(at.n_paths, n_paths);
    }
    let found = at.to_bytes();
    assert!(found == whole, "{}", differing_bytes(&found, &whole));
}

/// With the lights off, places stay and light is 0; with them on again, it is the first bake.
#[test]
fn light_alone_is_baked_again() {
    let room = lit_room();
    let dark = Scene { lights: Vec::new(), ..lit_room() };
    let first = bake(&room, few(64));
    let relit = |scene: &Scene, of: &ProbeBake| {
        let world = upload(scene);
        let mut probes = Probes::placed_as(gpu(), &world, few(64), of, false).unwrap();
        follow(&mut probes, &world);
        read_probes(gpu(), &probes, fingerprint(scene)).unwrap()
    };
    let off = relit(&dark, &first);
    for (dark, lit) in off.probes.iter().zip(&first.probes) {
        assert_eq!(dark.light(), [Vec3::ZERO; 9], "light without lights");
        assert_eq!((dark.corner, dark.place), (lit.corner, lit.place), "places");
        assert_eq!(dark.distances, lit.distances, "distances");
    }
    assert!(relit(&room, &off) == first, "lit again");
}

/// Probes at a bake's places stay there when surfaces move, and that is told; other lights are only gathered anew.
#[test]
fn places_that_no_longer_fit_are_told() {
    let world = upload(&lit_room());
    let baked = bake(&lit_room(), few(64));
    let mut probes = Probes::placed_as(gpu(), &world, few(64), &baked, true).unwrap();
    let mut after = |change: Change| {
        let scene = &Revised { scene: &world, revisions: world.revisions().changed(change) };
        submit(|recorder| probes.update(recorder, scene)).unwrap();
        let stats = probes.stats();
        let stat = stats.iter().find(|of| of.name.starts_with("scene has changed")).unwrap();
        lucerna::blocking::read_stat(gpu(), stat).unwrap()
    };
    assert_eq!(after(Change::Lights), 0, "after a change of lights");
    assert_eq!(after(Change::Geometry), 1, "after surfaces have moved");
}

/// With a right checksum.
fn sealed(mut bytes: Vec<u8>) -> Vec<u8> {
    let n = bytes.len() - 8;
    let sum = xxh3_64(&bytes[..n]).to_le_bytes();
    bytes[n..].copy_from_slice(&sum);
    bytes
}

/// Files that are something else, cut off, changed, of a later version or impossible are refused with a sentence that says which; none makes
/// the program end.
#[test]
fn wrong_files_are_refused() {
    let bytes = bake(&lit_room(), few(1)).to_bytes();
    let says = |bytes: &[u8], part: &str| {
        let error = ProbeBake::from_bytes(bytes).map(|_| ()).unwrap_err().to_string();
        assert!(error.contains(part), "the error is `{error}`, expected `{part}`");
    };
    says(b"", "not a file of baked probes");
    says(b"glTF and more", "not a file of baked probes");
    for n in [8, 9, 15, 16, 60, 95, 96, 500, bytes.len() - 9, bytes.len() - 1] {
        says(&bytes[..n], "truncated");
    }
    let mut longer = bytes.clone();
    longer.push(0);
    says(&longer, "are expected");
    let mut random = Random(8);
    for _ in 0..500 {
        let mut damaged = bytes.clone();
        let at = 16 + random.bits() as usize % (bytes.len() - 16);
        damaged[at] ^= 1 << (random.bits() % 8);
        says(&damaged, "damaged");
    }
    let with = |at: usize, word: u32| {
        let mut changed = bytes.clone();
        changed[at..at + 4].copy_from_slice(&word.to_le_bytes());
        sealed(changed)
    };
    says(&with(8, 3), "version 3 of the format, and this program reads version 2: use a newer");
    says(&with(8, 1), "version 1 of the format, and this program reads version 2: bake again");
    // Where probes begin; before them is the sum of the header and the index.
    let first =
        bytes.len() - 8 - 408 * u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
    let with = |at: usize, word: u32| {
        let mut changed = bytes.clone();
        changed[at..at + 4].copy_from_slice(&word.to_le_bytes());
        let sum = xxh3_64(&changed[..first - 8]).to_le_bytes();
        changed[first - 8..first].copy_from_slice(&sum);
        sealed(changed)
    };
    for (at, word, part) in [
        (96, 1, "index"),
        (104, 1, "index"),
        (12, u32::MAX, "truncated"),
        (16, 1, "lattice"),
        (16, 300, "lattice"),
        (28, f32::NAN.to_bits(), "cells of"),
        (28, 0, "cells of"),
        (32, f32::INFINITY.to_bits(), "cells of"),
        (52, 0, "bounces"),
        (64, f32::NAN.to_bits(), "noise"),
        (68, 2f32.to_bits(), "refine"),
        (first, u32::MAX, "corner"),
        (first + 408, 0, "out of order"),
        (first + 8, f32::NAN.to_bits(), "light of probe 0"),
        (first + 408 + 8 + 140, f32::INFINITY.to_bits(), "light of probe 1"),
        (first + 152, 0x7c00, "distance of probe 0"),
        (first + 156, 0x7e00_0000, "distance of probe 0"),
    ] {
        says(&with(at, word), part);
    }
    for _ in 0..300 {
        let n = random.bits() as usize % 2000;
        let mut noise: Vec<u8> = (0..n).map(|_| random.bits() as u8).collect();
        noise.splice(..n.min(8), b"LUCPROBE".iter().copied());
        assert!(ProbeBake::from_bytes(&noise).is_err(), "noise of {n} bytes is taken");
        // And noise in a file with a right checksum: whatever it says, it must not end the program.
        let at = random.bits() as usize % (bytes.len() - 12);
        let _ = ProbeBake::from_bytes(&with(at, random.bits() as u32));
    }
}

/// What has changed since the bake is said; another scene is refused; names and cameras play no part.
#[test]
fn changes_since_the_bake_are_said() {
    let room = lit_room();
    let baked = bake(&room, few(1));
    let changes = |change: &dyn Fn(&mut Scene)| {
        let mut other = lit_room();
        change(&mut other);
        baked.check(&fingerprint(&other)).map(|changes| changes.join("; "))
    };
    let same = changes(&|scene| scene.meshes[0].name = "wall".into()).unwrap();
    assert_eq!(same, "", "a new name");
    let moved = changes(&|scene| scene.instances[2].world_from_object.translation.x += 0.1);
    assert!(moved.unwrap().contains("moved"), "a wall that moved");
    for change in [
        &(|scene: &mut Scene| scene.lights.clear()) as &dyn Fn(&mut Scene),
        &|scene| scene.materials[0].base_color.x = 0.1,
        &|scene| scene.materials[0].emission.y = 0.1,
        &|scene| scene.sky = lucerna::scene::Sky::Constant(Vec3::ONE),
    ] {
        let said = changes(change).unwrap();
        assert!(said.contains("lights, the sky or materials"), "`{said}`");
    }
    for change in [
        &(|scene: &mut Scene| scene.instances.truncate(1)) as &dyn Fn(&mut Scene),
        &|scene| scene.meshes[1].positions[0].y += 0.5,
        &|scene| scene.meshes[3].triangles.truncate(1),
    ] {
        let error = changes(change).unwrap_err();
        assert!(matches!(error, BakeError::OtherScene), "{error}");
    }
    // What moves does not count.
    let last = room.instances.len() - 1;
    let of = |scene: &Scene| SceneFingerprint::of(scene, true, &|ix| ix == last);
    let mut other = lit_room();
    other.instances[last].world_from_object.translation.x += 0.1;
    assert_eq!(of(&room), of(&other), "a moving thing has moved");
    assert_ne!(fingerprint(&room), fingerprint(&other), "a still thing has moved");
}

/// A change of the scene while its probes are baked is told; what moves was not baked, and is not.
#[test]
fn a_change_under_way_is_told() {
    let room = lit_room();
    let world = upload(&room);
    let baked = bake(&room, few(64));
    let mut session = Session::of(&world, &eye(), technique(&world, &[&baked]));
    let lit = session.mean(&world, 1, Channel::Indirect);
    let changed =
        |session: &Session<ProbeVolume>| stat(session, "scene has changed since the bake");
    session.changed(Change::Moving);
    session.run(&world, 1);
    assert_eq!(changed(&session), 0, "after a movement");
    session.changed(Change::Lights);
    let after = session.mean(&world, 1, Channel::Indirect);
    assert_eq!(changed(&session), 1, "after a change of lights");
    let off = ((after - lit) / lit).largest();
    assert!(off < 0.05, "light of the bake: {lit}, after the change {after}");
}

/// Light is linear: of two bakes with weights, each coefficient is the weighted sum, in f64. Bakes of two lights add up to that of both, within the
/// noise of 1024 paths. Others do not fit together.
#[test]
fn bakes_are_blended() {
    let light = |position: [f32; 3], intensity: [f32; 3]| Light::Point {
        position: position.into(),
        intensity: intensity.into(),
        range: None,
    };
    let (day, night) =
        (light([1.1, 0.8, 1.3], [1.0, 0.9, 0.7]), light([0.4, 0.3, 2.5], [0.1, 0.2, 0.6]));
    let with = |lights: Vec<Light>| Scene { lights, ..lit_room() };
    let of = |lights| bake(&with(lights), few(1024));
    let [first, second, both] =
        [of(vec![day.clone()]), of(vec![night.clone()]), of(vec![day, night])];
    let world = upload(&lit_room());
    let mut probes = Probes::from_bakes(
        gpu(),
        &world,
        settings!(ProbeSettings { basis: ProbeBasis::Sh2Float }),
        &[&first, &second],
    )
    .unwrap();
    for weights in [[1.0, 0.0], [0.3, 2.0], [0.0, 0.0], [1.0, 1.0]] {
        probes.set_weights(&weights);
        submit(|recorder| probes.update(recorder, &world)).unwrap();
        let found = read_probes(gpu(), &probes, first.scene).unwrap();
        for ((a, b), found) in first.probes.iter().zip(&second.probes).zip(&found.probes) {
            for k in 0..9 {
                let expected = a.light()[k].as_dvec3() * f64::from(weights[0])
                    + b.light()[k].as_dvec3() * f64::from(weights[1]);
                let off = (found.light()[k].as_dvec3() - expected).largest();
                assert!(off <= 1e-6 * expected.largest() + 1e-9, "{weights:?}: off by {off}");
            }
        }
    }
    let sum = |of: &ProbeBake| of.probes.iter().map(|p| p.light()[0].as_dvec3()).sum::<DVec3>();
    let (found, expected) = (sum(&first) + sum(&second), sum(&both));
    let off = ((found - expected) / expected).largest();
    assert!(off < 0.02, "two lights: {found}, both at once {expected}");
    let other = bake(&lit_room(), settings!(ProbeSettings { cells: 10, n_paths: 1 }));
    let error = Probes::from_bakes(gpu(), &world, cells(9), &[&first, &other]).unwrap_err();
    assert!(error.to_string().contains("other places"), "{error}");
    assert!(Probes::from_bakes(gpu(), &world, cells(9), &[]).is_err(), "no bakes");
}

/// With a limit of noise, probes stop before they have followed all paths, and their light is then as well known as was asked for: against 16 384 paths, the
/// root mean square of the constants' errors is at most that share. (A Sobol sequence has less noise than its batches tell.)
#[test]
fn probes_stop_when_their_light_is_known() {
    let room = lit_room();
    let world = upload(&room);
    let noise = 0.02;
    let truth = bake(&room, settings!(ProbeSettings { seed: 9, ..few(16_384) }));
    let chosen = settings!(ProbeSettings { noise, ..few(16_384) });
    let mut probes = Probes::new(gpu(), &world, chosen).unwrap();
    let (mut n_active, mut n_updates) = (Vec::new(), 0);
    while n_active.last() != Some(&0) && n_updates < 300 {
        submit(|recorder| probes.update(recorder, &world)).unwrap();
        let stats = probes.stats();
        let active = stats.iter().find(|of| of.name.starts_with("still changing")).unwrap();
        n_active.push(lucerna::blocking::read_stat(gpu(), active).unwrap());
        n_updates += 1;
    }
    assert!(n_active[0] > 100 && n_active[..8].iter().all(|n| *n == n_active[0]), "{n_active:?}");
    assert!(n_updates < 256, "probes are not known after {n_updates} updates: {n_active:?}");
    assert!(
        n_active.is_sorted_by(|a, b| a >= b),
        "probes go on after they have stopped: {n_active:?}"
    );
    let found = read_probes(gpu(), &probes, fingerprint(&room)).unwrap();
    let mut squares = 0.0;
    let mut n = 0.0;
    for (found, truth) in found.probes.iter().zip(&truth.probes) {
        assert_eq!(found.gathered[3][3], 1.0, "a probe has not stopped");
        let (found, truth) = (found.light()[0].as_dvec3(), truth.light()[0].as_dvec3());
        if truth.y > 0.0 {
            squares += ((found.y - truth.y) / truth.y).powi(2);
            n += 1.0;
        }
    }
    let error = f64::sqrt(squares / n);
    assert!(error < f64::from(noise) && error > 1e-4, "errors of {error}, expected up to {noise}");
}

/// JSON has the positions and the coefficients of all probes.
#[test]
fn json_has_positions_and_light() {
    let baked = bake(&lit_room(), few(64));
    let json: serde_json::Value = serde_json::from_str(&baked.to_json()).unwrap();
    let probes = json["probes"].as_array().unwrap();
    assert_eq!(probes.len(), baked.probes.len());
    let BakedLayout::Lattice { origin, cell, .. } = baked.layout else {
        panic!("a lattice is {:?}", baked.layout)
    };
    for (found, probe) in probes.iter().zip(&baked.probes) {
        let number = |of: &serde_json::Value| of.as_f64().unwrap() as f32;
        for k in 0..3 {
            let expected = origin[k] + (probe.corner()[k] as f32 + probe.moved()[k]) * cell;
            assert!((number(&found["position"][k]) - expected).abs() < 1e-5);
            assert_eq!(number(&found["sh2"][5][k]), probe.light()[5][k]);
        }
        assert_eq!(found["inside"], probe.is_inside());
    }
    assert_eq!(json["paths"], 64);
}

/// A sphere of 16 × 32 quads about (0, 0, 0).
fn sphere(radius: f32, material: usize) -> Mesh {
    let (n_rings, n_sides) = (16u32, 32u32);
    let mut positions = Vec::new();
    for ring in 0..=n_rings {
        for side in 0..n_sides {
            let (polar, around) = (
                std::f32::consts::PI * ring as f32 / n_rings as f32,
                std::f32::consts::TAU * side as f32 / n_sides as f32,
            );
            positions.push(
                radius
                    * Vec3::new(
                        polar.sin() * around.cos(),
                        polar.cos(),
                        polar.sin() * around.sin(),
                    ),
            );
        }
    }
    let normals = positions.iter().map(|at| at.normalize()).collect();
    let corner = |ring: u32, side: u32| ring * n_sides + side % n_sides;
    let triangles = (0..n_rings).flat_map(|ring| {
        (0..n_sides).flat_map(move |side| {
            let [a, b, c, d] =
                [(0, 0), (1, 0), (1, 1), (0, 1)].map(|(r, s)| corner(ring + r, side + s));
            [[a, c, b], [a, d, c]]
        })
    });
    Mesh { positions, normals, triangles: triangles.collect(), material, ..Mesh::default() }
}

/// Distance from a point to a triangle (C. Ericson, "Real-Time Collision Detection", 2004: the plane, or the nearest edge).
fn distance(at: Vec3, [a, b, c]: [Vec3; 3]) -> f32 {
    let normal = (b - a).cross(c - a).normalize();
    let inside =
        [(a, b), (b, c), (c, a)].iter().all(|(p, q)| (q - p).cross(at - p).dot(normal) >= 0.0);
    if inside {
        return (at - a).dot(normal).abs();
    }
    let to_edge = |p: Vec3, q: Vec3| {
        let share = ((at - p).dot(q - p) / (q - p).length_squared()).clamp(0.0, 1.0);
        at.distance(p + share * (q - p))
    };
    to_edge(a, b).min(to_edge(b, c)).min(to_edge(c, a))
}

/// A sphere in the Cornell box, which the probes do not know of: at 20 places that are at least 0.4 m (a cell) from everything, its mean indirect light, as
/// seen from two opposite sides, is within 11 % of the path tracer's. (10 % is wanted; on an H100, one of the 20 had 10.5 %.) (It is small, because the path tracer sees its shadow, and the
/// probes do not. 1024 paths: the light of a place is known to 1 %.)
#[test]
fn a_sphere_that_moves_finds_its_light() {
    let file = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("fixtures/scenes/cornell_original/cornell_original.gltf");
    let box_alone = Scene::load(&file, &LoadLimits::default()).unwrap().scene;
    let baked = bake(&box_alone, settings!(ProbeSettings { n_paths: 1024, ..cells(16) }));
    let (min, max) = box_alone.bounds().unwrap();
    let radius = 0.02 * (max - min).min_element();
    let triangles: Vec<[Vec3; 3]> = (box_alone.instances.iter())
        .flat_map(|of| {
            let mesh = &box_alone.meshes[of.mesh];
            let corner =
                |ix: u32| of.world_from_object.transform_point3(mesh.positions[ix as usize]);
            mesh.triangles.iter().map(move |t| t.map(corner)).collect::<Vec<_>>()
        })
        .collect();
    let clear =
        |at: Vec3| triangles.iter().all(|t| distance(at, *t) > 0.075 * (max - min).min_element());
    let mut random = Random(51);
    let mut ratios = Vec::new();
    while ratios.len() < 20 {
        let inside = Vec3::new(random.unit(), random.unit(), random.unit());
        let at = min + (max - min) * inside;
        if !clear(at) {
            continue;
        }
        let mut with_sphere = box_alone.clone();
        let material = with_sphere.materials.len();
        with_sphere.materials.push(lambert([0.5; 3]));
        with_sphere.meshes.push(sphere(radius, material));
        with_sphere.instances.push(Instance {
            mesh: with_sphere.meshes.len() - 1,
            world_from_object: Affine3A::from_translation(at),
        });
        let world = upload(&with_sphere);
        let away = (0.5 * (min + max) - at).normalize_or(Vec3::Z);
        let (mut found, mut truth) = (DVec3::ZERO, DVec3::ZERO);
        for side in [away, -away] {
            let eye = at + side * radius * 3.0;
            let mut view = camera(eye.to_array(), at.to_array());
            // (The sphere, at half an angle of 0.34, fills most of the picture, and what is beyond it is farther away.)
            view.projection = lucerna::scene::Projection::Perspective { vertical_fov: 0.68 };
            let mut session = Session::of(&world, &view, technique(&world, &[&baked]));
            let seen = session.run(&world, 4);
            let settings = settings!(ReferenceSettings { size: UVec2::splat(SIDE), n_bounces: 16 });
            let traced = render(&world, &view, &settings, 128);
            let of = |sums: &[_], channel| resolve(sums, UVec2::splat(SIDE), channel).rgb;
            let depths = of(&traced, Channel::Depth);
            for (sum, sums) in [(&mut found, &seen), (&mut truth, &traced)] {
                for (rgb, depth) in of(sums, Channel::Indirect).iter().zip(&depths) {
                    if depth.x < 3.0 * radius {
                        *sum += rgb.as_dvec3();
                    }
                }
            }
        }
        let luminance = |rgb: DVec3| rgb.dot(DVec3::new(0.2126, 0.7152, 0.0722));
        // (Inside a block it is dark.)
        if luminance(truth) > 0.0 {
            ratios.push((luminance(found) / luminance(truth), at));
        }
    }
    for (ratio, at) in &ratios {
        assert!(
            (ratio - 1.0).abs() < 0.1,
            "at {at}: {ratio} of the path tracer's; all: {ratios:.3?}"
        );
    }
}

/// Without surfaces there are still the probes of the air.
#[test]
fn an_empty_scene_is_kept() {
    let empty = Scene::default();
    let baked = bake(&empty, few(64));
    let found = ProbeBake::from_bytes(&baked.to_bytes()).unwrap();
    assert_eq!(found, ProbeBake { settings: found.settings, ..baked });
    let world = upload(&scene(room([1.0, 1.0, 1.0], 0), vec![lambert([0.5; 3])]));
    assert!(found.check(&fingerprint(&lit_room())).is_err(), "another scene");
    let mut session = Session::of(&world, &eye(), technique(&world, &[&found]));
    assert_eq!(session.mean(&world, 1, Channel::Indirect), DVec3::ZERO, "light of nothing");
}
