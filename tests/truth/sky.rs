//! Light of the sky on the device against the truth in 64 bits: the sky that is seen, the light that surfaces collect, and white surfaces under an
//! even sky.

use std::sync::Arc;

use crate::common::compare::assert_identical;
use crate::common::gpu::{Gpu, nits, on_gpu, places};
use crate::common::some_of;
use crate::common::stage::{EDGE, EYE, add, directional, exact, gbuffer, plane, stage};
use afterlight::scene::builtin::shapes;
use afterlight::scene::{
    AlphaMode, Atmosphere, Brdf, Camera, Keep, LightPath, Material, Scene, Settings, Sky, SkyImage, SunDisc,
};
use afterlight_truth::reference::light::{self, Illumination};
use afterlight_truth::reference::{CameraView, Mode, Reference, SkySampler, Smith, TruthOptions, share_of};
use glam::{DAffine3, DVec3, Vec3};

const POINT: TruthOptions = TruthOptions { mode: Mode::Point, smith: Smith::HeightCorrelated };

fn sky(width: u32, radiance: impl Fn(DVec3) -> DVec3 + Sync) -> Sky {
    let image = Arc::new(SkyImage::of("test", width, radiance));
    Sky { image, rotation_degrees: 0.0, nits: 1.0, lights: true, shown: true, sun: None }
}

/// A clear afternoon without the sun itself.
fn afternoon() -> Sky {
    let (image, _) = Atmosphere::default().image();
    Sky { image: Arc::new(image), rotation_degrees: 20.0, nits: 1.0, lights: true, shown: true, sun: None }
}

fn ball(material: Material, sky: Sky) -> Scene {
    let mut scene = stage();
    add(&mut scene, shapes::sphere(0.9, 96), material, DAffine3::IDENTITY);
    Scene { sky: Some(sky), ..scene }
}

fn white_metal(roughness: f32) -> Material {
    Material { base_color: Vec3::ONE, metallic: 1.0, roughness, ..Material::default() }
}

/// Returns the truth with nothing before the sky, pixel by pixel, in nits.
fn truth(scene: &Scene) -> Vec<DVec3> {
    let view = CameraView { camera: scene.camera, size: [EDGE, EDGE] };
    let reference = Reference::new(scene).expect("a scene").with_occluded_sky(false);
    reference.render(&view, &POINT, &|_, _| {}).radiance.into_iter().map(DVec3::from).collect()
}

/// Returns the error in the middle of each ball, as a share of the brightest pixel: root of the mean square, and most.
fn error(gpu: &Gpu, scene: &Scene, settings: &Settings) -> [f64; 2] {
    let picture = gpu.draw(scene, settings);
    let truth = truth(scene);
    let middle = f64::from(EDGE) / 2.0;
    let inside = |(x, y): &(u32, u32)| {
        let off = [*x, *y].map(|at| f64::from(at) + 0.5 - middle);
        off[0].hypot(off[1]) < 0.38 * f64::from(EDGE)
    };
    let at = |(x, y): (u32, u32)| truth[(y * EDGE + x) as usize];
    let brightest = places(&picture).filter(inside).map(|place| at(place).max_element()).fold(0.0, f64::max);
    assert!(brightest > 0.0, "the truth is black");
    let off: Vec<f64> = places(&picture)
        .filter(inside)
        .map(|place| (nits(&picture, place.0, place.1) - at(place)).abs().max_element() / brightest)
        .collect();
    [(off.iter().map(|off| off * off).sum::<f64>() / off.len() as f64).sqrt(), off.into_iter().fold(0.0, f64::max)]
}

/// An even sky of 1 lights surfaces that absorb nothing to 1: at most 1% off for roughness .1 to 1, whatever the model and the path.
#[test]
#[ignore = "test-all: an effect is compared with the truth in another way as well"]
fn a_white_furnace_is_white() {
    on_gpu(|gpu| {
        for roughness in some_of([0.1, 0.5, 1.0, 0.25, 0.75], 2) {
            let white = Material { base_color: Vec3::ONE, roughness, ..Material::default() };
            for material in [
                white_metal(roughness),
                white,
                Material { brdf: Brdf::Lambert, base_color: Vec3::ONE, ..Material::default() },
            ] {
                let scene = ball(material, sky(64, |_| DVec3::ONE));
                for path in [LightPath::Loop, LightPath::Forward] {
                    let picture = gpu.draw(&scene, &Settings { light_path: path, ..exact(EDGE, EDGE) });
                    for (x, y) in places(&picture) {
                        let found = nits(&picture, x, y);
                        assert!((found - DVec3::ONE).abs().max_element() < 0.01, "{roughness} {path} {x} {y}: {found}");
                    }
                }
            }
        }
    });
}

