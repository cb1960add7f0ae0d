//! Ownership of Vulkan objects: the generic owner, the registry of live objects, the queue of retired ones.

use std::collections::{BTreeMap, VecDeque};
use std::fmt;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use ash::vk;
use ash::vk::Handle;
use gpu_allocator::vulkan::Allocation;

use super::device::Device;
use super::memory::MemoryKind;
use super::reuse::ContentHash;

/// A handle whose object is destroyed by one call on its device.
pub trait Destroy: Handle + Copy {
    /// Destroys the object.
    ///
    /// # Safety
    /// The object was made by `device`, nothing uses it now or later, and it is destroyed once.
    unsafe fn destroy(self, device: &ash::Device);
}

macro_rules! destroyed_by {
    ($($handle:ident $function:ident),* $(,)?) => {$(
        impl Destroy for vk::$handle {
            unsafe fn destroy(self, device: &ash::Device) {
                // SAFETY: the caller's promise is the same as Vulkan's.
                unsafe { device.$function(self, None) }
            }
        }
    )*};
}

destroyed_by! {
    Buffer destroy_buffer,
    CommandPool destroy_command_pool,
    DescriptorPool destroy_descriptor_pool,
    DescriptorSetLayout destroy_descriptor_set_layout,
    Framebuffer destroy_framebuffer,
    Image destroy_image,
    ImageView destroy_image_view,
    Pipeline destroy_pipeline,
    PipelineLayout destroy_pipeline_layout,
    QueryPool destroy_query_pool,
    RenderPass destroy_render_pass,
    Sampler destroy_sampler,
    Semaphore destroy_semaphore,
    ShaderModule destroy_shader_module,
}

/// A Vulkan object that outlives every submission that uses it, and keeps its device alive.
pub struct Owned<H: Destroy> {
    /// The handle. It is valid as long as this owner.
    pub raw: H,
    name: Arc<str>,
    id: ObjectId,
    /// The content of a pipeline that is kept for reuse when this owner is dropped.
    content: Option<Box<ContentHash>>,
    device: Arc<Device>,
}

impl Owned<vk::Pipeline> {
    /// Owns a pipeline that was just made of this content, or that was kept.
    pub(super) fn reusable(
        device: &Arc<Device>,
        name: &str,
        made: PipelineOrigin,
        content: Option<ContentHash>,
    ) -> Self {
        let (raw, id) = match made {
            PipelineOrigin::New(raw) => (raw, device.registry.add(name.into(), vk::ObjectType::PIPELINE)),
            PipelineOrigin::Kept(raw, id) => {
                device.registry.revive(id, name.into());
                (raw, id)
            }
        };
        device.name_object(raw, name);
        // The owner destroys its layouts as well, and only this extension lets a pipeline outlive them.
        let content = content.filter(|_| device.features.maintenance4).map(Box::new);
        Owned { raw, name: name.into(), id, content, device: Arc::clone(device) }
    }
}

/// The origin of a pipeline.
pub(super) enum PipelineOrigin {
    New(vk::Pipeline),
    Kept(vk::Pipeline, ObjectId),
}

impl<H: Destroy> Owned<H> {
    /// Takes a newly made object: names it, lists it as alive, and sees to it that it is destroyed.
    ///
    /// The object must be made by `device` and owned by nobody else (the module's contract).
    pub fn new_from(device: &Arc<Device>, name: &str, raw: H) -> Owned<H> {
        device.name_object(raw, name);
        let name: Arc<str> = name.into();
        let id = device.registry.add(Arc::clone(&name), H::TYPE);
        Owned { raw, name, id, content: None, device: Arc::clone(device) }
    }

    /// Says in reports that the object has got memory of this kind and size, in bytes.
    pub(super) fn account(&self, kind: MemoryKind, bytes: u64) {
        self.device.registry.set_memory(self.id, kind, bytes);
    }

    /// The object's name.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The device that it was made by.
    pub fn device(&self) -> &Arc<Device> {
        &self.device
    }

    /// Gives the object up together with its memory, which is freed after the object is destroyed.
    pub(super) fn retire_with(&mut self, memory: Option<Allocation>) {
        let raw = std::mem::replace(&mut self.raw, H::from_raw(0));
        if !raw.is_null() {
            self.device.retire(raw, self.id, memory);
        }
    }
}

impl<H: Destroy> Drop for Owned<H> {
    fn drop(&mut self) {
        if let Some(content) = self.content.take() {
            self.device.keep(*content, vk::Pipeline::from_raw(self.raw.as_raw()), self.id);
            return;
        }
        // Destroyed when the last submission made so far has completed, whatever path led here.
        self.retire_with(None);
    }
}

impl<H: Destroy> fmt::Debug for Owned<H> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:?} '{}'", H::TYPE, self.name)
    }
}

/// The number of an object in the registry; never used again.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct ObjectId(u64);

/// An object that exists on the device.
#[derive(Clone, Debug)]
pub(super) struct LiveObject {
    pub(super) name: Arc<str>,
    pub(super) object_type: vk::ObjectType,
    /// The kind of its memory, and the bytes that it takes.
    pub(super) memory: Option<(MemoryKind, u64)>,
    /// Nobody owns it any more; it waits for the GPU to be done with it.
    pub(super) retired: bool,
}

/// A descriptor set: its name, and the descriptors that were written, by binding.
#[derive(Clone, Debug)]
pub(super) struct LiveSet {
    pub(super) name: String,
    pub(super) descriptors: BTreeMap<u32, vk::DescriptorType>,
}

/// Every object alive on a device.
#[derive(Default)]
pub(super) struct Registry {
    state: Mutex<RegistryState>,
}

