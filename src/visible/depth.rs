//! The eye of a frame, and the mapping from distances along the view to depths. Depth is reversed: 1 is near, and 0 is where nothing was drawn.

use super::World;
use crate::plan::FramePlan;
use crate::scene::{Aabb, Camera, LightPath};

/// The camera of a frame, and its distance in front of the camera that was asked for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Eye {
    pub camera: Camera,
    /// Metres along the view.
    pub ahead: f64,
}

impl Eye {
    /// Places are relative to the eye, in f32: the farther away, the coarser. Parallel rays show the same from anywhere along them, so an
    /// orthographic camera is moved towards the scene as far as nothing lies between. A perspective camera stays.
    pub fn of(camera: &Camera, bounds: &Aabb) -> Self {
        let mut eye = Self { camera: *camera, ahead: 0.0 };
        if !camera.is_orthographic() || bounds.is_empty() {
            return eye;
        }
        let (first, last) = along(bounds, camera);
        // As much room as there is behind, and never so little that it is a rounding of the way.
        let room = (last - first).max(1e-6 * first.abs());
        eye.ahead = (first - camera.near - room).max(0.0);
        eye.camera.position += camera.forward() * eye.ahead;
        eye
    }
}

/// Returns the begin and the end of a box along a camera's view, in metres.
fn along(bounds: &Aabb, camera: &Camera) -> (f64, f64) {
    let middle = (bounds.center() - camera.position).dot(camera.forward());
    let half = camera.forward().abs().dot(bounds.size() * 0.5);
    (middle - half, middle + half)
}

/// Margin of an orthographic depth before and behind the scene, as a share of its range: the scene's ends have depths between 0 and 1.
const ROOM: f64 = 1e-3;

/// The farthest that a volume's mesh extends, in multiples of the light's reach: corners of an icosahedron around a sphere, the base of a cone of
/// 60 degrees.
const VOLUME: f64 = 2.0;

/// Two ways from distances to depths.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum DepthMapping {
    /// A perspective camera's mapping: near / distance, without a far plane.
    Reciprocal { near: f64 },
    /// An orthographic camera's mapping, as its clip space has no division: (end - distance) / (end - begin).
    Linear { begin: f64, end: f64 },
}

impl DepthMapping {
    /// A linear mapping spans the nearest to the farthest object in front of the camera.
    pub(super) fn of(world: &World, plan: &FramePlan, camera: &Camera) -> Self {
        if !camera.is_orthographic() {
            return Self::Reciprocal { near: camera.near };
        }
        let bounds = world.drawn_bounds(plan);
        let (first, mut last) = if bounds.is_empty() { (0.0, 0.0) } else { along(&bounds, camera) };
        // The backs of volumes are drawn, too.
        if plan.light_path == LightPath::Volumes {
            let bounded = world.lights.iter().zip(&world.reaches).filter(|(_, reach)| reach.is_finite());
            let backs = bounded.filter_map(|(light, &reach)| {
                let form = light.kind.form();
                Some((form.place? - camera.position).dot(camera.forward()) + VOLUME * form.extent(reach))
            });
            last = backs.fold(last, f64::max);
        }
        let begin = camera.near.max(first);
        // The range is never empty, so that depths can be computed from it.
        let range = (last - begin).max(1e-3 * begin);
        Self::Linear { begin: camera.near.max(begin - ROOM * range), end: begin + range * (1.0 + ROOM) }
    }

    /// The depth of a distance along the view, in metres.
    pub fn of_distance(&self, distance: f64) -> f64 {
        match *self {
            Self::Reciprocal { near } => near / distance,
            Self::Linear { begin, end } => (end - distance) / (end - begin),
        }
    }

    /// The distance along the view of a depth, in metres.
    pub fn distance(&self, depth: f64) -> f64 {
        match *self {
            Self::Reciprocal { near } => near / depth,
            Self::Linear { begin, end } => begin + (1.0 - depth) * (end - begin),
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;
    use proptest::prelude::*;

    use super::*;
    use crate::plan::samples::{self, vector};
    use crate::scene::{Material, Projection, Settings};

    fn flat(position: DVec3, target: DVec3) -> Camera {
        Camera { projection: Projection::orthographic(2.0), ..Camera::looking_at(position, target, DVec3::Y) }
    }

    proptest! {
        #[test]
        fn an_eye_has_all_that_its_camera_has_before_it_and_is_no_farther_from_it_than_it_is_deep(
            low in vector(9.0), size in [0.0..5.0f64, 0.0..5.0, 0.0..5.0], toward in vector(1.0), log_distance in -2.0..9.0f64,
        ) {
            prop_assume!(toward.length() > 0.1);
            let bounds = Aabb { min: low, max: low + DVec3::from(size) };
            let distance = 10f64.powf(log_distance);
            let camera = flat(bounds.center() - toward.normalize() * distance, bounds.center());
            let eye = Eye::of(&camera, &bounds);
            prop_assert!(eye.ahead >= 0.0);
            // The rounding of two positions that far from the origin, and of the vector between them.
            let rounding = 4e-15 * (distance + 10.0);
            let moved = eye.camera.position - camera.position;
            prop_assert!((moved.dot(camera.forward()) - eye.ahead).abs() <= rounding && moved.cross(camera.forward()).length() <= rounding);
            let (first, last) = along(&bounds, &eye.camera);
            // The near plane clips nothing that it did not clip before, and a scene that was far away is near.
            prop_assert!(eye.ahead == 0.0 || first > camera.near);
            prop_assert!(first <= camera.near + (last - first) + 2e-6 * distance, "{first} {last}");
            let perspective = Camera { projection: Projection::perspective(40.0), ..camera };
            prop_assert_eq!(Eye::of(&perspective, &bounds), Eye { camera: perspective, ahead: 0.0 });
        }

        #[test]
        fn depths_of_all_that_there_is_lie_between_0_and_1_and_tell_their_distances(
            position in vector(9.0), target in vector(2.0), share in 0.0..=1.0f64,
        ) {
            prop_assume!(position.distance(target) > 0.1);
            let camera = flat(position, target);
            let scene = crate::scene::Scene { camera, ..samples::scene(vec![Material::default(); 3], vec![samples::sun()]) };
            let settings = Settings::default();
            let plan = samples::plan(&scene, &settings);
            let world = World::of(&scene, &settings, &plan, 1.0);
            let (first, last) = along(&world.bounds, &camera);
            let distance = first + (last - first) * share;
            let depth = DepthMapping::of(&world, &plan, &camera);
            let own = depth.of_distance(distance);
            prop_assert!(distance < camera.near || (own > 0.0 && own <= 1.0), "{own}");
            prop_assert!((depth.distance(own) - distance).abs() < 1e-12 * (1.0 + distance.abs()));
        }
    }
}
