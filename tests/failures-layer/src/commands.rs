//! Writes the commands that a program records into the file that `AFTERLIGHT_COMMANDS` names, a line for each `vkCmd*`.
//!
//! A line has the names of the command buffer and of the command, then names of objects in quotes, then numbers. A barrier has its parts below it. A render
//! pass has its attachments below its begin, and the subpass dependencies below the command at which they act. A command that is not in this table is hidden, so
//! that a program which records it ends, instead of recording what nobody reads.

use std::collections::HashMap;
use std::ffi::CStr;
use std::fmt::{Debug, Write as _};
use std::fs::File;
use std::io::Write as _;
use std::sync::{LazyLock, Mutex, MutexGuard, PoisonError};

use ash::vk::{self, Handle};

use crate::chain::{by_either_name, next};
use crate::loader::typed;
use crate::table;

/// The variable that names the file.
const VARIABLE: &str = "AFTERLIGHT_COMMANDS";

/// The attachments of a render pass as lines, and its dependencies as pairs of the waiting subpass and a line.
#[derive(Clone, Default)]
struct RenderPass {
    attachments: Vec<String>,
    dependencies: Vec<(u32, String)>,
}

impl RenderPass {
    fn of(info: &vk::RenderPassCreateInfo<'_>) -> Self {
        // SAFETY: both lists are as long as their counts say (specification, VkRenderPassCreateInfo).
        let (attachments, dependencies) = unsafe {
            (list(info.p_attachments, info.attachment_count), list(info.p_dependencies, info.dependency_count))
        };
        let attachment = |own: &vk::AttachmentDescription| {
            let vk::AttachmentDescription { format, samples, load_op, store_op, initial_layout, final_layout, .. } =
                own;
            let samples = samples.as_raw();
            format!("  attachment {format:?} {samples} {load_op:?} {store_op:?} {initial_layout:?} {final_layout:?}")
        };
        let dependency = |own: &vk::SubpassDependency| {
            let [before, after] = [own.src_stage_mask, own.dst_stage_mask].map(flags);
            let [writes, uses] = [own.src_access_mask, own.dst_access_mask].map(flags);
            let by_region = own.dependency_flags.contains(vk::DependencyFlags::BY_REGION);
            (own.dst_subpass, format!("  dependency {before} / {writes} / {after} / {uses} / {by_region}"))
        };
        Self {
            attachments: attachments.iter().map(attachment).collect(),
            dependencies: dependencies.iter().map(dependency).collect(),
        }
    }

    /// Reads the structures of VK_KHR_create_renderpass2. A dependency's masks stand in the VkMemoryBarrier2 of its chain, if it has one.
    fn of_2(info: &vk::RenderPassCreateInfo2<'_>) -> Self {
        // SAFETY: both lists are as long as their counts say (specification, VkRenderPassCreateInfo2).
        let (attachments, dependencies) = unsafe {
            (list(info.p_attachments, info.attachment_count), list(info.p_dependencies, info.dependency_count))
        };
        let attachment = |own: &vk::AttachmentDescription2<'_>| {
            let vk::AttachmentDescription2 { format, samples, load_op, store_op, initial_layout, final_layout, .. } =
                own;
            let samples = samples.as_raw();
            format!("  attachment {format:?} {samples} {load_op:?} {store_op:?} {initial_layout:?} {final_layout:?}")
        };
        let dependency = |own: &vk::SubpassDependency2<'_>| {
            // SAFETY: the chain is null, or its first structure is a barrier: the only one that may extend a dependency, and all structures begin with their type.
            let barrier = unsafe { own.p_next.cast::<vk::MemoryBarrier2<'_>>().as_ref() };
            let barrier = barrier.filter(|own| own.s_type == vk::StructureType::MEMORY_BARRIER_2);
            let masks = barrier.map_or_else(
                || {
                    let [before, after] = [own.src_stage_mask, own.dst_stage_mask].map(flags);
                    let [writes, uses] = [own.src_access_mask, own.dst_access_mask].map(flags);
                    format!("{before} / {writes} / {after} / {uses}")
                },
                |own| {
                    let [before, after] = [own.src_stage_mask, own.dst_stage_mask].map(stages);
                    let [writes, uses] = [own.src_access_mask, own.dst_access_mask].map(flags);
                    format!("{before} / {writes} / {after} / {uses}")
                },
            );
            let by_region = own.dependency_flags.contains(vk::DependencyFlags::BY_REGION);
            (own.dst_subpass, format!("  dependency {masks} / {by_region}"))
        };
        Self {
            attachments: attachments.iter().map(attachment).collect(),
            dependencies: dependencies.iter().map(dependency).collect(),
        }
    }

    fn acting(&self, subpass: u32) -> String {
        let own = self.dependencies.iter().filter(|(to, _)| *to == subpass);
        own.fold(String::new(), |text, (_, line)| text + line + "\n")
    }
}

