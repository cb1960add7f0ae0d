//! A frame as the Vulkan commands that were recorded for it, each with its reason.
//!
//! The commands come from the device's journal ([`Device::keep_commands`]); this module decides none of them. It adds the reasons: a label gets the work
//! of its pass, a barrier the reason of its row. The begin of a render pass or of rendering gets the attachments; begin, next subpass and end of a render pass
//! get the subpass dependencies that act there.

use std::sync::Arc;

use afterlight::frame::list;
use afterlight::frame::render_pass::PassDescription;
use afterlight::frame::rows::{self, Row, Rows};
use afterlight::frame::{Error, LayoutChange, Renderer, layout_changes};
use afterlight::gpu::{Command, Device, vk};
use afterlight::plan::FramePlan;
use afterlight::scene::{Playing, Scene, Settings};

/// A recorded command with its reason.
#[derive(Debug, Clone)]
pub struct ExplainedCommand {
    pub command: Command,
    /// The work of a label's pass, or the reason of a barrier's row; empty for other commands.
    pub reason: String,
    /// The attachments of a render pass or of rendering that begins, in its order.
    pub attachments: Vec<Attachment>,
    /// The subpass dependencies that act here. The subpass that begins waits by them; at the end of a render pass, later commands do.
    pub dependencies: Vec<ActingRow>,
}

/// An attachment of a render pass.
#[derive(Debug, Clone)]
pub struct Attachment {
    /// The target, as rows and drawings name it.
    pub name: String,
    /// Format, samples, load, store and layouts: rendering changes no layout, so both are one.
    pub description: vk::AttachmentDescription,
}

/// A subpass dependency, and the layouts that change with it.
#[derive(Debug, Clone)]
pub struct ActingRow {
    pub row: Row,
    pub layouts: Vec<LayoutChange>,
}

/// Records a frame of a scene from its own camera, at the moment of `playing` if it moves, and the copy of its picture for the CPU. Returns their
/// commands. It is the first frame: it draws every shadow map and deforms every mesh, as later frames do only after a change.
///
/// # Errors
/// As [`Renderer::new`], [`Renderer::pose`] and [`Renderer::read_back`].
pub fn record(
    device: &Arc<Device>,
    scene: &Scene,
    settings: &Settings,
    playing: &Playing,
) -> Result<Vec<ExplainedCommand>, Error> {
    // The journal needs the names of all objects, which they get when they are made.
    device.keep_commands();
    let mut renderer = Renderer::new(device, scene, settings)?;
    // Uploads are no part of a frame.
    device.keep_commands();
    let mut camera = scene.camera;
    if scene.moves() {
        let pose = scene.motion.pose(playing);
        renderer.pose(scene, &pose)?;
        camera = scene.looks_through.map_or(camera, |index| pose.camera(scene, index));
    }
    renderer.render(&camera)?;
    renderer.read_back()?;
    let plan = renderer.plan();
    Ok(CommandReader::new(plan, &rows::table(plan)).lines(device.take_commands()))
}

/// Reads commands in their order, and knows the render pass that is open.
struct CommandReader<'a> {
    plan: &'a FramePlan,
    rows: &'a Rows,
    render_passes: Vec<PassDescription>,
    /// The index of the render pass among these, and of its subpass.
    open: Option<(usize, u32)>,
}

impl<'a> CommandReader<'a> {
    fn new(plan: &'a FramePlan, rows: &'a Rows) -> Self {
        Self { plan, rows, render_passes: PassDescription::all(plan, rows), open: None }
    }

    fn lines(mut self, commands: Vec<Command>) -> Vec<ExplainedCommand> {
        commands.into_iter().map(|command| self.line(command)).collect()
    }

    fn line(&mut self, command: Command) -> ExplainedCommand {
        let reason = self.reason(&command);
        let mut line = ExplainedCommand { command, reason, attachments: Vec::new(), dependencies: Vec::new() };
        match line.command.name {
            "vkCmdBeginRenderPass" | "vkCmdBeginRenderPass2" => {
                let place = self.begun(&line.command);
                self.open = place.map(|index| (index, 0));
                line.attachments = place.map_or_else(Vec::new, |index| attachments(&self.render_passes[index]));
                line.dependencies = self.acting(0);
            }
            "vkCmdBeginRendering" => {
                let place = self.begun(&line.command);
                line.attachments = place.map_or_else(Vec::new, |index| rendered(&self.render_passes[index]));
            }
            "vkCmdNextSubpass" | "vkCmdNextSubpass2" => {
                self.open = self.open.map(|(pass, subpass)| (pass, subpass + 1));
                line.dependencies = self.open.map_or_else(Vec::new, |(_, subpass)| self.acting(subpass));
            }
            "vkCmdEndRenderPass" | "vkCmdEndRenderPass2" => {
                line.dependencies = self.acting(vk::SUBPASS_EXTERNAL);
                self.open = None;
            }
            _ => {}
        }
        line
    }

    /// The render pass of the list that a command begins.
    fn begun(&self, command: &Command) -> Option<usize> {
        let name = command.arguments.objects.first()?;
        self.render_passes.iter().position(|own| own.name.is_called(name))
    }

    fn reason(&self, command: &Command) -> String {
        let arguments = &command.arguments;
        if let Some(barrier) = &arguments.barrier {
            let row = self.rows.iter().find(|row| row.label == barrier.row);
            return row.map_or_else(String::new, |row| row.why.clone());
        }
        let label = arguments.objects.first().filter(|_| command.name == "vkCmdBeginDebugUtilsLabelEXT");
        let pass = label.and_then(|label| list::passes().into_iter().find(|pass| pass.name.name() == label));
        pass.map_or_else(String::new, |pass| pass.what.to_owned())
    }

    /// The dependencies of the open render pass that this subpass waits by.
    fn acting(&self, subpass: u32) -> Vec<ActingRow> {
        let Some((pass, _)) = self.open else { return Vec::new() };
        let own = self.render_passes[pass].dependencies.iter().filter(|(_, [_, to])| *to == subpass);
        own.map(|(row, _)| ActingRow { row: row.clone(), layouts: layout_changes(self.plan, self.rows, row) }).collect()
    }
}

fn attachments(pass: &PassDescription) -> Vec<Attachment> {
    let own = pass.attachments.iter();
    own.map(|&(resource, description)| Attachment { name: resource.to_string(), description }).collect()
}

fn rendered(pass: &PassDescription) -> Vec<Attachment> {
    let mut own = attachments(pass);
    for (index, attachment) in own.iter_mut().enumerate() {
        let layout = pass.rendering_layout(index);
        (attachment.description.initial_layout, attachment.description.final_layout) = (layout, layout);
    }
    own
}

/// True of commands that give a frame its structure, of which a listing has each in its place: labels, render passes, rendering, barriers.
pub fn is_structure(command: &Command) -> bool {
    let names = [
        "vkCmdBeginDebugUtilsLabelEXT",
        "vkCmdEndDebugUtilsLabelEXT",
        "vkCmdBeginRenderPass",
        "vkCmdBeginRenderPass2",
        "vkCmdBeginRendering",
        "vkCmdNextSubpass",
        "vkCmdNextSubpass2",
        "vkCmdEndRenderPass",
        "vkCmdEndRenderPass2",
        "vkCmdEndRendering",
        "vkCmdPipelineBarrier",
        "vkCmdPipelineBarrier2",
    ];
    names.contains(&command.name)
}
