//! The logical device: a queue for graphics, compute and transfer, others that the device has beside it, and the state that every object on it shares.

use std::collections::{BTreeMap, BTreeSet};
use std::ffi::{CStr, CString, c_char};
use std::fmt;
use std::fs::File;
use std::io::{Seek as _, SeekFrom, Write as _};
use std::sync::{Arc, Mutex, PoisonError};

use ash::vk;
use ash::vk::Handle;

use super::command::RecordedBy2;
use super::error::{Doing, Error, Result};
use super::feature_set::FeatureSet;
use super::functions::Functions;
use super::instance::{Instance, Validation};
use super::instrumentation::Instrumentation;
use super::journal::{Arguments, Command};
use super::memory::{MemoryAllocator, leak};
use super::newer::{UNIFIED_LAYOUTS, UnifiedLayoutsFeatures};
use super::opening::{Opened, open};
use super::owned::{Registry, RetireQueue};
use super::physical::{DeviceChoice, PhysicalDevice, choose};
use super::pipeline_cache::PipelineCache;
use super::queues::Queue;
use super::reuse::Reuse;
use super::submission::{CountingQueue, Submissions};

/// The optional features that are enabled: all features of the device that this program can use.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct EnabledFeatures {
    /// Depth is clamped instead of clipped: casters behind a light's near plane still cast.
    pub depth_clamp: bool,
    /// Anisotropic filtering, up to `limits.max_sampler_anisotropy`.
    pub sampler_anisotropy: bool,
    /// Shaders that run for each sample; multisampled input attachments need it.
    pub sample_rate_shading: bool,
    /// Fragment shaders know the number of their triangle; geometry shaders themselves have no use here.
    pub geometry_shader: bool,
    /// Shaders look textures of an array up by numbers that differ from invocation to invocation (`VK_EXT_descriptor_indexing`).
    pub non_uniform_textures: bool,
    /// Many commands that draw are read from a buffer by one.
    pub multi_draw_indirect: bool,
    /// And begin at any instance.
    pub draw_indirect_first_instance: bool,
    /// BC formats.
    pub texture_compression_bc: bool,
    /// ETC2 formats.
    pub texture_compression_etc2: bool,
    /// The device is Vulkan in part only (MoltenVK); the extension that says so is enabled.
    pub portability_subset: bool,
    /// The driver tells how full its heaps are.
    pub memory_budget: bool,
    /// Images of a swapchain can be viewed in another format than their own. Only of a device that has swapchains.
    pub mutable_swapchains: bool,
    /// A submission can say that it ends a frame, for tools that capture frames of a program without a window (VK_EXT_frame_boundary).
    pub frame_boundary: bool,
    /// Layouts may be destroyed while pipelines that were made with them live on (VK_KHR_maintenance4): only then pipelines are kept for reuse.
    pub maintenance4: bool,
    /// Blend states may differ from attachment to attachment.
    pub independent_blend: bool,
    /// Barriers, submissions and times by VK_KHR_synchronization2.
    pub synchronization2: bool,
    /// Render passes by VK_KHR_create_renderpass2, whose dependencies take the masks of synchronization2.
    pub render_pass2: bool,
    /// Rendering without render passes, in which draws read attachments at their own pixel (VK_KHR_dynamic_rendering_local_read, with the extensions that it
    /// needs).
    pub local_read: bool,
    /// Images may stay in GENERAL without a loss (VK_KHR_unified_image_layouts).
    pub unified_layouts: bool,
    /// Other queues than the first can be had, with the semaphores that count their submissions (VK_KHR_timeline_semaphore).
    pub other_queues: bool,
    /// The driver tells which subpasses it merges (VK_EXT_subpass_merge_feedback), where a render pass of VK_KHR_create_renderpass2 asks for it.
    pub merge_feedback: bool,
}

