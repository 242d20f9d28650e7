// SPDX-License-Identifier: MIT OR Apache-2.0
//! The crate's own WGSL: it passes, the crate hands out what the files hold, and every file says
//! what it is.

use crate::functions::declared;
use lucerna::shader::{AXES, KERNELS, OVERLAYS, ROOT, Variant, check_tree};
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

pub fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).to_owned()
}

/// Every file of the folder as `wgsl/…`, in order.
fn files_in(folder: &str) -> Vec<String> {
    fn walk(folder: &Path, out: &mut Vec<String>) {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                walk(&path, out);
            } else {
                let name = path.strip_prefix(root()).unwrap().components();
                let name: Vec<_> = name.map(|c| c.as_os_str().to_str().unwrap()).collect();
                out.push(name.join("/"));
            }
        }
    }
    let mut out = Vec::new();
    walk(&root().join(folder), &mut out);
    out.sort();
    out
}

/// Every WGSL file with its text.
fn files() -> Vec<(String, String)> {
    let files = files_in("wgsl").into_iter().filter(|file| file.ends_with(".wgsl"));
    files.map(|file| (file.clone(), fs::read_to_string(root().join(file)).unwrap())).collect()
}

fn is_kernel(file: &str) -> bool {
    file.contains(&format!("/{KERNELS}/"))
}

#[test]
fn the_tree_passes_and_the_crate_holds_what_it_gave() {
    let tree = check_tree(&root().join("wgsl"), AXES).unwrap();
    let checked: Vec<_> =
        tree.kernels.iter().map(|k| (k.name.as_str(), k.variant, k.resources())).collect();
    let held: Vec<_> =
        lucerna::kernels().iter().map(|k| (k.name, k.variant, k.resources)).collect();
    assert_eq!(held, checked);
    let checked: Vec<_> = tree.library.iter().map(|m| m.import_path.as_str()).collect();
    let library = lucerna::library();
    let held: Vec<_> = library.iter().map(|m| m.import_path.as_str()).collect();
    assert_eq!(held, checked);
}

/// Every entry point is in `docs/kernel-tests.md` (which `scripts/mutants --kernels` writes from what tests dispatch), with
/// tests that run it, and each test that the table names is there.
#[test]
fn every_entry_point_is_run_by_a_test() {
    let table = fs::read_to_string(root().join("docs/kernel-tests.md")).unwrap();
    let rows: BTreeMap<&str, &str> = table
        .lines()
        .filter_map(|line| line.strip_prefix("| `")?.split_once("` | "))
        .map(|(entry, cells)| (entry, cells.split(" | ").next().unwrap_or_default()))
        .collect();
    let expected: BTreeSet<String> = lucerna::kernels()
        .iter()
        .flat_map(|k| {
            k.interface.entry_points.iter().map(|entry| format!("{}#{}", k.name, entry.name))
        })
        .collect();
    let found: BTreeSet<String> = rows.keys().map(|&entry| entry.to_owned()).collect();
    assert_eq!(
        found, expected,
        "entry points in docs/kernel-tests.md; run scripts/mutants --kernels"
    );
    for (entry, tests) in rows {
        assert_ne!(tests, "-", "no test runs {entry}");
        for test in tests.split(", ") {
            let parts: Vec<_> = test.trim_matches('`').split("::").collect();
            let (binary, name) = (parts[0], parts[parts.len() - 1]);
            // A module of the binary, or its main file.
            let module = if parts.len() > 2 { parts[1] } else { "main" };
            let places = [format!("tests/{binary}/{module}.rs"), format!("tests/{binary}/main.rs")];
            let is_there = places.iter().any(|file| {
                let text = fs::read_to_string(root().join(file)).unwrap_or_default();
                text.contains(&format!("fn {name}("))
            });
            assert!(is_there, "{entry}: neither of {places:?} has the test {name}");
        }
    }
}

