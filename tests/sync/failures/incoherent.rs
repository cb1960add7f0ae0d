//! Buffers in memory that is not coherent, as the layer plays it: the ranges that are flushed and invalidated lie within the memory, and
//! a renderer draws on after a flush that fails.

use std::env;
use std::sync::Arc;

use afterlight::frame::Renderer;
use afterlight::gpu::{Buffer, Device, Location, MemoryKind, vk};
use afterlight::scene::{Culling, LightPath, OpenOptions, Settings, open};
use glam::{DAffine3, DVec3};

use super::cases::check_messages;
use super::layer::{Layer, child_of};
use super::play::Play;
use crate::common::failures_layer::{LIBRARY, environment, folder};
use crate::common::some_of;

/// More than the allocator's largest block of mapped memory: a buffer of this size gets a dedicated allocation, whose size is no whole number of
/// atoms.
const LARGE: u64 = (64 << 20) + 4;

#[test]
fn memory_that_is_not_coherent_is_flushed_within_its_bounds_and_frames_go_on_after_a_flush_that_fails() {
    let layers = folder();
    let mut child = child_of("failures::incoherent::child", environment(layers.path()));
    let output = child.env("AFTERLIGHT_FAILURES", "incoherent").output().expect("it starts");
    let told = format!("{}{}", String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert!(output.status.success() && told.contains("1 passed"), "{told}");
}

/// Writes, reads and draws. The test above starts it as a separate process.
#[test]
#[ignore = "a child of the test of incoherent memory"]
fn child() {
    if env::var_os(LIBRARY).is_none() {
        return;
    }
    let layer = Layer::of_this_process();
    let device = Play::whole().start().unwrap_or_else(|error| panic!("{error}"));
    let log = device.instance.message_log();
    let (usage, kind) = (vk::BufferUsageFlags::TRANSFER_SRC, MemoryKind::Staging);
    for location in [Location::Upload, Location::ReadBack] {
        for size in [1, 63, 65, LARGE] {
            let buffer =
                Buffer::new(&device, "odd", size, usage, location, kind).unwrap_or_else(|error| panic!("{error}"));
            buffer.write(size - 1, &[7_u8]).unwrap_or_else(|error| panic!("{error}"));
            assert_eq!(buffer.read(size - 1, 1).unwrap_or_else(|error| panic!("{error}")), [7], "{size}");
        }
    }
    let calls = || ["vkFlushMappedMemoryRanges", "vkInvalidateMappedMemoryRanges"].map(|own| layer.calls(own));
    assert_eq!(calls(), [8, 8]);
    for way in some_of(WAYS, WAYS.len()) {
        draws_on(&layer, &device, way);
    }
    drop(device);
    check_messages(Some(&log)).unwrap_or_else(|error| panic!("{error}"));
}

/// A scene and the way to draw it, by which the CPU writes a frame's buffers.
type Way = (&'static str, LightPath, Culling);

const WAYS: [Way; 6] = [
    ("builtin:spheres", LightPath::Loop, Culling::Gpu),
    ("builtin:hall", LightPath::Clustered, Culling::Cpu),
    ("builtin:layers", LightPath::Forward, Culling::Cpu),
    ("builtin:seaweed", LightPath::Loop, Culling::Cpu),
    ("builtin:spheres", LightPath::Visibility, Culling::Cpu),
    ("builtin:field?objects=40&lights=20", LightPath::Visibility, Culling::Gpu),
];

/// Draws frames of objects that all move, each of whose flushes fails once, and then the same frame again with the same renderer.
fn draws_on(layer: &Layer, device: &Arc<Device>, (name, light_path, culling): Way) {
    const FLUSH: &str = "vkFlushMappedMemoryRanges";
    let scene = open(name, &OpenOptions::default()).unwrap_or_else(|error| panic!("{error}"));
    let settings = Settings { size: [32, 18], samples: 1, light_path, culling, ..scene.settings.decide() };
    let [mut renderer, mut other] =
        [(); 2].map(|()| Renderer::new(device, &scene, &settings).unwrap_or_else(|error| panic!("{name}: {error}")));
    let mut moved = scene.clone();
    let mut frame = |renderer: &mut Renderer, turn: u64| {
        for index in 0..scene.objects.len() {
            let place = DAffine3::from_translation(DVec3::X * 0.1 * turn as f64) * scene.objects[index].transform;
            renderer.move_object(&mut moved, index, &place)?;
        }
        renderer.render(&scene.camera)
    };
    for turn in 1.. {
        let before = layer.calls(FLUSH);
        frame(&mut other, turn).unwrap_or_else(|error| panic!("{error}"));
        let flushes = layer.calls(FLUSH) - before;
        if turn > flushes {
            assert!(turn > 4, "a frame writes its objects: {flushes} flushes");
            break;
        }
        layer.tell(&format!("{FLUSH}:{}:ERROR_OUT_OF_HOST_MEMORY", layer.calls(FLUSH) + turn));
        let failed = frame(&mut renderer, turn).expect_err("a flush fails").to_string();
        assert!(failed.contains(FLUSH), "{failed}");
        frame(&mut renderer, turn).unwrap_or_else(|error| panic!("{error}"));
        let [own, expected] =
            [&mut renderer, &mut other].map(|own| own.read_back().unwrap_or_else(|error| panic!("{error}")));
        assert!(own == expected, "{name}, {light_path}: another picture after: {failed}");
    }
}
