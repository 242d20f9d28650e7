// SPDX-License-Identifier: MIT OR Apache-2.0
//! `docs/functions.md`: every function of every module, what it does, where it is from, and how many files it takes to lift it.
//!
//! The table is generated from the modules' comments. `LUCERNA_BLESS=1` writes it again.

use crate::own_tree::root;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;
use std::fs;
use std::path::Path;

const FILE: &str = "docs/functions.md";

/// A module-scope declaration of a module.
pub struct Named {
    pub name: String,
    /// 1-based.
    pub line: usize,
    /// Its `///` lines, without the slashes.
    doc: Vec<String>,
}

/// The declarations of a text that begin with one of these words.
pub fn declared(text: &str, words: &[&str]) -> Vec<Named> {
    let lines: Vec<_> = text.lines().collect();
    let mut out = Vec::new();
    for (ix, line) in lines.iter().enumerate() {
        let Some((word, rest)) = line.split_once(' ') else { continue };
        if !words.contains(&word) {
            continue;
        }
        let name = rest.split(|c: char| !(c.is_alphanumeric() || c == '_')).next().unwrap();
        let above = lines[..ix].iter().rev().skip_while(|line| line.starts_with('@'));
        let mut doc: Vec<_> = above
            .map_while(|line| line.strip_prefix("///"))
            .map(|line| line.trim().to_owned())
            .collect();
        doc.reverse();
        out.push(Named { name: name.to_owned(), line: ix + 1, doc });
    }
    out
}

/// Paragraphs of comment lines, each as one line.
fn paragraphs(lines: &[String]) -> Vec<String> {
    let mut out = vec![String::new()];
    for line in lines {
        let last = out.last_mut().unwrap();
        if line.is_empty() {
            out.push(String::new());
        } else {
            if !last.is_empty() {
                last.push(' ');
            }
            last.push_str(line);
        }
    }
    out.retain(|paragraph| !paragraph.is_empty());
    out
}

/// Whether the full stop at this byte ends a sentence: an initial's or an abbreviation's does not.
fn ends_sentence(text: &str, at: usize) -> bool {
    let word = text[..at].rsplit([' ', '(', '"', '-']).next().unwrap();
    let is_initial = word.len() == 1 && word.starts_with(|c: char| c.is_ascii_uppercase());
    let is_short = is_initial || ["al", "ed", "eq", "e.g", "i.e", "Rec"].contains(&word);
    !is_short && text[at + 1..].chars().next().is_none_or(|c| c.is_whitespace() || c == ')')
}

/// The first sentence of a comment, without the brackets of links.
fn purpose(doc: &[String]) -> String {
    let Some(first) = paragraphs(doc).into_iter().next() else { return String::new() };
    let end = first.match_indices('.').map(|(at, _)| at).find(|&at| ends_sentence(&first, at));
    let sentence = &first[..end.unwrap_or(first.len())];
    sentence.trim_end_matches(':').replace("[`", "`").replace("`]", "`")
}

/// The four digits of a year that begin here.
fn year(text: &str) -> Option<&str> {
    let digits = text.get(..4).filter(|of| of.bytes().all(|b| b.is_ascii_digit()))?;
    let ends = text[4..].chars().next().is_none_or(|c| !c.is_alphanumeric());
    (ends && (digits.starts_with("19") || digits.starts_with("20"))).then_some(digits)
}

/// The names at the end of a text: `M. Pharr, W. Jakob` of `Source: M. Pharr, W. Jakob,`.
fn authors(before: &str) -> String {
    let is_initial = |word: &str| {
        word.len() >= 2 && word.ends_with('.') && word.starts_with(|c: char| c.is_uppercase())
    };
    let mut names = Vec::new();
    for piece in before.trim_end_matches([' ', ',']).rsplit(", ") {
        // What stands before the first initial belongs to the sentence.
        let last = piece.rsplit([':', ';', '(']).next().unwrap().trim_start();
        let words: Vec<_> = last.split(' ').collect();
        let Some(first) = words.iter().position(|word| is_initial(word)) else { break };
        names.push(words[first..].join(" "));
        if first > 0 || last.len() < piece.len() {
            break;
        }
    }
    names.reverse();
    names.join(", ")
}

/// Papers (authors, "Title", … year) and specifications that a comment names.
fn sources(lines: &[String]) -> Vec<String> {
    let mut out = Vec::new();
    for text in paragraphs(lines) {
        let quotes: Vec<_> = text.match_indices('"').map(|(at, _)| at).collect();
        for pair in quotes.chunks_exact(2) {
            let title = &text[pair[0] + 1..pair[1]];
            let after = &text[pair[1]..];
            let found = after.char_indices().take(90).find_map(|(at, c)| {
                let starts =
                    c.is_ascii_digit() && !after[..at].ends_with(|c: char| c.is_alphanumeric());
                starts.then(|| year(&after[at..])).flatten()
            });
            let Some(year) = found else { continue };
            let mut authors = authors(&text[..pair[0]]);
            if !authors.is_empty() {
                authors.push_str(", ");
            }
            out.push(format!("{authors}*{}*, {year}", title.trim_end_matches(',')));
        }
        for name in ["glTF 2.0 §", "OpenGL 4.6 §"] {
            for (at, _) in text.match_indices(name) {
                let number = text[at + name.len()..].split([' ', ')', ',', ';', ':']).next();
                out.push(format!("{name}{}", number.unwrap_or_default().trim_end_matches('.')));
            }
        }
        for name in ["KHR_lights_punctual", "EXT_texture_shared_exponent"] {
            if text.contains(name) {
                out.push(name.to_owned());
            }
        }
    }
    let mut seen = BTreeSet::new();
    out.retain(|source| seen.insert(source.clone()));
    out.truncate(3);
    out
}

