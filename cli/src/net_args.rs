// SPDX-License-Identifier: MIT OR Apache-2.0
//! The flags that put probes at the points of a net.

use clap::Args;
use glam::Vec3;
use lucerna::blocking::place_net;
use lucerna::components::probe_net::{NetRule, NetSettings, ProbeNet};
use lucerna::gpu::Gpu;
use lucerna::gpu_scene::GpuScene;
use lucerna::settings;
use std::error::Error;
use std::path::{Path, PathBuf};

/// Settings that mean nothing to a net.
const OF_LATTICES: [&str; 3] = ["cells", "refine", "relocation"];

/// A net instead of a lattice (only `probe-volume`).
#[derive(Args, Clone, Debug)]
pub struct NetArguments {
    /// Put probes at the points of a Delaunay net instead of corners of cells: `surfaces` (in empty voxels beside surfaces), `ground` (above floors),
    /// or a JSON file of points, [[x, y, z], …] or what `lucerna bake --json` writes (only `probe-volume`).
    #[arg(long, value_name = "surfaces|ground|FILE.json", value_parser = parse_net)]
    net: Option<NetChoice>,
    /// With `--net surfaces` or `ground`: about how far probes are from each other [m]. [default: 1/16 of the scene's longest side]
    #[arg(long, value_name = "M", requires = "net", value_parser = parse_length)]
    net_spacing: Option<f32>,
    /// With `--net ground`: how high above the ground probes are [m].
    #[arg(long, value_name = "M", requires = "net", default_value_t = 1.5, value_parser = parse_length)]
    net_height: f32,
    /// The most probes of a net: if there are more points, those stay that are farthest from each other.
    #[arg(long, value_name = "N", requires = "net", default_value_t = NetSettings::default().most, value_parser = clap::value_parser!(u32).range(1..=1 << 20))]
    net_probes: u32,
    /// Add no probes where cells of the net are slivers.
    #[arg(long, requires = "net")]
    no_net_fillers: bool,
}

#[derive(Clone, Debug)]
enum NetChoice {
    Surfaces,
    Ground,
    File(PathBuf),
}

fn parse_net(text: &str) -> Result<NetChoice, String> {
    Ok(match text {
        "surfaces" => NetChoice::Surfaces,
        "ground" => NetChoice::Ground,
        file if file.ends_with(".json") => NetChoice::File(file.into()),
        _ => return Err("expected surfaces, ground, or a file whose name ends in .json".into()),
    })
}

fn parse_length(text: &str) -> Result<f32, String> {
    match text.parse::<f32>() {
        Ok(length) if (1e-6..=1e6).contains(&length) => Ok(length),
        _ => Err("expected metres between 1e-6 and 1e6".into()),
    }
}

impl NetArguments {
    /// Whether there is to be a net.
    pub fn is_given(&self) -> bool {
        self.net.is_some()
    }

    /// Makes the net, if one is asked for, and says what was left out. `given`: the settings' flags.
    pub fn make(
        &self,
        gpu: &Gpu,
        scene: &GpuScene,
        given: &[(&str, &str)],
    ) -> Result<Option<ProbeNet>, Box<dyn Error>> {
        let Some(choice) = &self.net else { return Ok(None) };
        if let Some((name, _)) = given.iter().find(|(name, _)| OF_LATTICES.contains(name)) {
            return Err(format!("--{name} means nothing to a net").into());
        }
        let rule = match choice {
            NetChoice::Surfaces => NetRule::Surfaces,
            NetChoice::Ground => NetRule::Ground { height: self.net_height },
            NetChoice::File(file) => NetRule::Points(read_points(file)?),
        };
        let placed = place_net(
            gpu,
            scene,
            &settings!(NetSettings {
                rule,
                spacing: self.net_spacing.unwrap_or(0.0),
                most: self.net_probes,
                fills: !self.no_net_fillers,
            }),
        )?;
        let mut left_out = Vec::new();
        let mut say = |n: u32, what: &str| {
            if n > 0 {
                left_out.push(format!("{n} {what}"));
            }
        };
        say(placed.n_inside, "inside something, left out");
        say(placed.n_too_many, "too many, left out (--net-probes)");
        say(placed.net.n_duplicates() as u32, "twice, left out");
        say(placed.n_fillers, "added against slivers");
        if !left_out.is_empty() {
            errln!("points of the net: {}", left_out.join(", "));
        }
        if placed.n_slivers > 0 {
            errln!("note: {} cells of the net are slivers", placed.n_slivers);
        }
        if placed.net.points().is_empty() {
            return Err("the net has no probes: nothing is left of its points".into());
        }
        Ok(Some(placed.net))
    }
}

/// A list of points \[m\].
pub fn read_points(file: &Path) -> Result<Vec<Vec3>, String> {
    let fail = |what: String| format!("{}: {what}", file.display());
    let text = std::fs::read_to_string(file).map_err(|error| fail(error.to_string()))?;
    let json: serde_json::Value =
        serde_json::from_str(&text).map_err(|error| fail(error.to_string()))?;
    let of_bake = json.get("probes");
    let Some(list) = of_bake.unwrap_or(&json).as_array() else {
        return Err(fail("expected a list of points, [[x, y, z], …]".into()));
    };
    let point = |(ix, item): (usize, &serde_json::Value)| {
        let three = item.get("position").unwrap_or(item).as_array();
        let numbers: Vec<f32> = three
            .map(|of| of.iter().filter_map(|x| Some(x.as_f64()? as f32)).collect())
            .unwrap_or_default();
        match numbers[..] {
            [x, y, z] if three.is_some_and(|of| of.len() == 3) => Ok(Vec3::new(x, y, z)),
            _ => Err(fail(format!("point {ix} is {item}, expected [x, y, z]"))),
        }
    };
    list.iter().enumerate().map(point).collect()
}
