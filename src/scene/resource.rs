// SPDX-License-Identifier: MIT OR Apache-2.0
//! Bytes that a scene names: files in its folder, and data URIs.

use std::borrow::Cow;
use std::collections::HashMap;
use std::ffi::OsString;
use std::fs::File;
use std::io::Read;
use std::path::{Component, Path, PathBuf};

use unicode_normalization::UnicodeNormalization;

use super::error::{ResourceError, Warning, Warnings, short};
use super::limits::Budget;

/// Reads a whole file, if it is a regular file and fits the budget.
pub(super) fn read_file(path: &Path, budget: &mut Budget) -> Result<Vec<u8>, ResourceError> {
    let name = || path.display().to_string();
    let io = |source| ResourceError::Io { path: name(), source };
    // Checked before opening, because opening a pipe would wait for its writer.
    if !std::fs::metadata(path).map_err(io)?.is_file() {
        return Err(ResourceError::NotAFile { path: name() });
    }
    let file = File::open(path).map_err(io)?;
    let len = file.metadata().map_err(io)?.len();
    let left = budget.left();
    let too_long = |len| ResourceError::TooLong { path: name(), len, left };
    if len > left {
        return Err(too_long(len));
    }
    let mut bytes = Vec::with_capacity(usize::try_from(len).map_err(|_| too_long(len))?);
    // The file may have grown since; one byte beyond the budget shows this.
    file.take(left.saturating_add(1)).read_to_end(&mut bytes).map_err(io)?;
    let len = bytes.len() as u64;
    budget.take(len, 1, "file").map_err(|_| too_long(len))?;
    Ok(bytes)
}

/// A file that a scene names.
pub(super) struct Found {
    path: PathBuf,
    /// The folder that it is in, relative to the scene's.
    pub folder: PathBuf,
    /// Its name in the folder, if the scene spells it differently.
    called: Option<String>,
}

/// Finds and reads the files that a scene names.
pub(super) struct Files<'a> {
    /// The scene's folder; without one, no file is found.
    folder: Option<&'a Path>,
    /// Names in a folder, each with its [`folded`] form. Read only once, because a scene may name many files.
    listings: HashMap<PathBuf, Vec<(String, OsString)>>,
}

impl<'a> Files<'a> {
    pub fn new(folder: Option<&'a Path>) -> Self {
        Self { folder, listings: HashMap::new() }
    }

    /// Reads the data of a glTF URI: a data URI, or a file in the scene's folder. `at` is the place that names it.
    pub fn read_uri(
        &mut self,
        uri: &str,
        at: &str,
        budget: &mut Budget,
        warnings: &mut Warnings,
    ) -> Result<Vec<u8>, ResourceError> {
        if let Some(data) = strip_prefix_ignore_case(uri, "data:") {
            return read_data(data, budget);
        }
        if let Some(scheme) = scheme(uri) {
            return Err(ResourceError::Scheme { uri: short(uri), scheme: short(scheme) });
        }
        let found = self.find_uri(uri)?;
        read(&found, uri, at, budget, warnings)
    }

    /// A URI should be percent-encoded, but some exporters write the plain name. So if the decoded name is invalid or
    /// does not exist, the unchanged text is tried, and the text before a query or fragment.
    fn find_uri(&mut self, uri: &str) -> Result<Found, ResourceError> {
        let here = Path::new("");
        let decoded = decode_percent(uri).and_then(|name| self.find(&name, here));
        let first = match decoded {
            Err(e @ (ResourceError::Io { .. } | ResourceError::Percent { .. })) => e,
            other => return other,
        };
        if let Ok(found) = self.find(uri, here) {
            return Ok(found);
        }
        let plain = uri.split(['?', '#']).next();
        plain
            .filter(|plain| !plain.is_empty() && plain.len() < uri.len())
            .and_then(|plain| decode_percent(plain).ok())
            .and_then(|plain| self.find(&plain, here).ok())
            .ok_or(first)
    }