impl EnabledFeatures {
    /// `required` are the extensions that the device is opened with in any case.
    pub(super) fn of(physical: &PhysicalDevice, required: &[&'static CStr]) -> EnabledFeatures {
        let has = |name: &CStr| physical.extensions.contains(&*name.to_string_lossy());
        EnabledFeatures {
            depth_clamp: physical.features.depth_clamp == vk::TRUE,
            sampler_anisotropy: physical.features.sampler_anisotropy == vk::TRUE,
            sample_rate_shading: physical.features.sample_rate_shading == vk::TRUE,
            geometry_shader: physical.features.geometry_shader == vk::TRUE,
            non_uniform_textures: physical.non_uniform_textures,
            multi_draw_indirect: physical.features.multi_draw_indirect == vk::TRUE,
            draw_indirect_first_instance: physical.features.draw_indirect_first_instance == vk::TRUE,
            texture_compression_bc: physical.features.texture_compression_bc == vk::TRUE,
            texture_compression_etc2: physical.features.texture_compression_etc2 == vk::TRUE,
            portability_subset: has(ash::khr::portability_subset::NAME),
            memory_budget: has(ash::ext::memory_budget::NAME),
            mutable_swapchains: required.contains(&ash::khr::swapchain::NAME)
                && MUTABLE_SWAPCHAINS.into_iter().all(has),
            // A device with the extension has its one feature (specification, "Feature Requirements"). The feature is not queried, because
            // gfxreconstruct's layer offers the extension for drivers that lack it, and leaves the answer to them.
            frame_boundary: has(ash::ext::frame_boundary::NAME),
            // A device with this extension has its feature, too.
            maintenance4: has(ash::khr::maintenance4::NAME),
            independent_blend: physical.features.independent_blend == vk::TRUE,
            synchronization2: physical.newer.synchronization2.is_ok(),
            render_pass2: has(ash::khr::create_renderpass2::NAME),
            local_read: physical.newer.local_read.is_ok(),
            unified_layouts: physical.newer.unified_layouts.is_ok(),
            other_queues: [Queue::Compute, Queue::Transfer].into_iter().any(|own| physical.family_of(own).is_some()),
            merge_feedback: physical.newer.merge_feedback,
        }
    }

    /// The structures of features that a device is opened with. A structure whose features are all absent must not be chained.
    pub(super) fn asked(&self) -> FeatureSet {
        FeatureSet {
            core: self.core(),
            indexing: vk::PhysicalDeviceDescriptorIndexingFeatures::default()
                .shader_sampled_image_array_non_uniform_indexing(self.non_uniform_textures),
            maintenance4: vk::PhysicalDeviceMaintenance4Features::default().maintenance4(self.maintenance4),
            synchronization2: vk::PhysicalDeviceSynchronization2Features::default()
                .synchronization2(self.synchronization2),
            rendering: vk::PhysicalDeviceDynamicRenderingFeatures::default().dynamic_rendering(self.local_read),
            local_read: vk::PhysicalDeviceDynamicRenderingLocalReadFeaturesKHR::default()
                .dynamic_rendering_local_read(self.local_read),
            ..FeatureSet::default()
        }
    }

    fn core(&self) -> vk::PhysicalDeviceFeatures {
        vk::PhysicalDeviceFeatures::default()
            .depth_clamp(self.depth_clamp)
            .sampler_anisotropy(self.sampler_anisotropy)
            .sample_rate_shading(self.sample_rate_shading)
            .independent_blend(self.independent_blend)
            .geometry_shader(self.geometry_shader)
            .shader_sampled_image_array_dynamic_indexing(self.non_uniform_textures)
            .multi_draw_indirect(self.multi_draw_indirect)
            .draw_indirect_first_instance(self.draw_indirect_first_instance)
            .texture_compression_bc(self.texture_compression_bc)
            .texture_compression_etc2(self.texture_compression_etc2)
    }

    pub(super) fn extensions(&self) -> impl Iterator<Item = &'static CStr> {
        // A device that has the portability subset must be given it.
        let subset = self.portability_subset.then_some(ash::khr::portability_subset::NAME);
        let mutable = self.mutable_swapchains.then_some(MUTABLE_SWAPCHAINS).into_iter().flatten();
        let indexing = self.non_uniform_textures.then_some(ash::ext::descriptor_indexing::NAME);
        let budget = self.memory_budget.then_some(ash::ext::memory_budget::NAME);
        let boundary = self.frame_boundary.then_some(ash::ext::frame_boundary::NAME);
        let maintenance = self.maintenance4.then_some(ash::khr::maintenance4::NAME);
        let synchronization = self.synchronization2.then_some(ash::khr::synchronization2::NAME);
        let pass2 = self.render_pass2.then_some(ash::khr::create_renderpass2::NAME);
        let local_read = self.local_read.then_some(LOCAL_READ).into_iter().flatten();
        let unified = self.unified_layouts.then_some(UNIFIED_LAYOUTS);
        let merging = self.merge_feedback.then_some(ash::ext::subpass_merge_feedback::NAME);
        let timeline = self.other_queues.then_some(ash::khr::timeline_semaphore::NAME);
        [subset, indexing, budget, boundary, maintenance, synchronization, pass2, unified, merging, timeline]
            .into_iter()
            .flatten()
            .chain(mutable)
            .chain(local_read)
    }
}

