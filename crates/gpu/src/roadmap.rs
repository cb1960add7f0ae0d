//! The Roadmap milestones of Vulkan: what each requires of a device, whether a device has it, and what of it the program enables.
//!
//! The requirements come from the specification's appendix "Vulkan Roadmap Milestones" (Vulkan-Docs 1.4.360, `appendices/roadmap/Roadmap-2022.adoc`,
//! `-2024` and `-2026`) and from the profiles `VP_KHR_roadmap_2022`, `_2024` and `_2026` (`VP_KHR_roadmap.json`, revision 12). Every number is the same in both.
//! Features and extensions are required here if either names them. Only the profiles name the features that Vulkan 1.3 and the extensions promise. Only the
//! appendix names `samplerMirrorClampToEdge`. `pushDescriptor` is left out, because VK_KHR_push_descriptor says the same. Limits are taken from the appendix; the
//! profiles repeat others that every device of a version has.
//!
//! An extension must be listed by the device, even if the device's version has made it a part of Vulkan: the profiles ask for that.

use std::collections::BTreeSet;
use std::ffi::CStr;

use ash::{khr, vk};

use super::device::EnabledFeatures;
use super::error::Result;
use super::feature_set::{FeatureSet, Knowledge};
use super::instance::{InstanceHandles, enumerate_extensions};
use super::newer::{self, API_VERSION_1_4};
use super::physical::PhysicalDevice;

/// A device beside a Roadmap milestone.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Roadmap {
    /// The milestone's year.
    pub year: u16,
    /// The number of its requirements. The milestone before counts as one.
    pub requirements: usize,
    /// The requirements that the device does not meet, in the specification's names; a limit with the device's own. Empty: the device meets the milestone.
    pub missing: Vec<String>,
    /// The features and extensions of the milestone that the program enables on this device, because frames may use them.
    pub used: Vec<String>,
}

struct Milestone {
    year: u16,
    requirements: &'static [&'static [Requirement]],
}

