//! The ways in which Vulkan carries a frame's passes: render passes or rendering, the API of barriers, the layouts of images, the queues. The picture is the same.

use super::{Capabilities, FramePlan, PlanError, Refusal};
use crate::gpu::lack::Lack;
use crate::gpu::sync::{Layouts, SyncVersion};
use crate::scene::{self, ImageLayouts, Passes, Settings, SyncApi};

/// Colour attachments of one `vkCmdBeginRendering`: as many as Vulkan 1.4 promises.
pub(crate) const RENDERED_COLORS: u32 = 8;

/// # Errors
/// With the requirement that the device lacks.
pub(super) fn layouts(settings: &Settings, device: &Capabilities) -> Result<Layouts, PlanError> {
    if settings.layouts == ImageLayouts::Optimal {
        return Ok(Layouts::Optimal);
    }
    device.unified_layouts.map_err(|lack| {
        let why = "images in GENERAL may then cost time, and layers say so: ask for --layouts optimal";
        Refusal::of("--layouts unified", format!("{lack}; {why}"))
    })?;
    Ok(Layouts::Unified)
}

/// # Errors
/// With the requirement that the device lacks.
pub(super) fn sync(settings: &Settings, device: &Capabilities) -> Result<SyncVersion, PlanError> {
    if settings.sync == SyncApi::One {
        return Ok(SyncVersion::One);
    }
    device.synchronization2.map_err(|lack| Refusal::of("--sync 2", format!("{lack}: ask for --sync 1")))?;
    Ok(SyncVersion::Two)
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
/// With the requirement that the device lacks.
pub(super) fn queues(settings: &Settings, device: &Capabilities) -> Result<OtherQueues, PlanError> {
    if settings.queues == scene::Queues::One {
        return Ok(OtherQueues::default());
    }
    let why = match (device.compute_queue, device.transfer_queue) {
        (Err(Lack::Family(one)), Err(Lack::Family(other))) => {
            format!("{}, and none for {other} alone", Lack::Family(one))
        }
        (Err(Lack::Family(_)), Err(lack)) | (Err(lack), Err(_)) => lack.to_string(),
        (compute, transfer) => return Ok(OtherQueues { compute: compute.is_ok(), transfer: transfer.is_ok() }),
    };
    Err(Refusal::of("--queues all", format!("{why}: ask for --queues one")))
}

/// Refuses local read on devices without it. What the frame's draws read, their list knows (`src/frame/list/local_read.rs`).
///
/// # Errors
/// With the requirement that the device lacks.
pub(super) fn check_passes(plan: &FramePlan, device: &Capabilities) -> Result<(), PlanError> {
    if plan.passes != Passes::LocalRead {
        return Ok(());
    }
    let refuse = |why: String| Refusal::of("--passes local-read", format!("{why}: ask for --passes subpasses"));
    device.local_read.map_err(|lack| refuse(lack.to_string()))?;
    if device.max_color_attachments < RENDERED_COLORS {
        let most = device.max_color_attachments;
        return Err(refuse(format!(
            "it draws with up to {RENDERED_COLORS} colour attachments at once, and this device has {most}"
        )));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use ash::khr;

    use super::*;
    use crate::gpu::lack::Support;
    use crate::plan::samples;

    #[test]
    fn a_refusal_names_the_requirement_that_a_device_lacks_and_no_other() {
        let (_, scene) = samples::scenes().swap_remove(0);
        let refused = |device: Capabilities, settings: &Settings| {
            FramePlan::of(&scene, settings, &device).map_or_else(|error| error.to_string(), |_| String::new())
        };
        let by_2 = Settings { sync: SyncApi::Two, ..Settings::default() };
        let unified = Settings { layouts: ImageLayouts::Unified, ..Settings::default() };
        let local = Settings { passes: Passes::LocalRead, ..Settings::default() };
        let (sync, pass2) = (khr::synchronization2::NAME, khr::create_renderpass2::NAME);
        let rendering = khr::dynamic_rendering::NAME;
        let lacks = |lack| -> Support { Err(lack) };
        let by_sync = |lack| Capabilities { synchronization2: lacks(lack), ..Capabilities::ample() };
        let by_read = |lack| Capabilities { local_read: lacks(lack), ..Capabilities::ample() };
        let on_all = Settings { queues: scene::Queues::All, ..Settings::default() };
        let by_queues = |compute, transfer| Capabilities {
            compute_queue: lacks(compute),
            transfer_queue: lacks(transfer),
            ..Capabilities::ample()
        };
        let (no_compute, no_copies) = (Lack::Family("compute"), Lack::Family("copies"));
        let broken = Lack::Broken(khr::timeline_semaphore::NAME);
        let by_layouts = |lack| Capabilities { unified_layouts: lacks(lack), ..Capabilities::ample() };
        let cases = [
            (by_sync(Lack::Extension(sync)), &by_2, "lacks VK_KHR_synchronization2: ask for --sync 1"),
            (by_sync(Lack::Extension(pass2)), &by_2, "lacks VK_KHR_create_renderpass2: ask for --sync 1"),
            (by_sync(Lack::Feature("synchronization2")), &by_2, "lacks the feature synchronization2: ask"),
            (by_sync(Lack::Broken(sync)), &by_2, "lists VK_KHR_synchronization2 and does not open with it"),
            (by_read(Lack::Extension(rendering)), &local, "lacks VK_KHR_dynamic_rendering: ask for --passes subpasses"),
            (by_read(Lack::Feature("independentBlend")), &local, "lacks the feature independentBlend: ask"),
            (
                by_layouts(Lack::Feature("unifiedImageLayouts")),
                &unified,
                "lacks the feature unifiedImageLayouts; images",
            ),
            (
                by_queues(no_compute, no_copies),
                &on_all,
                "has no queue family for compute alone, and none for copies alone: ask for --queues one",
            ),
            (by_queues(no_compute, broken), &on_all, "lists VK_KHR_timeline_semaphore and does not open with it"),
            (by_queues(broken, no_copies), &on_all, "lists VK_KHR_timeline_semaphore and does not open with it"),
        ];
        for (device, settings, says) in cases {
            let told = refused(device, settings);
            assert!(told.contains(says), "'{says}' is not in '{told}'");
            assert_eq!(told.matches("VK_KHR").count(), says.matches("VK_KHR").count(), "{told}");
            assert_eq!(refused(Capabilities::ample(), settings), "");
        }
    }
}
