//! A device that is lost stays lost, as the layer plays it: each later call that can say so does, and another device draws on.

use std::collections::BTreeSet;
use std::env;

use afterlight::frame;
use afterlight::gpu::{self, vk};
use afterlight_failures_layer::commands;

use super::layer::{Layer, child_of};
use super::play::Play;
use crate::common::failures_layer::{LIBRARY, environment, folder};

/// Commands that can report a lost device and are not called here, since they belong to instances or to presentation.
const ELSEWHERE: [&str; 5] =
    ["vkAcquireNextImage2KHR", "vkAcquireNextImageKHR", "vkCreateDevice", "vkCreateSwapchainKHR", "vkQueuePresentKHR"];

type Call<'a> = &'a dyn Fn() -> Result<(), vk::Result>;

#[test]
fn a_lost_device_answers_every_later_call_so_and_another_one_draws_on() {
    let layers = folder();
    let output = child_of("failures::lost::child", environment(layers.path())).output().expect("it starts");
    let told = format!("{}{}", String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert!(output.status.success() && told.contains("1 passed"), "{told}");
}

/// Loses a device. The test above starts it as a separate process.
#[test]
#[ignore = "a child of the test of a lost device"]
fn child() {
    if env::var_os(LIBRARY).is_none() {
        return;
    }
    let layer = Layer::of_this_process();
    layer.reset();
    let play = Play::bare();
    let start = || play.start().unwrap_or_else(|error| panic!("{error}"));
    let (device, other) = (start(), start());
    let pictures = play.draw(&other, &mut |_| {}).unwrap_or_else(|error| panic!("{error}"));
    layer.tell(&format!("vkQueueSubmit:{}:ERROR_DEVICE_LOST", layer.calls("vkQueueSubmit") + 1));
    let raw = &device.raw;
    let times = vk::QueryPoolCreateInfo::default().query_type(vk::QueryType::TIMESTAMP).query_count(1);
    // SAFETY: the objects are the device's own and destroyed below, this thread alone uses the queue, and of the calls none gets beyond the layer.
    unsafe {
        let queue = raw.get_device_queue(device.queue_family, 0);
        let fence = raw.create_fence(&vk::FenceCreateInfo::default(), None).expect("a fence");
        let event = raw.create_event(&vk::EventCreateInfo::default(), None).expect("an event");
        let pool = raw.create_query_pool(&times, None).expect("a pool");
        let none = vk::Fence::null();
        let calls: [(&str, Call); 9] = [
            // The first of them loses the device.
            ("vkQueueSubmit", &|| raw.queue_submit(queue, &[], none)),
            ("vkQueueSubmit2", &|| raw.queue_submit2(queue, &[], none)),
            ("vkQueueBindSparse", &|| raw.queue_bind_sparse(queue, &[], none)),
            ("vkQueueWaitIdle", &|| raw.queue_wait_idle(queue)),
            ("vkDeviceWaitIdle", &|| raw.device_wait_idle()),
            ("vkWaitForFences", &|| raw.wait_for_fences(&[fence], true, 0)),
            ("vkGetFenceStatus", &|| raw.get_fence_status(fence).map(drop)),
            ("vkGetEventStatus", &|| raw.get_event_status(event).map(drop)),
            ("vkGetQueryPoolResults", &|| {
                raw.get_query_pool_results(pool, 0, &mut [0_u64], vk::QueryResultFlags::TYPE_64)
            }),
        ];
        let can_say_so = commands().filter(|own| own.errors.iter().any(|own| own.1 == vk::Result::ERROR_DEVICE_LOST));
        let can_say_so: BTreeSet<&str> = can_say_so.map(|own| own.name).collect();
        assert_eq!(can_say_so, calls.iter().map(|own| own.0).chain(ELSEWHERE).collect());
        for round in 1..=3 {
            for (name, call) in calls {
                assert_eq!(call(), Err(vk::Result::ERROR_DEVICE_LOST), "{name}, round {round}");
            }
        }
        // Calls that cannot report the loss are made as ever.
        let later = raw.create_fence(&vk::FenceCreateInfo::default(), None).expect("a fence");
        for fence in [fence, later] {
            raw.destroy_fence(fence, None);
        }
        raw.destroy_event(event, None);
        raw.destroy_query_pool(pool, None);
    }
    assert_eq!(layer.fired(), 1, "one call has lost it");
    for _ in 0..2 {
        let drawn = play.draw(&device, &mut |_| {});
        assert!(matches!(drawn, Err(frame::Error::Gpu(gpu::Error::DeviceLost { .. }))), "{drawn:?}");
    }
    let again = |device| play.draw(device, &mut |_| {}).unwrap_or_else(|error| panic!("{error}"));
    assert!(again(&other) == pictures, "the other device draws on");
    drop(device);
    // It may have the handle of the lost one.
    assert!(again(&start()) == pictures, "the next device draws the same");
}
