// SPDX-License-Identifier: MIT OR Apache-2.0
//! The pass layer: a kernel with its pipeline and layouts, and a call of it with its bindings.
//!
//! Pipeline, layouts, label and workgroup size come from the table that the build script generates for the kernel. A
//! pass only states its bindings and uniforms, by the names of the shader's variables, and the size of its dispatch:
//!
//! ```no_run
//! # use lucerna::gpu::{ComputeKernel, Dispatch, Gpu, Recorder, Shaders};
//! # fn record(gpu: &Gpu, recorder: &mut Recorder, numbers: &wgpu::Buffer, sums: &wgpu::Buffer) {
//! let add = ComputeKernel::new(gpu, &Shaders::default(), None, "scan/add");
//! let (n, n_blocks) = (10_000u32, 3);
//! let mut pass = recorder.compute("scan/add");
//! add.call(&mut pass)
//!     .uniform("info", &[n, n_blocks])
//!     .bind("numbers", numbers)
//!     .bind("sums", sums)
//!     .dispatch(Dispatch::Items(n));
//! # }
//! ```

use super::recorder::{ComputeRecorder, RenderRecorder};
use super::uniforms::Uniforms;
use super::{Gpu, Shaders};
use crate::bindings::lucerna::math::dispatch::DISPATCH_ROW;
use crate::shader::{Access, Binding, BindingKind, Dimension, Interface, Stage, Texels};
use bytemuck::NoUninit;
use glam::{UVec2, UVec3};
use std::num::NonZeroU64;
use std::sync::{Mutex, PoisonError};

/// Bind group 0 with its layout: the resources behind the scene seam.
#[derive(Clone, Debug)]
pub struct SceneGroup {
    bindings: Vec<Binding>,
    layout: wgpu::BindGroupLayout,
    group: wgpu::BindGroup,
}

impl SceneGroup {
    /// Binds the scene resources that these kernels use, by the names of the seam's variables. (A pipeline's layout
    /// must match the whole group: name all kernels that will run with it, or those that use the most.)
    ///
    /// # Panics
    /// If there is no such kernel, or a variable is not bound, or its binding does not match its declaration.
    pub fn new(gpu: &Gpu, shaders: &Shaders, kernels: &[&str], bound: &Bindings) -> Self {
        let mut all = Interface::default();
        for kernel in kernels {
            let (_, interface) = shaders.source(kernel);
            for entry in interface.entry_points.iter() {
                all.entry_points.to_mut().push(entry.clone());
            }
            for binding in interface.group(0) {
                if !all.bindings.contains(binding) {
                    all.bindings.to_mut().push(binding.clone());
                }
            }
        }
        all.bindings.to_mut().sort_by_key(|binding| binding.binding);
        let layout = layout_of(gpu, "scene", &all, 0, stages_of(&all), false);
        let bindings = all.bindings.into_owned();
        let group = group_of(gpu, &layout, &bindings, bound);
        Self { bindings, layout, group }
    }

    /// Binds other resources in the same layout.
    ///
    /// # Panics
    /// As [`Self::new`].
    pub fn rebind(&mut self, gpu: &Gpu, bound: &Bindings) {
        self.group = group_of(gpu, &self.layout, &self.bindings, bound);
    }

    /// The group's layout.
    pub fn layout(&self) -> &wgpu::BindGroupLayout {
        &self.layout
    }

    /// The group.
    pub fn group(&self) -> &wgpu::BindGroup {
        &self.group
    }
}

fn group_of(
    gpu: &Gpu,
    layout: &wgpu::BindGroupLayout,
    bindings: &[Binding],
    bound: &Bindings,
) -> wgpu::BindGroup {
    let entries: Vec<_> = bindings
        .iter()
        .map(|Binding { binding, name, .. }| {
            let found = bound.iter().find(|(of, _)| of == name);
            let (_, resource) =
                found.unwrap_or_else(|| panic!("the scene's `{name}` has nothing bound to it"));
            let resource = match *resource {
                Resource::Buffer(buffer) => buffer.as_entire_binding(),
                Resource::Texture(view) => wgpu::BindingResource::TextureView(view),
                Resource::Sampler(sampler) => wgpu::BindingResource::Sampler(sampler),
                Resource::Tlas(tlas) => tlas.as_binding(),
                Resource::Uniform(_) => panic!("the scene's `{name}` must be a buffer"),
            };
            wgpu::BindGroupEntry { binding: *binding, resource }
        })
        .collect();
    gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some("scene"),
        layout,
        entries: &entries,
    })
}

