//! The choice of the next measurement, so that few measurements find a whole sweep's result: successive halving (Jamieson and Talwalkar 2016).
//!
//! All points get a glance of a few frames; points that may still win are drawn, and timed again with more rounds. A point is dropped as soon as its
//! error breaks the bound, or its whole time interval lies above the interval of a better point that keeps the bound. The effects of single settings
//! predict the effects of combinations. The prediction decides the order, not the choice: when time is short, the promising points come first.
//!
//! A step follows from the journal, the number of cores, and whether the truth is there and the time is over. A run that was broken off goes on from its
//! journal.

#[cfg(test)]
mod tests;

use std::cmp::Ordering;
use std::collections::BTreeMap;

use super::choice::{Goal, GoalBound, LEAST_SAVING};
use crate::report::sweep::families::JOINT;
use crate::report::sweep::journal::{SceneInfo, SceneMeasurements};
use crate::report::sweep::model::Member;
use crate::report::sweep::timing::TimingSample;
use afterlight_truth::measure::{LEAST_FOR_95, median_interval, percentile};

/// Points that are timed again together.
const FINALISTS: usize = 4;
/// The relative error of a glance, on top of the scatter of its rounds.
const GLANCE_ERROR: f64 = 0.05;
/// The least share of the time that another value of a family is hoped to save, where values are words and tell nothing about each other.
const MATTERS: f64 = 0.03;
/// The assumed time of a family without measurements, over the time of the settings as given: so each family is tried once, early.
const HOPE: f64 = 0.5;
/// Combinations whose parts err by more than this multiple of the bound come last.
const HOPELESS: f64 = 1.25;

/// The next measurement; points by their index in the sweep.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum SearchStep {
    /// A picture against the truth.
    Draw(usize),
    /// A few frames beside the settings as given.
    Glance(Vec<usize>),
    /// All rounds of points that may be the choice.
    Confirm(Vec<usize>),
}

/// A search at one moment.
#[derive(Debug, Clone, Copy)]
pub struct Search<'a> {
    /// The goal of the search.
    pub goal: &'a Goal,
    /// The points, and their families.
    pub info: &'a SceneInfo,
    /// The measurements of the points.
    pub measured: &'a SceneMeasurements,
    /// An error, or a time where time is bounded, that failed from another camera: only points below it are of use.
    pub margin: Option<f64>,
    /// True if the time is over: only measurements that a choice needs are still made.
    pub is_late: bool,
    /// False while the truth is on its way: where error is bounded, points are timed meanwhile.
    pub can_draw: bool,
    /// Points that get a glance together. If there were more, the choice of the last could not use the results of the first.
    pub glances: usize,
}

/// A time: in milliseconds if time is bounded, otherwise over the time of the settings as given.
#[derive(Debug, Clone, Copy, PartialEq)]
struct TimeEstimate {
    low: f64,
    median: f64,
    high: f64,
}

/// The measurements of a point so far.
#[derive(Debug, Clone, Copy, Default)]
struct PointState {
    time: Option<TimeEstimate>,
    is_confirmed: bool,
    error: Option<f64>,
    /// The device cannot have it, or it is not to be chosen.
    is_out: bool,
}

