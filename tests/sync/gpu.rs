//! Promises of `gpu`, on this machine's driver and under its validation layer. Without a loader, a driver or the layer these tests fail, and say what
//! to install.

use std::error::Error as StdError;
use std::sync::Arc;

use afterlight::gpu::sync::{Dependency, Use};
use afterlight::gpu::upload::COPY_WRITE;
use afterlight::gpu::{
    self, Buffer, CommandBuffer, Device, DeviceChoice, Image, ImageDesc, Instance, InstanceOptions, Location,
    MemoryKind, Message, MessageKind, Queue, Timestamps, UploadOrder, Uploader, Validation, barrier, vk,
};

pub(super) const HOST_READ: Use = Use::new(vk::PipelineStageFlags2::HOST, vk::AccessFlags2::HOST_READ);

pub(super) type TestResult = Result<(), Box<dyn StdError>>;

/// Runs `test` on a device under synchronization validation, then drops everything and fails on any message about this program, including the ones
/// from tearing down.
pub(super) fn with_device(test: impl Fn(&Arc<Device>) -> TestResult) -> TestResult {
    // Neither mode of the layer notices all that the other does.
    for sync_shader_heuristic in [false, true] {
        let options = InstanceOptions {
            validation: Validation::Synchronization,
            sync_shader_heuristic,
            ..InstanceOptions::default()
        };
        let instance = Instance::new(&options).map_err(|error| error.to_string())?;
        let log = instance.message_log();
        let device = Device::new(&instance, &DeviceChoice::Auto).map_err(|error| error.to_string())?;
        test(&device)?;
        assert_eq!(device.live_objects(), Vec::<String>::new());
        assert_eq!(Arc::strong_count(&device), 1);
        drop((device, instance));
        let ours: Vec<_> = log.take().into_iter().filter(Message::is_about_this_program).collect();
        assert!(ours.is_empty(), "{ours:#?}");
    }
    Ok(())
}

/// Bytes that differ from their neighbours, from the row above and from the same place in another block.
fn pattern(len: usize) -> Vec<u8> {
    (0..len as u32).map(|index| (index.wrapping_mul(2_654_435_761) >> 24) as u8).collect()
}

fn read_back_buffer(device: &Arc<Device>, bytes: u64) -> gpu::Result<Buffer> {
    let usage = vk::BufferUsageFlags::TRANSFER_DST;
    Buffer::new(device, "read-back", bytes, usage, Location::ReadBack, MemoryKind::ReadBack)
}

/// Makes the writes of transfers readable for the CPU.
fn transfer_to_host(device: &Device, cmd: vk::CommandBuffer) {
    barrier::memory_barrier(device, cmd, Dependency::between(COPY_WRITE, HOST_READ));
}

/// The texels of one level of all layers, of an image that was used last as `from`.
pub(super) fn read_level(
    device: &Arc<Device>,
    image: &Image,
    level: u32,
    (before, layout): (Use, vk::ImageLayout),
) -> gpu::Result<Vec<u8>> {
    let extent = image.level_extent(level);
    let texels = u64::from(extent.width) * u64::from(extent.height) * u64::from(image.layers);
    let buffer = read_back_buffer(device, texels * u64::from(gpu::format_bytes(image.format)))?;
    let mut cmd = CommandBuffer::new(device, "read back")?;
    cmd.begin()?;
    let as_source = vk::ImageLayout::TRANSFER_SRC_OPTIMAL;
    let after = Use::new(vk::PipelineStageFlags2::TRANSFER, vk::AccessFlags2::TRANSFER_READ);
    let range = barrier::ImageRange::from(image).levels(level, 1);
    barrier::image_barrier(device, cmd.raw, range, Dependency::between(before, after), [layout, as_source]);
    let subresource = vk::ImageSubresourceLayers {
        aspect_mask: image.aspect(),
        mip_level: level,
        base_array_layer: 0,
        layer_count: image.layers,
    };
    let region = vk::BufferImageCopy::default().image_subresource(subresource).image_extent(vk::Extent3D {
        width: extent.width,
        height: extent.height,
        depth: 1,
    });
    // SAFETY: recording; image and buffer outlive the wait below, and the region fits both.
    unsafe { device.raw.cmd_copy_image_to_buffer(cmd.raw, image.raw, as_source, buffer.raw, &[region]) };
    transfer_to_host(device, cmd.raw);
    cmd.end()?;
    device.wait(device.submit(&cmd)?)?;
    buffer.read(0, buffer.size)
}

const SAMPLED: (Use, vk::ImageLayout) = (
    Use::new(vk::PipelineStageFlags2::FRAGMENT_SHADER, vk::AccessFlags2::SHADER_READ),
    vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL,
);

