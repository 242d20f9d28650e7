// SPDX-License-Identifier: MIT OR Apache-2.0
//! The front end of the OBJ parser: every line is checked and rewritten in a simple form.
//!
//! The parser, tobj, trusts its input: it panics on some index values and on short colours, takes lines for faces, and
//! misaligns attributes that only some corners have. The text written here has absolute indices within range, all three
//! of them for each corner, and a colour for each vertex. If the file has no `vt` or `vn`, the first ones, which are
//! NaN, take their place.

use std::borrow::Cow;
use std::collections::{BTreeMap, HashSet};
use std::fmt::Write;
use std::str::FromStr;

use glam::DVec3;

use crate::scene::error::{ErrorKind, LineProblem, Warning, Warnings, short};
use crate::scene::limits::{Budget, LoadLimits};
use crate::scene::rebase::Sample;

/// Upper bounds of the bytes that the parser and its result need in addition to the text: per line (a vertex, or the
/// cost of any line), per corner of a face (its indices, and its own vertex in a hash map, in the parser's mesh and in
/// ours), and per change of object or material (a mesh).
const PARSED_BYTES_PER_LINE: u64 = 160;
const PARSED_BYTES_PER_CORNER: u64 = 192;
const PARSED_BYTES_PER_MESH: u64 = 1024;

/// What a file declares, counted before its faces are read: faces may come before their vertices.
#[derive(Default)]
pub(super) struct Declared {
    n_positions: usize,
    n_texcoords: usize,
    n_normals: usize,
    /// The origin to which vertices are relative: [`Scene::origin`](crate::scene::Scene::origin).
    pub origin: DVec3,
    /// Names of material libraries, without duplicates: some exporters repeat them for every object.
    pub libraries: Vec<String>,
}

/// A file that is safe for the parser.
pub(super) struct Checked {
    /// The part that is read first.
    pub vertices: String,
    pub faces: String,
    /// For each face, in the order of the text, its line in the original file.
    pub face_lines: Vec<usize>,
    pub problems: Problems,
    pub passed: Passed,
}

/// For each problem, its first line and the number of its lines.
#[derive(Default)]
pub(super) struct Problems(BTreeMap<LineProblem, (usize, usize)>);

impl Problems {
    pub fn add(&mut self, line: usize, problem: LineProblem) {
        let (first, n) = self.0.entry(problem).or_insert((line, 0));
        *first = line.min(*first);
        *n += 1;
    }

    pub fn report(self, warnings: &mut Warnings) {
        for (problem, (line, n)) in self.0 {
            warnings.push(Warning::Line { line, n, problem });
        }
    }
}

/// Skipped keywords: for each, its first line and the number of its lines.
#[derive(Default)]
pub(super) struct Passed {
    by_keyword: BTreeMap<(bool, String), (usize, usize)>,
    n_more: usize,
}

impl Passed {
    /// The most keywords that are named, because binary data can contain any number of different ones.
    const MAX_KEYWORDS: usize = 32;

    /// `is_known`: whether the format defines it, although it has no effect here.
    pub fn add(&mut self, line: usize, keyword: &str, is_known: bool) {
        let key = (is_known, short(keyword));
        if let Some((_, n)) = self.by_keyword.get_mut(&key) {
            *n += 1;
        } else if self.by_keyword.len() < Self::MAX_KEYWORDS {
            self.by_keyword.insert(key, (line, 1));
        } else {
            self.n_more += 1;
        }
    }

    /// One warning per keyword; `file` precedes the line.
    pub fn report(self, file: &str, warnings: &mut Warnings) {
        for ((is_known, keyword), (line, n)) in self.by_keyword {
            let what = if is_known { "(not supported)" } else { "(unknown keyword)" };
            warnings.push(Warning::Ignored {
                at: format!("{file}line {line}"),
                what: format!("`{keyword}` {what}, {n} in total,"),
            });
        }
        if self.n_more > 0 {
            warnings.push(Warning::Ignored {
                at: format!("{file}all lines"),
                what: format!("{} more line(s) of unknown keywords", self.n_more),
            });
        }
    }
}

