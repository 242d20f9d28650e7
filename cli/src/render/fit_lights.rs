// SPDX-License-Identifier: MIT OR Apache-2.0
//! `lucerna fit-lights`: colours of lights, from a picture.

use super::realtime::frames_of;
use super::settings::{BAKES, NEEDS_BAKE};
use super::{
    ChannelArgument, REFERENCE, Ready, RenderArguments, interrupt_flag, prepare, write_picture,
};
use crate::CommandResult;
use clap::Args;
use glam::{DVec3, UVec2, Vec3};
use lucerna::blocking::render_reference;
use lucerna::fit::{LightFit, fit_lights};
use lucerna::gpu::Recorder;
use lucerna::picture::{Picture, write_whole_file};
use lucerna::scene::{Light, Sky};
use lucerna::settings;
use lucerna::techniques::TECHNIQUES;
use lucerna::techniques::reference::{Channel, PixelSums, ReferenceSettings, resolve};
use std::io::Write;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

/// `lucerna fit-lights`.
#[derive(Args, Clone, Debug)]
pub struct FitArguments {
    /// The picture whose light is to be explained: linear (.exr or .hdr), of this scene and camera. The size is taken from it.
    #[arg(long, value_name = "FILE")]
    picture: PathBuf,
    /// Write the colours, their errors and what could not be known as JSON.
    #[arg(long, value_name = "FILE.json")]
    json: Option<PathBuf>,
    #[command(flatten)]
    render: RenderArguments,
}

pub fn fit(arguments: &FitArguments) -> CommandResult {
    let started = Instant::now();
    let target = Picture::read(&arguments.picture)?;
    let is_linear = arguments
        .picture
        .extension()
        .is_some_and(|e| ["exr", "hdr"].iter().any(|of| e.eq_ignore_ascii_case(of)));
    if !is_linear {
        errln!(
            "warning: {} is not linear: its highlights may be cut off",
            arguments.picture.display()
        );
    }
    if let Some(file) = &arguments.json {
        super::check_writable(file)?;
    }
    let output = &arguments.render.output;
    if output.channel != ChannelArgument::Beauty || arguments.render.realtime.shows_debug_view() {
        return Err("fit-lights explains the whole light of a picture: leave --channel and --debug-view out".into());
    }
    let has_bake = arguments.render.realtime.has_bake();
    match arguments.render.technique.as_str() {
        NEEDS_BAKE if !has_bake => {
            return Err(format!("fit-lights renders once for each light: give the technique {NEEDS_BAKE} a --bake (lucerna bake)").into());
        }
        BAKES if has_bake => {
            return Err(format!(
                "a bake of {BAKES} has the light of its own lights: leave --bake out"
            )
            .into());
        }
        _ => {}
    }
    let mut render = arguments.render.clone();
    render.view.set_size(UVec2::new(target.width, target.height));
    let mut ready =
        prepare((&render.scene, &render.objects, &render.view), &render.adapter, &render.output)?;
    let interrupted = interrupt_flag()?;
    let lights = ready.scene.lights.clone();
    if lights.is_empty() {
        return Err("the scene has no point, spot or directional light whose colour could be fitted (--light)".into());
    }
    let emits = ready.scene.materials.iter().any(|material| material.emission != Vec3::ZERO);
    let is_dark = !emits && matches!(ready.scene.sky, Sky::Constant(Vec3::ZERO));
    // `shines`: with the light of emissive surfaces and the sky.
    let mut is_first = true;
    let mut with = |lights: Vec<Light>,
                    shines: bool,
                    what: &str|
     -> Result<Vec<PixelSums>, Box<dyn std::error::Error>> {
        errln!("{what}");
        set_light(&mut ready, &lights, shines)?;
        let sums = sums_of(&render, &ready, &interrupted, is_first)?;
        is_first = false;
        if interrupted.load(Ordering::Relaxed) {
            return Err("stopped".into());
        }
        Ok(sums)
    };
    let size = UVec2::new(target.width, target.height);
    let beauty = |sums: &[PixelSums]| resolve(sums, size, Channel::Beauty).rgb;
    let known = match is_dark {
        true => Vec::new(),
        false => beauty(&with(Vec::new(), true, "what shines without the lights")?),
    };
    let mut of_lights = Vec::new();
    for (ix, light) in lights.iter().enumerate() {
        let name = format!("light {} of {}", ix + 1, lights.len());
        of_lights.push(beauty(&with(vec![coloured(light, Vec3::ONE)], false, &name)?));
    }
    let fit = fit_lights(&target.rgb, &known, &of_lights)?;
    let fitted: Vec<Light> =
        lights.iter().zip(&fit.colours).map(|(light, c)| coloured(light, c.as_vec3())).collect();
    let sums = with(fitted.clone(), true, "the picture with these lights")?;
    report(&fit);
    for light in &fitted {
        outln!("--light \"{}\"", crate::scene_args::spec_of(light, ready.scene.origin))?;
    }
    write_picture(&sums, size, &arguments.render.output, ChannelArgument::Beauty)?;
    if let Some(file) = &arguments.json {
        let text = serde_json::to_string_pretty(&json_of(&fit, &fitted))?;
        write_whole_file(file, |to| -> std::io::Result<()> { writeln!(to, "{text}") })?;
    }
    errln!("fitted in {:.2} s", started.elapsed().as_secs_f64());
    Ok(())
}

