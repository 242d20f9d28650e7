// SPDX-License-Identifier: MIT OR Apache-2.0
//! What a caller gets wrong is an error that says so, and changes nothing.

use crate::harness::{gpu, submit};
use crate::support::{floor, lambert, look_down, scene, settings as reference_settings};
use crate::whole::{accumulated, render};
use glam::{UVec2, Vec3};
use lucerna::blocking::{ReferenceError, render_frames, render_reference};
use lucerna::frame::{DirectSettings, FramePasses, GBuffer};
use lucerna::gpu::{ComputeKernel, Dispatch, GpuError, Shaders};
use lucerna::gpu_scene::{GpuScene, GpuSceneError, GpuSceneOptions};
use lucerna::scene::{Light, Scene, Sky};
use lucerna::seam::{Mismatch, SceneSeam};
use lucerna::shader::Source;
use lucerna::techniques::NoIndirect;
use lucerna::techniques::reference::{Channel, Film, PathTracer, UnfinishedPaths, Work};

fn plane() -> Scene {
    scene(vec![floor(2.0, 0.0, 0)], vec![lambert([0.5; 3])])
}

fn upload(world: &Scene) -> Result<GpuScene, GpuSceneError> {
    GpuScene::new(gpu(), world, GpuSceneOptions::default())
}

#[test]
fn pictures_without_pixels() {
    let world = upload(&plane()).unwrap();
    for size in [UVec2::ZERO, UVec2::new(0, 8), UVec2::new(8, 0)] {
        let made = FramePasses::new(gpu(), &world, size, DirectSettings::default());
        let error = made.err().map(|error| error.to_string());
        assert!(
            error.as_ref().is_some_and(|error| error.contains("at least 1×1")),
            "frame of {size} pixels: the error is {error:?}, expected `at least 1×1`"
        );
        let asked = reference_settings(size.x, size.y, 1);
        let made = render_reference(gpu(), &world, &look_down(1.0, 1.0), &asked, 1, |_| true);
        assert!(
            matches!(made, Err(ReferenceError::Gpu(GpuError::EmptyPicture { .. }))),
            "reference of {size} pixels: the error is {:?}, expected EmptyPicture",
            made.err()
        );
    }
}

/// The reference needs no textures, so a picture may be wider than the device's largest.
#[test]
fn references_wider_than_textures() {
    let world = upload(&plane()).unwrap();
    let asked = reference_settings(gpu().device.limits().max_texture_dimension_2d + 1, 1, 0);
    let made = render_reference(gpu(), &world, &look_down(1.0, 1.0), &asked, 1, |_| true);
    assert_eq!(
        made.unwrap().0.len(),
        asked.size.x as usize,
        "number of pixels of a picture of {}",
        asked.size
    );
}

/// Each part of a scene that does not fit the others is named.
#[test]
fn scenes_whose_parts_do_not_fit() {
    type Edit = fn(&mut Scene);
    let edits: [(&str, Edit); 8] = [
        ("material out of range", |s| s.meshes[0].material = 7),
        ("vertex index out of range", |s| s.meshes[0].triangles[1] = [0, 1, 99]),
        ("as many normals", |s| s.meshes[0].normals = vec![Vec3::Y]),
        ("as many tangents", |s| s.meshes[0].tangents = vec![glam::Vec4::ONE]),
        ("mesh out of range", |s| s.instances[0].mesh = 3),
        ("image out of range", |s| {
            s.textures.push(lucerna::scene::Texture {
                image: 0,
                wrap_u: lucerna::scene::Wrap::Repeat,
                wrap_v: lucerna::scene::Wrap::Repeat,
                filter: lucerna::scene::Filter::Nearest,
            });
        }),
        ("number of texels", |s| {
            s.images.push(lucerna::scene::Image {
                name: "one".into(),
                width: 2,
                height: 2,
                rgba: vec![[0; 4]; 3],
            });
        }),
        ("number of texels", |s| s.sky = Sky::Image { width: 4, height: 2, rgb: vec![] }),
    ];
    for (problem, edit) in edits {
        let mut world = plane();
        edit(&mut world);
        let Err(error) = upload(&world) else {
            panic!("the scene is taken, expected the error `{problem}`")
        };
        assert!(
            error.to_string().contains(problem),
            "the error is `{error}`, expected `{problem}`"
        );
    }
}

/// After a sky that is refused, the scene is as before: same revisions, same picture.
#[test]
fn a_refused_change_changes_nothing() {
    let mut world = plane();
    world.lights.push(Light::Directional { direction: Vec3::NEG_Y, irradiance: Vec3::ONE });
    let mut world = upload(&world).unwrap();
    let picture = |world: &GpuScene| {
        render(world, &look_down(1.0, 1.0), UVec2::splat(4), accumulated(1, 0), 1)
            .channel(Channel::Direct)
    };
    let (before, revisions) = (picture(&world), world.revisions());
    let sky = Sky::Image { width: 3, height: 3, rgb: vec![Vec3::ONE; 8] };
    let changed = submit(|recorder| world.set_sky(recorder, &sky));
    assert!(
        matches!(changed, Err(GpuSceneError::Invalid(_))),
        "a sky of 3 × 3 with 8 texels gives {changed:?}, expected Invalid"
    );
    let changed = submit(|recorder| world.set_material(recorder, 1, &lambert([1.0; 3])));
    assert!(
        matches!(changed, Err(GpuSceneError::NoMaterial { material_ix: 1, n: 1 })),
        "material 1 of 1 gives {changed:?}, expected NoMaterial"
    );
    assert_eq!(
        world.revisions(),
        revisions,
        "revisions after a refused change, expected those before"
    );
    assert_eq!(
        picture(&world),
        before,
        "direct light after a refused change, expected that before"
    );
}

