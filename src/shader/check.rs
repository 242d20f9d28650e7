use super::budget::{Budget, Counted, Resources};
use super::layers::{self, Layer, layer_of};
use super::library::{Library, Source};
use super::problem::{Problem, Rule};
use super::scan::{DeclarationKind, declarations, imports};
use super::{OVERLAYS, ROOT};
use naga::valid::Capabilities;
use std::collections::BTreeSet;
use std::path::Path;

/// A way of composing kernels: an overlay of modules under `variants/<name>/` that replace those
/// of the same path, and what the result may ask of the adapter.
#[derive(Clone, Copy, Debug)]
pub struct Variant {
    /// Its name and its folder; the baseline has an empty one.
    pub name: &'static str,
    /// The least naga capabilities under which its kernels validate.
    pub capabilities: Capabilities,
    /// Kernels (path under `kernels/`, `reference/path_trace`) composed in it; `None`: all.
    pub kernels: Option<&'static [&'static str]>,
}

/// What plain WebGPU has and naga asks for: `pack2x16float` and its kin (they need no f16).
pub const BASELINE: Capabilities = Capabilities::SHADER_FLOAT16_IN_FLOAT32;

/// Kernels that ask the host seam for rays or the sky.
const SCENE_KERNELS: &[&str] = &[
    "frame/composite",
    "frame/direct",
    "rays/nearest_hit",
    "rays/any_hit",
    "reference/path_trace",
    "voxel_rt/gather",
    "voxel_rt/inject",
];

/// Those, and the ones that read textures but ask no rays.
const UNTEXTURED_KERNELS: &[&str] = &[
    "frame/composite",
    "frame/direct",
    "frame/gbuffer",
    "shadow/depth",
    "rays/nearest_hit",
    "rays/any_hit",
    "reference/path_trace",
    "voxel/accumulate",
    "voxel_rt/gather",
    "voxel_rt/inject",
];

/// Kernels that ask how much of a light is seen, by shadow maps.
const SHADOW_MAP_KERNELS: &[&str] = &["frame/direct", "voxel_rt/gather"];

/// Kernels that read or make prefiltered voxels.
const PYRAMID_KERNELS: &[&str] = &[
    "voxel_cone/bounce",
    "voxel_cone/fill",
    "voxel_cone/prefilter",
    "voxel_cone/shade",
    "voxel_cone/trace",
];

/// Every variant there is; the baseline stands first.
pub const VARIANTS: &[Variant] = &[
    Variant { name: "", capabilities: BASELINE, kernels: None },
    Variant { name: "untextured", capabilities: BASELINE, kernels: Some(UNTEXTURED_KERNELS) },
    Variant {
        name: "ray_query",
        capabilities: BASELINE.union(Capabilities::RAY_QUERY),
        kernels: Some(SCENE_KERNELS),
    },
    Variant { name: "shadow_map", capabilities: BASELINE, kernels: Some(SHADOW_MAP_KERNELS) },
    Variant { name: "cone_shadow", capabilities: BASELINE, kernels: Some(&["frame/direct"]) },
    Variant { name: "pyramid_buffer", capabilities: BASELINE, kernels: Some(PYRAMID_KERNELS) },
];

/// The row of that name.
pub fn variant(name: &str) -> Option<&'static Variant> {
    VARIANTS.iter().find(|variant| variant.name == name)
}

/// A kernel that passed.
#[derive(Clone, Debug)]
pub struct CheckedKernel {
    /// Path under `kernels/` without ending: `reference/path_trace`.
    pub name: String,
    /// The variant's name; empty for the baseline.
    pub variant: &'static str,
    /// The kernel's own file.
    pub source: Source,
    /// The composed and validated module.
    pub module: naga::Module,
    /// What it declares.
    pub resources: Resources,
}

/// A folder of WGSL that passed.
#[derive(Clone, Debug, Default)]
pub struct CheckedTree {
    /// Modules (not kernels) of the baseline.
    pub library: Library,
    /// Modules of the variants: the variant's name, and the module under the path that it replaces.
    pub overlays: Vec<(String, Source)>,
    /// All kernels in all their variants.
    pub kernels: Vec<CheckedKernel>,
}

