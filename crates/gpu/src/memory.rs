//! Device memory: its place, its purpose, and its size.

use std::collections::BTreeMap;
use std::fmt;
use std::sync::{Mutex, MutexGuard, PoisonError};

use ash::vk;
use gpu_allocator::vulkan::{Allocation, AllocationCreateDesc, AllocationScheme, Allocator, AllocatorCreateDesc};
use gpu_allocator::{AllocationError, AllocationSizes, AllocatorDebugSettings, MemoryLocation};

use super::device::Device;
use super::error::{Error, Result};
use super::message::{Message, MessageKind, MessageLog, Severity};
use super::owned::LiveSet;
use super::physical::PhysicalDevice;

/// The purpose of memory, as reports list it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum MemoryKind {
    /// Targets of a render pass: G-buffer, HDR, output.
    Attachment,
    /// Depth as lights see it.
    ShadowMap,
    /// Material textures.
    Texture,
    /// Vertices and indices.
    Geometry,
    /// Uniform and storage buffers: cameras, lights, materials.
    Uniform,
    /// Staging buffers of uploads.
    Staging,
    /// Buffers that are read back by the CPU.
    ReadBack,
}

impl MemoryKind {
    /// The kind in words, in lower case.
    pub fn text(self) -> &'static str {
        match self {
            MemoryKind::Attachment => "attachments",
            MemoryKind::ShadowMap => "shadow maps",
            MemoryKind::Texture => "textures",
            MemoryKind::Geometry => "geometry",
            MemoryKind::Uniform => "uniforms",
            MemoryKind::Staging => "staging",
            MemoryKind::ReadBack => "read-back",
        }
    }
}

impl fmt::Display for MemoryKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.text())
    }
}

/// The kind of memory an object is allocated from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Location {
    /// Device memory.
    Device,
    /// Mapped memory that the CPU writes and the device reads; also device-local if there is a memory type for that.
    Upload,
    /// Mapped memory that the device writes and the CPU reads; cached if possible.
    ReadBack,
    /// Lazily allocated memory for transient attachments, taken only if a tile does not hold them; device memory if no memory type is lazy.
    Lazy,
}

/// Property flags to look for in a memory type.
#[derive(Clone, Copy)]
struct MemoryTypeFilter {
    has: vk::MemoryPropertyFlags,
    lacks: vk::MemoryPropertyFlags,
}

impl MemoryTypeFilter {
    const fn of(flags: &[vk::MemoryPropertyFlags]) -> MemoryTypeFilter {
        let (mut all, mut index) = (0, 0);
        while index < flags.len() {
            all |= flags[index].as_raw();
            index += 1;
        }
        MemoryTypeFilter { has: vk::MemoryPropertyFlags::from_raw(all), lacks: vk::MemoryPropertyFlags::empty() }
    }
}

impl Location {
    /// The memory types to look for, best first.
    fn type_filters(self) -> &'static [MemoryTypeFilter] {
        use vk::MemoryPropertyFlags as Flags;
        const DEVICE: MemoryTypeFilter = MemoryTypeFilter::of(&[Flags::DEVICE_LOCAL]);
        const ANY: MemoryTypeFilter = MemoryTypeFilter::of(&[]);
        const MAPPED: MemoryTypeFilter = MemoryTypeFilter::of(&[Flags::HOST_VISIBLE, Flags::HOST_COHERENT]);
        const MAPPED_DEVICE: MemoryTypeFilter = MemoryTypeFilter::of(&[MAPPED.has, DEVICE.has]);
        const MAPPED_CACHED: MemoryTypeFilter = MemoryTypeFilter::of(&[MAPPED.has, Flags::HOST_CACHED]);
        const CACHED: MemoryTypeFilter = MemoryTypeFilter::of(&[Flags::HOST_VISIBLE, Flags::HOST_CACHED]);
        const LAZY: MemoryTypeFilter = MemoryTypeFilter::of(&[Flags::LAZILY_ALLOCATED]);
        const FLUSHED: MemoryTypeFilter = MemoryTypeFilter { has: Flags::HOST_VISIBLE, lacks: Flags::HOST_COHERENT };
        match self {
            Location::Device => &[DEVICE, ANY],
            // Vulkan promises each buffer coherent memory; where that is used up, memory that is flushed by hand serves.
            Location::Upload => &[MAPPED_DEVICE, MAPPED, FLUSHED],
            // Reading uncached memory is some ten times slower than invalidating the cache by hand.
            Location::ReadBack => &[MAPPED_CACHED, CACHED, MAPPED],
            Location::Lazy => &[LAZY, DEVICE, ANY],
        }
    }
}

