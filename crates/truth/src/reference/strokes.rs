//! Points and lines of the truth: each a rectangle of the picture, one pixel wide, which reaches half a pixel beyond both ends.
//!
//! The picture alone has them: a ray from the eye meets a stroke where its pixel place lies in the rectangle, and rays that begin on surfaces meet none. So
//! they cast no shadow, hide no sky and are not mirrored, and a stroke that is seen through a lens is one pixel wide from each of its points.
//!
//! Places are relative to the ray: X and Y across the picture in pixels, both times the distance W along the view, which is 1 where rays are parallel. Along a
//! line X, Y and W are linear, also where it runs past the eye. The near plane cuts the line, not the rectangle around it.

use glam::{DVec2, DVec3};

use super::Billboards;
use super::geometry::{Geometry, Hit};
use super::intersect::{Crossing, Ray};
use super::rays::CameraRays;
use super::render::Reference;

/// A line whose direction across the picture is smaller, as a share of its length, is seen end on: a point.
const END_ON: f64 = 1e-6;
/// Half the width, and how far a stroke reaches beyond its ends, in pixels.
const HALF: f64 = 0.5;

/// The strokes of a scene as the rays of a picture see them.
pub(super) struct Strokes<'a> {
    geometry: &'a Geometry<'a>,
    /// The first triangle of each stroke.
    all: &'a [usize],
    /// For each row of the picture, the strokes that may be visible there; `None` if any stroke may be visible in any row.
    rows: Option<Vec<Vec<u32>>>,
    near: f64,
    parallel: bool,
    forward: DVec3,
    /// From metres to pixels at a distance of 1, or anywhere where rays are parallel.
    right: DVec3,
    down: DVec3,
}

/// What the rays of a picture alone meet.
pub(super) struct Overlay<'a> {
    pub billboards: Billboards<'a>,
    pub strokes: Strokes<'a>,
}

impl Reference<'_> {
    pub(super) fn overlay(&self, rays: &CameraRays) -> Overlay<'_> {
        Overlay { billboards: self.billboards(rays), strokes: Strokes::of(&self.geometry, rays) }
    }

    /// The nearest opaque surface on one of a picture's rays.
    pub(super) fn seen_on(&self, ray: &Ray, rays: &CameraRays) -> Option<Hit> {
        let strokes = Strokes::unsorted(&self.geometry, rays);
        self.geometry.seen_with(ray, rays.near, |visit| strokes.met(ray, 0, visit), &mut Vec::new())
    }
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

    /// Returns the strokes for a few rays, not sorted into rows.
    pub fn unsorted(geometry: &'a Geometry<'a>, rays: &CameraRays) -> Self {
        let [right, up, forward, _] = rays.axes();
        let pixels = rays.pixels_a_metre(1.0);
        let (right, down) = (right * pixels, -up * pixels);
        let (near, parallel) = (rays.near, rays.parallel);
        Self { geometry, all: &geometry.strokes, rows: None, near, parallel, forward, right, down }
    }

    /// The first row in which a stroke may be seen, and the row after the last one; `None` where all of it lies before the near plane.
    fn rows_of(&self, triangle: usize, ray: &Ray) -> Option<[f64; 2]> {
        let ends = self.ends(triangle, ray);
        let [first, last] = self.seen_part(&ends)?;
        let rows = [first, last].map(|share| ends[0].towards(&ends[1], share)).map(|end| end.across.y / end.w);
        Some([rows[0].min(rows[1]).floor() - 2.0, rows[0].max(rows[1]).ceil() + 2.0])
    }

    /// Returns the part of a line beyond the near plane, as shares of its length; `None` if all of the line lies before it.
    fn seen_part(&self, [a, b]: &[End; 2]) -> Option<[f64; 2]> {
        if a.distance.max(b.distance) < self.near {
            return None;
        }
        // Parallel rays need no end before the near plane: places on the picture are finite there.
        if self.parallel {
            return Some([0.0, 1.0]);
        }
        let cut = (self.near - a.distance) / (b.distance - a.distance);
        Some([if a.distance < self.near { cut } else { 0.0 }, if b.distance < self.near { cut } else { 1.0 }])
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
        let ends = self.ends(triangle, ray);
        let [first, last] = self.seen_part(&ends)?;
        let [a, b] = [first, last].map(|share| ends[0].towards(&ends[1], share));
        let along = direction(&ends[0], &ends[1]);
        let across = DVec2::new(-along.y, along.x);
        let reached = |end: End, by: f64| End { across: end.across + along * (by * end.w), ..end };
        let [a, b] = [reached(a, -HALF), reached(b, HALF)];
        // From the ray to both ends, in pixels, and the share of the line beside it.
        let (before, behind) = (-a.across.dot(along) / a.w, b.across.dot(along) / b.w);
        let (from, to) = (a.across.dot(along), b.across.dot(along));
        let share = (from / (from - to)).clamp(0.0, 1.0);
        let here = a.towards(&b, share);
        let off = here.across.dot(across) / here.w;
        let edges = [(before, -along), (behind, along), (HALF + off, across), (HALF - off, -across)];
        if here.distance < self.near * (1.0 - 1e-12) || !edges.into_iter().all(is_within) {
            return None;
        }
        let share = first + (last - first) * share;
        let crossing =
            Crossing { distance: here.distance, weights: [1.0 - share, share, 0.0], counter_clockwise: true };
        Some(Hit { triangle, crossing, front: true })
    }
}

