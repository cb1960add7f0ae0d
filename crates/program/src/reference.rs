//! `afterlight reference`: a scene as it truly is, by rays in 64 bits on the CPU. No Vulkan.

mod mitsuba;

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::time::Instant;

use afterlight::frame::{Picture, Pixels};
use afterlight::scene::{SETTINGS, Setting, Settings, SettingsPatch, counted, ev100_of, exposure_scale};
use afterlight_truth::reference::shutter::{self, ShutterOptions, ShutterScene};
use afterlight_truth::reference::{
    Cache, Cached, CameraView, Mode, Reference, Smith, Truth, TruthOptions, TruthOrigin,
};
use clap::ValueEnum;

use super::args::{SettingsArgs, samples};
use super::failure::{Exit, Failure};
use super::image_output::{Destination, PictureFormat};
use super::output::Sink;
use super::table::{TextTable, milliseconds};
use super::workload::{Workload, milliseconds_since, warnings};
use super::{output, progress};

/// Samples of each pixel where nothing else is said.
const DEFAULT_SAMPLES: u32 = 16;

/// Compute the truth of a scene on the CPU, in 64 bits: what pictures of it are measured against
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  afterlight reference builtin:hall -o truth.exr --samples 64
  afterlight reference sponza.obj -o truth.exr --point --size 640x360
  afterlight reference scene.toml -o truth.png --camera \"0,2,8/0,1,0\"
  afterlight reference builtin:spheres -o truth.exr --smith separable --no-cache
  afterlight reference scene.toml -o truth.exr --standard-error error.exr
  afterlight reference scene.toml --export mitsuba")]
