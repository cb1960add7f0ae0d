//! One frame of a window: drawn, with everything over it, submitted and presented, and its picture read.

use ash::vk;

use super::again::CachedPicture;
use super::over::{Over, encoded_image, overlay, record_copy, record_encode};
use super::{Outcome, Presenter, copies_whole};
use crate::frame::read_back::{picture_of, picture_up_to_white};
use crate::frame::render_passes::image_barrier;
use crate::frame::rows::RowName;
use crate::frame::{Error, Picture};
use crate::gpu::barrier::ImageRange;
use crate::gpu::{self, Acquired, Fit, SubmitOptions, Timestamps};
use crate::passes::copy::Copy;
use crate::passes::overlay::Panels;
use crate::plan::FramePlan;
use crate::scene::Camera;

impl Presenter {
    /// Draws a frame and has it shown. Waits for the frame before the last, and a moment for an image. With `copied`, its picture can be had
    /// from [`Presenter::picture`], with the view beside it, without the panels that lie over it; then it waits for the last frame as well, if
    /// that has a picture which nobody has read.
    ///
    /// # Errors
    /// When the device is lost or out of memory, or cannot draw from this camera; the image cannot be copied from.
    pub fn draw(&mut self, camera: &Camera, copied: bool, panels: Option<&Panels>) -> Result<Outcome, Error> {
        if let (Some(renderer), Some(_)) = (&self.renderer, &self.swapchain) {
            // Everything that can fail comes before the image is acquired: an acquired image must be presented.
            renderer.plan.check_camera(camera)?;
            if renderer.plan.encoding.is_some() != self.encode.is_some() {
                // It could not be made.
                return Ok(Outcome::Nothing(Fit::OutOfDate));
            }
        }
        let last_times = self.last_times();
        self.prepare_copy(copied)?;
        if self.split.is_some() {
            // The picture beside is drawn in any case, the window's own only into an image that is there.
            self.outdate();
        }
        let (Some(renderer), Some(swapchain)) = (&mut self.renderer, &self.swapchain) else {
            return Ok(Outcome::Nothing(Fit::OutOfDate));
        };
        if let Some(split) = &mut self.split {
            split.draw(camera)?;
        }
        // The semaphore's last wait is over then.
        let older_times = renderer.free_place()?;
        // Once another frame follows, `times` cannot ask for the last one's.
        if let Some(times) = last_times.or(older_times) {
            self.times = times;
        }
        let place = renderer.next;
        let encoded = encoded_image(renderer, self.beside_kept.as_ref());
        let over = || Over::of(renderer, encoded, swapchain, self.desc.images);
        overlay(&self.device, &mut self.overlay, over, panels, place)?;
        let acquired = &self.acquired[place];
        let (index, fit) = match swapchain.acquire(acquired)? {
            Acquired::Image(index, fit) => (index, fit),
            Acquired::Nothing(fit) => return Ok(Outcome::Nothing(fit)),
        };
        self.cached_picture = None;
        let shown = self.draw_into(index, camera, copied, panels);
        if shown.is_err() {
            // The image stays acquired, which only the end of its swapchain changes; the next fit makes another.
            self.swapchain = None;
        }
        let shown = shown?;
        self.cached_picture =
            self.plan().is_some_and(FramePlan::is_copied_to_be_shown).then(|| CachedPicture::of(camera));
        match (shown, fit) {
            (Fit::Exact, fit) | (fit, _) => Ok(Outcome::Shown(fit)),
        }
    }

    /// Sees to it that the next frame's picture can be copied, if it is to be.
    pub(super) fn prepare_copy(&mut self, copied: bool) -> Result<(), Error> {
        let can_copy = self.can_copy();
        let Some(renderer) = self.renderer.as_ref().filter(|_| copied && self.swapchain.is_some()) else {
            return Ok(());
        };
        if self.screenshot.is_none() {
            if !can_copy {
                return Err(gpu::Error::Unsupported("this window's images cannot be copied from".into()).into());
            }
            self.screenshot = Some(Copy::new(&self.device, &renderer.plan)?);
        }
        if self.is_copied {
            // Two pictures would be written in one place.
            self.wait()?;
        }
        Ok(())
    }

    /// Waits for all frames.
    pub(super) fn wait(&mut self) -> Result<(), Error> {
        if let Some(renderer) = &mut self.renderer {
            renderer.wait()?;
        }
        match self.again.as_ref().and_then(|again| again.ticket) {
            Some(ticket) => Ok(self.device.wait(ticket)?),
            None => Ok(()),
        }
    }

    /// The stage at which a frame waits for its image: the row "acquire".
    pub(super) fn acquire_stage(&self) -> vk::PipelineStageFlags2 {
        let row = self.renderer.as_ref().and_then(|renderer| renderer.rows.find(RowName::ACQUIRE));
        row.map_or(vk::PipelineStageFlags2::ALL_COMMANDS, |row| row.after.stage)
    }