/// Each combination of the axes that a kernel meets is there once, and only those: a table made by hand for kernels whose
/// axes depend on each other.
#[test]
fn kernels_exist_in_the_combinations_that_they_meet() {
    let n = |name: &str| lucerna::kernels().iter().filter(|k| k.name == name).count();
    // No seam; rays × textures; of the pyramid textures or buffers.
    assert_eq!(n("voxel_light/carry"), 1);
    assert_eq!(n("reference/path_trace"), 4);
    assert_eq!(n("voxel_pyramid/fill"), 2);
    // Rays × textures × (rays, maps, cones in textures, cones in buffers, cones from surfel to surfel, for both of these).
    assert_eq!(n("frame/direct"), 24);
    assert_eq!(n("voxel_light/gather"), 24);
    // Textures alone: nothing is traced.
    assert_eq!(n("frame/gbuffer"), 2);
    // Whatever is asked for, one of them fits.
    for kernel in lucerna::kernels() {
        for other in lucerna::kernels() {
            let fits = lucerna::kernels()
                .iter()
                .filter(|k| k.name == kernel.name && k.variant.agrees(other.variant, k.axes));
            assert_eq!(fits.count(), 1, "{} in {}", kernel.name, other.variant);
        }
    }
}

#[test]
fn modules_and_kernels_are_the_files() {
    let mut left: BTreeSet<_> = files().into_iter().collect();
    let library = lucerna::library();
    for module in lucerna::modules() {
        let file = (module.file.to_owned(), module.source.to_owned());
        assert!(left.remove(&file), "{} is no file, or another text", module.file);
        let path = module.import_path.replace("::", "/").replacen(ROOT, "", 1);
        let folder = match module.overlay {
            None => "wgsl".to_owned(),
            Some((axis, value)) => format!("wgsl/{OVERLAYS}/{axis}/{value}"),
        };
        assert_eq!(module.file, format!("{folder}{path}.wgsl"));
        for import in module.imports {
            assert!(library.get(import).is_some(), "{} imports {import}", module.file);
        }
        let variant: Variant = match module.overlay {
            None => Variant::BASELINE,
            Some((axis, value)) => format!("{axis}={value}").parse().unwrap(),
        };
        let library = lucerna::library_of(variant);
        assert_eq!(library.get(module.import_path).unwrap().text, module.source);
    }
    for kernel in lucerna::kernels() {
        assert_eq!(kernel.file, format!("wgsl/{KERNELS}/{}.wgsl", kernel.name));
        let text = fs::read_to_string(root().join(kernel.file)).unwrap();
        assert_eq!(kernel.source, text, "{}", kernel.file);
        left.remove(&(kernel.file.to_owned(), text));
        assert!(!kernel.interface.entry_points.is_empty(), "{}", kernel.name);
    }
    let left: Vec<_> = left.into_iter().map(|(file, _)| file).collect();
    assert!(left.is_empty(), "in no table: {left:?}");
}

#[test]
fn every_source_has_a_licence() {
    const LICENCE: &str = "SPDX-License-Identifier: MIT OR Apache-2.0";
    // Places in these are tested, and they are nobody's source.
    const WITHOUT: &str = "fixtures/broken_wgsl/";
    let folders = [
        ".ci",
        "build",
        "cli/src",
        "cli/tests",
        "examples",
        "fixtures",
        "fuzz/fuzz_targets",
        "fuzz/src",
        "scripts",
        "src",
        "tests",
        "wgsl",
    ];
    let mut n = 0;
    let mut wrong = Vec::new();
    let single = ["build.rs", "fuzz/seed.py"].map(str::to_owned);
    for file in folders.iter().flat_map(|folder| files_in(folder)).chain(single) {
        let ending = Path::new(&file).extension().and_then(|ending| ending.to_str());
        let mark = match ending {
            Some("rs" | "wgsl" | "mjs") => "//",
            Some("py" | "sh") => "#",
            None if file.starts_with("scripts/") || file.starts_with(".ci/") => "#",
            _ => continue,
        };
        if file.starts_with(WITHOUT) {
            continue;
        }
        n += 1;
        let text = fs::read_to_string(root().join(&file)).unwrap();
        // Behind `#!`, which is the first line where it stands.
        let first = text.lines().find(|line| !line.starts_with("#!/"));
        if first != Some(&format!("{mark} {LICENCE}")) {
            wrong.push(file);
        }
    }
    assert!(n > 250, "only {n} sources were found");
    assert!(wrong.is_empty(), "no SPDX line in\n{}", wrong.join("\n"));
}

