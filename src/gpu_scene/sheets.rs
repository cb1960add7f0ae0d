//! Textures that no material has, each an array of the cells of its image, so that no filter reaches from one into another.

use std::sync::Arc;

use ash::vk;

use super::material::{MaterialImage, upload};
use crate::gpu::{self, Device, Owned, OwnedSampler, Uploader};
use crate::plan::PlannedTexture;
use crate::scene::Scene;
use crate::scene::emitter::MOST_FRAMES;

/// The textures of an effect, with the sampler that all are sampled by.
pub struct Sheets {
    pub sampler: OwnedSampler,
    sheets: Vec<MaterialImage>,
    /// Array views of images that are no arrays by themselves.
    arrays: Vec<Option<Owned<vk::ImageView>>>,
}

impl Sheets {
    /// Uploads the textures; `None` if `textures` is empty.
    pub(super) fn new(
        device: &Arc<Device>,
        uploader: &mut Uploader,
        scene: &Scene,
        textures: &[PlannedTexture],
    ) -> gpu::Result<Option<Self>> {
        if textures.is_empty() {
            return Ok(None);
        }
        let edge = vk::SamplerAddressMode::CLAMP_TO_EDGE;
        let trilinear = vk::SamplerCreateInfo::default()
            .mag_filter(vk::Filter::LINEAR)
            .min_filter(vk::Filter::LINEAR)
            .mipmap_mode(vk::SamplerMipmapMode::LINEAR)
            .address_mode_u(edge)
            .address_mode_v(edge)
            .address_mode_w(edge)
            .max_lod(vk::LOD_CLAMP_NONE);
        let mut own = Self {
            sampler: OwnedSampler::new(device, "sampler of sheets", &trilinear)?,
            sheets: Vec::new(),
            arrays: Vec::new(),
        };
        for planned in textures {
            for sheet in upload(device, uploader, scene, (planned, MOST_FRAMES * MOST_FRAMES))? {
                own.arrays.push(planned.cells.is_none().then(|| sheet.image.array_view()).transpose()?);
                own.sheets.push(sheet);
            }
        }
        Ok(Some(own))
    }

    /// The views, in the textures' order.
    pub fn views(&self) -> impl Iterator<Item = vk::ImageView> {
        let own = self.sheets.iter().zip(&self.arrays);
        own.map(|(sheet, array)| array.as_ref().map_or(sheet.view, |view| view.raw))
    }
}
