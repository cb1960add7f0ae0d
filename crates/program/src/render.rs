//! `afterlight render`: scenes into a picture each, or a scene into many along a camera path.

mod folder;
mod path;
mod scenes;
mod transparent;
mod verdict;

use std::cell::RefCell;
use std::fmt::Write as _;
use std::path::PathBuf;
use std::rc::Rc;
use std::sync::Arc;
use std::time::Instant;

use afterlight::frame::{self, Complexity, Picture, Pixels, Renderer, list, plan_for, rows};
use afterlight::gpu::Device;
use afterlight::plan::{FramePlan, averages_samples};
use afterlight::scene::{Output, Pose, Settings, SettingsPatch, View, counted, metered_ev100};
use afterlight_truth::measure::{Shard, peak_memory_bytes};

use super::args::{DeviceArgs, SettingsArgs, ViewChoice, fps, samples, seconds, shard, view, whole};
use super::contact_sheet::{self, SheetTile};
use super::failure::Failure;
use super::image_output::{Destination, PictureFormat};
use super::output::Sink;
use super::table::{TextTable, bytes, milliseconds};
use super::typed::Typed;
use super::workload::{Workload, memory_table, milliseconds_since, plan_table};
use super::{drop, memory, progress};
use path::go_to;

/// Draw scenes into a picture each
#[derive(Debug, Clone, clap::Args)]
#[command(after_help = "\
Examples:
  afterlight render builtin:hall -o hall.png
  afterlight render sponza.obj -o sponza.exr --camera \"-9,2,0/0,3,0/70\"
  afterlight render scene.toml -o - | display
  afterlight render builtin:hall --samples 64 -o smooth.png
  afterlight render builtin:spheres --gbuffer lean,normal=rgb10a2 --validate
  afterlight render a.obj b.obj -o {name}.png --validate --junit passed.xml
  afterlight render builtin:hall --validate --drop geometry-to-lighting
  afterlight render scene.toml --settings tuned.toml -o tuned.png
  afterlight render builtin:hall --view all -o sheet.png
  afterlight render builtin:hall --path walk.toml --fps 10 -o walk.png
  afterlight render builtin:seaweed --time 2.5 --clip sway -o sway.png
  afterlight render builtin:seaweed --duration 12 --fps 25 -o sea.png")]
pub struct Args {
    /// The scenes: models (.gltf, .glb, .obj), .toml scene files, or `builtin:NAME?key=value&...`; or folders, whose models are drawn onto one labelled
    /// sheet, or with {name} in -o into a picture each
    #[arg(required = true, value_name = "SCENE")]
    scenes: Vec<String>,
    /// The picture: .png, or .exr for linear light in nits; - is standard output (PNG). Of several along a path, of clips or of a turntable .mp4, .webm,
    /// .mov and .gif are videos, which ffmpeg encodes where it is installed. {name} in it becomes the scene's name, which several scenes need
    #[arg(short, long, value_name = "FILE", default_value = "afterlight.png", value_parser = Destination::parse_with_videos)]
    output: Destination,
    /// Draw the picture this many times, and write the last one
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = whole::<u32>(1..=1_000_000), allow_negative_numbers = true)]
    frames: u32,
    /// Draw along a camera path, a TOML file with [[keys]]: walk.png becomes walk-0000.png and so on, and standard output
    /// has one PNG after another
    #[arg(long, value_name = "FILE", conflicts_with = "frames")]
    path: Option<PathBuf>,
    /// Pictures for each second of a path or of clips, which go on from --time: along --path, for --duration seconds, or else for as long as the
    /// longest clip [default: 30]
    #[arg(long, value_name = "N", value_parser = fps, conflicts_with = "frames", allow_hyphen_values = true)]
    fps: Option<f64>,
    /// Draw clips for this many seconds, --fps pictures to a second, numbered as with --path
    #[arg(long, value_name = "SECONDS", value_parser = seconds, conflicts_with = "frames", allow_hyphen_values = true)]
    duration: Option<f64>,
    /// Go around the model in this many pictures, from a camera that holds it at every angle; clips go on meanwhile, --fps pictures to a second
    #[arg(long, value_name = "N", value_parser = whole::<u32>(1..=100_000), conflicts_with_all = ["frames", "path", "duration", "camera"], allow_negative_numbers = true)]
    turntable: Option<u32>,
    /// Leave the background out: a .png with alpha, or an .exr whose light is multiplied by it. The ground below a bare model goes, too
    #[arg(long)]
    transparent: bool,
    /// Draw every N-th picture of a sequence, from the I-th on, so that N processes or machines draw all of them
    #[arg(long, value_name = "I/N", value_parser = shard)]
    shard: Option<Shard>,
    /// Jittered frames that are averaged into the picture, 1 to 4096 [default: 8, or 1 with --view, --msaa, --taa and what works on
    /// the finished picture: --fxaa, --aberration, --vignette, --grain]
    #[arg(long, value_name = "N", value_parser = samples, allow_hyphen_values = true)]
    samples: Option<u32>,
    #[arg(long, value_name = "NAME|all", value_parser = view, help = view_help())]
    view: Option<ViewChoice>,
    /// Leave this dependency out (`afterlight inspect` lists them), to see a check fail: exit code 1 if the layer or the
    /// specification's rules notice
    #[arg(long, value_name = "DEPENDENCY")]
    drop: Option<String>,
    /// Write the verdict on each scene, with the layer's messages, as JSON; - is standard output
    #[arg(long, value_name = "FILE", value_parser = Sink::parse)]
    json: Option<Sink>,
    /// Write the same as JUnit XML, which build servers read; - is standard output
    #[arg(long, value_name = "FILE", value_parser = Sink::parse)]
    junit: Option<Sink>,
    /// Print nothing but errors
    #[arg(short, long)]
    quiet: bool,
    #[command(flatten)]
    settings: SettingsArgs,
    #[command(flatten)]
    device: DeviceArgs,
    /// Where pictures go in place of files, for a sheet of several.
    #[arg(skip)]
    tiles: Option<Tiles>,
}

