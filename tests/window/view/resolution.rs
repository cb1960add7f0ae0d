//! Pictures that are coarser than the window while something moves.

use std::process::Command;
use std::sync::Arc;
use std::thread::sleep;
use std::time::Duration;

use afterlight::frame::{Outcome, Presenter, Renderer};
use afterlight::gpu::{
    Device, DeviceChoice, Fit, Instance, InstanceOptions, MessageKind, Surface, Validation, Vsync, surface_extensions,
};
use afterlight::scene::{Camera, Light, LightPath, OpenOptions, Scene, Settings, open};
use afterlight_truth::reference::tonemap::{decode_srgb, encode_srgb};
use glam::DVec3;
use winit::application::ApplicationHandler;
use winit::dpi::PhysicalSize;
use winit::event::WindowEvent;
use winit::event_loop::{ActiveEventLoop, EventLoop};
use winit::platform::x11::EventLoopBuilderExtX11 as _;
use winit::raw_window_handle::{HasWindowHandle as _, RawWindowHandle};
use winit::window::{Window, WindowId};
use x11rb::protocol::xproto::{ConnectionExt, ImageFormat};
use x11rb::rust_connection::RustConnection;

use super::WAYS;
use super::harness::{SIZE, Server, View, key, rendered, rgb, size_text, text, until};
use crate::common::gpu::bytes;
use crate::common::program::runner;

const OWN_PROCESS: &str = "AFTERLIGHT_TEST_ENLARGED";
/// Whole, and two that do not divide the window's edges.
const SHARES: [f64; 3] = [1.0, 0.5, 0.3];

#[test]
fn a_picture_that_rests_is_bit_by_bit_what_render_draws_and_a_screenshot_has_all_pixels() {
    let server = Server::start();
    let arguments = WAYS[0];
    let expected = rendered(SIZE, arguments);
    let size = size_text(SIZE);
    let on = ["--size", size.as_str(), "--dynamic-resolution", "on"];
    let mut view = View::open(&server, &[arguments, &on[..]].concat());
    view.shows(&expected, "at rest");
    server.press(key::W);
    sleep(Duration::from_millis(100));
    server.tap(key::P);
    view.waits_to_tell("screenshot: ");
    server.release(key::W);
    let kept = rgb(&view.folder.path().join("afterlight-0001.png"));
    assert!(kept.len() == expected.len() && kept != expected, "a screenshot of another place with all pixels");
    server.tap(key::R);
    view.shows(&expected, "at rest again");
    server.tap(key::Z);
    view.waits_to_tell("resolution: always the window's");
    server.tap(key::Z);
    view.waits_to_tell("resolution: follows the time of frames");
    server.tap(key::ESCAPE);
    view.ends_well();
}

const WINDOW: [u32; 2] = [SIZE[0] as u32, SIZE[1] as u32];

/// A window whose pictures have each of [`SHARES`] of its edges.
struct App {
    ways: Vec<(Scene, Settings)>,
    window: Option<Arc<Window>>,
    done: bool,
}

