// SPDX-License-Identifier: MIT OR Apache-2.0
//! What is recorded takes effect in its order, however it is cut into submissions; and what follows a change of the scene
//! follows by itself.

use crate::harness::{assert_each, differing_bytes, gpu, read, submit};
use crate::support::{emitter, floor, lambert, look_down, room, scene};
use crate::whole::{accumulated, read_texture};
use glam::{UVec2, Vec3};
use lucerna::components::LightVisibility;
use lucerna::components::shadow_maps::{ShadowMaps, ShadowSettings};
use lucerna::components::voxels::Resolution;
use lucerna::frame::{DirectSettings, FramePasses, Pixels, View};
use lucerna::gpu::Recorder;
use lucerna::gpu_scene::{GpuScene, GpuSceneOptions};
use lucerna::scene::{Light, Material, Scene, Sky};
use lucerna::settings;
use lucerna::techniques::reference::{
    Film, PathTracer, PixelSums, ReferenceSettings, UnfinishedPaths, Work,
};
use lucerna::techniques::voxel_cone::{VoxelCone, VoxelConeSettings};
use lucerna::techniques::voxel_rt::{VoxelRt, VoxelRtSettings};
use lucerna::techniques::{NoIndirect, TECHNIQUES, Technique, TechniqueError};

fn point(x: f32) -> Light {
    Light::Point { position: Vec3::new(x, 0.8, 1.3), intensity: Vec3::ONE, range: None }
}

fn lit_room() -> Scene {
    let mut world = scene(room([2.0, 1.0, 3.0], 0), vec![lambert([0.6, 0.5, 0.4])]);
    world.lights.push(point(1.1));
    world
}

fn upload(world: &Scene) -> GpuScene {
    GpuScene::new(gpu(), world, GpuSceneOptions::default().diffuse_only(true)).unwrap()
}

fn techniques(scene: &GpuScene) -> Vec<Box<dyn Technique>> {
    let eye = Vec3::new(1.0, 0.5, 1.5);
    let rt = settings!(VoxelRtSettings { resolution: 12 });
    let cone = settings!(VoxelConeSettings { resolution: Resolution::Longest(10) });
    vec![
        Box::new(VoxelRt::new(gpu(), scene, rt, eye).unwrap()),
        Box::new(VoxelCone::new(gpu(), scene, cone, eye).unwrap()),
    ]
}

/// A part of a recording.
type Part<'a> = Box<dyn FnOnce(&mut Recorder) + 'a>;

/// Runs parts of a recording: each in a submission of its own, or all in one.
fn run(parts: Vec<Part<'_>>, in_one: bool) {
    if in_one {
        submit(|recorder| parts.into_iter().for_each(|part| part(recorder)));
    } else {
        parts.into_iter().for_each(|part| submit(part));
    }
}

/// Three frames of two techniques in two views of different size, with shadow maps, a light that moves and a sky that
/// comes between them.
fn frames(in_one: bool) -> Vec<Vec<u8>> {
    use std::cell::RefCell;
    let scene = RefCell::new(upload(&lit_room()));
    let techniques: Vec<_> = techniques(&scene.borrow()).into_iter().map(RefCell::new).collect();
    let camera = look_down(0.8, 1.2);
    let rigs: Vec<_> = [UVec2::new(24, 9), UVec2::new(7, 31)]
        .into_iter()
        .map(|size| {
            let world = &*scene.borrow();
            let settings = settings!(ShadowSettings { resolution: 32 });
            let maps = ShadowMaps::new(gpu(), world, settings).unwrap();
            let (direct, visibility) = (DirectSettings::default(), maps.visibility());
            let mut passes =
                FramePasses::with_visibility(gpu(), world, size, direct, &visibility).unwrap();
            passes.shadow_maps = Some(maps);
            RefCell::new((passes, View::new(size)))
        })
        .collect();
    let mut parts: Vec<Part<'_>> = Vec::new();
    for frame in 0..3 {
        for (technique, rig) in techniques.iter().flat_map(|t| rigs.iter().map(move |r| (t, r))) {
            let (scene, camera) = (&scene, &camera);
            parts.push(Box::new(move |recorder| {
                let (passes, view) = &mut *rig.borrow_mut();
                let scene = &*scene.borrow();
                view.advance(scene, camera, &accumulated(3, 1));
                passes.record(recorder, scene, view, &mut **technique.borrow_mut()).unwrap();
            }));
        }
        let scene = &scene;
        parts.push(Box::new(move |recorder| {
            let mut scene = scene.borrow_mut();
            match frame {
                0 => scene.set_lights(recorder, &[point(0.4)]).unwrap(),
                _ => scene.set_sky(recorder, &Sky::Constant(Vec3::splat(0.3))).unwrap(),
            }
        }));
    }
    run(parts, in_one);
    let bytes = |rig: &RefCell<(FramePasses, View)>| {
        let (passes, _) = &*rig.borrow();
        let stripe = &passes.accumulator.film().stripes()[0];
        [read(&stripe.sums), read_texture(passes.indirect(), 16)].concat()
    };
    rigs.iter().map(bytes).collect()
}

