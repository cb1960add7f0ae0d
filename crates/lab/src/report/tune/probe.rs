//! The probe of a search: the device at hand, or in tests something that answers at once.
//!
//! One renderer of the settings as given stays: all others share its uploads, and take turns with it. A truth may still be on its way, from another
//! thread: a GPU times frames meanwhile.

use std::sync::Arc;
use std::sync::mpsc::{Receiver, TryRecvError};
use std::thread;

use super::choice::{Goal, GoalBound};
use crate::report::sweep::SweepError;
use crate::report::sweep::accuracy::{PointPictures, Shown, Truths, light_by, of_light, shown_by};
use crate::report::sweep::families::settings_of;
use crate::report::sweep::journal::PictureFigures;
use crate::report::sweep::model::{Metric, TruthInfo};
use crate::report::sweep::timing::{Effort, Rounds, TimedRenderer, glance, take_turns, warm_up};
use afterlight::frame::{Renderer, plan_for};
use afterlight::gpu::Device;
use afterlight::scene::{Camera, Scene, Settings, SettingsPatch};
use afterlight_truth::measure::{LinearImage, Srgb8Image};

/// Frames before a first look, on CPU devices and on GPUs: a driver compiles in the first.
const WARM_UP_FRAMES: [usize; 2] = [1, 3];

/// Samples a pixel of the picture that stands in a truth's place.
pub const BEST_SAMPLES: u32 = 64;

/// The effort of a measurement.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ProbeEffort {
    /// Of a picture the part that the metric needs; of times a few rounds.
    Glance,
    /// Light and shown picture; all rounds.
    Whole,
}

/// A truth that is there, or on its way from another thread.
pub enum Awaited {
    /// Rendered, or read from the cache.
    Here(Box<Truths>),
    /// Sent when it is whole.
    Coming(Receiver<Result<Truths, SweepError>>),
}

impl From<Truths> for Awaited {
    fn from(truths: Truths) -> Self {
        Self::Here(Box::new(truths))
    }
}

impl Awaited {
    fn is_here(&mut self) -> Result<bool, SweepError> {
        if let Self::Coming(from) = self {
            *self = match from.try_recv() {
                Ok(truths) => truths?.into(),
                Err(TryRecvError::Empty) => return Ok(false),
                Err(TryRecvError::Disconnected) => return Err(lost()),
            };
        }
        Ok(true)
    }

    /// The truth, once it is there.
    fn get(&mut self) -> Result<&Truths, SweepError> {
        if let Self::Coming(from) = self {
            *self = from.recv().map_err(|_| lost())??.into();
        }
        match self {
            Self::Here(truths) => Ok(truths),
            Self::Coming(_) => Err(lost()),
        }
    }
}

fn lost() -> SweepError {
    SweepError::Refused("the thread that rendered the truth has ended without one".into())
}

/// Measures points from one camera.
pub trait Probe {
    /// Returns true if pictures can be compared with the truth without waiting for it.
    ///
    /// # Errors
    /// When the truth could not be rendered.
    fn can_draw(&mut self) -> Result<bool, SweepError> {
        Ok(true)
    }

    /// Waits for the truth and returns its samples, noise and size; `None` for a probe without a truth.
    ///
    /// # Errors
    /// When it could not be rendered.
    fn truth(&mut self) -> Result<Option<TruthInfo>, SweepError> {
        Ok(None)
    }

    /// A point's picture against the truth.
    ///
    /// # Errors
    /// When the device cannot draw it.
    fn draw(&mut self, point: &SettingsPatch, look: ProbeEffort) -> Result<PictureFigures, SweepError>;

    /// The times of points beside the settings as given.
    ///
    /// # Errors
    /// When the device cannot hold or draw them.
    fn time(
        &mut self,
        points: &[SettingsPatch],
        look: ProbeEffort,
        random: &mut fastrand::Rng,
    ) -> Result<Rounds, SweepError>;

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
    pub(super) truths: Awaited,
    /// The size of the pictures compared with the truth. Frames are timed at the settings' size.
    pub(super) size: [u32; 2],
    pub(super) goal: Goal,
    pub(super) effort: Effort,
    /// The settings as given, once something was drawn.
    pub(super) anchor: Option<TimedRenderer>,
}

