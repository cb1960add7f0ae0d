//! Messages of the loader, the layers and this module, collected so that the caller can print them or fail on them.

use std::borrow::Cow;
use std::ffi::{CStr, c_char, c_void};
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
    /// Its severity.
    pub severity: Severity,
    /// Its source.
    pub kind: MessageKind,
    /// The rule's name, as `VUID-vkCmdDraw-None-02697`; may be empty.
    pub id_name: String,
    /// The names of the objects that it is about, of those that have one.
    pub objects: Vec<String>,
    /// The whole text, possibly of several lines.
    pub text: String,
}

impl Message {
    /// Returns true if it is advice on best practices, about uses that are allowed. Layers give advice the kinds of mistakes, and tell it apart by
    /// name only.
    pub fn is_advice(&self) -> bool {
        self.severity == Severity::Warning && self.id_name.contains("BestPractices")
    }
}

/// The id of GPU-assisted validation's messages about checks that the device does not allow.
const OF_THE_LAYER_ITSELF: &str = "WARNING-GPU-Assisted-Validation";

/// The messages kept; later ones are counted only. A frame loop with one mistake in it would otherwise eat the memory.
const KEPT_MESSAGES: usize = 4096;

/// A bounded list of messages, shared by an instance with its messenger. Outlives the instance while someone holds it.
#[derive(Debug, Default)]
pub struct MessageLog {
    state: Mutex<State>,
}

#[derive(Debug, Default)]
struct State {
    kept: Vec<Message>,
    dropped: u64,
}

impl MessageLog {
    /// The messages so far, oldest first, which are then forgotten.
    pub fn take(&self) -> Vec<Message> {
        let mut state = self.lock();
        state.dropped = 0;
        std::mem::take(&mut state.kept)
    }

    /// The number of messages that came after the list was full, since the last [`take`](MessageLog::take).
    pub fn dropped(&self) -> u64 {
        self.lock().dropped
    }

    /// Adds a message, or counts it if the list is full.
    pub fn push(&self, message: Message) {
        let mut state = self.lock();
        if state.kept.len() < KEPT_MESSAGES {
            state.kept.push(message);
        } else {
            state.dropped += 1;
        }
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        // A list of finished messages is whole even if a thread died while it held the lock.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
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
        let kind = if id_name == OF_THE_LAYER_ITSELF {
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

    #[test]
    fn a_full_log_counts_what_it_does_not_keep() {
        let log = MessageLog::default();
        for number in 0..KEPT_MESSAGES + 3 {
            log.push(Message {
                severity: Severity::Error,
                kind: MessageKind::Validation,
                id_name: String::new(),
                objects: Vec::new(),
                text: number.to_string(),
            });
        }
        assert_eq!(log.dropped(), 3);
        assert_eq!(log.take().len(), KEPT_MESSAGES);
        assert!(log.take().is_empty() && log.dropped() == 0);
    }
}
