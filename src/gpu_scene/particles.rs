//! Particles on the device: the buffers that SIMULATE and SORT write, and their textures, each an array of its cells, so that no filter reaches from
//! one into another.

use std::sync::Arc;

use ash::vk;

use super::material::{Sheet, upload};
use crate::gpu::{self, Buffer, Device, Location, MemoryKind, Owned, Sampler, Uploader};
use crate::plan::{FramePlan, ParticlePlan};
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

/// SIMULATE's output: one of each for all frames in flight.
pub struct ParticleBuffers {
    pub states: Buffer,
    /// The keys, if particles are sorted.
    pub keys: Option<Buffer>,
}

impl ParticleBuffers {
    /// For all frames in flight.
    ///
    /// # Errors
    /// When the device lacks the memory.
    pub fn new(device: &Arc<Device>, plan: &FramePlan, planned: &ParticlePlan) -> gpu::Result<Self> {
        let buffer = |name: &str, size: u64| {
            let usage = vk::BufferUsageFlags::STORAGE_BUFFER;
            Buffer::new(device, name, size, usage, Location::Device, MemoryKind::Geometry)
        };
        let bytes = crate::shaders::particles::structs::particle::SIZE as u64;
        Ok(Self {
            states: buffer("particles", bytes * u64::from(planned.capacity))?,
            keys: match plan.sorts_particles() {
                true => Some(buffer("order of particles", 8 * u64::from(planned.places()))?),
                false => None,
            },
        })
    }
}
