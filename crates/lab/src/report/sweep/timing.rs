//! Times of pictures: renderers take turns, so that a slow moment of the machine slows all of them.
//!
//! A batch is a few renderers that are held at once, the settings as given (the anchor) always among them. They are warmed up together until their
//! frames' times have settled ([`settle`]), for clocks rise and drivers compile late; then rounds begin, each of one picture by each renderer in
//! random order. The measure is the ratio of a picture's time to the anchor's in the same round: it is comparable between batches, and between
//! machines of one kind. Milliseconds are that ratio times the anchor's median over all batches, and as uncertain as both.

use std::sync::Arc;
use std::time::{Duration, Instant};

use serde::{Deserialize, Serialize};

use super::error::SweepError;
use super::model::{Interval, Timing};
use afterlight::frame::{Accumulator, Pixels, Renderer};
use afterlight::gpu::Device;
use afterlight::scene::{Camera, Scene, Settings};
use afterlight_truth::measure::{GroupedMedian, LEAST_FOR_95, WarmUp, cpu_seconds, median_interval, settle};

/// Frames that tell whether the clocks are still as high as after the last warm-up, and the share by which they may be slower.
const FRAMES_AWAKE: usize = 5;
const AWAKE: f64 = 1.05;
/// Rounds that a batch has at least, however slow it is.
const LEAST_ROUNDS: usize = LEAST_FOR_95;
/// Rounds of a first look, if they take longer than this.
const LEAST_GLANCES: usize = 2;
const LONG_GLANCE: Duration = Duration::from_millis(500);
/// Batches with a wide interval get this many times the rounds, at most.
const MORE_ROUNDS: usize = 3;

/// One picture, in milliseconds.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct TimingSample {
    pub wall: f64,
    /// The time by the device's own clock; `None` on CPU devices.
    pub gpu: Option<f64>,
    /// CPU time of the process; on CPU devices only.
    pub cpu: Option<f64>,
}

impl TimingSample {
    /// The time that counts.
    pub fn decisive(&self) -> f64 {
        self.gpu.unwrap_or(self.wall)
    }
}

/// The times of a batch: the anchor's, and the others' in the same rounds.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Rounds {
    pub anchor: Vec<TimingSample>,
    pub others: Vec<Vec<TimingSample>>,
    /// The clocks had not settled when the rounds began.
    #[serde(default)]
    pub moving: bool,
}

/// The rounds of a batch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Effort {
    pub rounds: usize,
    /// A batch that takes longer has no more rounds.
    pub longest: Duration,
    /// Frames of a window on CPU devices, where rounds begin when the medians of windows have stopped falling.
    pub steady_frames: usize,
}

impl Effort {
    /// Enough for a first answer.
    pub const QUICK: Self = Self { rounds: LEAST_FOR_95, longest: Duration::from_secs(5), steady_frames: 1 };
}

/// A renderer that takes its turns.
pub struct TimedRenderer {
    camera: Camera,
    renderer: Renderer,
    software: bool,
    /// A frame's time when its warm-up had ended, in milliseconds.
    settled: Option<f64>,
}

impl TimedRenderer {
    pub fn new(device: &Arc<Device>, scene: &Scene, camera: Camera, settings: &Settings) -> Result<Self, SweepError> {
        Ok(Self::of(Renderer::new(device, scene, settings)?, camera))
    }

    /// Of other settings, beside this one: the scene is uploaded once, where both need the same of it.
    pub fn beside(&self, scene: &Scene, camera: Camera, settings: &Settings) -> Result<Self, SweepError> {
        Ok(Self::of(self.renderer.beside(scene, settings)?, camera))
    }

    fn of(renderer: Renderer, camera: Camera) -> Self {
        let software = renderer.plan().software;
        Self { camera, renderer, software, settled: None }
    }

    pub fn renderer(&self) -> &Renderer {
        &self.renderer
    }

    /// Draws a frame, and returns its time by the clock that counts, in milliseconds.
    fn frame(&mut self) -> Result<f64, SweepError> {
        self.renderer.render(&self.camera)?;
        let frame = self.renderer.wait()?;
        Ok(if self.software { frame.wall_ms } else { frame.gpu_ms.unwrap_or(frame.wall_ms) })
    }

    /// The median time of some frames.
    fn frames(&mut self, count: usize) -> Result<f64, SweepError> {
        let times = (0..count).map(|_| self.frame()).collect::<Result<Vec<f64>, _>>()?;
        Ok(median(&times))
    }

    /// Draws frames, as many as this.
    pub fn warm_up_for(&mut self, frames: usize) -> Result<(), SweepError> {
        (0..frames).try_for_each(|_| self.frame().map(drop))
    }

