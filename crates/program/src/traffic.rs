//! Memory traffic of render passes: loads, stores, and the bits of colour that a tile keeps for a pixel.

use std::fmt::Write as _;
use std::sync::Arc;

use afterlight::frame::render_pass::PassDescription;
use afterlight::frame::rows::Resource;
use afterlight::frame::rows::Rows;
use afterlight::gpu::{self, Device, format_bytes, is_depth, vk};
use afterlight::plan::FramePlan;
use serde::Serialize;

use crate::merging::MergingReport;
use crate::table::{TextTable, bytes};

/// Bits of colour a pixel up to which Arm advises that subpasses be merged; depth does not count (Arm GPU Best Practices, "Multipass rendering").
const TILE_BITS: u32 = 128;

/// A render pass of a frame.
#[derive(Debug, Serialize)]
pub struct PassTraffic {
    name: String,
    subpasses: usize,
    /// Bits of colour that some subpass and all before and after it need of a pixel at once.
    color_bits: u32,
    /// Bytes a frame that load operations read.
    loaded_bytes: u64,
    /// Bytes a frame that store operations write.
    stored_bytes: u64,
    /// The driver's answer on which subpasses it merges; `null` where it gives none.
    merging: Option<MergingReport>,
}

/// Returns the render passes of a plan's frames, except the shadow maps', which draw only maps that have changed.
///
/// # Errors
/// When a render pass cannot be made to ask the driver which subpasses it merges.
pub fn of(plan: &FramePlan, rows: &Rows, device: &Arc<Device>) -> gpu::Result<Vec<PassTraffic>> {
    let all = PassDescription::all(plan, rows);
    let with_merging = |pass: &PassDescription| {
        let merging = MergingReport::of(pass, device)?;
        Ok(PassTraffic { merging, ..PassTraffic::of(plan, pass) })
    };
    all.iter().filter(|pass| !pass.name.draws_maps()).map(with_merging).collect()
}

impl PassTraffic {
    fn of(plan: &FramePlan, pass: &PassDescription) -> Self {
        let pixels = |resource: Resource| match resource {
            Resource::Target(target) => plan.extent_of(target).map(u64::from).iter().product::<u64>(),
            _ => 0,
        };
        let texel = |own: &vk::AttachmentDescription| u64::from(format_bytes(own.format) * own.samples.as_raw());
        let sum = |is_moved: &dyn Fn(&vk::AttachmentDescription) -> bool| {
            let moved = pass.attachments.iter().filter(|(_, own)| is_moved(own));
            moved.map(|(resource, own)| pixels(*resource) * texel(own)).sum()
        };
        let users = |index: usize| {
            let uses = move |own: &&(usize, _)| {
                let (_, subpass): &(usize, &afterlight::frame::render_pass::SubpassAttachments) = own;
                subpass.references().any(|reference| reference.attachment as usize == index)
            };
            let all: Vec<_> = pass.subpasses.iter().enumerate().collect();
            let used: Vec<usize> = all.iter().filter(uses).map(|(subpass, _)| *subpass).collect();
            used.first().copied().zip(used.last().copied())
        };
        let live = |subpass: usize| -> u32 {
            let colors = pass.attachments.iter().enumerate().filter(|(_, (_, own))| !is_depth(own.format));
            let alive = colors
                .filter(|&(index, _)| users(index).is_some_and(|(first, last)| (first..=last).contains(&subpass)));
            alive.map(|(_, (_, own))| 8 * texel(own) as u32).sum()
        };
        Self {
            name: pass.name.to_string(),
            subpasses: pass.subpasses.len(),
            color_bits: (0..pass.subpasses.len()).map(live).max().unwrap_or(0),
            loaded_bytes: sum(&|own| own.load_op == vk::AttachmentLoadOp::LOAD),
            stored_bytes: sum(&|own| own.store_op == vk::AttachmentStoreOp::STORE),
            merging: None,
        }
    }
}

/// A table of them.
pub fn text(passes: &[PassTraffic]) -> String {
    let mut table = TextTable::new();
    table.row(["", "subpasses", "bits of colour a pixel", "loaded", "stored"]);
    for own in passes {
        let numbers = [own.subpasses.to_string(), own.color_bits.to_string()];
        let [subpasses, bits] = numbers;
        table.row([own.name.clone(), subpasses, bits, bytes(own.loaded_bytes), bytes(own.stored_bytes)]);
    }
    let sum = |of: fn(&PassTraffic) -> u64| bytes(passes.iter().map(of).sum());
    table.row([
        "a frame".to_owned(),
        String::new(),
        String::new(),
        sum(|own| own.loaded_bytes),
        sum(|own| own.stored_bytes),
    ]);
    let mut text = table.render();
    for own in passes.iter().filter(|own| own.subpasses > 1 && own.color_bits > TILE_BITS) {
        let _ = writeln!(
            text,
            "  Arm advises at most {TILE_BITS} bits of colour a pixel, depth apart, for subpasses to stay in a tile: the {} has {}",
            own.name, own.color_bits
        );
    }
    for own in passes {
        if let Some(merging) = &own.merging {
            text.push_str(&merging.text(&own.name));
        }
    }
    text
}
