use lucerna::gpu_scene::*; use lucerna::rays::*; use lucerna::blocking::*; use lucerna::scene::*;
use wgpu::util::DeviceExt;
#[path = "../src/cli/bench/room.rs"] mod room;
fn cpu() -> f64 { let s = std::fs::read_to_string("/proc/self/stat").unwrap(); let f: Vec<&str> = s.rsplit(')').next().unwrap().split_whitespace().collect(); f[11].parse::<f64>().unwrap() / 100.0 }
fn main() {
    let (gpu, info) = open(&Default::default()).unwrap();
    println!("{}", info.driver_info);
    let (mut scene, mut camera) = room::room(); if let Some(f) = std::env::args().nth(1) { scene = Scene::load(std::path::Path::new(&f), &LoadLimits::default()).unwrap().scene; for m in &mut scene.materials { if m.alpha != AlphaMode::Opaque { println!("{} {:?}", m.name, m.alpha); } if std::env::args().nth(2).is_some() { m.alpha = AlphaMode::Opaque; } } camera.position = glam::Vec3::new(-11.5, 2.0, -0.3); camera.forward = (glam::Vec3::new(0.0, 3.4, -0.3) - camera.position).normalize(); let r = camera.forward.cross(glam::Vec3::Y).normalize(); camera.up = r.cross(camera.forward); }
    let gs = GpuScene::new(&gpu, &scene, GpuSceneOptions { diffuse_only: true, rays: RaySource::Software }).unwrap();
    let n = 1024u32;
    let right = camera.forward.cross(camera.up);
    let half = 0.55f32.tan();
    let primary: Vec<Ray> = (0..n*n).map(|ix| { let (tile, inside) = (ix / 64, ix % 64); let t = n / 8; let x = tile % t * 8 + inside % 8; let y = tile / t * 8 + inside / 8; let at = |k: u32| (k as f32 + 0.5) / n as f32 * 2.0 - 1.0; Ray { origin: camera.position, t_min: 0.0, direction: (camera.forward + right * (half * at(x)) - camera.up * (half * at(y))).normalize(), t_max: f32::MAX } }).collect();
    let run = |rays: &[Ray], q: RayQuestion, name: &str| -> Vec<u8> {
        let k = RayKernel::new(&gpu, &gs, q);
        let rb = gpu.device.create_buffer_init(&wgpu::util::BufferInitDescriptor { label: None, contents: bytemuck::cast_slice(rays), usage: wgpu::BufferUsages::STORAGE });
        let ab = gpu.device.create_buffer(&wgpu::BufferDescriptor { label: None, size: rays.len() as u64 * 16, usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC, mapped_at_creation: false });
        let go = || { let mut e = gpu.device.create_command_encoder(&Default::default()); k.record(&gpu, &mut e, &gs, &rb, &ab, rays.len() as u32, None); gpu.queue.submit([e.finish()]); wait(&gpu).unwrap(); };
        let c = cpu(); go(); let first = cpu() - c;
        let c = cpu(); for _ in 0..3 { go(); } let t = (cpu() - c) / 3.0;
        println!("{name}: first {first:.2} s, {:.3} CPU us/ray = {:.2} Mrays/s on 2 threads", t / rays.len() as f64 * 1e6, 2.0 * rays.len() as f64 / t / 1e6);
        read_buffer(&gpu, &ab).unwrap()
    };
    let hits: Vec<Hit> = bytemuck::pod_collect_to_vec(&run(&primary, RayQuestion::Nearest, "primary nearest"));
    run(&primary, RayQuestion::Any, "primary any");
    let mut s = 1u64; let mut rnd = || { s = s.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407); (s >> 40) as f32 / 16777216.0 };
    let diffuse: Vec<Ray> = primary.iter().zip(&hits).filter(|(_, h)| h.triangle != NONE).map(|(r, h)| { let z = 2.0 * rnd() - 1.0; let p = 6.2831853 * rnd(); let q = (1.0 - z * z).max(0.0).sqrt(); let d = glam::Vec3::new(q * p.cos(), q * p.sin(), z); let d = if d.dot(r.direction) > 0.0 { -d } else { d }; Ray { origin: r.origin + r.direction * h.t * 0.999, t_min: 0.0, direction: d, t_max: f32::MAX } }).collect();
    run(&diffuse, RayQuestion::Nearest, "diffuse nearest");
    run(&diffuse, RayQuestion::Any, "diffuse any");
    let w = WorldTriangles::of(&scene); let tree = build_obvhs(&w.positions);
    let tris: Vec<_> = tree.primitive_indices.iter().map(|&ix| { let [a, b, c] = w.positions[ix as usize].map(glam::Vec3A::from); obvhs::rt_triangle::RtTriangle::new(a, b, c) }).collect();
    for (name, rays) in [("primary", &primary), ("diffuse", &diffuse)] {
        let c = cpu(); let mut m = 0; for r in rays.iter() { let ray = obvhs::ray::Ray::new_inf(r.origin.into(), r.direction.into()); let mut h = obvhs::ray::RayHit::none(); if tree.ray_traverse(ray, &mut h, |r, i| tris[i].intersect(r)) { m += 1; } } let t = cpu() - c;
        println!("obvhs {name}: {:.2} Mrays/s {m}", rays.len() as f64 / t / 1e6);
    }
    let _ = Sky::default();
}