/// Which of the crate's modules a module's files name. (Comments may name any.)
fn used_modules(of: &str) -> BTreeSet<String> {
    let own = |file: &String| {
        file.strip_prefix("src/").and_then(|rest| rest.split(['/', '.']).next()) == Some(of)
    };
    let mut used = BTreeSet::new();
    for file in files_in("src").into_iter().filter(own) {
        let text = fs::read_to_string(root().join(&file)).unwrap();
        let code = text.lines().map(|line| line.split("//").next().unwrap_or_default());
        for part in code.flat_map(|line| line.split("crate::").skip(1)) {
            let name: String =
                part.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect();
            used.insert(name);
        }
    }
    used.remove(of);
    used
}

#[test]
fn modules_use_each_other_without_circles() {
    let text = fs::read_to_string(root().join("src/lib.rs")).unwrap();
    let mut left: BTreeMap<String, BTreeSet<String>> = text
        .lines()
        .filter_map(|line| line.trim_start_matches("pub ").strip_prefix("mod "))
        .map(|rest| rest.trim_end_matches(';').to_owned())
        .map(|name| (name.clone(), used_modules(&name)))
        .collect();
    assert!(left.len() > 12 && left["frame"].contains("components"), "{left:?}");
    // Modules that use none of those that are left, until there are none.
    loop {
        let names: BTreeSet<String> = left.keys().cloned().collect();
        left.retain(|_, used| used.intersection(&names).next().is_some());
        if left.len() == names.len() {
            break;
        }
    }
    assert!(left.is_empty(), "modules that use each other in a circle, or one of these: {left:#?}");
}

#[test]
fn every_module_has_a_purpose() {
    let mut wrong = Vec::new();
    for (file, text) in files() {
        if !text.lines().nth(1).is_some_and(|line| line.starts_with("//! ") && line.len() > 12) {
            wrong.push(format!("{file}:2: no purpose (`//! …`)"));
        }
        let starts = ["//! Dispatch: ", "//! Draw: "];
        if is_kernel(&file) && !starts.iter().any(|start| text.contains(start)) {
            wrong.push(format!("{file}: a kernel's header gives its dispatch or draw"));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn every_function_of_a_module_says_what_it_does() {
    let mut wrong = Vec::new();
    for (file, text) in files().iter().filter(|(file, _)| !is_kernel(file)) {
        let lines: Vec<_> = text.lines().collect();
        for (ix, line) in lines.iter().enumerate() {
            let above = lines[..ix].iter().rev().find(|line| !line.starts_with('@'));
            if line.starts_with("fn ") && !above.is_some_and(|line| line.starts_with("///")) {
                wrong.push(format!("{file}:{}: {line}", ix + 1));
            }
        }
    }
    assert!(wrong.is_empty(), "no `///` before\n{}", wrong.join("\n"));
}

/// A stranger who searches for a name finds one thing.
#[test]
fn no_name_stands_twice() {
    let mut known: BTreeMap<String, String> = BTreeMap::new();
    let mut wrong = Vec::new();
    // Overlays of a path have its names; kernels are named by their files.
    let apart = ["wgsl/variants/", "wgsl/kernels/"];
    for (file, text) in files() {
        if apart.iter().any(|folder| file.starts_with(folder)) {
            continue;
        }
        for found in declared(&text, &["fn", "struct", "const", "alias", "override"]) {
            let place = format!("{file}:{}", found.line);
            if let Some(first) = known.insert(found.name.clone(), place.clone()) {
                wrong.push(format!("`{}`: {first} and {place}", found.name));
            }
        }
    }
    assert!(wrong.is_empty(), "names that stand twice:\n{}", wrong.join("\n"));
}
