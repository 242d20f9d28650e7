// SPDX-License-Identifier: MIT OR Apache-2.0
//! Modules by their import paths, and their composition.

use super::budget::{Budget, Resources};
use super::interface::Interface;
use super::layers::{Layer, layer_of};
use super::problem::{Problem, Rule};
use super::reflect::Counted;
use super::scan::DeclarationKind;
use super::{BASELINE, KERNELS, ROOT, layers, scan};
use naga::WithSpan;
use naga::valid::{Capabilities, ValidationFlags, Validator};
use naga_oil::compose::{
    ComposableModuleDescriptor, Composer, ComposerError, ComposerErrorInner, ErrSource,
    NagaModuleDescriptor, get_preprocessor_data,
};
use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

/// One WGSL file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Source {
    /// `lucerna::sh::basis` for `wgsl/sh/basis.wgsl`.
    pub import_path: String,
    /// The file's name in messages.
    pub file: PathBuf,
    /// The text, with its comments.
    pub text: Cow<'static, str>,
}

impl Source {
    /// A module whose import path is given by its `#define_import_path` line.
    ///
    /// # Errors
    /// [`Problem`]: the text has no such line.
    pub fn module(
        file: impl Into<PathBuf>,
        text: impl Into<Cow<'static, str>>,
    ) -> Result<Self, Problem> {
        let mut source = Self { import_path: String::new(), file: file.into(), text: text.into() };
        let (name, _, _) = get_preprocessor_data(&source.text);
        source.import_path = name.ok_or_else(|| {
            let message = "a module needs a line `#define_import_path NAME`".into();
            source.problem(Rule::ImportPath, (1, 1), message)
        })?;
        Ok(source)
    }

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
}

/// What a look at a text finds. A module is imported by many, so that it is looked at once.
#[derive(Clone, Debug)]
pub(super) struct Facts {
    /// [`Source::imports`]: the modules of which something is used.
    used: Vec<String>,
    /// Every import, used or not.
    imports: Vec<scan::Import>,
    /// Names that it declares.
    names: BTreeSet<String>,
    /// Its bindings.
    pub bindings: Vec<FoundBinding>,
}

/// A binding as written, with its place.
#[derive(Clone, Debug)]
pub(super) struct FoundBinding {
    pub group: String,
    pub binding: String,
    pub name: String,
    pub place: (u32, u32),
}

impl Facts {
    fn of(source: &Source) -> Self {
        let found = scan::declarations(&source.text).into_iter();
        let bindings = found.filter_map(|of| match of.kind {
            DeclarationKind::Binding { group, binding, name } => Some(FoundBinding {
                group: group.to_owned(),
                binding: binding.to_owned(),
                name: name.to_owned(),
                place: (of.line, of.column),
            }),
            _ => None,
        });
        Self {
            used: source.imports(),
            imports: scan::imports(&source.text),
            names: scan::declared_names(&source.text).into_iter().map(str::to_owned).collect(),
            bindings: bindings.collect(),
        }
    }

    /// The modules in use, and the imports of which nothing is used: naga_oil skips those, whether they are right or
    /// wrong.
    fn wanted(&self, library: &Library) -> Vec<String> {
        let mut wanted = self.used.clone();
        for import in &self.imports {
            let known = |path: &str| library.modules.contains_key(path);
            if !wanted.iter().any(|module| import.is_of(module))
                && !known(&import.path)
                && !import.parent().is_some_and(known)
            {
                wanted.push(import.path.clone());
            }
        }
        wanted
    }
}

/// A set of modules by import path, from which kernels are composed.
#[derive(Clone, Debug, Default)]
pub struct Library {
    modules: BTreeMap<String, Entry>,
}

/// A module, and what is found in it once it is asked for.
#[derive(Clone, Debug)]
struct Entry {
    source: Source,
    facts: OnceLock<Facts>,
}

impl Entry {
    fn facts(&self) -> &Facts {
        self.facts.get_or_init(|| Facts::of(&self.source))
    }
}

impl Library {
    /// Reads every `.wgsl` file under `dir`; `dir/sh/basis.wgsl` becomes `lucerna::sh::basis`. Files that cannot be
    /// read are returned as problems.
    pub fn read_dir(dir: &Path) -> (Self, Vec<Problem>) {
        let mut library = Self::default();
        let mut problems = Vec::new();
        library.read_into(dir, ROOT, &mut problems);
        (library, problems)
    }

