// SPDX-License-Identifier: MIT OR Apache-2.0
//! Probes at the points of nets: rules that place them, their light through pixels, files of them.

use crate::bake::{fingerprint, follow};
use crate::harness::{KeepNan, Largest, Random, gpu, submit};
use crate::session::{Session, lit_room, upload};
use crate::support::{lambert, room, scene};
use crate::{eye, stat};
use glam::{DVec3, Quat, Vec3};
use lucerna::blocking::{PlaceNetError, place_net, read_probes};
use lucerna::components::probe_net::{NetKind, NetRule, NetSettings, PlacedNet, ProbeNet};
use lucerna::components::probes::{BakedLayout, ProbeBake, ProbeSettings, ProbeVisibility, Probes};
use lucerna::gpu_scene::GpuScene;
use lucerna::scene::{Light, Material, Scene};
use lucerna::seam::Change;
use lucerna::settings;
use lucerna::techniques::probe_volume::{ProbeVolume, ProbeVolumeSettings};
use lucerna::techniques::reference::Channel;

fn placed(world: &GpuScene, rule: NetRule) -> PlacedNet {
    place_net(gpu(), world, &settings!(NetSettings { rule })).unwrap()
}

fn session(world: &GpuScene, net: ProbeNet, settings: ProbeSettings) -> Session<ProbeVolume> {
    let chosen = ProbeVolumeSettings(settings);
    Session::of(world, &eye(), ProbeVolume::on_net(gpu(), world, chosen, net).unwrap())
}

fn few(n_paths: u32) -> ProbeSettings {
    settings!(ProbeSettings { n_paths })
}

/// Points in a room of 2 m × 1 m × 3 m, 1 cm from the walls at least.
fn scattered(n: usize) -> Vec<Vec3> {
    let mut random = Random(71);
    let mut within = |size: f32| 0.01 + (size - 0.02) * random.unit();
    (0..n).map(|_| Vec3::new(within(2.0), within(1.0), within(3.0))).collect()
}

/// The white furnace, as with probes on a lattice: L_e·Σ ρᵏ wherever a net's probes are, whatever they span: in space by both rules and scattered, in
/// a plane, on a line, one alone. No probe is behind a wall, so no pixel is darker than the noise of 1024 paths.
#[test]
fn the_furnace_is_white_in_every_net() {
    let emission = Vec3::new(0.7, 1.0, 0.25);
    let material = Material { emission, ..lambert([0.5; 3]) };
    let world = upload(&scene(room([2.0, 1.0, 3.0], 0), vec![material]));
    let expected = emission.as_dvec3() * (2..=4).map(|k| 0.5f64.powi(k)).sum::<f64>();
    let plane = (0..9).map(|ix| Vec3::new(0.5 * (ix % 3) as f32 + 0.4, 0.5, (ix / 3) as f32 + 0.4));
    let line = (0..3).map(|ix| Vec3::new(1.0, 0.5, ix as f32 + 0.5));
    for (rule, kind) in [
        (NetRule::Surfaces, NetKind::Space),
        (NetRule::Ground { height: 0.4 }, NetKind::Plane),
        (NetRule::Points(scattered(40)), NetKind::Space),
        (NetRule::Points(plane.collect()), NetKind::Plane),
        (NetRule::Points(line.collect()), NetKind::Line),
        (NetRule::Points(vec![Vec3::new(0.3, 0.2, 0.7)]), NetKind::Point),
    ] {
        for visibility in [ProbeVisibility::None, ProbeVisibility::Distances] {
            let made = placed(&world, rule.clone());
            assert_eq!(made.net.kind(), kind, "{rule:?}");
            let chosen = settings!(ProbeSettings { n_bounces: 3, visibility, ..few(1024) });
            let mut session = session(&world, made.net, chosen);
            session.run(&world, 16);
            let picture = session.picture(&world, 2, Channel::Indirect);
            let apart = |found: DVec3| ((found - expected) / expected).largest();
            let mean = picture.iter().map(|p| p.as_dvec3()).sum::<DVec3>() / picture.len() as f64;
            let worst = picture.iter().map(|p| apart(p.as_dvec3())).fold(0.0, f64::max_nan);
            assert!(
                apart(mean) < 0.02 && worst < 0.06,
                "{rule:?}, {visibility:?}: mean {mean}, expected {expected}; a pixel is off by {worst}"
            );
        }
    }
}

