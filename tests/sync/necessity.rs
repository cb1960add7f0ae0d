//! Every dependency is needed: without any one row of the table, or any one bit of a row, the validation layer has something to say. What it
//! is silent about is argued from the specification in `afterlight::frame::edges::unreported_mutants`, which is held against it here.
//!
//! Each mutant is a renderer of its own that draws a few small frames (`afterlight::frame::experiment`), in both modes of the layer's shader
//! heuristic. Older layers than 1.4.309 are blind to masks of subpass dependencies, so that there is nothing to learn from them.

/// The plans that unit tests are about.
#[allow(dead_code)]
#[path = "../../src/plan/samples.rs"]
pub mod samples;

use std::collections::{BTreeMap, BTreeSet};
use std::ffi::CStr;
use std::thread;
use std::time::Instant;

use afterlight::frame::edges::unreported_mutants::{LAYER, Part, UNREPORTED_MUTANTS, reason};
use afterlight::frame::edges::{self, Edge, Edges};
use afterlight::frame::list::List;
use afterlight::frame::proof::Frames;
use afterlight::frame::{capabilities, experiment};
use afterlight::gpu::{self, Device, DeviceChoice, Instance, InstanceOptions, MessageKind, Validation, vk};
use afterlight::passes::{depth, per_light};
// `samples` looks for these in the parent module.
use crate::common::gpu::{not_run, on_gpu};
use crate::common::stage::{add, gbuffer, lambert, own, plane, point, rectangle, sun};
use crate::common::tries_all;
use afterlight::plan::{Canvas, Capabilities, Encoding, Error, FramePlan, OUTPUT_PLAIN, OUTPUT_SRGB, Transfer};
use afterlight::scene::builtin::shapes;
use afterlight::scene::{
    AlphaMode, AmbientOcclusion, Brdf, ColorSpace, Culling, Emitter, Environment, Falloff, Fog, LightPath, Local,
    Material, Node, OptionalPart, Output, Placement, Reflections, Resolve, Scene, Settings, ShadowSettings, Texture,
    Transparency, View,
};
use glam::{DAffine3, DVec3, Vec3};

/// A plan to take dependencies from.
pub struct Case {
    pub name: String,
    scene: Scene,
    settings: Settings,
    /// Its frames are presented, with whatever may lie over them.
    presented: Option<Way>,
}

/// How pictures come into a swapchain's images. No dependency tells in which format, or how they are encoded.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Way {
    Straight,
    Encoded,
}

impl Case {
    pub fn plan(&self, device: &Capabilities) -> Result<FramePlan, Error> {
        let plan = FramePlan::of(&self.scene, &self.settings, device)?;
        Ok(match self.presented {
            Some(way) => presented(plan, way),
            None => plan,
        })
    }
}

/// What a frame records is what the proof takes it to do: the same passes in the same order.
#[test]
fn passes_are_recorded_in_the_order_of_the_list() {
    on_gpu(|gpu| {
        let mut orders = BTreeSet::new();
        let beside = [depth::PASS.place, per_light::PASS.place];
        for case in cases().iter().filter(|case| case.presented.is_none()) {
            let mut renderer = gpu.renderer(&case.scene, &case.settings);
            renderer.render(&case.scene.camera).unwrap_or_else(|error| panic!("{}: {error}", case.name));
            // Passes beside another one in its subpass have no time of their own.
            let list = List::of(renderer.plan());
            let places = Frames::of(renderer.plan(), &edges::table(renderer.plan())).passes();
            let times = |place| {
                let own = list.passes_at(place).into_iter().filter(|pass| !beside.contains(&pass.place));
                let mut own: Vec<_> = own.map(|pass| pass.time).collect();
                // SPREAD and SORT stand in the list twice.
                own.dedup();
                own
            };
            let listed: Vec<_> = places.into_iter().flat_map(times).collect();
            assert_eq!(renderer.recorded_passes(), listed, "{}", case.name);
            orders.insert(listed);
        }
        assert!(orders.len() >= 12, "so few different frames have been tried: {orders:?}");
    });
}

/// As a window has the plan.
pub fn presented(plan: FramePlan, way: Way) -> FramePlan {
    plan.presented_as(match way {
        Way::Straight => Canvas::Straight(vk::Format::B8G8R8A8_SRGB),
        Way::Encoded => Canvas::Encode(Encoding { transfer: Transfer::Srgb, headroom: 1.0 }),
    })
}

/// Surfaces under the sky's light.
fn plain() -> Scene {
    let mut scene = plane(lambert(0.7), Vec::new());
    scene.environment = Environment { ambient: Vec3::splat(0.1), background: Vec3::splat(0.2), ground: None };
    scene
}

