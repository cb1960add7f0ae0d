//! TRANSPARENT: surfaces that show what lies behind them, lit while they are rasterized, over the picture that LIGHTING has made. Sorted,
//! each over what is there; or summed up with weights in any order, for COMPOSITE to lay over the picture.

use std::sync::Arc;

use ash::vk;

use super::screen::stages;
use super::surface::{Surfaces, faces};
use super::{Recording, SetLayouts, Slot};
use crate::gpu::{self, DepthState, Device, GraphicsPipeline, GraphicsPipelineDesc, Owned, sync::Use};
use crate::gpu_scene::{GpuScene, vertex_input};
use crate::plan::{FramePlan, GeometryKey, Opacity};
use crate::scene::{TextureSlot, Transparency};
use crate::shaders::forward::{self as shader, Flags, constants};

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
            let pipeline = pipeline(device, plan, slot, key, surfaces.layout(key))?;
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

fn pipeline(
    device: &Arc<Device>,
    plan: &FramePlan,
    slot: Slot,
    key: GeometryKey,
    layout: vk::PipelineLayout,
) -> gpu::Result<Owned<vk::Pipeline>> {
    let flags = flags(plan, key);
    let Some(variant) = shader::variant(flags) else {
        return Err(gpu::Error::Unsupported(format!("forward.wgsl has no variant {flags:?}")));
    };
    let inputs = variant.vertex().map_or(&[][..], |entry| entry.vertex_inputs);
    let streams: Vec<u32> = inputs.iter().map(|input| input.location).collect();
    let (vertex_bindings, vertex_attributes) = vertex_input(&streams);
    let (cull_mode, front_face) = faces(key);
    GraphicsPipeline::new(
        device,
        &GraphicsPipelineDesc {
            name: &format!("transparent {key:?}"),
            stages: &stages(variant, &constants_of(plan, key)),
            vertex_bindings: &vertex_bindings,
            vertex_attributes: &vertex_attributes,
            cull_mode,
            front_face,
            // Reversed Z. What is opaque hides what is behind it; transparent surfaces hide nothing.
            depth: Some(DepthState { test: vk::CompareOp::GREATER, write: false }),
            depth_bias: false,
            depth_clamp: false,
            blend: &blend(plan),
            samples: vk::SampleCountFlags::TYPE_1,
            layout,
            render_pass: slot.render_pass,
            subpass: slot.subpass,
        },
    )
}

/// Which variant of the shader a pipeline of the plan takes.
pub(crate) fn flags(plan: &FramePlan, key: GeometryKey) -> Flags {
    let when = |condition: bool, flag: Flags| if condition { flag } else { Flags::NONE };
    when(!key.textures.is_empty(), Flags::TEXTURED)
        | when(key.textures.contains(TextureSlot::Normal), Flags::NORMAL_MAP)
        | when(plan.lights.any(), Flags::LIGHTS)
        | when(plan.lights.any() && plan.lights.uniform, Flags::UNIFORM_BUFFER)
        | when(plan.has_clusters(), Flags::CLUSTERED)
        | when(plan.shadow.is_some(), Flags::SHADOW)
        | when(plan.transparency == Some(Transparency::Oit), Flags::WEIGHTED)
}

fn constants_of(plan: &FramePlan, key: GeometryKey) -> Vec<(u32, u32)> {
    let has = |slot| u32::from(key.textures.contains(slot));
    let forward = key.forward;
    let limits = Limits::of(plan);
    vec![
        (constants::BASE_COLOR_TEXTURE, has(TextureSlot::BaseColor)),
        (constants::METALLIC_ROUGHNESS_TEXTURE, has(TextureSlot::MetallicRoughness)),
        (constants::OCCLUSION_TEXTURE, has(TextureSlot::Occlusion)),
        (constants::EMISSIVE_TEXTURE, has(TextureSlot::Emissive)),
        (constants::SPECULAR_TEXTURE, has(TextureSlot::Specular)),
        (constants::MASKED, u32::from(key.masked)),
        (constants::TWO_SIDED, u32::from(key.two_sided)),
        (constants::RECEIVES, u32::from(key.receives)),
        (constants::BRDF, forward.map_or(0, |forward| forward.brdf as u32)),
        (constants::PHONG, u32::from(key.phong)),
        (constants::EMISSIVE, u32::from(forward.is_some_and(|forward| forward.emissive))),
        (constants::AMBIENT, u32::from(plan.lights.ambient)),
        (constants::DIRECTIONAL, u32::from(plan.lights.directional)),
        (constants::PUNCTUAL, u32::from(plan.lights.punctual)),
        (constants::SPOT, u32::from(plan.lights.spot)),
        (constants::FALLOFF, plan.lights.falloff),
        (constants::RANGED, u32::from(plan.lights.ranged)),
        (constants::SHADOW_FILTER, plan.shadow.as_ref().map_or(0, |shadow| shadow.filter as u32)),
        (constants::LARGEST, limits.share.to_bits()),
        (constants::OPACITY, forward.map_or(Opacity::Hides, |forward| forward.opacity) as u32),
        (constants::HIGHLIGHT, limits.highlight.to_bits()),
        (constants::WEIGHT, limits.weight.to_bits()),
    ]
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