/// How many files a module needs, itself included.
fn n_files(import_path: &str, imports: &BTreeMap<&str, &[&str]>) -> usize {
    let mut known = BTreeSet::new();
    let mut left = vec![import_path.to_owned()];
    while let Some(path) = left.pop() {
        if known.insert(path.clone()) {
            left.extend(imports[path.as_str()].iter().map(|&of| of.to_owned()));
        }
    }
    known.len()
}

/// Rust files under `tests/`, as `kernels/bsdf.rs`, with their texts.
fn tests() -> Vec<(String, String)> {
    let mut out = Vec::new();
    for folder in fs::read_dir(root().join("tests")).unwrap() {
        let folder = folder.unwrap().path();
        for file in fs::read_dir(&folder).into_iter().flatten() {
            let path = file.unwrap().path();
            if path.extension().is_some_and(|ending| ending == "rs") {
                let name = |path: &Path| path.file_name().unwrap().to_str().unwrap().to_owned();
                let text = fs::read_to_string(&path).unwrap();
                out.push((format!("{}/{}", name(&folder), name(&path)), text));
            }
        }
    }
    out.sort();
    out
}

fn has_word(text: &str, word: &str) -> bool {
    let is_word = |c: char| c.is_alphanumeric() || c == '_';
    text.match_indices(word).any(|(at, _)| {
        !text[..at].ends_with(is_word) && !text[at + word.len()..].starts_with(is_word)
    })
}

/// What the file is to hold.
fn table() -> String {
    let modules: Vec<_> = lucerna::modules().iter().filter(|m| m.overlay.is_none()).collect();
    let imports = modules.iter().map(|m| (m.import_path, m.imports)).collect();
    let tests = tests();
    let mut folders: BTreeMap<String, Vec<String>> = BTreeMap::new();
    for module in modules {
        let inner = module.file.strip_prefix("wgsl/").unwrap();
        let (folder, name) = inner.rsplit_once('/').unwrap();
        let header = module.source.lines().filter_map(|line| line.strip_prefix("//!"));
        let header: Vec<_> = header.map(|line| line.trim().to_owned()).collect();
        let n_files = n_files(module.import_path, &imports);
        for function in declared(module.source, &["fn"]) {
            let mut from = sources(&function.doc);
            if from.is_empty() {
                from = sources(&header);
            }
            let tested: Vec<_> = tests
                .iter()
                .filter(|(_, text)| {
                    text.contains(module.import_path) && has_word(text, &function.name)
                })
                .map(|(file, _)| format!("[{file}](../tests/{file})"))
                .collect();
            let row = [
                format!("`{}`", function.name),
                purpose(&function.doc),
                from.join("; "),
                format!("[{name}](../{})", module.file),
                n_files.to_string(),
                tested.join(", "),
            ];
            let row = row.map(|cell| cell.replace('|', "\\|"));
            folders.entry(folder.to_owned()).or_default().push(format!("| {} |", row.join(" | ")));
        }
    }
    let mut out = String::from(
        "# Functions\n\n\
         Every function of every module under `wgsl/`, by folder. Kernels are left out, because they have no functions to reuse. \
         *Files*: how many files you need to lift the function, its own and all that it imports. *Tests*: where its numbers are \
         checked, by files under `tests/`.\n\n\
         The table is generated from the modules' comments: `LUCERNA_BLESS=1 cargo test --test shader_check functions` writes it, \
         and a test fails if it is out of date.\n",
    );
    for (folder, rows) in folders {
        write!(out, "\n## {folder}\n\n").unwrap();
        out.push_str("| function | what it does | source | file | files | tests |\n");
        out.push_str("|---|---|---|---|---|---|\n");
        for row in rows {
            out.push_str(&row);
            out.push('\n');
        }
    }
    out
}

#[test]
fn the_table_of_functions_is_current() {
    let table = table();
    let file = root().join(FILE);
    if std::env::var_os("LUCERNA_BLESS").is_some_and(|value| value == "1") {
        return fs::write(file, table).unwrap();
    }
    let held = fs::read_to_string(file).unwrap_or_default();
    let differ = held.lines().zip(table.lines()).position(|(a, b)| a != b);
    let line = differ.unwrap_or(held.lines().count().min(table.lines().count())) + 1;
    assert!(held == table, "{FILE}:{line} is not current: LUCERNA_BLESS=1 writes it anew");
}
