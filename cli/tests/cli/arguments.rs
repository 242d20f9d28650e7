// SPDX-License-Identifier: MIT OR Apache-2.0
//! Help, and command lines that are wrong: exit code 2, the flag by name, and what is right.

use crate::support::{cornell, empty_folder, fixture, has_adapter, names_in, path, run};

const COMMANDS: [&str; 7] =
    ["render", "reference", "compare", "kernels", "export", "bench", "doctor"];

#[test]
fn help_is_a_result() {
    let help = run(&["--help"]).exits(0);
    assert_eq!(help.stderr, "");
    for command in COMMANDS {
        assert!(help.stdout.contains(command), "{help}");
        let own = run(&[command, "--help"]).exits(0);
        assert_eq!(own.stderr, "");
        assert!(own.stdout.contains(&format!("Usage: lucerna {command}")), "{own}");
    }
}

#[test]
fn version_is_the_packages() {
    let version = run(&["--version"]).exits(0);
    assert_eq!(version.stdout, concat!("lucerna ", env!("CARGO_PKG_VERSION"), "\n"));
}

#[test]
fn no_command_is_wrong() {
    run(&[]).exits(2).gives_nothing().says(&["Usage: lucerna <COMMAND>", "reference"]);
}

#[test]
fn unknown_words_are_wrong() {
    run(&["frobnicate"]).exits(2).gives_nothing().says(&["'frobnicate'", "--help"]);
    for command in COMMANDS {
        run(&[command, "--frobnicate"]).exits(2).gives_nothing().says(&["--frobnicate"]);
    }
    run(&["kernels", "--modules", "reference/path_trace"]).exits(2).says(&["cannot be used with"]);
    run(&["export", "--target", "cobol", "-o", "x"]).exits(2).says(&["--target", "wgsl"]);
}

#[test]
fn what_is_missing_is_named() {
    run(&["reference", "scene.gltf"]).exits(2).says(&["--output <FILE>"]);
    run(&["reference", "-o", "out.exr"]).exits(2).says(&["<SCENE>"]);
    run(&["compare", "one.png"]).exits(2).says(&["<REFERENCE>"]);
    run(&["export"]).exits(2).says(&["--output <DIR>"]);
}

/// Value, and what the message names as right. Nothing is read or written, so the scene need not be there.
#[test]
fn wrong_values_are_refused_with_the_flag_and_what_is_right() {
    let rows: &[(&str, &[&str], &[&str])] = &[
        (
            "--size",
            &["3", "x", "axb", "640x", "-1x4", "1.5x2", ""],
            &["WIDTHxHEIGHT, like 640x360"],
        ),
        ("--size", &["0x16", "16x0", "16385x1"], &["1 to 16384"]),
        (
            "--channel",
            &["colour"],
            &["beauty", "direct", "indirect", "irradiance", "albedo", "normal", "depth"],
        ),
        ("--exposure", &["NaN", "inf", "bright", "65"], &["stops between -64 and 64"]),
        ("--seed", &["-1", "4294967296", "x"], &[]),
        ("--spp", &["0", "many"], &[]),
        ("--bounces", &["-1", "1001"], &[]),
        ("--light", &["kind=lamp"], &["point, spot, directional"]),
        ("--light", &["colour=1,1,1", "kind=point wattage=3"], &["unknown key", "intensity"]),
        ("--light", &["kind"], &["key=value"]),
        ("--light", &["kind=point"], &["`position=x,y,z` is missing"]),
        ("--light", &["kind=point position=1,2"], &["three numbers"]),
        ("--light", &["kind=point position=1,2,NaN", "position=1,2,inf"], &["finite"]),
        ("--light", &["position=0,0,0 position=1,1,1"], &["given twice"]),
        ("--light", &["position=0,0,0 intensity=-1,0,0"], &["cannot be negative"]),
        ("--light", &["position=0,0,0 range=0"], &["range must be above 0"]),
        ("--light", &["kind=directional direction=0,0,0"], &["cannot be zero"]),
        (
            "--light",
            &[
                "kind=spot position=0,0,0 inner=40 outer=30",
                "kind=spot position=0,0,0 inner=30 outer=30",
                "kind=spot position=0,0,0 outer=91",
                "kind=spot position=0,0,0 inner=-1",
            ],
            &["0 <= inner < outer <= 90"],
        ),
        ("--camera", &["eye=0,0,0"], &["target"]),
        ("--camera", &["eye=0,0 target=0,0,1"], &["three numbers"]),
        ("--camera", &["eye=0,0,0 target=0,0,0"], &["same point"]),
        ("--camera", &["eye=0,0,0 target=0,0,1 fov=180"], &["between 0.001 and 179"]),
        ("--camera", &["eye=0,0,0 target=0,0,1 roll=3"], &["unknown key `roll`", "fov"]),
        ("--sky", &["1,2", "1", "1,2,3,4"], &["three numbers"]),
        ("--sky", &["1,-1,1"], &["cannot be negative"]),
        ("--sky", &["1,NaN,1"], &["finite"]),
        ("--output", &["out.jpg", "out", "png"], &[".png, .exr or .hdr"]),
        ("--rays", &["laser"], &["software", "ray-query"]),
    ];
    for (flag, values, right) in rows {
        for value in *values {
            let flag_and_value = format!("{flag}={value}");
            let mut arguments = vec!["reference", "scene.gltf", &flag_and_value];
            if *flag != "--output" {
                arguments.push("--output=out.exr");
            }
            run(&arguments).exits(2).gives_nothing().says(&[flag]).says(right);
        }
    }
    run(&["compare", "a.png", "b.png", "--diff=c.jpg"]).exits(2).says(&["--diff", ".png"]);
    run(&["render", "scene.gltf", "-o", "o.png", "--technique=magic"])
        .exits(2)
        .says(&["--technique", "reference"]);
}

