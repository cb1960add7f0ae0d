//! TRANSPARENT: transparent surfaces, lit while they are rasterized, over the picture of LIGHTING. They are blended back to front, or summed with
//! weights in any order for COMPOSITE to lay over the picture.

use ash::vk;

use super::blending::{blend, limits, targets};
use super::surface::{LitDesc, SurfacePipelines, lit_pipeline};
use super::{
    Endpoint, FrameContext, Making, Pass, PassRecorder, Presence, ResourceUse, SAMPLED, air, frame_data, looked_up,
    maps, meshes,
};
use crate::gpu::{self, DepthState, sync::Use};
use crate::plan::{FramePlan, GeometryKey, Opacity, effects};
use crate::scene::{OptionalPart, Transparency};
use crate::shaders::forward::Flags;

/// Samples shadow maps.
pub const MAP_READ: Use = SAMPLED;

pub const PASS: Pass = Pass {
    name: Endpoint::pass("TRANSPARENT"),
    time: "transparent",
    what: "surfaces that show what lies behind them",
    presence: |plan| match (drawn_alone(plan), plan.transparency) {
        (Some(other), _) => Presence::Out(format!("nothing transparent is drawn but {other}")),
        (None, Some(Transparency::Sorted)) => {
            Presence::In("transparent surfaces are blended, sorted from back to front".into())
        }
        (None, Some(Transparency::Oit)) => {
            Presence::In("transparent surfaces are summed up with weights in any order".into())
        }
        (None, None) => Presence::Out("nothing transparent is drawn".into()),
    },
    touches,
    leave_out: None,
    make: Some(|own| Ok(Box::new(TransparentPass::new(own)?))),
};

/// The name of the effect that is blended although the plan has no transparent surfaces.
fn drawn_alone(plan: &FramePlan) -> Option<&'static str> {
    let draws_surfaces = !plan.transparent.is_empty() || plan.keep.has(OptionalPart::Transparent);
    effects::of(plan).find(|effect| effect.blended.is_some() && !draws_surfaces).map(|effect| effect.name)
}

fn touches(plan: &FramePlan) -> Vec<ResourceUse> {
    let mut touches = targets(plan);
    touches.push(frame_data());
    touches.extend(meshes(plan));
    touches.extend(maps(plan, MAP_READ));
    touches.extend(looked_up(plan));
    touches.extend(air::touch(plan));
    touches
}

/// The pass: a pipeline for each transparent [`GeometryKey`] of the plan.
pub struct TransparentPass {
    surfaces: SurfacePipelines,
}

impl TransparentPass {
    fn new(own: &Making) -> gpu::Result<Self> {
        let &Making { device, layouts, plan, scene, .. } = own;
        let slot = own.slot()?;
        let mut surfaces = SurfacePipelines::new(device, plan, ("transparent", &plan.transparent), layouts, scene)?;
        for &key in &plan.transparent {
            let desc = LitDesc {
                name: "transparent",
                weighted: weighted(plan),
                limits: limits(plan),
                masked: key.discards,
                depth: DepthState { test: compare(key), write: false },
                blend: &blend(plan),
            };
            let pipeline = lit_pipeline(device, plan, slot, key, surfaces.layout(key), &desc)?;
            surfaces.insert(key, pipeline);
        }
        Ok(Self { surfaces })
    }
}

impl PassRecorder for TransparentPass {
    /// Draws visible objects, the farthest first. Runs inside its subpass.
    fn record(&self, context: &FrameContext) {
        let draws = context.visible.transparent.iter().map(|own| (&own.draw, own.first_index));
        self.surfaces.record(context, draws);
    }
}

/// Reversed Z. An opaque surface hides everything behind it, and everything coplanar but a coat; transparent surfaces hide nothing. A coat and the
/// surface under it have bit-identical depth: their shaders do the same precise arithmetic.
fn compare(key: GeometryKey) -> vk::CompareOp {
    match key.forward.is_some_and(|forward| forward.opacity == Opacity::Coat) {
        true => vk::CompareOp::GREATER_OR_EQUAL,
        false => vk::CompareOp::GREATER,
    }
}

/// The shader flag of weighted blending, whose sums need separate outputs.
fn weighted(plan: &FramePlan) -> Flags {
    if plan.transparency == Some(Transparency::Oit) { Flags::WEIGHTED } else { Flags::NONE }
}

