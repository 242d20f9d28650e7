// SPDX-License-Identifier: MIT OR Apache-2.0
//! The kernels with which `voxel-rt` and `voxel-cone` light a picture's pixels, over surfaces and voxels that are made up.

use crate::bsdf::Material;
use crate::harness::{
    Estimate, Largest, Random, Tolerance, assert_each, assert_estimates, gpu, submit,
};
use crate::picture::{
    Picture, PixelRecord, above, bytes, camera, color, on_plane, pixel_module, random_surface,
    target, texels, texture_of_bytes,
};
use crate::statistics::{over_hemisphere, way_out_of_cube};
use bytemuck::Zeroable;
use glam::{DVec3, IVec2, IVec3, Mat4, UVec2, UVec3, UVec4, Vec3, Vec4};
use lucerna::components::voxel_light::{CacheBuffers, VoxelLevel, VoxelLevels, sparse_grid};
use lucerna::components::voxel_pyramid::{PrefilterPass, Pyramid, PyramidStorage};
use lucerna::components::voxels::VoxelGrid;
use lucerna::gpu::{ComputeKernel, Dispatch, Shaders};
use lucerna::settings;
use lucerna::shader::Variant;
use std::f64::consts::PI;

/// Light of each of six faces (+X −X +Y −Y +Z −Z).
fn face_colors() -> [Vec3; 6] {
    let mut random = Random(70);
    std::array::from_fn(|_| 0.5 + color(&mut random))
}

/// Light varies from cell to cell by this, per cell.
const SLOPE: Vec3 = Vec3::new(0.03, -0.05, 0.07);

/// Grids that are full: every cell has a voxel, whose faces have `face_colors` · (1 + SLOPE · centre).
fn full_levels(grids: &[(Vec3, f32, UVec3)], n_faces: u32) -> CacheBuffers {
    let mut layout = VoxelLevels::zeroed();
    layout.n_levels = grids.len() as u32;
    let (mut words, mut light) = (Vec::new(), Vec::new());
    for (level, &(origin, cell, size)) in grids.iter().enumerate() {
        let all: Vec<_> = (0..size.element_product())
            .map(|ix| UVec3::new(ix % size.x, ix / size.x % size.y, ix / (size.x * size.y)))
            .collect();
        let (grid, structure) = sparse_grid(origin, cell, size, n_faces, &all);
        layout.levels[level] = settings!(VoxelLevel {
            grid,
            first_brick: words.len() as u32,
            first_record: light.len() as u32,
            first_side: (words.len() + structure.len()) as u32,
            ..Zeroable::zeroed()
        });
        for &[packed, _] in &structure[grid.bricks.element_product() as usize..] {
            let center =
                UVec3::new(packed & 1023, packed >> 10 & 1023, packed >> 20).as_vec3() + 0.5;
            let colors = face_colors().into_iter().take(n_faces as usize);
            light.extend(colors.map(|of| (of * (1.0 + SLOPE.dot(center))).extend(1.0)));
        }
        // Nothing is known of the records' sides.
        let n_sides = 2 * structure.len() * n_faces as usize;
        words.extend(structure);
        words.extend(vec![[0; 2]; n_sides]);
    }
    let buffers =
        CacheBuffers::new(gpu(), &layout, words.len() as u32, light.len() as u32).unwrap();
    gpu().queue.write_buffer(&buffers.structure, 0, bytemuck::cast_slice(&words));
    gpu().queue.write_buffer(&buffers.shown, 0, bytemuck::cast_slice(&light));
    buffers
}

/// What `voxel_rt/shade` writes for a picture.
fn shaded(picture: &Picture, buffers: &CacheBuffers, lookup: u32, shown: u32) -> Vec<Vec4> {
    let shaders = Shaders::default().with_module(pixel_module());
    let kernel = ComputeKernel::new(gpu(), &shaders, None, "voxel_rt/shade");
    let light = target(picture.size());
    submit(|recorder| {
        kernel
            .call(&mut recorder.compute("test"))
            .uniform("info", &UVec4::new(lookup, shown, 0, 0))
            .bind("indirect", &light)
            .with(buffers.field(&buffers.shown))
            .with(picture.bindings())
            .dispatch(Dispatch::Area(picture.size()));
    });
    texels(&light)
}