impl Search<'_> {
    /// The next step; none when nothing is left that could change the choice.
    pub fn next(&self) -> Option<SearchStep> {
        let known = self.states();
        let is_bounded_in_time = matches!(self.goal.bound, GoalBound::Milliseconds(_));
        if !self.can_draw && !self.is_late && !is_bounded_in_time {
            let open = self.open(&known);
            if !open.is_empty() {
                return Some(SearchStep::Glance(self.promising(&known, open)));
            }
        }
        if known[0].error.is_none() {
            return Some(SearchStep::Draw(0));
        }
        match self.goal.bound {
            GoalBound::Error(_) | GoalBound::Loss(_) => self.towards_the_fastest(&known),
            GoalBound::Milliseconds(most) => self.towards_the_best(&known, most),
        }
    }

    /// Names of the points that might have been the choice, and that nothing is known of.
    pub fn left(&self) -> Vec<&str> {
        let known = self.states();
        let open = self.open(&known);
        open.into_iter().map(|index| self.info.points[index].as_str()).collect()
    }

    /// Error is bounded: the fastest wins.
    fn towards_the_fastest(&self, known: &[PointState]) -> Option<SearchStep> {
        let keeps = |index: &usize| known[*index].error.is_some_and(|error| self.keeps(known, *index, error));
        let time = |index: usize| known[index].time;
        let points = || 0..known.len();
        let highs = points().filter(keeps).filter_map(|index| Some(self.share_to_beat(index) * time(index)?.high));
        let best = highs.fold(f64::INFINITY, f64::min);
        let may_win = |index: &usize| !known[*index].is_out && time(*index).is_some_and(|time| time.low <= best);
        let by_time = |a: &usize, b: &usize| median(time(*a)).total_cmp(&median(time(*b))).then(a.cmp(b));
        if let Some(next) = self.pictures_or_glances(known, may_win).filter(|_| !self.is_late) {
            return Some(next);
        }
        let sure: Vec<usize> = points().filter(|index| known[*index].is_confirmed && keeps(index)).collect();
        // A point whose glance was slower than a confirmed time might still win, but by less than a glance errs.
        let to_beat = sure.iter().map(|&index| self.time_to_beat(known, index)).fold(f64::INFINITY, f64::min);
        let is_enough = self.is_late && sure.iter().any(|&index| index != 0 && self.is_of_use(known, index));
        let mut finalists: Vec<usize> = points().filter(|&index| index != 0 && !known[index].is_confirmed).collect();
        finalists.retain(|index| !is_enough && keeps(index) && may_win(index) && median(time(*index)) < to_beat);
        finalists.sort_by(by_time);
        self.confirm(finalists)
    }

    /// Pictures of points that may win, then glances, and at last pictures of combinations that are expected to break the bound.
    fn pictures_or_glances(&self, known: &[PointState], may_win: impl Fn(&usize) -> bool) -> Option<SearchStep> {
        let model = EffectModel::of(self.info, known);
        let is_hopeless = |index: &usize| model.error(*index) > HOPELESS * self.most(known);
        let undrawn = (0..known.len()).filter(|&index| known[index].error.is_none() && may_win(&index));
        let (hopeless, hopeful): (Vec<usize>, Vec<usize>) = undrawn.partition(is_hopeless);
        let picture = |points: Vec<usize>| next_picture(&model, known, points).map(SearchStep::Draw);
        let glance = || {
            let open = self.open(known);
            (!open.is_empty()).then(|| SearchStep::Glance(self.promising(known, open)))
        };
        picture(hopeful).or_else(glance).or_else(|| picture(hopeless))
    }

    /// Time is bounded: the least error wins.
    fn towards_the_best(&self, known: &[PointState], most: f64) -> Option<SearchStep> {
        let is_below = |time: TimeEstimate| self.margin.is_none_or(|margin| time.median < margin);
        let time = |index: usize| known[index].time.filter(|&time| !known[index].is_out && is_below(time));
        let points = || 0..known.len();
        let may_keep = |index: &usize| time(*index).is_some_and(|time| time.low <= most);
        let undrawn = points().filter(|index| known[*index].error.is_none()).filter(may_keep);
        // A slower point mostly has less error.
        let by_time = |a: &usize, b: &usize| median(time(*a)).total_cmp(&median(time(*b))).then(b.cmp(a));
        if let Some(next) = undrawn.max_by(by_time).filter(|_| !self.is_late) {
            return Some(SearchStep::Draw(next));
        }
        let open = self.open(known);
        if !open.is_empty() && !self.is_late {
            return Some(SearchStep::Glance(self.promising(known, open)));
        }
        let error = |index: usize| known[index].error.unwrap_or(f64::INFINITY);
        let is_sure = |index: &usize| known[*index].is_confirmed && time(*index).is_some_and(|time| time.high <= most);
        let best = points().filter(is_sure).map(error).fold(f64::INFINITY, f64::min);
        let may_win = |index: &usize| may_keep(index) && !known[*index].is_confirmed && error(*index) < best;
        let mut finalists: Vec<usize> = points().filter(|&index| index != 0).filter(may_win).collect();
        finalists.sort_by(|&a, &b| error(a).total_cmp(&error(b)).then(a.cmp(&b)));
        if finalists.is_empty() && !points().any(|index| may_keep(&index)) {
            // No point keeps the bound: the one that comes nearest is reported.
            let fastest = points().filter(|&index| time(index).is_some()).min_by(by_time)?;
            if known[fastest].error.is_none() {
                return Some(SearchStep::Draw(fastest));
            }
            finalists.extend(Some(fastest).filter(|&fastest| fastest != 0 && !known[fastest].is_confirmed));
        }
        self.confirm(finalists)
    }

    /// Returns false for a point that was found slower than settings as given that keep the bound themselves.
    fn is_of_use(&self, known: &[PointState], index: usize) -> bool {
        !matches!(self.goal.bound, GoalBound::Loss(_)) || median(known[index].time) <= self.time_to_beat(known, 0)
    }

    /// The time that another point must be below to be chosen rather than this one.
    fn time_to_beat(&self, known: &[PointState], index: usize) -> f64 {
        self.share_to_beat(index) * median(known[index].time)
    }

    /// The share of this point's time that another must be below.
    fn share_to_beat(&self, index: usize) -> f64 {
        if index == 0 && matches!(self.goal.bound, GoalBound::Loss(_)) { 1.0 - LEAST_SAVING } else { 1.0 }
    }

    /// The settings as given are timed with any others.
    fn confirm(&self, mut finalists: Vec<usize>) -> Option<SearchStep> {
        finalists.truncate(if self.is_late { FINALISTS / 2 } else { FINALISTS });
        let is_first = !self.measured.batches.iter().any(|batch| batch.confirms);
        (is_first || !finalists.is_empty()).then_some(SearchStep::Confirm(finalists))
    }

    /// Returns true if an error keeps the bound, with the margin that other cameras need.
    fn keeps(&self, known: &[PointState], index: usize, error: f64) -> bool {
        let is_given = index == 0 && matches!(self.goal.bound, GoalBound::Loss(_));
        let is_below = is_given || self.margin.is_none_or(|margin| error < margin);
        !known[index].is_out && is_below && error <= self.most(known)
    }

    /// The largest error that is allowed.
    fn most(&self, known: &[PointState]) -> f64 {
        match self.goal.bound {
            GoalBound::Error(most) => most,
            GoalBound::Loss(share) => known[0].error.map_or(f64::INFINITY, |error| error * (1.0 + share)),
            GoalBound::Milliseconds(_) => f64::INFINITY,
        }
    }

    /// Points that may be the choice and have no time; the settings as given are timed beside all.
    fn open(&self, known: &[PointState]) -> Vec<usize> {
        let may_keep = |index: usize| known[index].error.is_none_or(|error| self.keeps(known, index, error));
        let is_open = |&index: &usize| known[index].time.is_none() && !known[index].is_out && may_keep(index);
        (1..known.len()).filter(is_open).collect()
    }

    /// The most promising ones of `open`. Families of which as much is hoped take turns.
    fn promising(&self, known: &[PointState], mut open: Vec<usize>) -> Vec<usize> {
        let model = EffectModel::of(self.info, known);
        let predicted: BTreeMap<usize, [f64; 4]> =
            open.iter().map(|&index| (index, self.rank(known, &model, index))).collect();
        let rank = |index: &usize| predicted[index];
        open.sort_by(|a, b| {
            let pairs = rank(a).into_iter().zip(rank(b));
            pairs.map(|(a, b)| a.total_cmp(&b)).fold(Ordering::Equal, Ordering::then).then(a.cmp(b))
        });
        open.truncate(self.glances);
        open
    }

    /// Less is more promising: by the effects of its settings on their own.
    fn rank(&self, known: &[PointState], model: &EffectModel, index: usize) -> [f64; 4] {
        let (time, error, turn) = (model.time(index), model.error(index), model.turn(index));
        // Combinations cannot be judged before anything was drawn.
        let is_hopeless = error > HOPELESS * self.most(known) || (!self.can_draw && model.families[index].is_none());
        match self.goal.bound {
            GoalBound::Milliseconds(most) => {
                let anchor = known[0].time.map_or(0.0, |time| time.median);
                [f64::from(u8::from(time * anchor > HOPELESS * most)), error, time, turn]
            }
            _ => [f64::from(u8::from(is_hopeless)), time, turn, error],
        }
    }

    fn states(&self) -> Vec<PointState> {
        let Self { info, measured, .. } = self;
        let clock = |sample: &TimingSample| match self.goal.bound {
            // The slower of both clocks, as the bound is about it.
            GoalBound::Milliseconds(_) => sample.wall.max(sample.gpu.unwrap_or(0.0)),
            _ => sample.decisive(),
        };
        let anchors = || measured.batches.iter().flat_map(|batch| &batch.rounds.anchor).map(clock);
        let unit = match self.goal.bound {
            GoalBound::Milliseconds(_) => median_interval(&anchors().collect::<Vec<f64>>())
                .map(|anchor| TimeEstimate { low: anchor.low, median: anchor.median, high: anchor.high }),
            _ => anchors().next().map(|_| TimeEstimate { low: 1.0, median: 1.0, high: 1.0 }),
        };
        let has_confirmed = measured.batches.iter().any(|batch| batch.confirms);
        let known = |(index, name): (usize, &String)| {
            let drawn = measured.drawn.get(name);
            let is_out = measured.failed.contains_key(name) || name.split(' ').any(|one| one == "textbook=on");
            let error = drawn.map(|drawn| drawn.errors.converged.comparable(self.goal.metric));
            let error = error.map(|error| if error.is_nan() { f64::INFINITY } else { error });
            if index == 0 {
                return PointState { time: unit, is_confirmed: has_confirmed, error, is_out };
            }
            let times = measured.times_of(name).zip(unit);
            let time = times.and_then(|((batch, own), unit)| {
                let pairs = own.iter().zip(&batch.rounds.anchor);
                let ratios: Vec<f64> = pairs.map(|(own, anchor)| clock(own) / clock(anchor)).collect();
                let span = estimate(&ratios, batch.confirms)?;
                Some(TimeEstimate {
                    low: span.low * unit.low,
                    median: span.median * unit.median,
                    high: span.high * unit.high,
                })
            });
            let is_confirmed = times.is_some_and(|((batch, _), _)| batch.confirms);
            // The point was timed, but no time of it is a number.
            let is_out = is_out || (times.is_some() && time.is_none());
            PointState { time, is_confirmed, error, is_out }
        };
        info.points.iter().enumerate().map(known).collect()
    }
}

