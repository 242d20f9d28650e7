// SPDX-License-Identifier: MIT OR Apache-2.0
//! glTF materials under a white sky: a convex surface shows its directional albedo.

use crate::harness::Estimate;
use crate::support::{batches, look_down, on_gpu, quad, render, scene, settings};
use glam::{DVec3, Quat, UVec2, Vec3, Vec4};
use lucerna::gpu_scene::RaySource;
use lucerna::scene::{Material, Mesh, Sky};
use lucerna::techniques::reference::{Channel, resolve};
use std::f64::consts::{PI, TAU};

fn material(color: f32, metallic: f32, roughness: f32) -> Material {
    Material {
        base_color: Vec4::new(color, color, color, 1.0),
        metallic,
        roughness,
        ..Material::default()
    }
}

/// f·cosθ of glTF 2.0, appendix B.3, in f64. z: the normal.
fn reflected(color: f64, metallic: f64, roughness: f64, wo: DVec3, wi: DVec3) -> f64 {
    let alpha2 = roughness.powi(4);
    let h = (wo + wi).normalize();
    let f0 = 0.04 * (1.0 - metallic) + color * metallic;
    let fresnel = f0 + (1.0 - f0) * (1.0 - wo.dot(h)).powi(5);
    let d = alpha2 / (PI * (h.z * h.z * (alpha2 - 1.0) + 1.0).powi(2));
    let lambda = |z: f64| (alpha2 + (1.0 - alpha2) * z * z).sqrt();
    let v = 0.5 / (wi.z * lambda(wo.z) + wo.z * lambda(wi.z));
    // The base sees what the surface lets in, and shows what it lets out.
    let enters = |cosine: f64| (1.0 - f0) * (1.0 - (1.0 - cosine).powi(5));
    let diffuse = enters(wo.z) * enters(wi.z) * color * (1.0 - metallic) / PI;
    (diffuse + fresnel * d * v) * wi.z
}

/// ∫ f cosθ dω by the midpoint rule in θ and φ: steps of 0.0026 rad against lobes of 0.06 rad.
fn directional_albedo(color: f64, metallic: f64, roughness: f64, cosine: f64) -> f64 {
    let wo = DVec3::new((1.0 - cosine * cosine).sqrt(), 0.0, cosine);
    let (n_theta, n_phi) = (600, 600);
    let mut sum = 0.0;
    for i in 0..n_theta {
        let theta = 0.5 * PI * (f64::from(i) + 0.5) / f64::from(n_theta);
        for k in 0..n_phi {
            // Half of the directions: the other half mirrors them.
            let phi = PI * (f64::from(k) + 0.5) / f64::from(n_phi);
            let wi = DVec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos());
            sum += reflected(color, metallic, roughness, wo, wi) * theta.sin();
        }
    }
    sum * 0.5 * PI / f64::from(n_theta) * TAU / f64::from(n_phi)
}

/// Six materials side by side on a plane that is turned away from the camera.
#[test]
fn glossy_planes_under_a_white_sky() {
    let looks = [
        (1.0, 1.0, 0.25),
        (1.0, 1.0, 0.6),
        (0.5, 1.0, 1.0),
        (0.8, 0.0, 0.25),
        (1.0, 0.0, 1.0),
        (0.6, 0.5, 0.5),
    ];
    let materials = looks.map(|(color, metallic, roughness)| material(color, metallic, roughness));
    let strip = |k: usize| {
        let (from, to) = (k as f32 - 3.0, k as f32 - 2.0);
        quad([[from, 0.0, -99.0], [from, 0.0, 99.0], [to, 0.0, 99.0], [to, 0.0, -99.0]], k)
    };
    let mut world = scene((0..6).map(strip).collect(), materials.to_vec());
    world.sky = Sky::Constant(Vec3::ONE);
    let world = on_gpu(&world, false, RaySource::Software);
    for degrees in [0.0f64, 50.0, 75.0] {
        let angle = degrees.to_radians();
        let mut camera = look_down(30.0, 2.0);
        let turn = Quat::from_rotation_x(angle as f32);
        camera.position = turn * camera.position;
        camera.forward = turn * camera.forward;
        camera.up = turn * camera.up;
        let truth: Vec<_> = looks
            .iter()
            .map(|&(c, m, r)| {
                let [c, m, r] = [c, m, r].map(f64::from);
                DVec3::splat(directional_albedo(c, m, r, angle.cos()))
            })
            .collect();
        // 6 × 4 pixels of one metre.
        let expected: Vec<_> = (0..24).map(|ix| truth[ix % 6]).collect();
        let found = batches(&world, &camera, &settings(6, 4, 1), 16384).estimate(Channel::Beauty);
        found.check(&format!("glossy at {degrees}°"), &expected, 0.008);
        println!("    albedos {:.4?}", truth.iter().map(|v| v.x).collect::<Vec<_>>());
        for (ix, look) in looks.iter().enumerate().filter(|(_, look)| look.1 == 1.0) {
            assert!(
                truth[ix].x <= 1.0,
                "(colour, metallic, roughness) {look:?} at {degrees}°: the closed form's albedo is {}, expected at most 1",
                truth[ix].x
            );
        }
    }
}

