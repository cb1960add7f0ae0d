//! A model in a window of the caller's own. Any library will do whose windows have raw window handles; this one is winit.
//!
//!     cargo run --release --example own_window --no-default-features --features present,readers -- model.obj
//!
//! A number after the model ends it after so many frames.

use std::error::Error;
use std::sync::Arc;

use afterlight::frame::{Outcome, Presenter};
use afterlight::gpu::{Device, DeviceChoice, Instance, InstanceOptions, Surface, Vsync, surface_extensions};
use afterlight::scene::{OpenOptions, Scene, Settings, open};
use winit::application::ApplicationHandler;
use winit::event::WindowEvent;
use winit::event_loop::{ActiveEventLoop, EventLoop};
use winit::window::{Window, WindowId};

type Result<T = ()> = std::result::Result<T, Box<dyn Error>>;

struct App {
    device: Arc<Device>,
    scene: Scene,
    settings: Settings,
    /// Frames until the end.
    frames: u64,
    shown: Option<(Arc<Window>, Presenter)>,
    end: Result,
}

impl App {
    fn open(&mut self, events: &ActiveEventLoop) -> Result {
        let window = Arc::new(events.create_window(Window::default_attributes().with_title("Afterlight in a window"))?);
        // The surface keeps the window, and the presenter the surface.
        let surface = Surface::new(&self.device, Arc::clone(&window))?;
        let presenter = Presenter::new(&self.device, surface, &self.scene, &self.settings, Vsync::On)?;
        self.shown = Some((window, presenter));
        Ok(())
    }

    fn draw(&mut self, events: &ActiveEventLoop) -> Result {
        let Some((window, presenter)) = &mut self.shown else { return Ok(()) };
        let size: [u32; 2] = window.inner_size().into();
        // A swapchain and targets of the window's size. A window without pixels has none.
        if presenter.plan().is_none_or(|plan| plan.size != size) && !presenter.fit(&self.scene, &self.settings, size)? {
            return Ok(());
        }
        match presenter.draw(&self.scene.camera, false, None)? {
            Outcome::Shown(_) => self.frames -= 1,
            // The window has changed while nobody looked: the next frame gets another swapchain.
            Outcome::Nothing(_) => _ = presenter.fit(&self.scene, &self.settings, size)?,
        }
        if self.frames == 0 {
            events.exit()
        } else {
            window.request_redraw()
        }
        Ok(())
    }
}

impl ApplicationHandler for App {
    fn resumed(&mut self, events: &ActiveEventLoop) {
        self.end = self.open(events);
    }

    fn window_event(&mut self, events: &ActiveEventLoop, _: WindowId, event: WindowEvent) {
        match event {
            WindowEvent::RedrawRequested if self.end.is_ok() => self.end = self.draw(events),
            WindowEvent::CloseRequested => events.exit(),
            _ => {}
        }
        if self.end.is_err() {
            events.exit();
        }
    }
}

fn main() -> Result {
    let mut arguments = std::env::args().skip(1);
    let scene = open(&arguments.next().unwrap_or("builtin:spheres".into()), &OpenOptions::default())?;
    let frames = arguments.next().map_or(Ok(u64::MAX), |text| text.parse())?;
    let events = EventLoop::new()?;
    let instance = Instance::with_extensions(&InstanceOptions::default(), &surface_extensions(&events)?)?;
    let device = Device::with_extensions(&instance, &DeviceChoice::Auto, &[c"VK_KHR_swapchain"])?;
    let settings = scene.settings.decide();
    let mut app = App { device, scene, settings, frames, shown: None, end: Ok(()) };
    events.run_app(&mut app)?;
    app.end
}
