// SPDX-License-Identifier: MIT OR Apache-2.0
//! The complete check of a folder of WGSL.

use super::axes::{Axis, AxisValue, Variant};
use super::budget::Budget;
use super::interface::Interface;
use super::layers::{self, Layer, layer_of};
use super::library::{Composed, Library, Source, Target, composer_for};
use super::problem::{Problem, Rule};
use super::{OVERLAYS, ROOT, Resources};
use naga_oil::compose::Composer;
use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::rc::Rc;

/// A kernel that passed the check.
#[derive(Clone, Debug)]
pub struct CheckedKernel {
    /// Path under `kernels/` without ending: `reference/path_trace`.
    pub name: String,
    /// The values of the axes that affect its imports.
    pub variant: Variant,
    /// Indices of the axes that affect its imports.
    pub axes: Vec<usize>,
    /// The kernel's own file.
    pub source: Source,
    /// The composed and validated module.
    pub composed: Composed,
}

impl CheckedKernel {
    /// What it declares.
    pub fn resources(&self) -> Resources {
        self.composed.resources
    }

    /// Its interface with the host.
    pub fn interface(&self) -> &Interface {
        &self.composed.interface
    }
}

/// A module that replaces the one of the same path.
#[derive(Clone, Debug)]
pub struct Overlay {
    /// Index of the axis.
    pub axis: usize,
    /// Index of the axis's value.
    pub value: usize,
    /// The module under the path that it replaces.
    pub source: Source,
}

/// A folder of WGSL that passed the check.
#[derive(Clone, Debug, Default)]
pub struct CheckedTree {
    /// Modules (not kernels) of the baseline.
    pub library: Library,
    /// Modules of the overlays.
    pub overlays: Vec<Overlay>,
    /// All kernels in each combination of values that affects them, sorted by name, the baseline first.
    pub kernels: Vec<CheckedKernel>,
}

/// Checks every `.wgsl` file under `dir`: the layers, each module alone, each kernel in each combination of the axes
/// that affect its imports, and the budget.
///
/// # Errors
/// All problems, sorted by their place in the files, without duplicates.
pub fn check_tree(dir: &Path, axes: &[Axis]) -> Result<CheckedTree, Vec<Problem>> {
    let (mut all, mut problems) = Library::read_dir(dir);
    let overlays = take_overlays(&mut all, axes, &mut problems);
    all.look_at_all();
    let tree = Tree { all, overlays, axes, libraries: RefCell::default() };
    let mut checked = CheckedTree::default();

    problems.extend(tree.all.iter().flat_map(layers::check));
    problems.extend(tree.overlays.iter().flat_map(|overlay| layers::check(&overlay.source)));
    problems.extend(layers::check_fields(
        tree.all.iter().chain(tree.overlays.iter().map(|o| &o.source)),
    ));

    let modules = tree.library(Variant::BASELINE);
    let target = Target { capabilities: Variant::BASELINE.capabilities_of(axes), budget: None };
    let mut composers: BTreeMap<Variant, Composer> = BTreeMap::new();
    let mut composed = |source: &Source, variant: Variant, target: Target| {
        let composer = composers.entry(variant).or_insert_with(|| composer_for(target));
        tree.library(variant).compose_in(composer, source, target)
    };
    for source in modules.iter() {
        problems.extend(composed(source, Variant::BASELINE, target).err().unwrap_or_default());
    }
    for Overlay { axis, value, source } in &tree.overlays {
        if layer_of(&source.import_path) != Layer::Kernel {
            let variant = Variant::BASELINE.with_value(*axis, *value);
            let target = Target { capabilities: variant.capabilities_of(axes), budget: None };
            problems.extend(composed(source, variant, target).err().unwrap_or_default());
        }
    }
    for kernel in tree.all.iter().filter(|source| layer_of(&source.import_path) == Layer::Kernel) {
        for (variant, met) in tree.combinations(&kernel.import_path) {
            let source = tree.source(&kernel.import_path, variant);
            let target = Target {
                capabilities: variant.capabilities_of(axes),
                budget: Some(Budget::BASELINE),
            };
            match composed(source, variant, target) {
                Ok(composed) => checked.kernels.push(CheckedKernel {
                    name: kernel_name(&kernel.import_path),
                    variant,
                    axes: met,
                    source: source.clone(),
                    composed,
                }),
                Err(found) => problems.extend(found),
            }
        }
    }
    checked.kernels.sort_by(|a, b| (&a.name, a.variant).cmp(&(&b.name, b.variant)));
    checked.library = (*modules).clone();
    checked.overlays = tree.overlays;
    problems.sort_by(|a, b| {
        (&a.file, a.line, a.column, a.rule, &a.message)
            .cmp(&(&b.file, b.line, b.column, b.rule, &b.message))
    });
    // The same mistake shows up in every kernel that imports the module; several limits may be exceeded at one place.
    problems.dedup_by(|a, b| {
        (&a.file, a.line, a.column, a.rule) == (&b.file, b.line, b.column, b.rule)
            && (a.rule != Rule::Budget || a.message == b.message)
    });
    if problems.is_empty() { Ok(checked) } else { Err(problems) }
}

