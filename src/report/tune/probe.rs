//! The probe of a search: the device at hand, or in tests something that answers at once.
//!
//! One renderer of the settings as given stays: all others share its uploads, and take turns with it.

use std::sync::Arc;

use super::choice::{Bound, Goal};
use crate::frame::{Renderer, plan_for};
use crate::gpu::Device;
use crate::report::sweep::Error;
use crate::report::sweep::accuracy::{Drawing, Shown, Truths, light_by, of_light, shown_by};
use crate::report::sweep::families::settings_of;
use crate::report::sweep::journal::Drawn;
use crate::report::sweep::model::Metric;
use crate::report::sweep::timing::{Contender, Effort, Rounds, glance, take_turns, warm_up};
use crate::scene::{Camera, Scene, Settings, SettingsPatch};

/// Frames before a first look, on CPU devices and on GPUs: a driver compiles in the first.
const WARM_UP_FRAMES: [usize; 2] = [1, 3];

/// The effort of a measurement.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Look {
    /// Of a picture the part that the metric needs; of times a few rounds.
    Glance,
    /// Light and shown picture; all rounds.
    Whole,
}

/// Measures points from one camera.
pub trait Probe {
    /// A point's picture against the truth.
    ///
    /// # Errors
    /// When the device cannot draw it.
    fn draw(&mut self, point: &SettingsPatch, look: Look) -> Result<Drawn, Error>;

    /// The times of points beside the settings as given.
    ///
    /// # Errors
    /// When the device cannot hold or draw them.
    fn time(&mut self, points: &[SettingsPatch], look: Look, random: &mut fastrand::Rng) -> Result<Rounds, Error>;

    /// Returns about how much memory a renderer of the point takes on the device, in bytes.
    fn bytes(&self, point: &SettingsPatch) -> u64;
}

/// A device that draws a scene from one camera.
pub struct Bench<'a> {
    pub(super) device: &'a Arc<Device>,
    pub(super) scene: &'a Scene,
    pub(super) camera: Camera,
    /// The settings as given.
    pub(super) base: &'a SettingsPatch,
    pub(super) truths: Truths,
    pub(super) goal: Goal,
    pub(super) effort: Effort,
    /// The settings as given, once something was drawn.
    pub(super) anchor: Option<Contender>,
}

impl<'a> Bench<'a> {
    /// The same from another camera, which shares the uploads of this one.
    ///
    /// # Errors
    /// When the device lacks the memory.
    pub fn elsewhere(&mut self, camera: Camera, truths: Truths) -> Result<Self, Error> {
        let (scene, settings) = (self.scene, self.base.decide());
        let mut anchor = self.anchor()?.beside(scene, camera, &settings)?;
        warm_up(&mut [&mut anchor], self.effort.steady_frames)?;
        let Self { device, base, goal, effort, .. } = *self;
        Ok(Self { device, scene, camera, base, truths, goal, effort, anchor: Some(anchor) })
    }

    fn anchor(&mut self) -> Result<&mut Contender, Error> {
        if self.anchor.is_none() {
            let mut anchor = Contender::new(self.device, self.scene, self.camera, &self.base.decide())?;
            warm_up(&mut [&mut anchor], self.effort.steady_frames)?;
            self.anchor = Some(anchor);
        }
        self.anchor.as_mut().ok_or_else(|| Error::Refused("the settings as given are not drawn".into()))
    }

    /// Returns the settings with which a point draws its pictures. Nothing moves while a picture is drawn: maps of shadows are drawn once, and show the same.
    fn still(&self, point: &SettingsPatch) -> Settings {
        let mut settings = settings_of(point, self.base);
        settings.shadows.cache = true;
        settings
    }

    fn renderer(&mut self, settings: &Settings) -> Result<Renderer, Error> {
        let scene = self.scene;
        Ok(self.anchor()?.renderer().beside(scene, settings)?)
    }
}

impl Probe for Bench<'_> {
    fn draw(&mut self, point: &SettingsPatch, look: Look) -> Result<Drawn, Error> {
        let (settings, camera) = (self.still(point), self.camera);
        let (shows, lights) = match (look, self.goal.metric) {
            (Look::Whole, _) => (true, true),
            (Look::Glance, metric) => (metric == Metric::Flip, metric != Metric::Flip),
        };
        let memory = self.bytes(point);
        let mut gbuffer_bytes_per_pixel = 0;
        let mut by = |settings: &Settings| {
            let renderer = self.renderer(settings)?;
            gbuffer_bytes_per_pixel = renderer.plan().gbuffer_bytes_per_pixel();
            Ok::<_, Error>(renderer)
        };
        let light = lights.then(|| light_by(&mut by(&of_light(&settings))?, &camera, settings.size)).transpose()?;
        let shown = shows.then(|| shown_by(&mut by(&settings)?, &camera, settings.size)).transpose()?;
        let errors = match (light, shown) {
            (Some(light), Some(picture)) => {
                let shown = Shown { picture, memory, gbuffer_bytes_per_pixel };
                self.truths.errors(&Drawing { light, shown })?
            }
            (Some(light), None) => self.truths.error_of_light(&light)?,
            (None, Some(shown)) => self.truths.error_shown(&shown)?,
            (None, None) => return Err(Error::Refused("nothing was drawn".into())),
        };
        Ok(Drawn { errors, memory, gbuffer_bytes_per_pixel })
    }

    fn time(&mut self, points: &[SettingsPatch], look: Look, random: &mut fastrand::Rng) -> Result<Rounds, Error> {
        let (scene, camera, base, effort) = (self.scene, self.camera, self.base, self.effort);
        // A bound on time is one of whole pictures, with their way back and their mean.
        let is_bounded = matches!(self.goal.bound, Bound::Milliseconds(_));
        let frames = if look == Look::Whole && is_bounded { u32::MAX } else { 1 };
        let anchor = self.anchor()?;
        let kind = usize::from(!anchor.renderer().plan().software);
        anchor.warm_up_for(WARM_UP_FRAMES[kind])?;
        let contender = |point| anchor.beside(scene, camera, &settings_of(point, base));
        let mut others = points.iter().map(contender).collect::<Result<Vec<_>, _>>()?;
        for other in &mut others {
            other.warm_up_for(WARM_UP_FRAMES[kind])?;
        }
        // While pipelines were compiled or the CPU rendered truths, an idle GPU has lowered its clocks.
        let mut moving = false;
        if look == Look::Whole || !anchor.is_awake()? {
            let mut all: Vec<&mut Contender> = std::iter::once(&mut *anchor).chain(&mut others).collect();
            moving = !warm_up(&mut all, effort.steady_frames)?.settled;
        }
        let count = others.len() + 1;
        let draw = |index: usize| match index {
            0 => anchor.draw_frames(frames),
            index => others[index - 1].draw_frames(frames),
        };
        let rounds = match look {
            Look::Glance => glance(count, random, draw),
            Look::Whole => take_turns(count, &effort, random, draw),
        }?;
        Ok(Rounds { moving, ..rounds })
    }

    fn bytes(&self, point: &SettingsPatch) -> u64 {
        plan_for(self.device, self.scene, &settings_of(point, self.base)).map_or(0, |plan| plan.bytes())
    }
}
