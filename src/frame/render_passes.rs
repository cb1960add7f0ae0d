//! The parts that every kind of frame has: the images that it draws into, and its render passes with their framebuffers and clear values.

use std::sync::Arc;

use ash::vk;
use glam::Vec3;

use super::BuildContext;
use super::list::{RenderPassName, SHADOW_PASS, StepList, Subpass};
use super::render_pass::PassDescription;
use super::rows::{Row, RowName, SyncKind};
use crate::gpu::barrier::{self, ImageRange};
use crate::gpu::{self, Device, Framebuffer, RenderPass, Timestamps, framebuffer};
use crate::gpu_scene::ShadowAtlas;
use crate::passes::background::background;
use crate::passes::present;
use crate::passes::{FrameContext, MapRecording, Pass, Slot};
use crate::plan::{FramePlan, Target};
use crate::targets::{Framebuffers, Targets};
use crate::visible::World;

/// The targets of a frame, and the render passes that draw into them.
pub struct RenderPasses {
    pub targets: Targets,
    pub list: StepList,
    passes: Vec<DevicePass>,
    maps: Option<MapPass>,
    present: Option<PresentStage>,
}

/// A render pass on the device.
struct DevicePass {
    name: RenderPassName,
    targets: Vec<Target>,
    /// Some attachment is cleared.
    clears_some: bool,
    pass: RenderPass,
    framebuffers: Framebuffers,
    clears: Vec<vk::ClearValue>,
}

/// The render pass of shadow maps on the device, with a framebuffer for each layer of theirs.
struct MapPass {
    pass: RenderPass,
    layers: Vec<Framebuffer>,
    clears: Vec<vk::ClearValue>,
}

/// PRESENT, with the picture that it copies and the rows of the barriers around it.
struct PresentStage {
    picture: Target,
    /// The image that is shown has the same texels. A compute pass writes its own order of channels.
    is_alike: bool,
    before: Row,
    after: Row,
}

impl RenderPasses {
    /// # Errors
    /// When the device lacks the memory or cannot compile a pipeline, or the list of passes and the rows contradict each other.
    pub fn new(parts: &BuildContext) -> gpu::Result<Self> {
        let &BuildContext { device, plan, rows, world, swapchain, atlas, .. } = parts;
        let list = StepList::of(plan);
        list.check(plan, rows)?;
        let targets = Targets::new(device, plan, |target| list.usage(plan, target))?;
        let mut passes = Vec::new();
        for description in PassDescription::all(plan, rows) {
            let name = description.name;
            if name == SHADOW_PASS {
                continue;
            }
            let pass = description.make(device)?;
            let own = description.targets();
            let framebuffers = targets.framebuffers(plan, (device, &pass), &own, swapchain)?;
            let cleared = |own: &vk::AttachmentDescription| own.load_op == vk::AttachmentLoadOp::CLEAR;
            let clears_some = description.attachments.iter().any(|(_, own)| cleared(own));
            passes.push(DevicePass { name, pass, framebuffers, clears_some, clears: Vec::new(), targets: own });
        }
        let maps = PassDescription::named(plan, rows, SHADOW_PASS).zip(atlas);
        let maps = maps.map(|(own, atlas)| MapPass::new(device, &own, atlas)).transpose()?;
        let row = |name| rows.find(name).cloned();
        let rows = row(RowName::SWAPCHAIN_TO_PRESENT).zip(row(RowName::PRESENT_TO_SWAPCHAIN));
        let present = rows.map(|(before, after)| PresentStage {
            picture: plan.picture(),
            is_alike: !plan.is_tiled(),
            before,
            after,
        });
        let mut made = Self { targets, list, passes, maps, present };
        made.expose(plan, world);
        Ok(made)
    }

    /// Makes the images and framebuffers anew, which have the size of the picture.
    pub fn resize(&mut self, parts: &BuildContext) -> gpu::Result<()> {
        let &BuildContext { device, plan, swapchain, .. } = parts;
        self.targets = Targets::new(device, plan, |target| self.list.usage(plan, target))?;
        for made in &mut self.passes {
            made.framebuffers = self.targets.framebuffers(plan, (device, &made.pass), &made.targets, swapchain)?;
        }
        Ok(())
    }

    /// Re-exposes the background's clear colours.
    pub fn expose(&mut self, plan: &FramePlan, world: &World) {
        for made in self.passes.iter_mut().filter(|made| made.clears_some) {
            made.clears = clear_values(plan, world, &made.targets);
        }
    }

    /// Returns the render pass and the subpass to which a pass's pipelines belong, if the frame has it in a subpass.
    pub fn slot(&self, pass: &Pass) -> Option<Slot> {
        let draws = |name: RenderPassName, subpasses: &[Subpass]| {
            let subpass = subpasses.iter().position(|own| own.passes.iter().any(|one| one.place == pass.place))?;
            let render_pass = match name {
                SHADOW_PASS => self.maps.as_ref()?.pass.raw,
                _ => self.find(name)?.pass.raw,
            };
            Some(Slot { render_pass, subpass: subpass as u32 })
        };
        self.list.render_passes().find_map(|(name, subpasses)| draws(name, subpasses))
    }

