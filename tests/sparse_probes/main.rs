// SPDX-License-Identifier: MIT OR Apache-2.0
//! The technique `sparse-probes` as a whole: bakes, their files, and pictures against closed forms, the path tracer and itself.

mod files;
#[allow(dead_code)]
#[path = "../kernels/harness.rs"]
mod harness;
mod lightmap;
mod objects;
mod seams;
#[allow(dead_code)]
#[path = "../voxel_rt/session.rs"]
mod session;
#[path = "../voxel_rt/settling.rs"]
mod settling;
#[allow(dead_code)]
#[path = "../reference/support.rs"]
mod support;
mod texels;
#[allow(dead_code)]
#[path = "../voxel_rt/walls.rs"]
mod walls;

use crate::harness::{KeepNan, Largest, assert_each, gpu};
use crate::session::{Session, camera, lit_room, upload};
use crate::support::{floor, lambert, room, scene};
use glam::{DVec3, Vec3};
use lucerna::blocking::{SparseScene, bake_sparse_probes, plan_sparse_probes};
use lucerna::components::LightVisibility;
use lucerna::components::sparse_probes::{
    Numbers, Sight, SparseBake, SparseLook, SparseSettings, SparseSurfaces, Support,
};
use lucerna::gpu_scene::{GpuScene, WorldTriangles};
use lucerna::scene::{Camera, Light, Material, Scene, SceneFingerprint};
use lucerna::seam::{Change, StaticMesh};
use lucerna::settings;
use lucerna::techniques::Technique;
use lucerna::techniques::reference::Channel;
use lucerna::techniques::sparse_probes::{SparseProbesSettings, SparseProbesTechnique};
use lucerna::testing::{House, room_with_table};

/// A small bake.
fn small() -> SparseSettings {
    settings!(SparseSettings { n_probes: 16, n_texels: 600, n_rays: 256, ..Default::default() })
}

/// The meshes of a scene, with what bakes know it by.
fn meshes_of(scene: &Scene) -> (Vec<StaticMesh>, SceneFingerprint) {
    let meshes = WorldTriangles::of(scene).static_meshes(scene);
    (meshes, SceneFingerprint::of(scene, true, &|_| false))
}

/// A bake of a scene, before transport. `placed`: where its probes are.
fn begun(
    scene: &Scene,
    world: &GpuScene,
    settings: SparseSettings,
    placed: Option<&[Vec3]>,
) -> SparseBake {
    let (meshes, fingerprint) = meshes_of(scene);
    let of =
        SparseScene { seam: world, meshes: &meshes, order: world.triangle_order(), fingerprint };
    let plan = plan_sparse_probes(gpu(), &of, settings, placed, &mut Vec::new(), &|_| true);
    SparseBake::begun(plan.unwrap(), [0, 1])
}

/// Computes what is missing.
fn filled(scene: &Scene, world: &GpuScene, mut bake: SparseBake) -> SparseBake {
    let (meshes, fingerprint) = meshes_of(scene);
    let of =
        SparseScene { seam: world, meshes: &meshes, order: world.triangle_order(), fingerprint };
    bake_sparse_probes(gpu(), &of, &mut bake, |_, _| Ok(()), |_| true).unwrap();
    bake
}

fn baked(scene: &Scene, world: &GpuScene, settings: SparseSettings) -> SparseBake {
    filled(scene, world, begun(scene, world, settings, None))
}

fn with_look(world: &GpuScene, bake: &SparseBake, look: SparseLook) -> SparseProbesTechnique {
    let settings = SparseProbesSettings { look, ..Default::default() };
    let order = world.triangle_order();
    SparseProbesTechnique::new(gpu(), world, bake, order, settings, &LightVisibility::rays())
        .unwrap()
}

fn session(world: &GpuScene, camera: &Camera, bake: &SparseBake) -> Session<SparseProbesTechnique> {
    Session::of(world, camera, with_look(world, bake, SparseLook::default()))
}

