//! FORMULAS on the device: a buffer of inputs in, a buffer of outputs out, one dispatch.

use std::sync::Arc;

use ash::vk;
use bytemuck::Zeroable;

use super::{FormulaOutput, Input, Trial};
use afterlight::frame::rows::{self, RowName};
use afterlight::gpu::{
    self, Buffer, CommandBuffer, DescriptorPool, Device, Location, MemoryKind, Owned, SetLayout, SetWriter,
    ShaderStage, barrier, binding, compute_pipeline, pipeline_layout,
};
use afterlight::gpu_scene::FrameUniform;
use afterlight::shaders::formulas::{self as shader, Flags, constants};

/// Invocations in a work group.
const GROUP: u32 = shader::WORKGROUP_SIZE[0];

/// Buffers of a trial. The sets: 0 the frame, 1 inputs and outputs.
struct TrialBuffers {
    frame: Buffer,
    inputs: Buffer,
    outputs: Buffer,
}

impl TrialBuffers {
    fn new(device: &Arc<Device>, trial: &Trial) -> gpu::Result<Self> {
        let storage = vk::BufferUsageFlags::STORAGE_BUFFER;
        let make =
            |name, bytes: usize, usage, location, kind| Buffer::new(device, name, bytes as u64, usage, location, kind);
        let uniform = vk::BufferUsageFlags::UNIFORM_BUFFER;
        let (upload, for_shaders) = (Location::Upload, MemoryKind::Uniform);
        let frame = make("formula frame", size_of::<FrameUniform>(), uniform, upload, for_shaders)?;
        frame.write(0, &[trial.frame.unwrap_or_else(FrameUniform::zeroed)])?;
        let inputs = make("formula inputs", size_of_val(&trial.inputs[..]), storage, upload, for_shaders)?;
        inputs.write(0, &trial.inputs)?;
        let bytes = trial.inputs.len() * size_of::<FormulaOutput>();
        let outputs = make("formula outputs", bytes, storage, Location::ReadBack, MemoryKind::ReadBack)?;
        Ok(Self { frame, inputs, outputs })
    }
}

/// A pipeline that takes these buffers.
struct FormulaPipeline {
    layout: Owned<vk::PipelineLayout>,
    pipeline: Owned<vk::Pipeline>,
    sets: [vk::DescriptorSet; 2],
    _set_layouts: [SetLayout; 2],
    _pool: DescriptorPool,
}

impl FormulaPipeline {
    fn new(device: &Arc<Device>, trial: &Trial, buffers: &TrialBuffers) -> gpu::Result<Self> {
        let binding = |index, kind| binding(index, kind, vk::ShaderStageFlags::COMPUTE);
        let (uniform, storage) = (vk::DescriptorType::UNIFORM_BUFFER, vk::DescriptorType::STORAGE_BUFFER);
        let frame_layout = SetLayout::new(device, "formula frame", &[binding(0, uniform)])?;
        let data_layout = SetLayout::new(device, "formula data", &[binding(0, storage), binding(1, storage)])?;
        let pool = DescriptorPool::new(device, "formula sets", 2, &[(uniform, 1), (storage, 2)])?;
        let sets = [pool.allocate("formula frame", frame_layout.raw)?, pool.allocate("formula data", data_layout.raw)?];
        SetWriter::new().uniform_buffer(0, &buffers.frame, ..).update(device, sets[0]);
        let data = SetWriter::new().storage_buffer(0, &buffers.inputs, ..);
        data.storage_buffer(1, &buffers.outputs, ..).update(device, sets[1]);
        let flags = Flags::PLANTED.when(trial.planted);
        let Some(entry) = shader::variant(flags).and_then(|variant| variant.compute()) else {
            return Err(gpu::Error::Unsupported(format!("formulas.wgsl has no variant {flags:?}")));
        };
        let layout = pipeline_layout(device, "formula", &[frame_layout.raw, data_layout.raw], &[])?;
        let stage = ShaderStage {
            spirv: entry.spirv.words(),
            entry: entry.name,
            stage: vk::ShaderStageFlags::COMPUTE,
            constants: &[(constants::FORMULA, trial.formula as u32)],
        };
        let pipeline = compute_pipeline(device, &format!("formula {:?}", trial.formula), &stage, layout.raw)?;
        Ok(Self { layout, pipeline, sets, _set_layouts: [frame_layout, data_layout], _pool: pool })
    }
}

/// Returns the shader's output for each input of the trial.
///
/// # Errors
/// A device that is lost or out of memory.
pub fn evaluate(device: &Arc<Device>, trial: &Trial) -> gpu::Result<Vec<FormulaOutput>> {
    let buffers = TrialBuffers::new(device, trial)?;
    let program = FormulaPipeline::new(device, trial, &buffers)?;
    let mut cmd = CommandBuffer::new(device, "formula")?;
    cmd.begin()?;
    let point = vk::PipelineBindPoint::COMPUTE;
    device.begin_label(cmd.raw, "FORMULAS");
    // SAFETY: `cmd` is being recorded outside a render pass; the sets are those of the layout, and all of it lives until the wait below.
    unsafe {
        device.raw.cmd_bind_pipeline(cmd.raw, point, program.pipeline.raw);
        device.raw.cmd_bind_descriptor_sets(cmd.raw, point, program.layout.raw, 0, &program.sets, &[]);
        device.raw.cmd_dispatch(cmd.raw, (trial.inputs.len() as u32).div_ceil(GROUP), 1, 1);
    }
    device.end_label(cmd.raw);
    // The CPU reads the outputs of FORMULAS. The CPU's own writes before the submission are visible to FORMULAS without a barrier.
    if let Some(row) = rows::formulas().find(RowName::RESULTS_TO_HOST) {
        barrier::buffer_barrier(device, cmd.raw, &buffers.outputs, row.order());
    }
    cmd.end()?;
    let ticket = device.submit(&cmd)?;
    device.wait(ticket)?;
    // Copied float by float: the bytes of mapped memory promise no alignment.
    buffers.outputs.read_with(0, buffers.outputs.size, |bytes| {
        bytes.chunks_exact(size_of::<FormulaOutput>()).map(bytemuck::pod_read_unaligned).collect()
    })
}

const _: () = assert!(size_of::<Input>() == 64 && size_of::<FormulaOutput>() == 16);
