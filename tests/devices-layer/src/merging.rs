//! A tiler's driver that answers which subpasses it merges (VK_EXT_subpass_merge_feedback). Only the answer is played: the device below merges as it likes.

use std::collections::BTreeSet;
use std::ffi::c_char;

use ash::vk;
use vk::SubpassMergeStatusEXT as Status;

use super::chain;
use super::device::next;

/// The attachments for which a tile of the played device has room.
const ROOM: usize = 5;

/// An answer on a subpass.
struct Answer {
    status: Status,
    description: String,
    index: u32,
}

/// The properties of a subpass that decide: the attachments that it uses, and the number of samples that it draws.
#[derive(Default)]
struct Needs {
    attachments: BTreeSet<u32>,
    samples: vk::SampleCountFlags,
}

/// Merges subpasses that follow each other while a tile has room for all their attachments, and while they draw the same number of samples.
fn merged(subpasses: &[Needs]) -> Vec<Answer> {
    let mut answers: Vec<Answer> = Vec::new();
    let mut tile = Needs::default();
    for own in subpasses {
        let before = answers.last().map(|last| last.index);
        let all: BTreeSet<u32> = tile.attachments.union(&own.attachments).copied().collect();
        let (status, description) = if subpasses.len() == 1 {
            (Status::NOT_MERGED_SINGLE_SUBPASS, String::new())
        } else if before.is_none() {
            (Status::NOT_MERGED_UNSPECIFIED, "the first subpass".to_owned())
        } else if own.samples != tile.samples {
            (
                Status::NOT_MERGED_SAMPLES_MISMATCH,
                format!("{} a pixel after {}", own.samples.as_raw(), tile.samples.as_raw()),
            )
        } else if all.len() > ROOM {
            let most = format!("{} attachments, and a tile has room for {ROOM}", all.len());
            (Status::NOT_MERGED_TOO_MANY_ATTACHMENTS, most)
        } else {
            (Status::MERGED, String::new())
        };
        let is_merged = status == Status::MERGED;
        let index = before.map_or(0, |before| before + u32::from(!is_merged));
        tile.attachments = if is_merged { all } else { own.attachments.clone() };
        tile.samples = own.samples;
        answers.push(Answer { status, description, index });
    }
    answers
}

/// The attachments of a subpass.
///
/// # Safety
/// The structures are as the specification has them.
unsafe fn needs(info: &vk::RenderPassCreateInfo2<'_>, subpass: &vk::SubpassDescription2<'_>) -> Needs {
    let mut own = Needs::default();
    let lists = [
        (subpass.p_input_attachments, subpass.input_attachment_count, false),
        (subpass.p_color_attachments, subpass.color_attachment_count, true),
        (subpass.p_depth_stencil_attachment, 1, true),
    ];
    for (first, count, is_drawn) in lists.into_iter().filter(|(first, ..)| !first.is_null()) {
        // SAFETY: the caller's promise: so many references lie there.
        let references = (0..count as usize).map(|index| unsafe { (*first.add(index)).attachment });
        for index in references.filter(|&index| index != vk::ATTACHMENT_UNUSED) {
            own.attachments.insert(index);
            if is_drawn {
                // SAFETY: the caller's promise: references count the attachments of the render pass.
                own.samples |= unsafe { (*info.p_attachments.add(index as usize)).samples };
            }
        }
    }
    own
}

