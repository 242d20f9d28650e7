// SPDX-License-Identifier: MIT OR Apache-2.0
//! `reference` and `render`: pictures, their bytes, and what is said meanwhile.

use crate::support::{Ran, cornell, empty_folder, fixture, has_adapter, names_in, path, run};
use glam::Vec3;
use lucerna::picture::Picture;
use std::path::Path;

#[track_caller]
fn read(file: &Path) -> Picture {
    let picture = Picture::read(file).unwrap();
    assert_eq!((picture.width, picture.height), (16, 16));
    picture
}

fn mean(picture: &Picture) -> Vec3 {
    picture.rgb.iter().sum::<Vec3>() / picture.rgb.len() as f32
}

const SMALL: [&str; 2] = ["--size=16x16", "--spp=1"];

#[test]
fn reference_writes_each_format_and_prints_its_path() {
    if !has_adapter() {
        return;
    }
    let folder = empty_folder("formats");
    for name in ["out.png", "out.exr", "out.hdr", "UPPER.EXR"] {
        let output = folder.join(name);
        let ran = run(&["reference", &cornell(), SMALL[0], SMALL[1], "-o", path(&output)])
            .exits(0)
            .says(&["adapter: ", "scene: 32 triangles", "rendered in "]);
        assert_eq!(ran.stdout, format!("{}\n", path(&output)), "{ran}");
        let picture = read(&output);
        assert!(mean(&picture).min_element() > 0.0, "{name} is black");
        assert!(picture.rgb.iter().all(|rgb| rgb.is_finite()), "{name}");
    }
    assert_eq!(names_in(&folder), ["UPPER.EXR", "out.exr", "out.hdr", "out.png"]);
}

/// Fewer pixel samples than one dispatch of the slowest adapter takes.
#[test]
fn the_smallest_picture_is_rendered() {
    if !has_adapter() {
        return;
    }
    let output = empty_folder("smallest").join("out.exr");
    run(&["reference", &cornell(), "--size=1x1", "--spp=3", "-o", path(&output)]).exits(0);
    let picture = Picture::read(&output).unwrap();
    assert_eq!((picture.width, picture.height), (1, 1));
}

/// The picture that stood there is replaced, and the same input gives the same bytes.
#[test]
fn same_input_gives_the_same_bytes_and_another_seed_others() {
    if !has_adapter() {
        return;
    }
    let folder = empty_folder("seeds");
    let output = folder.join("out.exr");
    std::fs::write(&output, "what was here before").unwrap();
    let render = |seed: &str| {
        let arguments = ["reference", &cornell(), SMALL[0], SMALL[1], seed, "-o", path(&output)];
        run(&arguments).exits(0);
        std::fs::read(&output).unwrap()
    };
    let first = render("--seed=7");
    assert!(first == render("--seed=7"), "the same seed gave other bytes");
    assert!(first != render("--seed=8"), "another seed gave the same bytes");
    assert_eq!(names_in(&folder), ["out.exr"]);
}

#[test]
fn each_channel_shows_what_it_says() {
    if !has_adapter() {
        return;
    }
    let folder = empty_folder("channels");
    let render = |channel: &str, ending: &str| {
        let output = folder.join(format!("{channel}.{ending}"));
        let flag = format!("--channel={channel}");
        let scene = cornell();
        run(&["reference", &scene, SMALL[0], "--spp=4", &flag, "-o", path(&output)]).exits(0);
        read(&output)
    };
    let [beauty, emitted, direct, indirect] =
        ["beauty", "emitted", "direct", "indirect"].map(|channel| render(channel, "exr"));
    for (ix, total) in beauty.rgb.iter().enumerate() {
        let sum = emitted.rgb[ix] + direct.rgb[ix] + indirect.rgb[ix];
        // Each is a sum of the same four samples; the additions round differently.
        assert!((*total - sum).abs().max_element() <= 1e-5 * total.max_element().max(1.0));
    }
    assert!(mean(&direct).min_element() > 0.0 && mean(&indirect).min_element() > 0.0);
    assert!(mean(&render("irradiance", "exr")).min_element() > 0.0);
    for albedo in &render("albedo", "exr").rgb {
        assert!(albedo.min_element() >= 0.0 && albedo.max_element() <= 1.0, "{albedo}");
    }
    // The camera stands at z = -8 and looks along +z into a box that is 5.6 deep; at one sample a
    // pixel mixes surfaces at most, so no normal is longer than 1.
    for normal in &render("normal", "exr").rgb {
        assert!(normal.length() <= 1.0 + 1e-4, "{normal}");
    }
    for depth in &render("depth", "exr").rgb {
        assert!(depth.x == 0.0 || (8.0 - 0.1..8.0 + 5.7).contains(&depth.x), "{depth}");
    }
    for channel in ["normal", "depth"] {
        let picture = render(channel, "png");
        assert!(mean(&picture).max_element() > 0.0, "{channel}.png is black");
    }
}