/// An object's memory requirements.
pub(super) struct MemoryNeed<'a> {
    pub(super) name: &'a str,
    pub(super) requirements: vk::MemoryRequirements,
    pub(super) location: Location,
    /// True if it is for a buffer; an image of optimal tiling is not linear.
    pub(super) linear: bool,
    /// The image to make a device allocation for that holds nothing else.
    pub(super) dedicated_to: Option<vk::Image>,
}

const MIB: u64 = 1 << 20;

/// The allocator of one device.
pub(super) struct MemoryAllocator {
    types: Vec<vk::MemoryType>,
    /// The unit in bytes in which incoherent memory is flushed and invalidated: `nonCoherentAtomSize`.
    atom: u64,
    // `None` once it is closed, which only the device's drop does.
    allocator: Mutex<Option<Allocator>>,
}

impl MemoryAllocator {
    pub(super) fn new(
        instance: &ash::Instance,
        device: &ash::Device,
        physical: &PhysicalDevice,
    ) -> Result<MemoryAllocator> {
        let mut debug_settings = AllocatorDebugSettings::default();
        // Leaks are reported by `close`, as messages that tests can fail on.
        debug_settings.log_leaks_on_shutdown = false;
        // Blocks start small, so that a small scene stays small, and grow with the scene.
        let allocation_sizes = AllocationSizes::new(16 * MIB, 16 * MIB)
            .with_max_device_memblock_size(128 * MIB)
            .with_max_host_memblock_size(64 * MIB);
        let allocator = Allocator::new(&AllocatorCreateDesc {
            instance: instance.clone(),
            device: device.clone(),
            physical_device: physical.raw,
            debug_settings,
            buffer_device_address: false,
            allocation_sizes,
        })
        .map_err(|source| Error::Allocator { doing: "starting the memory allocator".to_owned(), source })?;
        let types = physical.memory.memory_types_as_slice().to_vec();
        let atom = physical.limits.non_coherent_atom_size.max(1);
        Ok(MemoryAllocator { types, atom, allocator: Mutex::new(Some(allocator)) })
    }

    pub(super) fn allocate(&self, need: &MemoryNeed<'_>) -> Result<Allocation> {
        let mut outcome = Err(AllocationError::NoCompatibleMemoryTypeFound);
        for &wish in need.location.type_filters() {
            let memory_type_bits = self.types_with(wish) & need.requirements.memory_type_bits;
            if memory_type_bits == 0 {
                continue;
            }
            outcome = self.allocate_from(need, memory_type_bits);
            // Memory that is both mapped and on the device can be a small window (256 MiB without resizable BAR): then
            // ordinary memory serves. A full device, though, is an error, not a reason to render from system memory.
            if need.location != Location::Upload || outcome.is_ok() {
                break;
            }
        }
        outcome.map_err(|source| {
            let doing = format!("allocating memory for '{}'", need.name);
            let Some((command, result)) = cause_of(&source) else { return Error::Allocator { doing, source } };
            match Error::vulkan(command, doing, result) {
                Error::OutOfMemory { doing, .. } => Error::OutOfMemory { doing, bytes: Some(need.requirements.size) },
                error => error,
            }
        })
    }