fn eye() -> Camera {
    camera([0.7, 0.6, 0.4], [1.0, 0.4, 1.4])
}

/// The white furnace: a closed box whose walls emit L_e and reflect ρ. Indirect light is L_e·ρ²/(1 − ρ) everywhere, whatever probes see; feedback brings
/// it within 400 frames at ρ = 0.95 (0.95⁴⁰⁰ = 10⁻⁹) and 80 at ρ = 0.5, and stays there. Each pixel
/// within 3 %, their mean within 1 %: emissive walls are sampled 64 times for each texel.
#[test]
fn the_furnace_is_white() {
    let emission = Vec3::new(0.7, 1.0, 0.25);
    for (albedo, settings) in [
        (0.5, small()),
        (0.5, settings!(SparseSettings { order: 0, ..small() })),
        (0.5, settings!(SparseSettings { order: 7, sight: Sight::Rays, ..small() })),
        (0.5, settings!(SparseSettings { n_probes: 1, ..small() })),
        (0.5, settings!(SparseSettings { support: Support::Even, n_vectors: 8, ..small() })),
        (0.5, settings!(SparseSettings { numbers: Numbers::Bytes, radiance: 2, ..small() })),
        (0.95, small()),
    ] {
        let material = Material { emission, ..lambert([albedo; 3]) };
        let scene = scene(room([2.0, 1.0, 3.0], 0), vec![material]);
        let world = upload(&scene);
        let bake = baked(&scene, &world, settings);
        let mut session = session(&world, &eye(), &bake);
        session.run(&world, if albedo > 0.9 { 400 } else { 80 });
        let rho = f64::from(albedo);
        let expected = emission.as_dvec3() * rho * rho / (1.0 - rho);
        let picture = session.picture(&world, 4, Channel::Indirect);
        let apart = |found: DVec3| ((found - expected) / expected).largest();
        let mean = picture.iter().map(|p| p.as_dvec3()).sum::<DVec3>() / picture.len() as f64;
        let worst = picture.iter().map(|p| apart(p.as_dvec3())).fold(0.0, f64::max_nan);
        assert_eq!(bake.plan.n_unknown(), 0, "directions in which probes see no receiver");
        println!("albedo {albedo}, {settings:?}: mean off by {}, a pixel by {worst}", apart(mean));
        // (Bytes round by 1/254 of a vector's largest number.)
        let limit = if settings.numbers == Numbers::Bytes { 0.015 } else { 0.01 };
        assert!(
            apart(mean) < limit && worst < 0.03,
            "albedo {albedo}, {settings:?}: mean {mean}, expected {expected} within {limit}; a pixel is off by {worst}, expected below 0.03"
        );
    }
}

/// A room with a lamp, and with another one.
fn lamps(lit: [bool; 2]) -> Scene {
    let mut world = lit_room();
    world.lights.clear();
    for (position, is_lit) in [([1.1, 0.8, 1.3], lit[0]), ([0.3, 0.3, 2.5], lit[1])] {
        let intensity = if is_lit { Vec3::new(1.0, 0.6, 0.3) } else { Vec3::ZERO };
        world.lights.push(Light::Point { position: position.into(), intensity, range: None });
    }
    world
}

