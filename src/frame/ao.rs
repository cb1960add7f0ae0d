//! AO and AO_DENOISE between the G-buffer and the light: the same in the rasterized frame and in the computed one.

use super::FrameParts;
use super::edges::{Edge, RowName};
use super::list::{self, Occasion, Step};
use super::render_passes::{RenderPasses, image_barrier};
use crate::gpu::{self, Timestamps};
use crate::passes::ao::{self, Ao};
use crate::passes::ao_denoise;
use crate::passes::{Bound, How, Pass, PerPixel, Recording, Resource};
use crate::plan::{FramePlan, Target};

/// The two passes with the rows of the barriers around them.
pub struct AoStage {
    ao: Ao,
    denoise: PerPixel,
    reuse: Option<Edge>,
    ao_to_denoise: Option<Edge>,
    denoise_to_tiled: Option<Edge>,
}

/// Returns the images that a pass reads and stores to, at its bindings.
pub(super) fn images(passes: &RenderPasses, pass: &Pass, plan: &FramePlan) -> Vec<Bound> {
    let all = (pass.touches)(plan).into_iter().filter_map(|touch| {
        let Resource::Target(target) = touch.resource else { return None };
        let image = passes.targets.image(target);
        match touch.how {
            How::Sampled { binding } => Some((binding, image.view, touch.layout())),
            How::Storage { binding } => Some((binding, image.storage_view, touch.layout())),
            _ => None,
        }
    });
    all.collect()
}

/// The steps of the two in a frame's list.
pub(super) fn steps(plan: &FramePlan) -> [Option<Step>; 2] {
    let [visibility, albedo] = [Target::Visibility, Target::Albedo].map(Resource::Target);
    // In the rasterized frame the main pass changes the albedo's layout as it loads it.
    let after: &[_] = if plan.is_tiled() { &[(RowName::OCCLUSION_TO_TILED, albedo)] } else { &[] };
    [
        list::commands(plan, Occasion::Always, &ao::PASS, &[(RowName::VISIBILITY_REUSE, visibility)], &[]),
        list::commands(
            plan,
            Occasion::Always,
            &ao_denoise::PASS,
            &[(RowName::VISIBILITY_TO_DENOISE, visibility)],
            after,
        ),
    ]
}

impl AoStage {
    /// Returns none if the plan has no ambient occlusion.
    ///
    /// # Errors
    /// When the device cannot compile a pipeline.
    pub fn new(parts: &FrameParts, passes: &RenderPasses) -> gpu::Result<Option<Self>> {
        let &FrameParts { device, plan, edges, frame_layout, .. } = parts;
        if !plan.has_ao() {
            return Ok(None);
        }
        let row = |name| edges.find(name).cloned();
        Ok(Some(Self {
            ao: Ao::new(device, plan, frame_layout, &images(passes, &ao::PASS, plan))?,
            denoise: ao_denoise::new(device, plan, frame_layout, &images(passes, &ao_denoise::PASS, plan))?,
            reuse: row(RowName::VISIBILITY_REUSE),
            ao_to_denoise: row(RowName::VISIBILITY_TO_DENOISE),
            denoise_to_tiled: row(RowName::OCCLUSION_TO_TILED),
        }))
    }

    /// Makes the descriptor sets anew that name images of the picture's size.
    ///
    /// # Errors
    /// When there is no memory for a set.
    pub fn rebind(&mut self, parts: &FrameParts, passes: &RenderPasses) -> gpu::Result<()> {
        let &FrameParts { device, plan, .. } = parts;
        self.ao.rebind(device, plan, &images(passes, &ao::PASS, plan))?;
        self.denoise.rebind(device, &images(passes, &ao_denoise::PASS, plan))
    }

    /// Records both, outside a render pass.
    pub fn record(&self, frame: &Recording, passes: &RenderPasses, times: &mut Option<Timestamps>) {
        let barrier = |target, row: &Option<Edge>| {
            image_barrier(frame.device, frame.cmd, passes.targets.image(target), row.as_ref())
        };
        frame.begin(&ao::PASS);
        // AO_DENOISE of the last frame may still read AO's output.
        barrier(Target::Visibility, &self.reuse);
        self.ao.record(frame);
        frame.end(times, &ao::PASS);
        frame.begin(&ao_denoise::PASS);
        // It reads what AO found around each pixel.
        barrier(Target::Visibility, &self.ao_to_denoise);
        self.denoise.record(frame, frame.size);
        // TILED reads the occlusion with the albedo.
        barrier(Target::Albedo, &self.denoise_to_tiled);
        frame.end(times, &ao_denoise::PASS);
    }
}
