//! Small scenes whose pixels can be worked out: a camera two metres before the plane z = 0, of which it sees the two metres
//! from y = -1 to y = 1.

use std::f64::consts::PI;

use afterlight::scene::builtin::shapes::{MeshBuilder, WHOLE_IMAGE};
use afterlight::scene::{
    self, Brdf, Camera, Falloff, GbufferChoice, Light, LightKind, Material, Object, Output, Projection, Scene,
    Settings, Tonemap, View,
};
use glam::{DAffine3, DQuat, DVec3, Vec3};

/// Edge of the pictures, odd so that one pixel's centre lies on the axis.
pub const EDGE: u32 = 33;

/// The camera's height above the plane z = 0.
pub const EYE: DVec3 = DVec3::new(0.0, 0.0, 2.0);

/// Opens a built-in scene, or a file that is named from the project's folder on.
pub fn open(spec: &str) -> Scene {
    let spec = match spec.strip_prefix("assets/") {
        Some(name) => &format!("{}/assets/{name}", env!("AFTERLIGHT_ROOT")),
        None => spec,
    };
    scene::open(spec, &Default::default()).unwrap_or_else(|error| panic!("{spec}: {error}"))
}

pub fn gbuffer(text: &str) -> GbufferChoice {
    text.parse().unwrap_or_else(|error| panic!("{error}"))
}

/// A linear picture in nits from a G-buffer of 32-bit floats: nothing but single precision stands between formula and pixel.
pub fn exact(width: u32, height: u32) -> Settings {
    Settings { size: [width, height], output: Output::Nits, gbuffer: gbuffer("float32"), ..Settings::default() }
}

/// A tone-mapped picture in which a radiance of 1 nit is 1.
pub fn display(width: u32, height: u32) -> Settings {
    Settings {
        size: [width, height],
        // exposure_scale: 1 / (1.2 * 2^EV100) = 1
        exposure: Some((1.0f32 / 1.2).log2()),
        tonemap: Tonemap::None,
        ..Settings::default()
    }
}

/// The settings that a scene itself asks for, with the default exposure of a meter.
pub fn own(scene: &Scene, width: u32, height: u32) -> Settings {
    Settings { size: [width, height], ..scene.settings.decide() }
}

pub fn view(scene: &Scene, width: u32, height: u32, view: View) -> Settings {
    Settings { view, ..own(scene, width, height) }
}

pub fn camera() -> Camera {
    Camera {
        position: EYE,
        rotation: DQuat::IDENTITY,
        projection: Projection::perspective(2.0 * 0.5f64.atan().to_degrees()),
        near: 0.125,
        ..Camera::default()
    }
}

/// An empty scene.
pub fn stage() -> Scene {
    Scene { name: "stage".into(), camera: camera(), ..Scene::default() }
}

pub fn lambert(albedo: f32) -> Material {
    Material { name: "lambert".into(), brdf: Brdf::Lambert, base_color: Vec3::splat(albedo), ..Material::default() }
}

/// Adds an object with its own mesh and material.
pub fn add(scene: &mut Scene, mesh: MeshBuilder, material: Material, transform: DAffine3) {
    let name = format!("object {}", scene.objects.len());
    scene.materials.push(material);
    scene.meshes.push(mesh.finish(&name));
    let (mesh, material) = (scene.meshes.len() - 1, scene.materials.len() - 1);
    scene.objects.push(Object::new(name, mesh, material, transform));
}

/// A rectangle that faces +Z, from its lower left to its upper right corner.
pub fn rectangle(low: [f64; 2], high: [f64; 2], z: f64) -> MeshBuilder {
    let corners = [[low[0], low[1]], [high[0], low[1]], [high[0], high[1]], [low[0], high[1]]];
    let mut mesh = MeshBuilder::new();
    mesh.quad(corners.map(|[x, y]| DVec3::new(x, y, z)), WHOLE_IMAGE);
    mesh
}

/// The plane z = 0, as far as the camera sees it, in one material.
pub fn plane(material: Material, lights: Vec<Light>) -> Scene {
    let mut scene = stage();
    add(&mut scene, rectangle([-4.0, -4.0], [4.0, 4.0], 0.0), material, DAffine3::IDENTITY);
    scene.lights = lights;
    scene
}

/// Returns the point where the ray through a pixel's centre meets the plane z = 0.
pub fn seen(size: [u32; 2], x: u32, y: u32) -> DVec3 {
    let [width, height] = size.map(f64::from);
    let across = (f64::from(x) + 0.5) * 2.0 / width - 1.0;
    let down = (f64::from(y) + 0.5) * 2.0 / height - 1.0;
    DVec3::new(across * width / height, -down, 0.0)
}

fn light(kind: LightKind, color: Vec3, intensity: f32) -> Light {
    Light { name: "light".into(), kind, color, intensity, casts_shadow: false, size: 0.0 }
}

/// A directional light that comes from `towards`.
pub fn directional(towards: DVec3, lux: f32) -> Light {
    light(LightKind::Directional { direction: -towards.normalize() }, Vec3::ONE, lux)
}

/// A directional light whose shadow is drawn.
pub fn sun(towards: DVec3, lux: f32) -> Light {
    Light { casts_shadow: true, ..directional(towards, lux) }
}

pub fn point(position: DVec3, candela: f32, range: Option<f64>, falloff: Falloff) -> Light {
    light(LightKind::Point { position, range, falloff }, Vec3::ONE, candela)
}

/// A spot light that looks along -Z, with its cone's angles in degrees.
pub fn spot(position: DVec3, candela: f32, inner: f64, outer: f64) -> Light {
    let kind = LightKind::Spot {
        position,
        direction: DVec3::NEG_Z,
        inner_angle_degrees: inner,
        outer_angle_degrees: outer,
        range: None,
        falloff: Falloff::InverseSquare,
    };
    light(kind, Vec3::ONE, candela)
}

/// A beam that goes along a direction from a disc of a radius in metres, of which a share is soft.
pub fn beam(position: DVec3, direction: DVec3, lux: f32, [radius, edge]: [f64; 2], range: Option<f64>) -> Light {
    light(LightKind::Beam { position, direction: direction.normalize(), radius, edge, range }, Vec3::ONE, lux)
}

/// IEC 61966-2-1: the code of 8 bits for a linear value.
pub fn srgb_code(linear: f64) -> u8 {
    srgb_code_unrounded(linear).round() as u8
}

/// Returns [`srgb_code`] before it is rounded.
pub fn srgb_code_unrounded(linear: f64) -> f64 {
    let linear = linear.clamp(0.0, 1.0);
    let encoded = if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 };
    encoded * 255.0
}

/// Illuminance on a surface that a directional light meets at an angle, over pi: the radiance of a white lambert surface.
pub fn white_radiance(lux: f64, angle_degrees: f64) -> f64 {
    lux * angle_degrees.to_radians().cos() / PI
}
