// SPDX-License-Identifier: MIT OR Apache-2.0
//! Names of files and materials on a line. They may contain blanks, may be quoted, and a comment
//! may follow; the format has no rule to tell these apart.

use std::ops::Range;

/// The text before a comment: before the first word, except the first of all, that starts with `#`.
pub(super) fn before_comment(text: &str) -> &str {
    let is_start = |&(i, c): &(usize, char)| {
        c == '#' && text[..i].ends_with(|c: char| c.is_ascii_whitespace())
    };
    match text.char_indices().find(is_start) {
        Some((start, _)) => text[..start].trim_end(),
        None => text,
    }
}

/// A material's name without what is certainly a comment: 3ds Max calls materials `Material #25`.
pub(super) fn material_name(text: &str) -> &str {
    let name = before_comment(text);
    let rest = text[name.len()..].trim_start();
    let is_comment = rest[rest.len().min(1)..].starts_with(|c: char| c.is_ascii_whitespace());
    if rest == "#" || is_comment { name } else { text }
}

fn unquoted(text: &str) -> Option<&str> {
    ['"', '\''].into_iter().find_map(|quote| {
        let inner = text.strip_prefix(quote)?.strip_suffix(quote)?;
        (!inner.contains(quote)).then_some(inner)
    })
}

/// The possible readings of a name, the likeliest first.
pub(super) fn readings(text: &str) -> Vec<&str> {
    let before = before_comment(text);
    let mut readings = vec![text];
    readings.extend(unquoted(text));
    if before != text {
        readings.push(before);
        readings.extend(unquoted(before));
    }
    readings
}

/// The libraries that the text of a `mtllib` names: one name if there is such a file, or else as
/// few names as possible that all exist. A part that does not exist is assumed to end in `.mtl`.
pub(super) fn libraries<'a>(text: &'a str, exists: &mut dyn FnMut(&str) -> bool) -> Vec<&'a str> {
    /// The number of splits that are tried grows with the square of the number of words.
    const MAX_WORDS: usize = 16;
    const MISSING: usize = 1000;

    if let Some(whole) = readings(text).into_iter().find(|name| exists(name)) {
        return vec![whole];
    }
    let words = words(before_comment(text));
    let ends_in_mtl: Vec<bool> = words
        .iter()
        .map(|word| text[word.range.clone()].to_ascii_lowercase().ends_with(".mtl"))
        .collect();
    if words.is_empty() {
        return vec![text];
    }
    let name = |from: usize, to: usize| &text[words[from].range.start..words[to - 1].range.end];
    // The least cost of the first `to` words, and where their last name starts.
    let mut best = vec![(0, 0)];
    for to in 1..=words.len() {
        let ends_here = to == words.len() || words[to].quoted || ends_in_mtl[to - 1];
        let froms = (to.saturating_sub(MAX_WORDS)..to).rev();
        let candidates = froms.filter_map(|from| {
            let part = &words[from..to];
            if part.len() > 1 && part.iter().any(|word| word.quoted) {
                return None;
            }
            let inside = ends_in_mtl[from..to - 1].contains(&true);
            let cost = if words.len() <= MAX_WORDS && exists(name(from, to)) {
                1
            } else if part.len() == 1 && part[0].quoted || (ends_here && !inside) {
                MISSING
            } else {
                // A remainder that nothing explains.
                MISSING * (1 + part.len())
            };
            Some((best[from].0 + cost, from))
        });
        best.push(candidates.min().unwrap_or((usize::MAX / 2, to - 1)));
    }
    let mut names = Vec::new();
    let mut to = words.len();
    while to > 0 {
        let from = best[to].1;
        names.push(name(from, to));
        to = from;
    }
    names.reverse();
    names
}

struct Word {
    /// Without the quotes.
    range: Range<usize>,
    quoted: bool,
}

/// Words between blanks; quotes hold one together.
fn words(text: &str) -> Vec<Word> {
    let mut words = Vec::new();
    let mut at = 0;
    loop {
        at += text[at..].len() - text[at..].trim_start().len();
        let rest = &text[at..];
        let Some(first) = rest.chars().next() else {
            return words;
        };
        let closing = matches!(first, '"' | '\'').then(|| rest[1..].find(first)).flatten();
        let (range, end, quoted) = match closing {
            Some(len) => (at + 1..at + 1 + len, at + len + 2, true),
            None => {
                let len = rest.find(|c: char| c.is_ascii_whitespace()).unwrap_or(rest.len());
                (at..at + len, at + len, false)
            }
        };
        words.push(Word { range, quoted });
        at = end;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn split(text: &str, files: &[&str], expected: &[&str]) {
        assert_eq!(libraries(text, &mut |name| files.contains(&name)), expected, "{text}");
    }

    #[test]
    fn libraries_on_one_line() {
        split("a.mtl", &["a.mtl"], &["a.mtl"]);
        split("a.mtl b.mtl", &["a.mtl", "b.mtl"], &["a.mtl", "b.mtl"]);
        // A file of that very name comes first.
        split("a.mtl b.mtl", &["a.mtl", "b.mtl", "a.mtl b.mtl"], &["a.mtl b.mtl"]);
        split("my a.mtl your  b.mtl", &["my a.mtl", "your  b.mtl"], &["my a.mtl", "your  b.mtl"]);
        // As few as possible.
        split("a b c", &["a", "b", "c", "a b"], &["a b", "c"]);
        split("\"my a.mtl\" b.mtl", &["my a.mtl", "b.mtl"], &["my a.mtl", "b.mtl"]);
        split("\"my a.mtl\"", &["my a.mtl"], &["my a.mtl"]);
        split("a.mtl # both", &["a.mtl"], &["a.mtl"]);
        split("a.mtl b.mtl # both", &["a.mtl", "b.mtl"], &["a.mtl", "b.mtl"]);
    }

    #[test]
    fn libraries_that_do_not_exist() {
        split("a.mtl b.mtl", &[], &["a.mtl", "b.mtl"]);
        split("a.mtl b.mtl", &["b.mtl"], &["a.mtl", "b.mtl"]);
        split("my a.mtl b.mtl", &["b.mtl"], &["my a.mtl", "b.mtl"]);
        split("my a.mtl", &[], &["my a.mtl"]);
        split("my library", &[], &["my library"]);
        split("", &[], &[""]);
        split("'x", &[], &["'x"]);
        let many = "a.mtl ".repeat(1000);
        assert_eq!(libraries(many.trim(), &mut |_| false).len(), 1000);
    }

    #[test]
    fn comments() {
        assert_eq!(material_name("red # paint"), "red");
        assert_eq!(material_name("red #"), "red");
        assert_eq!(material_name("Material #25"), "Material #25");
        assert_eq!(material_name("#25"), "#25");
        assert_eq!(before_comment("Material #25"), "Material");
        assert_eq!(before_comment("a#b"), "a#b");
        assert_eq!(readings("\"a b.png\" # c"), ["\"a b.png\" # c", "\"a b.png\"", "a b.png"]);
    }
}
