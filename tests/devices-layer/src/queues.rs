//! Three played queue families: 0 has graphics, as the real family, 1 has compute and transfers, 2 has transfers alone.
//!
//! Each played queue has a distinct handle, and all calls reach one real queue. The real queue runs submissions in the order of the calls, whichever
//! played queue they name. A submission that waits for a timeline value which only a later submission signals therefore waits for ever (wait before
//! signal); a device with three queues would go on.

use std::ptr::NonNull;
use std::sync::{Arc, LazyLock, Mutex, MutexGuard, PoisonError};

use ash::vk;
use ash::vk::Handle;

use super::device::next;
use super::loader::{Dispatched, typed};
use super::shared::{Table, locked};
use super::{DEVICES, NAME};

/// The number of played families. Each has one queue.
pub const FAMILIES: u32 = 3;

/// The played families, of the properties of the real one with graphics.
pub fn played_families(real: &vk::QueueFamilyProperties) -> [vk::QueueFamilyProperties; FAMILIES as usize] {
    let one = vk::QueueFamilyProperties {
        queue_count: 1,
        queue_flags: vk::QueueFlags::TRANSFER,
        timestamp_valid_bits: 0,
        min_image_transfer_granularity: vk::Extent3D { width: 1, height: 1, depth: 1 },
    };
    let computes = vk::QueueFlags::COMPUTE | vk::QueueFlags::TRANSFER;
    [
        // Queues are opened without flags, so none is protected.
        vk::QueueFamilyProperties {
            queue_count: 1,
            queue_flags: real.queue_flags & !vk::QueueFlags::PROTECTED,
            ..*real
        },
        vk::QueueFamilyProperties { queue_flags: computes, timestamp_valid_bits: real.timestamp_valid_bits, ..one },
        one,
    ]
}

/// Returns true for an index of a played family, as opposed to `QUEUE_FAMILY_IGNORED`, `_EXTERNAL` and `_FOREIGN_EXT`.
pub fn is_played(family: u32) -> bool {
    family < FAMILIES
}

/// The queues that a device is opened with.
#[derive(Debug, PartialEq)]
pub struct Opened {
    families: Vec<u32>,
    /// The highest priority of them: the real queue serves all.
    priority: f32,
}

impl Opened {
    /// Reads the structures of a device's creation.
    ///
    /// # Errors
    /// The error says which queue the played device has not.
    ///
    /// # Safety
    /// The structures are as the specification has them.
    pub unsafe fn read(infos: &[vk::DeviceQueueCreateInfo<'_>]) -> Result<Self, String> {
        let mut own = Self { families: Vec::new(), priority: 0.0 };
        for info in infos {
            let family = info.queue_family_index;
            if !is_played(family) {
                return Err(format!("a device is opened with queue family {family}, and there are {FAMILIES}"));
            }
            if info.queue_count != 1 || !info.flags.is_empty() {
                let (count, flags) = (info.queue_count, info.flags.as_raw());
                return Err(format!(
                    "a device is opened with {count} queues of family {family} and flags {flags}: it has one queue, without flags"
                ));
            }
            if own.families.contains(&family) {
                return Err(format!("a device is opened with queue family {family} twice"));
            }
            own.families.push(family);
            // SAFETY: the caller's promise: each queue has a priority.
            own.priority = own.priority.max(unsafe { info.p_queue_priorities.read() });
        }
        Ok(own)
    }

    /// The one structure for the device below: one queue of the real family. It keeps the chain of the program's first structure.
    pub fn below<'a>(&'a self, first: &vk::DeviceQueueCreateInfo<'a>, real: u32) -> vk::DeviceQueueCreateInfo<'a> {
        vk::DeviceQueueCreateInfo {
            queue_family_index: real,
            queue_count: 1,
            p_queue_priorities: &raw const self.priority,
            ..*first
        }
    }
}

/// A played queue that is not the real one, as the loader and the layers above see it: they dispatch by the first word. The loader writes that again
/// when it gives the handle to the program.
#[repr(C)]
struct PlayedQueue {
    dispatch: usize,
}

/// The queues of a device: the real one, and a handle for each played family.
pub struct Queues {
    real: vk::Queue,
    own: Vec<(u32, vk::Queue)>,
    /// Held while a call uses the real queue. Programs synchronize each of their queues by itself, and these are one.
    in_use: Mutex<()>,
}

static QUEUES: Table<Arc<Queues>> = LazyLock::new(Mutex::default);

impl Dispatched for vk::Queue {}

impl Queues {
    fn new(opened: &Opened, real: vk::Queue, dispatch: usize) -> Self {
        let handle = |family: u32| match family {
            0 => real,
            _ => vk::Queue::from_raw(Box::into_raw(Box::new(PlayedQueue { dispatch })) as u64),
        };
        let own = opened.families.iter().map(|&family| (family, handle(family))).collect();
        Self { real, own, in_use: Mutex::default() }
    }

