// SPDX-License-Identifier: MIT OR Apache-2.0
//! Material libraries.

use std::collections::HashMap;
use std::fmt::Write;
use std::path::Path;

use glam::{Affine2, Vec2, Vec3};

use super::front::{keyword, lines};
use crate::scene::error::{ErrorKind, ImageError, Warning, Warnings, short};
use crate::scene::image::{decode, white};
use crate::scene::limits::{Budget, LoadLimits};
use crate::scene::resource::read_beside;
use crate::scene::{AlphaMode, Filter, Image, Material, Scene, Texture, TextureRef, Wrap};

/// Materials by name; the last of a name counts.
#[derive(Default)]
pub(super) struct Library {
    pub materials: Vec<tobj::Material>,
    pub by_name: HashMap<String, usize>,
}

/// Reads one library. What cannot be read gives a warning.
pub(super) fn read(
    library: &mut Library,
    name: &str,
    folder: Option<&Path>,
    limits: &LoadLimits,
    budget: &mut Budget,
    warnings: &mut Warnings,
) {
    let at = format!("mtllib {}", short(name));
    let loaded = read_beside(name, folder, budget)
        .map_err(ErrorKind::from)
        .and_then(|bytes| check(&bytes, &at, limits, budget, warnings))
        .and_then(|text| tobj::load_mtl_buf(&mut text.as_bytes()).map_err(ErrorKind::Obj));
    match loaded {
        Ok((materials, _)) => {
            for material in materials {
                library
                    .by_name
                    .insert(material.name.clone(), library.materials.len());
                library.materials.push(material);
            }
        }
        Err(problem) => warnings.push(Warning::Materials {
            at,
            problem: format!("{problem}; left out"),
        }),
    }
}

/// Writes anew, plainly, what is used; the parser panics on colours of one or two numbers.
fn check(
    bytes: &[u8],
    at: &str,
    limits: &LoadLimits,
    budget: &mut Budget,
    warnings: &mut Warnings,
) -> Result<String, ErrorKind> {
    let mut text = String::new();
    let mut bump_line = None;
    for line in lines(bytes, limits) {
        let line = line?;
        let (word, rest) = keyword(&line.text);
        let before = text.len();
        let written = match word {
            "newmtl" if !rest.is_empty() => writeln!(text, "newmtl {rest}").ok(),
            "Kd" | "Ke" | "Ks" => {
                color(rest).and_then(|[r, g, b]| writeln!(text, "{word} {r} {g} {b}").ok())
            }
            "Ns" | "d" | "Tr" | "Pr" | "Pm" => {
                number(rest).and_then(|value| writeln!(text, "{word} {value}").ok())
            }
            "map_Kd" | "map_Ke" | "map_d" | "norm" if !rest.is_empty() => {
                writeln!(text, "{word} {rest}").ok()
            }
            "newmtl" | "map_Kd" | "map_Ke" | "map_d" | "norm" => None,
            "bump" | "map_bump" | "map_Bump" => {
                bump_line.get_or_insert(line.number);
                Some(())
            }
            _ => Some(()),
        };
        if written.is_none() {
            warnings.push(Warning::Materials {
                at: format!("{at}, line {}", line.number),
                problem: format!("`{word}` without usable values, skipped"),
            });
        }
        // The parser keeps about the text once more, and a structure per material.
        budget.take((text.len() - before) as u64 * 8 + 64, 1, at)?;
    }
    if let Some(line) = bump_line {
        warnings.push(Warning::Ignored {
            at: format!("{at}, line {line}"),
            what: "bump (a height map, unlike the normal map of `norm`) is".to_owned(),
        });
    }
    Ok(text)
}

fn number(rest: &str) -> Option<f32> {
    // Some exporters write `d -halo 1.0`.
    let word = rest.split_ascii_whitespace().rfind(|w| !w.starts_with('#'));
    word?.parse().ok().filter(|v: &f32| v.is_finite())
}

