//! Decides which calls fail, and how: told by `AFTERLIGHT_FAILURES`, or by a test in the same process.

use std::cell::Cell;
use std::collections::{BTreeMap, BTreeSet};
use std::ffi::CStr;
use std::fmt::Write as _;
use std::sync::{Mutex, MutexGuard, PoisonError};

use ash::vk;

use crate::{OF_THE_LOADER, PRE_INSTANCE, callbacks, commands, driver_cache};

/// The variable by which a program's calls are told to fail.
pub const VARIABLE: &str = "AFTERLIGHT_FAILURES";

/// The variable by which the loader takes the layer for an implicit one: `enable_environment` of the manifest in `vulkan/implicit_layer.d`.
const IMPLICIT: &str = "AFTERLIGHT_FAILURES_IMPLICIT";

/// A call that is to answer with something else than success.
#[derive(Clone, Copy, Debug)]
struct Told {
    command: &'static str,
    /// The number of the first call that may have the result, from 1: if that call cannot have it, the next that can does.
    nth: u64,
    result: (&'static str, vk::Result),
    done: bool,
}

/// Meaning of the variable's words.
#[derive(Debug, Default)]
pub struct Asked {
    told: Vec<Told>,
    allocations: Vec<u64>,
    /// Bytes that are added to pipeline caches.
    cache: Option<u64>,
    counts: bool,
    incoherent: bool,
}

impl Asked {
    /// Reads `COMMAND:N:RESULT`, `allocation:N`, `cache:N`, `incoherent` and `count`, with commas between.
    pub fn of(text: &str) -> Result<Asked, String> {
        let mut asked = Asked::default();
        for word in text.split(',').map(str::trim).filter(|word| !word.is_empty()) {
            let parts: Vec<&str> = word.split(':').collect();
            match parts[..] {
                ["count"] => asked.counts = true,
                ["incoherent"] => asked.incoherent = true,
                ["allocation", nth] => asked.allocations.push(number(nth)?),
                ["cache", bytes] => asked.cache = Some(number(bytes)?),
                [command, nth, result] => asked.told.push(told(command, number(nth)?, result)?),
                _ => {
                    return Err(format!(
                        "'{word}' is none of COMMAND:N:RESULT, allocation:N, cache:N, incoherent and count"
                    ));
                }
            }
        }
        Ok(asked)
    }
}

fn number(text: &str) -> Result<u64, String> {
    let number = text.parse().ok().filter(|number| *number > 0);
    number.ok_or_else(|| format!("'{text}' is no number of 1 or more"))
}

fn told(command: &str, nth: u64, result: &str) -> Result<Told, String> {
    let known = commands().find(|known| known.name == command && command != OF_THE_LOADER);
    let known = known.ok_or_else(|| format!("'{command}' is no command that this layer can let fail"))?;
    if PRE_INSTANCE.contains(&command) && std::env::var_os(IMPLICIT).is_none() {
        return Err(format!("'{command}' can fail only where this layer is implicit, with {IMPLICIT}=1"));
    }
    let short = result.strip_prefix("VK_").unwrap_or(result);
    let result = known.results().find(|(name, _)| *name == short).ok_or_else(|| {
        let names: Vec<&str> = known.results().map(|(name, _)| name).collect();
        format!("{command} never answers '{result}', but {}", names.join(", "))
    })?;
    Ok(Told { command: known.name, nth, result, done: false })
}

#[derive(Debug)]
struct State {
    told: Vec<Told>,
    calls: BTreeMap<&'static str, u64>,
    /// Devices that are lost, by the key of their handles.
    lost: BTreeSet<usize>,
    fired: u64,
    /// Told by the environment: then each failure is told on standard error, and with `counts` how often each command was called.
    aloud: bool,
    counts: bool,
    incoherent: bool,
}

static STATE: Mutex<State> = Mutex::new(State {
    told: Vec::new(),
    calls: BTreeMap::new(),
    lost: BTreeSet::new(),
    fired: 0,
    aloud: false,
    counts: false,
    incoherent: false,
});

fn state() -> MutexGuard<'static, State> {
    // A thread that panicked with the lock has changed the state wholly or not at all.
    STATE.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Reads the variable, once a process.
pub fn read_environment() -> Result<(), String> {
    static READ: Mutex<bool> = Mutex::new(false);
    let mut read = READ.lock().unwrap_or_else(PoisonError::into_inner);
    if *read {
        return Ok(());
    }
    if let Ok(text) = std::env::var(VARIABLE) {
        let asked = Asked::of(&text).map_err(|why| format!("{VARIABLE}: {why}"))?;
        let mut state = state();
        (state.aloud, state.counts) = (true, asked.counts);
        drop(state);
        add(asked);
    }
    *read = true;
    Ok(())
}

pub fn add(asked: Asked) {
    let mut state = state();
    state.told.extend(asked.told);
    state.counts |= asked.counts;
    state.incoherent |= asked.incoherent;
    asked.allocations.into_iter().for_each(callbacks::fail_at);
    if let Some(bytes) = asked.cache {
        driver_cache::add(usize::try_from(bytes).unwrap_or(usize::MAX));
    }
}

pub fn reset() {
    let mut state = state();
    (state.told, state.calls, state.lost, state.fired) = (Vec::new(), BTreeMap::new(), BTreeSet::new(), 0);
    state.incoherent = false;
}

/// Returns true if no memory is to seem coherent.
pub fn incoherent() -> bool {
    state().incoherent
}

/// A device that is made later may have the same key.
pub fn forget_device(key: usize) {
    state().lost.remove(&key);
}

pub fn fired() -> u64 {
    state().fired
}

pub fn calls(command: &str) -> u64 {
    state().calls.get(command).copied().unwrap_or_default()
}

thread_local! {
    /// The command that this thread is in, if the layer knows it.
    static WITHIN: Cell<Option<&'static CStr>> = const { Cell::new(None) };
}

/// Makes a call to the layers below in the name of a command.
pub fn within<T>(command: &'static CStr, call: impl FnOnce() -> T) -> T {
    let before = WITHIN.replace(Some(command));
    let result = call();
    WITHIN.set(before);
    result
}

/// The command that this thread is in.
pub fn command() -> Option<&'static CStr> {
    WITHIN.get()
}