#[test]
fn flags_of_real_time_techniques_are_checked() {
    for (flag, right) in [
        ("--cones=7", "5, 6, 9, 16"),
        ("--bounce-cones=0", "5, 6, 9, 16"),
        ("--bounce-period=0", "1 to 64"),
        ("--specular=shiny", "roughness"),
        ("--specular=180", "119"),
        ("--face-weights=cubed", "squared"),
        ("--shadows=soft", "pcss"),
        ("--shadow-size=0", "--shadow-size"),
        ("--light-radius=-1", "metres"),
        ("--voxels=0x4x4", "--voxels"),
        ("--voxels=4x4", "--voxels"),
        ("--voxels=300", "256"),
        ("--step-scale=0", "0.05 to 4"),
        ("--mip-bias=9", "-4 to 4"),
        ("--opacity-threshold=2", "0.01 to 1"),
        ("--start=-1", "0 to 8"),
        ("--occlusion-distance=0", "--occlusion-distance"),
        ("--channel=glow", "openness"),
    ] {
        let arguments = ["render", "scene.gltf", "--technique=voxel-cone", "--output=o.png", flag];
        run(&arguments).exits(2).gives_nothing().says(&[right]);
    }
}

#[test]
fn missing_scene_fails_with_its_path() {
    let folder = empty_folder("missing_scene");
    let (scene, output) = (folder.join("there_is_none.gltf"), folder.join("out.png"));
    run(&["reference", path(&scene), "-o", path(&output)])
        .exits(1)
        .gives_nothing()
        .says(&["error: ", path(&scene)]);
    assert!(names_in(&folder).is_empty());
}

#[test]
fn malformed_scenes_fail_with_their_path() {
    let folder = empty_folder("malformed_scene");
    let output = folder.join("out.exr");
    for name in ["json_cut.gltf", "glb_cut_in_chunk.glb", "scene.fbx", "accessor_past_view.gltf"] {
        let scene = fixture(&format!("malformed/{name}"));
        run(&["reference", &scene, "--size=16x16", "--spp=1", "-o", path(&output)])
            .exits(1)
            .gives_nothing()
            .says(&[name]);
    }
    assert!(names_in(&folder).is_empty());
}

#[test]
fn unknown_camera_fails_and_lists_those_there_are() {
    let folder = empty_folder("unknown_camera");
    let output = folder.join("out.exr");
    let scene = fixture("scenes/khronos/Cameras.gltf");
    run(&["reference", &scene, "--camera=porch", "-o", path(&output)])
        .exits(1)
        .gives_nothing()
        .says(&["`porch`", "cameras[0], cameras[1]", "eye=x,y,z"]);
}

