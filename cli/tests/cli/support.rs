// SPDX-License-Identifier: MIT OR Apache-2.0
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::sync::OnceLock;

/// The program with its input closed and nothing in the environment that changes its talk.
pub fn lucerna(arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_lucerna"));
    command.args(arguments).env_remove("RUST_LOG").stdin(Stdio::null());
    command
}

/// What a run gave.
pub struct Ran {
    pub code: Option<i32>,
    pub stdout: String,
    pub stderr: String,
    arguments: String,
}

impl Ran {
    pub fn new(arguments: &[&str], output: Output) -> Self {
        let text = |bytes: Vec<u8>| String::from_utf8(bytes).expect("the program speaks UTF-8");
        let ran = Self {
            code: output.status.code(),
            stdout: text(output.stdout),
            stderr: text(output.stderr),
            arguments: arguments.join(" "),
        };
        assert!(!ran.stderr.contains("panicked"), "{ran}");
        ran
    }

    /// Asserts the exit code.
    #[track_caller]
    pub fn exits(self, code: i32) -> Self {
        assert_eq!(self.code, Some(code), "{self}");
        self
    }

    /// Asserts that stderr has all of these.
    #[track_caller]
    pub fn says(self, parts: &[&str]) -> Self {
        for part in parts {
            assert!(self.stderr.contains(part), "not said: `{part}`\n{self}");
        }
        self
    }

    /// Asserts that there is no result.
    #[track_caller]
    pub fn gives_nothing(self) -> Self {
        assert_eq!(self.stdout, "", "{self}");
        self
    }
}

impl std::fmt::Display for Ran {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { code, stdout, stderr, arguments } = self;
        write!(f, "lucerna {arguments}\ncode {code:?}\nstdout:\n{stdout}\nstderr:\n{stderr}")
    }
}

#[track_caller]
pub fn run(arguments: &[&str]) -> Ran {
    Ran::new(arguments, lucerna(arguments).output().expect("the program starts"))
}

/// Whether there is an adapter to render with; a test without one has nothing to do. With
/// LUCERNA_REQUIRE_ADAPTER its lack is a failure. The first call also fills the driver's cache of
/// pipelines, so that tests at the same time do not all compile.
pub fn has_adapter() -> bool {
    static HAS: OnceLock<bool> = OnceLock::new();
    *HAS.get_or_init(|| {
        let doctor = run(&["doctor"]);
        if doctor.code != Some(0) {
            assert!(std::env::var_os("LUCERNA_REQUIRE_ADAPTER").is_none(), "{doctor}");
            eprintln!("skipped: {}", doctor.stderr);
            return false;
        }
        // Test runners start a process for each test: two may warm up at once.
        let folder = empty_folder(&format!("warm_up_{}", std::process::id()));
        let output = folder.join("warm.exr");
        run(&["reference", &cornell(), "--size=8x8", "--spp=1", "-o", path(&output)]).exits(0);
        true
    })
}

pub fn fixture(name: &str) -> String {
    path(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../fixtures").join(name)).to_owned()
}

pub fn cornell() -> String {
    fixture("scenes/cornell_original/cornell_original.gltf")
}

pub fn path(path: &Path) -> &str {
    path.to_str().expect("test folders are UTF-8")
}

/// An empty folder of this name.
pub fn empty_folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("cli").join(name);
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).unwrap();
    folder
}

/// Names of what lies in the folder, hidden files too.
pub fn names_in(folder: &Path) -> Vec<String> {
    let name = |entry: std::io::Result<std::fs::DirEntry>| entry.unwrap().file_name();
    let mut names: Vec<_> = std::fs::read_dir(folder)
        .unwrap()
        .map(|entry| name(entry).into_string().unwrap())
        .collect();
    names.sort();
    names
}
