//! VIEW: one of the frame's buffers in LIGHTING's place. Rows know the two by that name: they touch things in the same way.

use ash::vk;

use super::screen::{InputSet, Screen, ScreenDesc, replace};
use super::{
    COLOR_WRITE, ContentsIfFirst, DEPTH_COMPARE, Endpoint, FrameContext, INPUT_READ, Making, Pass, PassRecorder,
    Presence, ResourceUse, SAMPLED, frame_data, gbuffer_inputs, light_maps, needed,
};
use crate::gpu::{self, SetLayout, sync::Use};
use crate::plan::{FramePlan, Gbuffer, Shading, Target, effects};
use crate::scene::View;
use crate::shaders::view::{self as shader, Flags, constants, host};

/// Compares with the depth of the sky.
const DEPTH_READ: Use = DEPTH_COMPARE;
/// Writes the output; its clear is a write too.
const OUTPUT_WRITE: Use = COLOR_WRITE;
/// Shows shadow maps.
const MAP_READ: Use = SAMPLED;

pub const PASS: Pass = Pass {
    name: Endpoint::pass("VIEW"),
    time: "lighting",
    what: "shows a buffer instead of lighting it",
    presence: |plan| {
        let is_in = !matches!(plan.shading, Shading::Light { .. });
        Presence::when(is_in, "the view shows a buffer", "the picture is lit")
    },
    touches,
    leave_out: None,
    make: Some(|own| Ok(Box::new(ViewPass::new(own)?))),
};

fn touches(plan: &FramePlan) -> Vec<ResourceUse> {
    let input = |(binding, target)| {
        ResourceUse::input(binding, target, INPUT_READ)
            .of_all_samples(plan.msaa > 1)
            .because("reads the buffer that it shows")
    };
    let mut touches: Vec<_> = gbuffer_inputs(plan).into_iter().map(input).collect();
    touches
        .push(ResourceUse::color(0, Target::Output, ContentsIfFirst::Clear, OUTPUT_WRITE).because("draws the picture"));
    if plan.lighting_tests_depth() {
        touches.push(
            ResourceUse::depth(ContentsIfFirst::Undefined, DEPTH_READ).because("compares with the depth of the sky"),
        );
    }
    touches.push(frame_data());
    touches.extend(light_maps(plan, MAP_READ));
    touches
}

pub struct ViewPass {
    screen: Screen,
    pub inputs: Option<InputSet>,
    _empty: Option<SetLayout>,
}

impl ViewPass {
    fn new(own: &Making) -> gpu::Result<Self> {
        let &Making { device, layouts, plan, .. } = own;
        let inputs = own.inputs();
        let inputs = if inputs.is_empty() { None } else { Some(InputSet::new(device, "view inputs", &inputs)?) };
        // The shadow maps are in set 2: where nothing is in set 1, its place in the layout is empty.
        let empty = match &inputs {
            None => Some(SetLayout::new(device, "no inputs", &[])?),
            Some(_) => None,
        };
        let input_layout =
            inputs.as_ref().map(|inputs| inputs.set_layout.raw).or(empty.as_ref().map(|empty| empty.raw));
        let flags = flags(plan);
        let shader = needed("view", shader::variant, flags)?;
        let mut set_layouts = vec![layouts.frame];
        set_layouts.extend(input_layout);
        set_layouts.extend(layouts.shadows);
        let screen = Screen::new(
            device,
            &ScreenDesc {
                name: "view",
                slot: own.slot()?,
                shader,
                constants: &constants_of(plan),
                set_layouts: &set_layouts,
                skip_sky: plan.lighting_tests_depth(),
                blend: replace(),
            },
        )?;
        Ok(Self { screen, inputs, _empty: empty })
    }
}

impl PassRecorder for ViewPass {
    /// Draws the view. Runs inside its subpass.
    fn record(&self, context: &FrameContext) {
        context.set_area();
        let mut sets = vec![(0, context.frame_set)];
        sets.extend(self.inputs.as_ref().map(|inputs| (1, inputs.set)));
        sets.extend(context.shadow_set.map(|set| (2, set)));
        self.screen.record(context, &sets);
    }

    fn rebind(&mut self, own: &Making) -> gpu::Result<()> {
        match &mut self.inputs {
            Some(inputs) => inputs.rebind(own.device, &own.inputs()),
            None => Ok(()),
        }
    }
}

/// Returns the shader variant of a plan.
pub fn flags(plan: &FramePlan) -> Flags {
    match (plan.shading, &plan.gbuffer) {
        (Shading::ShowOverdraw, _) => Flags::OVERDRAW,
        (Shading::ShowTriangle, _) => Flags::TRIANGLE,
        (Shading::ShowShadowMap, _) => Flags::SHADOW_MAP,
        (_, None) => Flags::NONE,
        (_, Some(_)) => {
            Flags::GBUFFER
                | Flags::LIGHTS.when(plan.lights.any())
                | Flags::UNIFORM_BUFFER.when(plan.lights.any() && plan.lights.uniform)
                | gbuffer_flags!(plan)
                | Flags::MSAA.when(plan.msaa > 1)
        }
    }
}

fn constants_of(plan: &FramePlan) -> Vec<(u32, u32)> {
    let gbuffer = plan.gbuffer.as_ref();
    let show = match plan.shading {
        Shading::ShowGbuffer(View::Position) => host::SHOW_POSITION,
        Shading::ShowGbuffer(View::Normal) => host::SHOW_NORMAL,
        Shading::ShowGbuffer(View::NormalAbsolute) => host::SHOW_NORMAL_ABSOLUTE,
        Shading::ShowGbuffer(View::Albedo) => host::SHOW_ALBEDO,
        Shading::ShowGbuffer(View::Metallic) => host::SHOW_METALLIC,
        Shading::ShowGbuffer(View::Roughness) => host::SHOW_ROUGHNESS,
        Shading::ShowGbuffer(View::Depth) => host::SHOW_DEPTH,
        // Views of effects have their own codes.
        Shading::ShowGbuffer(view) => effects::shown_in_gbuffer(view).unwrap_or(host::SHOW_LIGHTS),
        _ => host::SHOW_LIGHTS,
    };
    vec![
        (constants::SHOW, show),
        (constants::SAMPLES, plan.msaa),
        (constants::ORTHOGRAPHIC, u32::from(plan.orthographic)),
        (constants::NORMAL_ENCODING, gbuffer.map_or(0, |gbuffer| gbuffer.normal_encoding as u32)),
        (constants::GEOMETRIC_STEPS, gbuffer.map_or(0.0, Gbuffer::geometric_steps).to_bits()),
        (constants::ENCODED_OUTPUT, u32::from(plan.encodes_output())),
    ]
}
