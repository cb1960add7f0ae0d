//! A second picture of the same camera; a window shows its part right of a divider.
//!
//! A separate headless renderer draws it, in a submission before the window's frame. SPLIT then copies that part over the window's picture. The row
//! "read-back" makes the other picture ready for the copy, and the row from OUTSIDE to its first user holds the next picture back until the copy is
//! done. Both rows order across submissions to one queue.

use std::sync::Arc;

use ash::vk;

use super::builder::RendererBuilder;
use super::rebuild::Rebuilt;
use super::render_passes::image_barrier;
use super::rows::{self, RowName, Rows};
use super::{Error, Renderer, plan_for};
use crate::gpu::Device;
use crate::gpu::barrier::ImageRange;
use crate::passes::split;
use crate::plan::{self, PresentTarget};
use crate::scene::{Camera, Light, Pose, Scene, Settings, View};

/// Another view beside the window's own.
pub(super) struct Split {
    pub(super) view: View,
    /// The part of the width that is left of the divider, 0 to 1.
    pub(super) at: f64,
    /// Absent until the window has had pixels.
    renderer: Option<Renderer>,
}

impl Split {
    /// Puts the divider in the middle at first.
    pub(super) fn new(view: View) -> Self {
        Self { view, at: 0.5, renderer: None }
    }

    /// Releases the scene on the device before another is uploaded: a device may not hold two.
    pub(super) fn give_up(&mut self) {
        self.renderer = None;
    }

    /// Returns the builder with which another thread can make the other picture's renderer, if it needs to change (always if `changed`). `own` builds
    /// the window's frames beside it; without it the `shown` ones go on. Returns none if nothing is to be made, or if only [`Split::fit`] can report
    /// the error.
    pub(super) fn builder(
        &self,
        (scene, settings): (&Scene, &Settings),
        (own, shown, target): (Option<&RendererBuilder>, &Renderer, PresentTarget),
        changed: bool,
    ) -> Option<RendererBuilder> {
        let device = &shown.device;
        let settings = Settings { view: self.view, ..settings.clone() };
        let plan = plan_for(device, scene, &settings).ok()?.copied_to(target).of_one_pixel();
        let as_it_is = |renderer: &&Renderer| !changed && renderer.plan.differs_in_size_only(&plan);
        if self.renderer.as_ref().filter(as_it_is).is_some() {
            return None;
        }
        let uploaded = own.and_then(|own| own.uploaded_for(&plan)).or_else(|| shown.uploaded_for(&plan));
        let uploaded = uploaded.or_else(|| self.renderer.as_ref()?.uploaded_for(&plan));
        let rows = rows::table(&plan);
        RendererBuilder::new(device, scene, &settings, (plan, rows), uploaded).ok()
    }

    /// Makes the renderer of the other picture for images of this `target`. `settings` are the window's settings, except for the view. `changed` as
    /// in [`super::Presenter::change`]; `beside` draws the window's own frames, and shares the scene on the device if both plans upload the same.
    /// Returns true if it adopted the renderer that another thread has `made`, because it fits.
    ///
    /// # Errors
    /// When the view cannot be planned with these settings, or the device lacks the memory.
    pub(super) fn fit(
        &mut self,
        (scene, settings): (&Scene, &Settings),
        (beside, target): (&Renderer, PresentTarget),
        changed: Option<bool>,
        made: Option<Rebuilt>,
    ) -> Result<bool, Error> {
        let device = &beside.device;
        let settings = Settings { view: self.view, ..settings.clone() };
        let plan = plan_for(device, scene, &settings)?.copied_to(target);
        let made = made.and_then(|mut made| {
            let new = made.beside.take()?.ok().filter(|new| new.plan.differs_in_size_only(&plan))?;
            made.caught_up(new, scene, &settings)
        });
        let taken = made.is_some();
        match (made, &mut self.renderer) {
            (Some(new), renderer) => {
                *renderer = None;
                *renderer = Some(new.resized(plan, &[])?);
            }
            (None, renderer)
                if changed.is_none() && renderer.as_ref().is_some_and(|own| own.plan.differs_in_size_only(&plan)) =>
            {
                *renderer = renderer.take().map(|own| own.resized(plan, &[])).transpose()?;
            }
            (None, renderer) => {
                let own = renderer.take().filter(|_| changed != Some(true));
                let uploaded = beside.uploaded_for(&plan).or_else(|| own.as_ref()?.uploaded_for(&plan));
                drop(own);
                let rows = rows::table(&plan);
                *renderer = Some(RendererBuilder::new(device, scene, &settings, (plan, rows), uploaded)?.finish(&[])?);
            }
        }
        Ok(taken)
    }

    /// Draws the other picture in a separate submission.
    ///
    /// # Errors
    /// When the device is lost or out of memory, or cannot draw from this camera.
    pub(super) fn draw(&mut self, camera: &Camera) -> Result<(), Error> {
        self.renderer.as_mut().map_or(Ok(()), |renderer| renderer.render(camera))
    }

    /// Copies its part over the window's picture, and leaves that picture in the layout that it had before. `rows` belong to the frame that is being
    /// recorded.
    pub(super) fn record(&self, device: &Arc<Device>, rows: &Rows, (cmd, image): (vk::CommandBuffer, vk::Image)) {
        let Some(picture) = self.renderer.as_ref().and_then(|renderer| renderer.frame.output(&renderer.plan)) else {
            return;
        };
        let first = (self.at.clamp(0.0, 1.0) * f64::from(picture.extent.width)).round() as u32;
        let whole = ImageRange::whole(image, vk::ImageAspectFlags::COLOR);
        device.begin_label(cmd, "SPLIT");
        image_barrier(device, cmd, whole, rows.find(RowName::PICTURE_TO_SPLIT));
        split::record(device, cmd, (picture, first), (image, rows.layouts));
        image_barrier(device, cmd, whole, rows.find(RowName::SPLIT_TO_PICTURE));
        device.end_label(cmd);
    }

    /// As [`Presenter::set_light`](super::Presenter::set_light).
    pub(super) fn set_light(&mut self, index: usize, light: &Light) -> Result<bool, Error> {
        self.renderer.as_mut().map_or(Ok(true), |renderer| Ok(renderer.world.set_light(index, light)?))
    }

    /// As [`Renderer::pose`].
    pub(super) fn pose(&mut self, scene: &Scene, pose: &Pose) -> Result<(), Error> {
        self.renderer.as_mut().map_or(Ok(()), |renderer| renderer.pose(scene, pose))
    }

    /// As [`Renderer::set_exposure`].
    pub(super) fn set_exposure(&mut self, ev100: f32) -> Result<(), Error> {
        self.renderer.as_mut().map_or(Ok(()), |renderer| renderer.set_exposure(ev100))
    }

    /// Checks that a camera can be drawn with its plan.
    pub(super) fn check_camera(&self, camera: &Camera) -> Result<(), plan::PlanError> {
        self.renderer.as_ref().map_or(Ok(()), |renderer| renderer.plan.check_camera(camera))
    }
}
