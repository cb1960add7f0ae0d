//! The scene of the steps as the reference draws it, in 64 bits.

use afterlight_scene::{Brdf, Camera, Falloff, Light, LightKind, Material, Mesh, Object, Projection, Scene, Tonemap};
use afterlight_steps::scene::{EYE, FOV_Y_DEGREES, NEAR, SUN, SUN_LUX, TARGET, lights, shapes};
use afterlight_truth::measure::{Srgb8Image, flip};
use afterlight_truth::reference::tonemap::{encode_srgb, tone_map};
use afterlight_truth::reference::{CameraView, Mode, Reference, TruthOptions};
use glam::{DAffine3, DVec3, Vec3, dvec2};
use image::RgbaImage;

/// The clear colour of the steps from 3 on.
const BACKGROUND: Vec3 = Vec3::new(0.02, 0.03, 0.05);

/// The scene of the steps, with one reflection model for all surfaces.
pub fn scene(brdf: Brdf) -> Scene {
    let mut scene = Scene { camera: camera(), ..Scene::default() };
    scene.environment.background = BACKGROUND;
    for (number, shape) in shapes().into_iter().enumerate() {
        let name = format!("shape {number}");
        let (base_color, roughness, metallic) = (shape.color, shape.roughness, shape.metallic);
        scene.materials.push(Material { brdf, base_color, roughness, metallic, ..Material::default() });
        let positions = shape.positions.iter().map(|position| position.to_array()).collect();
        let normals = shape.normals.iter().map(|normal| normal.to_array()).collect();
        let mut mesh = Mesh { positions, normals, indices: shape.indices, ..Mesh::default() };
        mesh.bounds = mesh.compute_bounds();
        scene.meshes.push(mesh);
        scene.objects.push(Object::new(name, number, number, DAffine3::IDENTITY));
    }
    for light in lights() {
        let kind =
            LightKind::Point { position: light.position.as_dvec3(), range: None, falloff: Falloff::InverseSquare };
        scene.lights.push(Light { color: light.candela, ..Light::of(kind) });
    }
    scene
}

/// The sun of step 8. It alone casts shadows.
pub fn sun() -> Light {
    let kind = LightKind::Directional { direction: -SUN };
    Light { color: SUN_LUX, casts_shadow: true, ..Light::of(kind) }
}

/// The scene of the steps from 9 on in a frame: its lights have risen or fallen.
pub fn at_frame(number: usize) -> Scene {
    let mut scene = scene(Brdf::CookTorrance);
    let rise = f64::from((number as f32 / 8.0).sin() * 0.2);
    scene.lights.iter_mut().filter_map(|light| light.kind.place_mut()).for_each(|place| place.y += rise);
    scene.lights.push(sun());
    scene
}

fn camera() -> Camera {
    let projection = Projection::perspective(FOV_Y_DEGREES);
    Camera { projection, near: NEAR, ..Camera::looking_at(EYE, TARGET, DVec3::Y) }
}

/// Radiance through the middle of each pixel, rows from the top.
pub fn radiance(scene: &Scene, size: [u32; 2]) -> Vec<DVec3> {
    let reference = Reference::new(scene).expect("a sound scene");
    let view = CameraView { camera: scene.camera, size };
    let truth = reference.render(&view, &TruthOptions::of(Mode::Point), &|_, _| {});
    truth.radiance.into_iter().map(DVec3::from).collect()
}

/// The place of the surface that is seen through the middle of each pixel, rows from the top.
pub fn positions(size: [u32; 2]) -> Vec<Option<DVec3>> {
    let scene = scene(Brdf::Lambert);
    let reference = Reference::new(&scene).expect("a sound scene");
    let view = CameraView { camera: scene.camera, size };
    let pixels = (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| dvec2(f64::from(x) + 0.5, f64::from(y) + 0.5)));
    pixels.map(|pixel| reference.surface(&view, pixel).map(|(point, ..)| point.position + EYE)).collect()
}

/// Codes of the scene's light as the steps from 7 on show it: half a nit is 1, by Khronos PBR Neutral.
pub fn shown(scene: &Scene, size: [u32; 2]) -> Vec<[u8; 3]> {
    let tone_mapped = |light: DVec3| tone_map::<f64>(light * 2.0, Tonemap::Neutral);
    radiance(scene, size).into_iter().map(|light| codes(tone_mapped(light))).collect()
}

/// Codes of light that is linear, 0 to 1.
pub fn codes(light: DVec3) -> [u8; 3] {
    light.to_array().map(|channel| (encode_srgb(channel.clamp(0.0, 1.0)) * 255.0).round() as u8)
}

/// The mean error that eyes see (FLIP) of a picture against codes, 0 to 1.
pub fn flip_of(picture: &RgbaImage, expected: Vec<[u8; 3]>) -> f64 {
    let size = picture.dimensions().into();
    let actual = Srgb8Image::from_rgba(size, picture.as_raw());
    flip(&actual, &Srgb8Image { size, pixels: expected }).expect("pictures of one size").mean()
}
