// SPDX-License-Identifier: MIT OR Apache-2.0
//! The rules of the layers, checked on the text.

use super::KERNELS;
use super::library::{Facts, FoundBinding, Source};
use super::problem::{Problem, Rule};
use super::scan::{Declaration, DeclarationKind, declarations, defined_import_path, imports};

/// The layer of a file. A file may import from its own layer (except kernels) and from the layers before it in this
/// list.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Layer {
    /// Functions without bindings.
    Pure,
    /// `fields/`: light that a component stores and several kernels look up; may declare bindings of group 3, which no
    /// other field may use.
    Field,
    /// `scene/`: answers questions about the scene; may declare bindings of group 0, and of group 2 for what a pixel
    /// sees.
    Seam,
    /// `integrators/`: use the seam and declare no bindings.
    Integrator,
    /// `kernels/`: entry points with bindings of groups 1 to 3.
    Kernel,
}

impl Layer {
    fn in_words(self) -> &'static str {
        match self {
            Self::Pure => "a pure module",
            Self::Field => "a field",
            Self::Seam => "a module of the scene seam",
            Self::Integrator => "an integrator",
            Self::Kernel => "a kernel",
        }
    }
}

pub fn layer_of(import_path: &str) -> Layer {
    match import_path.split("::").nth(1) {
        Some(KERNELS) => Layer::Kernel,
        Some("scene") => Layer::Seam,
        Some("fields") => Layer::Field,
        Some("integrators") => Layer::Integrator,
        _ => Layer::Pure,
    }
}

/// Which layer owns a bind group.
fn owner_of(group: &str) -> &'static str {
    match group {
        "0" => "group 0 is the scene's",
        "1" => "group 1 is the kernel's",
        "2" => "group 2 is the pixels'",
        _ => "group 3 is the fields'",
    }
}

/// Finds bindings that two modules of one composition both use.
pub(super) fn check_bindings<'a>(
    sources: impl Iterator<Item = (&'a Source, &'a Facts)>,
) -> Vec<Problem> {
    let mut known: Vec<(&Source, &FoundBinding)> = Vec::new();
    let mut problems = Vec::new();
    for (source, facts) in sources {
        for found in &facts.bindings {
            let FoundBinding { group, binding, name, place } = found;
            let same = |of: &FoundBinding| of.group == *group && of.binding == *binding;
            if let Some((other, of_other)) = known.iter().find(|(_, of)| same(of)) {
                let other_name = &of_other.name;
                let message = format!(
                    "`{name}` and `{other_name}` of {} are both @group({group}) @binding({binding}); {}",
                    other.file.display(),
                    owner_of(group)
                );
                problems.push(source.problem(Rule::BindGroup, *place, message));
            } else {
                known.push((source, found));
            }
        }
    }
    problems
}

