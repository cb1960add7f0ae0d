//! BLOOM and SPREAD follow the formulas in 64 bits, whichever path drew the frame; no light is lost, and a bright pixel that moves does not flicker.

use crate::common::gpu::{Gpu, on_gpu};
use crate::common::stage::{add, exact, open, own, rectangle, stage};
use afterlight::frame::{Pixels, Renderer};
use afterlight::scene::{
    Brdf, HdrFormat, LightPath, Material, OptionalPart, Output, Resolve, Scene, Settings, Transparency, View,
};
use afterlight_truth::reference::bloom::{bloomed, by_levels};
use glam::{DAffine3, DVec3, Vec3};

fn light(gpu: &Gpu, scene: &Scene, settings: &Settings) -> Vec<[f64; 3]> {
    values(&mut gpu.renderer(scene, settings), scene)
}

fn values(renderer: &mut Renderer, scene: &Scene) -> Vec<[f64; 3]> {
    let picture = renderer.picture(&scene.camera, || {}).expect("a picture");
    match picture.pixels {
        Pixels::LinearF32(rgba) => {
            rgba.as_chunks::<4>().0.iter().map(|&[r, g, b, _]| [r, g, b].map(f64::from)).collect()
        }
        Pixels::Srgb8(_) => panic!("a linear picture"),
    }
}

/// Relative to the wanted value, the most that any channel errs by.
fn worst(found: &[[f64; 3]], wanted: &[[f64; 3]]) -> f64 {
    let pairs = found.iter().flatten().zip(wanted.iter().flatten());
    pairs.map(|(found, wanted)| if found == wanted { 0.0 } else { (found / wanted - 1.0).abs() }).fold(0.0, f64::max)
}

/// All terms are positive, so the relative error of a sum is at most its terms' relative error plus one rounding per addition. A level takes 36
/// products of two weights down and 9 up. Each weight is a sum of at most three products of differences and quotients: 12 roundings. Two weights,
/// their product, its product with the light and 11 additions: 40 in all, down and up alike, and 3 to mix. Ten levels: 830 roundings of 2^-24.
const ROUNDING: f64 = 830.0 / 16_777_216.0;
/// Half floats: the light is stored once, and a driver may truncate.
const HALF: f64 = 1.0 / 1024.0;

#[test]
#[ignore = "test-all: an effect is compared with the truth in another way as well"]
fn the_light_is_spread_as_the_formulas_say_on_every_path_and_at_odd_sizes() {
    on_gpu(|gpu| {
        let spheres = open("builtin:spheres");
        let glass = open("assets/gallery/transparency.toml");
        let mut cases: Vec<(&Scene, Settings)> = Vec::new();
        for [width, height] in [[64, 36], [49, 29], [7, 5], [1, 1], [3, 200]] {
            cases.push((&spheres, Settings { light_path: LightPath::Loop, ..own(&spheres, width, height) }));
        }
        for light_path in [LightPath::PerLight, LightPath::Volumes, LightPath::Clustered, LightPath::Forward] {
            cases.push((&spheres, Settings { light_path, ..own(&spheres, 49, 29) }));
        }
        for transparency in [Transparency::Sorted, Transparency::Oit] {
            cases.push((&glass, Settings { transparency, ..own(&glass, 49, 29) }));
        }
        let stored = [OptionalPart::StoredGbuffer].into_iter().collect();
        cases.push((&spheres, Settings { keep: stored, light_path: LightPath::Loop, ..own(&spheres, 49, 29) }));
        cases.push((&spheres, Settings { msaa: 4, light_path: LightPath::Loop, ..own(&spheres, 49, 29) }));
        cases.push((&spheres, Settings { msaa: 4, light_path: LightPath::Forward, ..own(&spheres, 49, 29) }));
        for (scene, plain) in cases {
            let plain = Settings { samples: 1, output: Output::Nits, ..plain };
            let before = light(gpu, scene, &plain);
            for (bloom_radius, bloom_taps) in [(0.05, 6), (0.3, 4), (1.0, 2)] {
                let with = Settings { bloom: 0.4, bloom_radius, bloom_taps, ..plain.clone() };
                let error = worst(&light(gpu, scene, &with), &by_levels(&before, with.size, &with));
                let what = format!("{:?} {} {bloom_radius} {bloom_taps}", plain.size, plain.light_path);
                assert!(error < ROUNDING, "{what}: {error}");
            }
        }
    });
}

