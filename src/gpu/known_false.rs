//! Messages of validation layers about uses that the specification allows: faults of the layer, which fail no check of this program.
//!
//! A row ends with the layer that no longer has the fault. `afterlight ci` prints the messages that it has let pass, and fails where a layer that a row is
//! about no longer says it in a case of [`FalseMessage::cases`]: then the row's range ends.

use ash::vk;

use super::message::Message;

/// A false message of some layers.
#[derive(Debug, Clone, Copy)]
pub struct FalseMessage {
    /// The first layer that has it, packed as Vulkan packs it.
    pub from: u32,
    /// The last one; `None` where the newest layer has it.
    pub to: Option<u32>,
    /// The name of the rule, or of the hazard.
    pub rule: &'static str,
    /// The debug name of the object.
    pub object: &'static str,
    /// Parts of the text that tell it apart from a true message of that rule about that object.
    pub text: &'static [&'static str],
    /// The built-in cases of `afterlight ci` that show the message, each with the mode of validation in which they do (as `sync-shaders`).
    pub cases: &'static [(&'static str, &'static str)],
    /// What the layer overlooks, in a sentence.
    pub reason: &'static str,
    /// The text of the specification, or the report to the layer's developers.
    pub link: &'static str,
}

/// The list.
pub static KNOWN_FALSE: &[FalseMessage] = &[FalseMessage {
    from: vk::make_api_version(0, 1, 4, 322),
    to: None,
    rule: "SYNC-HAZARD-READ-AFTER-WRITE",
    object: "target Hdr",
    text: &[
        "during an image layout transition initiated by vkCmdEndRenderPass",
        // Only TAA's reads are meant. The layer applies the dependency for depth, so its text names the stages of fragment tests.
        "[taa]",
        "_FRAGMENT_TESTS_BIT",
    ],
    cases: &[("motion.taa", "sync-shaders"), ("motion.velocity", "sync-shaders")],
    reason: "of the dependencies that leave a subpass, the layer applies the first alone to the layout changes at the end of the render pass: it sees that of depth, and not that of light",
    link: "https://docs.vulkan.org/refpages/latest/refpages/source/VkSubpassDependency.html",
}];

impl FalseMessage {
    /// Returns true if a layer of this version has it.
    #[must_use]
    pub fn is_of(&self, layer: u32) -> bool {
        layer >= self.from && self.to.is_none_or(|last| layer <= last)
    }

    /// Returns true if it is this message.
    #[must_use]
    pub fn is(&self, message: &Message) -> bool {
        let names = message.objects.iter().any(|name| name == self.object);
        message.id_name == self.rule
            && (names || message.text.contains(&format!("[{}]", self.object)))
            && self.text.iter().all(|part| message.text.contains(part))
    }

    /// A line about it: rule, object, layers, reason and link.
    #[must_use]
    pub fn line(&self) -> String {
        let version = super::physical::version_text;
        let last = self.to.map_or_else(|| "on".to_owned(), |last| format!("to {}", version(last)));
        format!(
            "{} about \"{}\" (layers from {} {last}): {}: {}",
            self.rule,
            self.object,
            version(self.from),
            self.reason,
            self.link
        )
    }
}

/// The row of a message, if a layer of this version is known to be wrong with it.
#[must_use]
pub fn known_false(layer: u32, message: &Message) -> Option<&'static FalseMessage> {
    KNOWN_FALSE.iter().find(|row| row.is_of(layer) && row.is(message))
}

#[cfg(test)]
mod tests {
    use super::super::message::{MessageKind, Severity};
    use super::*;

    /// As layer 1.4.363 says it of `motion.taa`, without its middle.
    fn of_taa() -> Message {
        let text = "vkCmdDispatch(): READ_AFTER_WRITE hazard detected. Shader stage VK_SHADER_STAGE_COMPUTE_BIT reads VkImageView 0x290000000029[target \
                    Hdr], which was previously written during an image layout transition initiated by vkCmdEndRenderPass. \nThe image is referenced by VkPipeline 0x5e000000005e[taa].\nThe current synchronization \
                    allows all accesses at VK_PIPELINE_STAGE_2_EARLY_FRAGMENT_TESTS_BIT|VK_PIPELINE_STAGE_2_LATE_FRAGMENT_TESTS_BIT, but to prevent";
        Message {
            severity: Severity::Error,
            kind: MessageKind::Validation,
            id_name: "SYNC-HAZARD-READ-AFTER-WRITE".into(),
            objects: vec!["taa of frame 0".into()],
            text: text.into(),
        }
    }

    #[test]
    fn a_message_is_known_by_its_layer_rule_object_and_text() {
        let layer = vk::make_api_version(0, 1, 4, 363);
        assert!(known_false(layer, &of_taa()).is_some());
        assert!(known_false(vk::make_api_version(0, 1, 4, 309), &of_taa()).is_none(), "an older layer is right");
        let with = |change: fn(&mut Message)| {
            let mut message = of_taa();
            change(&mut message);
            known_false(layer, &message).is_some()
        };
        assert!(with(|message| {
            message.text = message.text.replace("[target Hdr]", "");
            message.objects.push("target Hdr".into());
        }));
        assert!(!with(|message| message.id_name = "SYNC-HAZARD-WRITE-AFTER-WRITE".into()));
        assert!(!with(|message| message.text = message.text.replace("[target Hdr]", "[target Depth]")));
        assert!(!with(|message| message.text = message.text.replace("by vkCmdEndRenderPass", "by a barrier")));
        assert!(!with(|message| message.text = message.text.replace("_FRAGMENT_TESTS_BIT", "")));
        assert!(!with(|message| message.text = message.text.replace("[taa]", "[resolve]")));
    }

    #[test]
    fn a_row_that_ends_is_of_no_later_layer() {
        let version = |patch| vk::make_api_version(0, 1, 4, patch);
        let row = FalseMessage { from: version(322), to: Some(version(363)), ..KNOWN_FALSE[0] };
        assert_eq!([321, 322, 363, 364].map(|patch| row.is_of(version(patch))), [false, true, true, false]);
        assert!(row.line().contains("layers from 1.4.322 to 1.4.363"), "{}", row.line());
    }
}
