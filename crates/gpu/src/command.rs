//! Command buffers, each with its own pool: one thread records them, and records them anew once the GPU is done.

use std::collections::HashSet;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, RwLock};

use ash::vk;

use super::device::Device;
use super::error::{Doing, Error, Result};
use super::owned::Owned;
use super::queues::Queue;
use super::submission::Ticket;
use super::sync::SyncVersion;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Phase {
    /// Nothing is recorded.
    Empty,
    Recording,
    /// Recorded, and possibly submitted.
    Recorded,
}

#[derive(Clone, Copy, Debug)]
struct RecordingState {
    phase: Phase,
    /// The API that the recording and its submissions use.
    sync: SyncVersion,
    last: Option<Ticket>,
}

/// A primary command buffer and its command pool, for one of the device's queues.
///
/// Objects whose commands are recorded into it must be alive when it is submitted; from then on dropping them is safe.
pub struct CommandBuffer {
    /// The handle, to record with between [`begin`](CommandBuffer::begin) and [`end`](CommandBuffer::end).
    pub raw: vk::CommandBuffer,
    pool: Owned<vk::CommandPool>,
    /// The queue that it can be submitted to.
    pub queue: Queue,
    state: Mutex<RecordingState>,
}

impl CommandBuffer {
    /// An empty command buffer.
    ///
    /// # Errors
    /// Running out of memory.
    pub fn new(device: &Arc<Device>, name: &str) -> Result<CommandBuffer> {
        Self::on(device, Queue::Graphics, name)
    }

    /// An empty command buffer for this queue.
    ///
    /// # Errors
    /// [`Error::Unsupported`] on a device without that queue; running out of memory.
    pub fn on(device: &Arc<Device>, queue: Queue, name: &str) -> Result<CommandBuffer> {
        let doing = || format!("creating the command buffer '{name}'");
        let family = device.family_of(queue)?;
        // It is reset as a whole, through its pool, each time that it is recorded.
        let info = vk::CommandPoolCreateInfo::default()
            .flags(vk::CommandPoolCreateFlags::TRANSIENT)
            .queue_family_index(family);
        // SAFETY: the device is alive and has this queue family.
        let pool = unsafe { device.raw.create_command_pool(&info, None) }.doing("vkCreateCommandPool", doing)?;
        let pool = Owned::new_from(device, name, pool);
        let info = vk::CommandBufferAllocateInfo::default()
            .command_pool(pool.raw)
            .level(vk::CommandBufferLevel::PRIMARY)
            .command_buffer_count(1);
        // SAFETY: the pool is new and used by nobody else.
        let buffers = unsafe { device.raw.allocate_command_buffers(&info) }.doing("vkAllocateCommandBuffers", doing)?;
        let Some(&raw) = buffers.first() else {
            return Err(Error::vulkan("vkAllocateCommandBuffers", doing(), vk::Result::ERROR_UNKNOWN));
        };
        device.name_object(raw, name);
        let state = RecordingState { phase: Phase::Empty, sync: SyncVersion::One, last: None };
        Ok(CommandBuffer { raw, pool, queue, state: Mutex::new(state) })
    }

    /// Starts recording by the API of Vulkan 1.0, from nothing. If it was submitted, waits for that to be done first.
    ///
    /// # Errors
    /// A lost device; running out of memory; [`Error::Misuse`] if it is being recorded already.
    pub fn begin(&mut self) -> Result<()> {
        self.begin_by(SyncVersion::One)
    }

    /// As [`CommandBuffer::begin`], with barriers, render passes and times by this API, and submissions as well. Other recordings on the device keep their own:
    /// Vulkan lets a program mix the two.
    ///
    /// # Errors
    /// As [`CommandBuffer::begin`], and [`Error::Unsupported`] for an API that the device lacks.
    pub fn begin_by(&mut self, sync: SyncVersion) -> Result<()> {
        let doing = || format!("beginning to record '{}'", self.pool.name());
        let device = self.pool.device();
        device.check_sync(sync)?;
        let mut state = self.lock();
        if state.phase == Phase::Recording {
            return Err(Error::Misuse(format!("'{}' is being recorded already", self.pool.name())));
        }
        if let Some(last) = state.last {
            device.wait(last)?;
            state.last = None;
        }
        state.phase = Phase::Empty;
        // SAFETY: no submission uses the pool's only command buffer any more, and `self` is borrowed exclusively.
        unsafe { device.raw.reset_command_pool(self.pool.raw, vk::CommandPoolResetFlags::empty()) }
            .doing("vkResetCommandPool", doing)?;
        // SAFETY: the command buffer has just been reset.
        unsafe { device.raw.begin_command_buffer(self.raw, &vk::CommandBufferBeginInfo::default()) }
            .doing("vkBeginCommandBuffer", doing)?;
        (state.phase, state.sync) = (Phase::Recording, sync);
        device.recorded_by_2.note(self.raw, sync);
        Ok(())
    }

