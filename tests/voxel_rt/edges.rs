// SPDX-License-Identifier: MIT OR Apache-2.0
//! What a technique meets at the ends of its range.

use crate::furnace::EMISSION;
use crate::harness::{KeepNan, assert_each, differing_bytes, gpu, read};
use crate::leaks::{Between, dark_over_lit, divided_room};
use crate::session::{SIDE, Session, camera, lit_room, upload};
use crate::support::{lambert, room, scene};
use glam::{Affine3A, UVec2, Vec3, Vec4};
use lucerna::components::voxel_light::{Bounces, DirectLight, Levels, RaysInjected, WriteStrategy};
use lucerna::scene::{Light, Material, Scene};
use lucerna::seam::Change;
use lucerna::settings;
use lucerna::techniques::TechniqueError;
use lucerna::techniques::reference::{Channel, ReferenceSettings, resolve};
use lucerna::techniques::voxel_rt::{Lookup, VoxelRt, VoxelRtSettings};

fn small(resolution: u32) -> VoxelRtSettings {
    settings!(VoxelRtSettings { resolution, ..Default::default() })
}

fn eye() -> lucerna::scene::Camera {
    camera([0.7, 0.6, 0.4], [1.0, 0.4, 1.4])
}

#[test]
fn the_same_input_gives_the_same_bytes() {
    let world = upload(&lit_room());
    let run = || Session::new(&world, &eye(), small(20)).run(&world, 12);
    let (first, second) = (run(), run());
    let [a, b] = [&first, &second].map(|sums| bytemuck::cast_slice::<_, u8>(sums));
    assert!(a == b, "sums of two runs: {}", differing_bytes(b, a));
    let lit = first.iter().filter(|pixel| pixel.indirect != Vec3::ZERO).count();
    assert!(
        lit > first.len() / 2,
        "{lit} of {} pixels have indirect light, expected above half",
        first.len()
    );
}

/// Grids of one voxel, of sizes that are multiples of nothing, and as fine as they get for the room.
#[test]
fn any_resolution_gives_finite_light() {
    let world = upload(&lit_room());
    for resolution in [1, 2, 3, 13, 37] {
        let mut session = Session::new(&world, &eye(), small(resolution));
        session.run(&world, 12);
        let mean = session.mean(&world, 4, Channel::Indirect);
        // A voxel as large as the room is met from outside alone, where it is dark.
        let lit = resolution == 1 || mean.min_element() > 0.0;
        assert!(
            mean.is_finite() && lit,
            "{resolution} voxels: mean indirect light is {mean}, expected finite, and above 0 with more than 1 voxel"
        );
        let counts: Vec<u32> =
            bytemuck::pod_collect_to_vec(&read(&session.technique.buffers().counts[0]));
        assert!(
            counts[0] > 0 && counts[1] == 0,
            "{resolution} voxels: {} are made and {} left out, expected some and none",
            counts[0],
            counts[1]
        );
    }
}

#[test]
fn without_lights_it_stays_dark() {
    let world = upload(&Scene { lights: Vec::new(), ..lit_room() });
    let pixels = Session::new(&world, &eye(), small(16)).run(&world, 6);
    assert_each(
        "sums of pixels without lights",
        &pixels,
        "without indirect light and rejected samples",
        |pixel| pixel.indirect == Vec3::ZERO && pixel.n_rejected == 0,
    );
}

#[test]
fn an_empty_scene_is_empty() {
    let world = upload(&Scene::default());
    let mut session = Session::new(&world, &eye(), small(16));
    let pixels = session.run(&world, 3);
    assert_each(
        "sums of pixels of an empty scene",
        &pixels,
        "without indirect light and surfaces",
        |pixel| pixel.indirect == Vec3::ZERO && pixel.n_surfaces == 0,
    );
    let counts: Vec<u32> =
        bytemuck::pod_collect_to_vec(&read(&session.technique.buffers().counts[0]));
    assert_eq!(counts[..2], [0, 0], "voxels made and left out of an empty scene");
}