pub struct Args {
    /// The scene: a model (.gltf, .glb, .obj), a .toml scene file, or `builtin:NAME?key=value&...`
    scene: String,
    /// The picture: .exr for linear light in nits, or .png, exposed and tone-mapped; - is standard output (PNG)
    #[arg(short, long, value_name = "FILE", default_value = "truth.exr", value_parser = Destination::parse)]
    output: Destination,
    /// Samples of each pixel that are averaged, 1 to 4096; a later run with more goes on from here [default: 16]
    #[arg(long, value_name = "N", value_parser = samples, allow_hyphen_values = true, conflicts_with = "point")]
    samples: Option<u32>,
    /// One sample through the middle of each pixel in place of a mean: what is measured against it is numeric error and filtered textures
    #[arg(long)]
    point: bool,
    /// Masking and shadowing of the specular lobe: the renderer's own, or that of other renderers, to compare with them
    #[arg(long, value_enum, value_name = "NAME", default_value_t = SmithChoice::HeightCorrelated)]
    smith: SmithChoice,
    /// Neither read what earlier runs have computed nor keep what this one does
    #[arg(long)]
    no_cache: bool,
    /// Write the standard error of each pixel's mean, in nits, as an .exr: that of independent samples, which bounds the truth's
    #[arg(long, value_name = "FILE", value_parser = Destination::parse, conflicts_with = "point")]
    standard_error: Option<Destination>,
    /// Compute nothing; write the scene into this folder as Mitsuba 3 reads it, to ask another renderer. What both do not have by
    /// the same formulas is refused
    #[arg(long, value_name = "DIR", conflicts_with_all = ["output", "standard_error", "point", "samples", "smith", "no_cache"])]
    export: Option<PathBuf>,
    /// Print nothing but errors
    #[arg(short, long)]
    quiet: bool,
    #[command(flatten)]
    settings: SettingsArgs,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum SmithChoice {
    HeightCorrelated,
    Separable,
}

/// The most pixels of a truth: 3 GiB of sums.
const MOST_PIXELS: u64 = 1 << 26;

/// Computes and writes the truth.
pub fn run(args: &Args) -> Result<(), Failure> {
    if args.output.format == PictureFormat::Exr {
        args.settings.refuse_shown()?;
    }
    refuse_approximations(&args.settings)?;
    if let Some(folder) = &args.export {
        return export(args, folder);
    }
    if args.standard_error.as_ref().is_some_and(|target| target.format != PictureFormat::Exr || target.sink.is_stdout())
    {
        return Err(Failure::usage("--standard-error is of light in nits: it is an .exr file"));
    }
    if args.standard_error.as_ref().is_some_and(|target| target.sink.is_same(&args.output.sink)) {
        return Err(Failure::usage("-o and --standard-error name the same file"));
    }
    if args.standard_error.is_some() && args.samples == Some(1) {
        return Err(Failure::usage("one sample has no --standard-error: it needs two --samples"));
    }
    args.output.sink.check()?;
    args.standard_error.iter().try_for_each(|target| target.sink.check())?;
    let workload = open(args)?;
    let settings = workload.decided(&SettingsPatch::default());
    // The scene at the moment at which the shutter opens.
    let scene = workload.scene.at(&workload.playing);
    let view = CameraView { camera: scene.camera, size: settings.size };
    if u64::from(view.size[0]) * u64::from(view.size[1]) > MOST_PIXELS {
        let [width, height] = view.size;
        return Err(Failure::usage(format!("the size {width}x{height} is too large: a truth has at most 2^26 pixels")));
    }
    let mode = match args.point {
        true => Mode::Point,
        false => Mode::Converged { samples: args.samples.unwrap_or(DEFAULT_SAMPLES) },
    };
    let smith = match args.smith {
        SmithChoice::HeightCorrelated => Smith::HeightCorrelated,
        SmithChoice::Separable => Smith::Separable,
    };
    let start = Instant::now();
    let moving = (workload.scene.moves() && !args.point).then(|| ShutterScene {
        scene: &workload.scene,
        playing: workload.playing.clone(),
        path: None,
        seconds: f64::from(settings.shutter),
    });
    let reference = Reference::new(&scene)?.with_settings(&settings, &view.camera);
    let built_ms = milliseconds_since(start);
    let start = Instant::now();
    let cached = match moving {
        Some(shot) => {
            let exposure = ShutterOptions { size: view.size, samples: samples_of(mode) as u32, smith };
            expose(args, &shot, &exposure, &settings)?
        }
        None => compute(args, &reference, &view, &TruthOptions { mode, smith }),
    };
    let cached = Cached { truth: cached.truth.with_spread_light(&settings), ..cached };
    let computed_ms = milliseconds_since(start);
    if !args.quiet {
        output::print(&warnings(&cached.warnings), true)?;
    }
    args.output.write(&picture(args, &cached.truth, &workload, &settings))?;
    if let (Some(target), Some(error)) = (&args.standard_error, &cached.truth.standard_error) {
        target.write(&Picture { size: cached.truth.size, pixels: linear(error) })?;
    }
    let times = [("load", workload.load_ms), ("tree of boxes", built_ms), ("picture", computed_ms)];
    let report = report(args, &workload, &cached, mode, &times);
    if args.quiet { Ok(()) } else { output::print(&report, args.output.sink.is_stdout()) }
}

/// Refuses settings that only say how a frame approximates the truth, or how it is made.
fn refuse_approximations(args: &SettingsArgs) -> Result<(), Failure> {
    let given = SETTINGS.iter().find(|setting| !setting.of_truth && setting.text(&args.said).is_some());
    let Some(Setting { key, .. }) = given else { return Ok(()) };
    let why = format!("--{key} says how a frame is drawn: the truth is computed without it");
    let is_of_light = |row: &&Setting| row.of_truth && !["exposure", "tonemap"].contains(&row.key);
    let keys: String = SETTINGS.iter().filter(is_of_light).map(|row| format!("--{}, ", row.key)).collect();
    let what = format!("{keys}and --camera apply, and --exposure and --tonemap to a .png");
    Err(Failure::usage(why).with_hint(what))
}

fn samples_of(mode: Mode) -> u64 {
    match mode {
        Mode::Point => 1,
        Mode::Converged { samples } => u64::from(samples),
    }
}

/// Renders the picture of an open shutter. No cache keeps it.
fn expose(args: &Args, shot: &ShutterScene, exposure: &ShutterOptions, settings: &Settings) -> Result<Cached, Failure> {
    let pixels = u64::from(exposure.size[0]) * u64::from(exposure.size[1]);
    let bar = progress::shares(format!("{}: samples", args.scene), pixels * u64::from(exposure.samples), args.quiet);
    Ok(Cached::computed(shutter::render(shot, exposure, settings, &|done, _| bar.at(done))?))
}

fn compute(args: &Args, reference: &Reference, view: &CameraView, options: &TruthOptions) -> Cached {
    let pixels = u64::from(view.size[0]) * u64::from(view.size[1]);
    let bar = progress::shares(format!("{}: samples", args.scene), pixels * samples_of(options.mode), args.quiet);
    let cache = Cache::of_user().filter(|_| !args.no_cache);
    Cached::render(cache.as_ref(), reference, view, options, &|done, _| bar.at(done))
}

fn picture(args: &Args, truth: &Truth, workload: &Workload, settings: &Settings) -> Picture {
    let pixels = match args.output.format {
        PictureFormat::Exr => linear(&truth.radiance),
        PictureFormat::Png | PictureFormat::Video => {
            let exposure = f64::from(exposure_scale(ev100_of(&workload.scene, settings)));
            let codes = truth.shown(exposure, settings);
            Pixels::Srgb8(codes.into_iter().flat_map(|[r, g, b]| [r, g, b, 255]).collect())
        }
    };
    Picture { size: truth.size, pixels }
}

fn linear(light: &[[f64; 3]]) -> Pixels {
    Pixels::LinearF32(light.iter().flat_map(|&[r, g, b]| [r as f32, g as f32, b as f32, 1.0]).collect())
}

/// Opens the scene and checks it: an export has no plan and no renderer that would.
fn open(args: &Args) -> Result<Workload, Failure> {
    let workload = Workload::open_for_shutter(&args.scene, &args.settings, args.quiet)?;
    workload
        .spare([Some(&args.output), args.standard_error.as_ref()].into_iter().flatten().map(|target| &target.sink))?;
    workload.scene.check()?;
    Ok(workload)
}

/// Writes the scene for Mitsuba 3 into a folder, and makes the folder if it is missing.
fn export(args: &Args, folder: &Path) -> Result<(), Failure> {
    let workload = open(args)?;
    let settings = workload.decided(&SettingsPatch::default());
    let refused = |why: String| Failure::new(Exit::BadInput, format!("cannot export {}: {why}", args.scene));
    if !settings.shadows.enabled {
        return Err(refused("light without shadows cannot be expressed".into()));
    }
    if workload.scene.moves() || !settings.aperture.is_pinhole() {
        return Err(refused("neither a lens nor an open shutter is expressed".into()));
    }
    let (scene, camera) = (&workload.scene, workload.scene.camera);
    let shot = mitsuba::MitsubaScene { scene, camera, size: settings.size, brdf: settings.brdf };
    let export = mitsuba::export(&shot).map_err(refused)?;
    output::make_folder(folder)?;
    for (name, text) in
        export.meshes.iter().map(|(name, text)| (name.as_str(), text)).chain([("scene.xml", &export.scene)])
    {
        Sink::File(folder.join(name)).write(text.as_bytes())?;
    }
    let told =
        format!("{} -> {}: {}\n", scene.name, folder.join("scene.xml").display(), counted(export.meshes.len(), "mesh"));
    if args.quiet { Ok(()) } else { output::print(&told, false) }
}

fn report(args: &Args, workload: &Workload, cached: &Cached, mode: Mode, times: &[(&str, f64)]) -> String {
    let (scene, truth) = (&workload.scene, &cached.truth);
    let [width, height] = truth.size;
    let mut table = TextTable::with_figures_from(1);
    table.row([
        "samples a pixel".to_owned(),
        match mode {
            Mode::Point => "1, in the middle".to_owned(),
            Mode::Converged { samples } => samples.to_string(),
        },
    ]);
    table.row([
        "from the cache".to_owned(),
        match cached.source {
            TruthOrigin::Computed => "nothing".to_owned(),
            TruthOrigin::Continued(samples) => format!("the first {}", counted(samples, "sample")),
            TruthOrigin::Read => "all".to_owned(),
        },
    ]);
    if let Some(triangles) = &truth.triangles {
        let sky = triangles.iter().filter(|triangle| triangle.is_none()).count() as f64 / triangles.len() as f64;
        table.row(["background".to_owned(), format!("{:.1} %", 100.0 * sky)]);
    }
    let mean = |values: &[[f64; 3]]| values.iter().flatten().sum::<f64>() / (3 * values.len().max(1)) as f64;
    let nits = mean(&truth.radiance);
    table.row(["mean".to_owned(), format!("{nits:.4} nits")]);
    if let Some(errors) = &truth.standard_error {
        let error = mean(errors);
        let share = if nits > 0.0 { 100.0 * error / nits } else { 0.0 };
        table.row(["mean standard error, at most".to_owned(), format!("{error:.4} nits, {share:.2} %")]);
    }
    for (name, time) in times {
        table.row([(*name).to_owned(), milliseconds(*time)]);
    }
    let mut text = format!(
        "{} -> {}: {width}x{height} on {}\n",
        scene.name,
        args.output.sink,
        counted(rayon::current_num_threads(), "thread")
    );
    let (objects, triangles) =
        (counted(scene.model_objects().count(), "object"), counted(scene.triangle_count(), "triangle"));
    let _ = write!(text, "{objects}, {triangles}, {}\n\n{}", counted(scene.lights.len(), "light"), table.render());
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_does_not_apply_is_refused_by_name() {
        let refused = |settings: SettingsArgs| refuse_approximations(&settings).err().map(|f| f.message().to_owned());
        let given = |text: &str| SettingsArgs { said: text.parse().expect("settings"), ..Default::default() };
        assert_eq!(refused(given("size=9x9 shadows=off")), None);
        let msaa = refused(given("msaa=4"));
        assert!(msaa.is_some_and(|message| message.starts_with("--msaa ")));
    }
}
