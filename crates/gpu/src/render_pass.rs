//! Render passes and framebuffers: `sType`s and counts are filled in, everything else stands at the call.

use std::sync::Arc;

use ash::vk;

use super::device::Device;
use super::error::{Doing, Error, Result};
use super::image::is_depth;
use super::instance::fixed_text;
use super::owned::Owned;
use super::sync::{SyncVersion, Use};

/// A render pass.
pub type RenderPass = Owned<vk::RenderPass>;

/// The views that a render pass renders into.
pub type Framebuffer = Owned<vk::Framebuffer>;

/// The attachments of one subpass. A reference to `vk::ATTACHMENT_UNUSED` leaves a gap.
#[derive(Clone, Copy, Debug, Default)]
pub struct SubpassDesc<'a> {
    /// Read by `InputAttachmentIndex`.
    pub input: &'a [vk::AttachmentReference],
    /// Written by location.
    pub color: &'a [vk::AttachmentReference],
    /// The resolve targets of `color` after the subpass; empty, or as many.
    pub resolve: &'a [vk::AttachmentReference],
    /// Tested, and written if its layout allows that.
    pub depth: Option<vk::AttachmentReference>,
    /// Kept through a subpass that does not use them.
    pub preserve: &'a [u32],
}

/// A dependency between two subpasses, or between a subpass and the work before or after the render pass (`vk::SUBPASS_EXTERNAL`).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct SubpassOrder {
    /// The two subpasses.
    pub between: [u32; 2],
    /// The uses that must be over.
    pub before: Use,
    /// The uses that wait.
    pub after: Use,
    /// Each pixel waits for itself alone.
    pub by_region: bool,
}

impl SubpassOrder {
    fn flags(&self) -> vk::DependencyFlags {
        if self.by_region { vk::DependencyFlags::BY_REGION } else { vk::DependencyFlags::empty() }
    }
}

/// The parts of a render pass, whose subpasses are all graphics.
#[derive(Clone, Copy, Debug)]
pub struct RenderPassParts<'a> {
    /// The API by which the render pass is made.
    pub sync: SyncVersion,
    /// The attachments that subpasses refer to by their index.
    pub attachments: &'a [vk::AttachmentDescription],
    /// The subpasses in their order.
    pub subpasses: &'a [SubpassDesc<'a>],
    /// The dependencies between subpasses, and with the work before and after the render pass.
    pub dependencies: &'a [SubpassOrder],
}

/// The driver's answer on which subpasses of a render pass it merges (VK_EXT_subpass_merge_feedback).
#[derive(Clone, Debug)]
pub struct MergeFeedback {
    /// The number of subpasses after merging.
    pub merged_count: u32,
    /// Each subpass as it was described.
    pub subpasses: Vec<SubpassFeedback>,
}

/// The driver's answer on one subpass.
#[derive(Clone, Debug)]
pub struct SubpassFeedback {
    /// Whether the subpass is merged with the one before it, and why not.
    pub status: vk::SubpassMergeStatusEXT,
    /// The driver's own words; may be empty.
    pub description: String,
    /// The index after merging.
    pub index: u32,
}

/// The places into which a driver writes its answer.
struct FeedbackPlaces {
    pass: vk::RenderPassCreationFeedbackInfoEXT,
    subpasses: Vec<vk::RenderPassSubpassFeedbackInfoEXT>,
}

impl RenderPass {
    /// A render pass of these parts.
    ///
    /// # Errors
    /// [`Error::TooLarge`] for more colour attachments in a subpass, or more input attachments, than the device has;
    /// [`Error::Unsupported`] for an API that it lacks; running out of memory.
    pub fn new(device: &Arc<Device>, name: &str, parts: RenderPassParts<'_>) -> Result<RenderPass> {
        parts.check(device, name)?;
        device.check_sync(parts.sync)?;
        let (command, raw) = match parts.sync {
            SyncVersion::One => ("vkCreateRenderPass", create(device, parts)),
            SyncVersion::Two => ("vkCreateRenderPass2", create2(device, parts, SyncVersion::Two, None)),
        };
        let raw = raw.doing(command, || format!("creating the render pass '{name}'"))?;
        // Render passes that differ only in layouts, loads and stores are compatible; distinguishing them here costs little. Layer 1.3.239 takes two
        // render passes for incompatible if they were made by the two APIs: it does not see the masks of the second API.
        let RenderPassParts { sync, attachments, subpasses, dependencies } = parts;
        device.reuse.note(raw, (sync, attachments, subpasses, dependencies));
        Ok(Owned::new_from(device, name, raw))
    }

