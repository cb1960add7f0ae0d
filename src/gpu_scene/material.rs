//! Textures on the device, and a descriptor set for each textured material, with exactly the bindings that its pipelines sample.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::sync::Arc;

use ash::vk;

use super::UploadSource;
use crate::gpu::{
    self, DescriptorPool, Device, Image, ImageDesc, Location, MemoryKind, Owned, OwnedSampler, SetLayout,
    SetLayoutBinding, SetWriter, Uploader, binding,
};
use crate::plan::{FramePlan, GeometryKey, PlannedTexture, SetSamplers, TextureMask, TexturePlan, TextureSource};
use crate::scene::{self, Filter, Scene, Texels, TextureSlot, Wrap};

/// The binding of the sampler in a material's set whose textures are sampled alike; textures are numbered as [`TextureSlot`] is.
pub const SAMPLER: u32 = 15;
/// The binding of the first texture's sampler where each has its own, as `shaders/shared/material.wgsl` declares them.
pub const OWN_SAMPLERS: u32 = 16;

/// The layout of a material's descriptor set.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct SetForm {
    pub textures: TextureMask,
    /// True if each texture has its own sampler.
    pub own_samplers: bool,
}

impl SetForm {
    pub fn of(key: GeometryKey) -> Self {
        Self { textures: key.textures, own_samplers: key.own_samplers }
    }
}

/// The textures that the plan has on the device.
pub struct Materials {
    /// Layouts by the slots of a set: no set has a binding that its pipelines do not sample.
    layouts: BTreeMap<SetForm, SetLayout>,
    /// Descriptor sets for passes that shade, by material and sheet of its atlas.
    sets: BTreeMap<(usize, u32), vk::DescriptorSet>,
    /// Descriptor sets for SHADOW and TINT, which sample only the base colour, by material and sheet.
    holes: BTreeMap<(usize, u32), vk::DescriptorSet>,
    /// Present if a shader looks textures up by their numbers.
    numbered: Option<NumberedTextures>,
    _pool: Option<DescriptorPool>,
    _samplers: Vec<Owned<vk::Sampler>>,
    /// By the plan's images, the sheets of each: one, but of atlases with more cells than an array has layers.
    images: Vec<Vec<MaterialImage>>,
}

/// All textures and samplers, by their numbers.
pub struct NumberedTextures {
    pub views: Vec<Owned<vk::ImageView>>,
    pub samplers: Vec<vk::Sampler>,
    /// By material and sheet: each slot's number, as `SeenMaterial` of `shaders/shared/seen.wgsl` has it.
    slots: BTreeMap<(usize, u32), [u32; TextureSlot::STORED]>,
}

impl NumberedTextures {
    /// Returns the numbers of a material's slots, with a sheet of its atlas; zeros of one without textures.
    pub fn slots(&self, material: (usize, u32)) -> [u32; TextureSlot::STORED] {
        self.slots.get(&material).copied().unwrap_or_default()
    }
}

/// Lowest bit of the sampler's number in a slot's word; the bits below are the texture's number.
const SAMPLER_SHIFT: u32 = 24;

/// A material's sets, before they exist: one for each sheet of its atlas.
struct PlannedSet<'a> {
    material: usize,
    name: String,
    slots: &'a BTreeMap<TextureSlot, usize>,
    samplers: SetSamplers,
    sheets: u32,
}

impl PlannedSet<'_> {
    /// Samplers of each sheet.
    fn sampler_count(&self) -> u32 {
        if self.samplers == SetSamplers::Each { self.slots.len() as u32 } else { 1 }
    }
}

/// An image with the view that pipelines sample.
pub(super) struct MaterialImage {
    pub view: vk::ImageView,
    /// Present if the image's own is of another type.
    _view: Option<Owned<vk::ImageView>>,
    pub image: Image,
}

