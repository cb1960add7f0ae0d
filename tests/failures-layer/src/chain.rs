//! This layer's place between the loader and the layers below: instances, devices, and functions by their names.

use std::collections::HashMap;
use std::ffi::{CStr, CString, c_char};
use std::sync::{LazyLock, Mutex, MutexGuard, PoisonError};

use ash::vk;

use crate::loader::{self, DeviceLink, Dispatched, InstanceLink, Interface, take_link, typed};
use crate::steering::{self, CallFate, decide, within};
use crate::{callbacks, commands, driver_cache, incoherent, table};

/// An instance or a device below this layer, and its functions.
struct Below<H, G> {
    handle: H,
    get_proc_addr: G,
    /// The functions below, by name, queried when this was made: a loader that is asked later for an instance's function returns the top layer's.
    functions: HashMap<&'static CStr, unsafe extern "system" fn()>,
}

impl<H, G> Below<H, G> {
    fn new(handle: H, get_proc_addr: G, ask: impl Fn(&CStr) -> vk::PFN_vkVoidFunction) -> Self
    where
        H: Level,
    {
        let own = [(c"vkDestroyInstance", false), (c"vkDestroyDevice", true), (c"vkQueuePresentKHR", true)];
        let names = [table::FALLIBLE_NAMES, table::FREEING_NAMES, incoherent::NAMES, commands::NAMES, &own]
            .into_iter()
            .flatten();
        let names = names.filter(|(_, of_a_device)| *of_a_device == H::OF_A_DEVICE);
        // An older device has a command of the core by its extension's name alone.
        let ask = |name: &CStr| ask(name).or_else(|| ask(&CString::new([name.to_bytes(), ALIAS].concat()).ok()?));
        let functions = names.filter_map(|&(name, _)| Some((name, ask(name)?))).collect();
        Self { handle, get_proc_addr, functions }
    }
}

/// The end of a command's name in an extension that later became a part of the core, where the name is the same without it.
const ALIAS: &[u8] = b"KHR";

/// What `find` has for a command, by either of its names: `vkQueueSubmit2KHR` is an alias of `vkQueueSubmit2`.
pub fn by_either_name<T>(name: &CStr, find: impl Fn(&CStr) -> Option<T>) -> Option<T> {
    find(name).or_else(|| find(&CString::new(name.to_bytes().strip_suffix(ALIAS)?).ok()?))
}

/// Entries by their [`Dispatched::key`].
type Table<H, G> = LazyLock<Mutex<HashMap<usize, Below<H, G>>>>;

static INSTANCES: Table<vk::Instance, vk::PFN_vkGetInstanceProcAddr> = LazyLock::new(Mutex::default);
static DEVICES: Table<vk::Device, vk::PFN_vkGetDeviceProcAddr> = LazyLock::new(Mutex::default);

fn locked<H, G>(table: &Table<H, G>) -> MutexGuard<'_, HashMap<usize, Below<H, G>>> {
    // A thread that panicked with the lock has changed the table wholly or not at all.
    table.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The handle below a key, and the function that finds all others: copied, so that nothing is locked while it is called.
fn below<H: Copy, G: Copy>(table: &Table<H, G>, key: Option<usize>) -> Option<(H, G)> {
    locked(table).get(&key?).map(|below| (below.handle, below.get_proc_addr))
}

/// The function of a name below a key.
fn function<H, G>(table: &Table<H, G>, key: Option<usize>, name: &CStr) -> vk::PFN_vkVoidFunction {
    locked(table).get(&key?)?.functions.get(name).copied()
}

impl Dispatched for vk::Queue {}
impl Dispatched for vk::CommandBuffer {}

/// A handle by which commands are dispatched, and the functions below it.
pub trait Level: Dispatched {
    /// True for a device's handles, false for an instance's.
    const OF_A_DEVICE: bool;

    /// The function of that name below this layer.
    ///
    /// # Safety
    /// As [`Dispatched::key`].
    unsafe fn function(self, name: &CStr) -> vk::PFN_vkVoidFunction;

    /// The key of the device that it is of; none of an instance's.
    ///
    /// # Safety
    /// As [`Dispatched::key`].
    unsafe fn device_key(self) -> Option<usize>;
}

