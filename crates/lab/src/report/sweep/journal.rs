//! The measurements so far, on disk: a line of JSON with a checksum for each finished measurement, behind a header with the command's request.
//!
//! A run that is broken off goes on from the journal; a line that was cut off is measured again. Parts of a report are joined from their
//! journals, too, as these have all measurements and not only their results. One process writes it at a time.

use std::collections::{BTreeMap, BTreeSet};
use std::fs::{File, OpenOptions, TryLockError};
use std::io::Write;
use std::path::Path;

use serde::{Deserialize, Serialize};

use super::error::SweepError;
use super::families::{PlannedFamily, Sweep, name_of};
use super::line;
use super::model::{Against, Attribution, ErrorsByTruth, LeftOut, Machine, Metric, Shard, TruthInfo};
use super::timing::{Rounds, TimingSample};
use afterlight::scene::{Scene, Settings, SettingsPatch};
use afterlight_files::regular_file::read_regular;
use afterlight_truth::measure::what_moves;

/// The name of the file in a report's folder.
pub const FILE: &str = "journal";

/// The format of the journal's lines: 2 has checksums.
pub const FORMAT: u32 = 2;

/// A report of days has some megabytes.
const MOST_BYTES: u64 = 1 << 30;

/// The options of the measurement, and its machine.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct JournalHeader {
    /// The layout of this file and of the report.
    pub layout: u32,
    /// The program's version.
    pub version: String,
    /// An identity that tells builds of one version apart, as far as pictures and times depend on it.
    pub build: String,
    pub machine: Machine,
    pub shard: Option<Shard>,
    /// The scenes as they were given.
    pub scenes: Vec<String>,
    pub asked: SweepOptions,
}

/// The options that decide which points are measured, and how well.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SweepOptions {
    pub families: Option<Vec<String>>,
    pub joint: usize,
    pub quick: bool,
    pub rounds: usize,
    pub truth_samples: u32,
    pub seed: u64,
}

/// A scene with its settings as given, and the points to be measured of it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SceneInfo {
    pub name: String,
    /// A hash of all that the scene's truth depends on.
    pub hash: String,
    /// The settings as given, as far as they were.
    pub settings: String,
    pub size: [u32; 2],
    /// As [`SceneReport::moving`](super::model::SceneReport::moving).
    pub moving: bool,
    pub triangles: usize,
    pub lights: usize,
    pub truth: TruthInfo,
    /// The names of all points, of any shard.
    pub points: Vec<String>,
    pub families: Vec<PlannedFamily>,
    pub left_out: Vec<LeftOut>,
    /// The fronts to search for and to confirm.
    pub fronts: Vec<(Metric, Against)>,
}

impl SceneInfo {
    /// A scene, with the points of its sweep, and its truth by the hash of all that it depends on.
    pub fn of(
        scene: &Scene,
        base: &SettingsPatch,
        sweep: &Sweep,
        (hash, truth): (&str, &TruthInfo),
        fronts: Vec<(Metric, Against)>,
    ) -> Self {
        let Settings { size, shadows, .. } = base.decide();
        Self {
            name: scene.name.clone(),
            hash: hash.to_owned(),
            settings: base.to_string(),
            size,
            moving: !shadows.cache,
            triangles: scene.triangle_count(),
            lights: scene.lights.len(),
            truth: truth.clone(),
            points: sweep.points.iter().map(name_of).collect(),
            families: sweep.families.clone(),
            left_out: sweep.left_out.clone(),
            fronts,
        }
    }
}

/// The errors of a point's pictures, and the memory that they take.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PictureFigures {
    pub errors: ErrorsByTruth,
    /// Bytes on the device.
    pub memory: u64,
    pub gbuffer_bytes_per_pixel: u32,
}

/// A batch of renderers that took turns.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Batch {
    /// Names of the points beside the anchor.
    pub points: Vec<String>,
    /// They had been on a front.
    pub confirms: bool,
    pub rounds: Rounds,
}

