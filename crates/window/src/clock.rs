//! Times of frames, for the title and for callers that asked for a number of frames.

use std::time::{Duration, Instant};

use afterlight::frame::FrameTimes;

/// A summary of a window's frames.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Summary {
    /// Frames shown.
    pub frames: u64,
    /// From one frame to the next, the median, in milliseconds; none for fewer than two without a pause.
    pub interval_ms: Option<f64>,
    /// Changes of the window's size, and their median time in milliseconds.
    pub resizes: usize,
    /// The longest that a resize took, in milliseconds.
    pub resize_ms: Option<f64>,
}

/// One of the last frames.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Interval {
    /// Time from the previous frame to this one.
    pub interval_ms: f64,
    /// The times of the last finished frame: recording on the CPU, and drawing on the device.
    pub record_ms: f64,
    /// Drawing time by the device's own clock, in milliseconds.
    pub gpu_ms: Option<f64>,
}

/// Counts frames.
#[derive(Debug, Default)]
pub struct Clock {
    frames: u64,
    /// The last frame, unless the window has paused since.
    last: Option<Instant>,
    intervals: Vec<f64>,
    resizes: Vec<f64>,
    /// Intervals since the title was last written.
    recent: Vec<f64>,
    told: Option<Instant>,
    /// The newest at the end, [`GRAPH`] at most.
    graph: Vec<Interval>,
}

/// Intervals that a graph shows.
const GRAPH: usize = 160;

/// The time for which a title stays as it is.
const TITLE: Duration = Duration::from_millis(500);
/// Intervals that are kept: an hour of a fast display.
const MOST: usize = 1 << 20;

impl Clock {
    /// A frame was shown that was begun at this time. `times` are of the last one that is done.
    pub fn frame(&mut self, now: Instant, times: &FrameTimes) {
        self.frames += 1;
        if let Some(last) = self.last.replace(now) {
            let interval = now.duration_since(last).as_secs_f64() * 1e3;
            self.recent.push(interval);
            if self.graph.len() == GRAPH {
                self.graph.remove(0);
            }
            let &FrameTimes { record_ms, gpu_ms, .. } = times;
            self.graph.push(Interval { interval_ms: interval, record_ms, gpu_ms });
            if self.intervals.len() < MOST {
                self.intervals.push(interval);
            }
        }
    }

    /// The last intervals without a pause, the newest at the end.
    pub fn graph(&self) -> &[Interval] {
        &self.graph
    }

    /// No frame follows the last one for now.
    pub fn pause(&mut self) {
        self.last = None;
    }

    /// Notes the time that it took to make everything of the picture's size anew.
    pub fn resized(&mut self, took: Duration) {
        if self.resizes.len() < MOST {
            self.resizes.push(took.as_secs_f64() * 1e3);
        }
    }

    pub fn frames(&self) -> u64 {
        self.frames
    }

    /// The median of recent intervals in milliseconds, now and then.
    pub fn tells(&mut self, now: Instant) -> Option<f64> {
        if self.told.is_some_and(|told| now.duration_since(told) < TITLE) {
            return None;
        }
        let median = median(&mut std::mem::take(&mut self.recent))?;
        self.told = Some(now);
        Some(median)
    }

    pub fn summary(&mut self) -> Summary {
        Summary {
            frames: self.frames,
            interval_ms: median(&mut self.intervals),
            resizes: self.resizes.len(),
            resize_ms: median(&mut self.resizes),
        }
    }
}

fn median(values: &mut [f64]) -> Option<f64> {
    values.sort_unstable_by(f64::total_cmp);
    values.get(values.len() / 2).copied()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pause_is_no_interval() {
        let begin = Instant::now();
        let at = |ms| begin + Duration::from_millis(ms);
        let mut clock = Clock::default();
        for ms in [0, 10, 20, 32] {
            clock.frame(at(ms), &FrameTimes::default());
        }
        clock.pause();
        clock.frame(at(9000), &FrameTimes::default());
        clock.frame(at(9010), &FrameTimes::default());
        let summary = clock.summary();
        assert_eq!((summary.frames, summary.interval_ms, summary.resize_ms), (6, Some(10.0), None));
    }

    #[test]
    fn the_title_changes_now_and_then() {
        let begin = Instant::now();
        let mut clock = Clock::default();
        assert_eq!(clock.tells(begin), None);
        clock.frame(begin, &FrameTimes::default());
        clock.frame(begin + Duration::from_millis(8), &FrameTimes::default());
        assert_eq!(clock.tells(begin + Duration::from_millis(8)), Some(8.0));
        clock.frame(begin + Duration::from_millis(16), &FrameTimes::default());
        assert_eq!(clock.tells(begin + Duration::from_millis(16)), None);
    }
}
