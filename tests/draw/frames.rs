//! Frames: the same input gives the same bytes, whatever was drawn before, and parts that are left out were not needed.

use crate::common::compare::{assert_identical, largest_code_difference};
use crate::common::gpu::{code, nits, on_gpu, places};
use crate::common::stage::{
    EDGE, EYE, add, directional, display, exact, gbuffer, lambert, open, own, plane, point, rectangle, seen, srgb_code,
    srgb_code_unrounded, stage, view, white_radiance,
};
use crate::common::truth::radiance;
use afterlight::frame::{Picture, Renderer};
use afterlight::scene::builtin::shapes;
use afterlight::scene::{
    Aabb, Camera, Falloff, HdrFormat, Light, LightKind, LightPath, Material, Output, Scene, Settings, Tonemap, View,
};
use afterlight_truth::reference::light::arriving;
use glam::{DAffine3, DQuat, DVec3, Vec3};

const SMALL: (u32, u32) = (96, 54);

fn drawn_after(renderer: &mut Renderer, cameras: &[Camera]) -> Picture {
    for camera in cameras {
        renderer.render(camera).unwrap_or_else(|error| panic!("{error}"));
    }
    renderer.read_back().unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn the_same_scene_gives_the_same_bytes_on_a_new_device_and_frame_after_frame() {
    for spec in ["builtin:spheres", "builtin:cornell", "builtin:field?objects=60&lights=16", "builtin:hall"] {
        let scene = open(spec);
        for output in [Output::Srgb8, Output::Nits] {
            let settings = Settings { output, ..own(&scene, SMALL.0, SMALL.1) };
            let mut first: Option<Picture> = None;
            on_gpu(|gpu| {
                let mut renderer = gpu.renderer(&scene, &settings);
                let alone = first.insert(drawn_after(&mut renderer, &[scene.camera]));
                assert_identical(alone, &drawn_after(&mut renderer, &[scene.camera; 5]), spec);
            });
            on_gpu(|gpu| {
                if let Some(first) = &first {
                    assert_identical(first, &gpu.draw(&scene, &settings), spec);
                }
            });
        }
    }
}

#[test]
fn a_scene_that_is_given_up_is_drawn_as_any_other_and_stays_whole_where_it_cannot_be_planned() {
    on_gpu(|gpu| {
        let mut scene = open("builtin:hall");
        let settings = own(&scene, SMALL.0, SMALL.1);
        let wanted = gpu.draw(&scene, &settings);
        let impossible = Settings { size: [0, 0], ..settings.clone() };
        let (meshes, textures) = (scene.meshes.len(), scene.textures.len());
        assert!(Renderer::taking(&gpu.device, &mut scene, &impossible).is_err());
        assert!(meshes > 0 && textures > 0 && (scene.meshes.len(), scene.textures.len()) == (meshes, textures));
        let camera = scene.camera;
        let renderer = Renderer::taking(&gpu.device, &mut scene, &settings);
        let mut renderer = renderer.unwrap_or_else(|error| panic!("{error}"));
        assert!(scene.meshes.is_empty() && scene.textures.is_empty());
        assert_identical(&drawn_after(&mut renderer, &[camera; 3]), &wanted, "the hall");
    });
}

#[test]
fn a_picture_is_that_of_its_own_camera_whatever_is_in_flight() {
    on_gpu(|gpu| {
        // Cornell has an HDR target, the hall a shadow map that follows the camera.
        for spec in ["builtin:cornell", "builtin:hall"] {
            let scene = open(spec);
            let settings = own(&scene, SMALL.0, SMALL.1);
            let turned = |degrees: f64| Camera {
                rotation: scene.camera.rotation * DQuat::from_rotation_y(degrees.to_radians()),
                ..scene.camera
            };
            let (a, b, c) = (scene.camera, turned(15.0), turned(-20.0));
            let mut renderer = gpu.renderer(&scene, &settings);
            let mixed = [&[a, b][..], &[b, a, c], &[c, c, a]].map(|cameras| drawn_after(&mut renderer, cameras));
            let alone = [b, c, a].map(|camera| gpu.draw(&Scene { camera, ..scene.clone() }, &settings));
            for (mixed, alone) in mixed.iter().zip(&alone) {
                assert_identical(mixed, alone, spec);
            }
            assert_ne!(alone[0], alone[1], "the cameras see different things");
        }
    });
}

/// Boxes and lights at places whose coordinates, and their sums with 1e6, are exact in f64.
#[test]
fn exposure_changes_from_frame_to_frame_and_what_has_none_refuses_it() {
    let mut scene = boxes(DVec3::ZERO);
    scene.environment.background = Vec3::new(20.0, 60.0, 90.0);
    on_gpu(|gpu| {
        let shown = |exposure: f32, light_path: LightPath, output: Output| {
            let own = Settings { size: [96, 54], exposure: Some(exposure), ..Settings::default() };
            let settings = Settings { light_path, output, ..own };
            Renderer::new(&gpu.device, &scene, &settings).unwrap_or_else(|error| panic!("{error}"))
        };
        let looks = [scene.camera];
        let paths = [LightPath::Loop, LightPath::PerLight, LightPath::Compute, LightPath::Forward];
        for (path, output) in paths.into_iter().flat_map(|path| [(path, Output::Srgb8), (path, Output::Exposed)]) {
            let what = format!("{path} {output}");
            let drawn = |exposure| drawn_after(&mut shown(exposure, path, output), &looks);
            let [bright, dark] = [4.0, 7.0].map(drawn);
            assert!(bright != dark, "{what}");
            let mut renderer = shown(4.0, path, output);
            assert_identical(&drawn_after(&mut renderer, &looks), &bright, &what);
            renderer.set_exposure(7.0).unwrap_or_else(|error| panic!("{error}"));
            assert_identical(&drawn_after(&mut renderer, &looks), &dark, &what);
            // A frame is under way when it changes again.
            renderer.render(&scene.camera).unwrap_or_else(|error| panic!("{error}"));
            renderer.set_exposure(4.0).unwrap_or_else(|error| panic!("{error}"));
            assert_identical(&drawn_after(&mut renderer, &looks), &bright, &what);
            for wrong in [101.0, f32::NAN] {
                let error = renderer.set_exposure(wrong).expect_err("no exposure").to_string();
                assert!(error.contains("a number from -100 to 100 (EV100)"), "{error}");
            }
        }
        let error = shown(4.0, LightPath::Auto, Output::Nits).set_exposure(4.0).expect_err("nits").to_string();
        assert!(error.contains("nits has no exposure"), "{error}");
    });
}

fn boxes(offset: DVec3) -> Scene {
    let mut scene = stage();
    for (index, x) in [-0.75, 0.0, 0.5].into_iter().enumerate() {
        let place = DVec3::new(x, 0.25 * index as f64 - 0.5, -0.5 * index as f64) + offset;
        let material = Material { roughness: 0.4, ..Material::default() };
        add(&mut scene, shapes::cuboid([0.5, 0.75, 0.5]), material, DAffine3::from_translation(place));
    }
    scene.lights = vec![
        directional(DVec3::new(0.5, 0.75, 1.0), 3.0),
        point(DVec3::new(0.25, 0.5, 1.0) + offset, 2.0, Some(4.0), Falloff::InverseSquare),
    ];
    scene.camera.position += offset;
    scene.camera.rotation = DQuat::from_rotation_y(0.125) * DQuat::from_rotation_x(0.0625);
    scene
}

#[test]
fn a_scene_a_thousand_kilometres_away_gives_the_same_bits() {
    on_gpu(|gpu| {
        for gbuffer in ["lean", "fat", "float32"].map(gbuffer) {
            let settings = Settings { gbuffer, ..exact(SMALL.0, SMALL.1) };
            let near = gpu.draw(&boxes(DVec3::ZERO), &settings);
            assert!(places(&near).filter(|&(x, y)| nits(&near, x, y).x > 0.01).count() > 500, "boxes are seen");
            for offset in [DVec3::new(1e6, 0.0, 0.0), DVec3::new(-1e6, 1e6, 1e6)] {
                assert_identical(&near, &gpu.draw(&boxes(offset), &settings), "moved by a thousand kilometres");
            }
        }
    });
}

#[test]
fn nothing_is_too_far_away_to_be_drawn() {
    on_gpu(|gpu| {
        for distance in [1e3, 1e6, 1e9, 1e15] {
            let mut scene = stage();
            let (half, z) = (distance * 0.25, EYE.z - distance);
            add(&mut scene, rectangle([-half, -half], [half, half], z), lambert(0.5), DAffine3::IDENTITY);
            scene.lights = vec![directional(DVec3::Z, 2.0)];
            for gbuffer in ["lean", "float32"].map(gbuffer) {
                let picture = gpu.draw(&scene, &Settings { gbuffer, ..exact(EDGE, EDGE) });
                let found = nits(&picture, EDGE / 2, EDGE / 2).x;
                // Albedo 0.5 is code 187.5 of 8 bits: up to 0.6 of a code off, 2.3 times that in linear light.
                let expected = 0.5 * white_radiance(2.0, 0.0);
                assert!((found / expected - 1.0).abs() < 0.008, "at {distance} m: {found} for {expected}");
                assert_eq!(nits(&picture, 1, 1), DVec3::ZERO, "beside it is sky");
            }
        }
    });
}

#[test]
fn the_nearer_surface_wins_at_any_distance() {
    on_gpu(|gpu| {
        for distance in [1.0, 1e3, 1e6] {
            let mut scene = stage();
            // 32-bit floats tell depths apart that differ by 6e-8 of the distance; rasterized ones by 1e-6.
            let planes = [(distance, Vec3::X), (distance * (1.0 - 4e-6), Vec3::Y)];
            for (distance, base_color) in planes {
                let (half, z) = (distance, EYE.z - distance);
                let material = Material { base_color, ..lambert(1.0) };
                add(&mut scene, rectangle([-half, -half], [half, half], z), material, DAffine3::IDENTITY);
            }
            scene.lights = vec![directional(DVec3::Z, 2.0)];
            for listed in 0..2 {
                scene.objects.rotate_left(listed);
                let picture = gpu.draw(&scene, &exact(EDGE, EDGE));
                let green = |(x, y): (u32, u32)| nits(&picture, x, y).y > 0.0 && nits(&picture, x, y).x == 0.0;
                assert!(places(&picture).all(green), "at {distance} m");
            }
        }
    });
}

#[test]
fn culling_changes_no_pixel() {
    on_gpu(|gpu| {
        let mut scene = open("builtin:field?objects=150&lights=8");
        scene.camera.rotation = DQuat::from_rotation_y(0.6);
        let settings = Settings { exposure: Some(5.0), ..own(&scene, SMALL.0, SMALL.1) };
        let drawn = |scene: &Scene| {
            let mut renderer = gpu.renderer(scene, &settings);
            let picture = drawn_after(&mut renderer, &[scene.camera]);
            (picture, renderer.wait().unwrap_or_else(|error| panic!("{error}")).drawn)
        };
        let (culled, drawn_culled) = drawn(&scene);
        // Boxes that reach everywhere defeat culling.
        for mesh in &mut scene.meshes {
            let center = mesh.bounds.center();
            mesh.bounds = Aabb { min: center - 1e4, max: center + 1e4 };
        }
        let (whole, drawn_whole) = drawn(&scene);
        assert!(drawn_culled.culled > 30 && drawn_culled.objects > 30, "{drawn_culled:?}");
        assert_eq!((drawn_whole.culled, drawn_whole.objects), (0, scene.objects.len()));
        assert_identical(&culled, &whole, "with and without culling");
    });
}

#[test]
fn a_tone_mapping_subpass_of_its_own_changes_no_colour() {
    on_gpu(|gpu| {
        for spec in ["builtin:spheres", "builtin:field?objects=40&lights=8"] {
            let mut scene = open(spec);
            let folded = gpu.draw(&scene, &own(&scene, SMALL.0, SMALL.1));
            // A billionth of a nit: nothing to see, and yet there is an HDR target.
            scene.materials[0].emissive = Vec3::splat(1e-9);
            let settings = own(&scene, SMALL.0, SMALL.1);
            assert!(gpu.renderer(&scene, &settings).plan().has_tonemap_subpass());
            // Half floats are good to 4.9e-4, a sixth of the distance of two codes at most.
            let (most, at) = largest_code_difference(&folded, &gpu.draw(&scene, &settings));
            assert!(most <= 1, "{spec}: {most} codes at {at:?}");
        }
    });
}

#[test]
fn what_emits_is_as_bright_as_it_says() {
    on_gpu(|gpu| {
        let material = Material { emissive: Vec3::new(0.25, 0.04, 1.0), ..lambert(0.5) };
        let dark = plane(material.clone(), Vec::new());
        let expected = [0.25, 0.04, 1.0].map(srgb_code);
        assert_eq!(code(&gpu.draw(&dark, &display(8, 8)), 4, 4), expected);
        let found = nits(&gpu.draw(&dark, &exact(8, 8)), 4, 4);
        // The linear output has half floats on devices that cannot blend into its usual format.
        assert!((found / DVec3::new(0.25, 0.04, 1.0) - 1.0).abs().max_element() < 4.9e-4, "{found}");
        let lit = plane(material, vec![directional(DVec3::Z, 1.0)]);
        let found = nits(&gpu.draw(&lit, &exact(8, 8)), 4, 4).x;
        let expected = 0.25 + 0.5 * white_radiance(1.0, 0.0);
        assert!((found / expected - 1.0).abs() < 1e-3, "light adds to it: {found} for {expected}");
    });
}

/// Returns the greatest relative error of storing a value in red, green and blue: a step of the mantissa, as a driver may truncate.
fn steps(format: HdrFormat) -> DVec3 {
    let step = |bits: i32| 2.0f64.powi(-bits);
    match format {
        HdrFormat::Rgba16f => DVec3::splat(step(10)),
        HdrFormat::B10g11r11 => DVec3::new(step(6), step(6), step(5)),
        HdrFormat::Rgba32f => DVec3::splat(step(23)),
    }
}

#[test]
fn an_hdr_format_costs_what_its_mantissa_says() {
    on_gpu(|gpu| {
        let emissive = Vec3::new(0.07, 0.11, 0.19);
        let lights = || vec![point(DVec3::new(0.3, -0.2, 0.8), 1.5, None, Falloff::InverseSquare)];
        let scene = plane(Material { emissive, ..lambert(1.0) }, lights());
        let mut largest_of_all = [0.0; 3];
        for (index, (name, hdr_format)) in HdrFormat::NAMES.iter().enumerate() {
            let settings = Settings { hdr_format: *hdr_format, gbuffer: gbuffer("float32"), ..display(EDGE, EDGE) };
            let mut renderer = match Renderer::new(&gpu.device, &scene, &settings) {
                Ok(renderer) => renderer,
                Err(error) => {
                    assert!(*hdr_format != HdrFormat::Rgba16f && error.to_string().contains(name), "{error}");
                    continue;
                }
            };
            let picture = drawn_after(&mut renderer, &[scene.camera]);
            let mut largest = DVec3::ZERO;
            for (x, y) in places(&picture) {
                let light = radiance(&scene.materials[0], &scene.lights, seen(picture.size, x, y), DVec3::Z, EYE);
                let exact = emissive.as_dvec3() + light;
                assert!(exact.max_element() < 0.95, "{exact} is cut off");
                // Stored twice: the emitted light, and the sum. Half a code more for the picture itself, and a fifth for its tables.
                let off = steps(*hdr_format) * (emissive.as_dvec3() + exact) + 1e-5;
                let found = DVec3::from_array(code(&picture, x, y).map(f64::from));
                let encoded = |linear: DVec3| DVec3::from_array(linear.to_array().map(srgb_code_unrounded));
                let (low, high) = (encoded(exact - off) - 0.7, encoded(exact + off) + 0.7);
                let within = found.cmpge(low).all() && found.cmple(high).all();
                assert!(within, "{name}, ({x}, {y}): {found} is not within {low} and {high}");
                largest = largest.max((found - encoded(exact)).abs());
            }
            eprintln!("{name}: at most {largest:.2} codes of red, green and blue");
            largest_of_all[index] = largest.max_element();
        }
        let [half, packed, single] = largest_of_all;
        assert!(single < 0.7 && half < 1.0, "{largest_of_all:?}");
        // Packed light, where the device can blend it, must be seen to be coarser, or this test looks at nothing.
        assert!(packed == 0.0 || packed > 1.5, "{largest_of_all:?}");
    });
}

#[test]
fn light_beyond_what_an_hdr_format_holds_is_white() {
    on_gpu(|gpu| {
        for (name, hdr_format) in HdrFormat::NAMES {
            for tonemap in Tonemap::NAMES.iter().map(|(_, tonemap)| *tonemap) {
                // Each is as much as fits, and their sum is more.
                let material = Material { emissive: Vec3::splat(1e12), ..lambert(1.0) };
                let scene = plane(material, vec![directional(DVec3::Z, 1e12)]);
                let settings = Settings { hdr_format: *hdr_format, tonemap, ..display(4, 4) };
                let Ok(mut renderer) = Renderer::new(&gpu.device, &scene, &settings) else { continue };
                let found = code(&drawn_after(&mut renderer, &[scene.camera]), 2, 2);
                assert!(found.iter().all(|code| *code >= 253), "{name} {tonemap}: {found:?}");
            }
        }
    });
}

#[test]
fn what_emits_glows_and_lights_nothing() {
    on_gpu(|gpu| {
        // A lamp's glass stands on the plane and covers its middle; the plane around it is as it was.
        let mut scene = plane(lambert(0.8), vec![directional(DVec3::new(0.3, 0.2, 1.0), 2.0)]);
        add(&mut scene, shapes::cuboid([0.5; 3]), lambert(0.1), DAffine3::IDENTITY);
        let dull = gpu.draw(&scene, &exact(EDGE, EDGE));
        scene.materials[1].emissive = Vec3::new(1e4, 2e4, 3e4);
        let glowing = gpu.draw(&scene, &exact(EDGE, EDGE));
        let mut glows = 0;
        for (x, y) in places(&glowing) {
            let (found, before) = (nits(&glowing, x, y), nits(&dull, x, y));
            // The box is half a metre wide, and its front nearer by a quarter: 0.29 m of the plane to each side.
            if seen(glowing.size, x, y).abs().max_element() > 0.3 {
                assert_eq!(found, before, "({x}, {y})");
            } else if found != before {
                assert!((found - before - DVec3::new(1e4, 2e4, 3e4)).abs().max_element() < 5e-3, "({x}, {y}): {found}");
                glows += 1;
            }
        }
        assert!(glows > 50, "{glows}");
    });
}

#[test]
fn the_background_shows_where_nothing_is() {
    on_gpu(|gpu| {
        let mut scene = stage();
        add(&mut scene, rectangle([-0.5, -0.5], [0.5, 0.5], 0.0), lambert(1.0), DAffine3::IDENTITY);
        scene.environment.background = Vec3::new(0.3, 0.22, 0.48);
        for emissive in [0.0, 1e-9] {
            scene.materials[0].emissive = Vec3::splat(emissive);
            let picture = gpu.draw(&scene, &display(16, 16));
            assert_eq!(code(&picture, 0, 0), [0.3, 0.22, 0.48].map(srgb_code), "emissive {emissive}");
            assert_eq!(code(&picture, 8, 8), [0; 3], "an unlit surface hides it");
        }
    });
}

/// `heat` of `shaders/view.wgsl` at its stops.
const HEAT: [[f64; 3]; 7] = [
    [0.0, 0.0, 0.0],
    [0.1, 0.1, 0.8],
    [0.0, 0.7, 0.9],
    [0.1, 0.8, 0.2],
    [0.95, 0.9, 0.1],
    [0.9, 0.15, 0.05],
    [1.0, 1.0, 1.0],
];

fn heat(share: f64) -> DVec3 {
    let x = share.clamp(0.0, 1.0) * 6.0;
    let below = (x as usize).min(5);
    DVec3::from_array(HEAT[below]).lerp(DVec3::from_array(HEAT[below + 1]), x - below as f64)
}

#[test]
fn the_overdraw_view_counts_layers() {
    on_gpu(|gpu| {
        for layers in [1, 2, 4, 7, 8] {
            // Quads of one mesh, listed from the back: every wall is shaded.
            let scene = open(&format!("builtin:field?objects=0&lights=0&overdraw={layers}"));
            let settings = Settings { output: Output::Nits, ..view(&scene, 16, 9, View::Overdraw) };
            let picture = gpu.draw(&scene, &settings);
            let expected = heat(f64::from(layers) / 8.0);
            let right = |(x, y)| (nits(&picture, x, y) - expected).abs().max_element() < 1e-5;
            assert!(places(&picture).all(right), "{layers}: {} for {expected}", nits(&picture, 0, 0));
        }
        // Separate objects are drawn front to back, so hidden walls cost nothing.
        let mut scene = open("builtin:field?objects=0&lights=0&overdraw=1");
        let wall = scene.objects.remove(0);
        scene.objects = (0..6)
            .rev()
            .map(|index| {
                let mut wall = wall.clone();
                wall.transform.translation.z -= f64::from(index);
                wall.transform.matrix3 *= 2.0;
                wall
            })
            .collect();
        let settings = Settings { output: Output::Nits, ..view(&scene, 16, 9, View::Overdraw) };
        let found = nits(&gpu.draw(&scene, &settings), 8, 4);
        assert!((found - heat(1.0 / 8.0)).abs().max_element() < 1e-5, "{found}");
    });
}

#[test]
fn layers_are_all_shaded_and_only_the_first_is_seen() {
    on_gpu(|gpu| {
        let one = open("builtin:layers?count=1&lights=5");
        let alone = gpu.draw(&one, &own(&one, SMALL.0, SMALL.1));
        for count in [2, 7] {
            let scene = open(&format!("builtin:layers?count={count}&lights=5"));
            assert_identical(&alone, &gpu.draw(&scene, &own(&scene, SMALL.0, SMALL.1)), &scene.name);
            let overdraw = gpu.draw(&scene, &view(&scene, SMALL.0, SMALL.1, View::Overdraw));
            let wall = open(&format!("builtin:field?objects=0&lights=0&overdraw={count}"));
            let expected = gpu.draw(&wall, &view(&wall, SMALL.0, SMALL.1, View::Overdraw));
            assert_identical(&expected, &overdraw, &format!("overdraw of {count}"));
        }
    });
}

#[test]
fn the_view_of_lights_per_pixel_counts_lights_in_reach() {
    on_gpu(|gpu| {
        let lamp = |x: f64| point(DVec3::new(x, 0.0, 0.3), 1.0, Some(0.8), Falloff::InverseSquare);
        let lights: Vec<Light> = [-0.6, 0.0, 0.6].map(lamp).into();
        let scene = plane(lambert(0.5), lights.clone());
        let settings = Settings { view: View::LightsPerPixel, ..exact(EDGE, EDGE) };
        let picture = gpu.draw(&scene, &settings);
        let mut seen_counts = [0; 4];
        for (x, y) in places(&picture) {
            let place = seen(picture.size, x, y);
            // At the very edge of a sphere, where its window is 1e-6 or less, rounding decides.
            let strength = lights.iter().map(|light| arriving(light, place).1);
            if strength.clone().any(|strength| strength > 0.0 && strength < 1e-5) {
                continue;
            }
            let count = strength.filter(|&strength| strength > 0.0).count();
            seen_counts[count] += 1;
            let expected = heat((1.0 + count as f64).log2() / 2.0);
            let found = nits(&picture, x, y);
            assert!((found - expected).abs().max_element() < 1e-5, "({x}, {y}): {found} for {count} lights");
        }
        assert!(seen_counts.iter().all(|&pixels| pixels > 10), "{seen_counts:?}");
        assert!(matches!(lights[0].kind, LightKind::Point { .. }));
    });
}
