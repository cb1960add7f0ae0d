//! How textures are filtered where they are seen at a low angle.

use super::{Capabilities, FramePlan, Part, parts};
use crate::scene::Settings;

/// Places of a texture that a pixel is filtered from at most.
pub(super) fn degree(settings: &Settings, device: &Capabilities) -> u32 {
    match is_too_slow(device.software, settings.msaa) {
        true => 1,
        false => settings.anisotropy.min(device.anisotropy),
    }
}

/// Lavapipe takes 14 times as long over a multisampled frame of the hall with it as without.
pub(super) fn is_too_slow(software: bool, msaa: u32) -> bool {
    software && msaa > 1
}

pub(super) fn part(settings: &Settings, plan: &FramePlan) -> Part {
    let reason = match (plan.anisotropy, settings.anisotropy) {
        (1, 1) => "not asked for: textures that are seen at a low angle are blurred".into(),
        (1, _) if !plan.textures.have_levels() => "no texture of more than one texel is sampled".into(),
        (1, _) if is_too_slow(plan.software, plan.msaa) => {
            "a CPU takes many times as long with several samples a pixel".into()
        }
        (1, _) => "the device has none".into(),
        (degree, asked) if degree < asked => format!("up to {degree} places a pixel: the device has no more"),
        (degree, _) => format!("up to {degree} places a pixel where textures are seen at a low angle"),
    };
    parts::part("anisotropic filtering", plan.anisotropy > 1, reason, 0)
}