/// The two sums of the split sum, evaluated over sixteen times as many facets, are the same.
#[test]
fn shares_of_even_light_have_converged() {
    for roughness in [0.1, 0.3, 0.6, 1.0] {
        for n_dot_v in [0.02, 0.1, 0.5, 1.0] {
            let (few, many) = (share_of(n_dot_v, roughness, 4096), share_of(n_dot_v, roughness, 65536));
            assert!((few - many).abs().max_element() < 3e-3, "{roughness} {n_dot_v}: {few} {many}");
            assert!(many.min_element() >= 0.0 && many.element_sum() <= 1.0 + 1e-3, "{many}");
        }
    }
}

/// Pixels without a surface hold the sky; elsewhere it costs and changes nothing.
#[test]
fn the_sky_is_seen_where_nothing_is() {
    on_gpu(|gpu| {
        // A pixel sees 1.6 degrees, so that a driver filters texels of 1.4 degrees and more. At the corners of the cube, where three meet, it may take the
        // nearest alone: half a texel beside the place, 0.0125 of light.
        let smooth = sky(512, |to| DVec3::new(2.0 + to.x, 2.0 + to.y, 2.0 + to.z));
        let mut scene = ball(white_metal(0.5), Sky { lights: false, rotation_degrees: 130.0, ..smooth });
        scene.camera = Camera::looking_at(EYE, DVec3::new(0.4, 0.2, 0.0), DVec3::Y);
        for (path, msaa) in
            [(LightPath::Loop, 1), (LightPath::Forward, 1), (LightPath::Loop, 4), (LightPath::Forward, 4)]
        {
            let settings = Settings { light_path: path, msaa, gbuffer: gbuffer("lean"), ..exact(EDGE, EDGE) };
            let (picture, truth) = (gpu.draw(&scene, &settings), truth(&scene));
            let mut seen = 0;
            for (x, y) in places(&picture) {
                let (found, wanted) = (nits(&picture, x, y), truth[(y * EDGE + x) as usize]);
                // The ball is black, and with several samples its edges are a mix.
                let around = (y.saturating_sub(1)..=(y + 1).min(EDGE - 1))
                    .flat_map(|y| (x.saturating_sub(1)..=(x + 1).min(EDGE - 1)).map(move |x| (x, y)));
                if around.into_iter().any(|(x, y)| nits(&picture, x, y).min_element() < 0.5) {
                    continue;
                }
                seen += 1;
                assert!((found - wanted).abs().max_element() < 0.0125, "{path} {msaa} {x} {y}: {found} {wanted}");
            }
            assert!(seen > 300, "{seen}");
        }
    });
}

#[test]
fn a_sun_is_drawn_as_a_disc_of_its_size() {
    on_gpu(|gpu| {
        let sun = SunDisc { direction: DVec3::NEG_Z, degrees: 20.0, radiance: Vec3::splat(9.0) };
        let mut scene = stage();
        scene.sky = Some(Sky { sun: Some(sun), ..sky(64, |_| DVec3::ONE) });
        let picture = gpu.draw(&scene, &exact(EDGE, EDGE));
        for (x, y) in places(&picture) {
            // The camera sees 2 metres at a distance of 2.
            let off = [x, y].map(|at| ((f64::from(at) + 0.5) / f64::from(EDGE) * 2.0 - 1.0) * 0.5);
            let degrees = off[0].hypot(off[1]).atan().to_degrees();
            if (degrees - 10.0).abs() > 0.01 {
                let wanted = if degrees < 10.0 { 9.0 } else { 1.0 };
                assert!((nits(&picture, x, y) - DVec3::splat(wanted)).abs().max_element() < 1e-3, "{x} {y}");
            }
        }
    });
}

/// Errors of the split sum and of the figures that it is computed with, on an afternoon, by roughness. The bounds are a little above the errors that
/// docs/SKY.md lists.
#[test]
fn surfaces_collect_what_the_integral_over_the_sky_says() {
    on_gpu(|gpu| {
        let settings = Settings { sky_samples: 256, ..exact(EDGE, EDGE) };
        for (roughness, metal, most) in some_of(SPLIT_SUM, 4) {
            let material = Material { metallic: if metal { 1.0 } else { 0.0 }, ..white_metal(roughness) };
            let found = error(gpu, &ball(material, afternoon()), &settings);
            println!("roughness {roughness}, metal {metal}: RMS {:.4}, worst {:.4}", found[0], found[1]);
            assert!(found[0] < most, "roughness {roughness}, metal {metal}: {found:?}");
        }
        let lambert = Material { brdf: Brdf::Lambert, base_color: Vec3::ONE, ..Material::default() };
        // A cosine over the 5.6 degrees of a texel bends by 0.1%, and half floats have steps of 2^-11.
        let found = error(gpu, &ball(lambert, afternoon()), &settings);
        assert!(found[1] < 3e-3, "{found:?}");
    });
}