    /// Returns true if its frames take no longer than after its warm-up: an idle GPU has lowered its clocks meanwhile.
    pub fn is_awake(&mut self) -> Result<bool, SweepError> {
        match self.settled {
            _ if self.software => Ok(true),
            Some(settled) => Ok(self.frames(FRAMES_AWAKE)? <= AWAKE * settled),
            None => Ok(false),
        }
    }

    /// Draws one picture, of one that is averaged over time all frames since its cut. One of several samples is read back frame by frame and
    /// averaged, which is a part of its wall time; one of a single frame is done when the device is.
    pub fn draw(&mut self) -> Result<TimingSample, SweepError> {
        self.draw_frames(u32::MAX)
    }

    /// Draws the first frames of a picture, at most `most`, and extrapolates to the time of all: the frames differ by less than times scatter.
    pub fn draw_frames(&mut self, most: u32) -> Result<TimingSample, SweepError> {
        let cpu_before = cpu_seconds();
        let whole = self.renderer.plan().frames_a_picture();
        let count = whole.min(most.max(1));
        let all = f64::from(whole) / f64::from(count);
        self.renderer.cut();
        let begun = Instant::now();
        let (mut gpu, mut wall) = (Some(0.0), 0.0);
        let mut sum = (self.renderer.plan().samples > 1).then(|| Accumulator::new(self.renderer.plan()));
        for index in 0..count {
            self.renderer.render_sample(&self.camera, index)?;
            let frame = self.renderer.wait()?;
            gpu = gpu.zip(frame.gpu_ms).map(|(sum, ms)| sum + ms);
            wall += frame.wall_ms;
            if let Some(sum) = &mut sum
                && let Pixels::LinearF32(rgba) = self.renderer.read_back()?.pixels
            {
                sum.add(&rgba);
            }
        }
        let mut wall = wall * all;
        if let Some(sum) = sum {
            let frames = begun.elapsed();
            std::hint::black_box(sum.picture());
            // The mean is made once, however many frames there are.
            wall = (frames.as_secs_f64() * all + (begun.elapsed() - frames).as_secs_f64()) * 1e3;
        }
        let cpu = cpu_before.zip(cpu_seconds()).map(|(before, after)| (after - before) * all * 1e3);
        Ok(TimingSample {
            wall,
            gpu: gpu.map(|ms| ms * all).filter(|_| !self.software),
            cpu: cpu.filter(|_| self.software),
        })
    }
}

/// Draws frames of all in turn until their times have settled.
///
/// # Errors
/// When the device cannot draw them.
pub fn warm_up(contenders: &mut [&mut TimedRenderer], steady_frames: usize) -> Result<WarmUp, SweepError> {
    let software = contenders.first().is_none_or(|first| first.software);
    let outcome = settle(software, steady_frames, || {
        contenders.iter_mut().map(|contender| contender.frame()).sum::<Result<f64, _>>()
    })?;
    // Only the anchor is asked later whether the clocks have fallen: the others are dropped after their batch.
    if let Some(first) = contenders.first_mut().filter(|first| !first.software) {
        first.settled = Some(first.frames(FRAMES_AWAKE)?);
    }
    Ok(outcome)
}

fn median(samples: &[f64]) -> f64 {
    let mut sorted = samples.to_vec();
    sorted.sort_by(f64::total_cmp);
    afterlight_truth::measure::percentile(&sorted, 50.0).unwrap_or(f64::NAN)
}

/// Draws rounds of all contenders, the first of which is the anchor, each round in a new random order. `draw` draws a picture of one contender.
pub fn take_turns<E>(
    contenders: usize,
    effort: &Effort,
    random: &mut fastrand::Rng,
    draw: impl FnMut(usize) -> Result<TimingSample, E>,
) -> Result<Rounds, E> {
    let begun = Instant::now();
    rounds_of(contenders, random, draw, |round, times| {
        let is_enough = || times[1..].iter().all(|own| !is_unsure(own, &times[0]));
        let is_late = begun.elapsed() >= effort.longest;
        round >= effort.rounds * MORE_ROUNDS
            || (round >= LEAST_ROUNDS && (is_late || (round >= effort.rounds && is_enough())))
    })
}

/// Draws rounds for a first look: few if they take long, otherwise as many as an interval needs.
pub fn glance<E>(
    contenders: usize,
    random: &mut fastrand::Rng,
    draw: impl FnMut(usize) -> Result<TimingSample, E>,
) -> Result<Rounds, E> {
    let begun = Instant::now();
    let is_long = || begun.elapsed() >= LONG_GLANCE;
    rounds_of(contenders, random, draw, |round, _| round >= LEAST_ROUNDS || (round >= LEAST_GLANCES && is_long()))
}