    /// Finds a file named relative to `base`, which is relative to the scene's folder. Paths that leave the scene's
    /// folder are rejected, by their text and, for symbolic links, by their target. A name may differ from the file's
    /// in case, or in the encoding of accents.
    pub fn find(&mut self, name: &str, base: &Path) -> Result<Found, ResourceError> {
        // Exporters on Windows write `\`.
        let name = name.replace('\\', "/");
        let outside = || ResourceError::Outside { path: short(&name) };
        let io = |source| ResourceError::Io { path: short(&name), source };
        let folder = self.folder.ok_or_else(|| ResourceError::NoFolder { path: short(&name) })?;
        if name.contains('\0') || scheme(&name).is_some() {
            return Err(outside());
        }
        let folder = folder.canonicalize().map_err(io)?;
        // Joined by components, because Windows' canonical paths allow no `/` and no `..`.
        let mut path = folder.join(base);
        for component in Path::new(&name).components() {
            match component {
                Component::Normal(part) => path.push(part),
                Component::CurDir => {}
                // It may leave the folder and come back; only its end matters.
                Component::ParentDir if path.pop() => {}
                _ => return Err(outside()),
            }
        }
        let relative = path.strip_prefix(&folder).map_err(|_| outside())?.to_owned();
        let (path, relative, called) = match path.canonicalize() {
            Ok(path) => (path, relative, None),
            Err(e) => {
                let spelled = self.spelled(&folder, &relative).ok_or_else(|| io(e))?;
                let called = spelled.display().to_string();
                (folder.join(&spelled).canonicalize().map_err(io)?, spelled, Some(called))
            }
        };
        if !path.starts_with(&folder) {
            return Err(outside());
        }
        let folder = relative.parent().map(Path::to_owned).unwrap_or_default();
        Ok(Found { path, folder, called })
    }

    /// The path with each part spelled as in the file system.
    fn spelled(&mut self, folder: &Path, relative: &Path) -> Option<PathBuf> {
        let mut spelled = PathBuf::new();
        for part in relative.components() {
            let parent = folder.join(&spelled);
            if parent.join(part).exists() {
                spelled.push(part);
                continue;
            }
            let wanted = folded(part.as_os_str().to_str()?);
            let names = self.listings.entry(parent).or_insert_with_key(|parent| list(parent));
            let first = names.partition_point(|(folded, _)| *folded < wanted);
            let (_, name) = names.get(first).filter(|(folded, _)| *folded == wanted)?;
            spelled.push(name);
        }
        Some(spelled)
    }
}

/// Reads a file that was found; `name` is how the scene spells it, `at` the place that names it.
pub(super) fn read(
    found: &Found,
    name: &str,
    at: &str,
    budget: &mut Budget,
    warnings: &mut Warnings,
) -> Result<Vec<u8>, ResourceError> {
    if let Some(called) = &found.called {
        warnings.push(Warning::Value {
            at: at.to_owned(),
            problem: format!(
                "named `{}`, but the file is called `{}`; it is read",
                short(name),
                short(called)
            ),
        });
    }
    read_file(&found.path, budget)
}

/// The names in a folder, sorted. Empty if it cannot be read.
fn list(folder: &Path) -> Vec<(String, OsString)> {
    const MAX_NAMES: usize = 100_000;
    let mut names: Vec<_> = std::fs::read_dir(folder)
        .into_iter()
        .flatten()
        .take(MAX_NAMES)
        .filter_map(|entry| {
            let name = entry.ok()?.file_name();
            Some((folded(name.to_str()?), name))
        })
        .collect();
    names.sort();
    names
}

/// Lower case, with accents separated from their letters (NFD): names with the same form may mean the same file. macOS
/// separates accents, other systems store names as given.
fn folded(name: &str) -> String {
    name.nfd().flat_map(char::to_lowercase).collect()
}

fn read_data(data: &str, budget: &mut Budget) -> Result<Vec<u8>, ResourceError> {
    let (head, base64) = data.split_once(',').ok_or(ResourceError::DataUri)?;
    if !head.to_ascii_lowercase().ends_with(";base64") {
        return Err(ResourceError::DataUri);
    }
    let len = base64.len() as u64 / 4 * 3 + 3;
    let left = budget.left();
    budget.take(len, 1, "data URI").map_err(|_| ResourceError::TooLong {
        path: "data URI".to_owned(),
        len,
        left,
    })?;
    // A URI may encode any of its characters: `%3D` for `=`.
    let base64 = match base64.contains('%') {
        true => Cow::Owned(decode_percent(base64)?),
        false => Cow::Borrowed(base64),
    };
    decode_base64(base64.as_bytes())
}

/// The part before a URI's first colon, if it can be a scheme (or a drive letter).
fn scheme(uri: &str) -> Option<&str> {
    let (scheme, _) = uri.split_once(':')?;
    let mut chars = scheme.chars();
    let ok = chars.next()?.is_ascii_alphabetic()
        && chars.all(|c| c.is_ascii_alphanumeric() || matches!(c, '+' | '-' | '.'));
    ok.then_some(scheme)
}

fn strip_prefix_ignore_case<'a>(text: &'a str, prefix: &str) -> Option<&'a str> {
    let head = text.get(..prefix.len())?;
    head.eq_ignore_ascii_case(prefix).then(|| &text[prefix.len()..])
}

