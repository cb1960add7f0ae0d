//! The camera under the hands of a user. Pure: held keys and passed time go in, a camera comes out.
//!
//! All motion is smooth and the same at any frame rate. Velocities exponentially approach the velocities of the held keys, as turns do the turns of
//! the mouse; time is taken in steps so short that turning while moving makes the same path as well.

use std::f64::consts::{FRAC_PI_2, TAU};

use glam::{DQuat, DVec3};

use afterlight::scene::{Aabb, Camera, ORTHOGRAPHIC_HEIGHT as HEIGHT, Projection, Scene};

/// The time constant of all easing, in seconds.
const EASING: f64 = 0.08;
/// The longest step of time that is taken at once, in seconds.
const STEP: f64 = 1.0 / 240.0;
/// The most time that a frame can have taken, in seconds: a program that was stopped does not leap when it goes on.
const LONGEST: f64 = 0.25;
/// The rest of a turn, in radians, or of a zoom, in e-folds, that is too small to be seen: the movement ends.
const SETTLED: f64 = 1e-5;
/// A turn by the mouse, in radians, for a drag by the height of the window.
const TURN: f64 = TAU / 3.0;
/// The steepest angle to which a camera turns up or down, in radians.
const STEEPEST: f64 = FRAC_PI_2 - 0.01;
/// Faster and nearer by this factor for each notch of the wheel.
const NOTCH: f64 = 1.15;
/// Factors of zoom a second while a key for forward or back is held down, of an orthographic camera: e-folds.
const ZOOM: f64 = 1.2;
/// The factor by which a user in a hurry moves faster.
const HURRY: f64 = 4.0;

/// The keys and buttons that are held down.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct HeldKeys {
    pub forward: bool,
    pub back: bool,
    pub left: bool,
    pub right: bool,
    pub up: bool,
    pub down: bool,
    /// All of it faster.
    pub hurry: bool,
}

impl HeldKeys {
    /// To the right, up, and forward: each from -1 to 1, together of length 1 at most.
    fn direction(self) -> DVec3 {
        let axis = |plus: bool, minus: bool| f64::from(i8::from(plus) - i8::from(minus));
        let all = DVec3::new(axis(self.right, self.left), axis(self.up, self.down), axis(self.forward, self.back));
        all.normalize_or_zero()
    }
}

/// The way that the mouse turns the camera.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NavigationMode {
    /// It looks around from where it stands.
    Fly,
    /// It goes around the place that it looks at.
    Orbit,
}

/// A camera, with the distance of the place that it goes around.
#[derive(Debug, Clone, Copy)]
struct Viewpoint {
    camera: Camera,
    reach: f64,
}

/// A camera, its motion, and the viewpoints that it knows.
#[derive(Debug, Clone)]
pub struct CameraControl {
    camera: Camera,
    first: Viewpoint,
    mode: NavigationMode,
    /// The middle of the scene's box.
    middle: DVec3,
    /// Half the diagonal of the scene's box, in metres.
    radius: f64,
    /// In the camera's axes, in metres a second; forward, in e-folds a second, for an orthographic camera.
    velocity: DVec3,
    /// The rest of the turn: to the left, and up, in radians.
    turn: [f64; 2],
    /// The rest of the zoom, in e-folds.
    zoom: f64,
    /// Metres a second.
    speed: f64,
    /// The distance of the orbit's centre ahead of the camera.
    reach: f64,
    bookmarks: [Option<Viewpoint>; 9],
}

/// Returns true if a camera looks at a model that stands alone: turning the camera in its place would lose the model from view. A camera in a room
/// or over a landscape is nearer to the scene's middle than the radius of its box. A fitted camera may be so near as well, where a part of its model
/// is far from the rest, but stands outside of the box.
fn stands_before(camera: &Camera, bounds: &Aabb, is_fitted: bool) -> bool {
    if bounds.is_empty() || !bounds.radius().is_finite() {
        return false;
    }
    let to_middle = bounds.center() - camera.position;
    let ahead = to_middle.dot(camera.forward());
    let aside = (to_middle - camera.forward() * ahead).length();
    let is_inside = camera.position.cmpge(bounds.min).all() && camera.position.cmple(bounds.max).all();
    let is_apart = if is_fitted { !is_inside } else { to_middle.length() > bounds.radius() };
    is_apart && ahead > 0.0 && aside <= camera.w(ahead) * camera.half_height()
}

