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

pub use super::sweep::SweepError;
pub use super::sweep::families::Selection;
pub use super::sweep::model::Metric;
pub use choice::{Goal, GoalBound};

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::num::NonZero;
use std::sync::Arc;
use std::thread;
use std::time::{Duration, Instant};

use self::cameras::held_out;
use self::choice::SearchResult;
use self::probe::{Awaited, BEST_SAMPLES, Bench, Probe, ProbeEffort};
use self::search::{Search, SearchStep};
use self::verify::{CameraBench, DeviceWitness};
use super::sweep::accuracy::Truths;
use super::sweep::families::{Sweep, name_of};
use super::sweep::journal::{Batch, Journal, JournalHeader, JournalRecord, SceneInfo, SweepOptions};
use super::sweep::model::{Against, LAYOUT, Point, SceneReport, TruthInfo};
use super::sweep::run::{BATCH_BYTES, SceneProgress, StepObserver};
use super::sweep::timing::Effort;
use super::sweep::{assemble, machine};
use afterlight::frame::{self, capabilities};
use afterlight::gpu::{Device, vk};
use afterlight::scene::{Camera, Scene, SettingsPatch};
use afterlight_truth::reference::{CameraView, Reference};

/// The number of points that get a glance together. The second is for GPUs on machines with at least as many cores: the driver then compiles for all
/// points at once.
const GLANCES: [usize; 2] = [4, 8];
/// However long the truth takes, a search has this share of the time, counted from its own begin.
const LEAST_SHARE: f64 = 1.0 / 3.0;
/// The share of the time that is kept for what nobody can foresee.
const SPARE_SHARE: f64 = 0.1;
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
    /// The size of the truth and of the pictures compared with it. Frames are timed at the settings' own size.
    pub error_size: [u32; 2],
}

/// A time that a search should end in.
#[derive(Debug, Clone, Copy)]
pub struct Within {
    /// The moment at which it began.
    pub begun: Instant,
    /// The time limit.
    pub time: Duration,
    /// Other cameras that verify the choice, and need their part of the time.
    pub cameras: u32,
}

/// The result of a search.
pub struct Tuned {
    /// Error and time of the settings that were drawn and timed, from the scene's own camera.
    pub scene: SceneReport,
    /// The settings of each of its points.
    pub patches: Vec<SettingsPatch>,
    /// The choice, and the points that were passed over.
    pub outcome: SearchResult,
    /// Names of the points that might have been the choice, and that the time was not enough for.
    pub not_measured: Vec<String>,
    /// The name of the settings whose pictures stood in a truth's place elsewhere; `None` where no camera was looked from.
    pub best: Option<String>,
}

impl Tuned {
    /// The changes to the settings as given, if any keep the bound from every camera.
    pub fn choice(&self) -> Option<&SettingsPatch> {
        self.outcome.chosen.as_ref().map(|chosen| &self.patches[chosen.point])
    }
}

impl<'a> Tuning<'a> {
    /// Searches from the scene's own camera against `own` truth, going on from the journal, and verifies candidates from the cameras `elsewhere`,
    /// against pictures of the settings that err least. `info` describes the scene, as far as it is known before the truth is there.
    ///
    /// # Errors
    /// When the device cannot draw the settings as given, is lost or lacks the memory; when the journal cannot be written; when the truth cannot be
    /// rendered.
    pub fn run(
        &self,
        journal: &mut Journal,
        (info, own): (SceneInfo, Awaited),
        watch: StepObserver,
        elsewhere: &[(Camera, [u32; 2])],
    ) -> Result<Tuned, SweepError> {
        if journal.scenes[0].info.is_none() {
            journal.add(0, JournalRecord::Scene { scene: 0, info })?;
        }
        let patches: BTreeMap<String, SettingsPatch> =
            self.sweep.points.iter().map(|patch| (name_of(patch), patch.clone())).collect();
        let watch = RefCell::new(watch);
        let bench = RefCell::new(self.bench(own));
        let mut run = SearchRun::of(self, journal);
        let mut search =
            |margin| run.until_done(&mut *bench.borrow_mut(), margin, &mut |step| (watch.borrow_mut())(step));
        let told: StepObserver = &mut |step| (watch.borrow_mut())(step);
        let mut best = None;
        let witness = |scene: &SceneReport| {
            let name = best.insert(self.best(scene));
            let patch = patches.get(name).cloned().unwrap_or_default();
            let mut bench = bench.borrow_mut();
            let mut at = |camera, size| {
                Ok::<_, SweepError>(CameraBench::of(bench.elsewhere(camera, size, &patch)?, self.goal.metric))
            };
            let home = at(self.scene.camera, self.error_size)?;
            let cameras = elsewhere.iter().map(|&(camera, size)| at(camera, size)).collect::<Result<Vec<_>, _>>()?;
            let random = fastrand::Rng::with_seed(self.seed);
            // Moved in, or the witness could not outlive this closure.
            let watch = told;
            let end = self.within.map(|within| within.begun + within.time);
            let (goal, longest) = (self.goal, Duration::ZERO);
            Ok::<_, SweepError>(DeviceWitness { goal, patches: &patches, home, cameras, random, watch, end, longest })
        };
        let (scene, outcome) = self.goal.choose(&mut search, witness)?;
        let known = |name: &str| patches.get(name).cloned();
        let patches = scene.points.iter().map(|point| known(&point.name).unwrap_or_default()).collect();
        Ok(Tuned { scene, patches, outcome, not_measured: run.not_measured, best })
    }

