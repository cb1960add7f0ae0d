//! Each case in turn, in a child that may die of it.

use std::collections::{BTreeMap, BTreeSet};
use std::env;
use std::fs;
use std::io::{BufRead, BufReader, Write as _};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::process::{Child, Stdio};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::thread;
use std::time::Duration;

use afterlight::frame::{self, Picture};
use afterlight::gpu::{self, Device, Message, MessageLog, vk};
use afterlight_failures_layer::{Command, commands};

use super::layer::{Layer, child_of};
use super::play::{Play, PlayStage};
use crate::common::failures_layer::{environment, folder, implicit_environment};
use crate::common::tries_all;

/// The longest time of a case, with layers on: a case that takes longer hangs.
const HANGS: Duration = Duration::from_secs(10);
/// The longest time of a child that starts and draws all of it twice.
const STARTS: Duration = Duration::from_secs(120);

/// The number of the case that a child begins with.
const FROM: &str = "AFTERLIGHT_FAILURES_FROM";
/// Environment variable: the kind of cases that a child plays, `commands` or `allocations`.
const KIND: &str = "AFTERLIGHT_FAILURES_KIND";

/// The words before the command in which an allocation was refused, in the layer's lines and in cases.
const IN: &str = " is refused in ";
/// Stands for commands that cannot fail, such as recording commands, and for a driver's own setup.
const NO_COMMAND: &str = "a command that cannot fail";

/// The file that takes a child's standard error, in the folder of its layer.
const ERRORS: &str = "errors";

/// A call that fails.
#[derive(Clone, Debug)]
struct Case {
    command: &'static str,
    result: &'static str,
    code: vk::Result,
    nth: u64,
    stage: PlayStage,
}

impl Case {
    fn words(&self) -> String {
        if self.command == ALLOCATION {
            return format!("{ALLOCATION}:{}", self.nth);
        }
        let words = format!("{}:{}:{}", self.command, self.nth, self.result);
        if OF_INCOHERENT_MEMORY.contains(&self.command) { format!("{INCOHERENT},{words}") } else { words }
    }
}

const ALLOCATION: &str = "allocation";

/// Commands that are called only where memory is not coherent, and the layer's word for such memory.
const OF_INCOHERENT_MEMORY: [&str; 2] = ["vkFlushMappedMemoryRanges", "vkInvalidateMappedMemoryRanges"];
const INCOHERENT: &str = "incoherent";

/// Commands that are called more often where the GPU is slower: a fence that is not signalled yet is asked again, and cannot be reused.
const OF_FENCES: [&str; 2] = ["vkCreateFence", "vkGetFenceStatus"];

/// Tells the fault of a case whose call has a higher number than the last one.
const NEVER_MADE: &str = "the call was never made";

/// The outcome of a case that passed.
enum Passed {
    /// The program ended with this error.
    Failed(String),
    /// The program went on and drew the usual pictures.
    WentOn,
}

/// Calls of each command by the end of a stage.
type Counts = BTreeMap<&'static str, u64>;

/// A run without any failure, which cases are held against.
struct Dry {
    order: Vec<(PlayStage, Counts)>,
    pictures: Vec<Picture>,
    /// Allocations of host memory that the driver never gives back.
    leaked: i64,
}

struct Stand {
    play: Play,
    layer: Layer,
}

impl Stand {
    fn counts(&self) -> Counts {
        let mut counts: Counts = commands().map(|command| (command.name, self.layer.calls(command.name))).collect();
        counts.insert(ALLOCATION, self.layer.allocations());
        counts
    }

    /// Plays with these words of the layer, by which no call fails.
    fn dry(&self, words: &str) -> Dry {
        self.layer.reset();
        self.layer.tell(words);
        let before = self.layer.live_allocations();
        let mut order = vec![];
        let device = self.play.start().unwrap_or_else(|error| panic!("{error}"));
        order.push((PlayStage::StartUp, self.counts()));
        let pictures = self.play.draw(&device, &mut |stage| order.push((stage, self.counts())));
        let pictures = pictures.unwrap_or_else(|error| panic!("{error}"));
        drop(device);
        order.push((PlayStage::Shutdown, self.counts()));
        Dry { order, pictures, leaked: self.layer.live_allocations() - before }
    }
}

