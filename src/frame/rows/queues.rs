//! The rows between queues: a semaphore that one signals and the other waits for, and the transfer of what both use.
//!
//! Everything else stays as it is with one queue: rows before the release hold back the stages that its first scope names, and rows after the acquire go on from
//! the stages of its second scope.

use ash::vk::AccessFlags2 as A;

use super::{Endpoint, Row, RowName, Rows, SyncKind, row};
use crate::frame::list::{HandOver, Step};
use crate::gpu::barrier::Half;
use crate::gpu::sync::{DEVICE_ACCESS, Use};
use crate::gpu::upload::{COPY_WRITE, LEVEL_WRITE};
use crate::gpu::{Queue, UploadHandover};
use crate::plan::FramePlan;

#[allow(missing_docs, reason = "a name says which row, and the row itself says why it is there")]
impl RowName {
    /// Copies are over on the transfer queue.
    pub const FROM_TRANSFER_QUEUE: Self = Self::Own("from-transfer-queue");
    /// What was copied there.
    pub const GIVEN_BY_TRANSFER_QUEUE: Self = Self::Own("given-by-transfer-queue");

    /// The semaphore from one queue to another.
    pub const fn semaphore(queues: [Queue; 2]) -> Self {
        match queues {
            [Queue::Transfer, _] => Self::FROM_TRANSFER_QUEUE,
            [Queue::Compute, _] => Self::Own("from-compute-queue"),
            [Queue::Graphics, _] => Self::Own("to-compute-queue"),
        }
    }

    /// The ownership transfer from one queue to another.
    pub const fn ownership(queues: [Queue; 2]) -> Self {
        match queues {
            [Queue::Transfer, _] => Self::GIVEN_BY_TRANSFER_QUEUE,
            [Queue::Compute, _] => Self::Own("given-by-compute-queue"),
            [Queue::Graphics, _] => Self::Own("given-to-compute-queue"),
        }
    }
}

/// The stages of these uses alone.
const fn stages(uses: Use) -> Use {
    Use::new(uses.stage, A::empty())
}

fn semaphore(queues: [Queue; 2], [from, to]: [Endpoint; 2], waits: Use, why: &str) -> Row {
    row(RowName::semaphore(queues), SyncKind::QueueSemaphore)
        .from(from, &[DEVICE_ACCESS])
        .to(to, &[stages(waits)])
        .because(why)
}

/// Rows of a plan's frames.
pub(super) fn rows(steps: &[Step]) -> Vec<Row> {
    let acquires = steps.iter().filter_map(|step| match step {
        Step::HandOver(own) if own.half == Half::Acquire => Some(own),
        _ => None,
    });
    acquires.flat_map(of_frame).collect()
}

fn of_frame(own: &HandOver) -> [Row; 2] {
    let HandOver { queues, ends: [from, to], uses, read_on, .. } = *own;
    let (released, acquired, why) = if queues[0] == Queue::Graphics {
        let why = "the compute queue's family owns what its passes use: rows of what wrote it hold the release back";
        (stages(uses), uses, why)
    } else {
        let why =
            "the graphics queue's family owns it again, with what was written: rows of its next users go on from here";
        (uses, stages(uses).or(read_on), why)
    };
    let waits = semaphore(
        queues,
        [from, to],
        acquired,
        "queues run beside each other: nothing but a semaphore orders the work of one after that of another",
    );
    let targets = own.targets.iter().map(|&(target, _)| super::Resource::Target(target)).collect();
    let given = row(RowName::ownership(queues), SyncKind::Ownership(queues))
        .from(from, &[released])
        .to(to, &[acquired])
        .about(targets)
        .because(why);
    [waits, given]
}

/// Rows of uploads by the transfer queue.
pub(super) fn of_uploads(plan: &FramePlan) -> Vec<Row> {
    let uploads = plan.uploads;
    if !plan.queues.transfer || !(uploads.textures || uploads.vertices || uploads.volumes) {
        return Vec::new();
    }
    let (queues, ends) = ([Queue::Transfer, Queue::Graphics], [Endpoint::UPLOAD, Endpoint::UPLOAD]);
    // Blits write levels that the other queue has brought into the layout for that.
    let next = if uploads.mip_levels { LEVEL_WRITE } else { stages(COPY_WRITE) };
    let given = row(RowName::ownership(queues), SyncKind::Ownership(queues))
        .from(Endpoint::UPLOAD, &[COPY_WRITE])
        .to(Endpoint::UPLOAD, &[next])
        .because(
            "the queue that reads buffers and textures owns them when they are copied: its own rows go on from here",
        );
    let why = "blits and reads come after the copies, which another queue has made";
    vec![semaphore(queues, ends, next, why), given]
}

impl Rows {
    /// The way of uploads from the transfer queue, if the plan copies there.
    pub(in crate::frame) fn upload_handover(&self) -> Option<UploadHandover> {
        let ownership = self.find(RowName::GIVEN_BY_TRANSFER_QUEUE)?.order();
        let wait = self.find(RowName::FROM_TRANSFER_QUEUE)?.after.stage;
        Some(UploadHandover { ownership, wait })
    }
}
