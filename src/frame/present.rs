//! Frames that a window shows: each into an image of the swapchain, as docs/WINDOW.md tells under "How a frame reaches the screen".

mod again;
mod draw;
mod fit;
mod over;

pub use fit::FitOutcome;

use std::sync::Arc;

use ash::vk;

use super::builder::RendererBuilder;
use super::rebuild::Rebuild;
use super::rows::{self, Rows};
use super::split::Split;
use super::{BuildContext, DrawCounts, Error, FrameTimes, IN_FLIGHT, MissingRow, Picture, Renderer, list, plan_for};
use crate::gpu::{
    self, Device, Fit, Image, ImageFormats, ImageWish, Owned, Surface, Swapchain, SwapchainDesc, Vsync, semaphore,
};
use crate::gpu_scene::GpuScene;
use crate::passes::copy::Copy;
use crate::passes::encode::{Encode, WHITE_NITS};
use crate::passes::overlay::{self, OverlayPass};
use crate::passes::split;
use crate::plan::{self, Encoding, FramePlan, Part, PresentTarget, Transfer};
use crate::scene::{Camera, Light, Pose, Scene, Settings, View};
use again::{Again, CachedPicture};

/// The outcome of a frame.
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
    /// Renderers under construction. Declared before the swapchain, so that it is dropped first: the swapchain is destroyed while nothing is
    /// submitted.
    rebuild: Option<Rebuild>,
    /// Absent from the loss of a surface until the next one arrives.
    surface: Option<Arc<Surface>>,
    desc: SwapchainDesc,
    /// Peak brightness of the display in units of white, if it may show more than white.
    headroom: f32,
    /// PRESENT copies pictures, if the window's images can be copied into. Otherwise passes draw into the swapchain's images, and panels over the picture.
    keeps_pictures: bool,
    /// The share of the window's width and height that pictures have; `None` if they always have all of it.
    resolution: Option<f64>,
    /// One for each frame in flight: free again when the frame that waits for it is done.
    acquired: Vec<Owned<vk::Semaphore>>,
    /// Absent until the window has had pixels.
    renderer: Option<Renderer>,
    /// Absent while the window has no pixels.
    swapchain: Option<Swapchain>,
    /// Some if frames must be rebuilt; true if the scene itself has changed.
    changed: Option<bool>,
    screenshot: Option<Copy>,
    /// The screenshot holds, or will hold, an unread picture.
    is_copied: bool,
    /// The picture of the last frame, if the frame's own image still has it.
    cached_picture: Option<CachedPicture>,
    /// The copy that panels are drawn over, if ENCODE reads it.
    beside_kept: Option<Image>,
    /// Made when a picture is first shown again.
    again: Option<Again>,
    /// Present only while something is shown over the picture.
    overlay: Option<OverlayPass>,
    /// Present only if no hardware encodes the swapchain's images.
    encode: Option<Encode>,
    /// The last requested pose of the scene's motion.
    pose: Pose,
    /// The number of lights after which frames are halted.
    halted: Option<usize>,
    /// The row whose hazard frames show, if they have that row.
    simulated: Option<MissingRow>,
    /// Returns the dependencies of a plan's frames.
    rows: Box<dyn Fn(&FramePlan) -> Rows>,
    /// Present only while another view is shown beside the picture.
    split: Option<Split>,
    /// The reason why the last split was given up.
    refused: Option<Error>,
    /// Counts the requests for other frames.
    changes: u64,
    times: FrameTimes,
}

