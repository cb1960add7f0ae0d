//! Staged uploads: data goes through a bounded staging buffer to where the GPU reads it.
//!
//! The caller chooses the barriers: an [`UploadOrder`] says which uses each of them waits for and holds back. The CPU waits for the GPU only when the
//! staging buffers have no room: the barriers order later submissions to the same queue, and the staging buffers go through the retire queue.

use std::sync::Arc;

use ash::vk;

use super::barrier::{Contents, Half, ImageRange, hand_over, image_barrier, memory_barrier};
use super::buffer::Buffer;
use super::command::CommandBuffer;
use super::device::Device;
use super::error::{Error, Result};
use super::image::{Image, can_blit, format_block};
use super::memory::{Location, MemoryKind};
use super::queues::Queue;
use super::submission::{Part, SubmitOptions};
use super::sync::{Dependency, Layouts, SyncVersion, Use};

/// Copies to buffers and levels of textures; blits to levels.
pub const COPY_WRITE: Use = Use::new(vk::PipelineStageFlags2::COPY, vk::AccessFlags2::TRANSFER_WRITE);
/// Blits from levels.
pub const BLIT_READ: Use = Use::new(vk::PipelineStageFlags2::BLIT, vk::AccessFlags2::TRANSFER_READ);
/// Writes levels of a texture.
pub const BLIT_WRITE: Use = Use::new(vk::PipelineStageFlags2::BLIT, vk::AccessFlags2::TRANSFER_WRITE);
/// Levels of a texture are written by copies, or by blits.
pub const LEVEL_WRITE: Use = COPY_WRITE.or(BLIT_WRITE);

/// The order that each barrier of an uploader makes; `None` where no upload needs it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct UploadOrder {
    /// Copies to buffers, before the buffers' reads.
    pub buffers: Option<Dependency>,
    /// The layout change of a new texture, before its first write.
    pub first: Option<Dependency>,
    /// The write to a level, before the blit from it.
    pub blit: Option<Dependency>,
    /// The blit from a level, before shaders sample it.
    pub blitted: Option<Dependency>,
    /// The write to a level that is not blitted from, before shaders sample it.
    pub written: Option<Dependency>,
    /// The layouts of the textures.
    pub layouts: Layouts,
    /// The API by which uploads are recorded.
    pub sync: SyncVersion,
    /// Copies are made on the transfer queue; all else on the one that reads the data.
    pub handover: Option<UploadHandover>,
}

/// The way of copied data from the transfer queue to the one that reads it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct UploadHandover {
    /// The first scope of the release, and the second one of the acquire ([`hand_over`]).
    pub ownership: Dependency,
    /// The stages that wait for the copies.
    pub wait: vk::PipelineStageFlags2,
}

impl UploadOrder {
    /// Layout of a level that copies or blits write to.
    fn written_layout(&self) -> vk::ImageLayout {
        self.layouts.of(vk::ImageLayout::TRANSFER_DST_OPTIMAL)
    }

    /// Layout of a level that a blit reads.
    fn blitted_layout(&self) -> vk::ImageLayout {
        self.layouts.of(vk::ImageLayout::TRANSFER_SRC_OPTIMAL)
    }

    /// The order of uploads which are read as `buffers` and `textures` say, and by nothing else.
    pub fn before(buffers: Use, textures: Use) -> UploadOrder {
        let order = |before: Use, after| Some(Dependency::between(before.writes(), after));
        UploadOrder {
            buffers: order(COPY_WRITE, buffers),
            first: order(Use::START, LEVEL_WRITE),
            blit: order(LEVEL_WRITE, BLIT_READ),
            blitted: order(BLIT_READ, textures),
            written: order(LEVEL_WRITE, textures),
            layouts: Layouts::Optimal,
            sync: SyncVersion::One,
            handover: None,
        }
    }
}

/// Less than this could not hold one row of the widest texture (16384 texels of 16 bytes).
const LEAST_SLOT_BYTES: u64 = 1 << 20;