/// `r g b`, or `r` for all three. Spectral files and XYZ are not read.
fn color(rest: &str) -> Option<[f32; 3]> {
    let mut values = rest
        .split_ascii_whitespace()
        .map_while(|word| word.parse().ok().filter(|v: &f32| v.is_finite()));
    let r = values.next()?;
    match (values.next(), values.next()) {
        (Some(g), Some(b)) => Some([r, g, b]),
        (None, _) => Some([r; 3]),
        _ => None,
    }
}

/// Makes scene materials, textures and images of what meshes use.
pub(super) struct Maker<'a> {
    pub folder: Option<&'a Path>,
    pub limits: &'a LoadLimits,
    /// By the value of `map_…`; the flag says that white stands in.
    images: HashMap<String, (usize, bool)>,
}

impl<'a> Maker<'a> {
    pub fn new(folder: Option<&'a Path>, limits: &'a LoadLimits) -> Self {
        Self {
            folder,
            limits,
            images: HashMap::new(),
        }
    }

    /// * base colour `Kd` and `map_Kd`; alpha `d` (or 1 − `Tr`) and `map_d`, both as masks;
    /// * emission `Ke` and `map_Ke`, as radiance;
    /// * roughness `Pr`, else `(2 / (Ns + 2))^¼` (the GGX lobe about as wide as Blinn's with
    ///   exponent `Ns`: α² = 2 / (Ns + 2)); 1 without `Ns` or where `Ks` is black;
    /// * metallic `Pm`, else 0; normals `norm`.
    pub fn material(
        &mut self,
        source: &tobj::Material,
        scene: &mut Scene,
        budget: &mut Budget,
        warnings: &mut Warnings,
    ) -> Material {
        let name = short(&source.name);
        let at = format!("material {name}");
        let param = |key: &str| source.unknown_param.get(key).map(String::as_str);
        let number = |key| param(key).and_then(|v| v.parse::<f32>().ok());
        let mut ranged = |value: f32, range: std::ops::RangeInclusive<f32>, what: &str| {
            let used = value.clamp(*range.start(), *range.end());
            if used != value {
                warnings.push(Warning::Value {
                    at: at.clone(),
                    problem: format!("{what} is {value}, read as {used}"),
                });
            }
            used
        };

        let kd = source.diffuse.unwrap_or([1.0; 3]);
        let kd = Vec3::from_array(kd.map(|c| ranged(c, 0.0..=1.0, "Kd")));
        let ke = source.emissive.unwrap_or([0.0; 3]);
        let emission = Vec3::from_array(ke.map(|c| ranged(c, 0.0..=f32::MAX, "Ke")));
        let opacity = source.dissolve.or(number("Tr").map(|tr| 1.0 - tr));
        let opacity = ranged(opacity.unwrap_or(1.0), 0.0..=1.0, "d");
        let has_gloss = source.specular != Some([0.0; 3]);
        let ns = source.shininess.filter(|_| has_gloss).unwrap_or(0.0);
        let ns = ranged(ns, 0.0..=f32::MAX, "Ns");
        let roughness = match number("Pr") {
            Some(roughness) => ranged(roughness, 0.0..=1.0, "Pr"),
            None => (2.0 / (ns + 2.0)).sqrt().sqrt(),
        };
        let metallic = ranged(number("Pm").unwrap_or(0.0), 0.0..=1.0, "Pm");
        if opacity < 1.0 {
            warnings.push(Warning::Value {
                at: at.clone(),
                problem: format!("d is {opacity}: read as a mask with cutoff 0.5"),
            });
        }
        if kd == Vec3::ZERO && source.diffuse_texture.is_some() {
            warnings.push(Warning::Value {
                at: at.clone(),
                problem: "Kd is black, so that map_Kd does not show".to_owned(),
            });
        }

        let mut made = Material {
            name,
            base_color: kd.extend(opacity),
            metallic,
            roughness,
            emission,
            alpha: if opacity < 1.0 || source.dissolve_texture.is_some() {
                AlphaMode::Mask { cutoff: 0.5 }
            } else {
                AlphaMode::Opaque
            },
            ..Material::default()
        };
        let mut texture = |value: &str| self.texture(value, scene, budget, warnings);
        made.base_color_texture = source.diffuse_texture.as_deref().map(|v| texture(v).0);
        made.emission_texture = param("map_Ke").map(|v| texture(v).0);
        made.normal_texture = param("norm")
            .map(&mut texture)
            // White is no normal.
            .filter(|(_, is_stand_in)| !is_stand_in)
            .map(|(texture, _)| texture);
        if let Some(mask) = &source.dissolve_texture {
            let (mask, is_stand_in) = texture(mask);
            if !is_stand_in {
                let base = made.base_color_texture.take();
                made.base_color_texture = masked(base, mask, scene, budget, warnings, &at);
            }
        }
        made
    }

