//! The rows of FOG, between the pass that lights opaque surfaces and the transparent ones.

use super::{Carrier, Edge, RowName, particles, row, subpass};
use crate::frame::list::{BLEND_PASS, MAIN_PASS};
use crate::gpu::sync::Use;
use crate::passes::{ao, ao_denoise, composite, fog, forward, lighting, reflect_resolve, transparent};
use crate::plan::FramePlan;
use crate::scene::Transparency;

impl RowName {
    pub(crate) const LIGHTING_TO_FOG: Self = Self("lighting-to-fog");
    pub(crate) const FORWARD_TO_FOG: Self = Self("forward-to-fog");
    pub(crate) const RESOLVE_TO_FOG: Self = Self("resolve-to-fog");
    pub(crate) const AO_TO_FOG: Self = Self("ao-to-fog");
    pub(crate) const FOG_TO_TRANSPARENT: Self = Self("fog-to-transparent");
    pub(crate) const FOG_TO_COMPOSITE: Self = Self("fog-to-composite");
}

/// `light` is how LIGHTING or FORWARD writes the light.
pub(super) fn to_fog(plan: &FramePlan, light: Use) -> Edge {
    let (name, from, before, why) = match plan.is_forward() {
        true => (
            RowName::FORWARD_TO_FOG,
            forward::PASS.place,
            vec![forward::DEPTH_TEST, forward::LIGHT_WRITE],
            "FOG reads the depth of its pixel and blends over the light, both of which FORWARD wrote",
        ),
        false => (
            RowName::LIGHTING_TO_FOG,
            lighting::PASS.place,
            // LIGHTING tests depth, and reads it as an input where no target has the position.
            vec![lighting::DEPTH_READ, lighting::GBUFFER_READ, light],
            "FOG reads the depth that LIGHTING has read, and blends over what LIGHTING wrote",
        ),
    };
    let mut after = vec![fog::LIGHT_BLEND];
    // A G-buffer that is stored is visible to all of the main pass already. The last user of depth drops it.
    match (plan.stores_gbuffer, plan.transparency) {
        (true, None) => after.push(fog::DEPTH_WAIT),
        (true, Some(Transparency::Sorted)) => {}
        // TRANSPARENT waits for FOG's reads alone, and with them for LIGHTING's.
        (true, Some(Transparency::Oit)) => after.push(fog::DEPTH_TURN),
        (false, None) => after.extend([fog::DEPTH_READ, fog::DEPTH_DROP]),
        (false, Some(_)) => after.push(fog::DEPTH_READ),
    }
    let reads_all = !plan.is_forward() && lighting::reads_all_samples(plan);
    subpass(name).from(from, &before).to(fog::PASS.place, &after).across_samples(reads_all).because(why)
}

/// FOG's row where reflections are added before it: FOG is then the first of the blend pass.
pub(super) fn fog_after_reflections(plan: &FramePlan) -> Edge {
    let drop = plan.transparency.is_none().then_some(fog::DEPTH_DROP);
    let after: Vec<_> = [fog::DEPTH_LOAD, fog::DEPTH_READ, fog::LIGHT_BLEND].into_iter().chain(drop).collect();
    row(RowName::RESOLVE_TO_FOG, Carrier::Subpass(BLEND_PASS))
        .from(reflect_resolve::PASS.place, &[reflect_resolve::LIGHT_BLEND])
        .to(fog::PASS.place, &after)
        .because("FOG blends over the light to which REFLECT_RESOLVE has added, and reads the depth that it has read")
}

/// FOG waits for AO: the depth that both read became visible to AO alone.
pub(super) fn after_ao(plan: &FramePlan) -> Edge {
    let drop = plan.transparency.is_none().then_some(fog::DEPTH_DROP);
    let after: Vec<_> = [fog::DEPTH_READ].into_iter().chain(drop).collect();
    row(RowName::AO_TO_FOG, Carrier::Subpass(MAIN_PASS))
        .from(ao_denoise::PASS.place, &[ao::GBUFFER_READ])
        .to(fog::PASS.place, &after)
        .because("FOG reads the depth that AO has read, and where nothing transparent follows it drops that")
}

/// Rows to TRANSPARENT and COMPOSITE, in the place of those from LIGHTING or FORWARD; [`super::main_pass`] has those of the sums.
pub(super) fn transparent_after_fog(plan: &FramePlan, transparency: Transparency) -> Vec<Edge> {
    let mut depth = match plan.stores_gbuffer {
        true => vec![transparent::DEPTH_WAIT],
        false => vec![transparent::DEPTH_READ, transparent::DEPTH_DROP],
    };
    depth.extend(particles::depth(plan).filter(|_| !plan.stores_gbuffer));
    match transparency {
        Transparency::Sorted => vec![
            subpass(RowName::FOG_TO_TRANSPARENT)
                .from(fog::PASS.place, &[fog::DEPTH_READ, fog::LIGHT_BLEND])
                .to(transparent::PASS.place, &[&depth[..], &[transparent::BLEND]].concat())
                .because(
                    "TRANSPARENT blends over the light that FOG has changed, tests against the depth that FOG read, and as the \
                     last user drops that",
                ),
        ],
        Transparency::Oit => vec![
            subpass(RowName::FOG_TO_TRANSPARENT)
                .from(fog::PASS.place, &[fog::DEPTH_READ])
                .to(transparent::PASS.place, &depth)
                .because("TRANSPARENT tests against the depth that FOG read, and as the last user drops it"),
            subpass(RowName::FOG_TO_COMPOSITE)
                .from(fog::PASS.place, &[fog::LIGHT_BLEND])
                .to(composite::PASS.place, &[composite::LIGHT_BLEND])
                .because("COMPOSITE blends over the light that FOG has changed"),
        ],
    }
}
