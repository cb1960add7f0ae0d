//! Rows that presentation adds to a window's frames: two semaphores, and the passes over the picture.
//!
//! Within a frame the swapchain's image is like any output, except for its row from OUTSIDE: that waits not for COPY, but for the stage at which the
//! semaphore of the acquired image lets the frame go on ([`ATTACH`], [`BEGIN`]). The image's layout changes before the first write and after that
//! stage, and so after presentation has read the image: the two make a chain.
//!
//! If no hardware encodes the swapchain's images, the picture is the frame's own image, in the same layout between passes as without a window, to be
//! copied. Only ENCODE then touches the swapchain's image.

use ash::vk;

use super::{Endpoint, Row, RowName, Rows, SyncKind, barrier, row, waits};
use crate::frame::list::Step;
use crate::gpu::UploadOrder;
use crate::gpu::sync::{DEVICE_ACCESS, Use};
use crate::gpu::upload::COPY_WRITE;
use crate::passes::present::{ATTACH, BEGIN, WRITE};
use crate::passes::{Resource, copy, encode, overlay, present, split};
use crate::plan::{FramePlan, PresentTarget};

#[allow(missing_docs, reason = "a name says which row, and the row itself says why it is there")]
impl RowName {
    pub const ACQUIRE: Self = Self::Own("acquire");
    pub const PRESENT: Self = Self::Own("present");
    pub const SWAPCHAIN_TO_PRESENT: Self = Self::Own("swapchain-to-present");
    pub const PRESENT_TO_SWAPCHAIN: Self = Self::Own("present-to-swapchain");
    pub const PICTURE_TO_SPLIT: Self = Self::Own("picture-to-split");
    pub const SPLIT_TO_PICTURE: Self = Self::Own("split-to-picture");
    pub const PICTURE_TO_COPY: Self = Self::Own("picture-to-copy");
    pub const COPY_TO_PICTURE: Self = Self::Own("copy-to-picture");
    pub const PICTURE_TO_OVERLAY: Self = Self::Own("picture-to-overlay");
    pub const OVERLAY_TO_PICTURE: Self = Self::Own("overlay-to-picture");
    pub const PICTURE_TO_ENCODE: Self = Self::Own("picture-to-encode");
    pub const SWAPCHAIN_TO_ENCODE: Self = Self::Own("swapchain-to-encode");
    pub const ENCODE_TO_PICTURE: Self = Self::Own("encode-to-picture");
    pub const ENCODE_TO_SWAPCHAIN: Self = Self::Own("encode-to-swapchain");
    pub const PANEL_TO_COPY: Self = Self::Own("panel-to-copy");
    pub const UPLOAD_TO_PANELS: Self = Self::Own("upload-to-panels");
}

const READ_BY_PRESENTATION: vk::ImageLayout = vk::ImageLayout::PRESENT_SRC_KHR;
const COPIED: vk::ImageLayout = vk::ImageLayout::TRANSFER_SRC_OPTIMAL;
const WRITTEN: vk::ImageLayout = vk::ImageLayout::TRANSFER_DST_OPTIMAL;
const DRAWN_INTO: vk::ImageLayout = vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL;
const SAMPLED: vk::ImageLayout = vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL;

/// The passes that may lie over the picture come one after the other, each present or not: one ends with TRANSFER and the next begins with it.
pub(super) const IN_TURN: Use = Use::new(vk::PipelineStageFlags2::TRANSFER, vk::AccessFlags2::empty());

/// Returns no rows if nothing is presented.
pub(super) fn rows(plan: &FramePlan, steps: &[Step]) -> Vec<Row> {
    let mut rows = match plan.presented {
        None => return Vec::new(),
        Some(PresentTarget::Straight(_) | PresentTarget::Enlarge(_)) => straight(plan, steps),
        Some(PresentTarget::Encode(_) | PresentTarget::EncodeKept(_)) => encoded(plan),
    };
    rows.extend([
        barrier(RowName::PANEL_TO_COPY, vk::ImageLayout::UNDEFINED, WRITTEN)
            .from(Endpoint::OUTSIDE, &[Use::START])
            .to(Endpoint::UPLOAD, &[COPY_WRITE])
            .because(
                "only while panels are shown: each change of a texture is a new image, whose layout changes before \
                 the write",
            ),
        barrier(RowName::UPLOAD_TO_PANELS, WRITTEN, SAMPLED)
            .from(Endpoint::UPLOAD, &[COPY_WRITE])
            .to(overlay::PASS.name, &[overlay::TEXTURE_READ])
            .because("only while panels are shown: OVERLAY samples what was copied"),
    ]);
    rows.push(
        row(RowName::PRESENT, SyncKind::Semaphore)
            .from(Endpoint::DEVICE, &[DEVICE_ACCESS])
            .to(Endpoint::PRESENTATION, &[Use::END])
            .because(
                "presentation reads the image when the frame is done; a semaphore makes all that was written \
                 available, and presentation sees it by itself",
            ),
    );
    rows
}