/// All that the lines of commands need of earlier calls.
struct Log {
    file: File,
    names: HashMap<(vk::ObjectType, u64), String>,
    render_passes: HashMap<vk::RenderPass, RenderPass>,
    /// The open render pass of each command buffer, and its subpass.
    open: HashMap<vk::CommandBuffer, (vk::RenderPass, u32)>,
}

static LOG: LazyLock<Option<Mutex<Log>>> = LazyLock::new(|| {
    let path = std::env::var_os(VARIABLE)?;
    let file = File::create(&path).inspect_err(|error| eprintln!("VK_LAYER_AFTERLIGHT_failures: {VARIABLE}: {error}"));
    let (names, render_passes, open) = Default::default();
    Some(Mutex::new(Log { file: file.ok()?, names, render_passes, open }))
});

fn log() -> Option<MutexGuard<'static, Log>> {
    LOG.as_ref().map(|log| log.lock().unwrap_or_else(PoisonError::into_inner))
}

impl Log {
    fn name<H: Handle>(&self, object: H) -> String {
        self.names.get(&(H::TYPE, object.as_raw())).cloned().unwrap_or_else(|| "?".into())
    }

    fn begin(&mut self, cmd: vk::CommandBuffer, begin: &vk::RenderPassBeginInfo<'_>) -> Said {
        self.open.insert(cmd, (begin.render_pass, 0));
        let pass = self.render_passes.get(&begin.render_pass).cloned().unwrap_or_default();
        let attachments = pass.attachments.iter().map(|line| format!("{line}\n")).collect::<String>();
        let said = said([self.name(begin.render_pass), self.name(begin.framebuffer)], rectangle(&begin.render_area));
        Said { below: attachments + &pass.acting(0), ..said }
    }

    fn next_subpass(&mut self, cmd: vk::CommandBuffer) -> Said {
        let (pass, subpass) = self.open.get(&cmd).copied().unwrap_or_default();
        self.open.insert(cmd, (pass, subpass + 1));
        Said { below: self.acting(pass, subpass + 1), ..Said::default() }
    }

    fn end(&mut self, cmd: vk::CommandBuffer) -> Said {
        let (pass, _) = self.open.remove(&cmd).unwrap_or_default();
        Said { below: self.acting(pass, vk::SUBPASS_EXTERNAL), ..Said::default() }
    }

    fn acting(&self, pass: vk::RenderPass, subpass: u32) -> String {
        self.render_passes.get(&pass).map_or_else(String::new, |own| own.acting(subpass))
    }

    fn write(&mut self, cmd: vk::CommandBuffer, command: &str, Said { objects, numbers, below }: Said) {
        let mut line = format!("{}: {command}", self.name(cmd));
        objects.iter().for_each(|object| _ = write!(line, " \"{object}\""));
        numbers.iter().for_each(|number| _ = write!(line, " {number}"));
        // A file that cannot be written has too few lines, which its reader notices.
        let _ = self.file.write_all(format!("{line}\n{below}").as_bytes());
    }
}

