// SPDX-License-Identifier: MIT OR Apache-2.0
//! Host seam: what stands at a hit.
//!
//! Interface: `Surface`, `surface_at`, `is_cut_away`; for the voxelizer `SurfaceOver`,
//! `surface_over`.
#define_import_path lucerna::host::surface

#import lucerna::geometry::barycentric::{interpolate_vec2, interpolate_vec3, interpolate_vec4}
#import lucerna::geometry::ray_offset::interpolation_error
#import lucerna::host::scene::{scene, triangles, triangle_shading, materials, TextureSlot, SLOT_SECOND_UV, MATERIAL_DOUBLE_SIDED}
#import lucerna::host::scene::{SHADING_MIRRORED, SHADING_HAS_NORMALS, SHADING_HAS_COLORS}
#import lucerna::host::textures::{sample_srgb, sample_linear}
#import lucerna::math::octahedral::unpack_direction
#import lucerna::math::vector::safe_normalize

/// A point of a surface, in world space.
struct Surface {
    /// [m]
    position: vec3<f32>,
    /// Bound of the position's rounding error per axis [m].
    position_error: vec3<f32>,
    /// Unit length, by the triangle's winding: out of the front face.
    geometric_normal: vec3<f32>,
    /// Unit length, interpolated and normal-mapped, on the geometric normal's side.
    shading_normal: vec3<f32>,
    /// Linear, in [0, 1].
    base_color: vec3<f32>,
    metallic: f32,
    /// Perceptual.
    roughness: f32,
    /// Radiance out of the front face [W·sr⁻¹·m⁻²].
    emission: vec3<f32>,
    /// Emission leaves the back as well.
    double_sided: bool,
    /// Reflects as Lambert with `base_color` for its albedo; metallic and roughness do not count.
    lambert: bool,
}

/// Linear RGBA in 0..1 of four 16-bit unorms: red and green, then blue and alpha, low halves first.
fn corner_color(packed: vec2<u32>) -> vec4<f32> {
    return vec4<f32>(unpack2x16unorm(packed.x), unpack2x16unorm(packed.y));
}

/// Base colour and alpha: factor × texture × vertex colour.
fn base_color_at(triangle_ix: u32, weights: vec2<f32>) -> vec4<f32> {
    return base_color_over(triangle_ix, weights, 0.0);
}

/// As [`base_color_at`], the texture averaged over about `width` [m] by its mips; 0: not averaged.
fn base_color_over(triangle_ix: u32, weights: vec2<f32>, width: f32) -> vec4<f32> {
    let material_ix = triangles[triangle_ix].material;
    var color = materials[material_ix].base_color;
    if (triangle_shading[triangle_ix].flags & SHADING_HAS_COLORS) != 0u {
        color *= interpolate_vec4(
            corner_color(triangle_shading[triangle_ix].colors[0]),
            corner_color(triangle_shading[triangle_ix].colors[1]),
            corner_color(triangle_shading[triangle_ix].colors[2]),
            weights,
        );
    }
    if materials[material_ix].base_color_texture.size.x != 0u {
        let slot = materials[material_ix].base_color_texture;
        let level = mip_of_width(triangle_ix, slot, width);
        color *= sample_srgb(slot, texture_uv(triangle_ix, slot, weights), level);
    }
    return color;
}

/// The mip whose texels are about `width` [m] wide on the triangle.
fn mip_of_width(triangle_ix: u32, slot: TextureSlot, width: f32) -> u32 {
    if width <= 0.0 {
        return 0u;
    }
    let a = triangles[triangle_ix].corner_a;
    let b = triangles[triangle_ix].corner_b;
    let c = triangles[triangle_ix].corner_c;
    let uv = texture_uv(triangle_ix, slot, vec2<f32>(0.0));
    let u = texture_uv(triangle_ix, slot, vec2<f32>(1.0, 0.0)) - uv;
    let v = texture_uv(triangle_ix, slot, vec2<f32>(0.0, 1.0)) - uv;
    // Texels of the triangle's parallelogram, through the texture's transform.
    let turn = slot.row_u.x * slot.row_v.y - slot.row_u.y * slot.row_v.x;
    let texels = abs((u.x * v.y - u.y * v.x) * turn) * f32(slot.size.x) * f32(slot.size.y);
    let area = length(cross(b - a, c - a));
    let per_width = texels * width * width / max(area, 1e-30);
    // Half the logarithm of an area is that of a length. Below a texel: mip 0.
    return u32(clamp(0.5 * log2(max(per_width, 1.0)) + 0.5, 0.0, 16.0));
}

/// What a patch of a triangle looks like from afar.
struct SurfaceOver {
    /// Linear, in [0, 1]; metals too reflect with it.
    base_color: vec3<f32>,
    /// The alpha mask removes the patch.
    is_cut_away: bool,
    /// Radiance out of the front face [W·sr⁻¹·m⁻²].
    emission: vec3<f32>,
    /// Emission leaves the back as well.
    double_sided: bool,
}

/// The patch around a point, about `width` [m] across: textures are read from the mip of that width.
/// `weights`: of the triangle's second and third corner.
fn surface_over(triangle_ix: u32, weights: vec2<f32>, width: f32) -> SurfaceOver {
    let material_ix = triangles[triangle_ix].material;
    let cutoff = materials[material_ix].alpha_cutoff;
    let color = base_color_over(triangle_ix, weights, width);
    return SurfaceOver(
        color.rgb,
        cutoff >= 0.0 && color.a < cutoff,
        emission_over(triangle_ix, weights, width),
        (materials[material_ix].flags & MATERIAL_DOUBLE_SIDED) != 0u,
    );
}

