// SPDX-License-Identifier: MIT OR Apache-2.0
//! Texture coordinates by the crate `uvunwrap`: charts by growing regions, flattened by least-squares conformal maps (B. Lévy et al., "Least
//! Squares Conformal Maps for Automatic Texture Atlas Generation", SIGGRAPH 2002), packed by their shapes.

use super::{LightmapUvs, NO_CHART};
use crate::seam::StaticMesh;
use glam::{DVec2, UVec2, Vec2};
use uvunwrap::{Density, MeshInput, Options};

/// How a lightmap is laid out.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct LightmapSettings {
    /// About how many texels surfaces get, counted by their area (small charts get more).
    pub n_texels: u32,
    /// Empty texels around each chart; at least 2, so that what one chart's texels give to their neighbours reaches no other chart.
    pub padding: u32,
    /// Whether meshes' second texture coordinates are used, where they are valid.
    pub uses_second_uv: bool,
}

impl Default for LightmapSettings {
    fn default() -> Self {
        Self { n_texels: 40_000, padding: 2, uses_second_uv: true }
    }
}

/// A lightmap is not possible.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum LightmapError {
    /// There is nothing to light.
    #[error("there are no surfaces that a lightmap could have texels for")]
    NoSurfaces,
    /// A setting is out of range.
    #[error("a lightmap of {0} texels is not possible: 16 to 16777216 are")]
    Texels(u32),
    /// The crate `uvunwrap` refuses.
    #[error("texture coordinates could not be made: {0}")]
    Unwrap(String),
    /// It is larger than a texture can be.
    #[error(
        "the lightmap would have {} x {} texels, and {limit} x {limit} are possible: use fewer",
        .size.x, .size.y
    )]
    TooLarge {
        /// What it would have.
        size: UVec2,
        /// Along each side.
        limit: u32,
    },
    /// It was stopped.
    #[error("stopped")]
    Stopped,
}

/// The largest side, which WebGPU allows everywhere.
const MAX_SIDE: u32 = 8192;

/// Makes texture coordinates for all triangles of some meshes, in their order. `keep_going` is asked now and then.
///
/// # Errors
/// [`LightmapError`]
pub fn unwrap(
    meshes: &[StaticMesh],
    settings: &LightmapSettings,
    keep_going: &(dyn Fn() -> bool + Sync),
) -> Result<LightmapUvs, LightmapError> {
    if !(16..=1 << 24).contains(&settings.n_texels) {
        return Err(LightmapError::Texels(settings.n_texels));
    }
    let area: f64 = meshes.iter().map(area_of).sum();
    if area.is_nan() || area <= 0.0 {
        return Err(LightmapError::NoSurfaces);
    }
    let mut notes = Vec::new();
    let positions: Vec<Vec<[f32; 3]>> =
        meshes.iter().map(|mesh| mesh.positions.iter().map(|p| p.to_array()).collect()).collect();
    let second: Vec<Option<Vec<[f32; 2]>>> = meshes
        .iter()
        .map(|mesh| {
            if !settings.uses_second_uv || mesh.second_uv.is_empty() {
                return None;
            }
            match check_second_uv(mesh) {
                Ok(()) => Some(mesh.second_uv.iter().map(|uv| uv.to_array()).collect()),
                Err(why) => {
                    notes.push(format!(
                        "the second texture coordinates of {} are not used: {why}",
                        mesh.name
                    ));
                    None
                }
            }
        })
        .collect();
    let inputs: Vec<MeshInput> = meshes
        .iter()
        .zip(&positions)
        .zip(&second)
        .map(|((mesh, positions), second)| MeshInput {
            existing_uvs: second.as_deref(),
            ..MeshInput::new(positions, mesh.triangles.as_flattened())
        })
        .collect();
    let options = Options {
        density: Density::Fixed {
            texels_per_unit: (f64::from(settings.n_texels) / area).sqrt() as f32,
            page_size: None,
        },
        padding: settings.padding.max(2),
        ..Options::default()
    };
    let atlas =
        uvunwrap::generate_with_progress(&inputs, &options, |_| keep_going()).map_err(|error| {
            match error {
                uvunwrap::Error::Cancelled => LightmapError::Stopped,
                other => LightmapError::Unwrap(other.to_string()),
            }
        })?;
    let size = UVec2::new(atlas.width, atlas.height);
    if size.max_element() > MAX_SIDE {
        return Err(LightmapError::TooLarge { size, limit: MAX_SIDE });
    }
    let mut corners = Vec::new();
    let mut charts = Vec::new();
    for mesh in &atlas.meshes {
        for triangle in mesh.indices.as_chunks::<3>().0 {
            let vertices = triangle.map(|ix| &mesh.vertices[ix as usize]);
            let at = vertices.map(|vertex| Vec2::from(vertex.uv) * size.as_vec2());
            let [a, b, c] = at.map(Vec2::as_dvec2);
            // (A triangle that got no chart lies in a point of another's.)
            let has_area = (b - a).perp_dot(c - a) > 1e-9;
            let chart = vertices[0].chart.filter(|_| {
                has_area && vertices.iter().all(|vertex| vertex.chart == vertices[0].chart)
            });
            charts.push(chart.unwrap_or(NO_CHART));
            corners.push(if chart.is_some() { at } else { [Vec2::ZERO; 3] });
        }
    }
    if charts.iter().all(|chart| *chart == NO_CHART) {
        return Err(LightmapError::NoSurfaces);
    }
    Ok(LightmapUvs {
        size,
        texels_per_metre: atlas.texels_per_unit,
        corners,
        charts,
        n_charts: atlas.chart_count,
        notes,
    })
}