pub(super) fn texture_desc(name: &str, width: u32, height: u32, mip_levels: u32) -> ImageDesc<'_> {
    ImageDesc {
        name,
        format: vk::Format::R8G8B8A8_UNORM,
        extent: vk::Extent2D { width, height },
        mip_levels,
        usage: vk::ImageUsageFlags::SAMPLED | vk::ImageUsageFlags::TRANSFER_DST | vk::ImageUsageFlags::TRANSFER_SRC,
        kind: MemoryKind::Texture,
        ..ImageDesc::default()
    }
}

/// An uploader of buffers that are copied again and of textures that fragment shaders sample.
fn uploader(device: &Arc<Device>, staging_bytes: u64) -> gpu::Result<Uploader> {
    let copied = Use::new(vk::PipelineStageFlags2::TRANSFER, vk::AccessFlags2::TRANSFER_READ);
    let sampled = Use::new(vk::PipelineStageFlags2::FRAGMENT_SHADER, vk::AccessFlags2::SHADER_READ);
    Uploader::new(device, staging_bytes, UploadOrder::before(copied, sampled))
}

#[test]
fn a_buffer_larger_than_the_staging_memory_arrives_whole() -> TestResult {
    with_device(|device| {
        let data = pattern(5 * 1024 * 1024 + 12);
        let usage = vk::BufferUsageFlags::VERTEX_BUFFER
            | vk::BufferUsageFlags::TRANSFER_DST
            | vk::BufferUsageFlags::TRANSFER_SRC;
        let size = data.len() as u64;
        let buffer = Buffer::new(device, "vertices", size, usage, Location::Device, MemoryKind::Geometry)?;
        let mut uploader = uploader(device, 0)?;
        uploader.buffer(&buffer, 0, &data[..1000])?;
        uploader.buffer(&buffer, 1000, &data[1000..])?;
        uploader.finish()?;

        let back = read_back_buffer(device, size)?;
        let mut cmd = CommandBuffer::new(device, "copy back")?;
        cmd.begin()?;
        let region = vk::BufferCopy { src_offset: 0, dst_offset: 0, size };
        // SAFETY: recording; both buffers outlive the wait below.
        unsafe { device.raw.cmd_copy_buffer(cmd.raw, buffer.raw, back.raw, &[region]) };
        transfer_to_host(device, cmd.raw);
        cmd.end()?;
        device.wait(device.submit(&cmd)?)?;
        assert!(back.read(0, size)? == data);
        Ok(())
    })
}

#[test]
fn each_mip_level_is_the_mean_of_the_one_above() -> TestResult {
    with_device(|device| {
        let image = Image::new(device, &texture_desc("texture", 4, 4, 3))?;
        // Four blocks of 2x2 texels, each of one colour, but for the first.
        let mut texels = [[0_u8; 4]; 16];
        for (index, texel) in texels.iter_mut().enumerate() {
            let block = index % 4 / 2 + index / 8 * 2;
            *texel = [[0, 0, 0, 255], [200, 0, 0, 255], [0, 100, 0, 255], [0, 0, 60, 255]][block];
        }
        (texels[0], texels[5]) = ([40, 80, 120, 255], [40, 80, 120, 255]);
        let mut uploader = uploader(device, 0)?;
        assert!(
            uploader.texture(&image, &[bytemuck::cast_slice::<_, u8>(&texels[1..])]).is_err(),
            "level 0 of another size"
        );
        uploader.texture(&image, &[bytemuck::cast_slice::<_, u8>(&texels)])?;
        uploader.finish()?;

        assert_eq!(read_level(device, &image, 0, SAMPLED)?, bytemuck::cast_slice::<_, u8>(&texels));
        let level1 = read_level(device, &image, 1, SAMPLED)?;
        let means = [[20_u8, 40, 60, 255], [200, 0, 0, 255], [0, 100, 0, 255], [0, 0, 60, 255]];
        assert_close(&level1, means.as_flattened());
        assert_close(&read_level(device, &image, 2, SAMPLED)?, &[55, 35, 30, 255]);
        Ok(())
    })
}

/// A linear filter may round either way.
fn assert_close(found: &[u8], expected: &[u8]) {
    let close = found.iter().zip(expected).all(|(a, b)| a.abs_diff(*b) <= 1);
    assert!(found.len() == expected.len() && close, "{found:?} is not {expected:?}");
}

