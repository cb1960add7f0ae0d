//! What a run measures with: the device at hand, or in tests something that answers at once.

use std::sync::Arc;

use super::error::Error;
use super::families::settings_of;
use super::journal::Drawn;
use super::picture::{Drawing, Truths};
use super::timing::{Contender, Effort, Rounds, take_turns};
use crate::frame::plan_for;
use crate::gpu::Device;
use crate::scene::{Camera, Scene, SettingsPatch};

/// Measures points of one scene.
pub trait Meter {
    /// A point's pictures against the truth.
    ///
    /// # Errors
    /// When the device cannot draw it.
    fn draw(&mut self, point: &SettingsPatch) -> Result<Drawn, Error>;

    /// The times of points beside the settings as given.
    ///
    /// # Errors
    /// When the device cannot hold or draw them.
    fn time(&mut self, points: &[SettingsPatch], random: &mut fastrand::Rng) -> Result<Rounds, Error>;

    /// What a renderer of it takes on the device, about, in bytes.
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
}

impl DeviceMeter<'_> {
    /// A point's pictures.
    ///
    /// # Errors
    /// When the device cannot draw them.
    pub fn drawing(&self, point: &SettingsPatch) -> Result<Drawing, Error> {
        Drawing::of(self.device, self.scene, &self.camera, &settings_of(point, self.base))
    }
}

impl Meter for DeviceMeter<'_> {
    fn draw(&mut self, point: &SettingsPatch) -> Result<Drawn, Error> {
        let drawing = self.drawing(point)?;
        Ok(Drawn {
            errors: self.truths.errors(&drawing)?,
            memory: drawing.memory,
            gbuffer_bytes_per_pixel: drawing.gbuffer_bytes_per_pixel,
        })
    }

    fn time(&mut self, points: &[SettingsPatch], random: &mut fastrand::Rng) -> Result<Rounds, Error> {
        let anchor = SettingsPatch::default();
        let all = std::iter::once(&anchor).chain(points);
        let contender = |point| Contender::new(self.device, self.scene, &self.camera, &settings_of(point, self.base));
        let mut contenders = all.map(contender).collect::<Result<Vec<_>, _>>()?;
        for contender in &mut contenders {
            contender.warm_up()?;
        }
        take_turns(contenders.len(), &self.effort, random, |index| contenders[index].draw())
    }

    fn bytes(&self, point: &SettingsPatch) -> u64 {
        plan_for(self.device, self.scene, &settings_of(point, self.base)).map_or(0, |plan| plan.bytes())
    }
}