fn acquire((first, first_use): (Endpoint, Use), why: &'static str) -> Row {
    row(RowName::ACQUIRE, SyncKind::Semaphore)
        .from(Endpoint::PRESENTATION, &[Use::START])
        .to(first, &[first_use])
        .because(why)
}

/// The picture is the swapchain's image, or is copied into it.
fn straight(plan: &FramePlan, steps: &[Step]) -> Vec<Row> {
    let drawn = waits::first_user(plan, steps, Resource::Target(plan.picture()));
    let first = match drawn.filter(|_| !plan.is_copied_to_be_shown()) {
        None => (present::PASS.name, BEGIN),
        Some(first) => (first, ATTACH),
    };
    let why =
        "presentation may still read the image when the frame is recorded; the frame goes on until it needs the image";
    let mut rows = vec![acquire(first, why)];
    if plan.is_copied_to_be_shown() {
        rows.extend([
            // ANCHOR: swapchain-image
            barrier(RowName::SWAPCHAIN_TO_PRESENT, vk::ImageLayout::UNDEFINED, WRITTEN)
                .from(Endpoint::OUTSIDE, &[BEGIN])
                .to(present::PASS.name, &[WRITE])
                .because("the image's layout changes when it is acquired, before PRESENT writes all of it"),
            // ANCHOR_END: swapchain-image
            barrier(RowName::PRESENT_TO_SWAPCHAIN, WRITTEN, READ_BY_PRESENTATION)
                .from(present::PASS.name, &[WRITE])
                .to(Endpoint::PRESENTATION, &[IN_TURN])
                .because(
                    "presentation reads the image in its own layout, and sees it by the semaphore; OVERLAY before it \
                     waits for TRANSFER",
                ),
        ]);
    }
    // Each of these may be there or not, and leaves the image to the next one by TRANSFER.
    rows.extend([
        barrier(RowName::PICTURE_TO_SPLIT, READ_BY_PRESENTATION, WRITTEN)
            .from(Endpoint::OUTSIDE, &[IN_TURN])
            .to(split::PASS.name, &[split::WRITE])
            .because(
                "only while the window is split: the layout changes when the picture is there, which a row before \
                 this orders before TRANSFER, and SPLIT writes a part of it",
            ),
        barrier(RowName::SPLIT_TO_PICTURE, WRITTEN, READ_BY_PRESENTATION)
            .from(split::PASS.name, &[split::WRITE])
            .to(Endpoint::PRESENTATION, &[IN_TURN])
            .because(
                "only while the window is split: the layout changes back when SPLIT has written, before COPY and \
                 OVERLAY, which wait for TRANSFER",
            ),
        barrier(RowName::PICTURE_TO_COPY, READ_BY_PRESENTATION, COPIED)
            .from(Endpoint::OUTSIDE, &[IN_TURN])
            .to(copy::PASS.name, &[copy::READ])
            .because(
                "only for a screenshot: the layout changes when the picture is there, which a row before this orders \
                 before TRANSFER",
            ),
        barrier(RowName::COPY_TO_PICTURE, COPIED, READ_BY_PRESENTATION)
            .from(copy::PASS.name, &[copy::READ])
            .to(Endpoint::PRESENTATION, &[IN_TURN])
            .because(
                "only for a screenshot: the layout changes back when the image is copied, before OVERLAY, which \
                 waits for TRANSFER",
            ),
        barrier(RowName::PICTURE_TO_OVERLAY, READ_BY_PRESENTATION, DRAWN_INTO)
            .from(Endpoint::OUTSIDE, &[IN_TURN])
            .to(overlay::PASS.name, &[overlay::BLEND])
            .because(
                "only while panels are shown: the picture is whole, for a copy or not, when OVERLAY blends over it",
            ),
        barrier(RowName::OVERLAY_TO_PICTURE, DRAWN_INTO, READ_BY_PRESENTATION)
            .from(overlay::PASS.name, &[overlay::BLEND.writes()])
            .to(Endpoint::PRESENTATION, &[Use::END])
            .because("only while panels are shown: the layout changes back when OVERLAY has drawn"),
    ]);
    rows
}

