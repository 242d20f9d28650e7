// SPDX-License-Identifier: MIT OR Apache-2.0
//! Shadow maps against rays and closed forms.

use crate::harness::{assert_each, gpu};
use crate::support::{floor, lambert, look_down, quad, scene};
use crate::whole::{Rendered, accumulated};
use glam::{UVec2, Vec3};
use lucerna::components::shadow_maps::{ShadowError, ShadowFiltering, ShadowMaps, ShadowSettings};
use lucerna::frame::{DirectPass, DirectSettings};
use lucerna::gpu_scene::{GpuScene, GpuSceneOptions};
use lucerna::scene::{AlphaMode, Camera, Light, Material, Scene};
use lucerna::settings;
use lucerna::techniques::NoIndirect;
use lucerna::techniques::reference::Channel;

fn upload(world: &Scene) -> GpuScene {
    let options = settings!(GpuSceneOptions { diffuse_only: true, ..Default::default() });
    GpuScene::new(gpu(), world, options).unwrap()
}

/// Direct light of each pixel, with shadow maps or (None) with rays.
fn direct(
    world: &Scene,
    camera: &Camera,
    size: UVec2,
    shadows: Option<ShadowSettings>,
) -> Vec<Vec3> {
    let on_gpu = upload(world);
    let mut rendered = Rendered::new(&on_gpu, size, 4);
    if let Some(shadows) = shadows {
        let maps = ShadowMaps::new(gpu(), &on_gpu, shadows).unwrap();
        let settings = DirectSettings::default();
        rendered.passes.direct =
            DirectPass::new(gpu(), &on_gpu, size, settings, &maps.visibility());
        rendered.passes.shadow_maps = Some(maps);
    }
    rendered.run(&on_gpu, camera, accumulated(1, 0), &mut NoIndirect);
    rendered.channel(Channel::Direct)
}

fn pcf() -> ShadowSettings {
    settings!(ShadowSettings { resolution: 512, filtering: ShadowFiltering::Pcf(1.0) })
}

fn spot(position: Vec3, direction: Vec3) -> Light {
    let intensity = Vec3::splat(20.0);
    Light::Spot { position, direction, intensity, inner: 0.6, outer: 0.8, range: None }
}

