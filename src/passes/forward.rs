//! FORWARD: opaque surfaces, lit while they are rasterized, in GEOMETRY's and LIGHTING's place.

use super::screen::replace;
use super::surface::{Limits, LitDesc, SurfacePipelines, lit_pipeline, opaque_depth};
use super::{
    COLOR_WRITE, ContentsIfFirst, EARLY_DEPTH_READ, Endpoint, FrameContext, LATE_DEPTH_WRITE, Making, Pass,
    PassRecorder, Presence, ResourceUse, SAMPLED, culled, frame_data, looked_up, maps, meshes,
};
use crate::gpu::{self, sync::Use};
use crate::plan::FramePlan;
use crate::shaders::forward::Flags;

/// Clears, tests and writes depth, as DEPTH does before it in the same subpass: early, and late if a mask may discard. The store operation is a late
/// write.
pub const DEPTH_TEST: Use = EARLY_DEPTH_READ.or(LATE_DEPTH_WRITE);
/// Writes the light target; its clear is a write too.
pub const LIGHT_WRITE: Use = COLOR_WRITE;

/// Looks shadow maps up.
pub const MAP_READ: Use = SAMPLED;

pub const PASS: Pass = Pass {
    name: Endpoint::pass("FORWARD"),
    time: "forward",
    what: "surfaces, lit while they are rasterized",
    presence: |plan| {
        let why_not = match plan.shading.is_lit() {
            true if plan.triangles.is_some() => "TILED lights every pixel, by compute",
            true => "the light path has a G-buffer",
            false => "this view is not lit",
        };
        Presence::when(plan.is_forward(), "surfaces are lit as they are drawn", why_not)
    },
    touches: |plan| {
        let drawn = [
            ResourceUse::depth(ContentsIfFirst::Clear, DEPTH_TEST)
                .because("clears depth, tests against it and writes it"),
            ResourceUse::color(0, plan.light_target(), ContentsIfFirst::Clear, LIGHT_WRITE)
                .because("clears the light and draws it"),
            frame_data(),
        ];
        drawn
            .into_iter()
            .chain(meshes(plan))
            .chain(culled(plan))
            .chain(maps(plan, MAP_READ))
            .chain(looked_up(plan))
            .collect()
    },
    leave_out: None,
    make: Some(|own| Ok(Box::new(ForwardPass::new(own)?))),
};

/// The pass: a pipeline for each [`GeometryKey`](crate::plan::GeometryKey) of the plan.
pub struct ForwardPass {
    surfaces: SurfacePipelines,
}

impl ForwardPass {
    fn new(own: &Making) -> gpu::Result<Self> {
        let &Making { device, layouts, plan, scene, .. } = own;
        let slot = own.slot()?;
        let mut surfaces = SurfacePipelines::new(device, plan, ("forward", &plan.geometry), layouts, scene)?;
        for &key in &plan.geometry {
            let desc = LitDesc {
                name: "forward",
                weighted: Flags::NONE,
                limits: Limits::unweighted(plan.largest_light(), 0.0),
                masked: key.discards,
                depth: opaque_depth(plan, key),
                blend: &[replace()],
            };
            let pipeline = lit_pipeline(device, plan, slot, key, surfaces.layout(key), &desc)?;
            surfaces.insert(key, pipeline);
        }
        Ok(Self { surfaces })
    }
}

impl PassRecorder for ForwardPass {
    /// Draws visible objects. Runs inside its subpass.
    fn record(&self, context: &FrameContext) {
        self.surfaces.record_opaque(context);
    }
}

/// Returns the shader variant of one of the plan's pipelines.
pub fn flags(plan: &FramePlan, key: crate::plan::GeometryKey) -> Flags {
    super::surface::lit_flags(plan, key)
}
