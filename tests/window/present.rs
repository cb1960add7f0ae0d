//! Frames that are presented, on a surface without a display: bit by bit equal to a renderer's frames without a surface, through changes of size and
//! the loss of the surface, and while others are made in another thread. Mesa offers plain images there, which are drawn through sRGB views.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, channel};
use std::sync::{Arc, OnceLock};
use std::time::Duration;

use crate::common::compare::assert_identical;
use crate::common::gpu::{Gpu, on_prepared_presenting_gpu, on_presenting_gpu};
use crate::common::{one_of, tries_all};
use afterlight::frame::{FitOutcome, Outcome, Picture, Pixels, Presenter, Renderer, Wake};
use afterlight::gpu::{Device, Surface, Vsync, vk};
use afterlight::passes::overlay::{PanelDraw, PanelTexture, PanelVertex, Panels};
use afterlight::scene::{Light, LightPath, OpenOptions, Scene, Settings, Tonemap, View, open};

const SIZES: [[u32; 2]; 4] = [[160, 90], [1, 1], [33, 71], [160, 90]];

fn scene(spec: &str) -> Scene {
    open(spec, &OpenOptions::default()).unwrap_or_else(|error| panic!("{error}"))
}

/// Each way for a picture to come into a swapchain's image.
fn ways() -> Vec<(&'static str, Scene, Settings)> {
    let own = |scene: &Scene| Settings { samples: 1, anisotropy: 1, ..scene.settings.decide() };
    let (spheres, layers) = (scene("builtin:spheres"), scene("builtin:layers"));
    let settings = own(&spheres);
    let mut ways = vec![
        ("lighting", spheres.clone(), Settings { light_path: LightPath::Loop, ..settings.clone() }),
        ("forward", spheres.clone(), Settings { light_path: LightPath::Forward, ..settings.clone() }),
        ("resolve", spheres.clone(), Settings { light_path: LightPath::Loop, msaa: 4, ..settings.clone() }),
        ("fxaa", spheres.clone(), Settings { fxaa: true, ..settings.clone() }),
        ("bloom", spheres.clone(), Settings { bloom: 0.3, light_path: LightPath::Loop, ..settings.clone() }),
        ("view", spheres.clone(), Settings { view: View::Normal, ..settings.clone() }),
        ("compute", spheres.clone(), Settings { light_path: LightPath::Compute, ..settings.clone() }),
        ("tone mapping", layers.clone(), own(&layers)),
    ];
    if tries_all() {
        ways.push(("compute of samples", spheres, Settings { light_path: LightPath::Compute, msaa: 4, ..settings }));
    }
    ways
}

/// The way of a picture into a swapchain image.
#[derive(Debug, Clone, Copy, PartialEq)]
enum PresentPath {
    /// The picture is drawn or copied into the image.
    Straight,
    /// ENCODE draws it, as for an image that no hardware encodes.
    Encoded,
    /// As [`PresentPath::Straight`] and [`PresentPath::Encoded`], of a picture that is kept.
    Kept,
    EncodedKept,
}

/// The picture of the last of three frames that are shown: the first may wait for nobody, and the second's picture lies where the last one's does.
fn shown(presenter: &mut Presenter, scene: &Scene, what: &str) -> Picture {
    for copied in [false, true, true] {
        let drawn = presenter.draw(&scene.camera, copied, None).unwrap_or_else(|error| panic!("{what}: {error}"));
        assert!(matches!(drawn, Outcome::Shown(_)), "{what}: {drawn:?}");
    }
    presenter.picture().unwrap_or_else(|error| panic!("{what}: {error}"))
}

fn rendered(gpu: &Gpu, scene: &Scene, settings: &Settings) -> Picture {
    let mut renderer = Renderer::new(&gpu.device, scene, settings).unwrap_or_else(|error| panic!("{error}"));
    renderer.picture(&scene.camera, || {}).unwrap_or_else(|error| panic!("{error}"))
}