/// Lit from everywhere, too.
fn lit(mut scene: Scene) -> Scene {
    scene.environment.ambient = Vec3::splat(0.1);
    scene
}

/// With particles, so many that SORT takes several steps.
fn smoking(mut scene: Scene) -> Scene {
    let emitter = Emitter {
        rate: 3000.0,
        size: vec![0.05],
        spread: DVec3::splat(0.5),
        color: vec![[0.5; 4]],
        ..Emitter::default()
    };
    scene.emitters = vec![emitter];
    scene
}

/// Smooth enough to mirror others.
fn polished(mut scene: Scene) -> Scene {
    (scene.materials[0].brdf, scene.materials[0].roughness) = (Brdf::CookTorrance, 0.3);
    scene
}

fn glowing(mut scene: Scene) -> Scene {
    scene.materials[0].emissive = Vec3::ONE;
    scene
}

/// The same on a node, which may move.
fn moved(mut scene: Scene) -> Scene {
    let local = Local::Parts(Placement::default());
    scene.motion.nodes.push(Node { name: "carrier".into(), parent: None, local, weights: Vec::new() });
    scene.objects[0].node = Some(0);
    scene
}

/// The same behind a pane.
fn glazed(mut scene: Scene) -> Scene {
    let pane = Material { alpha_mode: AlphaMode::Blend, alpha: 0.4, ..lambert(0.5) };
    add(&mut scene, rectangle([-0.5, -0.5], [0.5, 0.5], 0.0), pane, DAffine3::from_translation(DVec3::Z * 0.5));
    scene
}

/// A box throws a shadow.
fn sunlit() -> Scene {
    let mut scene = plane(lambert(0.7), vec![sun(DVec3::new(0.5, 0.7, 1.0), 3.0)]);
    add(&mut scene, shapes::cuboid([0.4; 3]), lambert(0.5), DAffine3::from_translation(DVec3::Z * 0.4));
    scene
}

/// A lamp that reaches everywhere, and one that does not.
fn lamplit() -> Scene {
    let lamp = |x: f64, range| point(DVec3::new(x, 0.3, 1.0), 2.0, range, Falloff::InverseSquare);
    plane(lambert(0.7), vec![lamp(-0.5, None), lamp(0.5, Some(3.0))])
}

/// No texel is like its neighbour.
fn textured(edge: u32) -> Scene {
    let mut scene = plain();
    let texels = (0..edge * edge).flat_map(|index| [255, (index * 37) as u8, 64, 255]).collect();
    let (name, size) = ("checks".into(), [edge; 2]);
    scene.textures = vec![Texture { name, size, color_space: ColorSpace::Srgb, sampler: Default::default(), texels }];
    scene.materials[0].base_color_texture = Some(0);
    scene
}

type Change = fn(&mut Settings);

