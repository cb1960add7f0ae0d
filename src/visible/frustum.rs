//! The part of space that a camera sees.

use glam::{DVec2, DVec3, Vec4};

use crate::plan::Reach;
use crate::plan::box_tree::Containment;
use crate::scene::{Aabb, Camera};

/// The planes of a view volume without far plane; normals point inside.
pub struct Frustum {
    planes: [(DVec3, f64); 5],
}

impl Frustum {
    pub fn of(camera: &Camera, aspect: f64) -> Self {
        let half_y = camera.half_height();
        let half_x = half_y * aspect;
        let (forward, right, up) = (camera.forward(), camera.right(), camera.up());
        let DVec2 { x, y } = camera.shift;
        // Across the picture a side is `half` away from the axis, times w: a plane through the camera, or one beside it.
        let side = |outwards: DVec3, half: f64| {
            let (along, beside) = (half * (camera.w(1.0) - camera.w(0.0)), half * camera.w(0.0));
            let (normal, length) = (forward * along - outwards, along.hypot(1.0));
            (normal / length, beside / length - normal.dot(camera.position) / length)
        };
        let near = (forward, -forward.dot(camera.position) - camera.near);
        Self {
            planes: [
                near,
                side(right, half_x + x),
                side(-right, half_x - x),
                side(up, half_y + y),
                side(-up, half_y - y),
            ],
        }
    }

    /// The planes relative to a place, in f32.
    pub fn planes_around(&self, place: DVec3) -> [Vec4; 5] {
        self.planes.map(|(normal, distance)| normal.extend(distance + normal.dot(place)).as_vec4())
    }

    /// Returns `Outside` only if the box is wholly behind one plane. The slack keeps rounding from culling boxes that touch a plane.
    pub fn side(&self, bounds: &Aabb) -> Containment {
        let (center, half) = (bounds.center(), bounds.size() * 0.5);
        let slack = 1e-9 * (center.length() + half.length());
        let mut side = Containment::Inside;
        for (normal, distance) in &self.planes {
            let (at, reach) = (normal.dot(center) + distance, normal.abs().dot(half));
            if at + reach < -slack {
                return Containment::Outside;
            }
            if at - reach < slack {
                side = Containment::Across;
            }
        }
        side
    }

    /// False only if the box is wholly behind one plane.
    pub fn may_see(&self, bounds: &Aabb) -> bool {
        self.side(bounds) != Containment::Outside
    }

    /// False only if the sphere is wholly behind one plane.
    pub fn may_reach(&self, sphere: &Reach) -> bool {
        self.planes.iter().all(|(normal, distance)| normal.dot(sphere.center) + distance >= -sphere.radius)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::plan::samples::vector;
    use crate::scene::Projection;

    fn unit_box_at(center: DVec3) -> Aabb {
        Aabb { min: center - 0.5, max: center + 0.5 }
    }

    #[test]
    fn a_box_is_seen_in_front_of_the_camera_and_not_behind_or_beside_it() {
        let camera = Camera { position: DVec3::ZERO, ..Camera::default() };
        let frustum = Frustum::of(&camera, 1.0);
        assert!(frustum.may_see(&unit_box_at(DVec3::new(0.0, 0.0, -5.0))));
        assert!(!frustum.may_see(&unit_box_at(DVec3::new(0.0, 0.0, 5.0))));
        assert!(!frustum.may_see(&unit_box_at(DVec3::new(20.0, 0.0, -5.0))));
        assert!(!frustum.may_see(&unit_box_at(DVec3::new(0.0, -20.0, -5.0))));
    }

    #[test]
    fn a_box_around_the_camera_and_one_far_away_are_seen() {
        let camera = Camera { position: DVec3::splat(1e6), ..Camera::default() };
        let frustum = Frustum::of(&camera, 2.0);
        assert!(frustum.may_see(&unit_box_at(camera.position)));
        assert!(frustum.may_see(&unit_box_at(camera.position + DVec3::new(0.0, 0.0, -1e9))));
    }

    /// A point in clip space: x and y over w, as the shader has it, in f64.
    fn is_in_clip_volume(camera: &Camera, aspect: f64, point: DVec3) -> bool {
        let offset = point - camera.position;
        let (w, tan_y) = (offset.dot(camera.forward()), camera.half_height());
        let (x, y) = (offset.dot(camera.right()) / (tan_y * aspect), offset.dot(camera.up()) / tan_y);
        w >= camera.near && x.abs() <= w && y.abs() <= w
    }

    proptest! {
        #[test]
        fn a_box_of_which_any_point_is_in_view_is_never_dropped(
            position in vector(100.0), target in vector(10.0), fov in 1.0..179.0f64, aspect in 0.1..10.0f64,
            center in vector(60.0), half in [0.0..40.0, 0.0..40.0, 0.0..40.0f64], far in 0..4i32,
            inside in proptest::collection::vec([0.0..1.0, 0.0..1.0, 0.0..1.0f64], 16),
        ) {
            // The test is repeated far from the origin, where f64 rounds.
            let shift = DVec3::splat(if far == 0 { 0.0 } else { 10f64.powi(far * 3) });
            let camera = Camera {
                projection: Projection::perspective(fov),
                ..Camera::looking_at(position + shift, target + shift, DVec3::Y)
            };
            let bounds = Aabb { min: center - DVec3::from(half) + shift, max: center + DVec3::from(half) + shift };
            let points = inside.iter().map(|&t| bounds.min + DVec3::from(t) * bounds.size()).chain(bounds.corners());
            if points.into_iter().any(|point| is_in_clip_volume(&camera, aspect, point)) {
                prop_assert!(Frustum::of(&camera, aspect).may_see(&bounds));
            }
        }
    }
}
