//! Pipelines and their layouts.

use std::ffi::CStr;
use std::sync::Arc;

use ash::vk;

use super::device::Device;
use super::error::{Doing, Error, Result};
use super::owned::{Owned, PipelineOrigin};
use super::reuse::{ContentHash, content_of};

/// One shader of a pipeline.
#[derive(Clone, Copy, Debug)]
pub struct ShaderStage<'a> {
    /// The SPIR-V module.
    pub spirv: &'a [u32],
    /// The entry point's name.
    pub entry: &'a CStr,
    /// The stage.
    pub stage: vk::ShaderStageFlags,
    /// Specialization constants: id and the bits of the 32-bit value (0 or 1 for a bool).
    pub constants: &'a [(u32, u32)],
}

/// A pipeline's use of the depth attachment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DepthState {
    /// The depth test that fragments must pass.
    pub test: vk::CompareOp,
    /// True if fragments that pass write their depth.
    pub write: bool,
}

/// A graphics pipeline that draws triangle lists. Viewport and scissor are dynamic.
#[derive(Clone, Copy, Debug)]
pub struct GraphicsPipelineDesc<'a> {
    /// The name.
    pub name: &'a str,
    /// The shaders.
    pub stages: &'a [ShaderStage<'a>],
    /// The vertex buffers; none for triangles that the shader makes.
    pub vertex_bindings: &'a [vk::VertexInputBindingDescription],
    /// The attributes that are read from them.
    pub vertex_attributes: &'a [vk::VertexInputAttributeDescription],
    /// The faces that are culled.
    pub cull_mode: vk::CullModeFlags,
    /// The winding of front faces, in framebuffer coordinates.
    pub front_face: vk::FrontFace,
    /// The depth test, if there is one.
    pub depth: Option<DepthState>,
    /// True if a depth bias is applied, which `vkCmdSetDepthBias` then sets.
    pub depth_bias: bool,
    /// True if depth is clamped instead of clipped; needs the feature.
    pub depth_clamp: bool,
    /// One for each colour attachment of the subpass.
    pub blend: &'a [vk::PipelineColorBlendAttachmentState],
    /// The samples a texel.
    pub samples: vk::SampleCountFlags,
    /// The pipeline's layout.
    pub layout: vk::PipelineLayout,
    /// The draws that it is used in.
    pub place: &'a PipelinePlace,
}

/// The draws that a pipeline is used in.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub enum PipelinePlace {
    /// A subpass, by its index, of a render pass that is compatible with this one.
    Subpass(vk::RenderPass, u32),
    /// A part of `vkCmdBeginRendering`.
    Rendering(RenderingPlace),
}

/// The attachments of `vkCmdBeginRendering`, and their use by a part of its draws.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash)]
pub struct RenderingPlace {
    /// The formats of the colour attachments.
    pub colors: Vec<vk::Format>,
    /// The location of each of them, or `vk::ATTACHMENT_UNUSED`.
    pub locations: Vec<u32>,
    /// The `InputAttachmentIndex` of each of them, or `vk::ATTACHMENT_UNUSED`.
    pub inputs: Vec<u32>,
    /// The format of the depth attachment, if there is one.
    pub depth: Option<vk::Format>,
    /// The `InputAttachmentIndex` of depth, or `vk::ATTACHMENT_UNUSED`.
    pub depth_input: u32,
}

impl RenderingPlace {
    /// The attachments' locations, as a command and a pipeline take them.
    pub fn location_info(&self) -> vk::RenderingAttachmentLocationInfoKHR<'_> {
        vk::RenderingAttachmentLocationInfoKHR::default().color_attachment_locations(&self.locations)
    }

    /// The attachments' indices as input attachments, as a command and a pipeline take them.
    pub fn input_info(&self) -> vk::RenderingInputAttachmentIndexInfoKHR<'_> {
        let mut info = vk::RenderingInputAttachmentIndexInfoKHR::default().color_attachment_input_indices(&self.inputs);
        info.p_depth_input_attachment_index = &raw const self.depth_input;
        info.p_stencil_input_attachment_index = &vk::ATTACHMENT_UNUSED;
        info
    }

    /// The blend state of each attachment: the state at its location, or a state that writes nothing.
    fn blend(
        &self,
        by_location: &[vk::PipelineColorBlendAttachmentState],
    ) -> Vec<vk::PipelineColorBlendAttachmentState> {
        let of = |&location: &u32| by_location.get(location as usize).copied().unwrap_or_default();
        self.locations.iter().map(of).collect()
    }
}

