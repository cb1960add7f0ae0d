//! Shared by the tests of a sweep: a meter that answers at once, and small values.

use std::collections::BTreeMap;

use super::super::assemble::{self, FRONTS};
use super::super::error::SweepError;
use super::super::families::{PlannedFamily, Sweep, name_of};
use super::super::journal::{
    Journal, JournalHeader, JournalRecord, PictureFigures, SceneInfo, SceneMeasurements, SweepOptions,
};
use super::super::meter::Meter;
use super::super::model::{
    ErrorMetrics, ErrorsByTruth, Interval, LAYOUT, LeftOut, Machine, Member, Point, Report, Shard, Timing, TruthInfo,
};
use super::super::timing::{Rounds, TimingSample};
use super::{Run, SceneProgress};
use afterlight::scene::SettingsPatch;

pub fn machine() -> Machine {
    Machine {
        device: "tester".into(),
        driver: "none 1.0".into(),
        software: true,
        os: "os".into(),
        cpu: "cpu".into(),
        threads: 2,
        driver_threads: Some(2),
    }
}

pub fn header() -> JournalHeader {
    let asked = SweepOptions { families: None, joint: 4, quick: false, rounds: 5, truth_samples: 8, seed: 1 };
    let scenes = vec!["builtin:test".into()];
    JournalHeader {
        layout: LAYOUT,
        version: "1".into(),
        build: "b".into(),
        machine: machine(),
        shard: None,
        scenes,
        asked,
    }
}

pub fn errors(error: f64) -> ErrorsByTruth {
    let errors = ErrorMetrics {
        rel_mse: error,
        rmse: error,
        max: error,
        p99_9: error,
        flip: error,
        psnr_db: Some(-10.0 * error.log10()),
        not_finite: 0,
    };
    ErrorsByTruth { point: errors, converged: errors }
}

pub fn drawn(error: f64) -> PictureFigures {
    PictureFigures { errors: errors(error), memory: 1 << 20, gbuffer_bytes_per_pixel: 16 }
}

/// One contender beside an anchor of 10 ms, `ratio` times as slow.
pub fn rounds(others: usize, ratio: f64) -> Rounds {
    let times = |ms: f64| (0..8).map(|_| TimingSample { wall: ms, gpu: None, cpu: Some(ms) }).collect::<Vec<_>>();
    Rounds { anchor: times(10.0), others: vec![times(10.0 * ratio); others], moving: false }
}

pub fn point(name: &str, error: f64, ms: f64) -> Point {
    let wall = Interval { median: ms, low: 0.99 * ms, high: 1.01 * ms, count: 9 };
    let ratio = Interval { median: 0.1 * ms, low: 0.099 * ms, high: 0.101 * ms, count: 9 };
    Point {
        name: name.into(),
        errors: errors(error),
        time: Timing { wall, gpu: None, cpu: Some(wall), ratio, confirmed: false },
        memory: 1 << 20,
        gbuffer_bytes_per_pixel: 16,
        pictures: BTreeMap::new(),
    }
}

/// Sizes of shadow maps and numbers of samples.
pub fn sweep() -> Sweep {
    let sizes = [512, 1024, 4096].map(|size| SettingsPatch { shadow_size: Some(size), ..Default::default() });
    let samples = [4, 16, 64].map(|samples| SettingsPatch { samples: Some(samples), ..Default::default() });
    let points: Vec<SettingsPatch> = std::iter::once(SettingsPatch::default()).chain(sizes).chain(samples).collect();
    let member = |point: usize, value: f64| Member { point, label: value.to_string(), value: Some(value) };
    let family = |key: &str, members: Vec<Member>| PlannedFamily { key: key.into(), title: key.into(), members };
    Sweep {
        points,
        families: vec![
            family("shadow-size", vec![member(1, 512.0), member(2, 1024.0), member(0, 2048.0), member(3, 4096.0)]),
            family("samples", vec![member(0, 1.0), member(4, 4.0), member(5, 16.0), member(6, 64.0)]),
        ],
        left_out: vec![LeftOut { name: "textbook".into(), reason: "not now".into() }],
    }
}

pub fn info(sweep: &Sweep) -> SceneInfo {
    SceneInfo {
        name: "test".into(),
        hash: "0123".into(),
        settings: String::new(),
        size: [64, 36],
        moving: true,
        triangles: 12,
        lights: 1,
        truth: TruthInfo {
            samples: 8,
            noise_rmse: 1e-6,
            noise_rel_mse: 1e-9,
            sky: 0.25,
            other_triangle: None,
            size: None,
        },
        points: sweep.points.iter().map(name_of).collect(),
        families: sweep.families.clone(),
        fronts: FRONTS.to_vec(),
        left_out: sweep.left_out.clone(),
    }
}

