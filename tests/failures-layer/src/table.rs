//! The commands of Vulkan that can fail, and those that free what others made. Written from vk.xml 1.4.309 by the test
//! `failures::the_table_is_that_of_the_registry` with `AFTERLIGHT_BLESS=1`.

use ash::vk;

fallible! {
    vkAcquireNextImage2KHR: PFN_vkAcquireNextImage2KHR(device: vk::Device, acquire_info: *const vk::AcquireNextImageInfoKHR<'_>, image_index: *mut u32) {
        errors [ERROR_OUT_OF_HOST_MEMORY, ERROR_OUT_OF_DEVICE_MEMORY, ERROR_DEVICE_LOST, ERROR_OUT_OF_DATE_KHR, ERROR_SURFACE_LOST_KHR], successes [TIMEOUT, NOT_READY, SUBOPTIMAL_KHR]
    }
    vkAcquireNextImageKHR: PFN_vkAcquireNextImageKHR(device: vk::Device, swapchain: vk::SwapchainKHR, timeout: u64, semaphore: vk::Semaphore, fence: vk::Fence, image_index: *mut u32) {
        errors [ERROR_OUT_OF_HOST_MEMORY, ERROR_OUT_OF_DEVICE_MEMORY, ERROR_DEVICE_LOST, ERROR_OUT_OF_DATE_KHR, ERROR_SURFACE_LOST_KHR], successes [TIMEOUT, NOT_READY, SUBOPTIMAL_KHR]
    }
    vkAllocateCommandBuffers: PFN_vkAllocateCommandBuffers(device: vk::Device, allocate_info: *const vk::CommandBufferAllocateInfo<'_>, command_buffers: *mut vk::CommandBuffer) {
        errors [ERROR_OUT_OF_HOST_MEMORY, ERROR_OUT_OF_DEVICE_MEMORY], successes [], handles command_buffers ((*allocate_info).command_buffer_count)
    }
    vkAllocateDescriptorSets: PFN_vkAllocateDescriptorSets(device: vk::Device, allocate_info: *const vk::DescriptorSetAllocateInfo<'_>, descriptor_sets: *mut vk::DescriptorSet) {
        errors [ERROR_OUT_OF_HOST_MEMORY, ERROR_OUT_OF_DEVICE_MEMORY, ERROR_FRAGMENTED_POOL, ERROR_OUT_OF_POOL_MEMORY], successes [], handles descriptor_sets ((*allocate_info).descriptor_set_count)
    }
    vkAllocateMemory: PFN_vkAllocateMemory(device: vk::Device, allocate_info: *const vk::MemoryAllocateInfo<'_>, allocator: *const vk::AllocationCallbacks<'_>, memory: *mut vk::DeviceMemory) {
        errors [ERROR_OUT_OF_HOST_MEMORY, ERROR_OUT_OF_DEVICE_MEMORY, ERROR_INVALID_EXTERNAL_HANDLE], successes [], callbacks allocator
    }
    vkBeginCommandBuffer: PFN_vkBeginCommandBuffer(command_buffer: vk::CommandBuffer, begin_info: *const vk::CommandBufferBeginInfo<'_>) {
        errors [ERROR_OUT_OF_HOST_MEMORY, ERROR_OUT_OF_DEVICE_MEMORY], successes []
    }
    vkBindBufferMemory: PFN_vkBindBufferMemory(device: vk::Device, buffer: vk::Buffer, memory: vk::DeviceMemory, memory_offset: vk::DeviceSize) {
        errors [ERROR_OUT_OF_HOST_MEMORY, ERROR_OUT_OF_DEVICE_MEMORY], successes []
    }
    vkBindBufferMemory2: PFN_vkBindBufferMemory2(device: vk::Device, bind_info_count: u32, bind_infos: *const vk::BindBufferMemoryInfo<'_>) {
        errors [ERROR_OUT_OF_HOST_MEMORY, ERROR_OUT_OF_DEVICE_MEMORY], successes []
    }
    vkBindImageMemory: PFN_vkBindImageMemory(device: vk::Device, image: vk::Image, memory: vk::DeviceMemory, memory_offset: vk::DeviceSize) {
        errors [ERROR_OUT_OF_HOST_MEMORY, ERROR_OUT_OF_DEVICE_MEMORY], successes []
    }
    vkBindImageMemory2: PFN_vkBindImageMemory2(device: vk::Device, bind_info_count: u32, bind_infos: *const vk::BindImageMemoryInfo<'_>) {
        errors [ERROR_OUT_OF_HOST_MEMORY, ERROR_OUT_OF_DEVICE_MEMORY], successes []
    }
    vkCreateBuffer: PFN_vkCreateBuffer(device: vk::Device, create_info: *const vk::BufferCreateInfo<'_>, allocator: *const vk::AllocationCallbacks<'_>, buffer: *mut vk::Buffer) {
        errors [ERROR_OUT_OF_HOST_MEMORY, ERROR_OUT_OF_DEVICE_MEMORY], successes [], callbacks allocator
    }
    vkCreateBufferView: PFN_vkCreateBufferView(device: vk::Device, create_info: *const vk::BufferViewCreateInfo<'_>, allocator: *const vk::AllocationCallbacks<'_>, view: *mut vk::BufferView) {
        errors [ERROR_OUT_OF_HOST_MEMORY, ERROR_OUT_OF_DEVICE_MEMORY], successes [], callbacks allocator
    }
    vkCreateCommandPool: PFN_vkCreateCommandPool(device: vk::Device, create_info: *const vk::CommandPoolCreateInfo<'_>, allocator: *const vk::AllocationCallbacks<'_>, command_pool: *mut vk::CommandPool) {
        errors [ERROR_OUT_OF_HOST_MEMORY, ERROR_OUT_OF_DEVICE_MEMORY], successes [], callbacks allocator
    }
    vkCreateComputePipelines: PFN_vkCreateComputePipelines(device: vk::Device, pipeline_cache: vk::PipelineCache, create_info_count: u32, create_infos: *const vk::ComputePipelineCreateInfo<'_>, allocator: *const vk::AllocationCallbacks<'_>, pipelines: *mut vk::Pipeline) {
        errors [ERROR_OUT_OF_HOST_MEMORY, ERROR_OUT_OF_DEVICE_MEMORY], successes [], callbacks allocator, handles pipelines (create_info_count)
    }
    vkCreateDebugUtilsMessengerEXT: PFN_vkCreateDebugUtilsMessengerEXT(instance: vk::Instance, create_info: *const vk::DebugUtilsMessengerCreateInfoEXT<'_>, allocator: *const vk::AllocationCallbacks<'_>, messenger: *mut vk::DebugUtilsMessengerEXT) {
        errors [ERROR_OUT_OF_HOST_MEMORY], successes [], callbacks allocator
    }
    vkCreateDescriptorPool: PFN_vkCreateDescriptorPool(device: vk::Device, create_info: *const vk::DescriptorPoolCreateInfo<'_>, allocator: *const vk::AllocationCallbacks<'_>, descriptor_pool: *mut vk::DescriptorPool) {
        errors [ERROR_OUT_OF_HOST_MEMORY, ERROR_OUT_OF_DEVICE_MEMORY], successes [], callbacks allocator
    }
    vkCreateDescriptorSetLayout: PFN_vkCreateDescriptorSetLayout(device: vk::Device, create_info: *const vk::DescriptorSetLayoutCreateInfo<'_>, allocator: *const vk::AllocationCallbacks<'_>, set_layout: *mut vk::DescriptorSetLayout) {
        errors [ERROR_OUT_OF_HOST_MEMORY, ERROR_OUT_OF_DEVICE_MEMORY], successes [], callbacks allocator
    }
    vkCreateDescriptorUpdateTemplate: PFN_vkCreateDescriptorUpdateTemplate(device: vk::Device, create_info: *const vk::DescriptorUpdateTemplateCreateInfo<'_>, allocator: *const vk::AllocationCallbacks<'_>, descriptor_update_template: *mut vk::DescriptorUpdateTemplate) {
        errors [ERROR_OUT_OF_HOST_MEMORY, ERROR_OUT_OF_DEVICE_MEMORY], successes [], callbacks allocator
    }
    vkCreateEvent: PFN_vkCreateEvent(device: vk::Device, create_info: *const vk::EventCreateInfo<'_>, allocator: *const vk::AllocationCallbacks<'_>, event: *mut vk::Event) {
        errors [ERROR_OUT_OF_HOST_MEMORY, ERROR_OUT_OF_DEVICE_MEMORY], successes [], callbacks allocator
    }
    vkCreateFence: PFN_vkCreateFence(device: vk::Device, create_info: *const vk::FenceCreateInfo<'_>, allocator: *const vk::AllocationCallbacks<'_>, fence: *mut vk::Fence) {
        errors [ERROR_OUT_OF_HOST_MEMORY, ERROR_OUT_OF_DEVICE_MEMORY], successes [], callbacks allocator
    }
    vkCreateFramebuffer: PFN_vkCreateFramebuffer(device: vk::Device, create_info: *const vk::FramebufferCreateInfo<'_>, allocator: *const vk::AllocationCallbacks<'_>, framebuffer: *mut vk::Framebuffer) {
        errors [ERROR_OUT_OF_HOST_MEMORY, ERROR_OUT_OF_DEVICE_MEMORY], successes [], callbacks allocator
    }
    vkCreateGraphicsPipelines: PFN_vkCreateGraphicsPipelines(device: vk::Device, pipeline_cache: vk::PipelineCache, create_info_count: u32, create_infos: *const vk::GraphicsPipelineCreateInfo<'_>, allocator: *const vk::AllocationCallbacks<'_>, pipelines: *mut vk::Pipeline) {
        errors [ERROR_OUT_OF_HOST_MEMORY, ERROR_OUT_OF_DEVICE_MEMORY], successes [], callbacks allocator, handles pipelines (create_info_count)
    }
    vkCreateHeadlessSurfaceEXT: PFN_vkCreateHeadlessSurfaceEXT(instance: vk::Instance, create_info: *const vk::HeadlessSurfaceCreateInfoEXT<'_>, allocator: *const vk::AllocationCallbacks<'_>, surface: *mut vk::SurfaceKHR) {
        errors [ERROR_OUT_OF_HOST_MEMORY, ERROR_OUT_OF_DEVICE_MEMORY], successes [], callbacks allocator
    }
    vkCreateImage: PFN_vkCreateImage(device: vk::Device, create_info: *const vk::ImageCreateInfo<'_>, allocator: *const vk::AllocationCallbacks<'_>, image: *mut vk::Image) {
        errors [ERROR_OUT_OF_HOST_MEMORY, ERROR_OUT_OF_DEVICE_MEMORY], successes [], callbacks allocator
    }
    vkCreateImageView: PFN_vkCreateImageView(device: vk::Device, create_info: *const vk::ImageViewCreateInfo<'_>, allocator: *const vk::AllocationCallbacks<'_>, view: *mut vk::ImageView) {
        errors [ERROR_OUT_OF_HOST_MEMORY, ERROR_OUT_OF_DEVICE_MEMORY], successes [], callbacks allocator
    }
    vkCreatePipelineCache: PFN_vkCreatePipelineCache(device: vk::Device, create_info: *const vk::PipelineCacheCreateInfo<'_>, allocator: *const vk::AllocationCallbacks<'_>, pipeline_cache: *mut vk::PipelineCache) {
        errors [ERROR_OUT_OF_HOST_MEMORY, ERROR_OUT_OF_DEVICE_MEMORY], successes [], callbacks allocator
    }
    vkCreatePipelineLayout: PFN_vkCreatePipelineLayout(device: vk::Device, create_info: *const vk::PipelineLayoutCreateInfo<'_>, allocator: *const vk::AllocationCallbacks<'_>, pipeline_layout: *mut vk::PipelineLayout) {
        errors [ERROR_OUT_OF_HOST_MEMORY, ERROR_OUT_OF_DEVICE_MEMORY], successes [], callbacks allocator
    }
    vkCreateQueryPool: PFN_vkCreateQueryPool(device: vk::Device, create_info: *const vk::QueryPoolCreateInfo<'_>, allocator: *const vk::AllocationCallbacks<'_>, query_pool: *mut vk::QueryPool) {
        errors [ERROR_OUT_OF_HOST_MEMORY, ERROR_OUT_OF_DEVICE_MEMORY], successes [], callbacks allocator
    }
    vkCreateRenderPass: PFN_vkCreateRenderPass(device: vk::Device, create_info: *const vk::RenderPassCreateInfo<'_>, allocator: *const vk::AllocationCallbacks<'_>, render_pass: *mut vk::RenderPass) {
        errors [ERROR_OUT_OF_HOST_MEMORY, ERROR_OUT_OF_DEVICE_MEMORY], successes [], callbacks allocator
    }
    vkCreateRenderPass2: PFN_vkCreateRenderPass2(device: vk::Device, create_info: *const vk::RenderPassCreateInfo2<'_>, allocator: *const vk::AllocationCallbacks<'_>, render_pass: *mut vk::RenderPass) {
        errors [ERROR_OUT_OF_HOST_MEMORY, ERROR_OUT_OF_DEVICE_MEMORY], successes [], callbacks allocator
    }
    vkCreateSampler: PFN_vkCreateSampler(device: vk::Device, create_info: *const vk::SamplerCreateInfo<'_>, allocator: *const vk::AllocationCallbacks<'_>, sampler: *mut vk::Sampler) {
        errors [ERROR_OUT_OF_HOST_MEMORY, ERROR_OUT_OF_DEVICE_MEMORY], successes [], callbacks allocator
    }
    vkCreateSamplerYcbcrConversion: PFN_vkCreateSamplerYcbcrConversion(device: vk::Device, create_info: *const vk::SamplerYcbcrConversionCreateInfo<'_>, allocator: *const vk::AllocationCallbacks<'_>, ycbcr_conversion: *mut vk::SamplerYcbcrConversion) {
        errors [ERROR_OUT_OF_HOST_MEMORY, ERROR_OUT_OF_DEVICE_MEMORY], successes [], callbacks allocator
    }
    vkCreateSemaphore: PFN_vkCreateSemaphore(device: vk::Device, create_info: *const vk::SemaphoreCreateInfo<'_>, allocator: *const vk::AllocationCallbacks<'_>, semaphore: *mut vk::Semaphore) {
        errors [ERROR_OUT_OF_HOST_MEMORY, ERROR_OUT_OF_DEVICE_MEMORY], successes [], callbacks allocator
    }
    vkCreateShaderModule: PFN_vkCreateShaderModule(device: vk::Device, create_info: *const vk::ShaderModuleCreateInfo<'_>, allocator: *const vk::AllocationCallbacks<'_>, shader_module: *mut vk::ShaderModule) {
        errors [ERROR_OUT_OF_HOST_MEMORY, ERROR_OUT_OF_DEVICE_MEMORY], successes [], callbacks allocator
    }
    vkCreateSwapchainKHR: PFN_vkCreateSwapchainKHR(device: vk::Device, create_info: *const vk::SwapchainCreateInfoKHR<'_>, allocator: *const vk::AllocationCallbacks<'_>, swapchain: *mut vk::SwapchainKHR) {
        errors [ERROR_OUT_OF_HOST_MEMORY, ERROR_OUT_OF_DEVICE_MEMORY, ERROR_DEVICE_LOST, ERROR_SURFACE_LOST_KHR, ERROR_NATIVE_WINDOW_IN_USE_KHR, ERROR_INITIALIZATION_FAILED], successes [], callbacks allocator
    }
    vkCreateWaylandSurfaceKHR: PFN_vkCreateWaylandSurfaceKHR(instance: vk::Instance, create_info: *const vk::WaylandSurfaceCreateInfoKHR<'_>, allocator: *const vk::AllocationCallbacks<'_>, surface: *mut vk::SurfaceKHR) {
        errors [ERROR_OUT_OF_HOST_MEMORY, ERROR_OUT_OF_DEVICE_MEMORY], successes [], callbacks allocator
    }
    vkCreateXcbSurfaceKHR: PFN_vkCreateXcbSurfaceKHR(instance: vk::Instance, create_info: *const vk::XcbSurfaceCreateInfoKHR<'_>, allocator: *const vk::AllocationCallbacks<'_>, surface: *mut vk::SurfaceKHR) {
        errors [ERROR_OUT_OF_HOST_MEMORY, ERROR_OUT_OF_DEVICE_MEMORY], successes [], callbacks allocator
    }
    vkCreateXlibSurfaceKHR: PFN_vkCreateXlibSurfaceKHR(instance: vk::Instance, create_info: *const vk::XlibSurfaceCreateInfoKHR<'_>, allocator: *const vk::AllocationCallbacks<'_>, surface: *mut vk::SurfaceKHR) {
        errors [ERROR_OUT_OF_HOST_MEMORY, ERROR_OUT_OF_DEVICE_MEMORY], successes [], callbacks allocator
    }
    vkDeviceWaitIdle: PFN_vkDeviceWaitIdle(device: vk::Device) {
        errors [ERROR_OUT_OF_HOST_MEMORY, ERROR_OUT_OF_DEVICE_MEMORY, ERROR_DEVICE_LOST], successes []
    }
    vkEndCommandBuffer: PFN_vkEndCommandBuffer(command_buffer: vk::CommandBuffer) {
        errors [ERROR_OUT_OF_HOST_MEMORY, ERROR_OUT_OF_DEVICE_MEMORY], successes []
    }
    vkEnumerateDeviceExtensionProperties: PFN_vkEnumerateDeviceExtensionProperties(physical_device: vk::PhysicalDevice, layer_name: *const c_char, property_count: *mut u32, properties: *mut vk::ExtensionProperties) {
        errors [ERROR_OUT_OF_HOST_MEMORY, ERROR_OUT_OF_DEVICE_MEMORY, ERROR_LAYER_NOT_PRESENT], successes [INCOMPLETE], list property_count properties
    }
    vkEnumeratePhysicalDeviceGroups: PFN_vkEnumeratePhysicalDeviceGroups(instance: vk::Instance, physical_device_group_count: *mut u32, physical_device_group_properties: *mut vk::PhysicalDeviceGroupProperties<'_>) {
        errors [ERROR_OUT_OF_HOST_MEMORY, ERROR_OUT_OF_DEVICE_MEMORY, ERROR_INITIALIZATION_FAILED], successes [INCOMPLETE], list physical_device_group_count physical_device_group_properties
    }
    vkEnumeratePhysicalDevices: PFN_vkEnumeratePhysicalDevices(instance: vk::Instance, physical_device_count: *mut u32, physical_devices: *mut vk::PhysicalDevice) {
        errors [ERROR_OUT_OF_HOST_MEMORY, ERROR_OUT_OF_DEVICE_MEMORY, ERROR_INITIALIZATION_FAILED], successes [INCOMPLETE], list physical_device_count physical_devices
    }
    vkFlushMappedMemoryRanges: PFN_vkFlushMappedMemoryRanges(device: vk::Device, memory_range_count: u32, memory_ranges: *const vk::MappedMemoryRange<'_>) {
        errors [ERROR_OUT_OF_HOST_MEMORY, ERROR_OUT_OF_DEVICE_MEMORY], successes []
    }
    vkGetDeviceGroupPresentCapabilitiesKHR: PFN_vkGetDeviceGroupPresentCapabilitiesKHR(device: vk::Device, device_group_present_capabilities: *mut vk::DeviceGroupPresentCapabilitiesKHR<'_>) {
        errors [ERROR_OUT_OF_HOST_MEMORY, ERROR_OUT_OF_DEVICE_MEMORY], successes []
    }
    vkGetDeviceGroupSurfacePresentModesKHR: PFN_vkGetDeviceGroupSurfacePresentModesKHR(device: vk::Device, surface: vk::SurfaceKHR, modes: *mut vk::DeviceGroupPresentModeFlagsKHR) {
        errors [ERROR_OUT_OF_HOST_MEMORY, ERROR_OUT_OF_DEVICE_MEMORY, ERROR_SURFACE_LOST_KHR], successes []
    }
    vkGetEventStatus: PFN_vkGetEventStatus(device: vk::Device, event: vk::Event) {
        errors [ERROR_OUT_OF_HOST_MEMORY, ERROR_OUT_OF_DEVICE_MEMORY, ERROR_DEVICE_LOST], successes [EVENT_SET, EVENT_RESET]
    }
    vkGetFenceStatus: PFN_vkGetFenceStatus(device: vk::Device, fence: vk::Fence) {
        errors [ERROR_OUT_OF_HOST_MEMORY, ERROR_OUT_OF_DEVICE_MEMORY, ERROR_DEVICE_LOST], successes [NOT_READY]
    }
    vkGetPhysicalDeviceImageFormatProperties: PFN_vkGetPhysicalDeviceImageFormatProperties(physical_device: vk::PhysicalDevice, format: vk::Format, kind: vk::ImageType, tiling: vk::ImageTiling, usage: vk::ImageUsageFlags, flags: vk::ImageCreateFlags, image_format_properties: *mut vk::ImageFormatProperties) {
        errors [ERROR_OUT_OF_HOST_MEMORY, ERROR_OUT_OF_DEVICE_MEMORY, ERROR_FORMAT_NOT_SUPPORTED], successes []
    }
    vkGetPhysicalDeviceImageFormatProperties2: PFN_vkGetPhysicalDeviceImageFormatProperties2(physical_device: vk::PhysicalDevice, image_format_info: *const vk::PhysicalDeviceImageFormatInfo2<'_>, image_format_properties: *mut vk::ImageFormatProperties2<'_>) {
        errors [ERROR_OUT_OF_HOST_MEMORY, ERROR_OUT_OF_DEVICE_MEMORY, ERROR_FORMAT_NOT_SUPPORTED], successes []
    }
    vkGetPhysicalDevicePresentRectanglesKHR: PFN_vkGetPhysicalDevicePresentRectanglesKHR(physical_device: vk::PhysicalDevice, surface: vk::SurfaceKHR, rect_count: *mut u32, rects: *mut vk::Rect2D) {
        errors [ERROR_OUT_OF_HOST_MEMORY, ERROR_OUT_OF_DEVICE_MEMORY], successes [INCOMPLETE], list rect_count rects
    }
    vkGetPhysicalDeviceSurfaceCapabilitiesKHR: PFN_vkGetPhysicalDeviceSurfaceCapabilitiesKHR(physical_device: vk::PhysicalDevice, surface: vk::SurfaceKHR, surface_capabilities: *mut vk::SurfaceCapabilitiesKHR) {
        errors [ERROR_OUT_OF_HOST_MEMORY, ERROR_OUT_OF_DEVICE_MEMORY, ERROR_SURFACE_LOST_KHR], successes []
    }
    vkGetPhysicalDeviceSurfaceFormatsKHR: PFN_vkGetPhysicalDeviceSurfaceFormatsKHR(physical_device: vk::PhysicalDevice, surface: vk::SurfaceKHR, surface_format_count: *mut u32, surface_formats: *mut vk::SurfaceFormatKHR) {
        errors [ERROR_OUT_OF_HOST_MEMORY, ERROR_OUT_OF_DEVICE_MEMORY, ERROR_SURFACE_LOST_KHR], successes [INCOMPLETE], list surface_format_count surface_formats
    }
    vkGetPhysicalDeviceSurfacePresentModesKHR: PFN_vkGetPhysicalDeviceSurfacePresentModesKHR(physical_device: vk::PhysicalDevice, surface: vk::SurfaceKHR, present_mode_count: *mut u32, present_modes: *mut vk::PresentModeKHR) {
        errors [ERROR_OUT_OF_HOST_MEMORY, ERROR_OUT_OF_DEVICE_MEMORY, ERROR_SURFACE_LOST_KHR], successes [INCOMPLETE], list present_mode_count present_modes
    }
    vkGetPhysicalDeviceSurfaceSupportKHR: PFN_vkGetPhysicalDeviceSurfaceSupportKHR(physical_device: vk::PhysicalDevice, queue_family_index: u32, surface: vk::SurfaceKHR, supported: *mut vk::Bool32) {
        errors [ERROR_OUT_OF_HOST_MEMORY, ERROR_OUT_OF_DEVICE_MEMORY, ERROR_SURFACE_LOST_KHR], successes []
    }
    vkGetPipelineCacheData: PFN_vkGetPipelineCacheData(device: vk::Device, pipeline_cache: vk::PipelineCache, data_size: *mut usize, data: *mut c_void) {
        errors [ERROR_OUT_OF_HOST_MEMORY, ERROR_OUT_OF_DEVICE_MEMORY], successes [INCOMPLETE], list data_size data
    }
    vkGetQueryPoolResults: PFN_vkGetQueryPoolResults(device: vk::Device, query_pool: vk::QueryPool, first_query: u32, query_count: u32, data_size: usize, data: *mut c_void, stride: vk::DeviceSize, flags: vk::QueryResultFlags) {
        errors [ERROR_OUT_OF_HOST_MEMORY, ERROR_OUT_OF_DEVICE_MEMORY, ERROR_DEVICE_LOST], successes [NOT_READY]
    }
    vkGetSwapchainImagesKHR: PFN_vkGetSwapchainImagesKHR(device: vk::Device, swapchain: vk::SwapchainKHR, swapchain_image_count: *mut u32, swapchain_images: *mut vk::Image) {
        errors [ERROR_OUT_OF_HOST_MEMORY, ERROR_OUT_OF_DEVICE_MEMORY], successes [INCOMPLETE], list swapchain_image_count swapchain_images
    }
    vkInvalidateMappedMemoryRanges: PFN_vkInvalidateMappedMemoryRanges(device: vk::Device, memory_range_count: u32, memory_ranges: *const vk::MappedMemoryRange<'_>) {
        errors [ERROR_OUT_OF_HOST_MEMORY, ERROR_OUT_OF_DEVICE_MEMORY], successes []
    }
    vkMapMemory: PFN_vkMapMemory(device: vk::Device, memory: vk::DeviceMemory, offset: vk::DeviceSize, size: vk::DeviceSize, flags: vk::MemoryMapFlags, data: *mut *mut c_void) {
        errors [ERROR_OUT_OF_HOST_MEMORY, ERROR_OUT_OF_DEVICE_MEMORY, ERROR_MEMORY_MAP_FAILED], successes []
    }
    vkMergePipelineCaches: PFN_vkMergePipelineCaches(device: vk::Device, dst_cache: vk::PipelineCache, src_cache_count: u32, src_caches: *const vk::PipelineCache) {
        errors [ERROR_OUT_OF_HOST_MEMORY, ERROR_OUT_OF_DEVICE_MEMORY], successes []
    }
    vkQueueBindSparse: PFN_vkQueueBindSparse(queue: vk::Queue, bind_info_count: u32, bind_info: *const vk::BindSparseInfo<'_>, fence: vk::Fence) {
        errors [ERROR_OUT_OF_HOST_MEMORY, ERROR_OUT_OF_DEVICE_MEMORY, ERROR_DEVICE_LOST], successes []
    }
    vkQueueSubmit: PFN_vkQueueSubmit(queue: vk::Queue, submit_count: u32, submits: *const vk::SubmitInfo<'_>, fence: vk::Fence) {
        errors [ERROR_OUT_OF_HOST_MEMORY, ERROR_OUT_OF_DEVICE_MEMORY, ERROR_DEVICE_LOST], successes []
    }
    vkQueueSubmit2: PFN_vkQueueSubmit2(queue: vk::Queue, submit_count: u32, submits: *const vk::SubmitInfo2<'_>, fence: vk::Fence) {
        errors [ERROR_OUT_OF_HOST_MEMORY, ERROR_OUT_OF_DEVICE_MEMORY, ERROR_DEVICE_LOST], successes []
    }
    vkQueueWaitIdle: PFN_vkQueueWaitIdle(queue: vk::Queue) {
        errors [ERROR_OUT_OF_HOST_MEMORY, ERROR_OUT_OF_DEVICE_MEMORY, ERROR_DEVICE_LOST], successes []
    }
    vkResetCommandBuffer: PFN_vkResetCommandBuffer(command_buffer: vk::CommandBuffer, flags: vk::CommandBufferResetFlags) {
        errors [ERROR_OUT_OF_DEVICE_MEMORY], successes []
    }
    vkResetCommandPool: PFN_vkResetCommandPool(device: vk::Device, command_pool: vk::CommandPool, flags: vk::CommandPoolResetFlags) {
        errors [ERROR_OUT_OF_DEVICE_MEMORY], successes []
    }
    vkResetEvent: PFN_vkResetEvent(device: vk::Device, event: vk::Event) {
        errors [ERROR_OUT_OF_DEVICE_MEMORY], successes []
    }
    vkResetFences: PFN_vkResetFences(device: vk::Device, fence_count: u32, fences: *const vk::Fence) {
        errors [ERROR_OUT_OF_DEVICE_MEMORY], successes []
    }
    vkSetDebugUtilsObjectNameEXT: PFN_vkSetDebugUtilsObjectNameEXT(device: vk::Device, name_info: *const vk::DebugUtilsObjectNameInfoEXT<'_>) {
        errors [ERROR_OUT_OF_HOST_MEMORY, ERROR_OUT_OF_DEVICE_MEMORY], successes []
    }
    vkSetDebugUtilsObjectTagEXT: PFN_vkSetDebugUtilsObjectTagEXT(device: vk::Device, tag_info: *const vk::DebugUtilsObjectTagInfoEXT<'_>) {
        errors [ERROR_OUT_OF_HOST_MEMORY, ERROR_OUT_OF_DEVICE_MEMORY], successes []
    }
    vkSetEvent: PFN_vkSetEvent(device: vk::Device, event: vk::Event) {
        errors [ERROR_OUT_OF_HOST_MEMORY, ERROR_OUT_OF_DEVICE_MEMORY], successes []
    }
    vkWaitForFences: PFN_vkWaitForFences(device: vk::Device, fence_count: u32, fences: *const vk::Fence, wait_all: vk::Bool32, timeout: u64) {
        errors [ERROR_OUT_OF_HOST_MEMORY, ERROR_OUT_OF_DEVICE_MEMORY, ERROR_DEVICE_LOST], successes [TIMEOUT]
    }
}