#[derive(Default)]
pub(super) struct RegistryState {
    pub(super) objects: BTreeMap<ObjectId, LiveObject>,
    /// Descriptor sets, which go with their pool.
    pub(super) sets: BTreeMap<vk::DescriptorSet, LiveSet>,
    next_id: u64,
    /// The memory of all objects now, and the most that it was, in bytes.
    bytes: u64,
    pub(super) peak_bytes: u64,
}

impl Registry {
    fn add(&self, name: Arc<str>, object_type: vk::ObjectType) -> ObjectId {
        let mut state = self.lock();
        let id = ObjectId(state.next_id);
        state.next_id += 1;
        state.objects.insert(id, LiveObject { name, object_type, memory: None, retired: false });
        id
    }

    fn set_memory(&self, id: ObjectId, kind: MemoryKind, bytes: u64) {
        let mut state = self.lock();
        if let Some(object) = state.objects.get_mut(&id) {
            let before = object.memory.replace((kind, bytes)).map_or(0, |(_, bytes)| bytes);
            state.bytes = state.bytes - before + bytes;
            state.peak_bytes = state.peak_bytes.max(state.bytes);
        }
    }

    pub(super) fn add_set(&self, set: vk::DescriptorSet, name: &str) {
        let empty = LiveSet { name: name.to_owned(), descriptors: BTreeMap::new() };
        self.lock().sets.insert(set, empty);
    }

    pub(super) fn note_descriptors(
        &self,
        set: vk::DescriptorSet,
        descriptors: impl Iterator<Item = (u32, vk::DescriptorType)>,
    ) {
        if let Some(own) = self.lock().sets.get_mut(&set) {
            own.descriptors.extend(descriptors);
        }
    }

    pub(super) fn remove_sets(&self, sets: &[vk::DescriptorSet]) {
        let mut state = self.lock();
        for set in sets {
            state.sets.remove(set);
        }
    }

    fn revive(&self, id: ObjectId, name: Arc<str>) {
        if let Some(object) = self.lock().objects.get_mut(&id) {
            (object.name, object.retired) = (name, false);
        }
    }

    pub(super) fn mark_retired(&self, id: ObjectId) {
        if let Some(object) = self.lock().objects.get_mut(&id) {
            object.retired = true;
        }
    }

    fn remove(&self, id: ObjectId) {
        let mut state = self.lock();
        if let Some(object) = state.objects.remove(&id) {
            state.bytes -= object.memory.map_or(0, |(_, bytes)| bytes);
        }
    }

    pub(super) fn lock(&self) -> MutexGuard<'_, RegistryState> {
        // Each change is whole before anything can panic.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// An object that nobody owns any more.
struct Retired {
    /// The last submission made before it was retired; no later one uses it.
    last_use: u64,
    raw: u64,
    object_type: vk::ObjectType,
    destroy: unsafe fn(&ash::Device, u64),
    memory: Option<Allocation>,
    id: ObjectId,
}

/// Objects waiting for the GPU, oldest first.
#[derive(Default)]
pub(super) struct RetireQueue {
    waiting: Mutex<VecDeque<Retired>>,
}

impl RetireQueue {
    fn lock(&self) -> MutexGuard<'_, VecDeque<Retired>> {
        self.waiting.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Takes the objects out whose last use is at most `completed`.
    fn take_done(&self, completed: u64) -> Vec<Retired> {
        let mut waiting = self.lock();
        // Threads may append slightly out of order; then an object waits for the one before it, which does no harm.
        let done = waiting.iter().take_while(|retired| retired.last_use <= completed).count();
        waiting.drain(..done).collect()
    }
}

/// # Safety
/// As [`Destroy::destroy`]; `raw` is the value of a handle of type `H`.
unsafe fn destroy_raw<H: Destroy>(device: &ash::Device, raw: u64) {
    // SAFETY: the caller's promise.
    unsafe { H::from_raw(raw).destroy(device) }
}

impl Device {
    /// Takes an object whose owner is gone. It and then its memory go once the last submission made so far is done.
    pub(super) fn retire<H: Destroy>(&self, raw: H, id: ObjectId, memory: Option<Allocation>) {
        let last_use = self.submissions.submitted();
        self.registry.mark_retired(id);
        let retired =
            Retired { last_use, raw: raw.as_raw(), object_type: H::TYPE, destroy: destroy_raw::<H>, memory, id };
        self.retired.lock().push_back(retired);
        // Without a frame loop nobody else would call this; it costs nothing while the GPU is busy.
        self.destroy_done();
    }

    /// The last submission that something retired waits for; `None` when nothing waits.
    pub(super) fn last_retired_use(&self) -> Option<u64> {
        self.retired.lock().iter().map(|retired| retired.last_use).max()
    }

    /// Destroys the retired objects that are, as far as is known without asking the driver, no longer in use.
    pub(super) fn destroy_done(&self) {
        for retired in self.retired.take_done(self.submissions.completed()) {
            self.destroy_retired(retired);
        }
    }

    /// Destroys everything retired. The device must be idle or lost.
    pub(super) fn destroy_all_retired(&self) {
        for retired in self.retired.take_done(u64::MAX) {
            self.destroy_retired(retired);
        }
    }

    fn destroy_retired(&self, retired: Retired) {
        self.reuse.forget(retired.object_type, retired.raw);
        // SAFETY: its owner gave it up, it is in the queue once, and the submissions that could use it are done.
        unsafe { (retired.destroy)(&self.raw, retired.raw) };
        if let Some(memory) = retired.memory {
            self.memory.free(memory, self.instance.message_log().as_ref());
        }
        self.registry.remove(retired.id);
    }
}
