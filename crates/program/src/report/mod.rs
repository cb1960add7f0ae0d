//! `afterlight report`: families of settings, measured against the truth on the device at hand.

mod files;
mod text;

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use afterlight::gpu::Device;
use afterlight::scene::{SettingsPatch, unknown};
use afterlight_lab::report::sweep::SweepError;
use afterlight_lab::report::sweep::accuracy::other_triangle;
use afterlight_lab::report::sweep::assemble::{self, fronts_of};
use afterlight_lab::report::sweep::attribution::AttributionLimits;
use afterlight_lab::report::sweep::families::{Sweep, family_keys};
use afterlight_lab::report::sweep::journal::{self, Contents, Journal, JournalRecord, SceneInfo};
use afterlight_lab::report::sweep::merge::{self, ShardJournal};
use afterlight_lab::report::sweep::meter::DeviceMeter;
use afterlight_lab::report::sweep::model::{Metric, Report, SceneReport, Shard};
use afterlight_lab::report::sweep::run::{Run, SceneProgress};
use afterlight_truth::reference::CameraView;

use super::args::{self, DeviceArgs, MotionArgs, SettingsArgs};
use super::failure::{Exit, Failure};
use super::measuring::{Bars, MeasuringArgs, base_of, fix_driver_threads, metric, sweep_of, truths};
use super::output::Sink;
use super::workload::Workload;
use super::{output, progress, session};
use files::Folder;

/// Measure how far pictures are from the truth and what they cost, for families of settings, and find the Pareto front
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  afterlight report builtin:hall -o report --quick
  afterlight report sponza.obj builtin:spheres -o report --size 640x360
  afterlight report builtin:hall -o report --families shadow-size,samples --all
  afterlight report builtin:hall -o part2 --shard 2/4
  afterlight report --merge part1 part2 part3 part4 -o report
  afterlight report builtin:spheres -o report --quick --json - | jq .machine

The folder gets report.html, report.json, report.csv and pictures. A run that was
broken off goes on when the same command is given again.
docs/REPORT.md says what is measured, and how; docs/FLIP.md shows what an error
looks like.")]
pub struct Args {
    /// The scenes, each a model (.gltf, .glb, .obj), a .toml scene file, or `builtin:NAME?key=value&...`
    #[arg(required_unless_present = "merge", value_name = "SCENE")]
    scenes: Vec<String>,
    /// The report's folder, made where it is not there
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// Measure only these families, as gbuffer,shadow-size,samples,joint [default: all that the scene needs]
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_parser = family)]
    families: Option<Vec<String>>,
    /// Measure the printed Pareto front, the only one with --quick, by flip or, in exposed linear light, relmse or rmse
    #[arg(long, value_name = "NAME", default_value = "flip", value_parser = metric)]
    metric: Metric,
    /// Measure one part of several, to be joined with --merge: from 1/N to N/N
    #[arg(long, value_name = "I/N", value_parser = args::shard)]
    shard: Option<Shard>,
    /// Join the folders of all shards in place of measuring
    #[arg(
        long,
        value_name = "DIR",
        num_args = 1..,
        conflicts_with_all = ["scenes", "families", "shard", "restart", "MeasuringArgs", "MotionArgs", "SettingsArgs", "DeviceArgs"]
    )]
    merge: Vec<PathBuf>,
    /// Print every point that was measured, and not only the front
    #[arg(long)]
    all: bool,
    /// Forget what the folder holds of another or an older report
    #[arg(long)]
    restart: bool,
    /// Write the report as JSON to another file as well, or to standard output for -
    #[arg(long, value_name = "FILE", value_parser = Sink::parse)]
    json: Option<Sink>,
    /// Print nothing but errors
    #[arg(short, long)]
    quiet: bool,
    #[command(flatten)]
    measuring: MeasuringArgs,
    #[command(flatten)]
    motion: MotionArgs,
    #[command(flatten)]
    settings: SettingsArgs,
    #[command(flatten)]
    device: DeviceArgs,
}

fn family(text: &str) -> Result<String, String> {
    let known = family_keys();
    if known.contains(&text) { Ok(text.into()) } else { Err(unknown("family", text, &known)) }
}

/// Measures, or joins earlier measurements, and writes the report.
pub fn run(args: &Args) -> Result<(), Failure> {
    if let Some(sink) = &args.json {
        sink.check()?;
    }
    if args.merge.is_empty() { measure(args) } else { join(args) }
}

