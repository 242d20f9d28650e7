// SPDX-License-Identifier: MIT OR Apache-2.0
//! Recording into the caller's command encoder.

use super::uniforms::Uniforms;
use super::{Gpu, PassTimers};

/// What recording needs: the device, the caller's command encoder, timers, and memory for uniforms.
///
/// Everything takes effect in the order of recording, including uploads and uniforms: two views, two techniques or two
/// frames give the same bytes in one submission as in separate ones. Nothing here submits or waits.
///
/// Uniforms are in buffers that are reused when the submission is done, which wgpu notices in later submissions and
/// polls.
pub struct Recorder<'a> {
    gpu: &'a Gpu,
    encoder: &'a mut wgpu::CommandEncoder,
    timers: Option<&'a mut PassTimers>,
    uniforms: Uniforms,
}

impl<'a> Recorder<'a> {
    /// Records into `encoder`, which must belong to the same device.
    pub fn new(gpu: &'a Gpu, encoder: &'a mut wgpu::CommandEncoder) -> Self {
        Self::timed(gpu, encoder, None)
    }

    /// As [`Self::new`], but passes write GPU timestamps, if there are timers.
    pub fn timed(
        gpu: &'a Gpu,
        encoder: &'a mut wgpu::CommandEncoder,
        timers: Option<&'a mut PassTimers>,
    ) -> Self {
        let uniforms = Uniforms::new(&gpu.uniforms, &gpu.device);
        Self { gpu, encoder, timers, uniforms }
    }

    /// The device.
    pub fn gpu(&self) -> &'a Gpu {
        self.gpu
    }

    /// The caller's command encoder, for commands that are not passes.
    pub fn encoder(&mut self) -> &mut wgpu::CommandEncoder {
        self.encoder
    }

    /// Writes to a buffer that has `COPY_DST`, in the order of recording. `offset` and the contents' length are multiples of
    /// 4 bytes.
    pub fn upload(&mut self, buffer: &wgpu::Buffer, offset: u64, contents: &[u8]) {
        let mut at = offset;
        for part in contents.chunks(32 << 10) {
            let (chunk, place) = self.uniforms.place(&self.gpu.device, &self.gpu.queue, part);
            let bytes = part.len() as u64;
            self.encoder.copy_buffer_to_buffer(&chunk, u64::from(place), buffer, at, bytes);
            at += bytes;
        }
    }

    /// Starts a compute pass, which is timed under its label.
    pub fn compute(&mut self, label: &'static str) -> ComputeRecorder<'_> {
        let timestamp_writes = self.timers.as_deref_mut().and_then(|timers| timers.compute(label));
        let descriptor = wgpu::ComputePassDescriptor { label: Some(label), timestamp_writes };
        ComputeRecorder {
            pass: self.encoder.begin_compute_pass(&descriptor),
            gpu: self.gpu,
            uniforms: &mut self.uniforms,
        }
    }

    /// Starts a render pass, which is timed under its label. `targets` are cleared to zero, `depth` to 0.
    pub fn render(
        &mut self,
        label: &'static str,
        targets: &[&wgpu::TextureView],
        depth: Option<&wgpu::TextureView>,
    ) -> RenderRecorder<'_> {
        let targets: Vec<_> = targets
            .iter()
            .map(|&view| {
                Some(wgpu::RenderPassColorAttachment {
                    view,
                    depth_slice: None,
                    resolve_target: None,
                    ops: wgpu::Operations {
                        load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT),
                        store: wgpu::StoreOp::Store,
                    },
                })
            })
            .collect();
        let descriptor = wgpu::RenderPassDescriptor {
            label: Some(label),
            color_attachments: &targets,
            depth_stencil_attachment: depth.map(|view| wgpu::RenderPassDepthStencilAttachment {
                view,
                depth_ops: Some(wgpu::Operations {
                    load: wgpu::LoadOp::Clear(0.0),
                    store: wgpu::StoreOp::Store,
                }),
                stencil_ops: None,
            }),
            timestamp_writes: self.timers.as_deref_mut().and_then(|timers| timers.render(label)),
            occlusion_query_set: None,
            multiview_mask: None,
        };
        RenderRecorder {
            pass: self.encoder.begin_render_pass(&descriptor),
            gpu: self.gpu,
            uniforms: &mut self.uniforms,
        }
    }
}

impl Drop for Recorder<'_> {
    fn drop(&mut self) {
        self.uniforms.release(self.encoder);
    }
}

/// A compute pass that is being recorded; see [`ComputeKernel::call`](super::ComputeKernel::call).
pub struct ComputeRecorder<'r> {
    pub(super) pass: wgpu::ComputePass<'r>,
    pub(super) gpu: &'r Gpu,
    pub(super) uniforms: &'r mut Uniforms,
}

/// A render pass that is being recorded; see [`RenderKernel`](super::RenderKernel).
pub struct RenderRecorder<'r> {
    pub(super) pass: wgpu::RenderPass<'r>,
    pub(super) gpu: &'r Gpu,
    pub(super) uniforms: &'r mut Uniforms,
}
