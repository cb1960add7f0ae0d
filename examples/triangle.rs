//! A triangle that code puts together, drawn without a window into a PNG file.
//!
//!     cargo run --package afterlight --example triangle -- triangle.png

use std::error::Error;

use afterlight::frame::{Pixels, Renderer};
use afterlight::gpu::{Device, DeviceChoice, Instance, InstanceOptions};
use afterlight::scene::{Camera, Light, LightKind, Material, Mesh, Object, Scene, Settings};
use glam::{DAffine3, DVec3, Vec3};

/// One triangle in the light of a sun. All lengths are metres.
fn scene() -> Scene {
    // Counter-clockwise is the front.
    let corners = [DVec3::new(-0.5, -0.5, 0.0), DVec3::new(0.5, -0.5, 0.0), DVec3::new(0.0, 0.5, 0.0)];
    let mut mesh = Mesh::from_points("triangle", &corners);
    mesh.indices = vec![0, 1, 2];
    mesh.compute_normals();
    let orange = Material { base_color: Vec3::new(0.9, 0.4, 0.1), ..Material::default() };
    let sun = Light {
        name: "sun".into(),
        kind: LightKind::Directional { direction: DVec3::new(0.3, -0.4, -1.0) },
        color: Vec3::ONE,
        intensity: 1000.0, // lux
        casts_shadow: false,
        size: 0.0,
    };
    Scene {
        meshes: vec![mesh],
        materials: vec![orange],
        // The numbers say which mesh and which material.
        objects: vec![Object::new("triangle", 0, 0, DAffine3::IDENTITY)],
        lights: vec![sun],
        camera: Camera::looking_at(DVec3::new(0.0, 0.0, 1.5), DVec3::ZERO, DVec3::Y),
        ..Scene::default()
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let path = std::env::args().nth(1).unwrap_or_else(|| "triangle.png".into());
    let scene = scene();
    let settings = Settings { size: [320, 180], ..Settings::default() };

    let instance = Instance::new(&InstanceOptions::default())?;
    let device = Device::new(&instance, &DeviceChoice::Auto)?;
    // Checks the scene first: an index that names nothing is an error here, and not a fault of the device later.
    let mut renderer = Renderer::new(&device, &scene, &settings)?;
    renderer.render(&scene.camera)?;

    let picture = renderer.read_back()?;
    if let Pixels::Srgb8(rgba) = &picture.pixels {
        let [width, height] = picture.size;
        image::save_buffer(&path, rgba, width, height, image::ColorType::Rgba8)?;
    }
    Ok(())
}