/// Every kind of plan that has dependencies of its own.
pub fn cases() -> Vec<Case> {
    let sorted: Change = |_| {};
    let weighted: Change = |settings| settings.transparency = Transparency::Oit;
    let fxaa: Change = |settings| settings.fxaa = true;
    let toned: Change = |settings| (settings.vignette, settings.grain) = (0.5, 0.1);
    let samples: Change = |settings| settings.msaa = 4;
    let occluded: Change = |settings| settings.ao = AmbientOcclusion::Gtao;
    let fat: Change = |settings| settings.gbuffer = gbuffer("fat");
    let linear: Change = |settings| settings.resolve = Resolve::Linear;
    let hdr: Change = |settings| settings.output = Output::Nits;
    let forward: Change = |settings| settings.light_path = LightPath::Forward;
    let compute: Change = |settings| settings.light_path = LightPath::Compute;
    let stored: Change = |settings| settings.keep = settings.keep.with(OptionalPart::StoredGbuffer);
    let mut all = Vec::new();
    let mut case = |name: &str, scene: Scene, changes: &[Change]| {
        // Maps are drawn in each frame, so that their rows have something to order.
        let shadows = ShadowSettings { cache: false, size: 64, ..ShadowSettings::default() };
        let mut settings = Settings { shadows, light_path: LightPath::Loop, ..own(&scene, 32, 18) };
        changes.iter().for_each(|change| change(&mut settings));
        all.push(Case { name: name.into(), scene, settings, presented: None });
    };
    case("plain", plain(), &[]);
    case("nothing", Scene { name: "nothing".into(), ..Scene::default() }, &[]);
    case("textured", textured(4), &[]);
    case("sunlit", sunlit(), &[]);
    case("deformed", samples::deformed(), &[]);
    case("culled on the device", sunlit(), &[|settings| settings.culling = Culling::Gpu]);
    case("glowing", glowing(plain()), &[]);
    for (name, transparency) in [("sorted", sorted), ("weighted", weighted)] {
        case(name, glazed(plain()), &[transparency]);
        case(&format!("{name}, linear"), glazed(plain()), &[transparency, hdr]);
        case(&format!("{name}, glowing and sunlit"), glazed(glowing(sunlit())), &[transparency]);
        case(&format!("{name}, samples"), glazed(plain()), &[transparency, samples]);
        case(&format!("{name}, linear samples"), glazed(plain()), &[transparency, samples, hdr]);
        case(&format!("{name}, forward"), glazed(plain()), &[transparency, forward]);
        case(&format!("{name}, forward samples"), glazed(plain()), &[transparency, forward, samples]);
    }
    for (name, change) in [("skylit", sorted), ("skylit, forward", forward), ("skylit, samples", samples)] {
        case(name, samples::under_sky(plain()), &[change]);
    }
    case("fxaa", plain(), &[fxaa]);
    case("fxaa, glowing", glowing(plain()), &[fxaa]);
    case("fxaa, glazed", glazed(plain()), &[fxaa]);
    case("glowing and glazed, linear", glazed(glowing(plain())), &[hdr]);
    case("view of samples", plain(), &[samples, |settings| settings.view = View::Complexity]);
    case("samples", plain(), &[samples]);
    case("samples averaged as light", plain(), &[samples, linear]);
    case("samples, glowing", glowing(plain()), &[samples]);
    case("linear", plain(), &[hdr]);
    case("linear, glowing", glowing(plain()), &[hdr]);
    case("linear samples", plain(), &[hdr, samples]);
    case("linear samples, glowing", glowing(plain()), &[hdr, samples]);
    case("view of normals", plain(), &[|settings| settings.view = View::Normal]);
    case("view of overdraw", plain(), &[|settings| settings.view = View::Overdraw]);
    case("view of shadow maps", sunlit(), &[|settings| settings.view = View::ShadowMap]);
    case("light by light", lamplit(), &[|settings| settings.light_path = LightPath::PerLight]);
    case("volumes", lamplit(), &[|settings| settings.light_path = LightPath::Volumes]);
    case("clustered", lamplit(), &[|settings| settings.light_path = LightPath::Clustered]);
    case("compute", lamplit(), &[compute]);
    case("compute, glowing and sunlit", glowing(sunlit()), &[compute]);
    case("compute, linear", lamplit(), &[compute, hdr]);
    case("forward", plain(), &[forward]);
    case("forward, naive", lamplit(), &[|settings| settings.light_path = LightPath::ForwardNaive]);
    case("forward, sunlit", sunlit(), &[forward]);
    case("forward, fxaa", plain(), &[forward, fxaa]);
    case("forward, samples", plain(), &[forward, samples]);
    case("forward, samples averaged as light", plain(), &[forward, samples, linear]);
    case("forward, samples and fxaa", plain(), &[forward, samples, fxaa]);
    case("samples and fxaa", plain(), &[samples, fxaa]);
    case("toned", plain(), &[toned]);
    case("toned, glowing", glowing(plain()), &[toned]);
    case("toned, glazed", glazed(plain()), &[toned]);
    case("toned, samples", plain(), &[toned, samples]);
    case("toned, forward", plain(), &[toned, forward]);
    case("toned and smoothed", plain(), &[toned, fxaa]);
    let bloom: Change = |settings| settings.bloom = 0.1;
    case("bloom", plain(), &[bloom]);
    case("bloom, glowing", glowing(plain()), &[bloom]);
    case("bloom, sorted", glazed(plain()), &[bloom, sorted]);
    case("bloom, weighted", glazed(plain()), &[bloom, weighted]);
    case("bloom, linear", plain(), &[bloom, hdr]);
    case("bloom, samples averaged as light", plain(), &[bloom, samples, linear]);
    case("bloom and fxaa", plain(), &[bloom, fxaa]);
    case("bloom, toned", plain(), &[bloom, toned]);
    case("bloom, toned and smoothed", plain(), &[bloom, toned, fxaa]);
    case("bloom, stored", plain(), &[bloom, stored]);
    case("bloom, stored and glowing", glowing(plain()), &[bloom, stored]);
    case("bloom, light by light", lamplit(), &[bloom, |settings| settings.light_path = LightPath::PerLight]);
    case("bloom, forward", plain(), &[bloom, forward]);
    case("bloom, forward and sorted", glazed(plain()), &[bloom, forward, sorted]);
    case("bloom, forward and weighted", glazed(plain()), &[bloom, forward, weighted]);
    let taa: Change = |settings| settings.taa = true;
    case("over time", plain(), &[taa]);
    case("over time, glowing", glowing(plain()), &[taa]);
    case("over time, sorted", glazed(plain()), &[taa, sorted]);
    case("over time, weighted", glazed(plain()), &[taa, weighted]);
    case("over time, linear", plain(), &[taa, hdr]);
    case("over time, smoothed and toned", plain(), &[taa, fxaa, toned]);
    case("over time, toned", plain(), &[taa, toned]);
    case("over time, spread", plain(), &[taa, bloom]);
    case("over time, spread and smoothed", plain(), &[taa, bloom, fxaa]);
    case("over time, stored", plain(), &[taa, stored]);
    case("over time, forward", plain(), &[taa, forward]);
    case("over time, forward and sorted", glazed(plain()), &[taa, forward, sorted]);
    case("over time, forward and weighted", glazed(plain()), &[taa, forward, weighted]);
    case("over time, glowing and smoothed", glowing(plain()), &[taa, fxaa]);
    case("over time, glowing and stored", glowing(plain()), &[taa, stored]);
    case("over time, deformed", samples::deformed(), &[taa]);
    case("over time, moving", moved(plain()), &[taa]);
    case("over time, moving and glowing", glowing(moved(plain())), &[taa]);
    case("over time, moving and weighted", glazed(moved(plain())), &[taa, weighted]);
    case("over time, moving and sorted", glazed(moved(plain())), &[taa, sorted]);
    case("over time, moving, stored", moved(plain()), &[taa, stored]);
    case("over time, moving, forward", moved(plain()), &[taa, forward]);
    case("over time, moving, forward and weighted", glazed(moved(plain())), &[taa, forward, weighted]);
    case("over time, moving, forward and sorted", glazed(moved(plain())), &[taa, forward, sorted]);
    let fog: Change = |settings| settings.fog = Fog::Height;
    case("fog", plain(), &[fog]);
    case("fog, glowing", glowing(plain()), &[fog]);
    case("fog, linear", plain(), &[fog, hdr]);
    case("fog, samples", plain(), &[fog, samples]);
    case("fog, linear samples", plain(), &[fog, samples, hdr]);
    case("fog, smoothed and toned", plain(), &[fog, fxaa, toned]);
    case("fog, light by light", lamplit(), &[fog, |settings| settings.light_path = LightPath::PerLight]);
    case("fog, in floats", plain(), &[fog, fat]);
    case("fog, stored", plain(), &[fog, stored]);
    case("fog, stored and glowing, linear", glowing(plain()), &[fog, stored, hdr]);
    case("fog and bloom", plain(), &[fog, bloom]);
    case("fog, occluded", plain(), &[fog, occluded]);
    case("fog, forward", plain(), &[fog, forward]);
    case("fog, forward samples", plain(), &[fog, forward, samples]);
    for (name, transparency) in [("sorted", sorted), ("weighted", weighted)] {
        case(&format!("fog, {name}"), glazed(plain()), &[fog, transparency]);
        case(&format!("fog, {name}, linear samples"), glazed(plain()), &[fog, transparency, samples, hdr]);
        case(&format!("fog, {name} and stored"), glazed(plain()), &[fog, transparency, stored]);
        case(&format!("fog, {name} and occluded"), glazed(plain()), &[fog, transparency, occluded]);
        case(&format!("fog, {name}, forward"), glazed(plain()), &[fog, transparency, forward]);
        case(&format!("fog, particles {name}"), smoking(sunlit()), &[fog, transparency]);
    }
    case("fog, particles and stored", smoking(plain()), &[fog, stored]);
    case("fog, particles and occluded", smoking(plain()), &[fog, occluded]);
    case("fog over time", plain(), &[fog, taa]);
    case("fog over time, stored", plain(), &[fog, taa, stored]);
    case("fog over time, moving", moved(plain()), &[fog, taa]);
    case("fog over time, moving, forward and weighted", glazed(moved(plain())), &[fog, taa, forward, weighted]);
    let froxels: Change = |settings| (settings.fog, settings.fog_froxels) = (Fog::Froxels, [5, 4, 3]);
    case("lit fog", lamplit(), &[froxels]);
    case("lit fog, sunlit and stored", sunlit(), &[froxels, stored]);
    case("lit fog, forward", sunlit(), &[froxels, forward]);
    case("lit fog, weighted", glazed(sunlit()), &[froxels, weighted]);
    case("lit fog, sorted", glazed(sunlit()), &[froxels, sorted]);
    case("occluded", plain(), &[occluded]);
    case("occluded, glowing and sunlit", glowing(lit(sunlit())), &[occluded]);
    case("occluded, sorted and glowing", glazed(glowing(plain())), &[occluded, sorted]);
    case("occluded, sorted", glazed(plain()), &[occluded, sorted]);
    case("occluded, weighted", glazed(plain()), &[occluded, weighted]);
    case("occluded, linear", plain(), &[occluded, hdr]);
    case("occluded, in floats", plain(), &[occluded, fat]);
    case("occluded, linear and glowing", glowing(plain()), &[occluded, hdr]);
    case("occluded, smoothed and toned", plain(), &[occluded, fxaa, toned]);
    case("occluded, toned", plain(), &[occluded, toned]);
    case("occluded, view of it", plain(), &[occluded, |settings| settings.view = View::Ao]);
    case("occluded, light by light", lit(lamplit()), &[occluded, |settings| settings.light_path = LightPath::PerLight]);
    case("occluded, compute", lit(lamplit()), &[occluded, compute]);
    case("occluded, compute, glowing and sunlit", glowing(lit(sunlit())), &[occluded, compute]);
    case("particles", smoking(plain()), &[]);
    case("particles, sunlit and glowing", smoking(glowing(sunlit())), &[]);
    case("particles, glazed", smoking(glazed(plain())), &[sorted]);
    case("particles, summed", smoking(plain()), &[weighted]);
    case("particles, linear", smoking(plain()), &[hdr]);
    case("particles, forward", smoking(plain()), &[forward]);
    case("particles, forward and summed", smoking(sunlit()), &[forward, weighted]);
    case("particles, stored", smoking(plain()), &[stored]);
    case("particles, stored and summed", smoking(plain()), &[stored, weighted]);
    case("particles, occluded", smoking(plain()), &[occluded]);
    let mirrored: Change = |settings| settings.reflections = Reflections::Screen;
    case("mirrored", polished(plain()), &[mirrored]);
    case("mirrored and sunlit under a sky", samples::under_sky(polished(sunlit())), &[mirrored]);
    case("mirrored, glowing, occluded and toned", polished(glowing(lit(plain()))), &[mirrored, occluded, toned]);
    case("mirrored, sorted and occluded", polished(glazed(lit(plain()))), &[mirrored, sorted, occluded]);
    case("mirrored, sorted and glowing", polished(glazed(glowing(plain()))), &[mirrored, sorted, fxaa]);
    case("mirrored and glowing", polished(glowing(plain())), &[mirrored]);
    case("mirrored, glowing and smoothed", polished(glowing(plain())), &[mirrored, fxaa]);
    case("mirrored and smoothed", polished(plain()), &[mirrored, fxaa]);
    case("mirrored, sorted, glowing and unsmoothed", polished(glazed(glowing(plain()))), &[mirrored, sorted]);
    case("mirrored, sorted and spread", polished(glazed(plain())), &[mirrored, sorted, bloom]);
    case("mirrored, weighted", polished(glazed(plain())), &[mirrored, weighted]);
    case("mirrored, spread", polished(plain()), &[mirrored, bloom]);
    case("mirrored in fog", polished(plain()), &[mirrored, fog]);
    case("mirrored in fog, smoothed", polished(plain()), &[mirrored, fog, fxaa]);
    case("mirrored in fog, sorted and occluded", polished(glazed(lit(plain()))), &[mirrored, fog, sorted, occluded]);
    case("mirrored in fog, weighted", polished(glazed(plain())), &[mirrored, fog, weighted]);
    case("mirrored in fog, spread", polished(plain()), &[mirrored, fog, bloom]);
    case("mirrored in fog, over time", polished(plain()), &[mirrored, fog, taa]);
    case("mirrored in fog, over time and weighted", polished(glazed(plain())), &[mirrored, fog, taa, weighted]);
    case("mirrored in fog, over time and moving", polished(moved(plain())), &[mirrored, fog, taa]);
    case("mirrored in fog, with particles", polished(smoking(plain())), &[mirrored, fog]);
    case("mirrored, weighted and spread", polished(glazed(plain())), &[mirrored, weighted, bloom]);
    case("mirrored, linear", polished(plain()), &[mirrored, hdr]);
    case("mirrored over time", polished(plain()), &[mirrored, taa]);
    case("mirrored over time and sorted", polished(glazed(plain())), &[mirrored, taa, sorted]);
    case("mirrored over time and weighted", polished(glazed(plain())), &[mirrored, taa, weighted]);
    case("mirrored over time and moving", polished(moved(plain())), &[mirrored, taa]);
    case("mirrored over time, moving and sorted", polished(glazed(moved(plain()))), &[mirrored, taa, sorted]);
    case(
        "mirrored, light by light",
        polished(lamplit()),
        &[mirrored, |settings| settings.light_path = LightPath::PerLight],
    );
    case("stored", plain(), &[stored]);
    case("stored, glowing and sunlit", glowing(sunlit()), &[stored]);
    case("stored, sorted and glowing", glazed(glowing(plain())), &[stored, sorted]);
    case("stored, weighted", glazed(plain()), &[stored, weighted]);
    case("stored, linear and glowing", glowing(plain()), &[stored, hdr]);
    case("stored, samples", plain(), &[stored, samples]);
    case("stored, samples and glowing", glowing(plain()), &[stored, samples]);
    case("stored, view of normals", plain(), &[stored, |settings| settings.view = View::Normal]);
    case("stored, light by light", lamplit(), &[stored, |settings| settings.light_path = LightPath::PerLight]);
    all.extend(shown());
    all
}

