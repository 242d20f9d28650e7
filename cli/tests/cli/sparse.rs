// SPDX-License-Identifier: MIT OR Apache-2.0
//! `lucerna bake --technique sparse-probes`, `lucerna merge`, and `lucerna render` with such bakes.

use crate::support::{Ran, cornell, empty_folder, has_adapter, path, run};
use std::path::Path;

const SMALL: [&str; 8] =
    ["--texels", "400", "--probes", "8", "--texel-rays", "64", "--cluster-size", "128"];

fn bake(output: &Path, more: &[&str]) -> Ran {
    let scene = cornell();
    let fixed = ["bake", &scene, "--technique", "sparse-probes", "-o", path(output)];
    run(&[&fixed, &SMALL[..], more].concat())
}

fn render(output: &Path, more: &[&str]) -> Ran {
    let scene = cornell();
    let fixed = ["render", &scene, "--technique", "sparse-probes", "--size", "32x32"];
    let frames = ["--frames", "1", "--warm-up", "4", "-o", path(output)];
    run(&[&fixed, &frames[..], more].concat())
}

/// Bakes, renders with the bake and without one; what means nothing is refused, and so are files that do not fit.
#[test]
fn sparse_bakes_are_used_where_they_fit() {
    if !has_adapter() {
        return;
    }
    let folder = empty_folder("sparse_bakes");
    let [file, png, list, bare] =
        ["a.sparse", "a.png", "list.json", "bare.png"].map(|name| folder.join(name));
    bake(&file, &[]).exits(0).says(&["8 probes", "receivers in", "energy kept", "bytes"]);
    assert!(!folder.join("a.sparse.part").exists(), "the unfinished file is left");
    let named = path(&file);
    render(&png, &["--bake", named]).exits(0).says(&["8 probes", "energy is kept"]);
    render(&png, &["--bake", named, "--debug-view", "texels"]).exits(0);
    render(&png, &["--bake", named, "--update-every", "4"]).exits(0);
    render(&png, &["--bake", named, "--probes", "9"]).exits(1).says(&["--probes is the bake's"]);
    render(&png, &["--bake", named, "--bake", named]).exits(1).says(&["takes one --bake"]);
    render(&png, &["--bake", "no-such-file"]).exits(1).says(&["no-such-file: "]);
    render(&png, &["--bake", &cornell()]).exits(1).says(&["is not a file of sparse probes"]);
    render(&bare, &SMALL).exits(0).says(&["baking for this picture alone"]);
    for flag in ["--relight", "--sky-parts"] {
        bake(&file, &[flag]).exits(1).says(&["means nothing to sparse-probes"]);
    }
    bake(&file, &["--cells", "9"]).exits(1).says(&["--cells is a setting of"]);
    bake(&file, &["--order", "8"]).exits(2);
    std::fs::write(&list, "[[2.5, 2.5, 2.5], [3, 1, 1], [2.7, 9, 2.7]]").unwrap();
    let listed = folder.join("list.sparse");
    bake(&listed, &["--probe-list", path(&list), "--radius", "9"]).exits(0).says(&[
        "2 probes",
        "1 of 3 given probes",
        "note: probes count 9.00 m far",
    ]);
    bake(Path::new("no/such/folder.sparse"), &[]).exits(1).says(&["there is no folder"]);
}

/// Parts are joined to the bytes of the whole; one that is missing is named; a part alone, or parts of different bakes, are no bake.
#[test]
fn parts_of_bakes_are_merged() {
    if !has_adapter() {
        return;
    }
    let folder = empty_folder("sparse_parts");
    let [whole, first, second, other, merged, png] =
        ["whole", "first", "second", "other", "merged", "a.png"].map(|name| folder.join(name));
    bake(&whole, &[]).exits(0);
    bake(&first, &["--shard", "0/2"]).exits(0);
    bake(&second, &["--shard", "1/2"]).exits(0);
    bake(&other, &["--shard", "1/2", "--seed", "1"]).exits(0);
    let merge = |parts: &[&Path]| {
        let parts: Vec<&str> = parts.iter().map(|of| path(of)).collect();
        run(&[&["merge", "-o", path(&merged)], parts.as_slice()].concat())
    };
    merge(&[&second, &first]).exits(0);
    let [found, expected] = [&merged, &whole].map(|file| std::fs::read(file).unwrap());
    assert!(found == expected, "two parts joined differ from the whole");
    merge(&[&first]).exits(1).says(&["--shard 1/2"]);
    merge(&[&first, &other]).exits(1).says(&["a part of another bake"]);
    merge(&[&first, Path::new(&cornell())]).exits(1).says(&["is not a file of sparse probes"]);
    render(&png, &["--bake", path(&first)]).exits(1).says(&["is not complete", "--shard 1/2"]);
    bake(&first, &["--shard", "2/2"]).exits(2);
}