/// Roughness, metal or dielectric, and the most that the root of the mean square may be, as a share of the brightest.
const SPLIT_SUM: [(f32, bool, f64); 8] = [
    (0.02, true, 0.02),
    (0.1, true, 0.02),
    (0.25, true, 0.03),
    (0.5, true, 0.04),
    (1.0, true, 0.05),
    (0.75, true, 0.05),
    (0.25, false, 0.01),
    (0.75, false, 0.01),
];

/// More directions come nearer to the truth, until only the error of the split sum itself is left.
#[test]
#[ignore = "test-all: an effect is compared with the truth in another way as well"]
fn more_directions_are_nearer_to_the_truth() {
    on_gpu(|gpu| {
        let scene = ball(white_metal(0.4), sky(128, |to| if to.x > 0.9 { DVec3::splat(50.0) } else { DVec3::ONE }));
        let at = |sky_samples| error(gpu, &scene, &Settings { sky_samples, ..exact(EDGE, EDGE) })[0];
        let (few, many) = (at(2), at(256));
        assert!(many < 0.5 * few, "{few} {many}");
    });
}

#[test]
fn every_light_path_collects_the_same() {
    on_gpu(|gpu| {
        let scene = ball(Material { roughness: 0.3, metallic: 0.5, ..Material::default() }, afternoon());
        let draw = |light_path| gpu.draw(&scene, &Settings { light_path, ..exact(EDGE, EDGE) });
        let first = draw(LightPath::Loop);
        for path in [LightPath::Clustered, LightPath::PerLight, LightPath::Volumes] {
            assert_identical(&first, &draw(path), &path.to_string());
        }
        // FORWARD computes positions and normals separately, in single floats.
        let forward = draw(LightPath::Forward);
        for (x, y) in places(&first) {
            let off = (nits(&first, x, y) - nits(&forward, x, y)).abs().max_element();
            assert!(off < 1e-3, "{x} {y}: {off}");
        }
    });
}

#[test]
#[ignore = "test-all: an effect is compared with the truth in another way as well"]
fn without_light_of_the_sky_a_picture_is_what_it_is_without_a_sky() {
    on_gpu(|gpu| {
        let mut scene = plane(Material::default(), vec![directional(DVec3::new(0.3, 0.2, 1.0), 3.0)]);
        let before = gpu.draw(&scene, &exact(EDGE, EDGE));
        scene.sky = Some(Sky { lights: false, ..afternoon() });
        assert_identical(&before, &gpu.draw(&scene, &exact(EDGE, EDGE)), "seen alone");
        scene.sky = Some(afternoon());
        assert_identical(
            &before,
            &gpu.draw(&scene, &Settings { sky_light: false, ..exact(EDGE, EDGE) }),
            "switched off",
        );
    });
}

/// Rays that may be blocked estimate the integral where nothing blocks them.
#[test]
#[ignore = "test-all: an effect is compared with the truth in another way as well"]
fn estimates_by_rays_converge_to_the_integral() {
    for (material, roughness) in [(white_metal(0.2), 0.2), (white_metal(0.8), 0.8), (Material::default(), 0.5)] {
        let bright = sky(128, |to| if to.x > 0.95 { DVec3::splat(200.0) } else { DVec3::new(1.0, 2.0, 3.0 + to.y) });
        let scene = ball(Material { roughness, ..material }, bright);
        let view = CameraView { camera: scene.camera, size: [9, 9] };
        let render = |occluded: bool, mode| {
            let reference = Reference::new(&scene).expect("a scene").with_occluded_sky(occluded);
            reference.render(&view, &TruthOptions { mode, ..POINT }, &|_, _| {})
        };
        let exact = render(false, Mode::Point).radiance[4 * 9 + 4];
        // The middle of the ball faces the camera; nothing is before it.
        let estimate = render(true, Mode::Point).radiance[4 * 9 + 4];
        for (found, wanted) in estimate.into_iter().zip(exact) {
            // 256 samples of each strategy.
            assert!((found - wanted).abs() < 0.05 * wanted, "{roughness}: {estimate:?} {exact:?}");
        }
    }
}