/// One bake serves any lights: light of two lamps is that of each, added up; a lamp that moves needs no bake; and once all are off, feedback fades.
#[test]
fn lights_add_up_move_and_go_out() {
    let scenes = [[true, false], [false, true], [true, true], [false, false]].map(lamps);
    let worlds: Vec<GpuScene> = scenes.iter().map(upload).collect();
    let bake = baked(&scenes[0], &worlds[0], small());
    let pictures: Vec<Vec<Vec3>> = worlds[..3]
        .iter()
        .map(|world| {
            let mut session = session(world, &eye(), &bake);
            session.run(world, 40);
            session.picture(world, 1, Channel::Indirect)
        })
        .collect();
    let sums: Vec<[Vec3; 2]> = (0..pictures[0].len())
        .map(|ix| [pictures[2][ix], pictures[0][ix] + pictures[1][ix]])
        .collect();
    // (Irradiance below 0 is cut off, which is not linear, but does not happen here; halfs of the lightmap are off by 1/1024.)
    assert_each(
        "light of both lamps, and of each",
        &sums,
        "the same within 0.5 %",
        |[both, sum]| (*both - *sum).abs().max_element() < 5e-3 * sum.max_element(),
    );
    let mut session = session(&worlds[0], &eye(), &bake);
    session.run(&worlds[0], 40);
    session.changed(Change::Lights);
    session.run(&worlds[1], 40);
    let moved = session.picture(&worlds[1], 1, Channel::Indirect);
    let two: Vec<[Vec3; 2]> =
        moved.iter().copied().zip(pictures[1].iter().copied()).map(|(a, b)| [a, b]).collect();
    assert_each(
        "light after the lamp has moved, and of the lamp there",
        &two,
        "the same within 0.5 %",
        |[a, b]| (*a - *b).abs().max_element() < 5e-3 * b.max_element(),
    );
    session.changed(Change::Lights);
    session.run(&worlds[3], 3);
    let fading = session.mean(&worlds[3], 1, Channel::Indirect).max_element();
    session.run(&worlds[3], 60);
    let off = session.mean(&worlds[3], 1, Channel::Indirect).max_element();
    assert!(
        fading > 0.0 && off < 1e-4 * fading,
        "{fading} soon after the lamps went out, then {off}"
    );
}

/// Texels hold any light: of a lamp that is ten million times as bright as any that was there when the technique was made, there is ten million times as
/// much. (Halfs end at 65 504; texels are off by 1/1024.)
#[test]
fn lamps_may_become_bright() {
    let (scene, dark) = (lamps([true, false]), lamps([false, false]));
    let mut bright = scene.clone();
    for light in &mut bright.lights {
        if let Light::Point { intensity, .. } = light {
            *intensity *= 1e7;
        }
    }
    let [world, dark, bright] = [&scene, &dark, &bright].map(upload);
    let bake = baked(&scene, &world, small());
    let mut session = session(&dark, &eye(), &bake);
    session.run(&dark, 2);
    let mut light_of = |world: &GpuScene| {
        session.changed(Change::Lights);
        session.run(world, 40);
        session.mean(world, 1, Channel::Indirect)
    };
    let usual = light_of(&world);
    let ratio = light_of(&bright) / usual * 1e-7;
    assert!((ratio - 1.0).largest() < 5e-3, "of 1e7 times the light, {ratio} times that is found");
    // What the bright lamp has left is forgotten: by reflections alone, a thousandth of it would be there after these frames.
    session.changed(Change::Lights);
    session.run(&world, 12);
    let ratio = session.mean(&world, 1, Channel::Indirect) / usual;
    assert!((ratio - 1.0).largest() < 5e-3, "after the bright lamp, {ratio} times the usual light");
}

/// With one of four probes a frame, light arrives later, and is the same.
#[test]
fn staggered_probes_arrive() {
    let scene = lamps([true, true]);
    let world = upload(&scene);
    let bake = baked(&scene, &world, small());
    let [all, some] = [1, 4].map(|update_every| {
        let look = settings!(SparseLook { update_every, ..Default::default() });
        let mut session = Session::of(&world, &eye(), with_look(&world, &bake, look));
        session.run(&world, 2);
        let early = session.mean(&world, 1, Channel::Indirect).element_sum();
        session.run(&world, 160);
        (early, session.mean(&world, 1, Channel::Indirect).element_sum())
    });
    assert!(
        some.0 < 0.9 * all.0,
        "after three frames: {} with a quarter of the probes a frame, {} with all",
        some.0,
        all.0
    );
    assert!((some.1 / all.1 - 1.0).abs() < 1e-3, "in the end {} and {}", some.1, all.1);
}

