// SPDX-License-Identifier: MIT OR Apache-2.0
//! `lucerna bake` and `lucerna render --bake`.

use crate::support::{Ran, cornell, empty_folder, has_adapter, lucerna, path, run};
use lucerna::components::probes::ProbeBake;
use std::path::Path;
use std::process::Stdio;
use std::time::{Duration, Instant};

fn bake(output: &Path, more: &[&str]) -> Ran {
    let scene = cornell();
    let output = path(output);
    run(&[&["bake", &scene, "--cells", "10", "-o", output], more].concat())
}

/// Ends a bake that has more paths to follow than it will get: when `is_time` says so, in the way of this signal.
fn interrupt(output: &Path, signal: &str, is_time: impl Fn() -> bool) -> Ran {
    let (scene, file) = (cornell(), path(output));
    let arguments = ["bake", &scene, "--cells", "10", "-o", file, "--paths", "1048576"];
    let mut running = lucerna(&arguments);
    let child = running.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let started = Instant::now();
    while !is_time() {
        assert!(started.elapsed() < Duration::from_secs(120), "nothing to interrupt yet");
        std::thread::sleep(Duration::from_millis(50));
    }
    let id = child.id().to_string();
    let killed = std::process::Command::new("kill").args([signal, &id]).status().unwrap();
    assert!(killed.success(), "kill {signal} {id}");
    Ran::new(&arguments, child.wait_with_output().unwrap())
}

/// After kill -9 and after Ctrl-C, the same command goes on, and its file is that of a bake that was never interrupted. There is never a part of a
/// file under its name.
#[test]
fn an_interrupted_bake_goes_on() {
    if !has_adapter() {
        return;
    }
    let folder = empty_folder("bake_goes_on");
    let [file, whole] = ["a.probes", "b.probes"].map(|name| folder.join(name));
    let part = folder.join("a.probes.part");
    interrupt(&file, "-KILL", || part.exists());
    assert!(!file.exists(), "a file under its final name, of a bake that was killed");
    let first = ProbeBake::read(&part).unwrap().n_paths;
    // (Some more than it has.)
    let started = Instant::now();
    let stopped = interrupt(&file, "-INT", || started.elapsed() > Duration::from_secs(4));
    stopped.exits(1).says(&["goes on", "stopped after", "a.probes.part"]).gives_nothing();
    assert!(!file.exists(), "a file under its final name, of a bake that was stopped");
    let second = ProbeBake::read(&part).unwrap().n_paths;
    assert!(second > first && first > 0, "{first} paths, then {second}");
    let n_paths = (second + 640).to_string();
    bake(&file, &["--paths", &n_paths]).exits(0).says(&["a.probes.part has", "and goes on"]);
    assert!(!part.exists(), "the unfinished file is left");
    bake(&whole, &["--paths", &n_paths]).exits(0);
    let [found, expected] = [&file, &whole].map(|file| std::fs::read(file).unwrap());
    assert!(found == expected, "a bake that was interrupted differs from one that was not");
}

/// What goes with a bake, and what does not.
#[test]
fn bakes_are_used_where_they_fit() {
    if !has_adapter() {
        return;
    }
    let folder = empty_folder("bake_fits");
    let scene = cornell();
    let file = folder.join("cornell.probes");
    let json = folder.join("cornell.json");
    bake(&file, &["--paths", "64", "--json", path(&json)])
        .exits(0)
        .says(&["probes, 64 paths each"]);
    let text = std::fs::read_to_string(&json).unwrap();
    assert!(text.starts_with('{') && text.contains("\"sh2\""), "{}", &text[..60]);
    bake(&file, &["--paths", "64", "--relight"]).exits(0);
    bake(&file, &["--cells", "5", "--relight"]).exits(2);
    bake(&file, &["--relocation", "off", "--relight"])
        .exits(1)
        .says(&["cannot be relit", "relocation on"]);
    bake(&file, &["--sky", "1,1,1", "--paths", "64"])
        .exits(0)
        .says(&["is of another scene or of other settings"]);
    let to = folder.join("a.png");
    let (picture, named) = (path(&to), path(&file));
    let render = |technique: &str, more: &[&str]| {
        let shared = ["render", &scene, "--size", "32x32", "--frames", "1", "-o", picture];
        run(&[shared.as_slice(), &["--technique", technique, "--bake", named], more].concat())
    };
    render("probe-volume", &[]).exits(0).says(&["lights, the sky or materials have changed"]);
    render("probe-volume", &["--sky", "1,1,1", "--basis", "sh1", "--visibility", "none"]).exits(0);
    render("probe-volume", &["--paths", "64"]).exits(1).says(&["--paths is the bake's"]);
    render("voxel-rt", &[]).exits(1).says(&["--bake means nothing to the technique voxel-rt"]);
    render("reference", &[]).exits(1).says(&["--bake means nothing to the technique reference"]);
    render("probe-volume", &["--bake", "no-such-file"]).exits(1).says(&["no-such-file: "]);
    render("probe-volume", &["--bake", &scene]).exits(1).says(&["is not a file of baked probes"]);
    let half = format!("{named}=0.5");
    render("probe-volume", &["--bake", &half]).exits(0);
    bake(Path::new("no/such/folder.probes"), &[]).exits(1).says(&["there is no folder"]);
}

