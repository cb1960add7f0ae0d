//! The beginning of every comparison: a picture of the subject, and the truth that it is held against.

use std::sync::Arc;

use super::Error;
use super::pixel_errors::{Pictures, Subject};
use afterlight::frame;
use afterlight::gpu::Device;
use afterlight::scene::{Scene, View, ev100_of, exposure_scale};
use afterlight_truth::reference::{Reference, View as Eye};

pub(super) struct Comparison<'a> {
    /// For more views of the subject.
    pub pictures: Pictures<'a>,
    /// RGBA of the view that is compared.
    pub drawn: Vec<f32>,
    pub reference: Reference<'a>,
    pub eye: Eye,
    /// From the truth's nits to the picture's light.
    pub exposure: f64,
}

impl<'a> Comparison<'a> {
    /// Draws the subject, or a view of it in place of its own, and gets the truth of a scene ready.
    ///
    /// # Errors
    /// A lost device, a truth in which [`Scene::check`] finds a fault, and a subject that a plan refuses.
    pub fn of(
        device: &'a Arc<Device>,
        subject: &'a Subject,
        truth: &'a Scene,
        view: Option<View>,
    ) -> Result<Self, Error> {
        let settings = subject.decided();
        let mut pictures = Pictures::of(device, subject, &settings);
        let drawn = pictures.draw(view.unwrap_or(settings.view))?;
        let reference = Reference::new(truth).map_err(frame::Error::from)?;
        Ok(Self {
            pictures,
            drawn,
            reference: reference.with_settings(&settings, &truth.camera).with_occluded_sky(!subject.open_sky),
            eye: Eye { camera: truth.camera, size: settings.size },
            exposure: f64::from(exposure_scale(ev100_of(truth, &settings))),
        })
    }
}
