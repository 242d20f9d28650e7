// SPDX-License-Identifier: MIT OR Apache-2.0
//! The scene seam over lucerna's own scene, function by function: surfaces with their textures, and the types' functions.

use crate::bsdf::hemispherical_albedo;
use crate::harness::{
    Estimate, Largest, Random, Tolerance, assert_estimates, gpu, map, normal_limit, read, storage,
    submit,
};
use crate::picture::color;
use crate::texture_oracle::sample;
use bytemuck::{NoUninit, Pod, Zeroable};
use glam::{Affine2, Affine3A, DVec2, DVec3, DVec4, UVec4, Vec2, Vec3, Vec4};
use lucerna::gpu::{ComputeKernel, Dispatch};
use lucerna::gpu_scene::{GpuScene, GpuSceneOptions};
use lucerna::scene::{
    AlphaMode, Filter, Image, Instance, Light, Material, Mesh, Scene, Sky, Texture, TextureRef,
    Wrap,
};
use lucerna::seam::SceneSeam;
use lucerna::settings;
use lucerna::shader::Source;

/// Calls `map` of this WGSL for each input, with the scene bound. `wgsl`: imports, the structs `Input` and `Output`, and the
/// function, as for `harness::map`.
fn map_scene<I: NoUninit, O: bytemuck::AnyBitPattern + NoUninit>(
    scene: &GpuScene,
    wgsl: &str,
    inputs: &[I],
) -> Vec<O> {
    let text = format!(
        "{wgsl}
@group(1) @binding(0) var<storage, read> inputs: array<Input>;
@group(1) @binding(1) var<storage, read_write> outputs: array<Output>;
@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {{
    if id.x < arrayLength(&inputs) {{
        outputs[id.x] = map(inputs[id.x]);
    }}
}}
"
    );
    let shaders = scene.shaders().with_module(Source {
        import_path: "lucerna::kernels::test::scene".into(),
        file: "test.wgsl".into(),
        text: text.into(),
    });
    let kernel = ComputeKernel::new(gpu(), &shaders, Some(scene.group()), "test/scene");
    let input_buffer = storage(bytemuck::cast_slice(inputs));
    let n_words = inputs.len() * size_of::<O>() / 4;
    let outputs = storage(bytemuck::cast_slice(&vec![0xdead_beef_u32; n_words]));
    submit(|recorder| {
        kernel
            .call(&mut recorder.compute("test"))
            .scene(scene.group())
            .bind("inputs", &input_buffer)
            .bind("outputs", &outputs)
            .dispatch(Dispatch::Items(inputs.len() as u32));
    });
    let outputs: Vec<O> = bytemuck::pod_collect_to_vec(&read(&outputs));
    for (ix, output) in outputs.iter().enumerate() {
        let words: &[u32] = bytemuck::cast_slice(bytemuck::bytes_of(output));
        assert!(words.iter().any(|&word| word != 0xdead_beef), "output {ix} was not written");
    }
    outputs
}

fn random_image(random: &mut Random, width: u32, height: u32) -> Image {
    let rgba = (0..width * height).map(|_| (random.bits() as u32).to_le_bytes()).collect();
    Image { name: String::from("test"), width, height, rgba }
}

/// A texture of its own, every wrap mode and filter in turn.
fn add_texture(scene: &mut Scene, random: &mut Random, image: Image, filter: Filter) -> TextureRef {
    let wrap = |word: u64| [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp][word as usize % 3];
    scene.images.push(image);
    scene.textures.push(Texture {
        image: scene.images.len() - 1,
        wrap_u: wrap(random.bits()),
        wrap_v: wrap(random.bits()),
        filter,
    });
    let angle = random.range(-3.0, 3.0);
    let scale = Vec2::new(random.range(0.5, 2.0), random.range(-2.0, -0.5));
    TextureRef {
        texture: scene.textures.len() - 1,
        uv_set: random.bits() as u32 % 2,
        uv_from_mesh: Affine2::from_scale_angle_translation(
            scale,
            angle,
            Vec2::new(random.unit(), random.unit()),
        ),
    }
}

