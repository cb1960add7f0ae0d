//! Submissions to the queues, and knowing when each is done.

use std::collections::VecDeque;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::Duration;

use ash::vk;

use super::command::CommandBuffer;
use super::device::Device;
use super::error::{Doing, Error, Result};
use super::queues::Queue;
use super::sync::{SyncVersion, Use};

/// The number of a submission of one device: the first is 1. A higher one is done no earlier than a lower one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Ticket(pub u64);

/// The effects of a submission beside running its commands.
#[derive(Clone, Copy, Default)]
pub struct SubmitOptions<'a> {
    /// Semaphores to wait for before the given stages.
    pub waits: &'a [(vk::Semaphore, vk::PipelineStageFlags2)],
    /// Semaphores to signal when done.
    pub signals: &'a [vk::Semaphore],
    /// It ends a frame that nothing presents, and this image has its picture. Tools that capture frames are told, where the device can tell
    /// them; a presented frame needs no such mark.
    pub ends_frame: Option<vk::Image>,
    /// Command buffers that go before it, in this order, on the same queue or others.
    pub parts: &'a [Part<'a>],
    /// One of these parts, on another queue, that it waits for before the given stages.
    pub after: Option<PartWait>,
}

/// A command buffer that goes to a queue before others of the same work.
#[derive(Clone, Copy)]
pub struct Part<'a> {
    /// Recorded for its queue.
    pub cmd: &'a CommandBuffer,
    /// An earlier part, on another queue, that it waits for.
    pub after: Option<PartWait>,
}

/// A wait for an earlier part of the same work: its index, and the stages that wait.
pub type PartWait = (usize, vk::PipelineStageFlags2);

/// The queues, and a fence for each submission that is not known to be done.
///
/// Fences suffice for order: one signals only when every earlier submission to the queue is done too (Vulkan 1.3,
/// section 7.3, "Fence signal operations"). Work of several queues ends on the first one, which has waited for the others by then.
pub(super) struct Submissions {
    submitted: AtomicU64,
    completed: AtomicU64,
    state: Mutex<QueueState>,
}

struct QueueState {
    /// Indexed by [`Queue::index`]; `None` for a queue that the device lacks.
    queues: [Option<CountingQueue>; 3],
    /// A thread that waits for a fence holds it too, and nobody resets it meanwhile.
    pending: VecDeque<(u64, Arc<vk::Fence>)>,
    /// Signalled fences. A fence that nobody waits for any more can be reset.
    done: Vec<Arc<vk::Fence>>,
    free: Vec<vk::Fence>,
}

/// A queue, and the semaphore that counts its parts of works that others wait for.
#[derive(Clone, Copy)]
pub(super) struct CountingQueue {
    pub(super) raw: vk::Queue,
    /// `None` on a device with one queue, where nothing waits for it.
    pub(super) timeline: Option<vk::Semaphore>,
    /// The last value that was or will be signalled.
    count: u64,
}

impl CountingQueue {
    pub(super) const fn new(raw: vk::Queue, timeline: Option<vk::Semaphore>) -> Self {
        Self { raw, timeline, count: 0 }
    }

    /// The next value of its semaphore, before these stages of whoever waits.
    fn next(&mut self) -> Option<Point> {
        self.count += 1;
        let count = self.count;
        self.timeline.map(|semaphore| Point { semaphore, value: Some(count), stage: ALL })
    }
}

/// A semaphore that is waited for before its stages, or signalled after them; one that counts has a value.
#[derive(Clone, Copy)]
struct Point {
    semaphore: vk::Semaphore,
    value: Option<u64>,
    stage: vk::PipelineStageFlags2,
}

const ALL: vk::PipelineStageFlags2 = vk::PipelineStageFlags2::ALL_COMMANDS;

/// One batch of a queue.
struct Batch<'a> {
    queue: vk::Queue,
    commands: &'a [vk::CommandBuffer],
    waits: Vec<Point>,
    signals: Vec<Point>,
    fence: vk::Fence,
}

/// A queue with the semaphores before and after a batch.
type QueueBatch = (vk::Queue, Vec<Point>, Vec<Point>);

impl QueueState {
    /// The one that every device has.
    fn queue(&self) -> vk::Queue {
        self.queues[Queue::Graphics.index()].map_or(vk::Queue::null(), |own| own.raw)
    }
}

