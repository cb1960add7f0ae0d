//! ABERRATION draws red and blue of the finished picture where a simple lens does, whichever passes drew it.

use crate::common::gpu::{bytes, code, on_gpu, places};
use crate::common::stage::{open, own};
use afterlight::frame::Picture;
use afterlight::reference::tonemap::{decode_srgb, encode_srgb};
use afterlight::scene::{LightPath, Settings};
use glam::{DVec2, UVec2};

const SIZE: [u32; 2] = [64, 36];

/// A channel of the picture between the middles of its pixels, as linear light.
fn between(picture: &Picture, place: DVec2, channel: usize) -> f64 {
    let last = UVec2::from(SIZE) - 1;
    let at = |x: f64, y: f64| {
        let pixel = DVec2::new(x, y).clamp(DVec2::ZERO, last.as_dvec2()).as_uvec2();
        decode_srgb(f64::from(code(picture, pixel.x, pixel.y)[channel]) / 255.0)
    };
    let (low, part) = ((place - 0.5).floor(), (place - 0.5) - (place - 0.5).floor());
    let row = |y: f64| at(low.x, y) * (1.0 - part.x) + at(low.x + 1.0, y) * part.x;
    row(low.y) * (1.0 - part.y) + row(low.y + 1.0) * part.y
}

#[test]
fn red_lies_farther_out_and_blue_farther_in_by_the_share_of_the_distance() {
    on_gpu(|gpu| {
        let scene = open("builtin:spheres");
        let plain = Settings { samples: 1, light_path: LightPath::Loop, ..own(&scene, SIZE[0], SIZE[1]) };
        let ways = [
            plain.clone(),
            Settings { light_path: LightPath::Forward, ..plain.clone() },
            Settings { fxaa: true, ..plain.clone() },
            Settings { bloom: 0.2, ..plain.clone() },
        ];
        for way in ways {
            let before = gpu.draw(&scene, &way);
            let share = 0.04;
            let after = gpu.draw(&scene, &Settings { aberration: share, ..way.clone() });
            let middle = UVec2::from(SIZE).as_dvec2() / 2.0;
            let mut changed = 0;
            for (x, y) in places(&before) {
                let from_middle = UVec2::new(x, y).as_dvec2() + 0.5 - middle;
                let found = code(&after, x, y);
                assert_eq!(found[1], code(&before, x, y)[1], "green stays, at {x}, {y}");
                for (channel, scale) in [(0, 1.0 - f64::from(share)), (2, 1.0 + f64::from(share))] {
                    let light = between(&before, middle + from_middle * scale, channel);
                    let wanted = encode_srgb(light) * 255.0;
                    // Samplers weigh by 1/256 at least ("Texel Filtering"), and the code is rounded.
                    let apart = (wanted - f64::from(found[channel])).abs();
                    assert!(apart <= 2.0, "channel {channel} at {x}, {y}: {wanted} and {}", found[channel]);
                }
                changed += usize::from(found != code(&before, x, y));
            }
            assert!(changed > SIZE[0] as usize * 4, "only {changed} pixels have changed");
        }
    });
}

#[test]
fn it_comes_after_fxaa_and_before_vignette_and_grain_and_is_not_there_unasked() {
    on_gpu(|gpu| {
        let scene = open("builtin:spheres");
        let all = Settings {
            samples: 1,
            light_path: LightPath::Loop,
            fxaa: true,
            aberration: 0.02,
            vignette: 0.5,
            ..own(&scene, SIZE[0], SIZE[1])
        };
        let passes = |settings: &Settings| {
            let mut renderer = gpu.renderer(&scene, settings);
            renderer.render(&scene.camera).expect("a frame");
            renderer.recorded_passes().to_vec()
        };
        let with = passes(&all);
        assert!(with.ends_with(&["fxaa", "aberration", "tone"].map(String::from)), "{with:?}");
        let without = Settings { aberration: 0.0, ..all.clone() };
        assert!(!passes(&without).contains(&"aberration".to_owned()));
        assert_ne!(bytes(&gpu.draw(&scene, &all)), bytes(&gpu.draw(&scene, &without)));
    });
}
