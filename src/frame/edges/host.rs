//! The rows between the CPU and the device.

use ash::vk;

use super::{Carrier, Edge, Place, RowName};
use crate::gpu::sync::{DEVICE_ACCESS, HOST_WRITE, Use};
use crate::passes::copy;

impl RowName {
    pub(crate) const HOST_TO_FRAME: Self = Self("host-to-frame");
    pub(crate) const FRAME_TO_HOST: Self = Self("frame-to-host");
    pub(crate) const LAST_USE_TO_DESTROY: Self = Self("last-use-to-destroy");
    /// Makes the copy of a picture visible to the CPU.
    pub const PICTURE_TO_HOST: Self = Self("picture-to-host");
    pub(crate) const COPY_TO_HOST: Self = Self("copy-to-host");
    pub(crate) const RESULTS_TO_HOST: Self = Self("results-to-host");
}

/// Writes every result.
pub(in crate::frame) const FORMULA_WRITE: Use =
    Use::new(vk::PipelineStageFlags::COMPUTE_SHADER, vk::AccessFlags::SHADER_WRITE);

/// What FORMULAS writes reaches the CPU.
pub(super) fn formulas() -> [Edge; 3] {
    [
        Edge::new(
            RowName::HOST_TO_FRAME,
            Carrier::Submission,
            (Place::HOST, Place::DEVICE),
            (HOST_WRITE, DEVICE_ACCESS),
            "the dispatch reads inputs that the CPU wrote",
        ),
        Edge::new(
            RowName::RESULTS_TO_HOST,
            Carrier::BufferBarrier,
            (Place::DEVICE, Place::HOST),
            (FORMULA_WRITE, copy::HOST_READ),
            "a fence alone does not make the dispatch's writes visible to the CPU",
        ),
        Edge::new(
            RowName::COPY_TO_HOST,
            Carrier::Fence,
            (Place::DEVICE, Place::HOST),
            (DEVICE_ACCESS, copy::HOST_READ),
            "the CPU reads the results when the dispatch is done; a barrier does not make it wait",
        ),
    ]
}

pub(super) fn rows() -> [Edge; 5] {
    let wait =
        |name, from, host: Use, why| Edge::new(name, Carrier::Fence, (from, Place::HOST), (DEVICE_ACCESS, host), why);
    [
        Edge::new(
            RowName::HOST_TO_FRAME,
            Carrier::Submission,
            (Place::HOST, Place::DEVICE),
            (HOST_WRITE, DEVICE_ACCESS),
            "a frame reads cameras, lights, maps' places and sorted indices that the CPU wrote, and uploads read staging buffers",
        ),
        wait(
            RowName::FRAME_TO_HOST,
            Place::DEVICE,
            HOST_WRITE,
            "the CPU writes buffers and commands of a frame anew when the last frame that used them is done",
        ),
        wait(
            RowName::LAST_USE_TO_DESTROY,
            Place::DEVICE,
            Use::new(vk::PipelineStageFlags::HOST, vk::AccessFlags::empty()),
            "objects and memory are destroyed when the last submission before their owner's end is done (the retire queue)",
        ),
        Edge::new(
            RowName::PICTURE_TO_HOST,
            Carrier::BufferBarrier,
            (copy::PASS.place, Place::HOST),
            (copy::WRITE, copy::HOST_READ),
            "a fence alone does not make the copy's writes visible to the CPU",
        ),
        wait(
            RowName::COPY_TO_HOST,
            copy::PASS.place,
            copy::HOST_READ,
            "the CPU reads the picture when the copy is done; a barrier does not make it wait",
        ),
    ]
}
