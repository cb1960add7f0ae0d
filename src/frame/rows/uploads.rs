//! Rows of uploads: from the copies out of staging buffers to the first readers of the scene.

use ash::vk;

use super::{Endpoint, Row, RowName, Rows, SyncKind, barrier, row};
use crate::gpu::UploadOrder;
use crate::gpu::sync::Use;
use crate::gpu::upload::{BLIT_READ, COPY_WRITE, LEVEL_WRITE};
use crate::gpu_scene::{INDEX_READ, LOOK_UP, TEXTURE_READ, VERTEX_READ};
use crate::passes::{prefilter, skin};
use crate::plan::FramePlan;
use crate::scene::Passes;

#[allow(missing_docs, reason = "a name says which row, and the row itself says why it is there")]
impl RowName {
    pub const UPLOAD_TO_VERTICES: Self = Self::Own("upload-to-vertices");
    pub const TEXTURE_TO_COPY: Self = Self::Own("texture-to-copy");
    pub const LEVEL_TO_BLIT: Self = Self::Own("level-to-blit");
    pub const BLIT_TO_TEXTURES: Self = Self::Own("blit-to-textures");
    pub const UPLOAD_TO_TEXTURES: Self = Self::Own("upload-to-textures");
}

const WRITTEN: vk::ImageLayout = vk::ImageLayout::TRANSFER_DST_OPTIMAL;
const BLITTED: vk::ImageLayout = vk::ImageLayout::TRANSFER_SRC_OPTIMAL;
const READABLE: vk::ImageLayout = vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL;

/// Rows for the kinds of data that the plan uploads.
pub(super) fn rows(plan: &FramePlan) -> Vec<Row> {
    let mut rows = Vec::new();
    let uploads = plan.uploads;
    let is_rendered = plan.passes == Passes::LocalRead;
    let looked_up = |drawn| if plan.triangles.is_some() { LOOK_UP } else { drawn };
    if uploads.vertices || uploads.volumes {
        let indices = if uploads.vertices { INDEX_READ } else { VERTEX_READ };
        let rest = if plan.deforms() { skin::SOURCE_READ } else { VERTEX_READ };
        rows.push(
            row(RowName::UPLOAD_TO_VERTICES, SyncKind::MemoryBarrier)
                .from(Endpoint::UPLOAD, &[COPY_WRITE])
                .to(Endpoint::DRAWS, &[VERTEX_READ, indices, rest, looked_up(VERTEX_READ)])
                .because("draws fetch vertices and indices that were copied; the same barrier serves all buffers"),
        );
    }
    let written = if uploads.mip_levels { LEVEL_WRITE } else { COPY_WRITE };
    // The transfer queue makes no blits.
    let first = if plan.queues.transfer { COPY_WRITE } else { written };
    if uploads.textures {
        rows.push(
            barrier(RowName::TEXTURE_TO_COPY, vk::ImageLayout::UNDEFINED, WRITTEN)
                .from(Endpoint::OUTSIDE, &[Use::START])
                .to(Endpoint::UPLOAD, &[first])
                .because("the image is new: there is nothing to wait for, but its layout changes before the write"),
        );
    }
    if uploads.mip_levels {
        rows.push(
            barrier(RowName::LEVEL_TO_BLIT, WRITTEN, BLITTED)
                .from(Endpoint::UPLOAD, &[LEVEL_WRITE])
                .to(Endpoint::UPLOAD, &[BLIT_READ])
                .because("each level of a texture is made from the one above it, which a copy or the last blit wrote"),
        );
        rows.push(
            barrier(RowName::BLIT_TO_TEXTURES, BLITTED, READABLE)
                .from(Endpoint::UPLOAD, &[BLIT_READ])
                // TILED needs no use here: `geometry-to-tiled` orders it after GEOMETRY. That row covers attachments only after dynamic rendering.
                .to(Endpoint::DRAWS, &[if is_rendered { looked_up(TEXTURE_READ) } else { TEXTURE_READ }, TEXTURE_READ])
                .because("shaders sample a level when the blit that reads it is over; its layout changes in between"),
        );
    }
    if uploads.textures {
        let sky = if plan.is_lit_by_sky() { prefilter::SKY_READ } else { TEXTURE_READ };
        rows.push(
            barrier(RowName::UPLOAD_TO_TEXTURES, WRITTEN, READABLE)
                .from(Endpoint::UPLOAD, &[written])
                .to(Endpoint::DRAWS, &[TEXTURE_READ, sky, looked_up(TEXTURE_READ)])
                .because("shaders sample the levels that a copy wrote, and the last one that a blit wrote"),
        );
    }
    rows
}

impl Rows {
    /// The rows that an uploader carries out; none for kinds of data that the plan does not upload.
    pub(in crate::frame) fn upload_order(&self) -> UploadOrder {
        let order = |name| self.find(name).map(Row::order);
        UploadOrder {
            buffers: order(RowName::UPLOAD_TO_VERTICES),
            first: order(RowName::TEXTURE_TO_COPY),
            blit: order(RowName::LEVEL_TO_BLIT),
            blitted: order(RowName::BLIT_TO_TEXTURES),
            written: order(RowName::UPLOAD_TO_TEXTURES),
            layouts: self.layouts,
            sync: self.sync,
            handover: self.upload_handover(),
        }
    }
}