/// Triangles one by one, each with all attributes different and a material of its own.
fn textured_scene(random: &mut Random, n: usize, sizes: &[[u32; 2]], filters: &[Filter]) -> Scene {
    let mut scene = Scene::default();
    for ix in 0..n {
        let texture = |random: &mut Random, scene: &mut Scene| -> Option<TextureRef> {
            let [width, height] = sizes[random.bits() as usize % sizes.len()];
            let filter = filters[random.bits() as usize % filters.len()];
            (random.unit() < 0.8).then(|| {
                let image = random_image(random, width, height);
                add_texture(scene, random, image, filter)
            })
        };
        let material = Material {
            base_color: color(random).extend(random.range(0.5, 1.0)),
            base_color_texture: texture(random, &mut scene),
            metallic: random.unit(),
            roughness: random.unit(),
            metallic_roughness_texture: texture(random, &mut scene),
            normal_texture: texture(random, &mut scene),
            normal_scale: random.range(0.2, 1.5),
            emission: 9.0 * color(random),
            emission_texture: texture(random, &mut scene),
            alpha: if ix % 3 == 0 { AlphaMode::Mask { cutoff: 0.3 } } else { AlphaMode::Opaque },
            double_sided: ix % 2 == 0,
            ..Material::default()
        };
        let positions: Vec<Vec3> =
            (0..3).map(|_| 2.0 * random.direction() + Vec3::X * (5 * ix) as f32).collect();
        let flat = (positions[1] - positions[0]).cross(positions[2] - positions[0]).normalize();
        let near = |random: &mut Random, of: Vec3| {
            (of + 0.4 * random.direction()).as_dvec3().normalize().as_vec3()
        };
        let edge = (positions[1] - positions[0]).normalize();
        let uv = |random: &mut Random| Vec2::new(random.range(-2.0, 2.0), random.range(-2.0, 2.0));
        let sign = if ix % 5 < 2 { -1.0 } else { 1.0 };
        let mesh = Mesh {
            normals: if ix % 4 == 3 {
                Vec::new()
            } else {
                (0..3).map(|_| near(random, flat)).collect()
            },
            tangents: (0..3).map(|_| near(random, edge).extend(sign)).collect(),
            uv0: (0..3).map(|_| uv(random)).collect(),
            uv1: (0..3).map(|_| uv(random)).collect(),
            colors: if ix % 4 == 2 {
                Vec::new()
            } else {
                (0..3).map(|_| color(random).extend(random.unit())).collect()
            },
            triangles: vec![[0, 1, 2]],
            material: ix,
            positions,
            ..Mesh::default()
        };
        scene.materials.push(material);
        scene.meshes.push(mesh);
        scene.instances.push(Instance { mesh: ix, world_from_object: Affine3A::IDENTITY });
    }
    scene
}

/// For each of the GPU's triangles the mesh that it comes from: the BVH orders them anew.
fn meshes_of_triangles(world: &Scene, scene: &GpuScene) -> Vec<usize> {
    let inputs: Vec<UVec4> = (0..world.meshes.len() as u32).map(UVec4::splat).collect();
    let corners: Vec<Vec4> = map_scene(
        scene,
        "#import lucerna::scene::triangles::triangle_corners
         alias Input = vec4<u32>;
         alias Output = vec4<f32>;
         fn map(x: Input) -> Output { return vec4<f32>(triangle_corners(x.x).a, 0.0); }",
        &inputs,
    );
    let mesh_of = |corner: &Vec4| {
        let found = world.meshes.iter().position(|mesh| mesh.positions[0] == corner.truncate());
        found.expect("a triangle's first corner is its mesh's")
    };
    corners.iter().map(mesh_of).collect()
}

#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
struct Place {
    triangle: u32,
    width: f32,
    weights: Vec2,
    spread: Vec4,
}

#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
struct Found {
    position: Vec4,
    geometric_normal: Vec4,
    shading_normal: Vec4,
    base_color: Vec4,
    /// metallic, roughness, lambert, double-sided
    gloss: Vec4,
    emission: Vec4,
    /// w: cut away
    over: Vec4,
    over_emission: Vec4,
}

const SURFACE: &str = "
    #import lucerna::scene::surface::{filtered_surface_at, is_cut_away, surface_over}
    struct Input { triangle: u32, width: f32, weights: vec2<f32>, spread: vec4<f32> }
    struct Output {
        position: vec4<f32>, geometric_normal: vec4<f32>, shading_normal: vec4<f32>, base_color: vec4<f32>,
        gloss: vec4<f32>, emission: vec4<f32>, over: vec4<f32>, over_emission: vec4<f32>,
    }
    fn map(x: Input) -> Output {
        let found = filtered_surface_at(x.triangle, x.weights, x.spread);
        let over = surface_over(x.triangle, x.weights, x.width);
        let gloss = vec4<f32>(found.metallic, found.roughness, f32(found.lambert), f32(found.double_sided));
        return Output(
            vec4<f32>(found.position, found.position_error.x), vec4<f32>(found.geometric_normal, 0.0),
            vec4<f32>(found.shading_normal, 0.0), vec4<f32>(found.base_color, f32(is_cut_away(x.triangle, x.weights))),
            gloss, vec4<f32>(found.emission, 0.0), vec4<f32>(over.albedo, f32(over.is_cut_away)),
            vec4<f32>(over.emission, f32(over.double_sided)),
        );
    }";

/// Corners' values at a point.
fn at<T: Copy>(values: &[T], weights: DVec2, of: impl Fn(T) -> DVec4) -> DVec4 {
    let first = 1.0 - weights.x - weights.y;
    of(values[0]) * first + of(values[1]) * weights.x + of(values[2]) * weights.y
}

/// What a surface is at a point, in f64 over the scene's own data: textures, vertex colours, normals by a map in the frame
/// of interpolated tangent and normal; metallic × blue, roughness × green. None: a texture jumps there.
struct Expected {
    base_color: DVec4,
    metallic: f64,
    roughness: f64,
    emission: DVec3,
    shading_normal: DVec3,
    geometric_normal: DVec3,
}

