//! The ways in which Vulkan carries a frame's passes: render passes or rendering, the API of barriers, the layouts of images, the queues. The picture is the same.

use super::{Capabilities, FramePlan, PlanError, Refusal};
use crate::gpu::sync::{Layouts, SyncVersion};
use crate::scene::{self, ImageLayouts, Passes, Settings, SyncApi};

/// Colour attachments of one `vkCmdBeginRendering`: as many as Vulkan 1.4 promises.
pub(crate) const RENDERED_COLORS: u32 = 8;

/// # Errors
/// When the device lacks what is asked for.
pub(super) fn layouts(settings: &Settings, device: &Capabilities) -> Result<Layouts, PlanError> {
    match settings.layouts {
        ImageLayouts::Optimal => Ok(Layouts::Optimal),
        ImageLayouts::Unified if device.unified_layouts => Ok(Layouts::Unified),
        ImageLayouts::Unified => {
            let why = "this device lacks VK_KHR_unified_image_layouts, so that images in GENERAL may cost time, and layers say so: ask for --layouts optimal";
            Err(Refusal::of("--layouts unified", why))
        }
    }
}

/// # Errors
/// When the device lacks what is asked for.
pub(super) fn sync(settings: &Settings, device: &Capabilities) -> Result<SyncVersion, PlanError> {
    match settings.sync {
        SyncApi::One => Ok(SyncVersion::One),
        SyncApi::Two if device.synchronization2 => Ok(SyncVersion::Two),
        SyncApi::Two => {
            let why = "it needs VK_KHR_synchronization2 and VK_KHR_create_renderpass2, and this device does not have both: ask for --sync 1";
            Err(Refusal::of("--sync 2", why))
        }
    }
}

/// The queues beside the first that a plan uses.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Hash)]
pub struct OtherQueues {
    /// One that computes and does not draw.
    pub compute: bool,
    /// One that only copies.
    pub transfer: bool,
}

/// # Errors
/// When the device has no queue beside the first.
pub(super) fn queues(settings: &Settings, device: &Capabilities) -> Result<OtherQueues, PlanError> {
    let own = OtherQueues { compute: device.compute_queue, transfer: device.transfer_queue };
    match settings.queues {
        scene::Queues::One => Ok(OtherQueues::default()),
        scene::Queues::All if own != OtherQueues::default() => Ok(own),
        scene::Queues::All => {
            let why = "this device has no queue beside the first that computes or copies alone, with VK_KHR_timeline_semaphore: ask for --queues one";
            Err(Refusal::of("--queues all", why))
        }
    }
}

impl FramePlan {
    /// Returns true if ambient occlusion is computed on a queue of its own.
    pub fn computes_beside(&self) -> bool {
        self.queues.compute && self.has_ao()
    }
}

/// Refuses local read on devices without it. What the frame's draws read, their list knows (`src/frame/list/local_read.rs`).
pub(super) fn check_passes(plan: &FramePlan, device: &Capabilities) -> Result<(), PlanError> {
    if plan.passes != Passes::LocalRead {
        return Ok(());
    }
    let refuse = |why: &str| Err(Refusal::of("--passes local-read", format!("{why}: ask for --passes subpasses")));
    if !device.local_read {
        return refuse(
            "it needs VK_KHR_dynamic_rendering_local_read, and blend states that differ from attachment to attachment (independentBlend), and this device does not have both",
        );
    }
    if device.max_color_attachments < RENDERED_COLORS {
        let most = device.max_color_attachments;
        return refuse(&format!(
            "it draws with up to {RENDERED_COLORS} colour attachments at once, and this device has {most}"
        ));
    }
    Ok(())
}