#[test]
fn what_stands_over_a_floor_hides_the_sky_from_it_in_the_truth() {
    let mut scene = plane(Material { brdf: Brdf::Lambert, base_color: Vec3::ONE, ..Material::default() }, Vec::new());
    scene.sky = Some(sky(64, |_| DVec3::ONE));
    let view = CameraView { camera: scene.camera, size: [3, 3] };
    let middle = |scene: &Scene| {
        let reference = Reference::new(scene).expect("a scene");
        reference.render(&view, &POINT, &|_, _| {}).radiance[4][0]
    };
    // 256 samples of each strategy.
    assert!((middle(&scene) - 1.0).abs() < 0.01, "{}", middle(&scene));
    // A wall through the axis hides half of the sky.
    add(
        &mut scene,
        shapes::cuboid([1.0, 50.0, 50.0]),
        Material::default(),
        DAffine3::from_translation(DVec3::X * 0.501),
    );
    let half = middle(&scene);
    assert!((half - 0.5).abs() < 0.03, "{half}");
}

/// A pixel that is worked out by hand: half of the sky is white, and a lambert floor faces it at an angle.
#[test]
fn half_a_sky_lights_by_the_cosine() {
    // Above the horizon of +X: a floor whose normal is at an angle t to it collects (1 + cos t) / 2.
    let half = SkySampler::of(&sky(256, |to| if to.x > 0.0 { DVec3::ONE } else { DVec3::ZERO }));
    for degrees in [0.0f64, 30.0, 90.0, 150.0] {
        let normal = DVec3::new(degrees.to_radians().cos(), degrees.to_radians().sin(), 0.0);
        let surface = afterlight_truth::reference::ShadingPoint {
            position: -normal,
            ray: None,
            normal,
            geometric_normal: normal,
            brdf: Brdf::Lambert,
            albedo: DVec3::ONE,
            metallic: 0.0,
            roughness: 1.0,
            specular: DVec3::ZERO,
            reflectance: DVec3::ZERO,
            grazing: 0.0,
            shininess: 0.0,
            lobes: afterlight_truth::reference::SurfaceLobes::NONE,
            occlusion: 1.0,
            emissive: DVec3::ZERO,
            alpha: 1.0,
            receives_shadow: false,
        };
        let environment = Default::default();
        let illumination = Illumination {
            lights: &[],
            environment: &environment,
            eye: DVec3::ZERO,
            open: 1.0,
            open_behind: 1.0,
            sky: Some(&half),
            smith: Smith::default(),
        };
        let found = light::radiance::<f64>(&surface, &illumination, &mut |_| DVec3::ONE);
        let wanted = (1.0 + degrees.to_radians().cos()) / 2.0;
        // Texels at the horizon of +X are half bright.
        assert!((found - DVec3::splat(wanted)).abs().max_element() < 0.01, "{degrees}: {found} {wanted}");
    }
}

/// Skies at the ends of their range, on surfaces at theirs: every pixel is finite and none is black that is lit.
#[test]
fn extreme_skies_leave_finite_pictures() {
    on_gpu(|gpu| {
        let skies = [
            sky(2, |_| DVec3::ONE),
            sky(64, |to| if to.y > 0.999 { DVec3::splat(1e6) } else { DVec3::ZERO }),
            Sky { nits: 1e9, ..sky(16, |_| DVec3::splat(1e6)) },
            Sky { nits: 0.0, ..sky(16, |_| DVec3::ONE) },
            sky(16, |_| DVec3::ZERO),
        ];
        for (index, sky) in skies.into_iter().enumerate() {
            for roughness in [0.0, 1.0] {
                let mut scene = ball(white_metal(roughness), sky.clone());
                let glass = Material { alpha_mode: AlphaMode::Glass, alpha: 0.1, roughness, ..Material::default() };
                add(&mut scene, shapes::sphere(0.3, 24), glass, DAffine3::from_translation(DVec3::Z));
                for light_path in [LightPath::Loop, LightPath::Forward] {
                    let keep = Keep::NONE;
                    let picture = gpu.draw(&scene, &Settings { light_path, keep, sky_samples: 1, ..exact(EDGE, EDGE) });
                    for (x, y) in places(&picture) {
                        let found = nits(&picture, x, y);
                        assert!(found.is_finite() && found.min_element() >= 0.0, "{index} {x} {y}: {found}");
                        assert!(index == 3 || index == 4 || index == 1 || found.max_element() > 0.0, "{index} {x} {y}");
                    }
                }
            }
        }
    });
}