impl Dry {
    /// Adds the calls of commands that only another run has made.
    fn with_calls_of(mut self, commands: &[&str], other: &Dry) -> Dry {
        for ((_, own), (_, other)) in self.order.iter_mut().zip(&other.order) {
            own.extend(other.iter().filter(|(command, _)| commands.contains(command)));
        }
        self
    }

    /// The calls of a command in each stage: the number of the first and of the last.
    fn calls(&self, command: &str) -> Vec<(PlayStage, u64, u64)> {
        let mut before = 0;
        let mut calls = Vec::new();
        for (stage, counts) in &self.order {
            let after = counts.get(command).copied().unwrap_or_default();
            if after > before {
                calls.push((*stage, before + 1, after));
            }
            before = after;
        }
        calls
    }

    /// All cases: each result of each command at its first, middle and last call of each stage.
    fn all(&self) -> Vec<Case> {
        let mut cases = Vec::new();
        for command in commands() {
            for (result, code) in command.results() {
                for (stage, first, last) in self.calls(command.name) {
                    let mut numbers = vec![first, first.midpoint(last), last];
                    numbers.dedup();
                    let case = |nth| Case { command: command.name, result, code, nth, stage };
                    cases.extend(numbers.into_iter().map(case));
                }
            }
        }
        cases
    }

    /// Each command once, at the middle call of all, with one of its results in turn.
    fn some(&self) -> Vec<Case> {
        let mut cases = Vec::new();
        for (turn, command) in commands().enumerate() {
            let calls = self.calls(command.name);
            let results: Vec<_> = command.results().collect();
            let (result, code) = results[turn % results.len()];
            let Some(&(_, _, last)) = calls.last() else { continue };
            let nth = last.div_ceil(2);
            let stage = calls
                .iter()
                .find(|(_, first, last)| (*first..=*last).contains(&nth))
                .map_or(PlayStage::StartUp, |own| own.0);
            cases.push(Case { command: command.name, result, code, nth, stage });
        }
        cases
    }

    /// Returns cases for allocations of host memory: every n-th of several thousand; in `make test` five of them.
    fn allocations(&self) -> Vec<Case> {
        let calls = self.calls(ALLOCATION);
        let case = |nth, stage| Case {
            command: ALLOCATION,
            result: "ERROR_OUT_OF_HOST_MEMORY",
            code: vk::Result::ERROR_OUT_OF_HOST_MEMORY,
            nth,
            stage,
        };
        let count = calls.last().map_or(0, |own| own.2);
        let most = if tries_all() { 1000 } else { 5 };
        let every = usize::try_from(count.div_ceil(most)).unwrap_or(1).max(1);
        let all = calls.iter().flat_map(|&(stage, first, last)| (first..=last).map(move |nth| case(nth, stage)));
        all.step_by(every).collect()
    }
}

/// The outcome of a whole play, and its device where one was opened.
struct Played {
    device: Option<Arc<Device>>,
    outcome: Result<Vec<Picture>, frame::Error>,
}

fn play(stand: &Stand) -> Played {
    match stand.play.start() {
        Err(error) => Played { device: None, outcome: Err(error.into()) },
        Ok(device) => {
            let outcome = stand.play.draw(&device, &mut |_| {});
            Played { device: Some(device), outcome }
        }
    }
}

