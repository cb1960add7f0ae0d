//! The vocabulary of dependencies: a use is a pipeline stage with its accesses.
//!
//! Uses are written with the flags of VK_KHR_synchronization2, which has the old ones in its lower 32 bits and finer ones above: COPY and BLIT in
//! place of TRANSFER, SHADER_SAMPLED_READ in place of SHADER_READ. [`Use::coarse`] translates a use to the flags of the first API.

use ash::vk;

/// A stage and its memory accesses. Passes have a constant for each of their uses; a dependency is written by naming the uses that it orders.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Use {
    /// One stage, or several.
    pub stage: vk::PipelineStageFlags2,
    /// The memory accesses.
    pub access: vk::AccessFlags2,
}

/// The CPU's writes to mapped memory before a submission.
pub const HOST_WRITE: Use = Use::new(vk::PipelineStageFlags2::HOST, vk::AccessFlags2::HOST_WRITE);
/// Everything that a submission does.
pub const DEVICE_ACCESS: Use = Use::new(
    vk::PipelineStageFlags2::ALL_COMMANDS,
    vk::AccessFlags2::from_raw(vk::AccessFlags2::MEMORY_READ.as_raw() | vk::AccessFlags2::MEMORY_WRITE.as_raw()),
);

/// All write accesses that passes name.
const WRITES: u64 = vk::AccessFlags2::SHADER_WRITE.as_raw()
    | vk::AccessFlags2::COLOR_ATTACHMENT_WRITE.as_raw()
    | vk::AccessFlags2::DEPTH_STENCIL_ATTACHMENT_WRITE.as_raw()
    | vk::AccessFlags2::TRANSFER_WRITE.as_raw()
    | vk::AccessFlags2::HOST_WRITE.as_raw()
    | vk::AccessFlags2::SHADER_STORAGE_WRITE.as_raw()
    | vk::AccessFlags2::MEMORY_WRITE.as_raw();

/// The finer stages of synchronization2, each with the stage of the first API that has it.
const FINER_STAGES: &[(vk::PipelineStageFlags2, vk::PipelineStageFlags2)] = &[
    (vk::PipelineStageFlags2::COPY, vk::PipelineStageFlags2::ALL_TRANSFER),
    (vk::PipelineStageFlags2::BLIT, vk::PipelineStageFlags2::ALL_TRANSFER),
    (vk::PipelineStageFlags2::CLEAR, vk::PipelineStageFlags2::ALL_TRANSFER),
    (vk::PipelineStageFlags2::INDEX_INPUT, vk::PipelineStageFlags2::VERTEX_INPUT),
    (vk::PipelineStageFlags2::VERTEX_ATTRIBUTE_INPUT, vk::PipelineStageFlags2::VERTEX_INPUT),
];

/// The finer accesses, likewise.
const FINER_ACCESSES: &[(vk::AccessFlags2, vk::AccessFlags2)] = &[
    (vk::AccessFlags2::SHADER_SAMPLED_READ, vk::AccessFlags2::SHADER_READ),
    (vk::AccessFlags2::SHADER_STORAGE_READ, vk::AccessFlags2::SHADER_READ),
    (vk::AccessFlags2::SHADER_STORAGE_WRITE, vk::AccessFlags2::SHADER_WRITE),
];

impl Use {
    /// The source of a dependency that waits for nothing.
    pub const START: Self = Self::new(vk::PipelineStageFlags2::TOP_OF_PIPE, vk::AccessFlags2::empty());
    /// The destination of a dependency that holds nothing back.
    pub const END: Self = Self::new(vk::PipelineStageFlags2::BOTTOM_OF_PIPE, vk::AccessFlags2::empty());

    /// A stage with its accesses.
    pub const fn new(stage: vk::PipelineStageFlags2, access: vk::AccessFlags2) -> Self {
        Self { stage, access }
    }

    /// Unites two uses, in constants too: `|` of flags is not const.
    pub const fn or(self, other: Self) -> Self {
        Self {
            stage: vk::PipelineStageFlags2::from_raw(self.stage.as_raw() | other.stage.as_raw()),
            access: vk::AccessFlags2::from_raw(self.access.as_raw() | other.access.as_raw()),
        }
    }

    /// Keeps the stages and, of the accesses, the writes.
    pub const fn writes(self) -> Self {
        Self { access: vk::AccessFlags2::from_raw(self.access.as_raw() & WRITES), ..self }
    }

    /// Translates to the flags of the first API, which has fewer of them: the result orders at least as much.
    pub fn coarse(self) -> Self {
        let stage = FINER_STAGES.iter().fold(self.stage, |all, &(fine, coarse)| match all.intersects(fine) {
            true => all & !fine | coarse,
            false => all,
        });
        let access = FINER_ACCESSES.iter().fold(self.access, |all, &(fine, coarse)| match all.intersects(fine) {
            true => all & !fine | coarse,
            false => all,
        });
        Self { stage, access }
    }

