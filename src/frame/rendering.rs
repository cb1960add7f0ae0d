//! Rendering without render passes: the same subpasses and rows by `vkCmdBeginRendering`, with local read
//! (VK_KHR_dynamic_rendering_local_read).
//!
//! A render pass takes its rows as dependencies. Here they are pipeline barriers. Barriers between two subpasses stand inside the rendering, between
//! the draws of the two, and are by region; barriers from outside stand before the rendering, and barriers to outside after it. They also change the
//! layouts of the attachments, as a render pass does by itself, each by the attachment's own row.

use ash::vk;

use super::list::Subpass;
use super::render_pass::{PassDescription, SubpassAttachments};
use super::rows::Row;
use crate::gpu::barrier::{self, ImageRange};
use crate::gpu::sync::{Dependency, Use};
use crate::gpu::{Device, RenderingPlace, is_depth};
use crate::passes::Resource;

/// A render pass of the list without an object of Vulkan's.
pub struct Rendering {
    description: PassDescription,
    /// The name of the render pass, as the journal of commands has it.
    name: String,
    /// The barriers before the rendering, inside it before each subpass, and after it.
    enter: Vec<RenderingBarrier>,
    between: Vec<Vec<Dependency>>,
    leave: Vec<RenderingBarrier>,
    /// The draws of each subpass.
    pub places: Vec<RenderingPlace>,
    /// The indices of the colour attachments among all, or gaps, in the places that [`in_places`] finds.
    colors: Vec<Option<usize>>,
    depth: Option<usize>,
    /// Two attachments: the samples of the first are resolved into the second.
    resolve: Option<(usize, usize)>,
}

/// An attachment's image in one frame.
#[derive(Clone, Copy)]
pub struct Rendered {
    pub image: ImageRange,
    pub view: vk::ImageView,
}

impl Rendering {
    pub fn new(description: PassDescription) -> Self {
        let all = || description.subpasses.iter();
        let is_depth = |index: usize| is_depth(description.attachments[index].1.format);
        let is_resolved_into = |index: usize| all().any(|own| names(&own.resolve, index));
        let indices = || 0..description.attachments.len();
        let is_color = |&index: &usize| !is_depth(index) && !is_resolved_into(index);
        let colors = in_places(&description, indices().filter(is_color));
        let depth = indices().find(|&index| is_depth(index));
        let resolve = all().find_map(|own| {
            let (from, into) = (own.color.first()?, own.resolve.first()?);
            Some((from.attachment as usize, into.attachment as usize))
        });
        let places = all().map(|own| place(&description, own, &colors, depth)).collect();
        let enter = barriers(description.changes_at_the_start(), |index| {
            [description.attachments[index].1.initial_layout, description.rendering_layout(index)]
        });
        let leave = barriers(description.changes_at_the_end(), |index| {
            [description.rendering_layout(index), description.attachments[index].1.final_layout]
        });
        let into = |subpass: u32| {
            let inside = move |ends: &[u32; 2]| ends[1] == subpass && ends[0] != vk::SUBPASS_EXTERNAL;
            let rows = description.dependencies.iter().filter(move |(_, ends)| inside(ends));
            rows.map(|(row, _)| row.order()).collect()
        };
        let between = (0..).zip(all()).map(|(index, _)| into(index)).collect();
        let name = description.name.to_string();
        Self { name, enter, between, leave, places, colors, depth, resolve, description }
    }