/// A pipeline, graphics or compute.
pub type GraphicsPipeline = Owned<vk::Pipeline>;

impl GraphicsPipeline {
    /// Compiles a graphics pipeline, through the device's pipeline cache.
    ///
    /// # Errors
    /// [`Error::Unsupported`] for depth clamping that the device lacks; [`Error::Misuse`] for code that is not SPIR-V; the driver's errors.
    pub fn new(device: &Arc<Device>, desc: &GraphicsPipelineDesc<'_>) -> Result<GraphicsPipeline> {
        if desc.depth_clamp && !device.features.depth_clamp {
            let lacks = format!("'{}' cannot clamp depth, as '{}' needs", device.physical.name, desc.name);
            return Err(Error::Unsupported(lacks));
        }
        let content = desc.content(device);
        if let Some(kept) = kept(device, desc.name, content) {
            return Ok(kept);
        }
        let shaders = ShaderModules::new(device, desc.name, desc.stages)?;
        let specializations = shaders.specializations();
        let stages = shaders.stages(&specializations);
        let vertex_input = vk::PipelineVertexInputStateCreateInfo::default()
            .vertex_binding_descriptions(desc.vertex_bindings)
            .vertex_attribute_descriptions(desc.vertex_attributes);
        let input_assembly =
            vk::PipelineInputAssemblyStateCreateInfo::default().topology(vk::PrimitiveTopology::TRIANGLE_LIST);
        let viewport = vk::PipelineViewportStateCreateInfo::default().viewport_count(1).scissor_count(1);
        let rasterization = vk::PipelineRasterizationStateCreateInfo::default()
            .polygon_mode(vk::PolygonMode::FILL)
            .cull_mode(desc.cull_mode)
            .front_face(desc.front_face)
            .depth_bias_enable(desc.depth_bias)
            .depth_clamp_enable(desc.depth_clamp)
            .line_width(1.0);
        let multisample = vk::PipelineMultisampleStateCreateInfo::default().rasterization_samples(desc.samples);
        let depth_stencil = depth_state(desc.depth);
        let blended = match desc.place {
            PipelinePlace::Subpass(..) => desc.blend.to_vec(),
            PipelinePlace::Rendering(place) => place.blend(desc.blend),
        };
        let blend = vk::PipelineColorBlendStateCreateInfo::default().attachments(&blended);
        let mut dynamic = vec![vk::DynamicState::VIEWPORT, vk::DynamicState::SCISSOR];
        dynamic.extend(desc.depth_bias.then_some(vk::DynamicState::DEPTH_BIAS));
        let dynamic = vk::PipelineDynamicStateCreateInfo::default().dynamic_states(&dynamic);
        let info = vk::GraphicsPipelineCreateInfo::default()
            .stages(&stages)
            .vertex_input_state(&vertex_input)
            .input_assembly_state(&input_assembly)
            .viewport_state(&viewport)
            .rasterization_state(&rasterization)
            .multisample_state(&multisample)
            .depth_stencil_state(&depth_stencil)
            .color_blend_state(&blend)
            .dynamic_state(&dynamic)
            .layout(desc.layout);
        let (mut rendering, mut locations, mut inputs);
        let info = match desc.place {
            PipelinePlace::Subpass(render_pass, subpass) => info.render_pass(*render_pass).subpass(*subpass),
            PipelinePlace::Rendering(place) => {
                rendering = vk::PipelineRenderingCreateInfo::default()
                    .color_attachment_formats(&place.colors)
                    .depth_attachment_format(place.depth.unwrap_or_default());
                (locations, inputs) = (place.location_info(), place.input_info());
                info.push_next(&mut rendering).push_next(&mut locations).push_next(&mut inputs)
            }
        };
        // SAFETY: the layout and the render pass are alive (the module's contract), the shader modules are `shaders`', and all that the structures
        // point to lives until the call returns.
        let created = unsafe { device.raw.create_graphics_pipelines(device.pipeline_cache.raw, &[info], None) };
        owned_pipeline(device, ("vkCreateGraphicsPipelines", desc.name), created, content)
    }
}