/// The value at a place, on the line through the two points of a curve beside it, or nearest to it.
fn on_line(curve: &[(f64, f64)], place: f64) -> f64 {
    let after = curve.partition_point(|&(x, _)| x < place).clamp(1, curve.len() - 1);
    let ((a, from), (b, to)) = (curve[after - 1], curve[after]);
    let share = if a == b { 0.0 } else { (place - a) / (b - a) };
    (from + share * (to - from)).max(0.0)
}

/// Returns the fastest point. Single settings of a combination are drawn before it, because one that breaks the bound rules out all combinations with
/// it.
fn next_picture(model: &EffectModel, known: &[PointState], points: Vec<usize>) -> Option<usize> {
    let by_time = |a: &usize, b: &usize| median(known[*a].time).total_cmp(&median(known[*b].time)).then(a.cmp(b));
    let next = points.into_iter().min_by(by_time)?;
    let is_open = |part: &usize| known[*part].error.is_none() && !known[*part].is_out;
    Some(model.parts(next).flatten().find(is_open).unwrap_or(next))
}

fn median(time: Option<TimeEstimate>) -> f64 {
    time.map_or(f64::INFINITY, |time| time.median)
}

/// The median of ratios, and how sure it is; the ratios of a glance may be wrong by more than they scatter.
fn estimate(ratios: &[f64], is_confirmed: bool) -> Option<TimeEstimate> {
    let mut sorted: Vec<f64> = ratios.iter().copied().filter(|ratio| ratio.is_finite()).collect();
    sorted.sort_by(f64::total_cmp);
    let (mut low, mut high) = (*sorted.first()?, *sorted.last()?);
    if sorted.len() >= LEAST_FOR_95 {
        (low, high) = median_interval(&sorted).map(|interval| (interval.low, interval.high))?;
    }
    if !is_confirmed {
        (low, high) = (low * (1.0 - GLANCE_ERROR), high * (1.0 + GLANCE_ERROR));
    }
    Some(TimeEstimate { low, median: percentile(&sorted, 50.0)?, high })
}