fn presenter(gpu: &Gpu, scene: &Scene, settings: &Settings, way: PresentPath) -> Presenter {
    let surface = Surface::headless(&gpu.device).unwrap_or_else(|error| panic!("{error}"));
    let presenter = Presenter::new(&gpu.device, surface, scene, settings, Vsync::On);
    let presenter = presenter.unwrap_or_else(|error| panic!("{error}"));
    match way {
        PresentPath::Straight => presenter,
        PresentPath::Encoded => presenter.with_encoding(),
        PresentPath::Kept => presenter.with_kept_pictures(),
        PresentPath::EncodedKept => presenter.with_encoding().with_kept_pictures(),
    }
}

/// Returns the first picture of a new presenter, or [`rendered`]'s if nothing is encoded: ENCODE reads light that was never rounded to 8 bits.
fn first(gpu: &Gpu, scene: &Scene, settings: &Settings, way: PresentPath) -> Picture {
    if matches!(way, PresentPath::Straight | PresentPath::Kept) {
        return rendered(gpu, scene, settings);
    }
    let mut presenter = presenter(gpu, scene, settings, way);
    fit(&mut presenter, scene, settings, settings.size);
    shown(&mut presenter, scene, "the first picture")
}

fn fit(presenter: &mut Presenter, scene: &Scene, settings: &Settings, size: [u32; 2]) {
    assert!(presenter.fit(scene, settings, size).unwrap_or_else(|error| panic!("{error}")), "{size:?} has pixels");
}

