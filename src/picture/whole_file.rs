// SPDX-License-Identifier: MIT OR Apache-2.0
//! Files written whole or not at all.

use std::fs::{File, OpenOptions};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

/// Writes a file so that a reader finds the old content or the new, never a part: `fill` writes a
/// temporary file in the same folder, which is flushed to the disk and renamed over `path`.
///
/// If `path` is a symbolic link, the file that it leads to is written, and the link stays.
///
/// If anything fails, the temporary is removed and whatever stood at `path` stays. (A process that is
/// killed can leave the temporary behind: `.lucerna-<process>-<number>.tmp`.)
///
/// # Errors
/// What `fill` or the system said; where the folder is missing or not writable the message says so.
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

/// Where symbolic links lead to, though no file may stand there yet.
fn follow_links(path: &Path) -> io::Result<PathBuf> {
    // As many as Linux follows.
    const MAX_LINKS: u32 = 40;
    let mut path = path.to_owned();
    for _ in 0..MAX_LINKS {
        match std::fs::read_link(&path) {
            // A relative link counts from its own folder.
            Ok(target) => path = path.parent().unwrap_or(Path::new("")).join(target),
            // Not a link, or nothing there.
            Err(_) => return Ok(path),
        }
    }
    Err(io::Error::other("its symbolic links lead in a circle"))
}

/// Fails where [`write_whole_file`] would fail to begin: the folder is missing or takes no files, or the system does not take
/// the name. Leaves nothing behind.
///
/// # Errors
/// What the system said.
pub fn check_whole_file(path: &Path) -> io::Result<()> {
    let path = follow_links(path)?;
    // The name itself may be too long or hold what the system does not take; asking about it tells.
    match std::fs::symlink_metadata(&path) {
        Err(error) if !is_absence(&error) => return Err(error),
        _ => {}
    }
    // Only trying tells: permissions, read-only disks and special folders differ by system.
    Temporary::create(&path).map(|_| ())
}

/// Whether nothing stands there, or what its folder would be is no folder.
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
            return Err(io::Error::new(io::ErrorKind::InvalidInput, "it names no file"));
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
            // Short, whatever the target's name: that may have all the length that the system takes.
            let number = NUMBER.fetch_add(1, Ordering::Relaxed);
            let path = folder.join(format!(".lucerna-{}-{number}.tmp", std::process::id()));
            match OpenOptions::new().write(true).create_new(true).open(&path) {
                Ok(file) => return Ok((Self { path, done: false }, file)),
                Err(e) if e.kind() == io::ErrorKind::AlreadyExists => {}
                Err(e) => {
                    let text =
                        format!("no file can be made in the folder {}: {e}", folder.display());
                    return Err(io::Error::new(e.kind(), text));
                }
            }
        }
    }
}

impl Drop for Temporary {
    fn drop(&mut self) {
        if !self.done {
            // Nothing better can be done on the way out of an error.
            let _ = std::fs::remove_file(&self.path);
        }
    }
}
