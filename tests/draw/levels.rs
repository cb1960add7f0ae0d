//! Levels of detail: fewer triangles, a picture that hardly differs, and no shadow of a mesh on its own level.

use afterlight::frame::{DrawCounts, Picture};
use afterlight::scene::builtin::shapes;
use afterlight::scene::{
    Camera, Culling, Falloff, Keep, LightPath, OptionalPart, Projection, Scene, Settings, ShadowFilter, ShadowSettings,
};
use glam::{DAffine3, DVec3};
use image::RgbImage;

use crate::common::compare::assert_identical;
use crate::common::golden::flip_error;
use crate::common::gpu::{Gpu, bytes, on_gpu};
use crate::common::some_in_turn;
use crate::common::stage::{add, lambert, open, own, point, stage, sun};

const SIZE: (u32, u32) = (320, 180);

fn frame(gpu: &Gpu, scene: &Scene, settings: &Settings) -> (Picture, DrawCounts) {
    let mut renderer = gpu.renderer(scene, settings);
    renderer.render(&scene.camera).unwrap_or_else(|error| panic!("{error}"));
    let drawn = renderer.wait().unwrap_or_else(|error| panic!("{error}")).drawn;
    (renderer.read_back().unwrap_or_else(|error| panic!("{error}")), drawn)
}

fn rgb(picture: &Picture) -> RgbImage {
    let [width, height] = picture.size;
    let pixels = bytes(picture).chunks_exact(4).flat_map(|pixel| [pixel[0], pixel[1], pixel[2]]);
    RgbImage::from_raw(width, height, pixels.collect()).expect("a picture of its size")
}

fn field() -> Scene {
    open("builtin:field?objects=400&lights=12&range=0&detail=4")
}

/// Balls and rings on a floor, under a sun and a lamp that both cast shadows.
fn yard() -> Scene {
    let mut scene = stage();
    scene.name = "yard".into();
    add(&mut scene, shapes::plane([60.0; 2]), lambert(0.6), DAffine3::from_translation(DVec3::Y * -0.8));
    for index in 0..40 {
        let at = DVec3::new(f64::from(index % 8) * 1.3 - 4.5, -0.3, -2.0 - 2.5 * f64::from(index / 8));
        let shape = if index % 2 == 0 { shapes::sphere(0.5, 96) } else { shapes::torus(0.38, 0.14, 96) };
        add(&mut scene, shape, lambert(0.7), DAffine3::from_translation(at));
    }
    scene.lights = vec![
        sun(DVec3::new(0.5, 1.0, 0.6), 3.0),
        point(DVec3::new(0.0, 3.0, -4.0), 20.0, None, Falloff::InverseSquare),
    ];
    scene
}

#[test]
#[ignore = "test-all: the comparison with rays, or with the frame that leaves nothing out, stays"]
fn a_picture_with_levels_hardly_differs_and_has_far_fewer_triangles() {
    on_gpu(|gpu| {
        for scene in [field(), yard()] {
            let settings = own(&scene, SIZE.0, SIZE.1);
            let (whole, all) = frame(gpu, &scene, &settings);
            let mut errors = vec![];
            for (lod, most, share) in [(0.25, 0.02, 0.2), (1.0, 0.05, 0.06), (4.0, 0.1, 0.03)] {
                let (picture, drawn) = frame(gpu, &scene, &Settings { lod, ..settings.clone() });
                let (error, _) = flip_error(&rgb(&whole), &rgb(&picture));
                let own = drawn.triangles as f64 / all.triangles as f64;
                assert!(error <= most && error > 0.0, "{}, {lod} pixels: {error}", scene.name);
                assert!(own <= share, "{}, {lod} pixels: {own} of the triangles", scene.name);
                assert_eq!((drawn.objects, drawn.casters), (all.objects, all.casters), "{}", scene.name);
                errors.push(error);
            }
            assert!(errors.is_sorted(), "{}: {errors:?}", scene.name);
        }
    });
}

