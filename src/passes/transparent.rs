//! TRANSPARENT: surfaces that show what lies behind them, lit while they are rasterized, over the picture that LIGHTING has made. Sorted,
//! each over what is there; or summed up with weights in any order, for COMPOSITE to lay over the picture.

use std::sync::Arc;

use ash::vk;

use super::surface::{LitDesc, Surfaces, lit_pipeline};
use super::{Recording, SetLayouts, Slot};
use crate::gpu::{self, DepthState, Device, sync::Use};
use crate::gpu_scene::GpuScene;
use crate::plan::FramePlan;
use crate::scene::Transparency;
use crate::shaders::forward::Flags;

/// Compares with the depth of what is opaque; nothing is written. Both stages read: which one does it is the implementation's choice.
pub const DEPTH_READ: Use = Use::new(
    vk::PipelineStageFlags::from_raw(
        vk::PipelineStageFlags::EARLY_FRAGMENT_TESTS.as_raw() | vk::PipelineStageFlags::LATE_FRAGMENT_TESTS.as_raw(),
    ),
    vk::AccessFlags::DEPTH_STENCIL_ATTACHMENT_READ,
);
/// As the last user of depth it performs the store, and DONT_CARE counts as a write.
pub const DEPTH_DROP: Use =
    Use::new(vk::PipelineStageFlags::LATE_FRAGMENT_TESTS, vk::AccessFlags::DEPTH_STENCIL_ATTACHMENT_WRITE);
/// Blends over the light, or adds to the sums, whose clears are writes too.
pub const BLEND: Use = Use::new(
    vk::PipelineStageFlags::COLOR_ATTACHMENT_OUTPUT,
    vk::AccessFlags::from_raw(
        vk::AccessFlags::COLOR_ATTACHMENT_WRITE.as_raw() | vk::AccessFlags::COLOR_ATTACHMENT_READ.as_raw(),
    ),
);

/// The pass: a pipeline for each transparent [`GeometryKey`] of the plan.
pub struct Transparent {
    surfaces: Surfaces,
}

impl Transparent {
    /// `layouts` are those of set 0 and, where the plan has shadow maps, of set 2.
    ///
    /// # Errors
    /// When a pipeline cannot be made.
    pub fn new(
        device: &Arc<Device>,
        plan: &FramePlan,
        slot: Slot,
        layouts: SetLayouts,
        scene: &GpuScene,
    ) -> gpu::Result<Self> {
        let mut surfaces = Surfaces::new(device, plan, "transparent", layouts, scene)?;
        for &key in &plan.transparent {
            let limits = Limits::of(plan);
            let desc = LitDesc {
                name: "transparent",
                weighted: weighted(plan),
                limits: (limits.share, limits.highlight, limits.weight),
                masked: key.masked,
                // Reversed Z. What is opaque hides what is behind it; transparent surfaces hide nothing.
                depth: DepthState { test: vk::CompareOp::GREATER, write: false },
                blend: &blend(plan),
            };
            let pipeline = lit_pipeline(device, plan, slot, key, surfaces.layout(key), &desc)?;
            surfaces.insert(key, pipeline);
        }
        Ok(Self { surfaces })
    }

    /// Draws what is visible, the farthest first. Runs inside its subpass.
    pub fn record(&self, recording: &Recording) {
        let draws = recording.visible.transparent.iter().map(|draw| (draw.object, draw.first_index));
        self.surfaces.record(recording, recording.sorted, draws);
    }
}

/// Sums have outputs of their own.
fn weighted(plan: &FramePlan) -> Flags {
    if plan.transparency == Some(Transparency::Oit) { Flags::WEIGHTED } else { Flags::NONE }
}

/// Which variant of the shader a pipeline of the plan takes.
#[cfg(test)]
pub(crate) fn flags(plan: &FramePlan, key: crate::plan::GeometryKey) -> Flags {
    super::surface::lit_flags(plan, key) | weighted(plan)
}

/// What a layer may be, so that no sum of layers overflows its target. A layer's colour is at most `share` times its alpha plus
/// `highlight` (`shaders/forward.wgsl`); no pixel has more layers than the scene has transparent triangles, T.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Limits {
    share: f32,
    highlight: f32,
    weight: f32,
}

