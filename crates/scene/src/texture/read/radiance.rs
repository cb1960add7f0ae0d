//! Headers of Radiance HDR as other programs write them. The decoder knows one signature, one order of rows and no exposure.

use std::io::Cursor;

use glam::{Mat3, Vec3};
use image::{ImageFormat, ImageReader, Limits, Rgb, Rgb32FImage};

/// The longest header that is read.
const MOST_HEADER: usize = 1 << 16;

/// From tristimulus values to Rec. 709 with white D65 (IEC 61966-2-1).
const FROM_XYZ: Mat3 = Mat3::from_cols_array(&[
    3.240_97,
    -0.969_244,
    0.055_630_1,
    -1.537_383,
    1.875_968,
    -0.203_977,
    -0.498_611,
    0.041_555_1,
    1.056_972,
]);

/// The direction in which an axis of the picture is stored.
#[derive(Debug, Clone, Copy, PartialEq)]
struct ScanAxis {
    is_x: bool,
    /// Right for X, and down for Y.
    is_plain: bool,
    length: u32,
}

/// A header, and where the texels begin.
#[derive(Debug, PartialEq)]
struct RadianceHeader {
    /// The axis from row to row of the file, and the one along them.
    axes: [ScanAxis; 2],
    is_xyz: bool,
    /// Factors that its texels have been multiplied by.
    exposure: Vec3,
    texels_at: usize,
}

impl RadianceHeader {
    fn size(&self) -> [u32; 2] {
        let [rows, along] = self.axes;
        if along.is_x { [along.length, rows.length] } else { [rows.length, along.length] }
    }
}

/// Reads a picture in linear Rec. 709, its first texel the upper left one, as it was before any exposure that its header names.
///
/// # Errors
/// The fault of its size, or why it cannot be read.
pub(super) fn read_radiance(
    bytes: &[u8],
    fault: &dyn Fn([u32; 2]) -> Option<String>,
    limits: Limits,
) -> Result<Rgb32FImage, String> {
    let header = parse(bytes)?;
    let size = header.size();
    if let Some(fault) = fault(size) {
        return Err(fault);
    }
    let [rows, along] = header.axes;
    let start = format!("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {} +X {}\n", rows.length, along.length);
    let plain = [start.as_bytes(), &bytes[header.texels_at..]].concat();
    // Of a slice, as all pictures are read: with another type every decoder would be compiled once more.
    let mut reader = ImageReader::with_format(Cursor::new(plain.as_slice()), ImageFormat::Hdr);
    reader.limits(limits);
    let stored = reader.decode().map_err(|error| error.to_string())?.into_rgb32f();
    let is_changed = header.is_xyz || header.exposure != Vec3::ONE;
    if rows == (ScanAxis { is_x: false, is_plain: true, ..rows }) && along.is_plain && !is_changed {
        return Ok(stored);
    }
    let own = |axis: ScanAxis, at: u32| if axis.is_plain { at } else { axis.length - 1 - at };
    Ok(Rgb32FImage::from_fn(size[0], size[1], |x, y| {
        let (column, row) = if along.is_x { (own(along, x), own(rows, y)) } else { (own(along, y), own(rows, x)) };
        let texel = Vec3::from(stored.get_pixel(column, row).0) / header.exposure;
        Rgb(if header.is_xyz { FROM_XYZ * texel } else { texel }.to_array())
    }))
}

fn parse(bytes: &[u8]) -> Result<RadianceHeader, String> {
    let mut lines = bytes[..bytes.len().min(MOST_HEADER)].split_inclusive(|&byte| byte == b'\n');
    let mut header = RadianceHeader {
        axes: [ScanAxis { is_x: false, is_plain: true, length: 0 }; 2],
        is_xyz: false,
        exposure: Vec3::ONE,
        texels_at: 0,
    };
    for line in &mut lines {
        header.texels_at += line.len();
        let text = String::from_utf8_lossy(line);
        let text = text.trim();
        // Some programs leave out the empty line.
        if let Some(axes) = axes(text) {
            header.axes = axes;
            return Ok(header);
        }
        let Some((key, value)) = text.split_once('=') else { continue };
        let numbers: Vec<f32> = value.split_whitespace().map_while(|word| word.parse().ok()).collect();
        let usable = |factor: &f32| factor.is_finite() && *factor > 0.0;
        match (key.trim().to_ascii_uppercase().as_str(), numbers.as_slice()) {
            ("FORMAT", _) => match value.trim() {
                "32-bit_rle_xyze" => header.is_xyz = true,
                "32-bit_rle_rgbe" => {}
                other => return Err(format!("its format is `{other}`: 32-bit_rle_rgbe and 32-bit_rle_xyze are read")),
            },
            // Both may be there several times, and all count.
            ("EXPOSURE", [factor, ..]) if usable(factor) => header.exposure *= *factor,
            ("COLORCORR", &[red, green, blue, ..]) if [red, green, blue].iter().all(usable) => {
                header.exposure *= Vec3::new(red, green, blue);
            }
            _ => {}
        }
    }
    Err("its header names no size, as -Y 512 +X 1024".into())
}