/// Plays a case. The error names the fault of its outcome.
fn judge(stand: &Stand, dry: &Dry, case: &Case) -> Result<Passed, String> {
    stand.layer.reset();
    let before = stand.layer.live_allocations();
    stand.layer.tell(&case.words());
    let played = catch_unwind(AssertUnwindSafe(|| play(stand))).map_err(|cause| panicked(&*cause))?;
    let Played { device, outcome } = played;
    let log = device.as_ref().map(|device| device.instance.message_log());
    let lost = matches!(&outcome, Err(frame::Error::Gpu(gpu::Error::DeviceLost { .. })));
    let at_shutdown = case.stage == PlayStage::Shutdown;
    if !at_shutdown && stand.layer.fired() == 0 {
        return Err(NEVER_MADE.into());
    }
    let passed = match &outcome {
        Err(error) => {
            check_error(case, error)?;
            Passed::Failed(error.to_string())
        }
        Ok(pictures) if *pictures == dry.pictures => Passed::WentOn,
        Ok(_) => return Err("it goes on, and draws something else".into()),
    };
    let failed = outcome.is_err();
    drop(outcome);
    // The next renderer: on this device, unless it is lost or was never there.
    let dropped = catch_unwind(AssertUnwindSafe(|| -> Result<(), String> {
        if let Some(device) = device {
            if failed && !lost {
                same(dry, stand.play.draw(&device, &mut |_| {}), "the next renderer on the device")?;
            }
            let live = device.live_objects();
            if !live.is_empty() {
                return Err(format!("objects are left: {live:?}"));
            }
        }
        if at_shutdown && stand.layer.fired() == 0 {
            return Err(NEVER_MADE.into());
        }
        let leaked = stand.layer.live_allocations() - before;
        // A failed case draws a second time, so the driver may keep twice as much. After a refused allocation every object is destroyed all the same,
        // and the driver's own leftovers are not counted.
        if case.command != ALLOCATION && leaked > if failed { 2 * dry.leaked } else { dry.leaked } {
            return Err(format!("{leaked} allocations of host memory are left, and {} after any play", dry.leaked));
        }
        Ok(())
    }));
    dropped.map_err(|cause| panicked(&*cause))??;
    check_messages(log.as_deref())?;
    if failed && (lost || case.stage == PlayStage::StartUp) {
        let again = play(stand);
        same(dry, again.outcome, "the next renderer")?;
    }
    Ok(passed)
}

fn same(dry: &Dry, pictures: Result<Vec<Picture>, frame::Error>, what: &str) -> Result<(), String> {
    match pictures {
        Err(error) => Err(format!("{what} fails: {error}")),
        Ok(pictures) if pictures == dry.pictures => Ok(()),
        Ok(_) => Err(format!("{what} draws something else")),
    }
}

fn panicked(cause: &(dyn std::any::Any + Send)) -> String {
    let text = cause.downcast_ref::<String>().map(String::as_str).or_else(|| cause.downcast_ref::<&str>().copied());
    format!("it panics: {}", text.unwrap_or("without a text"))
}

/// Fails on any message of this program or of a layer below it, leaks included.
pub fn check_messages(log: Option<&MessageLog>) -> Result<(), String> {
    let Some(log) = log else { return Ok(()) };
    let ours: Vec<String> =
        log.take().into_iter().filter(Message::is_about_this_program).map(|message| message.text).collect();
    if ours.is_empty() { Ok(()) } else { Err(format!("messages: {}", ours.join(" / ")).replace('\n', " ")) }
}

/// Commands whose object has no name, or none yet when they fail.
const NAMELESS: [&str; 23] = [
    "vkAcquireNextImageKHR",
    "vkCreateDebugUtilsMessengerEXT",
    "vkCreateHeadlessSurfaceEXT",
    "vkCreateInstance",
    "vkCreateSwapchainKHR",
    "vkDeviceWaitIdle",
    "vkEnumeratePhysicalDevices",
    "vkGetFenceStatus",
    "vkGetPhysicalDeviceImageFormatProperties",
    "vkGetPhysicalDeviceSurfaceCapabilitiesKHR",
    "vkGetPhysicalDeviceSurfaceFormatsKHR",
    "vkGetPhysicalDeviceSurfacePresentModesKHR",
    "vkGetSwapchainImagesKHR",
    "vkQueuePresentKHR",
    "vkQueueSubmit",
    "vkQueueSubmit2",
    "vkResetFences",
    "vkCreateFence",
    "vkWaitForFences",
    "vkEnumerateDeviceExtensionProperties",
    "vkEnumerateInstanceVersion",
    "vkEnumerateInstanceLayerProperties",
    "vkEnumerateInstanceExtensionProperties",
];

