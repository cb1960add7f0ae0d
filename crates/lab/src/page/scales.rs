//! Axes, logarithmic or linear: their ranges and ticks.

use std::ops::Range;

use plotters::coord::ranged1d::{DefaultFormatting, KeyPointHint, Ranged};
use plotters::coord::types::RangedCoordf64;

/// Of an axis in pixels, how much is free beyond the outermost points, as a share of its length.
const MARGIN: f64 = 0.07;

/// The span of an axis. A place on it is a value, or on a logarithmic axis the decimal logarithm of a value.
#[derive(Debug, Clone, PartialEq)]
pub struct Scale {
    /// The places of its ends.
    pub range: Range<f64>,
    /// The place on a logarithmic axis at which zeros are drawn, below all other values.
    pub zero: Option<f64>,
    is_linear: bool,
    /// Below it are no ticks.
    least_tick: f64,
}

impl Scale {
    /// Returns a logarithmic axis for these values, at least `least_ratio` from end to end. `None` if there is nothing to draw; values that are negative or not
    /// finite are passed over.
    pub fn of(values: impl Iterator<Item = f64>, least_ratio: f64) -> Option<Self> {
        let (mut low, mut high, mut zeros) = (f64::INFINITY, f64::NEG_INFINITY, false);
        for value in values {
            zeros |= value == 0.0;
            if value > 0.0 && value.is_finite() {
                (low, high) = (low.min(value.log10()), high.max(value.log10()));
            }
        }
        if low > high {
            // All are zero: any scale serves.
            return zeros.then_some(Self { range: -7.0..-3.0, zero: Some(-6.5), is_linear: false, least_tick: -6.0 });
        }
        let missing = (least_ratio.log10() - (high - low)).max(0.0) / 2.0;
        let (low, high) = (low - missing, high + missing);
        let pad = MARGIN * (high - low);
        let range = low - pad..high + pad;
        let room = if zeros { 0.12 * (range.end - range.start) } else { 0.0 };
        Some(Self {
            least_tick: range.start,
            range: range.start - 2.0 * room..range.end,
            zero: zeros.then_some(range.start - room),
            is_linear: false,
        })
    }

    /// Returns a logarithmic axis for values that are spread over decades, and a linear one for others. `None` without a value; all must be finite.
    pub fn fitting(values: &[f64]) -> Option<Self> {
        let low = values.iter().copied().reduce(f64::min)?;
        let high = values.iter().copied().fold(low, f64::max);
        let least = values.iter().copied().filter(|value| *value > 0.0).fold(f64::INFINITY, f64::min);
        if low >= 0.0 && high > 50.0 * least {
            return Self::of(values.iter().copied(), 1.0);
        }
        let pad = if high > low { MARGIN * (high - low) } else { high.abs().max(1.0) };
        let range = low - pad..high + pad;
        Some(Self { least_tick: range.start, range, zero: None, is_linear: true })
    }

    /// Returns the place at which a value is drawn: zero at the floor. `None` for a value that the axis cannot hold.
    pub fn place(&self, value: f64) -> Option<f64> {
        match value {
            value if self.is_linear => Some(value).filter(|value| value.is_finite()),
            0.0 => self.zero,
            value if value > 0.0 && value.is_finite() => Some(value.log10()),
            _ => None,
        }
    }

    /// The places of round figures, three to seven of them where they can be had.
    pub fn ticks(&self) -> Vec<f64> {
        let range = self.least_tick..self.range.end;
        if self.is_linear {
            return even_ticks(&range);
        }
        let decades: [&[f64]; 3] = [&[1.0], &[1.0, 3.0], &[1.0, 2.0, 5.0]];
        let mut ticks = decades.iter().map(|steps| decade_ticks(&range, steps)).find(|ticks| ticks.len() >= 3);
        ticks = ticks.or_else(|| {
            let values = even_ticks(&(10_f64.powf(range.start)..10_f64.powf(range.end)));
            Some(values.into_iter().map(f64::log10).collect()).filter(|ticks: &Vec<f64>| ticks.len() >= 2)
        });
        let ticks = ticks.unwrap_or_else(|| vec![(range.start + range.end) / 2.0]);
        let every = ticks.len().div_ceil(8);
        ticks.into_iter().step_by(every.max(1)).collect()
    }

    /// The label of a tick: no more digits than it needs.
    pub fn label(&self, place: f64) -> String {
        if self.is_linear { label(place) } else { label(10_f64.powf(place)) }
    }
}

/// The axis as plotters draws it.
impl Ranged for Scale {
    type FormatOption = DefaultFormatting;
    type ValueType = f64;

    fn map(&self, place: &f64, limit: (i32, i32)) -> i32 {
        RangedCoordf64::from(self.range.clone()).map(place, limit)
    }

    fn key_points<Hint: KeyPointHint>(&self, hint: Hint) -> Vec<f64> {
        // No fainter lines between the ticks.
        if hint.weight().allow_light_points() { Vec::new() } else { self.ticks() }
    }

    fn range(&self) -> Range<f64> {
        self.range.clone()
    }
}

