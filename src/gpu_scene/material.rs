//! Textures on the device, and a descriptor set for each material that samples any: exactly what its pipelines sample.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::sync::Arc;

use ash::vk;

use crate::gpu::{
    self, DescriptorPool, Device, Image, ImageDesc, Location, MemoryKind, Owned, Sampler, SetLayout, SetLayoutBinding,
    SetWriter, Uploader, binding,
};
use crate::plan::{FramePlan, GeometryKey, PlannedTexture, SetSamplers, TextureMask, TextureSource};
use crate::scene::{self, Filter, Scene, Texels, TextureSlot, Wrap};

/// The binding of the sampler in a material's set whose textures are sampled alike; textures are numbered as [`TextureSlot`] is.
pub const SAMPLER: u32 = 15;
/// The binding of the first texture's sampler where each has its own, as `shaders/shared/material.wgsl` declares them.
pub const OWN_SAMPLERS: u32 = 16;

/// What a material's set has.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct SetForm {
    pub textures: TextureMask,
    /// Each texture has a sampler of its own.
    pub own_samplers: bool,
}

impl SetForm {
    pub fn of(key: GeometryKey) -> Self {
        Self { textures: key.textures, own_samplers: key.own_samplers }
    }
}

/// The textures that the plan has on the device.
pub struct Materials {
    /// By the slots that a set has: no set has a binding that its pipelines do not sample.
    layouts: BTreeMap<SetForm, SetLayout>,
    /// By material, for what shades.
    sets: BTreeMap<usize, vk::DescriptorSet>,
    /// By material, for SHADOW, which samples the base colour alone.
    holes: BTreeMap<usize, vk::DescriptorSet>,
    _pool: Option<DescriptorPool>,
    _samplers: Vec<Owned<vk::Sampler>>,
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
            _samplers: Vec::new(),
            _images: images,
        };
        if !planned.sampled().is_empty() {
            materials.describe(device, scene, plan)?;
        }
        Ok(Some(materials))
    }

    /// The layout of sets of this form, if some material has one.
    pub fn layout(&self, form: SetForm) -> Option<vk::DescriptorSetLayout> {
        self.layouts.get(&form).map(|layout| layout.raw)
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
        let mut samplers = Samplers { device, anisotropy: plan.anisotropy, all: BTreeMap::new() };
        // What has no other texture than its base colour casts its shadow with the same set.
        let shared = |material: usize| planned.mask(material) == HOLES.textures;
        let holes: Vec<(usize, BTreeMap<TextureSlot, usize>)> = planned
            .holes
            .iter()
            .filter(|&(&material, _)| !shared(material))
            .map(|(&material, &image)| (material, BTreeMap::from([(TextureSlot::BaseColor, image)])))
            .collect();
        let count = (planned.sets.len() + holes.len()) as u32;
        let textures: usize = planned.sets.values().map(BTreeMap::len).sum();
        let samplers_of = |(&material, slots): (&usize, &BTreeMap<TextureSlot, usize>)| {
            if planned.samplers(material) == SetSamplers::Each { slots.len() } else { 1 }
        };
        let sampler_count = planned.sets.iter().map(samplers_of).sum::<usize>() + holes.len();
        let kinds = [
            (vk::DescriptorType::SAMPLED_IMAGE, (textures + holes.len()) as u32),
            (vk::DescriptorType::SAMPLER, sampler_count as u32),
        ];
        let pool = DescriptorPool::new(device, "material pool", count, &kinds)?;
        let mut set = |name: String, slots: &BTreeMap<TextureSlot, usize>, own: SetSamplers| {
            let form = SetForm { textures: slots.keys().copied().collect(), own_samplers: own == SetSamplers::Each };
            let layout = self.layout_of(device, form)?;
            let set = pool.allocate(&name, layout)?;
            let mut writer = SetWriter::new();
            if let SetSamplers::One(sampler) = own {
                writer = writer.sampler(SAMPLER, samplers.get(sampler)?);
            }
            for (&slot, &image) in slots {
                let view = self._images[image].view;
                writer = writer.sampled_image(slot as u32, view, vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL);
                if own == SetSamplers::Each {
                    let sampler = samplers.get(planned.images[image].sampler)?;
                    writer = writer.sampler(OWN_SAMPLERS + slot as u32, sampler);
                }
            }
            writer.update(device, set);
            Ok(set)
        };
        let name = |material: usize| &scene.materials[material].name;
        let (mut sets, mut own_holes) = (BTreeMap::new(), BTreeMap::new());
        for (&material, slots) in &planned.sets {
            sets.insert(material, set(format!("material {}", name(material)), slots, planned.samplers(material))?);
        }
        for (material, slots) in &holes {
            let image = slots.values().next().map(|&image| planned.images[image].sampler);
            let sampler = SetSamplers::One(image.unwrap_or_default());
            own_holes.insert(*material, set(format!("holes of material {}", name(*material)), slots, sampler)?);
        }
        for (&material, _) in planned.holes.iter().filter(|&(&material, _)| shared(material)) {
            own_holes.extend(sets.get(&material).map(|&set| (material, set)));
        }
        (self.sets, self.holes) = (sets, own_holes);
        (self._pool, self._samplers) = (Some(pool), samplers.all.into_values().collect());
        Ok(())
    }

    fn layout_of(&mut self, device: &Arc<Device>, form: SetForm) -> gpu::Result<vk::DescriptorSetLayout> {
        if let Some(layout) = self.layout(form) {
            return Ok(layout);
        }
        let slots = form.textures;
        let own = if form.own_samplers { ", each with its sampler" } else { "" };
        let layout = SetLayout::new(device, &format!("material set layout, {slots}{own}"), &bindings(form))?;
        let raw = layout.raw;
        self.layouts.insert(form, layout);
        Ok(raw)
    }
}

