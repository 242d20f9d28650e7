// SPDX-License-Identifier: MIT OR Apache-2.0
//! What can be wrong with a scene file: errors stop the loading, warnings do not.

use std::fmt;
use std::path::PathBuf;

use thiserror::Error;

/// Why a scene could not be loaded.
#[derive(Debug, Error)]
#[error("{}{kind}", .file.as_ref().map(|f| format!("{}: ", f.display())).unwrap_or_default())]
#[non_exhaustive]
pub struct SceneError {
    /// The scene file, if there is one.
    pub file: Option<PathBuf>,
    /// What is wrong, and where in the file.
    pub kind: ErrorKind,
}

impl From<ErrorKind> for SceneError {
    fn from(kind: ErrorKind) -> Self {
        Self { file: None, kind }
    }
}

/// What is wrong with a scene file.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ErrorKind {
    /// The scene file itself cannot be read.
    #[error("{0}")]
    File(#[from] ResourceError),
    /// The name has an unknown extension.
    #[error("unknown scene format `{extension}`; give a file that ends in .gltf, .glb or .obj")]
    UnknownFormat {
        /// The name's extension.
        extension: String,
    },
    /// A format that this build does not support.
    #[error("{format} files are not read by this build of lucerna; enable its feature `{feature}`")]
    NotBuiltIn {
        /// Its name.
        format: &'static str,
        /// The feature of this crate.
        feature: &'static str,
    },
    /// A limit of [`super::LoadLimits`] would be exceeded.
    #[error(
        "{what}: {needed} is more than the limit {limit}; raise LoadLimits::{setting} if you trust the file"
    )]
    TooMuch {
        /// What needs it.
        what: String,
        /// How much it needs in total.
        needed: u64,
        /// The limit.
        limit: u64,
        /// The limit's name in [`super::LoadLimits`].
        setting: &'static str,
    },
    /// The bytes are neither GLB nor JSON.
    #[error(
        "neither binary glTF (no `glTF` at byte 0) nor JSON text (no `{{`); export the scene again"
    )]
    NotGltf,
    /// The container of a `.glb` is broken.
    #[error(
        "broken GLB container at byte {byte}: {problem}; the file may be cut off, export or copy it again"
    )]
    Glb {
        /// Offset in the file.
        byte: usize,
        /// What is wrong at this byte.
        problem: String,
    },
    /// The JSON part is not UTF-8.
    #[error("the JSON is not UTF-8 at byte {byte} of it; save it as UTF-8")]
    NotUtf8 {
        /// Offset in the JSON.
        byte: usize,
    },
    /// The JSON does not parse, or does not have the structure of glTF.
    #[error("invalid glTF JSON: {message}")]
    Json {
        /// What is wrong, with line and column.
        message: String,
    },
    /// The file is not glTF 2.
    #[error(
        "glTF {version} is not supported, only glTF 2.0 is; export the scene as glTF 2.0, or convert it"
    )]
    Version {
        /// `asset.version`, `asset.minVersion`, or the version of the binary container.
        version: String,
    },
    /// The file does not state its glTF version.
    #[error(
        "asset.version is missing (glTF 1.0 may lack it); export the scene as glTF 2.0, which says \"asset\": {{\"version\": \"2.0\"}}"
    )]
    NoVersion,
    /// The text has 16-bit units.
    #[error("the text is UTF-16; save it as UTF-8")]
    Utf16,
    /// `extensionsRequired` names an extension that this loader does not know.
    #[error("the file requires the extension {name}, which is not supported; export without it")]
    Extension {
        /// The extension.
        name: String,
    },
    /// An index points past its array.
    #[error("{at} is {index}, but the file has {len} {of}")]
    Index {
        /// Path of the index in the JSON.
        at: String,
        /// Its value.
        index: usize,
        /// What it points into.
        of: &'static str,
        /// Number of elements in the array.
        len: usize,
    },
    /// A buffer's bytes are not available.
    #[error("buffers[{buffer}]: {source}")]
    Buffer {
        /// Index of the buffer.
        buffer: usize,
        /// Why.
        source: ResourceError,
    },
    /// Binary data is not where the file says, or not what it says.
    #[error("{at}: {problem}")]
    Data {
        /// The accessor, buffer view or buffer, and what uses it.
        at: String,
        /// What is wrong.
        problem: DataProblem,
    },
    /// A skin, or a primitive's attributes for it, are not valid glTF.
    #[error("{at}: {problem}")]
    Skin {
        /// The skin or the primitive.
        at: String,
        /// What is wrong.
        problem: String,
    },
    /// A node is its own ancestor.
    #[error("nodes[{node}] is its own ancestor; the nodes must form a tree")]
    NodeCycle {
        /// One node of the cycle.
        node: usize,
    },
    /// A node is reached twice.
    #[error("nodes[{node}] is reached twice ({first} and {second}); a node has at most one parent")]
    NodeShared {
        /// The node.
        node: usize,
        /// One place that lists it.
        first: String,
        /// The other.
        second: String,
    },
    /// A line of a text format is wrong.
    #[error("line {line}: {problem}")]
    Line {
        /// Counted from 1.
        line: usize,
        /// What is wrong.
        problem: String,
    },
    /// The OBJ parser rejected a file that had passed the checks.
    #[cfg(feature = "obj")]
    #[error("OBJ: {0}")]
    Obj(tobj::LoadError),
}

