//! The icon of the window's bar and of task lists. Windows and X11 show it; Wayland takes that of a desktop entry.

use winit::window::Icon;

/// `afterlight render assets/icon.toml` drew it. The build script gives the same picture to the program's file on Windows.
const PICTURE: &[u8] = include_bytes!("../icon.png");

/// Pixels along each side: X11 hands the whole icon to each client that asks for it.
const SIDE: u32 = 64;

/// `None` where the picture cannot be read, which a test rules out.
pub(super) fn icon() -> Option<Icon> {
    let picture = image::load_from_memory_with_format(PICTURE, image::ImageFormat::Png).ok()?;
    let small = picture.thumbnail_exact(SIDE, SIDE).into_rgba8();
    Icon::from_rgba(small.into_raw(), SIDE, SIDE).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn there_is_an_icon() {
        assert!(icon().is_some());
    }

    #[test]
    fn an_icon_file_tells_the_width_of_its_picture_as_0() {
        let picture = image::load_from_memory(PICTURE).expect("a picture");
        assert_eq!((picture.width(), picture.height()), (256, 256), "build.rs writes 0, which stands for 256");
    }
}
