//! A window and its contents. A frame is drawn when something has changed, and otherwise never.

mod clips;
mod events;
mod input;
mod pace;
mod reload;
mod split;
mod work;

pub use input::help;

use std::sync::Arc;
use std::time::{Duration, Instant};

use glam::DVec2;
use winit::dpi::{PhysicalPosition, PhysicalSize};
use winit::event_loop::ActiveEventLoop;
#[cfg(all(unix, not(target_vendor = "apple")))]
use winit::platform::wayland::WindowAttributesExtWayland;
use winit::window::Window;

use super::camera::{CameraControl, HeldKeys};
use super::clock::{Clock, Summary};
use super::icon::icon;
use super::live_scene::LiveScene;
use super::messages::{Busy, Teller};
use super::player::Player;
use super::recorder::Recorder;
use super::resolution::Resolution;
use super::user_interface::UserInterface;
use super::watch::Watch;
use super::{DrawnWindow, Error, WindowOptions, drawn, surface_of};
use afterlight::frame::{self, FitOutcome, Outcome, Presenter};
use afterlight::gpu::{self, Device, Fit, Vsync, vk};
use afterlight::passes::overlay::Panels;
use afterlight::scene::{Scene, Settings};

/// The time that a camera is taken forward as it begins to move, so that the first frame shows it.
const FIRST: Duration = Duration::from_micros(16_667);
/// The time after which an image that was not available is asked for again.
const AGAIN: Duration = Duration::from_millis(50);
/// The time after which frames that lacked memory are tried again.
const AGAIN_FOR_MEMORY: Duration = Duration::from_millis(500);
/// The number of these tries in a window that closes by itself. Another one waits for its user, who can make it smaller or close it.
const TRIES_FOR_MEMORY: u32 = 20;

/// The system's window, with its presenter and its interface.
struct Opened {
    interface: UserInterface,
    // Declared before the window, so dropped first: a surface that it still holds would outlive the window.
    presenter: Presenter,
    /// The window for the driver. A lost surface is replaced by one of the same connection: Mesa knows connections by their addresses, and a new one may have
    /// the address of one that was closed. Mesa would then not ask it again which extensions it has, and its requests would fail.
    drawn: Arc<DrawnWindow>,
    window: Arc<Window>,
}

/// The purposes for which a frame's picture is copied.
#[derive(Clone, Copy)]
struct CopyPurposes {
    kept: bool,
    compared: bool,
}

/// A window and its subject.
pub struct App<'a> {
    device: Arc<Device>,
    live: LiveScene,
    options: WindowOptions<'a>,
    teller: Teller<'a>,
    /// The work in the background that has a sign.
    busy: Busy,
    /// The last frame was a sign of work: the next one does that.
    is_announced: bool,
    /// The time of the last frame that had all pixels of the window, and their number.
    whole_took: Option<(Duration, f64)>,
    /// This frame shows another moment of the scene, or other lights, than the one before, as while the user drags a slider.
    has_changed: bool,
    control: CameraControl,
    /// Before the scene was read again with another camera, until frames are made of it.
    control_before: Option<CameraControl>,
    held: HeldKeys,
    with_control: bool,
    with_shift: bool,
    /// The last place of the mouse, while a button is held down.
    dragged: Option<PhysicalPosition<f64>>,
    dragging: bool,
    /// Pixels that it has gone since.
    way: f64,
    /// The mouse's place.
    mouse: DVec2,
    clock: Clock,
    resolution: Resolution,
    /// The times in the title.
    told_times: Option<String>,
    /// The title says that there is no picture yet.
    is_opening: bool,
    /// The size of the picture in the title.
    told_coarse: Option<[u32; 2]>,
    screenshot: bool,
    /// The light of the picture is to be kept.
    light: bool,
    /// Frames must be made for the window and its subject as they are now.
    unfit: bool,
    /// Frames are unfit because the swapchain does not have the window's size or is not of its surface: the old frames cannot go on meanwhile.
    misfit: bool,
    /// Nobody can see the window.
    hidden: bool,
    /// A new swapchain did not suit better than the one before: that is left alone until the window changes.
    content: bool,
    /// The moment of the next try or redraw, while nothing moves.
    again: Option<Instant>,
    /// Frames in a row that lacked memory.
    lacked_memory: u32,
    opened: Option<Opened>,
    /// The camera's path, while it is recorded.
    recording: Option<Recorder>,
    /// The moment up to which the camera has moved, unless it has rested since.
    advanced: Option<Instant>,
    /// The size that frames were last made for.
    fitted: Option<[u32; 2]>,
    /// True if they show more than white; as it was last told.
    told_hdr: Option<bool>,
    /// It was told that something cannot move.
    told_motion: bool,
    /// The next frame's picture is to be compared with the truth.
    compare: bool,
    wake: Arc<dyn Fn() + Send + Sync>,
    /// `None` if the system does not report changes of files.
    watch: Option<Watch>,
    failure: Option<Error>,
}