    /// Makes a render pass only to ask which of its subpasses the driver merges. Returns nothing if the driver cannot answer.
    ///
    /// # Errors
    /// As [`RenderPass::new`].
    pub fn merge_feedback(
        device: &Arc<Device>,
        name: &str,
        parts: RenderPassParts<'_>,
    ) -> Result<Option<MergeFeedback>> {
        if !device.features.merge_feedback {
            return Ok(None);
        }
        parts.check(device, name)?;
        // A driver may leave a place as it is. The default, 0, would then mean MERGED.
        let unanswered = vk::RenderPassSubpassFeedbackInfoEXT::default()
            .subpass_merge_status(vk::SubpassMergeStatusEXT::NOT_MERGED_UNSPECIFIED);
        let mut places = FeedbackPlaces {
            pass: vk::RenderPassCreationFeedbackInfoEXT::default(),
            subpasses: vec![unanswered; parts.subpasses.len()],
        };
        // Masks of synchronization2 are the same dependencies, said more finely.
        let masks = if device.features.synchronization2 { SyncVersion::Two } else { SyncVersion::One };
        let raw = create2(device, parts, masks, Some(&mut places)).doing("vkCreateRenderPass2", || {
            format!("asking which subpasses of the render pass '{name}' are merged")
        })?;
        drop(Owned::new_from(device, &format!("{name}, asked for its merging"), raw));
        let answer = |own: &vk::RenderPassSubpassFeedbackInfoEXT| SubpassFeedback {
            status: own.subpass_merge_status,
            description: fixed_text(&own.description),
            index: own.post_merge_index,
        };
        Ok(Some(MergeFeedback {
            merged_count: places.pass.post_merge_subpass_count,
            subpasses: places.subpasses.iter().map(answer).collect(),
        }))
    }
}

impl RenderPassParts<'_> {
    fn check(&self, device: &Device, name: &str) -> Result<()> {
        let limits = &device.physical.limits;
        for (index, subpass) in self.subpasses.iter().enumerate() {
            let of = format!("attachments of subpass {index} of '{name}'");
            check(format!("the number of color {of}"), subpass.color.len(), limits.max_color_attachments)?;
            let most = limits.max_per_stage_descriptor_input_attachments;
            check(format!("the number of input {of}"), subpass.input.len(), most)?;
        }
        Ok(())
    }
}

/// By Vulkan 1.0.
fn create(device: &Device, parts: RenderPassParts<'_>) -> ash::prelude::VkResult<vk::RenderPass> {
    let RenderPassParts { attachments, subpasses, dependencies, .. } = parts;
    let descriptions: Vec<vk::SubpassDescription<'_>> = subpasses
        .iter()
        .map(|subpass| {
            let description = vk::SubpassDescription::default()
                .pipeline_bind_point(vk::PipelineBindPoint::GRAPHICS)
                .input_attachments(subpass.input)
                .color_attachments(subpass.color)
                .preserve_attachments(subpass.preserve);
            let description = match subpass.resolve.is_empty() {
                true => description,
                false => description.resolve_attachments(subpass.resolve),
            };
            match &subpass.depth {
                Some(depth) => description.depth_stencil_attachment(depth),
                None => description,
            }
        })
        .collect();
    let dependency = |own: &SubpassOrder| {
        let ((from, available), (to, visible)) = (own.before.masks(), own.after.masks());
        vk::SubpassDependency {
            src_subpass: own.between[0],
            dst_subpass: own.between[1],
            src_stage_mask: from,
            dst_stage_mask: to,
            src_access_mask: available,
            dst_access_mask: visible,
            dependency_flags: own.flags(),
        }
    };
    let dependencies: Vec<_> = dependencies.iter().map(dependency).collect();
    let info = vk::RenderPassCreateInfo::default()
        .attachments(attachments)
        .subpasses(&descriptions)
        .dependencies(&dependencies);
    // SAFETY: the device is alive, and all that the structures point to lives until the call returns.
    unsafe { device.raw.create_render_pass(&info, None) }
}