fn expected(world: &Scene, mesh: &Mesh, weights: DVec2, maps: bool) -> Option<Expected> {
    let material = &world.materials[mesh.material];
    let mut jumps = false;
    let mut texel = |reference: &Option<TextureRef>, is_srgb: bool| -> DVec4 {
        let Some(reference) = reference else { return DVec4::ONE };
        let uvs = if reference.uv_set == 1 { &mesh.uv1 } else { &mesh.uv0 };
        let uv = at(uvs, weights, |uv| uv.as_dvec2().extend(0.0).extend(0.0));
        let found = sample(world, reference, Vec2::new(uv.x as f32, uv.y as f32), is_srgb);
        let texture = &world.textures[reference.texture];
        jumps |= texture.filter == Filter::Nearest && found.to_edge < 1e-3;
        found.value
    };
    let mut base_color = material.base_color.as_dvec4() * texel(&material.base_color_texture, true);
    if !mesh.colors.is_empty() {
        base_color *= at(&mesh.colors, weights, |c| c.as_dvec4());
    }
    let gloss = texel(&material.metallic_roughness_texture, false);
    let emission =
        material.emission.as_dvec3() * texel(&material.emission_texture, true).truncate();
    let [a, b, c] = [0, 1, 2].map(|k| mesh.positions[k].as_dvec3());
    let geometric_normal = (b - a).cross(c - a).normalize();
    let mut normal = geometric_normal;
    if !mesh.normals.is_empty() {
        normal = at(&mesh.normals, weights, |n| n.as_dvec3().extend(0.0)).truncate().normalize();
    }
    if let (true, Some(_)) = (maps, &material.normal_texture) {
        let map = texel(&material.normal_texture, false).truncate() * 2.0 - 1.0;
        let scale = f64::from(material.normal_scale);
        let tangent = at(&mesh.tangents, weights, |t| t.as_dvec4()).truncate();
        let right = (tangent - normal * tangent.dot(normal)).normalize();
        let up = normal.cross(right) * f64::from(mesh.tangents[0].w);
        normal = (right * map.x * scale + up * map.y * scale + normal * map.z).normalize();
    }
    if normal.dot(geometric_normal) < 0.0 {
        normal = -normal;
    }
    (!jumps).then_some(Expected {
        base_color,
        metallic: f64::from(material.metallic) * gloss.z,
        roughness: f64::from(material.roughness) * gloss.y,
        emission,
        shading_normal: normal,
        geometric_normal,
    })
}

/// `surface_at` and `surface_over` without a footprint, over triangles of which every attribute, texture, wrap mode, set of
/// coordinates and factor differs. Tolerance: colours 16 bits of vertices and f32 weights over texels of 8 bits: 2e-4
/// (coordinates of up to 60 texels, good to 5e-6 of one each); normals are packed to 6.5e-5 rad, corners and tangents
/// each, and maps turn by up to a right angle: 1e-3.
#[test]
fn surfaces_have_their_materials_textures_and_normals() {
    let mut random = Random(101);
    let sizes = [[7, 5], [1, 1], [16, 4], [3, 12]];
    let world = textured_scene(&mut random, 60, &sizes, &[Filter::Linear, Filter::Nearest]);
    for diffuse_only in [false, true] {
        let options = settings!(GpuSceneOptions { diffuse_only, ..Default::default() });
        let scene = GpuScene::new(gpu(), &world, options).unwrap();
        let meshes = meshes_of_triangles(&world, &scene);
        let inputs: Vec<Place> = (0..60 * 40)
            .map(|ix| {
                let (u, v) = (random.unit(), random.unit());
                let weights =
                    if u + v < 1.0 { Vec2::new(u, v) } else { Vec2::new(1.0 - u, 1.0 - v) };
                Place { triangle: ix % 60, width: 0.0, weights, spread: Vec4::ZERO }
            })
            .collect();
        let found: Vec<Found> = map_scene(&scene, SURFACE, &inputs);
        let mut n_checked = 0;
        for (input, found) in inputs.iter().zip(&found) {
            let mesh = &world.meshes[meshes[input.triangle as usize]];
            let material = &world.materials[mesh.material];
            let weights = input.weights.as_dvec2();
            let Some(expected) = expected(&world, mesh, weights, !diffuse_only) else { continue };
            n_checked += 1;
            let near = |found: Vec3, expected: DVec3, bound: f64, quantity: &str| {
                let off = (found.as_dvec3() - expected).largest();
                assert!(
                    off <= bound,
                    "{quantity} at {weights} of mesh {}, diffuse {diffuse_only}: {found}, expected {expected} to {bound:e}; {material:?}",
                    mesh.material
                );
            };
            let position = at(&mesh.positions, weights, |p| p.as_dvec3().extend(0.0)).truncate();
            near(found.position.truncate(), position, 1e-4, "position");
            near(
                found.geometric_normal.truncate(),
                expected.geometric_normal,
                1e-5,
                "geometric normal",
            );
            if expected.shading_normal.dot(expected.geometric_normal) > 1e-2 {
                near(
                    found.shading_normal.truncate(),
                    expected.shading_normal,
                    1e-3,
                    "shading normal",
                );
            }
            let base = expected.base_color;
            near(found.base_color.truncate(), base.truncate(), 2e-4, "base colour");
            near(found.emission.truncate(), expected.emission, 9.0 * 2e-4, "emission");
            let double_sided = f64::from(u8::from(material.double_sided));
            let gloss = if diffuse_only {
                DVec3::new(0.0, 1.0, 1.0)
            } else {
                DVec3::new(expected.metallic, expected.roughness, 0.0)
            };
            near(found.gloss.truncate(), gloss, 2e-4, "metallic, roughness, lambert");
            assert_eq!(f64::from(found.gloss.w), double_sided, "double-sided: {material:?}");
            assert_eq!(
                f64::from(found.over_emission.w),
                double_sided,
                "double-sided: {material:?}"
            );
            if let AlphaMode::Mask { cutoff } = material.alpha {
                let alpha = base.w;
                if (alpha - f64::from(cutoff)).abs() > 2e-4 {
                    let cut = f32::from(u8::from(alpha < f64::from(cutoff)));
                    let removed = [found.base_color.w, found.over.w];
                    assert_eq!(removed, [cut; 2], "mask of alpha {alpha}, cutoff {cutoff}");
                }
            } else {
                assert_eq!([found.base_color.w, found.over.w], [0.0; 2], "opaque, {material:?}");
            }
            near(
                found.over_emission.truncate(),
                expected.emission,
                9.0 * 2e-4,
                "emission of a patch",
            );
            if diffuse_only {
                near(found.over.truncate(), base.truncate(), 2e-4, "albedo of a patch");
            } else if input.triangle % 8 == 0 {
                let (metallic, roughness) = (expected.metallic as f32, expected.roughness as f32);
                let base = base.truncate().as_vec3();
                // As good as the fit (`hemispherical_albedo_is_near_the_integral`); rougher than its 0.2.
                if roughness > 0.2 {
                    let albedo = hemispherical_albedo(base, metallic, roughness);
                    near(found.over.truncate(), albedo, 0.03, "albedo of a patch");
                }
            }
        }
        assert!(n_checked > 2000, "{n_checked} of {} places", inputs.len());
    }
}

