//! `afterlight view`: a window onto a scene.

use std::env;
use std::ffi::OsString;
use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{self, Child, Command, Stdio};

use afterlight::frame::WHITE_NITS;
use afterlight::frame::calibration::Calibration;
use afterlight::frame::rows::Rows;
use afterlight::frame::{self, HazardPicture, Picture, Pixels, plan_for, rows};
use afterlight::gpu::{Instance, PhysicalDevice, Vsync, vk};
use afterlight::plan::FramePlan;
use afterlight::scene::file::{Model, Origin, to_toml};
use afterlight::scene::{Camera, CameraPath, Scene, SettingsPatch, counted};
use afterlight_window::{Error, ReadAgain, ShaderFolder, Summary, WindowOptions, WindowSystem, help};

use super::args::{DeviceArgs, SettingsArgs, whole};
use super::drop;
use super::failure::{Exit, Failure};
use super::image_output::{Destination, PictureFormat};
use super::output::{self, Sink};
use super::session::{self, own_command};
use super::table::{TextTable, milliseconds};
use super::typed::Typed;
use super::workload::{LargestPicture, Workload};

/// `afterlight render assets/icon.toml` drew it. The build script gives the same picture to the program's file on Windows.
const ICON: &[u8] = include_bytes!("../icon.png");

/// The book's chapter about dependencies, in the sources that the program was built from.
const CHAPTER: &str = concat!(env!("AFTERLIGHT_ROOT"), "/book/src/synchronization.md");

/// Open a window onto a scene
#[derive(Debug, clap::Args)]
#[command(after_help = format!("\
Examples:
  afterlight view
  afterlight view sponza.obj --camera \"-9,2,0/0,3,0/70\"
  afterlight view scene.toml --size 1920x1080 --vsync adaptive
  afterlight view builtin:hall --frames 300 --vsync off
  afterlight view builtin:hall --hdr=600
  afterlight view builtin:hall --without geometry-to-lighting --hazard stale

{}", help()))]
pub struct Args {
    /// The scene: a model (.gltf, .glb, .obj), a .toml scene file, or `builtin:NAME?key=value&...`
    #[arg(default_value = "builtin:hall")]
    scene: String,
    /// Wait for the display: on, off (the lowest latency; frames may be torn), or adaptive (late frames do not wait)
    #[arg(long, value_name = "on|off|adaptive", value_parser = vsync, default_value = "on")]
    vsync: Vsync,
    /// Use an HDR swapchain, where the window takes one, for a display of NITS peak: 1000, or --hdr=NITS
    #[arg(long, value_name = "NITS", value_parser = hdr, num_args = 0..=1, require_equals = true, default_missing_value = "1000")]
    hdr: Option<f32>,
    /// Draw coarser pictures while something moves, where whole ones would take longer than a tenth of a second: on, off, or auto (on with a device that is a
    /// CPU, unless --frames measures it)
    #[arg(long, value_name = "auto|on|off", value_enum, default_value = "auto", hide_possible_values = true)]
    dynamic_resolution: DynamicResolution,
    /// Draw this many frames without a pause, then close the window and print how long they took
    #[arg(long, value_name = "N", value_parser = whole::<u32>(1..=1_000_000), allow_negative_numbers = true)]
    frames: Option<u32>,
    /// The folder that screenshots, camera paths and scene files are written to
    #[arg(long, value_name = "FOLDER", default_value = ".")]
    screenshots: PathBuf,
    /// Compile the shaders of this folder, and again when they change. Without it, those that the program was built from, when they change
    #[cfg(feature = "hot-reload")]
    #[arg(long, value_name = "FOLDER")]
    shaders: Option<PathBuf>,
    /// Show messages over the picture as well, for some seconds, and a sign while something is computed: on or off
    #[arg(long, value_name = "on|off", value_parser = on_off, default_value = "on", action = clap::ArgAction::Set)]
    messages: bool,
    /// Switch a dependency off, by its name (`inspect` lists them), on the panel of dependencies (B): may be given several times
    #[arg(long, value_name = "DEPENDENCY")]
    without: Vec<String>,
    /// Draw the hazard of the first --without on purpose: stale, torn or cleared
    #[arg(long, value_name = "stale|torn|cleared", value_parser = hazard, requires = "without")]
    hazard: Option<HazardPicture>,
    /// Print nothing but errors
    #[arg(short, long)]
    quiet: bool,
    #[command(flatten)]
    settings: SettingsArgs,
    #[command(flatten)]
    device: DeviceArgs,
}

/// When the resolution follows the time that frames take.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum DynamicResolution {
    Auto,
    On,
    Off,
}

fn vsync(text: &str) -> Result<Vsync, String> {
    match text {
        "on" => Ok(Vsync::On),
        "off" => Ok(Vsync::Off),
        "adaptive" => Ok(Vsync::Adaptive),
        _ => Err("expected on, off or adaptive".into()),
    }
}

fn hazard(text: &str) -> Result<HazardPicture, String> {
    let found = HazardPicture::NAMES.iter().find(|(name, _)| *name == text);
    found.map(|&(_, how)| how).ok_or_else(|| "expected stale, torn or cleared".into())
}

