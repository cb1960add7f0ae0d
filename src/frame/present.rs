//! Frames that a window shows: each into an image of the swapchain, as ARCHITECTURE.md tells under "A frame on the screen".

use std::sync::Arc;

use ash::vk;

use super::deferred::image_barrier;
use super::edges::{self, Edges};
use super::read_back::{host_barrier, picture_of};
use super::{Drawn, Error, FrameParts, FrameTimes, IN_FLIGHT, Picture, Renderer, plan_for};
use crate::gpu::barrier::ImageRange;
use crate::gpu::{self, Acquired, Device, Fit, Owned, Surface, Swapchain, SwapchainDesc, Vsync, semaphore};
use crate::passes::copy::Copy;
use crate::passes::overlay::{Overlay, Panels};
use crate::plan::{self, FramePlan};
use crate::scene::{Camera, Light, Scene, Settings};

/// What became of a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// It is drawn and will be shown.
    Shown(Fit),
    /// There was no image to draw into.
    Nothing(Fit),
}

/// Draws frames of one scene into a window.
pub struct Presenter {
    device: Arc<Device>,
    /// None between one that is lost and the next.
    surface: Option<Arc<Surface>>,
    desc: SwapchainDesc,
    /// One for each frame in flight: free again when the frame that waits for it is done.
    acquired: Vec<Owned<vk::Semaphore>>,
    /// None before the window has had any pixels.
    renderer: Option<Renderer>,
    /// None while it has none.
    swapchain: Option<Swapchain>,
    /// What was said of the frames has changed, and with `true` the scene itself.
    changed: Option<bool>,
    screenshot: Option<Copy>,
    /// Only while something is shown over the picture.
    overlay: Option<Overlay>,
    /// After how many lights frames are halted.
    halted: Option<usize>,
    times: FrameTimes,
}

impl Presenter {
    /// For a window's surface. Nothing is drawn before [`Presenter::fit`].
    ///
    /// # Errors
    /// When the device cannot show images there, or the settings cannot be planned on it.
    pub fn new(
        device: &Arc<Device>,
        surface: Arc<Surface>,
        scene: &Scene,
        settings: &Settings,
        vsync: Vsync,
    ) -> Result<Self, Error> {
        check_surface(device, &surface)?;
        let plan = plan_for(device, scene, settings)?;
        let name = |index| format!("swapchain image for frame {index} acquired");
        let acquired = (0..IN_FLIGHT).map(|index| semaphore(device, &name(index))).collect::<gpu::Result<_>>()?;
        Ok(Self {
            device: device.clone(),
            surface: Some(surface),
            desc: SwapchainDesc { vsync, ..desc_for(&plan) },
            acquired,
            renderer: None,
            swapchain: None,
            changed: None,
            screenshot: None,
            overlay: None,
            halted: None,
            times: FrameTimes::default(),
        })
    }

    /// Makes the swapchain, and all that has the size of the picture, as large as the window is now; `size` where the window system leaves that
    /// open. The scene on the device, its shadow maps and all pipelines stay, unless the plan of the new size has others. False while the
    /// window has no pixels.
    ///
    /// # Errors
    /// When the surface is lost, or the device lacks the memory.
    pub fn fit(&mut self, scene: &Scene, settings: &Settings, size: [u32; 2]) -> Result<bool, Error> {
        let plan = plan_for(&self.device, scene, settings)?;
        self.desc = SwapchainDesc { vsync: self.desc.vsync, size, ..desc_for(&plan) };
        let Some(surface) = &self.surface else { return Ok(false) };
        let old = self.swapchain.take();
        self.swapchain = Swapchain::new(&self.device, surface, &self.desc, old)?;
        let Some(swapchain) = &self.swapchain else { return Ok(false) };
        let vk::Extent2D { width, height } = swapchain.extent;
        let settings = Settings { size: [width, height], ..settings.clone() };
        let plan = plan_for(&self.device, scene, &settings)?.presented_as(swapchain.format);
        let views: Vec<_> = swapchain.images.iter().filter_map(|image| Some(image.view.as_ref()?.raw)).collect();
        self.screenshot = None;
        match &mut self.overlay {
            Some(overlay) if overlay.format() == swapchain.format => overlay.resize(&views, swapchain.extent)?,
            overlay => *overlay = None,
        }
        match &mut self.renderer {
            Some(renderer) if self.changed.is_none() && renderer.plan.differs_in_size_only(&plan) => {
                renderer.resize(plan, &views)?;
            }
            renderer => {
                let stays = |old: &&Renderer| self.changed != Some(true) && old.plan.uploads_as(&plan);
                let uploaded = renderer.as_ref().filter(stays).map(|old| old.scene.clone());
                // Given up first: a device may not hold two.
                *renderer = None;
                let edges = edges::table(&plan);
                let mut new = Renderer::of(&self.device, scene, &settings, (plan, edges), (&views, uploaded))?;
                new.halt_after(self.halted);
                *renderer = Some(new);
                self.changed = None;
            }
        }
        Ok(true)
    }

