//! A renderer's own scene behind the scene seam: lucerna's kernel `rays/any_hit`, unchanged, asks
//! rays of one sphere in a uniform buffer instead of lucerna's BVH.
//!
//! `cargo run --example own_rays`

use lucerna::blocking::{open, read_buffer};
use lucerna::gpu::AdapterChoice;
use lucerna::shader::{BASELINE, Source};
use std::borrow::Cow;
use wgpu::util::DeviceExt;

/// What stands in the place of `wgsl/scene/rays.wgsl`: the same import path, and of its interface as
/// much as the kernel imports. Group 0 is the renderer's.
const OWN_RAYS: &str = "
#define_import_path lucerna::scene::rays

struct Ray {
    origin: vec3<f32>,
    t_min: f32,
    direction: vec3<f32>,
    t_max: f32,
}

/// Centre and radius.
@group(0) @binding(0) var<uniform> sphere: vec4<f32>;

fn any_hit(ray: Ray) -> bool {
    let to_center = sphere.xyz - ray.origin;
    let length_squared = dot(ray.direction, ray.direction);
    let middle = dot(to_center, ray.direction) / length_squared;
    let off_axis = to_center - middle * ray.direction;
    let square = (sphere.w * sphere.w - dot(off_axis, off_axis)) / length_squared;
    if square < 0.0 {
        return false;
    }
    let near = middle - sqrt(square);
    let far = middle + sqrt(square);
    return (near > ray.t_min && near < ray.t_max) || (far > ray.t_min && far < ray.t_max);
}
";

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // Compose: all of lucerna's modules, one of them replaced, and a kernel of lucerna's.
    let mut library = lucerna::library();
    library.insert(Source {
        import_path: "lucerna::scene::rays".into(),
        file: "own_rays.wgsl".into(),
        text: OWN_RAYS.into(),
    });
    let kernels = lucerna::kernels();
    let kernel = kernels.iter().find(|k| k.name == "rays/any_hit" && k.variant.is_empty());
    let kernel = kernel.ok_or("no kernel rays/any_hit")?;
    let source = Source {
        import_path: kernel.name.into(),
        file: kernel.file.into(),
        text: kernel.source.into(),
    };
    let module = library.compose(&source, BASELINE).map_err(|problems| problems[0].to_string())?;

    // Run it on any wgpu device; the layouts are read from the shader.
    let (gpu, _) = open(&AdapterChoice::Auto)?;
    let shader = gpu.device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some("rays/any_hit of a sphere"),
        source: wgpu::ShaderSource::Naga(Cow::Owned(module)),
    });
    let pipeline = gpu.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: Some("rays/any_hit of a sphere"),
        layout: None,
        module: &shader,
        entry_point: Some("main"),
        compilation_options: Default::default(),
        cache: None,
    });
    let buffer = |contents: &[u8], usage| {
        gpu.device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
            label: None,
            contents,
            usage,
        })
    };
    let sphere = buffer(bytemuck::cast_slice(&[0f32, 0.0, -5.0, 1.0]), wgpu::BufferUsages::UNIFORM);
    // Origin, t_min, direction, t_max: into the sphere, past it, too short.
    let rays: [[f32; 8]; 3] = [
        [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, -1.0, 100.0],
        [0.0, 2.0, 0.0, 0.0, 0.0, 0.0, -1.0, 100.0],
        [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, -1.0, 3.0],
    ];
    let batch = buffer(bytemuck::cast_slice(&[3u32, 0]), wgpu::BufferUsages::UNIFORM);
    let rays = buffer(bytemuck::cast_slice(&rays), wgpu::BufferUsages::STORAGE);
    let blocked = buffer(&[0xff; 12], wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC);
    let group = |ix: u32, buffers: &[&wgpu::Buffer]| {
        let entries: Vec<_> = (0..)
            .zip(buffers)
            .map(|(binding, b)| wgpu::BindGroupEntry { binding, resource: b.as_entire_binding() })
            .collect();
        gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout: &pipeline.get_bind_group_layout(ix),
            entries: &entries,
        })
    };
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    let mut pass = encoder.begin_compute_pass(&Default::default());
    pass.set_pipeline(&pipeline);
    pass.set_bind_group(0, &group(0, &[&sphere]), &[]);
    pass.set_bind_group(1, &group(1, &[&batch, &rays, &blocked]), &[]);
    pass.dispatch_workgroups(1, 1, 1);
    drop(pass);
    gpu.queue.submit([encoder.finish()]);

    let bytes = read_buffer(&gpu, &blocked)?;
    let answers: &[u32] = bytemuck::cast_slice(&bytes);
    println!("blocked: {answers:?}");
    assert_eq!(answers, [1, 0, 0]);
    Ok(())
}