/// The arguments of a command, and the lines below it.
#[derive(Default)]
struct Said {
    objects: Vec<String>,
    numbers: Vec<i64>,
    below: String,
}

fn said(objects: impl IntoIterator<Item = String>, numbers: impl IntoIterator<Item = i64>) -> Said {
    Said { objects: objects.into_iter().collect(), numbers: numbers.into_iter().collect(), below: String::new() }
}

/// The bits' names; a dash when there are none.
fn flags(flags: impl Debug) -> String {
    let text = format!("{flags:?}");
    if text.is_empty() { "-".to_owned() } else { text }
}

/// The names of stages of synchronization2, of which the older API has some under other names.
fn stages(stages: vk::PipelineStageFlags2) -> String {
    flags(stages).replace("ALL_TRANSFER", "TRANSFER")
}

/// The elements of an array of Vulkan.
///
/// # Safety
/// The array has `count` elements, which live as long as the caller's call.
unsafe fn list<'a, T>(first: *const T, count: u32) -> &'a [T] {
    // SAFETY: the caller's promise.
    if count == 0 || first.is_null() { &[] } else { unsafe { std::slice::from_raw_parts(first, count as usize) } }
}

fn rectangle(vk::Rect2D { offset, extent }: &vk::Rect2D) -> [i64; 4] {
    [offset.x.into(), offset.y.into(), extent.width.into(), extent.height.into()]
}

/// Declares the functions of commands. The expression after `=>` makes the line; it stands in an unsafe block, because it reads the command's pointers.
macro_rules! logged {
    ($($name:ident: $pfn:ident($($argument:ident: $type:ty),*), $log:ident $cmd:ident => $said:expr;)*) => {
        /// The commands' names as C has them; true, because all are functions of a device.
        pub const NAMES: &[(&CStr, bool)] = &[$((c_name!($name), true)),*];

        #[allow(non_snake_case, unused_variables, clippy::too_many_arguments)]
        mod functions {
            use super::*;

            $(pub unsafe extern "system" fn $name($cmd: vk::CommandBuffer $(, $argument: $type)*) {
                // SAFETY: the arguments are valid as the specification has it; the type of the function is that of the name.
                unsafe {
                    if let Some(mut guard) = log() {
                        let $log = &mut *guard;
                        let said = $said;
                        $log.write($cmd, stringify!($name), said);
                    }
                    if let Some(function) = next::<vk::$pfn>($cmd, c_name!($name)) {
                        function($cmd $(, $argument)*);
                    }
                }
            })*
        }

        fn command(name: &CStr) -> vk::PFN_vkVoidFunction {
            match name.to_bytes() {
                $(own if own == stringify!($name).as_bytes() => untyped!(functions::$name, vk::$pfn),)*
                _ => None,
            }
        }
    };
}