/// In full voxels whose light changes linearly, every look-up gives that function: faces weighted by the squares of the
/// normal's components, at the point, or half a cell in front of it where only valid cells count. Lambertian surfaces
/// reflect ρ/π of it; others what the fit of their albedo says, which is good to 0.05. Tolerance: 50 roundings of sums
/// of up to 3.
#[test]
fn voxel_light_is_reflected_as_its_surface_does() {
    let mut random = Random(71);
    let (origin, cell, size) = (Vec3::new(-2.0, -1.75, -2.25), 0.5, UVec3::new(9, 7, 10));
    for n_faces in [1, 6] {
        let buffers = full_levels(&[(origin, cell, size)], n_faces);
        for (picture_size, lookup) in
            [(UVec2::new(16, 8), 0), (UVec2::new(13, 9), 1), (UVec2::new(5, 21), 2)]
        {
            let picture = Picture::new(picture_size, |pixel| {
                let room = Vec3::splat(2.0);
                let at = Vec3::from_array(std::array::from_fn(|k| {
                    random.range(room[k], size[k] as f32 - room[k])
                }));
                PixelRecord {
                    position: origin + at * cell,
                    is_surface: u32::from((3 * pixel.x + pixel.y) % 5 != 0),
                    lambert: pixel.x % 2,
                    ..random_surface(&mut random)
                }
            });
            for shown in [0, 1] {
                let found = shaded(&picture, &buffers, lookup, shown);
                for (ix, (pixel, texel)) in picture.records.iter().zip(&found).enumerate() {
                    let what = format!(
                        "{n_faces} faces, look-up {lookup}, shown {shown}, pixel {ix}, {pixel:?}"
                    );
                    let normal = pixel.shading_normal.as_dvec3();
                    let ahead = if lookup == 0 { 0.5 } else { 0.0 };
                    let at =
                        (pixel.position - origin).as_dvec3() / f64::from(cell) + ahead * normal;
                    let colors = face_colors().map(|of| of.as_dvec3());
                    let mut irradiance = colors[0];
                    if n_faces == 6 {
                        irradiance = (0..3)
                            .map(|axis| {
                                let face = 2 * axis + usize::from(normal[axis] < 0.0);
                                normal[axis] * normal[axis] * colors[face]
                            })
                            .sum();
                    }
                    irradiance *= 1.0 + SLOPE.as_dvec3().dot(at);
                    let material = Material::new(pixel.albedo, pixel.metallic, pixel.roughness);
                    let (expected, bound) = if pixel.is_surface == 0 {
                        (DVec3::ZERO, 0.0)
                    } else if shown == 1 {
                        (irradiance, 1e-5)
                    } else if pixel.lambert != 0 {
                        (pixel.albedo.as_dvec3() * irradiance / PI, 1e-5)
                    } else {
                        let cosine = pixel.to_viewer.as_dvec3().dot(normal);
                        let wo = DVec3::new((1.0 - cosine * cosine).max(0.0).sqrt(), 0.0, cosine);
                        let light = irradiance / PI;
                        (material.albedo(wo, 30) * light, 0.05 * light.max_element())
                    };
                    let off = (texel.truncate().as_dvec3() - expected).largest();
                    assert!(
                        off <= bound && texel.w == 1.0,
                        "{what}: {texel}, expected {expected} to {bound:e}"
                    );
                }
            }
        }
    }
}

/// M. Jarzynski, M. Olano, "Hash Functions for GPU Rendering", JCGT 9(3), 2020, listing of pcg3d.
fn pcg3d(mut v: [u32; 3]) -> [u32; 3] {
    let mix = |v: &mut [u32; 3]| {
        v[0] = v[0].wrapping_add(v[1].wrapping_mul(v[2]));
        v[1] = v[1].wrapping_add(v[2].wrapping_mul(v[0]));
        v[2] = v[2].wrapping_add(v[0].wrapping_mul(v[1]));
    };
    v = v.map(|k| k.wrapping_mul(1_664_525).wrapping_add(1_013_904_223));
    mix(&mut v);
    v = v.map(|k| k ^ k >> 16);
    mix(&mut v);
    v
}

/// The inspected cell is the finest level's at the point, a hundredth of a cell in front of the surface, down to half a cell
/// within that level's border; farther out the last level's. Colours: of levels red, green, blue; of cells the hash
/// of the cell and 1024 times its level.
#[test]
fn inspected_cells_are_those_of_the_finest_level() {
    let mut random = Random(72);
    let grids = [
        (Vec3::new(-1.0, -1.0, -1.0), 0.25, UVec3::splat(8)),
        (Vec3::new(-2.0, -2.0, -2.5), 0.5, UVec3::new(8, 9, 10)),
        (Vec3::new(-5.0, -4.0, -6.0), 1.0, UVec3::new(10, 8, 12)),
    ];
    let buffers = full_levels(&grids, 6);
    let mut n_seen = [0; 3];
    let picture = Picture::new(UVec2::new(37, 22), |pixel| {
        let reach = [0.9, 1.9, 3.5][(pixel.x % 3) as usize];
        let mut component = || random.range(-reach, reach);
        let position = Vec3::new(component(), component(), component());
        PixelRecord { position, ..random_surface(&mut random) }
    });
    let levels = shaded(&picture, &buffers, 0, 3);
    let cells = shaded(&picture, &buffers, 0, 2);
    for (ix, pixel) in picture.records.iter().enumerate() {
        let in_grid = |level: usize| {
            let (origin, cell, _) = grids[level];
            (pixel.position - origin).as_dvec3() / f64::from(cell)
        };
        let room = |level: usize| {
            let at = in_grid(level);
            at.min(grids[level].2.as_dvec3() - at).min_element() - 0.5
        };
        let level = (0..2).find(|&level| room(level) > 0.0).unwrap_or(2);
        let inside = in_grid(level) + 0.01 * pixel.geometric_normal.as_dvec3();
        let to_border = (inside - inside.round()).abs().min_element();
        if room(0).abs().min(room(1).abs()) < 1e-4 || to_border < 1e-4 {
            continue;
        }
        n_seen[level] += 1;
        let color = [Vec3::X, Vec3::Y, Vec3::Z][level];
        assert_eq!(levels[ix], color.extend(1.0), "level of pixel {ix}, {pixel:?}, in {level}");
        let cell = inside.floor().as_uvec3() + 1024 * level as u32;
        let hash = pcg3d(cell.to_array()).map(|word| (word >> 8) as f32 / 16_777_216.0);
        let found = cells[ix];
        assert_eq!(found, Vec3::from(hash).extend(1.0), "cell {cell} of pixel {ix}, {pixel:?}");
    }
    assert!(n_seen.iter().all(|&n| n > 50), "{n_seen:?}");
}

