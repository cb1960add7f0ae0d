//! The sky on the device: its cube, and the light that surfaces collect of it.

use std::sync::Arc;

use ash::vk;
use bytemuck::{Pod, Zeroable};
use glam::Vec3;
use half::f16;
use rayon::prelude::*;

use crate::gpu::{
    self, Buffer, Device, Image, ImageDesc, Location, MemoryKind, Owned, OwnedSampler, SetLayoutBinding, SetWriter,
    Uploader, binding, sync::Use,
};
use crate::plan::{FramePlan, SkyPlan, effects};
use crate::scene::{FACES, Sky, SkyCube, SkyDirection};
use crate::shaders::shared::sky::{ROUGHEST_LEVEL, SKY_DIRECTIONS};

/// Half floats blend, filter and can be stored to everywhere.
const FORMAT: vk::Format = vk::Format::R16G16B16A16_SFLOAT;
/// Edge of the mirrored sky's finest level; each further level has half the edge, and a fifth more roughness.
pub const LOBE_EDGE: u32 = 256;
/// Number of levels of the mirrored sky.
pub const LOBE_LEVELS: u32 = ROUGHEST_LEVEL as u32 + 1;
/// Edge of the light that lambert surfaces collect, which is smooth: a cosine over 5.6 degrees bends by 0.1%.
pub const BASE_EDGE: u32 = 16;
/// Edge of the table of shares.
pub const TABLE_EDGE: u32 = 64;

/// Samples PREFILTER's output.
pub const SKY_READ: Use = Use::new(vk::PipelineStageFlags2::FRAGMENT_SHADER, vk::AccessFlags2::SHADER_READ);

/// Bindings in set 0, as `shaders/sky.wgsl` and `shaders/shared/sky.wgsl` declare them.
const CUBE: u32 = 6;
const LOBE: u32 = 7;
const BASE: u32 = 8;
const TABLE: u32 = 9;
const SAMPLER: u32 = 10;
const DIRECTIONS: u32 = 12;

/// A sky's images.
pub struct SkyMaps {
    /// Radiance, in units of the frame's `sky_scale`; readable.
    pub cube: Image,
    pub cube_view: Owned<vk::ImageView>,
    pub light: Option<SkyLight>,
    pub sampler: OwnedSampler,
}

/// PREFILTER's output, written once.
pub struct SkyLight {
    pub lobe: Image,
    pub base: Image,
    pub table: Image,
    lobe_view: Owned<vk::ImageView>,
    base_view: Owned<vk::ImageView>,
}

impl SkyMaps {
    /// Uploads the cube. The images of the light that surfaces collect of it exist then, and are not filled yet.
    ///
    /// # Errors
    /// When there is no memory for it, or the device is lost.
    pub fn new(device: &Arc<Device>, uploader: &mut Uploader, sky: &Sky, plan: &SkyPlan) -> gpu::Result<Self> {
        let faces = SkyCube::of(&sky.image);
        let image = |name: &str, edge: u32, mip_levels: u32, usage: vk::ImageUsageFlags| {
            let desc = ImageDesc {
                name,
                format: FORMAT,
                extent: vk::Extent2D { width: edge, height: edge },
                mip_levels,
                layers: FACES,
                cube: true,
                usage: usage | vk::ImageUsageFlags::SAMPLED,
                location: Location::Device,
                kind: MemoryKind::Texture,
                ..ImageDesc::default()
            };
            Image::new(device, &desc)
        };
        let cube = image("sky", plan.edge, faces.levels.len() as u32, vk::ImageUsageFlags::TRANSFER_DST)?;
        let scale = sky.image.half_scale();
        let half = |texel: &Vec3| (*texel * scale).extend(1.0).to_array().map(|value| f16::from_f32(value).to_bits());
        let levels: Vec<Vec<u8>> = faces
            .levels
            .par_iter()
            .map(|level| bytemuck::cast_slice(&level.texels.iter().map(half).collect::<Vec<_>>()).to_vec())
            .collect();
        uploader.texture(&cube, &levels)?;
        let light = match plan.lights {
            true => {
                let lobe = image("mirrored sky", LOBE_EDGE, LOBE_LEVELS, vk::ImageUsageFlags::STORAGE)?;
                let base = image("collected sky", BASE_EDGE, 1, vk::ImageUsageFlags::STORAGE)?;
                let desc = ImageDesc {
                    name: "shares of even light",
                    format: FORMAT,
                    extent: vk::Extent2D { width: TABLE_EDGE, height: TABLE_EDGE },
                    usage: vk::ImageUsageFlags::STORAGE | vk::ImageUsageFlags::SAMPLED,
                    kind: MemoryKind::Texture,
                    ..ImageDesc::default()
                };
                let (lobe_view, base_view) = (cube_view(&lobe)?, cube_view(&base)?);
                Some(SkyLight { lobe, base, table: Image::new(device, &desc)?, lobe_view, base_view })
            }
            false => None,
        };
        let edge = vk::SamplerAddressMode::CLAMP_TO_EDGE;
        let trilinear = vk::SamplerCreateInfo::default()
            .mag_filter(vk::Filter::LINEAR)
            .min_filter(vk::Filter::LINEAR)
            .mipmap_mode(vk::SamplerMipmapMode::LINEAR)
            .address_mode_u(edge)
            .address_mode_v(edge)
            .address_mode_w(edge)
            .max_lod(vk::LOD_CLAMP_NONE);
        let sampler = OwnedSampler::new(device, "sky sampler", &trilinear)?;
        Ok(Self { cube_view: cube_view(&cube)?, cube, light, sampler })
    }