/// The places of multiples of powers of ten.
fn decade_ticks(range: &Range<f64>, steps: &[f64]) -> Vec<f64> {
    let (first, last) = (range.start.floor() as i32, range.end.ceil() as i32);
    let all = (first..=last).flat_map(|exponent| steps.iter().map(move |step| f64::from(exponent) + step.log10()));
    all.filter(|tick| range.contains(tick)).collect()
}

/// Evenly spaced ones, for a range within a decade or on both sides of zero.
fn even_ticks(range: &Range<f64>) -> Vec<f64> {
    let rough = (range.end - range.start) / 4.0;
    let power = 10_f64.powf(rough.log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0].map(|step| step * power).into_iter().find(|step| *step >= rough).unwrap_or(rough);
    let (first, last) = ((range.start / step).ceil() as i64, (range.end / step).floor() as i64);
    (first..=last).map(|index| index as f64 * step).collect()
}

/// No more digits than a number needs, of the five at its front.
fn label(value: f64) -> String {
    // A power of ten may have become a little less.
    let exponent = if value == 0.0 { 0 } else { (value.abs().log10() + 1e-9).floor() as i32 };
    if (-3..5).contains(&exponent) {
        let text = format!("{value:.6}");
        return text.trim_end_matches('0').trim_end_matches('.').to_owned();
    }
    let power = format!("10{}", superscript(&exponent.to_string()));
    let mantissa = value / 10_f64.powi(exponent);
    match (mantissa * 10.0).round() / 10.0 {
        1.0 => power,
        -1.0 => format!("-{power}"),
        mantissa => format!("{mantissa}×{power}"),
    }
}

/// An integer's digits, raised.
pub fn superscript(exponent: &str) -> String {
    let raised = |character| match character {
        '-' => '⁻',
        '0' => '⁰',
        '1' => '¹',
        '2' => '²',
        '3' => '³',
        '4'..='9' => char::from_u32('⁴' as u32 + character as u32 - '4' as u32).unwrap_or(character),
        other => other,
    };
    exponent.chars().map(raised).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_scale_holds_its_values_and_draws_zeros_below_them() {
        let scale = Scale::of([0.0, 0.01, 2.0, f64::NAN, f64::INFINITY].into_iter(), 3.0).expect("values to draw");
        let [zero, low, high] = [0.0, 0.01, 2.0].map(|value| scale.place(value).expect("a place"));
        assert!(scale.range.contains(&low) && scale.range.contains(&high));
        assert!(scale.range.contains(&zero) && zero < low);
        assert!(scale.ticks().iter().all(|tick| *tick > zero), "no tick says that the floor is a figure");
        assert_eq!(scale.place(f64::NAN), None);
        assert_eq!(scale.place(f64::INFINITY), None);
        assert_eq!(Scale::of([f64::NAN].into_iter(), 3.0), None);
    }

    #[test]
    fn values_over_decades_are_logarithmic_with_room_for_zero_and_others_are_not() {
        let decades = Scale::fitting(&[0.0, 1e-300, 1e300]).expect("values to draw");
        assert!(!decades.is_linear && decades.place(0.0) < decades.place(1e-300));
        assert!(decades.range.contains(&-300.0) && decades.range.contains(&300.0));
        let signed = Scale::fitting(&[-20.0, 0.0, 20.0]).expect("values to draw");
        assert!(signed.is_linear && signed.range.contains(&-20.0) && signed.range.contains(&20.0));
        assert_eq!((signed.place(-20.0), signed.place(f64::NAN)), (Some(-20.0), None));
        assert_eq!(signed.ticks(), [-20.0, 0.0, 20.0]);
        let (one, none) = (Scale::fitting(&[3.0]).expect("a value to draw"), Scale::fitting(&[]));
        assert!(one.range.contains(&3.0) && none.is_none());
    }

    #[test]
    fn every_span_has_a_few_ticks() {
        for ratio in [1.0, 1.1, 1.5, 4.0, 30.0, 1e3, 1e6, 1e12, 1e300] {
            for start in [1.0, 7.3, 0.000_123] {
                let scale = Scale::of([start, start * ratio].into_iter(), 1.3).expect("values to draw");
                let ticks = scale.ticks();
                assert!((2..=8).contains(&ticks.len()), "{start} to {}: {ticks:?}", start * ratio);
                assert!(ticks.iter().all(|tick| scale.range.contains(tick)));
            }
        }
    }

    #[test]
    fn labels_are_short() {
        let scale = Scale::of([1.0, 10.0].into_iter(), 1.0).expect("values to draw");
        let figures = [1000.0, 0.5, 0.001, 1e-4, 3e-6, 12.5];
        let expected = ["1000", "0.5", "0.001", "10⁻⁴", "3×10⁻⁶", "12.5"];
        assert_eq!(figures.map(label), expected);
        assert_eq!(figures.map(|figure| scale.label(figure.log10())), expected);
        assert_eq!([0.0, -20.0, 1e30, -1e6].map(label), ["0", "-20", "10³⁰", "-10⁶"]);
    }
}