/// Copies data to buffers and images through two staging buffers in turn: while the GPU copies out of one, the CPU
/// fills the other.
pub struct Uploader {
    device: Arc<Device>,
    slots: [StagingSlot; 2],
    current: usize,
    order: UploadOrder,
    /// The buffers that were written.
    written: Vec<vk::Buffer>,
}

struct StagingSlot {
    cmd: CommandBuffer,
    /// What the graphics queue does after copies on the transfer queue.
    after: Option<CommandBuffer>,
    staging: Buffer,
    used: u64,
    recording: bool,
}

/// A place in the staging buffer that is being filled.
struct Staged {
    cmd: vk::CommandBuffer,
    staging: vk::Buffer,
    offset: u64,
}

impl Uploader {
    /// An uploader with two staging buffers that together have `staging_bytes` (at least 2 MiB are taken), whose barriers
    /// order what `order` says.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`].
    pub fn new(device: &Arc<Device>, staging_bytes: u64, order: UploadOrder) -> Result<Uploader> {
        let size = (staging_bytes / 2).max(LEAST_SLOT_BYTES);
        let slot = |name: &str| -> Result<StagingSlot> {
            let usage = vk::BufferUsageFlags::TRANSFER_SRC;
            let staging = Buffer::new(device, name, size, usage, Location::Upload, MemoryKind::Staging)?;
            let queue = if order.handover.is_some() { Queue::Transfer } else { Queue::Graphics };
            let after = order.handover.map(|_| CommandBuffer::new(device, &format!("{name}, acquired")));
            let cmd = CommandBuffer::on(device, queue, name)?;
            Ok(StagingSlot { cmd, after: after.transpose()?, staging, used: 0, recording: false })
        };
        Ok(Uploader {
            device: Arc::clone(device),
            slots: [slot("upload 0")?, slot("upload 1")?],
            current: 0,
            order,
            written: Vec::new(),
        })
    }

    /// Copies `data` to `dst`, `offset` bytes from its start. Nothing may be using these bytes, and an uploader may write them only once. `dst` must
    /// live until [`Uploader::finish`].
    ///
    /// # Errors
    /// [`Error::Misuse`] if the bytes do not fit or `dst` is no `TRANSFER_DST`; a lost device.
    pub fn buffer(&mut self, dst: &Buffer, offset: u64, data: &[u8]) -> Result<()> {
        let end = offset.checked_add(data.len() as u64);
        if end.is_none_or(|end| end > dst.size) || !dst.usage.contains(vk::BufferUsageFlags::TRANSFER_DST) {
            let what = format!("{} bytes at {offset} cannot be uploaded to {dst:?} ({:?})", data.len(), dst.usage);
            return Err(Error::Misuse(what));
        }
        planned(self.order.buffers, dst)?;
        if !self.written.contains(&dst.raw) {
            self.written.push(dst.raw);
        }
        let mut done = 0;
        while done < data.len() {
            let rest = &data[done..];
            let (staged, taken) = self.stage(rest, 1, 4)?;
            let region =
                vk::BufferCopy { src_offset: staged.offset, dst_offset: offset + done as u64, size: taken as u64 };
            // SAFETY: the command buffer is recording, both buffers are alive (`dst` until `finish`, as promised), and
            // the region lies within both.
            unsafe { self.device.raw.cmd_copy_buffer(staged.cmd, staged.staging, dst.raw, &[region]) };
            done += taken;
        }
        Ok(())
    }

