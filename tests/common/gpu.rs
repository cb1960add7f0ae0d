//! A device for a test, and pictures from it. Every message of the validation layer fails the test.

use std::cell::Cell;
use std::ffi::CStr;
use std::sync::Arc;

use afterlight::frame::{self, Picture, Pixels, Renderer};
use afterlight::gpu::{
    self, Buffer, CommandBuffer, DescriptorPool, Device, DeviceChoice, Instance, InstanceOptions, Location, MemoryKind,
    Message, MessageKind, MessageLog, PhysicalDevice, SetLayout, SetWriter, ShaderStage, Validation, vk,
};
use afterlight::scene::{LightPath, Playing, Scene, Settings, View};
use glam::DVec3;

use super::tries_all;

/// A device under synchronization validation.
pub struct Gpu {
    pub device: Arc<Device>,
    turns: Turns,
}

/// The share of a test's cases that a mode of the layer tries: every `every`-th, from number `first`.
struct Turns {
    every: usize,
    first: usize,
    begun: Cell<usize>,
}

impl Turns {
    fn of(every: usize, first: usize) -> Self {
        Self { every, first, begun: Cell::new(0) }
    }

    fn all() -> Self {
        Self::of(1, 0)
    }
}

/// Runs `test` on its own device, so that the messages belong to it, however many tests run in parallel. Fails on every message about this program,
/// including the ones from tearing down.
pub fn on_gpu(test: impl FnOnce(&Gpu)) {
    on_instance(instance(false), &[], Turns::all(), |_| (), test);
}

/// Runs `test` as [`on_gpu`] does, on a device that `prepare` changes first.
pub fn on_prepared_gpu(prepare: impl FnOnce(&mut Device), test: impl FnOnce(&Gpu)) {
    on_instance(instance(false), &[], Turns::all(), prepare, test);
}

/// Runs `test` as [`on_gpu`] does, in both modes of the layer, since neither notices everything. Older layers have one mode. In `make test`, cases
/// that ask [`Gpu::takes_turn`] run in one mode each, alternating.
pub fn on_gpu_in_both_modes(test: impl Fn(&Gpu)) {
    let modes = [false, true].map(instance);
    let modes: Vec<_> =
        modes.into_iter().zip([false, true]).filter(|(own, mode)| own.sync_shader_heuristic() == *mode).collect();
    let every = if tries_all() { 1 } else { modes.len() };
    for (first, (instance, _)) in modes.into_iter().enumerate() {
        on_instance(instance, &[], Turns::of(every, first % every), |_| (), &test);
    }
}

/// Runs `test` as [`on_gpu`] does, on a device that can present frames, on surfaces without a display. A system without such surfaces is reported.
#[cfg(feature = "window")]
pub fn on_presenting_gpu(test: impl FnOnce(&Gpu)) {
    on_prepared_presenting_gpu(|_| (), test);
}

/// Runs `test` as [`on_presenting_gpu`] does, on a device that `prepare` changes first.
#[cfg(feature = "window")]
pub fn on_prepared_presenting_gpu(prepare: impl FnOnce(&mut Device), test: impl FnOnce(&Gpu)) {
    let options = InstanceOptions { validation: Validation::Synchronization, ..InstanceOptions::default() };
    match Instance::with_extensions(&options, &gpu::HEADLESS) {
        Ok(instance) => on_instance(instance, &[c"VK_KHR_swapchain"], Turns::all(), prepare, test),
        Err(error @ gpu::Error::Unsupported(_)) => not_run(&error.to_string()),
        Err(error) => panic!("{error}"),
    }
}

fn instance(sync_shader_heuristic: bool) -> Arc<Instance> {
    let options = InstanceOptions {
        validation: Validation::Synchronization,
        sync_shader_heuristic,
        ..InstanceOptions::default()
    };
    Instance::new(&options).unwrap_or_else(|error| panic!("{error}"))
}

