//! Error over the swept quantity.

use super::super::{StressOutcome, StressResult, range};
use crate::page::marks::Glyph;
use crate::page::plot::{Area, Axis, Line, Mark, Plot, Stroke};
use crate::page::scales::Scale;

/// Errors beyond are drawn at the ends, so that the plots of all cases have one scale.
const ERRORS: [f64; 2] = [1e-9, 1e2];
/// The marks of the worst pixel and of the mean.
pub const WORST: Glyph = Glyph::family(1);
pub const MEAN: Glyph = Glyph::family(0);

/// The plot; `None` where less than two values were measured.
pub fn of(verdict: &StressResult) -> Option<Plot> {
    let case = &verdict.case;
    let values: Vec<f64> = verdict.findings.iter().map(|finding| finding.value).collect();
    let measured = verdict.findings.iter().filter_map(|finding| match &finding.outcome {
        StressOutcome::Measured(errors) => Some((finding.value, errors.worst, errors.mean)),
        StressOutcome::Refused(_) => None,
    });
    let measured: Vec<(f64, f64, f64)> = measured.collect();
    if measured.len() < 2 {
        return None;
    }
    let mark = |what: &str, glyph, (x, error): (f64, f64)| Mark {
        x,
        whisker: x..x,
        y: held(error),
        glyph,
        hollow: false,
        ringed: false,
        tooltip: format!("{what} {error:.2e} at {}", range(Some([x, x]), case.unit)),
        label: None,
    };
    let worst = measured.iter().map(|&(value, worst, _)| (value, worst));
    let mean = measured.iter().map(|&(value, _, mean)| (value, mean));
    let line = |stroke, points: &mut dyn Iterator<Item = (f64, f64)>| Line {
        stroke,
        points: points.map(|(value, error)| (value, held(error))).collect(),
    };
    let unit = if case.unit.is_empty() { String::new() } else { format!(", {}", case.unit) };
    Some(Plot {
        size: (760.0, 260.0),
        x: Axis { title: format!("{}{unit}", case.name), scale: Scale::fitting(&values) },
        y: Axis { title: "error".to_owned(), scale: Scale::of(ERRORS.into_iter(), 1.0) },
        label: format!("Error over {}: the worst pixel and the mean. The numbers are in the table below.", case.name),
        lines: vec![line(Stroke::Curve, &mut mean.clone()), line(Stroke::Worst, &mut worst.clone())],
        marks: mean.map(|at| mark("mean", MEAN, at)).chain(worst.map(|at| mark("worst", WORST, at))).collect(),
        area: Some(Area {
            class: "claim",
            level: held(case.bound.worst),
            between: Some(case.claim),
            note: "bound of the worst pixel",
        }),
    })
}

/// An error within the plot.
fn held(error: f64) -> f64 {
    if error.is_nan() { ERRORS[1] } else { error.clamp(ERRORS[0], ERRORS[1]) }
}