/// Checks an error: one line that names the command and the object, of the kind that the result calls for.
fn check_error(case: &Case, error: &frame::Error) -> Result<(), String> {
    let text = error.to_string();
    let fail = |why: &str| Err(format!("{why}: '{text}' ({error:?})"));
    if text.contains('\n') {
        return fail("not one line");
    }
    let frame::Error::Gpu(error) = error else { return fail("not an error of gpu") };
    use gpu::Error::{DeviceLost, MissingLayer, NoDriver, OutOfMemory, Unsupported, Vulkan};
    let of_memory = [
        vk::Result::ERROR_OUT_OF_HOST_MEMORY,
        vk::Result::ERROR_OUT_OF_DEVICE_MEMORY,
        vk::Result::ERROR_OUT_OF_POOL_MEMORY,
    ];
    let is_kind = match error {
        _ if case.command == ALLOCATION => matches!(error, OutOfMemory { .. } | Vulkan { .. } | NoDriver { .. }),
        OutOfMemory { .. } => of_memory.contains(&case.code),
        DeviceLost { .. } => case.code == vk::Result::ERROR_DEVICE_LOST,
        Vulkan { result, .. } => *result == case.code,
        // These say what to install.
        NoDriver { .. } => {
            let of_the_system = [vk::Result::ERROR_INCOMPATIBLE_DRIVER, vk::Result::ERROR_INITIALIZATION_FAILED];
            return if of_the_system.contains(&case.code) { Ok(()) } else { fail("another kind of error") };
        }
        MissingLayer { .. } => {
            return if case.code == vk::Result::ERROR_LAYER_NOT_PRESENT {
                Ok(())
            } else {
                fail("another kind of error")
            };
        }
        Unsupported(_) => {
            return if case.code == vk::Result::ERROR_FORMAT_NOT_SUPPORTED {
                Ok(())
            } else {
                fail("another kind of error")
            };
        }
        _ => false,
    };
    if !is_kind {
        return fail("another kind of error");
    }
    // Where no caller can be told that the device is lost, such as when a swapchain is dropped, the next command tells. Loaders list extensions as
    // they open a device, so the error names vkCreateDevice.
    let is_lost = matches!(error, DeviceLost { .. }) && commands().any(|own| text.contains(own.name));
    let is_of_the_loader = case.command == "vkEnumerateDeviceExtensionProperties" && text.contains("by vkCreateDevice");
    let is_told_later = is_lost || is_of_the_loader;
    if case.command != ALLOCATION && !text.contains(case.command) && !is_told_later {
        return fail("it does not name the command");
    }
    if is_told_later {
        return Ok(());
    }
    if case.command != ALLOCATION && !NAMELESS.contains(&case.command) && !text.contains('\'') {
        return fail("it does not name the object");
    }
    Ok(())
}

/// Plays the cases of a kind. The tests below start it as a separate process.
#[test]
#[ignore = "a child of the tests of failures"]
fn child() {
    let Ok(kind) = env::var(KIND) else { return };
    let from: usize = env::var(FROM).ok().and_then(|from| from.parse().ok()).unwrap_or_default();
    let play = if kind == "allocations" { Play::bare() } else { Play::whole() };
    let stand = Stand { play, layer: Layer::of_this_process() };
    // The first writes the file of the pipeline cache, which later ones find.
    stand.dry("");
    let mut dry = stand.dry("");
    if kind != "allocations" {
        let incoherent = stand.dry(INCOHERENT);
        assert!(incoherent.pictures == dry.pictures, "another picture where memory is not coherent");
        dry = dry.with_calls_of(&OF_INCOHERENT_MEMORY, &incoherent);
    }
    let cases = match kind.as_str() {
        "allocations" => dry.allocations(),
        _ if tries_all() => dry.all(),
        _ => dry.some(),
    };
    for (index, case) in cases.iter().enumerate().skip(from) {
        say(&format!("begin\t{index}\t{}\t{}\t{}\t{}", case.command, case.result, case.nth, case.stage));
        let mut judged = judge(&stand, &dry, case);
        if OF_FENCES.contains(&case.command) && judged.as_ref().is_err_and(|why| why == NEVER_MADE) {
            // The GPU was faster than in the dry run: the last call that it needed fails.
            let nth = stand.layer.calls(case.command).min(case.nth - 1).max(1);
            judged = judge(&stand, &dry, &Case { nth, ..case.clone() });
        }
        match judged {
            Ok(Passed::Failed(text)) => say(&format!("failed\t{index}\t{text}")),
            Ok(Passed::WentOn) => say(&format!("went on\t{index}\t")),
            Err(why) if case.command == ALLOCATION => {
                let place = stand.layer.refused_in().unwrap_or_else(|| NO_COMMAND.to_owned());
                say(&format!("wrong\t{index}\t{why}{IN}{place}"));
            }
            Err(why) => say(&format!("wrong\t{index}\t{why}")),
        }
    }
    say("end");
}

