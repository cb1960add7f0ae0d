//! FXAA: edges of the finished picture, smoothed. A render pass of its own, because each pixel reads its neighbours.

use std::sync::Arc;

use ash::vk;

use super::screen::{Screen, ScreenDesc, replace, sampled_bindings, sampled_set};
use super::{COLOR_WRITE, First, Making, Object, Pass, Place, Presence, Recording, SAMPLED, Slot, Touch, needed};
use crate::gpu::{self, DescriptorPool, Device, Sampler, SetLayout, sync::Use};
use crate::plan::{SMOOTHED, Target};
use crate::shaders::fxaa::{self as shader, Flags};

/// Samples the output as the render pass before left it.
pub const OUTPUT_READ: Use = SAMPLED;
/// Writes every pixel of the picture; its undefined load is a write too.
pub const PICTURE_WRITE: Use = COLOR_WRITE;

/// The pass.
pub struct Fxaa {
    screen: Screen,
    set: vk::DescriptorSet,
    set_layout: SetLayout,
    pool: DescriptorPool,
    sampler: Sampler,
}

pub const PASS: Pass = Pass {
    place: Place::pass("FXAA"),
    time: "fxaa",
    what: "smooths edges, and so reads each pixel's neighbours",
    presence: |plan| Presence::when(plan.effects.fxaa, "asked for", "not asked for"),
    touches: |_| {
        vec![
            Touch::sampled(0, Target::Output, OUTPUT_READ).because("samples the picture around its pixel"),
            Touch::color(0, SMOOTHED, First::Undefined, PICTURE_WRITE).because("draws the smoothed picture"),
        ]
    },
    leave_out: Some(|settings| settings.fxaa = false),
    make: Some(|own| Ok(Box::new(Fxaa::new(own.device, own.slot()?, own.targets.image(Target::Output).view)?))),
};

impl Fxaa {
    /// `output` is the sampled image.
    pub fn new(device: &Arc<Device>, slot: Slot, output: vk::ImageView) -> gpu::Result<Self> {
        let set_layout = SetLayout::new(device, "FXAA set layout", &sampled_bindings())?;
        let sampler = Sampler::bilinear(device, "FXAA sampler")?;
        let (pool, set) = sampled_set(device, "FXAA", &set_layout, output, &sampler)?;
        let shader = needed("fxaa", shader::variant, Flags::NONE)?;
        let screen = Screen::new(
            device,
            &ScreenDesc {
                name: "fxaa",
                slot,
                shader,
                constants: &[],
                set_layouts: &[set_layout.raw],
                skip_sky: false,
                blend: replace(),
            },
        )?;
        Ok(Self { screen, set, set_layout, pool, sampler })
    }

    /// Samples another image, as of another size.
    pub fn read_from(&mut self, device: &Arc<Device>, output: vk::ImageView) -> gpu::Result<()> {
        (self.pool, self.set) = sampled_set(device, "FXAA", &self.set_layout, output, &self.sampler)?;
        Ok(())
    }
}

impl Object for Fxaa {
    /// Smooths the picture. Runs inside its render pass.
    fn record(&self, recording: &Recording) {
        recording.set_area();
        self.screen.record(recording, &[(0, self.set)]);
    }

    fn rebind(&mut self, own: &Making) -> gpu::Result<()> {
        self.read_from(own.device, own.targets.image(Target::Output).view)
    }
}