/// A folder's files.
struct Tree<'a> {
    /// Modules and kernels, without the overlays.
    all: Library,
    overlays: Vec<Overlay>,
    axes: &'a [Axis],
    /// [`Tree::library`] of the variants that were asked for.
    libraries: RefCell<BTreeMap<Variant, Rc<Library>>>,
}

impl Tree<'_> {
    /// A module or kernel in a variant.
    fn source(&self, import_path: &str, variant: Variant) -> &Source {
        let of_variant = |overlay: &&Overlay| {
            overlay.source.import_path == import_path
                && variant.value(overlay.axis) == overlay.value
        };
        match self.overlays.iter().find(of_variant) {
            Some(overlay) => &overlay.source,
            None => self.all.get(import_path).expect("of a module that is there"),
        }
    }

    /// All modules in a variant.
    fn library(&self, variant: Variant) -> Rc<Library> {
        let mut known = self.libraries.borrow_mut();
        let library = known.entry(variant).or_insert_with(|| Rc::new(self.new_library(variant)));
        Rc::clone(library)
    }

    fn new_library(&self, variant: Variant) -> Library {
        let mut library = self.all.clone();
        for overlay in &self.overlays {
            if variant.value(overlay.axis) == overlay.value {
                library.insert(overlay.source.clone());
            }
        }
        library.retain(|source| layer_of(&source.import_path) != Layer::Kernel);
        library
    }

    /// All combinations of the axes that affect a kernel: those with an overlay of the kernel, or of a module among its
    /// imports. Which axes these are may depend on the values of others, so each combination comes with the axes'
    /// indices.
    fn combinations(&self, kernel: &str) -> Vec<(Variant, Vec<usize>)> {
        let mut found = Vec::new();
        let mut open = vec![(Variant::BASELINE, Vec::new())];
        while let Some((variant, met)) = open.pop() {
            let source = self.source(kernel, variant);
            let library = self.library(variant);
            // Invalid imports are reported when the kernel is composed.
            let imports = library.dependencies(source).unwrap_or_default();
            let mut paths = BTreeSet::from([kernel]);
            paths.extend(imports.iter().map(|module| module.import_path.as_str()));
            let next = (0..self.axes.len()).find(|axis| {
                !met.contains(axis)
                    && self.overlays.iter().any(|overlay| {
                        overlay.axis == *axis && paths.contains(overlay.source.import_path.as_str())
                    })
            });
            let Some(axis) = next else {
                found.push((variant, met));
                continue;
            };
            for value in 0..self.axes[axis].values.len() {
                let met = [met.as_slice(), &[axis]].concat();
                open.push((variant.with_value(axis, value), met));
            }
        }
        found
    }
}

/// Takes the files under `variants/<axis>/<value>/…` out of the library, and gives them the paths that they replace.
fn take_overlays(all: &mut Library, axes: &[Axis], problems: &mut Vec<Problem>) -> Vec<Overlay> {
    let prefix = format!("{ROOT}::{OVERLAYS}::");
    let mut found = Vec::new();
    all.retain(|source| {
        let Some(rest) = source.import_path.strip_prefix(&prefix) else { return true };
        let mut parts = rest.splitn(3, "::");
        let mut next = || parts.next().unwrap_or_default();
        let (axis, value, path) = (next(), next(), next());
        let overlay = axes.iter().position(|of| of.name == axis).and_then(|axis| {
            // The first value is the tree itself.
            let is_it = |of: &AxisValue| of.name == value;
            let value = axes[axis].values.iter().skip(1).position(is_it)? + 1;
            let import_path = format!("{ROOT}::{path}");
            (!path.is_empty()).then(|| Overlay {
                axis,
                value,
                source: Source { import_path, ..source.clone() },
            })
        });
        match overlay {
            Some(overlay) => found.push(overlay),
            None => {
                let there = axes.iter().flat_map(|axis| {
                    let values = axis.values.iter().skip(1);
                    values.map(|value| format!("{}/{}", axis.name, value.name))
                });
                let there = there.collect::<Vec<_>>().join(", ");
                let message = format!("is not in the folder of a variant; there are {there}");
                problems.push(source.problem(Rule::UnknownVariant, (1, 1), message));
            }
        }
        false
    });
    for (ix, overlay) in found.iter().enumerate() {
        let path = &overlay.source.import_path;
        let other = found[..ix]
            .iter()
            .find(|other| other.axis != overlay.axis && other.source.import_path == *path);
        if let Some(other) = other {
            let message = format!(
                "`{path}` is replaced on two axes, here and in {}; only one axis may replace it",
                other.source.file.display()
            );
            problems.push(overlay.source.problem(Rule::UnknownVariant, (1, 1), message));
        } else if all.get(path).is_none() {
            let message = format!("replaces `{path}`, which does not exist");
            problems.push(overlay.source.problem(Rule::UnknownVariant, (1, 1), message));
        }
    }
    found
}

fn kernel_name(import_path: &str) -> String {
    import_path.split("::").skip(2).collect::<Vec<_>>().join("/")
}
