//! A device for the length of one command, and what the validation layer had to say meanwhile.

use std::collections::BTreeMap;
use std::ffi::CStr;
use std::fmt::Write as _;
use std::sync::Arc;

use afterlight::gpu::{Device, Instance, InstanceOptions, Message, MessageKind, Validation};

use super::args::DeviceArgs;
use super::failure::{Exit, Failure};
use super::output;

/// Runs `work` with the device asked for. The device is gone before messages are counted, so that what is only found at
/// its end, as leaks, counts too. With `--validate` any message of the layer that is not advice is an error.
pub fn with_device(args: &DeviceArgs, work: impl FnOnce(Arc<Device>) -> Result<(), Failure>) -> Result<(), Failure> {
    with_extensions(args, (&[], &[]), work)
}

/// The same with a device that can show images where the instance extensions of a window system say.
#[cfg(feature = "window")]
pub fn with_device_for(
    args: &DeviceArgs,
    window_system: &[&'static CStr],
    work: impl FnOnce(Arc<Device>) -> Result<(), Failure>,
) -> Result<(), Failure> {
    with_extensions(args, (window_system, &[c"VK_KHR_swapchain"]), work)
}

fn with_extensions(
    args: &DeviceArgs,
    (of_instance, of_device): (&[&'static CStr], &[&'static CStr]),
    work: impl FnOnce(Arc<Device>) -> Result<(), Failure>,
) -> Result<(), Failure> {
    let validation = args.validate.unwrap_or_default();
    let options = InstanceOptions { validation, ..InstanceOptions::default() };
    let instance = Instance::with_extensions(&options, of_instance)?;
    let log = instance.message_log();
    let choice = args.device.clone().unwrap_or_default();
    let device = Device::with_extensions(&instance, &choice, of_device).inspect(|device| {
        tracing::info!("drawing on {:?}, driver {}", device.physical, device.physical.driver_name);
    });
    let outcome = device.map_err(Failure::from).and_then(work);
    drop(instance);
    let dropped = log.dropped();
    let (about_us, about_the_system): (Vec<Message>, Vec<Message>) =
        log.take().into_iter().partition(|message| message.kind != MessageKind::General);
    for message in &about_the_system {
        tracing::info!("{}: {}", message.id_name, message.text);
    }
    judge(outcome, &about_us, dropped, validation)
}

/// Tells all messages, and lets them fail a command that went well otherwise. Advice that was asked for fails none.
fn judge(
    outcome: Result<(), Failure>,
    messages: &[Message],
    dropped: u64,
    validation: Validation,
) -> Result<(), Failure> {
    if messages.is_empty() {
        return outcome;
    }
    output::print(&listing(messages, dropped), true)?;
    let wanted = |message: &Message| validation == Validation::BestPractices && message.is_advice();
    let mistakes = messages.iter().filter(|message| !wanted(message)).count() as u64;
    // What was not kept is of unknown kind.
    let count = mistakes + dropped;
    let failed = Failure::new(Exit::FailedCheck, format!("validation failed with {count} message(s), listed above"));
    match outcome {
        Err(failure) if !failure.is_quiet() => Err(failure),
        _ if validation != Validation::Off && count > 0 => Err(failed),
        outcome => outcome,
    }
}

/// Each different message once, with how often it came.
fn listing(messages: &[Message], dropped: u64) -> String {
    let mut counts: BTreeMap<(&str, &str), usize> = BTreeMap::new();
    let mut in_order = Vec::new();
    for message in messages {
        let key = (message.id_name.as_str(), message.text.as_str());
        let count = counts.entry(key).or_default();
        if *count == 0 {
            in_order.push((message, key));
        }
        *count += 1;
    }
    let mut text = String::new();
    for (message, key) in in_order {
        let times = match counts[&key] {
            1 => String::new(),
            count => format!(" ({count} times)"),
        };
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
    use afterlight::gpu::Severity;

    fn message(text: &str) -> Message {
        Message {
            severity: Severity::Error,
            kind: MessageKind::Validation,
            id_name: "VUID-x".into(),
            text: text.into(),
        }
    }

    #[test]
    fn a_repeated_message_is_listed_once_with_its_count() {
        let text = listing(&[message("b"), message("a"), message("b")], 7);
        assert_eq!(text.lines().count(), 3);
        assert!(text.starts_with("Error (Validation) VUID-x (2 times): b\n"), "{text}");
        assert!(text.contains("7 more"), "{text}");
    }

    #[test]
    fn messages_fail_a_validated_command_and_hide_no_other_failure() {
        assert!(judge(Ok(()), &[message("a")], 0, Validation::Synchronization).is_err());
        assert!(judge(Ok(()), &[message("a")], 0, Validation::Off).is_ok());
        assert!(judge(Ok(()), &[], 0, Validation::Synchronization).is_ok());
        let advice = Message { id_name: "BestPractices-x".into(), severity: Severity::Warning, ..message("a") };
        assert!(judge(Ok(()), std::slice::from_ref(&advice), 0, Validation::BestPractices).is_ok());
        assert!(judge(Ok(()), std::slice::from_ref(&advice), 0, Validation::Synchronization).is_err());
        assert!(judge(Ok(()), &[advice, message("b")], 0, Validation::BestPractices).is_err());
        let usage = || Err(Failure::usage("what was wrong before"));
        let kept = judge(usage(), &[message("a")], 0, Validation::Synchronization).expect_err("still a failure");
        assert!(format!("{kept:?}").contains("before"));
    }
}