/// The picture is the frame's own, or is copied into an image that panels are drawn over, and is encoded into the swapchain's image.
fn encoded(plan: &FramePlan) -> Vec<Row> {
    let mut rows = vec![
        acquire(
            (encode::PASS.name, ATTACH),
            "presentation may still read the image when the frame is recorded; all that writes colours waits, though ENCODE alone needs the image",
        ),
        // As above, but that COPY takes the picture as it lies.
        barrier(RowName::PICTURE_TO_SPLIT, COPIED, WRITTEN)
            .from(Endpoint::OUTSIDE, &[IN_TURN])
            .to(split::PASS.name, &[split::WRITE])
            .because(
                "only while the window is split: the layout changes when the picture is there, which a row before \
                 this orders before TRANSFER, and SPLIT writes a part of it",
            ),
        barrier(RowName::SPLIT_TO_PICTURE, WRITTEN, COPIED)
            .from(split::PASS.name, &[split::WRITE])
            .to(Endpoint::OUTSIDE, &[copy::READ])
            .because(
                "only while the window is split: COPY reads what SPLIT has written; OVERLAY and ENCODE wait for \
                 TRANSFER",
            ),
        barrier(RowName::PICTURE_TO_OVERLAY, COPIED, DRAWN_INTO)
            .from(Endpoint::OUTSIDE, &[IN_TURN])
            .to(overlay::PASS.name, &[overlay::BLEND])
            .because(
                "only while panels are shown: the picture is whole, and copied where that was asked for, when \
                 OVERLAY blends over it",
            ),
        barrier(RowName::OVERLAY_TO_PICTURE, DRAWN_INTO, COPIED)
            .from(overlay::PASS.name, &[overlay::BLEND.writes()])
            .to(Endpoint::OUTSIDE, &[IN_TURN])
            .because(
                "only while panels are shown: the layout changes back when OVERLAY has drawn, before ENCODE, which \
                 waits for TRANSFER",
            ),
        barrier(RowName::PICTURE_TO_ENCODE, COPIED, SAMPLED)
            .from(Endpoint::OUTSIDE, &[IN_TURN])
            .to(encode::PASS.name, &[encode::READ])
            .because(
                "ENCODE reads the picture with all that lies over it, and when it is copied where that was asked for",
            ),
        barrier(RowName::SWAPCHAIN_TO_ENCODE, vk::ImageLayout::UNDEFINED, DRAWN_INTO)
            .from(Endpoint::PRESENTATION, &[ATTACH])
            .to(encode::PASS.name, &[encode::WRITE])
            .because("the image's layout changes when it is acquired, before ENCODE writes all of it"),
        barrier(RowName::ENCODE_TO_PICTURE, SAMPLED, COPIED)
            .from(encode::PASS.name, &[encode::READ])
            .to(Endpoint::OUTSIDE, &[IN_TURN])
            .because(
                "the next frame draws its picture over this one when ENCODE has read it: that waits for TRANSFER, as \
                 for a copy",
            ),
        barrier(RowName::ENCODE_TO_SWAPCHAIN, DRAWN_INTO, READ_BY_PRESENTATION)
            .from(encode::PASS.name, &[encode::WRITE])
            .to(Endpoint::PRESENTATION, &[Use::END])
            .because("presentation reads the image in its own layout, and sees it by the semaphore"),
    ];
    if plan.is_copied_to_be_shown() {
        rows.extend([
            barrier(RowName::SWAPCHAIN_TO_PRESENT, vk::ImageLayout::UNDEFINED, WRITTEN)
                .from(Endpoint::OUTSIDE, &[BEGIN])
                .to(present::PASS.name, &[WRITE])
                .because(
                    "the layout of the image that ENCODE reads changes when the last ENCODE has read it, which waits \
                     for TRANSFER, and before PRESENT writes all of it",
                ),
            barrier(RowName::PRESENT_TO_SWAPCHAIN, WRITTEN, COPIED)
                .from(present::PASS.name, &[WRITE])
                .to(Endpoint::OUTSIDE, &[copy::READ])
                .because("COPY reads what PRESENT has written; SPLIT, OVERLAY and ENCODE wait for TRANSFER"),
        ]);
    }
    rows
}

impl Rows {
    /// The rows by which OVERLAY gets its textures.
    pub(in crate::frame) fn panel_order(&self) -> UploadOrder {
        let order = |name| self.find(name).map(Row::order);
        UploadOrder {
            first: order(RowName::PANEL_TO_COPY),
            written: order(RowName::UPLOAD_TO_PANELS),
            layouts: self.layouts,
            sync: self.sync,
            ..UploadOrder::default()
        }
    }
}

#[cfg(test)]
mod tests {
    use ash::vk::PipelineStageFlags2 as S;

