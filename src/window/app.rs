//! A window and what it shows. A frame is drawn when something has changed, and otherwise never.

mod events;
mod reload;
mod split;

use std::sync::Arc;
use std::time::{Duration, Instant};

use glam::DVec2;
use winit::dpi::{PhysicalPosition, PhysicalSize};
use winit::event_loop::ActiveEventLoop;
use winit::keyboard::KeyCode;
use winit::window::Window;

use super::camera::{CameraControl, Held, Mode};
use super::clock::{Clock, Summary};
use super::controls::Controls;
use super::keys::{Action, HELP, action};
use super::recorder::Recorder;
use super::subject::Subject;
use super::user_interface::UserInterface;
use super::watch::Watch;
use super::{Error, Options, surface_of};
use crate::frame::{self, Fitted, Outcome, Presenter};
use crate::gpu::{self, Device, Fit, vk};
use crate::reference::View;
use crate::scene::{Scene, Settings};

/// Pixels that a wheel which tells its way in pixels goes for a notch.
const PIXELS_A_NOTCH: f64 = 40.0;
/// Pixels that the mouse may go while a button is held down for a click.
const CLICK: f64 = 4.0;
/// How far a camera goes that begins to move, so that the first frame shows it.
const FIRST: Duration = Duration::from_micros(16_667);
/// When an image is asked for again that was not to be had.
const AGAIN: Duration = Duration::from_millis(50);

/// A window and what it shows.
pub struct App<'a> {
    device: Arc<Device>,
    subject: Subject,
    options: Options<'a>,
    control: CameraControl,
    /// Before the scene was read again with another camera, until frames are made of it.
    control_before: Option<CameraControl>,
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
    /// The light of the picture is to be kept.
    light: bool,
    /// Frames must be made for the window and its subject as they are now.
    unfit: bool,
    /// Because the swapchain is not of the window's size, or not of its surface: those before cannot go on meanwhile.
    misfit: bool,
    /// Nobody can see the window.
    hidden: bool,
    /// A new swapchain did not suit better than the one before: that is left alone until the window changes.
    content: bool,
    /// When to try again.
    again: Option<Instant>,
    // Before the window: a surface that it still holds would outlive it.
    presenter: Option<Presenter>,
    window: Option<Arc<Window>>,
    interface: Option<UserInterface>,
    /// The camera's path, while it is recorded.
    recording: Option<Recorder>,
    /// Up to when the camera has moved, unless it has rested since.
    advanced: Option<Instant>,
    /// The size that frames were last made for.
    fitted: Option<[u32; 2]>,
    /// Whether they show more than white, as it was last told.
    told_hdr: Option<bool>,
    /// The next frame's picture is to be compared with the truth.
    compare: bool,
    wake: Arc<dyn Fn() + Send + Sync>,
    /// None where the system does not tell of changes.
    watch: Option<Watch>,
    failure: Option<Error>,
}