    /// The handle of a played queue. Null, with a line of why, where the device was not opened with it.
    fn of(&self, family: u32, index: u32) -> vk::Queue {
        let found = self.own.iter().find(|(own, _)| (*own, 0) == (family, index)).map(|(_, queue)| *queue);
        found.unwrap_or_else(|| {
            say(&format!("the device was not opened with queue {index} of family {family}"));
            vk::Queue::null()
        })
    }

    /// The real queue in place of a played one. Other handles stay as they are.
    fn below(&self, queue: vk::Queue) -> vk::Queue {
        if self.own.iter().any(|(_, own)| *own == queue) { self.real } else { queue }
    }

    fn held(&self) -> MutexGuard<'_, ()> {
        // The lock guards no data of this layer.
        self.in_use.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Drop for Queues {
    fn drop(&mut self) {
        for (_, queue) in self.own.iter().filter(|(_, queue)| *queue != self.real) {
            // SAFETY: `new` made it of a box; the device is destroyed, and nobody uses its queues any more.
            drop(unsafe { Box::from_raw(queue.as_raw() as *mut PlayedQueue) });
        }
    }
}

/// Prints a fault of the caller on the error output.
pub fn say(why: &str) {
    eprintln!("{}: {why}", NAME.to_string_lossy());
}

/// Remembers the queues of a device that was just created.
///
/// # Safety
/// The device is alive, `get_proc_addr` is of the layer below, and `real` is the family of the one queue that the device below was opened with.
pub unsafe fn remember(device: vk::Device, get_proc_addr: vk::PFN_vkGetDeviceProcAddr, opened: &Opened, real: u32) {
    // SAFETY: the caller's promise; the name has this type.
    let ask: Option<vk::PFN_vkGetDeviceQueue> = unsafe { typed(get_proc_addr(device, c"vkGetDeviceQueue".as_ptr())) };
    // SAFETY: the caller's promise.
    let (Some(ask), Some(key)) = (ask, unsafe { device.key() }) else { return };
    let mut queue = vk::Queue::null();
    // SAFETY: the caller's promise; the place is this function's own.
    unsafe { ask(device, real, 0, &raw mut queue) };
    if let Some(word) = NonNull::new(queue.as_raw() as *mut usize) {
        // SAFETY: the queue was just made, and nobody else has it. The loader writes the device's dispatch word into a queue when the program asks for
        // the queue. A program may never ask for the real one, and layers below dispatch by the word.
        unsafe { word.write(key) };
    }
    locked(&QUEUES).insert(key, Arc::new(Queues::new(opened, queue, key)));
}

/// Forgets the queues of a device by its key. The queues' handles live as long as the returned value.
pub fn forget(key: usize) -> Option<Arc<Queues>> {
    locked(&QUEUES).remove(&key)
}

fn of_device(device: vk::Device) -> Option<Arc<Queues>> {
    // SAFETY: the device is the caller's own, as in all functions of Vulkan.
    let key = unsafe { device.key() }?;
    locked(&QUEUES).get(&key).cloned()
}

pub unsafe extern "system" fn get(device: vk::Device, family: u32, index: u32, place: *mut vk::Queue) {
    if let Some(queues) = of_device(device) {
        // SAFETY: as this function was called.
        unsafe { place.write(queues.of(family, index)) };
    } else {
        // SAFETY: the name has this type.
        let below = unsafe { next::<vk::PFN_vkGetDeviceQueue>(device, c"vkGetDeviceQueue") };
        if let Some((ask, _)) = below {
            // SAFETY: as this function was called.
            unsafe { ask(device, family, index, place) };
        }
    }
}

pub unsafe extern "system" fn get2(device: vk::Device, info: *const vk::DeviceQueueInfo2<'_>, place: *mut vk::Queue) {
    if let Some(queues) = of_device(device) {
        // SAFETY: the structure is the caller's.
        let info = unsafe { &*info };
        let queue = match info.flags.is_empty() {
            true => queues.of(info.queue_family_index, info.queue_index),
            // No queue is opened with flags.
            false => vk::Queue::null(),
        };
        // SAFETY: as this function was called.
        unsafe { place.write(queue) };
    } else {
        // SAFETY: the name has this type.
        let below = unsafe { next::<vk::PFN_vkGetDeviceQueue2>(device, c"vkGetDeviceQueue2") };
        if let Some((ask, _)) = below {
            // SAFETY: as this function was called.
            unsafe { ask(device, info, place) };
        }
    }
}

/// Declares functions of a queue that call the one below, by the first of these names that it has, on the real queue, with that locked.
macro_rules! on_the_real_queue {
    ($($own:ident: $type:ty, [$($name:literal),+], ($($argument:ident: $of:ty),*) $(-> $result:ty, $or:expr)?;)*) => {
        $(pub unsafe extern "system" fn $own(queue: vk::Queue $(, $argument: $of)*) $(-> $result)? {
            // SAFETY: the queue is the caller's own, with the key of its device.
            let Some(key) = (unsafe { queue.key() }) else { return $($or)? };
            let (device, queues) = (locked(&DEVICES).get(&key).copied(), locked(&QUEUES).get(&key).cloned());
            // SAFETY: all names have this type.
            let named = |device: super::device::DeviceBelow| unsafe { [$($name),+].into_iter().find_map(|name| device.function::<$type>(name)) };
            let Some(function) = device.and_then(named) else { return $($or)? };
            let _held = queues.as_ref().map(|queues| queues.held());
            let below = queues.as_ref().map_or(queue, |queues| queues.below(queue));
            // SAFETY: as this function was called, on a queue of the device below.
            unsafe { function(below $(, $argument)*) }
        })*
    };
}

on_the_real_queue! {
    submit: vk::PFN_vkQueueSubmit, [c"vkQueueSubmit"],
        (count: u32, submits: *const vk::SubmitInfo<'_>, fence: vk::Fence) -> vk::Result, vk::Result::ERROR_UNKNOWN;
    submit2: vk::PFN_vkQueueSubmit2, [c"vkQueueSubmit2KHR", c"vkQueueSubmit2"],
        (count: u32, submits: *const vk::SubmitInfo2<'_>, fence: vk::Fence) -> vk::Result, vk::Result::ERROR_UNKNOWN;
    bind_sparse: vk::PFN_vkQueueBindSparse, [c"vkQueueBindSparse"],
        (count: u32, binds: *const vk::BindSparseInfo<'_>, fence: vk::Fence) -> vk::Result, vk::Result::ERROR_UNKNOWN;
    wait_idle: vk::PFN_vkQueueWaitIdle, [c"vkQueueWaitIdle"], () -> vk::Result, vk::Result::ERROR_UNKNOWN;
    present: vk::PFN_vkQueuePresentKHR, [c"vkQueuePresentKHR"],
        (info: *const vk::PresentInfoKHR<'_>) -> vk::Result, vk::Result::ERROR_UNKNOWN;
    begin_label: vk::PFN_vkQueueBeginDebugUtilsLabelEXT, [c"vkQueueBeginDebugUtilsLabelEXT"],
        (label: *const vk::DebugUtilsLabelEXT<'_>);
    end_label: vk::PFN_vkQueueEndDebugUtilsLabelEXT, [c"vkQueueEndDebugUtilsLabelEXT"], ();
    insert_label: vk::PFN_vkQueueInsertDebugUtilsLabelEXT, [c"vkQueueInsertDebugUtilsLabelEXT"],
        (label: *const vk::DebugUtilsLabelEXT<'_>);
}

pub unsafe extern "system" fn device_wait_idle(device: vk::Device) -> vk::Result {
    let queues = of_device(device);
    // SAFETY: the name has this type.
    let below = unsafe { next::<vk::PFN_vkDeviceWaitIdle>(device, c"vkDeviceWaitIdle") };
    let Some((wait, _)) = below else { return vk::Result::ERROR_UNKNOWN };
    // The call counts as an access to each queue of the device (specification, "Host Synchronization").
    let _held = queues.as_ref().map(|queues| queues.held());
    // SAFETY: as this function was called.
    unsafe { wait(device) }
}

/// Declares functions that name or tag an object. Played queues give their names to the real one, which has the last of them.
macro_rules! on_an_object {
    ($($own:ident: $type:ty, $name:literal, $info:ty;)*) => {
        $(pub unsafe extern "system" fn $own(device: vk::Device, info: *const $info) -> vk::Result {
            let queues = of_device(device);
            // SAFETY: the name has this type.
            let Some((function, _)) = (unsafe { next::<$type>(device, $name) }) else {
                return vk::Result::ERROR_UNKNOWN;
            };
            // SAFETY: the structure is the caller's.
            let mut info = unsafe { *info };
            let of_queue = queues.as_ref().filter(|_| info.object_type == vk::ObjectType::QUEUE);
            let _held = of_queue.map(|queues| queues.held());
            if let Some(queues) = of_queue {
                info.object_handle = queues.below(vk::Queue::from_raw(info.object_handle)).as_raw();
            }
            // SAFETY: as this function was called, with an object of the device below.
            unsafe { function(device, &raw const info) }
        })*
    };
}

on_an_object! {
    set_name: vk::PFN_vkSetDebugUtilsObjectNameEXT, c"vkSetDebugUtilsObjectNameEXT", vk::DebugUtilsObjectNameInfoEXT<'_>;
    set_tag: vk::PFN_vkSetDebugUtilsObjectTagEXT, c"vkSetDebugUtilsObjectTagEXT", vk::DebugUtilsObjectTagInfoEXT<'_>;
}

#[cfg(test)]
mod tests {
    use super::*;

    fn info(family: u32, priorities: &[f32]) -> vk::DeviceQueueCreateInfo<'_> {
        vk::DeviceQueueCreateInfo::default().queue_family_index(family).queue_priorities(priorities)
    }

    fn read(infos: &[vk::DeviceQueueCreateInfo<'_>]) -> Result<Opened, String> {
        // SAFETY: the structures are the tests' own.
        unsafe { Opened::read(infos) }
    }

    #[test]
    fn three_families_are_one_queue_of_the_real_family() {
        let infos = [info(2, &[0.25]), info(0, &[0.75]), info(1, &[0.5])];
        let opened = read(&infos).expect("there are such families");
        let below = opened.below(&infos[0], 4);
        // SAFETY: the place is the test's own.
        let priority = unsafe { below.p_queue_priorities.read() };
        assert_eq!((below.queue_family_index, below.queue_count, priority), (4, 1, 0.75));
    }

    #[test]
    fn queues_that_are_not_played_are_refused() {
        let protected = info(0, &[1.0]).flags(vk::DeviceQueueCreateFlags::PROTECTED);
        for (infos, says) in [
            (vec![info(3, &[1.0])], "queue family 3, and there are 3"),
            (vec![info(1, &[1.0, 1.0])], "2 queues of family 1"),
            (vec![protected], "family 0 and flags 1"),
            (vec![info(0, &[1.0]), info(2, &[1.0]), info(0, &[1.0])], "queue family 0 twice"),
        ] {
            let told = read(&infos).expect_err(says);
            assert!(told.contains(says), "{told}");
        }
    }

    #[test]
    fn only_the_first_family_draws_and_the_last_only_copies() {
        let real = vk::QueueFamilyProperties {
            queue_flags: vk::QueueFlags::GRAPHICS | vk::QueueFlags::COMPUTE | vk::QueueFlags::TRANSFER,
            queue_count: 16,
            timestamp_valid_bits: 64,
            min_image_transfer_granularity: vk::Extent3D { width: 1, height: 1, depth: 1 },
        };
        let [draws, computes, copies] = played_families(&real);
        assert!(draws.queue_flags == real.queue_flags && draws.queue_count == 1);
        assert!(computes.queue_flags == vk::QueueFlags::COMPUTE | vk::QueueFlags::TRANSFER);
        assert!(copies.queue_flags == vk::QueueFlags::TRANSFER && copies.queue_count == 1);
        assert_eq!([draws, computes, copies].map(|own| own.timestamp_valid_bits), [64, 64, 0]);
    }

    #[test]
    fn each_queue_has_one_handle_that_ends_in_the_real_queue() {
        let mut word = 7_usize;
        let real = vk::Queue::from_raw(&raw mut word as u64);
        let queues = Queues::new(&Opened { families: vec![0, 1, 2], priority: 1.0 }, real, 7);
        let all = [0, 1, 2].map(|family| queues.of(family, 0));
        assert!(all[0] == real && all[1] != real && all[2] != real && all[1] != all[2]);
        for (family, queue) in (0..).zip(all) {
            assert!(queues.of(family, 0) == queue && queues.below(queue) == real);
            // SAFETY: the handle is alive.
            assert_eq!(unsafe { queue.key() }, Some(7));
        }
        assert!(queues.of(0, 1).is_null() && queues.of(3, 0).is_null());
    }
}