/// What is wrong with an accessor, a buffer view or a buffer.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum DataProblem {
    /// The bytes are outside of what contains them.
    #[error("bytes {start}..{end} are outside of {of} ({len} bytes)")]
    Outside {
        /// First byte.
        start: u64,
        /// One past the last byte; `u64::MAX` where it does not fit 64 bits.
        end: u64,
        /// What contains them.
        of: String,
        /// Its length.
        len: u64,
    },
    /// The byte stride is smaller than an element.
    #[error("byteStride {stride} is smaller than an element ({size} bytes)")]
    Stride {
        /// Bytes from element to element.
        stride: usize,
        /// Bytes of an element.
        size: usize,
    },
    /// The accessor's type is not one that its use allows.
    #[error("is {found}, expected {expected}")]
    Type {
        /// Its type.
        found: String,
        /// The allowed types.
        expected: &'static str,
    },
    /// glTF does not define this value of an enumeration.
    #[error("{0} has a value that glTF does not know")]
    Unknown(&'static str),
    /// Attributes of one primitive differ in length.
    #[error("has {found} elements, but POSITION has {expected}")]
    Count {
        /// Elements found.
        found: usize,
        /// Elements of POSITION.
        expected: usize,
    },
    /// A sparse index is not within the accessor, or the indices do not increase.
    #[error(
        "sparse index {index} (number {number}) is not below the count {count}, or not above the one before it"
    )]
    Sparse {
        /// The index's position in the list.
        number: usize,
        /// Its value.
        index: u64,
        /// The accessor's count.
        count: u64,
    },
}

