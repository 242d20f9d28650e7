// SPDX-License-Identifier: MIT OR Apache-2.0
//! glTF files made in tests.

/// Positions of a triangle in the plane z = 0.
pub const TRIANGLE: [[f32; 3]; 3] = [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.]];

/// Gathers binary data; each piece gets a view and an accessor of its own unless said otherwise.
#[derive(Default)]
pub struct Builder {
    pub bytes: Vec<u8>,
    views: Vec<String>,
    accessors: Vec<String>,
}

impl Builder {
    /// A view over `bytes`, aligned to 4; `more` is JSON such as `,"byteStride":16`.
    pub fn view(&mut self, bytes: &[u8], more: &str) -> usize {
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        self.views.push(format!(
            r#"{{"buffer":0,"byteOffset":{},"byteLength":{}{more}}}"#,
            self.bytes.len(),
            bytes.len()
        ));
        self.bytes.extend_from_slice(bytes);
        self.views.len() - 1
    }

    /// An accessor; `more` is JSON such as `,"bufferView":0`.
    pub fn accessor(&mut self, component: u32, kind: &str, count: usize, more: &str) -> usize {
        self.accessors.push(format!(
            r#"{{"componentType":{component},"type":"{kind}","count":{count}{more}}}"#
        ));
        self.accessors.len() - 1
    }

    pub fn floats<const N: usize>(&mut self, values: &[[f32; N]]) -> usize {
        let view = self.view(&le_bytes(values), "");
        let kind = match N {
            16 => "MAT4",
            n => ["SCALAR", "VEC2", "VEC3", "VEC4"][n - 1],
        };
        self.accessor(5126, kind, values.len(), &format!(r#","bufferView":{view}"#))
    }

    /// Integers of 1, 2 or 4 bytes.
    pub fn raw(
        &mut self,
        bytes: &[u8],
        component: u32,
        kind: &str,
        count: usize,
        more: &str,
    ) -> usize {
        let view = self.view(bytes, "");
        self.accessor(component, kind, count, &format!(r#","bufferView":{view}{more}"#))
    }

    pub fn indices(&mut self, indices: &[u16]) -> usize {
        let bytes: Vec<u8> = indices.iter().flat_map(|i| i.to_le_bytes()).collect();
        self.raw(&bytes, 5123, "SCALAR", indices.len(), "")
    }

    /// The whole file; `rest` is JSON members without the braces.
    pub fn gltf(&self, rest: &str) -> Vec<u8> {
        let uri = format!("data:application/octet-stream;base64,{}", base64(&self.bytes));
        self.file(rest, &format!(r#","uri":"{uri}""#))
    }

    /// The same as binary glTF.
    pub fn glb(&self, rest: &str) -> Vec<u8> {
        let mut json = self.file(rest, "");
        json.resize(json.len().next_multiple_of(4), b' ');
        let mut bin = self.bytes.clone();
        bin.resize(bin.len().next_multiple_of(4), 0);
        let mut out = b"glTF".to_vec();
        for word in [2, 12 + 8 + json.len() + 8 + bin.len(), json.len()] {
            out.extend((word as u32).to_le_bytes());
        }
        out.extend(b"JSON");
        out.extend(json);
        out.extend((bin.len() as u32).to_le_bytes());
        out.extend(b"BIN\0");
        out.extend(bin);
        out
    }

    fn file(&self, rest: &str, uri: &str) -> Vec<u8> {
        format!(
            r#"{{"asset":{{"version":"2.0"}},"buffers":[{{"byteLength":{}{uri}}}],"bufferViews":[{}],"accessors":[{}],{rest}}}"#,
            self.bytes.len(),
            self.views.join(","),
            self.accessors.join(","),
        )
        .into_bytes()
    }
}

pub fn le_bytes<const N: usize>(values: &[[f32; N]]) -> Vec<u8> {
    values.iter().flatten().flat_map(|v| v.to_le_bytes()).collect()
}

/// A triangle in a node, with `node` and `rest` put in: JSON such as `,"camera":0`.
pub fn triangle(node: &str, rest: &str) -> Vec<u8> {
    let mut b = Builder::default();
    b.floats(&TRIANGLE);
    b.gltf(&format!(
        r#""scene":0,"scenes":[{{"nodes":[0]}}],"nodes":[{{"mesh":0{node}}}],
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}}}}]}}]{rest}"#
    ))
}

/// A triangle with texture coordinates and material 0; `rest` brings the materials.
pub fn textured(rest: &str) -> Vec<u8> {
    let mut b = Builder::default();
    b.floats(&TRIANGLE);
    b.floats(&[[0., 0.], [1., 0.], [0., 1.]]);
    b.gltf(&format!(
        r#""scene":0,"scenes":[{{"nodes":[0]}}],"nodes":[{{"mesh":0}}],
        "meshes":[{{"primitives":[{{"material":0,
            "attributes":{{"POSITION":0,"TEXCOORD_0":1,"TEXCOORD_1":1}}}}]}}],{rest}"#
    ))
}

pub fn base64(bytes: &[u8]) -> String {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut out = String::new();
    for group in bytes.chunks(3) {
        let mut bits = 0u32;
        for i in 0..3 {
            bits = bits << 8 | u32::from(group.get(i).copied().unwrap_or(0));
        }
        for i in 0..4 {
            let digit = DIGITS[(bits >> (18 - 6 * i) & 63) as usize];
            out.push(if i <= group.len() { digit.into() } else { '=' });
        }
    }
    out
}
