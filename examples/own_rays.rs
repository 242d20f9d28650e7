// SPDX-License-Identifier: MIT OR Apache-2.0
//! A renderer's own scene behind the scene seam: lucerna's kernel `rays/any_hit`, unchanged, traces
//! rays against one sphere in a uniform buffer instead of lucerna's BVH.
//!
//! `cargo run --example own_rays`

use lucerna::blocking::{open, read_buffer};
use lucerna::gpu::{AdapterChoice, ComputeKernel, Dispatch, Recorder, SceneGroup, Shaders};
use lucerna::shader::Source;
use wgpu::util::DeviceExt;

/// The replacement of `wgsl/scene/rays.wgsl`: it has the same import path, and the part of its
/// interface that the kernel imports. Group 0 is the renderer's.
const OWN_RAYS: &str = "
#define_import_path lucerna::scene::rays

#import lucerna::scene::types::Ray

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
    println!("blocked: {:?}", blocked()?);
    Ok(())
}

/// For a ray into the sphere, one past it, and one too short: 1 where the sphere is in the way.
pub fn blocked() -> Result<Vec<u32>, Box<dyn std::error::Error>> {
    // Any wgpu device works.
    let (gpu, _) = open(&AdapterChoice::Auto)?;
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
    let rays = buffer(bytemuck::cast_slice(&rays), wgpu::BufferUsages::STORAGE);
    let blocked = buffer(&[0xff; 12], wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC);

    // All of lucerna's modules, one of them replaced; the layouts are read from the shader.
    let shaders = Shaders::default().with_module(Source {
        import_path: "lucerna::scene::rays".into(),
        file: "own_rays.wgsl".into(),
        text: OWN_RAYS.into(),
    });
    let name = "rays/any_hit";
    let scene = SceneGroup::new(&gpu, &shaders, &[name], &vec![("sphere", (&sphere).into())]);
    let kernel = ComputeKernel::new(&gpu, &shaders, Some(&scene), name);
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    let mut recorder = Recorder::new(&gpu, &mut encoder);
    kernel
        .call(&mut recorder.compute(name))
        .scene(&scene)
        .uniform("batch", &[3u32, 0])
        .bind("rays", &rays)
        .bind("blocked", &blocked)
        .dispatch(Dispatch::Items(3));
    drop(recorder);
    gpu.queue.submit([encoder.finish()]);

    let bytes = read_buffer(&gpu, &blocked)?;
    let answers: &[u32] = bytemuck::cast_slice(&bytes);
    Ok(answers.to_vec())
}
