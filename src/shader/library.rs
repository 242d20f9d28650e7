use super::problem::{Problem, Rule};
use super::{KERNELS, ROOT, scan};
use naga::valid::Capabilities;
use naga_oil::compose::{
    ComposableModuleDescriptor, Composer, ComposerError, ComposerErrorInner, NagaModuleDescriptor,
    get_preprocessor_data,
};
use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// One WGSL file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Source {
    /// `lucerna::sh::basis` for `wgsl/sh/basis.wgsl`.
    pub import_path: String,
    /// The file's name in messages.
    pub file: PathBuf,
    /// The text, comments and all.
    pub text: Cow<'static, str>,
}

impl Source {
    /// Import paths of the modules that this file imports, sorted, each once.
    pub fn imports(&self) -> Vec<String> {
        let (_, imports, _) = get_preprocessor_data(&self.text);
        let set: BTreeSet<_> = imports.into_iter().map(|import| import.import).collect();
        set.into_iter().collect()
    }

    pub(super) fn problem(&self, rule: Rule, place: (u32, u32), message: String) -> Problem {
        Problem {
            file: self.file.clone(),
            line: place.0,
            column: place.1,
            rule,
            message,
            excerpt: None,
        }
    }

    fn place_of_import(&self, import_path: &str) -> (u32, u32) {
        scan::place_of(&self.text, &format!("#import {import_path}"))
    }
}

/// A set of modules by import path, from which kernels are composed.
#[derive(Clone, Debug, Default)]
pub struct Library {
    modules: BTreeMap<String, Source>,
}

impl Library {
    /// Reads every `.wgsl` file under `dir`; `dir/sh/basis.wgsl` becomes `lucerna::sh::basis`.
    /// Files that cannot be read come back as problems beside the library.
    pub fn read_dir(dir: &Path) -> (Self, Vec<Problem>) {
        let mut library = Self::default();
        let mut problems = Vec::new();
        library.read_into(dir, ROOT, &mut problems);
        (library, problems)
    }

    fn read_into(&mut self, dir: &Path, import_path: &str, problems: &mut Vec<Problem>) {
        let mut unreadable = |file: &Path, error: std::io::Error| {
            problems.push(Problem {
                file: file.to_owned(),
                line: 1,
                column: 1,
                rule: Rule::Read,
                message: format!("cannot be read: {error}"),
                excerpt: None,
            });
        };
        let entries = match std::fs::read_dir(dir).and_then(Iterator::collect::<Result<Vec<_>, _>>)
        {
            Ok(entries) => entries,
            Err(error) => return unreadable(dir, error),
        };
        let mut folders = Vec::new();
        for entry in entries {
            let path = entry.path();
            let Some(stem) = path.file_stem().and_then(|stem| stem.to_str()) else { continue };
            let name = format!("{import_path}::{stem}");
            if path.is_dir() {
                folders.push((path, name));
            } else if path.extension().is_some_and(|extension| extension == "wgsl") {
                match std::fs::read_to_string(&path) {
                    Ok(text) => {
                        self.insert(Source { import_path: name, file: path, text: text.into() })
                    }
                    Err(error) => unreadable(&path, error),
                }
            }
        }
        for (path, name) in folders {
            self.read_into(&path, &name, problems);
        }
    }

    /// Adds a module; one that has the same import path is replaced, which is how a renderer puts
    /// its own scene behind the host seam.
    pub fn insert(&mut self, source: Source) {
        self.modules.insert(source.import_path.clone(), source);
    }

    /// The module of that import path.
    pub fn get(&self, import_path: &str) -> Option<&Source> {
        self.modules.get(import_path)
    }

    /// All modules in the order of their import paths.
    pub fn iter(&self) -> impl Iterator<Item = &Source> {
        self.modules.values()
    }

    /// Takes out the modules that `keep` refuses.
    pub fn retain(&mut self, mut keep: impl FnMut(&Source) -> bool) {
        self.modules.retain(|_, source| keep(source));
    }

    /// Everything that `source` imports, directly or not, each before those that import it.
    ///
    /// # Errors
    /// All imports that name nothing, name a kernel, or run in a circle, at the import's place.
    pub fn dependencies(&self, source: &Source) -> Result<Vec<&Source>, Vec<Problem>> {
        let mut walk =
            Walk { library: self, done: Vec::new(), path: Vec::new(), problems: Vec::new() };
        walk.visit(source);
        if walk.problems.is_empty() { Ok(walk.done) } else { Err(walk.problems) }
    }