macro_rules! of_an_instance {
    ($($handle:ident),*) => {$(
        impl Level for vk::$handle {
            const OF_A_DEVICE: bool = false;

            unsafe fn function(self, name: &CStr) -> vk::PFN_vkVoidFunction {
                // SAFETY: the caller's promise.
                function(&INSTANCES, unsafe { self.key() }, name)
            }

            unsafe fn device_key(self) -> Option<usize> {
                None
            }
        }
    )*};
}

macro_rules! of_a_device {
    ($($handle:ident),*) => {$(
        impl Level for vk::$handle {
            const OF_A_DEVICE: bool = true;

            unsafe fn function(self, name: &CStr) -> vk::PFN_vkVoidFunction {
                // SAFETY: the caller's promise.
                function(&DEVICES, unsafe { self.key() }, name)
            }

            unsafe fn device_key(self) -> Option<usize> {
                // SAFETY: the caller's promise.
                unsafe { self.key() }
            }
        }
    )*};
}

of_an_instance!(Instance, PhysicalDevice);
of_a_device!(Device, Queue, CommandBuffer);

/// The function of that name below this layer, with its type.
///
/// # Safety
/// As [`Dispatched::key`]; `F` is the type of the function's pointer.
pub unsafe fn next<F: Copy>(handle: impl Level, name: &CStr) -> Option<F> {
    // SAFETY: the caller's promise.
    unsafe { typed(handle.function(name)) }
}

/// Waits until a device that is to be lost has nothing to do any more: a lost device uses nothing.
pub fn lose(key: Option<usize>) {
    let Some((device, _)) = below(&DEVICES, key) else { return };
    // SAFETY: the device is alive, and the type is that of the name.
    unsafe {
        if let Some(wait) = typed::<vk::PFN_vkDeviceWaitIdle>(function(&DEVICES, key, c"vkDeviceWaitIdle")) {
            let _ = wait(device);
        }
    }
}

/// The layer's entry: the loader asks which version of their interface both know, and for the functions by which it asks for all others.
///
/// # Safety
/// `interface` is null or the loader's own.
#[unsafe(no_mangle)]
pub unsafe extern "system" fn vkNegotiateLoaderLayerInterfaceVersion(interface: *mut Interface) -> vk::Result {
    // SAFETY: the caller's promise.
    let Some(interface) = (unsafe { interface.as_mut() }) else { return vk::Result::ERROR_INITIALIZATION_FAILED };
    if interface.structure != loader::INTERFACE || interface.version < loader::VERSION {
        return vk::Result::ERROR_INITIALIZATION_FAILED;
    }
    interface.version = loader::VERSION;
    interface.get_instance_proc_addr = Some(get_instance_proc_addr);
    interface.get_device_proc_addr = Some(get_device_proc_addr);
    interface.get_physical_device_proc_addr = None;
    vk::Result::SUCCESS
}

/// Returns this layer's function of a device by its name, if there is one.
fn own_of_device(name: &CStr) -> vk::PFN_vkVoidFunction {
    match name.to_bytes() {
        b"vkGetDeviceProcAddr" => untyped!(get_device_proc_addr, vk::PFN_vkGetDeviceProcAddr),
        b"vkDestroyDevice" => untyped!(destroy_device, vk::PFN_vkDestroyDevice),
        b"vkQueuePresentKHR" => untyped!(queue_present, vk::PFN_vkQueuePresentKHR),
        _ => by_either_name(name, |name| {
            commands::own(name)
                .or_else(|| driver_cache::own(name))
                .or_else(|| table::fallible(name))
                .or_else(|| table::freeing(name))
        }),
    }
}

/// Returns this layer's function of an instance by its name, if there is one.
fn own_of_instance(name: &CStr) -> vk::PFN_vkVoidFunction {
    match name.to_bytes() {
        b"vkGetInstanceProcAddr" => untyped!(get_instance_proc_addr, vk::PFN_vkGetInstanceProcAddr),
        b"vkCreateInstance" => untyped!(create_instance, vk::PFN_vkCreateInstance),
        b"vkDestroyInstance" => untyped!(destroy_instance, vk::PFN_vkDestroyInstance),
        b"vkCreateDevice" => untyped!(create_device, vk::PFN_vkCreateDevice),
        _ => incoherent::own(name).or_else(|| own_of_device(name)),
    }
}

