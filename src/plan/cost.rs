//! The cost of a plan's parts, and the saving of leaving one out: found by planning once more with that part kept.

use super::{Capabilities, FramePlan, PlanError, Reasons};
use crate::scene::{Keep, OptionalPart, Scene, Settings};

/// The extra cost of a frame if the settings kept a part without need.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Cost {
    /// Device memory. Negative if the kept part makes another one smaller.
    pub bytes: i64,
    /// Attachment bytes per pixel.
    pub bytes_per_pixel: i64,
    /// Keeping the part changes nothing: the plan has it anyway, or cannot have it.
    pub same: bool,
}

impl FramePlan {
    /// Device memory of all parts that are in.
    pub fn bytes(&self) -> u64 {
        self.parts().iter().map(|part| part.bytes).sum()
    }

    /// Returns the additional cost of keeping `part`. This plan must be made from the same scene, settings and device.
    ///
    /// # Errors
    /// When the part cannot be kept, as on a device that is too small for it.
    pub fn cost_of(
        &self,
        part: OptionalPart,
        scene: &Scene,
        settings: &Settings,
        device: &Capabilities,
    ) -> Result<Cost, PlanError> {
        self.cost_of_all(settings.keep.with(part), scene, settings, device)
    }

    /// Returns the additional cost of keeping several parts at once.
    ///
    /// # Errors
    /// As [`FramePlan::cost_of`].
    pub fn cost_of_all(
        &self,
        keep: Keep,
        scene: &Scene,
        settings: &Settings,
        device: &Capabilities,
    ) -> Result<Cost, PlanError> {
        // ANCHOR: cost-of-a-part
        let kept = Self::of(scene, &Settings { keep, ..settings.clone() }, device)?.presented_like(self);
        let bytes_per_pixel = |plan: &Self| plan.target_bytes_per_pixel().cast_signed();
        Ok(Cost {
            bytes: kept.bytes().cast_signed() - self.bytes().cast_signed(),
            bytes_per_pixel: bytes_per_pixel(&kept) - bytes_per_pixel(self),
            same: kept.has_structure_of(self),
        })
        // ANCHOR_END: cost-of-a-part
    }

    /// Returns true if two plans make the same frames, whatever they say of why.
    pub fn has_structure_of(&self, other: &Self) -> bool {
        let plain = |plan: &Self| Self { keep: Keep::NONE, reasons: Reasons::default(), ..plan.clone() };
        plain(self) == plain(other)
    }
}