/// Each way for a picture to come to a window.
#[cfg(feature = "window")]
fn shown() -> Vec<Case> {
    let ways: [(&str, Scene, Change); 14] = [
        ("lighting", sunlit(), |_| {}),
        ("forward", plain(), |settings| settings.light_path = LightPath::Forward),
        ("tone mapping", glazed(plain()), |_| {}),
        ("emission", glowing(plain()), |_| {}),
        ("samples", plain(), |settings| settings.msaa = 4),
        ("fxaa", plain(), |settings| settings.fxaa = true),
        ("over time", plain(), |settings| settings.taa = true),
        ("over time, toned", plain(), |settings| (settings.taa, settings.vignette) = (true, 0.5)),
        ("bloom", plain(), |settings| settings.bloom = 0.1),
        ("bloom, toned", plain(), |settings| (settings.bloom, settings.vignette) = (0.1, 0.5)),
        ("bloom, toned and smoothed", plain(), |settings| {
            (settings.bloom, settings.vignette, settings.fxaa) = (0.1, 0.5, true);
        }),
        ("mirrored", polished(plain()), |settings| settings.reflections = Reflections::Screen),
        ("mirrored, sorted", polished(glazed(plain())), |settings| settings.reflections = Reflections::Screen),
        ("compute", lamplit(), |settings| settings.light_path = LightPath::Compute),
    ];
    let case = |(name, scene, change): (&str, Scene, Change), way: Way| {
        let shadows = ShadowSettings { cache: false, size: 64, ..ShadowSettings::default() };
        let mut settings = Settings { shadows, light_path: LightPath::Loop, ..own(&scene, 32, 18) };
        change(&mut settings);
        let encoded = if way == Way::Encoded { " and ENCODE" } else { "" };
        Case { name: format!("in a window, by {name}{encoded}"), scene, settings, presented: Some(way) }
    };
    let straight = ways.iter().cloned().map(|one| case(one, Way::Straight));
    straight.chain(ways.iter().cloned().map(|one| case(one, Way::Encoded))).collect()
}

