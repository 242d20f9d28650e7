// SPDX-License-Identifier: MIT OR Apache-2.0
//! The scene, camera, light, size and adapter flags that several commands share.

use clap::Args;
use glam::{Affine3A, DVec3, Quat, UVec2, Vec3};
use lucerna::gpu::{AdapterChoice, Gpu};
use lucerna::gpu_scene::RaySource;
use lucerna::picture::Picture;
use lucerna::scene::{Camera, Light, LoadLimits, MAX_COORDINATE, Projection, Scene, Sky};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::str::FromStr;

/// A scene file, and changes to it.
#[derive(Args, Clone, Debug)]
pub struct SceneArguments {
    /// Scene file: .gltf, .glb or .obj.
    pub scene: PathBuf,
    /// Add a light: "kind=point|spot|directional position=x,y,z direction=x,y,z intensity=r,g,b
    /// inner=DEG outer=DEG range=M". Repeatable.
    #[arg(long, value_name = "SPEC")]
    light: Vec<LightSpec>,
    /// Ignore the file's point, spot and directional lights.
    #[arg(long)]
    no_scene_lights: bool,
    /// Radiance of the sky: r,g,b, or an equirectangular picture (.hdr, .exr, .png, .jpg).
    #[arg(long, value_name = "R,G,B|FILE")]
    sky: Option<SkySpec>,
    /// Replace every material with a Lambertian one whose albedo is the base colour.
    #[arg(long)]
    pub diffuse: bool,
}

/// Things that move: no part of a bake.
#[derive(Args, Clone, Debug)]
pub struct ObjectArguments {
    /// Place the meshes of another file in the scene, as something that moves: "FILE position=x,y,z scale=S turn=DEG" (turned about y).
    /// Bakes are made without it. Repeatable.
    #[arg(long, value_name = "FILE SPEC")]
    object: Vec<ObjectSpec>,
}

impl ObjectArguments {
    pub fn is_given(&self) -> bool {
        !self.object.is_empty()
    }

    /// Adds the objects to a scene, after its own instances.
    pub fn place_in(&self, scene: &mut Scene) -> Result<(), Box<dyn std::error::Error>> {
        for object in &self.object {
            let file = object.file.display();
            let loaded = Scene::load(&object.file, &LoadLimits::default())?;
            for warning in &loaded.warnings {
                errln!("warning: {file}: {warning}");
            }
            let place = (object.position + loaded.scene.origin - scene.origin).as_vec3();
            let turn = Quat::from_rotation_y(object.turn.to_radians());
            let scale = Vec3::splat(object.scale);
            scene
                .place(loaded.scene, Affine3A::from_scale_rotation_translation(scale, turn, place));
        }
        scene.validate().map_err(|error| format!("--object: {error}"))?;
        Ok(())
    }
}

/// `FILE position=x,y,z scale=S turn=DEG`.
#[derive(Clone, Debug)]
struct ObjectSpec {
    file: PathBuf,
    /// In the file's world [m].
    position: DVec3,
    scale: f32,
    turn: f32,
}

impl FromStr for ObjectSpec {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        const KNOWN: [&str; 3] = ["position", "scale", "turn"];
        // (Names of files may have spaces.)
        let starts = KNOWN.iter().filter_map(|key| text.find(&format!(" {key}=")));
        let (file, rest) = text.split_at(starts.min().unwrap_or(text.len()));
        let fields = Fields::parse(rest, &KNOWN)?;
        let scale = fields.number_or("scale", 1.0)?;
        if scale <= 0.0 {
            return Err("scale must be above 0".into());
        }
        let has_place = fields.0.contains_key("position");
        Ok(Self {
            file: file.trim().into(),
            position: if has_place { fields.point("position")? } else { DVec3::ZERO },
            scale,
            turn: fields.number_or("turn", 0.0)?,
        })
    }
}

/// Which picture of a scene.
#[derive(Args, Clone, Debug)]
pub struct ViewArguments {
    /// A camera of the file by its name, or "eye=x,y,z target=x,y,z fov=DEG" (vertical field of
    /// view).
    #[arg(long, value_name = "NAME|SPEC")]
    camera: Option<CameraChoice>,
    /// Picture size in pixels.
    #[arg(long, value_name = "WxH", default_value = "640x360")]
    size: SizeSpec,
}