/// Each image's half of the size before, by the mean of 2 × 2 texels.
fn mips_of(image: &Image) -> Vec<Image> {
    let mut mips = vec![image.clone()];
    while let Some(last) = mips.last().filter(|of| of.width.max(of.height) > 1).cloned() {
        let (width, height) = ((last.width / 2).max(1), (last.height / 2).max(1));
        let texel = |x: u32, y: u32| {
            last.rgba[(y.min(last.height - 1) * last.width + x.min(last.width - 1)) as usize]
        };
        let rgba = (0..width * height)
            .map(|ix| {
                let (x, y) = (2 * (ix % width), 2 * (ix / width));
                let four = [texel(x, y), texel(x + 1, y), texel(x, y + 1), texel(x + 1, y + 1)];
                std::array::from_fn(|k| {
                    let sum: u32 = four.iter().map(|of| u32::from(of[k])).sum();
                    ((f64::from(sum) / 4.0).round()) as u8
                })
            })
            .collect();
        mips.push(Image { width, height, rgba, ..last });
    }
    mips
}

/// Over a footprint, numbers come from the two mips around log₂ of its longer side in texels, against mips and filters in
/// f64; for a patch, of a square of its width. Tolerance: each mip rounds to 8 bits, and so do ours: 2.5/255.
#[test]
fn footprints_read_the_mips_of_their_width() {
    let mut random = Random(102);
    let sizes = [[16, 16], [8, 32], [64, 4]];
    let mut world = textured_scene(&mut random, 40, &sizes, &[Filter::Linear]);
    for material in &mut world.materials {
        material.base_color_texture = None;
        material.emission_texture = None;
        material.normal_texture = None;
        (material.metallic, material.roughness) = (1.0, 1.0);
    }
    // Of each image the mips as scenes of their own.
    let mips: Vec<Vec<Image>> = world.images.iter().map(mips_of).collect();
    let scene = GpuScene::new(gpu(), &world, GpuSceneOptions::default()).unwrap();
    let meshes = meshes_of_triangles(&world, &scene);
    let inputs: Vec<Place> = (0..40 * 40)
        .map(|ix| {
            let (u, v) = (random.unit(), random.unit());
            let weights = if u + v < 1.0 { Vec2::new(u, v) } else { Vec2::new(1.0 - u, 1.0 - v) };
            let scale = 2f32.powf(random.range(-8.0, 1.0));
            let spread = scale * Vec4::from_array(std::array::from_fn(|_| random.range(-1.0, 1.0)));
            Place { triangle: ix % 40, width: 0.0, weights, spread }
        })
        .collect();
    let found: Vec<Found> = map_scene(&scene, SURFACE, &inputs);
    let (mut n_checked, mut n_coarse) = (0, 0);
    for (input, found) in inputs.iter().zip(&found) {
        let mesh = &world.meshes[meshes[input.triangle as usize]];
        let material = &world.materials[mesh.material];
        let Some(reference) = &material.metallic_roughness_texture else { continue };
        let image = world.textures[reference.texture].image;
        let uvs = if reference.uv_set == 1 { &mesh.uv1 } else { &mesh.uv0 };
        let uvs: Vec<DVec2> = uvs.iter().map(|uv| uv.as_dvec2()).collect();
        let size = DVec2::new(world.images[image].width.into(), world.images[image].height.into());
        let m = reference.uv_from_mesh.matrix2;
        let texels = |spread: Vec2| {
            let step =
                (uvs[1] - uvs[0]) * f64::from(spread.x) + (uvs[2] - uvs[0]) * f64::from(spread.y);
            (m.x_axis.as_dvec2() * step.x + m.y_axis.as_dvec2() * step.y) * size
        };
        let longer = texels(input.spread.truncate().truncate())
            .length()
            .max(texels(Vec2::new(input.spread.z, input.spread.w)).length());
        let level = longer.max(1.0).log2();
        let uv = at(&uvs, input.weights.as_dvec2(), |uv| uv.extend(0.0).extend(0.0));
        let of_mip = |mip: usize| {
            let mut world =
                Scene { images: vec![], textures: world.textures.clone(), ..Scene::default() };
            let mips = &mips[image];
            world.images.push(mips[mip.min(mips.len() - 1)].clone());
            world.textures[reference.texture].image = 0;
            sample(&world, reference, Vec2::new(uv.x as f32, uv.y as f32), false).value
        };
        let lower = level.floor() as usize;
        let expected = of_mip(lower).lerp(of_mip(lower + 1), level.fract());
        let actual = DVec2::new(found.gloss.x.into(), found.gloss.y.into());
        let off = (actual - DVec2::new(expected.z, expected.y)).largest();
        assert!(
            off < 2.5 / 255.0,
            "metallic, roughness at level {level:.3} of mesh {}: {actual}, expected {:.5} {:.5} to 0.01",
            mesh.material,
            expected.z,
            expected.y
        );
        n_checked += 1;
        n_coarse += usize::from(level > 1.0);
    }
    assert!(n_checked > 1000 && n_coarse > 300, "{n_checked} places, {n_coarse} of mips");
}