    /// Copies levels with all their layers, rows and layers tightly packed: all levels, or only the first, from which linear blits then make the
    /// others. Leaves the whole image in `SHADER_READ_ONLY_OPTIMAL`, or in the layout that the order replaces it by. The old content is lost. The
    /// image must live until [`Uploader::finish`].
    ///
    /// # Errors
    /// [`Error::Misuse`] for another number of levels, data of another size, or an image without `TRANSFER_DST` (and `TRANSFER_SRC`, for
    /// blits); [`Error::Unsupported`] for blits of a format that [`can_blit`] denies; a lost device.
    pub fn texture(&mut self, image: &Image, levels: &[impl AsRef<[u8]>]) -> Result<()> {
        let blits = image.mip_levels > 1 && levels.len() == 1;
        if blits && !can_blit(&self.device.physical, image.format) {
            return Err(Error::Unsupported(format!(
                "'{}' cannot make mip levels of {:?}, as '{}' needs",
                self.device.physical.name, image.format, image.name
            )));
        }
        let source = if blits { vk::ImageUsageFlags::TRANSFER_SRC } else { vk::ImageUsageFlags::empty() };
        if !blits && levels.len() as u64 != u64::from(image.mip_levels) {
            let (given, needed) = (levels.len(), image.mip_levels);
            return Err(Error::Misuse(format!("{image:?} is given {given} levels, not {needed} or the first")));
        }
        check_texture(image, vk::ImageUsageFlags::TRANSFER_DST | source)?;
        (0..).zip(levels).try_for_each(|(level, data)| check_level(image, level, data.as_ref()))?;
        let written = planned(self.order.written, image)?;
        let blitting = match blits {
            true => Some((planned(self.order.blit, image)?, planned(self.order.blitted, image)?)),
            false => None,
        };
        self.make_writable(image)?;
        for (level, data) in (0..).zip(levels) {
            self.copy_level(image, level, data.as_ref())?;
        }
        let cmd = self.after_copies((&[(ImageRange::from(image), self.order.written_layout())], &[]))?;
        if let Some((blit, _)) = blitting {
            self.blit_levels(cmd, image, blit);
        }
        // The levels written by a copy, or by the last blit, and never read.
        let first_unread = if blits { image.mip_levels - 1 } else { 0 };
        self.make_readable(
            cmd,
            image,
            (first_unread, image.mip_levels - first_unread),
            (written, self.order.written_layout()),
        );
        if let Some((_, blitted)) = blitting {
            // A blit into the next level read each of the other levels. The levels' writes were made available before that; this barrier waits for
            // the read, changes the layout, and makes the writes visible to shaders.
            self.make_readable(cmd, image, (0, image.mip_levels - 1), (blitted, self.order.blitted_layout()));
        }
        Ok(())
    }

    /// Submits the rest. Later submissions find all data in its place; nothing is waited for.
    ///
    /// # Errors
    /// A lost device.
    pub fn finish(mut self) -> Result<()> {
        if !self.written.is_empty() {
            let written = std::mem::take(&mut self.written);
            let cmd = self.after_copies((&[], &written))?;
            // All copies to buffers, including earlier submissions': a barrier orders everything submitted before it to the same queue, or to a queue
            // that it has waited for.
            memory_barrier(&self.device, cmd, planned(self.order.buffers, "buffers")?);
        }
        self.submit_current()
    }

    /// Makes the whole image a copy's target. The barrier drops the image's content, so it need not wait for anything or keep anything.
    fn make_writable(&mut self, image: &Image) -> Result<()> {
        let first = planned(self.order.first, image)?;
        let cmd = self.recording()?;
        self.change(cmd, image, first, (vk::ImageLayout::UNDEFINED, self.order.written_layout()));
        Ok(())
    }

    /// `count` levels from `first`, now in `old` layout, become readable for shaders.
    fn make_readable(
        &self,
        cmd: vk::CommandBuffer,
        image: &Image,
        (first, count): (u32, u32),
        (order, old): (Dependency, vk::ImageLayout),
    ) {
        let levels = ImageRange::from(image).levels(first, count);
        self.change(cmd, levels, order, (old, self.order.layouts.of(vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL)));
    }

    fn change(
        &self,
        cmd: vk::CommandBuffer,
        target: impl Into<ImageRange>,
        order: Dependency,
        (old, new): (vk::ImageLayout, vk::ImageLayout),
    ) {
        image_barrier(&self.device, cmd, target, order, [old, new]);
    }

    /// Makes each level from the one above it. Levels above the last end as blit sources.
    fn blit_levels(&self, cmd: vk::CommandBuffer, image: &Image, order: Dependency) {
        for level in 1..image.mip_levels {
            self.blit_level(cmd, image, level, order);
        }
    }