/// Statements that have no effect here: smoothing groups (without `vn`, faces are flat), merging groups and levels of
/// detail; and those that define and display curves and surfaces, which give warnings themselves.
const HARMLESS: [&str; 22] = [
    "s", "mg", "lod", "bevel", "c_interp", "d_interp", "vp", "cstype", "deg", "bmat", "step",
    "parm", "trim", "hole", "scrv", "sp", "end", "con", "ctech", "stech", "res", "maplib",
];

/// Statements with an effect that is not supported. `call` reads another file, `csh` runs a command.
const UNSUPPORTED: [&str; 5] = ["usemap", "shadow_obj", "trace_obj", "call", "csh"];

/// A line of a text format with its number; continued lines (`\` at the end) are joined.
pub(super) struct Line<'a> {
    pub number: usize,
    pub text: Cow<'a, str>,
    pub is_utf8: bool,
}

/// The text as UTF-8 without a byte order mark. UTF-16 is recognised by its mark, or by a 0 in every other byte, and
/// decoded with a warning.
pub(super) fn as_utf8<'a>(
    bytes: &'a [u8],
    at: &str,
    budget: &mut Budget,
    warnings: &mut Warnings,
) -> Result<Cow<'a, [u8]>, ErrorKind> {
    if let Some(rest) = bytes.strip_prefix(b"\xef\xbb\xbf") {
        return Ok(Cow::Borrowed(rest));
    }
    let Some((is_big_endian, rest)) = utf16(bytes) else {
        if bytes.contains(&0) {
            warnings.push(Warning::Value {
                at: at.to_owned(),
                problem: "has bytes of value 0: binary data, or a text in UTF-16 or UTF-32; save \
                          it as UTF-8"
                    .to_owned(),
            });
        }
        return Ok(Cow::Borrowed(bytes));
    };
    // Two bytes can become three.
    budget.take(rest.len() as u64, 2, at)?;
    let units = rest.chunks_exact(2).map(|pair| match is_big_endian {
        true => u16::from_be_bytes([pair[0], pair[1]]),
        false => u16::from_le_bytes([pair[0], pair[1]]),
    });
    let text: String =
        char::decode_utf16(units).map(|unit| unit.unwrap_or(char::REPLACEMENT_CHARACTER)).collect();
    warnings.push(Warning::Value {
        at: at.to_owned(),
        problem: "the text is UTF-16, read as such; save it as UTF-8".to_owned(),
    });
    Ok(Cow::Owned(text.into_bytes()))
}

/// Whether UTF-16 is big-endian, and the text after its mark.
fn utf16(bytes: &[u8]) -> Option<(bool, &[u8])> {
    /// Bytes that are examined if there is no mark.
    const PROBE: usize = 64;
    if let Some(rest) = bytes.strip_prefix(b"\xff\xfe") {
        // The same mark, in 32 bits.
        return (!rest.starts_with(&[0, 0])).then_some((false, rest));
    }
    if let Some(rest) = bytes.strip_prefix(b"\xfe\xff") {
        return Some((true, rest));
    }
    let probe = &bytes[..bytes.len().min(PROBE) / 2 * 2];
    let all = |first: bool| {
        !probe.is_empty()
            && probe.chunks_exact(2).all(|p| (p[0] == 0) == first && (p[1] == 0) != first)
    };
    if all(false) { Some((false, bytes)) } else { all(true).then_some((true, bytes)) }
}

/// Lines that end in LF, CR LF or CR, without their ends.
fn physical_lines(bytes: &[u8]) -> impl Iterator<Item = &[u8]> {
    let mut rest = Some(bytes);
    std::iter::from_fn(move || {
        let all = rest?;
        let Some(end) = all.iter().position(|b| matches!(b, b'\n' | b'\r')) else {
            rest = None;
            return Some(all);
        };
        let next = if all[end..].starts_with(b"\r\n") { end + 2 } else { end + 1 };
        rest = Some(&all[next..]);
        Some(&all[..end])
    })
}

