//! The program of README.md: it draws one frame into memory and reads the picture back.

use afterlight::frame::Renderer;
use afterlight::gpu::{Device, DeviceChoice, Instance, InstanceOptions};
use afterlight::scene::{self, OpenOptions};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let scene = scene::open("builtin:spheres", &OpenOptions::default())?;
    let device = Device::new(&Instance::new(&InstanceOptions::default())?, &DeviceChoice::Auto)?;
    let mut renderer = Renderer::new(&device, &scene, &scene.settings.decide())?;
    renderer.render(&scene.camera)?;
    println!("{:?}", renderer.read_back()?.size);
    Ok(())
}
