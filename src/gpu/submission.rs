//! Submissions to the one queue, and knowing when each is done.

use std::collections::VecDeque;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

use ash::vk;

use super::command::CommandBuffer;
use super::device::Device;
use super::error::{Doing, Error, Result};

/// The number of a submission of one device: the first is 1. A higher one is done no earlier than a lower one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Ticket(pub u64);

/// The queue, and a fence for each submission that is not known to be done.
///
/// Fences suffice for order: one signals only when every earlier submission to the queue is done too (Vulkan 1.3,
/// section 7.3, "Fence signal operations").
pub(super) struct Submissions {
    submitted: AtomicU64,
    completed: AtomicU64,
    state: Mutex<State>,
}

struct State {
    queue: vk::Queue,
    pending: VecDeque<(u64, vk::Fence)>,
    free: Vec<vk::Fence>,
}

impl Submissions {
    pub(super) fn new(queue: vk::Queue) -> Submissions {
        let state = State { queue, pending: VecDeque::new(), free: Vec::new() };
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

    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Takes note of the fences that have signalled, up to that of submission `last`. What nobody wants to know is not asked: a
    /// layer takes an answer for a wait, and would then see no hazard with what is done (`tests/sync/necessity.rs`).
    fn poll(&self, device: &ash::Device, state: &mut State, last: u64) -> Result<()> {
        while let Some(&(serial, fence)) = state.pending.front()
            && serial <= last
        {
            // SAFETY: the fence belongs to this device and is alive.
            if !unsafe { device.get_fence_status(fence) }.doing(|| "asking whether the GPU is done")? {
                break;
            }
            state.pending.pop_front();
            // SAFETY: as above; its submission is done, so the queue no longer uses it.
            unsafe { device.reset_fences(&[fence]) }.doing(|| "resetting a fence")?;
            state.free.push(fence);
        }
        self.note_completed(state);
        Ok(())
    }

    fn note_completed(&self, state: &State) {
        let completed = state.pending.front().map_or(self.submitted(), |&(serial, _)| serial - 1);
        self.completed.store(completed, Ordering::Release);
    }

    /// Destroys all fences. The device must be idle or lost.
    pub(super) fn destroy(&self, device: &ash::Device) {
        let mut state = self.lock();
        let pending = std::mem::take(&mut state.pending).into_iter().map(|(_, fence)| fence);
        for fence in pending.chain(std::mem::take(&mut state.free)) {
            // SAFETY: the fence belongs to this device, and no submission is under way.
            unsafe { device.destroy_fence(fence, None) };
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
        self.submit_with(cmd, &[], &[])
    }

    /// As [`Device::submit`], waiting for semaphores before the given stages, and signalling others when done.
    ///
    /// # Errors
    /// As [`Device::submit`].
    pub fn submit_with(
        &self,
        cmd: &CommandBuffer,
        waits: &[(vk::Semaphore, vk::PipelineStageFlags)],
        signals: &[vk::Semaphore],
    ) -> Result<Ticket> {
        cmd.submitted_by(|| self.submit_raw(cmd, waits, signals))
    }

    fn submit_raw(
        &self,
        cmd: &CommandBuffer,
        waits: &[(vk::Semaphore, vk::PipelineStageFlags)],
        signals: &[vk::Semaphore],
    ) -> Result<Ticket> {
        let doing = || format!("submitting '{}'", cmd.name());
        let (semaphores, stages): (Vec<_>, Vec<_>) = waits.iter().copied().unzip();
        let buffers = [cmd.raw];
        let mut info = vk::SubmitInfo::default().command_buffers(&buffers);
        // The address of an empty list is not null, and best practices want it to be.
        if !waits.is_empty() {
            info = info.wait_semaphores(&semaphores).wait_dst_stage_mask(&stages);
        }
        if !signals.is_empty() {
            info = info.signal_semaphores(signals);
        }
        let mut state = self.submissions.lock();
        let fence = match state.free.pop() {
            Some(fence) => fence,
            // SAFETY: the device is alive.
            None => unsafe { self.raw.create_fence(&vk::FenceCreateInfo::default(), None) }.doing(doing)?,
        };
        // Counted before it is made: an owner that another thread drops meanwhile then waits for it.
        let serial = self.submissions.submitted.fetch_add(1, Ordering::AcqRel) + 1;
        // SAFETY: the command buffer is recorded and not pending (`submitted_by`), the fence is unsignalled, and the
        // queue is used by one thread at a time, under the lock.
        let submitted = unsafe { self.raw.queue_submit(state.queue, &[info], fence) };
        match submitted {
            Ok(()) => {
                state.pending.push_back((serial, fence));
                Ok(Ticket(serial))
            }
            Err(result) => {
                state.free.push(fence);
                self.submissions.note_completed(&state);
                Err(Error::vulkan(doing(), result))
            }
        }
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
            let mut state = self.submissions.lock();
            let fence = state.pending.iter().find(|&&(serial, _)| serial >= ticket.0).map(|&(_, fence)| fence);
            if let Some(fence) = fence {
                // No time limit of our own: a driver ends a hang by losing the device, and a software one is slow.
                // SAFETY: the fence is alive and pending; the lock keeps others from resetting it.
                unsafe { self.raw.wait_for_fences(&[fence], true, u64::MAX) }.doing(|| "waiting for the GPU")?;
            }
            self.submissions.poll(&self.raw, &mut state, ticket.0)?;
        }
        self.destroy_done();
        Ok(())
    }

    /// Whether a submission is done.
    ///
    /// # Errors
    /// A lost device.
    pub fn is_done(&self, ticket: Ticket) -> Result<bool> {
        if ticket.0 > self.submissions.completed() {
            self.submissions.poll(&self.raw, &mut self.submissions.lock(), ticket.0)?;
        }
        Ok(ticket.0 <= self.submissions.completed())
    }

    /// Destroys what is retired and no longer in use. Cheap; for once a frame.
    pub fn collect(&self) {
        let Some(last_use) = self.last_retired_use() else { return };
        // A failure here means a lost device: the next submission or wait says so, and then nothing more is destroyed
        // before the device is.
        if self.submissions.poll(&self.raw, &mut self.submissions.lock(), last_use).is_ok() {
            self.destroy_done();
        }
    }

    /// Waits until nothing is under way, and destroys everything retired.
    ///
    /// # Errors
    /// A lost device.
    pub fn wait_idle(&self) -> Result<()> {
        {
            let mut state = self.submissions.lock();
            // SAFETY: the device is alive, and its only queue is not used meanwhile, as that needs the lock.
            unsafe { self.raw.device_wait_idle() }.doing(|| "waiting for the GPU to be idle")?;
            self.submissions.poll(&self.raw, &mut state, u64::MAX)?;
        }
        self.destroy_done();
        Ok(())
    }

    /// Lets something use the queue that this module does not wrap, such as presenting, while nobody else does. It must not
    /// submit or wait through this device: that needs the queue too, and would wait forever.
    pub fn with_queue<R>(&self, use_queue: impl FnOnce(vk::Queue) -> R) -> R {
        use_queue(self.submissions.lock().queue)
    }
}