    /// Composes `source` with everything that it imports, and validates the whole under
    /// `capabilities` ([`BASELINE`](super::BASELINE) for plain WebGPU).
    ///
    /// # Errors
    /// What is wrong with the imports, or the first parse or validation error.
    pub fn compose(
        &self,
        source: &Source,
        capabilities: Capabilities,
    ) -> Result<naga::Module, Vec<Problem>> {
        let dependencies = self.dependencies(source)?;
        let mut composer = Composer::default().with_capabilities(capabilities);
        for module in dependencies {
            let added = composer.add_composable_module(ComposableModuleDescriptor {
                source: &module.text,
                file_path: &module.file.to_string_lossy(),
                as_name: Some(module.import_path.clone()),
                ..Default::default()
            });
            if let Err(error) = added {
                return Err(vec![problem_of(module, &error, &composer)]);
            }
        }
        composer
            .make_naga_module(NagaModuleDescriptor {
                source: &source.text,
                file_path: &source.file.to_string_lossy(),
                ..Default::default()
            })
            .map_err(|error| vec![problem_of(source, &error, &composer)])
    }
}

struct Walk<'a> {
    library: &'a Library,
    done: Vec<&'a Source>,
    path: Vec<String>,
    problems: Vec<Problem>,
}

impl<'a> Walk<'a> {
    fn visit(&mut self, source: &Source) {
        self.path.push(source.import_path.clone());
        for import in source.imports() {
            let place = source.place_of_import(&import);
            if import.starts_with(&format!("{ROOT}::{KERNELS}::")) {
                self.problems.push(source.problem(
                    Rule::KernelImported,
                    place,
                    format!("imports the kernel `{import}`; move what is shared into a module"),
                ));
            } else if let Some(start) = self.path.iter().position(|open| *open == import) {
                let circle = [&self.path[start..], std::slice::from_ref(&import)].concat();
                self.problems.push(source.problem(
                    Rule::ImportCycle,
                    place,
                    format!("imports run in a circle: {}", circle.join(" -> ")),
                ));
            } else if let Some(module) = self.library.get(&import) {
                if !self.done.iter().any(|done| done.import_path == import) {
                    self.visit(module);
                    self.done.push(module);
                }
            } else {
                self.problems.push(source.problem(
                    Rule::ImportMissing,
                    place,
                    format!("imports `{import}`, and there is no such module"),
                ));
            }
        }
        self.path.pop();
    }
}

/// Translates naga_oil's error; its report holds the place as `path:line:column`.
fn problem_of(fallback: &Source, error: &ComposerError, composer: &Composer) -> Problem {
    let report = strip_colour(&error.emit_to_string(composer));
    let rule = match error.inner {
        ComposerErrorInner::ShaderValidationError(_)
        | ComposerErrorInner::HeaderValidationError(_) => Rule::Validation,
        ComposerErrorInner::ImportNotFound(..) => Rule::ImportMissing,
        _ => Rule::Compose,
    };
    let place = report.lines().find_map(|line| {
        let (_, place) = line.split_once("┌─ ")?;
        let mut parts = place.trim().rsplitn(3, ':');
        let column = parts.next()?.parse().ok()?;
        let line = parts.next()?.parse().ok()?;
        Some((PathBuf::from(parts.next()?), line, column))
    });
    let (file, line, column) = place.unwrap_or_else(|| (fallback.file.clone(), 1, 1));
    let message = match &error.inner {
        ComposerErrorInner::WgslParseError(error) => error.message().to_owned(),
        ComposerErrorInner::ShaderValidationError(error)
        | ComposerErrorInner::HeaderValidationError(error) => {
            let mut text = error.as_inner().to_string();
            let mut source = std::error::Error::source(error.as_inner());
            while let Some(inner) = source {
                text = format!("{text}: {inner}");
                source = inner.source();
            }
            text
        }
        inner => inner.to_string(),
    };
    Problem { file, line, column, rule, message, excerpt: Some(report) }
}

/// naga_oil colours its reports whatever the output is.
fn strip_colour(report: &str) -> String {
    let mut out = String::with_capacity(report.len());
    let mut rest = report;
    while let Some(at) = rest.find("\u{1b}[") {
        out.push_str(&rest[..at]);
        let tail = &rest[at + 2..];
        rest = tail.find('m').map_or("", |end| &tail[end + 1..]);
    }
    out.push_str(rest);
    out
}
