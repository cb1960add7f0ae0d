//! The choice: settings that keep a bound, found by a search and verified from cameras that it was not made with.
//!
//! [`search`] chooses the next measurement, [`probe`] makes it, [`choice`] decides, [`cameras`] finds other cameras, [`verify`] measures from
//! them, and [`evidence`] writes the choice down with its evidence. Points and their families come from [`crate::report::sweep`].

pub mod cameras;
pub mod choice;
pub mod evidence;
pub mod probe;
pub mod search;
pub mod verify;

pub use super::sweep::Error;
pub use super::sweep::families::Selection;
pub use super::sweep::model::Metric;
pub use choice::{Bound, Goal};

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::{Duration, Instant};

use self::cameras::held_out;
use self::choice::Outcome;
use self::probe::{Bench, Look, Probe};
use self::search::{Search, Step as Next};
use self::verify::{Elsewhere, OnDevice};
use super::sweep::accuracy::Truths;
use super::sweep::families::{Sweep, name_of};
use super::sweep::journal::{Asked, Batch, Header, Journal, Record, SceneInfo};
use super::sweep::model::{Against, LAYOUT, SceneReport};
use super::sweep::run::{BATCH_BYTES, Step, Watch};
use super::sweep::timing::Effort;
use super::sweep::{assemble, machine};
use crate::frame::{self, capabilities};
use crate::gpu::Device;
use crate::reference::{Reference, View};
use crate::scene::{Camera, Scene, SettingsPatch};

/// Steps of a search that a candidate takes from one other camera, and that finalists take: pictures and times of two.
const STEPS_ELSEWHERE: u32 = 2;
const STEPS_AT_LAST: u32 = 2;
/// However long truths take, a search has this share of the time, counted from its own begin.
const LEAST_SHARE: f64 = 1.0 / 3.0;
/// The share of the time after which no batch has more rounds than an interval needs.
const BATCH_SHARE: f64 = 0.1;

/// A search for settings, from a sweep of them.
#[derive(Clone, Copy)]
pub struct Tuning<'a> {
    /// The device that draws and times frames.
    pub device: &'a Arc<Device>,
    /// The scene that is drawn.
    pub scene: &'a Scene,
    /// The settings as given, which the sweep changes.
    pub base: &'a SettingsPatch,
    /// The settings to choose from.
    pub sweep: &'a Sweep,
    /// The goal that the choice must keep.
    pub goal: Goal,
    /// The effort of measuring times.
    pub effort: Effort,
    /// Decides the order of measuring.
    pub seed: u64,
    /// The time, about, for all of it; without end for `None`.
    pub within: Option<Within>,
}

/// A time that a search should end in.
#[derive(Debug, Clone, Copy)]
pub struct Within {
    /// The moment at which it began.
    pub begun: Instant,
    /// Its length.
    pub time: Duration,
    /// Other cameras that verify the choice, and need their part of the time.
    pub cameras: u32,
    /// The time that the truth of the scene's own camera took: others take about as long.
    pub truth: Duration,
}

/// The result of a search.
pub struct Tuned {
    /// Error and time of the settings that were drawn and timed, from the scene's own camera.
    pub scene: SceneReport,
    /// The settings of each of its points.
    pub patches: Vec<SettingsPatch>,
    /// The choice, and the points that were passed over.
    pub outcome: Outcome,
    /// Names of the points that might have been the choice, and that the time was not enough for.
    pub not_measured: Vec<String>,
}

impl Tuned {
    /// The changes to the settings as given, if any keep the bound from every camera.
    pub fn choice(&self) -> Option<&SettingsPatch> {
        self.outcome.chosen.as_ref().map(|chosen| &self.patches[chosen.point])
    }
}