/// Pictures that are kept.
type Tiles = Rc<RefCell<Vec<Picture>>>;

/// The result of drawing a scene.
struct RenderOutput {
    /// The text to print.
    text: String,
    /// The hazards without the dependency of `--drop`, a sentence each.
    hazards: Vec<String>,
    /// The files that the scene was read from.
    files: Vec<PathBuf>,
}

impl Args {
    /// Returns true if there are several moments to be drawn.
    fn is_sequence(&self) -> bool {
        self.path.is_some() || self.fps.is_some() || self.duration.is_some() || self.turntable.is_some()
    }

    /// Writes the picture, or keeps it for a sheet.
    fn give(&self, picture: Picture) -> Result<(), Failure> {
        match &self.tiles {
            Some(tiles) => tiles.borrow_mut().push(picture),
            None => self.output.write(&picture)?,
        }
        Ok(())
    }

    /// The command that prints the plan of the scene's frames.
    fn inspecting(&self, scene: &str, samples: u32) -> Typed {
        let view = match self.view {
            Some(ViewChoice::One(view)) => Some(view.to_string()),
            _ => None,
        };
        let samples = (samples > 1).then(|| samples.to_string());
        let is_linear = self.output.format == PictureFormat::Exr && self.drop.is_none();
        let typed = Typed::new("inspect").about(scene).drawing(&self.settings).option_if("view", view);
        let typed = typed.option_if("samples", samples).flag("linear", is_linear);
        typed.flag("playing", self.is_sequence() && self.drop.is_none()).on(&self.device)
    }
}

fn view_help() -> String {
    let names: Vec<_> = View::NAMES.iter().map(|(name, _)| *name).collect();
    format!("Show one of {}, or all of them on one labelled sheet", names.join(", "))
}

/// Draws and writes the picture.
pub fn run(args: &Args, is_verbose: bool) -> Result<(), Failure> {
    if args.drop.is_some() && args.device.validate.is_none() {
        return Err(Failure::usage("--drop needs --validate: nothing else would notice"));
    }
    if args.view == Some(ViewChoice::All) && args.output.format == PictureFormat::Exr {
        return Err(Failure::usage("--view all makes a PNG picture: the views have no common unit for an .exr file"));
    }
    if args.output.format == PictureFormat::Exr {
        args.settings.refuse_shown()?;
    }
    if args.view == Some(ViewChoice::All) && args.samples.is_some() {
        return Err(Failure::usage("--view all draws each view once: --samples does not apply to it"));
    }
    if args.view == Some(ViewChoice::All) && args.is_sequence() {
        return Err(Failure::usage("--view all draws each view once: --path, --fps and --duration do not apply to it"));
    }
    if args.shard.is_some() && !args.is_sequence() {
        return Err(Failure::usage("--shard deals the pictures of a sequence: it needs --path, --fps or --duration"));
    }
    if args.view == Some(ViewChoice::All) && args.drop.is_some() {
        return Err(Failure::usage("--drop leaves a dependency out of one view: it does not go with --view all"));
    }
    if args.output.format == PictureFormat::Video && !args.is_sequence() {
        let why = format!(
            "{} is a video, of several pictures: --turntable, --path, --fps or --duration say which",
            args.output.sink
        );
        return Err(Failure::usage(why));
    }
    if args.transparent && (args.is_sequence() || args.view.is_some() || args.drop.is_some() || args.frames > 1) {
        let why = "--transparent draws the lit picture twice, before black and before white: --view, --frames, --drop and sequences do not apply to it";
        return Err(Failure::usage(why));
    }
    scenes::run(args, is_verbose)
}

