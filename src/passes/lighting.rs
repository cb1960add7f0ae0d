//! LIGHTING: every light on every pixel that has a surface, from the G-buffer through input attachments.

use ash::vk;

use super::screen::{InputSet, Screen, ScreenDesc, add, replace};
use super::{
    COLOR_BLEND, COLOR_WRITE, ContentsIfFirst, DEPTH_COMPARE, Endpoint, FrameContext, INPUT_READ, Making, Pass,
    PassRecorder, Presence, ResourceUse, SAMPLED, frame_data, gbuffer_inputs, light_maps, needed,
};
use crate::gpu::{self, sync::Use};
use crate::plan::{FramePlan, Shading, ToneMapping};
use crate::shaders::lighting::{self as shader, Flags, constants};

/// Reads its own pixel of the G-buffer.
pub const GBUFFER_READ: Use = INPUT_READ;
/// Compares with the depth of the sky. Both stages read: which one does it is the implementation's choice.
pub const DEPTH_READ: Use = DEPTH_COMPARE;
/// Looks shadow maps up.
pub const MAP_READ: Use = SAMPLED;
/// Writes the light target; its clear is a write too.
pub const LIGHT_WRITE: Use = COLOR_WRITE;
/// Adds to the emissive light that is there.
pub const LIGHT_BLEND: Use = COLOR_BLEND;

pub const PASS: Pass = Pass {
    name: Endpoint::pass("LIGHTING"),
    time: "lighting",
    what: "every light on every pixel, which reads its own place of the G-buffer",
    presence: |plan| match plan.shading {
        Shading::Light { .. } if plan.is_forward() => Presence::Out("surfaces are lit as they are drawn".into()),
        Shading::Light { .. } if plan.is_tiled() => Presence::Out("TILED lights every pixel, by compute".into()),
        Shading::Light { .. } => Presence::In("lights what GEOMETRY has stored of each pixel".into()),
        _ => Presence::Out("this view is not lit".into()),
    },
    touches,
    leave_out: None,
    make: Some(|own| Ok(Box::new(LightingPass::new(own)?))),
};

/// Returns true if an invocation reads all samples of its pixel, also where it lights one of them: whether all show one surface decides who lights them.
pub fn reads_all_samples(plan: &FramePlan) -> bool {
    plan.msaa > 1 && plan.shading.is_lit()
}

fn touches(plan: &FramePlan) -> Vec<ResourceUse> {
    let light = if plan.blends_light() { LIGHT_BLEND } else { LIGHT_WRITE };
    let input = |(binding, target)| {
        ResourceUse::input(binding, target, GBUFFER_READ)
            .of_all_samples(reads_all_samples(plan))
            .because("reads its own pixel of the G-buffer")
    };
    let mut touches: Vec<_> = gbuffer_inputs(plan).into_iter().map(input).collect();
    touches.push(ResourceUse::color(0, plan.light_target(), ContentsIfFirst::Clear, light).because("writes the light"));
    if plan.lighting_tests_depth() {
        touches.push(
            ResourceUse::depth(ContentsIfFirst::Undefined, DEPTH_READ).because("compares with the depth of the sky"),
        );
    }
    touches.push(frame_data());
    touches.extend(light_maps(plan, MAP_READ));
    touches
}

/// Each element is its own index: the shader takes numbers of lights from here, so that lavapipe knows them to be the same in all invocations.
type LightIndices = [u32; shader::host::PLACES as usize];

const _: () = assert!(size_of::<LightIndices>() == shader::push::SIZE && size_of::<LightIndices>() <= 128);

/// The pass: its constants set by the plan.
pub struct LightingPass {
    /// One pipeline; with several samples a pixel one for pixels whose samples agree, and one that shades the others' samples.
    screens: Vec<Screen>,
    pub inputs: InputSet,
    /// Only where lights are taken four at a time has the shader push constants.
    pushes: bool,
}

impl LightingPass {
    fn new(own: &Making) -> gpu::Result<Self> {
        let &Making { device, layouts, plan, .. } = own;
        let inputs = InputSet::new(device, "G-buffer inputs", &own.inputs())?;
        let mut set_layouts = vec![layouts.frame, inputs.set_layout.raw];
        set_layouts.extend(layouts.shadows);
        let screen = |name, flags| {
            let shader = needed("lighting", shader::variant, flags)?;
            let desc = ScreenDesc {
                name,
                slot: own.slot()?,
                shader,
                constants: &constants_of(plan),
                set_layouts: &set_layouts,
                skip_sky: true,
                blend: if plan.emissive { add() } else { replace() },
            };
            Screen::multisampled(device, &desc, plan.sample_count())
        };
        let mut screens = vec![screen("lighting", flags(plan))?];
        if plan.msaa > 1 {
            screens.push(screen("lighting by sample", flags(plan) | Flags::PER_SAMPLE)?);
        }
        Ok(Self { screens, inputs, pushes: plan.lights.by_fours })
    }
}

impl PassRecorder for LightingPass {
    /// Lights the picture. Runs inside its subpass.
    fn record(&self, context: &FrameContext) {
        let mut sets = vec![(0, context.frame_set), (1, self.inputs.set)];
        sets.extend(context.shadow_set.map(|set| (2, set)));
        for screen in &self.screens {
            if self.pushes {
                let places: LightIndices = std::array::from_fn(|index| index as u32);
                context.push(screen.layout.raw, vk::ShaderStageFlags::FRAGMENT, &places);
            }
            screen.record(context, &sets);
        }
    }

    fn rebind(&mut self, own: &Making) -> gpu::Result<()> {
        self.inputs.rebind(own.device, &own.inputs())
    }
}

// ANCHOR: variant
/// Returns the shader variant of a plan. The G-buffer's flags are the same in every shader that reads it.
pub fn flags(plan: &FramePlan) -> Flags {
    Flags::LIGHTS.when(plan.lights.any())
        | Flags::UNIFORM_BUFFER.when(plan.lights.any() && plan.lights.uniform)
        | Flags::CLUSTERED.when(plan.lights_by_clusters())
        | Flags::BY_FOURS.when(plan.lights.by_fours)
        | Flags::SHADOW.when(plan.has_light_maps())
        | gbuffer_flags!(plan)
        | Flags::MSAA.when(plan.msaa > 1)
}
// ANCHOR_END: variant

fn constants_of(plan: &FramePlan) -> Vec<(u32, u32)> {
    let (tone_map, curve) = match plan.tone_mapping {
        ToneMapping::InLighting(curve) => (1, curve as u32),
        _ => (0, 0),
    };
    let own = [
        (constants::AMBIENT, u32::from(plan.lights.ambient)),
        (constants::DIRECTIONAL, u32::from(plan.lights.directional)),
        (constants::PUNCTUAL, u32::from(plan.lights.punctual)),
        (constants::DIRECTIONAL_SHADOWS, u32::from(plan.has_directional_shadows())),
        (constants::TONE_MAP, tone_map),
        (constants::OPERATOR, curve),
        (constants::HEADROOM, plan.headroom().to_bits()),
        (constants::SAMPLES, plan.msaa),
    ];
    [&light_constants!(plan)[..], &own].concat()
}