fn measure(args: &Args) -> Result<(), Failure> {
    fix_driver_threads();
    let folder = Folder::make(&args.output)?;
    session::with_device(&args.device, |device| {
        // All of them before anything is measured or forgotten: the last may not be there.
        let open = |spec: &String| SweepJob::open(args, spec, &device);
        let subjects = args.scenes.iter().map(open).collect::<Result<Vec<_>, _>>()?;
        let header = args.measuring.header(&device, &args.scenes, args.families.clone(), args.shard);
        let mut journal = Journal::open(folder.path(), &header, args.restart)?;
        if journal.is_new {
            folder.clear()?;
        }
        if journal.dropped > 0 && !args.quiet {
            let (name, count) = (folder.path().join(journal::FILE), journal.dropped);
            let text = format!("warning: {} is damaged: {count} lines are measured again\n", name.display());
            output::print(&text, true)?;
        }
        let mut scenes = Vec::new();
        for (index, subject) in subjects.into_iter().enumerate() {
            scenes.push(measure_scene(args, (index, subject), &device, &mut journal, &folder)?);
        }
        let report = assemble::report(&header, &journal.scenes, args.shard);
        finish(args, &folder, Report { scenes, ..report })
    })
}

/// A scene that is to be measured.
struct SweepJob {
    workload: Workload,
    base: SettingsPatch,
    sweep: Sweep,
}

impl SweepJob {
    fn open(args: &Args, spec: &str, device: &Device) -> Result<Self, Failure> {
        let workload = Workload::open(spec, &args.measuring.settings(&args.motion, &args.settings), args.quiet)?;
        workload.refuse_shutter("a report")?;
        workload.spare(&args.json)?;
        let base = base_of(&workload);
        let sweep = sweep_of(&workload, &base, device, &args.measuring.selection(args.families.clone()))?;
        Ok(Self { workload, base, sweep })
    }
}

fn measure_scene(
    args: &Args,
    (index, subject): (usize, SweepJob),
    device: &Arc<Device>,
    journal: &mut Journal,
    folder: &Folder,
) -> Result<SceneReport, Failure> {
    let SweepJob { workload, base, sweep } = subject;
    let MeasuringArgs { seed, .. } = args.measuring;
    let mut bars = Bars::of(workload.scene.name.clone(), args.quiet);
    let view = CameraView { camera: workload.scene.camera, size: base.decide().size };
    let mut truths = truths(&workload, &view, &base, args.measuring.truth_samples(), &bars)?;
    let raw = &truths.raw.point;
    truths.info.other_triangle = other_triangle(device, &workload.scene, &workload.scene.camera, &base.decide(), raw)?;
    let fronts = fronts_of(args.measuring.quick, args.metric);
    let info = SceneInfo::of(&workload.scene, &base, &sweep, (&truths.hash, &truths.info), fronts);
    match &journal.scenes[index].info {
        None => journal.add(index, JournalRecord::Scene { scene: index, info })?,
        Some(there) => {
            if let Some(difference) = journal::scene_difference(there, &info) {
                let what = format!("{} holds another report: {difference}", args.output.display());
                return Err(Failure::usage(what).with_hint("choose another folder with -o, or --restart"));
            }
        }
    }
    let effort = args.measuring.effort();
    let (scene, camera, kept) = (&workload.scene, workload.scene.camera, BTreeMap::new());
    let mut meter = DeviceMeter { device, scene, camera, base: &base, truths, effort, kept };
    let own = sweep.own(args.shard);
    let mut watch = |step: SceneProgress| bars.step(step);
    Run { scene: index, sweep: &sweep, own: &own, seed, journal, watch: &mut watch }.measure(&mut meter)?;
    drop(bars);
    attribute(args, index, &meter, journal)?;
    let report = assemble::scene_report(&journal.scenes[index]);
    let missing = || Failure::new(Exit::BadInput, format!("nothing of {} was measured", args.scenes[index]));
    let report = folder.draw_pictures(report.ok_or_else(missing)?, &meter, &sweep)?;
    if !journal.scenes[index].done {
        journal.add(index, JournalRecord::Done { scene: index })?;
    }
    Ok(report)
}

/// Takes the error of the settings as given apart, once: of several shards the first does.
fn attribute(args: &Args, index: usize, meter: &DeviceMeter, journal: &mut Journal) -> Result<(), Failure> {
    if journal.scenes[index].attribution.is_some() || args.shard.is_some_and(|shard| shard.index > 1) {
        return Ok(());
    }
    let what = "the parts of the error";
    let _spinner = progress::loading(what, args.quiet);
    progress::line(&format!("{}: {what}", args.scenes[index]), args.quiet);
    let all = AttributionLimits::default();
    let limits =
        if args.measuring.quick { AttributionLimits { pixels: all.pixels * 3 / 10, shadowed_lights: 4 } } else { all };
    let attribution = meter.attribution(&limits)?;
    Ok(journal.add(index, JournalRecord::Attribution { scene: index, attribution })?)
}

