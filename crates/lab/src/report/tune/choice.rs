//! The choice of the point that serves a bound, and of the next to try where the bound does not hold elsewhere. Pure: measurements
//! come from a [`Witness`] and from a search that is asked for more.

use crate::report::sweep::SweepError;
use crate::report::sweep::model::{Against, Interval, Metric, Point, SceneReport, Timing, TruthInfo};

/// An error below this multiple of the truth's noise cannot be told well.
const NEAR_NOISE: f64 = 2.0;
/// With a bound on loss, settings that save a smaller share of the time than this are not worth a change.
pub(super) const LEAST_SAVING: f64 = 0.01;
/// A point that misses the bound by no more than this factor is worth measuring from all cameras, to name a bound that would fit.
const NEAR_MISS: f64 = 2.0;

/// The goal of a search.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Goal {
    /// The bound that must hold.
    pub bound: GoalBound,
    /// The metric of error, against the converged truth.
    pub metric: Metric,
}

/// A bound on error or time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum GoalBound {
    /// The fastest settings whose error is at most this.
    Error(f64),
    /// The fastest settings whose error exceeds the error of the settings as given by at most this share: 0.02 for 2%.
    Loss(f64),
    /// The settings with the least error whose pictures take at most this many milliseconds.
    Milliseconds(f64),
}

/// The figures of settings from one camera.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Measurement {
    /// The error by the goal's metric, against the converged truth.
    pub error: f64,
    /// The time of one picture, in milliseconds.
    pub time: Interval,
}

/// Measures from cameras that the front was not made with.
pub trait Witness {
    /// Returns the number of cameras; `measure` takes them from 0 on.
    fn cameras(&self) -> usize;

    /// Returns true if the time is over: with a bound on loss, only the settings as given are then still tried.
    fn is_late(&self) -> bool {
        false
    }

    /// A point of the scene from one of these cameras, and the settings as given beside it.
    ///
    /// # Errors
    /// When the device cannot draw it from there.
    fn measure(&mut self, camera: usize, scene: &SceneReport, point: usize) -> Result<PairedMeasurement, SweepError>;
}

/// Measures points of a scene until nothing that is left could change the choice. With a margin, only points whose error (if time is bounded, whose
/// time) is below it are of use.
pub type Searcher<'a> = &'a mut dyn FnMut(Option<f64>) -> Result<SceneReport, SweepError>;

/// Interleaved measurements of a candidate and of the settings as given.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PairedMeasurement {
    /// The candidate's figures.
    pub own: Measurement,
    /// The figures of the settings as given.
    pub default: Measurement,
}

/// A candidate and its outcome.
#[derive(Debug, Clone, PartialEq)]
pub struct Attempt {
    /// Index in [`SceneReport::points`].
    pub point: usize,
    /// The measurements by camera, up to the first camera on which the bound does not hold.
    pub held_out: Vec<PairedMeasurement>,
}

/// The result of a search.
#[derive(Debug, Clone, PartialEq)]
pub struct SearchResult {
    /// The attempt whose bound holds from every camera.
    pub chosen: Option<Attempt>,
    /// Tried before it, in this order; the bound failed on the last of each one's cameras.
    pub passed_over: Vec<Attempt>,
    /// If nothing was chosen: a point that came near the bound, if one did, measured from every camera.
    pub near_miss: Option<Attempt>,
}

impl Goal {
    /// Returns the figures of a point that count for the goal.
    pub fn of(&self, point: &Point) -> Measurement {
        let error = point.errors.against(Against::Converged).comparable(self.metric);
        Measurement { error, time: *self.clock(&point.time).1 }
    }

