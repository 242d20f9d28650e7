// SPDX-License-Identifier: MIT OR Apache-2.0
//! Scenes on the host: meshes, instances, materials, textures, lights, cameras, sky.
//!
//! A [`Scene`] is plain data in world units (metres, right-handed, +Y up, linear Rec. 709). Read it from a file with
//! [`Scene::load`] or build it yourself, and upload it with [`crate::gpu_scene::GpuScene`].

// What only one of the formats needs is unused if that format is off.
#[cfg(any(feature = "gltf", feature = "obj"))]
#[cfg_attr(not(all(feature = "gltf", feature = "obj")), allow(dead_code))]
mod clean;
mod error;
#[cfg(feature = "bake")]
mod fingerprint;
#[cfg(feature = "gltf")]
mod gltf;
#[cfg(any(feature = "gltf", feature = "obj"))]
mod image;
#[cfg_attr(not(all(feature = "gltf", feature = "obj")), allow(dead_code))]
mod limits;
mod load;
#[cfg(feature = "obj")]
mod obj;
mod place;
#[cfg(any(feature = "gltf", feature = "obj"))]
#[cfg_attr(not(all(feature = "gltf", feature = "obj")), allow(dead_code))]
mod rebase;
#[cfg(any(feature = "gltf", feature = "obj"))]
#[cfg_attr(not(all(feature = "gltf", feature = "obj")), allow(dead_code))]
mod resource;
mod sky_parts;
mod validate;

use glam::{Affine2, Affine3A, DVec3, Mat4, Vec2, Vec3, Vec4};

pub use self::error::{
    Attribute, DataProblem, DropReason, ErrorKind, ImageError, LineProblem, ResourceError,
    SceneError, Warning,
};
#[cfg(feature = "bake")]
pub use self::fingerprint::SceneFingerprint;
pub use self::limits::LoadLimits;
pub use self::load::Loaded;
pub use self::sky_parts::{N_SKY_PARTS, sky_part, sky_part_weights};
pub use self::validate::InvalidScene;
#[cfg(feature = "gpu")]
pub(crate) use self::validate::check_sky;

/// The largest coordinate of a loaded scene \[m\], in object and in world space. Up to this, squares of cross products
/// stay finite in 32-bit floats.
pub const MAX_COORDINATE: f32 = 1e9;

/// Everything that affects the light.
#[derive(Clone, Debug, Default)]
pub struct Scene {
    /// Position of this scene's (0, 0, 0) in the file's world \[m\]. It is not zero if the scene is so far from the
    /// file's origin that 32-bit floats would be too coarse. All coordinates below are relative to it.
    pub origin: DVec3,
    /// Triangle meshes in object space, one per material.
    pub meshes: Vec<Mesh>,
    /// The placement of the meshes.
    pub instances: Vec<Instance>,
    /// What the meshes are made of; [`Mesh::material`] indexes it.
    pub materials: Vec<Material>,
    /// Images with their samplers; [`TextureRef::texture`] indexes it.
    pub textures: Vec<Texture>,
    /// Pixels; [`Texture::image`] indexes it.
    pub images: Vec<Image>,
    /// Point, spot and directional lights, in world space.
    pub lights: Vec<Light>,
    /// Cameras, in world space, in the order of the file.
    pub cameras: Vec<Camera>,
    /// What a ray sees if it hits no surface.
    pub sky: Sky,
}

/// A triangle mesh with one material. Attribute arrays are empty or as long as `positions`.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    /// Name for messages: the glTF mesh and primitive, or the OBJ object.
    pub name: String,
    /// Object space, metres.
    pub positions: Vec<Vec3>,
    /// Object space, unit length; empty: the mesh is flat-shaded.
    pub normals: Vec<Vec3>,
    /// Object space, unit length; `w` is the bitangent's sign (`cross(n, t) * w`). Empty: the mesh has none.
    pub tangents: Vec<Vec4>,
    /// Texture coordinates, set 0 (glTF convention: (0, 0) is the image's top left).
    pub uv0: Vec<Vec2>,
    /// Texture coordinates, set 1.
    pub uv1: Vec<Vec2>,
    /// Linear RGBA factors of the base colour.
    pub colors: Vec<Vec4>,
    /// Three vertex indices per triangle, each below `positions.len()`.
    pub triangles: Vec<[u32; 3]>,
    /// Index into [`Scene::materials`].
    pub material: usize,
}

