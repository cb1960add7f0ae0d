//! Error and time from other cameras, on the device at hand.
//!
//! No truth is rendered from there. The settings that err least draw a picture of many samples in its place. The error against this picture lacks
//! the error of the best settings themselves. The scene's own camera supplies that part, because both errors are known there.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use super::choice::{Goal, GoalBound, Measurement, PairedMeasurement, Witness};
use super::probe::{Bench, Probe, ProbeEffort};
use crate::report::sweep::SweepError;
use crate::report::sweep::model::{Metric, SceneReport};
use crate::report::sweep::run::{SceneProgress, StepObserver};
use crate::report::sweep::timing::Anchor;
use afterlight::scene::SettingsPatch;

/// A device that draws the scene from cameras elsewhere.
pub struct DeviceWitness<'a> {
    pub(super) goal: Goal,
    /// The settings of points, by name.
    pub(super) patches: &'a BTreeMap<String, SettingsPatch>,
    /// The scene's own camera, with pictures as the truth has them.
    pub(super) home: CameraBench<'a>,
    pub(super) cameras: Vec<CameraBench<'a>>,
    pub(super) random: fastrand::Rng,
    pub(super) watch: StepObserver<'a>,
    /// The moment at which the time is over.
    pub(super) end: Option<Instant>,
    /// The longest time that a camera took so far.
    pub(super) longest: Duration,
}

/// A camera, with the picture that stands in a truth's place.
pub struct CameraBench<'a> {
    bench: Bench<'a>,
    metric: Metric,
    /// Against that picture, by the names of points.
    errors: BTreeMap<String, f64>,
}

impl<'a> CameraBench<'a> {
    pub(super) fn of(bench: Bench<'a>, metric: Metric) -> Self {
        Self { bench, metric, errors: BTreeMap::new() }
    }

    fn error(&mut self, name: &str, patch: &SettingsPatch) -> Result<f64, SweepError> {
        if let Some(known) = self.errors.get(name) {
            return Ok(*known);
        }
        let error = self.bench.draw(patch, ProbeEffort::Glance)?.errors.converged.comparable(self.metric);
        self.errors.insert(name.to_owned(), error);
        Ok(error)
    }
}

/// The error against the truth elsewhere: `there` against the best picture, and the rest, which the truth and the best picture tell at home. Squared
/// errors add up; FLIP and relMSE are added as they are.
pub(super) fn against_truth(metric: Metric, there: f64, truth_at_home: f64, best_at_home: f64) -> f64 {
    match metric {
        Metric::Rmse => (there.powi(2) + truth_at_home.powi(2) - best_at_home.powi(2)).max(0.0).sqrt(),
        Metric::Flip | Metric::RelMse => (there + truth_at_home - best_at_home).max(0.0),
    }
}

impl DeviceWitness<'_> {
    /// The error of a point of the scene from a camera.
    fn error(&mut self, camera: usize, scene: &SceneReport, point: usize) -> Result<f64, SweepError> {
        let name = &scene.points[point].name;
        let patch = self.patches.get(name).cloned().unwrap_or_default();
        let at_home = self.goal.of(&scene.points[point]).error;
        let best_at_home = self.home.error(name, &patch)?;
        let there = self.cameras[camera].error(name, &patch)?;
        Ok(against_truth(self.goal.metric, there, at_home, best_at_home))
    }
}

impl Witness for DeviceWitness<'_> {
    fn cameras(&self) -> usize {
        self.cameras.len()
    }

    /// Too late is when a candidate can no longer be measured from every camera.
    fn is_late(&self) -> bool {
        self.end.is_some_and(|end| Instant::now() + self.longest * self.cameras.len() as u32 >= end)
    }

    fn measure(&mut self, camera: usize, scene: &SceneReport, point: usize) -> Result<PairedMeasurement, SweepError> {
        let begun = Instant::now();
        let pair = self.compare(camera, scene, point);
        self.longest = self.longest.max(begun.elapsed());
        pair
    }
}

impl DeviceWitness<'_> {
    fn compare(&mut self, camera: usize, scene: &SceneReport, point: usize) -> Result<PairedMeasurement, SweepError> {
        let name = &scene.points[point].name;
        (self.watch)(SceneProgress { what: "other cameras", now: name, done: camera, total: self.cameras.len() });
        let own_error = self.error(camera, scene, point)?;
        let default = self.error(camera, scene, scene.default)?;
        let Self { goal, patches, cameras, random, .. } = self;
        let patch = patches.get(name).cloned().unwrap_or_default();
        // The settings as given need no turns with themselves.
        let is_given = patch == SettingsPatch::default();
        let others = if is_given { &[][..] } else { std::slice::from_ref(&patch) };
        // If time is not bounded, one from another camera decides only with a bound on loss, and there only where both intervals lie apart.
        let look =
            if matches!(goal.bound, GoalBound::Milliseconds(_)) { ProbeEffort::Whole } else { ProbeEffort::Glance };
        let rounds = cameras[camera].bench.time(others, look, random)?;
        let times = Anchor::of(&[&rounds.anchor]).and_then(|anchor| {
            let given = anchor.times(true)?;
            let own = match rounds.others.first() {
                Some(own) => anchor.scaled(own, &rounds.anchor, true)?,
                None => given.clone(),
            };
            Some((own, given))
        });
        let Some((own, anchor)) = times else {
            return Err(SweepError::Refused("no time could be measured from another camera".into()));
        };
        Ok(PairedMeasurement {
            own: Measurement { error: own_error, time: *goal.clock(&own.timing).1 },
            default: Measurement { error: default, time: *goal.clock(&anchor.timing).1 },
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_error_elsewhere_is_that_against_the_best_picture_and_what_both_err() {
        for metric in [Metric::Flip, Metric::RelMse, Metric::Rmse] {
            // The best settings err as at home.
            assert!((against_truth(metric, 0.0, 0.02, 0.0) - 0.02).abs() < 1e-12);
            // A picture that differs from the best as much as at home errs as much as at home.
            assert!((against_truth(metric, 0.03, 0.05, 0.03) - 0.05).abs() < 1e-12);
            assert!(against_truth(metric, 0.04, 0.05, 0.03) > 0.05 && against_truth(metric, 0.0, 0.01, 0.03) == 0.0);
        }
        assert!((against_truth(Metric::Rmse, 0.4, 0.3, 0.0) - 0.5).abs() < 1e-12);
    }
}