/// By VK_KHR_create_renderpass2, whose dependencies take the masks of either API, and whose subpasses may ask for feedback.
fn create2(
    device: &Device,
    parts: RenderPassParts<'_>,
    masks: SyncVersion,
    feedback: Option<&mut FeedbackPlaces>,
) -> ash::prelude::VkResult<vk::RenderPass> {
    let RenderPassParts { attachments, subpasses, dependencies, .. } = parts;
    let attachment = |own: &vk::AttachmentDescription| {
        vk::AttachmentDescription2::default()
            .format(own.format)
            .samples(own.samples)
            .load_op(own.load_op)
            .store_op(own.store_op)
            .stencil_load_op(own.stencil_load_op)
            .stencil_store_op(own.stencil_store_op)
            .initial_layout(own.initial_layout)
            .final_layout(own.final_layout)
    };
    let attachments: Vec<_> = attachments.iter().map(attachment).collect();
    // A reference names the aspect of its input attachment here: depth for a depth format.
    let aspect = |index: u32| match attachments.get(index as usize) {
        Some(own) if is_depth(own.format) => vk::ImageAspectFlags::DEPTH,
        _ => vk::ImageAspectFlags::COLOR,
    };
    let reference = |own: &vk::AttachmentReference| {
        vk::AttachmentReference2::default()
            .attachment(own.attachment)
            .layout(own.layout)
            .aspect_mask(aspect(own.attachment))
    };
    let all = |own: &[vk::AttachmentReference]| own.iter().map(reference).collect::<Vec<_>>();
    let references: Vec<_> = subpasses
        .iter()
        .map(|own| (all(own.input), all(own.color), all(own.resolve), own.depth.as_ref().map(reference)))
        .collect();
    let description = |(own, (input, color, resolve, depth)): (
        &SubpassDesc<'_>,
        &(Vec<_>, Vec<_>, Vec<_>, Option<vk::AttachmentReference2<'static>>),
    )| {
        let mut description = vk::SubpassDescription2::default().pipeline_bind_point(vk::PipelineBindPoint::GRAPHICS);
        (description.input_attachment_count, description.p_input_attachments) = (input.len() as u32, input.as_ptr());
        (description.color_attachment_count, description.p_color_attachments) = (color.len() as u32, color.as_ptr());
        if !resolve.is_empty() {
            description.p_resolve_attachments = resolve.as_ptr();
        }
        if let Some(depth) = depth {
            description.p_depth_stencil_attachment = depth;
        }
        (description.preserve_attachment_count, description.p_preserve_attachments) =
            (own.preserve.len() as u32, own.preserve.as_ptr());
        description
    };
    let mut descriptions: Vec<_> = subpasses.iter().zip(&references).map(description).collect();
    let mut fine: Vec<_> = dependencies
        .iter()
        .map(|own| {
            vk::MemoryBarrier2::default()
                .src_stage_mask(own.before.stage)
                .src_access_mask(own.before.access)
                .dst_stage_mask(own.after.stage)
                .dst_access_mask(own.after.access)
        })
        .collect();
    let dependency = |(own, fine)| {
        let own: &SubpassOrder = own;
        let dependency = vk::SubpassDependency2::default()
            .src_subpass(own.between[0])
            .dst_subpass(own.between[1])
            .dependency_flags(own.flags());
        match masks {
            SyncVersion::One => {
                let ((from, available), (to, visible)) = (own.before.masks(), own.after.masks());
                let dependency = dependency.src_stage_mask(from).src_access_mask(available);
                dependency.dst_stage_mask(to).dst_access_mask(visible)
            }
            SyncVersion::Two => dependency.push_next(fine),
        }
    };
    let dependencies: Vec<_> = dependencies.iter().zip(&mut fine).map(dependency).collect();
    let (mut of_pass, mut of_subpasses) = (vk::RenderPassCreationFeedbackCreateInfoEXT::default(), Vec::new());
    let asks = feedback.is_some();
    if let Some(FeedbackPlaces { pass, subpasses }) = feedback {
        of_pass = of_pass.render_pass_feedback(pass);
        let place = |own| vk::RenderPassSubpassFeedbackCreateInfoEXT::default().subpass_feedback(own);
        of_subpasses = subpasses.iter_mut().map(place).collect();
    }
    for (description, place) in descriptions.iter_mut().zip(&mut of_subpasses) {
        *description = description.push_next(place);
    }
    let mut info = vk::RenderPassCreateInfo2::default()
        .attachments(&attachments)
        .subpasses(&descriptions)
        .dependencies(&dependencies);
    if asks {
        info = info.push_next(&mut of_pass);
    }
    // SAFETY: the device is alive, and all that the structures point to lives until the call returns.
    unsafe { device.raw.create_render_pass2(&info) }
}

/// A render pass that is being recorded, by the API of the command buffer's recording.
pub struct RecordedPass<'a> {
    device: &'a Device,
    cmd: vk::CommandBuffer,
    version: SyncVersion,
}

