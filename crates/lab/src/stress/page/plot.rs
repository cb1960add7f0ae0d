//! Error over the swept quantity, as inline SVG: both on logarithmic axes, but for quantities that are below zero.

use plotters::prelude::*;

use crate::stress::{Outcome, Verdict};

const SIZE: (u32, u32) = (760, 260);
/// Errors below are drawn there.
const LEAST: f64 = 1e-9;
/// Errors above are drawn there.
const MOST: f64 = 1e2;
const WORST: RGBColor = RGBColor(0xb3, 0x47, 0x00);
const MEAN: RGBColor = RGBColor(0x00, 0x72, 0xb2);
const BOUND: RGBColor = RGBColor(0x1f, 0x23, 0x28);
const CLAIM: RGBColor = RGBColor(0xe2, 0xf4, 0xee);

/// The plot; nothing where less than two values were measured.
pub fn svg(verdict: &Verdict) -> String {
    let values: Vec<f64> = verdict.findings.iter().map(|finding| finding.value).collect();
    let axis = Axis::of(&values);
    let series = |error: fn(&crate::stress::Errors) -> f64| -> Vec<(f64, f64)> {
        let measured = verdict.findings.iter().filter_map(|finding| match &finding.outcome {
            Outcome::Measured(errors) => Some((axis.at(finding.value), error(errors))),
            Outcome::Refused(_) => None,
        });
        measured.map(|(x, error)| (x, held(error))).collect()
    };
    let (worst, mean) = (series(|errors| errors.worst), series(|errors| errors.mean));
    let (Some(&first), Some(&last)) = (values.first(), values.last()) else { return String::new() };
    if worst.len() < 2 {
        return String::new();
    }
    let mut text = String::new();
    // A backend of text has nothing that could fail; were it so, the page goes without the plot.
    let drawn = draw(&mut text, verdict, &axis, [axis.at(first), axis.at(last)], &[(WORST, worst), (MEAN, mean)]);
    if drawn.is_ok() { text } else { String::new() }
}

type Series = (RGBColor, Vec<(f64, f64)>);

fn draw(
    text: &mut String,
    verdict: &Verdict,
    axis: &Axis,
    [left, right]: [f64; 2],
    series: &[Series],
) -> Result<(), Box<dyn std::error::Error>> {
    let root = SVGBackend::with_string(text, SIZE).into_drawing_area();
    let mut chart = ChartBuilder::on(&root)
        .margin(8)
        .x_label_area_size(34)
        .y_label_area_size(64)
        .build_cartesian_2d(left..right, (held(0.0)..held(MOST)).step(1.0))?;
    let [from, to] = verdict.case.claim.map(|end| axis.at(end));
    chart.draw_series([Rectangle::new([(from, held(0.0)), (to, held(MOST))], CLAIM.filled())])?;
    let unit = if verdict.case.unit.is_empty() { String::new() } else { format!(", {}", verdict.case.unit) };
    chart
        .configure_mesh()
        .disable_x_mesh()
        .x_desc(format!("{}{unit}", verdict.case.name))
        .x_label_formatter(&|x| axis.label(*x))
        .y_label_formatter(&|y| format!("1e{y:.0}"))
        .draw()?;
    let bound = held(verdict.case.bound.worst);
    chart.draw_series(LineSeries::new([(left, bound), (right, bound)], BOUND))?;
    for (color, points) in series {
        chart.draw_series(LineSeries::new(points.iter().copied(), color.stroke_width(2)))?;
        chart.draw_series(points.iter().map(|&point| Circle::new(point, 3, color.filled())))?;
    }
    root.present()?;
    Ok(())
}

/// The logarithm of an error, within the plot.
fn held(error: f64) -> f64 {
    if error.is_nan() { MOST.log10() } else { error.clamp(LEAST, MOST).log10() }
}

/// The scale of an axis.
enum Axis {
    Linear,
    /// The logarithm of the least value above zero: zero itself lies a decade before it.
    Logarithmic(f64),
}

impl Axis {
    fn of(values: &[f64]) -> Self {
        let above = values.iter().copied().filter(|&value| value > 0.0);
        let (least, most) =
            above.fold((f64::INFINITY, 0.0f64), |(least, most), value| (least.min(value), most.max(value)));
        let is_wide = most > 50.0 * least && values.iter().all(|&value| value >= 0.0);
        if is_wide { Self::Logarithmic(least.log10()) } else { Self::Linear }
    }

    fn at(&self, value: f64) -> f64 {
        match *self {
            Self::Linear => value,
            Self::Logarithmic(least) if value <= 0.0 => least - 1.0,
            Self::Logarithmic(_) => value.log10(),
        }
    }

    fn label(&self, place: f64) -> String {
        match *self {
            Self::Linear => format!("{place}"),
            Self::Logarithmic(least) if place < least - 0.5 => "0".into(),
            Self::Logarithmic(_) if place.fract().abs() < 1e-6 => format!("1e{place:.0}"),
            Self::Logarithmic(_) => format!("{:.2}", 10f64.powf(place)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantities_over_decades_are_logarithmic_with_room_for_zero_and_others_are_not() {
        let axis = Axis::of(&[0.0, 1e-3, 1.0]);
        assert_eq!((axis.at(0.0), axis.at(1.0), axis.label(-4.0)), (-4.0, 0.0, "0".into()));
        assert_eq!(Axis::of(&[-20.0, 0.0, 20.0]).at(-20.0), -20.0);
        assert_eq!((held(f64::NAN), held(f64::INFINITY), held(0.0)), (2.0, 2.0, -9.0));
    }
}
