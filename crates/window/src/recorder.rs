//! The camera's path as it is flown.

use std::time::Instant;

use afterlight::scene::{Camera, CameraKey, CameraPath, Error};

/// Keys are at least so far apart, in seconds: between them the path is smooth.
const STEP: f64 = 1.0 / 30.0;

/// A path that is being recorded.
#[derive(Debug)]
pub struct Recorder {
    begun: Instant,
    keys: Vec<CameraKey>,
}

impl Recorder {
    pub fn new(now: Instant, camera: Camera) -> Self {
        Self { begun: now, keys: vec![CameraKey { time: 0.0, camera }] }
    }

    /// Takes note of where the camera is. While it stands still nothing is noted but where that ended.
    pub fn take(&mut self, now: Instant, camera: Camera) {
        let time = now.saturating_duration_since(self.begun).as_secs_f64();
        let (last, before) = match *self.keys.as_slice() {
            [.., before, last] => (last, Some(before)),
            [last] => (last, None),
            [] => return,
        };
        if time - last.time < STEP {
            return;
        }
        if last.camera == camera && before.is_some_and(|before| before.camera == camera) {
            self.keys.pop();
        }
        self.keys.push(CameraKey { time, camera });
    }

    /// The path, with the camera's last place at its end.
    ///
    /// # Errors
    /// When it was over at once.
    pub fn end(mut self, now: Instant, camera: Camera) -> Result<CameraPath, Error> {
        let time = now.saturating_duration_since(self.begun).as_secs_f64();
        // The place of the last key that is too near, unless it is the first.
        if self.keys.len() > 1 && self.keys.last().is_some_and(|last| time - last.time < STEP) {
            self.keys.pop();
        }
        self.keys.push(CameraKey { time, camera });
        CameraPath::new(self.keys)
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use glam::DVec3;

    use super::*;

    #[test]
    fn a_path_is_where_the_camera_was_and_a_rest_is_two_keys() {
        let begun = Instant::now();
        let at = |ms: u64| begun + Duration::from_millis(ms);
        let camera = |x: f64| Camera { position: DVec3::X * x, ..Camera::default() };
        let mut recorder = Recorder::new(begun, camera(0.0));
        for step in 1..=200 {
            // Ten milliseconds a frame; moves for the first half.
            recorder.take(at(10 * step), camera(step.min(100) as f64 * 0.01));
        }
        let path = recorder.end(at(2005), camera(1.0)).expect("is a path");
        assert!((path.seconds() - 2.005).abs() < 1e-9);
        assert!(path.keys().len() < 30, "{}", path.keys().len());
        for (seconds, x) in [(0.0, 0.0), (0.5, 0.5), (1.5, 1.0), (2.005, 1.0)] {
            assert!((path.at(seconds).position.x - x).abs() < 0.01, "{seconds} {:?}", path.at(seconds).position);
        }
        assert!(Recorder::new(begun, camera(0.0)).end(begun, camera(0.0)).is_err());
    }
}