    fn allocate_from(&self, need: &MemoryNeed<'_>, memory_type_bits: u32) -> Result<Allocation, AllocationError> {
        let allocation_scheme =
            need.dedicated_to.map_or(AllocationScheme::GpuAllocatorManaged, AllocationScheme::DedicatedImage);
        let desc = AllocationCreateDesc {
            name: need.name,
            requirements: self.in_whole_atoms(need, memory_type_bits),
            // The type is already chosen.
            location: MemoryLocation::Unknown,
            linear: need.linear,
            allocation_scheme,
        };
        match self.lock().as_mut() {
            Some(allocator) => allocator.allocate(&desc),
            None => Err(AllocationError::Internal("the allocator is closed".to_owned())),
        }
    }

    /// An object's requirements, restricted to these memory types, of which the allocator takes the first. An object in mapped memory that is not
    /// coherent gets whole atoms: otherwise flushing or invalidating a neighbour would undo writes of the GPU or of another thread. The last atom
    /// must end before the memory does.
    fn in_whole_atoms(&self, need: &MemoryNeed<'_>, memory_type_bits: u32) -> vk::MemoryRequirements {
        let requirements = vk::MemoryRequirements { memory_type_bits, ..need.requirements };
        let first = self.types.get(memory_type_bits.trailing_zeros() as usize);
        let is_flushed = first.is_some_and(|kind| is_incoherent(kind.property_flags));
        // A dedicated allocation has the image's own size, and no neighbours.
        if !is_flushed || need.dedicated_to.is_some() {
            return requirements;
        }
        vk::MemoryRequirements {
            size: requirements.size.next_multiple_of(self.atom),
            alignment: requirements.alignment.max(self.atom),
            ..requirements
        }
    }

    /// The bits of the memory types that have these properties.
    fn types_with(&self, MemoryTypeFilter { has, lacks }: MemoryTypeFilter) -> u32 {
        let has = |(_, kind): &(usize, &vk::MemoryType)| {
            kind.property_flags.contains(has) && !kind.property_flags.intersects(lacks)
        };
        self.types.iter().enumerate().filter(has).fold(0, |bits, (index, _)| bits | 1 << index)
    }

    /// Gives memory back. The object that was bound to it is destroyed.
    pub(super) fn free(&self, allocation: Allocation, log: &MessageLog) {
        let freed = self.lock().as_mut().map_or(Ok(()), |allocator| allocator.free(allocation));
        if let Err(error) = freed {
            log.push(leak(format!("freeing memory failed: {error}")));
        }
    }

    /// Reports allocations that were never freed, then gives all memory back to the driver.
    pub(super) fn close(&self, log: &MessageLog) {
        let Some(allocator) = self.lock().take() else { return };
        for allocation in allocator.generate_report().allocations {
            log.push(leak(format!("the memory of '{}' ({} bytes) was never freed", allocation.name, allocation.size)));
        }
    }

    /// Leaves all memory as it is, for good: something may still use it.
    pub(super) fn keep(&self) {
        std::mem::forget(self.lock().take());
    }