#[test]
fn exposure_brightens_a_png() {
    if !has_adapter() {
        return;
    }
    let folder = empty_folder("exposure");
    let render = |exposure: &str| {
        let output = folder.join("out.png");
        let scene = cornell();
        run(&["reference", &scene, SMALL[0], SMALL[1], exposure, "-o", path(&output)]).exits(0);
        mean(&read(&output)).x
    };
    assert!(render("--exposure=-3") < render("--exposure=0"));
}

#[test]
fn timings_are_json() {
    if !has_adapter() {
        return;
    }
    let folder = empty_folder("timings");
    let (output, timings) = (folder.join("out.exr"), folder.join("timings.json"));
    let flag = format!("--timings={}", path(&timings));
    run(&["reference", &cornell(), SMALL[0], "--spp=2", &flag, "-o", path(&output)]).exits(0);
    let text = std::fs::read_to_string(&timings).unwrap();
    let json: serde_json::Value = serde_json::from_str(&text).unwrap();
    for key in ["adapter", "backend", "driver", "rays"] {
        assert!(json[key].is_string(), "{key} in {text}");
    }
    assert_eq!(json["samples_per_pixel"], 2);
    assert!(json["wall_ms"].as_f64().unwrap() > 0.0, "{text}");
    let pass = &json["passes"][0];
    assert_eq!(pass["name"], "reference/path_trace");
    assert!(pass["dispatches"].as_u64().unwrap() >= 1, "{text}");
    // null where the adapter has no timestamps
    assert!(pass["gpu_ms"].is_null() || pass["gpu_ms"].as_f64().unwrap() > 0.0, "{text}");
    assert_eq!(names_in(&folder), ["out.exr", "timings.json"]);
}

#[test]
fn render_knows_the_reference() {
    if !has_adapter() {
        return;
    }
    let folder = empty_folder("render");
    let output = folder.join("out.exr");
    let scene = cornell();
    let technique = "--technique=reference";
    let ran =
        run(&["render", &scene, technique, "--frames=1", SMALL[0], "-o", path(&output)]).exits(0);
    assert_eq!(ran.stdout, format!("{}\n", path(&output)));
    assert!(mean(&read(&output)).min_element() > 0.0);
}

#[test]
fn what_is_filled_in_is_said() {
    if !has_adapter() {
        return;
    }
    let output = empty_folder("filled_in").join("out.exr");
    let scene = fixture("scenes/khronos/SimpleMeshes.gltf");
    let with = |more: &[&str]| {
        let mut arguments = vec!["reference", &scene, SMALL[0], SMALL[1], "-o", path(&output)];
        arguments.extend(more);
        run(&arguments).exits(0)
    };
    let (no_light, no_camera) = ("no light; using a white sky of radiance 1", "has no camera");
    with(&[]).says(&[no_light, no_camera]);
    // Nothing stands in the way of the white sky but two triangles, which reflect at most 1.
    let picture = read(&output);
    assert!(picture.rgb.iter().any(|rgb| (*rgb - 1.0).abs().max_element() < 1e-3));

    let lit = with(&["--sky=0.5,0.5,0.5", "--camera=eye=0,0,5 target=0,0,0 fov=30"]);
    assert!(!lit.stderr.contains("note: "), "{lit}");
    let lit = with(&["--light=kind=directional direction=0,0,-1 intensity=1,1,1"]);
    assert!(!lit.stderr.contains(no_light), "{lit}");
    // A sky that is asked to be black stays black.
    let dark = with(&["--sky=0,0,0"]);
    assert!(!dark.stderr.contains(no_light), "{dark}");
    assert_eq!(mean(&read(&output)), Vec3::ZERO);
}

#[test]
fn unknown_adapter_fails_and_lists_those_there_are() {
    if !has_adapter() {
        return;
    }
    let folder = empty_folder("unknown_adapter");
    let output = folder.join("out.exr");
    let first = run(&["doctor"]).exits(0).stdout;
    let first = first.lines().next().unwrap().replace(" (taken by --adapter auto)", "");
    run(&["reference", &cornell(), "--adapter=abacus", "-o", path(&output)])
        .exits(1)
        .gives_nothing()
        .says(&["`abacus`", &first]);
    assert!(names_in(&folder).is_empty());
}

/// Ctrl-C while rendering: what is there is written.
#[cfg(unix)]
#[test]
fn interrupt_writes_the_picture_and_says_so() {
    use crate::support::{Ran, lucerna};
    use std::io::{BufRead, BufReader, Read};
    use std::process::{Command, Stdio};
    use std::time::{Duration, Instant};

    if !has_adapter() {
        return;
    }
    let folder = empty_folder("interrupt");
    let output = folder.join("out.exr");
    let arguments = ["reference", &cornell(), SMALL[0], "--spp=10000000", "-o", path(&output)];
    let mut child =
        lucerna(&arguments).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let mut talk = BufReader::new(child.stderr.take().unwrap());
    let mut said = String::new();
    while !said.contains("scene: ") {
        assert_ne!(talk.read_line(&mut said).unwrap(), 0, "{said}");
    }
    // It takes Ctrl-C from here on; some samples shall be done.
    std::thread::sleep(Duration::from_millis(1500));
    let interrupted = Instant::now();
    let kill = Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    assert!(kill.success());
    talk.read_to_string(&mut said).unwrap();
    let ended = child.wait_with_output().unwrap();
    assert!(interrupted.elapsed() < Duration::from_secs(20), "{:?}", interrupted.elapsed());
    let ran = Ran::new(&arguments, ended).exits(0);
    assert_eq!(ran.stdout, format!("{}\n", path(&output)));
    assert!(said.contains("stopped: every pixel has "), "{said}");
    assert!(mean(&read(&output)).min_element() > 0.0);
    assert_eq!(names_in(&folder), ["out.exr"]);
}

