//! The resolution of pictures in a window while something moves, on devices that cannot draw all of its pixels often enough. It follows the time that
//! frames take; a picture that rests is whole.

use std::time::{Duration, Instant};

use afterlight::scene::Camera;

/// Steps of the window's width and height. A change of the step makes everything of the picture's size anew, so that only a few exist.
const STEPS: u32 = 8;
/// The coarsest, with which a window begins: a sixteenth of the pixels.
const COARSEST: u32 = 2;
/// The time that a frame may take while something moves: 10 a second.
const AIM: Duration = Duration::from_millis(100);
/// Times up to this much longer are no reason for a change.
const TOLERANCE: f64 = 1.15;
/// A finer step is taken if its expected time is below this share of [`AIM`].
const MARGIN: f64 = 0.85;
/// Frames after a change of step until the time of a frame with the new step is known: two are in flight, and one is being recorded.
const LATE: u32 = 3;
/// Time after the last movement at which a picture rests.
const REST: Duration = Duration::from_millis(150);

/// The state of a frame's picture, besides a camera that may have moved.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PictureMotion {
    /// Nothing moves.
    Rests,
    /// Something moves.
    Moves,
    /// The picture is kept or compared: it is whole.
    Kept,
}

/// The resolution of a window's frames.
#[derive(Debug)]
pub struct Resolution {
    /// Otherwise pictures are whole.
    pub follows: bool,
    /// The step while something moves.
    step: u32,
    /// The camera of the last frame.
    camera: Option<Camera>,
    /// The moment of the last movement; none before the first frame.
    moved: Option<Instant>,
    /// Frames with this step so far, without a pause.
    since: u32,
}

impl Resolution {
    /// Returns the state of a window that opens.
    pub fn new(follows: bool) -> Self {
        Self { follows, step: COARSEST, camera: None, moved: None, since: 0 }
    }

    /// The share of the window's width and height for the frame that begins now, and when it is to be drawn anew because it will rest then. `took` is how
    /// long the last frame took that is known to be done.
    pub fn choose(
        &mut self,
        now: Instant,
        camera: &Camera,
        motion: PictureMotion,
        took: Duration,
    ) -> (f64, Option<Instant>) {
        if !self.follows {
            return (1.0, None);
        }
        // The first frame comes as soon as can be, too.
        let has_moved = self.camera.replace(*camera) != Some(*camera);
        if motion == PictureMotion::Moves || has_moved {
            self.moved = Some(now);
        }
        let rests = self.moved.map(|moved| moved + REST).filter(|rests| *rests > now);
        if motion == PictureMotion::Kept || rests.is_none() {
            self.forget_times();
            return (1.0, rests);
        }
        if self.since >= LATE && !took.is_zero() {
            let step = step_for(self.step, took);
            if step != self.step {
                (self.step, self.since) = (step, 0);
            }
        }
        self.since += 1;
        (f64::from(self.step) / f64::from(STEPS), rests.filter(|_| self.step < STEPS))
    }

    /// Returns true if the frame that begins now is whole.
    pub fn is_whole(&self, now: Instant, camera: &Camera, motion: PictureMotion) -> bool {
        let moves = motion == PictureMotion::Moves || self.camera != Some(*camera);
        let rests = self.moved.is_none_or(|moved| moved + REST <= now);
        !self.follows || motion == PictureMotion::Kept || !moves && rests
    }

    /// The next times are of frames that had another size.
    pub fn forget_times(&mut self) {
        self.since = 0;
    }

    /// Lets pictures be whole, or coarser again while something moves.
    pub fn switch(&mut self) {
        self.follows = !self.follows;
    }
}