#[test]
fn frames_that_are_averaged_and_light_that_is_measured_have_it_too() {
    on_gpu(|gpu| {
        let scene = open("builtin:spheres");
        let plain = Settings { samples: 4, output: Output::Nits, ..own(&scene, 49, 29) };
        let with = Settings { bloom: 0.4, ..plain.clone() };
        let wanted = by_levels(&light(gpu, &scene, &plain), plain.size, &with);
        let error = worst(&light(gpu, &scene, &with), &wanted);
        assert!(error < ROUNDING, "{error}");
        // Through half floats, like the tone-mapped frame.
        let measured = Settings { output: Output::Exposed, samples: 1, ..with.clone() };
        let unspread = Settings { bloom: 0.0, ..measured.clone() };
        let wanted = by_levels(&light(gpu, &scene, &unspread), plain.size, &measured);
        let error = worst(&light(gpu, &scene, &measured), &wanted);
        assert!(error < HALF + ROUNDING, "{error}");
        // The view of spread light is the same frame with all of it spread.
        let view = Settings { view: View::Bloom, ..measured.clone() };
        let all = Settings { bloom: 1.0, ..measured };
        assert_eq!(light(gpu, &scene, &view), light(gpu, &scene, &all));
    });
}

/// A glowing square in the dark, `edge` pixels wide, with its upper left corner at a place of the picture.
fn square([width, height]: [u32; 2], [x, y]: [f64; 2], edge: f64) -> Scene {
    let mut scene = stage();
    let [width, height] = [width, height].map(f64::from);
    let at = |column: f64, row: f64| [(column * 2.0 - width) / height, 1.0 - row * 2.0 / height];
    let ([left, top], [right, bottom]) = (at(x, y), at(x + edge, y + edge));
    let glowing = Material { brdf: Brdf::Lambert, emissive: Vec3::new(1000.0, 200.0, 50.0), ..Material::default() };
    add(&mut scene, rectangle([left, bottom], [right, top], 0.0), glowing, DAffine3::from_translation(DVec3::ZERO));
    scene
}

fn energy(light: &[[f64; 3]]) -> f64 {
    light.iter().flatten().sum()
}

#[test]
fn no_light_is_lost_in_the_middle_or_at_the_edges_of_any_picture() {
    on_gpu(|gpu| {
        for size in [[96, 64], [97, 61]] {
            for place in [[40.5, 30.5], [0.5, 30.5], [93.5, 57.5], [-1.5, -1.5], [40.5, -2.5]] {
                let scene = square(size, place, 4.0);
                let plain = exact(size[0], size[1]);
                assert!(energy(&light(gpu, &scene, &plain)) > 0.0);
                for bloom_radius in [0.02, 0.1, 0.5] {
                    for hdr_format in [HdrFormat::Rgba32f, HdrFormat::Rgba16f] {
                        let exposed = Settings { output: Output::Exposed, exposure: Some(0.0), ..plain.clone() };
                        let exposed = Settings { hdr_format: HdrFormat::Rgba32f, ..exposed };
                        let settings = Settings { bloom: 0.7, bloom_radius, hdr_format, ..exposed.clone() };
                        let kept = energy(&light(gpu, &scene, &settings)) / energy(&light(gpu, &scene, &exposed));
                        let most = if hdr_format == HdrFormat::Rgba32f { ROUNDING } else { 1e-3 };
                        assert!((kept - 1.0).abs() < most, "{size:?} {place:?} {bloom_radius} {hdr_format}: {kept}");
                    }
                }
            }
        }
    });
}

