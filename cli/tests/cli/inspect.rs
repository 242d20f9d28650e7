// SPDX-License-Identifier: MIT OR Apache-2.0
//! `kernels`, `export`, `compare`, `sheet`, `doctor`.

use crate::support::{empty_folder, fixture, has_adapter, lucerna, names_in, path, run};
use lucerna::naga;
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::Stdio;

#[test]
fn kernels_lists_all() {
    let list = run(&["kernels"]).exits(0);
    assert_eq!(list.stderr, "");
    assert_eq!(list.stdout.lines().count(), 1 + lucerna::kernels().len(), "{list}");
    for kernel in lucerna::kernels() {
        let variant = kernel.variant.to_string();
        let is_row = |line: &str| {
            let mut words = line.split_whitespace();
            words.next() == Some(kernel.name) && words.next() == Some(variant.as_str())
        };
        assert!(list.stdout.lines().any(is_row), "{} {variant}\n{list}", kernel.name);
    }
}

#[test]
fn kernels_describes_one() {
    let one = run(&["kernels", "rays/any_hit"]).exits(0);
    for part in [
        "rays/any_hit (baseline)",
        "rays/any_hit (rays=ray_query)",
        "file: wgsl/kernels/rays/any_hit.wgsl",
        "Dispatch: ",
        "entry point: main (compute), workgroup 64x1x1",
        "lucerna::scene::rays",
        "@group(1) @binding(2) blocked: storage buffer, read and write",
        "of 8 storage buffers",
    ] {
        assert!(one.stdout.contains(part), "`{part}`\n{one}");
    }
    let wgsl = run(&["kernels", "rays/any_hit", "--wgsl"]).exits(0);
    naga::front::wgsl::parse_str(&wgsl.stdout).unwrap();
}

#[test]
fn unknown_kernel_fails_and_lists_those_there_are() {
    run(&["kernels", "rays/nonsense"]).exits(1).gives_nothing().says(&[
        "`rays/nonsense`",
        "rays/any_hit",
        "reference/path_trace",
    ]);
}

#[test]
fn kernels_lists_modules() {
    let list = run(&["kernels", "--modules"]).exits(0);
    let rows: Vec<Vec<_>> = list.stdout.lines().map(|l| l.split_whitespace().collect()).collect();
    let expected: Vec<Vec<_>> = lucerna::modules()
        .iter()
        .filter(|module| module.overlay.is_none())
        .map(|module| vec![module.import_path, module.file])
        .collect();
    assert_eq!(rows, expected);
}

/// The reader takes one line and closes the pipe, which holds less than the whole.
#[test]
fn closed_pipe_is_no_failure() {
    for arguments in [&["kernels", "reference/path_trace", "--wgsl"][..], &["kernels"]] {
        let mut child =
            lucerna(arguments).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        let mut line = String::new();
        // Dropped at the end of the statement.
        BufReader::with_capacity(16, child.stdout.take().unwrap()).read_line(&mut line).unwrap();
        let output = child.wait_with_output().unwrap();
        assert_eq!(String::from_utf8(output.stderr).unwrap(), "", "{arguments:?}");
        assert_eq!(output.status.code(), Some(0), "{arguments:?}");
    }
    // Closed before the first word.
    let mut child =
        lucerna(&["kernels"]).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    drop(child.stdout.take());
    let output = child.wait_with_output().unwrap();
    assert_eq!(String::from_utf8(output.stderr).unwrap(), "");
}

fn assert_valid_wgsl(file: &Path) {
    let text = std::fs::read_to_string(file).unwrap();
    let module = naga::front::wgsl::parse_str(&text).unwrap_or_else(|error| {
        panic!("{}: {}", file.display(), error.emit_to_string(&text));
    });
    let flags = naga::valid::ValidationFlags::all();
    naga::valid::Validator::new(flags, lucerna::shader::BASELINE)
        .validate(&module)
        .unwrap_or_else(|error| panic!("{}: {}", file.display(), error.emit_to_string(&text)));
}

