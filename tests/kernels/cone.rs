// SPDX-License-Identifier: MIT OR Apache-2.0
//! Cones: the medium that voxels are, sets of cones, prefiltering, and tracing.

use crate::harness::{Largest, Random, assert_each, gpu, map, read, storage, submit};
use bytemuck::{Pod, Zeroable};
use glam::{DVec3, DVec4, UVec3, Vec3, Vec4};
use half::f16;
use lucerna::components::voxel_pyramid::{
    Cone, ConeResult, ConeStepping, PrefilterPass, Pyramid, PyramidStorage, TracePass,
};
use lucerna::components::voxels::VoxelGrid;

/// `OPAQUE_DEPTH` of `cone/medium.wgsl`.
const OPAQUE: f64 = 3.25;

#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
struct Four {
    v: Vec4,
}

fn four(x: f32, y: f32, z: f32, w: f32) -> Four {
    Four { v: Vec4::new(x, y, z, w) }
}

/// τ = −ln(1 − a) up to that of what is opaque, and back; log and exp of lavapipe are good to 5e-7.
#[test]
fn opacity_is_depth_and_back() {
    let mut random = Random(1);
    let mut inputs: Vec<Four> = (0..2000)
        .map(|_| four(10.0 * random.unit(), random.unit(), 1e-3 * random.unit(), random.unit()))
        .collect();
    inputs.extend([
        four(1.0, 0.0, 0.0, 0.0),
        four(1.0, 1.0, 1.0, 1.0),
        four(5e4, 0.5, 0.0, 0.99),
        four(1.0, 1e-7, 0.0, 1e-6),
    ]);
    let found: Vec<[Four; 2]> = map(
        "#import lucerna::cone::medium::{premultiplied, texel_of_premultiplied, texel_of_surface}
         alias Input = vec4<f32>;
         struct Output { texel: vec4<f32>, color: vec4<f32> }
         fn map(x: Input) -> Output {
             let texel = texel_of_surface(x.xyz, x.w);
             return Output(texel, premultiplied(texel));
         }",
        &inputs,
    );
    for (input, [texel, color]) in inputs.iter().zip(&found) {
        let (light, opacity) = (input.v.truncate().as_dvec3(), f64::from(input.v.w));
        let depth = (-(1.0 - opacity).ln()).min(OPAQUE);
        let what = format!("light {light}, opacity {opacity}");
        let (texel, color) = (texel.v, color.v);
        assert!(
            (f64::from(texel.w) - depth).abs() < 2e-6 * (1.0 + depth),
            "{what}: the texel's depth is {}, expected {depth} within {:.1e}",
            texel.w,
            2e-6 * (1.0 + depth)
        );
        let expected = (light * depth).min(DVec3::splat(65504.0));
        let error = (texel.truncate().as_dvec3() - expected).abs();
        assert!(
            error.cmple(2e-6 * (1.0 + depth) * light + 1e-30).all(),
            "{what}: the texel's light is {}, expected {expected} within {:.1e} of the light",
            texel.truncate(),
            2e-6 * (1.0 + depth)
        );
        // From the opaque depth on, opacity is 1 exactly; below, what went in.
        let seen = if depth == OPAQUE { 1.0 } else { opacity };
        assert!(
            (f64::from(color.w) - seen).abs() < 2e-6,
            "{what}: opacity comes back as {}, expected {seen} within 2e-6",
            color.w
        );
        assert!(
            depth < OPAQUE || color.w == 1.0,
            "{what}: opacity of what is opaque comes back as {}, expected 1",
            color.w
        );
        assert!(
            depth > 0.0 || (color == Vec4::ZERO && texel == Vec4::ZERO),
            "{what}: texel {texel} and colour {color} of what is clear, expected 0"
        );
    }
}

/// Pieces of way one after the other against the sum in f64: transmittance Π e^(−σs), and of each piece
/// (ε/σ)(1 − e^(−σs)) of what got so far. 16 pieces, each with a few roundings.
#[test]
fn light_adds_up_along_a_way() {
    let mut random = Random(2);
    let inputs: Vec<[Four; 16]> = (0..500)
        .map(|case| {
            // From thin to thick, and exactly clear.
            let scale = [1e-6, 1e-3, 0.1, 3.0, 0.0][case % 5];
            std::array::from_fn(|_| {
                four(random.unit(), scale * random.unit(), 2.0 * random.unit(), 0.0)
            })
        })
        .collect();
    let found: Vec<Four> = map(
        "#import lucerna::cone::medium::{Medium, add_medium, clear_way}
         struct Input { pieces: array<vec4<f32>, 16> }
         alias Output = vec4<f32>;
         fn map(x: Input) -> Output {
             var light = clear_way();
             for (var ix = 0u; ix < 16u; ix++) {
                 let piece = x.pieces[ix];
                 light = add_medium(light, Medium(vec3<f32>(piece.x * piece.y), piece.y), piece.z);
             }
             return vec4<f32>(light.radiance, light.transmittance);
         }",
        &inputs,
    );
    for (case, (pieces, found)) in inputs.iter().zip(&found).enumerate() {
        let (mut light, mut passed) = (0.0, 1.0);
        for piece in pieces {
            let [radiance, extinction, length] = [piece.v.x, piece.v.y, piece.v.z].map(f64::from);
            let through = (-extinction * length).exp();
            light += passed * radiance * (1.0 - through);
            passed *= through;
        }
        assert!(
            (f64::from(found.v.x) - light).abs() < 1e-5 * light + 1e-12,
            "way {case}: light is {}, expected {light} within 1e-5 of it",
            found.v.x
        );
        assert!(
            (f64::from(found.v.w) - passed).abs() < 1e-5,
            "way {case}: transmittance is {}, expected {passed} within 1e-5",
            found.v.w
        );
    }
}

