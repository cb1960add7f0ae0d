//! Descriptor set layouts, pools, and writing sets.

use std::ops::Range;
use std::sync::{Arc, Mutex, PoisonError};

use ash::vk;

use super::buffer::Buffer;
use super::device::Device;
use super::error::{Doing, Error, Result};
use super::owned::Owned;

/// A binding without immutable samplers.
pub type SetLayoutBinding = vk::DescriptorSetLayoutBinding<'static>;

/// The bindings of a descriptor set.
pub type SetLayout = Owned<vk::DescriptorSetLayout>;

impl SetLayout {
    /// A layout of these bindings.
    ///
    /// # Errors
    /// Running out of memory.
    pub fn new(device: &Arc<Device>, name: &str, bindings: &[vk::DescriptorSetLayoutBinding<'_>]) -> Result<SetLayout> {
        let info = vk::DescriptorSetLayoutCreateInfo::default().bindings(bindings);
        // SAFETY: the device is alive; immutable samplers, if any, are too (the module's contract).
        let raw = unsafe { device.raw.create_descriptor_set_layout(&info, None) }
            .doing("vkCreateDescriptorSetLayout", || format!("creating the descriptor set layout '{name}'"))?;
        let content = |own: &vk::DescriptorSetLayoutBinding<'_>| {
            (own.binding, own.descriptor_type, own.descriptor_count, own.stage_flags)
        };
        // Of immutable samplers only the handles are known, and another one may get the same later.
        if bindings.iter().all(|own| own.p_immutable_samplers.is_null()) {
            device.reuse.note(raw, bindings.iter().map(content).collect::<Vec<_>>());
        }
        Ok(Owned::new_from(device, name, raw))
    }
}

/// One descriptor of a kind, which these stages see.
pub fn binding(index: u32, kind: vk::DescriptorType, stages: vk::ShaderStageFlags) -> SetLayoutBinding {
    let binding = vk::DescriptorSetLayoutBinding::default().binding(index).descriptor_type(kind);
    binding.descriptor_count(1).stage_flags(stages)
}

/// A pool of descriptor sets, which all go with it.
pub struct DescriptorPool {
    owner: Owned<vk::DescriptorPool>,
    // Vulkan wants one thread at a time.
    sets: Mutex<Vec<vk::DescriptorSet>>,
}

impl Drop for DescriptorPool {
    fn drop(&mut self) {
        let sets = self.sets.get_mut().unwrap_or_else(PoisonError::into_inner);
        self.owner.device().registry.remove_sets(sets);
    }
}

impl DescriptorPool {
    /// A pool with room for `max_sets` sets and, over all of them, for the given number of descriptors of each type. Types with a count of 0 are left
    /// out, as Vulkan requires.
    ///
    /// # Errors
    /// [`Error::Misuse`] for room for no set; running out of memory.
    pub fn new(
        device: &Arc<Device>,
        name: &str,
        max_sets: u32,
        sizes: &[(vk::DescriptorType, u32)],
    ) -> Result<DescriptorPool> {
        if max_sets == 0 {
            return Err(Error::Misuse(format!("the descriptor pool '{name}' has room for no set")));
        }
        let of = |&(ty, descriptor_count): &(vk::DescriptorType, u32)| vk::DescriptorPoolSize { ty, descriptor_count };
        let sizes: Vec<vk::DescriptorPoolSize> = sizes.iter().filter(|(_, count)| *count > 0).map(of).collect();
        let info = vk::DescriptorPoolCreateInfo::default().max_sets(max_sets).pool_sizes(&sizes);
        // SAFETY: the device is alive.
        let raw = unsafe { device.raw.create_descriptor_pool(&info, None) }
            .doing("vkCreateDescriptorPool", || format!("creating the descriptor pool '{name}'"))?;
        Ok(DescriptorPool { owner: Owned::new_from(device, name, raw), sets: Mutex::default() })
    }

    /// A set whose descriptors are undefined. It lives as long as the pool.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`] if the pool is exhausted.
    pub fn allocate(&self, name: &str, layout: vk::DescriptorSetLayout) -> Result<vk::DescriptorSet> {
        let doing = || format!("allocating the descriptor set '{name}'");
        let layouts = [layout];
        let info = vk::DescriptorSetAllocateInfo::default().descriptor_pool(self.owner.raw).set_layouts(&layouts);
        let device = self.owner.device();
        let mut sets = self.sets.lock().unwrap_or_else(PoisonError::into_inner);
        // SAFETY: the pool is alive and used by no other thread, the layout is alive (the module's contract).
        let new = unsafe { device.raw.allocate_descriptor_sets(&info) }.doing("vkAllocateDescriptorSets", doing)?;
        let Some(&set) = new.first() else {
            return Err(Error::vulkan("vkAllocateDescriptorSets", doing(), vk::Result::ERROR_UNKNOWN));
        };
        sets.push(set);
        device.name_object(set, name);
        device.registry.add_set(set, name);
        Ok(set)
    }
}

/// The bytes of a buffer that a descriptor sees: `..` for all, `256` for as many from the start, `64..128` for some.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BufferRange {
    /// The first byte.
    pub offset: u64,
    /// The number of bytes; `vk::WHOLE_SIZE` for all from there.
    pub bytes: u64,
}

impl From<u64> for BufferRange {
    fn from(bytes: u64) -> Self {
        BufferRange { offset: 0, bytes }
    }
}

