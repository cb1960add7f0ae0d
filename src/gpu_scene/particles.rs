//! Textures of particles on the device: each an array of its cells, so that no filter reaches from one into another.

use std::sync::Arc;

use ash::vk;

use super::material::{Sheet, upload};
use crate::gpu::{self, Device, Owned, Sampler, Uploader};
use crate::plan::ParticlePlan;
use crate::scene::Scene;
use crate::scene::emitter::{MOST_FRAMES, MOST_TEXTURES};

/// Those of a plan's emitters, with the sampler that all are sampled by.
pub struct ParticleTextures {
    pub sampler: Sampler,
    sheets: Vec<Sheet>,
    /// Of images that are no arrays by themselves.
    arrays: Vec<Option<Owned<vk::ImageView>>>,
}

impl ParticleTextures {
    /// `None` where all particles are discs.
    pub(super) fn new(
        device: &Arc<Device>,
        uploader: &mut Uploader,
        scene: &Scene,
        plan: &ParticlePlan,
    ) -> gpu::Result<Option<Self>> {
        if plan.textures.is_empty() {
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
            sampler: Sampler::new(device, "sampler of particles", &trilinear)?,
            sheets: Vec::new(),
            arrays: Vec::new(),
        };
        for planned in &plan.textures {
            for sheet in upload(device, uploader, scene, (planned, MOST_FRAMES * MOST_FRAMES))? {
                own.arrays.push(planned.cells.is_none().then(|| sheet.image.array_view()).transpose()?);
                own.sheets.push(sheet);
            }
        }
        Ok(Some(own))
    }

    /// One for each binding of the shader: where there are fewer, the last one again.
    pub fn views(&self) -> [vk::ImageView; MOST_TEXTURES] {
        std::array::from_fn(|index| {
            let index = index.min(self.sheets.len() - 1);
            self.arrays[index].as_ref().map_or(self.sheets[index].view, |view| view.raw)
        })
    }
}