#[test]
fn missing_sky_fails_with_its_path() {
    let output = empty_folder("missing_sky").join("out.exr");
    run(&["reference", &cornell(), "--sky=no_such_sky.hdr", "-o", path(&output)])
        .exits(1)
        .gives_nothing()
        .says(&["--sky", "no_such_sky.hdr", "r,g,b"]);
}

/// Before the scene is even read.
#[test]
fn places_that_take_no_file_are_refused_before_rendering() {
    let folder = empty_folder("unwritable");
    let file = folder.join("plain_file");
    std::fs::write(&file, "").unwrap();
    let good = folder.join("good.exr");
    let mut bad = vec![folder.join("missing/out.exr"), file.join("out.exr"), folder.clone()];
    if cfg!(target_os = "linux") {
        bad.push("/proc/out.exr".into());
    }
    for output in &bad[..2] {
        run(&["reference", "no_such.gltf", "-o", path(output)]).exits(1).gives_nothing().says(&[
            "cannot write",
            path(output),
            "there is no folder",
        ]);
    }
    for timings in &bad {
        let timings = path(timings);
        run(&["reference", "no_such.gltf", "-o", path(&good), "--timings", timings])
            .exits(1)
            .gives_nothing()
            .says(&["cannot write", timings]);
    }
    let folder_named_as_picture = folder.join("folder.exr");
    std::fs::create_dir(&folder_named_as_picture).unwrap();
    run(&["reference", "no_such.gltf", "-o", path(&folder_named_as_picture)])
        .exits(1)
        .says(&["it is a folder"]);
    assert_eq!(names_in(&folder), ["folder.exr", "plain_file"]);
}

/// A name as long as the system takes is written; one that is longer is refused before the scene is read.
#[test]
fn long_names_are_written_or_refused_at_once() {
    let folder = empty_folder("long_names");
    let file = |n: usize| folder.join(format!("{}.json", "x".repeat(n - 5)));
    let (longest, too_long) = (file(255), file(256));
    let picture = folder.join("a.exr");
    let with_timings = |file| {
        run(&["reference", "no_such.gltf", "-o", path(&picture), "--timings", path(file)]).exits(1)
    };
    with_timings(&longest).says(&["no_such.gltf"]);
    with_timings(&too_long).gives_nothing().says(&["cannot write"]);
    assert_eq!(names_in(&folder), [""; 0]);
    if has_adapter() {
        let picture = folder.join(format!("{}.exr", "x".repeat(251)));
        run(&["reference", &cornell(), "-o", path(&picture), "--size", "4x4", "--spp", "1"])
            .exits(0);
        assert_eq!(names_in(&folder).len(), 1);
    }
}

/// An output that is a link: the file that it leads to is written, and the link stays.
#[cfg(unix)]
#[test]
fn links_are_written_through() {
    use std::os::unix::fs::symlink;
    let folder = empty_folder("links");
    let (link, target, circle) =
        (folder.join("link.exr"), folder.join("target.exr"), folder.join("circle.exr"));
    symlink("target.exr", &link).unwrap();
    symlink("circle.exr", &circle).unwrap();
    run(&["reference", &cornell(), "-o", path(&circle)]).exits(1).says(&["circle"]);
    if has_adapter() {
        run(&["reference", &cornell(), "-o", path(&link), "--size", "4x4", "--spp", "1"]).exits(0);
        assert!(link.is_symlink() && !target.is_symlink() && target.is_file());
    }
}

/// Cameras and lights that 32-bit floats cannot place.
#[test]
fn places_out_of_range_are_refused() {
    let camera =
        |spec: &str| run(&["reference", "a.gltf", "-o", "a.png", "--camera", spec]).exits(2);
    camera("eye=1e30,0,0 target=0,0,0").gives_nothing().says(&["beyond 1e9 m"]);
    camera("eye=0,0,0 target=0,-1e12,0").says(&["target", "beyond 1e9 m"]);
    camera("eye=1,2,3 target=1,2,3.0000000000001").says(&["the same point"]);
    camera("eye=0,0,0 target=0,0,1e-30").says(&["the same point"]);
    camera("eye=0,0,0 target=0,0,-1 fov=1e-30").says(&["fov"]);
    camera("eye=0,0,0 target=0,0,-1 fov=179.9999999").says(&["fov"]);
    run(&["reference", "a.gltf", "-o", "a.png", "--light", "position=1e30,0,0"])
        .exits(2)
        .says(&["beyond 1e9 m"]);
}