    fn texture(
        &mut self,
        value: &str,
        scene: &mut Scene,
        budget: &mut Budget,
        warnings: &mut Warnings,
    ) -> (TextureRef, bool) {
        let map = parse_map(value);
        let (image, is_stand_in) = match self.images.get(map.file) {
            Some(&known) => known,
            None => {
                let name = short(map.file);
                let decoded = read_beside(map.file, self.folder, budget)
                    .map_err(ImageError::from)
                    .and_then(|bytes| decode(name.clone(), &bytes, self.limits, budget));
                let (image, is_stand_in) = match decoded {
                    Ok(image) => (image, false),
                    Err(source) => {
                        warnings.push(Warning::Image {
                            image: name.clone(),
                            source,
                        });
                        (white(name), true)
                    }
                };
                let new = (scene.images.len(), is_stand_in);
                scene.images.push(image);
                self.images.insert(map.file.to_owned(), new);
                new
            }
        };
        scene.textures.push(Texture {
            image,
            wrap_u: map.wrap,
            wrap_v: map.wrap,
            filter: Filter::Linear,
        });
        let made = TextureRef {
            texture: scene.textures.len() - 1,
            uv_set: 0,
            uv_from_mesh: map.uv_from_mesh,
        };
        (made, is_stand_in)
    }
}

/// The value of a `map_…` line.
struct Map<'a> {
    file: &'a str,
    wrap: Wrap,
    uv_from_mesh: Affine2,
}

/// Splits options from the file's name, which may have blanks in it.
fn parse_map(value: &str) -> Map<'_> {
    let mut wrap = Wrap::Repeat;
    let (mut scale, mut offset) = (Vec2::ONE, Vec2::ZERO);
    let mut rest = value.trim();
    while rest.starts_with('-') {
        let (option, after) = keyword(rest);
        let most = match option {
            "-s" | "-o" | "-t" => 3,
            "-mm" => 2,
            "-blendu" | "-blendv" | "-clamp" | "-cc" | "-bm" | "-boost" | "-texres"
            | "-imfchan" | "-type" => 1,
            _ => break,
        };
        let takes_numbers = matches!(option, "-s" | "-o" | "-t" | "-mm");
        let mut args = Vec::new();
        rest = after;
        while args.len() < most {
            let (word, after) = keyword(rest);
            let number = word.parse::<f32>().ok().filter(|v| v.is_finite());
            // `-s 2 file.png` has one number of three.
            if word.is_empty() || (takes_numbers && number.is_none()) {
                break;
            }
            if option == "-clamp" && word == "on" {
                wrap = Wrap::Clamp;
            }
            args.push(number.unwrap_or(0.0));
            rest = after;
        }
        let pair = |default: Vec2| {
            Vec2::new(
                args.first().copied().unwrap_or(default.x),
                args.get(1).copied().unwrap_or(default.y),
            )
        };
        match option {
            "-s" => scale = pair(scale),
            "-o" => offset = pair(offset),
            _ => {}
        }
    }
    // In OBJ v points up; the mesh's v is already turned: 1 − (s·(1 − v) + o) = s·v + 1 − s − o.
    let offset = Vec2::new(offset.x, 1.0 - scale.y - offset.y);
    let uv_from_mesh = Affine2::from_scale_angle_translation(scale, 0.0, offset);
    Map {
        file: rest,
        wrap,
        uv_from_mesh: if uv_from_mesh.is_finite() {
            uv_from_mesh
        } else {
            Affine2::IDENTITY
        },
    }
}