#[test]
fn render_direct_accumulates_frames_and_times_its_passes() {
    if !has_adapter() {
        return;
    }
    let folder = empty_folder("direct");
    let timings = folder.join("timings.json");
    let mut means = Vec::new();
    for channel in ["beauty", "emitted", "direct", "indirect"] {
        let output = folder.join(format!("{channel}.exr"));
        let ran = run(&[
            "render",
            &cornell(),
            "--technique=direct",
            "--size=16x16",
            "--frames=2",
            "--channel",
            channel,
            "--timings",
            path(&timings),
            "-o",
            path(&output),
        ])
        .exits(0)
        .says(&["scene: 32 triangles", "rendered in "]);
        assert_eq!(ran.stdout, format!("{}\n", path(&output)), "{ran}");
        means.push(mean(&read(&output)));
    }
    let off = (means[0] - means[1] - means[2]).abs();
    assert!(off.max_element() < 1e-5 * means[0].max_element(), "{means:?}");
    assert!(means[2].min_element() > 0.0 && means[3] == Vec3::ZERO, "{means:?}");
    let json: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(&timings).unwrap()).unwrap();
    assert_eq!(json["frames"], 2);
    let names: Vec<_> =
        json["passes"].as_array().unwrap().iter().map(|pass| pass["name"].clone()).collect();
    assert!(
        names.is_empty() || names == ["frame/gbuffer", "frame/direct", "frame/composite"],
        "{names:?}"
    );
}

/// A picture of `voxel-cone`, 16 × 16 pixels of the Cornell box.
fn cones(more: &[&str], output: &Path) -> Ran {
    let scene = cornell();
    let mut arguments = vec!["render", &scene, "--technique=voxel-cone", "--size=16x16"];
    arguments.extend(["--frames=2", "--warm-up=2", "-o", path(output)]);
    arguments.extend(more);
    run(&arguments)
}

#[test]
fn cones_light_the_cornell_box() {
    if !has_adapter() {
        return;
    }
    let output = empty_folder("cones").join("out.exr");
    let mean_of = |more: &[&str]| {
        cones(more, &output).exits(0);
        mean(&read(&output))
    };
    let small = "--voxels=16x18x14";
    let channel = "--channel=indirect";
    let plain = mean_of(&[small, channel]);
    assert!(plain.min_element() > 0.0);
    // One bounce is less than all; 5 cones find about what 9 find.
    let one = mean_of(&[small, channel, "--bounces=1", "--cones=5", "--face-weights=squared"]);
    assert!(one.x > 0.2 * plain.x && one.x < 1.2 * plain.x, "{one} {plain}");
    let open = mean_of(&[small, "--channel=openness", "--occlusion-distance=100"]);
    let open_near = mean_of(&[small, "--channel=openness", "--occlusion-distance=0.5"]);
    assert!(open.x < open_near.x && open_near.x <= 1.0, "{open} {open_near}");
}

#[test]
fn cones_are_told_where_they_cannot_go() {
    if !has_adapter() {
        return;
    }
    let folder = empty_folder("cones_refused");
    let output = folder.join("out.exr");
    let refused = |more: &[&str], reason: &str| {
        cones(more, &output).exits(1).gives_nothing().says(&["error: ", reason]);
    };
    refused(&["--bounces=0"], "bounces is 0; possible values: 1 to 64, or unlimited");
    // Settings of another technique are not passed over.
    refused(&["--lookup=valid"], "--lookup is a setting of voxel-rt");
    refused(&["--debug-view=cells"], "no debug view `cells`: voxel-cone has none");
    let scene = cornell();
    let of_rays = ["render", &scene, "--technique=voxel-rt", "--shadows=cones", "-o"];
    run(&[&of_rays[..], &[path(&output)]].concat()).exits(1).says(&["voxel-cone"]);
    let view = ["render", &scene, "--technique=voxel-rt", "--debug-view=cell", "-o"];
    run(&[&view[..], &[path(&output)]].concat())
        .exits(1)
        .says(&["no debug view `cell`", "irradiance, cells"]);
    let no = |more: &[&str], reason: &str| {
        let arguments = [&["render", &scene, "-o", path(&output)], more].concat();
        run(&arguments).exits(1).says(&[reason]);
    };
    no(&["--technique=voxel-rt", "--channel=openness"], "does not find --channel openness");
    no(&["--technique=reference", "--debug-view=cells"], "means nothing to the technique");
    no(&["--technique=reference", "--shadows=pcf"], "means nothing to the technique");
    assert!(names_in(&folder).is_empty());
}