/// A line.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum JournalRecord {
    Header(JournalHeader),
    Scene {
        scene: usize,
        info: SceneInfo,
    },
    Drawn {
        scene: usize,
        point: String,
        drawn: PictureFigures,
    },
    /// A point that this device could not draw or time after all.
    Failed {
        scene: usize,
        point: String,
        reason: String,
    },
    Batch {
        scene: usize,
        batch: Batch,
    },
    Attribution {
        scene: usize,
        attribution: Attribution,
    },
    /// Nothing of the scene is left to do.
    Done {
        scene: usize,
    },
}

/// All that is known of one scene.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct SceneMeasurements {
    pub info: Option<SceneInfo>,
    pub drawn: BTreeMap<String, PictureFigures>,
    pub failed: BTreeMap<String, String>,
    pub batches: Vec<Batch>,
    /// The attribution for the settings as given.
    pub attribution: Option<Attribution>,
    /// Nothing is left to do.
    pub done: bool,
}

impl SceneMeasurements {
    pub(in crate::report) fn add(&mut self, record: JournalRecord) {
        match record {
            JournalRecord::Header(_) => {}
            JournalRecord::Scene { info, .. } => self.info = Some(info),
            JournalRecord::Drawn { point, drawn, .. } => {
                self.drawn.insert(point, drawn);
            }
            JournalRecord::Failed { point, reason, .. } => {
                self.failed.insert(point, reason);
            }
            JournalRecord::Batch { batch, .. } => self.batches.push(batch),
            JournalRecord::Attribution { attribution, .. } => self.attribution = Some(attribution),
            JournalRecord::Done { .. } => self.done = true,
        }
    }

    /// The batch that tells a point's time: that which confirms it, if there is one, and its own among the batch's times.
    pub fn times_of(&self, point: &str) -> Option<(&Batch, &[TimingSample])> {
        let of = |batch: &&Batch| batch.points.iter().any(|name| name == point);
        let confirming = self.batches.iter().filter(|batch| batch.confirms).find(of);
        let batch = confirming.or_else(|| self.batches.iter().find(of))?;
        let place = batch.points.iter().position(|name| name == point)?;
        Some((batch, batch.rounds.others.get(place)?))
    }

    /// Names of points that have a time.
    pub fn timed(&self) -> BTreeSet<&str> {
        self.batches.iter().flat_map(|batch| batch.points.iter().map(String::as_str)).collect()
    }
}

/// The contents of a folder's journal.
#[derive(Debug, Clone, PartialEq)]
pub struct Contents {
    pub header: JournalHeader,
    /// The scenes' measurements; empty before the first scene has been opened.
    pub scenes: Vec<SceneMeasurements>,
    /// Whole lines that count for nothing, as they are damaged or stand behind one that is.
    pub dropped: usize,
    /// Bytes up to the end of the last line that counts.
    whole: u64,
}

impl Contents {
    /// Reads a journal; `None` if it does not exist or has no whole line.
    ///
    /// # Errors
    /// When it cannot be read, or is of another layout.
    pub fn read(path: &Path) -> Result<Option<Self>, SweepError> {
        let text = match read_regular(path, MOST_BYTES) {
            Ok(text) => text,
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(None),
            Err(error) => return Err(SweepError::file(format!("read {}", path.display()), error)),
        };
        let mut found: Option<Self> = None;
        let mut whole = 0;
        for line in text.split_inclusive(|&byte| byte == b'\n') {
            // Cut off while it was written, or damaged: nothing after it counts.
            let Some(record) = line::opened(line) else { break };
            whole += line.len() as u64;
            match (&mut found, record) {
                (None, JournalRecord::Header(header)) => {
                    found = Some(Self { header, scenes: Vec::new(), dropped: 0, whole: 0 });
                }
                (None, _) => break,
                (Some(contents), record) => contents.add(record),
            }
        }
        if found.is_none() && !text.is_empty() && text.contains(&b'\n') {
            let why = match line::is_without_checksums(&text) {
                true => "is of an older program, whose lines have no checksums: --restart begins anew",
                false => "is no journal of a report that this program can read: --restart begins anew",
            };
            return Err(SweepError::Refused(format!("{} {why}", path.display())));
        }
        let dropped = text[whole as usize..].iter().filter(|&&byte| byte == b'\n').count();
        Ok(found.map(|contents| Self { whole, dropped, ..contents }))
    }

