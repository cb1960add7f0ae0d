//! Messages of the loader, the layers and this module, collected so that the caller can print them or fail on them.

use std::borrow::Cow;
use std::ffi::{CStr, c_char, c_void};
use std::fmt;
use std::fs::File;
use std::io::Write as _;
use std::sync::{Mutex, MutexGuard, PoisonError};

use ash::vk;

/// The severity of a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Severity {
    /// Probably a mistake.
    Warning,
    /// A mistake.
    Error,
}

/// The source of a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum MessageKind {
    /// The loader, a driver or a layer, about the system rather than about this program.
    General,
    /// A validation layer: this program breaks the specification.
    Validation,
    /// A layer's advice on speed.
    Performance,
    /// This module: an object or an allocation that outlived its device.
    Leak,
}

/// One message of a layer, the loader, a driver or this module.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Message {
    /// The severity.
    pub severity: Severity,
    /// The source.
    pub kind: MessageKind,
    /// The rule's name, as `VUID-vkCmdDraw-None-02697`; may be empty.
    pub id_name: String,
    /// The names of the objects that the message is about; objects without a name are left out.
    pub objects: Vec<String>,
    /// The whole text, possibly of several lines.
    pub text: String,
}

impl Message {
    /// Returns true if this program has made a mistake, or might have: it is not about the system.
    pub fn is_about_this_program(&self) -> bool {
        self.kind != MessageKind::General
    }

    /// Returns true if it is advice, on best practices or on functions that newer ones replace, about uses that are allowed. Layers give advice the kinds of mistakes, and tell it apart by
    /// name only.
    pub fn is_advice(&self) -> bool {
        let is_of = |start: &&str| self.id_name.starts_with(start);
        self.severity == Severity::Warning && (self.id_name.contains("BestPractices") || LEGACY.iter().any(is_of))
    }
}

impl fmt::Display for Message {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { severity, kind, id_name, text, .. } = self;
        write!(f, "{severity:?} ({kind:?}) {id_name}: {text}")
    }
}

/// The ids of messages that a layer has about itself: shaders whose many checks take long, settings of the environment in a form that newer ones replace,
/// checks on the GPU that the device does not allow (the second id since 1.4.310 at the earliest), and the file in which it keeps the shaders that it has
/// checked.
const OF_THE_LAYER_ITSELF: [&str; 8] = [
    "GPUAV-Compile-time-general-buffer",
    "VALIDATION-SETTINGS",
    "WARNING-GPU-Assisted-Validation",
    "WARNING-Setting-Limit-Adjusted",
    "WARNING-cache-file-error",
    "WARNING-cache-memory-error",
    "WARNING-cache-retrieval-error",
    "WARNING-cache-write-error",
];

/// How the ids of advice begin that is about other functions for the same work.
const LEGACY: [&str; 2] = ["WARNING-legacy-", "WARNING-deprecation-"];

/// The messages kept; later ones are counted only. A frame loop with one mistake in it would otherwise eat the memory.
const KEPT_MESSAGES: usize = 4096;

/// A bounded list of messages, shared by an instance with its messenger. Outlives the instance while someone holds it.
#[derive(Debug, Default)]
pub struct MessageLog {
    state: Mutex<LogState>,
}

#[derive(Debug, Default)]
struct LogState {
    kept: Vec<Message>,
    dropped: u64,
    file: Option<File>,
}

impl MessageLog {
    /// The messages so far, oldest first, which are then forgotten.
    pub fn take(&self) -> Vec<Message> {
        let mut state = self.lock();
        state.dropped = 0;
        std::mem::take(&mut state.kept)
    }

    /// The messages after the first `count`, which stay in the list.
    pub fn since(&self, count: usize) -> Vec<Message> {
        self.lock().kept.get(count..).unwrap_or_default().to_vec()
    }

    /// The number of messages that came after the list was full, since the last [`take`](MessageLog::take).
    pub fn dropped(&self) -> u64 {
        self.lock().dropped
    }

    /// Appends the kept messages to a file, then each further one as it comes, so that they survive a crash of the process. `None` ends it.
    pub fn tell_to(&self, file: Option<File>) {
        let mut state = self.lock();
        state.file = file;
        let LogState { kept, file, .. } = &mut *state;
        kept.iter().for_each(|message| append(file, message));
    }

    /// Adds a message, or counts it if the list is full.
    pub fn push(&self, message: Message) {
        let mut state = self.lock();
        if state.kept.len() < KEPT_MESSAGES {
            append(&mut state.file, &message);
            state.kept.push(message);
        } else {
            state.dropped += 1;
        }
    }