/// The lines of a text ([`as_utf8`]) without those that are empty or comments.
pub(super) fn lines<'a>(
    bytes: &'a [u8],
    limits: &LoadLimits,
) -> impl Iterator<Item = Result<Line<'a>, ErrorKind>> {
    let max = limits.max_line_bytes;
    let mut physical = physical_lines(bytes).enumerate();
    std::iter::from_fn(move || {
        loop {
            let (ix, first) = physical.next()?;
            let number = ix + 1;
            let too_long = |number| ErrorKind::TooMuch {
                what: format!("line {number}: bytes"),
                needed: max as u64 + 1,
                limit: max as u64,
                setting: "max_line_bytes",
            };
            if first.len() > max {
                return Some(Err(too_long(number)));
            }
            let first = first.trim_ascii();
            if first.is_empty() || first[0] == b'#' {
                continue;
            }
            let mut bytes = Cow::Borrowed(first);
            while bytes.last() == Some(&b'\\') {
                let joined = bytes.to_mut();
                joined.pop();
                joined.push(b' ');
                let Some((_, next)) = physical.next() else {
                    break;
                };
                if joined.len() + next.len() > max {
                    return Some(Err(too_long(number)));
                }
                joined.extend_from_slice(next.trim_ascii());
            }
            let latin_1 =
                |bytes: &[u8]| (Cow::Owned(bytes.iter().copied().map(char::from).collect()), false);
            let (text, is_utf8) = match bytes {
                Cow::Borrowed(bytes) => match std::str::from_utf8(bytes) {
                    Ok(text) => (Cow::Borrowed(text), true),
                    Err(_) => latin_1(bytes),
                },
                Cow::Owned(bytes) => match String::from_utf8(bytes) {
                    Ok(text) => (Cow::Owned(text), true),
                    Err(e) => latin_1(e.as_bytes()),
                },
            };
            return Some(Ok(Line { number, text, is_utf8 }));
        }
    })
}

/// The line's first word, and the rest without surrounding blanks.
pub(super) fn keyword(line: &str) -> (&str, &str) {
    let line = line.trim();
    match line.split_once(|c: char| c.is_ascii_whitespace()) {
        Some((word, rest)) => (word, rest.trim()),
        None => (line, ""),
    }
}

/// Counts what the file declares.
pub(super) fn declared(bytes: &[u8], limits: &LoadLimits) -> Result<Declared, ErrorKind> {
    let mut declared = Declared::default();
    let mut known = HashSet::new();
    let mut sample = Sample::default();
    for line in lines(bytes, limits) {
        let line = line?;
        let (word, rest) = keyword(&line.text);
        match word {
            "v" => {
                declared.n_positions += 1;
                sample.add(DVec3::from_array(vertex(rest, |_| ()).0));
            }
            "vt" => declared.n_texcoords += 1,
            "vn" => declared.n_normals += 1,
            "mtllib" if known.insert(rest.to_owned()) => declared.libraries.push(rest.to_owned()),
            _ => {}
        }
    }
    declared.origin = sample.origin();
    Ok(declared)
}

