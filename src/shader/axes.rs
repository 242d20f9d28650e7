// SPDX-License-Identifier: MIT OR Apache-2.0
//! Variants of kernels: independent choices of the module behind an import path.
//!
//! An [`Axis`] has two or more values. The first one is the tree itself; each other value has an overlay of modules
//! under `variants/<axis>/<value>/`, which replace the modules of the same path. A kernel exists in every combination
//! of the axes that affect its imports, and in no other. There is no list to maintain.

#[cfg(not(without_compose))]
use naga::valid::Capabilities;
use std::fmt;

/// A capability that plain WebGPU has and naga requires: `pack2x16float` and similar functions (which need no f16).
#[cfg(not(without_compose))]
pub const BASELINE: Capabilities = Capabilities::SHADER_FLOAT16_IN_FLOAT32;

/// One choice that is made when a kernel is composed.
#[derive(Clone, Copy, Debug)]
pub struct Axis {
    /// Its name, and that of its folder under `variants/`.
    pub name: &'static str,
    /// Its values; the first one has no overlay.
    pub values: &'static [AxisValue],
}

/// A value of an [`Axis`].
#[derive(Clone, Copy, Debug)]
pub struct AxisValue {
    /// Its name, and that of its folder.
    pub name: &'static str,
    /// The naga capabilities that its modules need besides [`BASELINE`] (feature `compose`).
    #[cfg(not(without_compose))]
    pub capabilities: Capabilities,
}

const fn plain(name: &'static str) -> AxisValue {
    AxisValue {
        name,
        #[cfg(not(without_compose))]
        capabilities: Capabilities::empty(),
    }
}

/// The axes of lucerna's kernels.
pub const AXES: &[Axis] = &[
    Axis {
        name: "rays",
        values: &[
            plain("software"),
            AxisValue {
                name: "ray_query",
                #[cfg(not(without_compose))]
                capabilities: Capabilities::RAY_QUERY,
            },
        ],
    },
    Axis { name: "textures", values: &[plain("atlas"), plain("none")] },
    Axis { name: "visibility", values: &[plain("rays"), plain("maps"), plain("cones")] },
    Axis { name: "volumes", values: &[plain("textures"), plain("buffers")] },
    Axis { name: "cones", values: &[plain("prefiltered"), plain("surfels")] },
    Axis {
        name: "basis",
        values: &[
            plain("sh2"),
            plain("sh2_float"),
            plain("sh2_bytes"),
            plain("sh1"),
            plain("ambient_cube"),
            plain("chroma_sh1"),
            plain("chroma_constant"),
            plain("sh4"),
        ],
    },
    Axis { name: "probes", values: &[plain("lattice"), plain("net")] },
];

/// The number of axes that a [`Variant`] has room for.
const MAX_AXES: usize = 8;
const _: () = assert!(AXES.len() <= MAX_AXES);

/// A value that is not an axis's first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Choice {
    axis: usize,
    value: u8,
}

/// Rays are traced by the adapter's acceleration structure; needs wgpu's `EXPERIMENTAL_RAY_QUERY`.
pub const RAY_QUERY: Choice = Choice { axis: 0, value: 1 };
/// The scene has no textures: kernels carry no code that reads them.
pub const NO_TEXTURES: Choice = Choice { axis: 1, value: 1 };
/// Shadow maps answer visibility queries; rays do for lights without a map.
pub const SHADOW_MAPS: Choice = Choice { axis: 2, value: 1 };
/// Cones through prefiltered voxels answer visibility queries.
pub const SHADOW_CONES: Choice = Choice { axis: 2, value: 2 };
/// Prefiltered voxels are kept in storage buffers instead of 3-D textures.
pub const VOLUME_BUFFERS: Choice = Choice { axis: 3, value: 1 };
/// Cones are followed along their axes from surfel to surfel, instead of through prefiltered voxels.
pub const SURFEL_CONES: Choice = Choice { axis: 4, value: 1 };
/// Probes keep their light as f32.
pub const BASIS_SH2_FLOAT: Choice = Choice { axis: 5, value: 1 };
/// Probes keep their light as bytes.
pub const BASIS_SH2_BYTES: Choice = Choice { axis: 5, value: 2 };
/// Probes keep spherical harmonics of order 1.
pub const BASIS_SH1: Choice = Choice { axis: 5, value: 3 };
/// Probes keep ambient cubes.
pub const BASIS_AMBIENT_CUBE: Choice = Choice { axis: 5, value: 4 };
/// Probes keep luma of order 2 and differences of colour of order 1.
pub const BASIS_CHROMA_SH1: Choice = Choice { axis: 5, value: 5 };
/// Probes keep luma of order 2 and means of differences of colour.
pub const BASIS_CHROMA_CONSTANT: Choice = Choice { axis: 5, value: 6 };
/// Probes keep spherical harmonics of order 4.
pub const BASIS_SH4: Choice = Choice { axis: 5, value: 7 };
/// Probes are at the points of a net, instead of at corners of cells.
pub const NET_PROBES: Choice = Choice { axis: 6, value: 1 };