/// `OPAQUE_DEPTH` of `cone/medium.wgsl`.
const OPAQUE: f32 = 3.25;

/// Voxels in a cube of 8 m around the origin, of 0.25 m. `texel`: that of all faces of a cell.
fn cube(storage: PyramidStorage, texel: impl Fn(IVec3) -> [f32; 4]) -> Pyramid {
    let grid = VoxelGrid {
        origin: Vec3::splat(-4.0),
        cell: 0.25,
        size: UVec3::splat(32),
        n_faces: 6,
        bricks: UVec3::new(8, 8, 16),
        capacity: 1,
    };
    let pyramid = Pyramid::new(gpu(), &[grid], storage, false).unwrap();
    pyramid.write_base(gpu(), 0, |cell, _| texel(cell.as_ivec3()));
    let pass = PrefilterPass::new(gpu(), &pyramid);
    submit(|recorder| pass.record(recorder, &pyramid));
    pyramid
}

/// A hollow cube, whose walls, three cells thick, are opaque and shine; `light`: radiance of the wall at x = +4, x = −4,
/// y = +4, and so on.
fn hollow_cube(light: [Vec3; 6], storage: PyramidStorage) -> Pyramid {
    cube(storage, |at| {
        let wall = (0..6).find(|&side| {
            let along = at[side / 2];
            if side % 2 == 0 { along >= 29 } else { along < 3 }
        });
        wall.map_or([0.0; 4], |side| (light[side] * OPAQUE).extend(OPAQUE).to_array())
    })
}

/// A cube of the same medium everywhere. `depth`: of a cell.
fn filled_cube(light: Vec3, depth: f32, storage: PyramidStorage) -> Pyramid {
    cube(storage, |_| (light * depth).extend(depth).to_array())
}

#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
struct ConeShade {
    step_scale: f32,
    mip_bias: f32,
    opacity_threshold: f32,
    start_cells: f32,
    n_cones: u32,
    has_specular: u32,
    specular_spread: f32,
    has_occlusion: u32,
}

const CONES: ConeShade = ConeShade {
    step_scale: 0.5,
    mip_bias: 0.0,
    opacity_threshold: 0.95,
    start_cells: 1.0,
    n_cones: 9,
    has_specular: 0,
    specular_spread: 0.0,
    has_occlusion: 0,
};

/// What `voxel_cone/shade` writes for a picture. `occlusion`: openness in 255ths.
fn cone_shaded(
    picture: &Picture,
    pyramid: &Pyramid,
    info: ConeShade,
    occlusion: Option<&[[u8; 4]]>,
) -> Vec<Vec4> {
    let shaders = Shaders::new(pyramid.variant(Variant::BASELINE)).with_module(pixel_module());
    let kernel = ComputeKernel::new(gpu(), &shaders, None, "voxel_cone/shade");
    let light = target(picture.size());
    let info = ConeShade { has_occlusion: u32::from(occlusion.is_some()), ..info };
    let open = match occlusion {
        Some(texels) => texture_of_bytes(picture.size(), texels),
        None => texture_of_bytes(UVec2::ONE, &[[0; 4]]),
    };
    submit(|recorder| {
        kernel
            .call(&mut recorder.compute("test"))
            .uniform("info", &info)
            .bind("occlusion", &open)
            .bind("indirect", &light)
            .with(pyramid.field())
            .with(picture.bindings())
            .dispatch(Dispatch::Area(picture.size()));
    });
    texels(&light)
}

/// A surface near the middle of the cube.
fn near_middle(random: &mut Random) -> PixelRecord {
    let mut found = random_surface(random);
    found.position *= 0.25;
    found
}