fn on_off(text: &str) -> Result<bool, String> {
    match text {
        "on" => Ok(true),
        "off" => Ok(false),
        _ => Err("expected on or off".into()),
    }
}

/// From white, as less would be no HDR, to the most that HDR10 can express.
fn hdr(text: &str) -> Result<f32, String> {
    let nits = text.parse::<f32>().ok().filter(|nits| (WHITE_NITS..=10_000.0).contains(nits));
    nits.ok_or_else(|| format!("expected nits from {WHITE_NITS}, which are white, to 10000"))
}

/// Shows the scene until the window is closed.
pub fn run(args: &Args) -> Result<(), Failure> {
    let system = WindowSystem::connect(end_without_display)?;
    session::with_device_for(&args.device, &system.extensions()?, |device| {
        let workload = Workload::open_moving(&args.scene, &args.settings, args.quiet)?;
        let settings = workload.settings(&once(), &device.physical)?;
        if !args.without.is_empty() {
            let plan = plan_for(&device, &workload.scene, &settings).map_err(frame::Error::from)?;
            let table = rows::table(&plan);
            let shown = rows::in_windows(&plan).map(|plan| (rows::table(&plan), plan));
            let has = |(table, plan): &(Rows, FramePlan), name: &str| drop::without(plan, table, name).is_ok();
            let missing = args.without.iter().filter(|name| !shown.iter().any(|own| has(own, name)));
            missing.take(1).try_for_each(|name| drop::without(&plan, &table, name).map(|_| ()))?;
        }
        let options = WindowOptions {
            icon: ICON,
            vsync: args.vsync,
            hdr: args.hdr,
            dynamic_resolution: args.has_dynamic_resolution(&device.physical),
            frames: args.frames,
            playing: workload.playing.clone(),
            rests: args.settings.time.is_some(),
            tell: &|line| {
                if !args.quiet || line.starts_with("warning: ") {
                    // Standard output is for results.
                    let _ = output::print(&format!("{line}\n"), true);
                }
            },
            messages: args.messages,
            keep: &|picture| keep(&args.screenshots, picture),
            keep_path: &|path| keep_path(&args.screenshots, path),
            keep_scene: &|scene, camera, settings| keep_scene(args, scene, camera, settings),
            read_again: Some(read_again(args, LargestPicture::of(&device.physical))),
            without: args.without.clone(),
            hazard: args.hazard,
            chapter: Some(Path::new(CHAPTER).to_owned()).filter(|chapter| chapter.exists()),
            shaders: args.shaders(),
        };
        let _calibrating = Calibrating::begin(args, &device.physical, &device.instance);
        let summary = system.view(&device, workload.scene, settings, options)?;
        match args.quiet || args.frames.is_none() {
            true => Ok(()),
            false => output::print(&table(&summary), false),
        }
    })
}

/// A process that measures the device beside the window, where nobody has before. It ends with the window.
struct Calibrating(Option<Child>);

impl Calibrating {
    /// Begins, unless frames are measured or no figures are kept. A failure is no matter: the next window tries again.
    fn begin(args: &Args, device: &PhysicalDevice, instance: &Instance) -> Self {
        let is_known = Calibration::of(device).is_some();
        if is_known || args.frames.is_some() || env::var_os("AFTERLIGHT_CALIBRATION").is_some_and(|dir| dir.is_empty())
        {
            return Self(None);
        }
        let (Ok(own), Some(number)) = (own_command(), number(device, instance)) else { return Self(None) };
        // The window comes first: the figures are ratios, and so the same on a busy machine.
        let mut words: Vec<OsString> = if cfg!(unix) { vec!["nice".into(), "-n19".into()] } else { Vec::new() };
        words.extend(own);
        let mut command = Command::new(&words[0]);
        command.args(&words[1..]);
        command.args(["doctor", "--calibrate", "--unasked", "--device", &number.to_string()]);
        // It ends when the other end of this pipe is closed, whichever way this process ends.
        command.stdin(Stdio::piped()).stdout(Stdio::null()).stderr(Stdio::null());
        Self(command.spawn().ok())
    }
}

/// As `--device` takes it: other devices may have the same name.
fn number(device: &PhysicalDevice, instance: &Instance) -> Option<usize> {
    instance.physical_devices().ok()?.iter().position(|own| own.raw == device.raw)
}

impl Drop for Calibrating {
    fn drop(&mut self) {
        if let Some(child) = &mut self.0 {
            let _ = child.kill();
            let _ = child.wait();
        }
    }
}

/// A window shows each frame as it is.
fn once() -> SettingsPatch {
    SettingsPatch { samples: Some(1), ..SettingsPatch::default() }
}

/// Reads the scene as the command line names it. Holds nothing of the device, which ends before the program does.
fn read_again(args: &Args, largest: LargestPicture) -> ReadAgain {
    let (scene, settings) = (args.scene.clone(), args.settings.clone());
    Box::new(move || {
        let read = || {
            let workload = Workload::open_moving(&scene, &settings, true)?;
            let settings = workload.settings_within(&once(), &largest)?;
            Ok((workload.scene, settings))
        };
        read().map_err(|failure: Failure| failure.message().to_owned())
    })
}

