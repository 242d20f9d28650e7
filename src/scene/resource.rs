// SPDX-License-Identifier: MIT OR Apache-2.0
//! Bytes that a scene names: files in its folder, and data URIs.

use std::fs::File;
use std::io::Read;
use std::path::{Component, Path, PathBuf};

use super::error::{ResourceError, short};
use super::limits::Budget;

/// Reads a file whole, if it is a regular one and fits the budget.
pub(super) fn read_file(path: &Path, budget: &mut Budget) -> Result<Vec<u8>, ResourceError> {
    let name = || path.display().to_string();
    let io = |source| ResourceError::Io { path: name(), source };
    // Asked before opening: to open a pipe would wait for its writer.
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
    // The file may have grown since: one byte past the budget tells.
    file.take(left.saturating_add(1)).read_to_end(&mut bytes).map_err(io)?;
    let len = bytes.len() as u64;
    budget.take(len, 1, "file").map_err(|_| too_long(len))?;
    Ok(bytes)
}

/// Reads what a glTF URI names: a data URI, or a file in the scene's folder.
pub(super) fn read_uri(
    uri: &str,
    folder: Option<&Path>,
    budget: &mut Budget,
) -> Result<Vec<u8>, ResourceError> {
    if let Some(data) = strip_prefix_ignore_case(uri, "data:") {
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
        return decode_base64(base64.as_bytes());
    }
    if let Some(scheme) = scheme(uri) {
        return Err(ResourceError::Scheme { uri: short(uri), scheme: short(scheme) });
    }
    read_beside(&decode_percent(uri)?, folder, budget)
}

/// Reads a file named relative to the scene's folder. Paths that leave the folder are refused,
/// by their text and, for symbolic links, by where they lead.
pub(super) fn read_beside(
    name: &str,
    folder: Option<&Path>,
    budget: &mut Budget,
) -> Result<Vec<u8>, ResourceError> {
    let path = resolve(name, folder)?;
    read_file(&path, budget)
}

fn resolve(name: &str, folder: Option<&Path>) -> Result<PathBuf, ResourceError> {
    // Exporters on Windows write `\`.
    let name = name.replace('\\', "/");
    let outside = || ResourceError::Outside { path: short(&name) };
    let folder = folder.ok_or_else(|| ResourceError::NoFolder { path: short(&name) })?;
    if name.contains('\0') || scheme(&name).is_some() {
        return Err(outside());
    }
    // Put together by components: Windows' canonical paths take no `/` and no `..`.
    let mut relative = PathBuf::new();
    for component in Path::new(&name).components() {
        match component {
            Component::Normal(part) => relative.push(part),
            Component::CurDir => {}
            Component::ParentDir if relative.pop() => {}
            _ => return Err(outside()),
        }
    }
    let io = |source| ResourceError::Io { path: short(&name), source };
    let folder = folder.canonicalize().map_err(io)?;
    let path = folder.join(relative).canonicalize().map_err(io)?;
    if path.starts_with(&folder) { Ok(path) } else { Err(outside()) }
}

/// What stands before a URI's first colon, if that can be a scheme (or a drive letter).
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

fn decode_base64(text: &[u8]) -> Result<Vec<u8>, ResourceError> {
    let value = |c: u8| match c {
        b'A'..=b'Z' => Some(c - b'A'),
        b'a'..=b'z' => Some(c - b'a' + 26),
        b'0'..=b'9' => Some(c - b'0' + 52),
        b'+' => Some(62),
        b'/' => Some(63),
        _ => None,
    };
    let n_padding = text.iter().rev().take_while(|&&c| c == b'=').count();
    let body = &text[..text.len() - n_padding];
    // A lone last digit holds no whole byte; more than two `=` are never needed.
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
    fn percent() {
        assert_eq!(decode_percent("a%20b").ok().as_deref(), Some("a b"));
        assert!(decode_percent("a%2").is_err());
        assert!(decode_percent("a%zz").is_err());
        assert!(decode_percent("%ff").is_err());
    }
}