/// Returns the layer's own function, else the function below. Returns `None` for a function that is missing below, since its extension is not
/// enabled.
unsafe extern "system" fn get_instance_proc_addr(
    instance: vk::Instance,
    name: *const c_char,
) -> vk::PFN_vkVoidFunction {
    if name.is_null() {
        return None;
    }
    // SAFETY: names are strings that end in NUL (specification, vkGetInstanceProcAddr).
    let own = own_of_instance(unsafe { CStr::from_ptr(name) });
    // SAFETY: the instance is null or the caller's own.
    let Some((_, below)) = below(&INSTANCES, unsafe { instance.key() }) else {
        // No instance exists yet, or it is being created.
        return own;
    };
    // SAFETY: as this function was called.
    let other = unsafe { below(instance, name) };
    other.and(own.or(other))
}

/// Returns a device's function by the rules of `get_instance_proc_addr`.
unsafe extern "system" fn get_device_proc_addr(device: vk::Device, name: *const c_char) -> vk::PFN_vkVoidFunction {
    // SAFETY: the device is null or the caller's own.
    let (_, below) = below(&DEVICES, unsafe { device.key() })?;
    if name.is_null() {
        return None;
    }
    // SAFETY: names are strings that end in NUL (specification, vkGetDeviceProcAddr).
    let text = unsafe { CStr::from_ptr(name) };
    if commands::hides(text) {
        return None;
    }
    let own = own_of_device(text);
    // SAFETY: as this function was called.
    let other = unsafe { below(device, name) };
    other.and(own.or(other))
}

const FAILED: vk::Result = vk::Result::ERROR_INITIALIZATION_FAILED;

unsafe extern "system" fn create_instance(
    info: *const vk::InstanceCreateInfo<'_>,
    allocator: *const vk::AllocationCallbacks<'_>,
    instance: *mut vk::Instance,
) -> vk::Result {
    if let Err(why) = steering::read_environment() {
        eprintln!("VK_LAYER_AFTERLIGHT_failures: {why}");
        return FAILED;
    }
    // SAFETY: the loader passes on the program's structure, with structures of its own in the chain.
    let Some(described) = (unsafe { info.as_ref() }) else { return FAILED };
    // SAFETY: as above; one thread creates this instance.
    let Some(link) = (unsafe { take_link::<InstanceLink>(described.p_next) }) else { return FAILED };
    if let CallFate::Instead(result) = decide("vkCreateInstance", None, false) {
        return result;
    }
    let get_proc_addr = link.get_instance_proc_addr;
    // SAFETY: the layer below gives functions by their names.
    let create = unsafe { typed(get_proc_addr(vk::Instance::null(), c"vkCreateInstance".as_ptr())) };
    let create: vk::PFN_vkCreateInstance = match create {
        Some(create) => create,
        None => return FAILED,
    };
    // SAFETY: as this function was called, with the link of the layer below in the chain; the callbacks live as long as the process.
    let result = within(c"vkCreateInstance", || unsafe { create(info, callbacks::in_place_of(allocator), instance) });
    if result != vk::Result::SUCCESS {
        return result;
    }
    // SAFETY: it was written there.
    let created = unsafe { instance.read() };
    // SAFETY: it was just created.
    if let Some(key) = unsafe { created.key() } {
        // SAFETY: the instance is alive, and names end in NUL.
        let ask = |name: &CStr| unsafe { get_proc_addr(created, name.as_ptr()) };
        let below = Below::new(created, get_proc_addr, ask);
        locked(&INSTANCES).insert(key, below);
    }
    result
}

unsafe extern "system" fn destroy_instance(instance: vk::Instance, allocator: *const vk::AllocationCallbacks<'_>) {
    // SAFETY: the instance is null or the caller's own, and the type is that of the name.
    let (key, destroy) = unsafe { (instance.key(), next::<vk::PFN_vkDestroyInstance>(instance, c"vkDestroyInstance")) };
    let Some(key) = key else { return };
    locked(&INSTANCES).remove(&key);
    if let Some(destroy) = destroy {
        // SAFETY: as this function was called, with the callbacks that it was created with.
        unsafe { destroy(instance, callbacks::in_place_of(allocator)) };
    }
    steering::say_counts();
}