/// A line such as `-Y 512 +X 1024`.
fn axes(line: &str) -> Option<[ScanAxis; 2]> {
    let words: Vec<&str> = line.split_whitespace().collect();
    let [first, first_length, second, second_length] = *words.as_slice() else { return None };
    let axis = |name: &str, length: &str| {
        let (is_x, is_plain) = match name {
            "+X" => (true, true),
            "-X" => (true, false),
            "-Y" => (false, true),
            "+Y" => (false, false),
            _ => return None,
        };
        Some(ScanAxis { is_x, is_plain, length: length.parse().ok()? })
    };
    let axes = [axis(first, first_length)?, axis(second, second_length)?];
    (axes[0].is_x != axes[1].is_x).then_some(axes)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Texels of 1, 2, 4 and so on in the order of the file, grey, unpacked.
    fn file(header: &str, count: u8) -> Vec<u8> {
        let texels = (0..count).flat_map(|at| [128, 128, 128, 129 + at]);
        header.bytes().chain(texels).collect()
    }

    fn values(bytes: &[u8]) -> ((u32, u32), Vec<f32>) {
        let image = read_radiance(bytes, &|_| None, Limits::default()).expect("read");
        (image.dimensions(), image.pixels().map(|texel| texel.0[1]).collect())
    }

    #[test]
    fn signatures_line_ends_and_comments_of_other_programs_are_read() {
        for header in [
            "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 2\n",
            "#?RGBE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 2\n",
            "#?AUTOPANO\n# made = here\nSOFTWARE=a b\nFORMAT = 32-bit_rle_rgbe\nGAMMA=1\nEXPOSURE=\t1\n\n-Y 1 +X 2\n",
            "#?RADIANCE\r\nFORMAT=32-bit_rle_rgbe\r\n\r\n-Y 1 +X 2\r\n",
            "FORMAT=32-bit_rle_rgbe\n-Y 1 +X 2\n",
        ] {
            assert_eq!(values(&file(header, 2)), ((2, 1), vec![1.0, 2.0]), "{header:?}");
        }
    }

    #[test]
    fn every_order_of_texels_ends_upright() {
        for (order, expected) in [
            ("-Y 2 +X 3", [1., 2., 4., 8., 16., 32.]),
            ("+Y 2 +X 3", [8., 16., 32., 1., 2., 4.]),
            ("-Y 2 -X 3", [4., 2., 1., 32., 16., 8.]),
            ("+Y 2 -X 3", [32., 16., 8., 4., 2., 1.]),
            // Columns, of two texels each.
            ("+X 3 -Y 2", [1., 4., 16., 2., 8., 32.]),
            ("+X 3 +Y 2", [2., 8., 32., 1., 4., 16.]),
            ("-X 3 -Y 2", [16., 4., 1., 32., 8., 2.]),
            ("-X 3 +Y 2", [32., 8., 2., 16., 4., 1.]),
        ] {
            assert_eq!(values(&file(&format!("#?RGBE\n\n{order}\n"), 6)), ((3, 2), expected.to_vec()), "{order}");
        }
    }

    #[test]
    fn exposures_are_divided_out_and_tristimulus_values_become_rec_709() {
        let header = "#?RADIANCE\nEXPOSURE=4\nEXPOSURE=0.5\nCOLORCORR=1 2 1\nEXPOSURE=nan\n\n-Y 1 +X 1\n";
        let image = read_radiance(&file(header, 1), &|_| None, Limits::default()).expect("read");
        assert_eq!(image.get_pixel(0, 0).0, [0.5, 0.25, 0.5]);
        // The luminance of Rec. 709 is Y.
        let image =
            read_radiance(&file("#?RADIANCE\nFORMAT=32-bit_rle_xyze\n\n-Y 1 +X 1\n", 1), &|_| None, Limits::default());
        let [red, green, blue] = image.expect("read").get_pixel(0, 0).0;
        assert!(
            (0.2126 * red + 0.7152 * green + 0.0722 * blue - 1.0).abs() < 1e-3 && red > green,
            "{red} {green} {blue}"
        );
    }

    #[test]
    fn a_header_that_says_too_little_is_refused() {
        for (bytes, words) in [
            (&b"#?RADIANCE\n\n-Y 4 -Y 8\n"[..], "names no size"),
            (b"", "names no size"),
            (b"#?RADIANCE\nFORMAT=16-bit\n\n-Y 1 +X 1\n", "`16-bit`"),
        ] {
            assert!(read_radiance(bytes, &|_| None, Limits::default()).expect_err("refused").contains(words));
        }
    }
}