/// 64 places of a square, eighths of a pixel apart, and 64 that are whole pixels apart: the picture's light is the same, and where it lands
/// differs from the convolution by no more than the levels of `crates/truth/src/reference/bloom.rs` may.
#[test]
#[ignore = "test-all: an effect is compared with the truth in another way as well"]
fn a_small_light_that_moves_does_not_flicker() {
    on_gpu(|gpu| {
        let size = [96, 64];
        let base = Settings { bloom: 1.0, ..exact(size[0], size[1]) };
        for step in [0.125, 1.0] {
            let (mut energies, mut apart, mut all) = (Vec::new(), 0.0, 0.0);
            for shift in 0..64 {
                let place = [44.0625 + f64::from(shift % 8) * step, 28.0625 + f64::from(shift / 8) * step];
                let scene = square(size, place, 2.0);
                let before = light(gpu, &scene, &Settings { bloom: 0.0, ..base.clone() });
                let after = light(gpu, &scene, &base);
                energies.push(energy(&after));
                for (found, wanted) in after.iter().zip(&bloomed(&before, size, &base)) {
                    apart += (found[0] - wanted[0]).powi(2);
                    all += wanted[0].powi(2);
                }
            }
            let mean = energies.iter().sum::<f64>() / 64.0;
            let variance = energies.iter().map(|energy| (energy / mean - 1.0).powi(2)).sum::<f64>() / 64.0;
            let flicker = (apart / all).sqrt();
            println!("steps of {step}: variance of the light {variance:e}, {flicker:.4} from a convolution");
            assert!(variance < ROUNDING.powi(2), "{step}: {variance}");
            // A level of six taps aliases a dot by this much (`a_bright_pixel_that_moves_...` of the reference); it aliases a square less.
            assert!(flicker < 0.0523, "{step}: {flicker}");
        }
    });
}

#[test]
fn light_beyond_what_half_floats_hold_spreads_as_the_most_that_they_hold() {
    on_gpu(|gpu| {
        let size = [48, 32];
        let mut scene = square(size, [20.5, 12.5], 4.0);
        scene.materials[0].emissive = Vec3::splat(1e30);
        for hdr_format in [HdrFormat::Rgba16f, HdrFormat::B10g11r11, HdrFormat::Rgba32f] {
            let exposed = Settings { output: Output::Exposed, exposure: Some(0.0), ..exact(size[0], size[1]) };
            let found = light(gpu, &scene, &Settings { bloom: 0.5, hdr_format, ..exposed });
            let sum = energy(&found);
            assert!(found.iter().flatten().all(|own| own.is_finite() && *own >= 0.0), "{hdr_format}");
            assert!((0.98 * 48.0 * 64_000.0..=48.0 * 65_504.0).contains(&sum), "{hdr_format}: {sum}");
        }
        let nits = Settings { bloom: 0.5, ..exact(size[0], size[1]) };
        let found = light(gpu, &scene, &nits);
        assert!(found.iter().flatten().all(|own| own.is_finite()));
        assert!((energy(&found) / 48e30 - 1.0).abs() < 1e-3, "{}", energy(&found));
    });
}

#[test]
fn where_no_bloom_is_asked_for_there_is_no_pass_and_no_difference() {
    on_gpu(|gpu| {
        let scene = open("builtin:spheres");
        let plain = Settings { samples: 1, light_path: LightPath::Loop, ..own(&scene, 48, 28) };
        let passes = |settings: &Settings| {
            let mut renderer = gpu.renderer(&scene, settings);
            renderer.render(&scene.camera).expect("a frame");
            renderer.recorded_passes().to_vec()
        };
        let other = Settings { bloom_radius: 0.2, bloom_taps: 2, ..plain.clone() };
        assert_eq!(gpu.draw(&scene, &plain), gpu.draw(&scene, &other));
        assert!(passes(&other) == passes(&plain) && !passes(&plain).contains(&"bloom".to_owned()));
        let with = passes(&Settings { bloom: 0.1, ..plain.clone() });
        assert_eq!(with[with.len() - 3..], ["bloom", "spread", "tonemap"], "{with:?}");
    });
}

#[test]
fn samples_that_are_averaged_as_shown_are_refused_and_those_of_light_are_not() {
    on_gpu(|gpu| {
        let scene = open("builtin:spheres");
        let shown = Settings { bloom: 0.1, msaa: 4, light_path: LightPath::Loop, ..own(&scene, 48, 28) };
        let refused = Renderer::new(&gpu.device, &scene, &shown).err().expect("refused").to_string();
        assert!(refused.contains("--resolve linear"), "{refused}");
        gpu.draw(&scene, &Settings { resolve: Resolve::Linear, ..shown.clone() });
        let compute = Settings { msaa: 1, light_path: LightPath::Compute, ..shown };
        let refused = Renderer::new(&gpu.device, &scene, &compute).err().expect("refused").to_string();
        assert!(refused.contains("bloom"), "{refused}");
    });
}