    use super::super::{Rows, table};
    use super::*;
    use crate::frame::render_pass::PassDescription;
    use crate::passes::Resource;
    use crate::plan::{Encoding, OUTPUT_PLAIN, OUTPUT_SRGB, Transfer, samples};

    /// Sample plans of pictures.
    fn pictures() -> impl Iterator<Item = (String, FramePlan)> {
        let all = samples::of_every_kind();
        all.into_iter().filter(|(_, plan)| [OUTPUT_SRGB, OUTPUT_PLAIN].contains(&plan.output))
    }

    /// Plans of the pictures, drawn straight into a window's images.
    fn each_plan(check: impl Fn(&str, &FramePlan, &Rows)) {
        for (name, plan) in pictures() {
            let format = if plan.is_tiled() { vk::Format::B8G8R8A8_UNORM } else { vk::Format::B8G8R8A8_SRGB };
            assert!(rows(&plan, &[]).is_empty(), "{name}: nothing is presented without a window");
            let plan = plan.presented_as(PresentTarget::Straight(format));
            check(&name, &plan, &table(&plan));
        }
    }

    /// The plans of windows whose images ENCODE writes, with pictures that are kept and that are not.
    fn each_encoded_plan(check: impl Fn(&str, &FramePlan, &Rows)) {
        let encoded = Encoding { transfer: Transfer::Srgb, headroom: 1.0 };
        for (name, plan) in pictures() {
            for target in [PresentTarget::Encode(encoded), PresentTarget::EncodeKept(encoded)] {
                let plan = plan.clone().presented_as(target);
                check(&name, &plan, &table(&plan));
            }
        }
    }

    fn layouts(row: &Row) -> (vk::ImageLayout, vk::ImageLayout) {
        match row.carrier {
            SyncKind::ImageBarrier(old, new) => (old, new),
            other => panic!("{}: {other}", row.name),
        }
    }

    #[test]
    fn a_picture_that_is_encoded_lies_between_passes_as_without_a_window() {
        each_encoded_plan(|name, plan, table| {
            let mut headless = plan.clone();
            headless.presented = None;
            let headless = super::super::table(&headless);
            for row in headless.iter() {
                assert_eq!(table.find(row.name), Some(row), "{name}: the frame itself knows of no window");
            }
            for (into, out) in [
                (RowName::PICTURE_TO_SPLIT, RowName::SPLIT_TO_PICTURE),
                (RowName::PICTURE_TO_OVERLAY, RowName::OVERLAY_TO_PICTURE),
                (RowName::PICTURE_TO_ENCODE, RowName::ENCODE_TO_PICTURE),
            ] {
                assert_eq!(layouts(table.find(into).expect("a row")).0, COPIED, "{name}: {into}");
                assert_eq!(layouts(table.find(out).expect("a row")).1, COPIED, "{name}: {out}");
                assert!(table.find(into).expect("a row").before.stage.contains(S::TRANSFER), "{name}: {into}");
                assert!(table.find(out).expect("a row").after.stage.contains(S::TRANSFER), "{name}: {out}");
            }
        });
    }

    #[test]
    fn the_last_pass_leaves_the_picture_as_presentation_reads_it() {
        each_plan(|name, plan, table| {
            let passes = PassDescription::all(plan, table);
            let last = passes.last().expect("a render pass");
            let picture = last.attachments.iter().find(|(image, _)| *image == Resource::Target(plan.picture()));
            match plan.is_tiled() {
                true => assert!(picture.is_none() && table.find(RowName::PRESENT_TO_SWAPCHAIN).is_some(), "{name}"),
                false => {
                    let (_, picture) = picture.unwrap_or_else(|| panic!("{name}: no picture"));
                    assert_eq!(picture.final_layout, READ_BY_PRESENTATION, "{name}");
                    assert_eq!(Some(PresentTarget::Straight(picture.format)), plan.presented, "{name}");
                    assert!(table.find(RowName::PICTURE_TO_COPY).is_some(), "{name}");
                }
            }
        });
    }

    #[test]
    fn a_presented_frame_has_each_row_once_and_both_semaphores_stay() {
        let check = |name: &str, _: &FramePlan, table: &Rows| {
            let mut names: Vec<_> = table.iter().map(|row| row.name).collect();
            names.sort_unstable();
            assert!(names.windows(2).all(|pair| pair[0] != pair[1]), "{name}: {names:?}");
            for semaphore in [RowName::ACQUIRE, RowName::PRESENT] {
                assert!(table.without(semaphore).is_err(), "{name}");
            }
        };
        each_plan(check);
        each_encoded_plan(check);
    }
}
