//! `afterlight bench`: the times of frames. Variants of the settings are drawn in turn, frame by frame, in one process,
//! so that a slow moment of the machine slows all of them.

mod contender;
mod layers;
mod over_sync;
mod plan_cost;
mod report;
mod walk;
mod why;

use std::path::PathBuf;
use std::sync::Arc;

use afterlight::gpu::Device;
use afterlight::scene::{Pose, SETTINGS, Settings, SettingsPatch, unknown};

use super::args::{DeviceArgs, MotionArgs, SettingsArgs, value, whole};
use super::failure::Failure;
use super::output::Sink;
use super::workload::Workload;
use super::{output, progress, session};
use contender::Contender;
use report::{BenchReport, BenchScene};
use walk::Walk;

/// Frames that a clip plays between the settled clocks and the measured frames, without `--warmup`.
const WARM_UP_FRAMES: u32 = 3;
/// Seconds by which clips advance from frame to frame.
const FRAME_SECONDS: f64 = 1.0 / 60.0;

/// Measure how long frames take, for one or several scenes and variants of the settings
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  afterlight bench builtin:hall
  afterlight bench sponza.obj --size 1920x1080 --frames 100 --json sponza.json
  afterlight bench builtin:hall --vary shadows=off --vary gbuffer=fat
  afterlight bench builtin:hall --settings tuned.toml --vary shadow-size=4096
  afterlight bench \"builtin:field?lights=64\" \"builtin:hall?lights=8\"
  afterlight bench builtin:hall --why
  afterlight bench sponza.obj --still --vary shadow-cache=off
  afterlight bench builtin:hall --plan-cost
  afterlight bench builtin:hall --layers
  afterlight bench builtin:hall --over-sync
  afterlight bench builtin:hall --path walk.toml --frames 200
  afterlight bench builtin:hall --json - | jq '.scenes[].runs[].wall_ms.median'

A frame's time is that from the start of its recording to its end on the device.
Variants are compared by the median of the ratios of frames drawn one after the
other.")]
pub struct Args {
    /// The scenes, each a model (.gltf, .glb, .obj), a .toml scene file, or `builtin:NAME?key=value&...`
    #[arg(required = true, value_name = "SCENE")]
    scenes: Vec<String>,
    /// Frames to measure for each variant
    #[arg(long, value_name = "N", default_value_t = 30, value_parser = whole::<u32>(1..=1_000_000), allow_negative_numbers = true)]
    frames: u32,
    /// Move the camera along a path, a TOML file with [[keys]], while frames are measured: from its start to its end
    #[arg(long, value_name = "FILE", conflicts_with = "plan_cost")]
    path: Option<PathBuf>,
    /// Frames to draw before measuring, after the first [default: until the times of windows of frames agree, as the clocks of an idle GPU rise, and 3]
    #[arg(long, value_name = "N", value_parser = whole::<u32>(0..=1_000_000), allow_negative_numbers = true)]
    warmup: Option<u32>,
    #[arg(long, value_name = "SETTINGS", value_parser = BenchVariant::parse, help = vary_help())]
    vary: Vec<BenchVariant>,
    /// Measure what each part would cost that the plan leaves out: drawn with it and without it in turn, two at a time
    #[arg(long, conflicts_with_all = ["vary", "plan"])]
    plan_cost: bool,
    /// Say why frames are slow: each cost in them is switched to its cheapest, drawn in turn with the settings as given, and told with what it saves,
    /// what it does to the picture, and the option to type
    #[arg(long, conflicts_with_all = ["vary", "plan_cost", "path"])]
    why: bool,
    /// Measure what the validation layer's checks cost: frames under each kind of them are drawn in turn with frames without the layer
    #[arg(long, conflicts_with_all = ["vary", "plan_cost", "why", "path", "validate"])]
    layers: bool,
    /// Measure what too much order costs: each dependency is widened to all commands, then all of them, then a full barrier stands before each pass
    #[arg(long, conflicts_with_all = ["vary", "plan_cost", "why", "path", "layers"])]
    over_sync: bool,
    /// Write the figures as JSON to a file, or to standard output for -
    #[arg(long, value_name = "FILE", value_parser = Sink::parse)]
    json: Option<Sink>,
    /// Print nothing but errors
    #[arg(short, long)]
    quiet: bool,
    #[command(flatten)]
    motion: MotionArgs,
    #[command(flatten)]
    settings: SettingsArgs,
    #[command(flatten)]
    device: DeviceArgs,
}

fn vary_help() -> String {
    let mut keys = varied();
    keys.sort_unstable();
    format!(
        "Compare with other settings: key=value, several in one go separated by blanks; may be given several times. Keys: {}",
        keys.join(", ")
    )
}