    /// Ends recording. The recording can then be submitted, more than once if need be.
    ///
    /// # Errors
    /// Running out of memory, possibly while it was recorded; [`Error::Misuse`] if it is not being recorded.
    pub fn end(&mut self) -> Result<()> {
        let mut state = self.lock();
        if state.phase != Phase::Recording {
            return Err(Error::Misuse(format!("'{}' is not being recorded", self.pool.name())));
        }
        // A failure leaves an invalid command buffer, which only a reset brings back.
        state.phase = Phase::Empty;
        // SAFETY: it is in the recording state, and `self` is borrowed exclusively.
        unsafe { self.pool.device().raw.end_command_buffer(self.raw) }
            .doing("vkEndCommandBuffer", || format!("recording '{}'", self.pool.name()))?;
        state.phase = Phase::Recorded;
        Ok(())
    }

    /// Drops an unfinished recording, if there is one, so that another can begin.
    pub fn abandon(&mut self) {
        let mut state = self.lock();
        if state.phase == Phase::Recording {
            // The next recording begins with a reset of the pool.
            state.phase = Phase::Empty;
        }
    }

    /// The last submission, if it was submitted since it was recorded.
    pub fn last_ticket(&self) -> Option<Ticket> {
        self.lock().last
    }

    /// The name.
    pub fn name(&self) -> &str {
        self.pool.name()
    }

    /// Runs `submit` with the recording's API when the recording is whole and not under way, and keeps its ticket.
    pub(super) fn submitted_by(&self, submit: impl FnOnce(SyncVersion) -> Result<Ticket>) -> Result<Ticket> {
        let mut state = self.lock();
        if state.phase != Phase::Recorded {
            return Err(Error::Misuse(format!("'{}' is submitted, but not recorded", self.pool.name())));
        }
        if let Some(last) = state.last {
            self.pool.device().wait(last)?;
        }
        let ticket = submit(state.sync)?;
        state.last = Some(ticket);
        Ok(ticket)
    }

    fn lock(&self) -> MutexGuard<'_, RecordingState> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Drop for CommandBuffer {
    fn drop(&mut self) {
        self.pool.device().recorded_by_2.note(self.raw, SyncVersion::One);
    }
}

/// The command buffers whose recordings use synchronization2: all others use the API of Vulkan 1.0.
///
/// Passes and barriers know the handle that they record into, and several renderers of one device record at the same time, each by its own plan's API.
#[derive(Default)]
pub(super) struct RecordedBy2(RwLock<HashSet<vk::CommandBuffer>>);

impl RecordedBy2 {
    fn note(&self, cmd: vk::CommandBuffer, sync: SyncVersion) {
        let mut all = self.0.write().unwrap_or_else(PoisonError::into_inner);
        match sync {
            SyncVersion::One => all.remove(&cmd),
            SyncVersion::Two => all.insert(cmd),
        };
    }
}

impl Device {
    /// The API of this command buffer's recording.
    pub(super) fn sync_of(&self, cmd: vk::CommandBuffer) -> SyncVersion {
        match self.recorded_by_2.0.read().unwrap_or_else(PoisonError::into_inner).contains(&cmd) {
            true => SyncVersion::Two,
            false => SyncVersion::One,
        }
    }

    /// Refuses an API that the device lacks, so that none of its functions is called.
    pub(super) fn check_sync(&self, sync: SyncVersion) -> Result<()> {
        let lacks = |extension: &str| Err(Error::Unsupported(format!("'{}' lacks {extension}", self.physical.name)));
        match sync {
            SyncVersion::Two if !self.features.synchronization2 => lacks("VK_KHR_synchronization2"),
            SyncVersion::Two if !self.features.render_pass2 => lacks("VK_KHR_create_renderpass2"),
            _ => Ok(()),
        }
    }
}
