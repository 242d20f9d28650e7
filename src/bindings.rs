//! Host bindings generated from the WGSL by wgsl_bindgen: struct layouts, constants, workgroup
//! sizes, bind group layouts, composed shader text.
//!
//! Structs and constants of modules lie under [`baseline::lucerna`], kernels under
//! [`baseline::kernels`].

macro_rules! generated {
    ($(#[$doc:meta])* $name:ident, $file:literal) => {
        $(#[$doc])*
        #[allow(clippy::all, dead_code, missing_docs, unused_imports, rustdoc::all, non_snake_case)]
        pub mod $name {
            include!(concat!(env!("OUT_DIR"), "/", $file));
        }
    };
}

generated!(
    /// Kernels for plain WebGPU.
    baseline,
    "bindings.rs"
);
generated!(
    /// The kernels that trace rays, on hardware ray queries.
    ray_query,
    "bindings_ray_query.rs"
);
generated!(
    /// Kernels with shadow maps in the place of shadow rays.
    shadow_map,
    "bindings_shadow_map.rs"
);
generated!(
    /// Direct light with cones through voxels in the place of shadow rays.
    cone_shadow,
    "bindings_cone_shadow.rs"
);
generated!(
    /// The kernels of prefiltered voxels, with buffers in the place of textures.
    pyramid_buffer,
    "bindings_pyramid_buffer.rs"
);

pub use baseline::lucerna::host;