/// The base colour's image with the mask's alpha (or brightness, where it has no alpha).
fn masked(
    base: Option<TextureRef>,
    mask: TextureRef,
    scene: &mut Scene,
    budget: &mut Budget,
    warnings: &mut Warnings,
    at: &str,
) -> Option<TextureRef> {
    let mask_image_ix = scene.textures[mask.texture].image;
    let base_image_ix = base.as_ref().map(|b| scene.textures[b.texture].image);
    let mask_image = &scene.images[mask_image_ix];
    let has_alpha = mask_image.rgba.iter().any(|p| p[3] != 255);
    if base_image_ix == Some(mask_image_ix) {
        // Its own brightness would be no mask.
        return base;
    }
    let mut pixels = match base_image_ix {
        Some(ix) => (scene.images[ix].width, scene.images[ix].height),
        None => (mask_image.width, mask_image.height),
    };
    // The finer of both grids, so that a small colour does not coarsen the mask.
    if mask_image.width > pixels.0 && mask_image.height > pixels.1 {
        pixels = (mask_image.width, mask_image.height);
    }
    let (width, height) = pixels;
    let n_pixels = u64::from(width) * u64::from(height);
    if let Err(problem) = budget.take(n_pixels, 4, "map_d") {
        warnings.push(Warning::Materials {
            at: at.to_owned(),
            problem: format!("map_d: {problem}; left out"),
        });
        return base;
    }
    let nearest = |image: &Image, x: u32, y: u32| {
        let at = |i: u32, of: u32, n: u32| u64::from(i) * u64::from(of) / u64::from(n);
        let ix = at(y, image.height, height) * u64::from(image.width) + at(x, image.width, width);
        image.rgba[ix as usize]
    };
    let mut rgba = Vec::with_capacity(n_pixels as usize);
    for y in 0..height {
        for x in 0..width {
            let [r, g, b, _] =
                base_image_ix.map_or([255; 4], |ix| nearest(&scene.images[ix], x, y));
            let texel = nearest(mask_image, x, y);
            rgba.push([r, g, b, if has_alpha { texel[3] } else { texel[0] }]);
        }
    }
    let name = format!("{at}: map_Kd with map_d");
    let texture = base.as_ref().map_or(mask.texture, |b| b.texture);
    let combined = Texture {
        image: scene.images.len(),
        ..scene.textures[texture].clone()
    };
    scene.images.push(Image {
        name,
        width,
        height,
        rgba,
    });
    scene.textures.push(combined);
    Some(TextureRef {
        texture: scene.textures.len() - 1,
        ..base.unwrap_or(mask)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn map_options() {
        let map = parse_map("-clamp on -s 2 4 1 -o 0.5 0.25 -bm 0.3 my picture.png");
        assert_eq!(map.file, "my picture.png");
        assert_eq!(map.wrap, Wrap::Clamp);
        // OBJ's (0.25, 0.5) → (2·0.25 + 0.5, 4·0.5 + 0.25) = (1, 2.25); turned: v = 1 − 2.25.
        let uv = map
            .uv_from_mesh
            .transform_point2(Vec2::new(0.25, 1.0 - 0.5));
        assert!((uv - Vec2::new(1.0, -1.25)).length() < 1e-6, "{uv}");

        let map = parse_map("-s 3 picture.png");
        assert_eq!(map.file, "picture.png");
        let plain = parse_map("a.png");
        assert_eq!(plain.uv_from_mesh, Affine2::IDENTITY);
    }
}
