//! REFLECT_RESOLVE: adds the light found by the rays of a pixel and of its neighbours to the pixel's light, weighted by its lobe. It replaces the sky
//! light and the ambient light that the pixel has for this share of the lobe.

use ash::vk;

use super::per_pixel::{PerPixelPass, sampled_gbuffer};
use super::{Endpoint, Pass, Presence, Resource, ResourceUse, frame_data, needed};
use crate::gpu::sync::Use;
use crate::plan::{FramePlan, RAYS, Target};
use crate::shaders::reflect_resolve::{self as shader, Flags, constants};

/// Reads the G-buffer at the pixel, and the depth of neighbouring pixels.
pub const GBUFFER_READ: Use = Use::new(vk::PipelineStageFlags2::COMPUTE_SHADER, vk::AccessFlags2::SHADER_READ);
/// Reads the ray hits of the pixel and of its neighbours.
pub const RAYS_READ: Use = Use::new(vk::PipelineStageFlags2::COMPUTE_SHADER, vk::AccessFlags2::SHADER_READ);
/// Samples the light that surfaces collect of the sky.
pub const SKY_READ: Use = Use::new(vk::PipelineStageFlags2::COMPUTE_SHADER, vk::AccessFlags2::SHADER_READ);
/// Adds to the pixel's light.
pub const LIGHT_BLEND: Use = Use::new(
    vk::PipelineStageFlags2::COMPUTE_SHADER,
    vk::AccessFlags2::from_raw(vk::AccessFlags2::SHADER_READ.as_raw() | vk::AccessFlags2::SHADER_WRITE.as_raw()),
);

pub const PASS: Pass = Pass {
    name: Endpoint::pass("REFLECT_RESOLVE"),
    time: "reflect resolve",
    what: "what rays found around each pixel, as its lobe mirrors it, in the place of the sky's light",
    presence: |plan| {
        Presence::when(
            plan.reflects(),
            "averages neighbours' rays: one ray is one direction of the lobe",
            plan.reasons.lack_of("reflections"),
        )
    },
    touches: |plan| {
        let mut touches = sampled_gbuffer(plan, GBUFFER_READ);
        touches.extend([
            ResourceUse::sampled(6, RAYS, RAYS_READ).because("reads what rays found around each pixel"),
            ResourceUse::storage(7, Target::Hdr, LIGHT_BLEND).because("adds to the light that REFLECT has read"),
            frame_data(),
        ]);
        if plan.is_lit_by_sky() {
            touches.push(ResourceUse::resource(Resource::SkyLight, SKY_READ));
        }
        touches
    },
    leave_out: None,
    make: Some(|own| {
        let shader = needed("reflect_resolve", shader::variant, flags(own.plan))?;
        Ok(Box::new(PerPixelPass::new(own, ("reflect_resolve", shader), &constants_of(own.plan))?))
    }),
};

/// Returns the shader variant of a plan.
pub(crate) fn flags(plan: &FramePlan) -> Flags {
    let gbuffer = plan.gbuffer.as_ref();
    Flags::SPECULAR.when(gbuffer.is_some_and(|gbuffer| gbuffer.specular.is_some()))
        | Flags::NORMAL_UINT.when(gbuffer.is_some_and(|gbuffer| gbuffer.normal == vk::Format::R16G16_UINT))
        | Flags::SINGLE.when(plan.hdr == Some(vk::Format::R32G32B32A32_SFLOAT))
        | Flags::SKY_LIGHT.when(plan.is_lit_by_sky())
}

fn constants_of(plan: &FramePlan) -> Vec<(u32, u32)> {
    let Some(own) = &plan.effects.reflections else { return Vec::new() };
    vec![
        (constants::ORTHOGRAPHIC, u32::from(plan.orthographic)),
        (constants::NORMAL_ENCODING, plan.gbuffer.as_ref().map_or(0, |gbuffer| gbuffer.normal_encoding as u32)),
        (constants::BRDF, plan.brdf.constant()),
        (constants::METAL, u32::from(plan.metal)),
        (constants::REFLECTANCE, u32::from(plan.reflectance)),
        (constants::AMBIENT, u32::from(plan.lights.ambient)),
        (constants::ROUGHEST, own.roughness.to_bits()),
        (constants::LARGEST, plan.largest_light().to_bits()),
        (constants::SHOWN, u32::from(own.shown)),
    ]
}
