//! A camera that moves along a path of keys.

use std::fmt::Write as _;

use glam::{DQuat, DVec3};

use super::{Camera, Error, Projection};

/// The largest time of a key, in seconds.
pub const MAX_SECONDS: f64 = 1e9;

/// A camera at one time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CameraKey {
    /// The time in seconds, from 0 to [`MAX_SECONDS`].
    pub time: f64,
    /// The camera at that time.
    pub camera: Camera,
}

/// A camera that moves through its keys, smoothly: at each key it has the key's place, rotation and lens.
///
/// Positions lie on a cubic Hermite spline. The velocity at a key is the mean velocity from the key before it to the key after it (a Catmull-Rom
/// spline over times that need not be even). Rotations take the shorter way at an even speed from key to key, and lenses zoom by even ratios.
#[derive(Debug, Clone, PartialEq)]
pub struct CameraPath {
    keys: Vec<CameraKey>,
}

impl CameraPath {
    /// A path through two keys or more, in the order of their times.
    ///
    /// # Errors
    /// [`Error::Setting`] when there are fewer, a time is not after the one before it or out of range, or keys have different kinds of projection.
    pub fn new(keys: Vec<CameraKey>) -> Result<Self, Error> {
        let wrong = |what: String| Err(Error::Setting(format!("camera path: {what}")));
        if keys.len() < 2 {
            return wrong(format!("a path has two keys or more, and not {}", keys.len()));
        }
        if let Some(key) = keys.iter().find(|key| !(0.0..=MAX_SECONDS).contains(&key.time)) {
            return wrong(format!("a time of {} s is not from 0 to {MAX_SECONDS:e}", key.time));
        }
        for (before, after) in keys.iter().zip(&keys[1..]) {
            if after.time <= before.time {
                return wrong(format!("{} s is not after the {} s of the key before it", after.time, before.time));
            }
            if after.camera.is_orthographic() != before.camera.is_orthographic() {
                return wrong(format!("at {} s it changes between perspective and orthographic", after.time));
            }
        }
        Ok(Self { keys })
    }

    /// The cameras that the path goes through.
    pub fn keys(&self) -> &[CameraKey] {
        &self.keys
    }

    /// The time from the first key to the last, in seconds.
    pub fn seconds(&self) -> f64 {
        self.keys[self.keys.len() - 1].time - self.keys[0].time
    }

    /// The camera `seconds` after the first key, clamped to both ends of the path.
    pub fn at(&self, seconds: f64) -> Camera {
        let time = self.keys[0].time + seconds;
        let next = self.keys.partition_point(|key| key.time <= time);
        if next == 0 || next == self.keys.len() {
            return self.keys[next.saturating_sub(1)].camera;
        }
        let (from, to) = (&self.keys[next - 1], &self.keys[next]);
        let duration = to.time - from.time;
        let share = (time - from.time) / duration;
        let velocities = [next - 1, next].map(|index| self.velocity(index) * duration);
        Camera {
            position: hermite([from.camera.position, to.camera.position], velocities, share),
            rotation: turned(from.camera.rotation, to.camera.rotation, share),
            projection: zoomed(&from.camera, &to.camera, share),
            ..from.camera
        }
    }

    /// The velocity at a key, in metres a second: from the key before it to the key after it, or along the single stretch beside the first or the
    /// last key.
    fn velocity(&self, index: usize) -> DVec3 {
        let (before, after) = (&self.keys[index.saturating_sub(1)], &self.keys[(index + 1).min(self.keys.len() - 1)]);
        (after.camera.position - before.camera.position) / (after.time - before.time)
    }

    /// Returns the path as the TOML that `file::load_path` reads; reading it gives the same path.
    pub fn to_toml(&self) -> String {
        let mut text = String::from("# A camera path: `afterlight render SCENE --path FILE` draws it.\n");
        for CameraKey { time, camera } in &self.keys {
            let (place, turn) = (camera.position.to_array(), camera.rotation.to_array());
            let _ = writeln!(text, "\n# --camera \"{camera}\"\n[[keys]]\ntime = {time:?}\nposition = {place:?}");
            let _ = write!(text, "rotation = {{ quaternion = {turn:?} }}\n{}", lens(&camera.projection));
        }
        text
    }
}

/// The line of a scene file or a path that tells a camera's lens.
pub(super) fn lens(projection: &Projection) -> String {
    match projection {
        Projection::Perspective { fov_y_degrees } => format!("fov_y_degrees = {fov_y_degrees:?}\n"),
        Projection::Orthographic { height } => format!("orthographic_height = {height:?}\n"),
    }
}

/// The cubic from one place to another that has these velocities there, in lengths of the stretch.
fn hermite([from, to]: [DVec3; 2], [leaving, arriving]: [DVec3; 2], share: f64) -> DVec3 {
    let (square, cube) = (share * share, share * share * share);
    // Written about `from`, so that a path far from the origin is as smooth as one at it.
    from + (to - from) * (3.0 * square - 2.0 * cube)
        + leaving * (cube - 2.0 * square + share)
        + arriving * (cube - square)
}

