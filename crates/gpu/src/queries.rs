//! GPU timestamps.

use std::sync::Arc;

use ash::vk;

use super::device::Device;
use super::error::{Doing, Error, Result};
use super::owned::Owned;
use super::queues::Queue;
use super::sync::{SyncVersion, Use};

/// A row of labelled points in time, written by one command buffer.
///
/// On software drivers the points within a render pass tell little: they shade when they like.
pub struct Timestamps {
    pool: Owned<vk::QueryPool>,
    max: u32,
    labels: Vec<String>,
    valid_bits: u32,
    period_ns: f64,
}

impl Timestamps {
    /// Room for `max` points on a queue, or `None` if it writes no timestamps.
    ///
    /// # Errors
    /// [`Error::Misuse`] for no points at all; running out of memory.
    pub fn new(device: &Arc<Device>, queue: Queue, name: &str, max: u32) -> Result<Option<Timestamps>> {
        let valid_bits = match queue {
            Queue::Graphics => device.physical.timestamp_valid_bits,
            Queue::Compute => device.physical.families.compute_timestamp_bits,
            Queue::Transfer => 0,
        };
        let period_ns = f64::from(device.physical.limits.timestamp_period);
        if valid_bits == 0 || period_ns <= 0.0 {
            return Ok(None);
        }
        if max == 0 {
            return Err(Error::Misuse(format!("the timestamps '{name}' have no points")));
        }
        let info = vk::QueryPoolCreateInfo::default().query_type(vk::QueryType::TIMESTAMP).query_count(max);
        // SAFETY: the device is alive.
        let raw = unsafe { device.raw.create_query_pool(&info, None) }
            .doing("vkCreateQueryPool", || format!("creating the query pool '{name}'"))?;
        let pool = Owned::new_from(device, name, raw);
        Ok(Some(Timestamps { pool, max, labels: Vec::new(), valid_bits, period_ns }))
    }

    /// Forgets all points. It is recorded at the start of a command buffer, outside of render passes.
    pub fn reset(&mut self, cmd: vk::CommandBuffer) {
        self.labels.clear();
        // SAFETY: the command buffer is recording (the module's contract), and the pool is alive.
        unsafe { self.pool.device().raw.cmd_reset_query_pool(cmd, self.pool.raw, 0, self.max) };
    }

    /// Writes the time at which all earlier commands have passed `stage`. Points beyond the room are left out.
    pub fn write(&mut self, cmd: vk::CommandBuffer, stage: vk::PipelineStageFlags2, label: &str) {
        let index = self.labels.len() as u32;
        if index >= self.max {
            return;
        }
        self.labels.push(label.to_owned());
        let device = self.pool.device();
        let raw = &device.raw;
        // SAFETY: as in `reset`; the query has been reset and not been written since.
        unsafe {
            match device.sync_of(cmd) {
                SyncVersion::One => {
                    let stage = Use::new(stage, vk::AccessFlags2::empty()).masks().0;
                    raw.cmd_write_timestamp(cmd, stage, self.pool.raw, index);
                }
                SyncVersion::Two => raw.cmd_write_timestamp2(cmd, stage, self.pool.raw, index),
            }
        }
    }

    /// Writes the time at which all that was recorded so far is done, where times are taken.
    pub fn stamp(times: &mut Option<Self>, cmd: vk::CommandBuffer, label: &str) {
        if let Some(times) = times {
            times.write(cmd, vk::PipelineStageFlags2::BOTTOM_OF_PIPE, label);
        }
    }

    /// The names of all points, in the order in which they were written.
    pub fn labels(&self) -> &[String] {
        &self.labels
    }

    /// The points with their time in milliseconds since the first. The submission must be done.
    ///
    /// # Errors
    /// [`Error::Vulkan`] with `NOT_READY` if it is not done; a lost device.
    pub fn read(&self) -> Result<Vec<(String, f64)>> {
        let mut ticks = vec![0_u64; self.labels.len()];
        if ticks.is_empty() {
            return Ok(Vec::new());
        }
        // SAFETY: the pool is alive and has at least as many queries as labels were given.
        unsafe {
            self.pool.device().raw.get_query_pool_results(self.pool.raw, 0, &mut ticks, vk::QueryResultFlags::TYPE_64)
        }
        .doing("vkGetQueryPoolResults", || format!("reading the timestamps '{}'", self.pool.name()))?;
        let since_first = |&tick: &u64| ticks_between(ticks[0], tick, self.valid_bits) as f64 * self.period_ns * 1e-6;
        Ok(self.labels.iter().cloned().zip(ticks.iter().map(since_first)).collect())
    }
}

/// The ticks from `start` to `end` of a counter of `valid_bits` bits, which may have wrapped once between them.
fn ticks_between(start: u64, end: u64, valid_bits: u32) -> u64 {
    let mask = 1_u64.checked_shl(valid_bits).map_or(u64::MAX, |next| next - 1);
    end.wrapping_sub(start) & mask
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_counter_that_wraps_between_two_points_does_no_harm() {
        assert_eq!(ticks_between(10, 25, 64), 15);
        assert_eq!(ticks_between(u64::MAX - 4, 5, 64), 10);
        assert_eq!(ticks_between((1 << 36) - 4, 6, 36), 10);
        // Bits above the valid ones are undefined.
        assert_eq!(ticks_between(7 | 1 << 40, 9 | 1 << 50, 36), 2);
    }
}
