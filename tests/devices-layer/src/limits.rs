//! Limits of played devices.

use ash::vk;

/// Sample counts that every device has.
const FEWEST_SAMPLES: vk::SampleCountFlags =
    vk::SampleCountFlags::from_raw(vk::SampleCountFlags::TYPE_1.as_raw() | vk::SampleCountFlags::TYPE_4.as_raw());

/// The limits that Vulkan 1.1 requires of every device (specification, "Required Limits"). Sparse resources, tessellation, geometry and the
/// other optional features have none.
pub fn least() -> vk::PhysicalDeviceLimits {
    vk::PhysicalDeviceLimits::default()
        .max_image_dimension1_d(4096)
        .max_image_dimension2_d(4096)
        .max_image_dimension3_d(256)
        .max_image_dimension_cube(4096)
        .max_image_array_layers(256)
        .max_texel_buffer_elements(65536)
        .max_uniform_buffer_range(16384)
        .max_storage_buffer_range(1 << 27)
        .max_push_constants_size(128)
        .max_memory_allocation_count(4096)
        .max_sampler_allocation_count(4000)
        .buffer_image_granularity(131_072)
        .max_bound_descriptor_sets(4)
        .max_per_stage_descriptor_samplers(16)
        .max_per_stage_descriptor_uniform_buffers(12)
        .max_per_stage_descriptor_storage_buffers(4)
        .max_per_stage_descriptor_sampled_images(16)
        .max_per_stage_descriptor_storage_images(4)
        .max_per_stage_descriptor_input_attachments(4)
        .max_per_stage_resources(128)
        .max_descriptor_set_samplers(96)
        .max_descriptor_set_uniform_buffers(72)
        .max_descriptor_set_uniform_buffers_dynamic(8)
        .max_descriptor_set_storage_buffers(24)
        .max_descriptor_set_storage_buffers_dynamic(4)
        .max_descriptor_set_sampled_images(96)
        .max_descriptor_set_storage_images(24)
        .max_descriptor_set_input_attachments(4)
        .max_vertex_input_attributes(16)
        .max_vertex_input_bindings(16)
        .max_vertex_input_attribute_offset(2047)
        .max_vertex_input_binding_stride(2048)
        .max_vertex_output_components(64)
        .max_fragment_input_components(64)
        .max_fragment_output_attachments(4)
        .max_fragment_combined_output_resources(4)
        .max_compute_shared_memory_size(16384)
        .max_compute_work_group_count([65535; 3])
        .max_compute_work_group_invocations(128)
        .max_compute_work_group_size([128, 128, 64])
        .sub_pixel_precision_bits(4)
        .sub_texel_precision_bits(4)
        .mipmap_precision_bits(4)
        .max_draw_indexed_index_value((1 << 24) - 1)
        .max_draw_indirect_count(1)
        .max_sampler_lod_bias(2.0)
        .max_sampler_anisotropy(1.0)
        .max_viewports(1)
        .max_viewport_dimensions([4096; 2])
        .viewport_bounds_range([-8192.0, 8191.0])
        .min_memory_map_alignment(64)
        .min_texel_buffer_offset_alignment(256)
        .min_uniform_buffer_offset_alignment(256)
        .min_storage_buffer_offset_alignment(256)
        .min_texel_offset(-8)
        .max_texel_offset(7)
        .max_framebuffer_width(4096)
        .max_framebuffer_height(4096)
        .max_framebuffer_layers(256)
        .framebuffer_color_sample_counts(FEWEST_SAMPLES)
        .framebuffer_depth_sample_counts(FEWEST_SAMPLES)
        .framebuffer_stencil_sample_counts(FEWEST_SAMPLES)
        .framebuffer_no_attachments_sample_counts(FEWEST_SAMPLES)
        .max_color_attachments(4)
        .sampled_image_color_sample_counts(FEWEST_SAMPLES)
        .sampled_image_integer_sample_counts(vk::SampleCountFlags::TYPE_1)
        .sampled_image_depth_sample_counts(FEWEST_SAMPLES)
        .sampled_image_stencil_sample_counts(FEWEST_SAMPLES)
        .storage_image_sample_counts(vk::SampleCountFlags::TYPE_1)
        .max_sample_mask_words(1)
        .discrete_queue_priorities(2)
        .point_size_range([1.0; 2])
        .line_width_range([1.0; 2])
        .optimal_buffer_copy_offset_alignment(256)
        .optimal_buffer_copy_row_pitch_alignment(256)
        .non_coherent_atom_size(256)
}

