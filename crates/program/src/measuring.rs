//! Shared by `report` and `tune`: how much is measured, of which settings, and how far it has come.

use std::time::Duration;

use afterlight::frame;
use afterlight::gpu::Device;
use afterlight::scene::{self, SettingsPatch, unknown};
use afterlight_lab::report::sweep::accuracy::Truths;
use afterlight_lab::report::sweep::families::{Selection, Sweep};
use afterlight_lab::report::sweep::journal::{JournalHeader, SweepOptions};
use afterlight_lab::report::sweep::machine;
use afterlight_lab::report::sweep::model::{LAYOUT, Metric, Shard};
use afterlight_lab::report::sweep::run::SceneProgress;
use afterlight_lab::report::sweep::timing::Effort;
use afterlight_truth::measure::LEAST_FOR_95;
use afterlight_truth::reference::CameraView;

use super::args::{MotionArgs, SettingsArgs, samples, whole};
use super::failure::Failure;
use super::workload::{Workload, warnings};
use super::{output, progress};

/// The size of `--quick`, unless `--size` says another.
const QUICK_SIZE: [u32; 2] = [320, 180];

/// The amount and the quality of measurements.
#[derive(Debug, Clone, clap::Args)]
#[command(next_help_heading = "Measuring")]
pub struct MeasuringArgs {
    /// A first answer in minutes: 320x180, few values of each setting, few rounds
    #[arg(long)]
    pub quick: bool,
    /// Combinations of settings in the joint family, at most, 0 (none) to 10000 [default: 40, quick 2]
    #[arg(long, value_name = "N", value_parser = whole::<u32>(0..=10_000), allow_negative_numbers = true)]
    joint: Option<u32>,
    /// Rounds in which renderers take turns, 6 and up, more where times scatter [default: 15, quick 6]
    #[arg(long, value_name = "N", value_parser = whole::<u32>(LEAST_FOR_95 as u32..=100_000), allow_negative_numbers = true)]
    rounds: Option<u32>,
    /// Samples of each pixel of the converged truth [default: 64, quick 16]
    #[arg(long, value_name = "N", value_parser = samples)]
    truth_samples: Option<u32>,
    /// Decides combinations and the order of measuring
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub seed: u64,
}

impl MeasuringArgs {
    /// Returns the selection of the families with these keys, or of all.
    pub fn selection(&self, families: Option<Vec<String>>) -> Selection {
        Selection {
            families,
            joint: self.joint.unwrap_or(if self.quick { 2 } else { 40 }) as usize,
            quick: self.quick,
            seed: self.seed,
        }
    }

    fn rounds(&self) -> usize {
        self.rounds.unwrap_or(if self.quick { LEAST_FOR_95 as u32 } else { 15 }) as usize
    }

    pub fn truth_samples(&self) -> u32 {
        self.truth_samples.unwrap_or(if self.quick { 16 } else { 64 })
    }

    pub fn effort(&self) -> Effort {
        let usual = Effort { rounds: 15, longest: Duration::from_secs(120), steady_frames: 3 };
        Effort { rounds: self.rounds(), ..if self.quick { Effort::QUICK } else { usual } }
    }

    /// The options of drawing, with the size of `--quick` and the options of motion.
    pub fn settings(&self, motion: &MotionArgs, settings: &SettingsArgs) -> SettingsArgs {
        let quick = SettingsPatch { size: self.quick.then_some(QUICK_SIZE), ..SettingsPatch::default() };
        motion.over(&SettingsArgs { said: settings.said.or(&quick), ..settings.clone() })
    }

    /// The first line of a journal.
    pub fn header(
        &self,
        device: &Device,
        scenes: &[String],
        families: Option<Vec<String>>,
        shard: Option<Shard>,
    ) -> JournalHeader {
        let Selection { families, joint, quick, seed } = self.selection(families);
        let (rounds, truth_samples) = (self.rounds(), self.truth_samples());
        JournalHeader {
            layout: LAYOUT,
            version: env!("CARGO_PKG_VERSION").into(),
            build: machine::build(),
            machine: machine::here(&device.physical),
            shard,
            scenes: scenes.to_vec(),
            asked: SweepOptions { families, joint, quick, rounds, truth_samples, seed },
        }
    }
}