    /// The name of the point that errs least.
    fn best(&self, scene: &SceneReport) -> String {
        let error = |point: &Point| self.goal.of(point).error;
        let sure = scene.points.iter().filter(|point| error(point).is_finite());
        let best = sure.min_by(|a, b| error(a).total_cmp(&error(b)));
        best.map_or_else(|| name_of(&SettingsPatch::default()), |point| point.name.clone())
    }

    fn bench(&self, truths: Awaited) -> Bench<'a> {
        let Self { device, scene, base, effort, goal, .. } = *self;
        let longest = self.within.map_or(effort.longest, |within| effort.longest.min(within.time.mul_f64(BATCH_SHARE)));
        let effort = Effort { longest, ..effort };
        let size = self.error_size;
        Bench { device, scene, camera: scene.camera, base, truths, size, goal, effort, anchor: None }
    }

    /// Points that get a glance together.
    fn glances(&self) -> usize {
        let cores = thread::available_parallelism().map_or(1, NonZero::get);
        let is_gpu = self.device.physical.kind != vk::PhysicalDeviceType::CPU;
        GLANCES[usize::from(is_gpu && cores >= GLANCES[1])]
    }

    /// Returns the scene's description for the journal, with the truth's hash and samples. The truth's noise is added once it is rendered.
    pub fn info(&self, hash: &str, samples: u32) -> SceneInfo {
        let fronts = vec![(self.goal.metric, Against::Converged)];
        let size = (self.error_size != self.base.decide().size).then_some(self.error_size);
        SceneInfo::of(self.scene, self.base, self.sweep, (hash, &TruthInfo::unknown(samples, size)), fronts)
    }
}

/// A search that measures.
struct SearchRun<'a, 'b> {
    tuning: &'a Tuning<'b>,
    journal: &'a mut Journal,
    /// The moment at which the first search began.
    begun: Instant,
    pictures: Spent,
    /// Each is of several points.
    glances: Spent,
    /// True once the journal has the rendered truth's noise.
    has_truth: bool,
    not_measured: Vec<String>,
}

/// The times that measurements of a kind took, in order of their length.
#[derive(Default)]
struct Spent(Vec<Duration>);

impl Spent {
    fn since(&mut self, begun: Instant) {
        let now = begun.elapsed();
        self.0.insert(self.0.partition_point(|other| *other < now), now);
    }

    fn median(&self) -> Duration {
        self.0.get(self.0.len() / 2).copied().unwrap_or_default()
    }
}

impl<'a, 'b> SearchRun<'a, 'b> {
    fn of(tuning: &'a Tuning<'b>, journal: &'a mut Journal) -> Self {
        let (begun, pictures, glances) = (Instant::now(), Spent::default(), Spent::default());
        Self { tuning, journal, begun, pictures, glances, has_truth: false, not_measured: Vec::new() }
    }