/// Every source of light and every strategy of writing lights the room. The exact mean of the light's rays
/// agrees with what the faces find themselves within 10 %: brighter parts of a voxel get more rays (found:
/// 1.08 with 16 voxels along the room). The camera leaves dark what it does not see.
#[test]
fn every_way_of_injecting_lights_the_room() {
    let world = upload(&lit_room());
    let mean = |direct| {
        let mut session =
            Session::new(&world, &eye(), settings!(VoxelRtSettings { direct, ..small(16) }));
        session.run(&world, 24);
        session.mean(&world, 8, Channel::Indirect).y
    };
    let own = mean(DirectLight::PerFace);
    for strategy in WriteStrategy::ALL {
        let rays = lucerna::settings!(RaysInjected { n_rays: 64, strategy });
        let lights = mean(DirectLight::FromLights(rays)) / own;
        let camera = mean(DirectLight::FromCamera(rays)) / own;
        eprintln!("{strategy:?}: from the lights {lights}, from the camera {camera}");
        assert!(
            camera > 0.2 && camera < lights,
            "{strategy:?}: mean indirect light injected from the camera is {camera} of the faces' own, expected above 0.2 and below the {lights} from the lights"
        );
        match strategy {
            WriteStrategy::Exact => assert!(
                (lights - 1.0).abs() < 0.1,
                "{strategy:?}: mean indirect light injected from the lights is {lights} of the faces' own, expected 1 within 0.1"
            ),
            // 8 bits, of the light at an eighth of the diagonal; and Max takes the largest.
            _ => assert!(
                lights > 0.5 && lights < 2.0,
                "{strategy:?}: mean indirect light injected from the lights is {lights} of the faces' own, expected 0.5 to 2"
            ),
        }
    }
}

/// The grid stands where the scene was when the technique was made. A scene that has left it has no voxels and
/// no indirect light; back again, it has what it had.
#[test]
fn a_scene_outside_the_grid_is_dark() {
    let inside = lit_room();
    let mut outside = inside.clone();
    let away = Affine3A::from_translation(Vec3::X * 50.0);
    outside.instances.iter_mut().for_each(|i| i.world_from_object = away * i.world_from_object);
    for light in &mut outside.lights {
        let Light::Point { position, .. } = light else { panic!("a point light") };
        position.x += 50.0;
    }
    let (inside, outside) = (upload(&inside), upload(&outside));
    let n_voxels = |session: &Session<VoxelRt>| {
        let counts = &session.technique.buffers().counts[0];
        bytemuck::pod_collect_to_vec::<_, u32>(&read(counts))[0]
    };
    let settings = settings!(VoxelRtSettings { points_per_face: 4, ..small(16) });
    let mut session = Session::new(&inside, &eye(), settings);
    session.run(&inside, 32);
    let before = session.mean(&inside, 16, Channel::Indirect).y;
    assert!(
        before > 0.0 && n_voxels(&session) > 0,
        "inside the grid: mean indirect light is {before}, of {} voxels, expected both above 0",
        n_voxels(&session)
    );
    session.camera.position.x += 50.0;
    session.changed(Change::Geometry);
    let pixels = session.run(&outside, 4);
    assert_each(
        "sums of pixels outside the grid",
        &pixels,
        "of surfaces without indirect light",
        |pixel| pixel.indirect == Vec3::ZERO && pixel.n_surfaces > 0,
    );
    assert_eq!(n_voxels(&session), 0, "voxels of a scene outside the grid");
    session.camera.position.x -= 50.0;
    session.changed(Change::Geometry);
    session.run(&inside, 32);
    let after = session.mean(&inside, 16, Channel::Indirect).y;
    eprintln!("back in the grid: {after} for {before}");
    assert!(
        (after / before - 1.0).abs() < 0.05,
        "mean indirect light back in the grid is {after}, expected {before} within 5 %"
    );
}

/// A light of no number is left out and counted, and nothing of it stays.
#[test]
fn what_is_not_finite_is_counted_and_left_out() {
    let mut world = lit_room();
    world.lights.push(Light::Point {
        position: Vec3::new(0.5, 0.5, 0.5),
        intensity: Vec3::splat(f32::INFINITY),
        range: None,
    });
    let world = upload(&world);
    let mut session = Session::new(&world, &eye(), small(16));
    let pixels = session.run(&world, 8);
    assert_each(
        "sums of pixels under an infinite light",
        &pixels,
        "of finite indirect light",
        |pixel| pixel.indirect.is_finite(),
    );
    let rejected: Vec<u32> =
        bytemuck::pod_collect_to_vec(&read(&session.technique.buffers().faults));
    assert!(
        rejected[0] > 0,
        "{} values under an infinite light are counted as rejected, expected some",
        rejected[0]
    );
}

#[test]
fn colors_of_no_number_do_no_harm() {
    let mut world = lit_room();
    for mesh in &mut world.meshes {
        mesh.colors = vec![Vec4::splat(f32::NAN); mesh.positions.len()];
    }
    let world = upload(&world);
    let pixels = Session::new(&world, &eye(), small(16)).run(&world, 6);
    assert_each(
        "sums of pixels with vertex colours of NaN",
        &pixels,
        "of finite indirect light",
        |pixel| pixel.indirect.is_finite(),
    );
}