    /// Makes the frames anew with the next [`Presenter::fit`], as other settings than before are given to it, or, with `of_scene`, another scene.
    /// Without, its meshes and textures stay on the device where the plan has the same.
    pub fn change(&mut self, of_scene: bool) {
        self.changed = Some(of_scene || self.changed == Some(true));
    }

    /// Changes a light from the next frame on: see [`Renderer::set_light`].
    ///
    /// # Errors
    /// When the changed one needs other pipelines or maps: then [`Presenter::change`] is the way.
    pub fn set_light(&mut self, index: usize, light: &Light) -> Result<(), Error> {
        self.renderer.as_mut().map_or(Ok(()), |renderer| renderer.set_light(index, light))
    }

    /// Changes the exposure from the next frame on: see [`Renderer::set_exposure`].
    ///
    /// # Errors
    /// As there.
    pub fn set_exposure(&mut self, ev100: f32) -> Result<(), Error> {
        self.renderer.as_mut().map_or(Ok(()), |renderer| renderer.set_exposure(ev100))
    }

    /// Halts frames after so many lights, those of a next plan as well: see [`Renderer::halt_after`].
    pub fn halt_after(&mut self, lights: Option<usize>) {
        self.halted = lights;
        if let Some(renderer) = &mut self.renderer {
            renderer.halt_after(lights);
        }
    }

    /// Gives up a surface that is lost, with its swapchain: a window may not have two.
    pub fn lose_surface(&mut self) {
        (self.swapchain, self.surface) = (None, None);
    }

    /// Takes a new surface of the window in its place.
    ///
    /// # Errors
    /// When the device cannot show images there.
    pub fn replace_surface(&mut self, surface: Arc<Surface>) -> Result<(), Error> {
        check_surface(&self.device, &surface)?;
        self.surface = Some(surface);
        Ok(())
    }

    /// Whether the window's images can be copied from, for [`Presenter::picture`].
    pub fn can_copy(&self) -> bool {
        let copies = |swapchain: &Swapchain| swapchain.usage.contains(vk::ImageUsageFlags::TRANSFER_SRC);
        self.swapchain.as_ref().is_some_and(copies) || self.plan().is_some_and(FramePlan::is_tiled)
    }

    /// Draws a frame and has it shown. Waits for the frame before the last, and a moment for an image. With `copied`, its picture can be had
    /// from [`Presenter::picture`], without the panels that lie over it.
    ///
    /// # Errors
    /// When the device is lost or out of memory, or cannot draw from this camera; the image cannot be copied from.
    pub fn draw(&mut self, camera: &Camera, copied: bool, panels: Option<&Panels>) -> Result<Outcome, Error> {
        let (Some(renderer), Some(swapchain)) = (&mut self.renderer, &self.swapchain) else {
            return Ok(Outcome::Nothing(Fit::OutOfDate));
        };
        // What can fail comes before the image: one that is acquired must be presented.
        renderer.plan.check_camera(camera)?;
        if copied && self.screenshot.is_none() {
            if !swapchain.usage.contains(vk::ImageUsageFlags::TRANSFER_SRC) && !renderer.plan.is_tiled() {
                return Err(gpu::Error::Unsupported("this window's images cannot be copied from".into()).into());
            }
            self.screenshot = Some(Copy::new(&self.device, &renderer.plan)?);
        }
        // Whoever waited for the semaphore is done then.
        if let Some(times) = renderer.free_place()? {
            self.times = times;
        }
        let place = renderer.next;
        overlay(&self.device, swapchain, (&mut self.overlay, self.desc.encodes), panels, place)?;
        let acquired = &self.acquired[place];
        let (index, fit) = match swapchain.acquire(acquired)? {
            Acquired::Image(index, fit) => (index, fit),
            Acquired::Nothing(fit) => return Ok(Outcome::Nothing(fit)),
        };
        let image = &swapchain.images[index];
        let recorded = renderer.record(camera, [0.0; 2], Some((index, image.raw)))?;
        if let Some(copy) = self.screenshot.as_ref().filter(|_| copied) {
            record_copy(renderer, copy, image.raw);
        }
        if let (Some(overlay), Some(panels)) = (&self.overlay, panels) {
            let cmd = renderer.frames[place].cmd.raw;
            let whole = ImageRange::whole(image.raw, vk::ImageAspectFlags::COLOR);
            image_barrier(&self.device, cmd, whole, renderer.edges.row("picture-to-overlay"));
            overlay.record(cmd, index, place, panels);
            image_barrier(&self.device, cmd, whole, renderer.edges.row("overlay-to-swapchain"));
        }
        // The rows "acquire" and "present".
        let wait = (acquired.raw, renderer.edges.row("acquire").after.stage);
        renderer.submit(recorded, &[wait], &[image.drawn.raw])?;
        // What is given up before a frame is submitted could be destroyed before the frame is done.
        if let (Some(overlay), Some(panels)) = (&mut self.overlay, panels) {
            overlay.forget(&panels.spent);
        }
        match (swapchain.present(index)?, fit) {
            (Fit::Exact, fit) | (fit, _) => Ok(Outcome::Shown(fit)),
        }
    }