    /// Makes a level, ready to be written, from the one above it.
    fn blit_level(&self, cmd: vk::CommandBuffer, image: &Image, level: u32, order: Dependency) {
        // The level above was just written, by the copy or by the last blit, and is now read.
        let (src, dst) = (self.order.blitted_layout(), self.order.written_layout());
        self.change(cmd, ImageRange::from(image).levels(level - 1, 1), order, (dst, src));
        let blit = vk::ImageBlit {
            src_subresource: layers_of(image, level - 1),
            src_offsets: corners(image.level_extent(level - 1)),
            dst_subresource: layers_of(image, level),
            dst_offsets: corners(image.level_extent(level)),
        };
        // SAFETY: the command buffer is recording, the images live until it is submitted and beyond, and their levels are in these
        // layouts.
        unsafe { self.device.raw.cmd_blit_image(cmd, image.raw, src, image.raw, dst, &[blit], vk::Filter::LINEAR) };
    }

    /// Copies a level of every layer, as many rows of texels or blocks at a time as the staging buffer has room for.
    fn copy_level(&mut self, image: &Image, level: u32, data: &[u8]) -> Result<()> {
        let extent = image.level_extent(level);
        let (edge, bytes) = format_block(image.format);
        let row = u64::from(extent.width.div_ceil(edge)) * u64::from(bytes);
        let row = usize::try_from(row).unwrap_or(usize::MAX);
        // Offsets are whole texels or blocks (for Vulkan), whole words, and multiples of the device's optimal alignment.
        let alignment = u64::from(bytes) * self.device.physical.limits.optimal_buffer_copy_offset_alignment.max(4);
        let layer_data = data.chunks_exact(row * extent.height.div_ceil(edge) as usize);
        for (layer, layer_data) in (0..).zip(layer_data) {
            let mut done = 0;
            while done < layer_data.len() {
                let (staged, taken) = self.stage(&layer_data[done..], row, alignment)?;
                let subresource =
                    vk::ImageSubresourceLayers { base_array_layer: layer, layer_count: 1, ..layers_of(image, level) };
                let first = (done / row) as u32 * edge;
                // The last row of blocks may reach beyond the image.
                let height = ((taken / row) as u32 * edge).min(extent.height - first);
                let region = vk::BufferImageCopy::default()
                    .buffer_offset(staged.offset)
                    .image_subresource(subresource)
                    .image_offset(vk::Offset3D { x: 0, y: first as i32, z: 0 })
                    .image_extent(vk::Extent3D { width: extent.width, height, depth: 1 });
                let layout = self.order.written_layout();
                // SAFETY: the command buffer is recording, the staging buffer is alive, the image until `finish`, as
                // promised; the region lies within both.
                unsafe {
                    let raw = &self.device.raw;
                    raw.cmd_copy_buffer_to_image(staged.cmd, staged.staging, image.raw, layout, &[region]);
                }
                done += taken;
            }
        }
        Ok(())
    }

    /// Puts as much of `data` as has room, in whole units of `unit` bytes, into a staging buffer at a multiple of
    /// `alignment`, and says where it lies and how much it is. Changes to the other staging buffer when one is full.
    fn stage(&mut self, data: &[u8], unit: usize, alignment: u64) -> Result<(Staged, usize)> {
        let unit = unit.max(1);
        let room_from = |slot: &StagingSlot| {
            let offset = slot.used.next_multiple_of(alignment.max(1));
            let room = usize::try_from(slot.staging.size.saturating_sub(offset)).unwrap_or(usize::MAX);
            (offset, room / unit * unit)
        };
        let (mut offset, mut room) = room_from(&self.slots[self.current]);
        if room == 0 {
            self.submit_current()?;
            self.current = 1 - self.current;
            // Waits until the GPU has copied out of the other staging buffer, then starts it over.
            self.recording()?;
            (offset, room) = room_from(&self.slots[self.current]);
        }
        if room == 0 {
            let limit = self.slots[self.current].staging.size;
            return Err(Error::TooLarge { what: "a texture's row in bytes".to_owned(), asked: unit as u64, limit });
        }
        let cmd = self.recording()?;
        let taken = data.len().min(room);
        let slot = &mut self.slots[self.current];
        slot.staging.write(offset, &data[..taken])?;
        slot.used = offset + taken as u64;
        Ok((Staged { cmd, staging: slot.staging.raw, offset }, taken))
    }

