//! The light where nothing is drawn: clear values, and what TILED writes there.

use glam::Vec3;

use super::curves::tone_map_up_to;
use crate::plan::{FramePlan, Shading, Target, ToneMapping};
use crate::visible::World;

/// Returns the light of the background.
pub fn exposed_background(plan: &FramePlan, world: &World) -> Vec3 {
    match plan.shading {
        // As in the shaders: cut off before it is stored or mapped, so that nothing overflows on the way.
        Shading::Light { light_only: false } => {
            (world.environment.background * world.exposure).min(Vec3::splat(plan.largest_light()))
        }
        _ => Vec3::ZERO,
    }
}

/// Returns the clear colour of a target.
pub fn background(plan: &FramePlan, world: &World, target: Target) -> Vec3 {
    if !matches!(plan.shading, Shading::Light { light_only: false }) {
        return Vec3::ZERO;
    }
    let exposed = exposed_background(plan, world);
    match plan.tone_mapping {
        ToneMapping::InLighting(curve) => tone_map_up_to(plan.headroom(), exposed, curve),
        ToneMapping::Subpass(_) | ToneMapping::Kept if target == Target::Output => Vec3::ZERO,
        _ => exposed,
    }
}
