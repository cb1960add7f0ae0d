//! Points and lines of the truth: each a rectangle of the picture, one pixel wide, which reaches half a pixel beyond both ends.
//!
//! The picture alone has them: a ray from the eye meets a stroke where its pixel place lies in the rectangle, and rays that begin on surfaces meet none. So
//! they cast no shadow, hide no sky and are not mirrored, and a stroke that is seen through a lens is one pixel wide from each of its points.
//!
//! Places are relative to the ray: X and Y across the picture in pixels, both times the distance W along the view, which is 1 where rays are parallel. Along a
//! line X, Y and W are linear, also where it runs past the eye.

use glam::{DVec2, DVec3};

use super::geometry::{Geometry, Hit};
use super::intersect::{Crossing, Ray};
use super::rays::CameraRays;

/// A line whose direction across the picture is smaller, as a share of its length, is seen end on: a point.
const END_ON: f64 = 1e-6;
/// Half the width, and how far a stroke reaches beyond its ends, in pixels.
const HALF: f64 = 0.5;

/// The strokes of a scene as the rays of a picture see them.
pub(super) struct Strokes<'a> {
    geometry: &'a Geometry<'a>,
    /// Their first triangles.
    all: &'a [usize],
    /// By row of the picture, which of them may be seen there; none where each may be.
    rows: Option<Vec<Vec<u32>>>,
    near: f64,
    parallel: bool,
    forward: DVec3,
    /// From metres to pixels at a distance of 1, or anywhere where rays are parallel.
    right: DVec3,
    down: DVec3,
}

/// An end, relative to a ray.
#[derive(Debug, Clone, Copy)]
struct End {
    across: DVec2,
    w: f64,
    distance: f64,
}

impl<'a> Strokes<'a> {
    /// Sorted into the rows of the picture, if all of its rays come from one eye.
    pub fn of(geometry: &'a Geometry<'a>, rays: &CameraRays) -> Self {
        let mut own = Self::unsorted(geometry, rays);
        if !own.all.is_empty() && rays.sees_through_a_point() {
            let height = rays.size.y as usize;
            let mut rows = vec![Vec::new(); height];
            let ray = rays.ray(DVec2::ZERO);
            for (index, &triangle) in (0u32..).zip(own.all) {
                let Some([first, last]) = own.rows_of(triangle, &ray) else { continue };
                let place = |row: f64| row.clamp(0.0, height as f64) as usize;
                rows[place(first)..place(last)].iter_mut().for_each(|row| row.push(index));
            }
            own.rows = Some(rows);
        }
        own
    }

    /// For a few rays.
    pub fn unsorted(geometry: &'a Geometry<'a>, rays: &CameraRays) -> Self {
        let [right, up, forward, _] = rays.axes();
        let pixels = rays.pixels_a_metre(1.0);
        let (right, down) = (right * pixels, -up * pixels);
        let (near, parallel) = (rays.near, rays.parallel);
        Self { geometry, all: &geometry.strokes, rows: None, near, parallel, forward, right, down }
    }

    /// The first row in which a stroke may be seen, and the row after the last one; `None` where all of it lies before the near plane.
    fn rows_of(&self, triangle: usize, ray: &Ray) -> Option<[f64; 2]> {
        let [a, b] = self.ends(triangle, ray);
        let cut = |end: End, other: End| {
            let share = (self.near - end.distance) / (other.distance - end.distance);
            if end.distance >= self.near { end } else { end.towards(&other, share) }
        };
        if a.distance.max(b.distance) < self.near {
            return None;
        }
        let rows = [cut(a, b), cut(b, a)].map(|end| end.across.y / end.w);
        Some([rows[0].min(rows[1]).floor() - 2.0, rows[0].max(rows[1]).ceil() + 2.0])
    }

    fn ends(&self, triangle: usize, ray: &Ray) -> [End; 2] {
        let [first, last, _] = self.geometry.triangles[triangle].corners;
        [first, last].map(|place| {
            let from = place - ray.origin;
            let distance = from.dot(self.forward);
            let off = from - ray.direction * distance;
            let across = DVec2::new(off.dot(self.right), off.dot(self.down));
            End { across, w: if self.parallel { 1.0 } else { distance }, distance }
        })
    }

    /// Calls `visit` with each stroke that a ray through this row of the picture meets.
    pub fn met(&self, ray: &Ray, row: usize, mut visit: impl FnMut(Hit)) {
        match &self.rows {
            Some(rows) => {
                let own = rows[row].iter().map(|&index| self.all[index as usize]);
                own.filter_map(|triangle| self.crossing(triangle, ray)).for_each(visit);
            }
            None => self.all.iter().filter_map(|&triangle| self.crossing(triangle, ray)).for_each(&mut visit),
        }
    }

    fn crossing(&self, triangle: usize, ray: &Ray) -> Option<Hit> {
        let [a, b] = self.ends(triangle, ray);
        let along = direction(&a, &b);
        let across = DVec2::new(-along.y, along.x);
        let reached = |end: End, by: f64| End { across: end.across + along * (by * end.w), ..end };
        let [a, b] = [reached(a, -HALF), reached(b, HALF)];
        // The share at which the stroke is beside the ray.
        let (from, to) = (a.across.dot(along), b.across.dot(along));
        let share = from / (from - to);
        // False for a NaN.
        if !(0.0..=1.0).contains(&share) {
            return None;
        }
        let here = a.towards(&b, share);
        let off = here.across.dot(across) / here.w;
        let beyond = if share == 0.0 { Some(-along) } else { (share == 1.0).then_some(along) };
        let beside = (off.abs() == HALF).then_some(across * -off);
        let has_edges = beyond.into_iter().chain(beside).all(is_own);
        if here.distance < self.near || off.abs() > HALF || !has_edges {
            return None;
        }
        let crossing =
            Crossing { distance: here.distance, weights: [1.0 - share, share, 0.0], counter_clockwise: true };
        Some(Hit { triangle, crossing, front: true })
    }
}

/// Returns true if a place that lies this way from a stroke's middle, on its edge, is the stroke's: as in rasterizers ("top-left rule"), so that a stroke of
/// one pixel is not two pixels wide where its edges meet two centres.
fn is_own(off: DVec2) -> bool {
    off.y < 0.0 || off.y == 0.0 && off.x < 0.0
}

impl End {
    fn towards(&self, other: &Self, share: f64) -> Self {
        Self {
            across: self.across.lerp(other.across, share),
            w: self.w + (other.w - self.w) * share,
            distance: self.distance + (other.distance - self.distance) * share,
        }
    }
}

/// The direction on the picture from one end to the other, of length 1: that of the derivative of X / W and Y / W along the line.
fn direction(a: &End, b: &End) -> DVec2 {
    let size = |v: DVec3| v / v.abs().max_element().max(f64::MIN_POSITIVE);
    let here = size(a.across.extend(a.w));
    let step = size((b.across - a.across).extend(b.w - a.w));
    let derivative = step.truncate() * here.z - here.truncate() * step.z;
    if derivative.abs().max_element() > END_ON { derivative.normalize() } else { DVec2::X }
}
