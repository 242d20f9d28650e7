// SPDX-License-Identifier: MIT OR Apache-2.0
//! Trees with one fault each: what the check must say, and what repairs it.

use lucerna::shader::Rule::{self, *};

/// A folder of `fixtures/broken_wgsl`.
pub struct Case {
    pub tree: &'static str,
    /// All problems, in their order.
    pub expected: &'static [Expected],
    /// File, text, and what takes its place.
    pub repairs: &'static [(&'static str, &'static str, &'static str)],
}

/// Rule, file, line, column, part of the message.
pub type Expected = (Rule, &'static str, u32, u32, &'static str);

const fn one(
    tree: &'static str,
    expected: &'static [Expected],
    repairs: &'static [(&'static str, &'static str, &'static str)],
) -> Case {
    Case { tree, expected, repairs }
}

const A: &str = "math/a.wgsl";
const K: &str = "kernels/k.wgsl";
const SCENE: &str = "scene/scene.wgsl";
const RAYS: &str = "scene/rays.wgsl";
const OVERLAY: &str = "variants/rays/ray_query/scene/rays.wgsl";

#[rustfmt::skip]
pub const CASES: &[Case] = &[
    // Text that does not parse, types that do not fit.
    one("syntax_error", &[(Compose, A, 6, 1, "expected `;`")], &[(A, "2.0 * x", "2.0 * x;")]),
    one("syntax_error_after_accents", &[(Compose, A, 3, 61, "expected expression")], &[(A, "* ;", "* x;")]),
    one("syntax_error_in_kernel", &[(Compose, K, 5, 13, "expected expression")], &[(K, "x = ;", "x = 1;")]),
    one("type_error", &[(Validation, A, 5, 12, "Multiply can't work")], &[(A, "2u", "2.0")]),
    one("type_error_uncalled", &[(Validation, A, 9, 13, "'uncalled' is invalid")], &[(A, "-> u32", "-> f32")]),
    one("type_error_in_kernel", &[(Compose, K, 5, 5, "cannot convert")], &[(K, "= id.x", "= f32(id.x)")]),
    one("type_error_inside_statement", &[(Validation, K, 9, 17, "Multiply can't work")], &[(K, "2u", "2.0")]),
    one("type_error_after_imported_names", &[(Compose, K, 9, 28, "identifier: `missing`")], &[(K, "missing", "1.0")]),
    one("unknown_identifier", &[(Compose, A, 5, 12, "identifier: `TWO`")], &[(A, "TWO", "2.0")]),
    one("unknown_item", &[(ImportMissing, K, 1, 9, "`lucerna::math::a` has no `thrice`")], &[(K, "thrice", "twice")]),

    // Imports.
    one("import_missing", &[(ImportMissing, K, 2, 9, "`lucerna::math::b`")],
        &[(K, "b::thrice", "a::twice as thrice")]),
    one("import_missing_unused", &[(ImportMissing, K, 1, 9, "`lucerna::math::b::thrice`")],
        &[(K, "#import lucerna::math::b::thrice", "")]),
    one("import_missing_in_braces", &[(ImportMissing, K, 3, 15, "`lucerna::math::b`")],
        &[(K, "math::b::{half, thrice as thrice}", "math::a::{twice as thrice}")]),
    one("import_missing_by_full_path", &[(ImportMissing, K, 5, 17, "`lucerna::math::b`")],
        &[(K, "lucerna::math::b::thrice", "abs")]),
    one("import_cycle_1", &[(ImportCycle, A, 3, 9, "math::a -> lucerna::math::a")],
        &[(A, "#import lucerna::math::a::other", "")]),
    one("import_cycle_2",
        &[(ImportCycle, A, 3, 9, "math::b -> lucerna::math::a -> lucerna::math::b"),
          (ImportCycle, "math/b.wgsl", 3, 9, "math::a -> lucerna::math::b -> lucerna::math::a")],
        &[("math/b.wgsl", "#import lucerna::math::a::one", ""), ("math/b.wgsl", "one(x)", "x")]),
    one("import_cycle_3",
        &[(ImportCycle, A, 3, 9, "::b -> lucerna::math::c -> lucerna::math::a -> lucerna::math::b"),
          (ImportCycle, "math/b.wgsl", 3, 9, "::c -> lucerna::math::a -> lucerna::math::b -> lucerna::math::c"),
          (ImportCycle, "math/c.wgsl", 3, 9, "::a -> lucerna::math::b -> lucerna::math::c -> lucerna::math::a")],
        &[("math/c.wgsl", "#import lucerna::math::a::one", ""), ("math/c.wgsl", "one(x)", "x")]),
    one("kernel_imported", &[(KernelImported, K, 1, 9, "the kernel `lucerna::kernels::other`")],
        &[(K, "#import lucerna::kernels::other::helper", ""), (K, "helper(1.0)", "1.0")]),
    one("kernel_imported_unused", &[(KernelImported, K, 1, 9, "the kernel `lucerna::kernels::other`")],
        &[(K, "#import lucerna::kernels::other", "")]),

    // The layers.
    one("binding_in_pure_module", &[(PureModule, A, 3, 1, "cannot declare a binding")],
        &[(A, "@group(0) @binding(0) var<uniform> scale: f32", "const scale = 2.0")]),
    one("workgroup_variable_in_pure_module", &[(PureModule, A, 3, 1, "only a kernel can declare workgroup variables")],
        &[(A, "var<workgroup> sums: array<f32, 64>", "const sums = vec2<f32>(1.0)")]),
    one("workgroup_variable_in_seam", &[(PureModule, SCENE, 3, 1, "only a kernel can declare workgroup variables")],
        &[(SCENE, "var<workgroup> sums: array<f32, 64>", "var<private> sums: array<f32, 64>")]),
    one("private_variable_in_pure_module", &[(PureModule, A, 3, 1, "cannot have state: `var<private>`")],
        &[(A, "var<private> seed: f32", "const seed = 1.0")]),
    one("entry_point_in_pure_module", &[(PureModule, A, 8, 1, "(@compute) belongs in a kernel")],
        &[(A, "@compute @workgroup_size(64)", "")]),
    one("entry_point_in_seam", &[(PureModule, SCENE, 8, 1, "(@compute) belongs in a kernel")],
        &[(SCENE, "@compute @workgroup_size(64)", "")]),
    one("kernel_without_entry_point", &[(Compose, K, 1, 1, "no entry point")],
        &[(K, "/// Half", "@compute @workgroup_size(1) fn main() {}\n/// Half")]),
    one("import_path_missing", &[(ImportPath, A, 1, 1, "`#define_import_path lucerna::math::a`")],
        &[(A, "\n\n", "\n#define_import_path lucerna::math::a\n")]),
    one("import_path_wrong", &[(ImportPath, A, 1, 1, "`lucerna::maths::a`, but its place in the folder makes it `lucerna::math::a`")],
        &[(A, "maths", "math")]),
    one("import_path_in_kernel", &[(ImportPath, K, 1, 1, "a kernel must not have an import path")],
        &[(K, "#define_import_path lucerna::kernels::k", "")]),
    one("seam_group_1", &[(BindGroup, SCENE, 3, 1, "owns only groups 0 and 2, not 1")],
        &[(SCENE, "@group(1)", "@group(0)")]),
    one("field_group_1", &[(BindGroup, "fields/light.wgsl", 3, 1, "fields own only group 3, not 1")],
        &[("fields/light.wgsl", "@group(1)", "@group(3)")]),
    one("kernel_group_0", &[(BindGroup, K, 1, 1, "group 0 belongs to the scene seam")],
        &[(K, "@group(0)", "@group(3)")]),
    one("kernel_group_4", &[(BindGroup, K, 1, 1, "only bind groups 0 to 3, not 4")],
        &[(K, "@group(4)", "@group(3)")]),

    one("integrator_binding", &[(PureModule, "integrators/path.wgsl", 3, 1, "an integrator cannot declare a binding")],
        &[("integrators/path.wgsl", "@group(1) @binding(0) var<uniform> scale: f32", "const scale = 2.0")]),
    one("pure_imports_seam", &[(Direction, A, 3, 9, "a pure module imports a module of the scene seam, `lucerna::scene::rays::is_covered`")],
        &[(A, "#import lucerna::scene::rays::is_covered", ""), (A, "is_covered(x)", "x.y < 1.0")]),
    one("seam_imports_integrator", &[(Direction, RAYS, 3, 9, "a module of the scene seam imports an integrator")],
        &[(RAYS, "#import lucerna::integrators::path::traced", ""), (RAYS, "traced(x)", "x")]),
    one("fields_meet",
        &[(BindGroup, "fields/maps.wgsl", 3, 1, "`bias` (binding 0) conflicts with `scale` (binding 0) of ")],
        &[("fields/maps.wgsl", "@binding(0)", "@binding(1)")]),
    one("fields_same_name",
        &[(BindGroup, "fields/maps.wgsl", 3, 1, "`scale` (binding 4) conflicts with `scale` (binding 0) of ")],
        &[("fields/maps.wgsl", "scale", "bias")]),
    one("kernel_meets_field",
        &[(BindGroup, K, 3, 1, "are both @group(3) @binding(0); group 3 is the fields'")],
        &[(K, "@group(3)", "@group(1)")]),

    // The budget: the repaired trees stand exactly at the limit.
    one("storage_buffers_9", &[(Budget, K, 6, 1, "9 storage buffers; baseline WebGPU has 8")],
        &[(K, "@group(1) @binding(3) var<storage, read> extra_c: array<f32>;", ""), (K, " + extra_c[0]", "")]),
    one("seam_storage_buffers_6", &[(Budget, K, 1, 9, "6 storage buffers in the scene seam; its share is 5")],
        &[(SCENE, "@group(0) @binding(5) var<storage, read> data_f: array<f32>;", ""), (SCENE, " + data_f[0]", "")]),
    one("storage_textures_5", &[(Budget, K, 8, 1, "5 storage textures; baseline WebGPU has 4")],
        &[(K, "@group(2) @binding(4) var image_e: texture_storage_2d<rgba8unorm, write>;", ""),
          (K, "textureStore(image_e, id.xy, value);", "")]),
    one("sampled_textures_17", &[(Budget, K, 20, 1, "17 sampled textures; baseline WebGPU has 16")],
        &[(K, "@group(2) @binding(16) var image_q: texture_2d<f32>;", "")]),
    one("samplers_17", &[(Budget, K, 20, 1, "17 samplers; baseline WebGPU has 16")],
        &[(K, "@group(2) @binding(16) var sampler_q: sampler;", "")]),
    one("uniform_buffers_13", &[(Budget, K, 16, 1, "13 uniform buffers; baseline WebGPU has 12")],
        &[(K, "@group(2) @binding(12) var<uniform> scale_m: f32;", "")]),
    one("workgroup_512", &[(Budget, K, 3, 10, "512 invocations per workgroup; baseline WebGPU has 256")],
        &[(K, "16, 8, 4", "16, 8, 2")]),
    one("workgroup_memory_17_kib", &[(Budget, K, 4, 1, "17408 bytes of workgroup memory; baseline WebGPU has 16384")],
        &[(K, "4352", "4096")]),

    // What baseline WebGPU cannot do; naga gives types no place.
    one("texture_atomics", &[(Validation, K, 6, 5, "capability Capabilities(TEXTURE_ATOMIC)")],
        &[(K, "textureAtomicAdd(counts, id.xy, 1u);", ""), (K, "r32uint, atomic", "r32uint, read")]),
    one("capability_f64", &[(Validation, A, 1, 1, "FLOAT64")], &[(A, "f64;", "f32;")]),
    one("capability_f16", &[(Validation, A, 6, 18, "Unable to cast")],
        &[(A, "enable f16;", ""), (A, "y: f16 = f16(x)", "y = x")]),
    one("capability_i64", &[(Validation, A, 1, 1, "SHADER_INT64")], &[(A, "u64;", "u32;")]),
    one("capability_subgroups", &[(Compose, K, 1, 1, "`subgroups`")],
        &[(K, "enable subgroups;", ""), (K, "subgroupAdd", "abs")]),
    one("capability_ray_query", &[(Validation, RAYS, 1, 1, "RAY_QUERY")],
        &[(RAYS, "enable wgpu_ray_query;", ""),
          (RAYS, "var rays_scene: acceleration_structure", "var<uniform> height: f32"),
          (RAYS, "var query: ray_query;", ""),
          (RAYS, "rayQueryInitialize(&query, rays_scene, RayDesc(4u, 0xffu, 1.0, 2.0, point, vec3<f32>(0.0, 1.0, 0.0)));", ""),
          (RAYS, "while rayQueryProceed(&query) {}", ""),
          (RAYS, "rayQueryGetCommittedIntersection(&query).kind != RAY_QUERY_INTERSECTION_NONE", "point.y < height")]),

    // Faults in a variant alone.
    one("overlay_unknown_identifier", &[(Compose, OVERLAY, 9, 73, "`dot`")], &[(OVERLAY, "2.0, dot", "2.0, point")]),
    one("overlay_other_interface",
        &[(ImportMissing, "kernels/rays/any_hit.wgsl", 1, 9, "`lucerna::scene::rays` has no `is_covered`")],
        &[(OVERLAY, "is_hidden", "is_covered")]),
    one("overlay_second_group", &[(BindGroup, OVERLAY, 4, 1, "owns only groups 0 and 2, not 3")],
        &[(OVERLAY, "@group(3)", "@group(0)")]),
    one("overlay_kernel_group_0",
        &[(BindGroup, "variants/rays/ray_query/kernels/rays/any_hit.wgsl", 1, 1, "group 0 belongs to the scene seam")],
        &[("variants/rays/ray_query/kernels/rays/any_hit.wgsl", "@group(0)", "@group(1)")]),

    // Several at once.
    one("three_faults",
        &[(Budget, K, 3, 10, "512 invocations per workgroup"),
          (Compose, A, 6, 1, "expected `;`"),
          (BindGroup, SCENE, 3, 1, "owns only groups 0 and 2")],
        &[(SCENE, "@group(1)", "@group(0)"), (K, "512", "256"), (A, "2.0 * x", "2.0 * x;")]),
    one("two_limits",
        &[(Budget, K, 17, 1, "13 uniform buffers"), (Budget, K, 17, 1, "17408 bytes of workgroup memory")],
        &[(K, "4352", "4096"), (K, "@group(2) @binding(12) var<uniform> scale_m: f32;", "")]),
];
