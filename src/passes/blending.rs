//! Shared by TRANSPARENT and PARTICLES, which blend in one subpass: its attachments, their blending, and the bounds of a layer's values.

use ash::vk;

use super::surface::Limits;
use super::{COLOR_BLEND, ContentsIfFirst, DEPTH_COMPARE, ResourceUse};
use crate::plan::{FramePlan, OitTargets, Target, ToneMapping, effects};
use crate::scene::Transparency;

/// The attachments of the subpass.
pub fn targets(plan: &FramePlan) -> Vec<ResourceUse> {
    let color =
        |location, target, why| ResourceUse::color(location, target, ContentsIfFirst::Clear, COLOR_BLEND).because(why);
    let mut touches = vec![
        ResourceUse::depth(ContentsIfFirst::Undefined, DEPTH_COMPARE)
            .because("tests against the depth of opaque surfaces"),
    ];
    touches.extend(match plan.transparency {
        Some(Transparency::Oit) => {
            let why = "clears the sums and adds to them";
            vec![color(0, Target::Accumulation, why), color(1, Target::Weights, why)]
        }
        _ => vec![color(0, plan.light_target(), "blends over the light")],
    });
    touches
}

/// Largest number of layers whose sum, with all rounding, is held below 64000 by their number. More are held by half floats themselves:
/// a sum of values up to 16 ends at 2^15, where half a step is 16.
const COUNTED_LAYERS: f32 = 2000.0;

/// The bounds of a layer's values, so that no sum of layers overflows its target, and no addend of weighted blending is rounded to nothing. A layer's
/// colour is at most `largest` times its alpha plus `highlight`; no pixel has more layers than the scene has transparent triangles, and effects blend over it.
/// `shaders/forward.wgsl` says how the weights do it.
pub fn limits(plan: &FramePlan) -> Limits {
    let layers = plan.transparent_triangles.saturating_add(effects::layers(plan)).max(1) as f32;
    let largest = plan.largest_light();
    match plan.sums {
        Some(OitTargets::SINGLE) => {
            Limits { largest, highlight: largest, weight: 1.0, least: LEAST_WEIGHT, peak: 1e38 / layers }
        }
        Some(_) => {
            let peak = 64000.0 / layers.min(COUNTED_LAYERS) - 16.0;
            // Light up to 16 has the weight of its distance alone.
            let weight = peak / 16.0;
            // Tone-mapped light is white long before 512; in nits nothing may be cut off.
            let linear = matches!(plan.tone_mapping, ToneMapping::AfterFrames(_) | ToneMapping::Absent);
            let highlight = if linear { largest } else { 512.0 };
            // 2^-6 times an alpha of 1/255 is a normal number.
            Limits { largest, highlight, weight, least: LEAST_WEIGHT.max(1.0 / 64.0 / weight), peak }
        }
        // Single floats overflow nowhere.
        None if plan.light_format() == vk::Format::R32G32B32A32_SFLOAT => Limits::unweighted(largest, largest / layers),
        // A layer over a picture p gives p (1 - alpha) + largest alpha + highlight <= max(p, largest) + highlight: T layers over 32000
        // stay below 32000 + T highlight <= 64000. A highlight of 16 is white however it is tone-mapped, so that more than 2000
        // triangles do not dim it; for them to overflow, more than 2000 such highlights would have to lie on one pixel.
        None => Limits::unweighted(largest, (largest / layers).max(16.0)),
    }
}

/// The weight at three scene radii, from where weights fall no further, as a share of that at the eye.
const LEAST_WEIGHT: f32 = 1.0 / 4096.0;

/// One state for each colour location of the subpass.
pub fn blend(plan: &FramePlan) -> Vec<vk::PipelineColorBlendAttachmentState> {
    match plan.transparency {
        // Both in one way: not every device has independentBlend, and Mesa 25's lavapipe forgets it after a pipeline without colours.
        Some(Transparency::Oit) => vec![sum_and_multiply(); 2],
        _ => vec![super::screen::over()],
    }
}

/// Adds up the colour, and multiplies alpha by 1 minus the value.
fn sum_and_multiply() -> vk::PipelineColorBlendAttachmentState {
    super::screen::add()
        .src_alpha_blend_factor(vk::BlendFactor::ZERO)
        .dst_alpha_blend_factor(vk::BlendFactor::ONE_MINUS_SRC_ALPHA)
}