/// Says something to the user, where the environment says which calls fail.
pub fn say(text: &str) {
    if state().aloud {
        eprintln!("VK_LAYER_AFTERLIGHT_failures: {text}");
    }
}

/// Says how often each command was called, where the environment asks for it.
pub fn say_counts() {
    let state = state();
    if !state.counts {
        return;
    }
    let mut text = String::new();
    for (command, calls) in &state.calls {
        let _ = writeln!(text, "{calls:8} {command}");
    }
    eprint!(
        "VK_LAYER_AFTERLIGHT_failures: calls until an instance was destroyed\n{text}{:8} allocation\n",
        callbacks::asked_for()
    );
}

/// The fate of a call.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CallFate {
    /// It is made as ever.
    Pass,
    /// It is not made.
    Instead(vk::Result),
    /// It is made, and if it succeeds, this is its result.
    After(vk::Result),
    /// It is made with room for one element less.
    Shortened,
    /// It is not made: the device is lost, now or since an earlier call.
    Lost { now: bool },
}

/// Counts a call and decides its fate. `device` is the key of its device, if it has one; `has_list` is true if the call asks for elements of a list,
/// and not only for their number.
pub fn decide(command: &'static str, device: Option<usize>, has_list: bool) -> CallFate {
    let mut state = state();
    let calls = state.calls.entry(command).or_default();
    *calls += 1;
    let calls = *calls;
    let can_be_lost = || {
        commands().any(|own| own.name == command && own.errors.iter().any(|own| own.1 == vk::Result::ERROR_DEVICE_LOST))
    };
    if device.is_some_and(|device| state.lost.contains(&device)) && can_be_lost() {
        return CallFate::Lost { now: false };
    }
    let is_it = |told: &&mut Told| {
        let is_due = told.command == command && !told.done && calls >= told.nth;
        is_due && (told.result.1 != vk::Result::INCOMPLETE || has_list)
    };
    let Some(told) = state.told.iter_mut().find(is_it) else { return CallFate::Pass };
    told.done = true;
    let (name, result) = told.result;
    state.fired += 1;
    let answer = match (result, device) {
        (vk::Result::ERROR_DEVICE_LOST, Some(device)) => {
            state.lost.insert(device);
            CallFate::Lost { now: true }
        }
        (vk::Result::INCOMPLETE, _) => CallFate::Shortened,
        _ if comes_after(command, result) => CallFate::After(result),
        _ => CallFate::Instead(result),
    };
    drop(state);
    say(&format!("{command}, call {calls}: {name}"));
    answer
}

/// Returns true if a command has done its work when it gives this result. An image that cannot be shown any more is still presented: the wait for its
/// semaphore takes place (specification, vkQueuePresentKHR).
fn comes_after(command: &str, result: vk::Result) -> bool {
    let of_surface = [vk::Result::ERROR_OUT_OF_DATE_KHR, vk::Result::ERROR_SURFACE_LOST_KHR];
    result == vk::Result::SUBOPTIMAL_KHR || command == "vkQueuePresentKHR" && of_surface.contains(&result)
}
