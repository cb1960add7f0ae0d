//! The attachments of the main render pass: formats, bytes, lifetimes.

use std::sync::Arc;

use ash::vk;

use crate::gpu::{self, Device, Framebuffer, Image, ImageDesc, Location, MemoryKind, framebuffer};
use crate::plan::{COUNT, Canvas, DEPTH, FramePlan, Shading, TRIANGLE};

/// What an attachment holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Target {
    Depth,
    Albedo,
    Normal,
    Material,
    Specular,
    Position,
    /// Fragments for each pixel.
    Count,
    /// The number of the object that is seen, from 1, and of the triangle in its mesh, from 0.
    Triangle,
    /// Transparent surfaces, weighted and summed up; alpha is the share of the picture that they leave.
    Accumulation,
    /// The sum of their weights.
    Weights,
    Hdr,
    /// The output's light before it is resolved, several samples a pixel.
    Samples,
    Output,
}

/// How a subpass touches a target. Passes declare theirs beside their code; the references of subpasses follow.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Touch {
    /// Reads its own pixel, by the next `InputAttachmentIndex`.
    Input(Target),
    /// Writes it or blends over it, at a location of the shader's outputs.
    Color(u32, Target),
    /// Tests against depth and writes it.
    DepthWrite,
    /// Only tests against depth.
    DepthTest,
    /// Samples it, its pixel's neighbours too: no subpass of the render pass that draws it can.
    Sampled(Target),
}

impl Touch {
    pub fn target(self) -> Target {
        match self {
            Self::Input(target) | Self::Color(_, target) | Self::Sampled(target) => target,
            Self::DepthWrite | Self::DepthTest => Target::Depth,
        }
    }

    /// The layout that it needs.
    pub fn layout(self) -> vk::ImageLayout {
        match self {
            Self::Color(..) => vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL,
            Self::DepthWrite => vk::ImageLayout::DEPTH_STENCIL_ATTACHMENT_OPTIMAL,
            // LIGHTING tests against depth and reads it as an input at once.
            Self::DepthTest | Self::Input(Target::Depth) => vk::ImageLayout::DEPTH_STENCIL_READ_ONLY_OPTIMAL,
            Self::Input(_) | Self::Sampled(_) => vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL,
        }
    }

    pub fn writes(self) -> bool {
        matches!(self, Self::Color(..) | Self::DepthWrite)
    }
}

/// One attachment, as the render pass sees it.
#[derive(Debug, Clone, Copy)]
pub struct Attachment {
    pub target: Target,
    pub format: vk::Format,
    pub load: vk::AttachmentLoadOp,
    pub store: vk::AttachmentStoreOp,
    pub final_layout: vk::ImageLayout,
    pub usage: vk::ImageUsageFlags,
}

/// The attachments of a plan, in framebuffer order.
pub fn attachments(plan: &FramePlan) -> Vec<Attachment> {
    let mut list = Vec::new();
    if plan.has_geometry() {
        // 32 bits: cleared to infinity (reversed Z), never stored.
        let mut depth = transient(Target::Depth, DEPTH, vk::AttachmentLoadOp::CLEAR);
        if plan.is_forward() && plan.transparency.is_none() {
            // FORWARD alone uses it.
            depth.final_layout = vk::ImageLayout::DEPTH_STENCIL_ATTACHMENT_OPTIMAL;
        }
        list.push(depth);
    }
    if let Some(gbuffer) = &plan.gbuffer {
        // Not cleared: LIGHTING leaves out every pixel that GEOMETRY did not write.
        let mut color = |target, format| list.push(transient(target, format, vk::AttachmentLoadOp::DONT_CARE));
        color(Target::Albedo, gbuffer.albedo);
        color(Target::Normal, gbuffer.normal);
        for (target, format) in [
            (Target::Material, gbuffer.material),
            (Target::Specular, gbuffer.specular),
            (Target::Position, gbuffer.position),
        ] {
            if let Some(format) = format {
                color(target, format);
            }
        }
    }
    if plan.shading == Shading::ShowOverdraw {
        list.push(transient(Target::Count, COUNT, vk::AttachmentLoadOp::CLEAR));
    }
    if plan.shading == Shading::ShowTriangle {
        // Not cleared: VIEW leaves out every pixel that GEOMETRY did not write.
        list.push(transient(Target::Triangle, TRIANGLE, vk::AttachmentLoadOp::DONT_CARE));
    }
    if let Some(sums) = plan.sums {
        list.push(transient(Target::Accumulation, sums.accumulation, vk::AttachmentLoadOp::CLEAR));
        list.push(transient(Target::Weights, sums.weights, vk::AttachmentLoadOp::CLEAR));
    }
    if let Some(format) = plan.hdr {
        list.push(transient(Target::Hdr, format, vk::AttachmentLoadOp::CLEAR));
    }
    if plan.is_tiled() {
        // Compute reads what GEOMETRY wrote, and writes the output, which is no attachment.
        return list.into_iter().map(stored).collect();
    }
    if plan.resolves_output() {
        list.push(Attachment {
            usage: vk::ImageUsageFlags::COLOR_ATTACHMENT | vk::ImageUsageFlags::TRANSIENT_ATTACHMENT,
            // The last to touch it is its resolve.
            final_layout: vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL,
            ..transient(Target::Samples, plan.output, vk::AttachmentLoadOp::CLEAR)
        });
    }
    // What reads the output after the pass.
    let (final_layout, usage) = match plan.fxaa {
        true => (vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL, vk::ImageUsageFlags::SAMPLED),
        false => (picture_layout(plan), picture_usage(plan)),
    };
    list.push(Attachment {
        target: Target::Output,
        format: plan.output,
        // TONEMAP and a resolve write every pixel; LIGHTING and VIEW leave the background as it was cleared.
        load: match plan.has_tonemap_subpass() || plan.resolves_output() {
            true => vk::AttachmentLoadOp::DONT_CARE,
            false => vk::AttachmentLoadOp::CLEAR,
        },
        store: vk::AttachmentStoreOp::STORE,
        final_layout,
        usage: vk::ImageUsageFlags::COLOR_ATTACHMENT | usage,
    });
    list
}

