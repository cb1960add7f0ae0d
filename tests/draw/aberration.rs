//! ABERRATION draws red and blue of the finished picture where a simple lens does, whichever passes drew it.

use crate::common::gpu::{bytes, code, on_gpu, places};
use crate::common::stage::{open, own};
use afterlight::frame::Picture;
use afterlight::scene::{LightPath, Settings};
use afterlight_truth::reference::aberration::apart;
use afterlight_truth::reference::tonemap::{decode_srgb, encode_srgb};
use glam::DVec3;

const SIZE: [u32; 2] = [64, 36];

/// The picture's light, as its codes have it.
fn light(picture: &Picture) -> Vec<DVec3> {
    let linear = |(x, y)| DVec3::from_array(code(picture, x, y).map(|code| decode_srgb(f64::from(code) / 255.0)));
    places(picture).map(linear).collect()
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
            let wanted = apart(&light(&before), SIZE, f64::from(share));
            let mut changed = 0;
            for ((x, y), wanted) in places(&before).zip(wanted) {
                let found = code(&after, x, y);
                assert_eq!(found[1], code(&before, x, y)[1], "green stays, at {x}, {y}");
                for (light, found) in wanted.to_array().into_iter().zip(found) {
                    // Samplers weigh by 1/256 at least ("Texel Filtering"), and the code is rounded.
                    let code = encode_srgb(light) * 255.0;
                    assert!((code - f64::from(found)).abs() <= 2.0, "at {x}, {y}: {code} and {found}");
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