/// A resource that is bound to a variable.
#[derive(Clone, Copy, Debug)]
pub enum Resource<'a> {
    /// A whole buffer.
    Buffer(&'a wgpu::Buffer),
    /// A texture.
    Texture(&'a wgpu::TextureView),
    /// A sampler.
    Sampler(&'a wgpu::Sampler),
    /// An acceleration structure.
    Tlas(&'a wgpu::Tlas),
    /// The contents of a `var<uniform>`.
    Uniform(&'a [u8]),
}

impl<'a> From<&'a wgpu::Buffer> for Resource<'a> {
    fn from(buffer: &'a wgpu::Buffer) -> Self {
        Self::Buffer(buffer)
    }
}

impl<'a> From<&'a wgpu::TextureView> for Resource<'a> {
    fn from(view: &'a wgpu::TextureView) -> Self {
        Self::Texture(view)
    }
}

impl<'a> From<&'a wgpu::Sampler> for Resource<'a> {
    fn from(sampler: &'a wgpu::Sampler) -> Self {
        Self::Sampler(sampler)
    }
}

impl<'a> From<&'a wgpu::Tlas> for Resource<'a> {
    fn from(tlas: &'a wgpu::Tlas) -> Self {
        Self::Tlas(tlas)
    }
}

/// Resources that go together, as those of a field or of the pixels' seam, by the names of their variables. A kernel
/// uses those that it declares.
pub type Bindings<'a> = Vec<(&'a str, Resource<'a>)>;

/// The size of a dispatch.
#[derive(Clone, Copy, Debug)]
pub enum Dispatch<'a> {
    /// One invocation per item, in rows of workgroups, as `dispatch_of_groups` of `wgsl/math/dispatch.wgsl` lays them
    /// out.
    Items(u32),
    /// This number of workgroups, in such rows.
    Rows(u32),
    /// One invocation for each item of a rectangle.
    Area(UVec2),
    /// One invocation for each item of a box.
    Box(UVec3),
    /// Workgroups along each axis.
    Groups(UVec3),
    /// Workgroups along each axis as three u32 at this offset of a buffer with `INDIRECT`.
    Indirect(&'a wgpu::Buffer, u64),
}

/// The layouts of a kernel's bind groups, and the groups made so far.
#[derive(Debug)]
struct Groups {
    name: &'static str,
    /// `scan/add#main`: what runs when these groups are bound.
    #[cfg(feature = "testing")]
    entries: Vec<String>,
    /// Bindings of groups 1 to 3.
    bindings: Vec<Binding>,
    layouts: [Option<wgpu::BindGroupLayout>; 4],
    known: Mutex<Vec<KnownGroup>>,
}

/// A bind group, with the resources that it binds.
#[derive(Debug)]
struct KnownGroup {
    ix: u32,
    resources: Vec<OwnedResource>,
    group: wgpu::BindGroup,
}

/// The group of the fields: their uniforms are buffers, and have no dynamic offsets.
const FIELDS: u32 = 3;

/// How many groups a kernel keeps: for levels, for targets of several views, and for the chunks of uniforms in flight.
const KEPT: usize = 64;

/// A resource that outlives a call. (A handle: clones share the resource, and equality is wgpu's.)
#[derive(Clone, Debug, PartialEq)]
pub enum OwnedResource {
    /// A whole buffer.
    Buffer(wgpu::Buffer),
    /// A texture.
    Texture(wgpu::TextureView),
    /// A sampler.
    Sampler(wgpu::Sampler),
    /// An acceleration structure.
    Tlas(wgpu::Tlas),
}

impl<'a> From<&'a OwnedResource> for Resource<'a> {
    fn from(resource: &'a OwnedResource) -> Self {
        match resource {
            OwnedResource::Buffer(buffer) => Self::Buffer(buffer),
            OwnedResource::Texture(view) => Self::Texture(view),
            OwnedResource::Sampler(sampler) => Self::Sampler(sampler),
            OwnedResource::Tlas(tlas) => Self::Tlas(tlas),
        }
    }
}

