//! Error and time from other cameras, on the device at hand.

use std::collections::BTreeMap;

use super::choice::{Bound, Goal, Measurement, Pair, Witness};
use super::probe::{Bench, Look, Probe};
use crate::report::sweep::Error;
use crate::report::sweep::model::SceneReport;
use crate::report::sweep::run::{Step, Watch};
use crate::report::sweep::timing::Anchor;
use crate::scene::SettingsPatch;

/// A device that draws the scene from cameras elsewhere.
pub struct OnDevice<'a> {
    pub(super) goal: Goal,
    /// By the names of points.
    pub(super) patches: &'a BTreeMap<String, SettingsPatch>,
    pub(super) cameras: Vec<Elsewhere<'a>>,
    pub(super) random: fastrand::Rng,
    pub(super) watch: Watch<'a>,
}

/// One of them.
pub struct Elsewhere<'a> {
    pub(super) bench: Bench<'a>,
    /// Of the settings as given, once it is known.
    pub(super) default_error: Option<f64>,
}

impl Witness for OnDevice<'_> {
    fn cameras(&self) -> usize {
        self.cameras.len()
    }

    fn measure(&mut self, camera: usize, scene: &SceneReport, point: usize) -> Result<Pair, Error> {
        let Self { goal, patches, cameras, random, watch } = self;
        let name = &scene.points[point].name;
        watch(Step { what: "other cameras", now: name, done: camera, total: cameras.len() });
        let patch = patches.get(name).cloned().unwrap_or_default();
        let Elsewhere { bench, default_error } = &mut cameras[camera];
        let mut error =
            |patch| Ok::<f64, Error>(bench.draw(patch, Look::Glance)?.errors.converged.comparable(goal.metric));
        let own_error = error(&patch)?;
        let default = match *default_error {
            Some(known) => known,
            None if patch == SettingsPatch::default() => own_error,
            None => error(&SettingsPatch::default())?,
        };
        *default_error = Some(default);
        // The settings as given need no turns with themselves.
        let is_given = patch == SettingsPatch::default();
        let others = if is_given { &[][..] } else { std::slice::from_ref(&patch) };
        // If error is bounded, a time from another camera is reported and decides nothing.
        let look = if matches!(goal.bound, Bound::Milliseconds(_)) { Look::Whole } else { Look::Glance };
        let rounds = bench.time(others, look, random)?;
        let times = Anchor::of(&[&rounds.anchor]).and_then(|anchor| {
            let given = anchor.times(true)?;
            let own = match rounds.others.first() {
                Some(own) => anchor.scaled(own, &rounds.anchor, true)?,
                None => given.clone(),
            };
            Some((own, given))
        });
        let Some((own, anchor)) = times else {
            return Err(Error::Refused("no time could be measured from another camera".into()));
        };
        Ok(Pair {
            own: Measurement { error: own_error, time: *goal.clock(&own.timing).1 },
            default: Measurement { error: default, time: *goal.clock(&anchor.timing).1 },
        })
    }
}