/// In a dense medium of one radiance, a surface whose normals agree reflects ρ·L, where ρ is the diffuse term's
/// share: Lambert's albedo, or (1 − F(cosθ))·(1 − f₀)·20/21·(1 − metallic)·c. Openness close by scales it. Nothing is open
/// within a metre. Tolerance: cones end at an opacity of 95 % and are scaled up
/// to 1, so some 100 roundings are left, and 1/1024 of 16-bit texels; 1/510 of an 8-bit openness.
#[test]
fn cones_gather_what_diffuse_surfaces_reflect() {
    let mut random = Random(73);
    let light = Vec3::new(3.0, 1.0, 0.5);
    for (size, storage, n_cones, near, has_occlusion) in [
        (UVec2::new(8, 8), PyramidStorage::Textures, 5, 1.0f32, false),
        (UVec2::new(13, 9), PyramidStorage::Buffers, 9, 20.0, true),
        (UVec2::new(1, 17), PyramidStorage::Textures, 16, 0.0, true),
        (UVec2::new(19, 3), PyramidStorage::Textures, 6, 20.0, false),
    ] {
        let pyramid = filled_cube(light, OPAQUE, storage);
        let mut picture = Picture::new(size, |pixel| {
            let mut found = near_middle(&mut random);
            found.is_surface = u32::from((pixel.x + pixel.y) % 6 != 5);
            found.lambert = pixel.x % 2;
            found.geometric_normal = found.shading_normal;
            found
        });
        picture.view.occlusion_distance = near;
        (picture.view.frame, picture.view.seed) = (n_cones, 3);
        let n = size.element_product() as usize;
        let open: Vec<[u8; 4]> = (0..n).map(|_| (random.bits() as u32).to_le_bytes()).collect();
        let info = ConeShade { n_cones, ..CONES };
        let found = cone_shaded(&picture, &pyramid, info, has_occlusion.then_some(&open));
        for (ix, (pixel, texel)) in picture.records.iter().zip(&found).enumerate() {
            let what = format!("{n_cones} cones, near {near}, pixel {ix}, {pixel:?}");
            if pixel.is_surface == 0 {
                assert_eq!(*texel, Vec4::W, "{what}: sky");
                continue;
            }
            let base = pixel.albedo.as_dvec3();
            let mut albedo = base;
            if pixel.lambert == 0 {
                let metallic = f64::from(pixel.metallic);
                let f_zero = DVec3::splat(0.04).lerp(base, metallic);
                let cosine = pixel.to_viewer.as_dvec3().dot(pixel.shading_normal.as_dvec3());
                let fresnel = f_zero + (1.0 - f_zero) * (1.0 - cosine).powi(5);
                albedo = (1.0 - fresnel) * (1.0 - f_zero) * 20.0 / 21.0 * (1.0 - metallic) * base;
            }
            let open = if has_occlusion { f64::from(open[ix][0]) / 255.0 } else { 1.0 };
            let expected = open * albedo * light.as_dvec3();
            let off = (texel.truncate().as_dvec3() - expected).largest();
            assert!(off < 4e-3, "{what}: {texel}, expected {expected} to 4e-3");
            let near_open = if near == 0.0 { open } else { 0.0 };
            let off = (f64::from(texel.w) - near_open).abs();
            assert!(off < 1e-3, "{what}: openness {}, expected {near_open} to 1e-3", texel.w);
        }
    }
}