impl ViewArguments {
    /// Chooses the size \[pixels\].
    pub fn set_size(&mut self, size: UVec2) {
        self.size = SizeSpec(size);
    }
}

/// Which adapter to use, and what traces rays.
#[derive(Args, Clone, Debug)]
pub struct AdapterArguments {
    /// auto (the best GPU, or software if there is none), software, or part of an adapter's name.
    #[arg(long, value_name = "WHICH", default_value = "auto")]
    adapter: AdapterChoice,
    /// What traces rays: the software BVH, the adapter's ray queries, or auto (ray queries on
    /// hardware GPUs that have them).
    #[arg(long, value_enum, default_value_t = RaysChoice::Auto)]
    rays: RaysChoice,
}

#[derive(clap::ValueEnum, Clone, Copy, Debug)]
enum RaysChoice {
    Auto,
    Software,
    RayQuery,
}

impl AdapterArguments {
    /// Opens the device and says which one.
    pub fn open(&self) -> Result<(Gpu, wgpu::AdapterInfo, RaySource), lucerna::gpu::GpuError> {
        let (gpu, info) = lucerna::blocking::open(&self.adapter)?;
        let real = info.device_type != wgpu::DeviceType::Cpu;
        let rays = match self.rays {
            RaysChoice::Software => RaySource::Software,
            RaysChoice::RayQuery => RaySource::RayQuery,
            RaysChoice::Auto if real && gpu.has_ray_query() => RaySource::RayQuery,
            RaysChoice::Auto => RaySource::Software,
        };
        let tracing = match rays {
            RaySource::Software => "software BVH",
            RaySource::RayQuery => "ray queries",
        };
        let software = if real { "" } else { ", software" };
        errln!("adapter: {} ({}{software}); rays: {tracing}", info.name, info.backend);
        Ok((gpu, info, rays))
    }
}

/// A scene ready to render.
pub struct Prepared {
    pub scene: Scene,
    pub camera: Camera,
    pub size: UVec2,
}

impl SceneArguments {
    /// Loads the file, applies the flags and finds the camera. Warnings go to stderr.
    pub fn prepare(&self, view: &ViewArguments) -> Result<Prepared, Box<dyn std::error::Error>> {
        let scene = self.load()?;
        let camera = find_camera(&self.scene, &scene, view.camera.as_ref(), view.size.0)?;
        Ok(Prepared { scene, camera, size: view.size.0 })
    }

    /// Loads the file and applies the flags. Warnings go to stderr.
    pub fn load(&self) -> Result<Scene, Box<dyn std::error::Error>> {
        let loaded = Scene::load(&self.scene, &LoadLimits::default())?;
        for warning in &loaded.warnings {
            errln!("warning: {warning}");
        }
        let mut scene = loaded.scene;
        if self.no_scene_lights {
            scene.lights.clear();
        }
        let added: Vec<Light> = self.light.iter().map(|spec| spec.in_scene(&scene)).collect();
        scene.lights.extend(added);
        if scene.origin != DVec3::ZERO {
            errln!(
                "note: the scene is far from its origin; computing relative to {}",
                scene.origin
            );
        }
        if let Some(sky) = &self.sky {
            scene.sky = read_sky(sky)?;
        }
        let emits = scene.materials.iter().any(|material| material.emission != Vec3::ZERO);
        let dark = matches!(scene.sky, Sky::Constant(Vec3::ZERO));
        if scene.lights.is_empty() && !emits && dark && self.sky.is_none() {
            errln!(
                "note: the scene has no light; using a white sky of radiance 1 (--sky, --light)"
            );
            scene.sky = Sky::Constant(Vec3::ONE);
        }
        Ok(scene)
    }
}

/// A scene file without changes, with one of its cameras or a described one.
pub fn load_with_camera(
    file: &Path,
    wanted: Option<&CameraChoice>,
) -> Result<(Scene, Camera), Box<dyn std::error::Error>> {
    let scene = Scene::load(file, &LoadLimits::default())?.scene;
    let camera = find_camera(file, &scene, wanted, UVec2::ONE)?;
    Ok((scene, camera))
}