/// Without probes, and of texels that see none, there is no indirect light, and nothing that is not finite; one probe lights what it sees.
#[test]
fn few_probes() {
    let scene = lamps([true, false]);
    let world = upload(&scene);
    for (n_probes, cluster_size) in [(0, 1024), (1, 1024), (3, 1)] {
        let settings =
            settings!(SparseSettings { n_probes, cluster_size, n_texels: 100, ..small() });
        // (The setting 0 chooses their number; an empty list has none.)
        let placed: Option<&[Vec3]> = (n_probes == 0).then_some(&[]);
        let bake = filled(&scene, &world, begun(&scene, &world, settings, placed));
        assert_eq!(bake.plan.probes.len(), n_probes as usize, "probes");
        if cluster_size == 1 {
            assert_eq!(bake.plan.n_clusters(), bake.plan.receivers.len(), "clusters of one");
        }
        let mut session = session(&world, &eye(), &bake);
        session.run(&world, 20);
        let mean = session.mean(&world, 1, Channel::Indirect);
        let expected = n_probes > 0;
        assert!(
            mean.is_finite() && (mean.min_element() > 0.0) == expected,
            "{n_probes} probes: {mean}"
        );
        let says: Vec<String> = session.technique.notices().into_iter().map(|of| of.text).collect();
        let blind = says.iter().any(|text| text.contains("are inside of something"));
        assert!(blind || expected, "{n_probes} probes: {says:?}");
    }
    // A place that no probe sees: under a plate.
    let plate = floor(0.4, 0.02, 0);
    let mut covered = lamps([true, false]);
    covered.meshes.push(plate);
    let mut instance = covered.instances[0].clone();
    instance.mesh = covered.meshes.len() - 1;
    instance.world_from_object = glam::Affine3A::from_translation(Vec3::new(1.0, 0.0, 1.5));
    covered.instances.push(instance);
    let world = upload(&covered);
    let bake = baked(&covered, &world, small());
    let n_blind: u32 = bake.clusters.iter().map(|of| of.n_hidden).sum();
    assert!(n_blind > 0, "no texel under the plate is hidden");
    let mut session = session(&world, &eye(), &bake);
    session.run(&world, 20);
    let picture = session.picture(&world, 1, Channel::Indirect);
    assert!(picture.iter().all(|pixel| pixel.is_finite()), "light that is not finite");
}

/// If no number of probes is chosen, it follows the scene: one room of 2 × 1 × 3 m, in which surfaces see each other 4 V/S = 1.1 m far in the mean, has few;
/// 16 rooms have more, for no probe sees into another room.
#[test]
fn as_many_probes_as_it_takes() {
    let n_probes = |n: u32| {
        let one = |ix: u32| {
            let by = Vec3::new(2.001 * (ix % 4) as f32, 0.0, 3.001 * (ix / 4) as f32);
            let mut walls = room([2.0, 1.0, 3.0], 0);
            walls.iter_mut().flat_map(|of| &mut of.positions).for_each(|at| *at += by);
            walls
        };
        let scene = scene((0..n).flat_map(one).collect(), vec![lambert([0.5; 3])]);
        let world = upload(&scene);
        let settings =
            settings!(SparseSettings { n_probes: 0, n_texels: 200 * n, order: 0, ..small() });
        let plan = begun(&scene, &world, settings, None).plan;
        // (The rooms' outsides see each other as well, at other distances.)
        assert!(plan.radius <= 1.3, "{n} rooms: a radius of {} m", plan.radius);
        plan.probes.len()
    };
    let found = [1, 16].map(n_probes);
    let is_right = found[0] <= 64 && (96..=512).contains(&found[1]);
    assert!(is_right, "probes in 1 and 16 rooms: {found:?}");
}

