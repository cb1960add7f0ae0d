//! Shows the last picture again: panels and messages over it change more often than the picture, which may take a CPU device seconds to draw.
//!
//! A picture that PRESENT copies stays in the frame's own image ([`Presenter::with_kept_pictures`]). [`Presenter::show_again`] repeats that copy and
//! the later steps in a separate submission. The rows of a whole frame order it: the row before PRESENT made the picture visible to copies of all
//! later commands, and the row that lets the next frame draw over the picture waits for all earlier copies. The crate `afterlight-proof` checks such
//! frames.

use std::sync::Arc;
use std::time::Duration;

use super::over::{Over, encoded_image, overlay, record_encode};
use super::{Outcome, Presenter};
use crate::frame::{Error, FrameTimes, IN_FLIGHT};
use crate::gpu::{self, Acquired, CommandBuffer, Device, Fit, Owned, SubmitOptions, Ticket, semaphore, vk};
use crate::passes::overlay::Panels;
use crate::scene::Camera;

/// The objects for showing a picture again. Frames in flight have their own.
pub(super) struct Again {
    cmd: CommandBuffer,
    acquired: Owned<vk::Semaphore>,
    pub(super) ticket: Option<Ticket>,
}

impl Again {
    fn new(device: &Arc<Device>) -> gpu::Result<Self> {
        let name = "the last picture again";
        let acquired = semaphore(device, &format!("swapchain image for {name} acquired"))?;
        Ok(Self { cmd: CommandBuffer::new(device, name)?, acquired, ticket: None })
    }
}

/// The picture that the frame's own image holds.
#[derive(Debug, Clone, Copy)]
pub(super) struct CachedPicture {
    camera: Camera,
    /// Something that it shows has changed since.
    is_stale: bool,
}

impl CachedPicture {
    pub(super) fn of(camera: &Camera) -> Self {
        Self { camera: *camera, is_stale: false }
    }
}

impl Presenter {
    /// Notes that the next frame shows something else than the last one.
    pub(super) fn outdate(&mut self) {
        if let Some(kept) = &mut self.cached_picture {
            kept.is_stale = true;
        }
    }

    /// Returns true if [`Presenter::show_again`] can show the last picture, whether or not another would be drawn now.
    pub fn has_picture(&self) -> bool {
        self.cached_picture.is_some()
    }

    /// Returns true if a frame from this camera would be the last picture again, and [`Presenter::show_again`] can show that. False
    /// while frames [converge](Presenter::converges), and without [`Presenter::with_kept_pictures`] unless a compute pass draws the picture.
    pub fn keeps(&self, camera: &Camera) -> bool {
        self.cached_picture.is_some_and(|kept| kept.camera == *camera && !kept.is_stale) && !self.converges()
    }

    /// The time that the last frame took to be recorded and drawn; none if it is not done yet, or the device measures no times.
    pub fn last_took(&self) -> Option<Duration> {
        let times = self.last_times()?;
        Some(Duration::from_secs_f64((times.record_ms + times.gpu_ms?) * 1e-3))
    }

    /// The times of the last frame, if it is done.
    pub(super) fn last_times(&self) -> Option<FrameTimes> {
        let renderer = self.renderer.as_ref()?;
        let place = (renderer.next + IN_FLIGHT - 1) % IN_FLIGHT;
        let last = &renderer.frames[place];
        let is_done = self.device.is_done(last.ticket?).unwrap_or(false);
        // Times and counts are read when they are there only.
        is_done.then_some(())?;
        let found = renderer.culling.as_ref().map(|culling| culling.found(place)).transpose().ok()?;
        last.times(&self.device, found).ok()
    }

    /// Shows the last picture again, with these panels and the divider at its new place. The scene is not drawn. `copied` as of
    /// [`Presenter::draw`]. Waits for the last frame that was shown so, and a moment for an image.
    ///
    /// # Errors
    /// As [`Presenter::draw`].
    pub fn show_again(&mut self, copied: bool, panels: Option<&Panels>) -> Result<Outcome, Error> {
        if self.cached_picture.is_none() || self.renderer.is_none() || self.swapchain.is_none() {
            return Ok(Outcome::Nothing(Fit::OutOfDate));
        }
        self.prepare_copy(copied)?;
        let mut again = self.again.take().map_or_else(|| Again::new(&self.device), Ok)?;
        // The row "frame-to-host".
        let waited = again.ticket.take().map_or(Ok(()), |ticket| self.device.wait(ticket));
        let shown = waited.map_err(Error::from).and_then(|()| self.show_with(&mut again, copied, panels));
        self.again = Some(again);
        shown
    }

    fn show_with(&mut self, again: &mut Again, copied: bool, panels: Option<&Panels>) -> Result<Outcome, Error> {
        let (Some(renderer), Some(swapchain)) = (&self.renderer, &self.swapchain) else {
            return Ok(Outcome::Nothing(Fit::OutOfDate));
        };
        let encoded = encoded_image(renderer, self.beside_kept.as_ref());
        let over = || Over::of(renderer, encoded, swapchain, self.desc.images);
        overlay(&self.device, &mut self.overlay, over, panels, IN_FLIGHT)?;
        let (index, fit) = match swapchain.acquire(&again.acquired)? {
            Acquired::Image(index, fit) => (index, fit),
            Acquired::Nothing(fit) => return Ok(Outcome::Nothing(fit)),
        };
        let submitted = self.submit_again(again, index, copied, panels);
        if submitted.is_err() {
            // As of a frame that could not be drawn: the image stays acquired, and nothing else would wait for the semaphore.
            let _ = self.device.consume(again.acquired.raw);
            self.swapchain = None;
        }
        submitted?;
        match (self.present(index, copied, panels)?, fit) {
            (Fit::Exact, fit) | (fit, _) => Ok(Outcome::Shown(fit)),
        }
    }

    /// Records PRESENT and the steps after it, and submits them.
    fn submit_again(
        &self,
        again: &mut Again,
        index: usize,
        copied: bool,
        panels: Option<&Panels>,
    ) -> Result<(), Error> {
        let (Some(renderer), Some(swapchain)) = (&self.renderer, &self.swapchain) else { return Ok(()) };
        let image = &swapchain.images[index];
        again.cmd.begin_by(renderer.plan.sync)?;
        let encoded = encoded_image(renderer, self.beside_kept.as_ref());
        let shown = encoded.map_or(image.raw, |own| own.raw);
        renderer.frame.present_again(&self.device, again.cmd.raw, (shown, swapchain.extent));
        self.record_over(again.cmd.raw, (index, IN_FLIGHT), copied, panels);
        if let (Some(encode), Some(picture)) = (&self.encode, encoded) {
            record_encode((&self.device, &renderer.rows), again.cmd.raw, (encode, picture), (index, image.raw));
        }
        again.cmd.end()?;
        let (waits, signals) = (&[(again.acquired.raw, self.acquire_stage())], &[image.drawn.raw]);
        again.ticket =
            Some(self.device.submit_with(&again.cmd, &SubmitOptions { waits, signals, ..SubmitOptions::default() })?);
        self.device.collect();
        Ok(())
    }
}
