//! FOG follows the formulas in 64 bits, whichever path drew the frame, and comes before anything transparent.

use crate::common::gpu::{Gpu, bytes, floats, on_gpu};
use crate::common::some_of;
use crate::common::stage::{add, directional, exact, lambert, open, own, plane, rectangle};
use afterlight::scene::{
    AlphaMode, Camera, Emitter, Environment, Fog, HdrFormat, LightPath, Material, OptionalPart, Output, Playing,
    Projection, Reflections, Resolve, Scene, Settings, Sky, SkyImage, Transparency, View,
};
use afterlight_truth::reference::fog::Medium;
use afterlight_truth::reference::{CameraView as Eye, Mode, Reference, Smith, TruthOptions};
use glam::{DAffine3, DVec3, Vec3};

fn light(gpu: &Gpu, scene: &Scene, settings: &Settings) -> Vec<DVec3> {
    let picture = gpu.draw(scene, settings);
    floats(&picture).chunks_exact(4).map(|rgba| DVec3::new(rgba[0].into(), rgba[1].into(), rgba[2].into())).collect()
}

/// Returns where the ray through the middle of a pixel begins, and its step for a metre along the view.
fn ray(camera: &Camera, [width, height]: [u32; 2], pixel: usize) -> (DVec3, DVec3) {
    let (x, y) = (pixel as u32 % width, pixel as u32 / width);
    let [across, down] =
        [(x, width), (y, height)].map(|(at, edge)| (f64::from(at) + 0.5) / f64::from(edge) * 2.0 - 1.0);
    let half = camera.half_height();
    let aside = camera.right() * (half * f64::from(width) / f64::from(height) * across) - camera.up() * (half * down);
    match camera.is_orthographic() {
        true => (camera.position + aside, camera.forward()),
        false => (camera.position, camera.forward() + aside),
    }
}

/// Returns the expected picture with fog, from the picture without fog and the distances of surfaces along the view (0 without a surface).
fn fogged(scene: &Scene, settings: &Settings, clear: &[DVec3], depths: &[DVec3]) -> Vec<DVec3> {
    let fog = Medium::of(settings).expect("fog");
    let sky = scene.sky.as_ref().filter(|sky| sky.lights && settings.sky_light);
    let of = |(pixel, (light, depth)): (usize, (&DVec3, &DVec3))| {
        let (from, way) = ray(&scene.camera, settings.size, pixel);
        let direction = way.normalize();
        let metres = if depth.x > 0.0 { depth.x * way.length() } else { f64::INFINITY };
        let gained = fog.light(direction, &scene.environment, sky, &scene.lights);
        Medium::passage(fog.optical_depth(from.y, direction.y, metres), gained).of(*light)
    };
    clear.iter().zip(depths).enumerate().map(of).collect()
}

/// The most that any channel errs by, relative to the brightest of its pixel.
fn worst(found: &[DVec3], wanted: &[DVec3]) -> f64 {
    assert_eq!(found.len(), wanted.len());
    let pairs = found.iter().zip(wanted);
    pairs
        .map(|(found, wanted)| (*found - *wanted).abs().max_element() / wanted.max_element().max(1e-9))
        .fold(0.0, f64::max)
}

/// An optical depth, up to 15 here, is a product of a few numbers that are rounded to 2^-24. As an exponent it turns its absolute error into a
/// relative one of the light that is left; distances from depths of 24 bits add to that.
const ROUNDING: f64 = 5e-5;

