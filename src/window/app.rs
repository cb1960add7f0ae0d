//! The window's events, and when a frame is drawn: when something has changed, and otherwise never.

use std::sync::Arc;
use std::time::{Duration, Instant};

use glam::DVec2;
use winit::application::ApplicationHandler;
use winit::dpi::{PhysicalPosition, PhysicalSize};
use winit::event::{ElementState, MouseButton, MouseScrollDelta, WindowEvent};
use winit::event_loop::{ActiveEventLoop, ControlFlow};
use winit::keyboard::{KeyCode, PhysicalKey};
use winit::window::{Window, WindowId};

use super::camera::{CameraControl, Held, Mode};
use super::clock::{Clock, Summary};
use super::controls::Controls;
use super::desk::{Desk, Subject};
use super::keys::{Action, HELP, action, hold};
use super::recorder::Recorder;
use super::{Error, Options};
use crate::frame::{self, Outcome, Presenter};
use crate::gpu::{self, Device, Fit, Surface, vk};
use crate::reference::View;
use crate::scene::{Scene, Settings};

/// Pixels that a wheel which tells its way in pixels goes for a notch.
const PIXELS_A_NOTCH: f64 = 40.0;
/// Pixels that the mouse may go while a button is held down for a click.
const CLICK: f64 = 4.0;
/// When an image is asked for again that was not to be had.
const AGAIN: Duration = Duration::from_millis(50);

/// A window and what it shows.
pub struct App<'a> {
    device: Arc<Device>,
    subject: Subject,
    options: Options<'a>,
    control: CameraControl,
    held: Held,
    with_control: bool,
    with_shift: bool,
    /// Where the mouse was, while a button is held down.
    dragged: Option<PhysicalPosition<f64>>,
    dragging: bool,
    /// How far it has gone since, in pixels.
    way: f64,
    /// Where it is.
    mouse: DVec2,
    clock: Clock,
    screenshot: bool,
    /// The swapchain is not of the window's size, or not of its surface.
    unfit: bool,
    /// Nobody can see the window.
    hidden: bool,
    /// A new swapchain did not suit better than the one before: that is left alone until the window changes.
    content: bool,
    /// When to try again.
    again: Option<Instant>,
    // Before the window: a surface that it still holds would outlive it.
    presenter: Option<Presenter>,
    window: Option<Arc<Window>>,
    desk: Option<Desk>,
    /// The camera's path, while it is recorded.
    recording: Option<Recorder>,
    /// The next frame's picture is to be compared with the truth.
    compare: bool,
    wake: Arc<dyn Fn() + Send + Sync>,
    failure: Option<Error>,
}

impl<'a> App<'a> {
    /// `wake` makes the loop call [`ApplicationHandler::user_event`].
    pub fn new(
        device: &Arc<Device>,
        (scene, settings): (Scene, Settings),
        options: Options<'a>,
        wake: Arc<dyn Fn() + Send + Sync>,
    ) -> Self {
        let control = CameraControl::new(scene.camera, &scene.bounds());
        Self {
            device: device.clone(),
            subject: Subject::new(scene, settings),
            options,
            control,
            held: Held::default(),
            with_control: false,
            with_shift: false,
            dragged: None,
            dragging: false,
            way: 0.0,
            mouse: DVec2::ZERO,
            clock: Clock::default(),
            screenshot: false,
            unfit: true,
            hidden: false,
            content: false,
            again: None,
            presenter: None,
            window: None,
            desk: None,
            recording: None,
            compare: false,
            wake,
            failure: None,
        }
    }

    /// What the window drew, or what ended it.
    pub fn end(mut self) -> Result<Summary, Error> {
        match self.failure.take() {
            Some(failure) => Err(failure),
            None => Ok(self.clock.summary()),
        }
    }

    fn open(&mut self, events: &ActiveEventLoop) -> Result<(), Error> {
        let [width, height] = self.subject.settings.size;
        let attributes = Window::default_attributes()
            .with_title(title(&self.subject.scene, None))
            .with_inner_size(PhysicalSize::new(width, height));
        let window = events.create_window(attributes).map_err(|error| Error::System(error.to_string()))?;
        let window = Arc::new(window);
        let surface = Surface::new(&self.device, window.clone())?;
        let presenter =
            Presenter::new(&self.device, surface, &self.subject.scene, &self.subject.settings, self.options.vsync)?;
        self.desk = Some(Desk::new(&self.device, &window, Arc::clone(&self.wake)));
        (self.presenter, self.window) = (Some(presenter), Some(window));
        self.ask_for_frame();
        Ok(())
    }

