//! SKIN: the vertices of deformed meshes, once for a pose, by compute. Passes draw them as they draw any.

use std::sync::Arc;

use ash::vk;

use super::{Endpoint, FrameContext, Pass, PassRecorder, Presence, Resource, ResourceUse, compute_stage};
use crate::gpu::{
    self, Buffer, DescriptorPool, Device, Owned, SetLayout, SetWriter, binding, compute_pipeline, pipeline_layout,
    sync::Use,
};
use crate::gpu_scene::{Deformed, PoseBuffer, SkinPush};
use crate::plan::FramePlan;
use crate::shaders::skin::{self as shader, Flags};

/// Reads meshes at rest, and the pose that the CPU wrote.
pub const SOURCE_READ: Use = Use::new(vk::PipelineStageFlags2::COMPUTE_SHADER, vk::AccessFlags2::SHADER_READ);
/// Reads where the pose before had a vertex.
pub const BEFORE_READ: Use = Use::new(vk::PipelineStageFlags2::COMPUTE_SHADER, vk::AccessFlags2::SHADER_READ);
/// Writes vertices.
pub const VERTEX_WRITE: Use = Use::new(vk::PipelineStageFlags2::COMPUTE_SHADER, vk::AccessFlags2::SHADER_WRITE);

pub const PASS: Pass = Pass {
    name: Endpoint::pass("SKIN"),
    time: "skin",
    what: "vertices of deformed meshes, when their pose is another",
    presence: |plan| {
        Presence::when(
            !plan.meshes.deforms.objects.is_empty(),
            "skins or shapes deform meshes",
            "no skin and no shape deforms a mesh",
        )
    },
    touches: |plan| {
        vec![
            ResourceUse::resource(Resource::RestMeshes, SOURCE_READ),
            ResourceUse::resource(Resource::FrameData, SOURCE_READ),
            ResourceUse::resource(Resource::DeformedVertices, vertex_use(plan))
                .because("writes the vertices that draws fetch"),
        ]
    },
    leave_out: None,
    make: Some(|own| {
        Ok(Box::new(SkinPass::new(own.device, own.needed(own.scene.deformed.as_ref())?, own.poses.iter())?))
    }),
};

/// Returns its use of the vertices.
fn vertex_use(plan: &FramePlan) -> Use {
    if plan.meshes.deforms.keeps_positions { VERTEX_WRITE.or(BEFORE_READ) } else { VERTEX_WRITE }
}

const COMPUTE: vk::ShaderStageFlags = vk::ShaderStageFlags::COMPUTE;

/// The pass, with a set for each frame in flight.
pub struct SkinPass {
    layout: Owned<vk::PipelineLayout>,
    pipeline: Owned<vk::Pipeline>,
    sets: Vec<vk::DescriptorSet>,
    push: SkinPush,
    _set_layout: SetLayout,
    _pool: DescriptorPool,
}

impl SkinPass {
    /// `poses` are the buffers of frames in flight, in their order.
    pub fn new<'a>(
        device: &Arc<Device>,
        deformed: &Deformed,
        poses: impl ExactSizeIterator<Item = &'a PoseBuffer>,
    ) -> gpu::Result<Self> {
        let storage = |index| binding(index, vk::DescriptorType::STORAGE_BUFFER, COMPUTE);
        let set_layout = SetLayout::new(device, "skin", &[0, 1, 2].map(storage))?;
        let count = poses.len() as u32;
        let pool = DescriptorPool::new(device, "skin", count, &[(vk::DescriptorType::STORAGE_BUFFER, 3 * count)])?;
        let set = |(index, pose): (usize, &PoseBuffer)| {
            let set = pool.allocate(&format!("skin of frame {index}"), set_layout.raw)?;
            let whole = |writer: SetWriter, index, buffer: &Buffer| writer.storage_buffer(index, buffer, buffer.size);
            let writer = whole(SetWriter::new(), 0, &deformed.sources);
            whole(whole(writer, 1, pose.buffer()), 2, &deformed.vertices).update(device, set);
            Ok(set)
        };
        let sets = poses.enumerate().map(set).collect::<gpu::Result<_>>()?;
        let range = vk::PushConstantRange { stage_flags: COMPUTE, offset: 0, size: shader::push::SIZE as u32 };
        let layout = pipeline_layout(device, "skin", &[set_layout.raw], &[range])?;
        let stage = compute_stage("skin", shader::variant, Flags::NONE, &[])?;
        let pipeline = compute_pipeline(device, "skin", &stage, layout.raw)?;
        Ok(Self { layout, pipeline, sets, push: deformed.push, _set_layout: set_layout, _pool: pool })
    }
}

impl PassRecorder for SkinPass {
    /// Writes the vertices of the frame's pose. Runs outside any render pass.
    fn record(&self, context: &FrameContext) {
        let (raw, cmd) = (&context.device.raw, context.cmd);
        let point = vk::PipelineBindPoint::COMPUTE;
        let [columns, rows] = self.push.groups();
        let set = self.sets[context.in_flight];
        // SAFETY: `cmd` is being recorded outside a render pass; set and push constants are those of the layout. The frame owns the buffers
        // in the set and the pass all else, and both outlive the submission. No work group looks beyond its mesh's vertices.
        unsafe {
            raw.cmd_bind_pipeline(cmd, point, self.pipeline.raw);
            raw.cmd_bind_descriptor_sets(cmd, point, self.layout.raw, 0, &[set], &[]);
            raw.cmd_push_constants(cmd, self.layout.raw, COMPUTE, 0, bytemuck::bytes_of(&self.push));
            raw.cmd_dispatch(cmd, columns, rows, 1);
        }
    }
}
