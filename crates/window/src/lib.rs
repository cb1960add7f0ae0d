//! A window onto a scene: events in, a camera that moves, frames out. Drawing and showing are [`afterlight::frame::Presenter`]'s; the motion of the camera
//! by a user is `camera.rs`'s, which needs no window.

#![deny(missing_docs)]

pub mod keys;

mod app;
mod camera;
mod clock;
mod controls;
mod dependencies;
mod faults;
mod icon;
mod live_scene;
mod marks;
mod messages;
mod oracle;
mod overlay;
mod player;
mod recorder;
mod resolution;
mod split;
mod steps;
mod user_interface;
mod watch;
#[cfg(all(unix, not(target_vendor = "apple")))]
mod x11;

use std::ffi::CStr;
use std::path::PathBuf;
use std::sync::Arc;

use winit::error::EventLoopError;
use winit::event_loop::EventLoop;
use winit::window::Window;

use afterlight::frame;
use afterlight::gpu::{self, Device, Surface, Vsync, surface_extensions};
use afterlight::scene::{Camera, CameraPath, Playing, Scene, Settings, SettingsPatch};

pub use app::help;
pub use clock::Summary;
pub use watch::ShaderFolder;

/// Reads the scene and its settings again.
pub type ReadAgain = Box<dyn Fn() -> Result<(Scene, Settings), String> + Send>;

/// Why there is no window, or none any more.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The program has no display to open a window on.
    #[error("no window can be opened here: {0}")]
    NoDisplay(String),
    /// `WINIT_X11_SCALE_FACTOR` has a value that the window system cannot take.
    #[error("WINIT_X11_SCALE_FACTOR={0}: must be a number above 0, such as 1.5, or randr; or unset it")]
    ScaleFactor(String),
    /// The window system went away, or failed.
    #[error("the window system failed: {0}")]
    System(String),
    /// Frames could not be made or drawn.
    #[error(transparent)]
    Frame(#[from] frame::Error),
}

impl From<gpu::Error> for Error {
    fn from(error: gpu::Error) -> Self {
        Self::Frame(error.into())
    }
}

/// Options of a window.
pub struct WindowOptions<'a> {
    /// The icon of the window and of task lists, as PNG.
    pub icon: &'a [u8],
    /// The synchronization of frames with the display's refresh.
    pub vsync: Vsync,
    /// Shows light brighter than white on displays that can, up to this many nits.
    pub hdr: Option<f32>,
    /// Makes pictures coarser while something moves, if frames take long.
    pub dynamic_resolution: bool,
    /// Draws without a pause, and closes after this many frames.
    pub frames: Option<u32>,
    /// The moment and the clips that it begins with.
    pub playing: Playing,
    /// Rests at that moment instead of playing on from it.
    pub rests: bool,
    /// Prints a message to the user, most of them in one line.
    pub tell: &'a dyn Fn(&str),
    /// Shows messages over the picture as well, for some seconds, and a sign while something is computed.
    pub messages: bool,
    /// Keeps a screenshot, of the shown picture or of its light. Returns a message about it.
    pub keep: &'a dyn Fn(&frame::Picture) -> Result<String, String>,
    /// Keeps a path that was recorded. Returns a message about it.
    pub keep_path: &'a dyn Fn(&CameraPath) -> Result<String, String>,
    /// Keeps the scene with its lights, seen from a camera with settings. Returns a message about it.
    pub keep_scene: &'a dyn Fn(&Scene, &Camera, &SettingsPatch) -> Result<String, String>,
    /// Called, from another thread, when a file of the scene has changed.
    pub read_again: Option<ReadAgain>,
    /// Dependencies, by their names, that are switched off as it opens, on their panel.
    pub without: Vec<String>,
    /// The picture of the first one's hazard that is simulated.
    pub hazard: Option<frame::HazardPicture>,
    /// The book's chapter about dependencies, where this system has it as a file.
    pub chapter: Option<PathBuf>,
    /// Shaders that are compiled anew when they change; ignored without the feature `hot-reload`.
    pub shaders: Option<ShaderFolder>,
}

