//! A command as JSON.

use afterlight::gpu::{Barrier, BarrierPart};
use afterlight_lab::report::commands::{Attachment, ExplainedCommand};
use serde::Serialize;

use super::super::inspect::{RowReport, flags};

/// A command with its arguments and its reason.
#[derive(Serialize)]
pub struct CommandReport {
    command_buffer: String,
    command: &'static str,
    objects: Vec<String>,
    numbers: Vec<i64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    barrier: Option<BarrierReport>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    attachments: Vec<AttachmentReport>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    dependencies: Vec<RowReport>,
    #[serde(skip_serializing_if = "str::is_empty")]
    why: String,
}

#[derive(Serialize)]
struct BarrierReport {
    row: &'static str,
    src_stages: String,
    dst_stages: String,
    /// `release` or `acquire`, of an ownership transfer.
    #[serde(skip_serializing_if = "Option::is_none")]
    half: Option<String>,
    parts: Vec<BarrierPartReport>,
}

#[derive(Serialize)]
struct BarrierPartReport {
    /// `null` for a barrier on all memory.
    object: Option<String>,
    src_access: String,
    dst_access: String,
    /// `null` where no layout can change.
    layouts: Option<[String; 2]>,
}

#[derive(Serialize)]
struct AttachmentReport {
    name: String,
    format: String,
    samples: u32,
    load: String,
    store: String,
    layouts: [String; 2],
}

impl CommandReport {
    pub fn of(line: &ExplainedCommand) -> Self {
        let arguments = &line.command.arguments;
        let rows = line.dependencies.iter();
        Self {
            command_buffer: line.command.command_buffer.clone(),
            command: line.command.name,
            objects: arguments.objects.clone(),
            numbers: arguments.numbers.clone(),
            barrier: arguments.barrier.as_ref().map(BarrierReport::of),
            attachments: line.attachments.iter().map(AttachmentReport::of).collect(),
            dependencies: rows.map(|acting| RowReport::of(&acting.row, &acting.layouts, None)).collect(),
            why: line.reason.clone(),
        }
    }
}

impl BarrierReport {
    fn of(barrier: &Barrier) -> Self {
        let part = |part: &BarrierPart| BarrierPartReport {
            object: part.object.clone(),
            src_access: flags(&part.src_access),
            dst_access: flags(&part.dst_access),
            layouts: part.layouts.map(|both| both.map(|layout| format!("{layout:?}"))),
        };
        Self {
            row: barrier.row,
            src_stages: flags(&barrier.src_stages),
            dst_stages: flags(&barrier.dst_stages),
            half: barrier.handed.map(|(half, _)| format!("{half:?}").to_lowercase()),
            parts: barrier.parts.iter().map(part).collect(),
        }
    }
}

impl AttachmentReport {
    fn of(attachment: &Attachment) -> Self {
        let own = &attachment.description;
        Self {
            name: attachment.name.clone(),
            format: format!("{:?}", own.format),
            samples: own.samples.as_raw(),
            load: format!("{:?}", own.load_op),
            store: format!("{:?}", own.store_op),
            layouts: [own.initial_layout, own.final_layout].map(|layout| format!("{layout:?}")),
        }
    }
}
