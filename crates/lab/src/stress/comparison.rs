//! The beginning of every comparison: a picture of the subject, and the truth that it is held against.

use std::sync::Arc;

use super::StressError;
use super::pixel_errors::{PictureRenderer, Subject};
use afterlight::frame;
use afterlight::gpu::Device;
use afterlight::scene::{Scene, View, ev100_of, exposure_scale};
use afterlight_truth::reference::{CameraView, Reference};

pub(super) struct ReferenceComparison<'a> {
    /// Draws more views of the subject.
    pub pictures: PictureRenderer<'a>,
    /// RGBA of the view that is compared.
    pub drawn: Vec<f32>,
    pub reference: Reference<'a>,
    pub eye: CameraView,
    /// Factor from the truth's nits to the picture's light.
    pub exposure: f64,
}

impl<'a> ReferenceComparison<'a> {
    /// Draws the subject, in `view` if one is given, and prepares the reference of the scene `truth`.
    ///
    /// # Errors
    /// A lost device, a truth in which [`Scene::check`] finds a fault, and a subject that a plan refuses.
    pub fn of(
        device: &'a Arc<Device>,
        subject: &'a Subject,
        truth: &'a Scene,
        view: Option<View>,
    ) -> Result<Self, StressError> {
        let settings = subject.decided();
        let mut pictures = PictureRenderer::of(device, subject, &settings);
        let drawn = pictures.draw(view.unwrap_or(settings.view))?;
        let reference = Reference::new(truth).map_err(frame::Error::from)?;
        Ok(Self {
            pictures,
            drawn,
            reference: reference.with_settings(&settings, &truth.camera).with_occluded_sky(!subject.open_sky),
            eye: CameraView { camera: truth.camera, size: settings.size },
            exposure: f64::from(exposure_scale(ev100_of(truth, &settings))),
        })
    }
}