/// How the last render pass leaves the picture: to be copied, or to be shown.
pub fn picture_layout(plan: &FramePlan) -> vk::ImageLayout {
    match plan.draws_into_swapchain() {
        true => vk::ImageLayout::PRESENT_SRC_KHR,
        false => vk::ImageLayout::TRANSFER_SRC_OPTIMAL,
    }
}

/// How a picture of the frame's own is used after the last pass.
pub fn picture_usage(plan: &FramePlan) -> vk::ImageUsageFlags {
    let copied = vk::ImageUsageFlags::TRANSFER_SRC;
    match plan.presented {
        // SPLIT and OVERLAY draw over it, and ENCODE reads it.
        Some(Canvas::Encode(_)) => {
            let over = vk::ImageUsageFlags::TRANSFER_DST | vk::ImageUsageFlags::COLOR_ATTACHMENT;
            copied | over | vk::ImageUsageFlags::SAMPLED
        }
        _ => copied,
    }
}

/// Whether the main pass draws the picture into the swapchain's images, and no pass after it.
fn presents_output(plan: &FramePlan) -> bool {
    plan.draws_into_swapchain() && !plan.fxaa
}

/// An attachment that nothing reads after the pass: it need never leave the tile.
fn transient(target: Target, format: vk::Format, load: vk::AttachmentLoadOp) -> Attachment {
    let (own, last) = match target {
        Target::Depth => {
            (vk::ImageUsageFlags::DEPTH_STENCIL_ATTACHMENT, vk::ImageLayout::DEPTH_STENCIL_READ_ONLY_OPTIMAL)
        }
        _ => (vk::ImageUsageFlags::COLOR_ATTACHMENT, vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL),
    };
    Attachment {
        target,
        format,
        load,
        store: vk::AttachmentStoreOp::DONT_CARE,
        // As its last subpass leaves it, so that no transition follows.
        final_layout: last,
        usage: own | vk::ImageUsageFlags::INPUT_ATTACHMENT | vk::ImageUsageFlags::TRANSIENT_ATTACHMENT,
    }
}

/// The same attachment, kept for a compute pass to read.
fn stored(attachment: Attachment) -> Attachment {
    let passing = vk::ImageUsageFlags::INPUT_ATTACHMENT | vk::ImageUsageFlags::TRANSIENT_ATTACHMENT;
    Attachment {
        store: vk::AttachmentStoreOp::STORE,
        usage: (attachment.usage & !passing) | vk::ImageUsageFlags::SAMPLED,
        ..attachment
    }
}

/// The output where a compute pass writes it, so that it is no attachment.
pub fn storage_output(plan: &FramePlan) -> Option<Attachment> {
    plan.is_tiled().then_some(Attachment {
        target: Target::Output,
        format: plan.output,
        load: vk::AttachmentLoadOp::DONT_CARE,
        store: vk::AttachmentStoreOp::STORE,
        final_layout: vk::ImageLayout::TRANSFER_SRC_OPTIMAL,
        usage: vk::ImageUsageFlags::STORAGE | picture_usage(plan),
    })
}

/// What a compute pass reads, by binding of `shaders/shared/gbuffer.wgsl`: as [`gbuffer_inputs`], and depth in any case.
pub fn stored_inputs(plan: &FramePlan) -> Vec<(u32, Target)> {
    let depth = Some((0, Target::Depth));
    depth.into_iter().chain(gbuffer_inputs(plan).into_iter().filter(|&(_, target)| target != Target::Depth)).collect()
}

/// The target that LIGHTING or FORWARD writes and, where the plan has emissive light, GEOMETRY before it.
pub fn light_target(plan: &FramePlan) -> Target {
    match plan.hdr {
        Some(_) => Target::Hdr,
        None if plan.resolves_output() => Target::Samples,
        None => Target::Output,
    }
}

/// The samples a pixel of a target.
pub fn samples_of(plan: &FramePlan, target: Target) -> vk::SampleCountFlags {
    if target == Target::Output { vk::SampleCountFlags::TYPE_1 } else { plan.sample_count() }
}

