//! COMPOSITE: lays the sums of weighted blending over the picture, as one layer.

use super::screen::{InputSet, Screen, ScreenDesc, over};
use super::{
    COLOR_BLEND, ContentsIfFirst, Endpoint, FrameContext, INPUT_READ, Making, Pass, PassRecorder, Presence,
    ResourceUse, needed,
};
use crate::gpu::{self, sync::Use};
use crate::plan::{FramePlan, OitTargets, Target};
use crate::shaders::composite::{self as shader, Flags, constants};

/// Reads its own pixel of the sums.
pub const SUM_READ: Use = INPUT_READ;
/// Blends over the light.
pub const LIGHT_BLEND: Use = COLOR_BLEND;

pub const PASS: Pass = Pass {
    name: Endpoint::pass("COMPOSITE"),
    time: "composite",
    what: "what was summed up without sorting, over the light",
    presence: |plan| {
        Presence::when(plan.sums.is_some(), "lays the sums of transparent surfaces over the light", plan.lack_of_sums())
    },
    touches: |plan| {
        vec![
            ResourceUse::input(0, Target::Accumulation, SUM_READ).because("reads the sums of its pixel"),
            ResourceUse::input(1, Target::Weights, SUM_READ).because("reads the sums of its pixel"),
            ResourceUse::color(0, plan.light_target(), ContentsIfFirst::Clear, LIGHT_BLEND)
                .because("blends over the light"),
        ]
    },
    leave_out: None,
    make: Some(|own| Ok(Box::new(CompositePass::new(own)?))),
};

pub struct CompositePass {
    screen: Screen,
    pub inputs: InputSet,
}

impl CompositePass {
    fn new(own: &Making) -> gpu::Result<Self> {
        let &Making { device, plan, .. } = own;
        let inputs = InputSet::new(device, "sums of transparent surfaces", &own.inputs())?;
        let shader = needed("composite", shader::variant, flags(plan))?;
        let screen = Screen::multisampled(
            device,
            &ScreenDesc {
                name: "composite",
                slot: own.slot()?,
                shader,
                constants: &[
                    (constants::LARGEST, plan.largest_light().to_bits()),
                    (constants::MOST, most(plan).to_bits()),
                ],
                set_layouts: &[inputs.set_layout.raw],
                // Transparent surfaces stand before the sky as well.
                skip_sky: false,
                blend: over(),
            },
            plan.sample_count(),
        )?;
        Ok(Self { screen, inputs })
    }
}

impl PassRecorder for CompositePass {
    /// Lays the layer over the picture. Runs inside its subpass.
    fn record(&self, context: &FrameContext) {
        self.screen.record(context, &[(0, self.inputs.set)]);
    }

    fn rebind(&mut self, own: &Making) -> gpu::Result<()> {
        self.inputs.rebind(own.device, &own.inputs())
    }
}

/// The largest finite value of the sums.
pub(super) fn most(plan: &FramePlan) -> f32 {
    if plan.sums == Some(OitTargets::SINGLE) { f32::MAX } else { 65504.0 }
}

/// Returns the shader variant of a plan.
pub(crate) fn flags(plan: &FramePlan) -> Flags {
    if plan.msaa > 1 { Flags::MSAA } else { Flags::NONE }
}