    /// Records the barriers, and calls `draw` for each subpass between them. Images and clear values are in the order of the attachments.
    pub fn record(
        &self,
        (device, cmd): (&Device, vk::CommandBuffer),
        (images, clears): (&[Rendered], &[vk::ClearValue]),
        area: vk::Rect2D,
        subpasses: &[Subpass],
        mut draw: impl FnMut(&Subpass),
    ) {
        record_barriers((device, cmd), images, &self.enter);
        let attachment = |index: usize| {
            let (_, own) = self.description.attachments[index];
            let info = vk::RenderingAttachmentInfo::default()
                .image_view(images[index].view)
                .image_layout(self.description.rendering_layout(index))
                .load_op(own.load_op)
                .store_op(own.store_op)
                .clear_value(clears.get(index).copied().unwrap_or_default());
            match self.resolve.filter(|&(from, _)| from == index) {
                Some((_, into)) => info
                    .resolve_mode(vk::ResolveModeFlags::AVERAGE)
                    .resolve_image_view(images[into].view)
                    .resolve_image_layout(self.description.rendering_layout(into)),
                None => info,
            }
        };
        let gap = vk::RenderingAttachmentInfo::default();
        let colors: Vec<_> = self.colors.iter().map(|index| index.map_or(gap, attachment)).collect();
        let depth = self.depth.map(attachment);
        let mut info = vk::RenderingInfo::default().render_area(area).layer_count(1).color_attachments(&colors);
        if let Some(depth) = &depth {
            info = info.depth_attachment(depth);
        }
        // SAFETY: `cmd` is being recorded outside a render pass, and the images are in these layouts: barriers above, or the uses before, have left them so.
        unsafe { device.raw.begin_rendering(cmd, &self.name, &info) };
        for ((subpass, place), orders) in subpasses.iter().zip(&self.places).zip(&self.between) {
            for &order in orders {
                barrier::local_barrier(device, cmd, order);
            }
            // SAFETY: inside of rendering with as many colour attachments.
            unsafe {
                device.raw.cmd_set_rendering_attachment_locations(cmd, &place.location_info());
                device.raw.cmd_set_rendering_input_attachment_indices(cmd, &place.input_info());
            }
            draw(subpass);
        }
        // SAFETY: begun above, and every draw is recorded.
        unsafe { device.raw.cmd_end_rendering(cmd) };
        record_barriers((device, cmd), images, &self.leave);
    }
}

/// The barriers that carry out one row before or after rendering, with the layouts that change in them by the index of the attachment.
struct RenderingBarrier {
    order: Dependency,
    changed: Vec<(usize, [vk::ImageLayout; 2])>,
    orders_more: bool,
}

fn barriers(around: Vec<AroundRendering>, change: impl Fn(usize) -> [vk::ImageLayout; 2]) -> Vec<RenderingBarrier> {
    let barrier = |own: AroundRendering| RenderingBarrier {
        // A layout changes without a row only where an experiment has dropped that: then nothing orders the change.
        order: own.row.as_ref().map_or(Dependency::between(Use::START, Use::END), Row::order),
        changed: own.changed.into_iter().map(|index| (index, change(index))).collect(),
        orders_more: own.orders_more,
    };
    around.into_iter().map(barrier).collect()
}

fn record_barriers((device, cmd): (&Device, vk::CommandBuffer), images: &[Rendered], barriers: &[RenderingBarrier]) {
    for RenderingBarrier { order, changed, orders_more } in barriers {
        let changed: Vec<_> = changed.iter().map(|&(index, layouts)| (images[index].image, layouts)).collect();
        barrier::image_barriers(device, cmd, &changed, *order);
        if *orders_more {
            barrier::memory_barrier(device, cmd, *order);
        }
    }
}

/// The barriers before or after rendering that carry out one row.
#[derive(Debug, Clone)]
pub struct AroundRendering {
    /// Absent for a layout change without a row.
    pub row: Option<Row>,
    /// The indices of the attachments whose layouts change by it.
    pub changed: Vec<usize>,
    /// The row also orders uses of resources whose layout stays.
    pub orders_more: bool,
}

impl PassDescription {
    /// The layout that an attachment has in all subpasses that use it, where they are parts of one rendering.
    pub fn rendering_layout(&self, index: usize) -> vk::ImageLayout {
        let mut all = self.subpasses.iter().flat_map(SubpassAttachments::references);
        let own = all.find(|own| own.attachment as usize == index);
        own.map_or(vk::ImageLayout::UNDEFINED, |own| own.layout)
    }

    /// The barriers before the rendering, in their order.
    pub fn changes_at_the_start(&self) -> Vec<AroundRendering> {
        let first = |index: usize| self.users(index).next();
        self.around(
            |ends| ends[0] == vk::SUBPASS_EXTERNAL,
            |ends, index| first(index) == Some(ends[1]),
            |index| {
                let own = self.layout_at(first(index), index);
                own.is_some_and(|layout| layout != self.attachments[index].1.initial_layout)
            },
        )
    }

    /// The barriers after it.
    pub fn changes_at_the_end(&self) -> Vec<AroundRendering> {
        let last = |index: usize| self.users(index).last();
        self.around(
            |ends| ends[1] == vk::SUBPASS_EXTERNAL,
            |ends, index| last(index) == Some(ends[0]),
            |index| {
                let own = self.layout_at(last(index), index);
                own.is_some_and(|layout| layout != self.attachments[index].1.final_layout)
            },
        )
    }

