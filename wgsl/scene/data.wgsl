// SPDX-License-Identifier: MIT OR Apache-2.0
//! Scene seam: the scene's data as lucerna stores it, in bind group 0.
//!
//! A renderer with its own scene replaces the modules of `scene/` that kernels use (`rays`, `triangles`, `surface`,
//! `lights`, `light_rays`, `sky`), keeps `types`, and does not need this one. Storage buffers: 3 here and 1 in
//! `scene/rays`. (Materials are in a texture, so that a kernel has 4 storage buffers for itself.)
#define_import_path lucerna::scene::data

/// The triangle's material removes parts by alpha.
const TRIANGLE_ALPHA_TESTED: u32 = 1u;
/// The triangle belongs to an instance that moves.
const TRIANGLE_MOVING: u32 = 2u;

/// Data that does not change during a frame.
struct SceneInfo {
    /// World-space box of all triangles [m].
    bounds_min: vec3<f32>,
    n_triangles: u32,
    bounds_max: vec3<f32>,
    n_lights: u32,
    /// Factor of the sky's image, or the radiance itself if there is none [W·sr⁻¹·m⁻²].
    sky_radiance: vec3<f32>,
    /// 1: the sky has an image.
    sky_has_image: u32,
    /// Texels of the sky's image.
    sky_size: vec2<u32>,
    /// Index of the sky in `lights`; NONE if it is black.
    sky_light: u32,
    /// 1: every surface is Lambertian with the base colour as albedo.
    diffuse_only: u32,
    /// Number of lights that a ray can hit: emissive triangles and the sky.
    n_hittable_lights: u32,
    /// Number of point, spot and directional lights: the first entries of `lights`.
    n_punctual_lights: u32,
    reserved_a: u32,
    reserved_b: u32,
}

/// A triangle for rays, in world space and in the order of the BVH's leaves.
struct Triangle {
    corner_a: vec3<f32>,
    /// TRIANGLE_ bits.
    flags: u32,
    corner_b: vec3<f32>,
    /// Index into `materials`.
    material: u32,
    corner_c: vec3<f32>,
    /// Index into `lights`, or NONE if the triangle does not emit light.
    light: u32,
}

/// The bitangents are mirrored.
const SHADING_MIRRORED: u32 = 1u;
/// The normals are not all the triangle's own.
const SHADING_HAS_NORMALS: u32 = 2u;
/// The colours are not all white.
const SHADING_HAS_COLORS: u32 = 4u;

/// A triangle's data for shading, in the same order. Arrays are over the three corners.
struct TriangleShading {
    /// World-space normals, `octahedral::pack_direction`.
    normals: vec3<u32>,
    /// SHADING_ bits.
    flags: u32,
    /// World-space tangents, `octahedral::pack_direction`.
    tangents: vec3<u32>,
    reserved: u32,
    /// Texture coordinates of sets 0 and 1, before texture transforms.
    uv_first: array<vec2<f32>, 3>,
    uv_second: array<vec2<f32>, 3>,
    /// Linear RGBA, 2×`pack2x16unorm` per corner.
    colors: array<vec2<u32>, 3>,
    reserved_pair: vec2<u32>,
}

/// Where a material's texture is in the atlas, and how it is read.
struct TextureSlot {
    /// Image u = dot(row_u, (u, v, 1)).
    row_u: vec3<f32>,
    /// SLOT_ bits.
    flags: u32,
    row_v: vec3<f32>,
    /// Array layer of the atlas.
    layer: u32,
    /// First texel of mip 0; mip 1 is to the right of mip 0, each further one below the last.
    origin: vec2<u32>,
    /// Texels of mip 0; 0: there is no texture.
    size: vec2<u32>,
}

/// Mirror instead of repeat, horizontally.
const SLOT_MIRROR_U: u32 = 1u;
/// Clamp to the edge instead of repeat, horizontally.
const SLOT_CLAMP_U: u32 = 2u;
const SLOT_MIRROR_V: u32 = 4u;
const SLOT_CLAMP_V: u32 = 8u;
/// No interpolation between texels.
const SLOT_NEAREST: u32 = 16u;
/// Read with the second set of texture coordinates.
const SLOT_SECOND_UV: u32 = 32u;

/// A glTF 2.0 metallic-roughness material.
struct Material {
    /// Linear RGBA.
    base_color: vec4<f32>,
    /// Radiance [W·sr⁻¹·m⁻²].
    emission: vec3<f32>,
    metallic: f32,
    roughness: f32,
    normal_scale: f32,
    /// The surface is present where alpha ≥ cutoff; negative: opaque.
    alpha_cutoff: f32,
    /// MATERIAL_ bits.
    flags: u32,
    base_color_texture: TextureSlot,
    metallic_roughness_texture: TextureSlot,
    normal_texture: TextureSlot,
    emission_texture: TextureSlot,
}