/// A mesh placed in the world. Negative and non-uniform scales are allowed.
#[derive(Clone, Debug)]
pub struct Instance {
    /// Index into [`Scene::meshes`].
    pub mesh: usize,
    /// Maps object space to world space.
    pub world_from_object: Affine3A,
}

/// A glTF 2.0 metallic-roughness material.
#[derive(Clone, Debug)]
pub struct Material {
    /// Name for messages.
    pub name: String,
    /// Linear RGB reflectance and alpha, each in 0..=1.
    pub base_color: Vec4,
    /// sRGB-encoded RGB with linear alpha; multiplies `base_color`.
    pub base_color_texture: Option<TextureRef>,
    /// 0 dielectric ..= 1 metal.
    pub metallic: f32,
    /// Perceptual roughness, 0..=1 (GGX α is its square).
    pub roughness: f32,
    /// Linear; roughness in G, metallic in B; multiplies both.
    pub metallic_roughness_texture: Option<TextureRef>,
    /// Linear tangent-space normals, `2·texel − 1`.
    pub normal_texture: Option<TextureRef>,
    /// Scale of the normal map's x and y.
    pub normal_scale: f32,
    /// Emitted radiance \[W·sr⁻¹·m⁻²\], including the strength; not clamped to 1.
    pub emission: Vec3,
    /// sRGB-encoded; multiplies `emission`.
    pub emission_texture: Option<TextureRef>,
    /// How alpha is used.
    pub alpha: AlphaMode,
    /// Whether both sides emit light. (Both always reflect it.)
    pub double_sided: bool,
}

/// How alpha is read.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum AlphaMode {
    /// Alpha is ignored.
    #[default]
    Opaque,
    /// The surface is absent where alpha is below the cutoff.
    Mask {
        /// Compared with `base_color.a · texture.a · vertex.a`.
        cutoff: f32,
    },
}

/// A texture as a material uses it.
#[derive(Clone, Debug, PartialEq)]
pub struct TextureRef {
    /// Index into [`Scene::textures`].
    pub texture: usize,
    /// Which of the mesh's texture coordinates: 0 or 1.
    pub uv_set: u32,
    /// `KHR_texture_transform`: maps the mesh's coordinates to the image's.
    pub uv_from_mesh: Affine2,
}

/// An image with its sampler.
#[derive(Clone, Debug)]
pub struct Texture {
    /// Index into [`Scene::images`].
    pub image: usize,
    /// Horizontal wrap mode.
    pub wrap_u: Wrap,
    /// Vertical wrap mode.
    pub wrap_v: Wrap,
    /// Whether magnification interpolates (`LINEAR`) or not (`NEAREST`).
    pub filter: Filter,
}

/// What a texture coordinate outside 0..1 reads.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Wrap {
    /// The image again.
    #[default]
    Repeat,
    /// The image again, mirrored every other time.
    Mirror,
    /// The edge texel.
    Clamp,
}

/// Magnification filter.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Filter {
    /// Bilinear.
    #[default]
    Linear,
    /// Nearest texel.
    Nearest,
}

/// 8-bit RGBA pixels as stored in the file (not decoded from sRGB), row by row from the top.
#[derive(Clone, Debug)]
pub struct Image {
    /// Name for messages.
    pub name: String,
    /// Pixels per row, at least 1.
    pub width: u32,
    /// Rows, at least 1.
    pub height: u32,
    /// `width · height` texels.
    pub rgba: Vec<[u8; 4]>,
}