impl<'a> Bench<'a> {
    /// Makes a bench for another camera and picture size, with a picture of the best settings in a truth's place. It shares the uploads of this one.
    ///
    /// # Errors
    /// When the device lacks the memory.
    pub fn elsewhere(&mut self, camera: Camera, size: [u32; 2], best: &SettingsPatch) -> Result<Self, SweepError> {
        let (scene, settings) = (self.scene, self.base.decide());
        let anchor = self.anchor()?.beside(scene, camera, &settings)?;
        let Self { device, base, goal, effort, .. } = *self;
        let truths = Truths::of_pictures(None, None).into();
        let mut other = Self { device, scene, camera, base, truths, size, goal, effort, anchor: Some(anchor) };
        let ProbePictures { light, shown, .. } = other.best_pictures(best)?;
        other.truths = Truths::of_pictures(light, shown).into();
        Ok(other)
    }

    /// Draws pictures of many samples with the best settings. If the best settings cannot draw many samples, the settings
    /// as given do; if these cannot either, they draw with their own number.
    fn best_pictures(&mut self, best: &SettingsPatch) -> Result<ProbePictures, SweepError> {
        let tries = [best, &SettingsPatch::default()].map(|patch| {
            let settings = self.still(patch);
            Settings { samples: settings.samples.max(BEST_SAMPLES), ..settings }
        });
        let given = self.still(&SettingsPatch::default());
        let mut last = None;
        for settings in tries.iter().chain([&given]) {
            match self.pictures(settings, ProbeEffort::Glance) {
                Err(error) if error.is_of_point() => last = Some(error),
                drawn => return drawn,
            }
        }
        Err(last.unwrap_or_else(lost))
    }

    fn anchor(&mut self) -> Result<&mut TimedRenderer, SweepError> {
        if self.anchor.is_none() {
            let mut anchor = TimedRenderer::new(self.device, self.scene, self.camera, &self.base.decide())?;
            warm_up(&mut [&mut anchor], self.effort.steady_frames)?;
            self.anchor = Some(anchor);
        }
        self.anchor.as_mut().ok_or_else(|| SweepError::Refused("the settings as given are not drawn".into()))
    }

    /// Returns the settings with which a point draws its pictures. Nothing moves while a picture is drawn: maps of shadows are drawn once, and show the same.
    fn still(&self, point: &SettingsPatch) -> Settings {
        let mut settings = settings_of(point, self.base);
        settings.shadows.cache = true;
        settings.size = self.size;
        settings
    }

    /// The pictures of settings that a look needs. If these are two, the driver compiles for both at once.
    fn pictures(&mut self, settings: &Settings, look: ProbeEffort) -> Result<ProbePictures, SweepError> {
        let (camera, scene) = (self.camera, self.scene);
        let (shows, lights) = match (look, self.goal.metric) {
            (ProbeEffort::Whole, _) => (true, true),
            (ProbeEffort::Glance, metric) => (metric == Metric::Flip, metric != Metric::Flip),
        };
        let anchor = self.anchor()?.renderer();
        let renderer = |is_needed: bool, settings: &Settings| -> Result<Option<Renderer>, SweepError> {
            Ok(is_needed.then(|| anchor.beside(scene, settings)).transpose()?)
        };
        let (light, shown) = rayon::join(|| renderer(lights, &of_light(settings)), || renderer(shows, settings));
        let (mut light, mut shown) = (light?, shown?);
        let one = shown.as_ref().or(light.as_ref());
        let gbuffer_bytes_per_pixel = one.map_or(0, |renderer| renderer.plan().gbuffer_bytes_per_pixel());
        let light = light.as_mut().map(|light| light_by(light, &camera, settings.size)).transpose()?;
        let shown = shown.as_mut().map(|shown| shown_by(shown, &camera, settings.size)).transpose()?;
        Ok(ProbePictures { light, shown, gbuffer_bytes_per_pixel })
    }
}

