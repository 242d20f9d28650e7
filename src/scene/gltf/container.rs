// SPDX-License-Identifier: MIT OR Apache-2.0
//! Splits bytes into the JSON tree and the binary chunk.

use gltf::json::{Root, Value, deserialize};

use crate::scene::error::{ErrorKind, short};
use crate::scene::limits::Budget;

const HEADER_BYTES: usize = 12;
const CHUNK_HEADER_BYTES: usize = 8;

/// Extensions that this loader knows; a file may not require others.
pub(super) const EXTENSIONS: [&str; 3] =
    ["KHR_lights_punctual", "KHR_materials_emissive_strength", "KHR_texture_transform"];

/// Size of the parsed JSON: the largest object (a material) has 424 bytes, an array's element or an
/// object's member at most 64, and arrays grow by doubling. Strings are copied unchanged.
const BYTES_PER_OBJECT: u64 = 1024;
const BYTES_PER_ELEMENT: u64 = 128;

/// Splits and parses `.gltf` or `.glb` bytes, which differ in their first bytes.
pub(super) fn parse<'a>(
    bytes: &'a [u8],
    budget: &mut Budget,
) -> Result<(Root, Option<&'a [u8]>), ErrorKind> {
    let (json, bin) = if bytes.starts_with(b"glTF") {
        split_glb(bytes)?
    } else {
        // RFC 8259 allows readers to ignore a byte order mark.
        let json = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
        let marks: [&[u8]; 4] = [b"\xff\xfe", b"\xfe\xff", b"{\0", b"\0{"];
        if marks.iter().any(|mark| json.starts_with(mark)) {
            return Err(ErrorKind::Utf16);
        }
        if !json.trim_ascii_start().starts_with(b"{") {
            return Err(ErrorKind::NotGltf);
        }
        (json, None)
    };
    let text =
        std::str::from_utf8(json).map_err(|e| ErrorKind::NotUtf8 { byte: e.valid_up_to() })?;
    // Chunks should be padded with blanks, but some exporters pad with zeros.
    let text = text.trim_end_matches('\0');
    let (mut n_objects, mut n_elements) = (0, 0);
    for byte in text.bytes() {
        n_objects += u64::from(byte == b'{');
        // An array's first element has no comma before it.
        n_elements += u64::from(matches!(byte, b',' | b'['));
    }
    budget.take(text.len() as u64, 1, "JSON text")?;
    budget.take(n_objects, BYTES_PER_OBJECT, "JSON objects")?;
    budget.take(n_elements, BYTES_PER_ELEMENT, "JSON elements")?;
    let root = Root::from_str(text).map_err(|e| {
        other_version(text).unwrap_or_else(|| ErrorKind::Json { message: short(&e.to_string()) })
    })?;
    check_version(&root)?;
    if let Some(name) =
        root.extensions_required.iter().find(|name| !EXTENSIONS.contains(&name.as_str()))
    {
        return Err(ErrorKind::Extension { name: short(name) });
    }
    Ok((root, bin))
}

/// The error for JSON that is not glTF 2.0: files of another version have another structure.
fn other_version(text: &str) -> Option<ErrorKind> {
    let tree: Value = deserialize::from_str(text).ok()?;
    let version = tree.get("asset").and_then(|asset| asset.get("version"));
    match version {
        None => Some(ErrorKind::NoVersion),
        Some(Value::String(version)) if version.starts_with("2.") => None,
        Some(Value::String(version)) => Some(ErrorKind::Version { version: short(version) }),
        // Early exporters of glTF 1.0 write a number.
        Some(Value::Number(version)) if version.as_f64() < Some(2.0) => {
            Some(ErrorKind::Version { version: format!("{:.1}", version.as_f64()?) })
        }
        Some(_) => None,
    }
}

fn check_version(root: &Root) -> Result<(), ErrorKind> {
    let asset = &root.asset;
    let too_new = asset.min_version.as_deref().filter(|v| *v != "2.0");
    let other = Some(asset.version.as_str()).filter(|v| !v.starts_with("2."));
    match too_new.or(other) {
        Some(version) => Err(ErrorKind::Version { version: short(version) }),
        None => Ok(()),
    }
}

fn word(bytes: &[u8], at: usize) -> Option<u32> {
    let word = bytes.get(at..at.checked_add(4)?)?;
    Some(u32::from_le_bytes(word.try_into().ok()?))
}

fn split_glb(bytes: &[u8]) -> Result<(&[u8], Option<&[u8]>), ErrorKind> {
    let broken = |byte, problem: String| ErrorKind::Glb { byte, problem };
    let cut = |byte| broken(byte, "the file ends within a header".to_owned());

    let version = word(bytes, 4).ok_or_else(|| cut(4))?;
    if version != 2 {
        let version = match version {
            1 => "1.0 (binary container of version 1)".to_owned(),
            other => format!("of binary container version {other}"),
        };
        return Err(ErrorKind::Version { version });
    }
    let length = word(bytes, 8).ok_or_else(|| cut(8))? as usize;
    if length < HEADER_BYTES || length > bytes.len() {
        let problem = format!("length is {length}, but the file has {} bytes", bytes.len());
        return Err(broken(8, problem));
    }
    let bytes = &bytes[..length];

    let chunk = |at: usize| -> Result<(u32, &[u8], usize), ErrorKind> {
        let length = word(bytes, at).ok_or_else(|| cut(at))? as usize;
        let kind = word(bytes, at + 4).ok_or_else(|| cut(at + 4))?;
        let start = at + CHUNK_HEADER_BYTES;
        let end = start.checked_add(length).filter(|&end| end <= bytes.len()).ok_or_else(|| {
            let left = bytes.len() - start;
            broken(at, format!("the chunk has {length} bytes, but {left} are left"))
        })?;
        Ok((kind, &bytes[start..end], end))
    };

    let (kind, json, mut at) = chunk(HEADER_BYTES)?;
    if kind != u32::from_le_bytes(*b"JSON") {
        return Err(broken(HEADER_BYTES + 4, "the first chunk is not JSON".to_owned()));
    }
    // Chunks of other kinds must be skipped.
    while at < bytes.len() {
        let (kind, data, end) = chunk(at)?;
        if kind == u32::from_le_bytes(*b"BIN\0") {
            return Ok((json, Some(data)));
        }
        at = end;
    }
    Ok((json, None))
}
