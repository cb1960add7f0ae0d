//! The meter of a run: the device at hand, or in tests something that answers at once.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::accuracy::{PointPictures, Raw, Shown, Truths};
use super::attribution::{self, AttributedFrame, AttributionLimits};
use super::error::SweepError;
use super::families::{name_of, settings_of};
use super::journal::PictureFigures;
use super::model::Attribution;
use super::timing::{Effort, Rounds, TimedRenderer, take_turns, warm_up};
use afterlight::frame::{self, plan_for};
use afterlight::gpu::Device;
use afterlight::plan::effects;
use afterlight::scene::{Camera, Scene, SettingsPatch};
use afterlight_truth::measure::Srgb8Image;
use afterlight_truth::reference::{CameraView, Effects, Reference};

/// Measures points of one scene.
pub trait Meter {
    /// A point's pictures against the truth.
    ///
    /// # Errors
    /// When the device cannot draw it.
    fn draw(&mut self, point: &SettingsPatch) -> Result<PictureFigures, SweepError>;

    /// The times of points beside the settings as given.
    ///
    /// # Errors
    /// When the device cannot hold or draw them.
    fn time(&mut self, points: &[SettingsPatch], random: &mut fastrand::Rng) -> Result<Rounds, SweepError>;

    /// Returns about how much memory a renderer of the point takes on the device, in bytes.
    fn bytes(&self, point: &SettingsPatch) -> u64;
}

/// A device that draws a scene.
pub struct DeviceMeter<'a> {
    pub device: &'a Arc<Device>,
    pub scene: &'a Scene,
    pub camera: Camera,
    /// The settings as given.
    pub base: &'a SettingsPatch,
    pub truths: Truths,
    pub effort: Effort,
    /// The pictures of points, by their names, as far as there is room: some are shown again in the report.
    pub kept: BTreeMap<String, Srgb8Image>,
}

/// The most memory for pictures that are kept, in bytes.
const KEPT_BYTES: usize = 256 << 20;

impl DeviceMeter<'_> {
    /// Returns the picture of a point.
    ///
    /// # Errors
    /// When the device cannot draw it.
    pub fn shown(&self, point: &SettingsPatch) -> Result<Srgb8Image, SweepError> {
        if let Some(shown) = self.kept.get(&name_of(point)) {
            return Ok(shown.clone());
        }
        Ok(Shown::of(self.device, self.scene, &self.camera, &settings_of(point, self.base))?.picture)
    }

    fn keep(&mut self, point: &SettingsPatch, shown: Srgb8Image) {
        let bytes = shown.pixels.len() * 3;
        if (self.kept.len() + 1) * bytes <= KEPT_BYTES {
            self.kept.insert(name_of(point), shown);
        }
    }
}

impl DeviceMeter<'_> {
    /// Takes the error of the settings as given apart.
    ///
    /// # Errors
    /// When the device cannot draw the frames that it takes.
    pub fn attribution(&self, limits: &AttributionLimits) -> Result<Attribution, SweepError> {
        let settings = self.base.decide();
        let reference = Reference::new(self.scene).map_err(frame::Error::from)?;
        let plain = effects::set_aside(&settings);
        let reference = reference.with_settings(&plain, &self.camera);
        let view = CameraView { camera: self.camera, size: settings.size };
        let subject =
            AttributedFrame { scene: self.scene, reference: &reference, settings: &settings, view: &view, point: 0 };
        // The frame that is taken apart lacks the effects that are set aside.
        let is_plain = Effects::of(&plain) == Effects::of(&settings);
        let plain = (!is_plain).then(|| Raw::plain(&reference, &view, self.truths.info.samples));
        let raw = plain.as_ref().unwrap_or(&self.truths.raw);
        let truths = attribution::TruthPair { point: &raw.point, converged: &raw.converged };
        Ok(attribution::attribute(self.device, &subject, &truths, limits)?)
    }
}

impl Meter for DeviceMeter<'_> {
    fn draw(&mut self, point: &SettingsPatch) -> Result<PictureFigures, SweepError> {
        let drawing = PointPictures::of(self.device, self.scene, &self.camera, &settings_of(point, self.base))?;
        let errors = self.truths.errors(&drawing)?;
        let Shown { picture, memory, gbuffer_bytes_per_pixel } = drawing.shown;
        self.keep(point, picture);
        Ok(PictureFigures { errors, memory, gbuffer_bytes_per_pixel })
    }

    fn time(&mut self, points: &[SettingsPatch], random: &mut fastrand::Rng) -> Result<Rounds, SweepError> {
        let anchor = SettingsPatch::default();
        let all = std::iter::once(&anchor).chain(points);
        let contender =
            |point| TimedRenderer::new(self.device, self.scene, self.camera, &settings_of(point, self.base));
        let mut contenders = all.map(contender).collect::<Result<Vec<_>, _>>()?;
        let warm_up = warm_up(&mut contenders.iter_mut().collect::<Vec<_>>(), self.effort.steady_frames)?;
        let rounds = take_turns(contenders.len(), &self.effort, random, |index| contenders[index].draw())?;
        Ok(Rounds { moving: !warm_up.settled, ..rounds })
    }

    fn bytes(&self, point: &SettingsPatch) -> u64 {
        plan_for(self.device, self.scene, &settings_of(point, self.base)).map_or(0, |plan| plan.bytes())
    }
}
