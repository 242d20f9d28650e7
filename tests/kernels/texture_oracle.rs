// SPDX-License-Identifier: MIT OR Apache-2.0
//! What a material's texture holds at a point, in f64.

use glam::{DVec2, DVec4, Vec2};
use lucerna::picture::srgb::linear_from_encoded;
use lucerna::scene::{Filter, Image, Scene, Texture, TextureRef, Wrap};

/// A texture's value, and how near the point is to where a nearest-texel filter jumps.
pub struct Texel {
    /// RGB decoded from sRGB if asked for, alpha as stored.
    pub value: DVec4,
    /// Distance to the next edge between texels [texels].
    pub to_edge: f64,
}

/// glTF 2.0 §3.8.4: wrap modes of OpenGL ES, texel centres at half-integers.
pub fn sample(scene: &Scene, reference: &TextureRef, uv: Vec2, is_srgb: bool) -> Texel {
    let texture = &scene.textures[reference.texture];
    let image = &scene.images[texture.image];
    let m = reference.uv_from_mesh;
    let uv = m.matrix2.x_axis.as_dvec2() * f64::from(uv.x)
        + m.matrix2.y_axis.as_dvec2() * f64::from(uv.y)
        + m.translation.as_dvec2();
    let position = uv * DVec2::new(f64::from(image.width), f64::from(image.height));
    let edge = (position - position.round()).abs().min_element();
    let texel = |x: i64, y: i64| texel(texture, image, x, y, is_srgb);
    let value = match texture.filter {
        Filter::Nearest => texel(position.x.floor() as i64, position.y.floor() as i64),
        Filter::Linear => {
            let corner = (position - 0.5).floor();
            let share = position - 0.5 - corner;
            let (x, y) = (corner.x as i64, corner.y as i64);
            let upper = texel(x, y).lerp(texel(x + 1, y), share.x);
            upper.lerp(texel(x, y + 1).lerp(texel(x + 1, y + 1), share.x), share.y)
        }
    };
    Texel { value, to_edge: edge }
}

fn texel(texture: &Texture, image: &Image, x: i64, y: i64, is_srgb: bool) -> DVec4 {
    let x = wrap(x, i64::from(image.width), texture.wrap_u);
    let y = wrap(y, i64::from(image.height), texture.wrap_v);
    let rgba = image.rgba[(y * i64::from(image.width) + x) as usize];
    let mut value = DVec4::from_array(rgba.map(|byte| f64::from(byte) / 255.0));
    if is_srgb {
        for channel in 0..3 {
            value[channel] = linear_from_encoded(value[channel]);
        }
    }
    value
}

fn wrap(texel: i64, size: i64, mode: Wrap) -> i64 {
    match mode {
        Wrap::Repeat => texel.rem_euclid(size),
        Wrap::Clamp => texel.clamp(0, size - 1),
        Wrap::Mirror => {
            let inside = texel.rem_euclid(2 * size);
            if inside < size { inside } else { 2 * size - 1 - inside }
        }
    }
}