/// Replaces the lights; `shines`: whether emissive surfaces and the sky shine.
fn set_light(ready: &mut Ready, lights: &[Light], shines: bool) -> CommandResult {
    let Ready { gpu, gpu_scene, scene, .. } = ready;
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    let mut recorder = Recorder::new(gpu, &mut encoder);
    gpu_scene.set_lights(&mut recorder, lights)?;
    for (ix, material) in scene.materials.iter().enumerate() {
        if material.emission != Vec3::ZERO {
            let mut own = material.clone();
            own.emission *= f32::from(u8::from(shines));
            gpu_scene.set_material(&mut recorder, ix, &own)?;
        }
    }
    let sky = if shines { scene.sky.clone() } else { Sky::Constant(Vec3::ZERO) };
    gpu_scene.set_sky(&mut recorder, &sky)?;
    drop(recorder);
    gpu.queue.submit([encoder.finish()]);
    // (What bakes are compared with.)
    scene.lights = lights.to_vec();
    Ok(())
}

/// The picture with the scene's lights as they are. `tells`: notes of the technique are written.
fn sums_of(
    arguments: &RenderArguments,
    ready: &Ready,
    interrupted: &AtomicBool,
    tells: bool,
) -> Result<Vec<PixelSums>, Box<dyn std::error::Error>> {
    if let Some(technique) = TECHNIQUES.iter().find(|of| of.name == arguments.technique) {
        return Ok(frames_of(arguments, technique, ready, interrupted, tells)?.sums);
    }
    if let Some(name) = arguments.settings.first().or_else(|| arguments.realtime.not_of_reference())
    {
        return Err(format!("--{name} means nothing to the technique {REFERENCE}").into());
    }
    let settings = settings!(ReferenceSettings {
        size: ready.size,
        n_bounces: arguments.bounces.unwrap_or(super::REFERENCE_BOUNCES),
        seed: arguments.output.seed,
        ..ReferenceSettings::default()
    });
    let go_on = |_| !interrupted.load(Ordering::Relaxed);
    let Ready { gpu, gpu_scene, camera, .. } = ready;
    Ok(render_reference(gpu, gpu_scene, camera, &settings, arguments.frames, go_on)?.0)
}

/// The light with another colour.
fn coloured(light: &Light, colour: Vec3) -> Light {
    let mut out = light.clone();
    match &mut out {
        Light::Point { intensity, .. } | Light::Spot { intensity, .. } => *intensity = colour,
        Light::Directional { irradiance, .. } => *irradiance = colour,
    }
    out
}

fn names(lights: &[usize]) -> String {
    lights.iter().map(|ix| (ix + 1).to_string()).collect::<Vec<_>>().join(", ")
}

fn report(fit: &LightFit) {
    if fit.n_left_out > 0 {
        errln!("warning: {} pixels are not finite, and were left out", fit.n_left_out);
    }
    if !fit.unseen.is_empty() {
        errln!(
            "warning: the picture does not show light {}: its colour is not known",
            names(&fit.unseen)
        );
    }
    for group in &fit.ambiguous {
        errln!(
            "warning: the picture cannot tell lights {} apart: only their sum is known",
            names(group)
        );
    }
    for (ix, (colour, error)) in fit.colours.iter().zip(&fit.errors).enumerate() {
        let share = *error / colour.max(DVec3::splat(1e-300));
        if error.is_finite() {
            let worst = 100.0 * share.max_element();
            errln!(
                "light {}: {:.6} {:.6} {:.6}, known within {worst:.2} %",
                ix + 1,
                colour.x,
                colour.y,
                colour.z
            );
        }
    }
    let percent = 100.0 * fit.residual.max_element();
    errln!("{percent:.3} % of the picture (root mean square) is not explained by the lights");
}

fn json_of(fit: &LightFit, fitted: &[Light]) -> serde_json::Value {
    // (JSON has no infinity.)
    let finite = |of: DVec3| of.to_array().map(|x| x.is_finite().then_some(x));
    let light = |ix: usize| {
        let kind = match fitted[ix] {
            Light::Point { .. } => "point",
            Light::Spot { .. } => "spot",
            Light::Directional { .. } => "directional",
        };
        serde_json::json!({
            "kind": kind,
            "intensity": fit.colours[ix].to_array(),
            "standard_error": finite(fit.errors[ix]),
            "is_seen": !fit.unseen.contains(&ix),
        })
    };
    serde_json::json!({
        "lights": (0..fitted.len()).map(light).collect::<Vec<_>>(),
        "residual": fit.residual.to_array(),
        "cannot_be_told_apart": fit.ambiguous,
        "pixels_left_out": fit.n_left_out,
    })
}
