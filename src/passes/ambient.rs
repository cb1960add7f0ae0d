//! AMBIENT: light from everywhere, added to LIGHTING's, in its subpass, where more than half-spheres lights the scene.

use ash::vk;

use super::screen::{InputSet, Screen, ScreenDesc, add};
use super::{
    Endpoint, FrameContext, Making, Pass, PassRecorder, Presence, Resource, ResourceUse, SAMPLED, frame_data, maps,
    needed,
};
use crate::gpu::{self, sync::Use};
use crate::gpu_scene::SKY_READ;
use crate::plan::{FramePlan, Shading};
use crate::shaders::ambient::{self as shader, Flags, constants};

/// Looks up the shadow maps of the sky's light.
pub const MAP_READ: Use = SAMPLED;

pub const PASS: Pass = Pass {
    name: Endpoint::pass("AMBIENT"),
    time: "ambient",
    what: "light of the sky on every pixel, added to LIGHTING's",
    presence: |plan| match plan.shading {
        Shading::Light { .. } if !plan.is_lit_by_sky() => Presence::Out("no sky lights the scene".into()),
        Shading::Light { .. } if plan.is_forward() => Presence::Out("surfaces are lit as they are drawn".into()),
        Shading::Light { .. } => Presence::In("the sky lights the scene".into()),
        _ => Presence::Out("this view is not lit".into()),
    },
    // It draws into the attachments of the pass before it.
    touches: |plan| {
        let maps = maps(plan, MAP_READ).filter(|_| plan.has_sky_shadows());
        [frame_data(), ResourceUse::resource(Resource::SkyLight, SKY_READ)].into_iter().chain(maps).collect()
    },
    leave_out: Some(|settings| settings.sky_light = false),
    make: Some(|own| Ok(Box::new(AmbientPass::new(own)?))),
};

/// The pass: its constants set by the plan.
pub struct AmbientPass {
    /// As LIGHTING's.
    screens: Vec<Screen>,
    pub inputs: InputSet,
    /// The sky's light has shadow maps.
    shadows: bool,
}

impl AmbientPass {
    fn new(own: &Making) -> gpu::Result<Self> {
        let &Making { device, layouts, plan, .. } = own;
        let slot = own.slot()?;
        let inputs = InputSet::new(device, "G-buffer inputs of AMBIENT", &own.inputs())?;
        let shadows = layouts.shadows.filter(|_| plan.has_sky_shadows());
        let set_layouts: Vec<_> = [layouts.frame, inputs.set_layout.raw].into_iter().chain(shadows).collect();
        let screen = |name, flags| {
            let shader = needed("ambient", shader::variant, flags)?;
            let constants = &constants_of(plan);
            let desc =
                ScreenDesc { name, slot, shader, constants, set_layouts: &set_layouts, skip_sky: true, blend: add() };
            Screen::multisampled(device, &desc, plan.sample_count())
        };
        let mut screens = vec![screen("ambient", flags(plan))?];
        if plan.msaa > 1 {
            screens.push(screen("ambient by sample", flags(plan) | Flags::PER_SAMPLE)?);
        }
        Ok(Self { screens, inputs, shadows: shadows.is_some() })
    }
}

impl PassRecorder for AmbientPass {
    /// Adds the light. Runs inside LIGHTING's subpass, after all other light.
    fn record(&self, context: &FrameContext) {
        let mut sets = vec![(0, context.frame_set), (1, self.inputs.set)];
        sets.extend(context.shadow_set.filter(|_| self.shadows).map(|set| (2, set)));
        self.screens.iter().for_each(|screen| screen.record(context, &sets));
    }

    fn rebind(&mut self, own: &Making) -> gpu::Result<()> {
        self.inputs.rebind(own.device, &own.inputs())
    }
}

/// Returns the shader variant of a plan.
pub(crate) fn flags(plan: &FramePlan) -> Flags {
    gbuffer_flags!(plan) | Flags::MSAA.when(plan.msaa > 1) | Flags::SHADOW.when(plan.has_sky_shadows())
}

fn constants_of(plan: &FramePlan) -> Vec<(u32, u32)> {
    let gbuffer = plan.gbuffer.as_ref();
    let own = [
        (constants::BRDF, plan.brdf.constant()),
        (constants::METAL, u32::from(plan.metal)),
        (constants::REFLECTANCE, u32::from(plan.reflectance)),
        (constants::ORTHOGRAPHIC, u32::from(plan.orthographic)),
        (constants::NORMAL_ENCODING, gbuffer.map_or(0, |gbuffer| gbuffer.normal_encoding as u32)),
        (constants::GEOMETRIC_STEPS, gbuffer.map_or(0.0, |gbuffer| gbuffer.geometric_steps()).to_bits()),
        (constants::LARGEST, plan.largest_light().to_bits()),
        (constants::LIGHT_ONLY, u32::from(plan.shading == Shading::Light { light_only: true })),
        (constants::SAMPLES, plan.msaa),
        // LIGHTING has them.
        (constants::AMBIENT, 0),
    ];
    [&own[..], &sky_constants!(plan)].concat()
}
