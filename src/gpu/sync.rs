//! How a pass names the way it touches something.

use ash::vk;

/// A stage and what it does to memory there. Passes have a constant for each of their uses; a dependency is written by naming
/// the uses that it orders.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Use {
    pub stage: vk::PipelineStageFlags,
    pub access: vk::AccessFlags,
}

impl Use {
    pub const fn new(stage: vk::PipelineStageFlags, access: vk::AccessFlags) -> Self {
        Self { stage, access }
    }

    /// For tables of constants: `|` of flags is not const.
    pub const fn or(self, other: Self) -> Self {
        Self {
            stage: vk::PipelineStageFlags::from_raw(self.stage.as_raw() | other.stage.as_raw()),
            access: vk::AccessFlags::from_raw(self.access.as_raw() | other.access.as_raw()),
        }
    }

    /// All of `uses` in one.
    pub fn all(uses: &[Self]) -> Self {
        uses.iter().fold(Self::new(vk::PipelineStageFlags::empty(), vk::AccessFlags::empty()), |sum, &one| sum.or(one))
    }
}