impl Groups {
    fn new(
        gpu: &Gpu,
        name: &'static str,
        _entries: &[(&str, &str)],
        interface: &Interface,
        scene: Option<&wgpu::BindGroupLayout>,
    ) -> Self {
        let bindings: Vec<Binding> =
            interface.bindings.iter().filter(|binding| binding.group > 0).cloned().collect();
        let stages = stages_of(interface);
        let mut layouts = [const { None }; 4];
        if interface.group(0).next().is_some() {
            let scene =
                scene.unwrap_or_else(|| panic!("{name} uses the scene, but no scene was given"));
            layouts[0] = Some(scene.clone());
        }
        for group in 1..4 {
            if interface.group(group).next().is_some() {
                layouts[group as usize] =
                    Some(layout_of(gpu, name, interface, group, stages, group != FIELDS));
            }
        }
        Self {
            name,
            #[cfg(feature = "testing")]
            entries: _entries.iter().map(|(kernel, entry)| format!("{kernel}#{entry}")).collect(),
            bindings,
            layouts,
            known: Mutex::default(),
        }
    }

    fn pipeline_layout(&self, gpu: &Gpu) -> wgpu::PipelineLayout {
        let n = self.layouts.iter().rposition(Option::is_some).map_or(0, |last| last + 1);
        let layouts: Vec<_> = self.layouts[..n].iter().map(Option::as_ref).collect();
        gpu.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some(self.name),
            bind_group_layouts: &layouts,
            immediate_size: 0,
        })
    }

    /// The bind groups for these resources, each with its index and dynamic offsets.
    ///
    /// # Panics
    /// If a variable is not bound, if its binding has another kind or size than the shader declares, or if the kernel
    /// has no variable of a name.
    fn bind(
        &self,
        gpu: &Gpu,
        uniforms: &mut Uniforms,
        bound: &[(&str, Resource)],
        offered: &[(&str, Resource)],
    ) -> Vec<(u32, wgpu::BindGroup, Vec<u32>)> {
        #[cfg(feature = "testing")]
        crate::modules::watch::trace(self.entries.iter().cloned());
        let Self { name: kernel, .. } = self;
        for (name, _) in bound {
            let known = self.bindings.iter().any(|binding| binding.name == *name);
            assert!(known, "{kernel} has no binding `{name}`");
        }
        let mut out = Vec::with_capacity(3);
        for group in 1..4u32 {
            let Some(layout) = &self.layouts[group as usize] else { continue };
            let mut offsets = Vec::new();
            let mut resources = Vec::new();
            let mut sizes = Vec::new();
            for binding in self.bindings.iter().filter(|binding| binding.group == group) {
                let find = |of: &[(&str, Resource<'_>)]| -> Option<usize> {
                    of.iter().rposition(|(name, _)| *name == binding.name)
                };
                let resource = match (find(bound), find(offered)) {
                    (Some(ix), _) => bound[ix].1,
                    (None, Some(ix)) => offered[ix].1,
                    _ => panic!(
                        "{kernel} declares `{}` (group {group}), but nothing is bound to it",
                        binding.name
                    ),
                };
                assert!(
                    group != FIELDS || !matches!(resource, Resource::Uniform(_)),
                    "{kernel}: `{}` belongs to a field (group 3): bind the field's buffer, not contents",
                    binding.name
                );
                let (owned, offset) = own(gpu, uniforms, kernel, binding, resource);
                if let BindingKind::Uniform { bytes } = binding.kind {
                    if group != FIELDS {
                        offsets.push(offset);
                    }
                    sizes.push(NonZeroU64::new(u64::from(bytes)));
                } else {
                    sizes.push(None);
                }
                resources.push(owned);
            }
            let mut known = self.known.lock().unwrap_or_else(PoisonError::into_inner);
            let found = known.iter().find(|of| of.ix == group && of.resources == resources);
            let made = match found {
                Some(found) => found.group.clone(),
                None => {
                    let made = self.make(gpu, layout, group, &resources, &sizes);
                    if known.len() == KEPT {
                        known.remove(0);
                    }
                    known.push(KnownGroup { ix: group, resources, group: made.clone() });
                    made
                }
            };
            out.push((group, made, offsets));
        }
        out
    }

    fn make(
        &self,
        gpu: &Gpu,
        layout: &wgpu::BindGroupLayout,
        group: u32,
        resources: &[OwnedResource],
        sizes: &[Option<NonZeroU64>],
    ) -> wgpu::BindGroup {
        let bindings = self.bindings.iter().filter(|binding| binding.group == group);
        let entries: Vec<_> = bindings
            .zip(resources)
            .zip(sizes)
            .map(|((binding, resource), &size)| wgpu::BindGroupEntry {
                binding: binding.binding,
                resource: match resource {
                    OwnedResource::Buffer(buffer) => {
                        wgpu::BindingResource::Buffer(wgpu::BufferBinding {
                            buffer,
                            offset: 0,
                            size,
                        })
                    }
                    OwnedResource::Texture(view) => wgpu::BindingResource::TextureView(view),
                    OwnedResource::Sampler(sampler) => wgpu::BindingResource::Sampler(sampler),
                    OwnedResource::Tlas(tlas) => wgpu::BindingResource::AccelerationStructure(tlas),
                },
            })
            .collect();
        gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some(self.name),
            layout,
            entries: &entries,
        })
    }
}

