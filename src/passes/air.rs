//! The air between the eye and everything drawn: the constants and the scattered light, for the passes that compute the light and for the passes that
//! look through it.

use super::{Resource, ResourceUse, SAMPLED};
use crate::gpu::sync::Use;
use crate::plan::{FROXELS, FramePlan};

/// The light in the air: SCATTER makes the buffer, and it is bound in set 0.
pub const LIGHT: Resource = Resource::Buffers(FROXELS);
/// Looks it up while it shades fragments.
pub const LIGHT_READ: Use = SAMPLED;

/// The constants of every shader that knows the fog's froxels; none where the plan has none. `constants` are the shader's own ids.
macro_rules! froxel_grid {
    ($plan:expr) => {{
        let ids = [constants::FROXEL_COLUMNS, constants::FROXEL_ROWS, constants::FROXEL_SLICES];
        $plan.froxels().into_iter().flat_map(move |own| ids.into_iter().zip(own.grid))
    }};
}

/// The constants of every shader that calls `seen_through_air` (`shaders/shared/fogged.wgsl`). `looks`: this pipeline draws surfaces that are seen
/// through the air.
macro_rules! air_constants {
    ($plan:expr, $looks:expr) => {{
        let own = [
            (constants::FOG, u32::from($plan.has_fog() && $looks)),
            (constants::FROXELS, u32::from($plan.froxels().is_some())),
        ];
        own.into_iter().chain($crate::passes::air::froxel_grid!($plan))
    }};
}

pub(super) use {air_constants, froxel_grid};

/// Looks up the light in the air, where passes find it.
pub(super) fn touch(plan: &FramePlan) -> Option<ResourceUse> {
    plan.froxels().map(|_| ResourceUse::resource(LIGHT, LIGHT_READ).because("looks up the light in the air"))
}

/// Returns true if the scene's lights shine into the air.
pub(super) fn is_lit(plan: &FramePlan) -> bool {
    plan.has_fog() && plan.lights.any()
}
