//! The device's functions: `ash::Device`, whose functions that record commands also write the command into the device's journal.
//!
//! Each method notes a command and calls the driver, so the journal cannot differ from the recorded frame. Labels and pipeline barriers are recorded
//! in one place each ([`super::Device::begin_label`], [`super::barrier`]), which notes them with the label's text and the barrier's row.

use std::ops::Deref;

use ash::vk;

use super::device::EnabledFeatures;
use super::journal::{Arguments, CommandJournal};

/// `ash::Device`, with a journal of recorded commands.
pub struct Functions {
    ash: ash::Device,
    synchronization2: Option<ash::khr::synchronization2::Device>,
    render_pass2: Option<ash::khr::create_renderpass2::Device>,
    rendering: Option<ash::khr::dynamic_rendering::Device>,
    local_read: Option<ash::khr::dynamic_rendering_local_read::Device>,
    pub(super) journal: CommandJournal,
}

impl Functions {
    /// The functions of a device that was opened with these features.
    pub(super) fn new(instance: &ash::Instance, ash: ash::Device, features: &EnabledFeatures) -> Self {
        let of = |is_enabled: bool| is_enabled.then_some((instance, &ash));
        Self {
            synchronization2: of(features.synchronization2)
                .map(|(of, on)| ash::khr::synchronization2::Device::new(of, on)),
            render_pass2: of(features.render_pass2).map(|(of, on)| ash::khr::create_renderpass2::Device::new(of, on)),
            rendering: of(features.local_read).map(|(of, on)| ash::khr::dynamic_rendering::Device::new(of, on)),
            local_read: of(features.local_read)
                .map(|(of, on)| ash::khr::dynamic_rendering_local_read::Device::new(of, on)),
            journal: CommandJournal::default(),
            ash,
        }
    }

    /// Calls these functions of Vulkan 1.0 to 1.3 from now on, as where a layer stands before the driver.
    pub fn intercept(&mut self, ash: ash::Device) {
        self.ash = ash;
    }

    /// Records `vkCmdPipelineBarrier2`, which the caller has noted.
    ///
    /// # Safety
    /// As the function of the extension.
    pub(super) unsafe fn pipeline_barrier2(&self, cmd: vk::CommandBuffer, info: &vk::DependencyInfo<'_>) {
        // SAFETY: the caller's promise.
        unsafe { enabled(&self.synchronization2, "vkCmdPipelineBarrier2").cmd_pipeline_barrier2(cmd, info) };
    }

    /// Records `vkCmdBeginRendering`. It has no Vulkan object, so the journal uses `name` for it, as it does the name of a render pass.
    ///
    /// # Safety
    /// As the function of the extension.
    pub unsafe fn begin_rendering(&self, cmd: vk::CommandBuffer, name: &str, info: &vk::RenderingInfo<'_>) {
        let arguments = || Arguments::objects([name.to_owned()]).numbers(rectangle(info.render_area));
        self.journal.note(cmd, "vkCmdBeginRendering", |_| arguments());
        // SAFETY: the caller's promise.
        unsafe { enabled(&self.rendering, "vkCmdBeginRendering").cmd_begin_rendering(cmd, info) };
    }

    /// Submits by `vkQueueSubmit2`. Only on a device with synchronization2.
    ///
    /// # Safety
    /// As the function of the extension.
    pub unsafe fn queue_submit2(
        &self,
        queue: vk::Queue,
        submits: &[vk::SubmitInfo2<'_>],
        fence: vk::Fence,
    ) -> ash::prelude::VkResult<()> {
        match &self.synchronization2 {
            // SAFETY: the caller's promise.
            Some(functions) => unsafe { functions.queue_submit2(queue, submits, fence) },
            None => Err(vk::Result::ERROR_EXTENSION_NOT_PRESENT),
        }
    }

    /// Makes a render pass by `vkCreateRenderPass2`. Only on a device with the extension.
    ///
    /// # Safety
    /// As the function of the extension.
    pub(super) unsafe fn create_render_pass2(
        &self,
        info: &vk::RenderPassCreateInfo2<'_>,
    ) -> ash::prelude::VkResult<vk::RenderPass> {
        match &self.render_pass2 {
            // SAFETY: the caller's promise.
            Some(functions) => unsafe { functions.create_render_pass2(info, None) },
            None => Err(vk::Result::ERROR_EXTENSION_NOT_PRESENT),
        }
    }
}

/// The functions of an extension, one of which is about to be called. A device without it never comes here: plans that need it are refused, and so is a recording
/// by an API that the device lacks (`CommandBuffer::begin_by`). A call that did nothing would be a frame without its barriers, so the mistake ends the program.
fn enabled<'a, F>(functions: &'a Option<F>, command: &str) -> &'a F {
    functions
        .as_ref()
        .unwrap_or_else(|| panic!("{command} is called on a device that was opened without its extension"))
}