#[test]
fn frames_in_one_submission_are_those_of_many() {
    let (many, one) = (frames(false), frames(true));
    for (view, (many, one)) in many.iter().zip(&one).enumerate() {
        assert!(many.iter().any(|&byte| byte != 0), "view {view}: all bytes are 0, expected light");
        assert!(
            many == one,
            "view {view}: frames in one submission against many: {}",
            differing_bytes(one, many)
        );
    }
}

/// Sixty-four pieces of a rendering, each with uniforms of its own.
#[test]
fn pieces_in_one_submission_are_those_of_many() {
    let scene = upload(&lit_room());
    let camera = look_down(0.8, 1.2);
    let settings = settings!(ReferenceSettings { size: UVec2::new(16, 16), n_bounces: 2 });
    let tracer = PathTracer::new(gpu(), &scene);
    let render = |in_one| {
        let film = Film::new(gpu(), settings.size);
        let rest = UnfinishedPaths::new(gpu(), &film);
        let parts = (0..64u32)
            .map(|ix| {
                let (film, rest, tracer, scene) = (&film, &rest, &tracer, &scene);
                let (camera, settings) = (&camera, &settings);
                let work = Work {
                    stripe: 0,
                    first_row: ix % 16,
                    n_rows: 1,
                    first_sample: 2 * (ix / 16),
                    n_samples: 2,
                    continues: false,
                };
                let part = move |recorder: &mut Recorder| {
                    tracer.record(recorder, scene, film, rest, camera, settings, work).unwrap();
                };
                Box::new(part) as Box<dyn FnOnce(&mut Recorder)>
            })
            .collect();
        run(parts, in_one);
        read(&film.stripes()[0].sums)
    };
    let (many, one) = (render(false), render(true));
    let sums: Vec<PixelSums> = bytemuck::pod_collect_to_vec(&many);
    assert_each("sums of pixels", &sums, "of 8 samples", |pixel| pixel.n_samples == 8);
    assert!(
        many == one,
        "sums of pieces in one submission against many: {}",
        differing_bytes(&one, &many)
    );
}