/// Why a file that the scene names, or data within the scene, cannot be read.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ResourceError {
    /// The system reports an error.
    #[error("cannot read {path}: {source}")]
    Io {
        /// The file.
        path: String,
        /// The system's error.
        source: std::io::Error,
    },
    /// It is a folder, a pipe or a device.
    #[error("{path} is not a regular file")]
    NotAFile {
        /// The file.
        path: String,
    },
    /// It is an address such as `http:`.
    #[error(
        "{uri}: the scheme `{scheme}:` is not supported; only files in the scene's folder and data URIs are"
    )]
    Scheme {
        /// The address.
        uri: String,
        /// The part before its colon.
        scheme: String,
    },
    /// The path leads out of the scene's folder.
    #[error("{path} leads out of the scene's folder; put the file next to the scene")]
    Outside {
        /// The path as the file gives it.
        path: String,
    },
    /// The scene was given as bytes, without a folder.
    #[error("{path} is a separate file, but the scene was given without a folder")]
    NoFolder {
        /// The path as the file gives it.
        path: String,
    },
    /// The URI's percent-encoding is broken.
    #[error("{uri}: broken percent-encoding at byte {byte}")]
    Percent {
        /// The URI.
        uri: String,
        /// Offset in it.
        byte: usize,
    },
    /// The data URI does not say `;base64,`.
    #[error("data URI without `;base64,`")]
    DataUri,
    /// The data URI's base64 is broken.
    #[error("invalid base64 at character {at} of the data URI's data")]
    Base64 {
        /// Offset in the data.
        at: usize,
    },
    /// It has more bytes than are left of [`super::LoadLimits::max_bytes`].
    #[error("{path} has {len} bytes, more than the {left} that LoadLimits::max_bytes leaves")]
    TooLong {
        /// The file.
        path: String,
        /// Its length.
        len: u64,
        /// How many bytes may still be read.
        left: u64,
    },
    /// There are fewer bytes than the scene says.
    #[error("has {found} bytes, but byteLength is {expected}; the file may be cut off")]
    TooShort {
        /// Bytes found.
        found: u64,
        /// Bytes expected.
        expected: u64,
    },
    /// There are neither bytes nor an address.
    #[error("has no uri, and the file has no binary chunk for it")]
    Missing,
}

/// Why an image was replaced by white.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ImageError {
    /// Its bytes are not available.
    #[error("{0}")]
    Resource(#[from] ResourceError),
    /// Its bytes are outside their buffer.
    #[error("{0}")]
    Data(String),
    /// A format that this build does not support.
    #[error(
        "is a {format} file, which this build of lucerna does not support; enable its feature `{feature}`"
    )]
    NotBuiltIn {
        /// Its name.
        format: &'static str,
        /// The feature of this crate.
        feature: &'static str,
    },
    /// It is neither PNG nor JPEG.
    #[error("neither PNG nor JPEG; convert it")]
    Format,
    /// It has more pixels than [`super::LoadLimits::max_image_pixels`].
    #[error("{width}×{height} pixels are more than LoadLimits::max_image_pixels ({limit})")]
    TooLarge {
        /// Pixels per row.
        width: u32,
        /// Rows.
        height: u32,
        /// The limit.
        limit: u64,
    },
    /// It needs more bytes than are left of [`super::LoadLimits::max_bytes`].
    #[error("{width}×{height} pixels are more than LoadLimits::max_bytes leaves ({left} bytes)")]
    NoBudget {
        /// Pixels per row.
        width: u32,
        /// Rows.
        height: u32,
        /// Bytes left.
        left: u64,
    },
    /// The header claims more pixels than the bytes can hold, even with the format's best
    /// compression.
    #[error("the header says {width}×{height} pixels, more than its {bytes} bytes can hold")]
    Lies {
        /// Pixels per row.
        width: u32,
        /// Rows.
        height: u32,
        /// Length of the file.
        bytes: u64,
    },
    /// Width or height is 0.
    #[error("has no pixels")]
    Empty,
    /// The decoder reports an error.
    #[error("cannot be decoded: {0}")]
    Decode(String),
}