/// n cones of equal solid angle fill the hemisphere: each has 2π/n, so the cosine of half its aperture is 1 − 1/n.
#[test]
fn cones_of_a_set_fill_the_hemisphere() {
    let inputs: Vec<[u32; 4]> = (2..40).map(|n| [n, 0, 0, 0]).collect();
    let found: Vec<Four> = map(
        "#import lucerna::cone::cone_set::set_spread
         alias Input = vec4<u32>;
         alias Output = vec4<f32>;
         fn map(x: Input) -> Output { return vec4<f32>(set_spread(x.x)); }",
        &inputs,
    );
    for (input, found) in inputs.iter().zip(&found) {
        let n = f64::from(input[0]);
        let expected = (1.0 - 1.0 / n).acos().tan();
        let off = (f64::from(found.v.x) / expected - 1.0).abs();
        assert!(
            off < 1e-5,
            "tan of half the aperture of {n} cones: {}, expected {expected} to 1e-5 of it",
            found.v.x
        );
    }
}

/// Each set's weights sum to 1 (the 9 cones integrate the cosine to 1), its directions are of unit length and
/// above the surface, and what varies with the cosine is found to 6 %: ∫cos²/π dω = 2/3. Drawn from their parts, the cones
/// integrate polynomials of the direction: 64 × 64 midpoints a part leave 1e-3.
#[test]
fn cone_sets_integrate_the_cosine() {
    let sets = [5u32, 6, 9, 16];
    let inputs: Vec<[u32; 4]> =
        sets.iter().flat_map(|&n| (0..n).map(move |ix| [n, ix, 0, 0])).collect();
    let found: Vec<[Four; 2]> = map(
        "#import lucerna::cone::cone_set::{cone_of_set, drawn_cone_of_set, set_spread}
         alias Input = vec4<u32>;
         struct Output { cone: vec4<f32>, moments: vec4<f32> }
         fn map(x: Input) -> Output {
             let cone = cone_of_set(x.x, x.y, 0.3);
             var sum = vec4<f32>(0.0);
             for (var k = 0u; k < 4096u; k++) {
                 let u = (vec2<f32>(f32(k % 64u), f32(k / 64u)) + 0.5) / 64.0;
                 let drawn = drawn_cone_of_set(x.x, x.y, u);
                 let d = drawn.direction;
                 sum += drawn.weight * vec4<f32>(1.0, d.z, d.x * d.x, d.x * d.y + d.y) / 4096.0;
             }
             return Output(vec4<f32>(cone.direction, cone.weight), sum);
         }",
        &inputs,
    );
    for n in sets {
        let of_set: Vec<_> = inputs
            .iter()
            .zip(&found)
            .filter(|(input, _)| input[0] == n)
            .map(|(_, out)| out)
            .collect();
        assert_eq!(of_set.len(), n as usize, "cones of the set of {n}");
        let cones: Vec<DVec4> = of_set.iter().map(|out| out[0].v.as_dvec4()).collect();
        let weights: f64 = cones.iter().map(|cone| cone.w).sum();
        assert!(
            (weights - 1.0).abs() < 1e-6,
            "set of {n} cones: the weights sum to {weights}, expected 1 within 1e-6"
        );
        let linear: f64 = cones.iter().map(|cone| cone.w * cone.z).sum();
        assert!(
            (linear / (2.0 / 3.0) - 1.0).abs() < 0.06,
            "set of {n} cones: the integral of the cosine squared is {linear}, expected 2/3 within 6 %"
        );
        for cone in &cones {
            assert!(
                (cone.truncate().length() - 1.0).abs() < 1e-6 && cone.z > 0.0,
                "set of {n} cones: direction and weight {cone}, expected a length of 1 within 1e-6 and z above 0"
            );
        }
        // ∫ f cos dω/π of f = 1, z, x², xy + y.
        let moments: DVec4 = of_set.iter().map(|out| out[1].v.as_dvec4()).sum();
        let expected = DVec4::new(1.0, 2.0 / 3.0, 0.25, 0.0);
        assert!(
            (moments - expected).largest() < 1e-3,
            "set of {n} cones: moments of drawn directions are {moments}, expected {expected} within 1e-3"
        );
    }
}

/// Solid angle there and back; and the cone for a lobe of GGX holds half of its microfacets' directions:
/// tan²θ/(α² + tan²θ) = ½ where the half vector leans half as far as the cone opens.
#[test]
fn apertures_and_solid_angles() {
    let inputs: Vec<Four> =
        (1..=60).map(|k| four(0.1 * k as f32, k as f32 / 200.0, 0.0, 0.0)).collect();
    let found: Vec<Four> = map(
        "#import lucerna::bsdf::ggx::spread_of_ggx
         #import lucerna::cone::march::{cone_solid_angle, spread_of_solid_angle}
         alias Input = vec4<f32>;
         alias Output = vec4<f32>;
         fn map(x: Input) -> Output {
             let spread = spread_of_solid_angle(x.x);
             return vec4<f32>(spread, cone_solid_angle(spread), spread_of_ggx(x.y), 0.0);
         }",
        &inputs,
    );
    for (input, found) in inputs.iter().zip(&found) {
        let solid_angle = f64::from(input.v.x);
        let cosine = 1.0 - solid_angle / std::f64::consts::TAU;
        let spread = (1.0 - cosine * cosine).sqrt() / cosine;
        assert!(
            (f64::from(found.v.x) / spread - 1.0).abs() < 1e-5,
            "spread of the solid angle {solid_angle} is {}, expected {spread} within 1e-5 of it",
            found.v.x
        );
        assert!(
            (f64::from(found.v.y) / solid_angle - 1.0).abs() < 1e-5,
            "solid angle comes back as {}, expected {solid_angle} within 1e-5 of it",
            found.v.y
        );
        let (alpha, lean) = (f64::from(input.v.y), 0.5 * f64::from(found.v.z).atan());
        let share = lean.tan().powi(2) / (alpha * alpha + lean.tan().powi(2));
        assert!(
            (share - 0.5).abs() < 1e-4,
            "α {alpha}: a cone of spread {} holds {share} of the microfacets, expected 0.5 within 1e-4",
            found.v.z
        );
    }
}