/// Checks every `.wgsl` file under `dir`: the layers, each module alone, each kernel in each of its
/// variants, the budget.
///
/// # Errors
/// All problems, sorted by place, each once.
pub fn check_tree(dir: &Path, variants: &[Variant]) -> Result<CheckedTree, Vec<Problem>> {
    let (mut all, mut problems) = Library::read_dir(dir);
    let overlays = take_overlays(&mut all);
    problems.extend(check_overlays(&overlays, variants));
    let mut checked = CheckedTree::default();
    for variant in variants {
        let mut library = all.clone();
        let mut changed = BTreeSet::new();
        for (name, source) in &overlays {
            if !name.is_empty() && name == variant.name {
                changed.insert(source.import_path.clone());
                library.insert(source.clone());
            }
        }
        let kernels: Vec<Source> = library
            .iter()
            .filter(|source| layer_of(&source.import_path) == Layer::Kernel)
            .cloned()
            .collect();
        library.retain(|source| layer_of(&source.import_path) != Layer::Kernel);

        for source in library.iter() {
            let baseline = variant.name.is_empty();
            if baseline || changed.contains(&source.import_path) {
                problems.extend(layers::check(source));
                if let Err(found) = library.compose(source, variant.capabilities) {
                    problems.extend(found);
                }
            }
        }
        for source in kernels {
            let name = kernel_name(&source.import_path);
            if variant.kernels.is_some_and(|list| !list.contains(&name.as_str())) {
                continue;
            }
            if variant.name.is_empty() || changed.contains(&source.import_path) {
                problems.extend(layers::check(&source));
            }
            match library.compose(&source, variant.capabilities) {
                Ok(module) => {
                    let resources = Resources::of(&module);
                    problems.extend(check_budget(&source, &resources));
                    checked.kernels.push(CheckedKernel {
                        name,
                        variant: variant.name,
                        source,
                        module,
                        resources,
                    });
                }
                Err(found) => problems.extend(found),
            }
        }
        if variant.name.is_empty() {
            checked.library = library;
        }
    }
    checked.overlays = overlays;
    problems.sort_by(|a, b| {
        (&a.file, a.line, a.column, a.rule, &a.message)
            .cmp(&(&b.file, b.line, b.column, b.rule, &b.message))
    });
    // The same mistake shows in every kernel that imports the module; several limits may be passed
    // at one place.
    problems.dedup_by(|a, b| {
        (&a.file, a.line, a.column, a.rule) == (&b.file, b.line, b.column, b.rule)
            && (a.rule != Rule::Budget || a.message == b.message)
    });
    if problems.is_empty() { Ok(checked) } else { Err(problems) }
}

/// Takes the files of `variants/<name>/…` out of the library, under the paths that they replace.
fn take_overlays(all: &mut Library) -> Vec<(String, Source)> {
    let prefix = format!("{ROOT}::{OVERLAYS}::");
    let mut overlays = Vec::new();
    all.retain(|source| {
        let Some(rest) = source.import_path.strip_prefix(&prefix) else { return true };
        // A file that stands in no variant's folder belongs to the variant without a name.
        let (variant, path) = rest.split_once("::").unwrap_or(("", rest));
        let source = Source { import_path: format!("{ROOT}::{path}"), ..source.clone() };
        overlays.push((variant.to_owned(), source));
        false
    });
    overlays
}

/// Files that no variant takes would be neither checked nor used.
fn check_overlays(overlays: &[(String, Source)], variants: &[Variant]) -> Vec<Problem> {
    let names: Vec<_> =
        variants.iter().map(|variant| variant.name).filter(|name| !name.is_empty()).collect();
    let stray = overlays.iter().filter(|(name, _)| !names.contains(&name.as_str()));
    let message = || format!("stands in the folder of no variant; there is {}", names.join(", "));
    stray.map(|(_, source)| source.problem(Rule::UnknownVariant, (1, 1), message())).collect()
}

fn kernel_name(import_path: &str) -> String {
    import_path.split("::").skip(2).collect::<Vec<_>>().join("/")
}

fn check_budget(source: &Source, resources: &Resources) -> Vec<Problem> {
    let found = declarations(&source.text);
    let imports = imports(&source.text);
    let seam = imports.iter().find(|import| layer_of(&import.path) == Layer::Seam);
    let place_of = |counted: Counted| {
        let declaration = match counted {
            Counted::Seam => return seam.map_or((1, 1), |import| (import.line, import.column)),
            Counted::Buffer => {
                found.iter().rev().find(|d| matches!(d.kind, DeclarationKind::Group(_)))
            }
            Counted::Workgroup => found.iter().find(|d| d.kind == DeclarationKind::WorkgroupSize),
            Counted::Other => found.iter().find(|d| matches!(d.kind, DeclarationKind::Entry(_))),
        };
        declaration.map_or((1, 1), |d| (d.line, d.column))
    };
    resources
        .excess(&Budget::BASELINE)
        .into_iter()
        .map(|excess| source.problem(Rule::Budget, place_of(excess.counted), excess.message))
        .collect()
}
