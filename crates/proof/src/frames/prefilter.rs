//! PREFILTER, once when a sky is uploaded.

use ash::vk::ImageLayout as L;

use super::{FrameModelBuilder, TEXTURE};
use crate::program::Memory;
use afterlight::frame::rows::{Endpoint, RowName};
use afterlight::passes::{Resource, prefilter};

impl FrameModelBuilder<'_> {
    /// Adds it, with the barriers around it.
    pub(super) fn prefilter(&mut self) {
        if !self.plan.is_lit_by_sky() {
            return;
        }
        self.image_barrier(RowName::SKY_LIGHT_TO_PREFILTER, Memory::of(Resource::SkyLight));
        let sky = (TEXTURE, self.plan.layouts.of(L::SHADER_READ_ONLY_OPTIMAL), prefilter::SKY_READ);
        self.program
            .command(Endpoint::PREFILTER, &[sky, (Memory::of(Resource::SkyLight), L::GENERAL, prefilter::LIGHT_WRITE)]);
        self.image_barrier(RowName::PREFILTER_TO_LIGHTING, Memory::of(Resource::SkyLight));
    }
}