impl<'a> App<'a> {
    /// `wake` makes the loop call `user_event` ([`events`]).
    pub fn new(
        device: &Arc<Device>,
        (scene, settings): (Scene, Settings),
        options: WindowOptions<'a>,
        wake: Arc<dyn Fn() + Send + Sync>,
    ) -> Self {
        let control = CameraControl::of_scene(&scene);
        let mut subject = LiveScene::new(scene, settings);
        let player = Player::new(&subject.scene.motion, options.playing.clone(), options.rests);
        subject.player = player.emitting(!subject.scene.emitters.is_empty(), options.rests);
        Self {
            device: device.clone(),
            live: subject,
            resolution: Resolution::new(options.dynamic_resolution),
            // Frames that are measured have nothing over the picture.
            teller: Teller::new(options.tell, options.messages && options.frames.is_none()),
            busy: Busy::default(),
            is_announced: false,
            whole_took: None,
            has_changed: false,
            options,
            control,
            control_before: None,
            held: HeldKeys::default(),
            with_control: false,
            with_shift: false,
            dragged: None,
            dragging: false,
            way: 0.0,
            mouse: DVec2::ZERO,
            clock: Clock::default(),
            told_times: None,
            is_opening: true,
            told_coarse: None,
            screenshot: false,
            light: false,
            unfit: true,
            misfit: true,
            hidden: false,
            content: false,
            again: None,
            lacked_memory: 0,
            opened: None,
            recording: None,
            advanced: None,
            fitted: None,
            told_hdr: None,
            told_motion: false,
            compare: false,
            wake,
            watch: None,
            failure: None,
        }
    }

    /// Returns a summary of the frames, or the error that ended the window.
    pub fn end(mut self) -> Result<Summary, Error> {
        match self.failure.take() {
            Some(failure) => Err(failure),
            None => Ok(self.clock.summary()),
        }
    }

    fn open(&mut self, events: &ActiveEventLoop) -> Result<(), Error> {
        let [width, height] = self.live.settings.size;
        let attributes = Window::default_attributes()
            .with_title(pace::title(&self.live.scene, Some("the first picture is made...")))
            .with_window_icon(icon(self.options.icon))
            .with_inner_size(PhysicalSize::new(width, height));
        // The name of `assets/afterlight.desktop`, from which Wayland takes the icon: the app id there, the class on X11.
        #[cfg(all(unix, not(target_vendor = "apple")))]
        let attributes = WindowAttributesExtWayland::with_name(attributes, "afterlight", "afterlight");
        let window = events.create_window(attributes).map_err(|error| Error::System(error.to_string()))?;
        let window = Arc::new(window);
        let drawn = drawn(&window)?;
        let surface = surface_of(&self.device, &drawn)?;
        let mut presenter =
            Presenter::new(&self.device, surface, &self.live.scene, &self.live.settings, self.options.vsync)?;
        if let Some(nits) = self.options.hdr {
            presenter = presenter.with_hdr(nits);
        }
        presenter = match (self.options.dynamic_resolution, self.options.frames) {
            (true, _) => presenter.with_dynamic_resolution(),
            // Panels, messages and the divider change over a picture that is kept.
            (false, None) => presenter.with_kept_pictures(),
            // Frames that are measured are all drawn, and cost no copy.
            (false, Some(_)) => presenter,
        };
        let interface = UserInterface::new(&self.device, &window, &self.options, Arc::clone(&self.wake));
        self.watch_files();
        for warning in self.live.scene.warnings.iter().take(reload::WARNINGS) {
            // They were printed when the scene was read.
            self.teller.show(&format!("warning: {warning}"));
        }
        self.opened = Some(Opened { interface, presenter, drawn, window });
        self.ask_for_frame();
        Ok(())
    }

