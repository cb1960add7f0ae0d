//! The subpasses that a driver merges. `inspect` asks by VK_EXT_subpass_merge_feedback.

use std::fmt::Write as _;
use std::sync::Arc;

use afterlight::frame::render_pass::PassDescription;
use afterlight::gpu::{self, Device, SubpassFeedback, vk};
use serde::Serialize;

use crate::table::TextTable;

/// A driver's answer on a render pass.
#[derive(Debug, Serialize)]
pub struct MergingReport {
    /// The number of subpasses after merging.
    merged_into: u32,
    subpasses: Vec<SubpassReport>,
}

#[derive(Debug, Serialize)]
struct SubpassReport {
    name: String,
    /// Vulkan's name of the status.
    status: String,
    /// The status in words.
    why: &'static str,
    is_merged: bool,
    /// The driver's own words; may be empty.
    description: String,
    /// The index after merging.
    index: u32,
}

impl MergingReport {
    /// The driver's answer on a render pass, if the driver can answer and there is something to merge.
    ///
    /// # Errors
    /// When the render pass cannot be made.
    pub fn of(pass: &PassDescription, device: &Arc<Device>) -> gpu::Result<Option<Self>> {
        let Some(told) = pass.merge_feedback(device)? else { return Ok(None) };
        let report = |(place, own): (String, SubpassFeedback)| SubpassReport {
            name: place,
            status: status_name(own.status),
            why: in_words(own.status),
            is_merged: own.status == vk::SubpassMergeStatusEXT::MERGED,
            description: own.description,
            index: own.index,
        };
        let names = pass.subpasses.iter().map(|own| own.place.to_string());
        Ok(Some(Self { merged_into: told.merged_count, subpasses: names.zip(told.subpasses).map(report).collect() }))
    }

    /// A line on the render pass of this name, and a line on each subpass after the first. The first has no subpass before it.
    pub fn text(&self, name: &str) -> String {
        // No render pass has 0 subpasses: the driver left the place empty.
        if self.merged_into == 0 {
            return format!("  the driver has VK_EXT_subpass_merge_feedback, and says nothing of the {name}\n");
        }
        let all = self.subpasses.len();
        let mut text = format!("  the driver merges the {all} subpasses of the {name} into {}\n", self.merged_into);
        let mut table = TextTable::new();
        for own in self.subpasses.iter().skip(1) {
            let mut verdict = match own.is_merged {
                true => format!("merged into subpass {}", own.index),
                false => format!("not merged: {} ({})", own.why, own.status),
            };
            if !own.description.is_empty() {
                let _ = write!(verdict, ": {}", own.description);
            }
            table.row([format!("  {}", own.name), verdict]);
        }
        text.push_str(&table.render());
        text
    }
}

fn status_name(status: vk::SubpassMergeStatusEXT) -> String {
    match in_words(status) {
        UNKNOWN => format!("VkSubpassMergeStatusEXT {}", status.as_raw()),
        _ => format!("VK_SUBPASS_MERGE_STATUS_{status:?}_EXT"),
    }
}

const UNKNOWN: &str = "for a reason that this program does not know";

fn in_words(status: vk::SubpassMergeStatusEXT) -> &'static str {
    use vk::SubpassMergeStatusEXT as Status;
    match status {
        Status::MERGED => "merged with the subpass before it",
        Status::DISALLOWED => "the program disallows it",
        Status::NOT_MERGED_SIDE_EFFECTS => "it has side effects",
        Status::NOT_MERGED_SAMPLES_MISMATCH => "the subpass before it has another number of samples",
        Status::NOT_MERGED_VIEWS_MISMATCH => "the subpass before it has other views",
        Status::NOT_MERGED_ALIASING => "attachments share memory",
        Status::NOT_MERGED_DEPENDENCIES => "the dependencies do not allow it",
        Status::NOT_MERGED_INCOMPATIBLE_INPUT_ATTACHMENT => {
            "an input attachment is no colour attachment of the subpass before it, or has another format"
        }
        Status::NOT_MERGED_TOO_MANY_ATTACHMENTS => "too many attachments",
        Status::NOT_MERGED_INSUFFICIENT_STORAGE => "not enough memory",
        Status::NOT_MERGED_DEPTH_STENCIL_COUNT => "too many depth attachments",
        Status::NOT_MERGED_RESOLVE_ATTACHMENT_REUSE => "a later subpass reads what is resolved",
        Status::NOT_MERGED_SINGLE_SUBPASS => "the render pass has only one subpass",
        Status::NOT_MERGED_UNSPECIFIED => "for no reason that the driver gives",
        _ => UNKNOWN,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn told(merged_into: u32, status: i32, description: &str) -> String {
        let status = vk::SubpassMergeStatusEXT::from_raw(status);
        let own = |name: &str| SubpassReport {
            name: name.into(),
            status: status_name(status),
            why: in_words(status),
            is_merged: status == vk::SubpassMergeStatusEXT::MERGED,
            description: description.into(),
            index: 0,
        };
        MergingReport { merged_into, subpasses: vec![own("GEOMETRY"), own("LIGHTING")] }.text("GEOMETRY pass")
    }

    #[test]
    fn odd_answers_of_drivers_are_told() {
        assert!(told(0, 0, "").ends_with("and says nothing of the GEOMETRY pass\n"), "{}", told(0, 0, ""));
        let unknown = "not merged: for a reason that this program does not know (VkSubpassMergeStatusEXT 99)\n";
        assert!(told(2, 99, "").ends_with(unknown), "{}", told(2, 99, ""));
    }

    #[test]
    fn a_reason_stands_in_words_with_its_name_and_the_drivers_words() {
        let text = told(2, 9, "48 bytes a pixel");
        let line = "LIGHTING  not merged: not enough memory (VK_SUBPASS_MERGE_STATUS_NOT_MERGED_INSUFFICIENT_STORAGE_EXT): 48 bytes a pixel\n";
        assert!(text.starts_with("  the driver merges the 2 subpasses of the GEOMETRY pass into 2\n"), "{text}");
        assert!(text.ends_with(line), "{text}");
        assert!(told(1, 0, "").ends_with("LIGHTING  merged into subpass 0\n"), "{}", told(1, 0, ""));
    }
}