fn on_instance(
    instance: Arc<Instance>,
    extensions: &[&'static CStr],
    turns: Turns,
    prepare: impl FnOnce(&mut Device),
    test: impl FnOnce(&Gpu),
) {
    let log = instance.message_log();
    let device = Device::with_extensions(&instance, &DeviceChoice::Auto, extensions);
    let mut device = device.unwrap_or_else(|error| panic!("{error}"));
    prepare(Arc::get_mut(&mut device).expect("nobody else has it yet"));
    assert_watched(&instance, &device);
    let gpu = Gpu { device, turns };
    test(&gpu);
    let leaks = gpu.device.live_objects();
    assert!(leaks.is_empty(), "objects outlived their owners: {leaks:#?}");
    drop((gpu, instance));
    let ours = ours(&log);
    assert!(ours.is_empty(), "messages: {ours:#?}");
}

/// Runs `test` on its own device under GPU-assisted validation, and fails on every message. A layer that cannot do so is reported.
pub fn on_gpu_assisted(test: impl FnOnce(&Gpu)) {
    let (watched, log) = match open(Validation::GpuAssisted) {
        Ok(opened) => opened,
        Err(error @ gpu::Error::Unsupported(_)) => return not_run(&error.to_string()),
        Err(error) => panic!("{error}"),
    };
    overrun(&watched.device).unwrap_or_else(|error| panic!("{error}"));
    drop(watched);
    let messages = log.take();
    let said = messages.iter().any(|message| message.id_name.contains(OVERRUN_RULE));
    assert!(said, "the layer is on but does not say {OVERRUN_RULE}: {messages:#?}");

    let (gpu, log) = open(Validation::GpuAssisted).unwrap_or_else(|error| panic!("{error}"));
    // Messages about the checks that the device does not allow.
    let setup = log.take();
    assert!(setup.iter().all(|message| message.kind == MessageKind::General), "{setup:#?}");
    setup.iter().for_each(|message| eprintln!("{}", message.text));
    test(&gpu);
    gpu.device.wait_idle().unwrap_or_else(|error| panic!("{error}"));
    drop(gpu);
    // Messages of any kind fail: a shader that the layer could not instrument is one that it did not check. Where checks are many, it does and complains.
    let mut messages = log.take();
    messages.retain(|message| message.id_name != "GPUAV-Compile-time-general-buffer");
    assert!(messages.is_empty(), "messages of GPU-assisted validation: {messages:#?}");
}

/// Says why the layer at hand cannot do a test. Where `AFTERLIGHT_NEEDS_LAYER` names a version, the layer there must be able to, and this is
/// a failure: cargo hides what passing tests print.
pub fn not_run(why: &str) {
    if let Ok(needed) = std::env::var("AFTERLIGHT_NEEDS_LAYER") {
        panic!("AFTERLIGHT_NEEDS_LAYER is {needed}, so that this must run: {why}");
    }
    eprintln!("NOT RUN: {why}");
}

/// Returns the layer's advice on best practices for `test`.
pub fn advice_on(test: impl FnOnce(&Gpu)) -> Vec<Message> {
    let (gpu, log) = open(Validation::BestPractices).unwrap_or_else(|error| panic!("{error}"));
    test(&gpu);
    drop(gpu);
    ours(&log)
}

fn open(validation: Validation) -> gpu::Result<(Gpu, Arc<MessageLog>)> {
    let instance = Instance::new(&InstanceOptions { validation, ..InstanceOptions::default() })?;
    let device = Device::new(&instance, &DeviceChoice::Auto)?;
    Ok((Gpu { device, turns: Turns::all() }, instance.message_log()))
}

/// Returns all messages about this program, without the messages of loader and drivers about the system.
fn ours(log: &MessageLog) -> Vec<Message> {
    assert_eq!(log.dropped(), 0, "more messages than the log keeps");
    log.take().into_iter().filter(Message::is_about_this_program).collect()
}

const OVERRUN_NAME: &str = "overrun";

/// The rule that a shader accesses no storage buffer beyond the range of its descriptor; before 1.4.310 a breach is a warning, by robust buffer access.
const OVERRUN_RULE: &str = "VUID-vkCmdDispatch-storageBuffers-06936";

/// Has a shader write past the range of its descriptor, at an index that only the content of memory tells. The buffer goes on there and nobody looks
/// at it, so that the mistake harms nobody, whatever the driver.
fn overrun(device: &Arc<Device>) -> gpu::Result<()> {
    const SHADER: &str = "
        @group(0) @binding(0) var<storage, read_write> words: array<u32>;
        @compute @workgroup_size(1) fn main() { words[words[0]] = 1u; }";
    let shader = afterlight_shader_compiler::compile_source(("overrun.wgsl", SHADER), &[]);
    let shader = shader.unwrap_or_else(|errors| panic!("{errors:?}"));
    let stage = ShaderStage {
        spirv: &shader.variants[0].entry_points[0].spirv,
        entry: c"main",
        stage: vk::ShaderStageFlags::COMPUTE,
        constants: &[],
    };
    let binding = vk::DescriptorSetLayoutBinding::default()
        .binding(0)
        .descriptor_type(vk::DescriptorType::STORAGE_BUFFER)
        .descriptor_count(1)
        .stage_flags(vk::ShaderStageFlags::COMPUTE);
    let set_layout = SetLayout::new(device, OVERRUN_NAME, &[binding])?;
    let layout = gpu::pipeline_layout(device, OVERRUN_NAME, &[set_layout.raw], &[])?;
    let pipeline = gpu::compute_pipeline(device, OVERRUN_NAME, &stage, layout.raw)?;
    let usage = vk::BufferUsageFlags::STORAGE_BUFFER;
    let buffer = Buffer::new(device, OVERRUN_NAME, 1024, usage, Location::Upload, MemoryKind::Staging)?;
    let mut words = [0u32; 256];
    words[0] = 200;
    buffer.write(0, &words)?;
    let pool = DescriptorPool::new(device, OVERRUN_NAME, 1, &[(vk::DescriptorType::STORAGE_BUFFER, 1)])?;
    let set = pool.allocate(OVERRUN_NAME, set_layout.raw)?;
    SetWriter::new().storage_buffer(0, &buffer, 256).update(device, set);
    let mut cmd = CommandBuffer::new(device, OVERRUN_NAME)?;
    cmd.begin()?;
    // SAFETY: recording; all of these outlive the wait below.
    unsafe {
        device.raw.cmd_bind_pipeline(cmd.raw, vk::PipelineBindPoint::COMPUTE, pipeline.raw);
        device.raw.cmd_bind_descriptor_sets(cmd.raw, vk::PipelineBindPoint::COMPUTE, layout.raw, 0, &[set], &[]);
        device.raw.cmd_dispatch(cmd.raw, 1, 1, 1);
    }
    cmd.end()?;
    device.submit(&cmd)?;
    // The layer reads its findings on a separate thread, perhaps after a fence has signalled; this waits for that thread.
    device.wait_idle()
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
    // SAFETY: recording; the buffers outlive the wait. A usage only tells a driver where to put a buffer, and nobody looks at the copied bytes.
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

/// Returns true if this is SwiftShader, which differs from lavapipe where the specification leaves it free: 4 bits of a pixel in place of 8.
pub fn is_swiftshader(device: &PhysicalDevice) -> bool {
    device.driver_name.contains("SwiftShader")
}

impl Gpu {
    /// Returns true if the case that now begins is one for this mode of the layer.
    pub fn takes_turn(&self) -> bool {
        let case = self.turns.begun.replace(self.turns.begun.get() + 1);
        case % self.turns.every == self.turns.first
    }

    pub fn renderer(&self, scene: &Scene, settings: &Settings) -> Renderer {
        Renderer::new(&self.device, scene, settings).unwrap_or_else(|error| panic!("{}: {error}", scene.name))
    }

    /// Returns true if the device can draw a view: without geometryShader, as on SwiftShader, triangles have no numbers.
    pub fn shows(&self, view: View) -> bool {
        view != View::Triangle || self.device.features.geometry_shader
    }

    /// Returns true if the device can draw a scene by a light path, as far as `visibility` goes: not every one looks textures up. Lavapipe of Mesa 22 cannot
    /// index them.
    pub fn takes(&self, path: LightPath, scene: &Scene) -> bool {
        /// More textures than any scene here has, including the pass's own.
        const ENOUGH: u32 = 64;
        let device = frame::capabilities(&self.device.physical);
        let has_textures = scene.materials.iter().any(|material| material.textures().next().is_some());
        path != LightPath::Visibility || device.non_uniform_textures >= ENOUGH || !has_textures
    }

    /// One frame from the scene's own camera.
    pub fn draw(&self, scene: &Scene, settings: &Settings) -> Picture {
        let mut renderer = self.renderer(scene, settings);
        renderer.render(&scene.camera).unwrap_or_else(|error| panic!("{}: {error}", scene.name));
        renderer.read_back().unwrap_or_else(|error| panic!("{}: {error}", scene.name))
    }

    /// A picture of a scene while the shutter is open, from a time in seconds on.
    pub fn expose(&self, scene: &Scene, settings: &Settings, time: f64) -> Picture {
        let show = |renderer: &mut Renderer, seconds: f64| {
            let pose = scene.motion.pose(&Playing::at(time + seconds));
            renderer.pose(scene, &pose)?;
            Ok::<_, frame::Error>(scene.camera)
        };
        self.renderer(scene, settings).picture_while(show, || ()).unwrap_or_else(|error| panic!("{error}"))
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
