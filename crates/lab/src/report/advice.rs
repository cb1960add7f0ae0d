//! Advice on settings, in words: the points of a front that are worth taking in place of the settings as given, and the gain of each.
//!
//! Advice counts only significant differences: a time whose 95% interval lies below the interval of the settings as given, an error that differs by
//! more than 1% and by more than the truth's own noise.

use super::sweep::model::{Against, Front, Interval, Metric, SceneReport};

/// Errors that differ by no more than this share look the same.
const SAME_ERROR: f64 = 0.01;
/// A gain of less is not worth a change.
const WORTH: f64 = 0.95;

/// Why somebody would take a point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reason {
    /// It takes less time and errs no more, or errs less and takes no more time.
    Free,
    /// It errs less, for more time.
    TimeToSpare,
    /// It takes less time, and errs more.
    TimeIsShort,
}

impl Reason {
    /// Returns the words before the settings.
    pub fn text(self) -> &'static str {
        match self {
            Self::Free => "What to change",
            Self::TimeToSpare => "If there is time to spare",
            Self::TimeIsShort => "If time is short",
        }
    }
}

/// A point that is worth taking.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Advice {
    pub reason: Reason,
    /// Index in [`SceneReport::points`].
    pub point: usize,
}

/// A report's first paragraph where nothing is to be had for free.
pub const KEEP: &str = "What to change: nothing. No settings that were measured are faster with the same error, or nearer to the truth in the \
                        same time.";

/// Returns the changes to make: the free ones first, then the trades. Empty if the settings as given have no error that can be compared.
pub fn of(scene: &SceneReport, front: &Front) -> Vec<Advice> {
    let change = |point: usize| Tradeoff::of(scene, front.metric, front.truth, point);
    let default = change(scene.default);
    let confirmed = front.points.iter().copied().filter(|&point| scene.points[point].time.confirmed);
    let others: Vec<usize> = confirmed.filter(|&point| point != scene.default).collect();
    if !default.error.is_finite() {
        return Vec::new();
    }
    let faster = |&point: &usize| change(point).is_faster();
    let nearer = |&point: &usize| change(point).is_nearer();
    let time = |point: &usize| change(*point).time.median;
    let error = |point: &usize| change(*point).error;
    let by = |of: &dyn Fn(&usize) -> f64, points: Vec<usize>| points.into_iter().min_by(|a, b| of(a).total_cmp(&of(b)));
    let those = |wanted: &dyn Fn(&usize) -> bool| others.iter().copied().filter(wanted).collect::<Vec<_>>();

    let less_time = by(&time, those(&|point| faster(point) && !change(*point).errs_more()));
    let less_error = by(&error, those(&|point| nearer(point) && !change(*point).is_slower()));
    // Half the error, or half the time, is worth a trade; if no point halves it, the one that gains most is taken.
    let half_error = by(&time, those(&|point| nearer(point) && change(*point).error_ratio() <= 0.5));
    let to_spare = half_error.or_else(|| by(&error, those(&nearer)));
    let half_time = by(&error, those(&|point| faster(point) && time(point) <= 0.5));
    let short = half_time.or_else(|| by(&time, those(&faster)));

    let all = [
        (Reason::Free, less_time),
        (Reason::Free, less_error),
        (Reason::TimeToSpare, to_spare),
        (Reason::TimeIsShort, short),
    ];
    let mut advice: Vec<Advice> = Vec::new();
    for (reason, point) in all {
        let Some(point) = point.filter(|&point| advice.iter().all(|known| known.point != point)) else { continue };
        // A free change that gains as much, or halves the time already, leaves a trade no reason.
        let is_free = match reason {
            Reason::Free => false,
            Reason::TimeToSpare => less_error.is_some_and(|free| error(&free) <= error(&point)),
            Reason::TimeIsShort => less_time.is_some_and(|free| time(&free) <= time(&point).max(0.5)),
        };
        if !is_free {
            advice.push(Advice { reason, point });
        }
    }
    advice
}