/// The second is a part of Vulkan 1.2, and drivers of that still name it.
const MUTABLE_SWAPCHAINS: [&CStr; 2] = [ash::khr::swapchain_mutable_format::NAME, ash::khr::image_format_list::NAME];

/// Synchronization2, and the extension by which render passes take its masks.
pub(super) const SYNCHRONIZATION2: [&CStr; 2] = [ash::khr::synchronization2::NAME, ash::khr::create_renderpass2::NAME];

/// Local read, and the extensions that it needs on Vulkan 1.1.
pub(super) const LOCAL_READ: [&CStr; 4] = [
    ash::khr::dynamic_rendering_local_read::NAME,
    ash::khr::dynamic_rendering::NAME,
    ash::khr::depth_stencil_resolve::NAME,
    ash::khr::create_renderpass2::NAME,
];

const BEGIN_LABEL: &str = "vkCmdBeginDebugUtilsLabelEXT";
const END_LABEL: &str = "vkCmdEndDebugUtilsLabelEXT";

/// Longer than any label of the program, so that each covers the one before it in a file.
const LABEL_BYTES: usize = 80;

/// A logical device with its queue, memory, pipeline cache and retire queue. Shared by everything made on it.
pub struct Device {
    /// The device's functions.
    pub raw: Functions,
    /// The physical device: its properties and features.
    pub physical: PhysicalDevice,
    /// The instance, which outlives the device.
    pub instance: Arc<Instance>,
    /// The family of the queue that does graphics, compute and transfers.
    pub queue_family: u32,
    /// The optional features that are enabled.
    pub features: EnabledFeatures,
    debug_utils: Option<ash::ext::debug_utils::Device>,
    pub(super) recorded_by_2: RecordedBy2,
    labels: Mutex<BTreeSet<String>>,
    last_label: Mutex<Option<File>>,
    shaders: Mutex<Option<BTreeMap<String, Vec<u32>>>>,
    pub(super) submissions: Submissions,
    pub(super) registry: Registry,
    pub(super) retired: RetireQueue,
    pub(super) reuse: Reuse,
    pub(super) memory: MemoryAllocator,
    pub(super) pipeline_cache: PipelineCache,
}

impl Device {
    /// Opens the device that `choice` means.
    ///
    /// # Errors
    /// [`Error::NoDriver`], [`Error::NoSuchDevice`], [`Error::Unsupported`] for a device of Vulkan 1.0; the driver's errors.
    pub fn new(instance: &Arc<Instance>, choice: &DeviceChoice) -> Result<Arc<Device>> {
        Device::with_extensions(instance, choice, &[])
    }

