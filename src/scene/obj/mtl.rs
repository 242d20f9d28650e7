// SPDX-License-Identifier: MIT OR Apache-2.0
//! Material libraries.

use std::collections::HashMap;
use std::fmt::Write;
use std::path::Path;
use std::rc::Rc;

use glam::{Affine2, Vec2, Vec3};

use super::front::{self, Passed, as_utf8, keyword, lines};
use super::names;
use crate::scene::clean::dark;
use crate::scene::error::{
    ErrorKind, ImageError, LineProblem, ResourceError, Warning, Warnings, short,
};
use crate::scene::image::{decode, white};
use crate::scene::limits::{Budget, LoadLimits};
use crate::scene::resource::{self, Files};
use crate::scene::{AlphaMode, Filter, Image, Material, Scene, Texture, TextureRef, Wrap};

/// Materials by name; the last one of a name counts.
#[derive(Default)]
pub(super) struct Library {
    pub materials: Vec<Source>,
    by_name: HashMap<String, usize>,
    /// By the part before a `#`, which may start a comment or be part of the name.
    by_part: HashMap<String, usize>,
}

/// A material of a library.
pub(super) struct Source {
    material: tobj::Material,
    /// The library's folder, relative to the scene's.
    folder: Rc<Path>,
}

impl Library {
    /// The material that the text of a `usemtl` names.
    pub fn find(&self, name: &str) -> Option<usize> {
        let before = names::before_comment(name);
        let whole = self.by_name.get(name).or_else(|| self.by_name.get(before));
        whole.or_else(|| self.by_part.get(before)).copied()
    }

    fn add(&mut self, mut material: tobj::Material, folder: &Rc<Path>) {
        let new = self.materials.len();
        let before = names::before_comment(&material.name);
        if before != material.name {
            self.by_part.insert(before.to_owned(), new);
        }
        let shown = names::material_name(&material.name).to_owned();
        self.by_name.insert(std::mem::replace(&mut material.name, shown), new);
        self.materials.push(Source { material, folder: Rc::clone(folder) });
    }
}

/// Reads one library. Parts that cannot be read give warnings.
pub(super) fn read(
    library: &mut Library,
    name: &str,
    files: &mut Files,
    limits: &LoadLimits,
    budget: &mut Budget,
    warnings: &mut Warnings,
) {
    let at = format!("mtllib {}", short(name));
    let mut load = || {
        let found = files.find(name, Path::new(""))?;
        let bytes = resource::read(&found, name, &at, budget, warnings)?;
        let text = check(&bytes, &at, limits, budget, warnings)?;
        let (materials, _) = tobj::load_mtl_buf(&mut text.as_bytes()).map_err(ErrorKind::Obj)?;
        Ok::<_, ErrorKind>((materials, Rc::from(found.folder)))
    };
    match load() {
        Ok((materials, folder)) => {
            for material in materials {
                library.add(material, &folder);
            }
        }
        Err(problem) => {
            warnings.push(Warning::Materials { at, problem: format!("{problem}; left out") })
        }
    }
}

/// What the loader does with a keyword.
#[derive(Clone, Copy, PartialEq)]
enum Use {
    Name,
    Color,
    Number,
    Map,
    /// A height map, unlike the normal map of `norm`.
    Bump,
    /// Has no effect here, with any value.
    Harmless,
    /// Not supported, but without effect if all of its numbers are this one.
    Unless(f32),
    /// Not supported.
    Never,
}