logged! {
    vkCmdBeginDebugUtilsLabelEXT: PFN_vkCmdBeginDebugUtilsLabelEXT(label: *const vk::DebugUtilsLabelEXT<'_>), log cmd =>
        said([CStr::from_ptr((*label).p_label_name).to_string_lossy().into_owned()], []);
    vkCmdEndDebugUtilsLabelEXT: PFN_vkCmdEndDebugUtilsLabelEXT(), log cmd => Said::default();
    vkCmdBeginRenderPass: PFN_vkCmdBeginRenderPass(begin: *const vk::RenderPassBeginInfo<'_>, contents: vk::SubpassContents), log cmd =>
        log.begin(cmd, &*begin);
    vkCmdBeginRenderPass2: PFN_vkCmdBeginRenderPass2(
        begin: *const vk::RenderPassBeginInfo<'_>, contents: *const vk::SubpassBeginInfo<'_>
    ), log cmd => log.begin(cmd, &*begin);
    vkCmdNextSubpass: PFN_vkCmdNextSubpass(contents: vk::SubpassContents), log cmd => log.next_subpass(cmd);
    vkCmdNextSubpass2: PFN_vkCmdNextSubpass2(contents: *const vk::SubpassBeginInfo<'_>, end: *const vk::SubpassEndInfo<'_>), log cmd =>
        log.next_subpass(cmd);
    vkCmdEndRenderPass: PFN_vkCmdEndRenderPass(), log cmd => log.end(cmd);
    vkCmdEndRenderPass2: PFN_vkCmdEndRenderPass2(end: *const vk::SubpassEndInfo<'_>), log cmd => log.end(cmd);
    vkCmdPipelineBarrier: PFN_vkCmdPipelineBarrier(
        before: vk::PipelineStageFlags, after: vk::PipelineStageFlags, how: vk::DependencyFlags,
        memory_count: u32, memory: *const vk::MemoryBarrier<'_>,
        buffer_count: u32, buffers: *const vk::BufferMemoryBarrier<'_>,
        image_count: u32, images: *const vk::ImageMemoryBarrier<'_>
    ), log cmd => {
        let mut below = format!("  stages {} / {}\n", flags(before), flags(after));
        let mut part = |object: &str, [writes, uses]: [vk::AccessFlags; 2], layouts: &str| {
            let _ = writeln!(below, "  {object} {} / {}{layouts}", flags(writes), flags(uses));
        };
        for own in list(memory, memory_count) {
            part("memory", [own.src_access_mask, own.dst_access_mask], "");
        }
        for own in list(buffers, buffer_count) {
            part(&format!("\"{}\"", log.name(own.buffer)), [own.src_access_mask, own.dst_access_mask], "");
        }
        for own in list(images, image_count) {
            let layouts = format!(" / {:?} / {:?}", own.old_layout, own.new_layout);
            part(&format!("\"{}\"", log.name(own.image)), [own.src_access_mask, own.dst_access_mask], &layouts);
        }
        Said { below, ..Said::default() }
    };
    vkCmdPipelineBarrier2: PFN_vkCmdPipelineBarrier2(info: *const vk::DependencyInfo<'_>), log cmd => {
        let info = &*info;
        let mut below = String::new();
        let mut part = |object: &str, [before, after]: [vk::PipelineStageFlags2; 2], [writes, uses]: [vk::AccessFlags2; 2], layouts: &str| {
            // The program's barriers have the same stages in all parts.
            if below.is_empty() {
                below = format!("  stages {} / {}\n", stages(before), stages(after));
            }
            let _ = writeln!(below, "  {object} {} / {}{layouts}", flags(writes), flags(uses));
        };
        for own in list(info.p_memory_barriers, info.memory_barrier_count) {
            let stages = [own.src_stage_mask, own.dst_stage_mask];
            part("memory", stages, [own.src_access_mask, own.dst_access_mask], "");
        }
        for own in list(info.p_buffer_memory_barriers, info.buffer_memory_barrier_count) {
            let stages = [own.src_stage_mask, own.dst_stage_mask];
            part(&format!("\"{}\"", log.name(own.buffer)), stages, [own.src_access_mask, own.dst_access_mask], "");
        }
        for own in list(info.p_image_memory_barriers, info.image_memory_barrier_count) {
            let stages = [own.src_stage_mask, own.dst_stage_mask];
            let layouts = format!(" / {:?} / {:?}", own.old_layout, own.new_layout);
            part(&format!("\"{}\"", log.name(own.image)), stages, [own.src_access_mask, own.dst_access_mask], &layouts);
        }
        Said { below, ..Said::default() }
    };

    vkCmdBindPipeline: PFN_vkCmdBindPipeline(point: vk::PipelineBindPoint, pipeline: vk::Pipeline), log cmd => said([log.name(pipeline)], []);
    vkCmdBindDescriptorSets: PFN_vkCmdBindDescriptorSets(
        point: vk::PipelineBindPoint, layout: vk::PipelineLayout, first: u32, count: u32, sets: *const vk::DescriptorSet,
        offset_count: u32, offsets: *const u32
    ), log cmd => said(list(sets, count).iter().map(|&set| log.name(set)), [first.into()]);
    vkCmdBindVertexBuffers: PFN_vkCmdBindVertexBuffers(
        first: u32, count: u32, buffers: *const vk::Buffer, offsets: *const vk::DeviceSize
    ), log cmd => said(
        list(buffers, count).iter().map(|&buffer| log.name(buffer)),
        [i64::from(first)].into_iter().chain(list(offsets, count).iter().map(|&offset| offset as i64))
    );
    vkCmdBindIndexBuffer: PFN_vkCmdBindIndexBuffer(buffer: vk::Buffer, offset: vk::DeviceSize, width: vk::IndexType), log cmd =>
        said([log.name(buffer)], [offset as i64]);
    vkCmdPushConstants: PFN_vkCmdPushConstants(
        layout: vk::PipelineLayout, stages: vk::ShaderStageFlags, offset: u32, size: u32, values: *const std::ffi::c_void
    ), log cmd => said([], [offset.into(), size.into()]);
    vkCmdSetViewport: PFN_vkCmdSetViewport(first: u32, count: u32, viewports: *const vk::Viewport), log cmd =>
        said([], list(viewports, count).iter().flat_map(|own| [own.x, own.y, own.width, own.height].map(|edge| edge as i64)));
    vkCmdSetScissor: PFN_vkCmdSetScissor(first: u32, count: u32, scissors: *const vk::Rect2D), log cmd =>
        said([], list(scissors, count).iter().flat_map(rectangle));
    vkCmdSetDepthBias: PFN_vkCmdSetDepthBias(constant: f32, clamp: f32, slope: f32), log cmd => Said::default();

    vkCmdDraw: PFN_vkCmdDraw(vertices: u32, instances: u32, first_vertex: u32, first_instance: u32), log cmd =>
        said([], [vertices, instances, first_vertex, first_instance].map(i64::from));
    vkCmdDrawIndexed: PFN_vkCmdDrawIndexed(
        indices: u32, instances: u32, first_index: u32, vertex_offset: i32, first_instance: u32
    ), log cmd => said([], [indices.into(), instances.into(), first_index.into(), vertex_offset.into(), first_instance.into()]);
    vkCmdDrawIndexedIndirect: PFN_vkCmdDrawIndexedIndirect(
        buffer: vk::Buffer, offset: vk::DeviceSize, draws: u32, stride: u32
    ), log cmd => said([log.name(buffer)], [offset as i64, draws.into(), stride.into()]);
    vkCmdDispatch: PFN_vkCmdDispatch(x: u32, y: u32, z: u32), log cmd => said([], [x, y, z].map(i64::from));

    vkCmdCopyBuffer: PFN_vkCmdCopyBuffer(from: vk::Buffer, to: vk::Buffer, count: u32, regions: *const vk::BufferCopy), log cmd =>
        said([log.name(from), log.name(to)], [count.into()]);
    vkCmdCopyBufferToImage: PFN_vkCmdCopyBufferToImage(
        from: vk::Buffer, to: vk::Image, layout: vk::ImageLayout, count: u32, regions: *const vk::BufferImageCopy
    ), log cmd => said([log.name(from), log.name(to)], [count.into()]);
    vkCmdCopyImage: PFN_vkCmdCopyImage(
        from: vk::Image, old: vk::ImageLayout, to: vk::Image, new: vk::ImageLayout, count: u32, regions: *const vk::ImageCopy
    ), log cmd => said([log.name(from), log.name(to)], [count.into()]);
    vkCmdCopyImageToBuffer: PFN_vkCmdCopyImageToBuffer(
        from: vk::Image, layout: vk::ImageLayout, to: vk::Buffer, count: u32, regions: *const vk::BufferImageCopy
    ), log cmd => said([log.name(from), log.name(to)], [count.into()]);
    vkCmdBlitImage: PFN_vkCmdBlitImage(
        from: vk::Image, old: vk::ImageLayout, to: vk::Image, new: vk::ImageLayout, count: u32, regions: *const vk::ImageBlit, filter: vk::Filter
    ), log cmd => said([log.name(from), log.name(to)], [count.into()]);
    vkCmdClearDepthStencilImage: PFN_vkCmdClearDepthStencilImage(
        image: vk::Image, layout: vk::ImageLayout, value: *const vk::ClearDepthStencilValue, count: u32, ranges: *const vk::ImageSubresourceRange
    ), log cmd => said([log.name(image)], [count.into()]);

    vkCmdResetQueryPool: PFN_vkCmdResetQueryPool(pool: vk::QueryPool, first: u32, count: u32), log cmd =>
        said([log.name(pool)], [first.into(), count.into()]);
    vkCmdWriteTimestamp: PFN_vkCmdWriteTimestamp(stage: vk::PipelineStageFlags, pool: vk::QueryPool, query: u32), log cmd =>
        said([log.name(pool)], [query.into()]);
    vkCmdWriteTimestamp2: PFN_vkCmdWriteTimestamp2(stage: vk::PipelineStageFlags2, pool: vk::QueryPool, query: u32), log cmd =>
        said([log.name(pool)], [query.into()]);
}

/// Defines functions that create a render pass and keep the parts that the commands' lines need. Failing and counting is left to the table's
/// functions.
macro_rules! creates_render_passes {
    ($($function:ident: $name:ident $pfn:ident($info:ty), $of:expr;)*) => {$(
        unsafe extern "system" fn $function(
            device: vk::Device,
            info: *const $info,
            allocator: *const vk::AllocationCallbacks<'_>,
            pass: *mut vk::RenderPass,
        ) -> vk::Result {
            // SAFETY: as this function was called; the type is that of the name, and the render pass is written where that succeeds.
            unsafe {
                let Some(create) = typed::<vk::$pfn>(table::fallible(c_name!($name))) else {
                    return vk::Result::ERROR_INITIALIZATION_FAILED;
                };
                let result = create(device, info, allocator, pass);
                if let (vk::Result::SUCCESS, Some(mut log)) = (result, log()) {
                    log.render_passes.insert(pass.read(), $of(&*info));
                }
                result
            }
        }
    )*};
}

creates_render_passes! {
    create_render_pass: vkCreateRenderPass PFN_vkCreateRenderPass(vk::RenderPassCreateInfo<'_>), RenderPass::of;
    create_render_pass2: vkCreateRenderPass2 PFN_vkCreateRenderPass2(vk::RenderPassCreateInfo2<'_>), RenderPass::of_2;
}

unsafe extern "system" fn name_object(
    device: vk::Device,
    info: *const vk::DebugUtilsObjectNameInfoEXT<'_>,
) -> vk::Result {
    // SAFETY: as this function was called; the type is that of the name.
    unsafe {
        if let Some(mut log) = log() {
            let info = &*info;
            let name = CStr::from_ptr(info.p_object_name).to_string_lossy().into_owned();
            log.names.insert((info.object_type, info.object_handle), name);
        }
        match next::<vk::PFN_vkSetDebugUtilsObjectNameEXT>(device, c"vkSetDebugUtilsObjectNameEXT") {
            Some(name) => name(device, info),
            None => vk::Result::SUCCESS,
        }
    }
}

/// This module's function of that name, if commands are written and it has one.
pub fn own(name: &CStr) -> vk::PFN_vkVoidFunction {
    LOG.as_ref()?;
    match name.to_bytes() {
        b"vkCreateRenderPass" => untyped!(create_render_pass, vk::PFN_vkCreateRenderPass),
        b"vkCreateRenderPass2" => untyped!(create_render_pass2, vk::PFN_vkCreateRenderPass2),
        b"vkSetDebugUtilsObjectNameEXT" => untyped!(name_object, vk::PFN_vkSetDebugUtilsObjectNameEXT),
        _ => command(name),
    }
}

/// Returns true for a command that would be recorded without a line: programs do not get it.
pub fn hides(name: &CStr) -> bool {
    LOG.is_some() && name.to_bytes().starts_with(b"vkCmd") && by_either_name(name, command).is_none()
}