/// A sphere with smooth normals, its poles along Y.
fn sphere(center: Vec3, radius: f32, material: usize) -> Mesh {
    let (rings, sectors) = (24u32, 48u32);
    let mut mesh = Mesh { material, ..Mesh::default() };
    for ring in 0..=rings {
        let theta = std::f32::consts::PI * ring as f32 / rings as f32;
        for sector in 0..=sectors {
            let phi = std::f32::consts::TAU * sector as f32 / sectors as f32;
            let n = Vec3::new(theta.sin() * phi.cos(), theta.cos(), -theta.sin() * phi.sin());
            mesh.positions.push(center + radius * n);
            mesh.normals.push(n.normalize());
        }
    }
    for ring in 0..rings {
        for sector in 0..sectors {
            let at = ring * (sectors + 1) + sector;
            let below = at + sectors + 1;
            mesh.triangles.push([at, below, below + 1]);
            mesh.triangles.push([at, below + 1, at + 1]);
        }
    }
    mesh
}

/// White metals and white dielectrics of any roughness never show more than the sky's 1. (A rough
/// metal shows 0.34: light that meets two microfacets is lost.) Each pixel's own noise is allowed
/// for, at the suite's level.
#[test]
fn glossy_spheres_under_a_white_sky() {
    let looks = [
        (1.0, 0.0),
        (1.0, 0.3),
        (1.0, 0.6),
        (1.0, 1.0),
        (0.0, 0.0),
        (0.0, 0.3),
        (0.0, 0.6),
        (0.0, 1.0),
    ];
    let materials = looks.map(|(metallic, roughness)| material(1.0, metallic, roughness)).to_vec();
    let spheres =
        (0..8).map(|k| sphere(Vec3::new(2.0 * k as f32 - 7.0, 0.0, 0.0), 1.0, k)).collect();
    let mut world = scene(spheres, materials);
    // Without interreflection: a bounce limit of 0 sees the sky only.
    world.sky = Sky::Constant(Vec3::ONE);
    let world = on_gpu(&world, false, RaySource::Software);
    let found = batches(&world, &look_down(3.0, 1.0), &settings(64, 8, 0), 1024);
    let sums = render(&world, &look_down(3.0, 1.0), &settings(64, 8, 0), 64);
    let surfaces = resolve(&sums, UVec2::new(64, 8), Channel::Albedo);
    let beauty = found.estimate(Channel::Beauty);
    let mut means = [0.0; 8];
    let mut counts = [0.0; 8];
    let n_pixels = beauty.numbers().len() / 3;
    for (ix, pixel) in beauty.numbers().iter().step_by(3).enumerate() {
        let k = ix % 64 / 8;
        let limit = 1.0 + pixel.limit(n_pixels) * pixel.error + 1e-4;
        let Estimate { mean, error, .. } = *pixel;
        assert!(
            mean <= limit,
            "metallic, roughness {:?}: radiance of pixel {ix} is {mean} ± {error}, expected at most {limit}",
            looks[k]
        );
        // Only pixels that the sphere fills.
        if surfaces.rgb[ix].x == 1.0 {
            means[k] += mean;
            counts[k] += 1.0;
        }
    }
    for k in 0..8 {
        let mean = means[k] / counts[k];
        println!("metallic, roughness {:?}: mean {mean:.4} over {} pixels", looks[k], counts[k]);
        assert!(
            mean <= 1.0 + 1e-3 && mean > 0.3,
            "metallic, roughness {:?}: mean radiance {mean}, expected 0.3 to 1.001",
            looks[k]
        );
    }
}