    /// As [`Device::new`], with device extensions that must exist, such as `VK_KHR_swapchain`.
    ///
    /// # Errors
    /// As [`Device::new`], and [`Error::Unsupported`] naming an extension that is missing.
    pub fn with_extensions(
        instance: &Arc<Instance>,
        choice: &DeviceChoice,
        required: &[&'static CStr],
    ) -> Result<Arc<Device>> {
        let mut devices = instance.physical_devices()?;
        let physical = devices.swap_remove(choose(&devices, choice)?);
        let Some(queue_family) = physical.queue_family else {
            return Err(Error::Unsupported(format!("'{}' has no queue for graphics and compute", physical.name)));
        };
        if let Some(missing) = required.iter().find(|name| !physical.extensions.contains(&*name.to_string_lossy())) {
            return Err(Error::Unsupported(format!("'{}' lacks {}", physical.name, missing.to_string_lossy())));
        }
        let Opened { raw, physical, features } = open(instance, physical, queue_family, required)?;
        // SAFETY: the device is new; destroyed once, here, if the rest of it cannot be had.
        let memory = MemoryAllocator::new(instance.raw(), &raw, &physical).inspect_err(|_| unsafe {
            raw.destroy_device(None);
        })?;
        let queues = open_queues(&raw, &physical, queue_family).inspect_err(|_| {
            // SAFETY: as above.
            unsafe { raw.destroy_device(None) };
        })?;
        let debug_utils = instance.has_debug_utils().then(|| ash::ext::debug_utils::Device::new(instance.raw(), &raw));
        let pipeline_cache = PipelineCache::open(&raw, &physical);
        let device = Device {
            raw: Functions::new(instance.raw(), raw, &features),
            physical,
            instance: Arc::clone(instance),
            queue_family,
            features,
            debug_utils,
            recorded_by_2: RecordedBy2::default(),
            labels: Mutex::default(),
            last_label: Mutex::default(),
            shaders: Mutex::default(),
            submissions: Submissions::new(queues),
            registry: Registry::default(),
            retired: RetireQueue::default(),
            reuse: Reuse::default(),
            memory,
            pipeline_cache,
        };
        for (queue, own) in Queue::ALL.into_iter().zip(queues) {
            let Some(own) = own else { continue };
            device.name_object(own.raw, queue.name());
            own.timeline
                .into_iter()
                .for_each(|count| device.name_object(count, &format!("count of the {}", queue.name())));
        }
        Ok(Arc::new(device))
    }

    /// Names an object for layers and debuggers, where VK_EXT_debug_utils is there.
    pub fn name_object<H: Handle + Copy>(&self, object: H, name: &str) {
        self.raw.journal.name(object, name);
        let Some(debug_utils) = &self.debug_utils else { return };
        let name = c_text(name);
        let info = vk::DebugUtilsObjectNameInfoEXT::default().object_handle(object).object_name(&name);
        // A name that cannot be set is no reason to stop; only running out of host memory can be the cause.
        // SAFETY: the object belongs to this device (the module's contract).
        let _ = unsafe { debug_utils.set_debug_utils_object_name(&info) };
    }

    /// Opens a labelled region in a command buffer, for layers and debuggers.
    pub fn begin_label(&self, cmd: vk::CommandBuffer, name: &str) {
        self.tell_label(name);
        self.raw.journal.note(cmd, BEGIN_LABEL, |_| Arguments::objects([name.to_owned()]));
        let Some(debug_utils) = &self.debug_utils else { return };
        let text = c_text(name);
        let label = vk::DebugUtilsLabelEXT::default().label_name(&text);
        // SAFETY: the command buffer is recording (the module's contract).
        unsafe { debug_utils.cmd_begin_debug_utils_label(cmd, &label) };
        let mut labels = self.labels.lock().unwrap_or_else(PoisonError::into_inner);
        if !labels.contains(name) {
            labels.insert(name.to_owned());
        }
    }

    /// The labels of all regions that were opened since the last call, sorted; empty without VK_EXT_debug_utils.
    pub fn take_labels(&self) -> Vec<String> {
        std::mem::take(&mut *self.labels.lock().unwrap_or_else(PoisonError::into_inner)).into_iter().collect()
    }

    /// Keeps the name of the last labelled region that was recorded in a file, so that it shows how far a crashed process came.
    pub fn tell_labels_to(&self, file: File) {
        *self.last_label.lock().unwrap_or_else(PoisonError::into_inner) = Some(file);
    }

    /// Writes over the label before. A file that cannot be written is no reason to stop.
    fn tell_label(&self, name: &str) {
        if let Some(file) = &mut *self.last_label.lock().unwrap_or_else(PoisonError::into_inner) {
            let line = format!("{name:LABEL_BYTES$}\n");
            let _ = file.seek(SeekFrom::Start(0)).and_then(|_| file.write_all(line.as_bytes()));
        }
    }

    /// Keeps the SPIR-V of all pipelines that are made from now on, for [`Device::take_shaders`].
    pub fn keep_shaders(&self) {
        self.shaders.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert_default();
    }

    /// Returns the SPIR-V that was kept, by pipeline name and stage, and stops keeping it.
    pub fn take_shaders(&self) -> BTreeMap<String, Vec<u32>> {
        self.shaders.lock().unwrap_or_else(PoisonError::into_inner).take().unwrap_or_default()
    }

    pub(super) fn keep_shader(&self, name: impl FnOnce() -> String, spirv: &[u32]) {
        if let Some(shaders) = &mut *self.shaders.lock().unwrap_or_else(PoisonError::into_inner) {
            shaders.insert(name(), spirv.to_vec());
        }
    }

    /// Begins a journal of all commands that are recorded on the device, with the names of objects that are made from now on, for
    /// [`Device::take_commands`]. Where one is kept already, it goes on with the names that it has, and without its commands.
    pub fn keep_commands(&self) {
        self.raw.journal.start();
    }

    /// The commands of the journal, in the order of recording, and stops the journal. Labels are among them even where VK_EXT_debug_utils is not
    /// there to record them.
    pub fn take_commands(&self) -> Vec<Command> {
        self.raw.journal.stop()
    }

    /// Closes the region that the last [`Device::begin_label`] opened.
    pub fn end_label(&self, cmd: vk::CommandBuffer) {
        self.raw.journal.note(cmd, END_LABEL, |_| Arguments::default());
        let Some(debug_utils) = &self.debug_utils else { return };
        // SAFETY: the command buffer is recording, with a label open (the module's contract).
        unsafe { debug_utils.cmd_end_debug_utils_label(cmd) };
    }

    /// Writes the pipeline cache to disk if it has grown since. Failing to is never an error: it only costs time later. It needs the feature
    /// `caches`.
    #[cfg(feature = "caches")]
    pub fn save_pipeline_cache(&self) {
        self.pipeline_cache.save(&self.raw);
    }
}

impl fmt::Debug for Device {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.physical.fmt(f)
    }
}

