//! Windows that are opened and closed in one process, one after the other, each with a separate device: everything that they take is given back.

use std::process::Command;
use std::sync::Arc;

use afterlight::frame::{Outcome, Presenter};
use afterlight::gpu::{Device, DeviceChoice, Instance, InstanceOptions, Surface, Vsync, surface_extensions};
use afterlight::scene::{OpenOptions, Scene, open};
use afterlight_truth::measure::{open_files, resident_memory_bytes, threads};
use winit::application::ApplicationHandler;
use winit::dpi::PhysicalSize;
use winit::event::WindowEvent;
use winit::event_loop::{ActiveEventLoop, EventLoop};
use winit::platform::x11::EventLoopBuilderExtX11 as _;
use winit::window::{Window, WindowId};

use super::harness::{Server, text};
use crate::common::program::runner;
use crate::common::tries_all;

const OPENINGS: &str = "AFTERLIGHT_TEST_OPENINGS";
/// Openings after which memory is judged: lavapipe's compiler takes more for long (Mesa 22.3.6 36 kB for each device, and 25.0.7 nothing more after the
/// 120th). Open files and threads tell of a device that stays after any.
const LONG: usize = 200;
/// Growth of the process's memory that counts as none, in the second half of a long run.
const SLACK_BYTES: u64 = 6 << 20;
/// Openings whose median is compared.
const FEW: usize = 5;
/// Frames of each window.
const FRAMES: u32 = 3;

#[derive(Debug, Clone, Copy)]
struct ProcessResources {
    memory: u64,
    files: usize,
    threads: usize,
}

impl ProcessResources {
    /// The median of each number.
    fn median(all: &[Self]) -> Self {
        fn middle<T: Ord + Copy>(all: &[ProcessResources], of: fn(&ProcessResources) -> T) -> T {
            let mut values: Vec<T> = all.iter().map(of).collect();
            values.sort_unstable();
            values[values.len() / 2]
        }
        let (memory, files) = (middle(all, |held| held.memory), middle(all, |held| held.files));
        Self { memory, files, threads: middle(all, |held| held.threads) }
    }
}

struct App {
    scene: Scene,
    left: usize,
    frames: u32,
    /// The presenter goes before its window: it keeps the surface, and that the window.
    shown: Option<(Presenter, Arc<Window>)>,
    held: Vec<ProcessResources>,
}

impl App {
    fn open(&mut self, events: &ActiveEventLoop) {
        let attributes =
            Window::default_attributes().with_title("Afterlight").with_inner_size(PhysicalSize::new(64, 36));
        let window = Arc::new(events.create_window(attributes).expect("a window"));
        let extensions = surface_extensions(events).expect("a window system");
        let instance = Instance::with_extensions(&InstanceOptions::default(), &extensions).expect("an instance");
        let device = Device::with_extensions(&instance, &DeviceChoice::Auto, &[c"VK_KHR_swapchain"]).expect("a device");
        let surface = Surface::new(&device, Arc::clone(&window)).expect("a surface");
        let settings = self.scene.settings.decide();
        let presenter = Presenter::new(&device, surface, &self.scene, &settings, Vsync::Off).expect("it can present");
        window.request_redraw();
        (self.shown, self.frames) = (Some((presenter, window)), FRAMES);
    }

    fn draw(&mut self, events: &ActiveEventLoop) {
        let Some((presenter, window)) = &mut self.shown else { return };
        let size: [u32; 2] = window.inner_size().into();
        let fits = presenter.plan().is_some_and(|plan| plan.size == size);
        let fitted = fits || presenter.fit(&self.scene, &self.scene.settings.decide(), size).expect("it fits");
        if fitted && matches!(presenter.draw(&self.scene.camera, false, None).expect("a frame"), Outcome::Shown(_)) {
            self.frames -= 1;
        }
        if self.frames > 0 {
            return window.request_redraw();
        }
        self.shown = None;
        let memory = resident_memory_bytes().expect("Linux tells");
        let (files, threads) = (open_files().expect("Linux tells"), threads().expect("Linux tells"));
        self.held.push(ProcessResources { memory, files, threads });
        self.left -= 1;
        if self.left == 0 { events.exit() } else { self.open(events) }
    }
}

impl ApplicationHandler for App {
    fn resumed(&mut self, events: &ActiveEventLoop) {
        self.open(events);
    }

    fn window_event(&mut self, events: &ActiveEventLoop, id: WindowId, event: WindowEvent) {
        let is_own = self.shown.as_ref().is_some_and(|(_, window)| window.id() == id);
        if is_own && event == WindowEvent::RedrawRequested {
            self.draw(events);
        }
    }
}

/// A process has one event loop at most, and windows of other tests would count: the test below starts this one in a separate process.
#[test]
#[ignore = "windows_opened_and_closed_in_one_process_leave_nothing starts it"]
fn windows_of_a_process_of_their_own() {
    let Some(count) = std::env::var(OPENINGS).ok().and_then(|text| text.parse().ok()) else { return };
    let scene = open("builtin:triangle", &OpenOptions::default()).expect("it is built in");
    let events = EventLoop::builder().with_any_thread(true).build().expect("an event loop");
    let mut app = App { scene, left: count, frames: 0, shown: None, held: Vec::new() };
    events.run_app(&mut app).expect("events");
    for (index, held) in app.held.iter().enumerate() {
        println!("opening {index}: {held:?}");
    }
    assert_eq!(app.held.len(), count);
    let last_before = |end: usize| ProcessResources::median(&app.held[end - FEW..end]);
    let (begin, end) = (last_before(count / 2), last_before(count));
    assert_eq!((end.files, end.threads), (begin.files, begin.threads), "open files and threads");
    println!("half of {count}: {begin:?}, all: {end:?}");
    let grown = end.memory.saturating_sub(begin.memory);
    assert!(count < LONG || grown <= SLACK_BYTES, "memory has grown by {grown} bytes");
}

/// Starts this program of tests once more, on the same stack.
fn itself() -> Command {
    // A dynamic linker that was told to start it would be `current_exe`.
    let own = std::env::args_os().next().expect("programs have names");
    let Some(runner) = runner() else { return Command::new(own) };
    let mut command = Command::new(runner);
    command.arg(own);
    command
}

#[test]
fn windows_opened_and_closed_in_one_process_leave_nothing() {
    let server = Server::start();
    let count = if tries_all() { LONG } else { 10 };
    let mut command = itself();
    command.args(["--exact", "view::openings::windows_of_a_process_of_their_own", "--ignored", "--nocapture"]);
    command.env(OPENINGS, count.to_string());
    server.serves(&mut command);
    let output = command.output().expect("this program starts again");
    let told = text(&output.stdout);
    assert!(output.status.success(), "{told}{}", text(&output.stderr));
    assert_eq!(told.lines().filter(|line| line.contains("opening ")).count(), count, "{told}");
    told.lines().filter(|line| line.starts_with("half of ")).for_each(|line| println!("{line}"));
}