/// lavapipe takes as many threads as it likes unless it is told; then times of different runs could not be compared.
pub fn fix_driver_threads() {
    if std::env::var_os(machine::DRIVER_THREADS).is_none() {
        // SAFETY: no thread but this one has been started: no device, no pool and no progress bar is there yet, so that nobody reads the
        // environment meanwhile.
        unsafe { std::env::set_var(machine::DRIVER_THREADS, machine::threads().to_string()) };
    }
}

/// The settings as given.
pub fn base_of(workload: &Workload) -> SettingsPatch {
    SettingsPatch { view: Some(scene::View::Final), ..workload.patch() }
}

/// The sweep of a scene.
pub fn sweep_of(
    workload: &Workload,
    base: &SettingsPatch,
    device: &Device,
    selection: &Selection,
) -> Result<Sweep, Failure> {
    // Says so when the picture is too large.
    let settings = workload.settings(&SettingsPatch::default(), &device.physical)?;
    let plan = frame::plan_for(device, &workload.scene, &settings)?;
    workload.warn(&plan)?;
    Ok(Sweep::of(&workload.scene, base, &frame::capabilities(&device.physical), selection)?)
}

/// Both truths of the scene in a view, with bars that are named after `what`. Prints the faults of their cache.
pub fn truths(
    workload: &Workload,
    view: &CameraView,
    base: &SettingsPatch,
    samples: u32,
    bars: &Bars,
) -> Result<Truths, Failure> {
    let settings = base.decide();
    let pixels = u64::from(view.size[0]) * u64::from(view.size[1]);
    let bar = |what: &str, count| progress::shares(format!("{}: {what}", bars.what), count, bars.quiet);
    let shown = [bar("truth", pixels), bar("converged truth", pixels * u64::from(samples))];
    let tell = |what: &str, done, _| shown[usize::from(what == Truths::CONVERGED)].at(done);
    let truths = Truths::of(&workload.scene, view, &settings, samples, &tell)?;
    drop(shown);
    if !bars.quiet {
        output::print(&warnings(&truths.warnings), true)?;
    }
    Ok(truths)
}

/// Reads the metric of error by its name.
pub fn metric(text: &str) -> Result<Metric, String> {
    const NAMES: [(&str, Metric); 3] = [("flip", Metric::Flip), ("relmse", Metric::RelMse), ("rmse", Metric::Rmse)];
    let found = NAMES.iter().find(|(name, _)| *name == text);
    found.map(|&(_, metric)| metric).ok_or_else(|| unknown("metric", text, &NAMES.map(|(name, _)| name)))
}

/// Bars of progress, one at a time, that are named after the thing measured.
pub struct Bars {
    what: String,
    quiet: bool,
    shown: Option<(String, progress::ProgressDisplay)>,
}

impl Bars {
    pub fn of(what: impl Into<String>, quiet: bool) -> Self {
        Self { what: what.into(), quiet, shown: None }
    }

    /// Shows the progress of a run. Off a terminal it prints a line for each step, which names its points.
    pub fn step(&mut self, step: SceneProgress) {
        let what = format!("{}: {}", self.what, step.what);
        let now = if step.now.is_empty() { "default" } else { step.now };
        progress::line(&format!("{what} {}/{}: {now}", step.done + 1, step.total.max(1)), self.quiet);
        if self.shown.as_ref().is_none_or(|(shown, _)| *shown != what) {
            // The old one goes before the new one comes.
            self.shown = None;
            self.shown = Some((what.clone(), progress::bar(what, step.total as u64, self.quiet)));
        }
        if let Some((_, bar)) = &self.shown {
            bar.at(step.done as u64);
        }
    }
}