/// The resource to keep while the group lives, and its dynamic offset.
fn own(
    gpu: &Gpu,
    uniforms: &mut Uniforms,
    kernel: &str,
    binding: &Binding,
    resource: Resource,
) -> (OwnedResource, u32) {
    let fits = matches!(
        (&binding.kind, &resource),
        (BindingKind::Uniform { .. }, Resource::Uniform(_) | Resource::Buffer(_))
            | (BindingKind::Storage { .. }, Resource::Buffer(_))
            | (
                BindingKind::Texture { .. } | BindingKind::StorageTexture { .. },
                Resource::Texture(_)
            )
            | (BindingKind::Sampler { .. }, Resource::Sampler(_))
            | (BindingKind::AccelerationStructure, Resource::Tlas(_))
    );
    let name = &binding.name;
    assert!(
        fits,
        "{kernel}: `{name}` is a {}, but something else is bound",
        binding.kind.in_words()
    );
    match resource {
        Resource::Buffer(buffer) => (OwnedResource::Buffer(buffer.clone()), 0),
        Resource::Texture(view) => (OwnedResource::Texture(view.clone()), 0),
        Resource::Sampler(sampler) => (OwnedResource::Sampler(sampler.clone()), 0),
        Resource::Tlas(tlas) => (OwnedResource::Tlas(tlas.clone()), 0),
        Resource::Uniform(contents) => {
            let BindingKind::Uniform { bytes } = binding.kind else {
                unreachable!("checked above")
            };
            let n = contents.len();
            assert_eq!(
                n, bytes as usize,
                "{kernel}: `{name}` has {bytes} bytes, but {n} are bound"
            );
            let (chunk, offset) = uniforms.place(&gpu.device, &gpu.queue, contents);
            (OwnedResource::Buffer(chunk), offset)
        }
    }
}

/// A compute kernel's entry point as a pipeline.
#[derive(Debug)]
pub struct ComputeKernel {
    pipeline: wgpu::ComputePipeline,
    groups: Groups,
    workgroup: UVec3,
}

impl ComputeKernel {
    /// Compiles a kernel that has one entry point. `scene`: layout of bind group 0, for kernels that use the scene.
    ///
    /// # Panics
    /// If there is no kernel of this name, it has several entry points, or it uses the scene and none is given.
    pub fn new(
        gpu: &Gpu,
        shaders: &Shaders,
        scene: Option<&SceneGroup>,
        name: &'static str,
    ) -> Self {
        Self::with_entry(gpu, shaders, scene, name, None, &[])
    }

    /// As [`Self::new`], for one of several entry points, with values of the shader's `override` constants.
    ///
    /// # Panics
    /// As [`Self::new`], or if there is no such entry point.
    pub fn with_entry(
        gpu: &Gpu,
        shaders: &Shaders,
        scene: Option<&SceneGroup>,
        name: &'static str,
        entry: Option<&str>,
        constants: &[(&str, f64)],
    ) -> Self {
        let (module, interface) = shaders.module(gpu, name);
        let of_compute = |of: &&crate::shader::EntryPoint| of.stage == Stage::Compute;
        let entries: Vec<_> = interface.entry_points.iter().filter(of_compute).collect();
        let found = match entry {
            Some(entry) => entries.iter().find(|of| of.name == entry),
            None if entries.len() == 1 => entries.first(),
            None => None,
        };
        let found = found.unwrap_or_else(|| panic!("{name} has no single entry point {entry:?}"));
        // An entry point gets the bindings of its whole module, whether it uses them or not.
        let entries = [(name, &*found.name)];
        let groups = Groups::new(gpu, name, &entries, &interface, scene.map(|scene| &scene.layout));
        let pipeline = gpu.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some(name),
            layout: Some(&groups.pipeline_layout(gpu)),
            module: &module,
            entry_point: Some(&found.name),
            compilation_options: wgpu::PipelineCompilationOptions {
                constants,
                ..Default::default()
            },
            cache: None,
        });
        Self { pipeline, groups, workgroup: UVec3::from_array(found.workgroup_size) }
    }

    /// Its name: `scan/add`.
    pub fn name(&self) -> &'static str {
        self.groups.name
    }

    /// Starts a call within a pass.
    pub fn call<'c, 'r>(&'c self, pass: &'c mut ComputeRecorder<'r>) -> ComputeCall<'c, 'r> {
        ComputeCall { kernel: self, pass, scene: None, bound: Vec::new(), offered: Vec::new() }
    }
}