/// Ten lights' colours are found again, to 1 %, from a picture that was rendered with them; a light that nobody sees, and two in one place, are named.
#[test]
fn colours_of_lights_are_found() {
    if !has_adapter() {
        return;
    }
    let folder = empty_folder("fit_lights");
    let [file, target, fitted, json] =
        ["a.sparse", "target.exr", "fitted.exr", "fit.json"].map(|name| folder.join(name));
    let places = [
        "0.7,4.6,1.5",
        "4.7,4.6,1.5",
        "2.7,2.7,0.5",
        "0.6,0.3,0.8",
        "4.6,0.9,0.8",
        "2.8,1.5,1.9",
        "0.8,2,4.5",
        "4.8,2.2,4.4",
        "2.1,5.2,4.7",
        "1.2,3.3,2.9",
    ];
    let colour = |ix: usize| [ix as f64 + 1.0, 10.0 - ix as f64, (2 + ix % 3) as f64];
    let light = |ix: usize| {
        let [r, g, b] = colour(ix);
        format!("kind=point position={} intensity={r},{g},{b}", places[ix])
    };
    let lights: Vec<String> = (0..10).map(light).collect();
    let with = |lights: &[String]| -> Vec<String> {
        lights.iter().flat_map(|of| ["--light".into(), of.clone()]).collect()
    };
    let scene = cornell();
    let run_with = |command: &[&str], lights: &[String]| {
        let given = with(lights);
        let given: Vec<&str> = given.iter().map(String::as_str).collect();
        run(&[command, &["--no-scene-lights"], &given].concat())
    };
    bake(&file, &[]).exits(0);
    let of_bake = ["--technique", "sparse-probes", "--bake", path(&file), "--frames", "1"];
    let frames = [&of_bake[..], &["--warm-up", "12", "--settled", "0"]].concat();
    let size = ["--size", "48x48", "-o", path(&target)];
    run_with(&[&["render", &scene], &frames[..], &size].concat(), &lights).exits(0);
    let fit = [&["fit-lights", &scene, "--picture", path(&target)], &frames[..]].concat();
    let outputs = ["-o", path(&fitted), "--json", path(&json)];
    run_with(&[&fit[..], &outputs].concat(), &lights).exits(0).says(&[
        "light 10: ",
        "is not explained by the lights",
        "fitted in",
    ]);
    let found: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(&json).unwrap()).unwrap();
    for ix in 0..10 {
        for (k, expected) in colour(ix).into_iter().enumerate() {
            let found = found["lights"][ix]["intensity"][k].as_f64().unwrap();
            assert!(
                (found / expected - 1.0).abs() < 0.01,
                "light {ix}, channel {k}: {found}, expected {expected} within 1 %"
            );
        }
    }
    // A light outside of the box, and one where another is.
    let mut more = lights[..2].to_vec();
    more.extend(["kind=point position=-3,2,2".into(), lights[0].clone()]);
    run_with(&[&fit[..], &outputs].concat(), &more)
        .exits(0)
        .says(&["does not show light 3", "cannot tell lights 1, 4 apart"]);
    run_with(&[&fit[..], &outputs].concat(), &[])
        .exits(1)
        .says(&["has no point, spot or directional"]);
    let without = ["fit-lights", &scene, "--picture", path(&target), "-o", path(&fitted)];
    let other = [&fit[..], &outputs, &["--channel", "irradiance"]].concat();
    run_with(&other, &lights).exits(1).says(&["leave --channel and --debug-view out"]);
    let unbaked = [&without[..], &["--technique", "sparse-probes"]].concat();
    run_with(&unbaked, &lights).exits(1).says(&["give the technique sparse-probes a --bake"]);
    let traced = [&without[..], &["--frames", "1"]].concat();
    run_with(&traced, &lights[..1]).exits(0).says(&["light 1: "]);
}

/// Things of other files are placed in a scene, and bakes know nothing of them.
#[test]
fn objects_are_placed() {
    if !has_adapter() {
        return;
    }
    let folder = empty_folder("objects");
    let [file, png] = ["a.sparse", "a.png"].map(|name| folder.join(name));
    bake(&file, &[]).exits(0);
    let scene = cornell();
    let object = |spec: &str| format!("{scene} {spec}");
    let small = object("position=2,3,2 scale=0.1 turn=30");
    render(&png, &["--bake", path(&file), "--object", &small]).exits(0).says(&["8 probes"]);
    render(&png, &[&SMALL[..], &["--object", &small]].concat())
        .exits(0)
        .says(&["baking for this picture alone"]);
    let probes = ["--technique", "probe-volume", "--cells", "8"];
    for technique in [&["--technique", "reference"][..], &probes] {
        let fixed = ["render", &scene, "--size", "16x16", "--frames", "1", "-o", path(&png)];
        run(&[&fixed, technique, &["--object", &small]].concat()).exits(0);
    }
    for (spec, says) in [
        ("scale=0", "scale must be above 0"),
        ("position=1,2", "expected three numbers"),
        ("size=3", "unknown scene format"),
    ] {
        let ran = render(&png, &["--bake", path(&file), "--object", &object(spec)]);
        let code = if spec.starts_with("size") { 1 } else { 2 };
        ran.exits(code).says(&[says]);
    }
}