impl<'a> RecordedPass<'a> {
    /// Begins the render pass. The command buffer is recording outside of render passes, and pass and framebuffer belong together.
    pub fn begin(device: &'a Device, cmd: vk::CommandBuffer, begin: &vk::RenderPassBeginInfo<'_>) -> Self {
        let version = device.sync_of(cmd);
        let raw = &device.raw;
        // SAFETY: as promised.
        unsafe {
            match version {
                SyncVersion::One => raw.cmd_begin_render_pass(cmd, begin, vk::SubpassContents::INLINE),
                SyncVersion::Two => raw.cmd_begin_render_pass2(cmd, begin, &inline()),
            }
        }
        Self { device, cmd, version }
    }

    /// Goes on with the next subpass, which there is.
    pub fn next_subpass(&self) {
        let raw = &self.device.raw;
        // SAFETY: the render pass was begun, and has this subpass next.
        unsafe {
            match self.version {
                SyncVersion::One => raw.cmd_next_subpass(self.cmd, vk::SubpassContents::INLINE),
                SyncVersion::Two => raw.cmd_next_subpass2(self.cmd, &inline(), &vk::SubpassEndInfo::default()),
            }
        }
    }

    /// Ends the render pass after its last subpass.
    pub fn end(self) {
        let raw = &self.device.raw;
        // SAFETY: the render pass was begun, and every subpass is recorded.
        unsafe {
            match self.version {
                SyncVersion::One => raw.cmd_end_render_pass(self.cmd),
                SyncVersion::Two => raw.cmd_end_render_pass2(self.cmd, &vk::SubpassEndInfo::default()),
            }
        }
    }
}

fn inline() -> vk::SubpassBeginInfo<'static> {
    vk::SubpassBeginInfo::default().contents(vk::SubpassContents::INLINE)
}

fn check(what: String, asked: usize, limit: u32) -> Result<()> {
    if asked <= limit as usize {
        return Ok(());
    }
    Err(Error::TooLarge { what, asked: asked as u64, limit: limit.into() })
}

/// A framebuffer of one layer, with a view for each attachment of `pass`.
///
/// # Errors
/// [`Error::TooLarge`] beyond the device's limits; running out of memory.
pub fn framebuffer(
    device: &Arc<Device>,
    name: &str,
    pass: vk::RenderPass,
    views: &[vk::ImageView],
    extent: vk::Extent2D,
) -> Result<Framebuffer> {
    let limits = &device.physical.limits;
    check(format!("the width of the framebuffer '{name}'"), extent.width as usize, limits.max_framebuffer_width)?;
    check(format!("the height of the framebuffer '{name}'"), extent.height as usize, limits.max_framebuffer_height)?;
    let info = vk::FramebufferCreateInfo::default()
        .render_pass(pass)
        .attachments(views)
        .width(extent.width)
        .height(extent.height)
        .layers(1);
    // SAFETY: the pass and the views are alive (the module's contract).
    let raw = unsafe { device.raw.create_framebuffer(&info, None) }
        .doing("vkCreateFramebuffer", || format!("creating the framebuffer '{name}'"))?;
    Ok(Owned::new_from(device, name, raw))
}
