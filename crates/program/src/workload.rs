//! A scene with the command line's settings of it: `render`, `bench` and `inspect` begin with one.

use std::cell::RefCell;
use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::time::Instant;

use afterlight::frame::{self, capabilities, list};
use afterlight::gpu::{MemoryReport, PhysicalDevice};
use afterlight::plan::FramePlan;
use afterlight::scene::file::{load_path, load_settings, said_where};
use afterlight::scene::{
    self, Camera, CameraPath, Motion, OpenOptions, Playing, SETTINGS, Scene, Settings, SettingsPatch, View, counted,
    decimal,
};

use glam::DVec3;

use super::args::{CameraChoice, FITTED, SettingsArgs};
use super::failure::{Exit, Failure};
use super::output::{self, Sink};
use super::table::{TextTable, bytes};
use super::{memory, progress};

/// Frames that make a picture where nothing else is said: edges look smooth from here on.
const DEFAULT_SAMPLES: u32 = 8;
/// Warnings of a scene that are printed; the others are counted.
const PRINTED_WARNINGS: usize = 20;

/// The largest picture that a device draws.
#[derive(Debug, Clone)]
pub struct LargestPicture {
    /// The device's name.
    device: String,
    /// The longest edge of a picture, in pixels.
    edge: u32,
}

impl LargestPicture {
    pub fn of(device: &PhysicalDevice) -> Self {
        Self { device: device.name.clone(), edge: capabilities(device).max_extent }
    }
}

/// A loaded scene, with the camera that the command line gave it.
pub struct Workload {
    pub scene: Scene,
    /// The scene's motion, also if `scene` is the scene at one moment.
    pub motion: Motion,
    /// The moment and the clips that the command line asks for.
    pub playing: Playing,
    /// Time from the first byte read to a scene in memory.
    pub load_ms: f64,
    command_line: SettingsPatch,
    /// The settings of the file of `--settings`.
    pub settings_file: SettingsPatch,
    settings_path: Option<PathBuf>,
    /// As the command line has it.
    camera: Option<String>,
    quiet: bool,
    /// Warnings of plans that were printed: another plan of the scene may have the same.
    told: RefCell<BTreeSet<String>>,
}

impl Workload {
    /// Loads the scene as it is at the moment that the command line asks for, in which nothing moves, and prints its warnings.
    pub fn open(spec: &str, args: &SettingsArgs, quiet: bool) -> Result<Self, Failure> {
        Self::open_unless(spec, args, quiet, |_| false)
    }

    /// Loads the scene as it is at one moment, or with all that moves in it if `moves` returns true.
    fn open_unless(
        spec: &str,
        args: &SettingsArgs,
        quiet: bool,
        moves: impl Fn(&Settings) -> bool,
    ) -> Result<Self, Failure> {
        let mut workload = Self::open_moving(spec, args, quiet)?;
        if workload.scene.moves() {
            // Plan and renderer may get a still scene, and would not see a fault of its clips.
            workload.scene.check()?;
            if !moves(&workload.patch().decide()) {
                workload.scene = workload.scene.into_still(&workload.playing);
            }
        }
        Ok(workload)
    }

    /// Loads the scene as [`Workload::open`] does, but with all that moves in it where the shutter is open for some time.
    pub fn open_for_shutter(spec: &str, args: &SettingsArgs, quiet: bool) -> Result<Self, Failure> {
        Self::open_unless(spec, args, quiet, |settings| settings.shutter != 0.0)
    }

    /// Loads the scene as [`Workload::open_for_shutter`] does, and with everything that moves also for TAA and for views that show the frame before.
    pub fn open_for_frames(spec: &str, args: &SettingsArgs, view: Option<View>, quiet: bool) -> Result<Self, Failure> {
        Self::open_unless(spec, args, quiet, |settings| {
            settings.shutter != 0.0 || settings.follows_time(view.unwrap_or(settings.view))
        })
    }

    /// Refuses an open shutter where a command looks at one moment.
    pub fn refuse_shutter(&self, what: &str) -> Result<(), Failure> {
        match self.patch().decide().shutter {
            0.0 => Ok(()),
            seconds => Err(Failure::usage(format!("a shutter of {seconds} s: {what} is of one moment"))
                .with_hint("render and reference have a shutter")),
        }
    }