impl<'a> Tuning<'a> {
    /// Searches from the scene's own camera against `own` truth, going on from the journal, and verifies candidates from the cameras that
    /// `elsewhere` brings with their truths. `elsewhere` is asked only if some settings keep the bound so far, or nearly do.
    ///
    /// # Errors
    /// When the device cannot draw the settings as given, is lost or lacks the memory; when the journal cannot be written; and those of `elsewhere`.
    pub fn run<E: From<Error>>(
        &self,
        journal: &mut Journal,
        own: Truths,
        watch: Watch,
        elsewhere: impl FnOnce() -> Result<Vec<(Camera, Truths)>, E>,
    ) -> Result<Tuned, E> {
        if journal.scenes[0].info.is_none() {
            journal.add(0, Record::Scene { scene: 0, info: self.info(&own) })?;
        }
        let patches: BTreeMap<String, SettingsPatch> =
            self.sweep.points.iter().map(|patch| (name_of(patch), patch.clone())).collect();
        let watch = RefCell::new(watch);
        let bench = RefCell::new(self.bench(own));
        let mut run = SearchRun { tuning: self, journal, begun: Instant::now(), steps: 0, not_measured: Vec::new() };
        let mut search =
            |margin| run.until_done(&mut *bench.borrow_mut(), margin, &mut |step| (watch.borrow_mut())(step));
        let mut told = |step: Step| (watch.borrow_mut())(step);
        let witness = |_: &SceneReport| {
            let mut cameras = Vec::new();
            for (camera, truths) in elsewhere()? {
                let bench = bench.borrow_mut().elsewhere(camera, truths)?;
                cameras.push(Elsewhere { bench, default_error: None });
            }
            let random = fastrand::Rng::with_seed(self.seed);
            Ok::<_, E>(OnDevice { goal: self.goal, patches: &patches, cameras, random, watch: &mut told })
        };
        let (scene, outcome) = self.goal.choose(&mut search, witness)?;
        let known = |name: &str| patches.get(name).cloned();
        let patches = scene.points.iter().map(|point| known(&point.name).unwrap_or_default()).collect();
        Ok(Tuned { scene, patches, outcome, not_measured: run.not_measured })
    }

    fn bench(&self, truths: Truths) -> Bench<'a> {
        let Self { device, scene, base, effort, goal, .. } = *self;
        let longest = self.within.map_or(effort.longest, |within| effort.longest.min(within.time.mul_f64(BATCH_SHARE)));
        let effort = Effort { longest, ..effort };
        Bench { device, scene, camera: scene.camera, base, truths, goal, effort, anchor: None }
    }

    /// Returns the description that the journal must have.
    pub fn info(&self, own: &Truths) -> SceneInfo {
        let fronts = vec![(self.goal.metric, Against::Converged)];
        SceneInfo::of(self.scene, self.base, self.sweep, own, fronts)
    }
}

/// A search that measures.
struct SearchRun<'a, 'b> {
    tuning: &'a Tuning<'b>,
    journal: &'a mut Journal,
    /// The moment at which the first search began.
    begun: Instant,
    /// Taken so far.
    steps: u32,
    not_measured: Vec<String>,
}

impl SearchRun<'_, '_> {
    /// Takes step after step until there is none, or the time is over; then only those that a choice needs.
    fn until_done(&mut self, probe: &mut dyn Probe, margin: Option<f64>, watch: Watch) -> Result<SceneReport, Error> {
        loop {
            let search = self.search(margin)?;
            let (left, step) = (search.left().into_iter().map(str::to_owned).collect(), search.next());
            self.not_measured = left;
            match step {
                Some(step) => self.take(probe, &step, watch)?,
                None => {
                    let scene = self.scene()?;
                    // Light was not drawn so far where the metric needs none: only there pixels are seen that are not finite.
                    let candidate = self.tuning.goal.candidates(&scene, margin).first().copied();
                    let name = candidate.map(|candidate| scene.points[candidate].name.clone());
                    let partial = name.filter(|name| {
                        !self.journal.scenes[0].drawn.get(name).is_some_and(|drawn| drawn.errors.converged.is_whole())
                    });
                    let Some(name) = partial else { return Ok(scene) };
                    let index = self.tuning.sweep.points.iter().position(|patch| name_of(patch) == name);
                    self.draw(probe, index.unwrap_or(0), Look::Whole, watch)?;
                }
            }
        }
    }

