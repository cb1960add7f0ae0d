//! Textures on the device, and a descriptor set for each material that samples any: exactly what its pipelines sample.

use std::collections::BTreeMap;
use std::sync::Arc;

use ash::vk;

use crate::gpu::{
    self, DescriptorPool, Device, Image, ImageDesc, Location, MemoryKind, Owned, Sampler, SetLayout, SetLayoutBinding,
    SetWriter, Uploader, binding,
};
use crate::plan::{FramePlan, PlannedTexture, TextureMask, TextureSource};
use crate::scene::{ColorSpace, Scene, TextureSlot};

/// The binding of the sampler in a material's set; textures are numbered as [`TextureSlot`] is.
const SAMPLER: u32 = 15;

/// The textures that the plan has on the device.
pub struct Materials {
    /// By the slots that a set has: no set has a binding that its pipelines do not sample.
    layouts: BTreeMap<TextureMask, SetLayout>,
    /// By material, for what shades.
    sets: BTreeMap<usize, vk::DescriptorSet>,
    /// By material, for SHADOW, which samples the base colour alone.
    holes: BTreeMap<usize, vk::DescriptorSet>,
    _pool: Option<DescriptorPool>,
    _sampler: Option<Owned<vk::Sampler>>,
    _images: Vec<Image>,
}

impl Materials {
    /// `None` when the plan has no texture.
    pub(super) fn new(
        device: &Arc<Device>,
        uploader: &mut Uploader,
        scene: &Scene,
        plan: &FramePlan,
    ) -> gpu::Result<Option<Self>> {
        let planned = &plan.textures;
        if planned.images.is_empty() {
            return Ok(None);
        }
        let upload = |texture| upload(device, uploader, scene, texture);
        let images = planned.images.iter().map(upload).collect::<gpu::Result<Vec<_>>>()?;
        let mut materials = Self {
            layouts: BTreeMap::new(),
            sets: BTreeMap::new(),
            holes: BTreeMap::new(),
            _pool: None,
            _sampler: None,
            _images: images,
        };
        if !planned.sampled().is_empty() {
            materials.describe(device, scene, plan)?;
        }
        Ok(Some(materials))
    }

    /// The layout of sets with these slots, if some material has them.
    pub fn layout(&self, slots: TextureMask) -> Option<vk::DescriptorSetLayout> {
        self.layouts.get(&slots).map(|layout| layout.raw)
    }

    /// What a material's pipelines sample.
    pub fn set(&self, material: usize) -> Option<vk::DescriptorSet> {
        self.sets.get(&material).copied()
    }

    /// What cuts holes into a material's shadow.
    pub fn holes(&self, material: usize) -> Option<vk::DescriptorSet> {
        self.holes.get(&material).copied()
    }

    /// Makes the sets.
    fn describe(&mut self, device: &Arc<Device>, scene: &Scene, plan: &FramePlan) -> gpu::Result<()> {
        let planned = &plan.textures;
        let sampler = Sampler::new(device, "material sampler", &sampler_info(plan.anisotropy))?;
        // What has no other texture than its base colour casts its shadow with the same set.
        let shared = |material: usize| planned.mask(material) == HOLES;
        let holes: Vec<(usize, BTreeMap<TextureSlot, usize>)> = planned
            .holes
            .iter()
            .filter(|&(&material, _)| !shared(material))
            .map(|(&material, &image)| (material, BTreeMap::from([(TextureSlot::BaseColor, image)])))
            .collect();
        let count = (planned.sets.len() + holes.len()) as u32;
        let textures: usize = planned.sets.values().map(BTreeMap::len).sum();
        let kinds = [
            (vk::DescriptorType::SAMPLED_IMAGE, (textures + holes.len()) as u32),
            (vk::DescriptorType::SAMPLER, count),
        ];
        let pool = DescriptorPool::new(device, "material pool", count, &kinds)?;
        let mut set = |name: String, slots: &BTreeMap<TextureSlot, usize>| {
            let layout = self.layout_of(device, slots.keys().copied().collect())?;
            let set = pool.allocate(&name, layout)?;
            let mut writer = SetWriter::new().sampler(SAMPLER, sampler.raw);
            for (&slot, &image) in slots {
                let view = self._images[image].view;
                writer = writer.sampled_image(slot as u32, view, vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL);
            }
            writer.update(device, set);
            Ok(set)
        };
        let name = |material: usize| &scene.materials[material].name;
        let (mut sets, mut own_holes) = (BTreeMap::new(), BTreeMap::new());
        for (&material, slots) in &planned.sets {
            sets.insert(material, set(format!("material {}", name(material)), slots)?);
        }
        for (material, slots) in &holes {
            own_holes.insert(*material, set(format!("holes of material {}", name(*material)), slots)?);
        }
        for (&material, _) in planned.holes.iter().filter(|&(&material, _)| shared(material)) {
            own_holes.extend(sets.get(&material).map(|&set| (material, set)));
        }
        (self.sets, self.holes) = (sets, own_holes);
        (self._pool, self._sampler) = (Some(pool), Some(sampler));
        Ok(())
    }