    /// Loads the scene with all that moves in it, and prints its warnings.
    pub fn open_moving(spec: &str, args: &SettingsArgs, quiet: bool) -> Result<Self, Failure> {
        let settings_file = args.file.as_deref().map(load_settings).transpose()?.unwrap_or_default();
        let command_line = args.said.clone();
        let progress = progress::loading(spec, quiet);
        let start = Instant::now();
        let tell = |step| progress.tell(step);
        let (scale, up) = (args.scale.unwrap_or(1.0), args.up.unwrap_or_default());
        let (scene, variant) = (args.scene.as_deref(), args.variant.as_deref());
        let allow_outside = args.allow_outside;
        let aspect = OpenOptions::default().aspect;
        let light = args.light.as_ref();
        let mut options =
            OpenOptions { progress: Some(&tell), aspect, scale, up, scene, variant, light, allow_outside };
        if let Some([width, height]) = command_line.or(&settings_file).size {
            options.aspect = f64::from(width) / f64::from(height);
        }
        let mut scene = scene::open(spec, &options)?;
        args.sky.put(&mut scene)?;
        // The bytes of files that images were decoded from.
        memory::give_back();
        let (load_ms, aspect) = (milliseconds_since(start), options.aspect);
        drop(progress);
        if !quiet {
            output::print(&warnings(&scene.warnings), true)?;
        }
        if let Some(choice) = &args.camera {
            look(&mut scene, choice, aspect)?;
        }
        let motion = scene.motion.clone();
        let clips = motion.choose(&args.clips).map_err(|error| Failure::usage(error.to_string()))?;
        let playing = Playing { time: args.time.unwrap_or_default(), clips, looped: true };
        let (settings_path, camera) = (args.file.clone(), args.camera_text());
        let told = RefCell::default();
        Ok(Self { scene, motion, playing, load_ms, command_line, settings_file, settings_path, camera, quiet, told })
    }

    /// Opens a camera path for the scene, and moves the scene's camera to its start.
    pub fn follow(&mut self, file: &Path) -> Result<CameraPath, Failure> {
        let path = load_path(file, &self.scene.camera)?;
        self.scene.camera = path.at(0.0);
        self.scene.looks_through = None;
        Ok(path)
    }

    /// Prints the plan's warnings, each once: parts that were asked for and that it lacks.
    pub fn warn(&self, plan: &FramePlan) -> Result<(), Failure> {
        let new = |warning: &&String| self.told.borrow_mut().insert((*warning).clone());
        let new: Vec<String> = plan.warnings().iter().filter(new).cloned().collect();
        if self.quiet { Ok(()) } else { output::print(&warnings(&new), true) }
    }

