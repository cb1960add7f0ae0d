//! Pictures within a page, as addresses that hold their bytes.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use image::codecs::jpeg::JpegEncoder;
use maud::{Markup, html};

/// A picture that fills the window when it is chosen, and goes back when it is chosen again. `of` ends the sentence "enlarge the `shows` ...".
pub fn enlarged(shows: &str, of: &str, alt: &str, address: &str) -> Markup {
    html! {
        label {
            input type="checkbox" aria-label=(format!("enlarge the {shows} {of}"));
            img src=(address) alt=(alt);
            (shows)
        }
    }
}

/// The quality of JPEG, up to 100: its losses at this one are not seen.
const QUALITY: u8 = 90;

/// A PNG file as an address, without a loss.
pub fn exact(png: &[u8]) -> String {
    format!("data:image/png;base64,{}", STANDARD.encode(png))
}

/// A PNG file as an address: as JPEG where that is smaller, for a page of PNGs takes megabytes, else as it is.
pub fn small(png: &[u8]) -> String {
    let mut jpeg = Vec::new();
    let encoded = image::load_from_memory(png)
        .and_then(|picture| picture.to_rgb8().write_with_encoder(JpegEncoder::new_with_quality(&mut jpeg, QUALITY)));
    match encoded {
        Ok(()) if jpeg.len() < png.len() => format!("data:image/jpeg;base64,{}", STANDARD.encode(jpeg)),
        _ => exact(png),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_picture_with_much_in_it_is_kept_small_and_looks_alike() {
        let value = |x: u32, y: u32| (((x * 7 + y * 13) % 64) + x + y) as u8;
        let picture = image::RgbImage::from_fn(96, 64, |x, y| image::Rgb([value(x, y), value(y, x), (x * 2) as u8]));
        let mut png = std::io::Cursor::new(Vec::new());
        picture.write_to(&mut png, image::ImageFormat::Png).expect("it is encoded");
        let address = small(png.get_ref());
        let coded = address.strip_prefix("data:image/jpeg;base64,").expect("JPEG is smaller");
        assert!(coded.len() < png.get_ref().len(), "{} of {}", coded.len(), png.get_ref().len());
        let shown = image::load_from_memory(&STANDARD.decode(coded).expect("base64")).expect("a picture").to_rgb8();
        let off: f64 = shown.iter().zip(picture.iter()).map(|(a, b)| f64::from(a.abs_diff(*b))).sum();
        assert!(off / (96.0 * 64.0 * 3.0) < 12.0, "{off}");
        assert!(small(b"no picture").starts_with("data:image/png;base64,"));
    }
}