impl Presenter {
    /// Makes a presenter for a window's surface. Nothing is drawn before [`Presenter::fit`].
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
            headroom: 1.0,
            keeps_pictures: false,
            resolution: None,
            acquired,
            renderer: None,
            swapchain: None,
            changed: None,
            screenshot: None,
            is_copied: false,
            cached_picture: None,
            beside_kept: None,
            again: None,
            overlay: None,
            encode: None,
            pose: Pose::default(),
            halted: None,
            simulated: None,
            rows: Box::new(rows::table),
            split: None,
            refused: None,
            changes: 0,
            rebuild: None,
            times: FrameTimes::default(),
        })
    }

    /// Replaces the dependencies of [`rows::table`] for each plan.
    ///
    /// # Safety
    /// As of [`Renderer::with_rows`].
    pub unsafe fn with_rows(self, rows: impl Fn(&FramePlan) -> Rows + 'static) -> Self {
        Self { rows: Box::new(rows), ..self }
    }

    /// Replaces the dependencies as [`Presenter::with_rows`] does, for the frames that the next [`Presenter::fit`] makes. With `of_scene` it uploads
    /// the scene again, so that rows of uploads take effect as well.
    ///
    /// # Safety
    /// As there.
    pub unsafe fn set_rows(&mut self, rows: impl Fn(&FramePlan) -> Rows + 'static, of_scene: bool) {
        self.rows = Box::new(rows);
        self.change(of_scene);
    }

    /// Shows HDR on a display of `nits` peak brightness, if its surface takes more than white: white then has [`WHITE_NITS`], and brighter light is
    /// shown brighter. Nothing changes on other surfaces: see [`Presenter::shows_hdr`].
    pub fn with_hdr(self, nits: f32) -> Self {
        let images = ImageWish { hdr: true, ..self.desc.images };
        Self { headroom: (nits / WHITE_NITS).max(1.0), desc: SwapchainDesc { images, ..self.desc }, ..self }
    }

    /// Makes ENCODE encode pictures even if the hardware could: for tests on machines where every surface has images with hardware encoding.
    pub fn with_encoding(self) -> Self {
        let images = ImageWish { by_shader: true, ..self.desc.images };
        Self { desc: SwapchainDesc { images, ..self.desc }, ..self }
    }

    /// Draws pictures beside the window's images, so that they can be [shown again](Presenter::show_again). The pictures are bit-identical, and cost
    /// one copy in each frame. If the window's images cannot be copied into, nothing changes.
    pub fn with_kept_pictures(self) -> Self {
        Self { keeps_pictures: true, ..self }
    }

    /// Keeps pictures, and lets them be smaller than the window ([`Presenter::set_resolution`]). Pictures in images of more than 8 bits, and in images
    /// that are viewed as sRGB through another format, always have the window's size.
    pub fn with_dynamic_resolution(self) -> Self {
        Self { resolution: Some(1.0), ..self.with_kept_pictures() }
    }

    /// From the next frame on pictures have this share, above 0 and up to 1, of the window's width and height. Returns false where they are whole
    /// instead: without [`Presenter::with_dynamic_resolution`] or where that says so, while the window is split, and where the next frames are not
    /// made yet, which then have the share. Only objects of the picture's size are made anew. The plan's report still names the sizes from before. Waits for
    /// nothing.
    ///
    /// # Errors
    /// When the device lacks the memory.
    pub fn set_resolution(&mut self, share: f64) -> Result<bool, Error> {
        if self.resolution.is_none() {
            return Ok(false);
        }
        self.resolution = Some(share);
        let (Some(renderer), Some(swapchain)) = (&self.renderer, &self.swapchain) else { return Ok(false) };
        let Some(target) = renderer.plan.presented.filter(|target| can_enlarge(swapchain, *target)) else {
            return Ok(false);
        };
        let size = self.size_in(swapchain, target);
        if size != renderer.plan.size {
            let plan = renderer.plan.clone().of_size(size);
            (self.screenshot, self.cached_picture) = (None, None);
            self.renderer = self.renderer.take().map(|own| own.resized(plan, &[])).transpose()?;
        }
        Ok(self.split.is_none())
    }

    /// The size of pictures in a window with these images.
    fn size_in(&self, swapchain: &Swapchain, present_target: PresentTarget) -> [u32; 2] {
        let is_shared = can_enlarge(swapchain, present_target) && self.split.is_none();
        let share = self.resolution.filter(|_| is_shared).unwrap_or(1.0).clamp(0.0, 1.0);
        let extent = swapchain.extent;
        [extent.width, extent.height].map(|length| ((f64::from(length) * share).round() as u32).max(1))
    }

    /// The target of frames that are shown in images of these formats and uses.
    fn target(&self, formats: ImageFormats, usage: vk::ImageUsageFlags) -> PresentTarget {
        let encoding = match transfer_of(formats.color_space) {
            Transfer::Srgb => Encoding { transfer: Transfer::Srgb, headroom: 1.0 },
            transfer => Encoding { transfer, headroom: self.headroom },
        };
        match (formats.by_shader, self.keeps_pictures) {
            (false, true) if usage.contains(COPIED_INTO) => PresentTarget::Enlarge(formats.drawn),
            (false, _) => PresentTarget::Straight(formats.drawn),
            (true, true) => PresentTarget::EncodeKept(encoding),
            (true, false) => PresentTarget::Encode(encoding),
        }
    }

    /// Shows another view of the same camera beside the picture from the next [`Presenter::fit`] on, or none any more.
    pub fn show_beside(&mut self, view: Option<View>) {
        self.changes += 1;
        match (view, &mut self.split) {
            (Some(view), Some(split)) => split.view = view,
            (view, split) => *split = view.map(Split::new),
        }
    }

    /// The view that is shown beside the picture, where one is.
    pub fn beside(&self) -> Option<View> {
        self.split.as_ref().map(|split| split.view)
    }

    /// Moves the divider from the next frame on: `at` is the part of the width left of it, 0 to 1.
    pub fn divide_at(&mut self, at: f64) {
        if let Some(split) = &mut self.split {
            split.at = at;
        }
    }

    /// Returns once why a view that was to be shown beside the picture is not.
    pub fn refusal(&mut self) -> Option<Error> {
        self.refused.take()
    }

    /// Makes the frames anew with the next [`Presenter::fit`], as other settings than before are given to it, or, with `of_scene`, another scene.
    /// Without, its meshes and textures stay on the device where the plan has the same.
    pub fn change(&mut self, of_scene: bool) {
        self.changed = Some(of_scene || self.changed == Some(true));
        self.changes += 1;
    }

    /// Changes a light, by its index in the scene, from the next frame on. Returns false if the changed light needs other pipelines or maps: the
    /// frames stay as they are until [`Presenter::fit`] has made new ones, in the background if asked to.
    ///
    /// # Errors
    /// When there is no such light, or a number is not finite.
    pub fn set_light(&mut self, index: usize, light: &Light) -> Result<bool, Error> {
        self.outdate();
        let own = self.renderer.as_mut().map_or(Ok(true), |renderer| renderer.world.set_light(index, light))?;
        let beside = self.split.as_mut().map_or(Ok(true), |split| split.set_light(index, light))?;
        // Frames that are being made may have the light's pipelines and maps.
        if !(own && beside) && (self.changed.is_none() || self.rebuild.is_none()) {
            self.change(false);
        }
        Ok(own && beside)
    }

    /// Shows a moment of the scene's motion from the next frame on, in frames that are made later as well: see [`Renderer::pose`].
    ///
    /// # Errors
    /// As there.
    pub fn pose(&mut self, scene: &Scene, pose: &Pose) -> Result<(), Error> {
        self.outdate();
        self.pose.clone_from(pose);
        self.renderer.as_mut().map_or(Ok(()), |renderer| renderer.pose(scene, pose))?;
        self.split.as_mut().map_or(Ok(()), |split| split.pose(scene, pose))
    }

    /// Changes the exposure from the next frame on: see [`Renderer::set_exposure`].
    ///
    /// # Errors
    /// As there.
    pub fn set_exposure(&mut self, ev100: f32) -> Result<(), Error> {
        self.outdate();
        self.renderer.as_mut().map_or(Ok(()), |renderer| renderer.set_exposure(ev100))?;
        self.split.as_mut().map_or(Ok(()), |split| split.set_exposure(ev100))
    }

    /// Halts frames after `lights` lights (see [`Renderer::halt_after`]); after [`Presenter::change`], only the frames that are still to be made.
    pub fn halt_after(&mut self, lights: Option<usize>) {
        if self.halted != lights {
            self.outdate();
        }
        self.halted = lights;
        if let Some(renderer) = self.renderer.as_mut().filter(|_| self.changed.is_none()) {
            renderer.halt_after(lights);
        }
    }

    /// Has frames, from the next one on, show the hazard of a row that is missing, or none any more. Frames that have no such row or no such picture
    /// ([`MissingRow::decide`]) are drawn as ever. Waits for the frames under way.
    ///
    /// # Errors
    /// When the device is lost.
    pub fn simulate(&mut self, missing: Option<MissingRow>) -> Result<(), Error> {
        if self.simulated != missing {
            self.outdate();
        }
        self.simulated = missing;
        let Some(renderer) = &mut self.renderer else { return Ok(()) };
        renderer.simulate(missing.and_then(|own| own.simulation(&renderer.plan)))
    }

    /// Gives up a surface that is lost, with its swapchain: a window may not have two.
    pub fn lose_surface(&mut self) {
        // A swapchain is destroyed while nothing is submitted.
        if let Some(rebuild) = &mut self.rebuild {
            rebuild.finish();
        }
        (self.swapchain, self.surface) = (None, None);
    }

    /// Returns false between a surface that is lost and the next.
    pub fn has_surface(&self) -> bool {
        self.surface.is_some()
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

    /// The window's size in pixels, while it has any.
    pub fn window_size(&self) -> Option<[u32; 2]> {
        self.swapchain.as_ref().map(|swapchain| [swapchain.extent.width, swapchain.extent.height])
    }

    /// Returns true if the window's images can be copied from, for [`Presenter::picture`].
    pub fn can_copy(&self) -> bool {
        let has_own = self.plan().is_some_and(FramePlan::is_copied_to_be_shown);
        self.encode.is_some() || self.split.is_none() && has_own || self.swapchain.as_ref().is_some_and(copies)
    }

    /// A picture of the same scene that no window shows, of the size and all else that `settings` say. Shares the scene on the device with the
    /// window's frames where the two plans have it the same. Waits for it.
    ///
    /// # Errors
    /// When the settings cannot be planned, the device lacks the memory or is lost, or the plan cannot be drawn from this camera.
    pub fn picture_apart(&self, scene: &Scene, settings: &Settings, camera: &Camera) -> Result<Picture, Error> {
        let plan = plan_for(&self.device, scene, settings)?;
        let shown = self.renderer.as_ref().filter(|_| self.changed != Some(true));
        let uploaded = shown.and_then(|shown| shown.uploaded_for(&plan));
        let rows = rows::table(&plan);
        RendererBuilder::new(&self.device, scene, settings, (plan, rows), uploaded)?.finish(&[])?.picture(camera, || {})
    }

    /// The times of the last frame that is known to be done; without `wall_ms`, as nobody waited for it.
    pub fn times(&self) -> FrameTimes {
        // After a picture that is shown again and again, no frame follows that would bring the times of the last one.
        self.last_times().unwrap_or_else(|| self.times.clone())
    }

    /// Returns the last frame's figures.
    pub fn drawn(&self) -> DrawCounts {
        let last = |renderer: &Renderer| renderer.frames[(renderer.next + IN_FLIGHT - 1) % IN_FLIGHT].drawn;
        self.renderer.as_ref().map_or_else(DrawCounts::default, last)
    }

    /// Returns true if the overlay is on the device; if not, its textures must be sent with the next panels.
    pub fn has_overlay(&self) -> bool {
        self.overlay.is_some()
    }

    /// The plan of the window's frames, once it has pixels.
    pub fn plan(&self) -> Option<&FramePlan> {
        self.renderer.as_ref().map(Renderer::plan)
    }

    /// As [`Renderer::converges`].
    pub fn converges(&self) -> bool {
        self.renderer.as_ref().is_some_and(Renderer::converges)
    }

    /// The parts of the plan, and the passes that may lie over the picture, of frames with panels (`has_panels`) or without.
    pub fn parts(&self, has_panels: bool) -> Vec<Part> {
        let Some(plan) = self.plan() else { return Vec::new() };
        let mut parts = [list::parts(plan), plan.parts().to_vec()].concat();
        // The passes that come and go while the window is open, as they are now.
        let now = [
            (
                split::PASS,
                self.split.is_some(),
                ["another view is shown beside the picture", "the picture is shown alone"],
            ),
            (overlay::PASS, has_panels, ["panels are shown", "no panel is shown"]),
        ];
        for (pass, included, [reason, otherwise]) in now {
            if let Some(part) = parts.iter_mut().find(|part| part.name == pass.name.name()) {
                (part.included, part.reason) = (included, if included { reason } else { otherwise }.into());
            }
        }
        parts
    }

    /// The swapchain's mode, while there is one.
    pub fn present_mode(&self) -> Option<vk::PresentModeKHR> {
        self.swapchain.as_ref().map(|swapchain| swapchain.present_mode)
    }

    /// True if the window's images take more than white, as [`Presenter::with_hdr`] asks for; none before it has had pixels.
    pub fn shows_hdr(&self) -> Option<bool> {
        let encoding = |plan: &FramePlan| plan.encoding.is_some_and(|encoding| encoding.transfer != Transfer::Srgb);
        self.plan().map(encoding)
    }

    /// Checks that a camera can be drawn with the plans of the window and of the view beside.
    ///
    /// # Errors
    /// The reason why it cannot.
    pub fn check_camera(&self, camera: &Camera) -> Result<(), plan::PlanError> {
        self.plan().map_or(Ok(()), |plan| plan.check_camera(camera))?;
        self.split.as_ref().map_or(Ok(()), |split| split.check_camera(camera))
    }
}