    /// Draws into an image that is acquired, and presents it.
    fn draw_into(
        &mut self,
        index: usize,
        camera: &Camera,
        copied: bool,
        panels: Option<&Panels>,
    ) -> Result<Fit, Error> {
        let (Some(renderer), Some(swapchain)) = (&mut self.renderer, &self.swapchain) else {
            return Ok(Fit::OutOfDate);
        };
        let (place, image) = (renderer.next, &swapchain.images[index]);
        let acquired = self.acquired[place].raw;
        let shown = encoded_image(renderer, self.beside_kept.as_ref()).map_or(image.raw, |own| own.raw);
        let recorded = renderer.record(camera, [0.0; 2], Some((index, (shown, swapchain.extent))));
        // Nothing else would wait for the semaphore, and it could not be used again.
        let recorded = recorded.inspect_err(|_| _ = self.device.consume(acquired))?;
        let cmd = renderer.frames[place].cmd.raw;
        self.record_over(cmd, (index, place), copied, panels);
        let stage = self.acquire_stage();
        let (Some(renderer), Some(swapchain)) = (&mut self.renderer, &self.swapchain) else {
            return Ok(Fit::OutOfDate);
        };
        let image = &swapchain.images[index];
        if let Some(encode) = &self.encode {
            if self.split.is_some() || copied || panels.is_some() {
                // The overlay's time is not ENCODE's.
                Timestamps::stamp(&mut renderer.frames[place].times, cmd, "over the picture");
            }
            if let Some(picture) = encoded_image(renderer, self.beside_kept.as_ref()) {
                record_encode((&self.device, &renderer.rows), cmd, (encode, picture), (index, image.raw));
            }
            Timestamps::stamp(&mut renderer.frames[place].times, cmd, "encode");
        }
        // The rows "acquire" and "present".
        let (waits, signals) = (&[(acquired, stage)], &[image.drawn.raw]);
        let submitted = renderer.submit(recorded, &SubmitOptions { waits, signals, ..SubmitOptions::default() });
        submitted.inspect_err(|_| _ = self.device.consume(acquired))?;
        self.present(index, copied, panels)
    }

    /// Records SPLIT, COPY and OVERLAY after the picture. `place` is where [`OverlayPass::write`](crate::passes::overlay::OverlayPass::write) has put the panels.
    pub(super) fn record_over(
        &self,
        cmd: vk::CommandBuffer,
        (index, place): (usize, usize),
        copied: bool,
        panels: Option<&Panels>,
    ) {
        let (Some(renderer), Some(swapchain)) = (&self.renderer, &self.swapchain) else { return };
        let image = &swapchain.images[index];
        let encoded = encoded_image(renderer, self.beside_kept.as_ref());
        let picture = encoded.map_or(image.raw, |own| own.raw);
        if let Some(split) = &self.split {
            split.record(&self.device, &renderer.rows, (cmd, picture));
        }
        if let Some(copy) = self.screenshot.as_ref().filter(|_| copied) {
            let swapchain_image = copies_whole(swapchain, &renderer.plan).then_some(image.raw);
            record_copy(renderer, cmd, copy, (swapchain_image, encoded));
        }
        if let (Some(overlay), Some(panels)) = (&self.overlay, panels) {
            let whole = ImageRange::whole(picture, vk::ImageAspectFlags::COLOR);
            image_barrier(&self.device, cmd, whole, renderer.rows.find(RowName::PICTURE_TO_OVERLAY));
            overlay.record(cmd, index, place, panels);
            image_barrier(&self.device, cmd, whole, renderer.rows.find(RowName::OVERLAY_TO_PICTURE));
        }
    }

    /// Presents an image whose frame is submitted.
    pub(super) fn present(&mut self, index: usize, copied: bool, panels: Option<&Panels>) -> Result<Fit, Error> {
        let Some(swapchain) = &self.swapchain else { return Ok(Fit::OutOfDate) };
        self.is_copied |= copied;
        // A texture that is given up before a frame is submitted could be destroyed before the frame is done.
        if let (Some(overlay), Some(panels)) = (&mut self.overlay, panels) {
            overlay.forget(&panels.spent);
        }
        Ok(swapchain.present(index)?)
    }

    /// The picture of the last frame, which was drawn to be copied. Waits for it.
    ///
    /// # Errors
    /// When it was not, or the device is lost.
    pub fn picture(&mut self) -> Result<Picture, Error> {
        // The row "copy-to-host".
        self.wait()?;
        let (Some(renderer), Some(swapchain), Some(copy)) = (&self.renderer, &self.swapchain, &self.screenshot) else {
            return Err(gpu::Error::Misuse("a picture of a window is read that was not copied".into()).into());
        };
        self.is_copied = false;
        if renderer.plan.encoding.is_some() {
            return picture_up_to_white(copy, renderer.plan.size);
        }
        let format =
            if copies_whole(swapchain, &renderer.plan) { swapchain.formats.drawn } else { renderer.plan.output };
        picture_of(copy, renderer.plan.size, format)
    }
}
