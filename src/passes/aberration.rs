//! ABERRATION: shifts red and blue of the finished picture apart, as a lens does. It needs a separate render pass, because each pixel reads others.

use super::screen::RedrawPass;
use super::{COLOR_WRITE, ContentsIfFirst, Endpoint, Pass, Presence, ResourceUse, SAMPLED, needed};
use crate::gpu::sync::Use;
use crate::plan::APART;
use crate::shaders::aberration::{self as shader, Flags, constants};

/// Samples the picture as the render pass before left it.
pub const PICTURE_READ: Use = SAMPLED;
/// Writes every pixel of the new picture; its undefined load is a write too.
pub const APART_WRITE: Use = COLOR_WRITE;

pub const PASS: Pass = Pass {
    name: Endpoint::pass("ABERRATION"),
    time: "aberration",
    what: "draws red and blue apart, and so reads other pixels",
    presence: |plan| Presence::when(plan.effects.aberration.is_some(), "asked for", "not asked for"),
    touches: |plan| {
        vec![
            ResourceUse::sampled(0, plan.picture_before(APART), PICTURE_READ)
                .because("samples the picture farther out and farther in than its pixel"),
            ResourceUse::color(0, APART, ContentsIfFirst::Undefined, APART_WRITE)
                .because("draws the picture with its colours apart"),
        ]
    },
    leave_out: Some(|settings| settings.aberration = 0.0),
    make: Some(|own| {
        let share = own.plan.effects.aberration.unwrap_or_default();
        let shader = needed("aberration", shader::variant, Flags::NONE)?;
        Ok(Box::new(RedrawPass::new(own, ("ABERRATION", APART), shader, &[(constants::SHARE, share.to_bits())])?))
    }),
};