#[test]
fn the_light_is_fogged_as_the_formulas_say_on_every_path() {
    on_gpu(|gpu| {
        let spheres = open("builtin:spheres");
        let mut under_sky = open("builtin:spheres?rows=1&columns=2");
        let image = SkyImage::of("bright above", 16, |direction| DVec3::new(1.0, 1.5, 2.0) * (2.0 + direction.y));
        under_sky.sky =
            Some(Sky { image: image.into(), rotation_degrees: 0.0, nits: 900.0, lights: true, shown: true, sun: None });
        under_sky.lights.push(directional(DVec3::new(0.3, 0.5, 1.0), 4000.0));
        let mut parallel = open("builtin:spheres");
        parallel.camera.projection = Projection::Orthographic { height: 6.0 };
        // Frames move a camera of parallel rays up to the scene.
        parallel.camera.position -= parallel.camera.forward() * 15.0;
        let stored = [OptionalPart::StoredGbuffer].into_iter().collect();
        let on = |light_path| Settings { light_path, ..Settings::default() };
        let cases = [
            (&spheres, on(LightPath::Loop)),
            (&spheres, on(LightPath::Forward)),
            (&spheres, on(LightPath::PerLight)),
            (&spheres, Settings { keep: stored, ..on(LightPath::Loop) }),
            (&under_sky, on(LightPath::Loop)),
            (&under_sky, on(LightPath::ForwardNaive)),
            // Fog over reflections, too.
            (&under_sky, Settings { reflections: Reflections::Screen, ..on(LightPath::Loop) }),
            (&parallel, on(LightPath::Loop)),
        ];
        for (scene, path) in cases {
            let Settings { light_path, keep, reflections, .. } = path;
            let plain = Settings {
                light_path,
                keep,
                reflections,
                samples: 1,
                sky_samples: 1,
                output: Output::Nits,
                ..own(scene, 49, 29)
            };
            let clear = light(gpu, scene, &plain);
            let depths =
                light(gpu, scene, &Settings { view: View::Depth, light_path: LightPath::Loop, ..plain.clone() });
            assert!(depths.iter().any(|own| own.x == 0.0) && depths.iter().any(|own| own.x > 0.0), "{}", scene.name);
            for (fog_density, fog_height, fog_base, fog_anisotropy) in
                [(0.05, 20.0, 0.0, 0.6), (3.0, 0.2, -0.5, -0.9), (1e-3, 1e6, 100.0, 0.0)]
            {
                let with =
                    Settings { fog: Fog::Height, fog_density, fog_height, fog_base, fog_anisotropy, ..plain.clone() };
                let with = Settings { fog_albedo: 0.9, ..with };
                let (found, wanted) = (light(gpu, scene, &with), fogged(scene, &with, &clear, &depths));
                let error = worst(&found, &wanted);
                println!("{} {light_path} {fog_density} {fog_height}: {error:e}", scene.name);
                assert!(error < ROUNDING, "{} {light_path} {fog_density} {fog_height}: {error}", scene.name);
                let changed = worst(&clear, &wanted);
                assert!(changed > 0.01, "{} {fog_density}: fog that nobody sees", scene.name);
            }
        }
    });
}

/// A sun lights the fog where no surface is in view that it could light.
#[test]
fn fog_before_nothing_but_the_background_is_lit_as_well() {
    on_gpu(|gpu| {
        let mut scene = plane(lambert(0.5), vec![directional(DVec3::new(0.3, 1.0, 0.4), 4.0)]);
        scene.environment.background = Vec3::new(0.2, 0.5, 1.0);
        scene.camera = Camera::looking_at(DVec3::Z * 5.0, DVec3::new(0.0, 7.0, 9.0), DVec3::Y);
        for light_path in [LightPath::Loop, LightPath::Forward] {
            let plain = Settings { light_path, ..exact(24, 14) };
            let clear = light(gpu, &scene, &plain);
            let nothing = vec![DVec3::ZERO; clear.len()];
            let with = Settings { fog: Fog::Height, fog_density: 0.05, ..plain };
            let error = worst(&light(gpu, &scene, &with), &fogged(&scene, &with, &clear, &nothing));
            assert!(error < ROUNDING, "{light_path}: {error}");
        }
    });
}

/// Returns the error against rays, relative to the brightest channel, that `percent` of 100 pixels do not exceed. Pixels on edges may fall to either
/// side.
fn against_rays(gpu: &Gpu, scene: &Scene, settings: &Settings, percent: usize) -> f64 {
    let reference = Reference::new(scene).expect("a scene").with_settings(settings, &scene.camera);
    let options = TruthOptions { mode: Mode::Point, smith: Smith::default() };
    let truth = reference.render(&Eye { camera: scene.camera, size: settings.size }, &options, &|_, _| {});
    let truth: Vec<DVec3> = truth.radiance.into_iter().map(DVec3::from).collect();
    let mut errors: Vec<f64> = light(gpu, scene, settings)
        .iter()
        .zip(&truth)
        .map(|(found, wanted)| (*found - *wanted).abs().max_element() / wanted.max_element().max(1e-3))
        .collect();
    errors.sort_by(f64::total_cmp);
    errors[errors.len() * percent / 100]
}