/// Returns the shader variant of one of the plan's pipelines.
pub fn flags(plan: &FramePlan, key: GeometryKey) -> Flags {
    super::surface::lit_flags(plan, key) | weighted(plan)
}

#[cfg(test)]
mod tests {
    use half::f16;

    use super::super::surface::Limits;
    use super::*;
    use crate::gpu_scene::{
        COLOR, LOOK, NORMAL, NUMBER, OTHER_COLOR, OTHER_END, OTHER_UV, POSITION, ROWS, SECOND_UV, TANGENT, UV,
    };
    use crate::plan::{OitTargets, samples};
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
                        POSITION | OTHER_END | OTHER_COLOR | ROWS..=NUMBER => true,
                        LOOK => plan.has_looks() || !key.extras.looks,
                        NORMAL => streams.normals,
                        UV | OTHER_UV => streams.uvs,
                        TANGENT => streams.tangents,
                        COLOR => streams.colors || !key.extras.colors,
                        SECOND_UV => streams.second_uvs || !key.extras.second_uvs,
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
    fn no_sum_of_layers_overflows_its_target() {
        let mut kinds = [0; 3];
        let plans = samples::plans().into_iter().filter(|(_, plan)| plan.transparency.is_some());
        // Each plan is also tested with sums in 32-bit floats, and with light in 32-bit floats as well.
        let plans = plans.flat_map(|(name, plan)| {
            let (mut single, mut bright) = (plan.clone(), plan.clone());
            single.sums = plan.sums.and(Some(OitTargets::SINGLE));
            (bright.sums, bright.hdr) = (single.sums, Some(vk::Format::R32G32B32A32_SFLOAT));
            [plan, single, bright].map(|plan| (name.clone(), plan))
        });
        for (name, plan) in plans {
            for triangles in [1, 2, 500, 1999, 2000, 2001, 1_000_000, u32::MAX] {
                let mut plan = plan.clone();
                plan.transparent_triangles = triangles;
                let Limits { largest, highlight, weight, least, peak } = limits(&plan);
                let layers = f64::from(triangles);
                assert!(largest > 0.0 && highlight > 0.0, "{name}");
                match plan.sums {
                    None if triangles <= 2000 => {
                        let most = f64::from(plan.largest_light()) + layers * f64::from(highlight);
                        let half = plan.light_format() != vk::Format::R32G32B32A32_SFLOAT;
                        let limit = if half { 64000.0 * 1.000_001 } else { 1e31 };
                        assert!(most <= limit, "{name}: {triangles} layers reach {most}");
                        kinds[0] += 1;
                    }
                    None => {}
                    Some(OitTargets::SINGLE) => {
                        assert!(layers * f64::from(peak) < 1.01e38 && weight <= peak, "{name}: {triangles}, {peak}");
                        let faintest = (weight * least).min(peak / (largest + highlight)) / 255.0;
                        assert!(faintest.is_normal(), "{name}: {triangles}, {faintest}");
                        kinds[1] += 1;
                    }
                    Some(sums) => {
                        assert_eq!(sums, OitTargets::HALF);
                        let counted = layers * (f64::from(peak) + 16.0) <= 64000.5;
                        assert!(weight <= peak && least <= 1.0 && (counted || peak <= 16.0), "{name}: {triangles}");
                        assert!(weight * least / 255.0 >= f16::MIN_POSITIVE.to_f32(), "{name}: {triangles}");
                        kinds[2] += 1;
                    }
                }
            }
        }
        assert!(kinds.iter().all(|&count| count > 0), "{kinds:?}");
    }

    /// Half floats as blenders make them: rounded to the nearest, or cut off, as lavapipe does.
    #[derive(Debug, Clone, Copy)]
    enum Rounding {
        Nearest,
        Down,
    }

    impl Rounding {
        fn half(self, value: f32) -> f32 {
            let near = f16::from_f32(value);
            match self {
                Self::Down if near.to_f32() > value => f16::from_bits(near.to_bits() - 1).to_f32(),
                _ => near.to_f32(),
            }
        }