/// A metal mirrors the wall that its specular cone meets: the wall's radiance times the albedo of the specular term, which
/// the fit gives to 0.05, along the mirrored direction; times how open that cone is. (Narrow cones, 5° from the cube's
/// edges.) Where the mirrored direction leads below the surface, nothing is reflected.
#[test]
fn metals_mirror_the_wall_that_their_cone_meets() {
    let mut random = Random(74);
    let light: [Vec3; 6] =
        std::array::from_fn(|side| Vec3::splat(1.0 + side as f32) + Vec3::new(0.0, 0.5, 0.25));
    let pyramid = hollow_cube(light, PyramidStorage::Textures);
    let size = UVec2::new(33, 15);
    let picture = Picture::new(size, |_| PixelRecord { metallic: 1.0, ..near_middle(&mut random) });
    let n = size.element_product() as usize;
    let open: Vec<[u8; 4]> = (0..n).map(|_| (random.bits() as u32).to_le_bytes()).collect();
    let info = ConeShade { has_specular: 1, specular_spread: 0.02, ..CONES };
    let found = cone_shaded(&picture, &pyramid, info, Some(&open));
    let (mut n_mirrored, mut n_below) = (0, 0);
    for (ix, (pixel, texel)) in picture.records.iter().zip(&found).enumerate() {
        let normal = pixel.shading_normal.as_dvec3().normalize();
        let plane = pixel.geometric_normal.as_dvec3();
        let viewer = pixel.to_viewer.as_dvec3();
        let cosine = viewer.dot(normal);
        let mirrored = 2.0 * cosine * normal - viewer;
        if mirrored.dot(plane).abs() < 0.3 && mirrored.dot(plane) > -1e-3 {
            continue; // Grazing cones read the cells in front of their own plane, which here are empty, for long.
        }
        let what = format!("pixel {ix}, {pixel:?}");
        if mirrored.dot(plane) < 0.0 {
            n_below += 1;
            assert_eq!(texel.truncate(), Vec3::ZERO, "{what}: below the surface");
            continue;
        }
        // The walls' inner sides are at 3.25 m; cones start one cell above the surface.
        let start = pixel.position.as_dvec3() + plane * 0.25 * plane.abs().element_sum();
        let reach = DVec3::from_array(std::array::from_fn(|k| {
            (mirrored[k].signum() * 3.25 - start[k]) / mirrored[k]
        }));
        let axis = (0..3).min_by(|&a, &b| reach[a].total_cmp(&reach[b])).unwrap();
        let hit = start + reach[axis] * mirrored;
        let others = [hit[(axis + 1) % 3].abs(), hit[(axis + 2) % 3].abs()];
        if others[0].max(others[1]) > 2.7 {
            continue;
        }
        let side = 2 * axis + usize::from(mirrored[axis] < 0.0);
        let material = Material::new(pixel.albedo, 1.0, pixel.roughness);
        let wo = DVec3::new((1.0 - cosine * cosine).max(0.0).sqrt(), 0.0, cosine);
        let seen = light[side].as_dvec3() * f64::from(open[ix][1]) / 255.0;
        let expected = material.albedo(wo, 30) * seen;
        let bound = 0.055 * seen.max_element();
        let off = (texel.truncate().as_dvec3() - expected).largest();
        n_mirrored += 1;
        assert!(off <= bound, "{what}: {texel}, expected {expected} to {bound:.4}");
    }
    assert!(n_mirrored > 150 && n_below > 5, "{n_mirrored} mirrored, {n_below} below");
}

/// Through a thin medium that fills the cube, a cone finds L·(1 − e^(−τ)) on its way d to the cube's border, where τ = σ·d
/// times |ω|'s sum, for each axis's faces hide by their projected area: the mean over a picture of one surface is the
/// hemisphere's, by quadrature in f64 from where cones start. Filtering softens the border by half a cell of up to 1 m: 2 %.
/// What is open within the distance a is e^(−τ) up to there, or up to 0.35 cells before, for a wall at its end counts half:
/// cells grow to half of the way.
#[test]
fn cones_find_the_depth_of_their_way() {
    let depth = 0.03f32;
    let extinction = f64::from(depth) / 0.25;
    let pyramid = filled_cube(Vec3::ONE, depth, PyramidStorage::Textures);
    for (position, normal) in [
        (Vec3::new(2.0, 1.0, -1.5), Vec3::new(0.6, 0.0, 0.8)),
        (Vec3::new(-2.5, 0.5, 2.5), Vec3::NEG_X),
        (Vec3::new(-2.5, 0.5, 2.5), Vec3::X),
        (Vec3::new(0.5, -3.0, 0.0), Vec3::Y),
    ] {
        let mut picture = Picture::new(UVec2::splat(24), |_| PixelRecord {
            position,
            geometric_normal: normal,
            shading_normal: normal,
            to_viewer: normal,
            albedo: Vec3::ONE,
            is_surface: 1,
            lambert: 1,
            depth: 1.0,
            ..PixelRecord::zeroed()
        });
        picture.view.occlusion_distance = 2.0;
        let found = cone_shaded(&picture, &pyramid, CONES, None);
        let mean = found.iter().map(|of| of.as_dvec4()).sum::<glam::DVec4>() / found.len() as f64;
        let start =
            position.as_dvec3() + 0.25 * normal.as_dvec3() * f64::from(normal.abs().element_sum());
        let density = |direction: DVec3| extinction * direction.abs().element_sum();
        let over = |f: &dyn Fn(DVec3) -> f64| over_hemisphere(normal.as_dvec3(), 200, f);
        let expected = over(&|d| 1.0 - (-density(d) * way_out_of_cube(start, d)).exp());
        let open = [2.0, 2.0 - 0.35 * 1.0]
            .map(|near: f64| over(&|d| (-density(d) * way_out_of_cube(start, d).min(near)).exp()));
        let off = mean.x / expected - 1.0;
        let what = format!("from {position} along {normal}");
        println!("{what}: {:.4}, expected {expected:.4}; open {:.4} in {open:.4?}", mean.x, mean.w);
        assert!(off.abs() < 0.02, "{what}: {:.4}, expected {expected:.4} to 2 %", mean.x);
        let [low, high] = open;
        assert!(
            (low..high).contains(&mean.w),
            "{what}: open {:.4} not in {low:.4}..{high:.4}",
            mean.w
        );
    }
}