/// A call of a kernel, which [`Self::dispatch`] records.
#[must_use = "nothing is recorded before `dispatch`"]
pub struct ComputeCall<'c, 'r> {
    kernel: &'c ComputeKernel,
    pass: &'c mut ComputeRecorder<'r>,
    scene: Option<&'c SceneGroup>,
    bound: Vec<(&'c str, Resource<'c>)>,
    offered: Vec<(&'c str, Resource<'c>)>,
}

impl<'c> ComputeCall<'c, '_> {
    /// Binds the scene, for kernels that use it. None changes nothing.
    pub fn scene(mut self, scene: impl Into<Option<&'c SceneGroup>>) -> Self {
        self.scene = scene.into().or(self.scene);
        self
    }

    /// Binds a resource to the variable of this name.
    pub fn bind(mut self, name: &'c str, resource: impl Into<Resource<'c>>) -> Self {
        self.bound.push((name, resource.into()));
        self
    }

    /// Sets the contents of the `var<uniform>` of this name, for this call.
    pub fn uniform<T: NoUninit>(self, name: &'c str, contents: &'c T) -> Self {
        let bytes = bytemuck::bytes_of(contents);
        self.bind(name, Resource::Uniform(bytes))
    }

    /// Offers bindings, such as those of a field or of the pixels. The kernel uses those that it declares; what
    /// [`Self::bind`] names goes first.
    pub fn with(mut self, bindings: Bindings<'c>) -> Self {
        self.offered.extend(bindings);
        self
    }

    /// Records the call.
    ///
    /// # Panics
    /// If a variable of the kernel is not bound, or its binding does not match its declaration, or contents are bound to a
    /// field's uniform (group 3), which must be a buffer.
    pub fn dispatch(self, size: Dispatch) {
        let Self { kernel, pass, scene, bound, offered } = self;
        let groups = kernel.groups.bind(pass.gpu, pass.uniforms, &bound, &offered);
        let recorded = &mut pass.pass;
        recorded.set_pipeline(&kernel.pipeline);
        if kernel.groups.layouts[0].is_some() {
            let scene = scene.unwrap_or_else(|| panic!("{} needs a scene", kernel.name()));
            recorded.set_bind_group(0, &scene.group, &[]);
        }
        for (ix, group, offsets) in &groups {
            recorded.set_bind_group(*ix, group, offsets);
        }
        let groups_of = |size: UVec3| {
            let groups = (size + kernel.workgroup - 1) / kernel.workgroup;
            [groups.x, groups.y, groups.z]
        };
        let rows = |n: u32| [n.min(DISPATCH_ROW), n.div_ceil(DISPATCH_ROW), 1];
        let [x, y, z] = match size {
            Dispatch::Items(n) => rows(n.div_ceil(kernel.workgroup.element_product())),
            Dispatch::Rows(n) => rows(n),
            Dispatch::Area(size) => groups_of(size.extend(1)),
            Dispatch::Box(size) => groups_of(size),
            Dispatch::Groups(groups) => groups.to_array(),
            Dispatch::Indirect(buffer, offset) => {
                return recorded.dispatch_workgroups_indirect(buffer, offset);
            }
        };
        recorded.dispatch_workgroups(x, y, z);
    }
}