/// Finds bindings and names that two fields both use: no kernel could import both.
pub fn check_fields<'a>(sources: impl Iterator<Item = &'a Source>) -> Vec<Problem> {
    let mut fields: Vec<(&str, Vec<(&Source, Declaration<'_>)>)> = Vec::new();
    for source in sources.filter(|source| layer_of(&source.import_path) == Layer::Field) {
        let found = declarations(&source.text).into_iter();
        let found = found.filter(|d| matches!(d.kind, DeclarationKind::Binding { .. }));
        let found = found.map(|declaration| (source, declaration));
        // An overlay of a field counts as that field.
        match fields.iter_mut().find(|(path, _)| *path == source.import_path) {
            Some((_, bindings)) => bindings.extend(found),
            None => fields.push((&source.import_path, found.collect())),
        }
    }
    let mut problems = Vec::new();
    for (ix, (_, bindings)) in fields.iter().enumerate() {
        for (source, declaration) in bindings {
            let DeclarationKind::Binding { binding, name, .. } = declaration.kind else { continue };
            let others = fields[..ix].iter().flat_map(|(_, bindings)| bindings);
            for (other, of_other) in others {
                let DeclarationKind::Binding { binding: number, name: other_name, .. } =
                    of_other.kind
                else {
                    continue;
                };
                if number == binding || other_name == name {
                    let message = format!(
                        "`{name}` (binding {binding}) conflicts with `{other_name}` (binding {number}) of {}: all fields share group 3, so that a kernel can import any two",
                        other.file.display()
                    );
                    let place = (declaration.line, declaration.column);
                    problems.push(source.problem(Rule::BindGroup, place, message));
                }
            }
        }
    }
    problems
}

/// Everything in the file that its layer does not allow.
pub fn check(source: &Source) -> Vec<Problem> {
    let layer = layer_of(&source.import_path);
    let mut problems = Vec::from_iter(check_import_path(source, layer));
    let found = declarations(&source.text);
    for declaration in &found {
        let Declaration { kind, line, column } = *declaration;
        let refusal = match (layer, kind) {
            (Layer::Pure, DeclarationKind::Binding { .. }) => Some((
                Rule::PureModule,
                "a pure module cannot declare a binding; take the value as an argument".into(),
            )),
            (Layer::Integrator, DeclarationKind::Binding { .. }) => Some((
                Rule::PureModule,
                "an integrator cannot declare a binding; take the value as an argument, or import it from the scene seam".into(),
            )),
            (Layer::Kernel, DeclarationKind::Entry(_)) => None,
            (_, DeclarationKind::Entry(stage)) => Some((
                Rule::PureModule,
                format!("an entry point (@{stage}) belongs in a kernel, under {KERNELS}/"),
            )),
            (Layer::Kernel, DeclarationKind::Variable(_)) => None,
            (_, DeclarationKind::Variable("workgroup")) => {
                Some((Rule::PureModule, "only a kernel can declare workgroup variables".into()))
            }
            (Layer::Pure | Layer::Integrator, DeclarationKind::Variable(space)) => {
                Some((Rule::PureModule, format!("a pure module cannot have state: `var<{space}>`")))
            }
            (Layer::Seam, DeclarationKind::Binding { group, .. }) if !matches!(group, "0" | "2") => {
                Some((Rule::BindGroup, format!("the scene seam owns only groups 0 and 2, not {group}")))
            }
            (Layer::Field, DeclarationKind::Binding { group, .. }) if group != "3" => {
                Some((Rule::BindGroup, format!("fields own only group 3, not {group}")))
            }
            (Layer::Kernel, DeclarationKind::Binding { group: "0", .. }) => Some((
                Rule::BindGroup,
                "group 0 belongs to the scene seam; a kernel's bindings are in groups 1 to 3".into(),
            )),
            (Layer::Kernel, DeclarationKind::Binding { group, .. })
                if !matches!(group, "1" | "2" | "3") =>
            {
                Some((Rule::BindGroup, format!("there are only bind groups 0 to 3, not {group}")))
            }
            _ => None,
        };
        if let Some((rule, message)) = refusal {
            problems.push(source.problem(rule, (line, column), message));
        }
    }
    for import in imports(&source.text) {
        let of = layer_of(&import.path);
        // Imports of kernels are refused where imports are resolved.
        if of > layer && of != Layer::Kernel {
            let message = format!(
                "{} imports {}, `{}`: kernels may import integrators, the scene seam, fields and pure modules, each of these the ones after it, and none the ones before it",
                layer.in_words(),
                of.in_words(),
                import.path
            );
            problems.push(source.problem(Rule::Direction, (import.line, import.column), message));
        }
    }
    if layer == Layer::Kernel && !found.iter().any(|d| matches!(d.kind, DeclarationKind::Entry(_)))
    {
        problems.push(source.problem(
            Rule::Compose,
            (1, 1),
            format!("there is no entry point; a file without one does not belong under {KERNELS}/"),
        ));
    }
    problems
}

fn check_import_path(source: &Source, layer: Layer) -> Option<Problem> {
    let declared = defined_import_path(&source.text);
    let place = declared.as_ref().map_or((1, 1), |declared| (declared.line, declared.column));
    let message = match (layer, declared.map(|declared| declared.path)) {
        (Layer::Kernel, None) => return None,
        (Layer::Kernel, Some(_)) => {
            String::from("a kernel must not have an import path, because it is never imported")
        }
        (_, Some(declared)) if declared == source.import_path => return None,
        (_, Some(declared)) => format!(
            "declares the import path `{declared}`, but its place in the folder makes it `{}`",
            source.import_path
        ),
        (_, None) => format!(
            "a module must declare its import path: `#define_import_path {}`",
            source.import_path
        ),
    };
    Some(source.problem(Rule::ImportPath, place, message))
}
