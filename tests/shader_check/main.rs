// SPDX-License-Identifier: MIT OR Apache-2.0
//! The check that the build runs over `wgsl/`: every fault is refused, at its place, and for that
//! fault alone.

mod cases;
mod functions;
mod own_tree;

use cases::{CASES, Expected};
use lucerna::shader::{
    AXES, Axis, AxisValue, Problem, RAY_QUERY, Resources, Rule, Variant, check_tree,
};
use naga::valid::Capabilities;
use std::fs;
use std::path::{Path, PathBuf};

fn fixtures(folder: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures").join(folder)
}

fn copy_tree(from: &Path, to: &Path) {
    fs::create_dir_all(to).unwrap();
    for entry in fs::read_dir(from).unwrap() {
        let entry = entry.unwrap();
        let target = to.join(entry.file_name());
        if entry.file_type().unwrap().is_dir() {
            copy_tree(&entry.path(), &target);
        } else {
            fs::copy(entry.path(), target).unwrap();
        }
    }
}

/// A copy of a fixture, to be changed.
fn copy_of(tree: &str, purpose: &str) -> PathBuf {
    let copy = Path::new(env!("CARGO_TARGET_TMPDIR")).join("shader_check").join(purpose).join(tree);
    let _ = fs::remove_dir_all(&copy);
    copy_tree(&fixtures("broken_wgsl").join(tree), &copy);
    copy
}

fn found(problems: &[Problem], root: &Path) -> String {
    let line = |p: &Problem| {
        let file = p.file.strip_prefix(root).unwrap_or(&p.file);
        format!("    {:?} {}:{}:{} {}", p.rule, file.display(), p.line, p.column, p.message)
    };
    problems.iter().map(line).collect::<Vec<_>>().join("\n")
}

fn is_as_expected(problem: &Problem, root: &Path, expected: &Expected) -> bool {
    let &(rule, file, line, column, fragment) = expected;
    problem.rule == rule
        && problem.file == root.join(file)
        && (problem.line, problem.column) == (line, column)
        && problem.message.contains(fragment)
}

#[test]
fn every_fault_is_refused_at_its_place_and_its_repair_passes() {
    let mut wrong = Vec::new();
    for case in CASES {
        let root = fixtures("broken_wgsl").join(case.tree);
        match check_tree(&root, AXES) {
            Ok(_) => wrong.push(format!("{}: passes", case.tree)),
            Err(problems) => {
                let all_match = problems.len() == case.expected.len()
                    && problems.iter().zip(case.expected).all(|(p, e)| is_as_expected(p, &root, e));
                if !all_match {
                    let found = found(&problems, &root);
                    let expected = case.expected;
                    wrong.push(format!("{}: found\n{found}\n  not {expected:?}", case.tree));
                }
            }
        }
        let repaired = copy_of(case.tree, "repaired");
        for &(file, from, to) in case.repairs {
            let text = fs::read_to_string(repaired.join(file)).unwrap();
            if !text.contains(from) {
                wrong.push(format!("{}: {file} has no `{from}` to repair", case.tree));
            }
            fs::write(repaired.join(file), text.replace(from, to)).unwrap();
        }
        if let Err(problems) = check_tree(&repaired, AXES) {
            let found = found(&problems, &repaired);
            wrong.push(format!("{}: repaired, and still\n{found}", case.tree));
        }
    }
    assert!(wrong.is_empty(), "{} of {}:\n{}", wrong.len(), CASES.len(), wrong.join("\n"));
}

#[test]
fn every_fixture_is_checked_by_a_test() {
    let apart = [
        "not_utf8",
        "name_no_identifier",
        "overlay_of_no_variant",
        "overlay_of_nothing",
        "overlay_on_two_axes",
        "overlay_in_no_folder",
        "barrier_not_uniform",
    ];
    for entry in fs::read_dir(fixtures("broken_wgsl")).unwrap() {
        let name = entry.unwrap().file_name().into_string().unwrap();
        let listed = CASES.iter().any(|c| c.tree == name) || apart.contains(&name.as_str());
        assert!(listed || name == "README.md", "{name} is in no table");
    }
}