/// Keywords in their usual spelling; they are found in upper or lower case.
const KEYWORDS: [(&str, Use); 42] = [
    ("newmtl", Use::Name),
    ("Kd", Use::Color),
    ("Ke", Use::Color),
    ("Ks", Use::Color),
    ("Ns", Use::Number),
    ("d", Use::Number),
    ("Tr", Use::Number),
    ("Pr", Use::Number),
    ("Pm", Use::Number),
    ("map_Kd", Use::Map),
    ("map_Ke", Use::Map),
    ("map_d", Use::Map),
    ("norm", Use::Map),
    ("bump", Use::Bump),
    ("map_bump", Use::Bump),
    // Ambient light approximates what is computed here.
    ("Ka", Use::Harmless),
    ("map_Ka", Use::Harmless),
    // Shading models and index of refraction: a surface here is a rough dielectric or a metal.
    ("illum", Use::Harmless),
    ("Ni", Use::Harmless),
    ("sharpness", Use::Harmless),
    ("map_aat", Use::Harmless),
    ("Tf", Use::Unless(1.0)),
    ("Ps", Use::Unless(0.0)),
    ("Pc", Use::Unless(0.0)),
    ("Pcr", Use::Unless(0.0)),
    ("aniso", Use::Unless(0.0)),
    ("anisor", Use::Unless(0.0)),
    ("map_Ks", Use::Never),
    ("map_Ns", Use::Never),
    ("map_Tr", Use::Never),
    ("map_Pr", Use::Never),
    ("map_Pm", Use::Never),
    ("map_Ps", Use::Never),
    ("map_Pc", Use::Never),
    ("map_Pcr", Use::Never),
    ("map_aniso", Use::Never),
    ("map_anisor", Use::Never),
    ("map_RMA", Use::Never),
    ("map_ORM", Use::Never),
    ("refl", Use::Never),
    ("disp", Use::Never),
    ("decal", Use::Never),
];

/// Rewrites what is used in a simple form; the parser panics on colours of one or two numbers.
fn check(
    bytes: &[u8],
    at: &str,
    limits: &LoadLimits,
    budget: &mut Budget,
    warnings: &mut Warnings,
) -> Result<String, ErrorKind> {
    let bytes = &*as_utf8(bytes, at, budget, warnings)?;
    let mut text = String::new();
    let mut bump_line = None;
    let mut comma_line = None;
    let mut latin_1_line = None;
    // First line and number of the statements before the first material, which the parser drops.
    let mut before_first: Option<(usize, usize)> = None;
    let mut has_material = false;
    let mut passed = Passed::default();
    for line in lines(bytes, limits) {
        let line = line?;
        let (word, rest) = keyword(&line.text);
        let before = text.len();
        let known = KEYWORDS.iter().find(|(known, _)| known.eq_ignore_ascii_case(word));
        let mut has_comma = false;
        let written = match known {
            Some((word, Use::Name | Use::Map)) => {
                (!rest.is_empty()).then(|| writeln!(text, "{word} {rest}").ok()).flatten()
            }
            Some((word, Use::Color)) => color(rest, &mut has_comma)
                .and_then(|[r, g, b]| writeln!(text, "{word} {r} {g} {b}").ok()),
            Some((word, Use::Number)) => {
                number(rest, &mut has_comma).and_then(|value| writeln!(text, "{word} {value}").ok())
            }
            Some((_, Use::Bump)) => {
                bump_line.get_or_insert(line.number);
                Some(())
            }
            Some((_, Use::Harmless)) => Some(()),
            Some((word, Use::Unless(value))) => {
                if color(rest, &mut has_comma) != Some([*value; 3]) {
                    passed.add(line.number, word, true);
                }
                Some(())
            }
            Some((word, Use::Never)) => {
                passed.add(line.number, word, true);
                Some(())
            }
            None => {
                passed.add(line.number, word, false);
                Some(())
            }
        };
        if has_comma {
            comma_line.get_or_insert(line.number);
        }
        if !line.is_utf8 {
            latin_1_line.get_or_insert(line.number);
        }
        has_material |= text.len() > before && known.is_some_and(|(_, kind)| *kind == Use::Name);
        if text.len() > before && !has_material {
            before_first.get_or_insert((line.number, 0)).1 += 1;
        }
        if written.is_none() {
            warnings.push(Warning::Materials {
                at: format!("{at}, line {}", line.number),
                problem: format!("`{}` without usable values, skipped", short(word)),
            });
        }
        // The parser needs about the size of the text again, and a structure per material.
        budget.take((text.len() - before) as u64 * 8 + 64, 1, at)?;
    }
    if let Some(line) = bump_line {
        warnings.push(Warning::Ignored {
            at: format!("{at}, line {line}"),
            what: "bump (a height map, unlike the normal map of `norm`) is".to_owned(),
        });
    }
    for (line, problem) in [(comma_line, LineProblem::Comma), (latin_1_line, LineProblem::NotUtf8)]
    {
        if let Some(line) = line {
            warnings.push(Warning::Value {
                at: format!("{at}, line {line}"),
                problem: problem.to_string(),
            });
        }
    }
    if let Some((line, n)) = before_first {
        warnings.push(Warning::Materials {
            at: format!("{at}, line {line}"),
            problem: format!("{n} statement(s) before the first `newmtl`, skipped"),
        });
    }
    passed.report(&format!("{at}, "), warnings);
    Ok(text)
}

