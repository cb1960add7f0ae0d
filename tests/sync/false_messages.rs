//! The smallest frame for a false message of layers, so that their developers can try it, and so that a layer that no longer says it is noticed. The specification decides that
//! it is false. No frame of the program has it, since all that waits for a subpass waits by one dependency.

use std::error::Error as StdError;
use std::sync::Arc;

use afterlight::gpu::sync::{Dependency, SyncVersion, Use};
use afterlight::gpu::upload::COPY_WRITE;
use afterlight::gpu::{
    Buffer, CommandBuffer, Device, DeviceChoice, Image, ImageDesc, Instance, InstanceOptions, Location, MemoryKind,
    RenderPass, RenderPassParts, SubpassDesc, SubpassOrder, Validation, barrier, framebuffer, vk,
};

use super::gpu::HOST_READ;

const EXTENT: vk::Extent2D = vk::Extent2D { width: 4, height: 4 };
const DEPTH_READABLE: vk::ImageLayout = vk::ImageLayout::DEPTH_STENCIL_READ_ONLY_OPTIMAL;

/// The first layer that applies one dependency alone to the layout changes at the end of a render pass: its SDK's source does, 1.4.321's does not.
const ONE_DEPENDENCY_FROM: u32 = vk::make_api_version(0, 1, 4, 322);

/// An attachment that is cleared, stored, and left in another layout than the one it is drawn in.
fn attachment(format: vk::Format, end: vk::ImageLayout) -> vk::AttachmentDescription {
    vk::AttachmentDescription::default()
        .format(format)
        .samples(vk::SampleCountFlags::TYPE_1)
        .load_op(vk::AttachmentLoadOp::CLEAR)
        .store_op(vk::AttachmentStoreOp::STORE)
        .stencil_load_op(vk::AttachmentLoadOp::DONT_CARE)
        .stencil_store_op(vk::AttachmentStoreOp::DONT_CARE)
        .initial_layout(vk::ImageLayout::UNDEFINED)
        .final_layout(end)
}

/// A dependency of the subpass to the commands after the render pass.
fn leaving(before: Use, after: Use) -> SubpassOrder {
    SubpassOrder { between: [0, vk::SUBPASS_EXTERNAL], before, after, by_region: false }
}

