//! The vocabulary of dependencies: a use is a pipeline stage with its accesses.

use ash::vk;

/// A stage and what it does to memory there. Passes have a constant for each of their uses; a dependency is written by naming
/// the uses that it orders.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Use {
    /// One stage, or several.
    pub stage: vk::PipelineStageFlags,
    /// Its accesses to memory.
    pub access: vk::AccessFlags,
}

/// The CPU's writes to mapped memory before a submission.
pub const HOST_WRITE: Use = Use::new(vk::PipelineStageFlags::HOST, vk::AccessFlags::HOST_WRITE);
/// Everything that a submission does.
pub const DEVICE_ACCESS: Use = Use::new(
    vk::PipelineStageFlags::ALL_COMMANDS,
    vk::AccessFlags::from_raw(vk::AccessFlags::MEMORY_READ.as_raw() | vk::AccessFlags::MEMORY_WRITE.as_raw()),
);

/// All write accesses that passes name.
const WRITES: u32 = vk::AccessFlags::SHADER_WRITE.as_raw()
    | vk::AccessFlags::COLOR_ATTACHMENT_WRITE.as_raw()
    | vk::AccessFlags::DEPTH_STENCIL_ATTACHMENT_WRITE.as_raw()
    | vk::AccessFlags::TRANSFER_WRITE.as_raw()
    | vk::AccessFlags::HOST_WRITE.as_raw()
    | vk::AccessFlags::MEMORY_WRITE.as_raw();

impl Use {
    /// Before a dependency that waits for nothing.
    pub const START: Self = Self::new(vk::PipelineStageFlags::TOP_OF_PIPE, vk::AccessFlags::empty());
    /// After a dependency that holds nothing back.
    pub const END: Self = Self::new(vk::PipelineStageFlags::BOTTOM_OF_PIPE, vk::AccessFlags::empty());

    /// A stage with its accesses.
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

    /// The same stages with the write accesses alone.
    pub const fn writes(self) -> Self {
        Self { access: vk::AccessFlags::from_raw(self.access.as_raw() & WRITES), ..self }
    }

    /// All of `uses` in one.
    pub fn all(uses: &[Self]) -> Self {
        uses.iter().fold(Self::new(vk::PipelineStageFlags::empty(), vk::AccessFlags::empty()), |sum, &one| sum.or(one))
    }
}

/// The two sides of a barrier.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Dependency {
    /// The name of the row that it carries out, for listings of commands; empty where no table has it.
    pub row: &'static str,
    /// The first scope: uses that must be complete.
    pub before: Use,
    /// The second scope: uses that wait.
    pub after: Use,
}

impl Dependency {
    /// An order that is no row of a table.
    pub const fn between(before: Use, after: Use) -> Self {
        Self { row: "", before, after }
    }
}