impl Args {
    fn has_dynamic_resolution(&self, device: &PhysicalDevice) -> bool {
        match self.dynamic_resolution {
            DynamicResolution::On => true,
            DynamicResolution::Off => false,
            DynamicResolution::Auto => device.kind == vk::PhysicalDeviceType::CPU && self.frames.is_none(),
        }
    }

    #[cfg(feature = "hot-reload")]
    fn shaders(&self) -> Option<ShaderFolder> {
        let own = || Path::new(env!("AFTERLIGHT_ROOT")).join("shaders");
        let differs = self.shaders.is_some();
        Some(ShaderFolder { path: self.shaders.clone().unwrap_or_else(own), differs })
    }

    #[cfg(not(feature = "hot-reload"))]
    fn shaders(&self) -> Option<ShaderFolder> {
        None
    }
}

/// Ends the process when the X server is gone: nothing can be drawn, and no call returns to where the error could be handled.
fn end_without_display() -> ! {
    let gone = Error::System("the connection to the X server broke".into());
    let failure = Failure::from(gone);
    let _ = failure.report();
    process::exit(Exit::NoDisplay as i32)
}

/// Writes a screenshot under the first name that is free: a shown picture as PNG, its light as EXR.
fn keep(folder: &Path, picture: &Picture) -> Result<String, String> {
    let (extension, format) = match picture.pixels {
        Pixels::Srgb8(_) => ("png", PictureFormat::Png),
        Pixels::LinearF32(_) => ("exr", PictureFormat::Exr),
    };
    let target = Destination { sink: Sink::File(free(folder, extension)?), format };
    target.write(picture).map_err(|failure| failure.message().to_owned())?;
    Ok(format!("screenshot: {}", target.sink))
}

/// Writes a camera path under the first name that is free.
fn keep_path(folder: &Path, path: &CameraPath) -> Result<String, String> {
    let sink = Sink::File(free(folder, "toml")?);
    sink.write(path.to_toml().as_bytes()).map_err(|failure| failure.message().to_owned())?;
    Ok(format!("path: {sink}, {:.1} s", path.seconds()))
}

/// Writes a scene under the first name that is free. Models are named by their whole paths, as the file may lie elsewhere.
fn keep_scene(args: &Args, scene: &Scene, camera: &Camera, settings: &SettingsPatch) -> Result<String, String> {
    let sink = Sink::File(free(&args.screenshots, "toml")?);
    let path = fs::canonicalize(&args.scene).unwrap_or_else(|_| PathBuf::from(&args.scene));
    let is_model =
        path.extension().is_some_and(|own| ["obj", "gltf", "glb"].iter().any(|known| own.eq_ignore_ascii_case(known)));
    let origin = match args.scene.starts_with("builtin:") {
        true => Origin::Builtin(&args.scene),
        false if is_model => {
            let SettingsArgs { scale, up, scene, variant, .. } = &args.settings;
            let (scale, up) = (scale.unwrap_or(1.0), up.unwrap_or_default());
            Origin::Model(Model { path: &path, scale, up, scene: scene.as_deref(), variant: variant.as_deref() })
        }
        false => Origin::File(&path),
    };
    let text = to_toml(origin, scene, camera, settings);
    sink.write(text.as_bytes()).map_err(|failure| failure.message().to_owned())?;
    let Sink::File(file) = &sink else { return Ok(format!("scene: {sink}")) };
    // The file holds neither the moment of clips nor the leave to read other folders.
    let SettingsArgs { time, clips, allow_outside, .. } = &args.settings;
    let drawing = Typed::new("render").about(file).option_if("time", time.map(|time| time.to_string()));
    let drawing = clips.iter().fold(drawing, |drawing, clip| drawing.option("clip", clip));
    Ok(format!("scene: {sink}; {}", drawing.flag("allow-outside", *allow_outside).on(&args.device)))
}

fn free(folder: &Path, extension: &str) -> Result<PathBuf, String> {
    let mut names = (1..=9999).map(|number| folder.join(format!("afterlight-{number:04}.{extension}")));
    names.find(|path| !path.exists()).ok_or_else(|| format!("{} has 9999 of them", folder.display()))
}

fn table(summary: &Summary) -> String {
    let mut times = TextTable::with_figures_from(1);
    if let Some(ms) = summary.interval_ms {
        times.row(["from frame to frame, median".to_owned(), milliseconds(ms)]);
    }
    if let Some(ms) = summary.resize_ms {
        times.row([format!("{}, median", counted(summary.resizes, "resize")), milliseconds(ms)]);
    }
    let mut text = format!("{} shown\n", counted(summary.frames, "frame"));
    let _ = write!(text, "{}", times.render());
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_icon_file_tells_the_width_of_its_picture_as_0() {
        let picture = image::load_from_memory(ICON).expect("a picture");
        assert_eq!((picture.width(), picture.height()), (256, 256), "build.rs writes 0, which stands for 256");
    }
}