/// Returns true if a place lies inside an edge that faces `outward`, at a distance of `within` pixels. A place on the edge is inside as for a
/// rasterizer ("top-left rule"): otherwise a stroke of one pixel would be two pixels wide where its edges meet two centres. False for a NaN.
fn is_within((within, outward): (f64, DVec2)) -> bool {
    // Roundings of two rays must agree about an edge between them.
    const ROUNDING: f64 = 1e-9;
    within >= ROUNDING || within > -ROUNDING && (outward.y < -ROUNDING || outward.y < ROUNDING && outward.x < 0.0)
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

/// Returns the direction on the picture from one end to the other, of length 1: the derivative of X / W and Y / W along the line.
fn direction(a: &End, b: &End) -> DVec2 {
    let size = |v: DVec3| v / v.abs().max_element().max(f64::MIN_POSITIVE);
    let here = size(a.across.extend(a.w));
    let step = size((b.across - a.across).extend(b.w - a.w));
    let derivative = step.truncate() * here.z - here.truncate() * step.z;
    if derivative.abs().max_element() > END_ON { derivative.normalize() } else { DVec2::X }
}

#[cfg(test)]
mod tests {
    use afterlight_scene::{Camera, Material, Mesh, Object, Projection, Scene, ThinLens};
    use glam::DAffine3;

    use super::super::CameraView;
    use super::*;

    const SIZE: [u32; 2] = [40, 30];

    fn scene_of(strokes: &[[DVec3; 2]]) -> Scene {
        Scene {
            meshes: vec![Mesh::of_strokes("strokes", strokes)],
            materials: vec![Material::default()],
            objects: vec![Object::new("strokes", 0, 0, DAffine3::IDENTITY)],
            ..Scene::default()
        }
    }

    fn camera(parallel: bool) -> Camera {
        let projection = if parallel { Projection::orthographic(3.0) } else { Projection::perspective(60.0) };
        Camera { projection, near: 0.1, ..Camera::looking_at(DVec3::new(1.0, 2.0, 3.0), DVec3::ZERO, DVec3::Y) }
    }

    /// The distances at which a ray meets strokes.
    fn met(strokes: &Strokes, ray: &Ray, row: usize) -> Vec<f64> {
        let mut distances = Vec::new();
        strokes.met(ray, row, |hit| distances.push(hit.crossing.distance));
        distances
    }

    #[test]
    fn a_ray_meets_a_stroke_where_its_place_lies_in_the_rectangle() {
        let mut random = fastrand::Rng::with_seed(3);
        let mut place = || DVec3::new(random.f64() - 0.5, random.f64() - 0.5, random.f64() - 0.5) * 2.0;
        let (mut inside, mut outside) = (0, 0);
        for turn in 0..40 {
            let ends = [place(), place()];
            let scene = scene_of(&[ends]);
            let geometry = Geometry::of(&scene);
            let rays = CameraRays::of(&CameraView { camera: camera(turn % 2 == 0), size: SIZE });
            let strokes = Strokes::of(&geometry, &rays);
            // The whole line lies before the camera, so its ends can be projected.
            let [a, b] = ends.map(|end| rays.seen_at(end - rays.eye));
            let along = (b - a).normalize();
            for y in 0..SIZE[1] {
                for x in 0..SIZE[0] {
                    let pixel = DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5);
                    let (beside, on) = ((pixel - a).perp_dot(along).abs(), (pixel - a).dot(along));
                    let margin = (0.5 - beside).min(on + 0.5).min((b - a).length() + 0.5 - on);
                    let ray = rays.ray(pixel);
                    let found = met(&strokes, &ray, y as usize);
                    assert_eq!(found.len(), usize::from(margin > 0.0), "{turn}: {x} {y}, {margin}");
                    if let [distance] = found[..] {
                        inside += 1;
                        // Within a pixel or two of the line.
                        let [p, q] = ends;
                        let from = ray.at(distance) - p;
                        let share = (from.dot(q - p) / (q - p).length_squared()).clamp(0.0, 1.0);
                        let off = (from - (q - p) * share).length();
                        assert!(off * rays.pixels_a_metre(distance) < 3.0, "{turn}: {x} {y}, {off}");
                    } else {
                        outside += 1;
                    }
                }
            }
        }
        assert!(inside > 400 && outside > 10_000, "{inside} {outside}");
    }

    #[test]
    fn a_point_on_the_border_of_pixels_is_one_pixel() {
        // The middle of the picture lies where four pixels meet.
        let camera = camera(false);
        let scene = scene_of(&[[camera.position + camera.forward() * 2.0; 2]]);
        let geometry = Geometry::of(&scene);
        let rays = CameraRays::of(&CameraView { camera: Camera { rotation: camera.rotation, ..camera }, size: SIZE });
        let strokes = Strokes::of(&geometry, &rays);
        let around = [[19, 14], [20, 14], [19, 15], [20, 15]];
        let is_met =
            |&[x, y]: &[usize; 2]| !met(&strokes, &rays.ray(DVec2::new(x as f64 + 0.5, y as f64 + 0.5)), y).is_empty();
        // The one whose centre is on the upper and the left edge.
        assert_eq!(around.into_iter().filter(is_met).collect::<Vec<_>>(), [[19, 14]]);
    }

    #[test]
    fn through_a_lens_a_stroke_in_focus_stays_in_its_place_and_others_move() {
        let camera = camera(false);
        let focus = 2.0;
        for (distance, stays) in [(focus, true), (1.0, false)] {
            let scene = scene_of(&[[camera.position + camera.forward() * distance + camera.right() * 0.01; 2]]);
            let geometry = Geometry::of(&scene);
            let lens = Some(ThinLens { radius: 0.2, focus });
            let rays = CameraRays::of(&CameraView { camera, size: SIZE }).with_lens(lens);
            let strokes = Strokes::of(&geometry, &rays);
            let place = rays.seen_at(camera.forward() * distance + camera.right() * 0.01);
            for point in [DVec2::ZERO, DVec2::X, DVec2::NEG_Y] {
                let found = met(&strokes, &rays.through(place, || point), 0).len();
                assert_eq!(found, usize::from(stays || point == DVec2::ZERO), "{distance} {point}");
            }
        }
    }

    #[test]
    fn a_line_past_the_eye_is_met_before_it_and_not_behind() {
        let camera = camera(false);
        let (eye, forward, right) = (camera.position, camera.forward(), camera.right());
        let scene = scene_of(&[[eye + forward * 4.0, eye - forward * 4.0 + right], [eye - forward; 2]]);
        let geometry = Geometry::of(&scene);
        let rays = CameraRays::of(&CameraView { camera, size: SIZE });
        let strokes = Strokes::of(&geometry, &rays);
        let (mut left, mut right_side) = (0, 0);
        for x in 0..SIZE[0] {
            let ray = rays.ray(DVec2::new(f64::from(x) + 0.5, 15.2));
            let found = met(&strokes, &ray, 15);
            assert!(found.len() <= 1 && found.iter().all(|distance| (0.1..=4.1).contains(distance)), "{x}: {found:?}");
            if x < 19 {
                left += found.len()
            } else if x > 19 {
                right_side += found.len()
            }
        }
        // It begins in the picture's middle, half a pixel from the centre of pixel 19.
        assert_eq!((left, right_side), (0, 20));
    }
}
