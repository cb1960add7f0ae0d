//! One frame, from top to bottom: the order of its passes. This is the file to read first.
//!
//! A pass that the plan leaves out has no object, no resources and no commands. [`super::walk`] makes the objects of the others and records them in this
//! order. What follows from the order is found elsewhere: which passes share a render pass, with loads, stores and layouts ([`super::list`]); whom each pass
//! waits for ([`super::rows`]); and that every use waits for the one before it (the crate `afterlight-proof`).

use super::list::OrderEntry::{self, Draw, DrawApart, LinesIf, Run, RunBeside, RunPosed, SplitIf};
use crate::passes::{
    aberration, ambient, ao, ao_denoise, arrange, backdrop, bloom, composite, cull, depth, fill, fog, forward, fxaa,
    geometry, hiz, integrate, lighting, lobes, occluders, particles, per_light, pyramid, reflect, reflect_resolve,
    scatter, shadow, sharpen, simulate, skin, sky, sort, taa, tiled, tint, tone, tonemap, transparent, velocity, view,
};
use crate::plan::FramePlan;
use crate::scene::OptionalPart;

// ANCHOR: order
/// The passes of a frame. `Run` records a compute pass. `Draw` is a subpass: the first argument names it, and the listed passes draw in it.
/// Consecutive subpasses share a render pass until a compute pass, a subpass that samples attachments of the render pass, or `SplitIf`. `DrawApart`
/// is a separate render pass, with a subpass for each listed pass. `RunBeside` is `Run` on another queue, if the plan has one.
#[rustfmt::skip]
pub(super) const ORDER: &[OrderEntry] = &[
    // All that must be ready before surfaces are drawn.
    RunPosed(&skin::PASS),                       // vertices of meshes that skins and shapes deform, when their pose has changed
    DrawApart(&[&occluders::PASS]),              // depth of the largest objects, to find out what they hide
    Run(&pyramid::PASS),                         // the least depths of squares of it
    Run(&cull::PASS),                            // which objects are in view, and not hidden
    Run(&arrange::PASS),                         // where the commands of each group of them go: sums of their numbers
    Run(&fill::PASS),                            // those commands, for all that draws surfaces below
    LinesIf(|plan| !plan.computes_beside(), SHADOWS_AND_AIR),
    // Surfaces, and the light on them.
    Draw(&geometry::PASS, &[&depth::PASS, &geometry::PASS]), // surfaces into the G-buffer, which tilers need not store
    SplitIf(|plan| plan.stores_gbuffer && plan.keep.has(OptionalPart::StoredGbuffer)), // on request: to see what a stored G-buffer costs
    LinesIf(FramePlan::computes_beside, SHADOWS_AND_AIR), // while the next two passes run on another queue
    RunBeside(&ao::PASS),                        // how much of the surroundings each pixel sees
    RunBeside(&ao_denoise::PASS),                // the same without noise, into the G-buffer's occlusion
    Run(&tiled::PASS),                           // all light and the picture, on the light paths `compute` and `visibility`
    Draw(&lighting::PASS, &[&lighting::PASS, &per_light::PASS, &ambient::PASS, &lobes::PASS, &sky::PASS, &view::PASS]), // all light, or a view of one buffer
    Draw(&forward::PASS, &[&depth::PASS, &forward::PASS, &sky::PASS]), // surfaces lit as they are drawn, on the forward light paths
    Run(&hiz::PASS),                             // the nearest and the farthest depth of squares, so that rays skip empty space
    Run(&reflect::PASS),                         // rays from smooth surfaces into the lit picture
    Run(&reflect_resolve::PASS),                 // what they found, added to the light
    // Layers over lit surfaces.
    Draw(&fog::PASS, &[&fog::PASS]),             // air that absorbs and scatters, behind all that is transparent
    Run(&backdrop::PASS),                        // the picture that glass shows behind it
    Draw(&transparent::PASS, &[&transparent::PASS, &particles::PASS]), // surfaces that let light through, then particles
    Draw(&composite::PASS, &[&composite::PASS]), // their sums over the light, where they are not sorted
    Draw(&velocity::PASS, &[&velocity::PASS]),   // motion of surfaces that move by themselves, for TAA
    Run(&taa::PASS),                             // the mean with the frames before
    Draw(&sharpen::PASS, &[&sharpen::PASS]),     // that mean as light again, sharpened
    // The finished picture.
    Run(&bloom::PASS),                           // the light that a lens spreads: its first level
    Run(&bloom::SPREAD),                         // the level after that
    Run(&bloom::SPREAD),                         // and all others, each after another one
    Draw(&tonemap::PASS, &[&tonemap::PASS]),     // light to values that a display shows
    Draw(&fxaa::PASS, &[&fxaa::PASS]),           // smoother edges
    Draw(&aberration::PASS, &[&aberration::PASS]), // red and blue apart, as a lens draws them
    Draw(&tone::PASS, &[&tone::PASS]),           // vignette and grain, which FXAA would smooth
];

/// Passes that do not need the G-buffer; only passes after the G-buffer need their results.
#[rustfmt::skip]
const SHADOWS_AND_AIR: &[OrderEntry] = &[
    DrawApart(&[&shadow::PASS, &tint::PASS]),    // depth as lights see it, of maps in which something has moved; and what transparent surfaces let through
    Run(&scatter::PASS),                         // the light that reaches each froxel of air
    Run(&integrate::PASS),                       // the light scattered on the way to each froxel
    Run(&simulate::PASS),                        // the particles of the moment, with the light on them
    Run(&sort::PASS),                            // their order from back to front: the first step, after SIMULATE
    Run(&sort::PASS),                            // and all others, each after another one
];
// ANCHOR_END: order
