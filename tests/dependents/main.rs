// SPDX-License-Identifier: MIT OR Apache-2.0
//! What builds of others do with the folder of WGSL, as it is.

use naga::valid::{Capabilities, ValidationFlags, Validator};
use naga_oil::compose::{
    ComposableModuleDescriptor, Composer, NagaModuleDescriptor, get_preprocessor_data,
};
use std::fs;
use std::path::Path;
use wgsl_bindgen::{
    GlamWgslTypeMap, WgslBindgenOptionBuilder, WgslShaderSourceType, WgslTypeSerializeStrategy,
};

/// What plain WebGPU has and naga asks for.
const CAPABILITIES: Capabilities = Capabilities::SHADER_FLOAT16_IN_FLOAT32;

/// A kernel of somebody else's, with imports of functions, a struct and a constant, directly and by way of others.
const KERNEL: &str = "
#import lucerna::color::srgb::linear_from_srgb
#import lucerna::components::voxels::grid::{VoxelGrid, grid_from_world}
#import lucerna::math::constants::PI
#import lucerna::sh::convolve::sh2_irradiance

struct Settings {
    grid: VoxelGrid,
    scale: f32,
}

@group(0) @binding(0) var<uniform> settings: Settings;
@group(0) @binding(1) var<storage, read_write> out: array<vec4<f32>>;

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let at = grid_from_world(settings.grid, vec3<f32>(id)) * settings.scale / PI;
    var sh: array<vec3<f32>, 9>;
    out[id.x] = vec4<f32>(linear_from_srgb(at) + sh2_irradiance(sh, vec3<f32>(0.0, 1.0, 0.0)), 1.0);
}
";

/// Adds a file's module after those that it imports, by nothing but the folder.
fn add(composer: &mut Composer, import_path: &str) {
    if composer.contains_module(import_path) {
        return;
    }
    let path = import_path.strip_prefix("lucerna::").expect("of lucerna").replace("::", "/");
    let file = Path::new(lucerna::WGSL_DIR).join(format!("{path}.wgsl"));
    let text = fs::read_to_string(&file).unwrap_or_else(|e| panic!("{}: {e}", file.display()));
    let (name, imports, _) = get_preprocessor_data(&text);
    assert_eq!(name.as_deref(), Some(import_path));
    for import in imports {
        add(composer, &import.import);
    }
    let added = composer.add_composable_module(ComposableModuleDescriptor {
        source: &text,
        file_path: &file.to_string_lossy(),
        ..Default::default()
    });
    if let Err(error) = added {
        panic!("{}", error.emit_to_string(composer));
    }
}

#[test]
fn naga_oil_composes_from_the_folder() {
    let mut composer = Composer::default().with_capabilities(CAPABILITIES);
    let (_, imports, _) = get_preprocessor_data(KERNEL);
    for import in imports {
        add(&mut composer, &import.import);
    }
    let descriptor = NagaModuleDescriptor { source: KERNEL, ..Default::default() };
    let made = composer.make_naga_module(descriptor);
    let module = made.unwrap_or_else(|error| panic!("{}", error.emit_to_string(&composer)));
    Validator::new(ValidationFlags::all(), CAPABILITIES).validate(&module).unwrap();
}

#[test]
fn wgsl_bindgen_scans_the_folder() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("dependents");
    fs::create_dir_all(&folder).unwrap();
    let entry = folder.join("own_kernel.wgsl");
    fs::write(&entry, KERNEL).unwrap();
    let mut options = WgslBindgenOptionBuilder::default();
    options
        .workspace_root(&folder)
        .add_entry_point(entry.to_str().expect("test folders are UTF-8"))
        .additional_scan_dir((Some("lucerna"), lucerna::WGSL_DIR))
        .serialization_strategy(WgslTypeSerializeStrategy::Bytemuck)
        .type_map(GlamWgslTypeMap)
        .shader_source_type(WgslShaderSourceType::EmbedWithNagaOilComposer)
        .ir_capabilities(CAPABILITIES)
        .emit_rerun_if_change(false)
        .skip_hash_check(true)
        .output(folder.join("own_kernel.rs"));
    options.build().unwrap().generate().unwrap();
    let bindings = fs::read_to_string(folder.join("own_kernel.rs")).unwrap();
    for part in ["pub struct Settings", "pub struct VoxelGrid", "pub mod own_kernel"] {
        assert!(bindings.contains(part), "no `{part}` in\n{bindings:.2000}");
    }
}
