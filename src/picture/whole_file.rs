//! Files written whole or not at all.

use std::fs::{File, OpenOptions};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

/// Writes a file so that a reader finds the old content or the new, never a part: `fill` writes a
/// temporary file in the same folder, which is flushed to the disk and renamed over `path`.
///
/// If anything fails, the temporary is removed and whatever stood at `path` stays. (A process that is
/// killed can leave the temporary behind: `.NAME.<process>-<number>.tmp`.)
///
/// # Errors
/// What `fill` or the system said; where the folder is missing or not writable the message says so.
pub fn write_whole_file<E: From<io::Error>>(
    path: &Path,
    fill: impl FnOnce(&mut BufWriter<File>) -> Result<(), E>,
) -> Result<(), E> {
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

/// A temporary file, removed when it goes out of scope unless it is `done`.
struct Temporary {
    path: PathBuf,
    done: bool,
}

impl Temporary {
    fn create(target: &Path) -> io::Result<(Self, File)> {
        static NUMBER: AtomicU64 = AtomicU64::new(0);
        let Some(name) = target.file_name() else {
            return Err(io::Error::new(io::ErrorKind::InvalidInput, "it names no file"));
        };
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
        loop {
            let mut temporary_name = std::ffi::OsString::from(".");
            temporary_name.push(name);
            let number = NUMBER.fetch_add(1, Ordering::Relaxed);
            temporary_name.push(format!(".{}-{number}.tmp", std::process::id()));
            let path = folder.join(temporary_name);
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