/// Asserts that a tree has exactly this one problem.
fn assert_one(root: &Path, axes: &[Axis], expected: Expected) {
    let problems = check_tree(root, axes).unwrap_err();
    assert!(
        problems.len() == 1 && is_as_expected(&problems[0], root, &expected),
        "found\n{}\n  not {expected:?}",
        found(&problems, root)
    );
}

#[test]
fn text_that_is_not_utf8_is_refused_at_the_first_wrong_byte() {
    let root = fixtures("broken_wgsl/not_utf8");
    // Behind `/// Ü, `, whose second letter takes two bytes.
    assert_one(&root, AXES, (Rule::Read, "math/a.wgsl", 3, 8, "UTF-8"));
    let repaired = copy_of("not_utf8", "repaired");
    let text = fs::read(repaired.join("math/a.wgsl")).unwrap();
    fs::write(repaired.join("math/a.wgsl"), String::from_utf8_lossy(&text).as_bytes()).unwrap();
    check_tree(&repaired, AXES).unwrap();
}

#[test]
fn overlays_that_no_variant_takes_are_refused() {
    let root = fixtures("broken_wgsl/overlay_of_no_variant");
    let file = "variants/rays/ray_querry/scene/rays.wgsl";
    assert_one(
        &root,
        AXES,
        (Rule::UnknownVariant, file, 1, 1, "there are rays/ray_query, textures/none"),
    );
    let repaired = copy_of("overlay_of_no_variant", "repaired");
    let axis = repaired.join("variants/rays");
    fs::rename(axis.join("ray_querry"), axis.join("ray_query")).unwrap();
    check_tree(&repaired, AXES).unwrap();

    let root = fixtures("broken_wgsl/overlay_in_no_folder");
    let file = "variants/rays.wgsl";
    assert_one(
        &root,
        AXES,
        (Rule::UnknownVariant, file, 1, 1, "there are rays/ray_query, textures/none"),
    );
    let repaired = copy_of("overlay_in_no_folder", "repaired");
    fs::remove_file(repaired.join(file)).unwrap();
    check_tree(&repaired, AXES).unwrap();
}

#[test]
fn overlays_must_replace_one_module_once() {
    let root = fixtures("broken_wgsl/overlay_of_nothing");
    let file = "variants/rays/ray_query/scene/rayz.wgsl";
    let message = "replaces `lucerna::scene::rayz`, which does not exist";
    assert_one(&root, AXES, (Rule::UnknownVariant, file, 1, 1, message));
    let root = fixtures("broken_wgsl/overlay_on_two_axes");
    let file = "variants/textures/none/scene/rays.wgsl";
    assert_one(&root, AXES, (Rule::UnknownVariant, file, 1, 1, "is replaced on two axes"));
    let repaired = copy_of("overlay_on_two_axes", "repaired");
    fs::remove_dir_all(repaired.join("variants/textures")).unwrap();
    check_tree(&repaired, AXES).unwrap();
}

#[test]
fn names_that_are_no_identifiers_are_refused() {
    let root = fixtures("broken_wgsl/name_no_identifier");
    let file = "kernels/two-words.wgsl";
    assert_one(&root, AXES, (Rule::ImportPath, file, 1, 1, "`two-words` is not an identifier"));
    let repaired = copy_of("name_no_identifier", "repaired").join("kernels");
    fs::rename(repaired.join("two-words.wgsl"), repaired.join("two_words.wgsl")).unwrap();
    check_tree(repaired.parent().unwrap(), AXES).unwrap();
}

#[test]
fn missing_folder_is_refused() {
    let root = fixtures("broken_wgsl/there_is_none");
    assert_one(&root, AXES, (Rule::Read, "", 1, 1, "cannot be read"));
}

const fn value(name: &'static str) -> AxisValue {
    AxisValue { name, capabilities: Capabilities::empty() }
}

/// Axes are constants elsewhere.
fn leaked<const N: usize>(values: [AxisValue; N]) -> &'static [AxisValue] {
    Box::leak(Box::new(values))
}

