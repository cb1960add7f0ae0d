//! Thumbnails of chosen points with their difference from the truth, in the page itself: as JPEG, for a page of PNGs takes megabytes.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use image::codecs::jpeg::JpegEncoder;
use maud::{Markup, html};

use super::words::{self, number};
use crate::report::sweep::model::{Point, SceneReport};

/// The bytes of a PNG file beside the report, by its name.
pub type Pictures<'a> = &'a dyn Fn(&str) -> Option<Vec<u8>>;

pub fn pairs(scene: &SceneReport, pictures: Pictures) -> Markup {
    let chosen: Vec<&Point> = scene.points.iter().filter(|point| !point.pictures.is_empty()).collect();
    html! {
        @if chosen.is_empty() { p.none { "No pictures were kept." } }
        @else { p { "A picture fills the window when it is chosen, and goes back when it is chosen again." } }
        div.pictures { @for point in chosen { (card(scene, point, pictures)) } }
    }
}

fn card(scene: &SceneReport, point: &Point, pictures: Pictures) -> Markup {
    let of_default = scene.points.get(scene.default).is_some_and(|default| default.name == point.name);
    // The picture itself before those that are made from it.
    let mut files: Vec<(&String, &String)> = point.pictures.iter().collect();
    files.sort_by_key(|(shows, _)| (shows.as_str() != "picture", shows.as_str()));
    html! {
        figure {
            h4 { code { (point.name) } @if of_default && point.name != "default" { " (default)" } }
            div.pair {
                @for (shows, file) in files { (picture(&point.name, shows, file, pictures(file))) }
            }
            figcaption {
                (number(point.time.decisive().median)) " ms, relMSE " (number(point.errors.converged.rel_mse)) ", FLIP "
                (number(point.errors.converged.flip))
                @if point.errors.converged.not_finite > 0 {
                    ", " (words::counted(point.errors.converged.not_finite, "pixel")) " not finite"
                }
            }
        }
    }
}

fn picture(point: &str, shows: &str, file: &str, bytes: Option<Vec<u8>>) -> Markup {
    html! {
        @if let Some(bytes) = bytes {
            label {
                input type="checkbox" aria-label=(format!("enlarge the {shows} of {point}"));
                img src=(source(&bytes)) alt=(format!("{shows} with {point}"));
                (shows)
            }
        } @else {
            p.none { "The " (shows) " is missing: no file " code { (file) } "." }
        }
    }
}

/// The quality of JPEG, up to 100: its losses at this one are not seen.
const QUALITY: u8 = 90;

/// The picture as an address that holds it: as JPEG where that is smaller, else as it is.
fn source(png: &[u8]) -> String {
    let mut jpeg = Vec::new();
    let encoded = image::load_from_memory(png)
        .and_then(|picture| picture.to_rgb8().write_with_encoder(JpegEncoder::new_with_quality(&mut jpeg, QUALITY)));
    match encoded {
        Ok(()) if jpeg.len() < png.len() => format!("data:image/jpeg;base64,{}", STANDARD.encode(jpeg)),
        _ => format!("data:image/png;base64,{}", STANDARD.encode(png)),
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
        let address = source(png.get_ref());
        let coded = address.strip_prefix("data:image/jpeg;base64,").expect("JPEG is smaller");
        assert!(coded.len() < png.get_ref().len(), "{} of {}", coded.len(), png.get_ref().len());
        let shown = image::load_from_memory(&STANDARD.decode(coded).expect("base64")).expect("a picture").to_rgb8();
        let off: f64 = shown.iter().zip(picture.iter()).map(|(a, b)| f64::from(a.abs_diff(*b))).sum();
        assert!(off / (96.0 * 64.0 * 3.0) < 12.0, "{off}");
        assert!(source(b"no picture").starts_with("data:image/png;base64,"));
    }
}
