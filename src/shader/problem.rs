// SPDX-License-Identifier: MIT OR Apache-2.0
//! What the check reports.

use std::fmt;
use std::path::PathBuf;

/// Which rule a shader broke.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Rule {
    /// The file cannot be read.
    Read,
    /// The text does not parse or its types do not fit.
    Compose,
    /// An `#import` names a module that is not there.
    ImportMissing,
    /// Modules import each other in a circle.
    ImportCycle,
    /// A kernel is imported.
    KernelImported,
    /// `#define_import_path` is missing in a module, differs from the file's path, or stands in a kernel.
    ImportPath,
    /// A module imports one of a layer above its own.
    Direction,
    /// A pure module declares a binding, a workgroup variable, or an entry point.
    PureModule,
    /// A binding stands in a group that is another layer's, or where another one stands.
    BindGroup,
    /// A file under `variants/` stands in the folder of no variant.
    UnknownVariant,
    /// naga's validator refuses the composed module under the row's capabilities.
    Validation,
    /// More resources than baseline WebGPU has.
    Budget,
}

/// One broken rule, with the place to mend.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Problem {
    /// The file as it was given to the check.
    pub file: PathBuf,
    /// 1-based; 1 where a whole file is meant.
    pub line: u32,
    /// 1-based, in characters.
    pub column: u32,
    /// What was broken.
    pub rule: Rule,
    /// What is wrong and what to do.
    pub message: String,
    /// An excerpt of the source with the place marked, where the compiler gave one.
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