impl Materials {
    /// Uploads the plan's textures; `None` if it has none. A taken source loses the texels of each uploaded texture.
    pub(super) fn new(
        device: &Arc<Device>,
        uploader: &mut Uploader,
        source: &mut UploadSource,
        plan: &FramePlan,
    ) -> gpu::Result<Option<Self>> {
        let planned = &plan.textures;
        if planned.images.is_empty() {
            return Ok(None);
        }
        let mut images = Vec::new();
        for (index, texture) in planned.images.iter().enumerate() {
            images.push(upload(device, uploader, source.scene(), (texture, planned.sheet))?);
            // One texture becomes several consecutive images if it is an atlas as well.
            let is_last = planned.images.get(index + 1).is_none_or(|next| next.source != texture.source);
            if let (TextureSource::Scene(own), true) = (texture.source, is_last) {
                source.forget_texels(own);
            }
        }
        let scene = source.scene();
        let mut materials = Self {
            layouts: BTreeMap::new(),
            sets: BTreeMap::new(),
            holes: BTreeMap::new(),
            numbered: None,
            _pool: None,
            _samplers: Vec::new(),
            images,
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

    /// Returns the descriptor set of a material's textures, with a sheet of its atlas.
    pub fn set(&self, material: (usize, u32)) -> Option<vk::DescriptorSet> {
        self.sets.get(&material).copied()
    }

    /// Returns the descriptor set of the texture that cuts holes into a material's shadow.
    pub fn holes(&self, material: (usize, u32)) -> Option<vk::DescriptorSet> {
        self.holes.get(&material).copied()
    }

    /// Makes the sets.
    fn describe(&mut self, device: &Arc<Device>, scene: &Scene, plan: &FramePlan) -> gpu::Result<()> {
        let planned = &plan.textures;
        let mut samplers = Samplers { device, anisotropy: plan.places_of_samplers(), all: BTreeMap::new() };
        // A material without another texture than its base colour casts its shadow with the same set.
        let shares = |material: usize| planned.mask(material) == HOLES.textures;
        let holes: Vec<(usize, BTreeMap<TextureSlot, usize>)> = planned
            .holes
            .iter()
            .filter(|&(&material, _)| !shares(material))
            .map(|(&material, &image)| (material, BTreeMap::from([(TextureSlot::BaseColor, image)])))
            .collect();
        let name = |material: usize| &scene.materials[material].name;
        let sets: Vec<PlannedSet> = planned
            .sets
            .iter()
            .map(|(&material, slots)| {
                let samplers = planned.samplers(material);
                self.planned(material, format!("material {}", name(material)), slots, samplers)
            })
            .collect();
        let holes: Vec<PlannedSet> = holes
            .iter()
            .map(|(material, slots)| {
                let image = slots.values().next().map(|&image| planned.images[image].sampler);
                let sampler = SetSamplers::One(image.unwrap_or_default());
                self.planned(*material, format!("holes of material {}", name(*material)), slots, sampler)
            })
            .collect();
        let sum = |of: &dyn Fn(&PlannedSet) -> u32| sets.iter().chain(&holes).map(|set| set.sheets * of(set)).sum();
        let kinds = [
            (vk::DescriptorType::SAMPLED_IMAGE, sum(&|set| set.slots.len() as u32)),
            (vk::DescriptorType::SAMPLER, sum(&|set| set.sampler_count())),
        ];
        let pool = DescriptorPool::new(device, "material pool", sum(&|_| 1), &kinds)?;
        let readable = plan.layouts.of(vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL);
        for set in &sets {
            for sheet in 0..set.sheets {
                let made = self.set_of(planned, (&pool, readable, &mut samplers), set, sheet)?;
                self.sets.insert((set.material, sheet), made);
                if planned.holes.contains_key(&set.material) && shares(set.material) {
                    self.holes.insert((set.material, sheet), made);
                }
            }
        }
        if plan.triangles.is_some() {
            self.numbered = Some(self.number(planned, &mut samplers, &sets)?);
        }
        for set in &holes {
            for sheet in 0..set.sheets {
                let made = self.set_of(planned, (&pool, readable, &mut samplers), set, sheet)?;
                self.holes.insert((set.material, sheet), made);
            }
        }
        (self._pool, self._samplers) = (Some(pool), samplers.all.into_values().collect());
        Ok(())
    }

    /// All textures by their numbers, where shaders look them up so.
    pub fn numbered(&self) -> Option<&NumberedTextures> {
        self.numbered.as_ref()
    }

    fn number(
        &self,
        planned: &TexturePlan,
        samplers: &mut Samplers,
        sets: &[PlannedSet],
    ) -> gpu::Result<NumberedTextures> {
        let mut firsts = Vec::new();
        let mut views = Vec::new();
        for sheets in &self.images {
            firsts.push(views.len() as u32);
            for sheet in sheets {
                views.push(sheet.image.array_view()?);
            }
        }
        let mut all: Vec<scene::Sampler> = Vec::new();
        let mut number_of = |how: scene::Sampler| match all.iter().position(|own| *own == how) {
            Some(number) => number as u32,
            None => {
                all.push(how);
                all.len() as u32 - 1
            }
        };
        let mut slots = BTreeMap::new();
        for set in sets {
            for sheet in 0..set.sheets {
                let mut words = [0; TextureSlot::STORED];
                // TILED draws no lobes, so that a plan with numbers has no texture of one.
                for (&slot, &image) in set.slots.iter().filter(|(slot, _)| !slot.is_of_lobe()) {
                    let how = match set.samplers {
                        SetSamplers::One(one) => one,
                        SetSamplers::Each => planned.images[image].sampler,
                    };
                    let last = self.images[image].len() as u32 - 1;
                    words[slot as usize] = (firsts[image] + sheet.min(last)) | (number_of(how) << SAMPLER_SHIFT);
                }
                slots.insert((set.material, sheet), words);
            }
        }
        let samplers = all.into_iter().map(|how| samplers.get(how)).collect::<gpu::Result<_>>()?;
        Ok(NumberedTextures { views, samplers, slots })
    }

    fn planned<'a>(
        &self,
        material: usize,
        name: String,
        slots: &'a BTreeMap<TextureSlot, usize>,
        samplers: SetSamplers,
    ) -> PlannedSet<'a> {
        // Neutral textures have one sheet, which serves for all.
        let sheets = slots.values().map(|&image| self.images[image].len() as u32).max().unwrap_or(1);
        PlannedSet { material, name, slots, samplers, sheets }
    }