    /// The subpasses that use an attachment.
    fn users(&self, index: usize) -> impl Iterator<Item = u32> {
        let uses = move |own: &SubpassAttachments| names_any(own, index);
        (0..).zip(&self.subpasses).filter(move |(_, own)| uses(own)).map(|(subpass, _)| subpass)
    }

    fn layout_at(&self, subpass: Option<u32>, index: usize) -> Option<vk::ImageLayout> {
        let own = self.subpasses.get(subpass? as usize)?;
        own.references().find(|own| own.attachment as usize == index).map(|own| own.layout)
    }

    /// Each row that `is_here` goes with the attachments that change their layout there: a row is about an attachment if it names it, and `is_of` the subpass that uses it first or last.
    fn around(
        &self,
        is_here: impl Fn([u32; 2]) -> bool,
        is_of: impl Fn([u32; 2], usize) -> bool,
        changes: impl Fn(usize) -> bool,
    ) -> Vec<AroundRendering> {
        let mut left: Vec<usize> = (0..self.attachments.len()).filter(|&index| changes(index)).collect();
        let mut all: Vec<AroundRendering> = Vec::new();
        for (row, ends) in self.dependencies.iter().filter(|(_, ends)| is_here(*ends)) {
            let is_about = |index: &usize| is_of(*ends, *index) && row.resources.contains(&self.attachments[*index].0);
            let changed: Vec<usize> = left.iter().copied().filter(is_about).collect();
            left.retain(|index| !changed.contains(index));
            let is_changed = |resource: &Resource| changed.iter().any(|&index| self.attachments[index].0 == *resource);
            let orders_more = !row.resources.iter().all(is_changed);
            all.push(AroundRendering { row: Some(row.clone()), changed, orders_more });
        }
        if !left.is_empty() {
            all.push(AroundRendering { row: None, changed: left, orders_more: false });
        }
        all
    }
}

fn names(references: &[vk::AttachmentReference], index: usize) -> bool {
    references.iter().any(|own| own.attachment as usize == index)
}

fn names_any(subpass: &SubpassAttachments, index: usize) -> bool {
    subpass.references().any(|own| own.attachment as usize == index)
}

/// Puts each colour attachment of the first subpass at its location, and the others into free places, with as many attachments as locations and input
/// indices. Vulkan requires none of this. Without it, lavapipe of Mesa 25.0 drops a shader's writes to a location that is no index of an attachment,
/// whatever the location is mapped to; and layer 1.4.309 warns if the attachment of that index is a gap.
fn in_places(description: &PassDescription, colors: impl Iterator<Item = usize>) -> Vec<Option<usize>> {
    let all = &description.subpasses;
    let most = all.iter().map(|own| own.color.len().max(own.input.len())).max().unwrap_or(0);
    let mut placed: Vec<Option<usize>> = vec![None; most];
    let first = all.first().map_or(&[][..], |own| &own.color);
    for (location, own) in first.iter().enumerate().filter(|(_, own)| own.attachment != vk::ATTACHMENT_UNUSED) {
        placed[location] = Some(own.attachment as usize);
    }
    for color in colors {
        if !placed.contains(&Some(color)) {
            match placed.iter_mut().find(|place| place.is_none()) {
                Some(place) => *place = Some(color),
                None => placed.push(Some(color)),
            }
        }
    }
    placed
}

/// The attachments as the draws of one subpass use them.
fn place(
    description: &PassDescription,
    subpass: &SubpassAttachments,
    colors: &[Option<usize>],
    depth: Option<usize>,
) -> RenderingPlace {
    let format = |index: usize| description.attachments[index].1.format;
    let position = |references: &[vk::AttachmentReference], index: usize| {
        let found = references.iter().position(|own| own.attachment as usize == index);
        found.map_or(vk::ATTACHMENT_UNUSED, |position| position as u32)
    };
    let of_each = |references: &[vk::AttachmentReference]| {
        colors.iter().map(|index| index.map_or(vk::ATTACHMENT_UNUSED, |index| position(references, index))).collect()
    };
    RenderingPlace {
        colors: colors.iter().map(|index| index.map_or(vk::Format::UNDEFINED, format)).collect(),
        locations: of_each(&subpass.color),
        inputs: of_each(&subpass.input),
        depth: depth.map(format),
        depth_input: depth.map_or(vk::ATTACHMENT_UNUSED, |index| position(&subpass.input, index)),
    }
}