/// Both sides emit light.
const MATERIAL_DOUBLE_SIDED: u32 = 1u;
/// Size of a material, 240 bytes, in texels of four words.
const MATERIAL_TEXELS: u32 = 15u;
/// Limits a row to 8192 texels.
const MATERIALS_PER_ROW: u32 = 512u;

/// Kinds of light.
const LIGHT_POINT: u32 = 0u;
const LIGHT_SPOT: u32 = 1u;
const LIGHT_DIRECTIONAL: u32 = 2u;
const LIGHT_TRIANGLE: u32 = 3u;
const LIGHT_SKY: u32 = 4u;

/// A light and its entry in the alias table from which lights are sampled.
struct Light {
    /// [m]; for point and spot.
    position: vec3<f32>,
    /// LIGHT_ constant.
    kind: u32,
    /// Direction in which light travels, unit length; for spot and directional.
    direction: vec3<f32>,
    /// Index into `triangles`; for triangles.
    triangle: u32,
    /// Radiant intensity [W·sr⁻¹]; irradiance [W·m⁻²] for directional.
    intensity: vec3<f32>,
    /// glTF's range [m]; 0: none.
    range: f32,
    /// Spot: intensity = I · clamp(cos·scale + offset, 0, 1)².
    spot_scale: f32,
    spot_offset: f32,
    /// Probability with which the table samples this light.
    probability: f32,
    /// Alias table (Vose): this entry is sampled if the random number is below this, otherwise `alias_ix` is.
    alias_threshold: f32,
    alias_ix: u32,
    /// The same three for a second table, over only the lights that a ray can hit. (These are the entries after the
    /// punctual ones; 0 for those.)
    hittable_probability: f32,
    hittable_threshold: f32,
    hittable_alias_ix: u32,
}

@group(0) @binding(0) var<uniform> scene: SceneInfo;
@group(0) @binding(1) var<storage, read> triangles: array<Triangle>;
@group(0) @binding(2) var<storage, read> triangle_shading: array<TriangleShading>;
/// The words of each `Material`, MATERIAL_TEXELS texels in a row, MATERIALS_PER_ROW materials in a row of texels.
@group(0) @binding(3) var material_words: texture_2d<u32>;
@group(0) @binding(4) var<storage, read> lights: array<Light>;
/// Every material texture with its mips; texels as stored.
@group(0) @binding(5) var atlas: texture_2d_array<f32>;
/// Equirectangular radiance.
@group(0) @binding(7) var sky_image: texture_2d<f32>;
/// Cumulative distribution over the sky's texels: column 0 over the rows, then within each row.
@group(0) @binding(8) var sky_distribution: texture_2d<f32>;

/// A material. (Compilers drop the loads of unused parts.)
fn material_at(material_ix: u32) -> Material {
    let x = MATERIAL_TEXELS * (material_ix % MATERIALS_PER_ROW);
    let y = material_ix / MATERIALS_PER_ROW;
    var material: Material;
    material.base_color = bitcast<vec4<f32>>(textureLoad(material_words, vec2<u32>(x, y), 0));
    let emission = bitcast<vec4<f32>>(textureLoad(material_words, vec2<u32>(x + 1u, y), 0));
    material.emission = emission.xyz;
    material.metallic = emission.w;
    let rest = textureLoad(material_words, vec2<u32>(x + 2u, y), 0);
    material.roughness = bitcast<f32>(rest.x);
    material.normal_scale = bitcast<f32>(rest.y);
    material.alpha_cutoff = bitcast<f32>(rest.z);
    material.flags = rest.w;
    material.base_color_texture = texture_slot_at(vec2<u32>(x + 3u, y));
    material.metallic_roughness_texture = texture_slot_at(vec2<u32>(x + 6u, y));
    material.normal_texture = texture_slot_at(vec2<u32>(x + 9u, y));
    material.emission_texture = texture_slot_at(vec2<u32>(x + 12u, y));
    return material;
}

/// The texture slot whose words start at a texel.
fn texture_slot_at(texel: vec2<u32>) -> TextureSlot {
    let first = textureLoad(material_words, texel, 0);
    let second = textureLoad(material_words, texel + vec2<u32>(1u, 0u), 0);
    let third = textureLoad(material_words, texel + vec2<u32>(2u, 0u), 0);
    return TextureSlot(
        bitcast<vec3<f32>>(first.xyz),
        first.w,
        bitcast<vec3<f32>>(second.xyz),
        second.w,
        third.xy,
        third.zw,
    );
}
