//! A device for the length of one command, and the validation layer's messages meanwhile.

use std::collections::BTreeMap;
use std::ffi::{CStr, OsString};
use std::fmt::Write as _;
use std::path::PathBuf;
use std::sync::Arc;

use afterlight::gpu::{Device, Instance, InstanceOptions, Message, MessageKind, Severity, Validation};
use afterlight::scene::counted as words;
use serde::Serialize;

use super::args::DeviceArgs;
use super::failure::{Exit, Failure};
use super::output;
use super::own;
use super::table::version;

/// Runs `work` with the device asked for. The device is gone before messages are counted, so that faults that are only found at
/// its end, as leaks, count too. With `--validate` any message of the layer that is not advice is an error.
pub fn with_device(args: &DeviceArgs, work: impl FnOnce(Arc<Device>) -> Result<(), Failure>) -> Result<(), Failure> {
    let (outcome, heard) = observe(args, work);
    heard.print()?;
    heard.judge(outcome)
}

/// As [`with_device`], with a device that can show images through a window system, given by its instance extensions.
#[cfg(feature = "window")]
pub fn with_device_for(
    args: &DeviceArgs,
    window_system: &[&'static CStr],
    work: impl FnOnce(Arc<Device>) -> Result<(), Failure>,
) -> Result<(), Failure> {
    let (outcome, heard) = observe_with(args, (window_system, &[c"VK_KHR_swapchain"]), work);
    heard.print()?;
    heard.judge(outcome)
}

/// Does work with a device, and returns its result and the layer's messages, for callers that report both.
pub fn observe<T>(
    args: &DeviceArgs,
    work: impl FnOnce(Arc<Device>) -> Result<T, Failure>,
) -> (Result<T, Failure>, ValidationLog) {
    observe_with(args, (&[], &[]), work)
}

fn observe_with<T>(
    args: &DeviceArgs,
    (of_instance, of_device): (&[&'static CStr], &[&'static CStr]),
    work: impl FnOnce(Arc<Device>) -> Result<T, Failure>,
) -> (Result<T, Failure>, ValidationLog) {
    let mut heard = ValidationLog { validation: args.validate.unwrap_or_default(), ..ValidationLog::default() };
    let options = InstanceOptions { validation: heard.validation, calibrated: true, ..InstanceOptions::default() };
    let instance = match Instance::with_extensions(&options, of_instance) {
        Ok(instance) => instance,
        Err(error) => return (Err(error.into()), heard),
    };
    let log = instance.message_log();
    heard.layer = instance.validation_layer();
    let choice = args.device.clone().unwrap_or_default();
    let device = Device::with_extensions(&instance, &choice, of_device).inspect(|device| {
        heard.device = Some(device.physical.name.clone());
        tracing::info!("drawing on {:?}, driver {}", device.physical, device.physical.driver_name);
        if let Some(fault) = device.physical.fault() {
            // Standard error takes it, or nobody can be told.
            let _ = output::print(&format!("warning: {fault}\n"), true);
        }
    });
    let outcome = device.map_err(Failure::from).and_then(work);
    drop(instance);
    heard.dropped = log.dropped();
    let (about_us, about_the_system): (Vec<Message>, Vec<Message>) =
        log.take().into_iter().partition(|message| message.kind != MessageKind::General);
    for message in &about_the_system {
        tracing::info!("{}: {}", message.id_name, message.text);
    }
    heard.messages = about_us;
    (outcome, heard)
}

/// The words that start this program again, on the Vulkan stack that it runs on.
pub fn own_command() -> Result<Vec<OsString>, Failure> {
    Ok(own::command(&own_program()?))
}

/// This program's own file.
pub fn own_program() -> Result<PathBuf, Failure> {
    own::program()
        .map_err(|error| Failure::new(Exit::BadInput, format!("cannot find out where this program is: {error}")))
}

/// The validation layer's messages on some work, and the checks that it made.
#[derive(Debug, Default)]
pub struct ValidationLog {
    validation: Validation,
    /// The device's name, if there was one.
    pub device: Option<String>,
    /// The validation layer's version, also if it was not asked.
    layer: Option<u32>,
    messages: Vec<Message>,
    /// Messages that were not kept.
    pub dropped: u64,
}

/// Each different message once, as `--json` has it.
#[derive(Debug, Serialize)]
pub struct MessageReport {
    rule: String,
    severity: &'static str,
    kind: &'static str,
    count: usize,
    objects: Vec<String>,
    text: String,
}

impl ValidationLog {
    /// Returns the kind of check and the layer; `None` without `--validate`, and where there was no device to check.
    pub fn checks(&self) -> Option<(&'static str, String)> {
        self.device.as_ref()?;
        let checks = match self.validation {
            Validation::Off => return None,
            Validation::Core => "core",
            Validation::Synchronization => "core and synchronization",
            Validation::GpuAssisted => "what shaders access",
            Validation::BestPractices => "core and best practices",
        };
        Some((checks, self.layer.map_or_else(|| "unknown".into(), version)))
    }

    /// Checks, layer and number of messages in a line, as [`ValidationLog::checks`].
    pub fn line(&self) -> Option<String> {
        let (checks, layer) = self.checks()?;
        let messages = match self.mistakes() {
            0 => "no messages".to_owned(),
            count => words(count, "message"),
        };
        let advice = match self.messages.iter().filter(|message| self.is_wanted(message)).count() {
            0 => String::new(),
            count => format!(" but advice ({count})"),
        };
        Some(format!("validation: {checks}, layer {layer}: {messages}{advice}"))
    }

    /// Advice that was asked for.
    fn is_wanted(&self, message: &Message) -> bool {
        self.validation == Validation::BestPractices && message.is_advice()
    }

    /// Counts the messages about this program's mistakes. Advice that was asked for does not count. Messages that were dropped do, because nobody knows their kind.
    fn mistakes(&self) -> u64 {
        let is_counted = |message: &&Message| message.is_about_this_program() && !self.is_wanted(message);
        self.messages.iter().filter(is_counted).count() as u64 + self.dropped
    }

    /// Prints all messages on standard error.
    pub fn print(&self) -> Result<(), Failure> {
        output::print(&self.listing(), true)
    }

    /// Lets messages fail a validated command that went well otherwise. Advice that was asked for fails none.
    pub fn judge<T>(&self, outcome: Result<T, Failure>) -> Result<T, Failure> {
        let count = self.mistakes();
        let failed = Failure::new(
            Exit::FailedCheck,
            format!("validation failed with {}, listed above", words(count, "message")),
        );
        match outcome {
            Err(failure) if !failure.is_quiet() => Err(failure),
            _ if self.validation != Validation::Off && count > 0 => Err(failed),
            outcome => outcome,
        }
    }

    /// The messages as data.
    pub fn reports(&self) -> Vec<MessageReport> {
        let report = |(message, count): (&Message, usize)| MessageReport {
            rule: message.id_name.clone(),
            severity: match message.severity {
                Severity::Warning => "warning",
                Severity::Error => "error",
            },
            kind: match message.kind {
                MessageKind::General => "general",
                MessageKind::Validation => "validation",
                MessageKind::Performance => "performance",
                MessageKind::Leak => "leak",
            },
            count,
            objects: message.objects.clone(),
            text: message.text.clone(),
        };
        counted(&self.messages).into_iter().map(report).collect()
    }

    /// As [`listing`].
    pub fn listing(&self) -> String {
        listing(&self.messages, self.dropped)
    }
}

/// Each different message once, with how often it came.
fn counted(messages: &[Message]) -> Vec<(&Message, usize)> {
    let mut places: BTreeMap<(&str, &str), usize> = BTreeMap::new();
    let mut counted: Vec<(&Message, usize)> = Vec::new();
    for message in messages {
        let place = *places.entry((&message.id_name, &message.text)).or_insert(counted.len());
        match counted.get_mut(place) {
            Some((_, count)) => *count += 1,
            None => counted.push((message, 1)),
        }
    }
    counted
}

/// Returns a paragraph for each different message, and the number of messages that were not kept.
pub fn listing(messages: &[Message], dropped: u64) -> String {
    let mut text = String::new();
    for (message, count) in counted(messages) {
        let times = if count == 1 { String::new() } else { format!(" ({count} times)") };
        let (severity, kind) = (message.severity, message.kind);
        let _ = writeln!(text, "{severity:?} ({kind:?}) {}{times}: {}", message.id_name, message.text);
    }
    if dropped > 0 {
        let _ = writeln!(text, "and {dropped} more that were not kept");
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    fn message(text: &str) -> Message {
        Message {
            severity: Severity::Error,
            kind: MessageKind::Validation,
            id_name: "VUID-x".into(),
            objects: vec!["the albedo".into()],
            text: text.into(),
        }
    }

    fn heard(validation: Validation, messages: &[Message]) -> ValidationLog {
        let layer = Some(afterlight::gpu::vk::make_api_version(0, 1, 4, 309));
        ValidationLog { validation, device: Some("llvmpipe".into()), layer, messages: messages.to_vec(), dropped: 0 }
    }

    #[test]
    fn a_repeated_message_is_listed_once_with_its_count() {
        let heard = ValidationLog { dropped: 7, ..heard(Validation::Off, &[message("b"), message("a"), message("b")]) };
        let text = heard.listing();
        assert_eq!(text.lines().count(), 3);
        assert!(text.starts_with("Error (Validation) VUID-x (2 times): b\n"), "{text}");
        assert!(text.contains("7 more"), "{text}");
        let json = serde_json::to_value(heard.reports()).expect("JSON");
        let first = serde_json::json!({
            "rule": "VUID-x", "severity": "error", "kind": "validation", "count": 2, "objects": ["the albedo"], "text": "b"
        });
        assert_eq!((json.as_array().map(Vec::len), &json[0]), (Some(2), &first));
    }

    #[test]
    fn messages_fail_a_validated_command_and_hide_no_other_failure() {
        use Validation::{BestPractices, Off, Synchronization};
        let judge = |validation, messages: &[Message]| heard(validation, messages).judge(Ok(()));
        assert!(judge(Synchronization, &[message("a")]).is_err());
        assert!(judge(Off, &[message("a")]).is_ok());
        assert!(judge(Synchronization, &[]).is_ok());
        let advice = Message { id_name: "BestPractices-x".into(), severity: Severity::Warning, ..message("a") };
        assert!(judge(BestPractices, std::slice::from_ref(&advice)).is_ok());
        assert!(judge(Synchronization, std::slice::from_ref(&advice)).is_err());
        assert!(judge(BestPractices, &[advice, message("b")]).is_err());
        let usage: Result<(), _> = Err(Failure::usage("what was wrong before"));
        let kept = heard(Synchronization, &[message("a")]).judge(usage).expect_err("still a failure");
        assert!(format!("{kept:?}").contains("before"));
    }

    #[test]
    fn the_last_line_has_checks_layer_and_messages() {
        let line = |validation, messages: &[Message]| heard(validation, messages).line();
        let clean = line(Validation::Synchronization, &[]).expect("it is validated");
        assert_eq!(clean, "validation: core and synchronization, layer 1.4.309: no messages");
        let found = line(Validation::Synchronization, &[message("a"), message("a")]).expect("it is validated");
        assert!(found.ends_with(": 2 messages"), "{found}");
        let advice = Message { id_name: "BestPractices-x".into(), severity: Severity::Warning, ..message("a") };
        let advised = line(Validation::BestPractices, &[advice]).expect("it is validated");
        assert!(advised.ends_with(": no messages but advice (1)"), "{advised}");
        assert_eq!(line(Validation::Off, &[message("a")]), None);
    }
}