#[test]
fn export_writes_every_kernel_whole() {
    let folder = empty_folder("export").join("new/folders");
    let all = run(&["export", "--target=wgsl", "-o", path(&folder)]).exits(0);
    let files: Vec<_> = all.stdout.lines().map(Path::new).collect();
    let n_writable = lucerna::kernels().iter().filter(|kernel| kernel.composed.is_some()).count();
    assert_eq!(files.len(), n_writable, "{all}");
    for kernel in lucerna::kernels().iter().filter(|kernel| kernel.composed.is_some()) {
        let variant = kernel.variant.to_string();
        let folder = if variant == "baseline" { folder.clone() } else { folder.join(variant) };
        let file = folder.join(format!("{}.wgsl", kernel.name));
        assert!(files.contains(&file.as_path()), "{}\n{all}", file.display());
        assert_valid_wgsl(&file);
    }
    assert_eq!(names_in(&folder.join("rays")), ["any_hit.wgsl", "nearest_hit.wgsl"]);

    let folder = empty_folder("export_one");
    let one = run(&["export", "-o", path(&folder), "rays/any_hit"]).exits(0);
    let expected = ["rays/any_hit.wgsl", "textures=none/rays/any_hit.wgsl"].map(|f| folder.join(f));
    assert_eq!(
        one.stdout.lines().collect::<Vec<_>>(),
        expected.each_ref().map(|f| path(f)),
        "{one}"
    );
    assert_eq!(names_in(&folder), ["rays", "textures=none"]);
    assert_eq!(names_in(&folder.join("rays")), ["any_hit.wgsl"]);
}

#[test]
fn export_of_an_unknown_kernel_or_to_no_folder_fails() {
    let folder = empty_folder("export_wrong");
    run(&["export", "-o", path(&folder), "rays/any_hit", "rays/nonsense"])
        .exits(1)
        .gives_nothing()
        .says(&["`rays/nonsense`", "lucerna kernels"]);
    let file = folder.join("plain_file");
    std::fs::write(&file, "").unwrap();
    run(&["export", "-o", path(&file)]).exits(1).gives_nothing().says(&[path(&file)]);
    assert_eq!(names_in(&folder), ["plain_file"]);
}

#[test]
fn compare_measures() {
    let folder = empty_folder("compare");
    let (reference, noisy) =
        (fixture("compare/cornell_96.exr"), fixture("compare/cornell_96_noisy.exr"));

    let same = run(&["compare", &reference, &reference, "--json"]).exits(0);
    let same: serde_json::Value = serde_json::from_str(&same.stdout).unwrap();
    assert_eq!(same["rmse"], 0.0);
    assert_eq!(same["mean_flip"], 0.0);
    assert_eq!(same["ssim"], 1.0);
    assert_eq!(same["width"], 96);
    assert!(same["psnr_db"].is_null(), "infinite has no number in JSON");

    let table = run(&["compare", &noisy, &reference]).exits(0);
    assert_eq!(table.stderr, "");
    for name in ["size", "mean ratio", "RMSE", "PSNR", "SSIM", "mean FLIP"] {
        assert!(table.stdout.lines().any(|line| line.starts_with(name)), "{name}\n{table}");
    }
    let diff = folder.join("diff.png");
    let json = run(&["compare", &noisy, &reference, "--json", "--diff", path(&diff)]).exits(0);
    let json: serde_json::Value = serde_json::from_str(&json.stdout).unwrap();
    assert!(json["rmse"].as_f64().unwrap() > 0.0, "{json}");
    let picture = lucerna::picture::Picture::read(&diff).unwrap();
    assert_eq!((picture.width, picture.height), (96, 96));
    assert_eq!(names_in(&folder), ["diff.png"]);
}