/// Panes before and behind each other, over light and dark, and beside a sky.
fn panes() -> Scene {
    let mut scene = plane(lambert(0.5), vec![directional(DVec3::new(0.2, 0.4, 1.0), 3.0)]);
    scene.environment.ambient = Vec3::new(0.2, 0.3, 0.5);
    for (mode, alpha, z) in [(AlphaMode::Blend, 0.6, 0.3), (AlphaMode::Glass, 0.3, 0.6), (AlphaMode::Coat, 0.5, 0.9)] {
        let pane = Material { alpha, alpha_mode: mode, base_color: Vec3::new(0.9, 0.4, 0.1), ..Material::default() };
        let aside = z - 0.6;
        add(&mut scene, rectangle([-0.6 + aside, -0.5], [0.6 + aside, 0.6], z), pane, DAffine3::IDENTITY);
    }
    scene
}

#[test]
fn transparent_surfaces_are_fogged_at_their_own_depth_as_rays_have_it() {
    on_gpu(|gpu| {
        let scene = panes();
        for (transparency, light_path) in [
            (Transparency::Sorted, LightPath::Loop),
            (Transparency::Sorted, LightPath::Forward),
            (Transparency::Oit, LightPath::Loop),
        ] {
            let plain = Settings { transparency, light_path, hdr_format: HdrFormat::Rgba32f, ..exact(40, 24) };
            let error = |settings: &Settings| against_rays(gpu, &scene, settings, 97);
            let clear = error(&plain);
            let in_fog = error(&Settings { fog: Fog::Height, fog_density: 0.4, ..plain });
            println!("{transparency} {light_path}: {clear:e} without fog, {in_fog:e} with it");
            match transparency {
                Transparency::Sorted => assert!(in_fog < 3e-5 && clear < 3e-5, "{light_path}: {clear} {in_fog}"),
                // Rays have no such weights.
                Transparency::Oit => assert!(in_fog < 1.2 * clear, "{clear} {in_fog}"),
            }
        }
    });
}

/// Large ones, near and far, before the panes' lower half and the sky beside it.
#[test]
fn particles_are_fogged_at_their_own_depth_as_rays_have_it() {
    on_gpu(|gpu| {
        let mut scene = plane(lambert(0.5), vec![directional(DVec3::new(0.2, 0.4, 1.0), 3.0)]);
        scene.environment.ambient = Vec3::new(0.2, 0.3, 0.5);
        let cloud = Emitter {
            position: DVec3::new(0.1, 0.0, 0.7),
            extent: DVec3::new(0.7, 0.4, 0.5),
            rate: 40.0,
            size: vec![0.3, 0.5],
            color: vec![[0.9, 0.5, 0.2, 0.7], [0.2, 0.5, 0.9, 0.4]],
            emission: vec![Vec3::new(0.5, 0.0, 0.1)],
            ..Emitter::default()
        };
        scene.emitters = vec![Emitter { softness: 0.3, ..cloud.clone() }, Emitter { lit: false, seed: 7, ..cloud }];
        let mut scene = scene.into_still(&Playing::at(5.0));
        let mut dark = scene.clone();
        dark.lights.clear();
        let ways = [(LightPath::Loop, false, true), (LightPath::Forward, true, true), (LightPath::Loop, false, false)];
        for (light_path, parallel, is_lit) in some_of(ways, 3) {
            let scene = if is_lit { &mut scene } else { &mut dark };
            if parallel {
                scene.camera.projection = Projection::Orthographic { height: 2.0 };
                scene.camera.position.z += 3.0;
            }
            let plain = Settings { light_path, hdr_format: HdrFormat::Rgba32f, ..exact(40, 24) };
            let fog = Settings { fog: Fog::Height, fog_density: 0.4, fog_height: 2.0, ..plain.clone() };
            let [clear, in_fog, changed] = [
                against_rays(gpu, scene, &plain, 98),
                against_rays(gpu, scene, &fog, 98),
                worst(&light(gpu, scene, &plain), &light(gpu, scene, &fog)),
            ];
            println!("{light_path}: {clear:e} without fog, {in_fog:e} with it");
            assert!(clear < 3e-5 && in_fog < 3e-5 && changed > 0.1, "{light_path}: {clear} {in_fog} {changed}");
            // Summed up they err by their weights alone, which rays do not have.
            let summed = |settings: Settings| {
                against_rays(gpu, scene, &Settings { transparency: Transparency::Oit, ..settings }, 90)
            };
            let [clear, in_fog] = [summed(plain), summed(fog)];
            println!("{light_path}, summed: {clear:e} without fog, {in_fog:e} with it");
            assert!(in_fog < 1.2 * clear, "{light_path}: {clear} {in_fog}");
        }
    });
}