/// In a closed single-sided room, both rules put all probes inside it, at any angle of the room: those of `Surfaces` within two voxels of a wall, those of `Ground` at
/// their height (f32's roundings of rays), and what is behind the walls is counted. There are enough of them that no point of the
/// floor is farther than two voxels from one.
#[test]
fn rules_place_probes_inside() {
    for turn in [Quat::IDENTITY, Quat::from_euler(glam::EulerRot::YXZ, 0.5, 0.0, 0.0)] {
        let mut walls = room([4.0, 2.0, 3.0], 0);
        for at in walls.iter_mut().flat_map(|wall| &mut wall.positions) {
            *at = turn * *at;
        }
        let world = upload(&scene(walls, vec![lambert([0.5; 3])]));
        let spacing = 0.25;
        let make = |rule| {
            place_net(gpu(), &world, &settings!(NetSettings { rule, spacing, fills: false }))
        };
        let surfaces = make(NetRule::Surfaces).unwrap();
        let size = Vec3::new(4.0, 2.0, 3.0);
        let local = |p: &Vec3| turn.inverse() * *p;
        let to_wall = |p: Vec3| p.min(size - p).min_element();
        let points: Vec<Vec3> = surfaces.net.points().iter().map(local).collect();
        assert!(points.len() > 300 && surfaces.n_inside > 100, "{}", points.len());
        for p in &points {
            assert!((0.0..2.0 * 0.3).contains(&to_wall(*p)), "a probe at {p}, turned by {turn}");
        }
        let ground = make(NetRule::Ground { height: 0.7 }).unwrap();
        let points: Vec<Vec3> = ground.net.points().iter().map(local).collect();
        for p in &points {
            assert!(to_wall(*p) > 0.0 && (p.y - 0.7).abs() < 1e-4, "a probe at {p}");
        }
        assert_eq!(ground.net.kind(), NetKind::Plane, "what probes above an even floor span");
        for ix in 0..100 {
            let at = Vec3::new(0.4 * (ix % 10) as f32 + 0.2, 0.7, 0.3 * (ix / 10) as f32 + 0.15);
            let nearest = points.iter().map(|p| p.distance(at)).fold(f32::INFINITY, f32::min);
            assert!(nearest < 0.6, "no probe within two voxels of {at}: {nearest}");
        }
    }
}

/// Points inside a closed block are left out and counted, others stay, in their order, each once; and what is too many is thinned so that the rest
/// stays spread out.
#[test]
fn points_inside_something_are_left_out() {
    let mut world = lit_room();
    for mut side in room([0.4, 0.4, 0.4], 0) {
        // (The room's walls look inwards, a block's outwards.)
        side.triangles.iter_mut().for_each(|triangle| triangle.swap(1, 2));
        side.normals.clear();
        world.meshes.push(side);
        world.instances.push(lucerna::scene::Instance {
            mesh: world.meshes.len() - 1,
            world_from_object: glam::Affine3A::from_translation(Vec3::new(0.8, 0.2, 1.0)),
        });
    }
    let world = upload(&world);
    let inside = [Vec3::new(1.0, 0.4, 1.2), Vec3::new(0.85, 0.25, 1.05)];
    let outside = [
        Vec3::new(0.3, 0.5, 0.5),
        Vec3::new(1.6, 0.8, 2.5),
        Vec3::new(1.0, 0.1, 0.3),
        Vec3::new(0.2, 0.9, 2.8),
    ];
    let behind = [Vec3::new(-0.1, 0.5, 1.5)];
    let all = [outside.as_slice(), &inside, &behind, &outside[..2]].concat();
    let rule = NetRule::Points(all);
    let made = place_net(gpu(), &world, &settings!(NetSettings { rule, fills: false })).unwrap();
    assert_eq!((made.n_inside, made.net.n_duplicates()), (3, 2));
    assert_eq!(made.net.points(), outside);
    let rule = NetRule::Points(scattered(500));
    let made =
        place_net(gpu(), &world, &settings!(NetSettings { rule, most: 60, fills: false })).unwrap();
    assert_eq!(made.net.points().len(), 60);
    assert_eq!(made.n_inside + made.n_too_many, 440);
    // 60 balls whose centres are this far apart would fill more than the room, so the thinning is not far from the best.
    assert!(made.net.unit() > 0.25, "probes are {} m from each other", made.net.unit());
}

