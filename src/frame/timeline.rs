//! A renderer's memory of the frame before, where frames are averaged over time.

use super::jitter::JitterSequence;
use crate::visible::{Eye, FrameProjection, Reprojection, Visible, World};

/// Frame rate at which a picture's frames are assumed to be shown.
pub const FRAMES_A_SECOND: f64 = 60.0;

/// The frames since the last cut.
#[derive(Debug)]
pub(super) struct Timeline {
    /// The number of frames so far.
    count: u32,
    /// The jitter of the frames.
    order: JitterSequence,
    last: Option<Last>,
    /// The number of frames in a row that have changed nothing.
    still: u32,
    /// The number of frames since the last change, with the frame that showed it.
    since_change: u32,
}

/// The view of the last frame.
#[derive(Debug)]
struct Last {
    projection: FrameProjection,
    generation: u64,
    /// State of the content that changes by itself.
    changing: Vec<u8>,
    exposure: f32,
}

impl Timeline {
    /// A timeline whose jitter repeats after `places` frames.
    pub fn of(places: u32) -> Self {
        Self { count: 0, order: JitterSequence::of(places), last: None, still: 0, since_change: 0 }
    }

    /// Makes the next frame the first: the earlier frames showed something else, or had another size.
    pub fn begin(&mut self, places: u32) {
        let order = if self.order.count() == places.max(1) { self.order } else { JitterSequence::of(places) };
        *self = Self { count: 0, order, last: None, still: 0, since_change: 0 };
    }

    /// The number of frames in a row that have changed nothing.
    pub fn still(&self) -> u32 {
        self.still
    }

    /// The number of frames since the last change, with the frame that showed it; 0 after a cut. It stays constant for all frames while something
    /// moves.
    pub fn since_change(&self) -> u32 {
        self.since_change
    }

    /// Returns the data that the next frame needs of the last one.
    pub fn reprojection(&self, world: &World, visible: &Visible, eye: &Eye, size: [u32; 2]) -> Reprojection {
        let current = FrameProjection::of(eye, &visible.depth, size);
        let last = self.last.as_ref();
        Reprojection {
            current,
            previous: last.map(|last| last.projection),
            still: last.is_some_and(|last| {
                let same = last.projection == current && last.generation == world.generation();
                same && last.changing == visible.changing()
            }),
            exposed: last.map_or(1.0, |last| world.exposure / last.exposure),
            jitter: self.order.offset(self.count),
            moved: if last.is_some() { visible.moved(world) } else { Vec::new() },
        }
    }

    /// Notes a submitted frame as the last one.
    pub fn pass(&mut self, frame: &Reprojection, world: &World, visible: &Visible) {
        self.count = self.count.wrapping_add(1);
        self.still = if frame.still { self.still.saturating_add(1) } else { 0 };
        self.since_change = self.still.saturating_add(1);
        self.last = Some(Last {
            projection: frame.current,
            generation: world.generation(),
            changing: visible.changing(),
            exposure: world.exposure,
        });
    }
}
