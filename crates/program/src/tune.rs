//! `afterlight tune`: settings that keep a bound on error or time, found on the device at hand and verified from other cameras.

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::{Arc, mpsc};
use std::thread;
use std::time::{Duration, Instant};

use afterlight::gpu::{Device, vk};
use afterlight::scene::{Camera, Scene, SettingsPatch, counted};
use afterlight_lab::report::advice;
use afterlight_lab::report::sweep::SweepError;
use afterlight_lab::report::sweep::accuracy::{Truths, affordable_size, sizes};
use afterlight_lab::report::sweep::families::Sweep;
use afterlight_lab::report::sweep::journal::{self, Journal, JournalHeader, SceneInfo};
use afterlight_lab::report::sweep::model::{Against, Metric, SceneReport, TruthInfo};
use afterlight_lab::report::tune::cameras::{HeldOutCamera, held_out, moments};
use afterlight_lab::report::tune::choice::{Attempt, Goal, GoalBound, Measurement};
use afterlight_lab::report::tune::evidence::{self, Evidence, PathMoments, SearchContext, error_text};
use afterlight_lab::report::tune::probe::{Awaited, BEST_SAMPLES};
use afterlight_lab::report::tune::{Tuned, Tuning, Within};
use afterlight_truth::measure::{LEAST_FOR_95, what_moves};
use afterlight_truth::reference::{Cache, CameraView, Mode, Reference, TruthOptions};
use tempfile::TempDir;

use super::args::{DeviceArgs, MotionArgs, SettingsArgs, samples, size, whole};
use super::failure::{Exit, Failure};
use super::measuring::{Bars, MeasuringArgs, base_of, fix_driver_threads, metric, sweep_of, truths};
use super::output::Sink;
use super::table::{TextTable, milliseconds};
use super::typed::Typed;
use super::workload::{Workload, warnings};
use super::{output, session};

/// Find the cheapest settings for an error bound, or the best for a time, on this device, and verify them from other cameras
#[derive(Debug, clap::Args)]
#[command(
    group(clap::ArgGroup::new("bound").required(true)),
    after_help = "\
Examples:
  afterlight tune builtin:hall --max-loss 2% --quick
  afterlight tune builtin:hall --max-error 0.05 --samples 1 --quick
  afterlight tune scene.toml --max-error 0.001 --metric relmse -o tuned.toml
  afterlight tune sponza.obj --max-ms 16.6 --size 1920x1080 --within 300
  afterlight tune builtin:hall --max-loss 5% --quick --path walk.toml
  afterlight render builtin:hall --settings tuned.toml -o tuned.png

The file has the settings as a scene file has them, and what they were chosen by:
`render --settings FILE` takes it, and `from` in a scene file's [settings].
The same command given again goes on where it ended or was broken off; another
bound measures only what it needs besides. docs/FLIP.md shows what an error looks like."
)]
pub struct Args {
    /// The scene: a model (.gltf, .glb, .obj), a .toml scene file, or `builtin:NAME?key=value&...`
    scene: String,
    /// Find the fastest settings whose error is at most this, against a truth of many samples a pixel
    #[arg(long, value_name = "ERROR", group = "bound", value_parser = positive, allow_hyphen_values = true)]
    max_error: Option<f64>,
    /// Find the fastest settings whose error exceeds that of the settings as given by at most this, as 2%
    #[arg(long, value_name = "PERCENT%", group = "bound", value_parser = percent, allow_hyphen_values = true)]
    max_loss: Option<f64>,
    /// Find the settings with the least error whose pictures take at most this many milliseconds, by the wall's clock or the device's: the slower
    #[arg(long, value_name = "MS", group = "bound", value_parser = positive, allow_hyphen_values = true)]
    max_ms: Option<f64>,
    /// Measure error by flip or, in exposed linear light, by relmse or rmse
    #[arg(long, value_name = "NAME", default_value = "flip", value_parser = metric)]
    metric: Metric,
    /// The settings that were chosen, as TOML with the evidence; - is standard output
    #[arg(short, long, value_name = "FILE", default_value = "tuned.toml", value_parser = Sink::parse)]
    output: Sink,
    /// Jittered frames that are averaged into a picture, 1 to 4096, as `render` takes it; 1 tunes single frames, as `view` and `bench` draw
    /// them [default: as for render: 8, or 1 with --fxaa or --msaa]
    #[arg(long, value_name = "N", value_parser = samples, allow_hyphen_values = true)]
    samples: Option<u32>,
    /// Other cameras that the choice must hold from, 0 to 64
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = whole::<u32>(0..=64), allow_negative_numbers = true)]
    cameras: u32,
    /// Choose settings from the middle of a camera path, a TOML file with [[keys]], and verify them from its other moments, in place of the scene's
    /// camera and others around it
    #[arg(long, value_name = "FILE", conflicts_with = "cameras")]
    path: Option<PathBuf>,
    /// Moments of the path, spread evenly from its start to its end, 2 to 64
    #[arg(long, value_name = "N", default_value_t = 5, requires = "path", value_parser = whole::<u32>(2..=64), allow_negative_numbers = true)]
    moments: u32,
    /// Stop measuring after about this long, 1 to 1000000: the best so far is verified, and what was not measured is named
    #[arg(long, value_name = "SECONDS", default_value_t = 60, value_parser = whole::<u32>(1..=1_000_000), allow_negative_numbers = true)]
    within: u32,
    /// Measure errors at this size, as 640x360 [default: the size of the pictures, halved until the truth takes about 10 s]
    #[arg(long, value_name = "WxH", value_parser = size)]
    truth_size: Option<[u32; 2]>,
    /// Measure anew what an earlier run of this command has measured
    #[arg(long)]
    restart: bool,
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

