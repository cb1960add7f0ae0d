//! The rows between the CPU and the device.

use ash::vk;

use super::{Carrier, Edge, Place};
use crate::gpu::sync::{DEVICE_ACCESS, HOST_WRITE, Use};
use crate::passes::copy;

pub(super) fn rows() -> [Edge; 5] {
    let wait =
        |name, from, host: Use, why| Edge::new(name, Carrier::Fence, (from, Place::Host), (DEVICE_ACCESS, host), why);
    [
        Edge::new(
            "host-to-frame",
            Carrier::Submission,
            (Place::Host, Place::Device),
            (HOST_WRITE, DEVICE_ACCESS),
            "a frame reads cameras, lights, maps' places and sorted indices that the CPU wrote, and uploads read staging buffers",
        ),
        wait(
            "frame-to-host",
            Place::Device,
            HOST_WRITE,
            "the CPU writes buffers and commands of a frame anew when the last frame that used them is done",
        ),
        wait(
            "last-use-to-destroy",
            Place::Device,
            Use::new(vk::PipelineStageFlags::HOST, vk::AccessFlags::empty()),
            "objects and memory are destroyed when the last submission before their owner's end is done (the retire queue)",
        ),
        Edge::new(
            "picture-to-host",
            Carrier::BufferBarrier,
            (Place::Copy, Place::Host),
            (copy::WRITE, copy::HOST_READ),
            "a fence alone does not make the copy's writes visible to the CPU",
        ),
        wait(
            "copy-to-host",
            Place::Copy,
            copy::HOST_READ,
            "the CPU reads the picture when the copy is done; a barrier does not make it wait",
        ),
    ]
}
