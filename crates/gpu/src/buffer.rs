//! Buffers with their memory; mapped ones are read and written here, within bounds.

use std::sync::{Arc, Mutex, PoisonError};

use ash::vk;
use gpu_allocator::vulkan::Allocation;

use super::device::Device;
use super::error::{Doing, Error, Result};
use super::memory::{Location, MemoryKind, MemoryNeed};
use super::owned::Owned;

/// A buffer and its memory.
pub struct Buffer {
    /// The handle. It is valid as long as this owner.
    pub raw: vk::Buffer,
    /// The size in bytes.
    pub size: u64,
    /// The usage flags.
    pub usage: vk::BufferUsageFlags,
    /// The name.
    pub name: String,
    owner: Owned<vk::Buffer>,
    // Locked while the CPU reads or writes; None only while it is dropped.
    memory: Mutex<Option<Allocation>>,
}

impl Buffer {
    /// A buffer of `size` bytes, whose content is undefined.
    ///
    /// # Errors
    /// [`Error::Misuse`] for a size of 0; [`Error::TooLarge`] for more than the device can bind for this usage; [`Error::OutOfMemory`].
    pub fn new(
        device: &Arc<Device>,
        name: &str,
        size: u64,
        usage: vk::BufferUsageFlags,
        location: Location,
        kind: MemoryKind,
    ) -> Result<Buffer> {
        Self::of(device, name, (size, usage), (location, kind), false)
    }

    /// As [`Buffer::new`], but with `VK_SHARING_MODE_CONCURRENT`: all queue families of the device may read it without ownership transfers.
    ///
    /// # Errors
    /// As [`Buffer::new`].
    pub fn shared(
        device: &Arc<Device>,
        name: &str,
        size: u64,
        usage: vk::BufferUsageFlags,
        location: Location,
        kind: MemoryKind,
    ) -> Result<Buffer> {
        Self::of(device, name, (size, usage), (location, kind), true)
    }

    fn of(
        device: &Arc<Device>,
        name: &str,
        (size, usage): (u64, vk::BufferUsageFlags),
        (location, kind): (Location, MemoryKind),
        is_shared: bool,
    ) -> Result<Buffer> {
        check_size(device, name, size, usage)?;
        let doing = || format!("creating the buffer '{name}' of {size} bytes");
        let families = if is_shared { device.all_families() } else { Vec::new() };
        let info = vk::BufferCreateInfo::default().size(size).usage(usage).sharing_mode(vk::SharingMode::EXCLUSIVE);
        let info = match families.len() {
            0 | 1 => info,
            _ => info.sharing_mode(vk::SharingMode::CONCURRENT).queue_family_indices(&families),
        };
        // SAFETY: the device is alive; destroyed by its owner, below, whatever follows.
        let raw = unsafe { device.raw.create_buffer(&info, None) }.doing("vkCreateBuffer", doing)?;
        // SAFETY: the buffer is new.
        let requirements = unsafe { device.raw.get_buffer_memory_requirements(raw) };
        let mut owner = Owned::new_from(device, name, raw);
        let need = MemoryNeed { name, requirements, location, linear: true, dedicated_to: None };
        let memory = device.memory.allocate(&need)?;
        // SAFETY: the memory was allocated for these requirements, and nothing is bound to it or to the buffer yet.
        let bound = unsafe { device.raw.bind_buffer_memory(raw, memory.memory(), memory.offset()) };
        if let Err(error) = bound.doing("vkBindBufferMemory", doing) {
            owner.retire_with(Some(memory));
            return Err(error);
        }
        owner.account(kind, requirements.size);
        Ok(Buffer { raw, size, usage, name: name.to_owned(), owner, memory: Mutex::new(Some(memory)) })
    }

    /// Copies `data` into a mapped buffer, `offset` bytes from its start. The GPU must not be using these bytes; later submissions see them.
    ///
    /// # Errors
    /// [`Error::Misuse`] if the buffer is not mapped or the bytes do not fit.
    pub fn write<T: bytemuck::NoUninit>(&self, offset: u64, data: &[T]) -> Result<()> {
        let bytes: &[u8] = bytemuck::cast_slice(data);
        self.with_mapped(offset, bytes.len() as u64, |memory, mapped| {
            // SAFETY: `mapped` is writable for `bytes.len()` bytes, which `with_mapped` checked, and the lock that it
            // holds keeps other threads away; our own slice cannot overlap device memory.
            unsafe { std::ptr::copy_nonoverlapping(bytes.as_ptr(), mapped, bytes.len()) };
            self.flush(memory, offset, bytes.len() as u64)
        })
    }

    /// A copy of `len` bytes of a mapped buffer, `offset` bytes from its start.
    ///
    /// # Errors
    /// As [`Buffer::read_with`].
    pub fn read(&self, offset: u64, len: u64) -> Result<Vec<u8>> {
        self.read_with(offset, len, <[u8]>::to_vec)
    }