/// The step for frames that take so long with `step`. All of a frame's time is taken to be of its pixels; the rest makes a finer step cheaper than expected,
/// and a coarser one not coarse enough at once.
fn step_for(step: u32, took: Duration) -> u32 {
    let share = took.as_secs_f64() / AIM.as_secs_f64();
    let expected = |other: u32| share * (f64::from(other) / f64::from(step)).powi(2);
    if share > TOLERANCE {
        return (COARSEST..step).rev().find(|&other| expected(other) <= 1.0).unwrap_or(COARSEST);
    }
    (step + 1..=STEPS).rev().find(|&other| expected(other) <= MARGIN).unwrap_or(step)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Simulates a window whose camera moves in each frame. A frame takes `fixed` milliseconds, and `whole(frame)` milliseconds for all of its
    /// pixels; the time is known three frames later. Returns all shares.
    fn shares(fixed: f64, whole: impl Fn(usize) -> f64, frames: usize) -> Vec<f64> {
        let mut resolution = Resolution::new(true);
        let (mut now, mut camera) = (Instant::now(), Camera::default());
        let mut shares: Vec<f64> = Vec::new();
        for frame in 0..frames {
            camera.position.x += 1.0;
            let took =
                |frame: usize, share: f64| Duration::from_secs_f64((fixed + whole(frame) * share * share) * 1e-3);
            let known = frame.checked_sub(3).map_or(Duration::ZERO, |frame| took(frame, shares[frame]));
            let (share, rests) = resolution.choose(now, &camera, PictureMotion::Rests, known);
            assert_eq!(rests, (share < 1.0).then_some(now + REST));
            shares.push(share);
            now += took(frame, share);
        }
        shares
    }

    #[test]
    fn it_follows_the_time_that_frames_take_and_stays_there() {
        let cases =
            [(5.0, 650.0, 0.25), (5.0, 400.0, 0.375), (5.0, 60.0, 1.0), (20.0, 240.0, 0.375), (120.0, 9.0, 0.25)];
        for (fixed, whole, expected) in cases {
            let shares = shares(fixed, |_| whole, 40);
            assert_eq!(shares[0], 0.25, "begins with the coarsest");
            assert!(shares[20..].iter().all(|&share| share == expected), "{fixed} + {whole} ms: {shares:?}");
        }
        // Something comes into view.
        let shares = shares(5.0, |frame| if frame < 20 { 60.0 } else { 400.0 }, 60);
        assert_eq!((shares[20], shares[59]), (1.0, 0.375), "{shares:?}");
    }

    #[test]
    fn a_picture_that_rests_is_whole() {
        let (begin, camera, took) = (Instant::now(), Camera::default(), AIM);
        let mut resolution = Resolution::new(true);
        let mut choose = |at: Instant, motion| {
            let is_whole = resolution.is_whole(at, &camera, motion);
            let chosen = resolution.choose(at, &camera, motion, took);
            assert_eq!(is_whole, chosen.0 == 1.0, "said before");
            chosen
        };
        assert_eq!(choose(begin, PictureMotion::Rests), (0.25, Some(begin + REST)));
        // A frame for another reason meanwhile is not finer, and does not put the rest off.
        assert_eq!(choose(begin + REST / 2, PictureMotion::Rests), (0.25, Some(begin + REST)));
        assert_eq!(choose(begin + REST, PictureMotion::Rests), (1.0, None));
        assert_eq!(choose(begin + 2 * REST, PictureMotion::Moves), (0.25, Some(begin + 3 * REST)));
        // One that is kept is whole while something moves, too.
        assert_eq!(choose(begin + 2 * REST, PictureMotion::Kept).0, 1.0);
        assert_eq!(Resolution::new(false).choose(begin, &camera, PictureMotion::Moves, took), (1.0, None));
    }

    #[test]
    fn times_of_whole_pictures_do_not_count() {
        let (begin, camera) = (Instant::now(), Camera::default());
        let mut resolution = Resolution::new(true);
        for frame in 0..LATE {
            resolution.choose(begin + frame * AIM, &camera, PictureMotion::Moves, 9 * AIM);
        }
        resolution.choose(begin + 20 * AIM, &camera, PictureMotion::Rests, AIM);
        resolution.choose(begin + 21 * AIM, &camera, PictureMotion::Moves, AIM / 100);
        assert_eq!((resolution.step, resolution.since), (COARSEST, 1));
    }
}
