//! Flags of `voxel-rt`; those of the voxels are `voxel-cone`'s too.

use crate::cli::CommandResult;
use clap::Args;
use lucerna::blocking::read_buffer;
use lucerna::gpu::Gpu;
use lucerna::voxel::{MAX_SIZE, Resolution};
use lucerna::voxel_rt::{
    Bounces, CacheBuffers, DirectLight, Levels, Lookup, RaysInjected, RejectedSamples, VoxelReach,
    VoxelRt, VoxelRtSettings, WriteStrategy,
};

/// What only the voxel techniques look at.
#[derive(Args, Clone, Debug)]
#[command(next_help_heading = "voxel-rt and voxel-cone")]
pub struct VoxelArguments {
    /// Cells along the longest side of the scene, and along each side of the levels within; or three numbers
    /// (`128x64x64`, of `voxel-cone`) for the scene's grid.
    #[arg(long, value_name = "CELLS", default_value = "128", value_parser = parse_resolution)]
    voxels: Resolution,
    /// One value a voxel instead of one for each of its six faces.
    #[arg(long)]
    isotropic: bool,
    /// Nested grids, 1 to 6: the coarsest holds the whole scene, the others stand around the camera, with cells
    /// half as large from one to the next. `auto`: more than one where that alone would be too coarse for what
    /// stands around the camera.
    #[arg(long, value_name = "N|auto", default_value = "auto", value_parser = parse_levels)]
    levels: Levels,
    /// Surface points drawn on each voxel's face in each frame.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=256))]
    points: u32,
    /// Where the light comes from that the grid holds before it is reflected.
    #[arg(long, value_enum, default_value_t = InjectArgument::Faces)]
    inject: InjectArgument,
    /// With `--inject lights` or `camera`: N × N rays a frame (and light).
    #[arg(long, value_name = "N", default_value_t = RaysInjected::default().n_rays, value_parser = clap::value_parser!(u32).range(1..=4096))]
    inject_rays: u32,
    /// With `--inject lights` or `camera`: how rays come together that meet the same voxel's face.
    #[arg(long, value_enum, default_value_t = WriteArgument::Exact)]
    write: WriteArgument,
    /// How pixels read the grid.
    #[arg(long, value_enum, default_value_t = LookupArgument::Valid)]
    lookup: LookupArgument,
}

#[derive(clap::ValueEnum, Clone, Copy, Debug)]
enum InjectArgument {
    /// Every voxel's face draws points and lights, and traces shadow rays.
    Faces,
    /// Rays leave the lights (the source's).
    Lights,
    /// Rays leave the camera.
    Camera,
}

#[derive(clap::ValueEnum, Clone, Copy, Debug)]
enum WriteArgument {
    /// The last writer wins (racy; 8 bits a channel).
    Store,
    /// Moving average of up to 255 samples by compare-and-swap (8 bits a channel; the source's).
    MovingAverage,
    /// The largest (8 bits a channel).
    Max,
    /// The exact mean, whatever the order.
    Exact,
}

#[derive(clap::ValueEnum, Clone, Copy, Debug)]
enum LookupArgument {
    /// Trilinear over cells with surfaces that look the pixel's way.
    Valid,
    /// Trilinear over all cells, empty ones dark (the source's).
    Trilinear,
    /// The mean of seven of those (the source's).
    SevenTap,
}

fn parse_resolution(text: &str) -> Result<Resolution, String> {
    let numbers: Option<Vec<u32>> = text
        .split('x')
        .map(|number| number.parse().ok().filter(|n| (1..=MAX_SIZE).contains(n)))
        .collect();
    match numbers.as_deref() {
        Some(&[n]) => Ok(Resolution::Longest(n)),
        Some(&[x, y, z]) => Ok(Resolution::Size(glam::UVec3::new(x, y, z))),
        _ => Err("expected a number from 1 to 256, or three of them as in 128x64x64".into()),
    }
}

fn parse_levels(text: &str) -> Result<Levels, String> {
    match (text, text.parse()) {
        ("auto", _) => Ok(Levels::Auto),
        (_, Ok(n @ 1..=6)) => Ok(Levels::Nested(n)),
        _ => Err("expected `auto`, or a number from 1 to 6".into()),
    }
}

impl VoxelArguments {
    /// Cells of the scene's grid.
    pub fn resolution(&self) -> Resolution {
        self.voxels
    }

    /// Whether each face has its value.
    pub fn is_anisotropic(&self) -> bool {
        !self.isotropic
    }

    /// Nested grids.
    pub fn levels(&self) -> Levels {
        self.levels
    }