    /// Keeps outputs from replacing the scene's files and the file of `--settings`.
    pub fn spare<'a>(&'a self, sinks: impl IntoIterator<Item = &'a Sink>) -> Result<(), Failure> {
        output::spare(sinks, self.scene.files.iter().chain(&self.settings_path))
    }

    /// Describes the camera and the exposure, each with its origin.
    pub fn place(&self, settings: &Settings) -> String {
        let (camera, fitted) = (&self.scene.camera, self.scene.fitted);
        let of_camera = match (&self.camera, fitted.camera) {
            (_, true) => "fitted to the model",
            (Some(_), false) => "as given",
            (None, false) => "the scene's",
        };
        // A word does not say where it stands.
        let typed = self.camera.clone().filter(|text| text != FITTED);
        let camera_text = typed.unwrap_or_else(|| camera.to_string());
        let roll = if camera.is_level() { "" } else { ", and it leans sideways, which --camera cannot say" };
        let of_exposure = match (settings.exposure, self.said().exposure, fitted.exposure) {
            (None, ..) => "metered from the lights",
            (_, Some(_), _) => "as given",
            (_, None, true) => "fitted to the model",
            (_, None, false) => "the scene's",
        };
        let exposure = scene::ev100_of(&self.scene, settings);
        format!("camera {camera_text} ({of_camera}{roll}); exposure {exposure:.2} EV100 ({of_exposure})")
    }

    /// Describes the scene's contents and size.
    pub fn content(&self) -> String {
        let (scene, bounds) = (&self.scene, self.scene.model_bounds());
        let mut text = counts(scene);
        if !bounds.is_empty() {
            let (min, max, size) = (bounds.min, bounds.max, bounds.size());
            // As many decimals as give the longest side four digits.
            let decimals = (3.0 - size.max_element().log10().floor()).clamp(0.0, 12.0) as usize;
            let numbers = |point: DVec3, between| point.to_array().map(|own| decimal(own, decimals)).join(between);
            let (size, min, max) = (numbers(size, " x "), numbers(min, ","), numbers(max, ","));
            let _ = write!(text, "; {size} m, from {min} to {max}");
        }
        if let count @ 1.. = self.motion.clips.len() {
            let playing = self.motion.playing(&self.playing.clips).count();
            let _ = write!(text, "; {playing} of {} at {} s", counted(count, "clip"), decimal(self.playing.time, 3));
        }
        text
    }

    /// Returns the settings that this command was given: the command line over `--settings`.
    pub fn said(&self) -> SettingsPatch {
        self.command_line.or(&self.settings_file)
    }

    /// Returns all given settings: this command's over the scene's.
    pub fn patch(&self) -> SettingsPatch {
        self.said().or(&self.scene.settings)
    }

    /// Returns `variation` over all given settings over the defaults, without regard to a device.
    pub fn decided(&self, variation: &SettingsPatch) -> Settings {
        variation.or(&self.patch()).decide()
    }

    /// Returns the failure of a frame with these settings. If settings of scene files are the reason, it names the line of each without which a
    /// frame could be drawn.
    pub fn blame(&self, error: impl Into<frame::Error>, device: &PhysicalDevice, settings: &Settings) -> Failure {
        let error = error.into();
        if !matches!(error, frame::Error::Plan(_)) {
            return error.into();
        }
        let (device, said) = (capabilities(device), self.said());
        let is_to_blame = |key: &str| {
            let Some(setting) = SETTINGS.iter().find(|setting| setting.key == key) else { return false };
            let mut without = settings.patch();
            let is_left_out = setting.text(&said).is_none() && setting.set(&mut without, None).is_ok();
            let without = Settings { output: settings.output, ..without.decide() };
            is_left_out && FramePlan::of(&self.scene, &without, &device).is_ok()
        };
        let all = said_where(&self.scene.files).into_iter().filter(|(key, _)| is_to_blame(key));
        let lines: Vec<_> = all.map(|(key, place)| format!("{key} at {place}")).collect();
        let failure = Failure::from(error);
        if lines.is_empty() { failure } else { failure.with_place(&lines.join(", ")) }
    }

    /// Returns the samples of a picture; `asked` is the number on the command line.
    ///
    /// The first of command line, `--settings` and scene file that sets any anti-aliasing decides. A view, another kind of anti-aliasing, or an
    /// effect on the finished picture replaces the samples of later sources.
    pub fn samples(&self, asked: Option<u32>, is_view: bool) -> u32 {
        let command_line = SettingsPatch { samples: asked, ..self.command_line.clone() };
        let chosen = |patch: &SettingsPatch, is_view: bool| {
            let settings = patch.decide();
            let other = is_view
                || patch.msaa.is_some_and(|msaa| msaa > 1)
                || settings.frames_over_time().is_some()
                || settings.without_effects() != settings;
            patch.samples.or(other.then_some(1))
        };
        let of_file = |patch: &SettingsPatch| chosen(patch, patch.view.is_some());
        chosen(&command_line, is_view)
            .or_else(|| of_file(&self.settings_file))
            .or_else(|| of_file(&self.scene.settings))
            .unwrap_or(DEFAULT_SAMPLES)
    }

    /// The settings of one picture, as [`Workload::decided`].
    pub fn settings(&self, variation: &SettingsPatch, device: &PhysicalDevice) -> Result<Settings, Failure> {
        self.settings_within(variation, &LargestPicture::of(device))
    }

    /// As [`Workload::settings`], if only the device's largest picture is known.
    pub fn settings_within(&self, variation: &SettingsPatch, largest: &LargestPicture) -> Result<Settings, Failure> {
        let said = variation.or(&self.command_line);
        let settings = self.decided(variation);
        let LargestPicture { device, edge } = largest;
        let [width, height] = settings.size;
        if width.max(height) > *edge {
            let exit = if said.size.is_some() { Exit::Usage } else { Exit::BadInput };
            let most = format!("{device} draws at most {edge}x{edge}");
            return Err(Failure::new(exit, format!("the size {width}x{height} is too large: {most}")));
        }
        Ok(settings)
    }
}