fn say(line: &str) {
    let mut out = std::io::stdout().lock();
    let _ = writeln!(out, "failures:\t{line}");
    let _ = out.flush();
}

/// A case with its outcome.
#[derive(Clone, Debug)]
struct CallResult {
    command: String,
    result: String,
    nth: u64,
    stage: String,
    wrong: Option<String>,
    went_on: bool,
    text: String,
}

struct Running {
    process: Child,
    lines: Receiver<String>,
}

fn start(kind: &str, from: usize, layers: &tempfile::TempDir) -> Running {
    // An implicit layer is asked for commands without an instance, too.
    let environment = if kind == "allocations" { environment } else { implicit_environment };
    let mut command = child_of("failures::cases::child", environment(layers.path()));
    command.env(KIND, kind).env(FROM, from.to_string());
    command.env("AFTERLIGHT_PIPELINE_CACHE", layers.path().join("pipelines"));
    command.stdout(Stdio::piped()).stderr(fs::File::create(layers.path().join(ERRORS)).expect("a file"));
    let mut process = command.spawn().expect("it starts");
    let out = BufReader::new(process.stdout.take().expect("piped"));
    let (sender, lines) = channel();
    thread::spawn(move || {
        for line in out.lines().map_while(Result::ok) {
            // libtest writes the name of the test before the first line.
            if let Some(at) = line.find("failures:\t") {
                let _ = sender.send(line[at + "failures:\t".len()..].to_owned());
            }
        }
    });
    Running { process, lines }
}

/// Plays all cases of a kind, in as many children as it takes.
fn verdicts(kind: &str) -> Vec<CallResult> {
    let layers = folder();
    let (mut verdicts, mut from) = (Vec::<CallResult>::new(), 0);
    loop {
        let Running { mut process, lines } = start(kind, from, &layers);
        let mut begun = false;
        let mut patience = STARTS;
        let why = loop {
            match lines.recv_timeout(patience) {
                Ok(line) if line == "end" => {
                    let _ = process.wait();
                    return verdicts;
                }
                Ok(line) => {
                    let parts: Vec<&str> = line.split('\t').collect();
                    match parts[..] {
                        ["begin", index, command, result, nth, stage] => {
                            (begun, patience, from) = (true, HANGS, index.parse::<usize>().expect("a number") + 1);
                            verdicts.push(CallResult {
                                command: command.into(),
                                result: result.into(),
                                nth: nth.parse().expect("a number"),
                                stage: stage.into(),
                                wrong: None,
                                went_on: false,
                                text: String::new(),
                            });
                        }
                        [what, _, ref text @ ..] => {
                            let last = verdicts.last_mut().expect("a case has begun");
                            let text = text.join(" ");
                            match what {
                                "wrong" => last.wrong = Some(text),
                                "went on" => last.went_on = true,
                                _ => last.text = text,
                            }
                            begun = false;
                        }
                        _ => panic!("the child says '{line}'"),
                    }
                }
                Err(RecvTimeoutError::Timeout) => {
                    let _ = process.kill();
                    let _ = process.wait();
                    break "it hangs".to_owned();
                }
                Err(RecvTimeoutError::Disconnected) => {
                    let status = process.wait().expect("it was started");
                    break format!("the process ends: {status}");
                }
            }
        };
        let errors = fs::read_to_string(layers.path().join(ERRORS)).unwrap_or_default();
        assert!(begun, "between two cases, after {:?}: {why}\n{errors}", verdicts.last());
        let place = errors
            .rsplit_once(IN)
            .map_or(String::new(), |(_, place)| format!("{IN}{}", place.lines().next().unwrap_or_default()));
        verdicts.last_mut().expect("a case has begun").wrong = Some(why + &place);
    }
}

fn hold(verdicts: &[CallResult]) {
    let wrong: Vec<String> = verdicts
        .iter()
        .filter_map(|own| {
            let CallResult { command, result, nth, stage, .. } = own;
            Some(format!("{command}:{nth}:{result} ({stage}): {}", own.wrong.as_ref()?))
        })
        .collect();
    assert!(wrong.is_empty(), "{} of {} cases:\n{}", wrong.len(), verdicts.len(), wrong.join("\n"));
    assert!(!verdicts.is_empty());
}