    fn lock(&self) -> MutexGuard<'_, Option<Allocator>> {
        self.allocator.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Returns true for memory that the CPU sees, and whose writes it has to flush.
fn is_incoherent(flags: vk::MemoryPropertyFlags) -> bool {
    flags.contains(vk::MemoryPropertyFlags::HOST_VISIBLE) && !flags.contains(vk::MemoryPropertyFlags::HOST_COHERENT)
}

/// The command that failed an allocation, and its result; `None` if the allocator objects to the request itself. The allocator keeps most results of
/// a driver as text only.
fn cause_of(error: &AllocationError) -> Option<(&'static str, vk::Result)> {
    const RESULTS: [vk::Result; 5] = [
        vk::Result::ERROR_OUT_OF_HOST_MEMORY,
        vk::Result::ERROR_OUT_OF_DEVICE_MEMORY,
        vk::Result::ERROR_MEMORY_MAP_FAILED,
        vk::Result::ERROR_INVALID_EXTERNAL_HANDLE,
        vk::Result::ERROR_INVALID_OPAQUE_CAPTURE_ADDRESS,
    ];
    let named = |is_it: &dyn Fn(vk::Result) -> bool| RESULTS.into_iter().find(|&result| is_it(result));
    match error {
        AllocationError::OutOfMemory => Some(("vkAllocateMemory", vk::Result::ERROR_OUT_OF_DEVICE_MEMORY)),
        AllocationError::FailedToMap(reason) => Some((
            "vkMapMemory",
            named(&|result| result.to_string() == *reason).unwrap_or(vk::Result::ERROR_MEMORY_MAP_FAILED),
        )),
        AllocationError::Internal(reason) => {
            Some(("vkAllocateMemory", named(&|result| reason.ends_with(&format!("vkAllocateMemory: {result:?}")))?))
        }
        _ => None,
    }
}

/// An error message about something that outlived its device.
pub(super) fn leak(text: String) -> Message {
    let (severity, kind) = (Severity::Error, MessageKind::Leak);
    Message { severity, kind, id_name: "leak".to_owned(), objects: Vec::new(), text }
}

/// The objects of one [`MemoryKind`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct KindReport {
    /// The number of objects.
    pub objects: usize,
    /// The objects' memory in bytes, as the driver sizes it.
    pub bytes: u64,
}

/// A heap as the driver sees it: all programs' use of it, not only this one's.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct HeapReport {
    /// The size in bytes.
    pub size: u64,
    /// The bytes of it that this program uses and can use, if the driver tells (VK_EXT_memory_budget).
    pub usage_and_budget: Option<(u64, u64)>,
}

/// The memory that a device's objects take.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct MemoryReport {
    /// Each kind that has objects. Retired objects count until the GPU is done with them.
    pub kinds: BTreeMap<MemoryKind, KindReport>,
    /// The sum of all kinds in bytes.
    pub bytes: u64,
    /// The most that the sum ever was, in bytes.
    pub peak_bytes: u64,
    /// The number of blocks allocated from the driver; objects share blocks.
    pub blocks: usize,
    /// The size of these blocks in bytes.
    pub block_bytes: u64,
    /// The number of live objects by type, as `IMAGE_VIEW`, with or without memory.
    pub objects: BTreeMap<String, usize>,
    /// The device's heaps.
    pub heaps: Vec<HeapReport>,
}

impl Device {
    /// Returns the memory that the device's objects take now, and its peak.
    pub fn memory_report(&self) -> MemoryReport {
        let mut report = MemoryReport { heaps: self.heap_reports(), ..MemoryReport::default() };
        {
            let registry = self.registry.lock();
            report.peak_bytes = registry.peak_bytes;
            for object in registry.objects.values() {
                *report.objects.entry(format!("{:?}", object.object_type)).or_default() += 1;
                if let Some((kind, bytes)) = object.memory {
                    let of_kind = report.kinds.entry(kind).or_default();
                    of_kind.objects += 1;
                    of_kind.bytes += bytes;
                    report.bytes += bytes;
                }
            }
        }
        if let Some(allocator) = self.memory.lock().as_ref() {
            let blocks = allocator.generate_report();
            report.blocks = blocks.blocks.len();
            report.block_bytes = blocks.total_capacity_bytes;
        }
        report
    }