impl Renderer {
    /// The scene on the device, if frames of another plan can be drawn from it as it is.
    pub(super) fn uploaded_for(&self, plan: &FramePlan) -> Option<Arc<GpuScene>> {
        self.plan.uploads_as(plan).then(|| Arc::clone(&self.scene))
    }

    /// Goes on with a plan that differs in size only. Objects that frames under way still use go to the retire queue. A renderer whose frames could
    /// not be made anew is gone: a part of them would name destroyed objects.
    pub(super) fn resized(mut self, plan: FramePlan, swapchain: &[vk::ImageView]) -> Result<Self, Error> {
        self.plan = plan;
        self.copy = None;
        if let Some(culling) = &mut self.culling {
            culling.resize(&self.device, &self.plan)?;
        }
        self.cut();
        self.frame.resize(&BuildContext {
            device: &self.device,
            plan: &self.plan,
            rows: &self.rows,
            frame_layout: self.frame_layout.raw,
            atlas: self.atlas.as_ref(),
            scene: &self.scene,
            world: &self.world,
            poses: &self.poses,
            culling: self.culling.as_ref(),
            seen: self.seen.as_ref(),
            swapchain,
        })?;
        self.frames.iter_mut().for_each(|own| own.view.forget_names());
        Ok(self)
    }
}

