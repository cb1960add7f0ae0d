//! REFLECT: a ray of each smooth surface's lobe, marched through the stored depth, and the light of the pixel that it meets.

use ash::vk;

use super::per_pixel::{PerPixelPass, sampled_gbuffer};
use super::{Endpoint, Pass, Presence, ResourceUse, frame_data, needed};
use crate::gpu::sync::Use;
use crate::plan::{FramePlan, HIZ, RAYS, ReflectionPlan, Target};
use crate::scene::Reflections;
use crate::shaders::reflect::{self as shader, Flags, constants};

/// Reads the G-buffer, of its pixel and of others.
const GBUFFER_READ: Use = Use::new(vk::PipelineStageFlags2::COMPUTE_SHADER, vk::AccessFlags2::SHADER_READ);
/// Reads the light of the pixel that a ray meets.
pub const LIGHT_READ: Use = Use::new(vk::PipelineStageFlags2::COMPUTE_SHADER, vk::AccessFlags2::SHADER_READ);
/// Reads squares of the pyramid.
pub const HIZ_READ: Use = Use::new(vk::PipelineStageFlags2::COMPUTE_SHADER, vk::AccessFlags2::SHADER_READ);
/// Writes every texel.
pub const RAYS_WRITE: Use = Use::new(vk::PipelineStageFlags2::COMPUTE_SHADER, vk::AccessFlags2::SHADER_WRITE);

pub const PASS: Pass = Pass {
    name: Endpoint::pass("REFLECT"),
    time: "reflect",
    what: "a ray of each smooth pixel through the depth buffer, and the light that it meets",
    presence: |plan| match &plan.effects.reflections {
        Some(own) => Presence::In(own.to_string()),
        None => Presence::Out(plan.reasons.lack_of("reflections").into()),
    },
    touches: |plan| {
        let mut touches = sampled_gbuffer(plan, GBUFFER_READ);
        touches.extend([
            ResourceUse::sampled(6, Target::Hdr, LIGHT_READ).because("reads the light where rays hit"),
            ResourceUse::sampled(7, HIZ, HIZ_READ).because("reads squares that other work groups of HIZ wrote"),
            ResourceUse::storage(8, RAYS, RAYS_WRITE).because("writes what its rays found"),
            frame_data(),
        ]);
        touches
    },
    leave_out: Some(|settings| settings.reflections = Reflections::Off),
    make: Some(|own| {
        let shader = needed("reflect", shader::variant, flags(own.plan))?;
        Ok(Box::new(PerPixelPass::new(own, ("reflect", shader), &constants_of(own.plan))?))
    }),
};

/// Returns the shader variant of a plan.
pub(crate) fn flags(plan: &FramePlan) -> Flags {
    let gbuffer = plan.gbuffer.as_ref();
    Flags::SPECULAR.when(gbuffer.is_some_and(|gbuffer| gbuffer.specular.is_some()))
        | Flags::NORMAL_UINT.when(gbuffer.is_some_and(|gbuffer| gbuffer.normal == vk::Format::R16G16_UINT))
}

fn constants_of(plan: &FramePlan) -> Vec<(u32, u32)> {
    let Some(ReflectionPlan { roughness, steps, thickness, shown: _ }) = plan.effects.reflections else {
        return Vec::new();
    };
    vec![
        (constants::ORTHOGRAPHIC, u32::from(plan.orthographic)),
        (constants::NORMAL_ENCODING, plan.gbuffer.as_ref().map_or(0, |gbuffer| gbuffer.normal_encoding as u32)),
        (constants::BRDF, plan.brdf.constant()),
        (constants::REFLECTANCE, u32::from(plan.reflectance)),
        (constants::ROUGHEST, roughness.to_bits()),
        (constants::STEPS, steps),
        (constants::THICKNESS, thickness.to_bits()),
    ]
}