    /// The current slot's command buffer, recording.
    fn recording(&mut self) -> Result<vk::CommandBuffer> {
        let slot = &mut self.slots[self.current];
        if !slot.recording {
            slot.cmd.begin_by(self.order.sync)?;
            if let Some(after) = &mut slot.after {
                after.begin_by(self.order.sync)?;
            }
            slot.recording = true;
            slot.used = 0;
        }
        Ok(slot.cmd.raw)
    }

    /// The command buffer for work after the copies, on the queue that reads them. If the transfer queue copies, it releases the copied resources,
    /// and this command buffer acquires them.
    fn after_copies(&mut self, contents: Contents<'_>) -> Result<vk::CommandBuffer> {
        let copies = self.recording()?;
        let (Some(after), Some(handover)) = (&self.slots[self.current].after, self.order.handover) else {
            return Ok(copies);
        };
        let queues = [Queue::Transfer, Queue::Graphics];
        hand_over(&self.device, copies, Half::Release, queues, contents, handover.ownership);
        hand_over(&self.device, after.raw, Half::Acquire, queues, contents, handover.ownership);
        Ok(after.raw)
    }

    fn submit_current(&mut self) -> Result<()> {
        let slot = &mut self.slots[self.current];
        if slot.recording {
            slot.recording = false;
            slot.cmd.end()?;
            match (&mut slot.after, self.order.handover) {
                (Some(after), Some(handover)) => {
                    after.end()?;
                    let parts = &[Part { cmd: &slot.cmd, after: None }];
                    let around = SubmitOptions { parts, after: Some((0, handover.wait)), ..SubmitOptions::default() };
                    self.device.submit_with(after, &around)?;
                }
                _ => _ = self.device.submit(&slot.cmd)?,
            }
        }
        Ok(())
    }
}

/// The barrier for an upload, which the uploader's order must have.
fn planned(order: Option<Dependency>, what: impl std::fmt::Debug) -> Result<Dependency> {
    order.ok_or_else(|| Error::Misuse(format!("the uploader has no order for {what:?}")))
}

/// Checks that the image can be uploaded to. Before anything is recorded, so that an image is left as it was when this fails.
fn check_texture(image: &Image, needed: vk::ImageUsageFlags) -> Result<()> {
    let (_, bytes) = format_block(image.format);
    let can_copy = bytes > 0 && image.aspect() == vk::ImageAspectFlags::COLOR;
    if !can_copy || image.samples != vk::SampleCountFlags::TYPE_1 || !image.usage.contains(needed) {
        return Err(Error::Misuse(format!("{image:?} of usage {:?} cannot be uploaded to", image.usage)));
    }
    Ok(())
}

/// Checks that a level is given as many bytes as it has.
fn check_level(image: &Image, level: u32, data: &[u8]) -> Result<()> {
    let (edge, bytes) = format_block(image.format);
    let extent = image.level_extent(level);
    let blocks = [extent.width, extent.height].map(|own| u64::from(own.div_ceil(edge))).iter().product::<u64>();
    let (needed, given) = (blocks * u64::from(bytes) * u64::from(image.layers), data.len());
    if given as u64 != needed {
        return Err(Error::Misuse(format!("level {level} of {image:?} is given {given} bytes, not {needed}")));
    }
    Ok(())
}

fn layers_of(image: &Image, mip_level: u32) -> vk::ImageSubresourceLayers {
    vk::ImageSubresourceLayers {
        aspect_mask: image.aspect(),
        mip_level,
        base_array_layer: 0,
        layer_count: image.layers,
    }
}

fn corners(extent: vk::Extent2D) -> [vk::Offset3D; 2] {
    [vk::Offset3D::default(), vk::Offset3D { x: extent.width as i32, y: extent.height as i32, z: 1 }]
}