#[test]
fn a_texture_larger_than_the_staging_memory_is_split_by_rows_and_layers() -> TestResult {
    with_device(|device| {
        // Rows of 2,812 bytes, two layers of 2.0 MB, staging buffers of 1 MiB.
        let desc = ImageDesc { layers: 2, ..texture_desc("layers", 703, 711, 10) };
        let image = Image::new(device, &desc)?;
        let data = pattern(703 * 711 * 4 * 2);
        let mut uploader = uploader(device, 0)?;
        uploader.texture(&image, &[&data])?;
        uploader.finish()?;
        assert!(read_level(device, &image, 0, SAMPLED)? == data);
        assert_eq!(read_level(device, &image, 9, SAMPLED)?.len(), 2 * 4);
        Ok(())
    })
}

/// Clears an image on the GPU, then fails before it has waited.
fn clear_then_fail(device: &Arc<Device>) -> Result<(), Box<dyn StdError>> {
    let image = Image::new(device, &texture_desc("cleared", 2048, 2048, 1))?;
    let mut cmd = CommandBuffer::new(device, "clear")?;
    cmd.begin()?;
    let target = vk::ImageLayout::TRANSFER_DST_OPTIMAL;
    let order = Dependency::between(Use::START, COPY_WRITE);
    barrier::image_barrier(device, cmd.raw, &image, order, [vk::ImageLayout::UNDEFINED, target]);
    let range = barrier::ImageRange::from(&image).range;
    // SAFETY: recording; the image outlives the submission, as its owner sees to.
    unsafe {
        let color = vk::ClearColorValue { float32: [1.0; 4] };
        device.raw.cmd_clear_color_image(cmd.raw, image.raw, target, &color, &[range]);
    }
    cmd.end()?;
    device.submit(&cmd)?;
    Err("something else went wrong".into())
}

#[test]
fn an_early_error_pulls_nothing_from_under_the_gpu() -> TestResult {
    with_device(|device| {
        for _ in 0..4 {
            assert!(clear_then_fail(device).is_err());
            // The objects have no owner any more, whether or not the GPU is done with them.
            assert_eq!(device.live_objects(), Vec::<String>::new());
        }
        device.wait_idle()?;
        assert_eq!(device.memory_report().objects.len(), 0);
        Ok(())
    })
}

#[test]
fn a_leak_is_reported_as_a_message() -> TestResult {
    let instance = Instance::new(&InstanceOptions::default()).map_err(|error| error.to_string())?;
    let device = Device::new(&instance, &DeviceChoice::Auto)?;
    let usage = vk::BufferUsageFlags::UNIFORM_BUFFER;
    let buffer = Buffer::new(&device, "forgotten", 256, usage, Location::Upload, MemoryKind::Uniform)?;
    assert_eq!(device.report_leaks(), 1);
    let messages = instance.take_messages();
    assert!(messages.iter().any(|message| message.kind == MessageKind::Leak && message.text.contains("forgotten")));
    drop(buffer);
    assert_eq!(device.report_leaks(), 0);
    Ok(())
}

#[test]
fn memory_is_counted_by_kind_and_its_peak_is_kept() -> TestResult {
    with_device(|device| {
        let image = Image::new(device, &texture_desc("counted", 512, 512, 1))?;
        let report = device.memory_report();
        let textures = report.kinds.get(&MemoryKind::Texture).copied().unwrap_or_default();
        assert_eq!((textures.objects, textures.bytes), (1, report.bytes));
        assert!(report.bytes >= 512 * 512 * 4 && report.block_bytes >= report.bytes && report.blocks == 1);
        assert_eq!(report.objects.get("IMAGE_VIEW"), Some(&1));
        let bytes = report.bytes;
        drop(image);
        let report = device.memory_report();
        assert_eq!((report.bytes, report.peak_bytes), (0, bytes));
        Ok(())
    })
}

#[test]
fn what_the_device_cannot_do_is_a_clear_error() -> TestResult {
    with_device(|device| {
        let message =
            |desc: &ImageDesc<'_>| Image::new(device, desc).map_or_else(|error| error.to_string(), |_| String::new());
        let limit = device.physical.limits.max_image_dimension2_d;
        let too_wide = message(&texture_desc("wide", limit + 1, 1, 1));
        assert!(too_wide.contains("wide") && too_wide.contains(&limit.to_string()), "{too_wide}");
        let empty = message(&texture_desc("empty", 0, 1, 1));
        assert!(empty.contains("empty"), "{empty}");
        // Three-channel attachments: no driver has them.
        let format = vk::Format::R8G8B8_UNORM;
        let usage = vk::ImageUsageFlags::COLOR_ATTACHMENT;
        let wrong = message(&ImageDesc { format, usage, ..texture_desc("rgb", 4, 4, 1) });
        assert!(wrong.contains("rgb") && wrong.contains("R8G8B8_UNORM"), "{wrong}");
        let unknown = Device::new(&device.instance, &DeviceChoice::Name("voodoo".to_owned()));
        let unknown = unknown.map_or_else(|error| error.to_string(), |_| String::new());
        assert!(unknown.contains("voodoo") && unknown.contains(&device.physical.name), "{unknown}");
        Ok(())
    })
}

