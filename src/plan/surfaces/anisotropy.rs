//! How textures are filtered where they are seen at a low angle.

use crate::plan::{Capabilities, FramePlan, Part, parts};
use crate::scene::Settings;

/// Places of a texture that a pixel is filtered from at most.
pub(in crate::plan) fn degree(settings: &Settings, device: &Capabilities) -> u32 {
    match is_too_slow(device.software, settings.msaa) {
        true => 1,
        false => settings.anisotropy.min(device.anisotropy),
    }
}

/// Lavapipe takes 14 times as long over a multisampled frame of the hall with it as without.
fn is_too_slow(software: bool, msaa: u32) -> bool {
    software && msaa > 1
}

/// What somebody asked for whose textures are filtered with less. The default is no wish: where it does not pay, nobody misses it.
pub(in crate::plan) fn warning(settings: &Settings, device: &Capabilities, degree: u32) -> Option<String> {
    let asked = settings.anisotropy;
    let spared = is_too_slow(device.software, settings.msaa);
    let is_missed = !spared || asked != Settings::default().anisotropy;
    let why = if spared { "a CPU takes too long with several samples a pixel" } else { "the device has no more" };
    (asked > degree && is_missed)
        .then(|| format!("textures are filtered with an anisotropy of {degree}, not {asked}: {why}"))
}

pub(in crate::plan) fn part(settings: &Settings, plan: &FramePlan) -> Part {
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
