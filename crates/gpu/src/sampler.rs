//! Samplers.

use std::sync::Arc;

use ash::vk;

use super::device::Device;
use super::error::{Doing, Error, Result};
use super::owned::Owned;

/// The filtering and addressing of an image in shaders.
pub type OwnedSampler = Owned<vk::Sampler>;

impl OwnedSampler {
    /// A sampler as `info` has it.
    ///
    /// # Errors
    /// [`Error::Unsupported`] for anisotropy that is not enabled; [`Error::TooLarge`] for more than the device has; too
    /// many samplers.
    pub fn new(device: &Arc<Device>, name: &str, info: &vk::SamplerCreateInfo<'_>) -> Result<OwnedSampler> {
        if info.anisotropy_enable == vk::TRUE {
            let limit = device.physical.limits.max_sampler_anisotropy;
            if !device.features.sampler_anisotropy {
                let lacks = format!("'{}' has no anisotropic filtering, as '{name}' needs", device.physical.name);
                return Err(Error::Unsupported(lacks));
            }
            if info.max_anisotropy > limit {
                let what = format!("the anisotropy of the sampler '{name}'");
                return Err(Error::TooLarge { what, asked: info.max_anisotropy as u64, limit: limit as u64 });
            }
        }
        // SAFETY: the device is alive, and the structure is the caller's (the module's contract).
        let raw = unsafe { device.raw.create_sampler(info, None) }
            .doing("vkCreateSampler", || format!("creating the sampler '{name}'"))?;
        Ok(Owned::new_from(device, name, raw))
    }

    /// Filters an image without mip levels linearly. Beyond the border lies the border.
    ///
    /// # Errors
    /// Too many samplers.
    pub fn bilinear(device: &Arc<Device>, name: &str) -> Result<OwnedSampler> {
        let edge = vk::SamplerAddressMode::CLAMP_TO_EDGE;
        let filtered = vk::SamplerCreateInfo::default().mag_filter(vk::Filter::LINEAR).min_filter(vk::Filter::LINEAR);
        Self::new(device, name, &filtered.address_mode_u(edge).address_mode_v(edge).address_mode_w(edge))
    }
}