/// A cone's cells are never larger than what keeps clear of the plane that it leaves: a cell that touches the plane
/// reaches 1.5 cells (times how wide a cell is along the normal) into the free.
#[test]
fn cells_keep_clear_of_the_plane() {
    let mut random = Random(5);
    let inputs: Vec<[Four; 3]> = (0..3000)
        .map(|_| {
            let (normal, direction) = (random.direction(), random.direction());
            let direction = if normal.dot(direction) < 0.0 { -direction } else { direction };
            [
                Four { v: normal.extend(random.range(0.0, 3.0)) },
                Four { v: direction.extend(random.range(0.0, 50.0)) },
                four(random.unit(), random.range(-2.0, 2.0), random.range(0.05, 1.0), 0.0),
            ]
        })
        .collect();
    let found: Vec<Four> = map(
        "#import lucerna::cone::march::{Cone, ConeSettings, cone_cells}
         struct Input { a: vec4<f32>, b: vec4<f32>, c: vec4<f32> }
         alias Output = vec4<f32>;
         fn map(x: Input) -> Output {
             let cone = Cone(vec3<f32>(0.0), x.c.x, x.b.xyz, 1e9, x.a.xyz, x.a.w);
             let free = Cone(vec3<f32>(0.0), x.c.x, x.b.xyz, 1e9, vec3<f32>(0.0), 0.0);
             let settings = ConeSettings(0.5, x.c.y, 0.95, 0.0);
             let cells = cone_cells(cone, settings, x.b.w, x.c.z);
             return vec4<f32>(cells.matching, cells.largest, cone_cells(free, settings, x.b.w, x.c.z).matching, 0.0);
         }",
        &inputs,
    );
    for ([a, b, c], found) in inputs.iter().zip(&found) {
        let (normal, offset) = (a.v.truncate().as_dvec3(), f64::from(a.v.w));
        let (direction, t) = (b.v.truncate().as_dvec3(), f64::from(b.v.w));
        let [spread, bias, finest] = [c.v.x, c.v.y, c.v.z].map(f64::from);
        let width = (2.0 * t * spread * bias.exp2()).max(finest);
        let height = offset + t * normal.dot(direction);
        let clear = (height / (1.5 * normal.abs().element_sum())).max(finest);
        let what = format!(
            "normal {normal}, offset {offset}, direction {direction}, t {t}, spread {spread}, bias {bias}, finest {finest}"
        );
        assert!(
            (f64::from(found.v.z) / width - 1.0).abs() < 1e-5,
            "{what}: cells of a free cone are {}, expected {width} within 1e-5 of it",
            found.v.z
        );
        assert!(
            (f64::from(found.v.y) / clear - 1.0).abs() < 1e-4,
            "{what}: the largest cells are {}, expected {clear} within 1e-4 of it",
            found.v.y
        );
        assert!(
            (f64::from(found.v.x) / width.min(clear) - 1.0).abs() < 1e-4,
            "{what}: cells are {}, expected {} within 1e-4 of it",
            found.v.x,
            width.min(clear)
        );
    }
}

fn grid(size: UVec3, n_faces: u32) -> VoxelGrid {
    let bricks = (size + UVec3::new(3, 3, 1)) / UVec3::new(4, 4, 2);
    VoxelGrid { origin: Vec3::ZERO, cell: 1.0, size, n_faces, bricks, capacity: 1 }
}

fn prefiltered(pyramid: &Pyramid) {
    let pass = PrefilterPass::new(gpu(), pyramid);
    submit(|recorder| pass.record(recorder, pyramid));
}

