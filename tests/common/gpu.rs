//! A device for a test, and pictures from it. Every message of the validation layer fails the test.

use std::sync::Arc;

use afterlight::frame::{Picture, Pixels, Renderer};
use afterlight::gpu::{
    Buffer, CommandBuffer, Device, DeviceChoice, Instance, InstanceOptions, Location, MemoryKind, MessageKind,
    Validation, vk,
};
use afterlight::scene::{Scene, Settings};
use glam::DVec3;

/// A device under synchronization validation.
pub struct Gpu {
    pub device: Arc<Device>,
}

/// Runs `test` on a device of its own, so that messages belong to it, however many tests run beside it. Fails on every message that
/// is about this program, those of tearing down included.
pub fn on_gpu(test: impl FnOnce(&Gpu)) {
    in_mode(false, test);
}

/// The same in both modes of the layer: neither notices all that the other does.
pub fn on_gpu_in_both_modes(test: impl Fn(&Gpu)) {
    in_mode(false, &test);
    in_mode(true, &test);
}

fn in_mode(sync_shader_heuristic: bool, test: impl FnOnce(&Gpu)) {
    let options = InstanceOptions { validation: Validation::Synchronization, sync_shader_heuristic };
    let instance = Instance::new(&options).unwrap_or_else(|error| panic!("{error}"));
    let log = instance.message_log();
    let device = Device::new(&instance, &DeviceChoice::Auto).unwrap_or_else(|error| panic!("{error}"));
    assert_watched(&instance, &device);
    let gpu = Gpu { device };
    test(&gpu);
    let leaks = gpu.device.live_objects();
    assert!(leaks.is_empty(), "objects outlived their owners: {leaks:#?}");
    drop((gpu, instance));
    // What the loader and the drivers say of the system is not about this program.
    let ours: Vec<_> = log.take().into_iter().filter(|message| message.kind != MessageKind::General).collect();
    assert!(ours.is_empty() && log.dropped() == 0, "messages (shader heuristic: {sync_shader_heuristic}): {ours:#?}");
}

/// Makes two mistakes on purpose, so that a silent layer means that there is nothing to say and not that it is off: a buffer that may
/// not be filled is filled (core validation), and read with no barrier in between (synchronization validation).
fn assert_watched(instance: &Instance, device: &Arc<Device>) {
    let new = |name, usage| Buffer::new(device, name, 64, usage, Location::Device, MemoryKind::Geometry);
    let buffers = new("unfillable", vk::BufferUsageFlags::TRANSFER_SRC)
        .and_then(|from| Ok((from, new("to", vk::BufferUsageFlags::TRANSFER_DST)?)));
    let (from, to) = buffers.unwrap_or_else(|error| panic!("{error}"));
    let mut cmd = CommandBuffer::new(device, "mistakes").unwrap_or_else(|error| panic!("{error}"));
    cmd.begin().unwrap_or_else(|error| panic!("{error}"));
    // SAFETY: recording; the buffers outlive the wait. A usage only tells a driver where to put a buffer, and nobody looks at what
    // the copy reads.
    unsafe {
        device.raw.cmd_fill_buffer(cmd.raw, from.raw, 0, 64, 1);
        let region = vk::BufferCopy { src_offset: 0, dst_offset: 0, size: 64 };
        device.raw.cmd_copy_buffer(cmd.raw, from.raw, to.raw, &[region]);
    }
    let done = cmd.end().and_then(|()| device.submit(&cmd)).and_then(|ticket| device.wait(ticket));
    done.unwrap_or_else(|error| panic!("{error}"));
    let messages = instance.take_messages();
    for rule in ["VUID-vkCmdFillBuffer-dstBuffer-00029", "SYNC-HAZARD-READ-AFTER-WRITE"] {
        let said = messages.iter().any(|message| message.id_name.contains(rule));
        assert!(said, "the layer is on but does not say {rule}: {messages:#?}");
    }
}

impl Gpu {
    pub fn renderer(&self, scene: &Scene, settings: &Settings) -> Renderer {
        Renderer::new(&self.device, scene, settings).unwrap_or_else(|error| panic!("{}: {error}", scene.name))
    }

    /// One frame from the scene's own camera.
    pub fn draw(&self, scene: &Scene, settings: &Settings) -> Picture {
        let mut renderer = self.renderer(scene, settings);
        renderer.render(&scene.camera).unwrap_or_else(|error| panic!("{}: {error}", scene.name));
        renderer.read_back().unwrap_or_else(|error| panic!("{}: {error}", scene.name))
    }
}

/// The bytes of a tone-mapped picture, RGBA.
pub fn bytes(picture: &Picture) -> &[u8] {
    match &picture.pixels {
        Pixels::Srgb8(bytes) => bytes,
        Pixels::LinearF32(_) => panic!("a linear picture has no bytes"),
    }
}

/// The floats of a linear picture, RGBA.
pub fn floats(picture: &Picture) -> &[f32] {
    match &picture.pixels {
        Pixels::LinearF32(floats) => floats,
        Pixels::Srgb8(_) => panic!("a tone-mapped picture has no floats"),
    }
}

fn index(picture: &Picture, x: u32, y: u32) -> usize {
    assert!(x < picture.size[0] && y < picture.size[1], "({x}, {y}) is outside {:?}", picture.size);
    (y * picture.size[0] + x) as usize * 4
}

/// The sRGB codes of a pixel, from the upper left corner.
pub fn code(picture: &Picture, x: u32, y: u32) -> [u8; 3] {
    let at = index(picture, x, y);
    [0, 1, 2].map(|channel| bytes(picture)[at + channel])
}

/// The radiance of a pixel in nits, from the upper left corner.
pub fn nits(picture: &Picture, x: u32, y: u32) -> DVec3 {
    let at = index(picture, x, y);
    DVec3::from_array([0, 1, 2].map(|channel| f64::from(floats(picture)[at + channel])))
}

/// Every pixel's place.
pub fn places(picture: &Picture) -> impl Iterator<Item = (u32, u32)> + use<> {
    let [width, height] = picture.size;
    (0..height).flat_map(move |y| (0..width).map(move |x| (x, y)))
}