impl App {
    fn look(&mut self, events: &ActiveEventLoop) {
        let window = self.window.clone().expect("it is open");
        let extensions = surface_extensions(events).expect("a window system");
        let options = InstanceOptions { validation: Validation::Synchronization, ..InstanceOptions::default() };
        let instance = Instance::with_extensions(&options, &extensions).expect("an instance");
        let device = Device::with_extensions(&instance, &DeviceChoice::Auto, &[c"VK_KHR_swapchain"]).expect("a device");
        for (scene, settings) in &self.ways {
            let surface = Surface::new(&device, Arc::clone(&window)).expect("a surface");
            let presenter = Presenter::new(&device, surface, scene, settings, Vsync::Off).expect("it can present");
            let mut presenter = presenter.with_dynamic_resolution();
            assert!(presenter.fit(scene, settings, WINDOW).expect("it fits"));
            for share in SHARES {
                assert!(presenter.set_resolution(share).expect("frames of that size"));
                let size = WINDOW.map(|edge| (f64::from(edge) * share).round() as u32);
                let small = Settings { size, ..settings.clone() };
                let mut renderer = Renderer::new(&device, scene, &small).expect("a renderer");
                let own = renderer.picture(&scene.camera, || {}).expect("a picture");
                // Four frames reach each image of the swapchain.
                for _ in 0..4 {
                    // An image may be late on a busy machine.
                    while presenter.draw(&scene.camera, true, None).expect("a frame") == Outcome::Nothing(Fit::Exact) {}
                    let picture = presenter.picture().expect("it was copied");
                    assert_eq!(picture.size, size, "{share}");
                    // An average is of other frames than a renderer's first picture.
                    assert!(settings.taa || picture == own, "{share}: another picture");
                }
                if settings.taa {
                    continue;
                }
                let expected = enlarged(bytes(&own), size, settings.light_path == LightPath::Compute);
                let allowed = if share < 1.0 { 3 } else { 0 };
                // Presentation copies into the window in a separate thread.
                until("the picture in the window", || {
                    let shown = pixels(&window);
                    let most = shown.iter().zip(&expected).map(|(own, other)| own.abs_diff(*other)).max();
                    (most <= Some(allowed)).then_some(())
                });
            }
            show_again(&mut presenter, scene, settings);
            // A light that shines no more needs no other frames, and they still change their size.
            let dark = Light { intensity: 0.0, ..scene.lights[0].clone() };
            assert!(presenter.set_light(0, &dark).expect("a light"));
            assert!(presenter.set_resolution(1.0).expect("frames of that size"));
            assert_eq!(presenter.plan().map(|plan| plan.size), Some(WINDOW));
            // Two pictures beside each other are whole.
            presenter.show_beside(Some(settings.view));
            assert!(presenter.fit(scene, settings, WINDOW).expect("it fits"));
            assert!(!presenter.set_resolution(0.5).expect("nothing to do"));
            assert_eq!(presenter.plan().map(|plan| plan.size), Some(WINDOW));
        }
        device.wait_idle().expect("it is done");
        drop(device);
        let log = instance.message_log();
        drop(instance);
        let messages = log.take();
        assert!(messages.iter().all(|own| own.kind == MessageKind::General), "{messages:?}");
    }
}

impl ApplicationHandler for App {
    fn resumed(&mut self, events: &ActiveEventLoop) {
        let [width, height] = WINDOW;
        let attributes =
            Window::default_attributes().with_title("Afterlight").with_inner_size(PhysicalSize::new(width, height));
        let window = Arc::new(events.create_window(attributes).expect("a window"));
        window.request_redraw();
        self.window = Some(window);
    }

    fn window_event(&mut self, events: &ActiveEventLoop, _: WindowId, event: WindowEvent) {
        if event == WindowEvent::RedrawRequested && !self.done {
            self.look(events);
            self.done = true;
            events.exit();
        }
    }
}

/// Shows a picture again, which nothing draws anew until something in it changes.
fn show_again(presenter: &mut Presenter, scene: &Scene, settings: &Settings) {
    let camera = &scene.camera;
    let picture = |presenter: &mut Presenter, again: bool| {
        let draw = |presenter: &mut Presenter, copied| presenter.draw(camera, copied, None).expect("a frame");
        let show = |presenter: &mut Presenter| match again {
            true => presenter.show_again(true, None).expect("it is kept"),
            false => draw(presenter, true),
        };
        if !again {
            // A picture that is averaged over time is kept when it has come to rest.
            while draw(presenter, false) == Outcome::Nothing(Fit::Exact) || presenter.converges() {}
        }
        while show(presenter) == Outcome::Nothing(Fit::Exact) {}
        presenter.picture().expect("it was copied")
    };
    let before = picture(presenter, false);
    assert!(presenter.keeps(camera) && presenter.has_picture());
    let figures = presenter.drawn();
    // The picture is shown again in each of the window's images.
    for _ in 0..4 {
        assert_eq!(picture(presenter, true).pixels, before.pixels);
    }
    assert_eq!(presenter.drawn(), figures, "no frame of the scene");
    let aside = Camera { position: camera.position + DVec3::X, ..*camera };
    assert!(!presenter.keeps(&aside), "another camera sees something else");
    let ev100 = settings.exposure.unwrap_or(0.0) + 1.5;
    let light = Light { intensity: scene.lights[0].intensity * 0.5, ..scene.lights[0].clone() };
    let changes: [fn(&mut Presenter, &Light, f32); 2] = [
        |presenter, _, ev100| presenter.set_exposure(ev100).expect("light is exposed"),
        |presenter, light, _| assert!(presenter.set_light(0, light).expect("a light")),
    ];
    for change in changes {
        change(presenter, &light, ev100);
        assert!(!presenter.keeps(camera) && presenter.has_picture(), "it is another picture now");
        assert_eq!(picture(presenter, true).pixels, before.pixels, "the old one is still shown");
    }
    assert_ne!(picture(presenter, false).pixels, before.pixels, "until the next frame");
    assert!(presenter.keeps(camera));
    // Frames of another size have no picture yet.
    assert!(presenter.set_resolution(0.5).is_ok_and(|is_smaller| is_smaller) && !presenter.has_picture());
    assert!(matches!(presenter.show_again(false, None), Ok(Outcome::Nothing(Fit::OutOfDate))));
    presenter.set_light(0, &scene.lights[0]).expect("a light");
    assert!(presenter.fit(scene, settings, WINDOW).expect("it fits"));
}