    fn ask_for_frame(&self) {
        if let Some(window) = &self.window {
            window.request_redraw();
        }
    }

    /// Draws a frame, with a swapchain that fits, and keeps its picture if that was asked for.
    fn draw(&mut self) -> Result<(), Error> {
        let (Some(window), Some(presenter), Some(desk)) = (&self.window, &mut self.presenter, &mut self.desk) else {
            return Ok(());
        };
        let now = Instant::now();
        self.control.advance(self.clock.seconds(now), self.held);
        let camera = *self.control.camera();
        // A camera that is zoomed may look more closely than the plan was made for.
        if presenter.check_camera(&camera).is_err() {
            self.subject.scene.camera.projection = camera.projection;
            self.unfit = true;
        }
        if let Some(recording) = &mut self.recording {
            recording.take(now, camera);
        }
        desk.listen(&camera);
        let mut panels = None;
        let known = (&mut *presenter, &self.clock);
        if let Some((shown, delay, unfit)) = desk.show(window, known, (&mut self.subject, &camera)) {
            panels = Some(shown);
            self.unfit |= unfit;
            self.again = now.checked_add(delay).filter(|_| delay < Duration::from_secs(60));
        }
        if std::mem::take(&mut desk.controls.asks_truth) {
            self.compare = !desk.is_comparing();
            desk.end_comparison();
        }
        if self.unfit {
            let PhysicalSize { width, height } = window.inner_size();
            let begun = Instant::now();
            if !presenter.fit(&self.subject.scene, &self.subject.settings, [width, height])? {
                self.clock.pause();
                self.hidden = true;
                return Ok(());
            }
            let first = self.clock.frames() == 0;
            if first {
                tell_mode(presenter, &self.options);
            } else {
                self.clock.resized(begun.elapsed());
            }
            (self.unfit, self.hidden) = (false, false);
        }
        let kept = std::mem::take(&mut self.screenshot);
        let compared = std::mem::take(&mut self.compare);
        let copied = kept || compared;
        if let Some(panels) = &mut panels {
            desk.send_textures(panels, presenter);
        }
        window.pre_present_notify();
        let fit = match presenter.draw(&camera, copied, panels.as_ref())? {
            Outcome::Shown(fit) => {
                // From where time was taken last, so that none is lost.
                self.clock.frame(now, &presenter.times());
                if copied {
                    let picture = presenter.picture()?;
                    if kept {
                        let told = (self.options.keep)(&picture);
                        (self.options.tell)(&told.unwrap_or_else(|error| format!("warning: no screenshot: {error}")));
                    }
                    if compared {
                        desk.compare(&self.subject, camera, &picture);
                        window.request_redraw();
                    }
                }
                fit
            }
            Outcome::Nothing(fit) => {
                (self.screenshot, self.compare) = (kept, compared);
                self.again = (fit == Fit::Exact).then(|| Instant::now() + AGAIN);
                fit
            }
        };
        self.suit(fit)
    }

    /// Sees to it that the next frame has a swapchain that suits the surface.
    fn suit(&mut self, fit: Fit) -> Result<(), Error> {
        match fit {
            Fit::Exact => self.content = false,
            Fit::Suboptimal if self.content => {}
            Fit::Suboptimal => (self.unfit, self.content) = (true, true),
            Fit::OutOfDate => self.unfit = true,
            Fit::SurfaceLost => self.replace_surface()?,
        }
        if self.unfit {
            self.ask_for_frame();
        }
        Ok(())
    }

    fn replace_surface(&mut self) -> Result<(), Error> {
        if let (Some(window), Some(presenter)) = (&self.window, &mut self.presenter) {
            presenter.replace_surface(Surface::new(&self.device, window.clone())?);
            self.unfit = true;
        }
        Ok(())
    }

    /// A frame, and once more with a new surface if the old one is lost.
    fn draw_on_a_surface(&mut self) -> Result<(), Error> {
        match self.draw() {
            Err(Error::Frame(frame::Error::Gpu(gpu::Error::Vulkan { result, .. })))
                if result == vk::Result::ERROR_SURFACE_LOST_KHR =>
            {
                self.replace_surface()?;
                self.draw()
            }
            drawn => drawn,
        }
    }

    fn redraw(&mut self, events: &ActiveEventLoop) {
        if let Err(error) = self.draw_on_a_surface() {
            self.failure = Some(error);
            events.exit();
            return;
        }
        if self.options.frames.is_some_and(|frames| self.clock.frames() >= u64::from(frames)) {
            events.exit();
        }
        self.write_title();
    }