#[test]
fn settings_out_of_range_are_refused() {
    let world = upload(&lit_room());
    let no_rays = DirectLight::FromCamera(lucerna::settings!(RaysInjected {
        n_rays: 0,
        strategy: WriteStrategy::Exact
    }));
    for settings in [
        settings!(VoxelRtSettings { resolution: 0, ..Default::default() }),
        settings!(VoxelRtSettings { resolution: 257, ..Default::default() }),
        settings!(VoxelRtSettings { levels: Levels::Nested(0), ..Default::default() }),
        settings!(VoxelRtSettings { levels: Levels::Nested(7), ..Default::default() }),
        settings!(VoxelRtSettings { points_per_face: 0, ..Default::default() }),
        settings!(VoxelRtSettings { max_rays: 0, ..Default::default() }),
        settings!(VoxelRtSettings { max_rays: 65537, ..Default::default() }),
        settings!(VoxelRtSettings { bounces: Bounces::UpTo(65), ..Default::default() }),
        settings!(VoxelRtSettings { direct: no_rays, ..Default::default() }),
    ] {
        let error = VoxelRt::new(gpu(), &world, settings, Vec3::ZERO).unwrap_err();
        assert!(
            matches!(error, TechniqueError::Setting { .. }),
            "{settings:?}: the error is `{error}`, expected one of the settings"
        );
    }
}

/// Plain trilinear look-ups darken where cells are empty (the source's dark streaks); valid ones give
/// the furnace's even light.
#[test]
fn valid_lookups_have_no_dark_streaks() {
    let material = Material { emission: EMISSION.into(), ..lambert([0.5; 3]) };
    let world = upload(&scene(room([2.0, 1.0, 3.0], 0), vec![material]));
    let darkest = |lookup| {
        let settings = settings!(VoxelRtSettings { lookup, points_per_face: 2, ..small(16) });
        let mut session = Session::new(&world, &eye(), settings);
        session.run(&world, 32);
        // ρ/π · E, E = π·L_e·ρ/(1 − ρ).
        let expected = EMISSION[1] * 0.5 * 0.5 / 0.5;
        let picture = session.picture(&world, 8, Channel::Indirect);
        picture.iter().map(|pixel| pixel.y / expected).fold(f32::MAX, f32::min_nan)
    };
    let (valid, plain, seven) =
        (darkest(Lookup::Valid), darkest(Lookup::Trilinear), darkest(Lookup::SevenTap));
    eprintln!("darkest pixel: valid {valid}, trilinear {plain}, seven taps {seven}");
    assert!(
        valid > 0.9,
        "the darkest pixel of valid look-ups is {valid:.3} of the truth, expected above 0.9"
    );
    assert!(
        plain < 0.7,
        "the darkest pixel of trilinear look-ups is {plain:.3} of the truth, expected below 0.7"
    );
}

fn leak(wall: [f32; 2], between: Between) -> f64 {
    let world = upload(&divided_room(wall, between));
    dark_over_lit(between, |camera| {
        let mut session = Session::new(&world, camera, small(32));
        session.run(&world, 48);
        session.mean(&world, 8, Channel::Indirect).x
    })
}

/// Of the lit room's light less than 2 % arrives behind what is `thick` voxels thick (a voxel is 4 m/29 =
/// 0.14 m), wherever it stands within its cell. Nothing at all should.
fn keeps_light_out(between: Between, thick: f32) {
    let voxel = 4.0 / 29.0;
    let leaks = [0.0, 0.2, 0.4, 0.6, 0.8].map(|shift| {
        let a = 2.0 + shift * voxel;
        leak([a, a + thick * voxel], between)
    });
    eprintln!("{between:?} of {thick} voxels: {leaks:.5?}");
    assert_each(
        &format!(
            "light behind {between:?} of {thick} voxels, relative to the lit room, at five places"
        ),
        &leaks,
        "below 0.02",
        |&leak| leak < 0.02,
    );
}

#[test]
fn thin_walls_keep_light_out() {
    keeps_light_out(Between::Wall, 0.3);
}

#[test]
fn sheets_keep_light_out() {
    keeps_light_out(Between::Wall, 0.0);
}

#[test]
fn corners_keep_light_out() {
    keeps_light_out(Between::Corner, 0.3);
}

/// And an open door lets through what the path tracer says, within 3 %: the rooms' corners are in the picture, where light is blurred
/// over a voxel.
#[test]
fn open_doors_let_light_in() {
    let wall = [2.0, 2.04];
    let leak = leak(wall, Between::Door);
    let world = upload(&divided_room(wall, Between::Door));
    let settings =
        settings!(ReferenceSettings { n_bounces: 16, ..crate::support::settings(SIDE, SIDE, 0) });
    let traced = dark_over_lit(Between::Door, |camera| {
        let sums = crate::support::render(&world, camera, &settings, 256);
        let picture = resolve(&sums, UVec2::splat(SIDE), Channel::Indirect).rgb;
        f64::from(picture.iter().map(|v| v.x).sum::<f32>()) / picture.len() as f64
    });
    eprintln!("through the door: {leak}, path tracer {traced}");
    assert!(
        (leak / traced - 1.0).abs() < 0.03,
        "light through the open door is {leak} of the lit room's, expected the path tracer's {traced} within 3 %"
    );
}
