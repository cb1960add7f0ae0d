//! Options that several commands share, and how their values are read.

use std::ffi::OsString;
use std::fmt::Display;
use std::ops::RangeInclusive;
use std::path::PathBuf;
use std::str::FromStr;

use afterlight::gpu::{DeviceChoice, Validation};
use afterlight::scene::{Camera, LightChoice, SETTINGS, Setting, SettingsPatch, Up, ValueKind, View, unknown};
use afterlight_truth::measure::Shard;
use clap::parser::ValueSource;
use clap::{Arg, ArgAction, ArgGroup, ArgMatches, Args, Command, FromArgMatches, value_parser};

mod sky;

use super::failure::Failure;
use sky::SkyArgs;

/// The device that draws, and the checks of its use.
#[derive(Debug, Clone, Args)]
#[command(next_help_heading = "Device")]
pub struct DeviceArgs {
    /// The device: its number in `afterlight doctor`, or a part of its name [default: a real GPU before a CPU]
    #[arg(long, value_name = "N|NAME", value_parser = device, allow_hyphen_values = true)]
    pub device: Option<DeviceChoice>,
    /// Turn on the validation layer: core checks and synchronization (sync, the default), checks on the GPU of what shaders access
    /// (gpu-assisted), or core checks and advice (best-practices). Any message but advice ends the command with exit code 1
    // With an equals sign, so that a scene that follows is not taken for the value.
    #[arg(
        long,
        value_name = "CHECKS",
        value_parser = checks,
        num_args = 0..=1,
        require_equals = true,
        default_missing_value = "sync"
    )]
    pub validate: Option<Validation>,
}

/// The checks that `--validate` can ask for, by their names.
const CHECKS: [(&str, Validation); 3] = [
    ("sync", Validation::Synchronization),
    ("gpu-assisted", Validation::GpuAssisted),
    ("best-practices", Validation::BestPractices),
];

fn checks(text: &str) -> Result<Validation, String> {
    let found = CHECKS.iter().find(|(name, _)| *name == text);
    found.map(|&(_, checks)| checks).ok_or_else(|| unknown("checks", text, &CHECKS.map(|(name, _)| name)))
}

/// The settings of the command line: an option for each row of [`SETTINGS`]. They win over the scene file.
#[derive(Debug, Clone, Default)]
pub struct SettingsArgs {
    /// A settings file, over which the other options win.
    pub file: Option<PathBuf>,
    pub camera: Option<CameraChoice>,
    /// Metres that a unit of a bare model is; `up` is its axis that points up.
    pub scale: Option<f64>,
    pub up: Option<Up>,
    /// Seconds since clips began.
    pub time: Option<f64>,
    /// Names of the clips that play; none for all.
    pub clips: Vec<String>,
    /// The scene and the look of a bare glTF file.
    pub scene: Option<String>,
    pub variant: Option<String>,
    /// The light of a bare model.
    pub light: Option<LightChoice>,
    pub sky: SkyArgs,
    /// True if glTF files may read files outside their folders.
    pub allow_outside: bool,
    pub said: SettingsPatch,
    /// All options that were given, by their names and in the order of the help, with their values as they were written.
    pub written: Vec<(String, Option<OsString>)>,
}

const FILE_HELP: &str = "Take settings from a TOML file with a table [settings] as in a scene file, as `afterlight tune` writes it; \
                         they win over the scene file, other options over them";
const CAMERA_HELP: &str = "Place the camera: where it stands, what it looks at, in metres, and its vertical field of view in degrees, or the height \
                           that an orthographic one shows, in metres: `x,y,z/tx,ty,tz[/fov]` or `x,y,z/tx,ty,tz/<height>m`; or the name of a \
                           camera of the file, or `fitted` for one that has all of the model in view [default: the scene's, of a bare \
                           model the first of its file, or fitted]";

const SCALE_HELP: &str =
    "Scale a bare model by this many metres a unit: .obj has no units, glTF has metres [a number above 0; default: 1]";
const UP_HELP: &str = "Axis of a bare model's file that points up [y or z; default: y]";

const TIME_HELP: &str =
    "Seconds since the clips of a moving scene began; each begins again when it is over [0 to 1e9; default: 0]";
const CLIP_HELP: &str = "Play this clip of the scene alone, by its name or its number in `afterlight inspect`; given several times, these clips; \
                         all of them; none: everything at rest [default: all, but of clips that move the same thing the first]";