    fn ask_for_frame(&self) {
        if let Some(opened) = &self.opened {
            opened.window.request_redraw();
        }
    }

    /// Draws a frame, with a swapchain that fits, and keeps its picture if that was asked for.
    fn draw(&mut self) -> Result<(), Error> {
        let now = Instant::now();
        self.move_camera(now);
        if self.announce(now)? {
            return Ok(());
        }
        let panels = self.show_panels(now, None);
        if self.unfit && !self.fit_frames()? {
            return Ok(());
        }
        self.play(now);
        self.has_changed |= self.live.player.take_moved();
        let copies = self.wanted_copies(now);
        self.choose_resolution(now, copies)?;
        self.has_changed = false;
        self.present(now, panels, copies)
    }

    fn move_camera(&mut self, now: Instant) {
        let Some(opened) = &mut self.opened else { return };
        let since = self.advanced.replace(now).map_or(FIRST, |last| now.duration_since(last));
        self.control.advance(since.as_secs_f64(), self.held);
        let camera = *self.control.camera();
        // A camera that is zoomed may look more closely than the plan was made for.
        self.misfit |= opened.presenter.check_camera(&camera).is_err();
        self.unfit |= self.misfit || opened.presenter.is_made();
        if let Some(recording) = &mut self.recording {
            recording.take(now, camera);
        }
    }

    /// Builds the panels, with a sign of work, and makes the changes that are made there.
    fn show_panels(&mut self, now: Instant, sign: Option<&str>) -> Option<Panels> {
        let (background, due) = self.background_work(now);
        let notes = self.teller.notes(now, sign.or(background));
        let Opened { window, presenter, interface, .. } = self.opened.as_mut()?;
        let camera = *self.control.camera();
        interface.listen(&camera);
        let known = (&mut *presenter, &self.clock);
        let shown = interface.show(window, known, (&mut self.live, &camera), &notes);
        let panels = shown.map(|(panels, delay, unfit)| {
            self.unfit |= unfit;
            self.again = now.checked_add(delay).filter(|_| delay < Duration::from_secs(60));
            panels
        });
        self.again = [self.again, due].into_iter().flatten().min();
        self.has_changed |= interface.take_moved();
        if std::mem::take(&mut interface.controls.asks_truth) {
            self.compare = !interface.is_comparing();
            interface.end_comparison();
            // Only one picture is compared.
            self.unfit |= interface.unsplit(presenter);
        }
        panels
    }

    /// Returns the purposes for which the next picture is copied. Light is kept at once, and so is a picture that ends at white compared.
    fn wanted_copies(&mut self, now: Instant) -> CopyPurposes {
        let none = CopyPurposes { kept: false, compared: false };
        let Some(Opened { presenter, interface, .. }) = &mut self.opened else { return none };
        // Pictures are of the frames that were asked for.
        if presenter.is_pending() {
            return none;
        }
        let camera = *self.control.camera();
        if std::mem::take(&mut self.light) {
            match interface.stepper().is_open() {
                true => self.teller.tell("warning: no screenshot: a step of the frame has no light of its own"),
                false => split::keep_light(presenter, &self.live, &camera, (&self.options, &self.teller)),
            }
        }
        let kept = std::mem::take(&mut self.screenshot);
        let mut compared = std::mem::take(&mut self.compare);
        if compared && presenter.shows_hdr() == Some(true) {
            split::compare_up_to_white(presenter, interface, (&self.live, &camera), &self.teller);
            (compared, self.again) = (false, Some(now));
        }
        if (kept || compared) && !presenter.can_copy() {
            self.teller.tell("warning: no picture: this window's images cannot be copied from");
            return none;
        }
        CopyPurposes { kept, compared }
    }

