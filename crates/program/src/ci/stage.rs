//! Stages of a case: parts with separate devices, each with the checks of the layer that watches it.

use std::sync::Arc;

use afterlight::gpu::{
    self, Device, DeviceChoice, HEADLESS, Instance, InstanceOptions, Message, MessageKind, MessageLog, Validation,
};
use afterlight::scene::counted;

use super::evidence::EvidenceFolder;
use super::examine::{Abort, CaseContext};
use super::suite::ValidationMode;
use super::verdict::{CaseReport, CheckKind, Where};

/// Messages of the layer about some work, and the program's own about objects that it left behind.
struct Observed {
    messages: Vec<Message>,
    dropped: u64,
}

impl Observed {
    /// Takes all messages so far, and stops writing to the log's file.
    fn end(log: &MessageLog) -> Self {
        log.tell_to(None);
        let dropped = log.dropped();
        Self { messages: log.take(), dropped }
    }

    fn keep(&self, stage: &str, evidence: &EvidenceFolder) {
        evidence.layer_messages(stage, &self.messages, self.dropped);
    }

    /// Notes the first message that is a mistake, and the number of mistakes.
    fn note(&self, stage: CaseStage, evidence: &EvidenceFolder, report: &mut CaseReport) {
        let (left, said): (Vec<_>, Vec<_>) = self.messages.iter().partition(|own| own.kind == MessageKind::Leak);
        let holds = left.is_empty();
        let detail =
            left.first().map_or_else(|| "nothing".to_owned(), |first| more(&first.text, left.len() as u64 - 1));
        if !holds || stage.mode.is_none() {
            report.hold(CheckKind::ResourcesLeft, holds, detail);
        }
        let (Some(mode), name) = (stage.mode, stage.name()) else { return };
        self.keep(&name, evidence);
        let is_advice = |own: &&&Message| mode == ValidationMode::BestPractices && own.is_advice();
        let mistakes: Vec<_> = said.iter().filter(|own| own.is_about_this_program() && !is_advice(own)).collect();
        match mistakes.first() {
            None if self.dropped > 0 => {
                report.hold(
                    CheckKind::LayerMessage,
                    false,
                    format!("{name}: {} not kept", counted(self.dropped, "message")),
                );
            }
            None => report.hold(CheckKind::LayerMessage, true, format!("{name}: silent")),
            Some(first) => {
                let count = mistakes.len() as u64 - 1 + self.dropped;
                let text = first.text.lines().next().unwrap_or_default();
                report.hold(CheckKind::LayerMessage, false, format!("{name}: {} {}", first.id_name, more(text, count)));
            }
        }
    }
}

fn more(first: &str, others: u64) -> String {
    if others == 0 { first.to_owned() } else { format!("{first} (and {others} more)") }
}

/// A part of a case with a separate device.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CaseStage {
    /// The checks of the layer.
    pub mode: Option<ValidationMode>,
    /// The check that shows frames on a surface without a display.
    pub shows: Option<CheckKind>,
}

impl CaseStage {
    /// The name in sentences and in files: `sync`, `window-sync`.
    fn name(self) -> String {
        match (self.shows, self.mode) {
            (None, None) => "without the layer".to_owned(),
            (None, Some(mode)) => mode.name().to_owned(),
            (Some(check), None) => check.name().to_owned(),
            (Some(check), Some(mode)) => format!("{}-{}", check.name(), mode.name()),
        }
    }

    fn instance(self) -> gpu::Result<Arc<Instance>> {
        let options = InstanceOptions {
            validation: self.mode.map_or(Validation::Off, ValidationMode::validation),
            sync_shader_heuristic: self.mode == Some(ValidationMode::SyncShaders),
            ..InstanceOptions::default()
        };
        Instance::with_extensions(&options, if self.shows.is_some() { &HEADLESS } else { &[] })
    }

    fn device(self, instance: &Arc<Instance>, choice: &DeviceChoice) -> gpu::Result<Arc<Device>> {
        Device::with_extensions(instance, choice, if self.shows.is_some() { &[c"VK_KHR_swapchain"] } else { &[] })
    }

    /// Notes a check that cannot be made here. If no check is concerned, returns the error: the whole case cannot be tried.
    fn skip(self, error: gpu::Error, report: &mut CaseReport) -> Result<(), Abort> {
        let check = match (&error, self.mode, self.shows) {
            (gpu::Error::MissingLayer { .. } | gpu::Error::Unsupported(_), Some(_), _) => CheckKind::LayerMessage,
            (gpu::Error::Unsupported(_), None, Some(check)) => check,
            _ => return Err(error.into()),
        };
        report.skip(check, format!("{}: {error}", self.name()));
        Ok(())
    }
}

