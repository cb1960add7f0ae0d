//! OpenEXR channels that have fewer samples than the picture has pixels, as chroma usually has. The decoder (exr 1.74.2) refuses such files, but its
//! decompression has them right: so the header is read as if all channels were whole, and blocks are taken apart here.

use std::borrow::Cow;
use std::io::Cursor;

use exr::block::chunk::CompressedBlock;
use exr::math::Vec2;
use exr::meta::attribute::{IntegerBounds, SampleType};
use exr::meta::header::Header;
use half::f16;

/// The subsampling of each channel, in the list's order: pixels for a sample, along x and along y.
pub(super) type Rates = Vec<[usize; 2]>;

/// The file with its first list of channels made whole, and their rates; none where they all are whole already.
pub(super) fn whole(bytes: &[u8]) -> (Cow<'_, [u8]>, Rates) {
    const MARK: &[u8] = b"channels\0chlist\0";
    let number = |at: usize| bytes.get(at..).and_then(|rest| rest.first_chunk()).map(|own| i32::from_le_bytes(*own));
    let mut rates = Rates::new();
    let mut places = Vec::new();
    // The list stands near the start, and behind it each channel: its name, type, flags and the two rates.
    let start = bytes.windows(MARK.len()).take(1 << 16).position(|own| own == MARK);
    let mut at = start.map_or(bytes.len(), |start| start + MARK.len() + 4);
    while let Some(length) = bytes.get(at..).and_then(|rest| rest.iter().take(256).position(|&byte| byte == 0)) {
        let own = at + length + 1 + 8;
        let (1.., Some(along @ 1..), Some(down @ 1..)) = (length, number(own), number(own + 4)) else { break };
        rates.push([along as usize, down as usize]);
        places.push(own);
        at = own + 8;
    }
    if rates.iter().all(|rate| *rate == [1, 1]) {
        return (Cow::Borrowed(bytes), Rates::new());
    }
    let mut whole = bytes.to_vec();
    for at in places {
        whole[at..at + 8].copy_from_slice(&[1, 0, 0, 0, 1, 0, 0, 0]);
    }
    (Cow::Owned(whole), rates)
}

/// The samples of a channel.
pub(super) struct Plane {
    rate: [usize; 2],
    size: [usize; 2],
    samples: Vec<f32>,
}

impl Plane {
    /// The value at a pixel, between the samples around it. A sample is the pixel whose place the rate divides.
    pub fn at(&self, x: usize, y: usize) -> f32 {
        let (along, down) = (x / self.rate[0], y / self.rate[1]);
        let share = |at: usize, rate: usize| (at % rate) as f32 / rate as f32;
        let [width, height] = self.size;
        let row = |y: usize| {
            let sample =
                |x: usize| self.samples.get(y.min(height - 1) * width + x.min(width - 1)).copied().unwrap_or(0.0);
            mix(sample(along), sample(along + 1), share(x, self.rate[0]))
        };
        mix(row(down), row(down + 1), share(y, self.rate[1]))
    }
}

fn mix(a: f32, b: f32, share: f32) -> f32 {
    if share == 0.0 { a } else { a + (b - a) * share }
}

/// Decodes the channels of a file of one part in scan lines. `bytes` is the file as [`whole`] completes it, and `header` is its header.
///
/// # Errors
/// Why it cannot be decoded.
pub(super) fn planes(bytes: &[u8], header: &Header, rates: &Rates) -> Result<Vec<Plane>, String> {
    const ODD: &str = "it has channels of fewer samples than pixels in an arrangement that is not read";
    use exr::compression::Compression::{PIZ, RLE, Uncompressed, ZIP1, ZIP16};
    if !matches!(header.compression, Uncompressed | RLE | ZIP1 | ZIP16 | PIZ) {
        return Err(format!(
            "it has channels of fewer samples than pixels, which {} is not read with",
            header.compression
        ));
    }
    let origin = header.own_attributes.layer_position;
    let Vec2(width, height) = header.layer_size;
    let mut header = header.clone();
    let list = &mut header.channels.list;
    let is_even = |[along, down]: &[usize; 2]| {
        let starts = |at: i32, rate: usize| i64::from(at).rem_euclid(rate as i64) == 0;
        width % along == 0 && height % down == 0 && starts(origin.0, *along) && starts(origin.1, *down)
    };
    if list.len() != rates.len() || !rates.iter().all(is_even) {
        return Err(ODD.into());
    }
    let mut planes: Vec<Plane> = Vec::new();
    for (channel, &[along, down]) in list.iter_mut().zip(rates) {
        channel.sampling = Vec2(along, down);
        let size = [width / along, height / down];
        planes.push(Plane { rate: [along, down], size, samples: vec![0.0; size[0] * size[1]] });
    }
    let types: Vec<SampleType> = list.iter().map(|channel| channel.sample_type).collect();
    let reader = exr::block::read(Cursor::new(bytes), false).map_err(|error| error.to_string())?;
    for chunk in reader.all_chunks(false).map_err(|error| error.to_string())? {
        let CompressedBlock::ScanLine(block) = chunk.map_err(|error| error.to_string())?.compressed_block else {
            return Err(ODD.into());
        };
        let top = i64::from(block.y_coordinate) - i64::from(origin.1);
        let top =
            usize::try_from(top).ok().filter(|top| *top < height).ok_or("a block of it lies outside the picture")?;
        let rows = header.compression.scan_lines_per_block().min(height - top);
        let own_rows = || {
            (top..top + rows)
                .flat_map(|y| (0..rates.len()).filter(move |&at| y % rates[at][1] == 0).map(move |at| (y, at)))
        };
        let needed: usize = own_rows().map(|(_, at)| width / rates[at][0] * types[at].bytes_per_sample()).sum();
        // The decoder multiplies this by the pixels to know how large a block is.
        header.channels.bytes_per_pixel = needed / (width * rows);
        if header.channels.bytes_per_pixel * width * rows != needed {
            return Err(ODD.into());
        }
        let bounds = IntegerBounds::new((origin.0, block.y_coordinate), (width, rows));
        let data = header
            .compression
            .decompress_image_section_from_le(&header, block.compressed_pixels_le, bounds, false)
            .map_err(|error| error.to_string())?;
        let mut rest = data.as_slice();
        for (y, at) in own_rows() {
            let (count, bytes) = (width / rates[at][0], types[at].bytes_per_sample());
            let row = rest.split_off(..count * bytes).ok_or("a block of it is too short")?;
            let plane = &mut planes[at];
            let start = y / rates[at][1] * count;
            for (sample, bytes) in plane.samples[start..start + count].iter_mut().zip(row.chunks_exact(bytes)) {
                *sample = value(types[at], bytes);
            }
        }
    }
    Ok(planes)
}