impl CameraControl {
    /// Begins with this camera in a scene of these bounds, of which the speed depends.
    pub fn new(camera: Camera, bounds: &Aabb) -> Self {
        let radius = if bounds.is_empty() { 1.0 } else { bounds.radius() };
        let radius = if radius.is_finite() && radius > 0.0 { radius } else { 1.0 };
        let middle = if bounds.is_empty() { camera.position } else { bounds.center() };
        let mut new = Self {
            camera,
            first: Viewpoint { camera, reach: radius },
            mode: NavigationMode::Fly,
            middle,
            radius,
            velocity: DVec3::ZERO,
            turn: [0.0; 2],
            zoom: 0.0,
            speed: radius / 5.0,
            reach: radius,
            bookmarks: [None; 9],
        };
        new.reach = new.reach_of_middle();
        new.first.reach = new.reach;
        new
    }

    /// Begins with the scene's camera: in an orbit where all that is drawn stands before it, as a single model does, and else in flight.
    pub fn of_scene(scene: &Scene) -> Self {
        let bounds = scene.model_bounds();
        let is_alone = stands_before(&scene.camera, &bounds, scene.fitted.camera);
        let mode = if is_alone { NavigationMode::Orbit } else { NavigationMode::Fly };
        Self { mode, ..Self::new(scene.camera, &bounds) }
    }

    /// Begins again with the camera of a scene that was read again. Bookmarks stay.
    pub fn begin_again(&self, scene: &Scene) -> Self {
        Self { bookmarks: self.bookmarks, ..Self::of_scene(scene) }
    }

    /// The distance at which the scene's middle lies ahead, or a short one where that is behind.
    fn reach_of_middle(&self) -> f64 {
        (self.middle - self.camera.position).dot(self.camera.forward()).max(self.least_reach())
    }

    /// The least distance that an orbit begins with, or is gone to by keys.
    fn least_reach(&self) -> f64 {
        self.radius / 10.0
    }

    pub fn camera(&self) -> &Camera {
        &self.camera
    }

    pub fn mode(&self) -> NavigationMode {
        self.mode
    }

    /// The speed that keys move at, in metres a second, where the wheel changes that.
    pub fn flying_speed(&self) -> Option<f64> {
        let is_flying =
            matches!(self.camera.projection, Projection::Perspective { .. }) && self.mode == NavigationMode::Fly;
        is_flying.then_some(self.speed)
    }

    /// Returns true if the next frame would be another one.
    pub fn is_moving(&self, held: HeldKeys) -> bool {
        held.direction() != DVec3::ZERO || self.velocity != DVec3::ZERO || self.turn != [0.0; 2] || self.zoom != 0.0
    }

    /// Turns by a drag of the mouse to the right and down, in parts of the window's height. In flight the view follows the mouse, and in an orbit the
    /// scene does.
    pub fn drag(&mut self, right: f64, down: f64) {
        self.turn[0] -= right * TURN;
        self.turn[1] -= down * TURN;
    }

    /// The wheel was turned, away from the user: faster in flight, nearer in an orbit, and larger of an orthographic camera.
    pub fn wheel(&mut self, notches: f64) {
        match (self.camera.projection, self.mode) {
            (Projection::Perspective { .. }, NavigationMode::Fly) => {
                self.speed = (self.speed * NOTCH.powf(notches)).clamp(1e-9, 1e12);
            }
            _ => self.zoom += notches * NOTCH.ln(),
        }
    }

    /// Changes from flight to orbit, or back. The orbit's centre is as far ahead as the scene's middle is now.
    pub fn toggle_orbit(&mut self) {
        self.mode = match self.mode {
            NavigationMode::Fly => {
                self.reach = self.reach_of_middle();
                NavigationMode::Orbit
            }
            NavigationMode::Orbit => NavigationMode::Fly,
        };
    }

    /// Back to where it began.
    pub fn reset(&mut self) {
        self.go(self.first);
    }

    /// Keeps this place under a number from 0 to 8.
    pub fn bookmark(&mut self, number: usize) {
        if let Some(place) = self.bookmarks.get_mut(number) {
            *place = Some(Viewpoint { camera: self.camera, reach: self.reach });
        }
    }

    /// Goes to the place of that number. False if there is none.
    pub fn recall(&mut self, number: usize) -> bool {
        let found = self.bookmarks.get(number).copied().flatten();
        found.map(|place| self.go(place)).is_some()
    }

    /// Goes to a viewpoint, with its distance: after a zoom the camera would otherwise go around another place.
    fn go(&mut self, Viewpoint { camera, reach }: Viewpoint) {
        (self.camera, self.reach) = (camera, reach);
        (self.velocity, self.turn, self.zoom) = (DVec3::ZERO, [0.0; 2], 0.0);
    }