/// The keys that `--vary` takes. `samples` is none of them, because single frames are measured.
fn varied() -> Vec<&'static str> {
    SETTINGS.iter().map(|setting| setting.key).filter(|key| *key != SAMPLES).collect()
}

const SAMPLES: &str = "samples";

/// A change of the given settings, and how it was written.
#[derive(Debug, Clone, Default)]
struct BenchVariant {
    name: String,
    patch: SettingsPatch,
}

impl BenchVariant {
    fn parse(text: &str) -> Result<Self, String> {
        let name = text.split_whitespace().collect::<Vec<_>>().join(" ");
        let keys = varied();
        for (key, _) in text.split_whitespace().filter_map(|pair| pair.split_once('=')) {
            if key == SAMPLES {
                return Err("single frames are measured, however many of them a picture is made of".into());
            }
            if !keys.contains(&key) {
                return Err(unknown("setting", key, &keys));
            }
        }
        match name.is_empty() {
            true => Err("nothing is varied".into()),
            false => Ok(Self { name, patch: value(text)? }),
        }
    }

    /// The settings as they were given.
    fn base() -> Self {
        Self { name: "as given".into(), ..Self::default() }
    }
}

/// Measures and reports.
pub fn run(args: &Args) -> Result<(), Failure> {
    if let Some(sink) = &args.json {
        sink.check()?;
    }
    let json_on_stdout = args.json.as_ref().is_some_and(Sink::is_stdout);
    session::with_device(&args.device, |device| {
        let mut report = BenchReport::new(&device.physical, args);
        for spec in &args.scenes {
            let scene = measure(args, spec, &device)?;
            if !args.quiet {
                output::print(&scene.text(&report.device.name), json_on_stdout)?;
            }
            report.scenes.push(scene);
        }
        report.peak_memory_bytes = afterlight_truth::measure::peak_memory_bytes();
        if !args.quiet {
            output::print(&report.closing_text(), json_on_stdout)?;
        }
        match &args.json {
            Some(sink) => sink.write(output::json(&report)?.as_bytes()),
            None => Ok(()),
        }
    })
}

/// Measures all variants of one scene. All of them are held at once, or they could not take turns.
fn measure(args: &Args, spec: &str, device: &Arc<Device>) -> Result<BenchScene, Failure> {
    // Single costs and parts are measured at one moment.
    let rests = args.motion.is_still() || args.plan_cost || args.why || args.layers || args.over_sync;
    let open = if rests { Workload::open } else { Workload::open_moving };
    let mut workload = open(spec, &args.motion.over(&args.settings), args.quiet)?;
    workload.spare(&args.json)?;
    output::spare(&args.json, &args.path)?;
    let walk = args.path.as_deref().map(|file| Walk::of(file, &mut workload, args.frames)).transpose()?;
    if args.plan_cost {
        return plan_cost::measure(args, &workload, device);
    }
    if args.why {
        return why::measure(args, &workload, device);
    }
    if args.layers {
        return layers::measure(args, &workload);
    }
    if args.over_sync {
        return over_sync::measure(args, &workload, device);
    }
    let mut contenders = Vec::new();
    for variant in std::iter::once(&BenchVariant::base()).chain(&args.vary) {
        // Frames are measured, however many of them a picture is made of.
        let settings = Settings { samples: 1, ..workload.settings(&variant.patch, &device.physical)? };
        contenders.push(Contender::new(&variant.name, device, &workload, settings)?);
    }
    // Measured frames show the same moments, however long the clocks take to settle.
    let warmup = args.warmup.unwrap_or(WARM_UP_FRAMES);
    let rounds = warmup + args.frames;
    let bar = progress::bar(workload.scene.name.clone(), u64::from(rounds), args.quiet);
    let scene = &workload.scene;
    let mut pose = Pose::default();
    let mut warm_up = None;
    for round in 0..rounds {
        // The warm-up on a path stands at its start.
        let measured = round.checked_sub(warmup);
        let time = workload.playing.time + f64::from(round) * FRAME_SECONDS;
        scene.motion.pose_into(&workload.playing.with_time(time), &mut pose);
        let own = || scene.looks_through.map_or(scene.camera, |index| pose.camera(scene, index));
        let camera = walk.as_ref().map_or_else(own, |walk| walk.camera(measured.unwrap_or(0)));
        for contender in &mut contenders {
            contender.pose(scene, &pose)?;
        }
        if round == 0 && args.warmup.is_none() {
            warm_up = Some(contender::settled(&mut contenders.iter_mut().collect::<Vec<_>>(), &camera)?);
        }
        for contender in &mut contenders {
            contender.draw(&camera, measured.is_some())?;
        }
        bar.step();
    }
    drop(bar);
    Ok(BenchScene::of(&workload, &contenders, walk.as_ref()).after(warm_up))
}
