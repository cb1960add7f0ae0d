//! SHADOW: the sun's depth map, in a render pass of its own.

use std::sync::Arc;

use ash::vk;
use bytemuck::{Pod, Zeroable};
use glam::Vec4;

use super::screen::stages;
use super::{Recording, Slot};
use crate::gpu::{
    self, DepthState, Device, GraphicsPipeline, GraphicsPipelineDesc, Image, ImageDesc, Location, MemoryKind, Owned,
    framebuffer, pipeline_layout, sync::Use,
};
use crate::gpu_scene::{GpuScene, POSITION, UV, vertex_input};
use crate::plan::{DEPTH, World};
use crate::scene::AlphaMode;
use crate::shaders::shadow::{self as shader, Flags};

/// Clears, tests and writes the map; its store is a write in the late stage.
pub const MAP_WRITE: Use =
    Use::new(vk::PipelineStageFlags::EARLY_FRAGMENT_TESTS, vk::AccessFlags::DEPTH_STENCIL_ATTACHMENT_READ)
        .or(Use::new(vk::PipelineStageFlags::LATE_FRAGMENT_TESTS, vk::AccessFlags::DEPTH_STENCIL_ATTACHMENT_WRITE));

const PUSH_STAGES: vk::ShaderStageFlags =
    vk::ShaderStageFlags::from_raw(vk::ShaderStageFlags::VERTEX.as_raw() | vk::ShaderStageFlags::FRAGMENT.as_raw());

#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Push {
    rows: [Vec4; 3],
    alpha: f32,
    alpha_cutoff: f32,
    _padding: [f32; 2],
}

const _: () = {
    use crate::shaders::shadow::push as wgsl;
    use std::mem::offset_of;
    assert!(size_of::<Push>() == wgsl::SIZE);
    assert!(offset_of!(Push, rows) == wgsl::ROW_X);
    assert!(offset_of!(Push, alpha) == wgsl::ALPHA);
    assert!(offset_of!(Push, alpha_cutoff) == wgsl::ALPHA_CUTOFF);
};

/// The pass and its map.
pub struct Shadow {
    map: Image,
    render_pass: vk::RenderPass,
    framebuffer: Owned<vk::Framebuffer>,
    opaque: (Owned<vk::PipelineLayout>, Owned<vk::Pipeline>),
    /// Casters with holes, where the scene has some.
    masked: Option<(Owned<vk::PipelineLayout>, Owned<vk::Pipeline>)>,
    slope_bias: f32,
}

/// The one attachment of the pass: cleared, kept for LIGHTING.
pub fn attachment() -> vk::AttachmentDescription {
    vk::AttachmentDescription::default()
        .format(DEPTH)
        .samples(vk::SampleCountFlags::TYPE_1)
        .load_op(vk::AttachmentLoadOp::CLEAR)
        .store_op(vk::AttachmentStoreOp::STORE)
        .stencil_load_op(vk::AttachmentLoadOp::DONT_CARE)
        .stencil_store_op(vk::AttachmentStoreOp::DONT_CARE)
        .initial_layout(vk::ImageLayout::UNDEFINED)
        // The barrier after the pass takes it to LIGHTING's layout.
        .final_layout(vk::ImageLayout::DEPTH_STENCIL_ATTACHMENT_OPTIMAL)
}

impl Shadow {
    /// A square map of `size` texels.
    ///
    /// # Errors
    /// When there is no memory for it or a pipeline cannot be made.
    pub fn new(device: &Arc<Device>, size: u32, slot: Slot, scene: &GpuScene, world: &World) -> gpu::Result<Self> {
        let extent = vk::Extent2D { width: size, height: size };
        let map = Image::new(
            device,
            &ImageDesc {
                name: "shadow map",
                format: DEPTH,
                extent,
                usage: vk::ImageUsageFlags::DEPTH_STENCIL_ATTACHMENT | vk::ImageUsageFlags::SAMPLED,
                location: Location::Device,
                kind: MemoryKind::ShadowMap,
                ..ImageDesc::default()
            },
        )?;
        let framebuffer = framebuffer(device, "shadow framebuffer", slot.render_pass, &[map.view], extent)?;
        let masked = match &scene.materials {
            Some(materials) if world.objects.iter().any(|object| casts_holes(world, object.material)) => {
                Some(pipeline(device, slot, Flags::MASKED, &[materials.set_layout.raw])?)
            }
            _ => None,
        };
        Ok(Self {
            map,
            render_pass: slot.render_pass,
            framebuffer,
            opaque: pipeline(device, slot, Flags::NONE, &[])?,
            masked,
            slope_bias: world.shadows.slope_bias,
        })
    }

