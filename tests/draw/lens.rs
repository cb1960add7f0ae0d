//! Depth of field and motion blur of several samples, against values that are worked out by hand, and against each other where they must agree.

use super::antialiasing::{BRIGHT, DARK, edge};
use crate::common::gpu::{Gpu, floats, nits, on_gpu, places};
use crate::common::moving::moving;
use crate::common::some_of;
use crate::common::stage::{EDGE, exact, open, own};
use afterlight::frame::{self, Picture};
use afterlight::plan;
use afterlight::scene::{
    Aperture, Channel, ChannelTarget, Clip, Culling, Interpolation, Keep, LightPath, Local, Motion, Node, OptionalPart,
    Output, Placement, Projection, Scene, Settings,
};
use glam::DVec3;
use std::f64::consts::PI;

/// Pixels of a slope of 1 in the pictures of the stage, whose camera sees half a metre a metre away, up and down.
const SCALE: f64 = EDGE as f64;

/// The part of a disc of radius 1 left of a line.
fn left_of(line: f64) -> f64 {
    let line = line.clamp(-1.0, 1.0);
    0.5 + (line.asin() + line * (1.0 - line * line).sqrt()) / PI
}

/// Returns the share of a pixel on the bright side of a vertical edge in the picture's middle that is blurred to a disc of this radius in pixels.
fn blurred(x: u32, radius: f64) -> f64 {
    const PARTS: u32 = 64;
    let covered = |part: u32| {
        let at = f64::from(x) + (f64::from(part) + 0.5) / f64::from(PARTS) - SCALE / 2.0;
        if radius > 0.0 { left_of(at / radius) } else { f64::from(u8::from(at > 0.0)) }
    };
    (0..PARTS).map(covered).sum::<f64>() / f64::from(PARTS)
}

fn draw(gpu: &Gpu, scene: &Scene, settings: &Settings) -> Picture {
    gpu.renderer(scene, settings).picture(&scene.camera, || ()).unwrap_or_else(|error| panic!("{error}"))
}

/// The greatest error of the light of any pixel, as a share of the step at the edge.
fn worst(picture: &Picture, expected: impl Fn(u32) -> f64) -> f64 {
    let error = |(x, y)| {
        let expected = DARK + (BRIGHT - DARK) * expected(x);
        ((nits(picture, x, y).y - expected) / (BRIGHT - DARK)).abs()
    };
    places(picture).map(error).fold(0.0, f64::max)
}

#[test]
fn an_edge_out_of_focus_is_as_bright_as_the_part_of_the_lens_that_sees_past_it() {
    on_gpu(|gpu| {
        let scene = edge(0.0);
        // The edge is two metres away.
        for (diameter, focus) in [(0.8f32, 1.0f32), (0.8, 4.0), (1.6, 3.0), (0.4, 1e6)] {
            let radius = 0.5 * f64::from(diameter) * (1.0 / 2.0 - 1.0 / f64::from(focus)).abs() * SCALE;
            for samples in [16u32, 64, 256] {
                let aperture = Aperture::Diameter(diameter);
                let settings = Settings { samples, aperture, focus: Some(focus), ..exact(EDGE, EDGE) };
                let found = worst(&draw(gpu, &scene, &settings), |x| blurred(x, radius));
                // The bound of points on a disc that a line parts (src/frame/jitter.rs); and vertices have 8 bits below the pixel.
                let bound = 0.75 / f64::from(samples).sqrt() + 1.0 / 256.0;
                assert!(found <= bound, "{diameter} m at {focus} m, {samples} samples: {found}, more than {bound}");
            }
            // Discs of 3.3 pixels and more take a third of the light of the pixel beside the edge: a sharp edge would be off by that.
            assert!((0..EDGE).map(|x| (blurred(x, radius) - blurred(x, 0.0)).abs()).fold(0.0, f64::max) > 0.2);
        }
    });
}

#[test]
fn an_edge_in_the_focal_plane_is_sharp_through_any_lens() {
    on_gpu(|gpu| {
        let scene = edge(0.0);
        for aperture in [Aperture::Diameter(1.0), Aperture::FNumber(0.05)] {
            let settings = Settings { samples: 64, aperture, focus: Some(2.0), ..exact(EDGE, EDGE) };
            let found = worst(&draw(gpu, &scene, &settings), |x| blurred(x, 0.0));
            // Columns of jittered frames, each cut by the edge in one of them; and vertices have 8 bits below the pixel.
            assert!(found <= 1.0 / 64.0 + 1.0 / 256.0, "{aperture}: {found}");
        }
    });
}

/// The half-plane of `edge` on a node that carries it by a metre in a second.
fn sliding() -> Scene {
    let mut scene = edge(0.0);
    let local = Local::Parts(Placement::default());
    let node = Node { name: "slide".into(), parent: None, local, weights: Vec::new() };
    let slide = Channel {
        target: ChannelTarget::Translation(0),
        times: vec![0.0, 1.0],
        values: vec![0.0, 0.0, 0.0, 1.0, 0.0, 0.0],
        interpolation: Interpolation::Linear,
    };
    let clips = vec![Clip { name: "slide".into(), channels: vec![slide] }];
    scene.motion = Motion { nodes: vec![node], clips, ..Motion::default() };
    scene.objects[0].node = Some(0);
    scene
}

