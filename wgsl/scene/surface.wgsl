// SPDX-License-Identifier: MIT OR Apache-2.0
//! Scene seam: the surface at a hit.
//!
//! Interface: `surface_at`, `filtered_surface_at`, `is_cut_away`; for the voxelizer `surface_over`.
#define_import_path lucerna::scene::surface

#import lucerna::bsdf::directional_albedo::hemispherical_albedo
#import lucerna::bsdf::metallic_roughness::metallic_roughness
#import lucerna::geometry::barycentric::{interpolate_vec2, interpolate_vec3, interpolate_vec4}
#import lucerna::texture::footprint::{footprint_of_width, texture_level}
#import lucerna::texture::normal_map::normal_of_map
#import lucerna::geometry::ray_offset::interpolation_error
#import lucerna::scene::data::{scene, triangles, triangle_shading, material_at, TextureSlot, SLOT_SECOND_UV, MATERIAL_DOUBLE_SIDED}
#import lucerna::scene::data::{SHADING_MIRRORED, SHADING_HAS_NORMALS, SHADING_HAS_COLORS}
#import lucerna::scene::textures::{sample_srgb, sample_linear, sample_srgb_between, sample_linear_between}
#import lucerna::scene::types::{Surface, SurfaceOver}
#import lucerna::math::octahedral::unpack_direction
#import lucerna::math::vector::safe_normalize

/// Linear RGBA in 0..1 of four 16-bit unorms: red and green, then blue and alpha, low halves first.
fn corner_color(packed: vec2<u32>) -> vec4<f32> {
    return vec4<f32>(unpack2x16unorm(packed.x), unpack2x16unorm(packed.y));
}

/// The footprint of a point, for which textures are read at level 0.
const NO_SPREAD: vec4<f32> = vec4<f32>(0.0);

/// Base colour and alpha: factor × texture × vertex colour. `spread`: as in [`filtered_surface_at`].
fn base_color_at(triangle_ix: u32, weights: vec2<f32>, spread: vec4<f32>) -> vec4<f32> {
    let material_ix = triangles[triangle_ix].material;
    var color = material_at(material_ix).base_color;
    if (triangle_shading[triangle_ix].flags & SHADING_HAS_COLORS) != 0u {
        color *= interpolate_vec4(
            corner_color(triangle_shading[triangle_ix].colors[0]),
            corner_color(triangle_shading[triangle_ix].colors[1]),
            corner_color(triangle_shading[triangle_ix].colors[2]),
            weights,
        );
    }
    if material_at(material_ix).base_color_texture.size.x != 0u {
        color *= srgb_at(triangle_ix, material_at(material_ix).base_color_texture, weights, spread);
    }
    return color;
}

/// The mesh's texture coordinates with which a texture is read.
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

/// Level of detail of a texture for a footprint.
fn level_of(triangle_ix: u32, slot: TextureSlot, spread: vec4<f32>) -> f32 {
    // Coordinates are linear in the weights: differences of weights give differences of coordinates.
    var corners = triangle_shading[triangle_ix].uv_first;
    if (slot.flags & SLOT_SECOND_UV) != 0u {
        corners = triangle_shading[triangle_ix].uv_second;
    }
    let along_b = corners[1] - corners[0];
    let along_c = corners[2] - corners[0];
    let right = along_b * spread.x + along_c * spread.y;
    let down = along_b * spread.z + along_c * spread.w;
    let size = vec2<f32>(slot.size);
    return texture_level(
        vec2<f32>(dot(slot.row_u.xy, right), dot(slot.row_v.xy, right)) * size,
        vec2<f32>(dot(slot.row_u.xy, down), dot(slot.row_v.xy, down)) * size,
    );
}

/// A texture's colour, decoded from sRGB, over a footprint.
fn srgb_at(triangle_ix: u32, slot: TextureSlot, weights: vec2<f32>, spread: vec4<f32>) -> vec4<f32> {
    let uv = texture_uv(triangle_ix, slot, weights);
    if all(spread == NO_SPREAD) {
        return sample_srgb(slot, uv, 0u);
    }
    return sample_srgb_between(slot, uv, level_of(triangle_ix, slot, spread));
}

/// A texture's numbers over a footprint.
fn linear_at(triangle_ix: u32, slot: TextureSlot, weights: vec2<f32>, spread: vec4<f32>) -> vec4<f32> {
    let uv = texture_uv(triangle_ix, slot, weights);
    if all(spread == NO_SPREAD) {
        return sample_linear(slot, uv, 0u);
    }
    return sample_linear_between(slot, uv, level_of(triangle_ix, slot, spread));
}

/// Metallic and perceptual roughness: factor × texture.
fn metallic_and_roughness_at(triangle_ix: u32, weights: vec2<f32>, spread: vec4<f32>) -> vec2<f32> {
    let material_ix = triangles[triangle_ix].material;
    var gloss = vec2<f32>(material_at(material_ix).metallic, material_at(material_ix).roughness);
    if material_at(material_ix).metallic_roughness_texture.size.x != 0u {
        let slot = material_at(material_ix).metallic_roughness_texture;
        gloss *= linear_at(triangle_ix, slot, weights, spread).bg;
    }
    return gloss;
}