/// What was skipped or replaced in a scene that was loaded nevertheless.
#[derive(Debug)]
#[non_exhaustive]
pub enum Warning {
    /// The scene has no triangles.
    NoTriangles,
    /// Triangles were left out of a mesh.
    Dropped {
        /// The mesh or OBJ object.
        mesh: String,
        /// How many.
        n: usize,
        /// Why.
        reason: DropReason,
    },
    /// Attribute values were unusable and were replaced.
    Replaced {
        /// The mesh.
        mesh: String,
        /// How many.
        n: usize,
        /// Which attribute, and how it was replaced.
        attribute: Attribute,
    },
    /// A part of the file has an effect that is not supported.
    Ignored {
        /// Where it stands.
        at: String,
        /// What it is.
        what: String,
    },
    /// A value was out of range and was changed or left out.
    Value {
        /// Where it stands.
        at: String,
        /// What was wrong, and what was done.
        problem: String,
    },
    /// A node or an instance was left out because of its transform.
    Transform {
        /// The node.
        node: String,
        /// What is wrong, and what was done.
        problem: &'static str,
    },
    /// Data does not start at a multiple of its size; it was read anyway.
    Misaligned {
        /// The accessor and its user.
        at: String,
    },
    /// An image was replaced by white (a normal map: left out; an emissive texture: no emission).
    Image {
        /// The image.
        image: String,
        /// Why.
        source: ImageError,
    },
    /// `alphaMode` BLEND was read as MASK.
    Blend {
        /// The material.
        material: String,
    },
    /// A material reads texture coordinates that the mesh does not have; they read as (0, 0).
    MissingTexcoords {
        /// The mesh.
        mesh: String,
        /// Which set.
        set: u32,
    },
    /// A material library or a part of it was left out.
    Materials {
        /// The library, and the line if there is one.
        at: String,
        /// What is wrong with it.
        problem: String,
    },
    /// Lines of an OBJ file were left out.
    Line {
        /// The first such line, counted from 1.
        line: usize,
        /// Number of such lines.
        n: usize,
        /// What is wrong with them.
        problem: LineProblem,
    },
    /// There were more warnings than the limit.
    More {
        /// Number of warnings left out.
        n: usize,
    },
}

/// Why triangles were left out.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[non_exhaustive]
pub enum DropReason {
    /// A corner is NaN or infinite.
    NotFinite,
    /// A corner is beyond [`super::MAX_COORDINATE`].
    Huge,
    /// The triangle has no area.
    ZeroArea,
    /// A vertex index is out of range.
    Index,
}

/// Vertex attributes whose values were replaced.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Attribute {
    /// Normals that are zero or not finite: replaced by the mean of the adjacent triangles.
    Normals,
    /// Tangents that are zero or not finite: replaced by any direction perpendicular to the normal.
    Tangents,
    /// Texture coordinates that are not finite: replaced by 0.
    Texcoords,
    /// Colours that are negative or not finite: clamped, or replaced by 1.
    Colors,
}

/// What is wrong with lines of an OBJ file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[non_exhaustive]
pub enum LineProblem {
    /// `v`, `vt` or `vn` with too few numbers or no numbers; read as NaN or 0.
    Numbers,
    /// A number such as `0,5`; read as 0.5.
    Comma,
    /// A face with fewer than 3 corners.
    FewCorners,
    /// A face whose vertex index is out of range.
    Index,
    /// A face whose texture coordinate's or normal's index is out of range; read without it.
    AttributeIndex,
    /// A corner that is not `v`, `v/vt`, `v//vn` or `v/vt/vn`.
    Corner,
    /// A polygon whose outline intersects itself; read as a fan.
    SelfIntersecting,
    /// A polygon of more than [`super::LoadLimits::max_polygon_corners`] corners; read as a fan.
    ManyCorners,
    /// A polygon without area.
    FlatPolygon,
    /// Points, lines, curves or surfaces.
    NotAFace,
    /// `usemtl` names an unknown material; replaced by rough white.
    NoMaterial,
    /// Not UTF-8; read as Latin-1.
    NotUtf8,
}

impl fmt::Display for DropReason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::NotFinite => "NaN or infinite corner",
            Self::Huge => "corner beyond 1e9 m",
            Self::ZeroArea => "zero area",
            Self::Index => "vertex index out of range",
        })
    }
}

impl fmt::Display for Attribute {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Normals => {
                "normal(s), zero or not finite, replaced by the mean of the adjacent faces"
            }
            Self::Tangents => "tangent(s), zero or not finite, replaced",
            Self::Texcoords => "texture coordinate(s), not finite, replaced by 0",
            Self::Colors => "vertex colour(s), negative or not finite, replaced",
        })
    }
}