/// Given probes are used where they are free, and moved nowhere.
#[test]
fn given_probes() {
    let scene = lamps([true, false]);
    let world = upload(&scene);
    let points = [Vec3::new(0.5, 0.5, 0.5), Vec3::new(1.5, 0.5, 2.5), Vec3::new(9.0, 0.5, 0.5)];
    let bake = begun(&scene, &world, small(), Some(&points));
    // (The third is outside, behind a wall of one side.)
    assert_eq!(bake.plan.probes, points[..2], "probes");
    assert_ne!(bake.plan.placed, 0, "places are known to be given");
    // An unfinished bake goes on only with the same places.
    let (_, fingerprint) = meshes_of(&scene);
    let goes_on = |points| bake.goes_on_as(&fingerprint, &small(), [0, 1], points);
    let same = [Some(&points[..]), Some(&points[..2]), None].map(goes_on);
    assert_eq!(same, [true, false, false], "goes on with the same places, others, none");
}

/// It says how much light is on its way. One bake serves rooms of any albedo: it knows where light goes, not what surfaces reflect.
mod that_settles {
    use super::{baked, session, small, upload};
    use crate::settling::{a_warm_up_ends_when_it_may, lit, what_is_told_arrives};
    use lucerna::components::sparse_probes::{SparseBake, SparseSettings};
    use lucerna::settings;

    fn bake() -> SparseBake {
        let scene = lit(0.5);
        let settings =
            settings!(SparseSettings { n_probes: 8, n_texels: 400, n_rays: 256, ..small() });
        baked(&scene, &upload(&scene), settings)
    }

    #[test]
    fn light_to_come() {
        let bake = bake();
        what_is_told_arrives(&|world, camera, _| session(world, camera, &bake));
    }

    #[test]
    fn warm_up() {
        let bake = bake();
        a_warm_up_ends_when_it_may(&|world, camera, _| session(world, camera, &bake));
    }
}

/// Whether a place is inside a [`House`] or a [`room_with_table`].
fn in_house(at: Vec3) -> bool {
    at.cmpgt(Vec3::ZERO).all() && at.cmplt(Vec3::new(8.0, 3.0, 4.0)).all()
}

/// Probes take light from receivers on their own side of a wall alone, however thin: here it is a tenth of a texel thick, and cuts through texels of all
/// surfaces around it.
#[test]
fn probes_see_their_side_of_walls() {
    for (seed, cell) in [(77, 0.2), (1, 0.1)] {
        let house = House::draw(seed, cell);
        let world = upload(&house.scene);
        let settings = settings!(SparseSettings { n_probes: 48, n_texels: 6000, ..small() });
        let (meshes, _) = meshes_of(&house.scene);
        let plan = begun(&house.scene, &world, settings, None).plan;
        let surfaces = SparseSurfaces::new(&meshes, plan.size, &plan.corners);
        let off = |at: Vec3| house.normal.dot(at - house.through);
        let n_each = plan.settings.n_directions as usize;
        let mut n_near = 0;
        for (ix, seen) in plan.seen.iter().enumerate() {
            let Some(receiver) = plan.receivers.get(*seen as usize) else { continue };
            // (Outside of the house, no wall is in the way.)
            let Some(probe) = Some(plan.probes[ix / n_each]).filter(|at| in_house(*at)) else {
                continue;
            };
            let [probe, there] = [probe, surfaces.position(receiver)].map(off);
            n_near += usize::from(there.abs() < 0.5 * cell);
            assert!(
                probe * there > 0.0 || there.abs() <= 0.5 * house.thickness + 1e-4,
                "house {seed}: a probe {probe} m off the wall takes light from {there} m"
            );
        }
        assert!(n_near > 500, "{n_near} directions to receivers beside the wall");
    }
}