/// Checks every line and rewrites it. Materials become `usemtl m3`, by their index in the list.
pub(super) fn check(
    bytes: &[u8],
    declared: &Declared,
    material: impl Fn(&str) -> Option<usize>,
    limits: &LoadLimits,
    budget: &mut Budget,
) -> Result<Checked, ErrorKind> {
    let mut vertices = String::from("mtllib checked\nvt NaN NaN\nvn NaN NaN NaN\n");
    let mut faces = String::new();
    let mut face_lines = Vec::new();
    let mut problems = Problems::default();
    let mut passed = Passed::default();
    // Numbers of declarations so far, from which negative indices count back.
    let (mut n_positions, mut n_texcoords, mut n_normals) = (0, 0, 0);
    let mut n_triangles = 0u64;
    let mut corners = Vec::new();

    for line in lines(bytes, limits) {
        let Line { number, text, is_utf8 } = line?;
        if !is_utf8 {
            problems.add(number, LineProblem::NotUtf8);
        }
        let before = vertices.len() + faces.len();
        let (word, rest) = keyword(&text);
        corners.clear();
        // Writing to a string cannot fail.
        let _ = match word {
            "v" => {
                n_positions += 1;
                let (position, color) = vertex(rest, |problem| problems.add(number, problem));
                // In 64 bits, then rounded, so that a scene far away keeps its precision.
                let [x, y, z] =
                    (DVec3::from_array(position) - declared.origin).as_vec3().to_array();
                let [r, g, b] = color;
                writeln!(vertices, "v {x} {y} {z} {r} {g} {b}")
            }
            "vt" => {
                n_texcoords += 1;
                let mut uv = [f32::NAN, 0.0];
                if let Some(problem) = numbers(rest, &mut uv, 1) {
                    problems.add(number, problem);
                }
                writeln!(vertices, "vt {} {}", uv[0], uv[1])
            }
            "vn" => {
                n_normals += 1;
                let mut n = [f32::NAN; 3];
                if let Some(problem) = numbers(rest, &mut n, 3) {
                    problems.add(number, problem);
                }
                writeln!(vertices, "vn {} {} {}", n[0], n[1], n[2])
            }
            "f" | "fo" => {
                let so_far = [n_positions, n_texcoords, n_normals];
                let (skipped, changed) = face(rest, so_far, declared, &mut corners);
                for problem in skipped.into_iter().chain(changed) {
                    problems.add(number, problem);
                }
                if skipped.is_some() {
                    corners.clear();
                    Ok(())
                } else {
                    n_triangles += corners.len() as u64 - 2;
                    face_lines.push(number);
                    write_face(&mut faces, &corners)
                }
            }
            "o" | "g" => writeln!(faces, "o {}", short(rest)),
            "usemtl" => match material(rest) {
                Some(ix) => writeln!(faces, "usemtl m{ix}"),
                None => {
                    problems.add(number, LineProblem::NoMaterial);
                    writeln!(faces, "usemtl none")
                }
            },
            "p" | "l" | "curv" | "curv2" | "surf" | "bsp" | "bzp" | "cdc" | "cdp" => {
                problems.add(number, LineProblem::NotAFace);
                Ok(())
            }
            "mtllib" => Ok(()),
            _ if HARMLESS.contains(&word) => Ok(()),
            _ => {
                passed.add(number, word, UNSUPPORTED.contains(&word));
                Ok(())
            }
        };
        if n_triangles > limits.max_triangles {
            return Err(ErrorKind::TooMuch {
                what: format!("line {number}: triangles"),
                needed: n_triangles,
                limit: limits.max_triangles,
                setting: "max_triangles",
            });
        }
        let written = (vertices.len() + faces.len() - before) as u64;
        let starts_mesh = matches!(word, "o" | "g" | "usemtl");
        let parsed = PARSED_BYTES_PER_LINE
            + PARSED_BYTES_PER_CORNER * corners.len() as u64
            + PARSED_BYTES_PER_MESH * u64::from(starts_mesh);
        budget.take(written + parsed, 1, "OBJ text")?;
    }
    Ok(Checked { vertices, faces, face_lines, problems, passed })
}

/// Corners of a face, as indices from 0 of position, texture coordinate and normal; index 0 of the latter two is the
/// NaN placeholder. Returns why the face must be skipped (otherwise at least 3 corners are left), and what else is
/// wrong with it.
fn face(
    rest: &str,
    [n_positions, n_texcoords, n_normals]: [usize; 3],
    declared: &Declared,
    corners: &mut Vec<[usize; 3]>,
) -> (Option<LineProblem>, Option<LineProblem>) {
    let mut changed = None;
    let mut optional = |part: Option<&str>, so_far, total| match part {
        None | Some("") => Ok(0),
        Some(part) => match resolve(part, so_far, total) {
            Ok(ix) => Ok(ix + 1),
            Err(LineProblem::Index) => {
                changed = Some(LineProblem::AttributeIndex);
                Ok(0)
            }
            Err(other) => Err(other),
        },
    };
    let mut corner = |word: &str| {
        let mut parts = word.split('/');
        let position = parts.next().unwrap_or("");
        let corner = [
            resolve(position, n_positions, declared.n_positions)?,
            optional(parts.next(), n_texcoords, declared.n_texcoords)?,
            optional(parts.next(), n_normals, declared.n_normals)?,
        ];
        match parts.next() {
            None => Ok(corner),
            Some(_) => Err(LineProblem::Corner),
        }
    };
    for word in words(rest) {
        match corner(word) {
            Ok(corner) => corners.push(corner),
            Err(problem) => return (Some(problem), None),
        }
    }
    let few = (corners.len() < 3).then_some(LineProblem::FewCorners);
    (few, changed)
}

