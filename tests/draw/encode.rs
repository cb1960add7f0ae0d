//! ENCODE alone: it encodes light as the standards say, for every transfer function, from black to beyond the brightest that a display shows.

use crate::common::gpu::{Gpu, on_gpu};
use crate::common::hdr::{perceptual_quantizer, to_rec2020};
use afterlight::gpu::sync::{Dependency, Layouts, SyncVersion, Use};
use afterlight::gpu::{
    self, Buffer, CommandBuffer, Image, ImageDesc, Location, MemoryKind, UploadOrder, Uploader, barrier, vk,
};
use afterlight::passes::copy;
use afterlight::passes::curves::encode_srgb;
use afterlight::passes::encode::{self, Encode, WHITE_NITS};
use afterlight::plan::Transfer;
use glam::DVec3;
use half::f16;

/// In units of white: black, the straight part of sRGB, greys, white, 1000 nits, the brightest of PQ, and light that no display shows.
const LIGHT: [f32; 10] = [0.0, 1e-4, 0.002, 0.01, 0.18, 0.5, 1.0, 4.926, 49.26, 60000.0];
const EXTENT: vk::Extent2D = vk::Extent2D { width: LIGHT.len() as u32, height: 5 };

/// Greys, colours with a negative channel, which no picture has and no display can show, and each of the primaries with a tenth of the others.
fn picture() -> Vec<[f32; 3]> {
    let mixed = |own: usize, light: f32| [0, 1, 2].map(|channel| if channel == own { light } else { 0.1 * light });
    let below_black = |light: f32| [-light, light, 0.0];
    let mixed = (0..3).flat_map(|own| LIGHT.map(|light| mixed(own, light)));
    LIGHT.map(|light| [light; 3]).into_iter().chain(LIGHT.map(below_black)).chain(mixed).collect()
}

/// Returns light as half floats hold it.
fn stored(light: f32) -> f64 {
    f64::from(f16::from_f32(light).to_f32())
}

/// Returns the values of the standards, in 64 bits.
fn expected(transfer: Transfer, light: [f64; 3]) -> [f64; 3] {
    let light = light.map(|channel| channel.max(0.0));
    let white = f64::from(WHITE_NITS);
    match transfer {
        Transfer::Srgb => light.map(|channel| encode_srgb(channel.min(1.0))),
        Transfer::Linear => light.map(|channel| channel * white / 80.0),
        Transfer::Pq => (to_rec2020() * DVec3::from(light) * white).to_array().map(perceptual_quantizer),
    }
}