/// Directions drawn from the specular lobe reflect its albedo of even light, on average over the pixels, by the mean's
/// standard errors.
#[test]
fn drawn_reflections_have_the_lobes_albedo() {
    let light = Vec3::new(2.0, 1.0, 0.5);
    let pyramid = hollow_cube([light; 6], PyramidStorage::Textures);
    for (roughness, cosine) in [(0.3f32, 0.9f32), (0.6, 0.5), (1.0, 0.7)] {
        let size = UVec2::new(32, 32);
        let sine = (1.0 - cosine * cosine).sqrt();
        let picture = Picture::new(size, |_| PixelRecord {
            geometric_normal: Vec3::Z,
            shading_normal: Vec3::Z,
            to_viewer: Vec3::new(0.6 * sine, 0.8 * sine, cosine),
            albedo: Vec3::new(1.0, 0.7, 0.4),
            metallic: 1.0,
            roughness,
            is_surface: 1,
            depth: 1.0,
            ..PixelRecord::zeroed()
        });
        let found = cone_shaded(&picture, &pyramid, ConeShade { has_specular: 1, ..CONES }, None);
        let share = |k: usize| Estimate::of(found.iter().map(|of| f64::from(of[k] / light[k])));
        let wo = DVec3::new(f64::from(sine), 0.0, f64::from(cosine));
        let material = Material::new(Vec3::new(1.0, 0.7, 0.4), 1.0, roughness);
        let expected = material.albedo(wo, 60);
        // The lobe's weight is exact but for the rounding of the half vector; texels are 16-bit floats.
        let (bias, resolves) = (Tolerance::absolute(2e-3), Tolerance::absolute(0.1));
        let what = format!("reflected share, roughness {roughness}, cosine {cosine}");
        assert_estimates(&what, &[0, 1, 2].map(share), &expected.to_array(), bias, resolves);
    }
}

/// The picture of a floor at z = −5 and, where `nearer` says so, something that stands on it.
fn floor_with(size: UVec2, nearer: impl Fn(UVec2) -> f32) -> Picture {
    let half = 0.25;
    let camera = camera(size, half);
    let mut picture = Picture::new(size, |pixel| {
        let depth = 5.0 - nearer(pixel);
        let at = on_plane(size, pixel);
        let position = Vec3::new(at.x * camera.right.x, at.y * camera.up.y, -1.0) * depth;
        PixelRecord {
            position,
            depth,
            geometric_normal: Vec3::Z,
            shading_normal: Vec3::Z,
            to_viewer: (-position).normalize(),
            roughness: 0.5,
            is_surface: 1,
            ..PixelRecord::zeroed()
        }
    });
    picture.view.camera = camera;
    // (x, y, near, z) in the camera's axes.
    let (near, aspect) = (picture.view.near, size.x as f32 / size.y as f32);
    picture.view.clip_from_world =
        Mat4::from_cols(Vec4::X / (half * aspect), Vec4::Y / half, Vec4::NEG_W, Vec4::Z * near);
    picture
}

/// What `voxel_cone/occlusion` writes.
fn openness(
    picture: &Picture,
    entry: &str,
    start_cells: f32,
    spread: f32,
    size: UVec2,
) -> Vec<f64> {
    let grid = VoxelGrid {
        origin: Vec3::new(-8.0, -8.0, -8.0),
        cell: 0.25,
        size: UVec3::splat(64),
        n_faces: 6,
        bricks: UVec3::new(16, 16, 32),
        capacity: 1,
    };
    let pyramid = Pyramid::new(gpu(), &[grid], PyramidStorage::Textures, false).unwrap();
    let shaders = Shaders::default().with_module(pixel_module());
    let name = "voxel_cone/occlusion";
    let kernel = ComputeKernel::with_entry(gpu(), &shaders, None, name, Some(entry), &[]);
    let open = texture_of_bytes(size, &vec![[7, 7, 7, 7]; size.element_product() as usize]);
    submit(|recorder| {
        kernel
            .call(&mut recorder.compute("test"))
            .uniform("info", &Vec4::new(start_cells, spread, 0.0, 0.0))
            .bind("open", &open)
            .bind("pyramid", pyramid.uniform())
            .with(picture.bindings())
            .dispatch(Dispatch::Area(size));
    });
    bytes(&open).iter().map(|of| f64::from(of[0]) / 255.0).collect()
}

