// SPDX-License-Identifier: MIT OR Apache-2.0

/// Makes a settings struct from its defaults with some fields changed. (Settings structs may get more fields in later
/// versions, so a struct literal would not compile outside the crate.)
///
/// ```
/// use lucerna::settings;
/// use lucerna::techniques::voxel_rt::VoxelRtSettings;
///
/// let coarse = settings!(VoxelRtSettings { resolution: 64, anisotropic: false });
/// let seeded = settings!(VoxelRtSettings { seed: 7, ..coarse });
/// assert_eq!((seeded.resolution, seeded.seed), (64, 7));
/// ```
#[macro_export]
macro_rules! settings {
    (@set $made:ident) => {};
    (@set $made:ident $field:ident : $value:expr, $($rest:tt)*) => {
        $made.$field = $value;
        $crate::settings!(@set $made $($rest)*);
    };
    (@set $made:ident $field:ident : $value:expr) => {
        $made.$field = $value;
    };
    (@set $made:ident $field:ident, $($rest:tt)*) => {
        $made.$field = $field;
        $crate::settings!(@set $made $($rest)*);
    };
    (@set $made:ident $field:ident) => {
        $made.$field = $field;
    };
    (@set $made:ident .. $base:expr) => {};
    (@base) => { ::core::default::Default::default() };
    (@base .. $base:expr) => { $base };
    (@base $field:ident : $value:expr, $($rest:tt)*) => { $crate::settings!(@base $($rest)*) };
    (@base $field:ident : $value:expr) => { ::core::default::Default::default() };
    (@base $field:ident, $($rest:tt)*) => { $crate::settings!(@base $($rest)*) };
    (@base $field:ident) => { ::core::default::Default::default() };
    ($($type:ident)::+ { $($fields:tt)* }) => {{
        #[allow(unused_mut)]
        let mut made: $($type)::+ = $crate::settings!(@base $($fields)*);
        $crate::settings!(@set made $($fields)*);
        made
    }};
}