/// The state of a render pipeline besides its shaders.
#[derive(Clone, Debug, Default)]
pub struct RenderState<'a> {
    /// Formats of the colour targets.
    pub targets: &'a [wgpu::TextureFormat],
    /// Depth test and bias; None: no depth.
    pub depth: Option<wgpu::DepthStencilState>,
    /// The primitives that are drawn.
    pub primitive: wgpu::PrimitiveState,
}

/// A vertex and a fragment kernel as a pipeline. They may be in one file or in two.
#[derive(Debug)]
pub struct RenderKernel {
    pipeline: wgpu::RenderPipeline,
    groups: Groups,
}

impl RenderKernel {
    /// Compiles the kernels. `scene`: layout of bind group 0, for kernels that use the scene.
    ///
    /// # Panics
    /// If there is no such kernel or entry point, or the two kernels declare a binding differently.
    pub fn new(
        gpu: &Gpu,
        shaders: &Shaders,
        scene: Option<&SceneGroup>,
        vertex: &'static str,
        fragment: &'static str,
        state: RenderState,
    ) -> Self {
        let (vertex_module, mut interface) = shaders.module(gpu, vertex);
        let (fragment_module, of_fragment) = shaders.module(gpu, fragment);
        let entry_of = |interface: &Interface, stage: Stage| {
            let found = interface.entry_points.iter().find(|entry| entry.stage == stage);
            let found = found.unwrap_or_else(|| panic!("{vertex}, {fragment}: no {stage:?} stage"));
            found.name.clone()
        };
        let entries =
            [entry_of(&interface, Stage::Vertex), entry_of(&of_fragment, Stage::Fragment)];
        for binding in of_fragment.bindings.iter() {
            let same = |of: &Binding| (of.group, of.binding) == (binding.group, binding.binding);
            match interface.bindings.iter().find(|of| same(of)) {
                Some(known) => assert_eq!(known, binding, "{vertex} and {fragment} differ"),
                None => interface.bindings.to_mut().push(binding.clone()),
            }
        }
        let both = [(vertex, &*entries[0]), (fragment, &*entries[1])];
        let groups =
            Groups::new(gpu, fragment, &both, &interface, scene.map(|scene| &scene.layout));
        let targets: Vec<_> = state
            .targets
            .iter()
            .map(|&format| {
                let write_mask = wgpu::ColorWrites::ALL;
                Some(wgpu::ColorTargetState { format, blend: None, write_mask })
            })
            .collect();
        let pipeline = gpu.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some(fragment),
            layout: Some(&groups.pipeline_layout(gpu)),
            vertex: wgpu::VertexState {
                module: &vertex_module,
                entry_point: Some(&entries[0]),
                compilation_options: Default::default(),
                buffers: &[],
            },
            primitive: state.primitive,
            depth_stencil: state.depth,
            multisample: Default::default(),
            fragment: Some(wgpu::FragmentState {
                module: &fragment_module,
                entry_point: Some(&entries[1]),
                compilation_options: Default::default(),
                targets: &targets,
            }),
            multiview_mask: None,
            cache: None,
        });
        Self { pipeline, groups }
    }

    /// Records a draw of `n_vertices` within a pass. `bound`, `offered`: as in [`ComputeCall`].
    ///
    /// # Panics
    /// As [`ComputeCall::dispatch`].
    pub fn draw(
        &self,
        pass: &mut RenderRecorder,
        scene: Option<&SceneGroup>,
        bound: &[(&str, Resource)],
        n_vertices: u32,
    ) {
        let groups = self.groups.bind(pass.gpu, pass.uniforms, bound, &[]);
        let recorded = &mut pass.pass;
        recorded.set_pipeline(&self.pipeline);
        if self.groups.layouts[0].is_some() {
            let scene = scene.unwrap_or_else(|| panic!("{} needs a scene", self.groups.name));
            recorded.set_bind_group(0, &scene.group, &[]);
        }
        for (ix, group, offsets) in &groups {
            recorded.set_bind_group(*ix, group, offsets);
        }
        recorded.draw(0..n_vertices, 0..1);
    }
}

/// The stages that can access a kernel's bindings.
fn stages_of(interface: &Interface) -> wgpu::ShaderStages {
    let is_compute = interface.entry_points.iter().all(|entry| entry.stage == Stage::Compute);
    if is_compute { wgpu::ShaderStages::COMPUTE } else { wgpu::ShaderStages::VERTEX_FRAGMENT }
}