/// A texture that light can be shaded into.
fn target(size: UVec2) -> wgpu::TextureView {
    let texture = gpu().device.create_texture(&wgpu::TextureDescriptor {
        label: None,
        size: wgpu::Extent3d { width: size.x, height: size.y, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: wgpu::TextureFormat::Rgba32Float,
        usage: wgpu::TextureUsages::STORAGE_BINDING | wgpu::TextureUsages::COPY_SRC,
        view_formats: &[],
    });
    texture.create_view(&Default::default())
}

/// Two views of different size take turns with one technique, and neither disturbs the other: its pictures are those of a
/// technique that it has alone.
#[test]
fn views_of_different_size_stand_side_by_side() {
    let scene = upload(&lit_room());
    let camera = look_down(0.8, 1.2);
    let sizes = [UVec2::new(24, 9), UVec2::new(7, 31)];
    // The last of the two views has seen both updates.
    const LAST: usize = 1;
    for sizes in [sizes, [sizes[1], sizes[0]]] {
        let mut both = techniques(&scene);
        let mut single = techniques(&scene);
        for (both, single) in both.iter_mut().zip(&mut single) {
            let mut rigs = sizes.map(|size| {
                let direct = DirectSettings::default();
                (FramePasses::new(gpu(), &scene, size, direct).unwrap(), View::new(size))
            });
            let size = sizes[LAST];
            let light = target(size);
            for _ in 0..2 {
                for (passes, view) in &mut rigs {
                    view.advance(&scene, &camera, &accumulated(1, 0));
                    submit(|recorder| passes.record(recorder, &scene, view, &mut **both)).unwrap();
                }
                let (passes, view) = &rigs[LAST];
                submit(|recorder| {
                    // The other one was brought up to date once for each view.
                    for _ in 0..2 {
                        single.update(recorder, &scene, &view.into()).unwrap();
                    }
                    let pixels = Pixels::new(view, &passes.gbuffer).unwrap();
                    single.shade(recorder, &pixels, &light).unwrap();
                });
            }
            let found = read_texture(rigs[LAST].0.indirect(), 16);
            let name = both.name();
            assert!(
                found.iter().any(|&byte| byte != 0),
                "{name}: the view of {size} is black, expected light"
            );
            let expected = read_texture(&light, 16);
            assert!(
                found == expected,
                "{name}: the view of {size} beside another against alone: {}",
                differing_bytes(&found, &expected)
            );
        }
    }
}

/// Lights, sky and materials that are changed on the GPU are those of a scene made anew; shadow maps, the accumulator
/// and techniques follow by themselves.
#[test]
fn a_changed_scene_is_one_made_anew() {
    let size = UVec2::new(12, 9);
    let camera = look_down(0.8, 1.2);
    let lamp = |world: &mut Scene| {
        world.materials.push(emitter([2.0, 3.0, 4.0]));
        world.meshes.push(floor(0.2, 0.05, 1));
        let mesh = world.meshes.len() - 1;
        let world_from_object = glam::Affine3A::from_translation(Vec3::new(1.0, 0.5, 1.5));
        world.instances.push(lucerna::scene::Instance { mesh, world_from_object });
    };
    let mut before = lit_room();
    lamp(&mut before);
    let mut after = before.clone();
    after.lights = vec![point(0.3), point(1.7), point(1.0)];
    after.sky = Sky::Constant(Vec3::new(0.1, 0.2, 0.3));
    after.materials[0] = Material { double_sided: true, ..lambert([0.3, 0.6, 0.2]) };
    after.materials[1].emission = Vec3::new(7.0, 1.0, 0.5);
    let dark = Material { emission: Vec3::ZERO, ..after.materials[1].clone() };
    let mut changed = upload(&before);
    let fresh = upload(&after);
    let passes = || {
        let settings = settings!(ShadowSettings { resolution: 64 });
        let maps = ShadowMaps::new(gpu(), &fresh, settings).unwrap();
        let (direct, visibility) = (DirectSettings::default(), maps.visibility());
        let mut passes =
            FramePasses::with_visibility(gpu(), &fresh, size, direct, &visibility).unwrap();
        passes.shadow_maps = Some(maps);
        passes
    };
    let frame = |passes: &mut FramePasses, scene: &GpuScene| -> Vec<PixelSums> {
        let mut view = View::new(size);
        view.advance(scene, &camera, &accumulated(1, 0));
        let technique = &mut NoIndirect;
        submit(|recorder| passes.record(recorder, scene, &view, technique)).unwrap();
        bytemuck::pod_collect_to_vec(&read(&passes.accumulator.film().stripes()[0].sums))
    };
    let mut of_changed = passes();
    let old = frame(&mut of_changed, &changed);
    assert_eq!(
        frame(&mut of_changed, &changed)[0].n_samples,
        2,
        "samples of pixel 0 after a second frame without a change"
    );
    submit(|recorder| {
        changed.set_lights(recorder, &after.lights).unwrap();
        changed.set_sky(recorder, &after.sky).unwrap();
        changed.set_material(recorder, 0, &after.materials[0]).unwrap();
        // The lamp goes out and comes back: it leaves the table of lights in between.
        changed.set_material(recorder, 1, &dark).unwrap();
        changed.set_material(recorder, 1, &after.materials[1]).unwrap();
    });
    let new = frame(&mut of_changed, &changed);
    let expected = frame(&mut passes(), &fresh);
    assert_eq!(
        new[0].n_samples, 1,
        "samples of pixel 0 after a change: the sums do not begin anew"
    );
    let [new, expected, old] =
        [&new, &expected, &old].map(|sums| bytemuck::cast_slice::<_, u8>(sums));
    assert!(
        new == expected,
        "sums of the changed scene against one made anew: {}",
        differing_bytes(new, expected)
    );
    assert!(new != old, "sums of the changed scene are those from before, expected others");
}

/// Each technique of the list is made by its name, with settings as text, and describes them; the one that is nothing without a bake says so.
#[test]
fn techniques_are_made_by_name() {
    let scene = upload(&lit_room());
    let (rays, eye) = (LightVisibility::rays(), Vec3::new(1.0, 0.5, 1.5));
    for entry in TECHNIQUES {
        let has_voxels = entry.settings.iter().any(|setting| setting.name == "voxels");
        let given: &[_] = if has_voxels { &[("seed", "7"), ("voxels", "8")] } else { &[] };
        let made = entry.make(gpu(), &scene, given, &rays, eye);
        if entry.name == "sparse-probes" {
            let error = made.err().map(|error| error.to_string()).unwrap_or_default();
            assert!(error.contains("needs a bake"), "{}: `{error}`", entry.name);
            continue;
        }
        let technique = made.unwrap();
        assert_eq!(
            technique.name(),
            entry.name,
            "name of the technique that the list's entry makes"
        );
        let settings = technique.settings();
        assert_eq!(
            settings.len(),
            entry.settings.len(),
            "{}: number of settings, expected the entry's",
            entry.name
        );
        for ((setting, value), default) in settings.iter().zip((entry.defaults)()) {
            setting.check(value).unwrap();
            setting.check(&default).unwrap();
            // As text and back.
            let what = format!("{}, setting {}", entry.name, setting.name);
            assert_eq!(
                setting.parse(&value.to_string()).as_ref(),
                Ok(value),
                "{what}: value as text and back"
            );
            let chosen = given.iter().find(|(name, _)| *name == setting.name);
            assert_eq!(
                value.to_string(),
                chosen.map_or(default.to_string(), |(_, v)| (*v).into()),
                "{what}: value, expected the given one or the default"
            );
        }
        let unknown = entry.make(gpu(), &scene, &[("nonsense", "1")], &rays, eye);
        assert!(
            unknown.is_err() || entry.settings.is_empty(),
            "{}: the setting `nonsense` is taken, expected an error",
            entry.name
        );
    }
    let make = |name: &str, given| {
        let entry = TECHNIQUES.iter().find(|entry| entry.name == name).unwrap();
        entry.make(gpu(), &scene, given, &rays, eye).err().unwrap().to_string()
    };
    let error = make("voxel-rt", &[("voxels", "0")]);
    assert_eq!(error, "voxels is 0; possible values: 1 to 256", "error of voxel-rt with voxels 0");
    let error = make("voxel-cone", &[("specular", "shiny")]);
    assert_eq!(
        error, "specular is shiny; possible values: 0.1 to 119, or roughness, off",
        "error of voxel-cone with specular shiny"
    );
}

/// What a technique counts can be read, and every debug view it lists can be drawn.
#[test]
fn stats_and_debug_views() {
    let scene = upload(&lit_room());
    let camera = look_down(0.8, 1.2);
    let size = UVec2::new(9, 7);
    for technique in &mut techniques(&scene) {
        let direct = DirectSettings::default();
        let mut passes = FramePasses::new(gpu(), &scene, size, direct).unwrap();
        let mut view = View::new(size);
        let mut pictures = Vec::new();
        let views = technique.debug_views().iter().map(|of| Some(of.name.to_owned()));
        for debug_view in [None].into_iter().chain(views) {
            passes.debug_view = debug_view;
            view.advance(&scene, &camera, &accumulated(1, 0));
            submit(|recorder| passes.record(recorder, &scene, &view, &mut **technique)).unwrap();
            pictures.push(read_texture(passes.indirect(), 16));
        }
        let name = technique.name();
        for (ix, picture) in pictures.iter().enumerate() {
            assert!(
                picture.iter().any(|&byte| byte != 0),
                "{name}: picture {ix} (0: without a debug view) is black, expected something"
            );
            let same = pictures[..ix].iter().position(|earlier| earlier == picture);
            assert!(
                !pictures[..ix].contains(picture),
                "{name}: picture {ix} (0: without a debug view) is picture {same:?}, expected another"
            );
        }
        passes.debug_view = Some("nonsense".into());
        let drawn = submit(|recorder| passes.record(recorder, &scene, &view, &mut **technique));
        assert!(
            matches!(drawn, Err(TechniqueError::NoDebugView(_))),
            "{name}: the debug view `nonsense` gives {drawn:?}, expected NoDebugView"
        );
        let mut n_voxels = 0;
        for stat in technique.stats() {
            let number = lucerna::blocking::read_stat(gpu(), &stat).unwrap();
            assert!(
                stat.fault.is_none() || number == 0,
                "{name}: {} is {number}, expected 0 for a fault",
                stat.name
            );
            n_voxels += if stat.name == "voxels of a level" { number } else { 0 };
        }
        // A closed room of some hundred cells' surface.
        assert!((100..4000).contains(&n_voxels), "{name}: {n_voxels} voxels, expected 100 to 3999");
    }
}