/// A light without extent, in world space.
#[derive(Clone, Debug, PartialEq)]
pub enum Light {
    /// Emits equally in all directions.
    Point {
        /// Metres.
        position: Vec3,
        /// Radiant intensity \[W·sr⁻¹\].
        intensity: Vec3,
        /// glTF's range \[m\], at which the light's window function reaches 0.
        range: Option<f32>,
    },
    /// Emits into a cone, with `KHR_lights_punctual`'s falloff.
    Spot {
        /// Metres.
        position: Vec3,
        /// Unit vector along which light travels.
        direction: Vec3,
        /// Radiant intensity on the axis \[W·sr⁻¹\].
        intensity: Vec3,
        /// Half angle up to which intensity is full \[rad\], `0 ≤ inner < outer`.
        inner: f32,
        /// Half angle from which it is zero \[rad\], `≤ π/2`.
        outer: f32,
        /// glTF's range \[m\].
        range: Option<f32>,
    },
    /// Is infinitely far away.
    Directional {
        /// Unit vector along which light travels.
        direction: Vec3,
        /// Irradiance on a surface that faces the light \[W·m⁻²\].
        irradiance: Vec3,
    },
}

/// A camera in world space.
#[derive(Clone, Debug, PartialEq)]
pub struct Camera {
    /// Name, for `--camera NAME`.
    pub name: String,
    /// Metres.
    pub position: Vec3,
    /// Unit vector of the view direction.
    pub forward: Vec3,
    /// Unit vector, orthogonal to `forward`: up in the picture.
    pub up: Vec3,
    /// How directions map to pixels.
    pub projection: Projection,
}

impl Camera {
    /// From the matrix that maps camera space (+X right, +Y up, looking along −Z) to the world. Its scale has no
    /// effect.
    pub fn from_matrix(world_from_camera: Mat4, projection: Projection) -> Self {
        let forward = (-world_from_camera.z_axis.truncate()).normalize_or(Vec3::NEG_Z);
        let up = world_from_camera.y_axis.truncate().reject_from_normalized(forward);
        Self {
            name: String::new(),
            position: world_from_camera.w_axis.truncate(),
            forward,
            up: up.normalize_or(forward.any_orthonormal_vector()),
            projection,
        }
    }
}

/// A camera's projection.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Projection {
    /// Pinhole.
    Perspective {
        /// Vertical field of view \[rad\], 0 < fov < π.
        vertical_fov: f32,
    },
    /// Parallel rays.
    Orthographic {
        /// Half the height of the view \[m\].
        half_height: f32,
    },
}

/// Radiance from infinitely far away.
#[derive(Clone, Debug)]
pub enum Sky {
    /// The same radiance \[W·sr⁻¹·m⁻²\] from all directions; zero is black.
    Constant(Vec3),
    /// An equirectangular picture: top row +Y; u = 0 is −Z, 0.25 +X, 0.5 +Z, 0.75 −X.
    Image {
        /// Pixels per row, at least 1.
        width: u32,
        /// Rows, at least 1.
        height: u32,
        /// Radiance, row by row from the top; finite and not negative.
        rgb: Vec<Vec3>,
    },
}

impl Default for Sky {
    fn default() -> Self {
        Self::Constant(Vec3::ZERO)
    }
}

impl Default for Material {
    /// A white, rough dielectric. (glTF's own default is metallic; the glTF loader sets it explicitly.)
    fn default() -> Self {
        Self {
            name: String::from("default"),
            base_color: Vec4::ONE,
            base_color_texture: None,
            metallic: 0.0,
            roughness: 1.0,
            metallic_roughness_texture: None,
            normal_texture: None,
            normal_scale: 1.0,
            emission: Vec3::ZERO,
            emission_texture: None,
            alpha: AlphaMode::Opaque,
            double_sided: false,
        }
    }
}