fn rounds_of<E>(
    contenders: usize,
    random: &mut fastrand::Rng,
    mut draw: impl FnMut(usize) -> Result<TimingSample, E>,
    is_over: impl Fn(usize, &[Vec<TimingSample>]) -> bool,
) -> Result<Rounds, E> {
    let mut times: Vec<Vec<TimingSample>> = vec![Vec::new(); contenders];
    let mut order: Vec<usize> = (0..contenders).collect();
    for round in 0.. {
        if is_over(round, &times) {
            break;
        }
        random.shuffle(&mut order);
        for &contender in &order {
            times[contender].push(draw(contender)?);
        }
    }
    let anchor = times.remove(0);
    Ok(Rounds { anchor, others: times, moving: false })
}

fn is_unsure(own: &[TimingSample], anchor: &[TimingSample]) -> bool {
    ratios(own, anchor, |sample| Some(sample.decisive()))
        .and_then(|ratios| median_interval(&ratios))
        .is_some_and(|interval| interval.is_wide())
}

/// The time of each round over the anchor's; `None` without a clock.
fn ratios(
    own: &[TimingSample],
    anchor: &[TimingSample],
    clock: impl Fn(&TimingSample) -> Option<f64>,
) -> Option<Vec<f64>> {
    own.iter().zip(anchor).map(|(own, anchor)| Some(clock(own)? / clock(anchor)?)).collect()
}

/// One of the clocks of a sample.
type SampleClock = fn(&TimingSample) -> Option<f64>;
const WALL: SampleClock = |sample| Some(sample.wall);
const GPU: SampleClock = |sample| sample.gpu;
const CPU: SampleClock = |sample| sample.cpu;

/// The scale of all times: every measurement of the anchor, by its clocks.
#[derive(Debug, Clone)]
pub struct Anchor {
    wall: GroupedMedian,
    gpu: Option<GroupedMedian>,
    cpu: Option<GroupedMedian>,
}

/// A point's times.
#[derive(Debug, Clone, PartialEq)]
pub struct PointTimes {
    pub timing: Timing,
    /// The time of each round over the anchor's, by the clock that counts. The anchor has a single 1, as the others are compared with it.
    pub ratios: Vec<f64>,
}

impl Anchor {
    /// Builds the scale from the anchor's samples, by batch; `None` if there are none.
    pub fn of(batches: &[&[TimingSample]]) -> Option<Self> {
        let by = |clock: SampleClock| {
            let times = |batch: &&[TimingSample]| batch.iter().map(clock).collect::<Option<Vec<f64>>>();
            GroupedMedian::of(&batches.iter().map(times).collect::<Option<Vec<_>>>()?)
        };
        Some(Self { wall: by(WALL)?, gpu: by(GPU), cpu: by(CPU) })
    }

    /// The anchor's own times, over all batches.
    pub fn times(&self, confirmed: bool) -> Option<PointTimes> {
        let own = |median: &Option<GroupedMedian>| median.as_ref().and_then(GroupedMedian::interval);
        let (wall, gpu, cpu) = (self.wall.interval()?, own(&self.gpu), own(&self.cpu));
        let ratio = Interval { median: 1.0, low: 1.0, high: 1.0, count: wall.count };
        Some(PointTimes { timing: Timing { wall, gpu, cpu, ratio, confirmed }, ratios: vec![1.0] })
    }

