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

use super::edges::RowName as Row;
use super::list::{
    self, BLEND_PASS, FXAA_PASS, GBUFFER_PASS, MAIN_PASS, OCCLUDER_PASS, Occasion, SHADOW_PASS, SHARPEN_PASS, Step,
    Subpass, TONEMAP_PASS, VELOCITY_PASS,
};
use crate::passes::{
    Pass, Resource, ambient, ao, ao_denoise, arrange, bloom, composite, cull, depth, fill, fog, forward, fxaa,
    geometry, hiz, integrate, lighting, occluders, particles, per_light, pyramid, reflect, reflect_resolve, scatter,
    shadow, sharpen, simulate, skin, sky, sort, taa, tiled, tone, tonemap, transparent, velocity, view,
};
use crate::plan::{FramePlan, Target};

/// The passes of the frame in their order, grouped by render pass; those outside of render passes with their barriers, by rows of
/// [`super::edges::table`]. Passes that the plan lacks are left out.
pub(super) fn list(plan: &FramePlan) -> Vec<Option<Step>> {
    let subpass = |place: &Pass, passes: &[&'static Pass]| list::subpass(plan, place.place, passes);
    let alone = |pass: &'static Pass| subpass(pass, &[pass]);
    let surfaces = || subpass(&geometry::PASS, &[&depth::PASS, &geometry::PASS]);

    let mut steps = before_the_picture(plan);
    if plan.is_tiled() {
        // TILED lights the stored G-buffer, or looks up the surface of each pixel's triangle.
        steps.push(list::render_pass(MAIN_PASS, [surfaces()]));
        steps.extend(occlusion(plan));
        let output = Resource::Target(Target::Output);
        steps.push(compute(plan, &tiled::PASS, &[(Row::OUTPUT_REUSE, output)], &[(Row::READ_BACK, output)]));
        return steps;
    }
    // Over the picture, wherever that is finished.
    let [tone, smoothed_tone] = if plan.fxaa { [None, alone(&tone::PASS)] } else { [alone(&tone::PASS), None] };
    // BLOOM and TAA read each pixel's neighbours, so that the main pass ends before them.
    let (mut shown, mut smoothed, mut bloomed) = ([None, None], [None, None], [None, None]);
    let last = [alone(&tonemap::PASS), tone];
    match (&plan.bloom, &plan.taa) {
        (Some(_), _) => bloomed = last,
        (None, Some(_)) => smoothed = last,
        (None, None) => shown = last,
    }
    let [tonemap, tone] = shown;
    // ANCHOR: list-subpasses
    let lit = [
        subpass(&lighting::PASS, &[&lighting::PASS, &per_light::PASS, &ambient::PASS, &sky::PASS, &view::PASS]),
        subpass(&forward::PASS, &[&depth::PASS, &forward::PASS, &sky::PASS]),
    ];
    let over = subpass(&transparent::PASS, &[&transparent::PASS, &particles::PASS]);
    let blended = [alone(&fog::PASS), over, alone(&composite::PASS), tonemap, tone];
    // ANCHOR_END: list-subpasses
    // REFLECT reads the light of all pixels, so that the main pass ends with it.
    let (light, blended): (Vec<Option<Subpass>>, Vec<_>) = match plan.reflects() {
        true => (lit.into(), blended.into()),
        false => (lit.into_iter().chain(blended).collect(), Vec::new()),
    };
    // ANCHOR: list-main-pass
    // Each of these reads only its own pixel, so that a tiler never leaves the tile. AO reads neighbours, and parts them.
    match plan.stores_gbuffer {
        false => steps.push(list::render_pass(MAIN_PASS, [surfaces()].into_iter().chain(light))),
        true => {
            steps.push(list::render_pass(GBUFFER_PASS, [surfaces()]));
            steps.extend(occlusion(plan));
            steps.push(list::render_pass(MAIN_PASS, light));
        }
    }
    // ANCHOR_END: list-main-pass
    steps.extend(reflections(plan));
    steps.push(list::render_pass(BLEND_PASS, blended));
    steps.push(list::render_pass(VELOCITY_PASS, [alone(&velocity::PASS)]));
    // The last frame left its history, and SHARPEN may still read that.
    let histories = [Resource::LastHistory, Resource::History].map(|history| (Row::HISTORY_REUSE, history));
    steps.push(compute(plan, &taa::PASS, &histories, &[]));
    steps.push(list::render_pass(SHARPEN_PASS, [alone(&sharpen::PASS)].into_iter().chain(smoothed)));
    // TONEMAP of the last frame may still read the levels. A step of SPREAD after another: all but the first wait alike.
    let levels = Resource::BloomLevels;
    steps.extend([
        compute(plan, &bloom::PASS, &[(Row::BLOOM_REUSE, levels)], &[]),
        compute(plan, &bloom::SPREAD, &[(Row::BLOOM_TO_SPREAD, levels)], &[]),
        compute(plan, &bloom::SPREAD, &[(Row::SPREAD_TO_SPREAD, levels)], &[]),
    ]);
    steps.push(list::render_pass(TONEMAP_PASS, bloomed));
    steps.push(list::render_pass(FXAA_PASS, [alone(&fxaa::PASS), smoothed_tone]));
    steps
}

/// A pass outside of render passes in every frame, with the barriers before and after it.
fn compute(
    plan: &FramePlan,
    pass: &'static Pass,
    before: &[(Row, Resource)],
    after: &[(Row, Resource)],
) -> Option<Step> {
    list::commands(plan, Occasion::Always, pass, before, after)
}

/// All that passes which draw surfaces need: deformed vertices, visible objects, shadow maps, the light in the air, and particles.
fn before_the_picture(plan: &FramePlan) -> Vec<Option<Step>> {
    let alone = |pass: &'static Pass| [list::subpass(plan, pass.place, &[pass])];
    let step = |pass, before: &[(Row, Resource)], after: &[(Row, Resource)]| compute(plan, pass, before, after);
    let (vertices, pyramid, culled) = (Resource::DeformedVertices, Resource::DepthPyramid, Resource::CulledInstances);
    let (froxels, particles) = (Resource::Froxels, Resource::Particles);
    // PARTICLES fetches them in their order.
    let drawn = [(Row::PARTICLES_TO_DRAW, particles)];
    let unsorted: &[_] = if plan.sorts_particles() { &[] } else { &drawn };
    vec![
        // The last frame's draws may still fetch what it overwrites, and every pass that draws deformed objects fetches what it wrote.
        list::commands(
            plan,
            Occasion::Posed,
            &skin::PASS,
            &[(Row::DEFORMED_REUSE, vertices)],
            &[(Row::SKIN_TO_DRAWS, vertices)],
        ),
        list::render_pass(OCCLUDER_PASS, alone(&occluders::PASS)),
        // CULL of the last frame may still look into the pyramid, and CULL of this frame will.
        step(&pyramid::PASS, &[(Row::PYRAMID_REUSE, pyramid)], &[(Row::PYRAMID_TO_CULL, pyramid)]),
        // The last frame's draws may still read the overwritten values.
        step(&cull::PASS, &[(Row::CULLED_REUSE, culled)], &[]),
        // It adds up what CULL counted; the CPU reads how many there are, when the frame is done.
        step(&arrange::PASS, &[(Row::CULL_TO_ARRANGE, culled)], &[(Row::FOUND_TO_HOST, Resource::FoundCounts)]),
        // It puts rows where ARRANGE says; draws read commands and rows.
        step(&fill::PASS, &[(Row::ARRANGE_TO_FILL, culled)], &[(Row::FILL_TO_DRAWS, culled)]),
        // A render pass for each stale map.
        list::render_pass(SHADOW_PASS, alone(&shadow::PASS)),
        // The last frame may still look up the overwritten values.
        step(&scatter::PASS, &[(Row::FROXELS_REUSE, froxels)], &[]),
        // It adds up what SCATTER wrote; FOG, TRANSPARENT and PARTICLES look both up.
        step(&integrate::PASS, &[(Row::SCATTER_TO_INTEGRATE, froxels)], &[(Row::FROXELS_TO_FOG, froxels)]),
        // PARTICLES of the last frame may still fetch the overwritten values.
        step(&simulate::PASS, &[(Row::PARTICLES_REUSE, particles)], unsorted),
        // It orders the keys that SIMULATE wrote. A step of SORT after another: all but the first wait alike.
        step(&sort::PASS, &[(Row::SIMULATE_TO_SORT, particles)], &[]),
        step(&sort::PASS, &[(Row::SORT_TO_SORT, particles)], &drawn),
    ]
}

/// AO and AO_DENOISE, between the G-buffer and the light.
fn occlusion(plan: &FramePlan) -> [Option<Step>; 2] {
    let [visibility, albedo] = [Target::Visibility, Target::Albedo].map(Resource::Target);
    // In the rasterized frame the main pass changes the albedo's layout as it loads it.
    let after: &[_] = if plan.is_tiled() { &[(Row::OCCLUSION_TO_TILED, albedo)] } else { &[] };
    [
        // AO_DENOISE of the last frame may still read AO's output.
        compute(plan, &ao::PASS, &[(Row::VISIBILITY_REUSE, visibility)], &[]),
        // It reads what AO found around each pixel.
        compute(plan, &ao_denoise::PASS, &[(Row::VISIBILITY_TO_DENOISE, visibility)], after),
    ]
}

/// HIZ, REFLECT and REFLECT_RESOLVE, between the lit picture and the layers that are blended over it.
fn reflections(plan: &FramePlan) -> [Option<Step>; 3] {
    let [hiz, rays, light] = [Target::Hiz, Target::Rays, Target::Hdr].map(Resource::Target);
    // The next to read the light, where that is a compute pass: a render pass changes its layout as it loads it.
    let reader = match (plan.averages_reflected(), plan.blooms_reflected()) {
        (true, _) => Some(Row::LIGHT_TO_TAA),
        (false, true) => Some(Row::HDR_TO_BLOOM),
        (false, false) => None,
    };
    let after: Vec<_> = reader.map(|row| (row, light)).into_iter().collect();
    [
        // REFLECT of the last frame may still read the pyramid.
        compute(plan, &hiz::PASS, &[(Row::HIZ_REUSE, hiz)], &[]),
        // REFLECT reads the pyramid, and REFLECT_RESOLVE of the last frame may still read the rays.
        compute(plan, &reflect::PASS, &[(Row::HIZ_TO_REFLECT, hiz), (Row::RAYS_REUSE, rays)], &[]),
        // REFLECT_RESOLVE reads the rays, and adds to the light that REFLECT has read.
        compute(plan, &reflect_resolve::PASS, &[(Row::RAYS_TO_RESOLVE, rays), (Row::LIGHT_TO_RESOLVE, light)], &after),
    ]
}
