// SPDX-License-Identifier: MIT OR Apache-2.0
//! How much light leaks through walls: houses drawn at random, of which a wall leaves one part dark.

use super::Row;
use crate::render::settings::NEEDS_BAKE;
use crate::sparse_bake;
use glam::UVec2;
use lucerna::blocking::{FramesToRender, read_film, render_frames_with};
use lucerna::components::LightVisibility;
use lucerna::frame::{DirectSettings, FramePasses, Technique};
use lucerna::gpu::Gpu;
use lucerna::gpu_scene::{GpuScene, GpuSceneOptions, RaySource};
use lucerna::settings;
use lucerna::techniques::reference::{Channel, resolve};
use lucerna::techniques::{TECHNIQUES, TechniqueEntry};
use lucerna::testing::{House, around};
use std::error::Error;

/// Houses, half of them with the fine grid.
const N_HOUSES: u64 = 100;
const N_HOUSES_QUICK: u64 = 12;
/// The setting that says how fine a technique is, two values of it, and how many cells there are along the longest side with each; with `quick`, all houses
/// have the coarse one. (6000 and 24 000 texels are 0.2 m and 0.1 m wide: 40 and 80 along a house.)
const GRIDS: [(&str, [u32; 2], [u32; 2]); 3] = [
    ("voxels", [64, 128], [64, 128]),
    ("cells", [32, 64], [32, 64]),
    ("texels", [6000, 24_000], [40, 80]),
];
/// The longest side of a house [m].
const LENGTH: f32 = 8.0;
/// What else a bake of a house gets.
const BAKE: [(&str, &str); 2] = [("probes", "48"), ("texel-rays", "128")];
const WARM_UP: u32 = 48;
const FRAMES: u32 = 8;
/// Pixels of each of the six views from a part's middle.
const SIDE: u32 = 16;

/// For each technique that stores light in cells or texels, or the one of this name, the worst and the median house.
///
/// # Errors
/// A technique or a device fails.
pub fn measure(
    gpu: &Gpu,
    source: RaySource,
    quick: bool,
    only: Option<&str>,
) -> Result<Vec<Row>, Box<dyn Error>> {
    let n_houses = if quick { N_HOUSES_QUICK } else { N_HOUSES };
    let mut rows = Vec::new();
    let grid_of = |technique: &TechniqueEntry| {
        let has = |name: &str| technique.settings.iter().any(|setting| setting.name == name);
        GRIDS.into_iter().find(|(setting, ..)| has(setting))
    };
    let wanted = TECHNIQUES.iter().filter(|of| only.is_none_or(|name| name == of.name));
    for (technique, (setting, values, cells)) in wanted.filter_map(|of| Some((of, grid_of(of)?))) {
        let mut leaks = Vec::new();
        for seed in 0..n_houses {
            let which = if quick { 0 } else { (seed / 2 % 2) as usize };
            let (value, cells) = (values[which], cells[which]);
            let house = House::draw(seed, LENGTH / cells as f32);
            let leak = leak_of(gpu, source, technique, &house, (setting, value))?;
            tracing::info!(
                "{} house {seed}: {:.2} % ({} cells, wall of {:.2} cells, normal {:.2})",
                technique.name,
                100.0 * leak,
                cells,
                house.thickness * cells as f32 / LENGTH,
                house.normal
            );
            leaks.push((100.0 * leak, seed));
        }
        leaks.sort_by(|a, b| a.0.total_cmp(&b.0));
        let (worst, seed) = leaks[leaks.len() - 1];
        let name = technique.name;
        rows.push(Row::new(
            format!("{name}, worst of {n_houses} houses (seed {seed})"),
            worst,
            "%",
        ));
        rows.push(Row::new(format!("{name}, median"), leaks[leaks.len() / 2].0, "%"));
    }
    if rows.is_empty() {
        return Err(format!(
            "no technique that stores light in cells or texels is called `{}`",
            only.unwrap_or_default()
        )
        .into());
    }
    Ok(rows)
}

/// Mean indirect light in all directions from the dark part's middle, by that from the lit part's.
fn leak_of(
    gpu: &Gpu,
    source: RaySource,
    technique: &TechniqueEntry,
    house: &House,
    (setting, value): (&str, u32),
) -> Result<f64, Box<dyn Error>> {
    let options = settings!(GpuSceneOptions { rays: source, diffuse_only: true });
    let scene = GpuScene::new(gpu, &house.scene, options)?;
    let value = value.to_string();
    let chosen = [(setting, value.as_str())];
    let visibility = LightVisibility::default();
    let mut made: Box<dyn Technique> = if technique.name == NEEDS_BAKE {
        let chosen = [&chosen[..], &BAKE].concat();
        let of = (gpu, &scene, &house.scene, (true, source));
        Box::new(sparse_bake::technique(of, &chosen, None, &visibility)?)
    } else {
        technique.make(gpu, &scene, &chosen, &visibility, house.eyes[0])?
    };
    let size = UVec2::splat(SIDE);
    let mut passes = FramePasses::new(gpu, &scene, size, DirectSettings::default())?;
    let mut warm_up = WARM_UP;
    let mut sums = [0.0; 2];
    for (eye, sum) in house.eyes.into_iter().zip(&mut sums) {
        for camera in around(eye) {
            let what = settings!(FramesToRender {
                n_warm_up: warm_up,
                ..FramesToRender::new(size, FRAMES)
            });
            warm_up = 0;
            passes.accumulator.reset();
            let technique: &mut dyn Technique = &mut *made;
            (passes, _) =
                render_frames_with(gpu, &scene, &camera, &what, technique, passes, |_| true)?;
            let sums = read_film(gpu, passes.accumulator.film())?;
            let picture = resolve(&sums, size, Channel::Indirect);
            *sum += picture.rgb.iter().map(|pixel| f64::from(pixel.element_sum())).sum::<f64>();
        }
    }
    Ok(sums[1] / sums[0])
}
