// SPDX-License-Identifier: MIT OR Apache-2.0
//! Files that are written completely or not at all.

use std::fs::{File, OpenOptions};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

/// Writes a file so that a reader finds either the old content or the new, never a part of it. `fill` writes a
/// temporary file in the same folder, which is flushed to the disk and renamed to `path`.
///
/// If `path` is a symbolic link, its target is written, and the link stays.
///
/// If anything fails, the temporary file is removed, and the old content of `path` stays. (A process that is killed can
/// leave the temporary file behind: `.lucerna-<process>-<number>.tmp`.)
///
/// # Errors
/// The error of `fill` or of the system; if the folder is missing or not writable, the message says so.
pub fn write_whole_file<E: From<io::Error>>(
    path: &Path,
    fill: impl FnOnce(&mut BufWriter<File>) -> Result<(), E>,
) -> Result<(), E> {
    let path = &follow_links(path)?;
    let (mut temporary, file) = Temporary::create(path)?;
    let mut writer = BufWriter::new(file);
    fill(&mut writer)?;
    writer.flush()?;
    writer.get_ref().sync_all()?;
    // Closed before the rename: some systems refuse to move an open file.
    drop(writer);
    std::fs::rename(&temporary.path, path)?;
    temporary.done = true;
    Ok(())
}

/// The target of symbolic links, which need not exist yet.
fn follow_links(path: &Path) -> io::Result<PathBuf> {
    // As many as Linux follows.
    const MAX_LINKS: u32 = 40;
    let mut path = path.to_owned();
    for _ in 0..MAX_LINKS {
        match std::fs::read_link(&path) {
            // A relative link is relative to its own folder.
            Ok(target) => path = path.parent().unwrap_or(Path::new("")).join(target),
            // Not a link, or nothing there.
            Err(_) => return Ok(path),
        }
    }
    Err(io::Error::other("its symbolic links form a cycle"))
}

/// Fails if [`write_whole_file`] could not even start: the folder is missing or not writable, or the system does not
/// accept the name. Leaves nothing behind.
///
/// # Errors
/// The system's error.
pub fn check_whole_file(path: &Path) -> io::Result<()> {
    let path = follow_links(path)?;
    // The name itself may be too long, or have characters that the system does not accept; a query shows this.
    match std::fs::symlink_metadata(&path) {
        Err(error) if !is_absence(&error) => return Err(error),
        _ => {}
    }
    // Only an attempt shows it: permissions, read-only disks and special folders differ by system.
    Temporary::create(&path).map(|_| ())
}

/// Whether the file does not exist, or its folder is not a folder.
fn is_absence(error: &io::Error) -> bool {
    matches!(error.kind(), io::ErrorKind::NotFound | io::ErrorKind::NotADirectory)
}

/// A temporary file, removed when it goes out of scope unless it is `done`.
struct Temporary {
    path: PathBuf,
    done: bool,
}

impl Temporary {
    fn create(target: &Path) -> io::Result<(Self, File)> {
        static NUMBER: AtomicU64 = AtomicU64::new(0);
        if target.file_name().is_none() {
            return Err(io::Error::new(io::ErrorKind::InvalidInput, "it does not name a file"));
        }
        if target.is_dir() {
            return Err(io::Error::new(
                io::ErrorKind::IsADirectory,
                "it is a folder; name a file in it",
            ));
        }
        let folder = match target.parent() {
            Some(folder) if !folder.as_os_str().is_empty() => folder,
            _ => Path::new("."),
        };
        if !folder.is_dir() {
            let text = format!("there is no folder {}", folder.display());
            return Err(io::Error::new(io::ErrorKind::NotFound, text));
        }
        loop {
            // A short name, because the target's may already be as long as the system allows.
            let number = NUMBER.fetch_add(1, Ordering::Relaxed);
            let path = folder.join(format!(".lucerna-{}-{number}.tmp", std::process::id()));
            match OpenOptions::new().write(true).create_new(true).open(&path) {
                Ok(file) => return Ok((Self { path, done: false }, file)),
                Err(e) if e.kind() == io::ErrorKind::AlreadyExists => {}
                Err(e) => {
                    let text =
                        format!("cannot create a file in the folder {}: {e}", folder.display());
                    return Err(io::Error::new(e.kind(), text));
                }
            }
        }
    }
}

impl Drop for Temporary {
    fn drop(&mut self) {
        if !self.done {
            // An error is already on its way, so there is nothing else to do.
            let _ = std::fs::remove_file(&self.path);
        }
    }
}
