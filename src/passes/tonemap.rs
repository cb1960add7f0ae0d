//! TONEMAP: the HDR target to the output.

use std::sync::Arc;

use ash::vk;

use super::screen::{Input, Inputs, Screen, ScreenDesc, replace};
use super::{
    COLOR_WRITE, First, INPUT_READ, Making, Object, Pass, Place, Presence, Recording, Resource, SAMPLED, Slot, Touch,
    needed,
};
use crate::gpu::{self, Buffer, DescriptorPool, Device, SetLayout, SetWriter, binding, sync::Use};
use crate::plan::{BLOOM_LEVELS, FramePlan, Target, ToneMapping};
use crate::scene::Resolve;
use crate::shaders::tonemap::{self as shader, Flags, constants};

/// Reads its own pixel of the HDR target.
pub const HDR_READ: Use = INPUT_READ;
/// Reads the light that BLOOM has spread, from a buffer.
pub const LEVEL_READ: Use = SAMPLED;
/// Writes the output; its undefined load is a write too.
pub const OUTPUT_WRITE: Use = COLOR_WRITE;

// ANCHOR: pass
pub const PASS: Pass = Pass {
    place: Place::pass("TONEMAP"),
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
        let levels = plan.effects.bloom.map(|_| {
            Touch::resource(Resource::Buffers(BLOOM_LEVELS), LEVEL_READ).because("reads the first level of bloom")
        });
        let light = Touch::input(0, Target::Hdr, HDR_READ)
            .of_all_samples(plan.msaa > 1)
            .because("reads the light of its pixel");
        let output = Touch::color(0, Target::Output, First::Undefined, OUTPUT_WRITE).because("draws the picture");
        [light, output].into_iter().chain(levels).collect()
    },
    leave_out: None,
    make: Some(|own| {
        let levels = own.buffers(Resource::Buffers(BLOOM_LEVELS)).next();
        Ok(Box::new(TonemapPass::new(own.device, own.plan, own.slot()?, &own.inputs(), levels)?))
    }),
};
// ANCHOR_END: pass

/// The pass.
pub struct TonemapPass {
    screen: Screen,
    pub inputs: Inputs,
    levels: Option<Levels>,
}

/// The set with the light that BLOOM has spread.
struct Levels {
    layout: SetLayout,
    pool: DescriptorPool,
    set: vk::DescriptorSet,
}

impl TonemapPass {
    /// `inputs` are the HDR target, `levels` those of BLOOM, where the plan has it.
    pub fn new(
        device: &Arc<Device>,
        plan: &FramePlan,
        slot: Slot,
        inputs: &[Input],
        levels: Option<&Buffer>,
    ) -> gpu::Result<Self> {
        let (curve, kept) = match plan.tone_mapping {
            ToneMapping::Subpass(curve) => (curve as u32, 0),
            _ if plan.has_tonemap_subpass() => (0, 1),
            _ => return Err(gpu::Error::Unsupported("a TONEMAP subpass that the plan does not have".into())),
        };
        let inputs = Inputs::new(device, "HDR input", inputs)?;
        let levels = levels.map(|levels| Levels::new(device, levels)).transpose()?;
        let sets = [Some(inputs.set_layout.raw), levels.as_ref().map(|own| own.layout.raw)];
        let shader = needed("tonemap", shader::variant, flags(plan))?;
        let screen = Screen::new(
            device,
            &ScreenDesc {
                name: "tonemap",
                slot,
                shader,
                constants: &[
                    (constants::OPERATOR, curve),
                    (constants::HEADROOM, plan.headroom().to_bits()),
                    (constants::KEPT, kept),
                    (constants::LARGEST, plan.largest_shown().to_bits()),
                    (constants::TAPS, plan.effects.bloom.map_or(0, |bloom| bloom.taps)),
                    (constants::SAMPLES, plan.msaa),
                    (constants::LINEAR, u32::from(plan.resolve == Resolve::Linear)),
                ],
                set_layouts: &sets.into_iter().flatten().collect::<Vec<_>>(),
                // The background is tone-mapped as well.
                skip_sky: false,
                blend: replace(),
            },
        )?;
        Ok(Self { screen, inputs, levels })
    }

    /// Reads others, as of another size.
    ///
    /// # Errors
    /// When there is no memory for a set.
    pub fn read_from(&mut self, device: &Arc<Device>, inputs: &[Input], levels: Option<&Buffer>) -> gpu::Result<()> {
        self.inputs.read_from(device, inputs)?;
        match (&mut self.levels, levels) {
            (Some(own), Some(levels)) => own.read_from(device, levels),
            _ => Ok(()),
        }
    }
}

impl Object for TonemapPass {
    /// Tone-maps the picture. Runs inside its subpass.
    fn record(&self, recording: &Recording) {
        // BLOOM has left no viewport.
        if self.levels.is_some() {
            recording.set_area();
        }
        let levels = self.levels.as_ref().map(|own| (1, own.set));
        self.screen.record(recording, &[(0, self.inputs.set)].into_iter().chain(levels).collect::<Vec<_>>());
    }

    fn rebind(&mut self, own: &Making) -> gpu::Result<()> {
        self.read_from(own.device, &own.inputs(), own.buffers(Resource::Buffers(BLOOM_LEVELS)).next())
    }
}

impl Levels {
    fn new(device: &Arc<Device>, levels: &Buffer) -> gpu::Result<Self> {
        let kind = vk::DescriptorType::STORAGE_BUFFER;
        let layout = SetLayout::new(device, "spread light", &[binding(0, kind, vk::ShaderStageFlags::FRAGMENT)])?;
        let (pool, set) = bound(device, &layout, levels)?;
        Ok(Self { layout, pool, set })
    }

    fn read_from(&mut self, device: &Arc<Device>, levels: &Buffer) -> gpu::Result<()> {
        (self.pool, self.set) = bound(device, &self.layout, levels)?;
        Ok(())
    }
}

fn bound(
    device: &Arc<Device>,
    layout: &SetLayout,
    levels: &Buffer,
) -> gpu::Result<(DescriptorPool, vk::DescriptorSet)> {
    let pool = DescriptorPool::new(device, "spread light", 1, &[(vk::DescriptorType::STORAGE_BUFFER, 1)])?;
    let set = pool.allocate("spread light", layout.raw)?;
    SetWriter::new().storage_buffer(0, levels, levels.size).update(device, set);
    Ok((pool, set))
}

/// Returns the shader variant of a plan.
pub(crate) fn flags(plan: &FramePlan) -> Flags {
    Flags::MSAA.when(plan.msaa > 1) | Flags::BLOOM.when(plan.effects.bloom.is_some())
}
