//! Which point of a front serves a bound, and what to try next when it does not hold elsewhere. Pure: what is measured comes from a
//! [`Witness`].

use crate::report::sweep::Error;
use crate::report::sweep::model::{Against, Interval, Metric, Point, SceneReport, Timing, TruthInfo};

/// An error below this multiple of the truth's noise cannot be told well.
const NEAR_NOISE: f64 = 2.0;

/// What is asked for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Goal {
    /// What must hold.
    pub bound: Bound,
    /// How error is measured, against the converged truth.
    pub metric: Metric,
}

/// A bound on error or time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Bound {
    /// The fastest settings whose error is at most this.
    Error(f64),
    /// The settings with the least error whose pictures take at most so many milliseconds.
    Milliseconds(f64),
}

/// What was found of settings from one camera.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Measurement {
    /// By the goal's metric, against the converged truth.
    pub error: f64,
    /// Of one picture, in milliseconds.
    pub time: Interval,
}

/// Measures from cameras that the front was not made with.
pub trait Witness {
    /// How many cameras there are; `measure` takes them from 0 on.
    fn cameras(&self) -> usize;

    /// A point of the scene from one of these cameras, and the settings as given beside it.
    ///
    /// # Errors
    /// When the device cannot draw it from there.
    fn measure(&mut self, camera: usize, point: usize) -> Result<Pair, Error>;
}

/// Settings, and those as given, that took turns.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pair {
    /// Of the candidate.
    pub own: Measurement,
    /// Of the settings as given.
    pub default: Measurement,
}

/// A candidate and what became of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Attempt {
    /// Index in [`SceneReport::points`].
    pub point: usize,
    /// By camera, up to the first on which the bound does not hold.
    pub held_out: Vec<Pair>,
}

/// What a search came to.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// On which the bound holds from every camera.
    pub chosen: Option<Attempt>,
    /// Tried before it, in this order; the bound failed on the last of each one's cameras.
    pub passed_over: Vec<Attempt>,
}

impl Goal {
    /// What counts of a point's figures.
    pub fn of(&self, point: &Point) -> Measurement {
        let error = point.errors.against(Against::Converged).comparable(self.metric);
        Measurement { error, time: *self.clock(&point.time).1 }
    }

