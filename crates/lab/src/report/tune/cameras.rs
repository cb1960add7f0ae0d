//! Cameras that a choice is verified from: moved and turned within the scene, so that something is seen. No device is asked: rays of the
//! reference find the room for a camera and the objects in view.
//!
//! A camera goes towards something that the scene's own camera sees, along a ray that nothing blocks, so that it cannot come to stand inside a wall;
//! then it turns. The way and the turn follow only from the camera's index in a sequence: the same scene has the same cameras.

use std::collections::BTreeSet;

use glam::{DQuat, DVec2, DVec3};

use afterlight::scene::{Camera, CameraPath, Projection};
use afterlight_truth::reference::{CameraView, Reference};

/// Rays across and down that sample a camera's view.
const GRID: [u32; 2] = [16, 9];
/// Cameras that are tried for each that is wanted.
const TRIES: u32 = 64;
/// The least part of the picture that must be surfaces, relative to the picture of the scene's own camera.
const LEAST_SEEN: f64 = 0.6;
/// The least number of different objects in view, relative to the view of the scene's own camera: a bare floor tells little.
const LEAST_OBJECTS: f64 = 0.5;
/// A surface nearer than this share of the usual distance is in the way; at most the second share of the rays may end at one.
const IN_THE_WAY: f64 = 0.15;
const MOST_IN_THE_WAY: f64 = 0.3;
/// Two cameras differ if they are turned by this many degrees or stand apart by this share of the usual distance.
const LEAST_TURN_DEGREES: f64 = 15.0;
const LEAST_MOVE: f64 = 0.15;

/// The surfaces that a camera sees.
struct VisibleSurfaces {
    /// Relative to it, in metres: where each ray ends that meets a surface.
    hits: Vec<DVec3>,
    /// Share of the rays that meet one.
    seen: f64,
    /// The number of different objects.
    objects: usize,
}

impl VisibleSurfaces {
    fn of(reference: &Reference, view: &CameraView) -> Self {
        let size = DVec2::new(f64::from(view.size[0]), f64::from(view.size[1]));
        let grid = DVec2::new(f64::from(GRID[0]), f64::from(GRID[1]));
        let places =
            (0..GRID[0] * GRID[1]).map(|index| DVec2::new(f64::from(index % GRID[0]), f64::from(index / GRID[0])));
        let met = places.filter_map(|place| reference.surface(view, (place + 0.5) / grid * size));
        let (hits, objects): (Vec<DVec3>, BTreeSet<u32>) =
            met.map(|(surface, triangle, _)| (surface.position, triangle.object)).unzip();
        Self { seen: hits.len() as f64 / (grid.x * grid.y), hits, objects: objects.len() }
    }

    /// The median of the distances.
    fn usual(&self) -> f64 {
        let mut distances: Vec<f64> = self.hits.iter().map(|hit| hit.length()).collect();
        distances.sort_by(f64::total_cmp);
        distances.get(distances.len() / 2).copied().unwrap_or(0.0)
    }

    /// Share of the rays that end near the camera.
    fn in_the_way(&self, usual: f64) -> f64 {
        let near = self.hits.iter().filter(|hit| hit.length() < IN_THE_WAY * usual).count();
        near as f64 / self.hits.len().max(1) as f64
    }
}

/// A camera that the settings were not chosen with.
#[derive(Debug, Clone, PartialEq)]
pub struct HeldOutCamera {
    /// The camera itself.
    pub camera: Camera,
    /// The camera as `--camera` takes it.
    pub text: String,
}

/// Moments of a path, spread evenly from its start to its end, in seconds from the start: the one in the middle first, from which settings are
/// chosen, and then the others in order.
pub fn moments(path: &CameraPath, count: usize) -> Vec<(f64, HeldOutCamera)> {
    let last = count.max(2) - 1;
    let mut moments: Vec<(f64, HeldOutCamera)> = (0..=last)
        .map(|index| {
            let seconds = path.seconds() * index as f64 / last as f64;
            let camera = path.at(seconds);
            (seconds, HeldOutCamera { camera, text: camera.to_string() })
        })
        .collect();
    moments[..=last / 2].rotate_right(1);
    moments
}