/// The form of a set that cuts holes into shadows.
pub const HOLES: SetForm = SetForm { textures: TextureMask::BASE_COLOR, own_samplers: false };

fn bindings(SetForm { textures, own_samplers }: SetForm) -> Vec<SetLayoutBinding> {
    let binding = |index, kind| binding(index, kind, vk::ShaderStageFlags::FRAGMENT);
    let sampled = textures.slots().map(|slot| binding(slot as u32, vk::DescriptorType::SAMPLED_IMAGE));
    let sampler = |index| binding(index, vk::DescriptorType::SAMPLER);
    match own_samplers {
        true => sampled.chain(textures.slots().map(|slot| sampler(OWN_SAMPLERS + slot as u32))).collect(),
        false => sampled.chain([sampler(SAMPLER)]).collect(),
    }
}

/// A sampler of the device for each way in which textures are sampled.
struct Samplers<'a> {
    device: &'a Arc<Device>,
    anisotropy: u32,
    all: BTreeMap<scene::Sampler, Owned<vk::Sampler>>,
}

impl Samplers<'_> {
    fn get(&mut self, how: scene::Sampler) -> gpu::Result<vk::Sampler> {
        if let Some(sampler) = self.all.get(&how) {
            return Ok(sampler.raw);
        }
        let name = match how {
            scene::Sampler::DEFAULT => "material sampler".to_owned(),
            other => format!("material sampler, {other:?}"),
        };
        let sampler = Sampler::new(self.device, &name, &sampler_info(how, self.anisotropy))?;
        let raw = sampler.raw;
        self.all.insert(how, sampler);
        Ok(raw)
    }
}

fn sampler_info(how: scene::Sampler, anisotropy: u32) -> vk::SamplerCreateInfo<'static> {
    let filter = |filter| match filter {
        Filter::Nearest => vk::Filter::NEAREST,
        Filter::Linear => vk::Filter::LINEAR,
    };
    let [u, v] = how.wrap.map(|wrap| match wrap {
        Wrap::Repeat => vk::SamplerAddressMode::REPEAT,
        Wrap::Mirror => vk::SamplerAddressMode::MIRRORED_REPEAT,
        Wrap::Clamp => vk::SamplerAddressMode::CLAMP_TO_EDGE,
    });
    // Several places of a texel that is meant to have an edge would soften it.
    let softens = [Some(how.magnify), Some(how.minify), how.levels] == [Some(Filter::Linear); 3];
    let anisotropy = if softens { anisotropy } else { 1 };
    vk::SamplerCreateInfo::default()
        .mag_filter(filter(how.magnify))
        .min_filter(filter(how.minify))
        .mipmap_mode(match how.levels {
            Some(Filter::Linear) => vk::SamplerMipmapMode::LINEAR,
            Some(Filter::Nearest) | None => vk::SamplerMipmapMode::NEAREST,
        })
        .address_mode_u(u)
        .address_mode_v(v)
        .address_mode_w(vk::SamplerAddressMode::REPEAT)
        .anisotropy_enable(anisotropy > 1)
        .max_anisotropy(anisotropy as f32)
        // A level above 0 says that the texture is minified; below a half the largest one is taken nevertheless (Vulkan, "Samplers").
        .max_lod(if how.levels.is_some() { vk::LOD_CLAMP_NONE } else { 0.25 })
}

fn upload(
    device: &Arc<Device>,
    uploader: &mut Uploader,
    scene: &Scene,
    planned: &PlannedTexture,
) -> gpu::Result<Image> {
    let name = match planned.source {
        TextureSource::Scene(index) => format!("texture {}", scene.textures[index].name),
        neutral => format!("neutral texture, {neutral:?}"),
    };
    let usage = vk::ImageUsageFlags::SAMPLED | vk::ImageUsageFlags::TRANSFER_DST;
    // The chain is made by blits from level to level.
    let source = if planned.makes_levels { vk::ImageUsageFlags::TRANSFER_SRC } else { vk::ImageUsageFlags::empty() };
    let image = Image::new(
        device,
        &ImageDesc {
            name: &name,
            format: planned.format(),
            extent: vk::Extent2D { width: planned.size[0], height: planned.size[1] },
            mip_levels: planned.levels,
            usage: usage | source,
            location: Location::Device,
            kind: MemoryKind::Texture,
            ..ImageDesc::default()
        },
    )?;
    let given = if planned.makes_levels { 1 } else { planned.levels };
    let levels: Vec<_> = (0..given).map(|level| level_of(scene, planned, level as usize)).collect();
    uploader.texture(&image, &levels)?;
    Ok(image)
}

/// A level in the format of the image.
fn level_of<'s>(scene: &'s Scene, planned: &PlannedTexture, level: usize) -> Cow<'s, [u8]> {
    let TextureSource::Scene(index) = planned.source else {
        return planned.source.texel().into_iter().flatten().collect();
    };
    match &scene.textures[index].texels {
        Texels::Blocks { levels, .. } if planned.blocks.is_some() => levels[level].as_slice().into(),
        _ => scene.textures[index].rgba8(level),
    }
}
