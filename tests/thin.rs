use lucerna::gpu_scene::*;
use lucerna::picture::*;
use lucerna::reference::*;
use lucerna::scene::*;
#[test]
fn thin() {
    let l = Scene::load(
        std::path::Path::new("../shared/scenes/cornell_original/cornell_original.gltf"),
        &LoadLimits::default(),
    )
    .unwrap();
    let (gpu, info) = lucerna::blocking::open(&Default::default()).unwrap();
    println!("{info:?}");
    let t = std::time::Instant::now();
    let scene = GpuScene::new(
        &gpu,
        &l.scene,
        GpuSceneOptions { diffuse_only: true, rays: RaySource::Software },
    )
    .unwrap();
    println!("scene {:?} tris {} lights {}", t.elapsed(), scene.n_triangles(), scene.n_lights());
    let settings = ReferenceSettings {
        size: glam::UVec2::splat(256),
        n_bounces: 6,
        seed: 0,
        irradiance: false,
    };
    let (film, stats) = lucerna::blocking::render_reference(
        &gpu,
        &scene,
        &l.scene.cameras[0],
        &settings,
        64,
        |_| true,
    )
    .unwrap();
    println!("{stats:?}");
    let sums = lucerna::blocking::read_film(&gpu, &film).unwrap();
    for (c, n) in
        [(Channel::Beauty, "beauty"), (Channel::Direct, "direct"), (Channel::Normal, "normal")]
    {
        let p = resolve(&sums, settings.size, c);
        let m: glam::Vec3 = p.rgb.iter().sum::<glam::Vec3>() / p.rgb.len() as f32;
        println!("{n} {m}");
        p.write(format!("/tmp/thin_{n}.png"), &PngOptions::default()).unwrap();
    }
}
