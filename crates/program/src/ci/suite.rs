//! Suites of cases: scenes with settings, and the checks of each. docs/CI.md explains every key.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use afterlight::gpu::Validation;
use afterlight::scene::{SettingsPatch, builtin, nearest, unknown};
use afterlight_files::regular_file::read_regular;
use afterlight_lab::mutants::PresentPath;
use serde::{Deserialize, Serialize};

use super::results::MOST_BYTES;
use crate::failure::{Exit, Failure};

/// The suites that the program has with it.
const SHIPPED: [(&str, &str); 4] = [
    ("smoke", include_str!("suites/smoke.toml")),
    ("quick", include_str!("suites/quick.toml")),
    ("full", include_str!("suites/full.toml")),
    ("soak", include_str!("suites/soak.toml")),
];

/// The greatest depth of suites that include each other.
const MAX_DEPTH: usize = 8;

/// All cases of a suite, in the order in which they stand there.
#[derive(Debug, Clone, PartialEq)]
pub struct Suite {
    /// As it was asked for.
    pub name: String,
    pub cases: Vec<SuiteCase>,
}

/// One scene with its settings and its checks.
#[derive(Debug, Clone, PartialEq)]
pub struct SuiteCase {
    /// `GROUP.NAME`.
    pub name: String,
    pub scene: SceneSource,
    /// As `--vary` takes them.
    pub settings: String,
    /// Seconds since the scene's clips began.
    pub time: f64,
    /// Seconds after which the case is stopped.
    pub timeout: f64,
    pub holds: Checks,
}

/// The source of a case's scene.
#[derive(Debug, Clone, PartialEq)]
pub enum SceneSource {
    /// A built-in scene, or a file.
    Named(String),
    /// The text of a scene file, and the folder that its paths are relative to.
    Text { text: String, folder: PathBuf },
}

impl SceneSource {
    /// The file that it names, if there is one: all that is known of a scene that cannot be read.
    pub fn named_file(&self) -> Vec<PathBuf> {
        match self {
            Self::Named(name) => Some(PathBuf::from(name)).filter(|path| path.is_file()).into_iter().collect(),
            Self::Text { .. } => Vec::new(),
        }
    }
}

/// The checks of a case. Every case also checks that pictures are drawn at all, and that nothing of them is left on the device.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Checks {
    /// Number of renderers whose pictures must be equal to the byte.
    pub identical: u32,
    /// Settings with which the picture must be the same to the byte.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub alike: Option<String>,
    /// The greatest mean FLIP error against the picture of the baseline; not checked where the baseline has none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub flip: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub truth: Option<TruthTolerance>,
    /// The checks of the validation layer that must be silent, one after the other.
    pub validate: Vec<ValidationMode>,
    /// Number of frames over which memory must not grow.
    pub steady_frames: u32,
    /// Number of sizes of a surface without a display to draw into, one after the other.
    pub resizes: u32,
    /// Frames are shown in a window's ways, on a surface without a display, also under the checks of `validate`.
    pub window: Vec<PresentPath>,
    /// A run of frames while everything changes at random.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub soak: Option<Soak>,
    /// Limit of the device's time for a frame, as a multiple of the baseline's.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub slower: Option<f64>,
}

/// The allowed differences of a picture from the reference renderer's.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TruthTolerance {
    /// The mean over the pixels of their greatest relative error.
    pub mean: f64,
    /// The greatest relative error of a pixel.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub worst: Option<f64>,
    /// The share of pixels that may show another triangle.
    #[serde(default = "elsewhere")]
    pub elsewhere: f64,
}

fn elsewhere() -> f64 {
    afterlight_lab::stress::MOST_ELSEWHERE
}

/// A long run in which settings, lights, objects and the camera change at random, and nothing may grow.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Soak {
    pub frames: u32,
    /// Mean number of frames between changes.
    pub changes_every: u32,
    /// Seed of the changes: equal seeds try the same changes. Changes that make frames too slow are given up, which depends on the device.
    pub seed: u64,
}

impl Soak {
    /// Fewer frames have too few samples to tell growth from noise.
    const LEAST_FRAMES: u32 = 200;
}

/// A set of checks of the validation layer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ValidationMode {
    Core,
    Sync,
    /// Synchronization, with the layer's heuristic for accesses by shaders.
    SyncShaders,
    GpuAssisted,
    BestPractices,
}

impl ValidationMode {
    pub fn validation(self) -> Validation {
        match self {
            Self::Core => Validation::Core,
            Self::Sync | Self::SyncShaders => Validation::Synchronization,
            Self::GpuAssisted => Validation::GpuAssisted,
            Self::BestPractices => Validation::BestPractices,
        }
    }

