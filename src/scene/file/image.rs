//! Images that a scene file names.

use std::path::Path;

use image::{ImageReader, Limits};

use crate::scene::{ColorSpace, Texture};

/// The largest edge in texels that is decoded; more is refused by its header, before memory is taken for it.
const MAX_EDGE: u32 = 16384;

/// Decodes an image file.
///
/// # Errors
/// One line that names the file and what is wrong with it.
pub(super) fn load(path: &Path, color_space: ColorSpace) -> Result<Texture, String> {
    let told = |error: &dyn std::fmt::Display| format!("cannot read {}: {error}", path.display());
    if path.is_dir() {
        return Err(told(&"it is a directory"));
    }
    let reader =
        ImageReader::open(path).and_then(|reader| reader.with_guessed_format()).map_err(|error| told(&error))?;
    let mut reader = reader;
    let mut limits = Limits::default();
    limits.max_image_width = Some(MAX_EDGE);
    limits.max_image_height = Some(MAX_EDGE);
    limits.max_alloc = Some(u64::from(MAX_EDGE).pow(2) * 8);
    reader.limits(limits);
    let image = reader.decode().map_err(|error| told(&error))?.to_rgba8();
    let size = [image.width(), image.height()];
    Ok(Texture { name: path.display().to_string(), size, color_space, texels: image.into_raw() })
}