#[test]
fn compare_refuses_what_does_not_compare() {
    let reference = fixture("compare/cornell_96.exr");
    let other = fixture("compare/cornell_96x72.png");
    run(&["compare", &reference, &other]).exits(1).gives_nothing().says(&["96 x 96", "96 x 72"]);
    run(&["compare", "no_such.exr", &reference]).exits(1).gives_nothing().says(&["no_such.exr"]);
    run(&["compare", &reference, "no_such.exr"]).exits(1).gives_nothing().says(&["no_such.exr"]);
    let scene = fixture("scenes/README.md");
    run(&["compare", &reference, &scene]).exits(1).gives_nothing().says(&["README.md"]);
}

#[test]
fn doctor_lists_adapters() {
    if !has_adapter() {
        return;
    }
    let doctor = run(&["doctor"]).exits(0);
    for part in [
        "(taken by --adapter auto)",
        "baseline kernels: ",
        "ray_query kernels: ",
        "timings per pass: ",
    ] {
        assert!(doctor.stdout.contains(part), "{doctor}");
    }
}

/// Pictures stand side by side, each under its label and its distance to the first.
#[test]
fn sheet_puts_pictures_side_by_side() {
    use lucerna::glam::Vec3;
    use lucerna::picture::{Picture, PngOptions};

    let folder = empty_folder("sheet");
    let plain = |name: &str, width: u32, value: f32| {
        let rgb = vec![Vec3::new(value, 0.25, 0.0); width as usize * 20];
        let file = folder.join(name);
        Picture { width, height: 20, rgb }.write(&file, &PngOptions::default()).unwrap();
        file
    };
    let (first, second) = (plain("first.exr", 60, 0.5), plain("second.exr", 60, 1.0));
    let narrow = plain("narrow.exr", 30, 0.5);
    let out = folder.join("sheet.exr");
    let labelled = format!("twice as red={}", path(&second));
    run(&["sheet", path(&first), &labelled, path(&narrow), "--columns", "2", "-o", path(&out)])
        .exits(0);

    // 8 pixels between and around, 28 for the text; a cell is as wide as its figures, of 24 letters of 6 pixels.
    let sheet = Picture::read(&out).unwrap();
    assert_eq!((sheet.width, sheet.height), (8 + 2 * 152, 8 + 2 * 56));
    let at = |x: u32, y: u32| sheet.rgb[(y * sheet.width + x) as usize];
    for (x, y, red) in [(8, 36, 0.5), (67, 55, 0.5), (160, 36, 1.0), (8, 92, 0.5), (37, 111, 0.5)] {
        assert_eq!(at(x, y), Vec3::new(red, 0.25, 0.0), "{x} {y}");
    }
    // A frame of one pixel around each, and white beyond.
    for (x, y) in [(7, 35), (68, 36), (159, 55), (8, 56), (38, 92)] {
        assert_eq!(at(x, y), Vec3::splat(0.2), "{x} {y}");
    }
    for (x, y) in [(6, 36), (69, 36), (158, 55), (8, 57), (39, 92), (311, 119)] {
        assert_eq!(at(x, y), Vec3::ONE, "{x} {y}");
    }
    let ink = |x: u32, y: u32| {
        let places = (x..x + 60).flat_map(|x| (y..y + 14).map(move |y| (x, y)));
        places.filter(|&(x, y)| at(x, y) == Vec3::ZERO).count()
    };
    assert!(ink(8, 8) > 50 && ink(160, 8) > 50 && ink(8, 64) > 50, "labels");
    assert!(ink(8, 22) == 0 && ink(160, 22) > 30 && ink(8, 78) > 30, "figures");

    run(&["sheet", "-o", path(&out)]).exits(2);
    run(&["sheet", "label=", "-o", path(&out)]).exits(2);
    run(&["sheet", "there_is_none.png", "-o", path(&out)]).exits(1).says(&["there_is_none.png"]);
}