fn find_camera(
    file: &Path,
    scene: &Scene,
    wanted: Option<&CameraChoice>,
    size: UVec2,
) -> Result<Camera, Box<dyn std::error::Error>> {
    let Some(wanted) = wanted else {
        if let Some(camera) = scene.cameras.first() {
            return Ok(camera.clone());
        }
        errln!("note: the scene has no camera; using one that sees the whole scene (--camera)");
        return Ok(camera_around(scene, size));
    };
    if let Some(camera) = scene.cameras.iter().find(|camera| camera.name == wanted.text) {
        return Ok(camera.clone());
    }
    if let Some(view) = &wanted.described {
        return Ok(view.in_scene(scene));
    }
    let names: Vec<_> = scene.cameras.iter().map(|camera| camera.name.as_str()).collect();
    let there = if names.is_empty() {
        "the file has none".to_owned()
    } else {
        format!("the file has {}", names.join(", "))
    };
    Err(format!(
        "no camera `{}` in {}: {there}; or give \"eye=x,y,z target=x,y,z fov=DEG\"",
        wanted.text,
        file.display()
    )
    .into())
}

/// A camera in front of the scene's box, a little above, that sees all of it.
fn camera_around(scene: &Scene, size: UVec2) -> Camera {
    let (min, max) = scene.bounds().unwrap_or((Vec3::NEG_ONE, Vec3::ONE));
    let center = 0.5 * (min + max);
    let radius = match 0.5 * (max - min).length() {
        radius if radius > 0.0 => radius,
        _ => 1.0,
    };
    let vertical_fov = 45f32.to_radians();
    let aspect = size.x as f32 / size.y as f32;
    let narrow = if aspect < 1.0 {
        2.0 * ((0.5 * vertical_fov).tan() * aspect).atan()
    } else {
        vertical_fov
    };
    let back = Vec3::new(0.4, 0.3, 1.0).normalize();
    let position = center + back * (radius / (0.5 * narrow).sin());
    look_at("around", position, center - position, vertical_fov)
}

/// `towards`: of any length except 0.
fn look_at(name: &str, eye: Vec3, towards: Vec3, vertical_fov: f32) -> Camera {
    let forward = towards.normalize();
    // When the camera looks straight up or down, +Y does not define the picture's top.
    let world_up = if forward.y.abs() > 0.9999 { Vec3::NEG_Z } else { Vec3::Y };
    let right = forward.cross(world_up).normalize();
    Camera {
        name: name.to_owned(),
        position: eye,
        forward,
        up: right.cross(forward),
        projection: Projection::Perspective { vertical_fov },
    }
}

/// A camera of the file by its name, or a described one.
#[derive(Clone, Debug)]
pub struct CameraChoice {
    text: String,
    described: Option<DescribedCamera>,
}

/// A camera in the file's world.
#[derive(Clone, Debug)]
struct DescribedCamera {
    /// [m]
    eye: DVec3,
    /// Unit length.
    forward: Vec3,
    /// [rad]
    vertical_fov: f32,
}

impl DescribedCamera {
    fn in_scene(&self, scene: &Scene) -> Camera {
        let eye = (self.eye - scene.origin).as_vec3();
        look_at("command line", eye, self.forward, self.vertical_fov)
    }
}

const CAMERA_KEYS: [&str; 3] = ["eye", "target", "fov"];

impl FromStr for CameraChoice {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        // A name may hold any character, but is unlikely to hold one of these keys.
        let is_key =
            |word: &str| word.split_once('=').is_some_and(|(k, _)| CAMERA_KEYS.contains(&k));
        let described =
            text.split_whitespace().any(is_key).then(|| parse_camera(text)).transpose()?;
        Ok(Self { text: text.to_owned(), described })
    }
}

/// Eye and target must be at least this far apart [m]; no scene is small enough to need less.
const MIN_DISTANCE: f64 = 1e-9;
/// Allowed fields of view [degrees]: 32-bit floats tell them from 0 and 180.
const FOVS: std::ops::RangeInclusive<f32> = 1e-3..=179.0;

fn parse_camera(text: &str) -> Result<DescribedCamera, String> {
    let fields = Fields::parse(text, &CAMERA_KEYS)?;
    let (eye, target) = (fields.point("eye")?, fields.point("target")?);
    if (target - eye).length() < MIN_DISTANCE {
        return Err(format!(
            "eye and target are the same point, or less than {MIN_DISTANCE:e} m apart"
        ));
    }
    let fov = fields.number_or("fov", 60.0)?;
    if !FOVS.contains(&fov) {
        let (min, max) = (FOVS.start(), FOVS.end());
        return Err(format!("fov={fov} is not between {min} and {max} degrees"));
    }
    let forward = (target - eye).normalize().as_vec3();
    Ok(DescribedCamera { eye, forward, vertical_fov: fov.to_radians() })
}

