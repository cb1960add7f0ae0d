//! Pipelines of shaders that are written by hand, drawn and read back.

use super::gpu::{HOST_READ, TestResult, read_level, texture_desc, with_device};
use afterlight::gpu::sync::{Dependency, SyncVersion, Use};
use afterlight::gpu::{
    self, Buffer, CommandBuffer, DescriptorPool, Device, Framebuffer, GraphicsPipeline, GraphicsPipelineDesc, Image,
    ImageDesc, Location, MemoryKind, PipelinePlace, RenderPass, RenderPassParts, SetLayout, SetWriter, ShaderStage,
    SubpassDesc, barrier, vk,
};
use std::sync::Arc;

/// SPIR-V by hand, as these tests need no shader compiler: instructions of (opcode, operands).
fn spirv(bound: u32, instructions: &[(u32, &[u32])]) -> Vec<u32> {
    let mut words = vec![0x0723_0203, 0x0001_0000, 0, bound, 0];
    for (opcode, operands) in instructions {
        words.push((operands.len() as u32 + 1) << 16 | opcode);
        words.extend_from_slice(operands);
    }
    words
}

const MAIN: u32 = u32::from_le_bytes(*b"main");

/// `override value = 7u; @group(0) @binding(0) var<storage> out: u32; out = value;`
fn store_constant_shader() -> Vec<u32> {
    spirv(
        13,
        &[
            (17, &[1]),              // OpCapability Shader
            (14, &[0, 1]),           // OpMemoryModel Logical GLSL450
            (15, &[5, 1, MAIN, 0]),  // OpEntryPoint GLCompute %1 "main"
            (16, &[1, 17, 1, 1, 1]), // OpExecutionMode %1 LocalSize 1 1 1
            (71, &[5, 1, 3]),        // OpDecorate %5 SpecId 3
            (71, &[6, 3]),           // OpDecorate %6 BufferBlock
            (72, &[6, 0, 35, 0]),    // OpMemberDecorate %6 0 Offset 0
            (71, &[8, 34, 0]),       // OpDecorate %8 DescriptorSet 0
            (71, &[8, 33, 0]),       // OpDecorate %8 Binding 0
            (19, &[2]),              // %2 = OpTypeVoid
            (33, &[3, 2]),           // %3 = OpTypeFunction %2
            (21, &[4, 32, 0]),       // %4 = OpTypeInt 32 0
            (50, &[4, 5, 7]),        // %5 = OpSpecConstant %4 7
            (30, &[6, 4]),           // %6 = OpTypeStruct %4
            (32, &[7, 2, 6]),        // %7 = OpTypePointer Uniform %6
            (59, &[7, 8, 2]),        // %8 = OpVariable %7 Uniform
            (32, &[9, 2, 4]),        // %9 = OpTypePointer Uniform %4
            (43, &[4, 10, 0]),       // %10 = OpConstant %4 0
            (54, &[2, 1, 0, 3]),     // %1 = OpFunction %2 None %3
            (248, &[11]),            // %11 = OpLabel
            (65, &[9, 12, 8, 10]),   // %12 = OpAccessChain %9 %8 %10
            (62, &[12, 5]),          // OpStore %12 %5
            (253, &[]),              // OpReturn
            (56, &[]),               // OpFunctionEnd
        ],
    )
}