/// Makes a contender for each point, all at once: a GPU's driver compiles for a second or two for each, in the thread that asks.
fn beside(
    anchor: &TimedRenderer,
    points: &[SettingsPatch],
    make: &(dyn Fn(&TimedRenderer, &SettingsPatch) -> Result<TimedRenderer, SweepError> + Sync),
) -> Result<Vec<TimedRenderer>, SweepError> {
    thread::scope(|threads| {
        let made: Vec<_> = points.iter().map(|point| threads.spawn(move || make(anchor, point))).collect();
        let one = |thread: thread::ScopedJoinHandle<_>| {
            thread.join().unwrap_or_else(|_| Err(SweepError::Refused("a renderer's thread has panicked".into())))
        };
        made.into_iter().map(one).collect()
    })
}

/// Pictures of settings, as far as a look needs them.
struct ProbePictures {
    light: Option<LinearImage>,
    shown: Option<Srgb8Image>,
    gbuffer_bytes_per_pixel: u32,
}

impl Probe for Bench<'_> {
    fn can_draw(&mut self) -> Result<bool, SweepError> {
        self.truths.is_here()
    }

    fn truth(&mut self) -> Result<Option<TruthInfo>, SweepError> {
        let size = (self.size != self.base.decide().size).then_some(self.size);
        Ok(Some(TruthInfo { size, ..self.truths.get()?.info.clone() }))
    }

    fn draw(&mut self, point: &SettingsPatch, look: ProbeEffort) -> Result<PictureFigures, SweepError> {
        let settings = self.still(point);
        let memory = self.bytes(point);
        let ProbePictures { light, shown, gbuffer_bytes_per_pixel } = self.pictures(&settings, look)?;
        let truths = self.truths.get()?;
        let errors = match (light, shown) {
            (Some(light), Some(picture)) => {
                let shown = Shown { picture, memory, gbuffer_bytes_per_pixel };
                truths.errors(&PointPictures { light, shown })?
            }
            (Some(light), None) => truths.error_of_light(&light)?,
            (None, Some(shown)) => truths.error_shown(&shown)?,
            (None, None) => return Err(SweepError::Refused("nothing was drawn".into())),
        };
        Ok(PictureFigures { errors, memory, gbuffer_bytes_per_pixel })
    }

    fn time(
        &mut self,
        points: &[SettingsPatch],
        look: ProbeEffort,
        random: &mut fastrand::Rng,
    ) -> Result<Rounds, SweepError> {
        let (scene, camera, base, effort) = (self.scene, self.camera, self.base, self.effort);
        // A bound on time is one of whole pictures, with their way back and their mean.
        let is_bounded = matches!(self.goal.bound, GoalBound::Milliseconds(_));
        let frames = if look == ProbeEffort::Whole && is_bounded { u32::MAX } else { 1 };
        let anchor = self.anchor()?;
        let kind = usize::from(!anchor.renderer().plan().software);
        anchor.warm_up_for(WARM_UP_FRAMES[kind])?;
        let mut others =
            beside(anchor, points, &|anchor, point| anchor.beside(scene, camera, &settings_of(point, base)))?;
        for other in &mut others {
            other.warm_up_for(WARM_UP_FRAMES[kind])?;
        }
        // While pipelines were compiled or the CPU rendered truths, an idle GPU has lowered its clocks.
        let mut moving = false;
        if look == ProbeEffort::Whole || !anchor.is_awake()? {
            let mut all: Vec<&mut TimedRenderer> = std::iter::once(&mut *anchor).chain(&mut others).collect();
            moving = !warm_up(&mut all, effort.steady_frames)?.settled;
        }
        let count = others.len() + 1;
        let draw = |index: usize| match index {
            0 => anchor.draw_frames(frames),
            index => others[index - 1].draw_frames(frames),
        };
        let rounds = match look {
            ProbeEffort::Glance => glance(count, random, draw),
            ProbeEffort::Whole => take_turns(count, &effort, random, draw),
        }?;
        Ok(Rounds { moving, ..rounds })
    }

    fn bytes(&self, point: &SettingsPatch) -> u64 {
        plan_for(self.device, self.scene, &settings_of(point, self.base)).map_or(0, |plan| plan.bytes())
    }
}