impl Drop for Device {
    fn drop(&mut self) {
        if !self.settle() {
            let log = self.instance.message_log();
            log.push(leak("the device stays, with all that is on it: there was no memory to wait for its end".into()));
            self.memory.keep();
            std::mem::forget(Arc::clone(&self.instance));
            return;
        }
        self.give_up_kept();
        self.destroy_all_retired();
        #[cfg(feature = "caches")]
        self.save_pipeline_cache();
        self.pipeline_cache.destroy(&self.raw);
        self.submissions.destroy(&self.raw);
        // Owners hold the device, so an object that is left was never given to one, or its owner lost it.
        let log = self.instance.message_log();
        for object in self.registry.lock().objects.values() {
            log.push(leak(format!("{:?} '{}' was never destroyed", object.object_type, object.name)));
        }
        self.memory.close(&log);
        // SAFETY: everything that this module made on it is destroyed, and nobody else has the device.
        unsafe { self.raw.destroy_device(None) };
    }
}

/// The text up to its first NUL, as Vulkan takes it.
fn c_text(text: &str) -> CString {
    let until_nul = text.split('\0').next().unwrap_or_default();
    CString::new(until_nul).unwrap_or_default()
}

/// The queues that the device was created with. Where there are several, each has a semaphore that counts.
fn open_queues(raw: &ash::Device, physical: &PhysicalDevice, first: u32) -> Result<[Option<CountingQueue>; 3]> {
    let family = |queue| if queue == Queue::Graphics { Some(first) } else { physical.family_of(queue) };
    let count = Queue::ALL.into_iter().filter_map(family).count();
    let mut opened = [None; 3];
    for queue in Queue::ALL {
        let Some(family) = family(queue) else { continue };
        let mut kind = vk::SemaphoreTypeCreateInfo::default().semaphore_type(vk::SemaphoreType::TIMELINE);
        let info = vk::SemaphoreCreateInfo::default().push_next(&mut kind);
        // SAFETY: the device was created with one queue of each of these families, and with semaphores that count where there are several.
        let made = (count > 1).then(|| unsafe { raw.create_semaphore(&info, None) }).transpose();
        let timeline = made.doing("vkCreateSemaphore", || format!("creating the count of the {}", queue.name()));
        let timeline = timeline.inspect_err(|_| {
            let earlier = opened.iter().flatten().filter_map(|own: &CountingQueue| own.timeline);
            // SAFETY: nothing uses them yet.
            earlier.for_each(|semaphore| unsafe { raw.destroy_semaphore(semaphore, None) });
        })?;
        // SAFETY: as above.
        let raw = unsafe { raw.get_device_queue(family, 0) };
        opened[queue.index()] = Some(CountingQueue::new(raw, timeline));
    }
    Ok(opened)
}