/// Runs `submit` when the recordings of all parts are whole and not under way, and keeps its ticket for them, too.
fn submitted_by(parts: &[Part<'_>], submit: &dyn Fn() -> Result<Ticket>) -> Result<Ticket> {
    match parts {
        [] => submit(),
        [first, rest @ ..] => first.cmd.submitted_by(|_| submitted_by(rest, submit)),
    }
}

impl Submissions {
    pub(super) fn new(queues: [Option<CountingQueue>; 3]) -> Submissions {
        let state = QueueState { queues, pending: VecDeque::new(), done: Vec::new(), free: Vec::new() };
        Submissions { submitted: AtomicU64::new(0), completed: AtomicU64::new(0), state: Mutex::new(state) }
    }

    /// The last submission made, or being made.
    pub(super) fn submitted(&self) -> u64 {
        self.submitted.load(Ordering::Acquire)
    }

    /// The last submission known to be done.
    pub(super) fn completed(&self) -> u64 {
        self.completed.load(Ordering::Acquire)
    }

    fn lock(&self) -> MutexGuard<'_, QueueState> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Notes which fences have signalled, up to the fence of submission `last`. Fences of later submissions are not queried: a layer takes a query's
    /// answer for a wait, and would then see no hazard with the finished work (`tests/sync/necessity.rs`).
    fn poll(&self, device: &ash::Device, state: &mut QueueState, last: u64) -> Result<()> {
        while let Some((serial, fence)) = state.pending.front()
            && *serial <= last
        {
            // SAFETY: the fence belongs to this device and is alive.
            if !unsafe { device.get_fence_status(**fence) }
                .doing("vkGetFenceStatus", || "asking whether the GPU is done")?
            {
                break;
            }
            state.done.extend(state.pending.pop_front().map(|(_, fence)| fence));
        }
        self.note_completed(state);
        let QueueState { done, free, .. } = state;
        // Nobody begins to wait for one of these any more.
        while let Some(index) = done.iter().position(|fence| Arc::strong_count(fence) == 1) {
            // SAFETY: its submission is done, so the queue no longer uses it, and nobody waits for it.
            unsafe { device.reset_fences(&[*done[index]]) }.doing("vkResetFences", || "resetting a fence")?;
            free.push(*done.swap_remove(index));
        }
        Ok(())
    }

    fn note_completed(&self, state: &QueueState) {
        let completed = state.pending.front().map_or(self.submitted(), |(serial, _)| serial - 1);
        self.completed.store(completed, Ordering::Release);
    }

    /// Destroys all fences. The device must be idle or lost.
    pub(super) fn destroy(&self, device: &ash::Device) {
        let mut state = self.lock();
        let pending = std::mem::take(&mut state.pending).into_iter().map(|(_, fence)| fence);
        let used = pending.chain(std::mem::take(&mut state.done)).map(|fence| *fence);
        for fence in used.chain(std::mem::take(&mut state.free)) {
            // SAFETY: the fence belongs to this device, and no submission is under way.
            unsafe { device.destroy_fence(fence, None) };
        }
        for semaphore in state.queues.iter_mut().flatten().filter_map(|own| own.timeline.take()) {
            // SAFETY: as above.
            unsafe { device.destroy_semaphore(semaphore, None) };
        }
        self.note_completed(&state);
    }
}

impl Device {
    /// Submits a recorded command buffer. If it was submitted before, waits for that to be done first.
    ///
    /// # Errors
    /// [`Error::Misuse`] if it is not recorded; a lost device; running out of memory.
    pub fn submit(&self, cmd: &CommandBuffer) -> Result<Ticket> {
        self.submit_with(cmd, &SubmitOptions::default())
    }

    /// As [`Device::submit`], with waits before and signals after.
    ///
    /// # Errors
    /// As [`Device::submit`].
    pub fn submit_with(&self, cmd: &CommandBuffer, around: &SubmitOptions) -> Result<Ticket> {
        let doing = || format!("submitting '{}'", cmd.name());
        submitted_by(around.parts, &|| cmd.submitted_by(|sync| self.submit_raw((&[cmd.raw], sync), around, doing)))
    }

    /// Has the queue wait for a semaphore that something signals, so that it can be signalled again. It takes no command buffer, and the API of Vulkan 1.0.
    ///
    /// # Errors
    /// A lost device; running out of memory.
    pub fn consume(&self, signalled: vk::Semaphore) -> Result<Ticket> {
        let waits = &[(signalled, vk::PipelineStageFlags2::ALL_COMMANDS)];
        let around = SubmitOptions { waits, ..SubmitOptions::default() };
        self.submit_raw((&[], SyncVersion::One), &around, || "waiting for a semaphore".into())
    }

    fn submit_raw(
        &self,
        (commands, sync): (&[vk::CommandBuffer], SyncVersion),
        around: &SubmitOptions,
        doing: impl Fn() -> String,
    ) -> Result<Ticket> {
        let ends_frame = around.ends_frame;
        let image = ends_frame.as_slice();
        let mut boundary = vk::FrameBoundaryEXT::default().flags(vk::FrameBoundaryFlagsEXT::FRAME_END).images(image);
        let mut state = self.submissions.lock();
        let batches = self.batches(&mut state, around)?;
        let fence = match state.free.pop() {
            Some(fence) => fence,
            // SAFETY: the device is alive.
            None => unsafe { self.raw.create_fence(&vk::FenceCreateInfo::default(), None) }
                .doing("vkCreateFence", &doing)?,
        };
        // Counted before it is made: an owner that another thread drops meanwhile then waits for it.
        let serial = self.submissions.submitted.fetch_add(1, Ordering::AcqRel) + 1;
        boundary.frame_id = serial;
        let boundary = (self.features.frame_boundary && ends_frame.is_some()).then_some(&mut boundary);
        let (raws, last) = batches;
        let none = vk::Fence::null();
        let mut submitted = Ok(());
        for (part, (queue, waits, signals)) in around.parts.iter().zip(raws) {
            let commands = &[part.cmd.raw];
            submitted = submitted
                .and_then(|()| self.submit_batch(sync, Batch { queue, commands, waits, signals, fence: none }, None));
        }
        let (queue, waits, signals) = last;
        let submitted = submitted
            .and_then(|()| self.submit_batch(sync, Batch { queue, commands, waits, signals, fence }, boundary));
        match submitted {
            Ok(()) => {
                state.pending.push_back((serial, Arc::new(fence)));
                Ok(Ticket(serial))
            }
            Err(result) => {
                let command = match sync {
                    SyncVersion::One => "vkQueueSubmit",
                    SyncVersion::Two => "vkQueueSubmit2",
                };
                if !around.parts.is_empty() {
                    // Parts before the one that failed may be under way, and no fence stands for them. They wait for nothing that was not submitted.
                    // SAFETY: the device is alive, and its queues are not used meanwhile, as that needs the lock.
                    let idle = || unsafe { self.raw.device_wait_idle() }.doing("vkDeviceWaitIdle", &doing);
                    if !settled(idle, || thread::sleep(PAUSE)) {
                        // What they use stays: this submission never counts as done.
                        state.pending.push_back((serial, Arc::new(fence)));
                        return Err(Error::vulkan(command, doing(), result));
                    }
                }
                state.free.push(fence);
                self.submissions.note_completed(&state);
                Err(Error::vulkan(command, doing(), result))
            }
        }
    }

    /// The queue of each part and of the work itself, with the semaphores before and after it. A part that another one waits for signals the count of its queue.
    fn batches(&self, state: &mut QueueState, around: &SubmitOptions) -> Result<(Vec<QueueBatch>, QueueBatch)> {
        let waited: Vec<PartWait> = around.parts.iter().filter_map(|part| part.after).chain(around.after).collect();
        let mut counts: Vec<Option<Point>> = Vec::new();
        let mut of_parts = Vec::new();
        let wait = |counts: &[Option<Point>], after: Option<PartWait>| -> Result<Vec<Point>> {
            let Some((index, stage)) = after else { return Ok(Vec::new()) };
            let lacks = || Error::Misuse(format!("part {index}, which is waited for, is not submitted before"));
            let count = counts.get(index).ok_or_else(lacks)?;
            Ok(count.map(|count| Point { stage, ..count }).into_iter().collect())
        };
        for (index, part) in around.parts.iter().enumerate() {
            let lacks = || Error::Misuse(format!("'{}' is for a queue that is not open", part.cmd.name()));
            let queue = state.queues[part.cmd.queue.index()].as_mut().ok_or_else(lacks)?;
            let count = waited.iter().any(|(own, _)| *own == index).then(|| queue.next()).flatten();
            of_parts.push((queue.raw, wait(&counts, part.after)?, count.into_iter().collect()));
            counts.push(count);
        }
        let binary = |&(semaphore, stage): &(_, _)| Point { semaphore, value: None, stage };
        let mut waits: Vec<_> = around.waits.iter().map(binary).collect();
        waits.extend(wait(&counts, around.after)?);
        let signals = around.signals.iter().map(|&semaphore| Point { semaphore, value: None, stage: ALL }).collect();
        Ok((of_parts, (state.queue(), waits, signals)))
    }

    fn submit_batch(
        &self,
        sync: SyncVersion,
        batch: Batch<'_>,
        boundary: Option<&mut vk::FrameBoundaryEXT<'_>>,
    ) -> ash::prelude::VkResult<()> {
        match sync {
            SyncVersion::One => self.queue_submit(&batch, boundary),
            SyncVersion::Two => self.queue_submit2(&batch, boundary),
        }
    }

    /// The queue is used by one thread at a time, under the lock that the caller holds. The fence is not signalled.
    fn queue_submit(
        &self,
        batch: &Batch<'_>,
        boundary: Option<&mut vk::FrameBoundaryEXT<'_>>,
    ) -> ash::prelude::VkResult<()> {
        let semaphores = |points: &[Point]| points.iter().map(|own| own.semaphore).collect::<Vec<_>>();
        let values = |points: &[Point]| points.iter().map(|own| own.value.unwrap_or_default()).collect::<Vec<_>>();
        let stage = |own: &Point| Use::new(own.stage, vk::AccessFlags2::empty()).masks().0;
        let (waits, signals) = (semaphores(&batch.waits), semaphores(&batch.signals));
        let stages: Vec<_> = batch.waits.iter().map(stage).collect();
        // Values of semaphores that do not count are ignored.
        let (waited, signalled) = (values(&batch.waits), values(&batch.signals));
        let mut counts = vk::TimelineSemaphoreSubmitInfo::default()
            .wait_semaphore_values(&waited)
            .signal_semaphore_values(&signalled);
        let mut info = vk::SubmitInfo::default().command_buffers(batch.commands);
        // The address of an empty list is not null, and best practices want it to be.
        if !waits.is_empty() {
            info = info.wait_semaphores(&waits).wait_dst_stage_mask(&stages);
        }
        if !signals.is_empty() {
            info = info.signal_semaphores(&signals);
        }
        if batch.waits.iter().chain(&batch.signals).any(|own| own.value.is_some()) {
            info = info.push_next(&mut counts);
        }
        if let Some(boundary) = boundary {
            info = info.push_next(boundary);
        }
        // SAFETY: the command buffers are recorded and not pending (`submitted_by`), and the caller's promise.
        unsafe { self.raw.queue_submit(batch.queue, &[info], batch.fence) }
    }

    /// Submits by synchronization2, where each semaphore has its stages.
    fn queue_submit2(
        &self,
        batch: &Batch<'_>,
        boundary: Option<&mut vk::FrameBoundaryEXT<'_>>,
    ) -> ash::prelude::VkResult<()> {
        let commands: Vec<_> =
            batch.commands.iter().map(|&own| vk::CommandBufferSubmitInfo::default().command_buffer(own)).collect();
        let point = |own: &Point| {
            let info = vk::SemaphoreSubmitInfo::default().semaphore(own.semaphore).stage_mask(own.stage);
            info.value(own.value.unwrap_or_default())
        };
        let waits: Vec<_> = batch.waits.iter().map(point).collect();
        let signals: Vec<_> = batch.signals.iter().map(point).collect();
        let mut info = vk::SubmitInfo2::default()
            .command_buffer_infos(&commands)
            .wait_semaphore_infos(&waits)
            .signal_semaphore_infos(&signals);
        if let Some(boundary) = boundary {
            info = info.push_next(boundary);
        }
        // SAFETY: as above.
        unsafe { self.raw.queue_submit2(batch.queue, &[info], batch.fence) }
    }

    /// Waits until a submission is done. Commands of later submissions that must see its writes, and the CPU that reads
    /// them, need their own barriers in it.
    ///
    /// # Errors
    /// A lost device; [`Error::Misuse`] for a ticket that this device did not give out.
    pub fn wait(&self, ticket: Ticket) -> Result<()> {
        if ticket.0 > self.submissions.submitted() {
            return Err(Error::Misuse(format!("waiting for submission {}, which was never made", ticket.0)));
        }
        if ticket.0 > self.submissions.completed() {
            let at_least = |&&(serial, _): &&(u64, Arc<vk::Fence>)| serial >= ticket.0;
            let fence = self.submissions.lock().pending.iter().find(at_least).map(|(_, fence)| Arc::clone(fence));
            if let Some(fence) = fence {
                // Not under the lock, so that other threads submit and collect meanwhile. No time limit of our own: a driver ends a hang
                // by losing the device, and a software one is slow.
                // SAFETY: the fence is alive and was submitted; nobody resets or destroys it while it is held.
                unsafe { self.raw.wait_for_fences(&[*fence], true, u64::MAX) }
                    .doing("vkWaitForFences", || "waiting for the GPU")?;
            }
            self.submissions.poll(&self.raw, &mut self.submissions.lock(), ticket.0)?;
        }
        self.destroy_done();
        Ok(())
    }

    /// Returns true if a submission is done.
    ///
    /// # Errors
    /// A lost device.
    pub fn is_done(&self, ticket: Ticket) -> Result<bool> {
        if ticket.0 > self.submissions.completed() {
            self.submissions.poll(&self.raw, &mut self.submissions.lock(), ticket.0)?;
        }
        Ok(ticket.0 <= self.submissions.completed())
    }

    /// Destroys the retired objects that are no longer in use. Cheap; for once a frame.
    pub fn collect(&self) {
        let Some(last_use) = self.last_retired_use() else { return };
        // A failure here means a lost device: the next submission or wait says so, and then nothing more is destroyed
        // before the device is.
        if self.submissions.poll(&self.raw, &mut self.submissions.lock(), last_use).is_ok() {
            self.destroy_done();
        }
    }

    /// Waits until nothing is under way, and destroys all retired objects, and the pipelines that are kept for reuse: later work finds the device as
    /// it was.
    ///
    /// # Errors
    /// A lost device; running out of memory.
    pub fn wait_idle(&self) -> Result<()> {
        self.give_up_kept();
        self.wait_for_all()
    }

    fn wait_for_all(&self) -> Result<()> {
        {
            let mut state = self.submissions.lock();
            // SAFETY: the device is alive, and its queues are not used meanwhile, as that needs the lock.
            unsafe { self.raw.device_wait_idle() }.doing("vkDeviceWaitIdle", || "waiting for the GPU to be idle")?;
            self.submissions.poll(&self.raw, &mut state, u64::MAX)?;
        }
        self.destroy_done();
        Ok(())
    }

    /// Waits until nothing is under way before objects are destroyed that no ticket stands for. False where the driver
    /// could not wait, for lack of memory: then they have to stay, as something may use them.
    pub(super) fn settle(&self) -> bool {
        settled(|| self.wait_for_all(), || thread::sleep(PAUSE))
    }

    /// Lets something use the queue that this module does not wrap, such as presenting, while nobody else does. It must not
    /// submit or wait through this device: that needs the queue too, and would wait forever.
    #[cfg(feature = "present")]
    pub(crate) fn with_queue<R>(&self, use_queue: impl FnOnce(vk::Queue) -> R) -> R {
        use_queue(self.submissions.lock().queue())
    }
}

/// The pause between tries to wait where memory is short.
const PAUSE: Duration = Duration::from_millis(20);

/// Returns true if everything may be destroyed after a wait, which is tried again for a while where memory was short.
fn settled(mut wait: impl FnMut() -> Result<()>, mut pause: impl FnMut()) -> bool {
    const TRIES: usize = 50;
    for _ in 0..TRIES {
        match wait() {
            Err(Error::OutOfMemory { .. }) => pause(),
            // Any other failure means a lost device, which uses nothing any more.
            _ => return true,
        }
    }
    false
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wait_that_lacks_memory_is_tried_again_and_in_the_end_nothing_is_destroyed() {
        let after = |failures: usize, last: Option<vk::Result>| {
            let (mut waits, mut pauses) = (0, 0);
            let wait = || {
                waits += 1;
                match waits {
                    wait if wait <= failures => {
                        Err(Error::vulkan("vkDeviceWaitIdle", "waiting", vk::Result::ERROR_OUT_OF_HOST_MEMORY))
                    }
                    _ => last.map_or(Ok(()), |last| Err(Error::vulkan("vkDeviceWaitIdle", "waiting", last))),
                }
            };
            (settled(wait, || pauses += 1), pauses)
        };
        assert_eq!(after(0, None), (true, 0));
        assert_eq!(after(3, None), (true, 3), "once there is memory again");
        assert_eq!(after(0, Some(vk::Result::ERROR_DEVICE_LOST)), (true, 0), "a lost device uses nothing");
        assert_eq!(after(usize::MAX, None), (false, 50));
    }
}