#[cfg(not(feature = "window"))]
fn shown() -> Vec<Case> {
    Vec::new()
}

/// A table with something missing.
struct Mutant<'a> {
    case: &'a Case,
    edge: Edge,
    part: Part,
    edges: Edges,
}

/// Every row of every plan, and each bit of each different row. Of presented frames those rows alone that no others have: in them a render pass
/// ends with a layout change and no reader, which the layer takes to be ordered whatever comes.
fn mutants<'a>(cases: &'a [Case], plans: &[FramePlan]) -> Vec<Mutant<'a>> {
    let mut mutants = Vec::new();
    let mut tried = Vec::new();
    for (case, plan) in cases.iter().zip(plans) {
        let table = edges::table(plan);
        for edge in table.iter().filter(|edge| edge.carrier.stays().is_none()) {
            let new = !tried.contains(edge);
            tried.push(edge.clone());
            // Of frames with both TAA and BLOOM likewise: the barriers between frames on the buffers of the one make the layer take those of the other to be
            // ordered as well.
            let hides = case.presented.is_some() || plan.taa.is_some() && plan.bloom.is_some();
            let is_tried = |part: &Part| new || *part == Part::Row && !hides;
            for part in edge.parts().into_iter().filter(is_tried) {
                let edges = table.without_part(edge.name, part).unwrap_or_else(|error| panic!("{error}"));
                mutants.push(Mutant { case, edge: edge.clone(), part, edges });
            }
        }
    }
    mutants
}