/// Up to `count` cameras; fewer where the scene has no room for more, as where the camera sees nothing.
pub fn held_out(reference: &Reference, view: &CameraView, count: usize) -> Vec<HeldOutCamera> {
    let own = VisibleSurfaces::of(reference, view);
    let usual = own.usual();
    let mut found: Vec<HeldOutCamera> = Vec::new();
    if own.hits.is_empty() {
        return found;
    }
    for index in 0..TRIES * count as u32 {
        if found.len() == count {
            break;
        }
        let Some(HeldOutCamera { camera, text }) = candidate(view, &own, index) else { continue };
        let others = std::iter::once(&view.camera).chain(found.iter().map(|other| &other.camera));
        let is_new = others.into_iter().all(|other| differ(other, &camera, usual));
        if !is_new {
            continue;
        }
        let sight = VisibleSurfaces::of(reference, &CameraView { camera, ..*view });
        let is_full = sight.seen >= LEAST_SEEN * own.seen && sight.objects as f64 >= LEAST_OBJECTS * own.objects as f64;
        if is_full && sight.in_the_way(usual) <= MOST_IN_THE_WAY {
            found.push(HeldOutCamera { camera, text });
        }
    }
    found
}

/// One of the sequence: how far towards which hit, and turned by how much, by additive recurrence of the plastic number's powers.
fn candidate(view: &CameraView, own: &VisibleSurfaces, index: u32) -> Option<HeldOutCamera> {
    let share = |step: f64| (0.5 + step * f64::from(index + 1)).fract();
    let [target, way, yaw, pitch] = [0.856_674_883_8, 0.733_891_856_6, 0.628_706_721_0, 0.538_597_257_2].map(share);
    let hit = *own.hits.get((target * own.hits.len() as f64) as usize)?;
    let camera = &view.camera;
    // Up to about half of the way: beyond it a surface that was far away fills the picture.
    let position = camera.position + hit * (0.1 + 0.4 * way);
    let yaw = DQuat::from_rotation_y(((yaw - 0.5) * 140.0).to_radians());
    let pitch = DQuat::from_rotation_x(((pitch - 0.5) * 20.0).to_radians());
    let forward = yaw * (camera.rotation * (pitch * DVec3::NEG_Z));
    // Through its text, so that a camera that is typed from a report is exactly this one.
    let text = text_of(position, position + forward * own.usual().max(camera.near), camera.projection);
    let parsed: Camera = text.parse().ok()?;
    Some(HeldOutCamera { camera: Camera { near: camera.near, ..parsed }, text })
}

fn differ(a: &Camera, b: &Camera, usual: f64) -> bool {
    let turned = a.forward().angle_between(b.forward()).to_degrees();
    turned >= LEAST_TURN_DEGREES || a.position.distance(b.position) >= LEAST_MOVE * usual
}

/// Five digits behind the point: of metres, far less than a pixel.
fn text_of(position: DVec3, target: DVec3, projection: Projection) -> String {
    let lens = match projection {
        Projection::Perspective { fov_y_degrees } => short(fov_y_degrees),
        Projection::Orthographic { height } => format!("{height}m"),
    };
    let point = |point: DVec3| point.to_array().map(short).join(",");
    format!("{}/{}/{lens}", point(position), point(target))
}