fn check_surface(device: &Device, surface: &Surface) -> gpu::Result<()> {
    let name = &device.physical.name;
    match surface.is_served_by(device)? {
        true => Ok(()),
        false => Err(gpu::Error::Unsupported(format!("'{name}' cannot show images in this window"))),
    }
}

/// The usage of the swapchain's images by SPLIT and PRESENT.
const COPIED_INTO: vk::ImageUsageFlags = vk::ImageUsageFlags::TRANSFER_DST;

/// Returns true if pictures in these images may be smaller than the window: a blit into images that are viewed in another format would not encode.
fn can_enlarge(swapchain: &Swapchain, present_target: PresentTarget) -> bool {
    matches!(present_target, PresentTarget::Enlarge(_)) && swapchain.formats.own == swapchain.formats.drawn
}

/// Further uses of a swapchain's images, where the surface allows them: screenshots copy from them, SPLIT and PRESENT into them.
fn wishes(are_copied_into: bool) -> vk::ImageUsageFlags {
    let into = if are_copied_into { COPIED_INTO } else { vk::ImageUsageFlags::empty() };
    vk::ImageUsageFlags::TRANSFER_SRC | into
}

/// Returns true if a swapchain's images can be copied from.
fn copies(swapchain: &Swapchain) -> bool {
    swapchain.usage.contains(vk::ImageUsageFlags::TRANSFER_SRC)
}

