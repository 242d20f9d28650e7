// SPDX-License-Identifier: MIT OR Apache-2.0
//! Materials, textures and images.

use glam::{Affine2, Mat2, Vec2, Vec3, Vec4};
use gltf::json::extensions::texture::TextureTransform;
use gltf::json::material::AlphaMode as GltfAlpha;
use gltf::json::texture::{Info, MagFilter, Sampler, WrappingMode};
use gltf::json::validation::Checked;

use super::{Loader, index, named};
use crate::scene::clean::dark;
use crate::scene::error::{DataProblem, ErrorKind, ImageError, Warning, short};
use crate::scene::image::{decode, white};
use crate::scene::{AlphaMode, Filter, Material, Texture, TextureRef, Wrap};

/// An image that was read, or its replacement.
#[derive(Clone, Copy)]
pub(super) struct ImageSlot {
    /// Index into the scene's images.
    image: usize,
    is_stand_in: bool,
}

impl Loader<'_> {
    /// The scene's material for a glTF material, or for none. Created once.
    pub(super) fn material(&mut self, ix: Option<usize>, at: &str) -> Result<usize, ErrorKind> {
        let Some(ix) = ix else {
            if let Some(known) = self.default_material {
                return Ok(known);
            }
            let new = self.scene.materials.len();
            self.scene.materials.push(Material { metallic: 1.0, ..Material::default() });
            self.default_material = Some(new);
            return Ok(new);
        };
        let material =
            index(&self.data.root.materials, ix, "materials", || format!("{at}.material"))?;
        if let Some(known) = self.materials[ix] {
            return Ok(known);
        }
        let at = named("materials", ix, material.name.as_deref());
        let unknown =
            |what| ErrorKind::Data { at: at.clone(), problem: DataProblem::Unknown(what) };
        let pbr = &material.pbr_metallic_roughness;
        let strength = material
            .extensions
            .as_ref()
            .and_then(|e| e.emissive_strength.as_ref())
            .map_or(1.0, |e| e.emissive_strength.0);

        let base_color = pbr.base_color_factor.0;
        let base_color = base_color.map(|c| self.ranged(c, 0.0..=1.0, 1.0, &at, "baseColorFactor"));
        let metallic = pbr.metallic_factor.0;
        let roughness = pbr.roughness_factor.0;
        let emission = material
            .emissive_factor
            .0
            .map(|c| self.ranged(c * strength, 0.0..=f32::MAX, 0.0, &at, "emission"));
        let alpha = match material.alpha_mode {
            Checked::Valid(GltfAlpha::Opaque) => AlphaMode::Opaque,
            Checked::Valid(GltfAlpha::Mask) => {
                let cutoff = material.alpha_cutoff.unwrap_or_default().0;
                AlphaMode::Mask {
                    cutoff: self.ranged(cutoff, 0.0..=f32::MAX, 0.5, &at, "alphaCutoff"),
                }
            }
            Checked::Valid(GltfAlpha::Blend) => {
                self.warnings.push(Warning::Blend { material: at.clone() });
                AlphaMode::Mask { cutoff: 0.5 }
            }
            Checked::Invalid => return Err(unknown("alphaMode")),
        };
        let info = |loader: &mut Self, info: &Option<Info>, what: &str| {
            let Some(info) = info else { return Ok(None) };
            let transform = info.extensions.as_ref().and_then(|e| e.texture_transform.clone());
            let at = format!("{at}.{what}");
            loader.texture_ref(info.index.value(), info.tex_coord, transform, &at)
        };
        let emission_map = info(self, &material.emissive_texture, "emissiveTexture")?;
        let mut made = Material {
            name: match &material.name {
                Some(name) => short(name),
                None => format!("materials[{ix}]"),
            },
            base_color: Vec4::from_array(base_color),
            base_color_texture: info(self, &pbr.base_color_texture, "baseColorTexture")?
                .map(|(t, _)| t),
            metallic: self.ranged(metallic, 0.0..=1.0, 1.0, &at, "metallicFactor"),
            roughness: self.ranged(roughness, 0.0..=1.0, 1.0, &at, "roughnessFactor"),
            metallic_roughness_texture: info(
                self,
                &pbr.metallic_roughness_texture,
                "metallicRoughnessTexture",
            )?
            .map(|(t, _)| t),
            normal_texture: self.normal_texture(material, &at)?,
            normal_scale: match &material.normal_texture {
                Some(t) => self.ranged(t.scale, f32::MIN..=f32::MAX, 1.0, &at, "scale"),
                None => 1.0,
            },
            emission: Vec3::from_array(emission),
            emission_texture: None,
            alpha,
            double_sided: material.double_sided,
        };
        match emission_map {
            Some((texture, slot)) if !slot.is_stand_in => made.emission_texture = Some(texture),
            None if material.emissive_texture.is_none() => {}
            _ => dark(&mut made, &at, "emissiveTexture", &mut self.warnings),
        }
        let new = self.scene.materials.len();
        self.scene.materials.push(made);
        self.materials[ix] = Some(new);
        Ok(new)
    }

    /// White is not a normal, so a normal map that cannot be read is left out.
    fn normal_texture(
        &mut self,
        material: &gltf::json::Material,
        at: &str,
    ) -> Result<Option<TextureRef>, ErrorKind> {
        let Some(info) = &material.normal_texture else {
            return Ok(None);
        };
        let at = format!("{at}.normalTexture");
        let transform = info
            .extensions
            .as_ref()
            .and_then(|e| e.others.get("KHR_texture_transform"))
            .map(|value| gltf::json::deserialize::from_value::<TextureTransform>(value.clone()))
            .transpose()
            .map_err(|e| ErrorKind::Json {
                message: short(&format!("{at}: KHR_texture_transform: {e}")),
            })?;
        let found = self.texture_ref(info.index.value(), info.tex_coord, transform, &at)?;
        Ok(found.filter(|(_, slot)| !slot.is_stand_in).map(|(texture, _)| texture))
    }

    /// `value`, if it is in `range`; otherwise the nearest value in it (`fallback` for NaN), with a
    /// warning.
    pub(super) fn ranged(
        &mut self,
        value: f32,
        range: std::ops::RangeInclusive<f32>,
        fallback: f32,
        at: &str,
        what: &str,
    ) -> f32 {
        if range.contains(&value) {
            return value;
        }
        let used =
            if value.is_finite() { value.clamp(*range.start(), *range.end()) } else { fallback };
        self.warnings.push(Warning::Value {
            at: at.to_owned(),
            problem: format!("{what} is {value}, read as {used}"),
        });
        used
    }

    fn texture_ref(
        &mut self,
        ix: usize,
        tex_coord: u32,
        transform: Option<TextureTransform>,
        at: &str,
    ) -> Result<Option<(TextureRef, ImageSlot)>, ErrorKind> {
        let uv_set = transform.as_ref().and_then(|t| t.tex_coord).unwrap_or(tex_coord);
        if uv_set > 1 {
            self.warnings.push(Warning::Ignored {
                at: at.to_owned(),
                what: format!("a texture that reads TEXCOORD_{uv_set} (only 0 and 1 are known) is"),
            });
            return Ok(None);
        }
        let mut uv_from_mesh = transform.map_or(Affine2::IDENTITY, |t| affine(&t));
        if !uv_from_mesh.is_finite() {
            self.warnings.push(Warning::Value {
                at: at.to_owned(),
                problem: "KHR_texture_transform is not finite, read as none".to_owned(),
            });
            uv_from_mesh = Affine2::IDENTITY;
        }
        let (texture, slot) = self.texture(ix, at)?;
        let made = TextureRef { texture, uv_set, uv_from_mesh };
        Ok(Some((made, slot)))
    }

    fn texture(&mut self, ix: usize, at: &str) -> Result<(usize, ImageSlot), ErrorKind> {
        let root = self.data.root;
        let texture = index(&root.textures, ix, "textures", || format!("{at}.index"))?;
        if let Some(known) = self.textures[ix] {
            return Ok(known);
        }
        let at = format!("textures[{ix}]");
        let sampler = match texture.sampler {
            Some(sampler) => {
                index(&root.samplers, sampler.value(), "samplers", || format!("{at}.sampler"))?
                    .clone()
            }
            None => Sampler::default(),
        };
        let wrap = |mode: &Checked<WrappingMode>| match mode {
            Checked::Valid(WrappingMode::Repeat) => Ok(Wrap::Repeat),
            Checked::Valid(WrappingMode::MirroredRepeat) => Ok(Wrap::Mirror),
            Checked::Valid(WrappingMode::ClampToEdge) => Ok(Wrap::Clamp),
            Checked::Invalid => Err(ErrorKind::Data {
                at: format!("{at}.sampler"),
                problem: DataProblem::Unknown("wrapS or wrapT"),
            }),
        };
        let filter = match sampler.mag_filter {
            Some(Checked::Valid(MagFilter::Nearest)) => Filter::Nearest,
            _ => Filter::Linear,
        };
        // The crate's value for "no source".
        let slot = if texture.source.value() == u32::MAX as usize {
            let extensions = texture.extensions.iter().flat_map(|e| e.others.keys());
            let only_by: Vec<_> = extensions.map(|name| short(name)).collect();
            let problem = if only_by.is_empty() {
                ImageError::Format
            } else {
                let only_by = short(&only_by.join(", "));
                ImageError::Data(format!(
                    "has a source only in {only_by}, which is not supported; convert it to PNG or JPEG"
                ))
            };
            self.stand_in(at.clone(), problem)
        } else {
            self.image(texture.source.value(), &at)?
        };
        let new = self.scene.textures.len();
        self.scene.textures.push(Texture {
            image: slot.image,
            wrap_u: wrap(&sampler.wrap_s)?,
            wrap_v: wrap(&sampler.wrap_t)?,
            filter,
        });
        self.textures[ix] = Some((new, slot));
        Ok((new, slot))
    }

    fn image(&mut self, ix: usize, at: &str) -> Result<ImageSlot, ErrorKind> {
        let image = index(&self.data.root.images, ix, "images", || format!("{at}.source"))?;
        if let Some(known) = self.images[ix] {
            return Ok(known);
        }
        let what = image.name.as_deref().or(image.uri.as_deref());
        let name = named("images", ix, what.filter(|s| !s.starts_with("data:")));
        let decoded = match (&image.uri, image.buffer_view) {
            (Some(uri), _) => self
                .files
                .read_uri(uri, &name, &mut self.budget, &mut self.warnings)
                .map_err(ImageError::from)
                .and_then(|bytes| decode(name.clone(), &bytes, self.limits, &mut self.budget)),
            (None, Some(view)) => {
                self.data.view(view).map_err(|e| ImageError::Data(e.to_string())).and_then(
                    |(bytes, ..)| decode(name.clone(), bytes, self.limits, &mut self.budget),
                )
            }
            (None, None) => Err(ImageError::Data("has neither bufferView nor uri".to_owned())),
        };
        let slot = match decoded {
            Ok(image) => {
                let new = self.scene.images.len();
                self.scene.images.push(image);
                ImageSlot { image: new, is_stand_in: false }
            }
            Err(source) => self.stand_in(name, source),
        };
        self.images[ix] = Some(slot);
        Ok(slot)
    }

    fn stand_in(&mut self, name: String, source: ImageError) -> ImageSlot {
        let new = self.scene.images.len();
        self.scene.images.push(white(name.clone()));
        self.warnings.push(Warning::Image { image: name, source });
        ImageSlot { image: new, is_stand_in: true }
    }
}

/// `translation · rotation · scale`. The extension's rotation is counter-clockwise when you look at
/// the image, where v points down: (1, 0) turns towards −v.
fn affine(transform: &TextureTransform) -> Affine2 {
    let (sin, cos) = transform.rotation.0.sin_cos();
    let rotation = Mat2::from_cols(Vec2::new(cos, -sin), Vec2::new(sin, cos));
    let scale = Mat2::from_diagonal(Vec2::from_array(transform.scale.0));
    Affine2::from_mat2_translation(rotation * scale, Vec2::from_array(transform.offset.0))
}
