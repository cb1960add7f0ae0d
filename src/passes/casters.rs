//! Shared by SHADOW and TINT, which draw objects as a light sees them: the vertex streams of their shaders, and the stages that read their push constants.

use ash::vk;

use crate::gpu_scene::{COLOR, LOOK, POSITION, ROWS, SECOND_UV, UV, VertexInputState, vertex_input};
use crate::plan::Extras;

/// The stages that read the push constants of a caster.
pub const PUSH_STAGES: vk::ShaderStageFlags =
    vk::ShaderStageFlags::from_raw(vk::ShaderStageFlags::VERTEX.as_raw() | vk::ShaderStageFlags::FRAGMENT.as_raw());

/// The streams of vertices that a caster's vertex shader reads.
pub fn streams(textured: bool, extras: Extras) -> &'static [u32] {
    match (textured, extras.any()) {
        (false, false) => &[POSITION],
        (true, false) => &[POSITION, UV],
        (false, true) => &[POSITION, COLOR],
        (true, true) => &[POSITION, UV, COLOR, SECOND_UV],
    }
}

/// The bindings and attributes of these streams, of the rows of instances, and of their looks where these choose a cell.
pub fn inputs(textured: bool, extras: Extras) -> VertexInputState {
    let look = (textured && extras.any()).then_some(LOOK);
    let all: Vec<u32> = streams(textured, extras).iter().copied().chain(ROWS..ROWS + 4).chain(look).collect();
    vertex_input(&all, extras)
}
