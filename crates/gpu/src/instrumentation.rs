//! The device features that GPU-assisted validation needs: the layer adds code to every shader, which checks the shader's accesses before they happen
//! and writes its findings to a buffer.

use ash::vk;

use super::error::{Error, Result};
use super::instance::Instance;
use super::physical::PhysicalDevice;

/// The version of the layer from which on it reports no access that robust buffer access defines: somewhere after 1.4.309, which does, up to 1.4.363.
pub(super) const ROBUST_IS_RIGHT: u32 = vk::make_api_version(0, 1, 4, 310);

/// The features that are enabled for the layer's sake. A layer forces on the features that it needs and does not find enabled, and warns of that.
#[derive(Default)]
pub(super) struct Instrumentation {
    core: vk::PhysicalDeviceFeatures,
    vulkan11: Option<vk::PhysicalDeviceVulkan11Features<'static>>,
    vulkan12: Option<vk::PhysicalDeviceVulkan12Features<'static>>,
}

impl Instrumentation {
    /// Returns the instrumentation features that the device has. Only the first two are essential; layers leave out the checks that need the others.
    pub(super) fn of(instance: &Instance, physical: &PhysicalDevice) -> Result<Instrumentation> {
        let has = &physical.features;
        let essential = [
            (has.fragment_stores_and_atomics, "fragmentStoresAndAtomics"),
            (has.vertex_pipeline_stores_and_atomics, "vertexPipelineStoresAndAtomics"),
        ];
        if let Some((_, missing)) = essential.iter().find(|(has, _)| *has == vk::FALSE) {
            let name = &physical.name;
            return Err(Error::Unsupported(format!("GPU-assisted validation needs {missing}, which '{name}' lacks")));
        }
        // An access that is reported is then one with a defined result, which reaches nobody else's memory. Newer layers do not report it, since it is no
        // mistake there.
        let is_checked_anyway = instance.validation_layer().is_none_or(|layer| layer < ROBUST_IS_RIGHT);
        let core = vk::PhysicalDeviceFeatures {
            fragment_stores_and_atomics: vk::TRUE,
            vertex_pipeline_stores_and_atomics: vk::TRUE,
            shader_int64: has.shader_int64,
            shader_int16: has.shader_int16,
            robust_buffer_access: if is_checked_anyway { has.robust_buffer_access } else { vk::FALSE },
            ..Default::default()
        };
        // Structures of Vulkan 1.2 are for instances and devices that both know it.
        if instance.api_version().min(physical.api_version) < vk::API_VERSION_1_2 {
            return Ok(Instrumentation { core, ..Instrumentation::default() });
        }
        let (mut has11, mut has12) =
            (vk::PhysicalDeviceVulkan11Features::default(), vk::PhysicalDeviceVulkan12Features::default());
        let mut query = vk::PhysicalDeviceFeatures2::default().push_next(&mut has11).push_next(&mut has12);
        // SAFETY: the device was listed by this instance, and the structures live until the call returns.
        unsafe { instance.raw().get_physical_device_features2(physical.raw, &mut query) };
        let vulkan11 = vk::PhysicalDeviceVulkan11Features {
            storage_buffer16_bit_access: has11.storage_buffer16_bit_access,
            ..Default::default()
        };
        let vulkan12 = vk::PhysicalDeviceVulkan12Features {
            storage_buffer8_bit_access: has12.storage_buffer8_bit_access,
            uniform_and_storage_buffer8_bit_access: has12.uniform_and_storage_buffer8_bit_access,
            shader_int8: has12.shader_int8,
            scalar_block_layout: has12.scalar_block_layout,
            timeline_semaphore: has12.timeline_semaphore,
            buffer_device_address: has12.buffer_device_address,
            vulkan_memory_model: has12.vulkan_memory_model,
            vulkan_memory_model_device_scope: has12.vulkan_memory_model_device_scope,
            ..Default::default()
        };
        Ok(Instrumentation { core, vulkan11: Some(vulkan11), vulkan12: Some(vulkan12) })
    }

    /// Adds the instrumentation's features of Vulkan 1.0 to the program's.
    pub(super) fn with(&self, features: vk::PhysicalDeviceFeatures) -> vk::PhysicalDeviceFeatures {
        let either = |a, b| vk::Bool32::from(a == vk::TRUE || b == vk::TRUE);
        let core = &self.core;
        vk::PhysicalDeviceFeatures {
            fragment_stores_and_atomics: either(features.fragment_stores_and_atomics, core.fragment_stores_and_atomics),
            vertex_pipeline_stores_and_atomics: either(
                features.vertex_pipeline_stores_and_atomics,
                core.vertex_pipeline_stores_and_atomics,
            ),
            shader_int64: either(features.shader_int64, core.shader_int64),
            shader_int16: either(features.shader_int16, core.shader_int16),
            robust_buffer_access: either(features.robust_buffer_access, core.robust_buffer_access),
            ..features
        }
    }

    /// Chains its features of later versions. Returns true if the structure of Vulkan 1.2 is among them: it then has the program's own features as well.
    pub(super) fn chain<'a>(
        &'a mut self,
        mut info: vk::DeviceCreateInfo<'a>,
        non_uniform_textures: bool,
    ) -> (vk::DeviceCreateInfo<'a>, bool) {
        let is_with_1_2 = self.vulkan12.is_some();
        if let Some(features) = &mut self.vulkan11 {
            info = info.push_next(features);
        }
        if let Some(features) = &mut self.vulkan12 {
            // A device that is opened with the extension must be asked for the first one, too.
            features.descriptor_indexing = non_uniform_textures.into();
            features.shader_sampled_image_array_non_uniform_indexing = non_uniform_textures.into();
            info = info.push_next(features);
        }
        (info, is_with_1_2)
    }
}