impl Deref for Functions {
    type Target = ash::Device;

    fn deref(&self) -> &ash::Device {
        &self.ash
    }
}

/// Declares methods that hide the functions of `ash::Device` with the same names. The expression after `=>` makes the note.
macro_rules! noted {
    ($($c_name:literal $name:ident($($argument:ident: $type:ty),*), $names:ident => $arguments:expr;)*) => {
        impl Functions {$(
            #[doc = concat!("Records `", $c_name, "`.")]
            ///
            /// # Safety
            /// As the function of `ash::Device`.
            #[allow(clippy::too_many_arguments, reason = "Vulkan's own")]
            pub unsafe fn $name(&self, cmd: vk::CommandBuffer $(, $argument: $type)*) {
                self.journal.note(cmd, $c_name, |$names| $arguments);
                // SAFETY: the caller's promise.
                unsafe { self.ash.$name(cmd $(, $argument)*) }
            }
        )*}

        /// The names of all functions of Vulkan 1.1 that note their command.
        #[cfg(test)]
        const NOTED: &[&str] = &[$(stringify!($name)),*];
    };
}

/// Declares the same for functions of extensions, each with the field that has it.
macro_rules! noted_of_extensions {
    ($($c_name:literal $field:ident.$name:ident($($argument:ident: $type:ty),*), $names:ident => $arguments:expr;)*) => {
        impl Functions {$(
            #[doc = concat!("Records `", $c_name, "`.")]
            ///
            /// # Safety
            /// As the function of the extension.
            pub unsafe fn $name(&self, cmd: vk::CommandBuffer $(, $argument: $type)*) {
                let functions = enabled(&self.$field, $c_name);
                self.journal.note(cmd, $c_name, |$names| $arguments);
                // SAFETY: the caller's promise.
                unsafe { functions.$name(cmd $(, $argument)*) }
            }
        )*}

        /// The names of all functions of extensions that note their command.
        #[cfg(test)]
        const NOTED_OF_EXTENSIONS: &[&str] = &[$(stringify!($name)),*];
    };
}

const fn rectangle(area: vk::Rect2D) -> [i64; 4] {
    let vk::Rect2D { offset, extent } = area;
    [offset.x as i64, offset.y as i64, extent.width as i64, extent.height as i64]
}

/// Vulkan's sizes are 64 bits, and no object has half as many bytes.
const fn bytes(size: vk::DeviceSize) -> i64 {
    size as i64
}