/// Writes the answers where the render pass asks for them.
///
/// # Safety
/// The structures are as the specification has them, and nobody else uses them meanwhile.
unsafe fn answer(info: &vk::RenderPassCreateInfo2<'_>) {
    // SAFETY: the caller's promise.
    let subpasses = unsafe { std::slice::from_raw_parts(info.p_subpasses, info.subpass_count as usize) };
    // SAFETY: the caller's promise.
    let needs: Vec<_> = subpasses.iter().map(|own| unsafe { needs(info, own) }).collect();
    let answers = merged(&needs);
    let count = answers.last().map_or(0, |last| last.index + 1);
    // SAFETY: the caller's promise: a structure of this type has a place for the answer.
    unsafe {
        let asked = vk::StructureType::RENDER_PASS_CREATION_FEEDBACK_CREATE_INFO_EXT;
        for own in chain::structures(info.p_next).filter(|own| own.as_ref().s_type == asked) {
            let own = own.cast::<vk::RenderPassCreationFeedbackCreateInfoEXT<'_>>();
            (*own.as_ref().p_render_pass_feedback).post_merge_subpass_count = count;
        }
        let asked = vk::StructureType::RENDER_PASS_SUBPASS_FEEDBACK_CREATE_INFO_EXT;
        for (subpass, answer) in subpasses.iter().zip(&answers) {
            for own in chain::structures(subpass.p_next).filter(|own| own.as_ref().s_type == asked) {
                let own = own.cast::<vk::RenderPassSubpassFeedbackCreateInfoEXT<'_>>();
                own.as_ref().p_subpass_feedback.write(told(answer));
            }
        }
    }
}

fn told(answer: &Answer) -> vk::RenderPassSubpassFeedbackInfoEXT {
    let mut own = vk::RenderPassSubpassFeedbackInfoEXT::default()
        .subpass_merge_status(answer.status)
        .post_merge_index(answer.index);
    // The last one stays the NUL that ends the text.
    let most = own.description.len() - 1;
    for (to, from) in own.description[..most].iter_mut().zip(answer.description.bytes()) {
        *to = from.cast_signed() as c_char;
    }
    own
}

pub unsafe extern "system" fn create_render_pass2(
    device: vk::Device,
    info: *const vk::RenderPassCreateInfo2<'_>,
    allocator: *const vk::AllocationCallbacks<'_>,
    render_pass: *mut vk::RenderPass,
) -> vk::Result {
    let named = [c"vkCreateRenderPass2KHR", c"vkCreateRenderPass2"];
    // SAFETY: the device is the caller's own, and both names have this type.
    let found = named.into_iter().find_map(|name| unsafe { next::<vk::PFN_vkCreateRenderPass2>(device, name) });
    let Some((create, below)) = found else { return vk::Result::ERROR_UNKNOWN };
    // SAFETY: as this function was called. A device leaves structures alone that it does not know.
    let result = unsafe { create(device, info, allocator, render_pass) };
    if result == vk::Result::SUCCESS && below.tells_merging {
        // SAFETY: as this function was called.
        unsafe { answer(&*info) };
    }
    result
}

#[cfg(test)]
mod tests {
    use super::*;

    fn own(attachments: impl IntoIterator<Item = u32>, samples: vk::SampleCountFlags) -> Needs {
        Needs { attachments: attachments.into_iter().collect(), samples }
    }

    #[test]
    fn subpasses_are_merged_while_a_tile_has_room_and_samples_agree() {
        let (one, four) = (vk::SampleCountFlags::TYPE_1, vk::SampleCountFlags::TYPE_4);
        let all = merged(&[own(0..4, one), own(3..5, one), own(4..6, one), own(5..6, four), own(5..6, four)]);
        let told: Vec<_> = all.iter().map(|own| (own.status.as_raw(), own.index)).collect();
        let expected = [
            (Status::NOT_MERGED_UNSPECIFIED, 0),
            (Status::MERGED, 0),
            (Status::NOT_MERGED_TOO_MANY_ATTACHMENTS, 1),
            (Status::NOT_MERGED_SAMPLES_MISMATCH, 2),
            (Status::MERGED, 2),
        ];
        assert_eq!(told, expected.map(|(status, index)| (status.as_raw(), index)));
        assert!(merged(&[own(0..9, one)])[0].status == Status::NOT_MERGED_SINGLE_SUBPASS);
    }
}
