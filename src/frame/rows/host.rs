//! The rows between the CPU and the device.

use ash::vk;

use super::{Endpoint, Row, RowName, SyncKind, row};
use crate::gpu::sync::{DEVICE_ACCESS, HOST_WRITE, Use};
use crate::passes::copy;

#[allow(missing_docs, reason = "a name says which row, and the row itself says why it is there")]
impl RowName {
    pub const HOST_TO_FRAME: Self = Self::Own("host-to-frame");
    pub const FRAME_TO_HOST: Self = Self::Own("frame-to-host");
    pub const LAST_USE_TO_DESTROY: Self = Self::Own("last-use-to-destroy");
    /// Makes the copy of a picture visible to the CPU.
    pub const PICTURE_TO_HOST: Self = Self::Own("picture-to-host");
    pub const COPY_TO_HOST: Self = Self::Own("copy-to-host");
    /// The results of a compute shader, to the CPU.
    pub const RESULTS_TO_HOST: Self = Self::Own("results-to-host");
}

/// Writes every result.
pub const FORMULA_WRITE: Use = Use::new(vk::PipelineStageFlags2::COMPUTE_SHADER, vk::AccessFlags2::SHADER_WRITE);

/// Returns the rows by which FORMULAS reads its inputs and the CPU its results.
pub(super) fn formulas() -> [Row; 3] {
    [
        row(RowName::HOST_TO_FRAME, SyncKind::Submission)
            .from(Endpoint::HOST, &[HOST_WRITE])
            .to(Endpoint::DEVICE, &[DEVICE_ACCESS])
            .because("the dispatch reads inputs that the CPU wrote"),
        row(RowName::RESULTS_TO_HOST, SyncKind::BufferBarrier)
            .from(Endpoint::DEVICE, &[FORMULA_WRITE])
            .to(Endpoint::HOST, &[copy::HOST_READ])
            .because("a fence alone does not make the dispatch's writes visible to the CPU"),
        row(RowName::COPY_TO_HOST, SyncKind::Fence)
            .from(Endpoint::DEVICE, &[DEVICE_ACCESS])
            .to(Endpoint::HOST, &[copy::HOST_READ])
            .because("the CPU reads the results when the dispatch is done; a barrier does not make it wait"),
    ]
}

pub(super) fn rows() -> [Row; 5] {
    let wait = |name, from| row(name, SyncKind::Fence).from(from, &[DEVICE_ACCESS]);
    [
        row(RowName::HOST_TO_FRAME, SyncKind::Submission)
            .from(Endpoint::HOST, &[HOST_WRITE])
            .to(Endpoint::DEVICE, &[DEVICE_ACCESS])
            .because(
                "a frame reads cameras, lights, maps' places and sorted indices that the CPU wrote, and uploads read \
                 staging buffers",
            ),
        wait(RowName::FRAME_TO_HOST, Endpoint::DEVICE)
            .to(Endpoint::HOST, &[HOST_WRITE])
            .because("the CPU writes buffers and commands of a frame anew when the last frame that used them is done"),
        wait(RowName::LAST_USE_TO_DESTROY, Endpoint::DEVICE)
            .to(Endpoint::HOST, &[Use::new(vk::PipelineStageFlags2::HOST, vk::AccessFlags2::empty())])
            .because(
                "an object is destroyed once the last submission made before it was dropped is done (the retire queue)",
            ),
        // ANCHOR: picture-to-host
        row(RowName::PICTURE_TO_HOST, SyncKind::BufferBarrier)
            .from(copy::PASS.name, &[copy::WRITE])
            .to(Endpoint::HOST, &[copy::HOST_READ])
            .because("a fence alone does not make the copy's writes visible to the CPU"),
        wait(RowName::COPY_TO_HOST, copy::PASS.name)
            .to(Endpoint::HOST, &[copy::HOST_READ])
            .because("the CPU reads the picture when the copy is done; a barrier does not make it wait"),
        // ANCHOR_END: picture-to-host
    ]
}