/// Beside a wall of height h that stands on the floor, the cosine-weighted share that the wall hides is (1 − d/√(d² + h²))/2
/// at the distance d: a long strip's form factor. Half of the picture is h nearer. The mean over a column; four steps a
/// cone and spheres of its width leave 0.06. An open floor is open everywhere, to half of 1/255; what is not a surface is
/// open.
#[test]
fn openness_close_by_is_that_of_a_strip() {
    let size = UVec2::new(129, 61);
    let quarter = (size + 1) / 2;
    let open = openness(&floor_with(size, |_| 0.0), "diffuse", 1.0, 0.0, quarter);
    assert!(open.iter().all(|&share| share == 1.0), "an open floor: {open:?}");
    let high = 0.2;
    let mut picture = floor_with(size, |pixel| if pixel.x >= 65 { high } else { 0.0 });
    let mut means = vec![0.0; 33];
    const N_FRAMES: u32 = 4;
    for frame in 0..N_FRAMES {
        picture.view.frame = frame;
        let open = openness(&picture, "diffuse", 1.0, 0.0, quarter);
        for (column, mean) in means.iter_mut().enumerate() {
            let rows = (0..quarter.y).map(|row| open[row as usize * quarter.x as usize + column]);
            *mean += rows.sum::<f64>() / f64::from(quarter.y * N_FRAMES);
        }
    }
    for (column, &mean) in means.iter().enumerate() {
        let d = distance_to_step(column, f64::from(high));
        let expected = 0.5 + 0.5 * d / (d * d + 0.04f64).sqrt();
        println!("{d:.3} m: {mean:.3}, expected {expected:.3}");
        assert!((mean - expected).abs() < 0.06, "{d:.3} m: {mean:.3}, expected {expected:.3}");
    }
}

/// Cones that a bent normal turns below the surface do not meet it: an open floor is open whatever its shading normals, up to
/// 100° from its own, where none of the cones is above it.
#[test]
fn bent_normals_leave_an_open_floor_open() {
    let size = UVec2::new(65, 31);
    for degrees in [30.0f32, 60.0, 89.0, 100.0] {
        let mut picture = floor_with(size, |_| 0.0);
        let (y, z) = degrees.to_radians().sin_cos();
        for record in &mut picture.records {
            record.shading_normal = Vec3::new(0.0, y, z);
        }
        picture.upload();
        let open = openness(&picture, "diffuse", 1.0, 0.0, (size + 1) / 2);
        assert_each(&format!("openness, normals bent by {degrees}°"), &open, "1", |&share| {
            share == 1.0
        });
    }
}

/// From the middle of a column of the quarter picture to the foot of what stands on its right half, `high` high [m]: the foot is
/// at the border of pixel 65, as it is seen at that height.
fn distance_to_step(column: usize, high: f64) -> f64 {
    let width = |depth: f64| 2.0 * 0.25 * depth / 61.0;
    (65.0 - 64.5) * width(5.0 - high) + (64.5 - (2.0 * column as f64 + 0.5)) * width(5.0)
}