    fn search(&self, margin: Option<f64>) -> Result<Search<'_>, Error> {
        let measured = &self.journal.scenes[0];
        let info = measured.info.as_ref().ok_or_else(|| Error::Refused("the journal has no scene".into()))?;
        Ok(Search { goal: &self.tuning.goal, info, measured, margin, is_late: self.is_late(margin.is_none()) })
    }

    /// A search that goes on since a candidate failed elsewhere has all time but that for verifying the next.
    fn is_late(&self, is_first: bool) -> bool {
        let Some(Within { begun, time, cameras, truth }) = self.tuning.within else { return false };
        let searched = self.begun.elapsed();
        let step = searched / self.steps.max(1);
        let elsewhere = step * STEPS_ELSEWHERE + if is_first { truth } else { Duration::ZERO };
        let rest = elsewhere * cameras + step * STEPS_AT_LAST;
        begun.elapsed() + rest > time && searched > time.mul_f64(LEAST_SHARE)
    }

    fn scene(&self) -> Result<SceneReport, Error> {
        let scene = assemble::scene_report(&self.journal.scenes[0]);
        scene.ok_or_else(|| Error::Refused(format!("nothing of {} was measured", self.tuning.scene.name)))
    }

    fn take(&mut self, probe: &mut dyn Probe, step: &Next, watch: Watch) -> Result<(), Error> {
        self.steps += 1;
        match step {
            Next::Draw(index) => self.draw(probe, *index, Look::Glance, watch),
            Next::Glance(points) => self.time(probe, points, Look::Glance, watch),
            Next::Confirm(points) => self.time(probe, points, Look::Whole, watch),
        }
    }

    fn name(&self, index: usize) -> String {
        name_of(&self.tuning.sweep.points[index])
    }

    fn draw(&mut self, probe: &mut dyn Probe, index: usize, look: Look, watch: Watch) -> Result<(), Error> {
        let (point, total) = (self.name(index), self.tuning.sweep.points.len());
        watch(Step { what: "pictures", now: &point, done: self.journal.scenes[0].drawn.len().min(total - 1), total });
        let record = match probe.draw(&self.tuning.sweep.points[index], look) {
            Ok(drawn) => Record::Drawn { scene: 0, point, drawn },
            Err(error) if index != 0 && error.is_of_point() => {
                Record::Failed { scene: 0, point, reason: error.to_string() }
            }
            Err(error) => return Err(error),
        };
        self.journal.add(0, record)
    }

    /// Times points together, as far as the device has room; a point that is too much alone as well is left out.
    fn time(&mut self, probe: &mut dyn Probe, points: &[usize], look: Look, watch: Watch) -> Result<(), Error> {
        let names: Vec<String> = points.iter().map(|&index| self.name(index)).collect();
        let (what, total) = match look {
            Look::Glance => ("times", self.tuning.sweep.points.len()),
            Look::Whole => ("times, again", points.len()),
        };
        let known = if look == Look::Glance { self.journal.scenes[0].timed().len() } else { 0 };
        watch(Step { what, now: &names.join(", "), done: known, total });
        let patches: Vec<SettingsPatch> = points.iter().map(|&index| self.tuning.sweep.points[index].clone()).collect();
        let bytes: u64 = patches.iter().map(|patch| probe.bytes(patch)).sum();
        if points.len() > 1 && bytes > BATCH_BYTES {
            return self.halves(probe, points, look, watch);
        }
        let before = self.journal.scenes[0].batches.len() as u64;
        let mut random = fastrand::Rng::with_seed(self.tuning.seed ^ (before << 32));
        let record = match probe.time(&patches, look, &mut random) {
            Ok(rounds) => {
                let batch = Batch { points: names, confirms: look == Look::Whole, rounds };
                Record::Batch { scene: 0, batch }
            }
            Err(error) if !error.is_of_point() || names.is_empty() => return Err(error),
            Err(_) if points.len() > 1 => return self.halves(probe, points, look, watch),
            Err(error) => Record::Failed { scene: 0, point: names.concat(), reason: error.to_string() },
        };
        self.journal.add(0, record)
    }

    fn halves(&mut self, probe: &mut dyn Probe, points: &[usize], look: Look, watch: Watch) -> Result<(), Error> {
        let (first, last) = points.split_at(points.len() / 2);
        self.time(probe, first, look, watch)?;
        self.time(probe, last, look, watch)
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
    let tuning = Tuning { device, scene, base, sweep: &sweep, goal, effort, seed, within: None };
    let (_, own) = truths(scene.camera)?;
    let folder = tempfile::tempdir().map_err(|error| Error::file("make a temporary folder", error))?;
    let mut journal = Journal::open(folder.path(), &header, true)?;
    tuning.run(&mut journal, own, &mut |_| {}, || others.iter().map(|other| truths(other.camera)).collect())
}
