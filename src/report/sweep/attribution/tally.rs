//! Sums over pixels: what each part is on average, and its share of the whole's mean square.

use glam::DVec3;

use crate::report::sweep::model::AttributedPart;

/// The part that all others add up to.
pub const WHOLE: &str = "whole";

/// Sums over the pixels so far, for each part.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Tally {
    pub pixels: usize,
    parts: Vec<Sums>,
    whole: Sums,
}

#[derive(Debug, Clone, Copy, Default, PartialEq)]
struct Sums {
    value: f64,
    square: f64,
    /// Times the whole.
    with_whole: f64,
}

impl Sums {
    fn add(&mut self, value: DVec3, whole: DVec3) {
        self.value += value.element_sum();
        self.square += value.length_squared();
        self.with_whole += value.dot(whole);
    }
}

impl Tally {
    /// Adds a pixel by its signed parts, of which there are as many for each pixel.
    pub fn add(&mut self, parts: &[DVec3]) {
        let whole: DVec3 = parts.iter().sum();
        self.parts.resize(parts.len(), Sums::default());
        self.parts.iter_mut().zip(parts).for_each(|(sums, &part)| sums.add(part, whole));
        self.whole.add(whole, whole);
        self.pixels += 1;
    }

    /// The rows of a report, the whole last. `parts` has name and note of each.
    pub fn rows(&self, parts: &[(&str, String)], whole_note: String) -> Vec<AttributedPart> {
        let values = (3 * self.pixels.max(1)) as f64;
        let row = |(name, note): &(&str, String), sums: &Sums| AttributedPart {
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
    use super::*;

    fn rows(pixels: &[[DVec3; 2]]) -> Vec<AttributedPart> {
        let mut tally = Tally::default();
        pixels.iter().for_each(|parts| tally.add(parts));
        tally.rows(&[("first", "1".into()), ("second", "2".into())], "all".into())
    }

    #[test]
    fn means_and_shares_add_up_and_what_works_against_the_others_is_negative() {
        let rows = rows(&[[DVec3::splat(3.0), DVec3::splat(-1.0)], [DVec3::X * 6.0, DVec3::ZERO]]);
        let [first, second, whole] = &rows[..] else { panic!("{rows:?}") };
        // Over two pixels of three channels: 15 and -3 of 12.
        assert_eq!([first.mean, second.mean, whole.mean], [2.5, -0.5, 2.0]);
        // Squares 27 + 36, 3, and 12 + 36.
        assert_eq!(first.rms, (63.0f64 / 6.0).sqrt());
        assert_eq!([second.rms, whole.rms], [(3.0f64 / 6.0).sqrt(), 8f64.sqrt()]);
        assert!((first.share - 54.0 / 48.0).abs() < 1e-15 && (second.share + 6.0 / 48.0).abs() < 1e-15);
        assert_eq!((whole.name.as_str(), whole.share), (WHOLE, 1.0));
    }

    #[test]
    fn without_error_there_are_no_shares() {
        for row in rows(&[[DVec3::ZERO; 2]]).into_iter().chain(rows(&[])) {
            assert_eq!((row.mean, row.rms, row.share), (0.0, 0.0, 0.0));
        }
    }
}