fn number(rest: &str, has_comma: &mut bool) -> Option<f32> {
    // Some exporters write `d -halo 1.0`.
    let words = rest.split_ascii_whitespace().take_while(|w| !w.starts_with('#'));
    finite(words.last()?, has_comma)
}

fn finite(word: &str, has_comma: &mut bool) -> Option<f32> {
    let (value, comma) =
        front::number(word).filter(|(value, _): &(f32, bool)| value.is_finite())?;
    *has_comma |= comma;
    Some(value)
}

/// `r g b`, or `r` for all three. Spectral files and XYZ are not read.
fn color(rest: &str, has_comma: &mut bool) -> Option<[f32; 3]> {
    let mut values = rest.split_ascii_whitespace().map_while(|word| finite(word, has_comma));
    let r = values.next()?;
    match (values.next(), values.next()) {
        (Some(g), Some(b)) => Some([r, g, b]),
        (None, _) => Some([r; 3]),
        _ => None,
    }
}

/// Makes scene materials, textures and images of what meshes use.
pub(super) struct Maker<'a> {
    files: Files<'a>,
    limits: &'a LoadLimits,
    /// By the library's folder and the name in `map_…`; the flag says that the image was replaced by white.
    images: HashMap<(Rc<Path>, String), (usize, bool)>,
}

impl<'a> Maker<'a> {
    pub fn new(files: Files<'a>, limits: &'a LoadLimits) -> Self {
        Self { files, limits, images: HashMap::new() }
    }