    fn add(&mut self, record: JournalRecord) {
        let scene = match &record {
            JournalRecord::Header(_) => return,
            JournalRecord::Scene { scene, .. }
            | JournalRecord::Drawn { scene, .. }
            | JournalRecord::Failed { scene, .. }
            | JournalRecord::Batch { scene, .. }
            | JournalRecord::Attribution { scene, .. }
            | JournalRecord::Done { scene } => *scene,
        };
        if scene < self.header.scenes.len() {
            self.scenes.resize(self.header.scenes.len(), SceneMeasurements::default());
            self.scenes[scene].add(record);
        }
    }
}

/// A journal that is being written, by this process alone.
#[derive(Debug)]
pub struct Journal {
    name: String,
    file: File,
    pub scenes: Vec<SceneMeasurements>,
    /// True if nothing had been measured before, or it was forgotten: other files of the folder are then of another run.
    pub is_new: bool,
    /// As [`Contents::dropped`]: the measurements of these lines are made again.
    pub dropped: usize,
}

impl Journal {
    /// Continues the journal in a folder, which must be of the same command, or begins one. A journal without a scene is of a command that could not
    /// start, and is begun anew.
    ///
    /// # Errors
    /// When the folder's is of another command, another process writes it, or it cannot be read or written.
    pub fn open(folder: &Path, header: &JournalHeader, restart: bool) -> Result<Self, SweepError> {
        let path = folder.join(FILE);
        let name = path.display().to_string();
        let failed = |error| SweepError::file(format!("write {name}"), error);
        let file = OpenOptions::new().read(true).append(true).create(true).open(&path).map_err(failed)?;
        // On a file system without locks, nothing can keep other processes away.
        if let Err(TryLockError::WouldBlock) = file.try_lock() {
            let why = "is being measured by another process: wait for its end";
            return Err(SweepError::Refused(format!("{} {why}", folder.display())));
        }
        let before = if restart { None } else { Contents::read(&path)? };
        if let Some(before) = before.filter(|before| !before.scenes.is_empty()) {
            if let Some(difference) = difference(&before.header, header) {
                let hint = "choose another folder with -o, or --restart to begin anew";
                return Err(SweepError::Refused(format!(
                    "{} holds another report: {difference}: {hint}",
                    folder.display()
                )));
            }
            file.set_len(before.whole).map_err(failed)?;
            return Ok(Self { name, file, scenes: before.scenes, is_new: false, dropped: before.dropped });
        }
        file.set_len(0).map_err(failed)?;
        let scenes = vec![SceneMeasurements::default(); header.scenes.len()];
        let mut journal = Self { name, file, scenes, is_new: true, dropped: 0 };
        journal.write(&JournalRecord::Header(header.clone()))?;
        Ok(journal)
    }

    /// Writes a line, whole, and knows it from now on.
    ///
    /// # Errors
    /// When the disk is full.
    pub fn add(&mut self, scene: usize, record: JournalRecord) -> Result<(), SweepError> {
        self.write(&record)?;
        self.scenes[scene].add(record);
        Ok(())
    }

    fn write(&mut self, record: &JournalRecord) -> Result<(), SweepError> {
        let failed = |error| SweepError::file(format!("write {}", self.name), error);
        // JSON has no number that is not finite: a line that cannot be read again would take all after it along.
        let not_finite = |error| failed(std::io::Error::other(format!("a figure is not finite ({error})")));
        let line = line::sealed(record).map_err(not_finite)?;
        self.file.write_all(&line).and_then(|()| self.file.flush()).map_err(failed)
    }
}

