// SPDX-License-Identifier: MIT OR Apache-2.0
//! What the check reports.

use std::fmt;
use std::path::PathBuf;

/// Which rule a shader broke.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[non_exhaustive]
pub enum Rule {
    /// The file cannot be read.
    Read,
    /// The text does not parse, or its types do not match.
    Compose,
    /// An `#import` names a module that does not exist.
    ImportMissing,
    /// Imports form a cycle.
    ImportCycle,
    /// A kernel is imported.
    KernelImported,
    /// `#define_import_path` is missing in a module, differs from the file's path, or appears in a kernel.
    ImportPath,
    /// A module imports a module of a layer above its own.
    Direction,
    /// A pure module declares a binding, a workgroup variable, or an entry point.
    PureModule,
    /// A binding is in a group that belongs to another layer, or has the same number as another binding.
    BindGroup,
    /// A file under `variants/` is not in the folder of a variant.
    UnknownVariant,
    /// naga's validator rejects the composed module with the variant's capabilities.
    Validation,
    /// A kernel uses more resources than baseline WebGPU allows.
    Budget,
}

/// A broken rule, and where to fix it.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Problem {
    /// The file as it was given to the check.
    pub file: PathBuf,
    /// 1-based; 1 if the problem concerns a whole file.
    pub line: u32,
    /// 1-based, in characters.
    pub column: u32,
    /// The broken rule.
    pub rule: Rule,
    /// What is wrong and what to do.
    pub message: String,
    /// An excerpt of the source with the place marked, if the compiler gave one.
    pub excerpt: Option<String>,
}

impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}:{}: {}", self.file.display(), self.line, self.column, self.message)?;
        if let Some(excerpt) = &self.excerpt {
            write!(f, "\n{}", excerpt.trim_end())?;
        }
        Ok(())
    }
}

impl std::error::Error for Problem {}