/// Runs work on a separate device, and notes the messages of the layer and of the device's end, also if the work fails. Returns `None`, with a note,
/// if the layer lacks these checks or nothing can be shown.
pub fn with_device<T>(
    stage: CaseStage,
    context: &CaseContext,
    evidence: &EvidenceFolder,
    report: &mut CaseReport,
    work: impl FnOnce(&Arc<Device>, &mut CaseReport) -> Result<T, Abort>,
) -> Result<Option<T>, Abort> {
    let instance = match stage.instance() {
        Ok(instance) => instance,
        Err(error) => return stage.skip(error, report).map(|()| None),
    };
    if stage.mode == Some(ValidationMode::SyncShaders) && !instance.sync_shader_heuristic() {
        let name = stage.name();
        report.skip(CheckKind::LayerMessage, format!("{name}: the layer has no heuristic for what shaders access"));
        return Ok(None);
    }
    let log = instance.message_log();
    log.tell_to(stage.mode.and_then(|_| evidence.layer_log(&stage.name())));
    let device = match stage.device(&instance, context.device) {
        Ok(device) => device,
        Err(error) => {
            let heard = Observed::end(&log);
            if stage.mode.is_some() {
                heard.keep(&stage.name(), evidence);
            }
            return stage.skip(error, report).map(|()| None);
        }
    };
    report.on = Where { device: device.physical.name.clone(), driver: driver_of(&device) };
    evidence.labels(&stage.name(), &device);
    let done = work(&device, report);
    drop((device, instance));
    Observed::end(&log).note(stage, evidence, report);
    done.map(Some)
}

/// The driver's name and its own words on its version.
fn driver_of(device: &Device) -> String {
    let physical = &device.physical;
    format!("{} {}", physical.driver_name, physical.driver_info).trim().to_owned()
}

#[cfg(test)]
mod tests {
    use afterlight::gpu::Severity;

    use super::super::verdict::Verdict;
    use super::*;

    fn message(kind: MessageKind, severity: Severity, id_name: &str) -> Message {
        Message { severity, kind, id_name: id_name.into(), objects: Vec::new(), text: "a queue\nmore".into() }
    }

    fn noted(mode: Option<ValidationMode>, messages: &[Message]) -> CaseReport {
        let mut report = CaseReport::new("a.b");
        Observed { messages: messages.to_vec(), dropped: 0 }.note(
            CaseStage { mode, shows: None },
            &EvidenceFolder::new(None),
            &mut report,
        );
        report
    }

    #[test]
    fn a_message_fails_the_case_and_advice_and_the_system_do_not() {
        let hazard = message(MessageKind::Validation, Severity::Error, "SYNC-HAZARD-WRITE-AFTER-READ");
        let advice = message(MessageKind::Performance, Severity::Warning, "BestPractices-vkBindMemory");
        let system = message(MessageKind::General, Severity::Warning, "Loader Message");
        let failed = noted(Some(ValidationMode::Sync), &[system.clone(), hazard.clone(), hazard.clone()]);
        assert_eq!(failed.verdict, Verdict::Fail);
        let reason = failed.reason.expect("a reason");
        assert_eq!(reason, "layer message: sync: SYNC-HAZARD-WRITE-AFTER-READ a queue (and 1 more)");
        assert_eq!(noted(Some(ValidationMode::BestPractices), &[advice.clone(), system]).verdict, Verdict::Pass);
        assert_eq!(
            noted(Some(ValidationMode::Sync), &[advice]).verdict,
            Verdict::Fail,
            "advice that nobody has asked for"
        );
        assert_eq!(noted(Some(ValidationMode::Core), &[]).verdict, Verdict::Pass);
    }

    #[test]
    fn what_is_left_on_the_device_fails_the_case() {
        let leak = message(MessageKind::Leak, Severity::Error, "");
        for mode in [None, Some(ValidationMode::Core)] {
            let failed = noted(mode, std::slice::from_ref(&leak));
            assert_eq!(failed.verdict, Verdict::Fail);
            assert!(failed.reason.is_some_and(|reason| reason.starts_with("resources left: a queue")));
        }
        assert!(noted(None, &[]).findings.iter().any(|finding| finding.check == CheckKind::ResourcesLeft));
    }
}