by_hand! {
    vkCreateDevice { errors [ERROR_OUT_OF_HOST_MEMORY, ERROR_OUT_OF_DEVICE_MEMORY, ERROR_INITIALIZATION_FAILED, ERROR_EXTENSION_NOT_PRESENT, ERROR_FEATURE_NOT_PRESENT, ERROR_TOO_MANY_OBJECTS, ERROR_DEVICE_LOST], successes [] }
    vkCreateInstance { errors [ERROR_OUT_OF_HOST_MEMORY, ERROR_OUT_OF_DEVICE_MEMORY, ERROR_INITIALIZATION_FAILED, ERROR_LAYER_NOT_PRESENT, ERROR_EXTENSION_NOT_PRESENT, ERROR_INCOMPATIBLE_DRIVER], successes [] }
    vkDestroyDevice { errors [], successes [] }
    vkDestroyInstance { errors [], successes [] }
    vkEnumerateDeviceLayerProperties { errors [ERROR_OUT_OF_HOST_MEMORY, ERROR_OUT_OF_DEVICE_MEMORY], successes [INCOMPLETE] }
    vkEnumerateInstanceExtensionProperties { errors [ERROR_OUT_OF_HOST_MEMORY, ERROR_OUT_OF_DEVICE_MEMORY, ERROR_LAYER_NOT_PRESENT], successes [INCOMPLETE] }
    vkEnumerateInstanceLayerProperties { errors [ERROR_OUT_OF_HOST_MEMORY, ERROR_OUT_OF_DEVICE_MEMORY], successes [INCOMPLETE] }
    vkEnumerateInstanceVersion { errors [ERROR_OUT_OF_HOST_MEMORY], successes [] }
    vkQueuePresentKHR { errors [ERROR_OUT_OF_HOST_MEMORY, ERROR_OUT_OF_DEVICE_MEMORY, ERROR_DEVICE_LOST, ERROR_OUT_OF_DATE_KHR, ERROR_SURFACE_LOST_KHR], successes [SUBOPTIMAL_KHR] }
}