/// Frames over time come to the mean of as many samples, which have the fog of each.
#[test]
fn frames_over_time_are_fogged_as_samples_are() {
    on_gpu(|gpu| {
        let scene = open("builtin:spheres");
        let plain = Settings { output: Output::Exposed, resolve: Resolve::Linear, ..own(&scene, 48, 28) };
        let fogged = Settings { fog: Fog::Height, fog_density: 0.1, light_path: LightPath::Loop, ..plain };
        let [samples, over_time, clear] = [
            Settings { samples: 16, ..fogged.clone() },
            Settings { samples: 1, taa: true, taa_frames: 16, ..fogged.clone() },
            Settings { samples: 16, fog: Fog::Off, ..fogged },
        ]
        .map(|settings| {
            let mut renderer = gpu.renderer(&scene, &settings);
            let picture = renderer.picture(&scene.camera, || ()).unwrap_or_else(|error| panic!("{error}"));
            let means: Vec<DVec3> = floats(&picture)
                .chunks_exact(4)
                .map(|own| DVec3::new(own[0].into(), own[1].into(), own[2].into()))
                .collect();
            means
        });
        let apart = |found: &[DVec3]| {
            let squares = found.iter().zip(&samples).map(|(found, wanted)| (*found - *wanted).length_squared());
            (squares.sum::<f64>() / samples.iter().map(|own| own.length_squared()).sum::<f64>()).sqrt()
        };
        let [over_time, clear] = [apart(&over_time), apart(&clear)];
        println!("over time {over_time:e}, clear {clear:e}");
        assert!(over_time < 0.05 * clear && clear > 0.1, "{over_time} {clear}");
    });
}

/// Fog that absorbs nothing is not seen where light is the same everywhere.
#[test]
fn white_fog_in_an_even_world_is_not_seen() {
    on_gpu(|gpu| {
        let mut scene = plane(lambert(1.0), Vec::new());
        scene.environment = Environment { ambient: Vec3::ONE, ground: None, background: Vec3::ONE };
        add(&mut scene, rectangle([-0.3, -0.4], [0.5, 0.2], 0.7), lambert(1.0), DAffine3::from_rotation_z(0.3));
        for (light_path, msaa) in [(LightPath::Loop, 1), (LightPath::Loop, 4), (LightPath::Forward, 4)] {
            let settings = Settings { fog: Fog::Height, fog_density: 0.3, light_path, msaa, ..exact(40, 24) };
            let found = light(gpu, &scene, &settings);
            let furthest = found.iter().map(|own| (*own - 1.0).abs().max_element()).fold(0.0, f64::max);
            assert!(furthest < 1e-5, "{light_path} {msaa}: {furthest}");
        }
    });
}