    fn read_into(&mut self, dir: &Path, import_path: &str, problems: &mut Vec<Problem>) {
        let entries = match std::fs::read_dir(dir).and_then(Iterator::collect::<Result<Vec<_>, _>>)
        {
            Ok(entries) => entries,
            Err(error) => return problems.push(unreadable(dir, &error)),
        };
        let mut folders = Vec::new();
        for entry in entries {
            let path = entry.path();
            let Some(stem) = path.file_stem().and_then(|stem| stem.to_str()) else { continue };
            let name = format!("{import_path}::{stem}");
            let is_wgsl = path.extension().is_some_and(|extension| extension == "wgsl");
            if !is_identifier(stem) && (is_wgsl || path.is_dir()) {
                let file = path.clone();
                problems.push(Problem {
                    file,
                    line: 1,
                    column: 1,
                    rule: Rule::ImportPath,
                    message: format!(
                        "`{stem}` is not an identifier, but names of files and folders are parts of import paths: use letters, digits and _"
                    ),
                    excerpt: None,
                });
            } else if path.is_dir() {
                folders.push((path, name));
            } else if is_wgsl {
                match std::fs::read(&path).map(String::from_utf8) {
                    Ok(Ok(text)) => {
                        self.insert(Source { import_path: name, file: path, text: text.into() })
                    }
                    Ok(Err(error)) => problems.push(not_utf8(path, &error)),
                    Err(error) => problems.push(unreadable(&path, &error)),
                }
            }
        }
        for (path, name) in folders {
            self.read_into(&path, &name, problems);
        }
    }

    /// Adds a module. It replaces the module of the same import path, if there is one: this is how a renderer puts its
    /// own scene behind the scene seam.
    pub fn insert(&mut self, source: Source) {
        let path = source.import_path.clone();
        self.modules.insert(path, Entry { source, facts: OnceLock::new() });
    }

    /// The module of that import path.
    pub fn get(&self, import_path: &str) -> Option<&Source> {
        self.modules.get(import_path).map(|entry| &entry.source)
    }

    /// All modules in the order of their import paths.
    pub fn iter(&self) -> impl Iterator<Item = &Source> {
        self.modules.values().map(|entry| &entry.source)
    }

    /// Removes the modules for which `keep` returns false.
    pub fn retain(&mut self, mut keep: impl FnMut(&Source) -> bool) {
        self.modules.retain(|_, entry| keep(&entry.source));
    }

    /// Everything that `source` imports, directly or not; each module comes before those that import it.
    ///
    /// # Errors
    /// All imports, used or not, that name nothing, name a kernel, or form a cycle, each with the place of the import.
    pub fn dependencies(&self, source: &Source) -> Result<Vec<&Source>, Vec<Problem>> {
        let found = self.walk(source, &Facts::of(source))?;
        Ok(found.into_iter().map(|entry| &entry.source).collect())
    }

    fn walk(&self, source: &Source, facts: &Facts) -> Result<Vec<&Entry>, Vec<Problem>> {
        let mut walk =
            Walk { library: self, done: Vec::new(), path: Vec::new(), problems: Vec::new() };
        walk.visit(source, facts);
        if walk.problems.is_empty() { Ok(walk.done) } else { Err(walk.problems) }
    }

    /// Looks at all modules, so that copies of the library know what is found in them.
    pub(super) fn look_at_all(&self) {
        self.modules.values().for_each(|entry| {
            entry.facts();
        });
    }

    /// Composes `source` with everything that it imports, validates the result, and checks it against the budget. The
    /// build script does this with each kernel.
    ///
    /// # Errors
    /// What is wrong with the imports or the bindings; or else the first parse or validation error; or else all limits
    /// that are exceeded.
    pub fn compose(&self, source: &Source, target: Target) -> Result<Composed, Vec<Problem>> {
        self.compose_in(&mut composer_for(target), source, target)
    }

    /// [`Library::compose`] in a [`composer_for`] the same capabilities, which may hold modules of this library.
    pub(super) fn compose_in(
        &self,
        composer: &mut Composer,
        source: &Source,
        target: Target,
    ) -> Result<Composed, Vec<Problem>> {
        let facts = Facts::of(source);
        let dependencies = self.walk(source, &facts)?;
        let sides = dependencies.iter().map(|entry| (&entry.source, entry.facts()));
        let sides = sides.chain([(source, &facts)]);
        let conflicts = layers::check_bindings(sides);
        if !conflicts.is_empty() {
            return Err(conflicts);
        }
        for Entry { source: module, .. } in dependencies {
            if composer.contains_module(&module.import_path) {
                continue;
            }
            let added = composer.add_composable_module(ComposableModuleDescriptor {
                source: &module.text,
                file_path: &module.file.to_string_lossy(),
                as_name: Some(module.import_path.clone()),
                ..Default::default()
            });
            if let Err(error) = added {
                return Err(vec![problem_of(module, &error, composer)]);
            }
        }
        let module = composer
            .make_naga_module(NagaModuleDescriptor {
                source: &source.text,
                file_path: &source.file.to_string_lossy(),
                ..Default::default()
            })
            .map_err(|error| vec![problem_of(source, &error, composer)])?;
        let info = Validator::new(ValidationFlags::all(), target.capabilities)
            .validate(&module)
            .map_err(|error| {
                vec![source.problem(Rule::Validation, (1, 1), error.as_inner().to_string())]
            })?;
        let resources = Resources::of(&module);
        let excess =
            target.budget.map_or(Vec::new(), |budget| over_budget(source, &resources, &budget));
        if !excess.is_empty() {
            return Err(excess);
        }
        let interface = Interface::of(&module, &info);
        Ok(Composed { module, info, resources, interface })
    }
}