fn decode_percent(uri: &str) -> Result<String, ResourceError> {
    let broken = |byte| ResourceError::Percent { uri: short(uri), byte };
    let mut bytes = Vec::with_capacity(uri.len());
    let mut rest = uri.as_bytes();
    while let Some((&first, tail)) = rest.split_first() {
        let at = uri.len() - rest.len();
        if first == b'%' {
            let (hex, tail) = tail.split_at_checked(2).ok_or_else(|| broken(at))?;
            let digit = |c: u8| char::from(c).to_digit(16);
            let (high, low) = digit(hex[0]).zip(digit(hex[1])).ok_or_else(|| broken(at))?;
            bytes.push((high * 16 + low) as u8);
            rest = tail;
        } else {
            bytes.push(first);
            rest = tail;
        }
    }
    String::from_utf8(bytes).map_err(|e| broken(e.utf8_error().valid_up_to()))
}

/// Decodes RFC 4648 base64, also with the digits of its URL-safe alphabet (`-` and `_`).
fn decode_base64(text: &[u8]) -> Result<Vec<u8>, ResourceError> {
    let value = |c: u8| match c {
        b'A'..=b'Z' => Some(c - b'A'),
        b'a'..=b'z' => Some(c - b'a' + 26),
        b'0'..=b'9' => Some(c - b'0' + 52),
        b'+' | b'-' => Some(62),
        b'/' | b'_' => Some(63),
        _ => None,
    };
    let n_padding = text.iter().rev().take_while(|&&c| c == b'=').count();
    let body = &text[..text.len() - n_padding];
    // A single last digit is not a whole byte; more than two `=` are never needed.
    if n_padding > 2 || body.len() % 4 == 1 {
        return Err(ResourceError::Base64 { at: body.len() });
    }
    let mut out = Vec::with_capacity(body.len() / 4 * 3 + 2);
    for (group_ix, group) in body.chunks(4).enumerate() {
        let mut bits = 0u32;
        for (i, &c) in group.iter().enumerate() {
            let digit = value(c).ok_or(ResourceError::Base64 { at: group_ix * 4 + i })?;
            bits |= u32::from(digit) << (18 - 6 * i);
        }
        out.extend_from_slice(&bits.to_be_bytes()[1..group.len()]);
    }
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_published_vectors() {
        // RFC 4648, section 10.
        let cases = [
            ("", ""),
            ("Zg==", "f"),
            ("Zm8=", "fo"),
            ("Zm9v", "foo"),
            ("Zm9vYg==", "foob"),
            ("Zm9vYmE=", "fooba"),
            ("Zm9vYmFy", "foobar"),
            ("Zg", "f"),
            // Section 5: the URL-safe alphabet.
            ("Pz8/", "???"),
            ("Pz8_", "???"),
            ("Pj4+", ">>>"),
            ("Pj4-", ">>>"),
        ];
        for (text, expected) in cases {
            assert_eq!(
                decode_base64(text.as_bytes()).ok().as_deref(),
                Some(expected.as_bytes()),
                "{text}"
            );
        }
        for bad in ["A", "A===", "Zm9*", "Zm=v", "Zg== "] {
            assert!(decode_base64(bad.as_bytes()).is_err(), "{bad}");
        }
    }

    #[test]
    fn schemes() {
        for (uri, expected) in [
            ("http://a/b", Some("http")),
            ("C:/a", Some("C")),
            ("a/b.png", None),
            ("a b:c", None),
            ("1:2", None),
        ] {
            assert_eq!(scheme(uri), expected, "{uri}");
        }
    }

    #[test]
    fn data_uris() {
        let mut budget = Budget::new(&crate::scene::LoadLimits::default());
        let mut warnings = Warnings::default();
        for uri in ["data:;base64,Pz8+", "DATA:a/b;c=d;BASE64,Pz8-", "data:;base64,Pz8%2B"] {
            let read = Files::new(None).read_uri(uri, "", &mut budget, &mut warnings);
            assert_eq!(read.ok().as_deref(), Some(&b"??>"[..]), "{uri}");
        }
    }

    #[test]
    fn names_fold() {
        assert_eq!(folded("GRÜN.PNG"), folded("gru\u{308}n.png"));
        assert_eq!(folded("Čaj"), folded("c\u{30c}aj"));
        assert_ne!(folded("grün"), folded("grun"));
    }

    #[test]
    fn percent() {
        assert_eq!(decode_percent("a%20b").ok().as_deref(), Some("a b"));
        assert!(decode_percent("a%2").is_err());
        assert!(decode_percent("a%zz").is_err());
        assert!(decode_percent("%ff").is_err());
    }
}
