//! Bind groups that are made once and found again.

/// How many are kept: a pass that alternates between two textures needs two.
const KEPT: usize = 8;

/// Bind groups by what they bind.
#[derive(Clone, Debug, Default)]
pub struct BindGroupCache {
    entries: Vec<(Vec<wgpu::Buffer>, Vec<wgpu::TextureView>, wgpu::BindGroup)>,
}

impl BindGroupCache {
    /// The bind group of these buffers and views; `make` makes it where there is none yet. What else
    /// it binds must always be the same.
    pub fn get(
        &mut self,
        buffers: &[&wgpu::Buffer],
        views: &[&wgpu::TextureView],
        make: impl FnOnce() -> wgpu::BindGroup,
    ) -> wgpu::BindGroup {
        let known = self.entries.iter().find(|(known_buffers, known_views, _)| {
            known_buffers.iter().eq(buffers.iter().copied())
                && known_views.iter().eq(views.iter().copied())
        });
        if let Some((_, _, group)) = known {
            return group.clone();
        }
        if self.entries.len() == KEPT {
            self.entries.remove(0);
        }
        let group = make();
        self.entries.push((
            buffers.iter().map(|&buffer| buffer.clone()).collect(),
            views.iter().map(|&view| view.clone()).collect(),
            group.clone(),
        ));
        group
    }
}