/// Rows of sample plans that no mutant of these plans is made of.
fn untried(tried: &[FramePlan]) -> BTreeSet<String> {
    // Reasons are not compared: several plans give the same row one of their own.
    let rows = |plan: &FramePlan| -> Vec<Edge> {
        edges::table(plan).iter().map(|edge| Edge { why: "", ..edge.clone() }).collect()
    };
    let tried: Vec<Edge> = tried.iter().flat_map(rows).collect();
    let shows = |plan: &FramePlan| cfg!(feature = "window") && [OUTPUT_SRGB, OUTPUT_PLAIN].contains(&plan.output);
    let samples = samples::of_every_kind().into_iter().flat_map(|(name, plan)| {
        let in_window = |way| (format!("{name}, in a window"), presented(plan.clone(), way));
        let shown = shows(&plan).then(|| [in_window(Way::Straight), in_window(Way::Encoded)]);
        [(name, plan)].into_iter().chain(shown.into_iter().flatten()).collect::<Vec<_>>()
    });
    let mut seen = Vec::new();
    let mut missing = BTreeSet::new();
    for (name, plan) in samples {
        for edge in rows(&plan).into_iter().filter(|edge| !tried.contains(edge)) {
            if !seen.contains(&edge) {
                missing.insert(format!("{name}: {edge:?}"));
                seen.push(edge);
            }
        }
    }
    missing
}