    /// Writes the sky's part of set 0.
    pub(super) fn write(&self, plan: &SkyPlan, readable: vk::ImageLayout, writer: SetWriter) -> SetWriter {
        let mut writer = writer.sampler(SAMPLER, self.sampler.raw);
        if plan.shown {
            writer = writer.sampled_image(CUBE, self.cube_view.raw, readable);
        }
        if let Some(light) = &self.light {
            writer = writer
                .sampled_image(LOBE, light.lobe_view.raw, readable)
                .sampled_image(BASE, light.base_view.raw, readable)
                .sampled_image(TABLE, light.table.view, readable);
        }
        writer
    }
}

fn cube_view(image: &Image) -> gpu::Result<Owned<vk::ImageView>> {
    let range = vk::ImageSubresourceRange {
        aspect_mask: vk::ImageAspectFlags::COLOR,
        level_count: image.mip_levels,
        layer_count: FACES,
        ..Default::default()
    };
    image.view_of(&format!("{}, as a cube", image.name), vk::ImageViewType::CUBE, range)
}

/// The sky's bindings of set 0.
pub(super) fn bindings(plan: &FramePlan) -> Vec<SetLayoutBinding> {
    let Some(sky) = &plan.effects.sky else { return Vec::new() };
    let images = [(CUBE, sky.shown), (LOBE, sky.lights), (BASE, sky.lights), (TABLE, sky.lights)];
    let mut stages = vk::ShaderStageFlags::FRAGMENT;
    if effects::compute_with_sky(plan) {
        stages |= vk::ShaderStageFlags::COMPUTE;
    }
    let images = images.into_iter().filter(|(_, is_in)| *is_in);
    images
        .map(|(index, _)| binding(index, vk::DescriptorType::SAMPLED_IMAGE, stages))
        .chain([binding(SAMPLER, vk::DescriptorType::SAMPLER, stages)])
        .chain(
            has_directions(plan)
                .then(|| binding(DIRECTIONS, vk::DescriptorType::UNIFORM_BUFFER, vk::ShaderStageFlags::FRAGMENT)),
        )
        .collect()
}

/// `SkyDirection` of `shaders/shared/sky.wgsl`.
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct DirectionRecord {
    to_light: Vec3,
    _padding: f32,
    lux: Vec3,
    _end: f32,
}

const _: () = {
    use crate::shaders::ambient::structs::sky_direction as wgsl;
    use std::mem::offset_of;
    assert!(size_of::<DirectionRecord>() == wgsl::SIZE);
    assert!(offset_of!(DirectionRecord, to_light) == wgsl::TO_LIGHT);
    assert!(offset_of!(DirectionRecord, lux) == wgsl::LUX);
};

/// Returns true if shaders that look up the sky's light name its directions, be there none: surfaces that are lit as they are drawn share their code with frames
/// that have some.
fn has_directions(plan: &FramePlan) -> bool {
    plan.is_lit_by_sky() && plan.shadow.is_some()
}

/// A frame's directions of the sky.
pub(super) struct DirectionBuffer(Buffer);

impl DirectionBuffer {
    /// Makes the buffer; none if no shader reads it.
    pub fn new(device: &Arc<Device>, frame: usize, plan: &FramePlan) -> gpu::Result<Option<Self>> {
        let size = (SKY_DIRECTIONS as usize * size_of::<DirectionRecord>()) as u64;
        let name = format!("sky directions of frame {frame}");
        let buffer = || {
            let usage = vk::BufferUsageFlags::UNIFORM_BUFFER;
            Buffer::new(device, &name, size, usage, Location::Upload, MemoryKind::Uniform).map(Self)
        };
        has_directions(plan).then(buffer).transpose()
    }

    /// Writes its part of set 0.
    pub fn bind(&self, writer: SetWriter) -> SetWriter {
        writer.uniform_buffer(DIRECTIONS, &self.0, self.0.size)
    }

    /// Writes the directions that light the next frame.
    pub fn write(&self, directions: &[SkyDirection]) -> gpu::Result<()> {
        let record = |own: &SkyDirection| DirectionRecord {
            to_light: own.to_light.as_vec3(),
            lux: own.lux,
            ..DirectionRecord::zeroed()
        };
        let records: Vec<_> = directions.iter().map(record).collect();
        if records.is_empty() { Ok(()) } else { self.0.write(0, &records) }
    }
}