/// Limits of phones of some years ago: the minimum that Vulkan requires, or better values if all phones have them. These phones filter
/// anisotropically and write timestamps.
pub fn phone() -> vk::PhysicalDeviceLimits {
    vk::PhysicalDeviceLimits { timestamp_compute_and_graphics: vk::TRUE, timestamp_period: 1.0, ..least() }
        .max_image_dimension2_d(8192)
        .max_image_dimension_cube(8192)
        .max_framebuffer_width(8192)
        .max_framebuffer_height(8192)
        .max_viewport_dimensions([8192; 2])
        .viewport_bounds_range([-16384.0, 16383.0])
        .buffer_image_granularity(1024)
        .max_uniform_buffer_range(65536)
        .max_draw_indexed_index_value(u32::MAX)
        .max_per_stage_descriptor_uniform_buffers(14)
        .max_per_stage_descriptor_storage_buffers(24)
        .max_compute_work_group_invocations(256)
        .max_compute_work_group_size([256, 256, 64])
        .max_sampler_anisotropy(16.0)
        .min_uniform_buffer_offset_alignment(64)
        .min_storage_buffer_offset_alignment(64)
        .non_coherent_atom_size(64)
        .sub_pixel_precision_bits(8)
        .sub_texel_precision_bits(8)
        .standard_sample_locations(true)
}

/// The limits that MoltenVK reports for Apple's GPUs, if they are lower than a desktop GPU's.
pub fn metal(mut real: vk::PhysicalDeviceLimits) -> vk::PhysicalDeviceLimits {
    real.max_image_dimension2_d = real.max_image_dimension2_d.min(16384);
    real.max_bound_descriptor_sets = real.max_bound_descriptor_sets.min(8);
    real.max_per_stage_descriptor_samplers = real.max_per_stage_descriptor_samplers.min(16);
    real.max_per_stage_descriptor_uniform_buffers = real.max_per_stage_descriptor_uniform_buffers.min(31);
    real.max_per_stage_descriptor_storage_buffers = real.max_per_stage_descriptor_storage_buffers.min(31);
    real.max_per_stage_descriptor_sampled_images = real.max_per_stage_descriptor_sampled_images.min(128);
    real.max_per_stage_descriptor_storage_images = real.max_per_stage_descriptor_storage_images.min(8);
    real.max_push_constants_size = real.max_push_constants_size.min(4096);
    real.max_compute_shared_memory_size = real.max_compute_shared_memory_size.min(32768);
    real.min_uniform_buffer_offset_alignment = real.min_uniform_buffer_offset_alignment.max(16);
    real.min_storage_buffer_offset_alignment = real.min_storage_buffer_offset_alignment.max(16);
    real.max_color_attachments = real.max_color_attachments.min(8);
    real.max_fragment_output_attachments = real.max_fragment_output_attachments.min(8);
    real
}

/// Shared memory of software and of some emulations: a quarter of the size that Vulkan requires.
pub fn small_shared_memory(real: vk::PhysicalDeviceLimits) -> vk::PhysicalDeviceLimits {
    vk::PhysicalDeviceLimits { max_compute_shared_memory_size: 4096, ..real }
}

/// Every limit of `played` that promises more than the device below has is lowered to that; the layer could not keep it.
pub fn within(played: vk::PhysicalDeviceLimits, real: &vk::PhysicalDeviceLimits) -> vk::PhysicalDeviceLimits {
    let mut own = played;
    own.timestamp_period = if own.timestamp_compute_and_graphics == vk::TRUE { real.timestamp_period } else { 0.0 };
    own.framebuffer_color_sample_counts &= real.framebuffer_color_sample_counts;
    own.framebuffer_depth_sample_counts &= real.framebuffer_depth_sample_counts;
    own.sampled_image_color_sample_counts &= real.sampled_image_color_sample_counts;
    own.sampled_image_depth_sample_counts &= real.sampled_image_depth_sample_counts;
    own.max_storage_buffer_range = own.max_storage_buffer_range.min(real.max_storage_buffer_range);
    own.max_uniform_buffer_range = own.max_uniform_buffer_range.min(real.max_uniform_buffer_range);
    own.max_sampler_anisotropy = own.max_sampler_anisotropy.min(real.max_sampler_anisotropy);
    own.max_per_stage_descriptor_storage_buffers =
        own.max_per_stage_descriptor_storage_buffers.min(real.max_per_stage_descriptor_storage_buffers);
    own.max_per_stage_descriptor_uniform_buffers =
        own.max_per_stage_descriptor_uniform_buffers.min(real.max_per_stage_descriptor_uniform_buffers);
    own.max_image_dimension2_d = own.max_image_dimension2_d.min(real.max_image_dimension2_d);
    own.non_coherent_atom_size = own.non_coherent_atom_size.max(real.non_coherent_atom_size);
    own.min_uniform_buffer_offset_alignment =
        own.min_uniform_buffer_offset_alignment.max(real.min_uniform_buffer_offset_alignment);
    own.min_storage_buffer_offset_alignment =
        own.min_storage_buffer_offset_alignment.max(real.min_storage_buffer_offset_alignment);
    own.standard_sample_locations &= real.standard_sample_locations;
    own
}