    fn write_title(&mut self) {
        let (Some(interval), Some(window)) = (self.clock.tells(Instant::now()), &self.window) else { return };
        let times = self.presenter.as_ref().map(Presenter::times).unwrap_or_default();
        let gpu = times.gpu_ms.map(|ms| format!(", GPU {ms:.2}")).unwrap_or_default();
        let times = format!("{interval:.2} ms a frame, CPU {:.2}{gpu}", times.record_ms);
        window.set_title(&title(&self.subject.scene, Some(&times)));
    }

    /// Whether frames follow each other without a pause.
    fn goes_on(&self) -> bool {
        !self.hidden && (self.options.frames.is_some() || self.control.is_moving(self.held))
    }

    fn press(&mut self, events: &ActiveEventLoop, key: KeyCode) {
        match action(key, self.with_control, self.with_shift) {
            Some(Action::Quit) => {
                if !self.desk.as_mut().is_some_and(Desk::clear) {
                    events.exit();
                }
            }
            Some(Action::Help) => {
                (self.options.tell)(&help());
                self.open_panels(|controls| controls.keys = !controls.keys);
            }
            Some(Action::Panels) => self.open_panels(|controls| controls.shown = !controls.shown),
            Some(Action::View { back }) => {
                if let (Some(desk), Some(presenter)) = (&mut self.desk, &mut self.presenter) {
                    self.unfit |= desk.turn_view(presenter, &mut self.subject, back);
                    (self.options.tell)(&format!("view: {}", self.subject.settings.view));
                }
            }
            Some(Action::Record) => self.record(),
            Some(Action::Compare) => self.open_panels(|controls| controls.asks_truth = true),
            Some(Action::Reset) => self.control.reset(),
            Some(Action::Orbit) => {
                self.control.toggle_orbit();
                let mode = match self.control.mode() {
                    Mode::Fly => "fly",
                    Mode::Orbit => "orbit",
                };
                (self.options.tell)(&format!("camera: {mode}"));
            }
            Some(Action::Screenshot) => self.screenshot = true,
            Some(Action::Bookmark(number)) => {
                self.control.bookmark(number);
                (self.options.tell)(&format!("camera {} is kept", number + 1));
            }
            Some(Action::Recall(number)) => {
                if !self.control.recall(number) {
                    (self.options.tell)(&format!("no camera is kept as {0}: Ctrl+{0} keeps one", number + 1));
                }
            }
            None => return,
        }
        self.ask_for_frame();
    }

    fn open_panels(&mut self, change: impl FnOnce(&mut Controls)) {
        if let Some(desk) = &mut self.desk {
            change(&mut desk.controls);
        }
    }

    /// Begins to record the camera's path, or ends it and writes it.
    fn record(&mut self) {
        let Some(recorder) = self.recording.take() else {
            self.recording = Some(Recorder::new(Instant::now(), *self.control.camera()));
            return (self.options.tell)("path: recording, until K is pressed again");
        };
        let path = recorder.end(Instant::now(), *self.control.camera());
        let told = path.map_err(|error| error.to_string()).and_then(|path| (self.options.keep_path)(&path));
        (self.options.tell)(&told.unwrap_or_else(|error| format!("warning: no path: {error}")));
    }

    /// Asks what is under the mouse.
    fn pick(&mut self) {
        if let (Some(desk), Some(window)) = (&mut self.desk, &self.window) {
            let PhysicalSize { width, height } = window.inner_size();
            let view = View { camera: *self.control.camera(), size: [width, height] };
            desk.pick(&self.subject, view, self.mouse);
        }
    }

    fn drag(&mut self, position: PhysicalPosition<f64>) {
        self.mouse = DVec2::new(position.x, position.y);
        if !self.dragging {
            return;
        }
        let height = self.window.as_ref().map_or(1, |window| window.inner_size().height.max(1));
        if let Some(last) = self.dragged.replace(position) {
            let part = |pixels: f64| pixels / f64::from(height);
            self.way += (position.x - last.x).abs() + (position.y - last.y).abs();
            self.control.drag(part(position.x - last.x), part(position.y - last.y));
            self.ask_for_frame();
        }
    }
}

