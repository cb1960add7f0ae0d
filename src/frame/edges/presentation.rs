//! The rows of frames that a window shows, besides those of other frames: two semaphores, and what is a copy on the way.
//!
//! Within a frame the swapchain's image is as any output: its row from OUTSIDE waits, instead of for COPY, for the stage at which the semaphore
//! of the acquired image lets the frame go on ([`ATTACH`], [`BEGIN`]). The image's layout changes before the first write and after that stage,
//! and so after presentation has read the image: the two make a chain.

use ash::vk;

use super::main_pass::first_of_picture;
use super::{Carrier, Edge, Place};
use crate::gpu::sync::{DEVICE_ACCESS, Use};
use crate::passes::present::{ATTACH, BEGIN, WRITE};
use crate::passes::{copy, overlay, split};
use crate::plan::FramePlan;

const READ_BY_PRESENTATION: vk::ImageLayout = vk::ImageLayout::PRESENT_SRC_KHR;
const COPIED: vk::ImageLayout = vk::ImageLayout::TRANSFER_SRC_OPTIMAL;
const WRITTEN: vk::ImageLayout = vk::ImageLayout::TRANSFER_DST_OPTIMAL;
const DRAWN_OVER: vk::ImageLayout = vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL;

/// What may lie over the picture comes one after the other, each there or not: one ends with TRANSFER and the next begins with it.
const IN_TURN: Use = Use::new(vk::PipelineStageFlags::TRANSFER, vk::AccessFlags::empty());

/// None where nothing is presented.
pub(super) fn rows(plan: &FramePlan) -> Vec<Edge> {
    if plan.presented.is_none() {
        return Vec::new();
    }
    let row = |name, (old, new), places, uses, why| Edge::new(name, Carrier::ImageBarrier(old, new), places, uses, why);
    let (first, first_use) = match plan.is_tiled() {
        true => (Place::Present, BEGIN),
        false => (first_of_picture(plan), ATTACH),
    };
    let mut rows = vec![Edge::new(
        "acquire",
        Carrier::Semaphore,
        (Place::Presentation, first),
        (Use::START, first_use),
        "presentation may still read the image when the frame is recorded; the frame goes on until it needs the image",
    )];
    if plan.is_tiled() {
        rows.extend([
            row(
                "swapchain-to-present",
                (vk::ImageLayout::UNDEFINED, WRITTEN),
                (Place::Outside, Place::Present),
                (BEGIN, WRITE),
                "the image's layout changes when it is acquired, before PRESENT writes all of it",
            ),
            row(
                "present-to-swapchain",
                (WRITTEN, READ_BY_PRESENTATION),
                (Place::Present, Place::Presentation),
                (WRITE, IN_TURN),
                "presentation reads the image in its own layout, and sees it by the semaphore; OVERLAY before it waits for TRANSFER",
            ),
        ]);
    }
    // Each of these may be there or not, and leaves the image to the next one by TRANSFER.
    rows.extend([
        row(
            "swapchain-to-split",
            (READ_BY_PRESENTATION, WRITTEN),
            (Place::Outside, Place::Split),
            (IN_TURN, split::WRITE),
            "only while the window is split: the layout changes when the picture is there, which a row before this orders before TRANSFER, and \
             SPLIT writes a part of it",
        ),
        row(
            "split-to-swapchain",
            (WRITTEN, READ_BY_PRESENTATION),
            (Place::Split, Place::Presentation),
            (split::WRITE, IN_TURN),
            "only while the window is split: the layout changes back when SPLIT has written, before COPY and OVERLAY, which wait for TRANSFER",
        ),
        row(
            "swapchain-to-copy",
            (READ_BY_PRESENTATION, COPIED),
            (Place::Outside, Place::Copy),
            (IN_TURN, copy::READ),
            "only for a screenshot: the layout changes when the picture is there, which a row before this orders before TRANSFER",
        ),
        row(
            "copy-to-swapchain",
            (COPIED, READ_BY_PRESENTATION),
            (Place::Copy, Place::Presentation),
            (copy::READ, IN_TURN),
            "only for a screenshot: the layout changes back when the image is copied, before OVERLAY, which waits for TRANSFER",
        ),
        row(
            "picture-to-overlay",
            (READ_BY_PRESENTATION, DRAWN_OVER),
            (Place::Outside, Place::Overlay),
            (IN_TURN, overlay::BLEND),
            "only while panels are shown: the picture is whole, for a copy or not, when OVERLAY blends over it",
        ),
        row(
            "overlay-to-swapchain",
            (DRAWN_OVER, READ_BY_PRESENTATION),
            (Place::Overlay, Place::Presentation),
            (overlay::BLEND.writes(), Use::END),
            "only while panels are shown: the layout changes back when OVERLAY has drawn",
        ),
    ]);
    rows.push(Edge::new(
        "present",
        Carrier::Semaphore,
        (Place::Device, Place::Presentation),
        (DEVICE_ACCESS, Use::END),
        "presentation reads the image when the frame is done; a semaphore makes all that was written available, and presentation sees it by itself",
    ));
    rows
}

#[cfg(test)]
mod tests {
    use ash::vk::PipelineStageFlags as S;

    use super::super::{Edges, table};
    use super::*;
    use crate::frame::render_pass::{PassDescription, Resource};
    use crate::plan::{OUTPUT_PLAIN, OUTPUT_SRGB, samples};
    use crate::targets::Target;

