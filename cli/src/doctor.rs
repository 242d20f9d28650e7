// SPDX-License-Identifier: MIT OR Apache-2.0
//! `lucerna doctor`.

use super::CommandResult;
use lucerna::gpu::adapters;

pub fn doctor() -> CommandResult {
    let adapters = pollster::block_on(adapters());
    if adapters.is_empty() {
        return Err(lucerna::gpu::GpuError::NoAdapter.into());
    }
    for (ix, adapter) in adapters.iter().enumerate() {
        let info = adapter.get_info();
        let limits = adapter.limits();
        let features = adapter.features();
        let taken = if ix == 0 { " (taken by --adapter auto)" } else { "" };
        outln!("{}{taken}", info.name)?;
        outln!(
            "  {:?}, {}, driver {} {}",
            info.device_type,
            info.backend,
            info.driver,
            info.driver_info
        )?;
        let mib = |bytes: u64| bytes / (1 << 20);
        outln!(
            "  one storage binding: {} MiB; one buffer: {} MiB; texture side: {}",
            mib(limits.max_storage_buffer_binding_size),
            mib(limits.max_buffer_size),
            limits.max_texture_dimension_2d
        )?;
        let missing = missing_limits(&limits);
        if missing.is_empty() {
            outln!("  baseline kernels: yes")?;
        } else {
            outln!(
                "  baseline kernels: no, below WebGPU's default limits: {}",
                missing.join(", ")
            )?;
        }
        let answer = |feature, reason: &str| {
            if features.contains(feature) { String::from("yes") } else { format!("no, {reason}") }
        };
        outln!(
            "  ray_query kernels: {}",
            answer(wgpu::Features::EXPERIMENTAL_RAY_QUERY, "the driver has no ray queries")
        )?;
        outln!(
            "  timings per pass: {}",
            answer(wgpu::Features::TIMESTAMP_QUERY, "the driver has no timestamps")
        )?;
    }
    Ok(())
}

/// The default limits that an adapter misses, by name.
fn missing_limits(offered: &wgpu::Limits) -> Vec<String> {
    let mut missing = Vec::new();
    wgpu::Limits::default().check_limits_with_fail_fn(offered, false, |name, wanted, offered| {
        missing.push(format!("{name} ({offered} of {wanted})"));
    });
    missing
}
