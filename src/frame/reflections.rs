//! HIZ, REFLECT and REFLECT_RESOLVE, between the lit picture and the layers that are blended over it.

use super::FrameParts;
use super::ao::images;
use super::edges::{Edge, RowName};
use super::list::{self, Occasion, Step};
use super::render_passes::{RenderPasses, image_barrier};
use crate::gpu::{self, Timestamps};
use crate::passes::hiz::{self, Hiz};
use crate::passes::{PerPixel, Recording, Resource, reflect, reflect_resolve};
use crate::plan::{FramePlan, Target};

/// The three passes with the rows of the barriers around them.
pub struct ReflectStage {
    hiz: Hiz,
    reflect: PerPixel,
    resolve: PerPixel,
    hiz_reuse: Option<Edge>,
    hiz_to_reflect: Option<Edge>,
    rays_reuse: Option<Edge>,
    rays_to_resolve: Option<Edge>,
    light_to_resolve: Option<Edge>,
    /// Present if TAA or BLOOM is the next to read the light.
    light_to_reader: Option<Edge>,
}

/// The row of the barrier for the next to read the light, where that is a compute pass.
fn to_reader(plan: &FramePlan) -> Option<RowName> {
    match (plan.averages_reflected(), plan.blooms_reflected()) {
        (true, _) => Some(RowName::LIGHT_TO_TAA),
        (false, true) => Some(RowName::HDR_TO_BLOOM),
        (false, false) => None,
    }
}

/// The steps of the three in a frame's list.
pub(super) fn steps(plan: &FramePlan) -> [Option<Step>; 3] {
    let [hiz, rays, light] = [Target::Hiz, Target::Rays, Target::Hdr].map(Resource::Target);
    let always = Occasion::Always;
    // A render pass changes the light's layout as it loads it.
    let after: Vec<_> = to_reader(plan).map(|row| (row, light)).into_iter().collect();
    [
        list::commands(plan, always, &hiz::PASS, &[(RowName::HIZ_REUSE, hiz)], &[]),
        list::commands(
            plan,
            always,
            &reflect::PASS,
            &[(RowName::HIZ_TO_REFLECT, hiz), (RowName::RAYS_REUSE, rays)],
            &[],
        ),
        list::commands(
            plan,
            always,
            &reflect_resolve::PASS,
            &[(RowName::RAYS_TO_RESOLVE, rays), (RowName::LIGHT_TO_RESOLVE, light)],
            &after,
        ),
    ]
}

impl ReflectStage {
    /// Returns none if the plan has no reflections.
    ///
    /// # Errors
    /// When the device cannot compile a pipeline.
    pub fn new(parts: &FrameParts, passes: &RenderPasses) -> gpu::Result<Option<Self>> {
        let &FrameParts { device, plan, edges, frame_layout, .. } = parts;
        if !plan.reflects() {
            return Ok(None);
        }
        let row = |name| edges.find(name).cloned();
        Ok(Some(Self {
            hiz: Hiz::new(device, plan, frame_layout, &images(passes, &hiz::PASS, plan))?,
            reflect: reflect::new(device, plan, frame_layout, &images(passes, &reflect::PASS, plan))?,
            resolve: reflect_resolve::new(device, plan, frame_layout, &images(passes, &reflect_resolve::PASS, plan))?,
            hiz_reuse: row(RowName::HIZ_REUSE),
            hiz_to_reflect: row(RowName::HIZ_TO_REFLECT),
            rays_reuse: row(RowName::RAYS_REUSE),
            rays_to_resolve: row(RowName::RAYS_TO_RESOLVE),
            light_to_resolve: row(RowName::LIGHT_TO_RESOLVE),
            light_to_reader: to_reader(plan).and_then(row),
        }))
    }

    /// Makes the descriptor sets anew that name images of the picture's size.
    ///
    /// # Errors
    /// When there is no memory for a set.
    pub fn rebind(&mut self, parts: &FrameParts, passes: &RenderPasses) -> gpu::Result<()> {
        let &FrameParts { device, plan, .. } = parts;
        self.hiz.rebind(device, plan, &images(passes, &hiz::PASS, plan))?;
        self.reflect.rebind(device, &images(passes, &reflect::PASS, plan))?;
        self.resolve.rebind(device, &images(passes, &reflect_resolve::PASS, plan))
    }

    /// Records the three, outside a render pass.
    pub fn record(&self, frame: &Recording, passes: &RenderPasses, times: &mut Option<Timestamps>) {
        let barrier = |target, row: &Option<Edge>| {
            image_barrier(frame.device, frame.cmd, passes.targets.image(target), row.as_ref())
        };
        frame.begin(&hiz::PASS);
        // REFLECT of the last frame may still read the pyramid.
        barrier(Target::Hiz, &self.hiz_reuse);
        self.hiz.record(frame);
        frame.end(times, &hiz::PASS);
        frame.begin(&reflect::PASS);
        // It reads the pyramid, and REFLECT_RESOLVE of the last frame may still read what it writes.
        barrier(Target::Hiz, &self.hiz_to_reflect);
        barrier(Target::Rays, &self.rays_reuse);
        self.reflect.record(frame, frame.size);
        frame.end(times, &reflect::PASS);
        frame.begin(&reflect_resolve::PASS);
        // It reads what rays found, and adds to the light that they were compared with.
        barrier(Target::Rays, &self.rays_to_resolve);
        barrier(Target::Hdr, &self.light_to_resolve);
        self.resolve.record(frame, frame.size);
        // TAA or BLOOM read the light.
        barrier(Target::Hdr, &self.light_to_reader);
        frame.end(times, &reflect_resolve::PASS);
    }
}
