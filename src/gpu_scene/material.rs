//! Textures on the device, and a descriptor set for each material that samples any.

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;
use std::sync::Arc;

use ash::vk;

use crate::gpu::{
    self, DescriptorPool, Device, Image, ImageDesc, Location, MemoryKind, Owned, Sampler, SetLayout, SetWriter,
    Uploader, can_blit, mip_count,
};
use crate::plan::{FramePlan, World};
use crate::scene::{ColorSpace, Scene, Texture, TextureSlot};

/// Bindings of a material's set: a texture for each [`TextureSlot`], then the sampler.
const SLOTS: u32 = 6;
const SAMPLER: u32 = SLOTS;

/// The textures that the plan samples.
pub struct Materials {
    pub set_layout: Owned<vk::DescriptorSetLayout>,
    /// By material; `None` where it samples nothing.
    pub sets: Vec<Option<vk::DescriptorSet>>,
    _pool: DescriptorPool,
    _sampler: Owned<vk::Sampler>,
    _images: BTreeMap<usize, Image>,
}

impl Materials {
    /// `None` when the plan samples no texture.
    pub(super) fn new(
        device: &Arc<Device>,
        uploader: &mut Uploader,
        scene: &Scene,
        world: &World,
        plan: &FramePlan,
    ) -> gpu::Result<Option<Self>> {
        let wanted = textures_by_material(world, plan);
        if wanted.is_empty() {
            return Ok(None);
        }
        let mut images = BTreeMap::new();
        for &texture in wanted.values().flat_map(|slots| slots.values()) {
            if let Entry::Vacant(place) = images.entry(texture) {
                place.insert(upload(device, uploader, &scene.textures[texture])?);
            }
        }
        let sampler = Sampler::new(device, "material sampler", &sampler_info())?;
        let set_layout = SetLayout::new(device, "material set layout", &bindings())?;
        let count = wanted.len() as u32;
        let pool = DescriptorPool::new(
            device,
            "material pool",
            count.max(1),
            &[(vk::DescriptorType::SAMPLED_IMAGE, SLOTS * count.max(1)), (vk::DescriptorType::SAMPLER, count.max(1))],
        )?;
        let mut sets = vec![None; scene.materials.len()];
        for (&material, slots) in &wanted {
            let set = pool.allocate(&format!("material {}", scene.materials[material].name), set_layout.raw)?;
            let mut writer = SetWriter::new();
            for slot in 0..SLOTS {
                // A slot without a texture is never sampled, but its descriptor must be valid: it names one that is there.
                let texture = slots.get(&slot).or_else(|| slots.values().next());
                let image = &images[texture.expect("only materials with textures have a set")];
                writer = writer.sampled_image(slot, image.view, vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL);
            }
            writer.sampler(SAMPLER, sampler.raw).update(device, set);
            sets[material] = Some(set);
        }
        Ok(Some(Self { set_layout, sets, _pool: pool, _sampler: sampler, _images: images }))
    }
}

/// For each drawn material the textures that its pipelines sample, by binding.
fn textures_by_material(world: &World, plan: &FramePlan) -> BTreeMap<usize, BTreeMap<u32, usize>> {
    let mut wanted: BTreeMap<usize, BTreeMap<u32, usize>> = BTreeMap::new();
    for object in &world.objects {
        let material = &world.materials[object.material];
        for (slot, texture) in material.textures() {
            // SHADOW samples masks whatever GEOMETRY does.
            let masks = slot == TextureSlot::BaseColor && material.is_masked() && plan.shadow.is_some();
            if object.key.textures.contains(slot) || masks {
                wanted.entry(object.material).or_default().insert(slot as u32, texture);
            }
        }
    }
    wanted
}

fn bindings() -> Vec<vk::DescriptorSetLayoutBinding<'static>> {
    let binding = |index, kind| {
        vk::DescriptorSetLayoutBinding::default()
            .binding(index)
            .descriptor_type(kind)
            .descriptor_count(1)
            .stage_flags(vk::ShaderStageFlags::FRAGMENT)
    };
    (0..SLOTS)
        .map(|slot| binding(slot, vk::DescriptorType::SAMPLED_IMAGE))
        .chain([binding(SAMPLER, vk::DescriptorType::SAMPLER)])
        .collect()
}

fn sampler_info() -> vk::SamplerCreateInfo<'static> {
    vk::SamplerCreateInfo::default()
        .mag_filter(vk::Filter::LINEAR)
        .min_filter(vk::Filter::LINEAR)
        .mipmap_mode(vk::SamplerMipmapMode::LINEAR)
        .address_mode_u(vk::SamplerAddressMode::REPEAT)
        .address_mode_v(vk::SamplerAddressMode::REPEAT)
        .address_mode_w(vk::SamplerAddressMode::REPEAT)
        .max_lod(vk::LOD_CLAMP_NONE)
}

fn upload(device: &Arc<Device>, uploader: &mut Uploader, texture: &Texture) -> gpu::Result<Image> {
    let extent = vk::Extent2D { width: texture.size[0], height: texture.size[1] };
    let format = match texture.color_space {
        ColorSpace::Srgb => vk::Format::R8G8B8A8_SRGB,
        ColorSpace::Linear => vk::Format::R8G8B8A8_UNORM,
    };
    let image = Image::new(
        device,
        &ImageDesc {
            name: &format!("texture {}", texture.name),
            format,
            extent,
            mip_levels: if can_blit(&device.physical, format) { mip_count(extent) } else { 1 },
            // The chain is made by blits from level to level.
            usage: vk::ImageUsageFlags::SAMPLED | vk::ImageUsageFlags::TRANSFER_DST | vk::ImageUsageFlags::TRANSFER_SRC,
            location: Location::Device,
            kind: MemoryKind::Texture,
            ..ImageDesc::default()
        },
    )?;
    uploader.texture(&image, &texture.texels)?;
    Ok(image)
}