impl ApplicationHandler for App<'_> {
    fn resumed(&mut self, events: &ActiveEventLoop) {
        events.set_control_flow(ControlFlow::Wait);
        if self.window.is_some() {
            return;
        }
        if let Err(error) = self.open(events) {
            self.failure = Some(error);
            events.exit();
        }
    }

    fn window_event(&mut self, events: &ActiveEventLoop, _: WindowId, event: WindowEvent) {
        if let (Some(desk), Some(window)) = (&mut self.desk, &self.window) {
            let taken = desk.event(window, &event);
            if taken.changes {
                self.ask_for_frame();
            }
            // A button that was pressed over the picture may be let go over a panel.
            let lets_go = matches!(event, WindowEvent::MouseInput { state: ElementState::Released, .. });
            if taken.consumed && !lets_go {
                return;
            }
        }
        match event {
            WindowEvent::CloseRequested => events.exit(),
            WindowEvent::Destroyed => {
                // Not by us: our window lives until the loop has ended.
                self.failure.get_or_insert_with(|| Error::System("the window was destroyed".into()));
                events.exit();
            }
            WindowEvent::Resized(_) | WindowEvent::ScaleFactorChanged { .. } => {
                (self.unfit, self.content, self.hidden) = (true, false, false);
                self.ask_for_frame();
            }
            WindowEvent::Occluded(occluded) => {
                self.hidden = occluded;
                self.ask_for_frame();
            }
            WindowEvent::RedrawRequested => self.redraw(events),
            WindowEvent::Focused(false) => (self.held, self.dragging, self.with_control) = Default::default(),
            WindowEvent::ModifiersChanged(modifiers) => {
                (self.with_control, self.with_shift) = (modifiers.state().control_key(), modifiers.state().shift_key());
            }
            WindowEvent::KeyboardInput { event, .. } => {
                let PhysicalKey::Code(key) = event.physical_key else { return };
                let pressed = event.state == ElementState::Pressed;
                if hold(&mut self.held, key, pressed) {
                    self.ask_for_frame();
                } else if pressed && !event.repeat {
                    self.press(events, key);
                }
            }
            WindowEvent::MouseInput { state, button: button @ (MouseButton::Left | MouseButton::Right), .. } => {
                let pressed = state == ElementState::Pressed;
                // Who lets go where it was pressed has clicked.
                if !pressed && self.dragging && button == MouseButton::Left && self.way < CLICK {
                    self.pick();
                }
                (self.dragging, self.dragged, self.way) = (pressed, None, 0.0);
            }
            WindowEvent::CursorMoved { position, .. } => self.drag(position),
            WindowEvent::MouseWheel { delta, .. } => {
                self.control.wheel(match delta {
                    MouseScrollDelta::LineDelta(_, lines) => f64::from(lines),
                    MouseScrollDelta::PixelDelta(pixels) => pixels.y / PIXELS_A_NOTCH,
                });
                self.ask_for_frame();
            }
            _ => {}
        }
    }

    fn user_event(&mut self, _: &ActiveEventLoop, (): ()) {
        // An answer has come.
        if let Some(desk) = &mut self.desk {
            desk.listen(self.control.camera());
        }
        self.ask_for_frame();
    }

    fn exiting(&mut self, _: &ActiveEventLoop) {
        // While the connection to the window system is open.
        (self.desk, self.presenter, self.window) = (None, None, None);
    }

    fn about_to_wait(&mut self, events: &ActiveEventLoop) {
        let now = Instant::now();
        let flow = match self.again {
            Some(again) if again > now => ControlFlow::WaitUntil(again),
            _ => {
                let again = self.again.take().is_some();
                if again || self.goes_on() {
                    self.ask_for_frame();
                } else {
                    self.clock.pause();
                }
                ControlFlow::Wait
            }
        };
        events.set_control_flow(flow);
    }
}

/// Tells when frames are not shown as they were asked to be.
fn tell_mode(presenter: &Presenter, options: &Options) {
    if let Some(mode) = presenter.present_mode().filter(|&mode| !options.vsync.is(mode)) {
        let vsync = format!("{:?}", options.vsync).to_lowercase();
        (options.tell)(&format!("warning: this window has no --vsync {vsync}: frames follow each other by {mode:?}"));
    }
}

fn title(scene: &Scene, times: Option<&str>) -> String {
    let times = times.map(|times| format!(" - {times}")).unwrap_or_default();
    format!("{} - Afterlight{times}", scene.name)
}

/// The keys, one a line.
pub fn help() -> String {
    let widest = HELP.iter().map(|(keys, _)| keys.len()).max().unwrap_or(0);
    let line = |(keys, what): &(&str, &str)| format!("  {keys:widest$}  {what}");
    let lines: Vec<String> = HELP.iter().map(line).collect();
    format!("Keys\n{}", lines.join("\n"))
}
