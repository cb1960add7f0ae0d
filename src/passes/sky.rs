//! SKY: the sky on pixels without a surface, in the subpass that lights surfaces, after them.

use std::sync::Arc;

use super::screen::{Screen, ScreenDesc, replace};
use super::{
    Endpoint, FrameContext, Pass, PassRecorder, Presence, Resource, ResourceUse, SetLayouts, Slot, frame_data, needed,
};
use crate::gpu::{self, Device};
use crate::gpu_scene::TEXTURE_READ;
use crate::plan::{FramePlan, Shading, ToneMapping};
use crate::shaders::sky::{self as shader, Flags, constants};

pub const PASS: Pass = Pass {
    name: Endpoint::pass("SKY"),
    time: "sky",
    what: "the sky, where nothing is seen before it",
    presence: |plan| match &plan.effects.sky {
        Some(sky) if sky.shown => Presence::In("the scene has a sky".into()),
        Some(_) => Presence::Out("this view has no background".into()),
        None if plan.shading == (Shading::Light { light_only: false }) => {
            Presence::Out("the scene has no sky, but a background of one colour".into())
        }
        None => Presence::Out("this view has no background".into()),
    },
    // It draws into the attachments of the pass before it.
    touches: |_| vec![frame_data(), ResourceUse::resource(Resource::Textures, TEXTURE_READ)],
    leave_out: None,
    make: Some(|own| Ok(Box::new(SkyPass::new(own.device, own.plan, own.slot()?, own.layouts)?))),
};

pub struct SkyPass {
    screen: Screen,
}

impl SkyPass {
    pub fn new(device: &Arc<Device>, plan: &FramePlan, slot: &Slot, layouts: SetLayouts) -> gpu::Result<Self> {
        let shader = needed("sky", shader::variant, Flags::NONE)?;
        let (tone_map, curve) = match plan.tone_mapping {
            ToneMapping::InLighting(curve) => (1, curve as u32),
            _ => (0, 0),
        };
        let sun = plan.effects.sky.as_ref().is_some_and(|sky| sky.sun);
        let desc = ScreenDesc {
            name: "sky",
            slot,
            shader,
            constants: &[
                (constants::SUN, u32::from(sun)),
                (constants::ORTHOGRAPHIC, u32::from(plan.orthographic)),
                (constants::TONE_MAP, tone_map),
                (constants::OPERATOR, curve),
                (constants::HEADROOM, plan.headroom().to_bits()),
                (constants::LARGEST, plan.largest_light().to_bits()),
            ],
            set_layouts: &[layouts.frame],
            skip_sky: false,
            blend: replace(),
        };
        Ok(Self { screen: Screen::behind(device, &desc, plan.sample_count())? })
    }
}

impl PassRecorder for SkyPass {
    /// Draws the sky. Runs inside its subpass.
    fn record(&self, context: &FrameContext) {
        context.set_area();
        self.screen.record(context, &[(0, context.frame_set)]);
    }
}