/// A sky as `--sky` describes it.
#[derive(Clone, Debug)]
enum SkySpec {
    Constant(Vec3),
    File(PathBuf),
}

impl FromStr for SkySpec {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match parse_vector(text) {
            Ok(radiance) if radiance.min_element() < 0.0 => {
                Err("radiance cannot be negative".into())
            }
            Ok(radiance) => Ok(Self::Constant(radiance)),
            Err(error) if text.split(',').all(|n| n.trim().parse::<f32>().is_ok()) => Err(error),
            Err(_) => Ok(Self::File(PathBuf::from(text))),
        }
    }
}

fn read_sky(spec: &SkySpec) -> Result<Sky, Box<dyn std::error::Error>> {
    let file = match spec {
        SkySpec::Constant(radiance) => return Ok(Sky::Constant(*radiance)),
        SkySpec::File(file) => file,
    };
    let name = file.display();
    let picture = Picture::read(file).map_err(|error| {
        format!("--sky {name} is neither r,g,b nor a readable picture: {error}")
    })?;
    picture.check_finite().map_err(|error| format!("--sky {name}: {error}"))?;
    let rgb = picture.rgb.iter().map(|texel| texel.max(Vec3::ZERO)).collect();
    Ok(Sky::Image { width: picture.width, height: picture.height, rgb })
}

/// `WxH`.
#[derive(Clone, Copy, Debug)]
pub struct SizeSpec(pub UVec2);

/// The longest side; a film of this size squared takes 20 GiB.
const MAX_SIDE: u32 = 16384;

impl FromStr for SizeSpec {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let numbers = text.split_once(['x', 'X', '×']);
        let parsed = numbers.and_then(|(w, h)| Some((w.parse().ok()?, h.parse().ok()?)));
        match parsed {
            Some((width @ 1..=MAX_SIDE, height @ 1..=MAX_SIDE)) => {
                Ok(Self(UVec2::new(width, height)))
            }
            Some(_) => Err(format!("sides must be 1 to {MAX_SIDE} pixels")),
            None => Err("expected WIDTHxHEIGHT, like 640x360".into()),
        }
    }
}

/// A light as `--light` describes it.
#[derive(Clone, Debug)]
pub struct LightSpec {
    /// Its own position is not used: see [`Self::position`].
    light: Light,
    /// In the file's world [m].
    position: DVec3,
}

impl LightSpec {
    fn in_scene(&self, scene: &Scene) -> Light {
        let place = (self.position - scene.origin).as_vec3();
        let mut light = self.light.clone();
        if let Light::Point { position, .. } | Light::Spot { position, .. } = &mut light {
            *position = place;
        }
        light
    }
}

/// A light as `--light` takes it. `origin`: of its scene in the file's world [m].
pub fn spec_of(light: &Light, origin: DVec3) -> String {
    let three = |of: Vec3| format!("{},{},{}", of.x, of.y, of.z);
    let place = |of: &Vec3| match origin {
        // (f32's own digits.)
        DVec3::ZERO => three(*of),
        _ => {
            let at = of.as_dvec3() + origin;
            format!("{},{},{}", at.x, at.y, at.z)
        }
    };
    let within = |range: &Option<f32>| range.map_or(String::new(), |m| format!(" range={m}"));
    match light {
        Light::Point { position, intensity, range } => {
            format!(
                "kind=point position={} intensity={}{}",
                place(position),
                three(*intensity),
                within(range)
            )
        }
        Light::Spot { position, direction, intensity, inner, outer, range } => format!(
            "kind=spot position={} direction={} intensity={} inner={} outer={}{}",
            place(position),
            three(*direction),
            three(*intensity),
            inner.to_degrees(),
            outer.to_degrees(),
            within(range)
        ),
        Light::Directional { direction, irradiance } => {
            format!(
                "kind=directional direction={} intensity={}",
                three(*direction),
                three(*irradiance)
            )
        }
    }
}