fn positive(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(number) if number > 0.0 && number.is_finite() => Ok(number),
        _ => Err("expected a number above 0".into()),
    }
}

/// A share from a percentage.
fn percent(text: &str) -> Result<f64, String> {
    let number = text.strip_suffix('%').and_then(|number| positive(number).ok());
    number.map(|percent| percent / 100.0).ok_or_else(|| "expected a percentage above 0, as 2%".into())
}

/// The time, about, that the truth of the scene's own camera may take: errors are measured of smaller pictures where it would take longer.
const TRUTH_TIME: Duration = Duration::from_secs(10);

/// The measurements on the device.
struct TuneMeasurements {
    header: JournalHeader,
    tuned: Tuned,
    cameras: Vec<HeldOutCamera>,
    walk: Option<PathMoments>,
    /// Points that there are.
    points: usize,
    took: Duration,
}

/// Measures, chooses, verifies, and writes the settings.
pub fn run(args: &Args) -> Result<(), Failure> {
    let begun = Instant::now();
    args.output.check()?;
    output::spare([&args.output], &args.path)?;
    fix_driver_threads();
    session::with_device(&args.device, |device| {
        let mut workload =
            Workload::open(&args.scene, &args.measuring.settings(&args.motion, &args.settings), args.quiet)?;
        workload.refuse_shutter("a choice of settings")?;
        workload.spare([&args.output])?;
        let goal = args.goal();
        let measured = measure(args, &mut workload, (&device, begun), &goal)?;
        let texts: Vec<String> = measured.cameras.iter().map(|camera| camera.text.clone()).collect();
        let search = SearchContext {
            program: concat!("afterlight ", env!("CARGO_PKG_VERSION")),
            machine: &measured.header.machine,
            scene: &measured.tuned.scene,
            goal: &goal,
            cameras: &texts,
            path: measured.walk.as_ref(),
        };
        let Tuned { patches, outcome, .. } = &measured.tuned;
        let Some(chosen) = &outcome.chosen else {
            let wider = "a wider bound or more --joint may do; `afterlight report` shows all of the front";
            let longer = || not_measured(args, &measured).unwrap_or_else(|| wider.to_owned());
            let hint = search.fitting(outcome).unwrap_or_else(longer);
            return Err(Failure::new(Exit::FailedCheck, search.failure(outcome)).with_hint(hint));
        };
        let evidence = Evidence::of(&search, chosen, &outcome.passed_over);
        let settings = tuned(args, &workload, &patches[chosen.point]);
        let failed = |error| Failure::new(Exit::BadInput, format!("cannot write the evidence: {error}"));
        args.output.write(evidence::file(&settings, &evidence).map_err(failed)?.as_bytes())?;
        let text = report(args, &measured, &search, chosen);
        if args.quiet { Ok(()) } else { output::print(&text, args.output.is_stdout()) }
    })
}