    /// Calls `use_bytes` with `len` bytes of a mapped buffer, `offset` bytes from its start. The submission that wrote
    /// them must be done, and have made them visible to the host (a barrier to `HOST`/`HOST_READ`).
    ///
    /// # Errors
    /// [`Error::Misuse`] if the buffer is not mapped or has no such bytes.
    pub fn read_with<R>(&self, offset: u64, len: u64, use_bytes: impl FnOnce(&[u8]) -> R) -> Result<R> {
        self.with_mapped(offset, len, |memory, mapped| {
            self.invalidate(memory, offset, len)?;
            let len = usize::try_from(len).unwrap_or(usize::MAX);
            // SAFETY: `mapped` is readable for `len` bytes, which `with_mapped` checked, and mapped memory always holds
            // some value; the lock that it holds keeps writers on other threads away.
            Ok(use_bytes(unsafe { std::slice::from_raw_parts(mapped, len) }))
        })
    }

    /// The device that it was made by.
    pub fn device(&self) -> &Arc<Device> {
        self.owner.device()
    }

    /// Calls `work` with the address of `len` bytes at `offset`, after checking that there are such bytes.
    fn with_mapped<R>(&self, offset: u64, len: u64, work: impl FnOnce(&Allocation, *mut u8) -> Result<R>) -> Result<R> {
        if offset.checked_add(len).is_none_or(|end| end > self.size) {
            return Err(Error::Misuse(format!(
                "{len} bytes at {offset} are outside the buffer '{}' of {} bytes",
                self.name, self.size
            )));
        }
        let memory = self.memory.lock().unwrap_or_else(PoisonError::into_inner);
        let mapped = memory.as_ref().and_then(|memory| Some((memory, memory.mapped_ptr()?)));
        let Some((memory, start)) = mapped else {
            return Err(Error::Misuse(format!("the buffer '{}' is not mapped", self.name)));
        };
        // Fits, as the offset is within mapped memory.
        let offset = usize::try_from(offset).unwrap_or(0);
        // SAFETY: the allocation is at least as large as the buffer, and the offset is within that.
        work(memory, unsafe { start.as_ptr().cast::<u8>().add(offset) })
    }

    fn flush(&self, memory: &Allocation, offset: u64, len: u64) -> Result<()> {
        let Some(range) = self.incoherent_range(memory, offset, len) else { return Ok(()) };
        // SAFETY: the memory is alive and mapped, and the range lies in it.
        unsafe { self.device().raw.flush_mapped_memory_ranges(&[range]) }
            .doing("vkFlushMappedMemoryRanges", || format!("writing to the buffer '{}'", self.name))
    }

    fn invalidate(&self, memory: &Allocation, offset: u64, len: u64) -> Result<()> {
        let Some(range) = self.incoherent_range(memory, offset, len) else { return Ok(()) };
        // SAFETY: the memory is alive and mapped, and the range lies in it.
        unsafe { self.device().raw.invalidate_mapped_memory_ranges(&[range]) }
            .doing("vkInvalidateMappedMemoryRanges", || format!("reading the buffer '{}'", self.name))
    }

    /// The part of the memory to flush or invalidate; `None` if it is coherent.
    fn incoherent_range(&self, memory: &Allocation, offset: u64, len: u64) -> Option<vk::MappedMemoryRange<'static>> {
        if len == 0 || memory.memory_properties().contains(vk::MemoryPropertyFlags::HOST_COHERENT) {
            return None;
        }
        // Whole atoms, as Vulkan wants them. The allocation begins and ends with one (`MemoryAllocator::in_whole_atoms`).
        let atom = self.device().physical.limits.non_coherent_atom_size.max(1);
        let start = (memory.offset() + offset) / atom * atom;
        // SAFETY: only used to name the memory to Vulkan, while the allocation is borrowed.
        let raw = unsafe { memory.memory() };
        let end = (memory.offset() + offset + len).next_multiple_of(atom);
        Some(vk::MappedMemoryRange::default().memory(raw).offset(start).size(end - start))
    }
}

impl Drop for Buffer {
    fn drop(&mut self) {
        let memory = self.memory.get_mut().unwrap_or_else(PoisonError::into_inner).take();
        self.owner.retire_with(memory);
    }
}

impl std::fmt::Debug for Buffer {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "buffer '{}' of {} bytes", self.name, self.size)
    }
}

fn check_size(device: &Device, name: &str, size: u64, usage: vk::BufferUsageFlags) -> Result<()> {
    if size == 0 {
        return Err(Error::Misuse(format!("the buffer '{name}' has no bytes")));
    }
    let limits = &device.physical.limits;
    let of_usage = |flag, limit: u32| usage.contains(flag).then_some(u64::from(limit));
    // A larger uniform buffer can be had and bound in parts, but a storage buffer is always bound whole here.
    let limit = of_usage(vk::BufferUsageFlags::STORAGE_BUFFER, limits.max_storage_buffer_range);
    match limit {
        Some(limit) if size > limit => {
            Err(Error::TooLarge { what: format!("the size of the buffer '{name}' in bytes"), asked: size, limit })
        }
        _ => Ok(()),
    }
}
