//! One frame, from top to bottom: the order of its passes, the render passes that they share, and the barriers between the others. This is the file to
//! read first.
//!
//! ```text
//! compute        SKIN       vertices of meshes that skins and shapes deform, when their pose is another
//! occluder pass  OCCLUDERS  depth of the largest objects, where the device culls occluded ones
//! compute        PYRAMID    the least depths of squares of that depth
//!                CULL, ARRANGE, FILL  objects in view and not occluded, where the device culls
//! shadow passes  SHADOW     depth maps of lights, those in which something has moved
//! compute        SCATTER, INTEGRATE  the light in the air, where fog has lamps and shadows in it
//! compute        SIMULATE, SORT  particles of the moment with their light, from back to front
//! main pass      GEOMETRY   surfaces into the G-buffer, in tile memory where there is any
//! compute        AO, AO_DENOISE  where asked for: ambient occlusion by surfaces nearby, into the G-buffer's occlusion; the main pass is parted there
//!                LIGHTING   every light on every pixel; or VIEW, which shows a buffer instead
//!                AMBIENT    light of the sky, in LIGHTING's subpass, where a sky lights the scene
//!                SKY        the sky, in the subpass that lights surfaces, on pixels without one
//!                FORWARD    replaces GEOMETRY, LIGHTING and AMBIENT on the forward light paths: surfaces, lit as they are rasterized
//! compute        HIZ, REFLECT, REFLECT_RESOLVE  where asked for: reflections of the lit picture in smooth surfaces, added to it; the main pass ends
//!                before them, and a blend pass goes on
//!                FOG        only where fog is asked for: the light that the air absorbs and scatters
//!                TRANSPARENT  surfaces that let light through, over the lit picture
//!                PARTICLES  in its subpass, after them
//!                COMPOSITE  only where TRANSPARENT summed them up without sorting
//! VELOCITY pass  VELOCITY   only where frames are averaged over time, and something moves by itself: its place in the frame before
//! compute        TAA        only where frames are averaged over time: the mean with the frames before
//! SHARPEN pass   SHARPEN    TAA's mean as light again; the passes after it share its render pass up to where that is parted again
//! compute        BLOOM, SPREAD  only where light is spread: then TONEMAP and TONE have a render pass of their own
//!                TONEMAP    only where something is blended before it
//!                TONE       vignette and grain, where asked for; after FXAA where there is that
//! FXAA pass      FXAA       smooths edges of the finished picture, where asked for
//!
//! compute        TILED      on the light paths `compute` and `visibility`: every light on every pixel, tile by tile, in place of all that comes after the
//!                G-buffer but AO
//! ```
//!
//! A pass that the plan leaves out has no object, no resources and no commands. [`super::walk`] makes the objects of the others and records them in this
//! order; [`super::list`] finds loads, stores and layouts in it, and [`super::proof`] that every use waits for the one before it.

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
/// The order of the passes. Passes that the plan leaves out are passed over.
const ORDER: [Line; 34] = [
    // All that passes which draw surfaces need: deformed vertices, visible objects, shadow maps, the light in the air, and particles.
    RunPosed(&skin::PASS),
    DrawApart(&occluders::PASS),
    Run(&pyramid::PASS),
    Run(&cull::PASS),
    Run(&arrange::PASS),
    Run(&fill::PASS),
    DrawApart(&shadow::PASS),
    Run(&scatter::PASS),
    Run(&integrate::PASS),
    Run(&simulate::PASS),
    // The first step, and each after another.
    Run(&sort::PASS),
    Run(&sort::PASS),
    // The surfaces, and the light on them.
    Draw(&geometry::PASS, &[&depth::PASS, &geometry::PASS]),
    PartIf(|plan| plan.stores_gbuffer && plan.keep.has(OptionalPart::StoredGbuffer)),
    Run(&ao::PASS),
    Run(&ao_denoise::PASS),
    Run(&tiled::PASS),
    Draw(&lighting::PASS, &[&lighting::PASS, &per_light::PASS, &ambient::PASS, &sky::PASS, &view::PASS]),
    Draw(&forward::PASS, &[&depth::PASS, &forward::PASS, &sky::PASS]),
    Run(&hiz::PASS),
    Run(&reflect::PASS),
    Run(&reflect_resolve::PASS),
    // Layers over the lit picture.
    Draw(&fog::PASS, &[&fog::PASS]),
    Draw(&transparent::PASS, &[&transparent::PASS, &particles::PASS]),
    Draw(&composite::PASS, &[&composite::PASS]),
    Draw(&velocity::PASS, &[&velocity::PASS]),
    Run(&taa::PASS),
    Draw(&sharpen::PASS, &[&sharpen::PASS]),
    // The picture is finished.
    Run(&bloom::PASS),
    Run(&bloom::SPREAD),
    Run(&bloom::SPREAD),
    Draw(&tonemap::PASS, &[&tonemap::PASS]),
    Draw(&fxaa::PASS, &[&fxaa::PASS]),
    Draw(&tone::PASS, &[&tone::PASS]),
];
// ANCHOR_END: order

/// The steps of a plan's frames up to the picture.
pub(super) fn steps(plan: &FramePlan) -> Vec<Step> {
    list::steps(plan, &ORDER)
}
