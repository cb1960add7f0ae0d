//! TONE: vignette and film grain, over the finished picture. It multiplies each pixel by the share of light that a lens and a film leave.

use std::sync::Arc;

use ash::vk;

use super::screen::{Screen, ScreenDesc, replace};
use super::{
    COLOR_BLEND, ContentsIfFirst, Endpoint, FrameContext, Pass, PassRecorder, Presence, ResourceUse, SetLayouts, Slot,
    frame_data, needed,
};
use crate::gpu::{self, Device, sync::Use};
use crate::plan::FramePlan;
use crate::shaders::tone::{self as shader, Flags, constants};

/// Multiplies the picture's light.
pub const PICTURE_BLEND: Use = COLOR_BLEND;

pub const PASS: Pass = Pass {
    name: Endpoint::pass("TONE"),
    time: "tone",
    what: "darkens the picture as a lens and a film do: vignette and grain",
    presence: |plan| {
        Presence::when(is_in(plan), "vignette or grain are asked for", "neither vignette nor grain is asked for")
    },
    touches: |plan| {
        vec![
            ResourceUse::color(0, plan.picture(), ContentsIfFirst::Undefined, PICTURE_BLEND)
                .because("multiplies what is finished of its pixel"),
            frame_data(),
        ]
    },
    leave_out: Some(|settings| (settings.vignette, settings.grain) = (0.0, 0.0)),
    make: Some(|own| Ok(Box::new(TonePass::new(own.device, own.plan, own.slot()?, own.layouts)?))),
};

fn is_in(plan: &FramePlan) -> bool {
    plan.on_picture.vignette > 0.0 || plan.on_picture.grain > 0.0
}

pub struct TonePass {
    screen: Screen,
}

impl TonePass {
    pub fn new(device: &Arc<Device>, plan: &FramePlan, slot: &Slot, layouts: SetLayouts) -> gpu::Result<Self> {
        let shader = needed("tone", shader::variant, Flags::NONE)?;
        let screen = Screen::new(
            device,
            &ScreenDesc {
                name: "tone",
                slot,
                shader,
                constants: &[
                    (constants::VIGNETTE, plan.on_picture.vignette.to_bits()),
                    (constants::GRAIN, plan.on_picture.grain.to_bits()),
                ],
                set_layouts: &[layouts.frame],
                // The background is seen through the same lens.
                skip_sky: false,
                blend: multiply(),
            },
        )?;
        Ok(Self { screen })
    }
}

impl PassRecorder for TonePass {
    /// Darkens the picture. Runs inside its subpass.
    fn record(&self, context: &FrameContext) {
        context.set_area();
        self.screen.record(context, &[(0, context.frame_set)]);
    }
}

/// Blends by multiplying source and destination; a target with sRGB encoding blends linear light.
fn multiply() -> vk::PipelineColorBlendAttachmentState {
    replace()
        .blend_enable(true)
        .src_color_blend_factor(vk::BlendFactor::DST_COLOR)
        .dst_color_blend_factor(vk::BlendFactor::ZERO)
        .src_alpha_blend_factor(vk::BlendFactor::ZERO)
        .dst_alpha_blend_factor(vk::BlendFactor::ONE)
}