    /// Returns the time that the bound is about, and the name of its clock. If time is bounded, it is the slower of both clocks: the device's own
    /// misses a picture's other work, such as reading several samples back and taking their mean.
    pub fn clock<'a>(&self, timing: &'a Timing) -> (&'static str, &'a Interval) {
        match (self.bound, &timing.gpu) {
            (GoalBound::Milliseconds(_), Some(gpu)) if timing.wall.high > gpu.high => ("wall", &timing.wall),
            (_, Some(gpu)) => ("device", gpu),
            (_, None) => ("wall", &timing.wall),
        }
    }

    /// The truth's own noise, where errors at the bound are hardly told from it.
    pub fn near_noise(&self, truth: &TruthInfo) -> Option<f64> {
        let GoalBound::Error(most) = self.bound else { return None };
        truth.noise(self.metric).filter(|noise| most < NEAR_NOISE * noise)
    }

    /// Returns true if the bound holds, for a time with its whole 95% interval. With a bound on loss, it does not hold for settings that are slower
    /// than the settings as given either, unless the two intervals overlap.
    pub fn holds(&self, pair: &PairedMeasurement) -> bool {
        self.bounded(pair) <= self.limit() && !self.is_slower(pair)
    }

    fn is_slower(&self, PairedMeasurement { own, default }: &PairedMeasurement) -> bool {
        matches!(self.bound, GoalBound::Loss(_)) && own.time.low > default.time.high
    }

    /// Returns the figure that the bound is about.
    pub fn bounded(&self, pair: &PairedMeasurement) -> f64 {
        let PairedMeasurement { own, default } = pair;
        match self.bound {
            GoalBound::Error(_) => own.error,
            // Two errors of 0 are equal as well.
            GoalBound::Loss(_) if own.error == default.error => 0.0,
            GoalBound::Loss(_) => own.error / default.error - 1.0,
            GoalBound::Milliseconds(_) => own.time.high,
        }
    }

    fn limit(&self) -> f64 {
        match self.bound {
            GoalBound::Error(most) | GoalBound::Loss(most) | GoalBound::Milliseconds(most) => most,
        }
    }

    /// A point and the settings as given, from the scene's own camera.
    pub fn pair(&self, scene: &SceneReport, point: usize) -> PairedMeasurement {
        PairedMeasurement { own: self.of(&scene.points[point]), default: self.of(&scene.points[scene.default]) }
    }

    /// Points on which the bound holds and that were measured twice, the best first: the fastest if error is bounded, otherwise the points with the
    /// least error. `margin` is an error (or a time) that failed elsewhere: only points below it are of use. The settings as given lose nothing
    /// against themselves: with a bound on loss they come last.
    pub fn candidates(&self, scene: &SceneReport, margin: Option<f64>) -> Vec<usize> {
        let of = |index: usize| self.of(&scene.points[index]);
        let is_bounded_in_time = matches!(self.bound, GoalBound::Milliseconds(_));
        let is_below = |index: usize| {
            let Measurement { error, time } = of(index);
            margin.is_none_or(|margin| if is_bounded_in_time { time.median < margin } else { error < margin })
        };
        let mut points: Vec<usize> = (0..scene.points.len()).filter(|&index| is_below(index)).collect();
        points.retain(|&index| scene.points[index].time.confirmed && !is_textbook(&scene.points[index]));
        if matches!(self.bound, GoalBound::Loss(_)) {
            let most = (1.0 - LEAST_SAVING) * of(scene.default).time.median;
            points.retain(|&index| index != scene.default && of(index).time.median <= most);
        }
        let rank = |index: usize| {
            let Measurement { error, time } = of(index);
            if is_bounded_in_time { (error, time.median) } else { (time.median, error) }
        };
        points.sort_by(|&a, &b| {
            let ((first, second), (other, last)) = (rank(a), rank(b));
            first.total_cmp(&other).then(second.total_cmp(&last))
        });
        if matches!(self.bound, GoalBound::Loss(_)) && scene.points[scene.default].time.confirmed {
            points.push(scene.default);
        }
        points.retain(|&index| of(index).error.is_finite() && self.holds(&self.pair(scene, index)));
        points
    }

    /// The margin that others need once this point has failed elsewhere.
    fn margin(&self, scene: &SceneReport, point: usize) -> f64 {
        let Measurement { error, time } = self.of(&scene.points[point]);
        if matches!(self.bound, GoalBound::Milliseconds(_)) { time.median } else { error }
    }

    /// Returns the point of the front that comes nearest to the bound.
    pub fn nearest(&self, scene: &SceneReport) -> Option<usize> {
        let bounded = |index: &usize| self.bounded(&self.pair(scene, *index));
        self.front(scene).into_iter().min_by(|a, b| bounded(a).total_cmp(&bounded(b)))
    }

    /// Returns true if any point keeps the bound from the scene's own camera, or misses it by little: then other cameras have something to tell.
    pub fn is_near(&self, scene: &SceneReport) -> bool {
        let near = |index| self.bounded(&self.pair(scene, index)) <= NEAR_MISS * self.limit();
        !self.candidates(scene, None).is_empty() || self.nearest(scene).is_some_and(near)
    }

    /// The bound that an attempt would keep from all cameras that it was measured from, in two digits. A time has 5% more, as times scatter.
    pub fn fitting(&self, scene: &SceneReport, attempt: &Attempt) -> GoalBound {
        let worst = self.worst(scene, attempt);
        match self.bound {
            GoalBound::Error(_) => GoalBound::Error(round_up(worst)),
            GoalBound::Loss(_) => GoalBound::Loss(round_up(worst)),
            GoalBound::Milliseconds(_) => GoalBound::Milliseconds(round_up(1.05 * worst)),
        }
    }

    /// Returns the figure that the bound is about, from the camera on which it is worst.
    pub fn worst(&self, scene: &SceneReport, attempt: &Attempt) -> f64 {
        let own = self.bounded(&self.pair(scene, attempt.point));
        attempt.held_out.iter().map(|pair| self.bounded(pair)).fold(own, f64::max)
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

    /// Tries the best candidate of a search until the bound holds on all of a witness's cameras: after each that fails the search goes on with
    /// its margin. `witness` is asked for once something keeps the bound so far, or nearly does.
    ///
    /// # Errors
    /// Those of the search and of the witness.
    pub fn choose<W: Witness, E: From<SweepError>>(
        &self,
        search: Searcher,
        witness: impl FnOnce(&SceneReport) -> Result<W, E>,
    ) -> Result<(SceneReport, SearchResult), E> {
        let mut scene = search(None)?;
        let nothing = SearchResult { chosen: None, passed_over: Vec::new(), near_miss: None };
        if !self.is_near(&scene) {
            return Ok((scene, nothing));
        }
        let mut witness = witness(&scene)?;
        let (mut passed_over, mut margin) = (Vec::<Attempt>::new(), None);
        // Settings as given that lose nothing have no margin to ask for: they are tried once.
        let was_tried = |passed_over: &[Attempt], point: usize| passed_over.iter().any(|other| other.point == point);
        loop {
            let is_late = matches!(self.bound, GoalBound::Loss(_)) && witness.is_late();
            let mut open = self.candidates(&scene, margin);
            open.retain(|&one| {
                !was_tried(&passed_over, one) && (!is_late || passed_over.is_empty() || one == scene.default)
            });
            let Some(&point) = open.first() else { break };
            let mut attempt = Attempt { point, held_out: Vec::new() };
            self.go_on(&mut attempt, (&scene, &mut witness), |pair| self.holds(pair))?;
            if attempt.held_out.iter().all(|pair| self.holds(pair)) {
                return Ok((scene, SearchResult { chosen: Some(attempt), passed_over, near_miss: None }));
            }
            let own = self.margin(&scene, point);
            margin = Some(margin.map_or(own, |margin: f64| margin.min(own)));
            passed_over.push(attempt);
            if matches!(self.bound, GoalBound::Loss(_)) && witness.is_late() {
                continue;
            }
            let before = std::mem::replace(&mut scene, search(margin)?);
            passed_over.retain_mut(|attempt| attempt.goes_over(&before, &scene));
        }
        let near_miss = self.near_miss(&scene, &passed_over, &mut witness)?;
        Ok((scene, SearchResult { chosen: None, passed_over, near_miss }))
    }

    fn near_miss(
        &self,
        scene: &SceneReport,
        passed_over: &[Attempt],
        witness: &mut impl Witness,
    ) -> Result<Option<Attempt>, SweepError> {
        let best = passed_over.iter().min_by(|a, b| self.worst(scene, a).total_cmp(&self.worst(scene, b))).cloned();
        let nearest = || self.nearest(scene).map(|point| Attempt { point, held_out: Vec::new() });
        let near = best.or_else(nearest).filter(|attempt| self.worst(scene, attempt) <= NEAR_MISS * self.limit());
        let Some(mut attempt) = near else { return Ok(None) };
        self.go_on(&mut attempt, (scene, witness), |_| true)?;
        Ok(Some(attempt))
    }

    /// Measures an attempt from the cameras that it was not measured from, until one does not `suit`.
    fn go_on(
        &self,
        attempt: &mut Attempt,
        (scene, witness): (&SceneReport, &mut impl Witness),
        suits: impl Fn(&PairedMeasurement) -> bool,
    ) -> Result<(), SweepError> {
        for camera in attempt.held_out.len()..witness.cameras() {
            let pair = witness.measure(camera, scene, attempt.point)?;
            attempt.held_out.push(pair);
            if !suits(&pair) {
                break;
            }
        }
        Ok(())
    }
}

impl Attempt {
    /// Returns true if a later state of the scene's points has this one still, which is then meant there.
    fn goes_over(&mut self, before: &SceneReport, now: &SceneReport) -> bool {
        let name = &before.points[self.point].name;
        let place = now.points.iter().position(|point| point.name == *name);
        self.point = place.unwrap_or(self.point);
        place.is_some()
    }
}

/// Textbooks' formulas are never chosen.
fn is_textbook(point: &Point) -> bool {
    point.name.split(' ').any(|setting| setting == "textbook=on")
}

/// The least number of two significant digits that is no less.
fn round_up(number: f64) -> f64 {
    if !(number.is_finite() && number > 0.0) {
        return number;
    }
    let digits = 1 - number.log10().floor() as i32;
    // Through text, for 0.059 and not 0.059000000000000004. A hair less than the number, so that one of two digits stays the same.
    let scaled = (number * 10f64.powi(digits) * (1.0 - 1e-12)).ceil();
    format!("{scaled}e{}", -digits).parse().unwrap_or(number)
}

#[cfg(test)]
mod tests;