/// The openness of pixels, as two kernels write it, becomes that of the picture: the diffuse one, of every second pixel,
/// from the four nearest weighted by their distance and by how alike their surfaces are; the specular one from 7 × 7 by a Gaussian of
/// 1.5 pixels and likeness: e^(−(distance off the plane)/(depth/100)) · max(n·n', 0)^16. In f64; 8-bit results.
#[test]
fn openness_is_filtered_within_surfaces() {
    let mut random = Random(75);
    let shaders = Shaders::default().with_module(pixel_module());
    let kernel = ComputeKernel::new(gpu(), &shaders, None, "voxel_cone/occlusion_resolve");
    for (case, size) in
        [UVec2::ONE, UVec2::new(8, 8), UVec2::new(13, 9), UVec2::new(2, 31)].into_iter().enumerate()
    {
        let (has_diffuse, has_specular) = (u32::from(case != 2), u32::from(case != 1));
        let (one, other) = (random.direction(), random.direction());
        let picture = Picture::new(size, |pixel| {
            let normal = if pixel.x < size.x / 2 { one } else { other };
            let lean = normal + 0.1 * random.direction();
            PixelRecord {
                position: 0.03 * Vec3::new(pixel.x as f32, pixel.y as f32, random.unit()),
                depth: random.range(2.0, 3.0),
                geometric_normal: lean.as_dvec3().normalize().as_vec3(),
                shading_normal: above(&mut random, Vec3::X),
                is_surface: u32::from(random.unit() < 0.8),
                ..PixelRecord::zeroed()
            }
        });
        let quarter = (size + 1) / 2;
        let random_texels = |random: &mut Random, size: UVec2| -> Vec<[u8; 4]> {
            (0..size.element_product()).map(|_| (random.bits() as u32).to_le_bytes()).collect()
        };
        let diffuse = random_texels(&mut random, quarter);
        let specular = random_texels(&mut random, size);
        let out = texture_of_bytes(size, &vec![[7; 4]; specular.len()]);
        let (diffuse_texture, specular_texture) =
            (texture_of_bytes(quarter, &diffuse), texture_of_bytes(size, &specular));
        submit(|recorder| {
            kernel
                .call(&mut recorder.compute("test"))
                .uniform("info", &UVec4::new(has_diffuse, has_specular, 0, 0))
                .bind("diffuse_open", &diffuse_texture)
                .bind("specular_open", &specular_texture)
                .bind("occlusion", &out)
                .with(picture.bindings())
                .dispatch(Dispatch::Area(size));
        });
        let record = |at: UVec2| &picture.records[(at.y * size.x + at.x) as usize];
        let alike = |a: &PixelRecord, b: &PixelRecord| {
            let normal = a.geometric_normal.as_dvec3();
            let off = (b.position - a.position).as_dvec3().dot(normal).abs();
            let cosine = normal.dot(b.geometric_normal.as_dvec3()).max(0.0);
            (-off / (0.01 * f64::from(a.depth))).exp() * cosine.powi(16)
        };
        for (ix, found) in bytes(&out).iter().enumerate() {
            let pixel = UVec2::new(ix as u32 % size.x, ix as u32 / size.x);
            let here = record(pixel);
            let (mut sum, mut total) = (0.0, 0.0);
            for corner in [UVec2::ZERO, UVec2::X, UVec2::Y, UVec2::ONE] {
                let texel = (pixel / 2 + corner).min(quarter - 1);
                let there = record((2 * texel).min(size - 1));
                let share = (pixel % 2).as_dvec2() * 0.5;
                let along = |k: usize| if corner[k] == 1 { share[k] } else { 1.0 - share[k] };
                // However different they are, the nearest ones count a thousandth.
                let weight = along(0) * along(1) * (alike(here, there) + 1e-3);
                if there.is_surface != 0 {
                    sum += weight * f64::from(diffuse[(texel.y * quarter.x + texel.x) as usize][0]);
                    total += weight;
                }
            }
            let upsampled = if total > 0.0 { sum / total } else { 255.0 };
            let (mut sum, mut total) = (0.0, 0.0);
            for (dx, dy) in (-3..=3).flat_map(|dy| (-3..=3).map(move |dx| (dx, dy))) {
                let at = pixel.as_ivec2() + IVec2::new(dx, dy);
                if at.cmplt(IVec2::ZERO).any() || at.cmpge(size.as_ivec2()).any() {
                    continue;
                }
                let there = record(at.as_uvec2());
                let near = (-0.5 * f64::from(dx * dx + dy * dy) / (1.5 * 1.5)).exp();
                if there.is_surface != 0 {
                    let weight = near * alike(here, there);
                    sum += weight * f64::from(specular[(at.y * size.x as i32 + at.x) as usize][0]);
                    total += weight;
                }
            }
            let smoothed = if total > 0.0 { sum / total } else { 255.0 };
            let of = |is_on: u32, value: f64| {
                if is_on != 0 && here.is_surface != 0 { value } else { 255.0 }
            };
            let expected = [of(has_diffuse, upsampled), of(has_specular, smoothed)];
            for (k, name) in ["diffuse", "specular"].into_iter().enumerate() {
                let off = (f64::from(found[k]) - expected[k]).abs();
                // (Half a step of rounding; and weights are powers and exponentials, which GPUs find to 2⁻¹², most to 2⁻²⁰.)
                assert!(
                    off < 0.51 + 255.0 / 4096.0,
                    "{name} openness of pixel {pixel} of {size}: {}, expected {:.3} (of 255, rounded)",
                    found[k],
                    expected[k]
                );
            }
            assert_eq!(&found[2..], [0, 0], "unused channels of pixel {pixel} of {size}");
        }
    }
}

/// The specular cone, 2° wide and 30° above the floor, towards a step of the height h: hidden nearer than h/tan 30°, open
/// farther away, and where it leads away from the step. What is Lambertian, or no surface, is open.
#[test]
fn specular_openness_ends_at_the_step() {
    let size = UVec2::new(129, 21);
    let high = 0.2f32;
    let (sin, cos) = 30f32.to_radians().sin_cos();
    let mut n_hidden = 0;
    for towards in [true, false] {
        let mut picture = floor_with(size, |pixel| if pixel.x < 40 { high } else { 0.0 });
        for (ix, record) in picture.records.iter_mut().enumerate() {
            record.to_viewer = Vec3::new(if towards { cos } else { -cos }, 0.0, sin);
            record.lambert = u32::from(ix / 129 == 3);
            record.is_surface = u32::from(ix / 129 != 5);
        }
        picture.upload();
        let open = openness(&picture, "specular", 1.0, 0.02, size);
        let width = 2.0 * 0.25 * 5.0 / 21.0;
        let shadow = f64::from(high) / 30f64.to_radians().tan();
        for (ix, &found) in open.iter().enumerate() {
            let (x, y) = (ix % 129, ix / 129);
            // The step is seen at its upper edge, 4.8 m away, farther from the middle than its foot.
            let d = (x as f64 + 0.5 - 64.5) * width - (40.0 - 64.5) * width * 4.8 / 5.0;
            if x < 41 || (d - shadow).abs() < 0.12 {
                continue;
            }
            let hidden = towards && y != 3 && y != 5 && d < shadow;
            n_hidden += usize::from(hidden);
            let expected = if hidden { 0.0 } else { 1.0 };
            let what = format!("towards the step: {towards}, row {y}, {d:.3} m from it");
            assert!(
                (found - expected).abs() < 0.02,
                "{what}: open {found:.3}, expected {expected} to 0.02"
            );
        }
    }
    assert!(n_hidden > 30, "{n_hidden} hidden pixels are compared, expected above 30");
}