    pub fn name(self) -> &'static str {
        match self {
            Self::Core => "core",
            Self::Sync => "sync",
            Self::SyncShaders => "sync-shaders",
            Self::GpuAssisted => "gpu-assisted",
            Self::BestPractices => "best-practices",
        }
    }
}

/// A suite's file.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    /// The folder that paths are relative to, in place of the file's own, and relative to that: bundles name it.
    folder: Option<PathBuf>,
    /// Suites whose cases come before its own: shipped ones by their names, others by their files.
    #[serde(default)]
    include: Vec<String>,
    /// Keys for all cases of this file, which cases may override.
    #[serde(default)]
    defaults: CaseKeys,
    /// Texts of scene files, by the names under which cases of this file know them.
    #[serde(default)]
    scenes: BTreeMap<String, String>,
    #[serde(default, rename = "case")]
    cases: Vec<CaseEntry>,
}

/// A `[[case]]`: a case for each variant.
#[derive(Debug, Deserialize)]
struct CaseEntry {
    group: toml::Spanned<String>,
    /// Names of the variants, with the settings that each adds.
    each: BTreeMap<String, String>,
    /// One of the suite's own scenes, a built-in one, or a file.
    scene: String,
    #[serde(flatten)]
    keys: CaseKeys,
}

/// The keys that both `[defaults]` and cases may have.
#[derive(Debug, Clone, Default, Deserialize)]
struct CaseKeys {
    settings: Option<String>,
    time: Option<f64>,
    timeout: Option<f64>,
    identical: Option<u32>,
    alike: Option<String>,
    flip: Option<f64>,
    truth: Option<TruthTolerance>,
    validate: Option<Vec<ValidationMode>>,
    steady_frames: Option<u32>,
    resizes: Option<u32>,
    window: Option<Vec<PresentPath>>,
    soak: Option<Soak>,
    slower: Option<f64>,
    /// Keys that do not exist: serde refuses them in no flattened structure.
    #[serde(flatten)]
    others: BTreeMap<String, toml::Value>,
}

const KEYS: [&str; 16] = [
    "group",
    "each",
    "scene",
    "settings",
    "time",
    "timeout",
    "identical",
    "alike",
    "flip",
    "truth",
    "validate",
    "steady_frames",
    "resizes",
    "window",
    "soak",
    "slower",
];

impl CaseKeys {
    /// `self` where it says something, `other` elsewhere; settings of both, of which the own win.
    fn or(self, other: &Self) -> Self {
        Self {
            settings: self.settings.or_else(|| other.settings.clone()),
            time: self.time.or(other.time),
            timeout: self.timeout.or(other.timeout),
            identical: self.identical.or(other.identical),
            alike: self.alike.or_else(|| other.alike.clone()),
            flip: self.flip.or(other.flip),
            truth: self.truth.or(other.truth),
            validate: self.validate.or_else(|| other.validate.clone()),
            steady_frames: self.steady_frames.or(other.steady_frames),
            resizes: self.resizes.or(other.resizes),
            window: self.window.or_else(|| other.window.clone()),
            soak: self.soak.or(other.soak),
            slower: self.slower.or(other.slower),
            others: BTreeMap::new(),
        }
    }

    fn check(&self) -> Result<(), String> {
        if let Some(key) = self.others.keys().next() {
            return Err(unknown("key", key, &KEYS));
        }
        let positive = [("timeout", self.timeout), ("slower", self.slower)];
        if let Some((key, _)) =
            positive.iter().find(|(_, value)| value.is_some_and(|value| !(value > 0.0 && value <= 1e6)))
        {
            return Err(format!("{key} must be a number above 0, up to 1e6"));
        }
        if self.time.is_some_and(|time| !(0.0..=1e9).contains(&time)) {
            return Err("time must be a number of seconds from 0 to 1e9".into());
        }
        if self.flip.is_some_and(|flip| !(0.0..=1.0).contains(&flip)) {
            return Err("flip must be a mean FLIP error from 0 to 1".into());
        }
        let bounds = self.truth.iter().flat_map(|truth| [truth.mean, truth.worst.unwrap_or_default(), truth.elsewhere]);
        if bounds.into_iter().any(|bound| bound.is_nan() || bound < 0.0) {
            return Err("bounds of truth must not be below 0".into());
        }
        if self.soak.is_some_and(|soak| soak.frames < Soak::LEAST_FRAMES || soak.changes_every == 0) {
            return Err(format!("soak needs at least {} frames, and changes_every 1 or more", Soak::LEAST_FRAMES));
        }
        match self.identical {
            _ if self.steady_frames == Some(1) => {
                Err("steady_frames must be 0 or at least 2: memory is compared between frames".into())
            }
            Some(0) => Err("identical must be 1 or more: so many pictures are drawn".into()),
            _ => Ok(()),
        }
    }
}