/// Where a cluster and a few far probes leave slivers, fillers take their place: fewer cells are slivers, all fillers are between the probes, no more than
/// are allowed. Without, nothing is added.
#[test]
fn fillers_take_the_place_of_slivers() {
    let world = upload(&lit_room());
    let mut random = Random(72);
    let cluster = (0..30).map(|_| Vec3::splat(0.5) + 0.05 * random.direction() * random.unit());
    let far = [[0.1, 0.1, 2.9], [1.9, 0.1, 2.8], [1.8, 0.9, 0.2], [0.2, 0.8, 2.7]].map(Vec3::from);
    let points: Vec<Vec3> = cluster.chain(far).collect();
    let make = |fills, most| {
        let rule = NetRule::Points(points.clone());
        place_net(gpu(), &world, &settings!(NetSettings { rule, fills, most })).unwrap()
    };
    let plain = make(false, 4096);
    assert_eq!((plain.n_fillers, plain.net.points()), (0, points.as_slice()));
    assert!(plain.n_slivers > 20, "slivers: {}", plain.n_slivers);
    let filled = make(true, 4096);
    assert!(filled.n_fillers > 10, "fillers: {}", filled.n_fillers);
    let share = |of: &PlacedNet| f64::from(of.n_slivers) / of.net.cells().len() as f64;
    assert!(
        share(&filled) < 0.5 * share(&plain),
        "slivers: {} of {} cells, without fillers {} of {}",
        filled.n_slivers,
        filled.net.cells().len(),
        plain.n_slivers,
        plain.net.cells().len()
    );
    let limited = make(true, 40);
    assert_eq!((limited.n_fillers, limited.net.points().len()), (6, 40));
}

/// Settings that make no sense are refused, points that are not finite as well; a scene without surfaces has no points of its own.
#[test]
fn wrong_nets_are_refused() {
    let world = upload(&lit_room());
    let error =
        |settings: NetSettings| place_net(gpu(), &world, &settings).unwrap_err().to_string();
    for (settings, part) in [
        (settings!(NetSettings { spacing: -1.0 }), "spacing"),
        (settings!(NetSettings { spacing: f32::NAN }), "spacing"),
        (settings!(NetSettings { spacing: 1e-3 }), "use a spacing of 0.01"),
        (settings!(NetSettings { most: 0 }), "room"),
        (settings!(NetSettings { rule: NetRule::Ground { height: 0.0 } }), "height"),
        (settings!(NetSettings { rule: NetRule::Points(vec![Vec3::NAN]) }), "not finite"),
    ] {
        let text = error(settings.clone());
        assert!(text.contains(part), "{settings:?}: `{text}`, expected one with `{part}`");
    }
    let empty = upload(&Scene::default());
    for rule in [NetRule::Surfaces, NetRule::Ground { height: 1.0 }, NetRule::Points(Vec::new())] {
        let made: Result<_, PlaceNetError> =
            place_net(gpu(), &empty, &settings!(NetSettings { rule }));
        let mut session = session(&empty, made.unwrap().net, few(64));
        assert_eq!(session.mean(&empty, 1, Channel::Indirect), DVec3::ZERO, "light of no probes");
    }
}

/// A net is kept: its file has its points and light, and its picture is the picture of the probes that wrote it. A file with a point less, or one that
/// is not finite, is refused.
#[test]
fn a_file_keeps_a_net() {
    let room = lit_room();
    let world = upload(&room);
    let net = placed(&world, NetRule::Points(scattered(30))).net;
    let mut live = session(&world, net.clone(), few(128));
    live.run(&world, 2);
    let expected = live.picture(&world, 1, Channel::Indirect);
    let made = read_probes(gpu(), live.technique.probes(), fingerprint(&room)).unwrap();
    assert_eq!(made.layout, BakedLayout::Net { points: net.points().to_vec() });
    assert_eq!(made.positions(), net.points());
    let found = ProbeBake::from_bytes(&made.to_bytes()).unwrap();
    assert_eq!(found, ProbeBake { settings: found.settings, ..made.clone() });
    let points = Some(net.points());
    assert!(found.is_lit_like(&few(256), points) && !found.is_lit_like(&few(256), None));
    let technique =
        ProbeVolume::from_bakes(gpu(), &world, ProbeVolumeSettings::default(), &[&found]).unwrap();
    let mut baked = Session::of(&world, &eye(), technique);
    assert_eq!(baked.picture(&world, 1, Channel::Indirect), expected, "a picture from the file");
    // 128 paths and 128 more are 256.
    let mut longer = Probes::placed_as(gpu(), &world, few(256), &found, true).unwrap();
    follow(&mut longer, &world);
    let mut whole = Probes::on_net(gpu(), &world, few(256), net).unwrap();
    follow(&mut whole, &world);
    let [a, b] =
        [&longer, &whole].map(|of| read_probes(gpu(), of, fingerprint(&room)).unwrap().to_bytes());
    assert!(a == b, "a bake of a net that goes on differs");
    let json: serde_json::Value = serde_json::from_str(&made.to_json()).unwrap();
    let at = json["probes"][3]["position"][1].as_f64().unwrap() as f32;
    assert_eq!(at, made.positions()[3].y);

    let mut wrong = made.clone();
    wrong.layout = BakedLayout::Net { points: vec![Vec3::INFINITY; wrong.probes.len()] };
    let error = ProbeBake::from_bytes(&wrong.to_bytes()).unwrap_err().to_string();
    assert!(error.contains("point 0 is not finite"), "{error}");
    wrong.layout = BakedLayout::Net { points: vec![Vec3::ONE; wrong.probes.len() - 1] };
    let error = ProbeBake::from_bytes(&wrong.to_bytes()).unwrap_err().to_string();
    assert!(error.contains("truncated"), "{error}");
    // Points that are no net's, because they are at the same place.
    wrong.layout = BakedLayout::Net { points: vec![Vec3::ONE; wrong.probes.len()] };
    let settings = ProbeVolumeSettings::default();
    let error = ProbeVolume::from_bakes(gpu(), &world, settings, &[&wrong]).unwrap_err();
    assert!(error.to_string().contains("make no net"), "{error}");
}