#[test]
fn a_moving_edge_is_as_bright_as_the_part_of_the_time_for_which_it_covers_a_pixel() {
    on_gpu(|gpu| {
        let scene = sliding();
        for (time, shutter) in [(0.0, 0.25f32), (0.1, 0.5)] {
            for samples in [16u32, 64] {
                let settings = Settings { samples, shutter, ..exact(EDGE, EDGE) };
                // At a distance of two metres a metre is half the slope; the bright side lies to the right of the edge.
                let [from, to] = [time, time + f64::from(shutter)].map(|seconds| SCALE / 2.0 + seconds * SCALE / 2.0);
                let covered = |x: u32| {
                    let parts = (0..256).map(|part| f64::from(x) + (f64::from(part) + 0.5) / 256.0);
                    parts.map(|at| ((at - from) / (to - from)).clamp(0.0, 1.0)).sum::<f64>() / 256.0
                };
                let found = worst(&gpu.expose(&scene, &settings, time), covered);
                // Each frame has its own part of the time and its own column of the pixel: an edge meets both one after the other, and either may
                // be off by one frame.
                let bound = 2.0 / f64::from(samples) + 1.0 / 256.0;
                assert!(found <= bound, "{time} s, {shutter} s, {samples} samples: {found}, more than {bound}");
            }
        }
    });
}

#[test]
fn one_sample_has_neither_and_says_so() {
    on_gpu(|gpu| {
        let scene = sliding();
        let plain = exact(EDGE, EDGE);
        let asked = Settings { aperture: Aperture::Diameter(0.5), focus: Some(1.0), shutter: 0.5, ..plain.clone() };
        assert_eq!(gpu.expose(&scene, &asked, 0.25), gpu.expose(&scene, &plain, 0.25));
        let warnings =
            |settings: &Settings| frame::plan_for(&gpu.device, &scene, settings).expect("a plan").warnings().to_vec();
        assert!(warnings(&plain).is_empty());
        assert_eq!(
            warnings(&asked),
            ["a picture of 1 sample has neither lens nor open shutter: several have, as --samples 64"]
        );
        assert!(warnings(&Settings { samples: 2, ..asked }).is_empty());
    });
}

#[test]
fn a_lens_without_a_focus_and_one_before_parallel_rays_are_refused() {
    on_gpu(|gpu| {
        let mut scene = edge(0.0);
        let settings = Settings { samples: 4, aperture: Aperture::FNumber(2.8), ..exact(EDGE, EDGE) };
        let refused = |scene: &Scene, settings: &Settings| match frame::plan_for(&gpu.device, scene, settings) {
            Err(plan::PlanError::Lens(why)) => why,
            other => panic!("{other:?}"),
        };
        let why = refused(&scene, &settings);
        assert_eq!(why, "--aperture f/2.8 needs a focus distance: add --focus METRES");
        scene.camera.projection = Projection::orthographic(2.0);
        let why = refused(&scene, &Settings { focus: Some(2.0), ..settings });
        assert!(why.contains("orthographic camera has no lens"), "{why}");
    });
}

/// Frames that look through the rim of a wide lens see things that its middle does not: culling, froxels, rectangles and volumes of lights, shadows
/// and levels of detail follow each frame's own camera.
#[test]
fn whatever_is_left_out_and_whichever_way_is_lit_the_picture_through_a_lens_is_the_same() {
    on_gpu(|gpu| {
        let ways = [
            ("builtin:field?objects=60&lights=12", 3.0f32, 4.0f32),
            ("builtin:hall?bays=1&detail=6", 0.5, 2.0),
            ("builtin:field?objects=60&lights=12", 40.0, 0.5),
        ];
        for (spec, aperture, focus) in some_of(ways, 2) {
            let scene = open(spec);
            let lens = Settings { aperture: Aperture::Diameter(aperture), focus: Some(focus), ..own(&scene, 64, 48) };
            let base = Settings { samples: 5, output: Output::Nits, light_path: LightPath::Loop, ..lens };
            let first = draw(gpu, &scene, &base);
            assert!(floats(&first).iter().all(|value| value.is_finite()));
            let keep: Keep = [
                OptionalPart::OffscreenObjects,
                OptionalPart::OccludedObjects,
                OptionalPart::IdleCasters,
                OptionalPart::IdleLights,
            ]
            .into_iter()
            .collect();
            assert_eq!(first, draw(gpu, &scene, &Settings { keep, ..base.clone() }), "{spec}: all is kept");
            assert_eq!(
                first,
                draw(gpu, &scene, &Settings { culling: Culling::Gpu, ..base.clone() }),
                "{spec}: by the device"
            );
            for light_path in [LightPath::Clustered, LightPath::Compute] {
                assert_eq!(first, draw(gpu, &scene, &Settings { light_path, ..base.clone() }), "{spec}: {light_path}");
            }
            for light_path in [LightPath::PerLight, LightPath::Volumes] {
                let other = draw(gpu, &scene, &Settings { light_path, ..base.clone() });
                for (x, y) in places(&first) {
                    let (a, b) = (nits(&first, x, y), nits(&other, x, y));
                    // Sums in another order (docs/LIGHT_PATHS.md), of each of the frames.
                    let bound = 2.0 * (scene.lights.len() as f64 + 2.0) / f64::from(1 << 24)
                        * a.max_element().max(b.max_element());
                    assert!((a - b).abs().max_element() <= bound, "{spec}: {light_path} at ({x}, {y}): {a} and {b}");
                }
            }
        }
    });
}

#[test]
fn the_same_lens_and_shutter_give_the_same_bytes() {
    on_gpu(|gpu| {
        let scene = moving(DVec3::ZERO);
        let lens =
            Settings { aperture: Aperture::Diameter(0.2), focus: Some(2.0), shutter: 0.3, ..own(&scene, 48, 32) };
        let settings = Settings { samples: 6, ..lens };
        let first = gpu.expose(&scene, &settings, 0.2);
        assert_eq!(first, gpu.expose(&scene, &settings, 0.2));
        let still = Settings { shutter: 0.0, ..settings.clone() };
        assert!(first != gpu.expose(&scene, &still, 0.2), "nothing moves");
    });
}