/// Returns the gain and the cost of a point, as "half the time, the same error within 1%".
pub fn gain(scene: &SceneReport, metric: Metric, truth: Against, point: usize) -> String {
    let change = Tradeoff::of(scene, metric, truth, point);
    let time = match change.time {
        time if time.low <= 1.0 && time.high >= 1.0 => "the same time within noise".to_owned(),
        time => share(time.median, "time"),
    };
    let error = match (change.is_within_noise(), change.is_same_error()) {
        _ if change.error == change.default_error => "the same error".to_owned(),
        (true, _) => "the same error within noise".to_owned(),
        (_, true) => "the same error within 1%".to_owned(),
        _ if !change.error.is_finite() => "pixels that are not finite".to_owned(),
        _ => share(change.error_ratio(), "error"),
    };
    format!("{time}, {error}")
}

/// A point beside the settings as given.
struct Tradeoff {
    /// The time over the time of the settings as given.
    time: Interval,
    error: f64,
    default_error: f64,
    /// The truth's own noise in this metric; 0 if it is not known.
    noise: f64,
}

impl Tradeoff {
    fn of(scene: &SceneReport, metric: Metric, truth: Against, point: usize) -> Self {
        let error = |point: usize| scene.points[point].errors.against(truth).comparable(metric);
        let noise = if truth == Against::Converged { scene.truth.noise(metric) } else { None };
        Self {
            time: scene.points[point].time.ratio,
            error: error(point),
            default_error: error(scene.default),
            noise: noise.unwrap_or(0.0),
        }
    }

    fn error_ratio(&self) -> f64 {
        self.error / self.default_error
    }

    fn is_within_noise(&self) -> bool {
        (self.error - self.default_error).abs() <= self.noise
    }

    fn is_same_error(&self) -> bool {
        self.is_within_noise() || (self.error - self.default_error).abs() <= SAME_ERROR * self.default_error
    }

    fn errs_more(&self) -> bool {
        self.error > self.default_error && !self.is_same_error()
    }

    fn is_nearer(&self) -> bool {
        self.error_ratio() <= WORTH && !self.is_same_error()
    }

    fn is_faster(&self) -> bool {
        self.time.high < 1.0 && self.time.median <= WORTH
    }

    /// A point is slower if the interval of its time lies above 1, or the median does by about 5%: then its times scatter.
    fn is_slower(&self) -> bool {
        self.time.low > 1.0 || self.time.median > 1.0 / WORTH
    }
}

