//! An object that moves: one renderer, a picture for each place.
//!
//!     cargo run --example moving_object --no-default-features --features readers -- FOLDER

use std::error::Error;
use std::path::PathBuf;

use afterlight::frame::{Pixels, Renderer};
use afterlight::gpu::{Device, DeviceChoice, Instance, InstanceOptions};
use afterlight::scene::{OpenOptions, Settings, open};
use glam::{DAffine3, DVec3};

const FRAMES: u32 = 6;

fn main() -> Result<(), Box<dyn Error>> {
    let folder = PathBuf::from(std::env::args().nth(1).unwrap_or_else(|| ".".into()));
    let mut scene = open("builtin:spheres?columns=2&rows=1", &OpenOptions::default())?;
    let settings = Settings { size: [320, 180], ..scene.settings.decide() };

    let instance = Instance::new(&InstanceOptions::default())?;
    let device = Device::new(&instance, &DeviceChoice::Auto)?;
    // Meshes and textures go to the device once, and pipelines are made once.
    let mut renderer = Renderer::new(&device, &scene, &settings)?;

    let first = scene.objects[0].transform;
    for frame in 0..FRAMES {
        // A quarter of a circle, up and to the back.
        let angle = f64::from(frame) / f64::from(FRAMES - 1) * std::f64::consts::FRAC_PI_2;
        let way = DVec3::new(0.0, angle.sin(), angle.cos() - 1.0);
        renderer.move_object(&mut scene, 0, &(DAffine3::from_translation(way) * first))?;
        renderer.render(&scene.camera)?;

        let picture = renderer.read_back()?;
        if let Pixels::Srgb8(rgba) = &picture.pixels {
            let [width, height] = picture.size;
            let path = folder.join(format!("frame-{frame}.png"));
            image::save_buffer(path, rgba, width, height, image::ColorType::Rgba8)?;
        }
    }
    Ok(())
}
