//! The pipeline cache and the cache of the truth under siege: damaged, replaced by something that is no file, on a full disk, in a read-only folder,
//! shared by eight processes. A warning at most, and the same picture to the last bit. Results on a full disk: an error, and the old file stays.
//!
//! Lavapipe keeps nothing in its pipeline cache. The layer of tests/failures-layer stands in for a driver that does, and that does not survive
//! damage. Disks are truly full and folders truly read-only in a private mount namespace. If none is permitted, that part is skipped. For truths
//! alone, a limit on the size of files stands in for a full disk.

use std::collections::BTreeMap;
use std::ffi::OsStr;
use std::fs;
use std::os::unix::fs::{PermissionsExt, symlink};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use crate::common::failures_layer;
use crate::common::program::program;
use crate::common::tries_all;

const SCENE: &str = "builtin:spheres?rows=2&columns=3";
/// Nothing here takes a second; a machine that does much else may take longer.
const HANGS_AFTER: Duration = Duration::from_secs(60);
/// The data of the stand-in for a driver, 100,000 bytes. A truth of 64x36 has about as many.
const PIPELINES: &str = "cache:100000";

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kept {
    Pipelines,
    Truths,
}

const CACHES: [Kept; 2] = [Kept::Pipelines, Kept::Truths];

/// A command whose work one cache keeps, with a folder for it.
struct Site {
    kept: Kept,
    folder: tempfile::TempDir,
    layer: tempfile::TempDir,
}

/// The outcome of a run that ended well.
#[derive(Debug)]
struct Ran {
    picture: Vec<u8>,
    warnings: Vec<String>,
    has_used_cache: bool,
}