    /// Advances the motion by a time in seconds.
    pub fn advance(&mut self, seconds: f64, held: HeldKeys) {
        let seconds = if seconds.is_finite() { seconds.clamp(0.0, LONGEST) } else { 0.0 };
        let steps = (seconds / STEP).ceil().max(1.0);
        for _ in 0..steps as usize {
            self.step(seconds / steps, held);
        }
    }

    fn step(&mut self, seconds: f64, held: HeldKeys) {
        let kept = (-seconds / EASING).exp();
        self.turn(kept);
        // The exact solution of a velocity that nears the wanted one, for any step.
        let wanted = self.wanted(held);
        let gained = (self.velocity - wanted) * (1.0 - kept) * EASING;
        let moved = wanted * seconds + gained;
        self.velocity = wanted + (self.velocity - wanted) * kept;
        if wanted == DVec3::ZERO && self.velocity.length() < self.speed * 1e-3 {
            self.velocity = DVec3::ZERO;
        }
        let zoomed = self.zoom * (1.0 - kept);
        self.zoom -= zoomed;
        if self.zoom.abs() < SETTLED {
            self.zoom = 0.0;
        }
        self.go_on(moved, zoomed);
    }

    /// The velocity that is asked for.
    fn wanted(&self, held: HeldKeys) -> DVec3 {
        let direction = held.direction() * if held.hurry { HURRY } else { 1.0 };
        match self.camera.projection {
            Projection::Perspective { .. } => direction * self.speed,
            // The speed is a share of the picture, whatever its size in metres.
            Projection::Orthographic { height } => {
                DVec3::new(direction.x * height, direction.y * height, direction.z) * ZOOM
            }
        }
    }

    /// Moves in the camera's axes, and zooms by e-folds.
    fn go_on(&mut self, moved: DVec3, zoomed: f64) {
        let (right, up, forward) = (self.camera.right(), self.camera.up(), self.camera.forward());
        let aside = right * moved.x + up * moved.y;
        match &mut self.camera.projection {
            Projection::Perspective { .. } => {
                let nearer = self.reach * (1.0 - (-zoomed).exp());
                self.camera.position += aside + forward * (moved.z + nearer);
                self.reach -= nearer;
                if self.mode == NavigationMode::Orbit {
                    // Keys that move nearer leave the orbit's centre in place until the camera has reached it.
                    let least = self.least_reach().min(self.reach);
                    self.reach = (self.reach - moved.z).max(least);
                }
            }
            Projection::Orthographic { height } => {
                self.camera.position += aside;
                *height = (*height * (-zoomed - moved.z).exp()).clamp(*HEIGHT.start(), *HEIGHT.end());
            }
        }
    }

