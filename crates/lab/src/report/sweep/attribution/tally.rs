//! Sums over pixels: the mean of each part, and its share of the whole's mean square.

use glam::DVec3;

use super::decomposition::AttributedPixel;
use crate::report::sweep::model::AttributedPart;

/// The part that all others add up to.
pub const WHOLE: &str = "whole";

/// Sums over the pixels so far, for each part.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Tally {
    pub pixels: usize,
    parts: Vec<AttributionSums>,
    whole: AttributionSums,
    light: AttributionSums,
}

#[derive(Debug, Clone, Copy, Default, PartialEq)]
struct AttributionSums {
    value: f64,
    square: f64,
    /// Times the whole.
    with_whole: f64,
}

impl AttributionSums {
    fn add(&mut self, value: DVec3, whole: DVec3) {
        self.value += value.element_sum();
        self.square += value.length_squared();
        self.with_whole += value.dot(whole);
    }
}

impl Tally {
    /// Adds a pixel, unless there is something in it that is not finite.
    pub fn add(&mut self, pixel: &AttributedPixel) {
        // The whole is found without the parts: that they add up to it is not taken for granted.
        let whole = pixel.light + pixel.output;
        if !whole.is_finite() || !pixel.parts.iter().all(|part| part.is_finite()) {
            return;
        }
        self.parts.resize(pixel.parts.len(), AttributionSums::default());
        self.parts.iter_mut().zip(pixel.parts).for_each(|(sums, part)| sums.add(part, whole));
        self.whole.add(whole, whole);
        self.light.add(pixel.light, whole);
        self.pixels += 1;
    }

    /// Root mean square of the light's error, before the picture is made of it.
    pub fn light_rms(&self) -> f64 {
        (self.light.square / self.values()).sqrt()
    }

    /// The number of channels of all pixels, at least one pixel's.
    fn values(&self) -> f64 {
        (3 * self.pixels.max(1)) as f64
    }

    /// The rows of a report, the whole last. `parts` has name and note of each.
    pub fn rows(&self, parts: &[(&str, String)], whole_note: String) -> Vec<AttributedPart> {
        let values = self.values();
        let row = |(name, note): &(&str, String), sums: &AttributionSums| AttributedPart {
            name: (*name).into(),
            mean: sums.value / values,
            rms: (sums.square / values).sqrt(),
            // A picture without any error has no shares.
            share: if self.whole.square > 0.0 { sums.with_whole / self.whole.square } else { 0.0 },
            note: note.clone(),
        };
        let own = parts.iter().zip(&self.parts).map(|(part, sums)| row(part, sums));
        own.chain([row(&(WHOLE, whole_note), &self.whole)]).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::super::decomposition::COUNT;
    use super::*;

    /// A tally of errors of the light and of the output, which are the first and the last part; the parts between are 0.
    fn tally(pixels: &[[DVec3; 2]]) -> Tally {
        let mut tally = Tally::default();
        for &[light, output] in pixels {
            let mut parts = [DVec3::ZERO; COUNT];
            (parts[0], parts[COUNT - 1]) = (light, output);
            tally.add(&AttributedPixel { parts, light, output });
        }
        tally
    }

    fn rows(tally: &Tally) -> Vec<AttributedPart> {
        tally.rows(&[0; COUNT].map(|_| ("part", String::new())), "all".into())
    }

    #[test]
    fn means_and_shares_add_up_and_what_works_against_the_others_is_negative() {
        let tally = tally(&[[DVec3::splat(3.0), DVec3::splat(-1.0)], [DVec3::X * 6.0, DVec3::ZERO]]);
        let rows = rows(&tally);
        let [first, .., last, whole] = &rows[..] else { panic!("{rows:?}") };
        // The sums are 15, -3 and 12, over two pixels of three channels.
        assert_eq!([first.mean, last.mean, whole.mean], [2.5, -0.5, 2.0]);
        // Squares 27 + 36, 3, and 12 + 36.
        assert_eq!([first.rms, tally.light_rms()], [(63.0f64 / 6.0).sqrt(); 2]);
        assert_eq!([last.rms, whole.rms], [(3.0f64 / 6.0).sqrt(), 8f64.sqrt()]);
        assert!((first.share - 54.0 / 48.0).abs() < 1e-15 && (last.share + 6.0 / 48.0).abs() < 1e-15);
        assert_eq!((whole.name.as_str(), whole.share), (WHOLE, 1.0));
    }

    #[test]
    fn the_whole_is_not_what_the_parts_add_up_to_but_what_is_seen() {
        let mut tally = Tally::default();
        tally.add(&AttributedPixel { parts: [DVec3::ZERO; COUNT], light: DVec3::ONE, output: DVec3::ONE });
        let rows = rows(&tally);
        let parts: f64 = rows[..COUNT].iter().map(|part| part.mean).sum();
        assert_eq!((parts, rows[COUNT].mean, rows[COUNT].rms), (0.0, 2.0, 2.0));
    }

    #[test]
    fn a_pixel_that_is_not_finite_is_left_out() {
        let tally = tally(&[[DVec3::NAN, DVec3::ZERO], [DVec3::ONE, DVec3::ZERO], [DVec3::ZERO, DVec3::INFINITY]]);
        assert_eq!((tally.pixels, tally.light_rms()), (1, 1.0));
    }

    #[test]
    fn without_error_there_are_no_shares() {
        for row in rows(&tally(&[[DVec3::ZERO; 2]])).into_iter().chain(rows(&tally(&[]))) {
            assert_eq!((row.mean, row.rms, row.share), (0.0, 0.0, 0.0));
        }
    }
}