/// A surface as a viewer sees it: both normals on the viewer's side; emission from the front, or from both sides.
#[test]
fn surfaces_are_turned_towards_the_viewer() {
    let mut random = Random(103);
    let inputs: Vec<[Vec4; 3]> = (0..4000)
        .map(|ix| {
            let geometric = random.direction();
            let lean = geometric + 0.9 * random.direction();
            let shading = lean.as_dvec3().normalize().as_vec3();
            let shading = if shading.dot(geometric) < 0.0 { -shading } else { shading };
            [geometric.extend((ix % 2) as f32), shading.extend(0.0), random.direction().extend(0.0)]
        })
        .collect();
    let found: Vec<[Vec4; 3]> = map(
        "#import lucerna::scene::types::{Surface, seen_from}
         struct Input { geometric: vec4<f32>, shading: vec4<f32>, direction: vec4<f32> }
         struct Output { geometric: vec4<f32>, shading: vec4<f32>, emission: vec4<f32> }
         fn map(x: Input) -> Output {
             var surface: Surface;
             surface.geometric_normal = x.geometric.xyz;
             surface.shading_normal = x.shading.xyz;
             surface.emission = vec3<f32>(1.0, 2.0, 3.0);
             surface.base_color = vec3<f32>(0.25, 0.5, 0.75);
             surface.double_sided = x.geometric.w == 1.0;
             let seen = seen_from(surface, x.direction.xyz);
             return Output(vec4<f32>(seen.geometric_normal, seen.base_color.x), vec4<f32>(seen.shading_normal, 0.0),
                 vec4<f32>(seen.emission, 0.0));
         }",
        &inputs,
    );
    for ([geometric, shading, direction], found) in inputs.iter().zip(&found) {
        let towards =
            |normal: Vec3| if normal.dot(direction.truncate()) > 0.0 { -normal } else { normal };
        let front = geometric.truncate().dot(direction.truncate()) <= 0.0;
        let shines = front || geometric.w == 1.0;
        let emission = if shines { Vec3::new(1.0, 2.0, 3.0) } else { Vec3::ZERO };
        let expected = [
            towards(geometric.truncate()).extend(0.25),
            towards(shading.truncate()).extend(0.0),
            emission.extend(0.0),
        ];
        assert_eq!(
            *found, expected,
            "normals, emission of {geometric} {shading} seen along {direction}"
        );
    }
}

/// Rays to lights: to a place within t = 1, or without end along the direction; corners by number; misses.
#[test]
fn rays_hits_and_corners_are_what_they_say() {
    let found: Vec<[Vec4; 2]> = map(
        "#import lucerna::scene::types::{Hit, LightSample, NONE, TriangleCorners, corner_at, hit_is_miss, ray_to_light}
         #import lucerna::math::constants::FLOAT_MAX
         alias Input = vec4<f32>;
         struct Output { ray: vec4<f32>, rest: vec4<f32> }
         fn map(x: Input) -> Output {
             var light: LightSample;
             light.distance = select(FLOAT_MAX, 4.0, x.x == 1.0);
             light.direction = vec3<f32>(0.0, 1.0, 0.0);
             light.place = vec3<f32>(5.0, 6.0, 7.0);
             let ray = ray_to_light(light, vec3<f32>(1.0, 2.0, 4.0));
             let corners = TriangleCorners(vec3<f32>(1.0), vec3<f32>(2.0), vec3<f32>(3.0));
             let miss = Hit(0.0, select(0u, NONE, x.x == 1.0), vec2<f32>(0.0));
             let corner = corner_at(corners, u32(x.y)).x;
             return Output(vec4<f32>(ray.direction, ray.t_max), vec4<f32>(ray.origin.z + ray.t_min, corner, f32(hit_is_miss(miss)), 0.0));
         }",
        &[Vec4::new(1.0, 0.0, 0.0, 0.0), Vec4::new(0.0, 1.0, 0.0, 0.0), Vec4::new(1.0, 2.0, 0.0, 0.0)],
    );
    let to_place = Vec4::new(4.0, 4.0, 3.0, 1.0);
    let endless = Vec4::new(0.0, 1.0, 0.0, 3.402_823e38);
    let expected = [
        [to_place, Vec4::new(4.0, 1.0, 1.0, 0.0)],
        [endless, Vec4::new(4.0, 2.0, 0.0, 0.0)],
        [to_place, Vec4::new(4.0, 3.0, 1.0, 0.0)],
    ];
    assert_eq!(found, expected, "direction and end of the ray; origin, corner, miss");
}