    /// The picture of the last frame, which was drawn to be copied. Waits for it.
    ///
    /// # Errors
    /// When it was not, or the device is lost.
    pub fn picture(&mut self) -> Result<Picture, Error> {
        let (Some(renderer), Some(copy)) = (&mut self.renderer, &self.screenshot) else {
            return Err(gpu::Error::Misuse("a picture of a window is read that was not copied".into()).into());
        };
        // The row "copy-to-host".
        renderer.wait()?;
        picture_of(copy, &renderer.plan)
    }

    /// The times of the last frame that is known to be done; without `wall_ms`, as nobody waited for it.
    pub fn times(&self) -> FrameTimes {
        self.times.clone()
    }

    /// What the last frame drew.
    pub fn drawn(&self) -> Drawn {
        let last = |renderer: &Renderer| renderer.frames[(renderer.next + IN_FLIGHT - 1) % IN_FLIGHT].drawn;
        self.renderer.as_ref().map_or_else(Drawn::default, last)
    }

    /// Whether what lies over the picture is on the device: if not, its textures must be sent with the next panels.
    pub fn has_overlay(&self) -> bool {
        self.overlay.is_some()
    }

    /// The plan of the window's frames, once it has pixels.
    pub fn plan(&self) -> Option<&FramePlan> {
        self.renderer.as_ref().map(Renderer::plan)
    }

    /// The swapchain's mode, while there is one.
    pub fn present_mode(&self) -> Option<vk::PresentModeKHR> {
        self.swapchain.as_ref().map(|swapchain| swapchain.present_mode)
    }

    /// Whether a camera can be drawn with the window's plan.
    ///
    /// # Errors
    /// Why it cannot.
    pub fn check_camera(&self, camera: &Camera) -> Result<(), plan::Error> {
        self.plan().map_or(Ok(()), |plan| plan.check_camera(camera))
    }
}

impl Renderer {
    /// Goes on with a plan that differs in size only. What frames under way still use goes by the retire queue.
    fn resize(&mut self, plan: FramePlan, swapchain: &[vk::ImageView]) -> Result<(), Error> {
        self.plan = plan;
        self.copy = None;
        self.frame.resize(&FrameParts {
            device: &self.device,
            plan: &self.plan,
            edges: &self.edges,
            frame_layout: self.frame_layout.raw,
            atlas: self.atlas.as_ref(),
            scene: &self.scene,
            world: &self.world,
            swapchain,
        })?;
        Ok(())
    }
}

fn check_surface(device: &Device, surface: &Surface) -> gpu::Result<()> {
    let name = &device.physical.name;
    match surface.is_served_by(device)? {
        true => Ok(()),
        false => Err(gpu::Error::Unsupported(format!("'{name}' cannot show images in this window"))),
    }
}

/// The swapchain that a plan's frames are drawn into.
fn desc_for(plan: &FramePlan) -> SwapchainDesc {
    let (encodes, usage) = match plan.is_tiled() {
        // An attachment only of OVERLAY.
        true => (false, vk::ImageUsageFlags::TRANSFER_DST | vk::ImageUsageFlags::COLOR_ATTACHMENT),
        false => (true, vk::ImageUsageFlags::COLOR_ATTACHMENT),
    };
    SwapchainDesc { encodes, usage, vsync: Vsync::default(), size: plan.size }
}

/// Sees to it that there is an overlay where there are panels, and nowhere else, and that it has what this frame in flight shows.
fn overlay(
    device: &Arc<Device>,
    swapchain: &Swapchain,
    (overlay, encodes): (&mut Option<Overlay>, bool),
    panels: Option<&Panels>,
    frame: usize,
) -> gpu::Result<()> {
    let Some(panels) = panels else {
        *overlay = None;
        return Ok(());
    };
    let own = match overlay {
        Some(own) => own,
        None => {
            let views: Vec<_> = swapchain.images.iter().filter_map(|image| Some(image.view.as_ref()?.raw)).collect();
            let mut new = Overlay::new(device, swapchain.format, encodes, IN_FLIGHT)?;
            new.resize(&views, swapchain.extent)?;
            overlay.insert(new)
        }
    };
    own.write(frame, panels)
}

/// Copies the picture of the frame that is being recorded, before it is presented.
fn record_copy(renderer: &Renderer, copy: &Copy, swapchain_image: vk::Image) {
    let (device, edges, cmd) = (&renderer.device, &renderer.edges, renderer.frames[renderer.next].cmd.raw);
    match renderer.frame.output() {
        Some(own) => copy.record(device, cmd, own.raw),
        None => copy_presented(device, edges, (cmd, swapchain_image), copy),
    }
    host_barrier(device, cmd, copy, edges);
}

/// The same of an image that is ready to be presented, as it is again after that.
fn copy_presented(device: &Device, edges: &Edges, (cmd, image): (vk::CommandBuffer, vk::Image), copy: &Copy) {
    let whole = ImageRange::whole(image, vk::ImageAspectFlags::COLOR);
    image_barrier(device, cmd, whole, edges.row("swapchain-to-copy"));
    copy.record(device, cmd, image);
    image_barrier(device, cmd, whole, edges.row("copy-to-swapchain"));
}