/// Clears colour and depth in a render pass with two dependencies to EXTERNAL, one for each attachment. Then copies the colour, which the second
/// dependency makes visible to the copy (the first one, unless `depth_first`).
fn draw_and_copy(device: &Arc<Device>, depth_first: bool) -> Result<(), Box<dyn StdError>> {
    let image = |name, format, usage| {
        let desc =
            ImageDesc { name, format, extent: EXTENT, usage, kind: MemoryKind::Attachment, ..ImageDesc::default() };
        Image::new(device, &desc)
    };
    let colored = vk::ImageUsageFlags::COLOR_ATTACHMENT | vk::ImageUsageFlags::TRANSFER_SRC;
    let color = image("colour", vk::Format::R8G8B8A8_UNORM, colored)?;
    let depth = image("depth", vk::Format::D32_SFLOAT, vk::ImageUsageFlags::DEPTH_STENCIL_ATTACHMENT)?;

    let copied = vk::ImageLayout::TRANSFER_SRC_OPTIMAL;
    let attachments = [attachment(color.format, copied), attachment(depth.format, DEPTH_READABLE)];
    let reference = |attachment, layout| vk::AttachmentReference { attachment, layout };
    let subpass = SubpassDesc {
        color: &[reference(0, vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL)],
        depth: Some(reference(1, vk::ImageLayout::DEPTH_STENCIL_ATTACHMENT_OPTIMAL)),
        ..SubpassDesc::default()
    };
    use vk::{AccessFlags2 as A, PipelineStageFlags2 as S};
    let tests = Use::new(S::EARLY_FRAGMENT_TESTS | S::LATE_FRAGMENT_TESTS, A::DEPTH_STENCIL_ATTACHMENT_READ);
    let depth_to_tests = leaving(Use::new(S::LATE_FRAGMENT_TESTS, A::DEPTH_STENCIL_ATTACHMENT_WRITE), tests);
    let copy_read = Use::new(S::TRANSFER, A::TRANSFER_READ);
    let color_to_copy = leaving(Use::new(S::COLOR_ATTACHMENT_OUTPUT, A::COLOR_ATTACHMENT_WRITE), copy_read);
    let dependencies = if depth_first { [depth_to_tests, color_to_copy] } else { [color_to_copy, depth_to_tests] };
    let parts = RenderPassParts {
        sync: SyncVersion::One,
        attachments: &attachments,
        subpasses: &[subpass],
        dependencies: &dependencies,
    };
    let pass = RenderPass::new(device, "two ways out", parts)?;
    let target = framebuffer(device, "two ways out", pass.raw, &[color.view, depth.view], EXTENT)?;

    let bytes = 4 * u64::from(EXTENT.width * EXTENT.height);
    let usage = vk::BufferUsageFlags::TRANSFER_DST;
    let back = Buffer::new(device, "read-back", bytes, usage, Location::ReadBack, MemoryKind::ReadBack)?;
    let mut cmd = CommandBuffer::new(device, "two ways out")?;
    cmd.begin()?;
    let clears = [
        vk::ClearValue { color: vk::ClearColorValue { float32: [0.0, 1.0, 0.0, 1.0] } },
        vk::ClearValue { depth_stencil: vk::ClearDepthStencilValue { depth: 0.5, stencil: 0 } },
    ];
    let begin = vk::RenderPassBeginInfo::default()
        .render_pass(pass.raw)
        .framebuffer(target.raw)
        .render_area(vk::Rect2D { offset: vk::Offset2D::default(), extent: EXTENT })
        .clear_values(&clears);
    // SAFETY: recording; pass, framebuffer and images outlive the wait below.
    unsafe {
        device.raw.cmd_begin_render_pass(cmd.raw, &begin, vk::SubpassContents::INLINE);
        device.raw.cmd_end_render_pass(cmd.raw);
    }
    let layers = vk::ImageSubresourceLayers {
        aspect_mask: vk::ImageAspectFlags::COLOR,
        mip_level: 0,
        base_array_layer: 0,
        layer_count: 1,
    };
    let extent = vk::Extent3D { width: EXTENT.width, height: EXTENT.height, depth: 1 };
    let region = vk::BufferImageCopy::default().image_subresource(layers).image_extent(extent);
    // SAFETY: recording; image and buffer outlive the wait below, and the region fits both.
    unsafe { device.raw.cmd_copy_image_to_buffer(cmd.raw, color.raw, copied, back.raw, &[region]) };
    barrier::memory_barrier(device, cmd.raw, Dependency::between(COPY_WRITE, HOST_READ));
    cmd.end()?;
    device.wait(device.submit(&cmd)?)?;
    assert!(back.read(0, bytes)?.chunks(4).all(|texel| texel == [0, 255, 0, 255]), "the colour that was cleared to");
    Ok(())
}

/// "Automatic layout transitions into finalLayout happen-before the visibility operations for all dependencies with a dstSubpass equal to
/// VK_SUBPASS_EXTERNAL, where srcSubpass uses the attachment that will be transitioned" (specification, `VkSubpassDependency`): so the copy waits for the
/// change of the colour's layout, whichever of the two dependencies is named first.
#[test]
fn of_two_dependencies_out_of_a_subpass_newer_layers_see_the_first_alone() -> Result<(), Box<dyn StdError>> {
    let options = InstanceOptions { validation: Validation::Synchronization, ..InstanceOptions::default() };
    let instance = Instance::new(&options)?;
    let layer = instance.validation_layer().ok_or("an instance with validation has the layer")?;
    let log = instance.message_log();
    let device = Device::new(&instance, &DeviceChoice::Auto)?;
    let heard = |depth_first| -> Result<Vec<String>, Box<dyn StdError>> {
        draw_and_copy(&device, depth_first)?;
        Ok(log
            .take()
            .into_iter()
            .map(|message| message.to_string())
            .filter(|text| text.contains("SYNC-HAZARD"))
            .collect())
    };
    assert_eq!(heard(false)?, Vec::<String>::new(), "the colour's dependency comes first");
    let false_messages = heard(true)?;
    let is_expected = layer >= ONE_DEPENDENCY_FROM;
    assert_eq!(
        !false_messages.is_empty(),
        is_expected,
        "docs/LAYERS.md says which layers have it: {false_messages:#?}"
    );
    assert!(false_messages.iter().all(|text| text.contains("vkCmdEndRenderPass")), "{false_messages:#?}");
    Ok(())
}