impl Suite {
    /// The suite of this name, or in this file.
    ///
    /// # Errors
    /// When it cannot be read, or something in it is wrong.
    pub fn open(name: &str) -> Result<Self, Failure> {
        let mut cases = Vec::new();
        collect(name, Path::new(""), 0, &mut cases)?;
        let mut names = BTreeSet::new();
        if let Some(twice) = cases.iter().find(|case| !names.insert(&case.name)) {
            return Err(bad(name, &format!("two cases are named {}", twice.name)));
        }
        if cases.is_empty() {
            return Err(bad(name, "there is no case in it"));
        }
        Ok(Self { name: name.to_owned(), cases })
    }

    /// The case of this name.
    pub fn case(&self, name: &str) -> Result<&SuiteCase, Failure> {
        let names = self.cases.iter().map(|case| case.name.as_str());
        let found = self.cases.iter().find(|case| case.name == name);
        let guess = || nearest(name, names).map_or_else(String::new, |guess| format!(": did you mean \"{guess}\"?"));
        found.ok_or_else(|| {
            Failure::usage(format!("unknown case of {} {name:?}{} (--list has all)", self.name, guess()))
        })
    }
}

/// A suite's file with one case alone, which `--repro` opens from wherever it is. `kept` is the place of the scene's files where that is not their own,
/// relative to the suite's file: the scene's file, or the folder that its text's paths are relative to.
pub fn alone(case: &SuiteCase, kept: Option<&Path>) -> String {
    #[derive(Serialize)]
    struct Alone<'a> {
        #[serde(skip_serializing_if = "Option::is_none")]
        folder: Option<PathBuf>,
        #[serde(skip_serializing_if = "BTreeMap::is_empty")]
        scenes: BTreeMap<&'a str, &'a str>,
        case: [WrittenCase<'a>; 1],
    }
    #[derive(Serialize)]
    struct WrittenCase<'a> {
        group: &'a str,
        scene: String,
        settings: &'a str,
        time: f64,
        timeout: f64,
        #[serde(flatten)]
        holds: &'a Checks,
        each: BTreeMap<&'a str, &'a str>,
    }
    let (group, name) = case.name.split_once('.').unwrap_or(("", &case.name));
    let whole = |path: &Path| {
        let path = if path.as_os_str().is_empty() { Path::new(".") } else { path };
        fs::canonicalize(path).unwrap_or_else(|_| path.to_owned())
    };
    let folder = match &case.scene {
        SceneSource::Text { folder, .. } => Some(kept.map_or_else(|| whole(folder), Path::to_owned)),
        SceneSource::Named(_) => None,
    };
    let (scene, scenes) = match &case.scene {
        SceneSource::Named(name) if name.starts_with(builtin::PREFIX) => (name.clone(), BTreeMap::new()),
        SceneSource::Named(name) => {
            (kept.map_or_else(|| whole(Path::new(name)), Path::to_owned).display().to_string(), BTreeMap::new())
        }
        SceneSource::Text { text, .. } => ("scene".to_owned(), [("scene", text.as_str())].into()),
    };
    let (settings, time, timeout, holds) = (case.settings.as_str(), case.time, case.timeout, &case.holds);
    let entry = WrittenCase { group, scene, settings, time, timeout, holds, each: [(name, "")].into() };
    toml::to_string(&Alone { folder, scenes, case: [entry] }).unwrap_or_default()
}

fn bad(name: &str, why: &str) -> Failure {
    Failure::new(Exit::BadInput, format!("the suite {name}: {why}"))
}