impl Args {
    /// The command that draws the scene with the chosen settings, which are in this file.
    fn drawing(&self, settings: &Path) -> Typed {
        let typed = Typed::new("render").about(&self.scene).loading(&self.settings);
        typed.option("settings", settings).on(&self.device)
    }

    fn goal(&self) -> Goal {
        let bound = match (self.max_error, self.max_loss, self.max_ms) {
            (Some(error), ..) => GoalBound::Error(error),
            (_, Some(loss), _) => GoalBound::Loss(loss),
            // clap sees to it that one of them is given.
            (.., ms) => GoalBound::Milliseconds(ms.unwrap_or(f64::INFINITY)),
        };
        Goal { bound, metric: self.metric }
    }

    /// The settings as given: pictures of as many samples as `render` would draw.
    fn base(&self, workload: &Workload) -> SettingsPatch {
        SettingsPatch { samples: Some(workload.samples(self.samples, false)), ..base_of(workload) }
    }
}

/// Returns the settings of the file: the choice over the settings of the command line and of `--settings`.
///
/// The size of `--quick` and the motion of timed frames are left out. The samples that were measured are always in: `render` would choose others if
/// the choice has `msaa` or `fxaa`.
fn tuned(args: &Args, workload: &Workload, choice: &SettingsPatch) -> SettingsPatch {
    let samples = choice.or(&args.base(workload)).samples;
    let SettingsPatch { size, shadow_cache, .. } = args.settings.said.or(&workload.settings_file);
    SettingsPatch { size, shadow_cache, samples, ..choice.or(&workload.said()) }
}

fn measure(
    args: &Args,
    workload: &mut Workload,
    (device, begun): (&Arc<Device>, Instant),
    goal: &Goal,
) -> Result<TuneMeasurements, Failure> {
    let MeasuringArgs { seed, .. } = args.measuring;
    let walk = walk_of(args, workload)?;
    let workload = &*workload;
    let base = args.base(workload);
    let sweep = sweep_of(workload, &base, device, &args.measuring.selection(None))?;
    // Before the sweep, which takes long: without them nothing can be verified.
    let (walk, cameras) = match walk {
        Some((walk, cameras)) => (Some(walk), cameras),
        None => (None, cameras_of(args, workload, &base)?),
    };
    let header = args.measuring.header(device, std::slice::from_ref(&args.scene), None, None);
    let truth = PlannedTruth::of(args, workload, &base)?;
    let software = device.physical.kind == vk::PhysicalDeviceType::CPU;
    let (places, cameras) = places(workload, cameras, (truth.view.size, base.decide().size), software);
    let (scene, goal, effort) = (&workload.scene, *goal, args.measuring.effort());
    let time = Duration::from_secs(args.within.into());
    let within = Some(Within { begun, time, cameras: cameras.len() as u32 });
    let error_size = truth.view.size;
    let tuning = Tuning { device, scene, base: &base, sweep: &sweep, goal, effort, seed, within, error_size };
    let info = tuning.info(&truth.hash, truth.samples);
    let (mut journal, _folder) = journal_of(args, &header, &info)?;
    let mut bars = Bars::of(workload.scene.name.clone(), args.quiet);
    // Frames that a CPU draws, and a bound on the wall's clock, are timed while nothing else runs.
    let is_beside = !software && !matches!(goal.bound, GoalBound::Milliseconds(_));
    let tuned = thread::scope(|threads| {
        let own = if is_beside {
            let (send, receive) = mpsc::channel();
            let (truth, base) = (&truth, &base);
            // Nobody waits any more where the search has failed.
            threads.spawn(move || _ = send.send(truth.beside(scene, base, args.quiet)));
            Awaited::Coming(receive)
        } else {
            let bars = Bars::of(workload.scene.name.clone(), args.quiet);
            truths(workload, &truth.view, &base, truth.samples, &bars)?.into()
        };
        Ok::<_, Failure>(tuning.run(&mut journal, (info, own), &mut |step| bars.step(step), &places)?)
    })?;
    warn_of_noise(args, &goal, &tuned.scene.truth)?;
    Ok(TuneMeasurements { header, tuned, cameras, walk, points: sweep.points.len(), took: begun.elapsed() })
}