/// Part of the shorter way from one rotation to another.
fn turned(from: DQuat, to: DQuat, share: f64) -> DQuat {
    // A rotation and its negative are one.
    let to = if from.dot(to) < 0.0 { -to } else { to };
    from.slerp(to, share).normalize()
}

/// A lens between two of one kind.
fn zoomed(from: &Camera, to: &Camera, share: f64) -> Projection {
    if from.projection == to.projection {
        return from.projection;
    }
    let half_height = from.half_height() * (to.half_height() / from.half_height()).powf(share);
    match from.projection {
        Projection::Perspective { .. } => Projection::perspective(2.0 * half_height.atan().to_degrees()),
        Projection::Orthographic { .. } => Projection::orthographic(2.0 * half_height),
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn key(time: f64, position: DVec3) -> CameraKey {
        CameraKey { time, camera: Camera { position, ..Camera::default() } }
    }

    fn lens(time: f64, projection: Projection) -> CameraKey {
        CameraKey { time, camera: Camera { projection, ..Camera::default() } }
    }

    #[test]
    fn a_path_needs_two_keys_in_order_and_one_kind_of_projection() {
        let refused = |keys: Vec<CameraKey>, what: &str| {
            let error = CameraPath::new(keys).expect_err(what).to_string();
            assert!(error.starts_with("camera path: ") && error.contains(what), "{error}");
        };
        refused(vec![key(0.0, DVec3::ZERO)], "two keys");
        refused(vec![key(1.0, DVec3::ZERO), key(1.0, DVec3::X)], "not after");
        refused(vec![key(-1.0, DVec3::ZERO), key(1.0, DVec3::X)], "-1 s");
        refused(vec![key(0.0, DVec3::ZERO), key(f64::NAN, DVec3::X)], "NaN s");
        let flat = lens(1.0, Projection::orthographic(3.0));
        refused(vec![key(0.0, DVec3::ZERO), flat], "orthographic");
    }

    #[test]
    fn keys_on_a_line_make_a_line_at_an_even_speed_however_uneven_their_times() {
        let velocity = DVec3::new(1.0, -2.0, 0.5);
        let far = DVec3::splat(1e9);
        let keys = [0.0, 0.1, 3.0, 3.5, 10.0].map(|time| key(time + 2.0, far + velocity * time));
        let path = CameraPath::new(keys.to_vec()).unwrap();
        assert_eq!(path.seconds(), 10.0);
        for step in 0..=1000 {
            let seconds = f64::from(step) / 100.0;
            let off = path.at(seconds).position - (far + velocity * seconds);
            assert!(off.length() < 1e-6, "{seconds} {off}");
        }
        assert_eq!((path.at(-1.0), path.at(11.0)), (keys[0].camera, keys[4].camera));
    }

    #[test]
    fn rotations_take_the_shorter_way_and_lenses_grow_by_ratios() {
        let turn = |time: f64, degrees: f64, sign: f64| CameraKey {
            camera: Camera { rotation: DQuat::from_rotation_y(degrees.to_radians()) * sign, ..Camera::default() },
            ..key(time, DVec3::ZERO)
        };
        let path = CameraPath::new(vec![turn(0.0, 0.0, 1.0), turn(1.0, 90.0, -1.0)]).unwrap();
        let half = DQuat::from_rotation_y(std::f64::consts::FRAC_PI_4) * DVec3::NEG_Z;
        assert!((path.at(0.5).forward() - half).length() < 1e-12);
        let [near, far] = [2.0, 32.0].map(Projection::orthographic);
        let path = CameraPath::new(vec![lens(0.0, far), lens(1.0, near)]).unwrap();
        let Projection::Orthographic { height } = path.at(0.5).projection else { panic!("{:?}", path.at(0.5)) };
        assert!((height - 8.0).abs() < 1e-12);
    }

    proptest! {
        #[test]
        fn a_path_meets_its_keys_and_nowhere_jumps(
            steps in prop::collection::vec((0.01..2.0f64, -10.0..10.0f64, -10.0..10.0f64, 1.0..170.0f64), 2..8),
        ) {
            let mut time = 0.0;
            let keys: Vec<CameraKey> = steps.iter().map(|&(step, x, turn, fov)| {
                time += step;
                let rotation = DQuat::from_rotation_y(turn) * DQuat::from_rotation_x(x);
                let position = DVec3::new(x, turn, x * turn);
                let camera = Camera { position, rotation, projection: Projection::perspective(fov), ..Camera::default() };
                CameraKey { time, camera }
            }).collect();
            let path = CameraPath::new(keys.clone()).unwrap();
            for key in &keys {
                let seconds = key.time - keys[0].time;
                let (at, before) = (path.at(seconds), path.at(seconds - 1e-9));
                prop_assert!((at.position - key.camera.position).length() < 1e-6);
                prop_assert!((at.position - before.position).length() < 1e-4);
                prop_assert!((at.forward() - before.forward()).length() < 1e-4);
                prop_assert!((at.half_height() / before.half_height() - 1.0).abs() < 1e-4);
            }
        }
    }
}
