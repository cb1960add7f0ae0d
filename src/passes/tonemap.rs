//! TONEMAP: the HDR target to the output.

use super::screen::{InputSet, Screen, ScreenDesc, replace};
use super::spread::{self, SpreadLight};
use super::{
    COLOR_WRITE, ContentsIfFirst, Endpoint, FrameContext, INPUT_READ, Making, Pass, PassRecorder, Presence,
    ResourceUse, needed,
};
use crate::gpu::{self, sync::Use};
use crate::plan::{FramePlan, Target, ToneMapping};
use crate::scene::Resolve;
use crate::shaders::tonemap::{self as shader, Flags, constants};

/// Reads its own pixel of the HDR target.
pub const HDR_READ: Use = INPUT_READ;
/// Writes the output; its undefined load is a write too.
pub const OUTPUT_WRITE: Use = COLOR_WRITE;

// ANCHOR: pass
pub const PASS: Pass = Pass {
    name: Endpoint::pass("TONEMAP"),
    time: "tonemap",
    what: "scene light into display light",
    presence: |plan| {
        let why_not = match plan.tone_mapping {
            ToneMapping::AfterFrames(_) => "the CPU averages frames before it tone-maps them",
            ToneMapping::Absent if plan.shading.is_lit() => "the output itself is linear",
            ToneMapping::Absent => "a view is not tone-mapped",
            _ => "nothing blends between lighting and the output",
        };
        Presence::when(plan.has_tonemap_subpass(), "light is blended or averaged before it is tone-mapped", why_not)
    },
    touches: |plan| {
        let light = ResourceUse::input(0, Target::Hdr, HDR_READ)
            .of_all_samples(plan.msaa > 1)
            .because("reads the light of its pixel");
        let output = ResourceUse::color(0, Target::Output, ContentsIfFirst::Undefined, OUTPUT_WRITE)
            .because("draws the picture");
        [light, output].into_iter().chain(spread::touch(plan)).collect()
    },
    leave_out: None,
    make: Some(|own| Ok(Box::new(TonemapPass::new(own)?))),
};
// ANCHOR_END: pass

pub struct TonemapPass {
    screen: Screen,
    pub inputs: InputSet,
    /// Spread light to add, if the plan has it.
    spread: Option<SpreadLight>,
}

impl TonemapPass {
    /// Binds the HDR target, and spread light if the plan has it.
    fn new(own: &Making) -> gpu::Result<Self> {
        let &Making { device, plan, .. } = own;
        let (curve, kept) = match plan.tone_mapping {
            ToneMapping::Subpass(curve) => (curve as u32, 0),
            _ if plan.has_tonemap_subpass() => (0, 1),
            _ => return Err(gpu::Error::Unsupported("a TONEMAP subpass that the plan does not have".into())),
        };
        let inputs = InputSet::new(device, "HDR input", &own.inputs())?;
        let spread = SpreadLight::new(own)?;
        let sets = [Some(inputs.set_layout.raw), spread.as_ref().map(SpreadLight::layout)];
        let shader = needed("tonemap", shader::variant, flags(plan))?;
        let screen = Screen::new(
            device,
            &ScreenDesc {
                name: "tonemap",
                slot: own.slot()?,
                shader,
                constants: &[
                    (constants::OPERATOR, curve),
                    (constants::HEADROOM, plan.headroom().to_bits()),
                    (constants::KEPT, kept),
                    (constants::LARGEST, plan.largest_shown().to_bits()),
                    (constants::TAPS, spread::taps(plan)),
                    (constants::SAMPLES, plan.msaa),
                    (constants::LINEAR, u32::from(plan.resolve == Resolve::Linear)),
                ],
                set_layouts: &sets.into_iter().flatten().collect::<Vec<_>>(),
                // The background is tone-mapped as well.
                skip_sky: false,
                blend: replace(),
            },
        )?;
        Ok(Self { screen, inputs, spread })
    }
}

impl PassRecorder for TonemapPass {
    /// Tone-maps the picture. Runs inside its subpass.
    fn record(&self, context: &FrameContext) {
        // The passes that spread light have left no viewport.
        if self.spread.is_some() {
            context.set_area();
        }
        let spread = self.spread.as_ref().map(|own| (1, own.set()));
        self.screen.record(context, &[(0, self.inputs.set)].into_iter().chain(spread).collect::<Vec<_>>());
    }

    fn rebind(&mut self, own: &Making) -> gpu::Result<()> {
        self.inputs.rebind(own.device, &own.inputs())?;
        self.spread.as_mut().map_or(Ok(()), |spread| spread.rebind(own))
    }
}

/// Returns the shader variant of a plan.
pub(crate) fn flags(plan: &FramePlan) -> Flags {
    Flags::MSAA.when(plan.msaa > 1) | Flags::SPREAD.when(spread::is_in(plan))
}