/// One value of each axis. The default is the first of each, the baseline: plain WebGPU.
#[derive(Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Variant([u8; MAX_AXES]);

impl Variant {
    /// The first value of each axis.
    pub const BASELINE: Self = Self([0; MAX_AXES]);

    /// This variant with another value on the choice's axis.
    pub const fn with(mut self, choice: Choice) -> Self {
        self.0[choice.axis] = choice.value;
        self
    }

    /// [`Self::with`] if the condition holds.
    pub const fn with_if(self, condition: bool, choice: Choice) -> Self {
        if condition { self.with(choice) } else { self }
    }

    /// Whether this value is chosen.
    pub const fn has(self, choice: Choice) -> bool {
        self.0[choice.axis] == choice.value
    }

    /// The index of the value on an axis.
    pub(super) fn value(self, axis: usize) -> usize {
        usize::from(self.0[axis])
    }

    pub(super) fn with_value(mut self, axis: usize, value: usize) -> Self {
        self.0[axis] = value as u8;
        self
    }

    /// The name of its value on one of the [`AXES`].
    pub fn value_name(self, axis: &str) -> Option<&'static str> {
        let ix = AXES.iter().position(|of| of.name == axis)?;
        Some(AXES[ix].values[self.value(ix)].name)
    }

    /// Whether both have the same values on these axes.
    pub fn agrees(self, other: Self, axes: &[&str]) -> bool {
        axes.iter().all(|axis| self.value_name(axis) == other.value_name(axis))
    }

    /// The naga capabilities that its values need together.
    #[cfg(not(without_compose))]
    pub fn capabilities(self) -> Capabilities {
        self.capabilities_of(AXES)
    }

    #[cfg(not(without_compose))]
    pub(super) fn capabilities_of(self, axes: &[Axis]) -> Capabilities {
        let chosen = axes.iter().enumerate().map(|(ix, axis)| axis.values[self.value(ix)]);
        chosen.fold(BASELINE, |all, value| all.union(value.capabilities))
    }

    /// `axis=value` for each axis whose value is not the first, separated by commas; empty for the baseline.
    pub(super) fn name(self, axes: &[Axis]) -> String {
        let parts = axes.iter().enumerate().filter(|(ix, _)| self.value(*ix) != 0);
        let parts =
            parts.map(|(ix, axis)| format!("{}={}", axis.name, axis.values[self.value(ix)].name));
        parts.collect::<Vec<_>>().join(",")
    }

    /// The variant as numbers, for tables that the build script writes.
    pub const fn to_bytes(self) -> [u8; MAX_AXES] {
        self.0
    }

    /// The inverse of [`Self::to_bytes`]. None if an axis does not have the value.
    pub const fn from_bytes(bytes: [u8; MAX_AXES]) -> Option<Self> {
        let mut ix = 0;
        while ix < MAX_AXES {
            let n = if ix < AXES.len() { AXES[ix].values.len() } else { 1 };
            if bytes[ix] as usize >= n {
                return None;
            }
            ix += 1;
        }
        Some(Self(bytes))
    }
}

impl fmt::Display for Variant {
    /// `rays=ray_query,visibility=maps`; `baseline` for the first value of each axis.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = self.name(AXES);
        f.pad(if name.is_empty() { "baseline" } else { &name })
    }
}

impl fmt::Debug for Variant {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Variant({self})")
    }
}

/// No such axis or value.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct UnknownVariant(String);

impl fmt::Display for UnknownVariant {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let all = AXES.iter().flat_map(|axis| {
            axis.values[1..].iter().map(|value| format!("{}={}", axis.name, value.name))
        });
        write!(f, "no variant `{}`; there are {}", self.0, all.collect::<Vec<_>>().join(", "))
    }
}

impl std::error::Error for UnknownVariant {}

impl std::str::FromStr for Variant {
    type Err = UnknownVariant;

    /// Parses the form that `Display` writes.
    fn from_str(text: &str) -> Result<Self, UnknownVariant> {
        let mut out = Self::BASELINE;
        for part in text.split(',').filter(|part| !part.is_empty() && *part != "baseline") {
            let unknown = || UnknownVariant(part.to_owned());
            let (name, value) = part.split_once('=').ok_or_else(unknown)?;
            let axis = AXES.iter().position(|axis| axis.name == name).ok_or_else(unknown)?;
            let values = AXES[axis].values;
            let value = values.iter().position(|of| of.name == value).ok_or_else(unknown)?;
            out = out.with_value(axis, value);
        }
        Ok(out)
    }
}
