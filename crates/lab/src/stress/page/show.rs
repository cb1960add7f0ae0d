//! Pictures of a finding.

use image::codecs::png::PngEncoder;
use image::{ExtendedColorType, ImageEncoder};

use crate::page::pictures::exact;
use crate::stress::{FLOOR, PicturePair};
use afterlight::passes::curves::encode_srgb;

/// Returns the picture, the truth and their difference, by their names. Light is scaled to the brightest of the truth.
pub fn all(evidence: &PicturePair) -> Vec<(&'static str, String)> {
    let brightest = evidence.expected.iter().flatten().fold(0.0f64, |most, &channel| most.max(channel));
    let scale = if brightest > 0.0 { brightest.recip() } else { 1.0 };
    let code = |light: f64| (encode_srgb((light * scale).clamp(0.0, 1.0)) * 255.0).round() as u8;
    let drawn: Vec<[u8; 3]> =
        evidence.drawn.iter().map(|light| light.map(|channel| code(f64::from(channel)))).collect();
    let expected: Vec<[u8; 3]> = evidence.expected.iter().map(|light| light.map(code)).collect();
    let heat: Vec<[u8; 3]> =
        evidence.drawn.iter().zip(&evidence.expected).map(|(drawn, truth)| error(drawn, truth, brightest)).collect();
    let named = [("drawn", drawn), ("truth", expected), ("error", heat)];
    named.into_iter().filter_map(|(name, pixels)| Some((name, source(evidence.size, &pixels)?))).collect()
}

fn error(drawn: &[f32; 3], truth: &[f64; 3], brightest: f64) -> [u8; 3] {
    if drawn.iter().any(|channel| !channel.is_finite()) {
        return [255, 0, 0];
    }
    if drawn.iter().any(|channel| *channel < 0.0) {
        return [0, 64, 255];
    }
    let own = truth.iter().fold(FLOOR * brightest, |most, &channel| most.max(channel));
    let difference = drawn.iter().zip(truth).fold(0.0f64, |most, (a, b)| most.max((f64::from(*a) - b).abs()));
    // Four decades.
    let share = if difference == 0.0 { 0.0 } else { 1.0 + (difference / own).log10() / 4.0 };
    [(share.clamp(0.0, 1.0) * 255.0) as u8; 3]
}

/// `None` for a picture that no PNG holds.
fn source([width, height]: [u32; 2], pixels: &[[u8; 3]]) -> Option<String> {
    let mut png = Vec::new();
    PngEncoder::new(&mut png).write_image(pixels.as_flattened(), width, height, ExtendedColorType::Rgb8).ok()?;
    Some(exact(&png))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_are_grey_by_their_decade_and_what_no_light_can_be_has_a_colour() {
        let truth = [1.0; 3];
        assert_eq!(error(&[1.0; 3], &truth, 1.0), [0; 3]);
        assert_eq!(error(&[2.0, 1.0, 1.0], &truth, 1.0), [255; 3]);
        assert_eq!(error(&[1.01, 1.0, 1.0], &truth, 1.0)[0] / 8, 127 / 8);
        assert_eq!(error(&[f32::NAN, 1.0, 1.0], &truth, 1.0), [255, 0, 0]);
        assert_eq!(error(&[-1.0, 1.0, 1.0], &truth, 1.0), [0, 64, 255]);
    }
}