#[test]
fn a_compute_pipeline_sees_its_buffer_and_its_specialization_constants() -> TestResult {
    with_device(|device| {
        let binding = vk::DescriptorSetLayoutBinding::default()
            .binding(0)
            .descriptor_type(vk::DescriptorType::STORAGE_BUFFER)
            .descriptor_count(1)
            .stage_flags(vk::ShaderStageFlags::COMPUTE);
        let set_layout = SetLayout::new(device, "set layout", &[binding])?;
        let layout = gpu::pipeline_layout(device, "layout", &[set_layout.raw], &[])?;
        let shader = store_constant_shader();
        let stage = ShaderStage {
            spirv: &shader,
            entry: c"main",
            stage: vk::ShaderStageFlags::COMPUTE,
            constants: &[(3, 0xabcd_ef01)],
        };
        let pipeline = gpu::compute_pipeline(device, "store", &stage, layout.raw)?;
        let usage = vk::BufferUsageFlags::STORAGE_BUFFER;
        let buffer = Buffer::new(device, "out", 4, usage, Location::ReadBack, MemoryKind::ReadBack)?;
        let pool = DescriptorPool::new(
            device,
            "pool",
            1,
            &[(vk::DescriptorType::STORAGE_BUFFER, 1), (vk::DescriptorType::SAMPLER, 0)],
        )?;
        let set = pool.allocate("set", set_layout.raw)?;
        SetWriter::new().storage_buffer(0, &buffer, ..).update(device, set);
        let mut cmd = CommandBuffer::new(device, "dispatch")?;
        cmd.begin()?;
        // SAFETY: recording; all of these outlive the wait below.
        unsafe {
            device.raw.cmd_bind_pipeline(cmd.raw, vk::PipelineBindPoint::COMPUTE, pipeline.raw);
            device.raw.cmd_bind_descriptor_sets(cmd.raw, vk::PipelineBindPoint::COMPUTE, layout.raw, 0, &[set], &[]);
            device.raw.cmd_dispatch(cmd.raw, 1, 1, 1);
        }
        let before = Use::new(vk::PipelineStageFlags2::COMPUTE_SHADER, vk::AccessFlags2::SHADER_WRITE);
        barrier::buffer_barrier(device, cmd.raw, &buffer, Dependency::between(before, HOST_READ));
        cmd.end()?;
        device.wait(device.submit(&cmd)?)?;
        assert_eq!(buffer.read(0, 4)?, 0xabcd_ef01_u32.to_ne_bytes());
        let no_shader = ShaderStage { spirv: &[1, 2, 3], ..stage };
        assert!(gpu::compute_pipeline(device, "none", &no_shader, layout.raw).is_err());
        Ok(())
    })
}

#[test]
fn a_pipeline_given_up_is_owned_again_by_whoever_asks_for_the_like() -> TestResult {
    with_device(|device| {
        let shader = store_constant_shader();
        let binding = vk::DescriptorSetLayoutBinding::default()
            .binding(0)
            .descriptor_type(vk::DescriptorType::STORAGE_BUFFER)
            .descriptor_count(1)
            .stage_flags(vk::ShaderStageFlags::COMPUTE);
        let pipeline = |name, constant| {
            // The set layout and the pipeline layout are made anew each time: equal content is enough.
            let set_layout = SetLayout::new(device, "set layout", &[binding])?;
            let layout = gpu::pipeline_layout(device, "layout", &[set_layout.raw], &[])?;
            let constants = &[(3, constant)];
            let stage = ShaderStage { spirv: &shader, entry: c"main", stage: vk::ShaderStageFlags::COMPUTE, constants };
            gpu::compute_pipeline(device, name, &stage, layout.raw)
        };
        let first = pipeline("first", 1)?;
        let twin = pipeline("twin", 1)?;
        assert_ne!(first.raw, twin.raw, "each has one owner");
        let raw = first.raw;
        drop(first);
        assert_eq!(device.live_objects().len(), 1, "what is kept is nobody's: {:?}", device.live_objects());
        let other = pipeline("other", 2)?;
        assert_ne!(other.raw, raw, "other constants, another pipeline");
        let again = pipeline("again", 1)?;
        assert_eq!(again.raw, raw);
        assert!(device.live_objects().iter().any(|object| object.contains("again")), "{:?}", device.live_objects());
        Ok(())
    })
}