/// A composer without modules.
pub(super) fn composer_for(target: Target) -> Composer {
    Composer::default().with_capabilities(target.capabilities)
}

/// What a module is composed for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Target {
    /// What the adapter can do.
    pub capabilities: Capabilities,
    /// What the module may use; None: no limit.
    pub budget: Option<Budget>,
}

impl Default for Target {
    /// Plain WebGPU.
    fn default() -> Self {
        Self { capabilities: BASELINE, budget: Some(Budget::BASELINE) }
    }
}

/// A composed and validated module.
#[derive(Clone, Debug)]
pub struct Composed {
    /// The module, for `wgpu::ShaderSource::Naga`.
    pub module: naga::Module,
    /// What the validator found out about the module.
    pub info: naga::valid::ModuleInfo,
    /// The limited resources that it declares.
    pub resources: Resources,
    /// Its bindings and entry points, from which bind group layouts follow.
    pub interface: Interface,
}

fn over_budget(source: &Source, resources: &Resources, budget: &Budget) -> Vec<Problem> {
    let found = scan::declarations(&source.text);
    let imports = scan::imports(&source.text);
    let seam = imports.iter().find(|import| layer_of(&import.path) == Layer::Seam);
    let place_of = |counted: Counted| {
        let declaration = match counted {
            Counted::Seam => return seam.map_or((1, 1), |import| (import.line, import.column)),
            Counted::Buffer => {
                found.iter().rev().find(|d| matches!(d.kind, DeclarationKind::Binding { .. }))
            }
            Counted::Workgroup => found.iter().find(|d| d.kind == DeclarationKind::WorkgroupSize),
            Counted::Other => found.iter().find(|d| matches!(d.kind, DeclarationKind::Entry(_))),
        };
        declaration.map_or((1, 1), |d| (d.line, d.column))
    };
    resources
        .excess(budget)
        .into_iter()
        .map(|excess| source.problem(Rule::Budget, place_of(excess.counted), excess.message))
        .collect()
}

fn unreadable(file: &Path, error: &std::io::Error) -> Problem {
    Problem {
        file: file.to_owned(),
        line: 1,
        column: 1,
        rule: Rule::Read,
        message: format!("cannot be read: {error}"),
        excerpt: None,
    }
}

fn not_utf8(file: PathBuf, error: &std::string::FromUtf8Error) -> Problem {
    let good = &error.as_bytes()[..error.utf8_error().valid_up_to()];
    let (line, column) = scan::end_of(&String::from_utf8_lossy(good));
    Problem {
        file,
        line,
        column,
        rule: Rule::Read,
        message: "is not UTF-8 from here on; save the file as UTF-8".into(),
        excerpt: None,
    }
}

fn is_identifier(name: &str) -> bool {
    name.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_')
        && name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_')
}

struct Walk<'a> {
    library: &'a Library,
    done: Vec<&'a Entry>,
    path: Vec<String>,
    problems: Vec<Problem>,
}

