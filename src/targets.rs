//! The images of a plan's targets, and framebuffers of them.

use std::sync::Arc;

use ash::vk;

use crate::gpu::{self, Device, Framebuffer, Image, ImageDesc, Location, MemoryKind, RenderPass, framebuffer};
use crate::plan::{FramePlan, Target};

/// The framebuffers of a render pass: one framebuffer, or one for each image of a swapchain.
pub struct Framebuffers(pub Vec<Framebuffer>);

impl Framebuffers {
    /// The one for this image of the swapchain.
    pub fn of(&self, image: usize) -> vk::Framebuffer {
        self.0[image.min(self.0.len() - 1)].raw
    }
}

/// The images of a plan's targets, but for the picture where the swapchain has it.
pub struct Targets {
    images: Vec<(Target, Image)>,
}

/// Shaders cannot store to formats that encode sRGB: they store codes. Undefined where the target's own format does.
fn stored_as(plan: &FramePlan, target: Target, usage: vk::ImageUsageFlags) -> vk::Format {
    match plan.format_of(target) {
        Some(vk::Format::R8G8B8A8_SRGB) if usage.contains(vk::ImageUsageFlags::STORAGE) => vk::Format::R8G8B8A8_UNORM,
        _ => vk::Format::UNDEFINED,
    }
}

impl Targets {
    /// `usage` says how the frame's passes use a target.
    pub fn new(
        device: &Arc<Device>,
        plan: &FramePlan,
        usage: impl Fn(Target) -> vk::ImageUsageFlags,
    ) -> gpu::Result<Self> {
        let own = |&target: &Target| !(plan.draws_into_swapchain() && target == plan.picture());
        let image = |target| {
            let usage = usage(target);
            let [width, height] = plan.extent_of(target);
            // Transient attachments need never leave the tile.
            let stays = usage.contains(vk::ImageUsageFlags::TRANSIENT_ATTACHMENT);
            let desc = ImageDesc {
                name: &format!("target {target}"),
                format: plan.format_of(target).unwrap_or_default(),
                extent: vk::Extent2D { width, height },
                samples: vk::SampleCountFlags::from_raw(plan.samples_of(target)),
                usage,
                stored_as: stored_as(plan, target, usage),
                location: if stays && plan.lazily_allocated { Location::Lazy } else { Location::Device },
                kind: MemoryKind::Attachment,
                ..ImageDesc::default()
            };
            Ok((target, Image::new(device, &desc)?))
        };
        Ok(Self { images: plan.targets().filter(own).map(image).collect::<gpu::Result<_>>()? })
    }

    /// The image of a target that the plan has.
    ///
    /// # Panics
    /// When the plan has no such target: a mistake in the frame, not in its input.
    pub fn image(&self, target: Target) -> &Image {
        self.find(target).unwrap_or_else(|| panic!("the plan has no target {target}"))
    }

    /// The image of a target; `None` if the plan lacks it or draws it straight into the swapchain's images.
    pub fn find(&self, target: Target) -> Option<&Image> {
        self.images.iter().find(|(own, _)| *own == target).map(|(_, image)| image)
    }

    /// The framebuffer of a render pass with these attachments, or one for each view of the swapchain's images if it draws into them.
    ///
    /// # Errors
    /// As [`framebuffer`].
    pub fn framebuffers(
        &self,
        plan: &FramePlan,
        (device, pass): (&Arc<Device>, &RenderPass),
        attachments: &[Target],
        swapchain: &[vk::ImageView],
    ) -> gpu::Result<Framebuffers> {
        let extent = vk::Extent2D { width: plan.size[0], height: plan.size[1] };
        let one = |shown: vk::ImageView| {
            let views: Vec<_> =
                attachments.iter().map(|&target| self.find(target).map_or(shown, |own| own.view)).collect();
            framebuffer(device, &format!("framebuffer of the {}", pass.name()), pass.raw, &views, extent)
        };
        let all = match attachments.iter().all(|&target| self.find(target).is_some()) {
            true => vec![one(vk::ImageView::null())?],
            false => swapchain.iter().map(|&view| one(view)).collect::<gpu::Result<_>>()?,
        };
        Ok(Framebuffers(all))
    }
}
