//! The accesses that each stage supports, which go with the stage's bit when that is taken out of a mask.

use ash::vk::{AccessFlags2 as A, PipelineStageFlags2 as S};

use crate::gpu::sync::Use;

const DEPTH_TESTS: S = S::from_raw(S::EARLY_FRAGMENT_TESTS.as_raw() | S::LATE_FRAGMENT_TESTS.as_raw());
const SHADERS: S = S::from_raw(S::VERTEX_SHADER.as_raw() | S::FRAGMENT_SHADER.as_raw() | S::COMPUTE_SHADER.as_raw());
const COPIES: S = S::from_raw(S::ALL_TRANSFER.as_raw() | S::COPY.as_raw() | S::BLIT.as_raw() | S::CLEAR.as_raw());
const FETCHES_INDICES: S = S::from_raw(S::VERTEX_INPUT.as_raw() | S::INDEX_INPUT.as_raw());
const FETCHES_VERTICES: S = S::from_raw(S::VERTEX_INPUT.as_raw() | S::VERTEX_ATTRIBUTE_INPUT.as_raw());

/// "Supported access types" of the specification, for the accesses that rows name.
pub const SUPPORTED: &[(A, S)] = &[
    (A::INDIRECT_COMMAND_READ, S::DRAW_INDIRECT),
    (A::INDEX_READ, FETCHES_INDICES),
    (A::VERTEX_ATTRIBUTE_READ, FETCHES_VERTICES),
    (A::INPUT_ATTACHMENT_READ, S::FRAGMENT_SHADER),
    (A::SHADER_READ, SHADERS),
    (A::SHADER_WRITE, SHADERS),
    (A::SHADER_SAMPLED_READ, SHADERS),
    (A::SHADER_STORAGE_READ, SHADERS),
    (A::SHADER_STORAGE_WRITE, SHADERS),
    (A::COLOR_ATTACHMENT_READ, S::COLOR_ATTACHMENT_OUTPUT),
    (A::COLOR_ATTACHMENT_WRITE, S::COLOR_ATTACHMENT_OUTPUT),
    (A::DEPTH_STENCIL_ATTACHMENT_READ, DEPTH_TESTS),
    (A::DEPTH_STENCIL_ATTACHMENT_WRITE, DEPTH_TESTS),
    (A::TRANSFER_READ, COPIES),
    (A::TRANSFER_WRITE, COPIES),
    (A::HOST_READ, S::HOST),
    (A::HOST_WRITE, S::HOST),
    (A::MEMORY_READ, S::ALL_COMMANDS),
    (A::MEMORY_WRITE, S::ALL_COMMANDS),
];

/// The stages of drawing that passes have uses in, each logically earlier than the next.
const DRAWING: [S; 8] = [
    S::DRAW_INDIRECT,
    S::VERTEX_INPUT,
    S::INDEX_INPUT,
    S::VERTEX_ATTRIBUTE_INPUT,
    S::EARLY_FRAGMENT_TESTS,
    S::FRAGMENT_SHADER,
    S::LATE_FRAGMENT_TESTS,
    S::COLOR_ATTACHMENT_OUTPUT,
];

/// Removes stages that wrote nothing and are logically earlier than another stage of the mask: a first scope includes logically earlier stages
/// anyway.
pub(super) fn latest(mask: Use) -> Use {
    let writes = |stage: S| SUPPORTED.iter().any(|(access, by)| mask.access.contains(*access) && by.contains(stage));
    let stages = DRAWING.iter().enumerate().fold(mask.stage, |stages, (index, &stage)| {
        let is_covered = DRAWING[index + 1..].iter().any(|later| mask.stage.contains(*later));
        if is_covered && !writes(stage) { stages & !stage } else { stages }
    });
    Use::new(stages, mask.access)
}

/// The mask less some bits, and less the accesses that no stage that is left supports. `None` when no stage is left.
pub fn without(mask: Use, bits: Use) -> Option<Use> {
    let stage = mask.stage & !bits.stage;
    let supported = SUPPORTED.iter().filter(|(_, stages)| stage.intersects(*stages));
    let supported = supported.fold(A::empty(), |all, (access, _)| all | *access);
    (!stage.is_empty()).then(|| Use::new(stage, mask.access & !bits.access & supported))
}

/// Each stage and each access by itself. The ends of the pipeline, which do nothing, are none.
pub fn bits(mask: Use) -> impl Iterator<Item = Use> {
    let ends = S::TOP_OF_PIPE | S::BOTTOM_OF_PIPE;
    let each = |raw: u64| (0..u64::BITS).map(|bit| 1 << bit).filter(move |bit| raw & bit != 0);
    let stages = each((mask.stage & !ends).as_raw()).map(|bit| Use::new(S::from_raw(bit), A::empty()));
    stages.chain(each(mask.access.as_raw()).map(|bit| Use::new(S::empty(), A::from_raw(bit))))
}
