//! Logarithmic axes: their ranges and ticks.

use std::ops::Range;

/// Of an axis in pixels, how much is free beyond the outermost points, as a share of its length.
const MARGIN: f64 = 0.07;

/// The span of a logarithmic axis.
#[derive(Debug, Clone, PartialEq)]
pub struct Scale {
    pub range: Range<f64>,
    /// The place at which zeros are drawn, below all other values.
    pub zero: Option<f64>,
    /// Below it are no ticks.
    least_tick: f64,
}

impl Scale {
    /// Returns an axis for these values, at least `least_ratio` from end to end. `None` if there is nothing to draw; values that are negative or not
    /// finite are passed over.
    pub fn of(values: impl Iterator<Item = f64>, least_ratio: f64) -> Option<Self> {
        let (mut low, mut high, mut zeros) = (f64::INFINITY, 0.0_f64, false);
        for value in values {
            zeros |= value == 0.0;
            if value > 0.0 && value.is_finite() {
                (low, high) = (low.min(value), high.max(value));
            }
        }
        if high == 0.0 {
            // All are zero: any scale serves.
            return zeros.then_some(Self { range: 1e-7..1e-3, zero: Some(3e-7), least_tick: 1e-6 });
        }
        let missing = (least_ratio / (high / low)).max(1.0).sqrt();
        let (low, high) = (low / missing, high * missing);
        let pad = (high / low).powf(MARGIN);
        let range = low / pad..high * pad;
        match zeros {
            false => Some(Self { least_tick: range.start, range, zero: None }),
            true => {
                let room = (range.end / range.start).powf(0.12);
                let (low, zero) = (range.start / (room * room), range.start / room);
                Some(Self { range: low..range.end, zero: Some(zero), least_tick: range.start })
            }
        }
    }

    /// Returns the place at which a value is drawn: zero at the floor. `None` for a value that the axis cannot hold.
    pub fn place(&self, value: f64) -> Option<f64> {
        match value {
            0.0 => self.zero,
            value if value > 0.0 && value.is_finite() => Some(value),
            _ => None,
        }
    }

    /// Round figures, three to seven of them where they can be had.
    pub fn ticks(&self) -> Vec<f64> {
        let range = self.least_tick..self.range.end;
        let decades: [&[f64]; 3] = [&[1.0], &[1.0, 3.0], &[1.0, 2.0, 5.0]];
        let mut ticks = decades.iter().map(|steps| decade_ticks(&range, steps)).find(|ticks| ticks.len() >= 3);
        ticks = ticks.or_else(|| Some(even_ticks(&range)).filter(|ticks| ticks.len() >= 2));
        let ticks = ticks.unwrap_or_else(|| vec![(range.start * range.end).sqrt()]);
        let every = ticks.len().div_ceil(8);
        ticks.into_iter().step_by(every.max(1)).collect()
    }
}

/// Multiples of powers of ten.
fn decade_ticks(range: &Range<f64>, steps: &[f64]) -> Vec<f64> {
    let (first, last) = (range.start.log10().floor() as i32, range.end.log10().ceil() as i32);
    let all = (first..=last).flat_map(|exponent| steps.iter().map(move |step| step * 10_f64.powi(exponent)));
    all.filter(|tick| range.contains(tick)).collect()
}

/// Evenly spaced ones, for a range within a decade.
fn even_ticks(range: &Range<f64>) -> Vec<f64> {
    let rough = (range.end - range.start) / 4.0;
    let power = 10_f64.powf(rough.log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0].map(|step| step * power).into_iter().find(|step| *step >= rough).unwrap_or(rough);
    let (first, last) = ((range.start / step).ceil() as i64, (range.end / step).floor() as i64);
    (first..=last).map(|index| index as f64 * step).collect()
}

/// A tick's label: no more digits than it needs.
pub fn label(value: f64) -> String {
    let exponent = value.log10().floor() as i32;
    if (-3..5).contains(&exponent) {
        let text = format!("{value:.6}");
        return text.trim_end_matches('0').trim_end_matches('.').to_owned();
    }
    let power = format!("10{}", superscript(&exponent.to_string()));
    let mantissa = value / 10_f64.powi(exponent);
    match (mantissa * 10.0).round() / 10.0 {
        1.0 => power,
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
        assert!(scale.range.contains(&0.01) && scale.range.contains(&2.0));
        let zero = scale.place(0.0).expect("a place for zeros");
        assert!(scale.range.contains(&zero) && zero < 0.01);
        assert!(scale.ticks().iter().all(|tick| *tick > zero), "no tick says that the floor is a figure");
        assert_eq!(scale.place(f64::NAN), None);
        assert_eq!(scale.place(f64::INFINITY), None);
        assert_eq!(Scale::of([f64::NAN].into_iter(), 3.0), None);
    }

    #[test]
    fn every_span_has_a_few_ticks() {
        for ratio in [1.0, 1.1, 1.5, 4.0, 30.0, 1e3, 1e6, 1e12] {
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
        assert_eq!(
            [1000.0, 0.5, 0.001, 1e-4, 3e-6, 12.5].map(label),
            ["1000", "0.5", "0.001", "10⁻⁴", "3×10⁻⁶", "12.5"]
        );
    }
}