/// The texels of a volume, x fastest.
pub fn texels_of(pyramid: &Pyramid, volume: usize) -> Vec<[f64; 4]> {
    let layout = pyramid.layout();
    let size = [layout.volume_base, layout.volume_odd, layout.volume_even][volume];
    let row = size.x as usize * 8;
    let (bytes, stride) = if let Some(texture) = pyramid.texture(volume) {
        let stride = row.next_multiple_of(256);
        let buffer = gpu().device.create_buffer(&wgpu::BufferDescriptor {
            label: None,
            size: (stride * (size.y * size.z) as usize) as u64,
            usage: wgpu::BufferUsages::COPY_SRC | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let mut encoder = gpu().device.create_command_encoder(&Default::default());
        encoder.copy_texture_to_buffer(
            texture.as_image_copy(),
            wgpu::TexelCopyBufferInfo {
                buffer: &buffer,
                layout: wgpu::TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some(stride as u32),
                    rows_per_image: Some(size.y),
                },
            },
            texture.size(),
        );
        gpu().queue.submit([encoder.finish()]);
        (read(&buffer), stride)
    } else {
        let bytes = |size: UVec3| 8 * size.element_product() as usize;
        let first: usize = pyramid.volume_sizes()[..volume].iter().copied().map(bytes).sum();
        (read(pyramid.buffer().unwrap())[first..first + bytes(size)].to_vec(), row)
    };
    let texel = |bytes: &[u8]| {
        std::array::from_fn(|k| f16::from_ne_bytes([bytes[2 * k], bytes[2 * k + 1]]).to_f64())
    };
    let rows = (0..(size.y * size.z) as usize).map(|ix| &bytes[ix * stride..ix * stride + row]);
    rows.flat_map(|row| row.chunks_exact(8).map(texel)).collect()
}

/// Texels of random faces: empty, opaque, and in between.
fn random_texel(random: &mut Random) -> [f32; 4] {
    let opacity = match random.unit() {
        u if u < 0.3 => 0.0,
        u if u < 0.5 => 1.0,
        _ => random.unit(),
    };
    let depth = (-(1.0 - f64::from(opacity)).ln()).min(OPAQUE) as f32;
    [random.unit(), 4.0 * random.unit(), 0.1]
        .map(|light| light * depth)
        .into_iter()
        .chain([depth])
        .collect::<Vec<_>>()
        .try_into()
        .unwrap()
}

/// Every mip of grids of odd, even, flat and single sizes, of two levels, with one face and with six, in
/// textures and in buffers: each parent is, per direction, the mean over its four columns of the front child over the back
/// one. Children are read back as they stand; a 16-bit float is good to 2⁻¹¹, and ln(1 − a) loses up to 1/(1 − a) = 26 of
/// 1e-6. Nothing stands in the borders.
#[test]
fn mips_are_means_of_columns() {
    for (case, sizes) in [
        vec![UVec3::new(8, 4, 4)],
        vec![UVec3::new(7, 5, 3), UVec3::new(3, 9, 2)],
        vec![UVec3::new(1, 1, 1)],
        vec![UVec3::new(13, 1, 2)],
    ]
    .into_iter()
    .enumerate()
    {
        for n_faces in [1, 6] {
            for storage in [PyramidStorage::Textures, PyramidStorage::Buffers] {
                let grids: Vec<_> = sizes.iter().map(|&size| grid(size, n_faces)).collect();
                let pyramid = Pyramid::new(gpu(), &grids, storage, false).unwrap();
                let random = std::cell::RefCell::new(Random(17 + case as u64));
                for level in 0..grids.len() {
                    pyramid.write_base(gpu(), level, |_, _| random_texel(&mut random.borrow_mut()));
                }
                prefiltered(&pyramid);
                check_mips(&pyramid, &format!("{sizes:?}, {n_faces} faces, {storage:?}"));
            }
        }
    }
}

fn check_mips(pyramid: &Pyramid, what: &str) {
    let layout = pyramid.layout();
    let volumes = [0, 1, 2].map(|volume| texels_of(pyramid, volume));
    let extents = [layout.volume_base, layout.volume_odd, layout.volume_even];
    let texel = |level: usize, mip: u32, face: u32, cell: UVec3| {
        let entry = &layout.mips[level * 9 + mip as usize];
        if cell.cmpge(entry.size).any() {
            return [0.0; 4];
        }
        let volume = if mip == 0 { 0 } else { 2 - (mip as usize & 1) };
        let at = entry.first + cell + UVec3::new(0, 0, face * entry.stride);
        let size = extents[volume];
        volumes[volume][((at.z * size.y + at.y) * size.x + at.x) as usize]
    };
    let premultiplied = |[r, g, b, depth]: [f64; 4]| {
        let opacity = if depth >= OPAQUE { 1.0 } else { 1.0 - (-depth).exp() };
        let scale = if depth > 0.0 { opacity / depth } else { 0.0 };
        [r * scale, g * scale, b * scale, opacity]
    };
    let mut n_filled = [0; 3];
    for level in 0..layout.n_levels as usize {
        let n_mips = layout.levels[level].n_mips;
        let last = &layout.mips[level * 9 + n_mips as usize - 1];
        assert_eq!(last.size, UVec3::ONE, "{what}: size of the last mip of level {level}");
        for mip in 0..n_mips {
            let entry = &layout.mips[level * 9 + mip as usize];
            let expected = layout.levels[level].size.map(|n| n.div_ceil(1 << mip));
            assert_eq!(entry.size, expected, "{what}: size of level {level}, mip {mip}");
            for face in 0..layout.n_faces {
                for ix in 0..entry.size.element_product() {
                    let cell = UVec3::new(
                        ix % entry.size.x,
                        ix / entry.size.x % entry.size.y,
                        ix / (entry.size.x * entry.size.y),
                    );
                    let found = texel(level, mip, face, cell);
                    let volume = if mip == 0 { 0 } else { 2 - (mip as usize & 1) };
                    n_filled[volume] += usize::from(found != [0.0; 4]);
                    if mip == 0 {
                        continue;
                    }
                    let mut mean = [0.0; 4];
                    // One value for all sides is the mean of what all sides would see.
                    let sides = if layout.n_faces == 1 { 0..6 } else { face..face + 1 };
                    let n_columns = 4.0 * sides.len() as f64;
                    for (side, column) in sides.flat_map(|s| (0..4).map(move |c| (s, c))) {
                        let axis = side as usize / 2;
                        let mut child = 2 * cell;
                        child[(axis + 1) % 3] += column & 1;
                        child[(axis + 2) % 3] += column >> 1;
                        // Seen from the positive side, the upper child stands in front.
                        let (mut front, mut back) = (child, child);
                        if side % 2 == 0 {
                            front[axis] += 1
                        } else {
                            back[axis] += 1
                        };
                        let front = premultiplied(texel(level, mip - 1, face, front));
                        let back = premultiplied(texel(level, mip - 1, face, back));
                        for k in 0..4 {
                            mean[k] += 1.0 / n_columns * (front[k] + (1.0 - front[3]) * back[k]);
                        }
                    }
                    let depth = (-(1.0 - mean[3]).ln()).min(OPAQUE);
                    for k in 0..4 {
                        let light = if mean[3] > 0.0 { mean[k] / mean[3] } else { 0.0 };
                        let expected = if k == 3 { depth } else { light * depth };
                        let bound = expected * (1.0 / 1024.0 + 4e-5) + 1e-6;
                        assert!(
                            (found[k] - expected).abs() < bound,
                            "{what}: level {level}, mip {mip}, face {face}, cell {cell}: number {k} is {}, expected {expected} within {bound:.1e}",
                            found[k]
                        );
                    }
                }
            }
        }
    }
    for (volume, n) in n_filled.into_iter().enumerate() {
        let all = volumes[volume].iter().filter(|&&texel| texel != [0.0; 4]).count();
        assert_eq!(
            all, n,
            "{what}: filled texels of volume {volume} against those of its cells: something stands in a border"
        );
    }
}

/// What is opaque stays so, with its light, up to the last mip, and so does what is empty.
#[test]
fn opaque_and_empty_stay_so() {
    for (texel, expected) in
        [([0.0; 4], [0.0; 4]), ([6.5, 3.25, 0.0, 3.25], [6.5, 3.25, 0.0, 3.25])]
    {
        let pyramid =
            Pyramid::new(gpu(), &[grid(UVec3::splat(16), 6)], PyramidStorage::Textures, false)
                .unwrap();
        pyramid.write_base(gpu(), 0, |_, _| texel);
        prefiltered(&pyramid);
        let layout = pyramid.layout();
        for mip in 0..5u32 {
            let entry = &layout.mips[mip as usize];
            let volume = if mip == 0 { 0 } else { 2 - (mip as usize & 1) };
            let size = [layout.volume_base, layout.volume_odd, layout.volume_even][volume];
            let texels = texels_of(&pyramid, volume);
            for ix in 0..entry.size.element_product() {
                let cell = UVec3::new(
                    ix % entry.size.x,
                    ix / entry.size.x % entry.size.y,
                    ix / (entry.size.x * entry.size.y),
                );
                let at = entry.first + cell;
                let found = texels[((at.z * size.y + at.y) * size.x + at.x) as usize];
                assert_eq!(
                    found, expected,
                    "texel of cell {cell} in mip {mip} of a grid of {texel:?}"
                );
            }
        }
    }
}

fn trace(pyramid: &Pyramid, cones: &[Cone], stepping: ConeStepping, near: f32) -> Vec<ConeResult> {
    let inputs = storage(bytemuck::cast_slice(cones));
    // More room than a workgroup fills: no result may stand behind the last cone's.
    let bytes = cones.len() * size_of::<ConeResult>();
    let outputs = storage(&vec![0xa5; bytes + 70 * size_of::<ConeResult>()]);
    let pass = TracePass::new(gpu(), pyramid);
    let n = cones.len() as u32;
    submit(|recorder| pass.record(recorder, pyramid.field(), &inputs, &outputs, n, stepping, near));
    let found = read(&outputs);
    assert_each("bytes behind the last cone's result", &found[bytes..], "as they were", |&byte| {
        byte == 0xa5
    });
    bytemuck::pod_collect_to_vec(&found[..bytes])
}

fn free_cone(origin: Vec3, direction: Vec3, spread: f32, max_distance: f32) -> Cone {
    let direction = direction.normalize();
    Cone { origin, spread, direction, max_distance, normal: Vec3::ZERO, offset: 0.0 }
}

const EXACT: ConeStepping =
    ConeStepping { step_scale: 0.5, mip_bias: -0.4, opacity_threshold: 1.0, start_cells: 0.0 };

/// In a uniform medium of depth τ a cell along each axis, light that has come s cells along ω is e^(−τ·s·Σ|ω|) (by
/// projected area; with squared weights Σω² = 1), whatever the aperture; and the medium shines L·(1 − that). Coarser cells
/// are prefiltered, so twice as deep; 16-bit floats are good to 2⁻¹¹.
#[test]
fn cones_in_a_uniform_medium() {
    let tau = 0.0625f64;
    for storage in [PyramidStorage::Textures, PyramidStorage::Buffers] {
        for squared in [false, true] {
            let pyramid =
                Pyramid::new(gpu(), &[grid(UVec3::splat(64), 6)], storage, squared).unwrap();
            let t = tau as f32;
            pyramid.write_base(gpu(), 0, |_, _| [2.0 * t, t, 0.5 * t, t]);
            prefiltered(&pyramid);
            let mut random = Random(3);
            let cones: Vec<Cone> = (0..64)
                .map(|ix| {
                    let spread = [0.0, 0.1, 0.3, 0.6][ix % 4];
                    free_cone(
                        Vec3::splat(32.0),
                        random.direction(),
                        spread,
                        random.range(1.0, 14.0),
                    )
                })
                .collect();
            let near = 4.0;
            for (cone, found) in cones.iter().zip(trace(&pyramid, &cones, EXACT, near)) {
                let weight =
                    if squared { 1.0 } else { f64::from(cone.direction.abs().element_sum()) };
                let through = |length: f64| (-tau * weight * length).exp();
                let passed = through(f64::from(cone.max_distance));
                let what = format!("{storage:?}, squared {squared}, {cone:?}");
                assert!(
                    (f64::from(found.transmittance) - passed).abs() < 2e-3,
                    "{what}: transmittance is {}, expected {passed} within 2e-3",
                    found.transmittance
                );
                // It ends up to 0.35 cells earlier (`cone::march`).
                let near_end = f64::from(near.min(cone.max_distance));
                let earlier = near_end - 0.35 * (8.0 * f64::from(cone.spread)).max(1.0);
                let near_passed = f64::from(found.near_transmittance);
                assert!(
                    near_passed > through(near_end) - 2e-3,
                    "{what}: near transmittance is {near_passed}, expected at least {} less 2e-3",
                    through(near_end)
                );
                assert!(
                    near_passed < through(earlier) + 2e-3,
                    "{what}: near transmittance is {near_passed}, expected at most {} and 2e-3",
                    through(earlier)
                );
                let light = DVec3::new(2.0, 1.0, 0.5) * (1.0 - passed);
                assert!(
                    (found.radiance.as_dvec3() - light).largest() < 4e-3,
                    "{what}: radiance is {}, expected {light} within 4e-3",
                    found.radiance
                );
                assert!(
                    found.n_steps > 0 && found.n_steps < 256,
                    "{what}: {} steps, expected 1 to 255",
                    found.n_steps
                );
            }
        }
    }
}

/// A wall across an axis hides what is behind it (e^−3.25 = 4 % pass; found: up to 9 % of a wide cone at a slant) at any angle, wherever it stands between centres, and what is seen is its
/// light; a cone that looks along it passes.
#[test]
fn walls_are_opaque_at_any_angle() {
    let pyramid =
        Pyramid::new(gpu(), &[grid(UVec3::splat(32), 6)], PyramidStorage::Textures, false).unwrap();
    // Faces −X and +X of the cells at x = 20.
    pyramid.write_base(gpu(), 0, |cell, face| {
        if cell.x == 20 && face < 2 { [6.5, 3.25, 0.325, 3.25] } else { [0.0; 4] }
    });
    prefiltered(&pyramid);
    let stepping = ConeStepping { opacity_threshold: 0.95, ..EXACT };
    let mut cones = Vec::new();
    for x in [12.0, 12.25, 12.5, 12.75] {
        for slope in [0.0, 0.5, 1.0, 2.0] {
            for spread in [0.05, 0.2] {
                cones.push(free_cone(
                    Vec3::new(x, 3.0, 16.0),
                    Vec3::new(1.0, slope, 0.0),
                    spread,
                    1e9,
                ));
            }
        }
    }
    for (cone, found) in cones.iter().zip(trace(&pyramid, &cones, stepping, 0.0)) {
        assert!(
            found.transmittance < 0.1,
            "{cone:?}: transmittance behind a wall is {}, expected below 0.1",
            found.transmittance
        );
        let seen = found.radiance.x / (1.0 - found.transmittance);
        assert!(
            (seen / 2.0 - 1.0).abs() < 2e-3,
            "{cone:?}: radiance of the wall is {seen}, expected 2 within 2e-3 of it"
        );
    }
    let along = [free_cone(Vec3::new(10.5, 16.0, 1.0), Vec3::Z, 0.05, 1e9)];
    let passed = trace(&pyramid, &along, stepping, 0.0)[0].transmittance;
    assert!(passed > 0.99, "transmittance along the wall is {passed}, expected above 0.99");
}

/// A square of s × s cells at distance d, smaller than a cone that looks at its middle, hides the share of the cone's solid
/// angle that it takes, 4·asin(h²/(h² + d²)) with h = s/2. One look-up spans what cells of three quarters of the cone's width,
/// filtered, span, and depends on how the square stands among the cells: so the mean over 12 places, within
/// 25 %, over apertures in which the square takes 5 to 60 %.
#[test]
fn a_square_hides_its_solid_angle() {
    let pyramid =
        Pyramid::new(gpu(), &[grid(UVec3::splat(64), 6)], PyramidStorage::Textures, false).unwrap();
    let mut random = Random(8);
    let half = 4.0;
    let configurations: Vec<(f64, f64, f64)> = [12.5, 16.5, 24.5, 32.5f64]
        .iter()
        .flat_map(|&distance| [0.25, 0.35, 0.5, 0.7f64].map(|spread| (distance, spread)))
        .map(|(distance, spread)| {
            let square = 4.0 * (half * half / (half * half + distance * distance)).asin();
            let cone = std::f64::consts::TAU * (1.0 - 1.0 / (1.0 + spread * spread).sqrt());
            (distance, spread, square / cone)
        })
        .filter(|(_, _, share)| (0.05..0.6).contains(share))
        .collect();
    assert!(configurations.len() > 8, "{} configurations, expected above 8", configurations.len());
    let mut hidden = vec![0.0; configurations.len()];
    let n_places = 12;
    for _ in 0..n_places {
        let mut place = || 20 + (random.bits() % 16) as u32;
        let low = UVec3::new(place() + 16, place(), place());
        pyramid.write_base(gpu(), 0, |cell, face| {
            let inside = |axis: usize| (low[axis]..low[axis] + 8).contains(&cell[axis]);
            if cell.x == low.x && inside(1) && inside(2) && face < 2 { [3.25; 4] } else { [0.0; 4] }
        });
        prefiltered(&pyramid);
        let cones: Vec<Cone> = configurations
            .iter()
            .map(|&(distance, spread, _)| {
                let middle = low.as_vec3() + Vec3::new(0.5 - distance as f32, 4.0, 4.0);
                free_cone(middle, Vec3::X, spread as f32, 1e9)
            })
            .collect();
        for (sum, found) in hidden.iter_mut().zip(trace(&pyramid, &cones, EXACT, 0.0)) {
            *sum += (1.0 - f64::from(found.transmittance)) / f64::from(n_places);
        }
    }
    let ratios: Vec<f64> =
        hidden.iter().zip(&configurations).map(|(found, (_, _, share))| found / share).collect();
    eprintln!("hidden, relative to the solid angle: {ratios:.2?}");
    for (ratio, (distance, spread, _)) in ratios.iter().zip(&configurations) {
        assert!(
            (0.75..1.25).contains(ratio),
            "square at {distance} cells, cone of spread {spread}: what is hidden is {ratio} of the solid angle's share, expected 0.75 to 1.25"
        );
    }
}

/// An opaque wall at the near distance counts half, on average of where it stands among the cells, however wide the cone is:
/// within 0.1 (a step of half a width, cut in the middle of the wall's filtered depth, is that rough).
#[test]
fn a_wall_at_the_near_distance_counts_half() {
    let pyramid =
        Pyramid::new(gpu(), &[grid(UVec3::splat(64), 6)], PyramidStorage::Textures, false).unwrap();
    let shapes: Vec<(f32, f32)> = [4.0, 8.0, 16.0]
        .iter()
        .flat_map(|&distance| [0.05, 0.2, 0.5].map(|spread| (distance, spread)))
        .collect();
    let mut means = vec![[0.0; 3]; shapes.len()];
    let n_places = 16;
    for wall in 32..32 + n_places {
        pyramid.write_base(gpu(), 0, |cell, face| {
            if cell.x == wall && face < 2 { [OPAQUE as f32; 4] } else { [0.0; 4] }
        });
        prefiltered(&pyramid);
        let cones: Vec<Cone> = shapes
            .iter()
            .map(|&(distance, spread)| {
                let x = wall as f32 + 0.5 - distance;
                free_cone(Vec3::new(x, 32.0, 32.0), Vec3::X, spread, 1e9)
            })
            .collect();
        for near in [2.0, 4.0, 8.0, 16.0, 32.0] {
            let found = trace(&pyramid, &cones, EXACT, near);
            for ((sums, cone), &(distance, _)) in means.iter_mut().zip(found).zip(&shapes) {
                if let Some(ix) = [0.5, 1.0, 2.0].iter().position(|share| share * distance == near)
                {
                    sums[ix] += cone.near_transmittance / n_places as f32;
                }
            }
        }
    }
    for ([before, there, behind], (distance, spread)) in means.iter().zip(&shapes) {
        let what = format!("wall at {distance} cells, cone of spread {spread}");
        assert!(
            *before > 0.95 && *behind < 0.1,
            "{what}: near transmittance with the wall at twice the near distance is {before}, at half of it {behind}; expected above 0.95 and below 0.1"
        );
        assert!(
            (there - 0.5).abs() < 0.1,
            "{what}: near transmittance with the wall at the near distance is {there}, expected 0.5 within 0.1"
        );
    }
}

/// Nested levels: around the point (64, 64, 64), of cells of 1, 2 and 4.
fn nested() -> [VoxelGrid; 3] {
    [(48.0, 1.0), (32.0, 2.0), (0.0, 4.0)].map(|(origin, cell)| VoxelGrid {
        origin: Vec3::splat(origin),
        cell,
        ..grid(UVec3::splat(32), 6)
    })
}

/// Where one level ends and the next begins there is no seam: in a medium of even depth that shines evenly, light through
/// three levels is that of the closed form within 1 %, for cones of any width; along a line across both borders it is
/// steady.
#[test]
fn levels_meet_without_a_seam() {
    let tau = 0.01f32;
    for storage in [PyramidStorage::Textures, PyramidStorage::Buffers] {
        let grids = nested();
        let pyramid = Pyramid::new(gpu(), &grids, storage, true).unwrap();
        for (level, grid) in grids.iter().enumerate() {
            let t = tau * grid.cell;
            pyramid.write_base(gpu(), level, |_, _| [2.0 * t, t, 0.5 * t, t]);
        }
        prefiltered(&pyramid);
        let mut random = Random(11);
        let mut cones: Vec<Cone> = (0..64)
            .map(|ix| {
                let origin = Vec3::splat(64.0) + 8.0 * random.direction();
                let spread = [0.0, 0.1, 0.3, 0.6][ix % 4];
                free_cone(origin, random.direction(), spread, random.range(4.0, 40.0))
            })
            .collect();
        // Short cones of one length, from the finest level's middle out to the coarsest.
        cones.extend(
            (0..100).map(|k| {
                free_cone(Vec3::new(64.0 + 0.4 * k as f32, 64.3, 63.8), Vec3::X, 0.05, 3.0)
            }),
        );
        for (cone, found) in cones.iter().zip(trace(&pyramid, &cones, EXACT, 0.0)) {
            let passed = (-f64::from(tau * cone.max_distance)).exp();
            let what = format!("{storage:?}, {cone:?}");
            let hidden = 1.0 - f64::from(found.transmittance);
            assert!(
                (hidden / (1.0 - passed) - 1.0).abs() < 0.01,
                "{what}: the share hidden is {hidden}, expected {} within 1 %",
                1.0 - passed
            );
            let light = found.radiance.as_dvec3() / DVec3::new(2.0, 1.0, 0.5);
            assert!(
                (light / (1.0 - passed) - 1.0).largest() < 0.01,
                "{what}: light relative to the medium's is {light}, expected {} within 1 %",
                1.0 - passed
            );
        }
    }
}

/// Walls of one radiance around levels are seen with it, whichever level's cells a cone reads: within 1 % of what it
/// absorbs.
#[test]
fn walls_look_alike_in_every_level() {
    let grids = nested();
    let pyramid = Pyramid::new(gpu(), &grids, PyramidStorage::Textures, false).unwrap();
    for (level, grid) in grids.iter().enumerate() {
        pyramid.write_base(gpu(), level, |cell, _| {
            let at = grid.origin + (cell.as_vec3() + 0.5) * grid.cell;
            // Two boxes, of which one lies within the finest level and the other in the middle one alone.
            let inside = |low: f32, high: f32| {
                at.cmpge(Vec3::splat(low)).all() && at.cmplt(Vec3::splat(high)).all()
            };
            let is_wall = (inside(50.0, 56.0) && !inside(52.0, 54.0))
                || (inside(84.0, 92.0) && !inside(86.0, 90.0));
            if is_wall { [2.0 * 3.25, 3.25, 0.5 * 3.25, 3.25] } else { [0.0; 4] }
        });
    }
    prefiltered(&pyramid);
    let mut n_seen = 0;
    let targets = [53.0, 88.0].map(Vec3::splat);
    let mut random = Random(12);
    let cones: Vec<Cone> = (0..200)
        .map(|ix| {
            let origin = Vec3::splat(70.0) + 6.0 * random.direction();
            let to = targets[ix % 2] + 2.0 * random.direction() - origin;
            free_cone(origin, to, [0.0, 0.1, 0.3, 0.6][ix / 2 % 4], 1e9)
        })
        .collect();
    for (cone, found) in cones.iter().zip(trace(&pyramid, &cones, EXACT, 0.0)) {
        let hidden = 1.0 - f64::from(found.transmittance);
        if hidden > 0.05 {
            n_seen += 1;
            let light = found.radiance.as_dvec3() / DVec3::new(2.0, 1.0, 0.5) / hidden;
            assert!(
                (light - 1.0).largest() < 0.01,
                "{cone:?}: light relative to the wall's and to the share hidden, {hidden}, is {light}, expected 1 within 0.01"
            );
        }
    }
    assert!(n_seen > 100, "{n_seen} of {} cones see a wall, expected above 100", cones.len());
}

/// Where two or three walls meet in a cell, of which each covers what the others leave open, all are closed; a lone
/// surface and a convex edge keep their coverage.
#[test]
fn concave_corners_are_closed() {
    let cases = [
        // A floor 0.3 deep that ends at a wall 0.4 deep: it covers 0.4 of the cell, and the wall 0.3 of it.
        ([0.4, 0.3, 0.0], [0.3, 0.4, -1.0], [1.0, 1.0, 0.0]),
        // Three walls, the corner of a room; each covers a product.
        ([0.5 * 0.8, 0.7 * 0.8, 0.7 * 0.5], [0.7, 0.5, 0.8], [1.0, 1.0, 1.0]),
        // A floor alone.
        ([0.0, 0.4, 0.0], [-1.0, 0.3, -1.0], [0.0, 0.4, 0.0]),
        // Edges of tables: the top covers what lies behind the side's plane, 1 less the side's depth.
        ([0.7, 0.6, 0.0], [0.4, 0.3, -1.0], [0.7, 0.6, 0.0]),
        ([0.3, 0.2, 0.0], [0.8, 0.7, -1.0], [0.3, 0.2, 0.0]),
        ([0.0, 0.0, 0.0], [-1.0, -1.0, -1.0], [0.0, 0.0, 0.0]),
    ];
    let inputs: Vec<[Four; 2]> = cases
        .iter()
        .map(|(coverage, depth, _)| {
            [coverage, depth].map(|v| Four { v: Vec3::from(*v).extend(0.0) })
        })
        .collect();
    let found: Vec<Four> = map(
        "#import lucerna::components::voxel_pyramid::opacity::corner_opacity
         struct Input { coverage: vec4<f32>, depth: vec4<f32> }
         alias Output = vec4<f32>;
         fn map(x: Input) -> Output { return vec4<f32>(corner_opacity(x.coverage.xyz, x.depth.xyz), 0.0); }",
        &inputs,
    );
    for ((coverage, depth, expected), found) in cases.iter().zip(&found) {
        let error = (found.v.truncate() - Vec3::from(*expected)).largest();
        assert!(
            error < 1e-5,
            "coverage {coverage:?}, depth {depth:?}: opacity is {}, expected {expected:?} within 1e-5",
            found.v.truncate()
        );
    }
}

/// A sphere before a depth is open, behind it hidden, and in between by the share of its width; what stands farther in front
/// than `thickness` does not hide.
#[test]
fn spheres_are_hidden_by_what_stands_before_them() {
    // z, radius, found, thickness
    let cases: [([f32; 4], f32); 7] = [
        ([5.0, 0.5, 6.0, 1.0], 1.0),
        ([5.0, 0.5, 5.5, 1.0], 1.0),
        ([5.0, 0.5, 5.25, 1.0], 0.75),
        ([5.0, 0.5, 5.0, 1.0], 0.5),
        ([5.0, 0.5, 4.5, 1.0], 0.0),
        ([5.0, 0.5, 3.6, 1.0], 0.0),
        ([5.0, 0.5, 3.4, 1.0], 1.0),
    ];
    let inputs: Vec<Four> = cases.iter().map(|(v, _)| Four { v: Vec4::from(*v) }).collect();
    let found: Vec<Four> = map(
        "#import lucerna::cone::depth_cone::sphere_openness
         alias Input = vec4<f32>;
         alias Output = vec4<f32>;
         fn map(x: Input) -> Output { return vec4<f32>(sphere_openness(x.x, x.y, x.z, x.w), 0.0, 0.0, 0.0); }",
        &inputs,
    );
    for ((input, expected), found) in cases.iter().zip(&found) {
        assert!(
            (found.v.x - expected).abs() < 1e-5,
            "z, radius, depth found and thickness {input:?}: openness is {}, expected {expected} within 1e-5",
            found.v.x
        );
    }
}

/// Neighbours on the same plane weigh 1; 1 % of the depth off it e⁻¹; at right angles nothing; and the Gaussian is one.
#[test]
fn neighbours_weigh_by_how_alike_they_are() {
    // offset, depth | cosine between the normals, which lie in the plane of x and y, and a Gaussian's offset
    let (lean, depth) = (0.3f32, 4.0f32);
    let cases: [([f32; 4], [f32; 3]); 5] = [
        ([2.0, 0.0, -3.0, depth], [1.0, 0.0, 0.0]),
        ([2.0, 0.04, 1.0, depth], [1.0, 1.0, 2.0]),
        ([0.0, -0.08, 0.0, depth], [1.0, 3.0, 0.0]),
        ([1.0, 0.0, 0.0, depth], [lean.cos(), 0.5, 0.5]),
        ([1.0, 0.0, 0.0, depth], [0.0, 1.5, 0.0]),
    ];
    let inputs: Vec<[Four; 2]> = cases
        .iter()
        .map(|(a, b)| [Four { v: Vec4::from(*a) }, Four { v: Vec3::from(*b).extend(1.5) }])
        .collect();
    let found: Vec<Four> = map(
        "#import lucerna::frame::upscale::{gaussian_weight, surface_weight}
         struct Input { a: vec4<f32>, b: vec4<f32> }
         alias Output = vec4<f32>;
         fn map(x: Input) -> Output {
             let other = vec3<f32>(sqrt(1.0 - x.b.x * x.b.x), x.b.x, 0.0);
             let weight = surface_weight(x.a.xyz, x.a.w, vec3<f32>(0.0, 1.0, 0.0), other);
             return vec4<f32>(weight, gaussian_weight(x.b.yz, x.b.w), 0.0, 0.0);
         }",
        &inputs,
    );
    for ((a, b), found) in cases.iter().zip(&found) {
        let [_, off, _, depth] = a.map(f64::from);
        let [cosine, x, y] = b.map(f64::from);
        let weight = (-off.abs() / (0.01 * depth)).exp() * cosine.powi(16);
        let gaussian = (-(x * x + y * y) / (2.0 * 1.5 * 1.5)).exp();
        assert!(
            (f64::from(found.v.x) - weight).abs() < 1e-5,
            "off the plane by {off} at depth {depth}, cosine {cosine}: the weight is {}, expected {weight} within 1e-5",
            found.v.x
        );
        assert!(
            (f64::from(found.v.y) - gaussian).abs() < 1e-6,
            "offset ({x}, {y}), σ 1.5: the Gaussian's weight is {}, expected {gaussian} within 1e-6",
            found.v.y
        );
    }
}

/// Buffers give the same numbers as textures: lavapipe filters to 1e-7; a GPU weighs with 8 bits or more, which is half a
/// step of 1/256 of a texel's difference.
#[test]
fn buffers_and_textures_agree() {
    let grids = [
        grid(UVec3::new(21, 13, 17), 6),
        VoxelGrid { cell: 2.0, ..grid(UVec3::new(16, 16, 9), 6) },
    ];
    let mut random = Random(9);
    let cones: Vec<Cone> = (0..500)
        .map(|_| {
            let origin =
                Vec3::new(21.0 * random.unit(), 13.0 * random.unit(), 17.0 * random.unit());
            free_cone(origin, random.direction(), random.unit(), 40.0)
        })
        .collect();
    let [textures, buffers] = [PyramidStorage::Textures, PyramidStorage::Buffers].map(|storage| {
        let pyramid = Pyramid::new(gpu(), &grids, storage, false).unwrap();
        let random = std::cell::RefCell::new(Random(4));
        for level in 0..2 {
            pyramid.write_base(gpu(), level, |_, _| {
                random_texel(&mut random.borrow_mut()).map(|v| 0.2 * v)
            });
        }
        prefiltered(&pyramid);
        trace(&pyramid, &cones, EXACT, 3.0)
    });
    for (cone, (one, other)) in cones.iter().zip(textures.iter().zip(&buffers)) {
        let what = format!("{cone:?} in buffers");
        assert!(
            (one.transmittance - other.transmittance).abs() < 2e-3,
            "{what}: transmittance is {}, expected the textures' {} within 2e-3",
            other.transmittance,
            one.transmittance
        );
        assert!(
            (one.radiance - other.radiance).largest() < 8e-3,
            "{what}: radiance is {}, expected the textures' {} within 8e-3",
            other.radiance,
            one.radiance
        );
        assert!(
            (one.near_transmittance - other.near_transmittance).abs() < 2e-3,
            "{what}: near transmittance is {}, expected the textures' {} within 2e-3",
            other.near_transmittance,
            one.near_transmittance
        );
        assert_eq!(
            one.n_steps, other.n_steps,
            "{what}: steps (right), expected the textures' (left)"
        );
    }
}
