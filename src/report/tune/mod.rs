//! The choice: settings from a measured front that keep a bound, verified from cameras that the front was not made with.
//!
//! [`choice`] decides, [`cameras`] says where else to look from, [`verify`] measures there, and [`evidence`] writes down what was chosen and
//! by what. The front itself comes from [`crate::report::sweep`].

pub mod cameras;
pub mod choice;
pub mod evidence;
pub mod verify;

pub use super::sweep::Error;
pub use super::sweep::families::Selection;
pub use super::sweep::model::Metric;
pub use choice::{Bound, Goal};

use std::collections::BTreeMap;
use std::sync::Arc;

use self::cameras::held_out;
use self::choice::{Outcome, Pair, Witness};
use self::verify::OnDevice;
use super::sweep::accuracy::Truths;
use super::sweep::families::{Sweep, name_of};
use super::sweep::journal::{Asked, Header, Journal, Record, SceneInfo};
use super::sweep::meter::DeviceMeter;
use super::sweep::model::{Against, LAYOUT, Point, SceneReport};
use super::sweep::run::{Run, Step, Watch};
use super::sweep::timing::Effort;
use super::sweep::{assemble, machine};
use crate::frame::{self, capabilities};
use crate::gpu::Device;
use crate::reference::{Reference, View};
use crate::scene::{Camera, Scene, SettingsPatch};

/// A search for settings, from a sweep of them.
#[derive(Clone, Copy)]
pub struct Tuning<'a> {
    /// Where frames are drawn and timed.
    pub device: &'a Arc<Device>,
    /// What is drawn.
    pub scene: &'a Scene,
    /// The settings as given, which the sweep changes.
    pub base: &'a SettingsPatch,
    /// The settings to choose from.
    pub sweep: &'a Sweep,
    /// What the choice must keep.
    pub goal: Goal,
    /// How well times are measured.
    pub effort: Effort,
    /// Decides the order of measuring.
    pub seed: u64,
}

/// What a search found.
pub struct Tuned {
    /// Error and time of all settings from the scene's own camera.
    pub scene: SceneReport,
    /// The settings of each of its points.
    pub patches: Vec<SettingsPatch>,
    /// The choice, and what was passed over.
    pub outcome: Outcome,
}

impl Tuned {
    /// The changes to the settings as given, if any keep the bound from every camera.
    pub fn choice(&self) -> Option<&SettingsPatch> {
        self.outcome.chosen.as_ref().map(|chosen| &self.patches[chosen.point])
    }
}

impl<'a> Tuning<'a> {
    /// Measures all settings from the scene's own camera against `own` truth, as far as the journal does not have them, then verifies candidates
    /// from the cameras that `elsewhere` brings with their truths. It is asked only if some settings keep the bound so far, or nearly do.
    ///
    /// # Errors
    /// When the device is lost or lacks the memory; what `elsewhere` fails with.
    pub fn run<E: From<Error>>(
        &self,
        journal: &mut Journal,
        own: Truths,
        watch: Watch,
        elsewhere: impl FnOnce() -> Result<Vec<(Camera, Truths)>, E>,
    ) -> Result<Tuned, E> {
        let scene = self.front(journal, own, watch)?;
        let known = |name: &str| self.sweep.points.iter().find(|patch| name_of(patch) == name).cloned();
        let patches: Vec<_> = scene.points.iter().map(|point| known(&point.name).unwrap_or_default()).collect();
        let cameras = if self.goal.is_near(&scene) { elsewhere()? } else { Vec::new() };
        let meters = cameras.into_iter().map(|(camera, truths)| self.meter(camera, truths)).collect();
        let mut witness = OnDevice::new(meters, patches.clone(), self.goal, self.seed);
        let outcome = self.goal.choose(&scene, &mut Watched { witness: &mut witness, points: &scene.points, watch })?;
        Ok(Tuned { scene, patches, outcome })
    }

    fn meter(&self, camera: Camera, truths: Truths) -> DeviceMeter<'a> {
        let Self { device, scene, base, effort, .. } = *self;
        DeviceMeter { device, scene, camera, base, truths, effort, kept: BTreeMap::new() }
    }

    /// What the journal must be of.
    pub fn info(&self, own: &Truths) -> SceneInfo {
        let fronts = vec![(self.goal.metric, Against::Converged)];
        SceneInfo::of(self.scene, self.base, self.sweep, own, fronts)
    }

    fn front(&self, journal: &mut Journal, own: Truths, watch: Watch) -> Result<SceneReport, Error> {
        if journal.scenes[0].info.is_none() {
            journal.add(0, Record::Scene { scene: 0, info: self.info(&own) })?;
        }
        let points = self.sweep.own(None);
        let mut run = Run { scene: 0, sweep: self.sweep, own: &points, seed: self.seed, journal, watch };
        run.measure(&mut self.meter(self.scene.camera, own))?;
        assemble::scene_report(&run.journal.scenes[0])
            .ok_or_else(|| Error::Refused(format!("nothing of {} was measured", self.scene.name)))
    }
}

/// Tells of each measurement before it is made.
struct Watched<'a, 'b> {
    witness: &'a mut OnDevice<'b>,
    points: &'a [Point],
    watch: Watch<'a>,
}

impl Witness for Watched<'_, '_> {
    fn cameras(&self) -> usize {
        self.witness.cameras()
    }

    fn measure(&mut self, camera: usize, point: usize) -> Result<Pair, Error> {
        let now = &self.points[point].name;
        let total = self.cameras();
        (self.watch)(Step { what: "other cameras", now, done: camera, total });
        self.witness.measure(camera, point)
    }
}

/// Finds settings among those of `selection` that keep the bound on this device, with the effort of `afterlight tune --quick`, and verifies
/// them from up to `cameras` other cameras.
///
/// # Errors
/// When the device cannot draw the scene as its settings are given, is lost or lacks the memory; when [`Scene::check`] finds a fault.
pub fn tune(
    device: &Arc<Device>,
    (scene, base): (&Scene, &SettingsPatch),
    selection: &Selection,
    goal: Goal,
    cameras: usize,
) -> Result<Tuned, Error> {
    const TRUTH_SAMPLES: u32 = 16;
    let settings = base.decide();
    let sweep = Sweep::of(scene, base, &capabilities(&device.physical), selection).map_err(frame::Error::from)?;
    let effort = Effort::QUICK;
    let truths = |camera| {
        Truths::of(scene, &View { camera, size: settings.size }, &settings, TRUTH_SAMPLES, &|_, _, _| {})
            .map(|truths| (camera, truths))
    };
    let Selection { families, joint, quick, seed } = selection.clone();
    let header = Header {
        layout: LAYOUT,
        version: env!("CARGO_PKG_VERSION").into(),
        build: machine::build(),
        machine: machine::here(&device.physical),
        shard: None,
        scenes: vec![scene.name.clone()],
        asked: Asked { families, joint, quick, rounds: effort.rounds, truth_samples: TRUTH_SAMPLES, seed },
    };
    let reference = Reference::new(scene).map_err(frame::Error::from)?;
    let others = held_out(&reference, &View { camera: scene.camera, size: settings.size }, cameras);
    let tuning = Tuning { device, scene, base, sweep: &sweep, goal, effort, seed };
    let (_, own) = truths(scene.camera)?;
    let folder = tempfile::tempdir().map_err(|error| Error::file("make a temporary folder", error))?;
    let mut journal = Journal::open(folder.path(), &header, true)?;
    tuning.run(&mut journal, own, &mut |_| {}, || others.iter().map(|other| truths(other.camera)).collect())
}