        /// Adds the value `count` times, one by one.
        fn sum(self, value: f32, count: u32) -> f32 {
            let value = self.half(value);
            let mut sum = 0.0;
            for _ in 0..count {
                let next = self.half(sum + value);
                // Once a step changes nothing, no later step does.
                if next == sum {
                    break;
                }
                sum = next;
            }
            sum
        }
    }

    /// `weight_of` of `shaders/forward.wgsl`, at a distance in scene radii.
    fn weight_of(limits: &Limits, brightest: f32, distance: f32) -> f32 {
        let near = (1.0 / (1.0 + distance)).powi(6).max(limits.least) * limits.weight;
        near.min(limits.peak / brightest.max(1.0))
    }

    /// Plans whose sums are half floats, tone-mapped and linear.
    fn half_plans() -> [FramePlan; 2] {
        [false, true].map(|linear| {
            let found = samples::plans()
                .into_iter()
                .map(|(_, plan)| plan)
                .find(|plan| plan.sums == Some(OitTargets::HALF) && plan.has_tonemap_subpass() != linear);
            found.unwrap_or_else(|| panic!("no plan with linear = {linear}"))
        })
    }

    /// The light of a layer, lit or with a clear pane's highlight, each with its relative tolerance.
    fn colors(limits: &Limits, alpha: f32) -> Vec<(f32, f32)> {
        // A blender that cuts off may lose one of 32 steps.
        let most = (limits.largest * alpha + limits.highlight, 1.0 / 31.0);
        // Normal numbers keep 11 bits, of the colour and of alpha.
        let lit = [0.0, 0.05, 1.0, 16.0, 100.0, limits.largest].map(|light| (light * alpha, 1.0 / 512.0));
        lit.into_iter().chain([(512.0, 1.0 / 512.0), most]).collect()
    }

    const ALPHAS: [f32; 6] = [1.0 / 255.0, 0.01, 0.04, 0.1, 0.5, 1.0];
    const DISTANCES: [f32; 7] = [0.0, 0.1, 1.0, 3.0, 10.0, 1e3, 1e4];
    const TRIANGLES: [u32; 9] = [1, 2, 12, 500, 1999, 2000, 2001, 200_000, 1_000_000];

    #[test]
    fn sums_of_half_floats_neither_overflow_nor_vanish() {
        for mut plan in half_plans() {
            for triangles in TRIANGLES {
                plan.transparent_triangles = triangles;
                let limits = limits(&plan);
                for (alpha, distance) in ALPHAS.into_iter().flat_map(|a| DISTANCES.map(|d| (a, d))) {
                    for (color, relative) in colors(&limits, alpha) {
                        for rounding in [Rounding::Nearest, Rounding::Down] {
                            let what = format!("{triangles} of {color}, {alpha}, at {distance}, {rounding:?}");
                            let weight = weight_of(&limits, color, distance);
                            let sums = |count| [color, alpha].map(|value| rounding.sum(value * weight, count));
                            let [light, cover] = sums(triangles);
                            assert!(light < 65504.0 && cover > 0.0 && cover < 65504.0, "{what}: {light}, {cover}");
                            // A single layer keeps its colour, with 11 bits of precision and an error of at most 1/1024 of white in the dark.
                            let [light, cover] = sums(1);
                            let (shown, own) = (light / cover, color / alpha);
                            let error = (shown - own).abs();
                            assert!(error <= own * relative + 1.0 / 1024.0, "{what}: {shown} instead of {own}");
                        }
                    }
                }
            }
        }
    }

    /// Unequal values round differently from equal ones: the layers of a pixel range from the brightest light down to `faintest` of it.
    #[test]
    fn sums_of_unlike_half_floats_do_not_overflow() {
        for mut plan in half_plans() {
            for triangles in TRIANGLES {
                plan.transparent_triangles = triangles;
                let peak = limits(&plan).peak;
                for faintest in [1.0, 0.75, 0.53, 0.1] {
                    let (mut sum, mut share) = (0.0f32, 1.0f32);
                    for _ in 0..triangles {
                        sum = Rounding::Nearest.half(sum + Rounding::Nearest.half(peak * share));
                        share = (share * 0.97).max(faintest);
                        if share == faintest {
                            share = 1.0;
                        }
                    }
                    assert!(sum < 65504.0, "{triangles} of up to {peak}: {sum}");
                }
            }
        }
    }
}