impl fmt::Display for LineProblem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Numbers => "too few or unreadable numbers, read as NaN",
            Self::Comma => "decimal comma, read as a point",
            Self::FewCorners => "face with fewer than 3 corners, skipped",
            Self::Index => "face with a vertex index out of range, skipped",
            Self::AttributeIndex => {
                "face with a texture coordinate or normal index out of range, read without it"
            }
            Self::Corner => "face with an unreadable corner, skipped",
            Self::SelfIntersecting => "polygon that intersects itself, read as a fan",
            Self::ManyCorners => {
                "polygon with more corners than LoadLimits::max_polygon_corners, read as a fan"
            }
            Self::FlatPolygon => "polygon without area, skipped",
            Self::NotAFace => "points, lines, curves or surfaces, skipped",
            Self::NoMaterial => "usemtl of an unknown material, white instead",
            Self::NotUtf8 => "not UTF-8, read as Latin-1",
        })
    }
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoTriangles => write!(f, "the scene has no triangles"),
            Self::Dropped { mesh, n, reason } => {
                write!(f, "{mesh}: {n} triangle(s) dropped: {reason}")
            }
            Self::Replaced { mesh, n, attribute } => write!(f, "{mesh}: {n} {attribute}"),
            Self::Ignored { at, what } => write!(f, "{at}: {what} ignored"),
            Self::Value { at, problem } => write!(f, "{at}: {problem}"),
            Self::Transform { node, problem } => write!(f, "{node}: {problem}"),
            Self::Misaligned { at } => write!(f, "{at}: data is misaligned, read anyway"),
            Self::Image { image, source } => {
                write!(
                    f,
                    "{image}: {source}; read as white (as a normal map: left out; as an emissive \
                     texture: no emission)"
                )
            }
            Self::Blend { material } => write!(
                f,
                "{material}: alphaMode BLEND is not supported, read as MASK with cutoff 0.5"
            ),
            Self::MissingTexcoords { mesh, set } => write!(
                f,
                "{mesh}: the material reads TEXCOORD_{set}, which the mesh does not have; read as (0, 0)"
            ),
            Self::Materials { at, problem } => write!(f, "{at}: {problem}"),
            Self::Line { line, n, problem } => write!(f, "line {line}: {problem} ({n} in total)"),
            Self::More { n } => write!(f, "{n} more warning(s)"),
        }
    }
}

/// The most warnings kept for one file; otherwise a malicious file could fill the memory with them.
#[cfg(any(feature = "gltf", feature = "obj"))]
const MAX_WARNINGS: usize = 1000;

#[cfg(any(feature = "gltf", feature = "obj"))]
/// Collects warnings up to a limit.
#[derive(Debug, Default)]
pub(super) struct Warnings {
    kept: Vec<Warning>,
    n_left_out: usize,
}

#[cfg(any(feature = "gltf", feature = "obj"))]
impl Warnings {
    pub fn push(&mut self, warning: Warning) {
        if self.kept.len() < MAX_WARNINGS {
            self.kept.push(warning);
        } else {
            self.n_left_out += 1;
        }
    }

    pub fn into_vec(mut self) -> Vec<Warning> {
        if self.n_left_out > 0 {
            self.kept.push(Warning::More { n: self.n_left_out });
        }
        self.kept
    }
}

/// A name from a file, shortened for messages: a malicious file can have names as long as itself.
pub(super) fn short(name: &str) -> String {
    const MAX_CHARS: usize = 80;
    let mut chars = name.chars();
    let mut out: String = chars
        .by_ref()
        .take(MAX_CHARS)
        .map(|c| if c.is_control() { '\u{fffd}' } else { c })
        .collect();
    if chars.next().is_some() {
        out.push('…');
    }
    out
}