/// The mesh's coordinates that a texture is read with.
fn texture_uv(triangle_ix: u32, slot: TextureSlot, weights: vec2<f32>) -> vec2<f32> {
    if (slot.flags & SLOT_SECOND_UV) != 0u {
        return interpolate_vec2(
            triangle_shading[triangle_ix].uv_second[0],
            triangle_shading[triangle_ix].uv_second[1],
            triangle_shading[triangle_ix].uv_second[2],
            weights,
        );
    }
    return interpolate_vec2(
        triangle_shading[triangle_ix].uv_first[0],
        triangle_shading[triangle_ix].uv_first[1],
        triangle_shading[triangle_ix].uv_first[2],
        weights,
    );
}

/// Whether the material's alpha mask removes this point. `weights`: of the second and third corner.
fn is_cut_away(triangle_ix: u32, weights: vec2<f32>) -> bool {
    let cutoff = materials[triangles[triangle_ix].material].alpha_cutoff;
    return cutoff >= 0.0 && base_color_at(triangle_ix, weights).a < cutoff;
}

/// Radiance that the triangle emits at a point, out of its front face [W·sr⁻¹·m⁻²].
fn emission_at(triangle_ix: u32, weights: vec2<f32>) -> vec3<f32> {
    return emission_over(triangle_ix, weights, 0.0);
}

/// As [`emission_at`], the texture averaged over about `width` [m] by its mips; 0: not averaged.
fn emission_over(triangle_ix: u32, weights: vec2<f32>, width: f32) -> vec3<f32> {
    let material_ix = triangles[triangle_ix].material;
    var emission = materials[material_ix].emission;
    if materials[material_ix].emission_texture.size.x != 0u {
        let slot = materials[material_ix].emission_texture;
        let level = mip_of_width(triangle_ix, slot, width);
        emission *= sample_srgb(slot, texture_uv(triangle_ix, slot, weights), level).rgb;
    }
    return emission;
}

/// The surface at a hit. `weights`: of the triangle's second and third corner.
fn surface_at(triangle_ix: u32, weights: vec2<f32>) -> Surface {
    let triangle = triangles[triangle_ix];
    let a = triangle.corner_a;
    let b = triangle.corner_b;
    let c = triangle.corner_c;

    var surface: Surface;
    surface.position = interpolate_vec3(a, b, c, weights);
    surface.position_error = interpolation_error(a, b, c);
    surface.geometric_normal = safe_normalize(cross(b - a, c - a), vec3<f32>(0.0, 1.0, 0.0));

    var normal = surface.geometric_normal;
    if (triangle_shading[triangle_ix].flags & SHADING_HAS_NORMALS) != 0u {
        let normals = triangle_shading[triangle_ix].normals;
        let along = interpolate_vec3(
            unpack_direction(normals.x),
            unpack_direction(normals.y),
            unpack_direction(normals.z),
            weights,
        );
        normal = safe_normalize(along, surface.geometric_normal);
    }
    let material_ix = triangle.material;
    surface.base_color = base_color_at(triangle_ix, weights).rgb;
    surface.emission = emission_at(triangle_ix, weights);
    surface.double_sided = (materials[material_ix].flags & MATERIAL_DOUBLE_SIDED) != 0u;
    surface.metallic = 0.0;
    surface.roughness = 1.0;
    surface.lambert = scene.diffuse_only != 0u;
    if !surface.lambert {
        surface.metallic = materials[material_ix].metallic;
        surface.roughness = materials[material_ix].roughness;
        if materials[material_ix].metallic_roughness_texture.size.x != 0u {
            let slot = materials[material_ix].metallic_roughness_texture;
            let texel = sample_linear(slot, texture_uv(triangle_ix, slot, weights), 0u);
            surface.metallic *= texel.b;
            surface.roughness *= texel.g;
        }
        if materials[material_ix].normal_texture.size.x != 0u {
            normal = mapped_normal(triangle_ix, weights, normal);
        }
    }
    // A normal that points through the surface is bent back onto its side.
    surface.shading_normal = select(-normal, normal, dot(normal, surface.geometric_normal) >= 0.0);
    return surface;
}

/// The normal map's normal (glTF 2.0 §3.9.3): 2·texel − 1, x and y scaled, in the frame of the
/// interpolated tangent, bitangent and normal.
fn mapped_normal(triangle_ix: u32, weights: vec2<f32>, normal: vec3<f32>) -> vec3<f32> {
    let material_ix = triangles[triangle_ix].material;
    let slot = materials[material_ix].normal_texture;
    let scale = materials[material_ix].normal_scale;
    let packed = triangle_shading[triangle_ix].tangents;
    let along = interpolate_vec3(
        unpack_direction(packed.x),
        unpack_direction(packed.y),
        unpack_direction(packed.z),
        weights,
    );
    let tangent = safe_normalize(along - normal * dot(along, normal), vec3<f32>(0.0));
    let side = select(1.0, -1.0, (triangle_shading[triangle_ix].flags & SHADING_MIRRORED) != 0u);
    let bitangent = cross(normal, tangent) * side;
    let texel = sample_linear(slot, texture_uv(triangle_ix, slot, weights), 0u).xyz * 2.0 - 1.0;
    let local = vec3<f32>(texel.xy * scale, texel.z);
    return safe_normalize(tangent * local.x + bitangent * local.y + normal * local.z, normal);
}
