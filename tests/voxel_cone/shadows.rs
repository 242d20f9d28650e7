// SPDX-License-Identifier: MIT OR Apache-2.0
//! Direct light with other shadows than rays: of voxels by maps, of pixels by cones.

use crate::harness::{Largest, gpu};
use crate::session::{SIDE, Session, camera, upload};
use crate::support::{lambert, quad, room, scene};
use crate::{cells, prefiltered, session};
use glam::{UVec2, Vec3};
use lucerna::components::shadow_maps::{ShadowFiltering, ShadowMaps, ShadowSettings};
use lucerna::components::voxel_pyramid::PyramidStorage;
use lucerna::frame::{DirectPass, DirectSettings};
use lucerna::gpu_scene::GpuScene;
use lucerna::scene::{Camera, Light, Material, Scene};
use lucerna::settings;
use lucerna::techniques::Technique;
use lucerna::techniques::reference::Channel;
use lucerna::techniques::voxel_cone::{VoxelCone, VoxelConeSettings};

/// Gives a session shadows by cones.
pub fn use_cones(world: &GpuScene, session: &mut Session<VoxelCone>) {
    let visibility = session.technique.visibility().unwrap();
    let settings = settings!(DirectSettings { n_samples: 16, n_bsdf_samples: 0 });
    let size = UVec2::splat(SIDE);
    session.passes.direct = DirectPass::new(gpu(), world, size, settings, &visibility);
}

fn eye() -> Camera {
    camera([1.0, 0.7, 2.8], [1.0, 0.3, 0.3])
}

/// A room with a table board, lit by this light or lamp.
fn room_with_table(light: Option<Light>) -> Scene {
    let mut meshes = room([2.0, 1.0, 3.0], 0);
    meshes.push(quad([[0.6, 0.4, 0.9], [0.6, 0.4, 1.5], [1.4, 0.4, 1.5], [1.4, 0.4, 0.9]], 1));
    let board = Material { double_sided: true, ..lambert([0.6; 3]) };
    let lamp = Material { emission: Vec3::splat(8.0), ..lambert([0.0; 3]) };
    if light.is_none() {
        meshes.push(quad(
            [[0.8, 0.98, 1.0], [1.2, 0.98, 1.0], [1.2, 0.98, 1.4], [0.8, 0.98, 1.4]],
            2,
        ));
    }
    let mut world = scene(meshes, vec![lambert([0.6; 3]), board, lamp]);
    world.lights.extend(light);
    world
}

/// The voxels' light by shadow maps gives the picture that rays give, within 3 %, of a point light (six maps) and of a spot (one).
#[test]
fn voxels_lit_by_shadow_maps_are_lit_as_by_rays() {
    let place = Vec3::new(1.1, 0.9, 1.3);
    for light in [
        Light::Point { position: place, intensity: Vec3::ONE, range: None },
        Light::Spot {
            position: place,
            direction: -Vec3::Y,
            intensity: Vec3::splat(4.0),
            inner: 0.8,
            outer: 1.0,
            range: None,
        },
    ] {
        let world = upload(&room_with_table(Some(light.clone())));
        let filtering = ShadowFiltering::Pcf(1.0);
        let maps = ShadowMaps::new(
            gpu(),
            &world,
            settings!(ShadowSettings { resolution: 256, filtering }),
        )
        .unwrap();
        let settings = cells(32);
        let mean = |mut session: Session<VoxelCone>, maps: Option<ShadowMaps>| {
            session.passes.shadow_maps = maps;
            session.run(&world, 32);
            session.mean(&world, 8, Channel::Indirect).y
        };
        let rays = mean(session(&world, &eye(), settings), None);
        let technique =
            VoxelCone::with_visibility(gpu(), &world, settings, &maps.visibility(), eye().position)
                .unwrap();
        let mapped = mean(Session::of(&world, &eye(), technique), Some(maps));
        eprintln!("{light:?}: by rays {rays}, by maps {mapped}");
        assert!(
            rays > 0.0 && (mapped / rays - 1.0).abs() < 0.03,
            "{light:?}: mean indirect light with shadow maps is {mapped}, expected that with rays, {rays}, above 0 and within 3 %"
        );
    }
}

/// Direct light of a lamp under a table, by cones through 64 voxels: within 15 % of rays on average; and in the middle of the
/// table's shadow less than a third of what is lit beside it.
#[test]
fn cones_cast_soft_shadows_of_a_lamp() {
    let world = upload(&room_with_table(None));
    let settings = prefiltered(64);
    let rays = session(&world, &eye(), settings).picture(&world, 32, Channel::Direct);
    let mut by_cones = session(&world, &eye(), settings);
    use_cones(&world, &mut by_cones);
    // (The first frame makes the voxels.)
    by_cones.run(&world, 2);
    let cones = by_cones.picture(&world, 16, Channel::Direct);
    let mean = |picture: &[Vec3]| picture.iter().map(|v| v.y).sum::<f32>() / picture.len() as f32;
    let ratio = mean(&cones) / mean(&rays);
    eprintln!("direct light by cones: {ratio} of that by rays");
    assert!(
        (ratio - 1.0).abs() < 0.15,
        "mean direct light of a lamp by cones is {ratio} of that by rays, expected 1 within 0.15"
    );
    // Where rays find deep shadow.
    let deep: Vec<usize> = (0..rays.len()).filter(|&ix| rays[ix].y < 0.02 * mean(&rays)).collect();
    let left = deep.iter().map(|&ix| cones[ix].y).sum::<f32>() / deep.len() as f32 / mean(&rays);
    eprintln!("in {} pixels of deep shadow {left} of the mean light is left", deep.len());
    assert!(
        deep.len() > 10 && left < 0.33,
        "in {} pixels of deep shadow, expected above 10, {left} of the mean light is left by cones, expected below 0.33",
        deep.len()
    );
}

/// From buffers, cones cast the shadows that they cast from textures: the numbers are the same but for filtering in 32 bits.
#[test]
fn cones_cast_the_same_shadows_from_buffers() {
    let world = upload(&room_with_table(None));
    let [textures, buffers] = [PyramidStorage::Textures, PyramidStorage::Buffers].map(|storage| {
        let settings = settings!(VoxelConeSettings { storage, ..prefiltered(24) });
        let mut session = session(&world, &eye(), settings);
        use_cones(&world, &mut session);
        session.run(&world, 1);
        session.picture(&world, 2, Channel::Direct)
    });
    let bright = textures.iter().map(|v| v.max_element()).fold(0.0, f32::max);
    assert!(bright > 0.0, "the brightest direct light with textures is {bright}, expected above 0");
    for (ix, (one, other)) in textures.iter().zip(&buffers).enumerate() {
        assert!(
            (one - other).largest() < 2e-3 * bright,
            "pixel {ix}: direct light by cones from buffers is {other}, from textures {one}; expected within 2e-3 of the brightest, {bright}"
        );
    }
}
