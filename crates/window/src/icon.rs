//! The icon of the window's bar and of task lists. Windows and X11 show it; Wayland shows the desktop entry's icon.

use winit::window::Icon;

/// Pixels along each side: X11 hands the whole icon to each client that asks for it.
const SIDE: u32 = 64;

/// Returns the icon of a PNG; `None` where that cannot be read.
pub(super) fn icon(png: &[u8]) -> Option<Icon> {
    let picture = image::load_from_memory_with_format(png, image::ImageFormat::Png).ok()?;
    let small = picture.thumbnail_exact(SIDE, SIDE).into_rgba8();
    Icon::from_rgba(small.into_raw(), SIDE, SIDE).ok()
}