/// Returns the bytes that ENCODE draws into an image of this format, as they lie in memory.
fn drawn(gpu: &Gpu, transfer: Transfer, format: vk::Format, bytes: u64) -> gpu::Result<Vec<u8>> {
    let device = &gpu.device;
    let desc = |name, format, usage| ImageDesc {
        name,
        format,
        extent: EXTENT,
        usage,
        location: Location::Device,
        kind: MemoryKind::Attachment,
        ..ImageDesc::default()
    };
    let sampled = vk::ImageUsageFlags::SAMPLED | vk::ImageUsageFlags::TRANSFER_DST;
    let light = Image::new(device, &desc("light", vk::Format::R16G16B16A16_SFLOAT, sampled))?;
    let texels = picture().into_iter().flat_map(|[r, g, b]| [r, g, b, 1.0]);
    let texels: Vec<u8> = texels.flat_map(|channel| f16::from_f32(channel).to_ne_bytes()).collect();
    let mut uploader = Uploader::new(device, 1 << 16, UploadOrder::before(encode::READ, encode::READ))?;
    uploader.texture(&light, &[&texels])?;
    uploader.finish()?;

    let attached = vk::ImageUsageFlags::COLOR_ATTACHMENT | vk::ImageUsageFlags::TRANSFER_SRC;
    let shown = Image::new(device, &desc("shown", format, attached))?;
    let mut encode = Encode::new(device, format, transfer, (Layouts::Optimal, SyncVersion::One))?;
    encode.resize(light.view, &[shown.view], EXTENT)?;

    let size = bytes * u64::from(EXTENT.width * EXTENT.height);
    let usage = vk::BufferUsageFlags::TRANSFER_DST;
    let buffer = Buffer::new(device, "copy", size, usage, Location::ReadBack, MemoryKind::ReadBack)?;
    let mut cmd = CommandBuffer::new(device, "encode")?;
    cmd.begin()?;
    let order = Dependency::between;
    let (new, drawn_into) = (vk::ImageLayout::UNDEFINED, vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL);
    barrier::image_barrier(device, cmd.raw, &shown, order(Use::START, encode::WRITE), [new, drawn_into]);
    encode.record(cmd.raw, 0);
    let copied = vk::ImageLayout::TRANSFER_SRC_OPTIMAL;
    barrier::image_barrier(device, cmd.raw, &shown, order(encode::WRITE, copy::READ), [drawn_into, copied]);
    let region = vk::BufferImageCopy::default()
        .image_subresource(
            vk::ImageSubresourceLayers::default().aspect_mask(vk::ImageAspectFlags::COLOR).layer_count(1),
        )
        .image_extent(vk::Extent3D { width: EXTENT.width, height: EXTENT.height, depth: 1 });
    // SAFETY: `cmd` is being recorded outside a render pass; the buffer holds the whole image.
    unsafe { device.raw.cmd_copy_image_to_buffer(cmd.raw, shown.raw, copied, buffer.raw, &[region]) };
    barrier::buffer_barrier(device, cmd.raw, &buffer, order(copy::WRITE, copy::HOST_READ));
    cmd.end()?;
    let ticket = device.submit(&cmd)?;
    device.wait(ticket)?;
    buffer.read(0, size)
}

#[test]
fn light_becomes_what_the_standards_say() {
    on_gpu(|gpu| {
        for transfer in [Transfer::Srgb, Transfer::Pq, Transfer::Linear] {
            let bytes = drawn(gpu, transfer, vk::Format::R32G32B32A32_SFLOAT, 16).unwrap_or_else(|e| panic!("{e}"));
            let texels = bytes.as_chunks::<16>().0.iter().map(|texel| {
                let channel = |index: usize| texel[4 * index..4 * index + 4].try_into().map(f32::from_ne_bytes);
                [0, 1, 2].map(|index| f64::from(channel(index).expect("4 bytes")))
            });
            for (texel, light) in texels.zip(picture()) {
                let expected = expected(transfer, light.map(stored));
                for (own, expected) in texel.into_iter().zip(expected) {
                    // A quarter of a code of 10 bits; of light, a part in ten thousand. The matrix has four digits.
                    let within = 0.25 / 1023.0 * expected.max(1.0);
                    assert!((own - expected).abs() <= within, "{transfer:?} of {light:?}: {own} for {expected}");
                }
            }
        }
    });
}

#[test]
fn ten_bits_hold_one_of_the_nearest_codes() {
    on_gpu(|gpu| {
        for transfer in [Transfer::Srgb, Transfer::Pq] {
            let format = vk::Format::A2B10G10R10_UNORM_PACK32;
            let bytes = drawn(gpu, transfer, format, 4).unwrap_or_else(|error| panic!("{error}"));
            for (texel, light) in bytes.as_chunks::<4>().0.iter().zip(picture()) {
                let word = u32::from_ne_bytes(*texel);
                for (shift, expected) in [0, 10, 20].into_iter().zip(expected(transfer, light.map(stored))) {
                    let (code, expected) = (f64::from(word >> shift & 0x3ff), expected * 1023.0);
                    // "One of the two integers closest" (specification, "Conversion From Floating-Point to Normalized Fixed-Point").
                    assert!((code - expected).abs() <= 1.25, "{transfer:?} of {light:?}: {code} for {expected}");
                }
            }
        }
    });
}
