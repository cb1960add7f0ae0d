//! A frame that is halted after some of its lights shows the light so far, on every light path; and leaves no trace.

use crate::common::compare::{assert_identical, largest_code_difference};
use crate::common::gpu::{Gpu, on_gpu};
use crate::common::stage::{add, directional, exact, lambert, own, plane, point, rectangle, spot, sun};
use crate::common::{one_of, some_of};
use afterlight::frame::{Picture, Renderer};
use afterlight::scene::builtin::shapes;
use afterlight::scene::{
    AlphaMode, Camera, Falloff, Keep, Light, LightPath, Material, OptionalPart, Projection, Scene, Settings,
    Transparency, View,
};
use glam::{DAffine3, DQuat, DVec3, Vec3};

/// Odd, so that no tile divides it.
const SIZE: (u32, u32) = (111, 63);

const PATHS: [LightPath; 7] = [
    LightPath::Loop,
    LightPath::PerLight,
    LightPath::Volumes,
    LightPath::Clustered,
    LightPath::Compute,
    LightPath::Forward,
    LightPath::ForwardNaive,
];

/// Lights of every kind, not in the order in which a frame has them, of which some cast shadows, before a wall, a ball and a block.
fn room() -> Scene {
    let polynomial = Falloff::Polynomial { constant: 1.0, linear: 0.2, quadratic: 3.0 };
    let shadowed = |light: Light| Light { casts_shadow: true, ..light };
    let tinted = |index: usize, light: Light| Light {
        name: format!("lamp {index}"),
        color: Vec3::new(0.4 + 0.1 * index as f32, 0.7, 1.0 - 0.1 * index as f32),
        ..light
    };
    let lights = [
        point(DVec3::new(-0.8, 0.5, 0.8), 0.3, Some(1.5), Falloff::InverseSquare),
        sun(DVec3::new(0.4, 0.6, 1.0), 0.4),
        shadowed(spot(DVec3::new(0.5, 0.4, 1.6), 0.8, 10.0, 30.0)),
        point(DVec3::new(0.9, -0.5, 0.7), 0.4, Some(1.2), Falloff::Quadratic),
        directional(DVec3::new(-1.0, 0.2, 0.5), 0.2),
        shadowed(point(DVec3::new(0.1, 0.2, 1.2), 0.2, Some(2.5), polynomial)),
        point(DVec3::new(0.0, 0.9, 0.5), 0.1, None, Falloff::InverseSquare),
        point(DVec3::new(-0.3, -0.4, 0.9), 0.2, Some(0.9), Falloff::InverseSquare),
    ];
    let lights = lights.into_iter().enumerate().map(|(index, light)| tinted(index, light)).collect();
    let mut scene = plane(lambert(0.7), lights);
    scene.name = "room".into();
    let at = |x: f64, y: f64, z: f64| DAffine3::from_translation(DVec3::new(x, y, z));
    add(&mut scene, shapes::cuboid([0.4; 3]), Material::default(), at(-0.6, -0.5, 0.3));
    add(&mut scene, shapes::sphere(0.25, 16), Material { roughness: 0.3, ..Material::default() }, at(0.2, -0.3, 0.5));
    // Beside the view: with the panes the scene is as large as without, and so are its shadow maps.
    add(&mut scene, shapes::cuboid([0.1; 3]), lambert(0.5), at(3.0, 3.0, 1.3));
    scene.environment.ambient = Vec3::splat(0.02);
    scene.environment.background = Vec3::new(0.05, 0.1, 0.3);
    scene
}

/// Returns [`room`] with two crossing panes before it.
fn room_with_panes() -> Scene {
    let mut scene = room();
    scene.name = "room with panes".into();
    let pane = |alpha| Material { alpha_mode: AlphaMode::Blend, alpha, two_sided: true, ..lambert(0.5) };
    let turned = |angle: f64| DAffine3::from_rotation_translation(DQuat::from_rotation_y(angle), DVec3::Z * 0.9);
    for (alpha, angle) in [(0.4, 0.3), (0.6, -0.3)] {
        add(&mut scene, rectangle([-0.4, -0.3], [0.4, 0.5], 0.0), pane(alpha), turned(angle));
    }
    scene
}

fn frame(renderer: &mut Renderer, camera: &Camera) -> Picture {
    renderer.render(camera).unwrap_or_else(|error| panic!("{error}"));
    renderer.read_back().unwrap_or_else(|error| panic!("{error}"))
}

