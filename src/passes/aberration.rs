//! ABERRATION: red and blue of the finished picture, drawn apart as a lens does. A render pass of its own, because each pixel reads others.

use std::sync::Arc;

use ash::vk;

use super::screen::{Screen, ScreenDesc, replace, sampled_bindings, sampled_set};
use super::{COLOR_WRITE, First, Making, Object, Pass, Place, Presence, Recording, SAMPLED, Slot, Touch, needed};
use crate::gpu::{self, DescriptorPool, Device, Sampler, SetLayout, sync::Use};
use crate::plan::APART;
use crate::shaders::aberration::{self as shader, Flags, constants};

/// Samples the picture as the render pass before left it.
pub const PICTURE_READ: Use = SAMPLED;
/// Writes every pixel of the new picture; its undefined load is a write too.
pub const APART_WRITE: Use = COLOR_WRITE;

/// The pass.
pub struct Aberration {
    screen: Screen,
    set: vk::DescriptorSet,
    set_layout: SetLayout,
    pool: DescriptorPool,
    sampler: Sampler,
}

pub const PASS: Pass = Pass {
    place: Place::pass("ABERRATION"),
    time: "aberration",
    what: "draws red and blue apart, and so reads other pixels",
    presence: |plan| Presence::when(plan.effects.aberration.is_some(), "asked for", "not asked for"),
    touches: |plan| {
        vec![
            Touch::sampled(0, plan.picture_before(APART), PICTURE_READ)
                .because("samples the picture farther out and farther in than its pixel"),
            Touch::color(0, APART, First::Undefined, APART_WRITE).because("draws the picture with its colours apart"),
        ]
    },
    leave_out: Some(|settings| settings.aberration = 0.0),
    make: Some(|own| Ok(Box::new(Aberration::new(own)?))),
};

/// The image that is sampled.
fn picture(own: &Making) -> vk::ImageView {
    own.targets.image(own.plan.picture_before(APART)).view
}

impl Aberration {
    fn new(own: &Making) -> gpu::Result<Self> {
        let device: &Arc<Device> = own.device;
        let set_layout = SetLayout::new(device, "ABERRATION set layout", &sampled_bindings())?;
        let sampler = Sampler::bilinear(device, "ABERRATION sampler")?;
        let (pool, set) = sampled_set(device, "ABERRATION", &set_layout, picture(own), &sampler)?;
        let slot: Slot = own.slot()?;
        let screen = Screen::new(
            device,
            &ScreenDesc {
                name: "aberration",
                slot,
                shader: needed("aberration", shader::variant, Flags::NONE)?,
                constants: &[(constants::SHARE, own.plan.effects.aberration.unwrap_or_default().to_bits())],
                set_layouts: &[set_layout.raw],
                // The background is seen through the same lens.
                skip_sky: false,
                blend: replace(),
            },
        )?;
        Ok(Self { screen, set, set_layout, pool, sampler })
    }
}

impl Object for Aberration {
    /// Draws the colours apart. Runs inside its render pass.
    fn record(&self, recording: &Recording) {
        recording.set_area();
        self.screen.record(recording, &[(0, self.set)]);
    }

    fn rebind(&mut self, own: &Making) -> gpu::Result<()> {
        (self.pool, self.set) = sampled_set(own.device, "ABERRATION", &self.set_layout, picture(own), &self.sampler)?;
        Ok(())
    }
}