/// What the subpass after GEOMETRY reads, in the order of `shaders/shared/gbuffer.wgsl`'s bindings; that of depth is the first.
pub fn gbuffer_inputs(plan: &FramePlan) -> Vec<(u32, Target)> {
    if plan.shading == Shading::ShowOverdraw {
        return vec![(0, Target::Count)];
    }
    if plan.shading == Shading::ShowTriangle {
        return vec![(0, Target::Triangle)];
    }
    let Some(gbuffer) = &plan.gbuffer else { return Vec::new() };
    [
        (0, Target::Depth, gbuffer.position.is_none() || plan.msaa > 1),
        (1, Target::Albedo, true),
        (2, Target::Normal, true),
        (3, Target::Material, gbuffer.material.is_some()),
        (4, Target::Specular, gbuffer.specular.is_some()),
        (5, Target::Position, gbuffer.position.is_some()),
    ]
    .into_iter()
    .filter(|&(_, _, present)| present)
    .map(|(binding, target, _)| (binding, target))
    .collect()
}

/// What COMPOSITE reads, in the order of `shaders/composite.wgsl`'s bindings.
pub const COMPOSITE_INPUTS: [(u32, Target); 2] = [(0, Target::Accumulation), (1, Target::Weights)];

/// What a render pass draws into: one framebuffer, or one for each image of a swapchain.
pub struct Framebuffers(pub Vec<Framebuffer>);

impl Framebuffers {
    /// The one for this image of the swapchain.
    pub fn of(&self, image: usize) -> vk::Framebuffer {
        self.0[image.min(self.0.len() - 1)].raw
    }
}

/// The images of a plan's attachments, but for those of a swapchain.
pub struct Targets {
    images: Vec<(Target, Image)>,
}

impl Targets {
    /// # Errors
    /// When there is no memory for them.
    pub fn new(device: &Arc<Device>, plan: &FramePlan) -> gpu::Result<Self> {
        let images = attachments(plan)
            .into_iter()
            .chain(storage_output(plan))
            .filter(|attachment| attachment.target != Target::Output || !presents_output(plan))
            .map(|attachment| {
                let passing = attachment.usage.contains(vk::ImageUsageFlags::TRANSIENT_ATTACHMENT);
                let image = Image::new(
                    device,
                    &ImageDesc {
                        name: &format!("target {:?}", attachment.target),
                        format: attachment.format,
                        extent: vk::Extent2D { width: plan.size[0], height: plan.size[1] },
                        samples: samples_of(plan, attachment.target),
                        usage: attachment.usage,
                        location: if passing && plan.lazily_allocated { Location::Lazy } else { Location::Device },
                        kind: MemoryKind::Attachment,
                        ..ImageDesc::default()
                    },
                )?;
                Ok((attachment.target, image))
            })
            .collect::<gpu::Result<_>>()?;
        Ok(Self { images })
    }

    /// The image of a target that the plan has.
    ///
    /// # Panics
    /// When the plan has no such target: a mistake in the frame, not in its input.
    pub fn image(&self, target: Target) -> &Image {
        self.find(target).unwrap_or_else(|| panic!("the plan has no target {target:?}"))
    }

    /// The image of the output, unless it is one of the swapchain's.
    pub fn output(&self) -> Option<&Image> {
        self.find(Target::Output)
    }

    fn find(&self, target: Target) -> Option<&Image> {
        self.images.iter().find(|(own, _)| *own == target).map(|(_, image)| image)
    }

    /// The framebuffer of the main pass, or one for each view of the swapchain's images that the pass draws into.
    ///
    /// # Errors
    /// As [`framebuffer`].
    pub fn framebuffers(
        &self,
        device: &Arc<Device>,
        plan: &FramePlan,
        pass: vk::RenderPass,
        swapchain: &[vk::ImageView],
    ) -> gpu::Result<Framebuffers> {
        let extent = vk::Extent2D { width: plan.size[0], height: plan.size[1] };
        let own: Vec<_> = self.images.iter().take(attachments(plan).len()).map(|(_, image)| image.view).collect();
        if !presents_output(plan) {
            return Ok(Framebuffers(vec![framebuffer(device, "main framebuffer", pass, &own, extent)?]));
        }
        // The output is the last attachment.
        let with = |view: &vk::ImageView| [&own[..], &[*view]].concat();
        let one = |view| framebuffer(device, "main framebuffer", pass, &with(view), extent);
        Ok(Framebuffers(swapchain.iter().map(one).collect::<gpu::Result<_>>()?))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::{format_bytes, samples};

    #[test]
    fn a_plan_tells_the_bytes_of_all_its_attachments() {
        let plans = [samples::plans(), samples::forward_plans(), samples::tiled_plans()].concat();
        for (name, plan) in plans {
            let bytes = |format, samples: vk::SampleCountFlags| u64::from(format_bytes(format) * samples.as_raw());
            let all = attachments(&plan).into_iter().chain(storage_output(&plan));
            let attached: u64 = all.map(|own| bytes(own.format, samples_of(&plan, own.target))).sum();
            assert_eq!(plan.target_bytes_per_pixel(), attached, "{name}");
        }
    }
}