    /// Takes step after step until none is left, or the time is over; then only the steps that a choice needs.
    fn until_done(
        &mut self,
        probe: &mut dyn Probe,
        margin: Option<f64>,
        watch: StepObserver,
    ) -> Result<SceneReport, SweepError> {
        loop {
            let search = self.search(margin, probe.can_draw()?)?;
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
                    self.draw(probe, index.unwrap_or(0), ProbeEffort::Whole, watch)?;
                }
            }
        }
    }

    fn search(&self, margin: Option<f64>, can_draw: bool) -> Result<Search<'_>, SweepError> {
        let measured = &self.journal.scenes[0];
        let info = measured.info.as_ref().ok_or_else(|| SweepError::Refused("the journal has no scene".into()))?;
        let is_late = self.is_late(margin.is_none());
        let (goal, glances) = (&self.tuning.goal, self.tuning.glances());
        Ok(Search { goal, info, measured, margin, is_late, can_draw, glances })
    }

    /// A search that goes on since a candidate failed elsewhere has all time but that for verifying the next.
    fn is_late(&self, is_first: bool) -> bool {
        let Some(Within { begun, time, cameras }) = self.tuning.within else { return false };
        let rest = self.rest(cameras, is_first) + time.mul_f64(SPARE_SHARE);
        begun.elapsed() + rest > time && self.begun.elapsed() > time.mul_f64(LEAST_SHARE)
    }

    /// The time, about, that a choice takes after the search: a batch of all rounds, and from each other camera two pictures and a glance of one point.
    /// A glance of one point takes less than one of several.
    fn rest(&self, cameras: u32, is_first: bool) -> Duration {
        let (picture, glance) = (self.pictures.median(), self.glances.median());
        let best = if is_first { self.best_picture() * (cameras + 1) } else { Duration::ZERO };
        glance + (picture * 2 + glance * 3 / 4) * cameras + best
    }

    /// The time, about, that a picture takes which stands in a truth's place: it has more samples than others.
    fn best_picture(&self) -> Duration {
        let samples = self.tuning.base.decide().samples.max(1);
        let anchor = self.journal.scenes[0].batches.last().and_then(|batch| batch.rounds.anchor.last());
        let frame = anchor.map_or(0.0, |sample| sample.wall.max(0.0) / 1e3 / f64::from(samples));
        self.pictures.median() + Duration::try_from_secs_f64(frame * f64::from(BEST_SAMPLES)).unwrap_or_default()
    }

    fn scene(&self) -> Result<SceneReport, SweepError> {
        let scene = assemble::scene_report(&self.journal.scenes[0]);
        scene.ok_or_else(|| SweepError::Refused(format!("nothing of {} was measured", self.tuning.scene.name)))
    }

    fn take(&mut self, probe: &mut dyn Probe, step: &SearchStep, watch: StepObserver) -> Result<(), SweepError> {
        match step {
            SearchStep::Draw(index) => self.draw(probe, *index, ProbeEffort::Glance, watch),
            // The search offers the others again, if the time is not over by then.
            SearchStep::Glance(points) => {
                let fit = self.that_fit(probe, points);
                self.time(probe, fit, ProbeEffort::Glance, watch)
            }
            SearchStep::Confirm(points) => self.time(probe, points, ProbeEffort::Whole, watch),
        }
    }

    /// The first of these points, as many as the device has room for at once, and at least one.
    fn that_fit<'p>(&self, probe: &dyn Probe, points: &'p [usize]) -> &'p [usize] {
        let bytes = points.iter().scan(0, |sum, &index| {
            *sum += probe.bytes(&self.tuning.sweep.points[index]);
            Some(*sum)
        });
        &points[..bytes.take_while(|&bytes| bytes <= BATCH_BYTES).count().clamp(1, points.len())]
    }

    fn name(&self, index: usize) -> String {
        name_of(&self.tuning.sweep.points[index])
    }

    fn draw(
        &mut self,
        probe: &mut dyn Probe,
        index: usize,
        look: ProbeEffort,
        watch: StepObserver,
    ) -> Result<(), SweepError> {
        let (point, total) = (self.name(index), self.tuning.sweep.points.len());
        self.await_truth(probe, watch)?;
        watch(SceneProgress {
            what: "pictures",
            now: &point,
            done: self.journal.scenes[0].drawn.len().min(total - 1),
            total,
        });
        let begun = Instant::now();
        let drawn = probe.draw(&self.tuning.sweep.points[index], look);
        self.pictures.since(begun);
        let record = match drawn {
            Ok(drawn) => JournalRecord::Drawn { scene: 0, point, drawn },
            Err(error) if index != 0 && error.is_of_point() => {
                JournalRecord::Failed { scene: 0, point, reason: error.to_string() }
            }
            Err(error) => return Err(error),
        };
        self.journal.add(0, record)
    }

    /// Waits for the truth, and writes its noise into the journal.
    fn await_truth(&mut self, probe: &mut dyn Probe, watch: StepObserver) -> Result<(), SweepError> {
        if self.has_truth {
            return Ok(());
        }
        self.has_truth = true;
        if !probe.can_draw()? {
            watch(SceneProgress { what: "truth", now: "not yet there", done: 0, total: 1 });
        }
        let truth = probe.truth()?;
        if let (Some(truth), Some(info)) = (truth, &self.journal.scenes[0].info)
            && info.truth != truth
        {
            let info = SceneInfo { truth, ..info.clone() };
            self.journal.add(0, JournalRecord::Scene { scene: 0, info })?;
        }
        Ok(())
    }

    /// Times points together, as far as the device has room; a point that is too much alone as well is left out.
    fn time(
        &mut self,
        probe: &mut dyn Probe,
        points: &[usize],
        look: ProbeEffort,
        watch: StepObserver,
    ) -> Result<(), SweepError> {
        let names: Vec<String> = points.iter().map(|&index| self.name(index)).collect();
        let (what, total) = match look {
            ProbeEffort::Glance => ("times", self.tuning.sweep.points.len()),
            ProbeEffort::Whole => ("times, again", points.len()),
        };
        let known = if look == ProbeEffort::Glance { self.journal.scenes[0].timed().len() } else { 0 };
        watch(SceneProgress { what, now: &names.join(", "), done: known, total });
        let patches: Vec<SettingsPatch> = points.iter().map(|&index| self.tuning.sweep.points[index].clone()).collect();
        let bytes: u64 = patches.iter().map(|patch| probe.bytes(patch)).sum();
        if points.len() > 1 && bytes > BATCH_BYTES {
            return self.halves(probe, points, look, watch);
        }
        let before = self.journal.scenes[0].batches.len() as u64;
        let mut random = fastrand::Rng::with_seed(self.tuning.seed ^ (before << 32));
        let begun = Instant::now();
        let timed = probe.time(&patches, look, &mut random);
        if look == ProbeEffort::Glance {
            self.glances.since(begun);
        }
        let record = match timed {
            Ok(rounds) => {
                let batch = Batch { points: names, confirms: look == ProbeEffort::Whole, rounds };
                JournalRecord::Batch { scene: 0, batch }
            }
            Err(error) if !error.is_of_point() || names.is_empty() => return Err(error),
            Err(_) if points.len() > 1 => return self.halves(probe, points, look, watch),
            Err(error) => JournalRecord::Failed { scene: 0, point: names.concat(), reason: error.to_string() },
        };
        self.journal.add(0, record)
    }

    fn halves(
        &mut self,
        probe: &mut dyn Probe,
        points: &[usize],
        look: ProbeEffort,
        watch: StepObserver,
    ) -> Result<(), SweepError> {
        let (first, last) = points.split_at(points.len() / 2);
        self.time(probe, first, look, watch)?;
        self.time(probe, last, look, watch)
    }
}