/// A whole picture is copied from the swapchain's image, with the view beside it; a coarse one is copied before it is enlarged.
fn copies_whole(swapchain: &Swapchain, plan: &FramePlan) -> bool {
    copies(swapchain) && [swapchain.extent.width, swapchain.extent.height] == plan.size
}

/// The swapchain that a plan's frames are drawn into.
fn desc_for(plan: &FramePlan) -> SwapchainDesc {
    let (encodes, usage) = match plan.is_tiled() {
        // An attachment only of OVERLAY.
        true => (false, vk::ImageUsageFlags::TRANSFER_DST | vk::ImageUsageFlags::COLOR_ATTACHMENT),
        false => (true, vk::ImageUsageFlags::COLOR_ATTACHMENT),
    };
    let images = ImageWish { encodes, hdr: false, by_shader: false };
    SwapchainDesc { images, usage, wishes: wishes(false), vsync: Vsync::default(), size: plan.size }
}

/// Returns the transfer function of images in a colour space.
fn transfer_of(color_space: vk::ColorSpaceKHR) -> Transfer {
    match color_space {
        vk::ColorSpaceKHR::HDR10_ST2084_EXT => Transfer::Pq,
        vk::ColorSpaceKHR::EXTENDED_SRGB_LINEAR_EXT => Transfer::Linear,
        _ => Transfer::Srgb,
    }
}
