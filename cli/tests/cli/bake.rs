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