/// Whether the material's alpha mask removes this point. `weights`: of the second and third corner.
/// Always read at level 0, so that rasterised masks and those that rays hit are the same.
fn is_cut_away(triangle_ix: u32, weights: vec2<f32>) -> bool {
    let cutoff = material_at(triangles[triangle_ix].material).alpha_cutoff;
    return cutoff >= 0.0 && base_color_at(triangle_ix, weights, NO_SPREAD).a < cutoff;
}

/// Radiance that the triangle emits at a point, out of its front face [W·sr⁻¹·m⁻²].
fn emission_at(triangle_ix: u32, weights: vec2<f32>) -> vec3<f32> {
    return filtered_emission_at(triangle_ix, weights, NO_SPREAD);
}

/// As [`emission_at`], over a footprint.
fn filtered_emission_at(triangle_ix: u32, weights: vec2<f32>, spread: vec4<f32>) -> vec3<f32> {
    let material_ix = triangles[triangle_ix].material;
    var emission = material_at(material_ix).emission;
    if material_at(material_ix).emission_texture.size.x != 0u {
        emission *= srgb_at(triangle_ix, material_at(material_ix).emission_texture, weights, spread).rgb;
    }
    return emission;
}

/// The surface at a hit. `weights`: of the triangle's second and third corner.
fn surface_at(triangle_ix: u32, weights: vec2<f32>) -> Surface {
    return filtered_surface_at(triangle_ix, weights, NO_SPREAD);
}

/// As [`surface_at`], with textures filtered over the footprint of a sample: `spread` is how much the
/// weights change to the next sample of the picture, xy to the right, zw down.
fn filtered_surface_at(triangle_ix: u32, weights: vec2<f32>, spread: vec4<f32>) -> Surface {
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
    surface.base_color = base_color_at(triangle_ix, weights, spread).rgb;
    surface.emission = filtered_emission_at(triangle_ix, weights, spread);
    surface.double_sided = (material_at(material_ix).flags & MATERIAL_DOUBLE_SIDED) != 0u;
    surface.metallic = 0.0;
    surface.roughness = 1.0;
    surface.lambert = scene.diffuse_only != 0u;
    if !surface.lambert {
        let gloss = metallic_and_roughness_at(triangle_ix, weights, spread);
        surface.metallic = gloss.x;
        surface.roughness = gloss.y;
        if material_at(material_ix).normal_texture.size.x != 0u {
            normal = mapped_normal(triangle_ix, weights, spread, normal);
        }
    }
    // A normal that points through the surface is bent back to its side.
    surface.shading_normal = select(-normal, normal, dot(normal, surface.geometric_normal) >= 0.0);
    return surface;
}

/// The normal map's normal at a point (`texture::normal_map`).
fn mapped_normal(
    triangle_ix: u32,
    weights: vec2<f32>,
    spread: vec4<f32>,
    normal: vec3<f32>,
) -> vec3<f32> {
    let material_ix = triangles[triangle_ix].material;
    let slot = material_at(material_ix).normal_texture;
    let scale = material_at(material_ix).normal_scale;
    let packed = triangle_shading[triangle_ix].tangents;
    let along = interpolate_vec3(
        unpack_direction(packed.x),
        unpack_direction(packed.y),
        unpack_direction(packed.z),
        weights,
    );
    let is_mirrored = (triangle_shading[triangle_ix].flags & SHADING_MIRRORED) != 0u;
    return normal_of_map(linear_at(triangle_ix, slot, weights, spread).xyz, scale, normal, along, is_mirrored);
}

/// The patch around a point, about `width` [m] across: textures are read from the mip of that width.
/// `weights`: of the triangle's second and third corner.
fn surface_over(triangle_ix: u32, weights: vec2<f32>, width: f32) -> SurfaceOver {
    let to_b = triangles[triangle_ix].corner_b - triangles[triangle_ix].corner_a;
    let to_c = triangles[triangle_ix].corner_c - triangles[triangle_ix].corner_a;
    let spread = footprint_of_width(to_b, to_c, width);
    let material_ix = triangles[triangle_ix].material;
    let cutoff = material_at(material_ix).alpha_cutoff;
    let color = base_color_at(triangle_ix, weights, spread);
    var albedo = color.rgb;
    if scene.diffuse_only == 0u {
        let gloss = metallic_and_roughness_at(triangle_ix, weights, spread);
        albedo = hemispherical_albedo(metallic_roughness(color.rgb, gloss.x, gloss.y));
    }
    return SurfaceOver(
        albedo,
        cutoff >= 0.0 && color.a < cutoff,
        filtered_emission_at(triangle_ix, weights, spread),
        (material_at(material_ix).flags & MATERIAL_DOUBLE_SIDED) != 0u,
    );
}
