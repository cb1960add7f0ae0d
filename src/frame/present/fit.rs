//! Makes frames that fit the window and the settings: at once, or in a background thread while the old frames go on.

use ash::vk;

use super::over::{Over, encoded_image, image_beside};
use super::{COPIED_INTO, Presenter, desc_for, wishes};
use crate::frame::builder::RendererBuilder;
use crate::frame::rebuild::{Begun, Rebuild, Rebuilt, Wake};
use crate::frame::{Error, plan_for};
use crate::gpu::{self, ImageWish, Swapchain, SwapchainDesc, image_formats};
use crate::passes::encode::Encode;
use crate::plan::FramePlan;
use crate::scene::{Scene, Settings};

/// The outcome of asking for other frames.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FitOutcome {
    /// The new frames are ready; another thread made them.
    Taken,
    /// The new frames are ready; the calling thread made them.
    AtOnce,
    /// The new frames are being made, and the old ones go on.
    Pending,
    /// The window has no pixels.
    Nothing,
}

impl Presenter {
    /// Makes the swapchain, and all objects of the picture's size, as large as the window is now, or as `size` where the window system leaves that
    /// open. The scene on the device, its shadow maps and all pipelines stay, unless the plan of the new size has others. False while the window has
    /// no pixels. A split that cannot be made is given up: see [`Presenter::refusal`]. Waits for frames that are being made.
    ///
    /// # Errors
    /// When the surface is lost, or the device lacks the memory.
    pub fn fit(&mut self, scene: &Scene, settings: &Settings, size: [u32; 2]) -> Result<bool, Error> {
        let changes = self.changes;
        let begun = self.rebuild.take().filter(|rebuild| rebuild.begun.changes == changes);
        Ok(self.fit_with(scene, settings, size, begun.map(Rebuild::wait))? != FitOutcome::Nothing)
    }

    /// Variant of [`Presenter::fit`] for an unchanged window and surface. Another thread makes the parts for which a driver's compiler takes long.
    /// Meanwhile it returns [`FitOutcome::Pending`] and frames go on as they were; once `wake` has been called, the next call adopts the new ones. A
    /// new scene is fitted at once, as a device may not hold two.
    ///
    /// # Errors
    /// As [`Presenter::fit`].
    pub fn fit_later(&mut self, scene: &Scene, settings: &Settings, wake: &Wake) -> Result<FitOutcome, Error> {
        if self.is_pending() && !self.is_made() && self.changed != Some(true) {
            // One at a time: dragging a slider would begin hundreds.
            return Ok(FitOutcome::Pending);
        }
        if self.rebuild.as_ref().is_none_or(|rebuild| rebuild.begun.changes != self.changes) {
            // These frames have outdated settings.
            self.rebuild = None;
            let begun = Begun::new(self.changes, scene, settings);
            self.rebuild = self.builders(scene, settings)?.and_then(|builders| Rebuild::start(begun, builders, wake));
            if self.is_pending() {
                return Ok(FitOutcome::Pending);
            }
        }
        let made = self.rebuild.take().map(Rebuild::wait);
        self.fit_with(scene, settings, self.desc.size, made)
    }

    /// Returns true if new frames are being made, or wait to be taken.
    pub fn is_pending(&self) -> bool {
        self.rebuild.is_some()
    }

    /// Returns true if new frames wait to be taken by [`Presenter::fit_later`].
    pub fn is_made(&mut self) -> bool {
        self.rebuild.as_mut().is_some_and(Rebuild::is_done)
    }

