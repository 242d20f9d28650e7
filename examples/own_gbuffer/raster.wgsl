// SPDX-License-Identifier: MIT OR Apache-2.0
// The renderer's own pass, which does not use lucerna.

struct Camera {
    clip_from_world: mat4x4<f32>,
    view_from_world: mat4x4<f32>,
}

@group(0) @binding(0) var<uniform> camera: Camera;

struct Corner {
    @builtin(position) clip: vec4<f32>,
    @location(0) normal: vec3<f32>,
    @location(1) color: vec3<f32>,
    @location(2) distance: f32,
}

@vertex
fn vertex(
    @location(0) position: vec3<f32>,
    @location(1) normal: vec3<f32>,
    @location(2) color: vec3<f32>,
) -> Corner {
    let view = camera.view_from_world * vec4<f32>(position, 1.0);
    return Corner(camera.clip_from_world * vec4<f32>(position, 1.0), normal, color, -view.z);
}

struct Targets {
    @location(0) albedo: vec4<f32>,
    @location(1) normal: vec4<f32>,
    /// Along the view axis [m]; 0: nothing there.
    @location(2) distance: f32,
}

@fragment
fn fragment(corner: Corner) -> Targets {
    return Targets(
        vec4<f32>(corner.color, 1.0),
        vec4<f32>(0.5 * corner.normal + 0.5, 1.0),
        corner.distance,
    );
}