fn join(args: &Args) -> Result<(), Failure> {
    let read = |folder: &PathBuf| -> Result<ShardJournal, Failure> {
        let name = folder.display().to_string();
        let contents = Contents::read(&folder.join(journal::FILE))?;
        let missing = || Failure::new(Exit::BadInput, format!("{name} holds no report"));
        Ok(ShardJournal { contents: contents.ok_or_else(missing)?, folder: name })
    };
    let parts = args.merge.iter().map(read).collect::<Result<Vec<_>, _>>()?;
    let place = |folder: &Path| fs::canonicalize(folder).ok();
    let own = place(&args.output);
    if let Some(part) = args.merge.iter().find(|part| own.is_some() && place(part) == own) {
        let what = format!("{} is one of the parts, and cannot hold the whole", part.display());
        return Err(Failure::usage(what).with_hint("choose another folder with -o"));
    }
    let (header, scenes) = merge::join(&parts)?;
    let folder = Folder::make(&args.output)?;
    let mut report = assemble::report(&header, &scenes, None);
    for scene in &mut report.scenes {
        folder.copy_pictures(scene, &args.merge)?;
    }
    finish(args, &folder, report)
}

/// Writes the files and prints the front.
fn finish(args: &Args, folder: &Folder, report: Report) -> Result<(), Failure> {
    folder.write(&report)?;
    let on_stdout = args.json.as_ref().is_some_and(Sink::is_stdout);
    if !args.quiet {
        output::print(&text::of(&report, args.metric, args.all, folder.path()), on_stdout)?;
    }
    match &args.json {
        Some(sink) => sink.write(output::json(&report)?.as_bytes()),
        None => Ok(()),
    }
}

impl From<SweepError> for Failure {
    fn from(error: SweepError) -> Self {
        match error {
            SweepError::Frame(error) => error.into(),
            SweepError::Refused(_) => Self::usage(error.to_string()),
            SweepError::Mismatch(_) | SweepError::File { .. } => Self::new(Exit::BadInput, error.to_string()),
        }
    }
}

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::*;

    #[derive(Debug, clap::Parser)]
    struct CommandLine {
        #[command(flatten)]
        args: Args,
    }

    fn parse(line: &str) -> Result<Args, clap::Error> {
        CommandLine::try_parse_from(["report"].into_iter().chain(line.split(' '))).map(|line| line.args)
    }

    #[test]
    fn joining_takes_no_option_that_it_would_ignore() {
        let merge = parse("--merge a b -o whole --metric rmse --json - -q").expect("joining has these");
        assert_eq!(merge.merge.len(), 2);
        let measuring =
            "--quick|--joint 3|--rounds 9|--truth-samples 4|--seed 7|--families joint|--shard 1/2|--restart|--still";
        let drawing =
            "--size 64x36|--camera 0,0,0/1,1,1|--brdf lambert|--shadow-size 512|--settings a.toml|--plan full";
        for option in measuring.split('|').chain(drawing.split('|')).chain(["--device 0", "--validate"]) {
            let error = parse(&format!("{option} -o whole --merge a b")).expect_err(option);
            assert_eq!(error.kind(), clap::error::ErrorKind::ArgumentConflict, "{option}");
        }
    }

    #[test]
    fn numbers_without_sense_are_refused() {
        for option in ["--joint 99999999999", "--joint 10001", "--joint -1", "--rounds 2"] {
            assert!(parse(&format!("builtin:hall -o out {option}")).is_err(), "{option}");
        }
        assert!(parse("builtin:hall -o out --joint 10000").is_ok());
    }

    #[test]
    fn a_shard_is_one_of_so_many() {
        assert_eq!(args::shard("2/3"), Ok(Shard { index: 2, count: 3 }));
        for text in ["0/3", "4/3", "1", "a/b", "1/0", "-1/2"] {
            assert!(args::shard(text).is_err(), "{text}");
        }
    }

    #[test]
    fn families_and_metrics_are_known_by_name() {
        assert_eq!(family("joint"), Ok("joint".into()));
        assert!(family("shadowsize").is_err_and(|error| error.contains("did you mean \"shadow-size\"")));
        assert_eq!(metric("flip"), Ok(Metric::Flip));
        assert!(metric("ssim").is_err_and(|error| error.contains("relmse")));
    }
}