impl From<Range<u64>> for BufferRange {
    fn from(range: Range<u64>) -> Self {
        BufferRange { offset: range.start, bytes: range.end.saturating_sub(range.start) }
    }
}

impl From<std::ops::RangeFull> for BufferRange {
    fn from(_: std::ops::RangeFull) -> Self {
        BufferRange { offset: 0, bytes: vk::WHOLE_SIZE }
    }
}

#[derive(Clone)]
enum DescriptorInfo {
    Buffer(vk::DescriptorBufferInfo),
    /// An array, from its first element.
    Images(Vec<vk::DescriptorImageInfo>),
}

/// Collects the resources for the bindings of a set, then writes them all at once.
#[derive(Clone, Default)]
#[must_use = "nothing is written before `update`"]
pub struct SetWriter {
    writes: Vec<(u32, vk::DescriptorType, DescriptorInfo)>,
}

impl SetWriter {
    /// Nothing to write yet.
    pub fn new() -> SetWriter {
        SetWriter::default()
    }

    /// A uniform buffer.
    pub fn uniform_buffer(self, binding: u32, buffer: &Buffer, range: impl Into<BufferRange>) -> SetWriter {
        self.buffer(binding, vk::DescriptorType::UNIFORM_BUFFER, buffer, range.into())
    }

    /// A storage buffer.
    pub fn storage_buffer(self, binding: u32, buffer: &Buffer, range: impl Into<BufferRange>) -> SetWriter {
        self.buffer(binding, vk::DescriptorType::STORAGE_BUFFER, buffer, range.into())
    }

    /// An image that is sampled or fetched from, in the layout in which it then is.
    pub fn sampled_image(self, binding: u32, view: vk::ImageView, layout: vk::ImageLayout) -> SetWriter {
        self.image(binding, vk::DescriptorType::SAMPLED_IMAGE, view, layout)
    }

    /// An image that a shader reads and writes, in the layout in which it then is.
    pub fn storage_image(self, binding: u32, view: vk::ImageView, layout: vk::ImageLayout) -> SetWriter {
        self.image(binding, vk::DescriptorType::STORAGE_IMAGE, view, layout)
    }

    /// An input attachment, in the layout that it has in the subpass.
    pub fn input_attachment(self, binding: u32, view: vk::ImageView, layout: vk::ImageLayout) -> SetWriter {
        self.image(binding, vk::DescriptorType::INPUT_ATTACHMENT, view, layout)
    }

    /// A sampler.
    pub fn sampler(mut self, binding: u32, sampler: vk::Sampler) -> SetWriter {
        let info = vk::DescriptorImageInfo::default().sampler(sampler);
        self.writes.push((binding, vk::DescriptorType::SAMPLER, DescriptorInfo::Images(vec![info])));
        self
    }

    /// An array of images that are sampled, all in this layout.
    pub fn sampled_images(
        mut self,
        binding: u32,
        views: impl IntoIterator<Item = vk::ImageView>,
        layout: vk::ImageLayout,
    ) -> SetWriter {
        let info = |view| vk::DescriptorImageInfo::default().image_view(view).image_layout(layout);
        let all = DescriptorInfo::Images(views.into_iter().map(info).collect());
        self.writes.push((binding, vk::DescriptorType::SAMPLED_IMAGE, all));
        self
    }

    /// An array of samplers.
    pub fn samplers(mut self, binding: u32, samplers: impl IntoIterator<Item = vk::Sampler>) -> SetWriter {
        let info = |sampler| vk::DescriptorImageInfo::default().sampler(sampler);
        let all = DescriptorInfo::Images(samplers.into_iter().map(info).collect());
        self.writes.push((binding, vk::DescriptorType::SAMPLER, all));
        self
    }

    fn buffer(mut self, binding: u32, ty: vk::DescriptorType, buffer: &Buffer, range: BufferRange) -> SetWriter {
        let info = vk::DescriptorBufferInfo { buffer: buffer.raw, offset: range.offset, range: range.bytes };
        self.writes.push((binding, ty, DescriptorInfo::Buffer(info)));
        self
    }

    fn image(
        mut self,
        binding: u32,
        ty: vk::DescriptorType,
        view: vk::ImageView,
        layout: vk::ImageLayout,
    ) -> SetWriter {
        let info = vk::DescriptorImageInfo::default().image_view(view).image_layout(layout);
        self.writes.push((binding, ty, DescriptorInfo::Images(vec![info])));
        self
    }

    /// Writes the collected descriptors. No submission may be using the set.
    pub fn update(self, device: &Device, set: vk::DescriptorSet) {
        let writes: Vec<vk::WriteDescriptorSet<'_>> = self
            .writes
            .iter()
            .map(|(binding, ty, resource)| {
                let write = vk::WriteDescriptorSet::default().dst_set(set).dst_binding(*binding).descriptor_type(*ty);
                match resource {
                    DescriptorInfo::Buffer(info) => write.buffer_info(std::slice::from_ref(info)),
                    DescriptorInfo::Images(infos) => write.image_info(infos),
                }
            })
            .collect();
        // SAFETY: the set, the views and the samplers are alive, and the set is not in use (the module's contract).
        unsafe { device.raw.update_descriptor_sets(&writes, &[]) };
        device.registry.note_descriptors(set, self.writes.iter().map(|&(binding, ty, _)| (binding, ty)));
    }
}