impl Site {
    fn new(kept: Kept) -> Self {
        let site = Self { kept, folder: tempfile::tempdir().expect("a folder"), layer: failures_layer::folder() };
        fs::create_dir(site.cache()).expect("a folder for the cache");
        site
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn cache(&self) -> PathBuf {
        self.path("cache")
    }

    /// Writes a picture, with a folder for the cache.
    fn command(&self, picture: &str, cache: &Path) -> Command {
        let mut command = program();
        command.current_dir(self.folder.path()).envs(failures_layer::environment(self.layer.path()));
        command.env("AFTERLIGHT_FAILURES", PIPELINES).env("AFTERLIGHT_PIPELINE_CACHE", "").env("AFTERLIGHT_CACHE", "");
        // The driver's own cache is none of ours.
        command.env("MESA_SHADER_CACHE_DISABLE", "true");
        let (verb, samples, variable) = match self.kept {
            Kept::Pipelines => ("render", "1", "AFTERLIGHT_PIPELINE_CACHE"),
            Kept::Truths => ("reference", "2", "AFTERLIGHT_CACHE"),
        };
        command.env(variable, cache);
        command.args([verb, SCENE, "--size", "64x36", "--samples", samples, "-o", picture]);
        command
    }

    /// Returns the outcome of a command, which must have ended well.
    fn ran(&self, output: &Output, picture: &str, what: &str) -> Ran {
        let (stdout, stderr) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
        assert!(output.status.success(), "{:?}, {what}: {}\n{stderr}", self.kept, output.status);
        let is_progress = |line: &&str| line.starts_with("builtin:") && line.ends_with('%');
        let (of_layer, own): (Vec<&str>, Vec<&str>) = stderr
            .lines()
            .filter(|line| !is_progress(line))
            .partition(|line| line.starts_with("VK_LAYER_AFTERLIGHT_failures"));
        let is_warning = |line: &&str| line.starts_with("warning: ");
        assert!(own.iter().all(is_warning), "{:?}, {what}: more than warnings: {own:?}", self.kept);
        let has_used_cache = match self.kept {
            Kept::Pipelines => of_layer.iter().any(|line| line.ends_with("is whole")),
            Kept::Truths => stdout.lines().any(|line| line.contains("from the cache") && line.ends_with(" all")),
        };
        let picture = fs::read(self.path(picture)).unwrap_or_else(|error| panic!("{what}: {error}"));
        Ran { picture, warnings: own.into_iter().map(str::to_owned).collect(), has_used_cache }
    }

    fn run(&self, what: &str) -> Ran {
        self.run_with(&self.cache(), what)
    }

    fn run_with(&self, cache: &Path, what: &str) -> Ran {
        // A file without an end must not take the machine's memory.
        let command = in_shell(r#"ulimit -v 8388608; exec "$@""#, &[], &self.command("picture.png", cache));
        self.ran(&finish(start(command), what), "picture.png", what)
    }

    /// Fills the cache, and returns the picture, and the cache's file with its bytes.
    fn fill(&self) -> (Vec<u8>, PathBuf, Vec<u8>) {
        let first = self.run("an empty cache");
        assert!(!first.has_used_cache && first.warnings.is_empty(), "{:?}: {first:?}", self.kept);
        let files: Vec<PathBuf> = files(&self.cache()).into_keys().collect();
        let [file] = &files[..] else { panic!("{:?}: not one file: {files:?}", self.kept) };
        let whole = fs::read(file).expect("readable");
        let second = self.run("a full cache");
        assert!(second.has_used_cache && second.warnings.is_empty(), "{:?}: {second:?}", self.kept);
        assert!(second.picture == first.picture, "{:?}: a full cache changes the picture", self.kept);
        (first.picture, file.clone(), whole)
    }
}

/// Wraps the command in a shell script that gets these arguments before it.
fn in_shell(script: &str, arguments: &[&OsStr], command: &Command) -> Command {
    let mut shell = Command::new("sh");
    shell.args(["-c", script, "sh"]);
    wrap(shell, arguments, command)
}

fn wrap(mut outer: Command, arguments: &[&OsStr], command: &Command) -> Command {
    outer.args(arguments).arg(command.get_program()).args(command.get_args());
    for (name, value) in command.get_envs() {
        match value {
            Some(value) => outer.env(name, value),
            None => outer.env_remove(name),
        };
    }
    if let Some(folder) = command.get_current_dir() {
        outer.current_dir(folder);
    }
    outer
}

fn start(mut command: Command) -> Child {
    command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    command.spawn().expect("the program starts")
}

/// Waits for a child that says less than a pipe holds.
fn finish(mut child: Child, what: &str) -> Output {
    let begun = Instant::now();
    while child.try_wait().expect("a child").is_none() {
        if begun.elapsed() > HANGS_AFTER {
            child.kill().expect("it ends");
            panic!("{what}: hangs");
        }
        thread::sleep(Duration::from_millis(2));
    }
    child.wait_with_output().expect("its output")
}

/// Returns every entry below a folder that is no directory, with the bytes of files.
fn files(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut found = BTreeMap::new();
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let path = entry.path();
        match entry.file_type().expect("a type") {
            kind if kind.is_dir() => found.extend(files(&path)),
            kind if kind.is_file() => _ = found.insert(path.clone(), fs::read(&path).expect("readable")),
            _ => _ = found.insert(path, Vec::new()),
        }
    }
    found
}

/// A thing that takes the place of a cache's file.
enum Damage {
    Bytes(Vec<u8>),
    Link(&'static str),
    Directory,
    Fifo,
}

impl Damage {
    fn inflict(&self, file: &Path) {
        let removed = if file.is_dir() { fs::remove_dir(file) } else { fs::remove_file(file) };
        removed.expect("the old one can be removed");
        match self {
            Self::Bytes(bytes) => fs::write(file, bytes).expect("written"),
            Self::Link(target) => symlink(target, file).expect("linked"),
            Self::Directory => fs::create_dir(file).expect("made"),
            Self::Fifo => {
                let made = Command::new("mkfifo").arg(file).status();
                assert!(made.is_ok_and(|status| status.success()), "mkfifo");
            }
        }
    }
}

/// Damage of all kinds. The random kinds come first, as many of each as asked for.
fn damages(whole: &[u8], name: &'static str, each: u32) -> Vec<(String, Damage)> {
    let mut random = fastrand::Rng::with_seed(24);
    let mut all = Vec::new();
    for round in 0..each {
        let mut flipped = whole.to_vec();
        // Few enough to fall into the header now and then.
        let bytes = if round % 2 == 0 { whole.len() } else { 80 };
        let bits = 1 + random.usize(..8);
        while (0..whole.len()).filter(|&index| flipped[index] != whole[index]).count() < bits {
            flipped[random.usize(..bytes)] ^= 1 << random.u32(..8);
        }
        all.push((format!("flipped bits, {round}"), Damage::Bytes(flipped)));
        let length = random.usize(..whole.len());
        all.push((format!("cut off after {length} bytes"), Damage::Bytes(whole[..length].to_vec())));
    }
    let longer = [whole, &[0]].concat();
    all.extend([
        ("a byte more".into(), Damage::Bytes(longer)),
        ("no bytes".into(), Damage::Bytes(Vec::new())),
        ("a FIFO".into(), Damage::Fifo),
        ("a device without an end".into(), Damage::Link("/dev/zero")),
        ("a link to nothing".into(), Damage::Link("nothing")),
        ("a link to itself".into(), Damage::Link(name)),
        // Last: a file cannot be put in its place.
        ("a directory".into(), Damage::Directory),
    ]);
    all
}

#[test]
fn a_damaged_cache_costs_a_warning_at_most_and_is_mended() {
    for kept in CACHES {
        let site = Site::new(kept);
        let (picture, file, whole) = site.fill();
        let name = file.file_name().expect("a name").to_string_lossy().into_owned();
        for (what, damage) in damages(&whole, name.leak(), if tries_all() { 100 } else { 1 }) {
            damage.inflict(&file);
            let ran = site.run(&what);
            assert!(ran.picture == picture, "{kept:?}, {what}: another picture");
            assert!(!ran.has_used_cache, "{kept:?}, {what}: it was used");
            assert!(kept == Kept::Truths || ran.warnings.is_empty(), "{kept:?}, {what}: {:?}", ran.warnings);
            match damage {
                Damage::Directory => assert!(file.is_dir(), "{kept:?}"),
                _ => assert!(fs::read(&file).is_ok_and(|bytes| bytes == whole), "{kept:?}, {what}: not mended"),
            }
            assert!(files(&site.cache()).len() <= 1, "{kept:?}, {what}: litter");
        }
    }
}

/// Wraps the command in private mounts, which no other process sees. Returns `None` if these are not permitted.
fn in_mounts(script: &str, arguments: &[&OsStr], command: &Command) -> Option<Command> {
    let mut unshare = Command::new("unshare");
    unshare.args(["-Urm", "sh", "-c"]);
    let probe = Command::new("unshare").args(["-Urm", "mount", "-t", "tmpfs", "none", "/tmp"]).output();
    if !probe.is_ok_and(|output| output.status.success()) {
        eprintln!("SKIPPED: full disks and read-only folders need mount namespaces, which are not permitted here");
        return None;
    }
    unshare.args([script, "sh"]);
    Some(wrap(unshare, arguments, command))
}

/// Makes `$1` a disk with the options of `$2` that keeps its content as far as it fits. Copies its final content to `$3`.
const FULL_DISK: &str = r#"
    set -e
    disk=$1 options=$2 left=$3
    shift 3
    old=$(mktemp -d)
    cp -a "$disk/." "$old"
    mount -t tmpfs -o "$options" none "$disk"
    cp -a "$old/." "$disk"
    status=0
    "$@" || status=$?
    cp -a "$disk/." "$left"
    rm -r "$old"
    exit $status"#;

/// `$1` becomes read-only.
const READ_ONLY: &str = r#"
    set -e
    mount --bind "$1" "$1"
    mount -o remount,bind,ro "$1"
    shift
    exec "$@""#;

/// Limits files to `$1` blocks of 512 bytes: writes fail, as on a full disk, but with EFBIG. For commands without a driver only: lavapipe of Mesa 25
/// then maps a file in memory for which there is no room, and dies of SIGBUS.
const SMALL_FILES: &str = r#"trap "" XFSZ; ulimit -f "$1"; shift; exec "$@""#;

#[test]
fn a_cache_on_a_full_disk_costs_a_warning_at_most() {
    for kept in CACHES {
        let site = Site::new(kept);
        let expected = site.run_with(Path::new(""), "no cache").picture;
        let check = |output: &Output, reason: &str, left: &Path| {
            let ran = site.ran(output, "picture.png", reason);
            assert!(ran.picture == expected, "{kept:?}: another picture");
            assert!(files(left).is_empty(), "{kept:?}: litter: {:?}", files(left).keys());
            let told = ran.warnings.iter().filter(|line| line.contains(reason)).count();
            assert_eq!(told, usize::from(kept == Kept::Truths), "{kept:?}: {:?}", ran.warnings);
        };
        let command = site.command("picture.png", &site.cache());
        if kept == Kept::Truths {
            let output = finish(start(in_shell(SMALL_FILES, &["32".as_ref()], &command)), "small files");
            check(&output, "File too large", &site.cache());
        }
        for (index, options) in ["size=64k", "nr_inodes=1"].into_iter().enumerate() {
            let left = site.path(&format!("left-{index}"));
            fs::create_dir(&left).expect("a folder");
            let cache = site.cache();
            let arguments: [&OsStr; 3] = [cache.as_os_str(), options.as_ref(), left.as_os_str()];
            let Some(command) = in_mounts(FULL_DISK, &arguments, &command) else { continue };
            check(&finish(start(command), options), "No space left on device", &left);
        }
    }
}

#[test]
fn a_cache_in_a_folder_that_cannot_be_written_costs_a_warning_at_most() {
    for kept in CACHES {
        let site = Site::new(kept);
        fs::write(site.path("file"), b"in place of a folder").expect("written");
        let expected = site.run_with(Path::new(""), "no cache").picture;
        // Places without a folder, in which no folder can be made: nobody, not even root, makes one in /proc.
        for cache in ["/proc/afterlight", "file", "file/below"] {
            let ran = site.run_with(Path::new(cache), cache);
            assert!(ran.picture == expected && !ran.has_used_cache, "{kept:?}, {cache}");
            assert_eq!(ran.warnings.len(), usize::from(kept == Kept::Truths), "{kept:?}, {cache}: {:?}", ran.warnings);
        }
        assert_eq!(fs::read(site.path("file")).expect("readable"), b"in place of a folder");
        // Read-only by permission, which root does not heed: root may write there or not.
        fs::set_permissions(site.cache(), fs::Permissions::from_mode(0o555)).expect("permissions");
        assert!(site.run("an empty folder without permission").picture == expected, "{kept:?}");
        fs::set_permissions(site.cache(), fs::Permissions::from_mode(0o755)).expect("permissions");
        for is_filled in [false, true] {
            if is_filled {
                site.run("a folder to be filled");
            } else {
                files(&site.cache()).into_keys().for_each(|file| fs::remove_file(file).expect("removed"));
            }
            let before = files(&site.cache());
            let command = site.command("picture.png", &site.cache());
            let Some(command) = in_mounts(READ_ONLY, &[site.cache().as_os_str()], &command) else { break };
            let ran = site.ran(&finish(start(command), "read-only"), "picture.png", "read-only");
            assert!(ran.picture == expected && ran.has_used_cache == is_filled, "{kept:?}: {ran:?}");
            let told = ran.warnings.iter().filter(|line| line.ends_with("Read-only file system (os error 30)")).count();
            assert_eq!(told, usize::from(kept == Kept::Truths && !is_filled), "{kept:?}: {:?}", ran.warnings);
            assert!(files(&site.cache()) == before, "{kept:?}");
        }
    }
}

#[test]
fn eight_processes_share_a_cache() {
    for kept in CACHES {
        let site = Site::new(kept);
        let expected = site.run_with(Path::new(""), "no cache").picture;
        let rounds = if tries_all() { 20 } else { 1 };
        for round in 0..rounds {
            files(&site.cache()).into_keys().for_each(|file| fs::remove_file(file).expect("removed"));
            for is_full in [false, true] {
                let picture = |index: usize| format!("picture-{index}.png");
                let children =
                    [0, 1, 2, 3, 4, 5, 6, 7].map(|index| start(site.command(&picture(index), &site.cache())));
                for (index, child) in children.into_iter().enumerate() {
                    let what = format!("process {index} of round {round}");
                    let ran = site.ran(&finish(child, &what), &picture(index), &what);
                    assert!(ran.picture == expected, "{kept:?}, {what}: another picture");
                    assert!(ran.warnings.is_empty(), "{kept:?}, {what}: {:?}", ran.warnings);
                    assert!(!is_full || ran.has_used_cache, "{kept:?}, {what}: a full cache is not used");
                }
                assert_eq!(files(&site.cache()).len(), 1, "{kept:?}: {:?}", files(&site.cache()).keys());
            }
        }
    }
}

#[test]
fn tune_measures_without_a_journal_that_it_cannot_open() {
    if !tries_all() {
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let run = |cache: &Path| {
        let mut command = program();
        command.current_dir(folder.path()).env("AFTERLIGHT_CACHE", cache).env("AFTERLIGHT_PIPELINE_CACHE", "");
        command.args(["tune", "builtin:triangle", "--size", "32x18", "--max-error", "0.1", "--quick", "--rounds", "6"]);
        command.args(["--truth-samples", "4", "--cameras", "0", "--joint", "0"]);
        let output = finish(start(command), "tune");
        let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.success() && !stderr.contains("error: "), "{stderr}");
        stderr
    };
    const TOLD: &str = "what is measured now is not kept";
    let cache = folder.path().join("cache");
    assert!(!run(&cache).contains(TOLD));
    let journals: Vec<PathBuf> = files(&cache).into_keys().filter(|file| file.ends_with("journal")).collect();
    let [journal] = &journals[..] else { panic!("not one journal: {journals:?}") };
    assert!(run(&cache).contains("goes on from an earlier run"));
    let whole = fs::read(journal).expect("readable");
    // Flipped and cut: tune goes on with the lines that it can read, or measures without the journal where it cannot read the first.
    for (_, damage) in damages(&whole, "journal", 4).into_iter().take(8) {
        damage.inflict(journal);
        run(&cache);
    }
    for damage in [Damage::Fifo, Damage::Directory] {
        damage.inflict(journal);
        assert!(run(&cache).contains(TOLD));
    }
    assert!(run(Path::new("/proc/afterlight")).contains(TOLD));
}

/// Commands and the file that each writes, of more than 8 KiB.
const RESULTS: [(&[&str], &str); 4] = [
    (&["render", SCENE, "--size", "64x36", "--samples", "1", "-o", "disk/out.exr"], "out.exr"),
    (&["reference", SCENE, "--size", "64x36", "--samples", "1", "-o", "disk/out.exr", "--no-cache"], "out.exr"),
    (&["inspect", SCENE, "--graph", "disk/out.svg"], "out.svg"),
    (&["stress", "formulas/fall-off", "--quick", "--html", "disk/out.html"], "out.html"),
];

#[test]
fn a_result_on_a_full_disk_is_an_error_and_the_old_file_stays() {
    let results = if tries_all() { &RESULTS[..] } else { &RESULTS[..2] };
    for (arguments, name) in results {
        let what = arguments[0];
        let folder = tempfile::tempdir().expect("a folder");
        let disk = folder.path().join("disk");
        fs::create_dir(&disk).expect("a folder");
        let mut command = program();
        command.current_dir(folder.path()).args(*arguments);
        command
            .env("AFTERLIGHT_PIPELINE_CACHE", "")
            .env("AFTERLIGHT_CACHE", "")
            .env("MESA_SHADER_CACHE_DISABLE", "true");
        let check = |output: &Output, reason: &str, left: &Path| {
            let stderr = String::from_utf8_lossy(&output.stderr);
            assert_eq!(output.status.code(), Some(3), "{what}: {stderr}");
            let errors: Vec<&str> = stderr.lines().filter(|line| line.starts_with("error: ")).collect();
            assert!(matches!(errors[..], [error] if error.contains(reason)), "{what}: {stderr}");
            let found: Vec<(PathBuf, Vec<u8>)> = files(left).into_iter().collect();
            assert_eq!(found, [(left.join(name), b"old".to_vec())], "{what}: {stderr}");
        };
        fs::write(disk.join(name), b"old").expect("written");
        if what == "reference" {
            let output = finish(start(in_shell(SMALL_FILES, &["16".as_ref()], &command)), what);
            check(&output, "File too large", &disk);
        }
        let left = folder.path().join("left");
        fs::create_dir(&left).expect("a folder");
        let arguments: [&OsStr; 3] = [disk.as_os_str(), "size=8k".as_ref(), left.as_os_str()];
        let Some(command) = in_mounts(FULL_DISK, &arguments, &command) else { continue };
        check(&finish(start(command), what), "No space left on device", &left);
    }
}