/// Finds settings within `selection` that keep the bound on this device, with the effort of `afterlight tune --quick`, and verifies them from up to
/// `cameras` other cameras.
///
/// # Errors
/// When the device cannot draw the scene as its settings are given, is lost or lacks the memory; when [`Scene::check`] finds a fault.
pub fn tune(
    device: &Arc<Device>,
    (scene, base): (&Scene, &SettingsPatch),
    selection: &Selection,
    goal: Goal,
    cameras: usize,
) -> Result<Tuned, SweepError> {
    const TRUTH_SAMPLES: u32 = 16;
    let settings = base.decide();
    let sweep = Sweep::of(scene, base, &capabilities(&device.physical), selection).map_err(frame::Error::from)?;
    let effort = Effort::QUICK;
    let Selection { families, joint, quick, seed } = selection.clone();
    let header = JournalHeader {
        layout: LAYOUT,
        version: env!("CARGO_PKG_VERSION").into(),
        build: machine::build(),
        machine: machine::here(&device.physical),
        shard: None,
        scenes: vec![scene.name.clone()],
        asked: SweepOptions { families, joint, quick, rounds: effort.rounds, truth_samples: TRUTH_SAMPLES, seed },
    };
    let reference = Reference::new(scene).map_err(frame::Error::from)?;
    let others = held_out(&reference, &CameraView { camera: scene.camera, size: settings.size }, cameras);
    let error_size = settings.size;
    let tuning = Tuning { device, scene, base, sweep: &sweep, goal, effort, seed, within: None, error_size };
    let view = CameraView { camera: scene.camera, size: error_size };
    let own = Truths::of(scene, &view, &settings, TRUTH_SAMPLES, &|_, _, _| {})?;
    let cameras: Vec<_> = others.iter().map(|other| (other.camera, error_size)).collect();
    let folder = tempfile::tempdir().map_err(|error| SweepError::file("make a temporary folder", error))?;
    let mut journal = Journal::open(folder.path(), &header, true)?;
    let info = tuning.info(&own.hash, TRUTH_SAMPLES);
    tuning.run(&mut journal, (info, own.into()), &mut |_| {}, &cameras)
}