/// Adds the cases of a suite to the cases before it. Returns the texts of its scenes, and of the scenes of suites that it includes.
fn collect(
    name: &str,
    folder: &Path,
    depth: usize,
    cases: &mut Vec<SuiteCase>,
) -> Result<BTreeMap<String, String>, Failure> {
    if depth > MAX_DEPTH {
        return Err(bad(name, "suites include each other without end"));
    }
    let shipped = SHIPPED.iter().find(|(own, _)| *own == name);
    let (text, path) = match shipped {
        Some((_, text)) => ((*text).to_owned(), PathBuf::from(name)),
        None => {
            let path = folder.join(name);
            // Each case's process reads it again, so it cannot be a pipe.
            let read = read_regular(&path, MOST_BYTES).map_err(|error| error.to_string());
            let text = read.and_then(|bytes| String::from_utf8(bytes).map_err(|error| error.utf8_error().to_string()));
            let text = text.map_err(|error| {
                let failure =
                    Failure::new(Exit::BadInput, format!("cannot read the suite {}: {error}", path.display()));
                failure.with_hint(format!("shipped suites: {}", SHIPPED.map(|(name, _)| name).join(", ")))
            })?;
            (text, path)
        }
    };
    let at = |offset: usize, why: &str| {
        let line = text[..offset.min(text.len())].lines().count().max(1);
        Failure::new(Exit::BadInput, format!("{}:{line}: {why}", path.display()))
    };
    let file: File = toml::from_str(&text).map_err(|error| {
        at(error.span().map_or(0, |span| span.start), &error.message().lines().collect::<Vec<_>>().join(", "))
    })?;
    let beside = if shipped.is_some() { PathBuf::new() } else { path.parent().unwrap_or(Path::new("")).to_owned() };
    let mut scenes = BTreeMap::new();
    for included in &file.include {
        scenes.extend(collect(included, &beside, depth + 1, cases)?);
    }
    scenes.extend(file.scenes);
    file.defaults.check().map_err(|why| at(text.find("[defaults]").unwrap_or(0), &why))?;
    let own_folder = file.folder.map_or_else(|| beside.clone(), |folder| beside.join(folder));
    for entry in file.cases {
        let offset = entry.group.span().start;
        cases.extend(entry.cases(&file.defaults, &scenes, &own_folder).map_err(|why| at(offset, &why))?);
    }
    Ok(scenes)
}

impl CaseEntry {
    fn cases(
        self,
        defaults: &CaseKeys,
        scenes: &BTreeMap<String, String>,
        folder: &Path,
    ) -> Result<Vec<SuiteCase>, String> {
        self.keys.check()?;
        let group = self.group.into_inner();
        check_name("group", &group)?;
        let scene = match scenes.get(&self.scene) {
            Some(text) => SceneSource::Text { text: text.clone(), folder: folder.to_owned() },
            None if self.scene.starts_with(builtin::PREFIX) => SceneSource::Named(self.scene),
            None => SceneSource::Named(folder.join(self.scene).display().to_string()),
        };
        if self.each.is_empty() {
            return Err(format!("{group} has no variant: each = {{ plain = \"\" }} is one without more settings"));
        }
        let keys = self.keys.or(defaults);
        let of = |(name, more): (String, String)| {
            check_name("variant", &name)?;
            let said = |text: &str| text.parse::<SettingsPatch>().map_err(|error| format!("{group}.{name}: {error}"));
            keys.alike.as_deref().map(said).transpose()?;
            let settings = said(&more)?.or(&said(keys.settings.as_deref().unwrap_or_default())?);
            Ok(SuiteCase {
                name: format!("{group}.{name}"),
                scene: scene.clone(),
                settings: settings.to_string(),
                time: keys.time.unwrap_or_default(),
                timeout: keys.timeout.unwrap_or(60.0),
                holds: Checks {
                    identical: keys.identical.unwrap_or(2),
                    alike: keys.alike.clone(),
                    flip: keys.flip,
                    truth: keys.truth,
                    validate: keys.validate.clone().unwrap_or_default(),
                    steady_frames: keys.steady_frames.unwrap_or_default(),
                    resizes: keys.resizes.unwrap_or_default(),
                    window: keys.window.clone().unwrap_or_default(),
                    soak: keys.soak,
                    slower: keys.slower,
                },
            })
        };
        self.each.into_iter().map(of).collect()
    }
}

/// Names are parts of names of files, lines of CSV, and tests of googletest's filters.
fn check_name(what: &str, name: &str) -> Result<(), String> {
    let is_plain = !name.is_empty() && name.chars().all(|c| c.is_ascii_alphanumeric() || c == '-' || c == '_');
    if is_plain {
        Ok(())
    } else {
        Err(format!("the {what} \"{name}\": only letters, digits, - and _ can be in a name"))
    }
}

#[cfg(test)]
mod tests {
    use std::io::Write as _;

    use tempfile::NamedTempFile;

    use super::*;

    fn opened(text: &str) -> Result<Suite, Failure> {
        let mut file = NamedTempFile::new().expect("a temporary file");
        file.write_all(text.as_bytes()).expect("written");
        Suite::open(&file.path().display().to_string())
    }

