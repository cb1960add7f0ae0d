//! The shadows of a sky's light: pictures of many frames against the truth in 64 bits, and against skies of which everything arrives.

use std::sync::Arc;

use crate::common::compare::assert_identical;
use crate::common::gpu::{Gpu, nits, on_gpu, places};
use crate::common::stage::{EDGE, add, exact, plane, stage};
use afterlight::scene::builtin::shapes;
use afterlight::scene::{
    AlphaMode, Atmosphere, Brdf, LightPath, Material, Reflections, Scene, Settings, Sheen, Sky, SkyImage, ThinFilm,
};
use afterlight_truth::reference::{CameraView, Mode, Reference, Smith, TruthOptions};
use glam::{DAffine3, DVec3, Vec3};

fn sky(width: u32, radiance: impl Fn(DVec3) -> DVec3 + Sync) -> Sky {
    let image = Arc::new(SkyImage::of("test", width, radiance));
    Sky { image, rotation_degrees: 0.0, nits: 1.0, lights: true, shown: true, sun: None }
}

/// A clear afternoon without the sun itself.
fn afternoon() -> Sky {
    let (image, _) = Atmosphere::default().image();
    Sky { image: Arc::new(image), rotation_degrees: 20.0, nits: 1.0, lights: true, shown: true, sun: None }
}

fn white() -> Material {
    Material { brdf: Brdf::Lambert, base_color: Vec3::ONE, ..Material::default() }
}

/// A floor that faces the camera, and a wall of 4 m to its right, 5 cm from the axis.
fn floor_and_wall(sky: Sky) -> Scene {
    let mut scene = plane(white(), Vec::new());
    let to = DAffine3::from_translation(DVec3::X * 0.55);
    add(&mut scene, shapes::cuboid([1.0, 8.0, 8.0]), Material::default(), to);
    Scene { sky: Some(sky), ..scene }
}

/// A ball over a block, which hide much of the sky from each other.
fn ball_and_block(material: Material) -> Scene {
    let mut scene = stage();
    add(&mut scene, shapes::sphere(0.5, 48), material.clone(), DAffine3::from_translation(DVec3::Y * 0.3));
    add(&mut scene, shapes::cuboid([1.6, 0.4, 1.6]), material, DAffine3::from_translation(DVec3::Y * -0.5));
    Scene { sky: Some(afternoon()), ..scene }
}

/// Settings with `sky_shadows` directions of the sky in each of `samples` frames.
fn drawn(sky_shadows: u32, samples: u32) -> Settings {
    Settings { sky_shadows: Some(sky_shadows), samples, ..exact(EDGE, EDGE) }
}

/// The relative mean square error of a picture against rays, as `compare` has it: over the square of the truth and a hundredth.
fn error(gpu: &Gpu, scene: &Scene, settings: &Settings, truth: &[[f64; 3]]) -> f64 {
    let picture = gpu.expose(scene, settings, 0.0);
    let pixel = |(x, y): (u32, u32)| {
        let (found, wanted) = (nits(&picture, x, y), DVec3::from(truth[(y * EDGE + x) as usize]));
        ((found - wanted).powf(2.0) / (wanted * wanted + 0.01)).element_sum() / 3.0
    };
    places(&picture).map(pixel).sum::<f64>() / f64::from(EDGE * EDGE)
}

#[test]
fn a_wall_hides_half_of_the_sky_from_the_floor_beside_it() {
    on_gpu(|gpu| {
        let scene = floor_and_wall(sky(64, |_| DVec3::ONE));
        let beside = |settings: Settings| {
            let picture = gpu.expose(&scene, &settings, 0.0);
            // Ten pixels to the left the wall is seen lower.
            [EDGE / 2, EDGE / 2 - 10].map(|x| nits(&picture, x, EDGE / 2).x)
        };
        let [near, far] = beside(drawn(16, 32));
        assert!((near - 0.5).abs() < 0.02 && far > near + 0.005, "{near} {far}");
        let [near, far] = beside(drawn(0, 32));
        assert!((near - 1.0).abs() < 0.01 && (far - 1.0).abs() < 0.01, "all of it arrives without: {near} {far}");
        let [forward, _] = beside(Settings { light_path: LightPath::Forward, ..drawn(16, 32) });
        assert!((forward - 0.5).abs() < 0.02, "{forward}");
        let ([one, _], [several, _]) = (beside(drawn(16, 1)), beside(Settings { msaa: 4, ..drawn(16, 1) }));
        assert!((several - one).abs() < 1e-3, "{several} {one}");
    });
}

/// 8 frames are nearer to the truth than a sky without shadows by an order of magnitude, and 64 are nearer still.
#[test]
fn more_frames_come_to_the_truth() {
    on_gpu(|gpu| {
        let scene = ball_and_block(white());
        let view = CameraView { camera: scene.camera, size: [EDGE, EDGE] };
        let options = TruthOptions { mode: Mode::Converged { samples: 256 }, smith: Smith::HeightCorrelated };
        let truth = Reference::new(&scene).expect("a scene").render(&view, &options, &|_, _| {}).radiance;
        let at = |directions, frames| error(gpu, &scene, &drawn(directions, frames), &truth);
        let [open, one, eight, many] = [at(0, 64), at(8, 1), at(8, 8), at(8, 64)];
        println!("relMSE: without shadows {open:.1e}; of 1, 8 and 64 frames {one:.1e} {eight:.1e} {many:.1e}");
        assert!(one < open && eight < 0.1 * open && many < 0.5 * eight && many < 3e-3, "{open} {one} {eight} {many}");
    });
}