pub(super) fn create(
    instance: &Instance,
    physical: &PhysicalDevice,
    queue_family: u32,
    features: &EnabledFeatures,
    required: &[&'static CStr],
) -> Result<ash::Device> {
    let mut names: Vec<&CStr> = features.extensions().chain(required.iter().copied()).collect();
    names.sort_unstable();
    names.dedup();
    let names: Vec<*const c_char> = names.into_iter().map(CStr::as_ptr).collect();
    let queue = |family| vk::DeviceQueueCreateInfo::default().queue_family_index(family).queue_priorities(&[1.0]);
    let families = Queue::ALL.into_iter().filter_map(|queue| physical.family_of(queue));
    let queues: Vec<_> = families.filter(|_| features.other_queues).map(queue).collect();
    let queues = if features.other_queues { queues } else { vec![queue(queue_family)] };
    let mut instrumentation = match instance.validation() {
        Validation::GpuAssisted => Instrumentation::of(instance, physical)?,
        _ => Instrumentation::default(),
    };
    let mut asked = features.asked();
    let core = instrumentation.with(asked.core);
    let info = vk::DeviceCreateInfo::default()
        .queue_create_infos(&queues)
        .enabled_extension_names(&names)
        .enabled_features(&core);
    let (mut info, is_with_1_2) = instrumentation.chain(info, features.non_uniform_textures);
    // The structure of Vulkan 1.2 has the same feature, and is chained in place of this one.
    if features.non_uniform_textures && !is_with_1_2 {
        info = info.push_next(&mut asked.indexing);
    }
    let mut frame_boundary = vk::PhysicalDeviceFrameBoundaryFeaturesEXT::default().frame_boundary(true);
    if features.frame_boundary {
        info = info.push_next(&mut frame_boundary);
    }
    if features.maintenance4 {
        info = info.push_next(&mut asked.maintenance4);
    }
    if features.synchronization2 {
        info = info.push_next(&mut asked.synchronization2);
    }
    if features.local_read {
        info = info.push_next(&mut asked.rendering).push_next(&mut asked.local_read);
    }
    let mut unified = UnifiedLayoutsFeatures::new(true);
    if features.unified_layouts {
        info = info.push_next(&mut unified);
    }
    let mut timeline = vk::PhysicalDeviceTimelineSemaphoreFeatures::default().timeline_semaphore(true);
    if features.other_queues && !is_with_1_2 {
        info = info.push_next(&mut timeline);
    }
    let mut merging = vk::PhysicalDeviceSubpassMergeFeedbackFeaturesEXT::default().subpass_merge_feedback(true);
    if features.merge_feedback {
        info = info.push_next(&mut merging);
    }
    // SAFETY: the device was listed by this instance; it has these extensions and features; all that the structures
    // point to lives until the call returns.
    let opened = unsafe { instance.raw().create_device(physical.raw, &info, None) };
    if let Err(result @ (vk::Result::ERROR_EXTENSION_NOT_PRESENT | vk::Result::ERROR_FEATURE_NOT_PRESENT)) = opened {
        let mut listed: Vec<_> =
            features.extensions().chain(required.iter().copied()).map(CStr::to_string_lossy).collect();
        listed.sort_unstable();
        return Err(Error::Unsupported(format!(
            "'{}' lists {} and does not open with all of them ({result:?}): a fault of its driver or of a layer",
            physical.name,
            listed.join(", ")
        )));
    }
    opened.doing("vkCreateDevice", || format!("opening the device '{}'", physical.name))
}

#[cfg(test)]
mod tests {
    use super::super::memory::{Location, MemoryNeed};
    use super::*;
    use crate::{InstanceOptions, MessageKind};

    #[test]
    fn memory_that_outlives_its_device_is_reported_as_a_leak() -> std::result::Result<(), Box<dyn std::error::Error>> {
        let instance = Instance::new(&InstanceOptions::default()).map_err(|error| error.to_string())?;
        let log = instance.message_log();
        let device = Device::new(&instance, &DeviceChoice::Auto)?;
        let requirements = vk::MemoryRequirements { size: 512, alignment: 16, memory_type_bits: !0 };
        let (location, name) = (Location::Device, "orphan");
        device.memory.allocate(&MemoryNeed { name, requirements, location, linear: true, dedicated_to: None })?;
        drop((device, instance));
        let leaks: Vec<_> = log.take().into_iter().filter(|message| message.kind == MessageKind::Leak).collect();
        assert!(leaks.len() == 1 && leaks[0].text.contains("'orphan' (512 bytes)"), "{leaks:?}");
        Ok(())
    }

    #[test]
    fn a_name_with_a_nul_in_it_ends_there() {
        assert_eq!(c_text("albedo\0x").as_c_str(), c"albedo");
    }
}