    pub fn map(&self) -> &Image {
        &self.map
    }

    /// Begins the render pass, draws every caster, ends it.
    pub fn record(&self, recording: &Recording) {
        let clear = vk::ClearValue { depth_stencil: vk::ClearDepthStencilValue { depth: 1.0, stencil: 0 } };
        let begin = vk::RenderPassBeginInfo::default()
            .render_pass(self.render_pass)
            .framebuffer(self.framebuffer.raw)
            .render_area(vk::Rect2D { offset: vk::Offset2D::default(), extent: self.map.extent })
            .clear_values(std::slice::from_ref(&clear));
        // SAFETY: `cmd` is being recorded outside a render pass; pass and framebuffer belong together.
        unsafe {
            recording.device.raw.cmd_begin_render_pass(recording.cmd, &begin, vk::SubpassContents::INLINE);
        }
        recording.set_area(self.map.extent.width, self.map.extent.height);
        // SAFETY: depth bias is dynamic in both pipelines.
        unsafe { recording.device.raw.cmd_set_depth_bias(recording.cmd, 0.0, 0.0, self.slope_bias) };
        self.draw(recording);
        // SAFETY: begun above.
        unsafe { recording.device.raw.cmd_end_render_pass(recording.cmd) };
    }

    fn draw(&self, recording: &Recording) {
        let Some(sun) = &recording.visible.sun else { return };
        recording.scene.bind(recording.device, recording.cmd, &[POSITION, UV]);
        let mut bound: (Option<vk::Pipeline>, Option<usize>) = (None, None);
        for draw in &recording.visible.casters {
            let object = &recording.world.objects[draw.object];
            let holes = casts_holes(recording.world, object.material);
            let (layout, pipeline) = if holes { self.masked.as_ref().unwrap_or(&self.opaque) } else { &self.opaque };
            if bound.0 != Some(pipeline.raw) {
                recording.bind_pipeline(pipeline.raw);
                bound = (Some(pipeline.raw), None);
            }
            if holes && bound.1 != Some(object.material) {
                let sets = recording.scene.materials.as_ref().map(|materials| &materials.sets);
                if let Some(set) = sets.and_then(|sets| sets[object.material]) {
                    recording.bind_set(layout.raw, 0, set);
                }
                bound.1 = Some(object.material);
            }
            let material = &recording.world.materials[object.material];
            let push = Push {
                rows: sun.clip_rows(&object.transform),
                alpha: material.alpha,
                alpha_cutoff: match material.alpha_mode {
                    AlphaMode::Mask { cutoff } => cutoff,
                    AlphaMode::Opaque => 0.0,
                },
                _padding: [0.0; 2],
            };
            recording.push(layout.raw, PUSH_STAGES, &push);
            recording.draw_mesh(object.mesh);
        }
    }
}

fn casts_holes(world: &World, material: usize) -> bool {
    let material = &world.materials[material];
    material.is_masked() && material.base_color_texture.is_some()
}

fn pipeline(
    device: &Arc<Device>,
    slot: Slot,
    flags: Flags,
    sets: &[vk::DescriptorSetLayout],
) -> gpu::Result<(Owned<vk::PipelineLayout>, Owned<vk::Pipeline>)> {
    let masked = flags == Flags::MASKED;
    let name = if masked { "masked shadow" } else { "shadow" };
    let range = vk::PushConstantRange { stage_flags: PUSH_STAGES, offset: 0, size: size_of::<Push>() as u32 };
    let layout = pipeline_layout(device, name, sets, &[range])?;
    let Some(variant) = shader::variant(flags) else {
        return Err(gpu::Error::Unsupported(format!("shadow.wgsl has no variant {flags:?}")));
    };
    let (vertex_bindings, vertex_attributes) = vertex_input(if masked { &[POSITION, UV] } else { &[POSITION] });
    let pipeline = GraphicsPipeline::new(
        device,
        &GraphicsPipelineDesc {
            name,
            stages: &stages(variant, &[]),
            vertex_bindings: &vertex_bindings,
            vertex_attributes: &vertex_attributes,
            // Both sides cast: a surface seen from behind still stands in the light.
            cull_mode: vk::CullModeFlags::NONE,
            front_face: vk::FrontFace::COUNTER_CLOCKWISE,
            depth: Some(DepthState { test: vk::CompareOp::LESS_OR_EQUAL, write: true }),
            depth_bias: true,
            depth_clamp: false,
            blend: &[],
            samples: vk::SampleCountFlags::TYPE_1,
            layout: layout.raw,
            render_pass: slot.render_pass,
            subpass: slot.subpass,
        },
    )?;
    Ok((layout, pipeline))
}