/// A pixel on an edge has the fog of each of its samples.
#[test]
fn samples_of_a_pixel_are_fogged_one_by_one() {
    on_gpu(|gpu| {
        let mut scene = Scene { camera: crate::common::stage::camera(), ..Scene::default() };
        scene.environment.ambient = Vec3::ONE;
        let dark = Material { base_color: Vec3::ZERO, ..lambert(0.0) };
        add(&mut scene, rectangle([-40.0, -40.0], [40.0, 40.0], -20.0), dark.clone(), DAffine3::IDENTITY);
        add(&mut scene, rectangle([-0.4, -0.4], [0.4, 0.4], 0.0), dark, DAffine3::from_rotation_z(0.3));
        for light_path in [LightPath::Loop, LightPath::Forward] {
            let one = Settings { fog: Fog::Height, fog_density: 0.2, light_path, view: View::Fog, ..exact(40, 24) };
            let one = Settings { fog_height: 1e6, ..one };
            let [single, several] = [1, 4].map(|msaa| light(gpu, &scene, &Settings { msaa, ..one.clone() }));
            let brightness = |all: &[DVec3]| all.iter().map(|own| own.x).sum::<f64>() / all.len() as f64;
            assert!((brightness(&single) / brightness(&several) - 1.0).abs() < 0.01);
            let low = single.iter().map(|own| own.x).fold(f64::MAX, f64::min);
            let high = single.iter().map(|own| own.x).fold(0.0, f64::max);
            let between = |all: &[DVec3]| {
                let margin = 0.1 * (high - low);
                all.iter().filter(|own| (low + margin..high - margin).contains(&own.x)).count()
            };
            assert!(high > 2.0 * low && between(&single) < 3 && between(&several) > 20, "{low} {high}");
        }
    });
}

#[test]
fn fog_is_finite_at_its_extremes_and_hides_what_is_beyond_it() {
    on_gpu(|gpu| {
        let mut scene = open("builtin:spheres");
        scene.materials.iter_mut().take(1).for_each(|own| own.emissive = Vec3::splat(1e30));
        let plain = Settings { samples: 1, light_path: LightPath::Loop, ..own(&scene, 33, 21) };
        for (output, hdr_format) in [(Output::Nits, HdrFormat::Rgba32f), (Output::Exposed, HdrFormat::Rgba16f)] {
            for (fog_density, fog_height) in [(1e6, 1e-3), (1e6, 1e6), (1e-9, 1e-3), (1e-9, 1e6)] {
                for (fog_base, fog_anisotropy) in [(-1e6, 0.999), (0.0, -0.999), (1e6, 0.999)] {
                    let fog = Settings { fog: Fog::Height, fog_density, fog_height, fog_base, ..plain.clone() };
                    let settings = Settings { fog_anisotropy, output, hdr_format, ..fog };
                    let found = light(gpu, &scene, &settings);
                    // Light beyond the range of half floats is infinite in them, as without fog, and white.
                    let is_light =
                        |own: &DVec3| own.min_element() >= 0.0 && (own.is_finite() || hdr_format == HdrFormat::Rgba16f);
                    assert!(found.iter().all(is_light), "{fog_density} {fog_height} {fog_base} {output}");
                }
            }
        }
        let dense = Settings { fog: Fog::Height, fog_density: 1e6, fog_height: 1e6, fog_albedo: 0.0, ..plain };
        let black = light(gpu, &scene, &Settings { output: Output::Nits, ..dense });
        assert!(black.iter().all(|own| own.max_element() < 1.0), "what absorbs all of the light hides all of it");
    });
}

#[test]
fn where_no_fog_is_asked_for_there_is_no_pass_and_no_difference() {
    on_gpu(|gpu| {
        let scene = open("builtin:spheres");
        let plain = Settings { samples: 1, light_path: LightPath::Loop, ..own(&scene, 48, 28) };
        let passes = |settings: &Settings| {
            let mut renderer = gpu.renderer(&scene, settings);
            renderer.render(&scene.camera).expect("a frame");
            renderer.recorded_passes().to_vec()
        };
        let other = Settings { fog_density: 0.2, fog_height: 3.0, ..plain.clone() };
        assert_eq!(bytes(&gpu.draw(&scene, &plain)), bytes(&gpu.draw(&scene, &other)));
        assert!(passes(&other) == passes(&plain) && !passes(&plain).contains(&"fog".to_owned()));
        let with = passes(&Settings { fog: Fog::Height, ..plain });
        assert_eq!(with[with.len() - 2..], ["fog", "tonemap"], "{with:?}");
    });
}