/// Irradiance by a triangle of radiance 1 that is wholly above the horizon: ½·Σ θᵢ·(Γᵢ·n), where θᵢ is the angle that an
/// edge spans and Γᵢ the unit normal of its plane through the point (J. Lambert 1760; J. Arvo, "Applications of Irradiance
/// Tensors", SIGGRAPH 1994).
fn irradiance_of_triangle(at: DVec3, normal: DVec3, corners: [DVec3; 3]) -> f64 {
    let d = corners.map(|corner| (corner - at).normalize());
    let sum: f64 = (0..3)
        .map(|k| {
            let (a, b) = (d[k], d[(k + 1) % 3]);
            a.dot(b).clamp(-1.0, 1.0).acos() * a.cross(b).normalize().dot(normal)
        })
        .sum();
    0.5 * sum.abs()
}

#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
struct Drawn {
    /// w: the weight's density.
    all: Vec4,
    all_direction: Vec4,
    hittable: Vec4,
    /// w: distance.
    hittable_direction: Vec4,
    /// Of the directions: that of `all` in the sky, that of `hittable` there.
    pdf_of_sky: Vec4,
}

/// Light by samples of all lights, and of those that a ray can hit: the estimates of irradiance agree with closed forms (a
/// point light, a spot, a sun, triangles seen from before and behind, single- and double-sided, and a sky, by quadrature),
/// by their standard errors; a sampled direction's density is that which `pdf_of_sky` and `pdf_of_emitter` say. All lights
/// differ in power, so that every entry of the alias tables has a threshold of its own.
#[test]
fn lights_are_sampled_as_their_densities_say() {
    let mut random = Random(104);
    let triangle = |corner: Vec3, size: f32, flip: bool, material| {
        let mut positions = vec![corner, corner + Vec3::X * size, corner + Vec3::Z * size];
        if flip {
            positions.swap(1, 2);
        }
        Mesh { positions, triangles: vec![[0, 1, 2]], material, ..Mesh::default() }
    };
    let emitter = |radiance: Vec3, double_sided| Material {
        emission: radiance,
        double_sided,
        ..Material::default()
    };
    let radiances =
        [Vec3::new(9.0, 1.0, 3.0), Vec3::new(2.0, 8.0, 1.0), Vec3::splat(30.0), Vec3::splat(4.0)];
    // Facing down, or up: with the winding a, a + x, a + z the front is down.
    let meshes = vec![
        triangle(Vec3::new(-1.0, 2.0, -1.0), 1.5, false, 0),
        triangle(Vec3::new(1.0, 3.0, 0.5), 1.0, true, 1),
        triangle(Vec3::new(0.5, 2.5, -2.0), 0.4, false, 2),
        // Its back is above the points, and does not shine.
        triangle(Vec3::new(-2.5, 2.2, 1.0), 1.2, true, 3),
    ];
    let world = Scene {
        instances: (0..4)
            .map(|mesh| Instance { mesh, world_from_object: Affine3A::IDENTITY })
            .collect(),
        materials: [false, true, false, false]
            .into_iter()
            .zip(radiances)
            .map(|(both, l)| emitter(l, both))
            .collect(),
        meshes,
        lights: vec![
            Light::Point {
                position: Vec3::new(0.2, 1.7, 0.4),
                intensity: Vec3::new(3.0, 2.0, 1.0),
                range: None,
            },
            Light::Directional {
                direction: Vec3::new(0.3, -0.9, 0.1).normalize(),
                irradiance: Vec3::new(0.2, 0.4, 0.6),
            },
            Light::Spot {
                position: Vec3::new(-0.5, 2.0, 0.3),
                direction: Vec3::new(0.2, -1.0, 0.0).normalize(),
                intensity: Vec3::new(5.0, 5.0, 1.0),
                inner: 0.4,
                outer: 0.9,
                range: None,
            },
        ],
        sky: Sky::Constant(Vec3::new(0.3, 0.2, 0.4)),
        ..Scene::default()
    };
    let scene = GpuScene::new(gpu(), &world, GpuSceneOptions::default()).unwrap();
    let wgsl = "
        #import lucerna::scene::lights::{sample_light, sample_hittable_light, pdf_of_sky, pdf_of_hittable_sky, lights_can_be_hit}
        struct Input { at: vec4<f32>, normal: vec4<f32>, u: vec4<f32> }
        struct Output {
            all: vec4<f32>, all_direction: vec4<f32>, hittable: vec4<f32>, hittable_direction: vec4<f32>, sky: vec4<f32>,
        }
        fn map(x: Input) -> Output {
            let all = sample_light(x.at.xyz, x.u);
            let hittable = sample_hittable_light(x.at.xyz, x.u);
            return Output(
                vec4<f32>(all.weight * max(dot(all.direction, x.normal.xyz), 0.0), all.pdf),
                vec4<f32>(all.direction, all.distance),
                vec4<f32>(hittable.weight * max(dot(hittable.direction, x.normal.xyz), 0.0), hittable.pdf),
                vec4<f32>(hittable.direction, hittable.distance),
                vec4<f32>(pdf_of_sky(all.direction), pdf_of_hittable_sky(hittable.direction), f32(lights_can_be_hit()), 0.0),
            );
        }";
    let meshes = meshes_of_triangles(&world, &scene);
    const N: usize = 1 << 13;
    for (at, normal) in [
        (Vec3::new(0.3, 0.0, 0.2), Vec3::Y),
        (Vec3::new(-0.8, 0.4, 0.9), Vec3::new(0.1, 0.98, -0.1).normalize()),
    ] {
        let inputs: Vec<[Vec4; 3]> = (0..32 * N)
            .map(|_| {
                let u = Vec4::from_array(std::array::from_fn(|_| random.unit()));
                [at.extend(0.0), normal.extend(0.0), u]
            })
            .collect();
        let found: Vec<Drawn> = map_scene(&scene, wgsl, &inputs);
        // What arrives, in closed form.
        let (at, normal) = (at.as_dvec3(), normal.as_dvec3());
        let mut of_hittable = DVec3::new(0.3, 0.2, 0.4) * std::f64::consts::PI;
        for (ix, mesh) in world.meshes.iter().enumerate().take(3) {
            let corners = std::array::from_fn(|k| mesh.positions[k].as_dvec3());
            of_hittable += radiances[ix].as_dvec3() * irradiance_of_triangle(at, normal, corners);
        }
        let punctual: DVec3 = world
            .lights
            .iter()
            .map(|light| {
                let (to_light, irradiance) = crate::pixels::sent(light, at);
                irradiance * to_light.dot(normal).max(0.0)
            })
            .sum();
        for (what, of, expected) in [
            ("all lights", (|of: &Drawn| of.all) as fn(&Drawn) -> Vec4, of_hittable + punctual),
            ("emitters and sky", |of| of.hittable, of_hittable),
        ] {
            let batches = |k: usize| {
                Estimate::of(found.chunks_exact(N).map(|batch| {
                    batch.iter().map(|one| f64::from(of(one)[k])).sum::<f64>() / N as f64
                }))
            };
            let what = format!("irradiance by {what} at {at}");
            let resolves = Tolerance::relative(0.03);
            let rounding = Tolerance::relative(1e-5);
            assert_estimates(
                &what,
                &[0, 1, 2].map(batches),
                &expected.to_array(),
                rounding,
                resolves,
            );
        }
        // The densities, by what a ray along the sampled direction would find.
        let mut of_triangles: Vec<[Vec4; 1]> = Vec::new();
        let mut expected: Vec<(usize, f32, usize)> = Vec::new();
        for drawn in found.iter().take(4000) {
            let (all, hittable) = (drawn.all.w, drawn.hittable.w);
            assert_eq!(drawn.pdf_of_sky.z, 1.0, "lights_can_be_hit");
            let far = |direction: Vec4| direction.w > 1e30;
            let near = |found: f32, expected: f32, what: &str| {
                let off = (found - expected).abs();
                assert!(
                    off <= 1e-4 * expected,
                    "{what}: {found}, expected {expected} to 1e-4 of it"
                );
            };
            if far(drawn.all_direction) && all > 0.0 {
                near(drawn.pdf_of_sky.x, all, "density of the sky among all lights");
            }
            if far(drawn.hittable_direction) {
                near(
                    drawn.pdf_of_sky.y,
                    hittable,
                    "density of the sky among those that can be hit",
                );
            }
            for (column, direction, pdf) in
                [(0, drawn.hittable_direction, hittable), (1, drawn.all_direction, all)]
            {
                if far(direction) || pdf == 0.0 {
                    continue;
                }
                let place = at + f64::from(direction.w) * direction.truncate().as_dvec3();
                // Each triangle has its own height.
                let height = |mesh: &Mesh| (f64::from(mesh.positions[0].y) - place.y).abs();
                let nearest = world.meshes.iter().position(|mesh| height(mesh) < 1e-3);
                let triangle = meshes.iter().position(|&mesh| Some(mesh) == nearest).unwrap();
                of_triangles.push([direction]);
                expected.push((column, pdf, triangle));
            }
        }
        let inputs: Vec<[Vec4; 2]> = of_triangles
            .iter()
            .zip(&expected)
            .map(|(direction, &(_, _, triangle))| [direction[0], Vec4::splat(triangle as f32)])
            .collect();
        let densities: Vec<[f32; 4]> = map_scene(
            &scene,
            "#import lucerna::scene::lights::{pdf_of_hittable_emitter, pdf_of_emitter}
             struct Input { direction: vec4<f32>, triangle: vec4<f32> }
             alias Output = vec4<f32>;
             fn map(x: Input) -> Output {
                 let ix = u32(x.triangle.x);
                 return vec4<f32>(pdf_of_hittable_emitter(ix, x.direction.xyz, x.direction.w),
                     pdf_of_emitter(ix, x.direction.xyz, x.direction.w), 0.0, 0.0);
             }",
            &inputs,
        );
        assert!(
            expected.len() > 1000,
            "{} samples on triangles, expected above 1000",
            expected.len()
        );
        for (density, &(column, pdf, triangle)) in densities.iter().zip(&expected) {
            let found = density[column];
            let among = ["those that can be hit", "all lights"][column];
            let off = (found - pdf).abs();
            assert!(
                off <= 1e-3 * pdf,
                "density of triangle {triangle} among {among}: {found}, expected {pdf} to 1e-3 of it"
            );
        }
    }
}

