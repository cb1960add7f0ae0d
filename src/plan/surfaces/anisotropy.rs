//! The filtering of textures: the part of a pixel that it covers, and surfaces at a low angle.

use crate::plan::{Capabilities, FramePlan, Part, effects, parts};
use crate::scene::{Scene, Settings};

/// Places of a texture that a pixel is filtered from at most, in one frame.
pub(in crate::plan) fn degree(settings: &Settings, device: &Capabilities) -> u32 {
    match frames(settings) > 1 || is_too_slow(device.software, settings.msaa) {
        true => 1,
        false => settings.anisotropy.min(device.anisotropy),
    }
}

/// Edge of the square of a pixel, in pixels, that a frame filters textures for: the level falls by its logarithm.
///
/// Each of N jittered frames stands for an N-th of the pixel. If each filtered for the whole pixel, their mean would be blurred twice, for any N. So
/// a frame filters for a square of 1 / sqrt(N). If a pixel covers an ellipse on the texture, A times as long as wide, its area equals N squares whose
/// edge is 1 / sqrt(N A) of the long side: the frames are the samples of anisotropic filtering, and the sampler takes only one, with A at most N.
/// Surfaces seen from the front are then filtered for less than their share, but the mean over the frames makes up for it.
///
/// Multisampling changes nothing: a surface is shaded once for all samples of a pixel, so it is filtered for the whole pixel.
///
/// relMSE of pictures of 320x180 by N and the edge, lavapipe (`render --samples N`, against truths of 256 and 128 samples; docs/REPORT.md):
///
/// | | N = 8 | 64 |
/// |---|---|---|
/// | `builtin:hall`, whole pixels, anisotropy 8 | 6.6e-3 | 6.7e-3 |
/// | 1 / sqrt(N) | 2.8e-3 | 3.5e-4 |
/// | 1 / sqrt(8 N) | 1.2e-3 | 2.1e-4 |
///
/// 1 / sqrt(N) with anisotropic samplers was tried: lavapipe of Mesa 22.3 takes no gradients there, and with a level bias a frame takes minutes.
pub(in crate::plan) fn footprint(settings: &Settings) -> f32 {
    let [frames, longest] = [frames(settings), settings.anisotropy.min(frames(settings))].map(f64::from);
    (frames * longest).sqrt().recip() as f32
}

/// If a driver's samplers read all texels that a pixel covers, shaders filter instead (`places_of` in `shaders/shared/material.wgsl`), with one
/// sample of one level at each of as many places. Time of a frame and error of its picture, lavapipe of Mesa 22.3.6 on two busy cores, 8 places,
/// against 256 samples a pixel (`bench --still`; `render --samples 1 --size 640x360` and `compare`):
///
/// | | `builtin:hall`, 640x360 | mean FLIP | Crytek Sponza, 1280x720 | mean FLIP |
/// |---|---|---|---|---|
/// | samplers | 340 ms | .0446 | 367 ms | .0299 |
/// | shaders, two levels, places rounded up | 198 ms | .0399 | 244 ms | .0273 |
/// | shaders | 176 ms | .0442 | 202 ms | .0301 |
/// | anisotropy 1 | 152 ms | .0545 | 204 ms | .0361 |
///
/// Mesa 25.0.7's samplers cost next to nothing (hall 76 ms, with anisotropy 1 78), and shaders more (94).
///
/// Shaders filter all textures of a plan or none: where a texel of some is meant to have an edge, samplers filter the others.
pub(in crate::plan) fn by_shaders(scene: &Scene, device: &Capabilities, looked_up: bool) -> bool {
    // In compute, samplers of lavapipe filter isotropically, whatever the gradients.
    let badly = device.slow_anisotropy || looked_up && device.software;
    badly && scene.textures.iter().all(|texture| texture.sampler.softens())
}

/// Number of jittered frames that are averaged to a picture, by `samples` or by an effect.
fn frames(settings: &Settings) -> u32 {
    settings.samples.max(effects::frames(settings))
}

/// Lavapipe takes 14 times as long over a multisampled frame of the hall with it as without.
fn is_too_slow(software: bool, msaa: u32) -> bool {
    software && msaa > 1
}

/// Returns the warning where textures are filtered with less anisotropy than was asked for. The default is no request.
pub(in crate::plan) fn warning(settings: &Settings, device: &Capabilities, degree: u32) -> Option<String> {
    let asked = settings.anisotropy;
    let spared = is_too_slow(device.software, settings.msaa);
    let is_missed = !spared || asked != Settings::default().anisotropy;
    let why = if spared { "a CPU takes too long with several samples a pixel" } else { "the device has no more" };
    (asked > degree && is_missed && frames(settings) == 1)
        .then(|| format!("textures are filtered with an anisotropy of {degree}, not {asked}: {why}"))
}

pub(in crate::plan) fn part(settings: &Settings, plan: &FramePlan) -> Part {
    let reason = match (plan.anisotropy, settings.anisotropy) {
        (1, 1) if frames(settings) == 1 || !plan.textures.have_levels() => {
            "not asked for: textures that are seen at a low angle are blurred".into()
        }
        (1, _) if !plan.textures.have_levels() => "no texture of more than one texel is sampled".into(),
        (1, _) if frames(settings) > 1 => format!(
            "the {} frames of a picture are the places: each filters for {:.3} of a pixel's edge",
            frames(settings),
            plan.footprint
        ),
        (1, _) if is_too_slow(plan.software, plan.msaa) => {
            "a CPU takes many times as long with several samples a pixel".into()
        }
        (1, _) => "the device has none".into(),
        (degree, asked) if degree < asked => format!("up to {degree} taps a pixel: the device has no more"),
        (degree, _) if plan.places_by_shaders && plan.triangles.is_some() && plan.software => {
            format!("up to {degree} taps in the shader: this driver's samplers are isotropic in compute")
        }
        (degree, _) if plan.places_by_shaders => {
            format!("up to {degree} taps in the shader: this driver's samplers are slow")
        }
        (degree, _) => format!("up to {degree} taps a pixel where textures are seen at a low angle"),
    };
    parts::part("anisotropic filtering", plan.anisotropy > 1, reason, 0)
}