    /// The time that the bound is about, and whose it is. Where time is bounded, the slower of both clocks: the device's own knows nothing of
    /// what a picture takes besides, as the way back of several samples and their mean.
    pub fn clock<'a>(&self, timing: &'a Timing) -> (&'static str, &'a Interval) {
        match (self.bound, &timing.gpu) {
            (Bound::Milliseconds(_), Some(gpu)) if timing.wall.high > gpu.high => ("wall", &timing.wall),
            (_, Some(gpu)) => ("device", gpu),
            (_, None) => ("wall", &timing.wall),
        }
    }

    /// The truth's own noise, where errors at the bound are hardly told from it.
    pub fn near_noise(&self, truth: &TruthInfo) -> Option<f64> {
        let Bound::Error(most) = self.bound else { return None };
        truth.noise(self.metric).filter(|noise| most < NEAR_NOISE * noise)
    }

    /// A time holds where its whole 95% interval does.
    pub fn holds(&self, measured: &Measurement) -> bool {
        self.bounded(measured) <= self.limit()
    }

    /// What the bound is about.
    pub fn bounded(&self, measured: &Measurement) -> f64 {
        match self.bound {
            Bound::Error(_) => measured.error,
            Bound::Milliseconds(_) => measured.time.high,
        }
    }

    fn limit(&self) -> f64 {
        match self.bound {
            Bound::Error(most) | Bound::Milliseconds(most) => most,
        }
    }

    /// Points of the front on which the bound holds, as was measured twice, the best first. Each further one has more of a margin: it is slower and nearer to the
    /// truth where error is bounded, faster and further from it where time is.
    pub fn candidates(&self, scene: &SceneReport) -> Vec<usize> {
        let mut points = self.front(scene);
        if matches!(self.bound, Bound::Milliseconds(_)) {
            points.reverse();
        }
        points.retain(|&index| scene.points[index].time.confirmed && self.holds(&self.of(&scene.points[index])));
        points
    }

    /// What comes nearest to the bound, of the front.
    pub fn nearest(&self, scene: &SceneReport) -> Option<usize> {
        let bounded = |index: &usize| self.bounded(&self.of(&scene.points[*index]));
        self.front(scene).into_iter().min_by(|a, b| bounded(a).total_cmp(&bounded(b)))
    }

    /// The fastest first.
    fn front(&self, scene: &SceneReport) -> Vec<usize> {
        let of_metric = |front: &&crate::report::sweep::model::Front| {
            front.metric == self.metric && front.truth == Against::Converged
        };
        let front = scene.fronts.iter().find(of_metric);
        let points = front.map_or_else(Vec::new, |front| front.points.clone());
        points.into_iter().filter(|&index| index < scene.points.len()).collect()
    }

    /// Tries the candidates in turn until the bound holds on all of a witness's cameras.
    ///
    /// # Errors
    /// As [`Witness::measure`].
    pub fn choose(&self, scene: &SceneReport, witness: &mut dyn Witness) -> Result<Outcome, Error> {
        let mut passed_over = Vec::new();
        for point in self.candidates(scene) {
            let attempt = self.attempt(point, witness)?;
            if attempt.held_out.iter().all(|pair| self.holds(&pair.own)) {
                return Ok(Outcome { chosen: Some(attempt), passed_over });
            }
            passed_over.push(attempt);
        }
        Ok(Outcome { chosen: None, passed_over })
    }

    fn attempt(&self, point: usize, witness: &mut dyn Witness) -> Result<Attempt, Error> {
        let mut held_out = Vec::new();
        for camera in 0..witness.cameras() {
            let pair = witness.measure(camera, point)?;
            held_out.push(pair);
            if !self.holds(&pair.own) {
                break;
            }
        }
        Ok(Attempt { point, held_out })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::page::samples;

    fn scene() -> SceneReport {
        samples::scene("hall", 5)
    }

    fn error_below(most: f64) -> Goal {
        Goal { bound: Bound::Error(most), metric: Metric::Flip }
    }

    fn time_below(ms: f64) -> Goal {
        Goal { bound: Bound::Milliseconds(ms), metric: Metric::Flip }
    }

    /// Measures what the tuning camera did, times these factors by camera.
    struct Factors<'a> {
        scene: &'a SceneReport,
        goal: Goal,
        error: Vec<f64>,
        time: Vec<f64>,
        asked: Vec<(usize, usize)>,
    }

    impl Witness for Factors<'_> {
        fn cameras(&self) -> usize {
            self.error.len()
        }

        fn measure(&mut self, camera: usize, point: usize) -> Result<Pair, Error> {
            self.asked.push((camera, point));
            let of = |point: usize| {
                let Measurement { error, time } = self.goal.of(&self.scene.points[point]);
                let scaled = |ms: f64| ms * self.time[camera];
                let time =
                    Interval { median: scaled(time.median), low: scaled(time.low), high: scaled(time.high), ..time };
                Measurement { error: error * self.error[camera], time }
            };
            Ok(Pair { own: of(point), default: of(self.scene.default) })
        }
    }

    fn factors<'a>(scene: &'a SceneReport, goal: Goal, error: &[f64], time: &[f64]) -> Factors<'a> {
        Factors { scene, goal, error: error.to_vec(), time: time.to_vec(), asked: Vec::new() }
    }

    #[test]
    fn the_fastest_that_keeps_the_error_is_chosen() {
        let scene = scene();
        let goal = error_below(0.05);
        let outcome = goal.choose(&scene, &mut factors(&scene, goal, &[1.0; 3], &[1.0; 3])).expect("measured");
        let chosen = goal.of(&scene.points[outcome.chosen.expect("a choice").point]);
        assert!(chosen.error <= 0.05);
        for point in &scene.points {
            let other = goal.of(point);
            assert!(other.error > 0.05 || other.time.median >= chosen.time.median, "{} is faster", point.name);
        }
        assert_eq!(outcome.passed_over, []);
    }

    #[test]
    fn the_best_that_keeps_the_time_is_chosen() {
        let scene = scene();
        let goal = time_below(14.0);
        let outcome = goal.choose(&scene, &mut factors(&scene, goal, &[1.0; 3], &[1.0; 3])).expect("measured");
        let chosen = goal.of(&scene.points[outcome.chosen.expect("a choice").point]);
        assert!(chosen.time.high <= 14.0);
        let front = &scene.fronts[2].points;
        for other in front.iter().map(|&index| goal.of(&scene.points[index])) {
            assert!(other.time.high > 14.0 || other.error >= chosen.error);
        }
    }

    #[test]
    fn a_bound_that_fails_elsewhere_makes_it_go_on_with_more_margin() {
        let scene = scene();
        let goal = error_below(0.05);
        let first = goal.candidates(&scene)[0];
        // From the second camera all err half as much again.
        let mut witness = factors(&scene, goal, &[1.0, 1.5, 1.0], &[1.0; 3]);
        let outcome = goal.choose(&scene, &mut witness).expect("measured");
        let chosen = outcome.chosen.expect("a choice");
        assert!(goal.of(&scene.points[chosen.point]).error * 1.5 <= 0.05);
        assert_eq!(chosen.held_out.len(), 3);
        assert_eq!((outcome.passed_over[0].point, outcome.passed_over[0].held_out.len()), (first, 2));
        assert!(!witness.asked.contains(&(2, first)), "one failure is enough");
        let times: Vec<f64> =
            outcome.passed_over.iter().map(|own| goal.of(&scene.points[own.point]).time.median).collect();
        assert!(times.is_sorted());
    }

    #[test]
    fn a_slower_camera_makes_it_go_on_to_faster_settings() {
        let scene = scene();
        let goal = time_below(14.0);
        let outcome = goal.choose(&scene, &mut factors(&scene, goal, &[1.0], &[1.2])).expect("measured");
        let chosen = goal.of(&scene.points[outcome.chosen.expect("a choice").point]);
        assert!(chosen.time.high * 1.2 <= 14.0 && !outcome.passed_over.is_empty());
    }

    #[test]
    fn what_nothing_keeps_is_not_chosen_and_the_nearest_is_known() {
        let scene = scene();
        for (goal, is_nearest) in [(error_below(1e-9), 1), (time_below(0.01), 0)] {
            assert_eq!(goal.candidates(&scene), Vec::<usize>::new());
            let outcome = goal.choose(&scene, &mut factors(&scene, goal, &[1.0], &[1.0])).expect("measured");
            assert_eq!(outcome, Outcome { chosen: None, passed_over: Vec::new() });
            let front = &scene.fronts[2].points;
            let expected = if is_nearest == 1 { front.last() } else { front.first() };
            assert_eq!(goal.nearest(&scene).as_ref(), expected);
        }
        let goal = error_below(0.05);
        let outcome = goal.choose(&scene, &mut factors(&scene, goal, &[100.0], &[1.0])).expect("measured");
        assert_eq!(outcome.passed_over.len(), goal.candidates(&scene).len());
        assert_eq!(outcome.chosen, None);
    }

    #[test]
    fn a_bound_on_time_is_about_the_slower_clock() {
        let mut scene = scene();
        let goal = time_below(14.0);
        let before = goal.candidates(&scene);
        for point in &mut scene.points {
            let wall = point.time.wall;
            point.time.gpu = Some(Interval { median: 0.1, low: 0.1, high: 0.1, ..wall });
        }
        assert_eq!(goal.candidates(&scene), before);
        assert_eq!(goal.clock(&scene.points[0].time).0, "wall");
        assert_eq!(error_below(1.0).clock(&scene.points[0].time).0, "device");
        scene.points[0].time.gpu = Some(Interval { median: 99.0, low: 99.0, high: 99.0, count: 9 });
        assert_eq!(goal.clock(&scene.points[0].time).0, "device");
    }

    #[test]
    fn what_was_measured_once_or_has_pixels_that_are_not_finite_is_never_chosen() {
        let goal = error_below(0.05);
        for spoil in [
            |point: &mut Point| point.time.confirmed = false,
            |point: &mut Point| point.errors.converged.not_finite = 1,
        ] {
            let mut scene = scene();
            let first = goal.candidates(&scene)[0];
            spoil(&mut scene.points[first]);
            assert!(!goal.candidates(&scene).contains(&first));
        }
    }

    #[test]
    fn a_bound_near_the_noise_of_the_truth_is_known() {
        let truth = TruthInfo { samples: 8, noise_rmse: 1e-3, noise_rel_mse: 1e-5, sky: 0.0, other_triangle: None };
        let near = |bound, metric| Goal { bound, metric }.near_noise(&truth);
        assert_eq!(near(Bound::Error(1.5e-3), Metric::Rmse), Some(1e-3));
        assert_eq!(near(Bound::Error(3e-3), Metric::Rmse), None);
        assert_eq!(near(Bound::Error(1e-6), Metric::RelMse), Some(1e-5));
        assert_eq!(near(Bound::Error(1e-6), Metric::Flip), None);
        assert_eq!(near(Bound::Milliseconds(1e-6), Metric::Rmse), None);
    }

    #[test]
    fn an_error_that_is_no_number_is_never_chosen() {
        let mut scene = scene();
        for point in &mut scene.points {
            point.errors.converged.flip = f64::NAN;
        }
        assert_eq!(error_below(1.0).candidates(&scene), Vec::<usize>::new());
    }
}