impl FromStr for LightSpec {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let known = ["kind", "position", "direction", "intensity", "inner", "outer", "range"];
        let fields = Fields::parse(text, &known)?;
        let intensity = fields.vector_or("intensity", Vec3::ONE)?;
        if intensity.min_element() < 0.0 {
            return Err("intensity cannot be negative".into());
        }
        let direction = || {
            let direction = fields.vector_or("direction", Vec3::NEG_Y)?;
            direction.try_normalize().ok_or_else(|| String::from("direction cannot be zero"))
        };
        let range = match fields.number("range")? {
            Some(range) if range <= 0.0 => return Err("range must be above 0".into()),
            range => range,
        };
        let kind = fields.0.get("kind").map_or("point", String::as_str);
        let has_place = matches!(kind, "point" | "spot");
        let position = if has_place { fields.point("position")? } else { DVec3::ZERO };
        let light = match kind {
            "point" => Light::Point { position: Vec3::ZERO, intensity, range },
            "spot" => {
                let inner = fields.number_or("inner", 0.0)?;
                let outer = fields.number_or("outer", 45.0)?;
                if !(0.0 <= inner && inner < outer && outer <= 90.0) {
                    return Err(format!(
                        "needs 0 <= inner < outer <= 90 degrees, not {inner} and {outer}"
                    ));
                }
                Light::Spot {
                    position: Vec3::ZERO,
                    direction: direction()?,
                    intensity,
                    inner: inner.to_radians(),
                    outer: outer.to_radians(),
                    range,
                }
            }
            "directional" => Light::Directional { direction: direction()?, irradiance: intensity },
            other => return Err(format!("kind={other} is not one of point, spot, directional")),
        };
        Ok(Self { light, position })
    }
}

/// `key=value` pairs separated by spaces.
struct Fields(BTreeMap<String, String>);

impl Fields {
    fn parse(text: &str, known: &[&str]) -> Result<Self, String> {
        let mut fields = BTreeMap::new();
        for word in text.split_whitespace() {
            let (key, value) = word
                .split_once('=')
                .ok_or_else(|| format!("`{word}` is not key=value; keys: {}", known.join(", ")))?;
            if !known.contains(&key) {
                return Err(format!("unknown key `{key}`; keys: {}", known.join(", ")));
            }
            if fields.insert(key.to_owned(), value.to_owned()).is_some() {
                return Err(format!("`{key}` is given twice"));
            }
        }
        Ok(Self(fields))
    }

    fn vector(&self, key: &str) -> Result<Vec3, String> {
        let value = self.0.get(key).ok_or_else(|| format!("`{key}=x,y,z` is missing"))?;
        parse_vector(value).map_err(|error| format!("{key}={value}: {error}"))
    }

    /// A point of the file's world [m].
    fn point(&self, key: &str) -> Result<DVec3, String> {
        let value = self.0.get(key).ok_or_else(|| format!("`{key}=x,y,z` is missing"))?;
        let point = parse_numbers(value).map_err(|error| format!("{key}={value}: {error}"))?;
        if point.abs().max_element() > f64::from(MAX_COORDINATE) {
            return Err(format!("{key}={value} is beyond {MAX_COORDINATE:e} m"));
        }
        Ok(point)
    }

    fn vector_or(&self, key: &str, default: Vec3) -> Result<Vec3, String> {
        if self.0.contains_key(key) { self.vector(key) } else { Ok(default) }
    }

    fn number(&self, key: &str) -> Result<Option<f32>, String> {
        let Some(value) = self.0.get(key) else { return Ok(None) };
        let number: f32 = value.parse().map_err(|_| format!("{key}={value} is not a number"))?;
        if number.is_finite() {
            Ok(Some(number))
        } else {
            Err(format!("{key}={value} is not finite"))
        }
    }

    fn number_or(&self, key: &str, default: f32) -> Result<f32, String> {
        Ok(self.number(key)?.unwrap_or(default))
    }
}

fn parse_vector(text: &str) -> Result<Vec3, String> {
    let vector = parse_numbers(text)?.as_vec3();
    if vector.is_finite() { Ok(vector) } else { Err("numbers must be finite".into()) }
}

fn parse_numbers(text: &str) -> Result<DVec3, String> {
    let numbers: Vec<f64> = text
        .split(',')
        .map(|number| number.trim().parse().map_err(|_| format!("`{number}` is not a number")))
        .collect::<Result<_, _>>()?;
    match numbers[..] {
        [x, y, z] if x.is_finite() && y.is_finite() && z.is_finite() => Ok(DVec3::new(x, y, z)),
        [_, _, _] => Err("numbers must be finite".into()),
        _ => Err(format!("expected three numbers x,y,z, found {}", numbers.len())),
    }
}