    fn find(&self, name: RenderPassName) -> Option<&DevicePass> {
        self.passes.iter().find(|made| made.name == name)
    }

    /// Returns the begin info of a render pass in this frame.
    pub fn begin(&self, frame: &FrameContext, name: RenderPassName) -> Option<vk::RenderPassBeginInfo<'_>> {
        let made = self.find(name)?;
        let begin = vk::RenderPassBeginInfo::default()
            .render_pass(made.pass.raw)
            .framebuffer(made.framebuffers.of(frame.image))
            .render_area(frame.area())
            .clear_values(&made.clears);
        Some(begin)
    }

    /// Returns the begin info of the render pass of shadow maps for one map, where the plan has maps.
    pub fn begin_map(&self, map: &MapRecording) -> Option<vk::RenderPassBeginInfo<'_>> {
        let made = self.maps.as_ref()?;
        let layer = made.layers.get(map.view.tile.layer as usize)?;
        let begin = vk::RenderPassBeginInfo::default()
            .render_pass(made.pass.raw)
            .framebuffer(layer.raw)
            .render_area(map.area())
            .clear_values(&made.clears);
        Some(begin)
    }

    /// Records PRESENT where the plan has it.
    pub fn record_present(&self, frame: &FrameContext, times: &mut Option<Timestamps>) {
        if let (Some(_), Some(image)) = (&self.present, frame.swapchain_image) {
            self.present_into(frame.device, frame.cmd, image);
            Timestamps::stamp(times, frame.cmd, present::PASS.time);
        }
    }

    /// Records the copy of the picture into the image that is shown, outside a render pass, where the plan has it.
    pub fn present_into(&self, device: &Device, cmd: vk::CommandBuffer, (image, extent): (vk::Image, vk::Extent2D)) {
        let Some(stage) = &self.present else { return };
        device.begin_label(cmd, present::PASS.place.name());
        let whole = ImageRange::whole(image, vk::ImageAspectFlags::COLOR);
        // Presentation, or ENCODE, may still have read the image: all of it is written.
        image_barrier(device, cmd, whole, Some(&stage.before));
        let picture = self.targets.image(stage.picture);
        present::record(device, cmd, (picture, stage.is_alike), (image, extent));
        image_barrier(device, cmd, whole, Some(&stage.after));
        device.end_label(cmd);
    }
}

impl MapPass {
    fn new(device: &Arc<Device>, description: &PassDescription, atlas: &ShadowAtlas) -> gpu::Result<Self> {
        let pass = description.make(device)?;
        let layer = |index: usize| {
            let name = format!("shadow framebuffer, layer {index}");
            framebuffer(device, &name, pass.raw, &atlas.layer(index), atlas.maps.image.extent)
        };
        let layers = (0..atlas.maps.layers.len()).map(layer).collect::<gpu::Result<_>>()?;
        Ok(Self { pass, layers, clears: atlas.clears() })
    }
}

/// Carries out a row that is a pipeline barrier on an image, where the plan has it.
pub(super) fn image_barrier(device: &Device, cmd: vk::CommandBuffer, image: impl Into<ImageRange>, row: Option<&Row>) {
    if let Some(row) = row
        && let SyncKind::ImageBarrier(old, new) = row.carrier
    {
        barrier::image_barrier(device, cmd, image, row.order(), [old, new]);
    }
}

/// Clear values of these targets.
fn clear_values(plan: &FramePlan, world: &World, targets: &[Target]) -> Vec<vk::ClearValue> {
    let color = |color: Vec3| vk::ClearValue { color: vk::ClearColorValue { float32: color.extend(1.0).to_array() } };
    targets
        .iter()
        .map(|&target| match target {
            // Reversed Z: infinity.
            Target::Depth | Target::Occluders => {
                vk::ClearValue { depth_stencil: vk::ClearDepthStencilValue { depth: 0.0, stencil: 0 } }
            }
            // Alpha of the sums is 1: no surface has covered anything yet.
            Target::Hdr | Target::Samples | Target::Output => color(background(plan, world, target)),
            // Half rough, and a direction in any encoding: see GEOMETRY.
            Target::Material => color(Vec3::splat(0.5)),
            Target::Normal if plan.format_of(target) == Some(vk::Format::R16G16_UINT) => {
                vk::ClearValue { color: vk::ClearColorValue { uint32: [40_000, 50_000, 0, 0] } }
            }
            Target::Normal => color(Vec3::new(0.3, 0.6, 0.7)),
            // No surface has drawn anything yet.
            Target::OfSurfaces(_) => vk::ClearValue::default(),
            _ => color(Vec3::ZERO),
        })
        .collect()
}