/// Each receiver has two probes at least that see it: those inside of a table are near to it, but do not help. (From above a table's top, all of the room
/// above it is seen.)
#[test]
fn enough_probes_see_each_receiver() {
    let (top, thickness) = (1.1, 0.5);
    let scene = room_with_table(top, thickness, true, 1);
    let world = upload(&scene);
    for (radius, n_probes) in [(0.0, 128), (0.3, 64)] {
        let settings =
            settings!(SparseSettings { radius, n_probes, n_texels: 8000, order: 1, ..small() });
        let plan = begun(&scene, &world, settings, None).plan;
        let (meshes, _) = meshes_of(&scene);
        let surfaces = SparseSurfaces::new(&meshes, plan.size, &plan.corners);
        let above = |ix: &u32| {
            let at = plan.probes[*ix as usize];
            in_house(at) && at.y > top
        };
        let mut n = 0;
        for (receiver, radius) in plan.receivers.iter().zip(&plan.radii) {
            let (at, normal) = (surfaces.position(receiver), surfaces.normal(receiver));
            if (at.y - top).abs() > 1e-4 || normal.y < 0.9 || !in_house(at) {
                continue;
            }
            let near = plan.near(at, *radius);
            let n_seeing = near.iter().filter(|(ix, _)| above(ix)).count();
            assert!(n_seeing >= 2, "{n_seeing} of {} probes see the top at {at}", near.len());
            n += 1;
        }
        assert!(n > 100, "{n} receivers on the table");
    }
}

/// A receiver is lit at four points, one in each quarter of its texel; where it has less of the texel, at points that are its own.
#[test]
fn receivers_are_lit_all_over() {
    let house = House::draw(77, 0.2);
    let world = upload(&house.scene);
    let settings = settings!(SparseSettings { n_probes: 8, n_texels: 3000, ..small() });
    let plan = begun(&house.scene, &world, settings, None).plan;
    let (meshes, _) = meshes_of(&house.scene);
    let surfaces = SparseSurfaces::new(&meshes, plan.size, &plan.corners);
    let (mut n_whole, mut n_part) = (0, 0);
    for (receiver, reach) in plan.receivers.iter().zip(&plan.reach) {
        let points = surfaces.lit_points(receiver, *reach);
        let own = (receiver.triangle, receiver.weights);
        assert_eq!((points[0].triangle, points[0].weights), own, "the first one");
        let within = surfaces.points_within(receiver, *reach);
        assert!(points[1..].iter().all(|of| *of == points[0] || within.contains(of)), "own points");
        if within.len() < 16 {
            n_part += 1;
            continue;
        }
        n_whole += 1;
        let quarter = |of: &lucerna::components::lightmap::SurfacePoint| {
            let corners = plan.corners[of.triangle as usize].map(|at| at.as_dvec2());
            let weights = of.weights_of_corners();
            let at = (0..3).map(|k| weights[k] * corners[k]).sum::<glam::DVec2>();
            let [x, y] = at.fract().to_array().map(|x| usize::from(x >= 0.5));
            2 * y + x
        };
        let mut quarters = points.each_ref().map(quarter);
        quarters.sort_unstable();
        assert_eq!(quarters, [0, 1, 2, 3], "quarters of {receiver:?}");
    }
    assert!(n_whole > 1000 && n_part > 100, "{n_whole} whole texels, {n_part} others");
}

/// Of the lit part's light, the dark part of houses with a wall at any angle has nothing: receivers know what they see. The worst at most 1 %.
#[test]
fn no_light_leaks_through_walls_at_any_angle() {
    let settings =
        settings!(SparseSettings { n_probes: 48, n_texels: 6000, n_rays: 128, ..small() });
    let found = walls::leaks(
        &|world, camera, scene| session(world, camera, &baked(scene, world, settings)),
        32,
    );
    walls::assert_leaks(found, 0.01, 0.002);
}

/// Within 3 % of the path tracer. (Noise of the path tracer is 0.4 %.)
#[test]
fn thin_tables_are_lit_at_every_height() {
    let settings = settings!(SparseSettings { n_probes: 128, n_texels: 8000, order: 7, ..small() });
    let make = |world: &GpuScene, camera: &Camera, scene: &Scene| {
        session(world, camera, &baked(scene, world, settings))
    };
    let ratios = walls::lights_on_tables(&make, 32, 4);
    assert_each("light on tables by the path tracer's", &ratios, "1 within 0.03", |ratio| {
        (ratio - 1.0).abs() < 0.03
    });
}
