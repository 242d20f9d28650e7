// SPDX-License-Identifier: MIT OR Apache-2.0
//! Inputs and outputs of tests as files, for tests in other languages.

use super::{Tolerance, wgsl_of};
use crate::modules::watch::{binary_name, test_name};
use crate::shader::Composed;
use bytemuck::NoUninit;
use naga::{Handle, Module, ScalarKind, Type, TypeInner};
use serde_json::{Value, json};
use std::cell::{Cell, RefCell};
use std::path::PathBuf;

/// If there are more inputs, only every n-th is written: samplers are tested with millions.
const MAX_ELEMENTS: usize = 1024;

fn step_of(n: usize) -> usize {
    n.div_ceil(MAX_ELEMENTS).max(1)
}

thread_local! {
    static N_CALLS: Cell<u32> = const { Cell::new(0) };
    /// The file of this thread's last call.
    static LAST: RefCell<Option<PathBuf>> = const { RefCell::new(None) };
}

fn folder() -> Option<PathBuf> {
    std::env::var_os("LUCERNA_GOLDEN").filter(|folder| !folder.is_empty()).map(PathBuf::from)
}

/// Writes a call of `map`.
pub(super) fn write_map<I: NoUninit, O: NoUninit>(
    wgsl: &str,
    composed: &Composed,
    inputs: &[I],
    outputs: &[O],
    n_resources: usize,
) {
    let Some(folder) = folder() else { return };
    let call = N_CALLS.get();
    N_CALLS.set(call + 1);
    let name = test_name();
    let file = folder.join(binary_name()).join(format!("{name}-{call}.json"));
    let fields = |variable| fields_of(&composed.module, variable);
    let (of_input, of_output) = (fields("harness_inputs"), fields("harness_outputs"));
    let value = json!({
        "test": name,
        "call": call,
        "wgsl": wgsl,
        "composed": wgsl_of(composed),
        // The test's own textures and buffers are not in the file.
        "n_other_resources": n_resources,
        "n_calls": inputs.len(),
        // One in `step` of them is in the file.
        "step": step_of(inputs.len()),
        "input_fields": described(&of_input),
        "output_fields": described(&of_output),
        "inputs": elements(inputs, &of_input),
        "outputs": elements(outputs, &of_output),
    });
    write(&file, &value);
    LAST.set(Some(file));
}

/// Adds the expected outputs of the last call.
pub(super) fn write_expected(what: &str, expected: &[Vec<f64>], tolerance: Tolerance) {
    let Some(file) = LAST.with_borrow(Clone::clone) else { return };
    let text = std::fs::read_to_string(&file).unwrap_or_else(|e| panic!("{}: {e}", file.display()));
    let mut value: Value = serde_json::from_str(&text).expect("written by the last call");
    if value["n_calls"] != expected.len() {
        return; // it belongs to another call
    }
    let written = expected.iter().step_by(step_of(expected.len()));
    let expected: Vec<Vec<Value>> =
        written.map(|of| of.iter().map(|&number| in_json(number)).collect()).collect();
    let check = json!({
        "what": what,
        "expected": expected,
        "tolerance": {
            "absolute": tolerance.absolute,
            "relative": tolerance.relative,
            "ulps": tolerance.ulps,
        },
    });
    match value["checks"].as_array_mut() {
        Some(checks) => checks.push(check),
        None => value["checks"] = json!([check]),
    }
    write(&file, &value);
}

fn write(file: &std::path::Path, value: &Value) {
    let folder = file.parent().unwrap_or(file);
    std::fs::create_dir_all(folder)
        .and_then(|()| std::fs::write(file, format!("{value}\n")))
        .unwrap_or_else(|error| panic!("LUCERNA_GOLDEN: {}: {error}", file.display()));
}

/// A 32-bit number within a struct.
struct Field {
    name: String,
    kind: ScalarKind,
    offset: u32,
}

fn described(fields: &[Field]) -> Value {
    let one = |Field { name, kind, offset }: &Field| json!({ "name": name, "type": name_of(*kind), "offset": offset });
    fields.iter().map(one).collect()
}

fn name_of(kind: ScalarKind) -> &'static str {
    match kind {
        ScalarKind::Float => "f32",
        ScalarKind::Sint => "i32",
        _ => "u32",
    }
}

/// Each element as hexadecimal words and as numbers.
fn elements<T: NoUninit>(elements: &[T], fields: &[Field]) -> Value {
    let one = |element: &T| {
        let words: Vec<u32> =
            bytemuck::bytes_of(element).chunks_exact(4).map(bytemuck::pod_read_unaligned).collect();
        let number = |field: &Field| {
            let word = words.get(field.offset as usize / 4).copied().unwrap_or_default();
            match field.kind {
                ScalarKind::Float => in_json(f64::from(f32::from_bits(word))),
                ScalarKind::Sint => json!(word as i32),
                _ => json!(word),
            }
        };
        json!({
            "words": words.iter().map(|word| format!("{word:08x}")).collect::<Vec<_>>(),
            "numbers": fields.iter().map(number).collect::<Vec<_>>(),
        })
    };
    elements.iter().step_by(step_of(elements.len())).map(one).collect()
}

/// JSON has no NaN and no infinity: these become strings.
fn in_json(number: f64) -> Value {
    if number.is_finite() { json!(number) } else { json!(number.to_string()) }
}

/// The numbers of an element of the array behind a variable.
fn fields_of(module: &Module, variable: &str) -> Vec<Field> {
    let mut out = Vec::new();
    let found = module.global_variables.iter().find(|(_, of)| of.name.as_deref() == Some(variable));
    if let Some((_, of)) = found
        && let TypeInner::Array { base, .. } = module.types[of.ty].inner
    {
        flatten(module, base, "", 0, &mut out);
    }
    out
}

fn flatten(module: &Module, ty: Handle<Type>, name: &str, offset: u32, out: &mut Vec<Field>) {
    const COMPONENTS: [&str; 4] = ["x", "y", "z", "w"];
    let joined = |part: &str| match name {
        "" => part.to_owned(),
        name => format!("{name}.{part}"),
    };
    match &module.types[ty].inner {
        TypeInner::Scalar(scalar) | TypeInner::Atomic(scalar) => {
            out.push(Field { name: name.to_owned(), kind: scalar.kind, offset });
        }
        TypeInner::Vector { size, scalar } => {
            for (ix, part) in COMPONENTS.iter().enumerate().take(*size as usize) {
                let offset = offset + 4 * ix as u32;
                out.push(Field { name: joined(part), kind: scalar.kind, offset });
            }
        }
        TypeInner::Matrix { columns, rows, scalar } => {
            let stride = if *rows as u32 == 2 { 8 } else { 16 };
            for column in 0..*columns as u32 {
                for (ix, part) in COMPONENTS.iter().enumerate().take(*rows as usize) {
                    let offset = offset + stride * column + 4 * ix as u32;
                    let name = joined(&format!("{column}.{part}"));
                    out.push(Field { name, kind: scalar.kind, offset });
                }
            }
        }
        TypeInner::Array { base, size: naga::ArraySize::Constant(n), stride } => {
            for ix in 0..n.get() {
                flatten(module, *base, &joined(&ix.to_string()), offset + stride * ix, out);
            }
        }
        TypeInner::Struct { members, .. } => {
            for member in members {
                let part = member.name.as_deref().unwrap_or("_");
                flatten(module, member.ty, &joined(part), offset + member.offset, out);
            }
        }
        _ => {}
    }
}