fn write_face(faces: &mut String, corners: &[[usize; 3]]) -> std::fmt::Result {
    faces.push('f');
    for [v, vt, vn] in corners {
        // The parser counts from 1.
        write!(faces, " {}/{}/{}", v + 1, vt + 1, vn + 1)?;
    }
    faces.push('\n');
    Ok(())
}

/// Words up to a comment.
fn words(rest: &str) -> impl Iterator<Item = &str> {
    rest.split_ascii_whitespace().take_while(|word| !word.starts_with('#'))
}

/// A number, and whether it was written with a decimal comma.
pub(super) fn number<T: FromStr>(word: &str) -> Option<(T, bool)> {
    if let Ok(value) = word.parse() {
        return Some((value, false));
    }
    let (whole, part) = word.split_once(',')?;
    let is_digit = |c: char| c.is_ascii_digit();
    if !whole.ends_with(is_digit) || !part.starts_with(is_digit) {
        return None;
    }
    Some((format!("{whole}.{part}").parse().ok()?, true))
}

/// Reads all numbers, up to the slice's length. Returns what is wrong: fewer than `least`, an unreadable one (it
/// becomes NaN), or else a decimal comma.
fn numbers<T: FromStr + From<f32>>(rest: &str, out: &mut [T], least: usize) -> Option<LineProblem> {
    let mut n = 0;
    let (mut all_readable, mut has_comma) = (true, false);
    for (slot, word) in out.iter_mut().zip(words(rest)) {
        match number(word) {
            Some((value, comma)) => {
                *slot = value;
                has_comma |= comma;
            }
            None => {
                *slot = f32::NAN.into();
                all_readable = false;
            }
        }
        n += 1;
    }
    if !all_readable || n < least {
        Some(LineProblem::Numbers)
    } else {
        has_comma.then_some(LineProblem::Comma)
    }
}

/// Position and colour of a `v` line: `x y z`, `x y z w` (divided by w), `x y z r g b`.
fn vertex(rest: &str, report: impl FnOnce(LineProblem)) -> ([f64; 3], [f64; 3]) {
    const WHITE: [f64; 3] = [1.0; 3];
    let mut v = [f64::NAN; 6];
    let n = words(rest).take(7).count();
    if let Some(problem) = numbers(rest, &mut v, 3) {
        report(problem);
    }
    let [x, y, z, a, b, c] = v;
    match n {
        ..=2 => ([f64::NAN; 3], WHITE),
        4 => ([x / a, y / a, z / a], WHITE),
        6 => ([x, y, z], [a, b, c]),
        _ => ([x, y, z], WHITE),
    }
}

/// Converts an index that counts from 1 or, if negative, back from the newest, to an index from 0.
fn resolve(part: &str, so_far: usize, total: usize) -> Result<usize, LineProblem> {
    let ix: i64 = part.parse().map_err(|_| LineProblem::Corner)?;
    let from_zero = if ix < 0 {
        // There are at most isize::MAX lines.
        (so_far as i64).checked_add(ix)
    } else {
        ix.checked_sub(1)
    };
    from_zero
        .and_then(|ix| usize::try_from(ix).ok())
        .filter(|&ix| ix < total)
        .ok_or(LineProblem::Index)
}