#[test]
fn every_call_that_fails_is_an_error_that_names_it_and_the_next_renderer_draws_the_same() {
    let verdicts = verdicts("commands");
    hold(&verdicts);
    if tries_all() && super::blesses() {
        write_table(&verdicts);
    }
}

/// Commands of the program's windows, which their own tests let fail: `window view::failures`.
pub const OF_WINDOWS: [&str; 2] = ["vkCreateXlibSurfaceKHR", "vkCreateWaylandSurfaceKHR"];

/// Writes the table of docs/FAILURES.md anew.
fn write_table(verdicts: &[CallResult]) {
    let name = super::project().join("docs/FAILURES.md");
    let text = fs::read_to_string(&name).expect("the document");
    let start = text.find("| Command | Results |").expect("a table");
    let length = text[start..].find("\n\n").map_or(text.len() - start, |end| end + 1);
    fs::write(name, format!("{}{}{}", &text[..start], table(verdicts), &text[start + length..]))
        .expect("it can be written");
}

/// A row for each command.
fn table(verdicts: &[CallResult]) -> String {
    let mut by_command: BTreeMap<&str, Vec<&CallResult>> = BTreeMap::new();
    for own in verdicts {
        by_command.entry(&own.command).or_default().push(own);
    }
    let mut text = String::from("| Command | Results | Stages | Cases | The program |\n|---|---|---|---|---|\n");
    let passed = |own: &[&CallResult]| own.iter().filter(|own| own.wrong.is_none()).count();
    let (mut pairs, mut passed_pairs) = (0, 0);
    for (command, own) in &by_command {
        let results: BTreeSet<&str> = own.iter().map(|own| own.result.as_str()).collect();
        pairs += results.len();
        passed_pairs +=
            results.iter().filter(|&&result| own.iter().all(|own| own.result != result || own.wrong.is_none())).count();
        let mut stages: Vec<&str> = own.iter().map(|own| own.stage.as_str()).collect();
        stages.sort_unstable_by_key(|stage| PlayStage::ALL.iter().position(|own| own.to_string() == *stage));
        stages.dedup();
        let went_on = own.iter().filter(|own| own.went_on).count();
        let does = match went_on {
            0 => "ends with an error".to_owned(),
            all if all == own.len() => "goes on".to_owned(),
            some => format!("ends with an error; goes on in {some}"),
        };
        let results: Vec<&str> = results.into_iter().collect();
        text += &format!(
            "| `{command}` | {} | {} | {} of {} | {does} |\n",
            results.join(", "),
            stages.join(", "),
            passed(own),
            own.len()
        );
    }
    let all: Vec<&CallResult> = verdicts.iter().collect();
    text += &format!(
        "| {} commands | {passed_pairs} of {pairs} pairs | | {} of {} | |\n",
        by_command.len(),
        passed(&all),
        all.len()
    );
    let (of_windows, never): (Vec<&Command>, Vec<&Command>) = commands()
        .filter(|command| !by_command.contains_key(command.name))
        .partition(|command| OF_WINDOWS.contains(&command.name));
    let pairs: usize = of_windows.iter().map(|command| command.results().count()).sum();
    let named = |commands: &[&Command]| commands.iter().map(|own| own.name).collect::<Vec<_>>().join(", ");
    text += &format!(
        "| by windows: `window view::failures` | {} | | {pairs} of {pairs} | ends with an error |\n",
        named(&of_windows)
    );
    text + &format!("| never called | {} | | | |\n", named(&never))
}

/// Commands in which lavapipe does not survive a refused allocation, or silently draws something else. docs/FAILURES.md has the smallest cases.
const FENCED: [&str; 2] = [NO_COMMAND, "vkCreatePipelineLayout"];

#[test]
fn every_allocation_of_host_memory_that_fails_is_an_error_and_the_next_renderer_draws_the_same() {
    let verdicts = verdicts("allocations");
    let is_fenced = |own: &CallResult| {
        own.wrong.as_ref().is_some_and(|why| FENCED.iter().any(|place| why.ends_with(&format!("{IN}{place}"))))
    };
    let (fenced, others): (Vec<CallResult>, Vec<CallResult>) = verdicts.into_iter().partition(is_fenced);
    eprintln!("{} allocations: {} are fenced", others.len() + fenced.len(), fenced.len());
    hold(&others);
}
