//! The object of a pass on the device: made, recorded and made anew by the same loop for all passes ([`crate::frame`]).

use std::sync::Arc;

use ash::vk;

use super::screen::InputDescriptor;
use super::{FrameContext, ImageBinding, Pass, Resource, ResourceUse, SetLayouts, Slot, UseKind};
use crate::gpu::{self, Buffer, Device};
use crate::gpu_scene::{CullingBuffers, GpuScene, PoseBuffer, ShadowAtlas, VisibilityLookup};
use crate::plan::FramePlan;
use crate::targets::Targets;
use crate::visible::{Visible, World};

/// Makes the object of a pass.
pub type Make = fn(&Making) -> gpu::Result<Box<dyn PassRecorder>>;

/// The object of a pass, as its [`Pass::make`] makes it.
pub trait PassRecorder: Send + Sync {
    /// Records the pass: inside its subpass, or outside of render passes between its barriers.
    fn record(&self, context: &FrameContext);

    /// Reads and writes other images, as of another size of the picture.
    ///
    /// # Errors
    /// When the device lacks the memory.
    fn rebind(&mut self, _: &Making) -> gpu::Result<()> {
        Ok(())
    }

    /// Writes the pass's own data for one frame in flight. The frame that used it before must be done.
    ///
    /// # Errors
    /// When mapped memory cannot be flushed.
    fn write(&self, _place: usize, _: &Visible) -> gpu::Result<()> {
        Ok(())
    }

    /// Re-exposes the background, where the pass writes it.
    fn expose(&mut self, _: &FramePlan, _: &World) {}

    /// The buffers that the pass has made, by the resource that later passes know them as.
    fn buffers(&self) -> Vec<(Resource, &Buffer)> {
        Vec::new()
    }
}

/// An object on the device, with its pass.
pub struct PassObject {
    pub pass: &'static Pass,
    pub object: Box<dyn PassRecorder>,
}

/// All that the object of a pass is made from.
pub struct Making<'a> {
    pub device: &'a Arc<Device>,
    pub plan: &'a FramePlan,
    pub layouts: SetLayouts,
    pub targets: &'a Targets,
    pub scene: &'a GpuScene,
    pub world: &'a World,
    /// The shadow maps, where the plan has some.
    pub atlas: Option<&'a ShadowAtlas>,
    /// The poses of the frames in flight, in their order, where the plan deforms objects.
    pub poses: &'a [PoseBuffer],
    /// Present where the plan culls on the device.
    pub culling: Option<&'a CullingBuffers>,
    /// Present where TILED looks up the surfaces that pixels show.
    pub seen: Option<&'a VisibilityLookup>,
    pub in_flight: usize,
    /// The pass.
    pub pass: &'static Pass,
    /// The touches of its subpass, or its own outside of render passes.
    pub touches: Vec<ResourceUse>,
    /// Render pass and subpass of a pass that draws.
    pub in_render_pass: Option<Slot>,
    /// The objects of the passes before it.
    pub before: &'a [PassObject],
}

impl<'a> Making<'a> {
    /// The place of the pass in a render pass.
    ///
    /// # Errors
    /// When the list of the frame has it in none.
    pub fn slot(&self) -> gpu::Result<&Slot> {
        self.in_render_pass
            .as_ref()
            .ok_or_else(|| gpu::Error::Misuse(format!("the frame has no subpass for {}", self.pass.name)))
    }

    /// A part that the plan of this pass cannot be without.
    ///
    /// # Errors
    /// When it is missing.
    pub fn needed<T>(&self, part: Option<T>) -> gpu::Result<T> {
        part.ok_or_else(|| gpu::Error::Misuse(format!("{} lacks a part of its plan", self.pass.name)))
    }

    /// The targets that the passes of its subpass read, at their bindings.
    pub fn inputs(&self) -> Vec<InputDescriptor> {
        let all = self.touches.iter().filter_map(|touch| match (touch.how, touch.resource) {
            (UseKind::Input { binding } | UseKind::Sampled { binding }, Resource::Target(target)) => {
                Some((binding, self.targets.image(target).view, touch.layout()))
            }
            _ => None,
        });
        all.collect()
    }

    /// The images that the pass reads and stores to, at its bindings.
    pub fn images(&self) -> Vec<ImageBinding> {
        let all = self.touches.iter().filter_map(|touch| {
            let Resource::Target(target) = touch.resource else { return None };
            let image = self.targets.image(target);
            match touch.how {
                UseKind::Sampled { binding } => {
                    Some((binding, image.view, touch.layout(), vk::DescriptorType::SAMPLED_IMAGE))
                }
                UseKind::Storage { binding } => {
                    Some((binding, image.storage_view, touch.layout(), vk::DescriptorType::STORAGE_IMAGE))
                }
                _ => None,
            }
        });
        all.collect()
    }

    /// The buffers that passes before this one have made of a resource.
    pub fn buffers(&self, resource: Resource) -> impl Iterator<Item = &'a Buffer> + use<'a> {
        buffers(self.before, resource)
    }

    /// The first of them.
    ///
    /// # Errors
    /// When there is none.
    pub fn buffer(&self, resource: Resource) -> gpu::Result<&'a Buffer> {
        self.needed(self.buffers(resource).next())
    }
}

/// The buffers that objects have made of a resource.
pub fn buffers(objects: &[PassObject], resource: Resource) -> impl Iterator<Item = &Buffer> {
    let all = objects.iter().flat_map(|made| made.object.buffers());
    all.filter_map(move |(own, buffer)| (own == resource).then_some(buffer))
}
