//! Frames through a lens with an open shutter, against rays that are traced the same way: the mean of N frames is no farther from the truth than the
//! mean of N independent samples would be.

use crate::common::gpu::{floats, on_gpu};
use crate::common::moving::moving;
use crate::common::stage::{exact, open};
use afterlight::frame::Picture;
use afterlight::scene::{Aperture, Brdf, Playing, Settings, ShadowSettings, ThinLens};
use afterlight_truth::reference::shutter::{self, ShutterOptions, ShutterScene};
use afterlight_truth::reference::{CameraView, Mode, Reference, Smith, Truth, TruthOptions};
use glam::DVec3;

const SIZE: [u32; 2] = [48, 32];
const TRUTH_SAMPLES: u32 = 256;
/// Each of these has a pose and a tree of boxes for each of its moments.
const SHUTTER_SAMPLES: u32 = 64;

fn settings(samples: u32, aperture: f32, focus: f32) -> Settings {
    // Shadow maps would add their own errors.
    let shadows = ShadowSettings { enabled: false, ..ShadowSettings::default() };
    let lens =
        Settings { aperture: Aperture::Diameter(aperture), focus: Some(focus), shadows, ..exact(SIZE[0], SIZE[1]) };
    // Highlights of single points have no variance that few samples tell.
    Settings { samples, brdf: Some(Brdf::Lambert), ..lens }
}

/// Root mean squares of the difference, and of the one that independent samples would have: a pixel's variance over their number, for both pictures.
fn distances(picture: &Picture, (truth, truth_samples): (&Truth, u32), samples: u32) -> (f64, f64) {
    let errors = truth.standard_error.as_ref().expect("of several samples");
    let (mut found, mut expected) = (0.0, 0.0);
    for ((pixel, truth), error) in floats(picture).chunks_exact(4).zip(&truth.radiance).zip(errors) {
        for channel in 0..3 {
            let variance = error[channel].powi(2) * f64::from(truth_samples);
            found += (f64::from(pixel[channel]) - truth[channel]).powi(2);
            expected += variance / f64::from(samples) + error[channel].powi(2);
        }
    }
    let count = (3 * truth.radiance.len()) as f64;
    ((found / count).sqrt(), (expected / count).sqrt())
}

#[test]
fn a_lens_is_that_of_the_rays() {
    on_gpu(|gpu| {
        let scene = open("builtin:spheres?rows=2&columns=2");
        let away = (scene.bounds().center() - scene.camera.position).dot(scene.camera.forward());
        for (aperture, focus) in [(0.2 * away, away), (0.3 * away, 0.6 * away), (0.1 * away, 1e6)] {
            let own = settings(1, aperture as f32, focus as f32);
            let lens = ThinLens::of(&own, &scene.camera);
            let reference =
                Reference::new(&scene).expect("a scene").with_brdf(own.brdf).with_shadows(false).with_lens(lens);
            let options = TruthOptions { mode: Mode::Converged { samples: TRUTH_SAMPLES }, smith: Smith::default() };
            let truth = reference.render(&CameraView { camera: scene.camera, size: SIZE }, &options, &|_, _| {});
            let draw = |samples| {
                let own = Settings { samples, ..own.clone() };
                gpu.renderer(&scene, &own).picture(&scene.camera, || ()).expect("a picture")
            };
            for samples in [8, 64] {
                let (found, independent) = distances(&draw(samples), (&truth, TRUTH_SAMPLES), samples);
                assert!(found <= independent, "{aperture} m at {focus} m, {samples}: {found}, more than {independent}");
            }
            // A picture without the lens is far off.
            let (pinhole, independent) = distances(&draw(1), (&truth, TRUTH_SAMPLES), 64);
            assert!(pinhole > 2.0 * independent, "{aperture} m at {focus} m: {pinhole} and {independent}");
        }
    });
}

#[test]
#[ignore = "test-all: an effect is compared with the truth in another way as well"]
fn a_shutter_is_that_of_the_rays_with_a_lens_and_without() {
    on_gpu(|gpu| {
        let scene = moving(DVec3::ZERO);
        for (aperture, seconds) in [(0.0, 0.4f32), (0.2, 0.2)] {
            let own = Settings { shutter: seconds, ..settings(1, aperture, 2.8) };
            let playing = Playing::at(0.3);
            let shot = ShutterScene { scene: &scene, playing, path: None, seconds: f64::from(seconds) };
            let exposure = ShutterOptions { size: SIZE, samples: SHUTTER_SAMPLES, smith: Smith::default() };
            let truth = shutter::render(&shot, &exposure, &own, &|_, _| {}).expect("a scene");
            for samples in [8, 64] {
                let picture = gpu.expose(&scene, &Settings { samples, ..own.clone() }, 0.3);
                let (found, independent) = distances(&picture, (&truth, SHUTTER_SAMPLES), samples);
                assert!(found <= independent, "{aperture} m, {seconds} s, {samples}: {found}, more than {independent}");
            }
            let (still, independent) = distances(&gpu.expose(&scene, &own, 0.3), (&truth, SHUTTER_SAMPLES), 64);
            assert!(still > 2.0 * independent, "{aperture} m, {seconds} s: {still} and {independent}");
        }
    });
}

#[test]
fn a_truth_through_a_lens_is_another_one_for_the_cache() {
    let scene = open("builtin:quad");
    let view = CameraView { camera: scene.camera, size: SIZE };
    let options = TruthOptions { mode: Mode::Converged { samples: 4 }, smith: Smith::default() };
    let hash = |lens| Reference::new(&scene).expect("a scene").with_lens(lens).fingerprint(&view, &options);
    let [near, far, wide] =
        [(0.1, 2.0), (0.1, 3.0), (0.2, 2.0)].map(|(radius, focus)| hash(Some(ThinLens { radius, focus })));
    let all = [hash(None), near, far, wide];
    assert!(all.iter().enumerate().all(|(at, own)| !all[..at].contains(own)), "{all:?}");
}