fn area_of(mesh: &StaticMesh) -> f64 {
    let area = |triangle: &[u32; 3]| {
        let [a, b, c] = triangle.map(|ix| mesh.positions[ix as usize].as_dvec3());
        0.5 * (b - a).cross(c - a).length()
    };
    mesh.triangles.iter().map(area).sum()
}

/// Cells along each side of the picture in which overlaps of texture coordinates are looked for.
const CHECK_SIDE: usize = 1024;

/// Whether second texture coordinates are those of a lightmap: finite, in 0..1, and no two triangles over each other. If not, says why.
fn check_second_uv(mesh: &StaticMesh) -> Result<(), String> {
    if mesh.second_uv.len() != mesh.positions.len() {
        return Err("there are not as many as vertices".into());
    }
    if !mesh.second_uv.iter().all(|uv| uv.is_finite()) {
        return Err("some are not finite".into());
    }
    let is_outside = |uv: &Vec2| uv.min_element() < -1e-4 || uv.max_element() > 1.0001;
    if mesh.second_uv.iter().any(is_outside) {
        return Err("some are not between 0 and 1".into());
    }
    let mut owner = vec![u32::MAX; CHECK_SIDE * CHECK_SIDE];
    let mut n_covered = 0u64;
    let mut n_twice = 0u64;
    for (ix, triangle) in mesh.triangles.iter().enumerate() {
        let corners = triangle.map(|v| mesh.second_uv[v as usize].as_dvec2() * CHECK_SIDE as f64);
        for_each_centre(corners, CHECK_SIDE, |x, y| {
            let cell = &mut owner[y * CHECK_SIDE + x];
            n_covered += 1;
            n_twice += u64::from(*cell != u32::MAX);
            *cell = ix as u32;
        });
    }
    if n_covered == 0 {
        return Err("no triangle has an area in them".into());
    }
    // (Centres on a common edge belong to both sides.)
    if n_twice as f64 > 0.01 * n_covered as f64 {
        let percent = 100.0 * n_twice as f64 / n_covered as f64;
        return Err(format!("triangles lie over each other ({percent:.1} % of their area)"));
    }
    Ok(())
}

/// Calls `each` for the cells of a square picture whose centres are strictly inside a triangle of either winding.
fn for_each_centre(corners: [DVec2; 3], side: usize, mut each: impl FnMut(usize, usize)) {
    let [a, b, c] = corners;
    let area = (b - a).perp_dot(c - a);
    if area == 0.0 {
        return;
    }
    let (low, high) = (a.min(b).min(c), a.max(b).max(c));
    let first = |x: f64| (x - 0.5).ceil().max(0.0) as usize;
    let end = |x: f64| ((x - 0.5).floor() + 1.0).clamp(0.0, side as f64) as usize;
    for y in first(low.y)..end(high.y) {
        for x in first(low.x)..end(high.x) {
            let p = DVec2::new(x as f64 + 0.5, y as f64 + 0.5);
            let edge = |from: DVec2, to: DVec2| (to - from).perp_dot(p - from) * area.signum();
            if edge(a, b) > 0.0 && edge(b, c) > 0.0 && edge(c, a) > 0.0 {
                each(x, y);
            }
        }
    }
}