const SCENE_HELP: &str =
    "Open this scene of a bare glTF file, by its name or its number [default: the one that the file opens with]";
const VARIANT_HELP: &str =
    "Give the materials of a bare glTF file this look, by its name (KHR_materials_variants) [default: none]";
const LIGHT_HELP: &str = "Light a bare model by a studio, by the sun, by the lights of its file, or by both the file's and the studio's; or by a picture of \
                          surroundings (.hdr, .exr) alone [studio, sun, file, both or FILE; default: file where it has lights, else studio, or sun \
                          where the model is seen from inside]";
const OUTSIDE_HELP: &str = "Let glTF files read buffers and images that lie outside their folders";

/// The camera that `--camera` asks for.
#[derive(Debug, Clone, PartialEq)]
pub enum CameraChoice {
    /// Described whole, but for its near plane.
    Pose(Camera),
    /// One that has all in view.
    Fitted,
    /// One of the scene's, by its name.
    Named(String),
}

/// The word for [`CameraChoice::Fitted`].
pub const FITTED: &str = "fitted";

/// A text with a slash, or with two commas, is taken for a pose with a slip rather than for a name.
fn camera(text: &str) -> Result<CameraChoice, String> {
    let is_pose = text.trim().is_empty() || text.contains('/') || text.split(',').count() == 3;
    match text.parse() {
        Ok(camera) => Ok(CameraChoice::Pose(camera)),
        Err(_) if text == FITTED => Ok(CameraChoice::Fitted),
        Err(_) if !is_pose => Ok(CameraChoice::Named(text.to_owned())),
        Err(error) => Err(error.to_string()),
    }
}

fn scale(text: &str) -> Result<f64, String> {
    let parsed = text.parse().ok().filter(|scale| (1e-9..=1e9).contains(scale));
    parsed.ok_or_else(|| "expected a number from 1e-9 to 1e9".to_owned())
}

/// A part of some work that is divided among machines.
pub fn shard(text: &str) -> Result<Shard, String> {
    let number = |text: &str| text.parse::<u32>().ok();
    let parsed = text.split_once('/').and_then(|(index, count)| Some((number(index)?, number(count)?)));
    match parsed {
        Some((index, count)) if (1..=count).contains(&index) => Ok(Shard { index, count }),
        _ => Err("expected I/N, from 1/N to N/N".into()),
    }
}

/// Seconds of a clip.
pub fn seconds(text: &str) -> Result<f64, String> {
    let parsed = text.parse().ok().filter(|seconds| (0.0..=1e9).contains(seconds));
    parsed.ok_or_else(|| "expected a number of seconds from 0 to 1e9".to_owned())
}

fn up(text: &str) -> Result<Up, String> {
    match text {
        "y" => Ok(Up::Y),
        "z" => Ok(Up::Z),
        _ => Err("expected y or z".into()),
    }
}

/// `--still` or `--moving`: every command that measures times has this choice with the same default.
#[derive(Debug, Clone, Args)]
pub struct MotionArgs {
    /// Time frames in which nothing moves: shadow maps are drawn once and kept
    #[arg(long, conflicts_with_all = ["_moving", "shadow-cache"])]
    still: bool,
    /// Time frames in which everything moves: shadow maps are drawn in each of them [default]
    #[arg(long = "moving", conflicts_with = "shadow-cache")]
    _moving: bool,
}

impl MotionArgs {
    /// Returns true if nothing moves, clips neither.
    pub fn is_still(&self) -> bool {
        self.still
    }

    /// Returns the drawing options with the motion option as the shadow cache; `--shadow-cache` sets the same and wins.
    pub fn over(&self, settings: &SettingsArgs) -> SettingsArgs {
        let motion = SettingsPatch { shadow_cache: Some(self.still), ..SettingsPatch::default() };
        SettingsArgs { said: settings.said.or(&motion), ..settings.clone() }
    }
}

/// The settings that all commands which draw have as options.
fn options() -> impl Iterator<Item = &'static Setting> {
    SETTINGS.iter().filter(|setting| setting.only.is_empty())
}

impl Args for SettingsArgs {
    fn group_id() -> Option<clap::Id> {
        Some("SettingsArgs".into())
    }

    fn augment_args(command: Command) -> Command {
        let args: Vec<_> = own_options().into_iter().chain(options().map(option)).collect();
        let group = ArgGroup::new("SettingsArgs").multiple(true).args(args.iter().map(|arg| arg.get_id().clone()));
        command.next_help_heading("Drawing (each overrides the scene file)").args(args).group(group)
    }