/// The first thing in which two commands differ, in words; none where they are the same.
pub fn difference(there: &JournalHeader, here: &JournalHeader) -> Option<String> {
    let differs = |what: &str, there: String, here: String| {
        (there != here).then(|| format!("its {what} is {there}, and that of this one {here}"))
    };
    let machine = |header: &JournalHeader| header.machine.clone();
    let shard = |header: &JournalHeader| {
        header.shard.map_or_else(|| "all of it".to_owned(), |shard| format!("{}/{}", shard.index, shard.count))
    };
    let asked = |header: &JournalHeader| {
        let SweepOptions { families, joint, quick, rounds, truth_samples, seed } = &header.asked;
        let families = families.as_ref().map_or_else(|| "all".to_owned(), |keys| keys.join(","));
        format!(
            "families {families}, joint {joint}, rounds {rounds}, truth samples {truth_samples}, seed {seed}{}",
            if *quick { ", quick" } else { "" }
        )
    };
    differs("layout", there.layout.to_string(), here.layout.to_string())
        .or_else(|| differs("program", there.version.clone(), here.version.clone()))
        .or_else(|| differs("build", there.build.clone(), here.build.clone()))
        .or_else(|| differs("list of scenes", there.scenes.join(" "), here.scenes.join(" ")))
        .or_else(|| differs("device", machine(there).device, machine(here).device))
        .or_else(|| differs("driver", machine(there).driver, machine(here).driver))
        .or_else(|| differs("CPU", machine(there).cpu, machine(here).cpu))
        .or_else(|| differs("number of threads", threads(there), threads(here)))
        .or_else(|| differs("choice of points", asked(there), asked(here)))
        .or_else(|| differs("shard", shard(there), shard(here)))
}

fn threads(header: &JournalHeader) -> String {
    let Machine { threads, driver_threads, .. } = &header.machine;
    driver_threads.map_or_else(|| threads.to_string(), |driver| format!("{threads} ({driver} of the driver)"))
}

/// The first thing in which a scene differs from a journal's record of it, in words; `None` if they are the same.
pub fn scene_difference(there: &SceneInfo, here: &SceneInfo) -> Option<String> {
    let name = &here.name;
    if there.size != here.size {
        let size = |[width, height]: [u32; 2]| format!("{width}x{height}");
        return Some(format!("its size of {name} is {}, and that of this one {}", size(there.size), size(here.size)));
    }
    if there.moving != here.moving {
        let [there, here] = [there, here].map(|info| what_moves(info.moving));
        return Some(format!("in its times of {name} {there}, and in those of this one {here}"));
    }
    if there.settings != here.settings {
        let text = |info: &SceneInfo| format!("\"{}\"", info.settings);
        return Some(format!("its settings of {name} are {}, and those of this one {}", text(there), text(here)));
    }
    if there.fronts != here.fronts {
        return Some(format!("its fronts of {name} are by other metrics than those of this one"));
    }
    (there.hash != here.hash || there.points != here.points)
        .then(|| format!("its scene {} is not the same as {name} is now", there.name))
}

#[cfg(test)]
mod tests {
    use super::super::run::samples::{drawn, header, info, rounds, sweep};
    use super::*;

    #[test]
    fn what_was_written_is_there_again_and_a_torn_line_is_not() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let header = header();
        let mut journal = Journal::open(folder.path(), &header, false).expect("new");
        let point = |point: &str| JournalRecord::Drawn { scene: 0, point: point.into(), drawn: drawn(0.1) };
        journal.add(0, point("default")).expect("written");
        let batch = Batch { points: vec!["a".into()], confirms: false, rounds: rounds(1, 1.0 / 3.0) };
        journal.add(0, JournalRecord::Batch { scene: 0, batch }).expect("written");
        let known = journal.scenes.clone();
        drop(journal);
        let path = folder.path().join(FILE);
        let mut torn = std::fs::read(&path).expect("there");
        let whole = torn.len();
        torn.extend_from_slice(br#"{"drawn":{"scene":0,"poi"#);
        std::fs::write(&path, &torn).expect("written");

        let mut again = Journal::open(folder.path(), &header, false).expect("the same command");
        assert_eq!(again.scenes, known);
        assert_eq!(std::fs::metadata(&path).expect("there").len(), whole as u64);
        again.add(0, point("b")).expect("written");
        let read = Contents::read(&path).expect("readable").expect("there");
        assert_eq!(read.scenes[0].drawn.keys().collect::<Vec<_>>(), ["b", "default"]);
    }

