//! ENCODE: writes a window's picture into images without hardware sRGB encoding: images of more than 8 bits, images that take more than white, and
//! plain ones that cannot be viewed as sRGB. It exists only for such images: otherwise the last pass draws straight into the swapchain's image.

use std::sync::Arc;

use ash::vk;

use super::screen::{Screen, ScreenDesc, WindowPass, replace};
use super::{
    COLOR_WRITE, ContentsIfFirst, Endpoint, NO_WINDOW, Pass, Presence, Resource, ResourceUse, SAMPLED, Slot, UseKind,
    needed, shown,
};
use crate::gpu::{
    self, DescriptorPool, Device, SetLayout, SetWriter, binding,
    sync::{Layouts, SyncVersion, Use},
};
use crate::plan::{PresentTarget, Transfer};
use crate::shaders::encode::{self as shader, Flags, constants, host};

/// Reads each pixel of the picture.
pub const READ: Use = SAMPLED;
/// Writes every pixel of the swapchain's image; its undefined load is a write too.
pub const WRITE: Use = COLOR_WRITE;

pub const PASS: Pass = Pass {
    name: Endpoint::pass("ENCODE"),
    time: "encode",
    what: "brings the picture into an image of the swapchain that no hardware encodes",
    presence: |plan| {
        let is_in = matches!(plan.presented, Some(PresentTarget::Encode(_) | PresentTarget::EncodeKept(_)));
        let why_not = match plan.presented {
            None => NO_WINDOW,
            Some(_) if plan.is_tiled() => "TILED encodes the picture, and PRESENT copies it",
            Some(_) => "the hardware encodes the window's images",
        };
        Presence::when(is_in, "no hardware encodes the window's images", why_not)
    },
    touches: |plan| {
        let drawn = UseKind::Color { location: 0, first: ContentsIfFirst::Undefined };
        vec![
            ResourceUse::new(shown(plan), UseKind::Sampled { binding: 0 }, READ),
            ResourceUse::new(Resource::SwapchainImage, drawn, WRITE),
        ]
    },
    leave_out: None,
    make: None,
};

/// Brightness of white in nits on displays that are told absolute brightness: the reference white (ITU-R BT.2408, "Guidance for operational
/// practices in HDR television production").
pub const WHITE_NITS: f32 = 203.0;

const KIND: vk::DescriptorType = vk::DescriptorType::SAMPLED_IMAGE;

/// The pass, with its input and its render pass.
pub struct Encode {
    pass: WindowPass,
    transfer: Transfer,
    screen: Screen,
    set_layout: SetLayout,
    /// Absent until there is a picture.
    picture: Option<(DescriptorPool, vk::DescriptorSet)>,
}

impl Encode {
    /// Makes the pass for images of `format`.
    pub fn new(
        device: &Arc<Device>,
        format: vk::Format,
        transfer: Transfer,
        form: (Layouts, SyncVersion),
    ) -> gpu::Result<Self> {
        let pass = WindowPass::new(device, "encode", format, vk::AttachmentLoadOp::DONT_CARE, form)?;
        let set_layout =
            SetLayout::new(device, "encode set layout", &[binding(0, KIND, vk::ShaderStageFlags::FRAGMENT)])?;
        let shader = needed("encode", shader::variant, Flags::NONE)?;
        let screen = Screen::new(
            device,
            &ScreenDesc {
                name: "encode",
                slot: &Slot::Subpass(pass.render_pass.raw, 0),
                shader,
                constants: &[(constants::TRANSFER, constant(transfer)), (constants::WHITE, WHITE_NITS.to_bits())],
                set_layouts: &[set_layout.raw],
                skip_sky: false,
                blend: replace(),
            },
        )?;
        Ok(Self { pass, transfer, screen, set_layout, picture: None })
    }

    /// Returns true if it was made for such images.
    pub fn is_for(&self, format: vk::Format, transfer: Transfer, form: (Layouts, SyncVersion)) -> bool {
        (self.pass.format, self.transfer, self.pass.layouts, self.pass.sync) == (format, transfer, form.0, form.1)
    }

    /// Reads this picture and draws into these images from now on, all of one size.
    pub fn resize(
        &mut self,
        picture: vk::ImageView,
        images: &[vk::ImageView],
        extent: vk::Extent2D,
    ) -> gpu::Result<()> {
        let device = &self.pass.device;
        let pool = DescriptorPool::new(device, "encode pool", 1, &[(KIND, 1)])?;
        let set = pool.allocate("encode set", self.set_layout.raw)?;
        let readable = self.pass.layouts.of(vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL);
        SetWriter::new().sampled_image(0, picture, readable).update(device, set);
        self.pass.resize(images, extent)?;
        self.picture = Some((pool, set));
        Ok(())
    }

    /// Begins the render pass over an image of the swapchain, draws the picture, and ends it.
    pub fn record(&self, cmd: vk::CommandBuffer, image: usize) {
        let Some((_, set)) = &self.picture else { return };
        self.pass.record(cmd, image, |area| self.screen.record_over(&self.pass.device, cmd, area, *set));
    }
}

fn constant(transfer: Transfer) -> u32 {
    match transfer {
        Transfer::Srgb => host::SRGB,
        Transfer::Pq => host::PQ,
        Transfer::Linear => host::LINEAR,
    }
}