#[test]
fn a_presented_frame_is_bit_by_bit_that_of_a_renderer_at_every_size() {
    on_presenting_gpu(|gpu| {
        for (name, scene, settings) in ways() {
            let mut presenter = presenter(gpu, &scene, &settings, PresentPath::Straight);
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
fn an_encoded_frame_is_that_of_a_renderer_at_every_size_but_for_what_8_bits_round_away() {
    on_presenting_gpu(|gpu| {
        for (name, scene, settings) in ways() {
            let mut presenter = presenter(gpu, &scene, &settings, PresentPath::Encoded);
            assert!(!presenter.fit(&scene, &settings, [0, 0]).expect("needs nothing"), "{name}: nothing has no pixels");
            for size in SIZES {
                fit(&mut presenter, &scene, &settings, size);
                assert_eq!(presenter.shows_hdr(), Some(false), "{name}: no brighter than white");
                let what = format!("{name} at {size:?}");
                let (own, other) = (
                    shown(&mut presenter, &scene, &what),
                    rendered(gpu, &scene, &Settings { size, ..settings.clone() }),
                );
                let (Pixels::Srgb8(own), Pixels::Srgb8(other)) = (own.pixels, other.pixels) else {
                    panic!("{what}: no pictures of 8 bits");
                };
                assert_eq!(own.len(), other.len(), "{what}");
                let beyond = own.iter().zip(&other).filter(|(own, other)| own.abs_diff(**other) > 1).count();
                // FXAA finds edges by differences that 8 bits round away.
                let allowed = if settings.fxaa { own.len() / 50 } else { 0 };
                assert!(beyond <= allowed, "{what}: {beyond} of {} bytes", own.len());
            }
        }
    });
}

/// A triangle over the upper left half of the picture, of this colour, with its texture where that is not on the device yet.
fn panels([width, height]: [u32; 2], shade: u8, with_texture: bool) -> Panels {
    let corner =
        |x: u32, y: u32| PanelVertex { position: [x as f32, y as f32], uv: [0.5; 2], color: [shade, 60, 30, 128] };
    let white = PanelTexture { id: 0, size: [1; 2], rgba: vec![255; 4] };
    let scissor = vk::Rect2D { offset: vk::Offset2D::default(), extent: vk::Extent2D { width, height } };
    Panels {
        pixels_per_point: 1.0,
        vertices: vec![corner(0, 0), corner(width, 0), corner(0, height)],
        indices: vec![0, 1, 2],
        draws: vec![PanelDraw { texture: 0, scissor, indices: 0..3 }],
        textures: if with_texture { vec![white] } else { Vec::new() },
        ..Panels::default()
    }
}

/// Panels change over the last picture, which is shown again without a frame of the scene, into each of the window's images. A copy holds the picture
/// without the panels of this frame and of earlier ones, and with the part of another picture beside it.
#[test]
fn a_picture_that_is_kept_is_shown_again_under_other_panels_bit_by_bit() {
    on_presenting_gpu(|gpu| {
        let both = ways()
            .into_iter()
            .flat_map(|own| [PresentPath::Kept, PresentPath::EncodedKept].map(|way| (own.clone(), way)));
        for (turn, ((name, scene, settings), way)) in both.enumerate() {
            let (size, name) = (SIZES[2], &format!("{name}, {way:?}"));
            let drawn_over = if way == PresentPath::Kept { PresentPath::Straight } else { PresentPath::Encoded };
            let expected = first(gpu, &scene, &Settings { size, ..settings.clone() }, drawn_over);
            let mut presenter = presenter(gpu, &scene, &settings, way);
            fit(&mut presenter, &scene, &settings, SIZES[0]);
            fit(&mut presenter, &scene, &settings, size);
            assert_identical(&shown(&mut presenter, &scene, name), &expected, name);
            // `make test-all` splits the window, and leaves it whole, on each way.
            for &split in one_of(&[None, Some(settings.view)], turn + turn / 2) {
                presenter.show_beside(split);
                fit(&mut presenter, &scene, &settings, size);
                assert!(!presenter.has_picture(), "{name}: it is of frames that are gone");
                let over = panels(size, 90, !presenter.has_overlay());
                let drawn = presenter.draw(&scene.camera, true, Some(&over)).unwrap_or_else(|error| panic!("{error}"));
                assert!(matches!(drawn, Outcome::Shown(_)), "{name}: {drawn:?}");
                assert_identical(&presenter.picture().expect("copied"), &expected, &format!("{name}, under panels"));
                assert!(presenter.keeps(&scene.camera), "{name}");
                let figures = presenter.drawn();
                for frame in 0..6u8 {
                    presenter.divide_at(f64::from(frame) / 6.0);
                    let over = panels(size, 20 * frame, !presenter.has_overlay());
                    let again = presenter.show_again(true, (frame != 3).then_some(&over));
                    let again = again.unwrap_or_else(|error| panic!("{name}: {error}"));
                    assert!(matches!(again, Outcome::Shown(_)), "{name}: {again:?}");
                    assert_identical(
                        &presenter.picture().expect("copied"),
                        &expected,
                        &format!("{name}, again {frame}"),
                    );
                }
                assert_eq!(presenter.drawn(), figures, "{name}: no frame of the scene");
            }
        }
    });
}

/// As when a window moves to a display with other images.
#[test]
fn images_that_are_encoded_otherwise_than_before_get_frames_of_their_own() {
    on_presenting_gpu(|gpu| {
        for (name, scene, settings) in ways() {
            let settings = Settings { size: SIZES[0], ..settings };
            let [before, after] =
                [PresentPath::Straight, PresentPath::Encoded].map(|way| first(gpu, &scene, &settings, way));
            let mut presenter = presenter(gpu, &scene, &settings, PresentPath::Straight);
            presenter.show_beside(Some(settings.view));
            presenter.divide_at(0.5);
            fit(&mut presenter, &scene, &settings, SIZES[0]);
            assert_identical(&shown(&mut presenter, &scene, name), &before, &format!("{name}, straight"));
            presenter = presenter.with_encoding();
            fit(&mut presenter, &scene, &settings, SIZES[0]);
            assert_eq!(presenter.beside(), Some(settings.view), "{name}: {:?}", presenter.refusal());
            assert_identical(&shown(&mut presenter, &scene, name), &after, &format!("{name}, by ENCODE"));
        }
    });
}

#[test]
fn a_lost_surface_is_replaced_and_the_frames_go_on() {
    on_presenting_gpu(|gpu| {
        let both = ways()
            .into_iter()
            .flat_map(|own| [PresentPath::Straight, PresentPath::Encoded].map(|way| (own.clone(), way)));
        for (turn, ((name, scene, settings), way)) in both.enumerate() {
            let (size, name) = (SIZES[0], &format!("{name}, {way:?}"));
            let expected = first(gpu, &scene, &Settings { size, ..settings.clone() }, way);
            let mut presenter = presenter(gpu, &scene, &settings, way);
            // `make test-all` splits the window, and leaves it whole, on each way.
            for &split in one_of(&[None, Some(settings.view)], turn + turn / 2) {
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

/// The next call of each, where set, fails as if there were no memory.
static NEXT_BEGIN_FAILS: AtomicBool = AtomicBool::new(false);
static NEXT_SUBMISSION_FAILS: AtomicBool = AtomicBool::new(false);
static REAL_BEGIN: OnceLock<vk::PFN_vkBeginCommandBuffer> = OnceLock::new();
static REAL_SUBMISSION: OnceLock<vk::PFN_vkQueueSubmit> = OnceLock::new();

unsafe extern "system" fn begin(cmd: vk::CommandBuffer, info: *const vk::CommandBufferBeginInfo<'_>) -> vk::Result {
    match NEXT_BEGIN_FAILS.swap(false, Ordering::Relaxed) {
        true => vk::Result::ERROR_OUT_OF_HOST_MEMORY,
        // SAFETY: the caller's own arguments are passed on.
        false => unsafe { REAL_BEGIN.get().expect("set")(cmd, info) },
    }
}

unsafe extern "system" fn submit(
    queue: vk::Queue,
    count: u32,
    infos: *const vk::SubmitInfo<'_>,
    fence: vk::Fence,
) -> vk::Result {
    match NEXT_SUBMISSION_FAILS.swap(false, Ordering::Relaxed) {
        true => vk::Result::ERROR_OUT_OF_DEVICE_MEMORY,
        // SAFETY: the caller's own arguments are passed on.
        false => unsafe { REAL_SUBMISSION.get().expect("set")(queue, count, infos, fence) },
    }
}

/// Puts the two above before the device's own.
fn make_fallible(device: &mut Device) {
    let raw = &device.raw;
    let mut functions = raw.fp_v1_0().clone();
    REAL_BEGIN.get_or_init(|| functions.begin_command_buffer);
    REAL_SUBMISSION.get_or_init(|| functions.queue_submit);
    (functions.begin_command_buffer, functions.queue_submit) = (begin, submit);
    let (second, third, fourth) = (raw.fp_v1_1().clone(), raw.fp_v1_2().clone(), raw.fp_v1_3().clone());
    let handle = raw.handle();
    device.raw.intercept(ash::Device::from_parts_1_3(handle, functions, second, third, fourth));
}

/// Image and semaphore are acquired by then. A message of the layer about either, about the swapchain that goes or about the next frame is a failure
/// here.
#[test]
fn a_frame_that_fails_after_its_image_is_acquired_leaves_nothing_acquired() {
    on_prepared_presenting_gpu(make_fallible, |gpu| {
        let size = SIZES[0];
        let (scene, settings) = (scene("builtin:spheres"), Settings { samples: 1, size, ..Settings::default() });
        for way in [PresentPath::Straight, PresentPath::Encoded] {
            let expected = first(gpu, &scene, &settings, way);
            let mut presenter = presenter(gpu, &scene, &settings, way);
            fit(&mut presenter, &scene, &settings, size);
            for fault in [&NEXT_BEGIN_FAILS, &NEXT_SUBMISSION_FAILS, &NEXT_SUBMISSION_FAILS, &NEXT_BEGIN_FAILS] {
                fault.store(true, Ordering::Relaxed);
                let failed = presenter.draw(&scene.camera, false, None).expect_err("there is no memory").to_string();
                assert!(failed.contains("memory") && !fault.load(Ordering::Relaxed), "{failed}");
                let nothing = presenter.draw(&scene.camera, false, None).expect("nothing is wrong with the device");
                assert!(matches!(nothing, Outcome::Nothing(_)), "{nothing:?}");
                fit(&mut presenter, &scene, &settings, size);
                assert_identical(&shown(&mut presenter, &scene, "after"), &expected, "the frames after");
            }
        }
    });
}

/// A callback for when frames are made, and the receiver that tells a test of the call.
fn wake() -> (Wake, Receiver<()>) {
    let (tell, told) = channel();
    // A test that does not listen any more need not know.
    (Arc::new(move || _ = tell.send(())), told)
}

/// Takes frames that are being made in another thread.
fn take(presenter: &mut Presenter, (scene, settings): (&Scene, &Settings), (wake, woken): (&Wake, &Receiver<()>)) {
    loop {
        match presenter.fit_later(scene, settings, wake).unwrap_or_else(|error| panic!("{error}")) {
            // Calls for frames that were taken before the call came are received here as well.
            FitOutcome::Pending => woken.recv_timeout(Duration::from_secs(120)).expect("the other thread tells"),
            fitted => return assert_eq!((fitted, presenter.is_pending()), (FitOutcome::Taken, false)),
        }
    }
}

#[test]
fn frames_go_on_as_they_were_while_others_are_made() {
    on_presenting_gpu(|gpu| {
        let (size, (wake, woken)) = (SIZES[0], wake());
        let of_spheres = |(_, scene, _): &(&str, Scene, Settings)| scene.name == "builtin:spheres";
        let ways: Vec<_> = ways().into_iter().filter(of_spheres).collect();
        let (_, scene, begun) = &ways[0];
        for way in [PresentPath::Straight, PresentPath::Encoded] {
            let mut presenter = presenter(gpu, scene, begun, way);
            fit(&mut presenter, scene, begun, size);
            let mut before = first(gpu, scene, &Settings { size, ..begun.clone() }, way);
            for (name, _, settings) in ways.iter().cycle().skip(1).take(ways.len()) {
                presenter.change(false);
                let fitted = presenter.fit_later(scene, settings, &wake).expect("can be made");
                assert_eq!(fitted, FitOutcome::Pending, "{name}, {way:?}");
                assert_identical(&shown(&mut presenter, scene, name), &before, &format!("before {name}, {way:?}"));
                take(&mut presenter, (scene, settings), (&wake, &woken));
                let after = first(gpu, scene, &Settings { size, ..settings.clone() }, way);
                assert_identical(&shown(&mut presenter, scene, name), &after, &format!("{name}, {way:?}"));
                before = after;
            }
        }
    });
}

#[test]
fn what_changes_while_frames_are_made_is_in_them() {
    on_presenting_gpu(|gpu| {
        let (size, (wake, woken)) = (SIZES[0], wake());
        let (mut scene, settings) = (scene("builtin:spheres"), Settings { samples: 1, ..Settings::default() });
        let with = |light_path, exposure| Settings { light_path, exposure: Some(exposure), ..settings.clone() };
        let (first, second) = (with(LightPath::Loop, 9.0), with(LightPath::Forward, 9.0));
        let mut presenter = presenter(gpu, &scene, &first, PresentPath::Straight);
        fit(&mut presenter, &scene, &first, size);

        // A light and the exposure, which both the old frames and the new ones take as they are.
        presenter.change(false);
        assert_eq!(presenter.fit_later(&scene, &second, &wake).expect("can be made"), FitOutcome::Pending);
        scene.lights[0].intensity *= 0.25;
        assert!(presenter.set_light(0, &scene.lights[0]).expect("a light"), "needs nothing else");
        presenter.set_exposure(8.0).expect("is an exposure");
        let (first, second) = (with(LightPath::Loop, 8.0), with(LightPath::Forward, 8.0));
        let expected = |settings: &Settings, size| rendered(gpu, &scene, &Settings { size, ..settings.clone() });
        assert_identical(&shown(&mut presenter, &scene, "old"), &expected(&first, size), "the old frames");
        take(&mut presenter, (&scene, &second), (&wake, &woken));
        assert_identical(&shown(&mut presenter, &scene, "new"), &expected(&second, size), "the new frames");

        // A light that the old frames do not have: the frames that are being made get its newest value.
        let mut lit = scene.clone();
        lit.lights.push(Light { intensity: 0.0, ..scene.lights[0].clone() });
        let last = lit.lights.len() - 1;
        presenter.change(true);
        fit(&mut presenter, &lit, &second, size);
        for intensity in [10.0, 20.0, 40.0] {
            lit.lights[last].intensity = intensity;
            let taken = presenter.set_light(last, &lit.lights[last]).expect("a light");
            assert!(!taken, "it was dark when its scene was planned");
            if intensity == 10.0 {
                assert_eq!(presenter.fit_later(&lit, &second, &wake).expect("can be made"), FitOutcome::Pending);
            }
        }
        take(&mut presenter, (&lit, &second), (&wake, &woken));
        let brightest = rendered(gpu, &lit, &Settings { size, ..second.clone() });
        assert_identical(&shown(&mut presenter, &lit, "lit"), &brightest, "with one light more");
        presenter.change(true);
        fit(&mut presenter, &scene, &second, size);

        // Others are asked for before these are made: they are never shown.
        presenter.change(false);
        assert_eq!(presenter.fit_later(&scene, &first, &wake).expect("can be made"), FitOutcome::Pending);
        presenter.change(false);
        let third = with(LightPath::Clustered, 8.0);
        take(&mut presenter, (&scene, &third), (&wake, &woken));
        assert_identical(&shown(&mut presenter, &scene, "third"), &expected(&third, size), "those asked for last");

        // The window takes another size: it waits for the frames that are being made, which have the new size.
        presenter.change(false);
        assert_eq!(presenter.fit_later(&scene, &second, &wake).expect("can be made"), FitOutcome::Pending);
        fit(&mut presenter, &scene, &second, SIZES[2]);
        assert!(!presenter.is_pending());
        assert_identical(&shown(&mut presenter, &scene, "sized"), &expected(&second, SIZES[2]), "at another size");

        // Settings that cannot be planned leave the frames as they are.
        presenter.change(false);
        let none = Settings { light_path: LightPath::Volumes, msaa: 4, ..second.clone() };
        assert!(presenter.fit_later(&scene, &none, &wake).is_err() && !presenter.is_pending());
        assert_identical(&shown(&mut presenter, &scene, "refused"), &expected(&second, SIZES[2]), "after a refusal");
    });
}

#[test]
fn a_view_beside_the_picture_is_made_while_the_picture_is_shown_alone() {
    on_presenting_gpu(|gpu| {
        [PresentPath::Straight, PresentPath::Encoded].into_iter().for_each(|way| view_beside(gpu, way))
    });
}

fn view_beside(gpu: &Gpu, way: PresentPath) {
    let (size, (wake, woken)) = (SIZES[0], wake());
    let (scene, settings) = (scene("builtin:spheres"), Settings { samples: 1, size, ..Settings::default() });
    let alone = first(gpu, &scene, &settings, way);
    let beside = first(gpu, &scene, &Settings { view: View::Normal, ..settings.clone() }, way);
    let mut presenter = presenter(gpu, &scene, &settings, way);
    fit(&mut presenter, &scene, &settings, size);
    presenter.show_beside(Some(View::Normal));
    assert_eq!(presenter.fit_later(&scene, &settings, &wake).expect("can be made"), FitOutcome::Pending);
    assert_identical(&shown(&mut presenter, &scene, "alone"), &alone, "while the other is made");
    take(&mut presenter, (&scene, &settings), (&wake, &woken));
    presenter.divide_at(0.0);
    assert_identical(&shown(&mut presenter, &scene, "beside"), &beside, "right of the divider");
    // Both are made anew when the frames are.
    let mapped = Settings { light_path: LightPath::Clustered, tonemap: Tonemap::Aces, ..settings.clone() };
    presenter.divide_at(1.0);
    presenter.change(false);
    assert_eq!(presenter.fit_later(&scene, &mapped, &wake).expect("can be made"), FitOutcome::Pending);
    assert_identical(&shown(&mut presenter, &scene, "before"), &alone, "left of the divider, as it was");
    take(&mut presenter, (&scene, &mapped), (&wake, &woken));
    assert_identical(&shown(&mut presenter, &scene, "left"), &first(gpu, &scene, &mapped, way), "left of it");
    presenter.divide_at(0.0);
    assert_identical(&shown(&mut presenter, &scene, "right"), &beside, "right of it");
    // A path without this view shows the picture alone.
    let forward = Settings { light_path: LightPath::Forward, ..settings };
    presenter.change(false);
    take(&mut presenter, (&scene, &forward), (&wake, &woken));
    assert!(presenter.refusal().is_some() && presenter.beside().is_none());
    assert_identical(&shown(&mut presenter, &scene, "refused"), &first(gpu, &scene, &forward, way), "alone");
}