/// The connection to the window system.
pub struct WindowSystem {
    events: EventLoop<()>,
}

impl WindowSystem {
    /// Connects to the window system, once a process, in its first thread. If an X11 connection breaks later, X11 only calls a function that cannot
    /// return, `gone`; other window systems let [`WindowSystem::view`] return an error.
    ///
    /// # Errors
    /// [`Error::NoDisplay`] without a display, [`Error::ScaleFactor`] if the environment has a bad scale factor.
    pub fn connect(gone: fn() -> !) -> Result<Self, Error> {
        #[cfg(all(unix, not(target_vendor = "apple")))]
        x11::check_scale_factor()?;
        let events = EventLoop::new().map_err(|error| Error::NoDisplay(reason(&error)))?;
        #[cfg(all(unix, not(target_vendor = "apple")))]
        x11::on_broken_connection(gone);
        #[cfg(not(all(unix, not(target_vendor = "apple"))))]
        let _ = gone;
        Ok(Self { events })
    }

    /// The instance extensions that its windows need.
    ///
    /// # Errors
    /// When Vulkan does not know this window system.
    pub fn extensions(&self) -> Result<Vec<&'static CStr>, Error> {
        Ok(surface_extensions(&self.events)?)
    }

    /// Opens a window onto the scene, as large as the settings say, and returns when it is closed.
    ///
    /// # Errors
    /// When the device cannot draw the scene into a window, or the window system fails.
    pub fn view(
        self,
        device: &Arc<Device>,
        scene: Scene,
        settings: Settings,
        options: WindowOptions,
    ) -> Result<Summary, Error> {
        let proxy = self.events.create_proxy();
        // It only fails when the loop has ended, which then needs nobody to wake it.
        let wake = move || _ = proxy.send_event(());
        let mut app = app::App::new(device, (scene, settings), options, Arc::new(wake));
        let ran = self.events.run_app(&mut app);
        let ended = app.end();
        match (ended, ran) {
            (Err(error), _) => Err(error),
            (Ok(_), Err(error)) => Err(Error::System(reason(&error))),
            (Ok(summary), Ok(())) => Ok(summary),
        }
    }
}

/// A window as a driver knows it.
#[cfg(all(unix, not(target_vendor = "apple")))]
type DrawnWindow = x11::DrawnWindow;
#[cfg(not(all(unix, not(target_vendor = "apple"))))]
type DrawnWindow = Window;

/// A window for the driver. All of its surfaces are made of one such value.
#[cfg(all(unix, not(target_vendor = "apple")))]
fn drawn(window: &Arc<Window>) -> Result<Arc<DrawnWindow>, Error> {
    Ok(Arc::new(DrawnWindow::new(Arc::clone(window))?))
}

#[cfg(not(all(unix, not(target_vendor = "apple"))))]
fn drawn(window: &Arc<Window>) -> Result<Arc<DrawnWindow>, Error> {
    Ok(Arc::clone(window))
}

/// A surface of a window.
fn surface_of(device: &Device, drawn: &Arc<DrawnWindow>) -> Result<Arc<Surface>, Error> {
    Ok(Surface::new(device, Arc::clone(drawn))?)
}

/// Returns winit's message without the place in its sources.
fn reason(error: &EventLoopError) -> String {
    let text = match error {
        EventLoopError::Os(error) => error.to_string(),
        // winit says no more of a Wayland connection that breaks.
        EventLoopError::ExitFailure(_) => "its connection broke".to_owned(),
        other => other.to_string(),
    };
    let cause = text.strip_prefix("os error at ").and_then(|rest| rest.split_once(": "));
    cause.map_or(text.as_str(), |(_, reason)| reason).trim_end_matches('.').to_owned()
}