/// Needs no device.
#[test]
fn each_dependency_of_the_sample_plans_is_tried() {
    let plan = |case: Case| case.plan(&samples::device()).expect("a plan");
    let missing = untried(&cases().into_iter().map(plan).collect::<Vec<_>>());
    assert!(missing.is_empty(), "{} rows are not tried; draw plans that have them: {missing:#?}", missing.len());
}

/// The extensions of instance and device that presented frames need.
#[cfg(feature = "window")]
const PRESENTING: (&[&CStr], &[&CStr]) = (&afterlight::gpu::HEADLESS, &[c"VK_KHR_swapchain"]);
#[cfg(not(feature = "window"))]
const PRESENTING: (&[&CStr], &[&CStr]) = (&[], &[]);

/// One mode of the layer.
struct Watched {
    instance: std::sync::Arc<Instance>,
    device: std::sync::Arc<Device>,
}

impl Watched {
    fn new(sync_shader_heuristic: bool) -> Result<Self, gpu::Error> {
        let options = InstanceOptions { validation: Validation::Synchronization, sync_shader_heuristic };
        let (of_instance, of_device) = PRESENTING;
        let instance = Instance::with_extensions(&options, of_instance)?;
        let device = Device::with_extensions(&instance, &DeviceChoice::Auto, of_device)?;
        Ok(Self { instance, device })
    }

    fn layer_version(&self) -> u32 {
        let layers = self.instance.layers().iter().filter(|layer| layer.name == "VK_LAYER_KHRONOS_validation");
        layers.map(|layer| layer.spec_version).max().unwrap_or_default()
    }

    #[cfg(feature = "window")]
    fn draw(&self, case: &Case, edges: Edges) -> Result<(), afterlight::frame::Error> {
        // SAFETY: as in `inspect --drop`: what is drawn is not looked at, and the layer speaks before the driver runs it. Software drivers, on
        // which this is run, do one thing after the other.
        unsafe {
            match case.presented {
                Some(way) => experiment::present(&self.device, &case.scene, &case.settings, edges, way == Way::Encoded),
                None => experiment::draw(&self.device, &case.scene, &case.settings, edges).map(drop),
            }
        }
    }

    #[cfg(not(feature = "window"))]
    fn draw(&self, case: &Case, edges: Edges) -> Result<(), afterlight::frame::Error> {
        // SAFETY: as above.
        unsafe { experiment::draw(&self.device, &case.scene, &case.settings, edges).map(drop) }
    }

    /// The rules that the layer finds broken.
    fn says(&self, case: &Case, edges: Edges) -> BTreeSet<String> {
        self.instance.take_messages();
        let drawn = self.draw(case, edges);
        drawn.unwrap_or_else(|error| panic!("{}: {error}", case.name));
        let messages = self.instance.take_messages();
        let ours = messages.into_iter().filter(|message| message.kind != MessageKind::General);
        ours.map(|message| message.id_name).collect()
    }

    /// What it says of each mutant. Of the whole tables it says nothing: so it is not noise that is heard.
    fn judge(&self, cases: &[Case], plans: &[FramePlan], mutants: &[Mutant]) -> Vec<BTreeSet<String>> {
        for (case, plan) in cases.iter().zip(plans) {
            let said = self.says(case, edges::table(plan));
            assert!(said.is_empty(), "{}: with all its dependencies the layer says {said:?}", case.name);
        }
        mutants.iter().map(|mutant| self.says(mutant.case, mutant.edges.clone())).collect()
    }
}