    /// The times of a point whose rounds were drawn beside `anchor`: the anchor's median times the median of the rounds' ratios.
    pub fn scaled(&self, own: &[TimingSample], anchor: &[TimingSample], confirmed: bool) -> Option<PointTimes> {
        let scaled = |median: &GroupedMedian, clock: SampleClock| median.times(&ratios(own, anchor, clock)?);
        let gpu = self.gpu.as_ref().and_then(|median| scaled(median, GPU));
        let cpu = self.cpu.as_ref().and_then(|median| scaled(median, CPU));
        let ratios = ratios(own, anchor, |sample| Some(sample.decisive()))?;
        let ratio = median_interval(&ratios)?;
        Some(PointTimes { timing: Timing { wall: scaled(&self.wall, WALL)?, gpu, cpu, ratio, confirmed }, ratios })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wall(wall: f64) -> TimingSample {
        TimingSample { wall, gpu: None, cpu: Some(2.0 * wall) }
    }

    #[test]
    fn what_slows_a_round_slows_all_of_it_and_no_ratio() {
        let slow = [1.0, 9.0, 1.0, 4.0, 1.0, 2.0];
        let anchor: Vec<TimingSample> = slow.iter().map(|slow| wall(10.0 * slow)).collect();
        let own: Vec<TimingSample> = slow.iter().map(|slow| wall(25.0 * slow)).collect();
        let all = Anchor::of(&[&[wall(10.0); 5]]).expect("finite");
        let times = all.scaled(&own, &anchor, true).expect("finite");
        let expected = Interval { median: 25.0, low: 25.0, high: 25.0, count: 6 };
        assert_eq!((times.timing.wall, times.timing.gpu), (expected, None));
        assert_eq!(times.timing.cpu.map(|cpu| cpu.median), Some(50.0));
        assert_eq!((times.ratios, times.timing.ratio.low, times.timing.ratio.high), (vec![2.5; 6], 2.5, 2.5));
    }

    #[test]
    fn milliseconds_are_as_uncertain_as_the_anchor_and_ratios_are_not() {
        let mut random = fastrand::Rng::with_seed(5);
        let mut noisy = |count: usize| (0..count).map(|_| wall(10.0 + 4.0 * random.f64())).collect::<Vec<_>>();
        let (first, second) = (noisy(15), noisy(15));
        let own: Vec<TimingSample> = first.iter().map(|sample| wall(0.5 * sample.wall)).collect();
        let anchor = Anchor::of(&[&first, &second]).expect("finite");
        let (of_anchor, of_own) =
            (anchor.times(true).expect("times"), anchor.scaled(&own, &first, true).expect("times"));
        let [anchors, owns] = [&of_anchor, &of_own].map(|times| times.timing.wall.relative_half_width());
        assert!(anchors > 0.01 && (owns / anchors - 1.0).abs() < 0.05, "{owns} {anchors}");
        assert_eq!((of_own.timing.ratio.low, of_own.timing.ratio.high), (0.5, 0.5));
        assert_eq!((of_anchor.ratios, of_anchor.timing.ratio.median), (vec![1.0], 1.0));
        assert!(Anchor::of(&[]).is_none());
    }

    #[test]
    fn every_round_has_each_contender_once_and_orders_differ() {
        let mut drawn = Vec::new();
        let effort = Effort { rounds: 12, longest: Duration::from_secs(60), steady_frames: 3 };
        let rounds = take_turns(3, &effort, &mut fastrand::Rng::with_seed(7), |contender| {
            drawn.push(contender);
            Ok::<_, ()>(wall(1.0 + contender as f64))
        })
        .expect("no error");
        assert_eq!((rounds.anchor.len(), rounds.others.len()), (12, 2));
        assert!(rounds.others.iter().all(|times| times.len() == 12));
        let orders: std::collections::BTreeSet<&[usize]> = drawn.chunks(3).collect();
        assert!(orders.len() > 3, "{orders:?}");
        assert!(orders.iter().all(|order| order.iter().sum::<usize>() == 3));
    }

    #[test]
    fn a_first_look_has_more_rounds_where_they_take_no_time() {
        let mut random = fastrand::Rng::with_seed(1);
        let rounds = glance(3, &mut random, |contender| Ok::<_, ()>(wall(1.0 + contender as f64))).expect("no error");
        assert_eq!((rounds.anchor.len(), rounds.others.len()), (LEAST_ROUNDS, 2));
        assert!(rounds.others.iter().all(|times| times.len() == LEAST_ROUNDS));
        let slow = |_| {
            std::thread::sleep(LONG_GLANCE / 2);
            Ok::<_, ()>(wall(1.0))
        };
        assert_eq!(glance(1, &mut random, slow).expect("no error").anchor.len(), LEAST_GLANCES);
    }

    #[test]
    fn what_is_unsure_gets_more_rounds_and_not_without_end() {
        let effort = Effort { rounds: 8, longest: Duration::from_secs(60), steady_frames: 3 };
        let mut random = fastrand::Rng::with_seed(1);
        let mut noise = fastrand::Rng::with_seed(2);
        let rounds = take_turns(2, &effort, &mut random, |_| Ok::<_, ()>(wall(1.0 + 3.0 * noise.f64())));
        assert_eq!(rounds.expect("no error").anchor.len(), 24);
        let late = Effort { longest: Duration::ZERO, ..effort };
        let rounds = take_turns(2, &late, &mut random, |_| Ok::<_, ()>(wall(1.0)));
        assert_eq!(rounds.expect("no error").anchor.len(), LEAST_ROUNDS);
    }
}