    /// Returns the builders with which another thread can make the requested renderers: the window's own, and the one of the view beside. Returns
    /// none if the work must be done at once, or nothing has to be made.
    fn builders(&self, scene: &Scene, settings: &Settings) -> Result<Option<[Option<RendererBuilder>; 2]>, Error> {
        let (Some(surface), Some(shown), Some(swapchain)) = (&self.surface, &self.renderer, &self.swapchain) else {
            return Ok(None);
        };
        if self.changed == Some(true) {
            return Ok(None);
        }
        let vk::Extent2D { width, height } = swapchain.extent;
        let settings = Settings { size: [width, height], ..settings.clone() };
        let plan = plan_for(&self.device, scene, &settings)?;
        let formats = image_formats(&self.device, surface, self.wish_for(&plan))?;
        let target = self.target(formats, swapchain.usage);
        let own = self.changed.map(|_| {
            let plan = plan.presented_as(target).of_one_pixel();
            let (rows, uploaded) = ((self.rows)(&plan), shown.uploaded_for(&plan));
            RendererBuilder::new(&self.device, scene, &settings, (plan, rows), uploaded)
        });
        let own = match own.transpose() {
            Err(error) if is_for_memory(&error) => return Ok(None),
            own => own?,
        };
        let beside = self
            .split
            .as_ref()
            .and_then(|split| split.builder((scene, &settings), (own.as_ref(), shown, target), self.changed.is_some()));
        Ok((own.is_some() || beside.is_some()).then_some([own, beside]))
    }

    /// Adopts the renderers that were made for these settings, and makes the others.
    fn fit_with(
        &mut self,
        scene: &Scene,
        settings: &Settings,
        size: [u32; 2],
        mut made: Option<Rebuilt>,
    ) -> Result<FitOutcome, Error> {
        let own = match made.as_mut().and_then(|made| made.own.take()).transpose() {
            // Dropping the old renderers, and the one made beside, frees memory for another attempt.
            Err(error) if is_for_memory(&error) => {
                made = None;
                None
            }
            own => own?,
        };
        self.desc = SwapchainDesc { size, wishes: wishes(self.split.is_some() || self.keeps_pictures), ..self.desc };
        let Some((settings, plan)) = self.fit_swapchain(scene, settings)? else { return Ok(FitOutcome::Nothing) };
        let Some(swapchain) = &self.swapchain else { return Ok(FitOutcome::Nothing) };
        let views = swapchain.views();
        (self.screenshot, self.cached_picture) = (None, None);
        let own = own.filter(|own| own.plan.differs_in_size_only(&plan));
        let own = own.and_then(|own| made.as_ref()?.caught_up(own, scene, &settings));
        let mut taken = own.is_some();
        match (own, &mut self.renderer) {
            (Some(own), renderer) => {
                // Given up first, so that objects of the picture's size exist only once.
                *renderer = None;
                let mut own = own.resized(plan, &views)?;
                own.halt_after(self.halted);
                *renderer = Some(own);
            }
            (None, renderer)
                if self.changed.is_none()
                    && renderer.as_ref().is_some_and(|own| own.plan.differs_in_size_only(&plan)) =>
            {
                *renderer = renderer.take().map(|own| own.resized(plan, &views)).transpose()?;
            }
            (None, renderer) => {
                // Given up first: a device may not hold two.
                if let Some(split) = self.split.as_mut().filter(|_| self.changed == Some(true)) {
                    split.give_up();
                }
                let old = renderer.take().filter(|_| self.changed != Some(true));
                let uploaded = old.as_ref().and_then(|old| old.uploaded_for(&plan));
                drop(old);
                let rows = (self.rows)(&plan);
                let mut new =
                    RendererBuilder::new(&self.device, scene, &settings, (plan, rows), uploaded)?.finish(&views)?;
                new.halt_after(self.halted);
                *renderer = Some(new);
            }
        }
        self.simulate(self.simulated)?;
        self.fit_image_beside()?;
        taken |= self.fit_split(scene, &settings, made);
        if self.pose.is_of(&scene.motion) {
            let pose = std::mem::take(&mut self.pose);
            // A light that these frames cannot show so was told when the moment was asked for.
            let _ = self.pose(scene, &pose);
        }
        self.fit_over()?;
        self.changed = None;
        Ok(if taken { FitOutcome::Taken } else { FitOutcome::AtOnce })
    }