    /// * base colour `Kd` and `map_Kd`; alpha `d` (or 1 − `Tr`) and `map_d`, both as masks;
    /// * emission `Ke` and `map_Ke`, as radiance; `Ke` is 1 if only `map_Ke` is given;
    /// * roughness `Pr`, else `(2 / (Ns + 2))^¼` (the GGX lobe about as wide as Blinn's with
    ///   exponent `Ns`: α² = 2 / (Ns + 2)); 1 without `Ns` or where `Ks` is black;
    /// * metallic `Pm`, else 0; normals `norm`.
    pub fn material(
        &mut self,
        source: &Source,
        scene: &mut Scene,
        budget: &mut Budget,
        warnings: &mut Warnings,
    ) -> Material {
        let Source { material: source, folder } = source;
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
        let without = if param("map_Ke").is_some() { 1.0 } else { 0.0 };
        let ke = source.emissive.unwrap_or([without; 3]);
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
                problem: "Kd is black, so map_Kd has no effect".to_owned(),
            });
        }

        if emission == Vec3::ZERO && param("map_Ke").is_some() {
            warnings.push(Warning::Value {
                at: at.clone(),
                problem: "Ke is black, so map_Ke has no effect".to_owned(),
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
        let mut texture = |value: &str| self.texture(value, folder, &at, scene, budget, warnings);
        made.base_color_texture = source.diffuse_texture.as_deref().map(|v| texture(v).0);
        let emission_map = param("map_Ke").map(&mut texture);
        made.normal_texture = param("norm")
            .map(&mut texture)
            // White is not a normal.
            .filter(|(_, is_stand_in)| !is_stand_in)
            .map(|(texture, _)| texture);
        if let Some(mask) = &source.dissolve_texture {
            let (mask, is_stand_in) = texture(mask);
            if !is_stand_in {
                let base = made.base_color_texture.take();
                made.base_color_texture = masked(base, mask, scene, budget, warnings, &at);
            }
        }
        match emission_map {
            Some((_, true)) => dark(&mut made, &at, "map_Ke", warnings),
            read => made.emission_texture = read.map(|(texture, _)| texture),
        }
        made
    }

    fn texture(
        &mut self,
        value: &str,
        folder: &Rc<Path>,
        at: &str,
        scene: &mut Scene,
        budget: &mut Budget,
        warnings: &mut Warnings,
    ) -> (TextureRef, bool) {
        let map = parse_map(value);
        let key = (Rc::clone(folder), map.file.to_owned());
        let (image, is_stand_in) = match self.images.get(&key) {
            Some(&known) => known,
            None => {
                let name = short(map.file);
                let decoded = self
                    .read(map.file, folder, at, budget, warnings)
                    .map_err(ImageError::from)
                    .and_then(|bytes| decode(name.clone(), &bytes, self.limits, budget));
                let (image, is_stand_in) = match decoded {
                    Ok(image) => (image, false),
                    Err(source) => {
                        warnings.push(Warning::Image { image: name.clone(), source });
                        (white(name), true)
                    }
                };
                let new = (scene.images.len(), is_stand_in);
                scene.images.push(image);
                self.images.insert(key, new);
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

    /// Reads the file that a `map_…` names, relative to its library's folder, or else to the scene's.
    fn read(
        &mut self,
        file: &str,
        folder: &Path,
        at: &str,
        budget: &mut Budget,
        warnings: &mut Warnings,
    ) -> Result<Vec<u8>, ResourceError> {
        let mut first_problem = None;
        for base in [folder, Path::new("")] {
            for name in names::readings(file) {
                match self.files.find(name, base) {
                    Ok(found) => {
                        return resource::read(&found, name, at, budget, warnings);
                    }
                    Err(problem) => {
                        first_problem.get_or_insert(problem);
                    }
                }
            }
        }
        Err(first_problem.unwrap_or(ResourceError::Missing))
    }
}

/// The value of a `map_…` line.
struct Map<'a> {
    file: &'a str,
    wrap: Wrap,
    uv_from_mesh: Affine2,
}

/// Separates options from the file's name, which may contain blanks.
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
    // In OBJ v points up; the mesh's v is already flipped: 1 − (s·(1 − v) + o) = s·v + 1 − s − o.
    let offset = Vec2::new(offset.x, 1.0 - scale.y - offset.y);
    let uv_from_mesh = Affine2::from_scale_angle_translation(scale, 0.0, offset);
    Map {
        file: rest,
        wrap,
        uv_from_mesh: if uv_from_mesh.is_finite() { uv_from_mesh } else { Affine2::IDENTITY },
    }
}

/// The base colour's image with the mask's alpha (or brightness, if it has no alpha).
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
        // Its own brightness would not be a mask.
        return base;
    }
    let mut pixels = match base_image_ix {
        Some(ix) => (scene.images[ix].width, scene.images[ix].height),
        None => (mask_image.width, mask_image.height),
    };
    // The finer of the two resolutions, so that a small colour image does not coarsen the mask.
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
    let combined = Texture { image: scene.images.len(), ..scene.textures[texture].clone() };
    scene.images.push(Image { name, width, height, rgba });
    scene.textures.push(combined);
    Some(TextureRef { texture: scene.textures.len() - 1, ..base.unwrap_or(mask) })
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
        let uv = map.uv_from_mesh.transform_point2(Vec2::new(0.25, 1.0 - 0.5));
        assert!((uv - Vec2::new(1.0, -1.25)).length() < 1e-6, "{uv}");

        let map = parse_map("-s 3 picture.png");
        assert_eq!(map.file, "picture.png");
        let plain = parse_map("a.png");
        assert_eq!(plain.uv_from_mesh, Affine2::IDENTITY);
    }
}