fn layout_of(
    gpu: &Gpu,
    label: &str,
    interface: &Interface,
    group: u32,
    stages: wgpu::ShaderStages,
    has_dynamic_offset: bool,
) -> wgpu::BindGroupLayout {
    let entries: Vec<_> = interface
        .group(group)
        .map(|binding| {
            let ty = binding_type(&binding.kind, has_dynamic_offset);
            let writes = matches!(
                ty,
                wgpu::BindingType::Buffer {
                    ty: wgpu::BufferBindingType::Storage { read_only: false },
                    ..
                } | wgpu::BindingType::StorageTexture { .. }
            );
            wgpu::BindGroupLayoutEntry {
                binding: binding.binding,
                // Vertex stages cannot write in baseline WebGPU.
                visibility: if writes { stages - wgpu::ShaderStages::VERTEX } else { stages },
                ty,
                count: None,
            }
        })
        .collect();
    gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some(label),
        entries: &entries,
    })
}

fn binding_type(kind: &BindingKind, has_dynamic_offset: bool) -> wgpu::BindingType {
    use wgpu::{BindingType, BufferBindingType, SamplerBindingType, TextureSampleType};
    let size = |bytes: u32| NonZeroU64::new(u64::from(bytes));
    match *kind {
        BindingKind::Uniform { bytes } => BindingType::Buffer {
            ty: BufferBindingType::Uniform,
            has_dynamic_offset,
            min_binding_size: size(bytes),
        },
        BindingKind::Storage { read_only, bytes } => BindingType::Buffer {
            ty: BufferBindingType::Storage { read_only },
            has_dynamic_offset: false,
            min_binding_size: size(bytes),
        },
        BindingKind::Texture { dimension, texels } => BindingType::Texture {
            sample_type: match texels {
                Texels::Float { filtered } => TextureSampleType::Float { filterable: filtered },
                Texels::Sint => TextureSampleType::Sint,
                Texels::Uint => TextureSampleType::Uint,
                Texels::Depth => TextureSampleType::Depth,
            },
            view_dimension: view_dimension(dimension),
            multisampled: false,
        },
        BindingKind::StorageTexture { dimension, format, access } => BindingType::StorageTexture {
            access: match access {
                Access::Read => wgpu::StorageTextureAccess::ReadOnly,
                Access::Write => wgpu::StorageTextureAccess::WriteOnly,
                Access::ReadWrite => wgpu::StorageTextureAccess::ReadWrite,
            },
            format: storage_format(format),
            view_dimension: view_dimension(dimension),
        },
        BindingKind::Sampler { compares: true } => {
            BindingType::Sampler(SamplerBindingType::Comparison)
        }
        BindingKind::Sampler { compares: false } => {
            BindingType::Sampler(SamplerBindingType::Filtering)
        }
        BindingKind::AccelerationStructure => {
            BindingType::AccelerationStructure { vertex_return: false }
        }
    }
}

fn view_dimension(dimension: Dimension) -> wgpu::TextureViewDimension {
    match dimension {
        Dimension::D1 => wgpu::TextureViewDimension::D1,
        Dimension::D2 => wgpu::TextureViewDimension::D2,
        Dimension::D2Array => wgpu::TextureViewDimension::D2Array,
        Dimension::Cube => wgpu::TextureViewDimension::Cube,
        Dimension::CubeArray => wgpu::TextureViewDimension::CubeArray,
        Dimension::D3 => wgpu::TextureViewDimension::D3,
    }
}

fn storage_format(name: &str) -> wgpu::TextureFormat {
    use wgpu::TextureFormat as F;
    match name {
        "rgba8unorm" => F::Rgba8Unorm,
        "rgba8snorm" => F::Rgba8Snorm,
        "rgba8uint" => F::Rgba8Uint,
        "rgba8sint" => F::Rgba8Sint,
        "rgba16uint" => F::Rgba16Uint,
        "rgba16sint" => F::Rgba16Sint,
        "rgba16float" => F::Rgba16Float,
        "r32uint" => F::R32Uint,
        "r32sint" => F::R32Sint,
        "r32float" => F::R32Float,
        "rg32uint" => F::Rg32Uint,
        "rg32sint" => F::Rg32Sint,
        "rg32float" => F::Rg32Float,
        "rgba32uint" => F::Rgba32Uint,
        "rgba32sint" => F::Rgba32Sint,
        "rgba32float" => F::Rgba32Float,
        other => panic!("no storage format `{other}` in baseline WebGPU"),
    }
}