/// Draws and writes the picture of one scene.
fn draw_scene(args: &Args, scene: &str, device: &Arc<Device>, is_verbose: bool) -> Result<RenderOutput, Failure> {
    let (settings, quiet) = (&args.settings, args.quiet);
    let workload = match args.view {
        _ if args.is_sequence() => Workload::open_moving(scene, settings, quiet)?,
        Some(ViewChoice::All) => Workload::open(scene, settings, quiet)?,
        Some(ViewChoice::One(view)) => Workload::open_for_frames(scene, settings, Some(view), quiet)?,
        None => Workload::open_for_frames(scene, settings, None, quiet)?,
    };
    workload.spare([&args.output.sink])?;
    let files = workload.scene.files.clone();
    let drawn = match args.view {
        _ if args.is_sequence() => path::draw((args, scene), workload, device, is_verbose),
        _ if args.transparent => transparent::draw((args, scene), workload, device, None, is_verbose),
        Some(ViewChoice::All) => draw_sheet(args, &workload, device),
        Some(ViewChoice::One(view)) => draw((args, scene), workload, device, Some(view), is_verbose),
        None => draw((args, scene), workload, device, None, is_verbose),
    };
    Ok(RenderOutput { files, ..drawn? })
}

/// Returns the renderer, and the hazards without the dependency of `--drop`. A scene that rests is uploaded once, and its meshes and textures are
/// then freed: drivers need memory for the first frame, because they compile shaders for it.
fn renderer(
    args: &Args,
    device: &Arc<Device>,
    workload: &mut Workload,
    settings: &Settings,
) -> Result<(Renderer, Vec<String>), Failure> {
    let mut hazards = Vec::new();
    let renderer = match &args.drop {
        None if workload.scene.moves() => Renderer::new(device, &workload.scene, settings),
        None => Renderer::taking(device, &mut workload.scene, settings),
        Some(name) => {
            let plan = plan_for(device, &workload.scene, settings);
            let plan = plan.map_err(|error| workload.blame(error, &device.physical, settings))?;
            let without = drop::without(&plan, &rows::table(&plan), name)?;
            hazards = drop::in_words(&plan, &without);
            // SAFETY: `--drop` asks for frames whose memory is used in any order, and its help says so. The rows without which a driver need
            // not survive cannot be dropped.
            unsafe { Renderer::with_rows(device, &workload.scene, settings, without) }
        }
    };
    let renderer = renderer.map_err(|error| workload.blame(error, &device.physical, settings))?;
    memory::give_back();
    Ok((renderer, hazards))
}