/// The kinds of picture: light in 32-bit floats, and sRGB codes as a window shows them.
fn kinds(light_path: LightPath) -> [(&'static str, Settings); 2] {
    // Not metered: other lights would bring another exposure.
    let codes = Settings { size: [SIZE.0, SIZE.1], exposure: Some(-1.0), ..Settings::default() };
    [("nits", exact(SIZE.0, SIZE.1)), ("codes", codes)]
        .map(|(kind, settings)| (kind, Settings { light_path, ..settings }))
}

/// An intensity at which a light adds less than half a unit in the last place of the ambient light alone.
const NOTHING: f32 = 1e-20;

/// Dims all lights but the first `lit` to next to nothing, for frames that are otherwise unchanged.
fn dim(renderer: &mut Renderer, scene: &Scene, lit: usize) {
    for (place, number) in renderer.plan().light_numbers().to_vec().into_iter().enumerate() {
        let mut light = scene.lights[number].clone();
        if place >= lit {
            light.intensity = NOTHING;
        }
        renderer.set_light(&mut scene.clone(), number, &light).unwrap_or_else(|error| panic!("{error}"));
    }
}

#[test]
fn a_halted_frame_is_that_of_its_first_lights_bit_for_bit_on_every_light_path() {
    on_gpu(|gpu| {
        let scene = room();
        for (turn, path) in PATHS.into_iter().enumerate() {
            for (kind, settings) in one_of(&kinds(path), turn) {
                let plain = gpu.draw(&scene, settings);
                let (mut halted, mut dimmed) = (gpu.renderer(&scene, settings), gpu.renderer(&scene, settings));
                assert_eq!(halted.plan().light_path, path);
                let mut last = None;
                // Back and forth, so that each comes after others than in order.
                for lit in some_of([0, 1, 2, 3, 4, 5, 6, 7, 8, 5, 2, 8, 0], 5) {
                    let what = format!("{path}, {kind}, {lit} lights");
                    halted.halt_after(Some(lit));
                    dim(&mut dimmed, &scene, lit);
                    let picture = frame(&mut halted, &scene.camera);
                    assert_identical(&picture, &frame(&mut dimmed, &scene.camera), &what);
                    assert!(last.replace(picture.clone()) != Some(picture), "{what}: the step shows nothing new");
                }
                for all in [Some(8), Some(usize::MAX), None] {
                    halted.halt_after(all);
                    assert_identical(&frame(&mut halted, &scene.camera), &plain, &format!("{path}, {kind}, {all:?}"));
                }
            }
        }
    });
}

/// Compares halted frames with frames that were planned without the other lights. Both do the same arithmetic on `loop`.
#[test]
fn a_halted_frame_is_that_of_a_scene_with_its_first_lights_alone() {
    on_gpu(|gpu| {
        let scene = room();
        let settings = Settings { light_path: LightPath::Loop, ..exact(SIZE.0, SIZE.1) };
        let mut halted = gpu.renderer(&scene, &settings);
        let order = halted.plan().light_numbers().to_vec();
        for lit in 0..=order.len() {
            halted.halt_after(Some(lit));
            let lights = order[..lit].iter().map(|&number| scene.lights[number].clone()).collect();
            let alone = gpu.draw(&Scene { lights, ..scene.clone() }, &settings);
            assert_identical(&frame(&mut halted, &scene.camera), &alone, &format!("{lit} lights"));
        }
    });
}

/// One directional light alone is added without counting on the paths that light surfaces as they are drawn.
#[test]
#[ignore = "test-all: halted frames of every light path stay"]
fn the_only_light_is_off_before_it_is_added() {
    on_gpu(|gpu| {
        let lights = [directional(DVec3::new(0.4, 0.6, 1.0), 0.4), sun(DVec3::new(0.4, 0.6, 1.0), 0.4)];
        for (row, light) in lights.into_iter().enumerate() {
            let scene = Scene { lights: vec![light], ..room() };
            let unlit = Scene { lights: Vec::new(), ..scene.clone() };
            for (turn, path) in PATHS.into_iter().enumerate() {
                for (kind, settings) in one_of(&kinds(path), row + turn).iter().cloned() {
                    let what = format!("{path}, {kind}");
                    let mut renderer = gpu.renderer(&scene, &settings);
                    renderer.halt_after(Some(0));
                    let before = frame(&mut renderer, &scene.camera);
                    let expected = gpu.draw(&unlit, &settings);
                    // The plan of a scene without lights has `loop` in the place of paths that need some, and compute encodes sRGB by itself.
                    match path == LightPath::Compute && kind == "codes" {
                        true => assert!(largest_code_difference(&before, &expected).0 <= 1, "{what}"),
                        false => assert_identical(&before, &expected, &what),
                    }
                    renderer.halt_after(None);
                    let whole = frame(&mut renderer, &scene.camera);
                    assert!(whole != before, "{what}: the light adds nothing");
                    assert_identical(&whole, &gpu.draw(&scene, &settings), &what);
                }
            }
        }
    });
}

/// Maps that nobody looked up while the camera went on must hold all that the whole frame needs.
#[test]
#[ignore = "test-all: halted frames of every light path stay"]
fn a_frame_is_whole_after_the_camera_has_moved_while_it_was_halted() {
    on_gpu(|gpu| {
        let mut scene = room();
        // A row of blocks under a lamp, of which each camera sees other shadows.
        for place in -4..=4 {
            let at = DAffine3::from_translation(DVec3::new(0.8 * f64::from(place), 0.0, 0.4));
            add(&mut scene, shapes::cuboid([0.2, 0.6, 0.2]), lambert(0.8), at);
        }
        scene.objects[0].transform = DAffine3::from_scale(DVec3::new(0.9, 0.5, 1.0));
        let lamp = point(DVec3::new(0.0, 0.3, 2.5), 2.0, None, Falloff::InverseSquare);
        scene.lights.push(Light { casts_shadow: true, ..lamp });
        let turned = |angle: f64, x: f64| Camera {
            position: scene.camera.position + DVec3::X * x,
            rotation: DQuat::from_rotation_y(angle),
            projection: Projection::perspective(40.0),
            ..scene.camera
        };
        for path in [LightPath::Loop, LightPath::Forward] {
            let settings = Settings { light_path: path, ..exact(SIZE.0, SIZE.1) };
            let mut renderer = gpu.renderer(&scene, &settings);
            frame(&mut renderer, &turned(0.0, -2.5));
            for (camera, halts) in [
                (turned(0.0, 2.5), [Some(0), None, Some(3), None]),
                (turned(-0.2, 0.6), [Some(2), Some(0), None, None]),
                (turned(0.4, -1.0), [Some(0), Some(9), Some(1), None]),
            ] {
                for halt in halts {
                    renderer.halt_after(halt);
                    let picture = frame(&mut renderer, &camera);
                    let mut fresh = gpu.renderer(&scene, &settings);
                    fresh.halt_after(halt);
                    assert_identical(&picture, &frame(&mut fresh, &camera), &format!("{path}, {halt:?}"));
                }
            }
        }
    });
}

/// Maps of unlit lights are not drawn, and neither are transparent surfaces.
#[test]
fn a_halted_frame_does_not_draw_what_it_does_not_show() {
    on_gpu(|gpu| {
        let scene = room_with_panes();
        let mut renderer = gpu.renderer(&scene, &Settings { light_path: LightPath::Loop, ..exact(SIZE.0, SIZE.1) });
        let drawn = |renderer: &mut Renderer, halt| {
            renderer.halt_after(halt);
            renderer.render(&scene.camera).expect("is drawn");
            renderer.wait().expect("is done").drawn
        };
        let none = drawn(&mut renderer, Some(0));
        assert_eq!((none.lights, none.idle_lights, none.shadow_maps, none.shadow_maps_drawn), (0, 8, 0, 0));
        let first = drawn(&mut renderer, Some(1));
        // The first light has at most the sun's two cascades.
        assert!((1..=2).contains(&first.shadow_maps) && first.shadow_maps_drawn == first.shadow_maps, "{first:?}");
        let all = drawn(&mut renderer, Some(8));
        assert!((first.lights, all.lights) == (1, 8) && all.shadow_maps > 2, "{all:?}");
        let whole = drawn(&mut renderer, None);
        assert_eq!((whole.lights, whole.shadow_maps, whole.objects), (all.lights, all.shadow_maps, all.objects));
        assert_eq!(whole.triangles, all.triangles + 4, "two panes of two triangles");
    });
}

#[test]
#[ignore = "test-all: halted frames of every light path stay"]
fn a_frame_that_is_halted_after_all_lights_lacks_what_is_transparent_and_nothing_else() {
    on_gpu(|gpu| {
        let (scene, opaque) = (room_with_panes(), room());
        for (turn, path) in PATHS.into_iter().filter(|&path| path != LightPath::Compute).enumerate() {
            let ways = [(0, Transparency::Sorted), (1, Transparency::Oit)];
            for &(index, transparency) in one_of(&ways, turn / 2) {
                for (kind, settings) in one_of(&kinds(path), turn + index).iter().cloned() {
                    let what = format!("{path}, {transparency}, {kind}");
                    let settings = Settings { transparency, ..settings };
                    let mut renderer = gpu.renderer(&scene, &settings);
                    let whole = frame(&mut renderer, &scene.camera);
                    renderer.halt_after(Some(usize::MAX));
                    let before = frame(&mut renderer, &scene.camera);
                    assert!(before != whole, "{what}: the panes are not seen");
                    // TRANSPARENT stays, with nothing to draw.
                    let keep = Keep::NONE.with(OptionalPart::Transparent);
                    let expected = gpu.draw(&opaque, &Settings { keep, ..settings });
                    assert_identical(&before, &expected, &what);
                    renderer.halt_after(None);
                    assert_identical(&frame(&mut renderer, &scene.camera), &whole, &what);
                }
            }
        }
    });
}

/// Frames with multisampling, FXAA or emission, and the view with albedo 1, halt like the rest.
#[test]
#[ignore = "test-all: halted frames of every light path stay"]
fn frames_of_other_structures_are_halted_alike() {
    on_gpu(|gpu| {
        let mut glowing = room();
        glowing.materials[1].emissive = Vec3::new(0.3, 0.1, 0.0);
        let plain = |light_path| Settings { light_path, ..own(&glowing, SIZE.0, SIZE.1) };
        for settings in [
            Settings { msaa: 4, ..plain(LightPath::Loop) },
            Settings { msaa: 4, ..plain(LightPath::Forward) },
            Settings { fxaa: true, ..plain(LightPath::Clustered) },
            Settings { view: View::Lighting, ..plain(LightPath::Loop) },
            plain(LightPath::Compute),
        ] {
            let (mut halted, mut dimmed) = (gpu.renderer(&glowing, &settings), gpu.renderer(&glowing, &settings));
            let whole = frame(&mut halted, &glowing.camera);
            for lit in [0, 3, 8] {
                halted.halt_after(Some(lit));
                dim(&mut dimmed, &glowing, lit);
                let what = format!("{}, {} samples, FXAA {}: {lit}", settings.light_path, settings.msaa, settings.fxaa);
                let picture = frame(&mut halted, &glowing.camera);
                assert_identical(&picture, &frame(&mut dimmed, &glowing.camera), &what);
                assert_eq!(picture == whole, lit == 8, "{what}");
            }
        }
    });
}

/// More lights than a uniform buffer holds, and enough for the froxels' lists to differ.
#[test]
#[ignore = "test-all: halted frames of every light path stay"]
fn any_part_of_many_lights_is_lit() {
    on_gpu(|gpu: &Gpu| {
        let mut scene = room();
        for index in 0..300 {
            let share = |step: f64| (0.5 + f64::from(index) * step).fract() * 2.0 - 1.0;
            let place = DVec3::new(share(0.819_172_513), share(0.671_043_607), 0.4 + 0.2 * share(0.549_700_478));
            scene.lights.push(point(place, 0.02, Some(0.4), Falloff::Quadratic));
        }
        for path in [LightPath::Clustered, LightPath::Compute, LightPath::Volumes, LightPath::Forward] {
            let settings = Settings { light_path: path, ..exact(SIZE.0, SIZE.1) };
            let (mut halted, mut dimmed) = (gpu.renderer(&scene, &settings), gpu.renderer(&scene, &settings));
            for lit in [64, 1, 257, 308] {
                halted.halt_after(Some(lit));
                dim(&mut dimmed, &scene, lit);
                let picture = frame(&mut halted, &scene.camera);
                assert_identical(&picture, &frame(&mut dimmed, &scene.camera), &format!("{path}: {lit}"));
            }
        }
    });
}