/// A feature in ash's name, and how it is read.
type Feature = (&'static str, fn(&FeatureSet) -> bool);

enum Requirement {
    Version(u32),
    InstanceExtension(&'static CStr),
    /// An extension with all of these features.
    Extension(&'static CStr, &'static [Feature]),
    /// An extension with one of these features at least.
    ExtensionWithOneOf(&'static CStr, &'static [Feature]),
    Feature(Feature),
    AtLeast(&'static str, f64, fn(&PropertySet) -> f64),
    AtMost(&'static str, f64, fn(&PropertySet) -> f64),
    Property(&'static str, fn(&PropertySet) -> bool),
}

/// The structures of properties in which the limits of milestones stand.
#[derive(Default)]
struct PropertySet {
    core: vk::PhysicalDeviceLimits,
    subgroup: vk::PhysicalDeviceSubgroupProperties<'static>,
    floats: vk::PhysicalDeviceFloatControlsProperties<'static>,
    indexing: vk::PhysicalDeviceDescriptorIndexingProperties<'static>,
    subgroup_sizes: vk::PhysicalDeviceSubgroupSizeControlProperties<'static>,
}

macro_rules! feature {
    ($structure:ident.$field:ident) => {
        (stringify!($field), |own: &FeatureSet| own.$structure.$field == vk::TRUE)
    };
}

macro_rules! features {
    ($structure:ident: $($field:ident),* $(,)?) => {
        &[$(Requirement::Feature(feature!($structure.$field))),*]
    };
}

macro_rules! at_least {
    ($($field:ident: $least:expr),* $(,)?) => {
        &[$(Requirement::AtLeast(stringify!($field), $least as f64, |own| own.core.$field as f64)),*]
    };
}

const ROADMAP_2022: &[&[Requirement]] = &[
    &[Requirement::Version(vk::API_VERSION_1_3)],
    // Features that the milestone adds to its version.
    features!(core: full_draw_index_uint32, image_cube_array, independent_blend, sample_rate_shading,
        draw_indirect_first_instance, depth_clamp, depth_bias_clamp, sampler_anisotropy, occlusion_query_precise,
        fragment_stores_and_atomics, shader_storage_image_extended_formats,
        shader_uniform_buffer_array_dynamic_indexing, shader_sampled_image_array_dynamic_indexing,
        shader_storage_buffer_array_dynamic_indexing, shader_storage_image_array_dynamic_indexing),
    features!(ycbcr: sampler_ycbcr_conversion),
    features!(vulkan12: sampler_mirror_clamp_to_edge, descriptor_indexing, scalar_block_layout),
    features!(indexing: shader_uniform_texel_buffer_array_dynamic_indexing,
        shader_storage_texel_buffer_array_dynamic_indexing, shader_uniform_buffer_array_non_uniform_indexing,
        shader_sampled_image_array_non_uniform_indexing, shader_storage_buffer_array_non_uniform_indexing,
        shader_storage_image_array_non_uniform_indexing, shader_uniform_texel_buffer_array_non_uniform_indexing,
        shader_storage_texel_buffer_array_non_uniform_indexing, descriptor_binding_sampled_image_update_after_bind,
        descriptor_binding_storage_image_update_after_bind, descriptor_binding_storage_buffer_update_after_bind,
        descriptor_binding_uniform_texel_buffer_update_after_bind,
        descriptor_binding_storage_texel_buffer_update_after_bind, descriptor_binding_update_unused_while_pending,
        descriptor_binding_partially_bound, descriptor_binding_variable_descriptor_count, runtime_descriptor_array),
    features!(vulkan13: descriptor_binding_inline_uniform_block_update_after_bind),
    // Features that Vulkan 1.3 promises.
    features!(core: robust_buffer_access),
    features!(multiview: multiview),
    features!(vulkan12: uniform_buffer_standard_layout, subgroup_broadcast_dynamic_id, imageless_framebuffer,
        separate_depth_stencil_layouts, host_query_reset, timeline_semaphore, shader_subgroup_extended_types,
        vulkan_memory_model, vulkan_memory_model_device_scope, buffer_device_address),
    features!(vulkan13: robust_image_access, shader_terminate_invocation, shader_zero_initialize_workgroup_memory,
        shader_integer_dot_product, pipeline_creation_cache_control, subgroup_size_control, compute_full_subgroups,
        shader_demote_to_helper_invocation, inline_uniform_block, private_data),
    features!(synchronization2: synchronization2),
    features!(maintenance4: maintenance4),
    features!(rendering: dynamic_rendering),
    &[Requirement::Extension(khr::global_priority::NAME, &[feature!(global_priority.global_priority_query)])],
    at_least!(
        max_image_dimension1_d: 8192,
        max_image_dimension2_d: 8192,
        max_image_dimension_cube: 8192,
        max_image_array_layers: 2048,
        max_uniform_buffer_range: 65536,
        max_per_stage_descriptor_samplers: 64,
        max_per_stage_descriptor_uniform_buffers: 15,
        max_per_stage_descriptor_storage_buffers: 30,
        max_per_stage_descriptor_sampled_images: 200,
        max_per_stage_descriptor_storage_images: 16,
        max_per_stage_resources: 200,
        max_descriptor_set_samplers: 576,
        max_descriptor_set_uniform_buffers: 90,
        max_descriptor_set_storage_buffers: 96,
        max_descriptor_set_sampled_images: 1800,
        max_descriptor_set_storage_images: 144,
        max_fragment_combined_output_resources: 16,
        max_compute_work_group_invocations: 256,
        sub_texel_precision_bits: 8,
        mipmap_precision_bits: 6,
        max_sampler_lod_bias: 14,
        max_color_attachments: 7,
    ),
    &[
        Requirement::AtMost("buffer_image_granularity", 4096.0, |own| own.core.buffer_image_granularity as f64),
        Requirement::AtMost("point_size_granularity", 0.125, |own| own.core.point_size_granularity.into()),
        Requirement::AtMost("line_width_granularity", 0.5, |own| own.core.line_width_granularity.into()),
        Requirement::Property("max_compute_work_group_size", |own| {
            own.core.max_compute_work_group_size.into_iter().zip([256, 256, 64]).all(|(own, least)| own >= least)
        }),
        Requirement::Property("standard_sample_locations", |own| own.core.standard_sample_locations == vk::TRUE),
        Requirement::AtLeast("subgroup_size", 4.0, |own| own.subgroup.subgroup_size.into()),
        Requirement::Property("subgroup_supported_stages", |own| {
            own.subgroup.supported_stages.contains(vk::ShaderStageFlags::COMPUTE | vk::ShaderStageFlags::FRAGMENT)
        }),
        Requirement::Property("subgroup_supported_operations", |own| {
            let all = vk::SubgroupFeatureFlags::BASIC
                | vk::SubgroupFeatureFlags::VOTE
                | vk::SubgroupFeatureFlags::ARITHMETIC
                | vk::SubgroupFeatureFlags::BALLOT
                | vk::SubgroupFeatureFlags::SHUFFLE
                | vk::SubgroupFeatureFlags::SHUFFLE_RELATIVE
                | vk::SubgroupFeatureFlags::QUAD;
            own.subgroup.supported_operations.contains(all)
        }),
        Requirement::Property("shader_signed_zero_inf_nan_preserve_float16", |own| {
            own.floats.shader_signed_zero_inf_nan_preserve_float16 == vk::TRUE
        }),
        Requirement::Property("shader_signed_zero_inf_nan_preserve_float32", |own| {
            own.floats.shader_signed_zero_inf_nan_preserve_float32 == vk::TRUE
        }),
        Requirement::AtLeast("max_per_stage_descriptor_update_after_bind_input_attachments", 7.0, |own| {
            own.indexing.max_per_stage_descriptor_update_after_bind_input_attachments.into()
        }),
        Requirement::AtLeast("max_subgroup_size", 4.0, |own| own.subgroup_sizes.max_subgroup_size.into()),
    ],
];

const ROADMAP_2024: &[&[Requirement]] = &[
    features!(core: multi_draw_indirect, shader_image_gather_extended, shader_int16),
    features!(draw_parameters: shader_draw_parameters),
    features!(storage16: storage_buffer16_bit_access),
    features!(vulkan12: shader_int8, shader_float16, storage_buffer8_bit_access),
    at_least!(max_bound_descriptor_sets: 7, max_color_attachments: 8),
    &[
        Requirement::Property("timestamp_compute_and_graphics", |own| {
            own.core.timestamp_compute_and_graphics == vk::TRUE
        }),
        Requirement::Property("shader_rounding_mode_RTE_float16", |own| {
            own.floats.shader_rounding_mode_rte_float16 == vk::TRUE
        }),
        Requirement::Property("shader_rounding_mode_RTE_float32", |own| {
            own.floats.shader_rounding_mode_rte_float32 == vk::TRUE
        }),
        Requirement::Extension(khr::dynamic_rendering::NAME, &[]),
        Requirement::Extension(
            khr::dynamic_rendering_local_read::NAME,
            &[feature!(local_read.dynamic_rendering_local_read)],
        ),
        Requirement::Extension(khr::load_store_op_none::NAME, &[]),
        Requirement::Extension(khr::shader_quad_control::NAME, &[feature!(quad_control.shader_quad_control)]),
        Requirement::Extension(
            khr::shader_maximal_reconvergence::NAME,
            &[feature!(reconvergence.shader_maximal_reconvergence)],
        ),
        Requirement::Extension(
            khr::shader_subgroup_uniform_control_flow::NAME,
            &[feature!(uniform_control_flow.shader_subgroup_uniform_control_flow)],
        ),
        Requirement::Extension(khr::shader_subgroup_rotate::NAME, &[feature!(subgroup_rotate.shader_subgroup_rotate)]),
        Requirement::Extension(khr::shader_float_controls2::NAME, &[feature!(float_controls2.shader_float_controls2)]),
        Requirement::Extension(khr::shader_expect_assume::NAME, &[feature!(expect_assume.shader_expect_assume)]),
        Requirement::ExtensionWithOneOf(
            khr::line_rasterization::NAME,
            &[
                feature!(lines.rectangular_lines),
                feature!(lines.bresenham_lines),
                feature!(lines.smooth_lines),
                feature!(lines.stippled_rectangular_lines),
                feature!(lines.stippled_bresenham_lines),
                feature!(lines.stippled_smooth_lines),
            ],
        ),
        Requirement::Extension(
            khr::vertex_attribute_divisor::NAME,
            &[feature!(divisor.vertex_attribute_instance_rate_divisor)],
        ),
        Requirement::Extension(khr::index_type_uint8::NAME, &[feature!(index_uint8.index_type_uint8)]),
        Requirement::Extension(khr::map_memory2::NAME, &[]),
        Requirement::Extension(khr::maintenance5::NAME, &[feature!(maintenance5.maintenance5)]),
        Requirement::Extension(khr::push_descriptor::NAME, &[]),
    ],
];

const ROADMAP_2026: &[&[Requirement]] = &[
    &[Requirement::Version(API_VERSION_1_4)],
    features!(host_image_copy: host_image_copy),
    at_least!(
        max_per_stage_descriptor_uniform_buffers: 200,
        max_per_stage_descriptor_storage_buffers: 200,
        max_per_stage_descriptor_input_attachments: 8,
        max_descriptor_set_storage_buffers: 1800,
        max_descriptor_set_uniform_buffers: 1800,
        max_descriptor_set_input_attachments: 8,
        max_vertex_output_components: 124,
        max_tessellation_control_per_vertex_input_components: 128,
        max_tessellation_control_per_vertex_output_components: 128,
        max_tessellation_control_total_output_components: 4096,
        max_tessellation_evaluation_input_components: 128,
        max_tessellation_evaluation_output_components: 128,
        max_geometry_output_components: 128,
        max_fragment_input_components: 112,
        max_fragment_output_attachments: 8,
        max_compute_shared_memory_size: 32768,
        sub_pixel_precision_bits: 8,
        max_framebuffer_width: 8192,
        max_framebuffer_height: 8192,
    ),
    &[
        Requirement::Property("max_viewport_dimensions", |own| {
            own.core.max_viewport_dimensions.into_iter().all(|own| own >= 8192)
        }),
        Requirement::Extension(
            newer::ROBUSTNESS2,
            &[
                feature!(robustness2.robust_buffer_access2),
                feature!(robustness2.robust_image_access2),
                feature!(robustness2.null_descriptor),
            ],
        ),
        Requirement::Extension(newer::PIPELINE_BINARY, &[feature!(pipeline_binary.pipeline_binaries)]),
        Requirement::Extension(
            khr::fragment_shading_rate::NAME,
            &[feature!(shading_rate.pipeline_fragment_shading_rate)],
        ),
        Requirement::Extension(khr::shader_clock::NAME, &[feature!(shader_clock.shader_subgroup_clock)]),
        Requirement::Extension(
            khr::workgroup_memory_explicit_layout::NAME,
            &[feature!(workgroup_layout.workgroup_memory_explicit_layout)],
        ),
        Requirement::Extension(
            newer::COMPUTE_SHADER_DERIVATIVES,
            &[feature!(derivatives.compute_derivative_group_linear)],
        ),
        Requirement::Extension(newer::MAINTENANCE7, &[feature!(maintenance7.maintenance7)]),
        Requirement::Extension(newer::MAINTENANCE8, &[feature!(maintenance8.maintenance8)]),
        Requirement::Extension(newer::MAINTENANCE9, &[feature!(maintenance9.maintenance9)]),
        Requirement::Extension(newer::DEPTH_CLAMP_ZERO_ONE, &[feature!(depth_clamp_zero_one.depth_clamp_zero_one)]),
        Requirement::Extension(newer::COPY_MEMORY_INDIRECT, &[feature!(copy_memory_indirect.indirect_memory_copy)]),
        Requirement::Extension(newer::SHADER_UNTYPED_POINTERS, &[feature!(untyped_pointers.shader_untyped_pointers)]),
        Requirement::InstanceExtension(khr::surface::NAME),
        Requirement::InstanceExtension(khr::get_surface_capabilities2::NAME),
        Requirement::InstanceExtension(newer::SURFACE_MAINTENANCE1),
        Requirement::Extension(khr::swapchain::NAME, &[]),
        Requirement::Extension(
            newer::PRESENT_MODE_FIFO_LATEST_READY,
            &[feature!(fifo_latest_ready.present_mode_fifo_latest_ready)],
        ),
        Requirement::Extension(newer::PRESENT_ID2, &[feature!(present_id2.present_id2)]),
        Requirement::Extension(newer::PRESENT_WAIT2, &[feature!(present_wait2.present_wait2)]),
        Requirement::Extension(
            newer::SWAPCHAIN_MAINTENANCE1,
            &[feature!(swapchain_maintenance1.swapchain_maintenance1)],
        ),
        Requirement::Extension(khr::cooperative_matrix::NAME, &[feature!(cooperative_matrix.cooperative_matrix)]),
    ],
];

/// Each milestone requires the one before it.
const MILESTONES: [Milestone; 3] = [
    Milestone { year: 2022, requirements: ROADMAP_2022 },
    Milestone { year: 2024, requirements: ROADMAP_2024 },
    Milestone { year: 2026, requirements: ROADMAP_2026 },
];

impl PropertySet {
    /// The properties of a device of Vulkan 1.1. Structures that it does not know are empty.
    fn of(instance: &InstanceHandles, raw: vk::PhysicalDevice, version: u32) -> Self {
        let mut own = Self::default();
        let mut query = vk::PhysicalDeviceProperties2::default().push_next(&mut own.subgroup);
        if version >= vk::API_VERSION_1_2 {
            query = query.push_next(&mut own.floats).push_next(&mut own.indexing);
        }
        if version >= vk::API_VERSION_1_3 {
            query = query.push_next(&mut own.subgroup_sizes);
        }
        // SAFETY: the device was listed by this instance, and the structures live until the call returns.
        unsafe { instance.raw.get_physical_device_properties2(raw, &mut query) };
        own.core = query.properties.limits;
        own
    }
}

/// What a device says of itself, as far as milestones ask.
struct Answers<'a> {
    version: u32,
    extensions: &'a BTreeSet<String>,
    instance_extensions: BTreeSet<String>,
    features: FeatureSet,
    properties: PropertySet,
}

impl Requirement {
    /// The requirement that a device does not meet, in words; none if it does.
    fn missing(&self, device: &Answers<'_>) -> Option<String> {
        let unless = |is_met: bool, text: &dyn Fn() -> String| (!is_met).then(text);
        let lists = |name: &CStr| device.extensions.contains(&*name.to_string_lossy());
        let is_on = |feature: &Feature| feature.1(&device.features);
        match self {
            Self::Version(least) => unless(device.version >= *least, &|| {
                format!("Vulkan {} (the device has {})", minor(*least), minor(device.version))
            }),
            Self::InstanceExtension(name) => {
                let name = name.to_string_lossy();
                unless(device.instance_extensions.contains(&*name), &|| format!("{name} of the instance"))
            }
            Self::Extension(name, features) => match features.iter().find(|own| !is_on(own)) {
                _ if !lists(name) => Some(name.to_string_lossy().into_owned()),
                Some((feature, _)) => Some(format!("{} of {}", camel(feature), name.to_string_lossy())),
                None => None,
            },
            Self::ExtensionWithOneOf(name, features) => {
                unless(lists(name) && features.iter().any(is_on), &|| name.to_string_lossy().into_owned())
            }
            Self::Feature(feature) => unless(is_on(feature), &|| camel(feature.0)),
            Self::AtLeast(name, least, of) => {
                let own = of(&device.properties);
                unless(own >= *least, &|| format!("{} {own} (at least {least})", camel(name)))
            }
            Self::AtMost(name, most, of) => {
                let own = of(&device.properties);
                unless(own <= *most, &|| format!("{} {own} (at most {most})", camel(name)))
            }
            Self::Property(name, is_met) => unless(is_met(&device.properties), &|| camel(name)),
        }
    }

    /// The name of the feature or extension, if a device is opened with it.
    fn used(&self, asked: &FeatureSet, enabled: &BTreeSet<String>) -> Option<String> {
        match self {
            Self::Feature((name, is_asked)) => is_asked(asked).then(|| camel(name)),
            Self::Extension(name, _) | Self::ExtensionWithOneOf(name, _) => {
                enabled.get(&*name.to_string_lossy()).cloned()
            }
            _ => None,
        }
    }
}

impl PhysicalDevice {
    /// The device beside each Roadmap milestone, from the first.
    ///
    /// # Errors
    /// When the instance's extensions cannot be listed.
    pub fn roadmaps(&self) -> Result<Vec<Roadmap>> {
        let version = self.api_version.min(self.instance.api_version);
        let known = Knowledge { version, extensions: &self.extensions };
        // The calls are of Vulkan 1.1.
        let (features, properties) = match self.api_version >= vk::API_VERSION_1_1 {
            true => {
                (FeatureSet::of(&self.instance, self.raw, known), PropertySet::of(&self.instance, self.raw, version))
            }
            false => (
                FeatureSet { core: self.features, ..FeatureSet::default() },
                PropertySet { core: self.limits, ..PropertySet::default() },
            ),
        };
        let instance_extensions = enumerate_extensions(&self.instance.entry, None)?;
        let device = Answers { version, extensions: &self.extensions, instance_extensions, features, properties };
        // Windows enable more, as swapchains; frames are the same without.
        let enabled = EnabledFeatures::of(self, &[]);
        let extensions = enabled.extensions().map(|name| name.to_string_lossy().into_owned()).collect();
        Ok(beside(&device, &enabled.asked(), &extensions))
    }
}

fn beside(device: &Answers<'_>, asked: &FeatureSet, enabled: &BTreeSet<String>) -> Vec<Roadmap> {
    let mut before: Option<Roadmap> = None;
    let milestones = MILESTONES.iter().map(|Milestone { year, requirements }| {
        let all = || requirements.iter().copied().flatten();
        let inherited = before.as_ref().map(|own| (!own.missing.is_empty()).then(|| format!("Roadmap {}", own.year)));
        let own = all().filter_map(|own| own.missing(device));
        let missing: Vec<_> = match &inherited {
            Some(lacks) => lacks.iter().cloned().chain(own).collect(),
            None => own.collect(),
        };
        let used = all().filter_map(|own| own.used(asked, enabled)).collect();
        let requirements = all().count() + usize::from(inherited.is_some());
        let roadmap = Roadmap { year: *year, requirements, missing, used };
        before = Some(roadmap.clone());
        roadmap
    });
    milestones.collect()
}

/// A version without its patch.
fn minor(version: u32) -> String {
    format!("{}.{}", vk::api_version_major(version), vk::api_version_minor(version))
}

/// The specification's name of a field that ash names in its own way: `max_image_dimension2_d` is `maxImageDimension2D`.
fn camel(name: &str) -> String {
    let mut words = name.split('_');
    let first = words.next().unwrap_or_default().to_owned();
    words.fold(first, |mut text, word| {
        let mut letters = word.chars();
        text.extend(letters.next().map(|letter| letter.to_ascii_uppercase()));
        text.push_str(letters.as_str());
        text
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn answers(features: FeatureSet, extensions: &BTreeSet<String>, version: u32) -> Answers<'_> {
        let instance_extensions = extensions.clone();
        Answers { version, extensions, instance_extensions, features, properties: PropertySet::default() }
    }

    /// The names of all extensions that milestones require.
    fn all_extensions() -> BTreeSet<String> {
        let all = MILESTONES.iter().flat_map(|own| own.requirements.iter().copied().flatten());
        let name = |own: &Requirement| match own {
            Requirement::InstanceExtension(name)
            | Requirement::Extension(name, _)
            | Requirement::ExtensionWithOneOf(name, _) => Some(name.to_string_lossy().into_owned()),
            _ => None,
        };
        all.filter_map(name).collect()
    }

    #[test]
    fn a_device_without_anything_lacks_its_version_first_and_each_requirement_once() {
        let (none, asked) = (BTreeSet::new(), FeatureSet::default());
        let device = answers(FeatureSet::default(), &none, vk::API_VERSION_1_1);
        for own in beside(&device, &asked, &none) {
            let version = own.missing.iter().position(|own| own.starts_with("Vulkan 1."));
            // That of 2024 is its milestone's before.
            assert_eq!(version, [Some(0), None, Some(1)][usize::from(own.year - 2022) / 2], "{:?}", own.missing);
            // Granularities are steps, of which 0 is the best.
            let granularities = if own.year == 2022 { 3 } else { 0 };
            assert_eq!(own.missing.len() + granularities, own.requirements, "{:?}", own.missing);
            let names: BTreeSet<_> = own.missing.iter().collect();
            assert_eq!(names.len(), own.missing.len(), "a requirement stands twice: {:?}", own.missing);
            assert!(own.used.is_empty(), "{:?}", own.used);
        }
    }

    #[test]
    fn a_device_with_all_features_and_extensions_lacks_limits_alone() {
        let (all, asked) = (all_extensions(), FeatureSet::default());
        let device = answers(FeatureSet::all(), &all, API_VERSION_1_4);
        for own in beside(&device, &asked, &BTreeSet::new()) {
            let (own_limits, before) = own.missing.split_at(usize::from(own.year > 2022));
            assert!(own_limits.iter().all(|own| own.starts_with("Roadmap 20")), "{own_limits:?}");
            let words = ["max", "sub", "standard", "shader", "mipmap", "timestamp"];
            let is_limit = |own: &String| words.iter().any(|word| own.starts_with(word));
            assert!(!before.is_empty() && before.iter().all(is_limit), "{before:?}");
        }
    }

    #[test]
    fn an_extension_without_its_feature_is_named_with_it() {
        let all = all_extensions();
        let device = answers(FeatureSet::default(), &all, API_VERSION_1_4);
        let missing = beside(&device, &FeatureSet::default(), &all).swap_remove(1).missing;
        for says in ["maintenance5 of VK_KHR_maintenance5", "VK_KHR_line_rasterization", "shaderFloat16"] {
            assert!(missing.iter().any(|own| own == says), "'{says}' is not in {missing:?}");
        }
    }

    #[test]
    fn features_that_devices_are_opened_with_are_used() {
        let enabled =
            EnabledFeatures { synchronization2: true, local_read: true, depth_clamp: true, ..Default::default() };
        let extensions = enabled.extensions().map(|name| name.to_string_lossy().into_owned()).collect();
        let device = answers(FeatureSet::default(), &extensions, vk::API_VERSION_1_1);
        let used = beside(&device, &enabled.asked(), &extensions).into_iter().map(|own| own.used);
        let [first, second, third] = &used.collect::<Vec<_>>()[..] else { panic!("three milestones") };
        assert_eq!(first[..], ["depthClamp", "synchronization2", "dynamicRendering"]);
        assert_eq!(second[..], ["VK_KHR_dynamic_rendering", "VK_KHR_dynamic_rendering_local_read"]);
        assert!(third.is_empty(), "{third:?}");
    }

    #[test]
    fn names_are_the_specifications() {
        assert_eq!(camel("max_image_dimension2_d"), "maxImageDimension2D");
        assert_eq!(camel("shader_rounding_mode_RTE_float16"), "shaderRoundingModeRTEFloat16");
        assert_eq!(camel("synchronization2"), "synchronization2");
    }
}