/// Draws the picture as often as asked for, writes the last one and returns the facts to print.
fn draw(
    (args, scene): (&Args, &str),
    mut workload: Workload,
    device: &Arc<Device>,
    view: Option<View>,
    is_verbose: bool,
) -> Result<RenderOutput, Failure> {
    let mut settings = settings(args, &workload, device, view)?;
    let moves = workload.scene.moves();
    if moves && settings.output != Output::Nits && settings.exposure.is_none() {
        settings.exposure = Some(metered_ev100(&workload.scene.at(&workload.playing)));
    }
    let mut text = heading(&workload, &settings, device, &args.output.sink.to_string());
    let start = Instant::now();
    let (mut renderer, hazards) = renderer(args, device, &mut workload, &settings)?;
    workload.warn(renderer.plan())?;
    let bar = progress::bar(
        "drawing".into(),
        u64::from(args.frames) * u64::from(renderer.plan().frames_a_picture()),
        args.quiet,
    );
    let mut times = TextTable::with_figures_from(1);
    times.row(["load".to_owned(), milliseconds(workload.load_ms)]);
    // The camera rests; without the cache maps are drawn as if all did not.
    let moving = if settings.shadows.cache { "nothing moving" } else { "everything moving" };
    let mut pose = Pose::default();
    let mut is_first = true;
    let mut drawn = || {
        bar.step();
        // The driver has compiled its shaders: memory that it freed (lavapipe 40 MiB) goes back before pictures are added up.
        if std::mem::take(&mut is_first) {
            memory::give_back();
        }
    };
    let mut taken = |renderer: &mut Renderer| {
        let show = |renderer: &mut Renderer, seconds| go_to(seconds, renderer, &workload, &mut pose);
        renderer.picture_while(show, &mut drawn)
    };
    let mut picture;
    if renderer.plan().frames_a_picture() == 1 && !moves {
        renderer.render(&workload.scene.camera)?;
        let first = renderer.wait()?;
        bar.step();
        times.row(["first frame, with set-up".to_owned(), milliseconds(milliseconds_since(start))]);
        times.row(["first frame alone".to_owned(), milliseconds(first.wall_ms)]);
        if let Some(mean) = draw_more(args, &workload, &mut renderer, &|| bar.step())? {
            times.row([format!("mean of {}, {moving}", counted(args.frames - 1, "more frame")), milliseconds(mean)]);
        }
        picture = renderer.read_back()?;
    } else {
        picture = taken(&mut renderer)?;
        let what = frames_in_words(renderer.plan());
        times.row([format!("first picture of {what}, with set-up"), milliseconds(milliseconds_since(start))]);
        let start = Instant::now();
        for _ in 1..args.frames {
            picture = taken(&mut renderer)?;
        }
        if args.frames > 1 {
            let mean = milliseconds_since(start) / f64::from(args.frames - 1);
            times.row([
                format!("mean of {} of {what}, {moving}", counted(args.frames - 1, "more picture")),
                milliseconds(mean),
            ]);
        }
    }
    drop(bar);
    if let Some(gpu_ms) = renderer.wait()?.gpu_ms {
        times.row(["last frame on the GPU".to_owned(), milliseconds(gpu_ms)]);
    }
    let complexity = (settings.view == View::Complexity).then(|| Complexity::of(&picture));
    args.give(picture)?;
    if let Some(Complexity { covered, complex }) = complexity {
        let share = 100.0 * Complexity { covered, complex }.share();
        let _ = writeln!(text, "{complex} of {covered} pixels with a surface, {share:.1}%, are shaded once a sample");
    }
    text.push_str(&costs((args, scene), renderer.plan(), &times, device, is_verbose));
    Ok(RenderOutput { text, hazards, files: Vec::new() })
}

/// The settings of the pictures.
fn settings(args: &Args, workload: &Workload, device: &Device, view: Option<View>) -> Result<Settings, Failure> {
    let samples = workload.samples(args.samples.or(args.drop.is_some().then_some(1)), args.view.is_some());
    let variation = SettingsPatch { view, samples: Some(samples), ..SettingsPatch::default() };
    let output = if args.output.format == PictureFormat::Exr { Output::Nits } else { Output::Srgb8 };
    Ok(Settings { output, ..workload.settings(&variation, &device.physical)? })
}

fn frames_in_words(plan: &FramePlan) -> String {
    match plan.frames_a_picture() {
        frames if frames == plan.samples => counted(frames, "sample"),
        frames => counted(frames, "frame"),
    }
}

/// Tells the cost of the frames of a scene in three lines: plan, times and memory; or in a table each.
fn costs(
    (args, scene): (&Args, &str),
    plan: &FramePlan,
    times: &TextTable,
    device: &Device,
    is_verbose: bool,
) -> String {
    let report = device.memory_report();
    if is_verbose {
        let mut memory = memory_table(&report);
        memory.row(["G-buffer, a pixel".to_owned(), format!("{} B", plan.gbuffer_bytes_per_pixel())]);
        let (plan, times, memory) = (plan_table(plan).render(), times.render(), memory.render());
        return format!("\nPlan\n{plan}\nTimes\n{times}\nMemory\n{memory}");
    }
    let parts = [list::parts(plan), plan.parts().to_vec()].concat();
    let included = parts.iter().filter(|part| part.included).count();
    let process = peak_memory_bytes().map_or_else(String::new, |peak| format!("; {} of the process", bytes(peak)));
    format!(
        "times: {}\nmemory, at its peak: {} on the device{process}\nplan: {included} parts of the frame are in, {} are left out: `{}` says why\n",
        times.line(),
        bytes(report.peak_bytes),
        parts.len() - included,
        args.inspecting(scene, plan.samples),
    )
}