impl<'a> Walk<'a> {
    fn visit(&mut self, source: &Source, facts: &Facts) {
        let modules = &self.library.modules;
        self.path.push(source.import_path.clone());
        for import in &facts.imports {
            let Some(module) = import.parent().and_then(|path| modules.get(path)) else {
                continue;
            };
            let item = import.path.rsplit("::").next().unwrap_or_default();
            if self.library.get(&import.path).is_none() && !module.facts().names.contains(item) {
                self.problems.push(source.problem(
                    Rule::ImportMissing,
                    (import.line, import.column),
                    format!("`{}` has no `{item}`", module.source.import_path),
                ));
            }
        }
        for import in facts.wanted(self.library) {
            // Where the module is imported, or else where its full path first appears.
            let place = || match facts.imports.iter().find(|of| of.is_of(&import)) {
                Some(found) => (found.line, found.column),
                None => scan::place_of(&source.text, &import),
            };
            if import.starts_with(&format!("{ROOT}::{KERNELS}::")) {
                self.problems.push(source.problem(
                    Rule::KernelImported,
                    place(),
                    format!("imports the kernel `{import}`; move what is shared into a module"),
                ));
            } else if let Some(start) = self.path.iter().position(|open| *open == import) {
                let circle = [&self.path[start..], std::slice::from_ref(&import)].concat();
                self.problems.push(source.problem(
                    Rule::ImportCycle,
                    place(),
                    format!("imports form a cycle: {}", circle.join(" -> ")),
                ));
            } else if let Some(module) = modules.get(&import) {
                if !self.done.iter().any(|done| done.source.import_path == import) {
                    self.visit(&module.source, module.facts());
                    self.done.push(module);
                }
            } else {
                self.problems.push(source.problem(
                    Rule::ImportMissing,
                    place(),
                    format!("imports `{import}`, but there is no such module"),
                ));
            }
        }
        self.path.pop();
    }
}

/// Translates naga_oil's error.
fn problem_of(fallback: &Source, error: &ComposerError, composer: &Composer) -> Problem {
    let report = strip_colour(&error.emit_to_string(composer));
    let rule = match error.inner {
        ComposerErrorInner::ShaderValidationError(_)
        | ComposerErrorInner::HeaderValidationError(_) => Rule::Validation,
        ComposerErrorInner::ImportNotFound(..) => Rule::ImportMissing,
        _ => Rule::Compose,
    };
    let place = narrowed(error)
        .and_then(|error| place_of_error(&error, composer))
        .or_else(|| place_of_error(error, composer));
    let (file, line, column) = place.unwrap_or_else(|| (fallback.file.clone(), 1, 1));
    let message = match &error.inner {
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
        // The error has decorated names, its report does not.
        inner => match report.lines().next().and_then(|line| line.strip_prefix("error: ")) {
            Some(line) => line.to_owned(),
            None => inner.to_string(),
        },
    };
    Problem { file, line, column, rule, message, excerpt: Some(report) }
}

/// A validation error with only its innermost place: the expression, not the function around it.
fn narrowed(error: &ComposerError) -> Option<ComposerError> {
    let ComposerErrorInner::ShaderValidationError(inner) = &error.inner else { return None };
    let (span, _) = inner
        .spans()
        .filter(|(span, _)| span.is_defined())
        .min_by_key(|(span, _)| span.to_range().map_or(usize::MAX, |range| range.len()))?;
    let source = match &error.source {
        ErrSource::Module { name, offset, defs } => {
            ErrSource::Module { name: name.clone(), offset: *offset, defs: defs.clone() }
        }
        ErrSource::Constructing { path, source, offset } => {
            ErrSource::Constructing { path: path.clone(), source: source.clone(), offset: *offset }
        }
    };
    let inner = WithSpan::new(inner.as_inner().clone()).with_span(*span, "here");
    Some(ComposerError { inner: ComposerErrorInner::ShaderValidationError(inner), source })
}

/// The report gives the place as `path:line:column`, where the column counts decorated names.
fn place_of_error(error: &ComposerError, composer: &Composer) -> Option<(PathBuf, u32, u32)> {
    let report = strip_colour(&error.emit_to_string(composer));
    let place = report.lines().find_map(|line| line.split_once("┌─ "))?.1;
    let mut parts = place.trim().rsplitn(3, ':');
    let column: usize = parts.next()?.parse().ok()?;
    let line: usize = parts.next()?.parse().ok()?;
    let file = PathBuf::from(parts.next()?);
    let source = error.source.source(composer);
    let text = source.lines().nth(line.saturating_sub(1)).unwrap_or_default();
    let before: String = text.chars().take(column.saturating_sub(1)).collect();
    let column = undecorated(&before).chars().count() + 1;
    Some((file, line as u32, column as u32))
}

/// `text` without naga_oil's suffixes: an imported `twice` is `twiceX_naga_oil_mod_X<base 32>X` to naga.
fn undecorated(text: &str) -> String {
    const MARK: &str = "X_naga_oil_mod_X";
    let mut out = String::with_capacity(text.len());
    let mut rest = text;
    while let Some(at) = rest.find(MARK) {
        out.push_str(&rest[..at]);
        let tail = &rest[at + MARK.len()..];
        let end = tail.find(|c: char| !c.is_ascii_uppercase() && !c.is_ascii_digit());
        // An X may also be a digit, so the last one ends the suffix.
        let run = &tail[..end.unwrap_or(tail.len())];
        rest = &tail[run.rfind('X').map_or(run.len(), |x| x + 1)..];
    }
    out.push_str(rest);
    out
}

/// naga_oil always colours its reports.
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