/// The effect of each setting on its own.
struct EffectModel<'a> {
    info: &'a SceneInfo,
    states: &'a [PointState],
    /// Points by their names.
    by_name: BTreeMap<&'a str, usize>,
    /// The families that a point alone is of.
    families: Vec<Option<usize>>,
    /// The time of the settings as given.
    anchor: f64,
}

impl<'a> EffectModel<'a> {
    fn of(info: &'a SceneInfo, known: &'a [PointState]) -> Self {
        let by_name = info.points.iter().enumerate().map(|(index, name)| (name.as_str(), index)).collect();
        let mut families = vec![None; known.len()];
        for (number, family) in info.families.iter().enumerate().filter(|(_, family)| family.key != JOINT) {
            for member in family.members.iter().filter(|member| member.point != 0) {
                if let Some(of) = families.get_mut(member.point) {
                    *of = of.or(Some(number));
                }
            }
        }
        Self { info, states: known, by_name, families, anchor: known[0].time.map_or(1.0, |time| time.median) }
    }

    /// The time over the time of the settings as given.
    fn ratio(&self, index: usize) -> Option<f64> {
        self.states[index].time.map(|time| time.median / self.anchor)
    }

    /// Estimates a point's time over the time of the settings as given; the estimate is hopeful if little is measured.
    fn time(&self, index: usize) -> f64 {
        if let Some(family) = self.families[index] {
            return self.of_family(family, index);
        }
        self.parts(index).map(|part| part.and_then(|part| self.ratio(part)).unwrap_or(1.0)).product()
    }

