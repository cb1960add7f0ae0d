//! Pictures that come back from the device.

use ash::vk;

use super::rows::{RowName, Rows};
use super::{Error, Picture, Pixels, Renderer};
use crate::gpu::{self, CommandBuffer, Device, barrier};
use crate::passes::copy::Copy;
#[cfg(feature = "present")]
use crate::passes::curves::encode_srgb;

impl Renderer {
    /// The last frame's picture. Waits for it.
    ///
    /// # Errors
    /// When nothing was drawn yet, the device is lost, or it lacks the memory for a copy.
    pub fn read_back(&mut self) -> Result<Picture, Error> {
        self.start_read_back()?;
        self.finish_read_back()
    }

    /// Submits the copy of the last frame's picture. Frames can be drawn while it is under way.
    ///
    /// # Errors
    /// As [`Renderer::read_back`].
    pub fn start_read_back(&mut self) -> Result<(), Error> {
        if self.frames.iter().all(|frame| frame.ticket.is_none()) {
            return Err(gpu::Error::Misuse("a picture is read back before any was drawn".into()).into());
        }
        if self.copy.is_none() {
            let cmd = CommandBuffer::new(&self.device, "read-back")?;
            self.copy = Some((cmd, Copy::new(&self.device, &self.plan)?));
        }
        let Some(output) = self.frame.output(&self.plan) else {
            return Err(gpu::Error::Misuse("a picture that is shown by a window is read back".into()).into());
        };
        let (cmd, copy) = self.copy.as_mut().expect("made above");
        cmd.begin_by(self.plan.sync)?;
        copy.record(&self.device, cmd.raw, (output.raw, self.plan.layouts));
        host_barrier(&self.device, cmd.raw, copy, &self.rows);
        cmd.end()?;
        self.device.submit(cmd)?;
        Ok(())
    }

    /// Waits for the copy that was started last; its picture.
    ///
    /// # Errors
    /// When none was started, or the device is lost.
    pub fn finish_read_back(&mut self) -> Result<Picture, Error> {
        picture_of(self.finished_copy()?, self.plan.size, self.plan.output)
    }

    /// The last frame's picture in its copy, for frames whose output is linear: RGBA.
    ///
    /// # Errors
    /// As [`Renderer::read_back`], and when the output is not linear.
    pub(super) fn look_at_linear<T>(&mut self, look: impl FnOnce(&[f32]) -> T) -> Result<T, Error> {
        self.start_read_back()?;
        let copy = self.finished_copy()?;
        let linear = copy.buffer.read_with(0, copy.buffer.size, |bytes| match bytemuck::try_cast_slice(bytes) {
            Ok(texels) if self.plan.output == vk::Format::R32G32B32A32_SFLOAT => Some(look(texels)),
            _ => match decode(self.plan.output, bytes) {
                Pixels::LinearF32(texels) => Some(look(&texels)),
                Pixels::Srgb8(_) => None,
            },
        })?;
        linear.ok_or_else(|| gpu::Error::Misuse("frames of several samples are not linear".into()).into())
    }

    /// Waits for the copy that was started last.
    fn finished_copy(&self) -> Result<&Copy, Error> {
        let started = self.copy.as_ref().and_then(|(cmd, copy)| Some((cmd.last_ticket()?, copy)));
        let Some((ticket, copy)) = started else {
            return Err(gpu::Error::Misuse("a picture is read back of which no copy was started".into()).into());
        };
        // The row "copy-to-host".
        self.device.wait(ticket)?;
        Ok(copy)
    }
}

/// Lets the CPU map what COPY wrote.
pub(super) fn host_barrier(device: &Device, cmd: vk::CommandBuffer, copy: &Copy, rows: &Rows) {
    if let Some(row) = rows.find(RowName::PICTURE_TO_HOST) {
        barrier::buffer_barrier(device, cmd, &copy.buffer, row.order());
    }
}

/// Returns the picture that was copied out of an image of this size and format, once the copy is done.
///
/// # Errors
/// When the device is lost.
pub(super) fn picture_of(copy: &Copy, size: [u32; 2], format: vk::Format) -> Result<Picture, Error> {
    let pixels = copy.buffer.read_with(0, copy.buffer.size, |bytes| decode(format, bytes))?;
    Ok(Picture { size, pixels })
}

/// Variant of [`picture_of`] for a picture before ENCODE: sRGB of 8 bits a channel, clipped at white.
///
/// # Errors
/// When the device is lost.
#[cfg(feature = "present")]
pub(super) fn picture_up_to_white(copy: &Copy, size: [u32; 2]) -> Result<Picture, Error> {
    // There are fewer half floats than channels of a picture.
    let code = |bits: u16| (encode_srgb(half::f16::from_bits(bits).to_f64().clamp(0.0, 1.0)) * 255.0).round() as u8;
    let codes: Vec<u8> = (0..=u16::MAX).map(code).collect();
    let bytes = copy.buffer.read(0, copy.buffer.size)?;
    let shown = |channel: &[u8; 2]| codes[usize::from(u16::from_ne_bytes(*channel))];
    let pixels = bytes.as_chunks::<2>().0.iter().map(shown).collect();
    Ok(Picture { size, pixels: Pixels::Srgb8(pixels) })
}

fn decode(format: vk::Format, bytes: &[u8]) -> Pixels {
    match format {
        vk::Format::R32G32B32A32_SFLOAT => {
            let float = |chunk: &[u8]| f32::from_ne_bytes([chunk[0], chunk[1], chunk[2], chunk[3]]);
            Pixels::LinearF32(bytes.chunks_exact(4).map(float).collect())
        }
        vk::Format::R16G16B16A16_SFLOAT => {
            let half = |chunk: &[u8]| half::f16::from_ne_bytes([chunk[0], chunk[1]]).to_f32();
            Pixels::LinearF32(bytes.chunks_exact(2).map(half).collect())
        }
        vk::Format::B8G8R8A8_SRGB | vk::Format::B8G8R8A8_UNORM => {
            Pixels::Srgb8(bytes.as_chunks::<4>().0.iter().flat_map(|&[b, g, r, a]| [r, g, b, a]).collect())
        }
        _ => Pixels::Srgb8(bytes.to_vec()),
    }
}
