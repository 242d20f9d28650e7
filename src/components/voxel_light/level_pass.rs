// SPDX-License-Identifier: MIT OR Apache-2.0
//! The kernels that work on the cache alone, one invocation for each slot or record of a level.

use super::cache::CacheBuffers;
use crate::gpu::{ComputeKernel, ComputeRecorder, Dispatch, Gpu, Shaders};
use bytemuck::NoUninit;
use std::marker::PhantomData;

pub use crate::bindings::kernels::voxel_light::carry::CarryInfo;
pub use crate::bindings::kernels::voxel_light::publish::PublishInfo;

/// The uniform `info` of such a kernel. (Of lucerna's own: nobody else can implement it.)
pub trait LevelInfo: NoUninit + of_lucerna::Sealed {
    /// The kernel's name.
    const KERNEL: &'static str;
    /// Index of the level to work on.
    fn level(&self) -> u32;
}

/// Copies a level's light into a new structure, one invocation per record.
pub type CarryPass = LevelPass<CarryInfo>;
/// Computes from the records what bounces and pictures look up, and counts those whose samples were left out, one invocation per record.
pub type PublishPass = LevelPass<PublishInfo>;

impl LevelInfo for CarryInfo {
    const KERNEL: &'static str = "voxel_light/carry";
    fn level(&self) -> u32 {
        self.level
    }
}

impl LevelInfo for PublishInfo {
    const KERNEL: &'static str = "voxel_light/publish";
    fn level(&self) -> u32 {
        self.level
    }
}

mod of_lucerna {
    pub trait Sealed {}
    impl Sealed for super::CarryInfo {}
    impl Sealed for super::PublishInfo {}
}

/// A compiled kernel.
#[derive(Debug)]
pub struct LevelPass<Info>(ComputeKernel, PhantomData<fn(&Info)>);

impl<Info: LevelInfo> LevelPass<Info> {
    /// Compiles the kernel.
    pub fn new(gpu: &Gpu) -> Self {
        Self(ComputeKernel::new(gpu, &Shaders::default(), None, Info::KERNEL), PhantomData)
    }

    /// Records it for level `info.level`. `items`: one invocation for each slot or record.
    pub fn record(
        &self,
        pass: &mut ComputeRecorder,
        buffers: &CacheBuffers,
        info: &Info,
        items: Dispatch,
    ) {
        let bindings = buffers.of_level(info.level());
        self.0.call(pass).uniform("info", info).with(bindings).dispatch(items);
    }
}