    /// The values of a family that were timed, with their relative times. The value of the settings as given has 1.
    fn timed(&self, family: usize) -> Vec<(Option<f64>, f64)> {
        let members = self.info.families[family].members.iter();
        let of = |member: &Member| if member.point == 0 { Some(1.0) } else { self.ratio(member.point) };
        members.filter_map(|member| Some((member.value, of(member)?))).collect()
    }

    /// The values of a point's family before it that were not timed; 0 for a combination. Families take turns by it.
    fn turn(&self, index: usize) -> f64 {
        let members = self.families[index].map_or(&[][..], |family| &self.info.families[family].members);
        let before = members.iter().take_while(|member| member.point != index).map(|member| member.point);
        before.filter(|&point| point != 0 && self.states[point].time.is_none()).count() as f64
    }

    /// Estimates the time of a family's point from its other values: by a line through the nearest where they are numbers; where they are words, it may
    /// save as much as the best.
    fn of_family(&self, family: usize, index: usize) -> f64 {
        let members = &self.info.families[family].members;
        if !members.iter().any(|member| member.point != 0 && self.ratio(member.point).is_some()) {
            return HOPE;
        }
        let timed = self.timed(family);
        let own = members.iter().find(|member| member.point == index).and_then(|member| member.value);
        let mut curve: Vec<(f64, f64)> = timed.iter().filter_map(|&(value, ratio)| Some((value?, ratio))).collect();
        curve.sort_by(|a, b| a.0.total_cmp(&b.0));
        match own {
            Some(value) if curve.len() >= 2 => on_line(&curve, value),
            _ => timed.iter().map(|&(_, ratio)| ratio).fold(1.0 - MATTERS, f64::min),
        }
    }

    /// The error to expect; for single settings the error of the settings as given.
    fn error(&self, index: usize) -> f64 {
        let given = self.states[0].error.unwrap_or(0.0);
        if self.families[index].is_some() {
            return given;
        }
        let more = self.parts(index).filter_map(|part| Some(self.states[part?].error? - given));
        given + more.sum::<f64>()
    }

    /// The points that have one setting of a combination each; none for one that is no point.
    fn parts(&self, index: usize) -> impl Iterator<Item = Option<usize>> + '_ {
        self.info.points[index].split(' ').map(|setting| self.by_name.get(setting).copied())
    }
}