    fn heap_reports(&self) -> Vec<HeapReport> {
        let mut budget = vk::PhysicalDeviceMemoryBudgetPropertiesEXT::default();
        let mut query = vk::PhysicalDeviceMemoryProperties2::default();
        if self.features.memory_budget {
            query = query.push_next(&mut budget);
        }
        // SAFETY: the instance is alive, and the structures live until the call returns.
        unsafe { self.instance.raw().get_physical_device_memory_properties2(self.physical.raw, &mut query) };
        let heaps = query.memory_properties;
        let told = self.features.memory_budget;
        let report = |(index, heap): (usize, &vk::MemoryHeap)| HeapReport {
            size: heap.size,
            usage_and_budget: told.then(|| (budget.heap_usage[index], budget.heap_budget[index])),
        };
        heaps.memory_heaps_as_slice().iter().enumerate().map(report).collect()
    }

    /// The names of all objects that someone owns, sorted; an object of several has its name there several times.
    pub fn live_objects(&self) -> Vec<String> {
        let registry = self.registry.lock();
        let owned = registry.objects.values().filter(|object| !object.retired);
        let mut names: Vec<String> = owned.map(|object| object.name.to_string()).collect();
        names.sort_unstable();
        names
    }

    /// All descriptors that were written into sets, sorted, as `set of frame 0: 1 UNIFORM_BUFFER`: set, binding and type.
    pub fn live_descriptors(&self) -> Vec<String> {
        let registry = self.registry.lock();
        let of_set = |set: &LiveSet| -> Vec<String> {
            set.descriptors.iter().map(|(binding, ty)| format!("{}: {binding} {ty:?}", set.name)).collect()
        };
        let mut descriptors: Vec<String> = registry.sets.values().flat_map(of_set).collect();
        descriptors.sort_unstable();
        descriptors
    }

    /// Pushes a message of kind [`MessageKind::Leak`] for every object that someone still owns, and returns how many
    /// there are. For the end of a program or a test: an owner that is forgotten keeps its device alive, so that the
    /// device's own check when it is dropped never comes.
    pub fn report_leaks(&self) -> usize {
        let registry = self.registry.lock();
        let log = self.instance.message_log();
        let owned = registry.objects.values().filter(|object| !object.retired);
        let report = |object: &super::owned::LiveObject| {
            log.push(leak(format!("{:?} '{}' is still alive", object.object_type, object.name)));
        };
        owned.inspect(|object| report(object)).count()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MAPPED: vk::MemoryPropertyFlags = vk::MemoryPropertyFlags::HOST_VISIBLE;

    fn memory() -> MemoryAllocator {
        let flags = [vk::MemoryPropertyFlags::DEVICE_LOCAL, MAPPED | vk::MemoryPropertyFlags::HOST_COHERENT, MAPPED];
        let types = flags.map(|property_flags| vk::MemoryType { property_flags, heap_index: 0 }).to_vec();
        MemoryAllocator { types, atom: 64, allocator: Mutex::new(None) }
    }

    fn need(dedicated_to: Option<vk::Image>) -> MemoryNeed<'static> {
        let requirements = vk::MemoryRequirements { size: 65, alignment: 16, memory_type_bits: 0b111 };
        MemoryNeed { name: "odd", requirements, location: Location::Upload, linear: true, dedicated_to }
    }

    #[test]
    fn only_objects_in_mapped_memory_that_is_not_coherent_have_whole_atoms() {
        let image = <vk::Image as vk::Handle>::from_raw(1);
        for (types, dedicated_to, expected) in [
            (0b001, None, [65, 16]),
            (0b010, None, [65, 16]),
            (0b100, None, [128, 64]),
            // The allocator takes the first of them.
            (0b110, None, [65, 16]),
            (0b100, Some(image), [65, 16]),
        ] {
            let found = memory().in_whole_atoms(&need(dedicated_to), types);
            assert_eq!(([found.size, found.alignment], found.memory_type_bits), (expected, types));
        }
    }

    #[test]
    fn what_the_cpu_writes_lies_in_other_memory_than_coherent_only_where_that_is_used_up() {
        let memory = memory();
        let wishes: Vec<u32> = Location::Upload.type_filters().iter().map(|&wish| memory.types_with(wish)).collect();
        assert_eq!(wishes, [0, 0b010, 0b100]);
    }
}
