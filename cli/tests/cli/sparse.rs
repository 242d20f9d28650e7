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
    bake(&listed, &["--probe-list", path(&list)])
        .exits(0)
        .says(&["2 probes", "1 of 3 given probes"]);
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