unsafe extern "system" fn create_device(
    physical: vk::PhysicalDevice,
    info: *const vk::DeviceCreateInfo<'_>,
    allocator: *const vk::AllocationCallbacks<'_>,
    device: *mut vk::Device,
) -> vk::Result {
    // SAFETY: the loader passes on the program's structure, with structures of its own in the chain.
    let Some(described) = (unsafe { info.as_ref() }) else { return FAILED };
    // SAFETY: as above; one thread creates this device.
    let Some(link) = (unsafe { take_link::<DeviceLink>(described.p_next) }) else { return FAILED };
    if let CallFate::Instead(result) = decide("vkCreateDevice", None, false) {
        return result;
    }
    let get_proc_addr = link.get_device_proc_addr;
    // SAFETY: the physical device is the caller's own; it has the key of its instance.
    let Some((parent, _)) = below(&INSTANCES, unsafe { physical.key() }) else { return FAILED };
    // SAFETY: the layer below gives functions by their names.
    let create = unsafe { typed((link.get_instance_proc_addr)(parent, c"vkCreateDevice".as_ptr())) };
    let create: vk::PFN_vkCreateDevice = match create {
        Some(create) => create,
        None => return FAILED,
    };
    // SAFETY: as this function was called, with the link of the layer below in the chain; the callbacks live as long as the process.
    let create = || unsafe { create(physical, info, callbacks::in_place_of(allocator), device) };
    let result = within(c"vkCreateDevice", create);
    if result != vk::Result::SUCCESS {
        return result;
    }
    // SAFETY: it was written there.
    let created = unsafe { device.read() };
    // SAFETY: it was just created.
    if let Some(key) = unsafe { created.key() } {
        // SAFETY: the device is alive, and names end in NUL.
        let ask = |name: &CStr| unsafe { get_proc_addr(created, name.as_ptr()) };
        let below = Below::new(created, get_proc_addr, ask);
        locked(&DEVICES).insert(key, below);
    }
    result
}

unsafe extern "system" fn destroy_device(device: vk::Device, allocator: *const vk::AllocationCallbacks<'_>) {
    // SAFETY: the device is null or the caller's own, and the type is that of the name.
    let (key, destroy) = unsafe { (device.key(), next::<vk::PFN_vkDestroyDevice>(device, c"vkDestroyDevice")) };
    let Some(key) = key else { return };
    locked(&DEVICES).remove(&key);
    steering::forget_device(key);
    if let Some(destroy) = destroy {
        // SAFETY: as this function was called, with the callbacks that it was created with.
        unsafe { destroy(device, callbacks::in_place_of(allocator)) };
    }
}

/// Presents several swapchains at once, each with a separate result.
unsafe extern "system" fn queue_present(queue: vk::Queue, info: *const vk::PresentInfoKHR<'_>) -> vk::Result {
    // SAFETY: the handle is the caller's own, and the type is that of the name.
    let Some(present) = (unsafe { next::<vk::PFN_vkQueuePresentKHR>(queue, c"vkQueuePresentKHR") }) else {
        return FAILED;
    };
    // SAFETY: the handle is the caller's own.
    let device = unsafe { queue.key() };
    let result = match decide("vkQueuePresentKHR", device, false) {
        CallFate::After(result) => {
            // SAFETY: as this function was called.
            let real = within(c"vkQueuePresentKHR", || unsafe { present(queue, info) });
            if real == vk::Result::SUCCESS { result } else { return real }
        }
        CallFate::Instead(result) => result,
        CallFate::Lost { now } => {
            if now {
                lose(device);
            }
            vk::Result::ERROR_DEVICE_LOST
        }
        CallFate::Pass | CallFate::Shortened => {
            // SAFETY: as this function was called.
            return within(c"vkQueuePresentKHR", || unsafe { present(queue, info) });
        }
    };
    // SAFETY: the structure is as the specification has it: as many places for results as swapchains, or none.
    unsafe {
        if let Some(info) = info.as_ref().filter(|info| !info.p_results.is_null()) {
            (0..info.swapchain_count as usize).for_each(|index| info.p_results.add(index).write(result));
        }
    }
    result
}