/// Compiles a compute pipeline, through the device's pipeline cache.
///
/// # Errors
/// [`Error::Misuse`] for code that is not SPIR-V; the driver's errors.
pub fn compute_pipeline(
    device: &Arc<Device>,
    name: &str,
    stage: &ShaderStage<'_>,
    layout: vk::PipelineLayout,
) -> Result<Owned<vk::Pipeline>> {
    let content = device.reuse.content(layout).map(|layout| content_of((stage.content(), layout)));
    if let Some(kept) = kept(device, name, content) {
        return Ok(kept);
    }
    let shaders = ShaderModules::new(device, name, std::slice::from_ref(stage))?;
    let specializations = shaders.specializations();
    let infos: Vec<vk::ComputePipelineCreateInfo<'_>> = shaders
        .stages(&specializations)
        .into_iter()
        .map(|stage| vk::ComputePipelineCreateInfo::default().stage(stage).layout(layout))
        .collect();
    // SAFETY: as for graphics pipelines.
    let created = unsafe { device.raw.create_compute_pipelines(device.pipeline_cache.raw, &infos, None) };
    owned_pipeline(device, ("vkCreateComputePipelines", name), created, content)
}

/// A layout of these descriptor sets, by number, and push constants.
///
/// # Errors
/// [`Error::TooLarge`] beyond the device's limits; running out of memory.
pub fn pipeline_layout(
    device: &Arc<Device>,
    name: &str,
    sets: &[vk::DescriptorSetLayout],
    push: &[vk::PushConstantRange],
) -> Result<Owned<vk::PipelineLayout>> {
    let limits = &device.physical.limits;
    let within = |what: &str, asked: u32, limit: u32| {
        if asked <= limit {
            return Ok(());
        }
        let what = format!("the {what} of the pipeline layout '{name}'");
        Err(Error::TooLarge { what, asked: asked.into(), limit: limit.into() })
    };
    within("number of descriptor sets", sets.len() as u32, limits.max_bound_descriptor_sets)?;
    let push_end = push.iter().map(|range| range.offset.saturating_add(range.size)).max().unwrap_or(0);
    within("push constants in bytes", push_end, limits.max_push_constants_size)?;
    let info = vk::PipelineLayoutCreateInfo::default().set_layouts(sets).push_constant_ranges(push);
    // SAFETY: the set layouts are alive (the module's contract).
    let raw = unsafe { device.raw.create_pipeline_layout(&info, None) }
        .doing("vkCreatePipelineLayout", || format!("creating the pipeline layout '{name}'"))?;
    if let Some(contents) = sets.iter().map(|&set| device.reuse.content(set)).collect::<Option<Vec<_>>>() {
        device.reuse.note(raw, (contents, push));
    }
    Ok(Owned::new_from(device, name, raw))
}

impl ShaderStage<'_> {
    fn content(&self) -> ContentHash {
        let spirv = blake3::hash(bytemuck::cast_slice(self.spirv));
        content_of((spirv, self.entry, self.stage, self.constants))
    }
}

impl GraphicsPipelineDesc<'_> {
    /// All of it but the name; none if the content of its layout or of its render pass is not known.
    fn content(&self, device: &Device) -> Option<ContentHash> {
        let Self {
            name: _,
            stages,
            vertex_bindings,
            vertex_attributes,
            cull_mode,
            front_face,
            depth,
            depth_bias,
            depth_clamp,
            blend,
            samples,
            layout,
            place,
        } = *self;
        let layout = device.reuse.content(layout)?;
        let place = match place {
            PipelinePlace::Subpass(render_pass, subpass) => {
                content_of(("subpass", device.reuse.content(*render_pass)?, *subpass))
            }
            PipelinePlace::Rendering(place) => content_of(("rendering", place)),
        };
        let stages: Vec<_> = stages.iter().map(ShaderStage::content).collect();
        let input = (vertex_bindings, vertex_attributes, cull_mode, front_face);
        let tests = (depth, depth_bias, depth_clamp, blend, samples);
        Some(content_of((stages, input, tests, layout, place)))
    }
}

/// A pipeline of this content that was given up before.
fn kept(device: &Arc<Device>, name: &str, content: Option<ContentHash>) -> Option<Owned<vk::Pipeline>> {
    let (raw, id) = device.reuse.take(content?)?;
    Some(Owned::reusable(device, name, PipelineOrigin::Kept(raw, id), content))
}