/// Light that changes is gathered anew; when surfaces move, points stay, how far they see is found anew, and it is told.
#[test]
fn a_net_notices_changes() {
    let world = upload(&lit_room());
    let dark = upload(&Scene { lights: Vec::<Light>::new(), ..lit_room() });
    let net = placed(&world, NetRule::Points(scattered(30))).net;
    let moved = |session: &Session<_>| stat(session, "surfaces have moved since the net was made");
    let mut session = session(&world, net, few(128));
    session.run(&world, 2);
    assert!(session.mean(&world, 1, Channel::Indirect).min_element() > 0.0);
    session.changed(Change::Lights);
    assert_eq!(session.mean(&dark, 1, Channel::Indirect), DVec3::ZERO, "light without lights");
    assert_eq!(moved(&session), 0, "after a change of lights");
    session.changed(Change::Geometry);
    session.run(&world, 1);
    assert_eq!(moved(&session), 1, "after a change of surfaces");
    for view in ["irradiance", "weight", "probes"] {
        session.passes.debug_view = Some(view.into());
        let shown = session.mean(&world, 2, Channel::Indirect);
        assert!(shown.min_element() > 0.0, "{view} shows {shown}");
    }
    submit(|recorder| session.technique.probes_mut().update(recorder, &world)).unwrap();
}

/// Points far from a cluster: their distances are more units than halfs can hold the squares of. They end before, so no light is lost, and the bake
/// can be read.
#[test]
fn far_points_are_no_infinities() {
    let mut room = lit_room();
    for instance in &mut room.instances {
        instance.world_from_object =
            glam::Affine3A::from_scale(Vec3::splat(40.0)) * instance.world_from_object;
    }
    room.lights[0] = Light::Point {
        position: Vec3::new(44.0, 32.0, 52.0),
        intensity: Vec3::splat(1000.0),
        range: None,
    };
    let world = upload(&room);
    let mut random = Random(73);
    let cluster = (0..60).map(|_| Vec3::splat(20.0) + 0.05 * random.direction() * random.unit());
    let far = [[2.0, 2.0, 110.0], [75.0, 3.0, 100.0], [70.0, 35.0, 8.0], [8.0, 30.0, 100.0]];
    let points: Vec<Vec3> = cluster.chain(far.map(Vec3::from)).collect();
    let mut session = session(&world, ProbeNet::new(&points).unwrap(), few(256));
    session.camera = crate::session::camera([30.0, 20.0, 30.0], [40.0, 10.0, 70.0]);
    session.run(&world, 4);
    let picture = session.picture(&world, 1, Channel::Indirect);
    let n_lit = picture.iter().filter(|rgb| rgb.min_element() > 0.0 && rgb.is_finite()).count();
    assert_eq!(n_lit, picture.len(), "lit pixels");
    let made = read_probes(gpu(), session.technique.probes(), fingerprint(&room)).unwrap();
    ProbeBake::from_bytes(&made.to_bytes()).unwrap();
}