/// Each value's capabilities hold for its kernels and modules only.
#[test]
fn capabilities_are_the_variants_own() {
    let root = fixtures("good_wgsl");
    let values = leaked([value("software"), value("ray_query")]);
    let poor = [Axis { name: "rays", values }];
    // Types have no place, so the kernel that has one by import is told apart from its module.
    let problems = check_tree(&root, &poor).unwrap_err();
    let files = ["kernels/rays/any_hit.wgsl", "variants/rays/ray_query/scene/rays.wgsl"];
    assert_eq!(problems.len(), files.len(), "{}", found(&problems, &root));
    for (problem, file) in problems.iter().zip(files) {
        let expected = (Rule::Validation, file, 1, 1, "RAY_QUERY");
        assert!(is_as_expected(problem, &root, &expected), "{}", found(&problems, &root));
    }

    for (tree, needed) in [
        ("capability_f64", Capabilities::FLOAT64),
        ("capability_f16", Capabilities::SHADER_FLOAT16),
        ("capability_i64", Capabilities::SHADER_INT64),
        ("capability_ray_query", Capabilities::RAY_QUERY),
    ] {
        let values = leaked([AxisValue { name: "rich", capabilities: needed }]);
        let rich = [Axis { name: "device", values }];
        if let Err(problems) = check_tree(&fixtures("broken_wgsl").join(tree), &rich) {
            panic!("{tree} under {needed:?}:\n{}", found(&problems, Path::new("")));
        }
    }
}

/// The validator's and the budget's rules on texture atomics are two.
#[test]
fn texture_atomics_are_over_the_budget_where_they_validate() {
    let values = leaked([AxisValue { name: "rich", capabilities: Capabilities::TEXTURE_ATOMIC }]);
    let axes = [Axis { name: "device", values }];
    let root = fixtures("broken_wgsl/texture_atomics");
    let expected = (Rule::Budget, "kernels/k.wgsl", 4, 1, "atomics on a texture");
    assert_one(&root, &axes, expected);
}

/// naga 30 does not look at the control flow around barriers. When this fails, naga has learnt it:
/// move the tree into the table. Until then `scripts/check-tint` alone stands guard.
#[test]
fn naga_lets_barriers_in_divergent_control_flow_pass() {
    check_tree(&fixtures("broken_wgsl/barrier_not_uniform"), AXES).unwrap();
}

/// One mistake in a module is one problem, however many kernels import it, and its report shows the text.
#[test]
fn a_problem_is_reported_once_and_shows_the_text() {
    let problems = check_tree(&fixtures("broken_wgsl/type_error"), AXES).unwrap_err();
    assert_eq!(problems.len(), 1);
    let shown = problems[0].to_string();
    assert!(shown.contains("math/a.wgsl:5:12: "), "{shown}");
    assert!(shown.contains("return 2u * x;"), "{shown}");
    assert!(!shown.contains('\u{1b}'), "{shown}");
}

#[test]
fn good_tree_gives_its_modules_and_kernels() {
    let tree = check_tree(&fixtures("good_wgsl"), AXES).unwrap();
    let modules: Vec<_> = tree.library.iter().map(|m| m.import_path.as_str()).collect();
    assert_eq!(modules, ["lucerna::math::a", "lucerna::math::b", "lucerna::scene::rays"]);
    let overlays: Vec<_> = tree
        .overlays
        .iter()
        .map(|of| (of.axis, of.value, of.source.import_path.as_str()))
        .collect();
    assert_eq!(overlays, [(0, 1, "lucerna::scene::rays")]);

    let any_hit = Resources { storage_buffers: 1, workgroup_invocations: 64, ..Default::default() };
    let expected = [
        (
            "fill",
            Variant::BASELINE,
            Resources {
                storage_buffers: 1,
                storage_textures: 1,
                sampled_textures: 1,
                samplers: 1,
                uniform_buffers: 1,
                workgroup_invocations: 256,
                // 256 floats; a u32, rounded up.
                workgroup_bytes: 1024 + 16,
                ..Default::default()
            },
        ),
        (
            "rays/any_hit",
            Variant::BASELINE,
            Resources { storage_buffers: 2, seam_storage_buffers: 1, ..any_hit },
        ),
        ("rays/any_hit", Variant::BASELINE.with(RAY_QUERY), any_hit),
    ];
    let found: Vec<_> =
        tree.kernels.iter().map(|k| (k.name.as_str(), k.variant, k.resources())).collect();
    assert_eq!(found, expected);
    let fill = tree.kernels.iter().find(|kernel| kernel.name == "fill").unwrap();
    assert_eq!(fill.source.imports(), ["lucerna::math::b"]);
    assert_eq!(fill.interface().entry_points[0].workgroup_size, [16, 16, 1]);
}