fn depth_state(depth: Option<DepthState>) -> vk::PipelineDepthStencilStateCreateInfo<'static> {
    let state = vk::PipelineDepthStencilStateCreateInfo::default();
    match depth {
        Some(depth) => state.depth_test_enable(true).depth_compare_op(depth.test).depth_write_enable(depth.write),
        None => state,
    }
}

/// The result of Vulkan's functions that create pipelines: the pipelines, and on failure the reason.
type Created = std::result::Result<Vec<vk::Pipeline>, (Vec<vk::Pipeline>, vk::Result)>;

fn owned_pipeline(
    device: &Arc<Device>,
    (command, name): (&str, &str),
    created: Created,
    content: Option<ContentHash>,
) -> Result<Owned<vk::Pipeline>> {
    let (pipelines, result) = created.map_or_else(|failed| failed, |made| (made, vk::Result::ERROR_UNKNOWN));
    // One was asked for: a failure leaves a null handle or none.
    match pipelines.first() {
        Some(&raw) if raw != vk::Pipeline::null() => {
            Ok(Owned::reusable(device, name, PipelineOrigin::New(raw), content))
        }
        _ => Err(Error::vulkan(command, format!("compiling the pipeline '{name}'"), result)),
    }
}

/// The shader modules of a pipeline with its stages; they go when the pipeline is compiled.
struct ShaderModules<'a> {
    stages: Vec<(ShaderStage<'a>, Owned<vk::ShaderModule>)>,
    constants: Vec<Constants>,
}

/// The specialization constants of a stage as Vulkan takes them.
struct Constants {
    entries: Vec<vk::SpecializationMapEntry>,
    data: Vec<u32>,
}

const SPIRV_MAGIC: u32 = 0x0723_0203;

impl<'a> ShaderModules<'a> {
    fn new(device: &Arc<Device>, name: &str, stages: &[ShaderStage<'a>]) -> Result<ShaderModules<'a>> {
        let with_module = |stage: &ShaderStage<'a>| {
            if stage.spirv.first() != Some(&SPIRV_MAGIC) {
                return Err(Error::Misuse(format!("the {:?} shader of '{name}' is no SPIR-V", stage.stage)));
            }
            device.keep_shader(|| format!("{name} {:?}", stage.stage), stage.spirv);
            let info = vk::ShaderModuleCreateInfo::default().code(stage.spirv);
            // SAFETY: the device is alive; the shader compiler checks that the module is valid.
            let raw = unsafe { device.raw.create_shader_module(&info, None) }
                .doing("vkCreateShaderModule", || format!("loading the {:?} shader of '{name}'", stage.stage))?;
            Ok((*stage, Owned::new_from(device, name, raw)))
        };
        let stages = stages.iter().map(with_module).collect::<Result<Vec<_>>>()?;
        let constants = stages.iter().map(|(stage, _)| Constants::new(stage.constants)).collect();
        Ok(ShaderModules { stages, constants })
    }

    fn specializations(&self) -> Vec<vk::SpecializationInfo<'_>> {
        self.constants.iter().map(Constants::info).collect()
    }

    fn stages<'s>(
        &'s self,
        specializations: &'s [vk::SpecializationInfo<'s>],
    ) -> Vec<vk::PipelineShaderStageCreateInfo<'s>> {
        let info = |((stage, module), specialization): (&'s (ShaderStage<'a>, Owned<vk::ShaderModule>), _)| {
            vk::PipelineShaderStageCreateInfo::default()
                .stage(stage.stage)
                .module(module.raw)
                .name(stage.entry)
                .specialization_info(specialization)
        };
        self.stages.iter().zip(specializations).map(info).collect()
    }
}

impl Constants {
    fn info(&self) -> vk::SpecializationInfo<'_> {
        vk::SpecializationInfo::default().map_entries(&self.entries).data(bytemuck::cast_slice(&self.data))
    }

    fn new(constants: &[(u32, u32)]) -> Constants {
        let entry = |(index, &(constant_id, _)): (usize, &(u32, u32))| vk::SpecializationMapEntry {
            constant_id,
            offset: index as u32 * 4,
            size: 4,
        };
        Constants {
            entries: constants.iter().enumerate().map(entry).collect(),
            data: constants.iter().map(|&(_, bits)| bits).collect(),
        }
    }
}
