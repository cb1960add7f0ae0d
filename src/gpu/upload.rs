//! Staged uploads: data goes through a bounded staging buffer to where the GPU reads it.
//!
//! This is the one place in `gpu` that chooses stages, accesses and layouts; each choice is explained here. Everything
//! is read by shaders or vertex fetch in submissions after [`Uploader::finish`], whose wait orders execution; what the
//! barriers add is that the writes become visible to those reads, which a fence alone does not do.

use std::sync::Arc;

use ash::vk;

use super::barrier::{ImageRange, image_barrier, memory_barrier};
use super::buffer::Buffer;
use super::command::CommandBuffer;
use super::device::Device;
use super::error::{Error, Result};
use super::image::{Image, can_blit, format_bytes};
use super::memory::{Location, MemoryKind};

/// How much staging memory is enough to keep the GPU busy: 32 MiB.
pub const DEFAULT_STAGING_BYTES: u64 = 32 << 20;

/// Less than this could not hold one row of the widest texture (16384 texels of 16 bytes).
const LEAST_SLOT_BYTES: u64 = 1 << 20;

/// Copies data to buffers and images through two staging buffers in turn: while the GPU copies out of one, the CPU
/// fills the other.
pub struct Uploader {
    device: Arc<Device>,
    slots: [Slot; 2],
    current: usize,
    /// Where and how the buffers that were written will be read.
    reads: (vk::PipelineStageFlags, vk::AccessFlags),
}

struct Slot {
    cmd: CommandBuffer,
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
    /// An uploader with two staging buffers that together have `staging_bytes` (at least 2 MiB are taken).
    ///
    /// # Errors
    /// [`Error::OutOfMemory`].
    pub fn new(device: &Arc<Device>, staging_bytes: u64) -> Result<Uploader> {
        let size = (staging_bytes / 2).max(LEAST_SLOT_BYTES);
        let slot = |name: &str| -> Result<Slot> {
            let usage = vk::BufferUsageFlags::TRANSFER_SRC;
            let staging = Buffer::new(device, name, size, usage, Location::Upload, MemoryKind::Staging)?;
            Ok(Slot { cmd: CommandBuffer::new(device, name)?, staging, used: 0, recording: false })
        };
        Ok(Uploader {
            device: Arc::clone(device),
            slots: [slot("upload 0")?, slot("upload 1")?],
            current: 0,
            reads: (vk::PipelineStageFlags::empty(), vk::AccessFlags::empty()),
        })
    }

