//! Flags of `voxel-cone`.

use super::voxels::{self, VoxelArguments};
use crate::cli::CommandResult;
use clap::Args;
use lucerna::gpu::Gpu;
use lucerna::voxel_cone::{
    ConeStepping, FaceWeights, PyramidStorage, Specular, VoxelCone, VoxelConeSettings,
};
use lucerna::voxel_rt::Bounces;

/// What only `voxel-cone` looks at.
#[derive(Args, Clone, Debug)]
#[command(next_help_heading = "voxel-cone")]
pub struct ConeArguments {
    /// Cones of a pixel.
    #[arg(long, value_name = "N", default_value_t = 9, value_parser = parse_cone_set)]
    cones: u32,
    /// Cones of a voxel's face, for further bounces.
    #[arg(long, value_name = "N", default_value_t = 9, value_parser = parse_cone_set)]
    bounce_cones: u32,
    /// Bounces without end: a voxel's turn comes in one frame of so many.
    #[arg(long, value_name = "FRAMES", default_value_t = VoxelConeSettings::default().bounce_period, value_parser = clap::value_parser!(u32).range(1..=64))]
    bounce_period: u32,
    /// Length of a step in widths of the cone, 0.05 to 4.
    #[arg(long, value_name = "X", default_value_t = ConeStepping::default().step_scale)]
    step_scale: f32,
    /// Added to the mip that a cone reads, -4 to 4.
    #[arg(long, value_name = "X", default_value_t = ConeStepping::default().mip_bias, allow_negative_numbers = true)]
    mip_bias: f32,
    /// Opacity at which a cone is given up, 0.01 to 1.
    #[arg(long, value_name = "X", default_value_t = ConeStepping::default().opacity_threshold)]
    opacity_threshold: f32,
    /// How far off the surface cones begin, in voxels, 0 to 8.
    #[arg(long, value_name = "VOXELS", default_value_t = ConeStepping::default().start_cells)]
    start: f32,
    /// How a voxel's faces count for a cone.
    #[arg(long, value_enum, default_value_t = WeightArgument::Projected)]
    face_weights: WeightArgument,
    /// What glossy surfaces mirror: `roughness`, `off`, or a fixed aperture in degrees (10: the source's).
    #[arg(long, value_name = "APERTURE", default_value = "roughness", value_parser = parse_specular)]
    specular: Specular,
    /// Leave out screen-space specular occlusion.
    #[arg(long)]
    no_specular_occlusion: bool,
    /// Attenuate diffuse light by what stands close by in the picture, at a quarter of its pixels.
    #[arg(long)]
    diffuse_occlusion: bool,
    /// Give voxels' faces without a surface the mean of their neighbours.
    #[arg(long)]
    fill_gaps: bool,
    /// Cones do not pass through the backs of single-sided surfaces.
    #[arg(long)]
    opaque_backs: bool,
    /// Keep prefiltered voxels in buffers in the place of 3-D textures (the same numbers, slower).
    #[arg(long)]
    pyramid_buffers: bool,
}

#[derive(clap::ValueEnum, Clone, Copy, Debug)]
enum WeightArgument {
    /// By the direction's components: walls are as opaque at a slant as head-on.
    Projected,
    /// By their squares (the source's).
    Squared,
}

fn parse_cone_set(text: &str) -> Result<u32, String> {
    match text.parse() {
        Ok(n @ (5 | 6 | 9 | 16)) => Ok(n),
        _ => Err("expected 5, 6, 9 or 16".into()),
    }
}

fn parse_specular(text: &str) -> Result<Specular, String> {
    match (text, text.parse::<f32>()) {
        ("roughness", _) => Ok(Specular::Roughness),
        ("off", _) => Ok(Specular::Off),
        (_, Ok(degrees)) if (0.1..=119.0).contains(&degrees) => Ok(Specular::Fixed(degrees)),
        _ => Err("expected `roughness`, `off`, or degrees between 0.1 and 119".into()),
    }
}

impl ConeArguments {
    /// `bounces`: None: without end.
    pub fn settings(
        &self,
        voxels: &VoxelArguments,
        bounces: Option<u32>,
        seed: u32,
    ) -> VoxelConeSettings {
        VoxelConeSettings {
            resolution: voxels.resolution(),
            anisotropic: voxels.is_anisotropic(),
            levels: voxels.levels(),
            points_per_face: voxels.n_points(),
            bounces: bounces.map_or(Bounces::Unlimited, Bounces::UpTo),
            n_cones: self.cones,
            n_bounce_cones: self.bounce_cones,
            bounce_period: self.bounce_period,
            stepping: ConeStepping {
                step_scale: self.step_scale,
                mip_bias: self.mip_bias,
                opacity_threshold: self.opacity_threshold,
                start_cells: self.start,
            },
            face_weights: match self.face_weights {
                WeightArgument::Projected => FaceWeights::Projected,
                WeightArgument::Squared => FaceWeights::Squared,
            },
            specular: self.specular,
            opaque_backs: self.opaque_backs,
            occludes_specular: !self.no_specular_occlusion,
            occludes_diffuse: self.diffuse_occlusion,
            fills_gaps: self.fill_gaps,
            storage: if self.pyramid_buffers {
                PyramidStorage::Buffers
            } else {
                PyramidStorage::Textures
            },
            seed,
        }
    }
}

/// Says what had to be left out.
pub fn warn(gpu: &Gpu, technique: &VoxelCone) -> CommandResult {
    voxels::warn_of_buffers(gpu, technique.buffers())
}
