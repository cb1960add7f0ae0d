//! FXAA: edges of the finished picture, smoothed. It needs a separate render pass, because each pixel reads its neighbours.

use super::screen::RedrawPass;
use super::{COLOR_WRITE, ContentsIfFirst, Endpoint, Pass, Presence, ResourceUse, SAMPLED, needed};
use crate::gpu::sync::Use;
use crate::plan::SMOOTHED;
use crate::shaders::fxaa::{self as shader, Flags};

/// Samples the picture as the render pass before left it.
pub const OUTPUT_READ: Use = SAMPLED;
/// Writes every pixel of the new picture; its undefined load is a write too.
pub const PICTURE_WRITE: Use = COLOR_WRITE;

pub const PASS: Pass = Pass {
    name: Endpoint::pass("FXAA"),
    time: "fxaa",
    what: "smooths edges, and so reads each pixel's neighbours",
    presence: |plan| Presence::when(plan.effects.fxaa, "asked for", "not asked for"),
    touches: |plan| {
        vec![
            ResourceUse::sampled(0, plan.picture_before(SMOOTHED), OUTPUT_READ)
                .because("samples the picture around its pixel"),
            ResourceUse::color(0, SMOOTHED, ContentsIfFirst::Undefined, PICTURE_WRITE)
                .because("draws the smoothed picture"),
        ]
    },
    leave_out: Some(|settings| settings.fxaa = false),
    make: Some(|own| {
        let shader = needed("fxaa", shader::variant, Flags::NONE)?;
        Ok(Box::new(RedrawPass::new(own, ("FXAA", SMOOTHED), shader, &[])?))
    }),
};