    /// Copies `data` to `dst`, `offset` bytes from its start. Nothing may be using those bytes, and an uploader may
    /// write them once only. `dst` must live until [`Uploader::finish`].
    ///
    /// # Errors
    /// [`Error::Misuse`] if the bytes do not fit or `dst` is no `TRANSFER_DST`; a lost device.
    pub fn buffer(&mut self, dst: &Buffer, offset: u64, data: &[u8]) -> Result<()> {
        let end = offset.checked_add(data.len() as u64);
        if end.is_none_or(|end| end > dst.size) || !dst.usage.contains(vk::BufferUsageFlags::TRANSFER_DST) {
            let what = format!("{} bytes at {offset} cannot be uploaded to {dst:?} ({:?})", data.len(), dst.usage);
            return Err(Error::Misuse(what));
        }
        let reads = reads_of(dst.usage);
        self.reads = (self.reads.0 | reads.0, self.reads.1 | reads.1);
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

    /// Copies level 0 of every layer, rows and layers tightly packed, makes the other levels by linear blits, and leaves
    /// all of the image in `SHADER_READ_ONLY_OPTIMAL` for fragment shaders. The old content is lost. The image must live
    /// until [`Uploader::finish`].
    ///
    /// # Errors
    /// [`Error::Misuse`] for data of another size, or an image without `TRANSFER_DST` (and `TRANSFER_SRC`, for levels);
    /// [`Error::Unsupported`] for levels of a format that [`can_blit`] denies; a lost device.
    pub fn texture(&mut self, image: &Image, level0: &[u8]) -> Result<()> {
        let blits = image.mip_levels > 1;
        if blits && !can_blit(&self.device.physical, image.format) {
            return Err(Error::Unsupported(format!(
                "'{}' cannot make mip levels of {:?}, as '{}' needs",
                self.device.physical.name, image.format, image.name
            )));
        }
        let source = if blits { vk::ImageUsageFlags::TRANSFER_SRC } else { vk::ImageUsageFlags::empty() };
        check_texture(image, vk::ImageUsageFlags::TRANSFER_DST | source)?;
        self.make_writable(image)?;
        self.copy_level(image, 0, level0)?;
        let cmd = self.recording()?;
        if blits {
            self.blit_levels(cmd, image);
        }
        // The last level, or the only one, was written by a copy or a blit and never read.
        self.make_readable(cmd, image, image.mip_levels - 1, 1, WRITTEN);
        if blits {
            // The others were read by the blit into the next level. Their writes were made available before that; this
            // barrier waits for the read, changes the layout, and makes them visible to shaders.
            self.make_readable(cmd, image, 0, image.mip_levels - 1, BLITTED);
        }
        Ok(())
    }

    /// Copies all levels as given, from the largest on, each as [`Uploader::texture`] takes level 0.
    ///
    /// # Errors
    /// [`Error::Misuse`] for another number of levels or another size; a lost device.
    pub fn texture_levels(&mut self, image: &Image, levels: &[&[u8]]) -> Result<()> {
        check_texture(image, vk::ImageUsageFlags::TRANSFER_DST)?;
        if levels.len() != image.mip_levels as usize {
            let (given, name, has) = (levels.len(), &image.name, image.mip_levels);
            return Err(Error::Misuse(format!("{given} levels are given for '{name}', which has {has}")));
        }
        self.make_writable(image)?;
        for (level, data) in (0..).zip(levels) {
            self.copy_level(image, level, data)?;
        }
        let cmd = self.recording()?;
        self.make_readable(cmd, image, 0, image.mip_levels, WRITTEN);
        Ok(())
    }

    /// Submits what is left and waits until all of it is done.
    ///
    /// # Errors
    /// A lost device.
    pub fn finish(mut self) -> Result<()> {
        if self.reads.0 != vk::PipelineStageFlags::empty() {
            let cmd = self.recording()?;
            // All copies to buffers, those of earlier submissions included: a barrier orders everything submitted
            // before it to the same queue.
            memory_barrier(
                &self.device,
                cmd,
                (vk::PipelineStageFlags::TRANSFER, vk::AccessFlags::TRANSFER_WRITE),
                self.reads,
            );
        }
        self.submit_current()?;
        // The other slot's submission came before, so that it is done too when the last one is.
        for slot in &self.slots {
            if let Some(ticket) = slot.cmd.last_ticket() {
                self.device.wait(ticket)?;
            }
        }
        Ok(())
    }

    /// The whole image becomes a copy's target. What it held is dropped, so that there is nothing to wait for or keep.
    fn make_writable(&mut self, image: &Image) -> Result<()> {
        let cmd = self.recording()?;
        image_barrier(
            &self.device,
            cmd,
            image,
            (vk::PipelineStageFlags::TOP_OF_PIPE, vk::AccessFlags::empty(), vk::ImageLayout::UNDEFINED),
            WRITTEN,
        );
        Ok(())
    }

    /// Some levels, used last as `from` says, become readable for fragment shaders, which alone sample textures.
    fn make_readable(&self, cmd: vk::CommandBuffer, image: &Image, first: u32, count: u32, from: LevelUse) {
        image_barrier(
            &self.device,
            cmd,
            ImageRange::from(image).levels(first, count),
            from,
            (
                vk::PipelineStageFlags::FRAGMENT_SHADER,
                vk::AccessFlags::SHADER_READ,
                vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL,
            ),
        );
    }

    /// Makes each level from the one above it. Levels above the last end as blit sources.
    fn blit_levels(&self, cmd: vk::CommandBuffer, image: &Image) {
        for level in 1..image.mip_levels {
            // The level above was just written, by the copy or by the last blit, and is now read.
            let above = ImageRange::from(image).levels(level - 1, 1);
            image_barrier(&self.device, cmd, above, WRITTEN, BLITTED);
            let blit = vk::ImageBlit {
                src_subresource: layers_of(image, level - 1),
                src_offsets: corners(image.level_extent(level - 1)),
                dst_subresource: layers_of(image, level),
                dst_offsets: corners(image.level_extent(level)),
            };
            let (src, dst) = (BLITTED.2, WRITTEN.2);
            // SAFETY: the command buffer is recording, the image lives until `finish`, and its levels are in these
            // layouts.
            unsafe {
                self.device.raw.cmd_blit_image(cmd, image.raw, src, image.raw, dst, &[blit], vk::Filter::LINEAR);
            }
        }
    }

    /// Copies one level of every layer, as many rows at a time as the staging buffer has room for.
    fn copy_level(&mut self, image: &Image, level: u32, data: &[u8]) -> Result<()> {
        let extent = image.level_extent(level);
        let texel = u64::from(format_bytes(image.format));
        let row = u64::from(extent.width) * texel;
        let layer_bytes = row * u64::from(extent.height);
        if data.len() as u64 != layer_bytes * u64::from(image.layers) {
            return Err(Error::Misuse(format!("level {level} of {image:?} is given {} bytes", data.len())));
        }
        let row = usize::try_from(row).unwrap_or(usize::MAX);
        // Offsets are whole texels (for Vulkan), whole words, and what the device likes best.
        let alignment = texel * self.device.physical.limits.optimal_buffer_copy_offset_alignment.max(4);
        let layer_data = data.chunks_exact(row * extent.height as usize);
        for (layer, layer_data) in (0..).zip(layer_data) {
            let mut done = 0;
            while done < layer_data.len() {
                let (staged, taken) = self.stage(&layer_data[done..], row, alignment)?;
                let subresource =
                    vk::ImageSubresourceLayers { base_array_layer: layer, layer_count: 1, ..layers_of(image, level) };
                let region = vk::BufferImageCopy::default()
                    .buffer_offset(staged.offset)
                    .image_subresource(subresource)
                    .image_offset(vk::Offset3D { x: 0, y: (done / row) as i32, z: 0 })
                    .image_extent(vk::Extent3D { width: extent.width, height: (taken / row) as u32, depth: 1 });
                let layout = WRITTEN.2;
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
        let room_from = |slot: &Slot| {
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
            slot.cmd.begin()?;
            slot.recording = true;
            slot.used = 0;
        }
        Ok(slot.cmd.raw)
    }

    fn submit_current(&mut self) -> Result<()> {
        let slot = &mut self.slots[self.current];
        if slot.recording {
            slot.recording = false;
            slot.cmd.end()?;
            self.device.submit(&slot.cmd)?;
        }
        Ok(())
    }
}

type LevelUse = (vk::PipelineStageFlags, vk::AccessFlags, vk::ImageLayout);

/// A level that copies or blits write to.
const WRITTEN: LevelUse =
    (vk::PipelineStageFlags::TRANSFER, vk::AccessFlags::TRANSFER_WRITE, vk::ImageLayout::TRANSFER_DST_OPTIMAL);

/// A level that a blit reads.
const BLITTED: LevelUse =
    (vk::PipelineStageFlags::TRANSFER, vk::AccessFlags::TRANSFER_READ, vk::ImageLayout::TRANSFER_SRC_OPTIMAL);

/// Every read that a buffer's usage allows: vertex fetch, indirect draws, and the shaders of the stages that there are.
fn reads_of(usage: vk::BufferUsageFlags) -> (vk::PipelineStageFlags, vk::AccessFlags) {
    use vk::{AccessFlags as Access, BufferUsageFlags as Usage, PipelineStageFlags as Stage};
    let shaders = Stage::VERTEX_SHADER | Stage::FRAGMENT_SHADER | Stage::COMPUTE_SHADER;
    let table = [
        (Usage::VERTEX_BUFFER, Stage::VERTEX_INPUT, Access::VERTEX_ATTRIBUTE_READ),
        (Usage::INDEX_BUFFER, Stage::VERTEX_INPUT, Access::INDEX_READ),
        (Usage::INDIRECT_BUFFER, Stage::DRAW_INDIRECT, Access::INDIRECT_COMMAND_READ),
        (Usage::UNIFORM_BUFFER, shaders, Access::UNIFORM_READ),
        (Usage::STORAGE_BUFFER, shaders, Access::SHADER_READ),
        (Usage::TRANSFER_SRC, Stage::TRANSFER, Access::TRANSFER_READ),
    ];
    let of_usage = table.into_iter().filter(|(flag, ..)| usage.contains(*flag));
    of_usage.fold((Stage::empty(), Access::empty()), |all, (_, stage, access)| (all.0 | stage, all.1 | access))
}

fn check_texture(image: &Image, needed: vk::ImageUsageFlags) -> Result<()> {
    let sizes_known = format_bytes(image.format) > 0 && image.aspect() == vk::ImageAspectFlags::COLOR;
    if !sizes_known || image.samples != vk::SampleCountFlags::TYPE_1 || !image.usage.contains(needed) {
        return Err(Error::Misuse(format!("{image:?} of usage {:?} cannot be uploaded to", image.usage)));
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