    fn lock(&self) -> MutexGuard<'_, LogState> {
        // A list of finished messages is whole even if a thread died while it held the lock.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Writes a paragraph at once. A file that cannot be written is no reason to stop.
fn append(file: &mut Option<File>, message: &Message) {
    if let Some(file) = file {
        let _ = file.write_all(format!("{message}\n").as_bytes());
    }
}

/// The messenger for warnings and errors of every kind that pushes into `log`, which must outlive it.
pub(super) fn messenger_info(log: &MessageLog) -> vk::DebugUtilsMessengerCreateInfoEXT<'static> {
    vk::DebugUtilsMessengerCreateInfoEXT::default()
        .message_severity(vk::DebugUtilsMessageSeverityFlagsEXT::WARNING | vk::DebugUtilsMessageSeverityFlagsEXT::ERROR)
        .message_type(
            vk::DebugUtilsMessageTypeFlagsEXT::GENERAL
                | vk::DebugUtilsMessageTypeFlagsEXT::VALIDATION
                | vk::DebugUtilsMessageTypeFlagsEXT::PERFORMANCE,
        )
        .pfn_user_callback(Some(collect))
        .user_data(std::ptr::from_ref(log).cast_mut().cast())
}

/// The callback that Vulkan calls, on any thread. Never panics: it would abort the program.
unsafe extern "system" fn collect(
    severity: vk::DebugUtilsMessageSeverityFlagsEXT,
    types: vk::DebugUtilsMessageTypeFlagsEXT,
    data: *const vk::DebugUtilsMessengerCallbackDataEXT<'_>,
    log: *mut c_void,
) -> vk::Bool32 {
    // SAFETY: Vulkan passes callback data that is valid for the call, and `messenger_info` set a log that outlives the
    // messenger; the log is only ever shared.
    let (data, log) = unsafe { (data.as_ref(), log.cast::<MessageLog>().cast_const().as_ref()) };
    if let (Some(data), Some(log)) = (data, log) {
        let id_name = text_of(data.p_message_id_name);
        let kind = if OF_THE_LAYER_ITSELF.contains(&&*id_name) {
            MessageKind::General
        } else if types.contains(vk::DebugUtilsMessageTypeFlagsEXT::VALIDATION) {
            MessageKind::Validation
        } else if types.contains(vk::DebugUtilsMessageTypeFlagsEXT::PERFORMANCE) {
            MessageKind::Performance
        } else {
            MessageKind::General
        };
        let is_error = severity.contains(vk::DebugUtilsMessageSeverityFlagsEXT::ERROR);
        log.push(Message {
            severity: if is_error { Severity::Error } else { Severity::Warning },
            kind,
            id_name: id_name.into_owned(),
            objects: names_of(data),
            text: text_of(data.p_message).into_owned(),
        });
    }
    // TRUE would make the offending call fail, and the program behave differently under validation.
    vk::FALSE
}

fn names_of(data: &vk::DebugUtilsMessengerCallbackDataEXT<'_>) -> Vec<String> {
    if data.p_objects.is_null() {
        return Vec::new();
    }
    // SAFETY: not null, and Vulkan's array has as many elements as it says and lives as long as the callback's data.
    let objects = unsafe { std::slice::from_raw_parts(data.p_objects, data.object_count as usize) };
    let names = objects.iter().map(|object| text_of(object.p_object_name).into_owned());
    names.filter(|name| !name.is_empty()).collect()
}

fn text_of<'a>(text: *const c_char) -> Cow<'a, str> {
    if text.is_null() {
        return Cow::Borrowed("");
    }
    // SAFETY: not null, and Vulkan's strings are NUL-terminated and live as long as the callback's data.
    unsafe { CStr::from_ptr(text) }.to_string_lossy()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn message(text: &str) -> Message {
        Message {
            severity: Severity::Error,
            kind: MessageKind::Validation,
            id_name: "VUID-x".into(),
            objects: Vec::new(),
            text: text.into(),
        }
    }

    #[test]
    fn a_file_has_each_message_at_once_and_no_more_than_the_log_keeps() {
        let file = tempfile::NamedTempFile::new().expect("a file");
        let told = || std::fs::read_to_string(file.path()).expect("read");
        let log = MessageLog::default();
        log.push(message("before"));
        log.tell_to(Some(file.reopen().expect("opened")));
        assert_eq!(told(), "Error (Validation) VUID-x: before\n");
        log.push(message("after"));
        assert_eq!(told().lines().last(), Some("Error (Validation) VUID-x: after"));
        (2..KEPT_MESSAGES + 3).for_each(|number| log.push(message(&number.to_string())));
        assert_eq!(told().lines().count(), KEPT_MESSAGES);
        log.take();
        log.tell_to(None);
        log.push(message("unheard"));
        assert!(!told().contains("unheard"));
    }

    #[test]
    fn a_full_log_counts_what_it_does_not_keep() {
        let log = MessageLog::default();
        (0..KEPT_MESSAGES + 3).for_each(|number| log.push(message(&number.to_string())));
        assert_eq!(log.dropped(), 3);
        assert_eq!(log.take().len(), KEPT_MESSAGES);
        assert!(log.take().is_empty() && log.dropped() == 0);
    }
}