/// Meshes that cast in place of their levels would shade these: with the first filter and half a pixel, 4.3 times the shadow.
#[test]
#[ignore = "test-all: the comparison with rays, or with the frame that leaves nothing out, stays"]
fn levels_lie_in_no_shadow_of_their_meshes() {
    on_gpu(|gpu| {
        let scene = yard();
        for filter in [ShadowFilter::None, ShadowFilter::Box2] {
            let of = |lod: f32, enabled: bool| {
                let shadows = ShadowSettings { enabled, filter, size: 4096, ..ShadowSettings::default() };
                frame(gpu, &scene, &Settings { lod, shadows, ..own(&scene, SIZE.0, SIZE.1) }).0
            };
            let darker = |lit: &Picture, shadowed: &Picture| {
                bytes(lit)
                    .iter()
                    .zip(bytes(shadowed))
                    .map(|(lit, own)| u64::from(lit.saturating_sub(*own)))
                    .sum::<u64>()
            };
            let whole = darker(&of(0.0, false), &of(0.0, true)) as f64;
            for (lod, most) in [(0.5, 0.02), (2.0, 0.12)] {
                let own = darker(&of(lod, false), &of(lod, true)) as f64 / whole;
                assert!((own - 1.0).abs() < most, "{filter}, {lod} pixels: {own} times the shadow");
            }
        }
    });
}

#[test]
#[ignore = "test-all: the comparison with rays, or with the frame that leaves nothing out, stays"]
fn levels_are_the_same_however_a_frame_is_drawn() {
    on_gpu(|gpu| {
        let scene = field();
        let of = |settings: Settings| frame(gpu, &scene, &Settings { lod: 2.0, ..settings }).0;
        let base = Settings { light_path: LightPath::Loop, ..own(&scene, SIZE.0, SIZE.1) };
        let expected = of(base.clone());
        let keep = Keep::NONE.with(OptionalPart::OffscreenObjects).with(OptionalPart::IdleCasters);
        assert_identical(
            &of(Settings { culling: Culling::Gpu, ..base.clone() }),
            &expected,
            "asked to cull on the device",
        );
        assert_identical(&of(Settings { keep, ..base.clone() }), &expected, "with all that is out of view");
        let prepass = of(Settings { depth_prepass: Some(true), ..base });
        let (error, _) = flip_error(&rgb(&expected), &rgb(&prepass));
        assert!(error < 1e-3, "after a depth pre-pass: {error}");
    });
}

#[test]
fn the_device_chooses_the_levels_that_the_cpu_chooses() {
    on_gpu(|gpu| {
        for (turn, center) in [DVec3::ZERO, DVec3::new(3e6, -1e5, 7e6)].into_iter().enumerate() {
            let mut scene = field();
            for (index, object) in scene.objects.iter_mut().enumerate() {
                object.transform.matrix3 *= 0.25 * (1 << (index % 4)) as f64;
                object.transform.translation += center;
            }
            // The path `visibility` does not go with culling on the device.
            let paths = LightPath::NAMES.iter().filter(|(_, path)| *path != LightPath::Visibility);
            let paths: Vec<_> = paths.enumerate().collect();
            for (path, &(name, light_path)) in some_in_turn(&paths, turn, 2) {
                // Every third in parallel rays.
                let height = if path % 3 == 0 { Projection::orthographic(40.0) } else { scene.camera.projection };
                let camera = Camera { projection: height, position: scene.camera.position + center, ..scene.camera };
                let scene = Scene { camera, ..scene.clone() };
                let lod = [0.3, 1.0, 5.0][(path + turn) % 3];
                let settings = |culling| Settings {
                    culling,
                    lod,
                    light_path,
                    depth_prepass: Some(false),
                    ..own(&scene, SIZE.0, SIZE.1)
                };
                let [cpu, device] = [Culling::Cpu, Culling::Gpu].map(|culling| frame(gpu, &scene, &settings(culling)));
                assert!(device.1.found.is_some_and(|found| found > 0) && cpu.1.found.is_none(), "{name}");
                assert_identical(&device.0, &cpu.0, &format!("{name} at {center}"));
                let whole = frame(gpu, &scene, &Settings { lod: 0.0, ..settings(Culling::Gpu) });
                assert_ne!(bytes(&whole.0), bytes(&device.0), "{name}: levels are not seen");
            }
        }
    });
}
