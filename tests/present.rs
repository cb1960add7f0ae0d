//! Frames that are presented, on a surface without a display: bit by bit those of a renderer without any, through changes of size and the loss of
//! the surface. Mesa offers plain images there, which are drawn through sRGB views.
#![cfg(feature = "window")]

mod common;

use afterlight::frame::{Outcome, Picture, Presenter, Renderer};
use afterlight::gpu::{Surface, Vsync};
use afterlight::scene::{LightPath, OpenOptions, Scene, Settings, View, open};
use common::compare::assert_identical;
use common::gpu::{Gpu, on_presenting_gpu};

const SIZES: [[u32; 2]; 4] = [[160, 90], [1, 1], [33, 71], [160, 90]];

fn scene(spec: &str) -> Scene {
    open(spec, &OpenOptions::default()).unwrap_or_else(|error| panic!("{error}"))
}

/// Each way for a picture to come into a swapchain's image.
fn ways() -> Vec<(&'static str, Scene, Settings)> {
    let own = |scene: &Scene| Settings { samples: 1, anisotropy: 1, ..scene.settings.decide() };
    let (spheres, layers) = (scene("builtin:spheres"), scene("builtin:layers"));
    let settings = own(&spheres);
    vec![
        ("lighting", spheres.clone(), Settings { light_path: LightPath::Loop, ..settings.clone() }),
        ("forward", spheres.clone(), Settings { light_path: LightPath::Forward, ..settings.clone() }),
        ("resolve", spheres.clone(), Settings { light_path: LightPath::Loop, msaa: 4, ..settings.clone() }),
        ("fxaa", spheres.clone(), Settings { fxaa: true, ..settings.clone() }),
        ("view", spheres.clone(), Settings { view: View::Normal, ..settings.clone() }),
        ("compute", spheres, Settings { light_path: LightPath::Compute, ..settings }),
        ("tone mapping", layers.clone(), own(&layers)),
    ]
}

/// The picture of a frame that is shown, of the second: the first may wait for nobody.
fn shown(presenter: &mut Presenter, scene: &Scene, what: &str) -> Picture {
    for copied in [false, true] {
        let drawn = presenter.draw(&scene.camera, copied, None).unwrap_or_else(|error| panic!("{what}: {error}"));
        assert!(matches!(drawn, Outcome::Shown(_)), "{what}: {drawn:?}");
    }
    presenter.picture().unwrap_or_else(|error| panic!("{what}: {error}"))
}

fn rendered(gpu: &Gpu, scene: &Scene, settings: &Settings) -> Picture {
    let mut renderer = Renderer::new(&gpu.device, scene, settings).unwrap_or_else(|error| panic!("{error}"));
    renderer.picture(&scene.camera, || {}).unwrap_or_else(|error| panic!("{error}"))
}

fn presenter(gpu: &Gpu, scene: &Scene, settings: &Settings) -> Presenter {
    let surface = Surface::headless(&gpu.device).unwrap_or_else(|error| panic!("{error}"));
    Presenter::new(&gpu.device, surface, scene, settings, Vsync::On).unwrap_or_else(|error| panic!("{error}"))
}

fn fit(presenter: &mut Presenter, scene: &Scene, settings: &Settings, size: [u32; 2]) {
    assert!(presenter.fit(scene, settings, size).unwrap_or_else(|error| panic!("{error}")), "{size:?} has pixels");
}

#[test]
fn a_presented_frame_is_bit_by_bit_that_of_a_renderer_at_every_size() {
    on_presenting_gpu(|gpu| {
        for (name, scene, settings) in ways() {
            let mut presenter = presenter(gpu, &scene, &settings);
            assert!(!presenter.fit(&scene, &settings, [0, 0]).expect("needs nothing"), "{name}: nothing has no pixels");
            for size in SIZES {
                fit(&mut presenter, &scene, &settings, size);
                let expected = rendered(gpu, &scene, &Settings { size, ..settings.clone() });
                let what = format!("{name} at {size:?}");
                assert_identical(&shown(&mut presenter, &scene, &what), &expected, &what);
            }
        }
    });
}

#[test]
fn a_lost_surface_is_replaced_and_the_frames_go_on() {
    on_presenting_gpu(|gpu| {
        for (name, scene, settings) in ways() {
            let size = SIZES[0];
            let expected = rendered(gpu, &scene, &Settings { size, ..settings.clone() });
            let mut presenter = presenter(gpu, &scene, &settings);
            for split in [None, Some(settings.view)] {
                presenter.show_beside(split);
                fit(&mut presenter, &scene, &settings, size);
                assert_identical(&shown(&mut presenter, &scene, name), &expected, name);
                presenter.lose_surface();
                let nothing = presenter.draw(&scene.camera, false, None).expect("nothing is wrong with the device");
                assert!(matches!(nothing, Outcome::Nothing(_)), "{name}: {nothing:?}");
                let new = Surface::headless(&gpu.device).unwrap_or_else(|error| panic!("{error}"));
                presenter.replace_surface(new).unwrap_or_else(|error| panic!("{error}"));
                fit(&mut presenter, &scene, &settings, size);
                assert_identical(&shown(&mut presenter, &scene, name), &expected, name);
            }
        }
    });
}