    /// A set with one of the sheets.
    fn set_of(
        &mut self,
        planned: &TexturePlan,
        (pool, readable, samplers): (&DescriptorPool, vk::ImageLayout, &mut Samplers),
        set: &PlannedSet,
        sheet: u32,
    ) -> gpu::Result<vk::DescriptorSet> {
        let &PlannedSet { slots, samplers: own, .. } = set;
        let form = SetForm { textures: slots.keys().copied().collect(), own_samplers: own == SetSamplers::Each };
        let layout = self.layout_of(samplers.device, form)?;
        let of_sheet = if set.sheets > 1 { format!(", sheet {sheet}") } else { String::new() };
        let made = pool.allocate(&format!("{}{of_sheet}", set.name), layout)?;
        let mut writer = SetWriter::new();
        if let SetSamplers::One(sampler) = own {
            writer = writer.sampler(SAMPLER, samplers.get(sampler)?);
        }
        for (&slot, &image) in slots {
            let sheets = &self.images[image];
            let view = sheets[(sheet as usize).min(sheets.len() - 1)].view;
            writer = writer.sampled_image(slot as u32, view, readable);
            if own == SetSamplers::Each {
                let sampler = samplers.get(planned.images[image].sampler)?;
                writer = writer.sampler(OWN_SAMPLERS + slot as u32, sampler);
            }
        }
        writer.update(samplers.device, made);
        Ok(made)
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
        let sampler = OwnedSampler::new(self.device, &name, &sampler_info(how, self.anisotropy))?;
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
    let anisotropy = if how.softens() { anisotropy } else { 1 };
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

/// The sheets of a texture: arrays of at most `most` cells, or one plain image.
pub(super) fn upload(
    device: &Arc<Device>,
    uploader: &mut Uploader,
    scene: &Scene,
    (planned, most): (&PlannedTexture, u32),
) -> gpu::Result<Vec<MaterialImage>> {
    let name = match planned.source {
        TextureSource::Scene(index) => format!("texture {}", scene.textures[index].name),
        neutral => format!("neutral texture, {neutral:?}"),
    };
    let given = if planned.makes_levels { 1 } else { planned.levels };
    let levels: Vec<_> = (0..given).map(|level| level_of(scene, planned, level as usize)).collect();
    let Some(cells) = planned.cells else {
        let image = image(device, planned, &name, 1)?;
        uploader.texture(&image, &levels)?;
        return Ok(vec![MaterialImage { view: image.view, _view: None, image }]);
    };
    let width = match planned.source {
        TextureSource::Scene(index) => scene.textures[index].size[0],
        TextureSource::White | TextureSource::Flat | TextureSource::Along => 1,
    };
    let sheet = |first: u32| {
        let last = cells.min(first + most);
        let name = if cells > most { format!("{name}, cells {first} to {}", last - 1) } else { name.clone() };
        let image = image(device, planned, &name, last - first)?;
        let rows = (first..last).flat_map(|cell| cell_rows(&levels[0], (planned.size, width), cell));
        let own: Vec<u8> = rows.flatten().copied().collect();
        uploader.texture(&image, &[own])?;
        // An image of one layer has a plain view, but the shader's is an array all the same.
        let array = (last - first == 1).then(|| image.array_view()).transpose()?;
        let view = array.as_ref().map_or(image.view, |view| view.raw);
        Ok(MaterialImage { view, _view: array, image })
    };
    (0..cells).step_by(most as usize).map(sheet).collect()
}

/// The rows of texels of one cell, in a texture that is `width` texels wide.
fn cell_rows(texels: &[u8], (size, width): ([u32; 2], u32), cell: u32) -> impl Iterator<Item = &[u8]> {
    let [wide, high, width] = [size[0], size[1], width].map(|edge| edge as usize);
    let columns = width / wide;
    let (column, row) = (cell as usize % columns, cell as usize / columns);
    let first = row * high * width + column * wide;
    (0..high).map(move |y| &texels[4 * (first + y * width)..][..4 * wide])
}

fn image(device: &Arc<Device>, planned: &PlannedTexture, name: &str, layers: u32) -> gpu::Result<Image> {
    let usage = vk::ImageUsageFlags::SAMPLED | vk::ImageUsageFlags::TRANSFER_DST;
    // The chain is made by blits from level to level.
    let source = if planned.makes_levels { vk::ImageUsageFlags::TRANSFER_SRC } else { vk::ImageUsageFlags::empty() };
    let desc = ImageDesc {
        name,
        format: planned.format(),
        extent: vk::Extent2D { width: planned.size[0], height: planned.size[1] },
        mip_levels: planned.levels,
        layers,
        usage: usage | source,
        location: Location::Device,
        kind: MemoryKind::Texture,
        ..ImageDesc::default()
    };
    Image::new(device, &desc)
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gpu::{DeviceChoice, Instance, InstanceOptions, UploadOrder};
    use crate::gpu_scene::{TEXTURE_READ, VERTEX_READ};
    use crate::plan::samples;
    use crate::scene::Brdf;

    /// Bytes of texels that a scene holds, by texture.
    fn held(scene: &Scene) -> Vec<usize> {
        scene
            .textures
            .iter()
            .map(|own| (0..own.own_levels()).map(|level| own.rgba8(level as usize).len()).sum())
            .collect()
    }

    #[test]
    fn texels_of_a_scene_that_is_given_up_go_when_they_are_uploaded() -> Result<(), Box<dyn std::error::Error>> {
        let instance = Instance::new(&InstanceOptions::default())?;
        let device = Device::new(&instance, &DeviceChoice::Auto)?;
        // Ks and the share of light from everywhere are of no use here.
        let mut scene = samples::scene(vec![samples::textured(Brdf::CookTorrance)], vec![samples::sun()]);
        let plan = samples::plan(&scene, &samples::deferred());
        let uploaded: Vec<TextureSource> = plan.textures.images.iter().map(|image| image.source).collect();
        let is_uploaded = |index: usize| uploaded.contains(&TextureSource::Scene(index));
        assert!((1..scene.textures.len()).contains(&uploaded.len()), "some, and not all: {uploaded:?}");
        let before = held(&scene);
        assert!(before.iter().all(|&bytes| bytes >= 16), "{before:?}");
        let upload = |source: &mut UploadSource| {
            let mut uploader = Uploader::new(&device, 1 << 20, UploadOrder::before(VERTEX_READ, TEXTURE_READ))?;
            let materials = Materials::new(&device, &mut uploader, source, &plan)?;
            uploader.finish()?;
            Ok::<_, gpu::Error>(materials.map_or(0, |own| own.images.len()))
        };
        assert_eq!(upload(&mut UploadSource::Kept(&scene))?, uploaded.len());
        assert_eq!(held(&scene), before, "others need it");
        assert_eq!(upload(&mut UploadSource::Taken(&mut scene))?, uploaded.len());
        let left = before.iter().enumerate().map(|(index, &bytes)| if is_uploaded(index) { 0 } else { bytes });
        assert_eq!(held(&scene), left.collect::<Vec<_>>());
        let mut source = UploadSource::Taken(&mut scene);
        source.forget_all_but_textures();
        source.forget_textures();
        assert!(scene.textures.is_empty() && scene.meshes.is_empty() && scene.sky.is_none());
        Ok(())
    }
}
