//! Metrics by name, and limits on them.

use afterlight::scene::unknown;

use super::pair::Comparison;
use crate::failure::Failure;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ComparisonMetric {
    Rmse,
    RelMse,
    Max,
    P99_9,
    Flip,
    Psnr,
    Differing,
}

const NAMES: [(&str, ComparisonMetric); 7] = [
    ("rmse", ComparisonMetric::Rmse),
    ("relmse", ComparisonMetric::RelMse),
    ("max", ComparisonMetric::Max),
    ("p99.9", ComparisonMetric::P99_9),
    ("flip", ComparisonMetric::Flip),
    ("psnr", ComparisonMetric::Psnr),
    ("differing", ComparisonMetric::Differing),
];

impl ComparisonMetric {
    pub fn name(self) -> &'static str {
        NAMES.iter().find(|(_, metric)| *metric == self).map_or("", |(name, _)| name)
    }

    /// Returns the metric: of light if both pictures are light, else of the pictures as shown. PSNR and FLIP are always of the pictures as shown.
    /// `None` if the comparison lacks the metric.
    pub fn of(self, comparison: &Comparison) -> Option<f64> {
        let difference = comparison.light.as_ref().unwrap_or(&comparison.shown);
        match self {
            Self::Rmse => Some(difference.rmse),
            Self::RelMse => comparison.light.as_ref().map(|light| light.rel_mse),
            Self::Max => Some(difference.max),
            Self::P99_9 => Some(difference.p99_9),
            #[cfg(feature = "report")]
            Self::Flip => Some(comparison.flip.mean()),
            #[cfg(not(feature = "report"))]
            Self::Flip => None,
            Self::Psnr => Some(comparison.shown.psnr_db(1.0)),
            Self::Differing => Some(difference.differing_pixels as f64),
        }
    }

    /// Refuses a metric that pictures of this kind do not have.
    pub fn applies(self, light: bool) -> Result<(), Failure> {
        match self {
            Self::RelMse if !light => Err(Failure::usage("relmse is a metric of light: it needs two .exr pictures")),
            Self::Flip if cfg!(not(feature = "report")) => {
                Err(Failure::usage("flip is not built in: it comes with the feature `report`"))
            }
            _ => Ok(()),
        }
    }
}

/// The limit of a metric: the greatest value that passes, or of PSNR the least.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limit {
    pub metric: ComparisonMetric,
    pub value: f64,
}

impl Limit {
    /// `METRIC=VALUE`.
    pub fn parse(text: &str) -> Result<Self, String> {
        let (name, value) = text.split_once('=').ok_or("it is not METRIC=VALUE, as flip=0.01")?;
        let metric = NAMES.iter().find(|(own, _)| *own == name).map(|&(_, metric)| metric);
        let metric = metric.ok_or_else(|| unknown("metric", name, &NAMES.map(|(name, _)| name)))?;
        let value = value.parse::<f64>().ok().filter(|value| value.is_finite() && *value >= 0.0);
        Ok(Self { metric, value: value.ok_or("the value is not a number from 0 up")? })
    }

    /// Returns a sentence if the comparison breaks the limit.
    pub fn broken_by(&self, comparison: &Comparison) -> Option<String> {
        // A limit without a value does not hold; `Metric::applies` has told why.
        let found = self.metric.of(comparison).unwrap_or(f64::NAN);
        let (holds, side) = match self.metric {
            ComparisonMetric::Psnr => (found >= self.value, "below"),
            _ => (found <= self.value, "above"),
        };
        (!holds).then(|| format!("{} is {}, {side} {}", self.metric.name(), super::figure(found), self.value))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_are_read_and_wrong_ones_told() {
        assert_eq!(Limit::parse("p99.9=0.5"), Ok(Limit { metric: ComparisonMetric::P99_9, value: 0.5 }));
        assert!(Limit::parse("fip=1").is_err_and(|error| error.contains("did you mean \"flip\"")));
        for text in ["flip", "flip=", "flip=-1", "flip=nan", "=1"] {
            assert!(Limit::parse(text).is_err(), "{text}");
        }
    }

    #[test]
    fn relative_errors_need_light() {
        assert!(ComparisonMetric::RelMse.applies(false).is_err() && ComparisonMetric::RelMse.applies(true).is_ok());
        assert!(ComparisonMetric::Psnr.applies(false).is_ok());
        assert_eq!(ComparisonMetric::Flip.applies(false).is_ok(), cfg!(feature = "report"));
    }
}
