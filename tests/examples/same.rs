// SPDX-License-Identifier: MIT OR Apache-2.0
//! What a renderer's own part gives beside lucerna's own.

use crate::{own_gbuffer, own_rays, own_scene, own_technique};
use glam::{UVec2, Vec3, Vec4};
use lucerna::blocking::{FramesToRender, read_film, render_frames, render_reference};
use lucerna::gpu_scene::{GpuScene, GpuSceneOptions};
use lucerna::picture::Picture;
use lucerna::scene::{Camera, Instance, Light, Material, Mesh, Projection, Scene};
use lucerna::seam::SceneSeam;
use lucerna::settings;
use lucerna::techniques::reference::{Channel, ReferenceSettings, resolve};
use lucerna::techniques::voxel_rt::{VoxelRt, VoxelRtSettings};
use lucerna::techniques::{Settings, Technique};
use lucerna::testing::gpu;

/// The path tracer's picture of a channel.
fn reference(
    scene: &dyn SceneSeam,
    camera: &Camera,
    size: UVec2,
    n_samples: u32,
    channel: Channel,
) -> Picture {
    let settings =
        settings!(ReferenceSettings { occlusion_distance: 1.0, ..ReferenceSettings::new(size) });
    let (sums, _) = render_reference(gpu(), scene, camera, &settings, n_samples, |_| true).unwrap();
    resolve(&sums, size, channel)
}

/// Frames with a technique, on lucerna's own G-buffer; the later half is kept.
fn frames(
    scene: &dyn SceneSeam,
    camera: &Camera,
    what: &FramesToRender,
    technique: &mut dyn Technique,
    channel: Channel,
) -> Picture {
    let (passes, _) = render_frames(gpu(), scene, camera, what, technique, |_| true).unwrap();
    resolve(&read_film(gpu(), passes.accumulator.film()).unwrap(), what.size, channel)
}

/// Means over a quarter of the picture each.
fn quarters(picture: &Picture) -> [Vec3; 4] {
    let half = UVec2::new(picture.width, picture.height) / 2;
    [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(right, down)| {
        let mut sum = Vec3::ZERO;
        for y in 0..half.y {
            for x in 0..half.x {
                let at = (down * half.y + y) * picture.width + right * half.x + x;
                sum += picture.rgb[at as usize];
            }
        }
        sum / (half.x * half.y) as f32
    })
}

/// The largest relative difference of any colour of any quarter.
fn difference(found: &Picture, expected: &Picture) -> f32 {
    let pairs = quarters(found).into_iter().zip(quarters(expected));
    let differences = pairs.map(|(found, expected)| ((found - expected) / expected).abs());
    // A number that is NaN is the largest.
    let numbers = differences.flat_map(|of| of.to_array());
    numbers.fold(0.0, |most, of| if of.is_nan() || of > most { of } else { most })
}

/// The example's room as a scene of lucerna's.
fn scene_of_quads() -> Scene {
    let mut scene = Scene::default();
    for [corner, u, v, color] in own_scene::room() {
        let corners = [corner, corner + u, corner + u + v, corner + v].map(Vec4::truncate);
        let material = scene.materials.len();
        scene.instances.push(Instance { mesh: material, world_from_object: Default::default() });
        scene.materials.push(Material { base_color: color.with_w(1.0), ..Material::default() });
        scene.meshes.push(Mesh {
            positions: corners.to_vec(),
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            material,
            ..Mesh::default()
        });
    }
    let (position, intensity) = own_scene::LAMP;
    scene.lights.push(Light::Point { position, intensity, range: None });
    scene
}

/// The path tracer and voxel-rt through a scene seam of one's own give what they give through lucerna's.
#[test]
fn own_scene_is_the_scene() {
    let camera = own_scene::camera();
    let own = own_scene::OwnScene::new(gpu(), &own_scene::room()).unwrap();
    let options = GpuSceneOptions::default().diffuse_only(true);
    let known = GpuScene::new(gpu(), &scene_of_quads(), options).unwrap();

    // Noise: 192 pixels a quarter, 1024 paths each, and a path's light is off by about once its mean: 1/√196608 = 0.23 %
    // for one picture. The limit is 4 times what two pictures differ by.
    let size = UVec2::new(32, 24);
    let by_own = reference(&own, &camera, size, 1024, Channel::Beauty);
    let by_known = reference(&known, &camera, size, 1024, Channel::Beauty);
    let found = difference(&by_own, &by_known);
    println!("path tracer, own scene against GpuScene: {found}");
    assert!(
        found < 0.013,
        "beauty by the path tracer of the own scene differs from GpuScene's by {found} in a quarter, expected below 0.013"
    );

    // The same voxels, the same rays; only where pixels look differs: the rasteriser finds a border's pixels elsewhere, by
    // up to 1/256 of their width, and base colours have 8 bits (1 % of 0.1).
    let size = UVec2::new(64, 48);
    let what = settings!(FramesToRender { n_warm_up: 16, ..FramesToRender::new(size, 16) });
    let by_own = own_scene::render(gpu(), &own, &camera, size, 32).unwrap();
    let settings = settings!(VoxelRtSettings { resolution: 32 });
    let mut technique = VoxelRt::new(gpu(), &known, settings, camera.position).unwrap();
    let by_known = frames(&known, &camera, &what, &mut technique, Channel::Beauty);
    let found = difference(&by_own, &by_known);
    println!("voxel-rt, own scene against GpuScene: {found}");
    assert!(
        found < 0.015,
        "beauty by voxel-rt of the own scene differs from GpuScene's by {found} in a quarter, expected below 0.015"
    );

    // And it is the truth: within 5 %, what voxel-rt leaves of a room's light in 12 cm cells.
    let truth = reference(&own, &camera, size, 256, Channel::Beauty);
    let found = difference(&by_own, &truth);
    println!("voxel-rt against the path tracer: {found}");
    assert!(
        found < 0.05,
        "beauty by voxel-rt differs from the path tracer's by {found} in a quarter, expected below 0.05"
    );
}