    /// Turns by the outstanding angles, less the share `kept`, which stays outstanding.
    fn turn(&mut self, kept: f64) {
        if self.turn == [0.0; 2] {
            return;
        }
        let [left, up] = self.turn.map(|rest| if rest.abs() < SETTLED { rest } else { rest * (1.0 - kept) });
        self.turn = [self.turn[0] - left, self.turn[1] - up];
        let pivot = self.camera.position + self.camera.forward() * self.reach;
        let pitch = self.camera.forward().y.clamp(-1.0, 1.0).asin();
        // A camera that begins steeper than the limit does not get steeper.
        let up = (pitch + up).clamp((-STEEPEST).min(pitch), STEEPEST.max(pitch)) - pitch;
        // About the world's vertical and the camera's own horizontal: the camera keeps its roll.
        let rotation = DQuat::from_rotation_y(left) * self.camera.rotation * DQuat::from_rotation_x(up);
        self.camera.rotation = rotation.normalize();
        if self.mode == NavigationMode::Orbit {
            self.camera.position = pivot - self.camera.forward() * self.reach;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bounds() -> Aabb {
        Aabb::of_points([DVec3::splat(-10.0), DVec3::splat(10.0)])
    }

    fn control() -> CameraControl {
        CameraControl::new(Camera { position: DVec3::new(0.0, 0.0, 20.0), ..Camera::default() }, &bounds())
    }

    fn orthographic() -> CameraControl {
        let projection = Projection::orthographic(4.0);
        CameraControl::new(Camera { projection, ..*control().camera() }, &bounds())
    }

    const FORWARD: HeldKeys =
        HeldKeys { forward: true, back: false, left: false, right: false, up: false, down: false, hurry: false };

    /// Two seconds at a frame rate: forward for one of them, with a drag of the mouse at each tenth of a second, and then to the left.
    fn path(mut control: CameraControl, rate: u32) -> Camera {
        for frame in 0..2 * rate {
            if frame % (rate / 10) == 0 && frame < rate {
                control.drag(0.05, 0.02);
            }
            let held = if frame < rate { FORWARD } else { HeldKeys { left: true, ..HeldKeys::default() } };
            control.advance(1.0 / f64::from(rate), held);
        }
        *control.camera()
    }

    #[test]
    fn the_same_hands_make_the_same_path_at_any_frame_rate() {
        for orbit in [false, true] {
            for mut control in [control(), orthographic()] {
                if orbit {
                    control.toggle_orbit();
                }
                let often = path(control.clone(), 240);
                let gone = (often.position - control.camera().position).length();
                for rate in [30, 60, 120] {
                    let camera = path(control.clone(), rate);
                    let apart = (camera.position - often.position).length();
                    assert!(apart < 0.01 * gone, "{rate} Hz ends {apart} m off a path of {gone} m");
                    assert!(camera.rotation.angle_between(often.rotation) < 0.002, "{rate} Hz looks elsewhere");
                    let zoom = camera.half_height() / often.half_height();
                    assert!((zoom - 1.0).abs() < 1e-9, "{rate} Hz zooms by {zoom}");
                }
            }
        }
    }

    #[test]
    fn motion_eases_in_and_out_and_then_nothing_is_drawn() {
        let mut control = control();
        control.advance(0.01, FORWARD);
        assert!(control.velocity.z < control.speed * 0.2, "it does not start at once");
        control.advance(0.25, FORWARD);
        assert!(control.is_moving(HeldKeys::default()));
        for _ in 0..20 {
            control.advance(0.1, HeldKeys::default());
        }
        assert!(!control.is_moving(HeldKeys::default()) && control.is_moving(FORWARD));
        let rest = *control.camera();
        control.advance(1.0, HeldKeys::default());
        assert_eq!(*control.camera(), rest);
    }

    #[test]
    fn a_long_pause_is_no_leap() {
        let mut control = control();
        control.advance(3600.0, FORWARD);
        assert!((control.camera().position.z - 20.0).abs() <= control.speed * LONGEST);
        control.advance(f64::NAN, FORWARD);
        assert!(control.camera().position.is_finite());
    }

    #[test]
    fn an_orbit_keeps_its_distance_and_its_middle_in_view() {
        let mut control = control();
        control.toggle_orbit();
        for _ in 0..50 {
            control.drag(0.1, 0.0);
            control.advance(0.02, HeldKeys::default());
            let camera = control.camera();
            assert!((camera.position.length() - 20.0).abs() < 1e-9, "{}", camera.position);
            assert!((camera.forward() + camera.position.normalize()).length() < 1e-9);
        }
        control.wheel(10.0);
        (0..50).for_each(|_| control.advance(0.1, HeldKeys::default()));
        let nearer = control.camera().position.length();
        assert!((nearer - 20.0 / NOTCH.powi(10)).abs() < 0.01, "{nearer}");
    }

    /// The scene's middle is at the middle of the picture still after this turn.
    fn turns_around_the_middle(mut control: CameraControl, what: &str) {
        for _ in 0..5 {
            control.drag(0.13, 0.07);
            (0..30).for_each(|_| control.advance(0.05, HeldKeys::default()));
            let to_middle = -control.camera().position.normalize();
            let off = control.camera().forward().angle_between(to_middle);
            assert!(off < 1e-6, "{what}: {off} radians off");
        }
    }

    #[test]
    fn an_orbit_is_around_the_middle_after_keys_a_zoom_a_reset_and_a_kept_place() {
        let mut orbit = control();
        orbit.toggle_orbit();
        turns_around_the_middle(orbit.clone(), "at first");
        let mut nearer = orbit.clone();
        nearer.advance(0.2, FORWARD);
        (0..20).for_each(|_| nearer.advance(0.1, HeldKeys::default()));
        assert!(nearer.camera().position.z < 19.5, "W goes nearer");
        turns_around_the_middle(nearer.clone(), "after W");
        nearer.bookmark(3);
        nearer.wheel(12.0);
        (0..50).for_each(|_| nearer.advance(0.1, HeldKeys::default()));
        turns_around_the_middle(nearer.clone(), "after the wheel");
        assert!(nearer.recall(3));
        turns_around_the_middle(nearer.clone(), "at a kept place");
        nearer.wheel(12.0);
        (0..50).for_each(|_| nearer.advance(0.1, HeldKeys::default()));
        nearer.reset();
        turns_around_the_middle(nearer, "after a reset");
        let mut flown = control();
        flown.advance(0.25, FORWARD);
        (0..20).for_each(|_| flown.advance(0.1, HeldKeys::default()));
        flown.toggle_orbit();
        turns_around_the_middle(flown, "after a flight");
        // Through the centre, if a key is held so long, and not stuck before it.
        (0..100).for_each(|_| orbit.advance(0.25, FORWARD));
        assert!(orbit.camera().position.z < -10.0 && orbit.reach > 0.0, "{}", orbit.camera().position);
    }

    #[test]
    fn a_model_that_stands_alone_is_gone_around_and_a_place_is_flown_through() {
        use afterlight::scene::{OpenOptions, open};
        let mode = |scene: &Scene| CameraControl::of_scene(scene).mode();
        let hall = open("builtin:hall", &OpenOptions::default()).expect("is built in");
        assert_eq!(mode(&hall), NavigationMode::Fly, "inside");
        let folder = tempfile::tempdir().expect("a temporary folder");
        let model = folder.path().join("model.obj");
        std::fs::write(&model, "v -1 0 0\nv 1 0 0\nv 0 2 1\nf 1 2 3\nf 1 3 2\n").expect("a file");
        let mut alone = open(model.to_str().expect("UTF-8"), &OpenOptions::default()).expect("a model");
        assert_eq!(mode(&alone), NavigationMode::Orbit, "a fitted camera");
        // Beside it, and turned away.
        alone.fitted.camera = false;
        let at = |position: DVec3, target: DVec3| Camera {
            projection: Projection::perspective(50.0),
            ..Camera::looking_at(position, target, DVec3::Y)
        };
        let middle = alone.bounds().center();
        for (camera, expected) in [
            (at(DVec3::new(0.0, 1.0, 6.0), middle), NavigationMode::Orbit),
            (at(DVec3::new(0.0, 1.0, 6.0), DVec3::new(0.0, 1.0, 12.0)), NavigationMode::Fly),
            (at(DVec3::new(0.0, 1.0, 6.0), DVec3::new(6.0, 1.0, 6.0)), NavigationMode::Fly),
            (at(DVec3::new(0.1, 2.2, 0.6), middle), NavigationMode::Fly),
        ] {
            alone.camera = camera;
            assert_eq!(mode(&alone), expected, "from {} along {}", camera.position, camera.forward());
        }
        assert_eq!(mode(&Scene::default()), NavigationMode::Fly, "nothing");
    }

    #[test]
    fn an_orthographic_camera_zooms_by_its_height_and_stays_where_it_is() {
        let mut control = orthographic();
        control.wheel(5.0);
        (0..50).for_each(|_| control.advance(0.1, HeldKeys::default()));
        let height = control.camera().half_height() * 2.0;
        assert!((height - 4.0 / NOTCH.powi(5)).abs() < 1e-3, "{height}");
        (0..20).for_each(|_| control.advance(0.1, FORWARD));
        assert!(control.camera().half_height() * 2.0 < height / 5.0, "forward goes nearer");
        assert_eq!(control.camera().position, DVec3::new(0.0, 0.0, 20.0));
        control.wheel(-1e6);
        (0..500).for_each(|_| control.advance(0.1, HeldKeys::default()));
        assert!(HEIGHT.contains(&(control.camera().half_height() * 2.0)));
    }

    #[test]
    fn looking_up_ends_before_the_zenith() {
        let mut control = control();
        control.drag(0.0, -10.0);
        (0..100).for_each(|_| control.advance(0.1, HeldKeys::default()));
        let pitch = control.camera().forward().y.asin();
        assert!((pitch - STEEPEST).abs() < 1e-6 && !control.is_moving(HeldKeys::default()), "{pitch}");
        assert!(control.camera().up().y > 0.0, "not turned over");
    }

    #[test]
    fn bookmarks_and_reset_go_exactly_there() {
        let mut control = control();
        assert!(!control.recall(0) && !control.recall(99));
        control.advance(0.2, FORWARD);
        let kept = *control.camera();
        control.bookmark(0);
        control.drag(0.3, 0.1);
        control.advance(0.2, FORWARD);
        assert!(control.recall(0));
        assert_eq!(*control.camera(), kept);
        assert!(!control.is_moving(HeldKeys::default()), "it stands still there");
        control.reset();
        assert_eq!(*control.camera(), control.first.camera);
    }

    #[test]
    fn the_wheel_changes_the_speed_of_flight_within_reason() {
        let mut control = control();
        let speed = control.speed;
        control.wheel(2.0);
        assert!((control.speed / speed - NOTCH * NOTCH).abs() < 1e-12);
        control.wheel(-1e9);
        control.wheel(1e9);
        assert!(control.speed.is_finite() && control.speed > 0.0);
    }
}