    /// Makes a swapchain for the window, and returns the settings and the plan of frames of its size. Returns none while the window has no pixels.
    fn fit_swapchain(&mut self, scene: &Scene, settings: &Settings) -> Result<Option<(Settings, FramePlan)>, Error> {
        loop {
            let Some(surface) = &self.surface else { return Ok(None) };
            let old = self.swapchain.take();
            self.swapchain = Swapchain::new(&self.device, surface, &self.desc, old)?;
            let Some(swapchain) = &self.swapchain else { return Ok(None) };
            let target = self.target(swapchain.formats, swapchain.usage);
            let settings = Settings { size: self.size_in(swapchain, target), ..settings.clone() };
            let plan = plan_for(&self.device, scene, &settings)?;
            let before = (self.desc.images, self.desc.usage);
            let (images, usage) = (self.wish_for(&plan), desc_for(&plan).usage);
            // New settings may need a swapchain with other images. That need does not depend on their size.
            self.desc = SwapchainDesc { images, usage, ..self.desc };
            if swapchain.formats.by_shader || (images, usage) == before {
                return Ok(Some((settings, plan.presented_as(target))));
            }
        }
    }

    /// Returns the swapchain images that the frames of a plan ask for.
    fn wish_for(&self, plan: &FramePlan) -> ImageWish {
        ImageWish { encodes: desc_for(plan).images.encodes, ..self.desc.images }
    }

    /// Makes the image that ENCODE reads where the picture is kept, or gives it up.
    fn fit_image_beside(&mut self) -> Result<(), Error> {
        let before = self.beside_kept.take();
        if let Some(renderer) = &self.renderer {
            let made = image_beside(&self.device, &renderer.plan, before);
            if made.is_err() {
                // ENCODE still has the image before in its descriptors. No frame is drawn until ENCODE is made again.
                self.encode = None;
            }
            self.beside_kept = made?;
        }
        Ok(())
    }

    /// Fits the overlay and ENCODE to the swapchain's images, and drops whichever does not fit.
    fn fit_over(&mut self) -> Result<(), Error> {
        let (Some(swapchain), Some(renderer)) = (&self.swapchain, &self.renderer) else { return Ok(()) };
        let encoded = encoded_image(renderer, self.beside_kept.as_ref());
        let over = Over::of(renderer, encoded, swapchain, self.desc.images);
        // Taken out first, so that an overlay that could not be fitted is dropped, not drawn.
        let overlay = self.overlay.take().filter(|own| {
            own.form() == (over.format, over.uploads.layouts, over.uploads.sync) && self.changed.is_none()
        });
        if let Some(mut overlay) = overlay {
            overlay.resize(&over.views, over.extent)?;
            self.overlay = Some(overlay);
        }
        let before = self.encode.take().filter(|_| self.changed.is_none());
        let (Some(picture), Some(encoding)) = (encoded, renderer.plan.encoding) else { return Ok(()) };
        let (format, transfer) = (swapchain.formats.drawn, encoding.transfer);
        let form = (renderer.plan.layouts, renderer.plan.sync);
        let mut encode = match before.filter(|before| before.is_for(format, transfer, form)) {
            Some(before) => before,
            None => Encode::new(&self.device, format, transfer, form)?,
        };
        encode.resize(picture.view, &swapchain.views(), swapchain.extent)?;
        self.encode = Some(encode);
        Ok(())
    }

    /// Makes the other picture as the frames are, or gives it up. Returns true if another thread's frames were adopted.
    fn fit_split(&mut self, scene: &Scene, settings: &Settings, made: Option<Rebuilt>) -> bool {
        let (Some(split), Some(renderer), Some(swapchain)) = (&mut self.split, &self.renderer, &self.swapchain) else {
            return false;
        };
        let can_split =
            swapchain.usage.contains(COPIED_INTO) || encoded_image(renderer, self.beside_kept.as_ref()).is_some();
        let fitted = match renderer.plan.presented.filter(|_| can_split) {
            Some(target) => split.fit((scene, settings), (renderer, target), self.changed, made),
            None => Err(gpu::Error::Unsupported("this window's images cannot be copied into".into()).into()),
        };
        fitted.unwrap_or_else(|error| {
            (self.split, self.refused) = (None, Some(error));
            false
        })
    }
}

/// Returns true if memory was lacking.
fn is_for_memory(error: &Error) -> bool {
    matches!(error, Error::Gpu(gpu::Error::OutOfMemory { .. } | gpu::Error::Allocator { .. }))
}