    fn present(&mut self, now: Instant, mut panels: Option<Panels>, copies: CopyPurposes) -> Result<(), Error> {
        let Some(Opened { window, presenter, interface, .. }) = &mut self.opened else { return Ok(()) };
        let (camera, copied) = (*self.control.camera(), copies.kept || copies.compared);
        presenter.divide_at(interface.divider.at());
        if let Some(panels) = &mut panels {
            interface.send_textures(panels, presenter);
        }
        window.pre_present_notify();
        // Frames that are measured are all drawn.
        let is_again = self.options.frames.is_none() && presenter.keeps(&camera);
        let drawn = match is_again {
            true => presenter.show_again(copied, panels.as_ref()),
            false => presenter.draw(&camera, copied, panels.as_ref()),
        };
        let drawn = drawn.and_then(|outcome| match outcome {
            Outcome::Shown(_) if copied => Ok((outcome, Some(presenter.picture()?))),
            outcome => Ok((outcome, None)),
        });
        if !matches!(drawn, Ok((Outcome::Shown(_), _))) {
            // Another frame is copied in place of this one, also after a lack of memory.
            (self.screenshot, self.compare) = (self.screenshot || copies.kept, self.compare || copies.compared);
        }
        let fit = match drawn? {
            (Outcome::Shown(fit), picture) => {
                match is_again {
                    // A picture that is shown again says nothing about the time of frames.
                    true => self.clock.pause(),
                    // Counts from the last measurement, so that no time is lost.
                    false => self.clock.frame(now, &presenter.times()),
                }
                interface.drawn();
                self.teller.shown();
                for line in interface.hear() {
                    self.teller.tell(&line);
                    window.request_redraw();
                }
                if let Some(picture) = picture {
                    if copies.kept {
                        let told = (self.options.keep)(&picture);
                        // The next frame shows the message.
                        window.request_redraw();
                        self.teller.tell(&told.unwrap_or_else(|error| format!("warning: no screenshot: {error}")));
                    }
                    if copies.compared {
                        interface.compare(&self.live, camera, &picture);
                        window.request_redraw();
                    }
                }
                fit
            }
            (Outcome::Nothing(fit), _) => {
                self.again = (fit == Fit::Exact && !self.hidden).then(|| Instant::now() + AGAIN);
                fit
            }
        };
        self.fit_swapchain(fit)
    }

    /// Makes the frames for the window and its subject as they are; where that cannot be, as they were. False while the window has no pixels.
    fn fit_frames(&mut self) -> Result<bool, Error> {
        let Some(Opened { window, presenter, .. }) = &mut self.opened else { return Ok(false) };
        let (begun, was_pending) = (Instant::now(), presenter.is_pending());
        let PhysicalSize { width, height } = window.inner_size();
        let size = [width, height];
        match self.fit_or_take_back(size)? {
            FitOutcome::Taken | FitOutcome::AtOnce => self.live.player.show_again(),
            FitOutcome::Pending => {
                self.unfit = false;
                if !was_pending {
                    // The panels of this frame do not tell of it yet.
                    self.ask_for_frame();
                }
                return Ok(true);
            }
            FitOutcome::Nothing => {
                self.clock.pause();
                (self.advanced, self.again, self.hidden) = (None, None, true);
                return Ok(false);
            }
        }
        if was_pending {
            // The panels of this frame still tell of the ones before.
            self.ask_for_frame();
        }
        let before = self.fitted.replace(size);
        if before.is_some_and(|before| before != size) {
            self.clock.resized(begun.elapsed());
        }
        self.tell_fitted(before.is_none());
        #[cfg(feature = "hot-reload")]
        if let Some(watch) = &self.watch {
            watch.fitted();
        }
        self.control_before = None;
        // Frames of other settings take another time.
        self.whole_took = None;
        self.resolution.forget_times();
        (self.unfit, self.misfit, self.hidden) = (false, false, false);
        Ok(true)
    }

    fn fit_or_take_back(&mut self, size: [u32; 2]) -> Result<FitOutcome, Error> {
        let Some(Opened { window, presenter, interface, .. }) = &mut self.opened else {
            return Ok(FitOutcome::Nothing);
        };
        let subject = &mut self.live;
        subject.come_near(self.control.camera());
        let drawn = interface.stepper().drawn_settings(&subject.settings);
        let fitted = match self.misfit || self.fitted != Some(size) {
            true => presenter.fit(&subject.scene, &drawn, size).map(at_once),
            false => presenter.fit_later(&subject.scene, &drawn, &self.wake),
        };
        match fitted {
            Err(error) if interface.take_back(presenter, subject, &error) => {
                self.teller.tell(&format!("warning: {error}"));
                // The reason is shown with the next one.
                window.request_redraw();
                if let Some(before) = self.control_before.take() {
                    self.control = before;
                }
                subject.come_near(self.control.camera());
                Ok(at_once(presenter.fit(&subject.scene, &subject.settings, size)?))
            }
            fitted => Ok(fitted?),
        }
    }

