// SPDX-License-Identifier: MIT OR Apache-2.0
//! Where probes are: on a lattice, or at the points of a net.

use super::lattice::Lattice;
use crate::components::voxels::VoxelGrid;
use crate::gpu::Bindings;
use crate::shader::Variant;

#[cfg(feature = "nets")]
use super::net::Net;
#[cfg(feature = "nets")]
use crate::shader::NET_PROBES;

/// Where probes are.
#[derive(Debug)]
pub(super) enum Layout {
    Lattice(Box<Lattice>),
    #[cfg(feature = "nets")]
    Net(Box<Net>),
}

/// The same call on either.
macro_rules! either {
    ($layout:expr, $found:ident => $call:expr) => {
        match $layout {
            Layout::Lattice($found) => $call,
            #[cfg(feature = "nets")]
            Layout::Net($found) => $call,
        }
    };
}

impl Layout {
    /// A variant with the modules of this layout.
    pub fn of(&self, variant: Variant) -> Variant {
        match self {
            Self::Lattice(_) => variant,
            #[cfg(feature = "nets")]
            Self::Net(_) => variant.with(NET_PROBES),
        }
    }

    /// Whether probes stay where they are when surfaces move.
    pub fn stays(&self) -> bool {
        match self {
            Self::Lattice(lattice) => lattice.voxelizer().is_none(),
            #[cfg(feature = "nets")]
            Self::Net(_) => true,
        }
    }

    /// The most probes that there is room for.
    pub fn capacity(&self) -> u32 {
        match self {
            Self::Lattice(lattice) => lattice.grid().capacity,
            #[cfg(feature = "nets")]
            Self::Net(net) => net.capacity(),
        }
    }

    /// One [`VoxelCounts`](crate::components::voxels::VoxelCounts): probes, and groups for them.
    pub fn counts(&self) -> &wgpu::Buffer {
        match self {
            Self::Lattice(lattice) => lattice.occupancy().counts(),
            #[cfg(feature = "nets")]
            Self::Net(net) => net.counts(),
        }
    }

    /// The bindings of kernels that compute what probes hold (`fields::probe_places`).
    pub fn places(&self) -> Bindings<'_> {
        either!(self, found => found.places())
    }

    /// Its part of the bindings of kernels that look up light (`fields::probes`).
    pub fn look_up(&self) -> Bindings<'_> {
        either!(self, found => found.look_up())
    }

    /// The lattice; of a net, only its origin and its unit.
    pub fn grid(&self) -> VoxelGrid {
        match self {
            Self::Lattice(lattice) => *lattice.grid(),
            #[cfg(feature = "nets")]
            Self::Net(net) => net.grid(),
        }
    }

    /// The lattice, if it is one.
    pub fn lattice(&self) -> Option<&Lattice> {
        match self {
            Self::Lattice(lattice) => Some(lattice),
            #[cfg(feature = "nets")]
            Self::Net(_) => None,
        }
    }
}