/// `@location(0) position: vec4<f32>` to `@builtin(position)`.
fn pass_position_shader() -> Vec<u32> {
    spirv(
        12,
        &[
            (17, &[1]),                   // OpCapability Shader
            (14, &[0, 1]),                // OpMemoryModel Logical GLSL450
            (15, &[0, 1, MAIN, 0, 7, 9]), // OpEntryPoint Vertex %1 "main" %7 %9
            (71, &[7, 30, 0]),            // OpDecorate %7 Location 0
            (71, &[9, 11, 0]),            // OpDecorate %9 BuiltIn Position
            (19, &[2]),                   // %2 = OpTypeVoid
            (33, &[3, 2]),                // %3 = OpTypeFunction %2
            (22, &[4, 32]),               // %4 = OpTypeFloat 32
            (23, &[5, 4, 4]),             // %5 = OpTypeVector %4 4
            (32, &[6, 1, 5]),             // %6 = OpTypePointer Input %5
            (59, &[6, 7, 1]),             // %7 = OpVariable %6 Input
            (32, &[8, 3, 5]),             // %8 = OpTypePointer Output %5
            (59, &[8, 9, 3]),             // %9 = OpVariable %8 Output
            (54, &[2, 1, 0, 3]),          // %1 = OpFunction %2 None %3
            (248, &[10]),                 // %10 = OpLabel
            (61, &[5, 11, 7]),            // %11 = OpLoad %5 %7
            (62, &[9, 11]),               // OpStore %9 %11
            (253, &[]),                   // OpReturn
            (56, &[]),                    // OpFunctionEnd
        ],
    )
}

/// `@location(0)`: (0, 1, 0, 1).
fn green_shader() -> Vec<u32> {
    spirv(
        12,
        &[
            (17, &[1]),                       // OpCapability Shader
            (14, &[0, 1]),                    // OpMemoryModel Logical GLSL450
            (15, &[4, 1, MAIN, 0, 7]),        // OpEntryPoint Fragment %1 "main" %7
            (16, &[1, 7]),                    // OpExecutionMode %1 OriginUpperLeft
            (71, &[7, 30, 0]),                // OpDecorate %7 Location 0
            (19, &[2]),                       // %2 = OpTypeVoid
            (33, &[3, 2]),                    // %3 = OpTypeFunction %2
            (22, &[4, 32]),                   // %4 = OpTypeFloat 32
            (23, &[5, 4, 4]),                 // %5 = OpTypeVector %4 4
            (32, &[6, 3, 5]),                 // %6 = OpTypePointer Output %5
            (59, &[6, 7, 3]),                 // %7 = OpVariable %6 Output
            (43, &[4, 8, 0]),                 // %8 = OpConstant %4 0.0
            (43, &[4, 9, 1.0_f32.to_bits()]), // %9 = OpConstant %4 1.0
            (44, &[5, 10, 8, 9, 8, 9]),       // %10 = OpConstantComposite %5 %8 %9 %8 %9
            (54, &[2, 1, 0, 3]),              // %1 = OpFunction %2 None %3
            (248, &[11]),                     // %11 = OpLabel
            (62, &[7, 10]),                   // OpStore %7 %10
            (253, &[]),                       // OpReturn
            (56, &[]),                        // OpFunctionEnd
        ],
    )
}

const SIZE: vk::Extent2D = vk::Extent2D { width: 4, height: 4 };

/// A pass that clears to red and ends as a copy's source.
fn red_pass(device: &Arc<Device>, image: &Image) -> gpu::Result<(RenderPass, Framebuffer)> {
    let layout = vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL;
    let attachment = vk::AttachmentDescription::default()
        .format(image.format)
        .samples(image.samples)
        .load_op(vk::AttachmentLoadOp::CLEAR)
        .store_op(vk::AttachmentStoreOp::STORE)
        .initial_layout(vk::ImageLayout::UNDEFINED)
        .final_layout(layout);
    let color = [vk::AttachmentReference { attachment: 0, layout }];
    let subpasses = [SubpassDesc { color: &color, ..SubpassDesc::default() }];
    let parts = RenderPassParts {
        sync: SyncVersion::One,
        attachments: &[attachment],
        subpasses: &subpasses,
        dependencies: &[],
    };
    let pass = RenderPass::new(device, "red", parts)?;
    let framebuffer = gpu::framebuffer(device, "red", pass.raw, &[image.view], SIZE)?;
    Ok((pass, framebuffer))
}

