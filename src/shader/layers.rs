//! The rules of the layers, checked on the text.

use super::KERNELS;
use super::library::Source;
use super::problem::{Problem, Rule};
use super::scan::{Declaration, DeclarationKind, declarations, defined_import_path};

/// Where a file stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Layer {
    /// Functions without bindings.
    Pure,
    /// `host/`: may declare bindings of group 0.
    Seam,
    /// `fields/`: light that a technique keeps, looked up by several kernels; may declare bindings of
    /// group 2.
    Field,
    /// `kernels/`: entry points with bindings of groups 1 to 3.
    Kernel,
}

pub fn layer_of(import_path: &str) -> Layer {
    match import_path.split("::").nth(1) {
        Some(KERNELS) => Layer::Kernel,
        Some("host") => Layer::Seam,
        Some("fields") => Layer::Field,
        _ => Layer::Pure,
    }
}

/// Everything in the file that its layer does not allow.
pub fn check(source: &Source) -> Vec<Problem> {
    let layer = layer_of(&source.import_path);
    let mut problems = Vec::from_iter(check_import_path(source, layer));
    let found = declarations(&source.text);
    for declaration in &found {
        let Declaration { kind, line, column } = *declaration;
        let refusal = match (layer, kind) {
            (Layer::Pure, DeclarationKind::Group(_)) => Some((
                Rule::PureModule,
                "a pure module declares no binding: take the value as an argument".into(),
            )),
            (Layer::Pure | Layer::Seam | Layer::Field, DeclarationKind::Variable("workgroup")) => {
                Some((Rule::PureModule, "only a kernel declares workgroup variables".into()))
            }
            (Layer::Pure, DeclarationKind::Variable(space)) => {
                Some((Rule::PureModule, format!("a pure module keeps no state: `var<{space}>`")))
            }
            (Layer::Pure | Layer::Seam | Layer::Field, DeclarationKind::Entry(stage)) => Some((
                Rule::PureModule,
                format!("an entry point (@{stage}) stands in a kernel, under {KERNELS}/"),
            )),
            (Layer::Seam, DeclarationKind::Group(group)) if group != "0" => {
                Some((Rule::BindGroup, format!("the host seam owns group 0 alone, not {group}")))
            }
            (Layer::Field, DeclarationKind::Group(group)) if group != "2" => {
                Some((Rule::BindGroup, format!("fields bind in group 2 alone, not in {group}")))
            }
            (Layer::Kernel, DeclarationKind::Group("0")) => Some((
                Rule::BindGroup,
                "group 0 belongs to the host seam; kernels own 1 to 3".into(),
            )),
            (Layer::Kernel, DeclarationKind::Group(group)) if !matches!(group, "1" | "2" | "3") => {
                Some((Rule::BindGroup, format!("there are bind groups 0 to 3 only, not {group}")))
            }
            _ => None,
        };
        if let Some((rule, message)) = refusal {
            problems.push(source.problem(rule, (line, column), message));
        }
    }
    if layer == Layer::Kernel && !found.iter().any(|d| matches!(d.kind, DeclarationKind::Entry(_)))
    {
        problems.push(source.problem(
            Rule::Compose,
            (1, 1),
            format!("no entry point; what is not a kernel does not stand under {KERNELS}/"),
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
            String::from("a kernel has no import path: it is never imported")
        }
        (_, Some(declared)) if declared == source.import_path => return None,
        (_, Some(declared)) => format!(
            "declares the import path `{declared}`, and by its place it is `{}`",
            source.import_path
        ),
        (_, None) => format!(
            "a module declares its import path: `#define_import_path {}`",
            source.import_path
        ),
    };
    Some(source.problem(Rule::ImportPath, place, message))
}
