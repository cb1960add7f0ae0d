//! Rays through the places of a picture.

use glam::{DVec2, DVec3};

use super::CameraView;
use super::intersect::Ray;
use afterlight_scene::ThinLens;

/// A view that is decided: rays through a picture.
#[derive(Debug, Clone, Copy)]
pub(super) struct CameraRays {
    pub(super) size: DVec2,
    pub(super) near: f64,
    pub(super) eye: DVec3,
    forward: DVec3,
    /// From the middle of the picture to its right and lower edges: at a distance of 1, or anywhere where rays are parallel.
    right: DVec3,
    down: DVec3,
    pub(super) parallel: bool,
    lens: Option<ThinLens>,
}

impl CameraRays {
    pub(super) fn of(view: &CameraView) -> Self {
        let camera = &view.camera;
        let size = DVec2::new(f64::from(view.size[0]), f64::from(view.size[1]));
        let half = camera.half_height();
        Self {
            size,
            near: camera.near,
            eye: camera.position,
            forward: camera.forward() + camera.aside(),
            right: camera.right() * (half * size.x / size.y),
            down: -camera.up() * half,
            parallel: camera.is_orthographic(),
            lens: None,
        }
    }

    /// Through a lens, if there is one.
    pub(super) fn with_lens(self, lens: Option<ThinLens>) -> Self {
        Self { lens, ..self }
    }

    /// Returns the ray through a place of the picture, in pixels from its upper left corner. Distances along it are distances along the view.
    /// Parallel rays have different origins.
    pub(super) fn ray(&self, place: DVec2) -> Ray {
        let at = place * 2.0 / self.size - 1.0;
        let aside = self.right * at.x + self.down * at.y;
        match self.parallel {
            true => Ray::new(self.eye + aside, self.forward),
            false => Ray::new(self.eye, self.forward + aside),
        }
    }

    /// To the right, up and along the view, each of length 1, and where the eye is.
    pub(super) fn axes(&self) -> [DVec3; 4] {
        let [right, down] = [self.right.normalize(), self.down.normalize()];
        [right, -down, right.cross(down), self.eye]
    }

    /// Returns the pixels that a metre across the view spans, so far along it.
    pub(super) fn pixels_a_metre(&self, distance: f64) -> f64 {
        let metres = self.down.length() * if self.parallel { 1.0 } else { distance };
        self.size.y / 2.0 / metres
    }

    /// Returns true if each place of the picture has one ray, as without a lens.
    pub(super) fn sees_through_a_point(&self) -> bool {
        self.lens.is_none()
    }

    /// Returns the point at a distance along the view, relative to the camera.
    pub(super) fn place(&self, at: DVec2, distance: f64) -> DVec3 {
        let ray = self.ray(at);
        ray.origin - self.eye + ray.direction * distance
    }

    /// Returns the distance along the view of a place, which is relative to the camera.
    pub(super) fn distance(&self, place: DVec3) -> f64 {
        place.dot(self.forward)
    }

    /// Returns its place in the picture, in pixels from the upper left corner.
    pub(super) fn seen_at(&self, place: DVec3) -> DVec2 {
        let at = DVec2::new(
            place.dot(self.right) / self.right.length_squared(),
            place.dot(self.down) / self.down.length_squared(),
        );
        let at = if self.parallel { at } else { at / self.distance(place) };
        (at + 1.0) * self.size / 2.0
    }

    /// Returns the direction from a place to the eye, a unit vector.
    pub(super) fn eye_from(&self, place: DVec3) -> DVec3 {
        if self.parallel { -self.forward } else { -place.normalize() }
    }

    /// Through a place of the picture and a point of the unit disc that stands for the lens, to the right and down: through the middle it meets the
    /// plane that is sharp at the same place.
    pub(super) fn through(&self, place: DVec2, point: impl FnOnce() -> DVec2) -> Ray {
        let middle = self.ray(place);
        let Some(ThinLens { radius, focus }) = self.lens else { return middle };
        let point = point() * radius;
        let beside = self.right.normalize() * point.x + self.down.normalize() * point.y;
        Ray::new(middle.origin + beside, middle.direction - beside / focus)
    }
}