/// Cameras that verify a choice, with the sizes of their pictures: a GPU draws them at the size of the scene's, and then the scene's own camera is the
/// last of them where errors were measured at another size. A CPU draws pictures as large as the truth.
fn places(
    workload: &Workload,
    mut cameras: Vec<HeldOutCamera>,
    (truth, own): ([u32; 2], [u32; 2]),
    software: bool,
) -> (Vec<(Camera, [u32; 2])>, Vec<HeldOutCamera>) {
    let camera = workload.scene.camera;
    if !software && truth != own {
        cameras.push(HeldOutCamera { camera, text: camera.to_string() });
    }
    let size = if software { truth } else { own };
    (cameras.iter().map(|other| (other.camera, size)).collect(), cameras)
}

/// The truth that errors are measured against, before it is rendered.
struct PlannedTruth {
    view: CameraView,
    samples: u32,
    /// The hash of everything that the truth depends on.
    hash: String,
}

impl PlannedTruth {
    /// A truth of the size that was asked for, or of one that an earlier run has rendered, or of one that takes about [`TRUTH_TIME`].
    fn of(args: &Args, workload: &Workload, base: &SettingsPatch) -> Result<Self, Failure> {
        let (settings, camera) = (base.decide(), workload.scene.camera);
        let samples = args.measuring.truth_samples();
        let reference = Reference::new(&workload.scene)?.with_settings(&settings, &camera);
        let view = CameraView { camera, size: settings.size };
        let cache = Cache::of_user();
        let is_there = |size: &[u32; 2]| {
            cache.as_ref().is_some_and(|cache| cache.has(&reference, &CameraView { size: *size, ..view }, samples))
        };
        let known = args.truth_size.or_else(|| sizes(view.size).find(is_there));
        let size = known.unwrap_or_else(|| affordable_size(&reference, &view, samples, TRUTH_TIME));
        let view = CameraView { camera, size };
        let hash = reference.fingerprint(&view, &TruthOptions::of(Mode::Converged { samples }));
        Ok(Self { view, samples, hash })
    }

    /// Renders the truth in another thread, without a progress bar.
    fn beside(&self, scene: &Scene, base: &SettingsPatch, quiet: bool) -> Result<Truths, SweepError> {
        let truths = Truths::of(scene, &self.view, &base.decide(), self.samples, &|_, _, _| {})?;
        if !quiet {
            // A terminal that is gone is no fault of the truth.
            let _ = output::print(&warnings(&truths.warnings), true);
        }
        Ok(truths)
    }
}

/// The moments of `--path`, and the cameras there but for that in the middle, which is the scene's from here on.
fn walk_of(args: &Args, workload: &mut Workload) -> Result<Option<(PathMoments, Vec<HeldOutCamera>)>, Failure> {
    let Some(file) = &args.path else { return Ok(None) };
    let path = workload.follow(file)?;
    let mut moments = moments(&path, args.moments as usize).into_iter();
    let own = moments.next().map_or(0.0, |(seconds, own)| {
        workload.scene.camera = own.camera;
        seconds
    });
    let (others, cameras) = moments.unzip();
    Ok(Some((PathMoments { file: file.display().to_string(), own, others }, cameras)))
}

/// Returns a sentence about the points that the time was not enough for.
fn not_measured(args: &Args, measured: &TuneMeasurements) -> Option<String> {
    const MOST: usize = 3;
    let left = &measured.tuned.not_measured;
    let named = left.iter().take(MOST).map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ");
    let more = left.len().saturating_sub(MOST);
    let more = if more > 0 { format!(" and {more} more") } else { String::new() };
    let (count, points, within) = (left.len(), measured.points, args.within);
    (count > 0).then(|| {
        format!(
            "not measured within {within} s: {count} of {}, {named}{more}; the same command goes on with them, and --within has more time",
            counted(points, "point")
        )
    })
}