    #[test]
    fn another_command_is_refused_unless_it_restarts() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let header = header();
        Journal::open(folder.path(), &header, false).expect("new").add(0, scene()).expect("written");
        let mut other = header.clone();
        other.machine.device = "another".into();
        let refusal = Journal::open(folder.path(), &other, false).expect_err("another device").to_string();
        assert!(refusal.contains("device is tester") && refusal.contains("another"), "{refusal}");
        let mut other = header.clone();
        other.build = "other shaders".into();
        let refusal = Journal::open(folder.path(), &other, false).expect_err("other shaders").to_string();
        assert!(refusal.contains("build is b"), "{refusal}");
        let mut other = header.clone();
        other.asked.rounds += 1;
        let refusal = Journal::open(folder.path(), &other, false).expect_err("other rounds").to_string();
        assert!(refusal.contains("rounds") && refusal.contains("--restart"), "{refusal}");
        Journal::open(folder.path(), &other, true).expect("begins anew").add(0, scene()).expect("written");
        Journal::open(folder.path(), &other, false).expect("is its own now");
    }

    #[test]
    fn times_of_still_and_of_moving_frames_are_not_mixed() {
        let (moving, still) = (info(&sweep()), SceneInfo { moving: false, ..info(&sweep()) });
        let refusal = scene_difference(&moving, &still).expect("other times");
        assert!(refusal.contains("everything moves") && refusal.contains("nothing moves"), "{refusal}");
        assert_eq!(scene_difference(&still, &still), None);
    }

    fn scene() -> JournalRecord {
        JournalRecord::Scene { scene: 0, info: info(&sweep()) }
    }

    #[test]
    fn a_command_that_could_not_start_keeps_no_other_from_its_folder() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let other = JournalHeader { scenes: vec!["builtin:nosuch".into()], ..header() };
        assert!(Journal::open(folder.path(), &other, false).expect("new").is_new);
        let mut journal = Journal::open(folder.path(), &header(), false).expect("only a header is there");
        assert!(journal.is_new);
        journal.add(0, scene()).expect("written");
        drop(journal);
        assert!(Journal::open(folder.path(), &other, false).is_err());
        assert!(!Journal::open(folder.path(), &header(), false).expect("goes on").is_new);
        assert!(Journal::open(folder.path(), &header(), true).expect("anew").is_new);
        // Broken off before anything was measured: other files of the folder are still of the run before.
        assert!(Journal::open(folder.path(), &header(), false).expect("still").is_new);
    }

    #[test]
    fn one_process_at_a_time_writes() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let mut first = Journal::open(folder.path(), &header(), false).expect("new");
        first.add(0, scene()).expect("written");
        for restart in [false, true] {
            let refusal = Journal::open(folder.path(), &header(), restart).expect_err("in use").to_string();
            assert!(refusal.contains("another process"), "{refusal}");
        }
        let known = first.scenes.clone();
        drop(first);
        assert_eq!(Journal::open(folder.path(), &header(), false).expect("free again").scenes, known);
    }

    #[test]
    fn lines_behind_a_damaged_one_are_dropped_and_counted() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let mut journal = Journal::open(folder.path(), &header(), false).expect("new");
        journal.add(0, scene()).expect("written");
        drop(journal);
        let path = folder.path().join(FILE);
        let mut text = std::fs::read_to_string(&path).expect("there");
        let line = text.lines().last().expect("a line").to_owned();
        text += &format!("damaged\n{line}\n{line}\n{{\"torn");
        std::fs::write(&path, text).expect("written");
        assert_eq!(Contents::read(&path).expect("readable").expect("there").dropped, 3);
        assert_eq!(Journal::open(folder.path(), &header(), false).expect("goes on").dropped, 3);
        assert_eq!(Journal::open(folder.path(), &header(), false).expect("goes on").dropped, 0);
    }

    #[test]
    fn a_flipped_digit_is_noticed_and_what_it_said_is_measured_again() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let mut journal = Journal::open(folder.path(), &header(), false).expect("new");
        journal.add(0, scene()).expect("written");
        for point in ["default", "a"] {
            journal
                .add(0, JournalRecord::Drawn { scene: 0, point: point.into(), drawn: drawn(0.125) })
                .expect("written");
        }
        drop(journal);
        let path = folder.path().join(FILE);
        let text = std::fs::read_to_string(&path).expect("there");
        // Still JSON, and still a number.
        let flipped = text.replacen("0.125", "0.175", 1);
        assert_ne!(flipped, text);
        std::fs::write(&path, flipped).expect("written");
        let journal = Journal::open(folder.path(), &header(), false).expect("goes on");
        assert_eq!(journal.dropped, 2);
        assert!(journal.scenes[0].info.is_some() && journal.scenes[0].drawn.is_empty());
    }

    #[test]
    fn a_journal_without_checksums_is_refused_until_it_is_begun_anew() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let old: String = [JournalRecord::Header(header()), scene()]
            .iter()
            .map(|record| serde_json::to_string(record).expect("JSON") + "\n")
            .collect();
        std::fs::write(folder.path().join(FILE), old).expect("written");
        let refusal = Journal::open(folder.path(), &header(), false).expect_err("old").to_string();
        assert!(refusal.contains("no checksums: --restart begins anew"), "{refusal}");
        assert!(Journal::open(folder.path(), &header(), true).expect("anew").is_new);
    }

    #[test]
    fn what_is_not_finite_is_read_again_or_never_written() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let mut journal = Journal::open(folder.path(), &header(), false).expect("new");
        journal.add(0, scene()).expect("written");
        let mut broken = drawn(0.1);
        broken.errors.converged.flip = f64::NAN;
        broken.errors.point.rel_mse = f64::INFINITY;
        journal.add(0, JournalRecord::Drawn { scene: 0, point: "default".into(), drawn: broken }).expect("written");
        let batch = Batch { points: vec!["a".into()], confirms: false, rounds: rounds(1, f64::NAN) };
        assert!(
            journal.add(0, JournalRecord::Batch { scene: 0, batch }).is_err_and(|e| e.to_string().contains("finite"))
        );
        journal.add(0, JournalRecord::Done { scene: 0 }).expect("written");
        drop(journal);
        let read = Journal::open(folder.path(), &header(), false).expect("goes on");
        assert!(read.dropped == 0 && read.scenes[0].done);
        let errors = &read.scenes[0].drawn["default"].errors;
        assert!(!errors.converged.flip.is_finite() && !errors.point.rel_mse.is_finite());
        assert_eq!(errors.converged.rmse, 0.1);
    }

    #[test]
    fn the_confirming_batch_tells_a_points_time() {
        let mut measured = SceneMeasurements::default();
        let batch =
            |confirms, ratio| Batch { points: vec!["a".into(), "b".into()], confirms, rounds: rounds(2, ratio) };
        measured.add(JournalRecord::Batch { scene: 0, batch: batch(false, 2.0) });
        measured.add(JournalRecord::Batch { scene: 0, batch: batch(true, 3.0) });
        let (found, times) = measured.times_of("b").expect("timed");
        assert!(found.confirms && times.len() == found.rounds.anchor.len());
        assert!(measured.times_of("c").is_none());
    }
}
