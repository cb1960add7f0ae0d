//! The queues of a device: one for everything, and where the device has them one for compute alone and one for copies alone.
//!
//! A buffer or image that is not `CONCURRENT` belongs to one queue family at a time. A release on the one queue and an acquire on the other give it to another family
//! (specification, "Queue Family Ownership Transfer"). Each queue signals a timeline semaphore, whose values other queues wait for.

use ash::vk;

use super::device::Device;
use super::error::{Error, Result};
use super::lack::{Lack, Support};
use super::physical::PhysicalDevice;

/// A queue of a device.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Queue {
    /// The one that does everything.
    #[default]
    Graphics,
    /// One that draws nothing, so that its work can run beside a frame's draws.
    Compute,
    /// One that only copies.
    Transfer,
}

impl Queue {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Graphics, Self::Compute, Self::Transfer];

    /// The index of this queue in [`Queue::ALL`].
    pub(super) const fn index(self) -> usize {
        self as usize
    }

    /// What it does.
    const fn work(self) -> &'static str {
        match self {
            Self::Graphics => "graphics",
            Self::Compute => "compute",
            Self::Transfer => "copies",
        }
    }

    /// The name of the device's queue.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Graphics => "queue",
            Self::Compute => "compute queue",
            Self::Transfer => "transfer queue",
        }
    }
}

/// The families of a device's queues.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct QueueFamilies {
    /// The first that computes and does not draw.
    pub compute: Option<u32>,
    /// The bits of that family's timestamps that are valid; 0: it writes none.
    pub compute_timestamp_bits: u32,
    /// The first that only copies, and copies regions of any size.
    pub transfer: Option<u32>,
}

impl QueueFamilies {
    pub(super) fn of(families: &[vk::QueueFamilyProperties]) -> Self {
        let draws = vk::QueueFlags::GRAPHICS;
        let find = |is_wanted: &dyn Fn(&vk::QueueFamilyProperties) -> bool| {
            let index = families.iter().position(|own| own.queue_count > 0 && is_wanted(own));
            index.and_then(|index| u32::try_from(index).ok())
        };
        let compute =
            find(&|own| own.queue_flags.contains(vk::QueueFlags::COMPUTE) && !own.queue_flags.intersects(draws));
        let any_region = vk::Extent3D { width: 1, height: 1, depth: 1 };
        let copies = |own: &vk::QueueFamilyProperties| {
            own.queue_flags.contains(vk::QueueFlags::TRANSFER)
                && !own.queue_flags.intersects(draws | vk::QueueFlags::COMPUTE)
                && own.min_image_transfer_granularity == any_region
        };
        let bits = compute.and_then(|index| families.get(index as usize)).map_or(0, |own| own.timestamp_valid_bits);
        Self { compute, compute_timestamp_bits: bits, transfer: find(&copies) }
    }
}

impl PhysicalDevice {
    /// The family of a queue, where the device has both.
    pub fn family_of(&self, queue: Queue) -> Option<u32> {
        self.queue_support(queue).ok().and_then(|()| self.listed_family(queue))
    }

    /// What the device lacks for a queue. Queues beside the graphics queue need timeline semaphores.
    pub fn queue_support(&self, queue: Queue) -> Support {
        match (self.listed_family(queue), queue) {
            (None, own) => Err(Lack::Family(own.work())),
            (Some(_), Queue::Graphics) => Ok(()),
            (Some(_), _) => self.newer.timeline_semaphore,
        }
    }

    fn listed_family(&self, queue: Queue) -> Option<u32> {
        match queue {
            Queue::Graphics => self.queue_family,
            Queue::Compute => self.families.compute,
            Queue::Transfer => self.families.transfer,
        }
    }
}

impl Device {
    /// The family of a queue.
    ///
    /// # Errors
    /// [`Error::Unsupported`] on a device without that queue.
    pub(super) fn family_of(&self, queue: Queue) -> Result<u32> {
        let lacks = || Error::Unsupported(format!("'{}' has no {}", self.physical.name, queue.name()));
        self.physical.family_of(queue).ok_or_else(lacks)
    }

    /// The families of all queues, for objects that they share.
    pub(super) fn all_families(&self) -> Vec<u32> {
        Queue::ALL.into_iter().filter_map(|queue| self.physical.family_of(queue)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn family(queue_flags: vk::QueueFlags, edge: u32) -> vk::QueueFamilyProperties {
        let granularity = vk::Extent3D { width: edge, height: edge, depth: edge };
        vk::QueueFamilyProperties {
            queue_flags,
            queue_count: 1,
            timestamp_valid_bits: 40,
            min_image_transfer_granularity: granularity,
        }
    }

    #[test]
    fn queues_beside_the_first_neither_draw_nor_copy_whole_images_only() {
        use vk::QueueFlags as Q;
        let all = family(Q::GRAPHICS | Q::COMPUTE | Q::TRANSFER, 1);
        let alone = QueueFamilies::of(&[all]);
        assert_eq!(alone, QueueFamilies::default());
        let coarse = family(Q::TRANSFER, 16);
        let of = QueueFamilies::of(&[all, coarse, family(Q::TRANSFER, 1), family(Q::COMPUTE | Q::TRANSFER, 1)]);
        assert_eq!((of.compute, of.compute_timestamp_bits, of.transfer), (Some(3), 40, Some(2)));
        assert_eq!(QueueFamilies::of(&[all, coarse]).transfer, None);
    }
}