frees! {
    vkDestroyBuffer: PFN_vkDestroyBuffer(device: vk::Device, buffer: vk::Buffer, allocator: *const vk::AllocationCallbacks<'_>)
    vkDestroyBufferView: PFN_vkDestroyBufferView(device: vk::Device, buffer_view: vk::BufferView, allocator: *const vk::AllocationCallbacks<'_>)
    vkDestroyCommandPool: PFN_vkDestroyCommandPool(device: vk::Device, command_pool: vk::CommandPool, allocator: *const vk::AllocationCallbacks<'_>)
    vkDestroyDebugUtilsMessengerEXT: PFN_vkDestroyDebugUtilsMessengerEXT(instance: vk::Instance, messenger: vk::DebugUtilsMessengerEXT, allocator: *const vk::AllocationCallbacks<'_>)
    vkDestroyDescriptorPool: PFN_vkDestroyDescriptorPool(device: vk::Device, descriptor_pool: vk::DescriptorPool, allocator: *const vk::AllocationCallbacks<'_>)
    vkDestroyDescriptorSetLayout: PFN_vkDestroyDescriptorSetLayout(device: vk::Device, descriptor_set_layout: vk::DescriptorSetLayout, allocator: *const vk::AllocationCallbacks<'_>)
    vkDestroyDescriptorUpdateTemplate: PFN_vkDestroyDescriptorUpdateTemplate(device: vk::Device, descriptor_update_template: vk::DescriptorUpdateTemplate, allocator: *const vk::AllocationCallbacks<'_>)
    vkDestroyEvent: PFN_vkDestroyEvent(device: vk::Device, event: vk::Event, allocator: *const vk::AllocationCallbacks<'_>)
    vkDestroyFence: PFN_vkDestroyFence(device: vk::Device, fence: vk::Fence, allocator: *const vk::AllocationCallbacks<'_>)
    vkDestroyFramebuffer: PFN_vkDestroyFramebuffer(device: vk::Device, framebuffer: vk::Framebuffer, allocator: *const vk::AllocationCallbacks<'_>)
    vkDestroyImage: PFN_vkDestroyImage(device: vk::Device, image: vk::Image, allocator: *const vk::AllocationCallbacks<'_>)
    vkDestroyImageView: PFN_vkDestroyImageView(device: vk::Device, image_view: vk::ImageView, allocator: *const vk::AllocationCallbacks<'_>)
    vkDestroyPipeline: PFN_vkDestroyPipeline(device: vk::Device, pipeline: vk::Pipeline, allocator: *const vk::AllocationCallbacks<'_>)
    vkDestroyPipelineCache: PFN_vkDestroyPipelineCache(device: vk::Device, pipeline_cache: vk::PipelineCache, allocator: *const vk::AllocationCallbacks<'_>)
    vkDestroyPipelineLayout: PFN_vkDestroyPipelineLayout(device: vk::Device, pipeline_layout: vk::PipelineLayout, allocator: *const vk::AllocationCallbacks<'_>)
    vkDestroyQueryPool: PFN_vkDestroyQueryPool(device: vk::Device, query_pool: vk::QueryPool, allocator: *const vk::AllocationCallbacks<'_>)
    vkDestroyRenderPass: PFN_vkDestroyRenderPass(device: vk::Device, render_pass: vk::RenderPass, allocator: *const vk::AllocationCallbacks<'_>)
    vkDestroySampler: PFN_vkDestroySampler(device: vk::Device, sampler: vk::Sampler, allocator: *const vk::AllocationCallbacks<'_>)
    vkDestroySamplerYcbcrConversion: PFN_vkDestroySamplerYcbcrConversion(device: vk::Device, ycbcr_conversion: vk::SamplerYcbcrConversion, allocator: *const vk::AllocationCallbacks<'_>)
    vkDestroySemaphore: PFN_vkDestroySemaphore(device: vk::Device, semaphore: vk::Semaphore, allocator: *const vk::AllocationCallbacks<'_>)
    vkDestroyShaderModule: PFN_vkDestroyShaderModule(device: vk::Device, shader_module: vk::ShaderModule, allocator: *const vk::AllocationCallbacks<'_>)
    vkDestroySurfaceKHR: PFN_vkDestroySurfaceKHR(instance: vk::Instance, surface: vk::SurfaceKHR, allocator: *const vk::AllocationCallbacks<'_>)
    vkDestroySwapchainKHR: PFN_vkDestroySwapchainKHR(device: vk::Device, swapchain: vk::SwapchainKHR, allocator: *const vk::AllocationCallbacks<'_>)
    vkFreeMemory: PFN_vkFreeMemory(device: vk::Device, memory: vk::DeviceMemory, allocator: *const vk::AllocationCallbacks<'_>)
}

/// The other commands of Vulkan that can fail. The layer does not know them, and the program does not call them.
pub const ELSEWHERE: &[&str] = &[
    "vkAcquireDrmDisplayEXT",
    "vkAcquireFullScreenExclusiveModeEXT",
    "vkAcquirePerformanceConfigurationINTEL",
    "vkAcquireProfilingLockKHR",
    "vkAcquireWinrtDisplayNV",
    "vkAcquireXlibDisplayEXT",
    "vkBindAccelerationStructureMemoryNV",
    "vkBindOpticalFlowSessionImageNV",
    "vkBindVideoSessionMemoryKHR",
    "vkBuildAccelerationStructuresKHR",
    "vkBuildMicromapsEXT",
    "vkCmdSetPerformanceMarkerINTEL",
    "vkCmdSetPerformanceOverrideINTEL",
    "vkCmdSetPerformanceStreamMarkerINTEL",
    "vkCompileDeferredNV",
    "vkConvertCooperativeVectorMatrixNV",
    "vkCopyAccelerationStructureKHR",
    "vkCopyAccelerationStructureToMemoryKHR",
    "vkCopyImageToImage",
    "vkCopyImageToMemory",
    "vkCopyMemoryToAccelerationStructureKHR",
    "vkCopyMemoryToImage",
    "vkCopyMemoryToMicromapEXT",
    "vkCopyMicromapEXT",
    "vkCopyMicromapToMemoryEXT",
    "vkCreateAccelerationStructureKHR",
    "vkCreateAccelerationStructureNV",
    "vkCreateAndroidSurfaceKHR",
    "vkCreateBufferCollectionFUCHSIA",
    "vkCreateCuFunctionNVX",
    "vkCreateCuModuleNVX",
    "vkCreateCudaFunctionNV",
    "vkCreateCudaModuleNV",
    "vkCreateDebugReportCallbackEXT",
    "vkCreateDeferredOperationKHR",
    "vkCreateDirectFBSurfaceEXT",
    "vkCreateDisplayModeKHR",
    "vkCreateDisplayPlaneSurfaceKHR",
    "vkCreateExecutionGraphPipelinesAMDX",
    "vkCreateIOSSurfaceMVK",
    "vkCreateImagePipeSurfaceFUCHSIA",
    "vkCreateIndirectCommandsLayoutEXT",
    "vkCreateIndirectCommandsLayoutNV",
    "vkCreateIndirectExecutionSetEXT",
    "vkCreateMacOSSurfaceMVK",
    "vkCreateMetalSurfaceEXT",
    "vkCreateMicromapEXT",
    "vkCreateOpticalFlowSessionNV",
    "vkCreatePipelineBinariesKHR",
    "vkCreatePrivateDataSlot",
    "vkCreateRayTracingPipelinesKHR",
    "vkCreateRayTracingPipelinesNV",
    "vkCreateScreenSurfaceQNX",
    "vkCreateSemaphoreSciSyncPoolNV",
    "vkCreateShadersEXT",
    "vkCreateSharedSwapchainsKHR",
    "vkCreateStreamDescriptorSurfaceGGP",
    "vkCreateValidationCacheEXT",
    "vkCreateViSurfaceNN",
    "vkCreateVideoSessionKHR",
    "vkCreateVideoSessionParametersKHR",
    "vkCreateWin32SurfaceKHR",
    "vkDebugMarkerSetObjectNameEXT",
    "vkDebugMarkerSetObjectTagEXT",
    "vkDeferredOperationJoinKHR",
    "vkDisplayPowerControlEXT",
    "vkEnumeratePhysicalDeviceQueueFamilyPerformanceQueryCountersKHR",
    "vkGetAccelerationStructureHandleNV",
    "vkGetAccelerationStructureOpaqueCaptureDescriptorDataEXT",
    "vkGetAndroidHardwareBufferPropertiesANDROID",
    "vkGetBufferCollectionPropertiesFUCHSIA",
    "vkGetBufferOpaqueCaptureDescriptorDataEXT",
    "vkGetCalibratedTimestampsKHR",
    "vkGetCudaModuleCacheNV",
    "vkGetDeviceFaultInfoEXT",
    "vkGetDeviceGroupSurfacePresentModes2EXT",
    "vkGetDeviceSubpassShadingMaxWorkgroupSizeHUAWEI",
    "vkGetDisplayModeProperties2KHR",
    "vkGetDisplayModePropertiesKHR",
    "vkGetDisplayPlaneCapabilities2KHR",
    "vkGetDisplayPlaneCapabilitiesKHR",
    "vkGetDisplayPlaneSupportedDisplaysKHR",
    "vkGetDrmDisplayEXT",
    "vkGetEncodedVideoSessionParametersKHR",
    "vkGetExecutionGraphPipelineNodeIndexAMDX",
    "vkGetExecutionGraphPipelineScratchSizeAMDX",
    "vkGetFaultData",
    "vkGetFenceFdKHR",
    "vkGetFenceSciSyncFenceNV",
    "vkGetFenceSciSyncObjNV",
    "vkGetFenceWin32HandleKHR",
    "vkGetImageDrmFormatModifierPropertiesEXT",
    "vkGetImageOpaqueCaptureDescriptorDataEXT",
    "vkGetImageViewAddressNVX",
    "vkGetImageViewOpaqueCaptureDescriptorDataEXT",
    "vkGetMemoryAndroidHardwareBufferANDROID",
    "vkGetMemoryFdKHR",
    "vkGetMemoryFdPropertiesKHR",
    "vkGetMemoryHostPointerPropertiesEXT",
    "vkGetMemoryMetalHandleEXT",
    "vkGetMemoryMetalHandlePropertiesEXT",
    "vkGetMemoryRemoteAddressNV",
    "vkGetMemorySciBufNV",
    "vkGetMemoryWin32HandleKHR",
    "vkGetMemoryWin32HandleNV",
    "vkGetMemoryWin32HandlePropertiesKHR",
    "vkGetMemoryZirconHandleFUCHSIA",
    "vkGetMemoryZirconHandlePropertiesFUCHSIA",
    "vkGetPastPresentationTimingGOOGLE",
    "vkGetPerformanceParameterINTEL",
    "vkGetPhysicalDeviceCalibrateableTimeDomainsKHR",
    "vkGetPhysicalDeviceCooperativeMatrixFlexibleDimensionsPropertiesNV",
    "vkGetPhysicalDeviceCooperativeMatrixPropertiesKHR",
    "vkGetPhysicalDeviceCooperativeMatrixPropertiesNV",
    "vkGetPhysicalDeviceCooperativeVectorPropertiesNV",
    "vkGetPhysicalDeviceDisplayPlaneProperties2KHR",
    "vkGetPhysicalDeviceDisplayPlanePropertiesKHR",
    "vkGetPhysicalDeviceDisplayProperties2KHR",
    "vkGetPhysicalDeviceDisplayPropertiesKHR",
    "vkGetPhysicalDeviceExternalImageFormatPropertiesNV",
    "vkGetPhysicalDeviceExternalMemorySciBufPropertiesNV",
    "vkGetPhysicalDeviceFragmentShadingRatesKHR",
    "vkGetPhysicalDeviceOpticalFlowImageFormatsNV",
    "vkGetPhysicalDeviceSciBufAttributesNV",
    "vkGetPhysicalDeviceSciSyncAttributesNV",
    "vkGetPhysicalDeviceSupportedFramebufferMixedSamplesCombinationsNV",
    "vkGetPhysicalDeviceSurfaceCapabilities2EXT",
    "vkGetPhysicalDeviceSurfaceCapabilities2KHR",
    "vkGetPhysicalDeviceSurfaceFormats2KHR",
    "vkGetPhysicalDeviceSurfacePresentModes2EXT",
    "vkGetPhysicalDeviceToolProperties",
    "vkGetPhysicalDeviceVideoCapabilitiesKHR",
    "vkGetPhysicalDeviceVideoEncodeQualityLevelPropertiesKHR",
    "vkGetPhysicalDeviceVideoFormatPropertiesKHR",
    "vkGetPipelineBinaryDataKHR",
    "vkGetPipelineExecutableInternalRepresentationsKHR",
    "vkGetPipelineExecutablePropertiesKHR",
    "vkGetPipelineExecutableStatisticsKHR",
    "vkGetPipelineKeyKHR",
    "vkGetPipelinePropertiesEXT",
    "vkGetRandROutputDisplayEXT",
    "vkGetRayTracingCaptureReplayShaderGroupHandlesKHR",
    "vkGetRayTracingShaderGroupHandlesKHR",
    "vkGetRefreshCycleDurationGOOGLE",
    "vkGetSamplerOpaqueCaptureDescriptorDataEXT",
    "vkGetScreenBufferPropertiesQNX",
    "vkGetSemaphoreCounterValue",
    "vkGetSemaphoreFdKHR",
    "vkGetSemaphoreSciSyncObjNV",
    "vkGetSemaphoreWin32HandleKHR",
    "vkGetSemaphoreZirconHandleFUCHSIA",
    "vkGetShaderBinaryDataEXT",
    "vkGetShaderInfoAMD",
    "vkGetSwapchainCounterEXT",
    "vkGetSwapchainStatusKHR",
    "vkGetValidationCacheDataEXT",
    "vkGetWinrtDisplayNV",
    "vkImportFenceFdKHR",
    "vkImportFenceSciSyncFenceNV",
    "vkImportFenceSciSyncObjNV",
    "vkImportFenceWin32HandleKHR",
    "vkImportSemaphoreFdKHR",
    "vkImportSemaphoreSciSyncObjNV",
    "vkImportSemaphoreWin32HandleKHR",
    "vkImportSemaphoreZirconHandleFUCHSIA",
    "vkInitializePerformanceApiINTEL",
    "vkMapMemory2",
    "vkMergeValidationCachesEXT",
    "vkQueueSetPerformanceConfigurationINTEL",
    "vkRegisterDeviceEventEXT",
    "vkRegisterDisplayEventEXT",
    "vkReleaseFullScreenExclusiveModeEXT",
    "vkReleasePerformanceConfigurationINTEL",
    "vkReleaseSwapchainImagesEXT",
    "vkSetBufferCollectionBufferConstraintsFUCHSIA",
    "vkSetBufferCollectionImageConstraintsFUCHSIA",
    "vkSetLatencySleepModeNV",
    "vkSetPrivateData",
    "vkSignalSemaphore",
    "vkTransitionImageLayout",
    "vkUnmapMemory2",
    "vkUpdateVideoSessionParametersKHR",
    "vkWaitForPresentKHR",
    "vkWaitSemaphores",
    "vkWriteAccelerationStructuresPropertiesKHR",
    "vkWriteMicromapsPropertiesEXT",
];