    /// Sample plans as a window has them.
    fn each_plan(check: impl Fn(&str, &FramePlan, &Edges)) {
        let all = [samples::plans(), samples::forward_plans(), samples::tiled_plans()].concat();
        let shown = |plan: &FramePlan| [OUTPUT_SRGB, OUTPUT_PLAIN].contains(&plan.output);
        for (name, plan) in all.into_iter().filter(|(_, plan)| shown(plan)) {
            let format = if plan.is_tiled() { vk::Format::B8G8R8A8_UNORM } else { vk::Format::B8G8R8A8_SRGB };
            assert!(rows(&plan).is_empty(), "{name}: nothing is presented without a window");
            let plan = plan.presented_as(format);
            check(&name, &plan, &table(&plan));
        }
    }

    #[test]
    fn the_image_changes_its_layout_only_after_presentation_has_let_go_of_it() {
        each_plan(|name, plan, table| {
            let acquire = table.row("acquire");
            let into = table
                .iter()
                .filter(|edge| edge.from == Place::Outside && edge.to == acquire.to && edge.name != "read-back");
            let rows: Vec<_> = into.filter(|edge| edge.carrier != Carrier::Semaphore).collect();
            // Both in one chain: the row's first scope has the stage at which the semaphore lets go.
            let chained = rows.iter().any(|row| row.before.stage.contains(acquire.after.stage));
            assert!(chained, "{name}: {:?} does not reach {rows:?}", acquire.after.stage);
            let expected = if plan.is_tiled() { S::TRANSFER } else { S::COLOR_ATTACHMENT_OUTPUT };
            assert_eq!(acquire.after.stage, expected, "{name}: shadow maps and G-buffer wait for no image");
        });
    }

    #[test]
    fn the_last_pass_leaves_the_picture_as_presentation_reads_it() {
        each_plan(|name, plan, table| {
            let pass = if plan.fxaa { PassDescription::fxaa(plan, table) } else { PassDescription::main(plan, table) };
            let wanted = if plan.fxaa { Resource::SmoothedPicture } else { Resource::Target(Target::Output) };
            let picture = pass.attachments.iter().find(|(resource, _)| *resource == wanted);
            match plan.is_tiled() {
                true => assert!(picture.is_none() && table.find("present-to-swapchain").is_some(), "{name}"),
                false => {
                    let (_, picture) = picture.unwrap_or_else(|| panic!("{name}: no picture"));
                    assert_eq!(picture.final_layout, READ_BY_PRESENTATION, "{name}");
                    assert_eq!(Some(picture.format), plan.presented, "{name}");
                    assert!(table.find("swapchain-to-copy").is_some(), "{name}");
                }
            }
        });
    }

    #[test]
    fn another_picture_is_whole_when_a_part_of_it_is_copied_and_stays_until_that_is_done() {
        let all = [samples::plans(), samples::forward_plans(), samples::tiled_plans()].concat();
        let shown = |plan: &FramePlan| [OUTPUT_SRGB, OUTPUT_PLAIN].contains(&plan.output);
        for (name, plan) in all.into_iter().filter(|(_, plan)| shown(plan)) {
            for format in [vk::Format::B8G8R8A8_SRGB, vk::Format::B8G8R8A8_UNORM] {
                let plan = plan.clone().copied_to(format);
                let table = table(&plan);
                let ready = table.row("read-back").after;
                assert_eq!(ready, split::READ, "{name}: what makes the picture ready for a copy");
                // The picture is first touched, and its layout changed, by a row that waits for earlier copies.
                let first = if plan.is_tiled() { Place::Tiled } else { first_of_picture(&plan) };
                let first = if plan.emissive && !plan.is_tiled() && plan.hdr.is_none() && !plan.fxaa {
                    Place::Geometry
                } else {
                    first
                };
                let into = table.iter().find(|edge| (edge.from, edge.to) == (Place::Outside, first));
                let waits = into.is_some_and(|edge| edge.before.stage.contains(split::READ.stage));
                assert!(waits, "{name}: {first} waits for no copy: {into:?}");
                assert!(table.find("swapchain-to-split").is_none(), "{name}: only what is presented is split");
            }
        }
    }

    #[test]
    fn what_comes_over_the_picture_chains_through_transfer() {
        each_plan(|name, _, table| {
            for (into, out) in
                [("swapchain-to-split", "split-to-swapchain"), ("swapchain-to-copy", "copy-to-swapchain")]
            {
                assert!(table.row(into).before.stage.contains(S::TRANSFER), "{name}: {into}");
                assert!(table.row(out).after.stage.contains(S::TRANSFER), "{name}: {out}");
            }
            assert!(table.row("picture-to-overlay").before.stage.contains(S::TRANSFER), "{name}");
        });
    }

    #[test]
    fn a_presented_frame_has_each_row_once_and_both_semaphores_stay() {
        each_plan(|name, _, table| {
            let mut names: Vec<_> = table.iter().map(|edge| edge.name).collect();
            names.sort_unstable();
            assert!(names.windows(2).all(|pair| pair[0] != pair[1]), "{name}: {names:?}");
            for semaphore in ["acquire", "present"] {
                assert!(table.without(semaphore).is_err(), "{name}");
            }
        });
    }
}