impl<'a> App<'a> {
    /// `wake` makes the loop call `user_event` ([`events`]).
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
            control_before: None,
            held: Held::default(),
            with_control: false,
            with_shift: false,
            dragged: None,
            dragging: false,
            way: 0.0,
            mouse: DVec2::ZERO,
            clock: Clock::default(),
            screenshot: false,
            light: false,
            unfit: true,
            misfit: true,
            hidden: false,
            content: false,
            again: None,
            presenter: None,
            window: None,
            interface: None,
            recording: None,
            advanced: None,
            fitted: None,
            told_hdr: None,
            compare: false,
            wake,
            watch: None,
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
        let surface = surface_of(&self.device, &window)?;
        let mut presenter =
            Presenter::new(&self.device, surface, &self.subject.scene, &self.subject.settings, self.options.vsync)?;
        if let Some(nits) = self.options.hdr {
            presenter = presenter.with_hdr(nits);
        }
        self.interface = Some(UserInterface::new(&self.device, &window, Arc::clone(&self.wake)));
        self.watch_files();
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
        let (Some(window), Some(presenter), Some(interface)) = (&self.window, &mut self.presenter, &mut self.interface)
        else {
            return Ok(());
        };
        let now = Instant::now();
        let since = self.advanced.replace(now).map_or(FIRST, |last| now.duration_since(last));
        self.control.advance(since.as_secs_f64(), self.held);
        let camera = *self.control.camera();
        // A camera that is zoomed may look more closely than the plan was made for.
        self.misfit |= presenter.check_camera(&camera).is_err();
        self.unfit |= self.misfit || presenter.is_made();
        if let Some(recording) = &mut self.recording {
            recording.take(now, camera);
        }
        interface.listen(&camera);
        let mut panels = None;
        let known = (&mut *presenter, &self.clock);
        if let Some((shown, delay, unfit)) = interface.show(window, known, (&mut self.subject, &camera)) {
            panels = Some(shown);
            self.unfit |= unfit;
            self.again = now.checked_add(delay).filter(|_| delay < Duration::from_secs(60));
        }
        if std::mem::take(&mut interface.controls.asks_truth) {
            self.compare = !interface.is_comparing();
            interface.end_comparison();
            // Only one picture is compared.
            self.unfit |= interface.unsplit(presenter);
        }
        if self.unfit && !self.fit_frames()? {
            return Ok(());
        }
        let (Some(window), Some(presenter), Some(interface)) = (&self.window, &mut self.presenter, &mut self.interface)
        else {
            return Ok(());
        };
        let camera = *self.control.camera();
        // Pictures are of the frames that were asked for.
        let waits = presenter.is_pending();
        if !waits && std::mem::take(&mut self.light) {
            match interface.stepper().is_open() {
                true => (self.options.tell)("warning: no screenshot: a step of the frame has no light of its own"),
                false => split::keep_light(presenter, &self.subject, &camera, &self.options),
            }
        }
        presenter.divide_at(interface.divider.at());
        let mut kept = !waits && std::mem::take(&mut self.screenshot);
        let mut compared = !waits && std::mem::take(&mut self.compare);
        if compared && presenter.shows_hdr() == Some(true) {
            split::compare_up_to_white(presenter, interface, (&self.subject, &camera), &self.options);
            (compared, self.again) = (false, Some(now));
        }
        if (kept || compared) && !presenter.can_copy() {
            (self.options.tell)("warning: no picture: this window's images cannot be copied from");
            (kept, compared) = (false, false);
        }
        let copied = kept || compared;
        if let Some(panels) = &mut panels {
            interface.send_textures(panels, presenter);
        }
        window.pre_present_notify();
        let fit = match presenter.draw(&camera, copied, panels.as_ref())? {
            Outcome::Shown(fit) => {
                // From where time was taken last, so that none is lost.
                self.clock.frame(now, &presenter.times());
                interface.drawn();
                if copied {
                    let picture = presenter.picture()?;
                    if kept {
                        let told = (self.options.keep)(&picture);
                        (self.options.tell)(&told.unwrap_or_else(|error| format!("warning: no screenshot: {error}")));
                    }
                    if compared {
                        interface.compare(&self.subject, camera, &picture);
                        window.request_redraw();
                    }
                }
                fit
            }
            Outcome::Nothing(fit) => {
                (self.screenshot, self.compare) = (self.screenshot || kept, self.compare || compared);
                self.again = (fit == Fit::Exact && !self.hidden).then(|| Instant::now() + AGAIN);
                fit
            }
        };
        self.suit(fit)
    }

    /// Makes the frames for the window and its subject as they are; where that cannot be, as they were. False while the window has no pixels.
    fn fit_frames(&mut self) -> Result<bool, Error> {
        let (Some(window), Some(presenter), Some(interface)) = (&self.window, &mut self.presenter, &mut self.interface)
        else {
            return Ok(false);
        };
        let PhysicalSize { width, height } = window.inner_size();
        let (subject, size, begun) = (&mut self.subject, [width, height], Instant::now());
        subject.come_near(self.control.camera());
        let drawn = interface.stepper().drawn_settings(&subject.settings);
        let was_pending = presenter.is_pending();
        let fitted = match self.misfit || self.fitted != Some(size) {
            true => presenter.fit(&subject.scene, &drawn, size).map(at_once),
            false => presenter.fit_later(&subject.scene, &drawn, &self.wake),
        };
        let fits = match fitted {
            Err(error) if interface.take_back(presenter, subject, &error) => {
                (self.options.tell)(&format!("warning: {error}"));
                // The reason is shown with the next one.
                window.request_redraw();
                if let Some(before) = self.control_before.take() {
                    self.control = before;
                }
                subject.come_near(self.control.camera());
                at_once(presenter.fit(&subject.scene, &subject.settings, size)?)
            }
            fitted => fitted?,
        };
        match fits {
            Fitted::Taken | Fitted::AtOnce => {}
            Fitted::Pending => {
                self.unfit = false;
                if !was_pending {
                    // The panels of this frame do not tell of it yet.
                    window.request_redraw();
                }
                return Ok(true);
            }
            Fitted::Nothing => {
                self.clock.pause();
                (self.advanced, self.again, self.hidden) = (None, None, true);
                return Ok(false);
            }
        }
        if was_pending {
            // The panels of this frame still tell of the ones before.
            window.request_redraw();
        }
        self.control_before = None;
        let told = presenter.shows_hdr();
        if self.options.hdr.is_some() && std::mem::replace(&mut self.told_hdr, told) != told && told == Some(false) {
            (self.options.tell)("warning: this window has no --hdr: nothing in it is brighter than white");
        }
        match self.fitted.replace(size) {
            None => tell_mode(presenter, &self.options),
            Some(before) if before != size => self.clock.resized(begun.elapsed()),
            Some(_) => {}
        }
        if let Some(why) = interface.fitted(presenter, subject) {
            (self.options.tell)(&format!("warning: {why}"));
            window.request_redraw();
        }
        #[cfg(feature = "hot-reload")]
        if let Some(watch) = &self.watch {
            watch.fitted();
        }
        (self.unfit, self.misfit, self.hidden) = (false, false, false);
        Ok(true)
    }

    /// Sees to it that the next frame has a swapchain that suits the surface.
    fn suit(&mut self, fit: Fit) -> Result<(), Error> {
        match fit {
            Fit::Exact => self.content = false,
            Fit::Suboptimal if self.content => {}
            Fit::Suboptimal => (self.misfit, self.content) = (true, true),
            Fit::OutOfDate => self.misfit = true,
            Fit::SurfaceLost => self.replace_surface()?,
        }
        if self.misfit {
            self.ask_for_frame();
        }
        Ok(())
    }

    fn replace_surface(&mut self) -> Result<(), Error> {
        if let (Some(window), Some(presenter)) = (&self.window, &mut self.presenter) {
            presenter.lose_surface();
            presenter.replace_surface(surface_of(&self.device, window)?)?;
            self.misfit = true;
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
        // Where it was until now: from there it may jump.
        if let Some(recording) = &mut self.recording {
            recording.take(Instant::now(), *self.control.camera());
        }
        match action(key, self.with_control, self.with_shift) {
            Some(Action::Quit) => {
                let ended = match (&mut self.interface, &mut self.presenter) {
                    (Some(interface), Some(presenter)) if interface.stepper().is_open() => {
                        self.unfit |= interface.end_steps(presenter, &self.subject);
                        true
                    }
                    (interface, _) => interface.as_mut().is_some_and(UserInterface::clear),
                };
                if !ended {
                    events.exit();
                }
            }
            Some(Action::Help) => {
                (self.options.tell)(&help());
                self.open_panels(|controls| controls.keys = !controls.keys);
            }
            Some(Action::Panels) => self.open_panels(|controls| controls.shown = !controls.shown),
            Some(Action::View { back }) => {
                if let (Some(interface), Some(presenter)) = (&mut self.interface, &mut self.presenter) {
                    self.unfit |= interface.turn_view(presenter, &mut self.subject, back);
                    (self.options.tell)(&format!("view: {}", self.subject.settings.view));
                }
            }
            Some(Action::Step { back }) => {
                if let (Some(interface), Some(presenter)) = (&mut self.interface, &mut self.presenter) {
                    self.unfit |= interface.step(presenter, &self.subject, back);
                    (self.options.tell)(&interface.stepper().line(&self.subject.scene));
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
            Some(Action::Light) => self.light = true,
            Some(Action::Split { next }) => self.split(next),
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
        if let Some(interface) = &mut self.interface {
            change(&mut interface.controls);
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
        if let (Some(interface), Some(window)) = (&mut self.interface, &self.window) {
            let PhysicalSize { width, height } = window.inner_size();
            let view = View { camera: *self.control.camera(), size: [width, height] };
            interface.pick(&self.subject, view, self.mouse);
        }
    }

    fn drag(&mut self, position: PhysicalPosition<f64>) {
        self.mouse = DVec2::new(position.x, position.y);
        if self.drag_divider() || !self.dragging {
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

fn at_once(fits: bool) -> Fitted {
    if fits { Fitted::AtOnce } else { Fitted::Nothing }
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