fn green_pipeline(device: &Arc<Device>, pass: &RenderPass) -> gpu::Result<GraphicsPipeline> {
    let layout = gpu::pipeline_layout(device, "no sets", &[], &[])?;
    let (vertex, fragment) = (pass_position_shader(), green_shader());
    let stage = |spirv, stage| ShaderStage { spirv, entry: c"main", stage, constants: &[] };
    GraphicsPipeline::new(
        device,
        &GraphicsPipelineDesc {
            name: "green",
            stages: &[
                stage(&vertex[..], vk::ShaderStageFlags::VERTEX),
                stage(&fragment[..], vk::ShaderStageFlags::FRAGMENT),
            ],
            vertex_bindings: &[vk::VertexInputBindingDescription::default().stride(16)],
            vertex_attributes: &[vk::VertexInputAttributeDescription::default().format(vk::Format::R32G32B32A32_SFLOAT)],
            cull_mode: vk::CullModeFlags::BACK,
            front_face: vk::FrontFace::COUNTER_CLOCKWISE,
            depth: None,
            depth_bias: false,
            depth_clamp: false,
            blend: &[vk::PipelineColorBlendAttachmentState::default().color_write_mask(vk::ColorComponentFlags::RGBA)],
            samples: vk::SampleCountFlags::TYPE_1,
            layout: layout.raw,
            place: &PipelinePlace::Subpass(pass.raw, 0),
        },
    )
}

#[test]
fn a_graphics_pipeline_draws_its_triangle() -> TestResult {
    with_device(|device| {
        let usage = vk::ImageUsageFlags::COLOR_ATTACHMENT | vk::ImageUsageFlags::TRANSFER_SRC;
        let desc = ImageDesc { usage, kind: MemoryKind::Attachment, ..texture_desc("output", 4, 4, 1) };
        let image = Image::new(device, &desc)?;
        let (pass, framebuffer) = red_pass(device, &image)?;
        let pipeline = green_pipeline(device, &pass)?;
        // The half below the diagonal from the top left, counter-clockwise on the screen.
        let corners: [[f32; 4]; 3] = [[-1.0, -1.0, 0.5, 1.0], [-1.0, 1.0, 0.5, 1.0], [1.0, 1.0, 0.5, 1.0]];
        let usage = vk::BufferUsageFlags::VERTEX_BUFFER;
        let vertices = Buffer::new(device, "corners", 48, usage, Location::Upload, MemoryKind::Geometry)?;
        vertices.write(0, &corners)?;
        let mut cmd = CommandBuffer::new(device, "draw")?;
        cmd.begin()?;
        let clear = [vk::ClearValue { color: vk::ClearColorValue { float32: [1.0, 0.0, 0.0, 1.0] } }];
        let begin = vk::RenderPassBeginInfo::default()
            .render_pass(pass.raw)
            .framebuffer(framebuffer.raw)
            .render_area(SIZE.into())
            .clear_values(&clear);
        let viewport = vk::Viewport { width: 4.0, height: 4.0, max_depth: 1.0, ..vk::Viewport::default() };
        // SAFETY: recording; all of these outlive the wait in `read_level`.
        unsafe {
            let raw = &device.raw;
            raw.cmd_begin_render_pass(cmd.raw, &begin, vk::SubpassContents::INLINE);
            raw.cmd_bind_pipeline(cmd.raw, vk::PipelineBindPoint::GRAPHICS, pipeline.raw);
            raw.cmd_set_viewport(cmd.raw, 0, &[viewport]);
            raw.cmd_set_scissor(cmd.raw, 0, &[SIZE.into()]);
            raw.cmd_bind_vertex_buffers(cmd.raw, 0, &[vertices.raw], &[0]);
            raw.cmd_draw(cmd.raw, 3, 1, 0, 0);
            raw.cmd_end_render_pass(cmd.raw);
        }
        cmd.end()?;
        device.submit(&cmd)?;
        let texels = read_level(
            device,
            &image,
            0,
            (
                Use::new(vk::PipelineStageFlags2::COLOR_ATTACHMENT_OUTPUT, vk::AccessFlags2::COLOR_ATTACHMENT_WRITE),
                vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL,
            ),
        )?;
        let at = |x: usize, y: usize| &texels[(y * 4 + x) * 4..][..4];
        assert_eq!(at(0, 3), [0, 255, 0, 255], "below the diagonal");
        assert_eq!(at(3, 0), [255, 0, 0, 255], "above the diagonal");
        Ok(())
    })
}