/// Nets by rules and by a list, through `bake` and `render`, and what is wrong with them.
#[test]
fn nets_are_made_and_baked() {
    if !has_adapter() {
        return;
    }
    let folder = empty_folder("nets");
    let scene = cornell();
    let [file, json, again, png] =
        ["net.probes", "net.json", "again.probes", "net.png"].map(|name| folder.join(name));
    let bake = |output: &Path, more: &[&str]| {
        let fixed = ["bake", &scene, "--paths", "64", "-o", path(output)];
        run(&[&fixed, more].concat())
    };
    let ground = ["--net", "ground", "--net-height", "1", "--net-probes", "60"];
    bake(&file, &[&ground[..], &["--json", path(&json)]].concat()).exits(0).says(&[
        "points of the net:",
        "60 probes in a net",
        "60 probes, 64 paths each",
    ]);
    // What a bake has written is a list of points: the same net, which is not begun anew.
    let listed = ["--net", path(&json), "--no-net-fillers"];
    bake(&again, &listed).exits(0).says(&["60 probes in a net"]);
    let [a, b] = [&file, &again].map(|file| std::fs::read(file).unwrap());
    assert!(a == b, "the same points make another bake");
    bake(&file, &listed).exits(0).says(&["goes on", "0 new ones"]);
    bake(&file, &[&listed[..], &["--relight"]].concat()).exits(0);
    bake(&file, &["--relight"]).exits(1).says(&["cannot be relit", "--net"]);
    let points = folder.join("points.json");
    for (text, part) in [
        ("[[1, 2, 3], [1, 2]]", "point 1 is [1,2], expected [x, y, z]"),
        ("{\"a\": 1}", "expected a list of points"),
        ("[[1, 2", "points.json"),
        ("[]", "the net has no probes"),
    ] {
        std::fs::write(&points, text).unwrap();
        bake(&again, &["--net", path(&points), "--fresh"]).exits(1).says(&[part]);
    }
    bake(&file, &["--net", "walls"]).exits(2).says(&["surfaces, ground, or a file"]);
    bake(&file, &["--net-spacing", "1"]).exits(2);
    bake(&file, &["--net", "ground", "--cells", "8"]).exits(1).says(&["means nothing to a net"]);
    bake(&file, &["--net", "surfaces", "--net-spacing", "0.001"])
        .exits(1)
        .says(&["use a spacing of"]);
    let render = |technique: &str, more: &[&str]| {
        let fixed = ["render", &scene, "--size", "32x32", "--frames", "1", "--warm-up", "1"];
        let rest = ["--technique", technique, "-o", path(&png)];
        run(&[&fixed, &rest[..], more].concat())
    };
    render("probe-volume", &["--net", "surfaces", "--net-spacing", "1"])
        .exits(0)
        .says(&["tetrahedra"]);
    render("probe-volume", &["--bake", path(&file)]).exits(0).says(&["60 probes in a net"]);
    render("probe-volume", &["--bake", path(&file), "--net", "ground"])
        .exits(1)
        .says(&["--net means nothing with --bake"]);
    render("voxel-rt", &["--net", "ground"]).exits(1).says(&["means nothing to the technique"]);
    render("probe-volume", &["--net", "ground", "--visibility", "masks"]).exits(1).says(&["masks"]);
    render("probe-volume", &["--bake", path(&file), "--bake-memory", "10"])
        .exits(1)
        .says(&["only a lattice can be read in parts"]);
}

/// A part of a bake in little memory, and a sky that changes.
#[test]
fn parts_and_skies_of_bakes() {
    if !has_adapter() {
        return;
    }
    let folder = empty_folder("bake_parts");
    let scene = cornell();
    let [file, png] = ["sky.probes", "sky.png"].map(|name| folder.join(name));
    let render = |more: &[&str]| {
        let fixed = ["render", &scene, "--size", "32x32", "--frames", "1"];
        let rest = ["--technique", "probe-volume", "-o", path(&png), "--bake", path(&file)];
        run(&[&fixed, &rest[..], more].concat())
    };
    bake(&file, &["--paths", "64"]).exits(0);
    render(&["--bake-sky"]).exits(1).says(&["sky.probes.sky0 is missing: bake with --sky-parts"]);
    render(&["--bake-memory", "100"]).exits(0);
    render(&["--bake-memory", "1", "--bake-sky"]).exits(2);
    let double = format!("{}=2", path(&file));
    render(&["--bake", &double, "--bake-memory", "9"]).exits(1).says(&["takes one --bake"]);
    bake(&file, &["--paths", "64", "--sky-parts"]).exits(0).says(&["part 8 of the sky"]);
    assert!(folder.join("sky.probes.sky8").exists());
    render(&["--bake-sky", "--sky", "0.5,0.6,0.9"]).exits(0);
    let bright = std::fs::read(&png).unwrap();
    render(&["--bake-sky"]).exits(0);
    assert!(std::fs::read(&png).unwrap() != bright, "the sky shows");
}
