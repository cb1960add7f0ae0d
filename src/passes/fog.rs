//! FOG: attenuates each pixel's light by the air, and adds the light that the air scatters to the eye, in a separate subpass after the one that
//! lights opaque surfaces.

use ash::vk;

use super::screen::{InputSet, Screen, ScreenDesc, add, replace};
use super::{
    COLOR_BLEND, ContentsIfFirst, Endpoint, FrameContext, INPUT_READ, Making, Pass, PassRecorder, Presence,
    ResourceUse, air, frame_data, needed,
};
use crate::gpu::{self, sync::Use};
use crate::plan::{FramePlan, Target};
use crate::scene::Fog;
use crate::shaders::fog::{self as shader, Flags, constants};

/// Reads the depth of its pixel.
pub const DEPTH_READ: Use = INPUT_READ;
/// Blends over the light.
pub const LIGHT_BLEND: Use = COLOR_BLEND;

pub const PASS: Pass = Pass {
    name: Endpoint::pass("FOG"),
    time: "fog",
    what: "what the air takes of the light, and what it scatters to the eye",
    presence: |plan| match &plan.effects.fog {
        Some(fog) if fog.alone => Presence::In("the view shows what the fog scatters".into()),
        Some(_) => Presence::In("fog lies between the eye and what it sees".into()),
        None => Presence::Out(plan.reasons.lack_of("fog").into()),
    },
    touches: |plan| {
        let own = [
            ResourceUse::input(0, Target::Depth, DEPTH_READ).because("reads the depth of its pixel"),
            ResourceUse::color(0, plan.light_target(), ContentsIfFirst::Clear, LIGHT_BLEND)
                .because("blends over the light"),
            frame_data(),
        ];
        own.into_iter().chain(air::touch(plan)).collect()
    },
    leave_out: Some(|settings| settings.fog = Fog::Off),
    make: Some(|own| Ok(Box::new(FogPass::new(own)?))),
};

/// The pass: its constants set by the plan.
pub struct FogPass {
    screen: Screen,
    pub inputs: InputSet,
}

impl FogPass {
    fn new(own: &Making) -> gpu::Result<Self> {
        let &Making { device, layouts, plan, .. } = own;
        let inputs = InputSet::new(device, "depth for FOG", &own.inputs())?;
        let mut constants = vec![
            (constants::LARGEST, plan.largest_light().to_bits()),
            (constants::ORTHOGRAPHIC, u32::from(plan.orthographic)),
        ];
        constants.extend(air::froxel_grid!(plan));
        if plan.msaa > 1 {
            constants.push((constants::SAMPLES, plan.msaa));
        }
        let desc = ScreenDesc {
            name: "fog",
            slot: own.slot()?,
            shader: needed("fog", shader::variant, flags(plan))?,
            constants: &constants,
            set_layouts: &[layouts.frame, inputs.set_layout.raw],
            // Fog lies before the sky as well.
            skip_sky: false,
            blend: if plan.effects.fog.is_some_and(|fog| fog.alone) { replace() } else { over_what_is_left() },
        };
        Ok(Self { screen: Screen::multisampled(device, &desc, plan.sample_count())?, inputs })
    }
}

impl PassRecorder for FogPass {
    /// Lays the fog over the picture. Runs inside its subpass.
    fn record(&self, context: &FrameContext) {
        context.set_area();
        self.screen.record(context, &[(0, context.frame_set), (1, self.inputs.set)]);
    }

    fn rebind(&mut self, own: &Making) -> gpu::Result<()> {
        self.inputs.rebind(own.device, &own.inputs())
    }
}

/// Returns the shader variant of a plan.
pub(crate) fn flags(plan: &FramePlan) -> Flags {
    Flags::LIGHTS.when(plan.lights.any())
        | Flags::FROXELS.when(plan.froxels().is_some())
        | Flags::MSAA.when(plan.msaa > 1)
}

/// Adds the scattered light to the share, in alpha, of the light below it. The picture itself stays opaque.
fn over_what_is_left() -> vk::PipelineColorBlendAttachmentState {
    add()
        .dst_color_blend_factor(vk::BlendFactor::SRC_ALPHA)
        .src_alpha_blend_factor(vk::BlendFactor::ZERO)
        .dst_alpha_blend_factor(vk::BlendFactor::ONE)
}