/// Which triangles are masked, and which move, each for itself.
#[test]
fn triangles_are_masked_and_move_each_for_itself() {
    let mut world = Scene::default();
    for ix in 0..4 {
        let alpha = if ix % 2 == 1 { AlphaMode::Mask { cutoff: 0.5 } } else { AlphaMode::Opaque };
        let base_color = Vec3::ONE.extend(0.7);
        world.materials.push(Material { alpha, base_color, ..Material::default() });
        let corner = Vec3::X * (3 * ix) as f32;
        world.meshes.push(Mesh {
            positions: vec![corner, corner + Vec3::Y, corner + Vec3::Z],
            triangles: vec![[0, 1, 2]],
            material: ix,
            ..Mesh::default()
        });
        world.instances.push(Instance { mesh: ix, world_from_object: Affine3A::IDENTITY });
    }
    let options = GpuSceneOptions::default();
    let scene = GpuScene::with_moving(gpu(), &world, options, &|instance| instance >= 2).unwrap();
    let meshes = meshes_of_triangles(&world, &scene);
    let inputs: Vec<UVec4> = (0..4).map(UVec4::splat).collect();
    let found: Vec<UVec4> = map_scene(
        &scene,
        "#import lucerna::scene::triangles::{n_triangles, triangle_is_masked, triangle_moves}
         alias Input = vec4<u32>;
         alias Output = vec4<u32>;
         fn map(x: Input) -> Output {
             return vec4<u32>(u32(triangle_is_masked(x.x)), u32(triangle_moves(x.x)), n_triangles(), 0u);
         }",
        &inputs,
    );
    for (triangle, found) in found.iter().enumerate() {
        let mesh = meshes[triangle];
        let expected = UVec4::new(mesh as u32 % 2, u32::from(mesh >= 2), 4, 0);
        assert_eq!(*found, expected, "masked, moving, triangles in all; triangle of mesh {mesh}");
    }
}