/// A sample in the machine's order of bytes.
fn value(kind: SampleType, bytes: &[u8]) -> f32 {
    let four = || bytes.first_chunk::<4>().copied().unwrap_or_default();
    match kind {
        SampleType::F16 => f16::from_ne_bytes(bytes.first_chunk::<2>().copied().unwrap_or_default()).to_f32(),
        SampleType::F32 => f32::from_ne_bytes(four()),
        SampleType::U32 => u32::from_ne_bytes(four()) as f32,
    }
}

#[cfg(test)]
pub(super) mod tests {
    use exr::compression::Compression;
    use exr::meta::MetaData;

    /// A channel's name, its rate and its samples by place.
    pub type ExrChannel<'a> = (&'a str, usize, &'a dyn Fn(usize, usize) -> f32);

    /// A file with channels of halves, compressed in blocks.
    pub fn sampled(size: [usize; 2], channels: &[ExrChannel], compression: (u8, Compression)) -> Vec<u8> {
        use super::*;
        let [width, height] = size;
        let mut bytes = vec![0x76, 0x2f, 0x31, 0x01, 2, 0, 0, 0];
        let mut put = |name: &str, kind: &str, value: &[u8]| {
            bytes.extend([name, "\0", kind, "\0"].concat().bytes());
            bytes.extend((value.len() as u32).to_le_bytes());
            bytes.extend(value);
        };
        let list = |rate: &dyn Fn(usize) -> usize| {
            let mut list = Vec::new();
            for &(name, own, _) in channels {
                list.extend(name.bytes().chain([0, 1, 0, 0, 0, 0, 0, 0, 0]));
                list.extend([rate(own) as u32; 2].into_iter().flat_map(u32::to_le_bytes));
            }
            list.push(0);
            list
        };
        put("channels", "chlist", &list(&|own| own));
        put("compression", "compression", &[compression.0]);
        let window: Vec<u8> =
            [0, 0, width as u32 - 1, height as u32 - 1].into_iter().flat_map(u32::to_le_bytes).collect();
        put("dataWindow", "box2i", &window);
        put("displayWindow", "box2i", &window);
        put("lineOrder", "lineOrder", &[0]);
        put("pixelAspectRatio", "float", &1.0_f32.to_le_bytes());
        put("screenWindowCenter", "v2f", &[0; 8]);
        put("screenWindowWidth", "float", &1.0_f32.to_le_bytes());
        bytes.push(0);
        let mut header = MetaData::read_from_buffered(&*whole(&bytes).0, false).expect("a header").headers.remove(0);
        for (channel, &(_, rate, _)) in header.channels.list.iter_mut().zip(channels) {
            channel.sampling = Vec2(rate, rate);
        }
        let per_block = compression.1.scan_lines_per_block();
        let mut blocks = Vec::new();
        for top in (0..height).step_by(per_block) {
            let rows = per_block.min(height - top);
            let mut data = Vec::new();
            for y in top..top + rows {
                for (_, rate, sample) in channels.iter().filter(|own| y % own.1 == 0) {
                    for x in (0..width).step_by(*rate) {
                        data.extend(f16::from_f32(sample(x, y)).to_ne_bytes());
                    }
                }
            }
            header.channels.bytes_per_pixel = data.len() / (width * rows);
            let bounds = IntegerBounds::new((0, top as i32), (width, rows));
            let packed = compression.1.compress_image_section_to_le(&header, data, bounds).expect("packed");
            let start = [top as u32, packed.len() as u32].into_iter().flat_map(u32::to_le_bytes);
            blocks.push(start.chain(packed.iter().copied()).collect::<Vec<u8>>());
        }
        let mut at = bytes.len() + 8 * blocks.len();
        for block in &blocks {
            bytes.extend((at as u64).to_le_bytes());
            at += block.len();
        }
        bytes.extend(blocks.concat());
        bytes
    }
}