    fn augment_args_for_update(command: Command) -> Command {
        Self::augment_args(command)
    }
}

/// The options of drawing that are no settings.
fn own_options() -> Vec<Arg> {
    let file = Arg::new("settings").value_name("FILE").value_parser(value_parser!(PathBuf)).help(FILE_HELP);
    let camera = Arg::new("camera").value_name("CAMERA").value_parser(camera).help(CAMERA_HELP);
    let scale = Arg::new("scale").value_name("NUMBER").value_parser(scale).help(SCALE_HELP);
    let up = Arg::new("up").value_name("y|z").value_parser(up).help(UP_HELP);
    let time = Arg::new("time").value_name("SECONDS").value_parser(seconds).help(TIME_HELP);
    let clip = Arg::new("clip").value_name("NAME").action(ArgAction::Append).help(CLIP_HELP);
    let scene = Arg::new("of-scene").value_name("N|NAME").help(SCENE_HELP);
    let variant = Arg::new("variant").value_name("NAME").help(VARIANT_HELP);
    let light = Arg::new("light").value_name("LIGHT").value_parser(value::<LightChoice>).help(LIGHT_HELP);
    let outside = Arg::new("allow-outside").action(ArgAction::SetTrue).help(OUTSIDE_HELP);
    let of_scene = [
        file.long("settings"),
        camera.long("camera").allow_hyphen_values(true),
        scale.long("scale").allow_hyphen_values(true),
        up.long("up"),
        time.long("time").allow_hyphen_values(true),
        clip.long("clip"),
        scene.long("scene"),
        variant.long("variant"),
        light.long("light"),
    ];
    of_scene.into_iter().chain(sky::options()).chain([outside.long("allow-outside")]).collect()
}

/// A setting as an option.
fn option(setting: &'static Setting) -> Arg {
    let is_number = matches!(
        setting.values,
        ValueKind::Whole(..)
            | ValueKind::Among(_)
            | ValueKind::Number(..)
            | ValueKind::Size
            | ValueKind::Grid(..)
            | ValueKind::Aperture
    );
    Arg::new(setting.key)
        .long(setting.key)
        .value_name(setting.value_name())
        .value_parser(move |text: &str| setting.read(text))
        // So that -1 is told to be out of range, and no option.
        .allow_hyphen_values(is_number)
        .help(format!("{} [{}; default: {}]", setting.help, setting.range(), setting.default()))
}

impl FromArgMatches for SettingsArgs {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
        let mut args = Self::default();
        args.update_from_arg_matches(matches)?;
        Ok(args)
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        self.file = matches.get_one("settings").cloned();
        self.camera = matches.get_one("camera").cloned();
        (self.scale, self.up) = (matches.get_one("scale").copied(), matches.get_one("up").copied());
        self.time = matches.get_one("time").copied();
        self.clips = matches.get_many("clip").into_iter().flatten().cloned().collect();
        (self.scene, self.variant) = (matches.get_one("of-scene").cloned(), matches.get_one("variant").cloned());
        self.light = matches.get_one("light").cloned();
        self.sky = SkyArgs::of(matches);
        self.allow_outside = matches.get_flag("allow-outside");
        let said = options().filter_map(|setting| matches.get_one::<SettingsPatch>(setting.key));
        self.said = said.fold(SettingsPatch::default(), |all, one| all.or(one));
        let all = own_options().into_iter().chain(options().map(option));
        self.written = all.flat_map(|option| written(matches, &option)).collect();
        Ok(())
    }
}

impl SettingsArgs {
    /// `--camera` as it was written.
    pub fn camera_text(&self) -> Option<String> {
        let (_, text) = self.written.iter().find(|(name, _)| name == "camera")?;
        text.as_ref().map(|text| text.to_string_lossy().into_owned())
    }

    /// Refuses `--exposure` and `--tonemap`, for a picture of linear light.
    pub fn refuse_shown(&self) -> Result<(), Failure> {
        if self.said.exposure.is_none() && self.said.tonemap.is_none() {
            return Ok(());
        }
        Err(Failure::usage("an .exr picture holds linear light in nits: --exposure and --tonemap do not apply to it"))
    }

    /// The options that no settings file can hold, by name.
    pub fn beside_settings() -> Vec<String> {
        own_options().iter().map(typed).filter(|name| name != "settings").collect()
    }
}

/// The name by which an option is typed.
fn typed(option: &Arg) -> String {
    option.get_long().unwrap_or_default().to_owned()
}

