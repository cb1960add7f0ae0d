//! AO_DENOISE: the mean of AO's values over the coplanar pixels around each pixel, times the occlusion that the G-buffer stores in the albedo's
//! alpha. LIGHTING and TILED read the product as they read the alpha without AO.

use ash::vk;

use super::per_pixel::PerPixelPass;
use super::{Endpoint, Pass, Presence, ResourceUse, frame_data, needed};
use crate::gpu::sync::Use;
use crate::plan::{FramePlan, Target, VISIBILITY};
use crate::scene::AmbientOcclusion;
use crate::shaders::ao_denoise::{self as shader, Flags, constants};

/// Reads the depth and the normal of its pixel.
const GBUFFER_READ: Use = Use::new(vk::PipelineStageFlags2::COMPUTE_SHADER, vk::AccessFlags2::SHADER_READ);
/// Reads AO's values around its pixel.
pub const VISIBILITY_READ: Use = Use::new(vk::PipelineStageFlags2::COMPUTE_SHADER, vk::AccessFlags2::SHADER_READ);
/// Multiplies its own pixel's occlusion.
pub const ALBEDO_BLEND: Use = Use::new(
    vk::PipelineStageFlags2::COMPUTE_SHADER,
    vk::AccessFlags2::from_raw(vk::AccessFlags2::SHADER_READ.as_raw() | vk::AccessFlags2::SHADER_WRITE.as_raw()),
);

/// The binding of the albedo.
pub const ALBEDO: u32 = 3;

const READS: &str = "reads depth and normal of its pixel";

pub const PASS: Pass = Pass {
    name: Endpoint::pass("AO_DENOISE"),
    time: "ao denoise",
    what: "what AO found around each pixel in the mean, into the G-buffer's occlusion",
    presence: |plan| {
        Presence::when(plan.has_ao(), "AO differs from pixel to pixel", plan.reasons.lack_of("ambient occlusion"))
    },
    touches: |_| {
        vec![
            ResourceUse::sampled(0, Target::Depth, GBUFFER_READ).because(READS),
            ResourceUse::sampled(1, Target::Normal, GBUFFER_READ).because(READS),
            ResourceUse::sampled(2, VISIBILITY, VISIBILITY_READ).because("reads what AO found around each pixel"),
            ResourceUse::storage(ALBEDO, Target::Albedo, ALBEDO_BLEND)
                .because("multiplies the occlusion beside the albedo"),
            frame_data(),
        ]
    },
    leave_out: Some(|settings| settings.ao = AmbientOcclusion::Off),
    make: Some(|own| {
        let shader = needed("ao_denoise", shader::variant, flags(own.plan))?;
        Ok(Box::new(PerPixelPass::new(own, ("ao_denoise", shader), &constants_of(own.plan))?))
    }),
};

/// Returns the shader variant of a plan.
pub(crate) fn flags(plan: &FramePlan) -> Flags {
    let gbuffer = plan.gbuffer.as_ref();
    let albedo = gbuffer.map(|gbuffer| gbuffer.albedo);
    Flags::NORMAL_UINT.when(gbuffer.is_some_and(|gbuffer| gbuffer.normal == vk::Format::R16G16_UINT))
        | Flags::HALF_ALBEDO.when(albedo == Some(vk::Format::R16G16B16A16_SFLOAT))
        | Flags::SINGLE_ALBEDO.when(albedo == Some(vk::Format::R32G32B32A32_SFLOAT))
}

fn constants_of(plan: &FramePlan) -> Vec<(u32, u32)> {
    let Some(ao) = &plan.effects.ao else { return Vec::new() };
    vec![
        (constants::ORTHOGRAPHIC, u32::from(plan.orthographic)),
        (constants::NORMAL_ENCODING, plan.gbuffer.as_ref().map_or(0, |gbuffer| gbuffer.normal_encoding as u32)),
        (constants::RADIUS, ao.radius.to_bits()),
        (constants::SCALE, ao.scale),
    ]
}
