//! SHARPEN: TAA's mean, with its edges sharpened, becomes the light that BLOOM and TONEMAP read. The history itself stays unsharpened: sharpening it
//! in every frame would ring.

use std::sync::Arc;

use ash::vk;

use super::screen::{Screen, ScreenDesc, replace};
use super::{
    COLOR_READ, COLOR_WRITE, ContentsIfFirst, Endpoint, FrameContext, Making, Pass, PassRecorder, Presence, Resource,
    ResourceUse, SAMPLED, needed,
};
use crate::gpu::{self, Buffer, DescriptorPool, Device, SetLayout, SetWriter, binding, sync::Use};
use crate::plan::{TAA_MEAN, Target};
use crate::shaders::sharpen::{self as shader, Flags, constants};

/// Reads what TAA wrote, of a pixel and its neighbours.
pub const HISTORY_READ: Use = SAMPLED;
/// Loads the light and writes it anew.
pub const LIGHT_WRITE: Use = COLOR_WRITE.or(COLOR_READ);

pub const PASS: Pass = Pass {
    name: Endpoint::pass("SHARPEN"),
    time: "sharpen",
    what: "what was averaged over time, as light again, and sharpened",
    presence: |plan| Presence::when(plan.averages_over_time(), "asked for", plan.reasons.lack_of("TAA")),
    touches: |_| {
        vec![
            ResourceUse::resource(Resource::Kept(TAA_MEAN), HISTORY_READ).because("reads what TAA averaged"),
            ResourceUse::color(0, Target::Hdr, ContentsIfFirst::Undefined, LIGHT_WRITE)
                .because("overwrites the light that TAA has read"),
        ]
    },
    leave_out: None,
    make: Some(|own| Ok(Box::new(SharpenPass::new(own)?))),
};

pub struct SharpenPass {
    screen: Screen,
    layout: SetLayout,
    pool: DescriptorPool,
    /// Descriptor sets of the frames in flight, by frame index.
    sets: [vk::DescriptorSet; 2],
}

impl SharpenPass {
    fn new(own: &Making) -> gpu::Result<Self> {
        let &Making { device, plan, .. } = own;
        let planned = own.needed(plan.effects.taa.as_ref())?;
        let kind = vk::DescriptorType::STORAGE_BUFFER;
        let layout = SetLayout::new(device, "sharpen", &[binding(0, kind, vk::ShaderStageFlags::FRAGMENT)])?;
        let screen = Screen::new(
            device,
            &ScreenDesc {
                name: "sharpen",
                slot: own.slot()?,
                shader: needed("sharpen", shader::variant, Flags::NONE)?,
                constants: &[
                    (constants::SHARPNESS, planned.sharpness.to_bits()),
                    (constants::SHOWN, u32::from(planned.shown.is_some())),
                    (constants::AS_SHOWN, u32::from(planned.as_shown)),
                    (constants::LARGEST, plan.largest_shown().to_bits()),
                ],
                set_layouts: &[layout.raw],
                skip_sky: false,
                blend: replace(),
            },
        )?;
        let (pool, sets) = bound(device, &layout, histories(own)?)?;
        Ok(Self { screen, layout, pool, sets })
    }
}

impl PassRecorder for SharpenPass {
    /// Runs inside its subpass.
    fn record(&self, context: &FrameContext) {
        // TAA has left no viewport.
        context.set_area();
        self.screen.record(context, &[(0, self.sets[context.in_flight])]);
    }

    fn rebind(&mut self, own: &Making) -> gpu::Result<()> {
        (self.pool, self.sets) = bound(own.device, &self.layout, histories(own)?)?;
        Ok(())
    }
}

fn bound(
    device: &Arc<Device>,
    layout: &SetLayout,
    histories: [&Buffer; 2],
) -> gpu::Result<(DescriptorPool, [vk::DescriptorSet; 2])> {
    let pool = DescriptorPool::new(device, "sharpen", 2, &[(vk::DescriptorType::STORAGE_BUFFER, 2)])?;
    let set = |history: &Buffer| {
        let set = pool.allocate("sharpen", layout.raw)?;
        SetWriter::new().storage_buffer(0, history, history.size).update(device, set);
        Ok(set)
    };
    let sets = [set(histories[0])?, set(histories[1])?];
    Ok((pool, sets))
}

/// The histories of TAA.
fn histories<'a>(own: &Making<'a>) -> gpu::Result<[&'a Buffer; 2]> {
    Ok([own.buffer(Resource::Kept(TAA_MEAN))?, own.buffer(Resource::KeptBefore(TAA_MEAN))?])
}