impl Limits {
    fn of(plan: &FramePlan) -> Self {
        let layers = plan.transparent_triangles.max(1) as f32;
        let largest = plan.largest_light();
        let half = plan.light_format() != vk::Format::R32G32B32A32_SFLOAT;
        match plan.transparency {
            // Single floats overflow nowhere: 1e30 times a weight, 2^32 times.
            _ if !half => Self { share: largest, highlight: largest / layers, weight: 1.0 / layers },
            // Sums are at most T weight (share + highlight) <= 64000, and alpha's T weight. What is tone-mapped is white long before 64,
            // so that the weights of up to 500 triangles need not shrink; in nits nothing may be cut off.
            Some(Transparency::Oit) => {
                let most = if plan.has_tonemap_subpass() { 64.0 } else { largest };
                Self { share: most, highlight: most, weight: (64000.0 / (2.0 * most * layers)).min(1.0) }
            }
            // A layer over a picture p gives p (1 - alpha) + share alpha + highlight <= max(p, share) + highlight: T layers over 32000 stay
            // below 32000 + T highlight <= 64000. A highlight of 16 is white however it is tone-mapped, so that more than 2000
            // triangles do not dim it; for them to overflow, more than 2000 such highlights would have to lie on one pixel.
            _ => Self { share: largest, highlight: (largest / layers).max(16.0), weight: 1.0 },
        }
    }
}

/// One state for each colour location of the subpass.
fn blend(plan: &FramePlan) -> Vec<vk::PipelineColorBlendAttachmentState> {
    match plan.transparency {
        Some(Transparency::Oit) => vec![sum(), multiply()],
        _ => vec![super::screen::over()],
    }
}

/// Adds up all four channels.
fn sum() -> vk::PipelineColorBlendAttachmentState {
    super::screen::add().dst_alpha_blend_factor(vk::BlendFactor::ONE)
}

/// Times 1 minus the value.
fn multiply() -> vk::PipelineColorBlendAttachmentState {
    super::screen::replace()
        .blend_enable(true)
        .src_color_blend_factor(vk::BlendFactor::ZERO)
        .dst_color_blend_factor(vk::BlendFactor::ONE_MINUS_SRC_COLOR)
        .color_blend_op(vk::BlendOp::ADD)
        .src_alpha_blend_factor(vk::BlendFactor::ZERO)
        .dst_alpha_blend_factor(vk::BlendFactor::ONE)
        .alpha_blend_op(vk::BlendOp::ADD)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gpu_scene::{NORMAL, POSITION, TANGENT, UV};
    use crate::plan::samples;
    use crate::shaders::forward as shader;

    #[test]
    fn every_pipeline_has_a_shader_that_reads_only_streams_of_the_plan() {
        let mut pipelines = 0;
        for (name, plan) in samples::plans() {
            let streams = plan.streams;
            for &key in &plan.transparent {
                let flags = flags(&plan, key);
                let variant = shader::variant(flags).unwrap_or_else(|| panic!("{name}: no variant {flags:?}"));
                for input in variant.vertex().expect("a vertex stage").vertex_inputs {
                    let present = match input.location {
                        POSITION => true,
                        NORMAL => streams.normals,
                        UV => streams.uvs,
                        TANGENT => streams.tangents,
                        other => panic!("{name}: no stream for location {other}"),
                    };
                    assert!(present, "{name} {key:?}: {} is not in {streams:?}", input.name);
                }
                let outputs = variant.fragment().expect("a fragment stage").fragment_outputs.len();
                assert_eq!(outputs, blend(&plan).len(), "{name}");
                pipelines += 1;
            }
        }
        assert!(pipelines > 0);
    }

    #[test]
    fn no_sum_of_layers_overflows_a_half_float() {
        for (name, plan) in samples::plans() {
            let Some(transparency) = plan.transparency else { continue };
            for triangles in [1, 2, 500, 501, 2000] {
                let mut plan = plan.clone();
                plan.transparent_triangles = triangles;
                let Limits { share, highlight, weight } = Limits::of(&plan);
                let layers = f64::from(triangles);
                let most = match transparency {
                    Transparency::Sorted => f64::from(plan.largest_light()) + layers * f64::from(highlight),
                    Transparency::Oit => layers * f64::from(weight) * (f64::from(share) + f64::from(highlight)),
                };
                // Room for the rounding of the sum: a step of half floats is 32 there.
                let half = plan.light_format() != vk::Format::R32G32B32A32_SFLOAT;
                let limit = if half { 64000.0 * 1.000_001 } else { 1e31 };
                assert!(most <= limit, "{name}: {triangles} layers reach {most}");
                assert!(share > 0.0 && highlight > 0.0 && weight > 0.0, "{name}");
            }
        }
    }
}
