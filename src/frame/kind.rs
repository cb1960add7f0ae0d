//! The kinds of frame that plans make.

use std::sync::Arc;

use ash::vk;

use super::deferred::Deferred;
use super::edges::Edges;
use super::tiled::TiledFrame;
use crate::gpu::{self, Device, Image, Timestamps};
use crate::gpu_scene::{Culling, GpuScene, PoseBuffer, Seen, ShadowAtlas};
use crate::passes::{Recording, SetLayouts};
use crate::plan::FramePlan;
use crate::visible::{Visible, World};

/// The kind of frame that a plan makes.
pub(super) enum Frame {
    Deferred(Box<Deferred>),
    Tiled(Box<TiledFrame>),
}

/// The inputs from which frames are made.
#[derive(Clone, Copy)]
pub(crate) struct FrameParts<'a> {
    pub device: &'a Arc<Device>,
    pub plan: &'a FramePlan,
    /// Every stage, access and layout of its dependencies.
    pub edges: &'a Edges,
    /// The layout of set 0.
    pub frame_layout: vk::DescriptorSetLayout,
    /// The shadow maps, if the plan has any.
    pub atlas: Option<&'a ShadowAtlas>,
    pub scene: &'a GpuScene,
    pub world: &'a World,
    /// The poses of the frames in flight, in their order, if the plan deforms objects.
    pub poses: &'a [PoseBuffer],
    /// Present if the plan culls on the device.
    pub culling: Option<&'a Culling>,
    /// Present if TILED looks up the surfaces that pixels show.
    pub seen: Option<&'a Seen>,
    /// Views of the swapchain's images; none where pictures are not presented.
    pub swapchain: &'a [vk::ImageView],
}

impl FrameParts<'_> {
    /// The layouts of sets 0 and 2.
    pub(super) fn layouts(&self) -> SetLayouts {
        SetLayouts { frame: self.frame_layout, shadows: self.atlas.map(|atlas| atlas.set_layout.raw) }
    }
}

impl Frame {
    pub(super) fn new(parts: &FrameParts) -> gpu::Result<Self> {
        Ok(match parts.plan.is_tiled() {
            true => Self::Tiled(Box::new(TiledFrame::new(parts)?)),
            false => Self::Deferred(Box::new(Deferred::new(parts)?)),
        })
    }

    /// The fog's froxels, which set 0 names, where the plan has some.
    pub(super) fn froxels(&self) -> Option<&gpu::Buffer> {
        match self {
            Self::Deferred(frame) => frame.froxels(),
            Self::Tiled(_) => None,
        }
    }

    /// Makes the objects of the picture's size anew.
    #[cfg(feature = "present")]
    pub(super) fn resize(&mut self, parts: &FrameParts) -> gpu::Result<()> {
        match self {
            Self::Deferred(frame) => frame.resize(parts),
            Self::Tiled(frame) => frame.resize(parts),
        }
    }

    /// Re-exposes the background's clear colours.
    pub(super) fn expose(&mut self, plan: &FramePlan, world: &World) {
        match self {
            Self::Deferred(frame) => frame.expose(plan, world),
            Self::Tiled(frame) => frame.expose(plan, world),
        }
    }

    /// Writes what the passes of one frame in flight read of their own. The frame that used it before must be done.
    pub(super) fn write(&self, place: usize, visible: &Visible) -> gpu::Result<()> {
        match self {
            Self::Deferred(frame) => frame.write(place, visible),
            Self::Tiled(_) => Ok(()),
        }
    }

    pub(super) fn record(&self, recording: &Recording, times: &mut Option<Timestamps>) {
        match self {
            Self::Deferred(frame) => frame.record(recording, times),
            Self::Tiled(frame) => frame.record(recording, times),
        }
    }

    /// Records PRESENT once more, for a picture that lies where the last frame left it.
    #[cfg(feature = "present")]
    pub(super) fn present_again(&self, device: &Device, cmd: vk::CommandBuffer, image: (vk::Image, vk::Extent2D)) {
        match self {
            Self::Deferred(frame) => frame.passes.present_into(device, cmd, image),
            Self::Tiled(frame) => frame.passes.present_into(device, cmd, image),
        }
    }

    /// The picture, in TRANSFER_SRC_OPTIMAL after the frame, unless it is in an image of the swapchain.
    pub(super) fn output(&self, plan: &FramePlan) -> Option<&Image> {
        match self {
            Self::Deferred(frame) => frame.output(plan),
            Self::Tiled(frame) => frame.output(plan),
        }
    }
}
