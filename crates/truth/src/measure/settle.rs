//! Warm-up by time: frames are drawn until windows of them agree, so that no figure is one of clocks that still rise.
//!
//! An idle GPU lowers its clocks, and needs up to seconds of work to raise them: the first frames after a rest took 4.5 times as long as later ones
//! on an H200, in each pass alike. A number of frames is no warm-up there, since three of them are over in 3 ms. On CPU devices compilers and caches
//! warm up, within a few frames; their times scatter too much to agree, so they only have to stop falling.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use serde::{Deserialize, Serialize};

use super::statistics::percentile;

/// The part of a warm-up that tells whether clocks move: the time of a window, the least number of its rounds, windows that must agree, the largest
/// of their medians over the least, and the end of patience.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Rule {
    window: Duration,
    least_rounds: usize,
    windows: usize,
    agree: f64,
    longest: Duration,
    /// A median above the one before it counts as settled: only times that fall are clocks that rise.
    may_rise: bool,
}

/// Eight windows of 100 ms: on an H200 times of small frames rose by 17% after 0.45 s of steady ones.
const GPU: Rule = Rule {
    window: Duration::from_millis(100),
    least_rounds: 3,
    windows: 8,
    agree: 1.03,
    longest: Duration::from_secs(6),
    may_rise: false,
};
/// A window of one round each: a driver compiles in the first.
const CPU: Rule = Rule {
    window: Duration::ZERO,
    least_rounds: 1,
    windows: 2,
    agree: 1.05,
    longest: Duration::from_secs(10),
    may_rise: true,
};

/// The outcome of a warm-up.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct WarmUp {
    /// How long it took.
    pub seconds: f64,
    /// Rounds that were drawn, one frame of each renderer in each.
    pub rounds: u32,
    /// The last windows agree.
    pub settled: bool,
    /// The median of the first window of rounds, in milliseconds.
    pub first_ms: f64,
    /// The least and the largest median of the last windows, in milliseconds.
    pub last_ms: [f64; 2],
}

impl WarmUp {
    /// Returns a sentence about clocks that never settled; `None` where they did.
    pub fn words(&self) -> Option<String> {
        let Self { seconds, last_ms: [least, most], .. } = self;
        let percent = 100.0 * (most / least - 1.0);
        (!self.settled).then(|| {
            format!("clocks still moving: after {seconds:.1} s of warming up, times of the last windows of frames differ by {percent:.0}%")
        })
    }
}

/// Returns a sentence about batches that began before clocks had settled, if there are any.
pub fn still_moving(batches: usize, of: usize) -> Option<String> {
    (batches > 0).then(|| {
        format!(
            "clocks still moving in {batches} of {of} batches of frames, {:.0} s after each began: ratios hold, milliseconds hold less",
            GPU.longest.as_secs_f64()
        )
    })
}

/// Draws rounds until their times have settled, or patience is over. `round` draws a frame of each renderer and returns their time in milliseconds;
/// `steady` rounds are a window on CPU devices.
///
/// # Errors
/// Those of `round`.
pub fn settle<E>(software: bool, steady: usize, mut round: impl FnMut() -> Result<f64, E>) -> Result<WarmUp, E> {
    let begun = Instant::now();
    let mut settling = Settling::of(if software { Rule { least_rounds: steady, ..CPU } } else { GPU });
    loop {
        settling.add(round()?, begun.elapsed());
        if let Some(outcome) = settling.outcome(begun.elapsed()) {
            return Ok(outcome);
        }
    }
}

/// A warm-up at one moment.
struct Settling {
    rule: Rule,
    /// Medians of the last windows.
    medians: VecDeque<f64>,
    first: f64,
    /// Of the window that is not full, and the moment at which it began.
    open: Vec<f64>,
    opened: Duration,
    rounds: u32,
}

impl Settling {
    fn of(rule: Rule) -> Self {
        let (medians, open, opened) = (VecDeque::new(), Vec::new(), Duration::ZERO);
        Self { rule, medians, first: f64::NAN, open, opened, rounds: 0 }
    }

    fn add(&mut self, ms: f64, now: Duration) {
        self.rounds += 1;
        self.open.push(ms);
        if self.open.len() < self.rule.least_rounds || now < self.opened + self.rule.window {
            return;
        }
        self.open.sort_by(f64::total_cmp);
        let median = percentile(&self.open, 50.0).unwrap_or(f64::NAN);
        self.open.clear();
        self.opened = now;
        if self.medians.is_empty() {
            self.first = median;
        }
        self.medians.push_back(median);
        if self.medians.len() > self.rule.windows {
            self.medians.pop_front();
        }
    }