fn lights() -> [(&'static str, Light); 4] {
    let from = Vec3::new(1.0, 3.0, 0.5);
    [
        ("spot", spot(from, (-from).normalize())),
        // Wider than a map can be: it has six.
        (
            "wide spot",
            Light::Spot {
                position: from,
                direction: (-from).normalize(),
                intensity: Vec3::ONE,
                inner: 1.4,
                outer: 1.5,
                range: None,
            },
        ),
        ("point", Light::Point { position: from, intensity: Vec3::ONE, range: None }),
        (
            "directional",
            Light::Directional {
                direction: Vec3::new(-2.0, -1.5, -1.0).normalize(),
                irradiance: Vec3::ONE,
            },
        ),
    ]
}

/// A box over a floor, lit by each kind of light: no pixel but those within two of a shadow's edge differs from rays by
/// more than 1 %. (So lit surfaces do not shade themselves, slanted ones neither, and shadows begin where things stand.)
#[test]
fn maps_agree_with_rays_away_from_edges() {
    let mut meshes = vec![floor(4.0, 0.0, 0)];
    // A block, a slanted board, and a floating plate.
    meshes.push(quad([[-0.5, 0.8, -0.5], [-0.5, 0.8, 0.5], [0.5, 0.8, 0.5], [0.5, 0.8, -0.5]], 0));
    meshes.push(quad([[0.5, 0.0, -0.5], [0.5, 0.8, -0.5], [0.5, 0.8, 0.5], [0.5, 0.0, 0.5]], 0));
    meshes.push(quad([[-0.5, 0.0, 0.5], [0.5, 0.0, 0.5], [0.5, 0.8, 0.5], [-0.5, 0.8, 0.5]], 0));
    meshes.push(quad([[1.2, 0.0, -1.0], [1.2, 0.0, 0.0], [2.0, 1.0, 0.0], [2.0, 1.0, -1.0]], 0));
    meshes.push(quad([[-1.6, 1.2, 0.2], [-1.6, 1.2, 0.9], [-0.9, 1.2, 0.9], [-0.9, 1.2, 0.2]], 0));
    let world = scene(meshes, vec![lambert([0.8; 3])]);
    let size = UVec2::splat(96);
    for (name, light) in lights() {
        let mut world = world.clone();
        world.lights.push(light);
        let camera = look_down(3.0, 3.0);
        let rays = direct(&world, &camera, size, None);
        let maps = direct(&world, &camera, size, Some(pcf()));
        let at = |x: i32, y: i32| {
            let clamped = |v: i32| v.clamp(0, 95) as usize;
            rays[clamped(y) * 96 + clamped(x)].y
        };
        let (mut n_compared, mut n_shaded) = (0, 0);
        for y in 0..96 {
            for x in 0..96 {
                let here = at(x, y);
                let even = (-2..=2)
                    .all(|dy| (-2..=2).all(|dx| (at(x + dx, y + dy) > 0.0) == (here > 0.0)));
                // Nor where the board stands on the floor: bias lets a little light under it.
                if !even || (65..69).contains(&x) {
                    continue;
                }
                n_compared += 1;
                n_shaded += usize::from(here == 0.0);
                let found = maps[(y * 96 + x) as usize].y;
                let what = format!(
                    "{name}, pixel ({x}, {y}): direct light by maps is {found}, by rays {here}; expected within 1 %"
                );
                assert!((found - here).abs() <= 0.01 * here, "{what}");
            }
        }
        assert!(
            n_compared > 4000 && n_shaded > 100,
            "{name}: {n_compared} pixels are compared and {n_shaded} of them in shadow, expected above 4000 and 100"
        );
    }
}

/// A lone slanted floor does not shade itself, however wide the filter is: in every map the plane's own depth is known at
/// each point of the disc. Up to 72° from its normal, within 1 % of rays.
#[test]
fn wide_filters_leave_slanted_surfaces_lit() {
    let world = scene(vec![floor(4.0, 0.0, 0)], vec![lambert([0.8; 3])]);
    let size = UVec2::splat(48);
    let pcss = |light_radius| ShadowFiltering::Pcss { light_radius, angular_radius: 5.0 };
    for (name, light) in [
        ("point", Light::Point { position: Vec3::Y, intensity: Vec3::ONE, range: None }),
        ("spot", spot(Vec3::new(1.0, 1.0, 0.5), Vec3::new(-1.0, -0.5, 0.0).normalize())),
        (
            "directional",
            Light::Directional {
                direction: Vec3::new(-3.0, -1.0, 0.5).normalize(),
                irradiance: Vec3::ONE,
            },
        ),
    ] {
        let mut world = world.clone();
        world.lights.push(light);
        let camera = look_down(3.0, 2.2);
        let rays = direct(&world, &camera, size, None);
        for filtering in [ShadowFiltering::Pcf(16.0), pcss(0.1), pcss(0.5)] {
            let shadows = settings!(ShadowSettings { resolution: 512, filtering });
            let maps = direct(&world, &camera, size, Some(shadows));
            let n_lit = rays.iter().filter(|v| v.y > 0.0).count();
            assert!(n_lit > 200, "{name}: {n_lit} pixels are lit by rays, expected above 200");
            for (pixel, (found, expected)) in maps.iter().zip(&rays).enumerate() {
                let what = format!(
                    "{name}, {filtering:?}, pixel {pixel}: direct light by maps is {}, by rays {}; expected within 1 %",
                    found.y, expected.y
                );
                assert!((found.y - expected.y).abs() <= 0.01 * expected.y, "{what}");
            }
        }
    }
}

/// Share of a disc of radius 1 beyond a line at distance u from its middle.
fn disc_beyond(u: f64) -> f64 {
    let u = u.clamp(-1.0, 1.0);
    (u.acos() - u * (1.0 - u * u).sqrt()) / std::f64::consts::PI
}

/// Behind a half plane at z_b from a light of radius R, the penumbra on a floor at z_r is 2R·(z_r − z_b)/z_b wide by similar
/// triangles. Its width from 10 to 90 % of the light, which is a fixed share of that for a disc, agrees within 15 %.
#[test]
fn pcss_penumbra_is_as_wide_as_similar_triangles_say() {
    // The share of the disc beyond ±u is 10 and 90 %.
    let mut u = 0.0;
    while disc_beyond(u) > 0.1 {
        u += 1e-4;
    }
    let high = 4.0f32;
    for (radius, over_floor) in [(0.1f32, 1.0f32), (0.2, 1.0), (0.1, 2.0), (0.2, 2.0), (0.3, 0.5)] {
        let mut meshes = vec![floor(4.0, 0.0, 0)];
        let y = over_floor;
        meshes.push(quad([[-3.0, y, -3.0], [-3.0, y, 3.0], [0.0, y, 3.0], [0.0, y, -3.0]], 0));
        let mut world = scene(meshes, vec![lambert([0.8; 3])]);
        world.lights.push(spot(Vec3::new(0.0, high, 0.0), -Vec3::Y));
        let open = {
            let mut world = world.clone();
            world.instances.pop();
            world.meshes.pop();
            world
        };
        let size = UVec2::new(256, 8);
        // From below the plate, ±0.48 m around its edge.
        let camera = look_down(over_floor * 0.9, 0.015);
        let settings = settings!(ShadowSettings {
            resolution: 1024,
            filtering: ShadowFiltering::Pcss { light_radius: radius, angular_radius: 0.27 },
        });
        let shaded = direct(&world, &camera, size, Some(settings));
        let lit = direct(&open, &camera, size, None);
        // Rows average the pattern of the filter.
        let share: Vec<f64> = (0..256)
            .map(|x| {
                let sum = |picture: &[Vec3]| -> f64 {
                    (0..8).map(|y| f64::from(picture[y * 256 + x].y)).sum()
                };
                sum(&shaded) / sum(&lit)
            })
            .collect();
        let width_of_pixel = 2.0 * f64::from(half_width(&camera, size)) / 256.0;
        let crossing = |level: f64| {
            let ix = share.iter().position(|&v| v > level).unwrap();
            ix as f64 - (share[ix] - level) / (share[ix] - share[ix - 1]).max(1e-9)
        };
        let width = (crossing(0.9) - crossing(0.1)) * width_of_pixel;
        let blocker = f64::from(high - over_floor);
        let expected = 2.0 * f64::from(radius) * f64::from(over_floor) / blocker * u;
        eprintln!("R = {radius}, plate {over_floor} m high: {width:.4} m for {expected:.4}");
        assert!(
            (width / expected - 1.0).abs() < 0.15,
            "light of radius {radius}, plate {over_floor} m high: penumbra is {width:.4} m wide, expected {expected:.4} within 15 %"
        );
    }
}

/// Half of what an orthographic camera sees across [m].
fn half_width(camera: &Camera, size: UVec2) -> f32 {
    match camera.projection {
        lucerna::scene::Projection::Orthographic { half_height } => {
            half_height * size.x as f32 / size.y as f32
        }
        _ => panic!("orthographic"),
    }
}

/// Light passes where a mask cuts a material away.
#[test]
fn masked_parts_cast_no_shadow() {
    let mut world = scene(
        vec![floor(4.0, 0.0, 0), floor(1.0, 1.0, 1)],
        vec![
            lambert([0.8; 3]),
            Material {
                base_color: glam::Vec4::new(1.0, 1.0, 1.0, 0.2),
                alpha: AlphaMode::Mask { cutoff: 0.5 },
                ..Material::default()
            },
        ],
    );
    world.lights.push(spot(Vec3::new(0.0, 3.0, 0.0), -Vec3::Y));
    let picture = direct(&world, &look_down(0.5, 2.0), UVec2::splat(8), Some(pcf()));
    assert_each("direct light of pixels under a masked plate", &picture, "above 0", |pixel| {
        pixel.y > 0.0
    });
    world.materials[1].base_color.w = 1.0;
    let picture = direct(&world, &look_down(0.5, 0.9), UVec2::splat(8), Some(pcf()));
    assert_each("direct light of pixels under a solid plate", &picture, "black", |&pixel| {
        pixel == Vec3::ZERO
    });
}

#[test]
fn shadow_settings_out_of_range_are_refused() {
    let world = upload(&scene(vec![floor(1.0, 0.0, 0)], vec![lambert([0.8; 3])]));
    let pcss =
        |light_radius, angular_radius| ShadowFiltering::Pcss { light_radius, angular_radius };
    for settings in [
        settings!(ShadowSettings { resolution: 0, ..pcf() }),
        settings!(ShadowSettings { resolution: 1 << 20, ..pcf() }),
        settings!(ShadowSettings { filtering: ShadowFiltering::Pcf(0.0), ..pcf() }),
        settings!(ShadowSettings { filtering: ShadowFiltering::Pcf(f32::NAN), ..pcf() }),
        settings!(ShadowSettings { filtering: pcss(-1.0, 0.0), ..pcf() }),
        settings!(ShadowSettings { filtering: pcss(0.1, 90.0), ..pcf() }),
    ] {
        let error = ShadowMaps::new(gpu(), &world, settings).unwrap_err();
        assert!(
            matches!(error, ShadowError::Setting { .. }),
            "{settings:?}: the error is `{error}`, expected one of the settings"
        );
    }
    // A scene without lights, or without triangles, has maps all the same.
    let made = ShadowMaps::new(gpu(), &world, pcf());
    assert!(
        made.is_ok(),
        "shadow maps of a scene without lights fail, expected to be made: {:?}",
        made.err()
    );
}