    /// Replaces accesses of shaders, coarse or fine, by fine ones for one resource: reads by samplers and texel loads if `is_sampled`, otherwise
    /// storage reads; writes are storage writes.
    pub fn of_shaders(self, is_sampled: bool) -> Self {
        use vk::AccessFlags2 as A;
        let read = if is_sampled { A::SHADER_SAMPLED_READ } else { A::SHADER_STORAGE_READ };
        let reads = A::SHADER_READ | A::SHADER_SAMPLED_READ | A::SHADER_STORAGE_READ;
        let mut access = self.access;
        for (any, fine) in [(reads, read), (A::SHADER_WRITE, A::SHADER_STORAGE_WRITE)] {
            if access.intersects(any) {
                access = access & !any | fine;
            }
        }
        Self { access, ..self }
    }

    /// The masks as the first API takes them.
    pub fn masks(self) -> (vk::PipelineStageFlags, vk::AccessFlags) {
        let Self { stage, access } = self.coarse();
        (vk::PipelineStageFlags::from_raw(stage.as_raw() as u32), vk::AccessFlags::from_raw(access.as_raw() as u32))
    }

    /// The stages by their Vulkan names, with ` | ` between them. TRANSFER is the old name of ALL_TRANSFER.
    pub fn stages(self) -> String {
        format!("{:?}", self.stage).replace("ALL_TRANSFER", "TRANSFER")
    }

    /// The accesses by their Vulkan names, with ` | ` between them.
    pub fn accesses(self) -> String {
        format!("{:?}", self.access)
    }

    /// All of `uses` in one.
    pub fn all(uses: &[Self]) -> Self {
        uses.iter()
            .fold(Self::new(vk::PipelineStageFlags2::empty(), vk::AccessFlags2::empty()), |sum, &one| sum.or(one))
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

/// The API that barriers, submissions and render passes are recorded by.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Hash)]
pub enum SyncVersion {
    /// That of Vulkan 1.0.
    #[default]
    One,
    /// VK_KHR_synchronization2.
    Two,
}

/// The layouts that images are used in.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Hash)]
pub enum Layouts {
    /// The one that Vulkan has for each kind of use.
    #[default]
    Optimal,
    /// GENERAL for all uses but presentation (VK_KHR_unified_image_layouts).
    Unified,
}

impl Layouts {
    /// The layout in place of this one.
    pub const fn of(self, optimal: vk::ImageLayout) -> vk::ImageLayout {
        match (self, optimal) {
            (Self::Optimal, _) | (_, vk::ImageLayout::UNDEFINED | vk::ImageLayout::PRESENT_SRC_KHR) => optimal,
            _ => vk::ImageLayout::GENERAL,
        }
    }
}

#[cfg(test)]
mod tests {
    use ash::vk::{AccessFlags2 as A, PipelineStageFlags2 as S};

    use super::*;

    #[test]
    fn a_fine_mask_is_the_coarse_one_of_the_first_api() {
        let fine = Use::new(S::COPY | S::FRAGMENT_SHADER, A::TRANSFER_READ | A::SHADER_SAMPLED_READ);
        let coarse = Use::new(S::ALL_TRANSFER | S::FRAGMENT_SHADER, A::TRANSFER_READ | A::SHADER_READ);
        assert_eq!(fine.coarse(), coarse);
        assert_eq!(coarse.coarse(), coarse);
        assert_eq!(
            (fine.stages().as_str(), coarse.stages().as_str()),
            ("FRAGMENT_SHADER | COPY", "FRAGMENT_SHADER | TRANSFER")
        );
        assert_eq!(fine.accesses(), "TRANSFER_READ | SHADER_SAMPLED_READ");
        let (stage, access) = fine.masks();
        assert_eq!(stage, vk::PipelineStageFlags::FRAGMENT_SHADER | vk::PipelineStageFlags::TRANSFER);
        assert_eq!(access, vk::AccessFlags::TRANSFER_READ | vk::AccessFlags::SHADER_READ);
        assert_eq!(Use::new(S::CLEAR, A::SHADER_STORAGE_WRITE).writes().access, A::SHADER_STORAGE_WRITE);
    }

    #[test]
    fn unified_layouts_are_general_but_for_presentation_and_new_images() {
        use vk::ImageLayout as L;
        assert_eq!(Layouts::Unified.of(L::TRANSFER_DST_OPTIMAL), L::GENERAL);
        assert_eq!(Layouts::Unified.of(L::PRESENT_SRC_KHR), L::PRESENT_SRC_KHR);
        assert_eq!(Layouts::Unified.of(L::UNDEFINED), L::UNDEFINED);
        assert_eq!(Layouts::Optimal.of(L::TRANSFER_DST_OPTIMAL), L::TRANSFER_DST_OPTIMAL);
    }
}