/// Rays of an emissive triangle start on it, out of its front; those of a double-sided one out of either, half and half by
/// `v.z`.
#[test]
fn emitters_send_rays_out_of_their_sides() {
    for double_sided in [false, true] {
        let world = Scene {
            meshes: vec![Mesh {
                positions: vec![Vec3::ZERO, Vec3::Z, Vec3::X],
                triangles: vec![[0, 1, 2]],
                ..Mesh::default()
            }],
            instances: vec![Instance { mesh: 0, world_from_object: Affine3A::IDENTITY }],
            materials: vec![Material { emission: Vec3::ONE, double_sided, ..Material::default() }],
            ..Scene::default()
        };
        let scene = GpuScene::new(gpu(), &world, GpuSceneOptions::default()).unwrap();
        let mut random = Random(105);
        let inputs: Vec<[Vec4; 2]> = (0..2000)
            .map(|_| [(); 2].map(|()| Vec4::from_array(std::array::from_fn(|_| random.unit()))))
            .collect();
        let found: Vec<[Vec4; 2]> = map_scene(
            &scene,
            "#import lucerna::scene::light_rays::extended_ray
             struct Input { u: vec4<f32>, v: vec4<f32> }
             struct Output { origin: vec4<f32>, direction: vec4<f32> }
             fn map(x: Input) -> Output {
                 let ray = extended_ray(x.u, x.v);
                 return Output(vec4<f32>(ray.origin, 0.0), vec4<f32>(ray.direction, 0.0));
             }",
            &inputs,
        );
        for ([u, v], [origin, direction]) in inputs.iter().zip(&found) {
            // The front is up.
            let up = !double_sided || v.z < 0.5;
            let what =
                format!("double-sided: {double_sided}, {u}, {v}: from {origin} along {direction}");
            assert_eq!(direction.y > 0.0, up, "side; {what}");
            let on = origin.x > -1e-5 && origin.z > -1e-5 && origin.x + origin.z < 1.00001;
            assert!(on && origin.y.abs() < 1e-4, "a place on the triangle; {what}");
            // Cosine-distributed: the sine's square is uniform.
            assert!((direction.truncate().length() - 1.0).abs() < 1e-5, "length; {what}");
        }
        let n = found.len() as f64;
        let mean = found.iter().map(|[_, d]| f64::from(d.y.abs())).sum::<f64>() / n;
        // ∫ cos · cos/π dω = 2/3, with a variance of 1/2 − 4/9.
        let error = (1.0f64 / 18.0 / n).sqrt();
        let off = (mean - 2.0 / 3.0).abs() / error;
        assert!(off < normal_limit(2), "mean cosine {mean:.4}, expected 0.6667 ± {error:.4}");
    }
}