/// An option as often as it was given, with its values as they were written.
fn written(matches: &ArgMatches, option: &Arg) -> Vec<(String, Option<OsString>)> {
    let (id, name) = (option.get_id().as_str(), typed(option));
    match matches.get_raw(id) {
        _ if matches.value_source(id) != Some(ValueSource::CommandLine) => Vec::new(),
        _ if !option.get_action().takes_values() => vec![(name, None)],
        values => values.into_iter().flatten().map(|value| (name.clone(), Some(value.to_owned()))).collect(),
    }
}

/// One view of the buffers, or all of them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ViewChoice {
    One(View),
    All,
}

pub fn view(text: &str) -> Result<ViewChoice, String> {
    match text.parse() {
        _ if text.eq_ignore_ascii_case("all") => Ok(ViewChoice::All),
        Ok(view) => Ok(ViewChoice::One(view)),
        Err(_) => {
            let names: Vec<&str> = View::NAMES.iter().map(|(name, _)| *name).chain(["all"]).collect();
            Err(unknown("view", text, &names))
        }
    }
}

/// Reads any value whose own parser explains a wrong text.
pub fn value<T: FromStr<Err: Display>>(text: &str) -> Result<T, String> {
    text.parse().map_err(|error: T::Err| error.to_string())
}

/// An empty name, as an unset variable of a script leaves it, would be a part of every device's name.
pub fn device(text: &str) -> Result<DeviceChoice, String> {
    if text.trim().is_empty() { Err("a number or a part of a name is needed".into()) } else { value(text) }
}

/// Reads the value of a setting that is a command's own option.
fn own<T>(key: &str, text: &str, of: fn(SettingsPatch) -> Option<T>) -> Result<T, String> {
    let setting = SETTINGS.iter().find(|setting| setting.key == key);
    let read = setting.map(|setting| setting.read(text)).transpose()?;
    read.and_then(of).ok_or_else(|| format!("{key} is no setting"))
}

pub fn exposure(text: &str) -> Result<f32, String> {
    own("exposure", text, |patch| patch.exposure)
}

pub fn samples(text: &str) -> Result<u32, String> {
    own("samples", text, |patch| patch.samples)
}

/// Reads a size of pictures.
pub fn size(text: &str) -> Result<[u32; 2], String> {
    own("size", text, |patch| patch.size)
}

/// Reads a whole number of a range.
pub fn whole<T>(range: RangeInclusive<T>) -> impl Fn(&str) -> Result<T, String> + Clone + Send + Sync + 'static
where
    T: FromStr + PartialOrd + Display + Clone + Send + Sync + 'static,
{
    move |text: &str| {
        let parsed = text.parse().ok().filter(|number| range.contains(number));
        parsed.ok_or_else(|| format!("must be a whole number from {} to {}", range.start(), range.end()))
    }
}

/// Pictures for each second.
pub fn fps(text: &str) -> Result<f64, String> {
    let parsed = text.parse().ok().filter(|fps| (1e-3..=1e4).contains(fps));
    parsed.ok_or_else(|| "expected a number from 0.001 to 10000".to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_camera_is_a_pose_a_name_or_fitted() {
        assert!(matches!(camera("0,1,8/0,1,0"), Ok(CameraChoice::Pose(_))));
        assert_eq!(camera("fitted"), Ok(CameraChoice::Fitted));
        assert_eq!(camera("Camera.001"), Ok(CameraChoice::Named("Camera.001".into())));
        for text in ["", "1,2,3", "1,2/3,4,5", "0,0,0/0,0,0"] {
            assert!(camera(text).is_err_and(|why| why.starts_with("camera \"")), "{text}");
        }
    }

    #[test]
    fn values_out_of_range_are_refused() {
        assert_eq!((exposure("-3.5"), samples("4096")), (Ok(-3.5), Ok(4096)));
        for text in ["nan", "inf", "bright", "", "101"] {
            assert!(exposure(text).is_err_and(|why| why.starts_with("must be a number from -100 to 100")), "{text}");
        }
        assert!(samples("0").is_err() && samples("4097").is_err());
        let frames = whole(1..=1_000_000_u32);
        assert_eq!((frames("1"), frames("1000000")), (Ok(1), Ok(1_000_000)));
        for text in ["0", "1000001", "-1", "1.5", "many", ""] {
            assert_eq!(frames(text), Err("must be a whole number from 1 to 1000000".into()), "{text}");
        }
    }
}