/// Opens the folder of earlier measurements, which lies in the folder of the truths, keyed by everything that was asked but the bound. If none is
/// kept, it is a temporary one.
fn journal_of(args: &Args, header: &JournalHeader, info: &SceneInfo) -> Result<(Journal, Option<TempDir>), Failure> {
    let failed = |error| Failure::new(Exit::BadInput, format!("cannot make a folder for measurements: {error}"));
    let key = blake3::hash(output::json(&(journal::FORMAT, header, info))?.as_bytes()).to_hex();
    let kept = Cache::of_user().map(|cache| cache.folder().join(format!("tune-{}", &key[..16])));
    // A folder that cannot be written, is damaged, or is written by another process does not keep anyone from measuring.
    let opened = kept.map(|folder| match fs::create_dir_all(&folder) {
        Ok(()) => Journal::open(&folder, header, args.restart),
        Err(error) => Err(SweepError::File { doing: format!("make {}", folder.display()), error }),
    });
    match opened {
        Some(Ok(journal)) => {
            if !journal.is_new && !args.quiet {
                let measured = journal.scenes.first().map_or(0, |scene| scene.drawn.len());
                let text = format!(
                    "goes on from an earlier run that drew {}; --restart measures anew\n",
                    counted(measured, "point")
                );
                output::print(&text, true)?;
            }
            return Ok((journal, None));
        }
        Some(Err(error)) if !args.quiet => {
            output::print(&format!("warning: {error}: what is measured now is not kept\n"), true)?;
        }
        _ => {}
    }
    let folder = tempfile::tempdir().map_err(failed)?;
    Ok((Journal::open(folder.path(), header, true)?, Some(folder)))
}

fn cameras_of(args: &Args, workload: &Workload, base: &SettingsPatch) -> Result<Vec<HeldOutCamera>, Failure> {
    let reference = Reference::new(&workload.scene)?;
    let view = CameraView { camera: workload.scene.camera, size: base.decide().size };
    let cameras = held_out(&reference, &view, args.cameras as usize);
    if cameras.is_empty() && args.cameras > 0 {
        let why = format!("{} shows nothing from any other camera: a choice cannot be verified", args.scene);
        return Err(Failure::new(Exit::FailedCheck, why).with_hint("--cameras 0 does without"));
    }
    if cameras.len() < args.cameras as usize && !args.quiet {
        let text = format!(
            "warning: {} of {} other cameras found from which something is seen\n",
            cameras.len(),
            args.cameras
        );
        output::print(&text, true)?;
    }
    Ok(cameras)
}

/// Errors near the noise of the truth are not told from it.
fn warn_of_noise(args: &Args, goal: &Goal, truth: &TruthInfo) -> Result<(), Failure> {
    let Some(noise) = goal.near_noise(truth).filter(|_| !args.quiet) else { return Ok(()) };
    let metric = evidence::metric_key(goal.metric);
    let text = format!(
        "warning: the bound is near the truth's own noise ({noise:.2e} {metric} with {}): more --truth-samples would tell better\n",
        counted(truth.samples, "sample")
    );
    output::print(&text, true)
}

/// The choice in a sentence.
fn recommendation(scene: &SceneReport, metric: Metric, point: usize) -> String {
    if point == scene.default {
        return "Chosen: the settings as given: nothing that saves 1% or more keeps the bound from all cameras.".into();
    }
    let gain = advice::gain(scene, metric, Against::Converged, point);
    format!("Chosen: `{}`: {gain}.", scene.points[point].name)
}