/// The error of a meter whose time is over.
pub const KILLED: &str = "killed";

/// Errors and times that follow from the settings alone, and a record of the requests.
#[derive(Default)]
pub struct Clockwork {
    pub drawn: Vec<String>,
    pub timed: Vec<String>,
    /// Points that the device cannot hold.
    pub too_large: Vec<String>,
    /// Pictures and batches that are measured before somebody ends the process; without end for `None`.
    pub left: Option<usize>,
    /// The first time of a point is much too short, and the more so the larger its maps are.
    pub lucky: bool,
}

impl Clockwork {
    fn ms(point: &SettingsPatch) -> f64 {
        let shadow = f64::from(point.shadow_size.unwrap_or(2048));
        (4.0 + shadow / 2048.0) * f64::from(point.samples.unwrap_or(1))
    }

    fn ms_now(&self, point: &SettingsPatch) -> f64 {
        let is_lucky = self.lucky && !self.timed.contains(&name_of(point));
        if is_lucky { 1e3 / f64::from(point.shadow_size.unwrap_or(2048)) } else { Self::ms(point) }
    }

    fn work(&mut self) -> Result<(), SweepError> {
        match &mut self.left {
            Some(0) => return Err(SweepError::Refused(KILLED.into())),
            Some(left) => *left -= 1,
            None => {}
        }
        Ok(())
    }

    fn refuse(&self, point: &SettingsPatch) -> Result<(), SweepError> {
        if self.too_large.contains(&name_of(point)) {
            return Err(afterlight::plan::PlanError::ShadowSize(1, 1).into());
        }
        Ok(())
    }
}

impl Meter for Clockwork {
    fn draw(&mut self, point: &SettingsPatch) -> Result<PictureFigures, SweepError> {
        self.work()?;
        self.refuse(point)?;
        self.drawn.push(name_of(point));
        let shadow = f64::from(point.shadow_size.unwrap_or(2048));
        Ok(drawn(20.0 / shadow + 0.1 / f64::from(point.samples.unwrap_or(1))))
    }

    fn time(&mut self, points: &[SettingsPatch], random: &mut fastrand::Rng) -> Result<Rounds, SweepError> {
        self.work()?;
        for point in points {
            self.refuse(point)?;
        }
        let all: Vec<f64> = points.iter().map(|point| self.ms_now(point)).collect();
        self.timed.extend(points.iter().map(name_of));
        let mut times = |ms: f64| -> Vec<TimingSample> {
            let noise = (0..7).map(|_| ms * (1.0 + 0.01 * random.f64()));
            noise.map(|ms| TimingSample { wall: ms, gpu: None, cpu: Some(ms) }).collect()
        };
        let anchor = times(Self::ms(&SettingsPatch::default()));
        Ok(Rounds { anchor, others: all.into_iter().map(times).collect(), moving: false })
    }

    fn bytes(&self, point: &SettingsPatch) -> u64 {
        u64::from(point.shadow_size.unwrap_or(2048)).pow(2) * 4
    }
}

/// Measures the sweep into a journal.
pub fn measure(meter: &mut Clockwork, journal: &mut Journal, shard: Option<Shard>) -> Result<(), SweepError> {
    measure_sweep(&sweep(), meter, journal, shard)
}

pub fn measure_sweep(
    sweep: &Sweep,
    meter: &mut Clockwork,
    journal: &mut Journal,
    shard: Option<Shard>,
) -> Result<(), SweepError> {
    if journal.scenes[0].info.is_none() {
        journal.add(0, JournalRecord::Scene { scene: 0, info: info(sweep) })?;
    }
    let own = sweep.own(shard);
    let mut watch = |_: SceneProgress| {};
    let mut run = Run { scene: 0, sweep, own: &own, seed: 3, journal, watch: &mut watch };
    run.measure(meter)
}

/// All of it, measured in a folder.
pub fn measured(folder: &std::path::Path) -> Vec<SceneMeasurements> {
    let mut journal = Journal::open(folder, &header(), false).expect("a journal");
    measure(&mut Clockwork::default(), &mut journal, None).expect("measured");
    journal.scenes
}

pub fn report() -> Report {
    let folder = tempfile::tempdir().expect("a temporary folder");
    assemble::report(&header(), &measured(folder.path()), None)
}
