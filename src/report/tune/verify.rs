//! Error and time from other cameras, on the device at hand.

use super::choice::{Goal, Measurement, Pair, Witness};
use crate::report::sweep::Error;
use crate::report::sweep::meter::{DeviceMeter, Meter};
use crate::report::sweep::timing::Anchor;
use crate::scene::SettingsPatch;

/// A device that draws the scene from cameras elsewhere.
pub struct OnDevice<'a> {
    goal: Goal,
    /// By point of the scene's report.
    patches: Vec<SettingsPatch>,
    cameras: Vec<Elsewhere<'a>>,
    random: fastrand::Rng,
}

struct Elsewhere<'a> {
    meter: DeviceMeter<'a>,
    /// Of the settings as given, once it is known.
    default_error: Option<f64>,
}

impl<'a> OnDevice<'a> {
    /// One meter for each camera, with its own truth. `patches` are those of the report's points, in its order.
    pub fn new(meters: Vec<DeviceMeter<'a>>, patches: Vec<SettingsPatch>, goal: Goal, seed: u64) -> Self {
        let cameras = meters.into_iter().map(|meter| Elsewhere { meter, default_error: None });
        Self { goal, patches, cameras: cameras.collect(), random: fastrand::Rng::with_seed(seed) }
    }
}

impl Witness for OnDevice<'_> {
    fn cameras(&self) -> usize {
        self.cameras.len()
    }

    fn measure(&mut self, camera: usize, point: usize) -> Result<Pair, Error> {
        let Self { goal, patches, cameras, random } = self;
        let Elsewhere { meter, default_error } = &mut cameras[camera];
        let mut error = |patch| Ok::<f64, Error>(meter.draw(patch)?.errors.converged.comparable(goal.metric));
        let own_error = error(&patches[point])?;
        let default = match *default_error {
            Some(known) => known,
            None => error(&SettingsPatch::default())?,
        };
        *default_error = Some(default);
        let rounds = meter.time(std::slice::from_ref(&patches[point]), random)?;
        let times = rounds.others.first().zip(Anchor::of(&[&rounds.anchor]));
        let times =
            times.and_then(|(own, anchor)| Some((anchor.scaled(own, &rounds.anchor, true)?, anchor.times(true)?)));
        let Some((own, anchor)) = times else {
            return Err(Error::Refused("no time could be measured from another camera".into()));
        };
        Ok(Pair {
            own: Measurement { error: own_error, time: *goal.clock(&own.timing).1 },
            default: Measurement { error: default, time: *goal.clock(&anchor.timing).1 },
        })
    }
}