#[test]
fn a_mapped_buffer_is_written_and_read_within_its_bounds_only() -> TestResult {
    with_device(|device| {
        let usage = vk::BufferUsageFlags::UNIFORM_BUFFER;
        let buffer = Buffer::new(device, "uniform", 64, usage, Location::Upload, MemoryKind::Uniform)?;
        buffer.write(8, &[1.0_f32, 2.0])?;
        assert_eq!(buffer.read(12, 4)?, 2.0_f32.to_ne_bytes());
        buffer.write::<u8>(64, &[])?;
        assert!(buffer.write(60, &[0_u64]).is_err());
        assert!(buffer.write(u64::MAX, &[0_u8]).is_err());
        assert!(buffer.read(0, 65).is_err());
        Ok(())
    })
}

#[test]
fn a_command_buffer_refuses_what_is_out_of_order_and_can_be_recorded_anew() -> TestResult {
    with_device(|device| {
        let mut cmd = CommandBuffer::new(device, "again")?;
        assert!(device.submit(&cmd).is_err() && cmd.end().is_err());
        let mut tickets = Vec::new();
        for _ in 0..3 {
            cmd.begin()?;
            assert!(cmd.begin().is_err());
            cmd.end()?;
            tickets.push(device.submit(&cmd)?);
            tickets.push(device.submit(&cmd)?);
        }
        assert!(tickets.is_sorted());
        device.wait(tickets[5])?;
        for ticket in tickets {
            assert!(device.is_done(ticket)?);
        }
        assert!(device.wait(gpu::Ticket(u64::MAX)).is_err());
        Ok(())
    })
}

#[test]
fn timestamps_run_forwards() -> TestResult {
    with_device(|device| {
        let Some(mut timestamps) = Timestamps::new(device, Queue::Graphics, "times", 2)? else { return Ok(()) };
        let mut cmd = CommandBuffer::new(device, "timed")?;
        for _ in 0..2 {
            cmd.begin()?;
            timestamps.reset(cmd.raw);
            for label in ["begin", "end", "beyond the room"] {
                timestamps.write(cmd.raw, vk::PipelineStageFlags2::BOTTOM_OF_PIPE, label);
            }
            cmd.end()?;
            device.wait(device.submit(&cmd)?)?;
            let points = timestamps.read()?;
            let labels: Vec<&str> = points.iter().map(|(label, _)| label.as_str()).collect();
            assert_eq!(labels, ["begin", "end"]);
            assert!(points[0].1 == 0.0 && (0.0..1000.0).contains(&points[1].1), "{points:?}");
        }
        Ok(())
    })
}

#[test]
fn every_missing_barrier_is_noticed_however_often() -> TestResult {
    // More often than a layer with a limit on repeated messages would tell.
    const TIMES: usize = 15;
    let options = InstanceOptions {
        validation: Validation::Synchronization,
        sync_shader_heuristic: true,
        ..InstanceOptions::default()
    };
    let instance = Instance::new(&options).map_err(|error| error.to_string())?;
    let device = Device::new(&instance, &DeviceChoice::Auto)?;
    let usage = vk::BufferUsageFlags::TRANSFER_DST | vk::BufferUsageFlags::TRANSFER_SRC;
    let new = |name| Buffer::new(&device, name, 64, usage, Location::Device, MemoryKind::Geometry);
    let (first, second) = (new("first")?, new("second")?);
    let mut cmd = CommandBuffer::new(&device, "hazard")?;
    for _ in 0..TIMES {
        cmd.begin()?;
        let region = vk::BufferCopy { src_offset: 0, dst_offset: 0, size: 64 };
        // SAFETY: recording; the buffers outlive the waits. The second copy may read before the first has written: that hazard is the point, and does
        // no harm.
        unsafe {
            device.raw.cmd_fill_buffer(cmd.raw, first.raw, 0, 64, 1);
            device.raw.cmd_copy_buffer(cmd.raw, first.raw, second.raw, &[region]);
        }
        cmd.end()?;
        device.wait(device.submit(&cmd)?)?;
    }
    let mut messages = instance.take_messages();
    messages.retain(|message| message.kind == MessageKind::Validation);
    let hazards = messages.iter().filter(|message| message.id_name.contains("SYNC-HAZARD-READ-AFTER-WRITE"));
    assert_eq!(hazards.count(), TIMES, "{messages:#?}");
    assert!(messages.iter().all(|message| message.text.contains("first")), "objects have names: {messages:#?}");
    Ok(())
}