/// A ball hides nothing from itself, so its base and its lobes have all of the prefiltered sky.
#[test]
fn in_the_open_all_of_the_sky_arrives() {
    on_gpu(|gpu| {
        for (material, most) in [
            (white(), 0.01),
            (Material { base_color: Vec3::ONE, metallic: 1.0, roughness: 0.1, ..Material::default() }, 5e-3),
            (Material { base_color: Vec3::ONE, metallic: 1.0, roughness: 0.7, ..Material::default() }, 5e-3),
        ] {
            let mut scene = stage();
            add(&mut scene, shapes::sphere(0.9, 96), material, DAffine3::IDENTITY);
            scene.sky = Some(afternoon());
            let [all, drawn] = [drawn(0, 32), drawn(16, 32)].map(|settings| gpu.expose(&scene, &settings, 0.0));
            let brightest = places(&all).map(|(x, y)| nits(&all, x, y).max_element()).fold(0.0, f64::max);
            for (x, y) in places(&all) {
                let off = (nits(&all, x, y) - nits(&drawn, x, y)).abs().max_element() / brightest;
                assert!(off < most, "{x} {y}: {off}");
            }
        }
    });
}

#[test]
fn every_light_path_has_the_same_shadows() {
    on_gpu(|gpu| {
        let lobes = Material {
            sheen: Sheen { color: Vec3::new(0.6, 0.3, 0.2), roughness: 0.4 },
            film: ThinFilm { strength: 1.0, ..ThinFilm::NONE },
            ..Material::default()
        };
        same_on_every_path(gpu, &ball_and_block(lobes));
        same_on_every_path(gpu, &ball_and_block(Material { roughness: 0.3, metallic: 0.5, ..Material::default() }));
    });
}

fn same_on_every_path(gpu: &Gpu, scene: &Scene) {
    let draw = |light_path| gpu.expose(scene, &Settings { light_path, ..drawn(8, 2) }, 0.0);
    let first = draw(LightPath::Loop);
    for path in [LightPath::Clustered, LightPath::PerLight, LightPath::Volumes] {
        assert_identical(&first, &draw(path), &path.to_string());
    }
    let forward = draw(LightPath::Forward);
    let mut apart = 0;
    for (x, y) in places(&first) {
        let off = (nits(&first, x, y) - nits(&forward, x, y)).abs().max_element();
        // Edges of shadows lie in texels of maps, which the positions of either path may fall on both sides of.
        apart += u32::from(off > 2e-3 * nits(&first, x, y).max_element().max(1.0));
    }
    assert!(apart <= EDGE * EDGE / 200, "{apart}");
}

/// Reflections on the screen take the share of the mirrored sky away that they replace, which must equal the share that was added.
#[test]
fn beside_reflections_lobes_keep_all_of_the_sky() {
    on_gpu(|gpu| {
        let scene =
            ball_and_block(Material { base_color: Vec3::ONE, metallic: 1.0, roughness: 0.2, ..Material::default() });
        let reflections = Reflections::Screen;
        let draw = |sky_shadows| gpu.expose(&scene, &Settings { reflections, ..drawn(sky_shadows, 4) }, 0.0);
        let (without, with) = (draw(0), draw(8));
        for (x, y) in places(&with) {
            let off = (nits(&without, x, y) - nits(&with, x, y)).abs().max_element();
            // Light that facets scatter twice is all that differs, and the metal has no base.
            assert!(off < 0.02 * nits(&without, x, y).max_element().max(1.0), "{x} {y}: {off}");
        }
    });
}

/// A sun in the sky, one lit texel, a night, light at the end of its range, and none at all.
#[test]
fn extreme_skies_leave_finite_pictures_with_shadows_too() {
    on_gpu(|gpu| {
        let skies = [
            (sky(2, |_| DVec3::ONE), true),
            (sky(256, |to| if to.y > 0.9998 { DVec3::splat(1e6) } else { DVec3::splat(1e-3) }), true),
            (sky(64, |to| if to.x > 0.997 { DVec3::X * 1e6 } else { DVec3::ZERO }), false),
            (sky(64, |_| DVec3::splat(1e-6)), true),
            (Sky { nits: 1e9, ..sky(16, |_| DVec3::splat(1e6)) }, true),
            (Sky { nits: 0.0, ..sky(16, |_| DVec3::ONE) }, false),
            (sky(16, |_| DVec3::ZERO), false),
        ];
        for (index, (sky, lit)) in skies.into_iter().enumerate() {
            for roughness in [0.0, 1.0] {
                let mut scene = ball_and_block(Material { roughness, ..Material::default() });
                let glass = Material { alpha_mode: AlphaMode::Glass, alpha: 0.1, roughness, ..Material::default() };
                add(&mut scene, shapes::sphere(0.3, 24), glass, DAffine3::from_translation(DVec3::Z));
                scene.sky = Some(sky.clone());
                for light_path in [LightPath::Loop, LightPath::Forward] {
                    let picture = gpu.expose(&scene, &Settings { light_path, sky_samples: 1, ..drawn(8, 2) }, 0.0);
                    let light = places(&picture).map(|(x, y)| nits(&picture, x, y));
                    let sum: DVec3 = light
                        .inspect(|light| assert!(light.is_finite() && light.min_element() >= 0.0, "{index}: {light}"))
                        .sum();
                    assert!(!lit || sum.min_element() > 0.0, "{index}: {sum}");
                }
            }
        }
    });
}
