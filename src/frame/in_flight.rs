//! What one frame in flight owns: its command buffers, the buffers that the CPU writes for it, and its times.

use std::time::Instant;

use ash::vk;

use super::{DrawCounts, Error, FrameTimes};
use crate::gpu::{self, CommandBuffer, Device, Ticket, Timestamps};
use crate::gpu_scene::{Instances, SortedIndices, ViewBuffers};

/// The resources of one frame in flight.
pub(super) struct InFlight {
    pub(super) cmd: CommandBuffer,
    /// The parts of the frame before it, where several queues share its work.
    pub(super) before: Vec<CommandBuffer>,
    /// Times of another queue.
    pub(super) beside: Option<Timestamps>,
    pub(super) view: ViewBuffers,
    pub(super) sorted: Option<SortedIndices>,
    pub(super) instances: Instances,
    pub(super) times: Option<Timestamps>,
    pub(super) ticket: Option<Ticket>,
    pub(super) begun: Instant,
    pub(super) record_ms: f64,
    pub(super) submit_ms: f64,
    pub(super) drawn: DrawCounts,
}

impl InFlight {
    /// Begins or ends all recordings of the frame. If one fails, none of them stays open: the next frame in its place begins anew.
    pub(super) fn each_recording(
        &mut self,
        mut act: impl FnMut(&mut CommandBuffer) -> gpu::Result<()>,
    ) -> gpu::Result<()> {
        let Self { cmd, before, .. } = self;
        let done = before.iter_mut().chain([&mut *cmd]).try_for_each(&mut act);
        if done.is_err() {
            before.iter_mut().chain([cmd]).for_each(CommandBuffer::abandon);
        }
        done
    }

    /// The times of a completed frame; `wall_ms` is 0, as only a waiting caller knows it.
    pub(super) fn times(&self, device: &Device, found: Option<usize>) -> Result<FrameTimes, Error> {
        let stamps = match &self.times {
            Some(times) => times.read()?,
            None => Vec::new(),
        };
        let on_cpu = device.physical.kind == vk::PhysicalDeviceType::CPU;
        let beside = match &self.beside {
            Some(times) => times.read()?,
            None => Vec::new(),
        };
        let between = |pair: &[(String, f64)]| (pair[1].0.clone(), pair[1].1 - pair[0].1);
        let passes = stamps.windows(2).chain(beside.windows(2)).map(between);
        Ok(FrameTimes {
            record_ms: self.record_ms,
            submit_ms: self.submit_ms,
            wall_ms: 0.0,
            gpu_ms: stamps.last().map(|(_, ms)| *ms),
            passes: if on_cpu { Vec::new() } else { passes.collect() },
            drawn: DrawCounts { found, ..self.drawn },
        })
    }
}