#[test]
fn without_any_row_or_bit_the_layer_complains_or_the_specification_does() {
    let begun = Instant::now();
    let modes = match (Watched::new(false), Watched::new(true)) {
        (Ok(plain), Ok(heuristic)) => [plain, heuristic],
        (Err(error @ gpu::Error::Unsupported(_)), _) => return not_run(&error.to_string()),
        (Err(error), _) | (_, Err(error)) => panic!("{error}"),
    };
    let version = modes[0].layer_version();
    let named = |version| {
        format!(
            "{}.{}.{}",
            vk::api_version_major(version),
            vk::api_version_minor(version),
            vk::api_version_patch(version)
        )
    };
    if version < LAYER {
        let (own, first) = (named(version), named(LAYER));
        return not_run(&format!("layer {own} does not look at the masks of subpass dependencies; {first} does"));
    }
    let device = capabilities(&modes[0].device.physical);
    let cases = cases();
    let plan = |case: &Case| case.plan(&device).unwrap_or_else(|error| panic!("{}: {error}", case.name));
    let plans: Vec<FramePlan> = cases.iter().map(plan).collect();
    let missing = untried(&plans);
    assert!(missing.is_empty(), "on this device {} rows are not tried: {missing:#?}", missing.len());
    let mut mutants = mutants(&cases, &plans);
    if !tries_all() {
        // What the rules say of all of them, `proof` asks. The layer sees a sample; a reason that no longer holds may wait for the daily
        // `make test-all`.
        let (all, mut index) = (mutants.len(), 0);
        mutants.retain(|_| (index += 1, index % 12 == 0).1);
        println!("{} of {all} mutants", mutants.len());
    }
    let [plain, heuristic] = thread::scope(|scope| {
        modes
            .each_ref()
            .map(|mode| scope.spawn(|| mode.judge(&cases, &plans, &mutants)))
            .map(|thread| thread.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)))
    });

    let mut summary = Summary::default();
    let (mut unlisted, mut rotten, mut unproved) = (Vec::new(), Vec::new(), Vec::new());
    let mut argued = BTreeSet::new();
    for (mutant, said) in mutants.iter().zip(plain.iter().zip(&heuristic)) {
        let place = || format!("{} without {:?} in \"{}\"", mutant.edge.name, mutant.part, mutant.case.name);
        let reason = reason(&mutant.edge, mutant.part);
        // What the layer notices, the rules must notice too, and what is argued from the specification.
        if Frames::of(&mutant.case.plan(&device).unwrap_or_else(|error| panic!("{error}")), &mutant.edges).are_safe() {
            unproved.push(place());
        }
        summary.count(mutant, said, reason.is_some());
        match (said.0.is_empty() && said.1.is_empty(), reason) {
            (true, Some(reason)) => _ = argued.insert(std::ptr::from_ref(reason)),
            (true, None) => unlisted.push(place()),
            (false, Some(_)) => rotten.push(format!("{}: {said:?}", place())),
            (false, None) => {}
        }
    }
    let names: BTreeSet<edges::RowName> =
        plans.iter().flat_map(|plan| edges::table(plan).iter().map(|edge| edge.name).collect::<Vec<_>>()).collect();
    println!(
        "layer {}, {} {}: {} plans, {} dependencies by name; {summary} in {:.0} s",
        named(version),
        modes[0].device.physical.name,
        modes[0].device.physical.driver_info,
        plans.len(),
        names.len(),
        begun.elapsed().as_secs_f64()
    );
    assert!(unproved.is_empty(), "by the specification's rules nothing is lost:\n{}", unproved.join("\n"));
    assert!(unlisted.is_empty(), "nobody notices, and no reason is listed:\n{}", unlisted.join("\n"));
    assert!(rotten.is_empty(), "listed as unnoticed, but the layer says so:\n{}", rotten.join("\n"));
    let idle: Vec<_> =
        UNREPORTED_MUTANTS.iter().filter(|reason| !argued.contains(&std::ptr::from_ref(*reason))).collect();
    assert!(idle.is_empty() || !tries_all(), "reasons that no mutant needs: {idle:#?}");
}

/// Mutants by what became of them: whole rows, and bits.
#[derive(Default)]
struct Summary {
    rows: Counts,
    bits: Counts,
    rules: BTreeMap<String, usize>,
}

#[derive(Default)]
struct Counts {
    tried: usize,
    plain: usize,
    heuristic: usize,
    noticed: usize,
    argued: usize,
}

impl Summary {
    fn count(&mut self, mutant: &Mutant, (plain, heuristic): (&BTreeSet<String>, &BTreeSet<String>), argued: bool) {
        let counts = if mutant.part == Part::Row { &mut self.rows } else { &mut self.bits };
        counts.tried += 1;
        counts.plain += usize::from(!plain.is_empty());
        counts.heuristic += usize::from(!heuristic.is_empty());
        counts.noticed += usize::from(!plain.is_empty() || !heuristic.is_empty());
        counts.argued += usize::from(argued);
        for rule in plain.union(heuristic) {
            *self.rules.entry(rule.clone()).or_default() += 1;
        }
    }
}

impl std::fmt::Display for Counts {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { tried, plain, heuristic, noticed, argued } = self;
        write!(f, "{tried} tried, {noticed} noticed ({plain} plainly, {heuristic} by the heuristic), {argued} argued")
    }
}

impl std::fmt::Display for Summary {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "rows: {}; bits: {}; by rule: {:?};", self.rows, self.bits, self.rules)
    }
}