noted! {
    "vkCmdBeginRenderPass" cmd_begin_render_pass(begin: &vk::RenderPassBeginInfo<'_>, contents: vk::SubpassContents), names =>
        Arguments::objects([names.of(begin.render_pass), names.of(begin.framebuffer)]).numbers(rectangle(begin.render_area));
    "vkCmdNextSubpass" cmd_next_subpass(contents: vk::SubpassContents), _names => Arguments::default();
    "vkCmdEndRenderPass" cmd_end_render_pass(), _names => Arguments::default();

    "vkCmdBindPipeline" cmd_bind_pipeline(point: vk::PipelineBindPoint, pipeline: vk::Pipeline), names =>
        Arguments::objects([names.of(pipeline)]);
    "vkCmdBindDescriptorSets" cmd_bind_descriptor_sets(
        point: vk::PipelineBindPoint, layout: vk::PipelineLayout, first: u32, sets: &[vk::DescriptorSet], offsets: &[u32]
    ), names => Arguments::objects(names.all(sets)).numbers([first]);
    "vkCmdBindVertexBuffers" cmd_bind_vertex_buffers(
        first: u32, buffers: &[vk::Buffer], offsets: &[vk::DeviceSize]
    ), names => Arguments::objects(names.all(buffers)).numbers([first]).numbers(offsets.iter().copied().map(bytes));
    "vkCmdBindIndexBuffer" cmd_bind_index_buffer(buffer: vk::Buffer, offset: vk::DeviceSize, width: vk::IndexType), names =>
        Arguments::objects([names.of(buffer)]).numbers([bytes(offset)]);
    "vkCmdPushConstants" cmd_push_constants(
        layout: vk::PipelineLayout, stages: vk::ShaderStageFlags, offset: u32, constants: &[u8]
    ), _names => Arguments::default().numbers([i64::from(offset), constants.len() as i64]);
    "vkCmdSetViewport" cmd_set_viewport(first: u32, viewports: &[vk::Viewport]), _names =>
        Arguments::default().numbers(viewports.iter().flat_map(|own| [own.x, own.y, own.width, own.height].map(|edge| edge as i64)));
    "vkCmdSetScissor" cmd_set_scissor(first: u32, scissors: &[vk::Rect2D]), _names =>
        Arguments::default().numbers(scissors.iter().flat_map(|&own| rectangle(own)));
    "vkCmdSetDepthBias" cmd_set_depth_bias(constant: f32, clamp: f32, slope: f32), _names => Arguments::default();

    "vkCmdDraw" cmd_draw(vertices: u32, instances: u32, first_vertex: u32, first_instance: u32), _names =>
        Arguments::default().numbers([vertices, instances, first_vertex, first_instance]);
    "vkCmdDrawIndexed" cmd_draw_indexed(
        indices: u32, instances: u32, first_index: u32, vertex_offset: i32, first_instance: u32
    ), _names => Arguments::default()
        .numbers([indices, instances, first_index]).numbers([vertex_offset]).numbers([first_instance]);
    "vkCmdDrawIndexedIndirect" cmd_draw_indexed_indirect(
        buffer: vk::Buffer, offset: vk::DeviceSize, draws: u32, stride: u32
    ), names => Arguments::objects([names.of(buffer)]).numbers([bytes(offset)]).numbers([draws, stride]);
    "vkCmdDispatch" cmd_dispatch(x: u32, y: u32, z: u32), _names => Arguments::default().numbers([x, y, z]);

    "vkCmdCopyBuffer" cmd_copy_buffer(from: vk::Buffer, to: vk::Buffer, regions: &[vk::BufferCopy]), names =>
        Arguments::objects([names.of(from), names.of(to)]).numbers([regions.len() as i64]);
    "vkCmdCopyBufferToImage" cmd_copy_buffer_to_image(
        from: vk::Buffer, to: vk::Image, layout: vk::ImageLayout, regions: &[vk::BufferImageCopy]
    ), names => Arguments::objects([names.of(from), names.of(to)]).numbers([regions.len() as i64]);
    "vkCmdCopyImage" cmd_copy_image(
        from: vk::Image, old: vk::ImageLayout, to: vk::Image, new: vk::ImageLayout, regions: &[vk::ImageCopy]
    ), names => Arguments::objects([names.of(from), names.of(to)]).numbers([regions.len() as i64]);
    "vkCmdCopyImageToBuffer" cmd_copy_image_to_buffer(
        from: vk::Image, layout: vk::ImageLayout, to: vk::Buffer, regions: &[vk::BufferImageCopy]
    ), names => Arguments::objects([names.of(from), names.of(to)]).numbers([regions.len() as i64]);
    "vkCmdBlitImage" cmd_blit_image(
        from: vk::Image, old: vk::ImageLayout, to: vk::Image, new: vk::ImageLayout, regions: &[vk::ImageBlit], filter: vk::Filter
    ), names => Arguments::objects([names.of(from), names.of(to)]).numbers([regions.len() as i64]);
    "vkCmdClearColorImage" cmd_clear_color_image(
        image: vk::Image, layout: vk::ImageLayout, value: &vk::ClearColorValue, ranges: &[vk::ImageSubresourceRange]
    ), names => Arguments::objects([names.of(image)]).numbers([ranges.len() as i64]);
    "vkCmdClearDepthStencilImage" cmd_clear_depth_stencil_image(
        image: vk::Image, layout: vk::ImageLayout, value: &vk::ClearDepthStencilValue, ranges: &[vk::ImageSubresourceRange]
    ), names => Arguments::objects([names.of(image)]).numbers([ranges.len() as i64]);

    "vkCmdResetQueryPool" cmd_reset_query_pool(pool: vk::QueryPool, first: u32, count: u32), names =>
        Arguments::objects([names.of(pool)]).numbers([first, count]);
    "vkCmdWriteTimestamp" cmd_write_timestamp(stage: vk::PipelineStageFlags, pool: vk::QueryPool, query: u32), names =>
        Arguments::objects([names.of(pool)]).numbers([query]);
}

noted_of_extensions! {
    "vkCmdBeginRenderPass2" render_pass2.cmd_begin_render_pass2(
        begin: &vk::RenderPassBeginInfo<'_>, contents: &vk::SubpassBeginInfo<'_>
    ), names => Arguments::objects([names.of(begin.render_pass), names.of(begin.framebuffer)]).numbers(rectangle(begin.render_area));
    "vkCmdNextSubpass2" render_pass2.cmd_next_subpass2(
        contents: &vk::SubpassBeginInfo<'_>, end: &vk::SubpassEndInfo<'_>
    ), _names => Arguments::default();
    "vkCmdEndRenderPass2" render_pass2.cmd_end_render_pass2(end: &vk::SubpassEndInfo<'_>), _names => Arguments::default();

    "vkCmdEndRendering" rendering.cmd_end_rendering(), _names => Arguments::default();
    "vkCmdSetRenderingAttachmentLocations" local_read.cmd_set_rendering_attachment_locations(
        locations: &vk::RenderingAttachmentLocationInfoKHR<'_>
    ), _names => Arguments::default();
    "vkCmdSetRenderingInputAttachmentIndices" local_read.cmd_set_rendering_input_attachment_indices(
        indices: &vk::RenderingInputAttachmentIndexInfoKHR<'_>
    ), _names => Arguments::default();
    "vkCmdWriteTimestamp2" synchronization2.cmd_write_timestamp2(stage: vk::PipelineStageFlags2, pool: vk::QueryPool, query: u32), names =>
        Arguments::objects([names.of(pool)]).numbers([query]);
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::path::{Path, PathBuf};

    use super::{NOTED, NOTED_OF_EXTENSIONS};

    /// Functions that are called in one place, where the call is noted.
    const IN_ONE_PLACE: &[&str] = &[
        "cmd_begin_debug_utils_label",
        "cmd_begin_rendering",
        "cmd_end_debug_utils_label",
        "cmd_pipeline_barrier",
        "cmd_pipeline_barrier2",
    ];

    fn sources(folder: &Path) -> Vec<PathBuf> {
        let entries = fs::read_dir(folder).expect("a folder").map(|entry| entry.expect("an entry").path());
        let inside = |path: PathBuf| if path.is_dir() { sources(&path) } else { vec![path] };
        entries.flat_map(inside).collect()
    }

    #[test]
    fn every_command_that_the_program_records_is_noted() {
        let project = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
        let mut called = Vec::new();
        // Passes record in the renderer's own sources, and one formula in the laboratory's.
        for file in ["src", "crates"].iter().flat_map(|root| sources(&project.join(root))) {
            let text = fs::read_to_string(&file).unwrap_or_default();
            // Calls, and not the declarations above. The pattern is not written whole, or it would find itself.
            for after in text.split(concat!(".", "cmd_")).skip(1) {
                let name = after.split(|letter: char| !(letter.is_alphanumeric() || letter == '_')).next();
                called.push(format!("cmd_{}", name.unwrap_or_default()));
            }
        }
        let noted = [NOTED, NOTED_OF_EXTENSIONS].concat();
        let unnoted: Vec<_> = called.iter().filter(|name| !noted.contains(&name.as_str())).collect();
        assert_eq!(unnoted.len(), IN_ONE_PLACE.len(), "{unnoted:?}");
        assert!(unnoted.iter().all(|name| IN_ONE_PLACE.contains(&name.as_str())), "{unnoted:?}");
        let idle: Vec<_> = noted.iter().filter(|name| !called.iter().any(|called| called == *name)).collect();
        assert!(idle.is_empty(), "nobody records {idle:?}");
    }
}
