//! TONE multiplies the picture as the formulas of the truth do, whichever path drew it.

use crate::common::gpu::{code, on_gpu, places};
use crate::common::stage::{open, own};
use afterlight::scene::{LightPath, Settings, Tonemap};
use afterlight_truth::reference::shown::{Pixel, shown};
use afterlight_truth::reference::tonemap::decode_srgb;
use glam::DVec3;

const SIZE: [u32; 2] = [48, 28];

#[test]
fn vignette_and_grain_leave_the_share_of_each_pixel_that_the_formulas_say() {
    on_gpu(|gpu| {
        let scene = open("builtin:spheres");
        let plain = Settings { samples: 1, ..own(&scene, SIZE[0], SIZE[1]) };
        let paths = [LightPath::Loop, LightPath::Volumes, LightPath::Clustered, LightPath::Forward];
        let mut ways: Vec<_> = paths.into_iter().map(|light_path| Settings { light_path, ..plain.clone() }).collect();
        ways.extend([4].map(|msaa| Settings { msaa, light_path: LightPath::Loop, ..plain.clone() }));
        ways.push(Settings { fxaa: true, light_path: LightPath::Loop, ..plain.clone() });
        for way in ways {
            let before = gpu.draw(&scene, &way);
            for (vignette, grain) in [(1.0, 0.0), (0.0, 1.0), (0.7, 0.3)] {
                let after = gpu.draw(&scene, &Settings { vignette, grain, ..way.clone() });
                // The picture is there already: no curve comes again.
                let truth = Settings { vignette, grain, tonemap: Tonemap::None, ..way.clone() };
                let mut changed = 0;
                for (x, y) in places(&before) {
                    let light = DVec3::from_array(code(&before, x, y).map(|code| decode_srgb(f64::from(code) / 255.0)));
                    let wanted = shown(light, &truth, Pixel { place: [x, y], size: SIZE });
                    let found = code(&after, x, y);
                    // Rounding twice may differ by one code.
                    let most = wanted.iter().zip(found).map(|(wanted, found)| wanted.abs_diff(found)).max();
                    assert!(
                        most <= Some(1),
                        "{:?} {vignette} {grain} at {x}, {y}: {wanted:?} {found:?}",
                        way.light_path
                    );
                    changed += usize::from(found != code(&before, x, y));
                }
                assert!(changed > places(&before).count() / 2, "only {changed} pixels have changed");
            }
        }
    });
}

#[test]
fn where_nothing_is_asked_for_there_is_no_pass_and_no_difference() {
    on_gpu(|gpu| {
        let scene = open("builtin:spheres");
        let plain = Settings { samples: 1, light_path: LightPath::Loop, ..own(&scene, SIZE[0], SIZE[1]) };
        let passes = |settings: &Settings| {
            let mut renderer = gpu.renderer(&scene, settings);
            renderer.render(&scene.camera).expect("a frame");
            renderer.recorded_passes().to_vec()
        };
        assert!(!passes(&plain).contains(&"tone".to_owned()));
        for settings in [Settings { vignette: 0.1, ..plain.clone() }, Settings { grain: 0.1, ..plain.clone() }] {
            let with = passes(&settings);
            assert_eq!(with.last().map(String::as_str), Some("tone"), "{with:?}");
            assert_eq!(with[..with.len() - 1], passes(&plain)[..]);
        }
    });
}