    const WHOLE: &str = r#"
[defaults]
settings = "size=32x18 light-path=loop"
timeout = 5
validate = ["sync"]

[scenes]
own = "base = \"builtin:quad\""

[[case]]
group = "a"
scene = "own"
settings = "size=8x8"
truth = { mean = 0.5 }
identical = 3
[case.each]
plain = ""
wide = "size=16x8"

[[case]]
group = "b"
scene = "models/house.obj"
flip = 0.1
validate = []
each = { forward = "light-path=forward" }
"#;

    #[test]
    fn cases_have_what_they_say_over_what_their_file_says() {
        let suite = opened(WHOLE).unwrap_or_else(|failure| panic!("{}", failure.one_line()));
        let names: Vec<_> = suite.cases.iter().map(|case| case.name.as_str()).collect();
        assert_eq!(names, ["a.plain", "a.wide", "b.forward"]);
        let [plain, wide, forward] = &suite.cases[..] else { panic!("three cases") };
        assert_eq!((plain.settings.as_str(), plain.holds.identical, plain.timeout), ("size=8x8", 3, 5.0));
        assert_eq!((wide.settings.as_str(), &wide.holds.validate[..]), ("size=16x8", &[ValidationMode::Sync][..]));
        assert!(matches!(&plain.scene, SceneSource::Text { text, .. } if text.contains("builtin:quad")));
        assert!(
            matches!(&forward.scene, SceneSource::Named(name) if name.ends_with("/models/house.obj")),
            "{forward:?}"
        );
        assert_eq!((forward.holds.flip, forward.holds.validate.len()), (Some(0.1), 0));
        assert_eq!(forward.settings, "size=32x18 light-path=forward");
    }

    #[test]
    fn a_case_alone_is_a_suite_of_that_case() {
        let shipped = ["full", "soak"].map(|name| Suite::open(name).expect("it is shipped").cases).concat();
        for case in shipped.iter().chain(&opened(WHOLE).expect("read").cases) {
            let alone =
                opened(&alone(case, None)).unwrap_or_else(|failure| panic!("{}: {}", case.name, failure.one_line()));
            let [again] = &alone.cases[..] else { panic!("one case") };
            let same_scene = match (&case.scene, &again.scene) {
                (SceneSource::Text { text: one, folder }, SceneSource::Text { text: other, folder: again }) => {
                    let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
                    one == other && fs::canonicalize(folder).is_ok_and(|folder| folder == *again)
                }
                (SceneSource::Named(one), SceneSource::Named(other)) => one == other,
                _ => false,
            };
            assert!(same_scene, "{}", case.name);
            assert_eq!((&again.name, &again.settings, &again.holds), (&case.name, &case.settings, &case.holds));
        }
    }

    #[test]
    fn what_is_wrong_is_told_with_its_line() {
        let case = "[[case]]\ngroup = \"a\"\nscene = \"builtin:quad\"\neach = { b = \"\" }\n";
        for (text, part) in [
            ("", "there is no case"),
            ("[[case]]\ngroup = \"a\"\n", ":1: missing field"),
            (&format!("{case}colour = 1\n"), "unknown key \"colour\""),
            (&format!("{case}\n{case}"), "two cases are named a.b"),
            (&format!("{case}timeout = 0\n"), ":2: timeout must be"),
            (&format!("{case}identical = 0\n"), "identical must be 1 or more"),
            (&format!("{case}steady_frames = 1\n"), "steady_frames must be"),
            (&format!("{case}flip = 2\n"), "flip must be"),
            (&format!("{case}soak = {{ frames = 100, changes_every = 5, seed = 1 }}\n"), "at least 200 frames"),
            (&format!("{case}soak = {{ frames = 200, changes_every = 0, seed = 1 }}\n"), "changes_every 1 or more"),
            (&format!("{case}truth = {{ mean = -1 }}\n"), "must not be below 0"),
            (&format!("{case}truth = {{ men = 1 }}\n"), "men"),
            (&format!("{case}validate = [\"some\"]\n"), "some"),
            (&format!("{case}settings = \"colour=red\"\n"), "unknown setting"),
            (&case.replace("\"a\"", "\"a b\""), "only letters"),
            (&case.replace("{ b = \"\" }", "{}"), "has no variant"),
            ("include = [\"smoke\", \"missing.toml\"]\n", "cannot read the suite"),
        ] {
            let message = opened(text).expect_err(text).one_line();
            assert!(message.contains(part), "{text}: {message}");
        }
    }

    #[test]
    fn suites_that_include_each_other_end() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("own.toml");
        fs::write(&path, "include = [\"own.toml\"]\n").expect("written");
        let message = Suite::open(&path.display().to_string()).expect_err("no end").one_line();
        assert!(message.contains("without end"), "{message}");
    }
}
