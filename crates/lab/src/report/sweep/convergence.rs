//! Orders of convergence where theory has one, and the reasons that keep a curve from falling.

use super::model::{Against, Convergence, Member, Metric, Point, TruthInfo};
use afterlight::scene::counted;
use afterlight_truth::measure::fit_power_law;

/// The convergence that theory expects of a family.
struct ExpectedConvergence {
    metric: Metric,
    truth: Against,
    text: &'static str,
}

/// A curve that loses less than this share of its largest error is flat.
const FLAT: f64 = 0.1;
/// Noise of the truth, or a floor, above this share of the least error is most of it.
const MOST: f64 = 0.5;

fn expected(family: &str) -> Option<ExpectedConvergence> {
    match family.split('/').next()? {
        "shadow-size" => Some(ExpectedConvergence {
            metric: Metric::RelMse,
            truth: Against::Point,
            text: "1: what is shadowed wrongly is a strip along the edges of shadows, about a texel wide, and its area is \
                   a mean square (after Williams 1978, and Lloyd et al. 2006 on the error of a texel)",
        }),
        "samples" => Some(ExpectedConvergence {
            metric: Metric::Rmse,
            truth: Against::Converged,
            text: "0.75: no set of N points does better than N^-3/4 for the mean over all straight edges (Beck 1987); \
                   points at random have 0.5",
        }),
        _ => None,
    }
}

/// The fit of a family, if there is one, and a sentence about its floor, if it has one.
pub fn of(key: &str, members: &[Member], points: &[Point], truth: &TruthInfo) -> (Option<Convergence>, Option<String>) {
    let Some(expected) = expected(key) else { return (None, flat(members, points, truth)) };
    let error = |member: &Member| points[member.point].errors.against(expected.truth).by(expected.metric);
    let curve: Vec<(f64, f64)> = members
        .iter()
        .filter_map(|member| Some((member.value?, error(member))))
        .filter(|point| point.1 > 0.0)
        .collect();
    let Some(law) = fit_power_law(&curve) else { return (None, flat(members, points, truth)) };
    let convergence = Convergence {
        metric: expected.metric,
        truth: expected.truth,
        order: law.order,
        low: law.low,
        high: law.high,
        floor: law.floor,
        expected: expected.text.into(),
    };
    let least = curve.iter().map(|&(_, error)| error).fold(f64::INFINITY, f64::min);
    let floor = (law.floor > MOST * least).then(|| floor_text(key, law.floor, &expected, truth));
    (Some(convergence), floor)
}

fn noise(metric: Metric, truth: &TruthInfo) -> f64 {
    match metric {
        Metric::RelMse => truth.noise_rel_mse,
        Metric::Rmse => truth.noise_rmse,
        Metric::Flip => 0.0,
    }
}

fn floor_text(key: &str, floor: f64, expected: &ExpectedConvergence, truth: &TruthInfo) -> String {
    let family = key.split('/').next().unwrap_or(key);
    let own = noise(expected.metric, truth);
    let why = if expected.truth == Against::Converged && own > MOST * floor {
        format!(
            "the truth is no surer than that: its own standard error is {own:.2e} with {}",
            counted(truth.samples, "sample")
        )
    } else if family == "samples" {
        "more samples remove aliasing and what textures are blurred by, and nothing else: what is left is that of shadow maps and the G-buffer"
            .into()
    } else {
        "finer maps remove the edges' steps and nothing else: what is left is the bias and the width of the filter, lights that have a size, \
         and the rest of the frame"
            .into()
    };
    format!("It does not fall below about {floor:.2e}: {why}.")
}

/// Returns a sentence if a curve does not fall at all: its error, and the reason.
fn flat(members: &[Member], points: &[Point], truth: &TruthInfo) -> Option<String> {
    let errors: Vec<f64> = members.iter().map(|member| points[member.point].errors.converged.rel_mse).collect();
    let (least, largest) = errors.iter().fold((f64::INFINITY, 0.0f64), |(a, b), &error| (a.min(error), b.max(error)));
    if !(largest > 0.0 && largest - least < FLAT * largest) {
        return None;
    }
    let numeric: Vec<f64> = members.iter().map(|member| points[member.point].errors.point.rel_mse).collect();
    let numeric = numeric.iter().fold(f64::INFINITY, |a, &b| a.min(b));
    let why = if truth.noise_rel_mse > MOST * least {
        format!(
            "it is mostly the truth's own noise, {:.2e} with {}",
            truth.noise_rel_mse,
            counted(truth.samples, "sample")
        )
    } else if numeric < MOST * least {
        format!("most of it is aliasing: against the truth through the pixels' centres the least is {numeric:.2e}")
    } else {
        "other parts of the frame hide what this setting does: the attribution says which".into()
    };
    Some(format!("All members have about the same error, {least:.2e} (relMSE, converged): {why}."))
}

#[cfg(test)]
mod tests {
    use super::super::run::samples::point;
    use super::*;

    fn curve(error: impl Fn(f64) -> f64) -> (Vec<Member>, Vec<Point>) {
        let values = [256.0, 512.0, 1024.0, 2048.0, 4096.0];
        let members = values.iter().enumerate();
        let members =
            members.map(|(point, value)| Member { point, label: value.to_string(), value: Some(*value) }).collect();
        (members, values.iter().map(|&value| point(&value.to_string(), error(value), 1.0)).collect())
    }

    fn truth(noise: f64) -> TruthInfo {
        TruthInfo { samples: 64, noise_rmse: noise, noise_rel_mse: noise, sky: 0.0, other_triangle: None, size: None }
    }

    #[test]
    fn a_planted_order_is_found_and_has_no_floor() {
        let (members, points) = curve(|size| 3.0 / size);
        let (fit, floor) = of("shadow-size", &members, &points, &truth(0.0));
        let fit = fit.expect("falls");
        assert!((fit.order - 1.0).abs() < 0.05, "{fit:?}");
        assert_eq!(floor, None);
    }

    #[test]
    fn a_planted_floor_is_told_with_its_reason() {
        let (members, points) = curve(|size| 3.0 / size + 0.01);
        let (fit, floor) = of("shadow-size/none", &members, &points, &truth(0.0));
        assert!((fit.expect("falls").floor - 0.01).abs() < 0.002);
        assert!(floor.is_some_and(|text| text.contains("bias")));
        let (_, floor) = of("samples", &members, &points, &truth(0.009));
        assert!(floor.is_some_and(|text| text.contains("standard error")));
    }

    #[test]
    fn a_flat_curve_says_so() {
        let (members, points) = curve(|_| 0.01);
        let (fit, floor) = of("cascades", &members, &points, &truth(0.0));
        assert!(fit.is_none() && floor.is_some_and(|text| text.contains("about the same error")));
        let (members, points) = curve(|size| size);
        assert_eq!(of("cascades", &members, &points, &truth(0.0)).1, None);
    }
}
