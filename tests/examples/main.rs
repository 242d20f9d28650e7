// SPDX-License-Identifier: MIT OR Apache-2.0
//! The examples of renderers that bring a part of their own, by numbers: what they render is what lucerna renders of the
//! same scene.

#[path = "../../examples/own_gbuffer/main.rs"]
#[allow(dead_code)]
mod own_gbuffer;
#[path = "../../examples/own_rays.rs"]
#[allow(dead_code)]
mod own_rays;
#[path = "../../examples/own_scene/main.rs"]
#[allow(dead_code)]
mod own_scene;
#[path = "../../examples/own_technique/main.rs"]
#[allow(dead_code)]
mod own_technique;

mod same;
