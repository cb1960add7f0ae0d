//! The light that a lens spreads, for TONEMAP, which adds it to the light of each pixel: the levels of BLOOM, and the set that names them.

use std::sync::Arc;

use ash::vk;

use super::{Making, Resource, ResourceUse, SAMPLED};
use crate::gpu::{self, Buffer, DescriptorPool, Device, SetLayout, SetWriter, binding, sync::Use};
use crate::plan::{BLOOM_LEVELS, FramePlan};

/// Reads the light that BLOOM has spread, from a buffer.
pub const LEVEL_READ: Use = SAMPLED;

/// Reads the spread light, where the plan has it.
pub(super) fn touch(plan: &FramePlan) -> Option<ResourceUse> {
    is_in(plan).then(|| {
        ResourceUse::resource(Resource::Buffers(BLOOM_LEVELS), LEVEL_READ).because("reads the first level of bloom")
    })
}

/// Returns true if there is spread light to be added.
pub(super) fn is_in(plan: &FramePlan) -> bool {
    plan.effects.bloom.is_some()
}

/// The constant TAPS of `shaders/shared/bloom.wgsl`.
pub(super) fn taps(plan: &FramePlan) -> u32 {
    plan.effects.bloom.map_or(0, |bloom| bloom.taps)
}

/// The set with the spread light.
pub struct SpreadLight {
    layout: SetLayout,
    pool: DescriptorPool,
    set: vk::DescriptorSet,
}

impl SpreadLight {
    /// `None` where the plan has none.
    ///
    /// # Errors
    /// When there is no memory for a set.
    pub(super) fn new(own: &Making) -> gpu::Result<Option<Self>> {
        let Some(levels) = levels(own) else { return Ok(None) };
        let kind = vk::DescriptorType::STORAGE_BUFFER;
        let layout = SetLayout::new(own.device, "spread light", &[binding(0, kind, vk::ShaderStageFlags::FRAGMENT)])?;
        let (pool, set) = bound(own.device, &layout, levels)?;
        Ok(Some(Self { layout, pool, set }))
    }

    pub(super) fn layout(&self) -> vk::DescriptorSetLayout {
        self.layout.raw
    }

    pub(super) fn set(&self) -> vk::DescriptorSet {
        self.set
    }

    /// Reads other levels, as of another size.
    ///
    /// # Errors
    /// When there is no memory for a set.
    pub(super) fn rebind(&mut self, own: &Making) -> gpu::Result<()> {
        if let Some(levels) = levels(own) {
            (self.pool, self.set) = bound(own.device, &self.layout, levels)?;
        }
        Ok(())
    }
}

fn levels<'a>(own: &Making<'a>) -> Option<&'a Buffer> {
    own.buffers(Resource::Buffers(BLOOM_LEVELS)).next()
}

fn bound(
    device: &Arc<Device>,
    layout: &SetLayout,
    levels: &Buffer,
) -> gpu::Result<(DescriptorPool, vk::DescriptorSet)> {
    let pool = DescriptorPool::new(device, "spread light", 1, &[(vk::DescriptorType::STORAGE_BUFFER, 1)])?;
    let set = pool.allocate("spread light", layout.raw)?;
    SetWriter::new().storage_buffer(0, levels, levels.size).update(device, set);
    Ok((pool, set))
}