/// A G-buffer of one's own, drawn with matrices of one's own, gives what lucerna's gives.
#[test]
fn own_gbuffer_is_a_gbuffer() {
    let size = UVec2::new(64, 48);
    let renderer = own_gbuffer::renderer::Renderer::new(size).unwrap();
    let by_own = own_gbuffer::render(&renderer, 32).unwrap();

    let options = GpuSceneOptions::default().diffuse_only(true);
    let scene = GpuScene::new(gpu(), &own_gbuffer::scene_of(&renderer), options).unwrap();
    let projection = Projection::Perspective { vertical_fov: renderer.vertical_fov };
    let camera = Camera::from_matrix(renderer.world_from_view, projection);
    let settings = settings!(VoxelRtSettings { resolution: 32 });
    let mut technique = VoxelRt::new(gpu(), &scene, settings, camera.position).unwrap();
    // One frame at a time, so that no pixel is sampled beside its centre: the example does not move its camera either.
    let mut sum = vec![Vec3::ZERO; (size.x * size.y) as usize];
    let n = 16;
    let what = settings!(FramesToRender { n_warm_up: 16, ..FramesToRender::new(size, 1) });
    let mut view = what.view;
    for seed in 0..n {
        view.seed = seed;
        let n_warm_up = if seed == 0 { 16 } else { 0 };
        let what = settings!(FramesToRender { view, n_warm_up, ..what });
        let frame = frames(&scene, &camera, &what, &mut technique, Channel::Beauty);
        sum.iter_mut().zip(&frame.rgb).for_each(|(sum, rgb)| *sum += rgb / n as f32);
    }
    let by_known = Picture { width: size.x, height: size.y, rgb: sum };
    let found = difference(&by_own, &by_known);
    println!("own G-buffer against lucerna's: {found}");
    assert!(
        found < 0.01,
        "beauty with the own G-buffer differs from that with lucerna's by {found} in a quarter, expected below 0.01"
    );

    // Pixel by pixel: the half of them that differ least differ by noise of direct light alone, which has none here (a point
    // light), and by rounding.
    let mut each: Vec<f32> = by_own
        .rgb
        .iter()
        .zip(&by_known.rgb)
        .filter(|(_, known)| known.min_element() > 0.0)
        .map(|(own, known)| ((own - known) / known).abs().max_element())
        .collect();
    each.sort_by(f32::total_cmp);
    println!("pixels: median {}, 99 % {}", each[each.len() / 2], each[each.len() * 99 / 100]);
    let median = each[each.len() / 2];
    assert!(
        median < 0.01,
        "pixels with the own G-buffer differ from those with lucerna's by {median} in the median, expected below 0.01"
    );
}

/// A technique from outside says of ambient occlusion what the path tracer says.
#[test]
fn own_technique_takes_part() {
    let scene = scene_of_quads();
    let scene = GpuScene::new(gpu(), &scene, GpuSceneOptions::default()).unwrap();
    let camera = own_scene::camera();
    let size = UVec2::new(32, 24);
    let ambient = own_technique::AmbientSettings { n_rays: 8, ..Default::default() };
    let mut technique: Box<dyn Technique> =
        Box::new(own_technique::Ambient::new(gpu(), &scene, ambient).unwrap());
    let what = FramesToRender::new(size, 32);
    let by_own = frames(&scene, &camera, &what, technique.as_mut(), Channel::Openness);
    let truth = reference(&scene, &camera, size, 256, Channel::Openness);
    // 192 pixels a quarter, 256 rays each that are blocked or not: at most 0.5/√49152 = 0.23 % of openness 1 for a picture.
    let found = difference(&by_own, &truth);
    println!("openness against the path tracer: {found}");
    assert!(
        found < 0.013,
        "openness by the own technique differs from the path tracer's by {found} in a quarter, expected below 0.013"
    );

    let names: Vec<_> = technique.settings().iter().map(|(setting, _)| setting.name).collect();
    assert_eq!(names, ["radiance", "distance", "rays"], "names of the own technique's settings");
    let error = own_technique::AmbientSettings::default().set_by_name("rays", "0").unwrap_err();
    assert_eq!(
        error.to_string(),
        "rays is 0; possible values: 1 to 64",
        "error of setting rays to 0"
    );
    let wrong = own_technique::AmbientSettings { n_rays: 65, ..Default::default() };
    let made = own_technique::Ambient::new(gpu(), &scene, wrong);
    assert!(made.is_err(), "65 rays are taken, expected an error: possible are 1 to 64");
}

/// A ray into the sphere, one past it, one too short.
#[test]
fn own_rays_meet_the_sphere() {
    assert_eq!(
        own_rays::blocked().unwrap(),
        [1, 0, 0],
        "rays that are blocked: one into the sphere, one past it, one too short"
    );
}
