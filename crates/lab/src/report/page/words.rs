//! Figures as people read them, and the names of the measured quantities.

use crate::page::scales::superscript;
use crate::report::sweep::model::{Against, Interval, Metric, Point, SceneReport};
use afterlight::scene::{self, plural};

/// Three significant digits; very small and large figures with a power of ten. A NaN or an infinity is told in words.
pub fn number(value: f64) -> String {
    if value.is_nan() {
        return "not a number".to_owned();
    }
    if value.is_infinite() {
        return "infinite".to_owned();
    }
    if value == 0.0 {
        return "0".to_owned();
    }
    if !(1e-3..1e5).contains(&value.abs()) {
        // Formatted first: rounding may carry into the next power of ten.
        let text = format!("{value:.2e}");
        let (mantissa, exponent) = text.split_once('e').unwrap_or((&text, "0"));
        return minus(&format!("{mantissa}×10{}", superscript(exponent)));
    }
    let decimals = (2 - value.abs().log10().floor() as i32).max(0) as usize;
    minus(&format!("{value:.decimals$}"))
}

/// The sign that is as wide as a digit.
fn minus(text: &str) -> String {
    text.replace('-', "−")
}

/// A share of 1, signed.
pub fn percent(share: f64) -> String {
    if !share.is_finite() {
        return "—".to_owned();
    }
    let percent = share * 100.0;
    let decimals = match percent.abs() {
        0.0 => 0,
        tiny if tiny < 0.005 => return if share < 0.0 { "> −0.01%" } else { "< 0.01%" }.to_owned(),
        small if small < 0.95 => 2,
        middling if middling < 9.95 => 1,
        _ => 0,
    };
    minus(&format!("{percent:.decimals$}%"))
}

/// "12.3 ms (12.1 to 12.5)".
pub fn time(interval: &Interval) -> String {
    format!("{} ms ({} to {})", number(interval.median), number(interval.low), number(interval.high))
}

/// "±4.2%".
pub fn uncertainty(interval: &Interval) -> String {
    format!("±{}", percent(interval.relative_half_width()))
}

/// Device memory.
pub fn mebibytes(bytes: u64) -> String {
    format!("{} MiB", number(bytes as f64 / f64::from(1 << 20)))
}

/// A figure relative to the default settings' figure, as "0.82×".
pub fn times(value: f64, of: f64) -> String {
    match value / of {
        ratio if ratio.is_finite() => format!("{}×", number(ratio)),
        _ => "—".to_owned(),
    }
}

/// "12% less time", "0.420 of the time", for a figure that is at most `than`.
pub fn less(what: &str, value: f64, than: f64) -> String {
    let ratio = value / than;
    if ratio > 0.995 {
        format!("no more {what}")
    } else if value == 0.0 {
        format!("no {what}")
    } else if ratio > 0.5 {
        format!("{:.0}% less {what}", (1.0 - ratio) * 100.0)
    } else {
        format!("{} of the {what}", number(ratio))
    }
}

/// A count with its noun, with digits in threes.
pub fn counted(count: usize, noun: &str) -> String {
    if count == 1 { scene::counted(count, noun) } else { format!("{} {}", grouped(count), plural(noun)) }
}

/// Digits in threes.
pub fn grouped(count: usize) -> String {
    let digits = count.to_string();
    let mut grouped = String::with_capacity(digits.len() + digits.len() / 3);
    for (index, digit) in digits.chars().enumerate() {
        if index > 0 && (digits.len() - index).is_multiple_of(3) {
            grouped.push(',');
        }
        grouped.push(digit);
    }
    grouped
}

impl Metric {
    pub(super) fn title(self) -> &'static str {
        match self {
            Self::RelMse => "relMSE",
            Self::Rmse => "RMSE",
            Self::Flip => "FLIP",
        }
    }
}

impl Against {
    /// Returns the name of the error against this truth.
    pub(super) fn title(self) -> &'static str {
        match self {
            Self::Point => "numeric error and texture filtering",
            Self::Converged => "all of the error",
        }
    }
}

/// Returns the title of the time axis.
pub fn clock(scene: &SceneReport) -> &'static str {
    match scene.points.iter().all(|point| point.time.gpu.is_some()) {
        true => "device time",
        false => "wall-clock time",
    }
}

/// Returns the text that a pointer over a point shows; its numbers are in a table too.
pub fn tooltip(point: &Point, metric: Metric, truth: Against) -> String {
    let time_known = if point.time.decisive().is_wide() { ", not well known" } else { "" };
    format!(
        "{}\n{}{time_known}\n{} {} ({})",
        point.name,
        time(point.time.decisive()),
        metric.title(),
        number(point.errors.against(truth).by(metric)),
        truth.title()
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_have_three_significant_digits() {
        let read = [0.0, 0.01234, 12.345, 1234.4, 99999.0, 0.000999, 1.5e-12, -0.5, 2.0e7].map(number);
        assert_eq!(
            read,
            ["0", "0.0123", "12.3", "1234", "99999", "9.99×10⁻⁴", "1.50×10⁻¹²", "−0.500", "2.00×10⁷"]
                .map(str::to_owned)
        );
    }

    #[test]
    fn what_is_no_number_is_told_in_words() {
        assert_eq!(number(f64::NAN), "not a number");
        assert_eq!(number(f64::NEG_INFINITY), "infinite");
        assert_eq!(times(1.0, 0.0), "—");
    }

    #[test]
    fn how_much_less_is_what_is_missing_or_what_is_left() {
        assert_eq!(less("time", 0.88, 1.0), "12% less time");
        assert_eq!(less("time", 1.0, 4.0), "0.250 of the time");
        assert_eq!(less("error", 1.0, 1.0), "no more error");
        assert_eq!(less("error", 0.0, 1.0), "no error");
    }

    #[test]
    fn shares_and_counts_read_easily() {
        assert_eq!(
            [0.0, 0.000_01, -0.000_01, 0.0013, 0.0331, 0.71, -0.09].map(percent),
            ["0%", "< 0.01%", "> −0.01%", "0.13%", "3.3%", "71%", "−9.0%"]
        );
        assert_eq!([0, 999, 1000, 1_234_567].map(grouped), ["0", "999", "1,000", "1,234,567"]);
        assert_eq!(counted(1, "point"), "1 point");
    }
}