fn short(number: f64) -> String {
    let text = format!("{number:.5}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".to_owned() } else { text.to_owned() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use afterlight::scene::{CameraKey, OpenOptions, Scene, open};

    fn scene(spec: &str) -> Scene {
        open(spec, &OpenOptions::default()).expect("a built-in scene")
    }

    fn view(scene: &Scene) -> CameraView {
        CameraView { camera: scene.camera, size: [320, 180] }
    }

    #[test]
    #[ignore = "test-all: rays from many cameras"]
    fn cameras_stand_elsewhere_and_see_something() {
        for spec in ["builtin:hall", "builtin:cornell", "builtin:spheres", "builtin:field"] {
            let scene = scene(spec);
            let (reference, view) = (Reference::new(&scene).expect("a scene"), view(&scene));
            let cameras = held_out(&reference, &view, 3);
            assert_eq!(cameras.len(), 3, "{spec}");
            let own = VisibleSurfaces::of(&reference, &view);
            let cameras: Vec<Camera> = cameras.into_iter().map(|elsewhere| elsewhere.camera).collect();
            for (index, camera) in cameras.iter().enumerate() {
                let sight = VisibleSurfaces::of(&reference, &CameraView { camera: *camera, ..view });
                assert!(sight.objects * 2 >= own.objects, "{spec} {index}: {} of {}", sight.objects, own.objects);
                assert!(sight.seen >= LEAST_SEEN * own.seen, "{spec} {index}: {} of {}", sight.seen, own.seen);
                let others = std::iter::once(&view.camera).chain(&cameras[..index]);
                assert!(others.into_iter().all(|other| differ(other, camera, own.usual())), "{spec} {index}");
            }
        }
    }

    #[test]
    fn nothing_lies_between_the_scenes_camera_and_the_others() {
        let scene = scene("builtin:hall");
        let (reference, view) = (Reference::new(&scene).expect("a scene"), view(&scene));
        for HeldOutCamera { camera, .. } in held_out(&reference, &view, 3) {
            let way = camera.position - view.camera.position;
            let towards = Camera::looking_at(view.camera.position, camera.position, DVec3::Y);
            let towards = CameraView { camera: Camera { near: view.camera.near, ..towards }, size: [3, 3] };
            let hit = reference.surface(&towards, DVec2::splat(1.5));
            assert!(hit.is_none_or(|(surface, ..)| surface.position.length() > way.length()));
        }
    }

    #[test]
    fn the_same_scene_has_the_same_cameras_and_they_can_be_told() {
        let scene = scene("builtin:cornell");
        let view = view(&scene);
        let cameras = held_out(&Reference::new(&scene).expect("a scene"), &view, 3);
        assert_eq!(cameras, held_out(&Reference::new(&scene).expect("a scene"), &view, 3));
        for HeldOutCamera { camera, text } in cameras {
            let told: Camera = text.parse().expect("as --camera takes it");
            assert_eq!(Camera { near: camera.near, ..told }, camera);
        }
    }

    #[test]
    fn moments_of_a_path_begin_with_its_middle_and_have_both_ends() {
        let key = |time: f64| CameraKey { time, camera: Camera { position: DVec3::X * time, ..Camera::default() } };
        let path = CameraPath::new(vec![key(1.0), key(5.0)]).expect("a path");
        let seconds = |count| moments(&path, count).iter().map(|(seconds, _)| *seconds).collect::<Vec<_>>();
        assert_eq!(seconds(5), [2.0, 0.0, 1.0, 3.0, 4.0]);
        assert_eq!((seconds(2), seconds(3)), (vec![0.0, 4.0], vec![2.0, 0.0, 4.0]));
        for (seconds, elsewhere) in moments(&path, 4) {
            assert_eq!(elsewhere.camera, path.at(seconds));
            let told: Camera = elsewhere.text.parse().expect("as --camera takes it");
            assert!((told.position - elsewhere.camera.position).length() < 1e-4, "{}", elsewhere.text);
        }
    }

    #[test]
    fn a_camera_that_sees_nothing_has_no_others() {
        let scene = scene("builtin:spheres");
        let mut view = view(&scene);
        view.camera = Camera::looking_at(DVec3::new(0.0, 1e4, 0.0), DVec3::new(0.0, 2e4, 0.0), DVec3::X);
        assert_eq!(held_out(&Reference::new(&scene).expect("a scene"), &view, 3), []);
    }
}