    /// The outcome, once there is one. Slow rounds may not fill all windows in time; then the windows that are full decide.
    fn outcome(&self, now: Duration) -> Option<WarmUp> {
        let is_late = now >= self.rule.longest;
        let settled = self.agree() && (is_late || self.medians.len() == self.rule.windows);
        let least = self.medians.iter().copied().fold(f64::INFINITY, f64::min);
        let most = self.medians.iter().copied().fold(0.0, f64::max);
        let last_ms = if self.medians.is_empty() { [f64::NAN; 2] } else { [least, most] };
        let Self { rounds, first, .. } = *self;
        (settled || is_late).then_some(WarmUp { seconds: now.as_secs_f64(), rounds, settled, first_ms: first, last_ms })
    }

    fn agree(&self) -> bool {
        let pairs = || self.medians.iter().zip(self.medians.iter().skip(1));
        if self.rule.may_rise {
            return pairs().all(|(before, after)| *after * self.rule.agree >= *before);
        }
        let [least, most] = [f64::min, f64::max].map(|of| self.medians.iter().copied().reduce(of).unwrap_or(1.0));
        most <= least * self.rule.agree
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A device whose frames take `ms(seconds)`; returns the outcome.
    fn warmed(rule: Rule, ms: impl Fn(f64) -> f64) -> WarmUp {
        let mut settling = Settling::of(rule);
        let mut now = 0.0;
        loop {
            let own = ms(now);
            now += own / 1e3;
            settling.add(own, Duration::from_secs_f64(now));
            if let Some(outcome) = settling.outcome(Duration::from_secs_f64(now)) {
                return outcome;
            }
        }
    }

    #[test]
    fn clocks_that_rise_are_waited_for() {
        // From 3.4 ms down to 0.76, within a second: the last window is a settled one.
        let ramp = |seconds: f64| 0.76 + 2.64 * (1.0 - seconds).max(0.0);
        let outcome = warmed(GPU, ramp);
        assert!(outcome.settled && outcome.words().is_none(), "{outcome:?}");
        assert!((1.7..2.3).contains(&outcome.seconds), "{outcome:?}");
        assert!(outcome.first_ms > 3.0 && outcome.last_ms[1] < 0.79, "{outcome:?}");
        // Steps with a plateau of 0.3 s each.
        let steps = |seconds: f64| [3.4, 2.0, 1.1, 0.76][((seconds / 0.3) as usize).min(3)];
        let outcome = warmed(GPU, steps);
        assert!(outcome.settled && outcome.last_ms == [0.76; 2], "{outcome:?}");
        let awake = warmed(GPU, |_| 0.76);
        assert!(awake.settled && awake.seconds < 0.9, "{awake:?}");
    }

    #[test]
    fn clocks_that_never_settle_are_told() {
        let swings = |seconds: f64| if ((seconds * 4.0) as u64).is_multiple_of(2) { 1.0 } else { 1.5 };
        let outcome = warmed(GPU, swings);
        assert!(!outcome.settled && outcome.seconds >= 6.0, "{outcome:?}");
        let words = outcome.words().expect("a sentence");
        assert!(words.contains("clocks still moving: after 6.0 s") && words.contains("50%"), "{words}");
        assert_eq!(
            (still_moving(0, 4), still_moving(2, 14).is_some_and(|words| words.contains("2 of 14"))),
            (None, true)
        );
    }

    #[test]
    fn slow_frames_are_judged_by_the_windows_that_there_are() {
        let outcome = warmed(GPU, |_| 900.0);
        assert!(outcome.settled && outcome.rounds == 7, "{outcome:?}");
        let outcome = warmed(GPU, |seconds| if seconds < 2.5 { 900.0 } else { 500.0 });
        assert!(!outcome.settled, "{outcome:?}");
    }

    #[test]
    fn a_cpu_that_compiles_is_done_when_times_stop_falling() {
        let outcome = warmed(CPU, |seconds| if seconds < 0.1 { 150.0 } else { 50.0 });
        assert!(outcome.settled && outcome.rounds == 3, "{outcome:?}");
        // Times that scatter upwards are no reason to wait.
        let outcome = warmed(CPU, |seconds| 50.0 + 40.0 * seconds);
        assert!(outcome.settled && outcome.rounds == 2, "{outcome:?}");
    }

    #[test]
    fn rounds_are_drawn_until_then() {
        let mut drawn = 0;
        let outcome = settle(true, 1, || {
            drawn += 1;
            Ok::<_, ()>([9.0, 5.0, 1.0][drawn.min(3) - 1])
        });
        assert_eq!((outcome.map(|outcome| outcome.rounds), drawn), (Ok(4), 4));
        assert_eq!(settle(true, 1, || Err::<f64, _>(7)), Err(7));
    }
}
