//! The order of measurements: pictures first, then times in batches, then once more the times of points that were found to be on a front.
//!
//! Each finished measurement goes into the journal, and is not made again.

#[cfg(test)]
pub(in crate::report) mod samples;
#[cfg(test)]
mod tests;

use super::assemble;
use super::error::SweepError;
use super::families::{Sweep, name_of};
use super::journal::{Batch, Journal, JournalRecord};
use super::meter::Meter;
use afterlight::scene::SettingsPatch;

/// Renderers that are held at once, besides the anchor.
const BATCH: usize = 7;
/// The most memory that renderers held at once may take on the device together.
pub const BATCH_BYTES: u64 = 768 << 20;

/// The progress of a scene.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SceneProgress<'a> {
    /// As "pictures" or "times".
    pub what: &'a str,
    /// The points that it is about, by their names.
    pub now: &'a str,
    pub done: usize,
    pub total: usize,
}

/// Called with each step before it is done.
pub type StepObserver<'a> = &'a mut dyn FnMut(SceneProgress);

/// One scene's run.
pub struct Run<'a> {
    /// The index of the scene in the journal.
    pub scene: usize,
    pub sweep: &'a Sweep,
    /// Indices of the points that are measured, the first among them.
    pub own: &'a [usize],
    pub seed: u64,
    pub journal: &'a mut Journal,
    pub watch: StepObserver<'a>,
}

impl Run<'_> {
    /// Measures all that the journal does not have yet. The scene's own record must be there.
    ///
    /// # Errors
    /// A fault of the device or the disk. Everything that was finished until then is in the journal.
    pub fn measure(&mut self, meter: &mut dyn Meter) -> Result<(), SweepError> {
        self.draw(meter)?;
        let timed = self.journal.scenes[self.scene].timed();
        let untimed = |index: &usize| *index != 0 && !timed.contains(self.name(*index).as_str());
        let points: Vec<usize> = self.drawn().into_iter().filter(untimed).collect();
        let is_first = self.journal.scenes[self.scene].batches.is_empty();
        self.time(meter, points, false, is_first)?;
        // If points of a front turn out slower than was thought, others take their places, and are measured again in turn. Each point is measured
        // again once, or has failed, so the loop ends.
        loop {
            let found = assemble::on_fronts(&self.journal.scenes[self.scene]);
            let measured = &self.journal.scenes[self.scene];
            let is_confirmed = |name: &str| measured.times_of(name).is_some_and(|(batch, _)| batch.confirms);
            let is_open = |index: &usize| {
                let name = self.name(*index);
                *index != 0 && found.contains(&name) && !is_confirmed(&name)
            };
            let open: Vec<usize> = self.drawn().into_iter().filter(is_open).collect();
            let is_first = !measured.batches.iter().any(|batch| batch.confirms);
            if open.is_empty() && !is_first {
                return Ok(());
            }
            self.time(meter, open, true, is_first)?;
        }
    }

    fn name(&self, index: usize) -> String {
        name_of(&self.sweep.points[index])
    }

    /// Own points that have been drawn.
    fn drawn(&self) -> Vec<usize> {
        let measured = &self.journal.scenes[self.scene];
        let is_drawn = |index: &usize| {
            let name = self.name(*index);
            measured.drawn.contains_key(&name) && !measured.failed.contains_key(&name)
        };
        self.own.iter().copied().filter(is_drawn).collect()
    }

    fn draw(&mut self, meter: &mut dyn Meter) -> Result<(), SweepError> {
        for (done, &index) in self.own.iter().enumerate() {
            let (scene, point) = (self.scene, self.name(index));
            let measured = &self.journal.scenes[scene];
            if measured.drawn.contains_key(&point) || measured.failed.contains_key(&point) {
                continue;
            }
            (self.watch)(SceneProgress { what: "pictures", now: &point, done, total: self.own.len() });
            let record = match meter.draw(&self.sweep.points[index]) {
                Ok(drawn) => JournalRecord::Drawn { scene, point, drawn },
                Err(error) if index != 0 && error.is_of_point() => {
                    JournalRecord::Failed { scene, point, reason: error.to_string() }
                }
                Err(error) => return Err(error),
            };
            self.journal.add(scene, record)?;
        }
        Ok(())
    }

    /// Times points in batches, in random order. `alone`: the anchor is timed even if there is nothing to compare with it.
    fn time(
        &mut self,
        meter: &mut dyn Meter,
        mut points: Vec<usize>,
        confirms: bool,
        alone: bool,
    ) -> Result<(), SweepError> {
        let what = if confirms { "times of the fronts, again" } else { "times" };
        let before = self.journal.scenes[self.scene].batches.len() as u64;
        let mut random = fastrand::Rng::with_seed(self.seed ^ (before << 32 | u64::from(confirms)));
        random.shuffle(&mut points);
        let total = points.len();
        let mut done = 0;
        let mut batches = self.batches(meter, &points);
        if batches.is_empty() && alone {
            batches.push(Vec::new());
        }
        for batch in batches {
            let names: Vec<String> = batch.iter().map(|&index| self.name(index)).collect();
            (self.watch)(SceneProgress { what, now: &names.join(", "), done, total });
            done += batch.len();
            match self.time_batch(meter, &batch, confirms, &mut random) {
                // Together they are too much; one that is too much alone as well is left out.
                Err(error) if error.is_of_point() => {
                    for index in batch {
                        self.time_alone(meter, index, confirms, &mut random)?;
                    }
                }
                other => other?,
            }
        }
        Ok(())
    }

    fn batches(&self, meter: &dyn Meter, points: &[usize]) -> Vec<Vec<usize>> {
        let mut batches: Vec<Vec<usize>> = Vec::new();
        let anchor = meter.bytes(&self.sweep.points[0]);
        let mut bytes = anchor;
        for &index in points {
            let own = meter.bytes(&self.sweep.points[index]);
            match batches.last_mut() {
                Some(last) if last.len() < BATCH && bytes + own <= BATCH_BYTES => {
                    last.push(index);
                    bytes += own;
                }
                _ => {
                    batches.push(vec![index]);
                    bytes = anchor + own;
                }
            }
        }
        batches
    }

    fn time_batch(
        &mut self,
        meter: &mut dyn Meter,
        points: &[usize],
        confirms: bool,
        random: &mut fastrand::Rng,
    ) -> Result<(), SweepError> {
        let patches: Vec<SettingsPatch> = points.iter().map(|&index| self.sweep.points[index].clone()).collect();
        let rounds = meter.time(&patches, random)?;
        let points = points.iter().map(|&index| self.name(index)).collect();
        let batch = Batch { points, confirms, rounds };
        self.journal.add(self.scene, JournalRecord::Batch { scene: self.scene, batch })
    }

    fn time_alone(
        &mut self,
        meter: &mut dyn Meter,
        index: usize,
        confirms: bool,
        random: &mut fastrand::Rng,
    ) -> Result<(), SweepError> {
        match self.time_batch(meter, &[index], confirms, random) {
            Err(error) if error.is_of_point() => {
                let (scene, point) = (self.scene, self.name(index));
                self.journal.add(scene, JournalRecord::Failed { scene, point, reason: error.to_string() })
            }
            other => other,
        }
    }
}
