//! Reads pictures of skies: OpenEXR and Radiance HDR.

use std::path::Path;

use glam::{DVec3, Vec3};
use image::ImageFormat;

use super::{MOST_LIGHT, SkyImage, SkyOrigin};
use crate::Error;
use crate::texture::{decode_light, format_of};
use afterlight_files::regular_file::read_regular;

/// The greatest width of a panorama that is read, in texels; `MOST_FACE` is the limit for a cube's faces.
const MOST_WIDTH: u32 = 8192;
const MOST_FACE: u32 = 2048;
/// Wider panoramas are reduced to this width: faces of a cube are no finer.
const KEPT_WIDTH: u32 = 4096;
/// The most memory that a decoder may allocate: an RGBA picture of the largest size in single floats, and as much again.
const MOST_BYTES: u64 = 2 * 16 * (MOST_WIDTH as u64) * (MOST_WIDTH as u64 / 2);

/// A picture as it was read, with warnings about it.
struct Read {
    size: [u32; 2],
    texels: Vec<[f32; 3]>,
    warnings: Vec<String>,
}

/// Reads an equirectangular picture. Needs the feature `readers`.
///
/// # Errors
/// [`Error::Read`] for a file of another kind, one that cannot be decoded, or one that is not twice as wide as high.
pub fn read_panorama(path: &Path, warnings: &mut Vec<String>) -> Result<SkyImage, Error> {
    let wrong = |[width, height]: [u32; 2]| {
        (width != height.saturating_mul(2) || width > MOST_WIDTH || width == 0).then(|| {
            format!(
                "it is {width}x{height}: an equirectangular picture of a sky is twice as wide as high, and at most {MOST_WIDTH}x{} here",
                MOST_WIDTH / 2
            )
        })
    };
    let read = read(path, wrong)?;
    warnings.extend(read.warnings);
    let mut image = SkyImage {
        name: path.display().to_string(),
        size: read.size,
        texels: read.texels,
        origin: SkyOrigin::Panorama(path.to_owned()),
    };
    while image.size[0] > KEPT_WIDTH {
        image = image.halved();
    }
    Ok(image)
}

/// Reads the six faces of a cube, in the order +X, -X, +Y, -Y, +Z, -Z, as Vulkan has them, into one equirectangular picture.
/// Needs the feature `readers`.
///
/// # Errors
/// As [`read_panorama`], for faces that are not square or of one size.
pub fn read_faces(paths: &[&Path; 6], warnings: &mut Vec<String>) -> Result<SkyImage, Error> {
    let mut faces = Vec::new();
    let mut first = None;
    for path in paths {
        let wrong = |[width, height]: [u32; 2]| {
            let edge = first.unwrap_or(width);
            (width != height || width != edge || width > MOST_FACE || width == 0)
                .then(|| format!("it is {width}x{height}: the faces of a sky's cube are square, of one size, and at most {MOST_FACE} texels wide"))
        };
        let read = read(path, wrong)?;
        first = Some(read.size[0]);
        warnings.extend(read.warnings);
        faces.push(read.texels);
    }
    let edge = first.unwrap_or(1);
    let look = |direction: DVec3| {
        let (face, across, down) = on_face(direction);
        bilinear(&faces[face], edge, [across, down])
    };
    let origin = SkyOrigin::Faces(Box::new(paths.map(Path::to_owned)));
    Ok(SkyImage { origin, ..SkyImage::of(&paths[0].display().to_string(), (4 * edge).max(2), look) })
}

/// The face that a direction meets, and where: the reverse of [`super::face_direction`].
fn on_face(to: DVec3) -> (usize, f64, f64) {
    let DVec3 { x, y, z } = to;
    let (face, major, across, down) = if x.abs() >= y.abs() && x.abs() >= z.abs() {
        if x > 0.0 { (0, x, -z, -y) } else { (1, -x, z, -y) }
    } else if y.abs() >= z.abs() {
        if y > 0.0 { (2, y, x, z) } else { (3, -y, x, -z) }
    } else if z > 0.0 {
        (4, z, x, -y)
    } else {
        (5, -z, -x, -y)
    };
    (face, across / major, down / major)
}

fn bilinear(texels: &[[f32; 3]], edge: u32, place: [f64; 2]) -> DVec3 {
    let last = f64::from(edge - 1);
    let [x, y] = place.map(|own| ((own + 1.0) * 0.5 * f64::from(edge) - 0.5).clamp(0.0, last));
    let at = |column: f64, row: f64| {
        Vec3::from(texels[(row.min(last) as u32 * edge + column.min(last) as u32) as usize]).as_dvec3()
    };
    let (left, top) = (x.floor(), y.floor());
    let row = |row: f64| at(left, row).lerp(at(left + 1.0, row), x - left);
    row(top).lerp(row(top + 1.0), y - top)
}

/// `wrong` returns the fault of a size, before anything is decoded.
fn read(path: &Path, wrong: impl Fn([u32; 2]) -> Option<String>) -> Result<Read, Error> {
    let fault = |cause: String| Error::Read { path: path.to_owned(), cause };
    let bytes = read_regular(path, MOST_BYTES).map_err(|error| fault(error.to_string()))?;
    let is_named =
        |ends: &[&str]| path.extension().is_some_and(|own| ends.iter().any(|end| own.eq_ignore_ascii_case(end)));
    let format = match format_of(&bytes, path) {
        Some(format @ (ImageFormat::Hdr | ImageFormat::OpenExr)) => format,
        // Old files have no magic number.
        None if is_named(&["hdr", "pic"]) => ImageFormat::Hdr,
        None if is_named(&["exr"]) => ImageFormat::OpenExr,
        _ => return Err(fault("a sky is read from Radiance HDR (.hdr) and OpenEXR (.exr) files".into())),
    };
    let decoded = decode_light(&bytes, format, MOST_BYTES, &wrong).map_err(&fault)?;
    let size = [decoded.width(), decoded.height()];
    let decoded = decoded.into_rgb32f();
    let mut texels: Vec<[f32; 3]> = decoded.pixels().map(|pixel| pixel.0).collect();
    let mut changed = [0usize; 2];
    for value in texels.iter_mut().flatten() {
        // The comparison turns a NaN into 0.
        let kept = if *value > 0.0 { value.min(MOST_LIGHT) } else { 0.0 };
        if *value > MOST_LIGHT {
            changed[1] += 1;
        } else if kept != *value {
            changed[0] += 1;
        }
        *value = kept;
    }
    let says =
        |count: usize, what: &str| (count > 0).then(|| format!("{}: {count} values of the sky {what}", path.display()));
    let warnings = [
        says(changed[0], "are negative or no number: they are taken for 0"),
        says(changed[1], &format!("are above {MOST_LIGHT:e}: they are taken for that")),
    ];
    Ok(Read { size, texels, warnings: warnings.into_iter().flatten().collect() })
}