/// Returns a window's pixels, RGB, as its X server tells them.
fn pixels(window: &Window) -> Vec<u8> {
    let (connection, _) = RustConnection::connect(None).expect("the server takes connections");
    let RawWindowHandle::Xlib(handle) = window.window_handle().expect("it is open").as_raw() else {
        panic!("a window of X11")
    };
    let [width, height] = WINDOW.map(|edge| edge as u16);
    let asked = connection.get_image(ImageFormat::Z_PIXMAP, handle.window as u32, 0, 0, width, height, !0);
    let image = asked.expect("sent").reply().expect("it is visible");
    // Little-endian words of 0x00RRGGBB.
    image.data.as_chunks::<4>().0.iter().flat_map(|&[b, g, r, _]| [r, g, b]).collect()
}

/// Returns a picture of this size enlarged to the whole window, RGB: interpolated linearly between the centres of its pixels, in light or, if it is
/// `plain`, in codes.
fn enlarged(rgba: &[u8], [width, height]: [u32; 2], plain: bool) -> Vec<u8> {
    let value = |code: u8| if plain { f64::from(code) / 255.0 } else { decode_srgb(f64::from(code) / 255.0) };
    let code = |value: f64| ((if plain { value } else { encode_srgb(value) }) * 255.0).round() as u8;
    let texel = |x: i64, y: i64, channel: usize| {
        let [x, y] = [(x, width), (y, height)].map(|(at, edge)| at.clamp(0, i64::from(edge) - 1) as usize);
        value(rgba[4 * (y * width as usize + x) + channel])
    };
    let mut all = Vec::new();
    for y in 0..WINDOW[1] {
        for x in 0..WINDOW[0] {
            let place =
                |at: u32, edge: u32, whole: u32| (f64::from(at) + 0.5) * f64::from(edge) / f64::from(whole) - 0.5;
            let (u, v) = (place(x, width, WINDOW[0]), place(y, height, WINDOW[1]));
            let (left, top) = (u.floor() as i64, v.floor() as i64);
            let (right_share, lower_share) = (u - u.floor(), v - v.floor());
            for channel in 0..3 {
                let row =
                    |y: i64| texel(left, y, channel) * (1.0 - right_share) + texel(left + 1, y, channel) * right_share;
                all.push(code(row(top) * (1.0 - lower_share) + row(top + 1) * lower_share));
            }
        }
    }
    all
}

/// A process has one event loop at most: the test below starts this one in a separate process.
#[test]
#[ignore = "a_coarse_picture_is_a_renderers_and_fills_the_window starts it"]
fn coarse_pictures_in_a_process_of_their_own() {
    if std::env::var_os(OWN_PROCESS).is_none() {
        return;
    }
    let events = EventLoop::builder().with_any_thread(true).build().expect("an event loop");
    let scene = open("builtin:spheres", &OpenOptions::default()).expect("it is built in");
    let settings = Settings { samples: 1, light_path: LightPath::Loop, ..scene.settings.decide() };
    let ways = [
        settings.clone(),
        Settings { msaa: 4, fxaa: true, ..settings.clone() },
        Settings { taa: true, bloom: 0.2, ..settings.clone() },
        Settings { light_path: LightPath::Compute, ..settings },
    ];
    let ways = ways.map(|settings| (scene.clone(), settings)).to_vec();
    events.run_app(&mut App { ways, window: None, done: false }).expect("events");
    println!("all shares were looked at");
}

#[test]
#[ignore = "test-all: the program and its window at length"]
fn a_coarse_picture_is_a_renderers_and_fills_the_window() {
    let server = Server::start();
    let own = std::env::args_os().next().expect("programs have names");
    let mut command = runner().map_or_else(
        || Command::new(&own),
        |runner| {
            let mut command = Command::new(runner);
            command.arg(&own);
            command
        },
    );
    command.args([
        "--exact",
        "view::resolution::coarse_pictures_in_a_process_of_their_own",
        "--ignored",
        "--nocapture",
    ]);
    command.env(OWN_PROCESS, "1");
    server.serves(&mut command);
    let output = command.output().expect("this program starts again");
    let told = text(&output.stdout);
    assert!(output.status.success(), "{told}{}", text(&output.stderr));
    assert!(told.contains("all shares were looked at"), "{told}");
}