    /// Points drawn on a face.
    pub fn n_points(&self) -> u32 {
        self.points
    }

    /// `bounces`: None: without end.
    ///
    /// # Errors
    /// The grid has three numbers.
    pub fn settings(
        &self,
        bounces: Option<u32>,
        seed: u32,
    ) -> Result<VoxelRtSettings, &'static str> {
        let Resolution::Longest(resolution) = self.voxels else {
            return Err("--voxels takes one number with --technique voxel-rt");
        };
        let rays = RaysInjected {
            n_rays: self.inject_rays,
            strategy: match self.write {
                WriteArgument::Store => WriteStrategy::Store,
                WriteArgument::MovingAverage => WriteStrategy::MovingAverage,
                WriteArgument::Max => WriteStrategy::Max,
                WriteArgument::Exact => WriteStrategy::Exact,
            },
        };
        Ok(VoxelRtSettings {
            resolution,
            anisotropic: !self.isotropic,
            levels: self.levels,
            points_per_face: self.points,
            direct: match self.inject {
                InjectArgument::Faces => DirectLight::PerFace,
                InjectArgument::Lights => DirectLight::FromLights(rays),
                InjectArgument::Camera => DirectLight::FromCamera(rays),
            },
            bounces: bounces.map_or(Bounces::Unlimited, Bounces::UpTo),
            lookup: match self.lookup {
                LookupArgument::Valid => Lookup::Valid,
                LookupArgument::Trilinear => Lookup::Trilinear,
                LookupArgument::SevenTap => Lookup::SevenTap,
            },
            seed,
            ..VoxelRtSettings::default()
        })
    }
}

/// Says how the grids were laid out where that is not plain, and where they are too coarse.
pub fn tell_reach(reach: &VoxelReach, n_levels: usize) {
    let VoxelReach { finest_cell, coarsest_cell, surroundings, is_cut } = *reach;
    if n_levels > 1 {
        errln!(
            "voxels: {n_levels} nested grids, cells of {finest_cell:.3} m to {coarsest_cell:.3} m"
        );
    }
    if is_cut {
        errln!(
            "warning: what lies more than 1024 times as far away as anything that the camera sees has no voxels, and gives no indirect light"
        );
    }
    if let Some(around) = surroundings.filter(|_| reach.is_coarse()) {
        errln!(
            "warning: the finest voxels are {finest_cell:.3} m wide, and half of what stands around the camera is nearer than {:.3} m: indirect light will be wrong; use --levels auto, or more --voxels",
            around.median
        );
    }
}

/// Says what had to be left out of the voxels: those without room, light that is no number.
pub fn warn_of_buffers(gpu: &Gpu, buffers: &CacheBuffers) -> CommandResult {
    let word =
        |bytes: &[u8], ix: usize| u32::from_ne_bytes(std::array::from_fn(|k| bytes[4 * ix + k]));
    for (level, counts) in buffers.counts.iter().enumerate() {
        let bytes = read_buffer(gpu, counts)?;
        let (found, without_room) = (word(&bytes, 0), word(&bytes, 1));
        if without_room > 0 {
            errln!(
                "warning: level {level} has room for {found} voxels and {without_room} are left out: use fewer --voxels or --isotropic"
            );
        }
    }
    let faults = read_buffer(gpu, &buffers.faults)?;
    let (n_rejected, n_cut) = (word(&faults, 0), word(&faults, 1));
    if n_cut > 0 {
        errln!(
            "warning: light of voxels had to do with fewer samples than asked for ({n_cut} times): this driver ends loops after 65535 iterations; use fewer --points, --bounces or --bounce-cones"
        );
    }
    if n_rejected > 0 {
        errln!("warning: light of voxels was not finite and counts as dark ({n_rejected} times)");
    }
    Ok(())
}

/// Says what had to be left out.
pub fn warn(gpu: &Gpu, technique: &VoxelRt) -> CommandResult {
    warn_of_buffers(gpu, technique.buffers())?;
    for volume in technique.deposit().into_iter().flat_map(|deposit| deposit.volumes()) {
        let rejected = RejectedSamples::from_bytes(&read_buffer(gpu, volume.accumulators())?);
        if rejected.not_finite + rejected.clamped > 0 {
            errln!(
                "warning: of the injected light {} samples were not finite and {} were clamped",
                rejected.not_finite,
                rejected.clamped
            );
        }
        if rejected.cut > 0 {
            errln!(
                "warning: {} injected rays were not traced: this driver ends loops after 65535 iterations",
                rejected.cut
            );
        }
    }
    Ok(())
}
