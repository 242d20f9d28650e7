// SPDX-License-Identifier: MIT OR Apache-2.0
//! For tests of the tests (feature `testing`): what each test composes and runs, and faults planted into it.
//!
//! | environment variable | what |
//! |---|---|
//! | `LUCERNA_REPLACE_WGSL` | `wgsl/sh/basis.wgsl=OTHER`: the text of OTHER instead of that file's |
//! | `LUCERNA_TRACE_WGSL` | a folder: BINARY/TEST.txt lists the files that a test composes, and as FILE#ENTRY the entry points that it runs |

use std::borrow::Cow;
use std::collections::BTreeSet;
use std::fs::File;
use std::io::Write as _;
use std::path::PathBuf;
use std::sync::{Mutex, OnceLock, PoisonError};

/// The text of a file under `wgsl/`, or the one that replaces it.
pub(crate) fn text_of(file: &str, text: &'static str) -> Cow<'static, str> {
    match replaced() {
        Some((of, other)) if of == file => Cow::Borrowed(other),
        _ => Cow::Borrowed(text),
    }
}

/// Whether texts that were composed at build time will not do.
pub(crate) fn is_on() -> bool {
    replaced().is_some() || folder().is_some()
}

/// The file that is replaced, and the other text.
fn replaced() -> Option<&'static (String, String)> {
    static REPLACED: OnceLock<Option<(String, String)>> = OnceLock::new();
    let read = || {
        let value = std::env::var("LUCERNA_REPLACE_WGSL").ok()?;
        let Some((file, other)) = value.split_once('=') else {
            panic!("LUCERNA_REPLACE_WGSL is `{value}`, but must be FILE=OTHER")
        };
        let text = std::fs::read_to_string(other);
        let text = text.unwrap_or_else(|error| panic!("LUCERNA_REPLACE_WGSL: {other}: {error}"));
        Some((file.to_owned(), text))
    };
    REPLACED.get_or_init(read).as_ref()
}

fn folder() -> Option<&'static PathBuf> {
    static FOLDER: OnceLock<Option<PathBuf>> = OnceLock::new();
    let read = || {
        let folder = std::env::var_os("LUCERNA_TRACE_WGSL");
        folder.filter(|folder| !folder.is_empty()).map(PathBuf::from)
    };
    FOLDER.get_or_init(read).as_ref()
}

/// Adds lines to the running test's file, each once.
pub(crate) fn trace(lines: impl Iterator<Item = String>) {
    static KNOWN: Mutex<BTreeSet<String>> = Mutex::new(BTreeSet::new());
    let Some(folder) = folder() else { return };
    let folder = folder.join(binary_name());
    let name = test_name();
    let mut known = KNOWN.lock().unwrap_or_else(PoisonError::into_inner);
    let fresh: Vec<String> = lines
        .filter(|line| known.insert(format!("{name} {line}")))
        .map(|line| line + "\n")
        .collect();
    let written = std::fs::create_dir_all(&folder).and_then(|()| {
        let file = folder.join(format!("{name}.txt"));
        File::options().create(true).append(true).open(file)?.write_all(fresh.concat().as_bytes())
    });
    written.unwrap_or_else(|error| panic!("LUCERNA_TRACE_WGSL: {}: {error}", folder.display()));
}

/// The running program's name without cargo's hash of the build.
pub(crate) fn binary_name() -> String {
    let binary = std::env::current_exe().unwrap_or_default();
    let binary = binary.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    binary.rsplit_once('-').map_or(binary.as_str(), |(target, _)| target).to_owned()
}

/// The running test's name as a file's: test runners name the thread after it, or pass it as an argument.
pub(crate) fn test_name() -> String {
    let thread = std::thread::current();
    let name = thread.name().filter(|name| *name != "main").map(str::to_owned);
    let mut arguments = std::env::args().skip_while(|argument| argument != "--exact").skip(1);
    let name = name.or_else(|| arguments.next()).unwrap_or_else(|| "main".into());
    name.replace("::", ".").replace(|c: char| !c.is_alphanumeric() && !"._-".contains(c), "_")
}