#[test]
fn work_outside_a_film() {
    let world = upload(&plane()).unwrap();
    let asked = reference_settings(8, 4, 1);
    let film = Film::new(gpu(), asked.size);
    let (tracer, unfinished) = (PathTracer::new(gpu(), &world), UnfinishedPaths::new(gpu(), &film));
    let record = |asked, work| {
        let camera = look_down(1.0, 1.0);
        submit(|recorder| tracer.record(recorder, &world, &film, &unfinished, &camera, asked, work))
    };
    let work = Work {
        stripe: 0,
        first_row: 0,
        n_rows: 4,
        first_sample: 0,
        n_samples: 1,
        continues: false,
    };
    record(&asked, work).unwrap();
    for outside in [
        Work { stripe: 1, ..work },
        Work { first_row: 1, ..work },
        Work { n_rows: 5, ..work },
        Work { first_row: u32::MAX, ..work },
    ] {
        let recorded = record(&asked, outside);
        assert!(
            matches!(recorded, Err(Mismatch::Rows)),
            "{outside:?} of a film of 4 rows gives {recorded:?}, expected Rows"
        );
    }
    let other = reference_settings(8, 5, 1);
    let recorded = record(&other, work);
    assert!(
        matches!(recorded, Err(Mismatch::Size { .. })),
        "a picture of {} on a film of {} gives {recorded:?}, expected Size",
        other.size,
        asked.size
    );
}

#[test]
fn textures_of_other_sizes() {
    let view = |size, format| {
        let texture = gpu().device.create_texture(&lucerna::wgpu::TextureDescriptor {
            label: None,
            size: lucerna::wgpu::Extent3d { width: size, height: 4, depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: lucerna::wgpu::TextureDimension::D2,
            format,
            usage: lucerna::wgpu::TextureUsages::TEXTURE_BINDING
                | lucerna::wgpu::TextureUsages::RENDER_ATTACHMENT,
            view_formats: &[],
        });
        texture.create_view(&Default::default())
    };
    let made = |normals, size| {
        GBuffer::from_views(
            view(4, GBuffer::ALBEDO),
            view(size, normals),
            view(4, GBuffer::EMISSION),
            view(4, GBuffer::MOTION),
            view(4, GBuffer::TRIANGLES),
            view(4, GBuffer::DEPTH),
        )
    };
    let same = made(GBuffer::NORMALS, 4);
    assert!(same.is_ok(), "textures of one size give {:?}, expected a G-buffer", same.err());
    let other = made(GBuffer::NORMALS, 5).unwrap_err();
    assert!(
        matches!(other, GpuError::OtherSize { what: "normals", .. }),
        "normals 5 texels wide beside 4: the error is `{other}`, expected OtherSize of normals"
    );
    let other = made(GBuffer::ALBEDO, 4).unwrap_err();
    assert!(
        matches!(other, GpuError::OtherFormat { what: "normals", .. }),
        "normals in the albedo's format: the error is `{other}`, expected OtherFormat of normals"
    );
}

/// Own modules that do not compose are told without a panic.
#[test]
fn modules_that_do_not_compose() {
    let own = |text: &'static str| {
        Shaders::default().with_module(Source {
            import_path: "lucerna::math::octahedral".into(),
            file: "own.wgsl".into(),
            text: text.into(),
        })
    };
    let known = Shaders::default().check(&["frame/gbuffer", "scan/add"]);
    assert!(
        known.is_ok(),
        "own kernels of the library give {:?}, expected no problems",
        known.err()
    );
    let problems = own("fn pack_direction(").check(&["frame/gbuffer"]).unwrap_err();
    assert!(
        problems[0].to_string().contains("has no `unpack_direction`"),
        "the first problem is `{}`, expected `has no `unpack_direction``",
        problems[0]
    );
}

/// Contents cannot be bound to a field's uniform.
#[test]
#[should_panic(expected = "belongs to a field")]
fn contents_for_a_fields_uniform() {
    let kernel = ComputeKernel::new(gpu(), &Shaders::default(), None, "voxel_pyramid/trace");
    let [info, cones, results] = [(); 3].map(|()| {
        gpu().device.create_buffer(&lucerna::wgpu::BufferDescriptor {
            label: None,
            size: 4096,
            usage: lucerna::wgpu::BufferUsages::UNIFORM | lucerna::wgpu::BufferUsages::STORAGE,
            mapped_at_creation: false,
        })
    });
    submit(|recorder| {
        let mut pass = recorder.compute("test");
        let call = kernel.call(&mut pass).bind("info", &info).bind("cones", &cones);
        let call = call.bind("results", &results).uniform("pyramid", &[0u32; 4]);
        call.dispatch(Dispatch::Items(1));
    });
}

/// Told to stop while warming up, it renders one frame, and says that it was stopped.
#[test]
fn stopped_while_warming_up() {
    let world = upload(&plane()).unwrap();
    let mut what = lucerna::blocking::FramesToRender::new(UVec2::splat(4), 3);
    what.n_warm_up = 5;
    let mut n_asked = 0;
    let (_, stats) =
        render_frames(gpu(), &world, &look_down(1.0, 1.0), &what, &mut NoIndirect, |_| {
            n_asked += 1;
            n_asked != 2
        })
        .unwrap();
    assert!(
        stats.stopped,
        "rendering told to stop in its second frame does not say that it was stopped: {stats:?}"
    );
    assert_eq!(
        (stats.n_frames, n_asked),
        (1, 3),
        "frames rendered and times asked when told to stop at the second question"
    );
}