/// Returns the choice with its figures from every camera, the figures of the given settings beside it, and the points that were passed over.
fn report(args: &Args, measured: &TuneMeasurements, search: &SearchContext, chosen: &Attempt) -> String {
    let TuneMeasurements { header, tuned: Tuned { scene, outcome, .. }, .. } = measured;
    let [width, height] = scene.size;
    let mut text = format!("{} ({}), {}\n", header.machine.device, header.machine.driver, header.machine.cpu);
    let _ = writeln!(
        text,
        "{}: {width}x{height}, {} of {} drawn and timed in {:.0} s, truth of {}{}\ntimes: {}",
        scene.name,
        scene.points.len(),
        counted(measured.points, "point"),
        measured.took.as_secs_f64(),
        counted(scene.truth.samples, "sample"),
        scene.truth.size.map_or_else(String::new, |[width, height]| format!(" at {width}x{height}")),
        what_moves(scene.moving)
    );
    for passed_over in outcome.passed_over.iter().filter_map(|attempt| search.passed_over(attempt)) {
        let figures = &passed_over.figures;
        let _ = writeln!(
            text,
            "{} is passed over: {} and {} from {}, as given {} and {}",
            passed_over.settings,
            error_text(figures.error),
            milliseconds(figures.ms),
            passed_over.camera,
            error_text(passed_over.default_error),
            milliseconds(passed_over.default_ms)
        );
    }
    let _ = writeln!(text, "\n{}", recommendation(scene, args.metric, chosen.point));
    let mut table = TextTable::with_figures_from(1);
    let metric = evidence::metric_key(args.metric);
    table.row([
        if measured.walk.is_some() { "moment" } else { "camera" },
        metric,
        "a picture",
        "95%",
        "as given",
        "a picture",
    ]);
    let mut row = |camera: &str, own: &Measurement, default: &Measurement| {
        table.row([
            camera.to_owned(),
            error_text(own.error),
            milliseconds(own.time.median),
            match own.time.count {
                LEAST_FOR_95.. => format!("+-{:.1}%", 100.0 * own.time.relative_half_width()),
                // No interval of so few covers 95%.
                _ => String::new(),
            },
            error_text(default.error),
            milliseconds(default.time.median),
        ]);
    };
    let of = |point: usize| search.goal.of(&scene.points[point]);
    let at = |seconds: f64| format!("{seconds:.2} s");
    let own = measured.walk.as_ref().map_or_else(|| "the scene's own".to_owned(), |walk| at(walk.own));
    row(&own, &of(chosen.point), &of(scene.default));
    for (index, (pair, camera)) in chosen.held_out.iter().zip(search.cameras).enumerate() {
        let moment = measured.walk.as_ref().and_then(|walk| walk.others.get(index).copied());
        row(&moment.map_or_else(|| camera.clone(), at), &pair.own, &pair.default);
    }
    text += &table.render();
    if let Some(best) = measured.tuned.best.as_ref().filter(|_| !chosen.held_out.is_empty()) {
        let _ = writeln!(
            text,
            "Errors below the first are estimates: against a picture of `{best}` with {BEST_SAMPLES} samples, plus what that lacks of the error at the scene's own camera."
        );
    }
    text.extend(scene.clocks().map(|words| words + "\n"));
    text.extend(not_measured(args, measured).map(|words| words + "\n"));
    text.extend(Sweep::quick_words(&scene.left_out).map(|words| words + "\n"));
    if let Sink::File(path) = &args.output {
        let _ = writeln!(text, "\nWritten to {}: {}", path.display(), args.drawing(path));
    }
    text
}

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::*;
    use crate::{Cli, CliCommand};

    #[test]
    fn the_printed_command_reads_the_scene_as_this_one_did() {
        let words = "afterlight tune m.obj --max-loss 2% --scale 0.01 --camera fitted --shadows off --settings old.toml --device 0";
        let words = words.split(' ').chain(["--sky", "my sky.hdr"]);
        let Ok(Cli { command: CliCommand::Tune(args), .. }) = Cli::try_parse_from(words) else {
            panic!("it is a command")
        };
        // The given settings are in the file.
        let expected = "afterlight render m.obj --camera fitted --scale 0.01 --sky \"my sky.hdr\" --settings \"my tuned.toml\" --device 0";
        assert_eq!(args.drawing(Path::new("my tuned.toml")).to_string(), expected);
    }

    #[test]
    fn bounds_are_above_zero_and_metrics_are_known_by_name() {
        assert_eq!(positive("16.6"), Ok(16.6));
        for text in ["0", "-1", "nan", "inf", "fast"] {
            assert!(positive(text).is_err(), "{text}");
        }
        assert_eq!((percent("2%"), percent("0.5%")), (Ok(0.02), Ok(0.005)));
        for text in ["0", "0%", "-3%", "abc", "%", "2", "nan%", "2 %"] {
            assert_eq!(percent(text), Err("expected a percentage above 0, as 2%".into()), "{text}");
        }
        assert_eq!(metric("relmse"), Ok(Metric::RelMse));
        assert!(metric("flop").is_err_and(|error| error.contains("flip")));
    }
}