/// Looks at a scene as the command line asks.
fn look(scene: &mut Scene, choice: &CameraChoice, aspect: f64) -> Result<(), Failure> {
    (scene.fitted.camera, scene.looks_through) = (false, None);
    match choice {
        // The near plane suits the scene's extent, of which the command line says nothing.
        CameraChoice::Pose(camera) => scene.camera = Camera { near: scene.camera.near, ..*camera },
        CameraChoice::Fitted => {
            scene::fit_camera(scene, aspect);
        }
        CameraChoice::Named(name) => {
            let names: Vec<&str> = scene.cameras.iter().map(|own| own.name.as_str()).collect();
            let Some(own) = scene.cameras.iter().position(|own| own.name == *name) else {
                let why = match names.is_empty() {
                    true => format!(
                        "--camera {name:?}: the scene has no cameras with names, and a place is written as in \"0,1.7,8/0,1,0\""
                    ),
                    false => format!("--camera: {}", scene::unknown("camera", name, &[&names[..], &[FITTED]].concat())),
                };
                return Err(Failure::new(Exit::Usage, why));
            };
            (scene.camera, scene.looks_through) = (scene.cameras[own].camera, Some(own));
        }
    }
    Ok(())
}

pub fn milliseconds_since(start: Instant) -> f64 {
    start.elapsed().as_secs_f64() * 1e3
}

/// A line for each of the first of them, and one that counts the others.
pub fn warnings(warnings: &[String]) -> String {
    let mut text = String::new();
    for warning in warnings.iter().take(PRINTED_WARNINGS) {
        let _ = writeln!(text, "warning: {warning}");
    }
    if let Some(more) = warnings.len().checked_sub(PRINTED_WARNINGS).filter(|&more| more > 0) {
        let _ = writeln!(text, "warning: and {more} more like these");
    }
    text
}

/// The parts of a plan, included parts first.
pub fn plan_table(plan: &FramePlan) -> TextTable {
    let mut parts = [list::parts(plan), plan.parts().to_vec()].concat();
    parts.sort_by_key(|part| !part.included);
    let mut table = TextTable::new();
    for part in parts {
        let state = if part.included { "in" } else { "out" };
        let size = if part.bytes > 0 { bytes(part.bytes) } else { String::new() };
        table.row([state.to_owned(), part.name, size, part.reason]);
    }
    table
}

/// Device memory by kind, with the sum and this process's own peak.
pub fn memory_table(memory: &MemoryReport) -> TextTable {
    let mut table = TextTable::with_figures_from(1);
    for (kind, report) in &memory.kinds {
        table.row([kind.to_string(), bytes(report.bytes)]);
    }
    table.row(["all on the device".to_owned(), bytes(memory.bytes)]);
    table.row(["peak on the device".to_owned(), bytes(memory.peak_bytes)]);
    if let Some(peak) = afterlight_truth::measure::peak_memory_bytes() {
        table.row(["peak of the process".to_owned(), bytes(peak)]);
    }
    table
}

/// Counts objects, triangles, materials, textures and lights.
pub fn counts(scene: &Scene) -> String {
    let counts = [
        (scene.model_objects().count(), "object"),
        (scene.triangle_count(), "triangle"),
        (scene.materials.len() - usize::from(scene.fitted.ground.is_some()), "material"),
        (scene.textures.len(), "texture"),
        (scene.lights.len(), "light"),
    ];
    counts.map(|(count, what)| counted(count, what)).join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn many_warnings_are_counted_and_not_all_printed() {
        let text = warnings(&vec!["odd".to_owned(); PRINTED_WARNINGS + 3]);
        assert_eq!(text.lines().count(), PRINTED_WARNINGS + 1);
        assert!(text.ends_with("and 3 more like these\n"), "{text}");
        assert_eq!(warnings(&["odd".to_owned()]), "warning: odd\n");
    }
}