    /// Reports how frames differ from the requested ones.
    fn tell_fitted(&mut self, is_first: bool) {
        let Some(Opened { window, presenter, interface, .. }) = &mut self.opened else { return };
        let told = presenter.shows_hdr();
        if self.options.hdr.is_some() && std::mem::replace(&mut self.told_hdr, told) != told && told == Some(false) {
            self.teller.tell("warning: this window has no --hdr: nothing in it is brighter than white");
        }
        if is_first {
            tell_mode(presenter, self.options.vsync, &self.teller);
            window.request_redraw();
        }
        if let Some(why) = interface.fitted(presenter, &self.live) {
            self.teller.tell(&format!("warning: {why}"));
            window.request_redraw();
        }
        for why in interface.take_lacking() {
            self.teller.tell(&format!("warning: {why}"));
        }
    }

    /// Sees to it that the next frame has a swapchain that suits the surface.
    fn fit_swapchain(&mut self, fit: Fit) -> Result<(), Error> {
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
        if let Some(Opened { drawn, presenter, .. }) = &mut self.opened {
            presenter.lose_surface();
            presenter.replace_surface(surface_of(&self.device, drawn)?)?;
            (self.unfit, self.misfit) = (true, true);
            self.teller.tell("warning: the window's surface was lost; frames go on with a new one");
        }
        Ok(())
    }

    /// A frame, and once more with a new surface if the old one is lost.
    fn draw_on_a_surface(&mut self) -> Result<(), Error> {
        if self.opened.as_ref().is_some_and(|opened| !opened.presenter.has_surface()) {
            // There was no memory for a new one.
            self.replace_surface()?;
        }
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

    /// Returns true if the window keeps its last picture and tries again later, as there was no memory for another.
    fn waits_for_memory(&mut self, error: &Error) -> bool {
        let is_for_memory = matches!(error, Error::Frame(frame::Error::Gpu(gpu::Error::OutOfMemory { .. })));
        let most = self.options.frames.map_or(u32::MAX, |_| TRIES_FOR_MEMORY);
        // If there never was a frame, the scene is too large for the device.
        if !is_for_memory || self.fitted.is_none() || self.lacked_memory >= most {
            return false;
        }
        if self.lacked_memory == 0 {
            self.teller.tell(&format!("warning: {error}; the window keeps its last picture and tries again"));
        }
        self.lacked_memory += 1;
        (self.misfit, self.again) = (true, Some(Instant::now() + AGAIN_FOR_MEMORY));
        true
    }

    fn redraw(&mut self, events: &ActiveEventLoop) {
        match self.draw_on_a_surface() {
            Ok(()) => self.lacked_memory = 0,
            Err(error) if self.waits_for_memory(&error) => return,
            Err(error) => {
                self.failure = Some(error);
                events.exit();
                return;
            }
        }
        if self.options.frames.is_some_and(|frames| self.clock.frames() >= u64::from(frames)) {
            events.exit();
        }
        self.write_title();
    }

    /// Returns true if frames follow each other without a pause.
    fn goes_on(&self) -> bool {
        !self.hidden
            && (self.options.frames.is_some()
                || self.control.is_moving(self.held)
                || self.live.player.runs()
                || self.opened.as_ref().is_some_and(|opened| opened.presenter.converges()))
    }
}

fn at_once(fits: bool) -> FitOutcome {
    if fits { FitOutcome::AtOnce } else { FitOutcome::Nothing }
}

/// Tells when frames are not shown as they were asked to be.
fn tell_mode(presenter: &Presenter, wanted: Vsync, teller: &Teller) {
    if let Some(mode) = presenter.present_mode().filter(|&mode| !wanted.is(mode)) {
        let vsync = format!("{wanted:?}").to_lowercase();
        teller.tell(&format!("warning: this window has no --vsync {vsync}: frames follow each other by {mode:?}"));
    }
}