/// "half the time", "12% less time", "4.1 times the time".
fn share(ratio: f64, what: &str) -> String {
    match ratio {
        ratio if ratio >= 9.95 => format!("{ratio:.0} times the {what}"),
        ratio if ratio >= 1.95 => format!("{ratio:.1} times the {what}"),
        ratio if ratio >= 1.0 => format!("{:.0}% more {what}", (100.0 * (ratio - 1.0)).max(1.0)),
        ratio if ratio > 0.54 => format!("{:.0}% less {what}", (100.0 * (1.0 - ratio)).max(1.0)),
        ratio if ratio >= 0.46 => format!("half the {what}"),
        ratio if (0.31..=0.36).contains(&ratio) => format!("a third of the {what}"),
        ratio if (0.235..=0.265).contains(&ratio) => format!("a quarter of the {what}"),
        ratio => format!("{:.0}% of the {what}", 100.0 * ratio),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::page::samples;

    const FLIP: (Metric, Against) = (Metric::Flip, Against::Converged);

    /// The settings as given with an error of 0.05, and points with these ratios of time, their half widths, and errors.
    fn scene(points: &[(f64, f64, f64)], (metric, truth): (Metric, Against)) -> SceneReport {
        let mut scene = samples::scene("made-up", 1);
        scene.points.truncate(1 + points.len());
        scene.families.clear();
        for (index, &(ratio, width, error)) in [(1.0, 0.0, 0.05)].iter().chain(points).enumerate() {
            let point = &mut scene.points[index];
            point.name = if index == 0 { "default".into() } else { format!("p{index}") };
            point.time.ratio = Interval { median: ratio, low: ratio - width, high: ratio + width, count: 9 };
            let errors = &mut point.errors.converged;
            (errors.flip, errors.rmse, errors.rel_mse) = (error, error, error);
        }
        let times: Vec<(f64, f64)> =
            scene.points.iter().map(|one| (one.time.ratio.median, one.errors.converged.flip)).collect();
        let probability = vec![1.0; times.len()];
        scene.fronts = vec![Front { metric, truth, points: afterlight_truth::measure::front(&times), probability }];
        scene
    }

    /// Returns the advice as a reader has it.
    fn advised(points: &[(f64, f64, f64)]) -> Vec<String> {
        let scene = scene(points, FLIP);
        let text = |Advice { reason, point }: Advice| {
            format!("{}: {}: {}", reason.text(), scene.points[point].name, gain(&scene, FLIP.0, FLIP.1, point))
        };
        of(&scene, &scene.fronts[0]).into_iter().map(text).collect()
    }

    #[test]
    fn half_the_time_with_the_same_error_is_what_to_change() {
        assert_eq!(advised(&[(0.5, 0.02, 0.0502)]), ["What to change: p1: half the time, the same error within 1%"]);
        assert_eq!(advised(&[(0.72, 0.02, 0.05)]), ["What to change: p1: 28% less time, the same error"]);
        assert_eq!(advised(&[(0.9, 0.02, 0.02)]), ["What to change: p1: 10% less time, 40% of the error"]);
    }

    #[test]
    fn what_is_not_told_apart_is_no_reason_to_change() {
        // Faster by less than its times scatter; faster and nearer by too little.
        assert_eq!(advised(&[(0.93, 0.1, 0.05)]), [""; 0]);
        assert_eq!(advised(&[(0.97, 0.01, 0.0499)]), [""; 0]);
        // Nearer to the truth in a time that is not told apart.
        let same_time = ["What to change: p1: the same time within noise, 20% less error"];
        assert_eq!(advised(&[(1.01, 0.02, 0.04)]), same_time);
    }

    #[test]
    fn what_is_dominated_or_was_measured_once_is_never_advised() {
        let told = advised(&[(0.5, 0.01, 0.05), (0.6, 0.01, 0.051), (2.0, 0.01, 0.06)]);
        assert_eq!(told, ["What to change: p1: half the time, the same error"]);
        let mut once = scene(&[(0.5, 0.01, 0.05)], FLIP);
        once.points[1].time.confirmed = false;
        assert_eq!(of(&once, &once.fronts[0]), []);
    }

    #[test]
    fn trades_follow_what_is_free() {
        let told =
            advised(&[(0.8, 0.01, 0.05), (0.4, 0.01, 0.08), (0.2, 0.01, 0.2), (4.1, 0.1, 0.03), (16.0, 0.1, 0.02)]);
        assert_eq!(
            told,
            [
                "What to change: p1: 20% less time, the same error",
                "If there is time to spare: p5: 16 times the time, 40% of the error",
                "If time is short: p2: 40% of the time, 60% more error",
            ]
        );
    }

    #[test]
    fn noise_of_the_truth_hides_a_difference() {
        let by_rmse = (Metric::Rmse, Against::Converged);
        let mut scene = scene(&[(0.5, 0.02, 0.0545)], by_rmse);
        let told = |scene: &SceneReport| gain(scene, by_rmse.0, by_rmse.1, 1);
        scene.truth.noise_rmse = 0.005;
        assert_eq!(told(&scene), "half the time, the same error within noise");
        scene.truth.noise_rmse = 0.004;
        assert_eq!(told(&scene), "half the time, 9% more error");
    }

    #[test]
    fn nothing_is_advised_against_an_error_that_is_no_number() {
        let mut scene = scene(&[(0.5, 0.02, 0.05)], FLIP);
        scene.points[0].errors.converged.not_finite = 1;
        assert_eq!(of(&scene, &scene.fronts[0]), []);
    }

    #[test]
    fn shares_are_words_where_there_is_one() {
        let told = [0.05, 0.25, 0.33, 0.42, 0.5, 0.55, 0.999, 1.2, 2.0, 64.2].map(|ratio| share(ratio, "time"));
        let expected = [
            "5% of the time",
            "a quarter of the time",
            "a third of the time",
            "42% of the time",
            "half the time",
            "45% less time",
            "1% less time",
            "20% more time",
            "2.0 times the time",
            "64 times the time",
        ];
        assert_eq!(told, expected.map(str::to_owned));
    }
}
