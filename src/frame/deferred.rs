//! One frame, from top to bottom: the order of its passes. This is the file to read first.
//!
//! A pass that the plan leaves out has no object, no resources and no commands. [`super::walk`] makes the objects of the others and records them in this
//! order. What follows from the order is found elsewhere: which passes share a render pass, with loads, stores and layouts ([`super::list`]); whom each pass
//! waits for ([`super::edges`]); and that every use waits for the one before it ([`super::proof`]).

use super::list::{
    self,
    Line::{self, Draw, DrawApart, PartIf, Run, RunPosed},
    Step,
};
use crate::passes::{
    ambient, ao, ao_denoise, arrange, bloom, composite, cull, depth, fill, fog, forward, fxaa, geometry, hiz,
    integrate, lighting, occluders, particles, per_light, pyramid, reflect, reflect_resolve, scatter, shadow, sharpen,
    simulate, skin, sky, sort, taa, tiled, tone, tonemap, transparent, velocity, view,
};
use crate::plan::FramePlan;
use crate::scene::OptionalPart;

// ANCHOR: order
/// The passes of a frame. `Run` records compute; `Draw` is a subpass, with the passes that share it. Neighbouring subpasses share a render pass up to the
/// next compute pass, or to a subpass that samples what they draw.
const ORDER: [Line; 34] = [
    // Everything that passes which draw surfaces need.
    RunPosed(&skin::PASS), // vertices of meshes that skins and shapes deform, when their pose is another
    DrawApart(&occluders::PASS), // depth of the largest objects, where the device culls occluded ones
    Run(&pyramid::PASS),   // the least depths of squares of that depth
    Run(&cull::PASS),      // objects in view and not occluded
    Run(&arrange::PASS),   // their places, by adding up their numbers
    Run(&fill::PASS),      // their rows and commands
    DrawApart(&shadow::PASS), // depth maps of lights, those in which something has moved
    Run(&scatter::PASS),   // the light of each froxel of air
    Run(&integrate::PASS), // the light scattered before each froxel
    Run(&simulate::PASS),  // particles of the moment, with their light
    Run(&sort::PASS),      // from back to front: the first step
    Run(&sort::PASS),      // and each step after another
    // Surfaces, and the light on them.
    Draw(&geometry::PASS, &[&depth::PASS, &geometry::PASS]), // surfaces into the G-buffer, in tile memory where there is any
    PartIf(|plan| plan.stores_gbuffer && plan.keep.has(OptionalPart::StoredGbuffer)),
    Run(&ao::PASS),         // ambient occlusion by surfaces nearby
    Run(&ao_denoise::PASS), // smoothed, into the G-buffer's occlusion
    Run(&tiled::PASS),      // on the light paths `compute` and `visibility`: all light, and the picture
    Draw(&lighting::PASS, &[&lighting::PASS, &per_light::PASS, &ambient::PASS, &sky::PASS, &view::PASS]), // every light on every pixel, or a view of a buffer
    Draw(&forward::PASS, &[&depth::PASS, &forward::PASS, &sky::PASS]), // on the forward light paths: surfaces, lit as they are rasterized
    Run(&hiz::PASS),             // depths of squares, in which REFLECT's rays skip empty space
    Run(&reflect::PASS),         // rays from smooth surfaces into the lit picture
    Run(&reflect_resolve::PASS), // what they found, added to the light
    // Layers over the lit picture.
    Draw(&fog::PASS, &[&fog::PASS]), // the light that the air absorbs and scatters
    Draw(&transparent::PASS, &[&transparent::PASS, &particles::PASS]), // surfaces that let light through, then particles
    Draw(&composite::PASS, &[&composite::PASS]), // their sums over the light, where they are not sorted
    Draw(&velocity::PASS, &[&velocity::PASS]),   // motion of surfaces that move by themselves, for TAA
    Run(&taa::PASS),                             // the mean with the frames before
    Draw(&sharpen::PASS, &[&sharpen::PASS]),     // that mean as light again
    // The finished picture.
    Run(&bloom::PASS),                       // the first level of the light that is spread
    Run(&bloom::SPREAD),                     // the first step after it
    Run(&bloom::SPREAD),                     // and each step after another
    Draw(&tonemap::PASS, &[&tonemap::PASS]), // light to values that a display shows
    Draw(&fxaa::PASS, &[&fxaa::PASS]),       // smoothed edges
    Draw(&tone::PASS, &[&tone::PASS]),       // vignette and grain
];
// ANCHOR_END: order

/// The steps of a plan's frames up to the picture.
pub(super) fn steps(plan: &FramePlan) -> Vec<Step> {
    list::steps(plan, &ORDER)
}