    fn layout_of(&mut self, device: &Arc<Device>, slots: TextureMask) -> gpu::Result<vk::DescriptorSetLayout> {
        if let Some(layout) = self.layout(slots) {
            return Ok(layout);
        }
        let layout = SetLayout::new(device, &format!("material set layout, {slots}"), &bindings(slots))?;
        let raw = layout.raw;
        self.layouts.insert(slots, layout);
        Ok(raw)
    }
}

/// The slot of a set that cuts holes into shadows.
pub const HOLES: TextureMask = TextureMask::BASE_COLOR;

fn bindings(slots: TextureMask) -> Vec<SetLayoutBinding> {
    let binding = |index, kind| binding(index, kind, vk::ShaderStageFlags::FRAGMENT);
    let textures = slots.slots().map(|slot| binding(slot as u32, vk::DescriptorType::SAMPLED_IMAGE));
    textures.chain([binding(SAMPLER, vk::DescriptorType::SAMPLER)]).collect()
}

fn sampler_info(anisotropy: u32) -> vk::SamplerCreateInfo<'static> {
    vk::SamplerCreateInfo::default()
        .mag_filter(vk::Filter::LINEAR)
        .min_filter(vk::Filter::LINEAR)
        .mipmap_mode(vk::SamplerMipmapMode::LINEAR)
        .address_mode_u(vk::SamplerAddressMode::REPEAT)
        .address_mode_v(vk::SamplerAddressMode::REPEAT)
        .address_mode_w(vk::SamplerAddressMode::REPEAT)
        .anisotropy_enable(anisotropy > 1)
        .max_anisotropy(anisotropy as f32)
        .max_lod(vk::LOD_CLAMP_NONE)
}

fn upload(
    device: &Arc<Device>,
    uploader: &mut Uploader,
    scene: &Scene,
    planned: &PlannedTexture,
) -> gpu::Result<Image> {
    let neutral = planned.source.texel();
    let (name, texels) = match (planned.source, &neutral) {
        (TextureSource::Scene(index), _) => {
            (format!("texture {}", scene.textures[index].name), &scene.textures[index].texels[..])
        }
        (source, texel) => (format!("neutral texture, {source:?}"), texel.as_ref().map_or(&[][..], |texel| &texel[..])),
    };
    let format = match planned.color_space {
        ColorSpace::Srgb => vk::Format::R8G8B8A8_SRGB,
        ColorSpace::Linear => vk::Format::R8G8B8A8_UNORM,
    };
    let usage = vk::ImageUsageFlags::SAMPLED | vk::ImageUsageFlags::TRANSFER_DST;
    // The chain is made by blits from level to level.
    let source = if planned.levels > 1 { vk::ImageUsageFlags::TRANSFER_SRC } else { vk::ImageUsageFlags::empty() };
    let image = Image::new(
        device,
        &ImageDesc {
            name: &name,
            format,
            extent: vk::Extent2D { width: planned.size[0], height: planned.size[1] },
            mip_levels: planned.levels,
            usage: usage | source,
            location: Location::Device,
            kind: MemoryKind::Texture,
            ..ImageDesc::default()
        },
    )?;
    uploader.texture(&image, texels)?;
    Ok(image)
}