/// Draws the frames after the first without waiting for each, as an interactive program would, and returns how long one took
/// on average: the device may still draw one while the next is recorded, so that only all of them together have a time.
fn draw_more(
    args: &Args,
    workload: &Workload,
    renderer: &mut Renderer,
    drawn: &dyn Fn(),
) -> Result<Option<f64>, Failure> {
    let start = Instant::now();
    for _ in 1..args.frames {
        renderer.render(&workload.scene.camera)?;
        drawn();
    }
    renderer.wait()?;
    Ok((args.frames > 1).then(|| milliseconds_since(start) / f64::from(args.frames - 1)))
}

/// Draws every view at half the size and writes them as one picture. A view that this scene lacks has an empty tile.
fn draw_sheet(args: &Args, workload: &Workload, device: &Arc<Device>) -> Result<RenderOutput, Failure> {
    let start = Instant::now();
    let once = SettingsPatch { samples: Some(1), ..SettingsPatch::default() };
    let mut settings = workload.settings(&once, &device.physical)?;
    settings.size = tile_size(settings.size);
    let bar = progress::bar("drawing".into(), View::NAMES.len() as u64, args.quiet);
    let mut tiles = Vec::new();
    for &(name, view) in View::NAMES {
        tiles.push(draw_tile(args, workload, device, name, &of_view(&settings, view))?);
        bar.step();
    }
    drop(bar);
    let sheet = contact_sheet::compose(&tiles, contact_sheet::COLUMNS);
    let size = sheet.size;
    args.output.write(&Picture { size, pixels: Pixels::Srgb8(sheet.rgba) })?;
    let mut text = heading(workload, &settings, device, &args.output.sink.to_string());
    let mut times = TextTable::with_figures_from(1);
    times.row(["load".to_owned(), milliseconds(workload.load_ms)]);
    times.row([format!("{} views", tiles.len()), milliseconds(milliseconds_since(start))]);
    let _ = write!(text, "\nTimes\n{}", times.render());
    Ok(RenderOutput { text, hazards: Vec::new(), files: Vec::new() })
}

/// The settings with another view. Views of values drop multisampling and the effects on the finished picture.
fn of_view(settings: &Settings, view: View) -> Settings {
    let lit = averages_samples(view);
    let msaa = if lit || view == View::Complexity { settings.msaa } else { 1 };
    let base = if lit { settings.clone() } else { settings.without_effects() };
    Settings { view, msaa, ..base }
}

fn draw_tile(
    args: &Args,
    workload: &Workload,
    device: &Arc<Device>,
    name: &str,
    settings: &Settings,
) -> Result<SheetTile, Failure> {
    let label = name.replace('-', " ");
    let none = || SheetTile { label: format!("{label}: none"), size: settings.size, rgba: Vec::new() };
    if settings.view == View::Complexity && settings.msaa == 1 {
        return Ok(none());
    }
    let mut renderer = match Renderer::new(device, &workload.scene, settings) {
        Err(frame::Error::Plan(refused)) if refused.shows_nothing() => return Ok(none()),
        made => made?,
    };
    for _ in 0..args.frames {
        renderer.render(&workload.scene.camera)?;
    }
    let Picture { size, pixels } = renderer.read_back()?;
    let rgba = match pixels {
        Pixels::Srgb8(rgba) => rgba,
        // The settings do not ask for linear pixels.
        Pixels::LinearF32(_) => Vec::new(),
    };
    Ok(SheetTile { label, size, rgba })
}

/// Half the size, and at most 2048 pixels an edge: four of them stand side by side on the sheet.
fn tile_size(size: [u32; 2]) -> [u32; 2] {
    let longest = size[0].max(size[1]);
    let divisor = longest.div_ceil(2048).max(2);
    size.map(|edge| (edge / divisor).max(1))
}

fn heading(workload: &Workload, settings: &Settings, device: &Device, output: &str) -> String {
    let [width, height] = settings.size;
    let samples = match (settings.frames_over_time(), settings.samples) {
        (Some(frames), _) => format!(", {} averaged over time", counted(frames, "frame")),
        (None, 1) => String::new(),
        (None, samples) => format!(", {samples} samples a pixel"),
    };
    let (name, gpu) = (&workload.scene.name, &device.physical.name);
    let (content, place) = (workload.content(), workload.place(settings));
    format!("{name} -> {output}: {width}x{height}{samples}, on {gpu}\n{content}\n{place}\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tiles_are_half_the_size_and_bounded() {
        assert_eq!(tile_size([1280, 720]), [640, 360]);
        assert_eq!(tile_size([1, 1]), [1, 1]);
        assert_eq!(tile_size([32768, 1]), [2048, 1]);
    }
}
