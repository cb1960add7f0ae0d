//! Work goes from queue to queue, on the three families that the layer of `tests/devices-layer` plays on any device. The validation layer above
//! holds each call against the played families: any message fails. The renderer has no part in this, only Vulkan and both layers.

use std::env;
use std::path::Path;
use std::sync::Arc;

use afterlight::gpu::{Instance, InstanceOptions, Message, Validation, vk};

use super::devices::LayerSetup;
use crate::common::program::start;

/// Set for the process that has the layer.
const OWN_PROCESS: &str = "AFTERLIGHT_QUEUES_PLAYED";

const GRAPHICS: u32 = 0;
const COMPUTE: u32 = 1;
const TRANSFER: u32 = 2;

/// An image of 16 x 16 texels, of 4 bytes each.
const EDGE: u32 = 16;
const IMAGE_BYTES: u64 = 4 * (EDGE * EDGE) as u64;
const BUFFER_BYTES: u64 = 4096;
const ALL_BYTES: u64 = BUFFER_BYTES + IMAGE_BYTES;

/// The calls by which work is recorded and submitted: of Vulkan 1.0 or of `VK_KHR_synchronization2`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Api {
    Sync1,
    Sync2,
}

#[test]
fn work_goes_from_queue_to_queue_of_three_played_families() {
    let setup = LayerSetup::new();
    let own = env::args_os().next().expect("a program has a name");
    let mut command = start(Path::new(&own));
    command.args(["--exact", "queues::a_process_of_their_own", "--ignored", "--nocapture", "--test-threads", "1"]);
    command.envs(setup.environment("queues")).env(OWN_PROCESS, "1");
    let output = command.output().expect("this program starts again");
    let told = format!("{}{}", String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert!(output.status.success() && told.contains("1 passed"), "{told}");
}

/// Started by the test above.
#[test]
#[ignore = "a process of the test of played queues"]
fn a_process_of_their_own() {
    if env::var_os(OWN_PROCESS).is_none() {
        return;
    }
    for api in [Api::Sync1, Api::Sync2] {
        let mut stage = Stage::open();
        let bytes: Vec<u8> = (0..ALL_BYTES).map(|index| (index * 7 % 251) as u8).collect();
        let arrived = stage.send(api, &bytes);
        stage.use_all_queues_at_once();
        let messages = stage.close();
        assert!(messages.is_empty(), "{api:?}: {messages:#?}");
        assert!(arrived == bytes, "{api:?}: other bytes arrived than were sent");

        let mut stage = Stage::open();
        stage.take_what_nobody_released(api);
        let messages = stage.close();
        let is_known = |own: &Message| own.text.contains("acquir") && own.text.contains("release");
        assert!(
            messages.iter().any(is_known),
            "{api:?}: the validation layer does not see the played families: {messages:#?}"
        );
    }
}

/// A device with all three queues, under validation.
struct Stage {
    instance: Arc<Instance>,
    device: ash::Device,
    memory: vk::PhysicalDeviceMemoryProperties,
    /// Indexed by family.
    queues: [vk::Queue; 3],
    pools: [vk::CommandPool; 3],
    buffers: Vec<(vk::Buffer, vk::DeviceMemory)>,
    images: Vec<(vk::Image, vk::DeviceMemory)>,
    semaphores: Vec<vk::Semaphore>,
}

/// A resource that changes hands.
#[derive(Clone, Copy)]
enum Resource {
    Buffer(vk::Buffer),
    /// The image, and its layouts before and after.
    Image(vk::Image, vk::ImageLayout, vk::ImageLayout),
}

/// A barrier that orders copies, and that moves a resource from one family to another.
#[derive(Clone, Copy)]
struct Handover {
    resource: Resource,
    families: (u32, u32),
    from: (vk::PipelineStageFlags2, vk::AccessFlags2),
    to: (vk::PipelineStageFlags2, vk::AccessFlags2),
}

const COPY: vk::PipelineStageFlags2 = vk::PipelineStageFlags2::ALL_TRANSFER;
const WRITE: (vk::PipelineStageFlags2, vk::AccessFlags2) = (COPY, vk::AccessFlags2::TRANSFER_WRITE);
const READ: (vk::PipelineStageFlags2, vk::AccessFlags2) = (COPY, vk::AccessFlags2::TRANSFER_READ);
const NOTHING: (vk::PipelineStageFlags2, vk::AccessFlags2) =
    (vk::PipelineStageFlags2::BOTTOM_OF_PIPE, vk::AccessFlags2::NONE);

impl Handover {
    fn of(resource: Resource, families: (u32, u32)) -> Self {
        Self { resource, families, from: WRITE, to: READ }
    }

    /// The releasing half: it waits for the writes. The second scope has no meaning in a release.
    fn release(self) -> Self {
        Self { to: NOTHING, ..self }
    }

    /// The acquiring half. The submission waits for a semaphore at the stage of copies, so the barrier begins there.
    fn acquire(self) -> Self {
        Self { from: (COPY, vk::AccessFlags2::NONE), ..self }
    }
}

const WHOLE: vk::ImageSubresourceRange = vk::ImageSubresourceRange {
    aspect_mask: vk::ImageAspectFlags::COLOR,
    base_mip_level: 0,
    level_count: 1,
    base_array_layer: 0,
    layer_count: 1,
};

fn whole_image(buffer_offset: u64) -> vk::BufferImageCopy {
    vk::BufferImageCopy {
        buffer_offset,
        image_subresource: vk::ImageSubresourceLayers { layer_count: 1, ..Default::default() }
            .aspect_mask(vk::ImageAspectFlags::COLOR),
        image_extent: vk::Extent3D { width: EDGE, height: EDGE, depth: 1 },
        ..Default::default()
    }
}

// SAFETY of all calls below: the objects are this test's own and alive, structures live until the call returns, and one thread at a time uses each
// of them; the validation layer checks that.
impl Stage {
    fn open() -> Self {
        let options = InstanceOptions { validation: Validation::Synchronization, ..Default::default() };
        let instance = Instance::new(&options).unwrap_or_else(|error| panic!("{error}"));
        let physical = instance.physical_devices().unwrap_or_else(|error| panic!("{error}")).swap_remove(0);
        let (raw, memory) = (physical.raw, physical.memory);
        // SAFETY: as above.
        let families = unsafe { instance.raw().get_physical_device_queue_family_properties(raw) };
        let (compute, copy) = (vk::QueueFlags::COMPUTE, vk::QueueFlags::TRANSFER);
        assert!(families.len() == 3 && families.iter().all(|own| own.queue_count == 1));
        assert!(families[0].queue_flags.contains(vk::QueueFlags::GRAPHICS | compute | copy));
        assert!(families[1].queue_flags == compute | copy && families[2].queue_flags == copy);
        let mut again = [vk::QueueFamilyProperties2::default(); 2];
        // SAFETY: as above.
        unsafe { instance.raw().get_physical_device_queue_family_properties2(raw, &mut again) };
        assert!(again[1].queue_family_properties.queue_flags == families[1].queue_flags);

        let queues = [GRAPHICS, COMPUTE, TRANSFER]
            .map(|family| vk::DeviceQueueCreateInfo::default().queue_family_index(family).queue_priorities(&[1.0]));
        let mut timeline = vk::PhysicalDeviceTimelineSemaphoreFeatures::default().timeline_semaphore(true);
        let mut sync2 = vk::PhysicalDeviceSynchronization2Features::default().synchronization2(true);
        let info =
            vk::DeviceCreateInfo::default().queue_create_infos(&queues).push_next(&mut timeline).push_next(&mut sync2);
        // SAFETY: as above.
        let device = unsafe { instance.raw().create_device(raw, &info, None) }.expect("a device with three queues");
        // SAFETY: as above.
        let queues = [GRAPHICS, COMPUTE, TRANSFER].map(|family| unsafe { device.get_device_queue(family, 0) });
        assert!(queues[0] != queues[1] && queues[1] != queues[2] && queues[0] != queues[2]);
        for (family, queue) in (0..).zip(queues) {
            let info = vk::DeviceQueueInfo2::default().queue_family_index(family);
            // SAFETY: as above.
            assert!(unsafe { device.get_device_queue2(&info) } == queue, "another handle for the same queue");
        }
        let pools = [GRAPHICS, COMPUTE, TRANSFER].map(|family| {
            let info = vk::CommandPoolCreateInfo::default().queue_family_index(family);
            // SAFETY: as above.
            unsafe { device.create_command_pool(&info, None) }.expect("a pool")
        });
        let own = Self {
            instance,
            device,
            memory,
            queues,
            pools,
            buffers: Vec::new(),
            images: Vec::new(),
            semaphores: Vec::new(),
        };
        own.name_queues();
        own
    }

    /// Names the queues, and marks work of theirs, as debuggers show it.
    fn name_queues(&self) {
        if !self.instance.has_debug_utils() {
            return;
        }
        let functions = ash::ext::debug_utils::Device::new(self.instance.raw(), &self.device);
        for (queue, name) in self.queues.into_iter().zip([c"graphics", c"compute", c"transfer"]) {
            let info = vk::DebugUtilsObjectNameInfoEXT::default().object_handle(queue).object_name(name);
            let label = vk::DebugUtilsLabelEXT::default().label_name(name);
            // SAFETY: as above.
            unsafe {
                functions.set_debug_utils_object_name(&info).expect("a name");
                functions.queue_begin_debug_utils_label(queue, &label);
                functions.queue_insert_debug_utils_label(queue, &label);
                functions.queue_end_debug_utils_label(queue);
            }
        }
    }

    /// Memory of a type that has these properties.
    fn memory(&self, needed: vk::MemoryRequirements, properties: vk::MemoryPropertyFlags) -> vk::DeviceMemory {
        let fits = |(index, own): (usize, &vk::MemoryType)| {
            needed.memory_type_bits & 1 << index != 0 && own.property_flags.contains(properties)
        };
        let index = self.memory.memory_types_as_slice().iter().enumerate().position(fits).expect("memory of that kind");
        let info = vk::MemoryAllocateInfo::default().allocation_size(needed.size).memory_type_index(index as u32);
        // SAFETY: as above.
        unsafe { self.device.allocate_memory(&info, None) }.expect("memory")
    }

    /// A buffer for copies: of one family at a time near the device, or shared by all and seen by the host.
    fn buffer(&mut self, is_host: bool) -> (vk::Buffer, vk::DeviceMemory) {
        let usage = vk::BufferUsageFlags::TRANSFER_SRC | vk::BufferUsageFlags::TRANSFER_DST;
        let mut info = vk::BufferCreateInfo::default().size(ALL_BYTES).usage(usage);
        let mut properties = vk::MemoryPropertyFlags::DEVICE_LOCAL;
        let families = [GRAPHICS, COMPUTE, TRANSFER];
        if is_host {
            info = info.sharing_mode(vk::SharingMode::CONCURRENT).queue_family_indices(&families);
            properties = vk::MemoryPropertyFlags::HOST_VISIBLE | vk::MemoryPropertyFlags::HOST_COHERENT;
        }
        // SAFETY: as above.
        unsafe {
            let buffer = self.device.create_buffer(&info, None).expect("a buffer");
            let memory = self.memory(self.device.get_buffer_memory_requirements(buffer), properties);
            self.device.bind_buffer_memory(buffer, memory, 0).expect("it is bound");
            self.buffers.push((buffer, memory));
            (buffer, memory)
        }
    }

    fn image(&mut self, sharing: vk::SharingMode) -> vk::Image {
        let families = [COMPUTE, TRANSFER];
        let mut info = vk::ImageCreateInfo::default()
            .image_type(vk::ImageType::TYPE_2D)
            .format(vk::Format::R8G8B8A8_UNORM)
            .extent(vk::Extent3D { width: EDGE, height: EDGE, depth: 1 })
            .mip_levels(1)
            .array_layers(1)
            .samples(vk::SampleCountFlags::TYPE_1)
            .usage(vk::ImageUsageFlags::TRANSFER_SRC | vk::ImageUsageFlags::TRANSFER_DST)
            .sharing_mode(sharing);
        if sharing == vk::SharingMode::CONCURRENT {
            info = info.queue_family_indices(&families);
        }
        // SAFETY: as above.
        unsafe {
            let image = self.device.create_image(&info, None).expect("an image");
            let needed = self.device.get_image_memory_requirements(image);
            let memory = self.memory(needed, vk::MemoryPropertyFlags::DEVICE_LOCAL);
            self.device.bind_image_memory(image, memory, 0).expect("it is bound");
            self.images.push((image, memory));
            image
        }
    }

    fn timeline(&mut self) -> vk::Semaphore {
        let mut kind = vk::SemaphoreTypeCreateInfo::default().semaphore_type(vk::SemaphoreType::TIMELINE);
        let info = vk::SemaphoreCreateInfo::default().push_next(&mut kind);
        // SAFETY: as above.
        let semaphore = unsafe { self.device.create_semaphore(&info, None) }.expect("a semaphore");
        self.semaphores.push(semaphore);
        semaphore
    }

    /// Records a barrier of one half of a handover, or of both where the families are the same.
    fn hand_over(&self, api: Api, cmd: vk::CommandBuffer, own: Handover) {
        let (source, target) = own.families;
        let mut buffers = Vec::new();
        let mut images = Vec::new();
        match own.resource {
            Resource::Buffer(buffer) => buffers.push(
                vk::BufferMemoryBarrier2::default()
                    .src_stage_mask(own.from.0)
                    .src_access_mask(own.from.1)
                    .dst_stage_mask(own.to.0)
                    .dst_access_mask(own.to.1)
                    .src_queue_family_index(source)
                    .dst_queue_family_index(target)
                    .buffer(buffer)
                    .size(vk::WHOLE_SIZE),
            ),
            Resource::Image(image, before, after) => images.push(
                vk::ImageMemoryBarrier2::default()
                    .src_stage_mask(own.from.0)
                    .src_access_mask(own.from.1)
                    .dst_stage_mask(own.to.0)
                    .dst_access_mask(own.to.1)
                    .src_queue_family_index(source)
                    .dst_queue_family_index(target)
                    .old_layout(before)
                    .new_layout(after)
                    .image(image)
                    .subresource_range(WHOLE),
            ),
        }
        if api == Api::Sync2 {
            let info = vk::DependencyInfo::default().buffer_memory_barriers(&buffers).image_memory_barriers(&images);
            // SAFETY: as above.
            return unsafe { self.device.cmd_pipeline_barrier2(cmd, &info) };
        }
        // These stages and accesses have the same bits in both.
        let stage = |own: vk::PipelineStageFlags2| vk::PipelineStageFlags::from_raw(own.as_raw() as u32);
        let access = |own: vk::AccessFlags2| vk::AccessFlags::from_raw(own.as_raw() as u32);
        let buffers: Vec<_> = buffers
            .iter()
            .map(|own| {
                vk::BufferMemoryBarrier::default()
                    .src_access_mask(access(own.src_access_mask))
                    .dst_access_mask(access(own.dst_access_mask))
                    .src_queue_family_index(own.src_queue_family_index)
                    .dst_queue_family_index(own.dst_queue_family_index)
                    .buffer(own.buffer)
                    .size(own.size)
            })
            .collect();
        let images: Vec<_> = images
            .iter()
            .map(|own| {
                vk::ImageMemoryBarrier::default()
                    .src_access_mask(access(own.src_access_mask))
                    .dst_access_mask(access(own.dst_access_mask))
                    .src_queue_family_index(own.src_queue_family_index)
                    .dst_queue_family_index(own.dst_queue_family_index)
                    .old_layout(own.old_layout)
                    .new_layout(own.new_layout)
                    .image(own.image)
                    .subresource_range(own.subresource_range)
            })
            .collect();
        let (from, to, none) = (stage(own.from.0), stage(own.to.0), vk::DependencyFlags::empty());
        // SAFETY: as above.
        unsafe { self.device.cmd_pipeline_barrier(cmd, from, to, none, &[], &buffers, &images) };
    }

    /// Records commands for a family.
    fn record(&self, family: u32, commands: impl FnOnce(vk::CommandBuffer)) -> vk::CommandBuffer {
        let info = vk::CommandBufferAllocateInfo::default()
            .command_pool(self.pools[family as usize])
            .level(vk::CommandBufferLevel::PRIMARY)
            .command_buffer_count(1);
        let once = vk::CommandBufferBeginInfo::default().flags(vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT);
        // SAFETY: as above.
        unsafe {
            let cmd = self.device.allocate_command_buffers(&info).expect("a command buffer")[0];
            self.device.begin_command_buffer(cmd, &once).expect("it begins");
            commands(cmd);
            self.device.end_command_buffer(cmd).expect("it ends");
            cmd
        }
    }

    /// Submits to a family's queue. Copies wait until the timeline has the value before `signals`.
    fn submit(&self, api: Api, family: u32, cmd: vk::CommandBuffer, (timeline, signals): (vk::Semaphore, u64)) {
        let queue = self.queues[family as usize];
        let waits = signals - 1;
        let submitted = match api {
            Api::Sync1 => {
                let (values, semaphores) = ([waits], [timeline]);
                let signalled = [signals];
                let mut of_timeline = vk::TimelineSemaphoreSubmitInfo::default()
                    .wait_semaphore_values(&values)
                    .signal_semaphore_values(&signalled);
                let (stages, commands) = ([vk::PipelineStageFlags::TRANSFER], [cmd]);
                let info = vk::SubmitInfo::default()
                    .wait_semaphores(&semaphores)
                    .wait_dst_stage_mask(&stages)
                    .signal_semaphores(&semaphores)
                    .command_buffers(&commands)
                    .push_next(&mut of_timeline);
                // SAFETY: as above.
                unsafe { self.device.queue_submit(queue, &[info], vk::Fence::null()) }
            }
            Api::Sync2 => {
                let point = |value| vk::SemaphoreSubmitInfo::default().semaphore(timeline).value(value);
                let waited = [point(waits).stage_mask(COPY)];
                let signalled = [point(signals).stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)];
                let commands = [vk::CommandBufferSubmitInfo::default().command_buffer(cmd)];
                let info = vk::SubmitInfo2::default()
                    .wait_semaphore_infos(&waited)
                    .signal_semaphore_infos(&signalled)
                    .command_buffer_infos(&commands);
                // SAFETY: as above.
                unsafe { self.device.queue_submit2(queue, &[info], vk::Fence::null()) }
            }
        };
        submitted.expect("it is submitted");
    }

    /// Sends bytes up on the transfer queue, through the compute queue and down on the graphics queue: a buffer's bytes, then an
    /// image's, whose layout changes with its owner.
    fn send(&mut self, api: Api, bytes: &[u8]) -> Vec<u8> {
        let [(up, up_memory), (down, down_memory)] = [self.buffer(true), self.buffer(true)];
        let [(first, _), (second, _)] = [self.buffer(false), self.buffer(false)];
        let image = self.image(vk::SharingMode::EXCLUSIVE);
        self.image(vk::SharingMode::CONCURRENT);
        let timeline = self.timeline();
        let length = bytes.len();
        // SAFETY: as above.
        unsafe {
            let place = self.device.map_memory(up_memory, 0, vk::WHOLE_SIZE, vk::MemoryMapFlags::empty());
            place.expect("it is mapped").cast::<u8>().copy_from_nonoverlapping(bytes.as_ptr(), length);
        }
        let [undefined, written, read] =
            [vk::ImageLayout::UNDEFINED, vk::ImageLayout::TRANSFER_DST_OPTIMAL, vk::ImageLayout::TRANSFER_SRC_OPTIMAL];
        let ours = (vk::QUEUE_FAMILY_IGNORED, vk::QUEUE_FAMILY_IGNORED);
        let of_first = Handover::of(Resource::Buffer(first), (TRANSFER, COMPUTE));
        let of_image = Handover::of(Resource::Image(image, written, read), (TRANSFER, COMPUTE));
        let of_second = Handover::of(Resource::Buffer(second), (COMPUTE, GRAPHICS));
        let copy = |size| [vk::BufferCopy { src_offset: 0, dst_offset: 0, size }];
        let device = &self.device;

        let uploads = self.record(TRANSFER, |cmd| {
            let new = Handover::of(Resource::Image(image, undefined, written), ours);
            self.hand_over(api, cmd, Handover { from: (COPY, vk::AccessFlags2::NONE), to: WRITE, ..new });
            // SAFETY: as above.
            unsafe {
                device.cmd_copy_buffer(cmd, up, first, &copy(BUFFER_BYTES));
                device.cmd_copy_buffer_to_image(cmd, up, image, written, &[whole_image(BUFFER_BYTES)]);
            }
            self.hand_over(api, cmd, of_first.release());
            self.hand_over(api, cmd, of_image.release());
        });
        let gathers = self.record(COMPUTE, |cmd| {
            self.hand_over(api, cmd, of_first.acquire());
            self.hand_over(api, cmd, of_image.acquire());
            // SAFETY: as above.
            unsafe {
                device.cmd_copy_buffer(cmd, first, second, &copy(BUFFER_BYTES));
                device.cmd_copy_image_to_buffer(cmd, image, read, second, &[whole_image(BUFFER_BYTES)]);
            }
            self.hand_over(api, cmd, of_second.release());
        });
        let reads_back = self.record(GRAPHICS, |cmd| {
            self.hand_over(api, cmd, of_second.acquire());
            // SAFETY: as above.
            unsafe { device.cmd_copy_buffer(cmd, second, down, &copy(ALL_BYTES)) };
            let to_host = (vk::PipelineStageFlags2::HOST, vk::AccessFlags2::HOST_READ);
            self.hand_over(api, cmd, Handover { to: to_host, ..Handover::of(Resource::Buffer(down), ours) });
        });
        for (signals, family, cmd) in [(1, TRANSFER, uploads), (2, COMPUTE, gathers), (3, GRAPHICS, reads_back)] {
            self.submit(api, family, cmd, (timeline, signals));
        }
        let (semaphores, values) = ([timeline], [3]);
        let last = vk::SemaphoreWaitInfo::default().semaphores(&semaphores).values(&values);
        // SAFETY: as above; the mapped memory is at least as long.
        unsafe {
            device.wait_semaphores(&last, u64::MAX).expect("all of it ends");
            let place = device.map_memory(down_memory, 0, vk::WHOLE_SIZE, vk::MemoryMapFlags::empty());
            std::slice::from_raw_parts(place.expect("it is mapped").cast::<u8>(), length).to_vec()
        }
    }

    /// Submits from three threads, one for each queue. Vulkan allows that; the layer must lock the one real queue.
    fn use_all_queues_at_once(&self) {
        std::thread::scope(|scope| {
            for queue in self.queues {
                scope.spawn(move || {
                    for _ in 0..64 {
                        let none = vk::SubmitInfo::default();
                        // SAFETY: as above.
                        unsafe {
                            self.device.queue_submit(queue, &[none], vk::Fence::null()).expect("it is submitted");
                            self.device.queue_wait_idle(queue).expect("it ends");
                        }
                    }
                });
            }
        });
    }

    /// Acquires a buffer for the compute queue that the transfer queue never released: a mistake on a device with such queues alone.
    fn take_what_nobody_released(&mut self, api: Api) {
        let (buffer, _) = self.buffer(false);
        let timeline = self.timeline();
        let of_buffer = Handover::of(Resource::Buffer(buffer), (TRANSFER, COMPUTE));
        let cmd = self.record(COMPUTE, |cmd| self.hand_over(api, cmd, of_buffer.acquire()));
        self.submit(api, COMPUTE, cmd, (timeline, 1));
    }

    /// Destroys everything, and returns the messages of the validation layer.
    fn close(self) -> Vec<Message> {
        let device = &self.device;
        // SAFETY: as above; nothing is in flight any more.
        unsafe {
            device.device_wait_idle().expect("all of it ends");
            self.pools.iter().for_each(|&pool| device.destroy_command_pool(pool, None));
            self.buffers.iter().for_each(|&(buffer, _)| device.destroy_buffer(buffer, None));
            self.images.iter().for_each(|&(image, _)| device.destroy_image(image, None));
            let all =
                self.buffers.iter().map(|&(_, memory)| memory).chain(self.images.iter().map(|&(_, memory)| memory));
            all.for_each(|memory| device.free_memory(memory, None));
            self.semaphores.iter().for_each(|&semaphore| device.destroy_semaphore(semaphore, None));
            device.destroy_device(None);
        }
        let log = self.instance.message_log();
        drop(self.instance);
        log.take().into_iter().filter(Message::is_about_this_program).collect()
    }
}
